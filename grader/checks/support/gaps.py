"""The messages of a run as a rhythm, and a rhythm in words."""

from __future__ import annotations

import math
from collections.abc import Sequence

from grader.evidence.run import Channel
from grader.model.message_rate import Rhythm
from grader.wording import hertz, plural


def described(found: Rhythm, low_ns: float, high_ns: float) -> str:
    """`9.98 ± 0.02 Hz over 6.0 s: 60 messages, 98 % of gaps in 0.05 to 0.15 s, longest 0.162 s`."""
    count = plural(len(found.times_ns), "message")
    if not found.gaps_ns:
        return count
    share = 1 - len(found.outside(low_ns, high_ns)) / len(found.gaps_ns)
    within = f"{math.floor(share * 100)} % of gaps in {low_ns / 1e9:.3g} to {high_ns / 1e9:.3g} s"
    longest_s = max(found.gaps_ns) / 1e9
    longest = f"longest {longest_s:.{3 if longest_s >= 0.01 else 6}f} s"
    return f"{_mean(found)} over {found.span_ns / 1e9:.1f} s: {count}, {within}, {longest}"


def _mean(found: Rhythm) -> str:
    if not math.isfinite(found.interval_hz):
        return hertz(found.mean_hz)
    return f"{hertz(found.mean_hz).removesuffix(' Hz')} ± {found.interval_hz:.2f} Hz"


def rhythm(channels: Sequence[Channel], until_ns: int | None, period_ns: float) -> Rhythm | None:
    """All messages of these channels until `until_ns`. Silence at the end counts from 1.5 periods on."""
    times = sorted(t for c in channels for t in c.times_ns if until_ns is None or t <= until_ns)
    if not times:
        return None
    silent_ns = 0 if until_ns is None else until_ns - times[-1]
    end_ns = times[-1] + silent_ns if silent_ns > 1.5 * period_ns else times[-1]
    return Rhythm(times_ns=tuple(times), until_ns=end_ns)
