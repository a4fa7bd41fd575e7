"""A mechanical repair of a package: one mistake, the lines that it changes, and what is left of the points after it."""

from __future__ import annotations

from typing import Literal, get_args

from grader.model.record import Record

RepairKind = Literal[
    "executable-bit",
    "encoding",
    "byte-order-mark",
    "line-ends",
    "shebang",
    "file-name",
    "python-syntax",
    "manifest-line",
    "build-line",
    "package-name",
    "launch-type",
    "missing-import",
    "missing-call",
    "node-name",
    "topic-name",
    "parameter-name",
]
"""In the order in which a student would meet them."""

KINDS: tuple[RepairKind, ...] = get_args(RepairKind)
HALF: frozenset[RepairKind] = frozenset(
    {"python-syntax", "manifest-line", "build-line", "missing-import", "missing-call"}
)
DEFAULT_SHARES: dict[RepairKind, float] = {kind: 0.5 if kind in HALF else 1.0 for kind in KINDS}
"""How much of its points a criterion is worth that was judged on a copy with a repair of this kind."""


class Repair(Record):
    """One mistake, and how it is repaired. Logic is never repaired."""

    kind: RepairKind
    """What kind of repair it is; the rubric's `repairs` go by it."""
    file: str
    """A file of the submission, from the package's root."""
    line: int | None = None
    """The first line that changes, counted from 1; null for permission bits and renames."""
    before: str = ""
    """The changed lines as they are after the repairs that come before this one; of a rename, the path."""
    after: str = ""
    """The same lines, repaired, or the new path. Where a line is only added, the line beside it is part of both."""
    message: str
    """What is wrong."""
    fix: str
    """How it is repaired by hand: a command, or the line as it should be."""


def place_of(repair: Repair) -> str:
    """Return `src/talker.py line 12`, or the file alone."""
    return repair.file if repair.line is None else f"{repair.file} line {repair.line}"
