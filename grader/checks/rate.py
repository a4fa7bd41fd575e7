"""Whether messages come at the rate that the handout asks for, evenly."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from functools import partial
from itertools import pairwise
from typing import Annotated, Any

from pydantic import Field, model_validator

from grader.checks.reacts import ORDER_S
from grader.checks.registry import Refers, check
from grader.checks.support.clocks import Lateness, excused, lateness
from grader.checks.support.conditions import Condition, absent_in, how_shown, true_spans, words_in
from grader.checks.support.exit_causes import explain_early_end, explain_error
from grader.checks.support.fields import value_text
from grader.checks.support.parameters import params_on_server, resolved_param, where_given
from grader.checks.support.processes import (
    OnTopic,
    copied_topic,
    is_written_as,
    life_of,
    observed_until_ns,
    run_scripts,
    slips_of,
)
from grader.checks.support.recorder_losses import whole_until_ns
from grader.checks.support.scripts import slips_of_program
from grader.checks.support.text import LOOP, SPIN, fixes_of, loop_rate, python_or_cpp, rate_hint
from grader.checks.support.topics import (
    SYSTEM_TOPICS,
    Sender,
    call_in_comment,
    cite,
    nothing_sent,
    sent_by,
    unheard,
)
from grader.evidence.run import Channel, Run
from grader.model.message_rate import ROUNDING, RateBounds, Rhythm
from grader.model.package import PackageFacts
from grader.model.python_slip import PythonSlip, SlipKind
from grader.model.verdict import Status, Verdict, failed, failed_or_blocked, grade_again, inconclusive, passed
from grader.wording import ask_rate, hertz, join_words, plural, seconds, significant

FLOOD_FACTOR = 5
FLOOD_HZ = 500.0
"""No lab asks for so much: what is slower and even comes from a loop that sleeps, by a wrong number."""
RATE_NAME = re.compile(r"rate|hz|freq", re.IGNORECASE)  # of parameters
PAUSES_WAITED = 1.5
"""A silence of at most so many of the pauses that a script asks for is one of them."""
NUMBER_SHARE = 0.1
"""So near is a rate that was measured to the number that its script asks for."""
NEAR_SHARE = 0.25
"""A rate that is wrong by less than this share is measured once more before it costs anything."""
SLEEPLESS = ("not-called", "sleep-outside", "undefined", "misspelt")
"""Slips that keep a loop from sleeping."""
LATE_P95_SHARE, LATE_MAX_SHARE = 0.2, 0.5
SILENT_PERIODS, STALLS_SHARE = 1.5, 0.1
"""Of the gaps: who is kept waiting by a full machine is so now and then, and keeps its rate otherwise."""

Share = Annotated[float, Field(ge=0, le=1)]
Positive = Annotated[float, Field(gt=0)]


class RateParams(OnTopic):
    """The nominal rate, and how far from it messages may come."""

    rate_hz: Positive
    """The nominal rate."""
    tolerance: Share = 0.05
    """The share by which the mean may differ: 0.05 is 5 %."""
    tolerance_low: Share | None = None
    """The same for a mean that is too low; null: `tolerance`."""
    tolerance_high: Positive | None = None
    """The same for a mean that is too high; null: `tolerance`."""
    gap_tolerance: Share = 0.5
    """The share of the nominal period by which a single gap may differ."""
    share_in_bounds: Share = 0.95
    """The share of the gaps that has to be within `gap_tolerance`."""
    min_window_s: Annotated[Positive, Refers("watched_s")] = 5.0
    """How long messages have to be seen before the rate is judged."""
    of: Sender = "student"
    """Whose messages count: the `student`'s nodes', those of a `program` that the scenario starts beside them, or
    `anyone`'s."""
    cause: Annotated[Condition, Refers("cause")] | None = None
    """For a rate that changes within the run: only messages that come while this is true count. It needs a `field`,
    unless it is a service without one (`std_srvs/Trigger`): then it is true from the call on. Null: all of them."""
    within_s: Annotated[float, Field(ge=0)] = 0.0
    """How soon after the cause begins the rate has to hold. Required with a `cause`; give the longest pause of the loop
    before it, which a node may sleep to its end."""

    @model_validator(mode="after")
    def _has_cause(self) -> RateParams:
        if (self.cause is None) == bool(self.within_s):
            raise ValueError("give cause and within_s together")
        return self

    @property
    def low_hz(self) -> float:
        return self.rate_hz * (1 - (self.tolerance if self.tolerance_low is None else self.tolerance_low))

    @property
    def high_hz(self) -> float:
        return self.rate_hz * (1 + (self.tolerance if self.tolerance_high is None else self.tolerance_high))

    @property
    def period_ns(self) -> float:
        return 1e9 / self.rate_hz

    @property
    def bounds_ns(self) -> tuple[float, float]:
        """Within which a gap is as it should be."""
        return self.period_ns * (1 - self.gap_tolerance), self.period_ns * (1 + self.gap_tolerance)

    @property
    def rate_bounds(self) -> RateBounds | None:
        """Return what the recorder has to know of the rate: a run may end when it is clear. One that is asked for a
        part of the run has no say in that."""
        if self.cause is not None:
            return None
        low_ns, high_ns = self.bounds_ns
        return RateBounds(
            topic=self.topic,
            low_hz=self.low_hz,
            high_hz=self.high_hz,
            low_gap_ns=low_ns,
            high_gap_ns=high_ns,
            min_window_s=self.min_window_s,
        )


@check("rate", params=RateParams, messages_only=True, heeds_losses=True)
def rate(package: PackageFacts, run: Run, params: RateParams) -> Verdict:
    """The topic has the right rate, evenly.

    What it checks
        That messages come at the nominal rate, and one at a time: ten messages in one burst every second
        are not 10 Hz.

    Why it matters on a robot
        Controllers are tuned to a rate, and watchdogs stop the robot when messages come late. A loop
        without a sleep fills the network and takes a whole core.

    How it is measured
        In real time, over at least 5 s after the first message, or with a `cause` in each stretch of at least
        5 s in which it is true. The mean has to lie within 5 % of the
        nominal rate, and 95 % of the gaps within half a period of the nominal one (a rubric may set other
        bounds). One single stall costs nothing. A failed rate also costs nothing, and the run is repeated,
        if the grading machine itself was late, or had no time to spare and only a few long gaps are wrong;
        unless your own nodes kept it busy. The mean is given with its 95 % confidence interval.

    How to fix
        `rate = rospy.Rate(10)` once before the loop, `rate.sleep()` (with the brackets) once each time
        around it, and nothing slow in the loop. `rostopic hz <topic>` shows the rate.
    """
    expected = f"{params.low_hz:g} to {params.high_hz:g} Hz on {params.topic}, evenly"
    if params.cause is not None:
        expected += f", from {significant(params.within_s)} s after {words_in(run, params.cause)}"
    # In warped time messages arrive faster than their node's clock says.
    if run.clock != "real":
        message = "rates are judged in real time only, and this run was warped"
        return inconclusive(message, expected=expected, hint="give the criterion a scenario with clock: real")
    channels = sent_by(run, params.topic, params.of)
    verdicts = [_judge(one, run, package, params) for one in rhythms_to_judge(run, params, channels)]
    if params.cause is not None and any(c.messages for c in channels):
        verdicts += _without_messages(run, params, params.cause, channels, is_all=not verdicts)
    verdicts = verdicts or [nothing_sent(package, run, params.topic, params.of)]
    verdict = next((one for one in verdicts if one.status is not Status.PASS), verdicts[0])
    return verdict.about(expected=expected)


def _judge(found: Rhythm, run: Run, package: PackageFacts, params: RateParams) -> Verdict:
    """Return the verdict on one stretch of messages."""
    verdict = (
        # In this order: a flood is uneven and soon over as well, and its missing sleep is what there is to fix.
        _flood(found, run, package, params)
        or _short(found, run, package, params)
        or _excuse_lateness(_uneven(found, run, package, params), found, run, package, params)
        or passed(f"{params.topic} runs at {hertz(found.mean_hz)}, evenly")
    )
    if params.cause is not None:
        message = f"with {words_in(run, params.cause)}, {verdict.message}"
        verdict = verdict.model_copy(update={"message": message})
    citations = (cite(run, params.topic, found.times_ns[0], found.times_ns[-1]),)
    measured = found.described(*params.bounds_ns)
    if verdict.status is Status.INCONCLUSIVE or verdict.basis.own_load:
        late = lateness(run, found.times_ns[0], found.until_ns, own=True) if found.gaps_ns else None
        measured += f", {late.described}" if late else ""
    return verdict.about(measured=measured, citations=citations)


def _without_messages(
    run: Run, params: RateParams, cause: Condition, channels: Sequence[Channel], *, is_all: bool
) -> Iterator[Verdict]:
    """Yield the verdict on the stretches without a message. If they are all there is, none may be long enough."""
    silent = [one for one in _spans(run, params, cause) if _rhythm(channels, one, params) is None]
    longest_ns, words = max((end_ns - from_ns for from_ns, end_ns in silent), default=0), words_in(run, cause)
    if longest_ns >= max(params.min_window_s * 1e9, SILENT_PERIODS * params.period_ns):
        message = f"no message came on {params.topic} for {seconds(longest_ns)} with {words}"
        yield failed(message, hint=f"publish on {params.topic} all the time, also then").if_repeated()
    elif is_all and any(map(cause.holds, cause.come_in(run))):
        yield grade_again(f"{words} lasted too short a time to judge the rate of {params.topic}")
    elif is_all:
        deaf, absent = unheard(run), absent_in(run, cause)
        hint = deaf.hint if deaf else f"{how_shown(run, cause)} while your node runs"
        yield failed_or_blocked(f"{absent}: {deaf.message}" if deaf else absent, hint=hint).if_repeated()


def _excuse_lateness(
    uneven: Verdict | None, found: Rhythm, run: Run, package: PackageFacts, params: RateParams
) -> Verdict | None:
    """The verdict, unless the machine was late itself: a rate that a script asks for is none of the machine's."""
    if uneven is None or _asked_number(found, run, package, params) is not None:
        return uneven
    return excused(uneven, run, found.times_ns[0], found.until_ns, partial(_why_late, found, params=params))


def rhythms_to_judge(run: Run, params: RateParams, channels: Sequence[Channel]) -> list[Rhythm]:
    """Return what these channels of the topic sent, as far as it is judged: in each stretch of time that counts."""
    until_ns = whole_until_ns(run, params.topic, observed_until_ns(run))
    if params.cause is None:
        found = [_rhythm(channels, (None, until_ns), params)]
    else:
        spans = _spans(run, params, params.cause)
        least_ns = params.min_window_s * 1e9
        # A stretch that is too short for a rate counts only where none is long enough.
        spans = [one for one in spans if one[1] - one[0] >= least_ns] or spans[:1]
        found = [_rhythm(channels, span, params) for span in spans]
    return [one for one in found if one is not None]


def _rhythm(
    channels: Sequence[Channel], span: tuple[int | None, int | None], params: RateParams
) -> Rhythm | None:
    """Return all messages of these channels in a stretch of time. Silence at its ends counts from 1.5 periods on."""
    from_ns, until_ns = span
    times = sorted(
        t for c in channels for t in c.times_ns if until_ns is None or (from_ns or 0) <= t <= until_ns
    )
    if not times:
        return None
    least_ns = SILENT_PERIODS * params.period_ns
    if from_ns is not None:  # a stretch begins and ends anywhere between two messages
        least_ns = max([least_ns, *(b - a for a, b in pairwise(times))])
        times = [*([from_ns] if times[0] - from_ns > least_ns else []), *times]
    silent = until_ns is not None and until_ns - times[-1] > least_ns
    return Rhythm(times_ns=tuple(times), until_ns=until_ns if silent and until_ns is not None else times[-1])


def _spans(run: Run, params: RateParams, cause: Condition) -> list[tuple[int, int]]:
    """Return when the rate has to hold, from `within_s` after the cause began."""
    until_ns = whole_until_ns(run, params.topic, run.end_ns)
    spans = true_spans(cause, cause.come_in(run), run)
    settle_ns, order_ns = round(params.within_s * 1e9), round(ORDER_S * 1e9)
    later = [(begin_ns + settle_ns, min(end_ns - order_ns, until_ns or end_ns)) for begin_ns, end_ns in spans]
    return [(begin_ns, end_ns) for begin_ns, end_ns in later if begin_ns < end_ns]


def _flood(found: Rhythm, run: Run, package: PackageFacts, params: RateParams) -> Verdict | None:
    # A few messages close together are a burst, not a flood.
    if len(found.times_ns) < 20 or found.mean_hz < FLOOD_FACTOR * params.rate_hz:
        return None
    own = (life_of(run, channel.callerid) for channel in run.student_channels(params.topic))
    scripts = {life.start.script for life in own if life is not None and life.start.script}
    # Another script may lack its sleep, too: only one whose node publishes here explains this flood.
    told = [s for s in package.slips if s.kind in SLEEPLESS and "sleep" in s.name + s.fix]
    slips = [s for s in told if not scripts or s.file in scripts]
    if not slips and (found.mean_hz >= FLOOD_HZ or not found.is_even):
        slip = call_in_comment(package, run, "sleep")
        slips = [slip] if slip is not None else []
    # An even stream sleeps, if too briefly: it has a wrong rate, not a loop without a sleep.
    if not slips and found.mean_hz < FLOOD_HZ and found.is_even:
        return None
    if not slips and (slip := _asked_flood(found, run, package, params)):
        return _with_line(_wrong_mean(found, params), slip, params)
    where = f" ({slips[0].file}, line {slips[0].line}: {slips[0].message})" if slips else ""
    hz = significant(params.rate_hz)
    about = f"{float(f'{found.mean_hz:.2g}'):,.0f}"
    made = python_or_cpp(f"rate = rospy.Rate({hz})", f"ros::Rate rate({hz})")
    hint = f"call rate.sleep(), with brackets, in every iteration; {made}"
    # There is a `sleep()` already, behind the loop or in a comment: the slip says what to do with it.
    if slips and slips[0].kind in {"sleep-outside", "commented-out"}:
        hint = fixes_of(slips)
    message = f"{params.topic} runs at about {about} Hz instead of {hz} Hz: the loop does not sleep{where}"
    return failed(message, hint=hint, citations=tuple(s.place for s in slips[:3]))


def _asked_flood(found: Rhythm, run: Run, package: PackageFacts, params: RateParams) -> PythonSlip | None:
    """Return where the node's script asks for so many messages, or for more than it can send."""
    least_hz = max((1 - NUMBER_SHARE) * found.mean_hz, FLOOD_FACTOR * params.rate_hz)
    return next(
        (s for s in _slips(run, package, params, "rate-number") if float(s.message) >= least_hz), None
    )


def _short(found: Rhythm, run: Run, package: PackageFacts, params: RateParams) -> Verdict | None:
    """Too little was seen to speak of a rate."""
    if found.span_ns >= params.min_window_s * 1e9 * (1 - ROUNDING):
        return None
    seen = f"only {plural(len(found.times_ns), 'message')} in {seconds(found.span_ns)} on {params.topic}"
    if end := explain_early_end(package, run):
        verdict = end.verdict(failed_or_blocked, f"{seen}: the node ended ({end.cause})")
        if not end.by_itself or run.foreign:
            return verdict
        hint = f"publish in a loop `{LOOP}`" if SPIN in verdict.hint else verdict.hint
        # A loop that never waits can be over before a rate shows: then the pause is the second thing to write.
        if not _has_rate(package, run):
            paced = f"rate = rospy.Rate({significant(params.rate_hz)}) above the loop, rate.sleep() in it"
            hint = f"{hint}; then let it wait: {paced}"
        return verdict.model_copy(update={"hint": hint})
    message = f"{seen}, a rate needs {params.min_window_s:g} s"
    return inconclusive(message, hint="record for longer" if run.foreign else "grade again")


def _has_rate(package: PackageFacts, run: Run) -> bool:
    """Return whether a script that runs asks for a rate somewhere, or is none of Python."""
    scripts = run_scripts(run)
    python = any(file.python for file in package.files if file.path in scripts)
    return not python or any(s.kind.startswith("rate-") for s in package.slips if s.file in scripts)


def _uneven(found: Rhythm, run: Run, package: PackageFacts, params: RateParams) -> Verdict | None:
    """Return what is wrong with the rate, None if nothing is."""
    mean_hz, period_ns = found.mean_hz, params.period_ns
    outside = found.outside(*params.bounds_ns)
    allowed = (1 - params.share_in_bounds) * len(found.gaps_ns) + ROUNDING
    even = len(outside) <= allowed or found.is_single_stall(outside, period_ns)
    in_bounds = params.low_hz * (1 - ROUNDING) <= mean_hz <= params.high_hz * (1 + ROUNDING)
    if in_bounds and even:
        return None
    wrong = _wrong_mean(found, params)
    # What a line of the script, or the shape of the stream, explains goes before the bare numbers.
    return (
        _at_random(found, run, package, params)
        or (_by_slip(wrong, "rate-as-time", run, package, params) if mean_hz * params.rate_hz < 4 else None)
        or _fell_silent(found, run, package, params)
        or _published_twice(found, run, package, params)
        or (_by_slip(wrong, "publish-twice", run, package, params) if mean_hz > params.high_hz else None)
        or _by_slip(wrong.based_on(unjudged=True), "loop-left", run, package, params, name="once")
        or _bursts(found, outside, even, params)
        or (_by_slip(wrong, "sleep-twice", run, package, params) if mean_hz < params.rate_hz else None)
        or ((slip := _asked_number(found, run, package, params)) and _with_line(wrong, slip, params))
        or _left_out(wrong, mean_hz, run, package, params)
        or _by_parameter(wrong, run, package, params, mean_hz)
    )


def _at_random(found: Rhythm, run: Run, package: PackageFacts, params: RateParams) -> Verdict | None:
    """Name the line that waits for a time drawn at random, in a script that asks for no rate besides."""
    asked = _slips(run, package, params, "rate-random", "rate-number")
    if {slip.kind for slip in asked} != {"rate-random"}:
        return None
    uneven = failed(f"{params.topic} comes unevenly: {hertz(found.mean_hz)} on average")
    is_right = params.low_hz <= found.mean_hz <= params.high_hz
    wrong = uneven if is_right else _wrong_mean(found, params).based_on(timing=False)
    return _with_line(wrong, asked[0], params)


def _fell_silent(found: Rhythm, run: Run, package: PackageFacts, params: RateParams) -> Verdict | None:
    """The silence at the end is longer than anything that came before it."""
    # The last gap is the silence itself, up to when the node was watched.
    before_ns = max(found.gaps_ns[:-1], default=0)
    # So long that neither a stall nor the topic's own pauses explain it.
    if found.tail_ns <= max(5 * params.period_ns, 2 * before_ns, 0.5e9):
        return None
    lasted = seconds(found.times_ns[-1] - found.times_ns[0])
    message = f"{params.topic} falls silent {lasted} after its first message, although its node keeps running"
    if slow := _asked_slow(found, run, package, params):
        return slow
    if asleep := _asleep(found, run, package, params):
        rate = f"a ros::Rate of {significant(params.rate_hz)} Hz"
        hint = f"delete line {asleep.line} of {asleep.file}, and let {rate} wait"
        return failed(f"{message}: {asleep.message}", hint=hint, citations=(asleep.place,))
    others = _goes_on(found, run, params)
    # A loop that still publishes on another topic was not left.
    kinds: tuple[SlipKind, ...] = ("spin-in-loop", "unregistered", "stuck")
    kinds = kinds if others else (*kinds, "never-begun", "loop-left")
    if slip := next(iter(_slips(run, package, params, *kinds)), None):
        return failed(f"{message}: {slip.message}", hint=slip.fix, citations=(slip.place,))
    if end := explain_error(package, run):
        return end.verdict(failed, f"{message}: an error comes first: {end.cause}")
    hint = f"publish in a loop `{LOOP}`, not a fixed number of times"
    if others:
        message += f" and goes on publishing on {others}"
        hint = f"publish on {params.topic} in the loop that publishes on {others} too, and nowhere else"
    return failed(message, hint=hint).if_repeated()


def _asleep(found: Rhythm, run: Run, package: PackageFacts, params: RateParams) -> PythonSlip | None:
    """Return the long pause of a program of C++, if the silence is no longer than that."""
    lives = [life_of(run, c.callerid) for c in run.student_channels(params.topic)]
    slips = [s for one in lives if one for s in slips_of_program(one.start.argv, package, "deaf")]
    return next((s for s in slips if s.name and found.tail_ns < float(s.name) * 1e9), None)


def _goes_on(found: Rhythm, run: Run, params: RateParams) -> str:
    """Return the topics on which the same node publishes half of the time and longer after this one fell silent."""
    callers = {c.callerid for c in run.student_channels(params.topic)}
    since_ns = found.times_ns[-1] + found.tail_ns // 2
    own = (c for c in run.student_channels() if c.callerid in callers and c.topic not in SYSTEM_TOPICS)
    after = [c.topic for c in own if c.messages and c.messages[-1].log_time_ns > since_ns]
    return join_words(topic for topic in dict.fromkeys(after) if topic != params.topic)


def _asked_slow(found: Rhythm, run: Run, package: PackageFacts, params: RateParams) -> Verdict | None:
    """The silence is no longer than the pause for which the node's script asks."""
    asked = _slips(run, package, params, "rate-number")
    slow = next((s for s in asked if found.tail_ns * float(s.message) < PAUSES_WAITED * 1e9), None)
    if slow is None or float(slow.message) >= params.low_hz:
        return None
    seen = f"{params.topic} is too slow: {plural(len(found.times_ns), 'message')} in {seconds(found.span_ns)}"
    return _with_line(failed(f"{seen} instead of {significant(params.rate_hz)} Hz"), slow, params)


def _published_twice(found: Rhythm, run: Run, package: PackageFacts, params: RateParams) -> Verdict | None:
    """The node has two publishers of the topic, one of which may be meant for another one."""
    copied = copied_topic(package, run, "publisher", params.topic)
    if not copied or found.mean_hz <= params.high_hz:
        return None
    message = f"{_wrong_mean(found, params).message}: {copied} publish on it"
    return failed(message, hint=f"give the one of {copied} that is for another topic that topic's name")


def _by_slip(
    verdict: Verdict, kind: SlipKind, run: Run, package: PackageFacts, params: RateParams, *, name: str = ""
) -> Verdict | None:
    """Name the line on which a publisher's loop does twice in a turn what it should do once, or which lacks one."""
    slips = _slips(run, package, params, kind)
    return _named(verdict, next((slip for slip in slips if name in ("", slip.name)), None))


def _named(verdict: Verdict, slip: PythonSlip | None) -> Verdict | None:
    told = slip and (f"{slip.file}: {slip.message}", f"in {slip.file}, {slip.fix}", (slip.place,))
    return verdict.explained(*told) if told else None


def _left_out(
    verdict: Verdict, mean_hz: float, run: Run, package: PackageFacts, params: RateParams
) -> Verdict | None:
    """Name the `if` around the `publish(…)` of a loop that goes round as often as it should."""
    asked = [float(s.message) for s in _slips(run, package, params, "rate-number")]
    if mean_hz > params.rate_hz or not any(params.low_hz <= hz <= params.high_hz for hz in asked):
        return None
    slips = _slips(run, package, params, "published-in-part")
    return _named(verdict, next((s for s in slips if is_written_as(s.name, params.topic)), None))


def _bursts(found: Rhythm, outside: list[int], even: bool, params: RateParams) -> Verdict | None:
    """The gaps are uneven, by the nominal period where the mean is right, or else by the topic's own."""
    low_hz, high_hz = params.low_hz * (1 - ROUNDING), params.high_hz * (1 + ROUNDING)
    if even or not (low_hz <= found.mean_hz <= high_hz or found.comes_in_bursts):
        return None
    share = f"{len(outside)} of {len(found.gaps_ns)} gaps are far from {1 / params.rate_hz:g} s"
    kind = "in bursts" if found.comes_in_bursts else "unevenly"
    message = f"{params.topic} comes {kind}: {hertz(found.mean_hz)} on average, but {share}"
    return failed(message, hint="publish one message and sleep once each time around the loop").if_repeated()


def _wrong_mean(found: Rhythm, params: RateParams) -> Verdict:
    direction, nominal = "slow" if found.mean_hz < params.rate_hz else "fast", significant(params.rate_hz)
    message = f"{params.topic} is too {direction}: {hertz(found.mean_hz)} instead of {nominal} Hz"
    ratio = found.mean_hz / params.rate_hz
    verdict = failed(message, hint=rate_hint(ratio, nominal, even=found.is_even))
    return verdict.if_repeated() if abs(ratio - 1) < NEAR_SHARE else verdict


def _with_line(verdict: Verdict, slip: PythonSlip, params: RateParams) -> Verdict:
    """Return the verdict with the line that asks for another rate."""
    where = f"{slip.file}, line {slip.line}"
    said = f": {slip.name}(…) gets two numbers: {slip.fix}" if slip.fix else f" asks for {slip.message} Hz"
    if slip.kind == "rate-random":
        said = f" {'waits for a time' if slip.name else 'asks for a rate'} drawn by {slip.message}(…)"
    hz, period_s = significant(params.rate_hz), significant(1 / params.rate_hz)
    right = f"{slip.name}({period_s})" if slip.name else loop_rate(hz)
    return verdict.explained(f"{where}{said}", ask_rate(hz, where, right), (slip.place,))


def _slips(run: Run, package: PackageFacts, params: RateParams, *kinds: SlipKind) -> list[PythonSlip]:
    """Return what is remarkable, of these kinds, in the scripts of the topic's publishers. Where the rate changes, a
    line that asks for another one may be right at another time; a rate for a time never is."""
    if params.cause is not None:
        kinds = tuple(kind for kind in kinds if kind == "rate-as-time" or not kind.startswith("rate-"))
    channels = run.student_channels(params.topic)
    return [s for c in channels for s in slips_of(package, run, c.callerid, *kinds)]


def _asked_number(found: Rhythm, run: Run, package: PackageFacts, params: RateParams) -> PythonSlip | None:
    """Return where a script asks for the rate that was measured, which is not the right one."""
    wrong = _slips(run, package, params, "rate-number")
    wrong = [s for s in wrong if not params.low_hz <= float(s.message) <= params.high_hz]
    seen_hz = (found.mean_hz, found.between_hz)
    return next((s for s in wrong for hz in seen_hz if abs(float(s.message) - hz) < NUMBER_SHARE * hz), None)


def _by_parameter(
    verdict: Verdict, run: Run, package: PackageFacts, params: RateParams, mean_hz: float
) -> Verdict:
    """Say that the loop's rate is a parameter of another value: by the script's line, or as one that the node reads."""
    if params.cause is not None:
        pause = f"with {words_in(run, params.cause)}, wait {significant(1 / params.rate_hz)} s between two messages"
        verdict = verdict.model_copy(update={"hint": f"look at how the loop changes its rate: {pause}"})
        return _by_slip(verdict, "keeps-rate", run, package, params) or verdict
    for channel in run.student_channels(params.topic):
        own = channel.callerid
        slip = next(iter(slips_of(package, run, own, "rate-parameter")), None)
        if slip is None:
            read = {e.topic or "" for _, e in run.actors if e.action == "read" and e.actor == own}
            there = params_on_server(run)
            explained = _by_read_parameter(
                verdict, {n: v for n, v in there.items() if n in read}, package, params, mean_hz
            )
            verdict = explained if explained is not verdict else _by_default(verdict, read, there, params)
            continue
        name = resolved_param(slip.message, channel.callerid)
        value = params_on_server(run).get(name)
        if value == params.rate_hz:
            continue
        given = where_given(package, name) if value is not None else None
        place = given or slip
        where = f"{place.file}, line {place.line}"
        hint = f"set {slip.message} to {significant(params.rate_hz)}" + (f" in {where}" if given else "")
        told = f"which is {value_text(value)}" + (f" in {where}" if given else "")
        if value is None:
            told = f"which nothing sets in this run: the default in {where} counts"
            hint = f"make {significant(params.rate_hz)} the default in {where}, or {hint}"
        return verdict.explained(f"the node takes its rate from {slip.message}, {told}", hint, (place.place,))
    return verdict


def _by_read_parameter(
    verdict: Verdict, read: Mapping[str, Any], package: PackageFacts, params: RateParams, mean_hz: float
) -> Verdict:
    """Say it where the package's launch file gives a parameter that the node reads and that is the rate it has."""
    for name, value in read.items():
        given = where_given(package, name)
        if given is None or isinstance(value, bool) or not isinstance(value, int | float):
            continue
        if value != params.rate_hz and abs(value - mean_hz) < NUMBER_SHARE * mean_hz:
            where = f"{given.file}, line {given.line}"
            why = f"the node reads {name}, which is {value_text(value)} in {where}"
            return verdict.explained(
                why, f"set {name} to {significant(params.rate_hz)} in {where}", (given.place,)
            )
    return verdict


def _by_default(
    verdict: Verdict, read: Collection[str], there: Mapping[str, Any], params: RateParams
) -> Verdict:
    """Say which parameter the node asked for that is a rate by its name and that nothing sets: its default counts."""
    unset = [name for name in read if name not in there and RATE_NAME.search(name.rpartition("/")[2])]
    if len(unset) != 1 or not verdict.status.is_lost:
        return verdict
    why = f"the node asks for {unset[0]}, which nothing sets in this run: its default counts"
    default = f"{significant(params.rate_hz)} the default of {unset[0]}"
    return verdict.explained(why, f"make {default} in your program, if that is its rate")


def _why_late(found: Rhythm, late: Lateness, params: RateParams) -> str:
    """Return what the machine was that may have made the rate wrong; "" where that is not why, or it is too far off."""
    # A machine that is late slows a loop down: it cannot double its rate.
    doubled = found.mean_hz >= 2 * params.rate_hz
    if doubled or found.tail_ns / 2e6 > max(late.max_ms, params.period_ns / 1e6):
        return ""
    if was_late(late, params) or sleeps_explain(found, late, params):
        return f"late itself (by up to {late.max_ms:.0f} ms, 95 % within {late.p95_ms:.0f} ms), so this proves nothing"
    if stalls_explain(found, late, params):
        busy = f"{(late.busy or 0) * 100:.0f} % busy"
        return f"{busy}, and without the few long gaps the rate would be right, so this proves nothing"
    return ""


def was_late(late: Lateness, params: RateParams) -> bool:
    """Return whether the machine was late by so much that it shows in the gaps."""
    period_ms = params.period_ns / 1e6
    return (
        late.mean_ms >= max(params.tolerance, 0.02) / 2 * period_ms
        or late.p95_ms >= LATE_P95_SHARE * period_ms
        or late.max_ms >= LATE_MAX_SHARE * period_ms
    )


def sleeps_explain(found: Rhythm, late: Lateness, params: RateParams) -> bool:
    """A loop of plain sleeps would have the right rate if its sleeps had not been too long."""
    if late.sleep_ms is None or not 0 < found.mean_hz < params.low_hz:
        return False
    return 1e3 / found.mean_hz - late.sleep_ms <= 1e3 / params.low_hz


def stalls_explain(found: Rhythm, late: Lateness, params: RateParams) -> bool:
    """On a full machine a node that has work to do gets its turn late, though no one who only sleeps is woken late.
    With its few long gaps as long as they should be, its rate would be right."""
    stalls = [gap for gap in found.gaps_ns if gap > params.bounds_ns[1]]
    if not late.full or not 0 < len(stalls) <= max(1, STALLS_SHARE * len(found.gaps_ns)):
        return False
    without_ns = found.span_ns - sum(stalls) + len(stalls) * params.period_ns
    return params.low_hz <= len(found.gaps_ns) * 1e9 / without_ns <= params.high_hz
