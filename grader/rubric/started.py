"""What scenarios start, and what criteria ask of that: files of another package, runs without the student's processes,
topics that no program of the run has; and arguments of starts that ROS would take for others."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from pathlib import PurePosixPath
from typing import Any, NamedTuple

from grader.checks.registry import Check
from grader.rubric.definitions import slip_of
from grader.rubric.scenario import ROSTEST_ENDING
from grader.rubric.simulators import PROGRAMS, TRUE_POSE, asked_topics
from grader.rubric.spelling import PROSE, is_slip
from grader.rubric.yaml_lines import (
    Fault,
    KeyPath,
    WrittenRubric,
    as_map,
    as_maps,
    as_texts,
    starts_of,
    texts_in,
)
from grader.wording import did_you_mean, join_words, plural

KINDS_OF_FILES = ("script", "launch", "load")
OPEN_ENDINGS = (".launch", ".xml", ROSTEST_ENDING)
"""Of programs that may start others."""
NAMED_AS_PACKAGE = frozenset({"manifest", "cmake"})
"""Checks whose `name` is that of the package that they judge."""


def started_faults(rubric: WrittenRubric, checks: Mapping[str, Check]) -> Iterator[Fault]:
    """Yield what of that can be seen in the rubric alone."""
    yield from _nothing_of_students(rubric, checks)
    yield from _tests_without_run(rubric)
    yield from _other_packages(rubric)
    yield from _without_program(rubric)


def _nothing_of_students(rubric: WrittenRubric, checks: Mapping[str, Check]) -> Iterator[Fault]:
    """Yield runs that start the grader's programs only, and by which a criterion judges the student's package."""
    of_runs = {name for name, check in checks.items() if check.needs_run}
    judged = {criterion.run for criterion in rubric.criteria if criterion.check in of_runs}
    for name, scenario in rubric.scenarios.items():
        starts = starts_of(scenario)
        programs = [str(start["program"]) for start in starts if start.get("program") is not None]
        is_open = any(program.endswith(OPEN_ENDINGS) for program in programs)
        if name in judged and programs and len(programs) == len(starts) and not is_open:
            fault = (
                f"starts {join_words(programs)}, and nothing of the student's: add a script or a launch file"
            )
            yield ("scenarios", name, "start"), fault


def _tests_without_run(rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield criteria by tests that a scenario runs and that do not name it."""
    runs = {str(one["tests"]): at[1] for at, one in rubric.starts() if one.get("tests") is not None}
    for criterion in rubric.criteria:
        file = str(criterion.given.get("file"))
        if criterion.check == "pytest" and not criterion.has_run and file in runs:
            yield (*criterion.place, "scenario"), f"is missing: {runs[file]} runs {file}"


def _other_packages(rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield files that are of another package elsewhere in the rubric, and names of packages that are not judged."""
    named: list[tuple[KeyPath, str, str, bool]] = []
    for at, start in rubric.starts():
        owner, is_given = rubric.package_of(start), start.get("package") is not None
        files = [(key, start[key]) for key in KINDS_OF_FILES if isinstance(start.get(key), str)]
        named += [((*at, key), PurePosixPath(file).name, owner, is_given) for key, file in files]
    for criterion in rubric.criteria:
        given, package = criterion.given, criterion.data.get("package")
        owner, asked = rubric.package_of(criterion.data), given.get("name")
        if criterion.check == "executable" and isinstance(given.get("path"), str):
            named.append(
                ((*criterion.at, "path"), PurePosixPath(given["path"]).name, owner, package is not None)
            )
        if criterion.check in NAMED_AS_PACKAGE and asked in rubric.packages and asked != owner:
            fault = (
                f"this criterion judges {owner}: write name: {owner}, or package: {asked} beside its check"
            )
            yield (*criterion.at, "name"), fault
        if criterion.check in {"manifest", "dependencies"}:
            for number, name in as_texts(given.get("dependencies")):
                if name == owner:
                    fault = f"{name} is the package itself, and no package depends on itself: take it out"
                    yield (*criterion.at, "dependencies", number), fault
    run = {(file, owner) for at, file, owner, _ in named if at[0] == "scenarios"}
    for at, file, owner, is_given in named:
        others = {other for _, same, other, is_said in named if same == file and other != owner and is_said}
        once = [one for *_, same, one, _ in named if (same, one) == (file, owner)] == [owner]
        # Both packages may have a file of this name: then each is started, or asked for twice.
        is_wrong = at[0] == "scenarios" and once and not any((file, other) in run for other in others)
        if others and (is_wrong or not is_given):
            elsewhere = join_words(sorted(others))
            fault = (
                f"is looked for in {owner}, and elsewhere it is in {elsewhere}: write package: {elsewhere}"
            )
            yield at, fault


def _without_program(rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield topics of the turtle simulator's and the robot world's that nothing in the run publishes."""
    for criterion in rubric.criteria:
        starts = starts_of(criterion.scenario)
        programs = [str(start.get("program")) for start in starts if start.get("program") is not None]
        # A launch file, or a program that the grader does not know, may publish anything.
        are_others = [one.endswith(OPEN_ENDINGS) or one.partition("/")[0] not in OWNERS for one in programs]
        may_start_others = [
            {"launch", "built"} & one.keys() or str(one.get("script")) in PROGRAMS for one in starts
        ]
        is_open = any(are_others) or any(may_start_others)
        for at, topic in asked_topics(criterion.given):
            owner = next((known for known, one in PROGRAMS.items() if one.published.fullmatch(topic)), "")
            if starts and not is_open and owner and owner not in programs and _is_own(topic, owner):
                fault = f"{criterion.run} does not start {owner}, which publishes {topic}"
                yield (*criterion.at, *at), fault


OWNERS = frozenset(program.partition("/")[0] for program in PROGRAMS)


def _is_own(topic: str, program: str) -> bool:
    """Return whether nothing but the program would publish there: `/scan` and `/odom` may come from anywhere."""
    return program.startswith("turtlesim/") or topic == TRUE_POSE


_NUMBER = re.compile(r"-?\d+(\.\d+)?")
OPTION = re.compile(r"(--?([A-Za-z]\w*))(?:(:?=)(.*))?")
_PLAIN = re.compile(r"(([A-Za-z]\w*))(=)(.*)")
SPECIAL = ("__name", "__ns", "__log", "__ip", "__hostname", "__master")


class Known(NamedTuple):
    """What the rubric names: topics and services, the last parts of parameters' names, and words of its texts."""

    topics: frozenset[str]
    params: frozenset[str]
    words: frozenset[str]
    quoted: frozenset[str]
    """Words that the handout has in backticks."""
    said: frozenset[str]
    """Names with a slash that the handout has."""


def argument_faults(scenario: dict[str, Any], rubric: WrittenRubric) -> Iterator[tuple[KeyPath, str]]:
    """Yield the faults of one scenario's arguments."""
    known: Known | None = None
    for index, start in as_maps(scenario.get("start")):
        for number, text in as_texts(start.get("args")):
            known = known or _known(rubric)
            fault = _blanks(text) or _no_colon(text, start, known) or _of_launch(text, start, known)
            fault = fault or _other_way(text, start, scenario, known) or _fault(text, start, known)
            if fault:
                yield ("start", index, "args", number), fault


def argument_warnings(rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield private parameters that nothing else in the rubric names, decimal numbers with a comma, and options where
    parameters may be meant."""
    yield from _plain_arguments(rubric)
    known = _known(rubric)
    # A handout that writes private parameters with ~ has them all so.
    named = known.params if re.search(r"~\w", rubric.handout) else known.params | known.words
    for place, start in rubric.starts():
        for number, text in as_texts(start.get("args")):
            name, _, value = text.partition(":=")
            at = (*place, "args", number)
            if re.fullmatch(r"-?\d+,\d+", value):
                yield at, f"ROS reads {value} as text: a decimal number has a point, no comma"
            elif start.get("script") and (option := OPTION.fullmatch(text) or _PLAIN.fullmatch(text)):
                words = option[1] if text.startswith("-") else f"{option[1]}="
                is_said = any(words in one for path, one in rubric.texts if "args" not in path)
                if not is_said and (option[3] or option[2] in known.params):
                    fault = f"sets no parameter of a node, as _{option[2]}:={option[4] or '…'} does"
                    yield at, f"{fault}: if the script reads {words} itself, say so in the handout"
            elif start.get("script") and re.match(r"_(?!_)\w+:=", text) and name[1:] not in named:
                said = join_words([f"~{one}" for one in sorted(known.params)])
                fault = f"nothing else in the rubric names ~{name[1:]}"
                yield at, f"{fault}: it has {said}" if said else fault


def _plain_arguments(rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield a start with fewer or more plain arguments than all others of its script have, and requests whose fields
    are in another order than the arguments that they come from."""
    given: dict[KeyPath, tuple[str, list[str]]] = {}
    counts = re.findall(r"\b(one|two|three|four|[1-4])\b[^.;]{0,40}\barguments?\b", rubric.handout)
    said = [{"one": "1", "two": "2", "three": "3", "four": "4"}.get(one, one) for one in counts]
    for place, start in rubric.starts():
        plain = [
            text for _, text in as_texts(start.get("args")) if ":=" not in text and not OPTION.fullmatch(text)
        ]
        given[place] = str(start.get("script")), plain
    for place, (script, plain) in given.items():
        others = [len(one) for at, (other, one) in given.items() if other == script != "None" and at != place]
        is_known = len(others) > 1 or [str(number) for number in others] == said
        if is_known and len({*others}) == 1 and len(plain) != others[0] and plain:
            fault = f"has {plural(len(plain), 'argument')}, and the other starts of {script} have {others[0]}"
            yield (*place, "args"), fault
    for criterion in rubric.criteria:
        asked = as_map(criterion.given.get("expect")) if criterion.check == "calls" else {}
        made_up = {key: as_map(value).get("made_up") for key, value in asked.items()}
        wanted = [f"{{made_up: {name}}}" if (name := made_up[key]) else str(asked[key]) for key in asked]
        for place, (_, plain) in given.items():
            is_here = place[1] == criterion.run and len({*wanted}) == len(wanted) > 1
            if is_here and {*wanted} <= {*plain} and [one for one in plain if one in wanted] != wanted:
                fault = f"has {', '.join(asked)} in another order than the arguments of {place[1]}"
                yield (*criterion.at, "expect"), f"{fault}, {' '.join(plain)}: is that meant?"


def _blanks(text: str) -> str:
    """Return that one argument has been written in place of several, or with blanks around its `:=`."""
    parts = text.split()
    if re.search(r"\s:=|:=\s+\S", text):
        return f"ROS reads no blanks around :=, write {re.sub(r' *:= *', ':=', text)}"
    if len(parts) > 1 and (all(":=" in one for one in parts) or all(map(_NUMBER.fullmatch, parts))):
        return f"is one argument: write {', '.join(json.dumps(one) for one in parts)}"
    return ""


def _no_colon(text: str, start: dict[str, Any], known: Known) -> str:
    """Return that `_rate=5`, `_rate:5` and `rate=5` set no parameter, `gui=false` no argument, and `chatter=talk`
    remaps nothing."""
    plain = re.fullmatch(r"(?:([A-Za-z]\w*)=|~(\w+):=(?=-?\d))(.*)", text)  # `~color:=red` remaps a name
    if plain and start.get("script") and (plain[1] or plain[2]) in known.params:
        return f"sets no parameter of the node: write _{plain[1] or plain[2]}:={plain[3]}"
    cut = re.fullmatch(
        r"(_\w+):(?!=) *=? *([^:=].*)", text
    )  # of a private parameter only: other texts may have a colon
    name, mark, value = cut.expand(r"\1 = \2").split(" ", 2) if cut else text.partition("=")
    is_name = re.fullmatch(r"[/A-Za-z][\w/]*", value)
    is_topic = is_name and name in {topic.rpartition("/")[2] for topic in known.topics}
    is_own = start.get("launch") is not None or name.startswith("_") or is_topic
    is_meant = re.fullmatch(r"\w+", name) and is_own
    how = "colon and equals sign" if cut else "a colon"
    return f"ROS reads {name}:={value}, with {how}, and not {text}" if mark and is_meant else ""


def _of_launch(text: str, start: dict[str, Any], known: Known) -> str:
    """Return that a launch file's argument is one letter off from a word that the handout has in backticks."""
    name, mark, value = text.partition(":=")
    near = next((one for one in sorted(known.quoted) if is_slip(name, one)), "")
    if not mark or start.get("launch") is None or not near or name in known.words | known.params:
        return ""
    return f'nothing else in the rubric names {name} (did you mean "{near}:={value}"?)'


def _fault(text: str, start: dict[str, Any], known: Known) -> str:
    name, mark, value = text.partition(":=")
    is_launch = start.get("launch") is not None or str(start.get("program")).endswith((".launch", ".test"))
    if not mark or is_launch:
        return ""
    if name.startswith("__"):
        return "" if name in SPECIAL else f"ROS has no {name}{did_you_mean(name, SPECIAL)}"
    spaces = {topic.split("/")[1] for topic in known.topics}
    # A private parameter `ns` may be meant, unless its value is a namespace of the rubric's topics.
    if name == "_ns" and value.strip("/") in spaces:
        return f"ROS reads __ns:={value}, with two underscores"
    if name.startswith("_"):
        near = next((one for one in sorted(known.params) if is_slip(name[1:], one)), "")
        if start.get("script") is None or not near or name[1:] in known.params | known.words:
            return ""
        return f'nothing else in the rubric names {name} (did you mean "_{near}:={value}"?)'
    return _remap(name, value, start, known)


def _other_way(text: str, start: dict[str, Any], scenario: dict[str, Any], known: Known) -> str:
    """Return that a remap of a script that runs alone is the wrong way round, that its namespace is missing, or that it
    names a topic outside of it: the run waits for a topic that the node then never has."""
    name, mark, value = text.partition(":=")
    # Another process may have the topic under the old name.
    is_alone = start.get("script") is not None and len(as_maps(scenario.get("start"))) == 1
    if not mark or not is_alone or name.startswith("_"):
        return ""
    given = dict(arg.split(":=", 1) for _, arg in as_texts(start.get("args")) if ":=" in arg)
    space = given.get("__ns", "").strip("/")
    old, new = (f"/{space}/{one}".replace("//", "/") if one[:1] != "/" else one for one in (name, value))
    here = {one for _, one in texts_in((), {**scenario, "start": None}) if one in known.topics}
    if old in here and new not in known.topics:
        return (
            f"what the node names comes before :=, and {old} is what the run asks for: write {value}:={name}"
        )
    spaces = [one.rpartition("/")[0] for one in here if one.endswith(f"/{value}") and one != new]
    is_placed = any("ns" in key for key in given) or new in known.topics or "/" in value
    if len(spaces) == 1 and not is_placed:
        return f"this is {new}, and the run asks for {spaces[0]}/{value}: add __ns:={spaces[0].strip('/')}"
    if space and name.startswith("/") and name[1:] in known.words and name not in known.said:
        return f"{name} is not in the namespace {space}: write {name.lstrip('/')}:={value}"
    return ""


def _remap(name: str, value: str, start: dict[str, Any], known: Known) -> str:
    """Return why nothing is remapped that the rubric speaks of."""
    last = name.rpartition("/")[2]
    program = PROGRAMS.get(str(start.get("program")))
    sources = {topic.rpartition("/")[2] for topic in (program.topics if program else known.topics)}
    if last not in sources and last in known.params:
        return f"{last} is a parameter, and this remaps a topic: write _{last}:={value}"
    if last not in sources and (near := slip_of(last, sources)):
        return f'nothing else in the rubric names {name} (did you mean "{near}:={value}"?)'
    if program and not program.is_installed and last not in sources:
        return f"{program.node} has no topic {name}: it has {join_words(sorted(sources))}"
    targets = {topic.rpartition("/")[2] for topic in known.topics}
    space = dict(arg.split(":=", 1) for _, arg in as_texts(start.get("args")) if ":=" in arg).get("__ns", "")
    whole = value if value.startswith("/") else f"/{space.strip('/')}/{value}".replace("//", "/")
    if whole in known.topics:
        return ""
    alike = sorted(t for t in known.topics if t.rpartition("/")[2] == value.rpartition("/")[2])
    near = (alike[0] if value.startswith("/") and alike else "") or slip_of(whole, known.topics)
    if near:
        return f'nothing else in the rubric names {whole} (did you mean "{name}:={near}"?)'
    is_known = last in sources | known.words or value.rpartition("/")[2] in targets | known.words
    return "" if is_known else f"nothing else in the rubric names {name} or {value}"


def _known(rubric: WrittenRubric) -> Known:
    params = {str(one.get("name")) for _, one in rubric.params()}
    texts = [(path, text) for path, text in rubric.texts if "args" not in path]
    topics = {text for path, text in texts if re.fullmatch(r"(/\w+)+", text) and not PROSE & {*path}} - params
    words = {word for path, text in texts if PROSE & {*path} for word in re.findall(r"\w+", text)}
    private = {name for path, text in texts if PROSE & {*path} for name in re.findall(r"~(\w+)", text)}
    params = private | {name.rpartition("/")[2] for name in params}
    quoted = re.findall(r"`~?(\w+)`", rubric.handout)
    said = re.findall(r"(?<!\w)/\w[\w/]*", rubric.handout)
    return Known(*map(frozenset, (topics, params, words, quoted, said)))
