"""`junit.xml`: one test case a criterion, for whatever reads JUnit (GitLab, Jenkins, GitHub's reporters).

It keeps to the schema of Jenkins' xUnit plugin (`junit-10.xsd`), which knows no properties of a single case: what a
case is worth stands in its output, and for programs among the suite's properties.
"""

from __future__ import annotations

from lxml import etree

from grader.model.result import AppliedOverride, CriterionResult, ErrorInfo, GradingResult, Note
from grader.model.verdict import FileCitation, Status
from grader.report import sentences
from grader.report.findings import repository_path
from grader.report.text import line, text_limit, visible
from grader.report.view import places, points_of
from grader.wording import number

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


def render_junit(result: GradingResult, prefix: str = "") -> bytes:
    """Return the file's bytes, UTF-8. Among the suite's properties are `points`, `max_points` and each `points:<id>`.

    `prefix` is the package's folder in the repository; without it, files are relative to the package.
    """
    return _Writer(text_limit(len(result.criteria), LIMIT), prefix).document(result)


class _Writer:
    """`limit` is how long a text may be. What XML cannot hold is not a sign that can be seen: it is written out."""

    def __init__(self, limit: int, prefix: str) -> None:
        self._limit, self._prefix = limit, prefix

    def document(self, result: GradingResult) -> bytes:
        suite = etree.Element("testsuite", {"name": self._text(result.rubric.id), **_counts(result)})
        properties = etree.SubElement(suite, "properties")
        about = {"submission": result.submission.id, "package": result.submission.package}
        points = {"points": number(result.points), "max_points": number(result.max_points)}
        late = (
            {"points_before": number(result.late.points_before), "late": result.late.text}
            if result.late
            else {}
        )
        each = {f"points:{c.id}": points_of(c) for c in result.criteria}
        for name, value in {**about, **points, **late, **each}.items():
            etree.SubElement(properties, "property", name=self._text(name), value=self._text(value))
        decided = {override.criterion: override for override in result.overrides}
        for criterion in result.criteria:
            suite.append(self._case(criterion, result.rubric.id, decided.get(criterion.id)))
        if result.error is not None:
            self._error(suite, result.rubric.id, result.error)
        if result.notes:
            etree.SubElement(suite, "system-out").text = self._notes_text(result.notes)
        counts = _counts(result)
        del counts["skipped"]  # the schema has it for suites only
        root = etree.Element("testsuites", counts)
        root.append(suite)
        return etree.tostring(root, xml_declaration=True, encoding="UTF-8", pretty_print=True)

    def _case(
        self, criterion: CriterionResult, rubric_id: str, override: AppliedOverride | None
    ) -> etree._Element:
        cited = next((c for c in criterion.citations if isinstance(c, FileCitation)), None)
        file = (repository_path(self._prefix, cited.file) if self._prefix else cited.file) if cited else ""
        # the schema asks for a time, and a criterion has none
        attributes = {"classname": self._text(rubric_id), "name": self._text(criterion.id), "time": "0"}
        # empty for a file that is not in the repository
        if cited is not None and file:
            attributes["file"] = self._text(file)
            if cited.line is not None:
                attributes["line"] = str(cited.line)
        case = etree.Element("testcase", attributes)
        outcome = OUTCOME[criterion.status]
        if outcome is not None:
            self._outcome(case, outcome, criterion.status.value, criterion.message, self._details(criterion))
        about = {"title": criterion.title, "status": criterion.status.value, "points": points_of(criterion)}
        etree.SubElement(case, "system-out").text = self._lines(
            {**about, **_decision_words(criterion, override)}
        )
        return case

    def _error(self, suite: etree._Element, rubric_id: str, error: ErrorInfo) -> None:
        case = etree.SubElement(suite, "testcase", classname=self._text(rubric_id), name="grading", time="0")
        details = "\n".join(self._text(text) for text in (error.message, error.hint) if text)
        self._outcome(case, "error", error.kind, error.message, details)

    def _details(self, criterion: CriterionResult) -> str:
        rows = {
            "measured": criterion.measured,
            "expected": criterion.expected,
            "hint": criterion.hint,
            "see": criterion.reproduce,
            "where": ", ".join(places(criterion)),
        }
        return "\n".join([self._text(criterion.message), self._lines(rows)]).rstrip("\n")

    def _lines(self, rows: dict[str, str]) -> str:
        """Return `measured: 5 Hz`, a line each."""
        return "\n".join(f"{name}: {self._text(value)}" for name, value in rows.items() if value)

    def _notes_text(self, notes: tuple[Note, ...]) -> str:
        lines = [
            f"{self._text(sentences.note_place(note))}: {self._text(sentences.note_text(note))}"
            for note in notes
        ]
        return "\n".join([f"{sentences.NOTICED_TITLE}. {sentences.COSTS_NOTHING}", *lines])

    def _outcome(self, case: etree._Element, tag: str, kind: str, message: str, details: str) -> None:
        if tag == "skipped":
            etree.SubElement(case, tag, message=self._text(message))
            return
        outcome = etree.SubElement(case, tag, type=self._text(kind), message=self._text(message))
        outcome.text = visible(details, lines=True)

    def _text(self, text: str) -> str:
        return line(text, self._limit)


def _decision_words(criterion: CriterionResult, override: AppliedOverride | None) -> dict[str, str]:
    if override is None:
        return {}
    again = sentences.look_again(override, criterion)
    words = {
        "decided_by_a_person": sentences.decision(override),
        "check": sentences.automatic_words(override, criterion),
    }
    return {**words, **({"look_again": again} if again else {})}


def _counts(result: GradingResult) -> dict[str, str]:
    outcomes = [OUTCOME[c.status] for c in result.criteria] + (["error"] if result.error else [])
    return {
        "tests": str(len(outcomes)),
        "failures": str(outcomes.count("failure")),
        "errors": str(outcomes.count("error")),
        "skipped": str(outcomes.count("skipped")),
        "time": f"{result.timing.wall_s:.3f}",
    }
