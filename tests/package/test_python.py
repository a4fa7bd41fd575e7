from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from grader.checks.support.exit_causes import syntax_hint
from grader.package.python import cause_of, check_syntax, read_syntax_report
from grader.syntax_fixes import corrected

pytestmark = pytest.mark.usefixtures("without_processes")
"""What the child may take, and what ends it, is looked at in test_hostile.py."""

# Each text, the line of its fault, and words of its cause; all hold under Python 3.8 as under the newest.
CASES = {
    "print": ('print "x"\n', 1, "Python 2: `print`"),
    "print_name": ("x = 1\nprint x\n", 2, "Python 2: `print`"),
    "except": ("try:\n  pass\nexcept E, e:\n  pass\n", 3, "`except Error as name:`"),
    "raise": ('raise E, "x"\n', 1, "Python 2"),
    "exec": ('exec "x"\n', 1, "Python 2: `exec`"),
    "backticks": ("x = `1`\n", 1, "backticks"),
    "unequal": ("if 1 <> 2:\n  pass\n", 1, "`!=`"),
    "long": ("x = 10L\n", 1, "`L`"),
    "unit": ("rate = rospy.Rate(10Hz)\n", 1, "leave `Hz` out"),
    "unit-apart": ("wait(2 seconds)\n", 1, "leave `seconds` out"),
    "colon_if": ("if x\n  pass\n", 1, "a colon"),
    "colon_def": ("def f()  # why\n  pass\n", 1, "a colon"),
    "colon_main": ('if __name__ == "__main__"\n  pass\n', 1, "a colon"),
    "colon_and_more": ("while x < 3:-\n  pass\n", 1, "behind the `:`"),
    "else_if": ("if x:\n  pass\nelse if y:\n  pass\n", 3, "`elif`"),
    "assign": ("if x = 1:\n  pass\n", 1, "write `==`"),
    "bracket": ("x = f(1\ny = 2\n", None, "never closed"),
    "bracket_end": ("x = f(1\n", 1, "never closed"),
    "bracket_many": ("x = 1)\n", 1, "too many"),
    "bracket_kind": ("x = (1]\n", 1, "must match"),
    "text": ("x = 'a\n", 1, "a quote is opened"),
    "quote": ("x = \u2018a\u2019\n", 1, "typographic quote \u2018"),
    "double_quote": ("x = \u201ca b\u201d\n", 1, "typographic quote \u201c"),
    "dash": ("x = 1 \u2013 2\n", 1, "typographic dash"),
    "no_break": ("if 1:\n\u00a0\u00a0x = 1\n", 2, "no-break space (U+00A0)"),
    "zero_width": ("x = 1\u200b\n", 1, "invisible character (U+200B)"),
    "wide": ("if x\uff1a\n  pass\n", 1, "plain `:`"),
    "tabs": ("if 1:\n        x = 1\n\ty = 2\n", 3, "tabs and spaces are mixed"),
    "tabs_unindent": ("if 1:\n\tif 2:\n\t\tx = 1\n  y = 2\n", 4, "tabs and spaces are mixed"),
    "indent_missing": ("if 1:\nx = 1\n", 2, "must be indented"),
    "indent_more": ("x = 1\n  y = 2\n", 2, "further than the one above"),
    "indent_less": ("if 1:\n    x = 1\n  y = 2\n", 3, "matches none of the lines above"),
    "merge": ("def f():\n    x = 1\n<<<<<<< HEAD\n    y = 1\n", 3, "merge markers"),
    "return": ("return 1\n", 1, "outside every function"),
    "plus": ("x++\n", 1, "x += 1"),
    "async": ("x.async = 1\n", 1, "reserved word"),
    "shell": ("$ rosrun a b\n", 1, "command for the terminal"),
    "latin": (b"x = 1\ny = 2  # caf\xe9\n", 2, "not saved as UTF-8"),
    "latin_text": (b"y = '\xe9'\n", 1, "not saved as UTF-8"),
    "utf16": ("x = 1\n".encode("utf-16"), 1, "UTF-16"),
    "null": (b"x = 1\n\0\n", 2, "null bytes"),
    "coding": (b"# -*- coding: klingon -*-\n", 1, "does not know"),
    "deep": ("(" * 300 + ")" * 300, None, "nested too deep"),
}
GOOD = {
    "empty": b"",
    "crlf": b"x = 1\r\nif x:\r\n    y = 2\r\n",
    "bom": b"\xef\xbb\xbfx = 1\n",
    "declared": b"# -*- coding: latin-1 -*-\nx = '\xe9'\n",
    "missing_module": b"import no_such_module_at_all\n",
    "exits": b"raise SystemExit(7)\n",
    "warns": b"x = 1 is 1\ny = '\\d'\n",
}

SYNTAX = Path(__file__).resolve().parents[2] / "grader/arena/ros/syntax.py"
PYTHONS = [p for p in (f"python3.{minor}" for minor in (8, 9, 10, 12, 13, 14)) if shutil.which(p)]


def write(folder, cases):
    for name, text in cases.items():
        (folder / f"{name}.py").write_bytes(text if isinstance(text, bytes) else text.encode())
    return [f"{name}.py" for name in cases]


def assert_cases(report):
    assert set(report.checked) == {f"{name}.py" for name in (*CASES, *GOOD)}
    assert set(report.faults) == {f"{name}.py" for name in CASES}
    for name, (_, line, cause) in CASES.items():
        fault = report.faults[f"{name}.py"]
        assert cause in fault.cause, (name, fault)
        assert line in {None, fault.line}, (name, fault)


def test_faults_have_line_and_plain_cause(tmp_path):
    paths = write(tmp_path, {name: text for name, (text, _, _) in CASES.items()}) + write(tmp_path, GOOD)
    report = check_syntax(tmp_path, paths)
    assert_cases(report)
    assert report.faults["tabs.py"].kind == "TabError"


@pytest.mark.full
@pytest.mark.slow
@pytest.mark.parametrize("python", PYTHONS)
def test_other_pythons_lead_to_the_same_causes(tmp_path, python):
    paths = write(tmp_path, {name: text for name, (text, _, _) in CASES.items()}) + write(tmp_path, GOOD)
    done = subprocess.run([python, "-I", SYNTAX, tmp_path, *paths], capture_output=True, check=False)
    if done.returncode and not done.stdout:
        pytest.skip(f"{python} does not run here")
    assert_cases(read_syntax_report(done.stdout))


def test_nothing_is_executed(tmp_path):
    (tmp_path / "a.py").write_text(f"open({str(tmp_path / 'ran')!r}, 'w')\n")
    (tmp_path / "json.py").write_text("raise SystemExit\n")
    report = check_syntax(tmp_path, ["a.py", "json.py"])
    assert report.checked == ("a.py", "json.py")
    assert not (tmp_path / "ran").exists()


def test_slips_are_found_and_named(tmp_path):
    text = (
        "import rospy, sys\ndef main():\n    rate = rospy.Rate(10)\n    while not rospy.is_shutdown:\n"
        "        rate.sleep\n        x = input('?')\n        y = raw_input()\n    z = sys.stdin.readline()\n"
        "    rate.sleep()\n    main.note = 1\n'text'\nif __name__ == '__main__':\n    main\n    f().g\n"
    )
    (tmp_path / "a.py").write_text(text)
    (tmp_path / "own.py").write_text("def input():\n    pass\ninput()\n")
    slips = check_syntax(tmp_path, ["a.py", "own.py"]).slips
    slips = [s for s in slips if s.kind != "undefined"]
    assert [(s.file, s.line, s.kind) for s in slips] == [
        ("a.py", 3, "rate-number"),
        ("a.py", 4, "not-called"),
        ("a.py", 5, "not-called"),
        ("a.py", 6, "input"),
        ("a.py", 7, "input"),
        ("a.py", 8, "input"),
        ("a.py", 13, "not-called"),
        ("a.py", 14, "not-called"),
    ]
    assert (slips[2].name, slips[2].fix) == ("rate.sleep", "write `rate.sleep()`")


def node(body: str) -> str:
    """A script whose function makes a node, with these lines in it."""
    return f"import rospy\ndef main():\n    rospy.init_node('a')\n{body}"


LOOP = "    while not rospy.is_shutdown():\n"
CALLED = "if __name__ == '__main__':\n    main()\n"


@pytest.mark.parametrize(
    ("text", "found"),
    [
        (node(LOOP + "        p.publish(1)\n") + CALLED, []),
        (node(LOOP + "        p.publish(1)\n"), [("never-called", 2, "nothing calls `main()`")]),
        (node("    rospy.spin()\n") + "if __name__ == 'main':\n    main()\n",
         [("main-guard", 5, "`__name__` is never 'main'")]),
        (node("    rospy.spin()\n") + "if __name__ != '__main__':\n    pass\nmain()\n", []),
        (node("    rospy.spin()\n") + "threading.Thread(target=main)\n", []),
        ("class A:\n    def __init__(self):\n        self.p = 1\n    def go(self):\n        self.p.publish(1)\nA()\n",
         [("never-called", 4, "nothing calls `go()`")]),
        (node("    while True:\n        pass\n    p.publish(1)\n") + CALLED,
         [("never-reached", 4, "the loop in line 4 never ends")]),
        (node(LOOP + "        rate.sleep()\n    p.publish(1)\n") + CALLED,
         [("never-reached", 4, "the publish(…) in line 6")]),
        (node("    rospy.spin()\n    p.publish(1)\n") + CALLED, [("never-reached", 4, "the spin() in line 4")]),
        (node("    while True:\n        pass\n    p = rospy.Publisher('a', A)\n    p.publish(1)\n") + CALLED,
         [("never-reached", 4, "the Publisher(…) in line 6")]),
        ("class Node:\n    def __init__(self):\n        rospy.Subscriber('a', A, f)\nrospy.spin()\nNode()\n",
         [("never-reached", 4, "the spin() in line 4 never ends, so the Node(…) in line 5")]),
        ("def stop():\n    print(1)\nrospy.spin()\nstop()\n", []),
        (node("    while True:\n        break\n    p.publish(1)\n") + CALLED, []),
        (node("    while not done:\n        pass\n    p.publish(1)\n") + CALLED, []),
        (node(LOOP + "        p.publish(1)\n        rospy.spin()\n") + CALLED,
         [("spin-in-loop", 6, "stops at the spin()")]),
        (node(LOOP + "        p.publish(1)\n        break\n") + CALLED, [("loop-left", 6, "at the break in line 6")]),
        (node("    for i in range(9):\n        p.publish(1)\n") + CALLED,
         [("loop-left", 4, "write `while not rospy.is_shutdown():` in line 4")]),
        (node("    for i in range(9):\n        p.publish(i)\n") + CALLED, [("loop-left", 4, "put it inside a `while")]),
        (node("    while not rospy.is_shutdown() and n < 9:\n        p.publish(1)\n") + CALLED,
         [("loop-left", 4, "the loop of line 4 ends after a number of rounds")]),
        (node(LOOP + "        p.publish(1)\n        # p.publish(2)\n        #rate.sleep()  # b\n        # sleep( a\n")
         + CALLED,
         [("commented-out", 6, "remove the `#` from line 6"), ("commented-out", 7, "`sleep(…)` is commented out")]),
        ("def f(m):\n    pass\nrospy.Subscriber('a', A, 'f')\n", [("callback-called", 3, "write `f`, without quotes")]),
        (node("    if not rospy.is_shutdown():\n        p.publish(1)\n") + CALLED,
         [("loop-left", 4, "write `while` for `if` in line 4")]),
        (node("    while go:\n        if not rospy.is_shutdown():\n            p.publish(1)\n") + CALLED, []),
        (node(LOOP + "        p.publish(1)\n        if x:\n            return\n") + CALLED, []),
        (node(LOOP + "        p.publish(1)\n    rate.sleep()\n") + CALLED,
         [("sleep-outside", 6, "loop of line 4: move it into that loop, below line 5, with the same spaces")]),
        (node(LOOP + "        for n in range(9):\n            p.publish(n)\n        rate.sleep()\n") + CALLED,
         [("sleep-outside", 7, "outside the loop of line 5")]),
        (node("    rate.sleep()\n" + LOOP + "        p.publish(1)\n") + CALLED,
         [("sleep-outside", 4, "outside the loop of line 5: move it into that loop, below line 6")]),
        (node("    rospy.sleep(1)\n" + LOOP + "        p.publish(1)\n") + CALLED, []),
        (node(LOOP + "        rate.sleep()\n        p.publish(1)\n    rospy.sleep(1)\n") + CALLED, []),
        ("def f(m):\n    pass\nrospy.Subscriber('a', A, f())\n",
         [("callback-called", 3, "write `f`, without brackets")]),
        ("def f(m):\n    pass\nrospy.Subscriber('a', A)\n",
         [("callback-missing", 3, "write the function's name as its third value")]),
        ("rospy.Subscriber('a', A, **more)\nmessage_filters.Subscriber('a', A)\n", []),
        (node("    p = rospy.Publisher('a', A, queue_size='5')\n    rospy.spin()\n") + CALLED,
         [("queue-size", 4, "write `queue_size=5`, without quotes")]),
        ("def f():\n    pass\nrospy.Subscriber('a', A, callback=f)\n",
         [("callback-values", 1, "`f` takes 0 arguments")]),
        ("def f(m):\n    pass\nrospy.Subscriber('a', A, f)\n", []),
        ("def f(m, a):\n    pass\nrospy.Subscriber('a', A, f, 3)\n", []),
        ("def f(*a):\n    pass\nrospy.Timer(d, f)\n", []),
        ("def f():\n    return lambda m: 0\nrospy.Subscriber('a', A, f())\n", []),
        ("class A:\n    def f(m):\n        pass\n    def g(self):\n        rospy.Service('a', T, self.f)\n",
         [("callback-values", 2, "takes no `self`: write `def f(self, m):`")]),
        ("class A:\n    def f():\n        pass\n    def g(self):\n        rospy.Service('a', T, self.f)\n",
         [("callback-values", 2, "write `def f(self, msg):`")]),
        ("def hear(m):\n    print(m)\ndef run():\n    rospy.Subscriber('a', A, run)\n    rospy.spin()\nrun()\n",
         [("callback-values", 3, "is the function that makes this call, not its callback: in line 4, write hear")]),
    ],
)  # fmt: skip
def test_what_never_runs_is_known(tmp_path, text, found):
    (tmp_path / "a.py").write_text(text)
    others = {
        "deaf", "rate-number", "no-clock", "misspelt", "undefined", "publishes", "prints", "not-called", "node-name",
        "no-init", "publisher", "publisher-type", "subscriber", "subscriber-type",
    }  # fmt: skip
    slips = [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind not in others]
    assert [(s.kind, s.line) for s in slips] == [one[:2] for one in found]
    assert all(
        words in f"{slip.message}: {slip.fix}" for slip, (_, _, words) in zip(slips, found, strict=True)
    )


@pytest.mark.parametrize(("end", "name"), [("A()\n", "A().go"), ("a = A()\n", "a.go")])
def test_a_method_that_nothing_calls_is_called_on_its_object(tmp_path, end, name):
    (tmp_path / "a.py").write_text("class A:\n    def go(self):\n        self.p.publish(1)\n" + end)
    assert [s.name for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind == "never-called"] == [name]


def test_where_names_of_the_graph_are_written_is_known(tmp_path):
    (tmp_path / "a.py").write_text(
        "rospy.init_node('talker')\nrospy.Publisher(\n    name='/chatter', data_class=String)\n"
        "from rospy import Subscriber\nSubscriber('~scan', LaserScan)\nrospy.Publisher(TOPIC, String)\n"
    )
    slips = [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind != "undefined"]
    assert [(s.kind, s.line, s.message) for s in slips] == [
        ("node-name", 1, "talker"),
        ("publisher", 3, "/chatter"),
        ("publisher-type", 3, "String"),
        ("subscriber", 5, "~scan"),
        ("subscriber-type", 5, "LaserScan"),
        ("publisher-type", 6, "String"),
    ]


def test_letters_in_another_order_are_a_slip(tmp_path):
    (tmp_path / "a.py").write_text("def f(msg):\n    print(mgs.data)\n")
    slip, _ = check_syntax(tmp_path, ["a.py"]).slips
    assert (slip.kind, slip.line) == ("misspelt", 2)
    assert (slip.name, slip.message) == ("mgs", "did you mean msg?")


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
        ("r = rospy.Rate(HZ)", [("7.5", 1)]),
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


@pytest.mark.parametrize(
    ("code", "found"),
    [
        ("n = (n + 1) % 128", [("128", "reset-limit", 1)]),
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
    slips = [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind not in ("undefined", "publishes")]
    assert [s.kind for s in slips] == ["no-clock"] * told


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
    ("code", "told"),
    [
        ("while True:\n    time.sleep(1)\n", "the loop in line 1 never asks"),
        ("while not rospy.is_shutdown():\n    time.sleep(1)\n", ""),
        ("while True:\n    rate.sleep()\n", ""),
        ("while True:\n    try:\n        rate.sleep()\n    except rospy.ROSInterruptException:\n        pass\n",
         "the `except` in line 4 catches what Ctrl-C raises, and the loop in line 1 goes on"),
        ("while True:\n    try:\n        rate.sleep()\n    except:\n        break\n", ""),
        ("while n < 9:\n    n = 0\n", "the loop in line 1"),
        ("while n < 9:\n    n += 1\nwhile True:\n    n = 0\n", "the loop in line 3"),
        ("for n in itertools.count():\n    time.sleep(1)\n", "the loop in line 1"),
        ("for n in range(9):\n    time.sleep(1)\n", ""),
        ("rospy.init_node('a', disable_signals=True)\n", "`disable_signals=True` in line 1"),
        ("signal.signal(signal.SIGINT, signal.SIG_IGN)\n", "line 1 gives Ctrl-C another meaning"),
    ],
)  # fmt: skip
def test_why_a_node_goes_on_after_ctrl_c(tmp_path, code, told):
    (tmp_path / "a.py").write_text(code)
    deaf = [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind == "deaf"]
    assert len(deaf) == bool(told)
    assert all(told in one.message and one.fix for one in deaf)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("counter = 0\nprint(conter)\n", ["write counter instead of conter"]),
        ("def run(speed):\n    return sped\n", ["write speed instead of sped"]),
        (
            "class A:\n    def go(self):\n        self.rate = 1\n        rate.sleep()\n",
            ["write self.rate instead of rate"],
        ),
        (
            "class A:\n    def go(self):\n        pass\n    self.go()\n",
            ["indent line 4 like the lines of the method above it, or delete it"],
        ),
        ("class A:\n    print('made')\n", []),
        ("from a import *\ncounter = 0\nprint(conter)\n", []),
        ("counter = 0\nprint(unlike)\n", []),
        ("try:\n    pass\nexcept Exception as error:\n    print(error, __file__)\n", []),
    ],
)
def test_a_name_that_is_not_there_and_one_that_is_spelt_alike(tmp_path, text, told):
    (tmp_path / "a.py").write_text(text)
    slips = [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind in ("misspelt", "outside-method")]
    assert [s.fix for s in slips] == told


def test_names_of_any_bytes(tmp_path):
    name = os.fsdecode(b"caf\xe9.py")
    (tmp_path / name).write_text("x = \n")
    report = check_syntax(tmp_path, [name])
    assert report.faults["caf\\udce9.py"].line == 1
    assert report.model_dump_json()


def test_foreign_lines_are_passed_over():
    good = '{"file": "a.py", "faults": [], "slips": []}'
    bad = ["warning: x", "[]", '{"file": 1}', '{"file": "b", "faults": [1], "slips": []}', '{"fi']
    report = read_syntax_report("\n".join([*bad, good, *bad]))
    assert report.checked == ("a.py",)


def test_a_message_that_says_enough_has_no_cause():
    assert cause_of("invalid syntax", "x = a ? b") == ""


@pytest.mark.parametrize(
    ("source", "hint"),
    [
        ("x = \u2018numbers\u2019", "line 1: write `x = 'numbers'`"),
        ("x = \u2018it's\u2019", "line 1: type a plain '"),
        ("x =\u00a01", "line 1: write `x = 1`"),
        ("print x, y", "line 1: write `print(x, y)`"),
        ("print x  # twice", "line 1: write `print(x) # twice`"),
        ("while True", "line 1: write `while True:`"),
        ("while True:-\n    pass", "line 1: write `while True:`"),
        ("print 'a' +", "line 1: `print` needs brackets, `print(...)`"),
        ("if x = 1:\n    pass", "line 1: write `if x == 1:`"),
        ("try:\n    pass\nexcept IOError, e:\n    pass", "line 3: write `except IOError as e:`"),
        ("x = (1,\ny = 2\n", "line 1: write `)` at the end of what is opened there"),
        ("<<<<<<< HEAD", "line 1: keep one version"),
    ],
)
def test_the_hint_names_the_repair_where_the_cause_is_known(tmp_path, source, hint):
    (tmp_path / "a.py").write_text(source)
    assert syntax_hint(check_syntax(tmp_path, ["a.py"]).faults["a.py"]) == hint


# A line as C++, the shell or Python 2 has it, and the line that the hint names; "" where it only says what to do.
HABITS = {
    "while not rospy.is_shutdown();": "while not rospy.is_shutdown():",
    "pub.publish(text))": "pub.publish(text)",
    "pub.publish)text)": "pub.publish(text)",
    'rospy.loginfo"hi")': 'rospy.loginfo("hi")',
    "rospy.loginfo text)": "rospy.loginfo(text)",
    'rospy.logwinforospy.get_time() + "I heard %s", text)': 'rospy.loginfo(rospy.get_time() + "I heard %s", text)',
    "rate.sleep)": "rate.sleep()",
    "text = float(3))*2": "text = float(3)*2",
    "rospy.spin()chmod +x talker.py": "rospy.spin()",
    "rospy.spin() rosrun lab1 talker.py": "rospy.spin()",
    "print('x')catkin_make": "print('x')",
    "while !rospy.is_shutdown():": "while not rospy.is_shutdown():",
    "while (!done && n < 3):": "while (not done and n < 3):",
    "if a || b:": "if a or b:",
    "if n == 127 {": "if n == 127:",
    "def talker() {": "def talker():",
    "void talker():": "def talker():",
    "function talker():": "def talker():",
    "Def talker():": "def talker():",
    "While True:": "while True:",
    "whlie True:": "while True:",
    "Import rospy": "import rospy",
    "form std_msgs.msg import String": "from std_msgs.msg import String",
    "import String from std_msgs.msg": "from std_msgs.msg import String",
    "from std_msgs.msg import String Int8": "from std_msgs.msg import String, Int8",
    "n++;": "n += 1",
    "self.n--": "self.n -= 1",
    "int n = 0;": "n = 0",
    "String msg": "msg = String()",
    "std_msgs::String msg;": "msg = String()",
    "var n = 0": "n = 0",
    "my count = 0": "my_count = 0",
    "my-count = 0": "my_count = 0",
    "for (int i = 0; i < 128; i++) {": "for i in range(0, 128):",
    "if n === 127:": "if n == 127:",
    "if n =< 127:": "if n <= 127:",
    "if n == 127 then:": "if n == 127:",
    "if __name__ = '__main__':": "if __name__ == '__main__':",
    "// counts": "# counts",
    "n = 0 // counts up": "n = 0 # counts up",
    "/* counts */": "# counts",
    "rate = new rospy.Rate(10)": "rate = rospy.Rate(10)",
    "pub->publish(n)": "pub.publish(n)",
    "rate = rospy::Rate(10)": "rate = rospy.Rate(10)",
    "rate.sleep();;": "rate.sleep()",
    "rate.sleep():": "rate.sleep()",
    ">>> n = 0": "n = 0",
    "rospy.loginfo(text": "rospy.loginfo(text)",
    "rospy.loginfo(text))": "rospy.loginfo(text)",
    "rospy.loginfo(text]": "rospy.loginfo(text)",
    "def talker(:": "def talker():",
    "pub = Publisher('chatter, String)": "pub = Publisher('chatter', String)",
    "pub = Publisher('chatter\", String)": "pub = Publisher('chatter', String)",
    "pub = Publisher(/chatter, String)": "pub = Publisher('/chatter', String)",
    "pub = Publisher('chatter' String)": "pub = Publisher('chatter', String)",
    "text = 'hello %s' get_time()": "text = 'hello %s' % get_time()",
    "text = f'hello {n'": "text = f'hello {n}'",
    "text = 'hello %s % get_time()": "text = 'hello %s' % get_time()",
    "text = 'a %s, b %d s % (a, b)": "text = 'a %s, b %d s' % (a, b)",
    "rospy.loginfo('heard %s, %d, a, b)": "rospy.loginfo('heard %s, %d', a, b)",
    "text = '100 % sure": "text = '100 % sure'",
    "text = 'a && b' + n++": "",
    "text = hello world %s": "",
    "class = 3": "",
    "$ chmod +x talker.py": "",
    "using namespace std;": "",
}


@pytest.mark.parametrize(("line", "right"), HABITS.items())
def test_habits_of_other_languages_are_named_with_the_line_that_is_right(tmp_path, line, right):
    after = "\n    pass\n" if right.endswith(":") else "\n"
    (tmp_path / "a.py").write_text("x = 1\n" + line + after)
    fault = check_syntax(tmp_path, ["a.py"]).faults["a.py"]
    hint = syntax_hint(fault)
    assert fault.cause
    assert fault.line == 2
    assert f"line 2: write `{right}`" in hint if right else "write `text" not in hint


def test_a_bracket_too_many_at_the_end_of_a_call_over_two_lines(tmp_path):
    (tmp_path / "a.py").write_text("print('a',\n      'b'))\n")
    assert syntax_hint(check_syntax(tmp_path, ["a.py"]).faults["a.py"]) == "line 2: write `'b')`"


@pytest.mark.parametrize(
    ("comment", "hint"),
    [
        ("    # while x < 3:", "line 3: write `while x < 3:`"),
        ("##if x:\n    # more", "line 3: write `if x:`, and begin it with 4 spaces"),
        ("\t#for i in (1, 2):", "line 3: write `for i in (1, 2):`, and begin it with 4 spaces"),
        ("    # try:", "line 3: write `try:`"),
        ("    # for example:", "line 4: start it exactly below that one"),
        ("    # else:", "line 4: start it exactly below that one"),
    ],
)
def test_the_first_line_of_a_block_that_is_commented_out(tmp_path, comment, hint):
    (tmp_path / "a.py").write_text(f"def f():\n    x = 1\n{comment}\n        x += 1\n")
    assert syntax_hint(check_syntax(tmp_path, ["a.py"]).faults["a.py"]) == hint


def test_a_right_line_is_never_corrected():
    lines = (
        "x = a[1::2]",
        "print(1 // 2)",
        "d = {'a': 1}",
        "n = -1  # n++",
        "s = 'else if'",
        "if not (a or b): pass",
    )
    assert [corrected(line) for line in lines] == [""] * len(lines)
