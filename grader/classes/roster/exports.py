"""Rosters from exports: the grades of a GitHub Classroom assignment (CSV), the projects of a GitLab group (JSON)."""

from __future__ import annotations

import json
import os
import re
from collections import Counter
from collections.abc import Mapping
from pathlib import Path

from grader.classes.roster.entries import Found, Local, columns_of, gather, source_fault, whole_source
from grader.classes.roster.table import Row, Table, text_of
from grader.errors import UsageError
from grader.intake.names import encodable, printable
from grader.model.batch import Entry, Roster

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
    """The same with the columns of a roster. The id is the student's name on GitHub; a row without a repository is a
    student who has not accepted the assignment."""
    columns = tuple(COLUMNS.get(column, column) for column in table.columns)
    columns = columns if "id" in columns else (*columns, "id")
    return Table(columns, tuple(_row(row) for row in table.rows), table.line)


def _row(row: Row) -> Row:
    fields = _renamed(row.fields)
    if row.faults or fields.get("source"):
        return Row(row.line, fields, row.faults, row.shifted)
    who = fields.get("name") or fields["id"] or "?"
    return Row(row.line, fields, (f"{who} has no repository",))


def _renamed(fields: Mapping[str, str]) -> dict[str, str]:
    renamed = {COLUMNS.get(column, column): field for column, field in fields.items()}
    return {"id": fields.get("github_username") or fields.get("roster_identifier", ""), **renamed}


BYTES_MAX = 64 << 20
ADDRESSES = ("http_url_to_repo", "ssh_url_to_repo")
_HINT = 'export it with `glab api "groups/NAME/projects?per_page=100" --paginate`'
_BLANK = " \t\r\n"
_BLANKS = re.compile(f"[{_BLANK}]*")


def from_gitlab(path: Path, local: Local) -> Roster:
    """The projects of a group (`GET /groups/:id/projects`), in one list, or in one after the other as pages come.

    Raises UsageError where the file is no such list.
    """
    found = [
        _found(project, f"{path.name}: project {number}", path.parent, local)
        for number, project in enumerate(_projects(path), start=1)
    ]
    found = _told_apart(found)
    return gather(path, found, columns=columns_of(one.entry for one in found))


def _found(project: object, where: str, base: Path, local: Local) -> Found:
    if not isinstance(project, dict):
        return Found(where=where, faults=("no project",))
    texts = {key: text for key, text in project.items() if isinstance(text, str) and encodable(text)}
    source = next((texts[key] for key in ADDRESSES if texts.get(key)), None)
    name = texts.get("path") or texts.get("name", "")
    if source is None or not name:
        return Found(where=where, id=name, faults=("no http_url_to_repo, or no path",))
    if fault := source_fault(source, base, local):
        return Found(where=where, id=name, faults=(f"source: {fault}",))
    namespace = project.get("namespace")
    group = namespace.get("full_path") if isinstance(namespace, dict) else None
    entry = Entry(
        id=name,
        source=whole_source(source, base),
        name=texts.get("name", ""),
        group=group if isinstance(group, str) and encodable(group) else "",
        where=where,
        extra={"path_with_namespace": texts["path_with_namespace"]} if "path_with_namespace" in texts else {},
    )
    return Found(where=where, id=name, entry=entry)


def _told_apart(found: list[Found]) -> list[Found]:
    """Projects of one name in several subgroups (`lab/ada/ros`, `lab/bob/ros`) are named by the subgroup too."""
    sources = {(one.id, one.entry.source) for one in found if one.entry}
    shared = {name for name, times in Counter(name for name, _ in sources).items() if times > 1}
    paths = [path for one in found if one.entry and (path := one.entry.extra.get("path_with_namespace"))]
    common = os.path.commonpath(paths) if paths and not any(path.startswith("/") for path in paths) else ""
    return [_by_path(one, common) if one.id in shared else one for one in found]


def _by_path(one: Found, common: str) -> Found:
    path = one.entry.extra.get("path_with_namespace") if one.entry else None
    if one.entry is None or path is None:
        return one
    name = path.removeprefix(common).strip("/").replace("/", "-") or one.id
    return Found(where=one.where, id=name, entry=one.entry.model_copy(update={"id": name}))


def _projects(path: Path) -> list[object]:
    text = _text(path)
    decoder, projects, at = json.JSONDecoder(), list[object](), 0
    try:
        while at < len(text):
            page, at = decoder.raw_decode(text, at)
            projects += page if isinstance(page, list) else [_alone(page, path)]
            at = _BLANKS.match(text, at).end()  # type: ignore[union-attr]
    except (ValueError, RecursionError) as error:
        raise UsageError(f"{path}: no JSON: {printable(str(error))[:200]}", hint=_HINT) from error
    if not text:
        raise UsageError(f"{path}: the file is empty", hint=_HINT)
    return projects


def _alone(page: object, path: Path) -> object:
    """A project without a list around it, as `--output ndjson` writes one a line."""
    if isinstance(page, dict) and any(key in page for key in ADDRESSES):
        return page
    raise UsageError(f"{path}: no list of projects", hint=_HINT)


def _text(path: Path) -> str:
    try:
        if path.stat().st_size > BYTES_MAX:
            raise UsageError(f"{path}: larger than {BYTES_MAX >> 20} MB: this is not a list of projects")
        return text_of(path.read_bytes(), path).strip(_BLANK)
    except OSError as error:
        raise UsageError(f"{path}: cannot be read: {error.strerror}") from error
