"""`grader labs`: the rubrics that come with the grader."""

from __future__ import annotations

import sys

from rich.table import Table
from rich.text import Text

from grader.cli.output import say_json
from grader.errors import ExitCode
from grader.report.terminal import emit, open_console
from grader.report.text import visible
from grader.rubric.load import all_rubrics
from grader.rubric.model import Rubric
from grader.wording import number


def run(*, as_json: bool = False) -> ExitCode:
    """List them, with the package that each is for."""
    rubrics = [loaded.rubric for loaded in all_rubrics()]
    if as_json:
        say_json([_row(r) for r in rubrics])
        return ExitCode.PASSED
    table = Table(box=None, padding=(0, 2, 0, 0), pad_edge=False, header_style="dim")
    for heading in ("lab", "package", "criteria", "points", "title"):
        table.add_column(heading, no_wrap=heading != "title")
    for r in rubrics:
        cells = (r.id, r.package, str(len(r.criteria)), number(r.max_points), r.title)
        table.add_row(*(Text(visible(cell)) for cell in cells))
    emit(open_console(sys.stdout), [table])
    return ExitCode.PASSED


def _row(rubric: Rubric) -> dict[str, object]:
    return {
        "id": rubric.id,
        "title": rubric.title,
        "version": rubric.version,
        "package": rubric.package,
        "criteria": len(rubric.criteria),
        "max_points": rubric.max_points,
    }
