"""What in a rubric may be a slip and may be meant: each is a warning, and the rubric is used as it is.

Names that one line alone has are in `spelling.py`.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from pathlib import PurePosixPath
from typing import Any

from grader.checks.support.fields import is_number
from grader.rubric.definitions import services_in
from grader.rubric.demand_warnings import Criteria, Scenarios, demand_warnings
from grader.rubric.message_fields import POSES, VELOCITIES
from grader.rubric.prose_warnings import SHIFTS, numbers_in, prose_warnings
from grader.rubric.simulators import set_in, topics_of_programs
from grader.rubric.started import argument_warnings, starts_of
from grader.rubric.step_faults import given_steps
from grader.rubric.yaml_lines import (
    Fault,
    KeyPath,
    WrittenCriterion,
    as_list,
    as_map,
    as_maps,
    as_texts,
    criteria_of,
    packages_in,
    texts_in,
)
from grader.wording import join_words, plural

SHORT = {"limit_s": 3.0, "first_message_s": 3.0, "quiet_s": 1.0, "alive_s": 0.5, "window_s": 2.0}
"""Conditions of `until` that a correct package may miss on a busy machine if they are shorter."""
WAIT_S = 0.5
LONG_S = 900.0
"""Nothing of a lab takes so long; in milliseconds it is less than a second."""
SELDOM_S = 5.0
"""Nobody waits so long for the next message of a lab."""
JUDGED = ("check", "scenario", "package", "with")
"""What makes a criterion judge something."""


def warnings(data: object) -> Iterator[Fault]:
    """Yield what may be a slip."""
    rubric = as_map(data)
    scenarios = {name: as_map(one) for name, one in as_map(rubric.get("scenarios")).items()}
    criteria = criteria_of(rubric)
    yield from _short_runs(scenarios)
    yield from _short_waits(scenarios)
    yield from _misnamed_processes(rubric, scenarios)
    yield from _first_packages(rubric, scenarios)
    yield from _lone_quotes(rubric)
    yield from _same_criteria(criteria)
    yield from _without_requires(criteria)
    yield from _required_of_runs(criteria)
    yield from _patterns(criteria)
    yield from _own_messages(criteria, scenarios)
    yield from _of_the_build(criteria)
    yield from _heavy_members(rubric, criteria)
    yield from _other_rates(criteria)
    yield from _not_private(scenarios, str(rubric.get("handout") or ""))
    yield from _without_input(criteria, scenarios)
    yield from demand_warnings(rubric, criteria, scenarios)
    yield from _crossed_bounds(scenarios)
    yield from _unasked_bits(criteria, scenarios)
    yield from prose_warnings(rubric)
    yield from argument_warnings(rubric)
    for criterion in criteria:
        yield from _other_process(criterion, scenarios)
        yield from _fewer_answers(criterion)
        yield from _asked_for_nothing(criterion)
        yield from _printed_elsewhere(criterion, scenarios)
        yield from _cancelled_goal(criterion)
        yield from _added_up(criterion)
        yield from _set_otherwise(criterion)
        yield from _other_run(criterion, criteria)


def _short_runs(scenarios: Scenarios) -> Iterator[Fault]:
    for name, scenario in scenarios.items():
        for key, least_s in SHORT.items():
            given_s = as_map(scenario.get("until")).get(key)
            if is_number(given_s) and given_s < least_s:
                fault = f"{given_s:g} s is very short: on a busy machine a correct package may need more"
                yield ("scenarios", name, "until", key), fault
            if is_number(given_s) and given_s > LONG_S:
                fault = f"{given_s:g} s are {given_s / 60:.0f} minutes, which a package that never gets there takes"
                yield ("scenarios", name, "until", key), fault
        for index, step in as_maps(scenario.get("steps")):
            rate_hz = as_map(step.get("publish")).get("rate_hz")
            if is_number(rate_hz) and 0 < rate_hz < 1 / SELDOM_S:
                fault = f"is a message every {1 / rate_hz:g} s: rate_hz is messages a second"
                yield ("scenarios", name, "steps", index, "publish", "rate_hz"), fault


def _short_waits(scenarios: Scenarios) -> Iterator[Fault]:
    """Yield waits for what is there before them at no student's: a topic or node, an answer, a result."""
    for name, scenario in scenarios.items():
        waits: list[tuple[KeyPath, dict[str, Any]]] = [
            (("steps", index, kind), as_map(step[kind]))
            for index, step in as_maps(scenario.get("steps"))
            for kind in ("wait", "call", "action")
            if kind in step
        ]
        waits += [(("calls", index), call) for index, call in as_maps(scenario.get("calls"))]
        for at, wait in waits:
            limit_s = wait.get("limit_s")
            if is_number(limit_s) and limit_s < WAIT_S:
                fault = f"{limit_s:g} s is very short: on a busy machine a correct package may need more"
                yield ("scenarios", name, *at, "limit_s"), fault


BOUNDS = (("low", "high"), ("min", "max"), ("lower", "upper"), ("minimum", "maximum"))


def _crossed_bounds(scenarios: Scenarios) -> Iterator[Fault]:
    """Yield requests whose lower bound is above the upper one."""
    for name, scenario in scenarios.items():
        for at, part, one in services_in(scenario):
            request = as_map(one.get(part)) if part == "request" else {}
            for low, high in BOUNDS:
                both = is_number(request.get(low)) and is_number(request.get(high))
                if both and request[low] > request[high]:
                    fault = f"is more than {high}, {request[high]:g}: is that meant?"
                    yield ("scenarios", name, *at, part, low), fault


def _lone_quotes(rubric: dict[str, Any]) -> Iterator[Fault]:
    for path, text in texts_in((), rubric):
        for quote in ('"', "'"):
            if text.count(quote) == 1 and (text.startswith(quote) or text.endswith(quote)):
                yield path, f"has one quotation mark, {quote}, without its partner"
            is_value = path[-1] == "value" or path[-2:-1] == ("values",)
            if is_value and len(text) > 2 and text.startswith(quote) and text.endswith(quote):
                yield path, "has quotation marks in its quotation marks: a node has to publish them, too"


def _of_the_build(criteria: Criteria) -> Iterator[Fault]:
    """Yield packages that are asked for at run time, and that only a build needs."""
    for criterion in criteria:
        asked = criterion.given if criterion.check in {"manifest", "dependencies"} else {}
        for path, name in texts_in(criterion.at, asked):
            if name == "message_generation":
                yield path, "is asked for at run time, and only the build needs it: write message_runtime"


def _own_messages(criteria: Criteria, scenarios: Scenarios) -> Iterator[Fault]:
    """Yield waits for messages on a topic on which the grader sends later, and of which no criterion judges any."""
    judged = [criterion.given.get("topic") for criterion in criteria]
    for name, scenario in scenarios.items():
        steps = as_maps(scenario.get("steps"))
        for place, (index, step) in enumerate(steps):
            topic = as_map(step.get("wait")).get("topic")
            sent = [n for n, (_, one) in enumerate(steps) if as_map(one.get("publish")).get("topic") == topic]
            if topic and sent and min(sent) > place and topic not in judged and "probes" not in scenario:
                fault = "is the grader's own topic, on which it sends after this"
                yield ("scenarios", name, "steps", index, "wait", "topic"), fault


PATTERN = re.compile(r"\.[*+]|\\[dws]|^/.*/$|^\^.*\$$")


def _patterns(criteria: Criteria) -> Iterator[Fault]:
    """Yield values of fields that look like a pattern: they are compared letter by letter."""
    for criterion in criteria:
        for key in ("value", "values"):
            for at, text in texts_in((key,), criterion.given.get(key)):
                is_one = criterion.check == "field-equals" and PATTERN.search(text)
                if is_one and not re.fullmatch(r"(/\w+)+/?", text):
                    yield (*criterion.at, *at), "is compared letter by letter: it is no pattern"


def _required_of_runs(criteria: Criteria) -> Iterator[Fault]:
    """Yield criteria of files that require one of a run: they are judged without it."""
    of_runs = {criterion.id for criterion in criteria if criterion.has_run}
    for criterion in criteria:
        for number, name in as_texts(criterion.data.get("requires")):
            if not criterion.has_run and name in of_runs and criterion.check != "manual":
                fault = f"{name} judges a run, and {criterion.id} files, which no run changes"
                yield (*criterion.place, "requires", number), fault


FAR = 10


def _heavy_members(rubric: dict[str, Any], criteria: Criteria) -> Iterator[Fault]:
    """Yield criteria of a group that weigh more than all others of it together, many times."""
    known = {criterion.id: criterion for criterion in criteria}
    for name, group in as_map(rubric.get("groups")).items():
        found = [known[one] for _, one in as_texts(as_map(group).get("criteria")) if one in known]
        weights = [(one.place, one.data["points"]) for one in found if is_number(one.data.get("points"))]
        total = sum(points for _, points in weights)
        for place, points in weights:
            if "points" in as_map(group) and points >= FAR * (total - points) > 0:
                share = 100 * points / total
                fault = f"points in a group are weights: this one is {share:.0f} % of {name}"
                yield (*place, "points"), fault


def _words(name: str) -> set[str]:
    return {word for word in re.split(r"[^a-z0-9]+", PurePosixPath(name).stem.lower()) if word}


def _misnamed_processes(rubric: dict[str, Any], scenarios: Scenarios) -> Iterator[Fault]:
    """Yield processes with the name of another script of the rubric's."""
    texts = [text for _, text in texts_in((), rubric)]
    scripts = {name for text in texts for name in re.findall(r"[\w./-]+\.py\b", text)}
    for scenario, one in scenarios.items():
        for index, start in as_maps(one.get("start")):
            name, script = start.get("name"), start.get("script")
            if not isinstance(name, str) or not isinstance(script, str) or _words(name) & _words(script):
                continue
            meant = sorted(other for other in scripts if _words(name) <= _words(other))
            if meant:
                fault = (
                    f"the process is called {name}, and elsewhere the rubric has {meant[-1]}: is it that one?"
                )
                yield ("scenarios", scenario, "start", index, "script"), fault


def _first_packages(rubric: dict[str, Any], scenarios: Scenarios) -> Iterator[Fault]:
    """Yield starts without a package, if others have one."""
    packages = packages_in(rubric)
    starts = [
        (("scenarios", name, "start", index), start)
        for name, one in scenarios.items()
        for index, start in as_maps(one.get("start"))
        if start.get("program") is None and start.get("tests") is None
    ]
    if len(packages) > 1 and any(start.get("package") is not None for _, start in starts):
        fault = f"is started from {packages[0]}, the first package: if it is of another one, give package"
        yield from ((at, fault) for at, start in starts if start.get("package") is None)


def _same_criteria(criteria: Criteria) -> Iterator[Fault]:
    first: dict[str, str] = {}
    for criterion in criteria:
        judged = json.dumps([criterion.data.get(key) for key in JUDGED], sort_keys=True)
        other = first.setdefault(judged, criterion.id)
        if other != criterion.id and criterion.check != "manual":
            yield (*criterion.place, "check"), f"judges the same as {other}, with the same parameters"


def _other_rates(criteria: Criteria) -> Iterator[Fault]:
    """Yield rates of a topic for which an earlier criterion wants another one, in a run of the same processes."""
    before: dict[tuple[str, ...], tuple[str, float, dict[str, Any]]] = {}
    for criterion in criteria:
        given, scenario = criterion.given, criterion.scenario
        rate_hz, cause = given.get("rate_hz"), as_map(given.get("cause"))
        if not is_number(rate_hz):
            continue
        started = json.dumps([scenario.get("start"), scenario.get("params")], sort_keys=True)
        key = (str(given.get("topic")), str(given.get("of")), started)
        earlier, other_hz, other = before.setdefault(key, (criterion.id, rate_hz, cause))
        if rate_hz != other_hz and (cause == other or not (cause and other)):
            fault = f"{earlier} wants {other_hz:g} Hz on {key[0]}, not {rate_hz:g}"
            yield (*criterion.at, "rate_hz"), fault


def _other_process(criterion: WrittenCriterion, scenarios: Scenarios) -> Iterator[Fault]:
    """Yield names that a node has to have, and that are those of another process."""
    process = criterion.given.get("process")
    starts = [start for one in scenarios.values() for start in starts_of(one)]
    others = {str(start.get("name")) for start in starts} - {str(process)}
    own = [start for start in starts_of(criterion.scenario) if start.get("name") == process]
    for index, name in as_texts(criterion.given.get("names")):
        is_own = any(_words(name) & {*_words(str(process)), *_words(str(one.get("script")))} for one in own)
        if own and not is_own and name.strip("/") in others:
            fault = f"{name} is the name of another process of the rubric, and this is about {process}"
            yield (*criterion.at, "names", index), fault


def _requests(criterion: WrittenCriterion) -> list[object]:
    """Return what the run asks of the service that a criterion is about."""
    calls = [one for _, part, one in services_in(criterion.scenario) if part == "request"]
    return [one.get("request") for one in calls if one.get("service") == criterion.given.get("service")]


def _fewer_answers(criterion: WrittenCriterion) -> Iterator[Fault]:
    """Yield fewer answers than there are calls: they are compared with the first of these."""
    answers, made = len(as_list(criterion.given.get("expect"))), len(_requests(criterion))
    if criterion.check == "service-answers" and 0 < answers < made:
        calls = f"{criterion.run} calls {criterion.given.get('service')} {plural(made, 'time')}"
        fault = f"{calls}, and here are {plural(answers, 'answer')}: they are compared with the first"
        yield (*criterion.at, "expect"), fault


def _asked_for_nothing(criterion: WrittenCriterion) -> Iterator[Fault]:
    """Yield numbers of a request that nothing in the run has, where others of the same field come from the run."""
    at, expect = (*criterion.at, "expect"), criterion.given.get("expect")
    parts = {key: part for key, part in criterion.scenario.items() if key not in {"until", "serves"}}
    sent = {number for _, number in numbers_in((), parts)}
    sent |= {float(text) for _, text in texts_in((), parts) if re.fullmatch(r"-?\d+(\.\d+)?", text)}
    if criterion.check == "service-answers" and isinstance(expect, list):
        yield from _answered_otherwise(at, [as_map(one) for one in expect], _requests(criterion))
    if criterion.check == "calls" and isinstance(expect, dict):
        yield from _asked_once_for_nothing(at, expect, sent, criterion.run)
    if criterion.check != "calls" or not isinstance(expect, list):
        return
    for key in dict.fromkeys(key for one in expect for key in as_map(one)):
        each = [(n, one[key]) for n, one in enumerate(expect) if is_number(as_map(one).get(key))]
        alone = [(n, value) for n, value in each if value not in sent]
        if len(alone) == 1 < len(each):
            number, value = alone[0]
            fault = (
                f"nothing in {criterion.run} has {value:g}, and it has the other numbers that are asked for"
            )
            yield (*at, number, key), fault


def _printed_elsewhere(criterion: WrittenCriterion, scenarios: Scenarios) -> Iterator[Fault]:
    """Yield numbers to print that the grader answers in another run only."""
    name, scenario = criterion.run, criterion.scenario
    here = {number for _, number in numbers_in((), scenario)}
    for key, number in numbers_in(("numbers",), criterion.given.get("numbers")):
        others = [
            other
            for other, one in scenarios.items()
            if other != name and number in {answer for _, answer in numbers_in((), one.get("serves"))}
        ]
        if others and number not in here and scenario.get("serves"):
            yield (
                (*criterion.at, *key),
                f"{number:g} is what {others[0]} answers, and nothing in {name} has it",
            )


def _answered_otherwise(at: KeyPath, expect: list[dict[str, Any]], requests: list[object]) -> Iterator[Fault]:
    """Yield the one number of a field of the answers that its request has with another sign or with a digit more, where
    the requests have all others of that field."""
    asked = [{number for _, number in numbers_in((), one)} for one in requests]
    for key in dict.fromkeys(key for one in expect for key in one):
        pairs = enumerate(zip(expect, asked, strict=False))
        each = [(n, one[key], sent) for n, (one, sent) in pairs if is_number(one.get(key))]
        alone = [(n, value, sent) for n, value, sent in each if value not in sent]
        if len(alone) == 1 < len(each):
            number, value, sent = alone[0]
            near = next((value / by for by in SHIFTS if round(value / by, 9) in sent), None)
            if near is not None:
                yield (*at, number, key), f"nothing in its request is {value:g}, and {near:g} is"


def _asked_once_for_nothing(
    at: KeyPath, expect: dict[str, Any], sent: set[float], name: str
) -> Iterator[Fault]:
    """Yield the one number of a request that the run does not have, where a number with another sign or a digit more is
    there."""
    alone = [(key, value) for key, value in expect.items() if is_number(value) and value not in sent]
    for key, value in alone:
        near = next((value / by for by in SHIFTS if round(value / by, 9) in sent), None)
        if near is not None and len(alone) == 1:
            yield (*at, key), f"nothing in {name} has {value:g}, and it has {near:g}"


def _not_private(scenarios: Scenarios, handout: str) -> Iterator[Fault]:
    """Yield parameters without a node's name before them that the handout calls private."""
    for name, scenario in scenarios.items():
        for at, one in set_in(scenario):
            param = str(one.get("name"))
            if param.count("/") == 1 and re.search(rf"~{re.escape(param[1:])}\b", handout):
                fault = f"the handout has ~{param[1:]}, which is below the node's own name: /<node>{param}"
                yield ("scenarios", name, *at, "name"), fault


def _unasked_bits(criteria: Criteria, scenarios: Scenarios) -> Iterator[Fault]:
    """Yield scripts that no criterion asks to be executable, where one asks it of another script: the grader sets the
    bit of each before it runs them."""
    asked = {str(one.given.get("path")) for one in criteria if one.check == "executable"}
    told = set(asked)
    for name, scenario in scenarios.items():
        for number, start in as_maps(scenario.get("start")):
            script = str(start.get("script"))
            if asked and script.endswith(".py") and script not in told:
                told.add(script)
                fault = f"no criterion asks whether {script} can be run, as one does of {min(asked)}"
                yield ("scenarios", name, "start", number, "script"), fault


OF_NODES = frozenset({"node-lives", "node-name", "launch-runs", "launch-connects"})
"""Checks of whether the nodes of a run are there at all."""


def _without_requires(criteria: Criteria) -> Iterator[Fault]:
    """Yield criteria of a run that require no criterion of a run, where another one is about its node: what keeps the
    node from starting would be charged to whichever of them comes first."""
    by_id = {criterion.id: criterion for criterion in criteria}
    for criterion in criteria:
        process = criterion.given.get("process")
        if not criterion.has_run or criterion.check in {*OF_NODES, "manual"}:
            continue
        of_nodes = [other for other in criteria if other.run == criterion.run and other.check in OF_NODES]
        nodes = [one for one in of_nodes if process is None or one.given.get("process", process) == process]
        if nodes and not any(one.has_run for one in _all_required(criterion, by_id)):
            root = nodes[0].id
            fault = f"where the node does not start, {root} explains it: write requires: [{root}]"
            yield (*criterion.place, "requires" if "requires" in criterion.data else "id"), fault


def _all_required(
    criterion: WrittenCriterion, by_id: Mapping[str, WrittenCriterion]
) -> list[WrittenCriterion]:
    """Return what a criterion requires, and what that requires in turn."""
    names = list(criterion.requires)
    for name in names:  # which grows as it is gone through
        names += [one for one in (by_id[name].requires if name in by_id else ()) if one not in names]
    return [by_id[name] for name in names if name in by_id]


SENDS = ("publish", "transform", "play", "call", "action", "type")
OF_ANSWERS = ("field-equals", "field-bounds", "reacts", "hears", "prints", "transform")
"""Checks of what a node does with what it hears."""


def _without_input(criteria: Criteria, scenarios: Scenarios) -> Iterator[Fault]:
    """Yield runs in which the grader sends nothing, where it sends something in every other run of the same
    processes."""
    for name, scenario in scenarios.items():
        others = {
            n: one for n, one in scenarios.items() if n != name and _processes(one) == _processes(scenario)
        }
        judged = any(one.run == name and one.check in OF_ANSWERS for one in criteria)
        waits = any("wait" in step for _, step in as_maps(scenario.get("steps")))
        if others and judged and waits and not _sends(scenario) and all(map(_sends, others.values())):
            fault = (
                f"nothing is sent in {name}, and in {join_words(others)} something is: is a step left out?"
            )
            yield ("scenarios", name, "steps"), fault


def _sends(scenario: dict[str, Any]) -> bool:
    """Return whether the grader, or a program beside the student's, sends the student's nodes anything."""
    steps = any(given_steps(scenario, kind) for kind in SENDS)
    programs = any(start.get("program") for start in starts_of(scenario))
    return steps or programs or any(scenario.get(key) for key in ("probes", "calls", "serves", "params"))


def _cancelled_goal(criterion: WrittenCriterion) -> Iterator[Fault]:
    """Yield goals that a step cancels and that should succeed."""
    given, sent = criterion.given, given_steps(criterion.scenario, "action")
    goals = [one for one in sent if one.get("name") == given.get("action")]
    number = given.get("goal", 1)
    if not isinstance(number, int) or not 0 < number <= len(goals):
        return
    after_s = goals[number - 1].get("cancel_after_s")
    if is_number(after_s) and given.get("status", "SUCCEEDED") == "SUCCEEDED" and "feedback" not in given:
        fault = f"the step cancels this goal after {after_s:g} s: is its status PREEMPTED?"
        yield (*criterion.at, "status" if "status" in given else "goal"), fault


def _added_up(criterion: WrittenCriterion) -> Iterator[Fault]:
    """Yield places that are read of velocities, beside a program that says where the robot is."""
    given, topics = criterion.given, topics_of_programs(criterion.scenario)
    poses = [topic for topic, kind in topics.items() if kind in POSES and topic != "/odom"]
    is_place = criterion.check in {"ends-at", "stays-within"} and given.get("relative") is not True
    if is_place and poses and topics.get(str(given.get("topic"))) in VELOCITIES:
        fault = f"velocities are added up from (0, 0): the place itself is on {join_words(poses)}"
        yield (*criterion.at, "topic"), fault


def _set_otherwise(criterion: WrittenCriterion) -> Iterator[Fault]:
    """Yield parameters that the scenario sets to one value, and that should have another one."""
    name, value = criterion.given.get("name"), criterion.given.get("value")
    named = [one for _, one in set_in(criterion.scenario) if one.get("name") == name]
    values = [one["value"] for one in named if "value" in one]
    if criterion.check == "param-value" and values and value not in values:
        yield (*criterion.at, "value"), f"{criterion.run} sets {name} to {json.dumps(values[-1])}"


def _other_run(criterion: WrittenCriterion, criteria: Criteria) -> Iterator[Fault]:
    """Yield topics that another run is about, with other processes, and that this one nowhere names."""
    given, here = criterion.given, criterion.scenario
    topic = given.get("topic") or next(iter(as_map(given.get("topics"))), None)
    if not isinstance(topic, str) or "start" not in here or _is_named(topic, here):
        return
    for other in criteria:
        is_same = other.given.get("topic") == topic and other.run != criterion.run
        there = other.scenario
        if is_same and _is_named(topic, there) and _processes(there).isdisjoint(_processes(here)):
            fault = f"nothing in {criterion.run} names {topic}, and {other.run} does"
            yield (*criterion.place, "scenario"), f"{fault}: is this criterion for that run?"
            return


def _is_named(topic: str, scenario: dict[str, Any]) -> bool:
    named = any(text == topic or topic in text.split(":=") for _, text in texts_in((), scenario))
    return named or topic in topics_of_programs(scenario)


def _processes(scenario: dict[str, Any]) -> set[str]:
    """Return what a scenario starts of the student's, each with the arguments that rename its topics."""
    keys = ("script", "launch", "load", "built", "package")
    return {
        json.dumps(
            [[start.get(key) for key in keys], [a for _, a in as_texts(start.get("args")) if a[:1] != "_"]]
        )
        for start in starts_of(scenario)
        if start.get("program") is None
    }
