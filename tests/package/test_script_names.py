"""Names that are not there, texts that are said, and statements without an effect, in Python that compiles."""

from __future__ import annotations

from pathlib import Path

import pytest

from grader.package.python import check_syntax

pytestmark = pytest.mark.usefixtures("without_processes")

UNDEFINED = {
    "message": ("p = rospy.Publisher('a', Int32)\nfor i in range(3):\n    number.data = i\n    p.publish(number)\n",
                "nothing in the file gives `number` a value: above line 4, create the message: `number = Int32()`"),
    "spin-once-in-loop": (
        "while not rospy.is_shutdown():\n    rospy.sleep(1)\n    rospy.spinOnce()\n",
        "threads of its own: delete line 4",
    ),
    "spin-once-alone": ("while 1:\n    ros.spin_once()\n", "line 3, write `rospy.spin()` instead of `ros.spin_once()`"),
    "spin-once-last": ("rospy.spinOnce()\n", "line 2, write `rospy.spin()` instead of `rospy.spinOnce()`"),
    "ok": ("while ros.ok():\n    pass\n", "line 2, write `not rospy.is_shutdown()` instead of `ros.ok()`"),
    "own-ok": ("def f(answer):\n    return answer.ok()\n", ""),
    "misspelt-import": ("import mathh\nx = math.sin(1)\n", "`math` is not imported: write `import math` at the top"),
    "unread": ("p = rospy.Publisher('a', Int32)\nhello_str = 'hi'\np.publish(hello)\n",
               "`hello` a value, and nothing reads `hello_str`: on line 4, write hello_str instead of hello"),
    "read": ("p = rospy.Publisher('a', Int32)\nmsg_text = 'hi'\nprint(msg_text)\np.publish(msg)\n",
             "above line 5, create the message: `msg = Int32()`"),
    "exception-in-brackets": ("try:\n    pass\nexcept IOError(why):\n    pass\n", "write `except IOError as why:`"),
    "not-the-exception": ("try:\n    pass\nexcept IOError:\n    print(gain)\n", "write `gain = …`"),
    "class-like-a-variable": ("quaternions = 1\nx = Quaternion()\n", "define Quaternion or import it"),
    "name of Python 2": ("ranges = 1\nx = xrange(3)\n", "nothing in the file gives `xrange` a value"),
    "module": ("x = math.sin(1)\n", "`math` is not imported: write `import math` at the top"),
    "module-of-messages": ("p = rospy.Publisher('a', std_msgs.msg.Int8)\n", "write `import std_msgs.msg` at the top"),
    "alias": ("x = np.zeros(3)\n", "`np` is not imported: write `import numpy as np` at the top"),
    "constant": ("a = 1\ndef f():\n    return a * LIMIT\n", "above line 3, write `LIMIT = …`, with the value"),
    "class": ("x = Robot()\n", "nothing in the file gives `Robot` a value: above line 2, define Robot or import it"),
    "function": ("steer(1)\n", "above line 2, define it with `def steer(…):`, or import it"),
    "the function that nothing calls": ("def turn_server():\n    pass\ndef used(a):\n    pass\nused(1)\nadd_server()\n",
        "and nothing calls `turn_server`: on line 7, write `turn_server` instead of `add_server`"),
    "a function of other arguments": ("def turn_server(a):\n    pass\nadd_server()\n", "above line 4, define it with"),
    "a value like a function's name": (
        ("from lab.srv import TurnResponse\ndef turning_velocity_server(req):\n"
         "    return TurnResponse(turning_velocity)\n"),
        "above line 4, write `turning_velocity = …`, with the value that it should have"),
    "publisher": ("while True:\n    pub.publish(1)\n",
                  "above line 2, write `pub = rospy.Publisher('…', …, queue_size=10)`"),
    "publisher of ros": ("import rospy as ros\nwhile True:\n    pub.publish(1)\n",
                         "above line 3, write `pub = ros.Publisher('…', …, queue_size=10)`"),
    "publisher of the class": ("from rospy import Publisher\npubl = 1\nwhile True:\n    publisher.publish(1)\n",
                               "above line 4, write `publisher = Publisher('…', …, queue_size=10)`"),
    "rate": ("for i in range(3):\n    rate.sleep()\n", "above line 2, write `rate = rospy.Rate(…)`"),
    "callback": ("rospy.Subscriber('a', None, heard)\n", "above line 2, define it with `def heard(…):`"),
    "value": ("x = 3 * gain\n", "above line 2, write `gain = …`, with the value that it should have"),
    "method": ("class A:\n    def go(self):\n        turn()\n    def turn(self):\n        pass\n",
               "`turn` belongs to the class A: on line 4, write `self.turn` instead of `turn`"),
    "key": ("d = rospy.get_param('d')\nx = d[name]['first']\n",
            "the key `name` is written here without quotes: on line 3, write `d['name']['first']`"),
    "key-of-its-own": ("def f():\n    d = rospy.get_param('d')\ndef g(d):\n    phone = d[phone]\n",
                       "on line 5, write `d['phone']`"),
    "key-of-an-argument": ("d = rospy.get_param('d')\ndef f(key):\n    key = d[key]\n", ""),
    "index": ("rows = [1]\nx = rows[at]\n", "nothing in the file gives `at` a value"),
    "method-from-outside": ("class A:\n    def go(self):\n        pass\ngo()\n",
                            "`go` belongs to the class A: on line 5, write `A().go` instead of `go`"),
    "other-method": ("class A:\n    def __init__(self):\n        p = 1\n    def go(self):\n        print(p)\n",
                     "`p` has a value only in `__init__(…)`: on lines 4 and 6, write `self.p` instead of `p`"),
    "argument-of-a-lambda": ("class A:\n    def a(self):\n        p = 1\n    def b(self):\n        lambda p: p\n", ""),
    "self-outside": ("class A:\n    def go(self):\n        pass\nA().go(self)\n",
                     "`self` is known only inside of a class's methods: on line 5, take `self` out of the brackets"),
    "self-in-place-of-an-object": ("class A:\n    def go(self):\n        pass\nself.go()\n",
                                   "on line 5, write the object's name instead of `self`"),
    "other-function": ("def a():\n    total = 1\ndef b():\n    return total\n",
                       "`total` has a value only in `a(…)`: below line 2, write `global total`"),
    "argument": ("def a(msg):\n    pass\ndef b():\n    return msg\n",
                 "`msg` has a value only in `a(…)`: keep it there"),
    "import-in-function": ("def a():\n    import time\ndef b():\n    time.sleep(1)\n",
                           "`time` has a value only in `a(…)`: move its import to the top of the file"),
    "argument without its value": ("p = rospy.Publisher('a', Int32, queue_size)\n",
                                   "`queue_size` is named here without its value: write `queue_size=10`"),
    "global": ("def a():\n    global total\n    total = 1\ndef b():\n    return total\n", ""),
    "global-of-the-function-around": ("def a():\n    n = 0\n    def b(e):\n        global n\n        n += 1\n",
                                      "`global n` on line 5 is not the `n` of `a`: on line 5, write `nonlocal`"),
    "global-of-the-module": ("n = 0\ndef a():\n    n = 0\n    def b(e):\n        global n\n        n += 1\n", ""),
    "enclosing": ("def a(x):\n    def b():\n        return x\n    return [b, lambda y: x + y, [z for z in x]]\n", ""),
    "object-outside-of-its-class": ("class A:\n    def __init__(self):\n        self.rate = 1\na = A()\nrate.run()\n",
                                    "nothing in the file gives `rate` a value: above line 6"),
    "class-level": ("class A:\n    n = 3\n    m = n + 1\n", ""),
    "caught": ("try:\n    text = unicode\nexcept NameError:\n    text = str\n", ""),
    # the import fails by itself
    "class-in-other-capitals": ("from lab.msg import reading\nx = Reading()\n", ""),
    "star": ("from math import *\nx = sin(3)\n", ""),
    "made": ("exec('y = 3')\nx = y\n", ""),
    "handled": ("try:\n    pass\nexcept OSError as error:\n    print(error)\n", ""),
}  # fmt: skip


@pytest.mark.parametrize("case", UNDEFINED)
def test_a_name_that_nothing_gives_a_value(tmp_path, case):
    text, told = UNDEFINED[case]
    (tmp_path / "a.py").write_text(f"import rospy; from std_msgs.msg import Int32\n{text}")
    found = [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind == "undefined"]
    slips = [f"{s.message}: {s.fix}" for s in found]
    assert bool(slips) == bool(told)
    assert told in "".join(slips[:1])


SAID = {
    "percent": ("p.publish('hello %s' % now)", ("publishes", "hello {}")),
    "added": ("p.publish('hello ' + str(n))", ("publishes", "hello {}")),
    "f-string": ("p.publish(f'{n} seconds')", ("publishes", "{} seconds")),
    "format": ("p.publish('a {} b {:.2f}'.format(n, m))", ("publishes", "a {} b {}")),
    "named": ("text = 'hello %d %%' % n; p.publish(text)", ("publishes", "hello {} %")),
    "message": ("msg = String(); msg.data = 'fixed'; p.publish(msg)", ("publishes", "fixed")),
    "class": ("p.publish(String(data='fixed'))", ("publishes", "fixed")),
    "self": ("self.m = String('a' + x); self.p.publish(self.m)", ("publishes", "a{}")),
    "given-twice": ("text = 'a'; text = 'b'; p.publish(text)", None),
    "unknown": ("p.publish(make())", None),
    "log": ("rospy.loginfo('got %s', msg.data)", ("prints", "got {data}")),
    "log-of-caller": (
        "rospy.loginfo(rospy.get_caller_id() + 'got %s', msg.data)",
        ("prints", "{node}got {data}"),
    ),
    "print": ("print('a', n, msg.data)", ("prints", "a {} {data}")),
    "argument": ("heard = lambda m: print(m)", ("prints", "{data}")),
}


@pytest.mark.parametrize("case", SAID)
def test_what_a_script_publishes_and_prints_is_read_from_its_source(tmp_path, case):
    code, said = SAID[case]
    (tmp_path / "a.py").write_text(code + "\n")
    slips = [(s.kind, s.message) for s in check_syntax(tmp_path, ["a.py"]).slips]
    assert [one for one in slips if one[0] in ("publishes", "prints")] == ([said] if said else [])


@pytest.mark.parametrize(
    ("code", "fix"),
    [
        ("++i", "write `i += 1`"),
        ("--self.i", "write `self.i -= 1`"),
        ("i + 1", "write `i += 1`"),
        ("i % 128", "write `i %= 128`"),
        ("self.i - 256", "write `self.i -= 256`"),
        ("(i + 1) % 128", "write `i = (i + 1) % 128`"),
        ("i == 0", "write `i = 0`"),
        ("i = i", "write `i = i + 1`, or whatever it should be,"),
        ("a[0] = b[0]", ""),
        ("+i", ""),
        ("-+i", ""),
        ("f() == 3", ""),
        ("i += 1", ""),
        ("x = i == 0", ""),
    ],
)
def test_a_statement_that_changes_nothing(tmp_path, code, fix):
    (tmp_path / "a.py").write_text(f"i = 0\n{code}\n")
    slips = [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind in ("no-effect", "compared")]
    assert [(s.line, s.fix) for s in slips] == ([(2, fix)] if fix else [])


PAIR = "    def go(self):\n        self.pub.publish(1)\n"
MADE = "    def __init__(self):\n        self.pub = 1\n"
SPINS = "    def __init__(self):\n        spin()\n        self.pub = 1\n"
SET = "    def set(self):\n        self.pub = 1\n"
OBJECTS = {
    "good": (f"class A:\n{MADE}{PAIR}a = A()\na.go()\nA.go(a)\n", ""),
    "inherited": (f"class A(B):\n{PAIR}A().go()\n", ""),
    "class-level": (f"class A:\n    pub = 1\n{PAIR}A().go()\n", ""),
    "from-outside": (f"class A:\n{PAIR}a = A()\na.pub = 1\na.go()\n", ""),
    "single-underscores": (f"class A:\n{MADE.replace('__', '_')}{PAIR}A().go()\n",
                           "on line 2, write `__init__` instead of `_init_`"),
    "int": (f"class A:\n{MADE.replace('init', 'int')}{PAIR}A().go()\n",
            "on line 2, write `__init__` instead of `__int__`"),
    "init": (f"class A:\n{MADE.replace('__', '')}{PAIR}A().go()\n", "on line 2, write `__init__` instead of `init`"),
    "init-called": (f"class A:\n{MADE.replace('__', '')}{PAIR}a = A()\na.init()\na.go()\n",
                    "give `self.pub` its value in `__init__`, before anything can ask for it"),
    "setup-called-at-first": (f"class A:\n{MADE.replace('self.pub = 1', 'self.set()')}{SET}{PAIR}A().go()\n", ""),
    "init-outside": (f"class A:\n{PAIR}def __init__(self):\n    self.pub = 1\n",
                     "indent `def __init__` on line 4 like the other methods of A, and its lines below it"),
    "without-self": (f"class A:\n{MADE.replace('self.pub', 'pub')}{PAIR}",
                     "on line 3, write `self.pub` instead of `pub`"),
    "behind-a-spin": (f"class A:\n{SPINS}{PAIR}A()\n",
                      "move line 4 above line 3"),
    "spelt-otherwise": (f"class A:\n{MADE}{PAIR.replace('pub.', 'pubs.')}",
                        "on line 5, write `self.pub` instead of `self.pubs`"),
    "other-method": (f"class A:\n{MADE.replace('__init__', 'setup')}{PAIR}",
                     "give `self.pub` its value in `__init__`, or call `self.setup(…)` there"),
    "nowhere": (f"class A:\n{PAIR}", "in `__init__`, write `self.pub = …`, with the value that it should have"),
    "nowhere-called": (f"class A:\n{PAIR.replace('pub.publish', 'send')}",
                       "add a method `def send(self, …):` to the class A"),
    "nowhere-given": (f"class A:\n{PAIR.replace('self.pub.publish(1)', 'Subscriber(1, 2, self.hear)')}",
                      "add a method `def hear(self, …):` to the class A"),
    "given-from-outside": ((f"class A:\n{PAIR.replace('self.pub.publish(1)', 'Subscriber(1, 2, callback=self.hear)')}"
                           "def hear(msg):\n    pass\n"), "on line 3, write `hear` instead of `self.hear`"),
    "outside-the-class": ((f"class A:\n{PAIR.replace('self.pub.publish(1)', 'Timer(1, self.hear)')}"
                          "def hear(self, event):\n    pass\n"),
                          "indent `def hear` on line 4 like the other methods of A, and its lines below it"),
    "class": (f"class A:\n{MADE}{PAIR}A.go()\n", "on line 6, write `A().go()`"),
    "class-named": (f"class A:\n{MADE}{PAIR}a = A\na.go()\n", "on line 6, write `a = A()`"),
    "class-with-values": (f"class A:\n{MADE.replace('self)', 'self, n)')}{PAIR}A.go()\n",
                          "on line 6, write `A(…).go()`"),
}  # fmt: skip


@pytest.mark.parametrize("case", OBJECTS)
def test_an_object_that_lacks_an_attribute_or_was_never_made(tmp_path, case):
    code, fix = OBJECTS[case]
    (tmp_path / "a.py").write_text(code)
    slips = [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind == "object"]
    assert [s.fix for s in slips if s.name != "__init__"] == ([fix] if fix else [])
    assert {s.fix for s in slips if s.name == "__init__"} <= {fix}


LOOP = "c = 0\nwhile True:\n"
COUNTERS = {
    "good": (f"{LOOP}    p.publish(c)\n    c += 1\n    if c > 127:\n        c = 0\n", None),
    "modulo": (f"{LOOP}    p.publish(c)\n    c = (c + 1) % 128\n", None),
    "published-last": (f"{LOOP}    c += 1\n    if c > 127:\n        c = 0\n    p.publish(c)\n", None),
    "made-above": (f"t = 'at %s' % now()\n{LOOP}    p.publish(t)\n",
                   ("no-effect", 4, "move line 1 into that loop, above line 4")),
    "message made once": ("m = String()\nm.data = 'at %s' % rospy.get_time()\nwhile True:\n    p.publish(m)\n",
                          ("no-effect", 4, "move line 2 into that loop, above line 4")),
    "message that stays": ("m = Twist()\nm.linear.x = 0.2\nwhile True:\n    p.publish(m)\n", None),
    "made-above-on-lines": (f"t = 'at %s' % (\n    now())\n{LOOP}    p.publish(t)\n",
                            ("no-effect", 5, "move lines 1 to 2 into that loop, above line 5")),
    "made-above-and-again": (f"t = 'at %s' % now()\n{LOOP}    u = 'now %s' % now()\n    p.publish(t)\n",
                             ("no-effect", 5, "on line 5, publish `u`")),
    "made-above-beside-a-number": (f"t = 'at %s' % now()\n{LOOP}    u = now()\n    p.publish(t)\n",
                                   ("no-effect", 5, "move line 1 into that loop, above line 4")),
    "made-above-and-changed": (f"m = Msg()\n{LOOP}    m.x = now()\n    p.publish(m)\n", None),
    "set": (f"{LOOP}    c = 0\n    p.publish(c)\n    c += 1\n",
            ("set-in-loop", 3, "move line 3 above the loop on line 2")),
    "reset-inverted": (f"{LOOP}    p.publish(c)\n    c += 1\n    if not c > 127:\n        c = 0\n",
                       ("set-in-loop", 5, "delete the `not` on line 5")),
    "reset-below": (f"{LOOP}    p.publish(c)\n    c += 1\n    if c <= 127:\n        c = 0\n",
                    ("set-in-loop", 5, "on line 5, write `>` in the condition")),
    "kept-above": (f"{LOOP}    p.publish(c)\n    c += 1\n    if c < 5:\n        c = 5\n", None),
    "reset-before": (f"{LOOP}    p.publish(c)\n    if c > 127:\n        c = 0\n    c += 1\n",
                     ("reset-early", 4, "move line 6 above the `if` on line 4")),
    "reset-first": (f"{LOOP}    if c > 127:\n        c = 0\n    c += 1\n    p.publish(c)\n",
                    ("reset-early", 3, "move line 5 above the `if` on line 3")),
    "of-self": (f"{LOOP}    p.publish(self.c)\n    if self.c == 127:\n        self.c = 0\n    self.c += 1\n",
                ("reset-early", 4, "move line 6 above the `if` on line 4")),
    "of-the-class": ("class T:\n c = 0\n def run(self):\n  while 1:\n   p.publish(Int8(T.c))\n   self.c += 1\n",
                     ("no-effect", 5, "on line 5, publish `self.c`")),
    "of-a-local": ("self.c = 0\ndef run():\n  c = 0\n  while 1:\n   p.publish(self.c)\n   c += 1\n",
                   ("no-effect", 5, "on line 5, publish `c`")),
    "of-the-class-and-set": ("T.c = 0\ndef f():\n while 1:\n  p.publish(T.c)\n  s.c += 1\n  T.c = s.c\n", None),
    "of-a-message": ("def cb(m):\n p.publish(m.c)\n self.c += 1\n", None),
    "plus behind": ("c = 0\nwhile True:\n    p.publish(c)\n    c =+ 1\n", ("no-effect", 4, "write `c += …`")),
    "below": (f"{LOOP}    p.publish(c)\nc += 1\nif c > 9:\n    c = 0\n",
              ("no-effect", 4, "indent lines 4 to 6 like the lines of that loop")),
    "below-alone": (f"{LOOP}    p.publish(c)\nc += 1\n", ("no-effect", 4, "indent line 4 like the lines of that loop")),
    "below-another": (f"{LOOP}    p.publish(1)\nc += 1\n", None),
    "two-sleeps": (f"{LOOP}    p.publish(c)\n    r.sleep()\n    rospy.sleep(1)\n", ("sleep-twice", 5, "delete line 5")),
    "three-sleeps": (f"{LOOP}    r.sleep()\n    p.publish(c)\n    r.sleep()\n    rospy.sleep(1)\n",
                     ("sleep-twice", 6, "delete lines 5 and 6")),
    "sleeps-apart": (f"{LOOP}    r.sleep()\n    p.publish(c)\n    r.sleep()\n", ("sleep-twice", 5, "delete line 5")),
    "sleeps-between-topics": (f"{LOOP}    p.publish(c)\n    r.sleep()\n    q.publish(c)\n    r.sleep()\n",
                              ("sleep-twice", 6, "delete line 6")),
    "sleeps-in-a-function-too": (f"def turn():\n    p.publish(1)\n    r.sleep()\n{LOOP}    turn()\n    r.sleep()\n",
                                 ("sleep-twice", 7, "delete line 7")),
    "sleeps-in-the-only-function": (
        f"def turn():\n    p.publish(1)\n    r.sleep()\n    rospy.sleep(1)\n{LOOP}    turn()\n",
        ("sleep-twice", 4, "delete line 4")),
    "sleeps-in-a-method-below": (
        "class A:\n def run(self):\n  while 1:\n   p.publish(1)\n   self.w()\n   r.sleep()\n def w(s):\n  r.sleep()\n",
        ("sleep-twice", 6, "delete line 6")),
    "sleeps-in-a-function-twice": (f"def w():\n    r.sleep()\n{LOOP}    w()\n    p.publish(1)\n    w()\n", None),
    "sleeps-in-another-publish": (
        f"class A:\n  def publish(self):\n    p.publish(1)\n    r.sleep()\n{LOOP}    p.publish(c)\n    r.sleep()\n",
        None),
    "same-message-again": (f"{LOOP}    p.publish(c)\n    p.publish(c)\n    r.sleep()\n",
                           ("publish-twice", 4, "delete line 4")),
    "three-messages": (f"{LOOP}    p.publish(a)\n    b = 1\n    p.publish(b)\n    p.publish(c)\n    r.sleep()\n",
                       ("publish-twice", 5, "delete all but one of lines 3, 5 and 6")),
    "two-publishers": (f"{LOOP}    p.publish(c)\n    q.publish(c)\n    r.sleep()\n", None),
    "two-messages": (f"{LOOP}    p.publish(c)\n    r.sleep()\n    p.publish(c)\n    r.sleep()\n", None),
}  # fmt: skip


@pytest.mark.parametrize("case", COUNTERS)
def test_what_a_loop_does_to_its_counter_and_its_rate(tmp_path, case):
    code, found = COUNTERS[case]
    (tmp_path / "a.py").write_text(code)
    kinds = ("set-in-loop", "reset-early", "sleep-twice", "publish-twice", "no-effect")
    slips = [(s.kind, s.line, s.fix) for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind in kinds]
    assert slips == ([found] if found else [])


CALLBACK = "def callback(m):\n    print(m.data)\n    {0}\nrospy.Subscriber('c', String, callback)\n"
WAITING = {
    "sleeps": ("time.sleep(10)", "delete line 3"),
    "sleeps-by-rate": ("rate.sleep()", "delete line 3"),
    "loops": ("while not rospy.is_shutdown(): print(1)", "take the loop out of it"),
    "spins": ("rospy.spin()", "move line 3 out of it"),
    "short": ("rospy.sleep(0.01)", None),
    "ends": ("for i in range(3): print(i)", None),
    "never-changes": ("near = m.data < 1\n    while near: print(1)", "take the loop out of it"),
    "changes": ("near = m.data < 1\n    while near: near = look()", None),
    "of-the-module": ("global near\n    near = True\n    while near: print(1)", None),
    "of-an-object": ("near = m\n    while near.data: print(1)", None),
}


@pytest.mark.parametrize("case", WAITING)
def test_a_callback_that_waits(tmp_path, case):
    line, fix = WAITING[case]
    (tmp_path / "a.py").write_text(CALLBACK.format(line))
    slips = [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind == "callback-waits"]
    last = 3 + line.count("\n")
    assert [(s.line, s.fix, s.name) for s in slips] == ([(last, fix, "callback")] if fix else [])


def test_a_handler_of_a_service_that_waits(tmp_path):
    code = "def add(request):\n    rospy.sleep(20)\n    return 1\nrospy.Service('/add', Add, add)\n"
    (tmp_path / "a.py").write_text(code)
    slips = [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind == "callback-waits"]
    assert [(s.line, s.message) for s in slips] == [(2, "the callback `add` sleeps on line 2")]


def test_a_handler_that_waits_again_and_again(tmp_path):
    code = "def add(request):\n    rate.sleep()\n    if go():\n        stop()\n        rate.sleep()\n"
    (tmp_path / "a.py").write_text(code + "rospy.Service('/add', Add, add)\n")
    slips = [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind == "callback-waits"]
    assert [(s.message, s.fix) for s in slips] == [
        ("the callback `add` sleeps on line 2 and again on line 5", "delete lines 2 and 5")
    ]


@pytest.mark.parametrize(
    ("body", "message", "fix"),
    [
        (
            "while far(): rate.sleep()",
            "the loop in the callback `add`, line 2, sleeps in each turn",
            "keep in it only what came, and go through the loop of line 2 in the main program",
        ),
        (
            "square()",
            "the callback `add` calls `square` on line 2, which goes around a loop that sleeps",
            "keep in it only that it was called, and call `square` in the main program",
        ),
        (
            "for i in range(3): rate.sleep()",
            "the loop in the callback `add`, line 2, sleeps in each turn",
            "keep in it only what came, and go through the loop of line 2 in the main program",
        ),
        (
            "turn()",
            "the callback `add` calls `turn` on line 2, which goes around a loop that sleeps",
            "keep in it only that it was called, and call `turn` in the main program",
        ),
        ("for i in range(3): time.sleep(0.01)", None, None),
        ("stop()", None, None),
        ("Thread(target=square).start()", None, None),
    ],
)
def test_a_handler_that_loops(body, message, fix, tmp_path):
    code = f"def add(request):\n    {body}\n    return 1\nrospy.Service('/add', Add, add)\n"
    code += "def drive():\n    while far(): rate.sleep()\ndef square(): drive()\ndef stop(): rate.sleep()\n"
    code += "def turn():\n    for i in range(3): rate.sleep()\n"
    (tmp_path / "a.py").write_text(code)
    slips = [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind == "callback-waits"]
    assert [(s.message, s.fix) for s in slips] == ([(message, fix)] if fix else [])


ARGUMENTS = {
    "one": ("a = sys.argv[1]\n", ["a = int(sys.argv[1])"]),
    "several": ("a, b = rospy.myargv(sys.argv)[1:3]\n", ["a, b = map(int, rospy.myargv(sys.argv)[1:3])"]),
    "numbers": ("a = int(sys.argv[1])\nb = values[1]\n", []),
}


@pytest.mark.parametrize("case", ARGUMENTS)
def test_an_argument_that_is_kept_as_a_text(tmp_path, case):
    text, fixes = ARGUMENTS[case]
    (tmp_path / "a.py").write_text(f"import sys, rospy\nvalues = []\n{text}")
    assert [s.fix for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind == "argument-text"] == fixes


CAUGHT = {"KeyError(e)": "KeyError", "A if b else C": "", "": "Exception", "(A, B, e)": "(A, B)", "E.e": "E"}


@pytest.mark.parametrize(("caught", "meant"), CAUGHT.items())
def test_an_exception_gets_the_name_that_is_used(caught: str, meant: str, tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text(f"try:\n    f()\nexcept {caught}:\n    print(e)\n")
    fixes = {s.fix for s in check_syntax(tmp_path, ["a.py"]).slips if s.name == "e"}
    assert (f"on line 3, write `except {meant} as e:`" in fixes) == bool(meant)
    assert not any("..." in fix for fix in fixes)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("counter = 0\nprint(conter)\n", ["write counter instead of conter"]),
        ("def run(speed):\n    return sped\n", ["write speed instead of sped"]),
        ("try:\n    f = 1\nexcept IOErorr:\n    pass\n", ["write IOError instead of IOErorr"]),
        (
            "class A:\n    def go(self):\n        self.rate = 1\n        rate.sleep()\n",
            ["write self.rate instead of rate"],
        ),
        (
            "class A:\n    def go(self):\n        pass\n    self.go()\n",
            ["indent line 4 like the lines of the method above it, or delete it"],
        ),
        (  # once they are in the method, what this gives a value has one
            "class A:\n    def go(self):\n        made = 1\n    pub.publish(made)\n    rate.sleep()\n",
            ["indent lines 4 to 5 like the lines of the method above them, or delete them"] * 2,
        ),
        (
            "class A:\n    def __init__(self, naMe):\n        self.name = name\n",
            ["write naMe instead of name"],
        ),
        ("while 1:\n    breka\n", ["write break instead of breka"]),
        ("class A:\n    print('made')\n", []),
        ("twist = Twist()\n", []),
        ("from a import *\ncounter = 0\nprint(conter)\n", []),
        ("counter = 0\nprint(unlike)\n", []),
        ("counter = Noone\n", ["write None instead of Noone"]),
        ("counter = Node()\n", []),
        (
            "from queue import queue\nq = queue(3)\n",
            ["write `from queue import Queue`, and Queue instead of queue on line 2"],
        ),
        ("from queue import queue\nq = queue.Queue(3)\n", ["write `import queue`"]),
        (
            "from threading import thread as t\nt(target=f)\nf = 1\n",
            ["write `from threading import Thread as t`"],
        ),
        ("from queue import Queue\nq = Queue(3)\n", []),
        ("import queue\nq = Queue(3)\n", ["write queue.Queue instead of Queue"]),
        ("import queue\nq = Queue.Queue(3)\n", ["write queue instead of Queue"]),
        (
            "import rospy\ntry:\n    pass\nexcept (ValueError, rospy.RosInterruptException):\n    pass\n",
            ["write rospy.ROSInterruptException instead of rospy.RosInterruptException"],
        ),
        (
            "import rospy as ros\ntry:\n    pass\nexcept ros.ROSInteruptException:\n    pass\n",
            ["write ros.ROSInterruptException instead of ros.ROSInteruptException"],
        ),
        (
            "try:\n    pass\nexcept rospy.exceptions.ROSException:\n    1\nexcept rospy.ServiceException:\n    2\n",
            [],
        ),
        ("try:\n    pass\nexcept rospy.Broken:\n    pass\nexcept:\n    pass\n", []),
        ("if __naMe__ == '__main__':\n    pass\n", ["write `if __name__ == '__main__':`"]),
        ("try:\n    pass\nexcept Exception as error:\n    print(error, __file__)\n", []),
    ],
)
def test_a_name_that_is_not_there_and_one_that_is_spelt_alike(tmp_path, text, told):
    (tmp_path / "a.py").write_text(text)
    slips = check_syntax(tmp_path, ["a.py"]).slips
    assert [s.fix for s in slips if s.kind in ("misspelt", "outside-method")] == told
    strays = {s.line for s in slips if s.kind == "outside-method"}
    assert not any(s.kind == "undefined" and s.line in strays for s in slips)


@pytest.mark.parametrize(
    ("begin", "fixes"),
    [
        ("def f():", ["above line 2, write `n = 0`"]),
        ("def f(n):", []),
        ("n = 0\ndef f():", []),
        ("def f():\n    n = 0", []),
        ("def f():\n    for n in a: pass", []),
        ("def f():\n    global n", []),
        ("def f():\n    while True:\n        s += 'a'", ["above line 4, write `n = 0`"]),
    ],
)
def test_a_variable_that_is_only_added_to(tmp_path, begin, fixes):
    (tmp_path / "a.py").write_text(f"{begin}\n    while True:\n        n = n + 1\n        print(n)\na = []\n")
    slips = check_syntax(tmp_path, ["a.py"]).slips
    assert [s.fix for s in slips if s.kind == "undefined"] == fixes


@pytest.mark.parametrize(
    ("code", "fixes"),
    [
        ("buffer.lookup_transform(odom, laser, rospy.Time(0))", ["'odom'", "'laser'"]),
        ("base.child_frame_id = base_link", ["'base_link'"]),
        ("rospy.Publisher(chatter, String, queue_size=1)", ["'chatter'"]),
        ("rospy.init_node(talker)", ["'talker'"]),
        ("def talk():\n    pass\nrospy.init_node(talker)", ["'talker'"]),
        ("chatter = 'chatter'\nrospy.Publisher(chatter, String, queue_size=1)", []),
        ("print(chatter)", []),
        ("rospy.Publisher(topic_name, String, queue_size=1)", []),
    ],
)
def test_names_that_ros_is_given_without_quotes(tmp_path, code, fixes):
    text = f"import rospy\nfrom std_msgs.msg import String\nbuffer = base = 1\n{code}\n"
    (tmp_path / "a.py").write_text(text)
    slips = [s for s in check_syntax(tmp_path, ["a.py"]).slips if "without quotes" in s.message]
    last = text.count("\n")
    assert [s.fix for s in slips] == [f"on line {last}, write `{fix}`" for fix in fixes]


@pytest.mark.parametrize(
    ("text", "fixes"),
    [
        (
            "pub = rospy.Publisher('c', String)\nString = String()\nString.data = 'a'\npub.publish(String)\n",
            ["on lines 3, 4 and 5, call the message `msg`, as in `msg = String()`"],
        ),
        (
            "def f(msg):\n    String = String(msg.data)\n",
            ["on line 3, call the message `message`, as in `message = String(…)`"],
        ),
        (
            "from rospy import Rate\nprint(String)\ndef f():\n    Rate = Rate(10)\n",
            ["on line 5, call the object `own_rate`, as in `own_rate = Rate(…)`"],
        ),
        ("from tqdm import tqdm\ntqdm = tqdm(9)\nprint(String)\n", []),
        ("string = String()\nString.data = 'a'\n", []),
        ("Int8 = Int8()\n", []),
    ],
)
def test_a_message_with_the_name_of_its_class(text: str, fixes: list[str], tmp_path: Path) -> None:
    source = "from std_msgs.msg import String\n" + text
    (tmp_path / "a.py").write_text(source, encoding="utf-8")
    slips = check_syntax(tmp_path, ["a.py"]).slips
    assert [s.fix for s in slips if s.kind == "hides-class"] == fixes
    assert not fixes or "unused-import" not in [s.kind for s in slips]


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("import rospy\nrospy.spin()\n", []),
        ("import nosuch\n", ["unused-import", "lacking-import"]),
        ("from nosuch import rate\nrate = 10\nprint(rate)\n", ["unused-import", "lacking-import"]),
        ("import nosuch as n\nprint(n)\n", ["lacking-import"]),
        ("from json import dumps\n", ["unused-import"]),
        ("from json import JSONDecoder\na: JSONDecoder = None\nprint(a)\n", []),
        ("from json import rate\nrate = 10\nprint(rate)\n", ["unused-import"]),
        ("from nosuch import *\n", ["lacking-import"]),
        ("from . import nosuch\nimport os\n", []),
        ("import rospy, nosuch, json, nosuch2\nrospy.spin(nosuch)\n", ["lacking-import", "lacking-import"]),
        ("import os, nosuch as n\n", ["unused-import", "lacking-import"]),
        ("import json, math\n", ["unused-import"]),
        ("import json, math\nprint(math.pi)\n", []),
        ("try:\n    import nosuch\nexcept ImportError:\n    pass\n", []),
    ],
)
def test_imports_that_are_not_used_or_not_there(tmp_path, text, found):
    (tmp_path / "a.py").write_text(text)
    slips = check_syntax(tmp_path, ["a.py"]).slips
    assert [s.kind for s in slips if s.kind in ("unused-import", "lacking-import")] == found
    assert all("line 1" in s.fix for s in slips if s.kind == "unused-import")


GUARDS = {
    "bin == '__main__'": "`bin` is never '__main__'",
    "'__main__' == main": "`main` is never '__main__'",
    "'__name__' == '__main__'": "`'__name__'` is never '__main__'",
    "'main' == __name__": "`__name__` is never 'main'",
    "__name__ != '__main__'": "`__name__` is '__main__' whenever the script is run",
    "'__main__' == __name__": "",
    "__name__ is '__main__'": "",
    "__name__ >= '__main__'": "",
    "'__main__' == '__main__'": "",
    "role == '__main__'": "",
}


@pytest.mark.parametrize("test", GUARDS)
def test_what_keeps_a_script_from_running(test: str, tmp_path: Path) -> None:
    text = f"role = __name__\ndef main():\n    rospy.spin()\nif {test}:\n    main()\n"
    (tmp_path / "a.py").write_text(text, encoding="utf-8")
    found = [s.message for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind == "main-guard"]
    assert found == [GUARDS[test]] * bool(GUARDS[test])


@pytest.mark.parametrize(
    ("body", "found"),
    [
        (
            "    def __init__(self):\n        self.r == f(1)\n",
            ["on line 3, write `self.r =` in place of `self.r ==`"],
        ),
        (
            "    n = 0\n    def heard(msg, self):\n        self.n += 1\n",
            ["on line 3, write `def heard(self, msg):`"],
        ),
        ("    n = 0\n    @staticmethod\n    def heard(msg, self):\n        self.n += 1\n", []),
        ("    n = 0\n    def heard(self, msg):\n        self.n += 1\n", []),
    ],
)
def test_attributes_of_self(body: str, found: list[str], tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text(f"class A:\n{body}", encoding="utf-8")
    assert [s.fix for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind == "object"] == found
