"""What the columns of a roster mean, however they are written."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from grader.classes.roster.table import Table
from grader.errors import UsageError
from grader.intake.names import brief
from grader.suggest import closest

REQUIRED = ("id", "source")
OPTIONAL = ("ref", "name", "group", "submitted_at", "extension_days")
KNOWN = (*REQUIRED, *OPTIONAL)
NEARLY = 0.82


def known_columns(table: Table, path: Path) -> dict[str, str]:
    """The name of each column that means something. Raises UsageError where one is missing, or is there twice."""
    names = {column: _plain(column) for column in table.columns}
    missing = [name for name in REQUIRED if name not in names.values()]
    where = f"{path}:{table.line}"
    if missing:
        there = ", ".join(brief(column) for column in table.columns if column) or "none"
        meant = "; ".join(meant for _, meant in near_misses(table.columns))
        raise UsageError(
            f"{where}: no column {' and no column '.join(missing)}; there are: {there}",
            hint=meant or "the first line names the columns: id,source",
        )
    written = [names[column] if names[column] in KNOWN else column for column in table.columns if column]
    double = next((name for name in written if written.count(name) > 1), None)
    if double:
        raise UsageError(
            f"{where}: the column {brief(double)} is there twice", hint="take one out, or rename it"
        )
    return {column: name for column, name in names.items() if name in KNOWN}


def near_misses(columns: tuple[str, ...]) -> Iterator[tuple[str, str]]:
    """Columns that are nearly one which means something and is not there, each with what was meant."""
    plain = {_plain(column) for column in columns}
    missing = [name for name in KNOWN if name not in plain]
    for column in columns:
        near = closest(_plain(column)[:40], missing, cutoff=NEARLY)
        if near and near[0] == _plain(column)[0] and _plain(column) not in KNOWN:
            yield column, f"the column {brief(column)} means nothing here: did you mean {near}?"


def _plain(column: str) -> str:
    return re.sub(r"[\s-]+", "_", column.casefold())
