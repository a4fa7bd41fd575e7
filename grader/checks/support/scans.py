"""What a robot's laser sees, and where its script looks."""

from __future__ import annotations

import math
import re
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
SCAN = "sensor_msgs/LaserScan"
ANGLE_MAX = 100.0
"""No angle of a scan is larger than this."""
LOOK_AT = "see that the script reads this one: print the index or the angle of what it compares"


def nearest_seen(scan: Mapping[str, Any]) -> tuple[int, float] | None:
    """Return the index of the smallest range of a LaserScan, and how far it is (m); None where nothing is in reach."""
    there = [(one, index) for index, one in enumerate(scan["ranges"]) if math.isfinite(one) and one > 0]
    return min(there)[::-1] if there else None


def _angles(scan: Mapping[str, Any]) -> tuple[float, float]:
    """Return the first angle of a LaserScan and the step between two (radians); a step of 0 if it has no sound ones."""
    first, step = scan["angle_min"], scan["angle_increment"]
    is_sound = abs(first) <= ANGLE_MAX and abs(step) <= ANGLE_MAX  # false of NaN, too
    return (first, step) if is_sound else (0.0, 0.0)


def has_angles(scan: Mapping[str, Any]) -> bool:
    """Return whether a LaserScan says where its ranges are: one that the grader made up may not."""
    return _angles(scan)[1] != 0


def begins_ahead(run: Run) -> bool:
    """Return whether a laser has a range for each degree, of which the first one is straight ahead."""
    scans = [c.values[0] for c in run.channels if c.type.endswith("LaserScan") and c.messages]
    return bool(scans) and all(len(one["ranges"]) == 360 and abs(_degrees(one, 0)) < 1 for one in scans)


def _degrees(scan: Mapping[str, Any], index: int) -> float:
    """Return where a range of a LaserScan is, 0 being straight ahead, and the left positive."""
    first, step = _angles(scan)
    return math.degrees(math.remainder(first + index * step, math.tau))


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


def index_of(text: str, count: int) -> int | None:
    """Return the number that an index is, `n` of it being the count of ranges: `n*3//4-45`; None where it is none."""
    part = re.fullmatch(r"(?:(n)(?:\*(\d{1,6}))?(?://(\d{1,6}))?)?([+-]?\d{1,9})?", text)
    if not text or part is None:
        return None
    times, by = (1 if part[1] else 0) * int(part[2] or 1), int(part[3] or 1)
    return (count * times // by if by else 0) + int(part[4] or 0)


def indexes_read(read: PythonSlip, count: int) -> range | None:
    """Return which ranges of so many a line of a script reads; None where that is not known."""
    first, to, last = read.message.partition(":")
    start, end = index_of(first, count), index_of(last, count)
    if (first and start is None) or (last and end is None):
        return None
    bounds = slice(start, end)
    return range(*bounds.indices(count)) if to else range(count)[start : (start or 0) + 1 or None]


def looks_elsewhere(scan: Mapping[str, Any], index: int, reads: Sequence[PythonSlip]) -> list[str]:
    """Return what a script reads of a LaserScan, and where that is, if none of it is near a range; else nothing."""
    said, count = [], len(scan["ranges"])
    for one in reads:
        numbers = indexes_read(one, count)
        if numbers is None:
            return []
        apart = (math.remainder(_degrees(scan, number) - _degrees(scan, index), 360) for number in numbers)
        if index in numbers or (has_angles(scan) and any(abs(deg) < NEAR_DEG for deg in apart)):
            return []
        ends = [*numbers[:1], *numbers[-1:]]
        places = [seen_at(scan, n) if has_angles(scan) else f"ranges[{n}]" for n in ends]
        as_written = f"ranges[{one.message.replace('n', 'len(…)')}]"
        where = " to ".join(dict.fromkeys(places)) or "empty"
        said.append(f"{as_written} on line {one.line} is {where}")
    # `ranges[2]` says by itself which one it is
    return [re.sub(r"^(ranges\[\d+\]) on line (\d+) is \1$", r"line \2 reads \1 alone", one) for one in said]


def _looks_ahead(scan: Mapping[str, Any], read: PythonSlip) -> bool:
    numbers = indexes_read(read, len(scan["ranges"])) or ()
    return not has_angles(scan) or any(abs(_degrees(scan, n)) < NEAR_DEG / 2 for n in numbers)


def opposite(scan: Mapping[str, Any], index: int, read: PythonSlip) -> str:
    """Return the slice that looks to the other side, or ahead in place of behind, if a range is in it; "" else."""
    count = len(scan["ranges"])
    numbers = indexes_read(read, count) or range(0)
    for first in (count - numbers[-1] - 1, numbers[0] + count // 2) if len(numbers) > 1 else ():
        start, end = first % count, first % count + len(numbers)
        if index in range(start, end) or index + count in range(start, end):
            parts = (f"{start}:{end}",) if end <= count else (f"{start}:", f":{end - count}")
            return " + ".join(f"{read.name}[{part}]" for part in parts)
    return ""


def read_too(scan: Mapping[str, Any], index: int, reads: Sequence[PythonSlip]) -> str:
    """Return how to read a range of a LaserScan too, where a script reads none that is near it."""
    for one in reads:
        first, _, last = one.message.partition(":")
        # `ranges[-45:45]`, which is meant to go on from the last range to the first one
        is_around = indexes_read(one, len(scan["ranges"])) == range(0) and first[:1] == "-" and last.isdigit()
        if is_around and one.name.endswith("ranges"):
            right = f"{one.name}[{first}:] + {one.name}[:{last}]"
            return f"on line {one.line}, write `{right}` in place of `{one.name}[{one.message}]`"
    aside = [one for one in reads if not _looks_ahead(scan, one)]
    for one, right in [(one, opposite(scan, index, one)) for one in aside]:
        if right and len(aside) == 1:
            return f"on line {one.line}, write `{right}` in place of `{one.name}[{one.message}]`"
    return f"read ranges[{index}] too, and those around it"


def with_scan(verdict: Verdict, scan: Mapping[str, Any], reads: Sequence[PythonSlip]) -> Verdict:
    """Return the loss with the smallest range that the laser saw, and what a script reads that looks elsewhere."""
    index, far_m = nearest_seen(scan) or (0, 0.0)
    why = f"the smallest of its ranges is then ranges[{index}] of {scan['topic']}, {seen_at(scan, index)}, "
    why += f"with {far_m:.2f} m"
    if said := looks_elsewhere(scan, index, reads):
        hint = read_too(scan, index, reads)
        return verdict.explained(f"{why}; {join_words(said)}", hint, tuple(one.place for one in reads))
    return verdict.explained(why, f"{verdict.hint}; {LOOK_AT}")
