"""Finds distances whose square root is missing or taken of something else, for `slips.py`.

Nothing is executed. Python 3.8, standard library only.
"""

import ast

from script_tree import all_of, called_name, dotted, names_in, slip

ROOTLESS = "rootless"


def wrong_roots(tree):
    """Distances in which a square root, its bracket or a square is wrong."""
    yield from without_root(tree)
    yield from closed_too_early(tree)
    yield from doubled_sides(tree)


def closed_too_early(tree):
    """`math.sqrt(dx ** 2) + dy ** 2`: the bracket of the root closes behind the first square."""
    for node in all_of(tree, ast.BinOp):
        root = node.left if called_name(node.left) == "sqrt" and len(node.left.args) == 1 else None
        if (
            root
            and isinstance(node.op, (ast.Add, ast.Sub))
            and is_square(root.args[0])
            and is_square(node.right)
        ):
            message = "the bracket of `sqrt(` closes behind the first square"
            fix = "on line %d, write both squares in it, with `+` between them: `sqrt(… ** 2 + … ** 2)`"
            yield slip(node.lineno, "wrong-value", message, fix % node.lineno, ROOTLESS)


def doubled_sides(tree):
    """`math.sqrt((a - b) * 2 + (c - d) * 2)`: two differences that are doubled in place of squared."""
    for node in (n for n in all_of(tree, ast.Call) if called_name(n) == "sqrt" and len(n.args) == 1):
        inner = node.args[0]
        sides = [inner.left, inner.right] if isinstance(inner, ast.BinOp) else []
        if sides and all(map(is_doubled, sides)) and isinstance(inner.op, (ast.Add, ast.Sub)):
            message = "`* 2` doubles a difference, and the sides of a distance are squared"
            fix = "on line %d, write `** 2` in place of `* 2`, with `+` between both squares" % node.lineno
            yield slip(node.lineno, "wrong-value", message, fix, ROOTLESS)


def is_doubled(node):
    """Whether a value is `(a - b) * 2`."""
    is_product = isinstance(node, ast.BinOp) and isinstance(node.op, ast.Mult)
    is_twice = is_product and getattr(node.right, "value", None) == 2
    return is_twice and isinstance(node.left, ast.BinOp) and isinstance(node.left.op, ast.Sub)


def without_root(tree):
    """`distance = dx ** 2 + dy ** 2`: a sum of two squares that is called a distance."""
    named = [(dotted(n.targets[0]), n.value) for n in all_of(tree, ast.Assign)]
    for function in all_of(tree, ast.FunctionDef):
        named += [(function.name, n.value) for n in function.body if isinstance(n, ast.Return)]
    sums = [(name, value) for name, value in named if isinstance(getattr(value, "op", None), ast.Add)]
    squared = squares_in_use(tree) if sums else ()
    for name, value in sums:
        last = name.rpartition(".")[2]
        is_called_so = "dist" in last.lower() and "sq" not in last.lower() and "2" not in last
        if is_called_so and is_square(value.left) and is_square(value.right) and last not in squared:
            message = "`%s` is the square of a distance, as without a square root" % name
            fix = "on line %d, write `(… + …) ** 0.5`, with brackets around the whole sum" % value.lineno
            yield slip(value.lineno, "wrong-value", message, fix, ROOTLESS)


def squares_in_use(tree):
    """Return the last names of what a root is taken of elsewhere, or is compared as a square: with a square or a
    product, or with each other, by `key=` or with the least one so far."""
    kept = {(dotted(t), dotted(n.value)) for n in all_of(tree, ast.Assign) for t in n.targets}
    used = [n for n in all_of(tree, ast.Call) if called_name(n) == "sqrt"]
    powers = [n for n in all_of(tree, ast.BinOp) if isinstance(n.op, ast.Pow)]
    used += [n for n in powers if getattr(n.right, "value", 0) == 0.5]
    used += [n for n in all_of(tree, ast.keyword) if n.arg == "key"]
    for node in all_of(tree, ast.Compare):
        sides = [node.left, *node.comparators]
        products = [one for one in sides if isinstance(getattr(one, "op", None), (ast.Pow, ast.Mult))]
        pair = tuple(map(dotted, sides))
        used += [node] if products or any(map(is_square, sides)) or kept & {pair, pair[::-1]} else []
    return {name.rpartition(".")[2] for one in used for name in names_in(one)}


def is_square(node):
    """Whether a value is `x ** 2` or `pow(x, 2)`."""
    power = node.right if isinstance(getattr(node, "op", None), ast.Pow) else None
    last = node.args[1] if called_name(node) == "pow" and len(node.args) > 1 else power
    return getattr(last, "value", None) == 2
