"""How long a scenario's run lasts, and what a criterion asks for that is not done by then."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from pydantic import ValidationError

from grader.checks.rate import RateParams
from grader.checks.reacts import ORDER_S
from grader.checks.support.conditions import Condition
from grader.checks.support.fields import PATH_PARTS, Reading, is_number
from grader.rubric.definitions import TooShort, sent_in_turn, values_at
from grader.rubric.scenario import ROSTEST_ENDING, Action, Probe, Publish, Scenario, Step, Until
from grader.rubric.yaml_lines import (
    Fault,
    KeyPath,
    WrittenCriterion,
    as_list,
    as_map,
    as_maps,
    given_steps,
    services_in,
    starts_of,
)
from grader.wording import significant

FASTEST_HZ = 100
"""No lab asks for rows of a table, or feedback, more often than this."""
SUBSCRIBE_S, ANSWER_S = 6.0, 10.0
"""How long a run waits for a subscriber of one more topic, and for the answer of a service."""
MESSAGES_SEEN = 10_000
"""Of so many messages of a step it is asked what they show."""
CONNECTED = frozenset({"connected", "launch-connects", "launch-runs"})
"""Checks of the connections between nodes."""
CONDITIONS = frozenset(
    ("window_s", "topics", "messages", "connected", "heard", "nodes", "alive_s", "opened", "ended", "quiet_s")
)
"""Those of `until` that end a run before its limit."""
LASTING = ("window_s", "alive_s")
"""Conditions of `until` that hold after a time, once the last step is done."""


def late_faults(scenarios: dict[str, dict[str, Any]]) -> Iterator[Fault]:
    """Yield calls and answers of the grader's that come after the end of the run at its latest."""
    for name, scenario in scenarios.items():
        limit_s = until_of(scenario, "limit_s")
        if scenario.get("clock") == "warped" or not is_number(limit_s):
            continue
        path: KeyPath = ("scenarios", name)
        kinds = () if "steps" in scenario else ("calls", "serves")
        delayed = [((*path, key, n), one) for key in kinds for n, one in as_maps(scenario.get(key))]
        steps = as_maps(scenario.get("steps"))
        delayed += [((*path, "steps", n, "call"), as_map(step.get("call"))) for n, step in steps]
        for at, one in delayed:
            delay_s = one.get("delay_s")
            if is_number(delay_s) and delay_s >= limit_s:
                over = f"that is {delay_s:g} s, and the run is over after {limit_s:g} s (limit_s)"
                longer = (
                    f"{delay_s:g} s is longer than the run may last after its steps (limit_s, {limit_s:g} s): "
                    f"write a step wait: {{seconds: {delay_s:g}}} before it, or a shorter delay"
                )
                yield (*at, "delay_s"), longer if "steps" in at else over


def until_of(scenario: dict[str, Any], key: str) -> Any:  # noqa: ANN401 - whatever the rubric has
    """Return what a scenario says for a key of `until`, or that key's default."""
    return as_map(scenario.get("until")).get(key, Until.model_fields[key].default)


def warp_of(scenario: dict[str, Any]) -> Any:  # noqa: ANN401 - as above
    """Return how many times as fast as the wall's the clock of a scenario runs."""
    warp = scenario.get("warp", Scenario.model_fields["warp"].default)
    return warp if scenario.get("clock") == "warped" else 1


def _read_step(written: dict[str, Any]) -> Step | None:
    try:
        return Step.from_data(written)
    except (ValidationError, TypeError):
        return None


def _read_steps(scenario: dict[str, Any]) -> list[Step] | None:
    """Return the calls and steps of a scenario; None where one is not valid, which is said elsewhere."""
    written = [{"call": call} for _, call in as_maps(scenario.get("calls"))]
    steps = [_read_step(one) for one in (*written, *(step for _, step in as_maps(scenario.get("steps"))))]
    known = [step for step in steps if step is not None]
    return known if len(known) == len(steps) else None


def steps_s(scenario: dict[str, Any]) -> float | None:
    """Return how long a scenario's steps last; None where something of theirs has to come first."""
    steps = [_read_step(written) for _, written in as_maps(scenario.get("steps"))]
    for step in steps:
        if step is None or step.call or step.action or step.play or (step.wait and step.wait.seconds is None):
            return None
        if step.published is not None and step.published.background:
            return None
    return sum(step.lasts_s for step in steps if step is not None)


def probed_s(scenario: dict[str, Any]) -> float:
    """Return how many seconds the probes take."""
    lasting_s = 0.0
    for _, probe in as_maps(scenario.get("probes")):
        made = [probe.get(key, 0) for key in ("text", "integers")]
        among, values = (len(as_list(probe.get(key))) for key in ("among", "values"))
        times, rate_hz = (probe.get(key, Probe.model_fields[key].default) for key in ("times", "rate_hz"))
        if all(map(is_number, (*made, times, rate_hz))) and rate_hz > 0:
            lasting_s += (sum(made) + among + values * times) / rate_hz
    return lasting_s


def longest_s(scenario: dict[str, Any], played_s: float | None = None) -> float | None:
    """Return how long a run lasts at most once its last process is started, in the time of its clock, if its recording
    lasts so long; None where that is not known."""
    first_s, limit_s = until_of(scenario, "first_message_s"), until_of(scenario, "limit_s")
    warp, steps, starts = warp_of(scenario), _read_steps(scenario), starts_of(scenario)
    if steps is None or "recording" in scenario or not all(map(is_number, (first_s, limit_s, warp))):
        return None
    # Their own length is not in the rubric.
    if any("tests" in one or str(one.get("program")).endswith(ROSTEST_ENDING) for one in starts):
        return None
    # Steps are counted by the run's clock. Waits are by the wall's, and longer by a clock that runs ahead.
    waits_s = total_s = 0.0
    if "until" in scenario or "steps" not in scenario:
        waits_s += limit_s
    if "probes" in scenario:
        waits_s += first_s + SUBSCRIBE_S + probed_s(scenario)
    for step in steps:
        if step.play and played_s is None:
            return None
        total_s += played_s or 0.0 if step.play else step.lasts_s
        waits_s += _waits_s(step, first_s)
    return float(total_s + warp * waits_s)


def _waits_s(step: Step, first_s: float) -> float:
    """Return how long a step may wait for the student's nodes."""
    if step.call is not None:
        return first_s + step.call.delay_s + (ANSWER_S if step.call.limit_s is None else step.call.limit_s)
    if step.action is not None:
        return 2 * first_s + (step.action.cancel_after_s or 0) + step.action.limit_s
    if step.wait is not None and step.wait.seconds is None:
        return first_s if step.wait.limit_s is None else step.wait.limit_s
    return first_s if step.published is not None or step.play is not None else 0.0


def _steps_on(topic: object, scenario: dict[str, Any]) -> list[int]:
    """Return which steps send a message on a topic; none where one of them sends several, or nobody knows."""
    sent = [
        one for one in as_maps(scenario.get("steps")) if as_map(one[1].get("publish")).get("topic") == topic
    ]
    parts = [step.published if (step := _read_step(written)) else None for _, written in sent]
    return [n for n, _ in sent] if all(part is not None and part.total == 1 for part in parts) else []


def until_next_s(topic: object, number: object, scenario: dict[str, Any]) -> float | None:
    """Return how long after a message of that number on a topic the steps send the next one there; None where nobody
    knows, or it is the last."""
    sent = _steps_on(topic, scenario)
    if not isinstance(number, int) or not 0 < number < len(sent):
        return None
    passed = scenario["steps"][sent[number - 1] : sent[number]]
    is_known = all({"publish", "wait"} & as_map(step).keys() for step in passed)
    return steps_s({"steps": passed}) if is_known else None


def _until_last_s(topic: object, number: object, scenario: dict[str, Any]) -> float | None:
    """Return how long after the last message on a topic, if that is its number, the steps and the run end."""
    sent = _steps_on(topic, scenario)
    if "until" in scenario or not sent or number != len(sent):
        return None
    return steps_s({"steps": scenario["steps"][sent[-1] :]})


def often_faults(about: WrittenCriterion) -> Iterator[Fault]:
    """Yield rows and feedback of which more are asked for than come in that time, however fast a node is."""
    goal, most_s = goal_of(about), longest_s(about.scenario) if about.check == "file-left" else None
    times = {
        "rows_at_least": (most_s, f"{about.run} lasts at most"),
        "feedback": (None if goal is None else _limit_s(goal), "the step gives the goal"),
    }
    for key, (lasting_s, words) in times.items():
        asked = about.given.get(key)
        if is_number(asked) and is_number(lasting_s) and asked > FASTEST_HZ * lasting_s:
            fault = f"{asked} in {lasting_s:g} s, which {words}, are more than {FASTEST_HZ} a second"
            yield (*about.at, key), fault
    least, apart_s = about.given.get("at_least", 1), about.given.get("apart_s")
    run_s = longest_s(about.scenario) if about.check == "calls" else None
    if (
        is_number(run_s)
        and is_number(apart_s)
        and is_number(least)
        and (needed_s := (least - 1) * apart_s) > run_s
    ):
        fault = f"{least} calls take {needed_s:g} s then, and {about.run} lasts {run_s:.3g} s at most: it is in seconds"
        yield (*about.at, "apart_s"), fault


def goal_of(about: WrittenCriterion) -> dict[str, Any] | None:
    """Return the step that sends the goal of which an action-result speaks."""
    number = about.given.get("goal", 1)
    goals = [
        one for one in given_steps(about.scenario, "action") if one.get("name") == about.given.get("action")
    ]
    is_there = about.check == "action-result" and isinstance(number, int) and 0 < number <= len(goals)
    return goals[number - 1] if is_there else None


def _limit_s(goal: dict[str, Any]) -> Any:  # noqa: ANN401 - whatever the rubric has
    return goal.get("limit_s", Action.model_fields["limit_s"].default)


def early_faults(about: WrittenCriterion) -> Iterator[Fault]:
    """Yield runs that are over as soon as their nodes are there, while a criterion asks how these are connected: nodes
    look for each other a moment later."""
    topic, scenario = about.given.get("topic"), about.scenario
    until = as_map(scenario.get("until"))
    given = {key for key in until if key in CONDITIONS and until[key]}
    if about.check not in CONNECTED or topic is None or not given or given - {"nodes"}:
        return
    if not any(scenario.get(key) for key in ("steps", "probes", "calls")):
        over = f"the run is over once they are there, and {about.id} asks for a connection over {topic}"
        yield ("scenarios", about.run, "until", "nodes"), f"{over}: write connected: [{topic}] as well"


def within_faults(about: WrittenCriterion) -> Iterator[Fault]:
    """Yield times in which something has to come, and that are longer than the run waits for it."""
    within_s, goal, most_s = about.given.get("within_s"), goal_of(about), longest_s(about.scenario)
    at = (*about.at, "within_s")
    if not is_number(within_s):
        return
    if goal is not None and is_number(limit_s := _limit_s(goal)) and within_s > limit_s:
        waits = f"the step waits {limit_s:g} s for the result (limit_s)"
        yield at, f"{waits}, and gives it up before {within_s:g} s"
    after_s = (goal or {}).get("cancel_after_s")
    if goal is not None and all(map(is_number, (after_s, limit_s := _limit_s(goal)))):
        left_s = limit_s - after_s
        if 0 < left_s <= within_s <= limit_s:
            fault = (
                f"the step gives the goal up {left_s:g} s after it has cancelled it (limit_s: {limit_s:g})"
            )
            yield at, f"{fault}: give it a longer limit_s"
    topic, number = about.given.get("asked_on"), about.given.get("number", 1)
    left_s = until_next_s(topic, number, about.scenario) or _until_last_s(topic, number, about.scenario)
    if (
        about.check == "ends-at"
        and topic is not None
        and left_s is not None
        and left_s < within_s <= (most_s or 0)
    ):
        fault = f"{about.run} waits {left_s:g} s after message {number} on {topic}"
        yield at, f"{fault}: let the step after it wait for longer"
    if about.check in {"reacts", "ends-at"} and most_s is not None and within_s >= most_s:
        yield at, f"{about.run} lasts {most_s:g} s at most: what comes later is not seen"


def answer_faults(about: WrittenCriterion) -> Iterator[Fault]:
    """Yield times that an answer takes, and that are longer than the calls wait for it."""
    asked = [one for _, part, one in services_in(about.scenario) if part == "request"]
    limits = [
        one.get("limit_s") or ANSWER_S for one in asked if one.get("service") == about.given.get("service")
    ]
    numbers = [limit_s for limit_s in limits if is_number(limit_s)]
    for key in ("least_s", "within_s") if about.check == "service-answers" and numbers else ():
        if is_number(takes_s := about.given.get(key)) and takes_s > max(numbers) * warp_of(about.scenario):
            waits = f"a call waits {max(numbers):g} s for its answer: give it a longer limit_s"
            yield (*about.at, key), waits


def stretch_faults(about: WrittenCriterion, watched_s: float = 0.0) -> Iterator[Fault]:
    """Yield what is judged while something is so, or after it, where the run's steps give it too little time. The run
    goes on after them for as long as another criterion watches its nodes: `watched_s` at most."""
    given, at = about.given, (*about.at, "within_s")
    within_s, window_s = (
        given.get(key, RateParams.model_fields[key].default) for key in ("within_s", "min_window_s")
    )
    try:
        cause = Condition.model_validate(given.get("cause")) if about.check in {"rate", "reacts"} else None
    except ValidationError:  # said elsewhere
        return
    lasting = None if cause is None else _lasting_s(cause, about.scenario, watched_s)
    if cause is None or lasting is None or not is_number(window_s) or not is_number(within_s):
        return
    kept_s, left_s = (significant(one) for one in lasting)
    if about.check == "rate" and lasting[0] < (needs_s := within_s + window_s):
        keeps = f"{about.run} keeps {cause.words} up for {kept_s} s at most"
        takes = f"within_s and min_window_s are {significant(needs_s)} s"
        yield at, f"{keeps}, and {takes}: let a step wait for longer"
    elif about.check == "reacts" and given.get("never") is True and lasting[0] <= within_s + ORDER_S:
        keeps = f"{about.run} keeps {cause.words} up for {kept_s} s at most"
        yield at, f"{keeps}: after {within_s:g} s there is no time left in which silence is asked for"
    elif about.check == "reacts" and given.get("never") is not True and lasting[1] < within_s:
        ends = f"{about.run} ends {left_s} s at most after {cause.words}, and an answer is missed only after"
        yield at, f"{ends} {within_s:g} s: let a last step wait for longer"


def _lasting_s(cause: Condition, scenario: dict[str, Any], watched_s: float) -> tuple[float, float] | None:
    """Return how long the steps of a run keep a condition up at most, and how long the run lasts from the first time
    that it begins; None where they do not send it, or nobody knows."""
    steps, warp, first_s = _read_steps(scenario), warp_of(scenario), until_of(scenario, "first_message_s")
    written = [*as_maps(scenario.get("calls")), *as_maps(scenario.get("steps"))]
    if steps is None or "probes" in scenario or not all(map(is_number, (warp, first_s))):
        return None
    now_s = longest_s = 0.0
    began_s: float | None = None
    first: float | None = None
    for step, (_, one) in zip(steps, written, strict=True):
        shown = _shown_by(cause, step, one)
        if shown is None or step.play:
            return None
        for number, holds in enumerate(shown):
            if began_s is not None and not holds:
                longest_s = max(longest_s, now_s + number * _period_s(step) - began_s)
                began_s = None
            elif began_s is None and holds:
                began_s = now_s + number * _period_s(step)
                first = began_s if first is None else first
        is_waiting = step.action or (step.wait is not None and step.wait.seconds is None)
        now_s += step.lasts_s + (warp * _waits_s(step, first_s) if is_waiting else 0.0)
    if first is None or (after_s := _after_steps_s(scenario)) is None:
        return None
    end_s = now_s + max(after_s, watched_s * warp)
    return max(longest_s, end_s - began_s if began_s is not None else 0.0), end_s - first


def _after_steps_s(scenario: dict[str, Any]) -> float | None:
    """Return how long a run lasts at most after its last step."""
    until, limit_s = as_map(scenario.get("until")), until_of(scenario, "limit_s")
    if "until" not in scenario:
        return 0.0
    if until.keys() <= {*LASTING, "limit_s"} and set(LASTING) & until.keys():
        lasting = [until[key] for key in LASTING if is_number(until.get(key))]
        return max(lasting, default=None)
    return limit_s * warp_of(scenario) if is_number(limit_s) else None


def _period_s(step: Step) -> float:
    return 1 / step.published.rate_hz if step.published is not None else 0.0


def _shown_by(cause: Condition, step: Step, written: dict[str, Any]) -> list[bool] | None:
    """Return of each message that a step sends on the topic of a condition, or of its call of that service, whether it
    holds; None where nobody knows."""
    if step.call is not None and step.call.service == cause.topic:
        values: list[Any] = [step.call.request]
    elif isinstance(step.published, Publish) and step.published.topic == cause.topic:
        values = sent_in_turn(as_map(written.get("publish")))
        # Each once more and again, as long as the step sends.
        total = None if step.published.background else step.published.total
        values = (
            [values[n % len(values)] for n in range(min(total, MESSAGES_SEEN))] if total and values else []
        )
        if not values:
            return None
    else:
        return []
    found = [_holds(cause, one) for one in values]
    return None if None in found else [one is True for one in found]


def _holds(cause: Condition, value: object) -> bool | None:
    """Return whether a condition is true of a message that a step sends; None where its field is not plain there."""
    if cause.field is None:
        return True
    try:
        found = values_at(
            value if isinstance(value, dict) else {"data": value}, PATH_PARTS.findall(cause.field)
        )
    except TooShort:
        return None
    is_plain = found is not None and all(isinstance(one, int | float | str) for one in found)
    return cause.holds(Reading(0, tuple(found or ()), "")) if is_plain else None
