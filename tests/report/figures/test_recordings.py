"""Figures of real recordings, whose truth is known."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import pytest

from grader.evidence.reader import load_evidence
from grader.evidence.run import Run
from grader.judging import judge
from grader.model.figure import CodeFigure, CounterFigure, Figures, HeardFigure, RateFigure
from grader.report.figures import figures_of
from grader.rubric.load import load_rubric
from tests.report.figures.made import only

RECORDINGS = Path(__file__).parents[2] / "data" / "recordings"


def figures(name: str) -> tuple[Figures, dict[str, Run]]:
    rubric = load_rubric("leeds-comp3631-lab1")
    runs = load_evidence([RECORDINGS / name])
    return figures_of(rubric.rubric, runs, judge(rubric.rubric, runs, rubric.checks)), runs


@pytest.fixture(scope="module")
def correct() -> tuple[Figures, dict[str, Run]]:
    return figures("correct")


@pytest.mark.parametrize(
    ("name", "topic"), [("chatter-rate", "/chatter"), ("numeric-rate", "/numeric_chatter")]
)
def test_rate(correct: tuple[Figures, dict[str, Run]], name: str, topic: str) -> None:
    figure = only(correct[0], name, RateFigure)
    (channel,) = correct[1]["talker"].student_channels(topic)
    start_ns = correct[1]["talker"].start_ns
    assert figure.topic == topic
    assert figure.publisher == channel.callerid
    assert figure.messages == 61
    assert figure.times_s == pytest.approx([(t - start_ns) / 1e9 for t in channel.times_ns[1:]], abs=1e-6)
    assert figure.gaps_s == pytest.approx([(b - a) / 1e9 for a, b in pairwise(channel.times_ns)], abs=1e-6)
    assert figure.mean_hz == pytest.approx(10, abs=0.01)
    assert (figure.low_hz, figure.high_hz) == (9.5, 10.5)
    assert (figure.gap_low_s, figure.gap_high_s) == pytest.approx((0.05, 0.15))
    assert not figure.ends_silent
    assert figure.late == ()


def test_counter(correct: tuple[Figures, dict[str, Run]]) -> None:
    for name in ("counter-step", "counter-wrap"):
        figure = only(correct[0], name, CounterFigure)
        assert figure.values == (*range(128), *range(128), 0, 1)
        assert all(isinstance(value, int) for value in figure.values)
        assert figure.wraps == (128, 256)
        assert figure.wrong == ()
        assert figure.texts == ()
        assert figure.messages == 258
    first = only(correct[0], "counter-start", CounterFigure)
    assert first.values == tuple(range(40))
    assert first.numbers == tuple(range(40))


def test_heard(correct: tuple[Figures, dict[str, Run]]) -> None:
    figure = only(correct[0], "listener-numeric", HeardFigure)
    sent = [e.value for _, e in correct[1]["listener"].actors if e.topic == "/numeric_chatter"]
    assert [row.sent for row in figure.rows] == [str(value) for value in sent]
    assert [row.heard for row in figure.rows] == [f"I heard the number {value}" for value in sent]
    assert all(0 <= row.after_s < 0.1 for row in figure.rows if row.after_s is not None)
    texts = only(correct[0], "listener-chatter", HeardFigure)
    assert all(row.heard == f"I heard {row.sent}" for row in texts.rows)


def test_graphs(correct: tuple[Figures, dict[str, Run]]) -> None:
    launch = correct[0].graphs["launch"]
    assert launch.nodes == ("/talker", "/listener")
    assert launch.topics == ("/chatter",)
    assert launch.types == {"/chatter": "std_msgs/String"}
    assert {(e.node, e.topic, e.publishes) for e in launch.edges} == {
        ("/talker", "/chatter", True),
        ("/listener", "/chatter", False),
    }
    assert set(correct[0].graphs) == {"talker", "wraps", "listener", "launch"}
    (talker,) = correct[0].graphs["talker"].nodes
    assert talker.startswith("/numeric_talker_")


def test_consoles(correct: tuple[Figures, dict[str, Run]]) -> None:
    talker = correct[0].consoles["talker"]
    assert len(talker.lines) == 61
    assert all("hello world" in line.text and line.process == "talker" for line in talker.lines)
    assert [line.at_s for line in talker.lines] == sorted(line.at_s for line in talker.lines)
    assert (len(correct[0].consoles["wraps"].lines), correct[0].consoles["wraps"].left_out) == (200, 58)
    assert {line.process for line in correct[0].consoles["package"].lines} == {"catkin_make"}


def test_code(correct: tuple[Figures, dict[str, Run]]) -> None:
    manifest = only(correct[0], "manifest", CodeFigure)
    lines = correct[1]["package"].attachments["package.xml"].decode().splitlines()
    assert manifest.lines == tuple(lines[: len(manifest.lines)])
    assert manifest.marked == (3,)
    assert lines[2] == "  <name>lab1</name>"


def test_a_counter_whose_node_dies_at_128() -> None:
    found, _ = figures("dies-at-128")
    wrap = only(found, "counter-wrap", CounterFigure)
    assert [words for _, words in wrap.died] == ["talker ended: ROSSerializationException"]
    assert wrap.values == tuple(range(128))
    assert wrap.wraps == ()
    assert wrap.wrong == (127,)
    assert wrap.texts[0].startswith("the node dies at 128")
    assert only(found, "counter-step", CounterFigure).wrong == ()


def test_equal_evidence_gives_equal_figures(correct: tuple[Figures, dict[str, Run]]) -> None:
    again, _ = figures("correct")
    assert again == correct[0]
    assert Figures.model_validate_json(again.model_dump_json()) == again


def test_hidden_criteria_have_no_figures(correct: tuple[Figures, dict[str, Run]]) -> None:
    rubric = load_rubric("leeds-comp3631-lab1")
    shown = [c for c in judge(rubric.rubric, correct[1], rubric.checks) if c.id == "chatter-rate"]
    assert set(figures_of(rubric.rubric, correct[1], shown).by_criterion) == {"chatter-rate"}
    assert set(correct[0].by_criterion) > {"chatter-rate"}
