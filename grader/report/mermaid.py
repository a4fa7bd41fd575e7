"""The graph of nodes and topics as a mermaid diagram, which GitHub and GitLab draw."""

from __future__ import annotations

import re
from collections.abc import Iterator

from grader.model.figure import GraphFigure
from grader.report.text import line

NAME_CHARS = 60
PARTS_MAX, EDGES_MAX = 40, 80
# What has a meaning to mermaid nowhere inside of quotes. An underscore or a dot within a word is none for its Markdown.
_PLAIN = re.compile(r"[A-Za-z0-9/ ]|(?<=[A-Za-z0-9])[_-](?=[A-Za-z0-9])")


def mermaid(graph: GraphFigure) -> str:
    """The diagram's text: round nodes, square topics, arrows from publisher to subscriber.

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
    return "".join(c if i in plain else f"#{ord(c)};" for i, c in enumerate(shown))
