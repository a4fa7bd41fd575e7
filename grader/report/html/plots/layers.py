"""Nodes and topics in layers from left to right, with as few crossings as a few sweeps find."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

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
    """Every arrow leads to the right, but for those that close a circle. `arrows` join `vertices`."""
    back = _closing(vertices, arrows)
    forward = {arrow: (arrow[::-1] if arrow in back else arrow) for arrow in dict.fromkeys(arrows)}
    depth = _depths(vertices, list(forward.values()))
    columns: list[list[Vertex]] = [[] for _ in range(max(depth.values(), default=0) + 1)]
    for vertex in vertices:
        columns[depth[vertex]].append(vertex)
    routes: dict[Arrow, tuple[Vertex, ...]] = {}
    for number, (arrow, (begin, end)) in enumerate(forward.items()):
        between = [f"\0{number}.{column}" for column in range(depth[begin] + 1, depth[end])]
        for place, column in zip(between, range(depth[begin] + 1, depth[end]), strict=True):
            columns[column].append(place)
        routes[arrow] = (begin, *between, end)
    _order(columns, list(routes.values()))
    return Layers(columns=tuple(map(tuple, columns)), routes=routes, back=frozenset(back))


def is_bend(vertex: Vertex) -> bool:
    """Whether it is only a place that an arrow passes."""
    return vertex.startswith("\0")


def _closing(vertices: Sequence[Vertex], arrows: Sequence[Arrow]) -> set[Arrow]:
    """The arrows that close a circle, met depth first, from where nothing leads to."""
    following: dict[Vertex, list[Vertex]] = defaultdict(list)
    reached = set()
    for begin, end in arrows:
        following[begin].append(end)
        reached.add(end)
    closing: set[Arrow] = set()
    done: set[Vertex] = set()
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
    """The longest way from the left; what nothing leads to stands just before what it leads to."""
    depth = dict.fromkeys(vertices, 0)
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
    """Each vertex near the middle of those that it is joined with, to the right and back again."""
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
