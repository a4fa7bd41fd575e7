"""What the page of a submission shows of each criterion, and the form in which an instructor awards points."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import date
from itertools import chain, count

from grader.classes.gradebook import GradebookRow
from grader.classes.review.session import mark
from grader.classes.review.student_requests import StudentRequest
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
from grader.model.verdict import Status
from grader.rubric.model import Rubric
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
        points = "" if written.points is None else form_number(written.points)
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
    """One of them; the result has a criterion of that id."""
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
    """Of what could not be graded at all, only what people decide anyway waits for one."""
    status = card.criterion.status
    return card.criterion.counts and ((status.is_open and whole) or (card.manual and status.is_open))


def verdict(status: Status, points: float, most: float) -> str:
    """`fail, 0 of 10`."""
    return f"{status.value}, {number(points)} of {number(most)}"


def form_number(value: float) -> str:
    """As a field of a form has it: no digit is lost."""
    return f"{value:.10f}".rstrip("0").rstrip(".")


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
    """Raises Wrong. A `reason` is asked for where a check has judged; an `answer` is one, and comments of the bank are.
    Points may be left out where there is an answer, and where comments stand for points (`pointed`)."""
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
    return "" if comment.points is None else form_number(comment.points)


def author_of(text: str) -> str:
    """Raises Wrong."""
    written = " ".join(clean(text).split())
    if len(written) > AUTHOR_CHARS:
        raise Wrong(f"A name has at most {AUTHOR_CHARS} characters.")
    return written


def clean(text: str) -> str:
    """Line ends as they are in files, and no control characters."""
    lines = text.replace("\r\n", "\n").replace("\r", "\n").strip()
    return "".join(c for c in lines if c in "\n\t" or unicodedata.category(c) not in {"Cc", "Cs"})
