"""What in a rubric may be a slip and may be meant: each is a warning, and the rubric is used as it is.

Names that one line alone has are in `spelling.py`.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator, Mapping
from itertools import pairwise
from pathlib import PurePosixPath
from typing import Any

from grader.checks.support.fields import is_number
from grader.rubric.durations import goal_of, probed_s
from grader.rubric.prose_warnings import prose_warnings
from grader.rubric.simulators import TRUE_POSE, robot_of, topics_of_programs
from grader.rubric.started import argument_warnings
from grader.rubric.step_faults import count_causes
from grader.rubric.value_warnings import early_waits, hidden_packages, range_warnings, value_warnings
from grader.rubric.yaml_lines import (
    Fault,
    KeyPath,
    WrittenCriterion,
    WrittenRubric,
    as_list,
    as_map,
    as_maps,
    as_texts,
    given_steps,
    parts_of,
    published_in,
    services_in,
    starts_of,
    texts_in,
)
from grader.wording import plural, significant

SHORT = {"limit_s": 3.0, "first_message_s": 3.0, "quiet_s": 1.0, "alive_s": 0.5, "window_s": 2.0}
"""Conditions of `until` that a correct package may miss on a busy machine if they are shorter."""
WAIT_S = 0.5
"""The same of what a step waits for."""
TOO_SHORT = "very short: on a busy machine a correct package may need more"
LONG_S = 900.0
"""Nothing of a lab takes so long; in milliseconds it is less than a second."""
SELDOM_S = 5.0
"""Nobody waits so long for the next message of a lab."""
JUDGED = ("check", "scenario", "package", "with")
"""What makes a criterion judge something."""
SHORTEST_S = {"reacts": 0.1, "action-result": 0.2, "stamps": 0.02}
"""By check, the shortest time within which a correct node's answer comes on a busy machine."""
STRICT, LAX = 0.02, 0.5
"""Of a rate, the least tolerance that a busy machine keeps, and one with which half or twice the rate passes."""
CLOSE_DEG = 0.5
CLOSE_M = 0.02
"""No student's robot stops as near to its goal as this."""
EMPTY = "std_srvs/Empty"


def warnings(rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield what may be a slip."""
    yield from _short_times(rubric)
    yield from _long_probes(rubric)
    yield from _modules_for_packages(rubric)
    yield from _misnamed_processes(rubric)
    yield from _first_packages(rubric)
    yield from _lone_quotes(rubric)
    yield from _same_criteria(rubric)
    yield from _without_requires(rubric)
    yield from _patterns(rubric)
    yield from _of_the_build(rubric)
    yield from _other_rates(rubric)
    yield from _not_private(rubric)
    yield from _ends_and_lives(rubric)
    yield from _never_quiet(rubric)
    yield from _answers_waited_for(rubric)
    yield from _more_values(rubric)
    yield from _numbers_as_text(rubric)
    yield from _silent_anyway(rubric)
    yield from _launched_nodes(rubric)
    yield from early_waits(rubric)
    for criterion in rubric.criteria:
        yield from _hard(criterion)
        yield from _easy(criterion)
        yield from _there_already(criterion)
        yield from _repeated(criterion)
        if criterion.check == "connected":
            yield from _process_for_node(criterion, rubric)
    yield from range_warnings(rubric)
    yield from hidden_packages(rubric)
    yield from prose_warnings(rubric)
    yield from argument_warnings(rubric)
    for criterion in rubric.criteria:
        yield from _other_process(criterion, rubric)
        if criterion.check == "service-answers":
            yield from _answers(criterion)
        yield from _cancelled_goal(criterion)
        yield from _other_run(criterion, rubric)
        yield from value_warnings(criterion, rubric)


def _short_times(rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield times within which a correct package may not be done, times of many minutes, and messages that are rare."""
    for name, scenario in rubric.scenarios.items():
        until = as_map(scenario.get("until"))
        times: list[tuple[KeyPath, object, float]] = [
            (("until", key), until.get(key), least_s) for key, least_s in SHORT.items()
        ]
        for at, kind, one in parts_of(scenario):
            if kind in {"wait", "call", "action"}:
                times.append(((*at, "limit_s"), one.get("limit_s"), WAIT_S))
            rate_hz = one.get("rate_hz") if at[-1] == "publish" else None
            if is_number(rate_hz) and 0 < rate_hz < 1 / SELDOM_S:
                fault = f"is a message every {1 / rate_hz:g} s: rate_hz is messages a second"
                yield ("scenarios", name, *at, "rate_hz"), fault
        for at, given_s, least_s in times:
            if is_number(given_s) and given_s < least_s:
                yield ("scenarios", name, *at), f"{given_s:g} s is {TOO_SHORT}"
        first_s, limit_s = until.get("first_message_s"), until.get("limit_s")
        if is_number(first_s) and is_number(limit_s) and first_s > limit_s:
            fault = f"{first_s:g} s is longer than limit_s, {limit_s:g} s, after which the run is over"
            yield ("scenarios", name, "until", "first_message_s"), fault
        for at, given_s, _ in times:
            if is_number(given_s) and given_s > LONG_S and at[0] == "until":
                fault = f"{given_s:g} s are {given_s / 60:.0f} minutes, which a package that never gets there takes"
                yield ("scenarios", name, *at), fault


PIP_NAMES = {
    "cv2": "opencv-python", "opencv": "opencv-python", "sklearn": "scikit-learn", "yaml": "PyYAML", "pil": "Pillow",
    "serial": "pyserial", "usb": "pyusb",
}  # fmt: skip
"""By the name of a module, the package that pip installs for it, where that is called otherwise."""


def _modules_for_packages(rubric: WrittenRubric) -> Iterator[Fault]:
    for index, name in as_texts(as_map(rubric.data.get("needs")).get("pip")):
        if package := PIP_NAMES.get(name.lower()):
            yield ("needs", "pip", index), f"pip calls it {package}"


def _long_probes(rubric: WrittenRubric) -> Iterator[Fault]:
    for name, scenario in rubric.scenarios.items():
        limit_s, probes_s = as_map(scenario.get("until")).get("limit_s"), probed_s(scenario)
        if is_number(limit_s) and "steps" not in scenario and 0 < limit_s <= probes_s:
            over = f"the run is over after {limit_s:g} s, and the probes take {significant(probes_s)} s"
            yield ("scenarios", name, "until", "limit_s"), f"{over}: give it longer"


def _lone_quotes(rubric: WrittenRubric) -> Iterator[Fault]:
    for path, text in rubric.texts:
        for quote in ('"', "'"):
            # Only at an end: an apostrophe within a text has no partner either.
            if text.count(quote) == 1 and (text.startswith(quote) or text.endswith(quote)):
                yield path, f"has one quotation mark, {quote}, without its partner"
            is_value = path[-1] == "value" or path[-2:-1] == ("values",)
            if is_value and len(text) > 2 and text.startswith(quote) and text.endswith(quote):
                yield path, "has quotation marks in its quotation marks: a node has to publish them, too"


def _of_the_build(rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield packages that are asked for at run time, and that only a build needs."""
    for criterion in rubric.criteria:
        asked = criterion.given if criterion.check in {"manifest", "dependencies"} else {}
        for path, name in texts_in(criterion.at, asked):
            if name == "message_generation":
                yield path, "is asked for at run time, and only the build needs it: write message_runtime"


PATTERN = re.compile(r"\.[*+]|\\[dws]|^/.*/$|^\^.*\$$|\[(?:0-9|a-z|A-Z)\]")


LETTERS = {"field-equals": ("value", "values"), "logs": ("text",), "prints": ("text",)}
"""By check, the keys of texts that are compared letter by letter."""


def _patterns(rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield texts that look like a pattern: they are compared letter by letter."""
    for criterion in rubric.criteria:
        for key in LETTERS.get(criterion.check, ()):
            for at, text in texts_in((key,), criterion.given.get(key)):
                # A topic or a path is no pattern, though it begins and ends with a slash.
                if PATTERN.search(text) and not re.fullmatch(r"(/\w+)+/?", text):
                    yield (*criterion.at, *at), "is compared letter by letter: it is no pattern"
                elif criterion.check == "logs" and re.search(r"\{\w*\}", text):
                    yield (
                        (*criterion.at, *at),
                        "is compared letter by letter: prints has {number}, logs has not",
                    )


def _words(name: str) -> set[str]:
    return {word for word in re.split(r"[^a-z0-9]+", PurePosixPath(name).stem.lower()) if word}


def _misnamed_processes(rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield processes with the name of another script of the rubric's."""
    texts = [text for _, text in rubric.texts]
    scripts = {name for text in texts for name in re.findall(r"[\w./-]+\.py\b", text)}
    for at, start in rubric.starts():
        name, script = start.get("name"), start.get("script")
        if not isinstance(name, str) or not isinstance(script, str) or _words(name) & _words(script):
            continue
        meant = sorted(other for other in scripts if _words(name) <= _words(other))
        if meant:
            fault = f"the process is called {name}, and elsewhere the rubric has {meant[-1]}: is it that one?"
            yield (*at, "script"), fault


def _first_packages(rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield starts without a package, if others have one."""
    keys = ("program", "tests")
    starts = [(at, one) for at, one in rubric.starts() if all(one.get(key) is None for key in keys)]
    if len(rubric.packages) > 1 and any(start.get("package") is not None for _, start in starts):
        first = rubric.packages[0]
        fault = f"is started from {first}, the first package: if it is of another one, give package"
        yield from ((at, fault) for at, start in starts if start.get("package") is None)


def _same_criteria(rubric: WrittenRubric) -> Iterator[Fault]:
    first, titles = dict[str, str](), dict[str, str]()
    for criterion in rubric.criteria:
        other = titles.setdefault(str(criterion.data.get("title")), criterion.id)
        if other != criterion.id:
            yield (
                (*criterion.place, "title"),
                f"is the title of {other}, too: nothing tells students which is which",
            )
        # Sorted, since the order of keys makes no difference.
        judged = json.dumps([criterion.data.get(key) for key in JUDGED], sort_keys=True)
        other = first.setdefault(judged, criterion.id)
        if other != criterion.id and criterion.check != "manual":
            yield (*criterion.place, "check"), f"judges the same as {other}, with the same parameters"


def _other_rates(rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield rates of a topic for which an earlier criterion wants another one, in a run of the same processes."""
    before: dict[tuple[str, ...], tuple[str, float, dict[str, Any], dict[str, Any]]] = {}
    for criterion in rubric.criteria:
        given, scenario = criterion.given, criterion.scenario
        rate_hz, cause = given.get("rate_hz"), as_map(given.get("cause"))
        if not is_number(rate_hz):
            continue
        started = json.dumps([scenario.get("start"), scenario.get("params")], sort_keys=True)
        key = (str(given.get("topic")), str(given.get("of")), started)
        earlier, other_hz, other, run = before.setdefault(key, (criterion.id, rate_hz, cause, scenario))
        # Different causes may have different rates, and a run without the cause has the rate before it.
        if rate_hz != other_hz and (cause == other or (not (cause and other) and scenario == run)):
            fault = f"{earlier} wants {other_hz:g} Hz on {key[0]}, not {rate_hz:g}"
            yield (*criterion.at, "rate_hz"), fault


def _other_process(criterion: WrittenCriterion, rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield names that a node has to have, and that are those of another process."""
    process = criterion.given.get("process")
    others = {str(start.get("name")) for _, start in rubric.starts()} - {str(process)}
    own = [start for start in starts_of(criterion.scenario) if start.get("name") == process]
    for index, name in as_texts(criterion.given.get("names")):
        is_own = any(_words(name) & {*_words(str(process)), *_words(str(one.get("script")))} for one in own)
        # A name that shares a word with the process or its script is that node's own.
        if own and not is_own and name.strip("/") in others:
            fault = f"{name} is the name of another process of the rubric, and this is about {process}"
            yield (*criterion.at, "names", index), fault


def _answers(criterion: WrittenCriterion) -> Iterator[Fault]:
    """Yield fewer answers than there are calls, which are compared with the first of these, and answers that any is."""
    service, expect = criterion.given.get("service"), as_list(criterion.given.get("expect"))
    named = [(part, one) for _, part, one in services_in(criterion.scenario) if one.get("service") == service]
    made = sum(part == "request" for part, _ in named)
    if 0 < len(expect) < made:
        calls = f"{criterion.run} calls {service} {plural(made, 'time')}"
        fault = f"{calls}, and here are {plural(len(expect), 'answer')}: they are compared with the first"
        yield (*criterion.at, "expect"), fault
    if expect and not any(expect) and {str(one.get("type")) for _, one in named} - {EMPTY}:
        yield (*criterion.at, "expect"), "is right for any answer: give the fields that it has to have"


def _not_private(rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield parameters without a node's name before them that the handout calls private."""
    for at, one in rubric.params():
        param = str(one.get("name"))
        word = re.escape(param[1:])
        private = rf"~{word}\b|private parameters?\b[^.;]*`{word}`|`{word}`[^.;]*\bprivate parameter"
        if param.count("/") == 1 and re.search(private, rubric.handout):
            fault = f"the handout has ~{param[1:]}, which is below the node's own name: /<node>{param}"
            yield (*at, "name"), fault


OF_NODES = frozenset({"node-lives", "node-name", "launch-runs", "launch-connects"})
"""Checks of whether the nodes of a run are there at all."""


def _without_requires(rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield criteria of a run that require no criterion of a run, where another one is about its node: what keeps the
    node from starting would be charged to whichever of them comes first."""
    by_id = {criterion.id: criterion for criterion in rubric.criteria}
    for criterion in rubric.criteria:
        process = criterion.given.get("process")
        if not criterion.has_run or criterion.check in {*OF_NODES, "manual"}:
            continue
        of_nodes = [
            other for other in rubric.criteria if other.run == criterion.run and other.check in OF_NODES
        ]
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


def _cancelled_goal(criterion: WrittenCriterion) -> Iterator[Fault]:
    """Yield goals that a step cancels and that should succeed."""
    given, after_s = criterion.given, as_map(goal_of(criterion)).get("cancel_after_s")
    if is_number(after_s) and given.get("status", "SUCCEEDED") == "SUCCEEDED" and "feedback" not in given:
        fault = f"the step cancels this goal after {after_s:g} s: is its status PREEMPTED?"
        yield (*criterion.at, "status" if "status" in given else "goal"), fault


def _other_run(criterion: WrittenCriterion, rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield topics that another run is about, with other processes, and that this one nowhere names."""
    given, here = criterion.given, criterion.scenario
    topic = given.get("topic") or next(iter(as_map(given.get("topics"))), None)
    if not isinstance(topic, str) or "start" not in here or _is_named(topic, here):
        return
    for other in rubric.criteria:
        is_same = other.given.get("topic") == topic and other.run != criterion.run
        there = other.scenario
        # With a process in common, the topic may come from that one here as well.
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


def _hard(criterion: WrittenCriterion) -> Iterator[Fault]:
    """Yield demands that a correct node may miss."""
    at, check, given = criterion.at, criterion.check, criterion.given
    within_s, least_s = given.get("within_s"), SHORTEST_S.get(check)
    if is_number(within_s) and least_s is not None and within_s < least_s:
        yield (*at, "within_s"), f"{within_s:g} s is {TOO_SHORT}"
    tolerance, tolerance_m = given.get("tolerance"), given.get("tolerance_m")
    if check == "rate" and is_number(tolerance) and tolerance < STRICT:
        fault = f"{tolerance:g} is very strict: on a busy machine a correct package may miss it"
        yield (*at, "tolerance"), fault
    for key in ("heading_tolerance_deg", "tolerance_deg"):
        if is_number(given.get(key)) and given[key] < CLOSE_DEG:
            yield (*at, key), f"{given[key]:g} is very strict: it is in degrees"
    # where no simulator moves, a node works out where the robot is, as exactly as it was told
    moves = any(start.get("program") for start in starts_of(criterion.scenario))
    moves |= str(given.get("topic")).endswith("cmd_vel")
    if check in {"ends-at", "path"} and moves and is_number(tolerance_m) and tolerance_m <= CLOSE_M:
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
    values = [one for one in as_list(given.get("values")) if is_number(one)]
    if len(values) > 1 and is_number(tolerance) and 2 * tolerance >= max(values) - min(values) > 0:
        fault = (
            f"one message between {min(values):g} and {max(values):g} is near enough to each of the values"
        )
        yield (*at, "tolerance"), f"{fault}: a field that never changes passes"
    if check == "field-bounds" and is_number(given.get("min")) and given.get("min") == given.get("max"):
        yield (*at, "max"), f"is min, too: only {given['min']:g} is within these bounds"
    if check == "stamps" and is_number(within_s := given.get("within_s")):
        lasting_s = as_map(criterion.scenario.get("until")).get("window_s")
        if is_number(lasting_s) and within_s >= lasting_s:
            fault = f"the run's window is {lasting_s:g} s: the time of the first message passes for all"
            yield (*at, "within_s"), fault


def _repeated(criterion: WrittenCriterion) -> Iterator[Fault]:
    """Yield values that follow an equal one where no message may repeat the one before it."""
    given = criterion.given
    values = (
        as_list(given.get("values")) if given.get("repeats") is False and not given.get("tolerance") else []
    )
    for number, (one, other) in enumerate(pairwise(values), 1):
        if one == other:
            fault = "is the value before it, too: with repeats: false, another one has to come between them"
            yield (*criterion.at, "values", number), fault


def _there_already(criterion: WrittenCriterion) -> Iterator[Fault]:
    """Yield a goal so near to the start that a robot that never moves has reached it: in the robot world, or where the
    student's node works out where it is, from (0, 0) on."""
    given, start = criterion.given, robot_of(criterion.scenario).get("start")
    goal, off_m = given.get("goal"), given.get("tolerance_m")
    is_own = all(one.get("script") for one in starts_of(criterion.scenario))
    start = [0, 0] if is_own else start  # where odometry begins
    is_place = criterion.check == "ends-at" and (is_own or given.get("topic") == TRUE_POSE)
    if not is_place or not isinstance(start, list) or not isinstance(goal, list):
        return
    numbers = [*start[:2], *goal[:2]]
    if len(numbers) == 4 and all(map(is_number, [*numbers, off_m])) and not given.get("relative"):
        away_m = math.dist(numbers[:2], numbers[2:])
        if off_m is not None and 0 < away_m <= off_m:
            fault = f"the robot starts {away_m:.3g} m from the goal: one that never moves passes"
            yield (*criterion.at, "tolerance_m"), fault


def _silent_anyway(rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield silence that is asked of a node, without a criterion that has to see it publish on this topic."""
    known = {one.id: one for one in rubric.criteria}
    for criterion in rubric.criteria:
        topic = as_map(criterion.given.get("effect")).get("topic")
        if criterion.check != "reacts" or criterion.given.get("never") is not True:
            continue
        if not any(_sees(one, topic) for one in _all_required(criterion, known)):
            fault = f"a node that never publishes on {topic} passes: let it require a criterion that sees it publish"
            yield (*criterion.at, "never"), f"{fault} there"


def _sees(criterion: WrittenCriterion, topic: object) -> bool:
    """Return whether a criterion wants messages of the student's on the topic."""
    given = criterion.given
    return topic in {given.get("topic"), as_map(given.get("effect")).get("topic")} and not given.get("never")


def _ends_and_lives(rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield runs that wait for the end of a process, while a criterion wants the same one to stay alive."""
    lives: dict[str, str] = {}
    for criterion in rubric.criteria:
        if criterion.check == "node-lives":
            process = criterion.given.get("process")
            found = (start for start in starts_of(criterion.scenario) if start.get("name") == process)
            lives.update({_what(start): criterion.id for start in found})
    for name, scenario in rubric.scenarios.items():
        starts = {str(start.get("name")): start for start in starts_of(scenario)}
        for index, ended in as_texts(as_map(scenario.get("until")).get("ended")):
            # Ended by a step, and not by itself: both may be asked for.
            stopped = any(
                step.get(kind) == ended
                for _, step in as_maps(scenario.get("steps"))
                for kind in ("stop", "kill")
            )
            if ended in starts and (of := lives.get(_what(starts[ended]))) and not stopped:
                fault = f"{of} wants {ended} to stay alive, and this run waits for its end"
                yield ("scenarios", name, "until", "ended", index), fault


def _never_quiet(rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield runs that wait for silence, though a criterion asks for a topic that comes again and again."""
    for criterion in rubric.criteria:
        quiet_s = as_map(criterion.scenario.get("until")).get("quiet_s")
        topic, rate_hz = criterion.given.get("topic"), criterion.given.get("rate_hz")
        if criterion.check == "rate" and is_number(quiet_s) and is_number(rate_hz) and quiet_s * rate_hz > 1:
            often = f"{criterion.id} asks for {topic} at {rate_hz:g} Hz"
            fault = f"{often}: leave this out, unless the node stops by itself, or the run lasts until its limit_s"
            yield ("scenarios", criterion.run, "until", "quiet_s"), fault


def _what(start: dict[str, Any]) -> str:
    return json.dumps([start.get(key) for key in ("script", "launch", "package", "args")])


# A handout that speaks of a rate or of repeating means a node that publishes by itself.
PERIODIC = re.compile(r"\bHz\b|\b(?:a|per|each|every) (?:\w+ )?second\b|times", re.IGNORECASE)
ANSWERED_TIMES = 2
"""A node that answers each message may publish so many times as many, and what it publishes at its start."""


def _answers_waited_for(rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield counts of messages that come only if the node publishes many for each that it hears, where the handout has
    no rate."""
    if PERIODIC.search(rubric.handout):
        return
    for name, scenario in rubric.scenarios.items():
        sent = _sent(scenario)
        for topic, count in as_map(as_map(scenario.get("until")).get("messages")).items():
            if sent and isinstance(count, int) and count > ANSWERED_TIMES * (sent + 1):
                fault = f"{name} sends {plural(sent, 'message')}, and waits for {count}: is that meant?"
                yield ("scenarios", name, "until", "messages", topic), fault


def _more_values(rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield more values than the run sends messages, where the node answers each with one, or has causes to change."""
    paced = {one.given.get("topic") for one in rubric.criteria if "rate_hz" in one.given}
    is_answer = re.search(r"\beach\b", rubric.handout) and not PERIODIC.search(rubric.handout)
    for criterion in rubric.criteria:
        sent, count = _sent(criterion.scenario), len(as_list(criterion.given.get("values")))
        causes = count_causes(criterion.scenario)
        if causes is not None and count - 1 > causes and criterion.given.get("topic") not in paced:
            gives = f"the steps of {criterion.run} give the node {plural(causes, 'cause')} to change it"
            yield (*criterion.at, "values"), f"are {count}, and {gives}: does it change by itself?"
            continue
        if sent and count == sent + 1 and is_answer:
            fault = f"are {count}, and {criterion.run} sends {plural(sent, 'message')}"
            yield (*criterion.at, "values"), fault


def _process_for_node(criterion: WrittenCriterion, rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield ends of a connection that are named as a process of the scenario, and as no node that a criterion names."""
    scripts = {start.get("name") for start in starts_of(criterion.scenario) if start.get("script")}
    named = {name for one in rubric.criteria for _, name in as_texts(one.given.get("names"))}
    for end in ("publisher", "subscriber"):
        if (name := criterion.given.get(end)) in scripts - named:
            fault = f"{name} is a process here: is a node of this name asked for? It is what counts"
            yield (*criterion.at, end), fault


def _sent(scenario: dict[str, Any]) -> int:
    """Return how many messages the grader sends in a run; 0 where it sends none, or something else may."""
    is_script = all(start.get("script") for start in starts_of(scenario))
    if not is_script or "serves" in scenario or given_steps(scenario, "play"):
        return 0
    number = 0
    for one in published_in(scenario):
        values = one.get("values")
        if {"count", "duration_s", "background", "times", "text", "integers", "among"} & one.keys():
            return 0
        number += len(values) if isinstance(values, list) else 1
    return number


NUMBER = re.compile(r"-?\d+(?:\.\d+)?")


def _numbers_as_text(rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield parameters that are set to a number in quotes."""
    for at, one in rubric.params():
        value = one.get("value")
        if isinstance(value, str) and NUMBER.fullmatch(value):
            fault = f'"{value}" in quotes is text: a node that reads a number needs {value}, without them'
            yield (*at, "value"), fault
        elif isinstance(value, str) and re.fullmatch(r"None|[-+]?\d+(\.\d*)?[eE][-+]?\d{1,2}", value):
            meant = "no parameter has this value" if value == "None" else f"write {float(value):.15g}"
            yield (*at, "value"), f"{value} is text in YAML: {meant}"


def _launched_nodes(rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield counts of nodes of a launch file that are more than the criterion about it names, and programs of the
    rubric's among these that another run starts from another package."""
    programs = [str(start.get("program")) for _, start in rubric.starts()]
    owners = {PurePosixPath(program).stem: program.partition("/")[0] for program in programs}
    for criterion in rubric.criteria:
        nodes, scenario = as_map(criterion.given.get("nodes")), criterion.scenario
        for node, package in nodes.items():
            owner = owners.get(str(node).rpartition("/")[2])
            if owner and isinstance(package, str) and package != owner:
                yield (*criterion.at, "nodes", node), f"is of {owner} elsewhere in the rubric"
        count = as_map(scenario.get("until")).get("nodes")
        if nodes and isinstance(count, int) and count > len(nodes) and len(starts_of(scenario)) == 1:
            fault = f"{criterion.id} names {plural(len(nodes), 'node')}: the run waits for more than these"
            yield ("scenarios", criterion.run, "until", "nodes"), fault
