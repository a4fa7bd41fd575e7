"""The rate: who sends, when the machine was late, and which gaps stay of a flood."""

from __future__ import annotations

import pytest

from grader.model.figure import POINTS_MAX, RateFigure
from tests.report.figures.made import criterion, drawn, only

RATE = criterion("rate", topic="/chatter", rate_hz=10)
CHATTER = {"topic": "/chatter", "count": 61}


def test_several_publishers_are_shown_together_and_each() -> None:
    other = {**CHATTER, "callerid": "/other", "start_s": 0.55}
    figures, _ = drawn({"topics": [CHATTER, other]}, RATE)
    found = [f for f in figures.by_criterion["rate"] if isinstance(f, RateFigure)]
    assert [f.publisher for f in found] == ["/talker and /other", "/talker", "/other"]
    assert [f.messages for f in found] == [122, 61, 61]
    assert found[0].mean_hz == pytest.approx(20, abs=0.2)
    assert [f.mean_hz for f in found[1:]] == pytest.approx([10, 10], abs=0.01)


def test_only_three_of_many_publishers_are_shown_alone() -> None:
    topics = [{**CHATTER, "callerid": f"/talker{i}"} for i in range(9)]
    figures, _ = drawn({"topics": topics}, RATE)
    assert len(figures.by_criterion["rate"]) == 4


def test_late_stretches_lie_where_the_machine_was_late() -> None:
    host = [{"at_s": 2}, {"at_s": 3, "mean_ms": 6, "p95_ms": 30, "max_ms": 120}, {"at_s": 7}]
    figures, _ = drawn({"topics": [CHATTER], "host": host}, RATE)
    ((begin_s, end_s),) = only(figures, "rate", RateFigure).late
    assert begin_s == pytest.approx(2, abs=0.51)
    assert end_s == pytest.approx(3, abs=0.51)


def test_a_punctual_machine_has_no_late_stretches() -> None:
    figures, _ = drawn({"topics": [CHATTER], "host": [{"at_s": at} for at in range(1, 8)]}, RATE)
    assert only(figures, "rate", RateFigure).late == ()


def test_silence_at_the_end_is_the_last_gap() -> None:
    figures, _ = drawn(
        {
            "topics": [{**CHATTER, "count": 40}],
            "processes": [{"name": "talker", "stopped_by": "INT", "exit_code": 0, "exit_s": 11}],
            "actors": [{"action": "interrupt", "actor": "grader", "detail": "talker", "at_s": 10.5}],
            "outcome": "silent",
        },
        RATE,
    )
    figure = only(figures, "rate", RateFigure)
    assert figure.ends_silent
    assert figure.times_s[-1] == pytest.approx(10.5)
    assert figure.gaps_s[-1] == pytest.approx(6.1)


@pytest.mark.full
def test_of_a_flood_the_longest_and_the_shortest_gap_stay() -> None:
    flood = {
        "topic": "/chatter",
        "count": 20_000,
        "rate_hz": 400,
        "gaps": [{"before": 11_234, "pause_s": 3}],
    }
    figures, _ = drawn({"topics": [flood], "end_s": 60}, RATE)
    figure = only(figures, "rate", RateFigure)
    assert len(figure.times_s) == len(figure.gaps_s) <= POINTS_MAX
    assert len(figure.times_s) > POINTS_MAX / 2
    assert figure.messages == 20_000
    assert max(figure.gaps_s) == pytest.approx(3.0025, abs=1e-4)
    assert figure.times_s[-1] == pytest.approx(53.5, abs=0.1)


@pytest.mark.full
def test_a_choice_of_points_keeps_the_share_of_short_gaps() -> None:
    """Ten messages in each burst: nine gaps in ten are short, and no rhythm of the choice meets that of the bursts."""
    figures, _ = drawn({"topics": [{"topic": "/chatter", "count": 20_000, "burst": 10}], "end_s": 2001}, RATE)
    figure = only(figures, "rate", RateFigure)
    short = sum(gap < 0.05 for gap in figure.gaps_s) / len(figure.gaps_s)
    assert short == pytest.approx(0.9, abs=0.07)


@pytest.mark.parametrize(
    "run",
    [
        {},
        {"topics": [{"topic": "/chatter", "count": 1}]},
        {"topics": [CHATTER], "clock": "warped", "warp": 20},
        {"topics": [CHATTER], "outcome": None},
        {"topics": [CHATTER], "outcome": "host"},
    ],
)
def test_nothing_is_drawn_where_no_rate_is_judged(run: dict[str, object]) -> None:
    figures, _ = drawn(run, RATE)
    assert "rate" not in figures.by_criterion


def test_a_flood_is_counted_by_tenths_of_a_second() -> None:
    figures, _ = drawn({"topics": [{"topic": "/chatter", "count": 2001, "rate_hz": 1000}]}, RATE)
    figure = only(figures, "rate", RateFigure)
    assert len(figure.counts) == 19
    assert set(figure.counts) <= {99, 100, 101}
    assert sum(figure.counts) <= figure.messages == 2001


def test_no_other_rate_is_counted() -> None:
    figures, _ = drawn({"topics": [CHATTER]}, RATE)
    assert only(figures, "rate", RateFigure).counts == ()


def test_a_lost_rate_says_nothing_of_a_late_machine() -> None:
    host = [{"at_s": 2}, {"at_s": 3, "mean_ms": 6, "p95_ms": 30, "max_ms": 120}, {"at_s": 7}]
    figures, results = drawn({"topics": [{**CHATTER, "count": 3000, "rate_hz": 500}], "host": host}, RATE)
    assert results["rate"].status.is_lost
    assert only(figures, "rate", RateFigure).late == ()
