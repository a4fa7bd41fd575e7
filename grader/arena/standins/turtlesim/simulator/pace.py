"""When the turtles' next steps are due."""

STILL_S = 1.0
CATCH_UP_STEPS = 1000


class Pace:
    """Counts steps of `step_s` on a clock that may jump, stand still or run faster than the wall's.

    Time that passes while the clock stands still for over a second is counted on the wall's clock, as for a simulated
    clock that nobody drives.
    """

    def __init__(self, step_s):
        self._step_s = step_s
        self._last_s = None
        self._moved_s = 0.0
        self._owed_s = 0.0

    def due(self, clock_s, wall_s):
        """How many steps are due now."""
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
        steps = int(self._owed_s / self._step_s + 1e-6)
        self._owed_s -= steps * self._step_s
        return min(steps, CATCH_UP_STEPS)
