"""`report.md`: points first, then what was lost, then everything."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from grader.model.result import CriterionResult, GradingResult
from grader.report.text import clip, markdown, markdown_code, number
from grader.report.view import Loss, arrange, places, points_of
from grader.rubric.model import Rubric

LIMIT = 1000


def markdown_report(result: GradingResult, rubric: Rubric, *, hidden: int = 0) -> str:
    """The report as GitHub-flavoured Markdown. `hidden` is how many criteria are left out of it."""
    view = arrange(result, rubric)
    lines = [*_head(result, rubric, hidden)]
    if result.error is not None:
        lines += ["## Not graded", "", _text(result.error.message), "", _text(result.error.hint), ""]
    lines += _losses("What was lost", view.lost)
    lines += _losses("What is still open", view.open)
    lines += _advice(view.advice)
    lines += _table(result.criteria)
    lines += _foot(result)
    return "\n".join(lines) + "\n"


def _head(result: GradingResult, rubric: Rubric, hidden: int) -> Iterator[str]:
    submission = result.submission
    yield f"# {number(result.points)} of {number(result.max_points)} points"
    yield ""
    yield f"{_text(rubric.title)} ({_code(result.rubric.id)}, version {_text(result.rubric.version)})"
    yield ""
    commit = f", commit {_code(submission.commit[:12])}" if submission.commit else ""
    kind = f"package {_code(submission.package)}" if submission.package else "a recording"
    yield f"Submission {_code(submission.id)}, {kind}{commit}."
    yield ""
    if result.status == "inconclusive":
        yield "**Not settled yet:** some criteria could not be judged; no points are lost for good."
        yield ""
    if hidden:
        yield f"{hidden} hidden {'criterion is' if hidden == 1 else 'criteria are'} not part of this report."
        yield ""


def _losses(title: str, losses: tuple[Loss, ...]) -> Iterator[str]:
    if not losses:
        return
    yield f"## {title}"
    yield ""
    for loss in losses:
        criterion = loss.criterion
        yield f"### {_code(criterion.id)}: {points_of(criterion)}, {criterion.status.value}"
        yield ""
        yield _text(criterion.message) or _text(criterion.title)
        yield ""
        details = [*_details(criterion), *_blocked(loss)]
        yield from ([*details, ""] if details else [])


def _details(criterion: CriterionResult) -> Iterator[str]:
    rows = {"Measured": criterion.measured, "Expected": criterion.expected, "Hint": criterion.hint}
    yield from (f"- {name}: {_text(value)}" for name, value in rows.items() if value)
    if criterion.reproduce:
        yield f"- See it yourself: {_code(criterion.reproduce)}"
    if criterion.citations:
        yield f"- Where: {', '.join(_code(place) for place in places(criterion))}"


def _blocked(loss: Loss) -> Iterator[str]:
    if loss.alike:
        yield f"- The same holds for: {', '.join(f'{_code(c.id)} ({points_of(c)})' for c in loss.alike)}"
    if loss.blocked:
        names = ", ".join(f"{_code(c.id)} ({points_of(c)})" for c in loss.blocked)
        yield f"- Could not be judged because of this: {names}"


def _advice(criteria: tuple[CriterionResult, ...]) -> Iterator[str]:
    if not criteria:
        return
    yield "## Advice, costs nothing"
    yield ""
    for criterion in criteria:
        hint = f" {_text(criterion.hint)}" if criterion.hint else ""
        yield f"- {_code(criterion.id)}: {_text(criterion.message)}{hint}"
    yield ""


def _table(criteria: Iterable[CriterionResult]) -> Iterator[str]:
    yield "## All criteria"
    yield ""
    yield "| points | status | criterion | | measured |"
    yield "|---:|---|---|---|---|"
    for c in criteria:
        cells = [
            points_of(c),
            c.status.value,
            _code(c.id, cell=True),
            _text(c.title, cell=True),
            _text(c.measured, cell=True),
        ]
        yield f"| {' | '.join(cells)} |"
    yield ""


def _foot(result: GradingResult) -> Iterator[str]:
    environment = result.environment
    yield (
        f"Graded by grader {_text(environment.grader)} with ROS {_text(environment.ros or 'not used')}, "
        f"Python {_text(environment.python)}, sandbox {_text(environment.sandbox)}, "
        f"in {result.timing.wall_s:.1f} s. Rubric digest {_code(result.rubric.digest[:12])}, "
        f"{'package' if result.submission.package else 'recording'} digest {_code(result.submission.digest[:12])}."
    )


def _text(text: str, *, cell: bool = False) -> str:
    return markdown(clip(text, LIMIT), cell=cell)


def _code(text: str, *, cell: bool = False) -> str:
    return markdown_code(clip(text, LIMIT), cell=cell)
