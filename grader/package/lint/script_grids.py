"""Finds rows of a grid that are made wrongly in a student's Python, for `slips.py`.

Nothing is executed. Python 3.8, standard library only.
"""

import ast
import re

from script_tree import all_of, called_name, dotted, slip

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
