"""What a rubric names has to be there: in the scenario that a criterion judges, or on some machine.

An instructor's slip (a process, a topic, a type that is nowhere) would else cost every student the criterion's points.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import PurePosixPath
from typing import Any, TypeGuard

from pydantic import ValidationError

from grader.checks.registry import Check, Reference
from grader.checks.support.topics import READ_TOO, SYSTEM_TOPICS
from grader.ros_packages import TypeKind, ros_packages
from grader.rubric.arguments import argument_faults
from grader.rubric.frames import frame_faults
from grader.rubric.message_fields import field_faults, services_in
from grader.rubric.scenario import PROGRAM_PATTERN, ROSTEST_ENDING, TYPE_PATTERN, Scenario, Step, Until
from grader.rubric.spelling import texts_in
from grader.rubric.standins import asked_faults, only_publisher, parameter_faults
from grader.rubric.step_faults import given_steps
from grader.rubric.yaml_lines import Fault, KeyPath, as_map, as_maps, as_texts, packages_in
from grader.wording import closest, did_you_mean, join_words, plural

LAUNCH_ENDINGS = (".launch", ".xml")
OTHER_CONDITIONS = ("messages", "connected", "heard", "nodes", "opened", "ended", "quiet_s")
"""Conditions of `until` that say nothing of how long a run lasts."""
TYPES: Mapping[str, TypeKind] = {"message": "msg", "field": "msg", "service": "srv"}
LIKELY, SURE = 0.6, 0.85
"""How alike two names have to be: to be suggested, and to be taken for one with a slip."""
WRAPS = {"minimum": 0, "maximum": 127, "wraps": 2}
"""Of `counter-wrap`, with their defaults."""
MANY = 3
"""A recording may hold so many times the messages that a scenario waits for, as it is closed a little later."""
FEWEST = 2
"""Of fewer messages than these, nobody sees a rate."""
_DIGITS = re.compile(r"\d+")
_TOPIC = re.compile(r"(?:^|:=)(/[\w/]*\w)")


def reference_faults(rubric: dict[str, Any], checks: Mapping[str, Check]) -> Iterator[Fault]:
    """Yield a fault for everything that is named and not there."""
    scenarios = {name: as_map(one) for name, one in as_map(rubric.get("scenarios")).items()}
    for name, scenario in scenarios.items():
        yield from _outside_faults(("scenarios", name), scenario, rubric)
        found = (*parameter_faults(scenario), *argument_faults(scenario, rubric))
        yield from ((("scenarios", name, *at), fault) for at, fault in found)
    for index, criterion, others in _criteria(rubric):
        check = checks.get(str(criterion.get("check")))
        if check is not None:
            judged = scenarios.get(str(criterion.get("scenario")))
            yield from _criterion_faults(("criteria", index), criterion, check, judged, rubric)
            asked = asked_faults(
                as_map(criterion.get("with")), judged or {}, others | set(_topics_in(judged))
            )
            yield from ((("criteria", index, "with", *at), fault) for at, fault in asked)
    yield from field_faults(rubric)
    yield from frame_faults(rubric)
    yield from _unused_faults(rubric, scenarios, checks)
    yield from _unknown_topics(rubric, scenarios, checks)
    yield from _too_many(rubric, scenarios, checks)
    yield from _too_few(rubric, scenarios)
    yield from _unknown_causes(rubric, scenarios, checks)
    yield from _misspelt_nodes(rubric, scenarios)
    yield from _own_types(rubric)
    yield from _misspelt_scripts(rubric, scenarios)
    yield from _other_goals_and_types(rubric, scenarios)


def _outside_faults(path: KeyPath, scenario: dict[str, Any], rubric: dict[str, Any]) -> Iterator[Fault]:
    """Yield what a scenario asks for that no machine has."""
    for index, start in as_maps(scenario.get("start")):
        launch = start.get("launch")
        if isinstance(launch, str) and not launch.endswith(LAUNCH_ENDINGS):
            yield (
                (*path, "start", index, "launch"),
                f'roslaunch takes the file\'s whole name: "{launch}.launch"',
            )
        for key in ("script", "load"):
            file = start.get(key)
            if isinstance(file, str) and (file.startswith(("/", "~")) or ".." in PurePosixPath(file).parts):
                name = PurePosixPath(file).name
                fault = f"is a path in the student's package, from its folder: scripts/{name}, not {file}"
                yield (*path, "start", index, key), fault
            elif isinstance(file, str) and (whole := _with_ending(file, rubric)):
                yield (
                    (*path, "start", index, key),
                    f"the rubric names {whole} elsewhere: write it with its ending",
                )
        yield from _of_machine((*path, "start", index, "program"), "program", start.get("program"), rubric)
    for at, _, one in services_in(scenario):
        yield from _of_machine((*path, *at, "type"), "service", one.get("type"), rubric)


def _with_ending(file: str, rubric: dict[str, Any]) -> str:
    """Return the name of a Python or YAML file that the rubric names with its ending, where this one has none."""
    path = PurePosixPath(file)
    whole = re.compile(rf"(?<![\w.]){re.escape(path.name)}\.(?:py|ya?ml)(?!\w)")
    texts = [text for _, text in texts_in((), rubric)] if path.name and not path.suffix else []
    return next((match[0] for text in texts if (match := whole.search(text))), "")


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
    elif to == "dependency":
        meant = "" if value in own else closest(value, own, cutoff=SURE)
        fault = f'there is no package "{value}" (did you mean "{meant}"?)' if meant else ""
        fault = fault or ("" if value in own else ros_packages().misspelt(value))
    elif to == "package" and value not in packages_in(rubric):
        fault = f'the lab has no package "{value}"{_instead(value, packages_in(rubric))}'
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
    elif one.to == "kept" and not any(PurePosixPath(value).match(keep) for keep in _kept_patterns(scenario)):
        yield f'{name} keeps no file "{value}"{_instead(value, _kept_patterns(scenario))}; add it to its keeps'
    elif one.to == "set" and not _is_set(value, scenario):
        there = [str(param.get("name")) for _, param in as_maps(scenario.get("params"))]
        yield f"{name} sets no parameter {value}{did_you_mean(value, there)}: add it to its params"
    elif one.to == "node":
        process = as_map(criterion.get("with")).get("process")
        of_process = [start for start in starts if start.get("name") == process or not process]
        yield from _named_otherwise(value, of_process if len(of_process) == 1 else [])
    elif one.to == "published":
        yield from _wrong_sender(value, as_map(criterion.get("with")).get("of", "student"), check, scenario)


def _wrong_sender(topic: str, of: object, check: Check, scenario: dict[str, Any]) -> Iterator[str]:
    """Yield why nobody whose messages are judged sends any."""
    program = only_publisher(topic, scenario)
    if of == "student" and program:
        yield f"{program} publishes on {topic}, and {check.name} judges the student's messages: give it of: program"
    if of == "program" and not any(start.get("program") for start in _starts(scenario)):
        yield f"the scenario starts no program, and {check.name} judges the messages of one (of: program)"


def _named_otherwise(name: str, starts: list[dict[str, Any]]) -> Iterator[str]:
    """Yield which name the arguments of a start give its node, where that is another one."""
    if name.endswith((".py", ".cpp")):
        yield f"is the name of a node, not of its file: write {name.rpartition('.')[0]}"
    for args in (as_texts(start.get("args")) for start in starts):
        given = dict(text.split(":=", 1) for _, text in args if text.startswith(("__ns:=", "__name:=")))
        own = given.get("__name", name.rpartition("/")[2])
        whole = "/".join(["", *given.get("__ns", "").strip("/").split("/"), own]).replace("//", "/")
        if given and "/" + name.strip("/") != whole:
            words = join_words([f"{key}:={text}" for key, text in given.items()])
            yield f"the node is started with {words}: write {whole}"


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
    steps_s = _steps_s(scenario)
    waits = any(until.get(key) for key in OTHER_CONDITIONS)
    if steps_s is None or not isinstance(limit_s, int | float):
        return
    if steps_s and not lasting and not waits:
        longest_s, key = steps_s, "its steps"
    else:
        longest_s = min(max(lasting), limit_s) if lasting and not waits else limit_s
        key = "limit_s" if longest_s == limit_s else "window_s" if "window_s" in until else "alive_s"
        longest_s, key = longest_s + steps_s, f"its steps and {key}" if steps_s else key
    if one.value > longest_s:
        yield f"{one.value:g} s is more than the scenario lasts: {key}, {longest_s:g} s"


def _steps_s(scenario: dict[str, Any]) -> float | None:
    """Return how long a scenario's steps last; None where something of theirs has to come first."""
    total_s = 0.0
    for _, written in as_maps(scenario.get("steps")):
        try:
            step = Step.model_validate_json(json.dumps(written), strict=True)
        except (ValidationError, TypeError):
            return None
        wait = step.wait
        if step.call or step.action or step.play or (wait is not None and wait.seconds is None):
            return None
        if (sent := step.published) is not None and sent.background:
            return None
        total_s += step.lasts_s
    return total_s


def _unused_faults(
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
    named |= {topic for criterion in criteria for topic in READ_TOO.get(str(criterion.get("check")), ())}
    found = [checks.get(str(criterion.get("check"))) for criterion in criteria]
    own = any(check is None or check.source or "evidence" in check.facts for check in found)
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
        steps = [step for _, step in as_maps(scenario.get("steps")) if "wait" not in step]
        there = {*named, *_topics_in(steps)}
        for at, topic in _waits_in_steps(scenario):
            near = "" if topic in there else _near(topic, named, cutoff=SURE)
            if near:
                yield ("scenarios", name, *at), f'no criterion names {topic} (did you mean "{near}"?)'


def _too_many(
    rubric: dict[str, Any], scenarios: dict[str, dict[str, Any]], checks: Mapping[str, Check]
) -> Iterator[Fault]:
    """Yield counts of messages that cannot come before the run's limit, at the rate that a criterion asks for."""
    rates: dict[str, float] = {}
    for _, criterion in as_maps(rubric.get("criteria")):
        given, check = as_map(criterion.get("with")), checks.get(str(criterion.get("check")))
        topic, rate_hz = given.get("topic"), given.get("rate_hz")
        of_rate = check is not None and hasattr(check.params, "rate_bounds")
        if of_rate and isinstance(rate_hz, int | float) and rate_hz > 0:
            rates[str(topic)] = float(rate_hz)
    for name, scenario in scenarios.items():
        until = as_map(scenario.get("until"))
        limit_s = until.get("limit_s", Until.model_fields["limit_s"].default)
        warp = scenario.get("warp", Scenario.model_fields["warp"].default)
        warp = warp if scenario.get("clock") == "warped" else 1
        for topic, count in as_map(until.get("messages")).items():
            if not all(isinstance(n, int | float) for n in (limit_s, warp, count)) or topic not in rates:
                continue
            takes_s = count / rates[topic] / warp
            if takes_s > limit_s:
                fault = f"{count} messages at {rates[topic]:g} Hz take {takes_s:.3g} s, and limit_s is {limit_s:g} s"
                yield ("scenarios", name, "until", "messages", topic), fault


def _too_few(rubric: dict[str, Any], scenarios: dict[str, dict[str, Any]]) -> Iterator[Fault]:
    """Yield wraps, recordings and rates that a scenario with so few messages cannot show."""
    for index, criterion in as_maps(rubric.get("criteria")):
        name, path = str(criterion.get("scenario")), ("criteria", index, "with")
        given, until = as_map(criterion.get("with")), as_map(scenarios.get(name, {}).get("until"))
        counts = {} if {"window_s", "alive_s", "quiet_s"} & until.keys() else as_map(until.get("messages"))
        if criterion.get("check") == "counter-wrap":
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
        if criterion.get("check") == "rate" and _is_number(window_s) and _is_number(rate_hz):
            yield from (((*path, "rate_hz"), fault) for fault in _seldom(rate_hz, window_s))


def _seldom(rate_hz: float, window_s: float) -> Iterator[str]:
    if 0 < window_s * rate_hz < FEWEST:
        each = f"at {rate_hz:g} Hz a message comes each {1 / rate_hz:g} s, and window_s is {window_s:g} s"
        yield f"{each}: it is messages a second"


def _is_number(value: object) -> TypeGuard[float]:
    return isinstance(value, int | float)


def _unknown_causes(
    rubric: dict[str, Any], scenarios: dict[str, dict[str, Any]], checks: Mapping[str, Check]
) -> Iterator[Fault]:
    """Yield causes on topics that nothing in the scenario sends on, and that no other criterion names."""
    for index, criterion, others in _criteria(rubric):
        check, name = checks.get(str(criterion.get("check"))), str(criterion.get("scenario"))
        scenario = scenarios.get(name, {})
        sent = {*SYSTEM_TOPICS, *_topics_in(scenario)}
        open_ = any(start.get("script") is None for start in _starts(scenario)) or "recording" in scenario
        for one in check.references(as_map(criterion.get("with"))) if check else ():
            at = one.path if isinstance(one.value, str) else (*one.path, "topic")
            topic = one.value if isinstance(one.value, str) else as_map(one.value).get("topic")
            if one.to not in {"cause", "heard"} or not isinstance(topic, str) or topic in sent | others:
                continue
            near = _near(topic, sent, cutoff=SURE if open_ else LIKELY)
            if near or not open_:
                meant = f' (did you mean "{near}"?)' if near else ""
                fault = f"nothing in {name} sends on {topic}, and no other criterion names it{meant}"
                yield ("criteria", index, "with", *at), fault


def _own_types(rubric: dict[str, Any]) -> Iterator[Fault]:
    """Yield types of the student's package that are all but one whose file a criterion asks for."""
    criteria = list(as_maps(rubric.get("criteria")))
    files = [str(as_map(c.get("with")).get("file")) for _, c in criteria if c.get("check") == "definition"]
    names, own = {PurePosixPath(file).stem for file in files}, packages_in(rubric)
    typed: list[tuple[KeyPath, dict[str, Any]]] = [
        (("criteria", n, "with"), as_map(c.get("with"))) for n, c in criteria
    ]
    for scenario, one in as_map(rubric.get("scenarios")).items():
        steps = [(n, key, as_map(step[key])) for n, step in as_maps(as_map(one).get("steps")) for key in step]
        typed += [(("scenarios", scenario, "steps", n, key), given) for n, key, given in steps]
    for path, given in typed:
        kind = given.get("type")
        package, _, name = kind.partition("/") if isinstance(kind, str) else ("", "", "")
        near = closest(name, names, cutoff=SURE) if package in own and name not in names else ""
        if near:
            yield (*path, "type"), f'no criterion asks for {name} (did you mean "{package}/{near}"?)'


def _misspelt_scripts(rubric: dict[str, Any], scenarios: dict[str, dict[str, Any]]) -> Iterator[Fault]:
    """Yield scripts that nothing starts, and that are all but one that is started and that no criterion names."""
    criteria = list(as_maps(rubric.get("criteria")))
    paths = {n: as_map(c.get("with")).get("path") for n, c in criteria if c.get("check") == "executable"}
    named = {n: PurePosixPath(path).name for n, path in paths.items() if isinstance(path, str)}
    starts = [start for scenario in scenarios.values() for start in _starts(scenario)]
    started = {PurePosixPath(script).name for script in _values_of(starts, "script")}
    for index, name in named.items():
        near = "" if name in started else _near(name, started - {*named.values()}, cutoff=SURE)
        if near:
            yield ("criteria", index, "with", "path"), f'no scenario starts {name} (did you mean "{near}"?)'


def _other_goals_and_types(rubric: dict[str, Any], scenarios: dict[str, dict[str, Any]]) -> Iterator[Fault]:
    """Yield goals that a scenario does not send, and types of services that are not those that it calls."""
    for index, criterion in as_maps(rubric.get("criteria")):
        given, name = as_map(criterion.get("with")), str(criterion.get("scenario"))
        scenario, path = scenarios.get(name, {}), ("criteria", index, "with")
        steps = [as_map(step.get("action")) for _, step in as_maps(scenario.get("steps"))]
        goals, goal = [a for a in steps if a.get("name") == given.get("action", "")], given.get("goal")
        if isinstance(goal, int) and 0 < len(goals) < goal:
            yield (*path, "goal"), f"{name} sends {len(goals)} goals to {given['action']}"
        place = goal - 1 if isinstance(goal, int) else 0
        asked = goals[place] if 0 <= place < len(goals) else None
        if given.get("status") == "PREEMPTED" and asked is not None and not _is_given_up(asked, scenario):
            fault = f"no step cancels goal {place + 1} of {given['action']}: give its step cancel_after_s"
            yield (*path, "status"), fault
        number, asked_on = given.get("number"), given.get("asked_on")
        sent = [s for s in given_steps(scenario, "publish") if s.get("topic") == asked_on]
        singly = bool(sent) and not any(
            {"count", "duration_s", "values", "background"} & s.keys() for s in sent
        )
        if singly and isinstance(number, int) and number > len(sent) and not scenario.get("probes"):
            yield (*path, "number"), f"{name} sends {len(sent)} messages on {asked_on}"
        service, kind = given.get("service", ""), given.get("type")
        called = {
            str(one.get("type")) for _, _, one in services_in(scenario) if one.get("service") == service
        }
        if isinstance(kind, str) and called and not closest(kind, called, cutoff=SURE):
            yield (*path, "type"), f"{name} has {service} as {join_words(sorted(called))}, not as {kind}"


def _is_given_up(goal: dict[str, Any], scenario: dict[str, Any]) -> bool:
    """Return whether a goal is cancelled, or something else is done meanwhile that may make a server give it up."""
    steps = [as_map(one) for _, step in as_maps(scenario.get("steps")) for one in step.values()]
    return goal.get("cancel_after_s") is not None or any(one.get("background") is True for one in steps)


def _misspelt_nodes(rubric: dict[str, Any], scenarios: dict[str, dict[str, Any]]) -> Iterator[Fault]:
    """Yield private parameters of a node whose name is all but one that a criterion asks for."""
    asked: dict[str, set[str]] = {}
    for _, criterion in as_maps(rubric.get("criteria")):
        names = as_texts(as_map(criterion.get("with")).get("names"))
        asked.setdefault(str(criterion.get("scenario")), set()).update(n.strip("/") for _, n in names)
    for name, scenario in scenarios.items():
        programs = _values_of(_starts(scenario), "program")
        asked.setdefault(name, set()).update(program.rpartition("/")[2] for program in programs)
        given: list[tuple[KeyPath, dict[str, Any]]] = [
            (("params", n), one) for n, one in as_maps(scenario.get("params"))
        ]
        given += [
            (("steps", n, "set_param"), as_map(s.get("set_param"))) for n, s in as_maps(scenario.get("steps"))
        ]
        for at, one in given:
            node, _, private = str(one.get("name", "")).strip("/").partition("/")
            nodes = asked.get(name, set())
            near = _near(node, nodes, cutoff=SURE) if private and node not in nodes else ""
            if near:
                fault = f'the node is called {near}, and not {node} (did you mean "/{near}/{private}"?)'
                yield ("scenarios", name, *at, "name"), fault


def _waits_in_steps(scenario: dict[str, Any]) -> Iterator[tuple[KeyPath, str]]:
    for index, step in as_maps(scenario.get("steps")):
        topic = as_map(step.get("wait")).get("topic")
        if isinstance(topic, str):
            yield ("steps", index, "wait", "topic"), topic


def _waited_for(until: dict[str, Any]) -> Iterator[tuple[KeyPath, str]]:
    for key in ("topics", "connected"):
        yield from (((key, index), topic) for index, topic in as_texts(until.get(key)))
    yield from ((("messages", topic), topic) for topic in as_map(until.get("messages")))


def _criteria(rubric: dict[str, Any]) -> Iterator[tuple[int, dict[str, Any], set[str]]]:
    """Yield each criterion with its place, and the topics that the others name."""
    criteria = list(as_maps(rubric.get("criteria")))
    named = [set(_topics_in(criterion.get("with"))) for _, criterion in criteria]
    for place, (index, criterion) in enumerate(criteria):
        yield index, criterion, set().union(*named[:place], *named[place + 1 :])


def _topics_in(value: object) -> Iterator[str]:
    if isinstance(value, str):
        yield from _TOPIC.findall(value)
    elif isinstance(value, Mapping):
        yield from (topic for key, item in value.items() for topic in (*_topics_in(key), *_topics_in(item)))
    elif isinstance(value, list | tuple):
        yield from (topic for item in value for topic in _topics_in(item))


def _sent_topics(scenario: dict[str, Any]) -> set[str]:
    """Return the topics on which probes send, and steps of the scenario."""
    sent = {str(probe.get("topic")) for _, probe in as_maps(scenario.get("probes"))}
    return sent | set(_topics_in(scenario.get("steps")))


def _actions(scenario: dict[str, Any]) -> list[str]:
    return [
        str(as_map(step.get("action")).get("name"))
        for _, step in as_maps(scenario.get("steps"))
        if "action" in step
    ]


def _kept_patterns(scenario: dict[str, Any]) -> list[str]:
    return [pattern for _, pattern in as_texts(scenario.get("keeps")) if pattern]


def _served_names(scenario: dict[str, Any]) -> list[str]:
    return [str(one.get("service") or one.get("action")) for _, one in as_maps(scenario.get("serves"))]


LISTED: Mapping[str, tuple[str, Callable[[dict[str, Any]], Iterable[str]]]] = {
    "launch": (
        '{name} does not start "{value}"{instead}',
        lambda scenario: _values_of(_starts(scenario), "launch"),
    ),
    "sent": ("no probe of {name} sends on {value}{instead}", _sent_topics),
    "action": ("no step of {name} sends a goal to {value}{instead}", _actions),
    "rostest": (
        '{name} starts no .test file as "{value}"{instead}',
        lambda scenario: [
            str(s.get("name")) for s in _starts(scenario) if str(s.get("program")).endswith(ROSTEST_ENDING)
        ],
    ),
    "served": ("the grader does not offer {value} in {name}{instead}: add it to serves", _served_names),
}
"""Of what a scenario has to list: what is said where it does not, and where to look."""


def _starts(scenario: dict[str, Any]) -> list[dict[str, Any]]:
    return [start for _, start in as_maps(scenario.get("start"))]


def _values_of(starts: list[dict[str, Any]], key: str) -> list[str]:
    return [str(start[key]) for start in starts if start.get(key) is not None]


def _instead(name: str, there: list[str]) -> str:
    """Return what is like the name, else all that is there."""
    return did_you_mean(name, there) or f": there is {join_words(there) or 'none'}"


def _near(topic: str, named: Iterable[str], *, cutoff: float) -> str:
    """Return the topic most like it. `/turtle1/pose` and `/turtle2/pose` are two, and not one with a slip."""
    plain = _DIGITS.sub("", topic)
    return closest(topic, [name for name in named if _DIGITS.sub("", name) != plain], cutoff=cutoff)
