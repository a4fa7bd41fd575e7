"""Ctrl-C in the middle of `publish(…)` or `loginfo(…)` can lock up rospy's own shutdown, by no fault of the student's:
its signal handler then waits for a lock that the interrupted call holds.
"""

from __future__ import annotations

from grader.checks.support.process import Life
from grader.evidence.run import Run

FLOOD_HZ = 100
SILENT_AFTER_NS = 500_000_000
TALKING_NS = 1_000_000_000
TALKING_LINES = 5


def fell_silent(one: Life, run: Run) -> bool:
    """It had to be killed, and after Ctrl-C it neither printed nor published."""
    if one.interrupt_ns is None or one.end is None or one.end.stopped_by != "KILL":
        return False
    quiet_ns = one.interrupt_ns + SILENT_AFTER_NS
    printed = any(t > quiet_ns for t, _ in run.lines(one.name))
    return not printed and not any(t > quiet_ns for c in run.student_channels() for t in c.times_ns[-1:])


def was_talking(one: Life, run: Run) -> bool:
    """It printed line after line until Ctrl-C, so that its silence afterwards is no loop that goes on."""
    end_ns = one.interrupt_ns or 0
    return sum(end_ns - TALKING_NS <= t <= end_ns for t, _ in run.lines(one.name)) >= TALKING_LINES


def is_flood(run: Run) -> bool:
    """So many messages that Ctrl-C most likely comes in the middle of one."""
    return any(
        len(c.times_ns) > FLOOD_HZ
        and (len(c.times_ns) - 1) * 1e9 >= FLOOD_HZ * (c.times_ns[-1] - c.times_ns[0])
        for c in run.student_channels()
    )
