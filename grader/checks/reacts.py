"""Whether a node answers what it hears: a message on one topic, and then, in time, one on another."""

from __future__ import annotations

import math
from bisect import bisect
from collections import Counter
from collections.abc import Sequence
from itertools import pairwise
from typing import Annotated, NamedTuple

from pydantic import Field, model_validator

from grader.checks.registry import Refers, check
from grader.checks.support.clocks import NEVER_LATE_S, excused, no_clock, run_seconds, why_late
from grader.checks.support.conditions import (
    Condition,
    is_called,
    keep_time,
    old_until_s,
    said_of_calls,
    shown_on,
    true_spans,
    unless_ended,
)
from grader.checks.support.fields import (
    Reading,
    changing_beside,
    no_field,
    set_beside,
    value_text,
)
from grader.checks.support.processes import observed_until_ns, run_slips
from grader.checks.support.recorder_losses import losses
from grader.checks.support.scans import SCAN, has_angles, looks_elsewhere, read_too
from grader.checks.support.services import exchanges, no_answer, not_offered, offers
from grader.checks.support.text import near_names
from grader.checks.support.topics import (
    Sender,
    cite,
    misfit,
    no_message,
    no_node,
    nothing_sent,
    published_topics,
    refused_type,
    sent_by,
    unheard,
)
from grader.evidence.events import NOT_OFFERED
from grader.evidence.run import Channel, Run
from grader.model.package import PackageFacts
from grader.model.record import Record
from grader.model.verdict import Span, Status, Verdict, failed, failed_or_blocked, grade_again, passed
from grader.wording import ask_field, join_words, plural, significant

ORDER_S = 0.1
"""Two topics come over two connections: so much earlier a message may be recorded than what it answers."""

TURNED_MIN, TURNED_SHARE = 2, 0.2
"""A node does the opposite if it did so at least so often each way, and was right in no more than this share of its
messages: what it publishes may be a little older than what it has just heard."""
STALE_TIMES, STALE_S = 3, 1.0
"""No busy machine explains what a node publishes if all that it was sent for so long (times `within_s`, and s) calls
for the opposite."""


class ReactsParams(Record):
    """Cause and effect."""

    cause: Annotated[Condition, Refers("cause")] | None = None
    """Each time that this becomes true, an effect has to come; without a `field`, one after each message. Null, only
    with `never`: the whole run."""
    effect: Condition
    """What has to come, or with `never` must not come."""
    within_s: Annotated[float, Field(ge=0)] = 0.0
    """How soon after the cause the effect has to come. Required with a `cause`."""
    least_s: Annotated[float, Field(ge=0)] = 0.0
    """How long after the cause the effect may come at the earliest, where the lab asks for a pause."""
    never: bool = False
    """The other way around: whether no effect may come, from `within_s` after the cause begins and for as long as it is
    true. Without a `field`, it is true from its first message until the run ends."""
    of: Sender = "student"
    """Whose effects count: the `student`'s nodes', those of a `program` that the scenario starts beside them, such as
    what a simulator measures while the student's node drives it, or `anyone`'s."""
    not_before: bool = True
    """Whether an effect before the first cause is wrong: one from `within_s` after a message for which the cause is
    not true. Publish such messages for about three times `within_s` first, so that there is something to see."""

    @model_validator(mode="after")
    def _has_cause(self) -> ReactsParams:
        if self.cause is None and not self.never:
            raise ValueError("give a cause, or never: true for a run in which no effect may come")
        if (self.cause is None) == bool(self.within_s):
            raise ValueError("give cause and within_s together")
        if self.least_s and (self.never or self.least_s >= self.within_s):
            raise ValueError("least_s is less than within_s, and not for never, which begins after within_s")
        return self

    @property
    def expected(self) -> str:
        """What is expected, in words: of an answer, with when it has to come."""
        least = f"{significant(self.least_s)} s at least and " if self.least_s else ""
        most = f"{least}{significant(self.within_s)} s at most after {self.trigger.words}"
        return f"{self.effect.words}, {most}"

    @property
    def trigger(self) -> Condition:
        """The cause, where there is one."""
        assert self.cause is not None  # noqa: S101 - it is missing only where no effect may come in the whole run
        return self.cause


class Answer(NamedTuple):
    """A cause, and how long after it (s) the effect came; None where it never did before the next cause."""

    at_ns: int
    after_s: float | None


@check("reacts", params=ReactsParams, of_callbacks=True)
def reacts(package: PackageFacts, run: Run, params: ReactsParams) -> Verdict:
    """The node answers what it hears, in time.

    What it checks
        That each time the cause begins to be true on its topic, a message with the effect follows in time, and
        that none comes before. If the lab asks for silence: that no such message comes while the cause is true, or
        in the whole run. The cause may be a call of a service, by the fields of its request.

    Why it matters on a robot
        A robot that stops half a second late has hit the wall, and one that always stops never arrives.

    How it is measured
        By when the messages reach the recorder. If the cause is the value of a field (an obstacle nearer
        than 0.5 m), it counts once when it becomes true, and not for each message. If any message is a
        cause, each needs an answer of its own. In a run with a fast clock, time is the clock's. Silence
        counts while the node is alive, up to Ctrl-C.

    How to fix
        Publish the answer in the callback of the subscriber, or let the loop check what the callback
        stored. `rostopic echo` on both topics shows which message is answered late, or not at all, and which
        comes where none should.
    """
    if params.never:
        return _judge_silence(package, run, params)
    causes = _causes(run, params)
    own = sent_by(run, params.effect.topic, params.of)
    # what a node sends as it ends answers nothing
    effects = [e for e in params.effect.read(own) if e.time_ns <= (observed_until_ns(run) or run.end_ns)]
    answers = _answers(run, causes, effects, params)
    instead = _instead(causes, effects, params) or _other_answer(answers, causes, effects, own, params)
    verdict = (
        # Whether an answer is missing can be said only where effects and causes were there to be seen.
        _nothing_to_judge(package, run, effects, own, params)
        or _early(causes, effects, own, run, params)
        or _unanswered(package, run, causes, params)
        or _never_caused(causes, run, params)
        or _turned_round(answers, causes, effects, params)
        or _judge_unanswered(answers, run, params, instead)
        or _too_soon(answers, run, params)
        or passed(f"{plural(len(answers), 'time')}, {params.effect.words} follows {params.trigger.words}")
    )
    verdict = _with_ranges(package, run, params, causes, verdict)
    verdict = unless_ended(package, run, verdict, [one.at_ns for one in answers], params.within_s)
    span = (answers[0].at_ns, answers[-1].at_ns) if answers else (None, None)
    verdict = verdict.about(
        expected=params.expected,
        measured=verdict.measured or _measured(answers),
        citations=(cite(run, shown_on(run, params.trigger), *span), cite(run, params.effect.topic)),
    )
    return said_of_calls(run, params.cause, verdict)


def _measured(answers: list[Answer]) -> str:
    times = [one.after_s for one in answers if one.after_s is not None]
    answered = f"{len(times)} of {plural(len(answers), 'answer')}"
    return answered + (f", up to {max(times):.2f} s after" if times else "")


def _with_ranges(
    package: PackageFacts, run: Run, params: ReactsParams, causes: Sequence[Reading], verdict: Verdict
) -> Verdict:
    """Return the verdict; a loss with what the script reads of a scan, where the range that causes it is elsewhere."""
    scans = [c for c in run.channels if c.topic == params.trigger.topic and c.type == SCAN]
    reads = run_slips(package, run, "ranges-read") if scans else []
    began = next((one for one in causes if params.trigger.holds(one)), None)
    if not reads or began is None or verdict.status is not Status.FAIL:
        return verdict
    scan = next(
        (one for c in scans for t, one in zip(c.times_ns, c.values, strict=True) if t == began.time_ns), None
    )
    index = params.trigger.first_in(began)
    if scan is None or index is None or not (said := looks_elsewhere(scan, index, reads)):
        return verdict
    seen = f"the one that is near is ranges[{index}]; " if params.trigger.items == "any" else ""
    around = "read all of them: `min(…)` is the smallest" if not has_angles(scan) else ""
    hint = around or read_too(scan, index, reads)
    return verdict.explained(seen + join_words(said), hint, tuple(one.place for one in reads))


def _causes(run: Run, params: ReactsParams) -> list[Reading]:
    return params.cause.come_in(run) if params.cause else []


def _answers(
    run: Run, causes: Sequence[Reading], effects: Sequence[Reading], params: ReactsParams
) -> list[Answer]:
    """Return what came after each cause, or beginning of one, of which the answer was waited for."""
    to_s, until_ns = run_seconds(run), observed_until_ns(run) or run.end_ns
    if to_s is None:
        return []
    begun = _begun(run, params)
    each = params.trigger.field is None
    # A condition on a field holds for many messages on end: only where it begins to hold is an answer due.
    before = (False, *(params.trigger.holds(one) for one in causes))
    starts = [
        one.time_ns
        for held, one in zip(before, causes, strict=False)
        if (each or not held) and params.trigger.holds(one)
    ]
    came = [one.time_ns for one in effects if params.effect.holds(one)]
    answers, first = [], 0
    for number, at_ns in enumerate(starts):
        next_ns = starts[number + 1] if number + 1 < len(starts) else run.end_ns + 1
        old_s = old_until_s(params.effect, effects, to_s, at_ns, params.least_s)
        from_s = max(to_s(begun.get(at_ns, at_ns)) - ORDER_S, old_s)
        while first < len(came) and to_s(came[first]) < from_s:
            first += 1
        after_s = to_s(came[first]) - to_s(at_ns) if first < len(came) else math.inf
        # A late answer still is one, whose delay can be told, until the next cause begins.
        if after_s <= params.within_s or (after_s < math.inf and came[first] < next_ns):
            answers.append(Answer(at_ns, max(0.0, after_s)))
            first += each  # where each message is a cause, an effect answers one of them alone
        # Too near to the end, an answer may still have been on its way.
        elif to_s(until_ns) - to_s(at_ns) >= params.within_s:
            answers.append(Answer(at_ns, None))
    return answers


def _begun(run: Run, params: ReactsParams) -> dict[int, int]:
    """Return when each call of a service was made by when it was answered: the effect may come in between."""
    calls = exchanges(run, params.trigger.topic) if is_called(run, params.trigger.topic) else ()
    return {one.answered_ns: one.at_ns for one in calls if one.answered_ns is not None}


def _nothing_to_judge(
    package: PackageFacts, run: Run, effects: Sequence[Reading], own: Sequence[Channel], params: ReactsParams
) -> Verdict | None:
    if unknown := no_clock(run):
        return unknown
    if not effects:
        return nothing_sent(package, run, params.effect.topic, params.of)
    if params.effect.field is not None and not any(one.values for one in effects):
        return no_field(effects[0], own)
    return None


def _early(
    causes: Sequence[Reading],
    effects: Sequence[Reading],
    own: Sequence[Channel],
    run: Run,
    params: ReactsParams,
) -> Verdict | None:
    """The effect without its cause: between a first message that is not a cause, and the first that is one."""
    to_s = run_seconds(run)
    # Only if the first message is no cause is there a time before the cause.
    if not params.not_before or not causes or params.trigger.holds(causes[0]) or to_s is None:
        return None
    first_ns = next((one.time_ns for one in causes if params.trigger.holds(one)), causes[-1].time_ns)
    first_ns = _begun(run, params).get(first_ns, first_ns)
    too_early = _between(effects, (causes[0].time_ns, first_ns), run, params)
    if not too_early:
        return None
    lead_s = to_s(first_ns) - to_s(too_early[0])
    message = f"{params.effect.words} comes {lead_s:.2f} s before {params.trigger.words}"
    hint = "publish it only when the message that you receive calls for it"
    if params.effect.field is not None and all(map(params.effect.holds, effects)):
        message = f"every message has {params.effect.words}, also those before {params.trigger.words}"
        hint = f"give {params.effect.field} another value until the message comes that calls for this one"
        if beside := changing_beside(own, params.effect.field):
            message += f"; what changes is {beside}"
            hint = ask_field(params.effect.field, beside)
    elif _is_turned_round(causes, effects, params):
        message, hint = _turned_words(params)
    verdict = failed(message, hint=hint, measured=f"{plural(len(too_early), 'message')} too early")
    return _unless_late(verdict, too_early[-1], (causes[0].time_ns, first_ns), run, params)


def _is_turned_round(causes: Sequence[Reading], effects: Sequence[Reading], params: ReactsParams) -> bool:
    """Return whether the effect is there as long as the cause is not, and missing as long as it is."""
    times = [one.time_ns for one in causes]
    known = [(causes[at - 1], one) for one in effects if (at := bisect(times, one.time_ns))]
    pairs = Counter((params.trigger.holds(cause), params.effect.holds(effect)) for cause, effect in known)
    right = pairs[True, True] + pairs[False, False]
    return min(pairs[True, False], pairs[False, True]) >= TURNED_MIN and right <= TURNED_SHARE * len(known)


def _turned_words(params: ReactsParams) -> tuple[str, str]:
    message = f"{params.effect.words} comes without {params.trigger.words}, and not with it"
    return message, "turn the condition around, or swap its two branches"


def _turned_round(
    answers: Sequence[Answer], causes: Sequence[Reading], effects: Sequence[Reading], params: ReactsParams
) -> Verdict | None:
    """Return the loss of a node whose effect comes only when the cause is over, which may look like a late answer."""
    in_time = any(one.after_s is not None and one.after_s <= params.within_s for one in answers)
    if not answers or in_time or not _is_turned_round(causes, effects, params):
        return None
    since: list[int] = []
    for before, one in pairwise((None, *causes)):
        assert one is not None  # noqa: S101 - only the first of them is
        goes_on = before is not None and params.trigger.holds(before) == params.trigger.holds(one)
        since.append(since[-1] if goes_on else one.time_ns)
    times = [one.time_ns for one in causes]
    stale_ns = max(STALE_S, STALE_TIMES * params.within_s - ORDER_S) * 1e9
    is_sure = any(
        one.time_ns - since[at - 1] >= stale_ns
        for one in effects
        if (at := bisect(times, one.time_ns))
        and params.effect.holds(one) != params.trigger.holds(causes[at - 1])
    )
    message, hint = _turned_words(params)
    return failed(message, hint=hint).late(_due(answers, params)).if_repeated() if is_sure else None


def _due(answers: Sequence[Answer], params: ReactsParams) -> list[Span]:
    return [(one.at_ns, one.at_ns + round((params.within_s + ORDER_S) * 1e9)) for one in answers]


def _between(effects: Sequence[Reading], span: tuple[int, int], run: Run, params: ReactsParams) -> list[int]:
    """Return when effects came in this stretch of time, but for those that may still answer what was before it."""
    to_s = run_seconds(run)
    if to_s is None:
        return []
    from_s, until_s = to_s(span[0]) + params.within_s, to_s(span[1]) - ORDER_S
    return [e.time_ns for e in effects if from_s < to_s(e.time_ns) < until_s and params.effect.holds(e)]


def _unless_late(
    verdict: Verdict, last_ns: int, span: tuple[int, int], run: Run, params: ReactsParams
) -> Verdict:
    """Return the verdict on effects where none may be, open where a late machine explains all of them."""
    to_s = run_seconds(run)
    if to_s is None or to_s(last_ns) >= to_s(span[0]) + 2 * params.within_s:
        return verdict
    # what ends so soon may be an older answer of a machine that was late itself
    return excused(verdict.if_repeated(), run, *span, why_late)


def _judge_silence(package: PackageFacts, run: Run, params: ReactsParams) -> Verdict:
    """Return the verdict where no effect may come, while the cause is true or in the whole run."""
    own = sent_by(run, params.effect.topic, params.of)
    causes, effects = _causes(run, params), params.effect.read(own)
    spans = _silent_spans(causes, run, params)
    verdict = (
        (_nothing_to_judge(package, run, effects, own, params) if effects else no_clock(run))
        or _disturbed(effects, spans, run, params)
        or _silent_without_reason(package, run, causes, spans, params)
        or _kept_silent(own, params)
    )
    if params.cause:
        verdict = _with_ranges(package, run, params, causes, verdict)
    expected = f"{params.effect.absence} {_silent_words(params)}"
    cited = (cite(run, params.effect.topic if effects else "/grader/graph"),)
    verdict = verdict.about(expected=expected, measured=verdict.measured or "none", citations=cited)
    return said_of_calls(run, params.cause, verdict)


def _kept_silent(own: Sequence[Channel], params: ReactsParams) -> Verdict:
    verdict = passed(f"{params.effect.absence} came {_silent_words(params)}")
    # a node of which nothing comes at all shows nothing by it: another criterion has to see that it can publish
    return verdict if any(c.messages for c in own) else verdict.based_on(unjudged=True, silent=True)


def _silent_words(params: ReactsParams) -> str:
    """Return when no effect may come: `from 0.5 s after data of /stop true`."""
    if params.cause is None:
        return "in the whole run"
    return f"from {significant(params.within_s)} s after {params.cause.words}"


def _silent_spans(causes: Sequence[Reading], run: Run, params: ReactsParams) -> list[tuple[int, int]]:
    """Return the stretches of time for which the cause is true: the whole run where none is given."""
    if params.cause is None:
        return [(run.start_ns, observed_until_ns(run) or run.end_ns)]
    return true_spans(params.cause, causes, run)


def _disturbed(
    effects: Sequence[Reading], spans: Sequence[tuple[int, int]], run: Run, params: ReactsParams
) -> Verdict | None:
    """Return the verdict on effects where none may be."""
    wrong = [(span, came) for span in spans if (came := _between(effects, span, run, params))]
    to_s = run_seconds(run)
    if not wrong or to_s is None:
        return None
    (from_ns, until_ns), came = wrong[0]
    count = sum(len(times) for _, times in wrong)
    when = f"{to_s(came[0]) - to_s(from_ns):.2f} s after {params.cause.words if params.cause else 'the run began'}"
    message = f"{params.effect.words} comes {when}, where none may come"
    hint = f"before you publish on {params.effect.topic}, check whether the node may do so now"
    if params.effect.field and not all(map(params.effect.holds, effects)):
        hint = f"look at the condition for {params.effect.words}: it holds too early, too long or without a reason"
    if params.cause and params.effect.field and all(map(params.effect.holds, effects)):
        message += f"; all {plural(len(effects), 'message')} on {params.effect.topic} have it"
        hint = (
            f"in the callback of {params.cause.topic}, give {params.effect.field} another value as long as "
        )
        hint += f"{params.cause.words} comes"
    verdict = failed(message, hint=hint, measured=plural(count, "message"))
    verdict = verdict.based_on(due=tuple((since, times[0]) for (since, _), times in wrong))
    # What comes again and again is not explained by a late machine, nor is what follows no cause.
    if len(wrong) > 1 or params.cause is None:
        return verdict
    return _unless_late(verdict, came[-1], (from_ns, until_ns), run, params)


def _silent_without_reason(
    package: PackageFacts,
    run: Run,
    causes: Sequence[Reading],
    spans: Sequence[tuple[int, int]],
    params: ReactsParams,
) -> Verdict | None:
    """Return the verdict where nothing came and this does not show that the node keeps silent."""
    topic, what = params.effect.topic, f"no message came on {params.effect.topic}"
    published, to_s = published_topics(run), run_seconds(run)
    if topic not in published and (run.foreign or near_names(topic, published)):
        return no_message(package, run, topic)
    if not run.foreign and (absent := no_node(package, run, what)):
        return absent
    if losses(run, topic):
        return grade_again(f"messages on {topic} were lost, so nobody knows whether one came")
    heard = (params.cause and refused_type(run, params.cause.topic)) or misfit(run) or unheard(run)
    if heard:
        return failed_or_blocked(f"{what}, which shows nothing: {heard.message}", hint=heard.hint)
    silent_s = (
        [to_s(until_ns) - to_s(from_ns) - params.within_s for from_ns, until_ns in spans] if to_s else []
    )
    unseen = params.cause is not None and max(silent_s, default=0) <= 0
    if not unseen:
        return None
    unanswered = _unanswered(package, run, causes, params)
    return unanswered or _never_caused(causes, run, params) or _caused_too_late(params)


def _unanswered(
    package: PackageFacts, run: Run, causes: Sequence[Reading], params: ReactsParams
) -> Verdict | None:
    """Return the verdict where the cause is a service's request, and no call that fits was answered."""
    topic = params.trigger.topic
    calls = [one for one in exchanges(run, topic) if one.response is None]
    is_missing = any(e.topic == topic and e.detail == NOT_OFFERED for _, e in run.actors)
    if any(map(params.trigger.holds, causes)) or not (calls or is_missing):
        return None
    is_there = topic in offers(run) and calls
    why = no_answer(package, run, topic, calls[0]) if is_there else not_offered(package, run, topic)
    verdict = failed_or_blocked(f"nothing can be seen after a call of {topic}: {why.message}", hint=why.hint)
    return verdict.late() if why.basis.callbacks == "late" else verdict


def _caused_too_late(params: ReactsParams) -> Verdict:
    what = "effect could be seen after it" if params.never else "answer could be waited for"
    return grade_again(f"{params.trigger.words} did not come, or so late that no {what}")


def _never_caused(causes: Sequence[Reading], run: Run, params: ReactsParams) -> Verdict | None:
    """What a simulator publishes comes of what the node does: a robot has to come to a wall to stop there."""
    simulated = any(c.topic == params.trigger.topic and c.callerid in run.grader_nodes for c in run.channels)
    if not causes or not simulated or any(map(params.trigger.holds, causes)):
        return None
    return failed_or_blocked(
        f"{params.trigger.words} never came in this run",
        measured=f"0 of {plural(len(causes), 'message')}",
        hint=f"rostopic echo {params.trigger.topic} shows what comes while your node runs",
    ).if_repeated()


def _instead(
    causes: Sequence[Reading], effects: Sequence[Reading], params: ReactsParams
) -> tuple[str, str] | None:
    """Return when an effect that never answers its cause came, in words, and what to look at; None where it never came
    or nothing can be said of what it came upon."""
    came = next((one.time_ns for one in effects if params.effect.holds(one)), None)
    before = [one for one in causes if came is not None and one.time_ns <= came and one.values]
    asked = next((one for one in causes if params.trigger.holds(one) and one.values), None)
    if came is None or not before or asked is None or params.trigger.holds(before[-1]):
        return None
    field, topic = params.trigger.field, params.trigger.topic
    (then, *_), (wanted, *_) = before[-1].values, asked.values
    words = f"it came when {field} was {value_text(then)}"
    hint = f"look at the condition in the callback of {topic}: it holds for {value_text(then)} and not for"
    return words, f"{hint} {value_text(wanted)}"


def _other_answer(
    answers: Sequence[Answer],
    causes: Sequence[Reading],
    effects: Sequence[Reading],
    own: Sequence[Channel],
    params: ReactsParams,
) -> tuple[str, ...] | None:
    """Return, in words, what comes upon the cause where the effect never does, what to look at, and the field that has
    another value."""
    at_ns = answers[0].at_ns if answers else math.inf
    came = next((one for one in effects if one.time_ns >= at_ns and one.values), None)
    if came is None or params.effect.value is None or any(map(params.effect.holds, effects)):
        return None
    rest = [one for one in causes if one.time_ns > at_ns]
    later = next(
        (one.time_ns for one in rest if params.trigger.field is None or not params.trigger.holds(one)),
        math.inf,
    )
    if came.time_ns >= later and len(effects) < len(causes):
        hint = f"in the callback of {params.trigger.topic}, publish in each case: see that `publish(…)` stands below"
        return (
            f"nothing comes on {params.effect.topic} then",
            f"{hint} the `if` and its `else`, not in one of them",
        )
    field = params.effect.field
    # What mostly comes a while after any message was not published in the callback.
    times = [one.time_ns for one in causes]
    at_once = [
        n
        for one in effects
        if (n := bisect(times, one.time_ns)) and one.time_ns - times[n - 1] < ORDER_S * 1e9
    ]
    is_answer = 2 * len(at_once) > len(effects) > len(causes) / 4
    where = f"in the callback of {params.trigger.topic}, " if is_answer else ""
    hint = f"{where}look at what you publish on {params.effect.topic}: "
    fix, wanted = f"{hint}{field} has to be {value_text(params.effect.value)}", params.effect.value
    last = next((one for one in reversed(effects) if one.time_ns < at_ns), came)
    if last is not came and all(one.values == came.values for one in effects):
        fix += f", and it is {value_text(came.values[0])} in every message"
    elif last is not came and last.values == came.values:
        fix += ", and it still has the value from before"
    beside = set_beside(own, came.time_ns, field or "", wanted, params.effect.tolerance)
    also = f", and {beside} is {value_text(wanted)}" if beside else ""
    fix = ask_field(field or "", beside, value_text(wanted)) if beside else fix
    return f"{field} is {value_text(came.values[0])} then{also}", fix, field or ""


def _too_soon(answers: Sequence[Answer], run: Run, params: ReactsParams) -> Verdict | None:
    """Return the verdict where an effect comes before it may."""
    least_s = params.least_s - ORDER_S * run.warp
    soon = [one for one in answers if one.after_s is not None and one.after_s < least_s]
    if not soon:
        return None
    after_s = min(one.after_s or 0.0 for one in soon)
    often = f"{len(soon)} of {plural(len(answers), 'time')}, " if len(answers) > 1 else ""
    comes = f"{often}{params.effect.words} comes {after_s:.2f} s after {params.trigger.words}"
    message = f"{comes}, sooner than {significant(params.least_s)} s"
    verdict = failed(message, hint=keep_time(params.least_s)).if_repeated()
    is_near = after_s > params.least_s / 2
    return excused(verdict, run, soon[0].at_ns, run.end_ns, why_late) if is_near else verdict


def _judge_unanswered(
    answers: Sequence[Answer], run: Run, params: ReactsParams, instead: tuple[str, ...] | None
) -> Verdict | None:
    hint = f"each time that {params.trigger.words} comes, publish {params.effect.words}"
    if params.trigger.topic != params.effect.topic:
        hint = f"{hint}, in the callback of {params.trigger.topic}"
    hint = keep_time(params.least_s) if params.least_s else hint
    if is_called(run, params.trigger.topic):
        hint = f"look at what the callback of {params.trigger.topic} sets: {params.effect.words} has to follow a call"
    if params.of != "student":
        hint = f"look at what your node publishes once {params.trigger.words} comes: {params.effect.words} comes of it"
    if not answers and (unsent := misfit(run, params.trigger.topic)):
        return unsent
    deaf = refused_type(run, params.trigger.topic) or unheard(run)
    if not answers and deaf:
        verdict = failed(f"{params.effect.words} follows nothing: {deaf.message}", hint=deaf.hint)
        return verdict.caused_by(deaf)
    if not answers:
        return _caused_too_late(params)
    slow = [one for one in answers if one.after_s is None or one.after_s > params.within_s]
    if not slow:
        return None
    reaction, times = f"{params.effect.words} {{}} {params.trigger.words}", plural(len(answers), "time")
    late = max((one.after_s for one in slow if one.after_s is not None), default=None)
    due = _due(slow, params)
    if late is None and len(slow) == len(answers):
        is_own = instead is not None and params.of == "student"
        seen, hint, *fields = (f"; {instead[0]}", *instead[1:]) if instead and is_own else ("", hint)
        verdict = failed(f"{reaction.format('never follows')}, which came {times}{seen}", hint=hint).late(due)
        verdict = verdict.seeking("field", *fields)
        # A single answer may have been lost on its way.
        return verdict.if_repeated() if len(answers) == 1 else verdict
    how = "does not follow" if late is None else f"comes up to {late:.2f} s after"
    verdict = failed(f"{len(slow)} of {times} {reaction.format(how)}", hint=hint).late(due).if_repeated()
    # once the first answer that is missing was due, none comes any more
    since = next(number for number, one in enumerate(answers) if one in slow)
    if since and all(one.after_s is None for one in answers[since:]):
        verdict = verdict.stuck()
    gross_s = params.within_s + NEVER_LATE_S * run.warp
    is_gross = len(answers) > 1 and all((one.after_s or 0.0) > gross_s for one in answers)
    return verdict if is_gross else excused(verdict, run, slow[0].at_ns, run.end_ns, why_late)
