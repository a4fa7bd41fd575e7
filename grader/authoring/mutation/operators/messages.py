"""What a message says."""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterator

from pydantic import Field

from grader.authoring.mutation.python_script import Function, Script, every_second_time
from grader.authoring.mutation.registry import NoParams, operator
from grader.authoring.mutation.rospy_code import (
    INTEGER_TYPES,
    Counter,
    Endpoint,
    find_counter,
    message_name,
    publishers,
    sources,
    speech,
    subscribers,
)
from grader.authoring.mutation.solution import Site, Solution
from grader.authoring.mutation.text_edits import Edit, misspelt_literal, texts_in
from grader.model.record import Record

SECONDS = {"rospy.get_time()": "1700000000.0", "time.time()": "1700000000.0"}
TIMES = {"rospy.Time.now()": "rospy.Time(1700000000)", "rospy.get_rostime()": "rospy.Time(1700000000)"}
NANOSECONDS = "rospy.Time.now().to_nsec()"


def _fed(solution: Solution) -> Iterator[tuple[Script, Endpoint, list[ast.AST]]]:
    """Each publisher with everything that its messages are made of."""
    for script in solution.scripts:
        for publisher in publishers(script):
            nodes = {id(n): n for value in sources(script, publisher) for n in ast.walk(value)}
            yield script, publisher, list(nodes.values())


def _site(solution: Solution, script: Script, publisher: Endpoint, edits: list[Edit]) -> Iterator[Site]:
    if edits:
        at = {"script": script.path, "topic": publisher.topic}
        line = script.text.count("\n", 0, min(edits).start) + 1
        yield Site(at=at, tree=solution.edited(script.path, edits), line=line)


@operator("message-altered")
def message_altered(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Misspells the message.

    Fits every publisher whose messages are made from a text.
    """
    for script, publisher, _ in _fed(solution):
        for value in sources(script, publisher):
            texts = [t for t in texts_in(value) if misspelt_literal(script.source(t)) != script.source(t)]
            if texts:
                edit = script.replace(texts[0], misspelt_literal(script.source(texts[0])))
                yield from _site(solution, script, publisher, [edit])
                break


@operator("message-constant-time")
def message_constant_time(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Sends the same time again and again.

    Fits every publisher whose messages carry the time.
    """
    constants = SECONDS | TIMES
    for script, publisher, nodes in _fed(solution):
        edits = [
            script.replace(n, constants[s]) for n in _calls(nodes) if (s := script.source(n)) in constants
        ]
        yield from _site(solution, script, publisher, edits)


@operator("message-nanoseconds")
def message_nanoseconds(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Sends the time in nanoseconds, not in seconds.

    Fits every publisher whose messages carry the time in seconds.
    """
    for script, publisher, nodes in _fed(solution):
        found = [n for n in _calls(nodes) if script.source(n) in SECONDS or _seconds_of_time(script, n)]
        yield from _site(solution, script, publisher, [script.replace(n, NANOSECONDS) for n in found])


def _calls(nodes: list[ast.AST]) -> list[ast.Call]:
    return [n for n in nodes if isinstance(n, ast.Call)]


def _seconds_of_time(script: Script, call: ast.Call) -> bool:
    """`rospy.Time.now().to_sec()`."""
    head, _, tail = script.source(call).rpartition(".")
    return head in TIMES and tail == "to_sec()"


# [authoring.mutation.operators.counter] Counters that count otherwise.


class ByParams(Record):
    """`by`: how far from the right number."""

    by: int = Field(default=1, ge=1)


class EarlyParams(Record):
    """`by`: how many numbers too early."""

    by: int = Field(default=28, ge=2)


def _sites(solution: Solution, change: Callable[[Script, Counter], list[Edit]]) -> Iterator[Site]:
    for script in solution.scripts:
        for publisher in publishers(script):
            counter = find_counter(script, publisher)
            edits = change(script, counter) if counter is not None else []
            if edits:
                line = script.text.count("\n", 0, min(edits).start) + 1
                yield Site(
                    at={"script": script.path, "topic": publisher.topic},
                    tree=solution.edited(script.path, edits),
                    line=line,
                )


def _add(script: Script, constants: list[ast.Constant], number: int) -> list[Edit]:
    """Each of the constants once, changed by `number`."""
    distinct = {script.span(c): c for c in constants if isinstance(c.value, int)}
    return [script.replace(c, str(c.value + number)) for c in distinct.values() if isinstance(c.value, int)]


def _set(script: Script, constants: list[ast.Constant], number: int) -> list[Edit]:
    return [script.replace(c, str(number)) for c in {script.span(c): c for c in constants}.values()]


@operator("counter-from-one")
def counter_from_one(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Begins to count at 1.

    Fits every integer topic that is fed by a counter with a first value.
    """
    yield from _sites(solution, lambda script, counter: _set(script, counter.starts, 1))


@operator("counter-skips", params=ByParams)
def counter_skips(solution: Solution, params: ByParams) -> Iterator[Site]:
    """Counts in steps that are too large.

    Fits every integer topic that is fed by a counter.
    """
    yield from _sites(solution, lambda script, counter: _add(script, counter.steps, params.by))


@operator("reset-early", params=EarlyParams)
def reset_early(solution: Solution, params: EarlyParams) -> Iterator[Site]:
    """Goes back to the beginning too early.

    Fits every counter with a limit that is written as a number.
    """
    yield from _sites(solution, lambda script, counter: _add(script, counter.limits, -params.by))


@operator("reset-late", params=ByParams)
def reset_late(solution: Solution, params: ByParams) -> Iterator[Site]:
    """Goes back to the beginning too late.

    Fits every counter with a limit that is written as a number.
    """
    yield from _sites(solution, lambda script, counter: _add(script, counter.limits, params.by))


@operator("reset-to-one")
def reset_to_one(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Goes back to 1.

    Fits every counter that is set back, or taken modulo a number.
    """
    yield from _sites(solution, lambda script, counter: _back_to(script, counter, 1))


@operator("wrap-to-minus-128")
def wrap_to_minus_128(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Goes on at -128, as an 8-bit integer of C does.

    Fits every counter that is set back, or taken modulo a number.
    """
    yield from _sites(solution, lambda script, counter: _back_to(script, counter, -128))


def _back_to(script: Script, counter: Counter, number: int) -> list[Edit]:
    edits = _set(script, counter.resets, number)
    for modulo in counter.modulos:
        if isinstance(modulo.right, ast.Constant) and isinstance(modulo.right.value, int):
            limit, value = modulo.right.value, script.source(modulo.left)
            edits.append(script.replace(modulo, f"({value} if {value} < {limit} else {number})"))
    return edits


@operator("never-reset")
def never_reset(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Never goes back to the beginning.

    Fits every counter that is set back by an `if`, or taken modulo a number.
    """
    yield from _sites(solution, _without_reset)


def _without_reset(script: Script, counter: Counter) -> list[Edit]:
    edits = [script.replace(modulo, script.source(modulo.left)) for modulo in counter.modulos]
    for test in counter.tests:
        if isinstance(test, ast.If):
            edits += _without_if(script, test)
        else:
            counted = test.orelse if isinstance(test.body, ast.Constant) else test.body
            edits.append(script.replace(test, script.source(counted)))
    return edits


def _without_if(script: Script, test: ast.If) -> list[Edit]:
    """What is left where the branch that sets back is never taken."""
    if not script.has_lines(test):
        return []
    counts = [b for b in (test.body, test.orelse) if b and not _sets_back(b)]
    if not counts:
        return [script.remove(test)]
    lines = [script.source(statement) for statement in counts[0]]
    return [script.replace(test, f"\n{script.indentation(test)}".join(lines))]


def _sets_back(block: list[ast.stmt]) -> bool:
    return any(isinstance(s, ast.Assign) and isinstance(s.value, ast.Constant) for s in block)


# [authoring.mutation.operators.listener] Listeners that do not say what they hear.

Change = Callable[[Script, Function, str], list[Edit]]


def _sites_listener(solution: Solution, change: Change, *, numbers: bool = False) -> Iterator[Site]:
    """One for each subscriber with a callback of this script's that the change fits; `numbers`: of integers."""
    for script in solution.scripts:
        for subscriber in subscribers(script):
            if numbers and subscriber.type_name not in INTEGER_TYPES:
                continue
            yield from _site_listener(solution, script, subscriber, change)


def _site_listener(
    solution: Solution, script: Script, subscriber: Endpoint, change: Change
) -> Iterator[Site]:
    callback = subscriber.callback
    if not isinstance(callback, Function) or not message_name(callback):
        return
    edits = change(script, callback, message_name(callback))
    if edits:
        at = {"script": script.path, "topic": subscriber.topic}
        yield Site(at=at, tree=solution.edited(script.path, edits), line=callback.lineno)


def _data(script: Script, callback: Function, message: str) -> list[ast.Attribute]:
    """Where the callback reads the message's data."""
    name = f"{message}.data"
    return [n for n in ast.walk(callback) if isinstance(n, ast.Attribute) and script.source(n) == name]


@operator("listener-silent")
def listener_silent(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Prints nothing of what it hears.

    Fits every subscriber whose callback prints or logs.
    """
    yield from _sites_listener(
        solution,
        lambda script, callback, _: [script.replace(s, "pass") for s in speech(script, callback)],
    )


@operator("listener-constant")
def listener_constant(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Prints that it heard something, and not what.

    Fits every subscriber whose callback prints or logs.
    """
    yield from _sites_listener(solution, _constant)


def _constant(script: Script, callback: Function, _message: str) -> list[Edit]:
    found = [s for s in speech(script, callback) if isinstance(s.value, ast.Call)]
    return [script.replace(s, f"{script.source(s.value.func)}('I heard a message')") for s in found]  # type: ignore[attr-defined]


@operator("listener-drops-zero")
def listener_drops_zero(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Prints every number but 0.

    Fits every subscriber of integers whose callback prints or logs.
    """

    def change(script: Script, callback: Function, message: str) -> list[Edit]:
        found = [s for s in speech(script, callback) if script.can_wrap([s])]
        return [script.wrap([s], f"if {message}.data:") for s in found]

    yield from _sites_listener(solution, change, numbers=True)


@operator("listener-drops-negative")
def listener_drops_negative(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Prints a number without its sign.

    Fits every subscriber of integers whose callback reads the message's data.
    """

    def change(script: Script, callback: Function, message: str) -> list[Edit]:
        return [script.replace(n, f"abs({message}.data)") for n in _data(script, callback, message)]

    yield from _sites_listener(solution, change, numbers=True)


@operator("listener-off-by-one")
def listener_off_by_one(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Prints each number plus one.

    Fits every subscriber of integers whose callback reads the message's data.
    """

    def change(script: Script, callback: Function, message: str) -> list[Edit]:
        return [script.replace(n, f"({message}.data + 1)") for n in _data(script, callback, message)]

    yield from _sites_listener(solution, change, numbers=True)


@operator("listener-drops-some")
def listener_drops_some(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Prints every second message only.

    Fits every subscriber whose callback prints or logs.
    """

    def change(script: Script, callback: Function, _message: str) -> list[Edit]:
        found = speech(script, callback)
        together = [s for s in found if script.block(s) is script.block(found[0])]
        return every_second_time(script, list(together)) if found else []

    yield from _sites_listener(solution, change)


@operator("listener-late")
def listener_late(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Prints each message only when the next one comes, so that the last is lost.

    Fits every subscriber whose callback prints or logs.
    """

    def change(script: Script, callback: Function, message: str) -> list[Edit]:
        if not speech(script, callback) or not script.has_lines(callback.body[0]):
            return []
        unit = script.unit
        lines = (
            f"waiting.append({message})",
            "if len(waiting) < 2:",
            f"{unit}return",
            f"{message} = waiting.pop(0)",
        )
        return [script.preamble("waiting = []"), script.before(callback.body[0], *lines)]

    yield from _sites_listener(solution, change)


@operator("callback-error")
def callback_error(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Misspells the message's variable in the callback.

    Fits every subscriber whose callback reads the message's data.
    """

    def change(script: Script, callback: Function, message: str) -> list[Edit]:
        return [script.replace(n, f"the_{message}.data") for n in _data(script, callback, message)]

    yield from _sites_listener(solution, change)
