"""Warnings of a criterion's values: those that another part of the rubric has in their place, and velocities that a
robot cannot have."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator
from pathlib import PurePosixPath
from typing import Any

from grader.checks.support.fields import is_number
from grader.rubric.message_fields import types_of
from grader.rubric.simulators import robot_of
from grader.rubric.yaml_lines import (
    Fault,
    KeyPath,
    WrittenCriterion,
    WrittenRubric,
    as_list,
    as_map,
    as_maps,
    given_steps,
    numbers_in,
    published_in,
    services_in,
    set_in,
    starts_of,
)
from grader.wording import join_words

SIDEWAYS = frozenset({"linear.y", "linear.z", "angular.x", "angular.y"})
"""The parts of a velocity that a robot with two wheels does not have."""
OTHER_WAYS = re.compile(
    r"\b(?:side\w*|strafe\w*|lateral\w*|holonomic\w*|omni\w*|mecanum|left|right|up|down|climb\w*|rise\w*|hover\w*|fl(?:y|ies)\w*"
    r"|drone|\w*copter|quad\w*|rotors?|uav|[ar]ov|boat|submarine|take\w*\Woff|legs?|legged|arm|roll|pitch|tilt\w*"
    r"|altitude|height|linear\.[yz]|angular\.[xy]|y)\b",
    re.IGNORECASE,
)
"""Words of a handout about a robot that may move otherwise."""
STANDS = 0.05
"""Bounds of a velocity as near to 0 as these ask for one that is 0."""
FORMS = frozenset({"from", "each", "repeat", "text", "integers"})
"""Keys of values that are no fields."""
PLAIN = frozenset({0.0, 1.0})
"""These are in many requests and answers, by chance."""
RANGES = {
    ("sensor_msgs/BatteryState", "percentage"): (0, 1),
    ("sensor_msgs/BatteryState", "power_supply_status"): (0, 4),
    ("sensor_msgs/BatteryState", "power_supply_health"): (0, 8),
    ("sensor_msgs/BatteryState", "power_supply_technology"): (0, 6),
    ("sensor_msgs/RelativeHumidity", "relative_humidity"): (0, 1),
    ("sensor_msgs/NavSatFix", "latitude"): (-90, 90),
    ("sensor_msgs/NavSatFix", "longitude"): (-180, 180),
    ("sensor_msgs/NavSatStatus", "status"): (-1, 2),
    ("sensor_msgs/Range", "radiation_type"): (0, 1),
    ("visualization_msgs/Marker", "type"): (0, 11),
    ("visualization_msgs/Marker", "action"): (0, 3),
    ("std_msgs/ColorRGBA", "r"): (0, 1),
    ("std_msgs/ColorRGBA", "g"): (0, 1),
    ("std_msgs/ColorRGBA", "b"): (0, 1),
    ("std_msgs/ColorRGBA", "a"): (0, 1),
}
"""Between which values a field is, by the comments and the constants in its message's definition."""
SHARE, PERCENT_MIN = (0, 1), 3
ROUNDED = 0.02
"""So much of its range beyond it, a bound allows for a value that is rounded."""
QUATERNION = re.compile(r"(?:^|\.)(?:orientation|rotation|quaternion)\.[xyzw]$")
"""A part of a rotation."""
UNIT_MAX = 1 + ROUNDED
SIZES = {
    "sensor_msgs/Image": ("height", "step"),
    "nav_msgs/OccupancyGrid": ("info.height", "info.width"),
    "sensor_msgs/PointCloud2": ("height", "row_step"),
}
"""By type, the fields whose product is the number of items in `data`."""


def value_warnings(criterion: WrittenCriterion, rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield what a criterion's values may be by a slip."""
    yield from _set_otherwise(criterion)
    yield from _not_driven(criterion, rubric.handout)
    yield from _swapped_params(criterion)
    yield from _left_out(criterion)
    yield from _other_end_of_values(criterion, rubric)
    if criterion.check == "reacts":
        yield from _sooner_than_least(criterion)
    if criterion.check == "service-answers":
        yield from _swapped_answers(criterion)
    if criterion.check == "prints":
        yield from _all_numbers(criterion)
        yield from _of_another_run(criterion, rubric)


def range_warnings(rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield values that a field's type would allow, and that its definition gives no meaning."""
    yield from _other_sizes(rubric)
    given: list[tuple[KeyPath, set[str], str, object]] = []
    for criterion in rubric.criteria:
        for at, asked in criterion.conditions:
            types = set(map(str, types_of(str(asked.get("topic")), rubric, criterion.scenario)))
            field = str(asked.get("field"))
            given += [((*at, key), types, field, asked.get(key)) for key in ("value", "min", "max")]
            given += [
                ((*at, "values", n), types, field, v) for n, v in enumerate(as_list(asked.get("values")))
            ]
    for at, kind, one in rubric.parts():
        sent = [("value", one.get("value")), *(("values", v) for v in as_list(one.get("values")))]
        for key, value in sent if kind == "publish" else ():
            type_ = str(one.get("type"))
            given += [((*at, key, field), {type_}, str(field), v) for field, v in as_map(value).items()]
    for path, types, field, value in given:
        if QUATERNION.search(field) and is_number(value) and not -UNIT_MAX <= value <= UNIT_MAX:
            how = "it is the sine or cosine of half an angle"
            yield path, f"{field} of a quaternion is -1 to 1, and never {value:g}: {how}"
            continue
        limits = [RANGES.get((kind, field)) for kind in types]
        if not is_number(value) or len(limits) != 1 or limits[0] is None:
            continue
        low, high = limits[0]
        rounded = ROUNDED * (high - low) if path[-1] in {"min", "max"} else 0
        # A node may be sent one on purpose that is a little too large; in percent, it would be very small.
        on_purpose = limits[0] == SHARE and "publish" in path and high < value < PERCENT_MIN
        if not low - rounded <= value <= high + rounded and not on_purpose:
            yield path, f"{field} of {min(types)} is {_in_range(limits[0], value)}"


def _in_range(limits: tuple[int, int], value: float) -> str:
    words = f"{limits[0]} to {limits[1]}, and never {value:g}"
    is_percent = limits == SHARE and PERCENT_MIN <= value <= 100
    return f"{words}: write {value / 100:g} for {value:g} %" if is_percent else words


def _other_sizes(rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield images and maps that are sent with more or fewer items than their sizes say."""
    for at, kind, one in rubric.parts():
        sizes = SIZES.get(str(one.get("type")))
        values = [one.get("value"), *as_list(one.get("values"))] if kind in {"publish", "probe"} else []
        for value in map(as_map, values) if sizes else ():
            factors = [_inside(value, path) for path in sizes or ()]
            data = value.get("data")
            count = as_map(data).get("count") if isinstance(data, dict) else len(as_list(data)) or None
            if not is_number(count) or not all(map(is_number, factors)) or count == math.prod(factors):
                continue
            told = join_words([f"{path} {n:g}" for path, n in zip(sizes or (), factors, strict=True)])
            fault = f"has {count} items, and {told} make {math.prod(factors):g}"
            yield (*at, "value", "data"), f"{fault}: a node that reads all of them fails"


def _inside(value: object, path: str) -> Any:  # noqa: ANN401 - whatever the rubric has
    for key in path.split("."):
        value = as_map(value).get(key)
    return value


def _other_end_of_values(criterion: WrittenCriterion, rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield a first or last value that is not the first or last of those that another criterion lists."""
    given, when = criterion.given, criterion.given.get("when")
    if criterion.check != "field-equals" or when not in {"first", "last"} or "value" not in given:
        return
    keys = ("topic", "field")
    for one in rubric.criteria:
        values, is_same = (
            as_list(one.given.get("values")),
            all(one.given.get(k) == given.get(k) for k in keys),
        )
        if one.check != "field-equals" or one.run != criterion.run or not is_same or not values:
            continue
        end = values[0 if when == "first" else -1]
        if one.given.get("repeats") is False and end != given["value"]:
            how = "begins" if when == "first" else "ends"
            fault = (
                f"is {json.dumps(given['value'])}, and {one.id} {how} with {json.dumps(end)} in the same run"
            )
            yield (*criterion.at, "value"), fault


def _sooner_than_least(criterion: WrittenCriterion) -> Iterator[Fault]:
    """Yield a `least_s` that is longer than the pauses between messages each of which has to be answered: a node that
    waits for silence answers only the last one."""
    cause, least_s = as_map(criterion.given.get("cause")), criterion.given.get("least_s")
    if cause.get("field") is not None or not is_number(least_s):
        return
    for _, step in as_maps(criterion.scenario.get("steps")):
        sent = as_map(step.get("publish"))
        rate_hz, count = sent.get("rate_hz", 10), sent.get("count")
        is_one = count == 1 or (
            count is None and "duration_s" not in sent and len(as_list(sent.get("values"))) < 2
        )
        if sent.get("topic") != cause.get("topic") or not is_number(rate_hz) or rate_hz <= 0:
            continue
        if (sent.get("background") is True or not is_one) and 1 / rate_hz < least_s:
            gap_s = 1 / rate_hz
            fault = (
                f"each message on {cause['topic']} has to be answered, and the next one comes {gap_s:.2g} s after "
                "it: a node that waits for silence answers only the last one. Ask for it in a run in which one message "
                "is sent"
            )
            yield (*criterion.at, "least_s"), fault
            return


def hidden_packages(rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield scripts with the name of their package, where this has messages: Python finds the script in its place."""
    texts = {
        text.partition("/")[0] for path, text in rubric.texts if path[-1] in {"type", "file"} and "/" in text
    }
    has_types = {*rubric.packages} & (
        texts | ({*rubric.packages[:1]} if texts & {"msg", "srv", "action"} else set())
    )
    seen = set[str]()
    for at, start in rubric.starts():
        script = str(start.get("script"))
        name = PurePosixPath(script).stem
        if script.endswith(".py") and name in has_types and name not in seen:
            seen.add(name)
            how = (
                f"Python takes it for {name} in `import {name}.msg` or the like, and no script gets the types"
            )
            yield (*at, "script"), f"has the name of the package, {name}: {how}: give it another name"


def early_waits(rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield waits behind a step whose effect they are for, and that are over before: so many messages have come by
    then."""
    rates = {
        one.given.get("topic"): rate_hz
        for one in rubric.criteria
        if one.check == "rate" and "cause" not in one.given and is_number(rate_hz := one.given.get("rate_hz"))
    }
    for name, scenario in rubric.scenarios.items():
        passed_s, acted = 0.0, False
        for n, step in as_maps(scenario.get("steps") if scenario.get("clock") != "warped" else ()):
            wait = as_map(step.get("wait"))
            acted |= not wait
            passed_s += wait["seconds"] if is_number(wait.get("seconds")) else 0
            topic, least = wait.get("topic"), wait.get("messages", 1)
            came = int(passed_s * rates.get(topic, 0))
            if acted and is_number(least) and 0 < least <= came and wait.get("new") is not True:
                fault = f"about {came} messages have come on {topic} before this step: write new: true"
                yield ("scenarios", name, "steps", n, "wait", "messages"), fault


def _set_otherwise(criterion: WrittenCriterion) -> Iterator[Fault]:
    """Yield parameters that the scenario sets to one value, and that should have another one."""
    name, value = criterion.given.get("name"), criterion.given.get("value")
    named = [one for _, one in set_in(criterion.scenario) if one.get("name") == name]
    values = [one["value"] for one in named if "value" in one]
    if criterion.check == "param-value" and values and value not in values:
        yield (*criterion.at, "value"), f"{criterion.run} sets {name} to {json.dumps(values[-1])}"


def _swapped_params(criterion: WrittenCriterion) -> Iterator[Fault]:
    """Yield values of a field that are the value of another parameter of the run, beside one with the field's name."""
    value, name = criterion.given.get("value"), str(criterion.given.get("field")).rpartition(".")[2]
    params = {
        str(one.get("name")).rpartition("/")[2]: one.get("value") for _, one in set_in(criterion.scenario)
    }
    others = [key for key, one in params.items() if one == value and key != name]
    if criterion.check == "field-equals" and is_number(value) and params.get(name, value) != value and others:
        fault = f"is {others[0]} in {criterion.run}, and {name} is {json.dumps(params[name])} there: is it that one?"
        yield (*criterion.at, "value"), fault


def _not_driven(criterion: WrittenCriterion, handout: str) -> Iterator[Fault]:
    """Yield parts of a velocity that the robot cannot have, and that are to be other than 0, or may be."""
    simulated = bool(robot_of(criterion.scenario)) or _is_turtle(criterion.scenario)
    if not simulated and OTHER_WAYS.search(handout):
        return
    for at, asked in criterion.conditions:
        topic, field = str(asked.get("topic")), asked.get("field")
        bounds = (asked.get("value"), asked.get("min"), asked.get("max"))
        value, low, high = (
            one if is_number(one) else other
            for one, other in zip(bounds, (0, -math.inf, math.inf), strict=True)
        )
        if not topic.endswith("/cmd_vel") or field not in SIDEWAYS or criterion.given.get("never"):
            continue
        if not (value == 0 and low <= 0 <= high):
            told = f"the robot cannot move by {field}: it has linear.x and angular.z alone"
            plain = f"{field} drives no robot with two wheels: write linear.x or angular.z"
            yield (*at, "field"), told if simulated else plain
        elif (
            criterion.check == "field-bounds" and all(map(is_number, bounds[1:])) and max(-low, high) > STANDS
        ):
            yield (*at, "field"), f"{field} of a robot with two wheels is always 0: every node passes"


def _left_out(criterion: WrittenCriterion) -> Iterator[Fault]:
    """Yield a cause's field that no message has which the run sends, while these have others: it is always zero."""
    cause = as_map(criterion.given.get("cause"))
    topic, field = cause.get("topic"), re.split(r"\W", str(cause.get("field") or ""))[0]
    sent = [one for one in published_in(criterion.scenario) if one.get("topic") == topic]
    values = [
        value
        for one in sent
        for value in (one.get("value"), *as_list(one.get("values")))
        if value is not None
    ]
    keys = {key for value in values for key in (value if isinstance(value, dict) else ("data",))}
    if field and keys and not keys & {field, *FORMS} and not given_steps(criterion.scenario, "play"):
        told = f"{criterion.run} sends {join_words(sorted(map(str, keys)))} on {topic}"
        yield (*criterion.at, "cause", "field"), f"{told}, and no {field}, which is zero there"


def _is_turtle(scenario: dict[str, Any]) -> bool:
    """Return whether a scenario has a turtle that is no holonomic one."""
    is_holonomic = any(str(one.get("name")).endswith("/holonomic") for _, one in set_in(scenario))
    return not is_holonomic and any(
        start.get("program") == "turtlesim/turtlesim_node" for start in starts_of(scenario)
    )


def _numbers(value: object) -> set[float]:
    return {abs(number) for _, number in numbers_in((), value)} - PLAIN


def _swapped_answers(criterion: WrittenCriterion) -> Iterator[Fault]:
    """Yield two answers whose numbers are each in the other one's request, and in their own not."""
    service, expect = criterion.given.get("service"), as_list(criterion.given.get("expect"))
    calls = [one for _, part, one in services_in(criterion.scenario) if part == "request"]
    asked = [as_map(one.get("request")) for one in calls if one.get("service") == service]
    numbers = list(zip(map(_numbers, asked), map(_numbers, expect), strict=False))
    for first, (request, answer) in enumerate(numbers):
        for second, (other_request, other_answer) in enumerate(numbers[first + 1 :], first + 1):
            is_own = answer & request or other_answer & other_request
            if not is_own and answer & other_request and other_answer & request:
                have = f"what calls {first + 1} and {second + 1} are asked with is in the other one's answer"
                yield (*criterion.at, "expect"), f"{have}: are these two swapped?"


def _all_numbers(criterion: WrittenCriterion) -> Iterator[Fault]:
    """Yield a tolerance with which a node that always prints 0 passes."""
    numbers, off = as_list(criterion.given.get("numbers")), criterion.given.get("tolerance")
    if numbers and is_number(off) and all(is_number(one) and off >= abs(one) > 0 for one in numbers):
        yield (
            (*criterion.at, "tolerance"),
            f"is as large as what has to be printed, {numbers[0]:g}: 0 passes, too",
        )


def _of_another_run(criterion: WrittenCriterion, rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield numbers to print that another run's service answers, and this one's does not."""
    if not any(
        one.get("answer") or one.get("answers") for _, one in as_maps(criterion.scenario.get("serves"))
    ):
        return
    asked = [as_list(one.given.get("numbers")) for one in rubric.criteria if one.check == "prints"]
    printed = {number for numbers in asked for number in numbers if is_number(number)}
    # A program may print what it works out of the answers.
    if not printed <= set[float]().union(*map(_served, rubric.scenarios.values())):
        return
    for index, number in enumerate(as_list(criterion.given.get("numbers"))):
        others = [
            name for name, one in rubric.scenarios.items() if is_number(number) and number in _served(one)
        ]
        if others and abs(number) not in _numbers(criterion.scenario):
            fault = (
                f"is the answer in {others[0]}, and {criterion.run} answers otherwise: is it for that run?"
            )
            yield (*criterion.at, "numbers", index), fault


def _served(scenario: dict[str, Any]) -> set[float]:
    """Return the numbers that the grader's services answer in a run."""
    answers = [[one.get("answer"), one.get("answers")] for _, one in as_maps(scenario.get("serves"))]
    return {number for _, number in numbers_in((), answers)} if answers else set()
