"""The smaller programs of turtlesim, each beside the simulator: keys on a terminal, a square, and a mimic."""

from __future__ import annotations

from bisect import bisect
from itertools import pairwise
from statistics import median

import pytest

from grader.evidence.run import Run
from grader.rubric.scenario import Scenario, Start, Until
from tests.arena.support import exit_of, make_place, printed, run

pytestmark = pytest.mark.ros

LAUNCH = """<launch>
  <group ns="one"><node name="sim" pkg="turtlesim" type="turtlesim_node"/></group>
  <group ns="two"><node name="sim" pkg="turtlesim" type="turtlesim_node"/></group>
  <node name="mimic" pkg="turtlesim" type="mimic">
    <remap from="input" to="one/turtle1"/>
    <remap from="output" to="two/turtle1"/>
  </node>
  <node name="square" pkg="turtlesim" type="draw_square" ns="one" output="screen"/>
</launch>
"""
TYPIST = """
import os, pty, select, sys, time
pid, terminal = pty.fork()
if pid == 0:
    os.execvp("rosrun", ["rosrun", "turtlesim", "turtle_teleop_key"])
seen = b""
while b"'q' to quit" not in seen:
    seen += os.read(terminal, 1000)
import rospy
from geometry_msgs.msg import Twist
rospy.init_node("typist")
heard = []
listener = rospy.Subscriber("/turtle1/cmd_vel", Twist, lambda t: heard.append((t.linear.x, t.angular.z)))
while not listener.get_num_connections():
    rospy.sleep(0.05)
rospy.sleep(0.3)
for key in (b"\\x1b[A", b"x", b"\\x1b[B", b"\\x1b[C", b"\\x1bOD"):
    os.write(terminal, key)
    rospy.sleep(0.1)
os.write(terminal, b"q")
_, status = os.waitpid(pid, 0)
print("heard", heard, "status", status)
"""


@pytest.fixture(scope="module")
def launched(tmp_path_factory: pytest.TempPathFactory) -> Run:
    start = (
        Start(name="all", launch="all.launch"),
        Start(name="typist", script="scripts/typist.py"),
    )
    until = Until(window_s=5, topics=("/one/turtle1/pose", "/two/turtle1/pose"), ended=("typist",))
    scenario = Scenario(title="programs", start=start, until=until)
    files = {"launch/all.launch": LAUNCH, "scripts/typist.py": "#!/usr/bin/env python3\n" + TYPIST}
    with make_place(files) as place:
        return run(place, scenario, tmp_path_factory.mktemp("programs") / "run.mcap")


def test_arrow_keys_become_commands_and_q_ends_it(launched: Run) -> None:
    assert exit_of(launched, "typist").exit_code == 0  # type: ignore[attr-defined]
    commands = [(2.0, 0.0), (-2.0, 0.0), (0.0, -2.0), (0.0, 2.0)]
    assert printed(launched, "typist")[-1] == f"heard {commands} status 0"


def test_a_square_is_begun_and_followed(launched: Run) -> None:
    (copied,) = launched.student_channels("/two/turtle1/cmd_vel")
    ways = {}
    for name in ("one", "two"):
        (channel,) = launched.student_channels(f"/{name}/turtle1/pose")
        assert median(b - a for a, b in pairwise(channel.times_ns)) == pytest.approx(16e6, abs=1e6)
        # on a busy machine, turtle one may be on its way before the other is told of it
        first = channel.values[bisect(channel.times_ns, copied.times_ns[0])]
        last = channel.values[-1]
        ways[name] = (last["x"] - first["x"], last["theta"] - first["theta"])
        if name == "one":
            assert (last["x"], first["theta"]) == (pytest.approx(5.544 + 2.0, abs=0.15), 0.0)
            assert last["theta"] > 0.3
    assert ways["two"] == pytest.approx(ways["one"], abs=0.2)
    assert any("Reached goal" in line for line in printed(launched, "all"))
