"""`grader rubric new --from SOLUTION`: a first rubric, ready to edit."""

from __future__ import annotations

import re
from pathlib import Path

from grader import pipeline
from grader.arena.sandbox import Mode
from grader.authoring.new import propose_rubric
from grader.cli.display import open_progress
from grader.cli.output import say, say_document
from grader.cli.host_support import say_unwalled
from grader.cli.select_rubric import only_package
from grader.errors import ExitCode, UsageError
from grader.files import atomic_write
from grader.rubric.model import NAME_PATTERN


def run(
    *,
    solution: str,
    package: str | None = None,
    rubric_id: str | None = None,
    out: str = "-",
    force: bool = False,
    sandbox: Mode = "auto",
) -> ExitCode:
    """Run the solution, and write a rubric that asks for what it does. Raises UsageError for a file that exists."""
    name = package or only_package(solution)
    chosen = rubric_id or _id(Path(out).stem if out != "-" else name)
    if out != "-" and Path(out).exists() and not force:
        raise UsageError(f"{out} exists", hint="choose another --out, or add --force")
    options = pipeline.GradeOptions(sandbox=sandbox)
    say_unwalled(sandbox)
    with open_progress() as progress:
        text = propose_rubric(solution, name, chosen, options, progress)
    if out == "-":
        say_document(lambda _: text)
        return ExitCode.PASSED
    atomic_write(Path(out), text.encode(), public=True)
    say(f"{out}: look through it, then `grader rubric validate {out}`")
    say(f"and `grader rubric test {out} --solution {solution}`")
    return ExitCode.PASSED


def _id(text: str) -> str:
    """An id as rubrics have them. Raises UsageError for a text that makes none."""
    found = re.sub(r"[^a-z0-9]+", "-", text.lower()).strip("-")
    if not re.fullmatch(NAME_PATTERN, found):
        raise UsageError(f"{text!r} makes no id", hint="give --id: small letters, digits and hyphens")
    return found
