"""`report.html`: what a student reads, in one file that loads nothing else.

`render_html` → `Maker` turns a result into records (`Page`, `Card`) → `templates/report.html` puts them into words.
"""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

from jinja2 import Template
from markupsafe import Markup

from grader.errors import blame
from grader.evidence.events import PACKAGE_RUN
from grader.model.figure import Figure, Figures
from grader.model.result import CriterionResult, GradingResult
from grader.model.verdict import FileCitation, Status
from grader.report import losses, sentences
from grader.report.html.figures import Drawer, Drawn, code_places
from grader.report.html.shell import environment, policy, prose, script, style
from grader.report.losses import Loss
from grader.report.text import line
from grader.report.view import (
    commands_in,
    file_places,
    headline,
    hidden_ids,
    hint_beside,
    not_graded,
    of_points,
    places,
    points_of,
    sentence,
    steps,
    where_to_type,
    without_place,
)
from grader.rubric.model import Rubric
from grader.wording import number


def render_html(
    result: GradingResult,
    rubric: Rubric,
    figures: Figures | None = None,
    *,
    hidden: int = 0,
    docs: Docs | None = None,
    changes: tuple[str, ...] = (),
) -> str:
    """Return the whole page, at most `BYTES_MAX` long. `hidden` is how many criteria are left out of `result`.

    `docs` has the sections of the checks' docstrings, `changes` what has changed since it was first published.
    """
    view = losses.arrange(result, rubric)
    head = {
        **_head(result, rubric, hidden, len(view.lost)),
        "view": view,
        "hidden": hidden,
        "changes": changes,
    }
    page = ""
    for detail in DETAILS:
        made = Maker(result, rubric, figures or Figures(), docs or {}, detail).page(view)
        page = _render(result, rubric, head, made, detail.text)
        if len(page.encode("utf-8", "backslashreplace")) <= BYTES_MAX:
            break
    return page


def load_template() -> Template:
    """Return the page's template; to compile it takes longer than to fill it in."""
    environment().get_template("card.html")  # which it uses
    return environment().get_template("report.html")


def _render(result: GradingResult, rubric: Rubric, head: Mapping[str, object], page: Page, limit: int) -> str:
    ours = script("report.js")
    return load_template().render(
        result=result,
        rubric=rubric,
        head=head,
        page=page,
        sections=list(_sections(result, page)),
        decided=sentences.decided_criteria(result),
        sentences=sentences,
        limit=limit,
        policy=Markup(policy(ours)),  # noqa: S704 - no text of anybody's
        script=ours,
        style=style(),
    )


def _head(result: GradingResult, rubric: Rubric, hidden: int, to_fix: int) -> dict[str, object]:
    """Return what stands at the top beside the `sentences`: `bar` has the parts of a bar in percent, and `again` is the
    command that judges it again."""
    graded, mark, error = not not_graded(result), rubric.pass_mark, result.error
    status, verdict = sentences.verdict(result, rubric, hidden, to_fix)
    points = f"{number(result.points)} of {sentences.count_points(result.max_points)}"
    whole, parts = result.max_points or 1.0, _parts(result)
    has_mark = mark is not None and not hidden and rubric.max_points
    return {
        "score": points if graded else "Not graded",
        "status": status,
        "verdict": verdict,
        "graded": graded,
        "bar": {kind: min(100.0, 100 * part / whole) for kind, part in parts.items()},
        "bar_words": ", ".join(f"{number(p)} {kind}" for kind, p in parts.items() if p or kind != "open"),
        "mark_at": 100 * (mark or 0.0) / rubric.max_points if has_mark else None,
        "fault": sentences.FAULTS[blame(error.kind)] if error else "",
        "again": "" if error else f"grader judge evidence --rubric {shlex.quote(result.rubric.id)}",
    }


def _parts(result: GradingResult) -> dict[str, float]:
    """Return the points that were reached, are open, and are lost (what being late cost among them)."""
    still = sum(c.max_points - c.points for c in result.criteria if c.status.is_open)
    lost = result.max_points - result.points - still
    return {"reached": result.points, "lost": max(lost, 0.0), "open": still}


def _sections(result: GradingResult, page: Page) -> Iterator[tuple[str, str]]:
    """Yield the ids of the page's parts, and what they are called in its list of parts."""
    if page.lost:
        yield "lost", f"To fix ({len(page.lost)})"
    if page.open:
        yield "open", f"Not decided yet ({len(page.open)})"
    if page.advice:
        yield "advice", "Advice"
    if result.notes:
        yield "noticed", "Noticed"
    if sentences.decided_criteria(result):
        yield "decided", sentences.decided_title(result)
    yield "all", "All criteria"
    if page.ran:
        yield "ran", "What ran"
    yield "about", "About"


T = TypeVar("T")
Docs = Mapping[str, Mapping[str, str]]
"""Of each check by name the sections of its docstring, by their headings."""
MATTERS, MEASURED, FIX = "Why it matters on a robot", "How it is measured", "How to fix"
NOTHING = Markup()


@dataclass(frozen=True, kw_only=True)
class Detail:
    """How much there may be on a page: characters in one `text` and in all of the `console`, `places` in a card,
    `cards`, and `rows` of the table."""

    text: int = 1000
    console: int = 120_000
    places: int = 20
    cards: int = 300
    rows: int = 1000
    figures: bool = True


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
class Card:
    """One criterion. `anchor` is its id on the page. `message` is what it says first and `rest` what else. `lost` says
    what it cost, with what it holds back; its hint has steps. `seen` is how to see it: texts, and which of them are
    commands. `code` are the lines that it cites, `figures` what was measured, the most
    telling first.
    `repaired` were judged with its fault repaired. `files` are those that have to be written."""

    anchor: str
    criterion: CriterionResult
    message: str
    rest: str
    hidden: bool
    points: str
    of: str
    lost: str = ""
    why: Markup = NOTHING
    how: Markup = NOTHING
    fix: Markup = NOTHING
    hint: Sequence[Markup] = ()
    seen: Sequence[tuple[str, bool]] = ()
    where: Sequence[str] = ()
    code: Sequence[Drawn] = ()
    figures: Sequence[Drawn] = ()
    blocked: Sequence[Card] = ()
    alike: Sequence[Card] = ()
    repaired: Sequence[Card] = ()
    files: Sequence[losses.MissingFile] = ()


@dataclass(frozen=True, kw_only=True)
class Ran:
    """One scenario: what happened when, who was joined with whom, and what was printed."""

    anchor: str
    name: str
    title: str
    timeline: Drawn | None
    graph: Drawn | None
    console: Drawn | None


@dataclass(frozen=True, kw_only=True)
class Page:
    """`lost`, `open` and `advice` are cards that stand for themselves. `others` are all other criteria, and `passed`
    those of them that were reached, folded.

    Criteria in `brief` have no card, only a line, and `beyond` not even that.
    """

    lost: Sequence[Card]
    open: Sequence[Card]
    advice: Sequence[Card]
    others: Sequence[Card]
    passed: Sequence[Card]
    brief: Sequence[Card]
    ran: Sequence[Ran]
    beyond: int = 0


class Maker:
    """Makes the page of one result. What is shown in several places is made once."""

    def __init__(
        self, result: GradingResult, rubric: Rubric, figures: Figures, docs: Docs, detail: Detail
    ) -> None:
        self._result, self._rubric, self._docs, self._detail = result, rubric, docs, detail
        self._figures = figures if detail.figures else Figures()
        self._drawer = Drawer(console_chars=detail.console)
        self._hidden = hidden_ids(rubric)
        self._by_id = {c.id: c for c in result.criteria}
        self._repaired = sentences.judged_repaired(result)
        self._anchors = {c.id: f"criterion-{i}" for i, c in enumerate(result.criteria, start=1)}
        self._room = detail.cards

    def page(self, view: losses.ReportView) -> Page:
        whole = not not_graded(self._result)
        # in this order: all share one room for cards, and what was lost is read first
        lost = [self._loss(loss) for loss in self._first(view.lost if whole else ())]
        still = [self._loss(loss) for loss in self._first(view.open if whole else ())]
        advice = [self._card(criterion) for criterion in self._first(view.advice)]
        shown = {card.criterion.id for card in (*lost, *still, *advice)}
        others = [c for c in self._result.criteria if c.id not in shown]
        rest = [self._card(criterion) for criterion in self._first(others if whole else ())]
        room = max(0, self._detail.rows - len(shown) - len(rest))
        cut = others[len(rest) :]
        return Page(
            lost=lost,
            open=still,
            advice=advice,
            others=[card for card in rest if card.criterion.status is not Status.PASS],
            passed=[card for card in rest if card.criterion.status is Status.PASS],
            brief=[self._short(c, linked=False) for c in cut[:room]],
            ran=list(self._ran()),
            beyond=len(cut[room:]),
        )

    def _first(self, items: Sequence[T]) -> Sequence[T]:
        kept = items[: self._room]
        self._room -= len(kept)
        return kept

    def _loss(self, loss: Loss) -> Card:
        told = {c.id for c in loss.alike}
        repaired = [self._by_id[i] for i in self._repaired.get(loss.criterion.id, ()) if i not in told]
        files = losses.missing_files(loss)
        card = replace(
            self._card(loss.criterion, self._with_graph(loss.criterion)),
            lost=sentences.lost_words(loss),
            blocked=[self._short(c) for c in loss.blocked],
            alike=[] if files else [self._short(c) for c in loss.alike],
            repaired=[self._short(c) for c in repaired],
            files=files,
        )
        if len(files) < 2:
            return card
        together = [file.criterion for file in files]
        return replace(
            card,
            message=f"{len({file.path for file in files})} files are not in the package",
            rest="",
            hint=[self._prose(sentence(losses.write_files_hint(files)))],
            of=f"{number(sum(c.points for c in together))} of {number(sum(c.max_points for c in together))}",
        )

    def _with_graph(self, criterion: CriterionResult) -> list[Figure]:
        """Return its figures; what was lost in a run, and has no plot, shows who was joined with whom in it."""
        figures = list(self._figures.by_criterion.get(criterion.id, ()))
        graph = self._figures.graphs.get(criterion.scenario or "")
        if graph and graph.nodes and all(figure.kind == "code" for figure in figures):
            figures.append(graph)
        return figures

    def _card(self, criterion: CriterionResult, figures: Sequence[Figure] | None = None) -> Card:
        own = self._figures.by_criterion.get(criterion.id, ()) if figures is None else figures
        docs = self._docs.get(criterion.check, {})
        drawn = [self._drawer.draw(figure) for figure in own]
        code = [figure for figure in drawn if figure.kind == "code"]
        place = next(iter(file_places(criterion)), "") if code else ""
        message, rest = headline(without_place(criterion.message, place))
        return replace(
            self._short(criterion),
            message=sentence(message),
            rest=sentence(rest),
            why=self._prose(docs.get(MATTERS, "")),
            how=self._prose(docs.get(MEASURED, "")),
            fix=self._prose(docs.get(FIX, "")) if sentences.is_own_fault(criterion) else NOTHING,
            hint=[
                self._prose(sentence(step)) for step in steps(hint_beside(criterion, place)) if criterion.hint
            ],
            seen=self._seen(criterion),
            where=self._where(criterion),
            code=code,
            figures=[figure for figure in drawn if figure.kind != "code"],
        )

    def _short(self, criterion: CriterionResult, *, linked: bool = True) -> Card:
        return Card(
            anchor=self._anchors[criterion.id] if linked else "",
            criterion=criterion,
            message=criterion.message,
            rest="",
            hidden=criterion.id in self._hidden,
            points=points_of(criterion),
            of=of_points(criterion),
        )

    def _seen(self, criterion: CriterionResult) -> tuple[tuple[str, bool], ...]:
        """Return how to see it, and where; nothing of a missing file, of which a command only says the same."""
        if losses.missing_file(criterion):
            return ()
        where = where_to_type(criterion.reproduce)
        return (*([(where, False)] if where else []), *commands_in(criterion.reproduce))

    def _where(self, criterion: CriterionResult) -> list[str]:
        """Return the places that no code beside them shows."""
        shown = code_places(self._figures.by_criterion.get(criterion.id, ()))
        cited = criterion.citations
        return [
            place
            for place, citation in zip(places(criterion)[: self._detail.places], cited, strict=False)
            if not (isinstance(citation, FileCitation) and (citation.file, citation.line) in shown)
        ]

    def _prose(self, text: str) -> Markup:
        return prose(line(text.replace("\n\n", " "), self._detail.text))

    def _ran(self) -> Iterator[Ran]:
        titles = {name: scenario.title for name, scenario in self._rubric.scenarios.items()}
        names = dict.fromkeys([PACKAGE_RUN, *titles, *self._figures.graphs, *self._figures.consoles])
        used = {c.scenario for c in self._result.criteria} | {PACKAGE_RUN}
        # a scenario that hidden criteria alone are about stays hidden, too
        for i, name in enumerate((n for n in names if n in used or n not in titles), start=1):
            graph, console = self._figures.graphs.get(name), self._figures.consoles.get(name)
            graph = graph if graph and graph.nodes else None
            console = console if console and console.lines else None
            when = self._figures.timelines.get(name)
            if graph or console or when:
                yield Ran(
                    anchor=f"run-{i}",
                    name=name,
                    title="The build" if name == PACKAGE_RUN else titles.get(name, name),
                    timeline=self._drawer.draw(when) if when else None,
                    graph=self._drawer.draw(graph) if graph else None,
                    console=self._drawer.draw(console) if console else None,
                )
