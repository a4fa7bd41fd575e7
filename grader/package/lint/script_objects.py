"""Finds attributes that a class in a student's Python gives no object, classes used as objects, where a script names
its node and topics, and what ROS is given that does not fit: sizes of queues, servers that are not started, names that
hide others. For `slips.py`.

Nothing is executed. Python 3.8, standard library only.
"""

import ast
import builtins
import difflib
from collections import Counter

from script_names import (
    CALL_BACK,
    bound_names,
    set_in,
)
from script_texts import NAMED
from script_tree import (
    TEXT_LIMIT,
    all_of,
    argument,
    callback_of,
    called_name,
    calls_in,
    dotted,
    functions_in,
    listed,
    names_in,
    parents_of,
    published_type,
    slip,
    statements_of,
    targets_of,
    walk,
)
from script_values import stored_in


def object_slips(tree):
    """Attributes that a class of this file gives no object, and classes that are used in place of an object."""
    classes = all_of(tree, ast.ClassDef)
    if any(called_name(n) == "setattr" for n in walk(tree)):
        return
    for one in classes:
        if all(dotted(base) == "object" for base in one.bases):
            own = Members(one, tree)
            yield from lacking_attributes(own)
            yield from given_behind_spin(own)
    yield from methods_inside(tree)
    yield from fields_of_none(tree)
    yield from classes_as_objects({one.name: one for one in classes}, tree)


class Members:
    """A class and its `methods`. `stores` has for each attribute where it is given a value, and in which method."""

    def __init__(self, node, tree):
        self.name, self.tree = node.name, tree
        self.methods = {n.name: n for n in node.body if isinstance(n, ast.FunctionDef)}
        self.fixed = bound_names(node)
        inside = [(n, m) for m in self.methods.values() for n in ast.walk(m)]
        owner = {id(n): m for n, m in inside}
        plain = [n for n, _ in inside if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)]
        self.plain = {n.id: n.lineno for n in reversed(plain)}
        """Where each name of a method, which is no attribute, first gets a value."""
        self.called_on_self = called_methods(tree)
        tests = [n for n, _ in inside if isinstance(n, ast.Compare) and isinstance(n.ops[0], ast.Eq)]
        self.compared = {dotted(n.left): n.lineno for n in tests if isinstance(parents_of(tree)[n], ast.Expr)}
        self.stores, self.reads = {}, []
        for n in all_of(tree, ast.Attribute):
            method = owner.get(id(n))
            given = method.args.args[:1] if method is not None else []
            if not isinstance(n.ctx, ast.Load):
                self.stores.setdefault(n.attr, []).append((n, method))
            elif given and dotted(n.value) == given[0].arg and not n.attr.startswith("__"):
                self.reads.append((n, method))
        self.called = {called_name(n) for n in walk(tree)}
        # a function of another module that is given the object may give it attributes
        others = [
            n for n, _ in inside if isinstance(n, ast.Call) and any(dotted(one) == "self" for one in n.args)
        ]
        self.is_handed = bool({called_name(n) for n in others} - set(functions_in(tree)) - set(dir(builtins)))
        self.calls = {m: {} for m in self.methods.values()}
        for m, lines in self.calls.items():
            for n in ast.walk(m):
                lines.setdefault(called_name(n), getattr(n, "lineno", 0))

    def astray(self):
        """Return the method that is meant to be `__init__`, with why it is not and what to do; None for none."""
        if "__init__" in self.methods:
            return None
        for name, method in self.methods.items():
            if name not in self.called and name.replace("_", "").lower() in ("init", "int", "inti", "ini"):
                why = "`%s` on line %d is not the name of the method that Python calls" % (
                    name,
                    method.lineno,
                )
                return method, why, "on line %d, write `__init__` instead of `%s`" % (method.lineno, name)
        methods = {m for n in all_of(self.tree, ast.ClassDef) for m in n.body}
        for n in all_of(self.tree, ast.FunctionDef):
            if n.name == "__init__" and n not in methods:
                why = "`__init__` on line %d is not in the class %s" % (n.lineno, self.name)
                fix = "indent `def __init__` on line %d like the other methods of %s, and its lines below it"
                return n, why, fix % (n.lineno, self.name)
        return None


def lacking_attributes(own):
    """Yield the attributes that the methods of a class read and that its objects need not have by then."""
    astray = own.astray()
    if astray:
        yield slip(astray[0].lineno, "object", astray[1], astray[2], "__init__")
    inside = set(ast.walk(astray[0])) if astray else set()
    at_first = {called_name(n) for m in [own.methods.get("__init__")] if m for n in ast.walk(m)}
    for node, method in own.reads:
        name, stores = node.attr, own.stores.get(node.attr, [])
        givers = [m.name if m is not None else "__init__" for _, m in stores]
        given_elsewhere = not stores and (own.is_handed or name in OF_ROS_2)
        if name in own.fixed or node in inside or given_elsewhere:
            continue
        if stores and inside.issuperset(n for n, _ in stores):
            message, fix = astray[1:]
        elif not stores:
            message, fix = never_given(own, name, node.lineno)
        elif any(giver.startswith("__") and giver != "__init__" for giver in givers):
            continue  # Python itself calls `__enter__` and its like
        elif not own.called.union(["__init__", method.name]).intersection(givers):
            message = "only `%s(…)` gives `self.%s` a value, and it was not called before" % (givers[0], name)
            fix = "give `self.%s` its value in `__init__`, or call `self.%s(…)` there" % (name, givers[0])
        elif any(own.calls[method].get(giver, node.lineno) < node.lineno for giver in givers):
            continue
        elif not at_first.union(["__init__", method.name]).intersection(givers):
            message = "line %d of `%s(…)` gives `self.%s` a value, and had not been reached"
            fix = "give `self.%s` its value in `__init__`, before anything can ask for it" % name
            message %= (stores[0][0].lineno, givers[0], name)
        else:
            continue
        yield slip(node.lineno, "object", message, fix, name)


def given_behind_spin(own):
    """Yield where an attribute is read whose only value is given behind a `spin()` of another method."""
    for node, reader in own.reads:
        stored, method = own.stores.get(node.attr, [(node, reader)])[0]
        body = getattr(method, "body", ()) if len(own.stores.get(node.attr, ())) == 1 else ()
        spins = [n.lineno for n in body if isinstance(n, ast.Expr) and called_name(n.value) == "spin"]
        if method is not reader and spins and spins[0] < stored.lineno and node.attr not in own.fixed:
            message = "line %d gives `self.%s` a value, behind line %d, which waits until the node ends"
            fix = "move line %d above line %d" % (stored.lineno, spins[0])
            yield slip(node.lineno, "object", message % (stored.lineno, node.attr, spins[0]), fix, node.attr)


def fields_of_none(tree):
    """Yield where a callback sets fields of an attribute that never gets another value than None."""
    functions, callbacks = functions_in(tree), {}
    for call in (n for n in all_of(tree, ast.Call) if called_name(n) == "Subscriber"):
        callbacks.setdefault(callback_of(call, functions), published_type(call))
    empty = {}
    for n in all_of(tree, ast.Assign):
        for target in n.targets if getattr(n.value, "value", 0) is None else []:
            empty.setdefault(dotted(target), []).append(n.lineno)
    # as in `self.x, self.y = …`, too, and of an object from outside
    every = Counter(n.attr for n in stored_in([tree]))
    every.subtract(name.rpartition(".")[2] for name, lines in empty.items() for _ in lines)
    found = {}
    for function, kind in callbacks.items():
        for n in stored_in([function] if function and kind else []):
            name = dotted(n.value)
            if name.startswith("self.") and name in empty and not every[n.value.attr]:
                found[name] = empty[name][0], kind
    # It fails where a field is set, and where one is read.
    for n in all_of(tree, ast.Attribute):
        name = dotted(n.value)
        if name in found:
            message = "nothing gives `%s` another value than None, and None has no fields" % name
            fix = "on line %d, write `%s = %s()`" % (found[name][0], name, found[name][1])
            yield slip(n.lineno, "object", message, fix, n.attr)


OF_ROS_2 = (
    "create_publisher", "create_subscription", "create_timer", "create_service", "create_client", "create_rate",
    "get_logger", "get_clock", "declare_parameter", "get_parameter", "destroy_node",
)  # fmt: skip
"""What a node of ROS 2 has: that it is lacking here is no slip of a name."""


def methods_inside(tree):
    """Yield where a method is read that is defined inside another one, or that has its `self` in another place."""
    read = [n for n in all_of(tree, ast.Attribute) if isinstance(n.ctx, ast.Load)]
    reads = {n.attr: n.lineno for n in reversed(read)}
    for owner in all_of(tree, ast.ClassDef):
        for method in (n for n in owner.body if isinstance(n, ast.FunctionDef)):
            given = [arg.arg for arg in method.args.args]
            fix = "on line %d, write `def %s(self, %s):`"
            fix %= (method.lineno, method.name, ", ".join(n for n in given if n != "self"))
            mixed = "self" in given[1:] and not method.decorator_list
            for one in all_of(method, ast.Attribute) if mixed else ():
                if dotted(one.value) == "self":
                    yield slip(one.lineno, "object", "`self` has to be the first parameter", fix, one.attr)
            inner = [n for n in ast.walk(method) if isinstance(n, ast.FunctionDef) and n is not method]
            inner = [n for n in inner if not isinstance(parents_of(tree)[n], ast.ClassDef)]
            for one in inner:
                if one.name in reads and [arg.arg for arg in one.args.args[:1]] == ["self"]:
                    message = "`%s` on line %d is inside of `%s`" % (one.name, one.lineno, method.name)
                    fix = "begin line %d with the same spaces or tabs as line %d, and move the lines below it as far"
                    fix %= (one.lineno, method.lineno)
                    yield slip(reads[one.name], "object", message, fix, one.name)


def never_given(own, name, line):
    """Return why an attribute is not there that nothing gives a value, and what to do."""
    if name in own.plain:
        why = "line %d gives a value to `%s`, and not to `self.%s`" % (own.plain[name], name, name)
        return why, "on line %d, write `self.%s` instead of `%s`" % (own.plain[name], name, name)
    # what is called is a method
    there = sorted(own.fixed | (set() if name in own.called_on_self else set(own.stores)))
    near = difflib.get_close_matches(name, there, 1, 0.75)
    near = near or [n for n in there if n.startswith(name) or name.startswith(n)]
    if near:
        fix = "on line %d, write `self.%s` instead of `self.%s`" % (line, near[0], name)
        return "did you mean self.%s?" % near[0], fix
    if name in own.called_on_self:
        return never_defined(own, name, line)
    why = "nothing in the file gives `self.%s` a value" % name
    line = own.compared.get("self." + name)
    if line:
        return why, "on line %d, write `self.%s =` in place of `self.%s ==`" % (line, name, name)
    return why, "in `__init__`, write `self.%s = …`, with the value that it should have" % name


def called_methods(tree):
    """Return what is called of `self`, here or by rospy, which was given it to call."""
    calls = all_of(tree, ast.Call)
    given = [arg for n in calls if called_name(n) in CALL_BACK for arg in n.args[1:]]
    given += [k.value for n in calls if called_name(n) in CALL_BACK for k in n.keywords]
    names = [dotted(n) for n in [n.func for n in calls] + given]
    return {name[len("self.") :] for name in names if name.startswith("self.")}


def never_defined(own, name, line):
    """Return why a class has no such method, and what to do."""
    why = "the class %s has no method `%s`" % (own.name, name)
    for outside in (n for n in all_of(own.tree, ast.FunctionDef) if n.name == name):
        if [one.arg for one in outside.args.args[:1]] == ["self"]:
            fix = "indent `def %s` on line %d like the other methods of %s, and its lines below it"
            return why, fix % (name, outside.lineno, own.name)
        return why, "on line %d, write `%s` instead of `self.%s`" % (line, name, name)
    return why, "add a method `def %s(self, …):` to the class %s" % (name, own.name)


def classes_as_objects(classes, tree):
    """Yield where a method is called of a class, or of a name that was given the class, in place of an object, and
    where a field is set of one that was given a class of messages."""
    values = {}
    for n in all_of(tree, ast.Assign):
        for target in n.targets:
            values.setdefault(dotted(target), []).append(n)
    imports = [n for n in all_of(tree, ast.ImportFrom) if (n.module or "").endswith((".msg", ".srv"))]
    of_messages = {one.asname or one.name for n in imports for one in n.names}
    stored = [n for n in all_of(tree, ast.Attribute) if isinstance(n.ctx, ast.Store)]
    stored = [dotted(n.value).split(".") for n in stored]
    stored = [parts for parts in stored if all(parts)]  # `...` stands for what has no name, as `cells[0]`
    for owner in sorted({".".join(parts[:end]) for parts in stored for end in range(1, len(parts) + 1)}):
        # a name that is given something else, too, may be another one, of another function
        every = values.get(owner, ())
        for given in every if all(dotted(n.value) in of_messages for n in every) else ():
            kind, message = dotted(given.value), "`%s` is the class itself, not an object of it" % owner
            fix = "on line %d, write `%s = %s()`" % (given.lineno, owner, kind)
            yield slip(given.lineno, "object", message, fix, kind)
    for n in all_of(tree, ast.Call):
        if not isinstance(n.func, ast.Attribute) or n.args:
            continue
        owner, given = dotted(n.func.value), values.get(dotted(n.func.value), [])
        name = dotted(given[0].value) if len(given) == 1 else owner
        own = {m.name: m for m in getattr(classes.get(name), "body", ()) if isinstance(m, ast.FunctionDef)}
        method = own.get(n.func.attr)
        if method is None or method.decorator_list or not method.args.args:
            continue
        init = own.get("__init__")
        made = "%s(%s)" % (name, "…" if init is not None and len(init.args.args) > 1 else "")
        right = "%s = %s" % (owner, made) if given else "%s.%s()" % (made, method.name)
        line = given[0].lineno if given else n.lineno
        message, fix = (
            "`%s` is the class itself, not an object of it",
            "on line %d, write `%s`" % (line, right),
        )
        yield slip(n.lineno, "object", message % owner, fix, method.name)


def names_of_objects(tree):
    """Yield names that one method of a class gives a value and another reads, and `self` outside of all functions."""
    parts = all_of(tree, ast.FunctionDef, ast.ClassDef)
    within = {inner for one in parts for inner in ast.walk(one)}
    names = all_of(tree, ast.Name)
    shared = bound_names(tree) | set(dir(builtins))
    shared |= {name for n in within if isinstance(n, ast.Global) for name in n.names}
    for one in (n for n in names if n.id == "self" and n not in within):
        given = any(one in n.args for n in all_of(tree, ast.Call))
        fix = "take `self` out of the brackets" if given else "write the object's name instead of `self`"
        message = "`self` is known only inside of a class's methods"
        yield slip(one.lineno, "undefined", message, "on line %d, %s" % (one.lineno, fix), "self")
    for owner in (one for one in parts if isinstance(one, ast.ClassDef)):
        methods = [n for n in owner.body if isinstance(n, ast.FunctionDef)]
        methods = [n for n in methods if n.args.args and n.args.args[0].arg == "self"]
        names = {m.name: [n for n in ast.walk(m) if isinstance(n, ast.Name)] for m in methods}
        givers = {n.id: m for m in names for n in names[m] if not isinstance(n.ctx, ast.Load)}
        for method in methods:
            own = {n.arg for n in ast.walk(method) if isinstance(n, ast.arg)} | shared
            own |= {n.id for n in names[method.name] if not isinstance(n.ctx, ast.Load)}
            for node in (n for n in names[method.name] if n.id in givers and n.id not in own):
                uses = [*names[method.name], *names[givers[node.id]]]
                lines = listed(sorted({n.lineno for n in uses if n.id == node.id}))
                message = "`%s` has a value only in `%s(…)`" % (node.id, givers[node.id])
                fix = "on %s, write `self.%s` instead of `%s`" % (lines, node.id, node.id)
                yield slip(node.lineno, "undefined", message, fix, node.id)


# ---- what ROS is given


def subscribed_again(tree):
    """Yield each `Subscriber(…)` in a loop that runs until the node ends: each turn makes another one. So does
    `wait_for_message(…)`, for one message, where the script has no other."""
    told = set(calls_in(tree, "Subscriber"))
    for loop in all_of(tree, ast.While):
        waits = next(iter(calls_in(loop, "wait_for_message")), None)
        left = any(isinstance(n, (ast.Break, ast.Return)) for n in ast.walk(loop)) if waits else True
        # a loop that what it hears may end wants one message
        if not left and not told and not names_in(loop.test) & set_in(loop):
            told = {waits}
            message = "wait_for_message(…) on line %d listens for one message in each turn of its loop, and not between"
            fix = "write a callback that prints, and rospy.Subscriber(…) with it and rospy.spin() in place of the loop"
            yield slip(waits.lineno, "subscribed-again", message % waits.lineno, fix)
        if calls_in(loop.test, "is_shutdown") and not calls_in(loop, "spin"):
            made = next((n for n in ast.walk(loop) if called_name(n) == "Subscriber"), None)
            if made is not None:
                message = "the loop on line %d makes the Subscriber on line %d again and again"
                fix = "move line %d above line %d, and write `rospy.spin()` in place of the loop if that is all it does"
                lines = (made.lineno, loop.lineno)
                yield slip(made.lineno, "subscribed-again", message % lines[::-1], fix % lines)
        made = [n for n in ast.walk(loop) if called_name(n) in ("Buffer", "TransformListener")]
        waits = calls_in(loop, "waitForTransform", "wait_for_transform_async", "can_transform")
        waits += [n for n in calls_in(loop, "lookup_transform") if len(n.args) > LOOKED_UP or n.keywords]
        is_made = any(called_name(n) == "TransformListener" for n in made)
        if is_made and not waits and calls_in(loop.test, "is_shutdown"):
            lines = listed(sorted({n.lineno for n in made}))
            message = "each turn of the loop makes another TransformListener, which has heard nothing yet"
            fix = "move %s above line %d" % (lines, loop.lineno)
            yield slip(made[0].lineno, "wrong-value", message, fix, "added")


LOOKED_UP = 3
"""So many arguments of `lookup_transform` say what it looks up; a fourth is how long it waits for that."""


def taken_off(tree):
    """Yield where a `Publisher` or `Subscriber` is unregistered, but for what runs at the node's end."""
    at_end = {dotted(arg).rpartition(".")[2] for n in calls_in(tree, "on_shutdown") for arg in n.args}
    # `__exit__` and its like run at the end, too
    functions = [n for n in all_of(tree, ast.FunctionDef) if n.name in at_end or n.name.startswith("__")]
    after = [one for n in walk(tree) for one in below_the_last(statements_of(n))]
    after += [one for n in all_of(tree, ast.Try) for one in n.finalbody]
    spared = {inner for one in functions + after for inner in ast.walk(one)}
    for node in calls_in(tree, "unregister"):
        if not node.args and node not in spared:
            line, name = node.lineno, dotted(node.func.value)
            message = "line %d unregisters `%s`, which then has no topic" % (line, name)
            yield slip(line, "unregistered", message, "delete line %d" % line)


def below_the_last(block):
    """Return the statements below the first of a block that waits for the node's end."""
    for at, one in enumerate(block):
        is_run = not isinstance(one, (ast.FunctionDef, ast.ClassDef))
        if is_run and calls_in(getattr(one, "test", one), "spin", "is_shutdown"):
            return block[at + 1 :]
    return []


def unstarted_servers(tree):
    """Yield each `SimpleActionServer(…, auto_start=False)` where nothing in the script calls or names a `start`."""
    started = any(isinstance(n, ast.Attribute) and n.attr == "start" for n in walk(tree))
    given = targets_of(tree)
    own = {
        n.name for n in all_of(tree, ast.ClassDef) if any("ActionServer" in dotted(one) for one in n.bases)
    }
    for node in () if started else walk(tree):
        waits = [k.value for k in getattr(node, "keywords", ()) if k.arg == "auto_start"]
        is_left = any(getattr(v, "value", None) is False for v in waits)
        if is_left and (called_name(node) in SERVERS or (own and called_name(node) == "__init__")):
            made = next((n for n in all_of(tree, ast.Call) if called_name(n) in own), node)
            message = "the action server of line %d is never started" % node.lineno
            fix = "below line %d, write `%s.start()`" % (made.end_lineno, given.get(id(made), "server"))
            yield slip(node.lineno, "not-started", message, fix)


SERVERS = ("SimpleActionServer", "ActionServer")


def hidden_names(tree):
    """Yield callbacks that are defined twice, so that the first one is never called; and calls of a name that a line
    imports and a class below it takes."""
    functions, classes = {}, {n.name: n for n in all_of(tree, ast.ClassDef)}
    for node in getattr(tree, "body", ()):
        if isinstance(node, ast.FunctionDef):
            functions.setdefault(node.name, []).append(node)
    imports = [(n, a) for n in all_of(tree, ast.ImportFrom) for a in n.names]
    imported = {a.asname or a.name: "%s.%s" % (n.module, a.name) for n, a in imports}
    yield from hidden_classes(tree, imported)
    for node in walk(tree):
        name = called_name(node)
        given = node.args[2:3] if name == "Subscriber" else []
        twice = functions.get(dotted(given[0]), []) if given else []
        if len(twice) > 1:
            lines = (twice[1].lineno, twice[0].name, twice[0].lineno)
            message = "line %d defines `%s` again, so that the one on line %d is never called" % lines
            fix = "give the function on line %d another name, also in the Subscriber(…) that should call it"
            yield slip(lines[0], "defined-twice", message, fix % lines[0], twice[0].name)
        if isinstance(getattr(node, "func", None), ast.Name) and name in classes and name in imported:
            message = "the class on line %d is called %s too, and hides what is imported"
            message %= (classes[name].lineno, name)
            fix = "write `%s(…)` on line %d, and `import %s` at the top if it is not there"
            fix %= (imported[name], node.lineno, imported[name].partition(".")[0])
            yield slip(node.lineno, "defined-twice", message, fix, name)


def hidden_classes(tree, imported):
    """Yield the first message or value that takes the name of a class, which an import gives: `String = String()`."""
    made = [(n, name) for n in all_of(tree, ast.Assign) for name in map(dotted, n.targets)]
    made = [(n, name) for n, name in made if name in imported and name[:1].isupper()]
    made = [(n, name, dotted(getattr(n.value, "func", None)) == name) for n, name in made]
    for node, name, is_made in [one for one in made if one[2] or ".msg." in imported[one[1]]][:1]:
        is_message = ".msg." in imported[name]
        classes = {id(n.func) for n in all_of(tree, ast.Call)}
        given = (argument(n, 1, "data_class") for n in walk(tree) if called_name(n) in NAMED)
        classes |= {id(one) for types in given for one in types}
        names = {n.id for n in all_of(tree, ast.Name)}
        free = [one for one in ("msg", "message") if one not in names and is_message]
        other = (free or ["own_" + name.lower()])[0]
        what = ("message" if is_message else "object") if is_made else "value"
        meant = [n for n in walk(tree) if getattr(n, "id", "") == name and id(n) not in classes]
        where = listed(sorted({n.lineno for n in meant}))
        message = "line %d calls a%s `%s`, and hides the class of that name"
        message %= (node.lineno, (" " if is_message else "n ") + what, name)
        given = "%s(%s)" % (name, "…" * bool(node.value.args or node.value.keywords)) if is_made else "…"
        fix = "on %s, call the %s `%s`, as in `%s = %s`" % (where, what, other, other, given)
        yield slip(node.lineno, "hides-class", message, fix, name)


def queue_sizes(tree):
    """Publishers whose `queue_size` is a string, or a number without its name: rospy takes it, and sends nothing."""
    for node in calls_in(tree, "Publisher"):
        third = node.args[2] if len(node.args) == 3 else None
        if isinstance(third, ast.Constant) and type(third.value) is int and third.value:
            message = "the third value of `Publisher(…)` is no queue size, which it takes by its name"
            fix = "write `queue_size=%d` instead of `%d`" % (third.value, third.value)
            yield slip(third.lineno, "queue-size", message, fix)
        for one in node.keywords:
            value = getattr(one.value, "value", None)
            if one.arg == "queue_size" and isinstance(value, str):
                fix = "write `queue_size=%s`, without quotes" % (value[:TEXT_LIMIT] or "10")
                yield slip(one.value.lineno, "queue-size", "`queue_size` is a string", fix)
