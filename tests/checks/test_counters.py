"""Counters of every kind: right ones pass, wrong ones never do."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from grader.checks.support.counters import Count
from grader.model.verdict import Status, Verdict
from tests.checks.examples import judge_runs
from tests.support.timeline import build_runs

TOPIC = "/numeric_chatter"


def verdict(check: str, params: dict[str, Any] | None = None, **topic: Any) -> Verdict:
    line = {"topic": TOPIC, "type": "std_msgs/Int16", **topic}
    runs = build_runs({"runs": {"run": {"topics": [line]}}, "package": {}})
    return judge_runs(check, {"topic": TOPIC, **(params or {})}, runs)


@given(maximum=st.integers(8, 200), minimum=st.integers(-3, 2), early=st.booleans())
def test_right_counters_pass(maximum: int, minimum: int, early: bool) -> None:
    last = maximum - 1 if early else maximum
    values = {"count_from": minimum, "wrap_after": last, "wrap_to": minimum}
    count = 2 * (last - minimum + 1) + 5
    wrap = {"minimum": minimum, "maximum": maximum}
    assert verdict("counter-wrap", wrap, values=values, count=count).status is Status.PASS
    assert (
        verdict("counter-step", {"maximum": maximum}, values=values, count=count + 10).status is Status.PASS
    )
    assert verdict("counter-start", {"start": minimum}, values=values, count=count).status is Status.PASS


@pytest.mark.full
@given(last=st.integers(0, 300), to=st.integers(-300, 299))
def test_wrong_wraps_fail(last: int, to: int) -> None:
    right = last in {126, 127} and to == 0
    if to >= last or right:
        return
    found = verdict(
        "counter-wrap", values={"count_from": min(to, 0), "wrap_after": last, "wrap_to": to}, count=1300
    )
    assert found.status is Status.FAIL
    assert found.message
    assert found.hint


@given(values=st.lists(st.integers(-128, 127), min_size=30, max_size=300))
def test_random_numbers_never_pass(values: list[int]) -> None:
    found = verdict("counter-step", values=values)
    assert found.status is not Status.PASS or all(b - a == 1 or b < a - 1 for a, b in pairwise(values))
    assert verdict("counter-wrap", values=values).status is not Status.PASS


@given(step=st.integers(2, 9))
def test_other_steps_fail_and_are_named(step: int) -> None:
    found = verdict("counter-step", values={"count_from": 0, "step": step}, count=60)
    assert found.status is Status.FAIL
    assert f"steps of {step}" in found.message


@given(at=st.integers(5, 190), length=st.integers(1, 3))
def test_what_is_lost_on_the_way_is_nobodys_fault(at: int, length: int) -> None:
    drop = list(range(at, at + length))
    found = verdict("counter-step", values={"count_from": 0, "wrap_after": 500}, count=200, drop=drop)
    assert found.status is Status.INCONCLUSIVE


@pytest.mark.parametrize("every", [5, 10, 20])
def test_what_is_lost_again_and_again_is_the_programs(every: int) -> None:
    """A node that leaves out every tenth value, and sleeps all the same."""
    drop = list(range(every, 400, every))
    found = verdict("counter-step", values={"count_from": 0}, count=400, drop=drop)
    assert found.status is (Status.INCONCLUSIVE if every == 20 else Status.FAIL)


def test_a_gap_in_the_sequence_numbers_is_the_recorders() -> None:
    count = Count(callerid="/talker", values=(0, 1, 4), times_ns=(0, 10, 20), sequences=(0, 1, 4))
    assert [count.was_lost_in_transit(step, step.change) for step in count.steps] == [False, True]


def test_a_decoded_value_that_is_no_number_is_left_out() -> None:
    assert verdict("counter-start", type="std_msgs/Bool", values=[True, False]).basis.unjudged
