"""ROS packages, Python modules and messages that exist: where the grading machine has them not, it lacks them."""

from __future__ import annotations

import re
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
ON_THE_MACHINE = "on the grading machine: "
"""How every hint begins that only who keeps the machine can follow: grading again changes nothing before."""
_PREFIX = re.compile(r"/opt/ros/([a-z]+)\b")


@cache
def known_packages() -> dict[str, tuple[str, ...]]:
    """Return by the name in ROS or Python the Debian packages, or `pip:` and the name on PyPI; nothing where only ROS's
    own repository has it."""
    rows = _TABLE.read_text(encoding="utf-8").splitlines()
    words = (row.split() for row in rows if row and not row.startswith("#"))
    return {name: tuple(rest) for name, *rest in words}


@cache
def known_messages() -> tuple[str, ...]:
    """Return the names of ROS Noetic's own message types (`sensor_msgs/JointState`)."""
    from rosbags.typesys import Stores, get_typestore  # noqa: PLC0415 - hundreds of types, for a rare mistake

    names = get_typestore(Stores.ROS1_NOETIC).fielddefs
    return tuple(name.replace("/msg/", "/") for name in names if "/msg/" in name)


def install_hint(name: str, lines: Iterable[str] = ()) -> str:
    """Return what the grading machine needs, by the distribution of ROS that these lines of output name."""
    ros = next((found[1] for found in map(_PREFIX.search, lines) if found), "")
    packages = known_packages().get(name, ())
    if not ros and name not in known_packages():
        what = f"install the ROS package {name}"
    elif packages and packages[0].startswith(PIP):
        what = f"pip install {packages[0].removeprefix(PIP)}"
    elif packages and not ros:
        what = f"apt-get install {' '.join(packages)}"
    else:
        what = f"apt-get install ros-{ros or 'noetic'}-{name.replace('_', '-')}, from ROS's own repository"
    return f"{ON_THE_MACHINE}{what}, then grade again"
