"""Nothing that a publisher sends is missed, from its very first message on."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.arena.support import run_script

pytestmark = pytest.mark.ros

BEFORE = """
import rospy
from std_msgs.msg import Int8
pub = rospy.Publisher("/count", Int8, queue_size=100)
rospy.init_node("counter")
"""
AFTER = """
import rospy
from std_msgs.msg import Int8
rospy.init_node("counter")
pub = rospy.Publisher("/count", Int8, queue_size=100)
"""
UNTIMED = """
import rospy
from std_msgs.msg import Int8
pub = rospy.Publisher("/count", Int8, queue_size=100)
rospy.init_node("counter", disable_rostime=True, disable_rosout=True)
"""
AT_ONCE = """
for n in range(20):
    pub.publish(n)
rospy.spin()
"""


@pytest.mark.full
@pytest.mark.parametrize("start", [BEFORE, AFTER, UNTIMED], ids=["before", "after", "untimed"])
@pytest.mark.parametrize("attempt", range(3))
def test_first_value_is_recorded(tmp_path: Path, start: str, attempt: int) -> None:
    run = run_script(tmp_path, start + AT_ONCE, messages={"/count": 20}, silent_s=2)
    (channel,) = run.student_channels("/count")
    assert channel.data == tuple(range(20))
    assert run.outcome is not None
    assert run.outcome.outcome == "complete"


def test_publishers_that_come_later_are_recorded_from_their_first_message(tmp_path: Path) -> None:
    code = """
import rospy
from std_msgs.msg import String
rospy.init_node("many")
pubs = []
for n in range(8):
    pubs.append(rospy.Publisher("/topic%d" % n, String, queue_size=1))
    pubs[-1].publish("first of %d" % n)
rospy.spin()
"""
    run = run_script(tmp_path, code, messages={f"/topic{n}": 1 for n in range(8)}, silent_s=2)
    for n in range(8):
        (channel,) = run.student_channels(f"/topic{n}")
        assert channel.data == (f"first of {n}",)


def test_channel_says_who_sent_what(tmp_path: Path) -> None:
    run = run_script(tmp_path, AFTER + AT_ONCE, messages={"/count": 20}, silent_s=2)
    (channel,) = run.student_channels("/count")
    assert (channel.callerid, channel.type) == ("/counter", "std_msgs/Int8")
    assert channel.md5sum == "27ffa0c9c4b8fb8492252bcad9e5c57b"
    assert channel.definition.strip() == "int8 data"
