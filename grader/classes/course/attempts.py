"""Several attempts of one student: each is graded as a class of its own, and what counts becomes the lab's result.

roster → rounds (all first attempts, all second ones, …) → a batch each, in `.attempts/<n>/` → which counts → the lab's
folder
"""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from grader.classes.batch.existing_results import Settler, rewrite
from grader.classes.batch.folder import BatchFolder, write_run
from grader.classes.batch.run import alone, ids_of, write_books
from grader.classes.overrides import FILE as OVERRIDES
from grader.classes.overrides import folder_key, read_overrides
from grader.files import make_folder
from grader.judging.settle import unsettled
from grader.judging.summary import total_fields
from grader.model.batch import Entry, Roster
from grader.model.result import Attempts, CriterionResult, GradingResult
from grader.results import read_result
from grader.rubric.course import Counts
from grader.rubric.load import LoadedRubric

FOLDER = ".attempts"


class Attempt(NamedTuple):
    """Which one it is, counted from 1, its row of the roster, its result, and the folder that has it."""

    number: int
    entry: Entry
    result: GradingResult
    folder: Path


def rounds(roster: Roster) -> tuple[Roster, ...]:
    """Return a roster of all first attempts, one of all second ones, and so on; of one student, by the time that the
    roster gives, else by the order of rows."""
    by_student: dict[str, list[Entry]] = {}
    for entry in (*roster.entries, *roster.again):
        by_student.setdefault(folder_key(entry.id), []).append(entry)
    for entries in by_student.values():
        if all(entry.submitted_at for entry in entries):
            entries.sort(key=lambda entry: str(entry.submitted_at))
    first_id = {key: entries[0].id for key, entries in by_student.items()}
    allowed = {entry.where for entry in roster.again}
    faults = tuple(fault for fault in roster.faults if fault.where not in allowed)
    most = max(map(len, by_student.values()), default=1)
    found = []
    for number in range(most):
        these = tuple(
            entries[number].model_copy(update={"id": first_id[key]})
            for key, entries in by_student.items()
            if len(entries) > number
        )
        update = {"entries": these, "again": (), "faults": () if number else faults}
        found.append(roster.model_copy(update=update))
    return tuple(found)


def attempt_folder(out: Path, number: int) -> Path:
    """Return the folder of the batch that grades all attempts of that number, counted from 1."""
    return out / FOLDER / str(number)


def combine(out: Path, batches: Sequence[BatchFolder], rubric: LoadedRubric, counts: Counts) -> BatchFolder:
    """Make the lab's results of what counts of each student's attempts, with what people decided; return its folder.

    Raises UsageError for faulty overrides, Busy if a batch works there, OutputError.
    """
    make_folder(out)
    with alone(out):
        run = batches[0].run
        overrides = read_overrides(out / OVERRIDES, rubric.rubric, ids_of(run))
        bringing = _Bringing(BatchFolder(out, run), rubric, Settler(rubric.rubric, overrides), counts)
        known = _by_student(batches)
        entries = tuple(bringing.bring(entry, known.get(folder_key(entry.id), ())) for entry in run.entries)
        now = run.model_copy(update={"entries": entries, "state": batches[-1].run.state})
        write_run(out, now)
        return write_books(BatchFolder(out, now), rubric.rubric, now.state, 0)


def _by_student(batches: Sequence[BatchFolder]) -> dict[str, list[Attempt]]:
    found: dict[str, list[Attempt]] = {}
    for number, batch in enumerate(batches, start=1):
        for entry in batch.run.entries:
            result = batch.earlier(entry)
            if result is not None:
                one = Attempt(number, entry, result, batch.folder_of(entry))
                found.setdefault(folder_key(entry.id), []).append(one)
    return found


@dataclass(frozen=True)
class _Bringing:
    """Brings what counts into the lab's folder."""

    folder: BatchFolder
    rubric: LoadedRubric
    settler: Settler
    counts: Counts

    def bring(self, entry: Entry, attempts: Sequence[Attempt]) -> Entry:
        """Copy the chosen attempt's folder, unless it is there already, and write the reports of what counts; return
        that attempt's row of the roster."""
        if not attempts:
            return entry
        one = chosen(attempts, self.counts)
        target = self.folder.folder_of(one.entry)
        earlier = read_result(target)
        automatic = unsettled(counting_result(attempts, self.counts, self.rubric), self.rubric.rubric)
        now = self.settler.settle(automatic, one.entry.id, one.result.handed_in, earlier or automatic)
        if now != earlier:
            shutil.rmtree(target, ignore_errors=True)
            shutil.copytree(one.folder, target, symlinks=True)
            rewrite(target, now, self.rubric.rubric, self.rubric.docs)
        return one.entry


def chosen(attempts: Sequence[Attempt], counts: Counts) -> Attempt:
    """Return the attempt that counts; of several with as many points the first, which took the fewest late days. One
    that could not be graded counts only where none could."""
    graded = [one for one in attempts if one.result.status != "error"] or attempts
    return graded[-1] if counts == "last" else max(graded, key=lambda one: (one.result.points, -one.number))


def counting_result(attempts: Sequence[Attempt], counts: Counts, rubric: LoadedRubric) -> GradingResult:
    """Return the automatic result that counts, with what became of all attempts.

    By criterion, each one is taken from the attempt in which it earned most, and says from which.
    """
    number, _, result, _ = chosen(attempts, counts)
    points = tuple(one.result.points if one.result.status != "error" else None for one in attempts)
    lab = rubric.rubric
    if counts == "by-criterion":
        judged = [(one.number, {c.id: c for c in unsettled(one.result, lab).criteria}) for one in attempts]
        criteria = tuple(_best(c, number, judged) for c in unsettled(result, lab).criteria)
        result = result.model_copy(
            update={"criteria": criteria, **total_fields(lab, criteria), "overrides": ()}
        )
    told = Attempts(counts=counts, chosen=number, points=points)
    return result.model_copy(update={"attempts": told})


def _best(
    criterion: CriterionResult, number: int, attempts: Sequence[tuple[int, dict[str, CriterionResult]]]
) -> CriterionResult:
    known = [(n, criteria[criterion.id]) for n, criteria in attempts if criterion.id in criteria]
    better = [(n, one) for n, one in known if not one.status.is_open and one.points > criterion.points]
    if not better:
        return criterion
    best = max(better, key=lambda one: (one[1].points, one[0]))
    if best[0] == number:
        return criterion
    return best[1].model_copy(update={"message": f"in attempt {best[0]}: {best[1].message}".rstrip(": ")})
