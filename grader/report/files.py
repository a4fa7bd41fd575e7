"""The files of one result, each whole or not at all.

`result.json` (schema `grader.result/1`) has its keys in their fixed order.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from grader.files import atomic_write
from grader.model.figure import Figures
from grader.model.result import GradingResult
from grader.report.forms import FORMS, ReportInput
from grader.report.text import visible
from grader.report.view import without_hidden
from grader.rubric.model import Rubric
from grader.untrusted_text import clipped, json_text, text_limit

LIMIT = 2000


def result_bytes(result: GradingResult) -> bytes:
    """Return the file's bytes, UTF-8 (see `result_text`)."""
    return result_text(result).encode()


def result_text(result: GradingResult, *, ascii_only: bool = False) -> str:
    """Return the file's text. `notes`, `overrides`, `handed_in`, `late`, `standing` and `error` are there if not empty.

    What a person wrote is bounded by its record and stays whole: a later grading compares it. Criteria are written as
    `judging.summary.criteria_bytes` writes them.
    """
    data: dict[str, Any] = result.model_dump(mode="json", by_alias=True)
    for name in ("notes", "overrides", "handed_in", "late", "standing", "error"):
        if not data[name]:
            del data[name]
    data = clipped(data, text_limit(len(result.criteria), LIMIT))
    # put back whole, after all texts have been cut
    for written, override in zip(data.get("overrides", ()), result.overrides, strict=False):
        written |= {"comment": override.comment, "author": override.author}
    return json_text(data, ascii_only=ascii_only)


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
