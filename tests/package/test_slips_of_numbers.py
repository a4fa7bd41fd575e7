"""Rates, counters and clocks of scripts, as far as their lines say them."""

from __future__ import annotations

from pathlib import Path

import pytest

from grader.package.python import check_syntax

pytestmark = pytest.mark.usefixtures("without_processes")


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
        ("if n == 128:\n    n = -128", [("128", "reset-limit", 1), ("-128", "reset-value", 2)]),
        ("if n > 127:\n    m = 1", []),
        ("if n > 127:\n    n = m", []),
        ("'%d' % n", []),
        ("n %= 128", [("128", "reset-limit", 1)]),
        (
            "def f():\n    while True:\n        yield from range(1, 129)",
            [("129", "reset-limit", 3), ("1", "reset-value", 3)],
        ),
        ("n = itertools.cycle(range(100))", [("100", "reset-limit", 1)]),
        ("n = itertools.cycle(words)", []),
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
        ("n = 0\nwhile True:\n    if n < 9:\n        n += 1\n    pub.publish(n)",
         [("start-value", 1, "0"), ("added-first", 4, "")]),
        ("n = 1\nwhile True:\n    pub.publish(n)\n    n += 1", [("start-value", 1, "1")]),
        ("n = 0\nwhile True:\n    text.publish('hi')\n    n += 1\n    pub.publish(n)",
         [("start-value", 1, "0"), ("added-first", 4, "")]),
        ("n = 0\nwhile True:\n    msg.data = n\n    n += 1\n    pub.publish(msg)", [("start-value", 1, "0")]),
        ("n = 0\nwhile True:\n    if n < 127:\n        n += 1\n    else:\n        n = 0\n    pub.publish(n)",
         [("start-value", 1, "0"), ("added-first", 4, "")]),
        ("n = 1\nwhile True:\n    pub.publish(n)\n    n += 1\n    if n > 9:\n        n = 0", [("start-value", 1, "1")]),
        ("def f():\n    if n > 9:\n        n = 0\n    n += 1", []),
        ("n = 1\nm = 2\npub.publish(n)", []),
        ("class A:\n    def __init__(self):\n        self.n = 3\n    def f(self):\n        self.n = self.n + 1",
         [("start-value", 3, "3")]),
        ("class A:\n    n: int = 3\na = A()\nwhile True:\n    pub.publish(a.n)\n    a.n += 1",
         [("start-value", 2, "3")]),
        ("n, last = 1, 127\nwhile True:\n    pub.publish(n)\n    n += 1", [("start-value", 1, "1")]),
        ("a = n = 1\nwhile True:\n    pub.publish(n)\n    n += 1", [("start-value", 1, "1")]),
        ("*a, n = 0, 3, 1\nwhile True:\n    pub.publish(n)\n    n += 1", []),
        ("m = Int8(data=1)\nwhile True:\n    pub.publish(m)\n    m.data += 1", [("start-value", 1, "1")]),
        ("m = Int8()\nwhile True:\n    pub.publish(m)\n    m.data += 1", []),
        ("n = count(1)\nwhile True:\n    pub.publish(next(n))", [("start-value", 1, "1")]),
        ("def f():\n    for n in range(1, 9):\n        yield n", [("start-value", 2, "1")]),
        ("for n in range(1, 9):\n    print(n)", []),
        ("class A:\n    def f(self):\n        self.n += 1\n        return self.n\npub.publish(a.f())",
         [("added-first", 3, "")]),
        ("n = -2\nwhile True:\n    n += 1\n    if n == 9:\n        n = 0\n    pub.publish(n)",
         [("start-value", 1, "-2"), ("added-first", 3, "")]),
    ],
)  # fmt: skip
def test_where_a_counter_begins_is_known(tmp_path, code, found):
    (tmp_path / "a.py").write_text(code + "\n")
    slips = check_syntax(tmp_path, ["a.py"]).slips
    assert [(s.kind, s.line, s.message) for s in slips if s.kind in {"start-value", "added-first"}] == found


@pytest.mark.parametrize(
    ("code", "found"),
    [
        ("from values import RATE\nrate = rospy.Rate(RATE)", [("rate-number", 2, "5")]),
        (
            "import values as v\nrate = rospy.Rate(v.RATE)\nif n > v.LIMIT:\n    n = 0",
            [("rate-number", 2, "5"), ("reset-limit", 3, "100"), ("reset-value", 4, "0")],
        ),
        ("from values import *\nrate = rospy.Rate(TWICE)", []),
        ("from values import RATE\nRATE = 10\nrate = rospy.Rate(RATE)", [("rate-number", 3, "10")]),
        ("from values import NAME as RATE\nrate = rospy.Rate(RATE)", []),
    ],
)
def test_numbers_of_another_module_are_known(tmp_path, code, found):
    (tmp_path / "a.py").write_text(f"{code}\n")
    (tmp_path / "values.py").write_text("RATE = 5\nLIMIT: int = 100\nNAME = 'a'\nTWICE = 1\nTWICE = 2\n")
    slips = check_syntax(tmp_path, ["a.py", "values.py"]).slips
    assert [
        (s.kind, s.line, s.message) for s in slips if s.kind in {"rate-number", "reset-limit", "reset-value"}
    ] == found


@pytest.mark.parametrize(
    ("line", "number"),
    [
        ("n += 2", "2"),
        ("n = n + 2", "2"),
        ("n = (n + 2) % 128", "2"),
        ("self.n -= 1", "-1"),
        ("n = n - 3", "-3"),
        ("n += 1", None),
        ("n = n + 1", None),
        ("n = m + 2", None),
        ("n = n + m", None),
        ("n *= 2", None),
        ("n = n + 0.5", None),
        ("n = m = n + 2", "2"),
        ("n, m = n + 2, m", None),
    ],
)
def test_the_number_that_is_added_to_a_counter_is_known(tmp_path, line, number):
    (tmp_path / "a.py").write_text(f"n = 0\nwhile True:\n    pub.publish(n)\n    {line}\n")
    slips = [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind == "step-number"]
    assert [(s.line, s.message, s.name) for s in slips] == (
        [(4, number, line.split(maxsplit=1)[0])] if number else []
    )


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ("n = itertools.count(0, 2)", [("2", "write 1 as the second value of `itertools.count(…)`")]),
        ("n = itertools.count(step=2)", [("2", "write 1 as the `step` of `itertools.count(…)`")]),
        ("n = count(start=0, step=-1)", [("-1", "write 1 as the `step` of `count(…)`")]),
        (
            "for n in range(0, 128, 2):\n    pub.publish(n)",
            [("2", "write 1 as the third value of `range(…)`")],
        ),
        ("n = itertools.cycle(range(0, 128, 5))", [("5", "write 1 as the third value of `range(…)`")]),
        ("for n in range(0, 128, 2):\n    say(n)", []),
        ("n = itertools.count(0, 1)", []),
        ("n = itertools.count(0, STEP)", []),
        ("n = 'abc'.count('a', 2)", []),
    ],
)
def test_the_step_of_an_endless_count_and_of_a_range_is_known(tmp_path, line, told):
    (tmp_path / "a.py").write_text(f"{line}\n")
    slips = [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind == "step-number"]
    assert [(s.message, s.fix) for s in slips] == told


@pytest.mark.parametrize(
    ("body", "fix"),
    [
        ("if n < 127:\n n += 1\nelse:\n n = 0\npub.publish(n)", "move lines 3 to 6 below line 7"),
        ("n += 1\nm.data = n\nsay(m)\npub.publish(\n    m)", "move line 3 below line 7"),
        ("n += 1\nif n > 127:\n n = 0\npub.publish(n)", "move line 3 below line 6"),
        # moved, it would let the reset keep the last number from being published
        ("n = n + 1\npub.publish(n)\nif n >= 127:\n n = 0",
         "below line 6 write `else:`, and move line 3 into it"),
        ("n += 1\npub.publish(n)\nsay('a')\nsay(n)\nrate.sleep()", "move line 3 below line 6"),
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
        ("n + 1", "import rospy as ros\n", True),
        ("n + ros.get_time()", "import rospy as ros\n", False),
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


def test_a_count_is_told_where_its_text_is_made(tmp_path):
    text = "import rospy\nwhile n < 9:\n    text = 'hello %d' % n\n    n += 1\n    pub.publish(text)\n"
    (tmp_path / "a.py").write_text(text)
    assert [s.line for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind == "no-clock"] == [3]


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


GRID = """\
import rospy
class Mapper:
    def __init__(self):
        self.w = rospy.get_param('~width')
        self.h = rospy.get_param('~height')
    def mark(self, p):
        column = int(p.x / 0.5)
        row = int(p.y / 0.5)
        if CHECK:
            self.data[INDEX] = 100
"""


@pytest.mark.parametrize(
    ("check", "index", "fixes"),
    [
        ("column >= 0", "row * self.h + column", ["on line 10, write `self.w` in place of `self.h`"]),
        ("p.x >= 0 and column > 0", "self.h * row + column", ["on line 10, write `self.w` in place of `self.h`"]),
        ("0 <= p.x and 0 <= p.y and 0 <= column", "row * self.w + column", []),
        ("column < 9", "row * self.w + column", []),
        ("column < 9", "column * self.w + row", ["on line 10, write `row * self.w + column` for the index"]),
        ("column < 9", "column * self.h + row", ["on line 10, write `row * self.w + column` for the index"]),
        ("column < 9", "row + self.h * column", ["on line 10, write `row * self.w + column` for the index"]),
    ],
)  # fmt: skip
def test_the_index_of_a_cell(check: str, index: str, fixes: list[str], tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text(GRID.replace("CHECK", check).replace("INDEX", index), encoding="utf-8")
    slips = [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind == "wrong-value"]
    assert [s.fix for s in slips if s.name == "step"] == fixes


@pytest.mark.parametrize(
    ("check", "fixes"),
    [
        ("not column > self.w", ["on line 9, write `>=` in place of `>` between `column` and `self.w`"]),
        (
            "column <= self.w and row <= self.h",
            [
                "on line 9, write `<` in place of `<=` between `column` and `self.w`, and between `row` and `self.h`"
            ],
        ),
        ("0 <= row <= self.h", ["on line 9, write `<` in place of `<=` between `row` and `self.h`"]),
        ("self.w >= column", ["on line 9, write `>` in place of `>=` between `self.w` and `column`"]),
        ("column < self.w and row <= self.h - 1", []),
        ("not (column >= self.w or row > self.h - 1)", []),
    ],
)
def test_cells_at_the_edge(check: str, fixes: list[str], tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text(GRID.replace("CHECK", check).replace("INDEX", "0"), encoding="utf-8")
    assert [s.fix for s in check_syntax(tmp_path, ["a.py"]).slips if s.name == "edge"] == fixes


def test_rows_that_are_worked_out_from_an_x(tmp_path: Path) -> None:
    text = GRID.replace("CHECK", "row < 9").replace("INDEX", "row * self.w + column")
    text = text.replace("p.x", "p.z").replace("p.y", "p.x").replace("p.z", "p.y")
    (tmp_path / "a.py").write_text(text, encoding="utf-8")
    slips = [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.name == "step"]
    assert [s.fix for s in slips] == ["on lines 7 and 8, write y for x, and x for y"]


@pytest.mark.parametrize(
    ("check", "fixes"),
    [
        ("column >= 0 and row >= 0", ["on lines 7 and 8, write `math.floor(…)` in place of `int(…)`"]),
        ("not 0 > row", ["on line 8, write `math.floor(…)` in place of `int(…)`"]),
        ("p.x >= 0 and column >= 0", []),
        ("column < 9", []),
    ],
)
def test_int_of_a_number_just_below_0(check: str, fixes: list[str], tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text(GRID.replace("CHECK", check).replace("INDEX", "0"), encoding="utf-8")
    slips = [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind == "wrong-value"]
    assert [s.fix for s in slips if s.name == "cut"] == fixes


@pytest.mark.parametrize(
    ("lines", "fixes"),
    [
        ("q.z = sin(yaw); q.w = cos(yaw)", ["on line 1, write `yaw / 2` in place of `yaw`"]),
        ("q = Quaternion(0, 0, math.sin(a), math.cos(a))", ["on line 1, write `a / 2` in place of `a`"]),
        ("q.z = sin(yaw / 2); q.w = cos(yaw / 2)", []),
        ("half = yaw / 2; q.z = sin(half); q.w = cos(half)", []),
        ("half = 0.5 * yaw; q.z = sin(half); q.w = cos(half)", []),
        ("yaw = 2 * a; q.z = sin(yaw); q.w = cos(yaw)", ["on line 1, write `yaw / 2` in place of `yaw`"]),
        ("p.z = sin(angle); p.x = cos(angle)", []),
    ],
)  # fmt: skip
def test_a_quaternion_of_a_whole_angle(lines: str, fixes: list[str], tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text(f"{lines}\n", encoding="utf-8")
    slips = [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind == "wrong-value"]
    assert [s.fix for s in slips if s.name == "half"] == fixes


@pytest.mark.parametrize(
    ("last", "fixes"),
    [
        (
            "elif req.a < 0:\n        return FitResponse(0)",
            ["below line 6, and as far in as line 3, write `return FitResponse(…)`"],
        ),
        ("else:\n        return FitResponse(0)", []),
        ("return FitResponse(0)", []),
        ("raise ValueError", []),
    ],
)
def test_a_service_that_answers_in_some_cases(last: str, fixes: list[str], tmp_path: Path) -> None:
    text = f"def fit(req):\n    print(req)\n    if req.a > 9:\n        return FitResponse(9)\n    {last}\n"
    (tmp_path / "a.py").write_text(f"{text}rospy.Service('fit', Fit, fit)\n", encoding="utf-8")
    slips = [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind == "wrong-value"]
    assert [s.fix for s in slips] == fixes


KEPT = (
    "cmd = Twist()\ndef f(scan):\n    if s:\n        cmd.angular.z = 1\n    else:\n        cmd.linear.x = 2\n"
)
SENT = "    pub.publish(cmd)\n"
EACH = "def f(scan):\n    for i in range(90):\n        if scan.ranges[i] < 1:\n            v.x = 0\n"


@pytest.mark.parametrize(
    ("text", "fixes"),
    [
        (KEPT + SENT, ["above line 4, write `cmd.angular.z = 0`", "above line 4, write `cmd.linear.x = 0`"]),
        (KEPT.replace("linear.x", "angular.z") + SENT, []),
        (KEPT.replace("2\n", "2\n        cmd.angular.z = 0\n") + SENT, ["above line 4, write `cmd.linear.x = 0`"]),
        (KEPT.replace("    if", "    cmd = Twist()\n    if") + SENT, []),
        (KEPT + "    cmd.angular.z = cmd.linear.x = 0\n" + SENT, []),
        (KEPT, []),
        # what is set now and then lasts until the next time
        (KEPT.replace("if s:", "if now() - last > 2:\n        last = now()") + SENT, []),
        (KEPT.replace("def f(scan)", "while ok()") + SENT,
         ["above line 4, write `cmd.angular.z = 0`", "above line 4, write `cmd.linear.x = 0`"]),
        (EACH + "        else:\n            v.x = 1\n        pub.publish(v)\n",
         ["work out the smallest of the ranges first, and write the `if` of line 4 and the `publish(…)` of line 8"]),
        (EACH + "        else:\n            v.x = 1\n    pub.publish(v)\n", []),
        (EACH + "            break\n        else:\n            v.x = 1\n        pub.publish(v)\n", []),
    ],
)  # fmt: skip
def test_velocities_of_another_turn(text: str, fixes: list[str], tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text("import rospy\n" + text, encoding="utf-8")
    found = [s.fix for s in check_syntax(tmp_path, ["a.py"]).slips if s.name in {"added", "kept"}]
    assert [one.partition(" below")[0] for one in found if "set `v.x`" not in one] == fixes


@pytest.mark.parametrize(
    ("text", "fixes"),
    [
        (
            "t = rospy.Time(now().to_nsec())\n",
            ["on line 1, write `rospy.Time(0, ` in place of `rospy.Time(`"],
        ),
        ("t = rospy.Time(0, now().to_nsec())\n", []),
        ("t = rospy.Time(now().to_sec())\n", []),
    ],
)
def test_nanoseconds_for_seconds(text: str, fixes: list[str], tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text(text, encoding="utf-8")
    assert [s.fix for s in check_syntax(tmp_path, ["a.py"]).slips if s.name == "nanoseconds"] == fixes


@pytest.mark.parametrize(
    ("condition", "fixes"),
    [
        ("not rospy.has_param('~a')", ["on line 2, write the condition without its `not`"]),
        ("rospy.has_param('~a')", []),
        ("not rospy.has_param('~b')", []),
    ],
)
def test_a_parameter_that_is_read_only_where_it_is_not_set(
    condition: str, fixes: list[str], tmp_path: Path
) -> None:
    text = f"import rospy\nif {condition}:\n    a = rospy.get_param('~a')\nelse:\n    a = 1\n"
    (tmp_path / "a.py").write_text(text, encoding="utf-8")
    slips = [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind == "wrong-value"]
    assert [s.fix for s in slips] == fixes


@pytest.mark.parametrize(
    ("arguments", "fixes"),
    [
        ("'white', '~color'", ["on line 1, write `get_param('~color', 'white')`"]),
        ("5, '~rate'", ["on line 1, write `get_param('~rate', 5)`"]),
        ("'~color', 'white'", []),
        ("'topic', '/scan'", []),
        ("'folder', '~/bags'", []),
        ("'~topic', '~out'", []),
        ("name, '~color'", []),
        ("'~color'", []),
    ],
)
def test_a_default_before_the_name_of_its_parameter(arguments: str, fixes: list[str], tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text(f"color = rospy.get_param({arguments})\n", encoding="utf-8")
    slips = [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind == "wrong-value"]
    assert [s.fix for s in slips] == fixes


def test_a_parameter_may_be_read_where_it_has_just_been_set(tmp_path: Path) -> None:
    text = "if not rospy.has_param('~a'):\n    rospy.set_param('~a', 2)\n    a = rospy.get_param('~a')\n"
    (tmp_path / "a.py").write_text(text, encoding="utf-8")
    assert not [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind == "wrong-value"]


def test_a_listener_that_each_turn_makes_again(tmp_path: Path) -> None:
    text = (
        "while not rospy.is_shutdown():\n    b = tf2_ros.Buffer()\n    ear = tf2_ros.TransformListener(b)\n"
    )
    (tmp_path / "a.py").write_text(text, encoding="utf-8")
    slips = [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind == "wrong-value"]
    assert [s.fix for s in slips] == ["move lines 2 and 3 above line 1"]


def test_an_attribute_that_is_filled_from_outside(tmp_path: Path) -> None:
    head = "class A:\n def __init__(self):\n  self.p = None\n  Subscriber('/p', Pose, self.f)\n def f(self, m):\n"
    (tmp_path / "a.py").write_text(f"{head}  self.p.x = m.x\na = A()\na.p = Pose()\n", encoding="utf-8")
    assert [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind == "object"] == []


@pytest.mark.parametrize(
    "tests",
    [
        ("m.on", "not m.on"),
        ("m.on == True", "m.on == False"),
        ("m.a < 3", "m.a >= 3"),
        ("m.a > m.b", "m.a == m.b"),
    ],
)
@pytest.mark.parametrize("word", ["if", "elif"])
def test_a_service_that_answers_in_all_cases(tests: tuple[str, str], word: str, tmp_path: Path) -> None:
    first, last = (f"{test}:\n        return FitResponse(1)\n" for test in tests)
    text = f"def fit(m):\n    print(m)\n    if {first}    {word} {last}rospy.Service('fit', Fit, fit)\n"
    (tmp_path / "a.py").write_text(text, encoding="utf-8")
    assert [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind == "wrong-value"] == []


def test_a_publisher_whose_name_another_one_gets_is_known(tmp_path: Path) -> None:
    text = "pub = rospy.Publisher('a', String)\npub = rospy.Publisher('b', Int8)\npub.publish(1)\n"
    (tmp_path / "a.py").write_text(text)
    found = [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind == "never-published"]
    message = "line 2 gives `pub` another publisher, so nothing is sent by this one"
    assert [(s.line, s.name, s.message) for s in found] == [(1, "a", message)]


def test_two_publishers_of_one_name_do_not_publish_twice(tmp_path: Path) -> None:
    made = "pub = rospy.Publisher('a', String)\npub = rospy.Publisher('b', Int8)\n"
    text = (
        f"{made}while not rospy.is_shutdown():\n    pub.publish('a')\n    pub.publish(1)\n    rate.sleep()\n"
    )
    (tmp_path / "a.py").write_text(text)
    assert not [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind == "publish-twice"]


@pytest.mark.parametrize(
    ("code", "told"),
    [
        ("d = rospy.get_param('/a')\nd['b']['c'] = 1\n", ["/a/b/c"]),
        ("self.d = rospy.get_param('a')\nself.d['b'] = 1\n", ["a/b"]),
        ("d = rospy.get_param('/a')\nd['b'] = 1\nrospy.set_param('/a', d)\n", []),
        ("d = rospy.get_param('/a')\nd['b'] = 1\nrospy.set_param('/a/b', d['b'])\n", []),
        ("d = rospy.get_param('~a')\nd['b'] = 1\n", []),
        ("d = {}\nd['b'] = 1\n", []),
    ],
)
def test_a_map_of_parameters_that_only_the_script_changes(code: str, told: list[str], tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text(code)
    assert [s.message for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind == "changes-copy"] == told


@pytest.mark.parametrize(
    ("code", "told"),
    [
        ("SIDE = 2.0\ndrive(SIDE)\ndrive(SIDE)\n", [("2", "distance", "SIDE")]),
        ("self.side_length = 1\n", [("1", "distance", "self.side_length")]),
        ("DRIVE_TIME = 5\ndrive(DRIVE_TIME)\n", [("5", "time", "DRIVE_TIME")]),
        ("DRIVE_TIME = 5\ndrive(DRIVE_TIME)\nturn(DRIVE_TIME)\n", []),
        ("distance = 0.0\n", []),
        ("distance = 1\ndistance += 1\n", []),
        ("distance = 1 if far else 2\n", []),
        ("SPEED = 0.2\nside = True\n", []),
        ("inside = 3\n", []),
    ],
)
def test_numbers_that_say_how_far_or_how_long_are_known(tmp_path, code, told):
    (tmp_path / "a.py").write_text(code)
    slips = [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind == "way-number"]
    assert [(s.message, s.fix, s.name) for s in slips] == told


@pytest.mark.parametrize(
    ("code", "told"),
    [
        ("rospy.get_param('/a', 5)\n", ["on line 1, write `rospy.set_param('/a', 5)`"]),
        ("p = rospy.get_param('/a', default='5')\n", ["above line 1, write `rospy.set_param('/a', '5')`"]),
        ("rospy.get_param('/a')\nrospy.get_param('/a', n)\n", []),
    ],
)
def test_a_parameter_that_is_read_with_the_value_to_set(code: str, told: list[str], tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text(code)
    assert [s.fix for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind == "read-to-set"] == told
