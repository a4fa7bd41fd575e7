"""ROS packages and Python modules that exist but need not be on the grading machine: then the machine lacks them."""

from __future__ import annotations

import re
from collections.abc import Iterable
from functools import cache
from pathlib import Path

_TABLE = Path(__file__).with_name("installable.txt")
_PREFIX = re.compile(r"/opt/ros/([a-z]+)\b")


@cache
def known_packages() -> dict[str, str]:
    """Return the Debian package by the name in ROS or Python, "" where it follows from the name."""
    rows = _TABLE.read_text(encoding="utf-8").splitlines()
    words = (row.split() for row in rows if row and not row.startswith("#"))
    return {name: "".join(rest) for name, *rest in words}


def install_hint(name: str, lines: Iterable[str] = ()) -> str:
    """Return what the grading machine needs, by the distribution of ROS that these lines of output name."""
    ros = next((found[1] for found in map(_PREFIX.search, lines) if found), "")
    package = known_packages().get(name) or (f"ros-{ros}-{name.replace('_', '-')}" if ros else "")
    what = f"apt-get install {package}" if package else f"install the package that provides {name}"
    return f"on the grading machine: {what}, then grade again"
