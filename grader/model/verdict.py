"""What a check says of one criterion."""

from __future__ import annotations

from enum import Enum

from grader.model.record import Record


class Status(str, Enum):
    """The seven statuses of a criterion (docs/design.md, Statuses)."""

    PASS = "pass"  # noqa: S105 - a status, not a password
    PARTIAL = "partial"
    FAIL = "fail"
    BLOCKED = "blocked"
    INCONCLUSIVE = "inconclusive"
    ERROR = "error"
    MANUAL = "manual"

    @property
    def is_open(self) -> bool:
        """Whether the points are neither earned nor lost: a person or another grading decides."""
        return self is Status.MANUAL or self.is_retryable

    @property
    def is_retryable(self) -> bool:
        """Whether grading again may decide it: the machine or the grader kept it from being judged."""
        return self in {Status.INCONCLUSIVE, Status.ERROR}

    @property
    def is_lost(self) -> bool:
        """Whether points are lost, here or because another criterion was not reached."""
        return self in {Status.FAIL, Status.PARTIAL, Status.BLOCKED}


class FileCitation(Record):
    """A line of the student's own files; `file` is relative to the package's root, `line` counts from 1."""

    file: str
    """A file of the submission, from the package's root."""
    line: int | None = None
    """Counted from 1; null for the whole file."""


class EvidenceCitation(Record):
    """A stretch of an evidence file: `from_ns` to `to_ns` are its `log_time`s, both included."""

    evidence: str
    """An evidence file's name."""
    topic: str
    """A topic in it."""
    from_ns: int | None = None
    """`log_time` of the first message (ns); null for the whole."""
    to_ns: int | None = None
    """`log_time` of the last message (ns), included; null for the whole."""


Citation = FileCitation | EvidenceCitation


class Verdict(Record):
    """One check's judgement.

    `score` is the share of the points, 0 to 1. `unjudged` marks a verdict that rests on the absence of
    evidence: the judge turns it into `blocked` where a required criterion explains the absence.
    """

    status: Status
    score: float
    message: str
    expected: str = ""
    measured: str = ""
    hint: str = ""
    citations: tuple[FileCitation | EvidenceCitation, ...] = ()
    unjudged: bool = False


def passed(message: str, **fields: object) -> Verdict:
    return Verdict(status=Status.PASS, score=1.0, message=message, **fields)


def partial(score: float, message: str, **fields: object) -> Verdict:
    return Verdict(status=Status.PARTIAL, score=score, message=message, **fields)


def failed(message: str, **fields: object) -> Verdict:
    return Verdict(status=Status.FAIL, score=0.0, message=message, **fields)


def unjudged(message: str, **fields: object) -> Verdict:
    """There is nothing to judge: a fail of its own, or `blocked` where a required criterion explains it."""
    return Verdict(status=Status.FAIL, score=0.0, message=message, unjudged=True, **fields)


def inconclusive(message: str, **fields: object) -> Verdict:
    return Verdict(status=Status.INCONCLUSIVE, score=0.0, message=message, **fields)
