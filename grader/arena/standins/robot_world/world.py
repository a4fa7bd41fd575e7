"""A world without ROS: its walls, read from YAML and from map_server's maps, and a robot with a laser among them.

Metres, radians, seconds. A wall is a straight line ((x0, y0), (x1, y1)). Raises ValueError if it is no floor plan.
"""

from math import atan2, ceil, cos, floor, hypot, inf, isfinite, pi, sin
from pathlib import Path

OCCUPIED_THRESH = 0.65
PIXELS_MAX = 4000000
WALLS_MAX = 5000


def walls_of(lines, boxes):
    """Return the walls of `lines`, each through points [x, y], and of `boxes`, each two corners [x0, y0, x1, y1]."""
    found = []
    for line in _items(lines, "walls"):
        points = [_point(point) for point in _items(line, "a wall")]
        found += zip(points, points[1:])  # noqa: RUF007 - pairwise is Python 3.10's
    for box in _items(boxes, "boxes"):
        x0, y0, x1, y1 = (_number(value) for value in _items(box, "a box", 4))
        corners = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
        found += zip(corners, corners[1:] + corners[:1])
    if len(found) > WALLS_MAX:
        raise ValueError(f"{len(found)} walls, more than {WALLS_MAX}")
    return found


def read_plan(path, parse):
    """Return the walls of a YAML file: `walls` and `boxes`, or the `image` of a map. `parse` reads YAML's text."""
    path = Path(path)
    plan = parse(path.read_text())
    if not isinstance(plan, dict) or not {"walls", "boxes", "image"} & set(plan):
        raise ValueError(f"{path}: neither walls nor boxes nor the image of a map")
    walls = walls_of(plan.get("walls", []), plan.get("boxes", []))
    if "image" in plan:
        rows = read_pgm((path.parent / str(plan["image"])).read_bytes())
        walls += map_walls(rows, plan)
    return walls


def read_pgm(data):
    """Return the rows of a picture (PGM), from the top, each value from 0 (black) to 1 (white)."""
    fields, place = [], 0
    # Kind, width, height and white, with any blanks and comments between them (man 5 pgm).
    while len(fields) < 4:
        place = _skip_blanks(data, place)
        end = place
        while end < len(data) and not data[end : end + 1].isspace():
            end += 1
        if end == place:
            raise ValueError("the image is cut short")
        fields.append(data[place:end])
        place = end
    kind, (width, height, white) = fields[0], (int(field) for field in fields[1:])
    if kind not in (b"P2", b"P5") or not 0 < width * height <= PIXELS_MAX or not 0 < white < 256:
        raise ValueError("not an 8-bit PGM image, or one of more than four million pixels")
    values = data[place + 1 :] if kind == b"P5" else [int(field) for field in data[place:].split()]
    if len(values) < width * height:
        raise ValueError("the image is cut short")
    return [[value / white for value in values[row * width : (row + 1) * width]] for row in range(height)]


def map_walls(rows, about):
    """Return the borders of what is occupied, by map_server's own rule; `about` are the keys of the map's YAML file."""
    size_m, threshold = (
        _number(about.get("resolution")),
        _number(about.get("occupied_thresh", OCCUPIED_THRESH)),
    )
    x, y, yaw = (_number(value) for value in _items(about.get("origin", [0, 0, 0]), "origin", 3))
    negate = bool(about.get("negate", 0))
    if size_m <= 0:
        raise ValueError("resolution: no length")
    full = [[(value if negate else 1 - value) > threshold for value in row] for row in reversed(rows)]
    along, aside = cos(yaw), sin(yaw)

    def placed(column, row):
        right, up = column * size_m, row * size_m
        return x + along * right - aside * up, y + aside * right + along * up

    across = [(placed(a, at), placed(b, at)) for at, a, b in _borders(full)]
    upright = [
        (placed(at, a), placed(at, b)) for at, a, b in _borders([list(column) for column in zip(*full)])
    ]
    if len(across) + len(upright) > WALLS_MAX:
        raise ValueError(f"the map has more than {WALLS_MAX} walls")
    return across + upright


def _borders(full):
    """Yield where full cells meet free ones: between which rows, and from which column to which. Outside of the picture
    all is free."""
    free = [False] * len(full[0])
    for at, (below, above) in enumerate(zip([free, *full], [*full, free])):
        start = None
        for column, differs in enumerate([a != b for a, b in zip(below, above)] + [False]):
            if differs and start is None:
                start = column
            elif not differs and start is not None:
                yield at, start, column
                start = None


def _skip_blanks(data, place):
    """Return the place behind blanks and comments."""
    while place < len(data):
        if data[place : place + 1] == b"#":
            place = data.find(b"\n", place) + 1 or len(data)
        elif not data[place : place + 1].isspace():
            break
        else:
            place += 1
    return place


def _items(value, what, count=None):
    if not isinstance(value, (list, tuple)) or (count is not None and len(value) != count):
        raise ValueError(f"{what}: no list" + (f" of {count} numbers" if count else ""))
    return value


def _point(value):
    x, y = _items(value, "a point", 2)
    return _number(x), _number(y)


def _number(value):
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not isfinite(value):
        raise ValueError(f"{value}: no number")
    return float(value)


STEP_S = 0.01
NEAR_M = 0.5
TURN = 2 * pi
TINY = 1e-12


class Robot:
    """A round robot with two wheels among walls, which moves by `step`, one for each 10 ms.

    A wall stops it: it can still turn in place, and drive away. `x`, `y`, `theta` are where it is in the world.
    """

    def __init__(self, walls, radius, start, fastest=(inf, inf), timeout_s=0.0):
        self.x, self.y, self.theta = start
        self.radius = radius
        self.forward, self.turning = 0.0, 0.0
        self.hits = False
        self._walls, self._near, self._near_at = walls, [], None
        self._wanted, self._fastest = (0.0, 0.0), fastest
        self._timeout_steps = ceil(timeout_s / STEP_S - 1e-9) if timeout_s else 0
        self._steps_left = 0

    def command(self, forward, turning):
        """Velocities (m/s, rad/s) from now on, not faster than it can. Raises ValueError for what is not a number."""
        if not (isfinite(forward) and isfinite(turning)):
            raise ValueError(f"no finite number among {(forward, turning)}")
        most, most_turn = self._fastest
        self._wanted = (max(-most, min(most, forward)), max(-most_turn, min(most_turn, turning)))
        self._steps_left = self._timeout_steps

    def step(self):
        """Move on by `STEP_S`."""
        if self._timeout_steps:
            self._steps_left -= 1
            if self._steps_left < 0:
                self._wanted = (0.0, 0.0)
        forward, self.turning = self._wanted
        half = self.turning * STEP_S / 2
        # The robot drives along an arc: the chord to its end is shorter by this factor.
        chord = forward * STEP_S * (sin(half) / half if abs(half) > 1e-9 else 1.0)
        x, y = self.x + chord * cos(self.theta + half), self.y + chord * sin(self.theta + half)
        theta = self.theta + 2 * half
        self.theta = theta - TURN * floor((theta + pi) / TURN)
        self.hits = bool(forward) and self._is_blocked(x, y)
        self.forward = 0.0 if self.hits else forward
        if not self.hits:
            self.x, self.y = x, y

    def _is_blocked(self, x, y):
        """Return whether a wall is in the way, and nearer than before."""
        at = self._near_at
        if at is None or hypot(x - at[0], y - at[1]) > NEAR_M:
            self._near_at = (x, y)
            self._near = [w for w in self._walls if distance(x, y, w) <= 2 * NEAR_M + self.radius]
        return any(
            # Nearer than before: a robot that touches a wall may drive away from it.
            distance(x, y, wall) < min(self.radius, distance(self.x, self.y, wall))
            for wall in self._near
        )


def distance(x, y, wall):
    """Return the distance of a point from a wall."""
    (x0, y0), (x1, y1) = wall
    dx, dy = x1 - x0, y1 - y0
    square = dx * dx + dy * dy
    share = ((x - x0) * dx + (y - y0) * dy) / square if square else 0.0
    share = 0.0 if share < 0 else 1.0 if share > 1 else share
    return hypot(x - x0 - share * dx, y - y0 - share * dy)


class Laser:
    """Ranges at so many `samples` from the angle `low` to `high`: infinite where nothing is within `reach`, and minus
    infinity where something is nearer than `least`, as REP 117 has it.

    `noise` is a standard deviation, drawn from `random` (`random.Random(seed)`).
    """

    def __init__(self, walls, angles, bounds, noise=0.0, random=None):
        (low, high, samples), (least, reach) = angles, bounds
        self.low, self.high, self.least, self.reach = low, high, least, reach
        self.increment = (high - low) / (samples - 1)
        self._rays = [(cos(low + i * self.increment), sin(low + i * self.increment)) for i in range(samples)]
        self._walls, self._noise, self._random = walls, noise, random

    def scan(self, x, y, theta):
        """Return the ranges that it sees from there. Of each wall, only the rays between its ends are looked at."""
        ranges = [inf] * len(self._rays)
        ahead, aside = cos(theta), sin(theta)
        for (x0, y0), (x1, y1) in self._walls:
            ax, ay = ahead * (x0 - x) + aside * (y0 - y), ahead * (y0 - y) - aside * (x0 - x)
            bx, by = ahead * (x1 - x) + aside * (y1 - y), ahead * (y1 - y) - aside * (x1 - x)
            cross = ax * by - ay * bx
            # The ends in the order in which the laser turns.
            if cross < 0:
                ax, ay, bx, by, cross = bx, by, ax, ay, -cross
            dx, dy = bx - ax, by - ay
            if cross <= TINY or cross > self.reach * hypot(dx, dy):
                continue  # seen from its end, or too far away
            for first, last in self._between(ax, ay, bx, by):
                for i in range(first, last + 1):
                    c, s = self._rays[i]
                    slant = c * dy - s * dx
                    if slant > TINY:
                        far = cross / slant
                        if far < ranges[i]:  # noqa: PLR1730 - min() takes three times as long
                            ranges[i] = far
        return [self._reading(far) for far in ranges]

    def _between(self, ax, ay, bx, by):
        """Yield the numbers (first, last) of the rays between two points, the second to the left of the first: one
        stretch, or two."""
        start = (atan2(ay, ax) - self.low) % TURN
        width = (atan2(by, bx) - atan2(ay, ax)) % TURN
        # Angles are those of a circle: a wall may lie across the seam of the laser's range.
        for begin in (start, start - TURN):
            first = max(0, ceil(begin / self.increment - 1e-9))
            last = min(len(self._rays) - 1, floor((begin + width) / self.increment + 1e-9))
            if first <= last:
                yield first, last

    def _reading(self, far):
        if self._noise and far < inf:
            far = max(0.0, far + self._random.gauss(0.0, self._noise))
        return inf if far > self.reach else -inf if far < self.least else far
