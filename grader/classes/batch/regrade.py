"""A class judged again from its evidence by a rubric that may be another one: nothing is run.

evidence, rubric → criteria → settled → reports and gradebook, and a table of what changed
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import NamedTuple

from pydantic import ValidationError

from grader import __version__
from grader.classes.batch.folder import BatchFolder, write_run
from grader.classes.batch.job import Executor
from grader.classes.batch.renew_results import Settler, judge_one, rewrite
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
from grader.files import FILE, atomic_write, open_untrusted, writing
from grader.intake.names import safe_name
from grader.judging.summary import overall_status, total_fields
from grader.model import SandboxMode
from grader.model.batch import Entry, Roster
from grader.model.result import GradingResult, Override
from grader.model.verdict import Status
from grader.portable import CLOEXEC
from grader.report.text import csv_text
from grader.results import EVIDENCE, read_result
from grader.rubric.load import LoadedRubric
from grader.workers import WorkerEnded, run_each

CHANGES, JOURNAL = "changes.csv", ".regrading.jsonl"
NOTHING, NOT_AGAIN = "nothing was recorded", "it could not be run again"
COLUMNS = ("id", "criterion", "status before", "status", "points before", "points", "max_points", "why")


class CriterionState(NamedTuple):
    """What one criterion came to. `counts` is false where the rubric left it out."""

    status: Status
    points: float
    max_points: float
    counts: bool


@dataclass(frozen=True, kw_only=True)
class CriterionChange:
    """One criterion of two results. A new one has no `before`, one that is gone no `after`. `why` is what the check
    says now."""

    criterion: str
    before: CriterionState | None
    after: CriterionState | None
    why: str


@dataclass(frozen=True, kw_only=True, slots=True)
class Regraded:
    """One submission: its points before and after, what changed, in the new rubric's order, and the scenarios without a
    recording that fits.

    `error` says on one line why it could not be judged: its result stays as it was. `first` is what each criterion was
    before, kept only where scenarios are missing. A class of thousands is kept as these, and never as whole results.
    """

    id: str
    points_before: float | None
    points: float | None = None
    changes: tuple[CriterionChange, ...] = ()
    missing: tuple[str, ...] = ()
    first: Mapping[str, CriterionState] = field(default_factory=dict)
    error: str = ""


def states_of(result: GradingResult) -> dict[str, CriterionState]:
    """Return what each criterion came to."""
    return {
        c.id: CriterionState(c.status, c.points, c.max_points, c.left_out is None) for c in result.criteria
    }


def compare_criteria(before: Mapping[str, CriterionState], after: GradingResult) -> Iterator[CriterionChange]:
    """Yield every criterion of two results, changed or not, in the order of the later one."""
    now = states_of(after)
    for one in after.criteria:
        why = one.message or one.measured or one.title
        yield CriterionChange(criterion=one.id, before=before.get(one.id), after=now[one.id], why=why)
    for name in (name for name in before if name not in now):
        yield CriterionChange(
            criterion=name, before=before[name], after=None, why="the rubric no longer has it"
        )


def _changes(before: Mapping[str, CriterionState], after: GradingResult) -> tuple[CriterionChange, ...]:
    return tuple(c for c in compare_criteria(before, after) if (c.before or ())[:3] != (c.after or ())[:3])


def _replaced_before(journal: Path) -> dict[str, int]:
    """Return where in the journal the result of each submission begins that a regrade which was stopped has replaced.

    They are compared with in place of those that it wrote, so that no change is missing from `changes.csv`.
    """
    places: dict[str, int] = {}
    with suppress(OSError), open_untrusted(journal) as file:
        for row in file:
            with suppress(ValidationError):  # the last one was being written
                # the first counts: a later one is already what a regrade wrote
                places.setdefault(GradingResult.read_json(row).submission.id, file.tell() - len(row))
    return places


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
        journal = folder.path / JOURNAL
        places = _replaced_before(journal)
        again = (
            _Job(
                id=entry.id,
                folder=folder.folder_of(entry),
                recorded=folder.has_evidence(entry),
                overrides=overrides.get(entry.id, {}),
                first_at=places.get(safe_name(entry.id)),
            )
            for entry in entries
        )
        found = dict[str, Regraded]()
        regrade_one = partial(_regrade_one, rubric, journal)
        try:
            for one in run_each(regrade_one, again, min(jobs, len(entries)), ended=_ended):
                found[one.id] = one
        except KeyboardInterrupt:
            stopped(len(found), len(entries))
            raise
        # results came as they were ready; the roster's order is restored
        regraded = tuple(found[entry.id] for entry in entries)
        run = folder.run.model_copy(update=describe_rubric(rubric, rubric_source) | {"grader": __version__})
        now = BatchFolder(folder.path, run)
        write_run(now.path, now.run)
        write_changes(folder.path / CHANGES, regraded)
        now = write_books(now, rubric.rubric, run.state, run.counts.kept, ended_at=run.ended_at)
        # last: until all is written, it is what a regrade that goes on compares with
        journal.unlink(missing_ok=True)
        return now, regraded


@dataclass(frozen=True, kw_only=True)
class _Job:
    """A submission to be judged again. `first_at` is where the journal has its result, if a regrade that was stopped
    has replaced it."""

    id: str
    folder: Path
    recorded: bool
    overrides: Mapping[str, Override]
    first_at: int | None


def _ended(job: _Job, _: WorkerEnded) -> Regraded:
    before = read_result(job.folder)
    error = f"{job.folder / EVIDENCE}: judging it ended the process"
    return Regraded(id=job.id, points_before=before.points if before else None, error=error)


def _regrade_one(rubric: LoadedRubric, journal: Path, job: _Job) -> Regraded:
    """In a worker: write the result that the criteria of today come to, and return how it differs."""
    try:
        before = read_result(job.folder)
        if before is None:
            error = "it has no result" if job.recorded else NOTHING
            return Regraded(id=job.id, points_before=None, error=error)
        first = before if job.first_at is None else _result_at(journal, job.first_at)
        after, missing, error = _judge_again(rubric, job, before)
        if after is not None and after != before:
            if job.first_at is None:
                _keep(journal, before)
            rewrite(job.folder, after, rubric.rubric, rubric.docs)
    except GraderError as raised:
        return Regraded(id=job.id, points_before=None, error=raised.message)
    if error or after is None:
        return Regraded(id=job.id, points_before=first.points, error=error)
    return Regraded(
        id=job.id,
        points_before=first.points,
        points=after.points,
        changes=_changes(states_of(first), after),
        missing=missing,
        first=states_of(first) if missing else {},
    )


def _judge_again(
    rubric: LoadedRubric, job: _Job, before: GradingResult
) -> tuple[GradingResult | None, tuple[str, ...], str]:
    """Return the result of today, the scenarios that lack a recording, and why it could not be judged.

    What could not be graded has no criteria of today: overrides are applied to it.
    """
    settler = Settler(rubric.rubric, {job.id: job.overrides})
    if not job.recorded:
        error = before.error.message if before.error else NOTHING
        settled = settler.settle_again(before, job.id, None) if job.overrides or before.overrides else None
        return settled, (), error
    judged = judge_one(rubric, job.folder / EVIDENCE, fitting=True)
    if judged.criteria is None:
        return None, (), judged.error
    automatic = before.model_copy(
        update={
            "rubric": describe_rubric(rubric, "")["rubric"],
            "rubric_origin": before.rubric_origin if rubric.digest == before.rubric.digest else rubric.origin,
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
    return settler.settle(automatic, job.id, handed_in, before), judged.missing, ""


def _result_at(journal: Path, place: int) -> GradingResult:
    with journal.open("rb") as file:
        file.seek(place)
        return GradingResult.read_json(file.readline())


def _keep(journal: Path, result: GradingResult) -> None:
    """Keep a result that is about to be replaced, until `changes.csv` is written. Raises OutputError."""
    line = result.model_dump_json(by_alias=True).encode()
    flags = os.O_WRONLY | os.O_APPEND | os.O_CREAT | CLOEXEC
    with writing(journal), os.fdopen(os.open(journal, flags, FILE), "ab") as file:
        # a killed grader may have left half a line before it
        file.write(b"\n" + line + b"\n")


def write_changes(path: Path, regraded: Sequence[Regraded]) -> None:
    """Write a row for each criterion that changed. Raises OutputError."""
    atomic_write(path, csv_text([COLUMNS, *_rows(regraded)]).encode("utf-8"))


def _rows(regraded: Sequence[Regraded]) -> Iterator[tuple[str | float, ...]]:
    for one in regraded:
        for change in one.changes:
            before, after = change.before, change.after
            yield (
                one.id,
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
    again = [one.id for one in regraded if one.missing]
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
    entries = {entry.id: entry for entry in now.run.entries}
    after = tuple(_compare_run(now, entries[one.id], one) if one.missing else one for one in regraded)
    write_changes(folder.path / CHANGES, after)
    return now, after


def _compare_run(folder: BatchFolder, entry: Entry, one: Regraded) -> Regraded:
    result = folder.earlier(entry)
    if result is None:
        return replace(one, points=None, changes=(), error=NOT_AGAIN)
    failed = result.status == "error"
    return replace(
        one,
        points=result.points,
        changes=_changes(one.first, result),
        missing=one.missing if failed else (),
        error=NOT_AGAIN if failed else "",
    )
