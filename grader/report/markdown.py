"""`report.md`: points and losses in a line each, details folded. For a file, a comment or the summary of a CI step."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

from grader.model.figure import Figures, GraphFigure
from grader.model.result import CriterionResult, GradingResult, Note
from grader.model.verdict import Status
from grader.report import sentences
from grader.report.losses import Loss, MissingFile, arrange, missing_file, missing_files, write_files_hint
from grader.report.text import line, markdown, markdown_block, markdown_code
from grader.report.view import commands_in, not_graded, places, pointed_at, points_of, where_to_type
from grader.rubric.model import Rubric
from grader.wording import join_words, number

BYTES_MAX = 60_000
"""A comment on GitHub has 65,536 characters, a step's summary 1 MiB."""
GRAPHS_MAX = 3
SHORT_CHARS = 500
T = TypeVar("T")


@dataclass(frozen=True, kw_only=True)
class Detail:
    """How long a text may be, how many entries a list has, and what is there at all."""

    text: int
    entries: int = 300
    graphs: bool = True
    folded: bool = True


DETAILS = (
    Detail(text=1000),
    Detail(text=400),
    Detail(text=200),
    Detail(text=100, entries=150),
    Detail(text=100, entries=150, graphs=False),
    Detail(text=100, graphs=False, entries=60, folded=False),
    Detail(text=60, graphs=False, entries=15, folded=False),
)


def render_markdown(
    result: GradingResult,
    rubric: Rubric,
    *,
    hidden: int = 0,
    figures: Figures | None = None,
    changes: tuple[str, ...] = (),
) -> str:
    """Return the report as GitHub's and GitLab's Markdown, at most 60 kB. `hidden` is how many criteria are left out of
    it, `changes` what has changed since it was first published.

    Of a result with very long texts, less is said of each, and in the end the details are left out.
    """
    used = {criterion.scenario for criterion in result.criteria}
    graphs = {
        name: graph
        for name, graph in (figures.graphs if figures else {}).items()
        if name in used or name not in rubric.scenarios  # what hidden criteria are about stays hidden
    }
    text = ""
    for detail in DETAILS:
        if _surely_too_long(result, detail):
            continue
        text = _Writer(detail).report(result, rubric, hidden, graphs, changes)
        if len(text.encode()) <= BYTES_MAX:
            break
    return text


def _why_lost(loss: Loss) -> str:
    """Return why, in a sentence; of several files that are not there, all of them."""
    paths = list(dict.fromkeys(file.path for file in missing_files(loss)))
    if len(paths) > 1:
        return f"{len(paths)} files are not in the package: {join_words(paths)}"
    return loss.criterion.message or loss.criterion.title


def _surely_too_long(result: GradingResult, detail: Detail) -> bool:
    """Return whether what is told of the losses alone has no room: then nothing needs to be made to see that."""
    lost = (c for c in result.criteria if c.status in {Status.FAIL, Status.PARTIAL})
    texts = (text for c in lost for text in (c.measured, c.expected, c.hint))
    return detail.folded and sum(min(len(text), detail.text) for text in texts) > BYTES_MAX


class _Writer:
    """Whatever is not the template's own goes through `_text` or `_code`. HTML has nothing but our own words."""

    def __init__(self, detail: Detail) -> None:
        self._detail = detail

    def report(
        self,
        result: GradingResult,
        rubric: Rubric,
        hidden: int,
        graphs: dict[str, GraphFigure],
        changes: tuple[str, ...] = (),
    ) -> str:
        view = arrange(result, rubric)
        lost, still = ((), ()) if not_graded(result) else (view.lost, view.open)
        lines = [*self._head(result, rubric, hidden), *self._changes(changes), *self._decisions(result)]
        lines += self._list_losses("To fix", lost)
        lines += self._list_losses("Not decided yet", still)
        if self._detail.folded:
            told = [row for loss in (*lost, *still) for row in self._loss_section(loss)]
            lines += self._fold("Details, and how to fix it", told)
            lines += self._fold(
                _title_with_count("Advice (costs nothing)", view.advice), self._advice(view.advice)
            )
            lines += self._fold(
                _title_with_count(sentences.NOTICED_TITLE, result.notes), self._note_lines(result.notes)
            )
            lines += self._fold("Nodes and topics", self._graphs(graphs) if self._detail.graphs else ())
            lines += self._fold(
                _title_with_count("All criteria", result.criteria), self._table(result.criteria)
            )
        else:
            lines += ["The details are too long for this form: they are in the other reports.", ""]
        lines += self._foot(result)
        return "\n".join(lines) + "\n"

    def _head(self, result: GradingResult, rubric: Rubric, hidden: int) -> Iterator[str]:
        submission = result.submission
        graded = f"{number(result.points)} of {number(result.max_points)} points"
        yield from (f"# {'Not graded' if not_graded(result) else graded}", "")
        unwalled = sentences.without_sandbox(result.environment.sandbox)
        for warning in filter(None, (unwalled, sentences.students_rubric(result))):
            yield from (f"**{self._text(warning)}**", "")
        for words in sentences.score_words(result):
            yield from (self._text(words), "")
        if result.error is not None:
            yield from ([] if not_graded(result) else ["It could not be graded automatically:", ""])
            yield from (self._text(result.error.message), "", self._text(result.error.hint), "")
        if result.status == "inconclusive":
            yield from (f"**Not decided yet:** {sentences.NOT_SETTLED}", "")
        for words in (
            sentences.verdict_words(result, rubric, hidden),
            sentences.visible_words(result, hidden),
        ):
            yield from (words, "") if words else ()
        version = self._text(result.rubric.version)
        yield from (f"{self._text(rubric.title)} ({self._code(result.rubric.id)}, version {version})", "")
        commit = f", commit {self._code(submission.commit[:12])}" if submission.commit else ""
        kind = f", package {self._code(submission.package)}" if submission.package else ", a recording"
        yield f"Submission {self._code(submission.id)}{kind if result.error is None else ''}{commit}."
        yield ""

    def _changes(self, changes: tuple[str, ...]) -> Iterator[str]:
        if changes:
            yield from (f"## {sentences.CHANGED_TITLE}", "")
            yield from (f"- {self._text(change)}" for change in self._first(changes))
            yield from (*self._more(changes), "")

    def _decisions(self, result: GradingResult) -> Iterator[str]:
        found = sentences.decided_criteria(result)
        if not found:
            return
        yield from (f"## {sentences.decided_title(result)}", "")
        for override, criterion in self._first(found):
            yield f"- {self._code(criterion.id)}: {points_of(criterion)} {self._text(sentences.decision(override))}"
            automatic = sentences.automatic_words(override, criterion)
            yield from [f"  - The check says: {self._text(automatic)}"] if automatic else []
            again = sentences.look_again(override, criterion)
            yield from [f"  - **{self._text(again)}**"] if again else []
        yield from self._more(found)
        yield ""

    def _list_losses(self, title: str, losses: tuple[Loss, ...]) -> Iterator[str]:
        """Yield a line each: what it is, what it cost, why."""
        if not losses:
            return
        yield from (f"## {title}", "")
        for loss in self._first(losses):
            c = loss.criterion
            others = sum(other.missing for other in (*loss.blocked, *loss.alike))
            more = f", and {number(others)} more points with it" if others else ""
            words = markdown(line(_why_lost(loss), min(SHORT_CHARS, self._detail.text)))
            yield f"- {self._code(c.id)}: {points_of(c)}{more}, {sentences.STATES[c.status]}: {words}"
        yield from self._more(losses)
        yield ""

    def _loss_section(self, loss: Loss) -> Iterator[str]:
        criterion = loss.criterion
        yield from (
            f"### {self._code(criterion.id)}: {points_of(criterion)}, {sentences.STATES[criterion.status]}",
            "",
        )
        files = missing_files(loss)
        details = [*(self._files(files) if len(files) > 1 else self._details(criterion))]
        details += self._blocked_lines(loss if len(files) < 2 else replace(loss, alike=()))
        yield from (*(details or [self._text(criterion.title)]), "")
        for pair in pointed_at(criterion):
            yield from (markdown_block(pair), "")

    def _details(self, criterion: CriterionResult) -> Iterator[str]:
        rows = {"Measured": criterion.measured, "Expected": criterion.expected, "Hint": criterion.hint}
        yield from (f"- {name}: {self._text(value)}" for name, value in rows.items() if value)
        if criterion.reproduce and not missing_file(criterion):
            where = where_to_type(criterion.reproduce)
            shown = (
                self._code(text) if is_command else self._text(text)
                for text, is_command in commands_in(criterion.reproduce)
            )
            yield f"- See it yourself: {' '.join([*([where] if where else []), *shown])}"
        if criterion.citations:
            yield f"- Where: {', '.join(self._code(cited) for cited in places(criterion))}"

    def _files(self, files: Sequence[MissingFile]) -> Iterator[str]:
        """Yield several files that are not there, each with what it costs and what has to be in it."""
        for one in files:
            words = "; ".join(filter(None, [one.holds, one.says]))
            cost = f"{self._code(one.criterion.id)} {points_of(one.criterion)}"
            yield f"- {self._code(one.path)} ({cost}): {self._text(words)}"
        yield f"- Hint: {self._text(write_files_hint(files))}"

    def _blocked_lines(self, loss: Loss) -> Iterator[str]:
        if loss.alike:
            yield f"- The same holds for: {self._names(loss.alike)}"
        if loss.blocked:
            yield f"- Not tested because of it: {self._names(loss.blocked)}"

    def _names(self, criteria: tuple[CriterionResult, ...]) -> str:
        return ", ".join(f"{self._code(c.id)} ({points_of(c)})" for c in criteria)

    def _advice(self, criteria: tuple[CriterionResult, ...]) -> Iterator[str]:
        for criterion in self._first(criteria):
            hint = f"; {self._text(criterion.hint)}" if criterion.hint else ""
            yield f"- {self._code(criterion.id)}: {self._text(criterion.message)}{hint}"
        yield from self._more(criteria)
        yield from [""] if criteria else []

    def _note_lines(self, notes: tuple[Note, ...]) -> Iterator[str]:
        if not notes:
            return
        yield from (sentences.COSTS_NOTHING, "")
        for note in self._first(notes):
            yield f"- {self._code(sentences.note_place(note))}: {self._text(sentences.note_text(note))}"
        yield from self._more(notes)
        yield ""

    def _graphs(self, graphs: dict[str, GraphFigure]) -> Iterator[str]:
        """Yield the pictures; runs in which the same was seen share one."""
        seen: dict[str, list[str]] = {}
        for name, graph in graphs.items():
            if graph.nodes or graph.topics:
                seen.setdefault(mermaid(graph), []).append(name)
        for drawn, names in list(seen.items())[:GRAPHS_MAX]:
            yield from (f"In {', '.join(self._code(name) for name in names)}:", "")
            yield from ("```mermaid", drawn, "```", "")

    def _table(self, criteria: tuple[CriterionResult, ...]) -> Iterator[str]:
        yield "| points | status | criterion | | measured |"
        yield "|---:|---|---|---|---|"
        for c in self._first(criteria):
            cells = [
                points_of(c),
                sentences.STATES[c.status],
                self._code(c.id, cell=True),
                self._text(c.title, cell=True),
                self._text(c.measured, cell=True),
            ]
            yield f"| {' | '.join(cells)} |"
        yield ""
        yield from (*self._more(criteria), "")

    def _foot(self, result: GradingResult) -> Iterator[str]:
        used = result.environment
        kind, digest = "package" if result.submission.package else "recording", result.submission.digest[:12]
        yield (
            f"Graded by grader {self._text(used.grader)} with ROS {self._text(used.ros or 'not used')}, "
            f"Python {self._text(used.python)}, sandbox {self._text(used.sandbox)}, "
            f"in {result.timing.wall_s:.1f} s. Rubric digest {self._code(result.rubric.digest[:12])}"
            f"{f' ({origin})' if (origin := sentences.RUBRIC_FROM[result.rubric_origin]) else ''}"
            f"{f', {kind} digest {self._code(digest)}' if digest else ''}."
        )

    def _fold(self, title: str, rows: Iterable[str]) -> Iterator[str]:
        """Yield what is shown when someone opens it. The empty lines make Markdown of what is inside."""
        inside = list(rows)
        if inside:
            yield from ("<details>", f"<summary>{title}</summary>", "", *inside, "</details>", "")

    def _first(self, items: Sequence[T]) -> Sequence[T]:
        return items[: self._detail.entries]

    def _more(self, items: Sequence[object]) -> Iterator[str]:
        left = len(items) - self._detail.entries
        if left > 0:
            yield from ("", f"And {left} more.")

    def _text(self, text: str, *, cell: bool = False) -> str:
        return markdown(line(text, self._detail.text), cell=cell)

    def _code(self, text: str, *, cell: bool = False) -> str:
        return markdown_code(line(text, self._detail.text), cell=cell)


def _title_with_count(title: str, items: Sequence[object]) -> str:
    return f"{title} ({len(items)})"


NAME_CHARS = 60
PARTS_MAX, EDGES_MAX = 40, 80
# What has a meaning to mermaid nowhere inside of quotes. An underscore or a dot within a word is none for its Markdown.
_PLAIN = re.compile(r"[A-Za-z0-9/ ]|(?<=[A-Za-z0-9])[_-](?=[A-Za-z0-9])")


def mermaid(graph: GraphFigure) -> str:
    """Return the diagram's text: round nodes, square topics, arrows from publisher to subscriber.

    Names are written in the characters' numbers wherever they are more than letters: none of them leaves its quotes.
    """
    return "\n".join(["flowchart LR", *(f"    {row}" for row in _rows(graph))])


def _rows(graph: GraphFigure) -> Iterator[str]:
    nodes = {name: f"n{i}" for i, name in enumerate(graph.nodes[:PARTS_MAX])}
    topics = {name: f"t{i}" for i, name in enumerate(graph.topics[:PARTS_MAX])}
    yield from (f'{key}(["{_label(name)}"])' for name, key in nodes.items())
    yield from (f'{key}["{_label(name)}"]' for name, key in topics.items())
    edges = [edge for edge in graph.edges if edge.node in nodes and edge.topic in topics]
    for edge in edges[:EDGES_MAX]:
        ends = nodes[edge.node], topics[edge.topic]
        yield " --> ".join(ends if edge.publishes else reversed(ends))
    left = graph.left_out + len(graph.nodes) - len(nodes) + len(graph.topics) - len(topics)
    if left:
        yield f'more["and {left} more"]'


def _label(name: str) -> str:
    shown = line(name, NAME_CHARS) or "?"
    plain = {match.start() for match in _PLAIN.finditer(shown)}
    # mermaid's way to write any character
    return "".join(c if i in plain else f"#{ord(c)};" for i, c in enumerate(shown))
