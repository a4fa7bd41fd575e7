"""Real-time and warped clocks, late starters, and nodes that do not follow the clock."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.arena.support import exit_of, run_script

pytestmark = pytest.mark.ros

COUNTER = """
import rospy, time
from std_msgs.msg import Int8
pub = rospy.Publisher("/count", Int8, queue_size=10)
rospy.init_node("counter")
n = 0
{prepare}
while not rospy.is_shutdown():
    pub.publish(n)
    n = (n + 1) % 128
    {sleep}
"""


def _values(run: object) -> list[int]:
    (channel,) = run.student_channels("/count")  # type: ignore[attr-defined]
    return list(channel.data)


def test_two_wraps_pass_in_seconds_and_none_is_lost(tmp_path: Path) -> None:
    code = COUNTER.format(prepare="rate = rospy.Rate(10)", sleep="rate.sleep()")
    run = run_script(tmp_path, code, clock="warped", messages={"/count": 258}, limit_s=40)
    assert _values(run)[:258] == [n % 128 for n in range(258)]
    times = run.student_channels("/count")[0].times_ns
    assert (times[257] - times[0]) / 1e9 < 257 / 10 / 2
    assert run.clock == "warped"


def test_timer_follows_the_warped_clock(tmp_path: Path) -> None:
    code = """
import rospy
from std_msgs.msg import Int8
rospy.init_node("counter")
pub = rospy.Publisher("/count", Int8, queue_size=10)
state = {"n": 0}
def tick(_):
    pub.publish(state["n"])
    state["n"] = (state["n"] + 1) % 128
rospy.Timer(rospy.Duration(0.1), tick)
rospy.spin()
"""
    run = run_script(tmp_path, code, clock="warped", messages={"/count": 140}, limit_s=40)
    assert _values(run)[:140] == [n % 128 for n in range(140)]


def test_a_node_that_looks_at_the_clock_at_once_finds_no_time_gone(tmp_path: Path) -> None:
    """Until the first message on /clock, rospy's time is 0: what comes next may not be the time of day."""
    now = "rospy.Time.now().to_sec()"
    code = COUNTER.format(prepare=f"start, rate = {now}, rospy.Rate(10)", sleep="rate.sleep()").replace(
        "pub.publish(n)", f"pub.publish(min(127, int(10 * ({now} - start))))"
    )
    run = run_script(tmp_path, code, clock="warped", messages={"/count": 60}, limit_s=40)
    values = _values(run)
    assert values[0] <= 10
    assert values == sorted(values)
    assert values[59] == pytest.approx(values[0] + 59, abs=20)


def test_node_that_sleeps_by_the_wall_is_noticed_and_goes_on_in_real_time(tmp_path: Path) -> None:
    code = COUNTER.format(prepare="", sleep="time.sleep(0.1)")
    # on a full machine it takes longer to see: the time that others took is left out
    run = run_script(tmp_path, code, clock="warped", messages={"/count": 150}, limit_s=60)
    assert _values(run)[:150] == [n % 128 for n in range(150)]
    assert run.outcome.outcome == "complete"
    assert any("does not follow" in event.detail for _, event in run.actors)


def test_a_slow_node_that_follows_the_clock_is_not_taken_for_one_of_real_time(tmp_path: Path) -> None:
    code = COUNTER.format(prepare="rate = rospy.Rate(0.2)", sleep="rate.sleep()")
    run = run_script(tmp_path, code, clock="warped", messages={"/count": 60}, limit_s=50)
    assert _values(run)[:60] == list(range(60))
    assert run.outcome.outcome == "complete"
    assert any("follows" in event.detail for _, event in run.actors)


def test_node_that_takes_five_seconds_to_start(tmp_path: Path) -> None:
    code = "import time\ntime.sleep(5)\n" + COUNTER.format(
        prepare="rate = rospy.Rate(10)", sleep="rate.sleep()"
    )
    run = run_script(tmp_path, code, window_s=1, topics=["/count"])
    assert _values(run)[0] == 0
    assert len(_values(run)) >= 10
    assert run.outcome.outcome == "complete"


def test_node_that_waits_for_a_subscriber(tmp_path: Path) -> None:
    wait = "rate = rospy.Rate(10)\nwhile pub.get_num_connections() == 0 and not rospy.is_shutdown():\n    rate.sleep()"
    code = COUNTER.format(prepare=wait, sleep="rate.sleep()")
    run = run_script(tmp_path, code, window_s=1, topics=["/count"])
    assert _values(run)[0] == 0
    assert exit_of(run).exit_code == 0


def test_node_that_never_publishes_is_given_up(tmp_path: Path) -> None:
    code = "import rospy\nrospy.init_node('quiet')\nrospy.spin()\n"
    run = run_script(tmp_path, code, window_s=1, topics=["/count"], first_message_s=2)
    assert run.outcome.outcome == "silent"
    assert re.fullmatch(r"no message within \d+ s|the graph has settled, without /count", run.outcome.detail)


def test_flood_is_recorded_up_to_the_limit_and_the_rest_counted(tmp_path: Path) -> None:
    code = COUNTER.format(prepare="rate = rospy.Rate(10)", sleep="rate.sleep")
    run = run_script(tmp_path, code, window_s=2, topics=["/count"])
    (channel,) = run.student_channels("/count")
    assert len(channel.messages) <= 20_000
    assert len(channel.messages) > 200  # at 10 Hz it would be 20; how many more depends on the machine
