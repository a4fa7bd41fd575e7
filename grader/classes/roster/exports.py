"""Rosters that platforms give; `SOURCES` in this room's `__init__.py` lists them with all others.

These are a folder with a submission in each entry, the zip of all submissions that Moodle or Canvas offers for
download, the grades of a GitHub Classroom assignment (CSV), and the projects of a GitLab group (JSON). The names in
downloads are known. Students' own archives in them stay packed: each is opened, within its limits, when it is graded.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import shutil
import zipfile
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from grader.classes.roster import entries
from grader.classes.roster.entries import FoundEntry, Local, RosterRow, Table
from grader.errors import HostError, UsageError
from grader.files import make_folder, read_given, temporary_folder, unwritable
from grader.intake.names import archive_stem, encodable, is_archive_name, listing, printable
from grader.model.batch import Entry, Roster
from grader.untrusted_text import line

IGNORED = {"__MACOSX", "Thumbs.db", "desktop.ini"}
RECORDINGS = (".bag", ".mcap", ".db3")


def from_folder(folder: Path, local: Local) -> Roster:
    """Return an entry for each folder, repository, archive or recording in it, by name; one for all files that
    Moodle or Canvas has from one student.

    Raises UsageError where the folder cannot be read, is one submission, or `local` allows only what is fetched.
    """
    if local.remote_only:
        raise UsageError(
            f"{folder}: a folder of submissions {entries.REFUSED}",
            hint="give a roster of addresses, or leave it out",
        )
    paths = _inside(folder)
    if any(path.name == "package.xml" for path in paths):
        raise UsageError(
            f"{folder}: this is one package, not a folder of submissions",
            hint="grader grade takes one submission",
        )
    students: dict[tuple[str, ...], list[tuple[Path, Named | None]]] = {}
    for path in paths:
        named = platform_name(path.name) if encodable(path.name) else None
        key = (named.platform, named.id) if named else ("", path.name)
        students.setdefault(key, []).append((path, named))
    found = [_check_links(_student(files), folder, local) for files in students.values()]
    return entries.gather(folder, found, columns=entries.columns_of(found))


def _inside(folder: Path) -> list[Path]:
    try:
        return sorted(
            path for path in folder.iterdir() if not path.name.startswith(".") and path.name not in IGNORED
        )
    except OSError as error:
        raise UsageError(f"{folder}: cannot be read: {error.strerror}") from error


def _check_links(found: FoundEntry, folder: Path, local: Local) -> FoundEntry:
    """Return it with a fault if a link leads out of the folder."""
    fault = "" if found.faults else entries.local_fault(found.entry.source, folder, local)
    return FoundEntry(found.entry, (fault,)) if fault else found


def _student(files: list[tuple[Path, Named | None]]) -> FoundEntry:
    path, named = files[0]
    if named is not None:
        return _from_download([(path, named) for path, named in files if named])
    unknown = Entry(id="", source="", where=printable(path.name))
    if not encodable(path.name):
        return FoundEntry(unknown, ("its name is not UTF-8: rename it",))
    if not _can_be_graded(path):
        return FoundEntry(unknown, ("neither a folder nor an archive",))
    name = path.name if path.is_dir() else archive_stem(path.name)
    return FoundEntry(Entry(id=name, source=str(path.absolute()), where=unknown.where))


def _from_download(files: list[tuple[Path, Named]]) -> FoundEntry:
    """Return what a platform has from one student: the one folder, or the one archive among the files."""
    taken = [one for one in files if _can_be_graded(one[0]) and not one[1].is_text]
    path, named = (taken or files)[0]
    name = f"{named.name}-{named.id}"
    entry = _entry(path, named, name, [one.name for one, _ in files if one != path])
    if not taken:
        fault = "only text or a link was submitted" if named.is_text else "neither a folder nor an archive"
        return FoundEntry(entry, (fault,))
    if len(taken) > 1:
        more = listing([other.name for other, _ in taken[1:]])
        return FoundEntry(entry, (f"not the only one of this student, there is {more}: leave one there",))
    return FoundEntry(entry)


def _entry(path: Path, named: Named, name: str, others: list[str]) -> Entry:
    source = _single_archive(path) or path
    file = named.file or (source.name if source != path else "")
    is_anonymous_canvas = named.platform == "Canvas" and named.is_blind
    extra: Mapping[str, str] = {
        "platform": named.platform,
        "file": printable(file),
        "late": "yes" if named.late else "",
        "other files": ", ".join(printable(other) for other in others),
        # these ids are no user's, so Canvas' own gradebook does not know them
        "Canvas anonymous id" if is_anonymous_canvas else f"{named.platform} id": named.id,
    }
    return Entry(
        id=name,
        source=str(source.absolute()),
        name=f"{named.name} {named.id}" if named.is_blind else named.name,
        where=printable(path.name),
        modes_lost=True,  # platforms pack uploads again, without modes
        extra={key: text for key, text in extra.items() if text},
    )


def _can_be_graded(path: Path) -> bool:
    return path.is_dir() or is_archive_name(path.name) or path.suffix.lower() in RECORDINGS


def _single_archive(path: Path) -> Path | None:
    """Return the archive that is all that a student's folder holds."""
    try:
        inside = _inside(path) if path.is_dir() else []
    except UsageError:
        return None
    alone = len(inside) == 1 and inside[0].is_file() and is_archive_name(inside[0].name)
    return inside[0] if alone and encodable(inside[0].name) else None


# Moodle: `Full Name_1234567_assignsubmission_file` (a folder), with `_lab1.zip` behind it (a file), or `onlinetext` for
# text; `Participant 1234567` or `Participant_1234567` where names are hidden. A team has its name and number.
# Canvas: `lastnamefirstname_LATE_12345_67890_lab1.zip`, with `LATE_` if it was late, `LATE_anon_x7Yz2_67890_lab1.zip`
# where names are hidden; `…_12345_text.html` and `…_12345_link.html` where no file was submitted.
MOODLE = re.compile(
    r"(?P<name>.+)_(?P<id>\d+)_assignsubmission_(?P<kind>file|onlinetext)(?:_(?P<file>.*))?", re.DOTALL
)
MOODLE_BLIND = re.compile(
    r"(?P<name>\w+) (?P<id>\d+)_assignsubmission_(?P<kind>file|onlinetext)(?:_(?P<file>.*))?", re.DOTALL
)
CANVAS = re.compile(
    r"(?P<name>[\w-]+?)_(?P<late>LATE_)?(?P<id>\d+)_(?:\d+_(?P<file>.+)|(?P<text>text|link)\.html)", re.DOTALL
)
CANVAS_BLIND = re.compile(
    r"(?P<late>LATE_)?(?P<name>anon)_(?P<id>[A-Za-z0-9]{5})_(?:\d+_(?P<file>.+)|(?P<text>text|link)\.html)",
    re.DOTALL,
)
BLIND = {"Participant", "Teilnehmer", "Teilnehmerin", "Participante", "Partecipante"}


class Named(NamedTuple):
    """`id` is the platform's number for the student (Canvas) or the submission (Moodle); `file` as handed in.

    `is_blind`: the platform hides who it is; Canvas has other ids then.
    """

    platform: str
    id: str
    name: str
    file: str
    late: bool = False
    is_text: bool = False
    is_blind: bool = False


def platform_name(name: str) -> Named | None:
    """Return what a file's or folder's name says; None where no platform made it."""
    if found := MOODLE.fullmatch(name) or MOODLE_BLIND.fullmatch(name):
        is_text = found["kind"] == "onlinetext"
        blind = found["name"] in BLIND
        return Named(
            "Moodle", found["id"], found["name"], found["file"] or "", is_text=is_text, is_blind=blind
        )
    blind_canvas = CANVAS_BLIND.fullmatch(name)
    if found := blind_canvas or CANVAS.fullmatch(name):
        return Named(
            "Canvas",
            found["id"],
            found["name"],
            found["file"] or "",
            late=bool(found["late"]),
            is_text=bool(found["text"]),
            is_blind=blind_canvas is not None,
        )
    return None


FOLDER = ".submissions"


def is_download(path: Path) -> bool:
    """Return whether `path` is a zip file."""
    return path.is_file() and path.suffix.lower() == ".zip"


def unpack_download(path: Path, out: Path) -> Path:
    """Unpack the zip below `out` and return the folder; one that was unpacked there before is returned as it is.

    Raises:
        UsageError: It is not a zip file, is damaged or encrypted, or is itself one package.
        HostError: The disk has no room for it.

    """
    try:
        with zipfile.ZipFile(path) as download:
            members = [member for member in download.infolist() if not member.is_dir()]
            if any(
                member.filename.count("/") <= 1 and member.filename.rpartition("/")[2] == "package.xml"
                for member in members
            ):
                raise UsageError(
                    f"{path}: this is one package, not a download of submissions",
                    hint="grader grade takes one submission",
                )
            # by its content: the same download is unpacked once, and a new one beside it
            folder = out.absolute() / FOLDER / _digest(members)
            if not folder.is_dir():
                _unpack(download, members, folder)
    except (zipfile.BadZipFile, RuntimeError, NotImplementedError, EOFError) as error:
        raise UsageError(
            f"{path}: cannot be unpacked: {line(str(error), 200)}", hint="download it again"
        ) from error
    except OSError as error:
        raise unwritable(out, error) from error
    return folder


def _digest(members: list[zipfile.ZipInfo]) -> str:
    listed = [f"{member.filename}\0{member.file_size}\0{member.CRC}" for member in members]
    return hashlib.sha256("\n".join(listed).encode("utf-8", "surrogateescape")).hexdigest()[:12]


def _unpack(download: zipfile.ZipFile, members: list[zipfile.ZipInfo], folder: Path) -> None:
    make_folder(folder.parent)
    size_bytes = sum(member.file_size for member in members)
    if size_bytes > shutil.disk_usage(folder.parent).free:
        raise HostError(f"{folder.parent}: no room for {size_bytes >> 20} MB of submissions")
    # beside it, and renamed when it is whole
    with temporary_folder("download", folder.parent) as new:
        place = new / "all"
        place.mkdir()
        for member in members:
            download.extract(member, place)  # takes drives and `..` out of names
        _within_one_folder(place).rename(folder)


def _within_one_folder(place: Path) -> Path:
    """Return the folder of the submissions: some put it into another one."""
    inside = list(place.iterdir())
    alone = inside[0] if len(inside) == 1 and inside[0].is_dir() else None
    return alone if alone is not None and platform_name(alone.name) is None else place


COLUMNS = {
    "student_repository_url": "source",
    "roster_identifier": "name",
    "group_name": "group",
    "submission_timestamp": "submitted_at",
}
"""Columns of the grades that GitHub Classroom gives out for an assignment, and what they are called here."""
_ROSTER = {"identifier", "github_username", "github_id"}


def is_classroom(table: Table) -> bool:
    """Return whether GitHub Classroom made it."""
    return {"student_repository_url", "github_username"} <= set(table.columns)


def refuse_classroom_roster(table: Table, path: Path) -> None:
    """Raise UsageError for the list of a classroom's students: no repository is in it."""
    if set(table.columns) >= _ROSTER and "source" not in {column.casefold() for column in table.columns}:
        raise UsageError(
            f"{path}: this is the list of a classroom's students, which names no repositories",
            hint="give the assignment's grades: on its page, Download, Download grades",
        )


def with_roster_columns(table: Table) -> Table:
    """Return the table with the columns of a roster. The id is the name on GitHub; a row without a repository is a
    student who has not accepted the assignment."""
    columns = tuple(COLUMNS.get(column, column) for column in table.columns)
    columns = columns if "id" in columns else (*columns, "id")
    return Table(columns, tuple(_row(row) for row in table.rows), table.line)


def _row(row: RosterRow) -> RosterRow:
    who = row.fields.get("github_username") or row.fields.get("roster_identifier", "")
    fields = {"id": who, **{COLUMNS.get(column, column): field for column, field in row.fields.items()}}
    if row.faults or fields.get("source"):
        return RosterRow(row.line, fields, row.faults, row.shifted)
    who = fields.get("name") or fields["id"] or "?"
    return RosterRow(row.line, fields, (f"{who} has no repository",))


BYTES_MAX = 64 << 20
ADDRESSES = ("http_url_to_repo", "ssh_url_to_repo")
_HINT = 'export it with `glab api "groups/NAME/projects?per_page=100" --paginate`'
_BLANK = " \t\r\n"
_BLANKS = re.compile(f"[{_BLANK}]*")


def from_gitlab(path: Path, local: Local) -> Roster:
    """Return the projects of a group (`GET /groups/:id/projects`): one list, or one after the other as pages come.

    Raises UsageError where the file is no such list.
    """
    found = [
        _read_project(project, f"{path.name}: project {number}", path.parent, local)
        for number, project in enumerate(_projects(path), start=1)
    ]
    found = _told_apart(found)
    return entries.gather(path, found, columns=entries.columns_of(found))


def _read_project(project: object, where: str, base: Path, local: Local) -> FoundEntry:
    if not isinstance(project, dict):
        return FoundEntry(Entry(id="", source="", where=where), ("no project",))
    texts = {key: text for key, text in project.items() if isinstance(text, str) and encodable(text)}
    source = next((texts[key] for key in ADDRESSES if texts.get(key)), None)
    name = texts.get("path") or texts.get("name", "")
    unknown = Entry(id=name, source="", where=where)
    if source is None or not name:
        return FoundEntry(unknown, ("no http_url_to_repo, or no path",))
    if fault := entries.source_fault(source, base, local):
        return FoundEntry(unknown, (f"source: {fault}",))
    namespace = project.get("namespace")
    group = namespace.get("full_path") if isinstance(namespace, dict) else None
    about = {
        "source": entries.whole_source(source, base),
        "name": texts.get("name", ""),
        "group": group if isinstance(group, str) and encodable(group) else "",
        "extra": {"path_with_namespace": path} if (path := texts.get("path_with_namespace")) else {},
    }
    return FoundEntry(unknown.model_copy(update=about))


def _told_apart(found: list[FoundEntry]) -> list[FoundEntry]:
    """Name projects of one name in several subgroups (`lab/ada/ros`, `lab/bob/ros`) by the subgroup too."""
    sources = {(entry.id, entry.source) for entry, faults in found if not faults}
    shared = {name for name, times in Counter(name for name, _ in sources).items() if times > 1}
    paths = [path for entry, _ in found if (path := entry.extra.get("path_with_namespace"))]
    # `commonpath` refuses a mixture of paths with and without a slash before them
    common = os.path.commonpath(paths) if paths and not any(path.startswith("/") for path in paths) else ""
    return [_by_path(one, common) if one.entry.id in shared else one for one in found]


def _by_path(one: FoundEntry, common: str) -> FoundEntry:
    path = one.entry.extra.get("path_with_namespace")
    if path is None:
        return one
    name = path.removeprefix(common).strip("/").replace("/", "-") or one.entry.id
    return FoundEntry(one.entry.model_copy(update={"id": name}))


def _projects(path: Path) -> list[object]:
    text = _text(path)
    decoder, projects, at = json.JSONDecoder(), list[object](), 0
    try:
        while at < len(text):
            page, at = decoder.raw_decode(text, at)
            projects += page if isinstance(page, list) else [_as_list(page, path)]
            # it always matches, at least nothing
            at = _BLANKS.match(text, at).end()  # type: ignore[union-attr]
    except (ValueError, RecursionError) as error:
        raise UsageError(f"{path}: not JSON: {printable(str(error))[:200]}", hint=_HINT) from error
    if not text:
        raise UsageError(f"{path}: the file is empty", hint=_HINT)
    return projects


def _as_list(page: object, path: Path) -> object:
    """Return a project without a list around it, as `--output ndjson` writes one a line. Raises UsageError."""
    if isinstance(page, dict) and any(key in page for key in ADDRESSES):
        return page
    raise UsageError(f"{path}: not a list of projects", hint=_HINT)


def _text(path: Path) -> str:
    data = read_given(path, BYTES_MAX)
    if data is None:
        raise UsageError(f"{path}: larger than {BYTES_MAX >> 20} MB: this is not a list of projects")
    return entries.text_of(data, path).strip(_BLANK)
