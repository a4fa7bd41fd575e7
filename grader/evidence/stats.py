"""Rates as `rostopic hz` computes them, from arrival times in ns."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from math import ceil, sqrt
from statistics import median, pstdev, stdev

from grader.model.record import Record

BATCHES = 10
# Student's t, two-sided 95 %, for 1 to BATCHES - 1 degrees of freedom.
_T95 = (12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262)


class RateStats(Record):
    """`mean_hz` is (count - 1) / (last - first), None without two messages at two times.

    `period_low_s` to `period_high_s` is the 95 % confidence interval of the mean period, by batch means: the
    gaps are cut into up to 10 consecutive batches, and Student's t is applied to the batches' mean periods.
    That stays honest where gaps depend on each other, as they do with `rospy.Rate`, whose long gap is
    followed by a short one. `gap_std_s` is the population's, as in `rostopic hz`; `gap_p95_s` is the smallest
    gap that 95 % do not exceed. `periodic_share` is the share of gaps within ±50 % (ends included) of the
    nominal period, if one was given.
    """

    count: int
    duration_s: float
    mean_hz: float | None = None
    mean_period_s: float | None = None
    period_low_s: float | None = None
    period_high_s: float | None = None
    gap_min_s: float | None = None
    gap_median_s: float | None = None
    gap_p95_s: float | None = None
    gap_max_s: float | None = None
    gap_std_s: float | None = None
    periodic_share: float | None = None


def rate_stats(times_ns: Sequence[int], *, nominal_hz: float | None = None) -> RateStats:
    """The rate of messages that arrived at `times_ns`, in any order. ValueError for a rate of 0 or below."""
    if nominal_hz is not None and not nominal_hz > 0:
        raise ValueError("the nominal rate must be above 0 Hz")
    times = sorted(times_ns)
    if len(times) < 2:
        return RateStats(count=len(times), duration_s=0.0)
    gaps = [later - earlier for earlier, later in pairwise(times)]
    duration_ns = times[-1] - times[0]
    ordered = sorted(gaps)
    low_s, high_s = _interval(times)
    return RateStats(
        count=len(times),
        duration_s=duration_ns / 1e9,
        mean_hz=len(gaps) * 1e9 / duration_ns if duration_ns else None,
        mean_period_s=duration_ns / len(gaps) / 1e9,
        period_low_s=low_s,
        period_high_s=high_s,
        gap_min_s=ordered[0] / 1e9,
        gap_median_s=median(ordered) / 1e9,
        gap_p95_s=ordered[ceil(0.95 * len(ordered)) - 1] / 1e9,
        gap_max_s=ordered[-1] / 1e9,
        gap_std_s=pstdev(gaps) / 1e9,
        periodic_share=None if nominal_hz is None else periodic_share(gaps, nominal_hz=nominal_hz),
    )


def periodic_share(gaps_ns: Sequence[int], *, nominal_hz: float, spread: float = 0.5) -> float:
    """The share (0 to 1) of gaps within ±`spread` of the nominal period, ends included; 0 without gaps."""
    period_ns = 1e9 / nominal_hz
    low, high = round(period_ns * (1 - spread)), round(period_ns * (1 + spread))
    return sum(low <= gap <= high for gap in gaps_ns) / len(gaps_ns) if gaps_ns else 0.0


def _interval(times: Sequence[int]) -> tuple[float | None, float | None]:
    """Bounds (s) of the mean period; None with fewer than two gaps."""
    gaps = len(times) - 1
    batches = min(BATCHES, gaps)
    if batches < 2:
        return None, None
    cuts = [round(batch * gaps / batches) for batch in range(batches + 1)]
    periods = [(times[end] - times[begin]) / (end - begin) for begin, end in pairwise(cuts)]
    mean = (times[-1] - times[0]) / gaps
    half = _T95[batches - 2] * stdev(periods) / sqrt(batches)
    return max(0.0, mean - half) / 1e9, (mean + half) / 1e9
