"""GitLab CI: the reports are files that `ci/gitlab.yml` names; later jobs get the points as variables."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from grader.errors import GraderError
from grader.files import atomic_write
from grader.integrations.ci_results import Graded, Outcome, outcome_of_error
from grader.wording import number

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
