"""`report.html`: what a student reads. One file that asks nobody for anything."""

from __future__ import annotations

import shlex
from collections.abc import Iterator
from dataclasses import dataclass

from markupsafe import Markup

from grader.model.figure import Figures
from grader.model.result import GradingResult
from grader.report import noticed, settled
from grader.report.html import words
from grader.report.html.page import Detail, Docs, Maker, Page
from grader.report.html.shell import environment, policy, script, style
from grader.report.summary import visible_words
from grader.report.unwalled import without_sandbox
from grader.report.view import ReportView, arrange, not_graded
from grader.rubric.model import Rubric
from grader.wording import number

BYTES_MAX = 400_000
DETAILS = (
    Detail(),
    Detail(text=600, console=40_000),
    Detail(text=300, console=10_000, places=5, cards=80),
    Detail(text=200, console=0, places=3, cards=40, figures=False),
    Detail(text=60, console=0, places=1, cards=15, rows=250, figures=False),
)
"""From all that there is to what fits when a submission does its best to fill the page."""


@dataclass(frozen=True, kw_only=True)
class Part:
    """A part of the bar, in percent."""

    kind: str
    share: float


@dataclass(frozen=True, kw_only=True)
class Head:
    """What stands at the top, in words. `again` is the command that judges it again."""

    score: str
    status: str
    verdict: str
    graded: bool
    bar: tuple[Part, ...]
    bar_words: str
    mark_at: float | None
    pass_mark: str
    unwalled: str
    late: tuple[str, ...]
    short: str
    left_out: str
    fault: str
    again: str


def html_report(
    result: GradingResult, rubric: Rubric, figures: Figures, *, hidden: int = 0, docs: Docs | None = None
) -> str:
    """The whole page, at most `BYTES_MAX` long. `hidden` is how many criteria are left out of `result`.

    `docs` has the sections of the checks' docstrings.
    """
    view = arrange(result, rubric)
    head = _head(result, rubric, view, hidden)
    page = ""
    for detail in DETAILS:
        made = Maker(result, rubric, figures, docs or {}, detail).page(view)
        page = _rendered(result, rubric, head, made, detail.text)
        if len(page.encode("utf-8", "backslashreplace")) <= BYTES_MAX:
            break
    return page


def _rendered(result: GradingResult, rubric: Rubric, head: Head, page: Page, limit: int) -> str:
    ours = script("report.js")
    return (
        environment()
        .get_template("report.html")
        .render(
            result=result,
            rubric=rubric,
            head=head,
            page=page,
            sections=list(_sections(result, page)),
            decided=settled.decided(result),
            noticed=noticed,
            settled=settled,
            limit=limit,
            policy=Markup(policy(ours)),  # noqa: S704 - no text of anybody's
            script=ours,
            style=style(),
        )
    )


def _head(result: GradingResult, rubric: Rubric, view: ReportView, hidden: int) -> Head:
    graded = not not_graded(result)
    status, verdict = words.verdict(result, rubric, hidden)
    score = f"{number(result.points)} of {words.points(result.max_points)}" if graded else "Not graded"
    mark = rubric.pass_mark
    return Head(
        score=score,
        status=status,
        verdict=verdict,
        graded=graded,
        bar=_bar(result),
        bar_words=_bar_words(result),
        mark_at=100 * mark / rubric.max_points
        if mark is not None and not hidden and rubric.max_points
        else None,
        pass_mark=words.pass_mark(result, rubric, hidden),
        unwalled=without_sandbox(result.environment.sandbox),
        late=settled.late_words(result),
        short=words.in_short(result, view),
        left_out=visible_words(result, hidden) if graded else "",
        fault=words.FAULTS[words.blame(result.error.kind)] if result.error else "",
        again=f"grader judge evidence --rubric {shlex.quote(result.rubric.id)}"
        if result.error is None
        else "",
    )


def _parts(result: GradingResult) -> dict[str, float]:
    """Points that were reached, are open, and are lost (what being late cost among them)."""
    still = sum(c.max_points - c.points for c in result.criteria if c.status.is_open)
    lost = result.max_points - result.points - still
    return {"reached": result.points, "lost": max(lost, 0.0), "open": still}


def _bar(result: GradingResult) -> tuple[Part, ...]:
    whole = result.max_points or 1.0
    return tuple(Part(kind=kind, share=100 * part / whole) for kind, part in _parts(result).items())


def _bar_words(result: GradingResult) -> str:
    return ", ".join(
        f"{number(part)} {kind}" for kind, part in _parts(result).items() if part or kind != "open"
    )


def _sections(result: GradingResult, page: Page) -> Iterator[tuple[str, str]]:
    """The ids of the page's parts, and what they are called in its list of parts."""
    if page.lost:
        yield "lost", f"What you lost ({len(page.lost)})"
    if page.open:
        yield "open", f"Still open ({len(page.open)})"
    if page.advice:
        yield "advice", "Advice"
    if result.notes:
        yield "noticed", "Noticed"
    if settled.decided(result):
        yield "decided", "Decided by a person"
    yield "all", "All criteria"
    if page.ran:
        yield "ran", "What ran"
    yield "about", "About this report"
