"""How the robot moves, what it runs into and what its laser sees, without ROS. Metres, radians, seconds."""

from math import atan2, ceil, cos, floor, hypot, inf, isfinite, pi, sin

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
        chord = forward * STEP_S * (sin(half) / half if abs(half) > 1e-9 else 1.0)
        x, y = self.x + chord * cos(self.theta + half), self.y + chord * sin(self.theta + half)
        theta = self.theta + 2 * half
        self.theta = theta - TURN * floor((theta + pi) / TURN)
        self.hits = bool(forward) and self._blocked(x, y)
        self.forward = 0.0 if self.hits else forward
        if not self.hits:
            self.x, self.y = x, y

    def _blocked(self, x, y):
        """Whether a wall is in the way, and nearer than before."""
        at = self._near_at
        if at is None or hypot(x - at[0], y - at[1]) > NEAR_M:
            self._near_at = (x, y)
            self._near = [w for w in self._walls if distance(x, y, w) <= 2 * NEAR_M + self.radius]
        return any(
            distance(x, y, wall) < min(self.radius, distance(self.x, self.y, wall)) for wall in self._near
        )


def distance(x, y, wall):
    """From a point to a wall."""
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
        """What it sees from there. Of each wall, only the rays between its ends are looked at."""
        ranges = [inf] * len(self._rays)
        ahead, aside = cos(theta), sin(theta)
        for (x0, y0), (x1, y1) in self._walls:
            ax, ay = ahead * (x0 - x) + aside * (y0 - y), ahead * (y0 - y) - aside * (x0 - x)
            bx, by = ahead * (x1 - x) + aside * (y1 - y), ahead * (y1 - y) - aside * (x1 - x)
            cross = ax * by - ay * bx
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
        return [self._told(far) for far in ranges]

    def _between(self, ax, ay, bx, by):
        """The numbers of the rays between two points, the second to the left of the first: once or twice a stretch."""
        start = (atan2(ay, ax) - self.low) % TURN
        width = (atan2(by, bx) - atan2(ay, ax)) % TURN
        for begin in (start, start - TURN):
            first = max(0, ceil(begin / self.increment - 1e-9))
            last = min(len(self._rays) - 1, floor((begin + width) / self.increment + 1e-9))
            if first <= last:
                yield first, last

    def _told(self, far):
        if self._noise and far < inf:
            far = max(0.0, far + self._random.gauss(0.0, self._noise))
        return inf if far > self.reach else -inf if far < self.least else far
