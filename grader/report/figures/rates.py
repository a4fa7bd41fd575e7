"""The rate of a topic, as the check `rate` measures it."""

from __future__ import annotations

import heapq
from collections.abc import Iterator, Sequence

from grader.checks.rate import RateParams, judged_rhythm, sleeps_explain, was_late
from grader.checks.support.lateness import lateness
from grader.evidence.run import Channel, Run
from grader.model.figure import POINTS_MAX, RateFigure
from grader.model.message_rate import Rhythm
from grader.report.figures.bounded import finite, named, second, spread
from grader.wording import join_words

PUBLISHERS_MAX = 3
EXTREMES = 20
SLICE_NS = 500_000_000
SLICES_MAX = 30


def rate_figures(run: Run, params: RateParams) -> Iterator[RateFigure]:
    """All publishers of the student's together, as they are judged; then each of them, where there are several."""
    if run.clock != "real":
        return
    channels = [c for c in run.student_channels(params.topic) if c.messages]
    groups = [channels, *([c] for c in channels[:PUBLISHERS_MAX] if len(channels) > 1)]
    for group in groups:
        found = judged_rhythm(run, params, group)
        if found is not None and found.gaps_ns:
            yield _figure(run, params, found, group)


def _figure(run: Run, params: RateParams, found: Rhythm, channels: Sequence[Channel]) -> RateFigure:
    silent = (found.until_ns,) if found.tail_ns else ()
    arrivals = (*found.times_ns[1:], *silent)
    kept = _kept(found.gaps_ns)
    low_ns, high_ns = params.bounds_ns
    return RateFigure(
        topic=named(params.topic),
        publisher=named(join_words(c.publisher for c in channels)),
        scenario=named(run.scenario),
        times_s=tuple(second(run, arrivals[i]) for i in kept),
        gaps_s=tuple(round(found.gaps_ns[i] / 1e9, 6) for i in kept),
        mean_hz=round(found.mean_hz, 4) or None,
        low_hz=finite(params.low_hz),
        high_hz=finite(params.high_hz),
        gap_low_s=finite(low_ns / 1e9),
        gap_high_s=finite(high_ns / 1e9),
        late=tuple((second(run, a), second(run, b)) for a, b in _late(run, params, found)),
        messages=len(found.times_ns),
        ends_silent=bool(silent),
    )


def _kept(gaps_ns: Sequence[int]) -> list[int]:
    """The longest and the shortest gaps, the last one, and a fair choice of the others."""
    every = range(len(gaps_ns))
    if len(gaps_ns) <= POINTS_MAX:
        return list(every)
    extremes = {
        *heapq.nlargest(EXTREMES, every, key=gaps_ns.__getitem__),
        *heapq.nsmallest(EXTREMES, every, key=gaps_ns.__getitem__),
        every[-1],
    }
    return sorted({*extremes, *spread(every, POINTS_MAX - len(extremes))})


def _late(run: Run, params: RateParams, found: Rhythm) -> list[tuple[int, int]]:
    """Stretches in which the machine was late, by the measure of the check; all of it where only the whole tells."""
    begin_ns, end_ns = found.times_ns[0], found.until_ns
    whole = lateness(run, begin_ns, end_ns)
    if whole is None:
        return []
    size_ns = max(SLICE_NS, (end_ns - begin_ns) // SLICES_MAX + 1)
    stretches: list[tuple[int, int]] = []
    for from_ns in range(begin_ns, end_ns, size_ns):
        to_ns = min(from_ns + size_ns, end_ns)
        late = lateness(run, from_ns, to_ns)
        if late is None or not was_late(late, params):
            continue
        joined = stretches and stretches[-1][1] == from_ns
        stretches = [*stretches[:-1], (stretches[-1][0], to_ns)] if joined else [*stretches, (from_ns, to_ns)]
    excused = was_late(whole, params) or sleeps_explain(found, whole, params)
    return stretches or ([(begin_ns, end_ns)] if excused else [])
