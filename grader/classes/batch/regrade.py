"""A class judged again from its evidence by a rubric that may be another one: nothing is run.

evidence, rubric → criteria → settled → reports and gradebook, and a table of what changed
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from pydantic import ValidationError

from grader import __version__
from grader.classes.batch.folder import BatchFolder, write_run
from grader.classes.batch.job import Executor
from grader.classes.batch.renew_results import Judged, Settler, judge_all, rewrite
from grader.classes.batch.run import (
    BatchOptions,
    Watcher,
    describe_rubric,
    hold_folder,
    ids_of,
    run_batch,
    write_books,
)
from grader.classes.overrides import FILE as OVERRIDES
from grader.classes.overrides import read_overrides
from grader.errors import GraderError
from grader.files import FILE, atomic_write, read_untrusted, unwritable
from grader.judging.summary import overall_status, total_fields
from grader.model import SandboxMode
from grader.model.batch import Entry, Roster
from grader.model.result import CriterionResult, GradingResult
from grader.portable import CLOEXEC
from grader.report.text import csv_text
from grader.results import EVIDENCE
from grader.rubric.load import LoadedRubric

CHANGES, JOURNAL = "changes.csv", ".regrading.jsonl"
JOURNAL_BYTES = 1 << 30
COLUMNS = ("id", "criterion", "status before", "status", "points before", "points", "max_points", "why")


@dataclass(frozen=True, kw_only=True)
class Change:
    """One criterion whose status or points changed. A new one has no `before`, one that is gone no `after`."""

    criterion: str
    before: CriterionResult | None
    after: CriterionResult | None

    @property
    def why(self) -> str:
        """What the check says now."""
        if self.after is None:
            return "the rubric no longer has it"
        return self.after.message or self.after.measured or self.after.title


@dataclass(frozen=True, kw_only=True)
class Regraded:
    """One submission: its result before and after, and the scenarios without a recording that fits.

    `error` says in one line why it could not be judged: its result stays as it was.
    """

    entry: Entry
    before: GradingResult | None
    after: GradingResult | None
    missing: tuple[str, ...] = ()
    error: str = ""

    @property
    def changes(self) -> tuple[Change, ...]:
        """What changed, in the new rubric's order."""
        if self.before is None or self.after is None:
            return ()
        return tuple(filter(_differs, pairs(self.before, self.after)))


def pairs(before: GradingResult, after: GradingResult) -> Iterator[Change]:
    """Yield every criterion of two results, changed or not, in the order of the later one."""
    old, new = ({c.id: c for c in result.criteria} for result in (before, after))
    names = [*new, *(name for name in old if name not in new)]
    return (Change(criterion=name, before=old.get(name), after=new.get(name)) for name in names)


def _differs(change: Change) -> bool:
    before, after = change.before, change.after
    if before is None or after is None:
        return True
    return (before.status, before.points, before.max_points) != (after.status, after.points, after.max_points)


class _Replaced:
    """The results that a regrade replaces, kept on the disk until `changes.csv` is written.

    One that was stopped has replaced some already: the next one compares with these, so that no change is missing.
    """

    def __init__(self, path: Path) -> None:
        self._path, self._known = path, dict[str, GradingResult]()
        for row in (read_untrusted(path, JOURNAL_BYTES) or b"").splitlines():
            with suppress(ValidationError):  # the last one was being written
                result = GradingResult.read_json(row)
                self._known.setdefault(result.submission.id, result)

    def first(self, result: GradingResult | None) -> GradingResult | None:
        """Return the result that there was before the first of them."""
        return self._known.get(result.submission.id, result) if result else None

    def add(self, result: GradingResult) -> None:
        """Keep a result that is about to be replaced. Raises OutputError."""
        if self._known.setdefault(result.submission.id, result) is not result:
            return
        line = result.model_dump_json(by_alias=True).encode()
        try:
            with os.fdopen(
                os.open(self._path, os.O_WRONLY | os.O_APPEND | os.O_CREAT | CLOEXEC, FILE), "ab"
            ) as file:
                file.write(b"\n" + line + b"\n")
        except OSError as error:
            raise unwritable(self._path, error) from error

    def forget(self) -> None:
        """Remove them."""
        self._path.unlink(missing_ok=True)


def regrade(
    folder: BatchFolder,
    rubric: LoadedRubric,
    rubric_source: str,
    jobs: int,
    stopped: Callable[[int, int], None] = lambda done, of: None,  # noqa: ARG005 - as it is called
) -> tuple[BatchFolder, tuple[Regraded, ...]]:
    """Judge every submission of the batch again; return the folder as it is now and what became of each, in order.

    `stopped` is called by Ctrl-C, with how many of how many are judged again. The next call goes on.
    Writes each `result.json` with its reports, `run.json`, `results.jsonl`, `gradebook.csv` and `changes.csv`.
    Raises UsageError for faulty overrides, EvidenceError if a newer grader has written there, Busy if a batch works in
    the folder, OutputError.
    """
    with hold_folder(folder.path):
        folder.refuse_newer()
        entries = folder.run.entries
        overrides = read_overrides(folder.path / OVERRIDES, rubric.rubric, ids_of(folder.run))
        one_by_one = _Regrading(
            folder=folder,
            rubric=rubric,
            settler=Settler(rubric.rubric, overrides),
            replaced=_Replaced(folder.path / JOURNAL),
        )
        by_folder = {folder.folder_of(entry): entry for entry in entries if folder.has_evidence(entry)}
        found = dict[Path, Regraded]()
        try:
            for judged in judge_all([path / EVIDENCE for path in by_folder], rubric, jobs, fitting=True):
                found[judged.folder] = one_by_one.of(by_folder[judged.folder.parent], judged)
        except KeyboardInterrupt:
            stopped(len(found), len(by_folder))
            raise
        regraded = tuple(
            found.get(folder.folder_of(entry) / EVIDENCE) or one_by_one.settle_only(entry)
            for entry in entries
        )
        run = folder.run.model_copy(update=describe_rubric(rubric, rubric_source) | {"grader": __version__})
        now = BatchFolder(folder.path, run)
        write_run(now.path, now.run)
        write_changes(folder.path / CHANGES, regraded)
        now = write_books(now, rubric.rubric, run.state, run.counts.kept, ended_at=run.ended_at)
        one_by_one.replaced.forget()
        return now, regraded


@dataclass(frozen=True, kw_only=True)
class _Regrading:
    """What is the same for all submissions of a regrade."""

    folder: BatchFolder
    rubric: LoadedRubric
    settler: Settler
    replaced: _Replaced

    def of(self, entry: Entry, judged: Judged) -> Regraded:
        """Write the result that the criteria of today come to."""
        before, rubric = self.folder.earlier(entry), self.rubric
        first = self.replaced.first(before)
        if before is None or judged.criteria is None:
            return Regraded(entry=entry, before=first, after=None, error=judged.error or "it has no result")
        automatic = before.model_copy(
            update={
                "rubric": describe_rubric(rubric, "")["rubric"],
                "rubric_origin": before.rubric_origin
                if rubric.digest == before.rubric.digest
                else rubric.origin,
                "criteria": judged.criteria,
                "status": overall_status(judged.criteria),
                **total_fields(rubric.rubric, judged.criteria),
                "max_points": rubric.rubric.max_points,
                "environment": before.environment.model_copy(update={"grader": __version__}),
                "overrides": (),
                "handed_in": None,
                "late": None,
                "error": None,
            }
        )
        handed_in = before.handed_in
        if handed_in is not None:  # the deadline is that of today's rubric
            handed_in = handed_in.model_copy(update={"deadline": None})
        after = self.settler.settle(automatic, entry.id, handed_in, before)
        try:
            if after != before:
                self._replace(entry, before, after)
        except GraderError as error:
            return Regraded(entry=entry, before=first, after=None, error=error.message)
        return Regraded(entry=entry, before=first, after=after, missing=judged.missing)

    def settle_only(self, entry: Entry) -> Regraded:
        """Apply overrides to what could not be graded."""
        before = self.folder.earlier(entry)
        error = before.error.message if before is not None and before.error else "nothing was recorded"
        if before is not None and (self.settler.of(entry.id) or before.overrides):
            self._replace(entry, before, self.settler.settle_again(before, entry.id, None))
        return Regraded(entry=entry, before=self.replaced.first(before), after=None, error=error)

    def _replace(self, entry: Entry, before: GradingResult, after: GradingResult) -> None:
        self.replaced.add(before)
        rewrite(self.folder.folder_of(entry), after, self.rubric.rubric, self.rubric.docs)


def write_changes(path: Path, regraded: Sequence[Regraded]) -> None:
    """Write a row for each criterion that changed. Raises OutputError."""
    atomic_write(path, csv_text([COLUMNS, *_rows(regraded)]).encode("utf-8"))


def _rows(regraded: Sequence[Regraded]) -> Iterator[tuple[str | float, ...]]:
    for one in regraded:
        for change in one.changes:
            before, after = change.before, change.after
            yield (
                one.entry.id,
                change.criterion,
                before.status.value if before else "",
                after.status.value if after else "",
                before.points if before else "",
                after.points if after else "",
                after.max_points if after else "",
                change.why,
            )


def run_missing(
    folder: BatchFolder,
    rubric: LoadedRubric,
    regraded: Sequence[Regraded],
    *,
    executor: Executor,
    watcher: Watcher,
    sandbox: SandboxMode,
) -> tuple[BatchFolder, tuple[Regraded, ...]]:
    """Grade again, from the same commits, what has scenarios that were not recorded; return what `regrade` returns.

    Credentials come from the environment or from git: the batch's folder holds none.
    """
    again = [one.entry.id for one in regraded if one.missing]
    roster = Roster(
        file=folder.run.roster,
        entries=folder.run.entries,
        columns=folder.run.columns,
        faults=folder.run.faults,
    )
    options = BatchOptions(
        out=folder.path,
        jobs=folder.run.jobs,
        sandbox=sandbox,
        before=folder.run.before,
        only=again,
        same_commit=True,
        allow_local=folder.run.allow_local,
        remote_only=folder.run.remote_only,
    )
    now = run_batch(roster, folder.run.rubric_source, rubric, options, executor=executor, watcher=watcher)
    after = tuple(_compare_run(now, one) if one.missing else one for one in regraded)
    write_changes(folder.path / CHANGES, after)
    return now, after


def _compare_run(folder: BatchFolder, one: Regraded) -> Regraded:
    result = folder.earlier(one.entry)
    failed = result is None or result.status == "error"
    return Regraded(
        entry=one.entry,
        before=one.before,
        after=result,
        missing=one.missing if failed else (),
        error="it could not be run again" if failed else "",
    )
