"""What only a run shows, and the hint of the lost criterion says how to write: a loop's rate, and a topic's type."""

from __future__ import annotations

from pathlib import Path

import pytest

from grader.package.repairs.of_runs import conversions, other_field, other_item, repairs_by_hint
from grader.wording import (
    ASKED_ITEM,
    ask_field,
    ask_item,
    ask_rate,
    ask_semicolon,
    ask_type,
    fields_told,
    suspect_field,
)


@pytest.mark.parametrize(
    ("code", "right", "after"),
    [
        ("rate = rospy.Rate(1)", "rospy.Rate(10)", "rate = rospy.Rate(10)"),
        ("rate = Rate(hz)", "rospy.Rate(10)", "rate = Rate(10)"),
        (
            "rospy.Timer(rospy.Duration(10), tick)",
            "rospy.Duration(0.1)",
            "rospy.Timer(rospy.Duration(0.1), tick)",
        ),
        ("time.sleep(100)", "time.sleep(0.1)", "time.sleep(0.1)"),
        ("rospy.Rate(rospy.get_param('rate'))", "rospy.Rate(10)", None),
        ("sleep(1); sleep(1)", "sleep(0.1)", None),
    ],
)
def test_a_rate(code: str, right: str, after: str | None, tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text(f"import rospy\n{code}\n")
    hint = ask_rate("10", "a.py, line 2", right)
    found = repairs_by_hint(tmp_path, hint, "b.py", 1)
    assert [(one.kind, one.line, one.after) for one in found] == ([("loop-rate", 2, after)] if after else [])


@pytest.mark.parametrize(
    ("imports", "given", "imports_after", "after"),
    [
        ("from std_msgs.msg import Int8", "Int8", "from std_msgs.msg import String", "String"),
        ("from std_msgs.msg import Int8, String", "Int8", "from std_msgs.msg import Int8, String", "String"),
        ("from std_msgs.msg import *", "Int8", "from std_msgs.msg import *", "String"),
        ("import std_msgs.msg", "std_msgs.msg.Int8", "import std_msgs.msg", "std_msgs.msg.String"),
        ("from lab.msg import Num", "Num", "from lab.msg import Num", "Num"),
    ],
)
def test_a_type(imports: str, given: str, imports_after: str, after: str, tmp_path: Path) -> None:
    text = "{}\nrospy.Subscriber('a', {}, f)\n"
    (tmp_path / "a.py").write_text(text.format(imports, given))
    found = repairs_by_hint(tmp_path, ask_type("std_msgs/String"), "a.py", 2)
    changed = text.format(imports_after, after).strip("\n").split("\n")
    assert [one.after.split("\n")[-1] for one in found] == ([changed[1]] if given != after else [])
    assert all(one.after in "\n".join(changed) for one in found)


def test_no_type_is_known_where_the_hint_has_none(tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text("rospy.Subscriber('a', Int8, f)\n")
    assert repairs_by_hint(tmp_path, ask_type(None), "a.py", 1) == []
    assert repairs_by_hint(tmp_path, ask_type("std_msgs/String"), "a.py", 9) == []


def test_what_the_same_call_gives_is_converted_too(tmp_path: Path) -> None:
    code = "n = get('x')\nlog('a: ' + n)\nm = get('x')\nlog('b: ' + m)\nk = get('y')\nlog('c: ' + k)\n"
    (tmp_path / "a.py").write_text(code)
    found = [one.after for one in conversions(tmp_path, "a.py", 2, "str", "n")]
    assert found == ["log('a: ' + str(n))", "log('b: ' + str(m))"]


@pytest.mark.parametrize(
    ("line", "right"),
    [
        ("    command.linear.y = 0.2\n", "    command.linear.x = 0.2\n"),
        ("    command.linear.y += 0.1\n", "    command.linear.x += 0.1\n"),
        ("    if command.linear.y == 0.2:\n        pass\n", ""),
        ("    command.linear.x = 0\n    command.linear.y = 0.2\n", ""),
        ("    nonlinear.y = 0.2\n", ""),
    ],
)
def test_a_value_goes_into_the_other_field(line: str, right: str, tmp_path: Path) -> None:
    (tmp_path / "drive.py").write_text(f"def drive():\n{line}")
    found = other_field(tmp_path, "drive.py", *(fields_told(ask_field("linear.x", "linear.y", "0.2")) or ()))
    assert [one.after for one in (found,) if one] == ([right.strip("\n")] if right else [])
    assert fields_told(suspect_field("linear.x", "linear.y")) == ("linear.x", "linear.y")
    assert fields_told("set linear.x to 0.2") is None


@pytest.mark.parametrize(
    ("line", "right"),
    [
        ("a = atan2(dx, dy)", "a = atan2(dy, dx)"),
        ("a = math.atan2(g.x - p.x, g.y - p.y) - t", "a = math.atan2(g.y - p.y, g.x - p.x) - t"),
        ("a = atan2(abs(dx), dy)", "a = atan2(dy, abs(dx))"),
        ("a = atan2(f(g(dx)), dy)", ""),
        ("a = atan2(dx, dy) + atan2(u, v)", ""),
        ("a = atan2(dx)", ""),
    ],
)
def test_two_values_are_swapped(line: str, right: str, tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text(f"{line}\n")
    hint = "on line 1, swap the two values in the brackets of `atan2`"
    assert [one.after for one in repairs_by_hint(tmp_path, hint, "a.py", 1)] == ([right] if right else [])


@pytest.mark.parametrize(
    ("line", "below", "right"),
    [
        (2, "", "  f();  // first"),
        (2, "4", "  f();  // first"),
        (1, "", ""),
        (1, "6", ""),
    ],
)
def test_a_semicolon_of_a_cpp_file(line: int, below: str, right: str, tmp_path: Path) -> None:
    (tmp_path / "a.cpp").write_text("int main() {\n  f()  // first\n\n  g();\n  // the end\n}\n")
    found = repairs_by_hint(tmp_path, ask_semicolon(below), "a.cpp", line)
    assert [(one.kind, one.line, one.after) for one in found] == ([("build-line", 2, right)] if right else [])


@pytest.mark.parametrize(
    ("code", "right"),
    [
        ("x = joy.axes[3]\nz = joy.axes[1]\n", "x = joy.axes[1]\nz = joy.axes[3]"),
        ("x = joy.axes[3]\n", "x = joy.axes[1]"),
        ("x = joy.axes[2]\n", ""),
    ],
)
def test_another_item_is_read(code: str, right: str, tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text(code)
    told = ASKED_ITEM.search(ask_item("linear.x", "/joy", "axes[1]", "axes[3]"))
    assert told is not None
    found = other_item(tmp_path, "a.py", told[1], told[2])
    assert [one.after for one in (found,) if one] == ([right] if right else [])


@pytest.mark.parametrize(
    ("code", "right"),
    [
        ("p = Publisher('/power', Float32)\np.publish(Float32(x))",
         "p = Publisher('/power', Float64)\np.publish(Float64(x))"),
        ("p = Publisher('/power', Float32)\ns = Subscriber('/x', Float32, f)", ""),
        ("p = Publisher('/power', String)", ""),
    ],
)  # fmt: skip
def test_a_number_is_published_with_another_type(code: str, right: str, tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text(f"from std_msgs.msg import *\n{code}\n")
    hint = "from std_msgs.msg import Float64, then rospy.Publisher('/power', Float64, queue_size=10)"
    found = repairs_by_hint(tmp_path, hint, "a.py", 2)
    assert [one.after for one in found] == ([right] if right else [])


def test_a_byte_is_a_number_already(tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text("total = sum(ord(c) for c in image.data)\n")
    found = repairs_by_hint(tmp_path, "write `c` instead of `ord(c)`", "a.py", 1)
    assert [one.after for one in found] == ["total = sum(c for c in image.data)"]
