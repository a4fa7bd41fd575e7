"""The loop of `grader check --watch`: look, run what is concerned, judge everything, show it, wait for a save."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from grader.arena.asynchronous import Stop, Stopped
from grader.errors import ExitCode, SubmissionError
from grader.model.result import GradingResult
from grader.student.watching.kept import Kept
from grader.student.watching.saves import Saves
from grader.student.watching.snapshot import Picture, differing, folders_in

GONE_S = 1.0
AGAIN_S = 0.4
WAIT_S = 5.0
LOOKS = 3


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """What one grading came to. `result` is what is shown, `whole` has hidden criteria too. `evidence` is the folder of
    what was recorded; None where nothing could be graded: then `result.error` says why."""

    result: GradingResult
    code: ExitCode
    evidence: Path | None
    whole: GradingResult | None = None


@dataclass(frozen=True, kw_only=True)
class Watched:
    """What is watched. `folder` is what the command line named, absolute; `without` holds our own results.

    `look` takes a picture of the package; `grade` grades it, with evidence of scenarios that are not run again, until
    the end or until it is asked to stop, and raises no SubmissionError. Without `runs`, only files are judged.
    """

    folder: Path
    look: Callable[[], Picture]
    grade: Callable[[Mapping[str, Path], Stop], Outcome]
    without: Path | None = None
    runs: bool = True


class Shown(Protocol):
    """Whoever shows the course of it."""

    def begin(self, saved: tuple[str, ...], running: tuple[str, ...] | None) -> None:
        """A run begins because of these files (none: the first), of these scenarios (None: everything)."""

    def again(self) -> None:
        """What ran was stopped: something was saved meanwhile."""

    def end(self, outcome: Outcome, unchanged: frozenset[str], saved: tuple[str, ...]) -> None:
        """It has ended. `unchanged` are the scenarios that were not run again."""

    def same(self, saved: tuple[str, ...]) -> None:
        """Something was saved, and the package is what it was."""


def watch(watched: Watched, saves: Saves, kept: Kept, shown: Shown) -> ExitCode:
    """Until Ctrl-C: then the exit code of the last result; KeyboardInterrupt where there is none yet.

    Raises SubmissionError where the package's folder is gone, and what `grade` raises.
    """
    loop = _Loop(watched, saves, kept, shown)
    try:
        while True:
            loop.turn()
    except KeyboardInterrupt:
        if loop.last is None:
            raise
        return loop.last.code


class _Loop:
    """`picture` is what `last` was graded of; it is None where the package could not be looked at."""

    def __init__(self, watched: Watched, saves: Saves, kept: Kept, shown: Shown) -> None:
        self._watched, self._saves, self._kept, self._shown = watched, saves, kept, shown
        self._home = watched.folder
        self.picture: Picture | None = None
        self.last: Outcome | None = None
        self.saved: dict[str, None] = {}

    def turn(self) -> None:
        """One result; then wait until something has changed."""
        while not self._graded():
            self._shown.again()
        self.saved = {}
        while not self._changed():
            pass

    def _graded(self) -> bool:
        """Whether a result came out that still holds."""
        picture = self._look()
        known = self._kept.fitting(picture) if self._watched.runs else {}
        running = self._kept.others(known) if self._watched.runs else ()
        saved = self._names(picture)
        self._shown.begin(saved, running if known or not self._watched.runs else None)
        stop = Stop()
        try:
            with self._saves.stopping(stop):
                outcome = self._watched.grade(known, stop)
        except Stopped:
            self._note(self._saves.wait(0))
            return False
        meanwhile = self._saves.wait(AGAIN_S if outcome.evidence is None else 0)
        if meanwhile and not self._is_still(picture):
            self._note(meanwhile)
            return False
        if outcome.evidence is not None:
            self._kept.keep(outcome.evidence, picture, known, outcome.whole or outcome.result)
        self.picture, self.last = picture, outcome
        self._shown.end(outcome, frozenset(known), saved)
        return True

    def _changed(self) -> bool:
        """Wait for a while; whether there is reason for a new run."""
        self._note(self._saves.wait(WAIT_S))
        picture = self._look()
        if picture is None:
            return self.picture is not None or bool(self.saved)
        if not picture.same_as(self.picture):
            return True
        if self.saved and not self._settled(picture):
            return True
        if self.saved:
            self._shown.same(self._relative(self.saved))
            self.saved = {}
        return False

    def _settled(self, picture: Picture) -> bool:
        """Whether all that can be known of this picture is known: what was inconclusive may be asked for once more."""
        return not self._watched.runs or not self._kept.others(self._kept.fitting(picture))

    def _look(self) -> Picture | None:
        """The package now; None where it cannot be read. What is being replaced just now is looked at again."""
        for _ in range(LOOKS):
            self._stay()
            try:
                picture = self._watched.look()
            except (SubmissionError, OSError):
                self._note(self._saves.wait(AGAIN_S))
                continue
            self._home = picture.folder
            self._saves.follow(picture.places, self._watched.without)
            return picture
        self._saves.follow(tuple(self._places()), self._watched.without)
        return None

    def _places(self) -> Iterator[Path]:
        yield from folders_in(self._home, self._watched.without)

    def _stay(self) -> None:
        """Raise SubmissionError where the folder is gone, and does not come back at once."""
        until_s = time.monotonic() + GONE_S
        while not self._home.is_dir():
            if time.monotonic() > until_s:
                raise SubmissionError(f"{self._home} was deleted or renamed while it was watched")
            self._saves.wait(GONE_S / 10)

    def _is_still(self, picture: Picture | None) -> bool:
        now = self._look()
        return now is not None and now.same_as(picture)

    def _note(self, saved: frozenset[str]) -> None:
        self.saved.update(dict.fromkeys(sorted(saved)))

    def _names(self, picture: Picture | None) -> tuple[str, ...]:
        """What has changed since the last result; else what was told of."""
        changed = differing(self.picture, picture) if picture and self.picture else ()
        return changed or self._relative(self.saved)

    def _relative(self, saved: frozenset[str] | dict[str, None]) -> tuple[str, ...]:
        paths = (Path(name) for name in saved)
        inside = (path.relative_to(self._home) if path.is_relative_to(self._home) else path for path in paths)
        return tuple(sorted(path.as_posix() for path in inside))
