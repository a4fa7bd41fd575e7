"""The rubric of the Sheffield lab: its fixed ids and points, and whole submissions as evidence."""

from __future__ import annotations

from typing import Any

import pytest

from tests.judging.labs import Lab, assert_sound

POINTS = {
    "manifest": 5,
    "cmake": 5,
    "build": 5,
    "layout": 5,
    "publisher-executable": 10,
    "subscriber-executable": 10,
    "publisher-node": 5,
    "subscriber-node": 5,
    "chatter": 5,
    "chatter-rate": 15,
    "subscriber-hears": 10,
    "launch-xml": 10,
    "launch-runs": 10,
}
LAB = Lab(
    id="sheffield-com2009-week1",
    package="pubsub_example",
    talker="src/publisher.py",
    listener="src/subscriber.py",
    talker_node="/publisher_node_4711_1700000000000",
    listener_node="/subscriber_node_4712_1700000000001",
    launch="launch/pub_sub.launch",
    text="rospy time is: {time_s}",
    heard="I heard %s",
)
UP: dict[str, Any] = {
    "topics": [{"topic": "/chatter", "callerid": "/pub_node"}],
    "subscribers": {"/chatter": ["/sub_node"]},
}


def test_ids_and_points() -> None:
    assert_sound(LAB.rubric, POINTS)


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"heard": "[INFO] [1712.5]: %s"},
        {"depends": ("rospy", "std_msgs", "roscpp")},
        {"calls": (["project", "pubsub_example"], ["find_package", "catkin"], ["catkin_package"])},
        {"files": ("src/publisher.py", "src/subscriber.py", "src/more.py")},
    ],
)
def test_full_marks(changes: dict[str, Any]) -> None:
    assert LAB.lost(launched=UP, **changes) == {}


@pytest.mark.parametrize(
    ("changes", "lost"),
    [
        ({"depends": ("rospy",)}, {"manifest": "fail"}),
        (
            {"calls": (["project", "pubsub"], ["find_package", "catkin"], ["catkin_package"])},
            {"cmake": "fail"},
        ),
        ({"files": ("scripts/publisher.py", "src/subscriber.py")}, {"layout": "fail"}),
        ({"channel": {"callerid": "/publisher_node"}}, {"publisher-node": "fail"}),
        ({"channel": {"callerid": "/talker_4711_1700000000000"}}, {"publisher-node": "fail"}),
        ({"listener_node": "/subscriber_node"}, {"subscriber-node": "fail"}),
        ({"channel": {"rate_hz": 1, "count": 8}}, {"chatter-rate": "fail"}),
        ({"channel": {"burst": 10}}, {"chatter-rate": "fail"}),
        ({"channel": {"type": "std_msgs/Int8", "values": [1]}}, {"chatter": "fail"}),
        ({"channel": {"topic": "/publisher_node/chatter"}}, {"chatter": "fail", "chatter-rate": "blocked"}),
        ({"heard": "I heard something and not%.0s"}, {"subscriber-hears": "fail"}),
    ],
)
def test_one_fault_costs_its_own_criterion(changes: dict[str, Any], lost: dict[str, str]) -> None:
    assert LAB.lost(launched=UP, **changes) == lost


def test_the_planted_error_costs_half_of_the_launch_file_and_of_what_comes_up() -> None:
    planted = LAB.launch_text.replace('type="publisher.py"', 'type="publisher"')
    up = {"subscribers": {"/chatter": ["/sub_node"]}}
    assert LAB.lost(launch=planted, launched=up) == {"launch-xml": "partial", "launch-runs": "partial"}


def test_names_come_from_the_launch_file() -> None:
    own = {
        "topics": [{"topic": "/chatter", "callerid": LAB.talker_node}],
        "subscribers": {"/chatter": [LAB.listener_node]},
    }
    assert LAB.lost(launched=own) == {"launch-runs": "fail"}
