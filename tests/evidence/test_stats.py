"""Rates as `rostopic hz` gives them, and how sure they are."""

from __future__ import annotations

import random
from itertools import accumulate, pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from grader.evidence.inspect import periodic_share, rate_stats

MS = 1_000_000


def test_a_steady_rate():
    stats = rate_stats([n * 100 * MS for n in range(51)])
    assert (stats.count, stats.duration_s, stats.mean_hz) == (51, 5.0, 10.0)
    assert (stats.gap_min_s, stats.gap_median_s, stats.gap_p95_s, stats.gap_max_s) == (0.1, 0.1, 0.1, 0.1)
    assert stats.gap_std_s == 0
    assert (stats.period_low_s, stats.period_high_s) == (0.1, 0.1)


@pytest.mark.parametrize("times", [[], [5]])
def test_too_few_messages_have_no_rate(times):
    stats = rate_stats(times)
    assert (stats.count, stats.mean_hz) == (len(times), None)


def test_two_messages_and_messages_at_one_time():
    stats = rate_stats([0, 500 * MS])
    assert (stats.mean_hz, stats.period_low_s, stats.gap_p95_s) == (2.0, None, 0.5)
    at_once = rate_stats([7, 7, 7])
    assert (at_once.mean_hz, at_once.mean_period_s) == (None, 0.0)


def test_bursts_have_the_mean_but_not_the_period():
    times = [second * 1000 * MS + n for second in range(10) for n in range(10)]
    assert rate_stats(times).mean_hz == pytest.approx(11, abs=0.01)
    assert periodic_share([after - before for before, after in pairwise(times)], 100 * MS) == 0


def test_one_stall_on_an_absolute_schedule():
    times = [n * 100 * MS for n in range(101)]
    times[50] += 80 * MS
    stats = rate_stats(times)
    assert stats.mean_hz == 10
    assert (stats.gap_max_s, stats.gap_min_s, stats.gap_p95_s) == (0.18, 0.02, 0.1)
    assert periodic_share([after - before for before, after in pairwise(times)], 100 * MS) == 0.98
    assert stats.period_low_s < 0.1 < stats.period_high_s


@pytest.mark.parametrize(("gap_ms", "share"), [(49, 0), (50, 1), (150, 1), (151, 0)])
def test_the_ends_of_periodic_are_included(gap_ms, share):
    assert periodic_share([gap_ms * MS], 100 * MS) == share


def test_the_interval_holds_the_true_period_most_of_the_time():
    rng = random.Random(3)  # noqa: S311 - a fixed sample
    held = 0
    for _ in range(400):
        times = [*accumulate(round(rng.gauss(100, 10) * MS) for _ in range(80))]
        stats = rate_stats(times)
        held += stats.period_low_s <= 0.1 <= stats.period_high_s
    assert 0.92 <= held / 400 <= 0.98


@given(st.lists(st.integers(0, 10**12), min_size=2, max_size=60))
def test_order_does_not_matter_and_bounds_hold(times):
    stats = rate_stats(times)
    assert stats == rate_stats(sorted(times, reverse=True))
    assert stats.gap_min_s <= stats.gap_median_s <= stats.gap_max_s
    assert stats.gap_median_s <= stats.gap_p95_s <= stats.gap_max_s
    if stats.period_low_s is not None:
        assert stats.period_low_s <= stats.mean_period_s + 1e-9 <= stats.period_high_s + 2e-9
