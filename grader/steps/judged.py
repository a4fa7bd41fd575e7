"""From evidence files to criteria, and to what the reports draw of them."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import TypeAlias

from grader.errors import EvidenceError, SubmissionError
from grader.evidence.run import Run
from grader.judging import judge
from grader.model.figure import Figures
from grader.model.progress import Progress
from grader.model.result import CriterionResult, GradingResult
from grader.model.submission import RecordedSubmission
from grader.rubric.load import LoadedRubric

Judged: TypeAlias = tuple[dict[str, Run], tuple[CriterionResult, ...]]
"""The runs by scenario, and the criteria that they were judged by, in the rubric's order."""


def judged_again(evidence: Path, rubric: LoadedRubric) -> Judged:
    """What is in the folder, read and judged. Raises EvidenceError."""
    from grader.evidence.reader import load_evidence  # noqa: PLC0415 - see recorded.LATER

    runs = load_evidence([evidence])
    return runs, judge(rubric.rubric, runs, rubric.checks)


def judged_recording(
    submission: RecordedSubmission, rubric: LoadedRubric, evidence: Path, progress: Progress
) -> Judged:
    """A recording that was handed in, kept and judged. It is the submission's fault if it cannot be read."""
    from grader.recordings import keep_recording, keep_scenarios  # noqa: PLC0415 - see recorded.LATER

    if submission.file is None:
        keep_scenarios(rubric.rubric, submission, evidence, progress)
        return judged_again(evidence, rubric)
    try:
        keep_recording(submission.file, evidence)
    except EvidenceError as error:
        raise SubmissionError(error.message, hint=error.hint) from error
    return judged_again(evidence, rubric)


def figures_of(rubric: LoadedRubric, runs: dict[str, Run], result: GradingResult) -> Figures | None:
    """What the reports show beside the verdicts. A result without pictures is better than none."""
    with suppress(Exception):
        from grader.report import figures  # noqa: PLC0415 - see recorded.LATER

        return figures.figures_of(rubric.rubric, runs, result.criteria)
    return None
