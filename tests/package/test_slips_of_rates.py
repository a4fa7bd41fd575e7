"""Rates of loops and timers, and what they wait for: script_rates.py, script_sleeps.py."""

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
        ("rospy.Timer(rospy.Duration(1 // 10), tell)", [("wrong-value", "zero", 2)]),
        ("rospy.Timer(rospy.Duration(int(0.5)), tell)", [("wrong-value", "zero", 2)]),
        ("while True:\n    rospy.sleep(1 // 10)", [("sleep-outside", "sleep", 3)]),
        (
            "PERIOD = 1 // 10\nwhile True:\n    time.sleep(max(0, due - PERIOD))",
            [("sleep-outside", "sleep", 2)],
        ),
        ("PERIOD = 1 / 10\nCOUNT = 1 // 10\nwhile True:\n    time.sleep(PERIOD)", []),
        ("rospy.Timer(rospy.Duration(1 / 10), tell)", []),
        ("rospy.Timer(rospy.Duration(10 // 4), tell)", []),
        ("while True:\n    rospy.sleep(0)", []),
    ],
)
def test_a_wait_of_which_nothing_is_left_is_known(tmp_path, code, found):
    (tmp_path / "a.py").write_text(f"import rospy\n{code}\n")
    slips = check_syntax(tmp_path, ["a.py"]).slips
    assert [(s.kind, s.name, s.line) for s in slips if s.name in {"zero", "sleep"}] == found


@pytest.mark.parametrize(
    ("code", "found"),
    [
        ("rospy.Timer(rospy.Duration(self.hz), tell)", ["write `rospy.Duration(1.0 / self.hz)`"]),
        ("period = rospy.Duration(PUBLISH_RATE)", ["write `rospy.Duration(1.0 / PUBLISH_RATE)`"]),
        ("time.sleep(publishRate)", ["write `time.sleep(1.0 / publishRate)`"]),
        (
            "rospy.Timer(rospy.Duration(rospy.get_param('~rate', 5)), tell)",
            ["write `rospy.Duration(1.0 / …)`"],
        ),
        ("r = rospy.Rate(self.period)", ["write `rospy.Rate(1.0 / self.period)`"]),
        ("dt = 0.1\nr = rospy.Rate(dt)", ["write `rospy.Rate(1.0 / dt)`"]),
        ("hz = 10\nrospy.sleep(hz)", ["write `rospy.sleep(1.0 / hz)`"]),
        ("rate = 0.1\nrospy.sleep(rate)", []),
        ("period = 10\nr = rospy.Rate(period)", []),
        ("rospy.sleep(1.0 / self.hz)", []),
        ("rospy.sleep(self.moderate)", []),
        ("rospy.Rate(self.hz)", []),
    ],
)
def test_a_rate_that_is_taken_for_a_time_is_known_by_its_name(tmp_path, code, found):
    (tmp_path / "a.py").write_text(f"import rospy\n{code}\n")
    slips = check_syntax(tmp_path, ["a.py"]).slips
    assert [s.fix.partition(", ")[2] for s in slips if s.kind == "rate-as-time"] == found


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
        ("def f(x, hz=4):\n    r = rospy.Rate(hz)\nf(1)", [("4", 3)]),
        ("def f(hz):\n    r = rospy.Rate(hz)\nf(hz=8)", [("8", 3)]),
        ("def f(hz):\n    r = rospy.Rate(hz)\nf(8)\nf(9)", []),
        ("def f(hz):\n    r = rospy.Rate(hz)\nf(int(sys.argv[1]) if sys.argv[1:] else 1)", [("1", 3)]),
        ("from rospy import Rate as Beat\nr = Beat(5)", [("5", 3)]),
        (
            "p.add_argument('-r', '--loop-rate', default=4)\no = p.parse_args()\nr = rospy.Rate(o.loop_rate)",
            [("4", 4)],
        ),
        ("p.add_argument('--hz', default=4)\np.add_argument('--hz', default=5)\nr = rospy.Rate(o.hz)", []),
        ("r = rospy.Rate(int(os.environ.get('HZ', '4')))", [("4", 2)]),
        ("r = rospy.Rate(float(os.getenv('HZ', '2.5')))", [("2.5", 2)]),
        ("r = rospy.Rate(int(os.environ['HZ']))", []),
        ("class A:\n    hz = 4\n    def f(self):\n        r = rospy.Rate(self.hz)", [("4", 5)]),
        ("class A:\n    hz = 4\n    def f(self):\n        self.hz = 5\n        r = rospy.Rate(self.hz)", []),
        (
            "class A:\n    def __init__(self, hz=4):\n        self.hz = hz\n        r = rospy.Rate(1 / self.hz)\nA()",
            [("0.25", 5)],
        ),
        ("class A:\n    def __init__(self, hz=4):\n        r = rospy.Rate(hz)\nA(5)\nA(6)", []),
        ("import rospy as ros\nros.Timer(ros.Duration(2), tell)", [("0.5", 3)]),
        ("Rate = rospy.Rate\nr = Rate(5)", [("5", 3)]),
        ("r: rospy.Rate = rospy.Rate(5)", [("5", 2)]),
        ("hz: float = 2.5\nr = rospy.Rate(hz)", [("2.5", 3)]),
        ("class Node:\n    def run(self) -> None:\n        self.r: Beat = rospy.Rate(5)", [("5", 4)]),
        ("r: rospy.Rate\nr = rospy.Rate(5)", [("5", 3)]),
        ("say: object = pub.publish\nwhile True:\n    say(1)\n    rospy.sleep(0.2)", [("5", 5)]),
        ("class Rate:\n    pass\nr = Rate(5)", []),
        ("from rospy import Rate\nclass Rate:\n    pass\nr = Rate(5)", []),
    ],
)
def test_a_rate_that_is_a_number_is_known(tmp_path, code, found):
    (tmp_path / "a.py").write_text(f"HZ = 7.5; a = b; b = a\n{code}\n")
    slips = check_syntax(tmp_path, ["a.py"]).slips
    assert [(s.message, s.line) for s in slips if s.kind == "rate-number"] == found
    of_timer = {s.name for s in slips if s.kind == "rate-number" and "Timer" in code}
    assert of_timer <= {"rospy.Duration"}


@pytest.mark.parametrize(
    ("code", "found"),
    [
        ("while True:\n    time.sleep(random.randint(1, 9))", [("random.randint", 2, "time.sleep")]),
        ("while True:\n    rest = uniform(1, 9)\n    rospy.sleep(rest)", [("uniform", 3, "rospy.sleep")]),
        ("while True:\n    rospy.sleep(1 + np.random.rand())", [("np.random.rand", 2, "rospy.sleep")]),
        ("rospy.Timer(rospy.Duration(random.random()), tell)", [("random.random", 1, "rospy.Duration")]),
        ("rospy.Rate(random.choice([1, 2]))", [("random.choice", 1, "")]),
        ("rospy.sleep(random.random())", []),
        ("while True:\n    rest = 1\n    rest = random.random()\n    rospy.sleep(rest)", []),
        ("while True:\n    pub.publish(random.random())\n    rospy.sleep(0.1)", []),
    ],
)
def test_a_pause_that_is_drawn_is_known(tmp_path, code, found):
    (tmp_path / "a.py").write_text(f"{code}\n")
    slips = check_syntax(tmp_path, ["a.py"]).slips
    assert [(s.message, s.line, s.name) for s in slips if s.kind == "rate-random"] == found


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
    ("pause", "hz"),
    [("0, 1", "1000000000"), ("0, 100000000", "10"), ("1, 0", "1"), ("0.1", "10"), ("2", "0.5")],
)
def test_the_second_number_of_a_duration_counts_nanoseconds(tmp_path, pause, hz):
    text = f"import rospy\npause = rospy.Duration({pause})\nwhile True:\n    rospy.sleep(pause)\n"
    (tmp_path / "a.py").write_text(text)
    slips = [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind == "rate-number"]
    assert [s.message for s in slips] == [hz]
    assert all(("nanoseconds" in s.fix) == (pause.startswith("0, ")) for s in slips)


INNER = "while not rospy.is_shutdown():\n    for talker in {}:\n        talker.say()\n{}rate.sleep()\n"


@pytest.mark.parametrize(
    ("each", "indent", "fixes"),
    [
        ("talkers", 8, ["indent line 4 like line 2"]),
        ("talkers", 4, []),
        ("range(20)", 8, []),
    ],
)
def test_a_sleep_in_the_inner_loop(each: str, indent: int, fixes: list[str], tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text(INNER.format(each, indent * " "))
    slips = [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind == "sleep-twice"]
    assert [s.fix for s in slips] == fixes


@pytest.mark.parametrize(
    ("value", "lines"),
    [("1 // 20", [1]), ("int(0.05)", [1]), ("1 / 20", []), ("20 // 4", []), ("period", [])],
)
def test_a_duration_of_which_nothing_is_left(value: str, lines: list[int], tmp_path: Path) -> None:
    text = f"pause = rospy.Duration({value})\nwhile True:\n    pub.publish(1)\n    rospy.sleep(pause)\n"
    (tmp_path / "a.py").write_text(text)
    slips = [s for s in check_syntax(tmp_path, ["a.py"]).slips if "whole part" in s.message]
    assert [s.line for s in slips][:1] == lines


@pytest.mark.parametrize(
    ("given", "lines"),
    [
        ("rospy.Duration(1), tell, oneshot=True", [3]),
        ("rospy.Duration(1), tell, True", [3]),
        ("rospy.Duration(1), tell", []),
        ("rospy.Duration(1), tell, oneshot=False", []),
        ("rospy.Duration(1), other, oneshot=True", []),
    ],
)
def test_a_timer_that_runs_once(given: str, lines: list[int], tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text(f"def tell(event):\n    pub.publish(1)\nrospy.Timer({given})\n")
    slips = [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind == "loop-left"]
    assert [s.line for s in slips if "oneshot" in s.fix] == lines


SETS_IN_TWO = " def fast(self, req):\n  if req.data:\n   self.hz = 20\n  else:\n   self.hz = 5\n"
SETS = " def fast(self, req):\n  self.hz = req.hz\n"
MAKES = " def __init__(self, share):\n  self.rate = rospy.Rate(self.hz)\n"
TIMES = " def __init__(self):\n  self.t = rospy.Timer(rospy.Duration(1 / self.hz), self.tick)\n"
RUNS = " def run(self):\n  while True:\n   pub.publish(1)\n   self.rate.sleep()\n"
ALL_IN_ONE = " def run(self):\n  r = rospy.Rate(20 if self.hz else 5)\n  while True:\n   r.sleep()\n"


@pytest.mark.parametrize(
    ("lines", "fixes"),
    [
        (MAKES + SETS_IN_TWO + RUNS, ["copy line 4 into the loop, to above line 13"]),
        (SETS + ALL_IN_ONE, ["copy line 6 into the loop, to above line 8"]),
        (TIMES + SETS, ["below line 6, write `self.t.shutdown()`, and copy line 4 to below that"]),
        # it is changed in the loop alone, or with it, or made in the loop
        (ALL_IN_ONE + "   self.hz = 5\n", []),
        (MAKES + SETS + "  self.rate = rospy.Rate(self.hz)\n" + RUNS, []),
        (SETS + " def run(self):\n  while True:\n   r = rospy.Rate(self.hz)\n   r.sleep()\n", []),
        # another function does not know what it needs; it is changed in two places
        (MAKES.replace("hz)", "hz * share)") + SETS + RUNS, []),
        (TIMES + SETS_IN_TWO, []),
    ],
)
def test_a_rate_that_is_made_once_and_changed_elsewhere_is_known(tmp_path, lines, fixes):
    (tmp_path / "a.py").write_text(f"import rospy\nclass Arm:\n{lines}")
    slips = [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind == "keeps-rate"]
    assert [s.fix for s in slips] == fixes


def test_a_rate_of_a_global_number_that_a_service_changes_is_known(tmp_path):
    lines = (
        "hz = 5\ndef fast(req):\n global hz\n hz = 20\nrate = rospy.Rate(hz)\nwhile True:\n rate.sleep()\n"
    )
    (tmp_path / "a.py").write_text(f"import rospy\n{lines}")
    (found,) = [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind == "keeps-rate"]
    assert (found.line, found.message) == (6, "`rate` is made once, on line 6, and keeps what `hz` is then")
