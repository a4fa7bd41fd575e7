"""How far a batch is: what is done, running, waiting and failed, and how long the rest takes."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field

from grader.classes.batch.job import Outcome

LATELY = 40
"""So many of the last gradings say how fast it goes now."""


@dataclass
class Course:
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
        """So many submissions are to be done."""
        self.total = total
        self._begun_s = self.clock()

    def begun(self, name: str) -> None:
        """One more is being done."""
        self.running[name] = self.clock()

    def ended(self, outcome: Outcome) -> None:
        """One of those came to its end."""
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
        """Of those that have points; None as long as there is none."""
        judged = self.graded + self.inconclusive
        return self.points_sum / judged if judged else None

    @property
    def elapsed_s(self) -> float:
        return self.clock() - self._begun_s

    @property
    def left_s(self) -> float | None:
        """For what is left, at the pace of the last gradings; None before two of them have ended.

        What is found complete costs nearly nothing, so the pace is that of what was really graded.
        """
        if len(self._ends_s) < 2:
            return None
        few = len(self._ends_s) <= LATELY
        begin_s, count = (self._paced_s, len(self._ends_s)) if few else (self._ends_s[0], LATELY)
        return (self.clock() - begin_s) / count * (self.total - self.done)
