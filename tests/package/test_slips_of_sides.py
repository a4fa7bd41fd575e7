"""Sides, angles and units that scans are read in: script_sides.py, script_scans.py."""

from pathlib import Path

import pytest

from grader.package.python import check_syntax

pytestmark = pytest.mark.usefixtures("without_processes")


SIDES = {
    "right = min(msg.ranges[45:135])": "write `msg.ranges[225:315]` in place of `msg.ranges[45:135]`",
    "left = msg.ranges[270]": "write `msg.ranges[90]` in place of `msg.ranges[270]`",
    "front_left = min(msg.ranges[-60:-20])": "write `msg.ranges[20:60]` in place of `msg.ranges[-60:-20]`",
    "RIGHT = 90": "write `-90` in place of `90`",
    "LEFT_DEG = -45": "write `45` in place of `-45`",
    "left = msg.ranges[90]": "",
    "right = min(min(msg.ranges[225:315]), 3.5)": "",
    "RIGHT = 270": "",
    "right = min(msg.ranges)": "",
    "ahead = msg.ranges[90]": "",
    "left_and_right = msg.ranges[90]": "",
    "turn_right = min(msg.ranges[45:135])": "",
    "right = msg.ranges[90] < 0.5": "",
    "right = msg.ranges[start:90]": "",
    "right = 90": "",
    "copyright = msg.ranges[90]": "",
}


@pytest.mark.parametrize("line", SIDES)
def test_ranges_that_are_named_after_the_other_side(line: str, tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text(f"from sensor_msgs.msg import LaserScan\ndef f(msg):\n    {line}\n")
    slips = [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.name == "side"]
    assert [s.fix.partition(", ")[2] for s in slips] == ([SIDES[line]] if SIDES[line] else [])


@pytest.mark.parametrize(
    ("left", "right", "fix"),
    [
        ("[:45]", "[:-45]", "on line 4, write `msg.ranges[-45:]` in place of `msg.ranges[:-45]`"),
        ("[45:]", "[-45:]", "on line 3, write `msg.ranges[:45]` in place of `msg.ranges[45:]`"),
        ("[:45]", "[-45:]", ""),
        ("[:90]", "[90:]", ""),
        ("[:-10]", "[n:]", ""),
    ],
)
def test_ranges_of_one_side_that_have_those_of_the_other(
    left: str, right: str, fix: str, tmp_path: Path
) -> None:
    text = f"from sensor_msgs.msg import LaserScan\ndef f(msg):\n    left = min(msg.ranges{left})\n"
    (tmp_path / "a.py").write_text(f"{text}    right = min(msg.ranges{right})\n")
    slips = [s for s in check_syntax(tmp_path, ["a.py"]).slips if "nearly all" in s.message]
    assert [s.fix for s in slips] == ([fix] if fix else [])


@pytest.mark.parametrize(
    ("line", "fix"),
    [
        ("SECTOR = int(math.radians(45))", "on line 1, write `SECTOR = 45`"),
        ("SECTOR = round(np.deg2rad(30))", "on line 1, write `SECTOR = 30`"),
        ("SECTOR = int(math.degrees(0.7))", ""),
        ("OTHER = int(math.radians(45))", ""),
        ("SECTOR = math.radians(45)", ""),
    ],
)
def test_a_whole_number_of_radians_for_an_index(line: str, fix: str, tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text(f"{line}\ndef f(msg):\n    return min(msg.ranges[:SECTOR])\n")
    slips = [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.name == "angle"]
    assert [s.fix.partition(" where ")[0] for s in slips] == ([fix] if fix else [])


@pytest.mark.parametrize(
    ("line", "fix"),
    [
        ("degrees - scan.angle_min", "write `math.radians(degrees)` in place of `degrees`"),
        ("self.deg / self.scan.angle_increment", "write `math.radians(self.deg)` in place of `self.deg`"),
        ("math.radians(degrees) - scan.angle_min", ""),
        ("angle - scan.angle_min", ""),
        ("degrees - start", ""),
    ],
)
def test_degrees_beside_the_radians_of_a_scan(line: str, fix: str, tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text(f"x = {line}\n")
    slips = [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.name == "mixed"]
    assert [s.fix.partition(", ")[2] for s in slips] == ([fix] if fix else [])


METRES = {
    "if min(msg.ranges) < 50: stop()": "on line 3, write the distance in metres, as in `0.5`",
    "near = min(msg.ranges)\n    if near <= self.limit: stop()": "on line 2, write the distance in metres, as in `0.3`",
    "if self.limit > min(msg.ranges): stop()": "on line 2, write the distance in metres, as in `0.3`",
    "if msg.ranges[0] < 0.5: stop()": "",
    "if len(msg.ranges) < 50: stop()": "",
    "if min(msg.ranges) < 3.5: stop()": "",
}


@pytest.mark.parametrize("line", METRES)
def test_ranges_that_are_compared_with_centimetres(line: str, tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text(f"def f(self, msg):\n    self.limit: float = 30\n    {line}\n")
    slips = [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.name == "metres"]
    assert [s.fix for s in slips] == ([METRES[line]] if METRES[line] else [])
