"""`grader rubric copy LAB`: the rubric of a lab that comes with the grader, to change it."""

from __future__ import annotations

from pathlib import Path

from grader.cli.output import say, say_document
from grader.errors import ExitCode, UsageError
from grader.files import atomic_write
from grader.rubric.load import load_rubric


def run(*, lab: str, out: str = "-", force: bool = False) -> ExitCode:
    """Write its file as it is. Raises UsageError for a file that exists."""
    path = load_rubric(lab).path
    if out != "-" and Path(out).exists() and not force:
        raise UsageError(f"{out} exists", hint="choose another --out, or add --force")
    data = path.read_bytes()
    if out == "-":
        say_document(lambda _: data.decode("utf-8"))
        return ExitCode.PASSED
    atomic_write(Path(out), data, public=True)
    say(f"{out}: change it, then `grader rubric validate {out}`")
    return ExitCode.PASSED
