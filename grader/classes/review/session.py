"""Where decisions are saved: each goes into `overrides.yaml` at once, and results and gradebook follow.

Two people may decide about the same criterion: each decision names the one it was made from, so that none is lost.
"""

from __future__ import annotations

import secrets
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import AbstractContextManager, suppress
from dataclasses import dataclass, replace
from functools import cached_property
from hashlib import sha256
from pathlib import Path

from grader.classes.batch.folder import BatchFolder, open_batch, write_run
from grader.classes.batch.renew_results import Settler, rewrite, rewrite_all
from grader.classes.batch.run import GRADEBOOK, hold_folder, ids_of, write_books
from grader.classes.feedback.publish import read_published, refuse_other_rubric
from grader.classes.overrides import COMMENTS_FILE as BANK
from grader.classes.overrides import (
    FILE,
    Bank,
    Overrides,
    Written,
    read_bank,
    read_written,
    resolve,
    resolve_all,
)
from grader.classes.overrides.write import hold_lock, write_override, write_overrides
from grader.classes.review.student_requests import Requests, read_requests, request_files, waiting
from grader.classes.review.submissions import (
    ListedSubmission,
    Mask,
    Remembered,
    Submissions,
    aliases,
    alike,
    mask_of,
    stamp_of,
)
from grader.errors import Busy, GraderError, OutputError, RubricError, UsageError
from grader.model.batch import Entry, State
from grader.model.result import BankComment, GradingResult, Override, WrittenOverride
from grader.portable import cores
from grader.report.class_page.submissions import Names, salt_in
from grader.results import RESULT, read_result
from grader.rubric.load import LoadedRubric, load_rubric, read_beside_rubric

PATIENCE_S = 0.1
FEW = 8
FOLLOWS = "the report follows in a moment"
OTHER_RUBRIC = "the class has been graded by another rubric since: end this review and start it again"

OLDER_RESULT = (
    "the submission was judged by another rubric: it counts when `grader regrade` has judged it again"
)


def open_session(path: Path, pace: Pace | None = None) -> ReviewSession:
    """Return the review of the class in `path`. Raises UsageError where there is none, and where its rubric has
    changed, EvidenceError where a newer grader wrote results in it."""
    batch = open_batch(path)
    batch.refuse_newer()
    rubric = load_rubric(batch.run.rubric_source)
    refuse_other_rubric(batch, rubric, "review it")
    return ReviewSession(path, rubric, pace or Pace())


@dataclass(frozen=True, kw_only=True)
class Decisions:
    """What stands in `overrides.yaml`, what it comes to, and the comments of `comments.yaml`."""

    written: Written
    come_to: Overrides
    bank: Bank


class ReviewSession:
    """Safe to use from several threads, and beside other sessions and batches of the same class."""

    def __init__(self, path: Path, rubric: LoadedRubric, pace: Pace) -> None:
        self.path, self.rubric = path, rubric
        self.submissions = Submissions(path)
        self.background = BackgroundWriter(self._follow, pace)
        # for decisions, which are compared and written; for the class's results; for what is noted below
        self._saving, self._writing, self._guard = threading.Lock(), threading.Lock(), threading.Lock()
        self._decisions, self._requests = Remembered[Decisions](), Remembered[Requests]()
        self.share: Callable[[Entry], bool] = lambda _: True
        """Which submissions the pages list."""
        self.blind = False
        """Whether names are hidden until a submission is published."""
        self._aliases: tuple[object, Mapping[str, str], frozenset[str]] | None = None
        self._pending: set[str] = set()
        self._caught_up = False
        self._books_behind = False
        self._being_written = 0

    @cached_property
    def starter(self) -> dict[str, bytes]:
        """The files that the course hands out, by path; none where they are not there any more."""
        folder = self.rubric.rubric.starter
        if folder is None:
            return {}
        with suppress(RubricError):
            # without the starter, the code is shown all the same
            files = read_beside_rubric(self.rubric)
            return {name: data for name, data in files.items() if name.startswith(f"{folder}/")}
        return {}

    def start(self) -> None:
        """Begin to follow; what was decided while no one reviewed is looked at first. All results are read once, so
        that no page waits for that."""
        self.submissions.items()
        self.background.start()
        self.background.changed()

    def close(self) -> bool:
        """Write what is left; return whether all is written."""
        return self.background.close()

    def overrides(self) -> Overrides:
        """Return what `overrides.yaml` and `comments.yaml` come to now. Raises RubricError where they have faults."""
        return self.decisions().come_to

    def decisions(self) -> Decisions:
        """Return what both files say now. Raises RubricError where they have faults."""
        rubric, ids = self.rubric.rubric, tuple(ids_of(self.submissions.batch().run))

        def read() -> Decisions:
            bank = read_bank(self.path / BANK, rubric)
            written = read_written(self.path / FILE, rubric, ids, bank)
            return Decisions(written=written, come_to=resolve_all(written, rubric, bank), bank=bank)

        return self._decisions.get((stamp_of(self.path / FILE), stamp_of(self.path / BANK), ids), read)

    def items(self) -> tuple[ListedSubmission, ...]:
        """Return every submission of the share, with what was decided since its result was written."""
        items = self._anonymous_items(item for item in self.submissions.items() if self.share(item.entry))
        with suppress(RubricError):
            decided, asked = self.overrides(), self.requests().found
            found = []
            for item in items:
                by = decided.get(item.entry.id, {})
                open_ = [of for of, some in asked.get(item.entry.id, {}).items() if waiting(some, by.get(of))]
                found.append(item.with_decisions(by).with_requests(open_))
            return tuple(found)
        return items

    def requests(self) -> Requests:
        """Return what students ask, as the files of requests say now."""
        entries, paths = self.submissions.batch().run.entries, request_files(self.path)
        stamp = (tuple((path, stamp_of(path)) for path in paths), entries)
        return self._requests.get(stamp, lambda: read_requests(paths, entries, self.rubric.rubric.criteria))

    def answered(self, item: ListedSubmission, criterion: str, answer: str) -> tuple[str, ...]:
        """Return the digests of the questions that an answer is to: those of now, and as before if it is as before."""
        before = self.decisions().written.get(item.entry.id, {}).get(criterion)
        if not answer or (before and before.answer == answer):
            return before.answered if before and answer else ()
        asked = self.requests().found.get(item.entry.id, {}).get(criterion, ())
        return tuple(dict.fromkeys(one.digest for one in asked))[:100]

    def item(self, address: str) -> ListedSubmission | None:
        """Return the submission of an address; None where the class has none."""
        if not self.blind:
            return self.submissions.item(address)
        items = self._anonymous_items(self.submissions.items())
        return next((item for item in items if item.address == address), None)

    def mask(self, item: ListedSubmission, commit: str | None) -> Mask | None:
        """Return what takes a submission's names out of its texts; None where they are not hidden."""
        return mask_of(item.entry, commit or "", self._names()[1]) if item.alias else None

    def _anonymous_items(self, items: Iterable[ListedSubmission]) -> tuple[ListedSubmission, ...]:
        """Return them in another order and without names, but for those that are published."""
        if not self.blind:
            return tuple(items)
        called, published = self._names()[0], read_published(self.path)
        pairs = [(called[item.entry.id], item) for item in items]
        # by the number in the alias, which says nothing of the place in the roster
        pairs.sort(key=lambda pair: int(pair[0].rpartition("-")[2]))
        return tuple(item if published.of(item.entry) else replace(item, alias=to) for to, item in pairs)

    def _names(self) -> tuple[Mapping[str, str], frozenset[str]]:
        """Return what each submission is called, and the words that most sources have."""
        batch = self.submissions.batch()
        if self._aliases is None or self._aliases[0] is not batch:  # a new one where the class changed
            entries, names = [item.entry for item in self.submissions.items()], Names()
            for entry in entries:
                names.add(entry)
            called = aliases([entry.id for entry in entries], salt_in(self.path))
            self._aliases = (batch, called, names.common())
        return self._aliases[1:]

    def progress(self) -> Counter[str]:
        """Return how many criteria each marker decided, by name."""
        with suppress(RubricError):
            decided = self.overrides()
            return Counter(one.author for found in decided.values() for one in found.values() if one.awards)
        return Counter()

    def save(
        self,
        item: ListedSubmission,
        criterion: str,
        wanted: WrittenOverride | None,
        seen: str,
        *,
        soon: bool = True,
    ) -> str:
        """Put a decision in place of the one that was `seen` (its `mark`), or take that out (None).

        Return in a line why the submission's files do not say so yet; empty where they do. They are written at once,
        or if not `soon` in the background: who goes on to another submission does not wait for the reports of this one.

        Raises Conflict where another one stands there by now, and what `write_override` raises; then nothing changed.
        """
        name = item.entry.id
        asked = next(c for c in self.rubric.rubric.criteria if c.id == criterion)
        with self._saving, hold_review(self.path):
            found = self.decisions()
            now = found.come_to.get(name, {}).get(criterion)
            # if someone else decided the same, nothing is lost
            if not same(now, resolve(wanted, asked, found.bank) if wanted else None):
                if mark(now) != seen:
                    raise Conflict(now)
                write_override(self.path / FILE, name, criterion, wanted)
        self._note_behind({item.key})
        # Before the background hears of it: else both would write the submission's files.
        waits = self._settled_soon(item) if soon else FOLLOWS
        self.background.changed()
        return waits

    def save_together(
        self, item: ListedSubmission, criterion: str, wanted: WrittenOverride, seen: str
    ) -> int:
        """Decide the same for a submission and all that are `alike`; return how many these are.

        All are written at once, with a word by which they can be taken back at once. Raises Conflict as `save` does.
        """
        wanted = wanted.model_copy(update={"together": secrets.token_hex(6)})
        with self._saving, hold_review(self.path):
            now = self.overrides().get(item.entry.id, {}).get(criterion)
            if mark(now) != seen:
                raise Conflict(now)
            those = [item, *(one for one in alike(self.items(), criterion, item) if one.key != item.key)]
            self._write_together(those, criterion, wanted)
        return len(those)

    def undo_together(self, criterion: str, word: str) -> int:
        """Take out what was decided in one go and not changed since; return how many these are."""
        with self._saving, hold_review(self.path):
            written = self.decisions().written
            those = [
                item
                for item in self.submissions.items()
                if (one := written.get(item.entry.id, {}).get(criterion)) is not None
                and word  # what was decided one by one has no word
                and one.together == word
            ]
            self._write_together(those, criterion, None)
        return len(those)

    def _write_together(
        self, items: Sequence[ListedSubmission], criterion: str, wanted: WrittenOverride | None
    ) -> None:
        write_overrides(self.path / FILE, [(item.entry.id, criterion, wanted) for item in items])
        self._note_behind({item.key for item in items})
        self.background.changed()

    def save_comment(self, criterion: str, name: str, comment: BankComment) -> int:
        """Put a comment into `comments.yaml`, or change it there for all that have it; return how many have it."""
        with self._saving, hold_review(self.path):
            written = self.decisions().written
            write_override(self.path / BANK, criterion, name, comment)
            having = {
                item.key
                for item in self.submissions.items()
                if (one := written.get(item.entry.id, {}).get(criterion)) and name in one.comments
            }
            self._note_behind(having)
            self.background.changed()
        return len(having)

    def _note_behind(self, keys: set[str]) -> None:
        with self._guard:
            self._pending |= keys
            self._books_behind = True

    def result(self, item: ListedSubmission, overrides: Overrides) -> GradingResult | None:
        """Return a submission's result as it counts with these overrides; None where it has none."""
        result = read_result(self.path / item.key) if item.gradable else None
        if result is None or not self._is_behind(item, result, overrides):
            return result
        return Settler(self.rubric.rubric, overrides).settle_again(result, item.entry.id, None)

    def waits(self, item: ListedSubmission) -> str:
        """Return why the files of a submission do not say yet what was decided; empty where they do."""
        with self._guard:
            pending = item.key in self._pending
        return self.background.trouble or "its report follows in a moment" if pending else ""

    def batch_runs(self) -> bool:
        """Return whether a batch works in the folder just now."""
        if self.submissions.batch().run.state != "running" or self._writing.locked():  # this review writes
            return False
        try:
            with hold_folder(self.path):
                return False
        except Busy:
            return True

    def _settled_soon(self, item: ListedSubmission) -> str:
        """Settle one submission now, or say why that comes later."""
        if not item.gradable:
            return "it counts as soon as the submission has a result"
        if not self._writing.acquire(timeout=PATIENCE_S):
            return FOLLOWS
        try:
            with hold_folder(self.path):
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
        why, wanted = "", dict[Path, GradingResult]()
        try:
            overrides = self.overrides()
            for item in filter(None, map(self.submissions.item, sorted(keys))):
                now, why = self._settle_result(item, overrides)
                wanted |= {self.path / item.key: now} if now else {}
            self._rewrite(wanted)
        except BaseException:
            with self._guard:
                self._pending |= keys
            raise
        finally:
            self._being_written = 0
        return why

    def _rewrite(self, wanted: Mapping[Path, GradingResult]) -> None:
        """Write these results; many by processes beside this one, so that pages do not wait for them."""
        if len(wanted) <= FEW:
            for folder, result in wanted.items():
                rewrite(folder, result, self.rubric.rubric, self.rubric.docs)
            return
        self._being_written = len(wanted)
        faults = []
        for fault in rewrite_all(wanted, self.rubric, cores()):
            self._being_written -= 1
            faults += [fault] if fault else []
        if faults:
            raise OutputError(faults[0])

    def left(self) -> int:
        """Return how many submissions have reports that do not say yet what was decided."""
        with self._guard:
            return len(self._pending) + self._being_written

    def _settle_result(
        self, item: ListedSubmission, overrides: Overrides
    ) -> tuple[GradingResult | None, str]:
        """Return the result that is to be written, None where the one that is there is right, and why there is none."""
        batch = self.submissions.batch()
        if batch.run.rubric.digest != self.rubric.digest:
            raise UsageError(OTHER_RUBRIC)
        result = batch.earlier(item.entry) if item.gradable else None
        if result is None:
            return None, ""
        if result.rubric.digest != self.rubric.digest:
            return None, OLDER_RESULT
        now = Settler(self.rubric.rubric, overrides).settle_again(result, item.entry.id, None)
        return (now if now != result else None), ""

    def _follow(self) -> None:
        """Settle what is not settled yet, and write the class's files."""
        if not self._caught_up:
            self._catch_up()
        if not self._books_behind:
            return
        with self._writing, hold_folder(self.path):
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
        # the folder's lock is ours, so the batch that says `running` was killed
        state: State = "interrupted" if run.state == "running" else run.state
        written = write_books(batch, self.rubric.rubric, state, run.counts.kept, ended_at=run.ended_at)
        write_run(self.path, written.run.model_copy(update={"ended_at": run.ended_at}))

    def _catch_up(self) -> None:
        """Find what was decided, or settled, while no one reviewed or just before a review was killed."""
        batch, overrides, items = self.submissions.batch(), self.overrides(), self.submissions.items()
        read = ((item, read_result(self.path / item.key)) for item in items if item.gradable)
        behind = {item.key for item, found in read if found and self._is_behind(item, found, overrides)}
        written = stamp_of(self.path / GRADEBOOK)
        newest = max(((stamp_of(self.path / item.key / RESULT) or (0,))[0] for item in items), default=0)
        with self._guard:
            self._pending |= behind
            late = batch.run.state != "running" and (written is None or newest > written[0])
            self._books_behind |= bool(behind) or late
        self._caught_up = True

    def _is_behind(self, item: ListedSubmission, result: GradingResult, overrides: Overrides) -> bool:
        """Return whether a result by this rubric says something else than `overrides.yaml`."""
        known = {criterion.id for criterion in result.criteria}
        given = {k: v for k, v in overrides.get(item.entry.id, {}).items() if k in known}
        applied = {o.criterion: override_as_written(o) for o in result.overrides}
        return given != applied and result.rubric.digest == self.rubric.digest


LOCK = ".review.lock"


class Conflict(Exception):
    """Someone else has decided since: `now` is what stands there, None for nothing."""

    def __init__(self, now: Override | None) -> None:
        super().__init__("someone else has decided since")
        self.now = now


def mark(override: Override | None) -> str:
    """What a form carries to say which decision it was made from; empty for none."""
    return sha256(override.model_dump_json().encode()).hexdigest()[:24] if override else ""


def override_as_written(override: Override) -> Override:
    """Return what a person wrote of an override that was applied."""
    return Override(**{name: getattr(override, name) for name in Override.model_fields})


def same(one: Override | None, other: Override | None) -> bool:
    """Return whether both say the same, whenever it was said."""
    if one is None or other is None:
        return one is other
    return one.model_copy(update={"date": None}) == other.model_copy(update={"date": None})


def hold_review(path: Path) -> AbstractContextManager[None]:
    """Hold what all reviews of a class hold while they compare and write: another process may review it, too."""
    return hold_lock(path / LOCK, path / LOCK)


@dataclass(frozen=True, kw_only=True)
class Pace:
    """Seconds: how long nothing has to change before the work is done, how long it waits at most, how long until it
    is tried again where it failed, and how long it waits at the end for another program that works in the folder."""

    quiet_s: float = 2.0
    latest_s: float = 8.0
    again_s: float = 3.0
    closing_s: float = 60.0


class BackgroundWriter:
    """Calls `work` in a thread of its own after `changed` was called; `trouble` says why it could not be done."""

    def __init__(self, work: Callable[[], None], pace: Pace) -> None:
        self._work, self._pace = work, pace
        self._condition = threading.Condition()
        self._first: float | None = None
        self._last = 0.0
        self._closing, self._closed_at = False, 0.0
        self._working = False
        self.trouble = ""
        self._thread = threading.Thread(target=self._run, name="review-background", daemon=True)

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def changed(self) -> None:
        """Note that there is something to do."""
        with self._condition:
            self._last = time.monotonic()
            self._first = self._last if self._first is None else self._first
            self._condition.notify_all()

    def wait(self, timeout_s: float) -> bool:
        """Wait until all is done; return whether it is."""
        with self._condition:
            return self._condition.wait_for(lambda: self._first is None and not self._working, timeout_s)

    def close(self) -> bool:
        """Do what is left at once and end; return whether all is done. What is busy in the folder is waited for."""
        with self._condition:
            self._closing, self._closed_at = True, time.monotonic()
            self._condition.notify_all()
        self._thread.join()
        return self._first is None

    def _run(self) -> None:
        while self._wait_until_due():
            is_busy = False
            try:
                self._work()
                trouble = ""
            except GraderError as error:
                trouble, is_busy = error.message, isinstance(error, Busy)
            except Exception as error:  # noqa: BLE001 - the page shows it, and it is tried again
                trouble = f"internal error: {type(error).__name__}: {error}"
            with self._condition:
                self._working = False
                self.trouble = trouble
                if trouble and self._closing:
                    self._first = self._first or time.monotonic()
                    left = self._closed_at + self._pace.closing_s - time.monotonic()
                    # what is busy will end; any other trouble would only come again
                    if not is_busy or left <= 0:
                        return
                    self._condition.wait(min(left, self._pace.again_s))
                    continue
                if trouble:
                    self._first = self._last = time.monotonic() + self._pace.again_s  # so it is due later
                self._condition.notify_all()

    def _wait_until_due(self) -> bool:
        """Wait until the work is due; False at the end, with nothing left to do."""
        with self._condition:
            while not self._closing:
                if self._first is None:
                    self._condition.wait()
                    continue
                due = min(self._last + self._pace.quiet_s, self._first + self._pace.latest_s)
                left = due - time.monotonic()
                if left <= 0:
                    break
                self._condition.wait(left)
            if self._first is None:
                return False
            self._first, self._working = None, True
            return True
