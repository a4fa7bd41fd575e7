"""The heat map: a row for each criterion, a column for each submission, best first."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from markupsafe import Markup

from grader.model.batch import CriterionInfo
from grader.report.class_page.lines import LETTERS, Line
from grader.report.html import svg
from grader.wording import number

ROW = 22
ONE_EACH_MAX = 500
COLUMNS_MAX = 120
TICK = 64
WIDTHS = ((40, 22), (60, 15), (120, 7), (160, 5), (225, 4), (304, 3), (ONE_EACH_MAX, 2))
"""Up to so many submissions, a column is so wide."""


@dataclass(frozen=True, kw_only=True)
class HeatMap:
    """`columns` are the places of the submissions in each column: one each, or a group of those with about as many
    points. `step` and `row` are the size of a cell."""

    drawing: Markup
    columns: Sequence[Sequence[int]]
    step: int
    row: int = ROW
    letters: str = ""
    """The statuses that it has cells of."""

    @property
    def grouped(self) -> bool:
        return any(len(column) > 1 for column in self.columns)


def heat_map(lines: Sequence[Line], criteria: Sequence[CriterionInfo]) -> HeatMap | None:
    """None where nothing was judged."""
    order = sorted((p for p, line in enumerate(lines) if line.judged), key=lambda place: -lines[place].points)
    if not order or not criteria:
        return None
    columns = _columns(order)
    step = next((width for most, width in WIDTHS if len(columns) <= most), WIDTHS[-1][1])
    rows = [
        svg.element("g", *_cells(lines, place, columns, step), transform=f"translate(0 {place * ROW})")
        for place in range(len(criteria))
    ]
    size = (max(len(columns) * step, 40), len(criteria) * ROW + 20)
    words = f"{len(criteria)} criteria by {len(order)} submissions, most points first."
    ticks = _ticks(lines, columns, step, len(criteria) * ROW + 15)
    drawing = svg.drawing("heat-map", size, "Heat map", words, *rows, *ticks)
    there = {letter for place in order for letter in lines[place].letters}
    letters = "".join(letter for letter in LETTERS.values() if letter in there)
    return HeatMap(drawing=drawing, columns=columns, step=step, letters=letters)


def _columns(order: Sequence[int]) -> list[Sequence[int]]:
    if len(order) <= ONE_EACH_MAX:
        return [(place,) for place in order]
    ends = [len(order) * i // COLUMNS_MAX for i in range(COLUMNS_MAX + 1)]
    return [order[ends[i] : ends[i + 1]] for i in range(COLUMNS_MAX)]


def _cells(lines: Sequence[Line], row: int, columns: Sequence[Sequence[int]], step: int) -> Iterator[Markup]:
    width = step - 1 if step >= 6 else step
    for i, column in enumerate(columns):
        letters = [lines[place].letters[row] for place in column]
        class_ = letters[0] if len(letters) == 1 else _shade(letters)
        yield svg.element("rect", class_=f"cell {class_}", x=i * step, width=width, height=ROW - 2)


def _shade(letters: Sequence[str]) -> str:
    """`q0` where nobody lost anything, to `q5` where all did."""
    lost = sum(letter in "afb" for letter in letters)
    return f"q{-(-5 * lost // len(letters))}"


def _ticks(lines: Sequence[Line], columns: Sequence[Sequence[int]], step: int, y: float) -> Iterator[Markup]:
    """The points of the submission above, wherever there is room."""
    for x in range(0, len(columns) * step - TICK // 2, TICK):
        points = lines[columns[x // step][0]].points
        yield svg.text(x, y, number(points), class_="label tick")
