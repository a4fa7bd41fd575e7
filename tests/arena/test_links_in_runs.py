"""Which nodes count as connected: those that are, whatever one of them says of itself."""

from __future__ import annotations

from pathlib import Path

import pytest

from grader.checks.topics import ConnectedParams, connected
from grader.evidence.run import Run
from grader.model.package import PackageFacts
from grader.model.verdict import Status
from grader.rubric.scenario import Scenario, Start, Until
from tests.arena.support import SCRIPT, make_place, run

pytestmark = pytest.mark.ros
FACTS = PackageFacts.model_construct(slips=(), cmake=None, launch_files=(), files=())
SANDBOXES = ["auto", pytest.param("none", marks=pytest.mark.full)]
TALKER = """
import rospy
from std_msgs.msg import Int32
rospy.init_node('talker')
pub = rospy.Publisher('chatter', Int32, queue_size=10)
other = rospy.Publisher('other', Int32, queue_size=10)
rate = rospy.Rate(10)
while not rospy.is_shutdown():
    pub.publish(1)
    other.publish(1)
    rate.sleep()
"""
LISTENER = """
import rospy
from std_msgs.msg import Int32
rospy.init_node('listener')
rospy.Subscriber('{topic}', Int32, lambda message: None)
rospy.spin()
"""
FORGED = """
import rosgraph
from rospy.impl.masterslave import ROSHandler
honest = ROSHandler.getBusInfo
def forged(self, caller_id):
    code, message, entries = honest(self, caller_id)
    said = [99, {other}, '{direction}', '{transport}', '/chatter', True, 'on port 1 to [127.0.0.1:2 on socket 3]']
    return code, message, [*entries, said]
ROSHandler.getBusInfo = forged
"""
CLAIMS = FORGED.format(other="'/listener'", direction="o", transport="TCPROS")
HEARS = "rosgraph.Master('/listener').lookupNode('/talker')"


MADE_UP = """
import os, socket, socketserver, threading, time, xmlrpc.client, xmlrpc.server
master = xmlrpc.client.ServerProxy(os.environ['ROS_MASTER_URI'])
TYPE = 'std_msgs/Int32'
def serve(entries):
    api = xmlrpc.server.SimpleXMLRPCServer(('127.0.0.1', 0), logRequests=False, allow_none=True)
    api.register_function(lambda *_: [1, '', entries], 'getBusInfo')
    threading.Thread(target=api.serve_forever, daemon=True).start()
    return 'http://127.0.0.1:%d/' % api.server_address[1]
made = serve([[1, '/up', 'o', 'TCPROS', '/chatter', True, 'x']])
up = serve([[1, made, 'i', 'TCPROS', '/chatter', True, 'x']])
data = socket.create_server(('127.0.0.1', 0))
near = socket.create_connection(data.getsockname())
far = data.accept()
master.registerPublisher('/made', '/chatter', TYPE, made)
master.registerSubscriber('/up', '/chatter', TYPE, up)
time.sleep(60)
"""


def both(tmp_path: Path, talker: str, listener: str, *, sandbox: str = "auto", patience_s: float = 6) -> Run:
    """Two programs until they are connected over `/chatter`, or their graph has not changed for `patience_s`."""
    files = {"scripts/talker.py": SCRIPT + talker, "scripts/listener.py": SCRIPT + listener}
    starts = (Start(name="talker", script="talker.py"), Start(name="listener", script="listener.py"))
    until = Until(connected=("/chatter",), silent_s=patience_s, first_message_s=patience_s, limit_s=90)
    with make_place(files, sandbox=sandbox) as place:
        return run(place, Scenario(title="two", start=starts, until=until), tmp_path / "run.mcap")


def pairs(seen: Run) -> set[tuple[str, str, str]]:
    """All connections of the run, as (topic, publisher, subscriber)."""
    return {(c.topic, c.publisher, c.subscriber) for _, e in seen.graph for c in e.connections}


def refused(seen: Run) -> list[tuple[str, str]]:
    return [(e.actor, e.detail) for _, e in seen.actors if e.action == "refused"]


def judged(seen: Run) -> Status:
    return connected(FACTS, seen, ConnectedParams(topic="/chatter")).status


CHATTER = ("/chatter", "/talker", "/listener")
REFUSAL = ("talker", "said that /listener is connected to /talker over /chatter, which is not so")


@pytest.mark.parametrize("sandbox", SANDBOXES)
def test_nodes_that_are_connected(tmp_path: Path, sandbox: str) -> None:
    seen = both(tmp_path, TALKER, LISTENER.format(topic="chatter"), sandbox=sandbox, patience_s=60)
    assert seen.outcome.outcome == "complete"
    assert judged(seen) is Status.PASS
    assert pairs(seen) == {CHATTER}
    assert refused(seen) == []


@pytest.mark.parametrize("sandbox", SANDBOXES)
def test_a_talker_that_says_it_is_connected(tmp_path: Path, sandbox: str) -> None:
    """The listener hears it over another topic, so that there is a connection between the two, but not this one."""
    seen = both(tmp_path, CLAIMS + TALKER, LISTENER.format(topic="other"), sandbox=sandbox)
    assert seen.outcome.outcome != "complete"
    assert judged(seen) is Status.FAIL
    assert CHATTER not in pairs(seen)
    assert ("/other", "/talker", "/listener") in pairs(seen)
    assert refused(seen) == [REFUSAL]


def test_a_listener_that_says_it_hears(tmp_path: Path) -> None:
    forged = FORGED.format(other=HEARS, direction="i", transport="TCPROS")
    seen = both(tmp_path, TALKER, forged + LISTENER.format(topic="other"))
    assert judged(seen) is Status.FAIL
    assert pairs(seen) & {CHATTER, ("/other", "/talker", "/listener")} == {("/other", "/talker", "/listener")}


def test_a_talker_that_has_ended_when_its_word_is_checked(tmp_path: Path) -> None:
    """The listener takes its time to answer; by then there is no socket of the talker any more."""
    ends = "\n    import os, threading\n    threading.Timer(0.3, os._exit, [0]).start()\n    code, message"
    claims = CLAIMS.replace("\n    code, message", ends, 1)
    waits = FORGED.format(other=HEARS, direction="i", transport="TCPROS")
    waits = waits.replace("\n    code, message", "\n    import time\n    time.sleep(1)\n    code, message", 1)
    seen = both(tmp_path, claims + TALKER, waits + LISTENER.format(topic="apart"))
    assert judged(seen) is Status.FAIL
    assert CHATTER not in pairs(seen)


@pytest.mark.full
@pytest.mark.parametrize("transport", ["TCPROS", "UDPROS"])
def test_two_that_say_what_the_kernel_does_not_know_of(tmp_path: Path, transport: str) -> None:
    """Both lie; they call each other (XML-RPC), which is no topic's connection."""
    claims = FORGED.format(other="'/listener'", direction="o", transport=transport)
    hears = FORGED.format(other=HEARS, direction="i", transport=transport)
    calls = "caller = rosgraph.Master('/talker').lookupNode\n"
    seen = both(tmp_path, claims + calls + TALKER, hears + LISTENER.format(topic="apart"))
    assert judged(seen) is Status.FAIL
    assert CHATTER not in pairs(seen)
    assert refused(seen) == [REFUSAL]


def test_a_talker_that_makes_up_its_listener(tmp_path: Path) -> None:
    """One process is both nodes, by an XML-RPC server of its own, and is connected to itself."""
    seen = both(tmp_path, MADE_UP, "import time\ntime.sleep(60)\n")
    assert judged(seen) is Status.FAIL
    assert {"/made", "/up"} <= set(seen.student_nodes())
    assert pairs(seen) == set()
    assert refused(seen) == [("talker", REFUSAL[1].replace("listener", "up").replace("talker", "made"))]


LAUNCH = """<launch>
  <group ns="lab">
    <node pkg="lab" type="talker.py" name="talker"/>
    <node pkg="lab" type="listener.py" name="hears"><remap from="chatter" to="/chatter"/></node>
  </group>
</launch>
"""


def test_nodes_of_one_launch_file(tmp_path: Path) -> None:
    """They are of one process tree, in which each is a process of its own."""
    files = {
        "scripts/talker.py": SCRIPT + TALKER.replace("'chatter'", "'/chatter'"),
        "scripts/listener.py": SCRIPT + LISTENER.format(topic="chatter"),
        "launch/two.launch": LAUNCH,
    }
    start, until = (Start(name="roslaunch", launch="two.launch"),), Until(connected=("/chatter",), limit_s=30)
    with make_place(files) as place:
        seen = run(place, Scenario(title="launch", start=start, until=until), tmp_path / "run.mcap")
    assert judged(seen) is Status.PASS
    assert ("/chatter", "/lab/talker", "/lab/hears") in pairs(seen)
    assert refused(seen) == []


BOTH_ENDS = """
rospy.Subscriber('chatter', Int32, lambda message: None)
rospy.Subscriber('rosout_agg', rospy.AnyMsg, lambda message: None)
"""


def test_a_node_that_publishes_and_subscribes(tmp_path: Path) -> None:
    """It hears itself, a second node, and everybody's log."""
    talker = TALKER.replace("rate =", BOTH_ENDS + "rate =")
    seen = both(tmp_path, talker, LISTENER.format(topic="chatter"), patience_s=60)
    assert judged(seen) is Status.PASS
    assert {CHATTER, ("/chatter", "/talker", "/talker")} <= pairs(seen)
    assert refused(seen) == []
