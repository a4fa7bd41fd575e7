"""What is wrong with a position that a node works out from what it hears (odometry), by where it ends up."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Protocol

from grader.checks.robot_path import metres, spot
from grader.checks.support.clocks import run_seconds
from grader.checks.support.geometry import Point, Pose, stands
from grader.checks.support.topics import SYSTEM_TOPICS, topics_with
from grader.evidence.run import Run
from grader.model.verdict import Verdict, failed
from grader.wording import significant

RIGHT = 0.1
"""Ways and angles that differ by no more than this share of the right one are as good as equal."""
HANDLED_S = 0.5
"""So long after the last message its node has dealt with it."""
STILL_DEG = 5.0
LEFT = "a turn to the left is positive, and it is the right wheel that goes farther then"
QUATERNION = "an orientation is a quaternion: z is math.sin(yaw / 2), and w is math.cos(yaw / 2)"
FACTOR = "look at what each step is multiplied or divided by"
AXES = "x grows with the cosine of the heading, and y with its sine"
RESET = "has to set x, y and the heading themselves, and not local variables of the same names"
DIFFERENCE = "it goes on changing when nothing comes any more: add what is new since the last step, not the whole count"
PRINT = "print x, y and the heading after each step, and compare them with what the robot did"


class Goal(Protocol):
    """What `ends-at` asks for."""

    @property
    def topic(self) -> str: ...
    @property
    def goal(self) -> Point: ...
    @property
    def tolerance_m(self) -> float: ...
    def off_deg(self, pose: Pose) -> float: ...


def misplaced(path: Sequence[Pose], asked: Goal, run: Run) -> Verdict | None:
    """Return the loss of a node whose path ends elsewhere, or looks elsewhere; None where a robot drives."""
    told_until_s = _told_until_s(run, asked.topic)
    if told_until_s is None:
        return None
    last, off_deg = path[-1], asked.off_deg(path[-1])
    apart_m, after = math.dist(last.point, asked.goal), [one for one in path if one.time_s > told_until_s]
    if apart_m > asked.tolerance_m:
        message = f"it ends at {spot(last.point)}, {metres(apart_m)} from {spot(asked.goal)}"
        hint = _wrong_way(path, asked.goal, asked.tolerance_m)
    else:
        side = "left" if off_deg > 0 else "right"
        message = f"it ends at {spot(asked.goal)}, but looks {abs(off_deg):.0f}° too far to the {side}"
        right_deg = math.remainder(math.degrees(last.heading - path[0].heading) - off_deg, 360)
        hint = _wrong_turn(_turned_deg(path) / (right_deg or 360))
    if after and (
        math.dist(after[0].point, last.point) > asked.tolerance_m or abs(_turned_deg(after)) > STILL_DEG
    ):
        hint = DIFFERENCE
    return failed(message, hint=hint)


def _told_until_s(run: Run, topic: str) -> float | None:
    """Return when what the grader sends has reached the student's node, which works out from it where the robot is;
    None for a node that drives a robot, or is sent nothing."""
    to_s, own = run_seconds(run), run.student_channels(topic)
    heard = {*topics_with(run, "subscribers")} - SYSTEM_TOPICS
    sent_ns = [t for c in run.channels if c.by_grader and c.topic in heard for t in c.times_ns]
    is_own = own and len(own) == sum(c.topic == topic and bool(c.messages) for c in run.channels)
    drives = any("Twist" in c.type for c in run.student_channels())
    return to_s(max(sent_ns)) + HANDLED_S if to_s and sent_ns and is_own and not drives else None


def _turned_deg(path: Sequence[Pose]) -> float:
    """Return by how much it turns to the left."""
    return math.degrees(sum(math.remainder(b.heading - a.heading, math.tau) for a, b in pairwise(path)))


def _wrong_way(path: Sequence[Pose], goal: Point, tolerance_m: float) -> str:
    """Return how to correct a path that ends elsewhere than at `goal`."""
    first, last = path[0].point, path[-1].point
    asked, told = (goal[0] - first[0], goal[1] - first[1]), (last[0] - first[0], last[1] - first[1])
    asked_m, told_m = math.hypot(*asked), math.hypot(*told)
    if stands(path):
        return f"does each message change x and y? {PRINT}"
    if asked_m <= tolerance_m:
        return f"it should end where it began: {PRINT}; what resets it {RESET}"
    for wrong, hint in (((asked[0], -asked[1]), LEFT), ((asked[1], asked[0]), AXES)):
        if math.dist(told, wrong) <= max(tolerance_m, RIGHT * asked_m):
            return hint
    times = told_m / asked_m
    if math.dist(told, (times * asked[0], times * asked[1])) <= RIGHT * told_m:
        return f"the way is {significant(round(times, 2))} times as long as it should be: {FACTOR}"
    return PRINT


def _wrong_turn(times: float) -> str:
    """Return how to correct a heading that has turned by so many times the right angle."""
    if abs(times) < RIGHT:
        return f"the heading does not change: {QUATERNION}"
    if times < 0:
        return LEFT
    also = f": {QUATERNION}; or" if abs(times - 2) < RIGHT else ":"
    return f"it turns by {significant(round(times, 2))} times the angle{also} {FACTOR}"
