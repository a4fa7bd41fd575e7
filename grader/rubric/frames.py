"""Frames and angles that tf does not have: names with a slash, parents for children, radians for degrees."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from grader.checks.support.fields import is_number
from grader.rubric.step_faults import given_steps
from grader.rubric.yaml_lines import Fault, KeyPath, as_map, as_maps

FRAME_KEYS = frozenset({"frame_id", "child_frame_id"})
ANGLES = frozenset({"rotation_deg", "rpy_deg", "heading_deg"})
UNEQUAL = 0.02
"""So far from 1 is not a quaternion's length whose numbers are rounded."""
ROUNDED = 0.004
"""So much is 1.57 off from a quarter turn in radians, and 6.28 from a whole one."""


def frame_faults(rubric: dict[str, Any]) -> Iterator[Fault]:
    """Yield frames that begin with a slash, angles in radians where degrees are asked, and parents that are children
    elsewhere."""
    scenarios, criteria = as_map(rubric.get("scenarios")), list(as_maps(rubric.get("criteria")))
    for name, scenario in scenarios.items():
        for index, step in as_maps(as_map(scenario).get("steps")):
            for key in ("parent", "child"):
                at = ("scenarios", name, "steps", index, "transform", key)
                yield from _slash(at, as_map(step.get("transform")).get(key))
        yield from _in_values(("scenarios", name), scenario)
    for index, criterion in criteria:
        yield from _in_values(("criteria", index, "with"), criterion.get("with"))
        if criterion.get("check") == "transform":
            yield from _swapped_frames(index, criteria, as_map(scenarios.get(str(criterion.get("scenario")))))


def _slash(path: KeyPath, frame: object) -> Iterator[Fault]:
    if isinstance(frame, str) and frame.startswith("/"):
        yield path, f"tf2 has no frame that begins with a slash: write {frame.lstrip('/') or 'its name'}"


def _in_values(path: KeyPath, value: object) -> Iterator[Fault]:
    """Yield the faults of a part of the rubric and of all parts in it."""
    inside = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    given = as_map(value)
    if str(given.get("field")).rpartition(".")[2] in FRAME_KEYS:
        yield from _slash((*path, "value"), given.get("value"))
    for key, inner in inside:
        at = (*path, key)
        if key in FRAME_KEYS:
            yield from _slash(at, inner)
        elif key in {"orientation", "rotation"}:
            yield from _no_rotation(at, inner)
        elif key in ANGLES:
            for angle in _numbers(inner):
                if degrees := _in_degrees(angle):
                    yield at, f"{angle:g} is {degrees} degrees in radians: write {degrees}"
        yield from _in_values(at, inner)


def _no_rotation(path: KeyPath, value: object) -> Iterator[Fault]:
    """Yield a quaternion whose numbers are none: angles, most often."""
    given = as_map(value)
    numbers = [one for one in given.values() if is_number(one)]
    length = math.hypot(*numbers)
    if set(given) <= set("xyzw") and len(numbers) == len(given) and length and abs(length - 1) > UNEQUAL:
        yield (
            path,
            f"is a quaternion, whose length is 1, not {length:.3g}: write {{rpy_deg: [0, 0, 90]}}, in degrees",
        )


def _numbers(value: object) -> Iterator[float]:
    if isinstance(value, dict | list):
        for inner in value.values() if isinstance(value, dict) else value:
            yield from _numbers(inner)
    elif isinstance(value, float):
        yield value


def _in_degrees(angle: float) -> int:
    """Return what a multiple of an eighth of a turn in radians is in degrees; 0 for any other angle."""
    eighths = round(angle / (math.pi / 4))
    is_one = 0 < abs(eighths) <= 8 and abs(angle - eighths * math.pi / 4) <= ROUNDED
    return 45 * eighths if is_one and not angle.is_integer() else 0


def _swapped_frames(
    index: int, criteria: list[tuple[int, dict[str, Any]]], scenario: dict[str, Any]
) -> Iterator[Fault]:
    """Yield a transform whose parent is its child for what the scenario sends, or for an earlier criterion."""
    given = as_map(next(one for n, one in criteria if n == index).get("with"))
    parent, child = given.get("parent"), given.get("child")
    if given.get("through") is True:
        return
    sent = [(one.get("parent"), one.get("child")) for one in given_steps(scenario, "transform")]
    asked = [as_map(one.get("with")) for n, one in criteria if n < index and one.get("check") == "transform"]
    sent += [(one.get("parent"), one.get("child")) for one in asked if one.get("through") is not True]
    for publish in given_steps(scenario, "publish"):
        value = as_map(publish.get("value"))
        if publish.get("topic") == given.get("pose_of"):
            sent.append((as_map(value.get("header")).get("frame_id"), value.get("child_frame_id")))
    if parent and child and (child, parent) in sent:
        yield (
            ("criteria", index, "with", "parent"),
            f"{child} is the parent elsewhere in the rubric, and {parent} the child: a frame has one parent",
        )
