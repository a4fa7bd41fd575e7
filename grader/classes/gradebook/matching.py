"""A learning platform's rows and a class's students: which belong together, and which marks they get.

`kinds` says what a platform's columns are; `row_identity` and `entry_identity` give who a row and a student are, and
`match` which belong together, only where there is no doubt. A `Book` and its rows come in, and `marks_of` gives one
mark per submission; `new_import_file` gives a file to import, made from the roster alone.
"""

from __future__ import annotations

import re
import unicodedata
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

from grader.classes.gradebook.table import (
    Book,
    GradebookRow,
    comment,
    criterion_points,
    csv_line,
    error_text,
    late_text,
    number_text,
)
from grader.model.batch import Entry
from grader.model.result import GradingResult
from grader.report.text import html

Platform = Literal["canvas", "moodle", "blackboard"]
ColumnKind = Literal["platform", "number", "login", "email", "name", "first", "last", "section"]

# A column's name without blanks and signs, in small letters; the platforms' own names in a few languages.
_KINDS: Mapping[ColumnKind, str] = {
    "number": "sisuserid sisid studentid studentnumber studentno idnumber matriculationnumber matrikelnummer "
    "registrationnumber matricule idnummer númerodeid numérodidentification",
    "login": "sisloginid loginid login username user userid netid uniqueid benutzername anmeldename "
    "nomdutilisateur nombredeusuario",
    "email": "email emailaddress mail emailadresse adressedecourriel direccióndecorreo indirizzoemail",
    "name": "student fullname vollständigername nomcomplet nombrecompleto",
    "first": "firstname givenname vorname prénom nombre nome",
    "last": "lastname surname familyname nachname nomdefamille apellidos apellido cognome",
    "section": "section",
}
_OWN_ID: Mapping[Platform, str] = {
    "canvas": "id canvasid canvasuserid",
    "moodle": "id identifier moodleid participant identifiant identificador",
    "blackboard": "",
}


def kinds(columns: Iterable[str], platform: Platform) -> dict[str, ColumnKind]:
    """Return what each column says of a student, for those that say anything."""
    known: dict[str, ColumnKind] = {name: kind for kind, names in _KINDS.items() for name in names.split()}
    known |= dict.fromkeys(_OWN_ID[platform].split(), "platform")
    return {
        column: known[letters_and_digits(column)] for column in columns if letters_and_digits(column) in known
    }


def letters_and_digits(text: str) -> str:
    """Return the letters and digits of a text alone, small."""
    folded = unicodedata.normalize("NFKC", text).casefold()
    return "".join(sign for sign in folded if sign.isalnum())


def key(text: str) -> str:
    """Return the same for all that is written alike: invisible signs, case and blanks do not tell students apart."""
    signs = unicodedata.normalize("NFKC", text)
    # Cf: signs that only format, and cannot be seen
    shown = "".join(sign for sign in signs if unicodedata.category(sign) != "Cf")
    return " ".join(shown.casefold().split())


@dataclass(kw_only=True)
class Identity:
    """What is known of one student. `sure` are pairs of a kind and a key that belong to one person only."""

    sure: set[tuple[str, str]] = field(default_factory=set)
    name: str = ""


def row_identity(fields: Mapping[str, str], known: Mapping[str, ColumnKind]) -> Identity:
    """Return who a row of a platform's export is about, or a roster's row by its further columns."""
    identity, first, last = Identity(), "", ""
    for column, kind in known.items():
        text = key(fields.get(column, ""))
        if not text or kind == "section":
            continue
        if kind == "name":
            identity.name = _first_name_first(text)
        elif kind == "first":
            first = text
        elif kind == "last":
            last = text
        else:
            identity.sure.add(_sure(kind, text))
    identity.name = identity.name or " ".join(part for part in (first, last) if part)
    return identity


def entry_identity(entry: Entry, platform: Platform) -> Identity:
    """Return who a submission is of. Its id may be any of the platform's."""
    identity = row_identity(entry.extra, kinds(entry.extra, platform))
    identity.sure |= {(kind, key(entry.id)) for kind in ("platform", "number", "login")}
    identity.name = _first_name_first(key(entry.name)) or identity.name
    if any(kind == "platform" and text in identity.name.split() for kind, text in identity.sure):
        identity.name = ""  # `Participant 123` is no one's name
    return identity


def _sure(kind: ColumnKind, text: str) -> tuple[str, str]:
    """Return the kind and the text by which a person is known. Many log in by their address, so both are one kind;
    Moodle writes `Participant 123` for the number 123."""
    if kind == "platform":
        number = re.search(r"\d+$", text)
        return kind, number.group() if number else text
    return ("login" if kind == "email" else kind), text


def _first_name_first(name: str) -> str:
    """Return `ada lovelace` for `lovelace, ada`."""
    last, comma, first = name.partition(",")
    return " ".join(f"{first} {last}".split()) if comma else name


def match(ours: Sequence[Identity], theirs: Sequence[Identity]) -> tuple[dict[int, int], dict[int, str]]:
    """Return the row of each submission, by their places, and why others have none.

    They belong together by what belongs to one person only; if one side has nothing of that, by name.
    """
    by_sure, by_name = defaultdict[tuple[str, str], set[int]](set), defaultdict[str, set[int]](set)
    for place, identity in enumerate(theirs):
        for sure in identity.sure:
            by_sure[sure].add(place)
        if identity.name:
            by_name[identity.name].add(place)
    found = {}
    for place, identity in enumerate(ours):
        rows = set().union(*(by_sure.get(sure, set()) for sure in identity.sure))
        found[place] = rows or by_name.get(identity.name, set())
        found[place] = {row for row in found[place] if not _contradict(identity, theirs[row])}
    wanted = defaultdict[int, list[int]](list)
    for place, rows in found.items():
        for row in rows:
            wanted[row].append(place)
    doubtful = {place: why for place, rows in found.items() if (why := _doubt(rows, wanted))}
    return {place: next(iter(rows)) for place, rows in found.items() if place not in doubtful}, doubtful


def _contradict(ours: Identity, theirs: Identity) -> bool:
    """Return whether only the platform's number says so, and the names have nothing in common: Moodle numbers teams
    too."""
    if not (ours.name and theirs.name) or any(kind != "platform" for kind, _ in ours.sure & theirs.sure):
        return False
    name = letters_and_digits(ours.name)
    # an initial is in nearly every name
    return not any(letters_and_digits(word) in name for word in theirs.name.split() if len(word) > 1)


def _doubt(rows: set[int], wanted: dict[int, list[int]]) -> str:
    if not rows:
        return "no row there has this id, number, login, address or name"
    if len(rows) > 1:
        return f"{len(rows)} rows there could be this student"
    (row,) = rows
    return "another submission fits the same row" if len(wanted[row]) > 1 else ""


Made = tuple[Iterator[str], list[str]]
NONE = "-"
"""What Moodle takes for no grade. An empty field would be 0 in a new grade item."""
MOODLE_MAX = 100.0


def new_import_file(
    platform: Platform, marks: Sequence[Mark], wanted: Sequence[PointsColumn], columns: Sequence[str]
) -> Made:
    """Return the lines of the file, and remarks. `columns` are the roster's further ones."""
    made: dict[Platform, Callable[[Sequence[Mark], Sequence[PointsColumn], _Roster], Made]] = {
        "canvas": _canvas,
        "moodle": _moodle,
        "blackboard": _blackboard,
    }
    return made[platform](marks, wanted, _Roster(columns, platform))


class _Roster:
    """The further columns, by what they say of a student."""

    def __init__(self, columns: Sequence[str], platform: Platform) -> None:
        self.known = kinds(columns, platform)

    def has(self, *wanted: ColumnKind) -> bool:
        return any(kind in wanted for kind in self.known.values())

    def text(self, entry: Entry, *wanted: ColumnKind) -> str:
        """Return the first field that says any of these."""
        for kind in wanted:
            for column, found in self.known.items():
                if found == kind and entry.extra.get(column):
                    return entry.extra[column]
        return ""


def _canvas(marks: Sequence[Mark], wanted: Sequence[PointsColumn], roster: _Roster) -> Made:
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
        # blanks before it: so Canvas writes this row, and so it finds it
        yield csv_line(["    Points Possible", "", "", "", "", *(column.max_points for column in wanted)])
        for mark in marks:
            entry = mark.entry
            known = [roster.text(entry, "platform"), roster.text(entry, "number")]
            login = roster.text(entry, "login", "email") or ("" if any(known) else entry.id)
            yield csv_line(
                [entry.name or entry.id, *known, login, roster.text(entry, "section"), *mark.points]
            )

    return lines(), remarks


def _moodle(marks: Sequence[Mark], wanted: Sequence[PointsColumn], roster: _Roster) -> Made:
    """By one column that every row has: Moodle takes a row without it for one more of the student before."""
    names: dict[ColumnKind, str] = {"email": "Email address", "login": "Username", "number": "ID number"}
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


def _blackboard(marks: Sequence[Mark], wanted: Sequence[PointsColumn], roster: _Roster) -> Made:
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
    """Return the last and the first name."""
    last, first = roster.text(entry, "last"), roster.text(entry, "first")
    if last or first:
        return last, first
    if "," in entry.name:
        last, _, first = entry.name.partition(",")
    else:
        first, _, last = entry.name.rpartition(" ")
    return last.strip(), first.strip()


def _missing(
    roster: _Roster, platform: str, wanted: Sequence[ColumnKind], columns: str, instead: str
) -> list[str]:
    if roster.has(*wanted):
        return []
    remarks = [f"the roster has no {columns}, by which {platform} finds students: ids stand as {instead}"]
    if platform == "Moodle" and roster.has("platform"):
        remarks.append(
            "the numbers of a bulk download are those of Moodle's offline grading worksheet: "
            "give it with --template"
        )
    return remarks


@dataclass(frozen=True, kw_only=True)
class PointsColumn:
    """A column of points. `title` is what a new one is called, `names` what one that is there may be called."""

    title: str
    names: tuple[str, ...]
    max_points: float


@dataclass(frozen=True, kw_only=True)
class Mark:
    """`points` by column, None where they are open; `open` says why. `late_cost` is what being late cost.

    `comment` is for the student, `gated` says whether a gate keeps the points low.
    """

    entry: Entry
    points: tuple[float | None, ...]
    open: str = ""
    comment: str = ""
    late_cost: float = 0.0
    gated: bool = False


def wanted_columns(book: Book, column: str, *, per_criterion: bool) -> tuple[PointsColumn, ...]:
    """Return one column for the points, or one for each criterion that is worth any."""
    base = column or book.title
    if not per_criterion:
        names = (column,) if column else (book.title, book.rubric_id)
        return (PointsColumn(title=base, names=names, max_points=book.max_points),)
    worth = [criterion for criterion in book.criteria if criterion.max_points > 0 or criterion.extra]
    alike = Counter(criterion.title for criterion in worth)
    columns = []
    for one in worth:
        # two criteria may have one title, and two columns may not
        title = f"{base} - {one.title}" + (f" ({one.id})" if alike[one.title] > 1 else "")
        called = (title, f"{base} - {one.id}", one.id)
        columns.append(PointsColumn(title=title, names=called, max_points=one.max_points))
    return tuple(columns)


def marks_of(book: Book, rows: Iterable[GradebookRow], *, per_criterion: bool) -> list[Mark]:
    """Return every row's mark. Of a result of status `error` no points count, of an inconclusive one the sure ones."""
    worth = [criterion.id for criterion in book.criteria if criterion.max_points > 0 or criterion.extra]
    return [_mark(row, worth if per_criterion else None) for row in rows]


def remarks_of(marks: Sequence[Mark], *, per_criterion: bool) -> Iterator[str]:
    """Yield whose points are open, and whose criteria do not say what being late cost."""
    for mark in marks:
        if mark.open:
            yield f"{mark.entry.id}: no grade ({mark.open})"
    late = [mark.entry.id for mark in marks if mark.late_cost]
    if per_criterion and late:
        yield f"criteria do not include what being late cost: {', '.join(late)}"
    gated = [mark.entry.id for mark in marks if mark.gated]
    if per_criterion and gated:
        yield f"criteria do not include what a gate cost: {', '.join(gated)}"


def _mark(row: GradebookRow, worth: Sequence[str] | None) -> Mark:
    result, late = row.result, row.result.late
    cost = late.points_before - late.points if late else 0.0
    return Mark(
        entry=row.entry,
        points=_points(result, worth),
        open="" if result.status == "graded" else f"{result.status}: {error_text(result)}".rstrip(": "),
        comment="; ".join(text for text in (late_text(result), comment(result)) if text),
        late_cost=cost,
        gated=result.gate is not None,
    )


def _points(result: GradingResult, worth: Sequence[str] | None) -> tuple[float | None, ...]:
    if worth is None:
        return (result.points if result.status == "graded" else None,)
    # a criterion that was not judged is no criterion with 0 points
    if result.status == "error":
        return (None,) * len(worth)
    found = criterion_points(result)
    return tuple(found.get(criterion) for criterion in worth)
