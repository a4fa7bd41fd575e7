"""The whole data flow of one grading, open → record → judge → write: begin reading here.

    intake            the source (folder, archive, git URL, recording) becomes a folder on this disk
    package           its files become package facts; nothing of them is executed
    arena             its nodes run in a sandbox, and everything they do is recorded
    evidence          what was recorded, as files: nothing after this needs ROS
    judging           the evidence and the rubric become statuses and points
    report            the result is written in every form that students and programs read

A submission that is a recording, or holds recordings only, is evidence already: it skips the package and the arena.

`grade` does all of it, `record` stops before judging, and `grader judge` (`judging/`) begins with the evidence. Many
submissions at once are `classes/batch/`, the repeated gradings of `grader check --watch` are `student/watching.py`:
both call `grade`.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from grader.errors import GraderError, UsageError
from grader.evidence.run import Run, console_log
from grader.faults import GradingContext, classify_errors
from grader.files import temporary_folder
from grader.intake.choose import WantedPackage
from grader.intake.open import open_recording_file, open_recordings_only, open_submission
from grader.intake.source import Source, local_path
from grader.judging.judge import judge_files
from grader.judging.summary import assemble_result, environment_info
from grader.model.figure import Figures
from grader.model.package import PackageFacts
from grader.model.record import build_records
from grader.model.result import EarlyVerdict, GradingResult, Progress, SubmissionInfo, TimingInfo
from grader.model.submission import RecordedSubmission, Submission
from grader.package.facts import read_packages
from grader.portable import wait_for_children
from grader.recording import (
    RecordingJob,
    RecordingOptions,
    RunsAndJudgement,
    import_deferred,
    judge_folder,
    judge_recorded,
    make_recorder,
    record_all,
    record_other_runs,
)
from grader.report.files import write_reports
from grader.report.view import hidden_ids
from grader.results import EVIDENCE, Results, finish_killed
from grader.ros_env import find_ros
from grader.rubric.load import LoadedRubric, files_of, needs_package, origin_of

if TYPE_CHECKING:
    from grader.arena.recording_files import Recording
    from grader.rubric.model import Rubric


@dataclass(frozen=True, kw_only=True)
class GradeOptions(RecordingOptions):
    """What a grading may be asked for, beside how it is recorded. The last four are for batches, watching and the
    Python API.

    Without `keep_hidden`, the reports leave hidden criteria out. Without `files`, only the result is wanted: neither
    evidence nor reports stay in the output folder. `package` is the name of the package to grade in place of the
    lab's, or "".

    `tidy` first finishes what killed graders left beside the submission's folder; a batch does that once for all.
    `find_earlier` is called when the submission is open: a result that it returns stays, and nothing is run. `settle`
    turns the automatic result into the one that counts: overrides and deadlines. `repository` is the student's, around
    the submission, where it is known.
    """

    submission_id: str | None = None
    package: str = ""
    keep_hidden: bool = True
    files: bool = True
    tidy: bool = True
    find_earlier: Callable[[SubmissionInfo], GradingResult | None] = lambda _: None
    settle: Callable[[GradingResult], GradingResult] = lambda result: result
    repository: Path | None = None


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
        context.submission = submission_info(submission)
        # each `made_up` of the rubric becomes this submission's own random value
        rubric = rubric.of_submission(submission.digest, context.submission.package)
        context.rubric_origin = origin_of(rubric, (local_path(source), options.repository))
        # before the folder is locked and prepared: a result that stays needs neither
        if (earlier := options.find_earlier(context.submission)) is not None:
            return earlier
        with Results(out / submission.id) as results:
            recording = None
            if isinstance(submission, RecordedSubmission):
                runs, judgement = copy_and_judge(submission, rubric, results.evidence, progress)
            else:
                job = recording_job(submission, rubric, results.evidence, options, progress)
                recording, (runs, judgement) = record_and_judge(job, keep_hidden=options.keep_hidden)
            result = assemble_result(
                context.submission,
                rubric,
                judgement.criteria,
                runs=runs,
                environment=environment_info(*(recording.labels if recording else ())),
                timing=clock.timing(recording),
                rubric_origin=context.rubric_origin,
            )
            result = options.settle(result)
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
        rubric = rubric.of_submission(submission.digest, submission.package.name)
        with Results(out / submission.id) as results:
            job = recording_job(submission, rubric, results.evidence, options, progress)
            with make_recorder(job) as recorder:
                record_all(job, recorder)
                names = [path.name for path in recorder.recording.files]
            results.commit()
    return [out / submission.id / EVIDENCE / name for name in names]


def provide_base_workspace(options: GradeOptions) -> None:
    """Make what many gradings share, before the first. If it cannot be made, each of them reports why."""
    from grader.arena.base_workspace import provide_base  # noqa: PLC0415 - see recording.DEFERRED_IMPORTS

    if not options.static_only:
        with suppress(GraderError), wait_for_children():
            provide_base(options.sandbox)


def preload_worker() -> None:
    """Do once what every grading needs, in the process that the workers of a batch are copies of (`workers.run_each`):
    imports, what is asked of this machine, and the process that arenas are copies of."""
    from grader import repaired_copy, submitted_recordings  # noqa: F401, PLC0415 - see recording.DEFERRED_IMPORTS
    from grader.arena import recorder  # noqa: F401, PLC0415
    from grader.arena.arena_process import template_of  # noqa: PLC0415
    from grader.arena.sandbox import choose_sandbox  # noqa: PLC0415
    from grader.arena.session import arena_command  # noqa: PLC0415
    from grader.package import launch, launch_loader  # noqa: F401, PLC0415
    from grader.report import figures, junit, markdown  # noqa: F401, PLC0415
    from grader.report.html.page import load_template  # noqa: PLC0415

    import_deferred()
    build_records()
    load_template()
    ros = find_ros()
    if ros is not None:
        template_of(*arena_command(ros))
        choose_sandbox("auto")


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
        # first, since a recording needs no package, whatever the rubric is about
        submission = open_recording_file(source, submission_id=submission_id)
        if submission is None and needs_package(rubric):
            package = wanted_package(rubric.rubric, options.package)
            submission = open_submission(source, package=package, workdir=folder, submission_id=submission_id)
        elif submission is None:
            submission = open_recordings_only(source, workdir=folder, submission_id=submission_id)
        progress.step("intake", "done", submission.id)
        yield submission


def wanted_package(rubric: Rubric, asked: str) -> WantedPackage:
    """Return what the intake has to look for: the lab's packages, in place of the main one what was `asked` for."""
    main, *others = (WantedPackage(name=name, paths=files_of(rubric, name)) for name in rubric.package_names)
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


def recording_job(
    submission: Submission, rubric: LoadedRubric, evidence: Path, options: GradeOptions, progress: Progress
) -> RecordingJob:
    """Return what is to be recorded into the folder `evidence`, with what the files say; none of them is executed."""
    progress.step("package", "running", "reading its files")
    facts = read_packages(submission, rubric.rubric.launch_commands)
    progress.step("package", "done")
    return RecordingJob(
        submission=submission,
        facts=facts,
        rubric=rubric,
        evidence=evidence,
        options=options,
        progress=progress,
    )


def record_and_judge(job: RecordingJob, *, keep_hidden: bool) -> tuple[Recording, RunsAndJudgement]:
    """Record every scenario, and judge it; then what a lost mark needs besides."""
    job.progress.early(lambda: judge_early(job.facts, job.rubric, keep_hidden=keep_hidden))
    with make_recorder(job) as recorder:
        record_all(job, recorder)
        judged = judge_recorded(recorder, job.evidence, job.rubric)
        if record_other_runs(job, recorder, judged):
            judged = judge_folder(job.evidence, job.rubric)
    return recorder.recording, judged


def copy_and_judge(
    submission: RecordedSubmission, rubric: LoadedRubric, evidence: Path, progress: Progress
) -> RunsAndJudgement:
    """Copy a submission's recordings into the folder `evidence`, and judge them."""
    from grader.submitted_recordings import copy_recordings  # noqa: PLC0415 - see recording.DEFERRED_IMPORTS

    copy_recordings(rubric.rubric, submission, evidence, progress)
    return judge_folder(evidence, rubric)


def judge_early(facts: PackageFacts, rubric: LoadedRubric, *, keep_hidden: bool) -> tuple[EarlyVerdict, ...]:
    """Return the verdicts that the files alone decide, without those of hidden criteria unless they are kept."""
    hidden = frozenset[str]() if keep_hidden else hidden_ids(rubric.rubric)
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
        from grader.report import figures  # noqa: PLC0415 - see recording.DEFERRED_IMPORTS

        return figures.figures_of(rubric.rubric, runs, result.criteria)
    return None
