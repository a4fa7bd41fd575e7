"""A class judged again from its evidence by a rubric that may be another one: nothing is run.

evidence, rubric → criteria → settled → reports and gradebook, and a table of what changed
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from grader import __version__
from grader.classes.batch.folder import BatchFolder, write_run
from grader.classes.batch.job import Hands, Sandbox
from grader.classes.batch.pool import side_by_side, workers, working
from grader.classes.batch.reports import Settler, rewrite
from grader.classes.batch.run import BatchOptions, Watcher, alone, described, ids_of, run_batch, write_books
from grader.classes.overrides import FILE as OVERRIDES
from grader.classes.overrides import read_overrides
from grader.errors import EvidenceError, GraderError
from grader.evidence.reader import SUFFIXES, load_evidence
from grader.evidence.run import Run
from grader.files import atomic_write
from grader.judging import judge
from grader.judging.summary import overall_status, total_points
from grader.model.result import CriterionResult, GradingResult
from grader.model.roster import Entry, Roster
from grader.report.text import csv_text
from grader.results import EVIDENCE
from grader.rubric.load import LoadedRubric
from grader.rubric.model import Rubric

CHANGES = "changes.csv"
COLUMNS = ("id", "criterion", "status before", "status", "points before", "points", "max_points", "why")


@dataclass(frozen=True, kw_only=True)
class Change:
    """One criterion that came to something else. One that is new has no `before`, one that is gone no `after`."""

    criterion: str
    before: CriterionResult | None
    after: CriterionResult | None

    @property
    def why(self) -> str:
        """What the check says now."""
        if self.after is None:
            return "the rubric has it no more"
        return self.after.message or self.after.measured or self.after.title


@dataclass(frozen=True, kw_only=True)
class Regraded:
    """One submission: its result before and after, and the scenarios of which there is no recording that fits.

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
        old = {c.id: c for c in self.before.criteria}
        new = {c.id: c for c in self.after.criteria}
        names = [*new, *(name for name in old if name not in new)]
        found = (Change(criterion=n, before=old.get(n), after=new.get(n)) for n in names)
        return tuple(change for change in found if _differs(change))


def _differs(change: Change) -> bool:
    before, after = change.before, change.after
    if before is None or after is None:
        return True
    return (before.status, before.points, before.max_points) != (after.status, after.points, after.max_points)


def regrade(
    folder: BatchFolder, rubric: LoadedRubric, rubric_source: str, jobs: int
) -> tuple[BatchFolder, tuple[Regraded, ...]]:
    """Judge every submission of the batch again; gives the folder as it is now and what became of each, in order.

    Writes each `result.json` with its reports, `run.json`, `results.jsonl`, `gradebook.csv` and `changes.csv`.
    Raises UsageError for faulty overrides, EvidenceError where a newer grader has written there, Busy where a batch
    works in the folder, OutputError.
    """
    with alone(folder.path):
        folder.refuse_newer()
        entries = folder.run.entries
        overrides = read_overrides(folder.path / OVERRIDES, rubric.rubric, ids_of(folder.run))
        settler = Settler(rubric.rubric, overrides)
        by_folder = {folder.folder_of(entry): entry for entry in entries if folder.has_evidence(entry)}
        found = {
            judged.folder: _regraded(folder, rubric, settler, by_folder[judged.folder.parent], judged)
            for judged in judge_all([path / EVIDENCE for path in by_folder], rubric, jobs, fitting=True)
        }
        regraded = tuple(
            found.get(folder.folder_of(entry) / EVIDENCE) or _without_evidence(folder, rubric, settler, entry)
            for entry in entries
        )
        run = folder.run.model_copy(update=described(rubric, rubric_source) | {"grader": __version__})
        now = BatchFolder(folder.path, run)
        write_run(now.path, now.run)
        write_changes(folder.path / CHANGES, regraded)
        return write_books(now, rubric.rubric, run.state, run.counts.kept, ended_at=run.ended_at), regraded


def _regraded(
    folder: BatchFolder, rubric: LoadedRubric, settler: Settler, entry: Entry, judged: Judged
) -> Regraded:
    before = folder.earlier(entry)
    if before is None or judged.criteria is None:
        return Regraded(entry=entry, before=before, after=None, error=judged.error or "it has no result")
    automatic = before.model_copy(
        update={
            "rubric": described(rubric, "")["rubric"],
            "criteria": judged.criteria,
            "status": overall_status(judged.criteria),
            "points": total_points(rubric.rubric, judged.criteria),
            "max_points": rubric.rubric.max_points,
            "environment": before.environment.model_copy(update={"grader": __version__}),
            "overrides": (),
            "handed_in": None,
            "late": None,
            "error": None,
        }
    )
    handed_in = before.handed_in and before.handed_in.model_copy(
        update={"deadline": None}
    )  # the rubric's of today
    after = settler.settled(automatic, entry.id, handed_in, before)
    try:
        if after != before:
            rewrite(folder.folder_of(entry), after, rubric.rubric, rubric.docs)
    except GraderError as error:
        return Regraded(entry=entry, before=before, after=None, error=error.message)
    return Regraded(entry=entry, before=before, after=after, missing=judged.missing)


def _without_evidence(folder: BatchFolder, rubric: LoadedRubric, settler: Settler, entry: Entry) -> Regraded:
    """What could not be graded has what people gave for it."""
    before = folder.earlier(entry)
    error = before.error.message if before is not None and before.error else "nothing was recorded"
    if before is not None and (settler.of(entry.id) or before.overrides):
        rewrite(folder.folder_of(entry), settler.again(before, entry.id, None), rubric.rubric, rubric.docs)
    return Regraded(entry=entry, before=before, after=None, error=error)


def write_changes(path: Path, regraded: Sequence[Regraded]) -> None:
    """Each criterion that changed, a row each. Raises OutputError."""
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
    hands: Hands,
    watcher: Watcher,
    sandbox: Sandbox,
) -> tuple[BatchFolder, tuple[Regraded, ...]]:
    """Grade anew, of the same commits, what has scenarios that were not recorded; gives what `regrade` gives.

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
    now = run_batch(roster, folder.run.rubric_source, rubric, options, hands=hands, watcher=watcher)
    after = tuple(_run_again(now, one) if one.missing else one for one in regraded)
    write_changes(folder.path / CHANGES, after)
    return now, after


def _run_again(folder: BatchFolder, one: Regraded) -> Regraded:
    result = folder.earlier(one.entry)
    failed = result is None or result.status == "error"
    return Regraded(
        entry=one.entry,
        before=one.before,
        after=result,
        missing=one.missing if failed else (),
        error="it could not be run again" if failed else "",
    )


# [classes.batch.judging] Recorded submissions judged again, many at a time, in worker processes. Needs no ROS.

EVIDENCE, RESULT, PACKAGE = "evidence", "result.json", "package.mcap"
SCENARIO = "scenario.digest"


@dataclass(frozen=True, kw_only=True)
class Judged:
    """One submission's criteria, or in one line why there are none, and what to do about it.

    `missing` are the rubric's scenarios of which there is no recording that fits.
    """

    folder: Path
    criteria: tuple[CriterionResult, ...] | None
    missing: tuple[str, ...] = ()
    error: str = ""
    hint: str = ""


def judge_all(
    folders: Sequence[Path], rubric: LoadedRubric, jobs: int, *, fitting: bool = False
) -> Iterator[Judged]:
    """Every submission's evidence judged again, each as it comes, `jobs` at a time.

    With `fitting`, a recording counts only where the rubric's scenario is still the one that was run.
    What is wrong with one of them is in its `error` and stops no other, not even where it ends the worker.
    """
    left = dict.fromkeys(folders)
    while left:
        begun: list[Path] = []
        work = partial(_judged, rubric, fitting)
        for judged in _until_broken(tuple(left), work, jobs, begun.append):
            del left[judged.folder]
            yield judged
        for suspect in [folder for folder in begun if folder in left]:
            del left[suspect]
            yield from tuple(_until_broken([suspect], work, 1)) or [_ended(suspect)]


def _until_broken(
    folders: Sequence[Path],
    work: Callable[[Path], Judged],
    jobs: int,
    begun: Callable[[Path], None] = lambda _: None,
) -> Iterator[Judged]:
    """Ends early where a worker ends: on one of those that were begun, nobody knows which."""
    count = max(1, min(jobs, len(folders)))
    try:
        with workers(count) as pool:
            yield from side_by_side(pool, work, folders, most=2 * count, begun=begun)
    except BrokenProcessPool:
        return


def _ended(folder: Path) -> Judged:
    hint = "look whether the machine has too little memory, and judge it by itself"
    return Judged(folder=folder, criteria=None, error=f"{folder}: judging it ended the process", hint=hint)


def _judged(rubric: LoadedRubric, fitting: bool, folder: Path) -> Judged:
    """In a worker."""
    with working():
        try:
            runs = load_evidence([folder])
            runs = fitting_runs(rubric.rubric, runs) if fitting else runs
            criteria = judge(rubric.rubric, runs, rubric.checks)
        except GraderError as error:
            return Judged(folder=folder, criteria=None, error=error.message, hint=error.hint)
        except Exception as error:  # noqa: BLE001 - whatever it is, the others are judged
            message = f"{folder}: internal error: {type(error).__name__}: {error}"
            return Judged(folder=folder, criteria=None, error=message, hint="judge it by itself with --debug")
        missing = tuple(name for name in asked_for(rubric.rubric) if name not in runs)
        return Judged(folder=folder, criteria=criteria, missing=missing)


def fitting_runs(rubric: Rubric, runs: Mapping[str, Run]) -> dict[str, Run]:
    """Those that were recorded as the rubric's scenarios say; evidence that does not tell counts as such."""
    digests = {name: scenario.digest for name, scenario in rubric.scenarios.items()}
    return {
        name: run
        for name, run in runs.items()
        if run.metadata.get(SCENARIO, digests.get(name)) == digests.get(name)
    }


def asked_for(rubric: Rubric) -> tuple[str, ...]:
    """The scenarios that criteria judge."""
    return tuple(dict.fromkeys(c.scenario for c in rubric.criteria if c.scenario is not None))


def submissions_in(paths: Sequence[Path]) -> tuple[Path, ...]:
    """The submissions' folders that these paths stand for, where they stand for several submissions; else none.

    A folder of results stands for every submission in it. Raises EvidenceError where something else is among them.
    """
    whole = [path for path in paths if _is_result(path)]
    held = {path: _held(path) for path in paths if path not in whole}
    found = [*whole, *(folder for folders in held.values() for folder in folders)]
    if len(whole) < 2 and len(found) == len(whole):
        return ()
    for path, folders in held.items():
        if not folders:
            message = f"{path}: not the folder of a submission's results, as the others are"
            raise EvidenceError(message, hint="judge it by itself")
    return tuple(dict.fromkeys(found))


def _held(folder: Path) -> list[Path]:
    """The submissions in a folder of results; a folder of recordings is none."""
    try:
        if not folder.is_dir() or _has_recordings(folder):
            return []
        inside = [path for path in sorted(folder.iterdir()) if not path.name.startswith(".")]
        return [path for path in inside if _is_result(path) or _has_recordings(path)]
    except OSError as error:
        raise EvidenceError(f"{folder}: {error.strerror or type(error).__name__}") from error


def _is_result(folder: Path) -> bool:
    """What `grade` leaves of one submission, or its evidence alone."""
    return (folder / RESULT).is_file() or (folder / PACKAGE).is_file() or _has_recordings(folder / EVIDENCE)


def _has_recordings(folder: Path) -> bool:
    return folder.is_dir() and any(path.suffix in SUFFIXES for path in folder.iterdir())
