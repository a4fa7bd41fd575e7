"""The recorder alone: how much it takes without loss, beside `rosbag record` on the same load.

A pace is kept when everything was sent in time (a reader that is slow makes the publisher wait), everything was
recorded, and, where that is known, the last message was written half a second later. From the pace that is asked for
it goes up as long as it is kept, or down until it is.
"""

from __future__ import annotations

import statistics
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from benchmarks import arena, rosbag
from benchmarks.arena import Load, Taken
from benchmarks.figures import Found, Options, mid, table
from benchmarks.gradings import folder_for

TIMES, SECONDS = 3, 3.0
STEP, STEPS_MAX = 1.5, 6
LATE_SHARE, BEHIND_S = 0.02, 0.5
BYTES_MAX = 600_000_000
"""Of one run: faster loads are shorter."""
TRIES = 2

Record = Callable[[Load], Taken]


class Kind(NamedTuple):
    """`asked_hz` is the number of messages a second, of all publishers together, that the issue asks for."""

    title: str
    publishers: int
    type: str
    bytes: int
    asked_hz: float

    def load(self, rate_hz: float, seconds: float) -> Load:
        count = min(int(rate_hz * seconds), BYTES_MAX // self.bytes)
        return Load(topics=self.publishers, type=self.type, bytes=self.bytes, count=count, rate_hz=rate_hz)


KINDS = (
    Kind("1 publisher, 1 byte", 1, "std_msgs/Int8", 1, 20_000),
    Kind("50 publishers, 1 byte", 50, "std_msgs/Int8", 1, 20_000),
    Kind("1 publisher, 1 MB", 1, "std_msgs/UInt8MultiArray", 1_000_000, 100),
    Kind("50 publishers, 1 MB", 50, "std_msgs/UInt8MultiArray", 1_000_000, 100),
)


class Measured(NamedTuple):
    """`kept_hz` is the fastest pace that was kept (0: none), `asked` what became of the load asked for."""

    kept_hz: float
    asked: Taken


def measure(options: Options) -> Found:
    times, seconds = options.times or TIMES, options.seconds or SECONDS
    rows, faults = [], []
    with folder_for("recorder", options) as folder:
        for kind in KINDS:
            ours: list[Measured] = []
            theirs: list[Measured] = []
            for _ in range(times):
                ours.append(_climb(kind, seconds, lambda load: _recorded(load, folder)))
                theirs.append(_climb(kind, seconds, lambda load: rosbag.record(load, folder)))
            rows += _rows(kind, ours, theirs)
            faults += [fault for one in ours for fault in _untold(kind, one.asked)]
    header = ["load", "recorder", "without loss up to", "at the asked pace: lost", "told", "behind", "CPU"]
    ratio = "kept pace / that of `rosbag record`"
    return Found(
        runs=f"{seconds:g} s each (at most {BYTES_MAX // 10**6} MB), {times} times in turn",
        tables=(table([*header, ratio], rows),),
        faults=tuple(faults),
    )


def _recorded(load: Load, folder: Path) -> Taken:
    path = folder / "load.mcap"
    taken, _ = arena.record(load, path)
    path.unlink()
    return taken


def _climb(kind: Kind, seconds: float, record: Record) -> Measured:
    load = kind.load(kind.asked_hz, seconds)
    asked = record(load)
    if _kept(load, asked) or _keeps(load, record):
        return Measured(_up(kind, seconds, record), asked)
    return Measured(_down(kind, seconds, record), asked)


def _up(kind: Kind, seconds: float, record: Record) -> float:
    kept_hz = kind.asked_hz
    for _ in range(STEPS_MAX):
        if not _keeps(kind.load(kept_hz * STEP, seconds), record):
            break
        kept_hz *= STEP
    return kept_hz


def _down(kind: Kind, seconds: float, record: Record) -> float:
    rate_hz = kind.asked_hz
    for _ in range(STEPS_MAX):
        rate_hz /= STEP
        if _keeps(kind.load(rate_hz, seconds), record):
            return rate_hz
    return 0.0


def _keeps(load: Load, record: Record) -> bool:
    return any(_kept(load, record(load)) for _ in range(TRIES))


def _kept(load: Load, taken: Taken) -> bool:
    in_time = taken.late_s <= LATE_SHARE * load.seconds and (taken.behind_s or 0.0) <= BEHIND_S
    return in_time and taken.recorded == taken.sent


def _untold(kind: Kind, taken: Taken) -> list[str]:
    """What is lost has to be told."""
    missing = taken.sent - taken.recorded - taken.told_dropped
    return [f"{kind.title}: {missing} messages were lost without a word"] if missing else []


def _rows(kind: Kind, ours: list[Measured], theirs: list[Measured]) -> list[list[str]]:
    of_ours, of_theirs = (statistics.median(m.kept_hz for m in each) for each in (ours, theirs))
    ratio = f"{of_ours / of_theirs:.2f}" if of_theirs else "it kept none"
    return [
        [kind.title, "the grader's", *_cells(kind, ours), ratio],
        [kind.title, "`rosbag record`", *_cells(kind, theirs), ""],
    ]


def _cells(kind: Kind, measured: list[Measured]) -> list[str]:
    asked = [one.asked for one in measured]
    large = kind.bytes >= 10**6
    unit, scale = ("MB/s", kind.bytes / 1e6) if large else ("messages/s", 1.0)
    behind = [one.behind_s * 1e3 for one in asked if one.behind_s is not None]
    return [
        f"{mid([one.kept_hz * scale for one in measured], 0)} {unit}",
        f"{sum(one.sent - one.recorded for one in asked)} of {sum(one.sent for one in asked)}",
        f"{sum(one.told_dropped for one in asked)}",
        f"{mid(behind, 0)} ms" if behind else "",
        f"{mid([one.cpu_s for one in asked])} s",
    ]
