"""Finds what compiles in a student's Python and is not meant: `slips` of a syntax tree, for `syntax.py`.

What nothing calls, statements without an effect, imports. Names are for `script_names.py`, texts for `script_texts.py`,
objects for `script_objects.py`, callbacks for `script_callbacks.py`, what these print for `script_prints.py`, base
classes for `script_bases.py`, threads and generators for `script_threads.py`, ends of goals for `script_goals.py`,
loops for `script_loops.py`, their sleeps for `script_sleeps.py`, their rates for `script_rates.py`, values for
`script_values.py`, arithmetic for `script_arithmetic.py`, scans for `script_scans.py`, sides and frames for
`script_sides.py`, roots for `script_roots.py`, rows of grids for `script_grids.py`, counters for `script_counters.py`,
clocks for `script_clocks.py`, what functions return for `script_results.py`, calls that cannot work for
`script_calls.py`, publishers and messages that nothing uses for `script_unsent.py`. What a script spells in another
way, `script_rospy.py` and `script_spellings.py` write as finders look for it.

Nothing is executed. A file has to be parsed by ROS's own Python, which is to run it: Python 3.8, standard library only.
"""

import ast
import builtins
import importlib.util
import os
from importlib.machinery import PathFinder

import script_arithmetic as arithmetic
import script_bases
import script_callbacks as callbacks
import script_calls as calls
import script_clocks as clocks
import script_counters as counters
import script_goals as goals
import script_grids as grids
import script_loops as loops
import script_names as names
import script_objects as objects
import script_prints
import script_rates as rates
import script_results
import script_scans as scans
import script_sides as sides
import script_sleeps as sleeps
import script_threads
import script_unsent as unsent
import script_values as values
from script_rospy import spell_rospy_out, write_numbers
from script_spellings import spell_plainly
from script_texts import graph_names, said_texts
from script_tree import (
    LOOPS,
    all_of,
    called_name,
    calls_in,
    dotted,
    is_call_alone,
    names_in,
    parents_of,
    reads_names_in_texts,
    slip,
    statements_of,
    targets_of,
    walk,
)

SLIPS_LIMIT = 100
"""Of a file."""


def slips(tree, numbers=()):
    """What compiles and is not meant: names that are not called or not there, questions that wait for a keyboard.
    `numbers` are those that it has from other modules, by their names."""
    spell_plainly(tree)
    finders = (
        uncalled_and_asked, objects.names_of_objects, names.misspelt, names.misspelt_exceptions, rates.loop_rates,
        classes_of_modules, never_begun, rates.nanoseconds, rates.rates_for_times, rates.sleeps_within,
        rates.timers_once, rates.rates_made_once, counters.resets, never_run, names.of_the_function_around,
        loops.never_reached, loops.loops_that_never_go_round, loops.waits_without_not,
        loops.stopped_loops, loops.lacking_loops, loops.published_before,
        sleeps.sleepless_loops, sleeps.sleeps_twice, sleeps.publishes_twice, callbacks.callbacks,
        callbacks.waiting_callbacks, objects.queue_sizes, graph_names,
        objects.object_slips, said_texts, loops.deaf_loops, clocks.clock_values, counters.counter_slips,
        counters.counter_types, counters.counter_starts, without_effect, values.assigned_late, objects.hidden_names,
        objects.subscribed_again, imports, objects.taken_off, objects.unstarted_servers,
        values.wrong_values, values.decided_conditions,
        values.times_added_again, values.params_read_unset, values.defaults_first, values.overwritten_values,
        values.published_in_turn, values.letters_of_keys,
        arithmetic.arithmetic_slips, scans.scan_slips, values.flagged_loops,
        values.kept_velocities, values.values_never_set_back, values.emptied_files,
        script_prints.unprinted_messages, clocks.values_left_out, clocks.published_unchanged, clocks.times_of_above,
        unsent.unused_publishers, unsent.unsent_messages, unsent.changed_copies, unsent.lost_objects,
        unsent.read_to_set, rates.loops_of_numbers,
        goals.finished_goals, goals.finished_in_loops, goals.ended_without_result, clocks.sends_no_time, without_node,
        debuggers, script_results.results, rates.turns_taken_off, script_bases.unmade_bases, script_threads.waits,
        calls.calls_of_roscpp, calls.locks_taken_twice, calls.values_out_of_order, calls.params_read_early,
        calls.arguments_out_of_order, calls.bare_decorators, scans.first_scans,
        sides.named_sides, sides.numbers_of_way, sides.overlapping_sides, sides.frames_swapped, sides.frames_named,
        grids.rows_of_grids, script_results.unreturned_answers, goals.never_cancelled,
        script_results.swallowed_exceptions, script_results.dropped_errors, callbacks.closed_before,
    )  # fmt: skip
    as_written = {find: list(find(tree)) for find in OF_NAMES}
    own_words = spell_rospy_out(tree)
    write_numbers(tree, dict(numbers))
    found = []
    for find in finders:
        for one in as_written[find] if find in as_written else find(tree):
            told = ("fix",) if find in as_written else ("message", "fix")
            found.append({**one, **{key: own_words(one[key]) for key in told}})
    # of two that say why a name is not there, the first is about the class that it belongs to
    # reversed: of several with the same key the last one stays in a dict, and the first is wanted
    first = {(one["line"], one["name"]): one for one in reversed(found) if one["kind"] == "undefined"}
    found = [one for one in found if one["kind"] != "undefined" or first[one["line"], one["name"]] is one]
    return sorted(found, key=lambda one: one["line"])[:SLIPS_LIMIT]


def uncalled_and_asked(tree):
    """Functions that are named but not called, and questions that wait for a keyboard."""
    functions, kept = {n.name for n in all_of(tree, ast.FunctionDef, ast.ClassDef)}, targets_of(tree)
    values = {n.attr for n in all_of(tree, ast.Attribute) if isinstance(n.ctx, ast.Store)}
    values |= {n.name for n in all_of(tree, ast.FunctionDef) if n.decorator_list}  # as of a property
    count = 0
    for node in walk(tree):
        name = uncalled(node, functions)
        if name and name.rpartition(".")[2] not in values:
            count += 1
            takes = "…" if name.rpartition(".")[2] in TAKE_VALUES or name == "rospy.sleep" else ""
            message, fix = "`%s` is named but not called" % name, "write `%s(%s)`" % (name, takes)
            yield slip(node.lineno, "not-called", message, fix, name)
        name = asked(node, functions)
        if name and count < SLIPS_LIMIT:  # each looks through the whole script
            count += 1
            message = "`%s()` waits for someone to type, and a graded node gets no input" % name
            line = numbered(node, tree)
            fix = "delete line %d, which makes a number of it" % line if line else ""
            fix = decided_by(node, tree) or fix or keeps_alive(node, tree)
            yield slip(node.lineno, "input", message, fix, how_often(node, tree))
            if name == "input" and not line and kept.get(id(node), "...") != "...":
                yield slip(node.lineno, "typed-text", name, name=kept[id(node)])


def debuggers(tree):
    """Calls of Python's debugger, which waits for a keyboard."""
    for node in all_of(tree, ast.Call):
        if called_name(node) in ("set_trace", "breakpoint"):
            yield slip(node.lineno, "debugger", "", "", dotted(node.func))


def without_node(tree):
    """A script with topics, or one that does more than define names, that makes no node."""
    calls = {called_name(n) for n in all_of(tree, ast.Call)}
    # A file that only defines names is there to be imported, and needs no node of its own
    if "init_node" not in calls and (calls & {"Publisher", "Subscriber"} or does_something(tree)):
        fix = "make it a node: `rospy.init_node(…)`, then its topics, then `rospy.spin()` or a loop"
        yield slip(1, "no-init", "nothing in the script calls `rospy.init_node(…)`", fix)


def does_something(tree):
    """Return whether a file does more when it is run than to define names for others."""
    calls = any(isinstance(n, LOOPS) or is_call_alone(n) for n in tree.body)
    return calls or any(getattr(n, "id", "") == "__name__" for n in walk(tree))


WORKS = ("init_node", "publish", "spin", "sendTransform", "send_goal", "set_param")
"""What a function is there for: one that calls none of these may be a spare one."""


def never_run(tree):
    """Functions that make a node, publish or wait, and that nothing names; and an `if __name__ == '__main__':` that
    compares with another word, or another name."""
    named = {n.id for n in all_of(tree, ast.Name) if isinstance(n.ctx, ast.Load)}
    named |= {n.attr for n in all_of(tree, ast.Attribute)}
    plain = [n for n in tree.body if not isinstance(n, (ast.FunctionDef, ast.ClassDef))]
    calls = any(isinstance(n, ast.Call) for one in plain for n in ast.walk(one))
    is_module = not calls and not does_something(tree)
    if reads_names_in_texts(tree):
        named |= {n.name for n in all_of(tree, ast.FunctionDef)}  # each may be called by its name
    made = [n for n in all_of(tree, ast.Assign) if isinstance(n.value, ast.Call)]
    made_of = {dotted(n.value.func): dotted(n.targets[0]) for n in made}
    classes = all_of(tree, ast.ClassDef)
    of_class = {id(f): c.name for c in classes for f in c.body}
    plain = {c.name for c in classes} | {"object"}
    for one in classes:  # what a class of another module is the base of, that module may call
        if {dotted(base) for base in one.bases} - plain:
            plain.discard(one.name)
            named |= {f.name for f in one.body if isinstance(f, ast.FunctionDef)}
    known = names.given_names(tree, []) | set(dir(builtins))
    # of a module that only defines names, others may make all but what makes the node
    if not is_module or calls_in(tree, "init_node"):
        yield from never_made(tree, [c for c in classes if c.name in plain], named)
    for node in walk(tree):
        # A decorator may hand the function on to what calls it
        if isinstance(node, ast.FunctionDef) and node.name not in named and not node.decorator_list:
            # Python itself calls `__init__` and its like
            # of a module that only defines names, others may call all but what makes the node
            works = calls_in(node, *(WORKS[:1] if is_module else WORKS))
            if works and not node.name.startswith("__"):
                message, owner = "nothing calls `%s()`" % node.name, of_class.get(id(node), "")
                owner = owner and (made_of.get(owner) or owner + "()") + "."
                fix = handed_over(node, tree, owner)
                yield slip(node.lineno, "never-called", message, fix, owner + node.name)
        elif isinstance(node, ast.If) and isinstance(node.test, ast.Compare):
            odd, message = names.never_main(node, tree)
            # a name that is not there is told by `names.misspelt`
            if message and (not odd.isidentifier() or odd in known):
                yield slip(node.lineno, "main-guard", message)


SETS_UP = ("init_node", "Publisher", "Subscriber", "Service", "Timer", "SimpleActionServer")


def never_made(tree, classes, named):
    """The class that sets up all that a script has of ROS, where nothing calls it."""
    made = [f for c in classes for f in c.body if isinstance(f, ast.FunctionDef) and f.name == "__init__"]
    made = [f for f in made if calls_in(f, *SETS_UP)]
    whole, inner = calls_in(tree, *SETS_UP[1:]), [n for f in made for n in calls_in(f, *SETS_UP[1:])]
    owner = parents_of(tree)[made[0]] if len(made) == 1 and len(whole) == len(inner) else None
    if owner is None or owner.name in named or owner.decorator_list:
        return
    inside = set(ast.walk(owner))
    inits = [n.lineno for n in calls_in(tree, "init_node") if n not in inside]
    mains = [n.lineno for n in tree.body if isinstance(n, ast.If) and "__name__" in names_in(n.test)]
    where = "below line %d" % (inits + mains)[0] if inits or mains else "at the end of the script"
    asked = [a.arg for a in made[0].args.args[1 : len(made[0].args.args) - len(made[0].args.defaults)]]
    fix = "%s, write `%s = %s(%s)`" % (where, owner.name.lower(), owner.name, ", ".join(asked))
    message = "nothing calls `%s()`, so its `__init__` never runs" % owner.name
    yield slip(owner.lineno, "never-called", message, fix, owner.name)


def handed_over(function, tree, owner):
    """Return who has to be told of a callback, which takes one value, or how one that takes several is called; "" of
    another function."""
    taken = [one.arg for one in function.args.args if one.arg != "self"]
    if (len(taken) > 1 or (taken and calls_in(function, "set_param"))) and not function.args.defaults:
        return "call `%s%s(…)` with values for %s" % (owner, function.name, ", ".join(taken))
    # A callback is given one message, and a function that makes the node is the program's own beginning
    if len(taken) != 1 or function.args.defaults or calls_in(function, "init_node"):
        return ""
    name = (owner and "self.") + function.name
    if any(word in (function.name + taken[0]).lower() for word in ("timer", "event")):
        return "pass it: `rospy.Timer(rospy.Duration(…), %s)`" % name
    if "feedback" in (function.name + taken[0]).lower() and calls_in(tree, "send_goal"):
        return "pass it: `send_goal(…, feedback_cb=%s)`" % name
    return "pass it to what calls it: `rospy.Subscriber(…, %s)`" % name


METHODS = {
    "sleep", "spin", "publish", "loginfo", "init_node", "close", "start", "stop", "unregister", "shutdown",
    "signal_shutdown", "wait_for_server", "wait_for_result", "send_goal", "set_accepted", "set_succeeded",
    "set_aborted", "set_preempted", "publish_feedback",
}  # fmt: skip
"""Of rospy and of what it makes: called for what they do."""
TAKE_VALUES = {"publish", "loginfo", "init_node", "signal_shutdown", "send_goal", "publish_feedback"}


def uncalled(node, functions):
    """Return the function or method that a line names without brackets, and that it calls elsewhere or is known."""
    if isinstance(node, ast.Expr) and isinstance(node.value, ast.Attribute):
        owner, method = node.value.value, node.value.attr
        known = method in METHODS or method in functions
        made = "%s(…).%s" % (dotted(owner.func), method) if isinstance(owner, ast.Call) else ""
        return (made or dotted(node.value)) if known else None
    if isinstance(node, ast.Expr) and isinstance(node.value, ast.Name) and node.value.id in functions:
        return node.value.id
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
        return dotted(node.operand) if loops.is_shutdown(node.operand) else None
    if isinstance(node, (ast.While, ast.If)) and loops.is_shutdown(node.test):
        return dotted(node.test)
    return None


def asked(node, functions):
    if not isinstance(node, ast.Call):
        return None
    name = dotted(node.func)
    if name in ("input", "raw_input", "getpass"):
        return None if name in functions else name
    readers = ("sys.stdin.read", "sys.stdin.readline", "sys.stdin.readlines", "getpass.getpass")
    return name if name in readers else None


def how_often(node, tree):
    """Return "once" for what no loop around it does again, "paused" for what a loop does that sleeps, "" else."""
    around = [n for n in all_of(tree, *LOOPS) if node in ast.walk(n)]
    if not around:
        return "once"
    return "paused" if calls_in(around[-1], "sleep") else ""


def numbered(node, tree):
    """Return the line on which the variable that gets what is typed is made a number, `n = int(n)`; 0 for none."""
    assigned = [n for n in all_of(tree, ast.Assign) if n.lineno >= node.lineno]
    given = {dotted(n.targets[0]) for n in assigned if n.value is node}
    made = [n for n in assigned if called_name(n.value) in ("int", "float") and dotted(n.targets[0]) in given]
    own = [n for n in made if [dotted(one) for one in n.value.args] == [dotted(n.targets[0])]]
    return min((n.lineno for n in own), default=0)


def keeps_alive(node, tree):
    """Return what to write in place of an `input()` that only keeps the node from ending."""
    is_alone = isinstance(parents_of(tree).get(node), ast.Expr) and node.lineno == node.end_lineno
    if not is_alone or all_of(tree, *LOOPS) or calls_in(tree, "spin") or not calls_in(tree, "init_node"):
        return ""
    return "on line %d, write `rospy.spin()` in place of `input()`" % node.lineno


def decided_by(node, tree):
    """Return what to write in place of a question and of the `if`s that publish only after some of its answers."""
    parents = parents_of(tree)
    while node in parents and not isinstance(node, ast.stmt):
        node = parents[node]
    given = {dotted(t) for t in getattr(node, "targets", [])}
    block = statements_of(parents.get(node))
    below = block[block.index(node) + 1 :] if node in block else []
    deciding = [one for one in below if isinstance(one, ast.If) and given & names_in(one.test)]
    sent = [n for one in below for n in calls_in(one, "publish")]
    if not deciding or not sent or any(calls_in(one, "publish") for one in below if one not in deciding):
        return ""
    if any(calls_in(one, "sleep") for one in below[: below.index(deciding[-1]) + 1]):
        return ""  # without it, the node would flood its topic
    return "publish … in place of lines %d to %d" % (node.lineno, deciding[-1].end_lineno)


IMPORTS_LIMIT = 30


def imports(tree):
    """Imports of what nothing in the script uses, and of modules that this Python does not find; the standard library's
    and rospy are there and cost nothing."""
    every = all_of(tree, ast.Name)
    hidden = {n.id for n in every if isinstance(n.ctx, ast.Store)}
    # `String = String()` reads the import, or was meant to
    hidden -= {called_name(n.value) for n in all_of(tree, ast.Assign)}
    used = {n.id for n in every} - hidden
    tried = {id(n) for one in all_of(tree, ast.Try) for n in ast.walk(one)}
    found = [n for n in all_of(tree, ast.Import, ast.ImportFrom) if id(n) not in tried]
    in_texts = reads_names_in_texts(tree)
    for node in found[:IMPORTS_LIMIT]:
        bound = [alias.asname or alias.name.partition(".")[0] for alias in node.names]
        if isinstance(node, ast.Import):
            asked = [(one.name.partition(".")[0], one.name, bound[i]) for i, one in enumerate(node.names)]
        else:
            asked = [((node.module or "").partition(".")[0], node.module or "", bound[0])]
        asked = [one for one in asked if one[0] not in clocks.PLAIN_MODULES - {"numpy"}]
        if not asked or getattr(node, "level", 0):
            continue
        lacking = [one for one in asked if not is_there(one[0])]
        if not used.intersection(bound) and bound != ["*"] and "__all__" not in used and not in_texts:
            why = (
                "the script gives `%s` a value of its own"
                if hidden.issuperset(bound)
                else "nothing in the script uses `%s`"
            )
            fix = "delete line %d: %s" % (node.lineno, why % "`, `".join(bound))
            yield slip(node.lineno, "unused-import", (lacking or asked)[0][0], fix, bound[0])
        for module, whole, name in lacking[:IMPORTS_LIMIT]:
            yield slip(node.lineno, "lacking-import", module, whole if whole != module else "", name)


def is_there(module):
    """Return whether Python finds a module, without importing it; ROS's are on a path that an isolated Python leaves
    out."""
    path = os.environ.get("PYTHONPATH", "").split(os.pathsep)
    try:
        return bool(importlib.util.find_spec(module) or PathFinder.find_spec(module, [*filter(None, path)]))
    except (ImportError, ValueError, AttributeError):
        return False


SIGNS = {ast.Add: "+", ast.Sub: "-", ast.Mod: "%"}


def without_effect(tree):
    """Statements that compute something and keep nothing of it: `++i`, `i + 1`, `i == 0`; and `i = i`."""
    for node in walk(tree):
        name = dotted(getattr(node, "value", None))
        if isinstance(node, ast.Assign) and [dotted(t) for t in node.targets] == [name] != ["..."]:
            message, fix = "`{0} = {0}` changes nothing", "write `{0} = {0} + 1`, or whatever it should be,"
            yield slip(node.lineno, "no-effect", message.format(name), fix.format(name), name)
        value = node.value if isinstance(node, ast.Expr) else None
        if isinstance(value, ast.UnaryOp) and isinstance(value.operand, ast.UnaryOp):
            same = type(value.op) is type(value.operand.op) and isinstance(value.op, (ast.UAdd, ast.USub))
            name, sign = dotted(value.operand.operand), "+" if isinstance(value.op, ast.UAdd) else "-"
            if same and "..." not in name:
                message = "`%s%s` changes nothing in Python" % (2 * sign, name)
                yield slip(node.lineno, "no-effect", message, "write `%s %s= 1`" % (name, sign))
        elif isinstance(value, ast.BinOp) and type(value.op) in SIGNS:
            yield from computed_alone(node, value)
        elif isinstance(value, ast.Compare) and isinstance(value.ops[0], ast.Eq):
            name = dotted(value.left)
            if "..." not in name:
                right = value.comparators[0]
                right = repr(right.value) if isinstance(right, ast.Constant) else dotted(right)
                fix = "write `%s = %s`" % (name, right)
                fix = "write `%s =` in place of `%s ==`" % (name, name) if "..." in right else fix
                yield slip(node.lineno, "compared", "`%s ==` compares and gives no value" % name, fix)


def computed_alone(node, value):
    """`i + 1`, `(i + 1) % 128`, and `i % 128` and `i - 128`, which were to reset `i`, as lines of their own."""
    sign, left, number = SIGNS[type(value.op)], value.left, value.right
    is_sum = sign == "%" and isinstance(left, ast.BinOp) and isinstance(left.op, ast.Add)
    name, numbers = dotted(left.left if is_sum else left), [number, *([left.right] if is_sum else ())]
    if "..." in name or not all(isinstance(one, ast.Constant) for one in numbers):
        return
    counted = "(%s + %r)" % (name, left.right.value) if is_sum else name
    text = "%s %s %r" % (counted, sign, number.value)
    fix = "%s = %s" % (name, text) if is_sum else "%s %s= %r" % (name, sign, number.value)
    back = not is_sum and (sign == "%" or (sign == "-" and number.value != 1))
    yield slip(
        node.lineno,
        "compared" if back else "no-effect",
        "`%s` alone changes nothing" % text,
        "write `%s`" % fix,
    )


def classes_of_modules(tree):
    """`from queue import queue`: the class is meant, or the module where what it has is taken of it below."""
    named = [n for n in all_of(tree, ast.Name) if isinstance(n.ctx, ast.Load)]
    owners = {id(n.value) for n in all_of(tree, ast.Attribute)}
    for node in (n for n in all_of(tree, ast.ImportFrom) if n.module in names.CLASSES and len(n.names) == 1):
        one = node.names[0]
        meant = next((c for c in names.CLASSES[node.module] if c.lower() == one.name), None)
        uses = [n for n in named if n.id == (one.asname or one.name)]
        if meant is None or (any(id(n) in owners for n in uses) and one.name != node.module):
            continue
        fix = "write `import %s`" % node.module
        if not all(id(n) in owners for n in uses) or one.asname or not uses:
            alias = " as %s" % one.asname if one.asname else ""
            fix = "write `from %s import %s%s`" % (node.module, meant, alias)
            lines = sorted({n.lineno for n in uses if id(n) not in owners}) if not one.asname else []
            where = ", ".join(map(str, lines))
            fix += ", and %s instead of %s on line %s" % (meant, one.name, where) if lines else ""
        message = "the module %s has a class `%s`" % (node.module, meant)
        yield slip(node.lineno, "misspelt", message, fix, one.name)


def never_begun(tree):
    """Variables of a function that it only adds to: `n = n + 1` in a loop, where nothing gives `n` its first value."""
    shared = names.bound_names(tree) | {name for n in all_of(tree, ast.Global) for name in n.names}
    for function in all_of(tree, ast.FunctionDef):
        own = list(names.walk_own(function))
        stored = [n for n in own if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)]
        changed = [n for n in own if isinstance(n, (ast.Assign, ast.AugAssign))]
        counting = [n for n in changed if counters.added_number(n) is not None]
        added = {id(t): n for n in counting for t in counters.increments(n) if isinstance(t, ast.Name)}
        given = {n.id for n in stored if id(n) not in added} | shared
        given |= {n.arg for n in ast.walk(function.args) if isinstance(n, ast.arg)}
        given |= {n.asname or n.name for n in own if isinstance(n, ast.alias)}
        stored.sort(key=lambda n: n.lineno, reverse=True)
        lines = {n.id: added[id(n)].lineno for n in stored if n.id not in given}
        for name, line in lines.items():
            around = [n.lineno for n in own if isinstance(n, LOOPS) and n.lineno < line <= n.end_lineno]
            if around and not any(isinstance(n, ast.Nonlocal) for n in own):
                message = "nothing gives `%s` a value before line %d adds to it" % (name, line)
                fix = "above line %d, write `%s = 0`" % (min(around), name)
                yield slip(line, "undefined", message, fix, name)


OF_NAMES = (names.misspelt, objects.names_of_objects, objects.hidden_names, imports)
"""Finders to which it matters under which name a script has what is rospy's."""
