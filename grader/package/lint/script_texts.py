"""Finds the texts that a student's Python publishes, prints and gives ROS as names, for `slips.py`.

As far as the source has them: values that only a run knows are `{}`. Nothing is executed. Python 3.8, standard library
only.
"""

import ast
import re

from script_tree import (
    FUNCTIONS,
    LOOPS,
    TEXT_LIMIT,
    all_of,
    argument,
    called_name,
    calls_in,
    dotted,
    functions_in,
    is_call,
    published_type,
    slip,
    statements_of,
    targets_of,
    text_of,
    walk,
)

PRINTED = ("loginfo", "logwarn", "logerr", "logdebug", "logfatal", "print", "write")
VALUE, DATA, NODE = "{}", "{data}", "{node}"
PLACE = re.compile(r"%(?:\(\w*\))?[-+ #0-9.]*[a-zA-Z]|%%")
FIELD = re.compile(r"\{[^{}]*\}")
DEPTH = 6


def said_texts(tree):
    """The texts that a script publishes and prints, as far as its source has them: `{}` is a value, `{data}` that of a
    message, `{node}` the node's name in what is printed."""
    given, kinds = {}, set()
    for node in walk(tree):
        if isinstance(node, (ast.Assign, ast.AugAssign)):
            for target in getattr(node, "targets", None) or [node.target]:
                # What `+=` adds to is more than that one text.
                plain = node.value if isinstance(node, ast.Assign) else None
                given.setdefault(dotted(target), []).append(plain)
        if isinstance(node, FUNCTIONS):
            kinds.update(arg.arg for arg in ast.walk(node.args) if isinstance(arg, ast.arg))
    read = Texts({name: values[0] for name, values in given.items() if len(values) == 1 and values[0]}, kinds)
    moves = moves_to_run(tree)
    loops = all_of(tree, *LOOPS)
    for node in walk(tree):
        if is_call(node, "publish") and len(node.args) == 1:
            place, text = read.message(node.args[0])
            place = node if made_before(place, node, loops) else place
            yield from said("publishes", place, text.replace(NODE, VALUE), "publish")
        elif called_name(node) in PRINTED and node.args:
            yield from said("prints", node, read.printed(node), called_name(node), moves.get(node, ""))


def made_before(place, call, loops):
    """Return whether what a loop publishes is made above it, and so is the same in each turn."""
    around = [one.lineno for one in loops if one.lineno <= call.lineno <= one.end_lineno]
    return bool(around) and place.lineno < max(around)


def said(kind, node, text, call, fix=""):
    if text and text != VALUE and len(text) <= TEXT_LIMIT:
        yield slip(node.lineno, kind, text, fix, call)


def moves_to_run(tree):
    """Return for calls that stand behind a `spin()`, or in an `if`, where to move them so that they run anyway."""
    found = {}
    for node in walk(tree):
        # `if __name__ == '__main__':` holds whenever the script is run, `if not rospy.is_shutdown():` until its end.
        asks = isinstance(node, ast.If) and "__name__" not in map(dotted, ast.walk(node.test))
        for call in calls_below(node.body) if asks and not calls_in(node.test, "is_shutdown") else ():
            found[call] = "move line %d out of the `if` on line %d" % (call.lineno, node.lineno)
        body = statements_of(node)
        spins = [i for i, one in enumerate(body) if isinstance(one, ast.Expr) and is_call(one.value, "spin")]
        for call in calls_below(body[spins[0] + 1 :]) if spins else ():
            found[call] = "move line %d above line %d" % (call.lineno, body[spins[0]].lineno)
    return found


def calls_below(statements):
    return [n for one in statements for n in ast.walk(one) if isinstance(n, ast.Call)]


class Texts:
    """Reads texts out of expressions. `given` are the names that one assignment gives a value, `arguments` those of
    functions."""

    def __init__(self, given, arguments):
        self.given, self.arguments = given, arguments

    def message(self, node):
        """Return the place and the text of what is published: of a message, that of its `data`."""
        name = dotted(node)
        data = self.given.get(name + ".data")
        if data is not None:
            return data, self.of(data)
        value = self.given.get(name, node)
        if isinstance(value, ast.Call) and called_name(value) == "String" and not value.args:
            data = [k.value for k in value.keywords if k.arg == "data"]
            return (data or [node])[0], self.of(data[0]) if data else ""
        return (node if isinstance(node, ast.Call) else value), self.of(node)

    def printed(self, call):
        texts = [self.of(arg) for arg in call.args]
        # `print` writes all that it is given; the functions of logging put the rest into the first.
        if called_name(call) == "print":
            return " ".join(texts)
        return self.filled(texts[0], call.args[1:]) if len(texts) > 1 else texts[0]

    def of(self, node, depth=DEPTH):
        """Return the text of an expression; what only a run can tell is `{}`."""
        if isinstance(node, ast.Constant):
            # Braces mean a value in the texts that are told.
            return str(node.value).replace("{", "(").replace("}", ")")
        if isinstance(node, ast.JoinedStr):
            return "".join(self.of(part, depth) for part in node.values)
        of_message = isinstance(node, ast.Attribute) and node.attr == "data"
        if of_message or (isinstance(node, ast.Name) and node.id in self.arguments):
            return DATA
        if called_name(node) in ("get_caller_id", "get_name"):
            return NODE
        inner = self.inside(node) if depth else None
        if inner is not None:
            return self.of(inner, depth - 1)
        return self.joined(node, depth - 1) if depth else VALUE

    def inside(self, node):
        """Return the expression that another one gives its text: what is in `str(…)`, or what a name was given."""
        if isinstance(node, ast.FormattedValue):
            return node.value
        if called_name(node) in ("str", "String", "unicode", "repr") and node.args:
            return node.args[0]
        return self.given.get(dotted(node)) if isinstance(node, (ast.Name, ast.Attribute)) else None

    def joined(self, node, depth):
        """Return the text of `a + b`, `a % b` or `a.format(b)`."""
        operator = getattr(node, "op", None)
        if isinstance(operator, ast.Add):
            # `1 + n` is a sum, and no text.
            number = any(isinstance(getattr(n, "value", ""), (int, float)) for n in (node.left, node.right))
            return VALUE if number else self.of(node.left, depth) + self.of(node.right, depth)
        if isinstance(operator, ast.Mod) and isinstance(node.left, ast.Constant):
            values = node.right.elts if isinstance(node.right, ast.Tuple) else [node.right]
            return self.filled(self.of(node.left), values)
        text = getattr(node.func.value, "value", None) if is_call(node, "format") else None
        return self.filled(text, node.args, FIELD) if isinstance(text, str) else VALUE

    def filled(self, text, values, places=PLACE):
        """Return the text with what stands in place of its `%s`, or of its `{}`."""
        value = DATA if values and all(self.of(one, 0) == DATA for one in values) else VALUE
        return places.sub(lambda found: "%" if found[0] == "%%" else value, text)


NAMED = {
    "init_node": "node-name", "Publisher": "publisher", "Subscriber": "subscriber", "wait_for_message": "subscriber",
    "set_param": "sets-parameter",
}  # fmt: skip
"""Calls whose first argument is a name, and the kind of slip that tells where."""


def graph_names(tree):
    """Where a script names its node, its topics and the parameters that it sets, as written; and the types that it
    publishes."""
    owners = targets_of(tree)
    own = {n.name for n in all_of(tree, ast.ClassDef)}
    variables = {n.id for n in all_of(tree, ast.Name) if isinstance(n.ctx, ast.Store)}
    variables |= {n.arg for n in all_of(tree, ast.arg)}
    variables -= {a.asname or a.name for n in all_of(tree, ast.ImportFrom) for a in n.names}
    for node in walk(tree):
        kind = NAMED.get(called_name(node))
        if not kind or dotted(node.func) in own:
            continue
        anonymous = [k for k in node.keywords if k.arg == "anonymous" and getattr(k.value, "value", True)]
        owner = owners.get(id(node), "") or ("anonymous" if anonymous else "")
        names, name = argument(node, 0, "name"), published_type(node)
        if names and text_of(names[0]):
            yield slip(names[0].lineno, kind, text_of(names[0]), name=owner)
        elif names and kind != "sets-parameter":
            for text, written in text_behind(names[0], tree):
                yield slip(text.lineno, kind, text_of(text), written if kind == "node-name" else "", owner)
        # a variable holds a type that is not known here
        if names and name.isidentifier() and name not in variables and kind in ("publisher", "subscriber"):
            yield slip(names[0].lineno, kind + "-type", name)


def text_behind(node, tree):
    """Yield the text that a variable is given once, or that an argument gets in the only call of its function, and how
    it is written there, with `{}` in its place: `self.name = {}`, `name={}`."""
    name = dotted(node)
    assigned = [n.value for n in all_of(tree, ast.Assign) if name in map(dotted, n.targets)]
    if len(assigned) == 1 and text_of(assigned[0]):
        yield assigned[0], "%s = {}" % name
    for function in () if assigned else functions_in(tree).values():
        arguments = [one.arg for one in function.args.args]
        if name in arguments and any(one is node for one in ast.walk(function)):
            owners = [n.name for n in all_of(tree, ast.ClassDef) if function in n.body]
            called = owners[0] if owners and function.name == "__init__" else function.name
            calls = [n for n in all_of(tree, ast.Call) if dotted(n.func) in (called, "self." + called)]
            place = arguments.index(name) - (arguments[0] == "self")
            found = argument(calls[0], place, name) if len(calls) == 1 else []
            if found and text_of(found[0]):
                alone = len(calls[0].args) + len(calls[0].keywords) == 1
                by_name = found[0] in [one.value for one in calls[0].keywords]
                written = "%s={}" % name if by_name else "%s({})" % called if alone else "{}"
                yield found[0], written
