"""Regions of the plane in which a robot has to stay, and the walls that a run's simulator shows."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

from grader.checks.support.geometry import Point, Polyline, off_m
from grader.checks.support.nodes import plain_type
from grader.evidence.run import Run
from grader.wording import significant

MARKER, LINE_STRIP, LINE_LIST = "visualization_msgs/Marker", 4, 5
WALLS_MAX = 2_000
"""Of one run; a map has fewer."""


class Area(NamedTuple):
    """What an outline encloses; its last point is joined to the first."""

    outline: Polyline
    words: str

    def out_m(self, point: Point) -> float:
        """Return how far outside a point is (m); 0 inside."""
        return 0.0 if self._holds(point) else nearest_m(point, [(*self.outline, self.outline[0])])

    def _holds(self, point: Point) -> bool:
        """Count the sides that a ray to the right crosses."""
        x, y = point
        inside = False
        for (x0, y0), (x1, y1) in pairwise((*self.outline, self.outline[0])):
            if (y0 > y) != (y1 > y) and x < x0 + (x1 - x0) * (y - y0) / (y1 - y0):
                inside = not inside
        return inside


class Band(NamedTuple):
    """At least `min_m` and at most `max_m` from the nearest of some lines and points."""

    walls: Sequence[Polyline]
    min_m: float | None
    max_m: float | None
    outline: Polyline = ()

    @property
    def words(self) -> str:
        what = "a wall" if any(len(wall) > 1 for wall in self.walls) else "a point"
        if self.max_m is None:
            return f"at least {significant(self.min_m or 0)} m from {what}"
        if self.min_m is None:
            return f"at most {significant(self.max_m)} m from {what}"
        return f"{significant(self.min_m)} to {significant(self.max_m)} m from {what}"

    def out_m(self, point: Point) -> float:
        distance_m = nearest_m(point, self.walls)
        over_m = distance_m - self.max_m if self.max_m is not None else 0.0
        return max(0.0, over_m, (self.min_m or 0.0) - distance_m)


Region = Area | Band
"""Where a robot may be: `words` say it, `out_m` is how far outside a point is, `outline` is a border to be drawn."""


def nearest_m(point: Point, lines: Sequence[Polyline]) -> float:
    """Return the distance from a point to the nearest of the lines, of which some may be single points."""
    sides = (side for line in lines for side in (pairwise(line) if len(line) > 1 else [(line[0], line[0])]))
    return min((off_m(point, *side) for side in sides), default=math.inf)


def shown_walls(run: Run) -> tuple[Polyline, ...]:
    """Return the walls that a program of the grader's shows to RViz: the lines of its visualization_msgs/Marker."""
    channels = [
        c
        for c in run.channels
        if c.callerid in run.grader_nodes and plain_type(c.type) == MARKER and c.messages
    ]
    walls = [wall for channel in channels for wall in _lines(channel.values[-1])]
    return tuple(walls[:WALLS_MAX])


def _lines(marker: Any) -> Iterator[Polyline]:  # noqa: ANN401 - decoded messages hold anything
    if not isinstance(marker, Mapping):
        return
    points = tuple((float(p["x"]), float(p["y"])) for p in marker["points"])
    if not all(math.isfinite(number) for point in points for number in point):
        return
    if marker["type"] == LINE_LIST:
        yield from zip(points[::2], points[1::2], strict=False)
    elif marker["type"] == LINE_STRIP and points:
        yield points
