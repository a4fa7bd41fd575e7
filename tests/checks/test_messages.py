"""Times in seconds pass however they are written; nothing else that is a number does."""

from __future__ import annotations

import re
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from grader.checks.messages import MessageParams
from grader.checks.support.fields import near_texts
from grader.model.verdict import Status, Verdict
from tests.checks.examples import judge_runs
from tests.support.timeline import build_runs

TEMPLATE = "The time is {seconds}"
RATES_HZ = st.sampled_from([1, 2, 10, 50])


def verdict(texts: list[str], rate_hz: float) -> Verdict:
    topic = {"topic": "/data", "rate_hz": rate_hz, "values": texts}
    runs: Any = build_runs({"runs": {"run": {"topics": [topic]}}, "package": {}})
    return judge_runs("message", {"topic": "/data", "template": TEMPLATE}, runs)


def texts(start_s: float, rate_hz: float, digits: int, pace: float = 1.0) -> list[str]:
    return [f"The time is {start_s + pace * i / rate_hz:.{digits}f}" for i in range(int(6 * rate_hz) + 1)]


@given(start_s=st.floats(0, 2e9), rate_hz=RATES_HZ, digits=st.integers(0, 9))
def test_seconds_pass_from_any_start_with_any_digits(start_s: float, rate_hz: float, digits: int) -> None:
    assert verdict(texts(start_s, rate_hz, digits), rate_hz).status is Status.PASS


@given(
    start=st.floats(0, 2e9),
    rate_hz=RATES_HZ,
    pace=st.floats(-1e9, 1e9).filter(lambda pace: not 0.5 < pace < 1.5),
)
def test_no_other_pace_passes(start: float, rate_hz: float, pace: float) -> None:
    found = verdict(texts(start, rate_hz, 3, pace), rate_hz)
    assert found.status is Status.FAIL
    assert found.hint


@pytest.mark.full
@given(text=st.text(max_size=20), at=st.integers(0, 60))
def test_one_message_with_other_words_does_not_pass(text: str, at: int) -> None:
    told = texts(5, 10, 2)
    told[at] = f"The time was {text}"
    found = verdict(told, 10)
    assert found.status in {Status.FAIL, Status.PARTIAL}  # it may tell the time
    assert "\n" not in found.message


@given(values=st.lists(st.integers(0, 2**63), min_size=40, max_size=70, unique=True))
def test_random_numbers_fail(values: list[int]) -> None:
    assert verdict([f"The time is {value}" for value in values], 10).status is Status.FAIL


@pytest.mark.parametrize(
    ("hidden", "shown"),
    [
        ("\u200b", "\\\\u200b"),
        ("\x1b[31m", "\\\\x1b[31m"),
        ("\x00", "\\\\x00"),
        ("\u202e", "\\\\u202e"),
        ("\ufeff", "\\\\ufeff"),
    ],
)
def test_what_cannot_be_seen_in_a_message_is_named(hidden: str, shown: str) -> None:
    found = verdict([f"The {hidden}time is {i / 10:.3f}" for i in range(60)], 10)
    assert found.status is Status.PARTIAL
    assert f"The {shown}time is 0.000" in found.message


@pytest.mark.parametrize(
    ("values", "wanted", "near"),
    [
        (["White"], "white", ("White",)),
        (["whte", "white"], "white", ("whte",)),
        (["red"], "white", ()),
        ([3, ""], "white", ()),
        (["White"], 3, ()),
    ],
)
def test_texts_that_are_a_slip_of_the_right_one_are_sought_in_the_script(
    values: list[object], wanted: object, near: tuple[str, ...]
) -> None:
    assert near_texts(values, wanted) == near


@pytest.mark.parametrize("word", ["{counter}", "{}", "{number}", "%d"])
def test_another_word_in_braces_is_refused(word: str) -> None:
    with pytest.raises(ValidationError, match=re.escape(": write {seconds} or {count}")):
        MessageParams(topic="/chatter", template=f"hello {word}")
