"""What a loop publishes of its count, texts that are published, and messages that are not sent."""

from __future__ import annotations

from pathlib import Path

import pytest

from grader.package.python import check_syntax

pytestmark = pytest.mark.usefixtures("without_processes")

LOOP = "pub = rospy.Publisher('n', Int8)\nn = 0\nwhile not rospy.is_shutdown():\n"


@pytest.mark.parametrize(
    ("turn", "message"),
    [
        ("    if n % 10 != 3:\n        pub.publish(n)\n    n += 1\n",
         "line 5 publishes only under the condition on line 4"),
        ("    if n > 5: pub.publish(n)\n    n = (n + 1) % 128\n",
         "line 4 publishes only under the condition on line 4"),
        ("    if n % 2:\n        pub.publish(n)\n    else:\n        pub.publish(n)\n    n += 1\n", ""),
        ("    if n % 2:\n        n += 1\n        pub.publish(n)\n",
         "line 6 publishes only under the condition on line 4"),
        ("    if pub.get_num_connections() == 0:\n        pub.publish(n)\n",
         "line 5 publishes only under the condition on line 4"),
        ("    if pub.get_num_connections():\n        pub.publish(n)\n    n += 1\n", ""),
        ("    heard = pub.get_num_connections()\n    if heard > 0:\n        pub.publish(n)\n", ""),
        ("    if self.last is not None:\n        pub.publish(self.last)\n", ""),
        ("    if n:\n        pub.publish(Int8(n))\n", ""),
        ("    if n != 5:\n        pub.publish(n)\n", "line 5 publishes only under the condition on line 4"),
        ("    if n > 127:\n        n = 0\n    pub.publish(n)\n    n += 1\n", ""),
        ("    if word == 'a':\n        pub.publish(1)\n    elif word == 'b':\n        pub.publish(2)\n",
         "lines 5 to 7 publish only under the conditions of the `if` on line 4"),
        ("    if n:\n        if w: pub.publish(1)\n        else: pub.publish(2)\n    else: pub.publish(3)\n", ""),
        ("    if self.publish(n):\n        n += 1\n    rate.sleep()\n", ""),
    ],
)  # fmt: skip
def test_a_loop_that_counts_more_than_it_publishes(turn: str, message: str, tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text(LOOP + turn, encoding="utf-8")
    slips = [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind == "published-in-part"]
    assert [(s.message, s.name) for s in slips] == ([(message, "n")] if message else [])


def test_each_topic_of_an_if_is_told(tmp_path: Path) -> None:
    head = "pub = rospy.Publisher('n', Int8)\nother = rospy.Publisher('t', String)\ni = 0\nwhile on():\n"
    turn = "    if i % 2:\n        pub.publish(i)\n    elif i:\n        other.publish('a')\n    i += 1\n"
    (tmp_path / "a.py").write_text(head + turn, encoding="utf-8")
    (tmp_path / "b.py").write_text(head + turn + "    other.publish('b')\n", encoding="utf-8")
    slips = check_syntax(tmp_path, ["a.py", "b.py"]).slips
    found = [(s.file, s.name, s.message, s.fix) for s in slips if s.kind == "published-in-part"]
    says = "line %d publishes only under a condition of the `if` on line 5"
    fix = "publish outside the `if` on line 5, so that it happens each time around the loop"
    assert found == [
        ("a.py", "n", says % 6, fix),
        ("a.py", "t", says % 8, fix),
        ("b.py", "n", says % 6, fix),
    ]


@pytest.mark.parametrize(("text", "line"), [
    ("m = 'one'\nwhile on():\n    p.publish(m)\n", 3),
    ("while on():\n    m = 'one'\n    p.publish(m)\n", 2),
    ("m = 'one'\np.publish(m)\n", 1),
    ("m = String()\nm.data = 'one'\nfor i in range(9):\n    p.publish(m)\n", 4),
])  # fmt: skip
def test_a_text_is_published_where_it_can_change(text: str, line: int, tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text(text, encoding="utf-8")
    assert [s.line for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind == "publishes"] == [line]


KEEPS = "def cb(m):\n    global n\n    n = m.data * 2\nrospy.Subscriber('c', Int32, cb)\n"


@pytest.mark.parametrize(
    ("turn", "found"),
    [
        ("pub.publish(n)", True), ("texts.publish(n)", False), ("pub.publish(5)", False), ("print(n)", False),
        ("if n % 3 == 0: print('x')", True), ("print('got %s' % n)", False), ("if n > 4: print('x')", True),
        ("if n == 4: print('x')", False), ("print(-n)", True), ("print(not n)", False), ("print(n + 1)", True),
        ("print('a' + n)", False), ("print(n * 2)", False), ("print(n * 0.5)", True),
        ("area = n ** 2", True), ("print(math.sqrt(n))", True), ("print(other - 1)", False),
    ],
)  # fmt: skip
def test_a_loop_that_needs_a_number_of_a_message(turn: str, found: bool, tmp_path: Path) -> None:
    made = "pub = rospy.Publisher('a', Int32)\ntexts = rospy.Publisher('b', String)\n"
    text = f"{KEEPS}{made}while not rospy.is_shutdown():\n    {turn}\n    rate.sleep()\n"
    (tmp_path / "a.py").write_text(text, encoding="utf-8")
    fixes = [s.fix for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind == "takes-number"]
    assert fixes == (["write `rospy.spin()` in place of the loop on lines 7 to 9"] if found else [])


def test_what_an_object_has_itself_is_nothing_of_a_message(tmp_path: Path) -> None:
    callback = "    def cb(self, m):\n        print(m.data)\n        rospy.Subscriber('c', Int32, self.cb)\n"
    turn = "    def run(self):\n        while True:\n            while self.data > 1:\n                self.data -= 1\n"
    (tmp_path / "a.py").write_text(f"class A:\n{callback}{turn}", encoding="utf-8")
    (tmp_path / "b.py").write_text(f"{KEEPS}while a():\n    while b():\n        n - 1\n", encoding="utf-8")
    slips = [s for s in check_syntax(tmp_path, ["a.py", "b.py"]).slips if s.kind == "takes-number"]
    assert [(s.file, s.line) for s in slips] == [("b.py", 5)]


@pytest.mark.parametrize(
    ("below", "fix"),
    [
        (
            "    rate.sleep()\n    if n == 1:\n        pub.publish(1)\n",
            "",
        ),
        ("    if n == 1:\n        pub.publish(1)\n    rate.sleep()\n", "publish … in place of lines 2 to 4"),
        ("    pub.publish(n)\n", ""),
        ("    if n == 1:\n        print(1)\n    pub.publish(n)\n", ""),
        ("    if n == 1:\n        print(1)\n", ""),
    ],
)
def test_a_question_whose_answer_decides_what_is_published(below: str, fix: str, tmp_path: Path) -> None:
    text = f"while not rospy.is_shutdown():\n    n = int(input())\n{below}"
    (tmp_path / "a.py").write_text(text, encoding="utf-8")
    assert [s.fix for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind == "input"] == [fix]


@pytest.mark.parametrize(
    ("value", "random"),
    [
        ("random.randint(0, 127)", True),
        ("int(127 * random.random())", True),
        ("n + random.choice([1])", False),
    ],
)
def test_values_made_up_at_random_are_not_counted(value: str, random: bool, tmp_path: Path) -> None:
    text = f"import random\n{LOOP}    pub.publish({value})\n    n += 1\n"
    (tmp_path / "a.py").write_text(text, encoding="utf-8")
    slips = [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind == "clock-value"]
    assert [s.name for s in slips] == (["random"] if random else [])


OTHER_LOOP = (
    "def b():\n    q = rospy.Publisher('b', B)\n    while not rospy.is_shutdown():\n        q.publish(1)\n"
)
OF_CLASS = (
    "class {}:\n    def __init__(self):\n        self.p = rospy.Publisher('a', A)\n"
    "    def run(self):\n        while not rospy.is_shutdown():\n            self.p.publish(1)\n"
)
TWO_PARTS = "def a():\n    p = rospy.Publisher('a', A)\n    while not rospy.is_shutdown():\n"


@pytest.mark.parametrize(
    ("text", "found"),
    [
        (
            f"{TWO_PARTS}        p.publish(1)\n{OTHER_LOOP}try:\n    a()\n    b()\nexcept E:\n    pass\n",
            [
                (
                    "never-reached",
                    3,
                    "one loop has to do both: make above line 3 what the loop on line 7 uses, and do",
                )
            ],
        ),
        (
            f"{TWO_PARTS}        p.publish(1)\ndef b():\n    rospy.Subscriber('b', B, f)\n    rospy.spin()\na()\nb()\n",
            [("never-reached", 3, "move line 9 above line 8, and delete the spin() on line 7")],
        ),
        (
            f"def a():\n    rospy.Subscriber('a', A, f)\n    rospy.spin()\n{OTHER_LOOP}a()\nb()\n",
            [("never-reached", 3, "delete the spin() on line 3: one at the end is enough")],
        ),
        *(
            (
                f"{OF_CLASS.format('A')}{OF_CLASS.format('B')}a = A()\n{first}.run()\nB().run()\n",
                [
                    (
                        "never-reached",
                        5,
                        "one loop has to do both: make above line 5 what the loop on line 11 uses, and do",
                    )
                ],
            )
            for first in ("a", "A()")
        ),
        (f"{TWO_PARTS}        p.publish(1)\n        break\n{OTHER_LOOP}a()\nb()\n", []),
        (TWO_PARTS + "        p.publish(1)\ndef b():\n    print(1)\na()\nb()\n", []),
    ],
)
def test_what_comes_behind_a_function_that_never_ends_is_never_reached(text, found, tmp_path):
    (tmp_path / "a.py").write_text(text)
    slips = [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind == "never-reached"]
    assert [(s.kind, s.line) for s in slips] == [one[:2] for one in found]
    assert all(one[2] in slip.fix for slip, one in zip(slips, found, strict=True))


@pytest.mark.parametrize(
    ("text", "fixes"),
    [
        ("    if g.n < 0:\n        s.set_aborted(r)\n    s.set_succeeded(r)\n", ["below line 3, write `return`"]),
        ("    while n:\n        if s.is_preempt_requested():\n            s.set_preempted()\n        n -= 1\n",
         ["below line 4, write `return`"]),
        (("    while ok:\n        g = s.accept_new_goal()\n        if g.n < 0:\n            s.set_aborted(r)\n"
         "        s.set_succeeded(r)\n"), ["below line 5, write `continue`"]),
        ("    if g.n < 0:\n        s.set_aborted(r)\n        return\n    s.set_succeeded(r)\n", []),
        ("    if g.n < 0:\n        s.set_aborted(r)\n    else:\n        s.set_succeeded(r)\n", []),
        ("    if ok:\n        s.set_succeeded(r)\n    print('done')\n", []),
        ("    if stop:\n        s.set_preempted()\n        ok = False\n    if ok:\n        s.set_succeeded(r)\n", []),
        (("    for i in range(9):\n        if s.is_preempt_requested():\n            s.set_preempted(r)\n"
         "            ok = False\n    if ok:\n        s.set_succeeded(r)\n"), ["below line 5, write `return`"]),
        (("    for i in range(9):\n        if s.is_preempt_requested():\n            s.set_preempted(r)\n"
         "            ok = False\n        if not ok:\n            break\n"), []),
        (("    for i in range(9):\n        if s.is_preempt_requested():\n            s.set_preempted(r)\n"
         "            ok = False\n            break\n"), []),
        (("    while ok:\n        if s.is_preempt_requested():\n            s.set_preempted(r)\n"
         "            ok = False\n"), []),
        ("    while not done:\n        if near(g):\n            done = True\n            s.set_succeeded()\n", []),
        ("    while s.is_active():\n        if near(g):\n            s.set_succeeded()\n", []),
        ("    if not ok:\n        s.set_aborted()\n    if ok:\n        s.set_succeeded()\n", []),
        ("    if stop:\n        s.set_preempted()\n    if s.is_active():\n        s.set_succeeded()\n", []),
        ("    while not over():\n        g = s.accept_new_goal()\n        if g:\n            s.set_succeeded()\n", []),
        ("    for one in goals:\n        if near(one):\n            one.set_succeeded()\n", []),
        ("    for i in range(g.n):\n        s.publish_feedback(f)\n        s.set_succeeded(r)\n        r.sleep()\n",
         ["move line 4 out of the loop, below its last line, 5, with the same spaces or tabs before it as line 2 has"]),
        ("    while i < g.n:\n        s.publish_feedback(f)\n        i = i + 1\n        s.set_succeeded(r)\n",
         ["move line 5 out of the loop, below its last line, 5, with the same spaces or tabs before it as line 2 has"]),
        ("    while 1:\n        s.accept_new_goal()\n        s.publish_feedback(f)\n        s.set_succeeded()\n", []),
        ("    for one in goals:\n        one.publish_feedback(f)\n        one.set_succeeded()\n", []),
        ("    while True:\n        s.publish_feedback(f)\n        s.set_succeeded()\n        return\n", []),
        ("    while 1:\n        s = got.get()\n        s.publish_feedback(f)\n        s.set_succeeded()\n", []),
        ("    if n < 3:\n        s.set_aborted()\n    if n >= 3:\n        s.set_succeeded()\n", []),
        ("    if a == 'b':\n        s.set_aborted()\n    if a == 'c':\n        s.set_succeeded()\n", []),
        ("    if done:\n        s.set_succeeded()\n    for i in range(3):\n        stop.publish(Twist())\n", []),
    ],
)  # fmt: skip
def test_callbacks_that_go_on_after_their_goal(text: str, fixes: list[str], tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text(f"def do(g):\n{text}", encoding="utf-8")
    assert [s.fix for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind == "goes-on"] == fixes


HEADS = "from a.msg import Twist, Header, Reading, GoFeedback\nfrom a.srv import AddResponse\n"


@pytest.mark.parametrize(
    ("text", "fixes"),
    [
        ("def f():\n    t = Twist()\n    t.linear.x = 1\n    pub.publish(Twist())\n",
         ["on line 6, write `t` instead of `Twist()`"]),
        ("def f():\n    t = Twist()\n    t.linear.x = 1\n    pub.publish(Twist)\n",
         ["on line 6, write `t` instead of `Twist`"]),
        ("def f():\n    m = Reading()\n    h = Header()\n    h.stamp = now()\n    pub.publish(m)\n",
         ["below line 6, write `m.header = h`"]),
        ("h = Header()\nh.stamp = now()\nm = Reading()\npub.publish(m)\n", ["below line 5, write `m.header = h`"]),
        ("pub = rospy.Publisher('/v', Twist)\ndef f():\n    t = Twist()\n    t.linear.x = 1\n",
         ["below line 6, write `pub.publish(t)`"]),
        ("def f(q):\n    r = AddResponse()\n    r.sum = q.a\n", ["write `return r` at the end of the callback"]),
        ("def f(q):\n    r = AddResponse()\n    r.sum = q.a\n    return AddResponse()\n",
         ["on line 6, write `r` instead of `AddResponse()`"]),
        ("class A:\n    b = GoFeedback()\n    def f(self, g):\n        self.b.n = 1\ns = SimpleActionServer('a')\n",
         ["below line 6, write `s.publish_feedback(self.b)`"]),
        ("def f():\n    t = Twist()\n    t.linear.x = 1\n", ["give `t` to the call that should send it"]),
        ("def f():\n    t = Twist()\n    t.linear.x = 1\n    pub.publish(t)\n", []),
        ("def f():\n    t = Twist()\n    t.linear.x = 1\n    return t\n", []),
        ("def f():\n    t = Twist()\n    t.linear.x = 1\n    log(t.linear.x)\n", []),
        ("def f():\n    global t\n    t = Twist()\n    t.linear.x = 1\ndef g():\n    pub.publish(t)\n", []),
        ("def f():\n    t = Twist()\n    def g():\n        pub.publish(t)\n    t.linear.x = 1\n    g()\n", []),
        ("t = Twist()\ndef f():\n    t.linear.x = 1\n    pub.publish(t)\n", []),
        ("def f(a):\n    a.t = Twist()\n    a.t.linear.x = 1\ndef g(b):\n    pub.publish(b.t)\n", []),
        ("def f():\n    t = Twist()\n    s = t.linear\n    t.linear.x = 1\n    pub.publish(Twist(linear=s))\n", []),
        ("def f():\n    r = Reading()\n    r.cells[0] = 1\n    r.a = 1\n    pub.publish(r)\n", []),
        ("def f():\n    unused = Twist()\n", []),
    ],
)  # fmt: skip
def test_messages_that_are_filled_in_and_not_sent(text: str, fixes: list[str], tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text(HEADS + text, encoding="utf-8")
    assert [s.fix for s in check_syntax(tmp_path, ["a.py"]).slips if s.name == "unsent"] == fixes


@pytest.mark.parametrize(
    ("text", "fixes"),
    [
        ("def f():\n    reading.cells = 1\n", ["above line 3, write `reading = Reading()`"]),
        ("rospy.wait_for_service('/clamp')\nprint(clamp(1))\n",
         ["above line 3, write `clamp = rospy.ServiceProxy('/clamp', Clamp)`"]),
        ("pub = rospy.Publisher('/r', reading)\nm = reading()\n", []),
        ("reading = Reading()\nreading.cells = 1\n", []),
        ("def f(clamp):\n    clamp(1)\n", []),
    ],
)  # fmt: skip
def test_objects_that_no_line_makes(text: str, fixes: list[str], tmp_path: Path) -> None:
    head = "from lab.msg import Reading; from lab.srv import Clamp; "
    (tmp_path / "a.py").write_text(f"{head}import rospy\n{text}", encoding="utf-8")
    found = check_syntax(tmp_path, ["a.py"]).slips
    assert [s.fix for s in found if "gives `" in s.message] == fixes


@pytest.mark.parametrize(
    ("callback", "fix"),
    [
        ("publish", "add a method `def publish(self, …):` to the class A"),
        ("hadle", "on line 3, write `self.handle` instead of `self.hadle`"),
    ],
)
def test_a_callback_is_a_method_and_no_other_attribute(callback: str, fix: str, tmp_path: Path) -> None:
    made = f"self.pub = rospy.Publisher('/a', Int8)\n  rospy.Timer(rospy.Duration(1), self.{callback})"
    (tmp_path / "a.py").write_text(
        f"class A:\n def __init__(self):\n  {made}\n def handle(self, e):\n  pass\n"
    )
    found = check_syntax(tmp_path, ["a.py"]).slips
    assert [s.fix for s in found if s.kind == "object"] == [fix.replace("line 3", "line 4")]


def test_fields_of_an_attribute_that_is_always_none(tmp_path: Path) -> None:
    head = "class A:\n def __init__(self):\n  self.p = None\n  Subscriber('/p', Pose, self.f)\n def f(self, m):\n"
    (tmp_path / "a.py").write_text(
        f"{head}  self.p.x = m.x\n def h(self):\n  print(self.p.y)\n", encoding="utf-8"
    )
    (tmp_path / "b.py").write_text(f"{head}  self.p = m\n  self.p.x = 1\n", encoding="utf-8")
    (tmp_path / "c.py").write_text(f"{head}  self.p, self.q = m, 1\n  self.p.x = 1\n", encoding="utf-8")
    found = [s for s in check_syntax(tmp_path, ["a.py", "b.py", "c.py"]).slips if s.kind == "object"]
    assert [(s.file, s.line, s.fix, s.name) for s in found] == [
        ("a.py", 6, "on line 3, write `self.p = Pose()`", "x"),
        ("a.py", 8, "on line 3, write `self.p = Pose()`", "y"),
    ]


def test_a_sum_of_numbers_is_no_text(tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text("a = n * 2 + 10\nt = 'n is ' + str(n)\np.publish(a)\np.publish(t)\n")
    slips = [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind == "publishes"]
    assert [one.message for one in slips if any(map(str.isalnum, one.message))] == ["n is {}"]


@pytest.mark.parametrize(
    ("text", "kind", "said"),
    [
        ("def f(a):\n    return 'sum: %d' % a\nf(3)\n", "drops-result", [(3, "sum: {}", "2", "f")]),
        ("def f(a):\n    try:\n        return ask(a)\n    except E as e:\n        return 'no: %s' % e\nf(3)\n",
         "drops-result", [(6, "no: {}", "5", "f"), (6, "{}", "3", "f")]),
        ("def f(a):\n    return a\nprint(f(3))\nf(4)\n", "drops-result", []),
        ("def f(a):\n    return True\nf(4)\n", "drops-result", []),
        ("def f(a):\n    p = rospy.Publisher(a)\n    return p\nf(4)\n", "drops-result", []),
        ("def f(a):\n    return [a], a > 1\nf(4)\n", "drops-result", []),
        ("def f(a):\n    t = 'no'\n    return t\nf(4)\n", "drops-result", [(4, "no", "3", "f")]),
        ("def f(a):\n    return a\nrospy.Service('/a', A, f)\nf(4)\n", "drops-result", []),
        ("def f(q):\n    return [b, a]\nrospy.Service('/a', A, f)\n", "returns-list", [(2, "b, a", "", "list")]),
        ("def f(q):\n    return b, 1\nrospy.Service('a', A, handler=f)\n", "returns-list",
         [(2, "b, ...", "", "tuple")]),
        ("def f(q):\n    return [b, a]\nf(3)\n", "returns-list", []),
        ("def f(q):\n    m = A()\n    m.x = 1\n    m.p.y += 2\n    return m\n", "fills", [(2, "p x", "", "A")]),
        ("def f(q):\n    pub.publish(A(x=1))\n", "fills", [(2, "x", "", "A")]),
        ("m = A()\nm.x = 1\npub.publish(m)\n", "fills", [(1, "x", "", "A")]),
        ("def f(q):\n    m = A()\n    m.x = 1\n    fill(m)\n    return m\n", "fills", []),
        ("def f(q):\n    m = A()\n    def g():\n        m.y = 2\n    m.x = 1\n    return m\n", "fills", []),
        ("def f(q):\n    m = A()\n    m.x = 1\n    return m\ndef g(q):\n    return A(1, 2)\n", "fills", []),
        ("m = A()\ndef f(q):\n    m.x = 1\n    return m\n", "fills", []),
        ("class B:\n    m = A()\n    def f(self):\n        return self.m\n", "fills", []),
        ("class B:\n    def f(self):\n        self.m = A()\n        self.m.x = 1\n", "fills", []),
        ("try:\n    a()\n    b()\nexcept X as e:\n    pass\nexcept (Y, q.Z):\n    pass\n", "catches",
         [(6, "X Y q.Z", "", "2-3")]),
        ("try:\n    a()\nexcept X:\n    pass\nexcept Exception:\n    pass\n", "catches", []),
        ("try:\n    a()\nexcept:\n    pass\n", "catches", []),
        ("s.set_preempted()\ns.set_succeeded(r)\n", "no-result", [(1, "s.set_preempted", "", "set_preempted")]),
        ("def f(g):\n    done = GoResult(1)\n    s.set_succeeded(g.n)\n", "no-result",
         [(3, "s.set_succeeded", "write `s.set_succeeded(done)`", "set_succeeded")]),
        ("def f(g):\n    done = GoResult(1)\n    s.set_succeeded(done)\n", "no-result", []),
    ],
)  # fmt: skip
def test_what_becomes_of_results(
    text: str, kind: str, said: list[tuple[int, str, str, str]], tmp_path: Path
) -> None:
    (tmp_path / "a.py").write_text(text, encoding="utf-8")
    found = [
        (s.line, s.message, s.fix, s.name) for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind == kind
    ]
    assert sorted(found) == sorted(said)


@pytest.mark.parametrize(
    ("around", "where"),
    [
        ("rospy.Subscriber('a', Int8, heard)\n", " in the callback `heard`, line 1"),
        ("rospy.Timer(rospy.Duration(1), heard)\n", " in the callback `heard`, line 1"),
        ("rospy.Timer(1, heard)\nrospy.Timer(1, other)\n", " in the callback"),
        ("while not rospy.is_shutdown():\n    rate.sleep()\n", " inside the loop"),
        (
            "rospy.Subscriber('a', Int8, heard)\nwhile not rospy.is_shutdown():\n    rate.sleep()\n",
            " inside the loop",
        ),
        ("rospy.spin()\n", ""),
    ],
)
def test_a_publisher_that_nothing_uses_is_to_publish_where_the_script_works(
    around: str, where: str, tmp_path: Path
) -> None:
    text = f"def heard(msg):\n    print(msg)\npub = rospy.Publisher('b', Int8, queue_size=1)\n{around}"
    (tmp_path / "a.py").write_text(text, encoding="utf-8")
    found = [s.fix for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind == "never-published"]
    assert found == [f"call `pub.publish(…)`{where}"]


HEARS = (
    "class Hear:\n    def __init__(self):\n        rospy.Subscriber('a', A, print)\nrospy.init_node('a')\n"
)


@pytest.mark.parametrize(
    ("below", "fixes"),
    [
        ("rospy.spin()\n", ["below line 4, write `hear = Hear()`"]),
        ("# hear = Hear()\nrospy.spin()\n", ["remove the `#` from line 5"]),
        ("Hear()\nrospy.spin()\n", []),
        ("rospy.Subscriber('b', A, print)\nrospy.spin()\n", []),
    ],
)
def test_a_class_that_nothing_makes(below: str, fixes: list[str], tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text(HEARS + below, encoding="utf-8")
    found = check_syntax(tmp_path, ["a.py"]).slips
    assert [s.fix for s in found if s.kind == "never-called"] == fixes
    (tmp_path / "a.py").write_text(HEARS.partition("rospy.init")[0], encoding="utf-8")
    assert not [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind == "never-called"]


def test_a_timers_callback_that_no_timer_is_given(tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text("def send(event):\n    pub.publish(1)\nrospy.spin()\n", encoding="utf-8")
    found = [s.fix for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind == "never-called"]
    assert found == ["pass it: `rospy.Timer(rospy.Duration(…), send)`"]


@pytest.mark.parametrize(
    ("source", "asks"),
    [
        ("word = getpass.getpass()", True),
        ("word = getpass('Password: ')", True),
        ("word = getpass.getuser()", False),
        ("def getpass():\n    return 1\nword = getpass()", False),
    ],
)
def test_a_password_is_typed_too(source: str, asks: bool, tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text(f"{source}\n", encoding="utf-8")
    found = [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind == "input"]
    assert len(found) == asks


@pytest.mark.parametrize("call", ["eval('2 * dumps')", "exec('dumps(1)')", "globals()['dumps']"])
def test_a_name_that_a_text_may_use_is_not_said_to_be_unused(call: str, tmp_path: Path) -> None:
    text = f"from json import dumps\npub = rospy.Publisher('a', Int8)\ndef f():\n    pass\nprint({call})\n"
    (tmp_path / "a.py").write_text(text, encoding="utf-8")
    kinds = {s.kind for s in check_syntax(tmp_path, ["a.py"]).slips}
    assert not kinds & {"unused-import", "never-published", "never-called"}


@pytest.mark.parametrize(
    ("body", "fixes"),
    [
        ("    if x > 1:\n        raise ValueError()\n        y = 2\n        return y\n",
         ["indent lines 4 to 5 only as far as the `if` on line 2"]),
        ("    if x > 1:\n        return\n        return 2\n", ["indent line 4 only as far as the `if` on line 2"]),
        ("    if x > 1:\n        y = 1\n    else:\n        raise ValueError()\n        return y\n",
         ["indent line 6 only as far as the `if` on line 2"]),
        ("    if x > 1:\n        raise ValueError()\n    return 2\n", []),
        ("    if x > 1:\n        return 1\n        return 2\n", []),
        ("    if x > 1:\n        raise ValueError()\n        print(x)\n    return 2\n", []),
        ("    raise NotImplementedError()\n    return 2\n", []),
        ("    if x > 1:\n        raise ValueError()\n        x = 1\n", []),
    ],
)  # fmt: skip
def test_a_return_that_is_never_reached(body: str, fixes: list[str], tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text(f"def f(x):\n{body}", encoding="utf-8")
    slips = [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind == "wrong-value"]
    assert [s.fix for s in slips] == fixes
