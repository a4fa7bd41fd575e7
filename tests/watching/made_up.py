"""Saves that a test tells of, a grading that only notes what it would run, and a display that only remembers."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

from grader.arena.asynchronous import Stop, Stopped
from grader.errors import ExitCode
from grader.model.result import CriterionResult, ErrorInfo, GradingResult
from grader.model.verdict import Status
from grader.rubric.model import Rubric
from grader.student.watching.kept import Kept
from grader.student.watching.loop import WAIT_S, Outcome, Watched, watch
from grader.student.watching.snapshot import take_picture
from tests.report.hostile import result
from tests.support.a_class import criterion

Step = Callable[[], object]


class MadeUpSaves:
    """Goes through `steps`, one whenever the loop waits for a save; then it is as if somebody pressed Ctrl-C.

    A step that returns a path, or several, has saved them; None stands for a while in which nothing happened.
    """

    def __init__(self, *steps: Step) -> None:
        self.steps = list(steps)
        self.pending: set[str] = set()
        self.stop: Stop | None = None
        self.followed: list[tuple[Path, ...]] = []

    def follow(self, places: Sequence[Path], without: Path | None) -> None:  # noqa: ARG002 - as others have it
        self.followed.append(tuple(places))

    def wait(self, timeout_s: float | None = None) -> frozenset[str]:
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
    """`ran` are the scenarios of each grading that came to its end, `begun` those of all. Of `during`, one is called
    while it runs, of `after` one when it has ended."""

    def __init__(self, rubric: Rubric, out: Path) -> None:
        self.rubric, self.out = rubric, out
        self.begun: list[set[str]] = []
        self.ran: list[set[str]] = []
        self.during: list[Step] = []
        self.after: list[Step] = []
        self.verdicts: dict[str, Status] = {}
        self.error: ErrorInfo | None = None

    def __call__(self, recorded: Mapping[str, Path], stop: Stop) -> Outcome:
        assert all(path.is_file() for path in recorded.values())
        names = set(self.rubric.scenarios) - set(recorded)
        self.begun.append(names)
        if self.during:
            self.during.pop(0)()
        if stop.asked:
            raise Stopped
        self.ran.append(names)
        if self.after:
            self.after.pop(0)()
        if self.error is not None:
            return Outcome(result=self._result(error=self.error), code=ExitCode.NOT_GRADED, evidence=None)
        self.out.mkdir(exist_ok=True)
        for name in names:
            (self.out / f"{name}.mcap").write_text(str(len(self.ran)))
        failed = any(status is not Status.PASS for status in self.verdicts.values())
        code = ExitCode.BELOW_PASS_MARK if failed else ExitCode.PASSED
        return Outcome(result=self._result(), code=code, evidence=self.out)

    def _result(self, **changes: object) -> GradingResult:
        criteria = tuple(self._criterion(name) for name in self.rubric.scenarios)
        return result(criteria=criteria, points=sum(c.points for c in criteria), notes=(), **changes)

    def _criterion(self, scenario: str) -> CriterionResult:
        status = self.verdicts.get(scenario, Status.PASS)
        return criterion(scenario, status, 5.0 if status is Status.PASS else 0.0, 5.0, scenario=scenario)


class Remembered:
    """What was shown, in words."""

    def __init__(self) -> None:
        self.words: list[str] = []
        self.ends: list[tuple[Outcome, frozenset[str], tuple[str, ...]]] = []

    def begin(self, saved: tuple[str, ...], running: tuple[str, ...] | None) -> None:
        what = "everything" if running is None else " ".join(running) or "nothing"
        self.words.append(f"{' '.join(saved)}: {what}" if saved else what)

    def again(self) -> None:
        self.words.append("again")

    def same(self, saved: tuple[str, ...]) -> None:
        self.words.append(f"{' '.join(saved)}: same")

    def end(self, outcome: Outcome, unchanged: frozenset[str], saved: tuple[str, ...]) -> None:
        self.words.append("end")
        self.ends.append((outcome, unchanged, saved))


class Course:
    """A loop over a real package with made-up saves and gradings."""

    def __init__(self, package: Path, rubric: Rubric, folder: Path, *steps: Step) -> None:
        (folder / "kept").mkdir()
        self.package, self.rubric = package, rubric
        self.saves = MadeUpSaves(*steps)
        self.grading = MadeUpGrading(rubric, folder / "evidence")
        self.shown = Remembered()
        self.kept = Kept(folder / "kept", rubric)
        self.look: Callable[[], object] = lambda: None
        self.runs = True

    def run(self) -> ExitCode:
        """Until all steps are gone, and Ctrl-C ends it."""
        watched = Watched(folder=self.package, look=self._picture, grade=self.grading, runs=self.runs)
        return watch(watched, self.saves, self.kept, self.shown)

    def _picture(self):
        self.look()
        return take_picture(str(self.package), self.rubric.package)
