"""What can be installed: ROS packages, Python modules and messages that exist, and the grader's own extras."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterable
from functools import cache
from pathlib import Path

_TABLE = Path(__file__).with_name("installable.txt")
PIP = "pip:"
ROS_2 = {
    "rclpy",
    "rclcpp",
    "ament_cmake",
    "ament_python",
    "ament_index_python",
    "launch_ros",
    "ros2cli",
    "rosidl_runtime_py",
}
"""No machine for ROS 1 has these."""
ON_THE_MACHINE = "nothing for you to do: tell your instructor. On the grading machine: "
"""How every hint begins that only the instructor can follow: grading again changes nothing before."""
_PREFIX = re.compile(r"/opt/ros/([a-z]+)\b")


@cache
def known_packages() -> dict[str, tuple[str, ...]]:
    """Return by the name in ROS or Python the Debian packages, or `pip:` and the name on PyPI; nothing where only ROS's
    own repository has it."""
    rows = _TABLE.read_text(encoding="utf-8").splitlines()
    words = (row.split() for row in rows if row and not row.startswith("#"))
    return {name: tuple(rest) for name, *rest in words}


@cache
def noetic_messages() -> dict[str, dict[str, tuple[str, ...]]]:
    """Return the fields of ROS Noetic's own message types by package and name (`sensor_msgs`: {`JointState`: …})."""
    from rosbags.typesys import Stores, get_typestore  # noqa: PLC0415 - slow to load, and few need it

    found: dict[str, dict[str, tuple[str, ...]]] = {}
    for full, (_, fields) in sorted(get_typestore(Stores.ROS1_NOETIC).fielddefs.items()):
        package, _, name = full.partition("/msg/")
        found.setdefault(package, {})[name] = tuple(field for field, _ in fields)
    return found


def install_hint(name: str, lines: Iterable[str] = ()) -> str:
    """Return what the grading machine needs, by the distribution of ROS that these lines of output name."""
    ros = next((found[1] for found in map(_PREFIX.search, lines) if found), "")
    own = (
        "" if name in known_packages() else "; a package of the student's own has to be pushed with this one"
    )
    return f"{ON_THE_MACHINE}{install_command(name, ros)}, then grade again{own}"


def install_command(name: str, ros: str = "") -> str:
    """Return how a package is installed; `ros` is the distribution below /opt/ros, "" for Debian's own ROS."""
    packages = known_packages().get(name, ())
    if not ros and name not in known_packages():
        return f"install the ROS package {name}"
    if packages and packages[0].startswith(PIP):
        return f"pip install {packages[0].removeprefix(PIP)}"
    if packages and not ros:
        return f"apt-get install {' '.join(packages)}"
    return f"apt-get install ros-{ros or 'noetic'}-{name.replace('_', '-')}, from ROS's own repository"


def install_extra(extra: str) -> str:
    """Return the command that adds what an extra of the grader needs (`review`) to the environment that it runs in."""
    from importlib.metadata import requires  # noqa: PLC0415 - slow to load, and few need it

    from packaging.requirements import Requirement  # noqa: PLC0415 - as above

    needs = map(Requirement, requires("ros-lab-grader") or ())
    names = " ".join(
        f"'{need.name}{need.specifier}'"
        for need in needs
        if need.marker and need.marker.evaluate({"extra": extra}) and not need.marker.evaluate({"extra": ""})
    )
    pipx = Path(sys.prefix, "pipx_metadata.json").is_file()
    return f"pipx inject ros-lab-grader {names}" if pipx else f"{sys.executable} -m pip install {names}"
