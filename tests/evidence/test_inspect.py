"""What is in a file, whoever recorded it, with rates as `rostopic hz` gives them."""

from __future__ import annotations

import random
from itertools import accumulate, pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rosbags.rosbag1 import Writer
from rosbags.rosbag1.writer import Writer as BagWriter
from rosbags.typesys import Stores, get_typestore

from grader.errors import EvidenceError
from grader.evidence import decode
from grader.evidence.inspect import inspect_file, periodic_share, rate_stats
from grader.evidence.reader import load_run
from tests.evidence.samples import T0, sample
from tests.support.timeline import write_runs

MS = 1_000_000


def write_bag(path, *, compression=None, count=20):
    store = get_typestore(Stores.ROS1_NOETIC)
    bag = Writer(path)
    if compression:
        bag.set_compression(compression)
    with bag:
        numbers = bag.add_connection(
            "/n", "std_msgs/msg/Int8", typestore=store, callerid="/counter", latching=1
        )
        texts = bag.add_connection("/chatter", "std_msgs/msg/String", typestore=store)
        for n in range(count):
            bag.write(numbers, T0 + n * 100 * MS, decode.encode("std_msgs/Int8", {"data": n}))
        bag.write(texts, T0 + 50, decode.encode("std_msgs/String", {"data": "hé"}))
    return path


def test_a_recording_of_our_own(tmp_path):
    [path] = write_runs(
        {
            "scenario": "talker",
            "topics": [{"topic": "/c", "count": 51, "latching": True}, {"topic": "/silent", "count": 0}],
            "processes": [
                {"name": "talker", "exit_code": 1, "exit_s": 4, "cpu_s": 0.2},
                {"name": "talker", "start_s": 5},
            ],
            "host": [{"max_ms": 3}, {"max_ms": 40, "at_s": 2}],
            "outcome": "ended",
            "outcome_detail": "it died",
        },
        tmp_path,
    )
    found = inspect_file(path)
    assert (found.kind, found.file, found.scenario, found.messages) == ("grader", "talker.mcap", "talker", 51)
    chatter, silent = found.channels
    assert (chatter.topic, chatter.publisher, chatter.type, chatter.latching) == (
        "/c",
        "/talker",
        "std_msgs/String",
        True,
    )
    assert (chatter.rate.mean_hz, chatter.rate.gap_max_s, chatter.readable) == (10.0, 0.1, True)
    assert silent.rate.count == 0
    assert [(p.start_s, p.exit_s, p.exit_code) for p in found.processes] == [(0, 4, 1), (5, None, None)]
    assert found.nodes == ("/talker",)
    assert (found.late_max_ms, found.outcome, found.outcome_detail) == (40, "ended", "it died")


def test_messages_that_cannot_be_read_are_counted_all_the_same(tmp_path):
    [path] = write_runs({"topics": [{"topic": "/c", "raw": ["ff"]}]}, tmp_path)
    [channel] = inspect_file(path).channels
    assert (channel.readable, channel.rate.count, channel.bytes) == (False, 1, 1)


@pytest.mark.parametrize("compression", [None, *BagWriter.CompressionFormat])
def test_a_bag(tmp_path, compression):
    path = write_bag(tmp_path / "week 1.bag", compression=compression)
    found = inspect_file(path)
    assert (found.kind, found.scenario, found.clock, found.outcome) == ("bag", "week 1", "real", None)
    chatter, numbers = found.channels
    assert (numbers.topic, numbers.type, numbers.publisher) == ("/n", "std_msgs/Int8", "/counter")
    assert (numbers.latching, chatter.latching) == (True, False)
    assert numbers.md5sum == "27ffa0c9c4b8fb8492252bcad9e5c57b"
    assert (numbers.rate.mean_hz, found.duration_s) == (pytest.approx(10), pytest.approx(1.9))
    assert found.nodes == ("/counter",)
    by_topic = {c.topic: c for c in load_run(path).channels}
    assert by_topic["/n"].data == tuple(range(20))
    assert by_topic["/chatter"].data == ("hé",)


def test_a_bag_cut_anywhere_is_refused_in_one_line(tmp_path):
    whole = write_bag(tmp_path / "a.bag").read_bytes()
    cut = tmp_path / "cut.bag"
    for length in (*range(60), *range(60, len(whole), 211), len(whole) - 1):
        cut.write_bytes(whole[:length])
        with pytest.raises(EvidenceError) as caught:
            inspect_file(cut)
        assert "\n" not in caught.value.message
        assert str(cut) in caught.value.message


def test_what_cannot_be_read_is_an_evidence_error(tmp_path):
    (tmp_path / "a.mcap").write_bytes(sample()[:-20])
    with pytest.raises(EvidenceError, match="cut short"):
        inspect_file(tmp_path / "a.mcap")


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
