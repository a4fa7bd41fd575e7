"""What the records of a scenario cannot say by their types."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from grader.rubric.source import Fault, KeyPath, as_map, as_maps, as_texts

INT8 = range(-128, 128)
FOREIGN = {"std_msgs/String": ("integers", "among"), "std_msgs/Int8": ("text",)}


def scenario_faults(path: KeyPath, scenario: dict[str, Any]) -> Iterator[Fault]:
    """Every fault of one scenario that its record's types cannot say."""
    if "warp" in scenario and scenario.get("clock", "real") == "real":
        yield (*path, "warp"), 'only a scenario with "clock: warped" has a warp'
    yield from _means(path, scenario)
    names: set[str] = set()
    for index, start in as_maps(scenario.get("start")):
        at = (*path, "start", index)
        given = [key for key in ("script", "launch") if start.get(key) is not None]
        if len(given) != 1:
            yield at, f"give one of script and launch, not {'both' if given else 'neither'}"
        name = start.get("name")
        if isinstance(name, str) and name in names:
            yield (*at, "name"), f'"{name}" is another start\'s name already'
        names.add(str(name))
    yield from _probes(path, scenario)
    yield from _until((*path, "until"), as_map(scenario.get("until")), bool(scenario.get("probes")))


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


def _probes(path: KeyPath, scenario: dict[str, Any]) -> Iterator[Fault]:
    for index, probe in as_maps(scenario.get("probes")):
        at = (*path, "probes", index)
        kind = probe.get("type")
        if not any(probe.get(key) for key in ("text", "integers", "among")):
            yield at, "sends nothing: give text, integers or among"
        yield from _topic((*at, "topic"), probe.get("topic"))
        for key in FOREIGN.get(str(kind), ()):
            if probe.get(key):
                yield (*at, key), f"is not for {kind}"
        among = probe.get("among")
        for position, value in enumerate(among if isinstance(among, list) else ()):
            if kind == "std_msgs/Int8" and isinstance(value, int) and value not in INT8:
                yield (*at, "among", position), f"an Int8 holds -128 to 127, not {value}"


def _until(path: KeyPath, until: dict[str, Any], has_probes: bool) -> Iterator[Fault]:
    for key in ("topics", "connected"):
        for index, topic in as_texts(until.get(key)):
            yield from _topic((*path, key, index), topic)
    for topic, count in as_map(until.get("messages")).items():
        yield from _topic((*path, "messages", topic), topic)
        if isinstance(count, int) and count < 1:
            yield (*path, "messages", topic), f"must be at least 1, not {count}"
    if until.get("heard") is True and not has_probes:
        yield (*path, "heard"), "needs probes: there is nothing to hear"
    window_s, limit_s = until.get("window_s"), until.get("limit_s", 60.0)
    if isinstance(window_s, int | float) and isinstance(limit_s, int | float) and window_s >= limit_s > 0:
        yield (*path, "window_s"), f"{window_s:g} s can never pass within limit_s, {limit_s:g} s"


def _topic(path: KeyPath, topic: object) -> Iterator[Fault]:
    if isinstance(topic, str) and not topic.startswith("/"):
        yield path, f'a topic begins with a slash: "/{topic}"'
