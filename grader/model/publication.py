"""What of a class was published, and what was sent to whom: the lines of `published.jsonl` and `sent.jsonl`.

The docstring of a field says what its key means: the reference and the JSON schemas are made of them.
"""

from __future__ import annotations

from typing import Literal

from pydantic import AwareDatetime, Field

from grader.model.record import Record

SentState = Literal["sending", "sent", "failed"]


class Publication(Record):
    """One result that was published, as it was then. The last line of a submission counts."""

    schema_: Literal["grader.published/1"] = Field(default="grader.published/1", alias="schema")
    """Which format this is, and its version."""
    id: str
    """The student's id."""
    at: AwareDatetime
    """When it was published."""
    by: str = ""
    """Who published it."""
    status: Literal["graded", "inconclusive", "error"]
    """The result's status."""
    points: float
    """The result's points."""
    max_points: float
    """The most points that can be reached."""
    digest: str
    """sha256 of the `result.json` that was published: `.published/<id>/<its first 16 digits>/` holds it."""
    changes: tuple[str, ...] = ()
    """What changed since the publication before, as the student reads it; empty for the first one."""


class Sent(Record):
    """One step of sending feedback to one student. The last line of a student, a form and a digest counts."""

    schema_: Literal["grader.sent/1"] = Field(default="grader.sent/1", alias="schema")
    """Which format this is, and its version."""
    id: str
    """The student's id."""
    form: str
    """How it was sent: the value of `--form`."""
    digest: str
    """The `digest` of the publication that was sent."""
    at: AwareDatetime
    """When."""
    state: SentState
    """`sending`: it was begun; if no line follows, nobody knows how it ended. `sent`; `failed`: it was not sent."""
    place: str = ""
    """Where it went: a file, an address, a commit, a comment."""
    message: str = ""
    """Why it failed."""
