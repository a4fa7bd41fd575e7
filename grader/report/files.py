"""The files of one result, each whole or not at all."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from grader.files import atomic_write
from grader.model.figure import Figures
from grader.model.result import GradingResult
from grader.report.forms import FORMS, ReportInput
from grader.report.result_json import result_bytes
from grader.report.text import visible
from grader.report.view import without_hidden
from grader.rubric.model import Rubric

CONSOLE_CHARS = 4_000_000


def write_reports(
    result: GradingResult,
    out_dir: Path,
    *,
    console: str,
    rubric: Rubric,
    keep_hidden: bool = True,
    figures: Figures | None = None,
    docs: Mapping[str, Mapping[str, str]] | None = None,
) -> tuple[Path, ...]:
    """Write `result.json`, `report.html`, `report.md`, `junit.xml` and `console.log` into `out_dir`; gives their paths.

    Without `keep_hidden`, hidden criteria are left out and their number said. `docs` has of each check by name the
    sections of its docstring. Raises OutputError.
    """
    shown = result if keep_hidden else without_hidden(result, rubric)
    about = ReportInput(
        result=shown,
        rubric=rubric,
        hidden=len(result.criteria) - len(shown.criteria),
        docs=docs or {},
        load_figures=lambda: figures,
    )
    files = {
        "result.json": result_bytes(shown),
        **render_files(about),
        "console.log": _console(console).encode(),
    }
    for name, data in files.items():
        atomic_write(out_dir / name, data)
    return tuple(out_dir / name for name in files)


def render_files(shown: ReportInput) -> dict[str, bytes]:
    """Return the reports that stand beside every `result.json`, by the names of their files."""
    return {form.file: form.render(shown) for form in FORMS.values() if form.in_results}


def _console(text: str) -> str:
    rows: list[str] = []
    room = CONSOLE_CHARS
    for row in text.splitlines(keepends=True):
        shown = visible(row[:room], lines=True)
        if len(row) > room or len(shown) > room:
            return "".join([*rows, "… the rest is in the evidence\n"])
        rows.append(shown)
        room -= len(shown)
    return "".join(rows)
