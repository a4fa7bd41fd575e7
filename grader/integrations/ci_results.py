"""How a grading in a CI job ended: its outcome, the line that says so, and the folder of reports that is kept.

`ci_systems` reads what a job is to grade, and tells GitHub and GitLab.
"""

from __future__ import annotations

import shutil
from contextlib import suppress
from dataclasses import dataclass
from enum import Enum
from pathlib import Path

from grader.errors import ExitCode, OutputError
from grader.files import atomic_write, make_folder
from grader.judging.summary import scaled_pass_mark
from grader.model.result import GradingResult
from grader.report.forms import FORMS, ReportInput
from grader.report.hidden_criteria import hidden_ids
from grader.report.losses import arrange
from grader.report.markdown import render_markdown
from grader.report.sentences import RUBRIC_FROM
from grader.report.view import is_students_fault
from grader.results import EVIDENCE, RESULT
from grader.rubric.model import Rubric
from grader.wording import number


class JobStatus(str, Enum):
    """The values of the output `status` and of the input `fail-on`, which later steps compare."""

    PASSED = "passed"
    BELOW = "below-pass-mark"
    INCONCLUSIVE = "inconclusive"
    NOT_GRADED = "not-graded"
    WRONG_INPUT = "wrong-input"


OF_CODE = {
    ExitCode.PASSED: JobStatus.PASSED,
    ExitCode.BELOW_PASS_MARK: JobStatus.BELOW,
    ExitCode.USAGE: JobStatus.WRONG_INPUT,
    ExitCode.NOT_GRADED: JobStatus.NOT_GRADED,
    ExitCode.INCONCLUSIVE: JobStatus.INCONCLUSIVE,
}
TITLES = {
    JobStatus.PASSED: "Passed",
    JobStatus.BELOW: "Below the pass mark",
    JobStatus.INCONCLUSIVE: "Not decided yet",
    JobStatus.NOT_GRADED: "Not graded",
    JobStatus.WRONG_INPUT: "Wrong input",
}
LET_IT_RUN = "without `static` (GRADER_STATIC: true), the job runs the nodes"
NO_MARK_LOST = "this is not the submission's fault, and this costs no marks"
WITH_LINES = ("junit", "code-quality", "sarif")
"""Forms that are rendered once more, or only here, with files as the repository has them."""
REPORT_NAMES = frozenset(
    {
        "console.log", EVIDENCE, "grader.env", RESULT, *(FORMS[name].file for name in WITH_LINES),
        *(form.file for form in FORMS.values() if form.in_results),
    }
)  # fmt: skip
SECTION = "== "


@dataclass(frozen=True, kw_only=True)
class JobResult:
    """A result without its hidden criteria. `fails` is whether the job fails.

    `message` and `hint` are a line each about the outcome. `counted` holds the criteria that were asked for, which may
    be only those of the files. `folder` has the reports, `prefix` is the package's folder in the repository.
    """

    outcome: JobStatus
    fails: bool
    message: str
    hint: str
    result: GradingResult
    counted: GradingResult
    rubric: Rubric
    folder: Path
    prefix: str

    @property
    def title(self) -> str:
        """The outcome in a few words; a rubric that the student can change is never a plain pass."""
        judged = self.outcome not in (JobStatus.NOT_GRADED, JobStatus.WRONG_INPUT)
        theirs = judged and self.result.rubric_origin == "submission"
        return TITLES[self.outcome] + (f", by a rubric {RUBRIC_FROM['submission']}" if theirs else "")


def describe_outcome(
    counted: GradingResult, rubric: Rubric, outcome: JobStatus, *, static: bool
) -> tuple[str, str]:
    """Return a line about the outcome, with its cause where that is not the student's, and a hint or ""."""
    if outcome is JobStatus.NOT_GRADED and static and counted.error is None and not counted.criteria:
        return "no criterion of this lab can be judged from the files alone, and nothing was run", LET_IT_RUN
    if outcome is JobStatus.NOT_GRADED:
        return _describe_error(counted)
    files = " that can be judged from the files alone (nothing was run)" if static else ""
    reached = f"{number(counted.points)} of {number(counted.max_points)} points{files}"
    if outcome is not JobStatus.INCONCLUSIVE:
        return f"{reached}; {points_to_pass(rubric, counted.max_points)}", ""
    waiting = arrange(counted, rubric).open
    if not waiting:
        return f"{reached}; something could not be judged, and this costs no marks", ""
    points = number(sum(loss.points for loss in waiting))
    first = waiting[0].criterion
    return (
        f"{reached}; {points} more are not decided yet, and this costs no marks: {first.message}",
        first.hint,
    )


def points_to_pass(rubric: Rubric, points: float) -> str:
    """Return what it takes to pass, out of the `points` that are counted."""
    needed = scaled_pass_mark(rubric, points)
    if needed is None:
        return "to pass, every visible criterion has to be met"
    return f"to pass, you need {number(needed)}"


def summarize(graded: JobResult) -> str:
    """Return the report as Markdown, of what was asked for alone: with one verdict, that of the job."""
    if graded.counted is graded.result:
        report = graded.folder / "report.md"
        return report.read_text(encoding="utf-8") if report.is_file() else ""
    mark = scaled_pass_mark(graded.rubric, graded.counted.max_points)
    rubric = graded.rubric.model_copy(update={"pass_mark": mark})
    return render_markdown(graded.counted, rubric, hidden=len(hidden_ids(rubric)))


def _describe_error(result: GradingResult) -> tuple[str, str]:
    if result.error is None:
        return (
            f"a check of the grader failed; {NO_MARK_LOST}",
            "report it; the submission can be graded again",
        )
    own = is_students_fault(result)
    return result.error.message if own else f"{result.error.message}; {NO_MARK_LOST}", result.error.hint


def clear(out: Path) -> None:
    """Make the folder and empty it, so that reports of an earlier run are not taken for this one's.

    Raises OutputError if it is a link or holds anything that is not the grader's.
    """
    try:
        names = {entry.name for entry in out.iterdir()} if out.is_dir() else set()
        if out.is_symlink() or (out.exists() and not out.is_dir()) or names - REPORT_NAMES:
            # the folder is in a checkout, into which the student may have put anything
            raise OutputError(f"{out} is in the way of the results", hint="remove it from the repository")
        for name in names:
            path = out / name
            # a link is removed itself, never what it leads to
            shutil.rmtree(path) if path.is_dir() and not path.is_symlink() else path.unlink()
        make_folder(out)
    except OSError as error:
        raise OutputError(
            f"{out} cannot be written: {error.strerror}", hint="choose another folder"
        ) from error


def keep(made: Path, out: Path, rubric: Rubric) -> None:
    """Move a submission's reports to `out`, without the runs that only hidden criteria use. Raises OutputError."""
    unseen = _hidden_scenarios(rubric)
    try:
        for name in sorted(REPORT_NAMES):
            if (made / name).exists():
                shutil.move(made / name, out / name)
        for name in unseen:
            (out / "evidence" / f"{name}.mcap").unlink(missing_ok=True)
        with suppress(FileNotFoundError):
            console = (out / "console.log").read_text(encoding="utf-8")
            atomic_write(out / "console.log", _without(console, unseen).encode())
    except OSError as error:
        raise OutputError(
            f"{out} cannot be written: {error.strerror}", hint="free some space there"
        ) from error


def add_forms(
    out: Path, result: GradingResult, rubric: Rubric, prefix: str, docs: dict[str, dict[str, str]]
) -> None:
    """Write the reports that name files by their path in the repository. Raises OutputError."""
    shown = ReportInput(result=result, rubric=rubric, prefix=prefix, docs=docs)
    for name in WITH_LINES:
        atomic_write(out / FORMS[name].file, FORMS[name].render(shown))


def _hidden_scenarios(rubric: Rubric) -> frozenset[str]:
    used = {"visible": set[str](), "hidden": set[str]()}
    for criterion in rubric.criteria:
        if criterion.scenario is not None:
            used[criterion.visibility].add(criterion.scenario)
    return frozenset(used["hidden"] - used["visible"])


def _without(console: str, unseen: frozenset[str]) -> str:
    """Return the console log without the sections of the runs `unseen`."""
    kept, shown = [], True
    for row in console.splitlines(keepends=True):
        # nothing that a node prints begins so: every other line begins with a time
        if row.startswith(SECTION):
            shown = row.removeprefix(SECTION).strip() not in unseen
        if shown:
            kept.append(row)
    return "".join(kept)
