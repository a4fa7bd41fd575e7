"""What messages say, how counters count, and listeners that do not say what they hear."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import PurePosixPath

from pydantic import Field

from grader.authoring.mutation.registry import Finder, operator
from grader.authoring.mutation.rospy_code import (
    INTEGER_TYPES,
    Counter,
    each_publisher,
    each_subscriber,
    endpoints,
    find_counter,
    message_name,
    script_place,
    sources,
    speech,
)
from grader.authoring.mutation.solution import CodePlace, Solution
from grader.authoring.mutation.source_edits import (
    Function,
    Script,
    TextEdit,
    every_second_time,
    misspelt_literal,
    texts_in,
)
from grader.model.message_definitions import PARTS, parse_interface
from grader.model.package import InterfaceField
from grader.model.record import Record

# ---- what a message says

SECONDS = {"rospy.get_time()": "1700000000.0", "time.time()": "1700000000.0"}
TIMES = {"rospy.Time.now()": "rospy.Time(1700000000)", "rospy.get_rostime()": "rospy.Time(1700000000)"}
NANOSECONDS = "rospy.Time.now().to_nsec()"


def _messages(solution: Solution) -> Iterator[tuple[CodePlace, Script, list[ast.expr]]]:
    """Find the publishers, each with the expressions that its messages are made of."""
    for place, script, publisher in each_publisher(solution):
        yield script_place(script, topic=str(place.at["topic"])), script, sources(script, publisher)


def _calls(values: list[ast.expr]) -> list[ast.Call]:
    return list(dict.fromkeys(n for value in values for n in ast.walk(value) if isinstance(n, ast.Call)))


@operator(each=_messages, fits="every publisher whose messages are made from a text")
def message_altered(script: Script, values: list[ast.expr]) -> list[TextEdit]:
    """Misspells the message."""
    for text in (text for value in values for text in texts_in(value)):
        misspelt = misspelt_literal(script.source(text))
        if misspelt != script.source(text):
            return [script.replace(text, misspelt)]
    return []


@operator(each=_messages, fits="every publisher whose messages carry the time")
def message_constant_time(script: Script, values: list[ast.expr]) -> list[TextEdit]:
    """Sends the same time again and again."""
    constants = SECONDS | TIMES
    return [script.replace(c, constants[s]) for c in _calls(values) if (s := script.source(c)) in constants]


@operator(each=_messages, fits="every publisher whose messages carry the time in seconds")
def message_nanoseconds(script: Script, values: list[ast.expr]) -> list[TextEdit]:
    """Sends the time in nanoseconds, not in seconds."""
    in_seconds = {*SECONDS, *(f"{time}.to_sec()" for time in TIMES)}
    return [script.replace(c, NANOSECONDS) for c in _calls(values) if script.source(c) in in_seconds]


# ---- stamps, frames, actions and definitions

OTHER_TYPES = {
    "float64": "float32",
    "float32": "float64",
    "int64": "int32",
    "int32": "int64",
    "uint8": "int8",
}


def _stamps(solution: Solution) -> Iterator[tuple[CodePlace, Script, ast.Assign]]:
    """Find the lines that set a header's stamp."""
    for script in solution.scripts:
        for line in script.of(ast.Assign):
            if isinstance(line.targets[0], ast.Attribute) and line.targets[0].attr == "stamp":
                yield script_place(script), script, line


@operator(each=_stamps, fits="every line that sets one")
def stamp_not_set(script: Script, line: ast.Assign) -> list[TextEdit]:
    """Never sets the stamp of the header."""
    return [script.remove(line)]


def _frames(solution: Solution) -> Iterator[tuple[CodePlace, Script, ast.expr, ast.expr]]:
    """Find what is set as a transform's parent and child, one behind the other."""
    for script in solution.scripts:
        lines = [line for line in script.of(ast.Assign) if isinstance(line.targets[0], ast.Attribute)]
        for first, second in pairwise(sorted(lines, key=lambda line: line.lineno)):
            names = [ast.unparse(line.targets[0]).rpartition(".")[2] for line in (first, second)]
            if names == ["frame_id", "child_frame_id"]:
                child = script.source(second.value).strip("\"'")
                yield script_place(script, child=child), script, first.value, second.value


@operator(
    each=_frames, fits="every transform whose `child_frame_id` is set in the line behind its `frame_id`"
)
def frames_swapped(script: Script, parent: ast.expr, child: ast.expr) -> list[TextEdit]:
    """Swaps parent and child of a transform."""
    return [script.replace(parent, script.source(child)), script.replace(child, script.source(parent))]


def _preempts(solution: Solution) -> Iterator[tuple[CodePlace, Script, ast.Call]]:
    """Find where an action server asks whether its goal was cancelled."""
    for script in solution.scripts:
        for call in script.of(ast.Call):
            if isinstance(call.func, ast.Attribute) and call.func.attr == "is_preempt_requested":
                yield script_place(script), script, call


@operator(each=_preempts, fits="every call of `is_preempt_requested()`")
def preempt_not_heeded(script: Script, call: ast.Call) -> list[TextEdit]:
    """Goes on with an action's goal that was cancelled."""
    return [script.replace(call, "False")]


def _fields(solution: Solution) -> Iterator[tuple[CodePlace, str, InterfaceField]]:
    """Find the fields of the package's own messages, services and actions."""
    for path in solution.files:
        if PurePosixPath(path).suffix in PARTS:
            text = solution.text(path)
            for field in parse_interface(text.encode(errors="surrogateescape"), path).fields:
                if field.value is None:
                    yield CodePlace(path=path, at={"file": path, "field": field.name}), text, field


@operator(
    each=_fields, fits="every field of a `.msg`, `.srv` or `.action` file that is a number of a usual type"
)
def field_other_type(text: str, field: InterfaceField) -> list[TextEdit]:
    """Gives a field of its own message another type."""
    start = text.index(field.type, len("".join(text.splitlines(keepends=True)[: field.line - 1])))
    other = OTHER_TYPES.get(field.type)
    return [TextEdit(start, start + len(field.type), other)] if other else []


# ---- counters


class ByParams(Record):
    """`by`: how far from the right number."""

    by: int = Field(default=1, ge=1)


class EarlyParams(Record):
    """`by`: how many numbers too early."""

    by: int = Field(default=28, ge=2)


def _counters(solution: Solution) -> Iterator[tuple[CodePlace, Script, Counter]]:
    """Find the integer topics that are fed by a counter."""
    for script in solution.scripts:
        for publisher in endpoints(script, "Publisher"):
            counter = find_counter(script, publisher)
            if counter is not None:
                yield script_place(script, topic=publisher.topic), script, counter


def _add(script: Script, constants: list[ast.Constant], number: int) -> list[TextEdit]:
    """Return each of the constants once, changed by `number`."""
    distinct = {script.span(c): c for c in constants}.values()
    return [script.replace(c, str(c.value + number)) for c in distinct if isinstance(c.value, int)]


def _set(script: Script, constants: list[ast.Constant], number: int) -> list[TextEdit]:
    return [script.replace(c, str(number)) for c in {script.span(c): c for c in constants}.values()]


@operator(each=_counters, fits="every integer topic that is fed by a counter with a first value")
def counter_from_one(script: Script, counter: Counter) -> list[TextEdit]:
    """Begins to count at 1."""
    return _set(script, counter.starts, 1)


@operator(each=_counters, params=ByParams, fits="every integer topic that is fed by a counter")
def counter_skips(script: Script, counter: Counter, params: ByParams) -> list[TextEdit]:
    """Counts in steps that are too large."""
    return _add(script, counter.steps, params.by)


@operator(each=_counters, params=EarlyParams, fits="every counter with a limit that is written as a number")
def reset_early(script: Script, counter: Counter, params: EarlyParams) -> list[TextEdit]:
    """Goes back to the beginning too early."""
    return _add(script, counter.limits, -params.by)


@operator(each=_counters, params=ByParams, fits="every counter with a limit that is written as a number")
def reset_late(script: Script, counter: Counter, params: ByParams) -> list[TextEdit]:
    """Goes back to the beginning too late."""
    return _add(script, counter.limits, params.by)


@operator(each=_counters, fits="every counter that is set back, or taken modulo a number")
def reset_to_one(script: Script, counter: Counter) -> list[TextEdit]:
    """Goes back to 1."""
    return _back_to(script, counter, 1)


@operator(each=_counters, fits="every counter that is set back, or taken modulo a number")
def wrap_to_minus_128(script: Script, counter: Counter) -> list[TextEdit]:
    """Goes on at -128, as an 8-bit integer of C does."""
    return _back_to(script, counter, -128)


def _back_to(script: Script, counter: Counter, number: int) -> list[TextEdit]:
    edits = _set(script, counter.resets, number)
    for modulo in counter.modulos:
        if isinstance(modulo.right, ast.Constant) and isinstance(modulo.right.value, int):
            limit, value = modulo.right.value, script.source(modulo.left)
            edits.append(script.replace(modulo, f"({value} if {value} < {limit} else {number})"))
    return edits


@operator(each=_counters, fits="every counter that is set back by an `if`, or taken modulo a number")
def never_reset(script: Script, counter: Counter) -> list[TextEdit]:
    """Never goes back to the beginning."""
    edits = [script.replace(modulo, script.source(modulo.left)) for modulo in counter.modulos]
    for test in counter.tests:
        if isinstance(test, ast.If):
            edits += _without_if(script, test)
        else:
            counted = test.orelse if isinstance(test.body, ast.Constant) else test.body
            edits.append(script.replace(test, script.source(counted)))
    return edits


def _without_if(script: Script, test: ast.If) -> list[TextEdit]:
    """Return what is left where the branch that sets back is never taken."""
    if not script.has_lines(test):
        return []
    counts = [b for b in (test.body, test.orelse) if b and not _sets_back(b)]
    if not counts:
        return [script.remove(test)]
    lines = [script.source(statement) for statement in counts[0]]
    return [script.replace(test, f"\n{script.indentation(test)}".join(lines))]


def _sets_back(block: list[ast.stmt]) -> bool:
    return any(isinstance(s, ast.Assign) and isinstance(s.value, ast.Constant) for s in block)


# ---- listeners


@dataclass(frozen=True, kw_only=True)
class Hearing:
    """A subscriber's callback, the name of its message, and its statements that print or log."""

    script: Script
    callback: Function
    message: str
    said: list[ast.Expr]

    def replace_data(self, text: str) -> list[TextEdit]:
        """Put `text` where the callback reads the message's data."""
        reads = (n for n in ast.walk(self.callback) if isinstance(n, ast.Attribute))
        data = f"{self.message}.data"
        return [self.script.replace(node, text) for node in reads if self.script.source(node) == data]


def _callbacks(*types: str) -> Finder:
    """Return a finder of subscribers (of these types only, if any) with a callback that is a function of the script."""

    def find(solution: Solution) -> Iterator[tuple[CodePlace, Hearing]]:
        for place, script, subscriber in each_subscriber(solution):
            callback = subscriber.callback
            message = message_name(callback) if isinstance(callback, Function) else ""
            if isinstance(callback, Function) and message and (not types or subscriber.type_name in types):
                there = script_place(script, callback, topic=str(place.at["topic"]))
                said = speech(script, callback)
                yield there, Hearing(script=script, callback=callback, message=message, said=said)

    return find


any_callback = _callbacks()
integer_callback = _callbacks(*INTEGER_TYPES)
signed_callback = _callbacks(*(name for name in INTEGER_TYPES if not name.startswith("U")))


@operator(each=any_callback, fits="every subscriber whose callback prints or logs")
def listener_silent(heard: Hearing) -> list[TextEdit]:
    """Prints nothing of what it hears."""
    return [heard.script.replace(statement, "pass") for statement in heard.said]


@operator(each=any_callback, fits="every subscriber whose callback prints or logs")
def listener_constant(heard: Hearing) -> list[TextEdit]:
    """Prints that it heard something, and not what."""
    named = [(s, s.value.func) for s in heard.said if isinstance(s.value, ast.Call)]
    return [
        heard.script.replace(s, f"{heard.script.source(function)}('I heard a message')")
        for s, function in named
    ]


@operator(each=integer_callback, fits="every subscriber of integers whose callback prints or logs")
def listener_drops_zero(heard: Hearing) -> list[TextEdit]:
    """Prints every number but 0."""
    return [
        heard.script.wrap([s], f"if {heard.message}.data:") for s in heard.said if heard.script.can_wrap([s])
    ]


@operator(
    each=signed_callback,
    fits="every subscriber of integers that may be negative, whose callback reads the message's data",
)
def listener_drops_sign(heard: Hearing) -> list[TextEdit]:
    """Prints each number without its sign."""
    return heard.replace_data(f"abs({heard.message}.data)")


@operator(each=integer_callback, fits="every subscriber of integers whose callback reads the message's data")
def listener_off_by_one(heard: Hearing) -> list[TextEdit]:
    """Prints each number plus one."""
    return heard.replace_data(f"({heard.message}.data + 1)")


@operator(each=any_callback, fits="every subscriber whose callback prints or logs")
def listener_drops_some(heard: Hearing) -> list[TextEdit]:
    """Prints every second message only."""
    return every_second_time(
        heard.script, [s for s in heard.said if heard.script.block(s) is heard.script.block(heard.said[0])]
    )


@operator(each=any_callback, fits="every subscriber whose callback prints or logs")
def listener_late(heard: Hearing) -> list[TextEdit]:
    """Prints each message only when the next one comes, so that the last is lost."""
    if not heard.said or not heard.script.has_lines(heard.callback.body[0]):
        return []
    wait = (f"waiting.append({heard.message})", "if len(waiting) < 2:", f"{heard.script.unit}return")
    lines = (*wait, f"{heard.message} = waiting.pop(0)")
    return [heard.script.preamble("waiting = []"), heard.script.before(heard.callback.body[0], *lines)]


@operator(each=any_callback, fits="every subscriber whose callback reads the message's data")
def callback_error(heard: Hearing) -> list[TextEdit]:
    """Misspells the message's variable in the callback."""
    return heard.replace_data(f"the_{heard.message}.data")
