"""SARIF 2.1.0: what was lost at a line of a file, for code scanning and for editors."""

from __future__ import annotations

from collections.abc import Mapping
from urllib.parse import quote

from grader import __version__
from grader.model.result import GradingResult
from grader.report.findings import Finding, Severity, SourceLine, findings
from grader.report.text import json_text, line

SCHEMA = "https://docs.oasis-open.org/sarif/sarif/v2.1.0/errata01/os/schemas/sarif-schema-2.1.0.json"
ROOT = "%SRCROOT%"
FINGERPRINT = "criterionAndFile/v1"
HELP_CHARS = 4000
LEVELS = {Severity.ERROR: "error", Severity.WARNING: "warning", Severity.NOTICE: "note"}
Docs = Mapping[str, Mapping[str, str]]
"""Of each check by name the sections of its docstring, by their headings."""


def render_sarif(result: GradingResult, prefix: str = "", *, docs: Docs | None = None) -> str:
    """JSON, one run. `prefix` is the package's folder in the repository, `docs` what the rules' help is made of."""
    found = [finding for finding in findings(result, prefix) if finding.places]
    checks = list(dict.fromkeys(finding.criterion.check for finding in found))
    driver = {
        "name": "ros-lab-grader",
        "version": __version__,
        "rules": [_rule(check, (docs or {}).get(check, {})) for check in checks],
    }
    run = {
        "tool": {"driver": driver},
        "originalUriBaseIds": {ROOT: {"description": {"text": "the repository's root"}}},
        "columnKind": "unicodeCodePoints",
        "results": [_result(finding, checks.index(finding.criterion.check)) for finding in found],
    }
    return json_text({"$schema": SCHEMA, "version": "2.1.0", "runs": [run]})


def _rule(check: str, sections: Mapping[str, str]) -> dict[str, object]:
    title = line(check, 200)
    text = "\n\n".join(f"{heading}: {words}" for heading, words in sections.items() if words)
    marked = "\n\n".join(f"**{heading}.** {words}" for heading, words in sections.items() if words)
    helped = {"help": {"text": text[:HELP_CHARS], "markdown": marked[:HELP_CHARS]}} if text else {}
    return {"id": title, "shortDescription": {"text": title}, **helped}


def _result(finding: Finding, rule: int) -> dict[str, object]:
    first, *others = finding.places
    related = [{"id": i, **_location(place)} for i, place in enumerate(others, start=1)]
    return {
        "ruleId": line(finding.criterion.check, 200),
        "ruleIndex": rule,
        "level": LEVELS[finding.severity],
        "message": {"text": _unlinked(finding.said)},
        "locations": [_location(first)],
        **({"relatedLocations": related} if related else {}),
        "partialFingerprints": {FINGERPRINT: finding.fingerprint},
        "properties": {"points": finding.criterion.points, "maxPoints": finding.criterion.max_points},
    }


def _location(place: SourceLine) -> dict[str, object]:
    artifact = {"uri": quote(place.path), "uriBaseId": ROOT}
    return {"physicalLocation": {"artifactLocation": artifact, "region": {"startLine": place.line}}}


def _unlinked(text: str) -> str:
    """SARIF's own links, `[text](target)`, are escaped; brackets that make none stay as they are."""
    return text.replace("[", "\\[").replace("]", "\\]") if "](" in text else text
