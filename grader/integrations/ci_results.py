"""How a grading ended, in the words that a CI system's later steps compare."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from grader.errors import ExitCode, GraderError
from grader.model.result import GradingResult
from grader.rubric.model import Rubric
from grader.errors import PackageNotFound, SubmissionError
from grader.integrations.ci_settings import needed_words
from grader.report.text import number
from grader.report.view import arrange
import shutil
from contextlib import suppress
from grader.errors import OutputError
from grader.files import atomic_write, make_folder
from grader.report.code_quality import code_quality
from grader.report.junit import junit
from grader.report.sarif import sarif


class Outcome(str, Enum):
    """The output `status`, and the words of `fail-on`."""

    PASSED = "passed"
    BELOW = "below-pass-mark"
    INCONCLUSIVE = "inconclusive"
    NOT_GRADED = "not-graded"
    WRONG_INPUT = "wrong-input"


OF_CODE = {
    ExitCode.PASSED: Outcome.PASSED,
    ExitCode.BELOW_PASS_MARK: Outcome.BELOW,
    ExitCode.USAGE: Outcome.WRONG_INPUT,
    ExitCode.NOT_GRADED: Outcome.NOT_GRADED,
    ExitCode.INCONCLUSIVE: Outcome.INCONCLUSIVE,
}
TITLES = {
    Outcome.PASSED: "Passed",
    Outcome.BELOW: "Below the pass mark",
    Outcome.INCONCLUSIVE: "Not settled yet",
    Outcome.NOT_GRADED: "Not graded",
    Outcome.WRONG_INPUT: "Wrong input",
}


@dataclass(frozen=True, kw_only=True)
class Graded:
    """A result that there is, without its hidden criteria. `fails`: whether the job is to fail.

    `said` and `hint` are a line each about the outcome. `counted` is the result of what was asked for, which may be the
    files alone. `folder` has the result's files, `prefix` is the package's folder in the repository.
    """

    outcome: Outcome
    fails: bool
    said: str
    hint: str
    result: GradingResult
    counted: GradingResult
    rubric: Rubric
    folder: Path
    prefix: str


def of_error(error: GraderError) -> Outcome:
    """Where there is no result at all."""
    return OF_CODE[error.exit_code]


# [integrations.ci.status_lines] What a CI system says of a result, in a line, and what to do about it in another.

STUDENTS = {SubmissionError.kind, PackageNotFound.kind}
NO_MARK_LOST = "this is not the submission's fault, and no mark is lost"


def said_of(counted: GradingResult, rubric: Rubric, outcome: Outcome, *, static: bool) -> tuple[str, str]:
    """The line, and a hint where there is one. What is behind an outcome that is nobody's fault is named."""
    if outcome is Outcome.NOT_GRADED:
        return _not_graded(counted)
    files = " that the files alone decide (nothing was run)" if static else ""
    told = f"{number(counted.points)} of {number(counted.max_points)} points{files}"
    if outcome is not Outcome.INCONCLUSIVE:
        return f"{told}; {needed_words(rubric, counted.max_points)}", ""
    waiting = arrange(counted, rubric).open
    if not waiting:
        return f"{told}, and something could not be judged; no mark is lost", ""
    points = number(sum(loss.points for loss in waiting))
    first = waiting[0].criterion
    return f"{told}; {points} more are not settled, and no mark is lost: {first.message}", first.hint


def _not_graded(result: GradingResult) -> tuple[str, str]:
    if result.error is None:
        return (
            f"a check of the grader failed; {NO_MARK_LOST}",
            "report it; the submission can be graded again",
        )
    own = result.error.kind in STUDENTS
    return result.error.message if own else f"{result.error.message}; {NO_MARK_LOST}", result.error.hint


# [integrations.ci.files] The folder that a CI system keeps: every report, and the evidence of what is shown.

OURS = frozenset(
    {
        "code-quality.json", "console.log", "evidence", "grader.env", "junit.xml", "report.html", "report.md",
        "report.sarif", "result.json",
    }
)  # fmt: skip
SECTION = "== "


def clear(out: Path) -> None:
    """Make the folder, empty. What an earlier run left goes first, so that nobody takes it for this one's.

    Raises OutputError where there is anything else in it, or where it is a link.
    """
    try:
        names = {entry.name for entry in out.iterdir()} if out.is_dir() else set()
        if out.is_symlink() or (out.exists() and not out.is_dir()) or names - OURS:
            raise OutputError(f"{out} is in the way of the results", hint="remove it from the repository")
        for name in names:
            path = out / name
            shutil.rmtree(path) if path.is_dir() and not path.is_symlink() else path.unlink()
        make_folder(out)
    except OSError as error:
        raise OutputError(
            f"{out} cannot be written: {error.strerror}", hint="say where else it may go"
        ) from error


def keep(made: Path, out: Path, rubric: Rubric) -> None:
    """Move a submission's results to `out`, without what only hidden criteria look at. Raises OutputError."""
    unseen = _hidden_scenarios(rubric)
    try:
        for name in sorted(OURS):
            if (made / name).exists():
                shutil.move(made / name, out / name)
        for name in unseen:
            (out / "evidence" / f"{name}.mcap").unlink(missing_ok=True)
        with suppress(FileNotFoundError):
            console = (out / "console.log").read_text(encoding="utf-8")
            atomic_write(out / "console.log", _without(console, unseen).encode())
    except OSError as error:
        raise OutputError(f"{out} cannot be written: {error.strerror}", hint="make room there") from error


def add_forms(out: Path, result: GradingResult, prefix: str, docs: dict[str, dict[str, str]]) -> None:
    """The reports that know files by their place in the repository. Raises OutputError."""
    atomic_write(out / "junit.xml", junit(result, prefix))
    atomic_write(out / "code-quality.json", code_quality(result, prefix).encode())
    atomic_write(out / "report.sarif", sarif(result, prefix, docs=docs).encode("utf-8", "backslashreplace"))


def _hidden_scenarios(rubric: Rubric) -> frozenset[str]:
    used = {"visible": set[str](), "hidden": set[str]()}
    for criterion in rubric.criteria:
        if criterion.scenario is not None:
            used[criterion.visibility].add(criterion.scenario)
    return frozenset(used["hidden"] - used["visible"])


def _without(console: str, unseen: frozenset[str]) -> str:
    """A run's part begins with its name; all other lines begin with a time."""
    kept, shown = [], True
    for row in console.splitlines(keepends=True):
        if row.startswith(SECTION):
            shown = row.removeprefix(SECTION).strip() not in unseen
        if shown:
            kept.append(row)
    return "".join(kept)
