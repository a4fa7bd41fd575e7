"""Whether a counter begins, counts and starts again as it should."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

from pydantic import Field

from grader.checks.registry import check
from grader.checks.support.counters import (
    LOST_GAP_SHARE,
    Count,
    CounterParams,
    Step,
    WrapParams,
    added_early,
    cite_early,
    cite_slip,
    counts,
    first_values,
    judge_flood,
    judge_steps,
    judge_wraps,
    longest,
    stepping,
    steps_to_judge,
    wrong_steps,
)
from grader.checks.support.exit_causes import explain_early_end
from grader.checks.support.processes import (
    by_copies,
    is_written_as,
    observed_until_ns,
    slips_of,
)
from grader.checks.support.recorder_losses import losses
from grader.checks.support.text import LOOP
from grader.checks.support.topics import (
    cite,
    no_message,
)
from grader.evidence.run import Run
from grader.model.package import PackageFacts
from grader.model.python_slip import SlipKind
from grader.model.verdict import Status, Verdict, failed, failed_or_blocked, grade_again, inconclusive, passed
from grader.wording import NOTHING_TO_DO, plural, seconds, significant

CONNECT_NS = 1_000_000_000
LOOP_PERIODS = 2
"""How long a loop may have published nothing when the run ends, in its own periods."""
SLOW = 1.5
"""From so many nominal periods between two values on, the values are few because the loop is slow."""


class StartParams(CounterParams):
    """Where the counting begins."""

    start: int = 0
    """The first value that the counter has to publish."""


class StepParams(CounterParams):
    """How the counter goes on."""

    maximum: int = 127
    """The last value before the wrap."""
    min_steps: Annotated[int, Field(ge=1)] = 10
    """How many steps have to be seen before it can be judged."""


@check("counter-start", params=StartParams, messages_only=True, heeds_losses=True)
def counter_start(package: PackageFacts, run: Run, params: StartParams) -> Verdict:
    """The counter begins with the right value.

    What it checks
        That the very first value published on the topic is the one that the handout asks for.

    Why it matters on a robot
        A program that counts along, to find lost messages or to number pictures, begins with the first one.
        If it is off by one at the start, it is off by one for ever.

    How it is measured
        The recorder is connected before the publisher's registration returns, so the first message is not
        missed. If the grader may have missed the first values, a wrong start costs points only if a second
        run shows it too. In a flood of messages the publisher itself may drop the first ones: there it
        counts only where a line of the script shows why.

    How to fix
        Set the counter before the loop, publish it, and only then add one. `rostopic echo <topic>`, started
        before the node, shows the first value.
    """
    expected = f"{params.start} is the first value {params.place}"
    found = counts(run, params.topic, params.field)
    if not found:
        return _nothing(package, run, params).about(expected=expected)
    first = found[0]
    verdict = _cite_start(judge_start(first, run, params), first, run, package, params)
    verdict = verdict if verdict.status is Status.PASS else _of_clock(verdict, first, run, package, params)
    cited = (cite(run, params.topic, first.times_ns[0], first.times_ns[0]),)
    return verdict.about(expected=expected, measured=first_values(first.values), citations=cited)


BEGINNINGS = {"range": "the first number of its range", "count": "the number in `count(…)`"}
"""What a counter begins with that has no name."""


def _cite_start(
    verdict: Verdict, first: Count, run: Run, package: PackageFacts, params: StartParams
) -> Verdict:
    """Return a lost verdict with the line that gives the counter its value, or adds one before it is published.

    A flood begins before anything is connected to it, and its queue drops values: there only such a line counts.
    """
    if verdict.status is not Status.FAIL:
        return verdict
    early = added_early(first, run, package, params.start)
    if early is not None:
        return cite_early(verdict, early)
    added = slips_of(package, run, first.callerid, "added-first")
    count_up = {one.name: one.line for one in added}
    starts = slips_of(package, run, first.callerid, "start-value")
    wrong = [one for one in starts if int(one.message) + (one.name in count_up) == first.values[0]]
    # Of several such lines, or where several add one, none is known to be what made the first value.
    if len(wrong) != 1 or len(count_up) < len(added):
        if first.values[0] <= params.start or not first.is_flood(run, params.rate_hz):
            return verdict
        if added or len(starts) != 1 or int(starts[0].message) == params.start:
            return judge_flood(params.topic, "drops the first values", params.rate_hz)
        wrong = starts  # the only line that sets it, whatever the flood drops
    slip = wrong[0]
    where = f"line {slip.line} of {slip.file}"
    name = BEGINNINGS.get(slip.name, f"`{slip.name}`")
    why = f"{where} sets {name} to {slip.message}"
    start = params.start
    if slip.name in count_up:
        why += f", and line {count_up[slip.name]} adds one before it is published"
        start -= 1
    return verdict.explained(why, f"on {where}, set {name} to {start}", (slip.place,))


def judge_start(first: Count, run: Run, params: StartParams) -> Verdict:
    """Judge the first value of the publisher that came first."""
    if begins_with(first, params.start):
        return passed(f"{params.counter} begins with {params.start}")
    if run.foreign:
        message = f"{run.evidence} may have begun after the first message on {params.topic}"
        return inconclusive(message, hint="start the recording before the node")
    if may_have_missed_first(run, params.topic, first):
        return grade_again(f"the recorder missed the first messages on {params.topic}")
    hint = f"set the counter to {params.start} before the loop, and add one after publish(…), not before"
    message = f"the first value {params.place} is {significant(first.values[0])}, not {params.start}"
    verdict = failed(message, hint=hint)
    # Earlier values could have been lost in that time: another run has to show the same.
    return verdict.if_repeated() if _may_follow_others(run, first, params) else verdict


def _may_follow_others(run: Run, first: Count, params: StartParams) -> bool:
    """Return whether there was time for the values from the start on, between the registration and the first one."""
    registered = _registered_ns(run, params.topic, first.callerid)
    missing = first.values[0] - params.start
    if registered is None or missing <= 0:
        return False
    return first.times_ns[0] - registered >= LOST_GAP_SHARE * missing * first.period_ns


@check("counter-step", params=StepParams, messages_only=True, heeds_losses=True)
def counter_step(package: PackageFacts, run: Run, params: StepParams) -> Verdict:
    """The counter goes up by one.

    What it checks
        That every value is the one before plus one. Another check judges where the counter starts again
        (`counter-wrap`).

    Why it matters on a robot
        A counter in a message shows the receiver that something was lost. A counter that skips or repeats
        by itself raises false alarms, or hides real losses.

    How it is measured
        Value by value. If values are missing and there is also a gap in time, the machine lost them, not
        the program: this costs nothing. In a flood of messages the publisher itself throws some away; those
        skips do not count.

    How to fix
        Add one to the counter in one place only, once each time around the loop. `rostopic echo <topic>`
        shows the values.
    """
    expected = f"each value {params.place} is the one before plus one"
    count = longest(run, params)
    if count is None:
        return _nothing(package, run, params).about(expected=expected)
    steps = steps_to_judge(count, params.maximum)
    found = wrong_steps(count, run, maximum=params.maximum, rate_hz=params.rate_hz)
    wrong, right = found.steps, sum(s.change == 1 for s in steps)
    verdict = (
        judge_steps(count, found, run, params)
        or _too_few(count, len(steps), run, package, params)
        or passed(f"the counter goes up by one, {plural(right, 'time')}")
    )
    verdict = _of_clock(verdict, count, run, package, params)
    verdict = _with_lines(verdict, count, wrong, run, package, topic=params.topic)
    at = wrong[0] if wrong else Step(0, 0, 0, count.times_ns[0], count.times_ns[-1], 0, 0)
    measured = f"{plural(right, 'step')} of +1, {len(wrong)} others; {first_values(count.values)}"
    cited = (cite(run, params.topic, at.from_ns, at.to_ns),)
    return verdict.about(expected=expected, measured=measured, citations=cited)


@check("counter-wrap", params=WrapParams, messages_only=True, heeds_losses=True)
def counter_wrap(package: PackageFacts, run: Run, params: WrapParams) -> Verdict:
    """The counter goes back to its first value after its maximum.

    What it checks
        That the counter goes back to its first value when it has reached the maximum, several times.

    Why it matters on a robot
        A number in a message has a fixed width. A program that counts past it crashes, or goes on with a
        wrong number, but only after minutes or hours, when no one is testing it.

    How it is measured
        The clock runs faster, so that a node with `rospy.Rate` wraps twice within seconds; a node with
        `time.sleep` is watched in real time. "Resetting back to zero at 127" can be read in two ways, and
        both are right: after 127 comes 0, or after 126 comes 0.

    How to fix
        Reset the counter before a value that does not fit is published: `counter = (counter + 1) % 128`, or
        `if counter > 127: counter = 0` between adding one and publishing.
    """
    low, high = params.minimum, params.maximum
    times = {1: "once", 2: "twice"}.get(params.wraps, f"{params.wraps} times")
    expected = f"…{high - 1}, {high}, {low}… (or …{high - 1}, {low}…), seen {times}"
    count = longest(run, params)
    if count is None:
        return _nothing(package, run, params).about(expected=expected)
    verdict, seen = judge_wraps(count, run, package, params)
    early = added_early(count, run, package, low)
    # Added early, the counter comes back one too high: only then is that line the reason.
    if early is not None and verdict.status.is_lost and seen and seen.after == low + 1:
        verdict = cite_early(verdict, early)
    else:
        verdict = cite_slip(verdict, count, run, package, "counter-type", "compared", "reset-early")
    if seen and seen.before < high - 1:
        verdict = _with_left_out(verdict, count, run, package, params.topic)
    verdict = verdict if verdict.status is Status.PASS else _of_clock(verdict, count, run, package, params)
    turn = f"{significant(seen.before)}→{significant(seen.after)}" if seen else "no reset"
    lowest, highest = significant(min(count.values)), significant(max(count.values))
    measured = f"{plural(len(count.values), 'value')}, {lowest} to {highest}, {turn}"
    at = (seen.from_ns, seen.to_ns) if seen else (count.times_ns[0], count.times_ns[-1])
    return verdict.about(expected=expected, measured=measured, citations=(cite(run, params.topic, *at),))


def _nothing(package: PackageFacts, run: Run, params: CounterParams) -> Verdict:
    """There is no counter on the topic."""
    topic = params.topic
    # What was lost may have had the numbers.
    if losses(run, topic):
        return grade_again(f"too little was recorded on {topic}", measured="no number")
    if any(c.messages for c in run.student_channels(topic)):
        if mixed := by_copies(package, run, topic, failed_or_blocked):
            return mixed.about(measured="no number")
        hint = "publish the counter itself, as an Int8"
        if params.field != "data":
            hint = f"set {params.field} to the counter in each message, as a whole number"
        verdict = failed_or_blocked(f"{params.counter} carries no numbers", measured="no number", hint=hint)
        return verdict.based_on(misfit=True)
    return no_message(package, run, topic).about(measured="no message")


def begins_with(first: Count, start: int) -> bool:
    """Return whether this is the first of all its values, and the right one."""
    return first.values[0] == start and first.sequences[0] == 0


def may_have_missed_first(run: Run, topic: str, first: Count) -> bool:
    """Return whether values may have come before the first one that is recorded."""
    return first.sequences[0] > 0 or _recorder_was_late(run, topic, first.callerid)


def _registered_ns(run: Run, topic: str, callerid: str) -> int | None:
    return min((t for t, e in run.graph if callerid in e.publishers.get(topic, ())), default=None)


def _recorder_was_late(run: Run, topic: str, callerid: str) -> bool:
    """It was connected more than the second later that `registerPublisher` waits for it."""
    registered = _registered_ns(run, topic, callerid)
    events = ((t, e) for t, e in run.recorder if e.topic == topic and e.callerid == callerid)
    connected = min((t for t, e in events if e.event == "connected"), default=None)
    return registered is not None and connected is not None and connected - registered > CONNECT_NS


def _of_clock(
    verdict: Verdict, count: Count, run: Run, package: PackageFacts, params: CounterParams
) -> Verdict:
    """Return that neither a clock nor chance is a counter, where the script has its values from them. A clock may even
    have passed: it skips only when it is late. Nor is what several publishers send."""
    if mixed := by_copies(package, run, params.topic, failed):
        return mixed if verdict.status.is_lost else verdict
    slip = next(
        (
            s
            for s in slips_of(package, run, count.callerid, "clock-value")
            if is_written_as(s.message, params.topic)
        ),
        None,
    )
    if slip is None or verdict.basis.unjudged or verdict.status not in {Status.PASS, Status.FAIL}:
        return verdict
    how = "made up at random" if slip.name == "random" else "read from a clock"
    message = f"the values on {params.topic} are {how}, not counted ({slip.file}, line {slip.line})"
    seen = "" if verdict.status is Status.PASS else f"; {verdict.message}"
    hint = "set a counter before the loop, publish it, and add one to it each time around the loop"
    return failed(message + seen, hint=hint, citations=(slip.place,))


def _with_left_out(verdict: Verdict, count: Count, run: Run, package: PackageFacts, topic: str) -> Verdict:
    """Return the verdict with the `if` that leaves out values on the topic."""
    left_out = slips_of(package, run, count.callerid, "published-in-part")
    is_topics = any(is_written_as(one.name, topic) for one in left_out)
    return cite_slip(verdict, count, run, package, "published-in-part") if is_topics else verdict


def _with_lines(
    verdict: Verdict, count: Count, wrong: Sequence[Step], run: Run, package: PackageFacts, *, topic: str
) -> Verdict:
    """Return the verdict with the lines of the script that make the steps wrong."""
    if wrong:
        verdict = _with_left_out(verdict, count, run, package, topic)
    if wrong and all(step.change == 0 for step in wrong):
        verdict = cite_slip(verdict, count, run, package, "publish-twice")
    texts = [s for s in slips_of(package, run, count.callerid, "counter-type") if s.name == "text"]
    kinds: tuple[SlipKind, ...] = ("counter-type",) if texts else ("no-effect", "set-in-loop")
    verdict = cite_slip(verdict, count, run, package, *kinds)
    flags = [s for s in slips_of(package, run, count.callerid, "wrong-value") if s.name == "stuck"]
    if flags and any(step.change == 0 for step in wrong) and verdict.status.is_lost:
        why = f"{flags[0].file}, line {flags[0].line}: {flags[0].message}"
        verdict = verdict.explained(why, f"in {flags[0].file}, {flags[0].fix}", (flags[0].place,))
    for one in stepping(count, run, package) if wrong and verdict.status.is_lost else ():
        adds = f"adds {one.message} to `{one.name}`"
        adds = f"makes `{one.name}(…)` go on by {one.message}" if one.fix else adds
        fix = one.fix or f"add 1 to `{one.name}`, not {one.message}"
        where = f"line {one.line} of {one.file}"
        verdict = verdict.explained(f"{where} {adds}", f"on {where}, {fix}", (one.place,))
    return verdict


def _too_few(count: Count, steps: int, run: Run, package: PackageFacts, params: StepParams) -> Verdict | None:
    if steps >= params.min_steps:
        return None
    end = explain_early_end(package, run)
    cause = f": the node ended ({end.cause})" if end else ""
    message = f"only {plural(len(count.values), 'value')} came on {params.topic}{cause}"
    # What the recorder lost is not charged.
    if losses(run, params.topic):
        return grade_again(message)
    tail_ns = (observed_until_ns(run) or count.times_ns[-1]) - count.times_ns[-1]
    if end or not steps or tail_ns > LOOP_PERIODS * count.period_ns:
        return failed_or_blocked(message, hint=f"publish in a loop `{LOOP}`")
    # The values go on to the end of the run: the loop is there.
    message += f" in {seconds(count.times_ns[-1] - count.times_ns[0])}"
    if count.period_ns * params.rate_hz < SLOW * 1e9:
        longer = f"let the run last for {params.min_steps + 1} values"
        return inconclusive(message, hint=f"{NOTHING_TO_DO}tell your instructor. In the rubric: {longer}")
    is_asked = "rate_hz" in params.model_fields_set  # else another criterion may ask for another rate
    hint = f"publish at {significant(params.rate_hz)} Hz" if is_asked else "publish more often"
    return failed_or_blocked(f"{message}: it is too slow", hint=hint)
