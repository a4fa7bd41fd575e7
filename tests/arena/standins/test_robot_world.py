"""The robot world: its walls, the robot, its laser, and one real run."""

from __future__ import annotations

import importlib
import math
import random
import sys
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
import yaml

from grader.arena.sandbox_files import STANDIN_SOURCES
from grader.checks.support.geometry import shown_walls
from grader.rubric.scenario import Scenario, Start, Step, Wait
from tests.arena.support import make_place, run

ROOM = [[[0, 0], [6, 0], [6, 4], [0, 4], [0, 0]]]
BOXES = [[1, 1, 1.3, 1.3], [2.5, 2, 3, 2.2], [4, 0, 4.5, 0.5]]
CORRIDOR = [[[0, 0], [1, 0], [1, 1.5], [0, 1.5]]]
MAP = {
    "image": "map.pgm",
    "resolution": 0.5,
    "origin": [-1.0, 0.0, 0.0],
    "occupied_thresh": 0.65,
    "negate": 0,
}


@pytest.fixture(scope="module")
def world() -> Iterator[ModuleType]:
    folder = str(STANDIN_SOURCES / "robot_world")
    sys.path.insert(0, folder)
    yield importlib.import_module("world")
    sys.path.remove(folder)


def test_walls_are_lines_and_boxes(world) -> None:
    walls = world.walls_of([[[0, 0], [1, 0], [1, 2]]], [[3, 4, 5, 6]])
    assert walls[:2] == [((0, 0), (1, 0)), ((1, 0), (1, 2))]
    assert {point for wall in walls[2:] for point in wall} == {(3, 4), (5, 4), (5, 6), (3, 6)}


@pytest.mark.parametrize(
    ("lines", "boxes"),
    [
        ("none", []), ([[0, 0], [1, 1]], []), ([[[0, 0, 1], [1, 1]]], []), ([], [[1, 2, 3]]),
        ([[[0, math.nan], [1, 1]]], []), ([[[0, True], [1, 1]]], []), ([[[i, i] for i in range(6000)]], []),
    ],
)  # fmt: skip
def test_what_is_no_wall_is_refused(world, lines: Any, boxes: Any) -> None:
    with pytest.raises(ValueError, match=r"list|number|walls"):
        world.walls_of(lines, boxes)


@pytest.mark.parametrize(
    "picture",
    [
        b"P2\n# a map\n4 3\n255\n0 0 0 0\n0 254 254 0\n0 0 0 0\n",
        b"P5 4 3 255\n" + bytes([0] * 5 + [254] * 2 + [0] * 5),
    ],
)
def test_a_map_is_the_border_of_what_is_occupied(world, tmp_path: Path, picture: bytes) -> None:
    (tmp_path / "map.pgm").write_bytes(picture)
    (tmp_path / "map.yaml").write_text(yaml.safe_dump(MAP))
    walls = world.read_plan(tmp_path / "map.yaml", yaml.safe_load)
    sides = {frozenset(wall) for wall in walls}
    outer, inner = [(-1, 0), (1, 0), (1, 1.5), (-1, 1.5)], [(-0.5, 0.5), (0.5, 0.5), (0.5, 1), (-0.5, 1)]
    assert sides == {frozenset((c[i - 1], c[i])) for c in (outer, inner) for i in range(4)}


@pytest.mark.parametrize(
    "picture", [b"", b"P6 1 1 255\n000", b"P5 4 3 255\n0", b"P5 9999 9999 255\n0", b"P5 a 3 255\n"]
)
def test_what_is_no_map_is_refused(world, picture: bytes) -> None:
    with pytest.raises(ValueError):  # noqa: PT011 - int()'s own words among them
        world.read_pgm(picture)


def drive(robot: Any, seconds: float) -> None:
    for _ in range(round(seconds * 100)):
        robot.step()


def test_the_robot_drives_arcs_within_its_limits(world) -> None:
    one = world.Robot([], 0.1, (1.0, 2.0, 0.0), (0.22, 2.84))
    one.command(5.0, 0.22)
    drive(one, math.pi / 0.22)
    assert (one.x, one.y) == (pytest.approx(1, abs=0.01), pytest.approx(4, abs=0.01))
    assert abs(one.theta) == pytest.approx(math.pi, abs=0.01)
    with pytest.raises(ValueError, match="finite"):
        one.command(math.nan, 0.0)


def test_a_velocity_that_times_out(world) -> None:
    one = world.Robot([], 0.1, (0.0, 0.0, 0.0), timeout_s=0.5)
    one.command(1.0, 0.0)
    drive(one, 2)
    assert one.x == pytest.approx(0.5)
    assert one.forward == 0


def test_a_wall_stops_the_robot_until_it_drives_away(world) -> None:
    one = world.Robot(world.walls_of([[[1, -1], [1, 1]]], []), 0.1, (0.0, 0.0, 0.0))
    one.command(0.2, 0.0)
    drive(one, 10)
    assert one.hits
    assert one.x == pytest.approx(0.9, abs=0.003)
    one.command(0.0, math.pi)
    drive(one, 1)
    assert not one.hits
    one.command(0.2, 0.0)
    drive(one, 2)
    assert one.x == pytest.approx(0.5, abs=0.01)


def test_the_laser_sees_what_each_ray_meets_first(world) -> None:
    walls = world.walls_of(ROOM, BOXES)
    chance = random.Random(1)  # noqa: S311 - places, the same each time
    for low, high, samples in ((0.0, math.tau, 360), (-2.356, 2.356, 271), (-math.pi, math.pi, 100)):
        laser = world.Laser(walls, (low, high, samples), (0.12, 3.5))
        for _ in range(10):
            place = (chance.uniform(0.05, 5.95), chance.uniform(0.05, 3.95), chance.uniform(-4, 4))
            seen = laser.scan(*place)
            wanted = [_first(walls, *place[:2], place[2] + low + i * laser.increment) for i in range(samples)]
            assert seen == pytest.approx(
                [math.inf if w > 3.5 else -math.inf if w < 0.12 else w for w in wanted]
            )


def _first(walls: Any, x: float, y: float, angle: float) -> float:
    """The nearest wall on a ray, one wall after the other."""
    c, s = math.cos(angle), math.sin(angle)
    found = math.inf
    for (x0, y0), (x1, y1) in walls:
        dx, dy = x1 - x0, y1 - y0
        slant = c * dy - s * dx
        if abs(slant) > 1e-12:
            far, along = ((x0 - x) * dy - (y0 - y) * dx) / slant, ((x0 - x) * s - (y0 - y) * c) / slant
            if far > 0 and -1e-9 <= along <= 1 + 1e-9:
                found = min(found, far)
    return found


def test_noise_is_the_same_for_the_same_seed(world) -> None:
    walls = world.walls_of(ROOM, [])
    plain = world.Laser(walls, (0.0, 6.0, 60), (0.1, 10.0)).scan(1, 1, 0)
    laser = [((0.0, 6.0, 60), (0.1, 10.0), 0.01, random.Random(7)) for _ in range(2)]  # noqa: S311 - noise
    first, again = (world.Laser(walls, *one).scan(1, 1, 0) for one in laser)
    assert first == again != plain
    assert first == pytest.approx(plain, abs=0.06)


NODE = """#!/usr/bin/env python3
import rospy
from geometry_msgs.msg import Twist
rospy.init_node("drive")
pub, rate = rospy.Publisher("/cmd_vel", Twist, queue_size=1), rospy.Rate(10)
twist = Twist()
twist.linear.x = 0.5
while not rospy.is_shutdown():
    pub.publish(twist)
    try:
        rate.sleep()
    except rospy.ROSInterruptException:
        pass
"""


@pytest.mark.ros
def test_a_world_as_stages_on_a_fast_clock(tmp_path: Path) -> None:
    """The robot runs into the end of a corridor."""
    params = {
        "robot": "stage",
        "walls": CORRIDOR,
        "start": [0.0, 0.75, 0.0],
    }
    scenario = Scenario(
        title="t",
        clock="warped",
        warp=10,
        params=tuple({"name": f"/robot_world/{key}", "value": value} for key, value in params.items()),
        start=(
            Start(name="world", program="robot_world/robot_world"),
            Start(name="drive", script="scripts/drive.py", after="world"),
        ),
        steps=(Step(wait=Wait(topic="/cmd_vel")), Step(wait=Wait(seconds=8))),
    )
    with make_place({"scripts/drive.py": NODE}) as place:
        seen = run(place, scenario, tmp_path / "run.mcap")
    of = {c.topic: c.values for c in seen.channels if c.callerid == "/robot_world"}
    assert not {"/base_scan", "/odom", "/base_pose_ground_truth", "/collision", "/tf", "/tf_static"} - set(of)
    end, truth = of["/odom"][-1], of["/base_pose_ground_truth"][-1]
    assert (end["header"]["frame_id"], end["child_frame_id"]) == ("odom", "base_footprint")
    assert end["pose"]["pose"]["position"]["x"] == pytest.approx(0.82, abs=0.01)
    assert 0 < abs(of["/odom"][0]["pose"]["pose"]["orientation"]["z"]) < 1e-3  # as in Gazebo, never exactly 0
    assert truth["pose"]["pose"]["position"] == pytest.approx({"x": 0.82, "y": 0.75, "z": 0}, abs=0.01)
    assert [value["data"] for value in of["/collision"]] == [False, True]
    scan = of["/base_scan"][-1]
    assert (len(scan["ranges"]), scan["header"]["frame_id"]) == (271, "base_laser_link")
    assert scan["ranges"][135] == pytest.approx(0.13, abs=0.01)
    stamps = [v["header"]["stamp"]["secs"] + v["header"]["stamp"]["nsecs"] / 1e9 for v in of["/base_scan"]]
    assert {round(b - a, 3) for a, b in pairwise(stamps)} == {0.1}
    assert shown_walls(seen) == (((0, 0), (1, 0)), ((1, 0), (1, 1.5)), ((1, 1.5), (0, 1.5)))
