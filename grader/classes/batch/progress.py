"""What a batch tells people: how far it is while it runs, and afterwards what needs their attention."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from grader.classes.batch.folder import BatchFolder
from grader.classes.batch.job import Outcome
from grader.classes.gradebook import Row
from grader.classes.overrides import FILE as OVERRIDES
from grader.model.batch import MISSING, ROSTER
from grader.model.result import CriterionResult
from grader.model.verdict import Status
from grader.wording import first_few

LATELY = 40
"""The pace is that of so many of the last gradings."""
OPEN = {
    Status.INCONCLUSIVE: "could not be judged",
    Status.MANUAL: "waits for a person",
    Status.ERROR: "failed",
}
NAMES_SHOWN = 4
NEXT_STEPS = {
    "error": "{count} could not be graded; once that is fixed: --only failed",
    "inconclusive": "{count} inconclusive; to grade them again: --only inconclusive",
    "manual": "{count} with criteria that a person decides: their points go into {overrides}",
    "missing": "{count} not graded yet: the same command goes on with them",
}


@dataclass
class BatchProgress:
    """Counts of a batch. `total` are the submissions that were asked for, `points_sum` is over those with points."""

    clock: Callable[[], float] = time.monotonic
    total: int = 0
    graded: int = 0
    inconclusive: int = 0
    failed: int = 0
    kept: int = 0
    points_sum: float = 0.0
    running: dict[str, float] = field(default_factory=dict)
    _ends_s: list[float] = field(default_factory=list)
    _begun_s: float = 0.0
    _paced_s: float = 0.0

    def planned(self, total: int) -> None:
        """`total` submissions will be graded."""
        self.total = total
        self._begun_s = self.clock()

    def begun(self, name: str) -> None:
        """The submission of that id begins."""
        self.running[name] = self.clock()

    def ended(self, outcome: Outcome) -> None:
        """A submission has its outcome."""
        self.running.pop(outcome.id, None)
        self.graded += outcome.status == "graded"
        self.inconclusive += outcome.status == "inconclusive"
        self.failed += outcome.status == "error"
        self.kept += outcome.kept
        self.points_sum += outcome.points if outcome.status != "error" else 0.0
        if not outcome.kept:
            if not self._ends_s:
                self._paced_s = self.clock() - outcome.wall_s
            self._ends_s = [*self._ends_s[-LATELY:], self.clock()]

    @property
    def done(self) -> int:
        return self.graded + self.inconclusive + self.failed

    @property
    def waiting(self) -> int:
        return max(self.total - self.done - len(self.running), 0)

    @property
    def mean_points(self) -> float | None:
        """The mean points of those that have points; None as long as there are none."""
        judged = self.graded + self.inconclusive
        return self.points_sum / judged if judged else None

    @property
    def left_s(self) -> float | None:
        """The time that is left, at the pace of the last gradings; None before two of them have ended.

        What was complete before takes nearly no time, so it does not count towards the pace.
        """
        if len(self._ends_s) < 2:
            return None
        few = len(self._ends_s) <= LATELY
        begin_s, count = (self._paced_s, len(self._ends_s)) if few else (self._ends_s[0], LATELY)
        return (self.clock() - begin_s) / count * (self.total - self.done)


def list_attention(folder: BatchFolder) -> Iterator[str]:
    """Yield why each submission that is not graded is not, then how to go on with them."""
    found: Counter[str] = Counter()
    for row in folder.rows():
        state = _state(row)
        found[state] += 1
        if state == "error":
            error = row.result.error
            yield f"{_name(row)}: error: {error.message if error else _open(row)}"
        elif state == "inconclusive":
            yield f"{_name(row)}: inconclusive: {_open(row)}"
        for override in row.result.overrides:
            if override.changed:
                yield f"{row.entry.id}: {override.criterion}: a person decided, and the check says something else now"
    for state, words in NEXT_STEPS.items():
        if found[state]:
            yield words.format(count=found[state], overrides=folder.path / OVERRIDES)


def _name(row: Row) -> str:
    """Return the id, with the line of the roster unless the error names it already."""
    error = row.result.error
    told = error is not None and error.kind == ROSTER
    return row.entry.id if told or not row.entry.where else f"{row.entry.id} ({row.entry.where})"


def _state(row: Row) -> str:
    """Return the result's status, or `missing` if there is none yet, or `manual` if only people's criteria are open."""
    result = row.result
    if result.error is not None and result.error.kind == MISSING:
        return "missing"
    if result.status == "inconclusive" and {c.status for c in _waiting(row)} == {Status.MANUAL}:
        return "manual"
    return result.status


def _waiting(row: Row) -> tuple[CriterionResult, ...]:
    return tuple(c for c in row.result.criteria if c.status in OPEN and c.counts)


def _open(row: Row) -> str:
    names = [f"{c.id} ({OPEN[c.status]})" for c in _waiting(row)]
    return first_few(names, NAMES_SHOWN)
