"""What was lost, at its place in the repository: what annotations, SARIF and Code Quality are made of."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from enum import Enum
from pathlib import PurePosixPath

from grader.model.result import CriterionResult, GradingResult
from grader.model.verdict import FileCitation, Status
from grader.report.text import line, text_limit
from grader.report.view import points_of

LIMIT = 1000
PLACES_MAX = 10


class Severity(str, Enum):
    """`error`: nothing of its points was reached; `warning`: not all of them; `notice`: it costs nothing."""

    ERROR = "error"
    WARNING = "warning"
    NOTICE = "notice"


@dataclass(frozen=True, kw_only=True)
class SourceLine:
    """A file, relative to the repository's root, and its line, counted from 1."""

    path: str
    line: int


@dataclass(frozen=True, kw_only=True)
class Finding:
    """A criterion that was not reached. Its texts are visible and bounded, of one line each.

    `fingerprint` is the same for the same criterion and file in every run, whatever is measured.
    """

    criterion: CriterionResult
    severity: Severity
    title: str
    message: str
    hint: str
    places: tuple[SourceLine, ...]
    fingerprint: str

    @property
    def said(self) -> str:
        """All of it in one line: `chatter-rate: 0/10 points: it came at 5 Hz. Hint: sleep less`."""
        hint = f". Hint: {self.hint}" if self.hint else ""
        return f"{self.title}: {self.message.rstrip('.')}{hint}"


def findings(result: GradingResult, prefix: str = "") -> tuple[Finding, ...]:
    """What was not reached, by its cost. `prefix` is the package's folder, relative to the repository's root.

    What could not be judged, and what another criterion explains, is none.
    """
    lost = [c for c in result.criteria if c.status in {Status.FAIL, Status.PARTIAL}]
    lost.sort(key=lambda c: -c.missing)
    limit = text_limit(len(result.criteria), LIMIT)
    return tuple(_finding(c, result, prefix, limit) for c in lost)


def _finding(criterion: CriterionResult, result: GradingResult, prefix: str, limit: int) -> Finding:
    cited = [c for c in criterion.citations[:PLACES_MAX] if isinstance(c, FileCitation)]
    places = tuple(  # a file as a whole, such as one without its executable bit, is shown at its first line
        SourceLine(path=path, line=one.line or 1)
        for one in ([c for c in cited if c.line] or cited[:1])
        if (path := repository_path(prefix, one.file))
    )
    return Finding(
        criterion=criterion,
        severity=_severity(criterion),
        title=line(f"{criterion.id}: {_cost(criterion)}", limit),
        message=line(criterion.message or criterion.title, limit),
        hint=line(criterion.hint, limit),
        places=places,
        fingerprint=_fingerprint(result.rubric.id, criterion.id, places),
    )


def _cost(criterion: CriterionResult) -> str:
    if _severity(criterion) is Severity.NOTICE:
        return "advice, costs nothing"
    return f"{points_of(criterion)} points"


def _severity(criterion: CriterionResult) -> Severity:
    if criterion.points >= criterion.max_points:
        return Severity.NOTICE
    return Severity.ERROR if criterion.status is Status.FAIL else Severity.WARNING


def repository_path(prefix: str, file: str) -> str:
    """`file` of the package in `prefix`, with `/` and without detours; empty where it is not inside.

    Another of the lab's packages may lie beside that one: `../lab_msgs/package.xml`.
    """
    folder = PurePosixPath(prefix)
    if folder.name and file.startswith("../"):
        folder, file = folder.parent, file.removeprefix("../")
    parts = [part for part in PurePosixPath(f"{folder}/{file}").parts if part not in {"/", "//", "."}]
    return "" if ".." in parts or not parts else line("/".join(parts), LIMIT)


def _fingerprint(rubric_id: str, criterion_id: str, places: tuple[SourceLine, ...]) -> str:
    told = (rubric_id, criterion_id, places[0].path if places else "")
    return hashlib.sha256("\0".join(told).encode("utf-8", "backslashreplace")).hexdigest()
