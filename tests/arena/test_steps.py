"""Steps of a scenario, in real runs."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from grader.evidence.run import Run
from grader.rubric.model import Scenario, Start, Until
from tests.arena.support import SCRIPT, make_place, printed, run

pytestmark = pytest.mark.ros
NODE = SCRIPT + "import rospy\n"
ECHO = (
    NODE
    + "from std_msgs.msg import Float64, Header\nfrom sensor_msgs.msg import LaserScan\n"
    + "rospy.init_node('echo')\npub = rospy.Publisher('echo', Float64, queue_size=10)\n"
    + "rospy.Subscriber('speed', Float64, lambda m: pub.publish(m.data * 2))\n"
    + "rospy.Subscriber('scan', LaserScan, lambda m: print(len(m.ranges), max(m.ranges), min(m.ranges)))\n"
    + "rospy.Subscriber('beat', Header, lambda m: print('late', abs((rospy.Time.now() - m.stamp).to_sec()) > 1))\n"
    + "rospy.spin()\n"
)


def _run(tmp_path: Path, files: dict[str, str], steps: list[dict[str, Any]], **more: Any) -> Run:
    """Do the steps with each of the scripts, which are processes by their names."""
    start = tuple(Start(name=Path(file).stem, script=file) for file in files if file.endswith(".py"))
    about = {"title": "steps", "start": start, "until": Until(messages={}, first_message_s=10), **more}
    scenario = Scenario.model_validate({**about, "steps": steps})
    with make_place(files) as place:
        return run(place, scenario, tmp_path / "run.mcap")


def _did(seen: Run, action: str) -> list[tuple[str | None, Any, str]]:
    return [(e.topic, e.value, e.detail) for _, e in seen.actors if e.action == action]


@pytest.mark.parametrize("clock", ["real", "warped"])
def test_messages_that_change_and_what_is_waited_for(tmp_path: Path, clock: str) -> None:
    scan = {
        "header": {"stamp": "now"},
        "ranges": {"repeat": ".inf", "count": 360, "except": {"150-210": 0.5}},
    }
    header = {"topic": "/beat", "type": "std_msgs/Header", "value": {"stamp": "now"}, "rate_hz": 5}
    speed = {"topic": "/speed", "type": "std_msgs/Float64", "value": {"from": 0, "to": 1}}
    seen = _run(
        tmp_path,
        {"scripts/echo.py": ECHO},
        [
            {"publish": {**header, "background": True}},
            {"publish": {**speed, "rate_hz": 10, "duration_s": 2}},
            {"wait": {"topic": "/echo", "messages": 20}},
            {"publish": {"topic": "/scan", "type": "sensor_msgs/LaserScan", "value": scan, "count": 1}},
            {"publish": {"topic": "/nobody", "type": "std_msgs/Bool", "value": True, "count": 1}},
            {"wait": {"node": "/echo"}},
            {"wait": {"seconds": 1}},
            {"wait": {"topic": "/echo", "new": True, "limit_s": 0.2}},
        ],
        clock=clock,
    )
    (echo,) = seen.student_channels("/echo")
    assert echo.data == pytest.approx([2 * n / 19 for n in range(20)])
    assert "360 inf 0.5" in printed(seen, "echo")
    assert set(printed(seen, "echo")) - {"360 inf 0.5"} == {"late False"}
    published = [(t, e.value) for t, e in seen.actors if e.action == "publish" and e.topic == "/speed"]
    assert [value for _, value in published] == pytest.approx([n / 19 for n in range(20)])
    if clock == "real":
        gaps_s = [(b - a) / 1e9 for (a, _), (b, _) in pairwise(published)]
        assert sum(gaps_s) / len(gaps_s) == pytest.approx(0.1, rel=0.1)
    assert ("/nobody", None, "nothing was published: no node has subscribed") in _did(seen, "note")
    assert [detail for _, _, detail in _did(seen, "wait")] == [
        "20 messages came", "the node came", "1 s have passed", "1 message did not come within 0.2 s",
    ]  # fmt: skip
    assert seen.outcome is not None
    assert seen.outcome.outcome == "complete"
