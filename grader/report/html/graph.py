"""The graph of nodes (ellipses) and topics (boxes), laid out in layers from left to right as `rqt_graph` does."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

from markupsafe import Markup

from grader.model.figure import GraphFigure
from grader.report.html.svg import drawing, element, text
from grader.wording import shorten

MOST = 40
HEIGHT, ROW, COLUMN_GAP, EDGE = 44.0, 66.0, 40.0, 8.0
LETTER, SMALL_LETTER = 8.2, 6.6  # pixels: there is nothing here that could measure a text
NAME_CHARS = 32
ANONYMOUS = re.compile(r"_\d+_\d{10,}$")
Place = tuple[float, float, float]


def graph_plot(figure: GraphFigure, name: str) -> Markup | None:
    """Return the drawing; None for one that no one could read: then the list beside it says all."""
    vertices = [f"n{node}" for node in figure.nodes] + [f"t{topic}" for topic in figure.topics]
    if not vertices or len(vertices) > MOST or not (figure.edges or figure.wrong):
        return None
    known = set(vertices)
    # what a node publishes flows to the topic, and what it subscribes to comes from there
    ends = (
        (f"n{e.node}", f"t{e.topic}") if e.publishes else (f"t{e.topic}", f"n{e.node}") for e in figure.edges
    )
    arrows = [(begin, end) for begin, end in ends if known.issuperset((begin, end))]
    layers = layered(vertices, arrows)
    places, size = _places(layers, figure)
    children = [_heads(name)]
    children += [_draw_arrow(arrow, layers, places, name) for arrow in layers.routes]
    children += [part for vertex in vertices for part in _shape(vertex, places[vertex], figure)]
    words = f"{len(figure.nodes)} nodes and {len(figure.topics)} topics; the table says who publishes and who listens."
    words += "".join(f" {said}." for said in graph_faults(figure))
    return drawing(name, size, "Nodes (ellipses) and topics (boxes)", words, *children)


def graph_faults(figure: GraphFigure) -> list[str]:
    """Return what is wrong in the graph: `/chatter: nobody publishes`."""
    return [f"{name}: {said}" for name, said in figure.wrong.items()]


def graph_rows(figure: GraphFigure) -> Iterator[tuple[str, str, str, str]]:
    """Yield the same as rows: the topic, its type, who publishes, who listens."""
    for topic in figure.topics:
        edges = [edge for edge in figure.edges if edge.topic == topic]
        publishers = dict.fromkeys(edge.node for edge in edges if edge.publishes)
        listeners = dict.fromkeys(edge.node for edge in edges if not edge.publishes)
        yield (
            topic,
            figure.types.get(topic, ""),
            ", ".join(publishers) or "none",
            ", ".join(listeners) or "none",
        )


def _clip_name(name: str) -> str:
    """Return the name, without the number that makes an anonymous node's unique: it only takes room."""
    return shorten(ANONYMOUS.sub("_…", name), NAME_CHARS)


def _width(vertex: str, figure: GraphFigure) -> float:
    if is_bend(vertex):
        return 0.0
    name = LETTER * len(_clip_name(vertex[1:]))
    said = SMALL_LETTER * len(_clip_name(figure.wrong.get(vertex[1:], ""))) - 2 * EDGE
    if vertex[0] == "n":
        return max(72.0, name * 1.15 + 34, said)  # an ellipse narrows above and below its middle
    return max(72.0, name + 22, said, SMALL_LETTER * len(_clip_name(figure.types.get(vertex[1:], ""))) + 22)


def _places(layers: Layers, figure: GraphFigure) -> tuple[dict[str, Place], tuple[float, float]]:
    """Return the middle and the width of each vertex, and the size of the whole."""
    tallest = max(len(column) for column in layers.columns)
    places: dict[str, Place] = {}
    left = EDGE
    for column in layers.columns:
        wide = max(_width(vertex, figure) for vertex in column)
        above = (tallest - len(column)) * ROW / 2 + EDGE + HEIGHT / 2
        for row, vertex in enumerate(column):
            places[vertex] = (left + wide / 2, above + row * ROW, _width(vertex, figure))
        left += wide + COLUMN_GAP
    # 16: what is wrong with a vertex of the last row is written below it
    return places, (left - COLUMN_GAP + EDGE, (tallest - 1) * ROW + HEIGHT + 2 * EDGE + 16)


def _shape(vertex: str, place: Place, figure: GraphFigure) -> list[Markup]:
    x, y, width = place
    full = vertex[1:]
    name = text(x, y + 5, _clip_name(full), class_="name", text_anchor="middle")
    said = _clip_name(figure.wrong.get(full, ""))
    below = [text(x, y + HEIGHT / 2 + 15, said, class_="alarm", text_anchor="middle")] if said else []
    look = " wrong" if said else ""
    if vertex[0] == "n":
        return [
            element("ellipse", cx=x, cy=y, rx=width / 2, ry=HEIGHT / 2, class_=f"node{look}"),
            name,
            *below,
        ]
    look += " missing" if full in figure.missing else ""
    box = element(
        "rect", x=x - width / 2, y=y - HEIGHT / 2, width=width, height=HEIGHT, class_=f"topic{look}"
    )
    kind = _clip_name(figure.types.get(full, ""))
    if not kind:
        return [box, name, *below]
    name = text(x, y - 1, _clip_name(full), class_="name", text_anchor="middle")
    return [box, name, text(x, y + 15, kind, text_anchor="middle"), *below]


def _heads(name: str) -> Markup:
    head = element("path", d="M0 0L10 5L0 10z", class_="head")
    marker = element(
        "marker",
        head,
        id=f"{name}-head",
        viewBox="0 0 10 10",
        refX=9,
        refY=5,
        markerWidth=7,
        markerHeight=7,
        orient="auto",
    )
    return element("defs", marker)


def _draw_arrow(arrow: Arrow, layers: Layers, places: dict[str, Place], name: str) -> Markup:
    """Return a curve to the right through all that it passes; one that leads back hangs below."""
    route = layers.routes[arrow]
    stops = [places[vertex] for vertex in route]
    if arrow in layers.back:
        (x2, y2, _), (x1, y1, _) = stops[0], stops[-1]
        half, low = HEIGHT / 2, max(y1, y2) + HEIGHT / 2 + 22
        curve = f"M{x1:.1f} {y1 + half:.1f}C{x1:.1f} {low:.1f} {x2:.1f} {low:.1f} {x2:.1f} {y2 + half:.1f}"
    else:
        begin = (stops[0][0] + stops[0][2] / 2, stops[0][1])
        curve = f"M{begin[0]:.1f} {begin[1]:.1f}"
        for x, y, width in stops[1:]:
            end = (x - width / 2, y)
            middle = (begin[0] + end[0]) / 2
            curve += f"C{middle:.1f} {begin[1]:.1f} {middle:.1f} {end[1]:.1f} {end[0]:.1f} {end[1]:.1f}"
            begin = end
    return element("path", d=curve, class_="arrow", marker_end=f"url(#{name}-head)")


Vertex = str
Arrow = tuple[Vertex, Vertex]
SWEEPS = 6


@dataclass(frozen=True, kw_only=True)
class Layers:
    """`columns` from left to right, each from the top down. `routes` has for each arrow all that it passes: its
    ends, and a place (`""` in front of its name) in each column between. Arrows that lead back are routed forwards.
    """

    columns: tuple[tuple[Vertex, ...], ...]
    routes: dict[Arrow, tuple[Vertex, ...]]
    back: frozenset[Arrow]


def layered(vertices: Sequence[Vertex], arrows: Sequence[Arrow]) -> Layers:
    """Return the layers: every arrow leads to the right, but for those that close a circle."""
    back = _closing(vertices, arrows)
    forward = {arrow: (arrow[::-1] if arrow in back else arrow) for arrow in dict.fromkeys(arrows)}
    depth = _depths(vertices, list(forward.values()))
    columns: list[list[Vertex]] = [[] for _ in range(max(depth.values(), default=0) + 1)]
    for vertex in vertices:
        columns[depth[vertex]].append(vertex)
    routes: dict[Arrow, tuple[Vertex, ...]] = {}
    for number, (arrow, (begin, end)) in enumerate(forward.items()):
        # no name of ROS has a NUL in it
        between = [f"\0{number}.{column}" for column in range(depth[begin] + 1, depth[end])]
        for place, column in zip(between, range(depth[begin] + 1, depth[end]), strict=True):
            columns[column].append(place)
        routes[arrow] = (begin, *between, end)
    _order(columns, list(routes.values()))
    return Layers(columns=tuple(map(tuple, columns)), routes=routes, back=frozenset(back))


def is_bend(vertex: Vertex) -> bool:
    """Return whether it is only a place that an arrow passes."""
    return vertex.startswith("\0")


def _closing(vertices: Sequence[Vertex], arrows: Sequence[Arrow]) -> set[Arrow]:
    """Return the arrows that close a circle, met depth first, from where nothing leads to."""
    following: dict[Vertex, list[Vertex]] = defaultdict(list)
    reached = set()
    for begin, end in arrows:
        following[begin].append(end)
        reached.add(end)
    closing: set[Arrow] = set()
    done: set[Vertex] = set()
    # what is in a circle alone comes last: nothing else leads there
    for root in sorted(vertices, key=lambda vertex: vertex in reached):
        trail, on_trail = [(root, iter(following[root]))], {root}
        while trail and root not in done:
            vertex, rest = trail[-1]
            for end in rest:
                if end in on_trail:
                    closing.add((vertex, end))
                elif end not in done:
                    trail.append((end, iter(following[end])))
                    on_trail.add(end)
                    break
            else:
                trail.pop()
                on_trail.discard(vertex)
                done.add(vertex)
    return closing


def _depths(vertices: Sequence[Vertex], arrows: Sequence[Arrow]) -> dict[Vertex, int]:
    """Return the longest ways from the left; what nothing leads to stands just before what it leads to."""
    depth = dict.fromkeys(vertices, 0)
    # so many rounds are enough for the longest way
    for _ in vertices:
        moved = False
        for begin, end in arrows:
            if depth[end] <= depth[begin]:
                depth[end] = depth[begin] + 1
                moved = True
        if not moved:
            break
    reached = {end for _, end in arrows}
    for vertex in vertices:
        ends = [depth[end] for begin, end in arrows if begin == vertex]
        if vertex not in reached and ends:
            depth[vertex] = min(ends) - 1
    return depth


def _order(columns: list[list[Vertex]], routes: list[tuple[Vertex, ...]]) -> None:
    """Sort each vertex near the middle of those that it is joined with, to the right and back again."""
    before: dict[Vertex, list[Vertex]] = defaultdict(list)
    after: dict[Vertex, list[Vertex]] = defaultdict(list)
    for route in routes:
        for left, right in pairwise(route):
            before[right].append(left)
            after[left].append(right)
    for sweep in range(SWEEPS):
        rightwards = sweep % 2 == 0
        order = columns[1:] if rightwards else columns[-2::-1]
        joined = before if rightwards else after
        place = {v: i / len(column) for column in columns for i, v in enumerate(column)}
        for column in order:
            middle = {
                v: sum(place[u] for u in joined[v]) / len(joined[v]) if joined[v] else place[v]
                for v in column
            }
            column.sort(key=middle.__getitem__)
            place |= {v: i / len(column) for i, v in enumerate(column)}
