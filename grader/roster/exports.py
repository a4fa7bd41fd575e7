"""What GitHub Classroom and GitLab export: tables and lists with names of their own."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from grader.errors import UsageError
from grader.intake.names import printable, safe_name
from grader.model.roster import Entry, Roster
from grader.roster.table import Row, Table

CLASSROOM = {
    "student_repository_url": "source",
    "roster_identifier": "name",
    "submission_timestamp": "submitted_at",
}
"""Columns of the grades that GitHub Classroom gives out for an assignment, and what they are called here."""
BYTES_MAX = 64 << 20
ADDRESSES = ("http_url_to_repo", "ssh_url_to_repo")


def is_classroom(table: Table) -> bool:
    """Whether GitHub Classroom made it."""
    return {"student_repository_url", "github_username"} <= set(table.columns)


def with_classroom_columns(table: Table, name: str) -> Table:
    """The same with the columns of a roster. The id is the student's name on GitHub; a row without a repository is a
    student who has not accepted the assignment."""
    rows = [
        Row(row.line, _renamed(row.fields)) for row in table.rows if row.fields.get("student_repository_url")
    ]
    faults = [
        f"{name}:{row.line}: {row.fields.get('roster_identifier') or row.fields.get('github_username') or '?'} "
        "has no repository"
        for row in table.rows
        if not row.fields.get("student_repository_url")
    ]
    columns = ("id", *(CLASSROOM.get(column, column) for column in table.columns))
    return Table(columns, tuple(rows), (*table.faults, *faults))


def _renamed(fields: Any) -> dict[str, str]:  # noqa: ANN401 - a mapping of text
    renamed = {CLASSROOM.get(column, column): field for column, field in fields.items()}
    return {"id": fields.get("github_username") or fields.get("roster_identifier", ""), **renamed}


def from_gitlab(path: Path) -> Roster:
    """The projects of a group, as GitLab's API lists them (`GET /groups/:id/projects`).

    Raises UsageError where the file is no such list.
    """
    projects = _read(path)
    entries, faults, seen = [], [], dict[str, str]()
    for number, project in enumerate(projects, start=1):
        where = f"{path.name}: project {number}"
        fault, entry = _project(project, where)
        if entry is not None:
            key = safe_name(entry.id).casefold()
            fault = f"{entry.id} is there already, as {seen[key]}" if key in seen else fault
            seen.setdefault(key, where)
        if fault or entry is None:
            faults.append(f"{where}: {fault}")
        else:
            entries.append(entry)
    return Roster(file=str(path), entries=tuple(entries), faults=tuple(faults))


def _project(project: object, where: str) -> tuple[str, Entry | None]:
    if not isinstance(project, dict):
        return "no project", None
    source = next((project[key] for key in ADDRESSES if isinstance(project.get(key), str)), None)
    name = project.get("path") or project.get("name")
    if source is None or not isinstance(name, str):
        return "no http_url_to_repo, or no path", None
    group = project.get("namespace")
    group_name = group.get("full_path", "") if isinstance(group, dict) else ""
    return "", Entry(
        id=name, source=source, name=str(project.get("name", "")), group=str(group_name), where=where
    )


def _read(path: Path) -> list[object]:
    try:
        if path.stat().st_size > BYTES_MAX:
            raise UsageError(f"{path}: larger than {BYTES_MAX >> 20} MB: this is no list of projects")
        data = json.loads(path.read_bytes())
    except OSError as error:
        raise UsageError(f"{path}: cannot be read: {error.strerror}") from error
    except (ValueError, RecursionError) as error:
        raise UsageError(f"{path}: no JSON: {printable(str(error))[:200]}") from error
    if not isinstance(data, list):
        raise UsageError(
            f"{path}: no list of projects", hint="export it with `glab api groups/NAME/projects?per_page=100`"
        )
    return data
