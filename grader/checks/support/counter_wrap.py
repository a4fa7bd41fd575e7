"""How a counter starts again at its maximum, and in which ways it does not."""

from __future__ import annotations

from typing import Annotated, Literal, NamedTuple

from pydantic import Field

from grader.checks.support.counting import STUCK_COUNT, Count, Step
from grader.checks.support.exit_cause import explain_end, explain_traceback, process_tracebacks
from grader.checks.support.losses import losses
from grader.checks.support.process import early_end, lives, observed_until_ns
from grader.evidence.run import Run
from grader.model.package import PackageFacts
from grader.model.record import Record
from grader.model.verdict import Verdict, failed, inconclusive, passed, unjudged
from grader.wording import plural, significant

SILENT_PERIODS = 20
SILENT_NS = 500_000_000


class WrapParams(Record):
    """After `maximum`, or the value before it, comes `minimum`, `wraps` times; `rate_hz` is nominal."""

    topic: str
    minimum: int = 0
    maximum: int = 127
    wraps: Annotated[int, Field(ge=1)] = 2
    rate_hz: Annotated[float, Field(gt=0)] = 10.0

    @property
    def reset_hint(self) -> str:
        if self.minimum == 0:
            return f"reset before publishing: counter = (counter + 1) % {self.maximum + 1}"
        return f"reset before publishing: if counter > {self.maximum}: counter = {self.minimum}"


def judge_wraps(
    count: Count, run: Run, package: PackageFacts, params: WrapParams
) -> tuple[Verdict, Step | None]:
    """The verdict, and the turn that it rests on."""
    turns, good, wrong = turns_of(count, run, params)
    bad = wrong[0] if wrong else None
    if bad is not None:
        return _bad_turn(bad, turns, count, run, params), bad
    last = good[-1] if good else None
    if len(good) >= params.wraps:
        message = f"after {significant(good[0].before)} comes {params.minimum}, {plural(len(good), 'time')}"
        return passed(message), last
    if losses(run, params.topic) and not count.is_flood(run, params.rate_hz):
        message = f"only {plural(len(good), 'reset')} of {params.wraps} is recorded"
        return inconclusive(message, hint="grade again"), last
    verdict = _died(count, run, package, params) or _stuck(count, params)
    return verdict or _silent(count, run, package, params) or _too_few(count, good, run, params), last


class Turns(NamedTuple):
    """`every` step down, those of them that are `good`, and all `bad` steps: also those past the maximum."""

    every: list[Step]
    good: list[Step]
    bad: list[Step]


def turns_of(count: Count, run: Run, params: WrapParams) -> Turns:
    """Where bad turns of a flood are let pass, all count as good."""
    turns = [s for s in count.steps if s.change < 0]
    good = [s for s in turns if _is_good(s, params)]
    bad = [s for s in count.steps if _is_bad(s, params)]
    in_range = bool(bad) and params.minimum <= bad[0].after <= params.maximum
    if in_range and good and count.is_flood(run, params.rate_hz):
        # the publisher dropped values around this turn: those that came whole decide
        return Turns(turns, turns, [])
    return Turns(turns, good, bad)


def _is_good(step: Step, params: WrapParams) -> bool:
    return step.before in {params.maximum, params.maximum - 1} and step.after == params.minimum


def _is_bad(step: Step, params: WrapParams) -> bool:
    beyond = step.after > params.maximum
    return beyond or (
        (step.change < -1 or (step.before >= params.maximum - 1 and step.change < 0))
        and not _is_good(step, params)
    )


def _bad_turn(step: Step, turns: list[Step], count: Count, run: Run, params: WrapParams) -> Verdict:
    whose = whose_turn(step, count, run, params)
    if whose == "flood":
        message = f"{params.topic} is flooded, so its publisher drops values, also around the wrap"
        return unjudged(message, hint="first make the loop sleep, then look at the counter again")
    if whose == "lost":
        message = f"values of {params.topic} got lost around the wrap, with a gap in time"
        return inconclusive(message, hint="grade again while the machine has less to do")
    return failed(bad_turn_message(step, turns, params), hint=params.reset_hint)


def whose_turn(step: Step, count: Count, run: Run, params: WrapParams) -> Literal["program", "flood", "lost"]:
    """Whether a bad turn is the program's own, or one of values that its flood, or the way, swallowed."""
    low, high = params.minimum, params.maximum
    if step.after > high or step.after < low:
        return "program"
    if count.is_flood(run, params.rate_hz):
        return "flood"
    jump = (high - step.before) + (step.after - low) + 1
    return "lost" if count.lost_on_the_way(step, jump) else "program"


def bad_turn_message(step: Step, turns: list[Step], params: WrapParams) -> str:
    """What is wrong with a turn, in a student's words."""
    low, high = params.minimum, params.maximum
    before, after = significant(step.before), significant(step.after)
    comes = f"after {before} comes {after}"
    if step.after > high:
        late = next((s for s in turns if s.before > high), None)
        if late is None:
            return f"the counter never resets: {comes}, and it counts on"
        return f"the counter resets too late, from {significant(late.before)} to {significant(late.after)}: {comes}"
    if step.after == -(high + 1):
        return f"the counter runs over to {after}, as a signed number of this width does: {comes}"
    if step.before >= high - 1:
        return f"the counter resets to {after}, not to {low}: {comes}"
    if step.after == low:
        return f"the counter resets too early: {comes}"
    return f"the counter falls back before it has reached {high}: {comes}"


def _died(count: Count, run: Run, package: PackageFacts, params: WrapParams) -> Verdict | None:
    ended = early_end(run)
    if ended is None:
        return None
    end = explain_end(ended, run, package)
    last = count.values[-1]
    if last >= params.maximum - 1:
        message = f"the node dies at {significant(last + 1)}, where the counter should reset: {end.cause}"
        return failed(message, hint=params.reset_hint)
    message = f"the node ended at {significant(last)}, before the counter could reset twice: {end.cause}"
    return unjudged(message, hint=end.hint)


def _stuck(count: Count, params: WrapParams) -> Verdict | None:
    if count.stuck < STUCK_COUNT:
        return None
    last = significant(count.values[-1])
    message = f"the counter stays at {last} ({plural(count.stuck, 'time')} at the end)"
    at_top = count.values[-1] >= params.maximum - 1
    return (failed if at_top else unjudged)(message, hint=params.reset_hint)


def _silent(count: Count, run: Run, package: PackageFacts, params: WrapParams) -> Verdict | None:
    """The node lives, and has stopped to publish."""
    until_ns = observed_until_ns(run)
    if until_ns is None or losses(run, params.topic):
        return None
    if until_ns - count.times_ns[-1] < max(SILENT_PERIODS * count.period_ns, SILENT_NS):
        return None
    found = [t for one in lives(run) for t in process_tracebacks(run, one.name)]
    cause = f": {explain_traceback(found[-1], package).cause}" if found else ""
    message = f"the node stops publishing after {significant(count.values[-1])}, while it lives on{cause}"
    return failed(message, hint=params.reset_hint)


def _too_few(count: Count, good: list[Step], run: Run, params: WrapParams) -> Verdict:
    span_s = (count.times_ns[-1] - count.times_ns[0]) / 1e9
    seen = f"{plural(len(good), 'reset')} in {plural(len(count.values), 'value')}"
    wrong = any(s.change in {0, -1} or s.change > 1 for s in count.steps)
    outcome = run.outcome.outcome if run.outcome else None
    if good and outcome == "complete" and all(s.change in {0, 1} or s in good for s in count.steps):
        return passed(
            f"after {significant(good[0].before)} comes {params.minimum}; values repeat, so only {seen}"
        )
    if count.is_flood(run, params.rate_hz) or wrong:
        message = f"{params.wraps} resets were not seen: {seen}, which do not count up one by one"
        return unjudged(message, hint="first make the counter go up by one at its rate")
    if len(count.steps) < params.rate_hz * span_s / 2:
        message = f"{params.topic} is too slow to see {params.wraps} resets: {seen}"
        return unjudged(message, hint=f"use rospy.Rate({significant(params.rate_hz)})")
    end = {"timeout": "the run's time was over", "host": "the grading machine failed"}.get(
        outcome or "", "the run ended"
    )
    hint = "record for longer" if run.foreign else "grade again"
    return inconclusive(f"right as far as it goes, but {end} after {seen}", hint=hint)
