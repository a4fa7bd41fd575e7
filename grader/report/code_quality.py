"""GitLab's Code Quality report: what was lost at a line of a file, for the widget and the diff of a merge request."""

from __future__ import annotations

from grader.model.result import GradingResult
from grader.report.findings import Finding, Severity, findings
from grader.report.text import json_text

SEVERITIES = {Severity.ERROR: "major", Severity.WARNING: "minor", Severity.NOTICE: "info"}


def render_code_quality(result: GradingResult, prefix: str = "") -> str:
    """JSON, a list; empty where nothing was lost at a line. `prefix` is the package's folder in the repository."""
    return json_text([_issue(finding) for finding in findings(result, prefix) if finding.places])


def _issue(finding: Finding) -> dict[str, object]:
    first = finding.places[0]
    return {
        "type": "issue",
        "check_name": finding.criterion.id,
        "description": finding.said,
        "categories": ["Bug Risk"],
        "severity": SEVERITIES[finding.severity],
        "fingerprint": finding.fingerprint,
        "location": {"path": first.path, "lines": {"begin": first.line}},
    }
