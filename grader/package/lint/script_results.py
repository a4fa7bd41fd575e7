"""Finds what becomes of what a student's functions make and return, for `slips.py`: results that nothing keeps, lists
in the place of a response, which fields of a message are filled in, which errors a `try` catches, and names that keep
their first value.

These are facts, which checks compare with what the lab asks. Nothing is executed. Python 3.8, standard library only.
"""

import ast
import itertools
from collections import Counter

from script_names import (
    USES_LIMIT,
    caught_by,
    is_of_series,
    walk_own,
)
from script_texts import VALUE, Texts
from script_tree import (
    all_of,
    argument,
    called_name,
    calls_in,
    dotted,
    functions_in,
    is_call_alone,
    names_in,
    parents_of,
    reads_names_in_texts,
    slip,
    statements_of,
    walk,
)

BROAD = {"", "Exception", "BaseException"}
OTHER_VALUES = (ast.BoolOp, ast.Compare, ast.Dict, ast.DictComp, ast.Lambda, ast.List, ast.ListComp)
OTHER_VALUES += (ast.Set, ast.SetComp, ast.Tuple)
NAME_USES_LIMIT = 200
HANDED_ON = ("publish", "publish_feedback", "set_succeeded", "set_aborted", "set_preempted", "send_goal")


def results(tree):
    yield from dropped_results(tree)
    yield from listed_answers(tree)
    yield from filled_fields(tree)
    yield from narrow_handlers(tree)
    yield from unreached_returns(tree)
    yield from left_in_first_turn(tree)
    meant = misnamed_targets(tree)
    for node, (name, other) in meant.items():
        message = "nothing reads `%s`, to which a value is given here: `%s` is meant" % (name, other)
        yield slip(node.lineno, "no-effect", message, "write `%s` in place of `%s`" % (other, name), name)
    yield from never_given(tree, {other.rpartition(".")[2] for _, other in meant.values()})


def dropped_results(tree):
    """What a function returns, where each use of the function is a call whose result nothing keeps."""
    used = Counter(dotted(n).rpartition(".")[2] for n in all_of(tree, ast.Name, ast.Attribute))
    alone = {}
    for node in filter(is_call_alone, walk(tree)):
        alone.setdefault(called_name(node.value), []).append(node)
    given = {dotted(n.targets[0]): n.value for n in all_of(tree, ast.Assign)}
    read = Texts(given, set())
    for name, own in functions_in(tree).items():
        if name not in alone or len(alone[name]) != used[name]:
            continue
        for node in walk_own(own):
            if isinstance(node, ast.Return) and node.value and not is_other(node.value, given):
                call = alone[name][0].value
                text = read.of(node.value)
                yield slip(call.lineno, "drops-result", text or VALUE, str(node.lineno), dotted(call.func))


def is_other(value, given):
    """Whether it is no number and no text: a list, a condition, what a class makes, such as a publisher."""
    if isinstance(value, ast.Constant):
        return True
    value = given.get(dotted(value), value) if isinstance(value, ast.Name) else value
    return called_name(value)[:1].isupper() or isinstance(value, OTHER_VALUES)


def listed_answers(tree):
    """Lists and tuples that a service's callback returns, with the names of what is in them."""
    functions, handlers = functions_in(tree), {}
    for call in all_of(tree, ast.Call):
        given = argument(call, 2, "handler") if called_name(call) == "Service" else []
        name = dotted(given[0]).rpartition(".")[2] if given else ""
        if name in functions:
            handlers[name] = functions[name]
    for own in handlers.values():
        for node in walk_own(own):
            if isinstance(node, ast.Return) and isinstance(node.value, (ast.List, ast.Tuple)):
                kind = "list" if isinstance(node.value, ast.List) else "tuple"
                yield slip(node.lineno, "returns-list", ", ".join(map(dotted, node.value.elts)), name=kind)


def filled_fields(tree):
    """Which fields each message, response or result gets that a function makes; nothing of a class of which one may get
    others."""
    parents, found = parents_of(tree), {}
    used, shared = Counter(n.id for n in all_of(tree, ast.Name)), names_of_inner(tree)
    for own in [tree, *all_of(tree, ast.FunctionDef)]:
        nodes, uses = list(walk_own(own)), {}
        for n in nodes:
            if isinstance(n, ast.Name) and n.id not in shared:
                uses.setdefault(n.id, []).append(n)
        if own is tree:  # of names that functions share, not all uses are here
            uses = {name: here for name, here in uses.items() if len(here) == used[name]}
        calls = [n for n in nodes if called_name(n)[:1].isupper()]
        found.update((call, fields_of(call, uses, parents)) for call in calls)
    made = [n for n in all_of(tree, ast.Call) if called_name(n)[:1].isupper()]
    unsure = {called_name(n) for n in made if "*" in found.get(n, "*")}
    for call, fields in found.items():
        if called_name(call) not in unsure:
            yield slip(call.lineno, "fills", " ".join(sorted(fields)), name=called_name(call))


def names_of_inner(tree):
    """Return the names in functions that stand in others, and in their lambdas."""
    found, left = set(), [(tree, 0)]
    while left:
        node, depth = left.pop()
        if isinstance(node, ast.Name) and depth > 1:
            found.add(node.id)
        depth += isinstance(node, (ast.FunctionDef, ast.Lambda))
        left += [(one, depth) for one in ast.iter_child_nodes(node)]
    return found


def fields_of(call, uses, parents):
    """Return the fields that a message gets in the call that makes it and later, `*` for others."""
    fields = {k.arg or "*" for k in call.keywords} | ({"*"} if call.args else set())
    around = parents.get(call)
    if isinstance(around, ast.Assign):
        return fields | fields_of_variable(around, uses, parents)
    return fields if is_handed_on(call, parents) else {"*"}


def fields_of_variable(made, uses, parents):
    """Return the fields that are set or used of the variable that an assignment gives a message, `*` for others."""
    name = dotted(made.targets[0])
    is_plain = len(made.targets) == 1 and name in uses and not isinstance(parents.get(made), ast.ClassDef)
    found = set() if is_plain else {"*"}
    if len(uses.get(name, ())) > NAME_USES_LIMIT:
        return {"*"}
    for one in uses.get(name, ()):
        around = parents.get(one)
        if isinstance(around, ast.Attribute):
            found.add(around.attr)
        elif around is not made and not is_handed_on(one, parents):
            found.add("*")
    return found


def is_handed_on(node, parents):
    """Whether a function returns a value, or gives it to ROS."""
    around = parents.get(node)
    return isinstance(around, ast.Return) or called_name(around) in HANDED_ON


def narrow_handlers(tree):
    """The `except` of a `try` that catches some errors only; `fix` is the name that it gives them, `name` the first and
    the last line that it guards."""
    for node in all_of(tree, ast.Try):
        caught = {name for one in node.handlers for name in caught_by(one)}
        if caught and caught.isdisjoint(BROAD):
            last, end = node.handlers[-1], node.body[-1].end_lineno
            lines = "%d-%d" % (node.body[0].lineno, end)
            yield slip(last.lineno, "catches", " ".join(sorted(caught)), last.name or "", lines)


def unreached_returns(tree):
    """Functions of which every `return` with a value stands in an `if`, behind a `raise` or a plain `return`."""
    for own in all_of(tree, ast.FunctionDef):
        nodes = list(walk_own(own))
        returned = [n for n in nodes if isinstance(n, ast.Return) and n.value is not None]
        blocks = [(n, block) for n in nodes if isinstance(n, ast.If) for block in (n.body, n.orelse)]
        for condition, block in blocks if returned else ():
            ends = (i for i, n in enumerate(block) if is_plain_end(n))
            at = next(ends, len(block))
            behind = block[at + 1 :]
            if behind and all(behind[0].lineno <= n.lineno <= behind[-1].end_lineno for n in returned):
                word = "raise" if isinstance(block[at], ast.Raise) else "return"
                parts = (own.name, returned[0].lineno, word, block[at].lineno)
                message = "`%s` never comes to its `return` on line %d: the `%s` on line %d ends it" % parts
                first, last = behind[0].lineno, behind[-1].end_lineno
                lines = "line %d" % first if first == last else "lines %d to %d" % (first, last)
                fix = "indent %s only as far as the `if` on line %d" % (lines, condition.lineno)
                yield slip(first, "wrong-value", message, fix, "unreached")


def left_in_first_turn(tree):
    """`for` loops that return in their first turn, whatever an `if` in it finds: the others are never looked at."""
    for loop in all_of(tree, ast.For):
        ifs = [n for n in loop.body if isinstance(n, ast.If)]
        returned = [n for one in ifs for n in ast.walk(one) if isinstance(n, ast.Return)]
        goes_on = any(isinstance(n, (ast.Break, ast.Continue, ast.Yield)) for n in ast.walk(loop))
        last = final_return(loop.body)
        if last is None or not returned or goes_on or loop.orelse:
            continue
        message = (
            "the loop on line %d returns in its first turn, so that it never comes to a second one"
            % loop.lineno
        )
        fix = "move line %d below that loop, with the same spaces or tabs before it as line %d has"
        fix %= (last.lineno, loop.lineno)
        fix += ", and delete the `else:` above it" if last is not loop.body[-1] else ""
        yield slip(last.lineno, "wrong-value", message, fix, "turn")


def final_return(body):
    """Return the `return` that a block ends with, in the last `else` of its last `if` too, if its other branches return
    as well; None where it may go on."""
    last = body[-1]
    if isinstance(last, ast.Return):
        return last
    branches = isinstance(last, ast.If) and last.orelse and final_return(last.body) is not None
    return final_return(last.orelse) if branches and len(last.orelse) == 1 else None


def is_plain_end(node):
    """Whether a statement ends its function without a value."""
    return isinstance(node, ast.Raise) or (isinstance(node, ast.Return) and node.value is None)


def misnamed_targets(tree):
    """Return the assignments to a name that nothing reads, with that name and the only one that is read and nearly the
    same: `chnaged = True`. What is assigned in a class is read with `self.`."""
    every = all_of(tree, ast.Name, ast.Attribute) if not reads_names_in_texts(tree) else []
    read = {dotted(n) for n in every if isinstance(n.ctx, ast.Load)}
    stored = Counter(dotted(n) for n in every if isinstance(n.ctx, ast.Store))
    given, unread, found = {}, [], {}
    for node in all_of(tree, ast.Assign, ast.AugAssign):
        name = dotted(node.targets[0] if isinstance(node, ast.Assign) else node.target)
        if isinstance(parents_of(tree).get(node), ast.ClassDef):
            name = "self." + name
        elif name not in read and stored[name] == 1 and "..." not in name:
            unread.append((node, name))
        given.setdefault(name, []).append(node.value)
    for node, name in unread[:USES_LIMIT]:
        near = [other for other in given if other in read and is_alike(name, other)]
        values = [node.value, *given[near[0]]] if len(near) == 1 else []
        kinds = {kind_of_constant(one) for one in values}
        is_same = isinstance(node, ast.AugAssign) or (len(kinds) == 1 and None not in kinds)
        used = map(dotted, ast.walk(node.value)) if isinstance(node.value, ast.BinOp) else ()
        if values and (is_same or near[0] in used) and not stands_beside(node, near[0], tree):
            found[node] = (name, near[0])
    return found


def stands_beside(node, name, tree):
    """Return whether that name gets its value in the same run of assignments: then both are meant."""
    around = parents_of(tree).get(node)
    block = next((b for b in (statements_of(around, part) for part in BLOCKS) if node in b), [node])
    at = block.index(node)
    for part in (reversed(block[:at]), block[at + 1 :]):
        for one in itertools.takewhile(lambda s: isinstance(s, ast.Assign), part):
            if name in map(dotted, one.targets):
                return True
    return False


BLOCKS = ("body", "orelse", "finalbody")


def kind_of_constant(node):
    """Return the type of a text, a number, -1 too, True, False or None; None for what has to be worked out."""
    is_less = isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub)
    node = node.operand if is_less else node
    return type(node.value) if isinstance(node, ast.Constant) else None


def is_alike(name, other):
    """Return whether two names of one object, or of none, differ by capitals, or by a letter that is no plural."""
    (owner, _, last), (other_owner, _, other_last) = name.rpartition("."), other.rpartition(".")
    is_other = is_of_series(last, other_last) or last[-1:].isdigit() or last.isupper() or last == other_last
    if owner != other_owner or is_other or last + "s" == other_last or other_last + "s" == last:
        return False
    return last.lower() == other_last.lower() or (
        min(len(last), len(other_last)) > 3 and is_one_edit(last, other_last)
    )


def is_one_edit(one, other):
    """Return whether one letter added, left out, changed or swapped with its neighbour makes one the other."""
    least = min(len(one), len(other))
    at = next((i for i in range(least) if one[i] != other[i]), least)
    one, other = one[at:], other[at:]
    swapped = one[:2] == other[1::-1] and one[2:] == other[2:]
    return swapped or one[1:] == other[1:] or one[1:] == other or one == other[1:]


def never_given(tree, misspelt):
    """`global goal` in a callback that does nothing with it, and `self.goal = None` with `if self.goal is None:
    return`, where no line gives it another value, under a `misspelt` name either."""
    fixed = {name: value for name, value in fixed_values(tree).items() if name not in misspelt}
    read = {dotted(n) for n in all_of(tree, ast.Name) if isinstance(n.ctx, ast.Load)}
    for function in all_of(tree, ast.FunctionDef):
        inside = [n for n in walk_own(function) if isinstance(n, ast.Name)]
        used, stored = {n.id for n in inside}, {n.id for n in inside if isinstance(n.ctx, ast.Store)}
        unread = [one.arg for one in function.args.args if one.arg not in {"self", *used}]
        for node in (n for n in function.body if isinstance(n, ast.Global)):
            names = [n for n in node.names if n in read & fixed.keys() - used and not n.isupper()]
            for name in names if unread or stored.intersection(node.names) else ():
                message = "`%s` has `global %s`, and never gives it a value" % (function.name, name)
                fix = "below line %d, write `%s = %s`" % (node.lineno, name, (*unread, "…")[0])
                yield slip(node.lineno, "wrong-value", message, fix, "ungiven" if unread else "")
    acting = {"publish", *(n.name for n in all_of(tree, ast.FunctionDef) if calls_in(n, "publish"))}
    for node in all_of(tree, ast.If)[:USES_LIMIT]:
        leaves = isinstance(node.body[0], (ast.Return, ast.Continue))
        for name in sorted(n for n in names_in(node.test) if n.startswith("self.")):
            value = fixed.get(name[len("self.") :])
            acts = any(calls_in(one, *acting) for one in node.body)
            if value in ("None", "False") and truth(node.test, name, value) is leaves and (leaves or acts):
                message = "`%s` is %s all the time: no line gives it another value" % (name, value)
                fix = "give `%s` its value in the callback that has to" % name
                yield slip(node.lineno, "wrong-value", message, fix, "ungiven")


def fixed_values(tree):
    """Return the names and attributes that are given one value only, written as a constant, with that."""
    given = {}
    for node in all_of(tree, ast.Assign):
        for target in node.targets if isinstance(node.value, ast.Constant) else ():
            given.setdefault(dotted(target).rpartition(".")[2], []).append(repr(node.value.value))
    every = all_of(tree, ast.Name, ast.Attribute)
    stored = Counter(dotted(n).rpartition(".")[2] for n in every if isinstance(n.ctx, ast.Store))
    return {
        name: values[0]
        for name, values in given.items()
        if stored[name] == len(values) and len(set(values)) == 1
    }


def truth(test, name, value):
    """Return whether a condition is true where a name is None or False; None where that is not sure."""
    if isinstance(test, ast.UnaryOp) and isinstance(test.op, ast.Not):
        inner = truth(test.operand, name, value)
        return None if inner is None else not inner
    if isinstance(test, ast.BoolOp):
        decides = isinstance(test.op, ast.Or)
        return decides if decides in [truth(one, name, value) for one in test.values] else None
    if isinstance(test, ast.Compare) and dotted(test.left) == name:
        is_same = repr(getattr(test.comparators[0], "value", "")) == value
        kind = type(test.ops[0])
        return (
            kind in (ast.Is, ast.Eq) if is_same and kind in (ast.Is, ast.Eq, ast.IsNot, ast.NotEq) else None
        )
    return False if dotted(test) == name else None


def unreturned_answers(tree):
    """A function that makes an answer, sets its fields, and has no `return` with a value."""
    for own in all_of(tree, ast.FunctionDef):
        inside = list(walk_own(own))
        made = [n for n in inside if isinstance(n, ast.Assign) and called_name(n.value).endswith("Response")]
        returns = [n for n in inside if isinstance(n, (ast.Return, ast.Yield)) and n.value is not None]
        name = dotted(made[0].targets[0]) if len(made) == 1 else "..."
        stored = [n for n in inside if isinstance(n, ast.Attribute) and isinstance(n.ctx, ast.Store)]
        if returns or not isinstance(made[0].targets[0] if made else None, ast.Name) or name == "...":
            continue
        if any(dotted(n.value) == name for n in stored):
            last = own.body[-1].end_lineno
            message = "`%s` is made and filled in, and not returned" % name
            fix = "below line %d, write `return %s` at the end of `%s`" % (last, name, own.name)
            yield slip(made[0].lineno, "wrong-value", message, fix, "return")


def swallowed_exceptions(tree):
    """An `__exit__` that returns True whatever has happened: no exception leaves its `with`."""
    for own in (n for n in all_of(tree, ast.FunctionDef) if n.name == "__exit__"):
        last = own.body[-1]
        if isinstance(last, ast.Return) and getattr(last.value, "value", None) is True:
            message = "`__exit__` returns True, so that an exception that is raised in its `with` is dropped"
            fix = "on line %d, write `return False`: then it goes on to where it is expected" % last.lineno
            yield slip(last.lineno, "wrong-value", message, fix, "swallowed")


HELD_UP = {"sleep", "spin", "is_shutdown"}


def dropped_errors(tree):
    """An `except` of every error, around what calls something, that says nothing of the error and goes on."""
    stays = calls_in(tree, "spin") or all_of(tree, ast.While)
    own = {"init_node", "spin", *functions_in(tree)}
    for one in all_of(tree, ast.Try):
        calls = {called_name(n) for part in one.body for n in ast.walk(part) if isinstance(n, ast.Call)}
        for handler in one.handlers:
            if calls - HELD_UP and dotted(handler.type).rpartition(".")[2] in BROAD and says_nothing(handler):
                message = "line %d drops every error, and says nothing of it" % handler.lineno
                fix = "on line %d, write `except rospy.ROSInterruptException:`" % handler.lineno
                # what does not stay alive in any case ends without an error, too
                runs = stays and (calls & own or any(isinstance(n, ast.While) for n in one.body))
                yield slip(handler.lineno, "swallows", message, fix, "run" if runs else "")


def says_nothing(handler):
    """Whether an `except` does nothing but to print a text that is always the same."""
    done = [n for n in handler.body if not isinstance(n, (ast.Pass, ast.Continue))]
    told = [n.value for n in done if isinstance(n, ast.Expr)]
    plain = [n for n in told if isinstance(n, ast.Constant) or tells_nothing(n)]
    return len(plain) == len(done)


def tells_nothing(node):
    is_print = called_name(node) == "print" or called_name(node).startswith("log")
    return is_print and all(isinstance(one, ast.Constant) for one in node.args)
