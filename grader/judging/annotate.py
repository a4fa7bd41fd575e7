"""What is added to verdicts once they are judged; no status and no points change by it.

Hints speak the language of the node that they are for, and cited lines have their text. What is wrong behind a mistake,
and what no criterion asks for, but stops a student later, is added as advice.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import PurePosixPath
from typing import NamedTuple

from grader.checks.cmake import NOT_CALLED, below_catkin_package
from grader.checks.messages import code_of
from grader.checks.support.console_output import probes_on
from grader.checks.support.exit_causes import syntax_hint
from grader.checks.support.launch import (
    NOT_STARTED,
    find_launch,
    later_fixes,
    node_slip,
    not_executable,
    own_script,
    refusal,
    refusals,
    unset_arg_fixes,
)
from grader.checks.support.launch_names import find_renaming
from grader.checks.support.missing_names import name_slip
from grader.checks.support.scripts import (
    BACKUPS,
    PYTHON,
    SYNTAX,
    SourceLine,
    commented_call,
    commented_calls,
    installed,
    is_product,
    lines_that_publish,
    lines_that_say,
    lines_that_set,
    names_script,
)
from grader.checks.support.text import (
    RATE_SLOT,
    SAID_DATA,
    SAID_VALUE,
    SECONDS,
    VALUE,
    VALUE_SLOT,
    could_say,
    in_language,
    in_source,
    in_words,
    says,
    texts_in,
    texts_of_cpp,
)
from grader.evidence.events import PACKAGE_RUN
from grader.evidence.run import Run
from grader.installable import NOTHING_TO_DO
from grader.judging.facts import SOURCES, Facts, language_of, scripts_of, sources_of
from grader.model.package import LaunchFile, PackageFacts, PythonSlip
from grader.model.result import CriterionResult
from grader.model.verdict import Citation, FileCitation, Status, Verdict
from grader.rubric.model import Criterion, Rubric
from grader.wording import join_words, lines_text, significant

POINTS_MAX = 3
NAMES_SHOWN = 3
OF_LAUNCHES = ("launch-runs", "launch-connects")
OF_TOPICS = ("hears", "topic-type")
"""Checks that say by themselves that a node is on another topic, and not of which type."""
USUAL_RATE_HZ = 10
RATE_SHARE = 0.05
"""By so much a rate that a script asks for may differ from the right one."""
OF_FILES = ("build", "cmake", "manifest")
"""Checks whose criterion takes the advice: it is of the package as a whole."""


def add_advice(
    results: Sequence[CriterionResult], package: PackageFacts, rubric: Rubric
) -> tuple[CriterionResult, ...]:
    """Return the criteria, with what none of them tells as the hint of one that passed."""
    visible = {c.id for c in rubric.criteria if c.visibility == "visible"}
    good = [c for c in results if c.status is Status.PASS and c.id in visible]
    host = next((c for check in OF_FILES for c in good if c.check == check), None)
    points = [point.text for point in _points(package) if not _is_told(point, results)][:POINTS_MAX]
    if host is None or not points:
        return tuple(results)
    told = host.model_copy(update={"hint": "; ".join(filter(None, (host.hint, *points)))})
    return tuple(told if c is host else c for c in results)


class _Point(NamedTuple):
    """What is wrong at a place, and the program that is not there where it is that."""

    place: FileCitation
    text: str
    lacks: str = ""


def _points(package: PackageFacts) -> Iterator[_Point]:
    for file in package.files:
        fault = None if file.path.endswith(BACKUPS) else file.python_fault
        if fault is not None and fault.kind in SYNTAX and not is_product(file.path):
            why = fault.explanation
            hint = syntax_hint(fault)
            told = "" if hint == fault.advice else f"; {hint}"
            text = f"{file.path} has a syntax error: {why}{told}"
            yield _Point(FileCitation(file=file.path), text)
    for slip in package.slips:
        if slip.kind == "misspelt" and not is_product(slip.file):
            text = f"{slip.file}, line {slip.line}: `{slip.name}` is not defined anywhere: {slip.message}"
            yield _Point(slip.place, text)
    for launch in package.launch_files:
        if launch.fault is not None:
            why = launch.fault.explanation
            text = f"{launch.path}, line {launch.fault.line}, is not well-formed: {why}"
            yield _Point(launch.fault.place, text)
        yield from _nodes(package, launch)


def _nodes(package: PackageFacts, launch: LaunchFile) -> Iterator[_Point]:
    """Yield the nodes whose program is missing or not executable: roslaunch prints an error, and starts the others."""
    for node in launch.brings:
        if node.pkg != package.name or node.uncertain:
            continue
        script, slip = own_script(package, node), node_slip(package, node)
        if slip is not None:
            text = f"roslaunch leaves a <node> out: {slip.file}, line {slip.line}: {slip.why}; {slip.fix}"
            yield _Point(FileCitation(file=slip.file, line=slip.line), text, slip.lacks)
        elif script and script.executable is False and not _needs_no_bit(package, script.path):
            why = not_executable(script)
            text = f"{why.why} ({node.file}, line {node.line}); {why.hint}"
            yield _Point(FileCitation(file=script.path), text)


def _needs_no_bit(package: PackageFacts, path: str) -> bool:
    """Return whether the build makes a program of it: of a script that it installs, and of a source of C++."""
    return PurePosixPath(path).suffix in SOURCES or any(
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


def add_later_faults(verdicts: Mapping[str, Verdict], rubric: Rubric, facts: Facts) -> dict[str, Verdict]:
    """Return the verdicts; where there was nothing to judge of a node, the hint goes on with what its source shows of
    the criteria that were not reached."""
    later: dict[str, list[str]] = {}
    retyped: dict[str, tuple[str, str]] = {}
    for criterion in rubric.criteria:
        verdict = verdicts[criterion.id]
        package = facts.package_of(criterion)
        if (
            package is None
            or criterion.visibility != "visible"
            or not (verdict.status.is_lost or verdict.of_machine)
        ):
            continue
        told = later.setdefault(verdict.blocked_by or criterion.id, [])
        if verdict.blocked_by and criterion.check == "launch-xml":
            told += [f"for {criterion.id}, {one}" for one in _later_in_file(criterion, package)]
        elif verdict.blocked_by and criterion.check == "launch-runs":
            own = _of_its_file(criterion, verdicts, rubric)
            for one in _later_in_launch(criterion, package, facts):
                later.setdefault(own or verdict.blocked_by, []).append(
                    one if own else f"for {criterion.id}, {one}"
                )
        elif criterion.check in OF_LAUNCHES and (
            file := find_launch(package, str(criterion.parameters["launch"]))
        ):
            told += unset_arg_fixes(file, verdict.hint)
        elif verdict.unjudged or verdict.of_machine or criterion.check in OF_TOPICS:
            own_later = Later(criterion, verdict, package, facts)
            told += own_later.faults()
            retyped |= own_later.retyped
    return {name: _with_later(verdict, later.get(name, ()), retyped) for name, verdict in verdicts.items()}


def _of_its_file(launched: Criterion, verdicts: Mapping[str, Verdict], rubric: Rubric) -> str | None:
    """Return the criterion that is lost by the launch file itself: what comes next in the file is told there."""
    file = launched.parameters.get("launch")
    of_file = (c.id for c in rubric.criteria if c.scenario is None and c.parameters.get("launch") == file)
    return next((i for i in of_file if verdicts[i].status.is_lost and not verdicts[i].blocked_by), None)


def _imports_again(fix: str, hint: str) -> bool:
    """Return whether it is an import that the hint has already, in other words."""
    code = re.findall(r"`((?:import|from) [^`]+)`", fix)
    return bool(code) and fix.endswith("at the top") and all(f"`{one}`" in hint for one in code)


def _with_later(verdict: Verdict, later: Iterable[str], retyped: Mapping[str, tuple[str, str]]) -> Verdict:
    hint, said = verdict.hint, in_language(verdict.hint, "python")
    new = [one for one in dict.fromkeys(later) if one.removeprefix("publish ") not in said]
    told = [one for one in new if not _imports_again(one, hint)]
    if not told or not hint:
        return verdict
    # what is not wanted is not imported first
    for wanted, other in (retyped[one] for one in told if one in retyped):
        package, _, name = wanted.partition("/")
        hint = re.sub(rf"from \w+\.msg import {other}\b", f"from {package}.msg import {name}", hint)
    if verdict.of_machine:
        hint = f"{join_words(told)}. {hint.replace(NOTHING_TO_DO, 'For the rest, ', 1)}"
        return verdict.model_copy(update={"hint": hint})
    return verdict.model_copy(update={"hint": f"{hint}; then {join_words(told)}"})


class Later:
    """What a criterion that was not reached would be lost by next, as far as the sources say so in plain values."""

    def __init__(self, criterion: Criterion, verdict: Verdict, package: PackageFacts, facts: Facts) -> None:
        self._criterion, self._verdict, self._package = criterion, verdict, package
        self._rubric, self._run = facts.rubric, facts.runs.get(criterion.scenario or "")
        self._build = facts.runs.get(PACKAGE_RUN)
        self._wanted = criterion.parameters
        self._topic = str(self._wanted.get("topic", ""))
        scripts = scripts_of(criterion, facts.rubric, package)
        self._slips = [slip for slip in package.slips if slip.file in scripts]
        self._paths = scripts | sources_of(criterion, facts.rubric, package)
        self._slips += self._texts_of_cpp()
        self._ran = not verdict.cause
        """Names are told already then, and only what is behind them is not."""
        self.retyped: dict[str, tuple[str, str]] = {}
        """Of faults of a type: the one that the lab wants, and the one that the script has."""

    def faults(self) -> Iterator[str]:
        """Yield how each is repaired."""
        by_check = {
            "rate": self._rate, "node-name": self._node_name, "hears": self._heard, "topic-type": self._published,
            "message": self._message, "logs": self._logged, "copies": self._copied,
        }  # fmt: skip
        if not self._ran:
            yield from self._names()
        yield from by_check[self._criterion.check]() if self._criterion.check in by_check else ()

    def _of(self, *kinds: str) -> list[PythonSlip]:
        return [slip for slip in self._slips if slip.kind in kinds]

    def _texts_of_cpp(self) -> Iterator[PythonSlip]:
        for path in sorted(path for path in self._paths if PurePosixPath(path).suffix in SOURCES):
            lines = self._build.file_lines(path)[:_LINES_READ] if self._build is not None else []
            for kind, line, text in texts_of_cpp(text[:LINE_CHARS] for text in lines):
                yield PythonSlip(file=path, line=line, kind=kind, message=text)

    def _names(self) -> Iterator[str]:
        """Names that are not there; an `except` of one is not reached."""
        for slip in self._of("misspelt", "undefined"):
            lines = self._build.file_lines(slip.file) if self._build is not None else []
            caught = slip.line <= len(lines) and lines[slip.line - 1].lstrip().startswith("except")
            if (one := name_slip(slip, self._package)) is not None and not caught:
                yield one.fix

    def _rate(self) -> Iterator[str]:
        hz, numbers = float(str(self._wanted["rate_hz"])), self._of("rate-number")
        if len(numbers) == 1 and abs(float(numbers[0].message) - hz) > RATE_SHARE * hz:
            yield f"make it {significant(hz)} Hz on {_line(numbers[0])}, which asks for {numbers[0].message} Hz"
        for slip in self._of("not-called"):
            if "sleep" in slip.name:
                yield f"on {_line(slip)}, {slip.fix}"

    def _node_name(self) -> Iterator[str]:
        own, names = self._of("node-name"), list(texts_in(self._wanted.get("names")))
        if self._ran or len(own) != 1 or not names or f"init_node('{names[0]}'" in self._verdict.hint:
            return
        if own[0].message.lstrip("/") not in names:
            yield f"name the node {names[0]} on {_line(own[0])}, not {own[0].message}"
        if own[0].name == "anonymous" and self._wanted.get("anonymous") == "forbidden":
            yield f"remove anonymous=True from {_line(own[0])}"

    def _copied(self) -> Iterator[str]:
        started = [one.script for one in self._rubric.scenarios[self._criterion.scenario or ""].start]
        twice = {PurePosixPath(one).name for one in started if one and started.count(one) > 1}
        for slip in self._of("node-name"):
            if PurePosixPath(slip.file).name in twice and not slip.name:
                yield f"write anonymous=True on {_line(slip)}, since two of it run at once"

    def _published(self) -> Iterator[str]:
        published, kind = self._of("publisher"), str(self._wanted.get("type", ""))
        lines = [one.line for one in published if f"/{one.message.lstrip('/')}" == self._topic]
        if len(published) == 1 and not lines and not self._ran:
            yield f"publish on {self._topic} on {_line(published[0])}, not on {published[0].message}"
        if len(published) > 1 and not lines:
            names = join_words(f"{one.message} (line {one.line})" for one in published[:NAMES_SHOWN])
            yield f"publish {kind} on {self._topic}: {published[0].file} publishes on {names}"
        types = [one for one in self._of("publisher-type") if one.line in lines or len(published) <= 1]
        types = types if not (self._ran and lines) else []
        if len(types) == 1 and types[0].message != kind.rpartition("/")[2]:
            yield self._retype("publish", kind, types[0])

    def _heard(self) -> Iterator[str]:
        scenario = self._rubric.scenarios.get(self._criterion.scenario or "")
        probes = scenario.probes if scenario is not None else ()
        sent = [probe.type for probe in probes if probe.topic == self._topic]
        heard, types = self._of("subscriber"), self._of("subscriber-type")
        own = sent[0].rpartition("/")[2] if sent else ""
        elsewhere = len(heard) == 1 and f"/{heard[0].message.lstrip('/')}" != self._topic
        if elsewhere and not self._ran:
            yield f"subscribe to {self._topic} on {_line(heard[0])}, not to {heard[0].message}"
        other = sent and len(types) == 1 and types[0].message != own
        if other and (elsewhere or (not heard and f"/{types[0].message}" not in self._verdict.message)):
            yield self._retype("subscribe with", sent[0], types[0])
        template, said = str(self._wanted.get("template", VALUE)), self._of("prints")
        said = [one for one in said if SAID_DATA in one.message]
        unheard = not self._ran or not (isinstance(self._run, Run) and probes_on(self._run, self._topic))
        if not unheard or template == VALUE or any(says(one.message, template) for one in said):
            return
        if len(said) == 1 >= len({one.line for one in heard}):  # else it may be another callback
            yield f"print '{in_words(template)}' on {_line(said[0])}, not '{in_source(said[0].message)}'"
        elif self._lacks_words(template.partition(VALUE)[0]):
            yield f"print '{in_words(template)}'"
        elif other and not said and len(self._of("prints")) == 1:  # a field that the right type does not have
            yield f"print the `data` of the message on {_line(self._of('prints')[0])}"

    def _retype(self, verb: str, wanted: str, slip: PythonSlip) -> str:
        fault = f"{verb} {wanted} on {_line(slip)}, not {slip.message}"
        self.retyped[fault] = wanted, slip.message
        return fault

    def _lacks_words(self, words: str) -> bool:
        """Return whether the words stand in no line of the sources, which are known."""
        lines = [
            line.partition("#" if path.endswith(".py") else "//")[0]
            for path in self._paths
            for line in (self._build.file_lines(path) if self._build is not None else ())
        ]
        return bool(lines) and not any(
            words.strip().casefold() in " ".join(line.split()).casefold() for line in lines
        )

    def _message(self) -> Iterator[str]:
        template = str(self._wanted.get("template", ""))
        said = list({one.message: one for one in self._of("publishes")}.values())
        code = in_language(code_of(template), "python")
        if len(said) != 1:
            if not said and self._lacks_words(template.partition(SECONDS)[0]):
                yield f"publish `{code}`"
            return
        text = said[0].message
        if text in {SAID_VALUE, SAID_DATA} and self._lacks_words(template.partition(SECONDS)[0]):
            yield f"publish `{code}` on {_line(said[0])}"
        if len(self._of("publisher")) > 1:  # it may be another topic's
            yield f"publish `{code}`"
            return
        sample = template.replace(SECONDS, "1234567890.25")
        if not could_say(text, sample):
            words = in_words(template) if said[0].file.endswith(tuple(SOURCES)) else code
            yield f"publish `{words}` on {_line(said[0])}, not '{in_source(text)}'"
        elif SECONDS in template and self._of("no-clock"):
            yield f"publish the time on {_line(said[0])}, `{code}`: the script only counts"

    def _logged(self) -> Iterator[str]:
        text, said = str(self._wanted.get("text", "")), self._of("prints")
        if len(said) == 1 and "{" not in said[0].message and text not in said[0].message:
            yield f"log {text!r} on {_line(said[0])}, not {said[0].message!r}"


def _later_in_file(criterion: Criterion, package: PackageFacts) -> Iterator[str]:
    """Yield what a launch file would be lost by once the scripts that it lacks are written."""
    file = find_launch(package, str(criterion.parameters.get("launch", "")))
    if file is not None:
        for script in texts_in(criterion.parameters.get("scripts")):
            yield from later_fixes(file, script)


def _later_in_launch(criterion: Criterion, package: PackageFacts, facts: Facts) -> Iterator[str]:
    """Yield what a launch file would be lost by next: what roslaunch said of it, and namespaces of the lab's nodes."""
    wanted, run = criterion.parameters, facts.runs.get(criterion.scenario or "")
    file = find_launch(package, str(wanted.get("launch", "")))
    names = {PurePosixPath(script).name for script in texts_in(wanted.get("scripts"))}
    if file is None or file.fault is not None:
        return
    refused = refusal(run, package) if isinstance(run, Run) else None
    if refused is not None and refused.refused != NOT_STARTED and not any(refusals(package, file)):
        yield f"{refused.hint}: {refused.why}"
    yield from unset_arg_fixes(file, refused.hint if refused is not None else "")
    nodes = [one for one in file.brings if one.type in names]
    if topic := wanted.get("topic"):
        renaming = find_renaming(package, nodes, str(topic))
        yield from [f"in {file.path} {renaming.fix}"] if renaming else []


def _line(slip: PythonSlip) -> str:
    return f"line {slip.line} of {slip.file}"


def choose_hint_language(verdict: Verdict, criterion: Criterion, facts: Facts) -> Verdict:
    """Return the verdict with its hint in the language of the node that it judges."""
    if in_language(verdict.hint, "python") == verdict.hint:
        return verdict
    hint = in_language(verdict.hint, language_of(verdict, criterion, facts))
    return verdict.model_copy(update={"hint": hint})


def fill_slots(verdict: Verdict, criterion: Criterion, rubric: Rubric) -> Verdict:
    """Return the verdict; its hint has the text and the rate that the lab wants of the node, where it has slots for
    them."""
    if VALUE_SLOT not in verdict.hint:
        return verdict
    asked = {
        one.check: one.parameters
        for one in rubric.criteria
        if one.scenario == criterion.scenario and one.visibility == "visible"
    }
    template = str(asked.get("message", {}).get("template", ""))
    value = f"`{in_language(code_of(template), 'python')}`" if template else "a value in the code"
    hz = float(str(asked.get("rate", {}).get("rate_hz", USUAL_RATE_HZ)))
    hint = verdict.hint.replace(VALUE_SLOT, value).replace(RATE_SLOT, f"rospy.Rate({significant(hz)})")
    return verdict.model_copy(update={"hint": hint})


SAYS = {
    "hears": r"\b(?:printf?|log\w+|write|ROS_\w+)\s*\(|\bc(?:out|err)\s*<<",
    "logs": r"\b(?:log\w+|ROS_\w+)\s*\(",
}
"""The checks of what a node says, and what a line of Python or C++ calls that says them."""
_LINES_READ = 2_000


def cite_words(verdict: Verdict, criterion: Criterion, facts: Facts, build: Run) -> Verdict:
    """Return the verdict; one on other words or values than the lab's with the line of the script that makes, or that
    publishes them, if it is plain which one does."""
    package = facts.package_of(criterion)
    placed = any(isinstance(one, FileCitation) for one in verdict.citations)
    lost = verdict.status in {Status.PARTIAL, Status.FAIL} and not verdict.unjudged
    field = criterion.parameters.get("field")
    if not (field or criterion.check in {*SAYS, "message"}) or placed or not lost or package is None:
        return verdict
    if package is not facts.package:
        return verdict
    paths = scripts_of(criterion, facts.rubric, package) | sources_of(criterion, facts.rubric, package)
    lines = [
        SourceLine(path, number, text)
        for path in sorted(paths)
        for number, text in enumerate(build.file_lines(path)[:_LINES_READ], 1)
        if len(text) <= LINE_CHARS and not text.lstrip().startswith(("#", "//"))
    ]
    said = lines_that_say(lines, f"{verdict.measured} {verdict.said}")
    found = lines_that_set(lines, str(field)) if field else said
    if field or criterion.check == "message":
        published = lines_that_publish(lines, str(criterion.parameters.get("topic", "")))
        # of several, the one that is published; of none, what is published has nothing of it
        found = found if len(found) == 1 else [one for one in published if one in found] or published
    elif not found and verdict.status is Status.PARTIAL:
        found = [one for one in lines if re.search(SAYS[criterion.check], one.text)]
    if len(found) != 1:
        return verdict
    place = FileCitation(file=found[0].file, line=found[0].number)
    return verdict.model_copy(update={"citations": (place, *verdict.citations)})


def cite_quoted(verdict: Verdict, criterion: Criterion, facts: Facts, build: Run) -> Verdict:
    """Return the verdict; one on a name that a script has in quotes in place of another one cites its lines."""
    package, names = facts.package_of(criterion), verdict.sought_names("quoted")
    placed = any(isinstance(one, FileCitation) for one in verdict.citations)
    if package is None or package is not facts.package or not names or placed or not verdict.status.is_lost:
        return verdict
    quoted = re.compile(rf"""(["'])(?:{"|".join(map(re.escape, names))})\1""")
    paths = sorted(
        scripts_of(criterion, facts.rubric, package) | sources_of(criterion, facts.rubric, package)
    )
    places = [
        FileCitation(file=path, line=number)
        for path in paths
        for number, text in enumerate(build.file_lines(path)[:_LINES_READ], 1)
        if len(text) <= LINE_CHARS and quoted.search(text)
    ]
    if not 0 < len(places) <= QUOTED_MAX:
        return verdict
    where = join_words(f"line {one.line} of {one.file}" for one in places)
    update = {"hint": f"on {where}: {verdict.hint}", "citations": (*places, *verdict.citations)}
    return verdict.model_copy(update=update)


QUOTED_MAX = 3


def cite_commented_call(verdict: Verdict, package: PackageFacts | None, build: Run) -> Verdict:
    """Return the verdict; one on a call that is missing in CMakeLists.txt cites the line below which it goes, or those
    in which it is commented out."""
    if not verdict.status.is_lost or package is None or package.cmake is None:
        return verdict
    if called := verdict.sought_name("call"):
        return _cite_install(verdict, package, build, called)
    found = commented_calls(package, build.file_lines(CMAKE)[:_LINES_READ], verdict.sought_names("uncalled"))
    if not found:
        return verdict
    told = "; ".join(f"{name}(…) is commented out on {lines_text(*place)}" for name, place in found.items())
    places = join_words(lines_text(*place) for place in found.values())
    update = {
        "message": f"{verdict.message}; {told}",
        "hint": f"remove the # from {places} of {CMAKE}: {verdict.hint}",
        "citations": (
            *(FileCitation(file=CMAKE, line=first + 1) for first, _ in found.values()),
            *verdict.citations,
        ),
    }
    return verdict.model_copy(update=update)


CMAKE = "CMakeLists.txt"


def _cite_install(verdict: Verdict, package: PackageFacts, build: Run, called: str) -> Verdict:
    file = next((one.file for one in verdict.citations if isinstance(one, FileCitation)), CMAKE)
    place = commented_call(build.file_lines(file)[:_LINES_READ], called)
    if place is None:
        return verdict
    where = lines_text(*place)
    update = {
        "message": verdict.message.replace(NOT_CALLED, f"{NOT_CALLED}: it is commented out on {where}", 1),
        "hint": f"in place of {where} {verdict.hint.removesuffix(below_catkin_package(package))}, without # before it",
        "citations": (FileCitation(file=file, line=place[0] + 1),),
    }
    return verdict.model_copy(update=update)


def cite_find(verdict: Verdict, criterion: Criterion, package: PackageFacts | None, build: Run) -> Verdict:
    """Return the verdict; one on a package that roslaunch does not find cites the lines of the launch file that name
    it."""
    absent = verdict.sought_name("package")
    if package is None or not absent or not verdict.status.is_lost:
        return verdict
    asked = find_launch(package, str(criterion.parameters.get("launch", "")))
    name = re.compile(rf"""\$\(find\s+{re.escape(absent)}\)|pkg\s*=\s*["']{re.escape(absent)}["']""")
    for file in (
        (asked,) if asked is not None else package.launch_files
    ):  # one by another name was judged on a copy
        lines = [
            n for n, text in enumerate(build.file_lines(file.path)[:_LINES_READ], 1) if name.search(text)
        ]
        if lines:
            of_file = "" if asked is not None else f" of {file.path}"
            where = f"line{'s' * (len(lines) > 1)} {join_words(map(str, lines))}{of_file}"
            hint = f"write the package's exact name on {where}, push {absent} if it is your own, or remove it"
            cited = tuple(FileCitation(file=file.path, line=n) for n in lines)
            return verdict.model_copy(update={"hint": hint, "citations": cited})
    return verdict


def cite_name(verdict: Verdict, build: Run) -> Verdict:
    """Return the verdict; one on a dependency cites the line that has its name: a tag that is commented out, or that of
    a `find_package(…)` over several lines."""
    place = next((one for one in verdict.citations if isinstance(one, FileCitation) and one.line), None)
    undeclared, lacked = verdict.sought_name("dependency"), verdict.sought_name("component")
    if place is None or place.line is None or not (undeclared or lacked):
        return verdict
    message, hint = verdict.message, verdict.hint
    lines = [text[:LINE_CHARS] for text in build.file_lines(place.file)[:_LINES_READ]]
    if undeclared:
        name = re.escape(undeclared)
        tag = re.compile(rf"\s*<!--\s*<(depend|exec_depend|run_depend)>\s*{name}\s*</\1>\s*-->")
        line = next((number for number, text in enumerate(lines, 1) if tag.match(text)), None)
        message = f"{message}: line {line} has it in a comment"
        hint = f"remove `<!--` and `-->` from line {line}"
    else:
        word = re.compile(rf"[^#]*\b{re.escape(lacked)}\b")
        inside = enumerate(lines[place.line - 1 :], place.line)
        line = next((number for number, text in inside if word.match(text)), None)
    if line is None:
        return verdict
    cited = tuple(
        FileCitation(file=place.file, line=line) if one is place else one for one in verdict.citations
    )
    return verdict.model_copy(update={"message": message, "hint": hint, "citations": cited})


LINE_CHARS = 200
"""A longer line stays out of the result."""


def show_lines(verdict: Verdict, build: Run) -> Verdict:
    """Return a verdict whose cited lines have their text; one that loses nothing, or cites none, stays as it is."""
    if not verdict.status.is_lost or not any(isinstance(c, FileCitation) for c in verdict.citations):
        return verdict
    cited = tuple(_with_text(citation, build) for citation in verdict.citations)
    return verdict.model_copy(update={"citations": cited})


def _with_text(citation: Citation, build: Run) -> Citation:
    if not isinstance(citation, FileCitation) or citation.line is None:
        return citation
    if citation.line == 1 and citation.column is None:
        return citation  # it stands for the whole file
    lines = build.file_lines(citation.file)
    text = lines[citation.line - 1].rstrip() if 0 < citation.line <= len(lines) else ""
    if not text.strip() or len(text) > LINE_CHARS:
        return citation
    if not citation.source:
        return citation.model_copy(update={"source": text})
    if citation.end_column is None or text.strip() != citation.source:
        return citation
    # Python prints a line without its indentation, and its carets stand below that
    indent = len(text) - len(text.lstrip())
    begin, end = (citation.column or 1) + indent, citation.end_column + indent
    return citation.model_copy(update={"source": text, "column": begin, "end_column": end})
