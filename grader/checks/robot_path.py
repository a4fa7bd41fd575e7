"""Whether a robot takes the right path, and if not, where and how it leaves it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise, takewhile
from typing import Annotated, NamedTuple

from pydantic import Field, model_validator

from grader.checks.registry import check
from grader.checks.support.clocks import excused, lateness, no_clock, run_seconds
from grader.checks.support.driving import STOPS_S, metres, never_moves, spot, tell_end, unreadable
from grader.checks.support.geometry import (
    RESTS_M,
    TURNING_RAD,
    Course,
    Point,
    Pose,
    Spot,
    Track,
    arc,
    commands_of,
    driven,
    first_turn,
    followed,
    length_m,
    off_m,
    relative,
    set_off_s,
    stands,
    top_speeds,
    track,
    turned_rad,
    winds,
)
from grader.checks.support.processes import GlobalName, run_slips
from grader.checks.support.topics import Sender, cite, nothing_sent
from grader.evidence.run import Run
from grader.model.package import PackageFacts
from grader.model.python_slip import PythonSlip
from grader.model.record import Record
from grader.model.verdict import Verdict, failed, passed
from grader.wording import join_words, significant

LATE_MS = 25.0
LATE_P95_MS = 5.0


LATE_TURNS = 4
"""Each turn may be late: at 1.6 rad/s, 25 ms in each of four are 0.16 rad, and 0.3 m beside a line of 2 m."""
ORIGIN = (0.0, 0.0)
DEGREES_FROM = 20.0
"""Radians a second that no robot of a lab turns with, and that small angles in degrees come to."""
AWAY = 0.3
"""How far from a corner, as a share of what follows it, the robot is when its direction is looked at."""
STOPS_AFTER_S = 1.0
"""The last velocity of a node that ends holds for so long."""
NUMBER_SHARE = 0.1
"""By so much a leg may differ from the number in the script that says how long it is."""
SAME_TURN_DEG, OTHER_TURN_DEG, HALF_TURN_DEG = 2.0, 20.0, 170.0
"""A turn by so much more or less is another one; one of nearly half a circle has no side."""


class PathParams(Record):
    """The path, and how the robot's velocities are read."""

    topic: GlobalName
    """The topic of velocities (`geometry_msgs/Twist`) or poses, with its slash."""
    points: Annotated[tuple[Spot, ...], Field(min_length=1)]
    """In metres, `[x, y]`, in the order in which they have to be passed."""
    tolerance_m: Annotated[float, Field(gt=0)]
    """How far from the path and its points the robot may be."""
    relative: bool = True
    """Whether the points are seen from the start, x being forward there and y to the left; the start itself is put
    before them."""
    hold_s: Annotated[float, Field(gt=0)] | None = 1.0
    """A velocity holds until the next one, but no longer than this; null: for ever."""
    of: Sender | None = None
    """Whose messages count: the `student`'s nodes', those of a `program` that the scenario starts beside them, or
    `anyone`'s; null: the poses of a program if one publishes them, else the student's messages."""
    may_go_on: bool = False
    """Whether it may drive on from the last point, as a robot does that drives around and around: what it does after
    that does not count."""

    @model_validator(mode="after")
    def _is_a_way(self) -> PathParams:
        way = self.way.points
        if len(way) < 2:
            raise ValueError("points: a path needs at least two points")
        shortest_m = min(math.dist(a, b) for a, b in pairwise(way))
        # With a larger one, two points could be passed from one place.
        if self.tolerance_m > shortest_m / 2:
            near = f"two points that follow each other are {shortest_m:g} m apart"
            raise ValueError(f"tolerance_m, {self.tolerance_m:g}, is too large: {near}")
        return self

    @property
    def way(self) -> Way:
        added = self.relative and math.dist(self.points[0], ORIGIN) > self.tolerance_m
        return Way((ORIGIN, *self.points) if added else self.points, self.tolerance_m, added)


@check("path", params=PathParams, messages_only=True, of_callbacks=True)
def path(package: PackageFacts, run: Run, params: PathParams) -> Verdict:
    """The robot takes the right way.

    What it checks
        That the path passes the points in their order, each within the tolerance, stays within the
        tolerance of the straight lines between them, and ends at the last one, unless it may go on from there.

    Why it matters on a robot
        The path follows from time and speed. If a turn lasts a tenth of a second too long, the robot misses
        its door, and every later turn adds to the error.

    How it is measured
        Velocities (geometry_msgs/Twist) are added up over time, along exact arcs, each until the next one
        came or until the robot would have stopped by itself. Poses (turtlesim/Pose, Odometry) are taken as
        they are. In a run with a fast clock, times are the clock's.

    How to fix
        Distance is speed times time, an angle is `angular.z` times time, in radians: a quarter turn is
        `math.pi / 2`. Publish at a steady rate while it has to move, and a zero velocity at the end.
    """
    found = track(run, params.topic, params.hold_s, of=params.of)
    if found is None:
        verdict = no_clock(run) or nothing_sent(package, run, params.topic, params.of or "student")
    else:
        verdict = unreadable(found, params.topic) or _judge_track(found, package, run, params)
        verdict = tell_end(verdict, package, run)
    expected = f"a way through {join_words(map(spot, params.points))}, within {metres(params.tolerance_m)}"
    measured = verdict.measured or "no path"
    return verdict.about(expected=expected, measured=measured, citations=(cite(run, params.topic),))


def _judge_track(found: Track, package: PackageFacts, run: Run, params: PathParams) -> Verdict:
    taken = relative(found.path) if params.relative else list(found.path)
    course = course_of(taken, params)
    figures = measured(taken, course, params.way)
    if course.done:
        count = f"{len(params.points)} points" if len(params.points) > 1 else "its point"
        return passed(f"the path passes {count} within {significant(params.tolerance_m)} m", measured=figures)
    if stands(taken):
        return never_moves(taken, figures, run)
    # What explains the whole way goes before what is wrong at one place of it.
    words = (
        _in_degrees(run)
        or _let_go(run, params)
        or _by_other_clock(run, params, course)
        or _let_go(run, params, course)
        or what_is_wrong(taken, params.way, course, mirror=params.relative)
    )
    verdict = failed(words.message, hint=words.hint, measured=figures)
    verdict = _with_number(verdict, words.leg_m, taken, params.way, run_slips(package, run, "way-number"))
    nearly = followed(taken, params.way.points, 2 * params.tolerance_m + _drift_m(run, taken, params.way))
    if not nearly.done and not _strays_late(nearly, params.way):
        return verdict
    # a robot that only just strays may have strayed with a machine that was late itself
    return excused(verdict, run, run.start_ns, run.end_ns, lambda late: late.reason(LATE_MS, LATE_P95_MS))


def _with_number(
    verdict: Verdict,
    leg_m: tuple[float, float] | None,
    path: Sequence[Pose],
    way: Way,
    slips: Sequence[PythonSlip],
) -> Verdict:
    """Return the loss of a robot that drives each leg too short or too long with the one line that says how far, or how
    long."""
    asked_m, driven_m = leg_m or (0.0, 0.0)
    speed = top_speeds(path)[0]
    # Of legs that differ, the same line may be right for another one.
    alike = all(abs(math.dist(*leg) - asked_m) <= NUMBER_SHARE * asked_m for leg in pairwise(way.points))
    if not (asked_m and speed and alike):
        return verdict
    per_m = {"distance": 1.0, "time": 1 / speed}
    found = [s for s in slips if abs(float(s.message) / per_m[s.fix] - driven_m) < NUMBER_SHARE * driven_m]
    for one in found if len(found) == 1 else ():
        where = f"line {one.line} of {one.file}"
        fix = f"on {where}, write {significant(asked_m * per_m[one.fix])} in place of {one.message}"
        verdict = verdict.explained(f"`{one.name}` is {one.message} on {where}", fix, (one.place,))
    return verdict


def course_of(taken: Sequence[Pose], params: PathParams) -> Course:
    """Return how far a path passes the lab's points; one that may go on behind the last strays nowhere after it."""
    course = followed(taken, params.way.points, params.tolerance_m)
    if params.may_go_on and course.reached == len(params.way.points):
        return course._replace(done=True, strayed=None)
    return course


def _drift_m(run: Run, path: Sequence[Pose], way: Way) -> float:
    """Return how far a machine that once stood still leads a robot astray that drives, or turns, by time (m)."""
    late = lateness(run, run.start_ns, run.end_ns)
    if late is None:
        return 0.0
    speed, turn = top_speeds(path)
    leg_m = max((math.dist(*leg) for leg in pairwise(way.points)), default=0.0)
    return late.max_ms / 1e3 * run.warp * max(speed, turn * leg_m)


def _strays_late(course: Course, way: Way) -> bool:
    """Behind turns enough for what each was late to add up."""
    return course.strayed is not None and LATE_TURNS < course.reached < len(way.points)


def _in_degrees(run: Run) -> Words | None:
    """A turn so fast that degrees are meant where radians are asked for."""
    # All topics: poses may be judged, and the velocities that led to them are on another one.
    turns = ((c, one.turn) for c in run.student_channels() for _, one in commands_of(c))
    channel, fastest = max(turns, key=lambda one: abs(one[1]), default=(None, 0.0))
    seconds = run_seconds(run)
    if channel is None or (abs(fastest) < DEGREES_FROM and (seconds is None or not winds(channel, seconds))):
        return None
    message = f"it turns with an angular.z of {significant(fastest)} on {channel.topic}, which is in radians a second"
    return Words(message, "a turn of 90 degrees is math.pi / 2, in radians: math.radians(90)")


def _let_go(run: Run, params: PathParams, course: Course | None = None) -> Words | None:
    """A robot that stops by itself between two messages, and would take the right way if it did not; with a `course`,
    one that is told each velocity once, and would come farther than that."""
    seconds = run_seconds(run)
    if seconds is None or not params.relative:
        return None
    for channel in run.student_channels():
        commands = [one._replace(time_s=seconds(time_ns)) for time_ns, one in commands_of(channel)]
        moves = [(a, b) for a, b in pairwise(commands) if a.speed or a.turn]
        longest_s = max((b.time_s - a.time_s for a, b in moves), default=0.0)
        if longest_s <= (params.hold_s or math.inf):
            continue
        held = driven(commands, None, commands[-1].time_s + STOPS_AFTER_S)
        other = followed(relative(held), params.way.points, params.tolerance_m)
        is_once = course is not None and len(moves) > 2 and all(a[1:] != b[1:] for a, b in moves)
        if other.done or (is_once and course is not None and other.reached > course.reached):
            again = f"{longest_s:.1f} s pass before the next message on {channel.topic}"
            why = f"the robot stops by itself: {again}, and a velocity holds for {significant(params.hold_s or 0)} s"
            hint = "publish the velocity again and again, ten times a second, for as long as it should drive or turn"
            return Words(why, hint)
    return None


def _by_other_clock(run: Run, params: PathParams, course: Course) -> Words | None:
    """A robot that keeps to its way, or comes farther, by the computer's clock and not by that of the run."""
    if run.warp == 1 or not params.relative or course.strayed is None:
        return None
    for channel in run.student_channels():
        commands = [one._replace(time_s=time_ns / 1e9) for time_ns, one in commands_of(channel)]
        held = driven(commands, params.hold_s, commands[-1].time_s + STOPS_AFTER_S) if commands else []
        other = followed(relative(held), params.way.points, params.tolerance_m)
        # Where it strays by that clock, too, it has to come farther by it.
        if other.reached >= course.reached + (other.strayed is not None):
            faster = f"{significant(run.warp)} times as fast in this run"
            return Words(
                "its way is right by the computer's clock (time.time(), time.sleep()), and not by the clock of ROS, "
                f"which is {faster}",
                "measure time with rospy.get_time(), and wait with rospy.sleep(…): a simulated robot has its own clock",
            )
    return None


class Words(NamedTuple):
    """What is wrong with a path, and what to do; `leg_m`: how long a leg is, and how far it drove there."""

    message: str
    hint: str
    leg_m: tuple[float, float] | None = None


class Way(NamedTuple):
    """The points of a rubric; `added` where the start was put before them."""

    points: tuple[Point, ...]
    tolerance_m: float
    added: bool

    def name(self, index: int) -> str:
        """`point 2 (2, 0)`, counted as the rubric counts."""
        if index == 0 and self.added:
            return "its start"
        return f"point {index + (0 if self.added else 1)} {spot(self.points[index])}"


def what_is_wrong(path: Sequence[Pose], way: Way, course: Course, *, mirror: bool) -> Words:
    """The likeliest cause; `mirror` where the way is seen from the path's own start."""
    return (
        (_explain_mirrored(path, way) if mirror else None)
        or _wrong_start(path, way, course)
        or (_turns_alike(path, way, course) if mirror else None)
        or _turns_while_driving(path, way, course)
        or _wrong_turn(path, way, course)
        or (_strays(path, way, course) if course.strayed is not None else _ends_short(path, way, course))
    )


def _explain_mirrored(path: Sequence[Pose], way: Way) -> Words | None:
    mirrored = "mirrored: it turns right instead of left"
    for x, y, how in (
        (1, -1, mirrored),
        (-1, -1, "driven backwards"),
        (-1, 1, "driven backwards and mirrored"),
    ):
        other = [p._replace(x=x * p.x, y=y * p.y) for p in path]
        if followed(other, way.points, way.tolerance_m).done:
            right = "angular.z turns to the left" if how is mirrored else "linear.x drives forward"
            return Words(f"the path is {how}", f"a positive {right}")
    return None


def _wrong_start(path: Sequence[Pose], way: Way, course: Course) -> Words | None:
    if course.reached:
        return None
    apart = metres(math.dist(path[0].point, way.points[0]))
    return Words(f"it starts at {spot(path[0].point)}, {apart} from {way.name(0)}", "bring it to the start")


def _wrong_turn(path: Sequence[Pose], way: Way, course: Course) -> Words | None:
    """By another angle than the way turns by, at the last point that it passed; or not at all from there on."""
    corner = course.reached - 1
    if not 0 < corner < len(way.points) - 1:
        return None
    before, here, goal = way.points[corner - 1 : corner + 2]
    # So far from the corner that the tolerance no longer blurs its direction.
    away_m = max(2 * way.tolerance_m, AWAY * math.dist(here, goal))
    behind = list(takewhile(lambda pose: math.dist(pose.point, here) < away_m, path[course.at :]))
    left = path[course.at + len(behind) :]
    on_its_way = [pose for pose in behind if left and math.dist(pose.point, left[0].point) >= away_m / 3]
    if not on_its_way:
        return None
    came, went, ahead = (
        _direction(before, here),
        _direction(on_its_way[-1].point, left[0].point),
        _direction(here, goal),
    )
    turned, asked = (math.degrees(math.remainder(angle - came, math.tau)) for angle in (went, ahead))
    if abs(math.remainder(turned - asked, 360)) < OTHER_TURN_DEG:
        return None
    name = way.name(corner)
    if abs(turned) < OTHER_TURN_DEG:
        end_deg = math.degrees(math.remainder(_direction(here, path[-1].point) - came, math.tau))
        if turned_rad(path[course.at :]) > TURNING_RAD or abs(end_deg) > OTHER_TURN_DEG:
            return None  # it turns later
        hint = "publish an angular.z that is not 0, for as long as it takes: an angle is angular.z times time"
        return Words(f"it drives straight on at {name}, and never turns", hint)
    right, hint = "driving straight on", "publish an angular.z of 0 there"
    if round(asked):
        right = f"{abs(asked):.0f}°{_side(asked)}"
        hint = f"turn by {abs(asked):.0f}° there: an angle is angular.z times time, and 180° are math.pi"
    return Words(f"at {name} it turns by {abs(turned):.0f}°{_side(turned)} instead of {right}", hint)


def _turns_alike(path: Sequence[Pose], way: Way, course: Course) -> Words | None:
    """By another angle than asked for, at each corner alike: with turns that are right, the path is the way."""
    if len(way.points) < 3:
        return None
    asked = math.remainder(_direction(*way.points[1:3]) - _direction(*way.points[:2]), math.tau)
    turned = first_turn(path)
    if turned * asked <= 0 or not SAME_TURN_DEG <= abs(math.degrees(turned - asked)) <= OTHER_TURN_DEG:
        return None
    right, heading, x, y = [path[0]], 0.0, path[0].x, path[0].y
    for a, b in pairwise(path):
        step = math.remainder(b.heading - a.heading, math.tau)
        # Each heading is scaled by `asked / turned`; that of a step, by its middle.
        off, heading = (asked / turned - 1) * (heading + step / 2), heading + step
        cos, sin, dx, dy = math.cos(off), math.sin(off), b.x - a.x, b.y - a.y
        x, y = x + dx * cos - dy * sin, y + dx * sin + dy * cos
        right.append(Pose(b.time_s, x, y))
    other = followed(right, way.points, way.tolerance_m)
    if not other.done and (other.reached <= course.reached or other.reached < len(way.points)):
        return None
    message = f"it turns by {abs(math.degrees(turned)):.0f}°{_side(math.degrees(turned))} each time, and "
    message += f"by {abs(math.degrees(asked)):.0f}° it would pass every point"
    hint = f"turn by {abs(math.degrees(asked)):.0f}°: an angle is angular.z times time, and 180° are math.pi"
    return Words(message, hint)


def _turns_while_driving(path: Sequence[Pose], way: Way, course: Course) -> Words | None:
    """Through a corner in an arc, behind a leg that it drove straight along."""
    corner = course.reached - 1
    if not 0 < corner < len(way.points) - 1 or abs(arc(path[: course.at], math.inf)[0]) > TURNING_RAD:
        return None
    before, here, goal = way.points[corner - 1 : corner + 2]
    asked = math.remainder(_direction(here, goal) - _direction(before, here), math.tau)
    turned, arc_m = arc(path[course.at :], abs(asked) - math.radians(OTHER_TURN_DEG))
    if arc_m <= way.tolerance_m or abs(turned - asked) > math.radians(OTHER_TURN_DEG):
        return None
    message = f"at {way.name(corner)} it turns while it drives on, in an arc {metres(arc_m)} long"
    return Words(message, "publish a linear.x of 0 for as long as it turns")


def _direction(start: Point, end: Point) -> float:
    return math.atan2(end[1] - start[1], end[0] - start[0])


def _side(turn_deg: float) -> str:
    return "" if abs(turn_deg) > HALF_TURN_DEG else " to the left" if turn_deg > 0 else " to the right"


def _strays(path: Sequence[Pose], way: Way, course: Course) -> Words:
    peak, far_m = _peak(path, way, course)
    where = f"at {spot(peak.point)}, {_after(path, peak)}"
    allowed = f"{significant(way.tolerance_m)} m are allowed"
    if course.reached == len(way.points):
        apart = metres(math.dist(peak.point, way.points[-1]))
        message = f"it passes every point, and goes on: it is {apart} from the last {where}"
        hint = f"publish a zero velocity once you are there; {allowed}"
        if _rests(path[course.at : course.strayed]):
            hint = "it stops there, and then drives another stretch: count those that the loop, or the calls, make"
        elif _rests(path[course.strayed :]):
            hint = f"it stops too late: publish the zero velocity sooner; {allowed}"
        return Words(message, hint)
    line = f"{way.name(course.reached - 1)} to {way.name(course.reached)}"
    return (
        _too_far(path, way, course)
        or _too_early(path, way, course)
        or Words(
            f"it strays {metres(far_m)} from the line from {line}, {where}",
            f"keep to the straight line from one point to the next: {allowed}",
        )
    )


def _rests(path: Sequence[Pose]) -> bool:
    """Return whether it stands anywhere for a while, or turns in place."""
    # Far from everywhere, so that the first pose begins the count.
    since = Pose(0.0, math.inf, math.inf)
    for pose in path:
        if math.dist(pose.point, since.point) > RESTS_M:
            since = pose
        elif pose.time_s - since.time_s >= STOPS_S:
            return True
    return False


def _too_far(path: Sequence[Pose], way: Way, course: Course) -> Words | None:
    """Straight on behind a point at which it should have turned."""
    first, corner = course.strayed or 0, course.reached - 1
    if corner < 1:
        return None
    start, end = way.points[corner - 1 : corner + 1]
    length_along = math.dist(start, end)
    beyond_m = 0.0
    for pose in path[first:]:
        along, aside = _along(pose.point, start, end)
        if along < length_along or abs(aside) > way.tolerance_m:
            break
        beyond_m = max(beyond_m, along - length_along)
    if not beyond_m:
        return None
    message = f"it drives {metres(beyond_m)} past {way.name(corner)}, {_after(path, path[first])}"
    hint = f"turn sooner: {significant(way.tolerance_m)} m are allowed; distance is speed times time"
    return Words(message, hint, (length_along, length_along + beyond_m))


def _too_early(path: Sequence[Pose], way: Way, course: Course) -> Words | None:
    """Off the line before its end, to the side where the way goes on."""
    if course.reached + 1 >= len(way.points):
        return None
    start, end, following = way.points[course.reached - 1 : course.reached + 2]
    pose = path[course.strayed or 0]
    along, aside = _along(pose.point, start, end)
    short_m = math.dist(start, end) - along
    if along <= 0 or short_m <= way.tolerance_m or aside * _along(following, start, end)[1] <= 0:
        return None
    message = f"it leaves the path {metres(short_m)} before {way.name(course.reached)}, {_after(path, pose)}"
    hint = "drive all the way to the point before you turn: distance is speed times time"
    return Words(message, hint, (short_m + along, along))


def _ends_short(path: Sequence[Pose], way: Way, course: Course) -> Words:
    goal = min(course.reached, len(way.points) - 1)
    left = metres(math.dist(path[-1].point, way.points[goal]))
    every = course.reached == len(way.points)
    points = "it passes every point" if every else f"it passes {course.reached} of {len(way.points)} points"
    message = f"{points} and ends at {spot(path[-1].point)}, {left} from {way.name(goal)}"
    if every:
        return Words(message, "publish a zero velocity once you are at the last point")
    if course.reached > 1 and math.dist(path[-1].point, way.points[goal - 1]) <= way.tolerance_m:
        hint = "go on from there: count the stretches of the handout, and keep the node alive for all"
        return Words(message, hint)
    return Words(message, "drive longer, or keep the node alive until it gets there")


def _peak(path: Sequence[Pose], way: Way, course: Course) -> tuple[Pose, float]:
    """Where it is farthest off, from where it strayed until it comes back to this part of the way."""
    index = min(course.reached, len(way.points) - 1)
    line = way.points[index - 1], way.points[index]
    peak, far_m = path[course.strayed or 0], 0.0
    for pose in path[course.strayed or 0 :]:
        distance_m = off_m(pose.point, *line)
        if distance_m <= way.tolerance_m:
            break
        if distance_m > far_m:
            peak, far_m = pose, distance_m
    return peak, far_m


def _along(point: Point, start: Point, end: Point) -> tuple[float, float]:
    """Return how far along the line through two points, and how far to the left of it (m)."""
    dx, dy = end[0] - start[0], end[1] - start[1]
    length = math.hypot(dx, dy)
    x, y = point[0] - start[0], point[1] - start[1]
    return (x * dx + y * dy) / length, (y * dx - x * dy) / length


def _after(path: Sequence[Pose], pose: Pose) -> str:
    return f"{max(0.0, pose.time_s - set_off_s(path)):.1f} s after it set off"


def measured(path: Sequence[Pose], course: Course, way: Way) -> str:
    """Return the figures of a path on one line."""
    off = metres(course.off_m) if course.strayed is None else metres(_peak(path, way, course)[1])
    return f"{off} off at most, {metres(length_m(path))} long, {course.reached} of {len(way.points)} points"
