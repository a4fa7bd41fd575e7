"""What a criterion demands of a node that nearly every node meets, or that a correct one may miss: warnings."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import PurePosixPath
from typing import Any

from grader.checks.support.fields import is_number
from grader.rubric.definitions import services_in
from grader.rubric.simulators import set_in
from grader.rubric.started import starts_of
from grader.rubric.step_faults import count_causes, given_steps
from grader.rubric.yaml_lines import (
    Fault,
    KeyPath,
    WrittenCriterion,
    as_list,
    as_map,
    as_maps,
    as_texts,
    texts_in,
)
from grader.wording import join_words, plural

Criteria = Sequence[WrittenCriterion]
Scenarios = Mapping[str, dict[str, Any]]

SHORTEST_S = {"reacts": 0.1, "action-result": 0.2, "stamps": 0.02}
"""By check, the shortest time within which a correct node's answer comes on a busy machine."""
STRICT, LAX = 0.02, 0.5
"""Of a rate, the least tolerance that a busy machine keeps, and one with which half or twice the rate passes."""
CLOSE_DEG = 0.5
CLOSE_M = 0.02
"""No student's robot stops as near to its goal as this."""
OF_VALUES = frozenset({"field-equals", "field-bounds", "reacts"})
UNSET = frozenset({"linear.y", "linear.z", "angular.x", "angular.y"})
SIDEWAYS = re.compile(r"sideways|sideward|holonomic|strafe|drone|quadrotor|\by\b|up\b", re.IGNORECASE)
EMPTY = "std_srvs/Empty"


def demand_warnings(rubric: dict[str, Any], criteria: Criteria, scenarios: Scenarios) -> Iterator[Fault]:
    """Yield what may be such a demand."""
    handout = str(rubric.get("handout") or "")
    yield from _ends_and_lives(criteria, scenarios)
    yield from _answers_waited_for(scenarios, handout)
    yield from _more_values(criteria, handout)
    yield from _left_out(scenarios)
    yield from _fewer_arguments(scenarios)
    yield from _numbers_as_text(scenarios)
    yield from _other_lengths(criteria)
    yield from _other_counters(criteria)
    yield from _unlike_others(criteria)
    yield from _never_changed(criteria)
    yield from _in_another_order(criteria, scenarios)
    yield from _other_owners(criteria, scenarios)
    yield from _late(as_map(rubric.get("late")))
    yield from _waited_for_nothing(criteria, scenarios)
    yield from _without_its_node(rubric, scenarios)
    yield from _silent_anyway(criteria)
    yield from _other_ends(criteria)
    yield from _other_rows(criteria)
    yield from _launched_nodes(criteria, scenarios)
    yield from _other_transforms(criteria, scenarios)
    for criterion in criteria:
        yield from _hard(criterion)
        yield from _easy(criterion)
        yield from _impossible(criterion)
        yield from _not_its_name(criterion, rubric)
        if criterion.check == "connected":
            yield from _process_for_node(criterion, criteria)
        if criterion.check == "service-answers":
            yield from _any_answer(criterion)
        if criterion.check in OF_VALUES and not SIDEWAYS.search(handout):
            yield from _never_set(criterion)


def _hard(criterion: WrittenCriterion) -> Iterator[Fault]:
    """Yield demands that a correct node may miss."""
    at, check, given = criterion.at, criterion.check, criterion.given
    within_s, least_s = given.get("within_s"), SHORTEST_S.get(check)
    if is_number(within_s) and least_s is not None and within_s < least_s:
        fault = f"{within_s:g} s is very short: on a busy machine a correct package may need more"
        yield (*at, "within_s"), fault
    tolerance, tolerance_m = given.get("tolerance"), given.get("tolerance_m")
    if check == "rate" and is_number(tolerance) and tolerance < STRICT:
        fault = f"{tolerance:g} is very strict: on a busy machine a correct package may miss it"
        yield (*at, "tolerance"), fault
    for key in ("heading_tolerance_deg", "tolerance_deg"):
        if is_number(given.get(key)) and given[key] < CLOSE_DEG:
            yield (*at, key), f"{given[key]:g} is very strict: it is in degrees"
    if check in {"ends-at", "path"} and is_number(tolerance_m) and tolerance_m < CLOSE_M:
        yield (*at, "tolerance_m"), f"{tolerance_m:g} m is very strict: no robot keeps it"


def _easy(criterion: WrittenCriterion) -> Iterator[Fault]:
    """Yield demands that a wrong node meets too."""
    at, check, given = criterion.at, criterion.check, criterion.given
    tolerance = given.get("tolerance")
    if check == "rate" and is_number(tolerance) and tolerance >= LAX and is_number(given.get("rate_hz")):
        rates = [given["rate_hz"] * (1 + sign * tolerance) for sign in (-1, 1)]
        fault = f"all rates from {rates[0]:g} to {rates[1]:g} Hz pass: it is a share of the rate"
        yield (*at, "tolerance"), fault
    if check == "node-lives" and given.get("min_s") == 0:
        yield (*at, "min_s"), "is 0 s: a node that ends at once passes"
    if check == "action-result" and given.get("feedback") == 0:
        fault = "asks for none: leave it out, or give how many messages of feedback have to come"
        yield (*at, "feedback"), fault
    for place, asked in criterion.conditions:
        value, off = asked.get("value"), asked.get("tolerance")
        if is_number(value) and is_number(off) and off >= abs(value) > 0 and "field" in asked:
            fault = f"is as large as the value, {value:g}: a field that is always 0 passes"
            yield (*place, "tolerance"), fault
    if check == "field-bounds" and is_number(given.get("min")) and given.get("min") == given.get("max"):
        yield (*at, "max"), f"is min, too: only {given['min']:g} is within these bounds"
    if check == "stamps" and is_number(within_s := given.get("within_s")):
        lasting_s = as_map(criterion.scenario.get("until")).get("window_s")
        if is_number(lasting_s) and within_s >= lasting_s:
            fault = f"the run's window is {lasting_s:g} s: the time of the first message passes for all"
            yield (*at, "within_s"), fault


def _silent_anyway(criteria: Criteria) -> Iterator[Fault]:
    """Yield silence that is asked of a node, without a criterion that has to see it publish on this topic."""
    known = {one.id: one for one in criteria}
    for criterion in criteria:
        topic = as_map(criterion.given.get("effect")).get("topic")
        if criterion.check != "reacts" or criterion.given.get("never") is not True:
            continue
        needed = [name for name in criterion.requires if name in known]
        for name in needed:
            needed += [n for n in known[name].requires if n in known and n not in needed]
        if not any(_sees(known[name], topic) for name in needed):
            fault = f"a node that never publishes on {topic} passes: let it require a criterion that sees it publish"
            yield (*criterion.at, "never"), f"{fault} there"


def _sees(criterion: WrittenCriterion, topic: object) -> bool:
    """Return whether a criterion wants messages of the student's on the topic."""
    given = criterion.given
    return topic in {given.get("topic"), as_map(given.get("effect")).get("topic")} and not given.get("never")


def _impossible(criterion: WrittenCriterion) -> Iterator[Fault]:
    """Yield bounds within which no robot drives forward, and constants that cannot be told from each other."""
    at, check, given = criterion.at, criterion.check, criterion.given
    is_forward = given.get("field") == "linear.x" and str(given.get("topic")).endswith("cmd_vel")
    if check == "field-bounds" and is_forward and is_number(given.get("max")) and given["max"] <= 0:
        yield (*at, "max"), f"is {given['max']:g}: no robot may drive forward"
    constants = as_map(given.get("constants"))
    for number, (name, value) in enumerate(constants.items()):
        same = next((other for other in list(constants)[:number] if constants[other] == value), None)
        if check == "definition" and same is not None:
            yield (*at, "constants", name), f"has the value of {same}"


def _not_its_name(criterion: WrittenCriterion, rubric: dict[str, Any]) -> Iterator[Fault]:
    """Yield names that end in digits, where the rubric has parameters or services below the name without them."""
    if criterion.given.get("anonymous") != "required":
        return
    names = [name.strip("/") for _, name in as_texts(criterion.given.get("names"))]
    texts = [text for path, text in texts_in((), rubric) if path[:1] in {("scenarios",), ("criteria",)}]
    below = next((text for text in texts for name in names if re.fullmatch(rf"/{name}/\w+", text)), None)
    if below is not None:
        fault = f"is required, and the rubric names {below}, which is below a name without digits"
        yield (*criterion.at, "anonymous"), fault


def _never_set(criterion: WrittenCriterion) -> Iterator[Fault]:
    """Yield fields of velocities that a robot on wheels leaves at 0, and of which 0 is asked."""
    for at, asked in criterion.conditions:
        field, value = asked.get("field"), asked.get("value")
        least, most = asked.get("min", 0), asked.get("max", 0)
        bounded = is_number(least) and is_number(most) and least <= 0 <= most
        is_zero = value == 0 if "value" in asked else bounded
        is_velocity = field in UNSET and str(asked.get("topic")).endswith("cmd_vel")
        if is_velocity and is_zero and at[-1] != "cause":
            fault = f"{field} is 0 in each message of a robot on wheels: a node that never sets it passes"
            yield (*at, "field"), fault


def _any_answer(criterion: WrittenCriterion) -> Iterator[Fault]:
    expect, service = criterion.given.get("expect"), criterion.given.get("service")
    services = services_in(criterion.scenario)
    kinds = {str(one.get("type")) for _, _, one in services if one.get("service") == service}
    if isinstance(expect, list) and expect and not any(expect) and kinds - {EMPTY}:
        yield (*criterion.at, "expect"), "is right for any answer: give the fields that it has to have"


def _ends_and_lives(criteria: Criteria, scenarios: Scenarios) -> Iterator[Fault]:
    """Yield runs that wait for the end of a process, while a criterion wants the same one to stay alive."""
    lives: dict[str, str] = {}
    for criterion in criteria:
        if criterion.check == "node-lives":
            process = criterion.given.get("process")
            found = (start for start in starts_of(criterion.scenario) if start.get("name") == process)
            lives.update({_what(start): criterion.id for start in found})
    for name, scenario in scenarios.items():
        starts = {str(start.get("name")): start for start in starts_of(scenario)}
        for index, ended in as_texts(as_map(scenario.get("until")).get("ended")):
            stopped = any(
                step.get(kind) == ended
                for _, step in as_maps(scenario.get("steps"))
                for kind in ("stop", "kill")
            )
            if ended in starts and (of := lives.get(_what(starts[ended]))) and not stopped:
                fault = f"{of} wants {ended} to stay alive, and this run waits for its end"
                yield ("scenarios", name, "until", "ended", index), fault


def _what(start: dict[str, Any]) -> str:
    return json.dumps([start.get(key) for key in ("script", "launch", "package", "args")])


PERIODIC = re.compile(r"\bHz\b|\b(?:a|per|each|every) (?:\w+ )?second\b|times", re.IGNORECASE)
ANSWERED_TIMES = 2
"""A node that answers each message may publish so many times as many, and what it publishes at its start."""


def _answers_waited_for(scenarios: Scenarios, handout: str) -> Iterator[Fault]:
    """Yield counts of messages that come only if the node publishes many for each that it hears, where the handout has
    no rate."""
    if PERIODIC.search(handout):
        return
    for name, scenario in scenarios.items():
        sent = _sent(scenario)
        for topic, count in as_map(as_map(scenario.get("until")).get("messages")).items():
            if sent and isinstance(count, int) and count > ANSWERED_TIMES * (sent + 1):
                fault = f"{name} sends {plural(sent, 'message')}, and waits for {count}: is that meant?"
                yield ("scenarios", name, "until", "messages", topic), fault


def _more_values(criteria: Criteria, handout: str) -> Iterator[Fault]:
    """Yield more values than the run sends messages, where the node answers each with one, or has causes to change."""
    paced = {one.given.get("topic") for one in criteria if "rate_hz" in one.given}
    for criterion in criteria:
        sent, count = _sent(criterion.scenario), len(as_list(criterion.given.get("values")))
        causes = count_causes(criterion.scenario)
        if causes is not None and count - 1 > causes and criterion.given.get("topic") not in paced:
            gives = f"the steps of {criterion.run} give the node {plural(causes, 'cause')} to change it"
            yield (*criterion.at, "values"), f"are {count}, and {gives}: does it change by itself?"
            continue
        if sent and count == sent + 1 and not PERIODIC.search(handout) and re.search(r"\beach\b", handout):
            fault = f"are {count}, and {criterion.run} sends {plural(sent, 'message')}"
            yield (*criterion.at, "values"), fault


def _process_for_node(criterion: WrittenCriterion, criteria: Criteria) -> Iterator[Fault]:
    """Yield ends of a connection that are named as a process of the scenario, and as no node that a criterion names."""
    scripts = {start.get("name") for start in starts_of(criterion.scenario) if start.get("script")}
    named = {name for one in criteria for _, name in as_texts(one.given.get("names"))}
    for end in ("publisher", "subscriber"):
        if (name := criterion.given.get(end)) in scripts - named:
            fault = f"{name} is a process here: is a node of this name asked for? It is what counts"
            yield (*criterion.at, end), fault


def _other_ends(criteria: Criteria) -> Iterator[Fault]:
    """Yield ends of a path that have the numbers of the same run's goal, with other signs or in another order."""
    goals = [one for one in criteria if one.check == "ends-at"]
    for criterion in criteria:
        points = as_list(criterion.given.get("points")) if criterion.check == "path" else []
        for other in goals if points else ():
            end, goal = as_list(points[-1]), as_list(other.given.get("goal"))
            is_same = other.run == criterion.run and other.given.get("topic") == criterion.given.get("topic")
            if (
                "asked_on" in other.given
                or not is_same
                or not all(map(is_number, (*end, *goal)))
                or end == goal
            ):
                continue
            if sorted(map(abs, end)) == sorted(map(abs, goal)):
                fault = f"is {end}, and {other.id} wants it to end at {goal}"
                yield (*criterion.at, "points", len(points) - 1), fault


def _other_rows(criteria: Criteria) -> Iterator[Fault]:
    """Yield more rows than the run sends messages, of which the program is to write each; and bounds that what it sends
    is not within."""
    for criterion in criteria:
        at, scenario = criterion.at, criterion.scenario
        rows, count = criterion.given.get("rows_at_least"), _sent(scenario)
        if is_number(rows) and 0 < count < rows <= 2 * count and len(starts_of(scenario)) == 1:
            yield (*at, "rows_at_least"), f"is {rows}, and {criterion.run} sends {plural(count, 'message')}"
        bounds = as_map(criterion.given.get("bounds"))
        sent = [one for step in given_steps(scenario, "publish") for one in as_list(step.get("values"))]
        for column, bound in bounds.items() if len(bounds) == 1 and all(map(is_number, sent)) else ():
            low, high = (as_map(bound).get(key) for key in ("min", "max"))
            outside = [
                one for one in sent if (is_number(low) and one < low) or (is_number(high) and one > high)
            ]
            if 0 < len(outside) < len(sent):
                fault = f"{criterion.run} sends {outside[0]:g}, which is not within them"
                yield (*at, "bounds", column), fault


def _sent(scenario: dict[str, Any]) -> int:
    """Return how many messages the grader sends in a run; 0 where it sends none, or something else may."""
    is_script = all(start.get("script") for start in starts_of(scenario))
    if not is_script or given_steps(scenario, "play"):
        return 0
    number = 0
    for one in (*given_steps(scenario, "publish"), *(probe for _, probe in as_maps(scenario.get("probes")))):
        values = one.get("values")
        if {"count", "duration_s", "background", "times", "text", "integers", "among"} & one.keys():
            return 0
        number += len(values) if isinstance(values, list) else 1
    return number


def _left_out(scenarios: Scenarios) -> Iterator[Fault]:
    """Yield fields that one call of a service leaves out, or one goal of an action, and that all others give."""
    asked: dict[str, list[tuple[KeyPath, dict[str, Any]]]] = {}
    for name, scenario in scenarios.items():
        for at, part, one in services_in(scenario):
            if part == "request":
                asked.setdefault(str(one.get("service")), []).append(
                    (("scenarios", name, *at, part), as_map(one.get(part)))
                )
        for index, step in as_maps(scenario.get("steps")):
            one = as_map(step.get("action"))
            at = ("scenarios", name, "steps", index, "action", "goal")
            if one:
                asked.setdefault(str(one.get("name")), []).append((at, as_map(one.get("goal"))))
    for each in asked.values():
        for place, (at, given) in enumerate(each):
            others = [other for n, (_, other) in enumerate(each) if n != place]
            lacking = set.intersection(*map(set, others)) - given.keys() if len(others) > 1 else set()
            if given and lacking:
                yield at, f"leaves out {join_words(sorted(lacking))}, which the others give: it is 0 or empty"


def _fewer_arguments(scenarios: Scenarios) -> Iterator[Fault]:
    """Yield starts of a script with another number of arguments than in other runs."""
    first: dict[str, int] = {}
    for name, scenario in scenarios.items():
        for index, start in as_maps(scenario.get("start")):
            args = [text for _, text in as_texts(start.get("args")) if ":=" not in text]
            if args and isinstance(script := start.get("script"), str):
                other = first.setdefault(script, len(args))
                if other != len(args):
                    fault = f"{plural(len(args), 'argument')}, and {script} is started with {other} elsewhere"
                    yield ("scenarios", name, "start", index, "args"), fault


NUMBER = re.compile(r"-?\d+(?:\.\d+)?")


def _numbers_as_text(scenarios: Scenarios) -> Iterator[Fault]:
    """Yield parameters that are set to a number in quotes."""
    for name, scenario in scenarios.items():
        for at, one in set_in(scenario):
            value = one.get("value")
            if isinstance(value, str) and NUMBER.fullmatch(value):
                fault = f'"{value}" in quotes is text: a node that reads a number needs {value}, without them'
                yield ("scenarios", name, *at, "value"), fault


def _other_lengths(criteria: Criteria) -> Iterator[Fault]:
    """Yield lists of another length than an earlier criterion wants of the same field in the same run."""
    first: dict[tuple[str, ...], tuple[str, int]] = {}
    for criterion in criteria:
        given = criterion.given
        value = given.get("value")
        if criterion.check == "field-equals" and isinstance(value, list):
            key = (criterion.run, str(given.get("topic")), str(given.get("field")))
            earlier, length = first.setdefault(key, (criterion.id, len(value)))
            if length != len(value):
                fault = (
                    f"has {plural(len(value), 'item')}, and {earlier} has {length} for {key[2]} of {key[1]}"
                )
                yield (*criterion.at, "value"), fault


def _other_counters(criteria: Criteria) -> Iterator[Fault]:
    """Yield ends of a counter that an earlier criterion has otherwise."""
    first: dict[tuple[str, str], tuple[str, object]] = {}
    for criterion in criteria:
        given = criterion.given
        for key in ("minimum", "maximum") if criterion.check.startswith("counter-") else ():
            if key in given:
                topic = str(given.get("topic"))
                earlier, value = first.setdefault((topic, key), (criterion.id, given[key]))
                if value != given[key]:
                    yield (*criterion.at, key), f"is {given[key]}, and {earlier} has {value}"


def _late(late: dict[str, Any]) -> Iterator[Fault]:
    lost, cap = late.get("lost"), late.get("cap", 100)
    if is_number(lost) and is_number(cap) and cap < lost:
        fault = f"{cap:g} is less than the {lost:g} that are lost for the first {late.get('per', 'day')}"
        yield ("late", "cap"), fault
    if late.get("cut_off_days") == 0 and lost:
        yield ("late", "cut_off_days"), "with 0 nothing counts that is late: lost and per then mean nothing"


def _unlike_others(criteria: Criteria) -> Iterator[Fault]:
    """Yield values of a field that are ten or a hundred times what other criteria want of it."""
    wanted: list[tuple[KeyPath, tuple[str, str], float]] = []
    for criterion in criteria:
        for at, asked in criterion.conditions:
            if is_number(asked.get("value")) and "field" in asked:
                place = str(asked.get("topic")), str(asked["field"])
                wanted.append(((*at, "value"), place, float(asked["value"])))
    for number, (at, place, value) in enumerate(wanted):
        others = [other for n, (_, there, other) in enumerate(wanted) if there == place and n != number]
        near = [other for other in others if other and round(value / other, 6) in {10, 100, 0.1, 0.01}]
        if near and value not in others and others.index(near[0]) < number:
            yield at, f"is {value:g}, and another criterion wants {near[0]:g} of {place[1]} of {place[0]}"


def _never_changed(criteria: Criteria) -> Iterator[Fault]:
    """Yield values of the first and of the last message that are the same: a node that never changes them passes."""
    first: dict[tuple[str, ...], tuple[str, object]] = {}
    for criterion in criteria:
        given = criterion.given
        when, value = given.get("when"), given.get("value")
        key = (criterion.run, str(given.get("topic")), str(given.get("field")))
        if criterion.check == "field-equals" and when in ("first", "last"):
            earlier, other = first.setdefault(key, (criterion.id, value))
            is_same = value == other and isinstance(value, bool | int | float | str)
            if earlier != criterion.id and is_same:
                fault = f"{earlier} wants {json.dumps(value)} too: a node that never changes it passes both"
                yield (*criterion.at, "value"), fault


def _in_another_order(criteria: Criteria, scenarios: Scenarios) -> Iterator[Fault]:
    """Yield arguments and requests that are the numbers of another one, in another order."""
    found: list[tuple[KeyPath, tuple[str, ...]]] = []
    for name, scenario in scenarios.items():
        for index, start in as_maps(scenario.get("start")):
            args = tuple(text for _, text in as_texts(start.get("args")))
            found.append((("scenarios", name, "start", index, "args"), args))
        for at, part, one in services_in(scenario):
            if part == "request":
                found.append((("scenarios", name, *at, part), _as_arguments(one.get(part))))
    for criterion in criteria:
        if criterion.check == "calls":
            expect = criterion.given.get("expect")
            found.append(((*criterion.at, "expect"), _as_arguments(expect)))
    for number, (at, values) in enumerate(found):
        others = [
            other for n, (_, other) in enumerate(found) if n != number and sorted(other) == sorted(values)
        ]
        earlier = any(sorted(other) == sorted(values) for _, other in found[:number])
        if len(set(values)) > 1 and all(map(_is_known, values)) and earlier and values not in others:
            yield at, f"has {join_words(list(values))}: elsewhere these are in another order"


def _as_arguments(value: object) -> tuple[str, ...]:
    return tuple(
        f"{{made_up: {one['made_up']}}}" if isinstance(one, dict) and "made_up" in one else str(one)
        for one in as_map(value).values()
    )


def _is_known(text: str) -> bool:
    return NUMBER.fullmatch(text) is not None or text.startswith("{made_up:")


def _other_owners(criteria: Criteria, scenarios: Scenarios) -> Iterator[Fault]:
    """Yield parameters below another name than all others of the run, and than that of its node."""
    for name, scenario in scenarios.items():
        given = [(at, str(one.get("name")).strip("/").split("/")) for at, one in set_in(scenario)]
        owners = [parts[0] for _, parts in given if len(parts) > 1]
        about = [one.given for one in criteria if one.run == name]
        nodes = {node for one in about for _, node in as_texts(one.get("names"))}
        programs = {str(start.get("program")).rpartition("/")[2] for start in starts_of(scenario)}
        for at, parts in given:
            others = {owner for owner in owners if owner != parts[0]}
            is_alone = len(parts) > 1 and owners.count(parts[0]) == 1
            if is_alone and len(others) == 1 and others <= nodes - programs:
                fault = (
                    f"is below {parts[0]}, and the node is called {min(others)}, as for the other parameters"
                )
                yield ("scenarios", name, *at, "name"), fault


TOPICS_WAITED = ("connected", "topics")


def _waited_for_nothing(criteria: Criteria, scenarios: Scenarios) -> Iterator[Fault]:
    """Yield topics that a run waits for and no criterion of it judges, where a criterion judges another topic that
    nothing in the run names."""
    for name, scenario in scenarios.items():
        until = as_map(scenario.get("until"))
        waited: dict[str, KeyPath] = {topic: ("messages", topic) for topic in as_map(until.get("messages"))}
        waited |= {topic: (key, n) for key in TOPICS_WAITED for n, topic in as_texts(until.get(key))}
        named = {text for key, part in scenario.items() for _, text in texts_in((), part)}
        about = [one.given for one in criteria if one.run == name]
        judged = {text for one in about for _, text in texts_in((), one)}
        topics = sorted({str(one["topic"]) for one in about if "topic" in one} - named)
        has_program = any(start.get("program") for start in starts_of(scenario))
        for topic, at in waited.items():
            near = [one for one in topics if _is_beside(topic, one) or _is_elsewhere(topic, one)]
            if topic not in judged and near and not has_program:
                fault = f"no criterion of {name} is about {topic}, and one is about {near[0]}: is that meant?"
                yield ("scenarios", name, "until", *at), fault


def _is_beside(topic: str, other: str) -> bool:
    is_as_deep = topic.count("/") == other.count("/")
    return is_as_deep and topic.rpartition("/")[0] == other.rpartition("/")[0]


def _is_elsewhere(topic: str, other: str) -> bool:
    """Return whether the two differ in one part between slashes, which one of them has besides."""
    short, long = sorted((topic.split("/"), other.split("/")), key=len)
    return len(long) == len(short) + 1 and any(long[:n] + long[n + 1 :] == short for n in range(len(long)))


def _without_its_node(rubric: dict[str, Any], scenarios: Scenarios) -> Iterator[Fault]:
    """Yield topics that a run waits for beside an instructor's tests, and that are named as a script which it does not
    start."""
    texts = [text for _, text in texts_in((), rubric)]
    scripts = {PurePosixPath(text).stem: text for text in texts if re.fullmatch(r"[\w./-]+\.py", text)}
    for name, scenario in scenarios.items():
        starts = starts_of(scenario)
        if not any(str(start.get("program")).endswith(".test") for start in starts):
            continue
        started = {PurePosixPath(str(start.get("script"))).stem for start in starts}
        if any(start.get("launch") or start.get("built") for start in starts):
            continue
        for topic in as_map(as_map(scenario.get("until")).get("messages")):
            word = str(topic).rpartition("/")[2]
            if word in scripts and word not in started:
                fault = f"{name} does not start {scripts[word]}: is it who publishes this?"
                yield ("scenarios", name, "until", "messages", topic), fault


def _launched_nodes(criteria: Criteria, scenarios: Scenarios) -> Iterator[Fault]:
    """Yield counts of nodes of a launch file that are more than the criterion about it names, and programs of the
    rubric's among these that another run starts from another package."""
    programs = [str(start.get("program")) for one in scenarios.values() for start in starts_of(one)]
    owners = {PurePosixPath(program).stem: program.partition("/")[0] for program in programs}
    for criterion in criteria:
        nodes, scenario = as_map(criterion.given.get("nodes")), criterion.scenario
        for node, package in nodes.items():
            owner = owners.get(str(node).rpartition("/")[2])
            if owner and isinstance(package, str) and package != owner:
                yield (*criterion.at, "nodes", node), f"is of {owner} elsewhere in the rubric"
        count = as_map(scenario.get("until")).get("nodes")
        if nodes and isinstance(count, int) and count > len(nodes) and len(starts_of(scenario)) == 1:
            fault = f"{criterion.id} names {plural(len(nodes), 'node')}: the run waits for more than these"
            yield ("scenarios", criterion.run, "until", "nodes"), fault


def _other_transforms(criteria: Criteria, scenarios: Scenarios) -> Iterator[Fault]:
    """Yield transforms that have to move and that the rubric itself sends as static ones, or the other way round."""
    sent: dict[tuple[str, str], bool] = {}
    for scenario in scenarios.values():
        for one in given_steps(scenario, "transform"):
            sent[(str(one.get("parent")), str(one.get("child")))] = one.get("static") is True
    for criterion in criteria:
        given = criterion.given
        is_static = sent.get((str(given.get("parent")), str(given.get("child"))))
        asked = given.get("static") if criterion.check == "transform" else None
        if is_static is not None and isinstance(asked, bool) and asked != is_static:
            kind = "static" if is_static else "not static"
            yield (*criterion.at, "static"), f"elsewhere the rubric sends this transform, and it is {kind}"
        parents = {parent for parent, child in sent if child == given.get("child")} - {given.get("parent")}
        is_direct = criterion.check == "transform" and given.get("through") is not True
        if is_direct and is_static is None and parents:
            fault = (
                f"elsewhere {given.get('child')} is in {join_words(sorted(parents))}: a frame has one parent"
            )
            yield (*criterion.at, "parent"), fault
