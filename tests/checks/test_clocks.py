"""What the machine did, from the arena's timer and the calibration publisher, and what a rate check makes of it."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import replace
from itertools import accumulate

import pytest

from grader.checks.rate import RateParams, rate
from grader.checks.support.clocks import CALIBRATION, lateness
from grader.evidence.events import HostEvent, ScenarioEvent
from grader.evidence.run import Channel, Message, Run
from grader.model.package import PackageFacts
from grader.model.verdict import Status

MS = 1_000_000
START_NS = 1_700_000_000_000_000_000


def channel(topic: str, gaps_ms: Sequence[float], callerid: str, *, stamped: bool = False) -> Channel:
    times = [START_NS + int(t * MS) for t in accumulate([0.0, *gaps_ms])]
    data = [
        struct.pack("<IIII", i, t // 10**9, t % 10**9, 0) if stamped else b"" for i, t in enumerate(times)
    ]
    return Channel(
        topic=topic,
        callerid=callerid,
        type="std_msgs/Header" if stamped else "std_msgs/String",
        md5sum="0",
        definition="",
        latching=False,
        messages=tuple(Message(t, i, d) for i, (t, d) in enumerate(zip(times, data, strict=True))),
    )


def run_of(gaps_ms: Sequence[float], slept_ms: Sequence[float] = (), *, timer_ms: float = 0.2) -> Run:
    """A topic with these gaps beside a calibration whose sleeps took so long, and a timer that was late by so much."""
    channels = [channel("/chatter", gaps_ms, "/talker")]
    if slept_ms:
        channels.append(channel(CALIBRATION, slept_ms, "/grader_calibration_00c0ffee", stamped=True))
    host = HostEvent(samples=50, mean_ms=timer_ms / 4, p95_ms=timer_ms / 2, max_ms=timer_ms, load_1min=1.0)
    end_ns = START_NS + int(sum(gaps_ms) * MS)
    return Run(
        evidence="run.mcap",
        scenario="run",
        clock="real",
        warp=1.0,
        metadata={"format": "1"},
        start_ns=START_NS,
        end_ns=end_ns,
        channels=tuple(channels),
        host=tuple((START_NS + i * 500 * MS, host) for i in range(1, 20)),
        course=((end_ns, ScenarioEvent(event="end", outcome="complete")),),
    )


def status(run: Run) -> Status:
    return rate(NO_FACTS, run, RateParams(topic="/chatter", rate_hz=10)).status


NO_FACTS = PackageFacts.model_construct(slips=())
IDLE, BUSY = [100.1] * 60, [107.0] * 60


def test_the_calibration_tells_how_long_sleeps_took() -> None:
    found = lateness(run_of([100] * 60, [101.0, 103.0] * 30), START_NS, START_NS + 6_000 * MS)
    assert found is not None
    assert found.sleep_ms == pytest.approx(2.0, abs=0.02)
    assert found.max_ms == pytest.approx(3.0, abs=0.02)
    assert found.calibration_hz == pytest.approx(1000 / 102, abs=0.01)
    assert found.described == "machine late by 3 ms, calibration 9.81 Hz"


def test_only_the_stretch_that_is_asked_for_counts() -> None:
    run = run_of([100] * 60, [100.0] * 30 + [180.0] + [100.0] * 30)
    calm = lateness(run, START_NS, START_NS + 2_500 * MS)
    stalled = lateness(run, START_NS + 2_500 * MS, START_NS + 4_000 * MS)
    assert calm is not None
    assert stalled is not None
    assert (round(calm.max_ms), round(stalled.max_ms)) == (0, 80)


def test_the_timer_counts_where_it_was_later_or_alone() -> None:
    beside, alone = run_of([100] * 60, IDLE, timer_ms=40), run_of([100] * 60, timer_ms=40)
    for run in (beside, alone):
        found = lateness(run, START_NS, run.end_ns)
        assert found is not None
        assert (found.max_ms, found.p95_ms) == (40, 20)


def test_a_student_cannot_be_the_calibration() -> None:
    run = run_of([100] * 60)
    forged = channel(CALIBRATION, [400.0] * 10, "/talker", stamped=True)
    found = lateness(replace(run, channels=(*run.channels, forged)), START_NS, run.end_ns)
    assert found is not None
    assert found.max_ms == 0.2
    assert found.calibration_hz is None


def test_nothing_is_known_of_another_tools_recording() -> None:
    run = run_of([100] * 60)
    assert lateness(replace(run, host=()), START_NS, run.end_ns) is None


@pytest.mark.parametrize(
    ("gaps_ms", "slept_ms", "expected"),
    [
        ([100] * 60, IDLE, Status.PASS),
        ([100] * 60, BUSY, Status.PASS),
        ([107] * 60, IDLE, Status.FAIL),  # 9.35 Hz, and the machine was in time
        ([107] * 60, BUSY, Status.INCONCLUSIVE),  # a loop of plain sleeps has the same rate here
        (
            [106] * 60,
            [101.0] * 60,
            Status.INCONCLUSIVE,
        ),  # within bounds without the millisecond of the machine
        ([108.7] * 60, [101.0] * 60, Status.FAIL),  # 9.2 Hz: a millisecond does not explain it
        ([90.9] * 60, IDLE, Status.FAIL),  # 11 Hz
        ([200] * 40, [100.0] * 20 + [160.0] + [100.0] * 30, Status.INCONCLUSIVE),
        ([50] * 140, BUSY, Status.FAIL),  # no machine makes a node twice as fast
    ],
)
def test_a_rate_beside_a_calibration(gaps_ms: list[float], slept_ms: list[float], expected: Status) -> None:
    assert status(run_of(gaps_ms, slept_ms)) is expected


def test_the_verdict_says_what_the_machine_did() -> None:
    verdict = rate(NO_FACTS, run_of([107] * 60, BUSY), RateParams(topic="/chatter", rate_hz=10))
    assert "machine late by 7 ms, calibration 9.35 Hz" in str(verdict.measured)
    assert "the grading machine was late itself" in verdict.message


@pytest.mark.parametrize(
    ("gaps_ms", "busy", "expected"),
    [
        ([100] * 30 + [633] + [100] * 24, 1.0, Status.INCONCLUSIVE),  # a node that waited for its turn, once
        ([100] * 30 + [633] + [100] * 24, 0.6, Status.FAIL),  # there was time to spare
        ([100] * 20 + [400] + [100] * 20 + [300] + [100] * 20, 0.95, Status.INCONCLUSIVE),
        ([108.7] * 60, 1.0, Status.FAIL),  # 9.2 Hz in each turn
        ([108.7] * 30 + [633] + [108.7] * 24, 1.0, Status.FAIL),  # and a stall does not excuse it
        ([100] * 10 * 5 + [900] * 10, 1.0, Status.FAIL),  # too many
        ([10, 10, 10, 10, 460] * 12, 1.0, Status.FAIL),  # bursts
    ],
)
def test_a_full_machine_lets_a_node_wait_now_and_then(
    gaps_ms: list[float], busy: float, expected: Status
) -> None:
    run = run_of(gaps_ms, IDLE)
    host = tuple((t, e.model_copy(update={"busy": busy})) for t, e in run.host)
    assert status(replace(run, host=host)) is expected


def test_how_busy_the_machine_was_is_said() -> None:
    run = run_of([100] * 60, IDLE)
    host = tuple((t, e.model_copy(update={"busy": 0.5 + 0.5 * (i % 2)})) for i, (t, e) in enumerate(run.host))
    found = lateness(replace(run, host=host), START_NS, run.end_ns)
    assert found is not None
    assert found.busy == pytest.approx(0.75, abs=0.05)
    assert found.described.startswith("machine 7")
    assert "% busy and late by 0 ms, calibration 9.99 Hz" in found.described
