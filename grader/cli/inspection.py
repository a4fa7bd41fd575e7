"""A run in figures, for `grader inspect`."""

from __future__ import annotations

from itertools import pairwise
from statistics import median

from grader.evidence.events import ProcessEvent
from grader.evidence.run import Channel, Run
from grader.model.record import Record


class TopicSummary(Record):
    """One publisher on one topic. The rate is messages after the first by the time from first to last."""

    topic: str
    publisher: str
    type: str
    md5sum: str
    latching: bool
    messages: int
    rate_hz: float | None
    gap_min_ms: float | None
    gap_median_ms: float | None
    gap_max_ms: float | None


class ProcessSummary(Record):
    """`end` in words: `exit code 1`, `ended by signal 11`, `stopped by INT`, `running at the end`."""

    name: str
    role: str
    end: str


class Inspection(Record):
    evidence: str
    scenario: str
    clock: str
    warp: float
    duration_s: float
    outcome: str
    messages: int
    nodes: tuple[str, ...]
    topics: tuple[TopicSummary, ...]
    processes: tuple[ProcessSummary, ...]
    console_lines: int


def summarise(run: Run) -> Inspection:
    """The run's figures. Times are arrivals on the wall's clock, also in a warped run."""
    nodes = {name: None for _, event in run.graph for name in event.nodes}
    outcome = run.outcome
    return Inspection(
        evidence=run.evidence,
        scenario=run.scenario,
        clock=run.clock,
        warp=run.warp,
        duration_s=max(0, run.end_ns - run.start_ns) / 1e9,
        outcome=f"{outcome.outcome} {outcome.detail}".strip() if outcome else "",
        messages=sum(len(c.messages) for c in run.channels),
        nodes=tuple(nodes or {c.callerid: None for c in run.channels if c.callerid}),
        topics=tuple(_topic(c) for c in sorted(run.channels, key=lambda c: (c.topic, c.callerid))),
        processes=_processes(run),
        console_lines=len(run.console),
    )


def _topic(channel: Channel) -> TopicSummary:
    times_ns = channel.times_ns
    gaps_ms = [(after - before) / 1e6 for before, after in pairwise(times_ns)]
    span_ns = times_ns[-1] - times_ns[0] if times_ns else 0
    return TopicSummary(
        topic=channel.topic,
        publisher=channel.callerid,
        type=channel.type,
        md5sum=channel.md5sum,
        latching=channel.latching,
        messages=len(times_ns),
        rate_hz=len(gaps_ms) / (span_ns / 1e9) if span_ns > 0 else None,
        gap_min_ms=min(gaps_ms, default=None),
        gap_median_ms=median(gaps_ms) if gaps_ms else None,
        gap_max_ms=max(gaps_ms, default=None),
    )


def _processes(run: Run) -> tuple[ProcessSummary, ...]:
    ends: dict[str, tuple[str, str]] = {}
    for _, event in run.processes:
        ends[event.name] = (event.role, _end(event) if event.event == "exit" else "running at the end")
    return tuple(ProcessSummary(name=name, role=role, end=end) for name, (role, end) in ends.items())


def _end(event: ProcessEvent) -> str:
    if event.stopped_by is not None:
        return f"stopped by {event.stopped_by}"
    if event.signal is not None:
        return f"ended by signal {event.signal}"
    return f"exit code {event.exit_code}"
