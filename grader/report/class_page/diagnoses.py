"""Submissions with the same diagnosis: the same criterion, and the same message but for numbers and names."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field

from grader.model.batch import MISSING, ROSTER
from grader.model.result import GradingResult
from grader.model.verdict import Status
from grader.report.class_page.lines import MESSAGE_CHARS
from grader.untrusted_text import line

WORDINGS_MAX = 40
LOST = {Status.PARTIAL, Status.FAIL}

_NAME = re.compile(
    r"(?:[\w.~@+-]*/)+[\w.~@+-]*|\b[\w-]+\.(?:py|cpp|cc|c|h|hpp|xml|launch|txt|sh|msg|srv|ya?ml)\b"
)
_QUOTED = re.compile(r"'[^']*'|\"[^\"]*\"|\u2018[^\u2019]*\u2019|\u201c[^\u201d]*\u201d|`[^`]*`")
_NUMBER = re.compile(r"(?<![\w.])[+-]?\d+(?:[.,]\d+)*(?:e[+-]?\d+)?", re.ASCII)
_LIST = re.compile(r"(?P<one>…|N)(?:(?:, | and | or |, and )(?P=one))+")


def reduced(message: str) -> str:
    """A message without what is one submission's own: names and quoted words are `…`, numbers are `N`."""
    text = _QUOTED.sub("…", message)
    text = _NAME.sub("…", text)
    text = _NUMBER.sub("N", text)
    return " ".join(_LIST.sub(r"\g<one>", text).split())


@dataclass(kw_only=True)
class Diagnosis:
    """One fault that many may share: `members` are the places of its submissions, `wordings` what it was called (`more`
    where there are others). `criterion` is an id, empty for what could not be graded."""

    criterion: str
    members: list[int] = field(default_factory=list)
    wordings: Counter[str] = field(default_factory=Counter)
    more: bool = False

    @property
    def message(self) -> str:
        """As most of them have it."""
        return self.wordings.most_common(1)[0][0]

    def add(self, place: int, message: str) -> None:
        """One more submission."""
        self.members.append(place)
        if message in self.wordings or len(self.wordings) < WORDINGS_MAX:
            self.wordings[message] += 1
        else:
            self.more = True


class Diagnoses:
    """Groups what is added to it."""

    def __init__(self) -> None:
        self._found: dict[tuple[str, str], Diagnosis] = {}

    def add(self, place: int, result: GradingResult) -> None:
        """All faults of one submission. What only follows from another fault (`blocked`) is none of its own."""
        for criterion, message in _faults(result):
            text = line(message, MESSAGE_CHARS)
            key = criterion, reduced(text)
            found = self._found.setdefault(key, Diagnosis(criterion=criterion))
            found.add(place, text)

    def largest_first(self) -> list[Diagnosis]:
        """All of them; those of one size in the order in which they were found."""
        return sorted(self._found.values(), key=lambda found: -len(found.members))


def _faults(result: GradingResult) -> Iterator[tuple[str, str]]:
    """Of each criterion what the check said, or why nothing could be graded, with no criterion. What a person decided
    keeps the words of the check."""
    if result.error is not None:
        if result.error.kind not in {MISSING, ROSTER}:
            yield "", result.error.message
        return
    said = {override.criterion: override.automatic.message for override in result.overrides}
    for criterion in result.criteria:
        if criterion.status in LOST:
            message = said.get(criterion.id, criterion.message)
            yield criterion.id, message or criterion.measured or criterion.title
