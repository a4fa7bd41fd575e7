"""The way that a robot took, seen as its points are."""

from __future__ import annotations

from typing import Any

import pytest

from grader.model.figure import POINTS_MAX, PathFigure, PlaceFigure
from tests.report.figures.made import criterion, drawn, only

SQUARE = criterion("path", topic="/pose", points=[[1, 0], [1, 1]], tolerance_m=0.2)


def poses(*points: tuple[float, float], rate_hz: float = 10) -> dict[str, Any]:
    values = [{"x": x, "y": y, "theta": 0.0} for x, y in points]
    return {
        "topics": [{"topic": "/pose", "type": "geometry_msgs/Pose2D", "values": values, "rate_hz": rate_hz}]
    }


def line(start: tuple[float, float], end: tuple[float, float], count: int) -> list[tuple[float, float]]:
    shares = [number / count for number in range(count)]
    return [(start[0] + (end[0] - start[0]) * s, start[1] + (end[1] - start[1]) * s) for s in shares]


def test_a_right_way_seen_from_its_start() -> None:
    way = [*line((5, 5), (6, 5), 10), *line((6, 5), (6, 6), 10), (6, 6)]
    figures, results = drawn(poses(*way), SQUARE)
    figure = only(figures, "path", PathFigure)
    assert results["path"].status.value == "pass"
    assert figure.corners == ((0, 0), (1, 0), (1, 1))
    assert (figure.points[0], figure.points[-1]) == ((0, 0), (1, 1))
    assert (figure.reached, figure.strayed, figure.messages) == (3, None, 21)
    assert figure.tolerance_m == pytest.approx(0.2)


@pytest.mark.full
def test_the_first_point_that_strays_stays_of_many() -> None:
    way = [*line((0, 0), (1, 0), 3000), *line((1, 0), (3, 0), 3000)]
    figures, results = drawn(poses(*way, rate_hz=100), SQUARE)
    figure = only(figures, "path", PathFigure)
    assert results["path"].status.value == "fail"
    assert len(figure.points) <= POINTS_MAX
    assert figure.strayed is not None
    assert figure.points[figure.strayed] == pytest.approx((1.2, 0), abs=2e-3)
    assert figure.reached == 2


@pytest.mark.full
def test_a_robot_that_waits_long_is_shown_where_it_moves() -> None:
    way = [(0.0, 0.0)] * 4000 + line((0, 0), (1, 0), 200) + line((1, 0), (1, 1), 200) + [(1.0, 1.0)] * 4000
    figures, _ = drawn(poses(*way, rate_hz=100), SQUARE)
    figure = only(figures, "path", PathFigure)
    assert len(set(figure.points)) >= 390


def test_no_way_no_figure() -> None:
    assert drawn({}, SQUARE)[0].by_criterion == {}
    assert drawn({"topics": [{"topic": "/pose"}]}, SQUARE)[0].by_criterion == {}


WALLS = {
    "topic": "/robot_world/walls",
    "type": "visualization_msgs/Marker",
    "callerid": "/robot_world",
    "values": [{"type": 5, "points": [{}, {"x": 4.0}]}],
}
WORLD = {"name": "world", "role": "grader", "nodes": ["/robot_world"], "exit_s": 9}


def test_a_goal_that_is_missed_is_drawn_on_the_map() -> None:
    asked = criterion("ends-at", topic="/pose", goal=[2, 0], tolerance_m=0.1)
    run = poses(*line((0, 1), (1, 1), 10), (1, 1))
    run["topics"].append(WALLS)
    figures, results = drawn({**run, "processes": [WORLD]}, asked)
    figure = only(figures, "ends-at", PlaceFigure)
    assert results["ends-at"].status.value == "fail"
    assert (figure.goal, figure.tolerance_m) == ((2, 0), 0.1)
    assert figure.points[figure.wrong or 0] == (1, 1)
    assert figure.walls == (((0, 0), (4, 0)),)
    assert figure.says == "It ends at (1, 1), which is not within 0.1 m of (2, 0)."


def test_where_a_region_is_left_is_marked() -> None:
    asked = criterion("stays-within", topic="/pose", box=[[0, -1], [2, 1]])
    figures, results = drawn(poses((0, 0), (1, 0), (3, 0), (2.5, 0), (1, 0)), asked)
    figure = only(figures, "stays-within", PlaceFigure)
    assert results["stays-within"].status.value == "fail"
    assert figure.area == ((0, -1), (2, -1), (2, 1), (0, 1))
    assert figure.wrong is not None
    assert figure.points[figure.wrong] == (3, 0)
    assert figure.says.endswith("it is 1.00 m outside at (3, 0).")


@pytest.mark.parametrize(
    ("bound", "words"), [("min_m", "0.50 m too near at (2, 0)"), ("max_m", "0.50 m too far at (1, 0)")]
)
def test_the_distance_from_a_wall_is_said_as_such(bound: str, words: str) -> None:
    wall = [[2, -1], [2, 1]] if bound == "min_m" else [[2.5, -1], [2.5, 1]]
    asked = criterion("stays-within", topic="/pose", walls=[wall], **{bound: 0.5 if bound == "min_m" else 1})
    figures, _ = drawn(poses((1, 0), (1.25, 0), (2, 0)), asked)
    assert only(figures, "stays-within", PlaceFigure).says.endswith(f"it is {words}.")


def test_a_path_that_is_right_has_no_mark() -> None:
    asked = criterion("stays-within", topic="/pose", walls=[[[0, 0], [4, 0]]], min_m=0.5, max_m=2)
    figures, _ = drawn(poses((0, 1), (1, 1)), asked)
    figure = only(figures, "stays-within", PlaceFigure)
    assert (figure.wrong, figure.walls) == (None, (((0, 0), (4, 0)),))
