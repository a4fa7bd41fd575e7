"""What a run shows whatever was checked.

Nodes and topics, the console, the lines of code that a verdict cites, and the run on one axis of time: its processes,
nodes, topics, what went to stderr, and what the grader did. All texts and numbers are of bounded size, whatever the
evidence holds.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from difflib import get_close_matches
from typing import NamedTuple

from grader.checks.support.processes import how_it_ended
from grader.checks.support.text import SHOWN_BEFORE_CHARS
from grader.checks.support.topics import SYSTEM_TOPICS
from grader.evidence.events import ActorEvent, GraphEvent, ProcessEvent
from grader.evidence.run import BARE_NAME, Run, is_grader_node
from grader.model.figure import (
    CodeFigure,
    ConsoleFigure,
    ConsoleLine,
    Edge,
    GraphFigure,
    Lane,
    Stretch,
    TimelineFigure,
)
from grader.model.verdict import Citation, FileCitation
from grader.untrusted_text import without_colours
from grader.wording import shorten

NAME_LETTERS = 200
LINE_LETTERS = 300
LARGEST = 2**64
# the golden ratio: the fractions of its multiples are spread evenly, and repeat in no rhythm
SPREAD = (math.sqrt(5) - 1) / 2


def short(text: object, letters: int = LINE_LETTERS) -> str:
    """Return its beginning, with a mark where it goes on."""
    whole = text if isinstance(text, str) else str(text)
    cut = shorten(whole, letters)
    return cut if cut.isascii() else cut.encode(errors="replace").decode()  # a lone surrogate is no UTF-8


def short_name(text: object) -> str:
    """Return the name of a topic, a node or a file."""
    return short(text, NAME_LETTERS)


def finite(value: float) -> float:
    """Return a number that can be drawn and written as JSON; what is none is 0."""
    return max(-LARGEST, min(LARGEST, value)) if value == value else 0.0  # noqa: PLR0124 - NaN is not itself


def is_drawn(name: str) -> bool:
    """Return whether a node or a topic is none of the grader's own."""
    return name not in {"", BARE_NAME} and not name.startswith(f"{BARE_NAME}/") and not is_grader_node(name)


def second(run: Run, time_ns: int) -> float:
    """Return the seconds since the run began."""
    return round((time_ns - run.start_ns) / 1e9, 6)


def thin_out(indices: Sequence[int], count: int) -> Iterable[int]:
    """Return about `count` of them, one from each of as many parts, at another place in each: so that no rhythm of
    theirs meets one of the parts'."""
    if len(indices) <= count:
        return indices
    size = len(indices) / max(1, count)
    return (indices[int((part + part * SPREAD % 1) * size)] for part in range(count))


NODES_MAX = 40
TOPICS_MAX = 40
EDGES_MAX = 200
STATES_MAX = 400
UNKNOWN = {"", "*"}


HEARERS = frozenset({"hears", "launch-connects", "connected", "copies"})
"""Checks that ask who subscribes to their topic; others with a topic ask who publishes on it."""


def with_faults(graph: GraphFigure, check: str, params: object) -> GraphFigure:
    """Return the graph with what is missing or wrong in it marked, as far as what the check asks for tells it."""
    topic = getattr(params, "topic", None)
    wrong = dict(_wrong_nodes(graph, check, params))
    if not isinstance(topic, str):
        return graph.model_copy(update={"wrong": wrong})
    missing = () if topic in graph.topics else (short_name(topic),)
    wrong |= dict(_wrong_topics(graph, check, params, topic))
    return graph.model_copy(update={"topics": (*graph.topics, *missing), "missing": missing, "wrong": wrong})


def _wrong_topics(graph: GraphFigure, check: str, params: object, topic: str) -> Iterator[tuple[str, str]]:
    ends = {edge.publishes for edge in graph.edges if edge.topic == topic}
    asked = getattr(params, "type", None)
    if not ends:
        yield from ((one, f"not {topic}") for one in get_close_matches(topic, graph.topics, 1, 0.8))
    if True not in ends and check != "hears":  # there the grader publishes
        yield topic, "nobody publishes"
    elif False not in ends and check in HEARERS:
        yield topic, "nobody subscribes"
    elif isinstance(asked, str) and graph.types.get(topic, asked) != asked:
        yield topic, f"not {asked}"
    elif check == "latched":
        yield topic, "not latched"


def _wrong_nodes(graph: GraphFigure, check: str, params: object) -> Iterator[tuple[str, str]]:
    if check == "copies":
        topic = getattr(params, "topic", "")
        senders = {edge.node for edge in graph.edges if edge.publishes and edge.topic == topic}
        if len(senders) == 1:
            yield senders.pop(), "the name of both"
    if check not in {"node-name", "node-lives"}:
        return
    names = [f"/{name.strip('/')}" for name in getattr(params, "names", ())]
    if names and not any(
        # rospy adds numbers to the name of an anonymous node
        re.fullmatch(rf"{re.escape(name)}(_\d+)*", node)
        for name in names
        for node in graph.nodes
    ):
        yield from ((node, f"not {names[0]}") for node in graph.nodes)


class _Edge(NamedTuple):
    node: str
    topic: str
    publishes: bool


def graph_of(run: Run) -> GraphFigure | None:
    """Return who was joined with whom; None where no node was there."""
    states = _states(run)
    edges = list(dict.fromkeys(_edges(run, states)))
    nodes = list(dict.fromkeys(_nodes(states, edges)))
    shown = set(nodes[:NODES_MAX])
    # topics of the nodes that are shown come first, and so keep their place
    topics = list(dict.fromkeys([*(e.topic for e in edges if e.node in shown), *(e.topic for e in edges)]))
    drawn = set(topics[:TOPICS_MAX])
    if not nodes:
        return None
    types = _types(run, states)
    kept = [e for e in edges if e.node in shown and e.topic in drawn][:EDGES_MAX]
    return GraphFigure(
        scenario=short_name(run.scenario),
        nodes=tuple(map(short_name, nodes[:NODES_MAX])),
        topics=tuple(map(short_name, topics[:TOPICS_MAX])),
        types={short_name(t): short_name(types[t]) for t in topics[:TOPICS_MAX] if t in types},
        edges=tuple(
            Edge(node=short_name(e.node), topic=short_name(e.topic), publishes=e.publishes) for e in kept
        ),
        left_out=len(nodes) - len(shown) + len(topics) - len(drawn),
    )


def _states(run: Run) -> list[GraphEvent]:
    """Return all of the master's states, or some and the last of very many."""
    events = [event for _, event in run.graph]
    if len(events) <= STATES_MAX:
        return events
    return [*(events[i] for i in thin_out(range(len(events)), STATES_MAX - 1)), events[-1]]


def _edges(run: Run, states: Sequence[GraphEvent]) -> Iterator[_Edge]:
    """Yield them in the order of their appearance; another tool's recording knows of publishers alone."""
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
    """Return what was printed, without colours; None where nothing was."""
    own = {event.name for _, event in run.processes if event.role == "grader"}
    printed = [(time_ns, line) for time_ns, line in run.console if line.process not in own]
    if not printed:
        return None
    many = len(printed) > FIRST_LINES + LAST_LINES
    kept = [*printed[:FIRST_LINES], *printed[-LAST_LINES:]] if many else printed
    texts = [without_colours(line.line[:SHOWN_BEFORE_CHARS]) for _, line in kept]
    large = sum(min(len(text), LINE_LETTERS) for text in texts) > LETTERS_MAX
    letters = LETTERS_MAX // len(texts) if large else LINE_LETTERS
    lines = tuple(
        ConsoleLine(
            at_s=second(run, time_ns),
            process=short_name(line.process),
            stream=line.stream,
            text=short(text, letters),
        )
        for (time_ns, line), text in zip(kept, texts, strict=True)
    )
    return ConsoleFigure(scenario=short_name(run.scenario), lines=lines, left_out=len(printed) - len(kept))


AROUND = 3
APART_MAX = 4
"""So many lines between two places are shown too, rather than left out."""
LINES_MAX = 60
FIGURES_MAX = 6


def code_figures(build: Run, citations: Sequence[Citation]) -> Iterator[CodeFigure]:
    """Yield a figure for each place of each file that was kept; places near each other are one."""
    cited = [c for c in citations if isinstance(c, FileCitation) and c.line is not None]
    left = FIGURES_MAX
    for file in dict.fromkeys(c.file for c in cited):
        lines = build.file_lines(file)
        marks = sorted({c.line or 0 for c in cited if c.file == file and 0 < (c.line or 0) <= len(lines)})
        places = {c.line: c for c in cited if c.file == file and c.line and c.column}
        for group in _groups(marks):
            if not left:
                return
            left -= 1
            yield _figure(file, lines, group, places)


def _groups(marks: Sequence[int]) -> Iterator[list[int]]:
    """Yield the groups of marks whose surroundings meet, or nearly."""
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


def _figure(
    file: str, lines: Sequence[str], marks: Sequence[int], places: Mapping[int, FileCitation]
) -> CodeFigure:
    shown = {
        line: places[line] for line in marks if line in places and (places[line].column or 0) < LINE_LETTERS
    }
    first = max(1, marks[0] - AROUND)
    return CodeFigure(
        file=short_name(file),
        first_line=first,
        lines=tuple(short(line) for line in lines[first - 1 : marks[-1] + AROUND]),
        marked=tuple(marks),
        columns={line: one.column for line, one in shown.items() if one.column},
        ends={line: one.end_column for line, one in shown.items() if one.end_column},
    )


LANES_MAX = 24
STRETCHES_MAX = 120
RUN_PARTS = 400
"""Messages that are nearer to each other than such a part of the run are drawn as one stretch."""
SAYS_LETTERS = 120
QUIET = frozenset({"clock", "open", "note", "left", "lookup", "read"})


def timeline_of(run: Run) -> TimelineFigure | None:
    """Return the run's lanes; None if no process and no node was there: other tools' recordings have messages alone."""
    lanes = [
        *_processes(run),
        *_node_lanes(run),
        *_topics(run),
        *_lane("log", "stderr", _errors(run)),
        *_lane("grader", "the grader", _actions(run)),
    ]
    if not any(lane.kind in {"process", "node"} for lane in lanes):
        return None
    return TimelineFigure(
        scenario=short_name(run.scenario),
        length_s=second(run, run.end_ns),
        lanes=tuple(lanes[:LANES_MAX]),
        left_out=len(lanes[LANES_MAX:]),
    )


def _lane(kind: str, name: str, stretches: Iterable[Stretch]) -> Iterator[Lane]:
    found = tuple(stretches)
    if found:
        yield Lane.model_validate(
            {"kind": kind, "name": short_name(name), "stretches": found[:STRETCHES_MAX]}
        )


def _processes(run: Run) -> Iterator[Lane]:
    names = dict.fromkeys(event.name for _, event in run.processes if event.role != "build")
    for name in names:
        yield from _lane("process", name, _lives(run, name))


def _lives(run: Run, name: str) -> Iterator[Stretch]:
    begin: int | None = None
    for time_ns, event in run.processes:
        if event.name != name:
            continue
        if event.event == "start":
            begin = time_ns
        elif begin is not None:
            yield _stretch(run, begin, time_ns, _how_it_ended(event), wrong=_has_failed(event))
            begin = None
    if begin is not None:
        yield _stretch(run, begin, run.end_ns, "ran to the end")


def _how_it_ended(event: ProcessEvent) -> str:
    stopped = {"INT": "Ctrl-C, then "}.get(event.stopped_by or "", f"{event.stopped_by}, then ")
    return (stopped if event.stopped_by else "ended by itself: ") + how_it_ended(event)


def _has_failed(event: ProcessEvent) -> bool:
    killed = event.stopped_by == "KILL" and event.role == "student"
    return killed or (event.stopped_by is None and event.exit_code != 0)


def _node_lanes(run: Run) -> Iterator[Lane]:
    """Yield each node, from the first of the master's states that has it up to the first that has it no longer."""
    for node in filter(is_drawn, (*run.student_nodes(), *sorted(run.grader_nodes - {"/rosout"}))):
        yield from _lane("node", node, _node_stretches(run, node))


def _node_stretches(run: Run, node: str) -> Iterator[Stretch]:
    begin: int | None = None
    for time_ns, state in run.graph:
        if node in state.nodes and begin is None:
            begin = time_ns
        elif node not in state.nodes and begin is not None:
            yield _stretch(run, begin, time_ns, "registered with the master")
            begin = None
    if begin is not None:
        yield _stretch(run, begin, run.end_ns, "registered with the master")


def _topics(run: Run) -> Iterator[Lane]:
    size_ns = max(1, (run.end_ns - run.start_ns) // RUN_PARTS)
    topics = (c.topic for c in run.channels if c.topic not in SYSTEM_TOPICS and is_drawn(c.topic))
    for topic in dict.fromkeys(topics):
        times = sorted(time for c in run.channels if c.topic == topic for time in c.times_ns)
        yield from _lane("topic", topic, _message_stretches(run, times, size_ns))


def _message_stretches(run: Run, times: Sequence[int], size_ns: int) -> Iterator[Stretch]:
    """Yield stretches of messages; of very many, they are longer."""
    while len(found := list(_join_close(times, size_ns))) > STRETCHES_MAX:
        size_ns *= 2
    for begin, end, count in found:
        yield _stretch(run, begin, end, f"{count} messages" if count > 1 else "")


def _join_close(times: Sequence[int], size_ns: int) -> Iterator[tuple[int, int, int]]:
    """Yield the first time, the last time and the number of those that follow each other so closely."""
    begin, count = 0, 0
    for i, time_ns in enumerate(times):
        count += 1
        if i + 1 == len(times) or times[i + 1] - time_ns > size_ns:
            yield times[begin], time_ns, count
            begin, count = i + 1, 0


def _errors(run: Run) -> Iterator[Stretch]:
    own = {event.name for _, event in run.processes if event.role == "grader"}
    for time_ns, line in run.console:
        text = without_colours(line.line[:SHOWN_BEFORE_CHARS]).strip()
        if line.stream == "stderr" and line.process not in own and text:
            yield _stretch(run, time_ns, time_ns, f"{line.process}: {text}", wrong=True)


def _actions(run: Run) -> Iterator[Stretch]:
    for time_ns, event in run.actors:
        if event.action not in QUIET:
            yield _stretch(run, time_ns, time_ns, _action_text(event))


def _action_text(event: ActorEvent) -> str:
    """Return `publish /chatter "abc"`, or `Ctrl-C`."""
    if event.action == "interrupt":
        return "Ctrl-C"
    value = "" if event.value is None else f"{event.value!r}"
    parts = (event.action.replace("_", " "), event.topic or "", value, event.detail)
    return " ".join(part for part in parts if part)


def _stretch(run: Run, from_ns: int, to_ns: int, says: str, *, wrong: bool = False) -> Stretch:
    begin = max(0.0, second(run, from_ns))
    return Stretch(
        from_s=round(begin, 3),
        to_s=round(max(begin, second(run, to_ns)), 3),
        says=short(says, SAYS_LETTERS),
        wrong=wrong,
    )
