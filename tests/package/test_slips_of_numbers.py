"""Rates, counters and clocks of scripts, as far as their lines say them."""

from __future__ import annotations

from pathlib import Path

import pytest

from grader.package.python import check_syntax

pytestmark = pytest.mark.usefixtures("without_processes")


@pytest.mark.parametrize(
    ("rate", "found"),
    [
        ("rospy.Rate(rospy.get_param('~rate', 5))", [("~rate", 3)]),
        ("rospy.Rate(float(rospy.get_param('/hz')))", [("/hz", 3)]),
        ("rospy.Rate(hz)", [("hz", 2)]),
        ("rospy.Rate(10)", []),
        ("rospy.Rate(rospy.get_param(name))", []),
        ("rospy.Rate(other)", []),
    ],
)
def test_a_rate_that_is_a_parameter_is_known(tmp_path, rate, found):
    text = (
        f"import rospy\nhz = rospy.get_param('hz')\nrate = {rate}\nother = rospy.get_param('a')\nother = 3\n"
    )
    (tmp_path / "a.py").write_text(text)
    slips = check_syntax(tmp_path, ["a.py"]).slips
    assert [(s.message, s.line) for s in slips if s.kind == "rate-parameter"] == found


@pytest.mark.parametrize(
    ("code", "found"),
    [
        ("r = rospy.Rate(5)", [("5", 2)]),
        ("r = rospy.Rate(hz=1 / 10)", [("0.1", 2)]),
        ("rospy.Timer(callback=tell, period=rospy.Duration(2))", [("0.5", 2)]),
        ("r = rospy.Rate(HZ)", [("7.5", 2)]),
        ("r = rospy.Rate(1 / 0.4)", [("2.5", 2)]),
        ("while True:\n    rospy.sleep(0.2)", [("5", 3)]),
        ("while True:\n    time.sleep(2)", [("0.5", 3)]),
        ("while True:\n    rospy.sleep(rospy.Duration(1.0 / HZ))", [("7.5", 3)]),
        ("rospy.Timer(rospy.Duration(0.1), tell)", [("10", 2)]),
        ("rospy.sleep(0.2)", []),
        ("r = rospy.Rate(0)", []),
        ("r = rospy.Rate(1 / 0)", []),
        ("r = rospy.Rate(-3)", []),
        ("r = rospy.Rate(True)", []),
        ("r = rospy.Rate(a)", []),
    ],
)
def test_a_rate_that_is_a_number_is_known(tmp_path, code, found):
    (tmp_path / "a.py").write_text(f"HZ = 7.5; a = b; b = a\n{code}\n")
    slips = check_syntax(tmp_path, ["a.py"]).slips
    assert [(s.message, s.line) for s in slips if s.kind == "rate-number"] == found
    of_timer = {s.name for s in slips if s.kind == "rate-number" and "Timer" in code}
    assert of_timer <= {"rospy.Duration"}


@pytest.mark.parametrize(
    ("code", "name"),
    [
        ("rospy.Timer(rospy.Duration(20), tell)", "rospy.Duration"),
        ("pause = rospy.Duration(20)\nrospy.Timer(pause, tell)", "rospy.Duration"),
        ("while True:\n    rospy.sleep(rospy.Duration(20))", "rospy.sleep"),
        ("rospy.Rate(20)", ""),
    ],
)
def test_what_asks_for_a_rate_is_known(tmp_path, code, name):
    (tmp_path / "a.py").write_text(f"{code}\n")
    slips = check_syntax(tmp_path, ["a.py"]).slips
    assert [s.name for s in slips if s.kind == "rate-number"] == [name]


@pytest.mark.parametrize(
    ("code", "found"),
    [
        ("n = (n + 1) % 128", [("128", "reset-limit", 1)]),
        ("for i in range(9999):\n    p.publish(i % 129)", [("129", "reset-limit", 2)]),
        ("for i in range(129):\n    p.publish('%d' % i)", [("129", "reset-limit", 1)]),
        (
            "if n > 127:\n    n = 1",
            [("127", "reset-limit", 1), ("1", "reset-value", 2)],
        ),
        (
            "if 100 <= self.n:\n    self.n = 0",
            [("100", "reset-limit", 1), ("0", "reset-value", 2)],
        ),
        ("if n > 127:\n    m = 1", []),
        ("if n > 127:\n    n = m", []),
        ("'%d' % n", []),
        ("n %= 128", [("128", "reset-limit", 1)]),
        ("n = n + 1 if n < 127 else 0", [("127", "reset-limit", 1), ("0", "reset-value", 1)]),
    ],
)
def test_where_a_counter_goes_back_is_known(tmp_path, code, found):
    (tmp_path / "a.py").write_text(code + "\n")
    slips = check_syntax(tmp_path, ["a.py"]).slips
    assert [(s.message, s.kind, s.line) for s in slips if s.kind.startswith("reset")] == found


@pytest.mark.parametrize(
    ("code", "found"),
    [
        ("n = 0\nwhile True:\n    n += 1\n    pub.publish(n)", [("start-value", 1, "0"), ("added-first", 3, "")]),
        ("n = 1\nwhile True:\n    pub.publish(n)\n    n += 1", [("start-value", 1, "1")]),
        ("n = 0\nwhile True:\n    text.publish('hi')\n    n += 1\n    pub.publish(n)",
         [("start-value", 1, "0"), ("added-first", 4, "")]),
        ("n = 0\nwhile True:\n    msg.data = n\n    n += 1\n    pub.publish(msg)", [("start-value", 1, "0")]),
        ("n = 0\nwhile True:\n    if n < 127:\n        n += 1\n    else:\n        n = 0\n    pub.publish(n)",
         [("start-value", 1, "0"), ("added-first", 3, "")]),
        ("n = 1\nwhile True:\n    pub.publish(n)\n    n += 1\n    if n > 9:\n        n = 0", [("start-value", 1, "1")]),
        ("def f():\n    if n > 9:\n        n = 0\n    n += 1", []),
        ("n = 1\nm = 2\npub.publish(n)", []),
        ("class A:\n    def __init__(self):\n        self.n = 3\n    def f(self):\n        self.n = self.n + 1",
         [("start-value", 3, "3")]),
        ("n = -2\nwhile True:\n    n += 1\n    if n == 9:\n        n = 0\n    pub.publish(n)",
         [("start-value", 1, "-2"), ("added-first", 3, "")]),
    ],
)  # fmt: skip
def test_where_a_counter_begins_is_known(tmp_path, code, found):
    (tmp_path / "a.py").write_text(code + "\n")
    slips = check_syntax(tmp_path, ["a.py"]).slips
    assert [(s.kind, s.line, s.message) for s in slips if s.kind in {"start-value", "added-first"}] == found


@pytest.mark.parametrize(
    ("body", "fix"),
    [
        ("if n < 127:\n n += 1\nelse:\n n = 0\npub.publish(n)", "move lines 3 to 6 below line 7"),
        ("n += 1\nm.data = n\nsay(m)\npub.publish(\n    m)", "move line 3 below line 7"),
        ("n += 1\nif n > 127:\n n = 0\npub.publish(n)", "move line 3 below line 6"),
        # moved, it would let the reset keep the last number from being published
        ("n = n + 1\npub.publish(n)\nif n >= 127:\n n = 0",
         "delete line 3, and below line 6 write `else:` with `n += 1` in it"),
        ("n += 1\npub.publish(n)\nif n == 127:\n n = -1", "set `n` to -1 before the loop, as line 5 does"),
        ("n += 1\npub.publish(n)\nif n == 127:\n say(n)", "move line 3 below line 4"),
    ],
)  # fmt: skip
def test_what_is_added_too_early_is_added_after_the_line_that_publishes_it(tmp_path, body, fix):
    indented = "".join(f"    {line}\n" for line in body.splitlines())
    (tmp_path / "a.py").write_text(f"n = 0\nwhile True:\n{indented}")
    slips = check_syntax(tmp_path, ["a.py"]).slips
    assert [s.fix for s in slips if s.kind == "added-first"] == [fix]


@pytest.mark.parametrize(
    ("value", "imported", "told"),
    [
        ("next(n)", "import itertools\nn = itertools.count()\n", True),
        ("n + 1", "import time\ntime.sleep(1)\n", True),
        ("n + rospy.get_time()", "", False),
        ("n + 1", "from helper import n\n", False),
        ("n + 1", "import time as t\nn = t.time()\n", False),
        ("n + 1", "from time import time\nn = time()\n", False),
        ("n", "", False),
    ],
)
def test_a_script_that_counts_and_reads_no_clock(tmp_path, value, imported, told):
    (tmp_path / "a.py").write_text(f"import rospy\n{imported}pub.publish('%s' % ({value}))\n")
    kinds = [s.kind for s in check_syntax(tmp_path, ["a.py"]).slips]
    assert kinds.count("no-clock") == told


IN_A_CLASS = """\
class A:
    def %s(self):
        self.n = int(rospy.get_time())
    def turn(self):
        self.n += 1
"""


@pytest.mark.parametrize(
    ("before", "value", "told"),
    [
        ("c = itertools.count()\n", "next(c)", True),
        (
            "def gen():\n    n = 0\n    while True:\n        yield n\n        n += 1\nc = gen()\n",
            "str(next(c))",
            True,
        ),
        ("c = itertools.count()\nmessage = String()\nmessage.data = str(next(c))\n", "message.data", True),
        ("self.began = rospy.get_time()\nself.c = itertools.count()\n", "next(self.c)", True),
        ("c = itertools.count(int(rospy.get_time()))\n", "next(c)", True),
        ("c = itertools.count()\nt = int(rospy.get_time())\n", "t if next(c) else t", False),
        ("def now():\n    return rospy.get_time()\nc = itertools.count()\nnext(c)\n", "now()", False),
        ("from clocks import tick\nc = itertools.count()\nnext(c)\n", "tick()", False),
        ("n = int(rospy.get_time())\nwhile True:\n    n += 1\n", "n", True),
        ("n = int(rospy.get_time())\nwhile True:\n    n = n + 1\n", "n", True),
        ("while True:\n    n = int(rospy.get_time())\n    n += 1\n", "n", False),
        ("def turn():\n    n = int(rospy.get_time())\n    n += 1\n", "n", False),
        ("n = 0\nwhile True:\n    n += rospy.get_time() - n\n", "n", False),
        (IN_A_CLASS % "__init__", "self.n", True),
        (IN_A_CLASS % "now", "self.n", False),
        ("while True:\n    c = itertools.count(int(rospy.get_time()))\n", "next(c)", False),
    ],
)
def test_a_script_that_reads_a_clock_and_sends_what_it_counts(tmp_path, before, value, told):
    text = f"import itertools, rospy\n{before}print(rospy.get_time())\npub.publish('%s' % ({value}))\n"
    (tmp_path / "a.py").write_text(text)
    slips = [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind == "no-clock"]
    assert len(slips) == told


NUMBERS = "pub = rospy.Publisher('numbers', Int8)\nsaid = rospy.Publisher('said', String)\n"


@pytest.mark.parametrize(
    ("code", "told"),
    [
        ("    pub.publish(int(rospy.get_time()) % 128)\n", True),
        ("    n = int(time.time() * 10) % 128\n    pub.publish(n)\n", True),
        ("    msg = Int8()\n    msg.data = rospy.Time.now().secs % 128\n    pub.publish(msg)\n", True),
        ("    pub.publish(n % 128)\n    n += 1\n    said.publish(str(rospy.get_time()))\n", False),
        ("    n = (n + 1) % 128\n    pub.publish(n)\n", False),
        ("    if rospy.get_time() > last:\n        n = n + 1\n    pub.publish(n)\n", False),
        ("    pub.publish(helper(rospy.get_time()))\n", False),
        ("    pub.publish(next(c))\n", False),
        ("    t = int(rospy.get_time())\n    pub.publish(len(seen))\n", False),
    ],
)
def test_values_that_a_clock_gives_are_not_counted(tmp_path, code, told):
    (tmp_path / "a.py").write_text(f"import rospy, time\n{NUMBERS}while not rospy.is_shutdown():\n{code}")
    slips = [s.message for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind == "clock-value"]
    assert ("numbers" in slips) == told


@pytest.mark.parametrize(
    ("pause", "hz"),
    [("0, 1", "1000000000"), ("0, 100000000", "10"), ("1, 0", "1"), ("0.1", "10"), ("2", "0.5")],
)
def test_the_second_number_of_a_duration_counts_nanoseconds(tmp_path, pause, hz):
    text = f"import rospy\npause = rospy.Duration({pause})\nwhile True:\n    rospy.sleep(pause)\n"
    (tmp_path / "a.py").write_text(text)
    slips = [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind == "rate-number"]
    assert [s.message for s in slips] == [hz]
    assert all(("nanoseconds" in s.fix) == (pause.startswith("0, ")) for s in slips)


@pytest.mark.parametrize(
    ("line", "counts"),
    [
        ("n = n + 1", True),
        ("n = (n + 1) % 128", True),
        ("n = after(n)", True),
        ("n = self.after(n)", True),
        ("n = not n", True),
        ("n = int(n)", False),
        ("n = n.strip()", False),
        ("n = n()", False),
    ],
)
def test_what_counts_up_adds_something(line: str, counts: bool, tmp_path: Path) -> None:
    text = f"pub = rospy.Publisher('n', Int8)\nn = 0\nwhile on():\n    {line}\n    pub.publish(n)\n"
    (tmp_path / "a.py").write_text(text, encoding="utf-8")
    kinds = [s.kind for s in check_syntax(tmp_path, ["a.py"]).slips]
    assert ("added-first" in kinds) is counts


@pytest.mark.parametrize(
    ("line", "fixes"),
    [
        ("print(rows[n / 25])", ["on line 1, write `//` instead of `/` in the index"]),
        ("print(rows[n // 25], rows[int(n / 25)], n / rows[2])", []),
        ("print(files[folder / 'map.yaml'], files[folder / f'{n}.yaml'])", []),
    ],
)
def test_an_index_that_is_a_float(line: str, fixes: list[str], tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text(f"{line}\n", encoding="utf-8")
    slips = check_syntax(tmp_path, ["a.py"]).slips
    assert [s.fix for s in slips if s.kind == "float-index"] == fixes
