"""Finds calls that cannot work where they stand, for `slips.py`: of functions that take a lock that is held, with two
values in each other's place, and of a node's own parameters before it is one.

Nothing is executed. Python 3.8, standard library only.
"""

import ast
import re

from script_tree import (
    FUNCTIONS,
    all_of,
    argument,
    called_name,
    calls_in,
    dotted,
    is_call,
    is_call_alone,
    of_roscpp,
    parents_of,
    slip,
    statements_of,
    targets_of,
    text_of,
)

TAKES_LATER = (*FUNCTIONS, ast.ClassDef)
"""What stands in these runs when they are called."""


def calls_of_roscpp(tree):
    """`rospy.spinOnce()`, where rospy runs callbacks in threads of its own, and `rospy.ok()`."""
    stays = calls_in(tree, "spin") or [
        n for n in all_of(tree, ast.While) if calls_in(n.test, "is_shutdown", "ok")
    ]
    for node in of_roscpp(tree):
        owner, name = dotted(node.func.value), node.func.attr
        statement = parents_of(tree)[node]
        alone = len(getattr(parents_of(tree).get(statement), "body", ())) == 1
        instead = "not rospy.is_shutdown()" if name == "ok" else "" if stays and not alone else "rospy.spin()"
        fix = "on line %d, write `%s` instead of `%s.%s()`" % (node.lineno, instead, owner, name)
        fix = fix if instead else "delete line %d" % node.lineno
        other = "has `is_shutdown()`" if name == "ok" else "runs callbacks in threads of its own"
        message = "rospy has no `%s`: it %s" % (name, other)
        yield slip(node.lineno, "undefined", message, fix, "rospy.%s" % name if owner == "rospy" else owner)


def locks_taken_twice(tree):
    """Where a function takes a lock that is held there: a `Lock()`, unlike an `RLock()`, lets nobody in twice."""
    for scope, name, made in locks(tree):
        functions = {n.name: n for n in statements_of(scope) if isinstance(n, ast.FunctionDef)}
        prefix = name.rpartition(".")[0]
        taking = {
            ".".join(filter(None, (prefix, own.name))): line
            for own in functions.values()
            if set(map(dotted, own.decorator_list)) <= {"property"} and (line := first_taken(own, name))
        }
        taking.update(taken_within(functions, taking, prefix))
        taking.update(tables_of(scope, taking))
        for block in all_of(tree, ast.With, ast.AsyncWith, ast.Expr):
            for node, line, called in taken_while_held(block, name, taking, tree):
                if scope is tree or is_inside(node, scope, tree):
                    yield held_twice(name, made, (block.lineno, node.lineno, line), called)
                    break
            else:
                continue
            break


def locks(tree):
    """Yield the locks of a module and of its classes, each with its name and the call that makes it; none that two
    lines make."""
    parents, kept = parents_of(tree), targets_of(tree)
    given = [dotted(t) for n in all_of(tree, ast.Assign) for t in n.targets]
    for call in all_of(tree, ast.Call):
        name = kept.get(id(call), "...")
        if dotted(call.func) not in ("threading.Lock", "Lock") or "..." in name or given.count(name) > 1:
            continue
        scope = parents[parents[call]]
        while name.startswith("self.") and not isinstance(scope, (ast.ClassDef, ast.Module)):
            scope = parents[scope]
        if isinstance(scope, ast.ClassDef if name.startswith("self.") else ast.Module):
            yield scope, name, call


def called_of(call):
    """Return the name of what is called: `self.states` of `self.states[key](…)`."""
    return dotted(call.func.value if isinstance(call.func, ast.Subscript) else call.func)


def properties_of(tree):
    """Return the names of the properties of a module's classes, which are called without brackets."""
    functions = all_of(tree, ast.FunctionDef)
    return {n.name for n in functions if any(dotted(one) == "property" for one in n.decorator_list)}


def taken_within(functions, taking, prefix):
    """Return the methods that read a property, or call a method, which takes the lock, each with the line of that."""
    found = {}
    for own in functions.values():
        name = ".".join(filter(None, (prefix, own.name)))
        used = [
            taking[dotted(n)]
            for n in now_run(own.body)
            if isinstance(n, ast.Attribute) and dotted(n) in taking
        ]
        if used and name not in taking and not own.decorator_list:
            found[name] = used[0]
    return found


def tables_of(scope, taking):
    """Return the dictionaries one of whose values is such a method."""
    found = {}
    for node in ast.walk(scope):
        if isinstance(node, ast.Assign) and isinstance(node.value, ast.Dict):
            lines = [taking[dotted(one)] for one in node.value.values if dotted(one) in taking]
            if lines and "..." not in dotted(node.targets[0]):
                found[dotted(node.targets[0])] = lines[0]
    return found


def first_taken(function, name):
    """Return the line on which a function takes the lock, whatever else is the case; 0 where it may not."""
    for one in function.body:
        if takes(one, name):
            return one.lineno
        if any(isinstance(n, ast.Return) or is_call(n, "release", "locked") for n in ast.walk(one)):
            break
    return 0


def takes(one, name):
    """Whether a statement takes the lock and waits for it."""
    if isinstance(one, (ast.With, ast.AsyncWith)):
        return any(dotted(item.context_expr) == name for item in one.items)
    asked = one.value if is_call_alone(one) else None
    return (
        is_call(asked, "acquire") and dotted(asked.func.value) == name and not (asked.args or asked.keywords)
    )


def taken_while_held(block, name, taking, tree):
    """Yield what stands in a block that holds the lock, and takes it: with its line, and that of the function that it
    calls for it."""
    if not takes(block, name):
        return
    held = block.body if not isinstance(block, ast.Expr) else below(block, tree)
    for node in now_run(held):
        if is_call(node, "release") and dotted(node.func.value) == name:
            return
        if takes(node, name):
            yield node, node.lineno, ""
        elif isinstance(node, ast.Call) and called_of(node) in taking:
            brackets = "" if isinstance(node.func, ast.Subscript) else "()"
            yield node, taking[called_of(node)], called_of(node) + brackets
        elif isinstance(node, ast.Attribute) and dotted(node) in taking and node.attr in properties_of(tree):
            yield node, taking[dotted(node)], dotted(node)


def below(statement, tree):
    """Return the statements below one in its block."""
    around = parents_of(tree)[statement]
    blocks = (statements_of(around, part) for part in ("body", "orelse", "finalbody"))
    block = next((one for one in blocks if statement in one), [])
    return block[block.index(statement) + 1 :] if block else []


def now_run(statements):
    """Yield the nodes of statements from the first line to the last, without those that run only when called."""
    for one in statements:
        if not isinstance(one, TAKES_LATER):
            yield one
            yield from now_run(ast.iter_child_nodes(one))


def is_inside(node, scope, tree):
    while node is not None and node is not scope:
        node = parents_of(tree).get(node)
    return node is scope


def held_twice(name, made, lines, called):
    held, line, taken = lines
    again = "`%s` takes it again on line %d" % (called, taken) if called else "it is taken again"
    message = "`%s`, taken on line %d, is still held on line %d, where %s: a `Lock()` lets nobody in twice, "
    message += "and what waits for it never ends"
    bare = isinstance(made.func, ast.Name)
    fix = "write `%sRLock()` on line %d" % ("" if bare else "threading.", made.lineno)
    fix += ", and import `RLock` from threading" if bare else ""
    return slip(line, "stuck", message % (name, held, line, again), fix, "lock")


def values_out_of_order(tree):
    """Calls of the script's own functions and classes that give two values, named as parameters, in each other's
    place."""
    takers = own_takers(tree)
    yield from partial_out_of_order(tree, takers)
    for call in all_of(tree, ast.Call):
        name = dotted(call.func)
        names = takers.get(name.removeprefix("self."))
        if names is None or any(isinstance(one, ast.Starred) for one in call.args):
            continue
        given = [dotted(one).rpartition(".")[2] for one in call.args]
        pairs = [(a, b) for a in range(min(len(given), len(names))) for b in range(a)]
        for later, first in pairs:
            if given[later] == names[first] != given[first] == names[later]:
                message = "`%s(…)` takes `%s` before `%s`, and is given them the other way round"
                fix = "on line %d, swap `%s` and `%s` in the brackets"
                place = (call.lineno, dotted(call.args[first]), dotted(call.args[later]))
                yield slip(
                    call.lineno,
                    "wrong-value",
                    message % (name, names[first], names[later]),
                    fix % place,
                    "swapped",
                )
                break


def partial_out_of_order(tree, takers):
    """`partial(step, length, pub)` of `def step(publisher, length, event)`, whose `length` comes second."""
    for call in all_of(tree, ast.Call):
        name = dotted(call.args[0]) if called_name(call) == "partial" and call.args else ""
        names = takers.get(name.removeprefix("self."), ())
        given = [dotted(one).rpartition(".")[2] for one in call.args[1:]]
        for at, one in enumerate(given[: len(names)]):
            place = names.index(one) if one in names else at
            if place != at and place < len(given) and given[place] not in names[place:]:
                message = "`%s(…)` takes `%s` before `%s`, and is given them the other way round"
                message %= (name, *sorted((names[at], names[place]), key=names.index))
                fix = "on line %d, swap `%s` and `%s` in the brackets"
                fix %= (call.lineno, dotted(call.args[1 + at]), dotted(call.args[1 + place]))
                yield slip(call.lineno, "wrong-value", message, fix, "swapped")
                break


def own_takers(tree):
    """Return the names of the parameters of the functions, methods and classes of a module, by theirs; of one that
    two have, none."""
    parents, found, twice = parents_of(tree), {}, set()
    for one in all_of(tree, ast.FunctionDef):
        owner = parents.get(one)
        in_class = isinstance(owner, ast.ClassDef)
        static = any(dotted(d) == "staticmethod" for d in one.decorator_list)
        name = owner.name if in_class and one.name == "__init__" else one.name
        twice |= {name} & set(found)
        found[name] = [a.arg for a in one.args.args][1 if in_class and not static else 0 :]
    return {name: names for name, names in found.items() if name not in twice}


def params_read_early(tree):
    """The node's own parameters that a script reads while it is loaded, above all that may make it a node."""
    inits = [n for n in all_of(tree, ast.Call) if called_name(n) == "init_node"]
    own = {n.name for n in all_of(tree, ast.FunctionDef, ast.ClassDef)}
    loaded = [n for one in tree.body for n in at_load(one)]
    begins = [n.lineno for n in loaded if called_name(n) in own or n in inits]
    for call in loaded if inits and begins else ():
        private = any(text_of(one).startswith("~") for one in argument(call, 0, "param_name"))
        if called_name(call) != "get_param" or not private or call.lineno >= min(begins):
            continue
        in_class = isinstance(parents_of(tree)[statement_of(call, tree)], ast.ClassDef)
        message = "a parameter is read before `rospy.init_node(…)` on line %d, when the node has no name yet"
        fix = "move line %d below `rospy.init_node(…)`" % call.lineno
        if in_class:
            fix = "read the parameter of line %d in `__init__`: a class's own lines run when it is defined"
            fix %= call.lineno
        yield slip(call.lineno, "wrong-value", message % inits[0].lineno, fix, "early")


def at_load(node):
    """Yield the calls that run when the file is loaded."""
    if isinstance(node, FUNCTIONS):
        return
    if isinstance(node, ast.Call):
        yield node
    for one in ast.iter_child_nodes(node):
        yield from at_load(one)


def statement_of(node, tree):
    while not isinstance(node, ast.stmt):
        node = parents_of(tree)[node]
    return node


def arguments_out_of_order(tree):
    """`ask(float(argv[1]), float(argv[3]), float(argv[2]))`: a call that is given the command line's words in another
    order than they come in."""
    for call in all_of(tree, ast.Call):
        found = [[n for n in ast.walk(one) if isinstance(n, ast.Subscript)] for one in call.args]
        words = [inner[0] for inner in found if len(inner) == 1]
        names = {dotted(n.value) for n in words}
        keys = [getattr(n.slice, "value", n.slice) for n in words]
        numbers = [getattr(key, "value", key) for key in keys]
        if len(words) < 2 or len(words) != len(found) or len(names) != 1 or not ARGUMENTS.search(min(names)):
            continue
        if all(type(n) is int and n > 0 for n in numbers) and sorted(numbers) != numbers:
            late = next(n for at, n in enumerate(numbers) if n != sorted(numbers)[at])
            name = min(names)
            message = "`%s[%d]` is given before `%s[%d]`" % (
                name,
                late,
                name,
                min(n for n in numbers[1:] if n < late),
            )
            fix = "on line %d, give them in the order of the command line, if that is theirs" % call.lineno
            yield slip(call.lineno, "wrong-value", message, fix, "argv")


ARGUMENTS = re.compile(r"(?:^|\.)arg(?:v|s|uments)$")


def bare_decorators(tree):
    """Functions that decorate another one and return nothing, so that its name stands for nothing."""
    functions = {n.name: n for n in all_of(tree, ast.FunctionDef)}
    for own in functions.values():
        for mark in own.decorator_list:
            maker = functions.get(called_name(mark) or dotted(mark))
            inner = [n for n in statements_of(maker) if isinstance(n, ast.FunctionDef)] if maker else []
            is_made = (
                any(isinstance(n, ast.Return) and n.value for n in statements_of(maker)) if maker else True
            )
            returns = [n for n in ast.walk(maker) if isinstance(n, ast.Return) and n.value] if maker else []
            if (
                maker
                and len(inner) == 1
                and not is_made
                and not any(dotted(n.value) == inner[0].name for n in returns)
            ):
                message = "`%s(…)`, which decorates `%s` on line %d, returns nothing, and `%s` is None then"
                message %= (maker.name, own.name, mark.lineno, own.name)
                fix = "below line %d, write `return %s` at the end of `%s`" % (
                    inner[0].end_lineno,
                    inner[0].name,
                    maker.name,
                )
                yield slip(maker.lineno, "wrong-value", message, fix, "decorator " + own.name)
