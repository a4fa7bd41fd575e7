"""What a criterion asks of a robot in the robot world, and the walls of the rubric's room do not allow."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Any

from grader.checks.support.fields import is_number
from grader.rubric.durations import longest_s
from grader.rubric.simulators import FORMS, TRUE_POSE, robot_of, set_in
from grader.rubric.yaml_lines import Fault, KeyPath, WrittenCriterion, as_map

Spot = tuple[float, float]
AHEAD_M = 0.3
"""By so much a laser may be nearer to a wall than the robot's centre."""
SCANS = frozenset({"/scan", "/base_scan"})


def room_faults(about: WrittenCriterion) -> Iterator[Fault]:
    """Yield distances from walls that the robot does not have at its start, walls that it cannot come near to in the
    run, and goals outside of a closed room."""
    robot = robot_of(about.scenario)
    lines, place = _lines(robot), _start(robot)
    if not lines or place is None:
        return
    away_m = min(_distance(place, *ends) for line in lines for ends in pairwise(line))
    if not is_number(robot.get("radius")) or away_m < robot["radius"]:  # said of the start
        return
    if about.check == "stays-within" and about.given.get("topic") == TRUE_POSE:
        yield from _too_near(about, away_m)
    if about.check == "reacts":
        yield from _never_near(about, robot, away_m)
    goal = _spot(about.given.get("goal"))
    is_place = about.check == "ends-at" and about.given.get("topic") == TRUE_POSE
    if is_place and goal and about.given.get("relative") is not True:
        yield from _outside(about, lines, place, goal)


def start_faults(path: KeyPath, scenario: dict[str, Any]) -> Iterator[Fault]:
    """Yield that the robot touches a wall before it has moved, or is in a box."""
    robot = robot_of(scenario)
    lines, place, radius_m = _lines(robot), _start(robot), robot.get("radius")
    if not lines or place is None or not is_number(radius_m):
        return
    away_m = min(_distance(place, *ends) for line in lines for ends in pairwise(line))
    boxes = [line for line in _boxes(robot) if _is_inside(place, line)]
    given = (at for at, one in set_in(scenario) if str(one.get("name")).endswith("/start"))
    where = (*path, *next(given, ("start",)))
    closed = [line for line in _lines(robot) if line[0] == line[-1] and line not in _boxes(robot)]
    rooms = [line for line in closed if any(_is_inside(box[0], line) for box in _boxes(robot))]
    if rooms and not any(_is_inside(place, line) for line in rooms):
        yield where, f"the robot starts at {pair(place)}, outside of the room that the walls make"
    elif boxes:
        inside = f"in the box from {pair(boxes[0][0])} to {pair(boxes[0][2])}"
        yield where, f"the robot starts at {pair(place)}, {inside}"
    elif away_m < radius_m:
        touches = f"{away_m:.2g} m from a wall, which it touches before it has moved"
        yield where, f"the robot starts at {pair(place)}, {touches}"


def _start(robot: dict[str, Any]) -> Spot | None:
    """Return where the robot starts; None where that is not known, or a map has walls too."""
    start = robot.get("start")
    is_known = isinstance(start, list) and FORMS["start"][1](start) and "map" not in robot
    return (start[0], start[1]) if isinstance(start, list) and is_known else None


def _lines(robot: dict[str, Any]) -> list[list[Spot]]:
    """Return the walls and the sides of the boxes; none where one of the two is not as it has to be."""
    walls = robot.get("walls", [])
    if not FORMS["walls"][1](walls) or not FORMS["boxes"][1](robot.get("boxes", [])):
        return []
    return [[(x, y) for x, y in line] for line in walls if line] + _boxes(robot)


def _boxes(robot: dict[str, Any]) -> list[list[Spot]]:
    return [[(a, b), (c, b), (c, d), (a, d), (a, b)] for a, b, c, d in robot.get("boxes", [])]


def _spot(value: object) -> Spot | None:
    is_one = isinstance(value, list) and len(value) == 2 and all(map(is_number, value))
    return (value[0], value[1]) if isinstance(value, list) and is_one else None


def _distance(spot: Spot, one: Spot, other: Spot) -> float:
    """Return how far a spot is from the line between two others."""
    dx, dy = other[0] - one[0], other[1] - one[1]
    squared = dx * dx + dy * dy
    along = ((spot[0] - one[0]) * dx + (spot[1] - one[1]) * dy) / squared if squared else 0.0
    along = min(max(along, 0.0), 1.0)
    return math.dist(spot, (one[0] + along * dx, one[1] + along * dy))


def _is_inside(spot: Spot, line: Sequence[Spot]) -> bool:
    """Return whether a closed line goes around a spot."""
    x, y = spot
    crossed = 0
    for (x0, y0), (x1, y1) in pairwise(line):
        if (y0 > y) != (y1 > y) and x < x0 + (y - y0) * (x1 - x0) / (y1 - y0):
            crossed += 1
    return crossed % 2 == 1


def pair(spot: Spot) -> str:
    """Return a place as it is written: `(1, 2.5)`."""
    return f"({spot[0]:g}, {spot[1]:g})"


def _too_near(about: WrittenCriterion, away_m: float) -> Iterator[Fault]:
    given = about.given
    if given.get("walls") or given.get("from_s") or given.get("share", 1) != 1:
        return
    least_m, most_m = given.get("min_m"), given.get("max_m")
    wrong = {"min_m": is_number(least_m) and away_m < least_m, "max_m": is_number(most_m) and away_m > most_m}
    for key, is_wrong in wrong.items():
        if is_wrong:
            yield (*about.at, key), f"the robot starts {away_m:.2g} m from the nearest wall"


def _never_near(about: WrittenCriterion, robot: dict[str, Any], away_m: float) -> Iterator[Fault]:
    """Yield causes that need a wall nearer than any that the robot can come to."""
    cause, most_s, fastest = (
        as_map(about.given.get("cause")),
        longest_s(about.scenario),
        robot.get("max_linear"),
    )
    is_range = cause.get("topic") in SCANS and str(cause.get("field")).startswith("ranges[")
    if not is_range or not is_number(cause.get("max")) or not is_number(fastest) or most_s is None:
        return
    nearest_m = away_m - fastest * most_s - AHEAD_M
    if nearest_m > cause["max"]:
        far = f"{most_s:g} s at {fastest:g} m/s are {fastest * most_s:.3g} m"
        fault = f"the nearest wall is {away_m:.3g} m away, and {far}"
        yield (*about.at, "cause", "max"), f"{fault}: the cause never comes"


def _outside(about: WrittenCriterion, lines: list[list[Spot]], start: Spot, goal: Spot) -> Iterator[Fault]:
    """Yield a goal that is beyond the walls of a closed room in which the robot starts, or in a box."""
    tolerance_m, most_s = about.given.get("tolerance_m"), longest_s(about.scenario)
    fastest = robot_of(about.scenario).get("max_linear")
    if not is_number(tolerance_m) or not is_number(fastest) or most_s is None:
        return
    if math.dist(start, goal) - 2 * tolerance_m > fastest * most_s:  # said elsewhere
        return
    for line in lines:
        away_m = min(_distance(goal, *ends) for ends in pairwise(line))
        is_apart = line[0] == line[-1] and _is_inside(start, line) != _is_inside(goal, line)
        if is_apart and away_m > tolerance_m:
            yield (*about.at, "goal"), f"walls are between the start, {pair(start)}, and {pair(goal)}"
            return
