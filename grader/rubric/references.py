"""What a rubric names has to be there: in the scenario that a criterion judges, or on some machine.

An instructor's slip (a process, a topic, a type that is nowhere) would else cost every student the criterion's points.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import PurePosixPath
from typing import Any

from grader.checks.registry import Check, Reference
from grader.checks.support.topics import SYSTEM_TOPICS
from grader.ros_packages import TypeKind, ros_packages
from grader.rubric.scenario import PROGRAM_PATTERN, ROSTEST_ENDING, TYPE_PATTERN, Until
from grader.rubric.source import Fault, KeyPath, as_map, as_maps, as_texts, packages_in
from grader.wording import closest, did_you_mean, join_words

PUBLISHED_BY = {
    "turtlesim/turtlesim_node": re.compile(r"/turtle\d+/(pose|color_sensor)"),
    "robot_world/robot_world": re.compile(r"/(scan|base_scan|odom|base_pose_ground_truth|collision)"),
}
"""Topics on which a program of the grader's publishes, and no one else would."""
LAUNCH_ENDINGS = (".launch", ".xml")
OTHER_CONDITIONS = ("messages", "connected", "heard", "nodes", "opened", "ended", "quiet_s")
"""Conditions of `until` that say nothing of how long a run lasts."""
TYPES: Mapping[str, TypeKind] = {"message": "msg", "field": "msg", "service": "srv"}
LIKELY, SURE = 0.6, 0.85
"""How alike two names have to be: to be suggested, and to be taken for one with a slip."""
_DIGITS = re.compile(r"\d+")
_TOPIC = re.compile(r"(?:^|:=)(/[\w/]*\w)")


def reference_faults(rubric: dict[str, Any], checks: Mapping[str, Check]) -> Iterator[Fault]:
    """Yield a fault for everything that is named and not there."""
    scenarios = {name: as_map(one) for name, one in as_map(rubric.get("scenarios")).items()}
    for name, scenario in scenarios.items():
        yield from _outside_faults(("scenarios", name), scenario, rubric)
    for index, criterion in as_maps(rubric.get("criteria")):
        check = checks.get(str(criterion.get("check")))
        if check is not None:
            judged = scenarios.get(str(criterion.get("scenario")))
            yield from _criterion_faults(("criteria", index), criterion, check, judged, rubric)
    yield from _unused(rubric, scenarios, checks)
    yield from _unknown_topics(rubric, scenarios, checks)


def _outside_faults(path: KeyPath, scenario: dict[str, Any], rubric: dict[str, Any]) -> Iterator[Fault]:
    """Yield what a scenario asks for that no machine has."""
    for index, start in as_maps(scenario.get("start")):
        launch = start.get("launch")
        if isinstance(launch, str) and not launch.endswith(LAUNCH_ENDINGS):
            yield (
                (*path, "start", index, "launch"),
                f'roslaunch takes the file\'s whole name: "{launch}.launch"',
            )
        yield from _of_machine((*path, "start", index, "program"), "program", start.get("program"), rubric)
    for key in ("calls", "serves"):
        for index, one in as_maps(scenario.get(key)):
            if one.get("action") is not None:
                continue  # whether there is an action, only its file says
            yield from _of_machine((*path, key, index, "type"), "service", one.get("type"), rubric)


def _of_machine(path: KeyPath, to: str, value: object, rubric: dict[str, Any]) -> Iterator[Fault]:
    """A program, or a type of messages or services. The student's own package may have any type."""
    if not isinstance(value, str):
        return
    own = {*packages_in(rubric), *(name for _, name in as_texts(rubric.get("packages")))}
    fault = ""
    if to == "program" and not re.fullmatch(PROGRAM_PATTERN, value):
        fault = f'name its package too, like turtlesim/turtlesim_node, not "{value}"'
        fault += "; programs of the students' own go under scripts" if path[-2:-1] == ("programs",) else ""
    elif to == "program" and value.partition("/")[0] not in own:
        fault = ros_packages().program_fault(value)
    elif to in TYPES and re.fullmatch(TYPE_PATTERN, value := value.partition("[")[0]):
        fault = ros_packages().type_fault(value, TYPES[to], own)
    if fault:
        yield path, fault


def _criterion_faults(
    path: KeyPath,
    criterion: dict[str, Any],
    check: Check,
    scenario: dict[str, Any] | None,
    rubric: dict[str, Any],
) -> Iterator[Fault]:
    given = as_map(criterion.get("with"))
    for one in check.references(given):
        at = (*path, "with", *one.path)
        yield from _of_machine(at, one.to, one.value, rubric)
        if scenario and check.needs_run and scenario.get("recording") is None:
            yield from ((at, fault) for fault in _misfits(one, check, criterion, scenario))


def _misfits(
    one: Reference, check: Check, criterion: dict[str, Any], scenario: dict[str, Any]
) -> Iterator[str]:
    """Yield why the scenario does not have what a parameter refers to."""
    name, value, starts = criterion.get("scenario"), one.value, _starts(scenario)
    if one.to == "watched_s":
        yield from _too_short(one, check, scenario)
    elif not isinstance(value, str) or not value:
        return
    elif one.to == "process" and not any(_is_process(value, start) for start in starts):
        own = [str(start.get("name")) for start in starts if start.get("program") is None]
        yield f'{name} starts no process "{value}" of the student\'s{_instead(value, own)}'
    elif one.to in LISTED:
        words, listed = LISTED[one.to]
        if value not in (there := sorted(listed(scenario))):
            yield words.format(name=name, value=value, instead=_instead(value, there))
    elif one.to == "kept" and not any(PurePosixPath(value).match(keep) for keep in _kept(scenario)):
        yield f'{name} keeps no file "{value}"{_instead(value, _kept(scenario))}; add it to its keeps'
    elif one.to == "set" and not _is_set(value, scenario):
        there = [str(param.get("name")) for _, param in as_maps(scenario.get("params"))]
        yield f"{name} sets no parameter {value}{did_you_mean(value, there)}: add it to its params"
    elif one.to == "published":
        yield from _wrong_sender(value, as_map(criterion.get("with")).get("of", "student"), check, starts)


def _wrong_sender(topic: str, of: object, check: Check, starts: list[dict[str, Any]]) -> Iterator[str]:
    """Yield why nobody whose messages are judged sends any."""
    program = _only_publisher(topic, starts)
    if of == "student" and program:
        yield f"{program} publishes on {topic}, and {check.name} judges the student's messages: give it of: program"
    if of == "program" and not any(start.get("program") for start in starts):
        yield f"the scenario starts no program, and {check.name} judges the messages of one (of: program)"


def _is_process(name: str, start: dict[str, Any]) -> bool:
    """Return whether a start makes a process of this name; of programs that were built, `<start>/<program>`."""
    own = str(start.get("name"))
    return start.get("program") is None and (
        own == name or (bool(start.get("built")) and name.startswith(f"{own}/"))
    )


def _is_set(name: str, scenario: dict[str, Any]) -> bool:
    """A file's parameters are known only once there is the student's file."""
    params = [param for _, param in as_maps(scenario.get("params"))]
    names = {"/" + str(param.get("name")).strip("/") for param in params}
    return name in names or any(param.get("file") is not None for param in params) or "steps" in scenario


def _only_publisher(topic: str, starts: list[dict[str, Any]]) -> str:
    """Return the program of the grader's that publishes there. Arguments may give its topics other names."""
    programs = {str(start.get("program")) for start in starts if not start.get("args")}
    return next((p for p, topics in PUBLISHED_BY.items() if p in programs and topics.fullmatch(topic)), "")


def _too_short(one: Reference, check: Check, scenario: dict[str, Any]) -> Iterator[str]:
    """Yield what a scenario lacks in length; how long one lasts that waits for something else, no one knows."""
    until = as_map(scenario.get("until"))
    limit_s = until.get("limit_s", Until.model_fields["limit_s"].default)
    lasting = [until[key] for key in ("window_s", "alive_s") if key in until]
    known = [s for s in (*lasting, limit_s) if isinstance(s, int | float)]
    if scenario.get("clock", "real") != "real":
        if hasattr(check.params, "rate_bounds"):
            yield "rates are judged in real time: give the criterion a scenario with clock: real"
        return
    if not isinstance(one.value, int | float) or len(known) <= len(lasting):
        return
    waits = any(until.get(key) for key in OTHER_CONDITIONS)
    longest_s = min(max(lasting), limit_s) if lasting and not waits else limit_s
    if one.value > longest_s:
        key = "limit_s" if longest_s == limit_s else "window_s" if "window_s" in until else "alive_s"
        yield f"{one.value:g} s is more than the scenario lasts: {key}, {longest_s:g} s"


def _unused(
    rubric: dict[str, Any], scenarios: dict[str, dict[str, Any]], checks: Mapping[str, Check]
) -> Iterator[Fault]:
    """Yield scenarios that are run for nothing; a check that sees all of them may ask for any."""
    used: set[str] = set()
    for _, criterion in as_maps(rubric.get("criteria")):
        check = checks.get(str(criterion.get("check")))
        if (check is None and criterion.get("check") != "manual") or (check and "evidence" in check.facts):
            return
        used.add(str(criterion.get("scenario")))
    for name in scenarios:
        if name not in used:
            yield ("scenarios", name), "no criterion judges this scenario: remove it, or name it in one"


def _unknown_topics(
    rubric: dict[str, Any], scenarios: dict[str, dict[str, Any]], checks: Mapping[str, Check]
) -> Iterator[Fault]:
    """Yield topics that a run waits for and that nothing else knows.

    Programs, launch files and checks of the instructor's own may know others: then only a near miss is a fault.
    """
    criteria = [criterion for _, criterion in as_maps(rubric.get("criteria"))]
    named = {topic for criterion in criteria for topic in _topics_in(criterion.get("with"))}
    own = any(c.get("check") not in checks or checks[c["check"]].source or "evidence" in checks[c["check"]].facts
              for c in criteria)  # fmt: skip
    for name, scenario in scenarios.items():
        until = as_map(scenario.get("until"))
        known = {*named, *SYSTEM_TOPICS}
        known |= {t for key, part in scenario.items() if key != "until" for t in _topics_in(part)}
        open_ = own or any(start.get("script") is None for start in _starts(scenario))
        for at, topic in _waited_for(until):
            near = _near(topic, named, cutoff=SURE if open_ else LIKELY)
            if topic.startswith("/") and topic not in known and (near or not open_):
                meant = f' (did you mean "{near}"?)' if near else ""
                yield ("scenarios", name, "until", *at), f"no criterion and no probe names {topic}{meant}"


def _waited_for(until: dict[str, Any]) -> Iterator[tuple[KeyPath, str]]:
    for key in ("topics", "connected"):
        yield from (((key, index), topic) for index, topic in as_texts(until.get(key)))
    yield from ((("messages", topic), topic) for topic in as_map(until.get("messages")))


def _topics_in(value: object) -> Iterator[str]:
    if isinstance(value, str):
        yield from _TOPIC.findall(value)
    elif isinstance(value, Mapping):
        yield from (topic for key, item in value.items() for topic in (*_topics_in(key), *_topics_in(item)))
    elif isinstance(value, list | tuple):
        yield from (topic for item in value for topic in _topics_in(item))


def _sent(scenario: dict[str, Any]) -> set[str]:
    """Return the topics on which probes send, and steps of the scenario."""
    sent = {str(probe.get("topic")) for _, probe in as_maps(scenario.get("probes"))}
    return sent | set(_topics_in(scenario.get("steps")))


def _actions(scenario: dict[str, Any]) -> list[str]:
    return [
        str(as_map(step.get("action")).get("name"))
        for _, step in as_maps(scenario.get("steps"))
        if "action" in step
    ]


def _kept(scenario: dict[str, Any]) -> list[str]:
    return [pattern for _, pattern in as_texts(scenario.get("keeps")) if pattern]


def _served(scenario: dict[str, Any]) -> list[str]:
    return [str(one.get("service") or one.get("action")) for _, one in as_maps(scenario.get("serves"))]


LISTED: Mapping[str, tuple[str, Callable[[dict[str, Any]], Iterable[str]]]] = {
    "launch": (
        '{name} does not start "{value}"{instead}',
        lambda scenario: _named(_starts(scenario), "launch"),
    ),
    "sent": ("no probe of {name} sends on {value}{instead}", _sent),
    "action": ("no step of {name} sends a goal to {value}{instead}", _actions),
    "rostest": (
        '{name} starts no .test file as "{value}"{instead}',
        lambda scenario: [
            str(s.get("name")) for s in _starts(scenario) if str(s.get("program")).endswith(ROSTEST_ENDING)
        ],
    ),
    "served": ("the grader does not offer {value} in {name}{instead}: add it to serves", _served),
}
"""Of what a scenario has to list: what is said where it does not, and where to look."""


def _starts(scenario: dict[str, Any]) -> list[dict[str, Any]]:
    return [start for _, start in as_maps(scenario.get("start"))]


def _named(starts: list[dict[str, Any]], key: str) -> list[str]:
    return [str(start[key]) for start in starts if start.get(key) is not None]


def _instead(name: str, there: list[str]) -> str:
    """Return what is like the name, else all that is there."""
    return did_you_mean(name, there) or f": there is {join_words(there) or 'none'}"


def _near(topic: str, named: Iterable[str], *, cutoff: float) -> str:
    """Return the topic most like it. `/turtle1/pose` and `/turtle2/pose` are two, and not one with a slip."""
    plain = _DIGITS.sub("", topic)
    return closest(topic, [name for name in named if _DIGITS.sub("", name) != plain], cutoff=cutoff)
