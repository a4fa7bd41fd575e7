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
    """One mistake, and how it is put right. Logic is never repaired.

    `file` is relative to the package's folder, `line` the first line that changes (None for permission bits and
    renames). `before` and `after` are the changed lines, joined by newlines, after the repairs that come before this
    one; of a rename they are the two paths. Where a line is only added, the line beside it is part of both.
    `message` says what is wrong, `fix` how it is repaired by hand: a command, or the line as it should be.
    """

    kind: RepairKind
    file: str
    line: int | None = None
    before: str = ""
    after: str = ""
    message: str
    fix: str
