"""Returns feedback to a class, one student after the other; what is interrupted goes on where it stopped.

published.jsonl → `select` → to be sent │ sent before │ not known → `deliver` → sent.jsonl

Lines of `sent.jsonl` are appended, each flushed to the disk. One that was torn by a crash is passed over: the one
before it says that sending was begun, and not how it ended.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import datetime, timezone
from functools import partial
from pathlib import Path

from pydantic import ValidationError

from grader.classes.batch.folder import BatchFolder
from grader.classes.batch.run import hold_folder
from grader.classes.feedback.forms import Feedback, FeedbackForm, Sender, Unsure
from grader.classes.feedback.publish import (
    FOLDER,
    Freezing,
    Published,
    check_only,
    freeze,
    history_words,
    plan,
    publication_of,
    read_published,
    read_rows,
    refuse_other_rubric,
)
from grader.errors import NotSent, UsageError
from grader.files import FILE as PRIVATE
from grader.files import temporary_folder, unwritable
from grader.intake.names import safe_name
from grader.model.batch import Entry, Publication, Sent, SentState
from grader.model.version import SENT, UPDATE
from grader.portable import BINARY, CLOEXEC, NOFOLLOW
from grader.report.view import hidden_ids
from grader.results import read_result
from grader.rubric.load import LoadedRubric
from grader.workers import WorkerEnded, run_each

FILE = "sent.jsonl"


class SentLog:
    """What was sent of the class in `folder` by one form, or by any if `form` is empty.

    Raises UsageError if a newer grader wrote of it.
    """

    def __init__(self, folder: Path, form: str) -> None:
        self.path, self.form = folder / FILE, form
        self._lines: dict[str, list[Sent]] = {}
        for number, row in enumerate(read_rows(self.path), start=1):
            if newer := SENT.newer_in(row):
                raise UsageError(f"{self.path}:{number}: {newer}", hint=UPDATE)
            try:
                self._remember(Sent.read_json(row))
            except ValidationError:
                continue

    def state(self, publication: Publication) -> SentState | None:
        """Return the last that is known of this publication; None if it was never begun."""
        same = [line.state for line in self._of(publication.id) if line.digest == publication.digest]
        return same[-1] if same else None

    def last_place(self, submission: str) -> str:
        """Return where this student's feedback went last; empty if none was sent."""
        return next((line.place for line in reversed(self._of(submission)) if line.state == "sent"), "")

    def add(
        self, publications: Sequence[Publication], state: SentState, *, place: str = "", message: str = ""
    ) -> None:
        """Append a line for each of them. Raises OutputError."""
        lines = [
            Sent(
                id=one.id,
                form=self.form,
                digest=one.digest,
                at=datetime.now(timezone.utc),
                state=state,
                place=place,
                message=message,
            )
            for one in publications
        ]
        text = "".join(f"{line.model_dump_json(by_alias=True)}\n" for line in lines)
        try:
            self._append(text.encode())
        except OSError as error:
            raise unwritable(self.path, error) from error
        for line in lines:
            self._remember(line)

    def _append(self, data: bytes) -> None:
        flags = os.O_RDWR | os.O_CREAT | os.O_APPEND | CLOEXEC | NOFOLLOW | BINARY
        with os.fdopen(os.open(self.path, flags, PRIVATE), "r+b", buffering=0) as file:
            if file.seek(0, os.SEEK_END) and file.seek(-1, os.SEEK_END) >= 0 and file.read(1) != b"\n":
                data = b"\n" + data
            file.write(data)
            os.fsync(file.fileno())

    def _of(self, submission: str) -> list[Sent]:
        return self._lines.get(safe_name(submission), [])

    def _remember(self, line: Sent) -> None:
        if self.form in ("", line.form):
            self._lines.setdefault(safe_name(line.id), []).append(line)


UNKNOWN = "it is not known whether it was sent: the earlier run was stopped at that moment"


@dataclass(frozen=True, kw_only=True)
class Recipients:
    """Whose feedback is sent: of these ids, of what was published after a time.

    With `again` it is sent to those who have it, too. With `drafts`, the class's rubric, results are taken as they are
    now, published or not.
    """

    only: Sequence[str] = ()
    changed_since: datetime | None = None
    again: bool = False
    drafts: LoadedRubric | None = None


@dataclass(frozen=True, kw_only=True)
class Selection:
    """`todo` is to be sent. `before` were sent already, `unpublished` are drafts; `older` were published earlier than
    asked for."""

    todo: tuple[Feedback, ...]
    before: tuple[str, ...] = ()
    older: tuple[str, ...] = ()
    unpublished: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class SendFailure:
    """Why one student got nothing."""

    id: str
    message: str
    hint: str = ""


@dataclass(kw_only=True)
class Delivery:
    """What became of a selection."""

    sent: list[str] = field(default_factory=list)
    failures: list[SendFailure] = field(default_factory=list)


@dataclass(frozen=True, kw_only=True)
class _Class:
    """What every part of a run knows. `jobs` is how many reports are written side by side."""

    folder: BatchFolder
    published: Published
    log: SentLog
    wanted: Recipients
    jobs: int


@contextmanager
def open_selection(
    folder: BatchFolder, form: FeedbackForm, wanted: Recipients, *, jobs: int
) -> Iterator[tuple[Selection, SentLog]]:
    """Hold the class's feedback and give what is to be sent, and the log of what was.

    Raises UsageError if nothing is published, or for an unknown id; Busy if other feedback is being sent.
    """
    published = read_published(folder.path)
    if not published.history and wanted.drafts is None:
        raise UsageError(
            f"{folder.path}: nothing of this class is published, so there is nothing to return",
            hint=f"grader publish {folder.path}; or --drafts to return results as they are now",
        )
    check_only(folder, wanted.only)
    place = folder.path / FOLDER if published.history else folder.path
    with (
        hold_folder(place, "other feedback is being sent, or a class published,"),
        temporary_folder("run") as room,
    ):
        log = SentLog(folder.path, form.name)
        about = _Class(
            folder=folder, published=read_published(folder.path), log=log, wanted=wanted, jobs=jobs
        )
        yield _select(about, room), log


def _select(about: _Class, room: Path) -> Selection:
    names = check_only(about.folder, about.wanted.only)
    entries = [entry for entry in about.folder.run.entries if safe_name(entry.id) in names]
    published = about.published
    if about.wanted.drafts is None:
        made = {e.id: (p[-1], published.folder(p[-1])) for e in entries if (p := published.of(e))}
    else:
        made = _drafts(about, about.wanted.drafts, room)
    todo, before, older, unpublished = list[Feedback](), list[str](), list[str](), list[str]()
    since = about.wanted.changed_since
    for entry in entries:
        if entry.id not in made:
            unpublished.append(entry.id)
            continue
        publication, place = made[entry.id]
        if since is not None and publication.at <= since:
            older.append(entry.id)
        elif about.log.state(publication) == "sent" and not about.wanted.again:
            before.append(entry.id)
        else:
            todo.append(_feedback(about, entry, publication, place))
    return Selection(
        todo=tuple(todo), before=tuple(before), older=tuple(older), unpublished=tuple(unpublished)
    )


def _feedback(about: _Class, entry: Entry, publication: Publication, place: Path) -> Feedback:
    result = read_result(place)
    return Feedback(
        entry=entry,
        publication=publication,
        name=safe_name(entry.id),
        title=about.folder.run.title,
        folder=place,
        commit=(result.submission.commit if result else None) or "",
        last_place=about.log.last_place(entry.id),
    )


def _drafts(about: _Class, rubric: LoadedRubric, room: Path) -> dict[str, tuple[Publication, Path]]:
    """Return the reports of results as they are now, written into `room`, by the student's id."""
    refuse_other_rubric(about.folder, rubric)
    wanted = [
        Freezing(
            publication=publication_of(step.entry, step.result),
            result=step.result,
            evidence=about.folder.folder_of(step.entry),
            into=room / safe_name(step.entry.id),
            changes=history_words(about.published.of(step.entry)),
            hidden=hidden_ids(rubric.rubric),
        )
        for step in plan(about.folder, about.published, about.wanted.only)
        if step.result is not None and step.state != "draft"
    ]
    jobs = min(about.jobs, len(wanted))
    for failed in filter(None, run_each(partial(_freeze_draft, rubric), wanted, jobs, ended=_freezing_ended)):
        raise NotSent(failed)
    return {one.publication.id: (one.publication, one.into) for one in wanted}


def _freeze_draft(rubric: LoadedRubric, job: Freezing) -> str:
    """In a worker."""
    freeze(rubric, job)
    return ""


def _freezing_ended(job: Freezing, error: WorkerEnded) -> str:
    return f"{job.publication.id}: the process that wrote its report {error.reason}"


def faults(sender: Sender, selection: Selection) -> Iterator[SendFailure]:
    """Yield whose feedback cannot be sent as things are."""
    return filter(None, (_fault(sender, feedback) for feedback in selection.todo))


def _fault(sender: Sender, feedback: Feedback) -> SendFailure | None:
    try:
        sender.place(feedback)
    except NotSent as error:
        return SendFailure(id=feedback.entry.id, message=error.message, hint=error.hint)
    return None


def deliver(
    sender: Sender,
    selection: Selection,
    log: SentLog,
    delivery: Delivery,
    *,
    again: bool,
    told: Callable[[str], None],
) -> None:
    """Send what was selected, and write down in `delivery` what became of it; `told` gets a line for each.

    What costs one student costs no other. Raises GraderError for what would meet all, and KeyboardInterrupt.
    """
    together: list[Publication] = []
    place = ""
    with sender:
        for feedback in selection.todo:
            publication = feedback.publication
            if (fault := _fault(sender, feedback)) is not None:  # what has no address is not begun
                delivery.failures.append(fault)
                log.add([publication], "failed", message=fault.message)
                continue
            try:
                place = _send(sender, feedback, log, again=again)
            except NotSent as error:
                delivery.failures.append(
                    SendFailure(id=publication.id, message=error.message, hint=error.hint)
                )
                if not isinstance(error, Unsure):
                    log.add([publication], "failed", message=error.message)
                told(f"{publication.id}: not sent: {error.message}")
                continue
            if sender.together:
                together.append(publication)
            else:
                log.add([publication], "sent", place=place)
                delivery.sent.append(publication.id)
                told(f"{publication.id}: {place}")
    if together:
        log.add(together, "sent", place=place)
        delivery.sent += [publication.id for publication in together]
        told(place)


def _send(sender: Sender, feedback: Feedback, log: SentLog, *, again: bool) -> str:
    publication = feedback.publication
    is_unsure = log.state(publication) == "sending"
    if is_unsure and sender.unsure == "ask" and not again:
        raise Unsure(UNKNOWN, hint=f"ask the student; --only {publication.id} --again sends it once more")
    if sender.unsure != "again":
        log.add([publication], "sending")
    return sender.send(feedback, look=is_unsure)
