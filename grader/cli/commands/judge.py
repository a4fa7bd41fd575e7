"""`grader judge EVIDENCE… --rubric ID|FILE`: the same criteria as when it was graded, without ROS."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from grader.classes.batch.judging import Judged, judge_all, submissions_in
from grader.cli.errors import report
from grader.cli.outcome import exit_code
from grader.cli.output import say_document
from grader.errors import EvidenceError, ExitCode
from grader.evidence.reader import load_evidence
from grader.files import atomic_write
from grader.judging import judge
from grader.judging.summary import criteria_text, judged_text
from grader.model.result import CriterionResult
from grader.portable import cores
from grader.rubric.load import LoadedRubric, load_rubric

WORST_FIRST = (ExitCode.NOT_GRADED, ExitCode.BELOW_PASS_MARK, ExitCode.INCONCLUSIVE)


def run(*, evidence: list[Path], rubric: str, out: str = "-", jobs: int | None = None) -> ExitCode:
    """Judge and write the criteria as JSON to the file `out`, or to stdout: one submission's, or a list of several."""
    loaded = load_rubric(rubric)
    several = submissions_in(evidence)
    if several:
        return _several(several, loaded, out, jobs or cores())
    criteria = judge(loaded.rubric, load_evidence(evidence), loaded.checks)
    _write(out, lambda ascii_only: criteria_text(criteria, ascii_only=ascii_only))
    return exit_code(criteria, loaded.rubric)


def _several(folders: tuple[Path, ...], loaded: LoadedRubric, out: str, jobs: int) -> ExitCode:
    """What could not be judged is told, and costs the others nothing. The exit code is that of the worst."""
    order = {folder: number for number, folder in enumerate(folders)}
    judged = sorted(judge_all(folders, loaded, jobs), key=lambda one: order[one.folder])
    _write(out, lambda ascii_only: judged_text(loaded.rubric, map(_named, judged), ascii_only=ascii_only))
    for one in judged:
        if one.criteria is None:
            report(EvidenceError(one.error, hint=one.hint))
    codes = {
        ExitCode.NOT_GRADED if c is None else exit_code(c, loaded.rubric)
        for c in (j.criteria for j in judged)
    }
    return next((code for code in WORST_FIRST if code in codes), ExitCode.PASSED)


def _named(one: Judged) -> tuple[str, tuple[CriterionResult, ...] | str]:
    return one.folder.name, one.error if one.criteria is None else one.criteria


def _write(out: str, text: Callable[[bool], str]) -> None:
    if out == "-":
        say_document(text)
    else:
        atomic_write(Path(out), text(False).encode())
