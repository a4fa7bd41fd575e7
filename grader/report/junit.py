"""`junit.xml`: one test case a criterion, for whatever reads JUnit (GitLab, Jenkins, GitHub's reporters)."""

from __future__ import annotations

from lxml import etree

from grader.model.result import CriterionResult, GradingResult
from grader.model.verdict import FileCitation, Status
from grader.report.text import clip, number, visible
from grader.report.view import places

OUTCOME = {
    Status.PASS: None,
    Status.PARTIAL: "failure",
    Status.FAIL: "failure",
    Status.INCONCLUSIVE: "error",
    Status.ERROR: "error",
    Status.BLOCKED: "skipped",
    Status.MANUAL: "skipped",
}
LIMIT = 2000


def junit(result: GradingResult) -> bytes:
    """The file's bytes, UTF-8. Points are properties of each case, and of the suite."""
    suite = etree.Element("testsuite", {"name": _text(result.rubric.id), **_counts(result)})
    _properties(
        suite,
        {
            "submission": result.submission.id,
            "package": result.submission.package,
            "points": number(result.points),
            "max_points": number(result.max_points),
        },
    )
    for criterion in result.criteria:
        suite.append(_case(criterion, result.rubric.id))
    if result.error is not None:
        case = etree.SubElement(
            suite, "testcase", classname=_text(result.rubric.id), name="grading", time="0"
        )
        text = f"{result.error.message}\n{result.error.hint}".strip()
        _outcome(case, "error", result.error.kind, result.error.message, text)
    root = etree.Element("testsuites", _counts(result))
    root.append(suite)
    return etree.tostring(root, xml_declaration=True, encoding="UTF-8", pretty_print=True)


def _counts(result: GradingResult) -> dict[str, str]:
    outcomes = [OUTCOME[c.status] for c in result.criteria] + (["error"] if result.error else [])
    return {
        "tests": str(len(outcomes)),
        "failures": str(outcomes.count("failure")),
        "errors": str(outcomes.count("error")),
        "skipped": str(outcomes.count("skipped")),
        "time": f"{result.timing.wall_s:.3f}",
    }


def _case(criterion: CriterionResult, rubric_id: str) -> etree._Element:
    place = next((c for c in criterion.citations if isinstance(c, FileCitation)), None)
    attributes = {"classname": _text(rubric_id), "name": _text(criterion.id), "time": "0"}
    if place is not None:
        attributes["file"] = _text(place.file)
        if place.line is not None:
            attributes["line"] = str(place.line)
    case = etree.Element("testcase", attributes)
    points = {"points": number(criterion.points), "max_points": number(criterion.max_points)}
    _properties(case, {"title": criterion.title, "status": criterion.status.value, **points})
    outcome = OUTCOME[criterion.status]
    if outcome is not None:
        _outcome(case, outcome, criterion.status.value, criterion.message, _details(criterion))
    return case


def _details(criterion: CriterionResult) -> str:
    rows = {
        "measured": criterion.measured,
        "expected": criterion.expected,
        "hint": criterion.hint,
        "see": criterion.reproduce,
        "where": ", ".join(places(criterion)),
    }
    lines = [f"{name}: {_text(value)}" for name, value in rows.items() if value]
    return "\n".join([_text(criterion.message), *lines])


def _outcome(case: etree._Element, tag: str, kind: str, message: str, details: str) -> None:
    if tag == "skipped":
        etree.SubElement(case, tag, message=_text(message))
        return
    etree.SubElement(case, tag, type=_text(kind), message=_text(message)).text = visible(details, lines=True)


def _properties(parent: etree._Element, values: dict[str, str]) -> None:
    properties = etree.SubElement(parent, "properties")
    for name, value in values.items():
        etree.SubElement(properties, "property", name=name, value=_text(value))


def _text(text: str) -> str:
    return visible(clip(text, LIMIT))
