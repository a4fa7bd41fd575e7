"""How a turtle moves and draws: pure, with numbers."""

from __future__ import annotations

import math
from typing import Any

import pytest

FIELD_M = 11.088889
MIDDLE_M = 5.5444446
BLUE = (69, 86, 255)
PEN = (179, 184, 255)


class Field:
    """A turtle in the middle of an empty field."""

    def __init__(
        self, field_module: Any, x: float = MIDDLE_M, y: float = MIDDLE_M, theta: float = 0.0
    ) -> None:
        self.canvas = field_module.Canvas(BLUE)
        self.turtle = field_module.Turtle(x, y, theta)

    def drive(self, steps: int, *velocities: float) -> tuple[int, ...]:
        """Steps with a command before each; the last colour read."""
        color: tuple[int, ...] = ()
        for _ in range(steps):
            if velocities:
                self.turtle.command(*velocities)
            color = self.turtle.step(self.canvas)
        return color

    @property
    def pose(self) -> tuple[float, float, float]:
        return self.turtle.x, self.turtle.y, self.turtle.theta


@pytest.fixture
def field(field_module: Any) -> Field:
    return Field(field_module)


@pytest.mark.parametrize(
    ("velocities", "moved"),
    [
        ((1.0, 0.0, 0.0), (1.6, 0.0, 0.0)),
        ((-1.0, 0.0, 0.0), (-1.6, 0.0, 0.0)),
        ((0.0, 2.0, 0.0), (0.0, 3.2, 0.0)),
        ((0.0, 0.0, 1.0), (0.0, 0.0, 1.6)),
        ((0.0, 0.0, -2.5), (0.0, 0.0, 2 * math.pi - 4.0)),
    ],
)
def test_velocities_are_integrated(
    field: Field, velocities: tuple[float, ...], moved: tuple[float, ...]
) -> None:
    field.drive(100, *velocities)
    x, y, theta = field.pose
    assert (x - MIDDLE_M, y - MIDDLE_M, theta) == pytest.approx(moved, abs=1e-6)


def test_a_circle_closes(field: Field) -> None:
    turning = 2 * math.pi / (250 * 0.016)
    field.drive(250, 2.0, 0.0, turning)
    assert field.pose[:2] == pytest.approx((MIDDLE_M, MIDDLE_M), abs=1e-3)
    assert abs(field.pose[2]) < 1e-3


def test_a_command_holds_for_a_second(field: Field) -> None:
    field.turtle.command(1.0, 0.0, 0.0)
    field.drive(200)
    assert field.turtle.x - MIDDLE_M == pytest.approx(1.0, abs=0.02)
    assert (field.turtle.speed, field.turtle.turning) == (0.0, 0.0)


def test_speed_counts_both_directions_and_has_no_sign(field: Field) -> None:
    field.drive(1, -3.0, 4.0, 0.5)
    assert (field.turtle.speed, field.turtle.turning) == (5.0, 0.5)


@pytest.mark.parametrize(
    ("theta", "wall", "seen"),
    [
        (0.0, (FIELD_M, MIDDLE_M), (FIELD_M + 0.032, MIDDLE_M)),
        (math.pi / 2, (MIDDLE_M, FIELD_M), (MIDDLE_M, -0.032)),
        (-math.pi / 2, (MIDDLE_M, 0.0), (MIDDLE_M, FIELD_M + 0.032)),
    ],
)
def test_walls_stop_it_and_say_where(
    field_module: Any, theta: float, wall: tuple[float, float], seen: tuple[float, float]
) -> None:
    field = Field(field_module, theta=theta)
    field.drive(200, 2.0, 0.0, 0.0)
    assert field.pose[:2] == pytest.approx(wall, abs=1e-5)
    assert field.turtle.hit == pytest.approx(seen, abs=1e-5)
    field.drive(1, -2.0, 0.0, 0.0)
    assert field.turtle.hit is None


@pytest.mark.parametrize("theta", [7.0, -7.0, 3.2, 100.0])
def test_theta_stays_within_half_a_turn(field: Field, theta: float) -> None:
    field.turtle.teleport_to(1.0, 1.0, theta)
    field.drive(1)
    assert -math.pi <= field.turtle.theta <= math.pi
    assert math.cos(field.turtle.theta) == pytest.approx(math.cos(theta), abs=1e-6)


def test_teleports_take_place_in_order_in_the_next_step(field: Field) -> None:
    field.turtle.teleport_to(2.0, 3.0, math.pi / 2)
    field.turtle.teleport_by(1.0, math.pi / 2)
    assert field.pose == (MIDDLE_M, MIDDLE_M, 0.0)
    field.drive(1)
    assert field.pose[:2] == pytest.approx((1.0, 3.0), abs=1e-6)
    assert abs(field.pose[2]) == pytest.approx(math.pi, abs=1e-6)


def test_a_teleport_above_the_field_ends_at_its_edge_without_a_word(field: Field) -> None:
    field.turtle.teleport_to(3.0, 20.0, 0.0)
    field.drive(1)
    assert (field.turtle.y, field.turtle.hit) == (pytest.approx(FIELD_M, abs=1e-5), None)
    field.turtle.teleport_to(20.0, 3.0, 0.0)
    field.drive(1)
    assert field.turtle.hit is not None


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_what_is_no_number_is_refused(field: Field, value: float) -> None:
    for refused in (
        lambda: field.turtle.command(value, 0.0, 0.0),
        lambda: field.turtle.command(0.0, 0.0, value),
        lambda: field.turtle.teleport_to(0.0, value, 0.0),
        lambda: field.turtle.teleport_by(value, 0.0),
    ):
        with pytest.raises(ValueError, match="finite"):
            refused()
    field.drive(3)
    assert field.pose == (MIDDLE_M, MIDDLE_M, 0.0)


def test_huge_numbers_do_no_harm(field: Field) -> None:
    field.drive(3, 1e300, -1e300, 1e300)
    field.turtle.teleport_by(3e38, 3e38)
    field.drive(3)
    assert 0.0 <= field.turtle.x <= FIELD_M + 1e-6
    assert 0.0 <= field.turtle.y <= FIELD_M + 1e-6


def test_the_sensor_reads_the_background_and_then_the_trace(field: Field) -> None:
    assert field.drive(1) == BLUE
    assert field.drive(60, 1.0, 0.0, 0.0) == PEN
    field.turtle.set_pen((255, 0, 10), 9, off=False)
    assert field.drive(60, -1.0, 0.0, 0.0) == (255, 0, 10)


def test_a_pen_that_is_off_draws_nothing_and_keeps_its_colour(field_module: Any, field: Field) -> None:
    field.turtle.set_pen((255, 0, 10), 5, off=True)
    field.turtle.teleport_by(2.0, 0.0)
    assert field.drive(60, 1.0, 0.0, 0.0) == BLUE
    assert field.canvas._pixels == field_module.Canvas(BLUE)._pixels
    field.turtle.set_pen((1, 2, 3), 0, off=False)
    field.drive(60, 1.0, 0.0, 0.0)
    assert field.drive(30, -1.0, 0.0, 0.0) == (1, 2, 3)


def test_a_teleport_draws_a_line(field: Field) -> None:
    field.turtle.teleport_to(1.0, 1.0, 0.0)
    field.turtle.teleport_to(1.0, 9.0, 0.0)
    field.drive(1)
    field.turtle.set_pen((0, 0, 0), 0, off=True)
    field.turtle.teleport_to(1.0, 5.0, 0.0)
    assert field.drive(1) == PEN
    field.turtle.teleport_to(1.2, 5.0, 0.0)
    assert field.drive(1) == BLUE
