"""Who submitted what: a CSV file, a folder of submissions, or an export of GitHub Classroom or GitLab.

`read_roster` gives a `Roster`: entries, and every fault with its line. Nothing is fetched or opened here.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from grader.classes.roster.entries import OWN_FOLDER, Local, entries_of, read_table
from grader.classes.roster.exports import (
    from_folder,
    from_gitlab,
    is_classroom,
    refuse_classroom_roster,
    with_roster_columns,
)
from grader.errors import UsageError
from grader.model.batch import Entry, Roster

__all__ = ["Entry", "Local", "Roster", "read_roster"]


SOURCES: tuple[tuple[Callable[[Path], bool], Callable[[Path, Local], Roster]], ...] = (
    (Path.is_dir, from_folder),
    (lambda path: path.suffix.lower() in {".json", ".ndjson", ".jsonl"}, from_gitlab),
)
"""The kinds of rosters: whether a path is one, and what reads it; any other path is a table (`_from_table`), and
`with_roster_columns` renames the columns of GitHub Classroom's.

A new kind takes
1. a function in a file of this folder, from the path and `Local` to a `Roster`. It makes an `Entry` of each submission
   (`entries.py` has `gather`, `entries_of` and the checks of paths), with `modes_lost=True` where files lost their
   executable bits on the way;
2. a line here, before the kinds that would take its paths too;
3. where it comes packed as one file: `is_download` and `unpack_download` (`exports.py`);
4. an example in `tests/classes/roster/`, and its section in `docs/how-to/rosters.md`.
"""


def read_roster(path: Path, local: Local = OWN_FOLDER) -> Roster:
    """Return every submission that the roster names, and every fault that it has, in the order of lines.

    `path` is a CSV file with the columns `id,source[,ref][,package][,name][,group][,submitted_at][,extension_days]`, an
    export of GitHub Classroom (CSV) or of a GitLab group (the JSON of its projects), or a folder with a submission
    in each of its entries. `local` says which paths of this machine it may name: any other is a fault, and nothing
    there is opened.
    Raises UsageError where it is none of these, or names no submission at all.
    """
    read = next((read for fits, read in SOURCES if fits(path)), _from_table)
    roster = read(path, local)
    if not roster.entries and not roster.faults:
        raise UsageError(
            f"{path}: no submission in it", hint="each is a row with id and source, or an entry of a folder"
        )
    return roster


def _from_table(path: Path, local: Local) -> Roster:
    table = read_table(path)
    refuse_classroom_roster(table, path)
    return entries_of(with_roster_columns(table) if is_classroom(table) else table, path, local)
