"""What a check measured, by its own measure.

Values of a counter, a rate, what a listener heard, the path that a robot took and where it had to be.
"""

from __future__ import annotations

import heapq
from bisect import bisect_left
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from itertools import chain

from grader.checks.counter import StartParams, StepParams, judge_start
from grader.checks.ends_at import EndsAtParams, path_to_judge, stretch_to_judge
from grader.checks.listener import HearsParams
from grader.checks.rate import RateParams, rhythms_to_judge, sleeps_explain, was_late
from grader.checks.robot_path import PathParams, course_of
from grader.checks.stays_within import StaysWithinParams, placed
from grader.checks.support import counters
from grader.checks.support.clocks import lateness, run_seconds
from grader.checks.support.console_output import (
    Line,
    Probe,
    chosen,
    line_finder,
    places_of,
    printed_lines,
    probes_on,
    text_places,
)
from grader.checks.support.counters import Count, Step, WrapParams
from grader.checks.support.driving import Place, spot
from grader.checks.support.exit_causes import process_tracebacks
from grader.checks.support.geometry import Polyline, Pose, out_along, relative, shown_walls, track
from grader.checks.support.processes import how_it_ended, life_of
from grader.checks.support.text import VALUE
from grader.checks.support.topics import sent_by
from grader.evidence.events import ProcessEvent
from grader.evidence.run import Channel, Run
from grader.model.figure import (
    POINTS_MAX,
    CounterFigure,
    Heard,
    HeardFigure,
    PathFigure,
    PlaceFigure,
    RateFigure,
)
from grader.model.message_rate import Rhythm
from grader.model.package import PackageFacts
from grader.model.verdict import Status
from grader.report.figures.runs import finite, second, short, short_name, thin_out
from grader.wording import join_words, significant

FIRST_VALUES = 40
MARKS_MAX = 40
TURNS_MAX = 60
AROUND = 4
TEXT_LETTERS = 200

Mark = tuple[int, str]
"""A value's number, from 0, and what is wrong with it."""


def start_figures(run: Run, params: StartParams) -> Iterator[CounterFigure]:
    """Yield the beginning of the publisher that came first."""
    for count in counters.counts(run, params.topic, params.field)[:1]:
        wrong = judge_start(count, run, params).status is Status.FAIL
        marks = (
            [(0, f"the first value is {significant(count.values[0])}, not {params.start}")] if wrong else []
        )
        # a turn; one less is a value that came twice
        steps = [s for s in count.steps[:FIRST_VALUES] if s.change < -1]
        first = range(len(count.values))[:FIRST_VALUES]
        yield _counter_figure(count, steps, marks, run=run, topic=params.counter, kept=first)


def step_figures(run: Run, params: StepParams) -> Iterator[CounterFigure]:
    """Yield the publisher that sent most."""
    count = counters.longest(run, params)
    if count is None:
        return
    found = counters.wrong_steps(count, run, maximum=params.maximum, rate_hz=params.rate_hz)
    lost = {s.number for s in found.lost}
    marks = [(s.number, _step_text(s, flood=found.flood, lost=s.number in lost)) for s in found.steps]
    turns = [s for s in count.steps if s.change < -1]
    yield _counter_figure(count, turns, [] if found.excused else marks, run=run, topic=params.counter)


def wrap_figures(run: Run, package: PackageFacts, params: WrapParams) -> Iterator[CounterFigure]:
    """Yield the publisher that sent most."""
    count = counters.longest(run, params)
    if count is None:
        return
    found = counters.turns_of(count, run, params)
    goes_on = (s for s in found.bad if not (s.before > params.maximum and s.change > 0))
    marks = [(s.number, _turn_text(s, found.every, count, run, params)) for s in goes_on]
    verdict, _ = counters.judge_wraps(count, run, package, params)
    if not found.bad and verdict.status is Status.FAIL and not verdict.basis.unjudged:
        # no turn is wrong, and it fails: there was none at all, which shows at the end
        marks = [(len(count.values) - 1, verdict.message)]
    yield _counter_figure(count, found.good, marks, run=run, topic=params.counter)


def _step_text(step: Step, *, flood: bool, lost: bool) -> str:
    comes = f"after {significant(step.before)} comes {significant(step.after)}"
    if flood or lost:
        why = "a flood: its publisher drops values" if flood else "lost on the way, with a gap in time"
        return f"{comes} ({why})"
    return comes


def _turn_text(step: Step, turns: list[Step], count: Count, run: Run, params: WrapParams) -> str:
    whose = counters.whose_turn(step, count, run, params)
    if whose == "program":
        return counters.bad_turn_message(step, turns, params)
    return _step_text(step, flood=whose == "flood", lost=True)


def _counter_figure(
    count: Count,
    turns: Sequence[Step],
    marks: Sequence[Mark],
    *,
    run: Run,
    topic: str,
    kept: range | None = None,
) -> CounterFigure:
    shown = [mark for mark in marks[:MARKS_MAX] if _drawable(count.values[mark[0]])]
    numbers = [
        i for i in kept or _shown_values(count, [i for i, _ in shown], turns) if _drawable(count.values[i])
    ]
    places = {number: place for place, number in enumerate(numbers)}
    to_s = run_seconds(run) or partial(second, run)
    return CounterFigure(
        topic=short_name(topic),
        publisher=short_name(count.callerid or "an unnamed node"),
        scenario=short_name(run.scenario),
        times_s=tuple(round(to_s(count.times_ns[i]), 6) for i in numbers),
        values=tuple(_whole(finite(count.values[i])) for i in numbers),
        numbers=tuple(numbers),
        wraps=tuple(places[s.number] for s in turns if s.number in places),
        wrong=tuple(places[i] for i, _ in shown),
        texts=tuple(short(text, TEXT_LETTERS) for _, text in shown),
        more_wrong=len(marks) - len(shown),
        died=tuple(own_ends(run, [count.callerid], to_s)),
        messages=len(count.values),
        faster=finite(run.warp) if run.clock == "warped" and run_seconds(run) else 1,
    )


def own_ends(run: Run, nodes: Iterable[str], to_s: Callable[[int], float]) -> Iterator[tuple[float, str]]:
    """Yield when (s) the processes of these nodes ended by themselves, and how, in a few words."""
    ended = {one.name: one for one in (life_of(run, node) for node in nodes) if one and one.ended_early}
    for one in ended.values():
        if one.end_ns is not None and one.end is not None:
            yield round(to_s(one.end_ns), 6), short(f"{one.name} ended: {_how(run, one.name, one.end)}")


def _how(run: Run, name: str, end: ProcessEvent) -> str:
    if end.exit_code == 0:
        return "exit code 0"
    found = process_tracebacks(run, name)
    return found[-1].kind if found else how_it_ended(end)


def _whole(value: float) -> float:
    """Return whole numbers as such: 127 rather than 127.0."""
    return int(value) if value == int(value) else value


def _drawable(value: float) -> bool:
    """Return whether it has a place: what is not a number has none; what is infinite is drawn as the largest."""
    return value == value  # noqa: PLR0124 - NaN is not itself


def _shown_values(count: Count, marks: Sequence[int], turns: Sequence[Step]) -> Sequence[int]:
    """Return all values, or of many: what is around the marks and turns, both ends, and a fair choice of the others.

    Of very many turns, only the values of the first ones and what is around the marks.
    """
    every = range(len(count.values))
    if len(every) <= POINTS_MAX:
        return every
    begin = every[: turns[TURNS_MAX].number] if len(turns) > TURNS_MAX else every
    breaks = _neighbours([s.number for s in turns[:TURNS_MAX]], 1, begin)
    kept = {begin[0], begin[-1], *_neighbours(marks, AROUND, every), *breaks}
    return sorted({*kept, *thin_out(begin, POINTS_MAX - len(kept))})


def _neighbours(numbers: Sequence[int], count: int, every: range) -> Iterator[int]:
    """Yield these values and so many around each; of a step, that is from `count` before to `count` - 1 behind."""
    return chain.from_iterable(every[max(0, n - count) : n + count] for n in numbers)


PUBLISHERS_MAX = 3
EXTREMES = 20
SLICE_NS = 500_000_000
SLICES_MAX = 30
FLOOD = 5
"""So many times the highest rate that passes: then single messages cannot be told apart in a plot."""
COUNTED_NS = 100_000_000


def rate_figures(run: Run, params: RateParams) -> Iterator[RateFigure]:
    """Yield all publishers of the student's together, as they are judged; then each of them, if there are several."""
    if run.clock != "real":  # a rate is judged in real time alone
        return
    channels = [c for c in sent_by(run, params.topic, params.of) if c.messages]
    groups = [channels, *([c] for c in channels[:PUBLISHERS_MAX] if len(channels) > 1)]
    for group in groups:
        for found in rhythms_to_judge(run, params, group):
            if found.gaps_ns:
                yield _rate_figure(run, params, found, group)


def _rate_figure(run: Run, params: RateParams, found: Rhythm, channels: Sequence[Channel]) -> RateFigure:
    # a silence up to the end is a gap, too, though no message ends it
    silent = (found.until_ns,) if found.tail_ns else ()
    arrivals = (*found.times_ns[1:], *silent)
    kept = _shown_gaps(found.gaps_ns)
    low_ns, high_ns = params.bounds_ns
    return RateFigure(
        topic=short_name(params.topic),
        publisher=short_name(join_words(c.publisher for c in channels)),
        scenario=short_name(run.scenario),
        times_s=tuple(second(run, arrivals[i]) for i in kept),
        gaps_s=tuple(round(found.gaps_ns[i] / 1e9, 6) for i in kept),
        mean_hz=round(found.mean_hz, 4) or None,
        low_hz=finite(params.low_hz),
        high_hz=finite(params.high_hz),
        gap_low_s=finite(low_ns / 1e9),
        gap_high_s=finite(high_ns / 1e9),
        late=tuple((second(run, a), second(run, b)) for a, b in _late(run, params, found)),
        died=tuple(own_ends(run, [c.callerid for c in channels], partial(second, run))),
        messages=len(found.times_ns),
        ends_silent=bool(silent),
        counts=tuple(_counts(found.times_ns)) if found.mean_hz > FLOOD * params.high_hz else (),
        slice_s=COUNTED_NS / 1e9,
    )


def _counts(times_ns: Sequence[int]) -> Iterator[int]:
    """Yield how many came in each tenth of a second from the first; what is left of one at the end is left out."""
    at = 0
    for end_ns in range(times_ns[0] + COUNTED_NS, times_ns[-1], COUNTED_NS)[:POINTS_MAX]:
        after = bisect_left(times_ns, end_ns)
        yield after - at
        at = after


def _shown_gaps(gaps_ns: Sequence[int]) -> list[int]:
    """Return the longest and the shortest gaps, the last one, and a fair choice of the others."""
    every = range(len(gaps_ns))
    if len(gaps_ns) <= POINTS_MAX:
        return list(every)
    extremes = {
        *heapq.nlargest(EXTREMES, every, key=gaps_ns.__getitem__),
        *heapq.nsmallest(EXTREMES, every, key=gaps_ns.__getitem__),
        every[-1],
    }
    return sorted({*extremes, *thin_out(every, POINTS_MAX - len(extremes))})


def _late(run: Run, params: RateParams, found: Rhythm) -> list[tuple[int, int]]:
    """Return when the machine was late, by the measure of the check; all of the time if only the whole tells."""
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


ROWS_MAX = 60


def heard_figures(run: Run, params: HearsParams) -> Iterator[HeardFigure]:
    """Yield what was heard; nothing where no one can tell what was printed of what."""
    probes = probes_on(run, params.topic)
    lines = printed_lines(run)
    places = places_of(run, probes, lines, params.template) if probes else None
    if places is None:
        return
    found = _lines_of(probes, lines, places, params.template)
    other: list[Line | None] = [None] * len(probes)
    # the text was heard, and other words than asked for stand around it
    if params.template != VALUE and None in found and all(isinstance(p.value, str) for p in probes):
        other = _lines_of(probes, lines, text_places(probes, lines, VALUE), VALUE)
    kept = _shown_probes(found)
    yield HeardFigure(
        scenario=short_name(run.scenario),
        rows=tuple(_row(run, params.topic, probes[i], found[i], other[i]) for i in kept),
        left_out=len(probes) - len(kept),
        out_of_order=all(places) and None in chosen(places),
    )


def _lines_of(
    probes: Sequence[Probe], lines: Sequence[Line], places: Sequence[tuple[int, ...]], template: str
) -> list[Line | None]:
    """Return for each probe the line in which it was printed, in the order in which they were sent where they are."""
    find = line_finder(probes, lines, template)
    in_turn = zip(places, chosen(places), strict=True)
    return [None if not own else find(own[0] if turn is None else turn) for own, turn in in_turn]


def _row(run: Run, topic: str, probe: Probe, right: Line | None, other: Line | None) -> Heard:
    line = right or other
    # without what stands between the node's name, which is cut off already, and its words
    words = short(" ".join(line.text.split()).removeprefix(": "), TEXT_LETTERS) if line else None
    return Heard(
        topic=short_name(topic),
        sent=short(probe.value, TEXT_LETTERS),
        at_s=second(run, probe.at_ns),
        heard=words,
        after_s=None if line is None else max(0.0, round((line.at_ns - probe.at_ns) / 1e9, 6)),
        other_words=right is None and line is not None,
    )


def _shown_probes(found: Sequence[Line | None]) -> list[int]:
    """Return the probes to show: of many, the first, and the first that are missing."""
    every = range(len(found))
    if len(every) <= ROWS_MAX:
        return list(every)
    missing = [i for i in every if found[i] is None][: ROWS_MAX // 2]
    others = [i for i in every if i not in set(missing)]
    return sorted([*missing, *others[: ROWS_MAX - len(missing)]])


NEAR = 20
CORNERS_MAX = 100


def path_figures(run: Run, params: PathParams) -> Iterator[PathFigure]:
    """Yield the path, seen from its start if the points are."""
    found = track(run, params.topic, params.hold_s, of=params.of)
    if found is None or not found.path:
        return
    taken = relative(found.path) if params.relative else list(found.path)
    way = params.way
    course = course_of(taken, params)
    kept = _shown_poses(taken, course.strayed)
    yield PathFigure(
        topic=short_name(params.topic),
        scenario=short_name(run.scenario),
        points=tuple(_spot(taken[i].point) for i in kept),
        corners=tuple(map(_spot, way.points[:CORNERS_MAX])),
        tolerance_m=finite(params.tolerance_m),
        reached=course.reached,
        first=0 if way.added else 1,
        strayed=None if course.strayed is None else kept.index(course.strayed),
        messages=_taken_from(run, params.topic),
    )


SIDES_MAX = 1000


def end_figures(run: Run, params: EndsAtParams) -> Iterator[PlaceFigure]:
    """Yield the path from when the goal was asked for."""
    found, asked = track(run, params.topic, params.hold_s, params.fields), stretch_to_judge(run, params)
    if found is None or asked is None:
        return
    taken = path_to_judge(found, asked, params)
    if taken:
        missed = not params.is_there(taken[-1])
        figure = _place_figure(run, params, taken, len(taken) - 1 if missed else None)
        goal = {"goal": _spot(params.goal), "tolerance_m": finite(params.tolerance_m)}
        end = f"It ends at {spot(taken[-1].point)}, which is {'not ' if missed else ''}{params.words}."
        yield figure.model_copy(update={**goal, "says": short(end)})


def region_figures(run: Run, params: StaysWithinParams) -> Iterator[PlaceFigure]:
    """Yield the path, and the border of where it may be."""
    found, region = track(run, params.topic, params.hold_s, params.fields), params.region(run)
    taken = placed(found, params) if found is not None and found.path else []
    if not taken:
        return
    out = out_along(taken, region)
    worst = max(range(len(out)), key=out.__getitem__) if any(out) else None
    figure = _place_figure(run, params, taken, worst, params.walls)
    # with both limits, or none, the number alone does not say on which side it is
    only = {(False, True): "too near", (True, False): "too far"}
    how = only.get((params.min_m is None, params.max_m is None), "outside")
    where = "" if worst is None else f"; it is {out[worst]:.2f} m {how} at {spot(taken[worst].point)}"
    says = short(f"It has to be {region.words}{where}.")
    area = tuple(map(_spot, region.outline[:CORNERS_MAX]))
    yield figure.model_copy(update={"area": area, "says": says})


def _place_figure(
    run: Run, params: Place, taken: Sequence[Pose], wrong: int | None, walls: Sequence[Polyline] = ()
) -> PlaceFigure:
    """Return the path on the map that the simulator shows. Seen from its own start, a path has no place on a map."""
    kept = _shown_poses(taken, wrong)
    shown = walls or (() if params.relative else shown_walls(run))
    return PlaceFigure(
        topic=short_name(params.topic),
        scenario=short_name(run.scenario),
        points=tuple(_spot(taken[i].point) for i in kept),
        walls=tuple(tuple(map(_spot, wall[:CORNERS_MAX])) for wall in shown[:SIDES_MAX]),
        wrong=None if wrong is None else kept.index(wrong),
        says="",
        messages=_taken_from(run, params.topic),
    )


def _taken_from(run: Run, topic: str) -> int:
    """Return how many messages of the submission the run holds of a topic: more than a figure has points."""
    return sum(len(c.messages) for c in run.channels if c.topic == topic and not c.by_grader)


def _spot(point: tuple[float, float]) -> tuple[float, float]:
    return round(finite(point[0]), 4), round(finite(point[1]), 4)


def _shown_poses(path: Sequence[Pose], strayed: int | None) -> list[int]:
    """Return its ends, what is around the place where it strays, and a fair choice of the others where it moves."""
    every = range(len(path))
    spots = [_spot(pose.point) for pose in path]
    moves = [i for i in every[1:] if spots[i] != spots[i - 1]]
    near = every[max(0, strayed - NEAR) : strayed + NEAR] if strayed is not None else ()
    own = {every[0], every[-1], *near}
    return sorted({*own, *thin_out(moves, POINTS_MAX - len(own))})
