"""What GitHub Classroom exports: the grades of an assignment, which name the repositories."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from grader.classes.roster.table import Row, Table
from grader.errors import UsageError

COLUMNS = {
    "student_repository_url": "source",
    "roster_identifier": "name",
    "group_name": "group",
    "submission_timestamp": "submitted_at",
}
"""Columns of the grades that GitHub Classroom gives out for an assignment, and what they are called here."""
_ROSTER = {"identifier", "github_username", "github_id"}


def is_classroom(table: Table) -> bool:
    """Whether GitHub Classroom made it."""
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
