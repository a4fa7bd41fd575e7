"""What time it was by the run's clocks when a message arrived, in seconds since the first of them."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence

from grader.evidence.run import Channel, Run

Seconds = tuple[float, ...]


def clocks_at(run: Run, times_ns: Sequence[int]) -> tuple[Seconds, ...]:
    """By each clock that a node of this run may have read: the wall's, in a warped run `/clock` before it.

    Empty for a warped run whose `/clock` was not recorded, or has not begun with the first message.
    """
    wall = tuple((t - times_ns[0]) / 1e9 for t in times_ns)
    if run.clock != "warped":
        return (wall,)
    ticks = [tick for c in run.channels if c.topic == "/clock" and c.by_grader for tick in _ticks(c)]
    ticks.sort()
    at = [bisect_right(ticks, (t, float("inf"))) - 1 for t in times_ns]
    if min(at, default=-1) < 0:
        return ()
    return tuple(ticks[i][1] - ticks[at[0]][1] for i in at), wall


def _ticks(channel: Channel) -> list[tuple[int, float]]:
    """When a tick was sent (ns), and the time that it told (s)."""
    told = [value.get("clock") if isinstance(value, dict) else None for value in channel.values]
    pairs = zip(channel.times_ns, told, strict=True)
    return [(t, clock["secs"] + clock["nsecs"] / 1e9) for t, clock in pairs if clock]
