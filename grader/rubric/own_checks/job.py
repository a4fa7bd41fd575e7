"""What goes to the process that runs an instructor's tests, and what comes back."""

from __future__ import annotations

from typing import Literal

from grader.model.record import Record

Outcome = Literal["passed", "failed", "skipped", "open"]


class TestOutcome(Record):
    """One test. `open`: a run that it asks for was not recorded. `message` is one line, empty where it passed."""

    __test__ = False

    name: str
    title: str
    outcome: Outcome
    message: str
    points: float


class SessionOutcome(Record):
    """`faults` are the instructor's: a file that cannot be read, a marker that is wrong."""

    tests: tuple[TestOutcome, ...]
    faults: tuple[str, ...]
