"""GitHub Actions and GitLab CI are told what came of a grading.

GitHub gets annotations, the step's summary and outputs. Values go into files, each between lines that cannot be
guessed; while anything of a student's may be printed, the runner is told to ignore commands. For GitLab the reports are
files that `ci/gitlab.yml` names; later jobs get the points as variables.
"""

from __future__ import annotations

import secrets
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from grader.errors import GraderError, OutputError
from grader.files import atomic_write
from grader.integrations.ci_results import TITLES, Graded, Outcome, outcome_of_error, summarize
from grader.report.classroom import render_classroom
from grader.report.findings import EACH_MAX, Severity, github_annotation, render_annotations
from grader.report.text import line, markdown
from grader.wording import number

LINE_CHARS = 1000


class GitHub:
    """Tells GitHub's runner. `variables` are those of the step; without the name of a file, that part is left out."""

    def __init__(self, variables: Mapping[str, str]) -> None:
        self._outputs = variables.get("GITHUB_OUTPUT", "")
        self._summary = variables.get("GITHUB_STEP_SUMMARY", "")

    @contextmanager
    def commands_stopped(self) -> Iterator[None]:
        """Keep the runner from taking anything printed in this block for a command."""
        token = secrets.token_hex(20)
        _print(f"::stop-commands::{token}\n")
        try:
            yield
        finally:
            _print(f"\n::{token}::\n")

    def tell(self, graded: Graded) -> None:
        """Write the annotations, summary and outputs of a result. Raises OutputError."""
        result = graded.counted.model_copy(update={"error": None})  # it is in `text`, with whose fault it is
        text = "\n".join(part for part in (graded.message, graded.hint) if part)
        _print(github_annotation(_severity(graded), graded.title, text))
        _print(render_annotations(result, graded.prefix, each_max=EACH_MAX - 1))
        self._add(self._summary, f"{_heading(graded.title, graded.message)}\n\n{summarize(graded)}\n")
        self._write_outputs(_values(graded))

    def tell_error(self, error: GraderError) -> None:
        """Write the same where there is no result. Raises OutputError."""
        outcome = outcome_of_error(error)
        text = "\n".join(part for part in (error.message, error.hint) if part)
        _print(github_annotation(Severity.ERROR, TITLES[outcome], text))
        self._add(
            self._summary,
            f"{_heading(TITLES[outcome], error.message)}\n\n{markdown(line(error.hint, LINE_CHARS))}\n",
        )
        self._write_outputs({"status": outcome.value, "passed": "false"})

    def _write_outputs(self, values: Mapping[str, str]) -> None:
        rows = []
        for name, value in values.items():
            end = f"end-{secrets.token_hex(20)}"
            rows.append(f"{name}<<{end}\n{value}\n{end}\n")
        self._add(self._outputs, "".join(rows))

    def _add(self, file: str, text: str) -> None:
        if not file:
            return
        try:
            with Path(file).open("a", encoding="utf-8", errors="backslashreplace") as stream:
                stream.write(text)
        except OSError as error:
            message = f"{file} cannot be written: {error.strerror}"
            raise OutputError(
                message, hint="GitHub made this file: does it belong to the container's user?"
            ) from error


def _values(graded: Graded) -> dict[str, str]:
    counted = graded.outcome is not Outcome.NOT_GRADED
    passed = graded.outcome is Outcome.PASSED
    encoded = render_classroom(graded.counted, graded.rubric, passed=passed, prefix=graded.prefix).rstrip()
    report = graded.folder / "report.html"
    return {
        "points": number(graded.counted.points) if counted else "",
        "max-points": number(graded.counted.max_points),
        "status": graded.outcome.value,
        "passed": str(passed).lower(),
        "rubric-origin": graded.result.rubric_origin or "",
        "report": str(report) if report.is_file() else "",
        "result": encoded,
    }


def _severity(graded: Graded) -> Severity:
    if graded.outcome is Outcome.PASSED and graded.result.rubric_origin != "submission":
        return Severity.NOTICE
    return Severity.ERROR if graded.fails else Severity.WARNING


def _heading(title: str, text: str) -> str:
    return f"**{title}:** {markdown(line(text, LINE_CHARS))}"


def _print(text: str) -> None:
    """Print at once, in order with the report on the terminal."""
    encoding = sys.stdout.encoding or "ascii"
    sys.stdout.write(text.encode(encoding, "backslashreplace").decode(encoding))
    sys.stdout.flush()


VARIABLES = "grader.env"


class GitLab:
    """Tells GitLab's runner through files in `out`."""

    def __init__(self, out: Path) -> None:
        self._out = out

    @contextmanager
    def commands_stopped(self) -> Iterator[None]:
        """Do nothing: GitLab obeys only escape sequences, and the reports have none."""
        yield

    def tell(self, graded: Graded) -> None:
        """Write the points as variables. Raises OutputError."""
        counted = graded.outcome is not Outcome.NOT_GRADED
        self._write(
            {
                "GRADER_POINTS": number(graded.counted.points) if counted else "",
                "GRADER_MAX_POINTS": number(graded.counted.max_points),
                "GRADER_STATUS": graded.outcome.value,
                "GRADER_RUBRIC_ORIGIN": graded.result.rubric_origin or "",
            }
        )

    def tell_error(self, error: GraderError) -> None:
        """Write the outcome where there is no result. Raises OutputError."""
        if not self._out.is_symlink() and (self._out.is_dir() or not self._out.exists()):
            self._write({"GRADER_STATUS": outcome_of_error(error).value})

    def _write(self, values: dict[str, str]) -> None:
        atomic_write(
            self._out / VARIABLES, "".join(f"{name}={value}\n" for name, value in values.items()).encode()
        )
