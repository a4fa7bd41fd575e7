"""Summarise an evidence file or bag: rates as `rostopic hz` computes them, nodes, processes, outcome."""

from __future__ import annotations

from collections import defaultdict, deque
from collections.abc import Sequence
from itertools import pairwise
from math import ceil, sqrt
from pathlib import Path
from statistics import median, pstdev, stdev
from typing import Literal

from grader.evidence.reader import load_run
from grader.evidence.run import BudgetExceeded, Channel, MemoryBudget, Run, is_grader_node
from grader.model.record import Record

BATCHES = 10
# Student's t, two-sided 95 %, for 1 to BATCHES - 1 degrees of freedom.
_T95 = (12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262)


class RateStats(Record):
    """`mean_hz` is (count - 1) / (last - first), None without two messages at two times.

    `period_low_s` to `period_high_s` is the 95 % confidence interval of the mean period, by batch means: the
    gaps are cut into up to 10 consecutive batches, and Student's t is applied to the batches' mean periods.
    That stays honest where gaps depend on each other, as they do with `rospy.Rate`, whose long gap is
    followed by a short one. `gap_std_s` is the population's, as in `rostopic hz`; `gap_p95_s` is the smallest
    gap that 95 % do not exceed.
    """

    count: int
    duration_s: float
    mean_hz: float | None = None
    mean_period_s: float | None = None
    period_low_s: float | None = None
    period_high_s: float | None = None
    gap_min_s: float | None = None
    gap_median_s: float | None = None
    gap_p95_s: float | None = None
    gap_max_s: float | None = None
    gap_std_s: float | None = None


def rate_stats(times_ns: Sequence[int]) -> RateStats:
    """Return the rate of messages that arrived at `times_ns`, in any order."""
    times = sorted(times_ns)
    if len(times) < 2:
        return RateStats(count=len(times), duration_s=0.0)
    gaps = [later - earlier for earlier, later in pairwise(times)]
    duration_ns = times[-1] - times[0]
    ordered = sorted(gaps)
    low_s, high_s = _interval(times)
    return RateStats(
        count=len(times),
        duration_s=duration_ns / 1e9,
        mean_hz=len(gaps) * 1e9 / duration_ns if duration_ns else None,
        mean_period_s=duration_ns / len(gaps) / 1e9,
        period_low_s=low_s,
        period_high_s=high_s,
        gap_min_s=ordered[0] / 1e9,
        gap_median_s=median(ordered) / 1e9,
        gap_p95_s=ordered[ceil(0.95 * len(ordered)) - 1] / 1e9,
        gap_max_s=ordered[-1] / 1e9,
        gap_std_s=pstdev(gaps) / 1e9,
    )


def periodic_share(gaps_ns: Sequence[int], period_ns: float) -> float:
    """Return the share (0 to 1) of gaps within ±50 % of the period, ends included; 0 without gaps."""
    low, high = round(period_ns * 0.5), round(period_ns * 1.5)
    return sum(low <= gap <= high for gap in gaps_ns) / len(gaps_ns) if gaps_ns else 0.0


def _interval(times: Sequence[int]) -> tuple[float | None, float | None]:
    """Return bounds (s) of the mean period; None with fewer than two gaps."""
    gaps = len(times) - 1
    batches = min(BATCHES, gaps)
    if batches < 2:
        return None, None
    cuts = [round(batch * gaps / batches) for batch in range(batches + 1)]
    # Batches of gaps and not single ones: these depend on each other.
    periods = [(times[end] - times[begin]) / (end - begin) for begin, end in pairwise(cuts)]
    mean = (times[-1] - times[0]) / gaps
    half = _T95[batches - 2] * stdev(periods) / sqrt(batches)
    return max(0.0, mean - half) / 1e9, (mean + half) / 1e9


LOOKED_INTO_BYTES = 64 << 20


class ChannelSummary(Record):
    """One publisher on one topic. `readable`: the recorded definition fits every message."""

    topic: str
    type: str
    publisher: str
    md5sum: str
    latching: bool
    by_grader: bool
    readable: bool
    bytes: int
    rate: RateStats


class ProcessSummary(Record):
    """Seconds from the file's first record; `exit_s` is None where the end was not recorded."""

    name: str
    role: str
    start_s: float | None
    exit_s: float | None = None
    exit_code: int | None = None
    signal: int | None = None
    stopped_by: str | None = None
    cpu_s: float | None = None
    max_rss_bytes: int | None = None


class Inspection(Record):
    """`kind` says who wrote the file: the grader, another tool (`mcap`), or `rosbag`.

    `late_max_ms` is how late the machine's timer woke at worst, None where that was not recorded. `outcome`
    is None for a file that is not the grader's and for a recording that was cut short. `noticed` says what processes
    were not allowed or had too much of.
    """

    file: str
    kind: Literal["grader", "mcap", "bag"]
    scenario: str
    clock: str
    warp: float
    metadata: dict[str, str]
    start_ns: int
    duration_s: float
    messages: int
    channels: tuple[ChannelSummary, ...]
    nodes: tuple[str, ...]
    processes: tuple[ProcessSummary, ...]
    console_lines: int
    attachments: tuple[str, ...]
    late_max_ms: float | None
    outcome: str | None
    outcome_detail: str
    noticed: tuple[str, ...] = ()


def inspect_file(path: Path) -> Inspection:
    """Summarise an `.mcap` file (ours or another tool's) or a ROS 1 `.bag`. Raises EvidenceError."""
    run = load_run(path)
    kind: Literal["grader", "mcap", "bag"] = "mcap"
    if run.metadata:
        kind = "grader"
    elif path.suffix == ".bag":
        kind = "bag"
    return inspect_run(run, kind=kind)


def inspect_run(run: Run, *, kind: Literal["grader", "mcap", "bag"] = "grader") -> Inspection:
    """Summarise a run that has been read already."""
    end = run.outcome
    budget = MemoryBudget(decoded_bytes=LOOKED_INTO_BYTES)
    channels = sorted(run.channels, key=lambda channel: (channel.topic, channel.callerid))
    return Inspection(
        file=run.evidence,
        kind=kind,
        scenario=run.scenario,
        clock=run.clock,
        warp=run.warp,
        metadata=dict(run.metadata),
        start_ns=run.start_ns,
        duration_s=(run.end_ns - run.start_ns) / 1e9,
        messages=sum(len(channel.messages) for channel in channels),
        channels=tuple(_channel(channel, budget) for channel in channels),
        nodes=_nodes(run),
        processes=_processes(run),
        console_lines=len(run.console),
        attachments=tuple(sorted(run.attachments)),
        late_max_ms=max((event.max_ms for _, event in run.host), default=None),
        outcome=end.outcome if end else None,
        outcome_detail=end.detail if end else "",
        noticed=tuple(
            f"{event.actor}: {event.detail}"
            for _, event in run.actors
            if event.action in {"refused", "limit"}
        ),
    )


def _channel(channel: Channel, budget: MemoryBudget) -> ChannelSummary:
    return ChannelSummary(
        topic=channel.topic,
        type=channel.type,
        publisher=channel.callerid,
        md5sum=channel.md5sum,
        latching=channel.latching,
        by_grader=channel.by_grader,
        readable=_readable(channel, budget),
        bytes=sum(len(message.data) for message in channel.messages),
        rate=rate_stats(channel.times_ns),
    )


def _readable(channel: Channel, budget: MemoryBudget) -> bool:
    """Return whether the definition fits every message, as far as the budget lets one look."""
    try:
        decoder = channel.decoder(budget)
        for message in channel.messages:
            budget.decode(decoder.decoded_bytes(len(message.data)))
            if decoder.decode(message.data) is None:
                return False
    except BudgetExceeded:
        return True
    return True


def _nodes(run: Run) -> tuple[str, ...]:
    """Return all nodes ever seen but the grader's; the publishers where the graph was not recorded."""
    seen = dict.fromkeys(run.student_nodes())
    seen.update(
        dict.fromkeys(c.callerid for c in run.channels if c.callerid and not is_grader_node(c.callerid))
    )
    return tuple(seen)


def _processes(run: Run) -> tuple[ProcessSummary, ...]:
    """Pair starts and exits of one name in their order."""
    found: list[ProcessSummary] = []
    running: dict[str, deque[int]] = defaultdict(deque)
    for time_ns, event in run.processes:
        at_s = (time_ns - run.start_ns) / 1e9
        known = {"name": event.name, "role": event.role}
        if event.event == "start":
            running[event.name].append(len(found))
            found.append(ProcessSummary(**known, start_s=at_s))
            continue
        how = ("exit_code", "signal", "stopped_by", "cpu_s", "max_rss_bytes")
        ended = ProcessSummary(
            **known, start_s=None, exit_s=at_s, **{name: getattr(event, name) for name in how}
        )
        if running[event.name]:
            started = running[event.name].popleft()
            found[started] = ended.model_copy(update={"start_s": found[started].start_s})
        else:
            found.append(ended)
    return tuple(found)
