"""Geometry that does not depend on examples: velocities add up exactly, right ways pass, wrong ones never do."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from grader.checks.support.geometry import (
    Command,
    Point,
    Pose,
    driven,
    followed,
    length_m,
    moved,
    off_m,
    relative,
)
from grader.model.verdict import Status, Verdict
from tests.checks.examples import judge_runs
from tests.support.timeline import build_runs

SPEED = st.floats(-3, 3)
TURN = st.floats(-7, 7)
TIME = st.floats(0.01, 3)
WHERE = st.builds(Pose, st.just(0.0), SPEED, SPEED, TURN)
COMMAND = st.builds(Command, st.just(0.0), SPEED, SPEED, TURN)
QUARTER = math.pi / 2
WAYS = st.lists(
    st.tuples(st.sampled_from([1.0, 1.5, 2.0]), st.sampled_from([QUARTER, -QUARTER])), min_size=1, max_size=6
)

Leg = tuple[float, float]


def euler(pose: Pose, command: Command, duration_s: float, steps: int = 4000) -> Pose:
    """Small steps, each at the heading of its middle."""
    step = duration_s / steps
    x, y = pose.x, pose.y
    for number in range(steps):
        heading = pose.heading + command.turn * step * (number + 0.5)
        x += step * (command.forward * math.cos(heading) - command.left * math.sin(heading))
        y += step * (command.forward * math.sin(heading) + command.left * math.cos(heading))
    return Pose(pose.time_s + duration_s, x, y, pose.heading + command.turn * duration_s)


@given(pose=WHERE, command=COMMAND, duration_s=TIME)
def test_arcs_are_what_small_steps_come_to(pose: Pose, command: Command, duration_s: float) -> None:
    assert moved(pose, command, duration_s) == pytest.approx(euler(pose, command, duration_s), abs=1e-3)


@given(pose=WHERE, command=COMMAND, duration_s=TIME, share=st.floats(0, 1))
def test_a_command_given_twice_leads_to_the_same_place(
    pose: Pose, command: Command, duration_s: float, share: float
) -> None:
    half = moved(pose, command, share * duration_s)
    assert moved(half, command, (1 - share) * duration_s) == pytest.approx(
        moved(pose, command, duration_s), abs=1e-9
    )


@given(turn=st.floats(0.1, 7), speed=st.floats(0.1, 3))
def test_a_full_turn_is_a_circle(turn: float, speed: float) -> None:
    path = driven([Command(5.0, speed, 0.0, turn)], None, 5.0 + 2 * math.pi / turn)
    assert path[-1].point == pytest.approx((0, 0), abs=1e-9)
    assert length_m(path) == pytest.approx(2 * math.pi * speed / turn, rel=0.02)


@given(commands=st.lists(COMMAND, max_size=6), hold_s=st.one_of(st.none(), TIME))
def test_a_path_is_as_long_as_its_commands_hold(commands: list[Command], hold_s: float | None) -> None:
    timed = [c._replace(time_s=float(number)) for number, c in enumerate(commands)]
    path = driven(timed, hold_s, float(len(timed)))
    held = [1.0 if hold_s is None else min(1.0, hold_s) for _ in timed]
    if hold_s is not None and held:
        held[-1] = hold_s
    longest = sum(c.speed * s for c, s in zip(timed, held, strict=True))
    assert length_m(path) <= longest + 1e-6
    assert [round(p.time_s, 9) for p in path] == sorted(round(p.time_s, 9) for p in path)


@given(pose=WHERE, others=st.lists(WHERE, min_size=1, max_size=5))
def test_seen_from_its_start_a_path_keeps_its_shape(pose: Pose, others: list[Pose]) -> None:
    seen = relative([pose, *others])
    assert seen[0].point == (0, 0)
    assert seen[0].heading == 0
    assert length_m(seen) == pytest.approx(length_m([pose, *others]), abs=1e-9)
    ahead = relative([pose, moved(pose, Command(0, 2.0, 1.0, 0.0), 1.0)])
    assert ahead[1].point == pytest.approx((2, 1), abs=1e-9)


@given(point=st.tuples(SPEED, SPEED), start=st.tuples(SPEED, SPEED), end=st.tuples(SPEED, SPEED))
def test_the_distance_from_a_line_is_the_least_of_all(point: Point, start: Point, end: Point) -> None:
    spots = [
        (start[0] + s / 50 * (end[0] - start[0]), start[1] + s / 50 * (end[1] - start[1])) for s in range(51)
    ]
    least = min(math.dist(point, spot) for spot in spots)
    assert off_m(point, start, end) <= least + 1e-9
    assert off_m(point, start, end) >= least - math.dist(start, end) / 50


def corners(way: list[Leg]) -> list[list[float]]:
    """The points of a way of straight lines and turns."""
    pose, points = Pose(0, 0, 0, 0), [[0.0, 0.0]]
    for length, turn in way:
        pose = moved(pose, Command(0, length, 0, 0), 1)._replace(heading=pose.heading + turn)
        points.append([pose.x, pose.y])
    return points


def twists(way: list[Leg], *, longer: float = 0.0) -> list[dict[str, Any]]:
    """Commands of a second each, the first line longer than it should be by `longer`."""
    sent: list[dict[str, Any]] = []
    for number, (length, turn) in enumerate(way):
        sent += [{"linear": {"x": length + (longer if number == 0 else 0.0)}}, {"angular": {"z": turn}}]
    return [*sent, {}]


def verdict(way: list[Leg], **changes: Any) -> Verdict:
    points = corners(way)
    topic = {
        "topic": "/cmd_vel",
        "type": "geometry_msgs/Twist",
        "rate_hz": 1,
        "values": twists(way, **changes),
    }
    runs = build_runs({"runs": {"run": {"topics": [topic]}}, "package": {}})
    return judge_runs("path", {"topic": "/cmd_vel", "points": points, "tolerance_m": 0.3}, runs)


@given(way=WAYS, longer=st.floats(-0.25, 0.25))
def test_a_way_within_the_tolerance_passes(way: list[Leg], longer: float) -> None:
    assert verdict(way, longer=longer).status is Status.PASS


@given(way=WAYS, longer=st.one_of(st.floats(0.35, 0.9), st.floats(-0.65, -0.35)))
def test_a_way_beyond_the_tolerance_fails_and_says_why(way: list[Leg], longer: float) -> None:
    found = verdict(way, longer=longer)
    assert found.status is Status.FAIL
    assert found.message
    assert found.hint
    assert not found.basis.unjudged


@given(way=WAYS)
def test_a_mirrored_way_never_passes(way: list[Leg]) -> None:
    assume(len(way) > 1)
    points = [[x, -y] for x, y in corners(way)]
    topic = {"topic": "/cmd_vel", "type": "geometry_msgs/Twist", "rate_hz": 1, "values": twists(way)}
    runs = build_runs({"runs": {"run": {"topics": [topic]}}, "package": {}})
    found = judge_runs("path", {"topic": "/cmd_vel", "points": points, "tolerance_m": 0.3}, runs)
    assert "mirrored" in found.message


@given(points=st.lists(st.tuples(SPEED, SPEED), min_size=2, max_size=5), tolerance_m=st.floats(0.01, 0.2))
def test_the_way_itself_is_followed_to_its_end(points: list[Point], tolerance_m: float) -> None:
    path = [
        Pose(0, a[0] + s / 200 * (b[0] - a[0]), a[1] + s / 200 * (b[1] - a[1]))
        for a, b in pairwise(points)
        for s in range(201)
    ]
    course = followed(path, points, tolerance_m)
    assert course.done
    assert course.reached == len(points)
    assert course.off_m <= 1e-9


def test_a_way_that_crosses_itself_is_followed_leg_by_leg() -> None:
    eight = [(0.0, 0.0), (2.0, 2.0), (2.0, 0.0), (0.0, 2.0)]
    path = [Pose(0, *p) for p in [(0, 0), (1, 1), (2, 2), (2, 1), (2, 0), (1, 1), (0, 2)]]
    assert followed(path, eight, 0.1).done
    assert followed(path[:3], eight, 0.1).reached == 2
    assert followed([*path[:2], Pose(0, 0, 2)], eight, 0.1).strayed == 2
    assert followed([], eight, 0.1).reached == 0
