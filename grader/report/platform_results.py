"""What two course platforms read: Gradescope's `results.json`, and base64 of JSON for GitHub Classroom's reporter.

Gradescope knows no test that could not be judged. Such a one has no score here, and its name and the page's first line
say that a person must look. Where the machine or the grader is at fault that nothing was graded there is no file:
Gradescope then says that the autograder has failed, gives no points, and the staff can run it again. Where what was
handed in cannot be graded, the student reads why at once, and that this 0 is not graded.

Classroom's reporter adds up the scores and hands the sum on; an environment variable carries the text to it, which may
have 128 KiB. It prints names, messages and code as they are, so no line of ours may be a command to the runner. What a
person has to judge has the status `error` and no part in the maximum. Where anything else could not be judged, the
maximum is 0: the reporter then tells Classroom no points, and earlier ones stay until it is run again.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Iterator, Sequence
from typing import Any

from grader.errors import GraderError
from grader.model.result import CriterionResult, GradingResult
from grader.model.verdict import FileCitation, Status
from grader.report import sentences
from grader.report.findings import repository_path
from grader.report.text import json_text, line, text_limit
from grader.report.view import hidden_ids, is_students_fault, not_graded, of_points, places, points_of
from grader.rubric.model import Rubric
from grader.wording import number

VERSION = 1
JSON_BYTES_MAX = 60_000
LIMITS = (600, 200, 80, 30, 0)
"""How long a text may be: the first with which all has room."""
NAME_CHARS = 200
FINE = 2**30
STATUSES = {Status.PASS: "pass", **{status: "error" for status in Status if status.is_open}}


def render_classroom(result: GradingResult, rubric: Rubric, *, passed: bool, prefix: str = "") -> str:
    """Return one line of base64, with its line end.

    `passed` is whether the pass mark is reached, `prefix` the package's folder in the repository.
    """
    text = ""
    for limit in LIMITS:
        # ASCII, so that a character is a byte
        text = json.dumps(_document(result, rubric, passed, prefix, limit), ensure_ascii=True)
        if len(text) <= JSON_BYTES_MAX:
            break
    return base64.b64encode(text.encode("ascii")).decode("ascii") + "\n"


def _document(result: GradingResult, rubric: Rubric, passed: bool, prefix: str, limit: int) -> dict[str, Any]:
    tests = [_refused_test(result, limit)] if not_graded(result) else [*_tests(result, rubric, prefix, limit)]
    scores = _adding_up([test.pop("points") for test in tests], 0.0 if not_graded(result) else result.points)
    tests = [{**test, "score": score} for test, score in zip(tests, scores, strict=True)]
    return {"version": VERSION, "status": _status(result, passed), "max_score": _max(result), "tests": tests}


def _status(result: GradingResult, passed: bool) -> str:
    if result.status == "error" or (result.status == "inconclusive" and not passed):
        return "error"
    return "pass" if passed else "fail"


def _max(result: GradingResult) -> float:
    if not_graded(result):
        return result.max_points if is_students_fault(result) else 0
    if any(c.status.is_retryable and c.counts for c in result.criteria):
        return 0
    return round(sum(c.max_points for c in result.criteria if not c.status.is_open), 3)


def _refused_test(result: GradingResult, limit: int) -> dict[str, Any]:
    said = (result.error.message, result.error.hint) if result.error else ("",)
    message = " ".join(line(text, max(limit, NAME_CHARS)) for text in said if text)
    return _test("it could not be graded", status="error", points=0.0, message=message)


def _tests(result: GradingResult, rubric: Rubric, prefix: str, limit: int) -> Iterator[dict[str, Any]]:
    reached = 0.0
    for criterion in result.criteria:
        reached += criterion.points
        yield _criterion(criterion, prefix, limit)
    late = round(result.points - reached, rubric.digits)
    if late:
        words = " ".join(line(text, NAME_CHARS) for text in sentences.score_words(result))
        yield _test(words or "what people decided, or being late", status="fail", points=late)


def _criterion(criterion: CriterionResult, prefix: str, limit: int) -> dict[str, Any]:
    cited = next((c for c in criterion.citations if isinstance(c, FileCitation) and c.line), None)
    where = repository_path(prefix, cited.file) if cited else ""
    waits = criterion.status.is_open
    return _test(
        line(f"{criterion.id}: {criterion.title}", NAME_CHARS),
        status=STATUSES.get(criterion.status, "fail"),
        points=criterion.points,
        message=_message(criterion, limit),
        test_code="" if waits else "\n".join(_test_code(criterion, limit)),
        filename=where,
        line_no=cited.line or 0 if cited and where else 0,
    )


def _message(criterion: CriterionResult, limit: int) -> str:
    """Return a message. The reporter prints it for errors alone, without the name."""
    words = line(criterion.message, limit) if limit else ""
    if not criterion.status.is_open:
        return words
    points = f"{number(criterion.missing)} points are not decided yet"
    return f"A PERSON MUST LOOK: {line(criterion.id, NAME_CHARS)}: {points}{': ' if words else ''}{words}"


def _test_code(criterion: CriterionResult, limit: int) -> Iterator[str]:
    """Yield what the reporter prints below a test that has not passed: what stands in the place of its code."""
    if criterion.status is Status.PASS or not limit:
        return
    points = f"{of_points(criterion)} points"
    rows = {
        f"{points}: ": criterion.message,
        "hint: ": criterion.hint,
        "see it yourself: ": criterion.reproduce,
    }
    yield from (f"{name}{line(text, limit)}" for name, text in rows.items() if text)


def _test(name: str, *, status: str, points: float, **more: object) -> dict[str, Any]:
    empty = {"message": "", "test_code": "", "filename": "", "line_no": 0, "execution_time": "0s"}
    return {"name": name, "status": status, "points": points, **empty, **more}


def _adding_up(scores: Sequence[float], total: float) -> list[float]:
    """Return the scores, or such as hardly differ, whose sum by floating point, one after the other, is `total` and not
    72.30000000000001."""
    if _sum(scores) == total or not any(scores):
        return list(scores)
    last = max(i for i, score in enumerate(scores) if score)
    before = [round(score * FINE) / FINE for score in scores[:last]]  # these are added without rounding
    return [*before, total - _sum(before), *scores[last + 1 :]]


def _sum(scores: Sequence[float]) -> float:
    """Return the sum as JavaScript adds; Python's own `sum` compensates."""
    total = 0.0
    for score in scores:
        total += score
    return total


LIMIT = 1000
HIDDEN = "after_published"
"""Hidden criteria are seen when the grades are published; until then Gradescope shows no total."""
LOOK = "A PERSON MUST LOOK"


def render_gradescope(result: GradingResult, rubric: Rubric) -> str:
    """Return JSON. Raises GraderError (exit code 3) where nothing could be judged: there must be no file then."""
    counting = [c for c in result.criteria if c.counts]
    if all(c.status.is_open for c in counting) and not is_students_fault(result):
        why = result.error.message if result.error else "no criterion could be judged"
        raise GraderError(
            f"no results.json is written, for nothing was graded: {why}",
            hint="Gradescope then says that the autograder has failed and gives no points: run it again there",
        )
    return json_text(_Writer(result, rubric).document())


def detail_rows(criterion: CriterionResult) -> dict[str, str]:
    """Return what platforms show of a criterion below its message, by the words before each."""
    return {
        "measured: ": criterion.measured,
        "expected: ": criterion.expected,
        "hint: ": criterion.hint,
        "see it yourself: ": criterion.reproduce,
    }


class _Writer:
    def __init__(self, result: GradingResult, rubric: Rubric) -> None:
        self._result, self._rubric = result, rubric
        self._hidden = hidden_ids(rubric)
        self._limit = text_limit(len(result.criteria), LIMIT)
        self._decided = {c.id: override for override, c in sentences.decided_criteria(result)}

    def document(self) -> dict[str, object]:
        """Return the file's data. Formats are said everywhere: Gradescope's own for the page would read HTML."""
        result = self._result
        return {
            "score": result.points,
            "execution_time": round(result.timing.wall_s, 3),
            "output": "\n".join(self._page()),
            "output_format": "text",
            "test_output_format": "text",
            "test_name_format": "text",
            "visibility": "visible",
            "stdout_visibility": "hidden",
            "tests": [self._test(str(i), c) for i, c in enumerate(result.criteria, start=1)],
        }

    def _page(self) -> Iterator[str]:
        """Yield what everybody sees at once: nothing in it tells of hidden criteria more than their number."""
        result = self._result
        shown = [c for c in result.criteria if c.id not in self._hidden]
        if result.error is not None and result.status == "error":
            yield f"NOT GRADED, {LOOK}: {self._text(result.error.message)}"
            yield self._text(result.error.hint)
            return
        waiting = [c for c in shown if c.status.is_open and c.counts]
        if any(c.status.is_open and c.counts for c in result.criteria):
            points = number(sum(c.missing for c in waiting))
            what = f": {points} points are not decided yet" if waiting else ""
            yield f"{LOOK}{what}; no points are lost for good."
        hidden = len(result.criteria) - len(shown) + sentences.missing_hidden(result, self._rubric)
        if hidden:
            yield self._text(
                sentences.visible_words(result.model_copy(update={"criteria": tuple(shown)}), hidden)
            )
        else:
            yield f"{number(result.points)} of {number(result.max_points)} points"
            yield from map(self._text, sentences.score_words(result))

    def _test(self, place: str, criterion: CriterionResult) -> dict[str, object]:
        waits = criterion.status.is_open
        name = f"{criterion.id}: {criterion.title}"
        return {
            # without a score Gradescope counts nothing for it; 0 would look like a judgement
            **({} if waits else {"score": criterion.points, "max_score": criterion.max_points}),
            "status": "passed" if criterion.status is Status.PASS else "failed",
            "name": self._text(f"{LOOK}: {name} ({number(criterion.missing)} points)" if waits else name),
            "name_format": "text",
            "number": place,
            "output": "\n".join(self._details(criterion)),
            "output_format": "text",
            "tags": [criterion.status.value],
            "visibility": HIDDEN if criterion.id in self._hidden else "visible",
        }

    def _details(self, criterion: CriterionResult) -> Iterator[str]:
        yield f"{sentences.STATES[criterion.status]}, {points_of(criterion)} points"
        override = self._decided.get(criterion.id)
        rows = {
            "": criterion.message,
            "decided ": sentences.decision(override) if override else "",
            "look again: ": sentences.look_again(override, criterion) if override else "",
            **detail_rows(criterion),
            "where: ": ", ".join(places(criterion)),
        }
        yield from (f"{name}{self._text(words)}" for name, words in rows.items() if words)

    def _text(self, text: str) -> str:
        return line(text, self._limit)
