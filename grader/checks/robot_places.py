"""Whether a robot ends where it was sent, and stays where it may be."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from itertools import pairwise
from typing import Annotated, NamedTuple

from pydantic import Field, model_validator

from grader.checks.odometry import misplaced
from grader.checks.registry import Refers, check
from grader.checks.robot_path import (
    DRIVE,
    TURNS_S,
    drives_too_little,
    metres,
    never_moves,
    spot,
    tell_end,
    unreadable,
    why_still,
)
from grader.checks.support.clocks import LATE_MS, Lateness, excused, no_clock, run_seconds
from grader.checks.support.exit_causes import explain_early_end, explain_end
from grader.checks.support.geometry import (
    MOVED_M,
    TURNING_RAD,
    Area,
    Band,
    Command,
    Pose,
    PoseFields,
    Region,
    Spot,
    Track,
    aside,
    circles,
    circling,
    commands_of,
    length_m,
    out_along,
    relative,
    set_off_s,
    share_inside,
    shown_walls,
    stands,
    track,
    turned_rad,
    turns_away,
)
from grader.checks.support.processes import GlobalName, life_of, named_at, observed_until_ns, run_slips
from grader.checks.support.scans import scan_near, with_scan
from grader.checks.support.text import subscriber
from grader.checks.support.topics import SYSTEM_TOPICS, cite, no_message, nodes_on, topics_with
from grader.evidence.run import Run
from grader.model.package import PackageFacts
from grader.model.record import Record
from grader.model.verdict import Status, Verdict, failed, failed_or_blocked, grade_again, inconclusive, passed
from grader.wording import join_words, plural, significant

STALLED_MS = 1000.0
"""In the time of the run, which may be faster than the wall's."""
STILL_S = 0.5
"""A robot's speed at the end is that of so long a time."""
SLOW_M_S = 0.02
SILENT_S, GAPS = 1.5, 5.0
"""Positions have ended where none came for so long, and for so many of their gaps, before the run's end."""
ROUNDING = 1e-9
NEARLY = 1.25
"""A loss by no more than this factor is one that a single run's timing could have made."""
STEER = (
    "the angle to turn by, towards a point, is math.atan2(dy, dx) minus the heading, both in radians, brought between "
    "-pi and pi: math.remainder(angle, 2 * math.pi); dx and dy are the point minus the robot's place"
)
LEFT = "a positive angular.z turns to the left"
STOPPED = "look at the condition that stops it: the distance is math.hypot(dx, dy), which is never below 0"
NEXT = "take each goal that comes in place of the one before, and forget that that one was reached"
FASTER = "drive faster, or take a shorter way"
STILL_TURNS = "set angular.z to 0 where the way is free: a velocity keeps what was set in it before"
CIRCLES = "make angular.z depend on where the wall is, ahead or beside the robot, and not only on how far away it is"
TOWARDS = "turn towards the wall where it is too far away: a positive angular.z turns to the left"
PLACES = 200
"""So many of a robot's poses are enough to see to which side it turns."""
OTHER_SIDE = "turn to the other side where the wall is too near: a positive angular.z turns to the left"
IN_ITS_WAY = "see on the map what is in its way, and turn away from that before you drive on"
SEE = "see on the map where it leaves its way, and what it does there"
"""For a robot that knows no position: it steers by what it sees."""
SELDOM_S = 0.5
"""A node that steers by what it sees gets ten scans in a second, and answers them sooner."""
STRAIGHT = 2.0
"""A way that is longer by this factor than it brings the robot nearer is not a slow one, but a wrong one."""


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


class EndsAtParams(Place):
    """The goal, and when it is looked at."""

    goal: Spot
    """`[x, y]` in metres."""
    tolerance_m: Annotated[float, Field(gt=0)]
    """How far from the goal it may end."""
    heading_deg: Annotated[float, Field(ge=-360, le=360)] | None = None
    """Where it has to look: 0 along x, 90 along y; null: anywhere."""
    heading_tolerance_deg: Annotated[float, Field(gt=0, le=180)] = 15.0
    """How much the heading may differ."""
    within_s: Annotated[float, Field(gt=0)] | None = None
    """How soon it has to be there, and stay: after the message that asked, or else after it set off."""
    asked_on: Annotated[GlobalName, Refers("sent")] | None = None
    """The topic on which the grader sends goals: the robot's position is judged when the next goal comes.
    Null: at the end of the run."""
    number: Annotated[int, Field(ge=1)] = 1
    """Which of the messages on `asked_on` asks for this goal."""

    @property
    def words(self) -> str:
        """`within 0.1 m of (2, 0), heading 90°, in 10 s`."""
        heading = f", heading {significant(self.heading_deg)}°" if self.heading_deg is not None else ""
        time = f", in {significant(self.within_s)} s" if self.within_s is not None else ""
        return f"within {significant(self.tolerance_m)} m of {spot(self.goal)}{heading}{time}"

    def is_near(self, pose: Pose, tolerances: float = 1.0) -> bool:
        return math.dist(pose.point, self.goal) <= tolerances * self.tolerance_m + ROUNDING

    def off_deg(self, pose: Pose) -> float:
        """Return by how much it looks too far to the left (degrees); 0 where the heading is not asked for."""
        if self.heading_deg is None:
            return 0.0
        # The short way round: 350° and -10° are one heading.
        return math.degrees(math.remainder(pose.heading - math.radians(self.heading_deg), math.tau))

    def is_there(self, pose: Pose) -> bool:
        return self.is_near(pose) and abs(self.off_deg(pose)) <= self.heading_tolerance_deg + ROUNDING


class Stretch(NamedTuple):
    """Seconds of the run."""

    from_s: float
    to_s: float

    def began_s(self, path: Sequence[Pose]) -> float:
        """Return when it was asked, or else when it set off."""
        return self.from_s if math.isfinite(self.from_s) else set_off_s(path)


@check("ends-at", params=EndsAtParams, messages_only=True, of_callbacks=True)
def ends_at(package: PackageFacts, run: Run, params: EndsAtParams) -> Verdict:
    """The robot ends where it was sent.

    What it checks
        That the robot's last position is within the tolerance of the goal, and, if the rubric asks for it,
        that the robot looks the right way and was there in time. If there are several goals, each is judged
        when the next one is sent.

    Why it matters on a robot
        A robot that stops a hand's breadth beside its dock is not charged in the morning, and one that circles
        around its goal never says that it is there.

    How it is measured
        By the positions that the simulator publishes, or else those of the package's own nodes. Velocities
        are added up over time, along exact arcs. The robot has arrived at the first position after which
        none is outside the tolerance. In a run with a fast clock, times are the clock's.

    How to fix
        Steer by the error: its length is `math.hypot(dx, dy)`, its direction `math.atan2(dy, dx)` minus the
        heading, brought between -pi and pi. Publish a zero velocity once you are there.
    """
    found, asked = track(run, params.topic, params.hold_s, params.fields), stretch_to_judge(run, params)
    verdict = _unreadable(found, package, run, params)
    verdict = verdict or (None if asked else _not_asked(package, run, params))
    if verdict is None and found is not None and asked is not None:
        judged = path_to_judge(found, asked, params)
        none = f"no position came on {params.topic} in the {asked.to_s - asked.from_s:.1f} s of this goal"
        verdict = _judge_arrival(judged, asked, run, params) if judged else grade_again(none)
        verdict = _fell_silent(package, run, judged, asked, params) or verdict
        verdict = _answers_late(tell_end(verdict, package, run), run)
        verdict = _excused_end(verdict, judged, run, params) if judged else verdict
    assert verdict is not None  # noqa: S101 - one of them always is
    measured = verdict.measured or "no position"
    return verdict.about(expected=params.words, measured=measured, citations=(cite(run, params.topic),))


def path_to_judge(found: Track, asked: Stretch, params: EndsAtParams) -> list[Pose]:
    """Return the path from the time at which the goal was asked for."""
    path = relative(found.path) if params.relative else list(found.path)
    return [pose for pose in path if asked.from_s <= pose.time_s <= asked.to_s]


def stretch_to_judge(run: Run, params: EndsAtParams) -> Stretch | None:
    """Return the time in which the robot has to get there; None where it was never asked to."""
    to_s = run_seconds(run)
    if to_s is None:
        return None
    end_s = to_s(observed_until_ns(run) or run.end_ns)
    if params.asked_on is None:
        return Stretch(-math.inf, end_s)
    sent = sorted(t for c in run.channels if c.topic == params.asked_on and c.by_grader for t in c.times_ns)
    if len(sent) < params.number:
        return None
    after = sent[params.number] if params.number < len(sent) else None
    return Stretch(to_s(sent[params.number - 1]), end_s if after is None else min(end_s, to_s(after)))


def _unreadable(found: Track | None, package: PackageFacts, run: Run, params: Place) -> Verdict | None:
    """Return why there is no path to be judged; None where there is one."""
    if found is None:
        return no_clock(run) or no_message(package, run, params.topic)
    return unreadable(found, params.topic)


def _not_asked(package: PackageFacts, run: Run, params: EndsAtParams) -> Verdict | None:
    if params.asked_on is None:
        return None
    if hearing := nodes_on(run, params.asked_on, "subscribers"):
        missed = f"message {params.number} on {params.asked_on} was not sent"
        dead = [one for node in hearing if (one := life_of(run, node)) and one.ended_early]
        end = explain_end(dead[0], run, package) if dead else None
        return end.verdict(failed_or_blocked, f"{missed}: {end.cause}") if end else grade_again(missed)
    hint = f"subscribe to it: {subscriber(params.asked_on)}"
    return failed_or_blocked(f"no node listens to {params.asked_on}, so no goal could be sent", hint=hint)


def _judge_arrival(judged: Sequence[Pose], asked: Stretch, run: Run, params: EndsAtParams) -> Verdict:
    last = judged[-1]
    apart_m = math.dist(last.point, params.goal)
    figures = f"{metres(apart_m)} from the goal, at {spot(last.point)}"
    if not params.is_there(last):
        lost = misplaced(judged, params, run) if params.asked_on is None else None
        return (lost or _elsewhere(judged, asked, run, params)).about(measured=figures)
    outside = [index for index, pose in enumerate(judged) if not params.is_there(pose)]
    came_s = judged[outside[-1] + 1 if outside else 0].time_s - asked.began_s(judged)
    figures += f", after {came_s:.1f} s"
    if params.within_s is not None and came_s > params.within_s + ROUNDING:
        message = (
            f"it is at {spot(params.goal)} after {came_s:.1f} s; {significant(params.within_s)} s are allowed"
        )
        hint = "drive faster while the goal is far away, and turn the shorter way"
        return failed(message, hint=hint, measured=figures)
    return passed(f"it ends {metres(apart_m)} from {spot(params.goal)}", measured=figures)


def _elsewhere(judged: Sequence[Pose], asked: Stretch, run: Run, params: EndsAtParams) -> Verdict:
    """Return how it misses the goal, by the likeliest cause."""
    last = judged[-1]
    at = f"it ends at {spot(last.point)}, {metres(math.dist(last.point, params.goal))} from {spot(params.goal)}"
    turned = params.off_deg(last)
    if params.is_near(last):
        side = "left" if turned > 0 else "right"
        message = f"it ends at the goal, but looks {abs(turned):.0f}° too far to the {side}"
        return failed(message, hint="once you are there, turn until the heading is right")
    if stands(judged):
        never = (
            f"it never moves, and stays {metres(math.dist(last.point, params.goal))} from {spot(params.goal)}"
        )
        return _never_moves(never, judged, asked, run, params)
    began_s = asked.began_s(judged)
    there = next((pose for pose in judged if pose.time_s >= began_s and params.is_near(pose)), None)
    if there is not None:
        message = f"it is there after {there.time_s - began_s:.1f} s, but keeps moving: {at}"
        hint = "publish a zero velocity once you are there"
        if params.asked_on is None:  # it may be a place on its way
            hint = f"see on the map where it goes on; if it has to stop there, {hint}"
        return failed(message, hint=hint)
    speed_m_s, hold_s = _speed_m_s(judged), math.inf if params.hold_s is None else params.hold_s
    moves = speed_m_s > SLOW_M_S
    if moves or any(
        one.speed > SLOW_M_S and asked.to_s - one.time_s <= hold_s for one in _told(run, asked)[-1:]
    ):
        still = f"on its way at {speed_m_s:.2f} m/s" if moves else "told to drive"
        message = f"{at}, and is still {still}"
        nearer_m = math.dist(judged[0].point, params.goal) - math.dist(last.point, params.goal)
        around, strays = turned_rad(judged) / math.tau, length_m(judged) > STRAIGHT * nearer_m
        driven = f"it drives {metres(length_m(judged))} and is {metres(max(0.0, nearer_m))} nearer"
        driven = driven if strays else f"it turns around {around:.1f} times on its way"
        steer = _steer(run, params)
        steer += "; where it does not, it is too slow" if steer == SEE and nearer_m >= 0 else ""
        turn = f"{'it drives away' if nearer_m < 0 else driven}: {steer}"
        strays = strays or around > 1
        verdict = failed(message, hint=turn if strays else FASTER if moves else IN_ITS_WAY)
        return _with_side(verdict, judged, asked, run, params) if strays else verdict
    told = _told(run, asked)
    holds = bool(told) and asked.to_s - told[-1].time_s <= hold_s
    if turned_rad(judged, STILL_S) > TURNING_RAD or (holds and told[-1].turn):
        verdict = failed(f"{at}, and turns on the spot", hint=_steer(run, params))
        return _with_side(verdict, judged, asked, run, params)
    near = f"the distance is less than {significant(params.tolerance_m)} m"
    hint = f"stop only where {near}"
    if told and not holds and (told[-1].speed or told[-1].turn):
        at += f": the last velocity, which is not 0, came {asked.to_s - told[-1].time_s:.1f} s before that"
        hint = f"publish a velocity again and again until {near}"
    return failed(at, hint=hint)


def _with_side(
    verdict: Verdict, judged: Sequence[Pose], asked: Stretch, run: Run, params: EndsAtParams
) -> Verdict:
    """Return the loss with the side to which it turns, where the goal is nearly always on the other one."""
    sides = turns_away([(pose, aside(pose, params.goal)) for pose in judged], _told(run, asked))
    if sides is None:
        return verdict
    why = f"it turns to the {sides[0]} where the goal is on its {sides[1]}"
    steer = _steer(run, params)
    hint = f"turn {f'towards the goal: {LEFT}, and {STEER}' if steer == STEER else f'the other way there: {LEFT}'}"
    return verdict.explained(why, hint).lost_by("steers-wrong", sides[0])


def _steer(run: Run, params: EndsAtParams) -> str:
    """Return how a robot turns towards its goal, where its node may know where it is."""
    heard = {topic for topic in topics_with(run, "subscribers") if topic not in SYSTEM_TOPICS}
    kinds = {kind for _, event in run.graph for topic, kind in event.topic_types.items() if topic in heard}
    knows = params.asked_on is not None or params.topic in heard or not heard
    return STEER if knows or any(re.search("Odometry|Pose|TFMessage", kind) for kind in kinds) else SEE


def _told(run: Run, asked: Stretch) -> list[Command]:
    """Return the velocities of the student's nodes in the time of a goal, but for those that no node hears."""
    to_s, heard = run_seconds(run), topics_with(run, "subscribers", lambda _: True)
    if to_s is None:
        return []
    channels = (c for c in run.student_channels() if c.topic in heard or not heard)
    sent = [one._replace(time_s=to_s(t)) for c in channels for t, one in commands_of(c)]
    return sorted(one for one in sent if asked.from_s <= one.time_s <= asked.to_s)


def _never_moves(
    message: str, judged: Sequence[Pose], asked: Stretch, run: Run, params: EndsAtParams
) -> Verdict:
    """Return the loss of a robot that stays where it is: it turns, is told to stop, is blocked, or is told nothing."""
    if turned_rad(judged, STILL_S) > TURNING_RAD:
        verdict = failed_or_blocked(f"{message}, and turns on the spot", hint=_steer(run, params))
        return _with_side(verdict, judged, asked, run, params)
    sent = _told(run, asked)
    if any(command.forward for command in sent):
        return failed_or_blocked(f"{message}, though it is told to drive", hint=IN_ITS_WAY)
    if not sent or any(command.speed or command.turn for command in sent):
        return why_still(failed_or_blocked(message, hint=DRIVE).stuck(params.number), run)
    message += f": {plural(len(sent), 'velocity', 'velocities')} came, and {'all are' if len(sent) > 1 else 'it is'} 0"
    return failed_or_blocked(message, hint=f"{NEXT}; {STOPPED}" if params.number > 1 else STOPPED)


def _fell_silent(
    package: PackageFacts, run: Run, judged: Sequence[Pose], asked: Stretch, params: EndsAtParams
) -> Verdict | None:
    """Return the loss where the student's own positions end long before the run does, on the way: where the robot went
    then, no one knows."""
    sent = [c for c in run.channels if c.topic == params.topic and c.messages]
    own = run.student_channels(params.topic)
    # A simulator goes on telling where the robot is, and velocities say nothing of where it was.
    if not judged or len(sent) > len(own) or any("Twist" in channel.type for channel in sent):
        return None
    silent_s, gap_s = asked.to_s - judged[-1].time_s, (judged[-1].time_s - judged[0].time_s) / len(judged)
    if silent_s < max(SILENT_S, GAPS * gap_s) or any(map(params.is_near, judged)) or stands(judged):
        return None
    if _speed_m_s(judged) <= SLOW_M_S:
        return None
    message = f"the positions on {params.topic} end {silent_s:.1f} s before the run does, at {spot(judged[-1].point)}, "
    message += f"on the way to {spot(params.goal)}"
    if end := explain_early_end(package, run):
        return end.verdict(failed, f"{message}: the node ended ({end.cause})")
    hint = f"publish on {params.topic} for as long as the node runs, not only for a while"
    return failed(message, hint=hint, citations=named_at(package, run, "publisher", params.topic))


def _answers_late(verdict: Verdict, run: Run) -> Verdict:
    """Mark the loss of a robot whose node lets long pass between two velocities: a callback of it may wait."""
    told = _told(run, Stretch(-math.inf, math.inf))
    seldom = any(b.time_s - a.time_s > SELDOM_S for a, b in pairwise(told) if a.speed or a.turn)
    return verdict.late() if seldom and verdict.status is Status.FAIL else verdict


def _speed_m_s(path: Sequence[Pose]) -> float:
    """Return the speed at the end."""
    recent = [pose for pose in path if pose.time_s >= path[-1].time_s - STILL_S]
    time_s = recent[-1].time_s - recent[0].time_s
    return length_m(recent) / time_s if time_s > 0 else 0.0


def _excused_end(verdict: Verdict, judged: Sequence[Pose], run: Run, params: EndsAtParams) -> Verdict:
    """A robot that never moved has no excuse; nearly there is also who was there, but looks elsewhere, or late."""
    if verdict.status is not Status.FAIL or stands(judged):
        return verdict
    return _excuse_nearly(verdict, run, nearly=params.is_near(judged[-1], NEARLY))


def _excuse_nearly(verdict: Verdict, run: Run, *, nearly: bool) -> Verdict:
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


class StaysWithinParams(Place):
    """The region: give `box`, `polygon`, or `min_m`, `max_m` or both."""

    box: tuple[Spot, Spot] | None = None
    """Two opposite corners `[x, y]`, in metres."""
    polygon: Annotated[tuple[Spot, ...], Field(min_length=3)] | None = None
    """Its corners `[x, y]` in turn, in metres."""
    walls: tuple[Annotated[tuple[Spot, ...], Field(min_length=1)], ...] = ()
    """Lines through points `[x, y]`, or single points, in metres; empty: the walls that the run's simulator shows."""
    min_m: Annotated[float, Field(ge=0)] | None = None
    """The least distance from the nearest of the walls; null: no bound."""
    max_m: Annotated[float, Field(gt=0)] | None = None
    """The greatest distance from the nearest of the walls; null: no bound."""
    share: Annotated[float, Field(gt=0, le=1)] = 1.0
    """The share of the time for which it has to be inside."""
    from_s: Annotated[float, Field(ge=0)] = 0.0
    """The time after it sets off that does not count."""
    least_m: Annotated[float, Field(ge=0)] = 0.0
    """The least length of the path."""

    @model_validator(mode="after")
    def _is_one_region(self) -> StaysWithinParams:
        by_distance = self.min_m is not None or self.max_m is not None
        if sum((self.box is not None, self.polygon is not None, by_distance)) != 1:
            raise ValueError("give one of box, polygon, and min_m, max_m or both")
        if self.walls and not by_distance:
            raise ValueError("walls: give min_m or max_m, the distance from them")
        if self.min_m is not None and self.max_m is not None and self.min_m >= self.max_m:
            raise ValueError(f"min_m, {self.min_m:g}, is not less than max_m, {self.max_m:g}")
        return self

    def region(self, run: Run) -> Region:
        """Return where it may be in this run."""
        if self.box is not None:
            (x0, y0), (x1, y1) = self.box
            words = f"within the box from {spot(self.box[0])} to {spot(self.box[1])}"
            return Area(((x0, y0), (x1, y0), (x1, y1), (x0, y1)), words)
        if self.polygon is not None:
            return Area(self.polygon, f"within the polygon {join_words(map(spot, self.polygon))}")
        return Band(self.walls or shown_walls(run), self.min_m, self.max_m)


@check("stays-within", params=StaysWithinParams, messages_only=True, of_callbacks=True)
def stays_within(package: PackageFacts, run: Run, params: StaysWithinParams) -> Verdict:
    """The robot stays where it may be.

    What it checks
        That the robot's path stays in a region: in a box or a polygon, or at a distance from walls or points.

    Why it matters on a robot
        A robot that cuts a corner too closely loses its bumper there, and one that drifts away from the
        wall that it follows has nothing to steer by.

    How it is measured
        By the positions that the simulator publishes, or else those of the package's own nodes; velocities
        are added up over time. The robot's centre counts. A share is of the time after the robot sets off;
        each position holds until the next one.

    How to fix
        The report draws the path and where it leaves the region. Stop, or turn away, before the robot is there:
        at 0.2 m/s and ten scans a second it drives 2 cm from scan to scan.
    """
    found, region = track(run, params.topic, params.hold_s, params.fields), params.region(run)
    verdict = _unreadable(found, package, run, params) or _no_walls(region)
    if verdict is None and found is not None:
        path = placed(found, params)
        early = f"no position came on {params.topic} after the first {significant(params.from_s)} s"
        verdict = (
            tell_end(_stays(path, region, run, params, package), package, run) if path else grade_again(early)
        )
        verdict = _answers_late(verdict, run)
    assert verdict is not None  # noqa: S101 - one of them always is
    share = f" for {params.share:.0%} of the time" if params.share < 1 else ""
    measured = verdict.measured or "no position"
    cited = (cite(run, params.topic),)
    return verdict.about(expected=f"{region.words}{share}", measured=measured, citations=cited)


def placed(found: Track, params: StaysWithinParams) -> list[Pose]:
    """Return the part of the path that counts: how long it stood before it set off is no one's doing."""
    path = relative(found.path) if params.relative else list(found.path)
    moved = next((i for i, pose in enumerate(path) if math.dist(pose.point, path[0].point) > MOVED_M), 0)
    # The pose before the one that has moved is where it set off.
    from_s = path[max(0, moved - 1)].time_s + params.from_s
    return [pose for pose in path if pose.time_s >= from_s]


def _no_walls(region: Region) -> Verdict | None:
    if not isinstance(region, Band) or region.walls:
        return None
    message = "no simulator of this run shows its walls, and the rubric gives none"
    return inconclusive(message, hint="tell your instructor")


def _stays(
    path: Sequence[Pose], region: Region, run: Run, params: StaysWithinParams, package: PackageFacts
) -> Verdict:
    out, long_m = out_along(path, region), length_m(path)
    inside = share_inside(path, out)
    figures = f"{inside:.0%} of the time inside, {metres(max(out))} outside at most, {metres(long_m)} long"
    if stands(path) and (params.least_m or not any(out)):
        hears = topics_with(run, "subscribers", lambda node: node in run.grader_nodes)
        own = [c for c in run.student_channels() if c.topic in hears or not hears]
        last = [one for c in own for _, one in commands_of(c)[-1:]]
        if any(one.forward > SLOW_M_S for one in last) and turned_rad(path) <= TURNING_RAD:
            return failed_or_blocked(
                "it never moves, though it is told to drive", measured=figures, hint=IN_ITS_WAY
            )
        return never_moves(path, figures, run)
    # A pose that lasts no time at all counts as well where all has to be inside.
    if inside < params.share - ROUNDING or (params.share == 1 and any(out)):
        verdict = _outside(path, out, region, inside, params)
        wrong = _turns_wrong(path, out, region, run) if isinstance(region, Band) else None
        if wrong is not None:
            verdict = verdict.explained(f"it turns to the {wrong[0]} there, {wrong[1]}", wrong[2])
            verdict = verdict.lost_by("steers-wrong", wrong[0])
        elif isinstance(region, Band) and (scan := scan_near(path, out, region, run)):
            verdict = with_scan(verdict, scan, run_slips(package, run, "ranges-read"))
        elif isinstance(region, Band) and (around := circles(path, out)) > 1:
            verdict = verdict.explained(f"it drives in circles there, {around:.1f} times around", CIRCLES)
    elif long_m < params.least_m:
        verdict = drives_too_little(path, region, params.least_m)
    elif (
        params.least_m
        and isinstance(region, Band)  # in a box, circles may be what is asked for
        and (way_m := long_m - length_m((end := circling(path, region))[0])) < params.least_m
    ):
        message = f"it drives in circles at {spot(path[-1].point)} in the end, {end[1]:.1f} times around"
        verdict = failed(message, hint=CIRCLES if params.max_m is not None else STILL_TURNS)
        long_m = way_m
    else:
        always = f"for {inside:.0%} of the time" if any(out) else "all the time"
        return passed(f"it is {region.words} {always}", measured=figures)
    nearly = inside * NEARLY >= params.share and long_m * NEARLY >= params.least_m
    return _excuse_nearly(verdict.about(measured=figures), run, nearly=nearly)


def _turns_wrong(
    path: Sequence[Pose], out: Sequence[float], band: Band, run: Run
) -> tuple[str, str, str] | None:
    """Return to which side it is told to turn, where the wall is, and what to do: before it comes too near to a wall
    that is there, or while it is too far from one that is on the other side. None where it is neither."""
    outside = [pose for pose, far in zip(path, out, strict=True) if far]
    if band.nearest_m(outside[0].point) < (band.min_m or 0.0):
        side, until_s = aside(outside[0], band.towards(outside[0])), outside[0].time_s
        told = [one.turn * side for one in _told(run, Stretch(until_s - TURNS_S, until_s)) if one.turn]
        to_wall = min(told, default=0.0) > 0
        return ("left" if side > 0 else "right", "where the wall is", OTHER_SIDE) if to_wall else None
    too_far = [
        pose
        # Some of the places will do, as to look through all walls at each takes time.
        for pose in outside[:: 1 + len(outside) // PLACES]
        if band.nearest_m(pose.point) > (band.max_m or math.inf)
    ]
    away = [(pose, aside(pose, band.towards(pose))) for pose in too_far]
    sides = turns_away(away, _told(run, Stretch(-math.inf, math.inf)))
    return (sides[0], f"where the wall is too far away, on its {sides[1]}", TOWARDS) if sides else None


def _outside(
    path: Sequence[Pose], out: Sequence[float], region: Region, inside: float, params: StaysWithinParams
) -> Verdict:
    first = next(pose for pose, far in zip(path, out, strict=True) if far)
    peak = path[max(range(len(out)), key=out.__getitem__)]
    where = f"{metres(max(out))} at {spot(peak.point)}"
    after = f"{first.time_s - path[0].time_s + params.from_s:.1f} s after it set off"
    message = f"it is not {region.words} from {spot(first.point)} on, {after}; farthest out by {where}"
    if params.share < 1:
        message = f"only {inside:.0%} of the time it is {region.words}: farthest out by {where}"
    # what comes after it is too near follows from that
    return failed(message, hint=_keep(path, [peak, first] if params.share == 1 else [peak], region))


def _keep(path: Sequence[Pose], out: Sequence[Pose], region: Region) -> str:
    if not isinstance(region, Band):
        return "turn, or stop, before you are at the border"
    if any(region.nearest_m(pose.point) < (region.min_m or 0.0) for pose in out):
        if region.max_m is not None:
            return "steer away from what you follow while the distance is too small"
        return "turn away, or stop, earlier: look at all ranges in front of the robot, not only at the middle one"
    if region.max_m and (kept_m := region.kept_m(path[:: 1 + len(path) // PLACES]) or 0) > region.max_m:
        return f"for half of the time it is {metres(kept_m)} away or more: look at the distance that it steers by"
    return "steer towards what you follow while the distance is too large"
