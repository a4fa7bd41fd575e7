"""The whole data flow: begin reading here.

intake → package facts → arena → evidence → judge → report

A recording that is handed in is evidence already: it skips the package and the arena.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from functools import partial
from importlib import import_module
from pathlib import Path
from platform import python_version
from typing import TYPE_CHECKING, TypeAlias

from grader import __version__
from grader.errors import EvidenceError, GraderError, SubmissionError, UsageError
from grader.evidence.run import Run
from grader.faults import NOTHING_RUN, Attempt, told_apart
from grader.intake import open_recorded, open_recording, open_submission
from grader.intake.source import Source
from grader.judging import judge
from grader.judging.early import judge_files
from grader.judging.notes import notes_of
from grader.judging.summary import overall_status, total_points
from grader.model.figure import Figures
from grader.model.package import PackageFacts
from grader.model.progress import Progress
from grader.model.result import (
    CriterionResult,
    EarlyVerdict,
    EnvironmentInfo,
    GradingResult,
    RubricInfo,
    SubmissionInfo,
    TimingInfo,
)
from grader.model.submission import RecordedSubmission, Submission
from grader.model.verdict import Status
from grader.package import read_package
from grader.report.files import write_reports
from grader.report.hidden import hidden_ids
from grader.results import EVIDENCE, Results, finish_killed
from grader.rubric.load import LoadedRubric
from grader.rubric.needs import needs_package, needs_ros, started
from grader.rubric.rates import rates_of
from grader.temporary import temporary_folder

if TYPE_CHECKING:
    from grader.arena.asynchronous import Stop
    from grader.arena.recording import Recorder, Recording
    from grader.arena.sandbox import Mode

Judged: TypeAlias = tuple[dict[str, Run], tuple[CriterionResult, ...]]
ROS_TYPES = "rosbags.typesys.stores.ros1_noetic"
LATER = ("grader.evidence.decode", "grader.evidence.reader")
"""Slow to load, and needed by no verdict that the files alone decide. The arena is loaded when it is begun."""


@dataclass(frozen=True, kw_only=True)
class GradeOptions:
    """`static_only` judges files alone; without `keep_hidden`, the reports leave hidden criteria out.

    With `tidy`, what killed graders left beside the submission's folder is put in order first; a batch does that once.
    `kept` is asked when the submission is open: a result that it gives stays, and nothing is done. `settled` makes of
    the automatic result the one that counts. `recorded` is evidence by scenario that still holds: these are not run
    again. `stop` ends what runs, in order, from another thread; then `arena.asynchronous.Stopped` is raised.
    """

    sandbox: Mode = "auto"
    submission_id: str | None = None
    static_only: bool = False
    keep_hidden: bool = True
    tidy: bool = True
    kept: Callable[[SubmissionInfo], GradingResult | None] = lambda _: None
    settled: Callable[[GradingResult], GradingResult] = lambda result: result
    recorded: Mapping[str, Path] = field(default_factory=dict)
    stop: Stop | None = None


def prepare(options: GradeOptions) -> None:
    """Before many gradings: make what they share. What keeps it from being made, each of them says for itself."""
    from grader.arena.base import provide_base  # noqa: PLC0415 - see LATER

    if not options.static_only:
        with suppress(GraderError):
            provide_base(options.sandbox)


def grade(
    source: str | Source, rubric: LoadedRubric, out: Path, options: GradeOptions, progress: Progress
) -> GradingResult:
    """Grade one submission into `out/<its id>/`: evidence and reports, which replace older ones together.

    Raises GraderError where it cannot; the result then says why, with the status `error`.
    """
    clock = _Clock()
    attempt = Attempt(
        source=source,
        submission_id=options.submission_id,
        rubric=rubric,
        out=out,
        keep_hidden=options.keep_hidden,
        timing=lambda: clock.timing(None),
    )
    if options.tidy:
        finish_killed(out)
    with told_apart(attempt), _opened(source, rubric, options, progress) as submission:
        attempt.about = _about(submission)
        kept = options.kept(attempt.about)
        if kept is not None:
            return kept
        with Results(out / submission.id) as results:
            if isinstance(submission, RecordedSubmission):
                recording = None
                runs, criteria = _kept_and_judged(submission, rubric, results.evidence, progress)
            else:
                recording, runs, criteria = _recorded_and_judged(
                    submission, rubric, results.evidence, options, progress
                )
            graded = _result(submission, rubric, recording, criteria, clock)
            result = options.settled(graded.model_copy(update={"notes": notes_of(runs)}))
            write_reports(
                result,
                results.new,
                console=console_log(runs),
                rubric=rubric.rubric,
                keep_hidden=options.keep_hidden,
                figures=_figures(rubric, runs, result),
                docs=rubric.docs,
            )
            results.commit()
    return result


def record(
    source: str, rubric: LoadedRubric, out: Path, options: GradeOptions, progress: Progress
) -> list[Path]:
    """Record the rubric's scenarios into `out/<its id>/evidence/` and judge nothing."""
    finish_killed(out)
    with _opened(source, rubric, options, progress) as submission:
        if isinstance(submission, RecordedSubmission):
            raise UsageError(
                f"{submission.source}: there is nothing to run in it", hint="grade it, or judge it"
            )
        facts = _facts(submission, progress)
        with Results(out / submission.id) as results:
            with _recorder(
                submission, facts, rubric, results.evidence, options=options, progress=progress
            ) as recorder:
                recorder.record_all(partial(_load_modules, rubric))
                _keep_scenarios(rubric, submission, results.evidence, progress)
                names = [path.name for path in recorder.recording.files]
            results.commit()
    return [out / submission.id / EVIDENCE / name for name in names]


def console_log(runs: dict[str, Run]) -> str:
    """What the build and the student's processes printed, by scenario, with seconds since the run began."""
    lines = []
    for name, run in runs.items():
        lines += [f"== {name}"] if run.console else []
        own = {event.name for _, event in run.processes if event.role == "grader"}
        for time_ns, line in run.console:
            if line.process in own:
                continue
            text = line.line.replace("\n", "\\n")  # a line is one, whatever a recording says
            lines.append(f"{(time_ns - run.start_ns) / 1e9:8.3f} {line.process} {line.stream}: {text}")
    return "".join(f"{line}\n" for line in lines)


def _figures(rubric: LoadedRubric, runs: dict[str, Run], result: GradingResult) -> Figures | None:
    """What the reports show beside the verdicts. A result without pictures is better than none."""
    with suppress(Exception):
        from grader.figures import figures_of  # noqa: PLC0415 - see LATER

        return figures_of(rubric.rubric, runs, result.criteria)
    return None


class _Clock:
    """Seconds since now: of the wall, and of this process's CPU."""

    def __init__(self) -> None:
        self._wall, self._cpu = time.monotonic(), time.process_time()

    def timing(self, recording: Recording | None) -> TimingInfo:
        cpu_s, student_cpu_s = (recording.cpu_s, recording.student_cpu_s) if recording else (0.0, 0.0)
        return TimingInfo(
            wall_s=round(time.monotonic() - self._wall, 3),
            cpu_s=round(time.process_time() - self._cpu + cpu_s, 3),
            student_cpu_s=round(student_cpu_s, 3),
        )


@contextmanager
def _opened(
    source: str | Source, rubric: LoadedRubric, options: GradeOptions, progress: Progress
) -> Iterator[Submission | RecordedSubmission]:
    progress.step("intake", "running", source if isinstance(source, str) else source.given)
    with temporary_folder("source") as folder:
        recorded = open_recording(source, submission_id=options.submission_id)
        submission = recorded or _opened_tree(source, rubric, folder, options)
        progress.step("intake", "done", submission.id)
        yield submission


def _opened_tree(
    source: str | Source, rubric: LoadedRubric, workdir: Path, options: GradeOptions
) -> Submission | RecordedSubmission:
    if not needs_package(rubric):
        return open_recorded(source, workdir=workdir, submission_id=options.submission_id)
    return open_submission(
        source, package=rubric.rubric.package, workdir=workdir, submission_id=options.submission_id
    )


def _kept_and_judged(
    submission: RecordedSubmission, rubric: LoadedRubric, evidence: Path, progress: Progress
) -> Judged:
    if submission.file is None:
        _keep_scenarios(rubric, submission, evidence, progress)
    else:
        _keep_recording(submission.file, evidence)
    return _judged(evidence, rubric)


def _keep_recording(file: Path, evidence: Path) -> None:
    """A recording that was handed in and cannot be read is the submission's fault."""
    from grader.recordings import keep_recording  # noqa: PLC0415 - see LATER

    try:
        keep_recording(file, evidence)
    except EvidenceError as error:
        raise SubmissionError(error.message, hint=error.hint) from error


def _keep_scenarios(
    rubric: LoadedRubric, submission: Submission | RecordedSubmission, evidence: Path, progress: Progress
) -> None:
    from grader.recordings import keep_scenarios  # noqa: PLC0415 - see LATER

    keep_scenarios(rubric.rubric, submission, evidence, progress)


def _judged(evidence: Path, rubric: LoadedRubric) -> Judged:
    from grader.evidence.reader import load_evidence  # noqa: PLC0415 - see LATER

    runs = load_evidence([evidence])
    return runs, judge(rubric.rubric, runs, rubric.checks)


def _load_modules(rubric: LoadedRubric) -> None:
    """Before it is needed. Only probes need ROS's own message types, hundreds of them."""
    probes = any(scenario.probes for scenario in rubric.rubric.scenarios.values())
    for name in (*LATER, *([ROS_TYPES] if probes else [])):
        import_module(name)


def _facts(submission: Submission, progress: Progress) -> PackageFacts:
    progress.step("package", "running", "reading its files")
    facts = read_package(submission.package, hints=submission.hints)
    progress.step("package", "done")
    return facts


def _early(facts: PackageFacts, rubric: LoadedRubric, options: GradeOptions) -> tuple[EarlyVerdict, ...]:
    hidden = frozenset[str]() if options.keep_hidden else hidden_ids(rubric.rubric)
    found = judge_files(rubric.rubric, facts, rubric.checks)
    return tuple(verdict for verdict in found if verdict.criterion.id not in hidden)


def _recorder(
    submission: Submission,
    facts: PackageFacts,
    rubric: LoadedRubric,
    evidence: Path,
    *,
    options: GradeOptions,
    progress: Progress,
) -> Recorder:
    from grader.arena.recording import Recorder  # noqa: PLC0415 - see LATER

    return Recorder(
        submission,
        facts,
        started(rubric.rubric),
        evidence,
        rates=rates_of(rubric.rubric),
        mode=options.sandbox,
        static_only=options.static_only or not needs_ros(rubric),
        progress=progress,
        recorded=options.recorded,
        stop=options.stop,
    )


def _recorded_and_judged(
    submission: Submission, rubric: LoadedRubric, evidence: Path, options: GradeOptions, progress: Progress
) -> tuple[Recording, dict[str, Run], tuple[CriterionResult, ...]]:
    """What the evidence cannot say because the machine was late is recorded again, alone, at most twice."""
    facts = _facts(submission, progress)
    progress.early(lambda: _early(facts, rubric, options))
    from grader.arena.recording import RETRIES  # noqa: PLC0415 - see LATER

    with _recorder(submission, facts, rubric, evidence, options=options, progress=progress) as recorder:
        recorder.record_all(partial(_load_modules, rubric))
        _keep_scenarios(rubric, submission, evidence, progress)
        runs, criteria = _judged(evidence, rubric)
        for _ in range(RETRIES):
            again = _inconclusive_scenarios(criteria, recorder.recording)
            if not again:
                break
            recorder.record_again(again)
            runs, criteria = _judged(evidence, rubric)
    return recorder.recording, runs, criteria


def _inconclusive_scenarios(criteria: tuple[CriterionResult, ...], recording: Recording) -> list[str]:
    recorded = {path.stem for path in recording.files}
    doubtful = {c.scenario for c in criteria if c.status is Status.INCONCLUSIVE and c.scenario is not None}
    return sorted(doubtful & recorded)


def _result(
    submission: Submission | RecordedSubmission,
    rubric: LoadedRubric,
    recording: Recording | None,
    criteria: tuple[CriterionResult, ...],
    clock: _Clock,
) -> GradingResult:
    ros, sandbox = (recording.ros, recording.sandbox) if recording else (None, None)
    return GradingResult(
        submission=_about(submission),
        rubric=RubricInfo(id=rubric.rubric.id, version=rubric.rubric.version, digest=rubric.digest),
        status=overall_status(criteria),
        points=total_points(rubric.rubric, criteria),
        max_points=rubric.rubric.max_points,
        criteria=criteria,
        environment=EnvironmentInfo(
            grader=__version__,
            ros=ros.label if ros else "",
            python=python_version(),
            sandbox=sandbox.label if sandbox else NOTHING_RUN,
        ),
        timing=clock.timing(recording),
    )


def _about(submission: Submission | RecordedSubmission) -> SubmissionInfo:
    return SubmissionInfo(
        id=submission.id,
        source=submission.source,
        commit=submission.commit,
        digest=submission.digest,
        package=submission.package.name if isinstance(submission, Submission) else "",
    )
