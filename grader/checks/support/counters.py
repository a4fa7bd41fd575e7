"""A counter's values as they came: steps, what was lost on the way, floods, and how it starts again at its maximum."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from functools import cached_property
from itertools import pairwise
from statistics import median
from typing import Annotated, Literal, NamedTuple

from pydantic import Field, field_validator, model_validator

from grader.checks.support.clocks import time_between
from grader.checks.support.exit_causes import explain_early_end, explain_error
from grader.checks.support.fields import FieldPath, NoField, values_at
from grader.checks.support.processes import OnTopic, observed_until_ns, slips_of
from grader.checks.support.recorder_losses import losses, whole_until_ns
from grader.checks.support.services import answers_between
from grader.checks.support.text import loop_rate
from grader.evidence.run import Channel, Run, once_for_each_run
from grader.model.package import PackageFacts
from grader.model.python_slip import PythonSlip, SlipKind
from grader.model.record import Record
from grader.model.verdict import Status, Verdict, failed, failed_or_blocked, grade_again, inconclusive, passed
from grader.wording import join_words, plural, significant

FLOOD_FACTOR, FLOOD_HZ = 3, 500
"""Times the nominal rate, and real messages a second."""
SYSTEMATIC_SHARE = 0.05
STUCK_COUNT = 5
LEAST_AFTER_START = 3
LARGEST = 2.0**64
LOST_GAP_SHARE = 0.75
"""Of the time that lost values would have taken: a longer gap is a machine that stood still for longer."""
STALL_PERIODS = 2
SILENT_PERIODS = 20
SILENT_NS = 500_000_000


class Step(NamedTuple):
    """From one value to the next. `number` is the later one's, counted from 0."""

    number: int
    before: float
    after: float
    from_ns: int
    to_ns: int
    lost_messages: int
    change: float


class Count(Record):
    """The numbers of one publisher in the order of their arrival; times in ns."""

    callerid: str
    values: tuple[float, ...]
    times_ns: tuple[int, ...]
    sequences: tuple[int, ...]

    @cached_property
    def steps(self) -> tuple[Step, ...]:
        rows = list(zip(self.values, self.times_ns, self.sequences, strict=True))
        return tuple(
            Step(i + 1, a[0], b[0], a[1], b[1], max(0, b[2] - a[2] - 1), b[0] - a[0])
            for i, (a, b) in enumerate(pairwise(rows))
        )

    @cached_property
    def begins_astray(self) -> bool:
        """Whether the first value alone is wrong: it is not what the counter comes back to, and the next one follows
        another value than this. That is the fault of the start, and of nothing else."""
        if len(self.values) < LEAST_AFTER_START:
            return False
        start = min((s.after for s in self.steps[1:] if s.change < -1), default=0)
        return self.values[0] not in {start, self.values[1] - 1} and self.values[1] in {start, start + 1}

    @cached_property
    def stuck(self) -> int:
        """Return how many times the last value came at the end."""
        same = 0
        for value in reversed(self.values):
            if value != self.values[-1]:
                break
            same += 1
        return same

    @cached_property
    def period_ns(self) -> float:
        """Return the usual time between two values: the median, or half the mean where they come in bursts."""
        gaps = [s.to_ns - s.from_ns for s in self.steps]
        if not gaps:
            return 0.0
        return max(median(gaps), sum(gaps) / len(gaps) / 2)

    def was_lost_in_transit(self, step: Step, jump: float) -> bool:
        """Return whether `jump - 1` values between these two were published and did not arrive.

        The recording says so, or the time between them fits, or that of a stall just before: a process that the host
        has stopped goes on with what its queue has kept. Then it was the transport or the host. A jump in normal time,
        or one that comes again and again, is the program's.
        """
        if step.lost_messages:
            return True
        if jump < 2 or self.period_ns <= 0 or self._comes_again(step):
            return False
        before = self.steps[step.number - 2] if step.number > 1 else step
        stall = (before.to_ns - before.from_ns) / self.period_ns
        gap = (step.to_ns - step.from_ns) / self.period_ns
        return gap / jump >= LOST_GAP_SHARE or (before.change == 1 and STALL_PERIODS <= jump <= stall)

    def is_single(self, steps: Sequence[Step]) -> bool:
        """Return whether these are jumps that one run's timing could have made: few, and none that comes again."""
        return all(s.change > 1 and not self._comes_again(s) for s in steps)

    def _comes_again(self, step: Step) -> bool:
        same = self._pairs[step.before, step.after]
        # One more is allowed: a single jump in a short count proves nothing.
        return same > 1 or self._jumps > SYSTEMATIC_SHARE * len(self.steps) + 1

    @cached_property
    def _pairs(self) -> Counter[tuple[float, float]]:
        return Counter((s.before, s.after) for s in self.steps)

    @cached_property
    def _jumps(self) -> int:
        return sum(s.change > 1 for s in self.steps)

    def is_flood(self, run: Run, rate_hz: float) -> bool:
        """Return whether there are so many messages that the publisher's own queue drops some."""
        span_s = (self.times_ns[-1] - self.times_ns[0]) / 1e9
        warp = run.warp if run.clock == "warped" else 1.0
        least_hz = max(FLOOD_FACTOR * rate_hz * warp, FLOOD_HZ)
        # A few messages close together are a burst, not a flood.
        return len(self.steps) > 20 and len(self.steps) >= least_hz * span_s

    def turns_alike(self, times: int) -> bool:
        """Return whether it goes back from one value to one other so often, and else up by one: nothing was dropped."""
        others = [(s.before, s.after) for s in self.steps if s.change != 1]
        return len(others) >= times and len(set(others)) == 1

    def usual_step(self) -> float | None:
        """Return the step that at least four of five are; None where there is none."""
        changes = Counter(s.change for s in self.steps)
        change, times = changes.most_common(1)[0] if changes else (0.0, 0)
        return change if times and times >= 0.8 * len(self.steps) else None


class Wrong(NamedTuple):
    """Steps that are not +1: the program's `own`, or of values that were `lost` on the way.

    Where it is a `flood`, they are skips of a publisher whose queue drops values, and neither of both; `excused` where
    the others are right.
    """

    steps: tuple[Step, ...]
    own: tuple[Step, ...] = ()
    lost: tuple[Step, ...] = ()
    flood: bool = False
    excused: bool = False


def wrong_steps(count: Count, run: Run, *, maximum: int, rate_hz: float) -> Wrong:
    """Return the wrong ones of `steps_to_judge`; a fall by more than one may be a new start, and is none."""
    wrong = tuple(s for s in steps_to_judge(count, maximum) if s.change in {0, -1} or s.change > 1)
    skips = tuple(s for s in wrong if s.change > 1)
    usual = count.usual_step()
    # A counter that stands still, goes back or goes by two is wrong at any rate: no queue makes it so.
    if wrong and skips == wrong and usual in {None, 1} and count.is_flood(run, rate_hz):
        return Wrong(wrong, flood=True, excused=usual == 1)
    # Where a service switches the node off, the gap is the node's own.
    own = (s for s in skips if not answers_between(run, s.from_ns, s.to_ns))
    lost = tuple(s for s in own if count.was_lost_in_transit(s, s.change))
    numbers = {s.number for s in lost}
    return Wrong(wrong, own=tuple(s for s in wrong if s.number not in numbers), lost=lost)


def judge_steps(count: Count, found: Wrong, run: Run, params: CounterParams) -> Verdict | None:
    """Return the verdict on steps that are not +1; None where there are none."""
    if not found.steps or found.excused:
        return None
    if found.flood:
        drops = f"drops most values: {plural(len(found.steps), 'skip')}"
        return judge_flood(params.topic, drops, params.rate_hz)
    if not found.own:
        missing = sum(int(min(s.change, LARGEST)) - 1 for s in found.lost)
        message = f"{plural(missing, 'value')} of {params.topic} were lost on the way, with a gap in time"
        return inconclusive(message, hint="grade again when the machine is less busy")
    first, usual = found.own[0], count.usual_step()
    after = time_between(run, count.times_ns[0], first.to_ns)
    comes = f"after {significant(first.before)} comes {significant(first.after)}"
    place = f"{comes} (value {first.number + 1}, {after} after the first)"
    # Where nearly all steps are alike, that step says more than the first wrong one.
    if usual not in {None, 1}:
        message = _usual_fault(usual or 0.0)
    else:
        kinds: dict[float, str] = {0: "repeats a value", -1: "goes back"}
        message = join_words(dict.fromkeys(kinds.get(s.change, "skips values") for s in found.own))
    hint = "add one to the counter in one place only, once each time around the loop"
    if usual == 0:
        hint = "set the counter before the loop, and add one each time around it: nothing inside the loop may reset it"
    verdict = failed(f"the counter {message}: {place}", hint=hint)
    return verdict.if_repeated() if count.is_single(found.own) else verdict


def _usual_fault(usual: float) -> str:
    if usual == 0:
        return "stays at one value"
    return f"counts in steps of {significant(usual)}" if usual > 0 else "counts down"


def steps_to_judge(count: Count, maximum: int) -> tuple[Step, ...]:
    """Return all of them but those of another criterion: from a first value that is wrong, which is the start's fault,
    and the repeats of a counter that stays at its maximum, which are the wrap's."""
    stays = count.values[-1] == maximum and count.stuck > 1
    return count.steps[int(count.begins_astray) : len(count.steps) - (count.stuck - 1 if stays else 0)]


class CounterParams(OnTopic):
    """Where a counter is, and how fast it counts."""

    field: FieldPath = "data"
    """The field that counts, as `rostopic echo` shows it: `count`, `status.number`."""
    rate_hz: Annotated[float, Field(gt=0)] = 10.0
    """The nominal rate, to tell a flood of messages from a counter."""

    @field_validator("field")
    @classmethod
    def _not_of_ros(cls, field: str) -> str:
        if field.endswith("header.seq"):
            raise ValueError(f"{field} is counted by ROS itself, whatever the node does: name another field")
        return field

    @property
    def counter(self) -> str:
        """What counts, in words: `/chatter`, or `number on /status`."""
        return self.topic if self.field == "data" else f"{self.field} on {self.topic}"

    @property
    def place(self) -> str:
        """Where its values are, in words: `on /chatter`, or `of number on /status`."""
        return f"on {self.topic}" if self.field == "data" else f"of {self.counter}"


@once_for_each_run
def counts(run: Run, topic: str, field: str = "data") -> tuple[Count, ...]:
    """What the student's publishers counted in a field on a topic, the earliest first; what is not a number is left
    out, and what came after the recorder had lost something."""
    until_ns = whole_until_ns(run, topic)
    found = [_count(c, field, until_ns) for c in run.student_channels(topic)]
    return tuple(sorted((c for c in found if c is not None), key=lambda c: c.times_ns[0]))


def longest(run: Run, params: CounterParams) -> Count | None:
    return max(counts(run, params.topic, params.field), key=lambda c: len(c.values), default=None)


def _count(channel: Channel, field: str, until_ns: int | None) -> Count | None:
    rows: list[tuple[float, int, int]] = []
    without = 0
    for message, value in zip(channel.messages, channel.values, strict=True):
        number = _number(value, field)
        if number is None:
            # It came, so it was not lost: rospy sends an empty one where a number does not fit.
            without += 1
        elif until_ns is None or message.log_time_ns <= until_ns:
            rows.append((number, message.log_time_ns, message.sequence - without))
    if not rows:
        return None
    values, times, sequences = zip(*rows, strict=True)
    return Count(callerid=channel.callerid, values=values, times_ns=times, sequences=sequences)


def _number(message: object, field: str) -> float | None:
    """Return the number in a field; text is none, even if it is written in digits."""
    try:
        values = values_at(message, field)
    except NoField:
        return None
    # In Python, true and false are the numbers 1 and 0.
    if len(values) == 1 and isinstance(values[0], int | float) and not isinstance(values[0], bool):
        return values[0]
    return None


def first_values(values: Sequence[float]) -> str:
    from_start = ", ".join(f"{v:g}" for v in values[:4])
    return f"{from_start}, …" if len(values) > 4 else from_start


class WrapParams(CounterParams):
    """Where the counter wraps."""

    minimum: int = 0
    """The first value after the wrap."""
    maximum: int = 127
    """The last value before the wrap; one less will do as well."""
    wraps: Annotated[int, Field(ge=1)] = 2
    """How often the wrap has to be seen."""

    @model_validator(mode="after")
    def _goes_up(self) -> WrapParams:
        if self.minimum >= self.maximum:
            raise ValueError(f"minimum, {self.minimum}, is not less than maximum, {self.maximum}")
        return self

    @property
    def reset_hint(self) -> str:
        if self.minimum == 0:
            return f"reset before publishing: counter = (counter + 1) % {self.maximum + 1}"
        return f"reset before publishing: if counter > {self.maximum}: counter = {self.minimum}"


def judge_wraps(
    count: Count, run: Run, package: PackageFacts, params: WrapParams
) -> tuple[Verdict, Step | None]:
    """Return the verdict, and the turn that it rests on."""
    turns, good, wrong = turns_of(count, run, params)
    bad = wrong[0] if wrong else None
    if bad is not None:
        # Past the maximum, the first bad step is no turn yet: the line is told by where the counter turns in the end.
        turn = next((s for s in turns if s.before > params.maximum), bad) if bad.change > 0 else bad
        written = slips_of(package, run, count.callerid, "reset-value", "reset-limit")
        lost = _bad_turn(bad, turns, count, run, params)
        if whose_turn(bad, count, run, params) == "flood":
            lost = _by_range(count, run, package, params) or lost
        return _where_reset(lost, turn, written, params), bad
    last = good[-1] if good else None
    if len(good) >= params.wraps:
        message = f"after {significant(good[0].before)} comes {params.minimum}, {plural(len(good), 'time')}"
        return passed(message), last
    # A flood is the publisher's own doing, also where the recorder could not keep up with it.
    if losses(run, params.topic) and not count.is_flood(run, params.rate_hz):
        return grade_again(f"only {plural(len(good), 'reset')} of {params.wraps} is recorded"), last
    verdict = _judge_death(count, run, package, params) or _stuck(count, params)
    return verdict or _silent(count, run, package, params) or _too_few(count, good, run, params), last


def _by_range(count: Count, run: Run, package: PackageFacts, params: WrapParams) -> Verdict | None:
    """Return the loss by a range that begins with another number than the minimum: no flood makes that right."""
    found = [s for s in slips_of(package, run, count.callerid, "start-value") if s.name == "range"]
    if len(found) != 1 or int(found[0].message) == params.minimum:
        return None
    slip = found[0]
    message = RESETS_TO.format(significant(max(count.values)), slip.message, params.minimum)
    hint = f"on line {slip.line} of {slip.file}, let the range begin with {params.minimum}"
    return failed(message, hint=hint, citations=(slip.place,))


def cite_slip(verdict: Verdict, count: Count, run: Run, package: PackageFacts, *kinds: SlipKind) -> Verdict:
    """Return the verdict; one that is lost with the line of the node's script that was to change the counter."""
    slip = next(iter(slips_of(package, run, count.callerid, *kinds)), None)
    if slip is None or not verdict.status.is_lost:
        return verdict
    named = "line" in slip.fix
    hint = f"in {slip.file}, {slip.fix}" if named else f"{slip.fix} on line {slip.line} of {slip.file}"
    return verdict.explained(f"{slip.file}, line {slip.line}: {slip.message}", hint, (slip.place,))


def added_early(first: Count, run: Run, package: PackageFacts, start: int) -> PythonSlip | None:
    """Return the line by which a counter that is set to the right number publishes one more first; None where no line
    is known, or several are."""
    starts = slips_of(package, run, first.callerid, "start-value")
    added = slips_of(package, run, first.callerid, "added-first")
    early = [one for one in added if {s.message for s in starts if s.name == one.name} == {str(start)}]
    steps = [int(one.message) for one in stepping(first, run, package) if early and one.name == early[0].name]
    return early[0] if len(early) == 1 and first.values[0] == start + (steps or [1])[0] else None


def stepping(count: Count, run: Run, package: PackageFacts) -> list[PythonSlip]:
    """Return the one line that adds the number by which the counter usually goes on, and is not 1; none where others
    may be meant."""
    usual = count.usual_step()
    added = [s for s in slips_of(package, run, count.callerid, "step-number") if float(s.message) == usual]
    return added if len(added) == 1 else []


def cite_early(verdict: Verdict, slip: PythonSlip) -> Verdict:
    """Return the verdict of a counter that begins, or goes on after its wrap, one too high, with the line."""
    why = f"line {slip.line} of {slip.file} adds to `{slip.name}` before it is published"
    return verdict.explained(why, f"in {slip.file}, {slip.fix}", (slip.place,))


class Turns(NamedTuple):
    """`every` step down, those of them that are `good`, and all `bad` steps: also those past the maximum."""

    every: list[Step]
    good: list[Step]
    bad: list[Step]


def turns_of(count: Count, run: Run, params: WrapParams) -> Turns:
    """Return the turns of the counter. Where bad turns of a flood are let pass, all count as good."""
    turns = [s for s in count.steps if s.change < 0]
    good = [s for s in turns if _is_good(s, params)]
    bad = [s for s in count.steps[int(count.begins_astray) :] if _is_bad(s, params)]
    in_range = bool(bad) and params.minimum <= bad[0].after <= params.maximum
    if in_range and good and count.is_flood(run, params.rate_hz):
        # the publisher dropped values around this turn: those that came whole decide
        return Turns(turns, turns, [])
    return Turns(turns, good, bad)


def _is_good(step: Step, params: WrapParams) -> bool:
    # "Resetting at 127" can be read in two ways: after 127 comes 0, or after 126.
    return step.before in {params.maximum, params.maximum - 1} and step.after == params.minimum


def _is_bad(step: Step, params: WrapParams) -> bool:
    beyond = step.after > params.maximum
    return beyond or (
        # A fall by one is `counter-step`'s matter, except at the top.
        (step.change < -1 or (step.before >= params.maximum - 1 and step.change < 0))
        and not _is_good(step, params)
    )


def judge_flood(topic: str, drops: str, rate_hz: float) -> Verdict:
    """Return that there is nothing to judge where the publisher itself drops values."""
    hint = f"first publish at {significant(rate_hz)} Hz, then look at the counter again"
    return failed_or_blocked(f"{topic} is flooded, so its publisher {drops}", hint=hint)


def _bad_turn(step: Step, turns: list[Step], count: Count, run: Run, params: WrapParams) -> Verdict:
    whose = whose_turn(step, count, run, params)
    if whose == "flood":
        return judge_flood(params.topic, "drops values, around the wrap too", params.rate_hz)
    if whose == "lost":
        message = f"values of {params.topic} were lost around the wrap, with a gap in time"
        return inconclusive(message, hint="grade again when the machine is less busy")
    verdict = failed(bad_turn_message(step, turns, params), hint=params.reset_hint)
    in_range = params.minimum <= step.after <= params.maximum
    alone = (
        in_range and sum(_is_bad(s, params) for s in turns) == 1 and any(_is_good(s, params) for s in turns)
    )
    # One bad turn among good ones may be chance.
    return verdict.if_repeated() if alone else verdict


def _where_reset(verdict: Verdict, turn: Step, written: Sequence[PythonSlip], params: WrapParams) -> Verdict:
    """Name the line of the node's script that makes the counter go back as it was seen to."""
    wrong_value = turn.after != params.minimum
    # A limit in code may be the last value, or the first that is not reached.
    kind, number, apart = ("reset-value", turn.after, 0) if wrong_value else ("reset-limit", turn.before, 1)
    slip = next((s for s in written if s.kind == kind and abs(int(s.message) - number) <= apart), None)
    if slip is None or turn.change > 0 or verdict.status is not Status.FAIL:
        return verdict
    limits = f"ends its range at {slip.message}" if slip.name else f"compares it with {slip.message}"
    does = "" if wrong_value else f" {limits}"
    said = verdict.message
    if turn.after == _overflowed(params):  # the line makes it turn there, and not the type's range
        said = RESETS_TO.format(significant(turn.before), significant(turn.after), params.minimum)
    message = f"{said} ({slip.file}, line {slip.line}{does})"
    right = params.minimum if wrong_value else params.maximum
    hint = f"on line {slip.line}, write {right} instead of {slip.message}"
    if not wrong_value:
        hint = _limit_hint(slip, params)
    return verdict.model_copy(update={"message": message, "hint": hint, "citations": (slip.place,)})


def _limit_hint(slip: PythonSlip, params: WrapParams) -> str:
    most = params.maximum
    if slip.name == "range":
        return f"on line {slip.line}, let the range end at {most + 1}: {most} is its last number then"
    return f"let it count up to {most} there: `if counter > {most}`, or `% {most + 1}`, on line {slip.line}"


def _overflowed(params: WrapParams) -> int:
    """Return what comes after the maximum where the type's range makes the counter turn: int8 goes on at -128."""
    return -(params.maximum + 1)


RESETS_TO = "after {} the counter resets to {}, not to {}"


def whose_turn(step: Step, count: Count, run: Run, params: WrapParams) -> Literal["program", "flood", "lost"]:
    """Return whether a bad turn is the program's own, or one of values that its flood, or the way, swallowed."""
    low, high = params.minimum, params.maximum
    # No loss makes a value larger or smaller than those that were sent.
    if step.after > high or step.after < low:
        return "program"
    if count.is_flood(run, params.rate_hz) and not count.turns_alike(params.wraps):
        return "flood"
    jump = (high - step.before) + (step.after - low) + 1
    return "lost" if count.was_lost_in_transit(step, jump) else "program"


def bad_turn_message(step: Step, turns: list[Step], params: WrapParams) -> str:
    """Return what is wrong with a turn, in a student's words."""
    low, high = params.minimum, params.maximum
    before, after = significant(step.before), significant(step.after)
    comes = f"after {before} comes {after}"
    if step.after > high:
        late = next((s for s in turns if s.before > high), None)
        if late is None:
            return f"the counter never resets: {comes}, and it keeps counting"
        return f"the counter resets too late, from {significant(late.before)} to {significant(late.after)}: {comes}"
    if step.after == _overflowed(params):
        return f"the counter overflows to {after}, as a signed integer of this size does: {comes}"
    if step.before >= high - 1:
        return RESETS_TO.format(before, after, low)
    if step.after == low:
        return f"the counter resets too early: {comes}"
    return f"the counter goes back before it has reached {high}: {comes}"


def _judge_death(count: Count, run: Run, package: PackageFacts, params: WrapParams) -> Verdict | None:
    end, who = explain_early_end(package, run), "node dies"
    if end is None and count.values[-1] == params.maximum and _is_silent(count, run):
        end, who = explain_error(package, run), "node stops publishing"
    if end is None:
        return None
    last = count.values[-1]
    # A publisher that packs one number too many (int8: 128) dies where it should have reset.
    if last >= params.maximum - 1:
        message = f"the {who} at {significant(last + 1)}, where the counter should reset: {end.cause}"
        limits = slips_of(package, run, count.callerid, "reset-limit")
        # a range ends before its last number
        high = next((s for s in limits if int(s.message) - (s.name == "range") > params.maximum), None)
        first = next((one for one in limits if one.fix), None)
        if first is not None:
            why = f"{message}; line {first.line} computes the `%` before the `+`, so the counter never wraps"
            fix = f"on line {first.line}, {first.fix}"
            return failed(why, hint=fix, citations=(first.place, *end.citations))
        if high is not None and last == params.maximum:
            hint = _limit_hint(high, params)
            why = f"{message}; line {high.line} sets its limit by {high.message}"
            return failed(why, hint=hint, citations=(high.place, *end.citations))
        own = "no more values" in end.cause or "the loop on line" in end.cause  # what comes to an end there
        return failed(message, hint=end.hint if own else params.reset_hint, citations=end.citations)
    came = f"after {plural(len(count.values), 'message')}, at {significant(last)}"
    message = f"the node ended {came}, before the counter could reset twice: {end.cause}"
    of_its_own = end.by_itself and len(count.values) > params.maximum
    return (failed if of_its_own else failed_or_blocked)(message, hint=end.hint, citations=end.citations)


def _stuck(count: Count, params: WrapParams) -> Verdict | None:
    if count.stuck < STUCK_COUNT:
        return None
    last = significant(count.values[-1])
    message = f"the counter stays at {last} ({plural(count.stuck, 'time')} at the end)"
    at_top = count.values[-1] >= params.maximum - 1
    return (failed if at_top else failed_or_blocked)(message, hint=params.reset_hint)


def _silent(count: Count, run: Run, package: PackageFacts, params: WrapParams) -> Verdict | None:
    """Return the verdict where the node lives on, and has stopped publishing."""
    if losses(run, params.topic) or not _is_silent(count, run):
        return None
    error = explain_error(package, run)
    cause = f": {error.cause}" if error else ""
    message = f"the node stops publishing after {significant(count.values[-1])}, but keeps running{cause}"
    verdict = failed(message, hint=params.reset_hint) if len(count.values) > 1 else failed_or_blocked(message)
    # Without a traceback, the silence may be the machine's.
    return verdict if error else verdict.if_repeated()


def _is_silent(count: Count, run: Run) -> bool:
    until_ns = observed_until_ns(run)
    quiet_ns = max(SILENT_PERIODS * count.period_ns, SILENT_NS)
    return until_ns is not None and until_ns - count.times_ns[-1] >= quiet_ns


def _too_few(count: Count, good: list[Step], run: Run, params: WrapParams) -> Verdict:
    span_s = (count.times_ns[-1] - count.times_ns[0]) / 1e9
    seen = f"{plural(len(good), 'reset')} in {plural(len(count.values), 'value')}"
    wrong = any(s.change in {0, -1} or s.change > 1 for s in count.steps)
    outcome = run.outcome.outcome if run.outcome else None
    # Repeats are charged by `counter-step`.
    if good and outcome == "complete" and all(s.change in {0, 1} or s in good for s in count.steps):
        told = f"after {significant(good[0].before)} comes {params.minimum}; values repeat, so only {seen}"
        return passed(told)
    if count.is_flood(run, params.rate_hz) or wrong:
        message = f"{params.wraps} resets were not seen: {seen}, which do not count up one by one"
        return failed_or_blocked(message, hint="first make the counter go up by one at its rate")
    # Half the rate is another criterion's matter, which says more about it.
    if len(count.steps) < params.rate_hz * span_s / 2:
        message = f"{params.topic} is too slow to see {params.wraps} resets: {seen}"
        return failed_or_blocked(message, hint=f"use {loop_rate(significant(params.rate_hz))}")
    end = {"timeout": "the run's time was over", "host": "the grading machine failed"}.get(
        outcome or "", "the run ended"
    )
    hint = "record for longer" if run.foreign else "grade again"
    return inconclusive(f"right as far as it goes, but {end} after {seen}", hint=hint)
