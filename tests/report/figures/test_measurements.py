"""The way that a robot took, and the rate of messages, as they are drawn."""

from __future__ import annotations

from typing import Any

import pytest

from grader.model.figure import POINTS_MAX, PathFigure, PlaceFigure, RateFigure
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


RATE = criterion("rate", topic="/chatter", rate_hz=10)
CHATTER = {"topic": "/chatter", "count": 61}


def test_several_publishers_are_shown_together_and_each() -> None:
    other = {**CHATTER, "callerid": "/other", "start_s": 0.55}
    figures, _ = drawn({"topics": [CHATTER, other]}, RATE)
    found = [f for f in figures.by_criterion["rate"] if isinstance(f, RateFigure)]
    assert [f.publisher for f in found] == ["/talker and /other", "/talker", "/other"]
    assert [f.messages for f in found] == [122, 61, 61]
    assert found[0].mean_hz == pytest.approx(20, abs=0.2)
    assert [f.mean_hz for f in found[1:]] == pytest.approx([10, 10], abs=0.01)


def test_only_three_of_many_publishers_are_shown_alone() -> None:
    topics = [{**CHATTER, "callerid": f"/talker{i}"} for i in range(9)]
    figures, _ = drawn({"topics": topics}, RATE)
    assert len(figures.by_criterion["rate"]) == 4


def test_late_stretches_lie_where_the_machine_was_late() -> None:
    host = [{"at_s": 2}, {"at_s": 3, "mean_ms": 6, "p95_ms": 30, "max_ms": 120}, {"at_s": 7}]
    figures, _ = drawn({"topics": [CHATTER], "host": host}, RATE)
    ((begin_s, end_s),) = only(figures, "rate", RateFigure).late
    assert begin_s == pytest.approx(2, abs=0.51)
    assert end_s == pytest.approx(3, abs=0.51)


def test_a_punctual_machine_has_no_late_stretches() -> None:
    figures, _ = drawn({"topics": [CHATTER], "host": [{"at_s": at} for at in range(1, 8)]}, RATE)
    assert only(figures, "rate", RateFigure).late == ()


def test_silence_at_the_end_is_the_last_gap() -> None:
    figures, _ = drawn(
        {
            "topics": [{**CHATTER, "count": 40}],
            "processes": [{"name": "talker", "stopped_by": "INT", "exit_code": 0, "exit_s": 11}],
            "actors": [{"action": "interrupt", "actor": "grader", "detail": "talker", "at_s": 10.5}],
            "outcome": "silent",
        },
        RATE,
    )
    figure = only(figures, "rate", RateFigure)
    assert figure.ends_silent
    assert figure.times_s[-1] == pytest.approx(10.5)
    assert figure.gaps_s[-1] == pytest.approx(6.1)


@pytest.mark.full
def test_of_a_flood_the_longest_and_the_shortest_gap_stay() -> None:
    flood = {
        "topic": "/chatter",
        "count": 20_000,
        "rate_hz": 400,
        "gaps": [{"before": 11_234, "pause_s": 3}],
    }
    figures, _ = drawn({"topics": [flood], "end_s": 60}, RATE)
    figure = only(figures, "rate", RateFigure)
    assert len(figure.times_s) == len(figure.gaps_s) <= POINTS_MAX
    assert len(figure.times_s) > POINTS_MAX / 2
    assert figure.messages == 20_000
    assert max(figure.gaps_s) == pytest.approx(3.0025, abs=1e-4)
    assert figure.times_s[-1] == pytest.approx(53.5, abs=0.1)


@pytest.mark.full
def test_a_choice_of_points_keeps_the_share_of_short_gaps() -> None:
    """Ten messages in each burst: nine gaps in ten are short, and no rhythm of the choice meets that of the bursts."""
    figures, _ = drawn({"topics": [{"topic": "/chatter", "count": 20_000, "burst": 10}], "end_s": 2001}, RATE)
    figure = only(figures, "rate", RateFigure)
    short = sum(gap < 0.05 for gap in figure.gaps_s) / len(figure.gaps_s)
    assert short == pytest.approx(0.9, abs=0.07)


@pytest.mark.parametrize(
    "run",
    [
        {},
        {"topics": [{"topic": "/chatter", "count": 1}]},
        {"topics": [CHATTER], "clock": "warped", "warp": 20},
        {"topics": [CHATTER], "outcome": None},
        {"topics": [CHATTER], "outcome": "host"},
    ],
)
def test_nothing_is_drawn_where_no_rate_is_judged(run: dict[str, object]) -> None:
    figures, _ = drawn(run, RATE)
    assert "rate" not in figures.by_criterion


def test_a_flood_is_counted_by_tenths_of_a_second() -> None:
    figures, _ = drawn({"topics": [{"topic": "/chatter", "count": 2001, "rate_hz": 1000}]}, RATE)
    figure = only(figures, "rate", RateFigure)
    assert len(figure.counts) == 19
    assert set(figure.counts) <= {99, 100, 101}
    assert sum(figure.counts) <= figure.messages == 2001


def test_no_other_rate_is_counted() -> None:
    figures, _ = drawn({"topics": [CHATTER]}, RATE)
    assert only(figures, "rate", RateFigure).counts == ()


def test_a_lost_rate_says_nothing_of_a_late_machine() -> None:
    host = [{"at_s": 2}, {"at_s": 3, "mean_ms": 6, "p95_ms": 30, "max_ms": 120}, {"at_s": 7}]
    figures, results = drawn({"topics": [{**CHATTER, "count": 3000, "rate_hz": 500}], "host": host}, RATE)
    assert results["rate"].status.is_lost
    assert only(figures, "rate", RateFigure).late == ()
