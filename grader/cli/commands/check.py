"""`grader check [PATH]`: the student's own look before handing in."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

from grader import pipeline
from grader.cli.choice import choose
from grader.cli.display import open_progress
from grader.cli.show import show
from grader.errors import ExitCode
from grader.files import check_writable
from grader.report.hidden import hidden_ids, without_hidden
from grader.temporary import temporary_folder

if TYPE_CHECKING:
    from grader.arena.sandbox import Mode


def run(
    *,
    path: str = ".",
    rubric: str | None = None,
    static: bool = False,
    out: Path | None = None,
    sandbox: Mode = "auto",
    as_json: bool = False,
) -> ExitCode:
    """Grade the package at `path` with hidden criteria left out; with `static`, from its files alone."""
    loaded, source = choose(Path(path), rubric)
    if out is not None:
        check_writable(out)
    options = pipeline.GradeOptions(
        sandbox=sandbox, submission_id=None, static_only=static, keep_hidden=False
    )
    with ExitStack() as stack:
        folder = out or stack.enter_context(temporary_folder("check"))
        with open_progress(early=not (as_json or static)) as progress:
            result = pipeline.grade(source, loaded, folder, options, progress)
        shown = without_hidden(result, loaded.rubric)
        kept = folder / result.submission.id if out is not None else None
        hidden = len(hidden_ids(loaded.rubric))
        return show(shown, loaded.rubric, kept, hidden=hidden, as_json=as_json, static=static)
