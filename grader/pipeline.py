"""The whole data flow: begin reading here.

intake → package facts → arena → evidence → judge → report

A recording that is handed in is evidence already: it skips the package and the arena. `grader/steps/` has the steps.
"""

from __future__ import annotations

from contextlib import suppress
from functools import partial
from pathlib import Path

from grader.errors import GraderError, UsageError
from grader.faults import Attempt, told_apart
from grader.intake.source import Source
from grader.model.progress import Progress
from grader.model.result import GradingResult
from grader.model.submission import RecordedSubmission
from grader.report.files import write_reports
from grader.results import EVIDENCE, Results, finish_killed
from grader.rubric.load import LoadedRubric
from grader.steps import (
    Clock,
    GradeOptions,
    about,
    console_log,
    figures_of,
    judged_recording,
    keep_scenarios,
    loaded_meanwhile,
    opened,
    outcome,
    read_facts,
    recorded_and_judged,
    recorder,
    waited_for,
)

__all__ = ["GradeOptions", "console_log", "grade", "prepare", "record"]


def prepare(options: GradeOptions) -> None:
    """Before many gradings: make what they share. What keeps it from being made, each of them says for itself."""
    from grader.arena.base_workspace import provide_base  # noqa: PLC0415 - see steps.recorded.LATER

    if not options.static_only:
        with suppress(GraderError), waited_for():
            provide_base(options.sandbox)


def grade(
    source: str | Source, rubric: LoadedRubric, out: Path, options: GradeOptions, progress: Progress
) -> GradingResult:
    """Grade one submission into `out/<its id>/`: evidence and reports, which replace older ones together.

    Without `options.files`, `out` is only where it is worked, and nothing stays there.

    Raises GraderError where it cannot; the result then says why, with the status `error`.
    """
    clock = Clock()
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
    with told_apart(attempt), waited_for(), opened(source, rubric, options, progress) as submission:
        attempt.about = about(submission)
        kept = options.kept(attempt.about)
        if kept is not None:
            return kept
        with Results(out / submission.id) as results:
            recording = None
            if isinstance(submission, RecordedSubmission):
                runs, criteria = judged_recording(submission, rubric, results.evidence, progress)
            else:
                recording, runs, criteria = recorded_and_judged(
                    submission, rubric, results.evidence, options, progress
                )
            timing = clock.timing(recording)
            graded = outcome(attempt.about, rubric, runs, criteria, recording=recording, timing=timing)
            result = options.settled(graded)
            if not options.files:
                return result
            write_reports(
                result,
                results.new,
                console=console_log(runs),
                rubric=rubric.rubric,
                keep_hidden=options.keep_hidden,
                figures=figures_of(rubric, runs, result),
                docs=rubric.docs,
            )
            results.commit()
    return result


def record(
    source: str, rubric: LoadedRubric, out: Path, options: GradeOptions, progress: Progress
) -> list[Path]:
    """Record the rubric's scenarios into `out/<its id>/evidence/` and judge nothing."""
    finish_killed(out)
    with waited_for(), opened(source, rubric, options, progress) as submission:
        if isinstance(submission, RecordedSubmission):
            raise UsageError(
                f"{submission.source}: there is nothing to run in it", hint="grade it, or judge it"
            )
        facts = read_facts(submission, progress)
        with Results(out / submission.id) as results:
            with recorder(
                submission, facts, rubric, results.evidence, options=options, progress=progress
            ) as at_work:
                at_work.record_all(partial(loaded_meanwhile, rubric))
                keep_scenarios(rubric, submission, results.evidence, progress)
                names = [path.name for path in at_work.recording.files]
            results.commit()
    return [out / submission.id / EVIDENCE / name for name in names]
