"""The rate of a stream of messages: mean, gaps, and the silence at its end. Times in ns."""

from __future__ import annotations

import math
import statistics
from collections.abc import Sequence
from functools import cached_property
from itertools import pairwise

from pydantic import model_validator

from grader.model.record import Record
from grader.wording import hertz, plural

# A gap that is exactly a bound is inside, however floats round it.
ROUNDING = 1e-6
# Standard deviations to each side hold 95 % of a normal distribution.
CONFIDENCE = 1.96
# Of fewer gaps, their differences say nothing of the mean.
LEAST_GAPS = 5
CLEAR_GAPS = 20
EVEN_FROM, EVEN_TO, UNEVEN_SHARE = 0.5, 1.5, 0.05
FLOOD = 5
"""So many times too fast, nothing that comes later helps."""


class Rhythm(Record):
    """`times_ns` in order; `until_ns` is up to when the publisher was watched, the last message or later."""

    times_ns: tuple[int, ...]
    until_ns: int

    @model_validator(mode="after")
    def _in_order(self) -> Rhythm:
        if not self.times_ns or self.until_ns < self.times_ns[-1]:
            raise ValueError("a rhythm has at least one message, and ends with it or later")
        return self

    @cached_property
    def gaps_ns(self) -> tuple[int, ...]:
        """Return the gaps between messages, and the silence at the end where it lasted."""
        # A publisher that falls silent sends no message that would end its last gap.
        tail = (self.tail_ns,) if self.tail_ns else ()
        return (*(b - a for a, b in pairwise(self.times_ns)), *tail)

    @property
    def tail_ns(self) -> int:
        return self.until_ns - self.times_ns[-1]

    @property
    def span_ns(self) -> int:
        return self.until_ns - self.times_ns[0]

    @property
    def mean_hz(self) -> float:
        """The number of gaps over the time that they take (Hz); 0 where there is no gap."""
        return len(self.gaps_ns) * 1e9 / self.span_ns if self.span_ns > 0 else 0.0

    @property
    def between_hz(self) -> float:
        """The mean of the gaps between messages alone: what a pause does not change in which the run ended."""
        lasted_ns = self.times_ns[-1] - self.times_ns[0]
        return (len(self.times_ns) - 1) * 1e9 / lasted_ns if lasted_ns else 0.0

    def outside(self, low_ns: float, high_ns: float) -> list[int]:
        """Return the indices of the gaps shorter than `low_ns` or longer than `high_ns`; a bound itself is inside."""
        slack = high_ns * ROUNDING
        return [i for i, gap in enumerate(self.gaps_ns) if not low_ns - slack <= gap <= high_ns + slack]

    @property
    def comes_in_bursts(self) -> bool:
        """Whether many gaps are far shorter than the mean one, and some far longer."""
        if not self.gaps_ns:
            return False
        mean_ns = self.span_ns / len(self.gaps_ns)
        short = sum(gap < 0.3 * mean_ns for gap in self.gaps_ns)
        return short >= 0.25 * len(self.gaps_ns) and max(self.gaps_ns) > 1.5 * mean_ns

    @property
    def is_even(self) -> bool:
        """Whether nearly all gaps are like the mean one, whatever that is."""
        if not self.gaps_ns:
            return True
        mean_ns = self.span_ns / len(self.gaps_ns)
        return len(self.outside(EVEN_FROM * mean_ns, EVEN_TO * mean_ns)) <= UNEVEN_SHARE * len(self.gaps_ns)

    def is_single_stall(self, outside: Sequence[int], period_ns: float) -> bool:
        """Return whether one message came late and the next on its schedule again: one long gap, then one short one."""
        match outside:
            # Not the silence at the end, after which nothing came on its schedule.
            case [late]:
                return self.gaps_ns[late] > period_ns and late < len(self.gaps_ns) - bool(self.tail_ns)
            case [late, early]:
                # Two gaps of two periods together: the second message kept to its schedule.
                together = self.gaps_ns[late] + self.gaps_ns[early]
                return early == late + 1 and abs(together - 2 * period_ns) <= period_ns / 2
        return False

    @property
    def interval_hz(self) -> float:
        """Half the width of the mean's 95 % confidence interval, from how much the gaps differ among themselves.

        Gaps of a loop that keeps a schedule make up for each other, so this is rather too wide than too narrow.
        """
        count = len(self.gaps_ns)
        if count < LEAST_GAPS:
            return math.inf
        mean_ns = statistics.fmean(self.gaps_ns)
        squares = math.fsum([(gap_ns - mean_ns) ** 2 for gap_ns in self.gaps_ns])
        # Not `statistics.stdev`, which takes 20 times as long.
        error = CONFIDENCE * math.sqrt(squares / (count - 1)) / math.sqrt(count)
        return self.mean_hz * error / mean_ns

    def described(self, low_ns: float, high_ns: float) -> str:
        """Return it in words.

        `9.98 ± 0.02 Hz over 6.0 s: 60 messages, 98 % of gaps in 0.05 to 0.15 s, longest 0.162 s`
        """
        count = plural(len(self.times_ns), "message")
        if not self.gaps_ns:
            return count
        share = 1 - len(self.outside(low_ns, high_ns)) / len(self.gaps_ns)
        within = f"{math.floor(share * 100)} % of gaps in {low_ns / 1e9:.3g} to {high_ns / 1e9:.3g} s"
        longest_s = max(self.gaps_ns) / 1e9
        longest = f"longest {longest_s:.{3 if longest_s >= 0.01 else 6}f} s"
        mean = hertz(self.mean_hz)
        if math.isfinite(self.interval_hz):
            mean = f"{mean.removesuffix(' Hz')} ± {self.interval_hz:.2f} Hz"
        return f"{mean} over {self.span_ns / 1e9:.1f} s: {count}, {within}, {longest}"


class RateBounds(Record):
    """What a rubric asks of a topic's rate, and over how long a time at least."""

    topic: str
    low_hz: float
    high_hz: float
    low_gap_ns: float
    high_gap_ns: float
    min_window_s: float

    def decided_by(self, times_ns: Sequence[int]) -> bool:
        """Return whether a longer look would change nothing: the mean's confidence interval lies inside of the bounds,
        and so does every gap, or it lies outside of them."""
        # The least time is asked for by the rubric, and a few gaps may be even by chance.
        if len(times_ns) <= CLEAR_GAPS or times_ns[-1] - times_ns[0] < self.min_window_s * 1e9:
            return False
        found = Rhythm(times_ns=tuple(times_ns), until_ns=times_ns[-1])
        least_hz, most_hz = found.mean_hz - found.interval_hz, found.mean_hz + found.interval_hz
        right = self.low_hz <= least_hz and most_hz <= self.high_hz
        even = right and not found.outside(self.low_gap_ns, self.high_gap_ns)
        flood = found.mean_hz > FLOOD * self.high_hz
        return even or flood or most_hz < self.low_hz or least_hz > self.high_hz
