"""How a grading ended, in the words that a CI system's later steps compare."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from pathlib import Path

from grader.errors import ExitCode, GraderError
from grader.model.result import GradingResult
from grader.rubric.model import Rubric


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
