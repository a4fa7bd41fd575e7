"""What the page of a submission shows of each criterion, and the form in which an instructor awards points.

The student's code stands beside it, with the lines that are cited and what differs from the starter. Everything is
bounded, and nothing of a file becomes markup.
"""

from __future__ import annotations

import os
import re
import unicodedata
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import date
from difflib import SequenceMatcher
from fnmatch import fnmatch
from functools import lru_cache
from itertools import chain, count
from keyword import kwlist
from pathlib import Path, PurePosixPath

from markupsafe import Markup, escape

from grader.classes.gradebook import GradebookRow
from grader.classes.review.session import mark
from grader.classes.review.student_requests import StudentRequest
from grader.classes.review.submissions import Stamp, stamp_of
from grader.classes.similarity.sources import EVIDENCE_BYTES_MAX, PLACE, SUFFIXES
from grader.errors import EvidenceError
from grader.evidence.reader import load_run
from grader.evidence.run import Run
from grader.files import open_untrusted
from grader.model.result import (
    AUTHOR_CHARS,
    BANK_CHARS,
    COMMENT_CHARS,
    AppliedOverride,
    BankComment,
    CriterionResult,
    Override,
    WrittenOverride,
)
from grader.model.verdict import FileCitation, Status
from grader.rubric.load import names_in
from grader.rubric.model import Criterion, Rubric
from grader.untrusted_text import line
from grader.wording import number

MANUAL = "manual"


@dataclass(frozen=True, kw_only=True)
class Draft:
    """What a form was sent with and what became of it. In a `conflict` someone else has decided since; `error` says
    what is wrong with what was sent, `saved` when it was written."""

    points: str = ""
    comment: str = ""
    comments: Sequence[str] = ()
    answer: str = ""
    conflict: bool = False
    error: str = ""
    saved: str = ""
    typed: bool = True


@dataclass(frozen=True, kw_only=True)
class Decided:
    """A decision: what stands in `overrides.yaml`, and what it comes to."""

    written: WrittenOverride
    override: Override


@dataclass(frozen=True, kw_only=True)
class Card:
    """One criterion with its form. `decided` is what stands in `overrides.yaml`, `applied` what the result has, `bank`
    the comments that there are."""

    criterion: CriterionResult
    manual: bool
    hidden: bool
    decided: Decided | None
    applied: AppliedOverride | None
    draft: Draft | None
    bank: Mapping[str, BankComment]
    requests: Sequence[StudentRequest] = ()

    @property
    def override(self) -> Override | None:
        """What the decision comes to."""
        return self.decided.override if self.decided else None

    @property
    def together(self) -> str:
        """The word of all that were decided with it in one go."""
        return self.decided.written.together if self.decided else ""

    @property
    def awarded(self) -> bool:
        """Whether the points are a person's."""
        return self.override is not None and self.override.awards

    @property
    def seen(self) -> str:
        """What its form says that it was made from."""
        return mark(self.override)

    @property
    def form(self) -> Draft:
        """What the form's fields hold: what was typed, else what is decided."""
        if self.draft and self.draft.typed:
            return self.draft
        if self.decided is None:
            return Draft()
        written = self.decided.written
        points = "" if written.points is None else number(written.points, FORM_DIGITS)
        return Draft(points=points, comment=written.comment, comments=written.comments, answer=written.answer)

    @property
    def said(self) -> str:
        """What the check says, where a person decided."""
        if self.applied is None or not self.applied.awards or self.manual:
            return ""
        return verdict(self.applied.automatic.status, self.applied.automatic.points, self.criterion.full)

    @property
    def was(self) -> str:
        """What the check said when the person decided, where it says something else now."""
        if self.applied is None or not self.applied.changed:
            return ""
        return verdict(self.applied.was.status, self.applied.was.points, self.criterion.full)


@dataclass(frozen=True, kw_only=True)
class Cards:
    """What waits for a person, what a person decided, and the rest: what lost points first, else as in the rubric."""

    waiting: Sequence[Card]
    decided: Sequence[Card]
    rest: Sequence[Card]

    def only(self, criterion: str) -> Cards:
        """Return that criterion's card alone, as one that waits or is decided, so that it is not folded."""
        decided = [one for one in self.decided if one.criterion.id == criterion]
        waiting = [one for one in (*self.waiting, *self.rest) if one.criterion.id == criterion]
        return Cards(waiting=waiting, decided=decided, rest=())


@dataclass(frozen=True, kw_only=True)
class Known:
    """What people decided about a submission, what its student asks, and the bank's comments, all by criterion."""

    decided: Mapping[str, Decided]
    bank: Mapping[str, Mapping[str, BankComment]]
    requests: Mapping[str, Sequence[StudentRequest]] = field(default_factory=dict)


def cards(row: GradebookRow, rubric: Rubric, known: Known, drafts: Mapping[str, Draft]) -> Cards:
    """Return the cards of a submission."""
    found = [card(row, rubric, name, known, drafts) for name in (c.id for c in row.result.criteria)]
    whole = row.result.error is None
    mine = [c for c in found if c.awarded]
    waiting = [c for c in found if not c.awarded and _waits(c, whole=whole)]
    others = [c for c in found if c not in mine and c not in waiting]
    rest = sorted(others, key=lambda c: c.criterion.points >= c.criterion.max_points)
    return Cards(waiting=waiting, decided=mine, rest=rest)


def card(
    row: GradebookRow, rubric: Rubric, criterion: str, known: Known, drafts: Mapping[str, Draft]
) -> Card:
    """Return one of them; the result has a criterion of that id."""
    result = row.result
    asked = next((c for c in rubric.criteria if c.id == criterion), None)
    return Card(
        criterion=next(c for c in result.criteria if c.id == criterion),
        manual=asked is not None and asked.check == MANUAL,
        hidden=asked is not None and asked.visibility == "hidden",
        decided=known.decided.get(criterion),
        bank=known.bank.get(criterion, {}),
        requests=known.requests.get(criterion, ()),
        applied=next((o for o in result.overrides if o.criterion == criterion), None),
        draft=drafts.get(criterion),
    )


def _waits(card: Card, *, whole: bool) -> bool:
    """Return whether it waits for a person: of what could not be graded, only what people decide anyway does."""
    return card.criterion.counts and card.criterion.status.is_open and (whole or card.manual)


def verdict(status: Status, points: float, most: float) -> str:
    """Return `fail, 0 of 10`."""
    return f"{status.value}, {number(points)} of {number(most)}"


FORM_DIGITS = 10  # in a field of a form no digit is lost
POINTS = re.compile(r"-?(?:\d{1,9}(?:[.,]\d{0,9})?|[.,]\d{1,9})", re.ASCII)


class Wrong(Exception):
    """What was typed cannot be taken; the message says why."""


def override_of(
    points: str,
    comment: str,
    author: str,
    *,
    least: float = 0.0,
    most: float,
    reason: bool,
    comments: Sequence[str] = (),
    pointed: bool = False,
    answer: str = "",
) -> WrittenOverride:
    """Return the decision of a form. Raises Wrong. A `reason` is asked for where a check has judged; an `answer` is
    one, and so are comments of the bank. Points may be left out where there is an answer, and where comments stand for
    points (`pointed`)."""
    written, answered = clean(comment), clean(answer)
    value = None if (answered or pointed) and not points.strip() else _points(points, least, most)
    if (many := max(len(written), len(answered))) > COMMENT_CHARS:
        raise Wrong(f"At most {COMMENT_CHARS} characters, please: there are {many}.")
    if reason and not written and not comments and not answered:
        raise Wrong("Say why: the student sees the reason beside the points.")
    if len(comments) > COMMENTS_MAX:
        raise Wrong(f"At most {COMMENTS_MAX} comments, please.")
    return WrittenOverride(
        points=value,
        comment=written,
        author=author,
        date=date.today(),  # noqa: DTZ011 - the person's day
        comments=tuple(comments),
        answer=answered,
    )


def _points(typed: str, least: float, most: float) -> float:
    text = typed.strip()
    if not text:
        raise Wrong("How many points?")
    if not POINTS.fullmatch(text) or (text.startswith("-") and least >= 0):
        raise Wrong("Points are a number, such as 7 or 2.5.")
    value = float(text.replace(",", "."))
    if value > most:
        raise Wrong(f"It has at most {number(most)} points.")
    if value < least:
        raise Wrong(f"It has at least {number(least)} points.")
    return value


COMMENTS_MAX = 10
CHANGE = re.compile(r"[+-](?:\d{1,6}(?:[.,]\d{0,9})?|[.,]\d{1,9})", re.ASCII)


def bank_comment_of(text: str, points: str, *, least: float, most: float) -> BankComment:
    """Return the comment of a form: `7` are points, `-2` and `+1` a change, nothing is neither. Raises Wrong."""
    written, typed = clean(text), points.strip()
    if not written:
        raise Wrong("What should it say?")
    if len(written) > BANK_CHARS:
        raise Wrong(f"At most {BANK_CHARS} characters, please: there are {len(written)}.")
    if CHANGE.fullmatch(typed):
        return BankComment(text=written, change=float(typed.replace(",", ".")))
    return BankComment(text=written, points=_points(typed, least, most) if typed else None)


def comment_name(text: str, known: Collection[str]) -> str:
    """Return a short id for a comment, made of its first words, that no other one has."""
    words = re.findall(r"[a-z0-9]+", unicodedata.normalize("NFKD", text).casefold())
    first = "-".join(words[:4])[:30].strip("-") or "comment"
    names = chain([first], (f"{first}-{number}" for number in count(2)))
    return next(name for name in names if name not in known)


def points_words(comment: BankComment) -> str:
    """Return `7`, `-2` or nothing."""
    if comment.change is not None:
        return f"{comment.change:+g}"
    return "" if comment.points is None else number(comment.points, FORM_DIGITS)


def author_of(text: str) -> str:
    """Return a name as it was typed, on one line. Raises Wrong."""
    written = " ".join(clean(text).split())
    if len(written) > AUTHOR_CHARS:
        raise Wrong(f"A name has at most {AUTHOR_CHARS} characters.")
    return written


def clean(text: str) -> str:
    """Return the text with line ends as they are in files, and without control characters."""
    lines = text.replace("\r\n", "\n").replace("\r", "\n").strip()
    return "".join(c for c in lines if c in "\n\t" or unicodedata.category(c) not in {"Cc", "Cs"})


FILES_MAX = 12
LINES_MAX = 1500
LINE_CHARS = 300
RUNS_KEPT = 24


@dataclass(frozen=True, kw_only=True)
class CodeLine:
    """A line: its `number`, None for one of the starter that is gone; `kind` is `plus`, `minus` or empty."""

    number: int | None
    text: Markup
    kind: str = ""
    marked: bool = False


@dataclass(frozen=True, kw_only=True)
class CodeFile:
    """A file of the student's; `told` says in words what differs from the starter, and what is left out."""

    path: str
    rows: Sequence[CodeLine]
    cited: bool
    told: str


def code_of(
    folder: Path,
    criterion: Criterion,
    result: CriterionResult,
    starter: Mapping[str, bytes],
    hide: Callable[[str], str] = str,
) -> list[CodeFile]:
    """Return the files that the criterion is about, those that it cites first; none without evidence.

    They are what it cites and what its parameters name, or else all programs; a pattern of its `files` that fits none
    is one without lines. `starter` has the course's files by path;
    `hide` takes out of each line what is not to be read.
    """
    run = _package_run(folder, stamp_of(folder.joinpath(*PLACE)))
    if run is None:
        return []
    marks: dict[str, set[int]] = {}
    for citation in result.citations:
        if isinstance(citation, FileCitation):
            # 0: the whole file is cited, and no line of it is marked
            marks.setdefault(citation.file, set()).add(citation.line or 0)
    paths = [path for path in marks if path in run.attachments]
    paths += [path for path in sorted(run.attachments) if path not in marks and _is_about(criterion, path)]
    missing = [
        CodeFile(path=pattern, rows=(), cited=False, told="no such file is in the evidence")
        for pattern in map(str, criterion.parameters.get("files", ()))
        if criterion.check == "manual" and not any(_fits(path, pattern) for path in run.attachments)
    ]
    if not paths and not missing:
        paths = [path for path in sorted(run.attachments) if PurePosixPath(path).suffix in SUFFIXES]
    found = [_file(run, path, marks.get(path, set()), starter, hide) for path in paths[:FILES_MAX]]
    return [*found, *missing]


def _is_about(criterion: Criterion, path: str) -> bool:
    """Return whether its parameters name the file, by its path, its name or a pattern."""
    patterns = [str(one) for one in criterion.parameters.get("files", ())]
    return PurePosixPath(path).name in names_in(criterion) or any(_fits(path, one) for one in patterns)


def _fits(path: str, pattern: str) -> bool:
    return fnmatch(path, pattern) or fnmatch(PurePosixPath(path).name, pattern)


@lru_cache(maxsize=RUNS_KEPT)
def _package_run(folder: Path, stamp: Stamp) -> Run | None:  # noqa: ARG001 - another file is another key
    try:
        with open_untrusted(folder, *PLACE) as file:
            if os.fstat(file.fileno()).st_size > EVIDENCE_BYTES_MAX:
                return None
            return load_run(file)
    except (OSError, EvidenceError):
        return None


def _file(
    run: Run, path: str, marks: set[int], starter: Mapping[str, bytes], hide: Callable[[str], str]
) -> CodeFile:
    lines = run.file_lines(path)
    before = _handed_out(path, starter)
    shown = highlighted(
        [line(text.expandtabs(4), LINE_CHARS) for text in lines[:LINES_MAX]], PurePosixPath(path).suffix
    )
    rows = list(_rows(shown, lines[:LINES_MAX], before[:LINES_MAX] if before is not None else None, marks))
    told = []
    if before is not None:
        plus, minus = (sum(row.kind == kind for row in rows) for kind in ("plus", "minus"))
        told.append(f"{plus} new and {minus} removed" if plus or minus else "as the course handed it out")
    if len(lines) > LINES_MAX:
        told.append(f"{len(lines) - LINES_MAX} more lines are not shown")
    return CodeFile(path=hide(path), rows=rows, cited=bool(marks), told="; ".join(told))


def _rows(
    shown: Sequence[Markup], lines: Sequence[str], before: Sequence[str] | None, marks: set[int]
) -> Iterator[CodeLine]:
    if before is None:
        yield from (CodeLine(number=i, text=text, marked=i in marks) for i, text in enumerate(shown, start=1))
        return
    # blanks at the end of a line are no difference that anyone sees
    plain = [[text.rstrip() for text in part] for part in (before, lines)]
    for kind, was, was_end, now, now_end in SequenceMatcher(None, plain[0], plain[1]).get_opcodes():
        if kind in ("delete", "replace"):
            gone = (line(text.expandtabs(4), LINE_CHARS) for text in before[was:was_end])
            yield from (CodeLine(number=None, text=escape(text), kind="minus") for text in gone)
        new = "" if kind == "equal" else "plus"
        for place in range(now, now_end):
            yield CodeLine(number=place + 1, text=shown[place], kind=new, marked=place + 1 in marks)


def _handed_out(path: str, starter: Mapping[str, bytes]) -> list[str] | None:
    """Return the lines of the starter's file at that path of the package; None where it has none."""
    # a file of another package of the lab: its path begins at the main one
    own = re.sub(r"^(\.\./)+", "", path)
    found = next((data for name, data in starter.items() if f"/{name}".endswith(f"/{own}")), None)
    return None if found is None else found.decode("utf-8", "replace").splitlines()


CPP_WORDS = (
    "auto bool break case catch char class const constexpr continue default delete do double else enum explicit false "
    "float for friend if inline int long namespace new nullptr operator private protected public return short signed "
    "size_t sizeof static struct switch template this throw true try typedef typename union unsigned using virtual "
    "void while"
)
_STRING = r"""(?P<string>"(?:[^"\\\n]|\\.)*"?|'(?:[^'\\\n]|\\.)*'?)"""
_LONG = r'''(?P<long>"""(?:(?!""").)*(?:""")?|\'\'\'(?:(?!\'\'\').)*(?:\'\'\')?)'''
_NUMBER = r"(?P<number>\b\d[\w.]*)"


def _words(words: Iterable[str]) -> str:
    return rf"(?P<word>\b(?:{'|'.join(words)})\b)"


# Not Pygments: `similarity` has to interrupt its patterns where a text keeps them busy, which a server's thread cannot.
_HASH = r"(?P<comment>#[^\n]*)"
_PYTHON = re.compile("|".join([_HASH, _LONG, _STRING, _words(kwlist), _NUMBER]), re.DOTALL)
_CPP = re.compile(
    "|".join(
        [r"(?P<comment>//[^\n]*|/\*(?:(?!\*/).)*(?:\*/)?)", _STRING, _words(CPP_WORDS.split()), _NUMBER]
    ),
    re.DOTALL,
)
_XML = re.compile(r"(?P<comment><!--(?:(?!-->).)*(?:-->)?)|(?P<word></?[\w:-]+|/?>)|" + _STRING, re.DOTALL)
_OTHER = re.compile(f"{_HASH}|{_STRING}|{_NUMBER}")


def highlighted(lines: Sequence[str], suffix: str) -> list[Markup]:
    """Return the lines, escaped, with comments, strings, numbers and words of the language in elements of their own.

    The patterns look at each character a bounded number of times.
    """
    if suffix in SUFFIXES:
        pattern = _PYTHON if SUFFIXES[suffix] == "python" else _CPP
    else:
        pattern = _XML if suffix in {".xml", ".launch", ".urdf", ".xacro"} else _OTHER
    text = "\n".join(lines)
    made, at = [], 0
    for found in pattern.finditer(text):
        made += [escape(text[at : found.start()]), _mark_up(found[0], found.lastgroup or "")]
        at = found.end()
    return [Markup(part) for part in "".join([*made, escape(text[at:])]).split("\n")]  # noqa: S704 - escaped


def _mark_up(text: str, kind: str) -> str:
    """Return an element for each line of it."""
    # the lines are taken apart below, and no element may reach from one into the next
    parts = escape(text).split("\n")
    return "\n".join(part and f'<span class="hl-{kind}">{part}</span>' for part in parts)
