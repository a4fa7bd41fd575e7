"""A batch's folder: `run.json`, and a folder of results for each submission."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from grader import __version__
from grader.classes.gradebook import Book, GradebookRow
from grader.errors import UsageError
from grader.files import whole_file
from grader.intake.names import folder_key, safe_name
from grader.model.batch import MISSING, ROSTER, UNPUBLISHED, BatchRun, Entry
from grader.model.result import (
    NO_TIME,
    CriterionResult,
    EnvironmentInfo,
    ErrorInfo,
    GradingResult,
    SubmissionInfo,
)
from grader.model.verdict import Status
from grader.model.version import RUN as RUN_FORMAT
from grader.model.version import UPDATE
from grader.results import EVIDENCE, finish_killed, read_result
from grader.untrusted_text import json_text

RUN = "run.json"
BYTES_MAX = 64 << 20
HINTS = {
    MISSING: "run `grader batch` again: it continues where it stopped",
    ROSTER: "correct the roster",
    UNPUBLISHED: "publish it with `grader publish`",
}


@dataclass(frozen=True)
class BatchFolder:
    """What a batch left in `path`, or is still writing while `run.state` is `running`."""

    path: Path
    run: BatchRun

    def folder_of(self, entry: Entry) -> Path:
        return self.path / safe_name(entry.id)

    def earlier(self, entry: Entry) -> GradingResult | None:
        """Return the entry's result; None if none can be read. Raises EvidenceError for a newer grader's."""
        return read_result(self.folder_of(entry))

    def refuse_newer(self) -> None:
        """Raise EvidenceError if a newer grader wrote one of the results: before anything is written beside it."""
        for entry in self.run.entries:
            self.earlier(entry)

    def has_evidence(self, entry: Entry) -> bool:
        return (self.folder_of(entry) / EVIDENCE).is_dir()

    def book(self) -> Book:
        """Return what the gradebook is about."""
        run = self.run
        return Book(
            title=run.title,
            rubric_id=run.rubric.id,
            max_points=run.max_points,
            criteria=tuple((c.id, c.title, c.max_points, c.extra) for c in run.criteria),
            columns=run.columns,
        )

    def rows(self) -> Iterator[GradebookRow]:
        """Yield every submission in the roster's order, read one by one; those that a faulty roster keeps from being
        graded come last. One without a result has one of status `error` here, which says so."""
        known = set()
        for entry in self.run.entries:
            known.add(folder_key(entry.id))
            result = self.earlier(entry)
            yield GradebookRow(
                entry=entry, result=result or self.empty_result(entry, MISSING, "not graded yet")
            )
        for fault in self.run.faults:
            if fault.id is not None and folder_key(fault.id) not in known:
                known.add(folder_key(fault.id))
                entry = Entry(
                    id=fault.id,
                    source="",
                    where=fault.where,
                    name=fault.name,
                    group=fault.group,
                    extra=fault.extra,
                )
                yield GradebookRow(entry=entry, result=self.empty_result(entry, ROSTER, str(fault)))

    def empty_result(self, entry: Entry, kind: str, message: str) -> GradingResult:
        """Return a result of status `error` that says why there is no other one, by one of the keys of `HINTS`."""
        return GradingResult(
            submission=SubmissionInfo.unopened(safe_name(entry.id), entry.source),
            rubric=self.run.rubric,
            status="error",
            points=0.0,
            max_points=self.run.max_points,
            criteria=tuple(
                CriterionResult.unmeasured(
                    id=criterion.id,
                    title=criterion.title,
                    status=Status.ERROR,
                    max_points=criterion.max_points,
                    extra=criterion.extra,
                    message="not judged",
                )
                for criterion in self.run.criteria
            ),
            environment=EnvironmentInfo(grader=__version__, ros="", python="", sandbox=""),
            timing=NO_TIME,
            error=ErrorInfo(kind=kind, message=message, hint=HINTS[kind]),
        )


def write_run(folder: Path, run: BatchRun) -> None:
    """Write `run.json`, one entry after the other: a class may have thousands. Raises OutputError."""
    whole = json_text(run.model_copy(update={"entries": ()}).model_dump(mode="json", by_alias=True))
    before, _, after = whole.rpartition("[]")  # the entries come last
    with whole_file(folder / RUN) as part, part.open("w", encoding="utf-8", newline="\n") as file:
        file.write(f"{before}[")
        for number, entry in enumerate(run.entries):
            row = json_text(entry.model_dump(mode="json", by_alias=True)).rstrip()
            file.write((",\n" if number else "\n") + f"    {row}".replace("\n", "\n    "))
        file.write(("\n  ]" if run.entries else "]") + after)


def open_batch(folder: Path) -> BatchFolder:
    """Return the batch in `folder`. Raises UsageError if there is none.

    A result that a killed program was just putting in place is put there first: else there would be none.
    """
    path = folder / RUN
    finish_killed(folder)
    try:
        # one that is too long is refused below: no bytes are no JSON
        data = path.read_bytes() if path.stat().st_size <= BYTES_MAX else b""
        return BatchFolder(folder, BatchRun.read_json(data))
    except FileNotFoundError as error:
        raise UsageError(
            f"{folder}: no batch was graded here: there is no {RUN}", hint="give the --out of `grader batch`"
        ) from error
    except OSError as error:
        raise UsageError(f"{path}: cannot be read: {error.strerror}") from error
    except ValueError as error:
        if newer := RUN_FORMAT.newer_in(data):
            raise UsageError(f"{path}: {newer}", hint=UPDATE) from error
        raise UsageError(
            f"{path}: not what this grader writes", hint="run `grader batch` once more into the same folder"
        ) from error
