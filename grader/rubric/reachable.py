"""What a criterion asks for and no run of its scenario can show: messages, values and places that never come, and
demands of which one excludes the other."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

from pydantic import ValidationError

from grader.checks.registry import Check
from grader.checks.support.conditions import Condition
from grader.checks.support.fields import PATH_PARTS, Reading, is_number
from grader.rubric.definitions import TooShort, sent_in_turn, values_at
from grader.rubric.durations import (
    answer_faults,
    early_faults,
    late_faults,
    longest_s,
    often_faults,
    stretch_faults,
    until_next_s,
    until_of,
    warp_of,
    within_faults,
)
from grader.rubric.simulators import (
    FIELD_M,
    PROGRAMS,
    TRUE_POSE,
    Spot,
    pair,
    robot_of,
    room_faults,
    start_faults,
)
from grader.rubric.step_faults import wait_faults
from grader.rubric.yaml_lines import (
    Fault,
    KeyPath,
    WrittenCriterion,
    WrittenRubric,
    as_list,
    as_map,
    given_steps,
    parts_of,
    published_in,
    starts_of,
)
from grader.wording import plural

WRAPS = {"minimum": 0, "maximum": 127, "wraps": 2}
"""Of `counter-wrap`, with their defaults."""
STEPS = 10
"""The default of `min_steps` of `counter-step`."""
LIVES_S = 5.0
"""The default of `min_s` of `node-lives`."""
MANY = 3
"""A recording may hold so many times the messages that a scenario waits for, as it is closed a little later."""
FEWEST = 2
"""Of fewer messages than these, nobody sees a rate."""
POSITIONS = ("", "pose", "position", "point", "pose.position", "pose.pose.position")
"""Where in messages `x` and `y` are."""


def reach_faults(rubric: WrittenRubric, checks: Mapping[str, Check]) -> Iterator[Fault]:
    """Yield what the runs of a rubric's scenarios cannot show."""
    criteria = rubric.criteria
    yield from _too_many(rubric, checks)
    yield from _too_few(criteria)
    yield from _too_many_nodes(rubric)
    yield from late_faults(rubric.scenarios)
    yield from wait_faults(rubric)
    for name, scenario in rubric.scenarios.items():
        yield from start_faults(("scenarios", name), scenario)
    watched = {
        one.run
        for one in criteria
        if (check := checks.get(one.check))
        and any(ref.to == "watched_s" for ref in check.references(one.given))
    }
    for about in criteria:
        others = [one for one in criteria if one is not about and one.run == about.run]
        yield from often_faults(about)
        yield from within_faults(about)
        yield from answer_faults(about)
        if about.run not in watched:
            yield from early_faults(about)
        yield from stretch_faults(about, _watched_s(about, others))
        yield from room_faults(about, longest_s(about.scenario))
        yield from _never_sent(about, others)
        if about.check in {"ends-at", "path", "stays-within"}:
            yield from _too_far(about, others)
    yield from _contradictions(criteria)
    yield from _other_effects(criteria)
    yield from _answers_too_early(criteria)
    yield from _other_ends(criteria)


def _watched_s(about: WrittenCriterion, others: Sequence[WrittenCriterion]) -> float:
    """Return how long the criteria on a run ask that its nodes are watched, where they do."""
    lives = [one.given.get("min_s", LIVES_S) for one in others if one.check == "node-lives"]
    return max((one for one in lives if is_number(one)), default=0.0) if about.check == "reacts" else 0.0


def _too_many(rubric: WrittenRubric, checks: Mapping[str, Check]) -> Iterator[Fault]:
    """Yield counts of messages that cannot come before the run's limit, at the rate that a criterion asks for."""
    rates: dict[str, float] = {}
    for criterion in rubric.criteria:
        given, check = criterion.given, checks.get(criterion.check)
        topic, rate_hz = given.get("topic"), given.get("rate_hz")
        of_rate = check is not None and hasattr(check.params, "rate_bounds")
        if of_rate and isinstance(rate_hz, int | float) and rate_hz > 0:
            rates[str(topic)] = max(rates.get(str(topic), 0), float(rate_hz))
    for name, scenario in rubric.scenarios.items():
        limit_s, warp = until_of(scenario, "limit_s"), warp_of(scenario)
        for topic, count in as_map(as_map(scenario.get("until")).get("messages")).items():
            if not all(map(is_number, (limit_s, warp, count))) or topic not in rates or warp <= 0:
                continue
            takes_s = count / rates[topic] / warp
            if takes_s > limit_s:
                fault = f"{count} messages at {rates[topic]:g} Hz take {takes_s:.3g} s, and limit_s is {limit_s:g} s"
                yield ("scenarios", name, "until", "messages", topic), fault


def _too_many_nodes(rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield counts of nodes that a run's scripts, each of which is one node, never are."""
    for name, scenario in rubric.scenarios.items():
        nodes, starts = as_map(scenario.get("until")).get("nodes"), starts_of(scenario)
        scripts = [start for start in starts if start.get("script") is not None]
        # A launch file, or an unknown program, may start any number of nodes.
        of_scripts = all(start.get("script") or str(start.get("program")) in PROGRAMS for start in starts)
        if isinstance(nodes, int) and of_scripts and starts and nodes > len(scripts):
            fault = f"{name} starts {plural(len(scripts), 'script')} of the student's, and each is one node"
            yield ("scenarios", name, "until", "nodes"), fault


def _too_few(criteria: Sequence[WrittenCriterion]) -> Iterator[Fault]:
    """Yield wraps, recordings and rates that a scenario with so few messages cannot show."""
    for criterion in criteria:
        name, path = criterion.run, criterion.at
        given, until = criterion.given, as_map(criterion.scenario.get("until"))
        # With such a condition a run goes on after these messages.
        counts = {} if {"window_s", "alive_s", "quiet_s"} & until.keys() else as_map(until.get("messages"))
        if criterion.check == "counter-wrap":
            least, most, wraps = (given.get(key, default) for key, default in WRAPS.items())
            count = counts.get(str(given.get("topic")))
            numbers = all(isinstance(n, int) for n in (least, most, wraps, count))
            if numbers and count < (needed := wraps * (most - least + 1) + 1):
                fault = f"{name} ends after {count} messages, and {plural(wraps, 'wrap')} take {needed}"
                yield (*path, "wraps"), fault
        for topic, left in as_map(given.get("topics")).items():
            count, least = counts.get(topic), as_map(left).get("at_least")
            if isinstance(count, int) and isinstance(least, int) and least > MANY * count:
                yield (*path, "topics", topic, "at_least"), f"{name} ends after {count} messages on {topic}"
        window_s, rate_hz = until.get("window_s"), given.get("rate_hz")
        if not is_number(window_s) or not is_number(rate_hz):
            continue
        steps = given.get("min_steps", STEPS)
        if criterion.check == "counter-step" and is_number(steps) and 0 < window_s * rate_hz < steps:
            takes = f"at {rate_hz:g} Hz {plural(steps, 'step')} take {steps / rate_hz:g} s"
            yield (*path, "rate_hz"), f"{takes}, and window_s is {window_s:g} s"
        if criterion.check == "rate" and 0 < window_s * rate_hz < FEWEST:
            each = f"at {rate_hz:g} Hz a message comes each {1 / rate_hz:g} s, and window_s is {window_s:g} s"
            yield (*path, "rate_hz"), f"{each}: it is messages a second"


def _sent_on(topic: str, scenario: dict[str, Any]) -> list[Any] | None:
    """Return all that is sent on a topic, or asked of a service; None where something else may be."""
    sent = [one for one in published_in(scenario) if one.get("topic") == topic]
    if "recording" in scenario or given_steps(scenario, "play"):
        return None
    # These are made up when the run begins.
    if any(one.get(key) for one in sent for key in ("text", "integers", "among")):
        return None
    values = [value for one in sent for value in sent_in_turn(one)]
    calls = [one for _, kind, one in parts_of(scenario) if kind == "call" and one.get("service") == topic]
    values += [as_map(one.get("request")) for one in calls]
    return [value if isinstance(value, dict) else {"data": value} for value in values]


def _never_sent(about: WrittenCriterion, others: Sequence[WrittenCriterion]) -> Iterator[Fault]:
    """Yield items that no list has which the grader sends, and causes of which none is ever sent."""
    for key, asked in (("", about.given), ("cause", as_map(about.given.get("cause")))):
        topic, field = asked.get("topic"), asked.get("field")
        at = (*about.at, key) if key else about.at
        if not isinstance(topic, str) or not isinstance(field, str):
            continue
        parts = PATH_PARTS.findall(field)
        yield from (((*at, "field"), fault) for fault in _past_the_end(topic, parts, field, about.scenario))
        sent = _sent_on(topic, about.scenario)
        # The student's node may send there as well, and then something else comes. What is heard, the grader sends.
        if not sent or any(one.given.get("topic") == topic and one.check != "hears" for one in others):
            continue
        lengths = [_length(value, parts) for value in sent]
        found = [values_at(one, parts) if n is None else [] for one, n in zip(sent, lengths, strict=True)]
        # Each list is too short, not only some: a longer one may be the one that is meant.
        if None not in lengths:
            most = plural(max(n for n in lengths if n is not None), "item")
            yield (*at, "field"), f"what {about.run} sends on {topic} has {most} there, counted from 0"
            continue
        cause = _condition(asked) if key == "cause" and None not in found else None
        plain = all(is_number(one) for values in found for one in values or ())
        if cause and plain and not any(cause.holds(Reading(0, tuple(values or ()), "")) for values in found):
            yield at, f"nothing that {about.run} sends on {topic} is so: {cause.words}"


def _length(value: object, parts: Sequence[str]) -> int | None:
    """Return how many items a list has that is too short; None where it is long enough."""
    try:
        values_at(value, parts)
    except TooShort as error:
        return int(error.args[0])
    return None


def _past_the_end(topic: str, parts: Sequence[str], field: str, scenario: dict[str, Any]) -> Iterator[str]:
    """Yield an item that the scans of the robot world do not have."""
    samples = robot_of(scenario).get("samples")
    if topic not in {"/scan", "/base_scan"} or len(parts) < 2 or parts[0] != "ranges" or parts[1] == "[*]":
        return
    if is_number(samples) and int(parts[1][1:-1]) >= samples:
        yield f"the robot's scans have {samples} ranges, counted from 0: {field} is none of them"


def _condition(asked: dict[str, Any]) -> Condition | None:
    try:
        return Condition.model_validate(asked)
    except ValidationError:  # said elsewhere
        return None


def _spot(value: object) -> Spot | None:
    return (
        (value[0], value[1])
        if isinstance(value, list | tuple) and len(value) >= 2 and all(map(is_number, value))
        else None
    )


def _asked_spots(topic: object, scenario: dict[str, Any]) -> list[Spot | None]:
    """Return the places for which the messages on a topic ask, in their order; None for one without a place."""
    spots: list[Spot | None] = []
    for one in given_steps(scenario, "publish"):
        if one.get("topic") != topic:
            continue
        if {"count", "duration_s", "background", "values"} & one.keys():
            return []
        spots.append(_place_in(one.get("value")))
    return spots


def _place_in(value: object) -> Spot | None:
    for where in POSITIONS:
        inside = as_map(value)
        for key in where.split(".") if where else ():
            inside = as_map(inside.get(key))
        if "x" in inside and "y" in inside:
            return _spot([inside["x"], inside["y"]])
    return None


class _Robot(NamedTuple):
    """Where a robot starts, how fast it is, and how far its field reaches, where that is known."""

    start: Spot | None
    fastest_m_s: float | None = None
    field_m: float | None = None


def _robot(about: WrittenCriterion, others: Sequence[WrittenCriterion]) -> _Robot:
    topic = str(about.given.get("topic"))
    if world := robot_of(about.scenario):
        fastest = world.get("max_linear")
        start = _spot(world.get("start"))
        return _Robot(start if topic == TRUE_POSE else (0, 0), fastest if is_number(fastest) else None)
    if not topic.startswith("/turtle1/"):
        return _Robot(None)
    bounds = [one.given for one in others if one.check == "field-bounds"]
    speeds = [b["max"] for b in bounds if b.get("topic") == "/turtle1/cmd_vel" and b.get("field") == "linear.x"
              and is_number(b.get("max"))]  # fmt: skip
    is_moved = "calls" in about.scenario or given_steps(about.scenario, "call")
    # turtlesim puts its first turtle in the middle, and a service may put it anywhere.
    middle = None if is_moved else (FIELD_M / 2, FIELD_M / 2)
    return _Robot(middle, min(speeds, default=None), FIELD_M if topic == "/turtle1/pose" else None)


def _too_far(about: WrittenCriterion, others: Sequence[WrittenCriterion]) -> Iterator[Fault]:
    """Yield places that the robot of the scenario cannot come to."""
    given, robot, most_s = about.given, _robot(about, others), longest_s(about.scenario)
    farthest_m = robot.fastest_m_s * most_s if robot.fastest_m_s and most_s else math.inf
    limit = f"{most_s or 0:g} s at {robot.fastest_m_s or 0:g} m/s are {farthest_m:.3g} m"
    least_m, tolerance_m = given.get("least_m"), given.get("tolerance_m")
    if about.check == "stays-within":
        if is_number(least_m) and least_m > farthest_m:
            yield (*about.at, "least_m"), f"it cannot come so far: {limit}"
        return
    if not is_number(tolerance_m):
        return
    if about.check == "ends-at":
        yield from _goal_faults(about, others, robot, farthest_m, limit)
        return
    way = [spot for point in as_list(given.get("points")) if (spot := _spot(point))]
    relative = given.get("relative", True)
    length_m = sum(math.dist(a, b) for a, b in pairwise(way))
    # A robot may cut each corner by the tolerance, on its way to it and away from it.
    if length_m - 2 * tolerance_m * len(way) > farthest_m:
        yield (*about.at, "points"), f"it cannot come so far: the way is {length_m:.3g} m, and {limit}"
    shift = (robot.start or (0, 0)) if relative else (0, 0)
    if robot.field_m is not None and (robot.start or not relative):
        for number, (x, y) in enumerate(way):
            if not _is_inside((x + shift[0], y + shift[1]), robot.field_m, tolerance_m):
                yield (*about.at, "points", number), _outside(x + shift[0], y + shift[1])


def _is_inside(spot: Spot, field_m: float, tolerance_m: float) -> bool:
    return all(-tolerance_m <= one <= field_m + tolerance_m for one in spot)


def _outside(x: float, y: float) -> str:
    return f"({x:g}, {y:g}) is outside of the turtle's field, which is {FIELD_M:g} m long on each side"


def _goal_faults(
    about: WrittenCriterion, others: Sequence[WrittenCriterion], robot: _Robot, farthest_m: float, limit: str
) -> Iterator[Fault]:
    given, goal, tolerance_m = about.given, _spot(about.given.get("goal")), about.given["tolerance_m"]
    number = given.get("number", 1)
    if goal is None or given.get("relative") is True or tolerance_m < 0:
        return
    at = (*about.at, "goal")
    asked = _asked_spots(given.get("asked_on"), about.scenario)
    start = robot.start if number == 1 or "asked_on" not in given else None
    if isinstance(number, int) and 0 < number <= len(asked):
        start = asked[number - 2] if number > 1 else start
        meant = asked[number - 1]
        if meant is not None and math.dist(meant, goal) > tolerance_m:
            yield at, f"message {number} on {given['asked_on']} asks for {pair(meant)}, not {pair(goal)}"
            return
    if robot.field_m is not None and not _is_inside(goal, robot.field_m, tolerance_m):
        yield at, _outside(*goal)
        return
    if fault := _not_last(about, others, goal):
        yield at, fault
        return
    # It may start as far off as it may end.
    away_m = math.dist(start, goal) - 2 * tolerance_m if start else 0
    if away_m > farthest_m:
        yield at, f"it cannot come so far: {limit}"
    elif start and robot.fastest_m_s:
        yield from _too_soon(about, robot.fastest_m_s, away_m, f"{away_m:.3g} m from {pair(start)}")
    for one in others:
        kept, corners = one.given, [_spot(corner) for corner in as_list(one.given.get("box"))]
        is_kept = one.check == "stays-within" and kept.get("topic") == given.get("topic")
        is_always = kept.get("share", 1) == 1 and not kept.get("from_s") and not kept.get("relative")
        if is_kept and is_always and len(corners) == 2 and not _is_between(goal, corners, tolerance_m):
            yield at, f"is outside of the box that {one.id} keeps it in"


def _too_soon(about: WrittenCriterion, fastest_m_s: float, away_m: float, way: str) -> Iterator[Fault]:
    """Yield a goal that the robot cannot come to before the next one is asked for, or within the time."""
    within_s, topic = about.given.get("within_s"), about.given.get("asked_on")
    until_s = until_next_s(topic, about.given.get("number", 1), about.scenario)
    needed = f"{way} at {fastest_m_s:g} m/s take longer than"
    if until_s is not None and away_m > fastest_m_s * until_s:
        after = f"the {until_s:g} s until the next message on {topic}"
        yield (*about.at, "goal"), f"{needed} {after} asks for another place"
    elif is_number(within_s) and away_m > fastest_m_s * within_s:
        yield (*about.at, "within_s"), f"{needed} {within_s:g} s"


def _is_between(spot: Spot, corners: Sequence[Spot | None], tolerance_m: float) -> bool:
    """Return whether a spot is in a box, or so near to it; it is where a corner is none."""
    one, other = (corner or spot for corner in corners)
    return all(
        min(a, b) - tolerance_m <= at <= max(a, b) + tolerance_m
        for at, a, b in zip(spot, one, other, strict=True)
    )


def _not_last(about: WrittenCriterion, others: Sequence[WrittenCriterion], goal: Spot) -> str:
    """Return that the robot is judged at the end of the run, and its last goal is another; empty where it may be this
    one."""
    topics = {one.given.get("asked_on") for one in others if one.check == about.check}
    spots = {topic: _asked_spots(topic, about.scenario) for topic in topics if isinstance(topic, str)}
    last = {topic: found[-1] for topic, found in spots.items() if found and found[-1] is not None}
    if about.given.get("asked_on") is not None or not last:
        return ""
    if any(math.dist(spot, goal) <= about.given["tolerance_m"] for spot in last.values() if spot):
        return ""
    topic, spot = next(iter(last.items()))
    asks = f"the last message on {topic} asks for {pair(spot or goal)}"
    return f"without asked_on this is where the run ends, and {asks}: write asked_on: {topic}, with number"


def _other_effects(criteria: Sequence[WrittenCriterion]) -> Iterator[Fault]:
    """Yield causes that one message shows together with the cause of an earlier criterion, which wants another effect
    of it."""
    before: list[tuple[str, str, dict[str, Any]]] = []
    for criterion in criteria:
        given, name = criterion.given, criterion.run
        if criterion.check != "reacts" or given.get("never") is True:
            continue
        for run, earlier, other in before:
            causes, effects = ([as_map(g.get(key)) for g in (given, other)] for key in ("cause", "effect"))
            shown = _shown_by_both(causes[0], causes[1], criterion.scenario)
            if run == name and _differ(effects[0], effects[1]) and (number := next(shown, 0)):
                message = f"message {number} that {name} sends on {causes[0].get('topic')}"
                fault = f"{message} is a cause for {earlier} too, which wants another effect"
                yield (*criterion.at, "cause"), fault
        before.append((name, criterion.id, given))


def _answers_too_early(criteria: Sequence[WrittenCriterion]) -> Iterator[Fault]:
    """Yield causes that are true before that of another criterion, which wants silence until then on the topic of the
    effect."""
    asked = [one for one in criteria if one.check == "reacts" and one.given.get("never") is not True]
    for silent in asked:
        first, cause = _first_so(silent), as_map(silent.given.get("cause"))
        topic, others = (
            as_map(silent.given.get("effect")).get("topic"),
            [one for one in asked if one is not silent],
        )
        is_any = as_map(silent.given.get("effect")).keys() == {"topic"}
        if first < 1 or not is_any or silent.given.get("not_before") is False:
            continue
        for one in others:
            early, its_cause = _first_so(one), as_map(one.given.get("cause"))
            its_topic = as_map(one.given.get("effect")).get("topic")
            if one.run != silent.run or its_topic != topic or its_cause.get("topic") != cause.get("topic"):
                continue
            if 0 <= early < first:
                told = f"value {early + 1} that {one.run} sends on {cause.get('topic')} is a cause already"
                until = f"{silent.id} wants nothing on {topic} before value {first + 1}"
                yield (*one.at, "cause"), f"{told}, and {until}: ask for one of them in another run"


def _first_so(criterion: WrittenCriterion) -> int:
    """Return the number, from 0, of the first message that a run sends and that is a cause; -1 for none."""
    cause = as_map(criterion.given.get("cause"))
    sent = _sent_on(str(cause.get("topic")), criterion.scenario) or ()
    return next((n for n, value in enumerate(sent) if _is_so(cause, value)), -1)


def _differ(effect: dict[str, Any], other: dict[str, Any]) -> bool:
    """Return whether no message has both effects."""
    if any(effect.get(key) != other.get(key) for key in ("topic", "field")):
        return False
    every = [next(_demands("reacts", one), None) for one in (effect, other)]
    demands = [one._replace(every=True) for one in every if one is not None]
    return len(demands) == 2 and demands[0].excludes(demands[1])


def _shown_by_both(cause: dict[str, Any], other: dict[str, Any], scenario: dict[str, Any]) -> Iterator[int]:
    """Yield the numbers of the messages that the scenario sends and of which both causes are true."""
    if cause.get("topic") != other.get("topic"):
        return
    for number, value in enumerate(_sent_on(str(cause.get("topic")), scenario) or (), 1):
        if all(_is_so(one, value) for one in (cause, other)):
            yield number


def _is_so(cause: dict[str, Any], value: object) -> bool:
    """Return whether a cause is true of a message that is sent, where that is known."""
    condition, parts = _condition(cause), PATH_PARTS.findall(str(cause.get("field")))
    if condition is None or "field" not in cause or _length(value, parts) is not None:
        return False
    found = values_at(value, parts)
    return (
        bool(found)
        and all(map(is_number, found or ()))
        and condition.holds(Reading(0, tuple(found or ()), ""))
    )


def _other_ends(criteria: Sequence[WrittenCriterion]) -> Iterator[Fault]:
    """Yield goals of actions for which an earlier criterion wants another status, or another result."""
    before: dict[tuple[str, ...], tuple[str, dict[str, Any]]] = {}
    for criterion in criteria:
        given = criterion.given
        is_of_end = not given.keys() <= {"action", "goal", "feedback", "reports", "tolerance"}
        if criterion.check != "action-result" or not is_of_end:
            continue
        key = tuple(map(str, (criterion.run, given.get("action"), given.get("goal", 1))))
        earlier, other = before.setdefault(key, (criterion.id, given))
        status, other_status = (one.get("status", "SUCCEEDED") for one in (given, other))
        if status != other_status:
            fault = (
                f"{earlier} wants this goal, number {key[2]}, {other_status}: give one of them another goal"
            )
            yield (*criterion.at, "status" if "status" in given else "goal"), fault


class _Demand(NamedTuple):
    """Between which values a criterion wants a field, or which word or truth value, in every message or in some."""

    low: float
    high: float
    every: bool
    word: str | bool | tuple[Any, ...] | None = None
    is_cause: bool = False
    when: str = ""
    """Which one message it is about, the `first` or the `last`."""

    def excludes(self, other: _Demand) -> bool:
        """Return whether no messages satisfy both demands."""
        # Each may hold of another message.
        if not (self.every or other.every or (self.when and self.when == other.when)):
            return False
        if self.word is None or other.word is None:
            # Both are about numbers: a number and a word are told by their type elsewhere.
            return self.word is other.word and (self.low > other.high or self.high < other.low)
        if isinstance(self.word, tuple) and isinstance(other.word, tuple):
            return not _may_be_equal(self.word, other.word, (self.high, other.high))
        return type(self.word) is type(other.word) and self.word != other.word


def _may_be_equal(one: tuple[Any, ...], other: tuple[Any, ...], tolerances: Spot) -> bool:
    """Return whether a list may be both of these; of what is no number, nothing is said."""
    if len(one) != len(other):
        return False
    pairs = [(a, b) for a, b in zip(one, other, strict=True) if is_number(a) and is_number(b)]
    return all(abs(a - b) <= sum(tolerances) for a, b in pairs)


def _contradictions(criteria: Sequence[WrittenCriterion]) -> Iterator[Fault]:
    """Yield criteria that no run passes which passes an earlier one."""
    before: dict[tuple[str, ...], list[tuple[str, _Demand]]] = {}
    for criterion in criteria:
        for part, asked, demand in _demanded(criterion):
            at = (*criterion.at, *part)
            of = asked.get("of", "student")
            key = tuple(map(str, (criterion.run, asked.get("topic"), asked.get("field"), of)))
            for earlier, other in before.get(key, ()):
                if demand.excludes(other):
                    wants = f"{earlier} wants {asked.get('field')} of {asked.get('topic')} otherwise in the same run"
                    both = (demand.every and other.every) or demand.when == other.when != ""
                    yield at, wants if both else f"{wants}: {_way_out(demand, other)}"
            before.setdefault(key, []).append((criterion.id, demand))


def _way_out(*demands: _Demand) -> str:
    is_cause = any(demand.is_cause for demand in demands)
    return "so the cause never comes" if is_cause else "give one of them when: first, last or any"


def _demanded(criterion: WrittenCriterion) -> Iterator[tuple[KeyPath, dict[str, Any], _Demand]]:
    """Yield what a criterion wants of a run's messages: where it says so, its parameters there, and the demand.

    A cause is one where the grader sends none on its topic: the student's node has to.
    """
    given, check = criterion.given, criterion.check
    if "scenario" not in criterion.data:
        return
    parts: list[tuple[KeyPath, dict[str, Any]]] = [((), given)]
    if check == "reacts":
        wanted = ("cause",) if given.get("never") is True else ("cause", "effect")
        parts = [((key,), as_map(given.get(key))) for key in wanted]
    for part, asked in parts:
        # A cause that the grader sends is no demand on the student's node.
        if part != ("cause",) or _sent_on(str(asked.get("topic")), criterion.scenario) == []:
            is_cause = part == ("cause",)
            yield from ((part, asked, one._replace(is_cause=is_cause)) for one in _demands(check, asked))


def _demands(check: str, asked: dict[str, Any]) -> Iterator[_Demand]:
    low, high, value = asked.get("min", -math.inf), asked.get("max", math.inf), asked.get("value")
    tolerance = asked.get("tolerance", 0)
    every = check == "field-bounds" and asked.get("share", 1) == 1
    is_one = check == "field-equals" and asked.get("when") in ("first", "last")
    when = str(asked.get("when")) if is_one else ""
    if check == "field-equals":
        every = asked.get("when", "every") == "every" and "values" not in asked
    elif check not in {"field-bounds", "reacts"} or asked.get("items") == "any":
        return
    if is_number(tolerance) and "field" in asked:
        for one in as_list(asked.get("values")) if "values" in asked else [value]:
            if is_number(one):
                yield _Demand(one - tolerance, one + tolerance, every, when=when)
            elif isinstance(one, str | bool):
                yield _Demand(0, 0, every, one, when=when)
            elif isinstance(one, list) and check == "field-equals":
                yield _Demand(0, tolerance, every, tuple(one), when=when)
    if value is None and is_number(low) and is_number(high) and check != "field-equals":
        yield _Demand(low, high, every)
