"""Finds loops in a student's Python that publish and sleep nowhere, or do either twice in each of their turns, for
`slips.py`.

Nothing is executed. Python 3.8, standard library only.
"""

import ast

from script_loops import WAITS, called_own, turns
from script_names import set_in
from script_tree import (
    LOOPS,
    all_of,
    called_name,
    calls_in,
    dotted,
    functions_in,
    is_call,
    listed,
    loop_around,
    names_in,
    slip,
)
from script_unsent import replaced_names

PAUSES = ("rospy.sleep", "time.sleep")


def sleepless_loops(tree):
    """Loops that publish and wait nowhere, where `rate.sleep()` stands outside of them or a Rate is made in them."""
    loops, around = all_of(tree, *LOOPS), dict(turns(tree))
    every = [(n, loop_around(n, tree)) for n in calls_in(tree, "sleep")]
    waiting = {name for name, one in functions_in(tree).items() if calls_in(one, *WAITS)}
    for loop in loops:
        if waiting.intersection(called_name(n) for n in ast.walk(loop)) or is_of_publishers(loop):
            continue
        within = [n for n in ast.walk(loop) if isinstance(n, LOOPS) and calls_in(n, "publish")]
        # a `sleep()` of another function or loop belongs to that one
        function, outer = around[loop][0], loop_around(loop, tree)
        sleeps = [n for n, own in every if own is outer and around[n][0] in (function, None)]
        plain = [n for n in sleeps if dotted(n.func) not in PAUSES]
        below = [n for n in sleeps if n.lineno > loop.lineno and (n in plain or around[n][0])]
        outside = below or [n for n in plain if n.lineno < loop.lineno]
        yield from sleeps_in_if(loop)
        if calls_in(loop, *WAITS) or within != [loop]:
            continue
        if not outside:
            yield from rates_in_loop(loop)
            yield from rates_unused(loop, function, tree)
            continue
        name = dotted(outside[0].func) or "sleep"
        message = "`%s()` is outside the loop on line %d" % (name, loop.lineno)
        last = loop.body[-1]
        fix = "move it into that loop, below line %d, with the same spaces or tabs before it as line %d has"
        fix %= (last.end_lineno, last.lineno)
        yield slip(outside[0].lineno, "sleep-outside", message, fix, name)


def is_of_publishers(loop):
    """Whether each turn publishes by another publisher, as in `for pub in pubs:`: such a loop need not wait."""
    given = names_in(loop.target) if isinstance(loop, ast.For) else set()
    return bool(given) and all(given & names_in(n.func) for n in calls_in(loop, "publish"))


def rates_in_loop(loop):
    """Yield the Rate that a loop makes in each of its turns, and nothing sleeps by."""
    made = [n for n in loop.body if isinstance(n, ast.Assign) and is_call(n.value, "Rate")]
    named = any(isinstance(n, ast.Attribute) and n.attr == "sleep" for n in ast.walk(loop))
    name = dotted(made[0].targets[0]) if len(made) == 1 and len(loop.body) > 1 and not named else ""
    own = names_in(made[0].value) & set_in(loop) if made else ()
    skipped = any(isinstance(n, ast.Continue) for n in ast.walk(loop))
    if name and not own and not skipped and not isinstance(made[0].targets[0], ast.Subscript):
        message = "a Rate is made in each turn of the loop on line %d, and nothing sleeps" % loop.lineno
        fix = "move line %d above that loop, and write `%s.sleep()` as the last line in the loop"
        fix %= (made[0].lineno, name)
        yield slip(made[0].lineno, "sleep-outside", message, fix, name + ".sleep")


def rates_unused(loop, function, tree):
    """Yield the loop of a script that makes one Rate, above it, and sleeps nowhere."""
    rates = [n for n in all_of(tree, ast.Assign) if is_call(n.value, "Rate")]
    named = any(isinstance(n, ast.Attribute) and n.attr == "sleep" for n in ast.walk(tree))
    named = named or any(".sleep(" in str(n.value) for n in all_of(tree, ast.Constant))  # in quotes
    skipped = any(isinstance(n, ast.Continue) for n in ast.walk(loop))
    if len(rates) != 1 or named or skipped or not isinstance(loop, ast.While) or calls_in(tree, *WAITS):
        return
    name, line = dotted(rates[0].targets[0]), loop.body[-1].end_lineno
    known = rates[0] in tree.body or rates[0] in ast.walk(function or tree) or name.startswith("self.")
    if name and known and rates[0].lineno < loop.lineno:
        fix = "below line %d, write `%s.sleep()`, with the same spaces or tabs before it as line %d has"
        fix %= (line, name, loop.body[-1].lineno)
        message = "nothing sleeps by the Rate of line %d" % rates[0].lineno
        yield slip(loop.lineno, "sleep-outside", message, fix, name + ".sleep")


def sleeps_in_if(loop):
    """Yield the only `sleep()` of a loop that publishes in each of its turns, where it stands in an `if`; or in one
    that goes on with the next turn, before the others publish."""
    plain = [one for one in loop.body if isinstance(one, ast.Expr) and is_call(one.value, "publish")]
    sleeps = [n for one in loop.body for n in calls_in(one, *WAITS)]
    for one in loop.body:
        within = one.body if isinstance(one, ast.If) and not one.orelse else []
        own = [n for n in within[:-1] if isinstance(n, ast.Expr) and is_call(n.value, "sleep")]
        if plain and len(sleeps) == len(own) == 1 and isinstance(within[-1], ast.Continue):
            name, last = dotted(own[0].value.func), loop.body[-1]
            message = "`%s()` is called only where the `if` on line %d holds" % (name, one.lineno)
            fix = "below line %d, write `%s()` too" % (last.end_lineno, name)
            yield slip(own[0].lineno, "sleep-outside", message, fix, name)
        own = [n for n in within if isinstance(n, ast.Expr) and is_call(n.value, "sleep")]
        if plain and len(sleeps) == len(own) == 1 and own[0] is within[-1]:
            name, line = dotted(own[0].value.func), own[0].lineno
            message = "`%s()` is inside the `if` on line %d" % (name, one.lineno)
            fix = "write line %d with the same spaces or tabs before it as line %d has" % (line, one.lineno)
            yield slip(line, "sleep-outside", message, fix, name)


def sleeps_twice(tree):
    """Loops that wait twice or more in each of their turns, once maybe in a function that they call, and publish once
    on each topic."""
    functions = functions_in(tree)
    for loop in all_of(tree, *LOOPS):
        body = loop.body
        called = {n: called_own(getattr(n, "value", None), functions) for n in body}
        helpers = [one for one in called.values() if one is not None]
        if len(set(helpers)) < len(helpers):
            continue
        body = [one for n in body for one in (called[n].body if called[n] else [n])]
        at = [i for i, n in enumerate(body) if isinstance(n, ast.Expr) and called_name(n.value) == "sleep"]
        own = [body[i].lineno for i in at if body[i] in called or len(loop.body) == 1]
        surplus = own if len(own) < len(at) else own[1:]
        if len(at) < 2 or len(at) - len(surplus) != 1:
            continue
        parts = [body[at[i] + 1 : at[i + 1]] for i in range(len(at) - 1)]
        parts.append(body[at[-1] + 1 :] + body[: at[0]])
        sent = [{ast.dump(n.func) for one in part for n in calls_in(one, "publish")} for part in parts]
        if any(sent) and sum(map(len, sent)) == len(set().union(*sent)):
            lines = sorted(body[i].lineno for i in at)
            message = "the loop sleeps on line %d and again on %s" % (lines[0], listed(lines[1:]))
            yield slip(surplus[-1], "sleep-twice", message, "delete %s" % listed(surplus))


def publishes_twice(tree):
    """Loops that publish on one topic more than once in each of their turns, and sleep once at most."""
    several = {name for name, *_ in replaced_names(tree)}  # each was to be another topic's
    for loop in all_of(tree, *LOOPS):
        by_publisher = {}
        for one in loop.body:
            sent = isinstance(one, ast.Expr) and called_name(one.value) == "publish"
            if sent and dotted(one.value.func).rpartition(".")[0] not in several:
                by_publisher.setdefault(ast.dump(one.value.func), []).append(one)
        many = next((same for same in by_publisher.values() if len(same) > 1), None)
        if many is None:
            yield from published_in_if_too(loop, by_publisher)
            continue
        first, last = (loop.body.index(one) for one in (many[0], many[-1]))
        if any(calls_in(n, *WAITS) for n in loop.body[first:last]):
            continue
        lines = [one.lineno for one in many]
        if ast.dump(many[0]) == ast.dump(many[1]) and loop.body[first + 1] is many[1]:
            message = "the loop publishes on line %d and the same again on line %d" % (lines[0], lines[1])
            fix = "delete line %d" % lines[1]
        else:
            message = "each pass through the loop publishes on " + listed(lines)
            fix = "delete all but one of " + listed(lines)
        yield slip(lines[1], "publish-twice", message, fix)


def published_in_if_too(loop, by_publisher):
    """Yield the one line in an `if` of a loop that publishes what the loop publishes in each turn anyway."""
    choices = [one for one in loop.body if isinstance(one, ast.If) and not calls_in(one, *WAITS)]
    again = [
        (one, n) for one in choices for n in calls_in(one, "publish") if ast.dump(n.func) in by_publisher
    ]
    leaves = any(isinstance(n, (ast.Continue, ast.Break, ast.Return)) for n in ast.walk(loop))
    if len(again) == 1 and not leaves:
        one, call = again[0]
        message = "line %d publishes once more, in the `if` on line %d" % (call.lineno, one.lineno)
        yield slip(call.lineno, "publish-twice", message, "delete line %d" % call.lineno)
