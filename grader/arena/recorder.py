"""Records everything that a rubric needs of one submission: the package, its build, and every scenario.

The runs go side by side, as far as the machine admits them.
"""

from __future__ import annotations

import asyncio
import os
import sys
import threading
import time
from collections import Counter
from collections.abc import Callable, Container, Coroutine, Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

from typing_extensions import Self

from grader.arena.admission import Admission, shared_folder
from grader.arena.base_workspace import copy_course, provide_course
from grader.arena.build import BUILD_EXPECTED_S, CMakeTrace, build
from grader.arena.interruption import Stop, run_together, run_until_signal
from grader.arena.limits import RunLimits
from grader.arena.process_environment import ProcessEnvironment
from grader.arena.recording_files import (
    RETRIES,
    Recording,
    copy_recorded,
    left_out_events,
    metadata,
    write_files,
)
from grader.arena.run_scenario import expected_s, run_scenario
from grader.arena.sandbox import choose_sandbox, temporary_base
from grader.arena.sandbox_files import prepare
from grader.arena.workspace import make_workspace
from grader.errors import ArenaError, RosMissing
from grader.evidence.events import PACKAGE_RUN, ActorEvent, ScenarioEvent
from grader.evidence.writer import EvidenceWriter
from grader.files import make_folder, read_untrusted, temporary_folder
from grader.model import SandboxMode
from grader.model.generated_headers import surely_waits
from grader.model.message_rate import RateBounds
from grader.model.package import PackageFacts
from grader.model.result import Progress
from grader.model.submission import SourcePackage, Submission
from grader.package.facts import imports_of_machine, python_paths, with_build_facts
from grader.package.manifest import read_manifest
from grader.package.python import REPORT_BYTES_MAX, SyntaxReport, read_syntax_report
from grader.ros_env import INSTALL_HINT, NO_ROS, find_ros
from grader.rubric.model import Rubric
from grader.rubric.scenario import JudgedGoal

WAITING = "for its turn"
WAITING_ALONE = "to be run again, alone"
_UMASK = threading.Lock()
"""It is the whole process's: two gradings in threads of one would leave each other's behind."""


class Recorder:
    """Records one submission into a folder. Use as a context: its workspaces live as long as it does.

    `rates` are judged, by scenario: a run that is to show them ends when they are clear. `watched` is how long nodes
    have to be seen (s), by scenario. `recorded` is evidence, by scenario, that stands for a run of it: it is copied.
    `whole` is the rubric with the scenarios that are not run here: a script that one of them starts gets its repairs.
    `stop` ends the runs from another thread. `about` is metadata for all its evidence, `beside` the rubric's folder.
    """

    def __init__(
        self,
        submission: Submission,
        facts: PackageFacts,
        rubric: Rubric,
        folder: Path,
        *,
        mode: SandboxMode,
        progress: Progress,
        whole: Rubric | None = None,
        beside: Path | None = None,
        rates: Mapping[str, tuple[RateBounds, ...]] | None = None,
        watched: Mapping[str, float] | None = None,
        goals: Mapping[str, Mapping[tuple[str, int], JudgedGoal]] | None = None,
        recorded: Mapping[str, Path] | None = None,
        stop: Stop | None = None,
        about: Mapping[str, str] | None = None,
    ) -> None:
        self._submission = submission
        self._about = about or {}
        self._recorded = recorded or {}
        self._stop = stop
        self._rates = rates or {}
        self._watched = watched or {}
        self._goals = goals or {}
        self._rubric, self._whole = rubric, whole or rubric
        self._beside = beside
        self._progress = progress
        # The bytes of one submission's evidence are shared among its runs.
        keeping = sum(bool(scenario.keeps) for scenario in rubric.scenarios.values())
        self._limits = RunLimits().shared_by(len(rubric.scenarios), keeping=keeping)
        ros = find_ros()
        if ros is None:
            raise RosMissing(NO_ROS, hint=INSTALL_HINT)
        self._ros, self._sandbox, self._not_run = ros, choose_sandbox(mode), ""
        self.recording = Recording(folder=folder, facts=facts, ros=ros, sandbox=self._sandbox)
        self._place: ProcessEnvironment | None = None
        self._stack = ExitStack()
        self._admission: Admission
        self._runs: Counter[str] = Counter()
        self._expected_s = {name: expected_s(scenario) for name, scenario in rubric.scenarios.items()}

    def __enter__(self) -> Self:
        base = temporary_base(self._sandbox)
        self._folder = self._stack.enter_context(temporary_folder("run", base))
        self._folder.chmod(0o711)
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def record_all(self, beside_build: Callable[[], None]) -> None:
        """Record the package with its build, then every scenario, side by side. `beside_build` is called beside the
        build, in another thread."""
        self._run(self._record_all(beside_build))

    def record_again(self, scenarios: Iterable[str]) -> None:
        """Record these scenarios once more, one after the other, with no other run on the machine."""
        self._run(self._record_alone(tuple(scenarios)))

    def repeat(self, scenarios: Iterable[str], folder: Path) -> None:
        """Record these scenarios once more, side by side, into another folder: what was recorded before stays as
        well."""
        make_folder(folder)
        if self._place is not None:
            runs = [self._record_scenario(self._place, name, folder=folder) for name in scenarios]
            self._run(run_together(*runs))

    def _run(self, work: Coroutine[Any, Any, None]) -> None:
        """Run it in an event loop of its own, and so with an admission of its own."""
        self._admission = Admission(shared_folder())
        run_until_signal(work, self._stop)

    async def _record_all(self, beside_build: Callable[[], None]) -> None:
        names = [name for name in order_runs(self._rubric, self._rates) if name not in self._recorded]
        copy_recorded(self._recorded, self.recording.folder, self._progress)
        self._progress.step("build", "waiting", "", BUILD_EXPECTED_S)
        for name in names:
            self._progress.step(name, "waiting", "for the build", self._expected_s[name])
        await run_together(self._record_package(), asyncio.to_thread(beside_build))
        if self._place is None:
            for name in names:
                self._progress.step(name, "skipped", self._not_run)
            return
        await run_together(*(self._record_scenario(self._place, name) for name in names))

    async def _record_alone(self, names: tuple[str, ...]) -> None:
        for name in names:
            if self._place is not None:
                await self._record_scenario(self._place, name, alone=True)

    async def _record_package(self) -> None:
        """Record the package and its build. Where the machine fails the build, build once more: nothing can run without
        it."""
        try:
            await self._write_package(self._folder / "first", last=False)
        except ArenaError as error:
            self._progress.step("build", "waiting", f"once more: {error.message}", BUILD_EXPECTED_S)
            # In a new folder: what the first try left there may be what went wrong.
            await self._write_package(self._folder / "second", last=True)

    async def _write_package(self, folder: Path, *, last: bool) -> None:
        recording = self.recording
        path = recording.folder / f"{PACKAGE_RUN}.mcap"
        about = self._metadata()
        with EvidenceWriter(path, scenario=PACKAGE_RUN, clock="real", warp=1.0, metadata=about) as writer:
            await self._build(self._make_place(folder), writer, last=last)
            write_files(writer, self._submission, recording.facts)
            for event in left_out_events(recording.facts):
                writer.event("/grader/actor", time.time_ns(), event)
        recording.files.append(path)

    async def _build(self, place: ProcessEnvironment, writer: EvidenceWriter, *, last: bool) -> None:
        self._progress.step("build", "waiting", WAITING, BUILD_EXPECTED_S)
        recording = self.recording
        facts = recording.facts
        faulty, *more = (
            [script for script in self._scripts(one) if _needs_answer(one, script)]
            for one in (facts, *facts.also)
        )
        answers_of = dict(zip((one.asked for one in facts.also), more, strict=True))
        # A build starts at least as many processes as a run.
        async with self._admission.run(), self._admission.start():
            self._progress.step("build", "running", "catkin_make", BUILD_EXPECTED_S)
            try:
                await provide_course(place)
                self._place, outcome = await build(
                    place,
                    writer,
                    _python_files(place, facts),
                    faulty,
                    headers=_headers_included(place, facts),
                    last_run=last,
                    answers_of=answers_of,
                )
            except ArenaError as error:
                if not last:
                    raise
                event = ScenarioEvent(event="end", outcome="host", detail=error.message)
                writer.event("/grader/scenario", time.time_ns(), event)
                self._progress.step("build", "failed", error.message)
                self._not_run = error.message
                return
        recording.add(outcome)
        report = _syntax_report(outcome.syntax, writer)
        also = tuple(
            _with_build_facts(one, source, outcome.others[one.asked], report, _above(place, one))
            for source, one in zip(self._submission.also, facts.also, strict=True)
        )
        trace = CMakeTrace(trace=outcome.trace, root=outcome.root)
        told = _with_build_facts(facts, self._submission.package, trace, report, "")
        recording.facts = told.model_copy(update={"also": also})
        self._progress.step("build", *(("done", "") if outcome.ok else ("failed", "catkin_make failed")))

    def _make_place(self, folder: Path) -> ProcessEnvironment:
        folder.mkdir()
        folder.chmod(0o711)
        facts = self.recording.facts
        with _readable_by_all():
            prepare(folder, self._ros)
            workspace = make_workspace(
                folder,
                self._submission,
                facts,
                self._scripts(facts),
                self._sandbox,
                course=self._rubric.packages,
                scripts_of={one.asked: self._scripts(one) for one in facts.also},
            )
            if self._beside is not None:
                copy_course(self._beside, self._rubric.packages, folder / "course")
        return ProcessEnvironment(
            folder=folder,
            ros=self._ros,
            sandbox=self._sandbox,
            limits=self._limits,
            workspace=workspace,
            package=workspace.name,
            missing=frozenset(self._rubric.package_names[1:]) - {one.asked for one in facts.also},
        )

    def _scripts(self, facts: PackageFacts) -> list[str]:
        """Return the paths, in one of the packages, of the scripts that the scenarios start."""
        paths = [f.path for f in sorted(facts.files, key=lambda f: (f.path.count("/"), f.path))]
        package = facts.asked or self._rubric.package
        starts = [start for scenario in self._whole.scenarios.values() for start in scenario.start]
        wanted = {s.script for s in starts if s.script and self._rubric.package_of(s) == package}
        # Reversed, so that of several files of one name the shallowest stays.
        names = {Path(path).name: path for path in reversed(paths)}
        matches = (script if script in paths else names.get(Path(script).name) for script in sorted(wanted))
        return [match for match in matches if match is not None]

    async def _record_scenario(
        self, place: ProcessEnvironment, name: str, *, alone: bool = False, folder: Path | None = None
    ) -> None:
        scenario, shown = self._rubric.scenarios[name], ""

        def tell(detail: str) -> None:
            nonlocal shown
            if detail != shown:
                shown = detail
                self._progress.step(name, "running", detail, self._expected_s[name])

        self._progress.step(name, "waiting", WAITING_ALONE if alone else WAITING, self._expected_s[name])
        path = (folder or self.recording.folder) / f"{name}.mcap"
        async with self._admission.run(alone=alone):
            self.recording.add(
                await run_scenario(
                    name,
                    scenario,
                    place,
                    path=path,
                    metadata=self._metadata() | {"scenario.digest": scenario.digest},
                    tell=tell,
                    rates=self._rates.get(name, ()),
                    watched_s=self._watched.get(name, 0.0),
                    goals=self._goals.get(name),
                    admission=self._admission,
                    last_run=self._runs[name] == RETRIES,
                    beside=self._beside,
                )
            )
        self._runs[name] += 1
        if path not in self.recording.files:
            self.recording.files.append(path)
        self._progress.step(name, "done")

    def _metadata(self) -> dict[str, str]:
        return {**metadata(self._submission, self.recording, self._limits), **self._about}


def _syntax_report(path: Path | None, writer: EvidenceWriter) -> SyntaxReport | None:
    """Return what ROS's own Python said; None where that is too much, and then this Python's report stands."""
    said = read_untrusted(path, REPORT_BYTES_MAX) if path else None
    if said is not None and len(said) == REPORT_BYTES_MAX:
        detail = f"gives more than {REPORT_BYTES_MAX >> 20} MB of remarks on its Python files"
        event = ActorEvent(action="limit", actor="the package", detail=detail)
        writer.event("/grader/actor", time.time_ns(), event)
        return None
    return None if said is None else read_syntax_report(said)


def _above(place: ProcessEnvironment, facts: PackageFacts) -> str:
    """Return what goes before a path of another package, from the main one's folder in the workspace."""
    return f"../{place.workspace.others[facts.asked].folder}/" if facts.asked else ""


def _python_files(place: ProcessEnvironment, facts: PackageFacts) -> list[str]:
    """Return the files that ROS's Python is to compile, from the main package's folder in the workspace.

    There are none where this Python is of the same version and had nothing to say against any, and they import nothing
    that only some machines have: ROS's would find the same.
    """
    packages = (facts, *facts.also)
    clean = not any(file.python_fault for one in packages for file in one.files)
    if (
        clean
        and not any(map(imports_of_machine, packages))
        and place.ros.python_version == sys.version_info[:2]
    ):
        return []
    return [_above(place, one) + path for one in packages for path in python_paths(one)]


def _headers_included(place: ProcessEnvironment, facts: PackageFacts) -> list[str]:
    """Return the targets that make the headers of the workspace's own messages which C++ of the lab's packages includes
    without waiting for them, as far as the files show."""
    included = {
        header.partition("/")[0]
        for one in facts.views()
        if not surely_waits(one)
        for file in one.files
        for header in file.headers
    }
    folders = (place.workspace.built / "src").iterdir() if included else ()
    manifests = (read_manifest(folder)[0] for folder in sorted(folders) if folder.is_dir())
    names = {one.name for one in manifests if one is not None}
    return [f"{name}_generate_messages_cpp" for name in sorted(names & included)]


def _with_build_facts(
    facts: PackageFacts, source: SourcePackage, cmake: CMakeTrace, report: SyntaxReport | None, above: str
) -> PackageFacts:
    """Return the facts refined by what the build showed of this package, whose paths stand behind `above`."""
    own = report.below(above) if report else None
    return with_build_facts(
        facts,
        cmake_trace=cmake.trace,
        cmake_root=cmake.root,
        python_faults=own.faults if own else None,
        python_slips=own.slips if own else None,
        folder=source.folder,
    )


@contextmanager
def _readable_by_all() -> Iterator[None]:
    """Inside, new files are readable by all, whatever the umask: students' processes of root's have another user. The
    folder around them has a name that cannot be guessed."""
    with _UMASK:
        before = os.umask(0o022)
        try:
            yield
        finally:
            os.umask(before)


def _needs_answer(facts: PackageFacts, path: str) -> bool:
    file = facts.file(path)
    if file is None:
        return False
    shebang = file.shebang
    unusable = shebang is None or shebang.crlf or shebang.found is False or file.names_other_language
    return file.executable is False or unusable


def order_runs(rubric: Rubric, rated: Container[str]) -> tuple[str, ...]:
    """Return the runs' names in the order in which they ask to begin: those that measure a rate (in real time) first,
    then the longest, so that the others start while it is watched."""
    scenarios = rubric.scenarios
    measuring = {n for n, s in scenarios.items() if n in rated and s.clock == "real"}
    return tuple(sorted(scenarios, key=lambda n: (n not in measuring, -expected_s(scenarios[n]))))
