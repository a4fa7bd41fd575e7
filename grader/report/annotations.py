"""GitHub's annotations: commands to its runner, printed by a step of a workflow."""

from __future__ import annotations

from collections.abc import Iterator

from grader.model.result import GradingResult
from grader.report.findings import Finding, Severity, findings
from grader.report.text import line
from grader.wording import number

EACH_MAX = 10
"""So many of each kind GitHub shows of one step."""
TEXT_CHARS = 1000
_DATA = str.maketrans({"%": "%25", "\r": "%0D", "\n": "%0A"})
_PROPERTY = str.maketrans({"%": "%25", "\r": "%0D", "\n": "%0A", ":": "%3A", ",": "%2C"})


def render_annotations(result: GradingResult, prefix: str = "", *, each_max: int = EACH_MAX) -> str:
    """Return a line each, the costliest first, `each_max` of each kind at most; the rest is counted in the log.

    What has no line of a file is shown at the run itself. `prefix` is the package's folder in the repository.
    """
    found = findings(result, prefix)
    return "".join(f"{row}\n" for row in (*_error(result), *_rows(found, each_max), _summary(result)))


def github_annotation(severity: Severity, title: str, message: str) -> str:
    """Return a line of ours, at the run itself. The texts are made visible and bounded here."""
    told = "\n".join(line(row, TEXT_CHARS) for row in message.split("\n"))
    return _command(severity, {"title": line(title, TEXT_CHARS)}, told) + "\n"


def _rows(found: tuple[Finding, ...], each_max: int) -> Iterator[str]:
    for severity in Severity:
        alike = [finding for finding in found if finding.severity is severity]
        for finding in alike[:each_max]:
            message = "\n".join(text for text in (finding.message, finding.hint) if text)
            yield _command(severity, _properties(finding), message)
        if len(alike) > each_max:
            yield f"and {len(alike) - each_max} more of these: they are in the report"


def _properties(finding: Finding) -> dict[str, str]:
    where = {"file": finding.places[0].path, "line": str(finding.places[0].line)} if finding.places else {}
    return {**where, "title": finding.title}


def _error(result: GradingResult) -> Iterator[str]:
    if result.error is not None:
        text = "\n".join(line(part, TEXT_CHARS) for part in (result.error.message, result.error.hint) if part)
        yield _command(Severity.ERROR, {"title": "It could not be graded"}, text)


def _summary(result: GradingResult) -> str:
    if result.status == "error":
        return "not graded"
    open_ = ", not settled yet: something could not be judged" if result.status == "inconclusive" else ""
    return f"{number(result.points)} of {number(result.max_points)} points{open_}"


def _command(severity: Severity, properties: dict[str, str], message: str) -> str:
    told = ",".join(f"{name}={value.translate(_PROPERTY)}" for name, value in properties.items())
    return f"::{severity.value} {told}::{message.translate(_DATA)}"
