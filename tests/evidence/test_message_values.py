"""Messages made from what a rubric says: stamps, numbers that change, long arrays, and types of any package."""

from __future__ import annotations

import math
from typing import Any

import pytest

from grader.evidence.decode import Decoder, definition, full_definition, md5sum
from grader.evidence.message_values import MessageType, Moment, action_texts, md5_of
from grader.installable import noetic_messages

NOW_NS = 1_700_000_000_250_000_000
OWN = {
    "lab/Reading": "Header header\nfloat32[3] parts # three\nPoint[] path\nint8 LOW=-1\n"
    "string NAME = a # b\nbyte kind\n",
    "lab/Point": "float64 x\nfloat64 y\n",
    "lab/Span": "int8 from\nint8 to\nint8[] each\n",
}


def _sent(type_: str, value: object, number: int = 0, total: int | None = 3) -> Any:
    """The message that arrives."""
    message_type = MessageType(type_, OWN.get)
    data = message_type.encode(value, Moment(number, total, NOW_NS))
    return Decoder(type_, message_type.definition).decode(data)


@pytest.mark.parametrize("name", ["std_msgs/String", "sensor_msgs/LaserScan", "visualization_msgs/Marker"])
def test_md5_sums_are_ros_s(name: str) -> None:
    assert md5_of(name, definition(name)) == md5sum(name)


def test_md5_sums_of_all_types_of_ros() -> None:
    names = [f"{p}/{n}" for p, names in noetic_messages().items() if p != "builtin_interfaces" for n in names]
    assert len(names) > 100
    assert [name for name in names if md5_of(name, definition(name)) != md5sum(name)] == []


def test_the_messages_of_an_action() -> None:
    texts = action_texts("actionlib/Test", "int32 goal\n---\nint32 result\n---\nint32 feedback\n")
    assert len(texts) == 6
    for name, text in texts.items():
        full = full_definition(name, text, texts.get)
        assert md5_of(name, full) == md5sum(name)
    with pytest.raises(ValueError, match="lab/Test: an action has a goal, a result and feedback"):
        action_texts("lab/Test", "int32 goal\n---\nint32 result\n")


def test_a_request_without_fields() -> None:
    assert MessageType("lab/ResetRequest", full="\n").encode({}) == b""
    assert MessageType("lab/ResetRequest", full="").encode({}) == b""


def test_tf_is_known_everywhere() -> None:
    assert MessageType("tf2_msgs/TFMessage").md5sum == "94810edda583a504dfda3829e70d7eec"


def test_a_type_of_the_student_s_own() -> None:
    own = MessageType("lab/Reading", OWN.get)
    assert own.md5sum == "d6d477c57c65774ef337322bb67f3cea"
    got = _sent("lab/Reading", {"header": {"stamp": "now"}, "parts": [1, 2, 3], "path": [{"x": 1}, {"y": 2}]})
    assert got["header"]["stamp"] == {"secs": 1_700_000_000, "nsecs": 250_000_000}
    assert got["path"] == [{"x": 1.0, "y": 0.0}, {"x": 0.0, "y": 2.0}]


@pytest.mark.parametrize(
    ("written", "nanoseconds"),
    [("now", NOW_NS), ("now-2", NOW_NS - 2 * 10**9), ("now + 0.5", NOW_NS + 5 * 10**8), (3.5, 3_500_000_000)],
)
def test_stamps(written: object, nanoseconds: int) -> None:
    stamp = _sent("std_msgs/Header", {"stamp": written})["stamp"]
    assert stamp["secs"] * 10**9 + stamp["nsecs"] == nanoseconds


@pytest.mark.parametrize(
    ("angles", "xyzw"),
    [
        ([0, 0, 0], (0, 0, 0, 1)),
        ([90, 0, 0], (0.5**0.5, 0, 0, 0.5**0.5)),
        ([0, 0, 180], (0, 0, 1, 0)),
        ([30, 20, 10], (0.2392983, 0.1893082, 0.0381346, 0.9515485)),
    ],
)
def test_angles_in_the_place_of_a_quaternion(angles: list[float], xyzw: tuple[float, ...]) -> None:
    got = _sent("geometry_msgs/Pose", {"orientation": {"rpy_deg": angles}})["orientation"]
    assert [got[axis] for axis in "xyzw"] == pytest.approx(xyzw, abs=1e-6)


def test_a_scan_of_repeated_ranges() -> None:
    ranges = {"repeat": ".inf", "count": 360, "except": {"150-210": 0.3, "0": ".nan"}}
    got = _sent("sensor_msgs/LaserScan", {"ranges": ranges})["ranges"]
    assert len(got) == 360
    assert math.isnan(got[0])
    assert {round(r, 3) for r in got[150:211]} == {0.3}
    assert {got[149], got[211], got[359]} == {math.inf}


@pytest.mark.parametrize(("number", "x", "turn"), [(0, 0.0, 1), (1, 2.0, 2), (2, 4.0, 1)])
def test_numbers_that_change(number: int, x: float, turn: int) -> None:
    assert _sent("geometry_msgs/Twist", {"linear": {"x": {"from": 0, "to": 4}}}, number)["linear"]["x"] == x
    assert _sent("std_msgs/Int32", {"each": [1, 2]}, number) == {"data": turn}
    assert _sent("std_msgs/UInt8", {"from": 0, "to": 4}, number) == {"data": x}
    assert _sent("std_msgs/UInt8", {"data": {"from": 0, "to": 4}}, number) == {"data": x}


def test_fields_may_be_named_as_the_forms_are() -> None:
    value = {"from": 1, "to": 5, "each": [1, 2]}
    assert _sent("lab/Span", value, number=1) == value
    assert MessageType("lab/Span", OWN.get).shown(value) == value


def test_what_the_evidence_shows_is_json_and_short() -> None:
    scan = MessageType("sensor_msgs/LaserScan")
    ranges = {"repeat": ".inf", "count": 360}
    value = {
        "header": {"stamp": "now"},
        "range_max": {"from": 1, "to": 3},
        "angle_min": "-.inf",
        "ranges": ranges,
    }
    assert scan.shown(value, Moment(1, 3, NOW_NS)) == {
        "header": {"stamp": {"secs": 1_700_000_000, "nsecs": 250_000_000}},
        "range_max": 2.0,
        "angle_min": "-.inf",
        "ranges": ranges,
    }
    assert MessageType("std_msgs/Float64").shown(2.5) == 2.5
    assert MessageType("std_msgs/String").shown({"each": ["a", "b"]}, Moment(1, 2, 0)) == "b"


@pytest.mark.parametrize(
    ("type_", "value", "wrong"),
    [
        ("geometry_msgs/Twist", {"linar": {}}, r"no field linar \(did you mean \"linear\"\?\)"),
        ("geometry_msgs/Twist", 3, r"made of fields \(linear, angular\), not 3"),
        ("std_msgs/Float64", "fast", "'fast' is no float64"),
        ("std_msgs/Int8", 200, "out of range"),
        ("std_msgs/Int8", ".inf", "'.inf' is no int8"),
        ("std_msgs/Header", {"stamp": "soon"}, "'soon' is no time: write now, now-2"),
        ("std_msgs/Float64", {"from": 1}, "a number that changes is written"),
        ("std_msgs/Int8", {"each": []}, "each needs a list"),
        ("sensor_msgs/LaserScan", {"ranges": 3}, "ranges is an array: write a list"),
        ("sensor_msgs/LaserScan", {"ranges": {"count": 3}}, "ranges is an array"),
        ("sensor_msgs/LaserScan", {"ranges": {"repeat": 1, "count": -1}}, "count must be"),
        ("sensor_msgs/LaserScan", {"ranges": {"repeat": 1, "count": 10**9}}, "count must be"),
        (
            "sensor_msgs/LaserScan",
            {"ranges": {"repeat": 1, "count": 3, "except": {"2-3": 1}}},
            '"2-3" is no span of 0 to 2',
        ),
        ("sensor_msgs/Imu", {"orientation_covariance": [1]}, "orientation_covariance holds 9, not 1"),
        ("geometry_msgs/Pose", {"orientation": {"rpy_deg": [1, 2]}}, "rpy_deg are three numbers"),
        ("lab/Reading", {"parts": [1]}, "parts holds 3, not 1"),
    ],
)
def test_what_does_not_fit_is_said(type_: str, value: object, wrong: str) -> None:
    with pytest.raises(ValueError, match=wrong):
        _sent(type_, value)


def test_a_number_that_goes_to_an_end_needs_one() -> None:
    with pytest.raises(ValueError, match="give count or duration_s"):
        _sent("std_msgs/Float64", {"from": 0, "to": 1}, total=None)


@pytest.mark.parametrize(
    ("texts", "wrong"),
    [
        ({}, "has no message type"),
        ({"lab/A": "B b\n", "lab/B": "A a\n"}, "nests too deeply"),
        ({"lab/A": "import os; os.system('x')\n"}, "cannot be followed|not a field"),
        ({"lab/A": "int8 a\n" * 20_000}, "too long"),
    ],
)
def test_hostile_definitions_are_refused(texts: dict[str, str], wrong: str) -> None:
    with pytest.raises(ValueError, match=wrong):
        MessageType("lab/A", texts.get)
