"""Writes what a student's Python has of rospy under other names as `rospy.…`, for the finders of `slips.py`: what
`from rospy import Rate`, `import rospy as ros` and `log = rospy.loginfo` give a name. Numbers of another module, too.

Nothing is executed. Python 3.8, standard library only.
"""

import ast
import re
from collections import Counter

from script_tree import all_of, dotted, parents_of, walk


def spell_rospy_out(tree):
    """Write each such name in the tree as `rospy.…`. Return a function from a text to one with the script's own
    names."""
    meant = meant_by(tree)
    used = [n for n in all_of(tree, ast.Name) if n.id in meant and isinstance(n.ctx, ast.Load)]
    parents = parents_of(tree) if used else {}
    for node in used:
        first, _, name = meant[node.id].partition(".")
        whole = ast.copy_location(ast.Name(id=first, ctx=ast.Load()), node)
        if name:
            whole = ast.copy_location(ast.Attribute(value=whole, attr=name, ctx=ast.Load()), node)
        put_in_place(parents[node], node, whole)
    for kept in set(vars(tree)).difference(tree._fields) if used else ():
        delattr(tree, kept)  # what finders keep of the module as it was
    own = {whole: name for name, whole in meant.items()}
    ends = {whole: r"(?=\.)" if whole == "rospy" else r"\b" for whole in own}  # the library is called rospy
    whole = sorted(own, key=len, reverse=True)
    written = re.compile("|".join(r"\b%s%s" % (re.escape(one), ends[one]) for one in whole))
    return lambda text: written.sub(lambda found: own[found[0]], text) if own else text


def meant_by(tree):
    """Return what of rospy each name stands for that the script gives once: `ros` for `rospy`, `Rate` for
    `rospy.Rate`."""
    meant = {}
    for node in all_of(tree, ast.Import, ast.ImportFrom):
        for one in node.names:
            if isinstance(node, ast.Import) and one.name == "rospy" and one.asname not in (None, "rospy"):
                meant[one.asname] = "rospy"
            elif getattr(node, "module", "") == "rospy" and not node.level and one.name != "*":
                meant[one.asname or one.name] = "rospy." + one.name
    for node in tree.body:
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
            owner, _, name = dotted(node.value).partition(".")
            if meant.get(owner, owner) == "rospy" and name.isidentifier():
                meant[node.targets[0].id] = "rospy." + name
    given = times_given(tree) if meant else {}
    return {name: whole for name, whole in meant.items() if given[name] == 1}


def times_given(tree):
    """Return how often the script gives each name: by an import, a definition, an argument, an assignment."""
    given = Counter()
    for node in walk(tree):
        if isinstance(node, ast.alias):
            given[node.asname or node.name] += 1
        elif isinstance(node, ast.Name):
            given[node.id] += not isinstance(node.ctx, ast.Load)
        else:
            given.update(filter(None, (getattr(node, "arg", None), getattr(node, "name", None))))
    return given


def write_numbers(tree, numbers):
    """Write each number of another module, by its name in the tree, as that number."""
    nodes = all_of(tree, ast.Name, ast.Attribute) if numbers else []
    given, parents = times_given(tree) if numbers else {}, parents_of(tree) if numbers else {}
    for node in nodes:
        name = dotted(node)
        if name in numbers and isinstance(node.ctx, ast.Load) and given[name.partition(".")[0]] <= 1:
            put_in_place(
                parents[node], node, ast.copy_location(ast.Constant(value=numbers[name], kind=None), node)
            )
    for kept in set(vars(tree)).difference(tree._fields) if numbers else ():
        delattr(tree, kept)  # what finders keep of the module as it was


def put_in_place(parent, node, new):
    """Put a node into the tree where another one is."""
    for field, value in ast.iter_fields(parent):
        if value is node:
            setattr(parent, field, new)
        elif isinstance(value, list):
            value[:] = [new if one is node else one for one in value]
