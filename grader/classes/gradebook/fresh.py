"""Files for platforms made from the roster alone."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence

from grader.classes.gradebook.cells import csv_line, number_text
from grader.classes.gradebook.identity import Kind, Platform, kinds
from grader.classes.gradebook.marks import Mark, Wanted
from grader.model.batch import Entry
from grader.report.text import html

Made = tuple[Iterator[str], list[str]]
NONE = "-"
"""What Moodle takes for no grade. An empty field would be 0 in a new grade item."""
MOODLE_MAX = 100.0


def fresh(
    platform: Platform, marks: Sequence[Mark], wanted: Sequence[Wanted], columns: Sequence[str]
) -> Made:
    """The lines of the file, and remarks. `columns` are the roster's further ones."""
    made: dict[Platform, Callable[[Sequence[Mark], Sequence[Wanted], _Roster], Made]] = {
        "canvas": _canvas,
        "moodle": _moodle,
        "blackboard": _blackboard,
    }
    return made[platform](marks, wanted, _Roster(columns, platform))


class _Roster:
    """The further columns, by what they say of a student."""

    def __init__(self, columns: Sequence[str], platform: Platform) -> None:
        self.known = kinds(columns, platform)

    def has(self, *wanted: Kind) -> bool:
        return any(kind in wanted for kind in self.known.values())

    def text(self, entry: Entry, *wanted: Kind) -> str:
        """The first field that says any of these."""
        for kind in wanted:
            for column, found in self.known.items():
                if found == kind and entry.extra.get(column):
                    return entry.extra[column]
        return ""


def _canvas(marks: Sequence[Mark], wanted: Sequence[Wanted], roster: _Roster) -> Made:
    remarks = _missing(
        roster,
        "Canvas",
        ("platform", "number", "login", "email"),
        "column 'SIS User ID', 'SIS Login ID' or 'Canvas id'",
        "SIS Login ID",
    )
    remarks.append(
        "Canvas makes a new assignment of each column: with --template it fills in one that is there"
    )

    def lines() -> Iterator[str]:
        yield csv_line(
            ["Student", "ID", "SIS User ID", "SIS Login ID", "Section", *(column.title for column in wanted)]
        )
        yield csv_line(["    Points Possible", "", "", "", "", *(column.max_points for column in wanted)])
        for mark in marks:
            entry = mark.entry
            known = [roster.text(entry, "platform"), roster.text(entry, "number")]
            login = roster.text(entry, "login", "email") or ("" if any(known) else entry.id)
            yield csv_line(
                [entry.name or entry.id, *known, login, roster.text(entry, "section"), *mark.points]
            )

    return lines(), remarks


def _moodle(marks: Sequence[Mark], wanted: Sequence[Wanted], roster: _Roster) -> Made:
    """By one column that every row has: Moodle takes a row without it for one more of the student before."""
    names: dict[Kind, str] = {"email": "Email address", "login": "Username", "number": "ID number"}
    filled = Counter(kind for mark in marks for kind in names if roster.text(mark.entry, kind))
    kind = max(names, key=lambda kind: filled[kind])
    by_id = not filled[kind]
    header = "Username" if by_id else names[kind]
    remarks = _missing(
        roster,
        "Moodle",
        ("email", "login", "number"),
        "column 'Email address', 'Username' or 'ID number'",
        "Username",
    )
    found = [(mark, mark.entry.id if by_id else roster.text(mark.entry, kind)) for mark in marks]
    remarks += [f"{mark.entry.id}: left out, without {header}" for mark, who in found if not who]
    if any(points is not None and points > MOODLE_MAX for mark in marks for points in mark.points):
        remarks.append("Moodle refuses the whole file for points above 100, unless its grades are unlimited")

    def lines() -> Iterator[str]:
        yield csv_line([header, "Full name", *(column.title for column in wanted), "Feedback"])
        for mark, who in found:
            if who:
                points = [NONE if points is None else points for points in mark.points]
                yield csv_line([who, mark.entry.name, *points, html(mark.comment)])

    return lines(), remarks


def _blackboard(marks: Sequence[Mark], wanted: Sequence[Wanted], roster: _Roster) -> Made:
    remarks = _missing(roster, "Blackboard", ("login",), "column 'Username'", "Username")
    remarks.append(
        "Blackboard makes a column of text of each new column: with --template it fills in one that is there"
    )

    def lines() -> Iterator[str]:
        titles = [f"{column.title} [Total Pts: {number_text(column.max_points)} Score]" for column in wanted]
        yield csv_line(["Last Name", "First Name", "Username", "Student ID", *titles], quoted=True)
        for mark in marks:
            entry = mark.entry
            who = [roster.text(entry, "login") or entry.id, roster.text(entry, "number")]
            yield csv_line([*_names(entry, roster), *who, *mark.points], quoted=True)

    return lines(), remarks


def _names(entry: Entry, roster: _Roster) -> tuple[str, str]:
    """Last and first name."""
    last, first = roster.text(entry, "last"), roster.text(entry, "first")
    if last or first:
        return last, first
    if "," in entry.name:
        last, _, first = entry.name.partition(",")
    else:
        first, _, last = entry.name.rpartition(" ")
    return last.strip(), first.strip()


def _missing(roster: _Roster, platform: str, wanted: Sequence[Kind], columns: str, instead: str) -> list[str]:
    if roster.has(*wanted):
        return []
    remarks = [f"the roster has no {columns}, by which {platform} finds students: ids stand as {instead}"]
    if platform == "Moodle" and roster.has("platform"):
        remarks.append(
            "the numbers of a bulk download are those of Moodle's offline grading worksheet: "
            "give it with --template"
        )
    return remarks
