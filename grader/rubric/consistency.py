"""What the records' types cannot say: names that must exist, points that must add up, circles.

Works on the data as read, so that a fault in one place hides none elsewhere.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from grader.checks.registry import Check
from grader.checks.support.fields import is_number
from grader.evidence.decode import definition, encode
from grader.installable import noetic_messages
from grader.model.message_definitions import integer_limits
from grader.rubric.fault_words import model_faults
from grader.rubric.model import ManualParams
from grader.rubric.references import reference_faults
from grader.rubric.scenario import ROSTEST_ENDING
from grader.rubric.step_faults import (
    action_names,
    call_faults,
    empty_in,
    private,
    served_faults,
    slash,
    step_faults,
)
from grader.rubric.yaml_lines import (
    Fault,
    KeyPath,
    WrittenCriterion,
    WrittenRubric,
    as_list,
    as_map,
    as_maps,
    as_texts,
    dotted,
    give_one,
    given_steps,
    starts_of,
)
from grader.wording import did_you_mean, join_words

TOTAL_POINTS = 100
ANSWERS = "service-answers"
MANUAL = "manual"  # a person gives the points, no check does
KINDS_OF_POINTS = ("points", "bonus", "penalty")
KINDS_OF_START = ("script", "launch", "load", "program", "built", "tests")
STRING = "std_msgs/String"


def cross_faults(
    rubric: WrittenRubric, checks: Mapping[str, Check], *, complete: bool, files: Mapping[str, bytes]
) -> list[Fault]:
    """Return every fault that shows only between one part of a rubric and another, or between it and the checks.

    Where `checks` are not complete, because the instructor's file of them is broken, a name that is near none is
    left alone: it may be one of theirs. `files` are those beside the rubric, of which the course's types are read.
    """
    criteria, scenarios = rubric.criteria, rubric.scenarios
    faults = [f for name, s in scenarios.items() for f in scenario_faults(("scenarios", name), s)]
    faults += action_names(rubric)
    if not isinstance(rubric.data.get("criteria"), list):
        return faults  # that is what is wrong; what else would not fit, follows from it
    for criterion in criteria:
        faults += _check(criterion, checks, complete=complete)
        faults += _place(criterion, scenarios, checks)
        faults += _uncalled_faults(criterion, scenarios)
    faults += _names(criteria)
    faults += _circles(criteria)
    faults += _points(rubric)
    faults += _groups(rubric)
    faults += _gates(rubric)
    faults += _late(rubric)
    faults += _packages(rubric)
    faults += reference_faults(rubric, checks, files)
    return faults


def swallowed_keys(rubric: dict[str, Any]) -> Iterator[Fault]:
    """Yield keys of the rubric that are a part of the handout's text, as they are indented like it."""
    for key in ("made_up", "scenarios", "criteria"):
        if key not in rubric and re.search(rf"(^|\s){key}:\s", str(rubric.get("handout"))):
            yield ("handout",), f'"{key}:" counts as its text: begin that line without blanks'


def _packages(rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield packages that are named twice or are the course's, and starts and criteria with one that there is not."""
    known = rubric.packages
    for index, name in as_texts(rubric.data.get("package")):
        if name in known[:index]:
            yield ("package", index), f'"{name}" is there twice'
    for index, name in as_texts(rubric.data.get("packages")):
        if name in known[1:]:
            yield ("packages", index), f'"{name}" is one that students hand in: take it out of one of the two'
    for criterion in rubric.criteria:
        yield from _of_known((*criterion.place, "package"), criterion.data, known)
    for place, start in rubric.starts():
        at = (*place, "package")
        yield from _of_known(at, start, known)
        if start.get("package") is not None and start.get("program") is not None:
            yield at, "is not for a program: that names its package itself"


def _of_known(path: KeyPath, one: dict[str, Any], known: list[str]) -> Iterator[Fault]:
    name = one.get("package")
    if isinstance(name, str) and name not in known:
        near = did_you_mean(name, known) or f": there is {join_words(known)}"
        yield path, f'the lab has no package "{name}"{near}'


def _check(criterion: WrittenCriterion, checks: Mapping[str, Check], *, complete: bool) -> Iterator[Fault]:
    name = criterion.data.get("check")
    if not isinstance(name, str):
        return
    if name == MANUAL:
        yield from model_faults(ManualParams, criterion.given, criterion.at)
        return
    if name not in checks:
        part = next((one for one in checks if one in re.split(r"[-_ ]", name.lower())), "")  # `topic-rate`
        near = f' (did you mean "{part}"?)' if part else did_you_mean(name, [*checks, MANUAL])
        # A broken file of checks may have a check of that name.
        if complete or near:
            yield (*criterion.place, "check"), f'there is no check "{name}"{near}'
        return
    if isinstance(criterion.data.get("with", {}), dict):
        yield from model_faults(checks[name].params, criterion.given, criterion.at)


def _place(
    criterion: WrittenCriterion, scenarios: dict[str, Any], checks: Mapping[str, Check]
) -> Iterator[Fault]:
    place, name, check = criterion.place, criterion.run, checks.get(criterion.check)
    needs_run = check is not None and check.needs_run
    is_recorded = criterion.scenario.get("recording") is not None
    if not criterion.has_run and needs_run:
        yield (*place, "scenario"), f'is missing: "{criterion.check}" judges a run'
    elif isinstance(criterion.data.get("scenario"), str) and name not in scenarios:
        yield (*place, "scenario"), f'there is no scenario "{name}"{did_you_mean(name, scenarios)}'
    elif is_recorded and check is not None and needs_run and not check.messages_only:
        fault = f'"{criterion.check}" judges more than messages, and a recording holds no more'
        yield (*place, "check"), fault


def _uncalled_faults(criterion: WrittenCriterion, scenarios: dict[str, Any]) -> Iterator[Fault]:
    """Yield criteria that judge more answers than the scenario makes calls."""
    if criterion.check != ANSWERS or criterion.run not in scenarios:
        return
    run, service = criterion.scenario, criterion.given.get("service")
    asked = len(as_list(criterion.given.get("expect")))
    made_calls = [*(call for _, call in as_maps(run.get("calls"))), *given_steps(run, "call")]
    calls = [call for call in made_calls if call.get("service") == service]
    if len(calls) < asked:
        made = f"{len(calls)} of them" if calls else "none"
        yield (*criterion.at, "expect"), f"asks for {asked} calls of {service}; {criterion.run} makes {made}"


def _names(criteria: list[WrittenCriterion]) -> Iterator[Fault]:
    first: dict[str, KeyPath] = {}
    for criterion in criteria:
        name = criterion.data.get("id")
        if isinstance(name, str) and first.setdefault(name, criterion.place) != criterion.place:
            yield (*criterion.place, "id"), f'"{name}" is the id of {dotted(first[name])} already'
    for criterion in criteria:
        required = as_texts(criterion.data.get("requires"))
        for position, name in required:
            path = (*criterion.place, "requires", position)
            if name not in first:
                yield path, f'there is no criterion "{name}"{did_you_mean(name, first)}'
            elif any(name == other for earlier, other in required if earlier < position):
                yield path, f'"{name}" is listed already'


def _circles(criteria: list[WrittenCriterion]) -> Iterator[Fault]:
    """Yield each circle once, named from the criterion of it that comes first."""
    needs = {criterion.id: criterion.requires for criterion in criteria}
    places = {criterion.id: criterion.place for criterion in reversed(criteria)}
    told: set[frozenset[str]] = set()
    for name, place in sorted(places.items(), key=lambda item: item[1]):
        circle = _circle(name, needs)
        if circle and frozenset(circle) not in told:
            told.add(frozenset(circle))
            yield (*place, "requires"), "goes in a circle: " + " → ".join([*circle, name])


def _circle(start: str, needs: dict[str, list[str]]) -> list[str]:
    """Return the shortest way from `start` along `requires` back to itself; empty where there is none."""
    # Breadth first, and each criterion once: linear however many ways lead through the rubric.
    ways, seen = [[start]], {start}
    # `ways` grows while it is walked through.
    for way in ways:
        for name in needs.get(way[-1], ()):
            if name == start:
                return way
            if name not in seen:
                seen.add(name)
                ways.append([*way, name])
    return []


def _points(rubric: WrittenRubric) -> Iterator[Fault]:
    for criterion in rubric.criteria:
        given = [key for key in KINDS_OF_POINTS if criterion.data.get(key) is not None]
        if not given:
            yield (*criterion.place, "points"), "is missing (or bonus, or penalty)"
        elif len(given) > 1:
            fault = f"give one of points, bonus and penalty, not {' and '.join(given)}"
            yield (*criterion.place, given[1]), fault
        for key in ("bonus", "penalty"):
            extra = criterion.data.get(key)
            if is_number(extra) and extra > TOTAL_POINTS:
                yield (
                    (*criterion.place, key),
                    f"{extra:g} is more than the {TOTAL_POINTS} points of the rubric",
                )
    given_points = [criterion.data.get("points", 0) for criterion in rubric.criteria]
    ids = {criterion.id for criterion in rubric.criteria}
    if not all(is_number(points) and points >= 0 for points in given_points) or len(ids) < len(given_points):
        return  # what is wrong there is said, and the sum would be wrong only for that
    total = _total(rubric)
    # Thirds in floats do not add up exactly.
    if abs(total - TOTAL_POINTS) > 1e-6:
        yield (
            ("criteria",),
            f"the points add up to {total:.9g}, not to {TOTAL_POINTS}{_left_out(rubric, total)}",
        )
    mark = rubric.data.get("pass_mark")
    if is_number(mark) and 0 < mark < 1:
        yield ("pass_mark",), f"is in points, not a share: write {mark * TOTAL_POINTS:g}"
    if isinstance(mark, int | float) and mark > total:
        yield ("pass_mark",), f"{mark:g} is more than all the points, {total:g}"


def _left_out(rubric: WrittenRubric, total: float) -> str:
    """Return which criterion's points are too much, since no group counts them; "" where that is none, or not clear."""
    groups = as_map(rubric.data.get("groups")).values()
    grouped = {name for group in groups for _, name in as_texts(as_map(group).get("criteria"))}
    runs = {c.data.get("scenario") for c in rubric.criteria if c.id in grouped} - {None}
    left = [c for c in rubric.criteria if c.id not in grouped and c.data.get("scenario") in runs]
    over = [c.id for c in left if c.data.get("points", 0) == total - TOTAL_POINTS]
    return f': "{over[0]}" is in no group' if len(over) == 1 else ""


def _total(rubric: WrittenRubric) -> float:
    """Return the most points that can be reached: those of a group in place of its criteria's."""
    worth = {criterion.id: float(criterion.data.get("points", 0)) for criterion in rubric.criteria}
    total = 0.0
    for group in map(as_map, as_map(rubric.data.get("groups")).values()):
        # Taken out, so that what is left over are the criteria without a group.
        found = [worth.pop(name, 0.0) for _, name in as_texts(group.get("criteria"))]
        best, points = group.get("best"), group.get("points")
        counted = sum(found[:best] if isinstance(best, int) else found)
        total += points if isinstance(points, int | float) else counted
    return total + sum(worth.values())


def _groups(rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield faults of groups: a criterion is in one at most, and those of which the best count are worth the same."""
    known = {criterion.id: criterion.data for criterion in rubric.criteria}
    other: dict[str, str] = {}
    for name, group in as_map(rubric.data.get("groups")).items():
        members = as_texts(as_map(group).get("criteria"))
        for index, member in members:
            at = ("groups", name, "criteria", index)
            if member not in known:
                yield at, f'there is no criterion "{member}"{did_you_mean(member, known)}'
            elif member in other:
                yield at, f'"{member}" is in the group "{other[member]}" already'
            elif not known[member].get("points"):
                yield at, f'"{member}" has no points that a group could count'
            other.setdefault(member, name)
        found = [known[m] for _, m in members if m in known]
        yield from _best(("groups", name), as_map(group), found, rubric.data.get("digits", 1))


def _best(
    path: KeyPath, group: dict[str, Any], criteria: list[dict[str, Any]], digits: object
) -> Iterator[Fault]:
    best, points = group.get("best"), group.get("points")
    if not isinstance(best, int) or best < 1:
        return
    if best >= len(criteria) > 0:
        yield (*path, "best"), f"{best} of {len(criteria)} is all of them"
    if isinstance(points, int | float) and isinstance(digits, int):
        # Whole steps of the rubric's digits: whichever criteria are the best, each counts the same.
        share = points * 10.0**digits / best
        if abs(share - round(share)) > 1e-6:
            yield (*path, "points"), f"{points:g} points cannot be shared out evenly to the best {best}"
    for key, default in (("points", None), ("visibility", "visible")):
        if len({str(c.get(key, default)) for c in criteria}) > 1:
            yield (*path, "criteria"), f"need the same {key}, for only the best of them count"


def _gates(rubric: WrittenRubric) -> Iterator[Fault]:
    known, first = {criterion.id: criterion.data for criterion in rubric.criteria}, dict[str, int]()
    for index, gate in as_maps(rubric.data.get("gates")):
        name, at_most = gate.get("criterion"), gate.get("at_most")
        if first.setdefault(str(name), index) != index:
            yield ("gates", index, "criterion"), f'"{name}" is that of gates[{first[str(name)]}] already'
        if isinstance(name, str) and name not in known:
            near = did_you_mean(name, known)
            yield ("gates", index, "criterion"), f'there is no criterion "{name}"{near}'
        elif isinstance(name, str) and known[name].get("bonus") is not None:
            fault = f'"{name}" is a bonus, which no student has to reach: name a criterion with points'
            yield ("gates", index, "criterion"), fault
        elif isinstance(name, str) and known[name].get("visibility") == "hidden":
            fault = f'"{name}" is hidden: students could not see why points are missing'
            yield ("gates", index, "criterion"), fault
        if is_number(at_most) and 0 < at_most < 1:
            fault = f"is in points, not a share: write {at_most * TOTAL_POINTS:g}, or 0 for none"
            yield ("gates", index, "at_most"), fault
        if isinstance(at_most, int | float) and at_most >= TOTAL_POINTS:
            fault = f"{at_most:g} keeps nothing away: the rubric has {TOTAL_POINTS} points"
            yield ("gates", index, "at_most"), fault
        elif is_number(at_most) and at_most >= (left := _most_without(str(name), rubric)):
            fault = f"{at_most:g} keeps nothing away: without {name} there are {left:g} points at most"
            yield ("gates", index, "at_most"), fault


def _most_without(name: str, rubric: WrittenRubric) -> float:
    """Return how many points there are without a criterion; all of them where its own are not known."""
    in_groups = {
        one
        for group in as_map(rubric.data.get("groups")).values()
        for one in as_list(as_map(group).get("criteria"))
    }
    bonus: float = sum(one.data["bonus"] for one in rubric.criteria if is_number(one.data.get("bonus")))
    own = [one.data.get("points") for one in rubric.criteria if one.id == name and name not in in_groups]
    return TOTAL_POINTS + bonus - (own[0] if own and is_number(own[0]) else 0)


def _late(rubric: WrittenRubric) -> Iterator[Fault]:
    late = as_map(rubric.data.get("late"))
    if late and rubric.data.get("deadline") is None:
        yield ("late",), "needs a deadline: deadline: 2026-11-20T23:59:00+01:00"
    for key in ("lost", "cap"):
        if is_number(late.get(key)) and 0 < late[key] < 1:
            yield ("late", key), f"is in percent, not a share: write {late[key] * 100:g}"
    grace, cut_off = late.get("grace_minutes"), late.get("cut_off_days")
    if isinstance(grace, int | float) and isinstance(cut_off, int | float) and grace > cut_off * 24 * 60:
        fault = f"is longer than cut_off_days, after which nothing counts: {cut_off:g}"
        yield ("late", "grace_minutes"), fault


def scenario_faults(path: KeyPath, scenario: dict[str, Any]) -> Iterator[Fault]:
    """Yield every fault of one scenario that its record's types cannot say."""
    if "warp" in scenario and scenario.get("clock", "real") == "real":
        yield (*path, "warp"), 'only a scenario with "clock: warped" has a warp'
    yield from _means(path, scenario)
    yield from _starts(path, scenario)
    yield from _params(path, scenario)
    yield from _probes(path, scenario)
    types: dict[str, str] = {}
    for index, call in as_maps(scenario.get("calls")):
        yield from slash((*path, "calls", index, "service"), call.get("service"), "a service")
        yield from call_faults((*path, "calls", index), call, types)
    yield from served_faults(path, scenario)
    yield from step_faults(path, scenario)
    yield from _until((*path, "until"), as_map(scenario.get("until")), scenario)


def _means(path: KeyPath, scenario: dict[str, Any]) -> Iterator[Fault]:
    """Yield keys that are missing or too much: a scenario starts something and says until when, or it names a recording
    and nothing else."""
    if scenario.get("recording") is None:
        if scenario.get("start") in (None, []):
            yield (*path, "start"), "is missing: give start, or recording"
        elif "until" not in scenario and not (scenario.get("steps") or _has_tests(scenario)):
            yield (*path, "until"), "is missing"
        return
    for key in (
        *("start", "params", "probes", "calls", "serves", "steps"),
        *("until", "keeps", "clock", "warp"),
    ):
        if key in scenario:
            yield (*path, key), "is not for a scenario with a recording: nothing is run"


def _has_tests(scenario: dict[str, Any]) -> bool:
    """Return whether it has tests, until whose end it lasts."""
    return any(
        start.get("tests") is not None or str(start.get("program")).endswith(ROSTEST_ENDING)
        for start in starts_of(scenario)
    )


def _starts(path: KeyPath, scenario: dict[str, Any]) -> Iterator[Fault]:
    names: list[str] = []
    for index, start in as_maps(scenario.get("start")):
        at = (*path, "start", index)
        given = [key for key in KINDS_OF_START if start.get(key) not in (None, False)]
        if len(given) != 1:
            yield at, give_one(KINDS_OF_START, given)
        name, after = start.get("name"), start.get("after")
        if isinstance(after, str) and after not in names:
            yield (*at, "after"), f'there is no earlier start "{after}"{did_you_mean(after, names)}'
        if isinstance(name, str) and name in names:
            yield (*at, "name"), f'"{name}" is another start\'s name already'
        names.append(str(name))


def _params(path: KeyPath, scenario: dict[str, Any]) -> Iterator[Fault]:
    first: dict[str, int] = {}
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
        if isinstance(name := param.get("name"), str) and first.setdefault(name.strip("/"), index) != index:
            yield (*at, "name"), f"{name} is set by params[{first[name.strip('/')]}] already"
        yield from private((*at, "name"), param.get("name"))
        if not str(param.get("name")).startswith("~"):
            yield from slash((*at, "name"), param.get("name"), "a parameter")
        if named and not of_file and param.get("also"):
            yield (*at, "also"), "is for a file: names that it may lack"


def _probes(path: KeyPath, scenario: dict[str, Any]) -> Iterator[Fault]:
    for index, probe in as_maps(scenario.get("probes")):
        at = (*path, "probes", index)
        if not any(probe.get(key) for key in ("text", "integers", "among", "values")):
            yield at, "sends nothing: give text, integers, among or values"
        if probe.get("times", 1) != 1 and not probe.get("values"):
            yield (*at, "times"), "is for values"
        yield from slash((*at, "topic"), probe.get("topic"), "a topic")
        kind = probe.get("type")
        if isinstance(kind, str) and "/" in kind:
            yield from _contents(at, probe, kind)


def _contents(at: KeyPath, probe: dict[str, Any], kind: str) -> Iterator[Fault]:
    """Yield the faults of what is sent: it has to fit the type."""
    try:
        definition(kind)
    except ValueError as error:
        known = [f"{package}/{name}" for package, names in noetic_messages().items() for name in names]
        yield (*at, "type"), f"{error}{did_you_mean(kind, known)}"
        return
    yield from _misfits(at, kind, list(enumerate(as_list(probe.get("values")))))
    if probe.get("text") and kind != STRING:
        yield (*at, "text"), f"is not for {kind}"
    limits = integer_limits(kind)
    for key in ("integers", "among"):
        if probe.get(key) and limits is None:
            yield (*at, key), f"is not for {kind}"
    low, high = limits or (-math.inf, math.inf)
    for position, value in enumerate(as_list(probe.get("among"))):
        if isinstance(value, int) and not low <= value <= high:
            yield (*at, "among", position), f"an {kind.partition('/')[2]} holds {low} to {high}, not {value}"


def _misfits(at: KeyPath, kind: str, values: list[tuple[int, Any]]) -> Iterator[Fault]:
    def misfit(work: Callable[[], object]) -> str:
        try:
            work()
        except ValueError as error:
            return str(error)
        return ""

    for position, value in values:
        if empty := empty_in(value):
            yield (*at, "values", position), f"{empty} is empty: give it a value"
            continue
        fields = value if isinstance(value, dict) else {"data": value}
        if wrong := misfit(lambda fields=fields: encode(kind, fields)):  # type: ignore[misc]
            yield (*at, "values", position), wrong


def _until(path: KeyPath, until: dict[str, Any], scenario: dict[str, Any]) -> Iterator[Fault]:
    for key in ("topics", "connected"):
        for index, topic in as_texts(until.get(key)):
            yield from slash((*path, key, index), topic, "a topic")
    for topic, count in as_map(until.get("messages")).items():
        yield from slash((*path, "messages", topic), topic, "a topic")
        if isinstance(count, int) and count < 1:
            yield (*path, "messages", topic), f"must be at least 1, not {count}"
    if until.get("heard") is True and not (scenario.get("probes") or given_steps(scenario, "publish")):
        yield (*path, "heard"), "needs probes or steps that publish: there is nothing to hear"
    for index, name in as_texts(until.get("opened")):
        if name.startswith("/"):
            fault = f"is for programs that are asked to open something, like firefox: write messages: {{{name}: 1}}"
            yield (*path, "opened", index), fault
    names = [str(start.get("name")) for start in starts_of(scenario)]
    for index, name in as_texts(until.get("ended")):
        if name not in names:
            yield (*path, "ended", index), f'there is no start "{name}"{did_you_mean(name, names)}'
    yield from _lasting(path, until, scenario)


def _lasting(path: KeyPath, until: dict[str, Any], scenario: dict[str, Any]) -> Iterator[Fault]:
    """Yield times of a run that can never pass, and a window without topics."""
    if is_number(until.get("window_s")) and not until.get("topics"):
        yield (*path, "window_s"), "is for the topics of topics, and there are none"
    if until.get("topics") and until.get("window_s") is None:
        yield (*path, "topics"), "are those of window_s, which is missing"
    limit_s = until.get("limit_s", 60.0)
    if limit_s == 0 and not (scenario.get("steps") and len(until) == 1):
        yield (*path, "limit_s"), "with 0 the run is over as soon as it is set up: give it some seconds"
    for key in ("window_s", "alive_s", "quiet_s"):
        value_s = until.get(key)
        if isinstance(value_s, int | float) and isinstance(limit_s, int | float) and value_s >= limit_s > 0:
            yield (*path, key), f"{value_s:g} s can never pass within limit_s, {limit_s:g} s"
