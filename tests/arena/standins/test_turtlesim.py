"""The simulator beside a student's node, in two real runs: everything it offers, and a simulated clock."""

from __future__ import annotations

import json
from itertools import pairwise
from statistics import median
from typing import Any

import pytest

from grader.evidence.run import Run
from grader.rubric.scenario import Scenario, Start, Until
from tests.arena.support import exit_of, make_place, printed, run

pytestmark = pytest.mark.ros

MIDDLE_M = 5.544445
FOREST = (34, 139, 34)
LAUNCH = """<launch>
  <node name="turtlesim" pkg="turtlesim" type="turtlesim_node">
    <param name="background_r" value="34"/>
    <param name="background_g" value="139"/>
    <param name="background_b" value="34"/>
  </node>
  <node name="keys" pkg="turtlesim" type="turtle_teleop_key" output="screen"/>
</launch>
"""
NAMESPACE_LAUNCH = """<launch>
  <param name="background_r" value="34"/>
  <param name="background_g" value="139"/>
  <param name="background_b" value="34"/>
  <node name="sim" pkg="turtlesim" type="turtlesim_node"/>
</launch>
"""
COMMON = """
import json, rospy
from geometry_msgs.msg import Twist
from std_srvs.srv import Empty
from turtlesim.msg import Color, Pose
from turtlesim.srv import Kill, SetPen, Spawn, TeleportAbsolute, TeleportRelative

rospy.init_node("drive")
seen = {}
for name, type_ in (("pose", Pose), ("color_sensor", Color)):
    rospy.Subscriber("/turtle1/" + name, type_, lambda m, name=name: seen.__setitem__(name, m))
pub = rospy.Publisher("/turtle1/cmd_vel", Twist, queue_size=1)

def tell(step, *values):
    print(json.dumps([step, *values]), flush=True)

def pose():
    rospy.sleep(0.15)
    p = seen["pose"]
    return [p.x, p.y, p.theta, p.linear_velocity, p.angular_velocity]

def color():
    rospy.sleep(0.15)
    c = seen["color_sensor"]
    return [c.r, c.g, c.b]

def drive(seconds, forward, turning):
    twist = Twist()
    twist.linear.x, twist.angular.z = forward, turning
    rate, end = rospy.Rate(20), rospy.get_time() + seconds
    while rospy.get_time() < end:
        pub.publish(twist)
        rate.sleep()
    pub.publish(Twist())
    while seen["pose"].linear_velocity or seen["pose"].angular_velocity:
        rospy.sleep(0.02)

def call(service, type_, *args):
    rospy.wait_for_service(service, 5)
    try:
        return rospy.ServiceProxy(service, type_)(*args)
    except rospy.ServiceException as error:
        return "refused"

while len(seen) < 2 or not pub.get_num_connections():
    rospy.sleep(0.05)
"""
DRIVE = (
    COMMON
    + """
tell("start", pose(), color())
drive(1.0, 1.0, 0.0)
tell("ahead", pose(), color())
call("/turtle1/set_pen", SetPen, 255, 0, 10, 7, 0)
drive(0.5, -1.0, 0.0)
tell("pen", pose(), color())
call("/turtle1/set_pen", SetPen, 0, 0, 0, 0, 1)
call("/turtle1/teleport_absolute", TeleportAbsolute, 2.0, 3.0, 1.5)
tell("absolute", pose(), color())
call("/turtle1/teleport_relative", TeleportRelative, 1.0, -1.5)
tell("relative", pose())
drive(0.5, 0.0, 1.0)
tell("turned", pose())
names = [call("/spawn", Spawn, 1.0, 2.0, 0.5, name) for name in ("", "anna", "anna", "turtle1", "no name", "")]
tell("spawned", [getattr(n, "name", n) for n in names])
tell("killed", [str(call("/kill", Kill, name)) for name in ("anna", "anna")])
again = call("/spawn", Spawn, 4.0, 2.0, 0.5, "anna").name
tell("again", again, rospy.wait_for_message("/anna/pose", Pose, 5).x)
call("/turtle1/teleport_absolute", TeleportAbsolute, 10.9, 3.0, 0.0)
drive(0.4, 1.0, 0.0)
tell("wall", pose())
rospy.set_param("/turtlesim/background_r", 200)
before = color()
call("/clear", Empty)
tell("clear", before, color(), pose())
call("/turtle1/set_pen", SetPen, 0, 0, 0, 0, 1)
call("/reset", Empty)
tell("reset", pose(), sorted(t for t, _ in rospy.get_published_topics() if t.endswith("/pose")))
drive(0.3, 1.0, 0.0)
tell("after", pose(), color())
"""
)
WARPED = (
    COMMON
    + """
tell("start", color())
drive(2.0, 1.0, 0.0)
tell("ahead", pose())
drive(2.0, 0.0, 0.5)
tell("turned", pose())
"""
)


def _record(folder: Any, launch: str, script: str, clock: Any) -> Run:
    start = (
        Start(name="sim", launch="sim.launch"),
        Start(name="drive", script="scripts/drive.py", after="sim"),
    )
    scenario = Scenario(
        title="turtle", clock=clock, warp=4, start=start, until=Until(ended=("drive",), limit_s=40)
    )
    files = {"launch/sim.launch": launch, "scripts/drive.py": "#!/usr/bin/env python3\n" + script}
    with make_place(files) as place:
        return run(place, scenario, folder / "run.mcap")


def _told(recorded: Run) -> dict[str, list[Any]]:
    lines = [json.loads(line) for line in printed(recorded, "drive") if line.startswith('["')]
    return {step: values for step, *values in lines}


@pytest.fixture(scope="module")
def driven(tmp_path_factory: pytest.TempPathFactory) -> Run:
    return _record(tmp_path_factory.mktemp("driven"), LAUNCH, DRIVE, "real")


@pytest.fixture(scope="module")
def told(driven: Run) -> dict[str, list[Any]]:
    return _told(driven)


@pytest.mark.full
def test_it_all_ran(driven: Run, told: dict[str, list[Any]]) -> None:
    assert exit_of(driven, "drive").exit_code == 0, printed(driven, "drive")  # type: ignore[attr-defined]
    assert "after" in told


def test_pose_and_colour_come_at_62_5_hz(driven: Run) -> None:
    for name, type_ in (("pose", "turtlesim/Pose"), ("color_sensor", "turtlesim/Color")):
        (channel,) = driven.student_channels(f"/turtle1/{name}")
        assert channel.type == type_
        assert median(later - earlier for earlier, later in pairwise(channel.times_ns)) == pytest.approx(
            16e6, abs=1e6
        )


def test_it_moves_as_told(told: dict[str, list[Any]]) -> None:
    assert told["start"][0] == pytest.approx([MIDDLE_M, MIDDLE_M, 0, 0, 0], abs=1e-5)
    assert told["ahead"][0] == pytest.approx([MIDDLE_M + 1, MIDDLE_M, 0, 0, 0], abs=0.08)
    assert told["absolute"][0] == pytest.approx([2, 3, 1.5, 0, 0], abs=1e-5)
    assert told["relative"][0] == pytest.approx([3, 3, 0, 0, 0], abs=1e-5)
    assert told["turned"][0] == pytest.approx([3, 3, 0.5, 0, 0], abs=0.08)
    assert told["after"][0] == pytest.approx([MIDDLE_M + 0.3, MIDDLE_M, 0, 0, 0], abs=0.08)


def test_the_sensor_sees_background_and_pen(told: dict[str, list[Any]]) -> None:
    assert told["start"][1] == list(FOREST)
    assert told["pen"][1] == [255, 0, 10]
    assert told["absolute"][1] == list(FOREST)


def test_turtles_come_and_go(told: dict[str, list[Any]]) -> None:
    assert told["spawned"] == [["turtle2", "anna", "refused", "refused", "refused", "turtle3"]]
    assert told["killed"] == [["", "refused"]]
    assert told["again"] == ["anna", 4.0]


def test_the_wall_is_warned_of(driven: Run, told: dict[str, list[Any]]) -> None:
    assert told["wall"][0][0] == pytest.approx(11.0889, abs=1e-3)
    lines = [line.line for _, line in driven.console if "Oh no! I hit the wall!" in line.line]
    assert lines
    assert all("[WARN]" in line and "Clamping from [x=11." in line for line in lines)


def test_clear_reads_the_background_again_and_reset_begins_anew(told: dict[str, list[Any]]) -> None:
    before, after, pose = told["clear"]
    assert (before, after) == (list(FOREST), [200, 139, 34])
    assert pose[1] == pytest.approx(3.0, abs=1e-4)
    assert told["reset"][0] == pytest.approx([MIDDLE_M, MIDDLE_M, 0, 0, 0], abs=1e-5)
    assert told["reset"][1] == ["/turtle1/pose"]


def test_services_say_their_types(driven: Run) -> None:
    types = [event.service_types for _, event in driven.graph if event.service_types][-1]
    assert {
        name: type_ for name, type_ in types.items() if name.startswith(("/turtle1", "/spawn", "/clear"))
    } == {
        "/clear": "std_srvs/Empty",
        "/spawn": "turtlesim/Spawn",
        "/turtle1/set_pen": "turtlesim/SetPen",
        "/turtle1/teleport_absolute": "turtlesim/TeleportAbsolute",
        "/turtle1/teleport_relative": "turtlesim/TeleportRelative",
    }


def test_keys_stay_up_without_a_terminal_and_end_on_ctrl_c(driven: Run) -> None:
    assert any("/keys" in event.nodes for _, event in driven.graph)
    assert "/keys" in driven.graph[-2][1].nodes or "/keys" in driven.graph[-3][1].nodes
    assert any("There is no keyboard" in line for line in printed(driven, "sim"))
    assert exit_of(driven, "sim").stopped_by == "INT"  # type: ignore[attr-defined]
    assert not any("escalating" in line for line in printed(driven, "sim"))


def test_it_costs_little(driven: Run) -> None:
    exit_event = exit_of(driven, "sim")
    seconds = (driven.end_ns - driven.start_ns) / 1e9
    assert exit_event.cpu_s < 2.5 + 0.15 * seconds  # type: ignore[attr-defined]


def test_a_simulated_clock_is_followed(tmp_path_factory: pytest.TempPathFactory) -> None:
    recorded = _record(tmp_path_factory.mktemp("warped"), NAMESPACE_LAUNCH, WARPED, "warped")
    told = _told(recorded)
    assert told["start"][0] == list(FOREST)
    assert told["ahead"][0] == pytest.approx([MIDDLE_M + 2, MIDDLE_M, 0, 0, 0], abs=0.3)
    assert told["turned"][0][2] == pytest.approx(1.0, abs=0.15)
    (channel,) = recorded.student_channels("/turtle1/pose")
    seconds = (channel.times_ns[-1] - channel.times_ns[0]) / 1e9
    assert len(channel.times_ns) / seconds > 150
