"""The recorder as it really runs, in front of a publisher whose load is known."""

from __future__ import annotations

import asyncio
import json
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from mcap.reader import make_reader

from benchmarks.figures import NotMeasured
from benchmarks.machine import Meter
from grader.arena.limits import RunLimits
from grader.arena.process_environment import ProcessEnvironment
from grader.arena.run_scenario import process_specs
from grader.arena.session import ArenaSession
from grader.evidence.writer import EvidenceWriter
from grader.rubric.scenario import Start
from tests.arena.support import make_place

PUBLISHER = Path(__file__).parent / "publisher.py"
SCRIPT = "src/publisher.py"
PREFIX = "/load/"
LOOK_S, LAST_S, START_S = 0.1, 5.0, 20.0
WIDE = RunLimits(
    channel_messages=1 << 30, channel_bytes=1 << 40, run_bytes=1 << 46, output_lines=1 << 20, cpu_s=3600
)
"""So that a flood is recorded as far as the recorder keeps up with it, not cut at a student's limits."""


@dataclass(frozen=True, kw_only=True)
class Load:
    """What the publisher is asked for: `count` messages and `rate_hz` are of all topics together."""

    topics: int
    type: str
    bytes: int
    count: int
    rate_hz: float

    @property
    def argument(self) -> str:
        return json.dumps(asdict(self))

    @property
    def seconds(self) -> float:
        return self.count / self.rate_hz


@dataclass(frozen=True, kw_only=True)
class Taken:
    """What became of a load. `late_s` is how much longer sending took than it should have, `behind_s` how long after
    the last message was sent it was with the grader (None: not known), `sent_hz` the rate at which it was really sent.
    CPU seconds are the recorder's own."""

    sent: int
    recorded: int
    told_dropped: int
    late_s: float
    behind_s: float | None
    sent_hz: float
    cpu_s: float


def record(load: Load, path: Path) -> tuple[Taken, int]:
    """The load through an `ArenaSession` into the evidence at `path`; with what its times are ahead of monotonic time
    (ns)."""
    with make_place({SCRIPT: PUBLISHER.read_text()}, limits=WIDE) as place:
        specs = list(
            process_specs(Start(name="load", script=SCRIPT, args=(load.argument,)), place, iter((1,)))
        )
        return asyncio.run(_record(load, specs, place, path))


async def _record(
    load: Load, specs: Sequence[dict[str, Any]], place: ProcessEnvironment, path: Path
) -> tuple[Taken, int]:
    meter = Meter()
    with EvidenceWriter(path, scenario="load", clock="real", warp=1.0, metadata={}) as writer:
        offset_ns = time.time_ns() - time.monotonic_ns()
        session = ArenaSession(place, writer)
        async with session as arena:
            for spec in specs:
                arena.start(spec)
            await _await_all(arena, load)
            last_s = max((seen.last_s for seen in arena.live.topics.values()), default=0.0)
            await arena.interrupt("load", int_s=5, term_s=2)
            await arena.finish()
    cpu_s = meter.own_cpu_s() + session.cpu_s
    told = publisher_told(_lines(path))
    taken = Taken(
        sent=int(told["sent"]),
        recorded=_recorded(path),
        told_dropped=_dropped(path),
        late_s=told["end_s"] - told["begin_s"] - load.seconds,
        behind_s=last_s - told["end_s"],
        sent_hz=told["mean_hz"],
        cpu_s=cpu_s,
    )
    return taken, offset_ns


async def _await_all(arena: ArenaSession, load: Load) -> None:
    """Until everything is here; a while after the publisher has said that it is done, no more will come."""
    until_s = time.monotonic() + START_S + 3 * load.seconds
    while time.monotonic() < until_s:
        await arena.wait(lambda: False, LOOK_S)
        live = arena.live
        count = sum(seen.count for topic, seen in live.topics.items() if topic.startswith(PREFIX))
        said_s = live.last_line_s
        if not live.running or (said_s and (count >= load.count or time.monotonic() > said_s + LAST_S)):
            return


def publisher_told(lines: Sequence[str]) -> dict[str, float]:
    """The publisher's last line."""
    for line in reversed(lines):
        if line.startswith("{"):
            return dict(json.loads(line))
    raise NotMeasured(f"the publisher did not end: {' '.join(lines)[-400:]}")


def _lines(path: Path) -> list[str]:
    return [json.loads(data)["line"] for data in _events(path, "/grader/console")]


def _dropped(path: Path) -> int:
    events = [json.loads(data) for data in _events(path, "/grader/recorder")]
    return sum(event["dropped"] for event in events if event["event"] == "closed")


def _events(path: Path, topic: str) -> list[bytes]:
    with path.open("rb") as file:
        return [message.data for _, _, message in make_reader(file).iter_messages(topics=[topic])]


def _recorded(path: Path) -> int:
    with path.open("rb") as file:
        summary = make_reader(file).get_summary()
    if summary is None or summary.statistics is None:
        raise NotMeasured(f"{path.name} has no summary")
    counts = summary.statistics.channel_message_counts
    return sum(
        counts.get(id_, 0) for id_, channel in summary.channels.items() if channel.topic.startswith(PREFIX)
    )


def arrivals(path: Path, topic: str) -> list[tuple[int, bytes]]:
    """When each message came (ns), and its bytes."""
    with path.open("rb") as file:
        return [(m.log_time, m.data) for _, _, m in make_reader(file).iter_messages(topics=[topic])]
