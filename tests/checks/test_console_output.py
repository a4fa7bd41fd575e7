"""Whatever a listener writes around a number, it is found, and no other is."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from grader.checks.support.console_output import in_order, numbers_in
from grader.model.verdict import Status
from tests.checks.examples import judge_runs
from tests.support.timeline import build_runs

INT8 = st.integers(-128, 127)
FORMS = [
    "{}", "data: {}", "I heard {}", "I heard{}", "heard: {}.", "({})", "[{}]", "{},", "number={}", "'{}'", "{}!",
    "I heard...{}", "number-{}", "2026-11-22 21:17:35,123 - INFO - {}", "[2026-11-22T21:17:35.123456+00:00] {} of 3",
    "{} (Int8)", "Int8 {}", "{}.0", "+{}", "\x1b[32m{}\x1b[0m", "got {} at 12:30:05.25", "received {}\n",
]  # fmt: skip


def status(topic: str, sent: list[Any], lines: list[str], **params: Any) -> Status:
    kinds = {bool: "Bool", int: "Int8", float: "Float64", str: "String"}
    kind = f"std_msgs/{kinds[type(sent[0])]}"
    run = {
        "processes": [{"name": "listener", "stopped_by": "INT", "exit_s": 9}],
        "actors": [
            {"action": "publish", "topic": topic, "type": kind, "values": sent, "at_s": 1, "every_s": 0.05}
        ],
        "console": [{"process": "listener", "lines": lines, "at_s": 1.01, "every_s": 0.05}] if lines else [],
    }
    runs = build_runs({"runs": {"run": run}, "package": {}})
    return judge_runs("hears", {"topic": topic, **params}, runs).status


@pytest.mark.parametrize("form", [f for f in FORMS if f != "+{}"])
@pytest.mark.parametrize("value", [-128, -1, 0, 7, 127])
def test_forms(form: str, value: int) -> None:
    from grader.untrusted_text import without_colours  # noqa: PLC0415 - only this test looks below the check

    assert value in numbers_in(without_colours(form.format(value)))


@pytest.mark.parametrize(
    ("text", "missing"),
    [
        ("127", 12), ("127", 27), ("3.12", 12), ("12.5", 12), ("-12", 12), ("12", -12), ("1.2.3", 2),
        ("0x0c", 12), ("<function f at 0x7f14>", 14),
        ("<function f at 0x7f14>", 0), ("1e3", 1000), ("", 0), ("zero", 0), ("٣", 3),
    ],
)  # fmt: skip
def test_no_number_where_there_is_none(text: str, missing: int) -> None:
    assert missing not in numbers_in(text)


@given(sent=st.lists(INT8, min_size=3, max_size=12), form=st.sampled_from(FORMS))
def test_who_prints_all_passes(sent: list[int], form: str) -> None:
    if form == "+{}" and min(sent) < 0:
        return
    assert status("/numeric_chatter", sent, [form.format(v).strip() for v in sent]) is Status.PASS


@given(
    sent=st.lists(INT8, min_size=3, max_size=12, unique=True),
    between=st.sampled_from([", ", "\r", " ", "\t", "; "]),
)
def test_who_prints_all_in_one_line_passes(sent: list[int], between: str) -> None:
    run = {
        "processes": [{"name": "listener", "stopped_by": "INT", "exit_s": 9}],
        "actors": [{"action": "publish", "topic": "/n", "type": "std_msgs/Int8", "values": sent, "at_s": 1}],
        "console": [{"process": "listener", "line": between.join(map(str, sent)), "at_s": 9}],
    }
    runs = build_runs({"runs": {"run": run}, "package": {}})
    assert judge_runs("hears", {"topic": "/n"}, runs).status is Status.PASS


@given(sent=st.lists(INT8, min_size=3, max_size=12, unique=True))
def test_who_prints_what_came_so_far_passes(sent: list[int]) -> None:
    lines = [f"received {value} so far {sent[: i + 1]}" for i, value in enumerate(sent)]
    assert status("/numeric_chatter", sent, lines) is Status.PASS


@pytest.mark.parametrize("form", ["number-{}", "number...-{}", "number: {}", "number={}"])
def test_who_prints_the_absolute_value_fails(form: str) -> None:
    assert (
        status("/numeric_chatter", [-128, 5, 127, -7], [form.format(n) for n in (128, 5, 127, 7)])
        is Status.FAIL
    )


@given(sent=st.lists(INT8, min_size=3, max_size=12, unique=True), data=st.data())
def test_who_leaves_one_out_fails(sent: list[int], data: st.DataObject) -> None:
    left_out = data.draw(st.sampled_from(sent))
    assert status("/numeric_chatter", sent, [str(v) for v in sent if v != left_out]) is Status.FAIL


@given(sent=st.lists(INT8, min_size=4, max_size=12, unique=True), shift=st.integers(1, 255))
def test_who_prints_other_numbers_fails(sent: list[int], shift: int) -> None:
    assert status("/numeric_chatter", sent, [str(v + shift) for v in sent]) is Status.FAIL


@given(
    sent=st.lists(st.text("abcdefghij ", min_size=6, max_size=16).filter(str.strip), min_size=2, max_size=6)
)
def test_texts(sent: list[str]) -> None:
    assert status("/chatter", sent, [f"I heard {text}" for text in sent]) is Status.PASS


@given(
    sent=st.lists(st.text("abcdefghijXYZ", min_size=6, max_size=16), min_size=2, max_size=6, unique=True),
    words=st.sampled_from(
        ["I heard {}", "i HEARD {}", "  I  heard   {}", "/listener: I heard {}", "I got {}", "{}"]
    ),
)
def test_a_template_s_own_words(sent: list[str], words: str) -> None:
    lines = [words.format(text) for text in sent]
    expected = Status.PASS if "heard" in words.lower() else Status.PARTIAL
    assert status("/chatter", sent, lines, template="I heard {value}") is expected
    swapped = [words.format(text.swapcase()) for text in sent]
    assert status("/chatter", sent, swapped, template="I heard {value}") is Status.FAIL


@pytest.mark.parametrize(
    ("sent", "form", "right"),
    [
        ([0.5, -7.25, 3.0], "{}", True),
        ([0.5, -7.25, 3.0], "I heard: [{:.2f}] at 12.5", True),
        ([0.5, -7.25, 3.0], "{:f}", True),
        ([0.1, 123.456], "data: {:.17g}", True),
        ([0.1, 123.456], "got {:.2f}.", True),
        ([0.5, 7.25], "* RESULT: SUCCESS. 1.2.3", False),
        ([0.5, 7.25], "1{}", False),
        ([0.5, 7.25], "-{}", False),
        ([0.001, 7.25], "{:.1f}", False),
        ([True, False], "{}", True),
        ([True, False], "heard: {:d}", True),
        ([True, False], "{}ly false", False),
    ],
)
def test_floats_and_truth_values(sent: list[Any], form: str, right: bool) -> None:
    lines = [form.format(value) for value in sent]
    expected = Status.PASS if right else Status.FAIL
    assert status("/heard", sent, lines) is expected
    if form == "{}":
        words = [f"I heard {line}" for line in lines]
        assert status("/heard", sent, words, template="I heard {value}") is Status.PASS


def test_nothing_printed_fails() -> None:
    assert status("/chatter", ["abcdef"], []) is Status.FAIL


@given(st.lists(st.lists(st.integers(0, 20), max_size=5).map(lambda p: tuple(sorted(p))), max_size=6))
def test_in_order_is_exact(places: list[tuple[int, ...]]) -> None:
    """Against trying every choice."""

    def possible(rest: list[tuple[int, ...]], behind: int) -> bool:
        return not rest or any(possible(rest[1:], place) for place in rest[0] if place > behind)

    assert in_order(places) is possible(places, -1)
