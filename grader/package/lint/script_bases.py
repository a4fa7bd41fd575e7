"""Finds classes of a student's Python whose base class is never set up, for `slips.py`.

Nothing is executed. Python 3.8, standard library only.
"""

import ast

from script_tree import all_of, called_name, calls_in, dotted, slip


def unmade_bases(tree):
    """An `__init__` that does not call the one of its class's base; `name` has the class, and what the base's gives a
    value, where the base is in this file."""
    classes = {n.name: n for n in all_of(tree, ast.ClassDef)}
    imported = {a.asname or a.name for n in all_of(tree, ast.ImportFrom) for a in n.names}
    for own in classes.values():
        init = init_of(own)
        bases = [dotted(base) for base in own.bases]
        known = [base for base in bases if base in classes or base in imported]
        asks = calls_in(own, "__init__") or any(called_name(n) == "super" for n in ast.walk(init or own))
        if init is None or asks or len(known) != 1 or len(bases) != 1 or own.decorator_list:
            continue
        base = classes.get(known[0])
        made = init_of(base) if base is not None else None
        if base is not None and made is None:
            continue
        given = sorted(given_by(made) - given_by(own)) if made is not None else []
        values = "" if made is not None and len(made.args.args) == 1 else "…"
        message = "`__init__` of %s on line %d does not call the one of its base class %s"
        fix = "below line %d, write `super().__init__(%s)`" % (init.body[0].lineno - 1, values)
        if given or base is None:
            yield slip(
                init.lineno,
                "base-unmade",
                message % (own.name, init.lineno, known[0]),
                fix,
                " ".join([own.name, *given]),
            )


def init_of(owner):
    return next((n for n in owner.body if isinstance(n, ast.FunctionDef) and n.name == "__init__"), None)


def given_by(node):
    """Return the attributes of `self` that get a value in a node."""
    stored = [n for n in ast.walk(node) if isinstance(n, ast.Attribute) and isinstance(n.ctx, ast.Store)]
    return {n.attr for n in stored if dotted(n.value) == "self"}
