"""`grader doctor`: what this machine can and cannot do, and the command that mends it."""

from __future__ import annotations

import sys

from rich.console import Console
from rich.table import Table
from rich.text import Text

from grader.cli.diagnosis import diagnose
from grader.cli.output import say_json
from grader.cli.row import Row
from grader.errors import ExitCode
from grader.report.terminal import emit, open_console
from grader.report.text import visible

STYLES = {"ok": "green", "limited": "yellow", "missing": "red"}


def run(*, as_json: bool = False) -> ExitCode:
    """Print a row for each thing that grading needs. NOT_GRADED where one is missing."""
    rows = diagnose()
    if as_json:
        say_json([row.model_dump() for row in rows])
    else:
        _print(rows, open_console(sys.stdout))
    return ExitCode.NOT_GRADED if any(row.state == "missing" for row in rows) else ExitCode.PASSED


def _print(rows: tuple[Row, ...], console: Console) -> None:
    grid = Table.grid(padding=(0, 2, 0, 0))
    for _ in range(2):
        grid.add_column(no_wrap=True)
    grid.add_column(overflow="fold")
    for row in rows:
        grid.add_row(Text(row.state, STYLES[row.state]), Text(row.name), Text(visible(row.detail)))
        if row.mend:
            grid.add_row(Text(), Text("mend:", "bold"), Text(visible(row.mend), "bold"))
    missing = sum(row.state == "missing" for row in rows)
    verdict = f"{missing} missing: grading is not fully possible here." if missing else "Ready to grade."
    emit(console, [grid, Text(f"\n{verdict}")])
