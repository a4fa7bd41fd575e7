"""Transforms between frames as tf sends them: composed, turned around, and found in a run."""

from __future__ import annotations

import math
import re
from bisect import bisect_right
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Annotated, NamedTuple

from pydantic import Field

from grader.evidence.run import Channel, Run

TOPICS = ("/tf", "/tf_static")
Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
NO_LENGTH = 1e-6
LENGTH_TOLERANCE = 0.01
"""How much the square of a quaternion's length may differ from 1: tf2 ignores transforms beyond that."""
POSE_DEPTH = 3
FRAME_PATTERN = r"^[^/\s]\S*$"
Frame = Annotated[str, Field(pattern=FRAME_PATTERN)]


class Transform(NamedTuple):
    """Metres, and a rotation as x, y, z, w."""

    at: Vector
    turn: Quaternion

    def __matmul__(self, other: Transform) -> Transform:
        """Return this transform, and then the other one in the frame that it leads to."""
        x, y, z = _rotate(self.turn, other.at)
        return Transform((self.at[0] + x, self.at[1] + y, self.at[2] + z), _product(self.turn, other.turn))

    @property
    def inverse(self) -> Transform:
        x, y, z, w = self.turn
        back = (-x, -y, -z, w)
        away = _rotate(back, self.at)
        return Transform((-away[0], -away[1], -away[2]), back)

    @property
    def rpy_deg(self) -> Vector:
        """Roll, pitch and yaw, as tf's `euler_from_quaternion` gives them."""
        x, y, z, w = self.turn
        roll = math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
        # Rounding may lead a little beyond 1, of which there is no arcsine.
        pitch = math.asin(max(-1.0, min(1.0, 2 * (w * y - z * x))))
        yaw = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
        return math.degrees(roll), math.degrees(pitch), math.degrees(yaw)

    def apart(self, other: Transform) -> tuple[float, float]:
        """Return how far two transforms are from each other, in metres and degrees."""
        # A quaternion and its negative are the same rotation.
        cos = abs(sum(a * b for a, b in zip(self.turn, other.turn, strict=True)))
        return math.dist(self.at, other.at), math.degrees(2 * math.acos(min(1.0, cos)))


def turn_of(rpy_deg: Sequence[float]) -> Quaternion:
    """Return the quaternion of roll, pitch and yaw, as tf's `quaternion_from_euler` does."""
    half = [math.radians(angle) / 2 for angle in rpy_deg]
    (cr, cp, cy), (sr, sp, sy) = map(math.cos, half), map(math.sin, half)
    return (
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
        cr * cp * cy + sr * sp * sy,
    )


def _product(a: Quaternion, b: Quaternion) -> Quaternion:
    (ax, ay, az, aw), (bx, by, bz, bw) = a, b
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )


def _rotate(turn: Quaternion, vector: Vector) -> Vector:
    x, y, z, w = turn
    rx, ry, rz, _ = _product(_product(turn, (*vector, 0.0)), (-x, -y, -z, w))
    return rx, ry, rz


class Sent(NamedTuple):
    """A transform that was sent. `value` is None where tf does not take it: the `length` of its quaternion is not 1, or
    it holds what is not a number."""

    time_ns: int
    parent: str
    child: str
    topic: str
    value: Transform | None
    length: float = 1.0


def sent_on(channels: Sequence[Channel]) -> list[Sent]:
    """Return all transforms of `/tf` and `/tf_static` by time; whose they are says who gives the channels."""
    found = [
        Sent(
            time_ns,
            header["frame_id"],
            one["child_frame_id"],
            channel.topic,
            _make_transform(one["transform"]["translation"], one["transform"]["rotation"])
            if abs(_length(one["transform"]["rotation"]) ** 2 - 1) <= LENGTH_TOLERANCE
            else None,
            _length(one["transform"]["rotation"]),
        )
        for channel in channels
        if channel.topic in TOPICS
        for time_ns, value in zip(channel.times_ns, channel.values, strict=True)
        for one in (value or {}).get("transforms") or ()
        if isinstance(one, Mapping) and (header := one.get("header")) and "child_frame_id" in one
    ]
    return sorted(found, key=lambda one: one.time_ns)


def _length(turn: Mapping[str, float]) -> float:
    return math.hypot(turn["x"], turn["y"], turn["z"], turn["w"])


def _make_transform(at: Mapping[str, float], turn: Mapping[str, float]) -> Transform | None:
    vector = (at["x"], at["y"], at["z"])
    turn_ = (turn["x"], turn["y"], turn["z"], turn["w"])
    length = _length(turn)
    if not (length > NO_LENGTH and math.isfinite(length) and all(map(math.isfinite, vector))):
        return None
    return Transform(vector, (turn_[0] / length, turn_[1] / length, turn_[2] / length, turn_[3] / length))


def pose_in(value: object) -> Transform | None:
    """Return the pose in a message: a `geometry_msgs/Pose` at any depth (PoseStamped, Odometry), or x, y and theta."""
    for _ in range(POSE_DEPTH):
        if not isinstance(value, Mapping):
            return None
        if {"position", "orientation"} <= value.keys():
            return _make_transform(value["position"], value["orientation"])
        if {"x", "y", "theta"} <= value.keys():
            planar = (value["x"], value["y"], 0.0)
            return Transform(planar, turn_of((0, 0, math.degrees(value["theta"]))))
        value = value.get("pose")
    return None


class Tree:
    """What tf would know at any time: each frame's parent, and the transform to it."""

    def __init__(self, sent: Sequence[Sent]) -> None:
        self._of: dict[str, list[Sent]] = {}
        for one in sent:
            self._of.setdefault(one.child, []).append(one)

    def path(self, child: str, at_ns: int) -> Iterator[Sent]:
        """Yield the transforms from a frame up to the root, as they were at that time."""
        # Frames may be sent as each other's parents, in a circle.
        seen: set[str] = set()
        while child not in seen and child in self._of:
            seen.add(child)
            known = self._of[child]
            index = bisect_right(known, at_ns, key=lambda one: one.time_ns)
            if not index:
                return
            yield known[index - 1]
            child = known[index - 1].parent

    def lookup(self, parent: str, child: str, at_ns: int) -> Transform | None:
        """Return the transform from one frame to another below it, None where they are not connected."""
        found = Transform((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))
        for one in self.path(child, at_ns):
            if one.value is None:
                return None
            found = one.value @ found
            if one.parent == parent:
                return found
        return None


_LOOKED_UP = re.compile(r"\"([^\"]{1,80})\" passed to lookupTransform argument \w+ does not exist")


def unknown_frame(run: Run, output: Iterable[str]) -> str:
    """Return the frame that a node still cannot look up when the run ends, as its output says; "" for none."""
    found = [m[1] for line in output if (m := _LOOKED_UP.search(line))]
    sent = {
        name
        for channel in run.channels
        if channel.topic in TOPICS
        for value in channel.values
        for one in (value or {}).get("transforms") or ()
        for name in (one.get("child_frame_id"), one.get("header", {}).get("frame_id"))
    }
    # What was looked up before that may have come since.
    return next((name for name in found[-1:] if name not in sent), "")
