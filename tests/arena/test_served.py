"""Services that the grader offers: students' clients find them, get their answers, and are recorded."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from grader.evidence.message_values import ServiceTypes
from grader.evidence.run import Run
from grader.ros_env import ros_packages
from grader.rubric.scenario import Scenario, Served
from tests.arena.support import SCRIPT, make_place, printed, run

SET, TRIGGER = "std_srvs/SetBool", "std_srvs/Trigger"
CLIENT = SCRIPT + "import rospy\nfrom std_srvs.srv import SetBool, Trigger\nrospy.init_node('client')\n"
TEXTS = {
    "std_srvs/Empty": ("---", "d41d8cd98f00b204e9800998ecf8427e"),
    TRIGGER: ("---\nbool success  # whether it did\nstring message", "937c9679a518e3a18d831e57125ea522"),
    SET: ("bool data\n---\nbool success\nstring message\n", "09fb03525b03e7ea1fd3992bafd87e16"),
    "rospy_tutorials/AddTwoInts": ("int64 a\nint64 b\n---\nint64 sum", "6a2e34150c00229791cc89ff309fff21"),
}


@pytest.mark.parametrize("type_", TEXTS)
def test_md5sums_are_those_of_ros(type_: str) -> None:
    text, md5sum = TEXTS[type_]
    assert ServiceTypes(type_, text).md5sum == md5sum


def _run(tmp_path: Path, code: str, *serves: dict[str, Any], sandbox: str = "auto") -> Run:
    about = {"title": "serves", "until": {"ended": ["client"], "limit_s": 30}}
    start = [{"name": "client", "script": "scripts/client.py"}]
    scenario = Scenario.model_validate({**about, "start": start, "serves": serves})
    with make_place({"scripts/client.py": CLIENT + code}, sandbox=sandbox) as place:
        return run(place, scenario, tmp_path / "run.mcap")


def _did(seen: Run, action: str) -> list[tuple[str, str | None, Any, str]]:
    return [(e.actor, e.topic, e.value, e.detail) for _, e in seen.actors if e.action == action]


@pytest.mark.ros
@pytest.mark.parametrize("sandbox", ["auto", "none"])
def test_answers_come_in_turn_and_calls_are_recorded(tmp_path: Path, sandbox: str) -> None:
    seen = _run(
        tmp_path,
        "rospy.wait_for_service('/door')\n"
        "door = rospy.ServiceProxy('/door', SetBool)\n"
        "print(door(True).message, door(False).message)\n"
        "print(rospy.ServiceProxy('/door', SetBool, persistent=True)(data=True).message)\n"
        "begun = rospy.get_time()\n"
        "print(rospy.ServiceProxy('/slow', Trigger)().success, rospy.get_time() - begun >= 0.4)\n"
        "try:\n    rospy.ServiceProxy('/broken', Trigger)()\n"
        "except rospy.ServiceException as error:\n    print(error)\n",
        {"service": "/door", "type": SET, "answers": [{"message": "open"}, {"message": "shut"}]},
        {"service": "/slow", "type": TRIGGER, "answer": {"success": True}, "delay_s": 0.5},
        {"service": "/broken", "type": TRIGGER, "fails": True},
        sandbox=sandbox,
    )
    assert printed(seen, "client")[:3] == ["open shut", "shut", "True True"]
    assert "the service cannot do it" in printed(seen, "client")[3]
    said = [value["response"] for _, _, value, _ in _did(seen, "serve")]
    assert said == [{"message": "open"}, {"message": "shut"}, {"message": "shut"}, {"success": True}, None]
    asked = [(actor, topic, value["request"]) for actor, topic, value, _ in _did(seen, "serve")]
    assert asked[:3] == [("/client", "/door", {"data": data}) for data in (True, False, True)]
    assert asked[3:] == [("/client", "/slow", {}), ("/client", "/broken", {})]
    looked = [(actor, topic) for actor, topic, _, _ in _did(seen, "lookup")]
    assert looked == [("/client", "/door"), ("/client", "/slow"), ("/client", "/broken")]
    assert {t: kind for t, kind in seen.graph[-1][1].service_types.items() if "/door" in t} == {"/door": SET}


@pytest.mark.ros
def test_a_client_of_another_type_is_refused_and_named(tmp_path: Path) -> None:
    seen = _run(
        tmp_path,
        "try:\n    rospy.ServiceProxy('/door', Trigger)()\n"
        "except rospy.ServiceException as error:\n    print(error)\n"
        "try:\n    rospy.wait_for_service('/dor', 0.5)\nexcept rospy.ROSException:\n    print('not there')\n",
        {"service": "/door", "type": SET, "answer": {}},
    )
    refused, absent = printed(seen, "client")
    assert "md5sums do not match" in refused
    assert absent == "not there"
    notes = [(e.actor, e.topic, e.type, e.value) for _, e in seen.actors if e.action == "note"]
    assert ("/client", "/door", TRIGGER, SET) in notes
    assert _did(seen, "serve") == []
    assert _did(seen, "lookup")[-1] == ("/client", "/dor", None, "not there")


@pytest.mark.ros
def test_a_hostile_client_is_bounded_and_others_are_served(tmp_path: Path) -> None:
    seen = _run(
        tmp_path,
        "import rosgraph, socket, struct, time\n"
        "from rosgraph.network import write_ros_handshake_header as say\n"
        "port = int(rosgraph.Master('/x').lookupService('/door').rpartition(':')[2].strip('/'))\n"
        "def joined():\n"
        "    sock = socket.create_connection(('127.0.0.1', port))\n"
        "    say(sock, {'service': '/door', 'md5sum': '*', 'callerid': '/client', 'persistent': '1'})\n"
        "    return sock\n"
        "large = joined()\nlarge.sendall(struct.pack('<I', 1 << 30))\nlarge.settimeout(5)\n"
        "while large.recv(1 << 16):\n    pass\n"
        "many = [joined() for _ in range(70)]\n"
        "while b'too many' not in many[-1].recv(1 << 16):\n    many.append(joined())\n"
        "for sock in many:\n    sock.close()\n"
        "while True:\n"
        "    try:\n        print(rospy.ServiceProxy('/door', SetBool)(True).message)\n        break\n"
        "    except rospy.ServiceException:\n        time.sleep(0.05)\n",
        {"service": "/door", "type": SET, "answer": {"message": "open"}},
    )
    assert printed(seen, "client") == ["open"]
    limits = [detail for _, _, _, detail in _did(seen, "limit")]
    assert f"called /door with {1 << 30} bytes" in limits
    assert "has more than 64 connections to the grader's services" in limits


def test_what_a_scenario_without_services_is_stays_the_same() -> None:
    one = Scenario(title="test")
    with_door = one.model_copy(update={"serves": (Served(service="/door", type=SET, answer={}),)})
    assert one.digest != with_door.digest


needs_actionlib = pytest.mark.skipif(ros_packages().lacks("actionlib"), reason="actionlib is not installed")
ACTION = "import actionlib\nfrom actionlib.msg import TestAction, TestGoal\n"


@needs_actionlib
@pytest.mark.ros
def test_an_action_reports_ends_and_can_be_cancelled(tmp_path: Path) -> None:
    seen = _run(
        tmp_path,
        ACTION
        + "client = actionlib.SimpleActionClient('/count', TestAction)\nprint(client.wait_for_server())\n"
        "client.send_goal(TestGoal(5), feedback_cb=lambda f: print('at', f.feedback))\nclient.wait_for_result()\n"
        "print(client.get_state(), client.get_result().result)\n"
        "client.send_goal(TestGoal(7), feedback_cb=lambda _: client.cancel_goal())\nclient.wait_for_result()\n"
        "print(client.get_state(), client.get_result().result)\n",
        {
            "action": "/count",
            "type": "actionlib/Test",
            "feedback": [{"feedback": 1}, {"feedback": 2}],
            "result": {"result": 9},
            "delay_s": 0.5,
        },
    )
    assert printed(seen, "client") == ["True", "at 1", "at 2", "3 9", "2 9"]
    goals = [(actor, topic, value["request"], end) for actor, topic, value, end in _did(seen, "serve")]
    assert goals == [
        ("/client", "/count", {"goal": 5}, "SUCCEEDED"),
        ("/client", "/count", {"goal": 7}, "PREEMPTED"),
    ]
