"""What submissions have in common: which fingerprints are nobody's own, and for two submissions what they share."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from grader.classes.similarity.tokens import Marks, Numbers, Text, covered
from grader.model.similarity import FileMatch, Lines, Pair

COMMON_FROM = 6
"""Submissions a class must have before what most of them share counts as nobody's own."""
MATRIX_COLUMNS = 4096
CANDIDATES_MAX = 20_000
NEAR = 0.25
"""The share of fingerprints from which two submissions are looked at sign by sign."""


@dataclass(frozen=True, kw_only=True)
class Own:
    """One file without what is nobody's own: `prints` and `signs` mark what is left of the text's."""

    text: Text
    prints: Marks
    signs: Marks


@dataclass(frozen=True)
class Work:
    """One submission."""

    id: str
    files: tuple[Own, ...]

    @cached_property
    def prints(self) -> Numbers:
        """Its own fingerprints, sorted, each once."""
        return distinct(file.text.prints[file.prints] for file in self.files)

    @cached_property
    def signs(self) -> int:
        """How long its own code is."""
        return sum(int(file.signs.sum()) for file in self.files)

    @cached_property
    def lines(self) -> int:
        """How many lines its own code is on."""
        return sum(len(np.unique(file.text.lines[file.signs])) for file in self.files)


def common_prints(texts: Sequence[Sequence[Text]]) -> Numbers:
    """The fingerprints that are in more than half of the submissions."""
    each = [distinct(text.prints for text in one) for one in texts]
    prints, counts = np.unique(np.concatenate([_NONE, *each]), return_counts=True)
    return prints[counts * 2 > len(texts)]


def own_work(name: str, texts: Sequence[Text], taken_out: Numbers) -> Work:
    """The submission without the fingerprints in `taken_out`, which is sorted."""
    return Work(name, tuple(_own(text, taken_out) for text in texts))


def candidates(works: Sequence[Work]) -> tuple[list[tuple[int, int]], bool]:
    """The pairs that share enough fingerprints to be worth a closer look, those that share most first, and whether
    some had to be left out."""
    shared = _shared_counts(works)
    sizes = np.array([max(len(work.prints), 1) for work in works])
    ratio = shared / np.minimum(sizes[:, None], sizes[None, :])
    first, second = np.nonzero(np.triu(ratio >= NEAR, 1))
    order = np.argsort(-ratio[first, second], kind="stable")
    pairs = [(int(first[i]), int(second[i])) for i in order[:CANDIDATES_MAX]]
    return pairs, len(order) > CANDIDATES_MAX


def pair(a: Work, b: Work) -> Pair:
    """What the two have in common."""
    here, there = _hits(a, b.prints), _hits(b, a.prints)
    return Pair(
        a=a.id,
        b=b.id,
        similarity_a=round(_size(here) / max(a.signs, 1), 4),
        similarity_b=round(_size(there) / max(b.signs, 1), 4),
        lines_a=_line_count(a, here),
        lines_b=_line_count(b, there),
        files=tuple(_file_matches(a, b)),
    )


def clusters(pairs: Sequence[tuple[str, str]]) -> tuple[tuple[str, ...], ...]:
    """The submissions that hang together by pairs, the largest clusters first."""
    found: dict[str, set[str]] = {}
    for a, b in pairs:
        joined = found.get(a, {a}) | found.get(b, {b})
        found.update(dict.fromkeys(joined, joined))
    unique = {tuple(sorted(group)) for group in found.values()}
    return tuple(sorted(unique, key=lambda group: (-len(group), group)))


def distinct(prints: Iterable[Numbers]) -> Numbers:
    """All of them, sorted, each once."""
    return np.unique(np.concatenate([_NONE, *prints]))


def _own(text: Text, taken_out: Numbers) -> Own:
    others = np.isin(text.prints, taken_out)
    signs = ~covered(text, others)
    return Own(text=text, prints=~others, signs=signs)


def _shared_counts(works: Sequence[Work]) -> np.ndarray:
    """How many fingerprints each two share, a square. Never more than a strip of the table of all is in memory."""
    prints = np.concatenate([_NONE, *(work.prints for work in works)])
    owners = np.repeat(np.arange(len(works)), [len(work.prints) for work in works])
    _, numbers, counts = np.unique(prints, return_inverse=True, return_counts=True)
    several = counts[numbers] > 1
    columns, owners = np.unique(numbers[several], return_inverse=True)[1], owners[several]
    order = np.argsort(columns, kind="stable")
    columns, owners = columns[order], owners[order]
    shared = np.zeros((len(works), len(works)), dtype=np.float32)
    for begin in range(0, int(columns[-1]) + 1 if len(columns) else 0, MATRIX_COLUMNS):
        low, high = np.searchsorted(columns, [begin, begin + MATRIX_COLUMNS])
        strip = np.zeros((len(works), MATRIX_COLUMNS), dtype=np.float32)
        strip[owners[low:high], columns[low:high] - begin] = 1
        shared += strip @ strip.T
    return shared


def _hits(work: Work, others: Numbers) -> list[Marks]:
    """For each file, which of its own signs are in the other submission too."""
    return [
        file.signs & covered(file.text, file.prints & np.isin(file.text.prints, others))
        for file in work.files
    ]


def _size(hits: Sequence[Marks]) -> int:
    return sum(int(marks.sum()) for marks in hits)


def _line_count(work: Work, hits: Sequence[Marks]) -> int:
    return sum(len(np.unique(file.text.lines[marks])) for file, marks in zip(work.files, hits, strict=True))


def _file_matches(a: Work, b: Work) -> Iterator[FileMatch]:
    """Each file of a with the one of b that has most of it."""
    for file in a.files:
        best = max(b.files, key=lambda other: _common(file, other), default=None)
        if best is None or not _common(file, best):
            continue
        yield FileMatch(
            file_a=file.text.path,
            file_b=best.text.path,
            lines_a=_stretches(file, best),
            lines_b=_stretches(best, file),
        )


def _common(one: Own, other: Own) -> int:
    return len(np.intersect1d(one.text.prints[one.prints], other.text.prints[other.prints]))


def _stretches(one: Own, other: Own) -> Lines:
    """The lines of the one file that are in the other, neighbours joined."""
    hits = covered(one.text, one.prints & np.isin(one.text.prints, other.text.prints[other.prints]))
    lines = np.unique(one.text.lines[one.signs & hits])
    if not len(lines):
        return ()
    filled = np.unique(one.text.lines)  # empty lines and comments between two of them do not part them
    at = np.searchsorted(filled, lines)
    parts = np.split(lines, np.flatnonzero(np.diff(at) > 1) + 1)
    return tuple((int(part[0]), int(part[-1])) for part in parts)


_NONE = np.zeros(0, dtype=np.int64)
