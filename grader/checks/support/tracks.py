"""The path that a run's messages tell of: velocities added up over time, or poses as they are."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from grader.checks.support.geometry import Command, Pose, driven
from grader.checks.support.names import plain_type
from grader.checks.support.process import observed_until_ns
from grader.evidence.run import Channel, Run

FASTEST = 1e6

Seconds = Callable[[int], float]
"""From a `log_time` (ns) to a second of the time that the node lives in."""


class Track(NamedTuple):
    """The path, or why the messages tell of none: `misfit` if they are of another type, `fault` if they are bad."""

    path: tuple[Pose, ...] = ()
    misfit: str = ""
    fault: str = ""


def track(run: Run, topic: str, hold_s: float | None) -> Track | None:
    """The path told on a topic, None where no message came (or, in a warped run, no clock)."""
    seconds = run_seconds(run)
    channels = _publishers(run, topic)
    pairs = sorted(
        (pair for c in channels for pair in zip(c.times_ns, c.values, strict=True)), key=lambda pair: pair[0]
    )
    if not pairs or seconds is None:
        return None
    poses = [p for t, value in pairs if (p := _pose(seconds(t), value))]
    commands = [c for t, value in pairs if (c := _command(seconds(t), value))]
    if len(poses) < len(pairs) and len(commands) < len(pairs):
        return Track(misfit=f"are {plain_type(channels[0].type)}: neither velocities nor poses")
    if not all(_finite(*one[1:]) for one in (*poses, *commands)):
        return Track(fault="hold what is no number, or none that a robot could follow")
    if poses:
        return Track(tuple(poses))
    end_s = seconds(observed_until_ns(run) or run.end_ns)
    return Track(tuple(driven(commands, hold_s, end_s)))


def run_seconds(run: Run) -> Seconds | None:
    """Seconds since the run began; in a warped run, those of the grader's `/clock`, None where it was not recorded."""
    if run.clock != "warped":
        return lambda time_ns: (time_ns - run.start_ns) / 1e9
    ticks = [
        (time_ns, value["clock"]["secs"] + value["clock"]["nsecs"] / 1e9)
        for channel in run.channels
        if channel.topic == "/clock" and channel.by_grader
        for time_ns, value in zip(channel.times_ns, channel.values, strict=True)
        if value
    ]
    return _interpolated(ticks) if ticks else None


def _interpolated(ticks: list[tuple[int, float]]) -> Seconds:
    times = [time_ns for time_ns, _ in ticks]
    zero_s = ticks[0][1]

    def seconds(time_ns: int) -> float:
        after = bisect_right(times, time_ns)
        if after in {0, len(ticks)}:
            return ticks[max(0, after - 1)][1] - zero_s
        (first_ns, first_s), (next_ns, next_s) = ticks[after - 1], ticks[after]
        return first_s - zero_s + (next_s - first_s) * (time_ns - first_ns) / (next_ns - first_ns)

    return seconds


def _publishers(run: Run, topic: str) -> list[Channel]:
    """A simulator that the rubric starts knows the pose; otherwise the student's nodes count."""
    channels = [c for c in run.channels if c.topic == topic and c.messages and not c.by_grader]
    simulated = [c for c in channels if c.callerid in run.grader_nodes and _pose(0, c.values[0])]
    return simulated or [c for c in channels if run.is_student_node(c.callerid)]


def _pose(time_s: float, message: Any) -> Pose | None:  # noqa: ANN401 - decoded messages hold anything
    """`x` and `y` at the top (turtlesim/Pose, geometry_msgs/Pose2D) or in `pose`s (also nav_msgs/Odometry)."""
    while isinstance(message, Mapping) and "pose" in message:
        message = message["pose"]
    if not isinstance(message, Mapping):
        return None
    place = message.get("position", message)
    if not isinstance(place, Mapping) or not {"x", "y"} <= place.keys():
        return None
    turned = message.get("orientation")
    heading = _yaw(turned) if isinstance(turned, Mapping) else message.get("theta", 0.0)
    return Pose(time_s, place["x"], place["y"], heading)


def _yaw(q: Mapping[str, float]) -> float:
    return math.atan2(
        2 * (q["w"] * q["z"] + q["x"] * q["y"]), q["w"] ** 2 + q["x"] ** 2 - q["y"] ** 2 - q["z"] ** 2
    )


def _command(time_s: float, message: Any) -> Command | None:  # noqa: ANN401 - as above
    """geometry_msgs/Twist, or the `twist` of a TwistStamped."""
    message = message.get("twist", message) if isinstance(message, Mapping) else {}
    linear, angular = message.get("linear"), message.get("angular")
    if not isinstance(linear, Mapping) or not isinstance(angular, Mapping):
        return None
    return Command(time_s, linear["x"], linear["y"], angular["z"])


def _finite(*values: float) -> bool:
    return all(math.isfinite(value) and abs(value) < FASTEST for value in values)
