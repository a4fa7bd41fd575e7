"""Frames and angles that tf does not have: names with a slash, parents for children, radians for degrees; and degrees
where messages have radians."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from grader.checks.support.fields import is_number
from grader.rubric.message_fields import POSES, types_of
from grader.rubric.yaml_lines import (
    Fault,
    KeyPath,
    WrittenCriterion,
    WrittenRubric,
    as_map,
    as_maps,
    given_steps,
    items_in,
    numbers_in,
)

FRAME_KEYS = frozenset({"frame_id", "child_frame_id"})
ANGLES = frozenset({"rotation_deg", "rpy_deg", "heading_deg"})
IN_RADIANS = frozenset({"angular", "theta", "angular_velocity", "angle_min", "angle_max", "angle_increment"})
"""Fields of ROS's messages that are angles, or angles in a second."""
IN_DEGREES = frozenset({30, 45, 60, 90, 120, 135, 150, 180, 225, 270, 315, 360})
"""Angles that are meant in degrees: as radians they are several turns."""
UNEQUAL = 0.02
"""So far from 1 is not a quaternion's length whose numbers are rounded."""
ROUNDED = 0.004
"""So much is 1.57 off from a quarter turn in radians, and 6.28 from a whole one."""


def frame_faults(rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield frames that begin with a slash, angles in the other unit, and parents that are children elsewhere."""
    for at, step in rubric.steps():
        for key in ("parent", "child"):
            yield from _slash((*at, "transform", key), as_map(step.get("transform")).get(key))
    for name, scenario in rubric.scenarios.items():
        yield from _in_values(("scenarios", name), scenario)
        yield from _two_parents(("scenarios", name), scenario)
    yield from _sent_turns(rubric)
    for criterion in rubric.criteria:
        yield from _in_values(criterion.at, criterion.given)
        for at, asked in criterion.conditions:
            yield from _judged_turns(at, asked, rubric, criterion.scenario)
        if criterion.check == "transform":
            yield from _swapped_frames(criterion, rubric.criteria)
            yield from _no_pose(criterion, rubric)


def _sent_turns(rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield angles in degrees in what scenarios send, in messages and requests of ROS's own types."""
    for at, kind, one in rubric.parts():
        is_own = str(one.get("type")).partition("/")[0] in rubric.own_packages
        for key in ("value", "values", "request") if kind in {"publish", "call"} and not is_own else ():
            yield from _turns((*at, key), one.get(key))


def _turns(path: KeyPath, value: object, *, is_angle: bool = False) -> Iterator[Fault]:
    if is_angle and is_number(value) and abs(value) in IN_DEGREES:
        yield path, f"angles are in radians here: write {math.radians(value):.4f} for {value:g} degrees"
    for key, inner in items_in(value):
        yield from _turns((*path, key), inner, is_angle=is_angle or key in IN_RADIANS)


def _judged_turns(
    path: KeyPath, given: dict[str, Any], rubric: WrittenRubric, scenario: dict[str, Any]
) -> Iterator[Fault]:
    """Yield angles in degrees that a criterion asks for in a field of one of ROS's own types."""
    field, topic = str(given.get("field")), str(given.get("topic"))
    if not field.startswith("angular.") and field.partition(".")[0].partition("[")[0] not in IN_RADIANS:
        return
    types = [str(kind) for kind in types_of(topic, rubric, scenario)]
    own = [kind for kind in types if kind.partition("/")[0] in rubric.own_packages]
    if not own and (types or field.startswith("angular.")):
        for key in ("value", "values", "min", "max"):
            yield from _turns((*path, key), given.get(key), is_angle=True)


def _two_parents(path: KeyPath, scenario: dict[str, Any]) -> Iterator[Fault]:
    """Yield frames that the steps of one scenario place in two others: tf has them in one of these at a time."""
    parents: dict[str, str] = {}
    for index, step in as_maps(scenario.get("steps")):
        given = as_map(step.get("transform"))
        parent, child = str(given.get("parent")), str(given.get("child"))
        if given and parents.setdefault(child, parent) != parent:
            fault = f"{child} is in {parents[child]} already: a frame has one parent"
            yield (*path, "steps", index, "transform", "child"), fault


def _no_pose(criterion: WrittenCriterion, rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield a topic of poses that has none, and poses of the grader's that no transform can follow."""
    scenario, topic = criterion.scenario, criterion.given.get("pose_of")
    if not isinstance(topic, str):
        return
    types = {str(kind) for kind in types_of(topic, rubric, scenario)}
    known = {kind for kind in types if kind.partition("/")[0] not in rubric.own_packages}
    if known and known.isdisjoint(POSES):
        yield (*criterion.at, "pose_of"), f"{topic} carries {min(known)}, which has no pose"
    for index, step in as_maps(scenario.get("steps")):
        publish = as_map(step.get("publish"))
        if publish.get("topic") == topic and publish.get("type") == POSES[0]:
            at = ("scenarios", criterion.run, "steps", index, "publish", "value")
            faults = _unlike(as_map(publish.get("value")), criterion.given, criterion.id)
            yield from (((*at, *key), fault) for key, fault in faults)


def _unlike(value: dict[str, Any], given: dict[str, Any], name: str) -> Iterator[Fault]:
    """Yield what the odometry that is sent lacks, or has otherwise than the transform that a criterion wants to follow
    it."""
    pose, header = as_map(as_map(value.get("pose")).get("pose")), as_map(value.get("header"))
    if not pose.get("orientation"):
        fault = (
            "has no orientation, and tf takes none that is all zero: write {w: 1}, or {rpy_deg: [0, 0, 90]}"
        )
        yield ("pose", "pose"), fault
    found = (header.get("frame_id"), value.get("child_frame_id"))
    wanted = (given.get("parent"), given.get("child"))
    if given.get("through") is True or found == wanted[::-1]:
        return
    if all(found) and set(found).isdisjoint(wanted):
        return  # a node that names its frames itself, by its namespace for instance
    asks = f"{name} asks for a transform from {given.get('parent')} to {given.get('child')}"
    keys: tuple[KeyPath, ...] = (("header", "frame_id"), ("child_frame_id",))
    for key, frame, asked in zip(keys, found, wanted, strict=True):
        if frame != asked and not str(frame).startswith("/"):
            yield key, f"is {frame}, and {asks}" if frame else f"is missing: {asks}"


def _slash(path: KeyPath, frame: object) -> Iterator[Fault]:
    if isinstance(frame, str) and frame.startswith("/"):
        yield path, f"tf2 has no frame that begins with a slash: write {frame.lstrip('/') or 'its name'}"


def _in_values(path: KeyPath, value: object) -> Iterator[Fault]:
    """Yield the faults of a part of the rubric and of all parts in it."""
    given = as_map(value)
    if str(given.get("field")).rpartition(".")[2] in FRAME_KEYS:
        yield from _slash((*path, "value"), given.get("value"))
    for key, inner in items_in(value):
        at = (*path, key)
        if key in FRAME_KEYS:
            yield from _slash(at, inner)
        elif key in {"orientation", "rotation"}:
            yield from _no_rotation(at, inner)
        elif key in ANGLES:
            for _, angle in numbers_in((), inner):
                if degrees := _in_degrees(angle):
                    yield at, f"{angle:g} is {degrees} degrees in radians: write {degrees}"
        yield from _in_values(at, inner)


def _no_rotation(path: KeyPath, value: object) -> Iterator[Fault]:
    """Yield a quaternion whose numbers are none: angles, most often."""
    given = as_map(value)
    numbers = [one for one in given.values() if is_number(one)]
    length = math.hypot(*numbers)
    if set(given) <= set("xyzw") and len(numbers) == len(given) and length and abs(length - 1) > UNEQUAL:
        fault = (
            f"is a quaternion, whose length is 1, not {length:.3g}: write {{rpy_deg: [0, 0, 90]}}, in degrees"
        )
        yield path, fault


def _in_degrees(angle: float) -> int:
    """Return what a multiple of an eighth of a turn in radians is in degrees; 0 for any other angle."""
    eighths = round(angle / (math.pi / 4))
    is_one = 0 < abs(eighths) <= 8 and abs(angle - eighths * math.pi / 4) <= ROUNDED
    return 45 * eighths if is_one else 0  # no whole number is one: they are all farther off


def _swapped_frames(criterion: WrittenCriterion, criteria: list[WrittenCriterion]) -> Iterator[Fault]:
    """Yield a transform whose parent is its child for what the scenario sends, or for an earlier criterion."""
    given, scenario = criterion.given, criterion.scenario
    parent, child = given.get("parent"), given.get("child")
    if given.get("through") is True:
        return
    sent = [(one.get("parent"), one.get("child")) for one in given_steps(scenario, "transform")]
    earlier = [one.given for one in criteria if one.check == "transform" and one.place < criterion.place]
    # Those of other topics of poses, too: a frame has one parent in the whole of tf.
    sent += [(one.get("parent"), one.get("child")) for one in earlier if one.get("through") is not True]
    equal = [one.given for one in criteria if one.check == "field-equals"]
    of_pose = [one for one in equal if one.get("topic") == given.get("pose_of")]
    named = {str(one.get("field")): one.get("value") for one in of_pose}
    sent.append((named.get("header.frame_id"), named.get("child_frame_id")))
    for publish in given_steps(scenario, "publish"):
        value = as_map(publish.get("value"))
        if publish.get("topic") == given.get("pose_of"):
            sent.append((as_map(value.get("header")).get("frame_id"), value.get("child_frame_id")))
    if parent and child and (child, parent) in sent:
        fault = (
            f"{child} is the parent elsewhere in the rubric, and {parent} the child: a frame has one parent"
        )
        yield (*criterion.at, "parent"), fault
