"""One turtle: how it moves, what it draws and what it senses. Metres, radians, seconds; y up, theta from the x axis."""

from math import ceil, cos, floor, hypot, isfinite, sin
from struct import pack, unpack

from .canvas import SIZE

STEP_S = 0.016
HOLD_S = 1.0
PI = 3.14159265
PIXELS_PER_METRE = 45.0
PEN_COLOR = (179, 184, 255)
PEN_WIDTH = 3


def as_float32(value):
    """What is left of a number in a float32 field."""
    return unpack("<f", pack("<f", value))[0]


FIELD_M = as_float32((SIZE - 1) / PIXELS_PER_METRE)
HOLD_STEPS = ceil(HOLD_S / STEP_S)


class Turtle:
    """Moves by `step`, one for each 16 ms."""

    def __init__(self, x, y, theta):
        self.x, self.y, self.theta = x, y, theta
        self.forward, self.sideways, self.turning = 0.0, 0.0, 0.0
        self.hit = None
        self._steps_left = 0
        self._teleports = []
        self._pen_on = True
        self._pen_color, self._pen_width = PEN_COLOR, PEN_WIDTH

    @property
    def speed(self):
        return hypot(self.forward, self.sideways)

    def command(self, forward, sideways, turning):
        """Velocities (m/s, m/s, rad/s) for the next second. Raises ValueError for what is no finite number."""
        _refuse_infinite(forward, sideways, turning)
        self.forward, self.sideways, self.turning = forward, sideways, turning
        self._steps_left = HOLD_STEPS

    def set_pen(self, color, width, *, off):
        """A width of 0 is 1 pixel; a pen that is off keeps its colour."""
        self._pen_on = not off
        if not off:
            self._pen_color, self._pen_width = color, width or 1

    def teleport_to(self, x, y, theta):
        """Takes place in the next step, as `teleport_by` does; both raise ValueError for what is no finite number."""
        _refuse_infinite(x, y, theta)
        self._teleports.append((False, x, y, theta))

    def teleport_by(self, linear, angular):
        _refuse_infinite(linear, angular)
        self._teleports.append((True, linear, 0.0, angular))

    def step(self, canvas):
        """Move on by `STEP_S`; return the colour that the sensor reads. `hit` is then the point (x, y down) at which it
        ran into a wall, or None."""
        for teleport in self._teleports:
            self._teleport(canvas, *teleport)
        self._teleports = []
        if self._steps_left:
            self._steps_left -= 1
        else:
            self.forward = self.sideways = self.turning = 0.0
        before = (self.x, self.y)
        self._move()
        color = canvas.pixel(*_pixel(self.x, self.y))
        if (self.x, self.y) != before:
            self._draw(canvas, before)
        return color

    def _move(self):
        theta = self.theta + self.turning * STEP_S
        self.theta = theta - 2 * PI * floor((theta + PI) / (2 * PI))
        ahead, aside = self.forward * STEP_S, self.sideways * STEP_S
        x = self.x + cos(self.theta) * ahead - sin(self.theta) * aside
        y = self.y + cos(self.theta) * aside + sin(self.theta) * ahead
        self.hit = None if 0 <= x <= FIELD_M and 0 <= y <= FIELD_M else (x, FIELD_M - y)
        self.x, self.y = min(max(x, 0.0), FIELD_M), min(max(y, 0.0), FIELD_M)

    def _teleport(self, canvas, relative, x, y, theta):
        before = (self.x, self.y)
        if relative:
            self.theta += theta
            self.x += cos(self.theta) * x
            self.y += sin(self.theta) * x
        else:
            self.x, self.y, self.theta = x, min(y, FIELD_M), theta
        self._draw(canvas, before)

    def _draw(self, canvas, before):
        if self._pen_on:
            canvas.line(_pixel(self.x, self.y), _pixel(*before), self._pen_width, self._pen_color)


def _pixel(x, y):
    return x * PIXELS_PER_METRE, (FIELD_M - y) * PIXELS_PER_METRE


def _refuse_infinite(*numbers):
    if not all(isfinite(number) for number in numbers):
        raise ValueError(f"no finite number among {numbers}")
