"""Listeners that do not say what they hear."""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterator

from grader.authoring.mutation.counter import INTEGER_TYPES
from grader.authoring.mutation.every_second import every_second_time
from grader.authoring.mutation.python import Function, Script
from grader.authoring.mutation.registry import NoParams, operator
from grader.authoring.mutation.ros import Endpoint, message_name, speech, subscribers
from grader.authoring.mutation.solution import Site, Solution
from grader.authoring.mutation.spans import Edit

Change = Callable[[Script, Function, str], list[Edit]]


def _sites(solution: Solution, change: Change, *, numbers: bool = False) -> Iterator[Site]:
    """One for each subscriber with a callback of this script's that the change fits; `numbers`: of integers."""
    for script in solution.scripts:
        for subscriber in subscribers(script):
            if numbers and subscriber.type_name not in INTEGER_TYPES:
                continue
            yield from _site(solution, script, subscriber, change)


def _site(solution: Solution, script: Script, subscriber: Endpoint, change: Change) -> Iterator[Site]:
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
    yield from _sites(
        solution,
        lambda script, callback, _: [script.replace(s, "pass") for s in speech(script, callback)],
    )


@operator("listener-constant")
def listener_constant(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Prints that it heard something, and not what.

    Fits every subscriber whose callback prints or logs.
    """
    yield from _sites(solution, _constant)


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

    yield from _sites(solution, change, numbers=True)


@operator("listener-drops-negative")
def listener_drops_negative(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Prints a number without its sign.

    Fits every subscriber of integers whose callback reads the message's data.
    """

    def change(script: Script, callback: Function, message: str) -> list[Edit]:
        return [script.replace(n, f"abs({message}.data)") for n in _data(script, callback, message)]

    yield from _sites(solution, change, numbers=True)


@operator("listener-off-by-one")
def listener_off_by_one(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Prints each number plus one.

    Fits every subscriber of integers whose callback reads the message's data.
    """

    def change(script: Script, callback: Function, message: str) -> list[Edit]:
        return [script.replace(n, f"({message}.data + 1)") for n in _data(script, callback, message)]

    yield from _sites(solution, change, numbers=True)


@operator("listener-drops-some")
def listener_drops_some(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Prints every second message only.

    Fits every subscriber whose callback prints or logs.
    """

    def change(script: Script, callback: Function, _message: str) -> list[Edit]:
        found = speech(script, callback)
        together = [s for s in found if script.block(s) is script.block(found[0])]
        return every_second_time(script, list(together)) if found else []

    yield from _sites(solution, change)


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

    yield from _sites(solution, change)


@operator("callback-error")
def callback_error(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Misspells the message's variable in the callback.

    Fits every subscriber whose callback reads the message's data.
    """

    def change(script: Script, callback: Function, message: str) -> list[Edit]:
        return [script.replace(n, f"the_{message}.data") for n in _data(script, callback, message)]

    yield from _sites(solution, change)
