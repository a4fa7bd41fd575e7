"""How what lies on the disk stands to what git has, as `grader check` tells a student. It changes no verdict."""

from __future__ import annotations

from grader.model.record import Record


class Point(Record):
    """One way in which what will be marked differs from what was checked, and the command that fixes it.

    `kind` is a word for programs (`uncommitted`, `untracked`, `ignored`, `mode`, `unpushed`, `other-branch`, …),
    `text` one line for people, `mend` a command or "". Of a `remark` it is not known whether anything differs.
    """

    kind: str
    text: str
    mend: str = ""
    remark: bool = False


class Standing(Record):
    """`summary` says in one line what git has where nothing differs; `points` are empty then."""

    points: tuple[Point, ...] = ()
    summary: str = ""
