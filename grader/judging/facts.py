"""The facts that checks ask for by name, from the grader's own runs or from recordings of other tools; and in which
language the nodes are written that a verdict is about."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from pathlib import PurePosixPath

from pydantic import ValidationError

from grader.checks.build import run_hint
from grader.checks.reacts import ReactsParams
from grader.checks.registry import Check, Evidence
from grader.checks.support.build_errors import unreadable_file
from grader.checks.support.exit_causes import syntax_hint
from grader.checks.support.launch_slips import own_script, read_launch, refusals, refusals_unrun
from grader.checks.support.processes import ended_programs, failed_program, plain_type
from grader.checks.support.scripts import (
    CPP_SUFFIXES,
    SYNTAX,
    find_script,
    programs,
    sources_made,
    syntax_fault,
)
from grader.checks.support.text import Language, near_names, texts_in
from grader.checks.support.topics import unheard_programs
from grader.evidence.events import PACKAGE_RUN, RECORDING_MISSING, RECORDING_PROBLEM
from grader.evidence.run import Run
from grader.model.launch_file import LaunchFile
from grader.model.package import PackageFacts
from grader.model.python_slip import PythonSlip
from grader.model.record import Record
from grader.model.verdict import Verdict, failed, failed_or_blocked, inconclusive, machine_lacks
from grader.rubric.message_fields import said_types
from grader.rubric.model import Criterion, Rubric
from grader.rubric.scenario import Scenario, Start
from grader.wording import NOTHING_TO_DO, is_one_edit, join_words

NOT_RUN = "not_run"
REACTS = "reacts"
OF_BUILDS, OF_BUILD_FILES = {"build", "build-and-run"}, {"manifest", "cmake"}
"""Checks of what the build makes, and of the files that say how."""
NO_PACKAGE = PackageFacts(
    name="", path=".", manifest=None, manifest_fault=None, cmake=None, files=(), launch_files=()
)


@dataclass(frozen=True, kw_only=True)
class Facts:
    """Everything that one submission's evidence says. `package` is the main one, None where no package was recorded;
    `others` are those that the lab asks for besides, by its names for them."""

    rubric: Rubric
    runs: Mapping[str, Run]
    package: PackageFacts | None
    others: Mapping[str, PackageFacts] = field(default_factory=dict)

    def package_of(self, one: Criterion | Start) -> PackageFacts | None:
        """Return the package that a criterion judges, or that a start's files are of; None where it is not there."""
        name = self.rubric.package_of(one)
        return self.package if name == self.rubric.package else self.others.get(name)

    def of(self, check: Check, criterion: Criterion, params: Record) -> dict[str, object] | Verdict:
        """Return the facts by the names that the check asks for, or the verdict where one of them is not there."""
        found: dict[str, object] = {"params": params}
        if unreadable := self.unreadable(check, criterion):
            return unreadable
        if check.needs_run:
            run = self._run(criterion.scenario or "")
            if isinstance(run, Verdict):
                return run
            if run.foreign and not check.messages_only:
                message = f"{run.evidence} holds messages, but nothing about the processes and nodes that are judged"
                return inconclusive(message, hint="hand in the package too, so that its nodes can be run")
            if run.foreign:
                found["package"] = NO_PACKAGE
            found["run"] = run
        if "evidence" in check.facts:
            found["evidence"] = self._evidence(criterion)
        asked = {"package", "build"} & (set(check.facts) - found.keys())
        package = self.package_of(criterion)
        if asked and self.package is None:
            return self._no_package()
        if asked and package is None:
            return self._not_here(self.rubric.package_of(criterion))
        if package is not None:
            seen = self.runs.get(criterion.scenario or "")
            package = package.as_launched(event.argv for _, event in seen.processes) if seen else package
            found |= {"package": package, "build": self.runs[PACKAGE_RUN]}
        return {name: found[name] for name in check.facts}

    def _evidence(self, criterion: Criterion) -> Evidence:
        found = {name: self._run(name) for name in self.rubric.scenarios}
        if PACKAGE_RUN in self.runs:
            found[PACKAGE_RUN] = self.runs[PACKAGE_RUN]
        package = self.package or self._no_package()
        return Evidence(found, scenario=criterion.scenario, package=package)

    def _not_here(self, name: str) -> Verdict:
        known = (self.package, *self.others.values())
        found = join_words(one.name for one in known if one is not None)
        message = f"package {name} is missing; packages found: {found}"
        hint = f"hand in {name} too, beside {self.rubric.package}: its folder, with the package.xml that names it"
        return failed_or_blocked(
            message, expected=f"a package {name}", measured=f"no package {name}", hint=hint
        )

    def _no_package(self) -> Verdict:
        if not any(run.foreign for run in self.runs.values()):
            return inconclusive("the evidence holds no package facts", hint="grade the submission again")
        message = "only a recording was handed in, without the package's files"
        return inconclusive(message, hint="hand in the package too, to have its files judged")

    def _run(self, scenario: str) -> Run | Verdict:
        run = self.runs.get(scenario)
        if run is None and self._lacks_files(scenario):
            return self._nothing_started(scenario)
        if run is None and (launch := self.unreadable_launch(scenario)):
            return launch
        if run is None:
            recorded = self.runs.get(PACKAGE_RUN)
            reason = recorded.metadata.get(NOT_RUN, "") if recorded else ""
            message = f"the scenario {scenario!r} was not run{': ' + reason if reason else ''}"
            return inconclusive(message, hint=run_hint(reason))
        return run if run.foreign else unread_recording(run) or self._of_the_arena(run, scenario)

    def _of_the_arena(self, run: Run, scenario: str) -> Run | Verdict:
        outcome = run.outcome
        if outcome is None:
            return inconclusive(f"the recording of {scenario!r} was cut short", hint="grade again")
        if outcome.outcome == "host":
            why = f": {outcome.detail}" if outcome.detail else ""
            message = f"the run {scenario!r} failed on the grading machine{why}"
            return inconclusive(message, hint="`grader doctor` shows what it lacks; then grade again")
        return self._without_program(run, scenario) or run

    def _without_program(self, run: Run, scenario: str) -> Verdict | None:
        known = self.rubric.scenarios.get(scenario)
        programs = (
            {start.name: start.program for start in known.start if start.program and not start.is_rostest}
            if known
            else {}
        )
        if failure := failed_program(run, programs):
            message = f"one of the grader's programs failed in the run {scenario!r}: {failure}"
            hint = "`grader doctor --rubric RUBRIC` shows what this machine lacks for it; then grade again"
            return inconclusive(message, hint=hint)
        if not programs or not (otherwise := self._otherwise_than_said(run, scenario)):
            return None
        message = f"the rubric and a program of the run {scenario!r} contradict each other: {otherwise}"
        return machine_lacks(message, hint=f"{NOTHING_TO_DO}tell your instructor")

    def _otherwise_than_said(self, run: Run, scenario: str) -> str:
        """Return what a program beside the student's nodes does otherwise than the rubric says, so that nothing can
        come of it, whatever a student hands in: `tank publishes on /levels, and the rubric names /level`."""
        names = {node: process for _, event in run.graph for node, process in event.processes.items()}
        channels = [c for c in run.channels if c.callerid in run.grader_nodes]
        links = [one for _, event in run.graph for one in event.connections]
        heeded = {one.publisher for one in links if run.is_student_node(one.subscriber)}
        asking = {event.actor for _, event in run.actors if event.action == "lookup"}
        heeding = asking | {one.subscriber for one in links if run.is_student_node(one.publisher)}
        unheard = unheard_programs(run)
        for channel in channels:
            who, topic = names[channel.callerid], channel.topic
            right = next(filter(self._names, near_names(topic, unheard.get(topic, ()))), "")
            if right and not self._names(topic) and channel.callerid not in heeded:
                return f"{who} publishes on {topic}, and the rubric names {right}"
            kind, said = plain_type(channel.type), set(said_types(topic, self.rubric.handout))
            if len(said) == 1 and kind not in said and channel.callerid not in heeding:
                return f"{who} publishes {kind} on {topic}, and the handout says {said.pop()}"
        done = {node for node, process in names.items() if process in ended_programs(run)} - heeding
        for criterion in self.rubric.criteria:
            if not done or criterion.scenario != scenario or criterion.check != REACTS:
                continue
            cause = ReactsParams.model_validate(criterion.parameters).cause
            own = [c for c in channels if cause and c.topic == cause.topic]
            alone = own != [] and done.issuperset(c.callerid for c in own)
            if cause and alone and not any(map(cause.holds, cause.read(own))):
                return f"{names[own[0].callerid]} ended, and {cause.words} never came"
        return ""

    def _names(self, topic: str) -> bool:
        """Return whether the rubric has the topic's name, in its handout or in what its criteria ask for."""
        asked = (text for c in self.rubric.criteria for text in texts_in(c.parameters))
        return topic in asked or bool(
            re.search(rf"(?<![\w/]){re.escape(topic)}(?![\w/])", self.rubric.handout)
        )

    def unreadable(self, check: Check, criterion: Criterion) -> Verdict | None:
        """Return why what is still to be built or run for the criterion cannot be: that shows in files which nothing
        can read. None where another criterion is about these."""
        scenario, package = criterion.scenario or "", self.package_of(criterion)
        if package is None or scenario in self.runs or self._lacks_files(scenario):
            return None
        if check.name in OF_BUILDS and not self.runs[PACKAGE_RUN].processes:
            file = None if self._judges(OF_BUILD_FILES) else unreadable_file(package)
            cited = (file.place,) if file and file.place else ()
            return failed_or_blocked(file.why, hint=file.hint, citations=cited) if file else None
        launch = self.unreadable_launch(scenario)
        if launch is not None and self._is_later(criterion):
            launch = launch.based_on(unjudged=True)
        return launch or self._unparsed_scripts(criterion)

    def _is_later(self, criterion: Criterion) -> bool:
        """Return whether it requires another criterion of the same run."""
        required = (one for one in self.rubric.criteria if one.id in criterion.requires)
        return any(one.scenario == criterion.scenario for one in required)

    def _judges(self, checks: Collection[str], file: str = "") -> bool:
        """Return whether the rubric has a criterion with one of the checks, for the file if it is given."""
        asking = (c.parameters for c in self.rubric.criteria if c.check in checks)
        return any(not file or file in {PurePosixPath(t).name for t in texts_in(asked)} for asked in asking)

    def _unparsed_scripts(self, criterion: Criterion) -> Verdict | None:
        """Return why Python parses none of the scripts that the criterion names, or else that its run starts."""
        known = self.rubric.scenarios.get(criterion.scenario or "")
        if known is None or self._is_later(criterion):
            return None
        starts = [start for start in known.start if not start.program]
        texts = texts_in(criterion.parameters)
        starts = [start for start in starts if start.name in texts] or starts
        packages = [(start.script, self.package_of(start)) for start in starts]
        found = [find_script(package, script) if package and script else None for script, package in packages]
        faults = [syntax_fault(file) if file is not None else None for file in found]
        first = faults[0] if faults and all(faults) else None
        if first is None or self._judges({"executable"}, PurePosixPath(first.file).name):
            return None
        why = f"{first.file} line {first.line}: {first.kind}: {first.explanation}"
        return failed_or_blocked(why, hint=syntax_hint(first), citations=(first.place,))

    def unreadable_launch(self, scenario: str) -> Verdict | None:
        """Return why roslaunch starts nothing of what the scenario launches, as far as that shows without a run."""
        known = self.rubric.scenarios.get(scenario)
        if known is None or self.package is None or known.recording is not None:
            return None
        launched = [(package, s.launch) for s in known.start if s.launch and (package := self.package_of(s))]
        for package, name in launched:
            file = read_launch(package, name) if name in _launch_names(package) else None
            slip = next(refusals(package, file), None) if isinstance(file, LaunchFile) else None
            lost = slip.verdict() if slip is not None else file
            if isinstance(lost, Verdict):
                return lost.based_on(unjudged=self._judges({"launch-xml"}, name))
            slip = next(refusals_unrun(lost), None) if lost is not None else None
            few = self._too_few_parse(lost) if lost is not None and known.until.connected else None
            if slip is not None or few is not None:
                return slip.verdict() if slip is not None else few and few.based_on(unjudged=True)
        return None

    def _too_few_parse(self, launch: LaunchFile) -> Verdict | None:
        """Return why no two of the file's nodes can be connected: scripts that Python cannot parse."""
        scripts = [self.package and own_script(self.package, node) for node in launch.brings]
        faults = [s.python_fault for s in scripts if s and s.python_fault and s.python_fault.kind in SYNTAX]
        if not faults or len(scripts) - len(faults) > 1:
            return None
        why = f"{faults[0].kind}: {faults[0].explanation}"
        message = f"{launch.path} starts {faults[0].file}, line {faults[0].line}: {why}"
        return failed(message, hint=syntax_hint(faults[0]), citations=(faults[0].place,))

    def _lacks_files(self, scenario: str) -> bool:
        """Return whether the package has none of the files that the scenario starts: then there was nothing to run."""
        known = self.rubric.scenarios.get(scenario)
        if known is None or self.package is None or known.recording is not None:
            return False
        return not any(
            (s.script and find_script(package, s.script)) or (s.launch and s.launch in _launch_names(package))
            for s in known.start
            if (package := self.package_of(s)) is not None
        )

    def _nothing_started(self, scenario: str) -> Run:
        recorded = self.runs[PACKAGE_RUN]
        clock = self.rubric.scenarios[scenario].clock
        return replace(recorded, scenario=scenario, clock=clock, processes=(), console=(), graph=())


def _launch_names(package: PackageFacts) -> set[str]:
    return {PurePosixPath(file.path).name for file in package.launch_files}


def try_facts(rubric: Rubric, runs: Mapping[str, Run]) -> Facts:
    """Return the facts; `package` is None where none was recorded, or where it is of another version."""
    runs = with_recordings(rubric, runs)
    recorded = runs.get(PACKAGE_RUN)
    if recorded is None or recorded.package_json is None:
        return Facts(rubric=rubric, runs=runs, package=None)
    try:
        package = PackageFacts.read_json(recorded.package_json)
    except ValidationError:
        return Facts(rubric=rubric, runs=runs, package=None)
    main, others = views_of(rubric, package)
    return Facts(rubric=rubric, runs=runs, package=main, others=others)


def views_of(rubric: Rubric, package: PackageFacts) -> tuple[PackageFacts, dict[str, PackageFacts]]:
    """Return the main package, and the others that are here by the lab's names for them. Each knows of all that the lab
    asks for; those that are not here have no files."""
    here = {one.asked for one in package.also}
    missing = (name for name in rubric.package_names[1:] if name not in here)
    absent = (NO_PACKAGE.model_copy(update={"name": name, "asked": name}) for name in missing)
    main, *others = package.model_copy(update={"also": (*package.also, *absent)}).views()
    return main, {one.asked: one for one in others if one.asked in here}


def with_recordings(rubric: Rubric, runs: Mapping[str, Run]) -> dict[str, Run]:
    """Return the grader's own runs by scenario, and for each scenario without one the recording that stands for it.

    A recording is known by its name (`talker.bag` for the scenario `talker`) or by the scenario's pattern. A single
    one that was judged without a package stands for everything.
    """
    own = {name: run for name, run in runs.items() if not run.foreign}
    foreign = [run for run in runs.values() if run.foreign]
    # A bag that is judged by itself, without a package, may have any name.
    alone = foreign[0] if len(foreign) == 1 and PACKAGE_RUN not in own else None
    found = dict(own)
    for name, scenario in rubric.scenarios.items():
        run = own.get(name) or _run_named(name, scenario, foreign) or alone
        if run is not None:
            found[name] = run
    return found


def _run_named(name: str, scenario: Scenario, foreign: list[Run]) -> Run | None:
    by_name = [run for run in foreign if run.scenario == name]
    pattern = PurePosixPath(scenario.recording or "").name
    # Two that fit would be a guess.
    found = by_name or [run for run in foreign if fnmatchcase(run.evidence.casefold(), pattern.casefold())]
    return found[0] if len(found) == 1 else None


def unread_recording(run: Run) -> Verdict | None:
    """Return why there is nothing to judge where a scenario's recording was not found or could not be read."""
    if RECORDING_MISSING in run.metadata:
        pattern = run.metadata[RECORDING_MISSING]
        message = f"no recording {pattern} is in the submission"
        hint = "record with `rosbag record`, end it with Ctrl-C, and hand the file in"
        return failed_or_blocked(message, measured="no recording", hint=hint)
    if RECORDING_PROBLEM in run.metadata:
        fix = "hand in one recording that `rosbag info` can read"
        return inconclusive(run.metadata[RECORDING_PROBLEM], hint=fix)
    return None


def starts_of(criterion: Criterion, rubric: Rubric) -> tuple[Start, ...]:
    """Return what the criterion's scenario starts."""
    scenario = rubric.scenarios.get(criterion.scenario or "")
    return scenario.start if scenario is not None else ()


def scripts_of(criterion: Criterion, rubric: Rubric, package: PackageFacts) -> set[str]:
    """Return the paths of the scripts that the criterion's scenario starts."""
    named = [start.script for start in starts_of(criterion, rubric) if start.script]
    return {file.path for path in named if (file := find_script(package, path)) is not None}


def names_started(criterion: Criterion, rubric: Rubric) -> set[str]:
    """Return the names of the programs that the criterion's scenario starts."""
    return {PurePosixPath(one.script).name for one in starts_of(criterion, rubric) if one.script}


def sources_of(criterion: Criterion, rubric: Rubric, package: PackageFacts) -> set[str]:
    """Return the paths of the C++ sources of the programs that the criterion's scenario starts."""
    names = names_started(criterion, rubric)
    every = any(one.built for one in starts_of(criterion, rubric))
    made = [
        one for one in programs(package) if every or one.target in names or any(map(one.is_called, names))
    ]
    words = {word.rpartition("/")[2] for one in made for word in sources_made(package, one.call)}
    paths = [PurePosixPath(file.path) for file in package.files]
    return {str(path) for path in paths if path.suffix in CPP_SUFFIXES and path.name in words}


def language_of(verdict: Verdict, criterion: Criterion, facts: Facts) -> Language | None:
    """Return the language of the nodes that the message names, that the criterion names, that publish on its topic, or
    of all.

    None where the scenario runs nodes of both and nothing tells which is meant.
    """
    name = criterion.scenario or ""
    scenario, run = facts.rubric.scenarios.get(name), facts.runs.get(name)
    if scenario is None or facts.package is None:
        return "python"
    asked = set(texts_in(criterion.parameters))
    known = _languages(facts, scenario, run)
    graph = run.graph if run else ()
    publishing = {node for _, event in graph for topic in asked for node in event.publishers.get(topic, ())}
    # From the surest to the vaguest: the first that leaves one language decides.
    for nodes in (set(re.findall(r"[\w/-]+", verdict.message)), asked, publishing, known):
        found = {known[one] for one in nodes if one in known}
        if len(found) == 1:
            return found.pop()
    return None if known else "python"


def _languages(facts: Facts, scenario: Scenario, run: Run | None) -> dict[str, Language]:
    """Return what each process and each node of the scenario is written in, by its name."""
    found: dict[str, Language] = {}
    for start in scenario.start:
        package = facts.package_of(start)
        if package is None:
            continue
        if start.built:
            found[start.name] = "cpp"
        elif start.script:
            found[start.name] = _written_in(package, start.script)
        for launch in package.launch_files:
            own = [n for n in launch.brings if PurePosixPath(launch.path).name == start.launch and n.type]
            packages = {one.name: one for one in (*package.also, package)}
            found |= {
                n.full_name: _written_in(packages[n.pkg], str(n.type)) for n in own if n.pkg in packages
            }
    for _, event in run.graph if run else ():
        for node, process in event.processes.items():
            # A program that was built is a process `<start>/<program>`.
            name = process.partition("/")[0]
            found |= {node: found[name]} if name in found else {}
    return found


def _written_in(package: PackageFacts, path: str) -> Language:
    file, name = find_script(package, path), PurePosixPath(path)
    if file is not None and file.python:
        return "python"
    built = any(name.stem == one.target or one.is_called(name.name) for one in programs(package))
    # Where CMake makes no program of that name, its source still tells
    sources = {f"{name.stem}{suffix}" for suffix in CPP_SUFFIXES} if file is None else set()
    built = built or any(PurePosixPath(one.path).name in sources for one in package.files)
    return "cpp" if built or name.suffix in CPP_SUFFIXES else "python"


RATE_SHARE = 0.05
"""By so much a rate that a script asks for may differ from the right one."""


def is_other_rate(slip: PythonSlip, hz: float) -> bool:
    """Return whether the rate that a script asks for is plainly not the lab's."""
    return abs(float(slip.message) - hz) > RATE_SHARE * hz


def wrong_rates(numbers: Sequence[PythonSlip], hz: float, texts: Sequence[str]) -> list[PythonSlip]:
    """Return which lines ask for another rate than `hz`, where that is plain: all of a script ask for the same one, or
    its one rate is made twice, once as it should be. `texts` are the lines."""
    wrong = [one for one in numbers if is_other_rate(one, hz)]
    names = {text.partition("=")[0].strip() for text in texts}
    agree = len({(one.file, one.message) for one in wrong}) == 1
    return wrong if agree and (len(wrong) == len(numbers) or len(names) == 1) else []


def misspelt_sleeps(lines: Sequence[str], rate: str) -> dict[str, list[int]]:
    """Return the lines, from 1, that call what a Rate of this name does not have, and `sleep` is meant: `Sleep`."""
    found: dict[str, list[int]] = {}
    call = re.compile(rf"(?:^|[^\w]){re.escape(rate.rpartition('.')[2])}\.(\w+)\b")
    for number, line in enumerate(lines if rate else (), 1):
        word = next(iter(call.findall(line)), "sleep")
        if word != "sleep" and (word.lower() == "sleep" or is_one_edit(word.lower(), "sleep")):
            found.setdefault(word, []).append(number)
    return found
