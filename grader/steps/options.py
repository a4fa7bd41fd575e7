"""What a grading may be asked for."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from grader.model.result import GradingResult, SubmissionInfo

if TYPE_CHECKING:
    from grader.arena.asynchronous import Stop
    from grader.model.submission import SandboxMode


@dataclass(frozen=True, kw_only=True)
class GradeOptions:
    """`static_only` judges files alone; without `keep_hidden`, the reports leave hidden criteria out.

    Without `files`, the result alone is wanted, and neither reports nor evidence. With `tidy`, what killed graders left
    beside the submission's folder is put in order first; a batch does that once.
    `kept` is asked when the submission is open: a result that it gives stays, and nothing is done. `settled` makes of
    the automatic result the one that counts. `recorded` is evidence by scenario that still holds: these are not run
    again. `stop` ends what runs, in order, from another thread; then `arena.asynchronous.Stopped` is raised.
    """

    sandbox: SandboxMode = "auto"
    submission_id: str | None = None
    static_only: bool = False
    keep_hidden: bool = True
    tidy: bool = True
    files: bool = True
    kept: Callable[[SubmissionInfo], GradingResult | None] = lambda _: None
    settled: Callable[[GradingResult], GradingResult] = lambda result: result
    recorded: Mapping[str, Path] = field(default_factory=dict)
    stop: Stop | None = None
