"""Strokes on the picture, pixel by pixel."""

from __future__ import annotations

from typing import Any

import pytest

WHITE, RED = (255, 255, 255), (255, 0, 0)


def _drawn(canvas: Any) -> set[tuple[int, int]]:
    pixels = canvas._pixels
    return {(i // 3 % 500, i // 1500) for i in range(0, len(pixels), 3) if tuple(pixels[i : i + 3]) != WHITE}


@pytest.fixture
def canvas(field_module: Any) -> Any:
    return field_module.Canvas(WHITE)


def _box(x0: int, x1: int, y0: int, y1: int) -> set[tuple[int, int]]:
    return {(x, y) for x in range(x0, x1) for y in range(y0, y1)}


@pytest.mark.parametrize(
    ("start", "end", "width", "drawn"),
    [
        ((100, 100), (100, 100), 1, _box(100, 101, 100, 101)),
        ((100, 100), (100, 100), 3, _box(99, 102, 99, 102)),
        ((100, 100), (110, 100), 3, _box(99, 112, 99, 102)),
        ((100, 110), (100, 100), 1, _box(100, 101, 100, 111)),
        ((-50, 3), (5, 3), 3, _box(0, 7, 2, 5)),
        ((700, 700), (900, 700), 255, set()),
        ((-3e38, 100), (3e38, 100), 1, _box(0, 500, 100, 101)),
    ],
)
def test_strokes(
    canvas: Any,
    start: tuple[float, float],
    end: tuple[float, float],
    width: int,
    drawn: set[tuple[int, int]],
) -> None:
    canvas.line(start, end, width, RED)
    assert _drawn(canvas) == drawn


def test_a_slanted_stroke_has_no_gaps_and_its_width(canvas: Any) -> None:
    canvas.line((50, 50), (450, 250), 3, RED)
    drawn = _drawn(canvas)
    columns = [sum(1 for x, _ in drawn if x == column) for column in range(60, 440)]
    assert set(columns) <= {3, 4}
    assert len(drawn) == pytest.approx(450 * 3, rel=0.05)


def test_pixels_are_read_to_the_nearest_and_black_outside(canvas: Any) -> None:
    canvas.line((10, 10), (10, 10), 1, RED)
    assert [canvas.pixel(x, 10.4) for x in (9.4, 9.6, 10.4, 10.6)] == [WHITE, RED, RED, WHITE]
    assert canvas.pixel(-5, 10) == canvas.pixel(10, 600) == (0, 0, 0)
    assert canvas.pixel(499.0, 499.0) == WHITE
