"""What the machine did in a stretch of a run: how late it woke who slept, by the arena's timer and its calibration."""

from __future__ import annotations

import statistics
import struct
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

from grader.evidence.run import Channel, Run

CALIBRATION = "/grader/calibration"
CALIBRATION_TYPE = "std_msgs/Header"
PERIOD_NS = 100_000_000
STAMP = struct.Struct("<III")
FULL = 0.9
"""The share of the processors' time from which who has work to do may wait for a turn, though sleepers wake in time."""


class Lateness(NamedTuple):
    """In ms: the mean, the 95th percentile and the most, the larger of what timer and calibration say.

    `sleep_ms` is what a sleep of 0.1 s took too long in the mean, `calibration_hz` the rate of a loop of such sleeps;
    None where no calibration was recorded. `busy` is the share of the processors' time that was taken.
    """

    mean_ms: float
    p95_ms: float
    max_ms: float
    sleep_ms: float | None = None
    calibration_hz: float | None = None
    busy: float | None = None

    @property
    def full(self) -> bool:
        """Whether the machine had next to no time to spare."""
        return (self.busy or 0.0) >= FULL

    @property
    def described(self) -> str:
        """`machine 97 % busy and late by 3 ms, calibration 9.97 Hz`."""
        busy = "" if self.busy is None else f" {self.busy * 100:.0f} % busy and"
        late = f"machine{busy} late by {self.max_ms:.0f} ms"
        return late if self.calibration_hz is None else f"{late}, calibration {self.calibration_hz:.2f} Hz"


def lateness(run: Run, from_ns: int, to_ns: int) -> Lateness | None:
    """Between two times of the run; None where nothing was measured (another tool's recording)."""
    timer = _timer(run, from_ns, to_ns)
    sleeps = [late for channel in run.channels for late in _sleeps_ms(channel, from_ns, to_ns)]
    if not sleeps:
        return timer if run.host else None
    mean_ms = statistics.fmean(sleeps)
    return Lateness(
        max(timer.mean_ms, mean_ms),
        max(timer.p95_ms, sorted(sleeps)[int(0.95 * (len(sleeps) - 1))]),
        max(timer.max_ms, *sleeps),
        sleep_ms=mean_ms,
        calibration_hz=1e3 / (PERIOD_NS / 1e6 + mean_ms),
        busy=timer.busy,
    )


def _timer(run: Run, from_ns: int, to_ns: int) -> Lateness:
    """The worst that was reported of this stretch of time."""
    before = max((t for t, _ in run.host if t <= from_ns), default=from_ns)
    after = min((t for t, _ in run.host if t >= to_ns), default=to_ns)
    events = [e for t, e in run.host if before < t <= after]
    return Lateness(
        max((e.mean_ms for e in events), default=0.0),
        max((e.p95_ms for e in events), default=0.0),
        max((e.max_ms for e in events), default=0.0),
        busy=_mean([e.busy for e in events if e.busy is not None]),
    )


def _mean(shares: Sequence[float]) -> float | None:
    return statistics.fmean(shares) if shares else None


def _sleeps_ms(channel: Channel, from_ns: int, to_ns: int) -> Iterator[float]:
    """How much too long each sleep of the calibration was, by its own stamps, of those that touch the stretch."""
    if channel.topic != CALIBRATION or channel.type != CALIBRATION_TYPE or not channel.by_grader:
        return
    whole = [m for m in channel.messages if len(m.data) >= STAMP.size]
    for before, after in pairwise(whole):
        if after.log_time_ns >= from_ns and before.log_time_ns <= to_ns:
            yield max(0.0, (_sent_ns(after.data) - _sent_ns(before.data) - PERIOD_NS) / 1e6)


def _sent_ns(data: bytes) -> int:
    _, seconds, nanoseconds = STAMP.unpack_from(data)
    return int(seconds * 10**9 + nanoseconds)
