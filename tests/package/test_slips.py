"""What compiles in a student's Python and is not meant: the slips that show only when the node runs."""

from __future__ import annotations

import inspect
import re
from pathlib import Path
from typing import get_args

import pytest

from grader.model.python_slip import PythonSlip, SlipKind
from grader.package.python import check_syntax

pytestmark = pytest.mark.usefixtures("without_processes")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("if r == float('nan') or r > 2:\n    r = 0\n", ("nan", "write `math.isnan(r)`")),
        ("ok = math.nan != scan.ranges[i]\n", ("nan", "write `math.isnan(…)`")),
        (
            "a = math.degrees(a)\nx = r * math.cos(a)\n",
            ("degrees", "leave out `degrees(…)`: the angle is already in radians"),
        ),
        ("x = math.cos(math.radians(a))\n", None),
        ("def f(req):\n    AddResponse(sum=1)\n", ("return", "write `return AddResponse(…)`")),
        ("def f(req):\n    return AddResponse(sum=1)\n", None),
        (
            "def f(req):\n    a = AddResponse()\n    s = req.a\n    return a\n",
            ("empty", "set it above the `return`: `a.<field> = …`"),
        ),
        ("def f(req):\n    a = AddResponse()\n    a.sum = req.a\n    return a\n", None),
        ("def f(req):\n    a = AddResponse()\n    fill(a)\n    return a\n", None),
        ("def f(req):\n    a = EmptyResponse()\n    return a\n", None),
        (
            "def f(req):\n    a = AddResponse()\n    def g():\n        a.sum = 1\n    g()\n    return a\n",
            None,
        ),
        (
            "def f(req):\n    a = AddResponse()\n    if req.a:\n        return AddResponse(1)\n    return a\n",
            None,
        ),
    ],
)
def test_values_that_are_none(text: str, said: tuple[str, str] | None, tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text(text, encoding="utf-8")
    found = [(s.name, s.fix) for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind == "wrong-value"]
    assert found == ([said] if said else [])


@pytest.mark.parametrize(
    ("head", "fixes"),
    [
        ("r.init_node('a')\ndef heard(msg):", ["below line 1, write `r.Subscriber(…, heard)`"]),
        ("def heard(msg, /):", []),
        ("def heard(*, msg):", []),
    ],
)
def test_a_function_that_reads_messages_and_has_no_subscriber(
    head: str, fixes: list[str], tmp_path: Path
) -> None:
    (tmp_path / "a.py").write_text(f"{head}\n    print(msg.data)\n", encoding="utf-8")
    found = [s.fix for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind == "callback-missing"]
    assert found == fixes


@pytest.mark.parametrize(
    ("head", "fix"),
    [
        ("def heard(msg):", "pass it to what calls it: `rospy.Subscriber(…, heard)`"),
        ("def on_feedback(msg):", "pass it: `send_goal(…, feedback_cb=on_feedback)`"),
        ("def heard(msg, pub):", "call `heard(…)` with values for msg, pub"),
        ("def heard(msg, pub=None):", ""),
    ],
)
def test_a_callback_that_is_handed_to_nobody_is_to_be_handed_over(
    head: str, fix: str, tmp_path: Path
) -> None:
    (tmp_path / "a.py").write_text(f"{head}\n    p.publish(1)\nclient.send_goal(1)\n", encoding="utf-8")
    (slip,) = (s for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind == "never-called")
    assert slip.fix == fix


def test_the_line_that_calls_the_debugger_is_found(tmp_path):
    text = "from pdb import set_trace\nimport ipdb\ndef f():\n    set_trace()\n    ipdb.set_trace()\n    breakpoint()\n"
    (tmp_path / "a.py").write_text(text)
    found = [(s.line, s.name) for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind == "debugger"]
    assert found == [(4, "set_trace"), (5, "ipdb.set_trace"), (6, "breakpoint")]


def test_slips_are_found_and_named(tmp_path):
    text = (
        "import rospy, sys\ndef main():\n    rate = rospy.Rate(10)\n    while not rospy.is_shutdown:\n"
        "        rate.sleep\n        x = input('?')\n        y = raw_input()\n    z = sys.stdin.readline()\n"
        "    rate.sleep()\n    main.note = 1\n'text'\n"
        "if __name__ == '__main__':\n    main\n    f().sleep\n    m.pose.x\n"
    )
    (tmp_path / "a.py").write_text(text)
    (tmp_path / "own.py").write_text("def input():\n    pass\ninput()\n")
    slips = check_syntax(tmp_path, ["a.py", "own.py"]).slips
    slips = [s for s in slips if s.kind != "undefined"]
    assert [(s.file, s.line, s.kind) for s in slips] == [
        ("a.py", 1, "no-init"),
        ("a.py", 3, "rate-number"),
        ("a.py", 4, "not-called"),
        ("a.py", 5, "not-called"),
        ("a.py", 6, "input"),
        ("a.py", 6, "typed-text"),
        ("a.py", 7, "input"),
        ("a.py", 8, "input"),
        ("a.py", 13, "not-called"),
        ("a.py", 14, "not-called"),
        ("own.py", 1, "no-init"),
    ]
    assert (slips[3].name, slips[3].fix) == ("rate.sleep", "write `rate.sleep()`")
    assert slips[9].fix == "write `f(…).sleep()`"


def node(body: str) -> str:
    """A script whose function makes a node, with these lines in it."""
    return f"import rospy\ndef main():\n    rospy.init_node('a')\n{body}"


LOOPS_OF_TWO = """\
def one():
    while not rospy.is_shutdown():
        p.publish(1)
def two():
    while not rospy.is_shutdown():
        q.publish(2)
one()
two()
"""
LOOP = "    while not rospy.is_shutdown():\n"
SERVER = "    s = SimpleActionServer('a', A, f, auto_start=False)\n"
OF_A = "try:\n    from a.msg import A\nfinally:\n    pass\n"
CALLED = "if __name__ == '__main__':\n    main()\n"


@pytest.mark.parametrize(
    ("text", "found"),
    [
        (node(LOOP + "        p.publish(1)\n") + CALLED, []),
        (OF_A + "class S(ActionServer):\n    def go(self):\n        self.__init__(auto_start=False)\nS()\n",
         [("not-started", 7, "the action server of line 7 is never started")]),
        (node(LOOP + "        p.publish(1)\n"), [("never-called", 2, "nothing calls `main()`")]),
        (node("    rospy.spin()\n") + "if __name__ == 'main':\n    main()\n",
         [("main-guard", 5, "`__name__` is never 'main'")]),
        (node("    rospy.spin()\n") + "if __name__ != '__main__':\n    pass\nmain()\n", []),
        (node("    rospy.spin()\n") + "threading.Thread(target=main)\n", []),
        ("class A:\n    def __init__(self):\n        self.p = 1\n    def go(self):\n        self.p.publish(1)\nA()\n",
         [("never-called", 4, "nothing calls `go()`")]),
        ("class A(threading.Thread):\n    def run(self):\n        p.publish(1)\nA().start()\n", []),
        (node("    while True:\n        pass\n    p.publish(1)\n") + CALLED,
         [("never-reached", 4, "the loop on line 4 never ends")]),
        (node(LOOP + "        rate.sleep()\n    p.publish(1)\n") + CALLED,
         [("never-reached", 4, "the publish(…) on line 6")]),
        (node("    while 1:\n        if r.is_shutdown():\n            break\n        rate.sleep()\n    p.publish(1)\n")
         + CALLED, [("never-reached", 4, "the publish(…) on line 8")]),
        (node("    rospy.spin()\n    p.publish(1)\n") + CALLED, [("never-reached", 4, "the spin() on line 4")]),
        (node("    rospy.spin()\n") + CALLED + "    a = rospy.get_param('a')\n    b = a['b']\n",
         [("read-late", 7, "line 7 runs only once the node ends, below line 4")]),
        ("class A:\n    def __init__(s):\n        r.spin()\n    def go(s):\n        r.Service(a, B)\na = A()\na.go()",
         [("never-reached", 3, "the spin() on line 3 never ends, so the go(…) on line 7")]),
        ("def go():\n    rospy.spin()\np = rospy.Publisher('a', B)\np.publish(1)\ngo()\n", []),
        (node("    while True:\n        pass\n    p = rospy.Publisher('a', A)\n    p.publish(1)\n") + CALLED,
         [("never-reached", 4, "the Publisher(…) on line 6")]),
        ("class Node:\n    def __init__(self):\n        rospy.Subscriber('a', A, f)\nrospy.spin()\nNode()\n",
         [("never-reached", 4, "the spin() on line 4 never ends, so the Node(…) on line 5")]),
        ("def stop():\n    print(1)\nrospy.spin()\nstop()\n", []),
        ("def hear(only):\n    if not only:\n        return\n    r.spin()\nhear(0)\np = r.Publisher('a', B)\n", []),
        ("def count():\n    while True:\n        yield 1\nn = count()\np = r.Publisher('a', B)\n", []),
        (node("    while True:\n        break\n    p.publish(1)\n") + CALLED, []),
        (node("    while not done:\n        pass\n    p.publish(1)\n") + CALLED, []),
        (node(LOOP + "        p.publish(1)\n        rospy.spin()\n") + CALLED,
         [("spin-in-loop", 6, "stops at the spin()")]),
        (node(LOOP + "        p.publish(1)\n        break\n") + CALLED, [("loop-left", 6, "at the break on line 6")]),
        (node(LOOP + "        p.publish(1)\n        sys.exit()\n") + CALLED,
         [("loop-left", 6, "at the sys.exit() on line 6: remove it from line 6")]),
        (node("    e = threading.Event()\n    while e.wait(1):\n        p.publish(1)\n") + CALLED,
         [("fills", 4, ""),
          ("never-begun", 5, "runs only after `e` is set: a `not` is missing: on line 5, write `while not e.wait(")]),
        ("def end():\n    global off\n    off = True\n"
         + node("    rospy.on_shutdown(end)\n    while off:\n        p.publish(1)\n") + "off = False\n" + CALLED,
         [("never-begun", 8, "runs only after `off` is set: a `not` is missing: on line 8, write `while not off:`")]),
        (node("    for i in range(4):\n        t.angular.z = i\n        p.publish(t)\n") + CALLED,
         [("loop-left", 4, "call rospy.spin() below line 6")]),
        ("def drive(x, y):\n    while on:\n        p.publish(x)\nmain()\n",
         [("never-called", 1, "call `drive(…)` with values for x, y")]),
        ("def side():\n    while on:\n        p.publish(1)\n        break\nside()\nside()\n", []),
        ("def side():\n    while on:\n        p.publish(1)\n        return\nfor i in range(4):\n    side()\n", []),
        ("a = math.radians(self.pose.theta)\n",
         [("wrong-value", 1, "on line 1, write `self.pose.theta` alone, without `radians(…)`")]),
        ("a = math.radians(turn.degrees)\n", []),
        ("while a > math.pi:\n    a -= 3 * math.pi\n",
         [("wrong-value", 2, "on line 2, write `a -= 2 * math.pi`")]),
        ("if self.a < -pi:\n    self.a += pi * 3\n", [("wrong-value", 2, "write `self.a += 2 * pi`")]),
        ("while a > math.pi:\n    a -= 2 * math.pi\nwhile b > math.pi:\n    b -= 4.0 * math.pi\n", []),
        ("if a > math.pi:\n    a -= math.pi\nif a > math.pi / 2:\n    a -= 3 * math.pi\n", []),
        ("for t0 in all:\n    way += time.time() - t0\n", []),
        ("while way < 2:\n    t = rospy.get_time()\n    way += t - t0\n    t0, n = t, 1\n", []),
        ("s.theta = float(sys.argv[1])\na = math.radians(s.theta)\n", []),
        ("while way < 2:\n    t = rospy.Time.now().to_sec()\n    way += v * (t - t0)\n",
         [("wrong-value", 3, "on line 3, write `way =` instead of `way +=`")]),
        ("while way < 2:\n    way += v * (time.time() - self.t0)\n",
         [("wrong-value", 2, "`way +=` adds the whole time since `self.t0` again in each turn")]),
        ("while way < 2:\n    t = rospy.get_time()\n    way += v * (t - t0)\n    t0 = t\n", []),
        ("while way < 2:\n    t = rospy.get_time()\n    way = v * (t - t0)\n", []),
        ("while way < 2:\n    way += v * (a - b)\n", []),
        (("def hear(m):\n    g.t0 = time.time()\n"
         "def go():\n    while way < 2:\n        way += v * (time.time() - g.t0)\ngo()\n"), []),
        ("for r in s.ranges:\n    if r < 0.5:\n        t.x = 0\n    else:\n        t.x = 0.2\n",
         [("wrong-value", 2, "set `t.x` to 0.2 above the loop on line 1, and not in the `else`")]),
        ("for r in s.ranges:\n    if r > 0.5:\n        free = True\n    else:\n        free = False\n",
         [("wrong-value", 2, "set `free` to True above the loop on line 1, and not in the `if`")]),
        ("for r in s.ranges:\n    if r < 0.5:\n        t.x = 0\n        break\n    else:\n        t.x = 0.2\n", []),
        ("for r in s.ranges:\n    if r < 0.5:\n        t.x = 0\n        move(t)\n    else:\n        t.x = 0.2\n", []),
        ("for r in s.ranges:\n    if r < 0.5:\n        t.x = 0\n    else:\n        n += 1\n", []),
        ("for r in s.ranges:\n    if r < 0.5:\n        x = 0\n    else:\n        x = -0.2\n",
         [("wrong-value", 2, "set `x` to -0.2 above the loop on line 1")]),
        ("for r in s.ranges:\n    if r < 0.5:\n        x = 1\n        out.append(x)\n    else:\n        x = 0\n", []),
        ("if a > 265 or a < 275:\n    f(b)\n", [("wrong-value", 1, "`a > 265 or a < 275` is true for every number")]),
        ("if c and 10 > self.a and self.a >= 350:\n    f(b)\n",
         [("wrong-value", 1, "`self.a >= 350 and self.a < 10` is true for no number") ]),
        ("if key != 'a' or key != 'b':\n    f(b)\n",
         [("wrong-value", 1, "`key != 'a' or key != 'b'` is true for every value")]),
        ("if key != '`' or key != 'b':\n    f(b)\n",
         [("wrong-value", 1, "`key != ''' or key != 'b'` is true for every value")]),
        ("if key == 1 and c and key == 2:\n    f(b)\n", [("wrong-value", 1, "write `or` in place of `and`")]),
        ("if key != 1 or key != 1.0 or key != True:\n    f(b)\n", []),
        ("if key != 'a' or other != 'b' or key != 'a':\n    f(b)\n", []),
        ("if key == 'a' or key == 'b' and key != 'c':\n    f(b)\n", []),
        ("if a > 90 or b or a < -90 or a > 100:\n    f(b)\n", []),
        ("if a < -90 or a >= -91.5 or a > 9:\n    f(b)\n", [("wrong-value", 1, "on line 1, write `and`")]),
        ("if a < 10 or a > 350 or b < 400:\n    f(b)\n", []),
        ("if a > 10 and a < 350 and f(a) < 3 and f(a) > 9:\n    f(b)\n", []),
        ("if a < 1" + "0" * 400 + " or a > 1:\n    f(b)\n", []),
        ("def heard(msg):\n    rospy.signal_shutdown('x')\nrospy.Subscriber('x', A, heard)\nrospy.spin()\n",
         [("loop-left", 2, "the callback `heard` ends the node on line 2, at the first message")]),
        ("def clamp(req):\n    if req.a:\n        rospy.signal_shutdown('x')\nrospy.Service('x', A, clamp)\n",
         [("ends-node", 3, "leave out line 3, or end the node only where the lab asks for it")]),
        ("def end(*_):\n    sys.exit()\nsignal.signal(signal.SIGINT, end)\nrospy.on_shutdown(end)\n", []),
        ("class A:\n    def go(self):\n        def stop(self):\n            pass\nA().stop()\n",
         [("object", 5, "`stop` on line 3 is inside of `go`: begin line 3 with the same spaces or tabs as line 2")]),
        (OF_A + "m = A\nm.x = 1\n", [("object", 5, "on line 5, write `m = A()`")]),
        (OF_A + "m['a'] = A\nm[0].x = 1\n", []),
        (OF_A + "def f():\n    m = A\n    g(m)\ndef h():\n    m = A()\n    m.x = 1\n    g(m)\n", []),
        ("p = rospy.Publisher('a', A, 10)\n", [("queue-size", 1, "is no queue size")]),
        ("p = rospy.Publisher('a', A, Listener(), queue_size=10)\n", []),
        (node("    p.publish(1)\n    rospy.spin()\n") + CALLED,
         [("loop-left", 4, "`rospy.Rate(...)` made above it, in place of spin() on line 5")]),
        (node("    q = rospy.Publisher('a', A, latch=True, queue_size=1)\n    q.publish(1)\n    rospy.spin()\n")
         + CALLED, []),
        (node("    p.publish(1)\n    rospy.sleep(5)\n    p.publish(2)\n    rate = rospy.Rate(2)\n    rate.sleep()\n")
         + CALLED, [("loop-left", 4, "ends with the rate's sleep()")]),
        (node("    p.publish(1)\n" + LOOP + "        rate.sleep()\n") + CALLED,
         [("loop-left", 4, "move line 4 into the loop of line 5, above line 6")]),
        (node("    p.publish(1)\n" + LOOP + "        print(str(1))\n        rate.sleep()\n") + CALLED,
         [("loop-left", 4, "above line 7, with the same spaces or tabs before it as line 7 has")]),
        (node("    send()\n" + LOOP + "        rate.sleep()\n") + "def send():\n    p.publish(1)\n" + CALLED,
         [("loop-left", 4, "move line 4 into the loop of line 5, above line 6")]),
        (node("    send()\n" + LOOP + "        rate.sleep()\n") + "def send(m=1):\n    p.publish(1)\n" + CALLED
         + "    rospy.Timer(rospy.Duration(1), send)\n", []),
        (node(LOOP + "        n = 1\n        rate.sleep()\n    p.publish(n)\n") + CALLED,
         [("never-reached", 4, "move line 7 into the loop of line 4, above line 6")]),
        (node("    p.publish(1)\n" + LOOP + "        work()\n        rate.sleep()\n") + CALLED, []),
        (node("    p.publish(1)\n" + LOOP + "        rate.sleep()\n    p.publish(2)\n") + CALLED,
         [("never-reached", 5, "the publish(…) on line 7")]),
        (LOOPS_OF_TWO,
         [("never-reached", 2, "the two(…) on line 8 is never reached: one loop has to do both")]),
        (node("    for i in range(9):\n        p.publish(1)\n") + CALLED,
         [("loop-left", 4, "write `while not rospy.is_shutdown():` on line 4")]),
        *((f"def f(m):\n    for i in range(4):\n        pub.publish(1)\n{given}\nrospy.spin()\n", [])
          for given in ("rospy.Subscriber('a', Bool, f)", "rospy.Subscriber('a', Bool, callback=f)",
                        "rospy.Timer(rospy.Duration(1), f)",
                        "s = actionlib.SimpleActionServer('a', Act, f, False)")),
        ("def f(m):\n    for i in range(4):\n        pub.publish(1)\nrospy.on_shutdown(g)\nf(0)\n",
         [("loop-left", 2, "ends after a fixed number of rounds")]),
        ("def stop():\n    for i in range(4):\n        p.publish(1)\nrospy.init_node('a')\nstop()\nstop()\n", []),
        ("def side():\n    while n < 9:\n        p.publish(1)\nfor i in range(4):\n    side()\n", []),
        (node("    for i in range(4):\n        p.publish(1)\n        rospy.sleep(1)\n    p.publish(0)\n") + CALLED,
         [("loop-left", 4, "call rospy.spin() below line 7")]),
        *((node(f"    while rospy.is_shutdown() {end}:\n        p.publish(1)\n") + CALLED,
           [("never-begun", 4, "on line 4, write `while not rospy.is_shutdown():`")])
          for end in ("!= 0", "== True", "is True")),
        (node("    for i in range(9):\n        p.publish(i)\n") + CALLED, [("loop-left", 4, "put it inside a `while")]),
        (node("    while not rospy.is_shutdown() and n < 9:\n        p.publish(1)\n") + CALLED,
         [("loop-left", 4, "the loop on line 4 ends as soon as its condition is false")]),
        (node(LOOP + "        p.publish(1)\n        # p.publish(2)\n        #rate.sleep()  # b\n        # sleep( a\n")
         + CALLED,
         [("commented-out", 6, "remove the `#` from line 6"), ("commented-out", 7, "`sleep(…)` is commented out")]),
        ("def f(m):\n    # rospy.loginfo('I heard %s', m.data)\n    # print('old')\n    pass\n",
         [("commented-out", 2, "`loginfo(…)` is commented out")]),
        (node("    'rospy.spin()'\n") + CALLED,
         [("commented-out", 4, "in quotes, so it never runs: remove the quotes")]),
        (node("    p = 'rospy.spin()'\n    rospy.spin()\n") + CALLED, []),
        (node("    s = rospy.Subscriber('a', A, print)\n    s.unregister()\n    rospy.spin()\n") + CALLED,
         [("unregistered", 5, "line 5 unregisters `s`, which then has no topic: delete line 5")]),
        ("def end():\n    s.unregister()\nrospy.on_shutdown(end)\nrospy.spin()\n", []),
        (node(SERVER + "    rospy.spin()\n") + CALLED,
         [("not-started", 4, "below line 4, write `s.start()`")]),
        (node(SERVER + "    s.start()\n    rospy.spin()\n") + CALLED, []),
        ("def f(p):\n    def g(m):\n        print(p)\n    return g()\nrospy.Subscriber('a', A, f('x'))\n",
         [("callback-called", 4, "write `g`, without brackets")]),
        ("rospy.on_shutdown(stop.set())\n", [("callback-called", 1, "write `stop.set`, without brackets")]),
        ("def f(p, m):\n    pass\nrospy.Subscriber('a', A, partial(f))\n",
         [("callback-values", 3, "write `partial(f, p)`, with your values in place of these names")]),
        ("def f(m):\n    pass\nrospy.Subscriber('a', A, functools.partial(f, 1))\n",
         [("callback-values", 3, "write `functools.partial(f)`")]),
        ("def f(m):\n    pass\nrospy.Subscriber('a', A, 'f')\n", [("callback-called", 3, "write `f`, without quotes")]),
        (node("    if not rospy.is_shutdown():\n        p.publish(1)\n") + CALLED,
         [("loop-left", 4, "write `while` instead of `if` on line 4")]),
        (node("    while go:\n        if not rospy.is_shutdown():\n            p.publish(1)\n") + CALLED, []),
        (node(LOOP + "        p.publish(1)\n        if x:\n            return\n") + CALLED, []),
        (node(LOOP + "        p.publish(1)\n    rate.sleep()\n") + CALLED,
         [("sleep-outside", 6, "loop on line 4: move it into that loop, below line 5, with the same spaces")]),
        (node(LOOP + "        for n in range(9):\n            p.publish(n)\n        rate.sleep()\n") + CALLED,
         [("sleep-outside", 7, "outside the loop on line 5")]),
        (node("    rate.sleep()\n" + LOOP + "        p.publish(1)\n") + CALLED,
         [("sleep-outside", 4, "outside the loop on line 5: move it into that loop, below line 6")]),
        (node("    rospy.sleep(1)\n" + LOOP + "        p.publish(1)\n") + CALLED, []),
        (node("    n = 0\n" + LOOP + "        p.publish(n)\n        rate.sleep()\n        n = n = 1\n") + CALLED,
         [("set-in-loop", 8, "this sets `n` to 1: on line 8, write `n = n + 1`")]),
        ("def prime(n):\n    for i in n:\n        if i:\n            return 0\n        else:\n            return 1\n",
         [("wrong-value", 6, "so that it never comes to a second one: move line 6 below that loop")]),
        ("def prime(n):\n    for i in n:\n        if i:\n            return False\n        return True\n",
         [("wrong-value", 5, "the loop on line 2 returns in its first turn")]),
        ("def first(n):\n    for i in n:\n        return i\n", []),
        ("def first(n):\n    for i in n:\n        if i:\n            return i\n    return 0\n", []),
        (node("    n = n = 1\n" + LOOP + "        p.publish(n)\n        rate.sleep()\n") + CALLED, []),
        (node("    rate = rospy.Rate(1)\n" + LOOP + "        p.publish(1)\n") + CALLED,
         [("sleep-outside", 5, "by the Rate of line 4: below line 6, write `rate.sleep()`, with the same spaces")]),
        (node("    rate = rospy.Rate(1)\n" + LOOP + "        p.publish(1)\n    rospy.spin()\n") + CALLED, []),
        (node(LOOP + "        p.publish(1)\n        r = rospy.Rate(10)\n") + CALLED,
         [("sleep-outside", 6, "move line 6 above that loop, and write `r.sleep()` as the last line in the loop")]),
        (node(LOOP + "        r = rospy.Rate(10)\n        p.publish(1)\n        r.sleep()\n") + CALLED, []),
        (node(LOOP + "        r = rospy.Rate(10)\n        p.publish(1)\n        rospy.sleep(1)\n") + CALLED, []),
        (node(LOOP + "        rate.sleep()\n        p.publish(1)\n    rospy.sleep(1)\n") + CALLED, []),
        (node(LOOP + "        if x:\n            rate.sleep()\n            continue\n        p.publish(1)\n") + CALLED,
         [("sleep-outside", 6, "only where the `if` on line 5 holds: below line 8, write `rate.sleep()` too")]),
        (node(LOOP + "        if x:\n            rate.sleep()\n            continue\n        f(1)\n") + CALLED, []),
        ("def f(m):\n    pass\nrospy.Subscriber('a', A, f())\n",
         [("callback-called", 3, "write `f`, without brackets")]),
        ("def f(m):\n    pass\nrospy.Subscriber('a', A)\n",
         [("callback-missing", 3, "write the function's name as its third value")]),
        ("rospy.Subscriber('a', A, **more)\nmessage_filters.Subscriber('a', A)\n", []),
        (node("    p = rospy.Publisher('a', A, queue_size='5')\n    rospy.spin()\n") + CALLED,
         [("queue-size", 4, "write `queue_size=5`, without quotes")]),
        ("def f():\n    pass\nrospy.Subscriber('a', A, callback=f)\n",
         [("callback-values", 1, "`f` takes 0 arguments")]),
        ("class A:\n    def f(self, m):\n        self.s = rospy.Subscriber('a', A, f)\n", []),
        ("def f():\n    print(d)\nrospy.Subscriber('a', A, f)\n", [("callback-values", 1, "write `def f(d):`")]),
        ("class T:\n    def f(self):\n        self.get_logger().info('of ROS 2')\nT().f()\n", []),
        ("def f(m):\n    pass\nrospy.Subscriber('a', A, f)\n", []),
        ("def f(m):\n    pass\nrospy.Subscriber('a', A, f, 10)\n",
         [("callback-values", 1, "takes 1 argument, but ROS passes it the message and its `callback_args`")]),
        ("def f(m, a):\n    pass\nrospy.Subscriber('a', A, f, 3)\n", []),
        ("def f(*a):\n    pass\nrospy.Timer(d, f)\n", []),
        ("def f(event):\n    pass\nrospy.Timer(d, f, True)\n", []),
        ("def f(m):\n    pass\nrospy.Subscriber('a', A, f, callback_args=None)\n", []),
        ("def f(goal):\n    pass\ns = actionlib.SimpleActionServer('a', A, f, False)\ns.start()\n", []),
        ("def f():\n    pass\ns = actionlib.SimpleActionServer('a', A, f, False)\ns.start()\n",
         [("callback-values", 1, "ROS passes it the goal: write `def f(goal):`")]),
        ("def f():\n    return lambda m: 0\nrospy.Subscriber('a', A, f())\n", []),
        ("class A:\n    def f(m):\n        pass\n    def g(self):\n        rospy.Service('a', T, self.f)\n",
         [("callback-values", 2, "its first parameter has to be `self`: write `def f(self, m):`")]),
        ("class A:\n    def f():\n        pass\n    def g(self):\n        rospy.Service('a', T, self.f)\n",
         [("callback-values", 2, "write `def f(self, request):`")]),
        ("def f(r, s):\n    return r.a\nrospy.Service('a', T, f)\n",
         [("callback-values", 1, "ROS passes it the request: write `def f(r):`")]),
        ("def f(r, s):\n    s.sum = r.a\n    return s\nrospy.Service('a', T, f)\n",
         [("callback-values", 1, "write `def f(r):`, and `s = TResponse()` as its first line")]),
        ("class A:\n    def f(self, a, b):\n        pass\n    def g(self):\n        rospy.Timer(d, self.f)\n",
         [("callback-values", 2, "ROS passes it the event: write `def f(self, a):`")]),
        ("def f(m):\n    pass\nrospy.Subscriber('a', A, f, 3)\n",
         [("callback-values", 1, "write `def f(m, args):`")]),
        ("def f(m, t):\n    print(m, t)\nrospy.Subscriber('a', A, f)\nrospy.Subscriber('b', B, f, 'b')\n",
         [("callback-values", 1, "on line 3, write `callback_args='a'` as the last argument of `Subscriber(…)`")]),
        ("def f(m, t):\n    print(m, t)\nrospy.Subscriber('a', A, f)\nrospy.Subscriber('b', B, f, 2)\n",
         [("callback-values", 1, "on line 3, write `callback_args`, with a value of its own, as the last argument")]),
        ("def hear(m):\n    print(m)\ndef run():\n    rospy.Subscriber('a', A, run)\n    rospy.spin()\nrun()\n",
         [("callback-values", 3, "is the function that makes this call, not its callback: on line 4, write hear")]),
        ("def run(m):\n    rospy.Subscriber('a', A, run)\n    rospy.init_node('a')\n    print(m)\nrun()\n",
         [("callback-called", 5, "callback, which ROS gives each message: move lines 2 and 3 out of `run`, to where")]),
        ("def run(m):\n    if m:\n      rospy.Subscriber('a', A, run)\n    rospy.init_node('a')\n    print(m)\nrun()\n",
         [("callback-called", 6, "move lines 3 and 4 out of `run`, to where line 6 is, in its place, with")]),
        ("def run(m):\n    rospy.init_node('a')\n    rospy.Subscriber('a', A, run)\n    rospy.spin()\nrun()\n",
         [("callback-called", 5, "move lines 2, 3 and 4 out of `run`, to where line 5 is, in its place; in `run`")]),
        ("def run(m):\n    rospy.Subscriber('a', A, run)\nrospy.init_node('a')\nrun(None)\n", []),
        (node("    for n in range(9):\n        p.publish(n)\n    p.publish(0)\n") + CALLED,
         [("loop-left", 4, "call rospy.spin() below line 6: it waits")]),
        (node("    for n in range(9):\n        p.publish(n)\n    while n < 9:\n        p.publish(0)\n        r()\n") +
         CALLED,
         [("loop-left", 4, "call rospy.spin() below line 8, with the same spaces or tabs before it as line 6 has"),
          ("loop-left", 6, "on line 6")]),
        (node("    if a:\n        for n in range(9):\n            p.publish(n)\n    else:\n        p.publish(0)\n") +
         CALLED,
         [("loop-left", 5, "put it inside a `while")]),
        ("def publish():\n    for n in range(9):\n        p.publish(n)\nrospy.init_node('a')\npublish()\n",
         [("loop-left", 2, "put it inside a `while")]),
        ("class A(Thread):\n    pass\nclass B(A):\n    def run(self):\n        p.publish(0)\nB().start()\n", []),
    ],
)  # fmt: skip
def test_what_never_runs_is_known(tmp_path, text, found):
    (tmp_path / "a.py").write_text(text)
    others = {
        "deaf", "deaf-loop", "rate-number", "no-clock", "misspelt", "undefined", "publishes", "prints", "not-called",
        "node-name", "no-init", "publisher", "publisher-type", "subscriber", "subscriber-type", "not-printed",
        "never-published", "reset-limit", "stuck",
    }  # fmt: skip
    slips = [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind not in others]
    assert [(s.kind, s.line) for s in slips] == [one[:2] for one in found]
    assert all(
        words in f"{slip.message}: {slip.fix}" for slip, (_, _, words) in zip(slips, found, strict=True)
    )


@pytest.mark.parametrize(
    ("below", "fix"),
    [
        ("n = int (n)", "delete line 2, which makes a number of it"),
        ("n = float(n)", "delete line 2, which makes a number of it"),
        ("m = int(n)", ""),
        ("n = int(n, 2)", ""),
    ],
)
def test_the_line_that_makes_a_number_of_what_is_typed_is_known(below: str, fix: str, tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text(f"n = input()\n{below}\n", encoding="utf-8")
    assert [s.fix for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind == "input"] == [fix]


@pytest.mark.parametrize(("end", "name"), [("A()\n", "A().go"), ("a = A()\n", "a.go")])
def test_a_method_that_nothing_calls_is_called_on_its_object(tmp_path, end, name):
    (tmp_path / "a.py").write_text("class A:\n    def go(self):\n        self.p.publish(1)\n" + end)
    assert [s.name for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind == "never-called"] == [name]


@pytest.mark.parametrize(
    ("lines", "fix"),
    [
        ("goal.pose.x = 1\np = rospy.Publisher('a', Pose, queue_size=1)\np.publish(goal)\n",
         "above line 1, create the message: `goal = Pose()`"),
        ("goal.pose.x = 1\nprint(goal)\n", "above line 1, write `goal = …`, with the value that it should have"),
        ("p = rospy.Publisher('a', String, queue, queue_size=1)\n",
         "on line 1, delete `queue` from the call of `Publisher`"),
        ("p = rospy.Publisher('a', String, queue_size)\n", "write `queue_size=10`"),
    ],
)  # fmt: skip
def test_a_name_without_a_value_gets_one_by_what_it_is_used_for(lines: str, fix: str, tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text(lines, encoding="utf-8")
    slips = [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind == "undefined"]
    found = [s.fix for s in slips if s.name not in {"rospy", "String"}]
    assert found[:1] == [fix]


@pytest.mark.parametrize(
    ("given", "used", "kind"),
    [
        ("pub pub2", "pub3", "undefined"),
        ("left1 left2", "left3", "undefined"),
        ("value value2", "value1", "undefined"),
        ("talker", "talker2", "misspelt"),
        ("talker talker2", "talkr", "misspelt"),
    ],
)
def test_the_next_name_of_a_series_means_none_of_the_others(given, used, kind, tmp_path):
    lines = [f"{name} = rospy.Publisher('{name}', Int8, queue_size=1)\n" for name in given.split()]
    (tmp_path / "a.py").write_text(f"import rospy\n{''.join(lines)}{used}.publish(1)\n")
    slips = check_syntax(tmp_path, ["a.py"]).slips
    assert [s.kind for s in slips if s.name == used] == [kind]


def test_where_names_of_the_graph_are_written_is_known(tmp_path):
    (tmp_path / "a.py").write_text(
        "rospy.init_node('talker')\nrospy.Publisher(\n    name='/chatter', data_class=String)\n"
        "from rospy import Subscriber\nSubscriber('~scan', LaserScan)\nrospy.Publisher(TOPIC, String)\n"
        "x = rospy.wait_for_message('odom', Odometry)\n"
        "class Echo:\n    def __init__(self, heard):\n"
        "        self.sub = rospy.Subscriber(heard, Image, print)\n        rospy.Publisher(other, Image)\n"
        "echo = Echo('camera')\n"
    )
    slips = [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind != "undefined"]
    assert [(s.kind, s.line, s.message) for s in slips] == [
        ("node-name", 1, "talker"),
        ("publisher", 3, "/chatter"),
        ("publisher-type", 3, "String"),
        ("callback-missing", 5, "`Subscriber(…)` gets no callback"),
        ("subscriber", 5, "~scan"),
        ("subscriber-type", 5, "LaserScan"),
        ("publisher-type", 6, "String"),
        ("subscriber", 7, "odom"),
        ("subscriber-type", 7, "Odometry"),
        ("subscriber-type", 10, "Image"),
        ("publisher-type", 11, "Image"),
        ("subscriber", 12, "camera"),
    ]


def test_a_main_guard_without_underscores_is_told_with_its_whole_line(tmp_path):
    (tmp_path / "a.py").write_text("def main():\n    pass\nif name == 'main':\n    main()\n    exit(0)\n")
    (slip,) = check_syntax(tmp_path, ["a.py"]).slips
    assert (slip.kind, slip.fix) == ("misspelt", "write `if __name__ == '__main__':`")


def test_letters_in_another_order_are_a_slip(tmp_path):
    (tmp_path / "a.py").write_text("def f(msg):\n    print(mgs.data)\n")
    slip, _ = check_syntax(tmp_path, ["a.py"]).slips
    assert (slip.kind, slip.line) == ("misspelt", 2)
    assert (slip.name, slip.message) == ("mgs", "did you mean msg?")


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("rospy.init_node('a')", [(1, "a", "")]),
        ("name = 'a'\nrospy.init_node(name)", [(1, "a", "name = {}")]),
        ("class N:\n    def __init__(self):\n        self.name = 'a'\n        rospy.init_node(self.name)",
         [(3, "a", "self.name = {}")]),
        ("class N:\n    def __init__(self, name):\n        rospy.init_node(name)\nN(name='a')", [(4, "a", "name={}")]),
        ("class N:\n    def __init__(self, name):\n        rospy.init_node(name)\nN('a')", [(4, "a", "N({})")]),
        ("def run(rate, name):\n    rospy.init_node(name)\nrun(5, 'a')", [(3, "a", "{}")]),
        ("class Publisher:\n  def __init__(self, n):\n    rospy.init_node(n)\nPublisher(n='a')", [(4, "a", "n={}")]),
        ("name = 'a'\nname = 'b'\nrospy.init_node(name)", []),
        ("def run(name):\n    rospy.init_node(name)\nrun('a')\nrun('b')", []),
        ("rospy.init_node(sys.argv[1])", []),
    ],
)  # fmt: skip
def test_where_a_node_gets_its_name_from_is_known(tmp_path, text, found):
    (tmp_path / "a.py").write_text(text + "\n")
    slips = check_syntax(tmp_path, ["a.py"]).slips
    assert [(s.line, s.message, s.fix) for s in slips if s.kind == "node-name"] == found


def test_what_is_left_of_a_file_that_does_not_parse(tmp_path):
    conflict = (
        "import rospy\n<<<<<<< HEAD\npub = rospy.Publisher('mine', String)\n=======\n"
        "pub = rospy.Publisher('theirs', Int8)\n>>>>>>> 71e5b7f\nrospy.init_node('talker')\n"
    )
    refused = "import rospy\nrospy.init_node('b')\nwhile x)\n    rospy.spin()\nrospy.Rate(2\n"
    (tmp_path / "a.py").write_text(conflict)
    (tmp_path / "b.py").write_text(refused)
    report = check_syntax(tmp_path, ["a.py", "b.py"])
    assert set(report.faults) == {"a.py", "b.py"}
    assert {(s.file, s.line, s.kind, s.message) for s in report.slips} == {
        ("a.py", 3, "publisher", "mine"),
        ("a.py", 3, "publisher-type", "String"),
        ("a.py", 7, "node-name", "talker"),
        ("b.py", 2, "node-name", "b"),
    }


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("print('talker.py')\n", True),
        ("import rospy\nif __name__ == '__main__':\n    pass\n", True),
        ("import rospy\nrospy.init_node('a')\nrospy.spin()\n", False),
        ("LIMIT = 3\ndef limited(x):\n    return min(x, LIMIT)\n", False),
    ],
)
def test_a_script_that_is_no_node(tmp_path, text, told):
    (tmp_path / "a.py").write_text(text)
    assert [s.kind for s in check_syntax(tmp_path, ["a.py"]).slips].count("no-init") == told


@pytest.mark.parametrize(
    ("code", "told"),
    [
        ("while True:\n    time.sleep(1)\n", "the loop on line 1 never checks"),
        ("while not rospy.is_shutdown():\n    time.sleep(1)\n", ""),
        ("while n < 9:\n    for i in range(9):\n        pub.publish(i)\nrate.sleep()\n", "on lines 1 and 2 never"),
        ("while True:\n    rospy.wait_for_message('a', A)\n", ""),
        ("while True:\n  try:\n    rospy.wait_for_message('a', A)\n  except rospy.ROSException:\n    pass\n",
         "the `except` on line 4 catches what Ctrl-C raises, and the loop on line 1 goes on"),
        ("while True:\n    try:\n        rospy.wait_for_message('a', A)\n    except:\n        break\n", ""),
        ("while n < 9:\n    for i in range(99):\n        rate.sleep()\n", "the loops on lines 1 and 2 never check"),
        ("while not rospy.is_shutdown():\n    for i in range(99):\n        rate.sleep()\n", "the loop on line 2 never"),
        ("while n < 9:\n    n = 0\n", "the loop on line 1"),
        ("while n[0] < 9:\n    m[0] += 1\n", "the loop on line 1"),
        ("while self.n[0] < 9:\n    self.n[0] += 1\n", ""),
        ("while n < 9:\n    n += 1\nwhile True:\n    n = 0\n", "the loop on line 3"),
        ("for n in itertools.count():\n    time.sleep(1)\n", "the loop on line 1"),
        ("while n > 9:\n    n -= 9\nfor n in range(9):\n    time.sleep(1)\n", "the loop on line 3 never checks"),
        ("for n in range(9):\n    time.sleep(1)\n", "the loop on line 1 never checks"),
        ("for n in range(9):\n    pub.publish(n)\n", ""),
        ("rospy.init_node('a', disable_signals=True)\n", "`disable_signals=True` on line 1"),
        ("signal.signal(signal.SIGINT, signal.SIG_IGN)\n", "line 1 replaces what rospy does on Ctrl-C"),
    ],
)  # fmt: skip
def test_why_a_node_goes_on_after_ctrl_c(tmp_path, code, told):
    (tmp_path / "a.py").write_text(code)
    deaf = [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind.startswith("deaf")]
    assert len(deaf) == bool(told)
    assert all(told in one.message and one.fix for one in deaf)


@pytest.mark.parametrize(
    ("condition", "fix"),
    [
        ("n < 9 and on", "on line 1, write `and not rospy.is_shutdown()` before the colon"),
        ("(n <\n 9)", "on line 2, write"),
        ("n < 9 or on", "on line 1, put the condition in brackets, and write `and not"),
        ("n := look()", "on line 1, put the condition in brackets"),
        ("n if on else m", "on line 1, put the condition in brackets"),
        ("True", "check `rospy.is_shutdown()` in it"),
    ],
)
def test_a_condition_is_joined_with_another_where_that_changes_nothing_in_it(
    condition: str, fix: str, tmp_path: Path
) -> None:
    (tmp_path / "a.py").write_text(f"while {condition}:\n    time.sleep(1)\n", encoding="utf-8")
    (deaf,) = (s for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind.startswith("deaf"))
    assert deaf.fix.startswith(fix)


def test_every_kind_is_described() -> None:
    rows = re.findall(r"^- (`.*?`):", inspect.getdoc(PythonSlip) or "", re.MULTILINE)
    assert sorted(re.findall(r"`([\w-]+)`", " ".join(rows))) == sorted(get_args(SlipKind))
