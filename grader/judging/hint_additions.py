"""What is added to the hints of verdicts once all is judged; no status and no points change by it.

Verdicts or criteria come in, and go out with other hints: in the language of the node that is judged, with what the lab
wants of it, and with advice on what no criterion asks for, but stops a student later. Which lines are cited is for
`cited_lines.py`, what is wrong behind a mistake for `later_faults.py`.
"""

from __future__ import annotations

import re
import shlex
from collections.abc import Collection, Iterator, Mapping, Sequence
from itertools import islice
from pathlib import PurePosixPath
from typing import NamedTuple, TypeVar

from grader.checks.support.exit_causes import syntax_hint
from grader.checks.support.launch import not_executable
from grader.checks.support.launch_slips import node_slip, own_script
from grader.checks.support.missing_names import right_import
from grader.checks.support.scripts import (
    BACKUPS,
    CPP_SUFFIXES,
    PYTHON,
    SYNTAX,
    installed,
    is_product,
    names_script,
    programs,
)
from grader.checks.support.text import (
    PAUSE,
    RATE_SLOT,
    RENAME_IF_MEANT,
    STAY_ALIVE,
    TYPE_SLOT,
    VALUE_SLOT,
    code_of,
    in_language,
    rename_if_meant,
    shown,
    texts_in,
)
from grader.evidence.events import PACKAGE_RUN
from grader.installable import noetic_messages
from grader.judging.cited_lines import LINE_CHARS, LINES_READ
from grader.judging.facts import Facts, language_of, names_started, scripts_of
from grader.model.launch_file import LaunchFile
from grader.model.package import PackageFacts
from grader.model.python_slip import PythonSlip
from grader.model.repair import TYPED
from grader.model.result import CriterionResult
from grader.model.verdict import FileCitation, Status, Verdict, cited_lines
from grader.rubric.model import Criterion, Rubric
from grader.wording import NOTHING_TO_DO, join_words, on_lines, significant

POINTS_MAX = 10
"""So many faults are told at one criterion, and the others counted."""
_NO_FIELD = re.compile(r"has no attribute '(?P<field>\w+)'.*? \((?P<file>[\w./-]+), line (?P<line>\d+)\)")
_WHOLE = re.compile(r"\((?P<file>[\w./-]+), line (?P<line>\d+)\): \S+ is no whole number")
_NO_MODULE = re.compile(
    r"(?:No module named|cannot import name '\w+' from) '(?P<module>\w+)[\w.]*'.*? "
    r"\((?P<file>[\w./-]+), line (?P<line>\d+)\)"
)
_NO_PARAMETER = re.compile(r"\((?P<file>[\w./-]+), line (?P<line>\d+)\): the parameter '[^']+' is not set")
_CATCHES = re.compile(r"\s*except\s*(?::|.*\b(?:KeyError|Exception)\b)")
_PLACE = re.compile(r"\((?P<file>[\w./-]+\.py), line \d+\)")
_CONNECTS = re.compile(
    r"""[^#'"]*\b(?:(?:smtplib\.)?SMTP(?:_SSL)?|requests\.(?:get|post|put)|urlopen)\(\s*['"]"""
    r"(?!(?:https?://)?(?:localhost|127\.))"
)
"""A line of Python that connects to a machine that it names."""
_CATCHES_ANY = re.compile(r"\s*except\b(?!\s*(?:rospy\.)?ROSInterruptException\b)")
OF_ROS = ("use_sim_time", "rosdistro", "rosversion", "run_id")
"""Parameters that roscore or a run sets."""
_READS_PARAMETER = re.compile(r"""\bget_param\(\s*(['"])(?P<name>[\w~/]+)\1\s*\)""")
USUAL_RATE_HZ = 10
PARAMETERS_MAX = 3
Told = TypeVar("Told", Verdict, CriterionResult)
OF_FILES = ("build", "cmake", "manifest")
"""Checks whose criterion takes the advice: it is of the package as a whole."""


def keep_other_names(verdict: Verdict, criterion: Criterion, rubric: Rubric) -> Verdict:
    """Return a verdict whose hint renames no topic and no service that another criterion asks for; and one that is
    below the criterion's own, or above it, without a choice: `/cmd_vel/velocity` in place of `/cmd_vel`."""
    asked = {text for c in rubric.criteria if c.id != criterion.id for text in texts_in(c.parameters)}

    def without_asked(found: re.Match[str]) -> str:
        return rename_if_meant([name for name in re.findall(r"/[\w/]+", found["names"]) if name not in asked])

    hint = RENAME_IF_MEANT.sub(without_asked, verdict.hint)
    named = re.findall(r"/[\w/]+", left["names"]) if (left := RENAME_IF_MEANT.search(hint)) else []
    own = [text for text in texts_in(criterion.parameters) if text.startswith("/")]
    for topic in own if len(named) == 1 else ():
        if f"{named[0]}/".startswith(f"{topic}/") or f"{topic}/".startswith(f"{named[0]}/"):
            hint = f"write {topic} in place of {named[0]}"
    return verdict if hint == verdict.hint else verdict.model_copy(update={"hint": hint})


def add_advice(
    results: Sequence[CriterionResult], package: PackageFacts, rubric: Rubric
) -> tuple[CriterionResult, ...]:
    """Return the criteria, with what none of them tells as the hint of one that passed: one that names the file, or
    else one of the package as a whole."""
    visible = {c.id for c in rubric.criteria if c.visibility == "visible"}
    # Only on one that passed: a loss has a hint of its own.
    good = [c for c in results if c.status is Status.PASS and c.id in visible]
    host = next((c.id for check in OF_FILES for c in good if c.check == check), None)
    every = (*_points(package, rubric.package), *_typed(package, rubric))
    told: dict[str, list[str]] = {}
    for point in every:
        place = _own_criterion(point, [c.id for c in good], rubric) or host
        if place is not None and not _is_told(point, results):
            told.setdefault(place, []).append(point.text)
    return tuple(
        c.model_copy(update={"hint": "; ".join(filter(None, (c.hint, *_first_points(told[c.id]))))})
        if c.id in told
        else c
        for c in results
    )


def _first_points(points: Sequence[str]) -> list[str]:
    """Return as many as are read, with how many more there are."""
    more = len(points) - POINTS_MAX
    rest = [f"there {'are' if more > 1 else 'is'} {more} more of the kind"] if more > 0 else []
    return [*points[:POINTS_MAX], *rest]


def _own_criterion(point: _Point, good: Collection[str], rubric: Rubric) -> str | None:
    """Return which of the `good` criteria names the file of the point, or else runs it; None where none does."""
    name = PurePosixPath(point.place.file).name
    criteria = [c for c in rubric.criteria if c.id in good]
    for c in criteria:
        if name in {PurePosixPath(text).name for text in texts_in(c.parameters)}:
            return c.id
    return next((c.id for c in criteria if c.scenario and name in names_started(c, rubric)), None)


def _is_sure(slip: PythonSlip) -> bool:
    """Return whether a line is wrong, whatever the runs have shown of it."""
    steers = slip.kind == "wrong-value" and slip.message.endswith(STEERS_WRONG)
    return steers or (slip.kind == "no-effect" and slip.fix.startswith("write "))


STEERS_WRONG = ("takes y first, and then x", "points to another side", "by its sine, and then its cosine")
"""Of a robot's angle, what is wrong wherever a script computes so, and shows only where the robot turns that far."""


class _Point(NamedTuple):
    """What is wrong at a place, and the program that is not there where it is that."""

    place: FileCitation
    text: str
    lacks: str = ""


def _points(package: PackageFacts, name: str) -> Iterator[_Point]:
    for file in package.files:
        fault = None if file.path.endswith(BACKUPS) else file.python_fault
        if fault is not None and fault.kind in SYNTAX and not is_product(file.path):
            why = fault.explanation
            hint = syntax_hint(fault)
            told = "" if hint == fault.advice else f"; {hint}"
            where = f" on line {fault.line}" if fault.line else ""
            text = f"{file.path} has a syntax error{where}: {why}{told}"
            yield _Point(FileCitation(file=file.path), text)
    known = noetic_messages()
    no_messages = {
        (s.file, f"write {s.name} instead of ")
        for s in package.slips
        if s.kind == "unused-import" and s.name not in known.get(s.message, {s.name: ()})
    }
    for slip in package.slips:
        is_right = any(slip.file == file and slip.fix.startswith(fix) for file, fix in no_messages)
        if slip.kind == "misspelt" and not is_right and not is_product(slip.file):
            text = f"{slip.file}, line {slip.line}: `{slip.name}` is not defined anywhere: {slip.message}"
            yield _Point(slip.place, text)
        elif _is_sure(slip) and not is_product(slip.file):
            yield _Point(slip.place, f"{slip.file}, line {slip.line}: {slip.message}: {slip.fix}")
    for launch in package.launch_files:
        if launch.fault is not None:
            why = launch.fault.explanation
            text = f"{launch.path}, line {launch.fault.line}, is not well-formed: {why}"
            yield _Point(launch.fault.place, text)
        yield from _nodes(package, launch, name)


def _typed(package: PackageFacts, rubric: Rubric) -> Iterator[_Point]:
    """Yield where a program of C++ that the rubric runs reads what is typed, though nothing is: it goes on without."""
    runs = ((one, start) for one in rubric.scenarios.values() for start in one.start)
    alone = {start.script for one, start in runs if start.script and start.name not in one.typed_to}
    sources = {file for one in programs(package) if one.name in alone for file in one.call.args[1:]}
    for slip in package.slips:
        if slip.kind == "input" and slip.file in sources:
            where = f"{slip.file}, line {slip.line}"
            yield _Point(
                slip.place, f"{where}, reads what is typed, and a graded node gets no input; {slip.fix}"
            )


def _nodes(package: PackageFacts, launch: LaunchFile, name: str) -> Iterator[_Point]:
    """Yield the nodes whose program is missing or not executable: roslaunch prints an error, and starts the others.
    `name` is the name that the lab asks the package to have."""
    told = set[str]()
    for node in launch.brings:
        script, slip = own_script(package, node), node_slip(package, node)
        # a name that the manifest may be told to take is none to change here
        if node.uncertain or (
            node.pkg != package.name and (slip is None or slip.of_manifest or node.pkg == name)
        ):
            continue
        if slip is not None:
            text = f"roslaunch leaves a <node> out: {slip.file}, line {slip.line}: {slip.why}; {slip.fix}"
            yield _Point(FileCitation(file=slip.file, line=slip.line), text, slip.lacks)
        elif script and script.executable is False and not _needs_no_bit(package, script.path):
            if script.path in told:  # two nodes of one script
                continue
            told.add(script.path)
            why = not_executable(script)
            text = f"{why.why} ({node.file}, line {node.line}); {why.hint}"
            yield _Point(FileCitation(file=script.path), text)


def _needs_no_bit(package: PackageFacts, path: str) -> bool:
    """Return whether the build makes a program of it: of a script that it installs, and of a source of C++."""
    return PurePosixPath(path).suffix in CPP_SUFFIXES or any(
        one.call.name == PYTHON and names_script(one, path) for one in installed(package)
    )


def _is_told(point: _Point, results: Sequence[CriterionResult]) -> bool:
    """Return whether a lost criterion cites the place or is lost by the missing file, or a hint names the place.
    Without a line it is the whole file."""
    place = point.place
    words = place.file if place.line is None else f"{place.file}, line {place.line}"
    lost = [c for c in results if c.status.is_lost]
    absent = (c.mistake.name for c in lost if c.mistake and c.mistake.is_absence)
    missing = point.lacks in {PurePosixPath(name).name for name in absent}
    return missing or any(words in c.hint for c in results) or any(_cites(c, place) for c in lost)


def _cites(criterion: CriterionResult, place: FileCitation) -> bool:
    cited = [(c.file, c.line) for c in criterion.citations if isinstance(c, FileCitation)]
    return any(file == place.file and place.line in {None, line} for file, line in cited)


def choose_hint_language(verdict: Verdict, criterion: Criterion, facts: Facts) -> Verdict:
    """Return the verdict with its hint in the language of the node that it judges."""
    if in_language(verdict.hint, "python") == verdict.hint:
        return verdict
    hint = in_language(verdict.hint, language_of(verdict, criterion, facts))
    return verdict.model_copy(update={"hint": hint})


def lab_names(rubric: Rubric, lost: Collection[str], package: PackageFacts | None) -> dict[str, str]:
    """Return the `pkg="…"` that hints have of the package's present name, and the one to write: where the manifest is
    told to take the lab's name, launch files are told that one too. `lost` are criteria's ids."""
    asked = (
        str(c.parameters.get("name", ""))
        for c in rubric.criteria
        if c.check == "manifest" and c.id in lost and c.visibility == "visible"
        if rubric.package_of(c) == rubric.package
    )
    name = next(asked, "")
    return {f'pkg="{package.name}"': f'pkg="{name}"'} if package is not None and name else {}


def with_lab_names(told: Told, names: Mapping[str, str]) -> Told:
    """Return it with its hint in the names of `lab_names`."""
    hint = told.hint
    for old, new in names.items():
        hint = hint.replace(old, new)
    return told if hint == told.hint else told.model_copy(update={"hint": hint})


def with_own_name(result: CriterionResult, rubric: Rubric, package: PackageFacts) -> CriterionResult:
    """Return the result with the name that the package has as handed in, in the commands that show what was seen."""
    if package.name is None or package.name == rubric.package or rubric.package not in result.reproduce:
        return result
    named = rf"(\b(?:rosrun|roslaunch|roscd|rospack find) ){re.escape(rubric.package)}\b"
    shown = re.sub(named, lambda found: f"{found[1]}{package.name}", result.reproduce)
    return result.model_copy(update={"reproduce": shown})


def compile_command(verdict: Verdict, main: PackageFacts | None) -> str:
    """Return the command that shows a script's syntax error, where the verdict is lost by that line; else ""."""
    if main is None or not verdict.status.is_lost:
        return ""
    faults = (
        fault.place.below(main.way_to(package))
        for package in (main, *main.also)
        for file in package.files
        if (fault := file.python_fault) is not None and fault.kind in SYNTAX
    )
    cited = cited_lines(verdict.citations)
    file = next((one.file for one in faults if (one.file, one.line) in cited), "")
    return f"python3 -m py_compile {shlex.quote(file)}" if file else ""


_OF_ROSPY = re.compile(r"\brospy\.([A-Za-z_]\w*)")
_ROSPY = re.compile(r"\s*import\s+(?:[\w., ]*,\s*)?rospy(?:\s+as\s+(?P<name>\w+))?\b")
_FROM_ROSPY = re.compile(r"\s*from\s+rospy\s+import\s+(?P<names>\w[\w ,]*?|\*)\s*(?:#.*)?")


def name_rospy(verdict: Verdict, criterion: Criterion, facts: Facts) -> Verdict:
    """Return the verdict; its hint has what is rospy's as the script imports it: `ros.Rate(10)`, `Rate(10)`."""
    package, build = facts.package_of(criterion), facts.runs.get(PACKAGE_RUN)
    is_import = "import rospy" in verdict.hint or "from rospy" in verdict.hint
    if package is None or build is None or is_import or not _OF_ROSPY.search(verdict.hint):
        return verdict
    cited = {c.file for c in verdict.citations if isinstance(c, FileCitation)}
    own = scripts_of(criterion, facts.rubric, package)
    hints = {_in_words_of(build.file_lines(path), verdict.hint) for path in cited & own or own}
    return verdict.model_copy(update={"hint": hints.pop()}) if len(hints) == 1 else verdict


def _in_words_of(lines: Sequence[str], hint: str) -> str:
    """Return the hint in the words of a script with these lines; as it is where that takes more than one import."""
    lines = [line[:LINE_CHARS] for line in lines[:LINES_READ]]
    whole = next(filter(None, map(_ROSPY.match, lines)), None)
    if whole is not None:
        return hint if whole["name"] is None else _OF_ROSPY.sub(rf"{whole['name']}.\1", hint)
    found = {n: m["names"] for n, line in enumerate(lines, 1) if (m := _FROM_ROSPY.fullmatch(line))}
    if len(found) != 1:
        return hint
    ((number, text),) = found.items()
    given: dict[str, str] = {}
    for one in re.split(r"\s*,\s*", text):
        name, _, other = one.partition(" as ")
        given[name] = other or name
    asked = [] if text == "*" else [n for n in dict.fromkeys(_OF_ROSPY.findall(hint)) if n not in given]
    told = _OF_ROSPY.sub(lambda m: given.get(str(m[1]), str(m[1])), hint)
    names = join_words([f"`{name}`" for name in asked])
    return f"{told}; add {names} to what line {number} imports" if asked else told


def fill_slots(verdict: Verdict, criterion: Criterion, rubric: Rubric) -> Verdict:
    """Return the verdict; its hint's slots have the text, the rate and the type that the lab wants of the node."""
    if TYPE_SLOT in verdict.hint:
        scenario = rubric.scenarios.get(criterion.scenario or "")
        sent = {str(probe.topic): probe.type for probe in scenario.probes} if scenario is not None else {}
        name = str(sent.get(str(criterion.parameters.get("topic", "")), "…")).rpartition("/")[2]
        verdict = verdict.model_copy(update={"hint": verdict.hint.replace(TYPE_SLOT, name)})
    loop = f"publish in a loop `while not rospy.is_shutdown():`: {PAUSE}"
    hint = verdict.hint.replace(_STAY_ALIVE, loop) if _is_publisher(criterion, rubric) else verdict.hint
    if VALUE_SLOT not in hint and RATE_SLOT not in hint:
        return verdict
    asked = {
        one.check: one.parameters
        for one in rubric.criteria
        if one.scenario == criterion.scenario and one.visibility == "visible"
    }
    template = str(asked.get("message", {}).get("template", ""))
    value = f"`{in_language(code_of(template), 'python')}`" if template else "a value in the code"
    hz = float(str(asked.get("rate", {}).get("rate_hz", USUAL_RATE_HZ)))
    hint = hint.replace(VALUE_SLOT, value).replace(RATE_SLOT, f"rospy.Rate({significant(hz)})")
    return verdict.model_copy(update={"hint": hint})


_STAY_ALIVE = in_language(STAY_ALIVE, "python")


def _is_publisher(criterion: Criterion, rubric: Rubric) -> bool:
    """Return whether a criterion is about a program that alone is started, and publishes at a rate that is asked."""
    scenario = rubric.scenarios.get(criterion.scenario or "")
    asked = {one.check for one in rubric.criteria if one.scenario == criterion.scenario}
    return scenario is not None and len(scenario.start) == 1 and "rate" in asked and not scenario.probes


def name_same_file(verdict: Verdict, criterion: Criterion, facts: Facts) -> Verdict:
    """Return the verdict; a loss goes on with the other script of the lab that has the very same code."""
    if not verdict.status.is_lost or criterion.scenario is None:
        return verdict
    package = facts.package_of(criterion)
    if package is None:
        return verdict
    own = scripts_of(criterion, facts.rubric, package)
    started = {
        PurePosixPath(start.script).name
        for scenario in facts.rubric.scenarios.values()
        for start in scenario.start
        if start.script
    }
    sums = {one.sha256: one.path for one in package.files if one.path in own and one.size_bytes}
    for one in package.files:
        path = sums.get(one.sha256, one.path)
        other = PurePosixPath(one.path).name in started - {PurePosixPath(name).name for name in own}
        if path != one.path and other and one.link is None:
            same = f"{path} holds the same code as {one.path}, as if one were saved under the other's name"
            return verdict.model_copy(update={"message": f"{verdict.message}; {same}"})
    return verdict


def name_other_parameters(verdict: Verdict, criterion: Criterion, facts: Facts) -> Verdict:
    """Return the verdict; where a parameter that a script reads, or a module, is not there, its hint has those
    parameters that it reads below and that nothing sets either."""
    unset = _NO_PARAMETER.search(verdict.message) if "default" in verdict.hint else None
    # what a repair finds behind an import is told with it
    hides = verdict.basis.of_machine or verdict.hint.startswith("write `from ")
    found, build = unset or (hides and _NO_MODULE.search(verdict.message)), facts.runs.get(PACKAGE_RUN)
    scenario, package = facts.rubric.scenarios.get(criterion.scenario or ""), facts.package_of(criterion)
    if not found or build is None or scenario is None or package is None:
        return verdict
    if any(one.launch or one.load for one in scenario.start) or any(one.file for one in scenario.params):
        return verdict  # what files set is not known here
    lines = [line.partition("#")[0][:LINE_CHARS] for line in build.file_lines(found["file"])[:LINES_READ]]
    number = int(found["line"])
    given = [str(param.name) for param in scenario.params]
    given += re.findall(r"(?<!\S)_(\w+):=", " ".join(arg for start in scenario.start for arg in start.args))
    given += (one["name"] for line in lines[number - 1 : number] for one in _READS_PARAMETER.finditer(line))
    given += re.findall(r"""\b(?:set|has)_param\(\s*['"]([^'"]+)""", "\n".join(lines))
    known = {name.rpartition("/")[2].lstrip("~") for name in (*given, *OF_ROS)}
    others: dict[str, int] = {}
    for below, line in enumerate(lines[number:], number + 1):
        for one in _READS_PARAMETER.finditer(line):
            if one["name"].rpartition("/")[2].lstrip("~") not in known:
                others.setdefault(one["name"], below)
    if not others or (unset is None and any(_CATCHES.match(line) for line in lines)):
        return verdict
    told = join_words(f"'{name}' on line {line}" for name, line in islice(others.items(), PARAMETERS_MAX))
    if unset:
        return verdict.model_copy(update={"hint": f"{verdict.hint}, and one to {told}"})
    early = (s.fix for s in package.slips if (s.file, s.name) == (found["file"], "early"))
    text = join_words([f"give a default to {told}", *early])
    return verdict.model_copy(update={"hint": _with_next(verdict, text)})


def _with_next(verdict: Verdict, text: str) -> str:
    """Return the verdict's hint with what is next; before what the machine lacks, which only the instructor can add."""
    if not verdict.basis.of_machine:
        return f"{verdict.hint}; then {text}"
    hint = verdict.hint.replace(NOTHING_TO_DO, "For the rest, ", 1)
    return f"{text}. {hint[:1].upper()}{hint[1:]}"


_TYPED = (
    ("`raw_input` is Python 2, and a node gets no input", "`raw_input` is Python 2"),
    ("remove `raw_input(…)`, and put its value in the code: a node cannot ask for input", TYPED),
)


def allow_typing(verdict: Verdict, criterion: Criterion, facts: Facts) -> Verdict:
    """Return the verdict without the advice not to ask for input, in a run in which the grader types the answers."""
    scenario = facts.rubric.scenarios.get(criterion.scenario or "")
    if scenario is None or not scenario.typed_to:
        return verdict
    message, hint = verdict.message, verdict.hint
    for old, new in _TYPED:
        message, hint = message.replace(old, new), hint.replace(old, new)
    return verdict.model_copy(update={"message": message, "hint": hint})


def name_connections(verdict: Verdict, facts: Facts) -> Verdict:
    """Return the verdict; where a node ended at a question, its hint has the lines of its script that need the network
    next, unless something there catches that."""
    found, build = _PLACE.search(verdict.message), facts.runs.get(PACKAGE_RUN)
    if found is None or build is None or "gets no input" not in verdict.message or not verdict.hint:
        return verdict
    lines = [line[:LINE_CHARS] for line in build.file_lines(found["file"])[:LINES_READ]]
    places = [number for number, line in enumerate(lines, 1) if _CONNECTS.match(line)]
    if not places or any(_CATCHES_ANY.match(line) for line in lines):
        return verdict
    told = f"leave out what connects to another machine on {on_lines(places)}, as a graded node is offline"
    return verdict.model_copy(update={"hint": _with_next(verdict, told)})


def _name_other_arguments(verdict: Verdict, facts: Facts) -> Verdict:
    """Return the verdict; where an argument with decimals is made a whole number, its hint has the lines of the other
    arguments too."""
    found, build = _WHOLE.search(verdict.message), facts.runs.get(PACKAGE_RUN)
    if found is None or build is None or "`float(" not in verdict.hint:
        return verdict
    lines = [line.partition("#")[0] for line in build.file_lines(found["file"])[:LINES_READ]]
    numbers = [n for n, line in enumerate(lines, 1) if re.search(r"\bint\(\s*sys\.argv\[", line[:LINE_CHARS])]
    if len(numbers) == 1 or int(found["line"]) not in numbers:
        return verdict
    return verdict.model_copy(update={"hint": f"{verdict.hint} on {on_lines(numbers)}"})


def name_other_lines(verdict: Verdict, facts: Facts) -> Verdict:
    """Return the verdict; where a field is not there that a line reads or sets, its hint has the other lines too."""
    verdict = _name_other_arguments(verdict, facts)
    found, build = _NO_FIELD.search(verdict.message), facts.runs.get(PACKAGE_RUN)
    if found is None or build is None or not verdict.hint.startswith("write "):
        return verdict
    lines = [line.partition("#")[0] for line in build.file_lines(found["file"])[:LINES_READ]]
    number = int(found["line"])
    owner = re.search(rf"(?:\w+\.)+{found['field']}\b", lines[number - 1] if number <= len(lines) else "")
    same = re.compile(rf"(?<![\w.]){re.escape(owner[0])}\b") if owner is not None else None
    others = [n for n, line in enumerate(lines, 1) if n != number and same and same.search(line[:LINE_CHARS])]
    if not others:
        return verdict
    hint = f"{verdict.hint}, and correct `{found['field']}` on {on_lines(others)} too"
    return verdict.model_copy(update={"hint": hint})


def name_other_imports(verdict: Verdict, criterion: Criterion, facts: Facts) -> Verdict:
    """Return the verdict; where an import looks in a wrong module for what the build makes, its hint has the package's
    other lines that look there too."""
    found, build = _NO_MODULE.search(verdict.message), facts.runs.get(PACKAGE_RUN)
    package = facts.package_of(criterion)
    maker = re.match(r"write `from (\w+)", verdict.hint)
    if not (found and build and package and maker):
        return verdict
    wrong, others = found["module"], dict[str, list[str]]()
    same = re.compile(rf"\s*(?:from|import)\s+{re.escape(wrong)}\b")
    for file in (one for one in package.files if one.python and not is_product(one.path)):
        lines = enumerate(build.file_lines(file.path)[:LINES_READ], 1)
        for number, line in ((n, text[:LINE_CHARS].strip()) for n, text in lines if same.match(text)):
            fix = (right_import(line, package) or ("", ""))[1]
            # of `import lab.msg`, the first name alone is wrong
            if not fix and wrong != maker[1] and wrong not in noetic_messages():
                fix = f"write `{shown(line.replace(wrong, maker[1], 1))}`"
            if fix and (file.path, number) != (found["file"], int(found["line"])):
                where = "" if file.path == found["file"] else f" of {file.path}"
                others.setdefault(fix, []).append(f"on line {number}{where}")
    told = [f"{fix} {join_words(where, most=POINTS_MAX)}" for fix, where in others.items()]
    return verdict.model_copy(update={"hint": "; ".join([verdict.hint, *told])}) if told else verdict
