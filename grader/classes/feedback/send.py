"""Returns feedback to a class, one student after the other; what is interrupted goes on where it stopped.

published.jsonl → `select` → to be sent │ sent before │ not known → `deliver` → sent.jsonl

Lines of `sent.jsonl` are appended, each flushed to the disk. One that was torn by a crash is passed over: the one
before it says that sending was begun, and not how it ended.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import datetime, timezone
from functools import partial
from pathlib import Path

from pydantic import ValidationError

from grader.classes.batch.folder import BatchFolder
from grader.classes.batch.run import hold_folder
from grader.classes.feedback import publish
from grader.classes.feedback.forms import Feedback, FeedbackForm, Sender, Unsure
from grader.classes.feedback.publish import Published, StudentReports
from grader.errors import NotSent, UsageError
from grader.files import FILE as PRIVATE
from grader.files import temporary_folder, writing
from grader.intake.names import safe_name
from grader.model.batch import Publication, Sent, SentState
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
        for number, row in enumerate(publish.read_rows(self.path), start=1):
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
        with writing(self.path):
            self._append(text.encode())
        for line in lines:
            self._remember(line)

    def _append(self, data: bytes) -> None:
        flags = os.O_RDWR | os.O_CREAT | os.O_APPEND | CLOEXEC | NOFOLLOW | BINARY
        with os.fdopen(os.open(self.path, flags, PRIVATE), "r+b", buffering=0) as file:
            # what a killed grader has begun is a line of its own, which is passed over when it is read
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


@dataclass(kw_only=True)
class Selection:
    """`todo` is to be sent. `before` were sent already, `unpublished` are drafts; `older` were published earlier than
    asked for."""

    todo: list[Feedback] = field(default_factory=list)
    before: list[str] = field(default_factory=list)
    older: list[str] = field(default_factory=list)
    unpublished: list[str] = field(default_factory=list)


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


@contextmanager
def open_selection(
    folder: BatchFolder, form: FeedbackForm, wanted: Recipients, *, jobs: int
) -> Iterator[tuple[Selection, SentLog]]:
    """Hold the class's feedback and give what is to be sent, and the log of what was.

    Raises UsageError if nothing is published, or for an unknown id; Busy if other feedback is being sent.
    """
    published = publish.read_published(folder.path)
    if not published.history and wanted.drafts is None:
        raise UsageError(
            f"{folder.path}: nothing of this class is published, so there is nothing to return",
            hint=f"grader publish {folder.path}; or --drafts to return results as they are now",
        )
    publish.check_only(folder, wanted.only)
    # before the first publication there is no folder for these; drafts then hold the class's own
    place = folder.path / publish.FOLDER if published.history else folder.path
    who = "other feedback is being sent, or a class published,"
    with hold_folder(place, who), temporary_folder("run") as room:
        # read again, as another program may have published before the folder was held
        log, published = SentLog(folder.path, form.name), publish.read_published(folder.path)
        if wanted.drafts is None:
            last = {name: history[-1] for name, history in published.history.items()}
            made = {name: (one, published.folder(one)) for name, one in last.items()}
        else:
            made = _drafts(folder, published, wanted.drafts, wanted.only, room, jobs=jobs)
        yield _select(folder, wanted, made, log), log


def _select(
    folder: BatchFolder, wanted: Recipients, made: Mapping[str, tuple[Publication, Path]], log: SentLog
) -> Selection:
    """`made` has by the names of folders what can be sent, and where its reports are."""
    names, selection = publish.check_only(folder, wanted.only), Selection()
    for entry in folder.run.entries:
        name = safe_name(entry.id)
        if name not in names:
            continue
        if name not in made:
            selection.unpublished.append(entry.id)
            continue
        publication, place = made[name]
        if wanted.changed_since is not None and publication.at <= wanted.changed_since:
            selection.older.append(entry.id)
        elif log.state(publication) == "sent" and not wanted.again:
            selection.before.append(entry.id)
        else:
            result = read_result(place)
            feedback = Feedback(
                entry=entry,
                publication=publication,
                name=name,
                title=folder.run.title,
                folder=place,
                commit=(result.submission.commit if result else None) or "",
                last_place=log.last_place(entry.id),
            )
            selection.todo.append(feedback)
    return selection


def _drafts(
    folder: BatchFolder,
    published: Published,
    rubric: LoadedRubric,
    only: Sequence[str],
    room: Path,
    *,
    jobs: int,
) -> dict[str, tuple[Publication, Path]]:
    """Return the reports of results as they are now, written into `room`."""
    publish.refuse_other_rubric(folder, rubric, "publish it")
    wanted = {
        safe_name(step.entry.id): StudentReports(
            publication=publish.publication_of(step.entry, step.result),
            result=step.result,
            evidence=folder.folder_of(step.entry),
            into=room / safe_name(step.entry.id),
            changes=publish.history_words(published.of(step.entry)),
            hidden=hidden_ids(rubric.rubric),
        )
        for step in publish.plan(folder, published, only)
        if step.result is not None and step.state != "draft"
    }
    write = partial(_write_draft, rubric)
    done = run_each(write, wanted.values(), min(jobs, len(wanted)), ended=_writing_ended)
    for failed in filter(None, done):
        raise NotSent(failed)
    return {name: (one.publication, one.into) for name, one in wanted.items()}


def _write_draft(rubric: LoadedRubric, job: StudentReports) -> str:
    """In a worker."""
    publish.write_student_reports(rubric, job)
    return ""


def _writing_ended(job: StudentReports, error: WorkerEnded) -> str:
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
    with sender.opened():
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
                # without that line, the last one says `sending`: the next run knows that it has to look, or
                # to ask
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
    # where sending twice does no harm, nobody needs to know that it was begun
    if sender.unsure != "again":
        log.add([publication], "sending")
    return sender.send(feedback, look=is_unsure)
