"""What the page of a submission shows of each criterion, and the form in which an instructor awards points."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import date

from grader.classes.gradebook import Row
from grader.classes.review.session import mark
from grader.model.result import AUTHOR_CHARS, COMMENT_CHARS, AppliedOverride, CriterionResult, Override
from grader.model.verdict import Status
from grader.report.sentences import SIGNS
from grader.rubric.model import Rubric
from grader.wording import number

MANUAL = "manual"


@dataclass(frozen=True, kw_only=True)
class Draft:
    """What a form was sent with and what became of it. In a `conflict` someone else has decided since; `error` says
    what is wrong with what was sent, `saved` when it was written."""

    points: str = ""
    comment: str = ""
    conflict: bool = False
    error: str = ""
    saved: str = ""
    typed: bool = True


@dataclass(frozen=True, kw_only=True)
class Card:
    """One criterion with its form. `override` is what stands in `overrides.yaml`, `applied` what the result has."""

    criterion: CriterionResult
    manual: bool
    hidden: bool
    override: Override | None
    applied: AppliedOverride | None
    draft: Draft | None

    @property
    def sign(self) -> str:
        return SIGNS[self.criterion.status]

    @property
    def seen(self) -> str:
        """What its form says that it was made from."""
        return mark(self.override)

    @property
    def points(self) -> str:
        """For the form's field."""
        if self.draft and self.draft.typed:
            return self.draft.points
        return plain(self.override.points) if self.override else ""

    @property
    def comment(self) -> str:
        """For the form's field."""
        if self.draft and self.draft.typed:
            return self.draft.comment
        return self.override.comment if self.override else ""

    @property
    def said(self) -> str:
        """What the check says, where a person decided."""
        if self.applied is None or self.manual:
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


def cards(row: Row, rubric: Rubric, decided: Mapping[str, Override], drafts: Mapping[str, Draft]) -> Cards:
    """Return the cards of a submission."""
    found = [card(row, rubric, name, decided, drafts) for name in (c.id for c in row.result.criteria)]
    whole = row.result.error is None
    mine = [c for c in found if c.override is not None]
    waiting = [c for c in found if c.override is None and _waits(c, whole=whole)]
    others = [c for c in found if c not in mine and c not in waiting]
    return Cards(waiting=waiting, decided=mine, rest=sorted(others, key=_nothing_lost))


def card(
    row: Row,
    rubric: Rubric,
    criterion: str,
    decided: Mapping[str, Override],
    drafts: Mapping[str, Draft],
) -> Card:
    """One of them; the result has a criterion of that id."""
    result = row.result
    asked = next((c for c in rubric.criteria if c.id == criterion), None)
    return Card(
        criterion=next(c for c in result.criteria if c.id == criterion),
        manual=asked is not None and asked.check == MANUAL,
        hidden=asked is not None and asked.visibility == "hidden",
        override=decided.get(criterion),
        applied=next((o for o in result.overrides if o.criterion == criterion), None),
        draft=drafts.get(criterion),
    )


def _waits(card: Card, *, whole: bool) -> bool:
    """Of what could not be graded at all, only what people decide anyway waits for one."""
    status = card.criterion.status
    return card.criterion.counts and ((status.is_open and whole) or (card.manual and status.is_open))


def _nothing_lost(card: Card) -> bool:
    return card.criterion.points >= card.criterion.max_points


def verdict(status: Status, points: float, most: float) -> str:
    """`fail, 0 of 10`."""
    return f"{status.value}, {number(points)} of {number(most)}"


def plain(value: float) -> str:
    """As a field of a form has it: no digit is lost."""
    return f"{value:.10f}".rstrip("0").rstrip(".")


POINTS = re.compile(r"-?(?:\d{1,9}(?:[.,]\d{0,9})?|[.,]\d{1,9})", re.ASCII)


class Wrong(Exception):
    """What was typed cannot be taken; the message says why."""


def override_of(
    points: str, comment: str, author: str, *, least: float = 0.0, most: float, reason: bool
) -> Override:
    """Raises Wrong. A `reason` is asked for where a check has judged."""
    text = points.strip()
    if not text:
        raise Wrong("How many points?")
    if not POINTS.fullmatch(text) or (text.startswith("-") and least >= 0):
        raise Wrong("Points are a number, such as 7 or 2.5.")
    value = float(text.replace(",", "."))
    if value > most:
        raise Wrong(f"It has at most {number(most)} points.")
    if value < least:
        raise Wrong(f"It has at least {number(least)} points.")
    written = clean(comment)
    if len(written) > COMMENT_CHARS:
        raise Wrong(f"At most {COMMENT_CHARS} characters, please: there are {len(written)}.")
    if reason and not written:
        raise Wrong("Say why: the student sees the reason beside the points.")
    return Override(points=value, comment=written, author=author, date=date.today())  # noqa: DTZ011 - the person's day


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
