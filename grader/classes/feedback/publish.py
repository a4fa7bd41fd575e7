"""Results are drafts until they are published: then they are frozen, as marks and as the student reads them.

`plan` says what would be published, `publish` does it, `published_rows` gives a gradebook what counts, and
`changes_between` says in words what has changed: `85 → 95: override by ann, clear names (style)`.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import datetime, timezone
from functools import partial
from pathlib import Path
from typing import Literal

from pydantic import ValidationError

from grader.classes.batch.folder import BatchFolder
from grader.classes.batch.regrade import compare_criteria, states_of
from grader.classes.batch.renew_results import figures_in
from grader.classes.batch.run import hold_folder
from grader.classes.feedback.forms import PAGE, TEXT
from grader.classes.gradebook import GradebookRow
from grader.errors import EvidenceError, GraderError, UsageError
from grader.files import atomic_write, make_folder, read_given
from grader.intake.names import safe_name
from grader.model.batch import UNPUBLISHED, Entry, Publication
from grader.model.result import AppliedOverride, GradingResult
from grader.model.version import PUBLISHED as FORMAT
from grader.model.version import UPDATE
from grader.report.files import result_bytes
from grader.report.forms import FORMS, ReportInput
from grader.report.view import for_student, is_students_fault, not_graded
from grader.results import RESULT, read_result
from grader.rubric.load import LoadedRubric
from grader.wording import did_you_mean, join_words, number, plural
from grader.workers import WorkerEnded, run_each

FILE, FOLDER = "published.jsonl", ".published"
NAME_CHARS = 16  # of the digest: enough to tell one student's publications apart
PublishState = Literal["new", "changed", "same", "draft"]
WORDING = "the words of the report, and no points"


@dataclass(frozen=True)
class Published:
    """What of the class in `path` is published; `history` has the publications of each submission, by its folder."""

    path: Path
    history: dict[str, list[Publication]]

    def of(self, entry: Entry) -> Sequence[Publication]:
        """Return the submission's publications, the one that counts last; none if it is a draft."""
        return self.history.get(safe_name(entry.id), ())

    def folder(self, publication: Publication) -> Path:
        """Return where a frozen result lies, with the student's reports; what lies there never changes."""
        return self.path / FOLDER / safe_name(publication.id) / publication.digest[:NAME_CHARS]

    def result(self, entry: Entry) -> GradingResult | None:
        """Return the result that is published. Raises EvidenceError if it cannot be read."""
        found = self.of(entry)
        if not found:
            return None
        folder = self.folder(found[-1])
        result = read_result(folder)
        if result is None:
            hint = "restore it, or publish it again with --only"
            raise EvidenceError(f"{folder / RESULT}: what was published cannot be read", hint=hint)
        return result


@dataclass(frozen=True, kw_only=True)
class PublishStep:
    """What publishing does with one submission. `why` says why it is a draft, or why it could not be published."""

    entry: Entry
    state: PublishState
    result: GradingResult | None = None
    changes: tuple[str, ...] = ()
    why: str = ""
    failed: bool = False


def read_published(path: Path) -> Published:
    """Read what is published of the class in `path`. Raises UsageError for what no grader wrote, or a newer one."""
    file, history = path / FILE, dict[str, list[Publication]]()
    for place, row in enumerate(read_rows(file), start=1):
        try:
            publication = Publication.read_json(row)
        except ValidationError as error:
            if newer := FORMAT.newer_in(row):
                raise UsageError(f"{file}:{place}: {newer}", hint=UPDATE) from error
            hint = "restore it: without it, there is no record of what was published"
            raise UsageError(f"{file}:{place}: not what this grader writes", hint=hint) from error
        history.setdefault(safe_name(publication.id), []).append(publication)
    return Published(path, history)


def read_rows(path: Path) -> list[bytes]:
    """Return the lines of a file, none if there is no such file. Raises UsageError."""
    return (read_given(path) or b"").splitlines() if os.path.lexists(path) else []


def check_only(folder: BatchFolder, only: Sequence[str]) -> frozenset[str]:
    """Return the folders' names of these ids; of no ids, of all. Raises UsageError for an id that is not there."""
    known = {safe_name(entry.id): entry.id for entry in folder.run.entries}
    for name in only:
        if safe_name(name) not in known:
            near = did_you_mean(name, known.values())
            raise UsageError(f"--only {name[:80]}: no submission of that id{near}")
    return frozenset(map(safe_name, only)) or frozenset(known)


def plan(folder: BatchFolder, published: Published, only: Sequence[str] = ()) -> Iterator[PublishStep]:
    """Yield what publishing does with each submission, in the roster's order; with `only`, with these.

    What is still open, or could not be graded for no fault of the student's, stays a draft unless it is named.
    """
    names = check_only(folder, only)
    for entry in folder.run.entries:
        if safe_name(entry.id) not in names:
            continue
        result = folder.earlier(entry)
        why = _draft(result, named=bool(only))
        if why or result is None:
            yield PublishStep(entry=entry, state="draft", result=result, why=why)
            continue
        before = published.result(entry)
        changes = changes_between(before, result) if before else ()
        # other words alone are no reason to publish again, unless this student is named
        if before and not changes and only and digest_of(before) != digest_of(result):
            changes = (WORDING,)
        state: PublishState = "changed" if changes else "same" if before else "new"
        yield PublishStep(entry=entry, state=state, result=result, changes=changes)


def _draft(result: GradingResult | None, *, named: bool) -> str:
    """Return why a result stays a draft; empty where it can be published."""
    if result is None:
        return "not graded yet"
    if named or result.status == "graded" or is_students_fault(result):
        return ""
    if result.error is not None:
        return f"could not be graded: {result.error.message}"
    waiting = [c.id for c in result.criteria if c.status.is_open and c.counts]
    return f"not decided yet: {join_words(waiting)}"


def digest_of(result: GradingResult) -> str:
    """Return the sha256 of the result's file."""
    return hashlib.sha256(result_bytes(result)).hexdigest()


@dataclass(frozen=True, kw_only=True)
class Publishing:
    """How a class is published: by whom, and which criteria students see without a word."""

    by: str = ""
    hidden: frozenset[str] = frozenset()
    only: Sequence[str] = ()
    jobs: int = 1


def publish(folder: BatchFolder, rubric: LoadedRubric, how: Publishing) -> tuple[PublishStep, ...]:
    """Publish what `plan` says; return what was done. What is ready when this is interrupted is published.

    Raises UsageError if the class was judged by another rubric, Busy if a batch works in the folder or feedback is
    being sent, OutputError, KeyboardInterrupt.
    """
    refuse_other_rubric(folder, rubric, "publish it")
    make_folder(folder.path / FOLDER)
    # sending holds the second one alone, so that a class can be graded while it lasts
    with hold_folder(folder.path), hold_folder(folder.path / FOLDER, "feedback is being sent"):
        published = read_published(folder.path)
        steps = list(plan(folder, published, how.only))
        jobs = {}
        for place, step in enumerate(steps):
            if step.state in ("new", "changed"):
                jobs[place] = _job(folder, published, how, step)
        done: list[Publication] = []
        try:
            write = partial(_try_write, rubric)
            for place, error in run_each(write, jobs.items(), min(how.jobs, len(jobs)), ended=_worker_ended):
                if error:
                    steps[place] = replace(steps[place], why=error, failed=True)
                else:
                    done.append(jobs[place].publication)
        # also after Ctrl-C: whatever is frozen by then is published, in the roster's order
        finally:
            _append(folder.path / FILE, sorted(done, key=[j.publication for j in jobs.values()].index))
    return tuple(steps)


def refuse_other_rubric(folder: BatchFolder, rubric: LoadedRubric, then: str) -> None:
    """Raise UsageError unless the class was judged by this rubric, by which its reports are written; `then` is what to
    do once it is."""
    if rubric.digest != folder.run.rubric.digest:
        raise UsageError(
            f"{folder.run.rubric_source}: the rubric has changed since the class was graded",
            hint=f"grader regrade {folder.path} judges it by today's rubric; then {then}",
        )


@dataclass(frozen=True, kw_only=True)
class StudentReports:
    """A result that is written `into` a folder with its student's reports; figures have their data in `evidence`."""

    publication: Publication
    result: GradingResult
    evidence: Path
    into: Path
    changes: tuple[str, ...]
    hidden: frozenset[str]


def _job(folder: BatchFolder, published: Published, how: Publishing, step: PublishStep) -> StudentReports:
    assert step.result is not None  # noqa: S101 - only a draft has none
    before = published.result(step.entry)
    changes = (changes_between(before, step.result, how.hidden) or (WORDING,)) if before else ()
    publication = publication_of(step.entry, step.result, by=how.by, changes=changes)
    return StudentReports(
        publication=publication,
        result=step.result,
        evidence=folder.folder_of(step.entry),
        into=published.folder(publication),
        changes=history_words([*published.of(step.entry), publication]),
        hidden=how.hidden,
    )


def publication_of(
    entry: Entry, result: GradingResult, *, by: str = "", changes: tuple[str, ...] = ()
) -> Publication:
    """Return the line that says that this result is published."""
    return Publication(
        id=entry.id,
        at=datetime.now(timezone.utc),
        by=by,
        status=result.status,
        points=result.points,
        max_points=result.max_points,
        digest=digest_of(result),
        changes=changes,
    )


def history_words(history: Sequence[Publication]) -> tuple[str, ...]:
    """Return all changes since the first publication, each with its day."""
    return tuple(f"{one.at:%Y-%m-%d}: {change}" for one in history for change in one.changes)


def _worker_ended(job: tuple[int, StudentReports], error: WorkerEnded) -> tuple[int, str]:
    return job[0], f"the process that wrote its reports {error.reason}"


def _try_write(rubric: LoadedRubric, job: tuple[int, StudentReports]) -> tuple[int, str]:
    """In a worker: return the job's place, and why it could not be done, empty if it was."""
    place, wanted = job
    try:
        write_student_reports(rubric, wanted)
    except GraderError as error:
        return place, error.message
    except Exception as error:  # noqa: BLE001 - whatever it is, the others are published
        return place, f"internal error: {type(error).__name__}: {error}"
    return place, ""


def write_student_reports(rubric: LoadedRubric, job: StudentReports) -> None:
    """Write a result and the student's reports of it. Raises OutputError."""
    shown = for_student(job.result, job.hidden)
    about = ReportInput(
        result=shown,
        rubric=rubric.rubric,
        docs=rubric.docs,
        changes=job.changes,
        load_figures=lambda: figures_in(job.evidence, shown, rubric.rubric),
    )
    # the result last: where it is, the reports are whole
    for name, form in ((TEXT, "markdown"), (PAGE, "html")):
        atomic_write(job.into / name, FORMS[form].render(about))
    atomic_write(job.into / RESULT, result_bytes(job.result))


def _append(path: Path, lines: Sequence[Publication]) -> None:
    if lines:
        before = path.read_bytes() if path.exists() else b""
        new = "".join(f"{line.model_dump_json(by_alias=True)}\n" for line in lines)
        atomic_write(path, before + new.encode())


def published_rows(folder: BatchFolder, published: Published) -> Iterator[GradebookRow]:
    """Yield the class's rows with what is published; what is not has a result of status `error` that says so."""
    for row in folder.rows():
        result = published.result(row.entry)
        if result is None and row.result.error is not None and row.result.error.kind == "roster":
            yield row
        else:
            empty = result or folder.empty_result(row.entry, UNPUBLISHED, "not published yet")
            yield GradebookRow(entry=row.entry, result=empty)


def publication_remarks(folder: BatchFolder, published: Published) -> Iterator[str]:
    """Yield what a reader of the published marks has to know: what is not published, or has changed since."""
    if not published.history:
        yield f"these are drafts: nothing of this class is published yet (grader publish {folder.path})"
        return
    empty = [entry.id for entry in folder.run.entries if not published.of(entry)]
    if empty:
        yield f"left empty, because it is not published (grader publish {folder.path}): {join_words(empty)}"
    if changed := sum(step.state == "changed" for step in plan(folder, published)):
        yield (
            f"{changed} changed after they were published and stand here as published; "
            f"grader publish {folder.path} --dry-run shows the changes"
        )


def changes_between(
    before: GradingResult, after: GradingResult, hidden: Collection[str] = ()
) -> tuple[str, ...]:
    """Return a line for the points if one thing changed, else one for the points and one for each change; none if the
    marks and all that people said of them are the same. Criteria of the ids in `hidden` are counted and not named."""
    points = f"{_total(before)} → {_total(after)}" if _total(before) != _total(after) else ""
    causes = [*_whole(before, after)]
    if not_graded(before) == not_graded(after):
        causes = [*_criteria(before, after, hidden), *causes]
    if len(causes) == 1 and points:
        return (f"{points}: {causes[0]}",)
    return tuple(line for line in (points, *causes) if line)


def _total(result: GradingResult) -> str:
    if not_graded(result):
        return "not graded"
    return number(result.points) + (" (not decided yet)" if result.status == "inconclusive" else "")


def _criteria(before: GradingResult, after: GradingResult, hidden: Collection[str]) -> Iterator[str]:
    overrides = [{o.criterion: o for o in result.overrides} for result in (before, after)]
    unseen = 0
    for change in compare_criteria(states_of(before), after):
        was, now = (found.get(change.criterion) for found in overrides)
        decided, same = _decision(was) != _decision(now), change.before == change.after
        if not decided and same:
            continue
        if change.criterion in hidden:
            unseen += 1
        elif same and _is_answer(was, now):
            yield f"request answered ({change.criterion})"
        elif decided:
            yield f"{_override(now)} ({change.criterion})"
        else:
            yield f"judged again ({change.criterion}): {change.why}"
    if unseen:
        yield f"{plural(unseen, 'criterion', 'criteria')} that your course does not show"


def _decision(override: AppliedOverride | None) -> tuple[object, ...]:
    return (override.points, override.comment, override.author, override.answer) if override else ()


def _is_answer(was: AppliedOverride | None, now: AppliedOverride | None) -> bool:
    """Return whether a decision answers a student, and says nothing else that is new."""
    before = (was.answer, was.comment) if was else ("", "")
    return now is not None and now.answer not in ("", before[0]) and now.comment == before[1]


def _override(override: AppliedOverride | None) -> str:
    if override is None:
        return "an override was taken back"
    comment = f", {override.comment}" if override.comment else ""
    return f"{'override' if override.awards else 'note'} by {override.author or 'a person'}{comment}"


def _whole(before: GradingResult, after: GradingResult) -> Iterator[str]:
    late, was = (
        r.late.text if r.late and r.late.points != r.late.points_before else "" for r in (after, before)
    )
    if late != was:
        yield late or "no late penalty"
    if before.gate != after.gate:
        gate = after.gate
        yield (
            f"no more than {number(gate.at_most)} points without a criterion" if gate else "no gate any more"
        )
    if before.error != after.error and after.error is not None:
        yield after.error.message
    if before.submission.commit != after.submission.commit:
        yield f"commit {(after.submission.commit or 'unknown')[:7]} was graded"
    if before.rubric.digest != after.rubric.digest and before.max_points != after.max_points:
        yield f"out of {number(after.max_points)} points, not {number(before.max_points)}"
