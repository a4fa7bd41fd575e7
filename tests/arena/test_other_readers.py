"""The evidence of a real run, seen by programs that are not ours."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest
from mcap.reader import make_reader
from mcap_ros1.decoder import DecoderFactory

from grader.evidence.inspect import inspect_file
from grader.rubric.scenario import Scenario, Start, Until
from tests.arena.support import SCRIPT, make_place, printed, run

pytestmark = pytest.mark.ros

TALKER = """
import rospy
from geometry_msgs.msg import Twist
from std_msgs.msg import Int8, String
rospy.init_node("talker")
pubs = [rospy.Publisher("/count", Int8, queue_size=10), rospy.Publisher("/text", String, queue_size=10)]
drive = rospy.Publisher("/cmd_vel", Twist, queue_size=10, latch=True)
drive.publish(Twist())
rate = rospy.Rate(10)
n = 0
while not rospy.is_shutdown():
    pubs[0].publish(n)
    pubs[1].publish("n is %d" % n)
    rospy.loginfo("said %d", n)
    n = (n + 1) % 128
    rate.sleep()
"""
HZ = "import os\nos.execvp('rostopic', ['rostopic', 'hz', '/count'])\n"


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[str]]:
    """A talker with `rostopic hz` beside it for eight seconds: the evidence, and what `rostopic hz` printed."""
    path = tmp_path_factory.mktemp("readers") / "run.mcap"
    scenario = Scenario(
        title="two readers",
        start=(Start(name="talker", script="src/talker.py"), Start(name="hz", script="src/hz.py")),
        until=Until(window_s=8, topics=("/count",)),
    )
    with make_place({"src/talker.py": SCRIPT + TALKER, "src/hz.py": SCRIPT + HZ}) as place:
        seen = run(place, scenario, path)
    return path, printed(seen, "hz")


def test_inspect_agrees_with_rostopic_hz(recorded: tuple[Path, list[str]]) -> None:
    path, lines = recorded
    rates = [float(found.group(1)) for line in lines if (found := re.search(r"average rate: ([\d.]+)", line))]
    ours = next(t for t in inspect_file(path).channels if t.topic == "/count")
    assert rates
    assert ours.rate.mean_hz == pytest.approx(rates[-1], rel=0.005)


def test_every_ros_channel_decodes_elsewhere(recorded: tuple[Path, list[str]]) -> None:
    path, _ = recorded
    topics = set()
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        summary = reader.get_summary()
        assert summary is not None
        ros = {c.id: c for c in summary.channels.values() if c.message_encoding == "ros1"}
        for schema, channel, _, message in reader.iter_decoded_messages(
            topics={c.topic for c in ros.values()}
        ):
            topics.add(channel.topic)
            assert schema.encoding == "ros1msg"
            assert channel.metadata["callerid"].startswith("/")
            assert message is not None
    assert {"/count", "/text", "/cmd_vel", "/rosout"} <= topics
    assert topics == {c.topic for c in ros.values()}


def test_md5sums_are_those_of_ros(recorded: tuple[Path, list[str]]) -> None:
    path, _ = recorded
    with path.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    for channel in summary.channels.values():
        if channel.message_encoding == "ros1":
            name = summary.schemas[channel.schema_id].name
            done = subprocess.run(
                ["/usr/bin/rosmsg", "md5", name], capture_output=True, text=True, check=True
            )
            assert channel.metadata["md5sum"] == done.stdout.strip(), name


def test_latching_and_caller_are_noted(recorded: tuple[Path, list[str]]) -> None:
    path, _ = recorded
    with path.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    drive = next(c for c in summary.channels.values() if c.topic == "/cmd_vel")
    assert (drive.metadata["callerid"], drive.metadata["latching"]) == ("/talker", "1")
