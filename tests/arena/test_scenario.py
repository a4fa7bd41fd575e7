"""What a scenario can do beside running one script: parameters, several processes, services, other packages."""

from __future__ import annotations

from pathlib import Path

import pytest

from grader.evidence.run import Run
from grader.rubric.scenario import Call, Param, Probe, Scenario, Start, Until
from tests.arena.support import SCRIPT, make_place, printed, run

pytestmark = pytest.mark.ros
SANDBOXES = ["auto", "none"]
NODE = SCRIPT + "import rospy\n"
SENDER = (
    NODE
    + "from std_msgs.msg import String\nrospy.init_node('sender', anonymous={})\n"
    + "pub = rospy.Publisher('data', String, queue_size=10)\nrate = rospy.Rate(10)\n"
    + "while not rospy.is_shutdown():\n    pub.publish(str(rospy.get_time()))\n    rate.sleep()\n"
)
SERVER = (
    NODE
    + "from std_srvs.srv import SetBool, SetBoolResponse\nfrom geometry_msgs.msg import Twist\n"
    + "rospy.init_node('server')\n"
    + "def answer(request):\n    if not request.data:\n        raise ValueError('not false')\n"
    + "    return SetBoolResponse(True, 'done')\n"
    + "rospy.Service('enable', SetBool, answer)\n"
    + "rospy.Subscriber('cmd_vel', Twist, lambda m: print('x is', m.linear.x))\nrospy.spin()\n"
)
READER = (
    NODE
    + "rospy.init_node('reader')\nprint(rospy.get_param('details'), rospy.has_param('other'))\n"
    + "rospy.set_param('/done', 5)\n"
)
CONFIG = "details:\n  name: Ada\n  phone: 77777\n  weight: 1.5\n  digits: '0123'\n  flags: [true, 2]\n"


def _run(tmp_path: Path, files: dict[str, str], scenario: Scenario, *, sandbox: str = "auto") -> Run:
    with make_place(files, sandbox=sandbox) as place:
        return run(place, scenario, tmp_path / "run.mcap")


def _two(anonymous: bool) -> tuple[dict[str, str], Scenario]:
    starts = (
        Start(name="first", script="sender.py"),
        Start(name="second", script="sender.py", after="first"),
    )
    scenario = Scenario(
        title="two",
        start=starts,
        until=Until(
            messages={"/data": 50}, ended=() if anonymous else ("first",), silent_s=3, first_message_s=10
        ),
    )
    return {"scripts/sender.py": SENDER.format(anonymous)}, scenario


@pytest.mark.full
@pytest.mark.parametrize("sandbox", SANDBOXES)
def test_nodes_are_known_by_their_process(tmp_path: Path, sandbox: str) -> None:
    seen = _run(tmp_path, *_two(anonymous=True), sandbox=sandbox)
    (first,), (second,) = seen.student_nodes("first"), seen.student_nodes("second")
    assert {first, second} == set(seen.student_nodes())
    assert first != second
    assert all(channel.messages for channel in seen.student_channels("/data"))
    assert [e.stopped_by for _, e in seen.processes if e.event == "exit" and e.role == "student"] == [
        "INT"
    ] * 2


@pytest.mark.full
@pytest.mark.parametrize("sandbox", SANDBOXES)
def test_a_name_that_is_taken_over(tmp_path: Path, sandbox: str) -> None:
    seen = _run(tmp_path, *_two(anonymous=False), sandbox=sandbox)
    owners = [e.processes.get("/sender") for _, e in seen.graph if "/sender" in e.nodes]
    assert owners.index("first") < owners.index("second")
    assert seen.student_nodes("first") == seen.student_nodes("second") == ("/sender",)
    ends = {e.name: e for _, e in seen.processes if e.event == "exit"}
    assert (ends["first"].stopped_by, ends["second"].stopped_by) == (None, "INT")


def test_a_node_that_ends_at_once_is_seen(tmp_path: Path) -> None:
    hasty = NODE + "import os\nrospy.init_node('hasty')\nrospy.signal_shutdown('done')\nos._exit(0)\n"
    scenario = Scenario(
        title="hasty", start=(Start(name="hasty", script="hasty.py"),), until=Until(ended=("hasty",))
    )
    seen = _run(tmp_path, {"scripts/hasty.py": hasty}, scenario)
    assert seen.student_nodes("hasty") == ("/hasty",)


def test_nodes_of_roslaunch_belong_to_it(tmp_path: Path) -> None:
    files = {
        "scripts/sender.py": SENDER.format(False),
        "launch/two.launch": '<launch><node pkg="lab" type="sender.py" name="one" />'
        '<node pkg="lab" type="sender.py" name="two" ns="deep" /></launch>',
    }
    scenario = Scenario(
        title="launch",
        start=(Start(name="roslaunch", launch="two.launch"),),
        until=Until(nodes=2, silent_s=10),
    )
    seen = _run(tmp_path, files, scenario)
    assert set(seen.student_nodes("roslaunch")) == {"/one", "/deep/two"}
    assert seen.outcome.outcome == "complete"


@pytest.mark.parametrize("sandbox", SANDBOXES)
def test_parameters_of_a_file_are_made_up(tmp_path: Path, sandbox: str) -> None:
    params = (
        Param(file="config/c.yaml", also=("details/name", "details/street")),
        Param(name="/fixed", value={"a": 1}),
        Param(name="guess", made_up="integer"),
    )
    scenario = Scenario(
        title="params",
        params=params,
        start=(Start(name="reader", script="reader.py"),),
        until=Until(quiet_s=5),
    )
    files = {"scripts/reader.py": READER, "config/c.yaml": CONFIG}
    seen = _run(tmp_path, files, scenario, sandbox=sandbox)
    set_by_us = {e.topic: (e.value, e.detail) for _, e in seen.actors if e.action == "param"}
    values = {name: value for name, (value, _) in set_by_us.items()}
    assert values["/fixed"] == {"a": 1}
    assert values["/details/name"] != "Ada"
    assert values["/details/phone"] not in {77777, values["/guess"]}
    assert [type(values[f"/details/{n}"]) for n in ("name", "phone", "weight", "digits")] == [
        str,
        int,
        float,
        str,
    ]
    assert values["/details/digits"].isdigit()
    assert values["/details/flags"][0] is True
    assert set_by_us["/details/street"][1] == "made up, not in the file config/c.yaml"
    (line,) = printed(seen, "reader")
    assert all(repr(values[f"/details/{n}"]) in line for n in ("name", "phone", "weight", "digits", "street"))
    assert [(e.name, e.value) for _, e in seen.params if e.caller_id == "/reader"] == [("/done", 5)]
    asked = {(e.actor, e.topic, e.detail) for _, e in seen.actors if e.action == "read"}
    assert asked >= {("/reader", "/details", ""), ("/reader", "/other", "not there (has_param)")}
    assert seen.outcome.outcome == "ended"


@pytest.mark.parametrize(
    ("text", "remark"),
    [
        ("details:\n\tname: x\n", "not YAML"),
        ("- 1\n", "no names in it"),
        ("a: &a [x, x]\n" + "".join(f"b{i}: [*a, *a]\n" for i in range(20)), "too much in it"),
        (None, "no such file"),
    ],
)
def test_a_file_of_parameters_that_cannot_be_read(tmp_path: Path, text: str | None, remark: str) -> None:
    files = {"scripts/reader.py": READER} | ({"c.yaml": text} if text is not None else {})
    scenario = Scenario(
        title="params",
        params=(Param(file="c.yaml", also=("details/name",)),),
        start=(Start(name="reader", script="reader.py"),),
        until=Until(ended=("reader",)),
    )
    seen = _run(tmp_path, files, scenario)
    (noted,) = [e.detail for _, e in seen.actors if e.action in {"note", "limit"}]
    assert noted.startswith(f"c.yaml: {remark}")
    (value,) = [e.value for _, e in seen.actors if e.action == "param"]
    assert value in printed(seen, "reader")[0]
    assert seen.outcome.outcome == "complete"


@pytest.mark.parametrize("sandbox", SANDBOXES)
def test_rosparam_loads_a_file_of_the_students(tmp_path: Path, sandbox: str) -> None:
    scenario = Scenario(
        title="load",
        start=(
            Start(name="load", load="config/c.yaml"),
            Start(name="reader", script="reader.py", after="load"),
        ),
        until=Until(ended=("load", "reader")),
    )
    files = {"scripts/reader.py": READER, "config/c.yaml": CONFIG}
    seen = _run(tmp_path, files, scenario, sandbox=sandbox)
    loaded = {e.name: e.value for _, e in seen.params if e.caller_id.startswith("/rosparam")}
    assert loaded["/details/phone"] == 77777
    assert "'name': 'Ada'" in printed(seen, "reader")[0]


def test_services_are_called_and_answer(tmp_path: Path) -> None:
    calls = (
        Call(service="/enable", type="std_srvs/SetBool", request={"data": True}),
        Call(service="/enable", type="std_srvs/SetBool", request={}),
        Call(service="/enable", type="std_srvs/Trigger", request={}),
        Call(service="/enable", type="std_srvs/SetBool", request={"dat": True}),
        Call(service="/enable", type="std_srvs/Nothing", request={}),
    )
    probes = (Probe(topic="/cmd_vel", type="geometry_msgs/Twist", values=({"linear": {"x": 1.5}},), times=2),)
    scenario = Scenario(
        title="services",
        start=(
            Start(name="server", script="server.py"),
            Start(name="other", program="rospy_tutorials/talker"),
        ),
        probes=probes,
        calls=calls,
        until=Until(quiet_s=0.5),
    )
    seen = _run(tmp_path, {"scripts/server.py": SERVER}, scenario)
    answers = [(e.value, e.detail) for _, e in seen.actors if e.action == "answer"]
    assert answers[0] == ({"success": True, "message": "done"}, "")
    assert answers[1][0] is None
    assert "not false" in answers[1][1]
    assert answers[2] == (None, "the service is of type std_srvs/SetBool")
    assert "has no field dat" in answers[3][1]
    assert "the grader could not call it" in answers[4][1]
    assert {"/enable": "std_srvs/SetBool"} in [e.service_types for _, e in seen.graph]
    assert printed(seen, "server").count("x is 1.5") == 2
    assert seen.student_nodes() == ("/server",)
    assert [c.topic for c in seen.student_channels() if c.topic != "/rosout"] == []
    assert seen.outcome.outcome == "complete"


LOGGING = f"""{NODE}
import subprocess
from rosgraph_msgs.msg import Log

collected = []
rospy.init_node("logging")
rospy.Subscriber("/rosout_agg", Log, collected.append)
for words in (
    "rosnode ping -c1 /rosout", "rosservice call /rosout/get_loggers", "rosnode info /rosout", "rosnode info /logging"
):
    print(subprocess.run(words.split(), capture_output=True, text=True).stdout, flush=True)
while not collected:
    rospy.loginfo("here")
    rospy.sleep(0.05)
print("collected", collected[0].msg, "of", collected[0].name)
"""


def test_rosout_is_there_for_nodes_and_tools(tmp_path: Path) -> None:
    """The grader's own node answers in its place."""
    scenario = Scenario(
        title="log",
        start=(Start(name="logging", script="logs.py"),),
        until=Until(ended=("logging",)),
    )
    seen = _run(tmp_path, {"scripts/logs.py": LOGGING}, scenario)
    said = "\n".join(printed(seen, "logging"))
    assert "xmlrpc reply from" in said
    assert "/rosout_agg [rosgraph_msgs/Log]" in said
    assert "loggers: []" in said
    assert "* to: /rosout" in said
    assert "/grader_recorder" not in said.split("* to: /rosout")[0].rsplit("topic: /rosout", 1)[-1]
    assert "collected here of /logging" in said
    assert "/rosout" in seen.graph[-1][1].nodes
    assert "rosout" not in {event.name for _, event in seen.processes}


WAITER = (
    NODE
    + "from std_msgs.msg import String\nrospy.init_node('waiter')\n"
    + "pub = rospy.Publisher('data', String, queue_size=1)\nwait = rospy.Rate(1000)\n"
    + "while pub.get_num_connections() == 0:\n    wait.sleep()\npub.publish('first')\nrospy.spin()\n"
)
HEARER = (
    NODE
    + "from std_msgs.msg import String\nrospy.init_node('hearer')\n"
    + "rospy.Subscriber('data', String, lambda m: print('heard', m.data))\nrospy.spin()\n"
)


@pytest.mark.full
def test_a_publisher_that_waits_for_its_subscriber(tmp_path: Path) -> None:
    """The recorder's own connection must not be taken for the one that it waits for."""
    files = {"scripts/hearer.py": HEARER, "scripts/waiter.py": WAITER}
    starts = (
        Start(name="hearer", script="hearer.py"),
        Start(name="waiter", script="waiter.py", after="hearer"),
    )
    scenario = Scenario(title="two", start=starts, until=Until(messages={"/data": 1}, quiet_s=0.5))
    for attempt in range(3):
        folder = tmp_path / str(attempt)
        folder.mkdir()
        assert printed(_run(folder, files, scenario), "hearer") == ["heard first"]


def test_a_service_that_is_never_offered(tmp_path: Path) -> None:
    scenario = Scenario(
        title="services",
        start=(Start(name="reader", script="reader.py"),),
        params=(Param(name="details", value="x"),),
        calls=(Call(service="/enable", type="std_srvs/SetBool", request={}),),
        until=Until(quiet_s=0.5),
    )
    seen = _run(tmp_path, {"scripts/reader.py": READER}, scenario)
    assert not [e for _, e in seen.actors if e.action in {"call", "answer"}]
    assert seen.outcome.outcome == "ended"


def test_watching_a_node_for_a_while(tmp_path: Path) -> None:
    code = NODE + "rospy.init_node('hello')\nprint('hello')\nrospy.spin()\n"
    scenario = Scenario(
        title="hello", start=(Start(name="hello", script="hello.py"),), until=Until(alive_s=1.0)
    )
    seen = _run(tmp_path, {"scripts/hello.py": code}, scenario)
    up_ns = next(t for t, e in seen.graph if "/hello" in e.nodes)
    stopped_ns = next(t for t, e in seen.actors if e.action == "interrupt")
    assert (stopped_ns - up_ns) / 1e9 + 0.05 >= 1.0
    assert seen.outcome.outcome == "complete"


def test_a_node_that_never_comes(tmp_path: Path) -> None:
    scenario = Scenario(
        title="nothing",
        start=(Start(name="idle", script="idle.py"),),
        until=Until(nodes=1, first_message_s=1.0, silent_s=0.5),
    )
    seen = _run(
        tmp_path, {"scripts/idle.py": SCRIPT + "import threading\nthreading.Event().wait()\n"}, scenario
    )
    assert (seen.outcome.outcome, seen.outcome.detail) == ("silent", "nothing happened for 1 s")


SLOW_SERVER = (
    NODE
    + "import time\nfrom std_srvs.srv import Trigger, TriggerResponse\nrospy.init_node('slow')\n{}\n"
    + "rospy.Service('{}', Trigger, lambda request: TriggerResponse(True, ''))\nrospy.spin()\n"
)
PREPARATIONS = {
    "sleeps": "rospy.sleep(3)",
    "works": "until = time.process_time() + 3\nwhile time.process_time() < until: pass",
    "loops": "for _ in range(25): rospy.sleep(0.1)",
    "waits-for-another": "rospy.wait_for_service('/late')",
    "a-timer": "def later(_):\n    rospy.Service('/ask', Trigger, lambda r: (True, ''))\n"
    "rospy.Timer(rospy.Duration(3), later, oneshot=True)",
}


def _served(tmp_path: Path, before: str, name: str, *also: str) -> Run:
    """The grader calls `/ask` once of a node that does `before` something first, beside other scripts."""
    files = {"scripts/slow.py": SLOW_SERVER.format(before, name)}
    files |= {f"scripts/also{n}.py": code for n, code in enumerate(also)}
    scenario = Scenario(
        title="slow",
        start=tuple(Start(name=Path(path).stem, script=Path(path).name) for path in files),
        calls=(Call(service="/ask", type="std_srvs/Trigger"),),
        until=Until(nodes=1),
    )
    return _run(tmp_path, files, scenario)


@pytest.mark.full
@pytest.mark.parametrize("before", PREPARATIONS.values(), ids=PREPARATIONS.keys())
def test_a_slow_node_is_waited_for(before: str, tmp_path: Path) -> None:
    late = NODE + "import time\ntime.sleep(3)\n" + SERVER.partition("\n")[2].replace("'enable'", "'/late'")
    name = "other" if "Timer" in before else "ask"
    seen = _served(tmp_path, before, name, *([late] if "late" in before else []))
    assert [event.value for _, event in seen.actors if event.action == "answer"] == [
        {"success": True, "message": ""}
    ]


def _needed_s(seen: Run) -> float:
    """From the first registration to the end, without what others took of the machine."""
    first_ns = next(t for t, e in seen.graph if e.processes)
    lost = [
        min(max(0.0, (e.busy or 0) - (e.own_busy or 0)), 0.75) for _, e in seen.host if (e.busy or 0) >= 0.9
    ]
    return (seen.course[-1][0] - first_ns) / 1e9 - sum(lost) / 2


@pytest.mark.full
def test_a_service_of_another_name_is_not_waited_for_long(tmp_path: Path) -> None:
    right, wrong = _served(tmp_path, "", "ask"), _served(tmp_path, "", "asks")
    assert not [event for _, event in wrong.actors if event.action == "call"]
    assert [event for _, event in right.actors if event.action == "answer"]
    assert _needed_s(wrong) < _needed_s(right) + 4.0
