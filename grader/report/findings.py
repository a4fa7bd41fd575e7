"""What was lost, at its place in the repository, and the forms that are made of it.

GitHub's annotations are commands to its runner, printed by a step of a workflow. GitLab's Code Quality report is for
the widget and the diff of a merge request; SARIF 2.1.0 is for code scanning and for editors. Both say what was lost at
a line of a file.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from enum import Enum
from pathlib import PurePosixPath
from urllib.parse import quote

from grader import __version__
from grader.model.result import CriterionResult, GradingResult
from grader.model.verdict import FileCitation, Status
from grader.report.text import json_text, line, text_limit
from grader.report.view import points_of
from grader.wording import number

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
        """All of it on one line: `chatter-rate: 0/10 points: it came at 5 Hz. Hint: sleep less`."""
        hint = f". Hint: {self.hint}" if self.hint else ""
        return f"{self.title}: {self.message.rstrip('.')}{hint}"


def findings(result: GradingResult, prefix: str = "") -> tuple[Finding, ...]:
    """Return what was not reached, by its cost. `prefix` is the package's folder, relative to the repository's root.

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
    # joined with a sign that none of them can have, so that no two findings have the same text
    told = (result.rubric.id, criterion.id, places[0].path if places else "")
    return Finding(
        criterion=criterion,
        severity=_severity(criterion),
        title=line(f"{criterion.id}: {_cost(criterion)}", limit),
        message=line(criterion.message or criterion.title, limit),
        hint=line(criterion.hint, limit),
        places=places,
        fingerprint=hashlib.sha256("\0".join(told).encode("utf-8", "backslashreplace")).hexdigest(),
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
    """Return the path of the package's `file` with `/` and without detours; empty where it is not in the repository.

    Another of the lab's packages may lie beside that one: `../lab_msgs/package.xml`.
    """
    folder = PurePosixPath(prefix)
    if folder.name and file.startswith("../"):
        folder, file = folder.parent, file.removeprefix("../")
    parts = [part for part in PurePosixPath(f"{folder}/{file}").parts if part not in {"/", "//", "."}]
    return "" if ".." in parts or not parts else line("/".join(parts), LIMIT)


EACH_MAX = 10
"""So many of each kind GitHub shows of one step."""
TEXT_CHARS = 1000
# as GitHub's own toolkit escapes them; a property ends at `,` or `:`
_DATA = str.maketrans({"%": "%25", "\r": "%0D", "\n": "%0A"})
_PROPERTY = str.maketrans({"%": "%25", "\r": "%0D", "\n": "%0A", ":": "%3A", ",": "%2C"})


def render_annotations(result: GradingResult, prefix: str = "", *, each_max: int = EACH_MAX) -> str:
    """Return a line each, the costliest first, `each_max` of each kind at most; the rest is counted in the log.

    What has no line of a file is shown at the run itself. `prefix` is the package's folder in the repository.
    """
    found = findings(result, prefix)
    return "".join(
        f"{row}\n" for row in (*_not_graded(result), *_annotations(found, each_max), _last_row(result))
    )


def github_annotation(severity: Severity, title: str, message: str) -> str:
    """Return a line of ours, at the run itself. The texts are made visible and bounded here."""
    told = "\n".join(line(row, TEXT_CHARS) for row in message.split("\n"))
    return _github_command(severity, {"title": line(title, TEXT_CHARS)}, told) + "\n"


def _annotations(found: tuple[Finding, ...], each_max: int) -> Iterator[str]:
    for severity in Severity:
        alike = [finding for finding in found if finding.severity is severity]
        for finding in alike[:each_max]:
            message = "\n".join(text for text in (finding.message, finding.hint) if text)
            at = finding.places[0] if finding.places else None
            where = {"file": at.path, "line": str(at.line)} if at else {}
            yield _github_command(severity, {**where, "title": finding.title}, message)
        if len(alike) > each_max:
            yield f"and {len(alike) - each_max} more of these: they are in the report"


def _not_graded(result: GradingResult) -> Iterator[str]:
    if result.error is not None:
        text = "\n".join(line(part, TEXT_CHARS) for part in (result.error.message, result.error.hint) if part)
        yield _github_command(Severity.ERROR, {"title": "It could not be graded"}, text)


def _last_row(result: GradingResult) -> str:
    if result.status == "error":
        return "not graded"
    open_ = ", not decided yet: something could not be judged" if result.status == "inconclusive" else ""
    return f"{number(result.points)} of {number(result.max_points)} points{open_}"


def _github_command(severity: Severity, properties: dict[str, str], message: str) -> str:
    told = ",".join(f"{name}={value.translate(_PROPERTY)}" for name, value in properties.items())
    return f"::{severity.value} {told}::{message.translate(_DATA)}"


SEVERITIES = {Severity.ERROR: "major", Severity.WARNING: "minor", Severity.NOTICE: "info"}


def render_code_quality(result: GradingResult, prefix: str = "") -> str:
    """Return JSON, a list; empty where nothing was lost at a line. `prefix` is the package's folder there."""
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


SCHEMA = "https://docs.oasis-open.org/sarif/sarif/v2.1.0/errata01/os/schemas/sarif-schema-2.1.0.json"
ROOT = "%SRCROOT%"
FINGERPRINT = "criterionAndFile/v1"
HELP_CHARS = 4000
LEVELS = {Severity.ERROR: "error", Severity.WARNING: "warning", Severity.NOTICE: "note"}
Docs = Mapping[str, Mapping[str, str]]
"""Of each check by name the sections of its docstring, by their headings."""


def render_sarif(result: GradingResult, prefix: str = "", *, docs: Docs | None = None) -> str:
    """Return JSON, one run. `prefix` is the package's folder in the repository, `docs` what the rules' help says."""
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
        "message": {"text": _escape_links(finding.said)},
        "locations": [_location(first)],
        **({"relatedLocations": related} if related else {}),
        "partialFingerprints": {FINGERPRINT: finding.fingerprint},
        "properties": {"points": finding.criterion.points, "maxPoints": finding.criterion.max_points},
    }


def _location(place: SourceLine) -> dict[str, object]:
    artifact = {"uri": quote(place.path), "uriBaseId": ROOT}
    return {"physicalLocation": {"artifactLocation": artifact, "region": {"startLine": place.line}}}


def _escape_links(text: str) -> str:
    """Return the text with SARIF's own links, `[text](target)`, escaped; other brackets stay as they are."""
    return text.replace("[", "\\[").replace("]", "\\]") if "](" in text else text
