"""A counter's values, with the turns and the wrong steps that the checks `counter-…` see."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import chain

from grader.checks.counter import StartParams, StepParams, begins_with, missed_the_first
from grader.checks.support.counter_wrap import (
    WrapParams,
    bad_turn_message,
    judge_wraps,
    turns_of,
    whose_turn,
)
from grader.checks.support.counting import Count, Step, counts, longest, wrong_steps
from grader.evidence.run import Run
from grader.model.figure import POINTS_MAX, CounterFigure
from grader.model.package import PackageFacts
from grader.model.verdict import Status
from grader.report.figures.bounded import finite, named, second, short, spread
from grader.wording import significant

FIRST_VALUES = 40
MARKS_MAX = 40
TURNS_MAX = 60
AROUND = 4
TEXT_LETTERS = 200

Mark = tuple[int, str]
"""A value's number, from 0, and what is wrong with it."""


def start_figures(run: Run, params: StartParams) -> Iterator[CounterFigure]:
    """The beginning of the publisher that came first."""
    for count in counts(run, params.topic)[:1]:
        right = begins_with(count, params.start) or run.foreign
        known = right or missed_the_first(run, params.topic, count)
        marks = (
            [] if known else [(0, f"the first value is {significant(count.values[0])}, not {params.start}")]
        )
        steps = [s for s in count.steps[:FIRST_VALUES] if s.change < -1]
        first = range(len(count.values))[:FIRST_VALUES]
        yield _figure(count, steps, marks, run=run, topic=params.topic, kept=first)


def step_figures(run: Run, params: StepParams) -> Iterator[CounterFigure]:
    """The publisher that sent most."""
    count = longest(run, params.topic)
    if count is None:
        return
    found = wrong_steps(count, run, maximum=params.maximum, rate_hz=params.rate_hz)
    lost = {s.number for s in found.lost}
    marks = [(s.number, _step_text(s, flood=found.flood, lost=s.number in lost)) for s in found.steps]
    turns = [s for s in count.steps if s.change < -1]
    yield _figure(count, turns, [] if found.excused else marks, run=run, topic=params.topic)


def wrap_figures(run: Run, package: PackageFacts, params: WrapParams) -> Iterator[CounterFigure]:
    """The publisher that sent most."""
    count = longest(run, params.topic)
    if count is None:
        return
    found = turns_of(count, run, params)
    goes_on = (s for s in found.bad if not (s.before > params.maximum and s.change > 0))
    marks = [(s.number, _turn_text(s, found.every, count, run, params)) for s in goes_on]
    verdict, _ = judge_wraps(count, run, package, params)
    if not found.bad and verdict.status is Status.FAIL and not verdict.unjudged:
        marks = [(len(count.values) - 1, verdict.message)]
    yield _figure(count, found.good, marks, run=run, topic=params.topic)


def _step_text(step: Step, *, flood: bool, lost: bool) -> str:
    comes = f"after {significant(step.before)} comes {significant(step.after)}"
    if flood or lost:
        why = "a flood: its publisher drops values" if flood else "lost on the way, with a gap in time"
        return f"{comes} ({why})"
    return comes


def _turn_text(step: Step, turns: list[Step], count: Count, run: Run, params: WrapParams) -> str:
    whose = whose_turn(step, count, run, params)
    if whose == "program":
        return bad_turn_message(step, turns, params)
    return _step_text(step, flood=whose == "flood", lost=True)


def _figure(
    count: Count,
    turns: Sequence[Step],
    marks: Sequence[Mark],
    *,
    run: Run,
    topic: str,
    kept: range | None = None,
) -> CounterFigure:
    shown = [mark for mark in marks[:MARKS_MAX] if _drawable(count.values[mark[0]])]
    numbers = [i for i in kept or _kept(count, [i for i, _ in shown], turns) if _drawable(count.values[i])]
    places = {significant: place for place, significant in enumerate(numbers)}
    return CounterFigure(
        topic=named(topic),
        publisher=named(count.callerid or "an unnamed node"),
        scenario=named(run.scenario),
        times_s=tuple(second(run, count.times_ns[i]) for i in numbers),
        values=tuple(_whole(finite(count.values[i])) for i in numbers),
        numbers=tuple(numbers),
        wraps=tuple(places[s.number] for s in turns if s.number in places),
        wrong=tuple(places[i] for i, _ in shown),
        texts=tuple(short(text, TEXT_LETTERS) for _, text in shown),
        more_wrong=len(marks) - len(shown),
        messages=len(count.values),
    )


def _whole(value: float) -> float:
    """Whole numbers as such: 127 rather than 127.0."""
    return int(value) if value == int(value) else value


def _drawable(value: float) -> bool:
    """What is no number at all has no place; what is infinite is drawn as the largest."""
    return value == value  # noqa: PLR0124 - NaN is not itself


def _kept(count: Count, marks: Sequence[int], turns: Sequence[Step]) -> Sequence[int]:
    """All values, or of many: what is around the marks and the turns, both ends, and a fair choice of the others.

    Of very many turns, only the values of the first ones and what is around the marks.
    """
    every = range(len(count.values))
    if len(every) <= POINTS_MAX:
        return every
    begin = every[: turns[TURNS_MAX].number] if len(turns) > TURNS_MAX else every
    breaks = _around([s.number for s in turns[:TURNS_MAX]], 1, begin)
    kept = {begin[0], begin[-1], *_around(marks, AROUND, every), *breaks}
    return sorted({*kept, *spread(begin, POINTS_MAX - len(kept))})


def _around(numbers: Sequence[int], count: int, every: range) -> Iterator[int]:
    """These values and so many before and behind each; of a step, that is from `count` before to `count` - 1 behind."""
    return chain.from_iterable(every[max(0, n - count) : n + count] for n in numbers)
