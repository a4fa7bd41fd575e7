"""What the simulator simulates, without ROS: turtles on a field, the picture they draw, the field's colour, the pace.

Metres, radians, seconds; y up, theta from the x axis. Coordinates of the picture are pixels, y down.
"""

from math import ceil, cos, floor, hypot, isfinite, sin
from struct import pack, unpack

SIZE = 500
STEP_S = 0.016
# As turtlesim's own: a turtle without a command for so long stops.
HOLD_S = 1.0
# The constant of turtlesim's source, not `math.pi`: a pose is to be the same to the last digit.
PI = 3.14159265
PIXELS_PER_METRE = 45.0
PEN_COLOR = (179, 184, 255)
PEN_WIDTH = 3
BACKGROUND = (69, 86, 255)
NAMES = ("background_r", "background_g", "background_b")
STILL_S = 1.0
CATCH_UP_STEPS = 1000


def as_float32(value):
    """Return the number as a message's float32 field would keep it."""
    return unpack("<f", pack("<f", value))[0]


FIELD_M = as_float32((SIZE - 1) / PIXELS_PER_METRE)
HOLD_STEPS = ceil(HOLD_S / STEP_S)
MIDDLE_M = as_float32(FIELD_M / 2)


class Turtle:
    """How one turtle moves, what it draws and what it senses. Moves by `step`, one for each 16 ms."""

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
        """Velocities (m/s, m/s, rad/s) for the next second. Raises ValueError for what is not a finite number."""
        _refuse_infinite(forward, sideways, turning)
        self.forward, self.sideways, self.turning = forward, sideways, turning
        self._steps_left = HOLD_STEPS

    def set_pen(self, color, width, *, off):
        """A width of 0 is 1 pixel; a pen that is off keeps its colour."""
        self._pen_on = not off
        if not off:
            self._pen_color, self._pen_width = color, width or 1

    def teleport_to(self, x, y, theta):
        """Takes place in the next step, as `teleport_by` does; both raise ValueError for any but finite numbers."""
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
        # First the turn, then the way in the new direction, as turtlesim does.
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


class Canvas:
    """What the pens drew, and what a colour sensor reads of it.

    `SIZE` by `SIZE` pixels of (red, green, blue), each 0 to 255.
    """

    def __init__(self, color):
        self.fill(color)

    def fill(self, color):
        self._pixels = bytearray(bytes(color) * (SIZE * SIZE))

    def pixel(self, x, y):
        """Return the colour of the pixel nearest to a point; black outside."""
        column, row = int(x + 0.5), int(y + 0.5)
        if not (0 <= column < SIZE and 0 <= row < SIZE):
            return 0, 0, 0
        start = 3 * (row * SIZE + column)
        return tuple(self._pixels[start : start + 3])

    def line(self, start, end, width, color):
        """Draw a straight stroke with square ends, `width` pixels wide; from a point to itself, a dot."""
        corners = _outline(start, end, width / 2)
        rows = [y for _, y in corners]
        for row in range(max(0, ceil(min(rows))), min(SIZE, ceil(max(rows)))):
            left, right = _span(corners, row)
            first, last = max(0, ceil(left)), min(SIZE, ceil(right))
            if first < last:
                begin = 3 * (row * SIZE + first)
                self._pixels[begin : begin + 3 * (last - first)] = bytes(color) * (last - first)


def _outline(start, end, half):
    """Return the corners of the rectangle that a stroke covers, in order."""
    (x0, y0), (x1, y1) = start, end
    length = hypot(x1 - x0, y1 - y0)
    along_x, along_y = (half * (x1 - x0) / length, half * (y1 - y0) / length) if length else (half, 0.0)
    return (
        (x0 - along_x - along_y, y0 - along_y + along_x),
        (x1 + along_x - along_y, y1 + along_y + along_x),
        (x1 + along_x + along_y, y1 + along_y - along_x),
        (x0 - along_x + along_y, y0 - along_y - along_x),
    )


def _span(corners, row):
    """Return the first and the last x at which a row crosses a convex outline."""
    crossed = []
    for (x0, y0), (x1, y1) in zip(corners, (*corners[1:], corners[0])):
        if min(y0, y1) <= row <= max(y0, y1):
            crossed += [x0, x1] if y0 == y1 else [x0 + (x1 - x0) * (row - y0) / (y1 - y0)]
    return min(crossed), max(crossed)


class World:
    """The `turtles` of one field by name, and the picture that they draw on. The first one is made by `reset`."""

    def __init__(self):
        self.turtles = {}
        self.canvas = Canvas(BACKGROUND)
        self._number = 0

    def spawn(self, name, x, y, theta):
        """Put a turtle on the field; an empty name becomes the next free `turtle<n>`. Raises KeyError for one that is
        taken."""
        name = name or self._free_name()
        if name in self.turtles:
            raise KeyError(name)
        self.turtles[name] = Turtle(x, y, theta)
        return name

    def kill(self, name):
        """Take a turtle off the field. Raises KeyError where there is none of that name."""
        del self.turtles[name]

    def reset(self):
        """Begin again with one turtle in the middle; return its name."""
        self.turtles.clear()
        self._number = 0
        return self.spawn("", MIDDLE_M, MIDDLE_M, 0.0)

    def _free_name(self):
        while True:
            self._number += 1
            name = f"turtle{self._number}"
            if name not in self.turtles:
                return name


class Background:
    """The field's colour, from the parameter server. `params` has `has`, `get` (None where there is none) and `set`.

    Noetic and late Melodic read the node's private parameters, releases before them those of the node's namespace.
    Here both are read: a private one that someone has set first, then one of the namespace.
    """

    def __init__(self, params):
        self._params = params
        self._own = {}
        for name, default in zip(NAMES, BACKGROUND):
            if not params.has("~" + name):
                params.set("~" + name, default)
                self._own[name] = default

    def read(self):
        return tuple(self._component(name, default) for name, default in zip(NAMES, BACKGROUND))

    def _component(self, name, default):
        private, shared = as_integer(self._params.get("~" + name)), as_integer(self._params.get(name))
        untouched = private is None or private == self._own.get(name)
        if untouched and shared is not None:
            return shared & 0xFF
        return (default if private is None else private) & 0xFF


def as_integer(value):
    """Return the value as roscpp reads an integer parameter: a real number is rounded, all else is None."""
    if isinstance(value, bool) or not isinstance(value, (int, float)) or value != value or abs(value) > 2**31:  # noqa: PLR0124 - not a number
        return None
    return int(value // 1 + (value % 1 >= 0.5))


class Pace:
    """Says when the turtles' next steps are due: counts steps of `step_s` on a clock that may jump, stand still or run
    faster than the wall's.

    Time that passes while the clock stands still for over a second is counted on the wall's clock, as for a simulated
    clock that no one drives.
    """

    def __init__(self, step_s):
        self._step_s = step_s
        self._last_s = None
        self._moved_s = 0.0
        self._owed_s = 0.0

    def due(self, clock_s, wall_s):
        """Return how many steps are due now."""
        if self._last_s is None:
            self._last_s, self._moved_s = clock_s, wall_s
        passed_s = clock_s - self._last_s
        if passed_s == 0 and wall_s - self._moved_s > STILL_S:
            self._moved_s += self._step_s
            return 1
        if passed_s:
            self._moved_s = wall_s
        self._last_s = clock_s
        self._owed_s = self._owed_s + passed_s if passed_s >= 0 else 0.0
        # The small number makes up for what float sums fall short of a whole step.
        steps = int(self._owed_s / self._step_s + 1e-6)
        self._owed_s -= steps * self._step_s
        return min(steps, CATCH_UP_STEPS)
