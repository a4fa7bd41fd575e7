"""The rubric of the Manchester lab: its fixed ids and points, and whole submissions as evidence."""

from __future__ import annotations

from typing import Any

import pytest

from tests.judging.labs import Lab, assert_sound

POINTS = {
    "manifest": 5,
    "cmake": 5,
    "cmake-install": 10,
    "build": 5,
    "talker-executable": 5,
    "listener-executable": 5,
    "talker-node": 5,
    "listener-node": 5,
    "chatter": 5,
    "chatter-rate": 15,
    "message": 5,
    "listener-hears": 10,
    "launch-xml": 10,
    "launch-runs": 10,
}
LAB = Lab(
    id="mcr2-basic-comms",
    package="basic_comms",
    talker="scripts/talker.py",
    listener="scripts/listener.py",
    talker_node="/talker",
    listener_node="/listener",
    launch="launch/activity1.launch",
    text="hello world {time_s}",
    heard="[INFO] [1669664767.068386]: I heard %s",
)
UP: dict[str, Any] = {
    "topics": [{"topic": "/chatter", "callerid": "/talker"}],
    "subscribers": {"/chatter": ["/listener"]},
}
SRC = ("src/talker.py", "src/listener.py")


def test_ids_and_points() -> None:
    assert_sound(LAB.rubric, POINTS)


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"channel": {"values": {"text": "hello World {time_s:.0f}"}}},
        {"heard": "i heard %s"},
        {"files": SRC, "calls": LAB.calls(*SRC)},
    ],
)
def test_full_marks(changes: dict[str, Any]) -> None:
    assert LAB.lost(launched=UP, **changes) == {}


@pytest.mark.parametrize(
    ("changes", "lost"),
    [
        ({"depends": ("std_msgs",)}, {"manifest": "fail"}),
        ({"calls": LAB.calls("scripts/talker.py")}, {"cmake-install": "partial"}),
        ({"channel": {"callerid": "/talker_4711_1700000000000"}}, {"talker-node": "fail"}),
        ({"listener_node": "/listener_4711_1700000000000"}, {"listener-node": "fail"}),
        ({"channel": {"rate_hz": 5, "count": 40}}, {"chatter-rate": "fail"}),
        ({"channel": {"values": ["hello world"]}}, {"message": "fail"}),
        ({"channel": {"values": ["hello world 1700000000.5"]}}, {"message": "fail"}),
        ({"channel": {"values": {"text": "hello world {i}"}}}, {"message": "fail"}),
        ({"channel": {"type": "std_msgs/Int8", "values": [1]}}, {"chatter": "fail", "message": "blocked"}),
        (
            {"channel": {"topic": "/chat"}},
            {"chatter": "fail", "chatter-rate": "blocked", "message": "blocked"},
        ),
        ({"heard": "%s"}, {"listener-hears": "partial"}),
    ],
)
def test_one_fault_costs_its_own_criterion(changes: dict[str, Any], lost: dict[str, str]) -> None:
    assert LAB.lost(launched=UP, **changes) == lost


@pytest.mark.parametrize(
    ("changes", "criterion", "points"),
    [
        ({"heard": "I heard: %s"}, "listener-hears", 5),
        ({"heard": "I have heard %s"}, "listener-hears", 5),
        ({"heard": "Heard '%s'"}, "listener-hears", 5),
        ({"heard": "I HEARD %s!"}, "listener-hears", 10),
        ({"channel": {"values": {"text": "hello, world: {time_s}"}}}, "message", 2.5),
        ({"channel": {"values": {"text": "hello world, it is {time_s}"}}}, "message", 2.5),
        ({"channel": {"values": {"text": "hello world {time_s} s"}}}, "message", 2.5),
        ({"channel": {"values": {"text": "hello world"}}}, "message", 0),
        ({"calls": LAB.calls("scripts/listener.py")}, "cmake-install", 5),
    ],
)
def test_what_is_right_earns_its_share(changes: dict[str, Any], criterion: str, points: float) -> None:
    found = {one.id: one for one in LAB.judge(launched=UP, **changes)}
    assert found[criterion].points == points
    shared = 0 < points < found[criterion].max_points
    assert ("of the points for what is right: " in found[criterion].message) == shared
    lost = sum(one.max_points - one.points for one in found.values())
    assert lost == found[criterion].max_points - points


@pytest.mark.parametrize(
    ("old", "new", "up", "points"),
    [
        ('type="listener.py"', 'type="speaker.py"', {"subscribers": {}}, 5 + 2.5),
        ("output", "output", {"subscribers": {}}, 10 + 2.5),
        ('name="listener"', 'name="ears"', {"subscribers": {"/chatter": ["/ears"]}}, 20),
        ('name="talker"', 'name="mouth"', {"topics": [{"topic": "/chatter", "callerid": "/mouth"}]}, 20),
    ],
)
def test_one_of_two_nodes(old: str, new: str, up: dict[str, Any], points: float) -> None:
    """Names in the launch file are the student's own."""
    assert old in LAB.launch_text
    found = LAB.judge(launch=LAB.launch_text.replace(old, new), launched={**UP, **up})
    assert sum(one.points for one in found if one.id.startswith("launch")) == points


def test_apart_by_a_namespace() -> None:
    apart = LAB.launch_text.replace('name="listener"', 'name="listener" ns="ears"')
    up = {**UP, "subscribers": {"/ears/chatter": ["/ears/listener"]}}
    assert LAB.lost(launch=apart, launched=up) == {"launch-runs": "partial"}


def test_a_rate_explains_no_connection_that_is_missing() -> None:
    up = {**UP, "subscribers": {"/chat": ["/listener"]}}
    slow = {"rate_hz": 5, "count": 40}
    assert LAB.lost(channel=slow, launched=up) == {"chatter-rate": "fail", "launch-runs": "partial"}


def test_a_node_without_a_name() -> None:
    nameless = LAB.launch_text.replace('name="listener" ', "")
    up = {"processes": [{"name": "roslaunch", "exit_code": 1, "exit_s": 1}]}
    assert LAB.lost(launch=nameless, launched=up) == {"launch-xml": "fail", "launch-runs": "blocked"}
