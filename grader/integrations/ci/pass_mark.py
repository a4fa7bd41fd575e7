"""The pass mark that a workflow asks for: `60%`, or points."""

from __future__ import annotations

import re
from dataclasses import dataclass

from grader.errors import UsageError
from grader.rubric.load import LoadedRubric
from grader.rubric.model import Rubric
from grader.untrusted_text import line
from grader.wording import number

FORM = re.compile(r"(\d{1,6}(?:\.\d{1,6})?)\s*(%?)")
HINT = "write points (12.5) or a percentage of the visible points (60%)"
SHOWN_CHARS = 100


@dataclass(frozen=True, kw_only=True)
class Mark:
    """`value` in percent of the points of the visible criteria, or in these points themselves."""

    value: float
    percent: bool


def read_mark(text: str) -> Mark | None:
    """None for an empty text. Raises UsageError."""
    if not text:
        return None
    found = FORM.fullmatch(text)
    if found is None:
        raise UsageError(f'pass-mark: "{line(text, SHOWN_CHARS)}" is no mark', hint=HINT)
    mark = Mark(value=float(found[1]), percent=bool(found[2]))
    if not mark.percent and 0 < mark.value < 1:  # 0.6 is more likely to be meant as 60%
        raise UsageError(f"pass-mark: {found[1]} is less than a point", hint=HINT)
    if mark.percent and mark.value > 100:
        raise UsageError(f"pass-mark: {number(mark.value)}% is more than 100%", hint=HINT)
    return mark


def visible_points(rubric: Rubric) -> float:
    """What a student can see to be reached."""
    return sum(c.points for c in rubric.criteria if c.visibility == "visible")


def with_mark(loaded: LoadedRubric, mark: Mark | None) -> LoadedRubric:
    """The rubric with that mark in place of its own, as large a part of all its points as it is of the visible ones.

    Raises UsageError for more points than can be reached.
    """
    if mark is None:
        return loaded
    rubric, most = loaded.rubric, visible_points(loaded.rubric)
    if not mark.percent and mark.value > most:
        raise UsageError(
            f"pass-mark: {number(mark.value)} points, but {rubric.id} has {number(most)} visible ones",
            hint=HINT,
        )
    share = mark.value / (100 if mark.percent else most or 1)
    return loaded.model_copy(
        update={"rubric": rubric.model_copy(update={"pass_mark": share * rubric.max_points})}
    )


def needed_words(rubric: Rubric, points: float) -> str:
    """What passing takes, of that many points that are counted."""
    if rubric.pass_mark is None:
        return "to pass, every visible criterion has to be reached"
    needed = rubric.pass_mark * points / (rubric.max_points or 1)
    return f"to pass, it takes {number(needed)}"
