"""`grader grade SOURCE --rubric ID|FILE`."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

from grader import pipeline
from grader.cli.display import open_progress
from grader.cli.host_support import say_unwalled
from grader.cli.outcome import show
from grader.errors import ExitCode
from grader.files import check_writable
from grader.intake.recordings import is_recording
from grader.rubric.load import load_rubric

if TYPE_CHECKING:
    from grader.arena.sandbox import Mode

DEFAULT_OUT = Path("grader-results")


def run(
    *,
    source: str,
    rubric: str,
    out: Path | None = None,
    submission_id: str | None = None,
    sandbox: Mode = "auto",
    as_json: bool = False,
) -> ExitCode:
    """Grade one submission into `out/<submission id>/` and show the report."""
    loaded = load_rubric(rubric)
    folder = out or DEFAULT_OUT
    check_writable(folder)
    options = pipeline.GradeOptions(
        sandbox=sandbox, submission_id=submission_id, static_only=False, keep_hidden=True
    )
    if not is_recording(Path(source)):
        say_unwalled(sandbox, loaded)
    with open_progress(early=sys.stdout.isatty() and not as_json) as progress:
        result = pipeline.grade(source, loaded, folder, options, progress)
    return show(result, loaded.rubric, folder / result.submission.id, as_json=as_json)
