"""A folder with a submission in each of its entries; bulk downloads of Moodle and Canvas are known by their names."""

from __future__ import annotations

from collections import defaultdict
from pathlib import Path

from grader.errors import UsageError
from grader.intake.names import archive_stem, is_archive_name, printable, safe_name
from grader.model.roster import Entry, Roster
from grader.roster.platforms import Named, platform_name

IGNORED = {"__MACOSX", "Thumbs.db", "desktop.ini"}
RECORDINGS = (".bag", ".mcap")


def from_folder(folder: Path) -> Roster:
    """An entry for each folder, repository, archive or recording in it, in order of names.

    Raises UsageError where the folder cannot be read.
    """
    try:
        paths = sorted(path for path in folder.iterdir() if not _is_clutter(path))
    except OSError as error:
        raise UsageError(f"{folder}: cannot be read: {error.strerror}") from error
    entries, faults = [], []
    seen: dict[str, list[str]] = defaultdict(list)
    for path in paths:
        shown = printable(path.name)
        if not path.is_dir() and not is_archive_name(path.name) and path.suffix not in RECORDINGS:
            faults.append(f"{shown}: neither a folder nor an archive")
            continue
        entry = _entry(path, platform_name(path.name))
        seen[safe_name(entry.id).casefold()].append(shown)
        entries.append(entry)
    double = {key: names for key, names in seen.items() if len(names) > 1}
    faults += [f"{names[1]}: belongs to the same student as {names[0]}" for names in double.values()]
    whole = tuple(entry for entry in entries if safe_name(entry.id).casefold() not in double)
    return Roster(file=str(folder), entries=whole, faults=tuple(faults))


def _is_clutter(path: Path) -> bool:
    return path.name.startswith(".") or path.name in IGNORED


def _entry(path: Path, named: Named | None) -> Entry:
    where = printable(path.name)
    if named is None:
        return Entry(
            id=path.name if path.is_dir() else archive_stem(path.name),
            source=str(path.absolute()),
            where=where,
        )
    extra = {"platform": named.platform, "file": named.file} | ({"late": "yes"} if named.late else {})
    return Entry(
        id=f"{named.name}-{named.id}",
        source=str(path.absolute()),
        name=named.name,
        where=where,
        extra={**extra, f"{named.platform} id": named.id},
    )
