"""What the class page counts and draws: points, costs of criteria, time, and the heat map."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from statistics import fmean, median

from markupsafe import Markup

from grader.model.batch import BatchRun, CriterionInfo
from grader.model.verdict import Status
from grader.report.class_page.submissions import ABSENT, LETTERS, LOST_LETTERS, SubmissionRow
from grader.report.html import svg
from grader.wording import number


@dataclass(kw_only=True)
class MistakeCost:
    """What the mistakes in one criterion cost all submissions that were judged, with what followed from them.

    `by` are the places of the submissions that made them, `touched` counts those that have not all of its points, or
    not yet, for whatever reason.
    """

    place: int
    criterion: CriterionInfo
    judged: int = 0
    points: float = 0.0
    by: list[int] = field(default_factory=list)
    touched: int = 0

    @property
    def share(self) -> float:
        """How many of those that were judged made them, in percent."""
        return 100 * len(self.by) / self.judged if self.judged else 0.0


def costs(lines: Iterable[SubmissionRow], criteria: Sequence[CriterionInfo]) -> list[MistakeCost]:
    """Return the costs of each criterion, in the rubric's order."""
    found = [MistakeCost(place=place, criterion=criterion) for place, criterion in enumerate(criteria)]
    for place, line in enumerate(lines):
        # what could not be judged has no letters that say anything; a criterion that is left out costs nothing
        for cost in (c for c in found if line.judged and line.letters[c.place] != ABSENT):
            cost.judged += 1
            cost.touched += line.letters[cost.place] != LETTERS[Status.PASS]
            if cost.place in line.caused:
                cost.by.append(place)
                cost.points += line.caused[cost.place]
    return found


def most_first(found: Iterable[MistakeCost]) -> list[MistakeCost]:
    """Return those that cost anything: most points first, then what most submissions lost by."""
    return sorted(
        (cost for cost in found if cost.by), key=lambda cost: (-cost.points, -len(cost.by), cost.place)
    )


BINS_MAX = 20
STEPS = (0.1, 0.2, 0.25, 0.5, 1, 2, 2.5, 5, 10, 20, 25, 50, 100, 200, 250, 500, 1000)
WIDTH, HEIGHT, LEFT, BOTTOM, TOP = 520, 330, 8, 24, 20
PHONE = 300
"""So wide is what a phone has room for."""


@dataclass(frozen=True, kw_only=True)
class Bin:
    """`count` submissions with `low` to less than `high` points; the last bin has those with `high`, too."""

    low: float
    high: float
    count: int

    @property
    def words(self) -> str:
        return f"{number(self.low)} to {number(self.high)} points: {self.count}"


@dataclass(frozen=True, kw_only=True)
class Spread:
    """Of all submissions that were judged."""

    count: int
    mean: float
    median: float
    best: float
    full: int
    none: int
    bins: tuple[Bin, ...]


def spread_of(points: Sequence[float], most: float) -> Spread | None:
    """Return how the points are spread; None where nothing was judged."""
    if not points:
        return None
    return Spread(
        count=len(points),
        mean=fmean(points),
        median=median(points),
        best=max(points),
        full=sum(value >= most for value in points),
        none=sum(value <= 0 for value in points),
        bins=_bins(points, max(most, *points)),
    )


def _bins(points: Iterable[float], most: float) -> tuple[Bin, ...]:
    width = next((step for step in STEPS if step * BINS_MAX >= most), most / BINS_MAX) if most > 0 else 1.0
    # 1e-9: a border such as 0.3 is not exactly three times 0.1
    last = max(1, math.ceil(most / width - 1e-9)) - 1
    counts = [0] * (last + 1)
    for value in points:
        counts[min(last, max(0, math.floor(value / width + 1e-9)))] += 1
    return tuple(
        Bin(low=place * width, high=min(most, (place + 1) * width) if most > 0 else width, count=count)
        for place, count in enumerate(counts)
    )


def histogram(found: Spread) -> Markup:
    """Return the bins as bars, each with its number above it and its points below."""
    bins = found.bins
    highest = max(one.count for one in bins)
    step = (WIDTH - 2 * LEFT) / len(bins)
    room = HEIGHT - BOTTOM - TOP
    bars = []
    for place, one in enumerate(bins):
        x, height = LEFT + place * step, room * one.count / highest
        bars.append(
            svg.element(
                "rect",
                svg.element("title", svg.escaped(one.words)),
                class_="pile",
                x=x + 1,  # with a gap between the bars
                y=TOP + room - height,
                width=max(1.0, step - 2),
                height=height,
            )
        )
        if one.count:
            middle = x + step / 2
            bars.append(svg.text(middle, TOP + room - height - 4, str(one.count), text_anchor="middle"))
    words = "; ".join(one.words for one in bins if one.count)
    title = f"Points of {found.count} submissions"
    return svg.drawing(
        "histogram", (WIDTH, HEIGHT), title, words, *bars, *_scale(bins, step), shrinks=PHONE / WIDTH
    )


def _scale(bins: Sequence[Bin], step: float) -> list[Markup]:
    """Return the line below the bars, and where each second or fifth bar begins."""
    # more numbers than that have no room
    every = 1 if len(bins) <= 10 else 2
    y = HEIGHT - BOTTOM
    line = svg.element("path", d=f"M{LEFT} {y}H{WIDTH - LEFT}", class_="axis")
    ticks = [
        svg.text(
            LEFT + place * step, y + 16, number(bins[place].low), text_anchor="middle" if place else "start"
        )
        for place in range(0, len(bins), every)
    ]
    end = svg.text(WIDTH - LEFT, y + 16, number(bins[-1].high), text_anchor="end")
    return [line, *ticks, end]


SLOWEST = 10


@dataclass(frozen=True, kw_only=True)
class Timing:
    """Seconds. `wall_s` is None while the batch goes on. `slowest` are places of submissions, with their time."""

    wall_s: float | None
    mean_s: float
    median_s: float
    slowest: tuple[tuple[int, float], ...]
    done: int


def timing(run: BatchRun, lines: Sequence[SubmissionRow]) -> Timing | None:
    """Return how long gradings took; None where no submission was timed."""
    timed = [(place, line.wall_s) for place, line in enumerate(lines) if line.wall_s > 0]
    if not timed:
        return None
    seconds = [wall_s for _, wall_s in timed]
    ended = run.ended_at
    return Timing(
        wall_s=(ended - run.started_at).total_seconds() if ended else None,
        mean_s=fmean(seconds),
        median_s=median(seconds),
        slowest=tuple(sorted(timed, key=lambda one: (-one[1], one[0]))[:SLOWEST]),
        done=len(timed),
    )


def span(seconds: float) -> str:
    """Return a time as `0.4 s`, `48 s`, `12 min 3 s`, `2 h 5 min` or `3 days 4 h`."""
    if seconds < 59.5:
        return f"{seconds:.1f} s" if seconds < 9.95 else f"{seconds:.0f} s"
    whole = round(seconds)
    for size, unit, part, smaller in (
        (86_400, "days", 3600, "h"),
        (3600, "h", 60, "min"),
        (60, "min", 1, "s"),
    ):
        if whole >= size:
            rest = whole % size // part
            name = "day" if unit == "days" and whole // size == 1 else unit
            return f"{whole // size} {name}" + (f" {rest} {smaller}" if rest else "")
    return "0 s"


ROW = 22
ONE_EACH_MAX = 500
COLUMNS_MAX = 120
TICK = 64
WIDE, NARROW = 900, 2
"""So wide is the whole, as far as a column has at least so much (pixels)."""


@dataclass(frozen=True, kw_only=True)
class HeatMap:
    """`columns` are the places of the submissions in each column: one each, or a group of those with about as many
    points, and `rows` those of the criteria, both most points left first. `step` and `row` are the size of a cell."""

    drawing: Markup
    columns: Sequence[Sequence[int]]
    rows: Sequence[int]
    step: int
    row: int = ROW
    letters: str = ""
    """The statuses that it has cells of."""

    @property
    def grouped(self) -> bool:
        return any(len(column) > 1 for column in self.columns)


def heat_map(lines: Sequence[SubmissionRow], criteria: Sequence[CriterionInfo]) -> HeatMap | None:
    """Return the map; None where nothing was judged."""
    order = sorted((p for p, line in enumerate(lines) if line.judged), key=lambda place: -lines[place].points)
    if not order or not criteria:
        return None
    columns = _columns(order)
    step = max(NARROW, WIDE // len(columns))
    lost = [sum(lines[p].letters[place] in LOST_LETTERS for p in order) for place in range(len(criteria))]
    # what fewest lost comes first, as the submissions with most points do
    places = sorted(range(len(criteria)), key=lambda place: lost[place])
    rows = [
        svg.element("g", *_cells(lines, place, columns, step), transform=f"translate(0 {i * ROW})")
        for i, place in enumerate(places)
    ]
    size = (max(len(columns) * step, 40), len(criteria) * ROW + 20)
    words = f"{len(criteria)} criteria by {len(order)} submissions, most points first."
    ticks = _ticks(lines, columns, step, len(criteria) * ROW + 15)
    drawing = svg.drawing("heat-map", size, "Heat map", words, *rows, *ticks)
    there = {letter for place in order for letter in lines[place].letters}
    letters = "".join(letter for letter in LETTERS.values() if letter in there)
    return HeatMap(drawing=drawing, columns=columns, rows=places, step=step, letters=letters)


def _columns(order: Sequence[int]) -> list[Sequence[int]]:
    if len(order) <= ONE_EACH_MAX:
        return [(place,) for place in order]
    ends = [len(order) * i // COLUMNS_MAX for i in range(COLUMNS_MAX + 1)]
    return [order[ends[i] : ends[i + 1]] for i in range(COLUMNS_MAX)]


def _cells(
    lines: Sequence[SubmissionRow], row: int, columns: Sequence[Sequence[int]], step: int
) -> Iterator[Markup]:
    # narrow cells would be all gap
    width = step - 1 if step >= 6 else step
    for i, column in enumerate(columns):
        letters = [lines[place].letters[row] for place in column]
        class_ = letters[0] if len(letters) == 1 else _shade(letters)
        yield svg.element("rect", class_=f"cell {class_}", x=i * step, width=width, height=ROW - 2)


def _shade(letters: Sequence[str]) -> str:
    """Return `q0` where no one lost anything, to `q5` where all did."""
    lost = sum(letter in LOST_LETTERS for letter in letters)
    # rounded up, so that one loss in a hundred is not shown as none
    return f"q{-(-5 * lost // len(letters))}"


def _ticks(
    lines: Sequence[SubmissionRow], columns: Sequence[Sequence[int]], step: int, y: float
) -> Iterator[Markup]:
    """Yield the points of the submission above, wherever there is room."""
    for x in range(0, len(columns) * step - TICK // 2, TICK):
        points = lines[columns[x // step][0]].points
        yield svg.text(x, y, number(points), class_="label tick")
