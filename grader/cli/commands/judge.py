"""`grader judge EVIDENCE… --rubric ID|FILE`: the same criteria as when it was graded, without ROS."""

from __future__ import annotations

from pathlib import Path

from grader.cli.outcome import exit_code
from grader.cli.say import say_document
from grader.errors import ExitCode
from grader.evidence.reader import load_evidence
from grader.files import atomic_write
from grader.judge import judge
from grader.judge.summary import criteria_bytes, criteria_text
from grader.rubric.load import load_rubric


def run(*, evidence: list[Path], rubric: str, out: str = "-") -> ExitCode:
    """Judge and write the criteria as JSON to the file `out`, or to stdout."""
    loaded = load_rubric(rubric)
    criteria = judge(loaded.rubric, load_evidence(evidence), loaded.checks)
    if out == "-":
        say_document(lambda ascii_only: criteria_text(criteria, ascii_only=ascii_only))
    else:
        atomic_write(Path(out), criteria_bytes(criteria))
    return exit_code(criteria, loaded.rubric)
