"""A counter's values as they came: steps, what was lost on the way, floods."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from functools import cached_property
from itertools import pairwise
from statistics import median
from typing import NamedTuple

from grader.checks.support.losses import whole_until_ns
from grader.evidence.run import Channel, Run
from grader.model.record import Record
from grader.model.verdict import EvidenceCitation

FLOOD_FACTOR = 3
SYSTEMATIC_SHARE = 0.05
STUCK_COUNT = 5


class Step(NamedTuple):
    """From one value to the next. `number` is the later one's, counted from 0."""

    number: int
    before: float
    after: float
    from_ns: int
    to_ns: int
    lost_messages: int

    @property
    def change(self) -> float:
        return self.after - self.before


class Count(Record):
    """The numbers of one publisher in the order of their arrival; times in ns."""

    callerid: str
    values: tuple[float, ...]
    times_ns: tuple[int, ...]
    sequences: tuple[int, ...]

    @cached_property
    def steps(self) -> tuple[Step, ...]:
        rows = list(zip(self.values, self.times_ns, self.sequences, strict=True))
        return tuple(
            Step(i + 1, a[0], b[0], a[1], b[1], max(0, b[2] - a[2] - 1))
            for i, (a, b) in enumerate(pairwise(rows))
        )

    @cached_property
    def stuck(self) -> int:
        """How many times the last value came at the end."""
        same = 0
        for value in reversed(self.values):
            if value != self.values[-1]:
                break
            same += 1
        return same

    @cached_property
    def period_ns(self) -> float:
        """The usual time between two values: the median, or half the mean where they come in bursts."""
        gaps = [s.to_ns - s.from_ns for s in self.steps]
        if not gaps:
            return 0.0
        return max(median(gaps), sum(gaps) / len(gaps) / 2)

    def lost_on_the_way(self, step: Step, jump: float) -> bool:
        """Whether `jump - 1` values between these two were published and did not arrive.

        The recording says so, or the time between them fits: then it was the transport or the host. A jump in
        normal time, or one that comes again and again, is the program's.
        """
        if step.lost_messages:
            return True
        if jump < 2 or self.period_ns <= 0 or self._comes_again(step):
            return False
        return 0.75 <= (step.to_ns - step.from_ns) / self.period_ns / jump <= 4

    def _comes_again(self, step: Step) -> bool:
        same = self._pairs[step.before, step.after]
        return same > 1 or self._jumps > SYSTEMATIC_SHARE * len(self.steps) + 1

    @cached_property
    def _pairs(self) -> Counter[tuple[float, float]]:
        return Counter((s.before, s.after) for s in self.steps)

    @cached_property
    def _jumps(self) -> int:
        return sum(s.change > 1 for s in self.steps)

    def is_flood(self, run: Run, rate_hz: float) -> bool:
        """So many messages that the publisher's own queue drops some."""
        span_s = (self.times_ns[-1] - self.times_ns[0]) / 1e9
        warp = run.warp if run.clock == "warped" else 1.0
        return len(self.steps) > 20 and len(self.steps) >= FLOOD_FACTOR * rate_hz * warp * span_s

    def usual_step(self) -> float | None:
        """The step that at least four of five are, None where there is none."""
        changes = Counter(s.change for s in self.steps)
        change, times = changes.most_common(1)[0] if changes else (0.0, 0)
        return change if times and times >= 0.8 * len(self.steps) else None


class Wrong(NamedTuple):
    """Steps that are not +1: the program's `own`, or of values that were `lost` on the way.

    Where it is a `flood`, they are skips of a publisher whose queue drops values, and neither of both; `excused` where
    the others are right.
    """

    steps: tuple[Step, ...]
    own: tuple[Step, ...] = ()
    lost: tuple[Step, ...] = ()
    flood: bool = False
    excused: bool = False


def wrong_steps(count: Count, run: Run, *, maximum: int, rate_hz: float) -> Wrong:
    """Of `judged_steps`. Where the counter falls by more than one, it may have started again: that is no such step."""
    wrong = tuple(s for s in judged_steps(count, maximum) if s.change in {0, -1} or s.change > 1)
    skips = tuple(s for s in wrong if s.change > 1)
    usual = count.usual_step()
    if wrong and skips == wrong and usual in {None, 1} and count.is_flood(run, rate_hz):
        return Wrong(wrong, flood=True, excused=usual == 1)
    lost = tuple(s for s in skips if count.lost_on_the_way(s, s.change))
    numbers = {s.number for s in lost}
    return Wrong(wrong, own=tuple(s for s in wrong if s.number not in numbers), lost=lost)


def judged_steps(count: Count, maximum: int) -> tuple[Step, ...]:
    """All of them, without the repeats of a counter that stays at its maximum: that is the wrap's fault."""
    stays = count.values[-1] == maximum and count.stuck > 1
    return count.steps[: len(count.steps) - (count.stuck - 1)] if stays else count.steps


def counts(run: Run, topic: str) -> tuple[Count, ...]:
    """What the student's publishers counted on a topic, the earliest first; what is no number is left out, and what
    came after the recorder had lost something."""
    until_ns = whole_until_ns(run, topic)
    found = [_count(c, until_ns) for c in run.student_channels(topic)]
    return tuple(sorted((c for c in found if c is not None), key=lambda c: c.times_ns[0]))


def longest(run: Run, topic: str) -> Count | None:
    return max(counts(run, topic), key=lambda c: len(c.values), default=None)


def cite(run: Run, topic: str, from_ns: int, to_ns: int) -> tuple[EvidenceCitation, ...]:
    return (EvidenceCitation(evidence=run.evidence, topic=topic, from_ns=from_ns, to_ns=to_ns),)


def _count(channel: Channel, until_ns: int | None) -> Count | None:
    rows = [
        (number, message.log_time_ns, message.sequence)
        for message, value in zip(channel.messages, channel.data, strict=True)
        if (number := _number(value)) is not None and (until_ns is None or message.log_time_ns <= until_ns)
    ]
    if not rows:
        return None
    values, times, sequences = zip(*rows, strict=True)
    return Count(callerid=channel.callerid, values=values, times_ns=times, sequences=sequences)


def _number(value: object) -> float | None:
    """A number; text is none, even if it is written in digits."""
    if isinstance(value, int | float) and not isinstance(value, bool):
        return value
    return None


def first_values(values: Sequence[float]) -> str:
    from_start = ", ".join(f"{v:g}" for v in values[:4])
    return f"{from_start}, …" if len(values) > 4 else from_start
