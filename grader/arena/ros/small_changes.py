"""Makes the small changes of a function of which beginners' formulas often need one: `functions.py` calls it with each.

Standard library only, Python 3.8. Nothing is executed.
"""

import ast
import io
import tokenize

MESSAGE_CHARS = 300
SOURCE_CHARS_MAX = 100000
WRITTEN_FOR = {
    "+": ["-", "*"], "-": ["+", ""], "*": ["/", "+", "**"], "/": ["*", "//"], "//": ["/"], "**": ["*"], "^": ["**"],
    "+=": ["-="], "-=": ["+="], "*=": ["/="], "/=": ["*="],
    "<": ["<=", ">"], "<=": ["<", ">="], ">": [">=", "<"], ">=": [">", "<="], "==": ["!="], "!=": ["=="],
    "and": ["or"], "or": ["and"], "not": [""], "True": ["False"], "False": ["True"],
    "sin": ["cos"], "cos": ["sin"], "asin": ["acos"], "acos": ["asin"], "tan": ["atan"], "atan": ["tan", "atan2"],
    "min": ["max"], "max": ["min"], "floor": ["ceil"], "ceil": ["floor"], "radians": ["degrees", ""],
    "degrees": ["radians", ""], "abs": [""], "int": ["round", ""], "round": ["int", ""],
}  # fmt: skip
"""What beginners write one for the other, or where it isn't needed."""
BEFORE_SIGN = frozenset(["(", ",", "=", "return", "*", "/", "["])


def change(path, function, number):
    """Return the `line` that the small change of this number changes, what it is `after` that, and the new `source`;
    where there are no more, the function's own `lines`."""
    with tokenize.open(str(path)) as file:
        source = file.read(SOURCE_CHARS_MAX)
    tree = ast.parse(source)
    called = next((n for n in tree.body if isinstance(n, ast.FunctionDef) and n.name == function), None)
    if called is None:
        return {}
    lines = source.splitlines(True)
    found = list(small_changes(called, tree, source))
    returns = any(isinstance(node, ast.Return) and node.value is not None for node in ast.walk(called))
    about = {"lines": [called.lineno, called.end_lineno], "returns": returns}
    if number >= len(found):
        return about
    line, begin, end, text = found[number]
    old = lines[line - 1]
    new = lines[line - 1] = old[:begin] + text + old[end:]
    if begin == 0:
        about["spaces"] = len(text)
    return dict(about, line=line, after=new.strip()[:MESSAGE_CHARS], source="".join(lines))


def small_changes(called, tree, source):
    """Yield the small changes of a function's lines, and of the constants that it reads, of which beginners' formulas
    often need one, the likeliest first: line, first column, the column behind the last, and what is to be there."""
    lines = source.splitlines()
    read = {node.id for node in ast.walk(called) if isinstance(node, ast.Name)}
    constants = [
        n for n in tree.body if isinstance(n, ast.Assign) and getattr(n.targets[0], "id", "") in read
    ]
    own = {called.lineno + 1 + i for i in range(called.end_lineno - called.lineno)} | {
        n.lineno for n in constants
    }
    tokens = [t for t in tokenize.generate_tokens(io.StringIO(source).readline) if t.start[0] in own]
    for token in tokens:
        for other in WRITTEN_FOR.get(token.string, ()):
            yield token.start[0], token.start[1], token.end[1], other
    for node in ast.walk(called):
        yield from other_orders(node, lines)
        if isinstance(node, ast.Return) and node.col_offset > called.body[0].col_offset:
            yield node.lineno, 0, node.col_offset, " " * called.body[0].col_offset
    for before, token in zip(tokens, tokens[1:]):  # noqa: B905, RUF007 - Python 3.8
        for other in other_numbers(token.string) if token.type == tokenize.NUMBER else ():
            yield token.start[0], token.start[1], token.end[1], "%.12g" % other
        if before.string in BEFORE_SIGN and token.type in (tokenize.NAME, tokenize.NUMBER):
            yield token.start[0], token.start[1], token.start[1], "-"
    yield from other_names(called)


def other_numbers(text):
    if text.isdigit():
        return [int(text) - 1, int(text) + 1, int(text) * 2]
    return [float(text) * 10, float(text) / 10] if text.replace(".", "").isdigit() else []


def other_orders(node, lines):
    """Yield the changes that swap two values of an expression, or put a product below a division into brackets."""
    values = {ast.Call: "args", ast.Tuple: "elts", ast.List: "elts", ast.arguments: "args"}.get(type(node))
    in_order = getattr(node, values) if values else []
    if isinstance(node, ast.BinOp) and not isinstance(node.op, (ast.Add, ast.Mult)):
        in_order = [node.left, node.right]
    for one, two in zip(in_order, in_order[1:]):  # noqa: B905, RUF007 - Python 3.8
        line = lines[one.lineno - 1]
        if one.lineno == two.end_lineno and line.isascii():
            first, second = (
                line[one.col_offset : one.end_col_offset],
                line[two.col_offset : two.end_col_offset],
            )
            between = line[one.end_col_offset : two.col_offset]
            yield one.lineno, one.col_offset, two.end_col_offset, second + between + first
    left = node
    while isinstance(left, ast.BinOp) and isinstance(left.op, ast.Mult):
        left = left.left
    if left is not node and isinstance(left, ast.BinOp) and isinstance(left.op, ast.Div):
        begin, end = left.right.col_offset, node.end_col_offset
        if left.right.lineno == node.end_lineno:
            yield node.end_lineno, begin, end, "(" + lines[node.end_lineno - 1][begin:end] + ")"


def other_names(called):
    """Yield the changes that read another of the function's values, or another of the constants that it reads."""
    names = [node for node in ast.walk(called) if isinstance(node, ast.Name)]
    values = {node.id for node in names if isinstance(node.ctx, ast.Store) or node.id.isupper()}
    values.update(argument.arg for argument in called.args.args)
    for node in names:
        if isinstance(node.ctx, ast.Load) and node.id in values:
            for other in sorted(values - {node.id}):
                yield node.lineno, node.col_offset, node.end_col_offset, other
