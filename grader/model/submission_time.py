"""When a submission was handed in, what a late one costs, and what a person decided instead of a check."""

from __future__ import annotations

from datetime import date, datetime
from typing import Annotated, Literal

from pydantic import AwareDatetime, Field

from grader.model.record import Record
from grader.model.verdict import Status

Day = date | datetime
COMMENT_CHARS = 2000
AUTHOR_CHARS = 200
SaidBy = Literal["roster", "commit", "nobody"]
"""Who says when it was handed in: the roster's `submitted_at`, the commit's date, or nobody."""


class HandedIn(Record):
    """When a submission was handed in, and until when it could be. All times have a time zone.

    `at` is None where nobody says it. `deadline` holds the extension already; `before` is the time before which the
    commit that counts was looked for, None where the last one counts. `note` says how that commit was chosen.
    """

    at: AwareDatetime | None = None
    by: SaidBy = "nobody"
    deadline: AwareDatetime | None = None
    extension_days: float = 0.0
    before: AwareDatetime | None = None
    note: str = ""


class Lateness(HandedIn):
    """The same in a result: `late_s` after the deadline (0 for in time), and what that cost.

    `points_before` are those that were reached; the result's `points` are those that are left. `text` says why.
    """

    late_s: float = 0.0
    points_before: float
    points: float
    text: str


class Override(Record):
    """A person's points for one criterion of one submission (`overrides.yaml`)."""

    points: Annotated[float, Field(ge=0)]
    comment: Annotated[str, Field(max_length=COMMENT_CHARS)] = ""
    author: Annotated[str, Field(max_length=AUTHOR_CHARS)] = ""
    date: Day | None = None


class Automatic(Record):
    """What the check had said."""

    status: Status
    points: float
    message: str


class AppliedOverride(Override):
    """The same in a result. `automatic` is what the check says now, `was` what it said when the override was first
    applied; `changed` marks that these differ: the person did not know what the check says now."""

    criterion: str
    automatic: Automatic
    was: Automatic
    changed: bool = False
