"""Steps of a scenario, in real runs."""

from __future__ import annotations

import re
from itertools import pairwise
from pathlib import Path
from statistics import median
from typing import Any

import pytest

from grader.arena.goals import BEHIND
from grader.checks.support.processes import lives, observed_until_ns
from grader.evidence.events import NOT_OFFERED
from grader.evidence.message_values import MessageType, action_texts
from grader.evidence.run import Run
from grader.rubric.scenario import JudgedGoal, Scenario, Start, Until
from tests.arena.support import SCRIPT, make_place, printed, run
from tests.evidence.bags import Topic, write_bag

pytestmark = pytest.mark.ros
NODE = SCRIPT + "import rospy\n"
ECHO = (
    NODE
    + "from std_msgs.msg import Float64, Header\nfrom sensor_msgs.msg import LaserScan\n"
    + "rospy.init_node('echo')\npub = rospy.Publisher('echo', Float64, queue_size=10)\n"
    + "rospy.Subscriber('speed', Float64, lambda m: pub.publish(m.data * 2))\n"
    + "rospy.Subscriber('scan', LaserScan, lambda m: print(len(m.ranges), max(m.ranges), min(m.ranges)))\n"
    + "rospy.Subscriber('beat', Header, lambda m: None)\n"
    + "rospy.spin()\n"
)


def _run(
    tmp_path: Path,
    files: dict[str, str],
    steps: list[dict[str, Any]],
    *,
    sandbox: str = "auto",
    goals: dict[tuple[str, int], JudgedGoal] | None = None,
    **more: Any,
) -> Run:
    """Do the steps with each of the scripts, which are processes by their names."""
    start = tuple(Start(name=Path(file).stem, script=file) for file in files if file.endswith(".py"))
    about = {"title": "steps", "start": start, "until": Until(messages={}, first_message_s=10), **more}
    scenario = Scenario.model_validate({**about, "steps": steps})
    with make_place(files, sandbox=sandbox) as place:
        return run(place, scenario, tmp_path / "run.mcap", beside=tmp_path, goals=goals)


def _did(seen: Run, action: str) -> list[tuple[str | None, Any, str]]:
    return [(e.topic, e.value, e.detail) for _, e in seen.actors if e.action == action]


def test_nodes_are_watched_as_long_as_a_criterion_asks_though_the_steps_are_over(tmp_path: Path) -> None:
    """Simulated seconds go by in a quarter of the time."""
    talker = NODE + (
        "from std_msgs.msg import Int8\nrospy.init_node('talker')\npub = rospy.Publisher('n', Int8, queue_size=10)\n"
        "rate = rospy.Rate(10)\nwhile not rospy.is_shutdown():\n    pub.publish(1)\n    rate.sleep()\n"
    )
    start = (Start(name="talker", script="scripts/talker.py"),)
    steps = [{"wait": {"topic": "/n"}}, {"wait": {"seconds": 1}}]
    about = {"title": "steps", "start": start, "until": Until(messages={}), "clock": "warped", "warp": 4}
    scenario = Scenario.model_validate({**about, "steps": steps})
    with make_place({"scripts/talker.py": talker}) as place:
        seen = run(place, scenario, tmp_path / "run.mcap", watched_s=2.0)
    (life,), (sent,) = lives(seen), seen.student_channels("/n")
    assert life.until_ns(seen) - sent.times_ns[0] >= 2_000_000_000
    assert life.end is not None
    assert life.end.stopped_by == "INT"


def test_a_pause_begins_once_the_processes_are_nodes(tmp_path: Path) -> None:
    """On a busy machine, the imports alone may take as long as the pause."""
    talker = NODE + (
        "import time\ntime.sleep(1.5)\nfrom std_msgs.msg import Int8\nrospy.init_node('talker')\n"
        "pub = rospy.Publisher('n', Int8, queue_size=10)\nrate = rospy.Rate(20)\n"
        "while not rospy.is_shutdown():\n    pub.publish(1)\n    rate.sleep()\n"
    )
    seen = _run(tmp_path, {"scripts/talker.py": talker}, [{"wait": {"seconds": 1}}])
    (sent,) = seen.student_channels("/n")
    assert len(sent.messages) >= 10


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
            {"wait": {"node": "/echo"}},
            {"wait": {"seconds": 1}},
            {"wait": {"topic": "/echo", "new": True, "limit_s": 0.2}},
        ],
        clock=clock,
    )
    (echo,) = seen.student_channels("/echo")
    assert echo.data == pytest.approx([2 * n / 19 for n in range(20)])
    assert "360 inf 0.5" in printed(seen, "echo")
    beats = [
        (t / 1e9, e.value["stamp"]) for t, e in seen.actors if e.action == "publish" and e.topic == "/beat"
    ]
    (begun_s, first), (over_s, last) = beats[0], beats[-1]
    faster = (last["secs"] - first["secs"] + (last["nsecs"] - first["nsecs"]) / 1e9) / (over_s - begun_s)
    assert faster > 3 if clock == "warped" else 0.5 < faster < 2
    published = [(t, e.value) for t, e in seen.actors if e.action == "publish" and e.topic == "/speed"]
    assert [value for _, value in published] == pytest.approx([n / 19 for n in range(20)])
    if clock == "real":
        assert median(b - a for (a, _), (b, _) in pairwise(published)) == pytest.approx(0.1e9, rel=0.2)
    assert [detail for _, _, detail in _did(seen, "wait")] == [
        "20 messages came", "the node came", "1 s have passed", "1 message did not come within 0.2 s",
    ]  # fmt: skip
    assert seen.outcome is not None
    assert seen.outcome.outcome == "complete"


TALKER = (
    NODE
    + "import sys, threading\nfrom std_msgs.msg import Int32\nrospy.init_node('talker')\n"
    + "pub = rospy.Publisher('count', Int32, queue_size=10)\nrate = rospy.Rate(20)\n"
    + "threading.Thread(target=lambda: [print('typed', l.strip()) for l in sys.stdin], daemon=True).start()\n"
    + "for n in range(10000):\n    if rospy.is_shutdown():\n        break\n    pub.publish(n)\n    rate.sleep()\n"
)
LISTENER = (
    NODE
    + "from std_msgs.msg import Int32, String\nrospy.init_node('listener')\n"
    + "rospy.Subscriber('words', String, lambda m: print('heard', m.data))\nrospy.spin()\n"
)


@pytest.mark.parametrize("sandbox", ["auto", pytest.param("none", marks=pytest.mark.full)])
def test_processes_are_started_stopped_killed_and_typed_to(tmp_path: Path, sandbox: str) -> None:
    words = {"topic": "/words", "type": "std_msgs/String"}
    seen = _run(
        tmp_path,
        {"scripts/talker.py": TALKER, "scripts/listener.py": LISTENER},
        [
            {"wait": {"topic": "/count", "messages": 5}},
            {"publish": {**words, "topic": "/unheard", "value": "nothing"}},
            {"type": {"process": "talker", "line": "hello there"}},
            {"start": "listener"},
            {"wait": {"node": "/listener", "limit_s": 20}},
            {"publish": {**words, "value": "first"}},
            {"kill": "talker"},
            {"restart": "listener"},
            {"publish": {**words, "value": "second"}},
            {"start": "talker"},
            {"wait": {"topic": "/count", "messages": 5, "new": True}},
            {"stop": "talker"},
        ],
        sandbox=sandbox,
        until=Until(messages={}, first_message_s=5),
    )
    assert [line for line in printed(seen, "talker") if line.startswith("typed")] == ["typed hello there"]
    assert [line for line in printed(seen, "listener") if "heard" in line] == ["heard first", "heard second"]
    assert ("/unheard", None, "nothing was published: no node has subscribed") in _did(seen, "note")
    talker, listener, again, last = lives(seen)
    assert (talker.name, listener.name, again.name, last.name) == ("talker", "listener", "listener", "talker")
    stops = [(one.end.stopped_by, one.by_step, one.ended_early) for one in lives(seen) if one.end is not None]
    assert stops == [("KILL", True, False), ("INT", True, False), ("INT", False, False), ("INT", True, False)]
    deeds = [(e.action, e.detail) for _, e in seen.actors if e.action in {"start", "stop", "kill"}]
    assert deeds == [
        ("start", "listener"), ("kill", "talker"), ("stop", "listener"), ("start", "listener"), ("start", "talker"),
        ("stop", "talker"),
    ]  # fmt: skip
    assert observed_until_ns(seen) == again.interrupt_ns
    assert seen.outcome is not None
    assert seen.outcome.outcome == "complete"


def test_a_run_whose_process_has_ended_does_no_more_steps(tmp_path: Path) -> None:
    seen = _run(tmp_path, {"scripts/short.py": SCRIPT + "print('over')\n"}, [{"wait": {"seconds": 60}}] * 3)
    assert seen.outcome is not None
    assert seen.outcome.outcome == "ended"
    assert (seen.end_ns - seen.start_ns) / 1e9 < 40


def test_what_never_comes_is_not_waited_for_once_the_graph_has_settled(tmp_path: Path) -> None:
    silent = {"topic": "/echo", "limit_s": 1}
    steps: list[dict[str, Any]] = [{"topic": "/never"}, {"node": "/nobody"}, silent, {"topic": "/echo"}]
    until = {"first_message_s": 45, "limit_s": 1}
    seen = _run(tmp_path, {"scripts/echo.py": ECHO}, [{"wait": wait} for wait in steps], until=until)
    said = [detail for _, _, detail in _did(seen, "wait")]
    assert [detail.partition(" did ")[0] for detail in said] == [
        "1 message",
        "the node",
        "1 message",
        "1 message",
    ]
    never, nobody, first, again = (float(detail.split()[-2]) for detail in said)
    assert max(never, nobody) < 44
    assert (first, again) == (1, 6)


FRAMES = (
    NODE
    + "from std_srvs.srv import SetBool, SetBoolResponse\nrospy.init_node('frames')\n"
    + "for topic in ('/tf', '/tf_static'):\n"
    + "    rospy.Subscriber(topic, rospy.AnyMsg, lambda m, t=topic: print(f'{t} {m._buff[0]}\\n', end=''))\n"
    + "rospy.Service('turn', SetBool, lambda r: SetBoolResponse(r.data, str(rospy.get_param('/gain'))))\nrospy.spin()\n"
)


@pytest.mark.parametrize("switch", ["call", "set_param", "type"])
def test_what_is_switched_on_again_is_waited_for(tmp_path: Path, switch: str) -> None:
    """It has been silent for so long that it has come to rest."""
    beats = NODE + (
        "import sys, threading\nfrom std_msgs.msg import Int8\nfrom std_srvs.srv import SetBool\n"
        "rospy.init_node('beats')\npub = rospy.Publisher('n', Int8, queue_size=10)\nsent = 0\nis_on = True\n"
        "def turn(request):\n    global is_on\n    is_on = request.data\n    return is_on, ''\n"
        "def read():\n    for line in sys.stdin:\n        rospy.set_param('/on', True)\n"
        "rospy.Service('turn', SetBool, turn)\nthreading.Thread(target=read, daemon=True).start()\n"
        "rate = rospy.Rate(5)\nwhile not rospy.is_shutdown():\n"
        "    if is_on and (sent < 8 or rospy.get_param('/on', False)):\n        pub.publish(sent)\n        sent += 1\n"
        "    rate.sleep()\n"
    )
    turn = {"service": "/turn", "type": "std_srvs/SetBool"}
    on: dict[str, dict[str, Any]] = {
        "call": {"call": {**turn, "request": {"data": True}}},
        "set_param": {"set_param": {"name": "/on", "value": True}},
        "type": {"type": {"process": "beats", "line": "on"}},
    }
    before = [{"wait": {"topic": "/n", "messages": 6}}]
    before += [{"call": turn}, {"set_param": {"name": "/on", "value": True}}] if switch == "call" else []
    steps = [
        *before,
        {"wait": {"seconds": 4.5}},
        on[switch],
        {"wait": {"topic": "/n", "messages": 3, "new": True}},
    ]
    seen = _run(tmp_path, {"scripts/beats.py": beats}, steps)
    assert ("/n", None, "3 messages came") in _did(seen, "wait")


def test_transforms_parameters_and_calls_in_time(tmp_path: Path) -> None:
    moving = {"parent": "map", "child": "base", "rotation_deg": [0, 0, {"from": 0, "to": 90}]}
    turn = {"service": "/turn", "type": "std_srvs/SetBool"}
    seen = _run(
        tmp_path,
        {"scripts/frames.py": FRAMES},
        [
            {"transform": {"parent": "base", "child": "laser", "translation": [0.2, 0, 0], "static": True}},
            {"transform": {"parent": "base", "child": "camera", "rotation_deg": [0, 90, 0], "static": True}},
            {"transform": {**moving, "duration_s": 0.5}},
            {"set_param": {"name": "/gain", "value": 2}},
            {"call": {**turn, "request": {"data": True}}},
            {"set_param": {"name": "/gain", "value": 3}},
            {"call": turn},
            {"call": {**turn, "service": "/trun"}},
        ],
    )
    told = printed(seen, "frames")
    assert told.count("/tf 1") == 10
    assert "/tf_static 2" in told
    (fixed,) = (c for c in seen.channels if c.topic == "/tf_static")
    (moved,) = (c for c in seen.channels if c.topic == "/tf")
    assert fixed.latching
    assert [t["child_frame_id"] for t in fixed.values[-1]["transforms"]] == ["laser", "camera"]
    rotations = [value["transforms"][0]["transform"]["rotation"] for value in moved.values]
    assert (rotations[0]["z"], rotations[0]["w"]) == (0.0, 1.0)
    assert (rotations[-1]["z"], rotations[-1]["w"]) == pytest.approx((0.5**0.5, 0.5**0.5))
    assert [v["message"] for _, v, _ in _did(seen, "answer")] == ["2", "3"]
    assert [(name, value) for name, value, _ in _did(seen, "set_param")] == [("/gain", 2), ("/gain", 3)]
    assert not _did(seen, "param")
    assert ("/trun", None, NOT_OFFERED) in _did(seen, "note")


COUNT = "int32 target\n---\nint32 total\nstring words\n---\nfloat32 share\n"
SERVER = (
    NODE
    + "from genpy.dynamic import generate_dynamic\nfrom actionlib_msgs.msg import GoalID\nrospy.init_node('server')\n"
    + "Goal = generate_dynamic('lab/CountActionGoal', {goal!r})['lab/CountActionGoal']\n"
    + "Result = generate_dynamic('lab/CountActionResult', {result!r})['lab/CountActionResult']\n"
    + "pub = rospy.Publisher('count/result', Result, queue_size=10)\n"
    + "def end(name, status, total):\n    result = Result()\n    result.status.goal_id.id = name\n"
    + "    result.status.status = status\n    result.result.total = total\n    pub.publish(result)\n"
    + "def goal(message):\n    for _ in range(80 if message.goal.target == 7 else 0):\n        rospy.sleep(0.1)\n"
    + "    if message.goal.target > 0:\n"
    + "        end('another', 3, 0)\n        end(message.goal_id.id, 3, message.goal.target)\n"
    + "rospy.Subscriber('count/cancel', GoalID, lambda m: end(m.id, 2, -1))\n"
    + "rospy.Subscriber('count/goal', Goal, goal)\nrospy.spin()\n"
)


def test_goals_have_results_and_can_be_cancelled(tmp_path: Path) -> None:
    find = action_texts("lab/Count", COUNT).get
    goal, result = (MessageType(f"lab/CountAction{part}", find).definition for part in ("Goal", "Result"))
    about = {"name": "/count", "type": "lab/Count"}
    seen = _run(
        tmp_path,
        {"scripts/server.py": SERVER.format(goal=goal, result=result), "action/Count.action": COUNT},
        [
            {"action": {**about, "goal": {"target": 5}}},
            {"action": {**about, "goal": {"target": -1}, "cancel_after_s": 0.5}},
            {"action": {**about, "goal": {"target": 7}}},
            {"action": {**about, "goal": {"targt": 1}}},
            {"action": {**about, "goal": {"target": -1}, "limit_s": 0.2}},
        ],
    )
    results = [(value and value["total"], detail) for _, value, detail in _did(seen, "result")]
    # The one of 7 takes eight seconds, in silence
    ended = [(5, "SUCCEEDED"), (-1, "PREEMPTED"), (7, "SUCCEEDED"), (None, "no result within 0.2 s")]
    assert results == ended
    assert [value["target"] for _, value, _ in _did(seen, "goal")] == [5, -1, 7, -1]
    assert len(_did(seen, "cancel")) == 1
    assert any("no field targt" in detail for _, _, detail in _did(seen, "note"))


@pytest.mark.parametrize(
    ("goals", "since"),
    [
        (1, "1 s after it was cancelled"),
        pytest.param(2, "3 s after it was cancelled", marks=pytest.mark.full),
    ],
)
def test_the_last_goal_that_is_cancelled_is_waited_for_no_longer_than_it_is_judged(
    tmp_path: Path, goals: int, since: str
) -> None:
    find = action_texts("lab/Count", COUNT).get
    goal, result = (MessageType(f"lab/CountAction{part}", find).definition for part in ("Goal", "Result"))
    heedless = SERVER.format(goal=goal, result=result).replace("end(m.id, 2, -1)", "None")
    about = {"name": "/count", "type": "lab/Count", "limit_s": 3}
    last = [{"action": {**about, "goal": {"target": 5}}}] if goals > 1 else []
    scenario = Scenario.model_validate(
        {
            "title": "steps",
            "start": [{"name": "server", "script": "scripts/server.py"}],
            "steps": [{"action": {**about, "goal": {"target": -1}, "cancel_after_s": 0.3}}, *last],
        }
    )
    with make_place({"scripts/server.py": heedless, "action/Count.action": COUNT}) as place:
        seen = run(place, scenario, tmp_path / "run.mcap", goals={("/count", goals): JudgedGoal(1.0)})
    assert _did(seen, "result")[0] == ("/count", None, f"no result within {since}")
    assert len(_did(seen, "result")) == goals


@pytest.mark.parametrize(
    ("goals", "looks", "judged", "within"),
    [
        (1, False, JudgedGoal(1.0), r"1(\.\d)? s"),
        pytest.param(2, False, JudgedGoal(1.0), "4 s", marks=pytest.mark.full),
        pytest.param(2, True, JudgedGoal(1.0), r"1(\.\d)? s", marks=pytest.mark.full),
        (2, True, JudgedGoal(1.0, feedback=2), r"1(\.\d)? s"),  # none comes
        # nothing says how soon it has to come
        pytest.param(2, True, JudgedGoal(0.0, feedback=2), "4 s", marks=pytest.mark.full),
        pytest.param(2, True, None, "4 s", marks=pytest.mark.full),
    ],
)
def test_a_goal_is_waited_for_as_long_as_its_criteria_need_it(
    tmp_path: Path, *, goals: int, looks: bool, judged: JudgedGoal | None, within: str
) -> None:
    """`looks` is whether the server ends a goal for a newer one."""
    find = action_texts("lab/Count", COUNT).get
    goal, result = (MessageType(f"lab/CountAction{part}", find).definition for part in ("Goal", "Result"))
    server = SERVER.format(goal=goal, result=result) + "server.is_preempt_requested()\n" * looks
    about = {"name": "/count", "type": "lab/Count", "limit_s": 4}
    steps = [{"action": {**about, "goal": {"target": target}}} for target in (-1, 5)[:goals]]
    seen = _run(
        tmp_path,
        {"scripts/server.py": server, "action/Count.action": COUNT},
        steps,
        goals={("/count", 1): judged} if judged else None,
    )
    results = [detail for _, _, detail in _did(seen, "result")]
    assert re.fullmatch(f"no result within {within}", results[0])
    assert results[1:] == ["SUCCEEDED"][: goals - 1]


TELLS = """from actionlib_msgs.msg import GoalStatus, GoalStatusArray
goals, told = [], rospy.Publisher('count/status', GoalStatusArray, queue_size=10)
def tell(_):
    told.publish(status_list=[GoalStatus(goal_id=one, status=NEXT if n else 1) for n, one in enumerate(goals)])
rospy.Timer(rospy.Duration(0.2), tell)
"""


@pytest.mark.parametrize(
    ("status", "limit_s", "judged_s", "detail"),
    [
        (0, 2, None, BEHIND),
        pytest.param(0, 1, 5.0, BEHIND, marks=pytest.mark.full),
        (0, 1, None, "no result within 6 s"),  # the rubric does not ask for the first one's end
        pytest.param(1, 2, None, "no result within 6 s", marks=pytest.mark.full),
    ],
)
def test_a_goal_behind_one_that_never_ends_is_waited_for_until_that_shows(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    *,
    status: int,
    limit_s: int,
    judged_s: float,
    detail: str,
) -> None:
    monkeypatch.setattr("grader.arena.goals.ENDING_S", 2.0)
    find = action_texts("lab/Count", COUNT).get
    goal, result = (MessageType(f"lab/CountAction{part}", find).definition for part in ("Goal", "Result"))
    server = SERVER.format(goal=goal, result=result).replace("end(m.id, 2, -1)", "None")
    server = server.replace("def goal(message):\n", "def goal(message):\n    goals.append(message.goal_id)\n")
    server = server.replace("rospy.Subscriber", TELLS.replace("NEXT", str(status)) + "rospy.Subscriber", 1)
    about = {"name": "/count", "type": "lab/Count", "goal": {"target": -1}}
    seen = _run(
        tmp_path,
        {"scripts/server.py": server, "action/Count.action": COUNT},
        [{"action": {**about, "limit_s": limit_s}}, {"action": {**about, "limit_s": 6}}],
        goals={("/count", 1): JudgedGoal(judged_s)} if judged_s else None,
    )
    results = [detail for _, _, detail in _did(seen, "result")]
    assert results == [f"no result within {limit_s} s", detail]


@pytest.mark.parametrize(("first_s", "answer_s"), [pytest.param(4, 4.0, marks=pytest.mark.full), (1, 2.0)])
def test_a_goal_that_ends_an_earlier_one_late_is_waited_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, first_s: float, answer_s: float
) -> None:
    """The server looks for another goal every three seconds, or works on the first for longer than the step waits."""
    monkeypatch.setattr("grader.arena.goals.ENDING_S", answer_s)
    find = action_texts("lab/Count", COUNT).get
    goal, result = (MessageType(f"lab/CountAction{part}", find).definition for part in ("Goal", "Result"))
    server = SERVER.format(goal=goal, result=result).replace("range(80 ", "range(30 ")
    server = server.replace("def goal(message):\n", "def goal(message):\n    goals.append(message.goal_id)\n")
    server = server.replace("rospy.Subscriber", TELLS.replace("NEXT", "0") + "rospy.Subscriber", 1)
    about = {"name": "/count", "type": "lab/Count"}
    seen = _run(
        tmp_path,
        {"scripts/server.py": server, "action/Count.action": COUNT},
        [
            {"action": {**about, "goal": {"target": -1}, "limit_s": first_s}},
            {"action": {**about, "goal": {"target": 7}, "limit_s": 8}},
        ],
    )
    assert [detail for _, _, detail in _did(seen, "result")] == [f"no result within {first_s} s", "SUCCEEDED"]


def test_an_action_that_the_package_lacks_is_noted(tmp_path: Path) -> None:
    steps = [{"action": {"name": "/count", "type": "lab/Count"}}]
    seen = _run(tmp_path, {"scripts/frames.py": FRAMES}, steps)
    assert ["the grader cannot use lab/Count" in detail for _, _, detail in _did(seen, "note")] == [True]


def test_a_recording_is_played(tmp_path: Path) -> None:
    words = Topic("/words", "std_msgs/String", [f"word {n}" for n in range(5)])
    write_bag(tmp_path / "words.bag", words, Topic("/clock", "rosgraph_msgs/Clock", [{}]))
    seen = _run(
        tmp_path,
        {"scripts/listener.py": LISTENER},
        [{"play": {"bag": "words.bag", "speed": 0.25}}, {"wait": {"seconds": 0.5}}],
    )
    assert printed(seen, "listener") == [f"heard word {n}" for n in range(5)]
    (sent,) = (c for c in seen.channels if c.topic == "/words")
    # 1.6 s, of which a late first message leaves less; as recorded, it is 0.4 s
    assert sent.times_ns[-1] - sent.times_ns[0] > 0.6e9
    assert "/clock" not in {c.topic for c in seen.channels}
    assert _did(seen, "play") == [("words.bag", None, "5 messages on /words")]
