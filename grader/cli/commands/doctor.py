"""`grader doctor`: what this machine can and cannot do, and the command that mends it."""

from __future__ import annotations

import json
import sys

from rich.console import Console
from rich.padding import Padding
from rich.text import Text

from grader.cli.diagnosis import Row, diagnose
from grader.errors import ExitCode
from grader.report.terminal import open_console
from grader.report.text import visible

STYLES = {"ok": "green", "limited": "yellow", "missing": "red"}


def run(*, as_json: bool = False) -> ExitCode:
    """Print a row for each thing that grading needs. NOT_GRADED where one is missing."""
    rows = diagnose()
    if as_json:
        print(json.dumps([row.model_dump() for row in rows], indent=2, ensure_ascii=False))
    else:
        _print(rows, open_console(sys.stdout))
    return ExitCode.NOT_GRADED if any(row.state == "missing" for row in rows) else ExitCode.PASSED


def _print(rows: tuple[Row, ...], console: Console) -> None:
    width = max(len(row.name) for row in rows)
    for row in rows:
        line = Text.assemble(
            (f"{row.state:<8}", STYLES[row.state]), f"{row.name:<{width}}  ", visible(row.detail)
        )
        console.print(line)
        if row.mend:
            console.print(Padding(Text(f"mend: {visible(row.mend)}", "bold"), (0, 0, 0, 10), expand=False))
    missing = sum(row.state == "missing" for row in rows)
    console.print(
        Text(f"\n{missing} missing: grading is not fully possible here" if missing else "\nReady to grade.")
    )
