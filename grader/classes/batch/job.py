"""What a batch hands to whoever grades one submission, and what comes back."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime
from pathlib import Path
from typing import Literal

from pydantic import Field

from grader.model.batch import Entry
from grader.model.record import Record
from grader.model.result import GradingResult, HandedIn, Override
from grader.model.submission import SandboxMode
from grader.rubric.load import LoadedRubric

OutcomeStatus = Literal["graded", "inconclusive", "error"]


class Job(Record):
    """One submission's grading into `out/<id>/`. It can be sent to another process, and to another machine.

    `before` is the time before which the commit that counts is looked for (`--before`), `overrides` map criteria to
    what a person decided. `earlier` is the result of an earlier batch: where it is complete for the same commit, rubric
    and grader, nothing is done, unless `again`. `commit` is the one to grade of a repository, whatever else is said.
    What was fetched after `fetched_since` (seconds since 1970) is not fetched again.
    """

    entry: Entry
    rubric: LoadedRubric
    out: Path
    sandbox: SandboxMode = "auto"
    static_only: bool = False
    before: datetime | None = None
    overrides: Mapping[str, Override] = Field(default_factory=dict)
    earlier: GradingResult | None = None
    again: bool = False
    commit: str | None = None
    fetched_since: float = 0.0


class Outcome(Record):
    """What became of a job, in short: the rest is in its folder.

    `kept`: the earlier result stays. `handed_in` is what was found out about the submission's time, None where it could
    not be had. `message` and `hint` say in one line each why there is no result, or why the earlier one stays.
    """

    id: str
    status: OutcomeStatus
    points: float = 0.0
    max_points: float = 0.0
    passed: bool = False
    kept: bool = False
    handed_in: HandedIn | None = None
    kind: str = ""
    message: str = ""
    hint: str = ""
    wall_s: float = 0.0
