"""What a callback prints of its message: script_prints.py."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from grader.package.python import check_syntax

pytestmark = pytest.mark.usefixtures("without_processes")


SUBSCRIBED = "\nrospy.Subscriber('c', Int8, {})\n"


def said(text: str, tmp_path: Path, callback: str = "cb") -> list[tuple[str, str, str]]:
    (tmp_path / "a.py").write_text(text + SUBSCRIBED.format(callback), encoding="utf-8")
    slips = check_syntax(tmp_path, ["a.py"]).slips
    return [(s.kind, s.message, s.fix) for s in slips if s.kind in {"not-printed", "printed-in-part"}]


@pytest.mark.parametrize(
    ("body", "message", "fix"),
    [
        ("    pass", "the callback `cb` on line 1 prints nothing", "`rospy.loginfo(m.data)`"),
        ("    number = m.data", "the callback `cb` on line 1 prints nothing", "`rospy.loginfo(m.data)`"),
        ("    global n\n    n += m.data\n    p.publish(n)", "`cb` on line 1 prints nothing", "`rospy.loginfo(m.data)`"),
        ("    global n\n    n += 1\n    print('heard', n)", "line 4 prints `n`", "on line 4, print `m.data`"),
        ("    print(rospy.get_caller_id() + ' I heard')", "line 2 prints has nothing of the message", "`m.data`"),
        ("    rospy.logdebug('%d', m.data)", "`logdebug` on line 2 shows nothing", "write `rospy.loginfo`"),
        ("    return\n    print(m.data)", "line 2 ends the callback before line 3 prints the message", "delete line 2"),
        ("    global n\n    n = m.data\n    rospy.logdebug(n)", "`logdebug` on line 4 shows nothing", "on line 4"),
    ],
)  # fmt: skip
def test_a_callback_that_shows_nothing(body: str, message: str, fix: str, tmp_path: Path) -> None:
    ((kind, why, what),) = said(f"def cb(m):\n{body}", tmp_path)
    assert kind == "not-printed"
    assert message in why
    assert fix in what


@pytest.mark.parametrize(
    ("body", "message"),
    [
        ("    if m.data:\n        print(m.data)", "line 3 prints only under the condition on line 2"),
        ("    if m.data: print(m.data)", "line 2 prints only where its `if` holds"),
        ("    if m.data > 0:\n        print(m.data)\n    elif m.data < 0:\n        print(m.data)",
         "the `if` on line 2 prints nothing where none of its conditions holds"),
        ("    if m.data == 5:\n        return\n    x = m.data\n    print(x)", "ends on line 3, before line 5 prints"),
        ("    rospy.loginfo('I heard %d', m.data + 1)", "something that is made of the message's value"),
        ("    x = abs(m.data)\n    print('x = {}'.format(x))", "something that is made of the message's value"),
        ("    print(f'{m.data[:5]}')", "something that is made of the message's value"),
        ("    print(m.data.split()[0])", "something that is made of the message's value"),
        ("    rospy.loginfo_once(m.data)", "`loginfo_once` on line 2 logs the first message only"),
        ("    rospy.loginfo_throttle(1, m.data)", "`loginfo_throttle` on line 2 logs some of the messages only"),
        ("    global last\n    print(last)\n    last = m.data", "which gets the message's value only on line 4"),
        ("    if m.data in seen:\n        return\n    seen.add(m.data)\n    print(m.data)", "before line 5 prints"),
    ],
)  # fmt: skip
def test_a_callback_that_shows_some_or_something_else(body: str, message: str, tmp_path: Path) -> None:
    ((kind, why, _),) = said(f"def cb(m):\n{body}", tmp_path)
    assert kind == "printed-in-part"
    assert message in why


@pytest.mark.parametrize(
    "body",
    [
        "    print(m)",
        "    rospy.loginfo(rospy.get_caller_id() + 'I heard %s', m.data)",
        "    out = 'n: %d' % m.data\n    sys.stdout.write(out + '\\n')",
        "    print('a ' + str(int(m.data)) + '!')",
        "    print(m.data, m.data + 1)",
        "    if m.data > 0:\n        print('+', m.data)\n    else:\n        print('-', m.data)",
        "    if m.data > 0:\n        print('+', m.data)\n        return\n    print('-', m.data)",
        "    if m.data > 3:\n        t = 'big %d' % m.data\n    else:\n        t = 'small %d' % m.data\n    print(t)",
        "    if not rospy.is_shutdown():\n        print(m.data)",
        "    try:\n        print(m.data)\n    except Exception:\n        pass",
        # what may be printed elsewhere is not told
        "    global v\n    v = m.data\ndef show():\n    print(v)",
        "    global v\n    v = m.data\n    rospy.logdebug('heard')\ndef show():\n    print(v)",
        "    seen.append(m.data)",
        "    logging.info('heard %s', m.data)",
        "    cb2(m)",
        "    for c in m.data:\n        print(c)",
        "    print(m.data, file=f)",
        "    if (v := m.data) > 3:\n        print('big', v)\n    else:\n        print('small', v)",
    ],
)
def test_nothing_is_said_of_a_callback_that_prints_or_hands_on(body: str, tmp_path: Path) -> None:
    assert said(f"def cb2(m):\n    print(m)\ndef cb(m):\n{body}", tmp_path) == []


@pytest.mark.parametrize(
    ("text", "callback", "fix"),
    [
        ("", "print('got one')", "write `lambda msg: print(msg.data)` in its place"),
        ("", "rospy.loginfo('got one')", "write `lambda msg: rospy.loginfo(msg.data)` in its place"),
        ("def make(word):\n    return lambda m: print(word, m.data)\n", "make", "on line 4, write `make(…)`"),
        ("def shown(f):\n    def g(m):\n        print(f(m))\n    return f\n@shown\ndef cb(m):\n    return m.data\n",
         "cb", "on line 4, write `return g`"),
        ("def shown(f):\n    def g(m):\n        print(f(m))\n    return g\n@shown\ndef cb(m):\n    return m.data\n",
         "cb", None),
        ("class A:\n  def cb(self, m):\n    last = m.data\n    self.tell()\n  def tell(self):\n    print(self.last)\n",
         "A().cb", "on line 3, write `self.last` instead of `last`"),
        ("class A:\n  def cb(self, m):\n    last = m.data\n    self.tell(last)\n  def tell(self, x):\n    print(x)\n",
         "A().cb", None),
    ],
)  # fmt: skip
def test_what_makes_a_callback_of_something_else(text, callback, fix, tmp_path: Path) -> None:
    assert [what for _, _, what in said(text, tmp_path, callback)] == ([fix] if fix else [])


def test_lambdas_and_methods_are_read_too(tmp_path: Path) -> None:
    assert [kind for kind, _, _ in said("", tmp_path, "lambda m: print('got one')")] == ["not-printed"]
    assert said("", tmp_path, "callback=lambda m: print(m.data)") == []
    method = "class A:\n    def cb(self, m):\n        print(self.n)\n    def run(self):\n"
    assert [kind for kind, _, _ in said(method, tmp_path, "self.cb")] == []  # it does not parse
    method += "        rospy.Subscriber('c', Int8, self.cb)\n"
    (tmp_path / "b.py").write_text(method, encoding="utf-8")
    kinds = [s.kind for s in check_syntax(tmp_path, ["b.py"]).slips]
    assert "not-printed" in kinds


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ("m.data = m.data / 2", True),
        ("m.data += 1", True),
        ("m.data = 0", True),
        ("m.data = m.data.strip()", False),
    ],
)
def test_a_message_that_is_changed_before_it_is_printed(line: str, told: bool, tmp_path: Path) -> None:
    fixes = [fix for _, _, fix in said(f"def cb(m):\n    {line}\n    print(m.data)\n", tmp_path)]
    assert len(fixes) == told
    assert all(re.fullmatch(r"delete line \d+", fix) for fix in fixes)


TWO = "def cb(m):\n    global n\n    n = m.data\n\ndef other(m):\n    text = n + m.data\n    print(%s)\n"


@pytest.mark.parametrize(("printed", "kinds"), [("text", ["printed-in-part"]), ("m.data", [])])
def test_a_message_that_another_topic_s_callback_prints(
    printed: str, kinds: list[str], tmp_path: Path
) -> None:
    text = TWO % printed + "rospy.Subscriber('c', String, cb)\nrospy.Subscriber('d', String, other)\n"
    (tmp_path / "a.py").write_text(text, encoding="utf-8")
    slips = [s for s in check_syntax(tmp_path, ["a.py"]).slips if "print" in s.kind and s.name == "c"]
    assert [s.kind for s in slips] == kinds
    assert [s.fix for s in slips] == ["print `m.data` in the callback `cb` too" for _ in kinds]


@pytest.mark.parametrize(
    ("queue", "found"),
    [
        ("deque(maxlen=1)", ["`q` keeps only the last message (`maxlen` on line 1)"]),
        ("collections.deque([], 3)", ["`q` keeps only the last 3 messages (`maxlen` on line 1)"]),
        ("deque()", []),
        ("deque(maxlen=None)", []),
    ],
)
def test_a_queue_that_drops_messages(queue: str, found: list[str], tmp_path: Path) -> None:
    text = f"q = {queue}\ndef cb(m):\n    q.append(m.data)\nwhile True:\n    print(q.popleft())\n"
    assert [message for _, message, _ in said(text, tmp_path)] == found


def test_what_is_printed_and_collected_may_be_printed_elsewhere(tmp_path: Path) -> None:
    text = "def cb(m):\n    if m.data:\n        print(m.data)\n    q.append(m.data)\n"
    assert said(text + "while True:\n    print(q)\n", tmp_path) == []


def test_a_message_that_is_kept_and_printed_in_a_loop(tmp_path: Path) -> None:
    text = "def cb(m):\n    global latest\n    latest = m.data\nwhile not rospy.is_shutdown():\n    print(latest)\n"
    ((kind, message, fix),) = said(text, tmp_path)
    assert (kind, fix) == ("printed-in-part", "print `m.data` in the callback `cb`")
    assert "line 5 prints in a loop what `latest` holds by then" in message


def test_a_callback_of_many_conditions_is_read_once(tmp_path: Path) -> None:
    """Each `if` doubles the number of ways through a function: they are not gone through one by one."""
    ifs = "".join(f"    if m.data == {n}:\n        x = {n}\n" for n in range(60))
    assert said(f"def cb(m):\n{ifs}    print(m.data)", tmp_path) == []
    assert [kind for kind, _, _ in said(f"def cb(m):\n{ifs}", tmp_path)] == ["not-printed"]


def test_a_callback_that_gives_its_argument_another_value_is_named(tmp_path: Path) -> None:
    found = said("def cb(m):\n    m = A()\n    print(m.data)\n", tmp_path)
    assert [(kind, fix) for kind, _, fix in found] == [("not-printed", "delete line 2")]
    assert said("def cb(m):\n    print(m.data)\n    m = A()\n", tmp_path) == []
    assert said("def cb(m):\n    m = m.data\n    print(m)\n", tmp_path) == []
