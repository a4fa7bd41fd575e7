"""Saves that a test makes up, a grading that only counts, and a screen that only remembers."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from grader.arena.interruption import Stop, Stopped
from grader.errors import ExitCode
from grader.model.result import CriterionResult, ErrorInfo, GradingResult
from grader.model.verdict import Status
from grader.rubric.model import Rubric
from grader.student.watching import WAIT_S, Saves, Screen, Watch, WatchedResult, take_snapshot
from tests.report.hostile import criterion, result

Step = Callable[[], object]


class MadeUpSaves(Saves):
    """Goes through `steps`, one whenever the loop waits for a save; then it is as if somebody pressed Ctrl-C.

    A step that returns a path, or several, has saved them; None stands for a while in which nothing happened.
    """

    def __init__(self, *steps: Step) -> None:
        super().__init__()
        self.steps = list(steps)
        self.pending: set[str] = set()
        self.stop: Stop | None = None

    def wait(self, timeout_s: float) -> frozenset[str]:
        if timeout_s == WAIT_S:
            if not self.steps:
                raise KeyboardInterrupt
            self.save(self.steps.pop(0)())
        found, self.pending = frozenset(self.pending), set()
        return found

    @contextmanager
    def stopping(self, stop: Stop) -> Iterator[None]:
        self.stop = stop
        if self.pending:
            stop.ask()
        yield
        self.stop = None

    def save(self, saved: object) -> None:
        """As if the system had told of it."""
        paths = saved if isinstance(saved, list | tuple) else [saved]
        self.pending |= {str(path) for path in paths if path is not None}
        if self.pending and self.stop is not None:
            self.stop.ask()


class MadeUpGrading:
    """`begun` counts the gradings, `ended` those that came to their end. Of `during`, one is called while it runs, of
    `after` one when it has ended."""

    def __init__(self, rubric: Rubric) -> None:
        self.rubric = rubric
        self.begun = self.ended = 0
        self.during: list[Step] = []
        self.after: list[Step] = []
        self.verdicts: dict[str, Status] = {}
        self.error: ErrorInfo | None = None

    def __call__(self, stop: Stop) -> WatchedResult:
        self.begun += 1
        if self.during:
            self.during.pop(0)()
        if stop.asked:
            raise Stopped
        self.ended += 1
        if self.after:
            self.after.pop(0)()
        if self.error is not None:
            return WatchedResult(
                result=self._result(error=self.error), code=ExitCode.NOT_GRADED, undecided=True
            )
        statuses = set(self.verdicts.values())
        code = ExitCode.BELOW_PASS_MARK if statuses - {Status.PASS} else ExitCode.PASSED
        return WatchedResult(
            result=self._result(), code=code, undecided=any(status.is_retryable for status in statuses)
        )

    def _result(self, **changes: object) -> GradingResult:
        criteria = tuple(self._criterion(name) for name in self.rubric.scenarios)
        return result(criteria=criteria, points=sum(c.points for c in criteria), notes=(), **changes)

    def _criterion(self, scenario: str) -> CriterionResult:
        status = self.verdicts.get(scenario, Status.PASS)
        return criterion(scenario, status, 5.0 if status is Status.PASS else 0.0, 5.0, scenario=scenario)


class Remembered(Screen):
    """What was shown, in words."""

    def __init__(self) -> None:
        self.words: list[str] = []
        self.ends: list[WatchedResult] = []

    def begin(self, saved: tuple[str, ...]) -> None:
        self.words.append(" ".join(("begin", *saved)))

    def restart(self) -> None:
        self.words.append("restart")

    def unchanged(self, saved: tuple[str, ...]) -> None:
        self.words.append(" ".join(("unchanged", *saved)))

    def end(self, outcome: WatchedResult, saved: tuple[str, ...]) -> None:
        self.words.append(" ".join(("end", *saved)))
        self.ends.append(outcome)


class Course:
    """A loop over a real package with made-up saves and gradings."""

    def __init__(self, package: Path, rubric: Rubric, *steps: Step) -> None:
        self.package, self.rubric = package, rubric
        self.saves = MadeUpSaves(*steps)
        self.grading = MadeUpGrading(rubric)
        self.screen = Remembered()
        self.look: Callable[[], object] = lambda: None

    def run(self) -> ExitCode:
        """Until all steps are gone, and Ctrl-C ends it."""
        return Watch(
            self.package, look=self._snapshot, grade=self.grading, saves=self.saves, screen=self.screen
        ).run()

    def _snapshot(self):
        self.look()
        return take_snapshot(str(self.package), self.rubric.package)
