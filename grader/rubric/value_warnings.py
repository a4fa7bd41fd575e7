"""Warnings of a criterion's values: those that another part of the rubric has in their place, and velocities that a
robot cannot have."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator
from typing import Any

from grader.checks.support.fields import is_number
from grader.rubric.simulators import robot_of
from grader.rubric.yaml_lines import (
    Fault,
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
    r"|altitude|height|(?:linear|angular)\.[xyz]|y)\b",
    re.IGNORECASE,
)
"""Words of a handout about a robot that may move otherwise."""
STANDS = 0.05
"""Bounds of a velocity as near to 0 as these ask for one that is 0."""
FORMS = frozenset({"from", "each", "repeat", "text", "integers"})
"""Keys of values that are no fields."""
PLAIN = frozenset({0.0, 1.0})
"""These are in many requests and answers, by chance."""


def value_warnings(criterion: WrittenCriterion, rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield what a criterion's values may be by a slip."""
    yield from _set_otherwise(criterion)
    yield from _not_driven(criterion, rubric.handout)
    yield from _swapped_params(criterion)
    yield from _left_out(criterion)
    if criterion.check == "reacts":
        yield from _sooner_than_least(criterion)
    if criterion.check == "service-answers":
        yield from _swapped_answers(criterion)
    if criterion.check == "prints":
        yield from _all_numbers(criterion)
        yield from _of_another_run(criterion, rubric)


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
