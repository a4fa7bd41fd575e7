"""Writes what a student's Python spells in another way as the finders of `slips.py` look for it: assignments with a
type, methods under names of their own, loops that a question at their top ends. Names of rospy are for
`script_rospy.py`.

Nothing is executed. Python 3.8, standard library only.
"""

import ast

from script_tree import called_name, dotted


class Assign(ast.Assign):
    """`rate: Rate = Rate(10)`, which finders take for an assignment; its type is a use of a name all the same.

    `ast.unparse` knows it by the name of its class.
    """

    _fields = ("targets", "annotation", "value", "type_comment")


def spell_plainly(tree):
    """Change the tree of a module, before any finder looks at it."""
    without_types(tree)
    ask_in_heads(tree)
    call_by_methods(tree)


def without_types(tree):
    """Write each `rate: Rate = Rate(10)` in the tree as an assignment."""
    for node in ast.walk(tree):
        for block in (getattr(node, part, None) for part in ("body", "orelse", "finalbody")):
            if isinstance(block, list):
                block[:] = [plain_assignment(one) for one in block]


def plain_assignment(node):
    """Return an assignment without its type in the way; each other statement as it is."""
    if not isinstance(node, ast.AnnAssign) or node.value is None:
        return node
    plain = Assign([node.target], node.annotation, node.value, None)
    return ast.copy_location(plain, node)


def ask_in_heads(tree):
    """Write `while True:` with `if rospy.is_shutdown(): break` as its first statement as `while not
    rospy.is_shutdown():`."""
    for loop in (n for n in ast.walk(tree) if isinstance(n, ast.While) and len(n.body) > 1):
        first = loop.body[0]
        is_endless = isinstance(loop.test, ast.Constant) and loop.test.value in (True, 1)
        leaves = isinstance(first, ast.If) and isinstance(first.body[0], ast.Break) and not first.orelse
        if is_endless and leaves and called_name(first.test) == "is_shutdown":
            loop.test = ast.copy_location(ast.UnaryOp(op=ast.Not(), operand=first.test), loop.test)
            loop.body = loop.body[1:]


def call_by_methods(tree):
    """Write calls of `say = pub.publish` as calls of that method, `say.publish(…)`, which is what finders look for."""
    nodes = list(ast.walk(tree))
    given = [n.id for n in nodes if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)]
    made = [n for n in nodes if isinstance(n, ast.Assign) and isinstance(n.value, ast.Attribute)]
    named = {dotted(n.targets[0]): n.value.attr for n in made if n.value.attr in ("publish", "sleep")}
    for call in (n for n in nodes if isinstance(n, ast.Call) and isinstance(n.func, ast.Name)):
        if call.func.id in named and given.count(call.func.id) == 1:
            method = ast.Attribute(value=call.func, attr=named[call.func.id], ctx=ast.Load())
            call.func = ast.copy_location(method, call.func)
