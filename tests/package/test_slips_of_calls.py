"""Calls of a script's own functions that cannot work: a lock taken twice, values in each other's place."""

from __future__ import annotations

from pathlib import Path

import pytest

from grader.package.python import check_syntax

pytestmark = pytest.mark.usefixtures("without_processes")

CLASS = """\
import threading
class Node:
    def __init__(self):
        self.lock = {lock}
    def hear(self, msg):
        {hear}
    def send(self):
        {send}
    def show(self):
        print(self.lock)
"""
HOLDS, TAKES = "with self.lock:\n            self.send()", "with self.lock:\n            print(1)"
LOCKS = {
    "called": ("threading.Lock()", HOLDS, TAKES, (7, "write `threading.RLock()` on line 4")),
    "within": (
        "threading.Lock()",
        HOLDS.replace("self.send()", TAKES.replace("\n", "\n    ")),
        "pass",
        (7, "RLock"),
    ),
    "imported": ("Lock()", HOLDS, TAKES, (7, "write `RLock()` on line 4, and import `RLock` from threading")),
    "acquired": (
        "Lock()",
        "self.lock.acquire(); x = self.send()",
        "self.lock.acquire(); print(1)",
        (6, "RLock"),
    ),
    "in-a-condition": ("Lock()", HOLDS.replace("self.send()", "if msg: self.send()"), TAKES, (7, "RLock")),
    "may-be-taken-twice": ("threading.RLock()", HOLDS, TAKES, None),
    "released-before": ("Lock()", "self.lock.acquire(); self.lock.release(); self.send()", TAKES, None),
    "returns-before": ("Lock()", HOLDS, "if self.busy(): return\n        " + TAKES, None),
    "does-not-wait": ("Lock()", HOLDS, "self.lock.acquire(False)", None),
    "called-later": ("Lock()", HOLDS.replace("self.send()", "Timer(1, lambda e: self.send())"), TAKES, None),
    "takes-none": ("Lock()", HOLDS.replace("send", "show"), TAKES, None),
    "of-another-object": ("Lock()", HOLDS.replace("self.send", "other.send"), TAKES, None),
    "another-lock": ("Lock()", HOLDS, TAKES.replace("lock", "other"), None),
}


@pytest.mark.parametrize("case", LOCKS)
def test_a_lock_that_is_taken_where_it_is_held(case: str, tmp_path: Path) -> None:
    lock, hear, send, found = LOCKS[case]
    (tmp_path / "a.py").write_text(CLASS.format(lock=lock, hear=hear, send=send))
    slips = [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.name == "lock"]
    assert [(s.line, s.name, s.is_endless) for s in slips] == ([(found[0], "lock", True)] if found else [])
    assert not found or found[1] in slips[0].fix


def test_locks_of_other_classes_are_others(tmp_path: Path) -> None:
    texts = (
        CLASS.format(lock="threading.Lock()", hear=HOLDS, send="pass"),
        CLASS.format(lock="0", hear="pass", send=TAKES),
    )
    (tmp_path / "a.py").write_text("\n".join(texts))
    assert not [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.name == "lock"]


GRID = """\
class Grid:
    def __init__(self, width, height, side=1):
        pass
    def put(self, row, col):
        pass
"""
ORDERS = {
    "of-a-class": (
        "Grid(info.height, info.width)",
        "on line 6, swap `info.height` and `info.width` in the brackets",
    ),
    "of-a-method": ("self.put(col, row)", "on line 6, swap `col` and `row` in the brackets"),
    "right": ("Grid(info.width, info.height)", ""),
    "one-of-two": ("Grid(height, 3)", ""),
    "by-name": ("Grid(height=width, width=height)", ""),
    "of-others": ("math.atan2(col, row), np.put(col, row)", ""),
    "of-a-list": ("self.put(*place)", ""),
}


@pytest.mark.parametrize("case", ORDERS)
def test_values_in_the_place_of_each_other(case: str, tmp_path: Path) -> None:
    line, fix = ORDERS[case]
    (tmp_path / "a.py").write_text(f"{GRID}{line}\n")
    slips = [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind == "wrong-value"]
    assert [s.fix for s in slips] == ([fix] if fix else [])


LAMP = "def main():\n    rospy.init_node('lamp')\n"
EARLY = {
    "in-a-class": (f"class A:\n    c = rospy.get_param('~c', 1)\n{LAMP}main()\n", "`__init__`"),
    "above-main": (f"c = rospy.get_param('~c', 1)\n{LAMP}main()\n", "move line 1 below"),
    "above-the-node": ("c = rospy.get_param('~c', 1)\nrospy.init_node('lamp')\n", "move line 1 below"),
    "below-the-node": ("rospy.init_node('lamp')\nc = rospy.get_param('~c', 1)\n", ""),
    "below-main": (f"{LAMP}main()\nclass A:\n    c = rospy.get_param('~c', 1)\n", ""),
    "in-a-function": (f"def f():\n    return rospy.get_param('~c', 1)\n{LAMP}    f()\nmain()\n", ""),
    "of-all-nodes": (f"c = rospy.get_param('/c', 1)\n{LAMP}main()\n", ""),
    "to-be-imported": ("c = rospy.get_param('~c', 1)\n", ""),
}


@pytest.mark.parametrize("case", EARLY)
def test_a_parameter_that_is_read_before_the_node_has_a_name(case: str, tmp_path: Path) -> None:
    text, fix = EARLY[case]
    (tmp_path / "a.py").write_text(text)
    slips = [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.name == "early"]
    assert len(slips) == bool(fix)
    assert all(fix in s.fix for s in slips)


TRANSFORM = "def stamped(parent, child):\n    t = TransformStamped()\n    {}\n    {}\n"
FRAMES = {
    ("t.header.frame_id = child", "t.child_frame_id = parent"): "swap the values of lines 3 and 4",
    (
        "t.child_frame_id = parent_frame",
        "t.header.frame_id = child_frame",
    ): "swap the values of lines 3 and 4",
    ("t.header.frame_id = parent", "t.child_frame_id = child"): "",
    ("t.header.frame_id = child", "t.child_frame_id = 'laser'"): "",
}


@pytest.mark.parametrize("lines", FRAMES)
def test_frames_that_are_given_to_each_other(lines: tuple[str, str], tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text(TRANSFORM.format(*lines))
    slips = [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.name == "frames"]
    assert [s.fix for s in slips] == ([FRAMES[lines]] if FRAMES[lines] else [])


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("b.sendTransform(stamped('odom', 'base'))", [(1, "odom", "base", "")]),
        (
            "b.sendTransform(t)\nt.child_frame_id = 'base'\nt.header.frame_id = 'odom'",
            [(2, "odom", "base", "lines 2 and 3")],
        ),
        ("b.sendTransform(t)\nx = buffer.lookup_transform('odom', 'base', t)", []),
        ("say('odom', 'base')", []),
    ],
)
def test_two_frames_beside_each_other(
    text: str, found: list[tuple[int, str, str, str]], tmp_path: Path
) -> None:
    (tmp_path / "a.py").write_text(text + "\n")
    slips = [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind == "frames"]
    assert [(s.line, s.message, s.name, s.fix) for s in slips] == found


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("ask(float(argv[1]), float(argv[3]), float(argv[2]))", "`argv[3]` is given before `argv[2]`"),
        ("client(int(sys.argv[2]), int(sys.argv[1]))", "`sys.argv[2]` is given before `sys.argv[1]`"),
        ("ask(float(argv[1]), float(argv[2]))", ""),
        ("ask(float(argv[2]), 1.0, float(argv[1]))", ""),
        ("ask(cells[2], cells[1])", ""),
    ],
)
def test_arguments_of_the_command_line_in_another_order(line: str, message: str, tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text(f"{line}\n")
    slips = [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind == "wrong-value"]
    assert [s.message for s in slips] == ([message] if message else [])


DECORATOR = """\
def once(function):
    def wrapper(*args):
        function(*args)
{}

@once{}
def report():
    pass
"""


@pytest.mark.parametrize(
    ("end", "given", "fixes"),
    [
        ("", "", ["below line 3, write `return wrapper` at the end of `once`"]),
        ("    return wrapper", "", []),
        ("    return functools.wraps(function)(wrapper)", "", []),
        ("    wrapper(function)", "", ["below line 3, write `return wrapper` at the end of `once`"]),
    ],
)
def test_a_decorator_that_returns_nothing(end: str, given: str, fixes: list[str], tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text(DECORATOR.format(end, given))
    slips = [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.name.startswith("decorator")]
    assert [s.fix for s in slips] == fixes


CANCELLED = {
    "s = ActionServer('/c', A, self.go, auto_start=False)": "on line 1, write `self.on_cancel` behind `self.go`",
    "s = actionlib.ActionServer('/c', A, begin)": "on line 1, write `on_cancel` behind `begin`",
    "s = ActionServer('/c', A, self.on_goal, self.stop, auto_start=False)": "",
    "s = ActionServer('/c', A, begin, cancel_cb=stop)": "",
    "s = SimpleActionServer('/c', A, begin)": "",
    "class J(Thread):\n    pass\njob = J(1)\njob.run()": "on line 4, write `job.start()`",
    "class J(threading.Thread):\n    pass\njob = J(1)\njob.start()": "",
    "class J:\n    pass\njob = J(1)\njob.run()": "",
}


@pytest.mark.parametrize("text", CANCELLED)
def test_goals_that_are_never_cancelled(text: str, tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text(f"{text}\n")
    slips = [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.name == "uncancelled"]
    assert [s.fix for s in slips] == ([CANCELLED[text]] if CANCELLED[text] else [])


STATES = """\
import threading
class Node:
    def __init__(self):
        self.lock = threading.{lock}()
        self.states = {{'go': self.go, 'stay': self.stay}}
    {mark}
    def far(self):
        with self.lock:
            return 3
    def go(self):
        print({far})
    def stay(self):
        pass
    def step(self):
        with self.lock:
            {step}
"""


HELD = {
    ("Lock", "@property", "self.far", "self.go()"): "where `self.go()` takes it again on line 8",
    ("Lock", "@property", "self.far", "x = self.far"): "where `self.far` takes it again on line 8",
    ("Lock", "@property", "self.far", "self.states['go']()"): "where `self.states` takes it again on line 8",
    ("Lock", "", "self.far()", "self.go()"): "where `self.go()` takes it again",
    ("Lock", "", "1", "self.go()"): "",
    ("Lock", "", "self.far()", "self.stay()"): "",
    ("Lock", "@cached", "self.far", "self.go()"): "",
    ("RLock", "@property", "self.far", "self.go()"): "",
}


@pytest.mark.parametrize("case", HELD)
def test_a_lock_that_a_property_takes(case: tuple[str, str, str, str], tmp_path: Path) -> None:
    lock, mark, far, step = case
    (tmp_path / "a.py").write_text(STATES.format(lock=lock, mark=mark, far=far, step=step))
    slips = [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.name == "lock"]
    assert [HELD[case] in s.message for s in slips] == ([True] if HELD[case] else [])


@pytest.mark.parametrize(
    ("end", "fix"),
    [
        ("return True", "on line 4, write `return False`"),
        ("return False", ""),
        ("self.close()", ""),
        ("return kind is KeyError", ""),
    ],
)
def test_exceptions_that_the_end_of_a_with_drops(end: str, fix: str, tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text(
        f"class T:\n    def __exit__(self, *error):\n        pass\n        {end}\n"
    )
    slips = [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.name == "swallowed"]
    assert [s.fix.partition(":")[0] for s in slips] == ([fix] if fix else [])


PARTIAL = "def step(publisher, length, event):\n    publisher.publish(length)\n"


@pytest.mark.parametrize(
    ("call", "fix"),
    [
        ("partial(step, length, pub)", "on line 3, swap `length` and `pub` in the brackets"),
        ("functools.partial(step, event, 3, pub)", "on line 3, swap `event` and `pub` in the brackets"),
        ("partial(step, pub, length)", ""),
        ("partial(step, length)", ""),
        ("partial(step, publisher, length)", ""),
        ("partial(other, length, pub)", ""),
    ],
)
def test_values_of_a_partial_in_the_place_of_each_other(call: str, fix: str, tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text(f"{PARTIAL}t = {call}\n")
    slips = [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.name == "swapped"]
    assert [s.fix for s in slips] == ([fix] if fix else [])


ANSWERS = {
    "answer = AddResponse()\n    answer.sum = 3": ["below line 3, write `return answer` at the end of `add`"],
    "answer = AddResponse()\n    answer.sum = 3\n    return": [
        "below line 4, write `return answer` at the end of `add`"
    ],
    "answer = AddResponse()\n    answer.sum = 3\n    return answer": [],
    "answer = AddResponse()\n    answer.sum = 3\n    return self.told(answer)": [],
    "self.answer = AddResponse()\n    self.answer.sum = 3": [],
}


@pytest.mark.parametrize("body", ANSWERS)
def test_an_answer_that_is_filled_in_and_not_returned(body: str, tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text(f"def add(self, request):\n    {body}\n")
    slips = [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.name == "return"]
    assert [s.fix for s in slips] == ANSWERS[body]
