"""The folder that a CI system keeps: every report, and the evidence of what is shown."""

from __future__ import annotations

import shutil
from contextlib import suppress
from pathlib import Path

from grader.errors import OutputError
from grader.files import atomic_write, make_folder
from grader.model.result import GradingResult
from grader.report.forms import FORMS, Shown
from grader.rubric.model import Rubric

WITH_LINES = ("junit", "code-quality", "sarif")
"""Forms that are rendered once more, or only here, with files as the repository has them."""
OURS = frozenset(
    {
        "console.log", "evidence", "grader.env", "result.json", *(FORMS[name].file for name in WITH_LINES),
        *(form.file for form in FORMS.values() if form.in_results),
    }
)  # fmt: skip
SECTION = "== "


def clear(out: Path) -> None:
    """Make the folder, empty. What an earlier run left goes first, so that nobody takes it for this one's.

    Raises OutputError where there is anything else in it, or where it is a link.
    """
    try:
        names = {entry.name for entry in out.iterdir()} if out.is_dir() else set()
        if out.is_symlink() or (out.exists() and not out.is_dir()) or names - OURS:
            raise OutputError(f"{out} is in the way of the results", hint="remove it from the repository")
        for name in names:
            path = out / name
            shutil.rmtree(path) if path.is_dir() and not path.is_symlink() else path.unlink()
        make_folder(out)
    except OSError as error:
        raise OutputError(
            f"{out} cannot be written: {error.strerror}", hint="say where else it may go"
        ) from error


def keep(made: Path, out: Path, rubric: Rubric) -> None:
    """Move a submission's results to `out`, without what only hidden criteria look at. Raises OutputError."""
    unseen = _hidden_scenarios(rubric)
    try:
        for name in sorted(OURS):
            if (made / name).exists():
                shutil.move(made / name, out / name)
        for name in unseen:
            (out / "evidence" / f"{name}.mcap").unlink(missing_ok=True)
        with suppress(FileNotFoundError):
            console = (out / "console.log").read_text(encoding="utf-8")
            atomic_write(out / "console.log", _without(console, unseen).encode())
    except OSError as error:
        raise OutputError(f"{out} cannot be written: {error.strerror}", hint="make room there") from error


def add_forms(
    out: Path, result: GradingResult, rubric: Rubric, prefix: str, docs: dict[str, dict[str, str]]
) -> None:
    """The reports that know files by their place in the repository. Raises OutputError."""
    shown = Shown(result=result, rubric=rubric, prefix=prefix, docs=docs)
    for name in WITH_LINES:
        atomic_write(out / FORMS[name].file, FORMS[name].render(shown))


def _hidden_scenarios(rubric: Rubric) -> frozenset[str]:
    used = {"visible": set[str](), "hidden": set[str]()}
    for criterion in rubric.criteria:
        if criterion.scenario is not None:
            used[criterion.visibility].add(criterion.scenario)
    return frozenset(used["hidden"] - used["visible"])


def _without(console: str, unseen: frozenset[str]) -> str:
    """A run's part begins with its name; all other lines begin with a time."""
    kept, shown = [], True
    for row in console.splitlines(keepends=True):
        if row.startswith(SECTION):
            shown = row.removeprefix(SECTION).strip() not in unseen
        if shown:
            kept.append(row)
    return "".join(kept)
