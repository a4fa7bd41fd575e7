"""Package facts and the arena: what a submission does, recorded as evidence."""

from __future__ import annotations

from functools import partial
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from grader.evidence.run import Run
from grader.judging.early import judge_files
from grader.model.package import PackageFacts
from grader.model.progress import Progress
from grader.model.result import CriterionResult, EarlyVerdict
from grader.model.submission import RecordedSubmission, Submission
from grader.model.verdict import Status
from grader.package import read_package
from grader.report.view import hidden_ids
from grader.rubric.load import LoadedRubric
from grader.rubric.needs import needs_ros, started
from grader.rubric.rates import rates_of
from grader.steps.judged import judged_again
from grader.steps.options import GradeOptions

if TYPE_CHECKING:
    from grader.arena.recorded import Recording
    from grader.arena.recording import Recorder
    from grader.arena.static_recorder import Unrun

ROS_TYPES = "rosbags.typesys.stores.ros1_noetic"
LATER = ("grader.evidence.decode", "grader.evidence.reader")
"""Slow to load, and needed by no verdict that the files alone decide. The arena is loaded when it is begun."""


def read_facts(submission: Submission, progress: Progress) -> PackageFacts:
    """What the files say; nothing of them is executed."""
    progress.step("package", "running", "reading its files")
    facts = read_package(submission.package, hints=submission.hints)
    progress.step("package", "done")
    return facts


def recorder(
    submission: Submission,
    facts: PackageFacts,
    rubric: LoadedRubric,
    evidence: Path,
    *,
    options: GradeOptions,
    progress: Progress,
) -> Recorder | Unrun:
    """What records the rubric's scenarios into the folder `evidence`; use it as a context."""
    from grader.arena.recorded import STATIC_ONLY  # noqa: PLC0415 - see LATER
    from grader.arena.static_recorder import Unrun, why_unrun  # noqa: PLC0415

    reason = STATIC_ONLY if options.static_only or not needs_ros(rubric) else why_unrun()
    if reason:
        return Unrun(
            submission,
            facts,
            started(rubric.rubric),
            evidence,
            reason=reason,
            progress=progress,
            recorded=options.recorded,
        )
    from grader.arena.recording import Recorder  # noqa: PLC0415 - see LATER

    return Recorder(
        submission,
        facts,
        started(rubric.rubric),
        evidence,
        rates=rates_of(rubric.rubric),
        mode=options.sandbox,
        static_only=False,
        progress=progress,
        recorded=options.recorded,
        stop=options.stop,
    )


def recorded_and_judged(
    submission: Submission, rubric: LoadedRubric, evidence: Path, options: GradeOptions, progress: Progress
) -> tuple[Recording, dict[str, Run], tuple[CriterionResult, ...]]:
    """What the evidence cannot say because the machine was late is recorded again, alone, at most twice."""
    facts = read_facts(submission, progress)
    progress.early(lambda: _early(facts, rubric, options))
    from grader.arena.recorded import RETRIES  # noqa: PLC0415 - see LATER

    with recorder(submission, facts, rubric, evidence, options=options, progress=progress) as at_work:
        at_work.record_all(partial(loaded_meanwhile, rubric))
        keep_scenarios(rubric, submission, evidence, progress)
        runs, criteria = judged_again(evidence, rubric)
        for _ in range(RETRIES):
            again = _inconclusive_scenarios(criteria, at_work.recording)
            if not again:
                break
            at_work.record_again(again)
            runs, criteria = judged_again(evidence, rubric)
    return at_work.recording, runs, criteria


def keep_scenarios(
    rubric: LoadedRubric, submission: Submission | RecordedSubmission, evidence: Path, progress: Progress
) -> None:
    """Scenarios that name a recording in the submission have that one as evidence."""
    from grader import recordings  # noqa: PLC0415 - see LATER

    recordings.keep_scenarios(rubric.rubric, submission, evidence, progress)


def loaded_meanwhile(rubric: LoadedRubric) -> None:
    """Load modules before they are needed. Only probes need ROS's own message types, hundreds of them."""
    probes = any(scenario.probes for scenario in rubric.rubric.scenarios.values())
    for name in (*LATER, *([ROS_TYPES] if probes else [])):
        import_module(name)


def _early(facts: PackageFacts, rubric: LoadedRubric, options: GradeOptions) -> tuple[EarlyVerdict, ...]:
    hidden = frozenset[str]() if options.keep_hidden else hidden_ids(rubric.rubric)
    found = judge_files(rubric.rubric, facts, rubric.checks)
    return tuple(verdict for verdict in found if verdict.criterion.id not in hidden)


def _inconclusive_scenarios(criteria: tuple[CriterionResult, ...], recording: Recording) -> list[str]:
    recorded = {path.stem for path in recording.files}
    doubtful = {c.scenario for c in criteria if c.status is Status.INCONCLUSIVE and c.scenario is not None}
    return sorted(doubtful & recorded)
