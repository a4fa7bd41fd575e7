"""Finds what a topic's callback in a student's Python prints of its message, for `slips.py`.

Nothing is executed. Python 3.8, standard library only.
"""

import ast
import itertools

from script_tree import (
    all_of,
    argument,
    callback_of,
    called_name,
    calls_in,
    dotted,
    functions_in,
    gives_function,
    is_call,
    names_in,
    slip,
    text_of,
    walk,
)

LOGS = ("loginfo", "logwarn", "logerr", "logfatal")
STREAMS = ("sys.stdout.write", "sys.stderr.write", "stdout.write", "stderr.write")
CHANGES = {
    "abs", "round", "min", "max", "len", "bool", "ord", "chr", "hex", "bin", "sum", "sorted", "reversed", "sqrt",
    "type", "upper", "lower", "title", "capitalize", "swapcase", "split", "partition", "replace", "zfill",
}  # fmt: skip
"""Calls whose result is not the value that they are given."""
HARMLESS = CHANGES | {
    "str", "repr", "int", "float", "format", "isinstance", "get_caller_id", "get_name", "get_time", "publish",
}  # fmt: skip
"""Calls that may be given the message, and print nothing."""
COLLECTS = {"add", "append", "appendleft", "put", "setdefault", "update"}
"""Calls by which a set, a list, a queue or a map takes a message in."""
WITH_DATA = {
    "String", "Bool", "Int8", "Int16", "Int32", "Int64", "UInt8", "UInt16", "UInt32", "UInt64", "Float32", "Float64",
}  # fmt: skip
"""Types of std_msgs whose value is in `data`."""
ALWAYS, NEVER, UNKNOWN = "always", "never", "unknown"
OTHERS_LIMIT, LINES_LIMIT = 10, 50
"""Callbacks of so many other topics are searched for what one keeps, and so much of each."""
LEAVES, STORING = (ast.Return, ast.Raise), (ast.Assign, ast.AugAssign, ast.AnnAssign, ast.NamedExpr)


def unprinted_messages(tree):
    """Callbacks of topics that print nothing of a message (`not-printed`), or of some messages only, or what they make
    of it (`printed-in-part`). Nothing of one that hands its message to another function, or keeps it for later."""
    functions, looked_at, told = functions_in(tree), {}, set()
    level = any(k.arg == "log_level" for n in walk(tree) if is_call(n, "init_node") for k in n.keywords)
    for node in walk(tree):
        given = argument(node, 2, "callback") if called_name(node) == "Subscriber" else []
        topic = text_of((argument(node, 0, "name") or [None])[0]) if given else ""
        for one in (n for n in given[:1] if isinstance(n, ast.Call) or dotted(n) not in told):
            told.add(dotted(one))  # one callback may be given many times
            yield from (slip(*found, topic) for found in given_wrong(one, functions, tree))
        own = given[0] if given and isinstance(given[0], ast.Lambda) else callback_of(node, functions)
        taken = (
            [one.arg for one in own.args.args if one.arg not in ("self", "cls")] if own is not None else []
        )
        # what a decorator makes of it may print what it returns
        if not taken or getattr(own, "decorator_list", None):
            continue
        kinds, topics = argument(node, 1, "data_class"), argument(node, 0, "name")
        plain = any(dotted(kind).rpartition(".")[2] in WITH_DATA for kind in kinds[:1])
        key = own, taken[0] + (".data" if plain else "")
        if key not in looked_at:  # one callback may be given many times
            looked_at[key] = Printing(own, taken[0], key[1], functions).found(tree, level)
        if looked_at[key]:
            yield slip(*looked_at[key], text_of(topics[0]) if topics else "")


def given_wrong(given, functions, tree):
    """Yield what makes a callback of something else than the function that is meant: a call of `print`, the maker of
    the function, a decorator that returns what it is given; or a value that its method keeps under another name."""
    if isinstance(given, ast.Call) and (is_print(given) or called_name(given).startswith("log")):
        name = dotted(given.func)
        message = "`%s(…)` is called once, on line %d, and gives the Subscriber nothing to call" % (
            name,
            given.lineno,
        )
        yield given.lineno, "not-printed", message, "write `lambda msg: %s(msg.data)` in its place" % name
    own = (
        functions.get(dotted(given).rpartition(".")[2])
        if isinstance(given, (ast.Name, ast.Attribute))
        else None
    )
    if own is None:
        return
    if gives_function(own):
        message = "`%s` makes the callback, and is none itself: it has to be called" % own.name
        yield (
            given.lineno,
            "not-printed",
            message,
            "on line %d, write `%s(…)`" % (given.lineno, dotted(given)),
        )
    for decorator in own.decorator_list:
        maker = functions.get(dotted(decorator))
        inner = [n for n in maker.body if isinstance(n, ast.FunctionDef)] if maker and maker.args.args else []
        last = maker.body[-1] if inner else None
        if isinstance(last, ast.Return) and len(inner) == 1 and dotted(last.value) == maker.args.args[0].arg:
            message = "`%s`, around `%s`, returns on line %d what it is given, and `%s` is never called"
            message %= (maker.name, own.name, last.lineno, inner[0].name)
            yield (
                last.lineno,
                "not-printed",
                message,
                "on line %d, write `return %s`" % (last.lineno, inner[0].name),
            )
    yield from kept_elsewhere(own, tree)


def kept_elsewhere(own, tree):
    """Yield where a callback gives a value to `last`, which it never reads, and another method reads `self.last`."""
    if [one.arg for one in own.args.args[:1]] != ["self"]:
        return
    if not hasattr(tree, "all_of_self"):  # each callback asks for them
        read = (n for n in all_of(tree, ast.Attribute) if isinstance(n.ctx, ast.Load))
        tree.all_of_self = {n.attr for n in read if dotted(n.value) == "self"}
    names = [n for n in ast.walk(own) if isinstance(n, ast.Name)]
    used = {n.id for n in names if isinstance(n.ctx, ast.Load)}
    for n in own.body:
        name = dotted(n.targets[0]) if isinstance(n, ast.Assign) else ""
        if name.isidentifier() and name not in used and name in tree.all_of_self:
            message = "line %d gives a value to `%s`, and not to `self.%s`" % (n.lineno, name, name)
            fix = "on line %d, write `self.%s` instead of `%s`" % (n.lineno, name, name)
            yield n.lineno, "not-printed", message, fix


LEVELS = {
    "debug": "debug",
    "info": "info",
    "warning": "warn",
    "warn": "warn",
    "error": "err",
    "critical": "fatal",
}
"""Functions of `logging`, and the ends of those of rospy's."""


def loggers(tree):
    """Return the names of what logs in Python's own way: `logging`, and loggers that are not rospy's. None where the
    script says where to, which `basicConfig(…)` does not once a node is made."""
    if any(called_name(n) in ("addHandler", "dictConfig", "fileConfig") for n in all_of(tree, ast.Call)):
        return set()
    if any(k.arg == "force" for n in all_of(tree, ast.Call) for k in n.keywords):
        return set()
    names = {a.asname or a.name for n in all_of(tree, ast.Import) for a in n.names if a.name == "logging"}
    for n in all_of(tree, ast.Assign):
        if dotted(getattr(n.value, "func", None)) == "logging.getLogger" and "logging" in names:
            named = n.value.args[0] if n.value.args else None
            if (
                named is None
                or dotted(named) == "__name__"
                or text_of(named).partition(".")[0] not in ("", "rosout")
            ):
                names.update(map(dotted, n.targets))
    return names


def stored_and_printed(function):
    """Yield each of the first lines that store or print, with the names in it."""
    lines = (n for n in ast.walk(function) if isinstance(n, ast.Assign) or is_print(n))
    for n in itertools.islice(lines, LINES_LIMIT):
        yield n, names_in(n)


class Printing:
    """What a callback prints. `value` is how the message's value is written in it; `known` has for each name that holds
    something of the message where it got it, and whether that is something else than the value itself. Other functions
    can read those of `shared`."""

    def __init__(self, own, message, value, functions):
        self.own, self.value, self.functions = own, value, functions
        self.body = own.body if isinstance(own.body, list) else [ast.Expr(own.body)]
        self.name = "the callback `%s`" % own.name if hasattr(own, "name") else "the `lambda`"
        self.known, self.shared, self.lost = {message: ((0, 0), False)}, [], 0
        nodes = [n for one in self.body for n in ast.walk(one)]
        self.nodes = sorted((n for n in nodes if hasattr(n, "lineno")), key=place)
        outer = {name for n in nodes if isinstance(n, (ast.Global, ast.Nonlocal)) for name in n.names}
        for n in self.nodes:
            if isinstance(n, STORING) and n.value is not None:
                self.follow(n, outer)
            elif is_call(n, *COLLECTS) and any(self.holds(one)[0] for one in n.args):
                # what collects messages holds this one
                self.known.setdefault(dotted(n.func.value), (place(n), False))
        self.prints = [n for n in self.nodes if is_print(n)]

    def follow(self, assigned, outer):
        of_message, changed = self.holds(assigned.value)
        for target in getattr(assigned, "targets", None) or [assigned.target]:
            for one in target.elts if isinstance(target, ast.Tuple) else [target]:
                is_value, adds = dotted(one) == self.value, isinstance(assigned, ast.AugAssign)
                lost = not of_message and (is_value or dotted(one) in self.known)
                if assigned in self.body and (lost or (is_value and (changed or adds))):
                    self.lost = self.lost or assigned.lineno
                if of_message and not isinstance(one, ast.Name):
                    self.shared.append(dotted(one))
                if of_message and dotted(one) not in self.known:
                    changed = changed or isinstance(assigned, ast.AugAssign)
                    self.known[dotted(one)] = (place(assigned), changed or isinstance(target, ast.Tuple))
                    self.shared += [dotted(one)] if dotted(one) in outer else []

    def holds(self, node):
        """Return whether an expression holds something of the message, and whether that is not the value itself."""
        parts = dotted(node).split(".") if isinstance(node, (ast.Name, ast.Attribute)) else []
        for count in range(1, len(parts) + 1):
            since, changed = self.known.get(".".join(parts[:count]), (place(node), False))
            if since < place(node):
                return True, changed
        found = [self.holds(child) for child in ast.iter_child_nodes(node)]
        of_message = [changed for holds, changed in found if holds]
        return bool(of_message), bool(of_message) and (all(of_message) or changes(node, found))

    def found(self, tree, level):
        """Return line, kind, message and fix of what is wrong; None where nothing is, or it cannot be told."""
        if logged := not self.prints and self.logged(tree):
            return logged
        told = [n for n in self.prints if self.of_message(n)]
        if self.is_elsewhere(tree, collects=bool(told)):
            return None if self.prints else self.dropped(tree)
        if told:
            return self.too_early(told[0].lineno) or self.in_part(told)
        if not self.prints:
            debug = any(called_name(n).startswith("logdebug") and self.of_message(n) for n in self.nodes)
            kept = self.kept(tree) if self.shared else None
            return kept or (self.silent(level) if debug or not self.is_read(tree) else None)
        return self.another()

    def too_early(self, printed):
        """What another value, or the callback's end, comes to before the line that would print it."""
        ends = next((one.lineno for one in self.body if isinstance(one, LEAVES)), printed)
        message = "line %d gives what holds the message another value before line %d prints it"
        if ends < printed:
            message = "line %d ends the callback before line %d prints the message"
        line = ends if ends < printed else self.lost
        if not line or line >= printed:
            return None
        return line, "not-printed", message % (line, printed), "delete line %d" % line

    def logged(self, tree):
        """What goes into a log file alone: `logging.info(…)`, for which ROS has set up no other way."""
        kept = loggers(tree)
        for n in self.nodes:
            owner, _, name = dotted(n.func).rpartition(".") if isinstance(n, ast.Call) else ("", "", "")
            if owner in kept and name in LEVELS and self.of_message(n):
                message = "`%s.%s` on line %d writes into a log file, and shows nothing on the terminal"
                fix = "on line %d, write `rospy.log%s`" % (
                    n.lineno,
                    "info" if name == "debug" else LEVELS[name],
                )
                return n.lineno, "not-printed", message % (owner, name, n.lineno), fix
        return None

    def of_message(self, call):
        return any(self.holds(one)[0] for one in [*call.args, *(k.value for k in call.keywords)])

    def is_elsewhere(self, tree, *, collects):
        """Whether something else than this function may print the message. One that prints it may collect it too, where
        nothing else prints what it collects."""
        for n in self.nodes:
            name = called_name(n)
            known = is_print(n) or name.startswith("logdebug") or name in HARMLESS
            if collects and name in COLLECTS and isinstance(n.func, ast.Attribute):
                kept = dotted(n.func.value)
                known = known or not any(kept in names for _, names in self.printed_in_loops(tree))
            if isinstance(n, (ast.For, ast.While)) and any(is_print(one) for one in ast.walk(n)):
                return True
            if name in self.functions or isinstance(n, (ast.FunctionDef, ast.Lambda, ast.Yield)):
                return True
            if name and not known and self.of_message(n):
                return True
        return False

    def kept(self, tree):
        """What the callback keeps, and a loop elsewhere prints: what the variable holds by then."""
        for call, names in self.printed_in_loops(tree):
            kept = names.intersection(self.shared)
            if kept:
                message = "line %d prints in a loop what `%s` holds by then" % (call.lineno, min(kept))
                message += ", and not each message when it comes"
                return call.lineno, "printed-in-part", message, "print `%s` in %s" % (self.value, self.name)
        return self.kept_for_another(tree)

    def is_read(self, tree):
        """Whether anything outside of the callback reads what it keeps."""
        kept, own = set(self.shared), set(map(id, self.nodes))
        read = (n for n in walk(tree) if isinstance(getattr(n, "ctx", None), ast.Load) and id(n) not in own)
        return bool(kept) and any(dotted(n) in kept for n in read)

    def dropped(self, tree):
        """What the callback puts into a queue that keeps a few messages only, for a loop to print."""
        made = {dotted(n.targets[0]): n.value for n in all_of(tree, ast.Assign)}
        for n in self.nodes:
            kept = dotted(n.func.value) if is_call(n, *COLLECTS) and self.of_message(n) else ""
            queue = made.get(kept)
            least = argument(queue, 1, "maxlen") if called_name(queue) == "deque" else []
            if least and getattr(least[0], "value", None) is not None:
                count = least[0].value
                last = "message" if count == 1 else "%s messages" % count
                message = "`%s` keeps only the last %s (`maxlen` on line %d)" % (kept, last, queue.lineno)
                return n.lineno, "printed-in-part", message, "print `%s` in %s" % (self.value, self.name)
        return None

    def printed_in_loops(self, tree):
        """Return the calls that print in loops, each with the names in it."""
        if not hasattr(tree, "prints_of_loops"):  # each callback asks for them
            loops = all_of(tree, ast.While)
            calls = {id(call): call for loop in loops for call in filter(is_print, ast.walk(loop))}
            tree.prints_of_loops = [(call, names_in(call)) for call in calls.values()]
        return tree.prints_of_loops

    def kept_for_another(self, tree):
        """What the callback keeps, and the callback of another topic prints, with what comes there."""
        if not hasattr(tree, "all_callbacks"):  # each callback asks for them
            found = dict.fromkeys(callback_of(n, self.functions) for n in walk(tree))
            found.pop(None, None)
            others = list(found)[:OTHERS_LIMIT]
            tree.all_callbacks = [(one, list(stored_and_printed(one))) for one in others]
        for other, told in tree.all_callbacks:
            held = set(self.shared)
            for n, names in told if other is not self.own else ():
                if isinstance(n, ast.Assign) and names & held:
                    held.update(map(dotted, n.targets))
                if is_print(n) and names & held:
                    message = "line %d prints it only when `%s` is called, for a message of another topic"
                    fix = "print `%s` in %s too" % (self.value, self.name)
                    return n.lineno, "printed-in-part", message % (n.lineno, other.name), fix
        return None

    def silent(self, level):
        """A callback that prints nothing that is shown; `level` says whether the node sets what is."""
        debug = [n for n in self.nodes if called_name(n).startswith("logdebug")]
        if debug and level:
            return None
        if debug:
            line, name = debug[0].lineno, called_name(debug[0])
            message = "`%s` on line %d shows nothing: rospy shows `loginfo` and above" % (name, line)
            return line, "not-printed", message, "on line %d, write `rospy.loginfo`" % line
        line = self.own.lineno
        fix = "print in it what it hears: `rospy.loginfo(%s)`" % self.value
        return line, "not-printed", "%s on line %d prints nothing" % (self.name, line), fix

    def another(self):
        """A callback whose prints hold nothing of the message."""
        call = self.prints[0]
        read = [n for one in call.args for n in ast.walk(one) if isinstance(n, (ast.Name, ast.Attribute))]
        called = {id(part) for n in ast.walk(call) if isinstance(n, ast.Call) for part in ast.walk(n.func)}
        inner = {id(n.value) for n in read if isinstance(n, ast.Attribute)}
        names = [dotted(n) for n in read if id(n) not in called and id(n) not in inner]
        late = [name for name in names if name in self.known]
        if self.shared and not late:
            return None
        line, kind = call.lineno, "not-printed"
        fix = "on line %d, print `%s`" % (line, self.value)
        if not any(call is getattr(one, "value", None) for one in self.body) and not late:
            message = "no `print` or `log` in %s has the message's value in it" % self.name
            return line, kind, message, "print `%s` on the first line of %s" % (self.value, self.name)
        if late:
            message = "line %d prints `%s`, which gets the message's value only on line %d"
            return line, "printed-in-part", message % (line, late[0], self.known[late[0]][0][0]), fix
        if len(set(names)) == 1:
            return line, kind, "line %d prints `%s`, and not the message's value" % (line, names[0]), fix
        return line, kind, "what line %d prints has nothing of the message in it" % line, fix

    def in_part(self, told):
        kind, often = "printed-in-part", [n for n in told if called_name(n) in LOGS or not is_log(n)]
        if not often:
            line, name = told[0].lineno, called_name(told[0])
            fix = "on line %d, write `rospy.%s(…)`" % (line, name.partition("_")[0])
            fix += " without the seconds" * ("_throttle" in name)
            what = "the first message only" if name.endswith("_once") else "some of the messages only"
            return line, kind, "`%s` on line %d logs %s" % (name, line, what), fix
        parts = (n for one in often for n in ast.walk(one) if isinstance(n, ast.Starred))
        if spread := next((n for n in parts if dotted(n.value) == self.value), None):
            message = "`*%s` on line %d hands out each letter of it as a value of its own"
            fix = "on line %d, write `%s` without the `*`" % (spread.lineno, self.value)
            return spread.lineno, kind, message % (self.value, spread.lineno), fix
        why = self.whether(self.body)
        if isinstance(why, ast.If):
            return (why.lineno, kind, *under_condition(why, often))
        if why == ALWAYS and all(self.holds(one)[1] for n in often for one in n.args if self.holds(one)[0]):
            line = often[0].lineno
            message = "line %d prints something that is made of the message's value, not the value itself"
            return line, kind, message % line, "on line %d, print `%s` as it is" % (line, self.value)
        return None

    def whether(self, body, after=NEVER):
        """Return whether these lines, and what comes `after` them, print the message always or never, or else the `if`
        that decides. From the end, so that each line is looked at once, however many ways lead to it."""
        for one in reversed(body):
            if isinstance(one, LEAVES):
                after = NEVER
            elif isinstance(one, ast.If) and not (
                calls_in(one.test, "is_shutdown") or self.is_there(one.test)
            ):
                ways = {self.whether(one.body, after), self.whether(one.orelse, after)}
                after = ways.pop() if len(ways) == 1 else UNKNOWN if UNKNOWN in ways else one
            elif isinstance(one, (ast.Try, ast.With, ast.If)):  # an `if` that holds of each message
                after = self.whether(one.body, after)
            elif any(is_print(n) and self.of_message(n) for n in ast.walk(one)):
                after = ALWAYS if isinstance(one, ast.Expr) and is_print(one.value) else UNKNOWN
        return after

    def is_there(self, test):
        """Whether a condition asks only whether there is a text: `msg.data != ''`, `msg.data and msg.data is not None`.
        That a number is not 0 is another question."""
        parts = test.values if isinstance(test, ast.BoolOp) and isinstance(test.op, ast.And) else [test]
        compared = [
            n for n in parts if isinstance(n, ast.Compare) and isinstance(n.ops[0], (ast.NotEq, ast.IsNot))
        ]
        empty = [getattr(n.comparators[0], "value", 0) for n in compared if dotted(n.left) == self.value]
        others = [n for n in parts if n not in compared and not ("" in empty and dotted(n) == self.value)]
        return not others and len(empty) == len(compared) and all(one in ("", None) for one in empty)


def under_condition(one, prints):
    """Return why these calls do not always print, as an `if` decides about it, and what to do."""
    line, printed = one.lineno, prints[0].lineno
    if printed > one.end_lineno:
        left = next(n.lineno for n in ast.walk(one) if isinstance(n, LEAVES))
        message = "the callback ends on line %d, before line %d prints, under the condition on line %d"
        return message % (left, printed, line), "print above line %d" % line
    if len(one.orelse) == 1 and isinstance(one.orelse[0], ast.If):
        message = "the `if` on line %d prints nothing where none of its conditions holds" % line
        return message, "print the message outside of it, or in an `else` at its end too"
    message = "line %d prints only under the condition on line %d" % (printed, line)
    if printed == line:
        message = "line %d prints only where its `if` holds" % line
    return message, "print outside of the `if` on line %d, without a condition" % line


def place(node):
    return node.lineno, node.col_offset


def is_log(node):
    return called_name(node).partition("_")[0] in LOGS


def is_print(node):
    """Whether it is a call that prints on the terminal."""
    if not isinstance(node, ast.Call):
        return False
    into = {dotted(k.value) for k in node.keywords if k.arg == "file"} - {"sys.stdout", "sys.stderr"}
    return (called_name(node) == "print" and not into) or is_log(node) or dotted(node.func) in STREAMS


def changes(node, found):
    """Whether an expression makes something else of the message's value in it."""
    if isinstance(node, ast.Call):
        return called_name(node) in CHANGES
    if isinstance(node, ast.Subscript):
        return True
    if isinstance(node, ast.UnaryOp):
        return isinstance(node.op, (ast.USub, ast.Not))
    if not isinstance(node, ast.BinOp):
        return isinstance(node, ast.Compare)
    other = node.right if found[0][0] else node.left
    if isinstance(node.op, ast.Add):
        return isinstance(other, ast.Constant) and not isinstance(other.value, str)
    return not (isinstance(node.op, ast.Mod) and not found[0][0])
