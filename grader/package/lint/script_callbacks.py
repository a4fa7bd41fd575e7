"""Finds what is wrong with the functions that ROS calls in a student's Python, for `slips.py`: how ROS is given them,
and what they do to the node.

Nothing is executed. Python 3.8, standard library only.
"""

import ast
import builtins
import itertools

from script_loops import CALLED_BACK, ENDING, is_endless, is_short
from script_names import (
    given_names,
)
from script_tree import (
    LOOPS,
    all_of,
    argument,
    called_name,
    calls_in,
    dotted,
    functions_in,
    gives_function,
    is_call,
    listed,
    parents_of,
    slip,
    text_of,
    walk,
)

BELOW_LIMIT = 50
"""So many statements or conditions of a block are looked at."""
CALLBACKS = {
    "Subscriber": ("callback", 2, 1),
    "Timer": ("callback", 1, 1),
    "Service": ("handler", 2, 1),
    "SimpleActionServer": ("execute_cb", 2, 1),
    "on_shutdown": ("h", 0, 0),
    "signal": ("handler", 1, 2),
}
"""What takes a function: the argument's name, its place, and with how many values ROS calls it."""
VALUES = {"Service": "request", "SimpleActionServer": "goal", "Timer": "event"}
"""What ROS passes to the function, where that is no message."""
OTHER_VALUES = {"on_shutdown": "nothing", "signal": "the signal's number and a frame"}


def answers_in_some_cases(tree):
    """A service's callback that returns an answer where an `if` or its `elif` holds, and nothing where none does."""
    functions = functions_in(tree)
    services = (n for n in all_of(tree, ast.Call) if called_name(n) == "Service")
    given = (argument(n, 2, "handler") for n in services)
    for name in {dotted(one[0]).rpartition(".")[2] for one in given if one}:
        last = functions[name].body[-1] if name in functions else None
        ends, answer = [last], ""
        while isinstance(ends[-1], ast.If):
            answer = called_name(getattr(ends[-1].body[-1], "value", None)) or answer
            ends.append(ends[-1].orelse[-1] if ends[-1].orelse else None)
        tests = [n.test for n in functions[name].body if isinstance(n, ast.If)] if answer else []
        tests += [n.test for n in ends[1:-1]]
        if (
            ends[-1] is None
            and answer.endswith("Response")
            and not is_the_rest(tests[-1], tests[-BELOW_LIMIT:-1])
        ):
            message = "`%s` returns nothing where no condition of its last `if` holds" % name
            fix = "below line %d, and as far in as line %d, write `return %s(…)`"
            fix %= (last.end_lineno, last.lineno, answer)
            yield slip(last.lineno, "wrong-value", message, fix, "return")


def excludes(test, other):
    """Whether one condition cannot hold where the other does: `a` and `not a`, `n < 3` and `n >= 3`, `s == 1` and
    `s == 2`."""
    if isinstance(test, ast.UnaryOp) != isinstance(other, ast.UnaryOp):
        return ast.dump(getattr(test, "operand", test)) == ast.dump(getattr(other, "operand", other))
    if not all(isinstance(one, ast.Compare) for one in (test, other)) or ast.dump(test.left) != ast.dump(
        other.left
    ):
        return False
    signs = {type(one.ops[0]) for one in (test, other)}
    return len(signs) > 1 or signs == {ast.Eq}


def is_the_rest(test, others):
    """Whether a condition may hold wherever the others do not: `n >= 3` behind `n < 3`, `a == False` behind
    `a == True`."""
    near = [one for one in others if excludes(test, one)]
    asked = ast.dump(test.comparators[0]) if isinstance(test, ast.Compare) else ""
    return any(
        not asked or isinstance(one, ast.UnaryOp) or asked == ast.dump(one.comparators[0]) for one in near
    ) or (bool(asked) and type(getattr(test.comparators[0], "value", 0)) is bool)


def callbacks(tree):
    """Functions that ROS calls with another number of values than they take, and those that are called where the
    function itself is meant.
    """
    yield from ending_callbacks(tree)
    yield from answers_in_some_cases(tree)
    functions = functions_in(tree)
    yield from spare_callbacks(tree, functions)
    yield from own_callbacks(tree, functions)
    froms = [n for n in all_of(tree, ast.ImportFrom) if n.module not in ("rospy", "actionlib", "signal")]
    of_others = {a.asname or a.name for n in froms for a in n.names} | {"threading.Timer"}
    of_others |= {n.name for n in all_of(tree, ast.ClassDef)}
    plain = {name: f for name, f in functions.items() if not isinstance(parents_of(tree)[f], ast.ClassDef)}
    for node in walk(tree):
        name = called_name(node)
        if name not in CALLBACKS or dotted(node.func) in of_others:
            continue
        keyword, place, values = CALLBACKS[name]
        given = argument(node, place, keyword)
        lacks_one = not given and len(node.args) == place and all(k.arg for k in node.keywords)
        lacks_one = lacks_one and not any(isinstance(one, ast.Starred) for one in node.args)
        if lacks_one and dotted(node.func) == "rospy.Subscriber":
            fix = "write the function's name as its third value"
            yield slip(node.lineno, "callback-missing", "`Subscriber(…)` gets no callback", fix)
        handed = argument(node, place + 1, "callback_args") if name == "Subscriber" else []
        values += any(getattr(one, "value", "") is not None for one in handed)
        for one in given[:1]:
            text = text_of(one)
            if text.isidentifier():
                message, fix = "'%s' is a string, not a function" % text, "write `%s`, without quotes" % text
                yield slip(one.lineno, "callback-called", message, fix, text)
            called = isinstance(one, ast.Call)
            meant = one.func if called else one
            own = (plain if isinstance(meant, ast.Name) else functions).get(dotted(meant).rpartition(".")[2])
            least, most = takes(own, isinstance(meant, ast.Attribute)) if own else (values, values)
            yield from filled_in_part(one, functions, values)
            yield from called_at_once(one, name)
            if own and called and (least or not gives_value(own)) and not gives_function(own):
                message, fix = "`%s()` is called here", "write `%s`, without brackets"
                at = called_inside(own) or one
                name = dotted(at.func)
                yield slip(at.lineno, "callback-called", message % name, fix % name, name)
            elif own and not called and not least <= values <= most:
                what = OTHER_VALUES.get(name, "the %s" % VALUES.get(name, "message"))
                what += " and its `callback_args`" if name == "Subscriber" and values > 1 else ""
                message, fix = wrong_callback(own, node, tree, isinstance(meant, ast.Attribute), values)
                number = number_taken(own, isinstance(meant, ast.Attribute))
                message = message or "`%s` takes %s, but ROS passes it %s" % (own.name, number, what)
                yield slip(own.lineno, "callback-values", message, fix, own.name)


def number_taken(own, bound):
    """Return how many values a function takes, in words; `bound` if it is an object's."""
    least, _ = takes(own, bound)
    if bound and not least and own.args.args:
        return "only `self`"
    return "1 argument" if least == 1 else "%d arguments" % least


SETS_UP = ("init_node", "Publisher", "Subscriber", "spin")


def own_callbacks(tree, functions):
    """Calls, without a message, of a function that sets the node up and is the callback of its own Subscriber."""
    bare = [n for n in all_of(tree, ast.Call) if not n.args and not n.keywords]
    calls = {called_name(n): n.lineno for n in reversed(bare)}
    for name, own in functions.items():
        if name not in calls or takes(own, False) != (1, 1):
            continue
        given = [one for call in calls_in(own, "Subscriber") for one in argument(call, 2, "callback")]
        if name not in map(dotted, given):
            continue
        where = listed(sorted({one.lineno for one in calls_in(own, *SETS_UP)}))
        message = "`%s` sets the node up, and is also the callback, which ROS gives each message" % name
        fix = "move %s out of `%s`, to where line %d is, in its place" % (where, name, calls[name])
        fix += "" if calls_in(tree, "spin") else ", with `rospy.spin()` below"
        if all(isinstance(one, (ast.Expr, ast.Assign)) and calls_in(one, *SETS_UP) for one in own.body):
            fix += "; in `%s`, write what to do with each message" % name
        yield slip(calls[name], "callback-called", message, fix, name)


def spare_callbacks(tree, functions):
    """The only function that reads a message and that nothing names, for which a Subscriber is missing; or two of
    different types are given one function."""
    read = {getattr(n, "attr", getattr(n, "id", "")) for n in walk(tree)}
    data = {dotted(n.value) for n in all_of(tree, ast.Attribute) if n.attr == "data"}
    spare = [f for name, f in functions.items() if name not in read and takes(f, "self" in read) == (1, 1)]
    spare = [
        f for f in spare if [a for a in f.args.args[-1:] if a.arg in data] and not f.name.startswith("__")
    ]
    if len(spare) != 1:
        return
    name = ("self." if len(spare[0].args.args) > 1 else "") + spare[0].name
    calls = calls_in(tree, "Subscriber")
    given = [ast.dump(one.args[2]) for one in calls if len(one.args) > 2]
    kinds = {dotted(one.args[1]) for one in calls if len(one.args) > 2}
    if len(calls) == len(given) == len(kinds) == 2 and len(set(given)) == 1:
        lines, one = sorted(one.lineno for one in calls), dotted(calls[0].args[2])
        message = "%s give both Subscribers `%s`, and nothing calls `%s`" % (listed(lines), one, name)
        fix = "write `%s` in place of `%s` on the line of the topic that it is for" % (name, one)
        yield slip(spare[0].lineno, "defined-twice", message, fix, name)
    elif {"object"}.issuperset(map(dotted, getattr(parents_of(tree)[spare[0]], "bases", ()))):
        inits = calls_in(tree, "init_node")
        module = dotted(inits[0].func)[: -len("init_node")] if inits else "rospy."
        where = "below line %d" % inits[0].lineno if inits else "below `init_node(…)`"
        fix = "%s, write `%sSubscriber(…, %s)`" % ("in `__init__`" if "." in name else where, module, name)
        yield slip(spare[0].lineno, "callback-missing", "no Subscriber is given `%s`" % name, fix, name)


def wrong_callback(own, call, tree, bound, values):
    """Return why a function does not fit as a callback, "" where only its arguments do not, and what to write."""
    given = [one.arg for one in own.args.args]
    if any(inner is call for inner in ast.walk(own)):
        others = [f for f in functions_in(tree).values() if f is not own and takes(f, bound)[0] == values]
        message = "`%s` is the function that makes this call, not its callback" % own.name
        meant = others[0].name if len(others) == 1 else "the name of the function that prints the message"
        return message, "on line %d, write %s instead of %s" % (call.lineno, meant, own.name)
    if bound and len(given) == values and "self" not in given:
        message = "`%s` is a method, so its first parameter has to be `self`" % own.name
        return message, "write `def %s(%s):`" % (own.name, ", ".join(["self", *given]))
    if with_args := fix_of_args(own, call, tree, bound):
        return "", with_args
    kept = [name for name in given if not bound or name != "self"]
    parts = [dotted(n.value) for n in ast.walk(own) if isinstance(n, ast.Attribute)]
    # of values that have none of their own, each may be a field of the request
    plain = len(kept) > 1 and not own.args.defaults and not set(kept) & set(parts)
    if called_name(call) == "Service" and plain:
        told = ", ".join(["self"] * bound + ["request"])
        fields = ", ".join("request." + name for name in kept)
        return "", "write `def %s(%s):`, and below it, `%s = %s`" % (own.name, told, ", ".join(kept), fields)
    spare = [unknown_name(own, tree) or VALUES.get(called_name(call), "msg"), "args"]
    kept = ["self"] * bound + (kept + spare[len(kept) :])[:values]
    return "", "write `def %s(%s):`%s" % (own.name, ", ".join(kept), made_response(own, call, kept))


def fix_of_args(own, call, tree, bound):
    """Return what to write where a Subscriber leaves out the `callback_args` that another one of the same callback has;
    "" where it does not."""
    for other in calls_in(tree, "Subscriber") if called_name(call) == "Subscriber" else ():
        given = argument(other, 3, "callback_args")
        names = [dotted(one) for each in (call, other) for one in argument(each, 2, "callback")]
        if not given or len(set(names)) > 1 or takes(own, bound) != (2, 2):
            continue
        own_topic = text_of(call.args[0]) if call.args and text_of(given[0]) == text_of(other.args[0]) else ""
        what = "`callback_args=%r`" % own_topic if own_topic else "`callback_args`, with a value of its own,"
        fix = "on line %d, write %s as the last argument of `Subscriber(…)`, as on line %d"
        return fix % (call.lineno, what, other.lineno)
    return ""


def unknown_name(own, tree):
    """Return the one name that a callback without an argument reads a part of, or uses as a value, and that nothing
    in the script has; "" where there is not one."""
    if not hasattr(tree, "all_given"):
        tree.all_given = given_names(tree, all_of(tree, ast.Name)) | set(dir(builtins))
    called = {n.func for n in ast.walk(own) if isinstance(n, ast.Call)}
    called |= {n.value for n in called if isinstance(n, ast.Attribute)}
    used = {n.id for n in ast.walk(own) if isinstance(n, ast.Name) and n not in called}
    unknown = used - tree.all_given
    return "".join(unknown) if len(unknown) == 1 else ""


def made_response(own, call, kept):
    """Return where to make the response that a service's function takes as its last argument, as in ROS 2."""
    lost = [one.arg for one in own.args.args if one.arg not in kept]
    used = {n.id for one in own.body for n in ast.walk(one) if isinstance(n, ast.Name)}
    if called_name(call) != "Service" or len(lost) != 1 or lost[0] not in used or len(call.args) < 2:
        return ""
    return ", and `%s = %sResponse()` as its first line" % (lost[0], dotted(call.args[1]))


def called_at_once(node, taker):
    """Yield where `on_shutdown(stop.set())` calls the method of an object that it should be given."""
    is_bare = isinstance(node, ast.Call) and not node.args and not node.keywords
    if (
        taker == "on_shutdown"
        and is_bare
        and is_call(node, "set", "stop", "shutdown", "unregister", "close", "cancel")
    ):
        name = dotted(node.func)
        yield slip(
            node.lineno,
            "callback-called",
            "`%s()` is called here" % name,
            "write `%s`, without brackets" % name,
            name,
        )


def filled_in_part(node, functions, values):
    """Yield where `partial(f, …)` leaves a callback more or fewer values to take than ROS passes it."""
    if called_name(node) != "partial" or not node.args or node.keywords:
        return
    own = functions.get(dotted(node.args[0]).rpartition(".")[2])
    if own is None or any(isinstance(n, ast.Starred) for n in node.args):
        return
    bound = isinstance(node.args[0], ast.Attribute)
    (least, most), count = takes(own, bound), len(node.args) - 1
    if not least <= count + values <= most:
        taken = [one.arg for one in own.args.args][bound:]
        message = "`%s` takes %d values, and gets %d: %d of `partial(…)`, and what ROS passes"
        message %= (own.name, least, count + values, count)
        fix = "write `%s(%s)`" % (
            dotted(node.func),
            ", ".join([dotted(node.args[0]), *taken[: max(0, least - values)]]),
        )
        fix += ", with your values in place of these names" if least > values else ""
        yield slip(node.lineno, "callback-values", message, fix, own.name)


def called_inside(function):
    """Return the call of its own inner function whose answer a function returns, where that inner one takes a value:
    it is to be returned itself."""
    inner = {n.name: n for n in function.body if isinstance(n, ast.FunctionDef)}
    for n in function.body:
        call = n.value if isinstance(n, ast.Return) else None
        own = inner.get(getattr(getattr(call, "func", None), "id", None))
        if own is not None and not call.args and not call.keywords and takes(own, False)[0]:
            return call
    return None


def gives_value(function):
    return any(isinstance(n, (ast.Return, ast.Yield)) and n.value is not None for n in ast.walk(function))


def takes(function, bound):
    """Return with how many values a function can be called at least and at most; of a method without `self`."""
    given = function.args.posonlyargs + function.args.args
    of_class = any(getattr(d, "id", "") == "staticmethod" for d in function.decorator_list)
    own = 1 if bound and not of_class else 0
    least = len(given) - len(function.args.defaults) - own
    return least, 99 if function.args.vararg else len(given) - own


def ending_callbacks(tree):
    """Callbacks that end the node: those of topics at the first message, and others under some condition."""
    functions, found = functions_in(tree), {}
    for node in walk(tree):
        keyword, place, _ = CALLBACKS.get(called_name(node), ("", 0, 0))
        # what ROS or Python calls at the end does not end the node
        given = argument(node, place, keyword) if keyword in ("callback", "handler", "execute_cb") else []
        given = [] if called_name(node) == "signal" else given
        own = functions.get(dotted(given[0]).rpartition(".")[2]) if given else None
        if own is not None:  # one callback may be given many times
            found[own, called_name(node) == "Subscriber"] = True
    for own, hears in found:
        for one in calls_in(own, *ENDING):
            message, line = "the callback `%s` ends the node on line %d" % (own.name, one.lineno), one.lineno
            at_once = any(isinstance(n, ast.Expr) and n.value is one for n in own.body)
            if at_once and hears:
                yield slip(line, "loop-left", message + ", at the first message", "delete line %d" % line)
            else:
                fix = "leave out line %d, or end the node only where the lab asks for it" % line
                yield slip(line, "ends-node", message, fix)


SLEEPS_SHOWN = 5


def waiting_callbacks(tree):
    """Callbacks of topics and services that do not come to their end, or late: nothing further is read before."""
    functions, known = functions_in(tree), {}
    slow = slow_functions(functions)
    for node in walk(tree):
        kind = called_name(node)
        given = argument(node, 2, CALLED_BACK[kind]) if kind in CALLED_BACK else []
        own = functions.get(dotted(given[0]).rpartition(".")[2]) if given else None
        if own is not None and own not in known:
            inside = list(ast.walk(own))
            known[own] = set(inside), list(itertools.islice(waits_in(own, inside, slow), 1))
        if own is not None and node not in known[own][0]:
            yield from known[own][1]


def waits_in(callback, inside, slow):
    """Yield what keeps a callback from its end; `inside` is all that is in it, `slow` the functions that take long."""
    for one in inside:
        line, message, fix = getattr(one, "lineno", 0), "", ""
        if isinstance(one, ast.While) and is_endless(one, callback):
            message = "the loop in the callback `%s`, line %d, never ends" % (callback.name, line)
            fix = "take the loop out of it"
        elif is_call(one, "spin"):
            message = "the callback `%s` calls spin() on line %d" % (callback.name, line)
            fix = "move line %d out of it" % line
        elif isinstance(one, LOOPS) and any(map(is_long_sleep, ast.walk(one))):
            message = "the loop in the callback `%s`, line %d, sleeps in each turn" % (callback.name, line)
            fix = "keep in it only what came, and go through the loop of line %d in the main program" % line
        elif called_name(one) in slow and called_name(one) != callback.name:
            message = "the callback `%s` calls `%s` on line %d, which goes around a loop that sleeps"
            message %= (callback.name, called_name(one), line)
            fix = "keep in it only that it was called, and call `%s` in the main program" % called_name(one)
        elif is_long_sleep(one):
            again = sorted({n.lineno for n in inside if is_long_sleep(n)} - {line})[:SLEEPS_SHOWN]
            message = "the callback `%s` sleeps on line %d" % (callback.name, line)
            message += " and again on %s" % listed(again) if again else ""
            fix = "delete %s" % listed([line, *again])
        if message:
            yield slip(line, "callback-waits", message, fix, callback.name)


def is_long_sleep(node):
    return called_name(node) == "sleep" and not is_short(node)


def slow_functions(functions):
    """Return the names of the functions in which a loop sleeps, and of those that call them."""
    inside = {name: list(ast.walk(one)) for name, one in functions.items()}
    loops = {name: [n for n in inside[name] if isinstance(n, LOOPS)][:BELOW_LIMIT] for name in inside}
    slow = {name for name in loops if any(is_long_sleep(n) for one in loops[name] for n in ast.walk(one))}
    return slow | {name for name in inside if slow & {called_name(n) for n in inside[name]}}


def closed_before(tree):
    """`with open(…) as file: …` with the `rospy.spin()` below it: callbacks come when the file is closed."""
    for around in all_of(tree, ast.Module, ast.If, ast.FunctionDef, ast.Try):
        opened = [at for at, one in enumerate(around.body) if isinstance(one, ast.With)][:1]
        for at in opened:
            one = around.body[at]
            spins = [n for later in around.body[at + 1 :] for n in calls_in(later, "spin", "is_shutdown")]
            if spins and not calls_in(one, "spin", "is_shutdown"):
                message = "the `with` of line %d ends before line %d, and closes what it has opened"
                fix = "indent line %d like line %d, so that it is within the `with`"
                lines = (spins[0].lineno, one.body[0].lineno)
                yield slip(one.lineno, "wrong-value", message % (one.lineno, lines[0]), fix % lines, "closed")
