"""What a robot's laser sees, and where its script looks."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from grader.checks.support.clocks import run_seconds
from grader.checks.support.geometry import AIMED_DEG, BEHIND_DEG, Band, Pose
from grader.evidence.run import Run
from grader.model.python_slip import PythonSlip
from grader.model.verdict import Verdict
from grader.wording import join_words

NEAR_DEG = 30.0
"""A range that is no further from another one looks to the same side."""
LOOK_AT = "see that the script reads this one: print the index or the angle of what it compares"


def nearest_seen(scan: Mapping[str, Any]) -> tuple[int, float] | None:
    """Return the index of the smallest range of a LaserScan, and how far it is (m); None where nothing is in reach."""
    there = [(one, index) for index, one in enumerate(scan["ranges"]) if math.isfinite(one) and one > 0]
    return min(there)[::-1] if there else None


def _degrees(scan: Mapping[str, Any], index: int) -> float:
    """Return where a range of a LaserScan is, 0 being straight ahead, and the left positive."""
    return math.degrees(math.remainder(scan["angle_min"] + index * scan["angle_increment"], math.tau))


def seen_at(scan: Mapping[str, Any], index: int) -> str:
    """Return where a range of a LaserScan is, in words."""
    deg = _degrees(scan, index)
    side = f"{abs(deg):.0f}° to the {'left' if deg > 0 else 'right'}"
    return "straight ahead" if abs(deg) < AIMED_DEG else "behind it" if abs(deg) > BEHIND_DEG else side


def scan_near(path: Sequence[Pose], out: Sequence[float], band: Band, run: Run) -> Mapping[str, Any] | None:
    """Return what its laser sees where it first comes too near to a wall; None where it has none, or is farther."""
    first, to_s = next(pose for pose, far in zip(path, out, strict=True) if far), run_seconds(run)
    scans = [
        c for c in run.channels if "LaserScan" in c.type and c.callerid in run.grader_nodes and c.messages
    ]
    if not scans or to_s is None or band.nearest_m(first.point) >= (band.min_m or 0.0):
        return None
    before = tuple(one for one in scans[0].messages if to_s(one.log_time_ns) <= first.time_s)[-1:]
    scan = replace(scans[0], messages=before).values[0] if before else None
    return {**scan, "topic": scans[0].topic} if scan and nearest_seen(scan) else None


def looks_elsewhere(scan: Mapping[str, Any], index: int, reads: Sequence[PythonSlip]) -> list[str]:
    """Return what a script reads of a LaserScan, and where that is, if none of it is near a range; else nothing."""
    said, count = [], len(scan["ranges"])
    for one in reads:
        first, to, last = one.message.partition(":")
        bounds = slice(int(first) if first else None, int(last) if last else None)
        numbers = range(*bounds.indices(count)) if to else range(count)[int(first) : int(first) + 1 or None]
        apart = (math.remainder(_degrees(scan, number) - _degrees(scan, index), 360) for number in numbers)
        if any(abs(deg) < NEAR_DEG for deg in apart):
            return []
        places = dict.fromkeys(seen_at(scan, number) for number in [*numbers[:1], *numbers[-1:]])
        said.append(f"ranges[{one.message}] on line {one.line} is {' to '.join(places) or 'empty'}")
    return said


def with_scan(verdict: Verdict, scan: Mapping[str, Any], reads: Sequence[PythonSlip]) -> Verdict:
    """Return the loss with the smallest range that the laser saw, and what a script reads that looks elsewhere."""
    index, far_m = nearest_seen(scan) or (0, 0.0)
    why = f"the smallest of its ranges is then ranges[{index}] of {scan['topic']}, {seen_at(scan, index)}, "
    why += f"with {far_m:.2f} m"
    if said := looks_elsewhere(scan, index, reads):
        hint = f"read ranges[{index}] too, and those around it"
        return verdict.explained(f"{why}; {join_words(said)}", hint, tuple(one.place for one in reads))
    return verdict.explained(why, f"{verdict.hint}; {LOOK_AT}")
