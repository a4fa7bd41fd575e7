"""Right scripts in styles that few students write: no finder of slips says anything of them."""

from __future__ import annotations

from pathlib import Path

import pytest

from grader.package.python import check_syntax

pytestmark = pytest.mark.usefixtures("without_processes")

RIGHT = {
    "pause-in-a-function": ("sleep-outside", """\
def ok():
    rate.sleep()
    return not rospy.is_shutdown()

while ok():
    pub.publish(1)
"""),
    "ticks-of-a-generator": ("sleep-outside", """\
def ticks(rate):
    while not rospy.is_shutdown():
        yield
        rate.sleep()

for _ in ticks(rospy.Rate(10)):
    pub.publish(1)
"""),
    "rate-of-another-function": ("sleep-outside", """\
def made():
    rate = rospy.Rate(10)
    return rate

def run(turns):
    while next(turns):
        pub.publish(1)
"""),
    "several-publishers": ("sleep-outside", """\
while not rospy.is_shutdown():
    for pub in pubs:
        pub.publish(1)
    rate.sleep()
"""),
    "ended-by-a-hook": ("deaf", """\
class A:
    def stop(self):
        self.stopped = True

    def run(self):
        rospy.on_shutdown(self.stop)
        while not self.stopped:
            rate.sleep()
"""),
    "ended-by-an-event": ("deaf", "rospy.on_shutdown(stop.set)\nwhile not stop.wait(1.0):\n    pub.publish(1)\n"),
    "iterator-until-the-end": ("loop-left", """\
class Pace:
    def __next__(self):
        if rospy.is_shutdown():
            raise StopIteration
        rate.sleep()

for _ in Pace():
    pub.publish(1)
"""),
    "decorator-that-prints": ("not-printed", """\
@printed
def heard(msg):
    return msg.data

rospy.Subscriber('a', String, heard)
"""),
    "object-that-is-called": ("callback-missing", """\
class A:
    def __call__(self, msg):
        print(msg.data)

rospy.Subscriber('a', String, A())
"""),
    "count-of-the-function-around": ("undefined", """\
import rospy
def run(pub):
    n = 0
    def tick(event):
        nonlocal n
        pub.publish(n)
        n = n + 1
    rospy.Timer(rospy.Duration(0.1), tick)
"""),
    "endless-generator": ("deaf", "def numbers():\n    while True:\n        yield from range(128)\n"),
    "asks-in-a-function": ("deaf", """\
def ok():
    rate.sleep()
    return not rospy.is_shutdown()

while ok():
    pub.publish(1)
"""),
    "ends-on-a-signal": ("deaf", """\
def stop(number, frame):
    rospy.signal_shutdown('signal')

rospy.init_node('a', disable_signals=True)
signal.signal(signal.SIGINT, stop)
"""),
    "robot-that-arrives": ("loop-left", """\
while distance() > 0.1 and not rospy.is_shutdown():
    twist.angular.z = 1
    pub.publish(twist)
    rate.sleep()
pub.publish(Twist())
rospy.spin()
"""),
    "set-above": ("object", """\
class A:
    def f(self):
        self.reset()
        return self.n

    def reset(self):
        self.n = 0
"""),
    "set-on-entering": ("object", """\
class A:
    def __enter__(self):
        self.n = 0

    def f(self):
        return self.n
"""),
    "flag": ("not-called", """\
class A:
    def __init__(self):
        self.is_shutdown = False

    def f(self):
        while not self.is_shutdown:
            pass
"""),
    "property": ("not-called", """\
class A:
    @property
    def is_shutdown(self):
        return False

    def f(self):
        while not self.is_shutdown:
            pass
"""),
    "own-timer": ("callback-values", "class Timer:\n    pass\n\ndef tick():\n    pass\n\nTimer(1, tick)\n"),
    "both-Pythons": ("undefined", "import sys\nif sys.version_info[0] < 3:\n    range = xrange\n"),
    "setter": ("undefined", """\
class A:
    @property
    def n(self):
        return 1

    @n.setter
    def n(self, n):
        pass
"""),
    "default-of-a-class": ("undefined", """\
class A:
    LIMIT = 5

    def f(self, n=LIMIT):
        return n
"""),
    "maker-of-callbacks": ("callback-called", """\
def made(topic):
    def heard(msg):
        print(topic, msg.data)
    return heard

rospy.Subscriber('a', String, made('a'))
"""),
    "maker-of-lambdas": ("callback-called", """\
def made(topic):
    return lambda msg: print(topic, msg)

rospy.Subscriber('a', String, made('a'))
"""),
    "publisher-of-another-object": ("never-published", """\
class A:
    def __init__(self):
        self.out = rospy.Publisher('a', Int8)

a = A()
a.out.publish(1)
"""),
    "publisher-of-two-branches": ("never-published", """\
if loud:
    pub = rospy.Publisher('a', Int8)
else:
    pub = rospy.Publisher('b', Int8)
pub.publish(1)
"""),
    "publisher-used-and-replaced": ("never-published", """\
pub = rospy.Publisher('a', Int8)
pub.publish(1)
pub = rospy.Publisher('b', Int8)
pub.publish(2)
"""),
    "publisher-of-a-class": ("never-published", """\
class A:
    pub = rospy.Publisher('a', Int8)

    def f(self):
        self.pub.publish(1)
"""),
    "publisher-of-a-type": ("never-published", """\
class A:
    def __init__(self):
        type(self).pub = rospy.Publisher('a', Int8)
"""),
    "signals-as-always": ("deaf", "rospy.init_node('a', disable_signals=False)\n"),
    "unregisters-below-spin": ("unregistered", "s = rospy.Subscriber('a', A, print)\nrospy.spin()\ns.unregister()\n"),
    "unregisters-below-its-loop": ("unregistered", """\
def main():
    while not rospy.is_shutdown():
        rate.sleep()
    s.unregister()
main()
"""),
    "unregisters-finally": ("unregistered", "try:\n    rospy.spin()\nfinally:\n    s.unregister()\n"),
    "unregisters-on-leaving": ("unregistered", """\
class A:
    def __exit__(self, *why):
        self.pub.unregister()
"""),
    "sleep-of-another-function": ("sleep-outside", """\
def leave():
    rospy.sleep(1)
def burst():
    for n in range(3):
        pub.publish(n)
"""),
    "counter-of-an-inner-loop": ("set-in-loop", """\
while not rospy.is_shutdown():
    n = 0
    while n < 4:
        pub.publish(n)
        n += 1
"""),
    "given-to-another-module": ("object", """\
class A:
    def __init__(self):
        fill(self)
        self.pub.publish(1)
"""),
    "class-in-a-method": ("object", """\
class A:
    def test(self):
        class B:
            def reset(self): pass
        B().reset()
"""),
    "method-of-a-module": ("never-called", "class A:\n    def stop(self):\n        self.pub.publish(0)\n"),
    "state-of-a-base": ("not-called", "class A(B):\n    def f(self):\n        if self.is_shutdown:\n            f()\n"),
    "callback-of-a-base": ("callback-missing", "class A(B):\n    def hear(self, msg):\n        print(msg.data)\n"),
    "next-axis": ("misspelt", "max_z = 1\nprint(max_x)\n"),
    "asked-by-others": ("loop-left", "def send():\n    if not rospy.is_shutdown():\n        pub.publish(0)\n"),
    "called-by-name": ("never-called", """\
class A:
    def __init__(self):
        rospy.Subscriber('a', Int8, getattr(self, 'on_' + 'a'))

    def on_a(self, msg):
        self.pub.publish(msg)
"""),
}  # fmt: skip


@pytest.mark.parametrize("name", RIGHT)
def test_a_style_that_few_students_write_is_no_slip(name: str, tmp_path: Path) -> None:
    kind, text = RIGHT[name]
    (tmp_path / "a.py").write_text(text, encoding="utf-8")
    assert [s.message for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind.startswith(kind)] == []


LIKE_SLIPS = {
    "squares-compared": "distance = a ** 2 + b ** 2\nprint(distance > R ** 2)\n",
    "root-below": "dist = a ** 2 + b ** 2\nprint(math.sqrt(dist))\n",
    "nearest": "def distance(p):\n    return p.x ** 2 + p.y ** 2\nprint(min(points, key=distance))\n",
    "halved-in-place": "yaw /= 2\nq = Quaternion(0, 0, sin(yaw), cos(yaw))\n",
    "halved-inside": "a = radians(turn / 2)\nq = Quaternion(0, 0, sin(a), cos(a))\n",
    "half-given": "def f(half):\n    return Quaternion(0, 0, sin(half), cos(half))\n",
    "square-grid": "m.info.width = n\nm.info.height = n\nm.data = cells\nprint(m.data[row * n + column])\n",
    "own-order": "w = m.info.width\nh = m.info.height\nprint(seen[x * h + y], m.data[y * w + x])\n",
    "none-left": "def f(a):\n    n = int(a / 2)\n    if n == 0 or n > 0:\n        print(n)\n",
    "not-below-0": "def f(a):\n    n = int(a / 2)\n    if n < 0:\n        n = 0\n    print(n)\n",
    "own-secs": "class A:\n    def f(self):\n        self.secs = rospy.get_time()\n",
    "other-mean": "print(m.ranges[0], sum(speeds) / len(speeds))\n",
    "own-theta": "print(math.radians(args.theta))\n",
    "own-response": "def sendResponse(a):\n    print(a)\nsendResponse(1)\n",
    "set-first": "if not rospy.has_param('a'):\n    rospy.set_param('a', 1)\n    print(rospy.get_param('a'))\n",
    "each-range": "for r in m.ranges:\n    if r < 1:\n        t = 'a'\n    else:\n        t = 'b'\n    p.publish(t)\n",
    "given-by-name": "s = Namespace(go=True)\ndef f(m):\n    s.go = False\nwhile s.go:\n    p.publish(1)\n",
    "given-by-base": "class A(Robot):\n    def f(self):\n        self.go = False\n"
                     "        while self.go:\n            p()\n",
    "waited-for": "while not rospy.is_shutdown():\n    e = TransformListener()\n    e.waitForTransform(a, b, t, d)\n",
    "zero-by-key": "t = Twist()\ndef f(m):\n    if m.a:\n        t.linear.x = 1\n    elif m.b:\n"
                   "        t.linear.x = 0\n    p.publish(t)\n",
    "made-again": "class A:\n    def f(self):\n        self.t = Twist()\n    def g(self, m):\n        self.f()\n"
                  "        if m.a:\n            self.t.linear.x = 1\n        p.publish(self.t)\n",
    "made-twice": "class A:\n    def g(self, m):\n        self.t = Twist()\n        if m.a:\n"
                  "            self.t.linear.x = 1\n        p.publish(self.t)\n"
                  "    def f(self):\n        self.t = Twist()\n",
    "part": "from g.msg import Twist, Vector3\nt = Twist()\nt.linear = Vector3()\nt.linear.x = 1\np.publish(t)\n",
    "timer-of-python": "def f():\n    print(1)\nthreading.Timer(1, f).start()\n",
    "timer-imported": "from threading import Timer\ndef f():\n    print(1)\nTimer(1, f).start()\n",
}  # fmt: skip
"""Lines that are right, although they look like slips."""


@pytest.mark.parametrize("text", LIKE_SLIPS.values(), ids=LIKE_SLIPS)
def test_a_line_that_looks_like_a_slip_and_is_right(text: str, tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text(text, encoding="utf-8")
    kinds = {"wrong-value", "never-begun", "loop-left", "object", "callback-values"}
    told = [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind in kinds]
    assert [s.message for s in told if "had not been reached" not in s.message] == []


UNHEARD = "def hear(msg):\n    print(msg.data)\ndef other(msg):\n    print(msg.data)\n"


@pytest.mark.parametrize(
    ("text", "kinds"),
    [
        ("def talk():\n    while True:\n        rate.sleep()\n    rate = rospy.Rate(10)\n", {"undefined"}),
        (
            "def talk():\n    def hear(msg):\n        pub.publish(msg)\n    pub = rospy.Publisher('a', Int8)\n",
            set(),
        ),
        ("def talk():\n    global rate\n    rate.sleep()\n    rate = rospy.Rate(10)\n", set()),
        ("def talk(rate):\n    rate.sleep()\n    rate = rospy.Rate(10)\n", set()),
        (
            "while not rospy.is_shutdown():\n    rospy.Subscriber('a', Int8, hear)\n    rate.sleep()\n",
            {"subscribed-again"},
        ),
        ("while not rospy.is_shutdown():\n    rospy.Subscriber('a', Int8, hear)\n    rospy.spin()\n", set()),
        ("while x:\n    print(rospy.wait_for_message('a', Int8))\n", {"subscribed-again"}),
        ("m = rospy.wait_for_message('a', Int8)\nwhile x:\n    print(m)\n", set()),
        ("m = None\nwhile m is None:\n    m = rospy.wait_for_message('a', Int8)\n", set()),
        ("while x:\n    m = rospy.wait_for_message('a', Int8)\n    if m.data:\n        break\n", set()),
        (
            "def hear(msg):\n    pass\ndef hear(msg):\n    pass\nrospy.Subscriber('a', Int8, hear)\n",
            {"defined-twice"},
        ),
        ("def hear(msg):\n    pass\ndef other(msg):\n    pass\nrospy.Subscriber('a', Int8, hear)\n", set()),
        (
            f"{UNHEARD}rospy.Subscriber('a', Int8, hear)\nrospy.Subscriber('b', String, hear)\n",
            {"defined-twice"},
        ),
        (f"{UNHEARD}rospy.Subscriber('a', Int8, hear)\nrospy.Subscriber('b', Int8, hear)\n", set()),
        (
            "from rospy import Subscriber\nclass Subscriber:\n    pass\nSubscriber('a', Int8, print)\n",
            {"defined-twice"},
        ),
        ("while rospy.is_shutdown():\n    pub.publish(1)\n", {"never-begun"}),
        ("over = True\nwhile not over:\n    pub.publish(1)\n", {"never-begun"}),
        ("self.go = False\nwhile self.go:\n    pub.publish(1)\n", {"never-begun"}),
        ("over = True\nover = False\nwhile not over:\n    pub.publish(1)\n", set()),
        ("over = True\ndef stop(over):\n    while not over:\n        pub.publish(1)\n", set()),
        ("over, n = True, 1\nwhile not over:\n    pub.publish(1)\n", set()),
        (
            "while not rospy.is_shutdown():\n    pub.publish(1)\n    if n:\n        rate.sleep()\n",
            {"sleep-outside"},
        ),
        ("while not rospy.is_shutdown():\n    if n:\n        pub.publish(1)\n        rate.sleep()\n", set()),
    ],
)
def test_slips_that_hide_what_was_meant(tmp_path, text, kinds):
    (tmp_path / "a.py").write_text(text)
    looked_for = {"subscribed-again", "defined-twice", "never-begun", "loop-left", "sleep-outside"}
    found = [
        s for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind in looked_for or "after it" in s.message
    ]
    assert {s.kind for s in found} == kinds
