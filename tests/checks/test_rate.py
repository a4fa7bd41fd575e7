"""The rate's bounds, for every rate and every way to come near them."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from grader.model.message_rate import Rhythm
from grader.model.verdict import Status
from tests.checks.examples import judge_runs
from tests.support.timeline import build_runs

PARAMS = {"topic": "/chatter", "rate_hz": 10}


def status(topic: dict[str, Any], params: dict[str, Any] | None = None, **run: Any) -> Status:
    runs = build_runs({"runs": {"run": {"topics": [{"topic": "/chatter", **topic}], **run}}, "package": {}})
    return judge_runs("rate", params or PARAMS, runs).status


@pytest.mark.full
@pytest.mark.parametrize("nominal_hz", [1, 2, 3, 7, 10, 30, 33.3, 50, 100])
@pytest.mark.parametrize(
    ("share", "expected"), [(0.949, "fail"), (0.95, "pass"), (1.05, "pass"), (1.051, "fail")]
)
def test_bounds_at_any_rate(nominal_hz: float, share: float, expected: str) -> None:
    topic = {"rate_hz": nominal_hz * share, "count": int(nominal_hz * 12) + 2}
    assert status(topic, {"topic": "/chatter", "rate_hz": nominal_hz}) is Status(expected)


@pytest.mark.parametrize("start_s", [0.0, 0.1, 1 / 3, 7.7])
def test_where_the_run_begins_does_not_matter(start_s: float) -> None:
    assert status({"rate_hz": 9.5, "count": 61, "start_s": start_s}) is Status.PASS
    assert status({"rate_hz": 9.49, "count": 61, "start_s": start_s}) is Status.FAIL


@given(jitter_ms=st.lists(st.floats(-20, 20), min_size=1, max_size=20))
def test_small_jitter_costs_nothing(jitter_ms: list[float]) -> None:
    assert status({"count": 71, "jitter_ms": jitter_ms}) is Status.PASS


@pytest.mark.full
@given(rate_hz=st.floats(0.5, 400).filter(lambda hz: not 9.49 < hz < 10.51))
def test_no_other_rate_passes(rate_hz: float) -> None:
    assert status({"rate_hz": rate_hz, "count": int(rate_hz * 7) + 2}) is Status.FAIL


@given(burst=st.integers(2, 20))
def test_no_burst_passes(burst: int) -> None:
    assert status({"count": burst * 10 + 1, "burst": burst}) is not Status.PASS


@pytest.mark.parametrize(("outside", "even"), [(3, True), (4, False)])
def test_share_of_gaps(outside: int, even: bool) -> None:
    """Three of 60 gaps may lie outside the bounds (95 %), four may not."""
    times_s = [0.5]
    for number in range(60):
        far = number % 12 == 0 and number // 12 < outside
        times_s.append(times_s[-1] + (0.151 if far else 0.1 - 0.051 * outside / (60 - outside)))
    assert status({"times_s": times_s}) is (Status.PASS if even else Status.FAIL)


@pytest.mark.parametrize(("gap_s", "inside"), [(0.05, True), (0.15, True), (0.0499, False), (0.1501, False)])
def test_a_gap_on_its_bound_is_inside(gap_s: float, inside: bool) -> None:
    rhythm = Rhythm(times_ns=(0, round(gap_s * 1e9)), until_ns=round(gap_s * 1e9))
    assert (rhythm.outside(0.5e8, 1.5e8) == []) is inside


def test_a_rhythm_needs_a_message() -> None:
    with pytest.raises(ValueError, match="at least one"):
        Rhythm(times_ns=(), until_ns=0)
