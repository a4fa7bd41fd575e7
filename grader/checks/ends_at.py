"""Whether a robot ends where it was sent, and where a node says that one is which it works out (odometry)."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from itertools import pairwise
from typing import Annotated

from pydantic import Field

from grader.checks.registry import Refers, check
from grader.checks.support.clocks import run_seconds
from grader.checks.support.driving import (
    DRIVE,
    IN_ITS_WAY,
    NEARLY,
    ROUNDING,
    SLOW_M_S,
    Place,
    Stretch,
    answers_late,
    commands_in,
    excuse_nearly,
    metres,
    spot,
    tell_end,
    why_still,
    why_unreadable,
)
from grader.checks.support.exit_causes import explain_early_end, explain_end
from grader.checks.support.geometry import (
    TURNING_RAD,
    Point,
    Pose,
    Spot,
    Track,
    aside,
    length_m,
    relative,
    stands,
    track,
    turned_rad,
    turns_away,
)
from grader.checks.support.processes import GlobalName, life_of, named_at, observed_until_ns
from grader.checks.support.text import subscriber
from grader.checks.support.topics import SYSTEM_TOPICS, cite, nodes_on, topics_with
from grader.evidence.run import Run
from grader.model.package import PackageFacts
from grader.model.verdict import Status, Verdict, failed, failed_or_blocked, grade_again, passed
from grader.wording import plural, significant

STILL_S = 0.5
"""A robot's speed at the end is that of so long a time."""
SILENT_S, GAPS = 1.5, 5.0
"""Positions have ended where none came for so long, and for so many of their gaps, before the run's end."""
STEER = (
    "the angle to turn by, towards a point, is math.atan2(dy, dx) minus the heading, both in radians, brought between "
    "-pi and pi: math.remainder(angle, 2 * math.pi); dx and dy are the point minus the robot's place"
)
LEFT = "a positive angular.z turns to the left"
STOPPED = "look at the condition that stops it: the distance is math.hypot(dx, dy), which is never below 0"
NEXT = "take each goal that comes in place of the one before, and forget that that one was reached"
FASTER = "drive faster, or take a shorter way"
SEE = "see on the map where it leaves its way, and what it does there"
"""For a robot that knows no position: it steers by what it sees."""
STRAIGHT = 2.0
"""A way that is longer by this factor than it brings the robot nearer is not a slow one, but a wrong one."""
ALIKE = 0.1
"""Ways and angles that differ by no more than this share of the right one are as good as equal."""
HANDLED_S = 0.5
"""So long after the last message its node has dealt with it."""
STILL_DEG = 5.0
WHEELS = "a turn to the left is positive, and it is the right wheel that goes farther then"
QUATERNION = "an orientation is a quaternion: z is math.sin(yaw / 2), and w is math.cos(yaw / 2)"
FACTOR = "look at what each step is multiplied or divided by"
AXES = "x grows with the cosine of the heading, and y with its sine"
RESET = "has to set x, y and the heading themselves, and not local variables of the same names"
DIFFERENCE = "it goes on changing when nothing comes any more: add what is new since the last step, not the whole count"
PRINT = "print x, y and the heading after each step, and compare them with what the robot did"


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
    verdict = why_unreadable(found, package, run, params)
    verdict = verdict or (None if asked else _not_asked(package, run, params))
    if verdict is None and found is not None and asked is not None:
        judged = path_to_judge(found, asked, params)
        none = f"no position came on {params.topic} in the {asked.to_s - asked.from_s:.1f} s of this goal"
        verdict = _judge_arrival(judged, asked, run, params) if judged else grade_again(none)
        verdict = _fell_silent(package, run, judged, asked, params) or verdict
        verdict = answers_late(tell_end(verdict, package, run), run)
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
        one.speed > SLOW_M_S and asked.to_s - one.time_s <= hold_s for one in commands_in(run, asked)[-1:]
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
    told = commands_in(run, asked)
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
    sides = turns_away([(pose, aside(pose, params.goal)) for pose in judged], commands_in(run, asked))
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


def _never_moves(
    message: str, judged: Sequence[Pose], asked: Stretch, run: Run, params: EndsAtParams
) -> Verdict:
    """Return the loss of a robot that stays where it is: it turns, is told to stop, is blocked, or is told nothing."""
    if turned_rad(judged, STILL_S) > TURNING_RAD:
        verdict = failed_or_blocked(f"{message}, and turns on the spot", hint=_steer(run, params))
        return _with_side(verdict, judged, asked, run, params)
    sent = commands_in(run, asked)
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


def _speed_m_s(path: Sequence[Pose]) -> float:
    """Return the speed at the end."""
    recent = [pose for pose in path if pose.time_s >= path[-1].time_s - STILL_S]
    time_s = recent[-1].time_s - recent[0].time_s
    return length_m(recent) / time_s if time_s > 0 else 0.0


def _excused_end(verdict: Verdict, judged: Sequence[Pose], run: Run, params: EndsAtParams) -> Verdict:
    """A robot that never moved has no excuse; nearly there is also who was there, but looks elsewhere, or late."""
    if verdict.status is not Status.FAIL or stands(judged):
        return verdict
    return excuse_nearly(verdict, run, nearly=params.is_near(judged[-1], NEARLY))


# ---- a position that a node works out from what it hears


def misplaced(path: Sequence[Pose], asked: EndsAtParams, run: Run) -> Verdict | None:
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
    for wrong, hint in (((asked[0], -asked[1]), WHEELS), ((asked[1], asked[0]), AXES)):
        if math.dist(told, wrong) <= max(tolerance_m, ALIKE * asked_m):
            return hint
    times = told_m / asked_m
    if math.dist(told, (times * asked[0], times * asked[1])) <= ALIKE * told_m:
        return f"the way is {significant(round(times, 2))} times as long as it should be: {FACTOR}"
    return PRINT


def _wrong_turn(times: float) -> str:
    """Return how to correct a heading that has turned by so many times the right angle."""
    if abs(times) < ALIKE:
        return f"the heading does not change: {QUATERNION}"
    if times < 0:
        return WHEELS
    also = f": {QUATERNION}; or" if abs(times - 2) < ALIKE else ":"
    return f"it turns by {significant(round(times, 2))} times the angle{also} {FACTOR}"
