"""Checks of this lab's instructor."""

from __future__ import annotations

from bisect import bisect_left

from grader.checks import EvidenceCitation, Record, Run, Verdict, check, failed_or_blocked, partial, passed


class InStepParams(Record):
    """Two topics, and how far apart their messages may come."""

    first: str
    """The topic whose messages are looked at, with its slash."""
    second: str
    """The topic on which one has to come beside each of them."""
    within_s: float = 0.05
    """How far apart the two may be, one way or the other."""


@check("in-step", params=InStepParams, messages_only=True)
def in_step(run: Run, params: InStepParams) -> Verdict:
    """Two topics go in step.

    What it checks
        That each message on one topic has a message on the other beside it.

    Why it matters on a robot
        Readings that belong together are of no use when one of them is a second old.

    How it is measured
        By the times at which the messages arrived.

    How to fix
        Publish both in the same turn of the loop.
    """
    firsts, seconds = times(run, params.first), times(run, params.second)
    if not firsts or not seconds:
        return failed_or_blocked(f"no message came on {params.second if firsts else params.first}")
    alone = [t for t in firsts if not has_near(t, seconds, params.within_s * 1e9)]
    if not alone:
        return passed(f"all {len(firsts)} messages on {params.first} have one on {params.second} beside them")
    return partial(
        1 - len(alone) / len(firsts),
        f"{len(alone)} of {len(firsts)} messages on {params.first} come alone",
        expected=f"one on {params.second} within {params.within_s:g} s",
        hint="publish both in the same turn of the loop",
        citations=(
            EvidenceCitation(evidence=run.evidence, topic=params.first, from_ns=alone[0], to_ns=alone[-1]),
        ),
    )


def times(run: Run, topic: str) -> list[int]:
    """When messages of the student's nodes arrived, in ns."""
    return sorted(t for channel in run.student_channels(topic) for t in channel.times_ns)


def has_near(time_ns: int, others: list[int], within_ns: float) -> bool:
    """Whether one of `others`, which are in order, is near."""
    at = bisect_left(others, time_ns)
    return any(abs(other - time_ns) <= within_ns for other in others[max(0, at - 1) : at + 1])
