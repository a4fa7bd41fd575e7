"""The run's clocks, in seconds, and whether numbers in messages are a time that grows as they do."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Sequence
from itertools import pairwise

from grader.checks.support.idioms import GET_TIME
from grader.evidence.run import Run
from grader.model.verdict import Verdict, failed, inconclusive
from grader.wording import plural

Seconds = tuple[float, ...]
ToSeconds = Callable[[int], float]
"""From a `log_time` (ns) to a second of the time that the node lives in."""
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
    at = [bisect_right(ticks, (t, float("inf"))) - 1 for t in times_ns]
    if min(at, default=-1) < 0:
        return ()
    return tuple(ticks[i][1] - ticks[at[0]][1] for i in at), wall


def run_seconds(run: Run) -> ToSeconds | None:
    """Seconds since the run began; in a warped run, those of the grader's `/clock`, None where it was not recorded."""
    if run.clock != "warped":
        return lambda time_ns: (time_ns - run.start_ns) / 1e9
    ticks = _ticks(run)
    return _interpolated(ticks, ticks[0][1]) if ticks else None


def ros_seconds(run: Run) -> ToSeconds | None:
    """Seconds of ROS's time, as `rospy.get_time()` gives them; None where the grader's `/clock` was not recorded."""
    if run.clock != "warped":
        return lambda time_ns: time_ns / 1e9
    ticks = _ticks(run)
    return _interpolated(ticks, 0.0) if ticks else None


def _interpolated(ticks: list[tuple[int, float]], zero_s: float) -> ToSeconds:
    times = [time_ns for time_ns, _ in ticks]

    def seconds(time_ns: int) -> float:
        after = bisect_right(times, time_ns)
        if after in {0, len(ticks)}:
            return ticks[max(0, after - 1)][1] - zero_s
        (first_ns, first_s), (next_ns, next_s) = ticks[after - 1], ticks[after]
        return first_s - zero_s + (next_s - first_s) * (time_ns - first_ns) / (next_ns - first_ns)

    return seconds


def _ticks(run: Run) -> list[tuple[int, float]]:
    """Return when each tick of the grader's `/clock` was sent (ns), and the time that it told (s)."""
    return [
        (time_ns, value["clock"]["secs"] + value["clock"]["nsecs"] / 1e9)
        for channel in run.channels
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
    slack_s += SLACK_SHARE * clock[-1]
    return all(abs(value - told[0] - at_s) <= slack_s for value, at_s in zip(told, clock, strict=True))


def _too_short(span_s: float) -> Verdict:
    message = (
        f"the messages were watched for {span_s:.1f} s only: too short to tell how the time in them grows"
    )
    return inconclusive(message, hint="grade again")


def _falls_back(before: float, after: float) -> Verdict:
    message = f"the time in the messages goes back from {_plain(before)} to {_plain(after)}"
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
    message = (
        f"the number in the messages grows by {_plain(growth)} in {span_s:.1f} s: it is not a time in seconds"
    )
    return failed(f"{message} ({plural(len(told), 'message')})", hint=ASK_AGAIN)


def _plain(value: float) -> str:
    return f"{value:.0f}" if value == int(value) else f"{value:.3f}"
