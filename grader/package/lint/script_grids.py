"""Finds rows of a grid that are made wrongly in a student's Python, for `slips.py`, answers of a service that are
filled in and never returned, and what keeps an action's goals from being cancelled.

Nothing is executed. Python 3.8, standard library only.
"""

import ast
import re

from script_names import walk_own
from script_tree import all_of, argument, called_name, calls_in, dotted, is_call_alone, slip

WIDE, HIGH = re.compile(r"(?:^|_)(?:width|w|cols|columns)$"), re.compile(r"(?:^|_)(?:height|h|rows)$")


def rows_of_grids(tree):
    """`[[0] * width] * height`, of which all rows are one, and `[[0 for _ in range(height)] for _ in range(width)]`."""
    for node in all_of(tree, ast.BinOp):
        outer = node.left if isinstance(node.op, ast.Mult) and isinstance(node.left, ast.List) else None
        inner = outer.elts[0] if outer is not None and len(outer.elts) == 1 else None
        is_row = isinstance(inner, ast.BinOp) and isinstance(inner.left, ast.List)
        if is_row or isinstance(inner, ast.List):
            count = repr(node.right.value) if isinstance(node.right, ast.Constant) else dotted(node.right)
            message = "all rows of this list are the same one, so that a change of one changes them all"
            cells = inner.left if is_row else inner
            value = [repr(one.value) if isinstance(one, ast.Constant) else "…" for one in cells.elts]
            row = "[%s]" % "".join(value) if len(cells.elts) < 2 and "…" not in value else "[…]"
            row += " * %s" % dotted(inner.right).replace("...", "…") if is_row else ""
            fix = "on line %d, write `[%s for _ in range(%s)]`" % (
                node.lineno,
                row,
                "…" if "..." in count else count,
            )
            yield slip(node.lineno, "wrong-value", message, fix, "shared")
    for node in all_of(tree, ast.ListComp):
        inner, row, columns = node.elt, range_in(node), range_in(node.elt)
        if (
            row
            and columns
            and WIDE.search(row.rpartition(".")[2])
            and HIGH.search(columns.rpartition(".")[2])
        ):
            line, message = node.lineno, "this makes `%s` rows, each of which has `%s` cells" % (row, columns)
            fix = "on line %d, swap `%s` and `%s`: a grid has a row for each step of its height"
            yield slip(line, "wrong-value", message, fix % (line, columns, row), "rows")


def range_in(node):
    """Return the name of the count in `[… for _ in range(count)]`, and in `[…] * count`; "" of all else."""
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Mult) and isinstance(node.left, ast.List):
        return dotted(node.right) if "..." not in dotted(node.right) else ""
    loop = node.generators[0] if isinstance(node, ast.ListComp) and len(node.generators) == 1 else None
    call = loop.iter if loop is not None and called_name(loop.iter) == "range" else None
    return (
        dotted(call.args[0])
        if call is not None and len(call.args) == 1 and "..." not in dotted(call.args[0])
        else ""
    )


def unreturned_answers(tree):
    """A function that makes an answer, sets its fields, and has no `return` with a value."""
    for own in all_of(tree, ast.FunctionDef):
        inside = list(walk_own(own))
        made = [n for n in inside if isinstance(n, ast.Assign) and called_name(n.value).endswith("Response")]
        returns = [n for n in inside if isinstance(n, (ast.Return, ast.Yield)) and n.value is not None]
        name = dotted(made[0].targets[0]) if len(made) == 1 else "..."
        stored = [n for n in inside if isinstance(n, ast.Attribute) and isinstance(n.ctx, ast.Store)]
        if returns or not isinstance(made[0].targets[0] if made else None, ast.Name) or name == "...":
            continue
        if any(dotted(n.value) == name for n in stored):
            last = own.body[-1].end_lineno
            message = "`%s` is made and filled in, and not returned" % name
            fix = "below line %d, write `return %s` at the end of `%s`" % (last, name, own.name)
            yield slip(made[0].lineno, "wrong-value", message, fix, "return")


def swallowed_exceptions(tree):
    """An `__exit__` that returns True whatever has happened: no exception leaves its `with`."""
    for own in (n for n in all_of(tree, ast.FunctionDef) if n.name == "__exit__"):
        last = own.body[-1]
        if isinstance(last, ast.Return) and getattr(last.value, "value", None) is True:
            message = "`__exit__` returns True, so that an exception that is raised in its `with` is dropped"
            fix = "on line %d, write `return False`: then it goes on to where it is expected" % last.lineno
            yield slip(last.lineno, "wrong-value", message, fix, "swallowed")


def closed_before(tree):
    """`with open(…) as file: …` with the `rospy.spin()` below it: callbacks come when the file is closed."""
    for around in all_of(tree, ast.Module, ast.If, ast.FunctionDef, ast.Try):
        opened = [at for at, one in enumerate(around.body) if isinstance(one, ast.With)][:1]
        for at in opened:
            one = around.body[at]
            spins = [n for later in around.body[at + 1 :] for n in calls_in(later, "spin", "is_shutdown")]
            if spins and not calls_in(one, "spin", "is_shutdown"):
                message = "the `with` of line %d ends before line %d, and closes what it has opened"
                fix = "indent line %d like line %d, so that it is within the `with`"
                lines = (spins[0].lineno, one.body[0].lineno)
                yield slip(one.lineno, "wrong-value", message % (one.lineno, lines[0]), fix % lines, "closed")


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
