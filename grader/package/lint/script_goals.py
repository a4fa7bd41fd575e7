"""Finds callbacks of actions that end their goal and go on, or cannot be cancelled, for `slips.py`.

Nothing is executed. Python 3.8, standard library only.
"""

import ast

from script_callbacks import BELOW_LIMIT, excludes
from script_names import (
    set_in,
)
from script_tree import (
    LOOPS,
    all_of,
    argument,
    called_name,
    calls_in,
    dotted,
    is_call_alone,
    names_in,
    parents_of,
    slip,
    statements_of,
)
from script_unsent import FINISHING


def finished_goals(tree):
    """Where an `if` of an action's callback ends the goal last of all, and the callback goes on below it."""
    parents = parents_of(tree)
    for node in all_of(tree, ast.If):
        ending, flags = ending_call(node)
        # With an `else`, what stands below is meant for both cases
        if node.orelse or ending is None:
            continue
        call, around = ending.value, parents.get(node)
        if flags and not (isinstance(around, LOOPS) and flags.isdisjoint(asked_in(around, node))):
            continue
        block = statements_of(around)
        at = block.index(node) + 1 if node in block else len(block)
        below = [one for one in block[at : at + BELOW_LIMIT] if not is_other_case(one, node)]
        # a loop may also be there to stop the robot
        more = any(calls_in(one, *FINISHING, "publish_feedback") for one in below)
        in_loop = isinstance(around, LOOPS)
        if more or (in_loop and not is_last_turn(around, node, call)):
            what = "loop" if in_loop else "callback"
            message = "the goal is over with `%s(…)`, and the %s goes on" % (called_name(call), what)
            ends = "continue" if in_loop and calls_in(around, "accept_new_goal") else "return"
            fix = "below line %d, write `%s`" % (node.body[-1].end_lineno, ends)
            yield slip(call.lineno, "goes-on", message, fix, called_name(call))


def finished_in_loops(tree):
    """Where the first turn of a loop that reports on its way ends an action's goal, and the loop goes on."""
    for loop in all_of(tree, *LOOPS):
        alone = [one.value for one in loop.body if is_call_alone(one)]
        ending = [one for one in alone if called_name(one) in FINISHING]
        left = any(isinstance(one, (ast.Break, ast.Return)) for one in loop.body)
        takes = calls_in(loop, "accept_new_goal", "is_active")
        # as of `for goal in goals:` and `goal = waiting.get()`
        takes = takes or set_in(loop) & {dotted(one.func.value) for one in ending}
        if ending and not left and not takes and calls_in(loop, "publish_feedback"):
            call, end = ending[-1], loop.end_lineno
            message = "`%s(…)` is inside of the loop on line %d, whose first turn ends the goal"
            fix = "move line %d out of the loop, below its last line, %d, with the same spaces or tabs before it "
            fix += "as line %d has"
            fix %= (call.lineno, end, loop.lineno)
            yield slip(
                call.lineno, "goes-on", message % (called_name(call), loop.lineno), fix, called_name(call)
            )


def is_other_case(node, before):
    """Whether an `if` asks for the opposite of one above it, or whether the goal is still active."""
    if not isinstance(node, ast.If):
        return False
    # `if not done:` below `if done:` does not run in the same turn
    return bool(calls_in(node.test, "is_active")) or excludes(node.test, before.test)


def is_last_turn(loop, node, call):
    """Whether an `if` that ends a goal also ends the loop around it by what it sets, or the loop has one goal after the
    other."""
    if isinstance(loop, ast.For):
        # Each turn ends another goal, so that none is ended twice
        return dotted(loop.target) == dotted(call.func.value)
    stored = {dotted(target) for n in node.body if isinstance(n, ast.Assign) for target in n.targets}
    takes = any(calls_in(one, "accept_new_goal") for one in loop.body[:BELOW_LIMIT])
    return bool(takes or calls_in(loop.test, "is_active") or stored & names_in(loop.test))


def ending_call(node):
    """Return the statement of an `if` that ends a goal, with the names that those below it set; None where it ends
    none, or where something else stands below."""
    last, flags = len(node.body) - 1, set()
    while last > 0 and is_plain_step(node.body[last]):
        flags |= {dotted(target) for target in getattr(node.body[last], "targets", [])}
        last -= 1
    one = node.body[last]
    return (one if is_call_alone(one) and called_name(one.value) in FINISHING else None), flags


def is_plain_step(one):
    """Whether it sets a name, or logs."""
    return isinstance(one, ast.Assign) or (
        is_call_alone(one) and called_name(one.value).startswith(("print", "log"))
    )


def asked_in(loop, without):
    """Return the names that a loop's own condition, and those of its `if`s but one, ask for."""
    asking = [n for n in ast.walk(loop) if isinstance(n, ast.If) and n is not without]
    return names_in(getattr(loop, "test", ast.Constant(None))).union(*(names_in(n.test) for n in asking))


def ended_without_result(tree):
    """Calls that end a goal and give it no result, or something else than the result that the function makes."""
    results = {}
    for own in all_of(tree, ast.FunctionDef):
        made = {
            dotted(n.targets[0]) for n in all_of(own, ast.Assign) if called_name(n.value).endswith("Result")
        }
        read = {dotted(n) for n in all_of(own, ast.Name, ast.Attribute) if isinstance(n.ctx, ast.Load)}
        if len(made) == 1 and made.isdisjoint(read):
            results.update((call, *made) for call in calls_in(own, "set_succeeded", "set_aborted"))
    for call in calls_in(tree, "set_succeeded", "set_aborted", "set_preempted"):
        name = dotted(call.func)
        if not call.args and not call.keywords:
            yield slip(call.lineno, "no-result", name, name=call.func.attr)
        elif call in results and call.args:
            fix = "write `%s(%s)`" % (name, results[call])
            yield slip(call.lineno, "no-result", name, fix, call.func.attr)


CANCELS = 3
"""The place of an `ActionServer`'s function for goals that are cancelled."""


def never_cancelled(tree):
    """An `ActionServer(…)` that is given no function for cancels, and a goal's thread of which `run()` is called."""
    functions = [n.name for n in all_of(tree, ast.FunctionDef) if "cancel" in n.name.lower()]
    for call in all_of(tree, ast.Call):
        if (
            called_name(call) == "ActionServer"
            and len(call.args) == CANCELS
            and not argument(call, CANCELS, "cancel_cb")
        ):
            message = (
                "the action server of line %d is given no function for goals that are cancelled" % call.lineno
            )
            name = functions[0] if len(functions) == 1 else "on_cancel"
            owner = "self." if dotted(call.args[-1]).startswith("self.") else ""
            fix = "on line %d, write `%s%s` behind `%s`" % (call.lineno, owner, name, dotted(call.args[-1]))
            yield slip(call.lineno, "wrong-value", message, fix, "uncancelled")
    threads = {
        n.name for n in all_of(tree, ast.ClassDef) if any(dotted(b).endswith("Thread") for b in n.bases)
    }
    made = [n for n in all_of(tree, ast.Assign) if called_name(n.value) in threads]
    names = {dotted(target) for n in made for target in n.targets} - {"..."}
    for call in (n.value for n in all_of(tree, ast.Expr) if is_call_alone(n)):
        owner, _, method = dotted(call.func).rpartition(".")
        if method == "run" and owner in names and not call.args:
            message = "`%s.run()` does its work here, not in a thread of its own: nothing else is heard until it ends"
            fix = "on line %d, write `%s.start()`" % (call.lineno, owner)
            yield slip(call.lineno, "wrong-value", message % owner, fix, "uncancelled")
