"""What a robot's driving is judged by in several families: whose path, the velocities it is told, why it stays."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Annotated, NamedTuple

from pydantic import Field

from grader.checks.support.clocks import LATE_MS, Lateness, excused, no_clock, run_seconds
from grader.checks.support.exit_causes import explain_early_end
from grader.checks.support.geometry import (
    TURNING_RAD,
    Command,
    Point,
    Pose,
    PoseFields,
    Track,
    commands_of,
    has_no_numbers,
    other_axis,
    set_off_s,
    turned_rad,
)
from grader.checks.support.processes import GlobalName, observed_until_ns
from grader.checks.support.topics import SYSTEM_TOPICS, no_message, topics_with
from grader.evidence.run import Run
from grader.model.package import PackageFacts
from grader.model.record import Record
from grader.model.verdict import Status, Verdict, failed, failed_or_blocked
from grader.wording import ask_field, join_words, significant

STALLED_MS = 1000.0
"""In the time of the run, which may be faster than the wall's."""
SLOW_M_S = 0.02
ROUNDING = 1e-9
NEARLY = 1.25
"""A loss by no more than this factor is one that a single run's timing could have made."""
IN_ITS_WAY = "see on the map what is in its way, and turn away from that before you drive on"
SELDOM_S = 0.5
"""A node that steers by what it sees gets ten scans in a second, and answers them sooner."""
DRIVE = "publish a velocity that is not 0, again and again for as long as it should drive"
STOPS_S = 0.3


class Place(Record):
    """Whose position it is."""

    topic: GlobalName
    """The topic of poses (`nav_msgs/Odometry`, `geometry_msgs/PoseStamped`, `turtlesim/Pose`, …), of any messages with
    `fields`, or of velocities (`geometry_msgs/Twist`), which are added up from (0, 0)."""
    fields: PoseFields | None = None
    """The fields of a position, in messages that are none of ROS's poses."""
    relative: bool = False
    """Whether positions are seen from the first one, x being forward there and y to the left."""
    hold_s: Annotated[float, Field(gt=0)] | None = 1.0
    """A velocity holds until the next one, but no longer than this; null: for ever."""


class Stretch(NamedTuple):
    """Seconds of the run."""

    from_s: float
    to_s: float

    def began_s(self, path: Sequence[Pose]) -> float:
        """Return when it was asked, or else when it set off."""
        return self.from_s if math.isfinite(self.from_s) else set_off_s(path)


def why_unreadable(found: Track | None, package: PackageFacts, run: Run, params: Place) -> Verdict | None:
    """Return why there is no path to be judged; None where there is one."""
    if found is None:
        return no_clock(run) or no_message(package, run, params.topic)
    return unreadable(found, params.topic)


def unreadable(found: Track, topic: str) -> Verdict | None:
    """Return the verdict where the messages tell of no path."""
    if found.misfit:
        hint = f"rostopic info {topic} shows their type"
        verdict = failed_or_blocked(
            f"the messages on {topic} {found.misfit}", measured=found.misfit, hint=hint
        )
        return verdict.based_on(misfit=True)
    if found.fault:
        hint = "print what you publish: a division by zero, or a square root of a negative number?"
        return failed(f"the messages on {topic} {found.fault}", measured=found.fault, hint=hint)
    return None


def tell_end(verdict: Verdict, package: PackageFacts, run: Run) -> Verdict:
    """Return a loss with the reason why the node ended, where it did so early and not by its script's own end."""
    end = explain_early_end(package, run) if verdict.status is Status.FAIL else None
    for channel in run.student_channels() if verdict.status is Status.FAIL else ():
        if axis := other_axis(channel):
            why = f"velocities on {channel.topic} set {axis}, and their angular.z is always 0"
            hint = f"{ask_field('angular.z', axis)}: a robot on wheels turns by that alone"
            verdict = verdict.explained(why, hint)
    if end is None or end.by_itself or end.cause in verdict.message:
        return verdict
    kind = failed_or_blocked if verdict.basis.unjudged else failed
    if "keeps moving" in verdict.message:  # it was there before that
        verdict = verdict.model_copy(update={"citations": (*verdict.citations, *end.citations)})
        return verdict.explained(f"the node ended: {end.cause}", f"{verdict.hint}; {end.hint}")
    return end.verdict(kind, f"{verdict.message}; the node ended: {end.cause}", verdict.measured)


def commands_in(run: Run, asked: Stretch) -> list[Command]:
    """Return the velocities of the student's nodes in the time of a goal, but for those that no node hears."""
    to_s, heard = run_seconds(run), topics_with(run, "subscribers", lambda _: True)
    if to_s is None:
        return []
    channels = (c for c in run.student_channels() if c.topic in heard or not heard)
    sent = [one._replace(time_s=to_s(t)) for c in channels for t, one in commands_of(c)]
    return sorted(one for one in sent if asked.from_s <= one.time_s <= asked.to_s)


def answers_late(verdict: Verdict, run: Run) -> Verdict:
    """Mark the loss of a robot whose node lets long pass between two velocities: a callback of it may wait."""
    told = commands_in(run, Stretch(-math.inf, math.inf))
    seldom = any(b.time_s - a.time_s > SELDOM_S for a, b in pairwise(told) if a.speed or a.turn)
    return verdict.late() if seldom and verdict.status is Status.FAIL else verdict


def excuse_nearly(verdict: Verdict, run: Run, *, nearly: bool) -> Verdict:
    """What nearly is right counts if it is seen twice, and not where the machine was late; all else is lost, unless the
    machine stood still for so long that a robot drives into a wall."""

    def why_late(late: Lateness) -> str:
        stalled = late.max_ms * run.warp >= STALLED_MS
        if stalled:
            return f"late itself, by up to {late.max_ms:.0f} ms"
        return late.reason(LATE_MS) if nearly else ""

    began = (c.times_ns[0] for c in run.student_channels() if c.messages and c.topic not in SYSTEM_TOPICS)
    from_ns, to_ns = min(began, default=run.start_ns), observed_until_ns(run) or run.end_ns
    return excused(verdict.if_repeated() if nearly else verdict, run, from_ns, to_ns, why_late)


def never_moves(path: Sequence[Pose], figures: str, run: Run) -> Verdict:
    """Return the loss of a robot that stays where it is, and turns there at most."""
    if turned_rad(path) > TURNING_RAD:
        hint = f"{DRIVE}: linear.x, and not only angular.z; where the script does so, its condition is never true"
        if any(one.forward for channel in run.student_channels() for _, one in commands_of(channel)):
            hint = "look at the condition under which it drives: it is hardly ever true"
        return failed_or_blocked("it turns, and never leaves its place", measured=figures, hint=hint)
    return why_still(failed_or_blocked("it never moves", measured=figures, hint=DRIVE), run)


def why_still(verdict: Verdict, run: Run) -> Verdict:
    """Return the loss with its cause where the student's velocities have a linear.y, and never a linear.x, are no
    numbers, or go where the robot does not listen."""
    types = {topic: kind for _, event in run.graph for topic, kind in event.topic_types.items()}
    simulated = topics_with(run, "subscribers", lambda node: node in run.grader_nodes)
    hears = sorted(topic for topic in simulated if "Twist" in types.get(topic, ""))
    heard, own = topics_with(run, "subscribers", lambda _: True), topics_with(run, "subscribers")
    for channel in run.student_channels():
        commands = [command for _, command in commands_of(channel)]
        if has_no_numbers(channel):
            why = f"velocities on {channel.topic} are no numbers (nan or inf), which a robot does not obey"
            hint = "print what they are calculated from, to see where the first nan or inf comes from"
            if any("LaserScan" in types.get(topic, "") for topic in own):
                hint = "a range is inf where nothing is in reach: calculate with no such range"
            return verdict.explained(why, hint)
        if hears and channel.topic not in heard and any(one.speed for one in commands):
            why = f"its velocities are on {channel.topic}, which no node hears"
            return verdict.explained(why, f"publish them on {join_words(hears, last='or')}")
        if any(one.left for one in commands) and not any(one.forward for one in commands):
            why = f"linear.x of {channel.topic} is always 0, and linear.y does not move a robot on wheels"
            return verdict.explained(why, ask_field("linear.x", "linear.y"))
    return verdict


def spot(point: Point) -> str:
    return f"({significant(round(point[0], 2))}, {significant(round(point[1], 2))})"


def metres(distance_m: float) -> str:
    return f"{distance_m:.2f} m"
