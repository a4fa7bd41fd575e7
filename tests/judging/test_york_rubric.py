"""The rubric of the York lab: its fixed ids and points, and whole submissions as evidence."""

from __future__ import annotations

from typing import Any

import pytest

from grader.judging import judge, total_points
from tests.judging.labs import SHEBANG, STOPPED, WORDS, assert_sound, lost_of, rubric_of
from tests.support.timeline import build_runs

POINTS = {
    "manifest": 5,
    "maintainer": 5,
    "cmake": 5,
    "build": 5,
    "sender-executable": 10,
    "receiver-executable": 10,
    "sender-node": 5,
    "receiver-node": 5,
    "data": 5,
    "data-rate": 15,
    "message": 5,
    "receiver-hears": 10,
    "two-senders": 15,
}
RUBRIC = rubric_of("york-ele00118m-lab7")
SENDERS = ("/sender_11_1700000000001", "/sender_12_1700000000002")
NO_SENDER = dict.fromkeys(["data", "data-rate", "message", "two-senders"], "blocked")


def submission(
    *,
    sender: str = SENDERS[0],
    email: str = "abc501@york.ac.uk",
    heard: str = "Received: %s",
    copies: tuple[str, ...] = SENDERS,
    **channel: Any,
) -> dict[str, Any]:
    """The reference solution's evidence, but for what is given."""
    topic = {"topic": "/data", "callerid": sender, "rate_hz": 1, "count": 8}
    topic |= {"values": {"text": "The time is {time_s}"}} | channel
    return {
        "runs": {
            "sender": {
                "topics": [topic],
                "processes": [{"name": "sender", "nodes": [sender], "exit_s": 8.5, **STOPPED}],
                "actors": [{"action": "interrupt", "actor": "grader", "detail": "sender", "at_s": 8.2}],
            },
            "receiver": {
                "subscribers": {"/data": ["/receiver"]},
                "processes": [{"name": "receiver", "nodes": ["/receiver"], **STOPPED}],
                "actors": [{"action": "publish", "topic": "/data", "values": WORDS, "at_s": 1}],
                "console": [{"process": "receiver", "lines": [heard % w for w in WORDS], "at_s": 1.01}],
            },
            "two-senders": _two_senders(copies, heard),
            "package": {"processes": [{"name": "catkin_make", "role": "build", "exit_code": 0}]},
        },
        "package": {
            "name": "lab_exercises",
            "manifest": {
                "dependencies": [
                    ["buildtool_depend", "catkin"],
                    ["exec_depend", "rospy"],
                    ["exec_depend", "std_msgs"],
                ],
                "maintainers": [{"name": "abc501", "email": email, "line": 7}],
            },
            "cmake": {
                "calls": [["project", "lab_exercises"], ["find_package", "catkin"], ["catkin_package"]]
            },
            "files": [{"path": f"scripts/{n}.py", "shebang": SHEBANG} for n in ("sender", "receiver")],
        },
    }


def _two_senders(copies: tuple[str, ...], heard: str) -> dict[str, Any]:
    """The second copy starts half a second after the first; a name that both have ends the first one."""
    clash = len(set(copies)) < len(copies)
    first = {"exit_s": 1.1, "exit_code": 0} if clash else {"exit_s": 6.8, **STOPPED}
    texts = [[f"The time is {begin + i}" for i in range(5)] for begin in (0.5, 1.0)]
    both = sorted([*texts[0], *texts[1]], key=lambda text: float(text.split()[-1]))
    return {
        "topics": [
            {"topic": "/data", "callerid": node, "rate_hz": 1, "start_s": begin, "values": texts[n]}
            for n, (node, begin) in enumerate(zip(copies, (0.5, 1.0), strict=True))
            if not (clash and n == 0)
        ],
        "processes": [
            {"name": "receiver", "nodes": ["/receiver"], "exit_s": 6.8, **STOPPED},
            {"name": "sender-1", "nodes": [copies[0]], **first},
            {"name": "sender-2", "nodes": [copies[1]], "start_s": 0.9, "exit_s": 6.8, **STOPPED},
        ],
        "actors": [{"action": "interrupt", "actor": "grader", "at_s": 6.5}],
        "console": [
            {"process": "receiver", "at_s": 0.51, "every_s": 0.5, "lines": [heard % text for text in both]},
            *([{"process": "sender-1", "line": CLASH, "stream": "stderr", "at_s": 1.0}] if clash else []),
        ],
    }


CLASH = "[WARN] shutdown request: [/sender] Reason: new node registered with same name"


def lost(**changes: Any) -> dict[str, str]:
    return lost_of(RUBRIC, judge(RUBRIC, build_runs(submission(**changes))))


def test_ids_and_points() -> None:
    assert_sound(RUBRIC, POINTS)


@pytest.mark.parametrize(
    "changes",
    [{}, {"heard": "/receiver: received:  %s"}, {"values": [f"The time is {n}" for n in range(8)]}],
)
def test_full_marks(changes: dict[str, Any]) -> None:
    assert lost(**changes) == {}


@pytest.mark.parametrize(
    ("changes", "wanted"),
    [
        ({"email": "pi@todo.todo"}, {"maintainer": "fail"}),
        ({"sender": "/talker_11_1700000000001"}, {"sender-node": "fail"}),
        ({"sender": "/sender"}, {}),
        ({"rate_hz": 2, "count": 16}, {"data-rate": "fail"}),
        ({"burst": 2}, {"data-rate": "fail"}),
        ({"values": ["The time is 1700000000.5"]}, {"message": "fail"}),
        ({"values": ["Hello York"]}, {"message": "fail"}),
        ({"heard": "%s"}, {"receiver-hears": "partial"}),
        ({"topic": "/sender/data"}, {"data": "fail", "data-rate": "blocked", "message": "blocked"}),
        ({"copies": ("/sender", "/sender")}, {"two-senders": "partial"}),
    ],
)
def test_one_fault_costs_its_own_criterion(changes: dict[str, Any], wanted: dict[str, str]) -> None:
    assert lost(**changes) == wanted


def test_a_sender_that_is_not_there_is_one_cause() -> None:
    given = submission()
    given["package"]["files"].pop(0)
    given["runs"]["sender"] = {"outcome": "ended"}
    given["runs"]["two-senders"] = {"processes": [{"name": "receiver", "nodes": ["/receiver"], **STOPPED}]}
    results = judge(RUBRIC, build_runs(given))
    found = {r.id: r.status.value for r in results if r.status.value != "pass"}
    assert found == {"sender-executable": "fail", "sender-node": "blocked", **NO_SENDER}
    named = {r.message.split(":")[0] for r in results if r.status.value == "blocked"}
    assert named == {"blocked by sender-executable"}


def test_a_name_taken_over_earns_a_third() -> None:
    results = judge(RUBRIC, build_runs(submission(copies=("/sender", "/sender"))))
    assert {r.points for r in results if r.id == "two-senders"} == {5}
    assert total_points(RUBRIC, results) == 90


@pytest.mark.parametrize(
    ("changes", "criterion", "points"),
    [
        ({"heard": "Recieved: %s"}, "receiver-hears", 5),
        ({"heard": "Received %s"}, "receiver-hears", 5),
        ({"heard": "I received: %s"}, "receiver-hears", 10),
        ({"values": {"text": "The current time is {time_s}"}}, "message", 2.5),
        ({"values": {"text": "the TIME is {time_s:.0f}"}}, "message", 5),
        ({"values": {"text": "The time is noon"}}, "message", 0),
    ],
)
def test_other_words_earn_half(changes: dict[str, Any], criterion: str, points: float) -> None:
    results = judge(RUBRIC, build_runs(submission(**changes)))
    lost = {r.id: r.points for r in results if r.points < r.max_points}
    assert lost == ({} if points == POINTS[criterion] else {criterion: points})
