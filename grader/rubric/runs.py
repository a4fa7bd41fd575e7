"""What the records of a scenario cannot say by their types."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any

from grader.rubric.source import Fault, KeyPath, as_map, as_maps, as_texts
from grader.suggest import did_you_mean

KINDS_OF_START = ("script", "launch", "load", "program", "built")
STRING = "std_msgs/String"
INTEGERS = {
    f"std_msgs/{prefix}Int{bits}": (low, high)
    for bits in (8, 16, 32, 64)
    for prefix, low, high in (("", -(2 ** (bits - 1)), 2 ** (bits - 1) - 1), ("U", 0, 2**bits - 1))
}


def scenario_faults(path: KeyPath, scenario: dict[str, Any]) -> Iterator[Fault]:
    """Every fault of one scenario that its record's types cannot say."""
    if "warp" in scenario and scenario.get("clock", "real") == "real":
        yield (*path, "warp"), 'only a scenario with "clock: warped" has a warp'
    yield from _means(path, scenario)
    yield from _starts(path, scenario)
    yield from _params(path, scenario)
    yield from _probes(path, scenario)
    for index, call in as_maps(scenario.get("calls")):
        yield from _slash((*path, "calls", index, "service"), call.get("service"), "a service")
    yield from _until((*path, "until"), as_map(scenario.get("until")), scenario)


def _means(path: KeyPath, scenario: dict[str, Any]) -> Iterator[Fault]:
    """A scenario starts something and says until when, or it names a recording and nothing else."""
    if scenario.get("recording") is None:
        if scenario.get("start") in (None, []):
            yield (*path, "start"), "is missing: give start, or recording"
        elif "until" not in scenario:
            yield (*path, "until"), "is missing"
        return
    for key in ("start", "params", "probes", "calls", "until", "clock", "warp"):
        if key in scenario:
            yield (*path, key), "is not for a scenario with a recording: nothing is run"


def _starts(path: KeyPath, scenario: dict[str, Any]) -> Iterator[Fault]:
    names: list[str] = []
    for index, start in as_maps(scenario.get("start")):
        at = (*path, "start", index)
        given = [key for key in KINDS_OF_START if start.get(key) not in {None, False}]
        if len(given) != 1:
            found = f"{' and '.join(given)} are there" if given else "none is there"
            yield at, f"give one of {', '.join(KINDS_OF_START[:-1])} and {KINDS_OF_START[-1]}: {found}"
        name, after = start.get("name"), start.get("after")
        if isinstance(after, str) and after not in names:
            yield (*at, "after"), f'there is no earlier start "{after}"{did_you_mean(after, names)}'
        if isinstance(name, str) and name in names:
            yield (*at, "name"), f'"{name}" is another start\'s name already'
        names.append(str(name))


def _params(path: KeyPath, scenario: dict[str, Any]) -> Iterator[Fault]:
    for index, param in as_maps(scenario.get("params")):
        at = (*path, "params", index)
        of_file, named = param.get("file") is not None, param.get("name") is not None
        if of_file == named:
            yield at, f"give one of name and file, not {'both' if named else 'neither'}"
        if of_file:
            for key in ("value", "made_up"):
                if param.get(key) is not None:
                    yield (*at, key), "is for a parameter with a name, not for a file"
        elif named and (param.get("value") is None) == (param.get("made_up") is None):
            yield at, "give one of value and made_up"
        if named and not of_file and param.get("also"):
            yield (*at, "also"), "is for a file: names that it may lack"


def _probes(path: KeyPath, scenario: dict[str, Any]) -> Iterator[Fault]:
    for index, probe in as_maps(scenario.get("probes")):
        at = (*path, "probes", index)
        if not any(probe.get(key) for key in ("text", "integers", "among", "values")):
            yield at, "sends nothing: give text, integers, among or values"
        if probe.get("times", 1) != 1 and not probe.get("values"):
            yield (*at, "times"), "is for values"
        yield from _slash((*at, "topic"), probe.get("topic"), "a topic")
        kind = probe.get("type")
        if isinstance(kind, str) and "/" in kind:
            yield from _contents(at, probe, kind)


def _contents(at: KeyPath, probe: dict[str, Any], kind: str) -> Iterator[Fault]:
    """What is sent has to fit the type."""
    values = list(enumerate(_items(probe.get("values"))))
    if values or (kind != STRING and kind not in INTEGERS):
        yield from _misfits(at, kind, values)
    if probe.get("text") and kind != STRING:
        yield (*at, "text"), f"is not for {kind}"
    for key in ("integers", "among"):
        if probe.get(key) and kind not in INTEGERS:
            yield (*at, key), f"is not for {kind}"
    low, high = INTEGERS.get(kind, (-math.inf, math.inf))
    for position, value in enumerate(_items(probe.get("among"))):
        if isinstance(value, int) and not low <= value <= high:
            yield (*at, "among", position), f"an {kind.partition('/')[2]} holds {low} to {high}, not {value}"


def _misfits(at: KeyPath, kind: str, values: list[tuple[int, Any]]) -> Iterator[Fault]:
    from grader.evidence.decode import definition, encode  # noqa: PLC0415 - slow to load, and few rubrics need it

    def misfit(work: Callable[[], object]) -> str:
        try:
            work()
        except ValueError as error:
            return str(error)
        return ""

    if unknown := misfit(lambda: definition(kind)):
        yield (*at, "type"), unknown
        return
    for position, value in values:
        fields = value if isinstance(value, dict) else {"data": value}
        if wrong := misfit(lambda fields=fields: encode(kind, fields)):  # type: ignore[misc]
            yield (*at, "values", position), wrong


def _items(value: object) -> list[Any]:
    return value if isinstance(value, list) else []


def _until(path: KeyPath, until: dict[str, Any], scenario: dict[str, Any]) -> Iterator[Fault]:
    for key in ("topics", "connected"):
        for index, topic in as_texts(until.get(key)):
            yield from _slash((*path, key, index), topic, "a topic")
    for topic, count in as_map(until.get("messages")).items():
        yield from _slash((*path, "messages", topic), topic, "a topic")
        if isinstance(count, int) and count < 1:
            yield (*path, "messages", topic), f"must be at least 1, not {count}"
    if until.get("heard") is True and not scenario.get("probes"):
        yield (*path, "heard"), "needs probes: there is nothing to hear"
    names = [str(start.get("name")) for _, start in as_maps(scenario.get("start"))]
    for index, name in as_texts(until.get("ended")):
        if name not in names:
            yield (*path, "ended", index), f'there is no start "{name}"{did_you_mean(name, names)}'
    limit_s = until.get("limit_s", 60.0)
    for key in ("window_s", "alive_s", "quiet_s"):
        value_s = until.get(key)
        if isinstance(value_s, int | float) and isinstance(limit_s, int | float) and value_s >= limit_s > 0:
            yield (*path, key), f"{value_s:g} s can never pass within limit_s, {limit_s:g} s"


def _slash(path: KeyPath, name: object, what: str) -> Iterator[Fault]:
    if isinstance(name, str) and not name.startswith("/"):
        yield path, f'{what} begins with a slash: "/{name}"'
