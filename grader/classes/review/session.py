"""Where decisions are saved: each goes into `overrides.yaml` at once, and results and gradebook follow.

Two people may decide about the same criterion: each decision names the one it was made from, so that none is lost.
"""

from __future__ import annotations

import fcntl
import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from hashlib import sha256
from pathlib import Path

from grader.classes.batch.folder import BatchFolder, open_batch, write_run
from grader.classes.batch.reports import Settler, rewrite
from grader.classes.batch.run import GRADEBOOK, alone, ids_of, write_books
from grader.classes.overrides import FILE, Overrides, read_overrides
from grader.classes.overrides.write import write_override
from grader.classes.review.background import BackgroundWriter, Pace
from grader.classes.review.submissions import Item, Stamp, Submissions, stamp_of
from grader.errors import Busy, GraderError, UsageError
from grader.files import unwritable
from grader.model.batch import State
from grader.model.result import GradingResult, Override
from grader.results import RESULT, read_result
from grader.rubric.load import LoadedRubric, load_rubric

PATIENCE_S = 0.3
OTHER_RUBRIC = "the class has been graded by another rubric since: end this review and start it again"

OLDER_RESULT = (
    "the submission was judged by another rubric: it counts when `grader regrade` has judged it again"
)


def open_session(path: Path, pace: Pace | None = None) -> ReviewSession:
    """The review of the class in `path`. Raises UsageError where there is none, and where its rubric has changed,
    EvidenceError where a newer grader wrote results in it."""
    batch = open_batch(path)
    batch.refuse_newer()
    run = batch.run
    rubric = load_rubric(run.rubric_source)
    if rubric.digest != run.rubric.digest:
        raise UsageError(
            f"{run.rubric_source}: the rubric has changed since the class was graded",
            hint=f"grader regrade {path} judges it by the rubric of today; then review it",
        )
    return ReviewSession(path, rubric, pace or Pace())


class ReviewSession:
    """Safe to use from several threads, and beside other sessions and batches of the same class."""

    def __init__(self, path: Path, rubric: LoadedRubric, pace: Pace) -> None:
        self.path, self.rubric = path, rubric
        self._docs = rubric.docs
        self.submissions = Submissions(path)
        self.background = BackgroundWriter(self._follow, pace)
        self._saving, self._writing, self._guard = threading.Lock(), threading.Lock(), threading.Lock()
        self._overrides: tuple[tuple[Stamp, tuple[str, ...]], Overrides] | None = None
        self._pending: set[str] = set()
        self._caught_up = False
        self._books_behind = False

    def start(self) -> None:
        """Begin to follow; what was decided while no one reviewed is looked at first."""
        self.background.start()
        self.background.changed()

    def close(self) -> bool:
        """Write what is left; whether all is written."""
        return self.background.close()

    def overrides(self) -> Overrides:
        """What `overrides.yaml` says now. Raises RubricError where it has faults."""
        ids = tuple(ids_of(self.submissions.batch().run))
        stamp = (stamp_of(self.path / FILE), ids)
        with self._guard:
            found = self._overrides
        if found is None or found[0] != stamp:
            found = (stamp, read_overrides(self.path / FILE, self.rubric.rubric, ids))
            with self._guard:
                self._overrides = found
        return found[1]

    def save(self, item: Item, criterion: str, override: Override | None, seen: str) -> str:
        """Put a decision in place of the one that was `seen` (its `mark`), or take that out (None).

        Gives in a line why the submission's files do not say so yet; empty where they do.

        Raises Conflict where another one stands there by now, and what `write_override` raises; then nothing changed.
        """
        name = item.entry.id
        with self._saving, reviewing(self.path):
            now = self.overrides().get(name, {}).get(criterion)
            if not alike(now, override):
                if mark(now) != seen:
                    raise Conflict(now)
                write_override(self.path / FILE, name, criterion, override)
        with self._guard:
            self._pending.add(item.key)
            self._books_behind = True
        waits = self._settled_soon(item)
        self.background.changed()
        return waits

    def result(self, item: Item, overrides: Overrides) -> GradingResult | None:
        """Return a submission's result as it counts with these overrides; None where it has none."""
        result = read_result(self.path / item.key) if item.gradable else None
        if (
            result is None
            or result.rubric.digest != self.rubric.digest
            or not self._behind(item, result, overrides)
        ):
            return result
        return Settler(self.rubric.rubric, overrides).settle_again(result, item.entry.id, None)

    def waits(self, item: Item) -> str:
        """Why the files of a submission do not say yet what was decided; empty where they do."""
        with self._guard:
            pending = item.key in self._pending
        return self.background.trouble or "its report follows in a moment" if pending else ""

    def batch_runs(self) -> bool:
        """Return whether a batch works in the folder just now."""
        if self.submissions.batch().run.state != "running" or self._writing.locked():
            return False
        try:
            with alone(self.path):
                return False
        except Busy:
            return True

    def _settled_soon(self, item: Item) -> str:
        """Settle one submission now, or say why that comes later."""
        if not item.gradable:
            return "it counts as soon as the submission has a result"
        if not self._writing.acquire(timeout=PATIENCE_S):
            return "the report follows in a moment"
        try:
            with alone(self.path):
                return self._settle({item.key})
        except Busy:
            return "a batch is running in this folder: the report follows when it has ended"
        except GraderError as error:
            return error.message
        finally:
            self._writing.release()

    def _settle(self, keys: set[str]) -> str:
        """Let the files of these submissions say what was decided, or say why the last one's cannot. The caller holds
        the class's lock."""
        with self._guard:
            self._pending -= keys  # first: who decides from here on puts it back
        why = ""
        try:
            overrides = self.overrides()
            for item in filter(None, map(self.submissions.item, sorted(keys))):
                why = self._settle_one(item, overrides)
        except BaseException:
            with self._guard:
                self._pending |= keys
            raise
        return why

    def _settle_one(self, item: Item, overrides: Overrides) -> str:
        batch = self.submissions.batch()
        if batch.run.rubric.digest != self.rubric.digest:
            raise UsageError(OTHER_RUBRIC)
        result = batch.earlier(item.entry) if item.gradable else None
        if result is None:
            return ""
        if result.rubric.digest != self.rubric.digest:
            return OLDER_RESULT
        now = Settler(self.rubric.rubric, overrides).settle_again(result, item.entry.id, None)
        if now != result:
            rewrite(batch.folder_of(item.entry), now, self.rubric.rubric, self._docs)
        return ""

    def _follow(self) -> None:
        """Settle what is not settled yet, and write the class's files."""
        if not self._caught_up:
            self._catch_up()
        if not self._books_behind:
            return
        with self._writing, alone(self.path):
            with self._guard:
                keys = set(self._pending)
                self._books_behind = False
            try:
                self._settle(keys)
                self._write_books(self.submissions.batch())
            except BaseException:
                self._books_behind = True
                raise

    def _write_books(self, batch: BatchFolder) -> None:
        run = batch.run
        state: State = "interrupted" if run.state == "running" else run.state
        written = write_books(batch, self.rubric.rubric, state, run.counts.kept, ended_at=run.ended_at)
        write_run(self.path, written.run.model_copy(update={"ended_at": run.ended_at}))

    def _catch_up(self) -> None:
        """Find what was decided, or settled, while no one reviewed or just before a review was killed."""
        batch = self.submissions.batch()
        behind = set(self._all_behind(self.overrides()))
        written = stamp_of(self.path / GRADEBOOK)
        newest = max(
            ((stamp_of(self.path / item.key / RESULT) or (0,))[0] for item in self.submissions.items()),
            default=0,
        )
        with self._guard:
            self._pending |= behind
            late = batch.run.state != "running" and (written is None or newest > written[0])
            self._books_behind |= bool(behind) or late
        self._caught_up = True

    def _all_behind(self, overrides: Overrides) -> Iterator[str]:
        for item in self.submissions.items():
            result = read_result(self.path / item.key) if item.gradable else None
            same = result is not None and result.rubric.digest == self.rubric.digest
            if result is not None and same and self._behind(item, result, overrides):
                yield item.key

    @staticmethod
    def _behind(item: Item, result: GradingResult, overrides: Overrides) -> bool:
        """Return whether a result says something else than `overrides.yaml`."""
        known = {criterion.id for criterion in result.criteria}
        given = {k: v for k, v in overrides.get(item.entry.id, {}).items() if k in known}
        return given != {o.criterion: plain(o) for o in result.overrides}


LOCK = ".review.lock"


class Conflict(Exception):
    """Someone else has decided since: `now` is what stands there, None for nothing."""

    def __init__(self, now: Override | None) -> None:
        super().__init__("someone else has decided since")
        self.now = now


def mark(override: Override | None) -> str:
    """What a form carries to say which decision it was made from; empty for none."""
    return sha256(override.model_dump_json().encode()).hexdigest()[:24] if override else ""


def plain(override: Override) -> Override:
    """What a person wrote of an override that was applied."""
    return Override(**{name: getattr(override, name) for name in Override.model_fields})


def alike(one: Override | None, other: Override | None) -> bool:
    """Return whether both say the same, whenever it was said."""
    if one is None or other is None:
        return one is other
    return one.model_copy(update={"date": None}) == other.model_copy(update={"date": None})


@contextmanager
def reviewing(path: Path) -> Iterator[None]:
    """Hold what all reviews of a class hold while they compare and write: another process may review it, too."""
    try:
        descriptor = os.open(path / LOCK, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW, 0o666)
    except OSError as error:
        raise unwritable(path / LOCK, error) from error
    try:
        with suppress(OSError):  # a file system without locks: its users must not write at the same time
            fcntl.flock(descriptor, fcntl.LOCK_EX)
        yield
    finally:
        os.close(descriptor)
