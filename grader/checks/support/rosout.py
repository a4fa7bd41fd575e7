"""What nodes logged on /rosout (rosgraph_msgs/Log), and what looks like a log line on the console."""

from __future__ import annotations

import re
from collections.abc import Collection
from typing import Literal, NamedTuple

from grader.checks.support.text import bare
from grader.evidence.run import Run

Level = Literal["debug", "info", "warn", "error", "fatal"]
LEVELS: dict[int, Level] = {1: "debug", 2: "info", 4: "warn", 8: "error", 16: "fatal"}
CALLS = {level: f"rospy.log{'err' if level == 'error' else level}" for level in LEVELS.values()}
_CONSOLE = re.compile(r"^\s*\[\s*(DEBUG|INFO|WARN|ERROR|FATAL)\s*\]\s*\[[^\]]*\]\s*:?\s?(.*)$")


class Logged(NamedTuple):
    """One log message; `level` is None for a number that ROS does not know."""

    at_ns: int
    node: str
    level: Level | None
    text: str


def logged_by(run: Run, nodes: Collection[str]) -> tuple[Logged, ...]:
    """The log messages of these nodes, by time; of all nodes in another tool's recording, which knows no graph."""
    found = [
        Logged(
            t,
            channel.callerid or str(value.get("name", "")),
            LEVELS.get(value.get("level", 0)),
            str(value.get("msg", "")),
        )
        for channel in run.student_channels("/rosout")
        if run.foreign or channel.callerid in nodes
        for t, value in zip(channel.times_ns, channel.values, strict=True)
        if isinstance(value, dict)
    ]
    return tuple(sorted(found, key=lambda one: one.at_ns))


def console_log(line: str) -> tuple[str, str] | None:
    """Level and text of a line as rospy and roscpp print what they log; None for any other line."""
    match = _CONSOLE.match(bare(line))
    return (match[1].lower(), match[2]) if match else None
