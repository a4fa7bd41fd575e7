"""CSV as spreadsheets and learning platforms write it, whatever the encoding and delimiter, becomes entries.

Every fault of a row is reported with its line, all of them at once.

`Local` says which paths of this machine a row may name: a roster may come from a web form.
"""

from __future__ import annotations

import codecs
import csv
import difflib
import io
import os
import re
import unicodedata
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta, timezone
from pathlib import Path
from typing import NamedTuple
from urllib.parse import unquote

from grader.errors import GraderError, SubmissionError, UsageError
from grader.files import read_given
from grader.intake.names import brief, encodable, folder_key, is_archive_name, is_package_name
from grader.intake.source import NO_REF, parse_source
from grader.model.batch import Entry, Roster, RosterFault

BYTES_MAX = 32 << 20
FIELD_LETTERS_MAX = 10_000
UNREADABLE_MAX = 50
DELIMITERS = (",", ";", "\t")
_SEPARATOR = re.compile(r"\"?sep=(.)\"?[\r\n]*", re.IGNORECASE)


class RosterRow(NamedTuple):
    """The fields of one row by their column's name, the line in which it begins, counted from 1, and what is wrong.

    In a row that is `shifted`, no field but the first can be told to be in its column.
    """

    line: int
    fields: Mapping[str, str]
    faults: tuple[str, ...] = ()
    shifted: bool = False


class Table(NamedTuple):
    """Column names as they are written, the line that names them, and the rows that are not empty, in their order."""

    columns: tuple[str, ...]
    rows: tuple[RosterRow, ...]
    line: int = 1


def read_table(path: Path) -> Table:
    """Read a table. Raises UsageError where the file is none of text; what is wrong with a row is said by the row."""
    lines = list(io.StringIO(_text(path), newline=""))
    found = _rows(lines, *_delimiter(lines))
    header = next(found, None)
    if header is None:
        raise UsageError(f"{path}: the file is empty", hint="its first line names the columns: id,source")
    line, fields, faults = header
    if faults:
        raise UsageError(f"{path}:{line}: {faults[0]}", hint="the first line names the columns: id,source")
    columns = tuple(_bare(name) for name in fields)
    return Table(columns, tuple(_row(columns, *row) for row in found), line)


class _Fields(NamedTuple):
    line: int
    fields: list[str]
    faults: tuple[str, ...] = ()


def _rows(lines: Sequence[str], delimiter: str, start: int) -> Iterator[_Fields]:
    """Yield each row that is not empty. After one that cannot be read, the next line begins a row again; of it there is
    the first field at most."""
    unreadable = 0
    while start < len(lines) and unreadable < UNREADABLE_MAX:
        # Python 3.10 reads no zero byte: its place is kept by a sign that says the same to a reader.
        reader = csv.reader(
            (line.replace("\0", "\ufffd") for line in lines[start:]), delimiter=delimiter, strict=True
        )
        begins = start
        try:
            for fields in reader:
                zero = any("\0" in line for line in lines[begins : start + reader.line_num])
                if any(field.strip() for field in fields):
                    yield _Fields(begins + 1, fields, ("a zero byte in it",) if zero else ())
                begins = start + reader.line_num
        except csv.Error as error:
            # a field with a quotation mark may be the one that does not end
            first = lines[begins].partition(delimiter)[0]
            yield _Fields(begins + 1, [] if '"' in first else [first], (_explain_csv(error),))
            start, unreadable = begins + 1, unreadable + 1
        else:
            return
    if start < len(lines):
        yield _Fields(start + 1, [], ("too many rows that cannot be read before it: the rest is left out",))


def _explain_csv(error: csv.Error) -> str:
    said = str(error)  # these words are Python's
    if said == "unexpected end of data":
        return "a quotation mark that never ends"
    if "expected after" in said:
        return "a quotation mark that does not end where its field ends"
    return f"no CSV: {said}"


def _row(columns: Sequence[str], line: int, fields: list[str], faults: tuple[str, ...]) -> RosterRow:
    named = {name: _bare(field) for name, field in zip(columns, fields, strict=False) if name}
    shifted = any(field.strip() for field in fields[len(columns) :])
    found = list(faults)
    if shifted:
        found.append(f"{len(fields)} fields, but the first line names {len(columns)} columns")
    if any(len(field) > FIELD_LETTERS_MAX for field in fields):
        found.append(f"a field of more than {FIELD_LETTERS_MAX} letters")
    return RosterRow(line, named, tuple(found), shifted)


def _bare(field: str) -> str:
    """Return a field without blanks around it, and without invisible signs that are copied into spreadsheets."""
    return field.strip().strip("\ufeff\u200b\u200e\u200f\u2060").strip()


def _delimiter(lines: Sequence[str]) -> tuple[str, int]:
    """Return what stands between fields, and the lines before the header: Excel may say `sep=;` in the first."""
    if lines and (said := _SEPARATOR.fullmatch(lines[0])):
        return said[1], 1
    return delimiter_of(next((line for line in lines if line.strip()), "")), 0


def delimiter_of(header: str) -> str:
    """Return what stands between the cells of a table, by the line that names its columns."""
    return max(DELIMITERS, key=re.sub(r'"[^"]*"', "", header).count)  # outside of quotation marks


def _text(path: Path) -> str:
    data = read_given(path, BYTES_MAX, hint="give a CSV file, a folder, or an export")
    if is_archive_name(path.name):
        raise UsageError(f"{path}: an archive is not a roster", hint="unpack it first, and give the folder")
    if data is None:
        raise UsageError(f"{path}: larger than {BYTES_MAX >> 20} MB: this is not a roster")
    return text_of(data, path)


_MARKS = (  # the longer ones first: UTF-32's begins with UTF-16's
    (codecs.BOM_UTF32_LE, "utf-32-le"),
    (codecs.BOM_UTF32_BE, "utf-32-be"),
    (codecs.BOM_UTF16_LE, "utf-16-le"),
    (codecs.BOM_UTF16_BE, "utf-16-be"),
    (codecs.BOM_UTF8, "utf-8"),
)
_WORKBOOKS = {b"PK\x03\x04": "an Excel or LibreOffice workbook", b"\xd0\xcf\x11\xe0": "an old Excel workbook"}
_SAVE = "save it as CSV UTF-8 (in Excel: 'CSV UTF-8', not 'CSV')"


def text_of(data: bytes, path: Path) -> str:
    """Decode UTF-8, with or without its mark, or UTF-16. Raises UsageError with the line of what is neither."""
    workbook = next((what for magic, what in _WORKBOOKS.items() if data.startswith(magic)), None)
    if workbook:
        raise UsageError(f"{path}: this is {workbook}, not CSV", hint=_SAVE)
    mark, encoding = encoding_of(data)
    try:
        return data[len(mark) :].decode(encoding)
    except UnicodeDecodeError as error:
        line = data[: error.start].count(b"\n") + 1
        named = encoding.removesuffix("-le").removesuffix("-be").upper()
        raise UsageError(f"{path}:{line}: not {named} text", hint=_SAVE) from error


def encoding_of(data: bytes) -> tuple[bytes, str]:
    """Return the byte-order mark that a text begins with (or none) and its encoding, UTF-8 if nothing tells.

    UTF-16 without a mark has a zero in every second byte of plain text.
    """
    marked = next(((mark, name) for mark, name in _MARKS if data.startswith(mark)), None)
    if marked:
        return marked
    head = data[:1000]
    for start, name in ((1, "utf-16-le"), (0, "utf-16-be")):
        if (
            len(head) >= 4
            and head[start::2].count(0) > len(head) * 0.4
            and head[1 - start :: 2].count(0) == 0
        ):
            return b"", name
    return b"", "utf-8"


OUT = "leads out of the roster's folder; --allow-local DIR allows another one"
REFUSED = "is on this machine, and --remote-only takes only what is fetched"


@dataclass(frozen=True, kw_only=True)
class Local:
    """Those below the roster's own folder and below `folders`; none at all with `remote_only`."""

    folders: tuple[Path, ...] = ()
    remote_only: bool = False


OWN_FOLDER = Local()


def local_fault(source: str, base: Path, local: Local) -> str:
    """Return why nothing of this machine may be read for `source` (with an absolute path) of a roster in `base`; empty
    where it may, and where it lies elsewhere. Links are followed, and nothing is opened."""
    try:
        places = _places(source)
        if places and local.remote_only:
            return REFUSED
        roots = [folder.resolve() for folder in (base, *local.folders)]
        return (
            ""
            if all(any(place.resolve().is_relative_to(root) for root in roots) for place in places)
            else OUT
        )
    except (OSError, ValueError, RuntimeError):
        return "is not a path that can be followed"


def _places(source: str) -> list[Path]:
    """Return where it lies, with the top of the repository that it is in; if nothing is there, where it would be."""
    try:
        read = parse_source(source)
    except GraderError:
        return _paths_written(source)
    return [place for place in (read.path, read.top) if place is not None]


def _paths_written(source: str) -> list[Path]:
    scheme, colon, rest = source.partition("://")
    if colon and scheme.lower() == "file":
        path = f"/{rest.partition('/')[2]}"
        # as it stands, and as a URL: either may be a path that is there
        return [Path(path), Path(unquote(path))]
    return [Path(source)] if Path(source).is_absolute() else []


_ADDRESS = re.compile(r"[A-Za-z][A-Za-z0-9+.-]*://|[^/\s@]+@[^/\s:]+:|[\w.-]{2,}:(?!//)\S")
"""An address with a scheme, git's `user@host:path`, or `host:path`, as an SSH configuration names hosts."""
_WINDOWS = re.compile(r"[A-Za-z]:[\\/]|.*\\", re.DOTALL)
_SLASHES = re.compile(r"(https?|ssh|git|file):(?!//)", re.IGNORECASE)
_WEB = re.compile(r"(www\.|[\w-]+(\.[\w-]+)*\.(com|org|edu|net|io|de|fr|it|es|uk)/)\S")


def source_fault(source: str, base: Path, local: Local = OWN_FOLDER) -> str:
    """Return why nothing can be had from `source`, a field of a roster in the folder `base`, or nothing may be by
    `local`; empty where it may be."""
    try:
        there = _is_there(source, base)
    except (OSError, ValueError, RuntimeError):
        return f"{_without_password(source)} is not a path that can be followed"
    refused = local_fault(whole_source(source, base), base, local)
    if not there and (_ADDRESS.match(source) or _WINDOWS.match(source)):
        fault = _address_fault(source)
        if fault or not refused:
            return fault
    if refused:
        return f"{_without_password(source)} {refused}"
    if there or Path(source).is_absolute() or source.startswith("~"):
        return ""
    web = "; a web address begins with https://" if _WEB.match(source) else ""
    return f"{_without_password(source)} does not exist{web}"


def _address_fault(source: str) -> str:
    if _SLASHES.match(source):
        return f"{_without_password(source)}: an address has two slashes after its colon, as in https://"
    if not _ADDRESS.match(source):
        return f"{_without_password(source)} is a path of Windows: write it with / as it is on this machine"
    try:
        parse_source(source)
    except UsageError:  # as what git takes for the name of a program (`ext::`) or for an option of ssh
        return f"{_without_password(source)} is not the address of a repository"
    except (SubmissionError, OSError):
        # a path on this machine that is not there is told when it is looked for
        return ""
    return ""


def whole_source(source: str, base: Path) -> str:
    """Return the same source for a process in another folder: a path becomes absolute."""
    if _ADDRESS.match(source) and not _is_there(source, base):
        return source
    return str(base.absolute() / os.path.expanduser(source))  # noqa: PTH111 - Path.expanduser raises without a home


def ref_fault(ref: str) -> str:
    """Return why `ref` names no branch, tag or commit; empty where it may."""
    return f"{brief(ref)} cannot be the name of a branch, tag or commit" if NO_REF.search(ref) else ""


def _without_password(source: str) -> str:
    """Return the source without what may be a password: all that stands before an `@`."""
    return brief(source.rpartition("@")[2] if re.search(r":.*@", source, re.DOTALL) else source)


def _is_there(source: str, base: Path) -> bool:
    """Return whether a path is, with or without the `@ref` behind it."""
    ends = [len(source), *(at.start() for at in re.finditer("@", source))]
    # a field with thousands of `@` is not looked for as often
    home = [os.path.expanduser(source[:end]) for end in ends[:20] if end]  # noqa: PTH111 - as above
    return any(os.path.lexists(base / path) for path in home)


def entries_of(table: Table, path: Path, local: Local) -> Roster:
    """Return the entries of a table. Raises UsageError where a column is missing, or is there twice."""
    names = known_columns(table, path)
    header = Entry(id="", source="", where=f"{path.name}:{table.line}")
    found = [FoundEntry(header, (meant,)) for meant in near_misses(table.columns)]
    found += [_read_row(row, names, table, path, local) for row in table.rows]
    further = tuple(column for column in table.columns if column and column not in names)
    return gather(path, found, columns=further)


def _read_row(row: RosterRow, names: dict[str, str], table: Table, path: Path, local: Local) -> FoundEntry:
    where, base = f"{path.name}:{row.line}", path.parent
    fields = {names[column]: field for column, field in row.fields.items() if column in names}
    if row.faults:  # what stands in which column is not sure
        sure = not row.shifted or names.get(table.columns[0]) == "id"
        return FoundEntry(Entry(id=fields.get("id", "") if sure else "", source="", where=where), row.faults)
    faults = tuple(_faults(fields, base, local))
    known = Entry(
        id=fields.get("id", ""),
        source="" if faults else whole_source(fields["source"], base),
        name=fields.get("name", ""),
        group=fields.get("group", ""),
        where=where,
        extra={column: field for column, field in row.fields.items() if column not in names},
    )
    if faults:
        return FoundEntry(known, faults)
    more = {
        "ref": fields.get("ref") or None,
        "package": fields.get("package", ""),
        "submitted_at": parse_time(fields.get("submitted_at", "")),
        "extension_days": parse_days(fields.get("extension_days", "")) or 0.0,
    }
    return FoundEntry(known.model_copy(update=more))


def _faults(fields: dict[str, str], base: Path, local: Local) -> Iterator[str]:
    """Yield what is wrong with one row."""
    for name in REQUIRED:
        if not fields.get(name):
            yield f"no {name}"
    said = {
        "source": source_fault(fields["source"], base, local) if fields.get("source") else "",
        "ref": ref_fault(fields.get("ref", "")),
    }
    yield from (f"{name}: {fault}" for name, fault in said.items() if fault)
    if (package := fields.get("package", "")) and not is_package_name(package):
        yield f"package: {brief(package)} cannot be a package's name"
    submitted_at, extension = fields.get("submitted_at", ""), fields.get("extension_days", "")
    if submitted_at and (fault := time_fault(submitted_at)):
        yield f"submitted_at: {brief(submitted_at)} {fault}"
    if extension and parse_days(extension) is None:
        yield f"extension_days: {brief(extension)} is not a number of days"


ID_BYTES_MAX = 255


class FoundEntry(NamedTuple):
    """One submission, or what was meant for one. With `faults` it is none: the entry has what is known of the student,
    an empty id where there is none."""

    entry: Entry
    faults: tuple[str, ...] = ()


def gather(file: Path, found: Sequence[FoundEntry], *, columns: tuple[str, ...] = ()) -> Roster:
    """Return the roster. The first of those that share an id stays; each later one is a fault that names the first."""
    keys = [folder_key(entry.id) if entry.id else "" for entry, _ in found]
    times = Counter(keys)
    first: dict[str, str] = {}
    entries: list[Entry] = []
    again: list[Entry] = []
    faults: list[RosterFault] = []
    for key, (entry, own_faults) in zip(keys, found, strict=True):
        wrong = [*own_faults, *id_faults(entry.id)]
        is_again = bool(key) and key in first
        if not wrong:
            (again if is_again else entries).append(entry)
        if is_again:
            wrong.append(f"id: {brief(entry.id)} is there already, in {first[key]}")
        first.setdefault(key, entry.where)
        # an id that several share says of none whose row in the gradebook tells the fault
        own = entry.id if key and times[key] == 1 and not any(id_faults(entry.id)) else None
        about = {"name": entry.name, "group": entry.group, "extra": entry.extra}
        faults += [RosterFault(where=entry.where, id=own, text=text, **about) for text in wrong]
    return Roster(
        file=str(file), entries=tuple(entries), columns=columns, faults=tuple(faults), again=tuple(again)
    )


def id_faults(submission_id: str) -> Iterator[str]:
    """Yield why `submission_id` can name no folder of results; nothing for an empty one, a fault of its own."""
    if not submission_id:
        return
    if not encodable(submission_id):
        yield f"id: {brief(submission_id)} is not a string"
    elif any(unicodedata.category(sign) in {"Cc", "Zl", "Zp"} for sign in submission_id):
        yield f"id: {brief(submission_id)} has a line end or a control character in it"
    elif not any(sign.isalnum() for sign in submission_id):
        yield f"id: {brief(submission_id)} has no letter and no digit"
    elif len(submission_id.encode()) > ID_BYTES_MAX:
        yield f"id: {brief(submission_id)} is longer than a file's name may be ({ID_BYTES_MAX} bytes)"


def columns_of(found: Iterable[FoundEntry]) -> tuple[str, ...]:
    """Return the names of all further columns, in the order in which they turn up."""
    return tuple(dict.fromkeys(name for entry, faults in found if not faults for name in entry.extra))


REQUIRED = ("id", "source")
OPTIONAL = ("ref", "package", "name", "group", "submitted_at", "extension_days")
KNOWN = (*REQUIRED, *OPTIONAL)
NEARLY = 0.82


def known_columns(table: Table, path: Path, required: Sequence[str] = REQUIRED) -> dict[str, str]:
    """Return the name of each column that means something. Raises UsageError if one is missing, or there twice."""
    names = {column: _plain(column) for column in table.columns}
    missing = [name for name in required if name not in names.values()]
    where = f"{path}:{table.line}"
    if missing:
        there = ", ".join(brief(column) for column in table.columns if column) or "none"
        meant = "; ".join(near_misses(table.columns))
        raise UsageError(
            f"{where}: no column {' and no column '.join(missing)}; there are: {there}",
            hint=meant or f"the first line names the columns: {','.join(required)}",
        )
    written = [names[column] if names[column] in KNOWN else column for column in table.columns if column]
    double = next((name for name in written if written.count(name) > 1), None)
    if double:
        raise UsageError(
            f"{where}: the column {brief(double)} is there twice", hint="take one out, or rename it"
        )
    return {column: name for column, name in names.items() if name in KNOWN}


def near_misses(columns: tuple[str, ...]) -> Iterator[str]:
    """Yield what was meant by each column that is nearly one which means something and is not there."""
    plain = {_plain(column) for column in columns}
    missing = [name for name in KNOWN if name not in plain]
    for column in columns:
        near = difflib.get_close_matches(_plain(column)[:40], missing, n=1, cutoff=NEARLY)
        # few mistype the first letter, and another one mostly makes another word
        if near and near[0][0] == _plain(column)[0] and _plain(column) not in KNOWN:
            yield f"the column {brief(column)} is not known here: did you mean {near[0]}?"


def _plain(column: str) -> str:
    return re.sub(r"[\s-]+", "_", column.casefold())


EXTENSION_DAYS_MAX = 3660.0
EXAMPLE = "2026-11-20 23:59"
_TIME = re.compile(
    r"(?P<year>\d{4})[-/](?P<month>\d{1,2})[-/](?P<day>\d{1,2})"
    r"(?:(?:T|\s+)(?P<hour>\d{1,2}):(?P<minute>\d{2})(?::(?P<second>\d{2})(?:[.,](?P<part>\d{1,12}))?)?"
    r"\s*(?P<zone>Z|UTC|GMT|[+-]\d{2}(?::?\d{2})?)?)?",
    re.IGNORECASE | re.ASCII,
)
_DAY_AND_MONTH = re.compile(r"\d{1,2}([/.-])\d{1,2}\1\d{2,4}\b.*", re.ASCII | re.DOTALL)
_DAYS = re.compile(r"\+?\d{1,5}([.,]\d{1,6})?", re.ASCII)


def parse_time(text: str) -> datetime | None:
    """Parse an ISO 8601 time, also with blanks and slashes; without a zone, of this machine's. None if it is none."""
    found = _TIME.fullmatch(text.strip())
    if found is None:
        return None
    numbers = {name: int(found[name] or 0) for name in ("year", "month", "day", "hour", "minute", "second")}
    part = int((found["part"] or "0")[:6].ljust(6, "0"))
    try:
        time = datetime(**numbers, microsecond=part, tzinfo=_zone(found["zone"]))
        return time.astimezone() if time.tzinfo is None else time.astimezone(timezone.utc)
    except (ValueError, OverflowError, OSError):
        return None


def time_fault(text: str) -> str:
    """Return why `text` is not a time; empty where it is one."""
    if parse_time(text) is not None:
        return ""
    if _DAY_AND_MONTH.fullmatch(text.strip()):
        return f"could be read with the day or the month first: write it as {EXAMPLE}"
    return f"is not a time such as {EXAMPLE} or 2026-11-20T23:59:00+01:00"


def parse_days(text: str) -> float | None:
    """Return a number of days from 0 to ten years, with a point or a comma. None for what is none."""
    days = float(text.replace(",", ".")) if _DAYS.fullmatch(text) else None
    return days if days is not None and days <= EXTENSION_DAYS_MAX else None


def _zone(text: str | None) -> timezone | None:
    if text is None:
        return None
    if text[0] not in "+-":
        return timezone.utc
    digits = text[1:].replace(":", "").ljust(4, "0")
    offset = timedelta(hours=int(digits[:2]), minutes=int(digits[2:]))
    return timezone(-offset if text[0] == "-" else offset)
