"""What a rubric names has to be there: in the scenario that a criterion judges, or on some machine.

An instructor's slip (a process, a topic, a type that is nowhere) would else cost every student the criterion's points.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from fnmatch import fnmatchcase
from pathlib import PurePosixPath
from typing import Any

from grader.checks.registry import Check, Reference
from grader.checks.support.scripts import NODE_FOLDERS
from grader.checks.support.topics import SYSTEM_TOPICS
from grader.ros_env import TypeKind, ros_packages
from grader.rubric.definitions import Definitions
from grader.rubric.durations import longest_s, steps_s, until_of
from grader.rubric.frames import frame_faults
from grader.rubric.message_fields import field_faults
from grader.rubric.reachable import reach_faults
from grader.rubric.scenario import PROGRAM_PATTERN, ROSTEST_ENDING, TYPE_PATTERN
from grader.rubric.simulators import PROGRAMS, asked_faults, only_publisher, parameter_faults
from grader.rubric.spelling import SURE, unknown_names, values_of, with_other_topics
from grader.rubric.started import argument_faults, started_faults
from grader.rubric.yaml_lines import (
    Fault,
    KeyPath,
    WrittenCriterion,
    WrittenRubric,
    as_map,
    as_maps,
    as_texts,
    given_steps,
    parts_of,
    published_in,
    services_in,
    started_files,
    starts_of,
    topics_in,
)
from grader.wording import closest, did_you_mean, join_words

LAUNCH_ENDINGS = (".launch", ".xml")
OTHER_CONDITIONS = ("messages", "connected", "heard", "nodes", "opened", "ended", "quiet_s")
"""Conditions of `until` that say nothing of how long a run lasts."""
TYPES: Mapping[str, TypeKind] = {"message": "msg", "field": "msg", "service": "srv", "action": "action"}
TYPE_OF_PART = {"publish": "message", "call": "service", "serve": "service", "action": "action"}
ASKED_OF_STUDENT = frozenset({
    "rate", "field-equals", "field-bounds", "topic-type", "latched", "message", "stamps", "counter-start",
    "counter-step", "counter-wrap", "reacts",
})  # fmt: skip
"""Checks of messages on a topic that the student has to publish on."""
WHERE_IT_IS = frozenset({"ends-at", "stays-within", "path"})
NEVER_OF_GRADER = frozenset({"latched", "topic-type", "counter-start", "counter-step", "counter-wrap"})
"""Checks of the student's messages that have no `of`."""
ENDINGS = (".py", ".yaml", ".yml", ".sh", ".bash", ".exe", ".pl", ".lua", ".js", ".rb")
"""Of files that a start may name."""


def reference_faults(
    rubric: WrittenRubric, checks: Mapping[str, Check], files: Mapping[str, bytes]
) -> Iterator[Fault]:
    """Yield a fault for everything that is named and not there."""
    for name, scenario in rubric.scenarios.items():
        yield from _outside_faults(("scenarios", name), scenario, rubric)
        found = (*parameter_faults(scenario), *argument_faults(scenario, rubric))
        yield from ((("scenarios", name, *at), fault) for at, fault in found)
    yield from _type_faults(rubric)
    for criterion, others in with_other_topics(rubric):
        check, judged = checks.get(criterion.check), criterion.scenario
        if check is not None:
            yield from _criterion_faults(criterion, check, rubric)
            asked = asked_faults(criterion.given, judged, others | set(topics_in(judged)))
            yield from (((*criterion.at, *at), fault) for at, fault in asked)
    needs = as_map(rubric.data.get("needs"))
    for index, package in as_texts(needs.get("ros")):
        if package in rubric.packages:
            yield ("needs", "ros", index), "is the package that students hand in: no machine has it before"
        elif fault := ros_packages().misspelt(package):
            yield ("needs", "ros", index), fault
    yield from field_faults(rubric, Definitions(rubric, files))
    yield from frame_faults(rubric)
    yield from _unused_faults(rubric, checks)
    yield from started_faults(rubric, checks)
    yield from unknown_names(rubric, checks)
    yield from reach_faults(rubric, checks)
    yield from _of_grader(rubric)
    yield from _of_a_program(rubric)
    yield from _sent_as_another_type(rubric)
    yield from _endless_causes(rubric)
    yield from _forgotten_topics(rubric.criteria)
    yield from _same_names(rubric)
    yield from _other_goals_and_types(rubric.criteria)


def _outside_faults(path: KeyPath, scenario: dict[str, Any], rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield what a scenario asks for that no machine has."""
    course = {name for _, name in as_texts(rubric.data.get("packages"))}
    for index, start in as_maps(scenario.get("start")):
        for key in ("script", "launch"):
            owner, slash, _ = str(start.get(key)).partition("/")
            if slash and owner in course:
                fault = f"is a file of {owner}, which the rubric brings along: write program: {start[key]}"
                yield (*path, "start", index, key), fault
            elif key == "launch" and isinstance(start.get(key), str) and (fault := _launch_fault(start[key])):
                yield (*path, "start", index, key), fault
        for key, file in (("script", start.get("script")), ("load", start.get("load"))):
            if isinstance(file, str) and (fault := _file_fault(file, rubric)):
                yield (*path, "start", index, key), fault
        at = (*path, "start", index, "program")
        yield from _of_machine(at, "program", start.get("program"), rubric)
        package, _, file = str(start.get("program")).partition("/")
        if package in rubric.packages:
            key = "launch" if file.endswith(LAUNCH_ENDINGS) else "script"
            yield at, f"is the student's: with program it would count as the grader's. Write {key}: {file}"


def _launch_fault(launch: str) -> str:
    """Return why this is not the name of a launch file as roslaunch takes it, behind the package; empty where it is."""
    if " " in launch.strip():
        return f"is the file alone, without its package: {launch.rsplit(maxsplit=1)[-1]}"
    if "/" in launch:
        return _in_any_folder(launch)
    stem, _, ending = launch.rpartition(".")
    if stem and not launch.endswith(LAUNCH_ENDINGS) and closest(ending, ("launch",)):
        return f'is this "{stem}.launch"?'
    if not launch.endswith(LAUNCH_ENDINGS):
        return f'roslaunch takes the file\'s whole name: "{launch}.launch"'
    return ""


def _in_any_folder(launch: str) -> str:
    """Return how a launch file is named, which roslaunch finds by its name alone."""
    return f"write the file's name without its folder: {PurePosixPath(launch).name}"


def _type_faults(rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield types that no machine has, of what scenarios send, call and offer."""
    for at, kind, one in rubric.parts():
        to = "action" if one.get("action") is not None else TYPE_OF_PART.get(kind)
        if to and at[2] != "probes":
            yield from _of_machine((*at, "type"), to, one.get("type"), rubric)


def _file_fault(file: str, rubric: WrittenRubric) -> str:
    """Return why a start's file is none of the student's package; empty where it may be one."""
    path = PurePosixPath(file)
    if file.startswith(("/", "~")) or ".." in path.parts:
        return f"is a path in the student's package, from its folder: scripts/{path.name}, not {file}"
    if "\\" in file or re.match(r"(rosrun|python3?)\s|\./", file):
        name = re.split(r"[\\/\s]+", file.strip())[-1]
        return f"is a path in the student's package, from its folder: scripts/{name}, not {file}"
    if path.suffix in {".cpp", ".cc", ".cxx"}:
        return f"is a source: write the name of the program that add_executable makes of it, {path.stem}"
    if file in PROGRAMS:
        return f"is not one of the student's files: write program: {file}"
    source = re.search(rf"\b{re.escape(path.stem)}\.(?:cpp|cc|cxx)\b", rubric.handout)
    if path.suffix == ".py" and source and path.name not in rubric.handout:
        return f"the handout has {source[0]}: write the name of its program, {path.stem}"
    # with talker.cpp in the handout, `talker` is the C++ program beside talker.py
    whole = "" if source and not path.suffix else _with_ending(file, rubric)
    told = f"the rubric names {whole} elsewhere: write it with its ending" if whole else ""
    return told or _in_other_folder(path, rubric)


def _in_other_folder(path: PurePosixPath, rubric: WrittenRubric) -> str:
    """Return that the rubric names such a script in another folder; empty where it names this one, or none."""
    texts = [rubric.handout, *(text for at, text in rubric.texts if at[0] == "criteria")]
    with_folder = re.compile(rf"(?<![\w./-])(?:[\w-]+/)+{re.escape(path.name)}(?!\w)")
    named = sorted({one for text in texts for one in with_folder.findall(text)})
    is_named = any(f"/{one}".endswith(f"/{path}") for one in named) and len(path.parts) > 1
    # `rospy_tutorials/talker.py` is another package's
    own = [one for one in named if str(PurePosixPath(one).parent) in NODE_FOLDERS]
    is_python = path.suffix == ".py" and bool(own)
    return f"the rubric names {own[0]} elsewhere: write it so" if is_python and not is_named else ""


def _with_ending(file: str, rubric: WrittenRubric) -> str:
    """Return the name of a Python or YAML file that the rubric names with its ending, where this one has none, or one
    that no such file has."""
    path = PurePosixPath(file)
    whole = re.compile(rf"(?<![\w.]){re.escape(path.stem)}\.(?:py|ya?ml)(?!\w)")
    texts = [text for _, text in rubric.texts] if path.suffix.strip() not in ENDINGS else []
    return next((match[0] for text in texts if (match := whole.search(text))), "")


def _of_machine(path: KeyPath, to: str, value: object, rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield why no machine has what is named: a program, a package, or a type. The student's own package may have any
    type."""
    if not isinstance(value, str):
        return
    own = {*rubric.packages, *(PurePosixPath(name).name for _, name in as_texts(rubric.data.get("packages")))}
    fault = ""
    if to == "program" and not re.fullmatch(PROGRAM_PATTERN, value):
        fault = f'name its package too, like turtlesim/turtlesim_node, not "{value}"'
        fault += "; programs of the students' own go under scripts" if path[-2:-1] == ("programs",) else ""
    elif to == "program" and value.partition("/")[0] not in own:
        fault = ros_packages().program_fault(value)
    elif to == "dependency" and len(names := re.split(r"[.,;]?\s+|[,;]", value.strip())) > 1:
        fault = f"is one name: write {', '.join(names)}"
    elif to == "dependency":
        meant = "" if value in own else closest(value, own, cutoff=SURE)
        fault = f'there is no package "{value}" (did you mean "{meant}"?)' if meant else ""
        fault = fault or ("" if value in own else ros_packages().misspelt(value))
        of_node = "nodes" in path  # a launch file's pkg, and none of rosdep's keys
        if not fault and of_node and value not in own:
            fault = ros_packages().package_fault(value)
    elif to == "package" and value not in rubric.packages:
        fault = f'the lab has no package "{value}"{_instead(value, rubric.packages)}'
    elif to in TYPES and re.fullmatch(TYPE_PATTERN, value := value.partition("[")[0]):
        fault = ros_packages().type_fault(value, TYPES[to], own)
    if fault:
        yield path, fault


def _criterion_faults(criterion: WrittenCriterion, check: Check, rubric: WrittenRubric) -> Iterator[Fault]:
    scenario = criterion.scenario
    for one in check.references(criterion.given):
        at = (*criterion.at, *one.path)
        if one.to == "launch" and "/" in str(one.value):
            yield at, _in_any_folder(str(one.value))
        yield from _of_machine(at, one.to, one.value, rubric)
        if scenario and check.needs_run and scenario.get("recording") is None:
            yield from ((at, fault) for fault in _misfits(one, check, criterion))


def _misfits(one: Reference, check: Check, criterion: WrittenCriterion) -> Iterator[str]:
    """Yield why the scenario does not have what a parameter refers to."""
    name, scenario, value = criterion.run, criterion.scenario, one.value
    starts = starts_of(scenario)
    if one.to == "watched_s":
        yield from _too_short(one, check, scenario)
    elif not isinstance(value, str) or not value:
        return
    elif one.to == "process" and not any(_is_process(value, start) for start in starts):
        own = [str(start.get("name")) for start in starts if start.get("program") is None]
        yield f'{name} starts no process "{value}" of the student\'s{_instead(value, own)}'
    elif one.to in LISTED:
        words, listed = LISTED[one.to]
        value = PurePosixPath(value).name if one.to == "launch" else value
        there = sorted(listed(scenario))
        is_told = one.to == "launch" and any(_launch_fault(file).endswith("?") for file in there)
        if value not in there and not is_told:
            yield words.format(name=name, value=value, instead=_instead(value, there))
    elif one.to == "kept":
        yield from _not_kept(name, value, [kept for _, kept in as_texts(scenario.get("keeps")) if kept])
    elif one.to == "set" and not _is_set(value, scenario):
        there = [str(param.get("name")) for _, param in as_maps(scenario.get("params"))]
        yield f"{name} sets no parameter {value}{did_you_mean(value, there)}: add it to its params"
    elif one.to == "node":
        process = criterion.given.get("process")
        of_process = [start for start in starts if start.get("name") == process or not process]
        yield from _named_otherwise(value, of_process if len(of_process) == 1 else [])
    elif one.to == "published":
        yield from _wrong_sender(value, criterion.given.get("of"), check, scenario)


def _not_kept(scenario: str, file: str, kept: list[str]) -> Iterator[str]:
    path = PurePosixPath(file)
    if path.is_absolute() and path.parts[1:2] != ("tmp",):
        yield f"no file is kept from {path.parent}: write {path.name}"
    elif not any(path.match(keep) for keep in kept):
        yield f'{scenario} keeps no file "{file}"{_instead(file, kept)}; add it to its keeps'


def _wrong_sender(topic: str, says_of: object, check: Check, scenario: dict[str, Any]) -> Iterator[str]:
    """Yield why nobody whose messages are judged sends any."""
    of = says_of or "student"
    program = only_publisher(topic, scenario)
    if of == "student" and program:
        yield f"{program} publishes on {topic}, and {check.name} judges the student's messages: give it of: program"
    given = _sent_by_grader(scenario)
    until = as_map(scenario.get("until"))
    # Named in `until`, the topic is one that the run waits for: then the student publishes there as well.
    may_be_either = says_of is None and "of" in check.params.model_fields
    if may_be_either and topic in given and topic not in topics_in(until):
        yield (
            f"the grader itself sends on {topic}, and {check.name} judges the student's messages: if students publish "
            "there too, write of: student"
        )
    if of == "program" and not any(start.get("program") for start in starts_of(scenario)):
        yield f"the scenario starts no program, and {check.name} judges the messages of one (of: program)"


def _of_grader(rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield services and messages of the grader's that are taken for the student's."""
    for name, scenario in rubric.scenarios.items():
        for at, part, one in services_in(scenario):
            if part == "request" and one.get("service") in _served_names(scenario):
                fault = f"the grader offers {one['service']} itself (serves): a student's node should call it"
                yield ("scenarios", name, *at, "service"), fault
    asked = [one for one in rubric.criteria if one.check in ASKED_OF_STUDENT]
    for criterion in rubric.criteria:
        path, check, given, scenario = criterion.at, criterion.check, criterion.given, criterion.scenario
        is_place = check in WHERE_IT_IS and given.get("of") is None
        for at, topic in (
            (("effect",), as_map(given.get("effect")).get("topic")),
            ((), (is_place or check in NEVER_OF_GRADER) and given.get("topic")),
        ):
            if at and given.get("of", "student") != "student":
                continue  # a simulator shows what the node does
            program = only_publisher(topic, scenario) if at and isinstance(topic, str) else ""
            if program:
                fault = f"{program} publishes on {topic}: name the one on which the student's node answers"
                yield (*path, *at, "topic"), fault
            alike = [one for one in asked if _runs_alike(one.scenario, scenario)]
            others = sum(one.given.get("topic") == topic for one in alike) - (check in NEVER_OF_GRADER)
            if isinstance(topic, str) and topic in _sent_by_grader(scenario) and not others:
                fault = (
                    f"the grader itself sends on {topic}: name the one on which the student's node answers"
                )
                yield (*path, *at, "topic"), fault
        service = given.get("service")
        if check == "service" and service in _served_names(scenario):
            fault = f"the grader offers {service} itself (serves), and service judges the student's"
            yield (*path, "service"), f"{fault}: calls judges what was asked"


def _of_a_program(rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield criteria on the student's messages on a topic on which another criterion judges those of a program."""
    said = {
        (of, topic): one.id
        for one in rubric.criteria
        for topic in (one.given.get("topic"), as_map(one.given.get("effect")).get("topic"))
        if isinstance(of := one.given.get("of"), str) and isinstance(topic, str)
    }
    for criterion in rubric.criteria:
        given = criterion.given
        at = ("effect",) if criterion.check == "reacts" else ()
        topic = as_map(given.get("effect")).get("topic") if at else given.get("topic")
        is_beside = any("program" in one for one in starts_of(criterion.scenario))
        other = said.get(("program", str(topic))) if is_beside else None
        is_open = (
            criterion.check in ASKED_OF_STUDENT
            and given.get("of") is None
            and ("student", str(topic)) not in said
        )
        if other and is_open:
            of = "say whose it judges, of: program or of: student"
            yield (*criterion.at, *at, "topic"), f"{other} judges what a program publishes on {topic}: {of}"


def _sent_as_another_type(rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield messages of a run that have another type than on the same topic in a run of the same programs before."""
    first: dict[str, tuple[str, str]] = {}
    for name, scenario in rubric.scenarios.items():
        for at, kind, one in parts_of(scenario):
            topic, type_ = one.get("topic"), one.get("type")
            if kind != "publish" or not isinstance(topic, str) or not isinstance(type_, str):
                continue
            run, other = first.setdefault(topic, (name, type_))
            if run != name and other != type_ and _runs_alike(rubric.scenarios[run], scenario):
                fault = f"{run} sends {other} on {topic}, to the same program: a topic has one type"
                yield ("scenarios", name, *at, "type"), fault


def _runs_alike(one: dict[str, Any], other: dict[str, Any]) -> bool:
    """Return whether what a program publishes in one run, it may publish in the other."""
    launched = any(
        start.get("launch") or start.get("built") for run in (one, other) for start in starts_of(run)
    )
    return launched or bool(started_files(one) & started_files(other))


def _endless_causes(rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield causes of a rate that never end. A service that is asked nothing, as Trigger is, may be one."""
    for criterion in rubric.criteria:
        cause = as_map(criterion.given.get("cause"))
        asked = [one for _, part, one in services_in(criterion.scenario) if part == "request"]
        is_call = any(one.get("service") == cause.get("topic") and not one.get("request") for one in asked)
        if criterion.check == "rate" and cause and cause.get("field") is None and not is_call:
            yield criterion.at, "a cause of a rate needs a field: a message alone has no end"


def _forgotten_topics(criteria: list[WrittenCriterion]) -> Iterator[Fault]:
    """Yield what only-topics forbids and another criterion of the same run asks the student to publish."""
    for criterion in criteria:
        if criterion.check != "only-topics":
            continue
        allowed = [topic for _, topic in as_texts(criterion.given.get("topics"))]
        for other in criteria:
            given = other.given
            topic = str(as_map(given.get("effect")).get("topic") or given.get("topic"))
            is_asked = other.check in ASKED_OF_STUDENT and given.get("of", "student") == "student"
            is_asked = is_asked and given.get("never") is not True
            if not is_asked or other.run != criterion.run or topic in SYSTEM_TOPICS:
                continue
            is_allowed = any(fnmatchcase(topic, one) for one in allowed)
            if not is_allowed and not closest(topic, allowed, cutoff=SURE):  # a slip, which is told
                yield (*criterion.at, "topics"), f"{other.id} asks for {topic}: add it"


def _same_names(rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield starts of one script that would give two nodes the same name, of which the second one ends the first."""
    lives = [criterion for criterion in rubric.criteria if criterion.check == "node-lives"]
    for name in sorted({one.run for one in lives if one.given.get("anonymous") == "forbidden"}):
        first: dict[str, int] = {}
        scenario = rubric.scenarios.get(name, {})
        for index, start in as_maps(scenario.get("start")) if not given_steps(scenario, "start") else ():
            # With a name or a namespace of its own, the second node does not replace the first.
            named = any(text.startswith(("__ns:=", "__name:=")) for _, text in as_texts(start.get("args")))
            script = start.get("script")
            if isinstance(script, str) and not named and first.setdefault(script, index) != index:
                fault = (
                    f"a second node of {script} ends the first, which has its name: give it args, __name:=…"
                )
                yield ("scenarios", name, "start", index), fault


def _named_otherwise(name: str, starts: list[dict[str, Any]]) -> Iterator[str]:
    """Yield which name the arguments of a start give its node, where that is another one."""
    if name.endswith((".py", ".cpp")):
        yield f"is the name of a node, not of its file: write {name.rpartition('.')[0]}"
    elif re.search(r"[^\w/]", name):
        yield f'no node is called "{name}": letters, digits and _, and anonymous: required where digits follow'
    unnamed = [one for one in starts if not as_texts(one.get("args")) and one.get("script") is not None]
    if "/" in name.strip("/") and unnamed:
        yield f"a script has no namespace of its own: write {name.rpartition('/')[2]}, or give its start args, __ns:=…"
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
    """Return whether a scenario sets the parameter, or may: what a file of the student's sets is not known before."""
    params = [param for _, param in as_maps(scenario.get("params"))]
    names = {"/" + str(param.get("name")).strip("/") for param in params}
    return name in names or any(param.get("file") is not None for param in params) or "steps" in scenario


def _too_short(one: Reference, check: Check, scenario: dict[str, Any]) -> Iterator[str]:
    """Yield what a scenario lacks in length; how long one lasts that waits for something else, no one knows."""
    until = as_map(scenario.get("until"))
    limit_s = until_of(scenario, "limit_s")
    lasting = [until[key] for key in ("window_s", "alive_s") if key in until]
    # Fewer than there are: one of them is no number, which is said elsewhere.
    known = [s for s in (*lasting, limit_s) if isinstance(s, int | float)]
    if scenario.get("clock", "real") != "real":
        # Behind a warped clock, how late the machine is would be 20 times as much.
        if hasattr(check.params, "rate_bounds"):
            steps = "rates are judged in real time, and a fast clock goes in steps of 0.05 s"
            yield f"{steps}: give the criterion a scenario with clock: real"
        return
    if not isinstance(one.value, int | float) or len(known) <= len(lasting):
        return
    done_s = steps_s(scenario)
    is_one_node = until.get("nodes") == 1 and bool(lasting) and not scenario.get("calls")
    waits = any(until.get(key) for key in OTHER_CONDITIONS if not (key == "nodes" and is_one_node))
    if not isinstance(limit_s, int | float):
        return
    if done_s is None:  # something has to come first: how long that is waited for is known
        most_s = longest_s(scenario)
        if most_s is not None and one.value > most_s:
            yield f"{one.value:g} s is more than the scenario lasts at most, {most_s:g} s"
        return
    if done_s and not lasting and not waits:
        lasts_s, key = done_s, "its steps"
    else:
        lasts_s = min(max(lasting), limit_s) if lasting and not waits else limit_s
        key = "limit_s" if lasts_s == limit_s else "window_s" if "window_s" in until else "alive_s"
        lasts_s, key = lasts_s + done_s, f"its steps and {key}" if done_s else key
    if one.value > lasts_s:
        yield f"{one.value:g} s is more than the scenario lasts: {key}, {lasts_s:g} s"


def _unused_faults(rubric: WrittenRubric, checks: Mapping[str, Check]) -> Iterator[Fault]:
    """Yield scenarios that are run for nothing; a check that sees all of them may ask for any."""
    used: set[str] = set()
    for criterion in rubric.criteria:
        check = checks.get(criterion.check)
        # A check of the instructor's that was not found, or one that gets all runs, may use any of them.
        if (check is None and criterion.check != "manual") or (check and "evidence" in check.facts):
            return
        used.add(criterion.run)
    for name in rubric.scenarios:
        if name not in used:
            yield ("scenarios", name), "no criterion judges this scenario: remove it, or name it in one"


def _other_goals_and_types(criteria: list[WrittenCriterion]) -> Iterator[Fault]:
    """Yield goals that a scenario does not send, and types of services that are not those that it calls."""
    for criterion in criteria:
        path, given, name, scenario = criterion.at, criterion.given, criterion.run, criterion.scenario
        steps, goal = given_steps(scenario, "action"), given.get("goal")
        goals = [one for one in steps if one.get("name") == given.get("action", "")]
        if isinstance(goal, int) and 0 < len(goals) < goal:
            yield (*path, "goal"), f"{name} sends {len(goals)} goals to {given['action']}"
        place = goal - 1 if isinstance(goal, int) else 0
        asked = goals[place] if 0 <= place < len(goals) else None
        if given.get("status") == "PREEMPTED" and asked is not None and not _is_given_up(asked, scenario):
            fault = f"no step cancels goal {place + 1} of {given['action']}: give its step cancel_after_s"
            yield (*path, "status"), fault
        number, asked_on = given.get("number"), given.get("asked_on")
        sent = [s for s in given_steps(scenario, "publish") if s.get("topic") == asked_on]
        # Steps that send several messages: how many come is not the number of steps.
        together = {"count", "duration_s", "values", "background"}
        singly = bool(sent) and not any(together & one.keys() for one in sent)
        if singly and isinstance(number, int) and number > len(sent) and not scenario.get("probes"):
            yield (*path, "number"), f"{name} sends {len(sent)} messages on {asked_on}"
        service, kind = given.get("service", ""), given.get("type")
        called = {
            str(one.get("type")) for _, _, one in services_in(scenario) if one.get("service") == service
        }
        is_own = not ros_packages().types(
            str(kind).partition("/")[0], "srv"
        )  # of others, a slip is said elsewhere
        if isinstance(kind, str) and called - {kind} and (is_own or not closest(kind, called, cutoff=SURE)):
            yield (*path, "type"), f"{name} has {service} as {join_words(sorted(called))}, not as {kind}"


def _is_given_up(goal: dict[str, Any], scenario: dict[str, Any]) -> bool:
    """Return whether a goal is cancelled, or something else is done meanwhile that may make a server give it up."""
    steps = [as_map(one) for _, step in as_maps(scenario.get("steps")) for one in step.values()]
    return goal.get("cancel_after_s") is not None or any(one.get("background") is True for one in steps)


def _sent_by_grader(scenario: dict[str, Any]) -> set[str]:
    return {str(one.get("topic")) for one in published_in(scenario)}


def _sent_topics(scenario: dict[str, Any]) -> set[str]:
    """Return the topics on which probes send, and steps of the scenario."""
    sent = {str(probe.get("topic")) for _, probe in as_maps(scenario.get("probes"))}
    return sent | set(topics_in(scenario.get("steps")))


def _served_names(scenario: dict[str, Any]) -> list[str]:
    return [str(one.get("service") or one.get("action")) for _, one in as_maps(scenario.get("serves"))]


LISTED: Mapping[str, tuple[str, Callable[[dict[str, Any]], Iterable[str]]]] = {
    "launch": (
        '{name} does not start "{value}"{instead}',
        lambda scenario: [PurePosixPath(f).name for f in values_of(starts_of(scenario), "launch")],
    ),
    "sent": ("no probe of {name} sends on {value}{instead}", _sent_topics),
    "action": (
        "no step of {name} sends a goal to {value}{instead}",
        lambda scenario: [str(one.get("name")) for one in given_steps(scenario, "action")],
    ),
    "rostest": (
        '{name} starts no .test file as "{value}"{instead}',
        lambda scenario: [
            str(s.get("name")) for s in starts_of(scenario) if str(s.get("program")).endswith(ROSTEST_ENDING)
        ],
    ),
    "served": ("the grader does not offer {value} in {name}{instead}: add it to serves", _served_names),
}
"""Of what a scenario has to list: what is said where it does not, and where to look."""


def _instead(name: str, there: list[str]) -> str:
    """Return what is like the name, else all that is there."""
    return did_you_mean(name, there) or f": there is {join_words(there) or 'none'}"
