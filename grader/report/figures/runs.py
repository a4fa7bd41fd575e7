"""What a run shows whatever was checked: nodes and topics, the console, and the lines of code that a verdict cites."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

from grader.checks.support.text import SHOWN_BEFORE_CHARS, bare
from grader.checks.support.topics import SYSTEM_TOPICS
from grader.evidence.events import GraphEvent
from grader.evidence.run import Run
from grader.model.figure import CodeFigure, ConsoleFigure, ConsoleLine, Edge, GraphFigure
from grader.model.verdict import Citation, FileCitation
from grader.report.figures.bounds import LINE_LETTERS, is_drawn, named, second, short, spread

NODES_MAX = 40
TOPICS_MAX = 40
EDGES_MAX = 200
STATES_MAX = 400
UNKNOWN = {"", "*"}


class _Edge(NamedTuple):
    node: str
    topic: str
    publishes: bool


def graph_of(run: Run) -> GraphFigure | None:
    """None where no node was there."""
    states = _states(run)
    edges = list(dict.fromkeys(_edges(run, states)))
    nodes = list(dict.fromkeys(_nodes(states, edges)))
    shown = set(nodes[:NODES_MAX])
    topics = list(dict.fromkeys([*(e.topic for e in edges if e.node in shown), *(e.topic for e in edges)]))
    drawn = set(topics[:TOPICS_MAX])
    if not nodes:
        return None
    types = _types(run, states)
    kept = [e for e in edges if e.node in shown and e.topic in drawn][:EDGES_MAX]
    return GraphFigure(
        scenario=named(run.scenario),
        nodes=tuple(map(named, nodes[:NODES_MAX])),
        topics=tuple(map(named, topics[:TOPICS_MAX])),
        types={named(t): named(types[t]) for t in topics[:TOPICS_MAX] if t in types},
        edges=tuple(Edge(node=named(e.node), topic=named(e.topic), publishes=e.publishes) for e in kept),
        left_out=len(nodes) - len(shown) + len(topics) - len(drawn),
    )


def _states(run: Run) -> list[GraphEvent]:
    """All of the master's states, or some and the last of very many."""
    events = [event for _, event in run.graph]
    if len(events) <= STATES_MAX:
        return events
    return [*(events[i] for i in spread(range(len(events)), STATES_MAX - 1)), events[-1]]


def _edges(run: Run, states: Sequence[GraphEvent]) -> Iterator[_Edge]:
    """In the order of their appearance; another tool's recording knows of publishers alone."""
    for state in states:
        for publishes, ends in ((True, state.publishers), (False, state.subscribers)):
            for topic, nodes in ends.items():
                yield from (_Edge(node, topic, publishes) for node in nodes if _is_drawn(node, topic))
    yield from (_Edge(c.callerid, c.topic, True) for c in run.channels if _is_drawn(c.callerid, c.topic))


def _is_drawn(node: str, topic: str) -> bool:
    return topic not in SYSTEM_TOPICS and is_drawn(topic) and is_drawn(node)


def _nodes(states: Sequence[GraphEvent], edges: Sequence[_Edge]) -> Iterator[str]:
    for state in states:
        yield from filter(is_drawn, state.nodes)
    yield from (edge.node for edge in edges)


def _types(run: Run, states: Sequence[GraphEvent]) -> dict[str, str]:
    found = {c.topic: c.type for c in run.channels}
    for state in states:
        found |= {topic: kind for topic, kind in state.topic_types.items() if kind not in UNKNOWN}
    return {topic: kind for topic, kind in found.items() if kind not in UNKNOWN}


FIRST_LINES = LAST_LINES = 100
LETTERS_MAX = 24_000
"""Of all lines together; where they have more, each is cut shorter."""


def console_of(run: Run) -> ConsoleFigure | None:
    """None where nothing was printed. Colours are left out."""
    own = {event.name for _, event in run.processes if event.role == "grader"}
    printed = [(time_ns, line) for time_ns, line in run.console if line.process not in own]
    if not printed:
        return None
    many = len(printed) > FIRST_LINES + LAST_LINES
    kept = [*printed[:FIRST_LINES], *printed[-LAST_LINES:]] if many else printed
    texts = [bare(line.line[:SHOWN_BEFORE_CHARS]) for _, line in kept]
    large = sum(min(len(text), LINE_LETTERS) for text in texts) > LETTERS_MAX
    letters = LETTERS_MAX // len(texts) if large else LINE_LETTERS
    lines = tuple(
        ConsoleLine(
            at_s=second(run, time_ns),
            process=named(line.process),
            stream=line.stream,
            text=short(text, letters),
        )
        for (time_ns, line), text in zip(kept, texts, strict=True)
    )
    return ConsoleFigure(scenario=named(run.scenario), lines=lines, left_out=len(printed) - len(kept))


AROUND = 3
APART_MAX = 4
"""So many lines between two places are shown too, rather than left out."""
LINES_MAX = 60
FIGURES_MAX = 6


def code_figures(build: Run, citations: Sequence[Citation]) -> Iterator[CodeFigure]:
    """A figure for each place of each file that was kept; places near each other are one."""
    cited = [c for c in citations if isinstance(c, FileCitation) and c.line is not None]
    left = FIGURES_MAX
    for file in dict.fromkeys(c.file for c in cited):
        lines = build.file_lines(file)
        marks = sorted({c.line or 0 for c in cited if c.file == file and 0 < (c.line or 0) <= len(lines)})
        columns = {c.line: c.column for c in cited if c.file == file and c.line and c.column}
        for group in _groups(marks):
            if not left:
                return
            left -= 1
            yield _figure(file, lines, group, columns)


def _groups(marks: Sequence[int]) -> Iterator[list[int]]:
    """Marks whose surroundings meet, or nearly."""
    group: list[int] = []
    for mark in marks:
        far = group and mark - group[-1] > 2 * AROUND + 1 + APART_MAX
        full = group and mark - group[0] >= LINES_MAX - 2 * AROUND
        if far or full:
            yield group
            group = []
        group.append(mark)
    if group:
        yield group


def _figure(file: str, lines: Sequence[str], marks: Sequence[int], columns: Mapping[int, int]) -> CodeFigure:
    first = max(1, marks[0] - AROUND)
    return CodeFigure(
        file=named(file),
        first_line=first,
        lines=tuple(short(line) for line in lines[first - 1 : marks[-1] + AROUND]),
        marked=tuple(marks),
        columns={line: columns[line] for line in marks if columns.get(line, LINE_LETTERS) < LINE_LETTERS},
    )
