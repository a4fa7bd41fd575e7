"""The run's clocks, whether numbers in messages are a time that grows as they do, and how late the machine was.

A run and times of its recording come in. `clocks_at`, `run_seconds` and `ros_seconds` give what its clocks said then;
`wrong_growth` gives the verdict on numbers that should be a time, None where they are one. `lateness` gives how late
the machine was in a stretch of time, and `excused` opens a verdict that this can explain.
"""

from __future__ import annotations

import math
import statistics
import struct
from bisect import bisect_right
from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

from grader.checks.support.text import GET_TIME
from grader.evidence.events import HostEvent
from grader.evidence.run import Channel, Run, once_for_each_run
from grader.model.verdict import Verdict, failed, grade_again, inconclusive
from grader.wording import plural, seconds

Seconds = tuple[float, ...]
ToSeconds = Callable[[int], float]
"""From a `log_time` (ns) to a second of the time that the node lives in."""
TICK_S = 0.05
"""A step of the fast clock."""
TRANSPORT_S = 0.02
"""What the wall takes from a node to the recorder."""
SLACK_S = 1.5
SLACK_SHARE = 0.05
WATCHED_S = 3.0
SHORT_S = 1.1
WHOLE_S = 1.05
UNITS = {1e3: "milliseconds", 1e6: "microseconds", 1e9: "nanoseconds"}
ASK_AGAIN = f"{GET_TIME} gives the time in seconds; ask it again for every message"


def clocks_at(run: Run, times_ns: Sequence[int]) -> tuple[Seconds, ...]:
    """By each clock that a node of this run may have read: the wall's, in a warped run `/clock` before it.

    Empty for a warped run whose `/clock` was not recorded, or has not begun with the first message.
    """
    wall = tuple((t - times_ns[0]) / 1e9 for t in times_ns)
    if run.clock != "warped":
        return (wall,)
    ticks = sorted(_ticks(run))
    # What a node reads is the last tick before it sends.
    at = [bisect_right(ticks, (t, float("inf"))) - 1 for t in times_ns]
    if min(at, default=-1) < 0:
        return ()
    return tuple(ticks[i][1] - ticks[at[0]][1] for i in at), wall


def run_seconds(run: Run) -> ToSeconds | None:
    """Return the seconds since the run began; in a warped run those of `/clock`, or None where it was not recorded."""
    if run.clock != "warped":
        return lambda time_ns: (time_ns - run.start_ns) / 1e9
    ticks = _ticks(run)
    return _interpolate(ticks, ticks[0][1]) if ticks else None


def no_clock(run: Run) -> Verdict | None:
    """Return the verdict where no one can tell the time in a run with a fast clock; None where there is a clock."""
    if run_seconds(run) is not None:
        return None
    return grade_again("the run's fast clock was not recorded")


def clock_slack_s(run: Run) -> float:
    """Return by how much a time that a node reads may be off, by no fault of its own. With a fast clock it gets the
    time of the last tick, and what the wall takes from node to recorder lasts that many times longer."""
    return TICK_S + TRANSPORT_S * run.warp if run.clock == "warped" else 0.0


def time_between(run: Run, from_ns: int, to_ns: int) -> str:
    """Return how much later `to_ns` was, by the run's clock: `2.5 s`."""
    to_s = run_seconds(run)
    return seconds(to_ns - from_ns) if to_s is None else f"{to_s(to_ns) - to_s(from_ns):.1f} s"


def ros_seconds(run: Run) -> ToSeconds | None:
    """Return the seconds of ROS's time, as `rospy.get_time()` gives them; None where `/clock` was not recorded."""
    if run.clock != "warped":
        return lambda time_ns: time_ns / 1e9
    ticks = _ticks(run)
    return _interpolate(ticks, 0.0) if ticks else None


def _interpolate(ticks: list[tuple[int, float]], zero_s: float) -> ToSeconds:
    times = [time_ns for time_ns, _ in ticks]

    def seconds(time_ns: int) -> float:
        after = bisect_right(times, time_ns)
        # Outside of what was recorded, the nearest tick is all that is known.
        if after in {0, len(ticks)}:
            return ticks[max(0, after - 1)][1] - zero_s
        (first_ns, first_s), (next_ns, next_s) = ticks[after - 1], ticks[after]
        return first_s - zero_s + (next_s - first_s) * (time_ns - first_ns) / (next_ns - first_ns)

    return seconds


@once_for_each_run
def _ticks(run: Run) -> list[tuple[int, float]]:
    """Return when each tick of the grader's `/clock` was sent (ns), and the time that it told (s)."""
    return [
        (time_ns, value["clock"]["secs"] + value["clock"]["nsecs"] / 1e9)
        for channel in run.channels
        # A student's node may publish on `/clock`, too.
        if channel.topic == "/clock" and channel.by_grader
        for time_ns, value in zip(channel.times_ns, channel.values, strict=True)
        if value and value.get("clock")
    ]


def wrong_growth(told: Sequence[float], clocks: Sequence[Seconds], *, short: bool = False) -> Verdict | None:
    """Return None where the numbers told go along with one of the clocks, from wherever they start.

    Whole seconds may repeat. The first clock is the one that a message speaks of. A recording that is `short` by
    the node's own doing (a flood, its early end) is judged by less of it, and with less slack.
    """
    span_s = clocks[0][-1]
    enough_s = SHORT_S if short else WATCHED_S
    if told[0] == told[-1] == max(told) == min(told):
        message = f"the time in the messages stays at {_plain(told[0])} for {span_s:.1f} s"
        return failed(message, hint=ASK_AGAIN) if span_s >= enough_s else _too_short(span_s)
    back = next(((a, b) for a, b in pairwise(told) if b < a), None)
    if back is not None:
        return _falls_back(*back)
    slack_s = WHOLE_S if short else SLACK_S
    along = [clock[-1] for clock in clocks if _go_along(told, clock, slack_s)]
    if along:
        return None if max(along) >= enough_s else _too_short(max(along))
    return _other_pace(told, span_s)


def _go_along(told: Sequence[float], clock: Seconds, slack_s: float) -> bool:
    # Two clocks drift apart, so that the slack grows with the time.
    slack_s += SLACK_SHARE * clock[-1]
    return all(abs(value - told[0] - at_s) <= slack_s for value, at_s in zip(told, clock, strict=True))


def _too_short(span_s: float) -> Verdict:
    return grade_again(
        f"the messages were watched for {span_s:.1f} s only: too short to tell how the time in them grows"
    )


def _falls_back(before: float, after: float) -> Verdict:
    message = f"the time in the messages goes back from {_plain(before)} to {_plain(after)}"
    # Large and whole, and less than a second of nanoseconds.
    within = before < 1e9 and before == int(before) and before > 1e6
    why = "`.nsecs` is only the part after the whole second; " if within else ""
    return failed(message, hint=why + ASK_AGAIN)


def _other_pace(told: Sequence[float], span_s: float) -> Verdict:
    growth = told[-1] - told[0]
    pace = growth / span_s if span_s > 0 else 0.0
    unit = next((name for factor, name in UNITS.items() if 0.7 <= pace / factor <= 1.4), "")
    if unit:
        return failed(f"the time in the messages is in {unit}, not in seconds", hint=ASK_AGAIN)
    if all(b - a == 1 for a, b in pairwise(told)):
        message = f"the number in the messages counts them ({_plain(told[0])}, {_plain(told[1])}, …) and is not a time"
        return failed(message, hint=ASK_AGAIN)
    message = f"the number in the messages grows by {_plain(growth)} in {span_s:.1f} s: not a time in seconds"
    return failed(f"{message} ({plural(len(told), 'message')})", hint=ASK_AGAIN)


def _plain(value: float) -> str:
    return f"{value:.0f}" if value == int(value) else f"{value:.3f}"


CALIBRATION = "/grader/calibration"
CALIBRATION_TYPE = "std_msgs/Header"
PERIOD_NS = 100_000_000
STAMP = struct.Struct("<III")
FULL = 0.9
"""The share of the processors' time from which who has work to do may wait for a turn, though sleepers wake in time."""
NEVER_LATE_S = 2.0
"""No machine is so late with every single message (s on the wall)."""
LATE_MS = 100.0
"""From here on, an answer may be late for the machine's sake."""
OWN_LEAST, OTHERS_MOST = 0.6, 0.25
"""Shares of the processors' time of half a second: a run that took so much itself, and left so little to all others,
made the machine late in it. One busy loop takes half of two processors, and is not it; nor is who shares the machine.
"""
NO_EXCUSE = "the grading machine was busy with this run's own processes, which is no excuse"


class Lateness(NamedTuple):
    """In ms: the mean, the 95th percentile and the most, the larger of what timer and calibration say.

    `sleep_ms` is what a sleep of 0.1 s took too long in the mean, `calibration_hz` the rate of a loop of such sleeps;
    None where no calibration was recorded. `busy` is the share of the processors' time that was taken, `own` what of
    it the run's own processes took.
    """

    mean_ms: float
    p95_ms: float
    max_ms: float
    sleep_ms: float | None = None
    calibration_hz: float | None = None
    busy: float | None = None
    own: float | None = None

    @property
    def full(self) -> bool:
        """Whether the machine had next to no time to spare."""
        return (self.busy or 0.0) >= FULL

    def reason(self, max_ms: float, p95_ms: float = math.inf) -> str:
        """Return what the machine was, `busy` or `late itself, by up to 80 ms`; "" where it was less late than this."""
        if self.full:
            return "busy"
        late = self.max_ms >= max_ms or self.p95_ms >= p95_ms
        return f"late itself, by up to {self.max_ms:.0f} ms" if late else ""

    @property
    def described(self) -> str:
        """`machine 97 % busy (by this run alone: 95 %) and late by 3 ms, calibration 9.97 Hz`."""
        share = self.own or 0.0
        own = f" (by this run alone: {share * 100:.0f} %)" if share >= OTHERS_MOST else ""
        busy = "" if self.busy is None else f" {self.busy * 100:.0f} % busy{own} and"
        late = f"machine{busy} late by {self.max_ms:.0f} ms"
        return late if self.calibration_hz is None else f"{late}, calibration {self.calibration_hz:.2f} Hz"


def lateness(run: Run, from_ns: int, to_ns: int, *, own: bool = False) -> Lateness | None:
    """Between two times of the run; None where nothing was measured (another tool's recording).

    Of what excuses a run: the half seconds that its own processes filled are left out, unless `own` asks for them too.
    """
    windows = [w for w in _windows(run, from_ns, to_ns) if own or not w.is_own]
    left_out = [] if own else [w for w in _windows(run, from_ns, to_ns) if w.is_own]
    timer = _timer(windows)
    sleeps = [late for channel in run.channels for late in _sleeps_ms(channel, from_ns, to_ns, left_out)]
    if not sleeps:
        return timer if run.host else None
    mean_ms = statistics.fmean(sleeps)
    return Lateness(
        max(timer.mean_ms, mean_ms),
        max(timer.p95_ms, sorted(sleeps)[int(0.95 * (len(sleeps) - 1))]),
        max(timer.max_ms, *sleeps),
        sleep_ms=mean_ms,
        calibration_hz=1e3 / (PERIOD_NS / 1e6 + mean_ms),
        busy=timer.busy,
        own=timer.own,
    )


def excused(verdict: Verdict, run: Run, from_ns: int, to_ns: int, why: Callable[[Lateness], str]) -> Verdict:
    """Return the verdict, open where the machine was so late that nothing follows from it.

    `why` gives what the machine was that explains the failure, or "". What the run's own processes did excuses nothing.
    """
    late, whole = (lateness(run, from_ns, to_ns, own=own) for own in (False, True))
    if late is None or whole is None:
        return verdict
    if what := why(late):
        message = f"{verdict.message}; but the grading machine was {what}"
        hint = "grade again when the machine is less busy"
        still_open = inconclusive(message, hint=hint, measured=verdict.measured)
        return still_open.based_on(excused=verdict.message)
    if why(whole):
        told = verdict.model_copy(update={"message": f"{verdict.message}; {NO_EXCUSE}"})
        return told.based_on(own_load=True)
    return verdict


def why_late(late: Lateness) -> str:
    """Return what the machine was where it was late enough to delay an answer; "" where it was not."""
    return late.reason(LATE_MS)


class _Window(NamedTuple):
    """What one event tells of."""

    from_ns: int
    to_ns: int
    event: HostEvent

    @property
    def is_own(self) -> bool:
        """Whether the run's own processes filled the machine."""
        busy, own = self.event.busy, self.event.own_busy
        return (
            # Rounded, as the difference of two shares is not exact.
            busy is not None and own is not None and own >= OWN_LEAST and round(busy - own, 3) <= OTHERS_MOST
        )


def _windows(run: Run, from_ns: int, to_ns: int) -> list[_Window]:
    """Return all that touch this stretch of time."""
    starts = [run.start_ns, *(t for t, _ in run.host)]
    # There is one start more than events: what came after the last one was not measured.
    found = [_Window(start, t, event) for start, (t, event) in zip(starts, run.host, strict=False)]
    return [w for w in found if w.to_ns > from_ns and w.from_ns < to_ns]


def _timer(windows: Sequence[_Window]) -> Lateness:
    """Return the worst lateness that was reported."""
    events = [w.event for w in windows]
    return Lateness(
        max((e.mean_ms for e in events), default=0.0),
        max((e.p95_ms for e in events), default=0.0),
        max((e.max_ms for e in events), default=0.0),
        busy=_mean([e.busy for e in events if e.busy is not None]),
        own=_mean([e.own_busy for e in events if e.own_busy is not None]),
    )


def _mean(shares: Sequence[float]) -> float | None:
    return statistics.fmean(shares) if shares else None


def _sleeps_ms(channel: Channel, from_ns: int, to_ns: int, left_out: Sequence[_Window]) -> Iterator[float]:
    """How much too long each sleep of the calibration was, by its own stamps, of those that touch the stretch and none
    of the windows `left_out`."""
    if channel.topic != CALIBRATION or channel.type != CALIBRATION_TYPE or not channel.by_grader:
        return
    whole = [m for m in channel.messages if len(m.data) >= STAMP.size]
    for before, after in pairwise(whole):
        own = any(w.from_ns < after.log_time_ns and w.to_ns > before.log_time_ns for w in left_out)
        if after.log_time_ns >= from_ns and before.log_time_ns <= to_ns and not own:
            yield max(0.0, (_sent_ns(after.data) - _sent_ns(before.data) - PERIOD_NS) / 1e6)


def _sent_ns(data: bytes) -> int:
    _, seconds, nanoseconds = STAMP.unpack_from(data)
    return int(seconds * 10**9 + nanoseconds)
