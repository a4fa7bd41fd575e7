"""What `grader publish`, `grader feedback` and `grader requests` print, and their exit codes."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import cast

from grader.classes.batch.folder import BatchFolder, open_batch
from grader.classes.feedback import publish as publishing
from grader.classes.feedback.forges import Comments
from grader.classes.feedback.forms import FORMS, FeedbackForm, Sender, SendSettings
from grader.classes.feedback.publish import Publishing, PublishStep, plan, read_published, refuse_other_rubric
from grader.classes.feedback.send import (
    Delivery,
    Recipients,
    Selection,
    SendFailure,
    deliver,
    faults,
    open_selection,
)
from grader.classes.review.session import ReviewSession, open_session
from grader.classes.review.student_requests import RequestRow, fetch, rows_of, waiting, write_requests
from grader.classes.roster.entries import parse_time
from grader.cli.output import say, say_beside, say_document, say_json
from grader.errors import ExitCode, NotSent, UsageError
from grader.host_programs import git_user
from grader.model.result import AUTHOR_CHARS
from grader.portable import cores
from grader.report.view import hidden_ids
from grader.rubric.load import load_rubric
from grader.untrusted_text import line, visible
from grader.wording import first_few, number, plural

NAMES_SHOWN = 10
SHOWN_CHARS = 8000


def publish(
    folder: Path, only: Sequence[str], *, dry_run: bool, show_hidden: bool, author: str | None, as_json: bool
) -> ExitCode:
    """Publish a class, or show what would be published; print what became of it."""
    batch = open_batch(folder)
    batch.refuse_newer()
    rubric = load_rubric(batch.run.rubric_source)
    refuse_other_rubric(batch, rubric, "publish it")
    if dry_run:
        steps = tuple(plan(batch, read_published(folder), only))
    else:
        by = line(git_user() if author is None else author, AUTHOR_CHARS)
        hidden = frozenset[str]() if show_hidden else hidden_ids(rubric.rubric)
        how = Publishing(by=by, hidden=hidden, only=only, jobs=cores())
        steps = publishing.publish(batch, rubric, how)
    if as_json:
        say_json([_step_json(step) for step in steps])
    else:
        for text in _step_lines(batch, steps, dry_run=dry_run):
            say(text)
    return _publish_code(steps)


def _publish_code(steps: Sequence[PublishStep]) -> ExitCode:
    drafts = [step.result for step in steps if step.state == "draft"]
    if any(step.failed for step in steps) or any(r is None or r.status != "inconclusive" for r in drafts):
        return ExitCode.NOT_GRADED
    return ExitCode.INCONCLUSIVE if drafts else ExitCode.PASSED


def _step_json(step: PublishStep) -> dict[str, object]:
    return {
        "id": step.entry.id,
        "state": "failed" if step.failed else step.state,
        "points": step.result.points if step.result else None,
        "changes": list(step.changes),
        "why": step.why,
    }


def _step_lines(batch: BatchFolder, steps: Sequence[PublishStep], *, dry_run: bool) -> Iterator[str]:
    for step in steps:
        if step.failed:
            yield f"{step.entry.id}: not published: {step.why}"
        elif step.state == "draft":
            yield f"{step.entry.id}: stays a draft: {step.why}"
        elif step.state == "changed":
            first, *more = step.changes
            yield f"{step.entry.id}: {first}"
            yield from (f"    {change}" for change in more)
    for fault in batch.run.faults:
        yield f"{fault.id or 'a row without an id'}: cannot be published: {fault}"
    counts = Counter("failed" if step.failed else step.state for step in steps)
    words = {
        "new": "would be published" if dry_run else "published",
        "changed": "would be published again, with changes" if dry_run else "published again, with changes",
        "same": "published before and not changed",
        "draft": "left as drafts",
        "failed": "could not be published",
    }
    yield (
        ", ".join(f"{counts[name]} {said}" for name, said in words.items() if counts[name])
        or "no submissions"
    )
    if counts["draft"]:
        yield "  hint: --only ID publishes a draft as it is"
    if counts["new"] + counts["changed"] and not dry_run:
        yield f"{batch.path / publishing.FILE}; grader feedback {batch.path} --form … returns it to the students"


def check_options(form: FeedbackForm, given: Mapping[str, bool]) -> None:
    """Raise UsageError for an option that the form does not take."""
    for name, is_given in given.items():
        if is_given and name not in form.options:
            takes = ", ".join(sorted(form.options))
            raise UsageError(f"--form {form.name} does not take {name}", hint=f"it takes {takes}")


def parse_option_time(option: str, text: str | None) -> datetime | None:
    """Parse the time that an option was given; None for none. Raises UsageError."""
    found = parse_time(text) if text is not None else None
    if text is not None and found is None:
        hint = "write it like 2026-11-20T23:59:00+01:00"
        raise UsageError(f"{option} {line(text, 80)} is not a time", hint=hint)
    return found


def send(
    folder: Path,
    form: FeedbackForm,
    settings: SendSettings,
    wanted: Recipients,
    *,
    drafts: bool,
    dry_run: bool,
) -> ExitCode:
    """Return a class's feedback, or show one of it; print what became of each student's."""
    batch = open_batch(folder)
    if drafts:
        wanted = replace(wanted, drafts=load_rubric(batch.run.rubric_source))
    with open_selection(batch, form, wanted, jobs=cores()) as (selection, log):
        sender = form.open(settings)
        if dry_run:
            return _show(form, sender, selection)
        delivery = Delivery()
        try:
            if selection.todo:
                deliver(sender, selection, log, delivery, again=wanted.again, told=say)
        # Ctrl-C too
        except BaseException:
            done = len(delivery.sent)
            say_beside(f"{done} of {len(selection.todo)} sent; the same command continues")
            raise
        _say_failures(delivery.failures)
        sent = [f"{len(delivery.sent)} sent by {form.name}"]
        say(", ".join([*sent, *_others(selection), *_failure_words(delivery.failures)]))
        if selection.unpublished:
            say(f"  not published: {first_few(selection.unpublished, NAMES_SHOWN)}")
    return ExitCode.NOT_GRADED if delivery.failures else ExitCode.PASSED


def _show(form: FeedbackForm, sender: Sender, selection: Selection) -> ExitCode:
    failures = list(faults(sender, selection))
    failed = {failure.id for failure in failures}
    first = next((one for one in selection.todo if one.entry.id not in failed), None)
    if first is not None:
        say(f"{first.entry.id} → {sender.place(first)}")
        shown = visible(sender.show(first), lines=True)
        cut = f"{shown[:SHOWN_CHARS]}\n… and {len(shown) - SHOWN_CHARS} more characters\n"
        text = shown if len(shown) <= SHOWN_CHARS else cut
        say_document(
            lambda ascii_only: text.encode("ascii", "backslashreplace").decode() if ascii_only else text
        )
    _say_failures(failures)
    ready = len(selection.todo) - len(failures)
    say(", ".join([f"{ready} would be sent by {form.name}", *_others(selection), *_failure_words(failures)]))
    return ExitCode.NOT_GRADED if failures else ExitCode.PASSED


def _say_failures(failures: Sequence[SendFailure], what: str = "got nothing") -> None:
    """Say each reason once, with all whom it concerns."""
    by_reason: dict[str, list[str]] = {}
    for failure in failures:
        hint = f" ({failure.hint})" if failure.hint else ""
        by_reason.setdefault(f"{failure.message}{hint}", []).append(failure.id)
    if failures:
        say_beside(f"{plural(len(failures), 'student')} {what}:")
    for reason, ids in by_reason.items():
        say_beside(f"  {', '.join(ids)}: {reason}")


def _others(selection: Selection) -> Iterator[str]:
    counts = {
        "sent before": selection.before,
        "published earlier than that": selection.older,
        "not published": selection.unpublished,
    }
    return (f"{number(len(names))} {said}" for said, names in counts.items() if names)


def _failure_words(failures: Sequence[SendFailure]) -> list[str]:
    return [f"{len(failures)} could not be sent"] if failures else []


def list_requests(folder: Path, forge: str | None, label: str, *, as_json: bool) -> ExitCode:
    """Print what students ask and what was answered; with a forge, get what is asked there first."""
    session = open_session(folder)
    failures = _fetch(session, forge, label) if forge else []
    asked, decided = session.requests(), session.overrides()
    listed = [
        {
            "student": student,
            "criterion": criterion,
            "text": one.text,
            "when": one.when,
            "source": one.source,
            "answer": "" if one in open_ or by is None else by.answer,
        }
        for student, of in asked.found.items()
        for criterion, ones in of.items()
        for by in [decided.get(student, {}).get(criterion)]
        for open_ in [waiting(ones, by)]
        for one in ones
    ]
    if as_json:
        say_json(listed)
    else:
        for one in listed:
            about = ", ".join(filter(None, (one["when"], one["source"])))
            say(f"{one['student']} {one['criterion']}" + (f" ({about})" if about else ""))
            for text in filter(str.strip, one["text"].splitlines()):
                say(f"    {text}")
            if one["answer"]:
                say(f"    answer: {one['answer']}")
        answered = sum(bool(one["answer"]) for one in listed)
        say(
            f"{plural(len(listed), 'question')}, {answered} answered; grader review {folder} takes the answers"
        )
    for fault in asked.faults:
        say_beside(f"left out: {fault}")
    _say_failures(failures, "whose questions could not be fetched")
    return ExitCode.NOT_GRADED if failures else ExitCode.PASSED


def _fetch(session: ReviewSession, forge: str, label: str) -> list[SendFailure]:
    """Write what is asked on a forge into the class's folder. Whose repository fails keeps the rows of before."""
    # `forge` is one of FORGES, whose senders can read, too
    sender = cast(Comments, FORMS[forge].open(SendSettings(folder=session.path, told=say_beside)))
    batch, path = session.submissions.batch(), session.path / f"requests-{forge}.csv"
    rows, failures = list[RequestRow](), list[SendFailure]()
    for entry in batch.run.entries:
        try:
            rows += fetch(sender, batch, entry, session.rubric.rubric.criteria, label)
        except NotSent as error:  # noqa: PERF203 - each repository has its own
            rows += rows_of(path, {entry.id})
            failures.append(SendFailure(id=entry.id, message=error.message, hint=error.hint))
    write_requests(path, rows)
    return failures
