"""Whatever the evidence holds: figures are of bounded size, can be written as JSON, and nothing raises."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from itertools import pairwise
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from grader.evidence.events import ActorEvent, ConsoleLine, ProcessEvent
from grader.evidence.run import Message, Run
from grader.judging import judge
from grader.model.figure import (
    POINTS_MAX,
    CounterFigure,
    Figures,
    HeardFigure,
    PathFigure,
    PlaceFigure,
    RateFigure,
)
from grader.report.figures import DRAWN, figures_of
from tests.checks.examples import runs_of
from tests.report.figures.made import criterion, drawn, only
from tests.support.rubrics import rubric

TOPIC = "/x"
START_NS = 1_700_000_000_000_000_000
ALL = (
    criterion("rate", topic=TOPIC, rate_hz=10),
    criterion("counter-start", topic=TOPIC),
    criterion("counter-step", topic=TOPIC),
    criterion("counter-wrap", topic=TOPIC),
    criterion("hears", topic=TOPIC),
    criterion("path", topic=TOPIC, points=[[1, 0]], tolerance_m=0.1),
    criterion("ends-at", topic=TOPIC, goal=[1, 0], tolerance_m=0.1),
    criterion("stays-within", topic=TOPIC, box=[[0, 0], [1, 1]]),
)


def assert_sound(figures: Figures) -> None:
    """Points, indices and texts are as the records say, and JSON brings the same back."""
    text = figures.model_dump_json()
    assert len(text) < 200_000
    json.loads(text, parse_constant=lambda name: pytest.fail(f"{name} is no JSON"))
    assert Figures.model_validate_json(text) == figures
    for figure in (f for found in figures.by_criterion.values() for f in found):
        if isinstance(figure, RateFigure):
            assert 1 <= len(figure.times_s) == len(figure.gaps_s) <= POINTS_MAX
            assert list(figure.times_s) == sorted(figure.times_s)
        elif isinstance(figure, CounterFigure):
            _sound_counter(figure)
        elif isinstance(figure, PathFigure):
            assert 1 <= len(figure.points) <= POINTS_MAX
            assert figure.strayed is None or figure.strayed < len(figure.points)
        elif isinstance(figure, PlaceFigure):
            assert 1 <= len(figure.points) <= POINTS_MAX
            assert figure.wrong is None or figure.wrong < len(figure.points)
            assert len(figure.says) <= 300
        elif isinstance(figure, HeardFigure):
            assert len(figure.rows) <= 60
            assert all(len(row.sent) <= 200 and len(row.heard or "") <= 200 for row in figure.rows)


def _sound_counter(figure: CounterFigure) -> None:
    points = len(figure.times_s)
    assert points == len(figure.values) == len(figure.numbers) <= POINTS_MAX
    assert all(a < b for a, b in pairwise(figure.numbers))
    assert len(figure.wrong) == len(figure.texts)
    assert all(0 <= i < points for i in (*figure.wraps, *figure.wrong))
    assert all(math.isfinite(value) for value in figure.values)
    assert all(len(text) <= 200 for text in figure.texts)


NUMBERS = st.one_of(
    st.lists(st.integers(-(2**63), 2**63 - 1), min_size=1, max_size=60).map(lambda v: ("std_msgs/Int64", v)),
    st.lists(st.floats(), min_size=1, max_size=60).map(lambda v: ("std_msgs/Float64", v)),
    st.lists(st.text(st.characters(exclude_categories=["Cs"])), min_size=1, max_size=30).map(
        lambda v: ("std_msgs/String", v)
    ),
)


@pytest.mark.full
@given(sent=NUMBERS, count=st.integers(1, 2000), rate_hz=st.floats(0.5, 1000))
def test_any_messages(sent: tuple[str, list[Any]], count: int, rate_hz: float) -> None:
    kind, values = sent
    figures, results = drawn(
        {"topics": [{"topic": TOPIC, "type": kind, "values": values, "count": count, "rate_hz": rate_hz}]},
        *ALL,
    )
    assert_sound(figures)
    for name, result in results.items():
        marks = [f.wrong for f in figures.by_criterion.get(name, ()) if isinstance(f, CounterFigure)]
        assert result.status.value != "pass" or not any(marks)


@pytest.mark.full
@given(
    values=st.lists(st.one_of(st.integers(), st.floats(), st.text(), st.none(), st.lists(st.integers()))),
    lines=st.lists(st.text()),
    name=st.text(),
    times=st.lists(st.integers(0, 2**63), max_size=20),
)
def test_any_events(values: list[object], lines: list[str], name: str, times: list[int]) -> None:
    """As records, past what an evidence file can hold."""
    runs = runs_of({"run": {"topics": [{"topic": TOPIC, "count": 3}]}})
    (channel,) = runs["run"].channels
    messages = tuple(Message(t, i, b"\xff" * i) for i, t in enumerate(times))
    run = replace(
        runs["run"],
        channels=(replace(channel, callerid=name, messages=messages, definition=name),),
        actors=tuple(
            (START_NS, ActorEvent(action="publish", actor="a", topic=TOPIC, value=value)) for value in values
        ),
        console=tuple((START_NS, ConsoleLine(process=name, stream="stdout", line=line)) for line in lines),
        processes=((START_NS, ProcessEvent(event="start", name=name, role="student")),),
    )
    figures, _ = drawn(run, *ALL)
    assert_sound(figures)


class Broken(Run):
    """A run of which every question raises."""

    def __getattribute__(self, name: str) -> Any:
        if name in {"channels", "graph", "console", "processes", "actors"}:
            raise RuntimeError(name)
        return super().__getattribute__(name)


def test_what_raises_is_left_out() -> None:
    run = runs_of({"run": {"topics": [{"topic": TOPIC, "count": 30}]}})["run"]
    broken = Broken(**{name: getattr(run, name) for name in run.__dataclass_fields__})
    figures, results = drawn(broken, *ALL)
    assert figures == Figures()
    assert {result.status.value for result in results.values()} == {"error"}


def test_runs_that_the_rubric_does_not_know_and_none_at_all() -> None:
    asked = rubric(*ALL)
    runs = runs_of({"run": {"topics": [{"topic": TOPIC, "count": 30}]}})
    assert figures_of(asked, {"another": runs["run"]}, judge(asked, {})) == Figures()
    assert figures_of(asked, {}, ()) == Figures()


@pytest.mark.full
def test_a_flood_of_a_hundred_thousand_messages_from_a_name_of_ten_thousand_letters() -> None:
    topic = {
        "topic": TOPIC,
        "type": "std_msgs/Int32",
        "count": 100_000,
        "rate_hz": 2000,
        "callerid": "/" + "y" * 10_000,
    }
    figures, _ = drawn({"topics": [{**topic, "values": {"count_from": 0, "wrap_after": 127}}]}, *ALL)
    assert_sound(figures)
    wrap = only(figures, "counter-wrap", CounterFigure)
    assert len(wrap.publisher) == 200
    assert wrap.messages == 100_000
    assert [wrap.values[i] for i in wrap.wraps] == [0] * len(wrap.wraps)
    assert [wrap.values[i - 1] for i in wrap.wraps] == [127] * len(wrap.wraps)
    assert len(wrap.wraps) >= 60


@pytest.mark.full
@pytest.mark.parametrize("at", [700, 4321, 9998])
def test_of_a_long_sequence_the_wrong_step_stays_with_its_surroundings(at: int) -> None:
    topic = {
        "topic": TOPIC,
        "type": "std_msgs/Int32",
        "values": {"count_from": 0},
        "count": 10_000,
        "replace": {at: 5},
    }
    figures, results = drawn({"topics": [topic]}, criterion("counter-step", topic=TOPIC, maximum=20_000))
    figure = only(figures, "counter-step", CounterFigure)
    (wrong,) = figure.wrong
    assert figure.numbers[wrong] == at + 1
    assert figure.values[wrong - 2 : wrong + 1] == (at - 1, 5, at + 1)
    assert results["counter-step"].message.endswith(
        f"after 5 comes {at + 1} (value {at + 2}, {(at + 1) / 10:.1f} s after the first)"
    )


def test_of_very_many_wrong_steps_the_first_are_named() -> None:
    topic = {"topic": TOPIC, "type": "std_msgs/Int32", "values": {"count_from": 0, "step": 2}, "count": 5000}
    figures, _ = drawn({"topics": [topic]}, criterion("counter-step", topic=TOPIC))
    figure = only(figures, "counter-step", CounterFigure)
    assert len(figure.wrong) == 40
    assert figure.more_wrong == 4999 - 40
    assert figure.texts[0] == "after 0 comes 2"


def test_of_very_many_probes_those_that_were_not_heard_stay() -> None:
    sent = [f"word{i:04}" for i in range(500)]
    run = {
        "processes": [{"name": "listener"}],
        "actors": [{"action": "publish", "topic": TOPIC, "values": sent, "every_s": 0.01}],
        "console": [
            {
                "process": "listener",
                "lines": [s for s in sent if s != "word0444"],
                "at_s": 6,
                "every_s": 0.001,
            }
        ],
    }
    figures, results = drawn(run, criterion("hears", topic=TOPIC))
    figure = only(figures, "hears", HeardFigure)
    assert results["hears"].measured == "499 of 500 messages printed"
    assert (len(figure.rows), figure.left_out) == (60, 440)
    assert [row.sent for row in figure.rows if row.heard is None] == ["word0444"]


def test_what_is_printed_in_other_words_is_shown_beside_what_is_not_printed() -> None:
    run = {
        "processes": [{"name": "listener"}],
        "actors": [{"action": "publish", "topic": TOPIC, "values": ["one", "two"], "every_s": 0.5}],
        "console": [{"process": "listener", "lines": ["I heard one", "got two"], "at_s": 3, "every_s": 0.5}],
    }
    figures, results = drawn(run, criterion("hears", topic=TOPIC, template="I heard {value}"))
    rows = only(figures, "hears", HeardFigure).rows
    assert [(row.heard, row.other_words) for row in rows] == [("I heard one", False), ("got two", True)]
    assert results["hears"].measured == "2 of 2 messages printed, 1 of them in other words"


def test_every_check_that_is_drawn_is_tried_here() -> None:
    assert {c["check"] for c in ALL} == set(DRAWN)
