"""`similarity.json`: submissions of a class that are alike, for a person to look at. Schema `grader.similarity/1`.

No mark depends on any of it.
"""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from grader.model.record import Record

Lines = tuple[tuple[int, int], ...]
"""First and last lines of stretches, counted from 1."""


class FileMatch(Record):
    """What of one file of the first submission is in a file of the second, the one that has most of it."""

    file_a: str
    file_b: str
    lines_a: Lines
    lines_b: Lines


class Pair(Record):
    """Two submissions, `a` before `b`.

    `similarity_a` is the share (0 to 1) of a's own code that is in b too; a's own code is what is left when everything
    in `TakenOut` is taken out. `lines_a` is the number of a's lines that hold it.
    """

    a: str
    b: str
    similarity_a: float
    similarity_b: float
    lines_a: int
    lines_b: int
    files: tuple[FileMatch, ...]


class TakenOut(Record):
    """What is no one's own.

    `starter` are the files of the starter code, `tutorials` those that the grader knows. `common` is the number of
    fingerprints that are in more than half of the submissions, None where the class is too small to say so.
    """

    starter: tuple[str, ...] = ()
    tutorials: tuple[str, ...] = ()
    common: int | None = None


class NotCompared(Record):
    """A submission, or one file of it, that could not be compared, and why."""

    id: str
    file: str = ""
    reason: str


class Similarity(Record):
    """`threshold` is the share from which a pair is named, `min_lines` the least number of matching lines of each.

    `clusters` are the submissions that hang together by pairs. `too_little` have too little code of their own to tell
    anything. `same_group` counts the pairs that were left out because both are of one group.
    """

    schema_: Literal["grader.similarity/1"] = Field(default="grader.similarity/1", alias="schema")
    library: str
    library_version: str
    threshold: float
    min_lines: int
    compared: int
    pairs: tuple[Pair, ...] = ()
    clusters: tuple[tuple[str, ...], ...] = ()
    taken_out: TakenOut = TakenOut()
    too_little: tuple[str, ...] = ()
    not_compared: tuple[NotCompared, ...] = ()
    same_group: int = 0
    notes: tuple[str, ...] = ()
