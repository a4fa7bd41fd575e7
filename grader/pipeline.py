"""The whole data flow of one grading, open → record → judge → write: begin reading here.

    intake            the source (folder, archive, git URL, recording) becomes a folder on this disk
    package           its files become package facts; nothing of them is executed
    arena             its nodes run in a sandbox, and everything they do is recorded
    evidence          what was recorded, as files: nothing after this needs ROS
    judging           the evidence and the rubric become statuses and points
    report            the result is written in every form that students and programs read

A submission that is a recording, or holds recordings only, is evidence already: it skips the package and the arena.

`grade` does all of it, `record` stops before judging, and `grader judge` (`judging/`) begins with the evidence. Many
submissions at once are `classes/batch/`, the repeated gradings of `grader check --watch` are `student/watching/`: both
call `grade`.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from functools import partial
from importlib import import_module
from pathlib import Path
from platform import python_version
from typing import TYPE_CHECKING, TypeAlias

from grader import __version__
from grader.errors import EvidenceError, GraderError, HostError, SubmissionError, UsageError
from grader.evidence.run import Run, console_log
from grader.faults import NOTHING_RUN, GradingContext, classify_errors
from grader.files import make_folder, temporary_folder
from grader.installable import ON_THE_MACHINE
from grader.intake import open_recorded, open_recording, open_submission
from grader.intake.choose import Wanted
from grader.intake.source import Source, local_path
from grader.judging import judge
from grader.judging.early import judge_files
from grader.judging.judge import judge_all_runs
from grader.judging.other_runs import REPAIRS, was_built
from grader.judging.summary import closed_gate, notes_of, overall_status, total_points
from grader.model.figure import Figures
from grader.model.package import PackageFacts
from grader.model.progress import Progress, Silence
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
from grader.portable import wait_for_children
from grader.report.files import write_reports
from grader.report.view import hidden_ids
from grader.results import EVIDENCE, Results, finish_killed
from grader.ros_packages import look_for
from grader.rubric.load import LoadedRubric, files_of, needs_package, needs_ros, started
from grader.rubric.made_up import KEY
from grader.rubric.origin import origin_of
from grader.rubric.rates import rates_of, watched_of
from grader.wording import join_words

if TYPE_CHECKING:
    from grader.arena.asynchronous import Stop
    from grader.arena.recording import Recorder
    from grader.arena.static_recorder import Recording, StaticRecorder
    from grader.model.sandbox_mode import SandboxMode
    from grader.rubric.model import Rubric

LATER = ("grader.evidence.decode", "grader.evidence.reader")
"""Slow to import, and needed by no verdict that the files alone decide: imported while the build runs. The arena is
imported when it begins, and what judges or reports recordings when it is called."""
ROS_TYPES = "rosbags.typesys.stores.ros1_noetic"

Judged: TypeAlias = tuple[dict[str, Run], tuple[CriterionResult, ...]]
"""The runs by scenario, and the criteria judged by them, in the rubric's order."""


@dataclass(frozen=True, kw_only=True)
class GradeOptions:
    """What a grading may be asked for. The last four are for batches, watching and the Python API.

    `static_only` judges the files alone. Without `keep_hidden`, the reports leave hidden criteria out. Without `files`,
    only the result is wanted: neither evidence nor reports stay in the output folder.

    `package` is the name of the package to grade in place of the lab's, or "".

    `tidy` first finishes what killed graders left beside the submission's folder; a batch does that once for all.
    `find_earlier` is called when the submission is open: a result that it returns stays, and nothing is run. `settle`
    turns the automatic result into the one that counts: overrides and deadlines. `reused` is evidence by scenario that
    still holds: these scenarios are not run again. `repository` is the student's, around the submission, where it is
    known. `stop` ends the runs in order, from another thread; then `arena.asynchronous.Stopped` is raised.
    """

    sandbox: SandboxMode = "auto"
    submission_id: str | None = None
    package: str = ""
    static_only: bool = False
    keep_hidden: bool = True
    tidy: bool = True
    files: bool = True
    find_earlier: Callable[[SubmissionInfo], GradingResult | None] = lambda _: None
    settle: Callable[[GradingResult], GradingResult] = lambda result: result
    reused: Mapping[str, Path] = field(default_factory=dict)
    repository: Path | None = None
    stop: Stop | None = None


def grade(
    source: str | Source, rubric: LoadedRubric, out: Path, options: GradeOptions, progress: Progress
) -> GradingResult:
    """Grade one submission into `out/<its id>/`: evidence and reports, which replace older ones together.

    Raises GraderError where it cannot be graded; the result then says why, with the status `error`.
    """
    clock = Clock()
    context = GradingContext(
        source=source,
        submission_id=options.submission_id,
        rubric=rubric,
        out=out,
        keep_hidden=options.keep_hidden,
        timing=clock.timing,
    )
    if options.tidy:
        finish_killed(out)
    with (
        classify_errors(context),
        wait_for_children(),
        open_source(source, rubric, options, progress) as submission,
    ):
        rubric = rubric.of_submission(submission.digest)
        context.submission = submission_info(submission)
        context.rubric_origin = origin_of(rubric, (local_path(source), options.repository))
        earlier = options.find_earlier(context.submission)
        if earlier is not None:
            return earlier
        with Results(out / submission.id) as results:
            recording = None
            if isinstance(submission, RecordedSubmission):
                runs, criteria = keep_and_judge(submission, rubric, results.evidence, progress)
            else:
                recording, runs, criteria = record_and_judge(
                    submission, rubric, results.evidence, options, progress
                )
            timing = clock.timing(recording)
            result = options.settle(
                assemble_result(
                    context.submission, rubric, runs, criteria, recording=recording, timing=timing
                ).model_copy(update={"rubric_origin": context.rubric_origin})
            )
            if options.files:
                write(result, results, rubric, runs, keep_hidden=options.keep_hidden)
    return result


def record(
    source: str, rubric: LoadedRubric, out: Path, options: GradeOptions, progress: Progress
) -> list[Path]:
    """Record the rubric's scenarios into `out/<its id>/evidence/`, judge nothing, and return the files."""
    finish_killed(out)
    with wait_for_children(), open_source(source, rubric, options, progress) as submission:
        if isinstance(submission, RecordedSubmission):
            raise UsageError(
                f"{submission.source}: there is nothing to run in it", hint="grade it, or judge it"
            )
        facts = read_facts(submission, progress)
        rubric = rubric.of_submission(submission.digest)
        with Results(out / submission.id) as results:
            evidence = results.evidence
            with make_recorder(
                submission, facts, rubric, evidence, options=options, progress=progress
            ) as recorder:
                recorder.record_all(partial(import_later, rubric))
                keep_recordings(submission, rubric, evidence, progress)
                names = [path.name for path in recorder.recording.files]
            results.commit()
    return [out / submission.id / EVIDENCE / name for name in names]


def prepare(options: GradeOptions) -> None:
    """Make what many gradings share, before the first. If it cannot be made, each of them reports why."""
    from grader.arena.base_workspace import provide_base  # noqa: PLC0415 - see LATER

    if not options.static_only:
        with suppress(GraderError), wait_for_children():
            provide_base(options.sandbox)


# --- Open -------------------------------------------------------------------------------------------------------------


@contextmanager
def open_source(
    source: str | Source, rubric: LoadedRubric, options: GradeOptions, progress: Progress
) -> Iterator[Submission | RecordedSubmission]:
    """Open the submission for as long as the block runs. Raises SubmissionError, UsageError."""
    progress.step("intake", "running", source if isinstance(source, str) else source.given)
    with temporary_folder("source") as folder:
        submission_id = options.submission_id
        submission: Submission | RecordedSubmission | None
        submission = open_recording(source, submission_id=submission_id)
        if submission is None and needs_package(rubric):
            package = wanted_package(rubric.rubric, options.package)
            submission = open_submission(source, package=package, workdir=folder, submission_id=submission_id)
        elif submission is None:
            submission = open_recorded(source, workdir=folder, submission_id=submission_id)
        progress.step("intake", "done", submission.id)
        yield submission


def wanted_package(rubric: Rubric, asked: str) -> Wanted:
    """Return what the intake has to look for: the lab's packages, in place of the main one what was `asked` for."""
    main, *others = (Wanted(name=name, files=files_of(rubric, name)) for name in rubric.package_names)
    return replace(main, asked=asked, others=tuple(others))


def submission_info(submission: Submission | RecordedSubmission) -> SubmissionInfo:
    """Return whose work it is, as the result says it."""
    return SubmissionInfo(
        id=submission.id,
        source=submission.source,
        commit=submission.commit,
        digest=submission.digest,
        package=submission.package.name if isinstance(submission, Submission) else "",
    )


# --- Record -----------------------------------------------------------------------------------------------------------


def record_and_judge(
    submission: Submission, rubric: LoadedRubric, evidence: Path, options: GradeOptions, progress: Progress
) -> tuple[Recording, dict[str, Run], tuple[CriterionResult, ...]]:
    """Record every scenario into the folder `evidence`, and judge it; then what a lost mark needs besides."""
    facts = read_facts(submission, progress)
    progress.early(lambda: judge_early(facts, rubric, options))
    with make_recorder(submission, facts, rubric, evidence, options=options, progress=progress) as recorder:
        recorder.record_all(partial(import_later, rubric))
        keep_recordings(submission, rubric, evidence, progress)
        runs, criteria = judge_recorded(recorder, evidence, rubric)
        others = record_other_runs(
            submission,
            recorder,
            runs=runs,
            rubric=rubric,
            evidence=evidence,
            options=options,
            progress=progress,
        )
        if others:
            runs, criteria = judge_folder(evidence, rubric)
    return recorder.recording, runs, criteria


def record_other_runs(
    submission: Submission,
    recorder: Recorder | StaticRecorder,
    *,
    runs: dict[str, Run],
    rubric: LoadedRubric,
    evidence: Path,
    options: GradeOptions,
    progress: Progress,
) -> bool:
    """Record what a lost mark needs besides the first runs, and return whether there was anything.

    What one run's timing could have lost is run once more. Where a mechanical repair could be the reason, a repaired
    copy is run.
    """
    if recorder.recording.sandbox is None and recorder.recording.ros is None:
        return False
    from grader import repaired_copy as copies  # noqa: PLC0415 - only a lost mark needs it

    judged = judge_all_runs(rubric.rubric, runs, rubric.checks)
    repairs, scenarios = copies.choose_repairs(
        submission, recorder.recording.facts, rubric.rubric, judged.criteria, built=was_built(runs)
    )
    doubtful = sorted(judged.doubtful - set(scenarios))
    if doubtful:
        recorder.repeat(doubtful, evidence / copies.REPEATED)
    if repairs:
        with copies.repaired_copy(submission, repairs) as copy:
            if copy is None:
                return bool(doubtful)
            again = make_recorder(
                copy,
                read_facts(copy, Silence()),
                rubric,
                evidence / copies.REPAIRED,
                options=replace(options, reused={}),
                progress=copies.CopyProgress(progress),
                only=scenarios,
                about={REPAIRS: copies.dump_repairs(repairs)},
            )
            with again:
                again.record_all(lambda: None)
                judge_recorded(again, evidence, rubric)
            recorder.recording.add(again.recording)
    return bool(doubtful or repairs)


def judge_recorded(recorder: Recorder | StaticRecorder, evidence: Path, rubric: LoadedRubric) -> Judged:
    """Judge what is in the folder `evidence`. What this recorder recorded and nobody can judge because the machine was
    late is recorded again, alone, at most `RETRIES` times."""
    from grader.arena.static_recorder import RETRIES  # noqa: PLC0415 - see LATER

    runs, criteria = judge_folder(evidence, rubric)
    for _ in range(RETRIES):
        again = inconclusive_scenarios(criteria, recorder.recording)
        if not again:
            break
        recorder.record_again(again)
        runs, criteria = judge_folder(evidence, rubric)
    return runs, criteria


def read_facts(submission: Submission, progress: Progress) -> PackageFacts:
    """Return what the files say; nothing of them is executed."""
    progress.step("package", "running", "reading its files")
    facts = read_package(submission.package, hints=submission.hints)
    if submission.also:
        facts = facts.model_copy(update={"also": tuple(map(read_package, submission.also))})
    progress.step("package", "done")
    return facts


def make_recorder(
    submission: Submission,
    facts: PackageFacts,
    rubric: LoadedRubric,
    evidence: Path,
    *,
    options: GradeOptions,
    progress: Progress,
    only: Collection[str] | None = None,
    about: Mapping[str, str] | None = None,
) -> Recorder | StaticRecorder:
    """Return what records the rubric's scenarios (`only` these) into the folder `evidence`, to be used as a context:
    the arena, or a recorder of files alone where nothing is to be run, or can be. `about` goes into the metadata."""
    from grader.arena.static_recorder import (  # noqa: PLC0415 - see LATER
        STATIC_ONLY,
        StaticRecorder,
        why_unrun,
    )

    make_folder(evidence)
    scenarios = started(rubric.rubric, only)
    reason = STATIC_ONLY if options.static_only or not needs_ros(rubric) else why_unrun()
    if reason:
        return StaticRecorder(
            submission,
            facts,
            scenarios,
            evidence,
            reason=reason,
            progress=progress,
            recorded=options.reused,
        )
    from grader.arena.recording import Recorder  # noqa: PLC0415 - see LATER

    refuse_missing(rubric.rubric)
    made_up = {KEY: json.dumps(rubric.rubric.values)} if rubric.rubric.values else {}
    return Recorder(
        submission,
        facts,
        scenarios,
        evidence,
        beside=rubric.path.parent,
        rates=rates_of(rubric.rubric),
        watched=watched_of(rubric.rubric),
        mode=options.sandbox,
        progress=progress,
        recorded=options.reused,
        stop=options.stop,
        about={**made_up, **(about or {})},
    )


def refuse_missing(rubric: Rubric) -> None:
    """Raise HostError where this machine lacks what the rubric says that the lab needs."""
    lacking = [need for need in look_for(**rubric.needs.model_dump()) if not need.here]
    if lacking:
        raise HostError(
            f"the lab needs {join_words(need.name for need in lacking)}, which this machine lacks",
            hint="; ".join(need.install for need in lacking),
        )


def keep_recordings(
    submission: Submission | RecordedSubmission, rubric: LoadedRubric, evidence: Path, progress: Progress
) -> None:
    """Copy the recordings that scenarios name in the submission into the folder `evidence`."""
    from grader import submitted_recordings  # noqa: PLC0415 - see LATER

    submitted_recordings.keep_scenarios(rubric.rubric, submission, evidence, progress)


def import_later(rubric: LoadedRubric) -> None:
    """Import modules before they are needed. Only what the grader sends needs ROS's own message types, hundreds."""
    sends = any(s.probes or s.steps or s.serves for s in rubric.rubric.scenarios.values())
    for name in (*LATER, *([ROS_TYPES] if sends else [])):
        import_module(name)


def inconclusive_scenarios(criteria: tuple[CriterionResult, ...], recording: Recording) -> list[str]:
    """Return the scenarios that were run and left a criterion inconclusive."""
    recorded = {path.stem for path in recording.files}
    late = (c for c in criteria if c.status is Status.INCONCLUSIVE and not c.hint.startswith(ON_THE_MACHINE))
    return sorted({c.scenario for c in late if c.scenario is not None} & recorded)


# --- Judge ------------------------------------------------------------------------------------------------------------


def judge_folder(evidence: Path, rubric: LoadedRubric) -> Judged:
    """Read and judge what is in the folder. Raises EvidenceError."""
    from grader.evidence.reader import load_evidence  # noqa: PLC0415 - see LATER

    runs = load_evidence([evidence])
    return runs, judge(rubric.rubric, runs, rubric.checks, rubric.handed_out)


def keep_and_judge(
    submission: RecordedSubmission, rubric: LoadedRubric, evidence: Path, progress: Progress
) -> Judged:
    """Copy a submission's recordings into the folder `evidence`, and judge them. Raises SubmissionError where the one
    that is the whole submission cannot be read."""
    if submission.file is None:
        keep_recordings(submission, rubric, evidence, progress)
        return judge_folder(evidence, rubric)
    from grader.submitted_recordings import keep_recording  # noqa: PLC0415 - see LATER

    try:
        keep_recording(submission.file, evidence)
    except EvidenceError as error:
        raise SubmissionError(error.message, hint=error.hint) from error
    return judge_folder(evidence, rubric)


def judge_early(facts: PackageFacts, rubric: LoadedRubric, options: GradeOptions) -> tuple[EarlyVerdict, ...]:
    """Return the verdicts that the files alone decide, without hidden ones where `options` leave them out."""
    hidden = frozenset[str]() if options.keep_hidden else hidden_ids(rubric.rubric)
    found = judge_files(rubric.rubric, facts, rubric.checks, rubric.handed_out)
    return tuple(verdict for verdict in found if verdict.criterion.id not in hidden)


# --- Write ------------------------------------------------------------------------------------------------------------


class Clock:
    """Measures a grading from its beginning: wall-clock time, and CPU time of this process."""

    def __init__(self) -> None:
        self._wall, self._cpu = time.monotonic(), time.process_time()

    def timing(self, recording: Recording | None = None) -> TimingInfo:
        """Return the seconds until now, with those that the recording took in other processes."""
        cpu_s, student_cpu_s = (recording.cpu_s, recording.student_cpu_s) if recording else (0.0, 0.0)
        return TimingInfo(
            wall_s=round(time.monotonic() - self._wall, 3),
            cpu_s=round(time.process_time() - self._cpu + cpu_s, 3),
            student_cpu_s=round(student_cpu_s, 3),
        )


def assemble_result(
    submission: SubmissionInfo,
    rubric: LoadedRubric,
    runs: dict[str, Run],
    criteria: tuple[CriterionResult, ...],
    *,
    recording: Recording | None = None,
    timing: TimingInfo,
) -> GradingResult:
    """Return the automatic result. Without a `recording`, nothing was run."""
    ros, sandbox = (recording.ros, recording.sandbox) if recording else (None, None)
    return GradingResult(
        submission=submission,
        rubric=RubricInfo(id=rubric.rubric.id, version=rubric.rubric.version, digest=rubric.digest),
        status=overall_status(criteria),
        points=total_points(rubric.rubric, criteria),
        gate=closed_gate(rubric.rubric, criteria),
        max_points=rubric.rubric.max_points,
        criteria=criteria,
        environment=EnvironmentInfo(
            grader=__version__,
            ros=ros.label if ros else "",
            python=python_version(),
            sandbox=sandbox.label if sandbox else NOTHING_RUN,
        ),
        timing=timing,
        notes=notes_of(runs),
    )


def write(
    result: GradingResult, results: Results, rubric: LoadedRubric, runs: dict[str, Run], *, keep_hidden: bool
) -> None:
    """Write the reports, and replace earlier evidence and reports together."""
    write_reports(
        result,
        results.new,
        console=console_log(runs),
        rubric=rubric.rubric,
        keep_hidden=keep_hidden,
        figures=draw_figures(rubric, runs, result),
        docs=rubric.docs,
    )
    results.commit()


def draw_figures(rubric: LoadedRubric, runs: dict[str, Run], result: GradingResult) -> Figures | None:
    """Return what the reports show beside the verdicts. A result without figures is better than none."""
    with suppress(Exception):
        from grader.report import figures  # noqa: PLC0415 - see LATER

        return figures.figures_of(rubric.rubric, runs, result.criteria)
    return None
