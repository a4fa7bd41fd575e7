"""`requests*.csv`: what students ask about a criterion, written by a person, a form or `grader requests`.

`request_files` gives the class's files, and `read_requests` what they ask, by submission and criterion; columns are
found by their headings, since those of a form are whole questions. `waiting` leaves those that no decision has answered
yet. `fetch` takes issues from GitHub or GitLab, and `write_requests` writes them as such a file.
"""

from __future__ import annotations

import csv
import fnmatch
import hashlib
import io
import os
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from grader.classes.batch.folder import BatchFolder
from grader.classes.feedback.forges import Comments
from grader.classes.feedback.mail import addresses
from grader.errors import NotSent
from grader.files import atomic_write, read_untrusted
from grader.intake.names import folder_key
from grader.model.batch import Entry
from grader.model.result import Override
from grader.results import read_result
from grader.rubric.model import Criterion
from grader.untrusted_text import line, visible
from grader.wording import did_you_mean

FILES = "requests*.csv"
COLUMNS = ("student", "criterion", "text", "when", "source")
HEADINGS = {
    "criterion": ("criteri",),
    "when": ("when", "timestamp", "time", "date", "created"),
    "student": ("student", "e-mail", "email", "mail", "login", "username", "id", "name", "author"),
    "text": ("text", "question", "request", "reason", "why", "body", "comment", "message"),
}
"""In this order, words that a heading of each column can have; the first word that some heading has decides."""
NEEDED = ("student", "criterion", "text")
TEXT_CHARS, WHEN_CHARS, SOURCE_CHARS = 2000, 40, 300
# a spreadsheet takes a cell that begins so for a formula, and runs it
_FORMULA = re.compile(r"\s*[=+\-@]")


@dataclass(frozen=True, kw_only=True)
class StudentRequest:
    """What one student asks; `when` and `source`, its address, in the form's own words."""

    text: str
    when: str = ""
    source: str = ""

    @property
    def digest(self) -> str:
        """What an answer says that it is to."""
        return hashlib.sha256(f"{self.when}\n{self.source}\n{self.text}".encode()).hexdigest()[:12]


@dataclass(frozen=True, kw_only=True)
class Requests:
    """By submission, then by criterion; each fault says which row is left out, and why."""

    found: Mapping[str, Mapping[str, tuple[StudentRequest, ...]]]
    faults: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class RequestRow:
    """A row of such a file: for whom, about which criterion, and what is asked."""

    student: str
    criterion: str
    request: StudentRequest


def waiting(asked: Sequence[StudentRequest], decided: Override | None) -> list[StudentRequest]:
    """Return those of a criterion's questions that have no answer. One by hand, which names none, is to all."""
    if decided is None or not decided.answer:
        return list(asked)
    return [one for one in asked if decided.answered and one.digest not in decided.answered]


def request_files(folder: Path) -> tuple[Path, ...]:
    """Return the files with requests in a class's folder."""
    return tuple(folder / name for name in sorted(fnmatch.filter(os.listdir(folder), FILES)))  # noqa: PTH208 - a thousand entries


def write_requests(path: Path, rows: Sequence[RequestRow]) -> None:
    """Write such a file anew; no cell is a formula in a spreadsheet."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\r\n")
    writer.writerow(COLUMNS)
    for row in rows:
        asked = row.request
        cells = (row.student, row.criterion, asked.text, asked.when, asked.source)
        shown = [visible(cell, lines=True) for cell in cells]
        writer.writerow([f"'{cell}" if _FORMULA.match(cell) else cell for cell in shown])
    atomic_write(path, out.getvalue().encode())


def rows_of(path: Path, students: Collection[str]) -> list[RequestRow]:
    """Return what such a file, as `write_requests` writes it, has of these students."""
    rows = csv.DictReader(io.StringIO(_text(path), newline=""))
    read = ([_without_formula_sign(str(row.get(name) or "")) for name in COLUMNS] for row in rows)
    return [
        RequestRow(
            student=student,
            criterion=criterion,
            request=StudentRequest(text=text, when=when, source=source),
        )
        for student, criterion, text, when, source in read
        if student in students
    ]


def fetch(
    forge: Comments, batch: BatchFolder, entry: Entry, criteria: Sequence[Criterion], label: str
) -> Iterator[RequestRow]:
    """Yield what a student asks on a forge: a row for each criterion that is named, else one. Raises NotSent."""
    result = read_result(batch.folder_of(entry))
    commit = (result.submission.commit if result else None) or ""
    for post in forge.questions(entry, commit, label):
        text = "\n\n".join(filter(None, (post.title, post.text)))[:TEXT_CHARS]
        request = StudentRequest(text=text, when=post.when, source=post.address)
        for name in criteria_named(post.title, criteria) or criteria_named(post.text, criteria) or [""]:
            yield RequestRow(student=entry.id, criterion=name, request=request)


def read_requests(paths: Sequence[Path], entries: Sequence[Entry], criteria: Sequence[Criterion]) -> Requests:
    """Return what these files ask about submissions and criteria. The same question about the same criterion counts
    once."""
    students, known = _Students(entries), [criterion.id for criterion in criteria]
    found: dict[str, dict[str, tuple[StudentRequest, ...]]] = {}
    faults = []
    for path in paths:
        rows = csv.DictReader(io.StringIO(_text(path), newline=""))
        columns = _columns(rows.fieldnames or ())
        missing = [name for name in NEEDED if name not in columns]
        if missing:
            faults.append(f"{path.name}:1: there is no column {missing[0]}")
            continue
        for row in rows:
            named = [_without_formula_sign(str(row.get(name) or "").strip()) for name in columns["student"]]
            asks, text, when, source = (
                str(row.get(columns.get(name, ("",))[0]) or "").strip() for name in COLUMNS[1:]
            )
            where = f"{path.name}:{rows.line_num}"
            submission = next(filter(None, map(students.find, named)), None)
            about = criteria_named(asks, criteria)
            if submission is None:
                said = next(filter(None, named), "")
                faults.append(
                    f'{where}: there is no submission "{line(said, 80)}"{did_you_mean(said, students.ids)}'
                )
                continue
            if not about:
                what = f'there is no criterion "{line(asks, 80)}"{did_you_mean(asks, known)}'
                faults.append(f"{where}: {what if asks else f'no criterion is named: {line(text, 80)}'}")
                continue
            asked = StudentRequest(
                text=_without_formula_sign(text)[:TEXT_CHARS],
                when=when[:WHEN_CHARS],
                source=source[:SOURCE_CHARS],
            )
            of = found.setdefault(submission, {})
            for criterion in about:
                of[criterion] = tuple(dict.fromkeys((*of.get(criterion, ()), asked)))
    return Requests(found=found, faults=tuple(faults))


def criteria_named(text: str, criteria: Sequence[Criterion]) -> list[str]:
    """Return the ids of the criteria that a text names, by id or by its whole title."""
    # a whole title first: a title may contain another criterion's id
    titles = [c.id for c in criteria if c.title.casefold() == text.strip().casefold()]
    return titles or [c.id for c in criteria if re.search(rf"(?<![\w-]){re.escape(c.id)}(?![\w-])", text)]


class _Students:
    """Who is meant: by id, folder, mail address, or a name that only one has."""

    def __init__(self, entries: Sequence[Entry]) -> None:
        self.ids: Collection[str] = [entry.id for entry in entries]
        self._by: dict[str, set[str]] = {}
        for entry in entries:
            for word in (entry.name, *_addresses(entry)):
                self._by.setdefault(word.casefold(), set()).add(entry.id)
        self._by |= {folder_key(entry.id): {entry.id} for entry in entries}

    def find(self, word: str) -> str | None:
        """Return the id; None where nobody or several are meant."""
        found = self._by.get(folder_key(word)) or self._by.get(word.casefold(), set()) if word else set()
        return next(iter(found)) if len(found) == 1 else None


def _addresses(entry: Entry) -> Iterator[str]:
    with suppress(NotSent):
        yield from addresses(entry)


def _columns(headings: Sequence[str | None]) -> dict[str, tuple[str, ...]]:
    """Return the headings by column: all that can name the student, and one of each other."""
    free = [heading for heading in headings if heading and heading.strip()]
    found: dict[str, tuple[str, ...]] = {}
    for column, words in {"source": ("source", "url"), **HEADINGS}.items():
        exact = [h for h in free if h.strip().casefold() == column]
        # a heading may have an ending: `Criterion`, `criteria`
        having = [h for word in words for h in free if re.search(rf"\b{word}", h, re.IGNORECASE)]
        chosen = list(dict.fromkeys([*exact, *having]))[: None if column == "student" else 1]
        if chosen:
            found[column] = tuple(chosen)
            free = [heading for heading in free if heading not in chosen]
    return found


def _without_formula_sign(cell: str) -> str:
    """Return a cell without the sign that keeps it from being a formula."""
    return cell[1:] if cell[:1] == "'" and _FORMULA.match(cell[1:]) else cell


def _text(path: Path) -> str:
    # spreadsheets put a byte order mark before it
    return (read_untrusted(path) or b"").decode("utf-8-sig", "replace")
