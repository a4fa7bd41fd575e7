"""What a student's program can do to the arena over ROS: noticed, survived, reported, and nobody else is harmed."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise
from pathlib import Path
from statistics import median

import pytest

from grader.arena.limits import RunLimits
from grader.evidence.run import Channel, Run
from grader.rubric.scenario import Probe, Scenario, Start, Until
from tests.arena.support import SCRIPT, exit_of, make_place, printed, run

pytestmark = pytest.mark.ros
ARENA_BYTES_MAX = 150 << 20
TIMES_LATE = 3
TALKER = (
    SCRIPT
    + """
import rospy
from std_msgs.msg import Int32
rospy.init_node('talker')
pub = rospy.Publisher('chatter', Int32, queue_size=10)
rate = rospy.Rate(10)
number = 0
while not rospy.is_shutdown():
    pub.publish(number)
    number += 1
    rate.sleep()
"""
)
ATTACK = (
    SCRIPT
    + """
import gzip, os, socket, struct, sys, threading, time, xmlrpc.client, xmlrpc.server
from urllib.parse import urlparse
MASTER = os.environ['ROS_MASTER_URI']
PORT = urlparse(MASTER).port
def proxy():
    return xmlrpc.client.ServerProxy(MASTER)
def send(data, port=PORT, wait=True):
    sock = socket.create_connection(('127.0.0.1', port), 5)
    try:
        sock.sendall(data)
        return sock.recv(65536) if wait else sock
    except OSError as error:
        return repr(error).encode()
def post(body, *head):
    lines = ['POST / HTTP/1.1', 'Host: x', *head]
    if not any('Length' in line for line in head):
        lines.append('Content-Length: %d' % len(body))
    return send('\\r\\n'.join(lines).encode() + b'\\r\\n\\r\\n' + body)
def attempt(name, work):
    try:
        print(name, repr(work())[:200])
    except Exception as error:
        print(name, 'failed', type(error).__name__, str(error)[:100])
"""
)


def beside_a_talker(
    tmp_path: Path,
    attack: str,
    *,
    window_s: float = 3.0,
    ends: bool = False,
    limits: RunLimits | None = None,
    sandbox: str = "auto",
) -> Run:
    """Run an attack in one process beside an honest 10 Hz talker in another; one that `ends` is seen to its end. Where
    the talker is late, or sent before it was heard, it is run again, as a grading is: what a busy machine made does not
    come every time."""
    scenario = Scenario(
        title="attack",
        start=(Start(name="attack", script="attack.py"), Start(name="talker", script="talker.py")),
        until=Until(
            window_s=window_s,
            topics=("/chatter",),
            ended=("attack",) if ends else (),
            first_message_s=30,
            silent_s=30,
            limit_s=60,
        ),
    )
    files = {"scripts/attack.py": ATTACK + attack, "scripts/talker.py": TALKER}
    for _ in range(TIMES_LATE):
        with make_place(files, limits=limits, sandbox=sandbox) as place:
            seen = run(place, scenario, tmp_path / "run.mcap")
        if all(
            is_in_time(chatter) and chatter.data[:1] == (0,) for chatter in seen.student_channels("/chatter")
        ):
            break
    return seen


def is_in_time(chatter: Channel) -> bool:
    """The median gap is a tenth of a second: one stall of a busy machine says nothing about an attack."""
    return len(chatter.data) < 2 or median(b - a for a, b in pairwise(chatter.times_ns)) == pytest.approx(
        1e8, rel=0.1
    )


def assert_unharmed(seen: Run, *, window_s: float = 3.0) -> None:
    """The talker is recorded whole and in time, the arena stayed small, and the run ended as it had to."""
    assert (seen.outcome.outcome, seen.outcome.detail) == ("complete", "")
    (chatter,) = seen.student_channels("/chatter")
    assert list(chatter.data) == list(range(len(chatter.data)))
    assert chatter.times_ns[-1] - chatter.times_ns[0] >= (window_s - 0.5) * 1e9  # however slowly it talks
    assert is_in_time(chatter)
    assert exit_of(seen, "arena").max_rss_bytes < ARENA_BYTES_MAX


def told(seen: Run, action: str, actor: str = "attack") -> str:
    """All that was refused to a process, or that it had too much of."""
    return "\n".join(e.detail for _, e in seen.actors if e.action == action and e.actor == actor)


def assert_told(text: str, parts: Iterable[str]) -> None:
    assert [part for part in parts if part not in text] == [], text


CALLS = """
LAUGHS = '<?xml version="1.0"?><!DOCTYPE a [<!ENTITY a "%s">%s]>' % (
    'lol' * 1000, ''.join('<!ENTITY b%d "%s">' % (i, '&a;' * 50) for i in range(50)))
CALL = '<methodCall><methodName>getPid</methodName><params><param><value>%s</value></param></params></methodCall>'
attempt('entities', lambda: post((LAUGHS + CALL % '&b1;').encode()))
attempt('utf-16', lambda: post((LAUGHS + CALL % '&b1;').encode('utf-16')))
attempt('nul', lambda: post(b'\\x00<\\x00!' + (CALL % 'x').encode()))
attempt('gzip', lambda: post(gzip.compress(b'x' * (100 << 20), 1), 'Content-Encoding: gzip'))
attempt('length', lambda: post(b'', 'Content-Length: 99999999999'))
attempt('negative', lambda: post(b'x', 'Content-Length: -5'))
attempt('no length', lambda: send(b'POST / HTTP/1.1\\r\\nHost: x\\r\\n\\r\\n'))
attempt('deep', lambda: post((CALL % ('<array><data><value>' * 50000)).encode()))
ATTRIBUTES = ' '.join('a%d="1"' % i for i in range(100000))
attempt('attributes', lambda: post((CALL % ('<i4 ' + ATTRIBUTES + '>1</i4>')).encode()))
attempt('many', lambda: post((CALL % ('<array><data>' + '<value/>' * 900000 + '</data></array>')).encode()))
attempt('number', lambda: post((CALL % ('<int>' + '9' * 5000000 + '</int>')).encode()))
NAMELESS = '<struct><member><value><i4>1</i4></value><value>x</value></member></struct>'
attempt('names', lambda: post((CALL % NAMELESS).encode()))
attempt('garbage', lambda: send(os.urandom(5000) + b'\\r\\n\\r\\n'))
attempt('large', lambda: post((CALL % ('x' * (8000 << 10))).encode()))
attempt('multicall', lambda: proxy().system.multicall([{'methodName': 'getParam', 'params': ['/x', '/']}] * 1000))
attempt('private', lambda: proxy()._shutdown('x'))
attempt('inner', lambda: [proxy().param_update_task('/x', 'http://127.0.0.1:1/', '/x', 1)])
idle = [send(b'POST / HTTP/1.1\\r\\n', wait=False) for _ in range(900)]
print('connected', len(idle))
def drip():
    sock = socket.create_connection(('127.0.0.1', PORT))
    while True:
        sock.sendall(b'P')
        time.sleep(0.3)
for _ in range(20):
    threading.Thread(target=drip, daemon=True).start()
def hammer():
    while True:
        proxy().getParam('/x', '/rosout_disable_topics_generation')
for _ in range(20):
    threading.Thread(target=hammer, daemon=True).start()
time.sleep(3)
"""


def test_calls_that_are_made_to_break_the_master(tmp_path: Path) -> None:
    seen = beside_a_talker(tmp_path, CALLS, ends=True)
    assert_unharmed(seen)
    refused = (
        "a document type",
        "are not text",
        "an encoded call (gzip)",
        "a call of more than 8 MB",
        "its length",
    )
    refused += (
        "nested too deeply",
        "more than a name",
        "more than 200000 elements",
        "a number that is too large",
    )
    assert_told(
        told(seen, "refused"), (*refused, "a name that is not a string", "something that is not a call")
    )
    assert_told(told(seen, "limit"), ("more than 256 connections to the master",))


PARAMETERS = """
for number in range(12):
    attempt('set', lambda: proxy().setParam('/attack', '/big%d' % number, 'x' * (1 << 20)))
attempt('deep', lambda: proxy().setParam('/attack', '/a' * 500, 1))
attempt('too deep', lambda: proxy().setParam('/attack', '/a' * 5000, 1))
deep = 1
for _ in range(100):
    deep = [deep]
attempt('nested', lambda: proxy().setParam('/attack', '/nested', deep))
attempt('strange', lambda: proxy().setParam('/attack', '/strange', {'n': float('nan'), 'i': float('-inf'), '': [],
    'b': xmlrpc.client.Binary(b'\\x00\\xff'), 'd': xmlrpc.client.DateTime(0), '\\u202e': '\\U0001f600'}))
attempt('key', lambda: proxy().setParam('/attack', '/a\\tb', 1))
attempt('sim', lambda: proxy().setParam('/attack', '/use_sim_time', False))
attempt('all', lambda: len(proxy().getParam('/attack', '/')[2]))
attempt('all in one', lambda: proxy().system.multicall([{'methodName': 'getParam', 'params': ['/attack', '/']}] * 2000))
attempt('search', lambda: proxy().searchParam('/a' * 400000, 'x'))
def again(number):
    one = proxy()
    for value in range(1450):
        one.setParam('/attack', '/again%d' % number, value)
    one.setParam('/attack', '/again%d' % number, 'last')
threads = [threading.Thread(target=again, args=(n,)) for n in range(3)]
for thread in threads:
    thread.start()
for thread in threads:
    thread.join()
print('done')
"""


def test_more_parameters_than_anybody_needs(tmp_path: Path) -> None:
    seen = beside_a_talker(tmp_path, PARAMETERS, window_s=5, ends=True)
    assert_unharmed(seen, window_s=5)
    assert "done" in printed(seen, "attack")
    assert_told(
        told(seen, "limit"), ("8 MB of parameters", "nested more than 24 levels", "so often", "too large")
    )
    assert_told(told(seen, "refused"), ("with something that is not a name",))
    latest = {e.name: e.value for _, e in seen.params}
    assert [latest[f"/again{number}"] for number in range(3)] == ["last"] * 3
    assert latest["/use_sim_time"] is False
    assert latest["/strange"]["b"].startswith("<xmlrpc.client.Binary")
    assert len(seen.params) < 5000


REGISTRATIONS = """
listener = socket.create_server(('127.0.0.1', 0), backlog=500)
SILENT = 'http://127.0.0.1:%d/' % listener.getsockname()[1]
ADDRESSES = ('http://192.0.2.1/', 'file:///etc/passwd', 'http://127.0.0.1:0/', MASTER, 'nothing',
    'http://127.0.0.1:99999/', 'http://127.0.0.1:1/' + 'x' * 5000)
for number, address in enumerate(ADDRESSES):
    name = 'address%d' % number
    attempt(name, lambda: proxy().registerPublisher('/' + name, '/' + name, 'std_msgs/Int8', address))
attempt('long', lambda: proxy().registerPublisher('/attack', '/' + 'n' * 100000, 'std_msgs/Int8', SILENT))
attempt('control', lambda: proxy().registerPublisher('/attack', '/a\\nb', 'std_msgs/Int8', SILENT))
attempt('types', lambda: proxy().registerPublisher(5, ['/a'], {}, SILENT))
one = proxy()
for number in range(1100):
    one.registerSubscriber('/attack', '/t%d' % number + 'x' * 200, 'std_msgs/Int8', SILENT)
    one.registerService('/attack', '/s%d' % number, 'rosrpc://127.0.0.1:%d' % listener.getsockname()[1], SILENT)
    one.registerPublisher('/attack%d' % number, '/p%d' % number, 'std_msgs/Int8', SILENT)
    one.unregisterSubscriber('/attack', '/t%d' % number + 'x' * 200, SILENT)
print('registered')
"""


def test_registrations_without_end(tmp_path: Path) -> None:
    seen = beside_a_talker(tmp_path, REGISTRATIONS, ends=True)
    assert_unharmed(seen)
    assert_told(
        told(seen, "refused"), ("the address http://192.0.2.1/", "file:///etc/passwd", "127.0.0.1:0/")
    )
    assert_told(
        told(seen, "refused"),
        ("127.0.0.1:11311/", "nothing", "99999", "something that is not a name", "not a string"),
    )
    assert_told(told(seen, "limit"), ("more topics and services than a process may",))
    assert "/talker" in seen.student_nodes("talker")
    assert sum(len(e.model_dump_json()) for _, e in seen.graph) < 7 << 20


IMPERSONATION = """
listener = socket.create_server(('127.0.0.1', 0))
MINE = 'http://127.0.0.1:%d/' % listener.getsockname()[1]
one = proxy()
while not any('/chatter' == topic for topic, _ in one.getPublishedTopics('/attack', '')[2]):
    time.sleep(0.05)
talker = one.lookupNode('/attack', '/talker')[2]
rosout = one.lookupNode('/attack', '/rosout')[2]
attempt('shutdown', lambda: one.shutdown('/attack', 'x'))
attempt('unregister', lambda: one.unregisterPublisher('/talker', '/chatter', talker))
attempt('subscriber', lambda: one.unregisterSubscriber('/rosout', '/rosout', rosout))
attempt('as talker', lambda: one.registerPublisher('/talker', '/forged', 'std_msgs/Int8', talker))
attempt('over talker', lambda: one.registerPublisher('/talker', '/forged', 'std_msgs/Int8', 'http://127.0.0.1:1/'))
attempt('param', lambda: one.subscribeParam('/talker', 'http://127.0.0.1:1/', '/x'))
attempt('its address', lambda: one.registerPublisher('/attack', '/forged', 'std_msgs/Int8', talker))
attempt('rosout', lambda: one.registerSubscriber('/rosout', '/rosout', 'rosgraph_msgs/Log', MINE))
attempt('rosout param', lambda: one.setParam('/rosout', '/forged', 1))
attempt('recorder', lambda: one.setParam('/grader_recorder_00000000', '/forged', 1))
attempt('actor', lambda: one.registerPublisher('/grader_actor_00000000', '/clock', 'rosgraph_msgs/Clock', MINE))
attempt('bare', lambda: one.setParam('/grader', '/bare', 1))
loggers = '/talker/get_loggers'
attempt('service', lambda: one.unregisterService('/talker', loggers, one.lookupService('/attack', loggers)[2]))
attempt('cleanup', lambda: one.unregisterPublisher('/talker', '/chatter', 'http://127.0.0.1:1/'))
attempt('mine', lambda: one.registerPublisher('/attack', '/mine', 'std_msgs/Int8', MINE))
attempt('mine off', lambda: one.unregisterPublisher('/attack', '/mine', MINE))
rosout_api = xmlrpc.client.ServerProxy(rosout)
attempt('update', lambda: rosout_api.publisherUpdate('/master', '/rosout', [MINE] * 50))
attempt('rosout down', lambda: rosout_api.shutdown('/attack', 'x'))
print('done')
"""


@pytest.mark.parametrize("sandbox", ["auto", "none"])
def test_calls_in_the_name_of_others(tmp_path: Path, sandbox: str) -> None:
    seen = beside_a_talker(tmp_path, IMPERSONATION, ends=True, sandbox=sandbox)
    assert_unharmed(seen)
    lines = {line.split(" ")[0]: line for line in printed(seen, "attack")}
    assert "done" in lines
    refused = told(seen, "refused")
    assert_told(
        refused, ("asked the master to shut down", "unregistered /chatter of /talker, a node of talker")
    )
    assert_told(refused, ("registered /forged for /talker", "registered /talker with an address of talker"))
    assert_told(
        refused, ("in the name of /rosout", "grader's node /grader_recorder_", "/grader_actor_00000000")
    )
    assert_told(refused, ("registered /attack with an address of talker", "/talker/get_loggers of /talker"))
    for allowed in ("bare", "cleanup", "mine"):
        assert " [1, " in lines[allowed]
    assert not any("/forged" in e.publishers for _, e in seen.graph)
    assert not any(e.name == "/forged" for _, e in seen.params)
    assert [e.caller_id for _, e in seen.params if seen.is_student_node(e.caller_id)] == ["/grader"]
    assert_told(refused, ("told the grader's node to shut down",))


PUBLISHERS = """
class Node:
    # A publisher by hand: what `serve` does with each connection is the attack.
    def __init__(self, name, topic, serve):
        self.serve = serve
        self.data = socket.create_server(('127.0.0.1', 0), backlog=100)
        self.api = xmlrpc.server.SimpleXMLRPCServer(('127.0.0.1', 0), logRequests=False)
        self.port = self.data.getsockname()[1]
        self.api.register_function(lambda *_: [1, '', ['TCPROS', '127.0.0.1', self.port]], 'requestTopic')
        self.api.register_function(lambda *_: [1, '', [['x', '/y', 'o', 'TCPROS', '/z']] * 50000], 'getBusInfo')
        threading.Thread(target=self.api.serve_forever, daemon=True).start()
        threading.Thread(target=self.accept, daemon=True).start()
        self.uri = 'http://127.0.0.1:%d/' % self.api.server_address[1]
        self.name, self.topic = name, topic
        print(name, proxy().registerPublisher(name, topic, 'std_msgs/Int32', self.uri)[0])
    def accept(self):
        while True:
            sock, _ = self.data.accept()
            threading.Thread(target=self.talk, args=(sock,), daemon=True).start()
    def talk(self, sock):
        try:
            sock.recv(struct.unpack('<I', sock.recv(4))[0])
            self.serve(sock)
        except OSError:
            pass
FIELDS = {'type': 'std_msgs/Int32', 'md5sum': 'da5909fbe378aeaf85e547e830cc1bb7', 'message_definition': 'int32 data'}
def header(**changed):
    fields = {'callerid': '/talker', **FIELDS, **changed}
    parts = [name.encode() + b'=' + (value if isinstance(value, bytes) else value.encode())
        for name, value in fields.items()]
    body = b''.join(struct.pack('<I', len(part)) + part for part in parts)
    return struct.pack('<I', len(body)) + body
def with_messages(*data):
    def serve(sock):
        sock.sendall(header())
        for one in data:
            sock.sendall(one)
        time.sleep(60)
    return serve
def slowly(sock):
    for byte in header():
        sock.sendall(bytes([byte]))
        time.sleep(0.2)
MESSAGE = struct.pack('<Ii', 4, 7)
Node('/h_slow', '/h_slow', slowly)
Node('/h_4gb', '/h_4gb', lambda sock: sock.sendall(struct.pack('<I', 2 ** 32 - 1) + b'x' * 1000))
Node('/h_bytes', '/h_bytes', lambda sock: sock.sendall(header(type=b'\\xff\\xfe/Int32')))
Node('/h_control', '/h_control', lambda sock: sock.sendall(header(type='std_msgs/\\x1b[31mInt32')))
Node('/h_nothing', '/h_nothing', lambda sock: sock.sendall(struct.pack('<I', 9) + struct.pack('<I', 5) + b'a=b=c'))
Node('/h_long', '/h_long', lambda sock: sock.sendall(header(md5sum='0' * 5000)))
Node('/h_definition', '/h_definition', lambda sock: sock.sendall(header(message_definition='int32 data\\n' * 10000)))
Node('/m_4gb', '/m_4gb', with_messages(MESSAGE, struct.pack('<I', 2 ** 32 - 1), b'x' * 100000))
Node('/m_half', '/m_half', with_messages(MESSAGE, MESSAGE[:6]))
Node('/m_garbage', '/m_garbage', with_messages(MESSAGE, os.urandom(50000)))
STRING = header(type='std_msgs/String', md5sum='992ce8a1687cec8c8bd883ec73ca41d1')
Node('/m_other', '/m_other', lambda sock: (sock.sendall(STRING + MESSAGE), time.sleep(60)))
for number in range(4):
    Node('/w%d' % number, '/w%d' % number, with_messages(*[struct.pack('<I', 15 << 20) + bytes(14 << 20)]))
again = Node('/again', '/again', lambda sock: sock.sendall(header() + MESSAGE))
one = proxy()
for number in range(300):
    one.registerPublisher('/again', '/again', 'std_msgs/Int32', again.uri)
    one.unregisterPublisher('/again', '/again', again.uri)
mute = socket.create_server(('127.0.0.1', 0), backlog=1000)
for number in range(300):
    one.registerPublisher('/mute', '/mute%d' % number, 'std_msgs/Int32', 'http://127.0.0.1:%d/' % mute.getsockname()[1])
def endless():
    while True:
        sock, _ = bomb.accept()
        threading.Thread(target=pour, args=(sock,), daemon=True).start()
def pour(sock):
    try:
        sock.recv(65536)
        sock.sendall(b'HTTP/1.1 200 OK\\r\\nContent-Type: text/xml\\r\\n\\r\\n<methodResponse><params><param><value>')
        while True:
            sock.sendall(b'x' * 65536)
    except OSError:
        pass
bomb = socket.create_server(('127.0.0.1', 0), backlog=1000)
threading.Thread(target=endless, daemon=True).start()
for number in range(20):
    one.registerPublisher('/bomb', '/bomb%d' % number, 'std_msgs/Int32', 'http://127.0.0.1:%d/' % bomb.getsockname()[1])
one.registerSubscriber('/bomb', '/chatter', 'std_msgs/Int32', 'http://127.0.0.1:%d/' % bomb.getsockname()[1])
print('done')
time.sleep(4)
"""


def test_publishers_that_do_not_keep_to_the_protocol(tmp_path: Path) -> None:
    seen = beside_a_talker(tmp_path, PUBLISHERS, window_s=4, ends=True)
    assert_unharmed(seen, window_s=4)
    assert "done" in printed(seen, "attack")
    whole = {c.callerid: len(c.messages) for c in seen.student_channels() if c.callerid.startswith("/m_")}
    assert whole == {"/m_4gb": 1, "/m_half": 1, "/m_garbage": 1, "/m_other": 1}
    assert {c.callerid for c in seen.student_channels("/chatter")} == {"/talker"}
    assert not any(c.callerid.startswith("/h_") for c in seen.channels)
    assert_told(told(seen, "limit"), ("began a message of 4095 MB on /m_4gb", "on /w3 than is recorded"))
    assert sum(e.topic == "/again" for _, e in seen.recorder) <= 700


ACTOR = """
import rospy
from std_msgs.msg import String
rospy.init_node('attack')
rospy.Subscriber('said', String, lambda message: None)
rospy.Subscriber('other', rospy.AnyMsg, lambda message: None)
one = proxy()
node = next(node for topic, nodes in one.getSystemState('/attack')[2][0] for node in nodes if topic == '/said')
api = xmlrpc.client.ServerProxy(one.lookupNode('/attack', node)[2])
port = api.requestTopic('/attack', '/said', [['TCPROS']])[2][2]
def header(**fields):
    body = b''.join(struct.pack('<I', len(f)) + f for f in (('%s=%s' % item).encode() for item in fields.items()))
    return struct.pack('<I', len(body)) + body
attempt('down', lambda: api.shutdown('/attack', 'x'))
attempt('protocols', lambda: api.requestTopic('/attack', '/said', 5))
attempt('topic', lambda: api.requestTopic('/attack', ['/said'], [['TCPROS']]))
attempt('private', lambda: api._actor())
attempt('4gb', lambda: send(b'\\xff\\xff\\xff\\xff', port))
attempt('field', lambda: send(struct.pack('<I', 8) + struct.pack('<I', 4000000000) + b'a=b=', port))
attempt('bytes', lambda: send(header(topic='/said', md5sum='*', type='*', callerid='\\x1b[31m'), port))
attempt('garbage', lambda: send(os.urandom(5000), port))
attempt('large', lambda: post(b'x' * 100, 'Content-Length: 999999999'))
deaf = [send(header(topic='/said', md5sum='*', type='*', callerid='/deaf%d' % n), port, wait=False) for n in range(70)]
assert all(sock.recv(1) for sock in deaf[:64])
idle = [send(b'\\x10', port, wait=False) for _ in range(800)]
print('done')
rospy.spin()
"""
LISTENER = """
import rospy
from std_msgs.msg import String
rospy.init_node('listener')
rospy.Subscriber('said', String, lambda message: print('heard', message.data))
rospy.spin()
"""


def test_attacks_on_the_node_that_sends_messages(tmp_path: Path) -> None:
    files = {"scripts/attack.py": ATTACK + ACTOR, "scripts/listener.py": SCRIPT + LISTENER}
    scenario = Scenario(
        title="attack",
        start=(
            Start(name="listener", script="listener.py"),
            Start(name="attack", script="attack.py", after="listener"),
        ),
        probes=(Probe(topic="/said", type="std_msgs/String", text=6, rate_hz=5),),
        until=Until(heard=True, limit_s=25),
    )
    with make_place(files) as place:
        seen = run(place, scenario, tmp_path / "run.mcap")
    assert "done" in printed(seen, "attack")
    sent = [e.value for _, e in seen.actors if e.action == "publish"]
    assert len(sent) >= 6
    assert [line[6:] for line in printed(seen, "listener")] == sent
    assert_told(
        told(seen, "refused"),
        ("told the grader's node to shut down", "no header: connection header of 4294967295"),
    )
    assert_told(told(seen, "limit"), ("connections to the grader's node that said nothing", "64 subscribers"))
    assert exit_of(seen, "arena").max_rss_bytes < ARENA_BYTES_MAX


FLOOD = """
import rospy, std_msgs.msg, threading
rospy.init_node('attack')
def flood(topic, message, text):
    publisher = rospy.Publisher(topic, message, queue_size=1)
    while not rospy.is_shutdown():
        publisher.publish(text)
threading.Thread(target=flood, args=('large', std_msgs.msg.String, 'x' * (1 << 20)), daemon=True).start()
log = rospy.Publisher('/rosout', __import__('rosgraph_msgs.msg').msg.Log, queue_size=10)
for _ in range(3):
    log.publish(msg='y' * (10 << 20) + chr(27) + '[31m')
listening = socket.create_server(('127.0.0.1', 0))
def small():
    # Messages as fast as the kernel takes them, 100000 in one write.
    data = struct.pack('<Ib', 1, 7) * 100000
    while True:
        sock, _ = listening.accept()
        size, = struct.unpack('<I', sock.recv(4))
        knock = b'_knock' in sock.recv(size)
        fields = (b'type=std_msgs/Int8', b'md5sum=27ffa0c9c4b8fb8492252bcad9e5c57b', b'message_definition=int8 data')
        body = b''.join(struct.pack('<I', len(field)) + field for field in fields)
        sock.sendall(struct.pack('<I', len(body)) + body)
        if not knock:
            threading.Thread(target=pour, args=(sock, data), daemon=True).start()
def pour(sock, data):
    while True:
        sock.sendall(data)
threading.Thread(target=small, daemon=True).start()
api = xmlrpc.server.SimpleXMLRPCServer(('127.0.0.1', 0), logRequests=False)
api.register_function(lambda *_: [1, '', ['TCPROS', '127.0.0.1', listening.getsockname()[1]]], 'requestTopic')
threading.Thread(target=api.serve_forever, daemon=True).start()
print(proxy().registerPublisher('/pour', '/small', 'std_msgs/Int8', 'http://127.0.0.1:%d/' % api.server_address[1]))
rospy.spin()
"""


def test_floods_of_messages(tmp_path: Path) -> None:
    seen = beside_a_talker(tmp_path, FLOOD, limits=RunLimits(run_bytes=32 << 20))
    assert_unharmed(seen)
    recorded = {c.topic: sum(len(m.data) for m in c.messages) for c in seen.channels}
    assert 1 << 20 < recorded["/large"] < 24 << 20
    assert sum(recorded.values()) < 32 << 20
    (small,) = seen.student_channels("/small")
    assert 180 <= len(small.messages) <= RunLimits().channel_messages
    closed = {e.topic: e.dropped for _, e in seen.recorder if e.event == "closed"}
    assert closed["/small"] > 100_000
    assert closed["/chatter"] == 0
    assert_told(
        told(seen, "limit"), ("sent more on /small than is recorded", "sent more on /large than is recorded")
    )


NAMED = """
import rospy
from std_msgs.msg import Int32
rospy.init_node('{0}')
rospy.set_param('/{0}_was_here', 1)
pub = rospy.Publisher('{0}', Int32, queue_size=10, latch=True)
pub.publish(5)
rospy.spin()
"""
TOOLS = """
rosparam set /from_tool 5
rosparam get /from_tool
rosnode info /grader > /dev/null
rosservice list > /dev/null
echo y | rosnode cleanup
rosnode kill /grader_helper
echo tools done
"""
LAUNCH = """<launch>
  <param name="/use_sim_time" value="false" />
  <node pkg="lab" type="once.py" name="once" respawn="true" respawn_delay="0.1" />
</launch>
"""
ONCE = SCRIPT + "import rospy, sys\nrospy.init_node('once')\nprint('once', flush=True)\n"


def test_what_honest_programs_do_is_let_through(tmp_path: Path) -> None:
    """Names like the grader's, tools that speak for others, a dead node's name taken over, a parameter of ROS's own."""
    files = {
        "scripts/grader.py": SCRIPT + NAMED.format("grader"),
        "scripts/helper.py": SCRIPT + NAMED.format("grader_helper"),
        "scripts/tools.py": SCRIPT + f"import subprocess\nsubprocess.run(['bash', '-c', {TOOLS!r}])\n",
        "scripts/once.py": ONCE,
        "launch/respawn.launch": LAUNCH,
    }
    starts = (
        Start(name="grader", script="grader.py"),
        Start(name="helper", script="helper.py"),
        Start(name="launch", launch="respawn.launch"),
        Start(name="tools", script="tools.py", after="helper"),
    )
    until = Until(ended=("tools", "helper"), first_message_s=15, silent_s=15, limit_s=30)
    with make_place(files) as place:
        seen = run(place, Scenario(title="honest", start=starts, until=until), tmp_path / "run.mcap")
    assert [e for _, e in seen.actors if e.action in {"refused", "limit"}] == []
    assert "tools done" in printed(seen, "tools")
    assert {"/grader", "/grader_helper", "/once"} <= set(seen.student_nodes())
    assert seen.student_nodes("grader") == ("/grader",)
    (channel,) = seen.student_channels("/grader")
    assert channel.data == (5,)
    assert seen.student_channels("/grader_helper")[0].data == (5,)
    by = {e.name: e.caller_id for _, e in seen.params if seen.is_student_node(e.caller_id)}
    assert by["/grader_was_here"] == "/grader"
    assert by["/grader_helper_was_here"] == "/grader_helper"
    assert by["/use_sim_time"] == "/roslaunch"
    assert "/from_tool" in by
    assert sum("once" in line for line in printed(seen, "launch")) > 1
