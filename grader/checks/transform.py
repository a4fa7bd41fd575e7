"""Whether the package sends a transform between two frames, and the right one."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, NamedTuple

from pydantic import Field, model_validator

from grader.checks.registry import Refers, check
from grader.checks.support.clocks import clock_slack_s, excused, no_clock, run_seconds, why_late
from grader.checks.support.frames import (
    NO_LENGTH,
    TOPICS,
    Frame,
    Sent,
    Transform,
    Tree,
    Vector,
    pose_in,
    sent_on,
    turn_of,
)
from grader.checks.support.processes import GlobalName, observed_until_ns
from grader.checks.support.text import RATE, near_names, shown
from grader.checks.support.topics import cite, no_message, no_node, run_slip
from grader.evidence.run import Run
from grader.model.package import PackageFacts
from grader.model.record import Record
from grader.model.verdict import Verdict, failed, grade_again, passed
from grader.wording import join_words, plural, significant

HALF_TURN_DEG = 179.0
"""A 1.0 in x, y or z of a quaternion, in place of w, turns by more."""
ORDER_S = 0.1
"""Two topics come over two connections: so much earlier a transform may be recorded than the pose that it follows."""
RECENT = 4
"""Poses that a transform may be of."""
HALVED = "`z` is the sine of half the yaw, and `w` the cosine of half of it"
FEW = 3
"""So many transforms may be the same for the machine's sake; more were never changed."""


class TransformParams(Record):
    """The transform from `parent` to `child`, and what it has to be: a value, or the pose on a topic."""

    parent: Frame
    """`header.frame_id`, without a slash: `base_link`."""
    child: Frame
    """`child_frame_id`, without a slash: `laser`."""
    translation: Vector | None = None
    """x, y and z, in metres."""
    rotation_deg: Vector | None = None
    """Roll, pitch and yaw, in degrees."""
    pose_of: Annotated[GlobalName, Refers("heard")] | None = None
    """A topic with poses that the transform follows: `geometry_msgs/Pose` (also in PoseStamped or Odometry), or a
    message with x, y and theta (`turtlesim/Pose`).
    """
    within_s: Annotated[float, Field(gt=0)] = 0.3
    """How old the transform's pose may be."""
    tolerance_m: Annotated[float, Field(ge=0)] = 0.01
    """How far the translation may be off."""
    tolerance_deg: Annotated[float, Field(ge=0)] = 1.0
    """How far the rotation may be off."""
    static: bool | None = None
    """Whether it has to be on `/tf_static`, or must not be; null: either."""
    min_hz: Annotated[float, Field(gt=0)] | None = None
    """The least rate at which it has to be sent."""
    through: bool = False
    """Whether it may lead through other frames, including those of the grader's `transform` steps."""

    @model_validator(mode="after")
    def _one_value(self) -> TransformParams:
        if self.pose_of is not None and (self.translation or self.rotation_deg):
            raise ValueError("give pose_of, or translation and rotation_deg")
        if self.parent == self.child:
            raise ValueError(f"parent and child are both {self.child}")
        if self.static and (self.pose_of is not None or self.min_hz is not None):
            key = "pose_of" if self.pose_of is not None else "min_hz"
            raise ValueError(f"{key} is not for a static transform: it is sent once, and stays")
        return self

    @property
    def name(self) -> str:
        return f"the transform from {self.parent} to {self.child}"


class Seen(NamedTuple):
    """The transform at one time."""

    time_ns: int
    value: Transform | None
    length: float = 1.0


@check("transform", params=TransformParams, messages_only=True, of_callbacks=True)
def transform(package: PackageFacts, run: Run, params: TransformParams) -> Verdict:
    """The transform between two frames is sent, and right.

    What it checks
        That the package sends the transform from the parent frame to the child frame, with the right
        translation and rotation, or following the poses on a topic; and, if the handout asks for that, on
        `/tf_static` or often enough.

    Why it matters on a robot
        Every measurement is placed by these transforms. With parent and child swapped, or degrees in place of
        radians, an obstacle in front of the robot is drawn behind it.

    How it is measured
        Each transform on `/tf` and `/tf_static` is compared within the tolerances. When a transform that
        follows poses is sent, it has to equal a pose of the last `within_s` seconds, or the newest one. A path
        through other frames is combined as tf does it.

    How to fix
        `header.frame_id` is the parent and `child_frame_id` the child; the translation is the child's place seen
        from the parent. `rosrun tf tf_echo <parent> <child>` shows it.
    """
    own = sent_on(run.student_channels())
    seen = _seen_transforms(run, own, params)
    verdict = (
        _never_called(package, run, own, params)
        or _not_sent(package, run, own, seen, params)
        or _other_topic(own, params)
        or _no_rotation(seen, params)
        or _other_value(seen, params)
        or (_strays(run, seen, params) if params.pose_of else None)
        or _too_seldom(run, seen, params)
        or passed(f"{params.name} is right in {plural(len(seen), 'message')}")
    )
    topics = dict.fromkeys(one.topic for one in own) or (TOPICS[1] if params.static else TOPICS[0],)
    measured = verdict.measured or _measured_text(seen, own)
    cited = tuple(cite(run, topic) for topic in topics)
    return verdict.about(expected=_expected_text(params), measured=measured, citations=cited)


def _seen_transforms(run: Run, own: Sequence[Sent], params: TransformParams) -> list[Seen]:
    """Return the transform each time that it was sent, or that one of its path was."""
    if not params.through:
        return [
            Seen(s.time_ns, s.value, s.length)
            for s in own
            if (s.parent, s.child) == (params.parent, params.child)
        ]
    every = sent_on(run.channels)
    tree = Tree(every)
    found = [Seen(one.time_ns, tree.lookup(params.parent, params.child, one.time_ns)) for one in every]
    return [one for one in found if one.value is not None]


def _edges(own: Sequence[Sent]) -> list[tuple[str, str]]:
    return list(dict.fromkeys((one.parent, one.child) for one in own))


def _edge_words(edges: Sequence[tuple[str, str]]) -> str:
    return shown(join_words([f"{parent} → {child}" for parent, child in edges]))


def _never_called(
    package: PackageFacts, run: Run, own: Sequence[Sent], params: TransformParams
) -> Verdict | None:
    """Return the verdict where nothing is sent of the child, and something is defined that nothing calls."""
    slip = run_slip(package, run, "never-called")
    if slip is None or not own or any(params.child in {one.parent, one.child} for one in own):
        return None
    message = f"{params.name} is not sent: {slip.message} (line {slip.line} of {slip.file})"
    return failed(message, hint=f"call `{slip.name}()` where it should be sent", citations=(slip.place,))


def _not_sent(
    package: PackageFacts, run: Run, own: Sequence[Sent], seen: Sequence[Seen], params: TransformParams
) -> Verdict | None:
    if seen:
        return None
    if not own:
        return no_message(package, run, TOPICS[1] if params.static else TOPICS[0])
    edges, wanted = _edges(own), (params.parent, params.child)
    hint = f"header.frame_id = '{params.parent}', child_frame_id = '{params.child}'"
    if wanted[::-1] in edges:
        message = f"{params.name} is sent the other way round: {params.child} is the parent, {params.parent} the child"
        return _swapped_there(package, failed(message, hint=hint), wanted)
    slashed = [edge for edge in edges if tuple(name.lstrip("/") for name in edge) == wanted]
    if slashed:
        message = f"the frames are {_edge_words(slashed)}: tf2 takes no frame names that start with a slash"
        return failed(message, hint=hint)
    if params.through:
        path = [one.parent for one in Tree(sent_on(run.channels)).path(params.child, run.end_ns)]
        up = (
            f"{params.child} leads up to {shown(path[-1])}"
            if path
            else f"nothing is sent about {params.child}"
        )
        message = f"{params.parent} and {params.child} are not connected: {up}; there is {_edge_words(edges)}"
        return failed(message, hint="every frame has one parent: send the one that is missing in between")
    names = {name for edge in edges for name in edge}
    near = [
        f"{wrong} for {name}" for name in wanted if name not in names for wrong in near_names(name, names)
    ]
    ended = None if near else no_node(package, run, f"{params.name} is not sent")
    other = f" ({shown(join_words(near))})" if near else ""
    instead = _frames_instead(edges, wanted)
    meant = [(one, name) for one in instead for name in near_names(one, wanted)]
    if len(instead) == len(meant) == 1:
        hint = "write '{1}' in place of '{0}'".format(*meant[0])
    verdict = failed(f"{params.name} is not sent; there is {_edge_words(edges)}{other}", hint=hint)
    return ended or verdict.seeking("quoted", *instead)


def _swapped_there(package: PackageFacts, verdict: Verdict, wanted: tuple[str, str]) -> Verdict:
    """Return the verdict with the line on which a frame is given for the other one, if there is only one such line."""
    fields = [s for s in package.slips if s.kind == "wrong-value" and s.name == "frames"]
    named = [s for s in package.slips if s.kind == "frames" and (s.name, s.message) == wanted]
    if len(fields) == 1:
        one = fields[0]
        why = f"line {one.line} of {one.file}: {one.message}"
        return verdict.explained(why, f"in {one.file}, {one.fix}", (one.place,), cause=one.message)
    if len(named) != 1:
        return verdict
    one = named[0]
    where = one.fix or f"line {one.line}"
    hint = f"on {where} of {one.file}, swap '{wanted[0]}' and '{wanted[1]}'"
    return verdict.explained(f"see line {one.line} of {one.file}", hint, (one.place,))


def _frames_instead(edges: Sequence[tuple[str, str]], wanted: tuple[str, str]) -> list[str]:
    """Return the frames in place of the wanted one, in transforms that have the other."""
    pairs = [(edge, at) for edge in edges for at in (0, 1) if edge[at] == wanted[at]]
    return list(dict.fromkeys(edge[1 - at] for edge, at in pairs))


def _other_topic(own: Sequence[Sent], params: TransformParams) -> Verdict | None:
    pair = (params.parent, params.child)
    topics = {one.topic for one in own if (one.parent, one.child) == pair}
    wrong = TOPICS[0] if params.static else TOPICS[1]
    if params.static is None or wrong not in topics:
        return None
    kind = "StaticTransformBroadcaster" if params.static else "TransformBroadcaster"
    why = (
        "it never changes"
        if params.static
        else "it changes, but tf treats a static transform as valid for all time"
    )
    message = f"{params.name} is on {wrong}, but belongs on {TOPICS[1 if params.static else 0]}: {why}"
    return failed(message, hint=f"send it with a tf2_ros.{kind}")


def _no_rotation(seen: Sequence[Seen], params: TransformParams) -> Verdict | None:
    wrong = [one for one in seen if one.value is None]
    if not wrong:
        return None
    message = (
        f"the rotation of {params.name} is not a rotation in {len(wrong)} of {plural(len(seen), 'message')}"
    )
    hint = "a quaternion without rotation has w = 1.0; quaternion_from_euler(roll, pitch, yaw) gives others"
    length = wrong[0].length
    if length > NO_LENGTH and math.isfinite(length):
        why = f"the length of its quaternion is {significant(length)} and not 1, so that tf ignores it"
        fix = "x, y, z and w are no angles, and belong together: quaternion_from_euler(roll, pitch, yaw) gives all four"
        return failed(f"{message}: {why}", hint=fix)
    return failed(f"{message}: its quaternion is 0, or contains something that is not a number", hint=hint)


def _fits(value: Transform, wanted: Transform, params: TransformParams) -> bool:
    metres, degrees = value.apart(wanted)
    # A tolerance of 0 still allows for the rounding of floats.
    return metres <= params.tolerance_m + 1e-6 and degrees <= params.tolerance_deg + 1e-3


def _wanted_transform(value: Transform, params: TransformParams) -> Transform:
    """Return the transform as asked for; what is not asked for is as it is."""
    turn = value.turn if params.rotation_deg is None else turn_of(params.rotation_deg)
    return Transform(params.translation or value.at, turn)


def _other_value(seen: Sequence[Seen], params: TransformParams) -> Verdict | None:
    values = [one.value for one in seen if one.value is not None]
    wrong = [value for value in values if not _fits(value, _wanted_transform(value, params), params)]
    if not wrong or params.pose_of:
        return None
    value, wanted = wrong[0], _wanted_transform(wrong[0], params)
    count = f"in {len(wrong)} of {plural(len(seen), 'message')}"
    hint = "the translation is in metres, and the angles of quaternion_from_euler in radians"
    metres, degrees = value.apart(wanted)
    if degrees > HALF_TURN_DEG and not any(wanted.rpy_deg) and metres <= params.tolerance_m:
        hint = "a quaternion without rotation has w = 1.0, and 0 in x, y and z"
    why = _why(value, wanted, params)
    message = f"{params.name} is wrong {count}{why}; it is {_text(value)}, not {_text(wanted)}"
    return failed(message, hint=_axes(value, wanted, params)[1] or hint)


def _why(value: Transform, wanted: Transform, params: TransformParams) -> str:
    if _fits(value.inverse, wanted, params):
        return f": it is the one from {params.child} to {params.parent}"
    # As if the number of degrees had been given as radians.
    as_degrees = turn_of([math.degrees(angle) for angle in wanted.rpy_deg])
    if any(wanted.rpy_deg) and _fits(value, Transform(value.at, as_degrees), params):
        return ": its angles are in degrees instead of radians"
    metres, degrees = value.apart(wanted)
    if metres <= params.tolerance_m:
        return f": the rotation is off by {degrees:.0f}°"
    if axes := _axes(value, wanted, params)[0]:
        return f": {axes}"
    return ": the rotation is right" if degrees <= params.tolerance_deg else ""


def _axes(value: Transform, wanted: Transform, params: TransformParams) -> tuple[str, str]:
    """Return which axes of the translation are swapped or turned around, and how to write them; empty if none is."""
    x, y, z = value.at

    def fits(at: Vector) -> bool:
        near = math.dist(value.at, wanted.at) > params.tolerance_m
        return near and math.dist(at, wanted.at) <= params.tolerance_m + 1e-6

    for first, second, at in (("x", "y", (y, x, z)), ("x", "z", (z, y, x)), ("y", "z", (x, z, y))):
        if fits(at):
            hint = f"translation.{first} is {first}, and translation.{second} is {second}: see their order"
            return f"its {first} and {second} are swapped", hint
    for axis, at in (("x", (-x, y, z)), ("y", (x, -y, z)), ("z", (x, y, -z))):
        if fits(at):
            return f"its {axis} has the wrong sign", "x points forward, y to the left and z up"
    return "", ""


def _text(value: Transform) -> str:
    # Adding 0 makes 0.00 of -0.00.
    at = ", ".join(f"{round(v, 2) + 0.0:.2f}" for v in value.at)
    return f"({at}) m and ({', '.join(f'{round(v)}' for v in value.rpy_deg)})°"


def _poses(run: Run, topic: str) -> list[tuple[int, Transform]]:
    found = [
        (t, pose)
        for c in run.channels
        if c.topic == topic
        for t, value in zip(c.times_ns, c.values, strict=True)
        if (pose := pose_in(value)) is not None
    ]
    return sorted(found, key=lambda one: one[0])


def _strays(run: Run, seen: Sequence[Seen], params: TransformParams) -> Verdict | None:
    poses, to_s = _poses(run, params.pose_of or ""), run_seconds(run)
    if not poses or to_s is None:
        return no_clock(run) or grade_again(f"no pose came on {params.pose_of}")
    slack_s = params.within_s + clock_slack_s(run)
    order_s, timed = ORDER_S * run.warp, [(to_s(t), pose) for t, pose in poses]
    # Before that, the first pose need not have been followed yet.
    from_s = timed[0][0] + slack_s
    judged = [(t, value) for t, value, _ in seen if value is not None and to_s(t) >= from_s]
    wrong = [
        (t, value)
        for t, value in judged
        if not any(_fits(value, pose, params) for pose in _candidates(to_s(t), timed, slack_s, order_s))
    ]
    if wrong:
        return _wrong_pose(run, wrong, judged, poses, params)
    until_s, last_s = to_s(observed_until_ns(run) or run.end_ns), timed[-1][0]
    # Too near to the end, the last pose need not have been followed.
    if until_s - last_s < slack_s or any(to_s(one.time_ns) >= last_s - order_s for one in seen):
        return None
    message = f"{params.name} was no longer sent after the last pose on {params.pose_of}"
    verdict = failed(message, hint=f"send it in the callback of {params.pose_of}").if_repeated()
    return excused(verdict, run, poses[0][0], run.end_ns, why_late)


def _candidates(
    at_s: float, poses: Sequence[tuple[float, Transform]], slack_s: float, order_s: float
) -> list[Transform]:
    # The last pose stays right for as long as no other comes, however long that is.
    last_s = max((t for t, _ in poses if t <= at_s), default=at_s)
    return [pose for t, pose in poses if min(at_s - slack_s, last_s) <= t <= at_s + order_s]


def _wrong_pose(
    run: Run,
    wrong: Sequence[tuple[int, Transform]],
    judged: Sequence[tuple[int, Transform]],
    poses: Sequence[tuple[int, Transform]],
    params: TransformParams,
) -> Verdict:
    (first_ns, value), count = wrong[0], f"in {len(wrong)} of {plural(len(judged), 'message')}"
    recent = [p for t, p in poses if t <= first_ns][-RECENT:] or [poses[0][1]]
    hint = f"send the pose of each message on {params.pose_of} at once, in its callback"
    old = [t for t, p in poses if _fits(value, p, params) and t <= first_ns]
    pose = recent[-1] if old else _followed(value, recent, params)
    what, says = (
        f"{params.name} is wrong {count}",
        f"it is {_text(value)} while {params.pose_of} says {_text(pose)}",
    )
    if not old:
        if _is_there(value, pose, params) and _is_twice(value, pose, params):
            hint = f"halve the angle: {HALVED}"
            return failed(f"{what}: its angle is twice that of the pose; {says}", hint=hint).of_value(
                nan=False
            )
        if _is_there(value, pose, params):
            hint = "copy the whole orientation of the message, x, y, z and w: none of them is an angle"
        hint = _axes(value, pose, params)[1] or hint
        return failed(f"{what}{_why(value, pose, params)}; {says}", hint=hint)
    verdict = failed(f"{what}: it is that of an older pose; {says}", hint=hint).late()
    # One and the same pose all the time is no lag of the machine's.
    if len(judged) > FEW and len({_text(one) for _, one in judged}) == 1:
        return verdict
    verdict = verdict.if_repeated()
    return excused(verdict, run, old[-1], wrong[-1][0], why_late)


def _is_there(value: Transform, pose: Transform, params: TransformParams) -> bool:
    return all(math.isclose(a, b, abs_tol=params.tolerance_m) for a, b in zip(value.at, pose.at, strict=True))


def _is_twice(value: Transform, pose: Transform, params: TransformParams) -> bool:
    """Whether it is turned twice as far, as by `z = sin(yaw)`."""
    twice = Transform(value.at, turn_of([2 * angle for angle in pose.rpy_deg]))
    return value.apart(twice)[1] <= params.tolerance_deg < pose.apart(twice)[1]


def _followed(value: Transform, recent: Sequence[Transform], params: TransformParams) -> Transform:
    """Return which of the last poses it is to be: that at its place, or at one that follows from it; else the last."""
    newest = recent[::-1]
    there = (pose for pose in newest if _is_there(value, pose, params))
    turned = (pose for pose in newest if _axes(value, pose, params)[0] or _fits(value.inverse, pose, params))
    return next(there, None) or next(turned, newest[0])


def _too_seldom(run: Run, seen: Sequence[Seen], params: TransformParams) -> Verdict | None:
    to_s = run_seconds(run)
    if params.min_hz is None or to_s is None:
        return None
    span_s = to_s(seen[-1].time_ns) - to_s(seen[0].time_ns)
    rate_hz = (len(seen) - 1) / span_s if span_s > 0 else 0.0
    if rate_hz >= params.min_hz:
        return None
    asked = f"and the handout asks for at least {params.min_hz:g}"
    message = f"{params.name} is sent {significant(rate_hz)} times a second, {asked}"
    verdict = failed(message, hint=f"send it in a loop with {RATE}, or in the callback of what it follows")
    return excused(verdict.if_repeated(), run, seen[0].time_ns, seen[-1].time_ns, why_late)


def _expected_text(params: TransformParams) -> str:
    value = f" following {params.pose_of}" if params.pose_of else ""
    if params.translation is not None:
        value += f" at ({', '.join(f'{v:g}' for v in params.translation)}) m"
    if params.rotation_deg is not None:
        value += f", turned by ({', '.join(f'{v:g}' for v in params.rotation_deg)})°"
    return f"{params.parent} → {params.child}{value}"


def _measured_text(seen: Sequence[Seen], own: Sequence[Sent]) -> str:
    if not seen:
        return _edge_words(_edges(own)) or "no transform"
    last = seen[-1].value
    return f"{plural(len(seen), 'transform')}, the last {_text(last) if last else 'without a rotation'}"
