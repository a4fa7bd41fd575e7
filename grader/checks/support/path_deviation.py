"""Where and how a path leaves the way that it should take, in a student's words."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from grader.checks.support.geometry import Course, Point, Pose, followed, length_m, off_m
from grader.wording import significant

MOVED_M = 0.01


class Words(NamedTuple):
    """What is wrong with a path, and what to do."""

    message: str
    hint: str


class Way(NamedTuple):
    """The points of a rubric; `added` where the start was put before them."""

    points: tuple[Point, ...]
    tolerance_m: float
    added: bool

    def name(self, index: int) -> str:
        """`point 2 (2, 0)`, counted as the rubric counts."""
        if index == 0 and self.added:
            return "its start"
        return f"point {index + (0 if self.added else 1)} {spot(self.points[index])}"


def spot(point: Point) -> str:
    return f"({significant(round(point[0], 2))}, {significant(round(point[1], 2))})"


def metres(distance_m: float) -> str:
    return f"{distance_m:.2f} m"


def stands(path: Sequence[Pose]) -> bool:
    """Whether it never left its place."""
    return all(math.dist(p.point, path[0].point) <= MOVED_M for p in path)


def what_is_wrong(path: Sequence[Pose], way: Way, course: Course, *, mirror: bool) -> Words:
    """The likeliest cause; `mirror` where the way is seen from the path's own start."""
    if max(math.dist(p.point, path[0].point) for p in path) <= MOVED_M:
        return Words(
            "it never moves", "publish a linear.x that is not 0, again and again while it has to drive"
        )
    return (
        (_mirrored(path, way) if mirror else None)
        or _wrong_start(path, way, course)
        or (_strays(path, way, course) if course.strayed is not None else _ends_short(path, way, course))
    )


def _mirrored(path: Sequence[Pose], way: Way) -> Words | None:
    for sign_x, sign_y, message, hint in (
        (1, -1, "the path is mirrored: it turns right for left", "a positive angular.z turns to the left"),
        (-1, -1, "the path is driven backwards", "a positive linear.x drives forward"),
        (-1, 1, "the path is driven backwards and mirrored", "a positive linear.x drives forward"),
    ):
        other = [p._replace(x=sign_x * p.x, y=sign_y * p.y) for p in path]
        if followed(other, way.points, way.tolerance_m).done:
            return Words(message, hint)
    return None


def _wrong_start(path: Sequence[Pose], way: Way, course: Course) -> Words | None:
    if course.reached:
        return None
    apart = metres(math.dist(path[0].point, way.points[0]))
    return Words(
        f"it starts at {spot(path[0].point)}, {apart} from {way.name(0)}", "bring it to the start first"
    )


def _strays(path: Sequence[Pose], way: Way, course: Course) -> Words:
    peak, far_m = _peak(path, way, course)
    where = f"at {spot(peak.point)}, {_after(path, peak)}"
    allowed = f"{significant(way.tolerance_m)} m are allowed"
    if course.reached == len(way.points):
        apart = metres(math.dist(peak.point, way.points[-1]))
        message = f"it passes every point, and goes on: it is {apart} from the last {where}"
        return Words(message, f"publish a zero velocity once you are there; {allowed}")
    line = f"{way.name(course.reached - 1)} to {way.name(course.reached)}"
    return (
        _too_far(path, way, course)
        or _too_early(path, way, course)
        or Words(f"it strays {metres(far_m)} from the line from {line}, {where}", f"only {allowed}")
    )


def _too_far(path: Sequence[Pose], way: Way, course: Course) -> Words | None:
    """Straight on behind a point at which it should have turned."""
    first, corner = course.strayed or 0, course.reached - 1
    if corner < 1:
        return None
    start, end = way.points[corner - 1 : corner + 1]
    length_along = math.dist(start, end)
    beyond_m = 0.0
    for pose in path[first:]:
        along, aside = _along(pose.point, start, end)
        if along < length_along or abs(aside) > way.tolerance_m:
            break
        beyond_m = max(beyond_m, along - length_along)
    if not beyond_m:
        return None
    message = f"it drives {metres(beyond_m)} past {way.name(corner)}, {_after(path, path[first])}"
    return Words(
        message, f"turn sooner: {significant(way.tolerance_m)} m are allowed; distance is speed times time"
    )


def _too_early(path: Sequence[Pose], way: Way, course: Course) -> Words | None:
    """Off the line before its end, to the side where the way goes on."""
    if course.reached + 1 >= len(way.points):
        return None
    start, end, following = way.points[course.reached - 1 : course.reached + 2]
    pose = path[course.strayed or 0]
    along, aside = _along(pose.point, start, end)
    short_m = math.dist(start, end) - along
    if along <= 0 or short_m <= way.tolerance_m or aside * _along(following, start, end)[1] <= 0:
        return None
    message = f"it turns off {metres(short_m)} before {way.name(course.reached)}, {_after(path, pose)}"
    return Words(message, "drive on to the point before you turn: distance is speed times time")


def _ends_short(path: Sequence[Pose], way: Way, course: Course) -> Words:
    goal = min(course.reached, len(way.points) - 1)
    left = metres(math.dist(path[-1].point, way.points[goal]))
    every = course.reached == len(way.points)
    passed = "it passes every point" if every else f"it passes {course.reached} of {len(way.points)} points"
    message = f"{passed} and ends at {spot(path[-1].point)}, {left} from {way.name(goal)}"
    if every:
        return Words(message, "publish a zero velocity once you are at the last point")
    return Words(message, "drive longer, or let the node live until it is there")


def _peak(path: Sequence[Pose], way: Way, course: Course) -> tuple[Pose, float]:
    """Where it is farthest off, from where it strayed until it comes back to this part of the way."""
    index = min(course.reached, len(way.points) - 1)
    line = way.points[index - 1], way.points[index]
    peak, far_m = path[course.strayed or 0], 0.0
    for pose in path[course.strayed or 0 :]:
        distance_m = off_m(pose.point, *line)
        if distance_m <= way.tolerance_m:
            break
        if distance_m > far_m:
            peak, far_m = pose, distance_m
    return peak, far_m


def _along(point: Point, start: Point, end: Point) -> tuple[float, float]:
    """How far along the line through two points, and how far to the left of it (m)."""
    dx, dy = end[0] - start[0], end[1] - start[1]
    length = math.hypot(dx, dy)
    x, y = point[0] - start[0], point[1] - start[1]
    return (x * dx + y * dy) / length, (y * dx - x * dy) / length


def _after(path: Sequence[Pose], pose: Pose) -> str:
    moving = next((p for p in path if math.dist(p.point, path[0].point) > MOVED_M), path[0])
    return f"{max(0.0, pose.time_s - moving.time_s):.1f} s after it set off"


def measured(path: Sequence[Pose], course: Course, way: Way) -> str:
    """The figures of a path in one line."""
    off = metres(course.off_m) if course.strayed is None else metres(_peak(path, way, course)[1])
    return f"{off} off at most, {metres(length_m(path))} long, {course.reached} of {len(way.points)} points"
