"""Judge evidence again: that of one submission, or of many at a time. It needs no ROS."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from grader.classes.batch.renew_results import judge_all
from grader.cli.display import exit_code, worst
from grader.cli.output import report, write_document
from grader.errors import EvidenceError, ExitCode
from grader.evidence.reader import load_evidence
from grader.judging import judge
from grader.judging.summary import criteria_text, judged_text
from grader.rubric.load import LoadedRubric


def judge_evidence(evidence: Sequence[Path], loaded: LoadedRubric, out: str) -> ExitCode:
    """Judge one submission and write its criteria as JSON to the file `out`, or to stdout for `-`."""
    criteria = judge(loaded.rubric, load_evidence(evidence), loaded.checks, loaded.handed_out)
    write_document(out, lambda ascii_only: criteria_text(criteria, ascii_only=ascii_only))
    return exit_code(criteria, loaded.rubric)


def judge_submissions(folders: Sequence[Path], loaded: LoadedRubric, out: str, jobs: int) -> ExitCode:
    """Judge several submissions and write a list of them. One that cannot be judged is reported and does not affect the
    others. Return the exit code of the worst."""
    order = {folder: index for index, folder in enumerate(folders)}
    # workers end in any order
    judged = sorted(judge_all(folders, loaded, jobs), key=lambda one: order[one.folder])
    found = [(one.folder.name, one.error if one.criteria is None else one.criteria) for one in judged]
    write_document(out, lambda ascii_only: judged_text(loaded.rubric, found, ascii_only=ascii_only))
    for one in judged:
        if one.criteria is None:
            report(EvidenceError(one.error, hint=one.hint))
    return worst(
        ExitCode.NOT_GRADED if c is None else exit_code(c, loaded.rubric)
        for c in (j.criteria for j in judged)
    )
