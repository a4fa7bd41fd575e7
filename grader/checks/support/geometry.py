"""Paths and regions of the plane, and the walls that a run's simulator shows.

A path is read from a run's poses or added up from its velocities; what counts is how far it strays from points.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Annotated, Any, NamedTuple

from pydantic import Field

from grader.checks.support.clocks import run_seconds
from grader.checks.support.fields import FieldPath, NoField, values_at
from grader.checks.support.processes import observed_until_ns, plain_type
from grader.checks.support.topics import Sender, sent_by
from grader.evidence.run import Channel, Run
from grader.model.record import Record
from grader.wording import significant

SAMPLE_M = 0.02
SAMPLE_RAD = 0.2
SAMPLES_MAX = 2000
MEAN_S = 0.2

Point = tuple[float, float]
Polyline = tuple[Point, ...]
"""Straight from point to point."""
Coordinate = Annotated[float, Field(ge=-1e6, le=1e6)]
Spot = tuple[Coordinate, Coordinate]
TURNING_RAD = 0.1
"""A robot that turns by less stands still."""
TREMOR_RAD = 1e-3
"""A simulated robot that stands trembles by less."""
FASTEST = 1e6
MOVED_M = 0.01


class PoseFields(Record):
    """Where a message holds a position."""

    x: FieldPath
    """The field of x, in metres: `vector.x`."""
    y: FieldPath
    """The field of y, in metres."""
    heading: FieldPath | None = None
    """The field of the heading, in radians; null: none."""


class Pose(NamedTuple):
    """Metres and radians, at a time in seconds."""

    time_s: float
    x: float
    y: float
    heading: float = 0.0

    @property
    def point(self) -> Point:
        return self.x, self.y


class Command(NamedTuple):
    """A velocity in the robot's own frame: forward and left in m/s, to the left in rad/s."""

    time_s: float
    forward: float
    left: float
    turn: float

    @property
    def speed(self) -> float:
        return math.hypot(self.forward, self.left)


def moved(pose: Pose, command: Command, duration_s: float) -> Pose:
    """Return where a command leads in that time: exactly, along the arc that it describes."""
    half = command.turn * duration_s / 2
    # Straight on, the formula of the arc would divide by 0.
    chord = duration_s * (math.sin(half) / half if abs(half) > 1e-9 else 1.0)
    cos, sin = math.cos(pose.heading + half), math.sin(pose.heading + half)
    return Pose(
        pose.time_s + duration_s,
        pose.x + chord * (command.forward * cos - command.left * sin),
        pose.y + chord * (command.forward * sin + command.left * cos),
        pose.heading + 2 * half,
    )


def driven(commands: Sequence[Command], hold_s: float | None, end_s: float) -> list[Pose]:
    """Return the path from the origin, heading along x: each command holds until the next one, and at most `hold_s`.

    Without `hold_s` the last one holds until `end_s`.
    """
    path = [Pose(c.time_s, 0.0, 0.0) for c in commands[:1]]
    ends = [c.time_s for c in commands[1:]] + [end_s if hold_s is None else math.inf]
    for command, next_s in zip(commands, ends, strict=False):
        until_s = next_s if hold_s is None else min(next_s, command.time_s + hold_s)
        path += _samples(
            path[-1]._replace(time_s=command.time_s), command, max(0.0, until_s - command.time_s)
        )
    return path


def _samples(start: Pose, command: Command, duration_s: float) -> Iterator[Pose]:
    """Close enough to each other that no arc strays unseen between two of them."""
    # In place, one sample shows as much as many.
    turned = abs(command.turn) / SAMPLE_RAD if command.speed else 0.0
    steps = math.ceil(max(command.speed / SAMPLE_M, turned) * duration_s)
    # A velocity of any size must not fill the memory.
    count = min(SAMPLES_MAX, max(1, steps))
    for number in range(1, count + 1):
        yield moved(start, command, duration_s * number / count)


def relative(path: Sequence[Pose]) -> list[Pose]:
    """Return the path as seen from its first pose."""
    if not path:
        return []
    first = path[0]
    cos, sin = math.cos(first.heading), math.sin(first.heading)
    return [
        Pose(
            p.time_s,
            (p.x - first.x) * cos + (p.y - first.y) * sin,
            (p.y - first.y) * cos - (p.x - first.x) * sin,
            p.heading - first.heading,
        )
        for p in path
    ]


def stands(path: Sequence[Pose]) -> bool:
    """Return whether it never left its place."""
    return all(math.dist(p.point, path[0].point) <= MOVED_M for p in path)


def turned_rad(path: Sequence[Pose], last_s: float = math.inf) -> float:
    """Return by how much it turned in the last seconds, to either side."""
    recent = [pose.heading for pose in path if pose.time_s >= path[-1].time_s - last_s]
    turned, heading = 0.0, recent[0]
    for now in recent:
        # The short way round, as a heading jumps by a full turn.
        step = abs(math.remainder(now - heading, math.tau))
        if step > TREMOR_RAD:
            turned, heading = turned + step, now
    return turned


def set_off_s(path: Sequence[Pose]) -> float:
    """Return when it left its first place, or else when the path begins (s)."""
    return next((p for p in path if math.dist(p.point, path[0].point) > MOVED_M), path[0]).time_s


def length_m(path: Sequence[Pose]) -> float:
    return sum(math.dist(a.point, b.point) for a, b in pairwise(path))


def top_speeds(path: Sequence[Pose]) -> tuple[float, float]:
    """Return the highest speed (m/s) and turn (rad/s), each over a time long enough for a mean."""
    speed = turn = 0.0
    first = path[0] if path else None
    for pose in path:
        if first is not None and (lasted := pose.time_s - first.time_s) >= MEAN_S:
            turned = math.remainder(pose.heading - first.heading, math.tau)
            speed = max(speed, math.dist(pose.point, first.point) / lasted)
            turn, first = max(turn, abs(turned) / lasted), pose
    return speed, turn


SAME_M, RESTS_M_S, TURNS_RAD_S = 0.005, 0.01, 0.03
AWAY, AWAY_LEAST, AIMED_DEG, BEHIND_DEG = 0.8, 5, 10.0, 170.0
"""At this share of at least so many places it turns away from a point that is neither ahead of it nor behind."""


def aside(pose: Pose, goal: Point) -> float:
    """Return where a point is, seen from the robot (rad, to the left); 0 where it is ahead or behind."""
    angle = math.remainder(math.atan2(goal[1] - pose.y, goal[0] - pose.x) - pose.heading, math.tau)
    return angle if AIMED_DEG < abs(math.degrees(angle)) < BEHIND_DEG else 0.0


def turns_away(places: Sequence[tuple[Pose, float]], told: Sequence[Command]) -> tuple[str, str] | None:
    """Return to which side it is told to turn, and on which the point is, where it is nearly always the other one.
    Each of the `places` has where the point is `aside` from there."""
    away, index = [], 0
    for pose, side in places if told else ():
        while index + 1 < len(told) and told[index + 1].time_s <= pose.time_s:
            index += 1
        if told[index].turn and side and told[index].time_s <= pose.time_s:
            away.append(side if side * told[index].turn < 0 else 0.0)
    if len(away) < AWAY_LEAST or sum(map(bool, away)) < AWAY * len(away):
        return None
    to_right = sum(one > 0 for one in away) * 2 >= sum(map(bool, away))
    return ("right", "left") if to_right else ("left", "right")


def off_m(point: Point, start: Point, end: Point) -> float:
    """Return the distance of a point from the line between two others."""
    dx, dy = end[0] - start[0], end[1] - start[1]
    square = dx * dx + dy * dy
    share = ((point[0] - start[0]) * dx + (point[1] - start[1]) * dy) / square if square else 0.0
    share = min(1.0, max(0.0, share))
    return math.dist(point, (start[0] + share * dx, start[1] + share * dy))


STANDS_M, RESTS_M = 0.01, 0.001
"""How far a robot that turns in place goes for each radian, and one that rests."""


def first_turn(path: Sequence[Pose]) -> float:
    """Return by how much it turns in place, to the left (rad), the first time that it does."""
    turned = 0.0
    for a, b in pairwise(path):
        if math.dist(a.point, b.point) <= RESTS_M:
            turned += math.remainder(b.heading - a.heading, math.tau)
        elif abs(turned) > TURNING_RAD:
            break
        else:
            turned = 0.0
    return turned


def arc(path: Sequence[Pose], enough_rad: float) -> tuple[float, float]:
    """Return by how much it turned while it drove, to the left (rad), and how far (m), until it has turned enough."""
    turned = arc_m = 0.0
    for a, b in pairwise(path):
        step, step_m = math.remainder(b.heading - a.heading, math.tau), math.dist(a.point, b.point)
        if step and step_m > abs(step) * STANDS_M:
            turned, arc_m = turned + step, arc_m + step_m
        if abs(turned) >= enough_rad:
            break
    return turned, arc_m


class Course(NamedTuple):
    """How a path follows a way of several points.

    `reached` is how many of the points it passed, in order, and `at` the index of its first pose at the last of them;
    `strayed` the index of its first pose that is too far from the way there, None where none is; `off_m` the largest
    distance from the way, up to then. `done` is set where it passed them all and ends at the last.
    """

    reached: int
    strayed: int | None
    off_m: float
    at: int = 0
    done: bool = False


def followed(path: Sequence[Pose], points: Sequence[Point], tolerance_m: float) -> Course:
    """Follow the way along the path: within the tolerance of each point, and of the line between two of them.

    A pose may belong to more than one leg, near a corner or where the way crosses itself: all are followed.
    """
    legs = list(pairwise(points))
    if not path or not math.dist(path[0].point, points[0]) <= tolerance_m:
        return Course(0, 0 if path else None, 0.0)
    on, reached, at, largest = {0}, 1, 0, 0.0
    for index, pose in enumerate(path):
        near = {leg: d for leg in on if (d := off_m(pose.point, *legs[leg])) <= tolerance_m}
        if not near:
            return Course(reached, index, largest, at)
        largest = max(largest, min(near.values()))
        on = set(near)
        # `on` grows in the loop: one pose may pass several points that are close together.
        for leg in range(min(on), len(legs)):
            if leg in on and math.dist(pose.point, legs[leg][1]) <= tolerance_m:
                at = index if leg + 2 > reached else at
                reached = max(reached, leg + 2)
                on |= {leg + 1} & set(range(len(legs)))
    last = len(legs) - 1
    done = last in on and math.dist(path[-1].point, points[-1]) <= tolerance_m
    return Course(reached, None, largest, at, done)


class Track(NamedTuple):
    """The path, or why the messages tell of none: `misfit` if they are of another type, `fault` if they are bad."""

    path: tuple[Pose, ...] = ()
    misfit: str = ""
    fault: str = ""


def track(
    run: Run,
    topic: str,
    hold_s: float | None,
    fields: PoseFields | None = None,
    of: Sender | None = None,
) -> Track | None:
    """Return the path told on a topic, None where no message came (or, in a warped run, no clock)."""
    seconds = run_seconds(run)
    channels = [c for c in sent_by(run, topic, of) if c.messages] if of else _publishers(run, topic, fields)
    pairs = sorted(
        (pair for c in channels for pair in zip(c.times_ns, c.values, strict=True)), key=lambda pair: pair[0]
    )
    if not pairs or seconds is None:
        return None
    poses = [p for t, value in pairs if (p := _pose(seconds(t), value, fields))]
    commands = [c for t, value in pairs if not fields and (c := _command(seconds(t), value))]
    if len(poses) < len(pairs) and len(commands) < len(pairs):
        return Track(misfit=f"are {plain_type(channels[0].type)}: neither velocities nor poses")
    if not all(_finite(*one[1:]) for one in (*poses, *commands)):
        return Track(fault="hold values that are not numbers, or that no robot could follow")
    if poses:
        return Track(tuple(poses))
    return Track(tuple(driven(commands, hold_s, seconds(observed_until_ns(run) or run.end_ns))))


def _publishers(run: Run, topic: str, fields: PoseFields | None) -> list[Channel]:
    """A simulator that the rubric starts knows the pose; otherwise the student's nodes count."""
    channels = [c for c in run.channels if c.topic == topic and c.messages and not c.by_grader]
    simulated = [c for c in channels if c.callerid in run.grader_nodes and _pose(0, c.values[0], fields)]
    return simulated or [c for c in channels if run.is_student_node(c.callerid)]


def _pose(time_s: float, message: Any, fields: PoseFields | None) -> Pose | None:  # noqa: ANN401 - decoded messages hold anything
    """`x` and `y` at the top (turtlesim/Pose, geometry_msgs/Pose2D) or in `pose`s (also nav_msgs/Odometry)."""
    if fields is not None:
        return _pose_at(time_s, message, fields)
    # In an Odometry, the pose is in another one.
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


def _pose_at(time_s: float, message: Any, fields: PoseFields) -> Pose | None:  # noqa: ANN401 - as above
    paths = [path for path in (fields.x, fields.y, fields.heading) if path is not None]
    try:
        (x,), (y,), *heading = (values_at(message, path) for path in paths)
    except (NoField, ValueError):
        return None
    numbers = (x, y, *(heading[0] if heading else ()))
    return Pose(time_s, *numbers) if all(isinstance(one, int | float) for one in numbers) else None


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


def commands_of(channel: Channel) -> list[tuple[int, Command]]:
    """Return when (ns) each velocity was sent on a topic, and what it was; none for messages of another kind."""
    pairs = zip(channel.times_ns, channel.values, strict=True) if "Twist" in channel.type else ()
    commands = ((time_ns, _command(0.0, message)) for time_ns, message in pairs)
    return [(t, one) for t, one in commands if one is not None and _finite(one.forward, one.left, one.turn)]


WOUND_RAD = 40.0
"""More than six times around: no robot turns by that at a corner, and its degrees come to that."""


def winds(channel: Channel, seconds: Callable[[int], float]) -> bool:
    """Whether velocities turn a robot on the spot many times around, twice or more, and drive it in between."""
    corners, turned = 0, 0.0
    for (here_ns, one), (next_ns, _) in pairwise(commands_of(channel)):
        if one.speed:
            corners, turned = corners + (turned > WOUND_RAD), 0.0
        else:
            turned += abs(one.turn) * (seconds(next_ns) - seconds(here_ns))
    return corners + (turned > WOUND_RAD) > 1


def other_axis(channel: Channel) -> str:
    """Return the axis other than z (`angular.x`) around which velocities on a topic turn; "" where there is none."""
    values = channel.values if "Twist" in channel.type else ()
    twists = [one.get("twist", one) for one in values if isinstance(one, Mapping)]
    turns = [one["angular"] for one in twists if isinstance(one.get("angular"), Mapping)]
    if any(turn["z"] for turn in turns):
        return ""
    return next((f"angular.{axis}" for axis in "xy" if any(turn[axis] for turn in turns)), "")


def has_no_numbers(channel: Channel) -> bool:
    """Return whether a velocity on a topic is nan or inf."""
    sent = (_command(0.0, one) for one in channel.values) if "Twist" in channel.type else ()
    parts = (part for one in sent if one is not None for part in (one.forward, one.left, one.turn))
    return not all(map(math.isfinite, parts))


def _finite(*values: float) -> bool:
    return all(math.isfinite(value) and abs(value) < FASTEST for value in values)


MARKER, LINE_STRIP, LINE_LIST = "visualization_msgs/Marker", 4, 5
WALLS_MAX = 2_000
"""Of one run; a map has fewer."""


class Area(NamedTuple):
    """What an outline encloses; its last point is joined to the first."""

    outline: Polyline
    words: str

    def out_m(self, point: Point) -> float:
        """Return how far outside a point is (m); 0 inside."""
        return 0.0 if self._holds(point) else nearest_m(point, [(*self.outline, self.outline[0])])

    def _holds(self, point: Point) -> bool:
        """Count the sides that a ray to the right crosses."""
        x, y = point
        inside = False
        for (x0, y0), (x1, y1) in pairwise((*self.outline, self.outline[0])):
            if (y0 > y) != (y1 > y) and x < x0 + (x1 - x0) * (y - y0) / (y1 - y0):
                inside = not inside
        return inside


class Band(NamedTuple):
    """At least `min_m` and at most `max_m` from the nearest of some lines and points."""

    walls: Sequence[Polyline]
    min_m: float | None
    max_m: float | None
    outline: Polyline = ()

    @property
    def words(self) -> str:
        what = "a wall" if any(len(wall) > 1 for wall in self.walls) else "a point"
        if self.max_m is None:
            return f"at least {significant(self.min_m or 0)} m from {what}"
        if self.min_m is None:
            return f"at most {significant(self.max_m)} m from {what}"
        return f"{significant(self.min_m)} to {significant(self.max_m)} m from {what}"

    def out_m(self, point: Point) -> float:
        distance_m = self.nearest_m(point)
        over_m = distance_m - self.max_m if self.max_m is not None else 0.0
        return max(0.0, over_m, (self.min_m or 0.0) - distance_m)

    def nearest_m(self, point: Point) -> float:
        """Return how far the nearest of the lines and points is (m)."""
        return nearest_m(point, self.walls)

    def kept_m(self, path: Sequence[Pose]) -> float | None:
        """Return how far away a path mostly is (m); None where that varies by more than this is wide."""
        far = sorted(self.nearest_m(pose.point) for pose in path)
        quarter = len(far) // 4
        wide_m = (self.max_m or 0.0) - (self.min_m or 0.0)
        return far[len(far) // 2] if far[-1 - quarter] - far[quarter] <= wide_m else None

    def towards(self, pose: Pose) -> Point:
        """Return a point beside the robot, where it is nearer to the nearest of the lines and points."""
        (x, y), off = pose.point, SAME_M
        dx = self.nearest_m((x - off, y)) - self.nearest_m((x + off, y))
        dy = self.nearest_m((x, y - off)) - self.nearest_m((x, y + off))
        return x + dx, y + dy


Region = Area | Band
"""Where a robot may be: `words` say it, `out_m` is how far outside a point is, `outline` is a border to be drawn."""


def out_along(path: Sequence[Pose], region: Region) -> list[float]:
    """Return how far outside each pose is (m); half a centimetre is still inside, and is 0."""
    out: list[float] = []
    at: Point | None = None
    for pose in path:
        # A robot that hardly moved is as far outside as before, and to look through all walls takes time.
        if at is None or math.dist(pose.point, at) > SAME_M:
            at, far_m = pose.point, region.out_m(pose.point)
        out.append(far_m if far_m > SAME_M else 0.0)
    return out


def share_inside(path: Sequence[Pose], out: Sequence[float]) -> float:
    """Return the share of the time in which it was inside."""
    lasted = [b.time_s - a.time_s for a, b in pairwise(path)]
    whole_s = sum(lasted)
    # All at one moment: there is no time to share out, so poses are counted.
    if whole_s <= 0:
        return sum(not far for far in out) / len(out)
    return 1.0 if not any(out) else sum(s for s, far in zip(lasted, out, strict=False) if not far) / whole_s


def rests_along(path: Sequence[Pose]) -> list[float]:
    """Return 1 for each pose from which it does not drive on at once, and 0 for the others."""
    return [
        float(math.dist(a.point, b.point) <= RESTS_M_S * (b.time_s - a.time_s)) for a, b in pairwise(path)
    ] + [0.0]


def circles(path: Sequence[Pose], out: Sequence[float]) -> float:
    """Return how often it drove around while it was outside, where it turned to one side nearly all that time."""
    turns = [
        (math.remainder(b.heading - a.heading, math.tau), b.time_s - a.time_s)
        for (a, far), (b, _) in pairwise(zip(path, out, strict=True))
        if far and math.dist(a.point, b.point) > RESTS_M_S * (b.time_s - a.time_s)
    ]
    whole = math.fsum(turn for turn, _ in turns)
    alike = sum(turn * math.copysign(1.0, whole) > TURNS_RAD_S * time_s for turn, time_s in turns)
    return abs(whole) / math.tau if alike >= AWAY * len(turns) else 0.0


CIRCLE_M, OFTEN = 1.0, 1.5


def circling(path: Sequence[Pose], band: Band) -> tuple[list[Pose], float]:
    """Return the end of a path that stays near its last place, and how often it drives around there; nothing where
    that is seldom, or where it drives around a wall or a point."""
    near = next(
        (i for i, p in enumerate(reversed(path)) if math.dist(p.point, path[-1].point) > CIRCLE_M), len(path)
    )
    end = _from_first_turn(path[len(path) - near :])
    around = circles(end, [1.0] * len(end))
    has_inside = any(abs(_sweep(end, point)) > math.tau for wall in band.walls for point in wall)
    return (end, around) if around > OFTEN and not has_inside else ([], 0.0)


def _from_first_turn(path: Sequence[Pose]) -> list[Pose]:
    """Return a path without the straight way by which it came."""
    steps = (
        (math.remainder(b.heading - a.heading, math.tau), b.time_s - a.time_s) for a, b in pairwise(path)
    )
    first = next((i for i, (turn, time_s) in enumerate(steps) if abs(turn) > TURNS_RAD_S * time_s), 0)
    return list(path[first:])


def _sweep(path: Sequence[Pose], point: Point) -> float:
    """Return by how much the direction from a point to the robot turns along its path (rad)."""
    seen = [math.atan2(pose.point[1] - point[1], pose.point[0] - point[0]) for pose in path]
    return math.fsum(math.remainder(b - a, math.tau) for a, b in pairwise(seen))


def nearest_m(point: Point, lines: Sequence[Polyline]) -> float:
    """Return the distance from a point to the nearest of the lines, of which some may be single points."""
    sides = (side for line in lines for side in (pairwise(line) if len(line) > 1 else [(line[0], line[0])]))
    return min((off_m(point, *side) for side in sides), default=math.inf)


def shown_walls(run: Run) -> tuple[Polyline, ...]:
    """Return the walls that a program of the grader's shows to RViz: the lines of its visualization_msgs/Marker."""
    channels = [
        c
        for c in run.channels
        if c.callerid in run.grader_nodes and plain_type(c.type) == MARKER and c.messages
    ]
    walls = [wall for channel in channels for wall in _lines(channel.values[-1])]
    return tuple(walls[:WALLS_MAX])


def _lines(marker: Any) -> Iterator[Polyline]:  # noqa: ANN401 - decoded messages hold anything
    if not isinstance(marker, Mapping):
        return
    points = tuple((float(p["x"]), float(p["y"])) for p in marker["points"])
    if not all(math.isfinite(number) for point in points for number in point):
        return
    if marker["type"] == LINE_LIST:
        yield from zip(points[::2], points[1::2], strict=False)
    elif marker["type"] == LINE_STRIP and points:
        yield points
