"""Who published and subscribed to what in a run: the student's nodes, and the programs that run beside them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from grader.checks.support.topics import SYSTEM_TOPICS
from grader.evidence.events import GraphEvent
from grader.evidence.run import BARE_NAME, Run, is_grader_node
from grader.model.figure import Edge, GraphFigure
from grader.report.figures.bounded import named, spread

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
        nodes=tuple(map(_name, nodes[:NODES_MAX])),
        topics=tuple(map(_name, topics[:TOPICS_MAX])),
        types={_name(t): _name(types[t]) for t in topics[:TOPICS_MAX] if t in types},
        edges=tuple(Edge(node=_name(e.node), topic=_name(e.topic), publishes=e.publishes) for e in kept),
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
    system = topic in SYSTEM_TOPICS or topic.startswith(f"{BARE_NAME}/")
    return not system and _is_node(node)


def _is_node(name: str) -> bool:
    return name not in {"", BARE_NAME} and not is_grader_node(name)


def _nodes(states: Sequence[GraphEvent], edges: Sequence[_Edge]) -> Iterator[str]:
    for state in states:
        yield from filter(_is_node, state.nodes)
    yield from (edge.node for edge in edges)


def _types(run: Run, states: Sequence[GraphEvent]) -> dict[str, str]:
    found = {c.topic: c.type for c in run.channels}
    for state in states:
        found |= {topic: kind for topic, kind in state.topic_types.items() if kind not in UNKNOWN}
    return {topic: kind for topic, kind in found.items() if kind not in UNKNOWN}


def _name(name: str) -> str:
    return named(name)
