"""Whether fields of messages have the right values."""

from __future__ import annotations

import math
from bisect import bisect
from collections.abc import Collection, Sequence
from itertools import pairwise
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from grader.checks.registry import check
from grader.checks.support.clocks import time_between
from grader.checks.support.exit_causes import explain_early_end
from grader.checks.support.fields import (
    MOVED,
    ROUNDING,
    FieldPath,
    Reading,
    as_numbers,
    begins_later,
    bounds_text,
    differences,
    has_hole,
    is_number,
    is_within,
    join_items,
    made_of,
    near_texts,
    no_field,
    one_for_another,
    readings,
    refuse_disorder,
    set_beside,
    taken_from,
    turned_wrong,
    value_text,
    was_right,
)
from grader.checks.support.processes import OnTopic
from grader.checks.support.recorder_losses import losses
from grader.checks.support.text import shown
from grader.checks.support.topics import SYSTEM_TOPICS, Sender, cite, nothing_sent, sent_by
from grader.evidence.run import Run
from grader.model.message_definitions import NOT_FINITE
from grader.model.package import PackageFacts
from grader.model.verdict import (
    EvidenceCitation,
    Status,
    Verdict,
    failed,
    failed_or_blocked,
    grade_again,
    passed,
)
from grader.wording import LISTED_MAX, ask_item, join_words, plural, significant, suspect_field

VALUES_SHOWN = 4


class FieldParams(OnTopic):
    """A field of the messages."""

    field: FieldPath
    """As `rostopic echo` shows it: `linear.x`, `ranges[0]`, or `ranges[*]` for every item."""


class FieldBoundsParams(FieldParams):
    """A field and its bounds: `min`, `max` or both."""

    min: float | None = None
    """The least value, in the field's own unit; null: no bound."""
    max: float | None = None
    """The greatest value, in the field's own unit; null: no bound."""
    share: Annotated[float, Field(gt=0, le=1)] = 1.0
    """The share of the messages that has to be within the bounds, above 0 and at most 1."""
    of: Sender = "student"
    """Whose messages count: the `student`'s nodes', those of a `program` that the scenario starts beside them, or
    `anyone`'s."""

    @model_validator(mode="after")
    def _some_bound(self) -> FieldBoundsParams:
        if self.min is None and self.max is None:
            raise ValueError("give min, max or both")
        refuse_disorder(self.min, self.max)
        return self

    @property
    def words(self) -> str:
        return bounds_text(self.min, self.max)

    def holds(self, value: float) -> bool:
        return is_within(value, self.min, self.max)


@check("field-bounds", params=FieldBoundsParams, messages_only=True, heeds_losses=True, of_callbacks=True)
def field_bounds(package: PackageFacts, run: Run, params: FieldBoundsParams) -> Verdict:
    """A field of the messages stays within its bounds.

    What it checks
        That the field's value is within the bounds in every message, or in the share of them that the
        rubric gives.

    Why it matters on a robot
        A robot does what the number says. A speed ten times too high, or a value that is not a number at
        all, ends in a wall.

    How it is measured
        Every message of the run is decoded by the definition that its publisher sent. A value equal to a
        bound is within it; NaN never is. In a list, every item counts, and an empty list is outside.

    How to fix
        Clip the value before it is published: `min(max(value, low), high)`. `rostopic echo <topic>/<field>`
        shows it.
    """
    channels = sent_by(run, params.topic, params.of)
    found = readings(channels, params.field)
    missing = next((r for r in found if not r.values), None)
    usable = [r for r in found if r.values]
    outside = [r for r in found if not (r.values and all(map(params.holds, r.values)))]
    if not found:
        verdict = nothing_sent(package, run, params.topic, params.of)
    elif not usable and missing:
        verdict = no_field(missing, channels)
    # Shares are not exact as floats: 0.55 of 100 is a little more than 55.
    elif len(found) - len(outside) < params.share * len(found) - ROUNDING:
        verdict = _outside(outside, found, run, params)
        # Of a share, the messages that the recorder lost may be the ones that were right.
        if params.share < 1 and losses(run, params.topic):
            verdict = grade_again(verdict.message)
    else:
        verdict = passed(f"{params.field} of {params.topic} is {params.words} in {_share(found, outside)}")
    share = f" in {params.share:.0%} of the messages" if params.share < 1 else ""
    expected = f"{params.field} of {params.topic} {params.words}{share}"
    cited = (_span(run, outside or found, params),)
    return verdict.about(expected=expected, measured=verdict.measured or _range(usable), citations=cited)


def _span(run: Run, readings: Sequence[Reading], params: FieldParams) -> EvidenceCitation:
    """Return the stretch of the topic from the first to the last of these messages; of none, the whole topic."""
    times = [readings[0].time_ns, readings[-1].time_ns] if readings else []
    return cite(run, params.topic, *times)


def _outside(
    outside: Sequence[Reading], readings: Sequence[Reading], run: Run, params: FieldBoundsParams
) -> Verdict:
    first = outside[0]
    after = time_between(run, readings[0].time_ns, first.time_ns)
    wrong = [value for value in first.values if not params.holds(value)]
    seen = f"is {significant(wrong[0])}" if wrong else f"is not there ({first.fault})"
    count = f"in {len(outside)} of {plural(len(readings), 'message')}"
    message = (
        f"{params.field} of {params.topic} is not {params.words} {count}: it {seen}, {after} after the first"
    )
    verdict = failed(message, hint=f"make sure that {params.field} is {params.words} before you publish it")
    beyond = [beyond_words(params, side, end) for side, end in (("below", params.min), ("above", params.max))]
    numbers = [value for one in outside for value in one.values]
    if numbers and all(params.holds(-value) for value in numbers):
        beyond = [*beyond, beyond_words(params, OTHER_SIGN)]
    verdict = verdict.based_on(lost_to=(*beyond,))
    return _of_nan(verdict, run) if wrong and math.isnan(wrong[0]) else verdict


def _share(readings: Sequence[Reading], outside: Sequence[Reading]) -> str:
    within = len(readings) - len(outside)
    count = plural(len(readings), "message")
    return f"all of {count}" if not outside else f"{within} of {count}"


def _range(readings: Sequence[Reading]) -> str:
    values = [value for one in readings for value in one.values]
    if not values:
        return "no value"
    nan = sum(value != value for value in values)  # noqa: PLR0124 - NaN is not itself
    real = [value for value in values if value == value]  # noqa: PLR0124 - as above
    span = f"{significant(min(real))} to {significant(max(real))}" if real else "no number"
    return f"{span}, and {plural(nan, 'NaN')}" if nan else span


class FieldEqualsParams(FieldParams):
    """A field and its value."""

    value: Any = None
    """The right value, as in YAML: a number (also `.inf` or `.nan`), text, true or false, a list or a map. Of a field
    with `[*]`, a list has the value of each item, in their order: `transforms[*].child_frame_id` `[left, right]`."""
    values: tuple[Any, ...] = ()
    """In place of `value`: the right values of several messages, in their order. Messages between them do not
    matter."""
    tolerance: Annotated[float, Field(ge=0)] = 0.0
    """How much numbers may differ, in the field's own unit."""
    when: Literal["every", "first", "last", "any"] = "every"
    """Which messages have to have the value: `every` one, the `first`, the `last` of the run, or `any` of them."""
    repeats: bool = True
    """With `values`, whether the same value may come twice in a row; false where the lab asks for a message only when
    the value changes."""
    of: Sender = "student"
    """Whose messages count: the `student`'s nodes', those of a `program` that the scenario starts beside them, or
    `anyone`'s."""

    @model_validator(mode="after")
    def _one_or_several(self) -> FieldEqualsParams:
        if (self.value is None) == (not self.values):
            raise ValueError("give one of value and values")
        if self.values and self.when != "every":
            raise ValueError("when is for value, not for values")
        if not self.repeats and len(self.values) < 2:
            raise ValueError("repeats is for values, of which one changes into the next")
        texts = [one for one in (self.value, *self.values) if isinstance(one, str)]
        if self.tolerance and not NOT_FINITE.keys() >= {*texts}:
            raise ValueError("tolerance is for numbers, and text has none: write a number without quotes")
        # In Python, true and false are the numbers 1 and 0.
        if self.tolerance and any(isinstance(one, bool) for one in (self.value, *self.values)):
            raise ValueError("tolerance is for numbers, and true and false are none")
        if self.value == {} or any(map(has_hole, (self.value, *self.values))):
            raise ValueError("value: something in it is empty")
        return self

    @property
    def words(self) -> str:
        each = join_words([value_text(one) for one in self.values], "then") if self.values else ""
        near = f", within {significant(self.tolerance)}" if self.tolerance else ""
        return f"{each or value_text(self.value)}{near}"

    def fits(self, reading: Reading) -> bool:
        """Return whether the field is there, and each of its values the wanted one."""
        return self.is_at(reading, self.value)

    def is_at(self, reading: Reading, value: object) -> bool:
        each = (differences(one, value, self.tolerance) for one in reading.values)
        return bool(reading.values) and not any(next(found, None) for found in each)


@check("field-equals", params=FieldEqualsParams, messages_only=True, of_callbacks=True)
def field_equals(package: PackageFacts, run: Run, params: FieldEqualsParams) -> Verdict:
    """A field of the messages has the right value.

    What it checks
        That the field has this value, in every message, in the first, in the last or in any of them; or several
        values, one after the other.

    Why it matters on a robot
        The robot also obeys a wrong constant, or a last command that is not a stop: it has nothing but the message.

    How it is measured
        The messages are decoded by the definition that their publisher sent. Numbers may differ by the
        tolerance; text, true and false have to be the same. With `[*]`, every item of a list is compared:
        with the one value, or with the value at the same place in a list of values.

    How to fix
        Set the field before you call `publish(…)`. `rostopic echo <topic>/<field>` shows it.
    """
    channels = sent_by(run, params.topic, params.of)
    found = join_items(readings(channels, params.field, numbers=False), (params.value, *params.values))
    if params.values and any(r.values for r in found):
        return _in_order(found, package, run, params)
    asked = {"first": found[:1], "last": found[-1:]}.get(params.when, found)
    wrong = [r for r in asked if not params.fits(r)]
    which = {"any": "any message", "every": "every message"}.get(params.when, f"the {params.when} message")
    if not found:
        verdict = nothing_sent(package, run, params.topic, params.of)
    elif not any(r.values for r in found):
        verdict = no_field(found[0], channels)
    elif len(wrong) == len(asked) if params.when == "any" else wrong:
        nan = any(one.nan for v in wrong[0].values for one in differences(v, params.value, params.tolerance))
        near = near_texts(wrong[0].values, params.value)
        verdict = _other_value(wrong, found, run, params).seeking("quoted", *near)
        verdict = verdict.based_on(**_shared(wrong[0], params))
        verdict = verdict if verdict.basis.wrong else verdict.of_value(nan=nan)
        ending = explain_early_end(package, run) if params.when == "last" else None
        if ending is not None and not ending.by_itself:  # it may have come to another value
            verdict = ending.verdict(
                failed_or_blocked, f"{verdict.message}, as the node ended: {ending.cause}"
            )
    else:
        count = f"all of {plural(len(found), 'message')}" if params.when == "every" else which
        verdict = passed(f"{params.field} of {params.topic} is {params.words} in {count}")
    expected = f"{params.field} of {params.topic} {params.words} in {which}"
    cited = (_span(run, wrong or asked, params),)
    return verdict.about(expected=expected, measured=verdict.measured or _values(asked), citations=cited)


def _all_alike(found: Sequence[Reading], params: FieldEqualsParams) -> Verdict | None:
    """Return the loss where all the values come in their order, each with the opposite sign, turned from true to false,
    or so many times as large."""
    numbers = [value for value in params.values if is_number(value)]
    are_numbers, is_bool = len(numbers) == len(params.values), all(isinstance(v, bool) for v in params.values)
    what, asked = f"{params.field} of {params.topic}", f"where {params.words} is asked for"

    def come(values: Sequence[object], tolerance: float) -> bool:
        readings = iter(found)
        near = params.model_copy(update={"tolerance": tolerance})
        return all(any(near.is_at(one, value) for one in readings) for value in values)

    if are_numbers and any(numbers) and come([-one for one in numbers], params.tolerance):
        why, hint, shared = "has the opposite sign", f"reverse the sign of {params.field}", OTHER_SIGN
    elif is_bool and len(set(params.values)) > 1 and come([not one for one in params.values], 0):
        why, hint, shared = "is the other way round", "turn what you compare the other way round", OPPOSITE
    elif (
        are_numbers
        and (by := _factor(found, numbers))
        and come([by * n for n in numbers], abs(by) * SLIGHTLY)
    ):
        why, shared = f"is {by:.4g} times what is asked for", factor_words(by)
        hint = f"multiply {params.field} by {1 / by:.4g}, or look for a unit or a factor that is wrong"
    else:
        return None
    verdict = failed(f"{what} {why}: {_values(found)}, {asked}", hint=hint)
    return verdict.based_on(lost_to=(beyond_words(params, shared),))


def _factor(found: Sequence[Reading], wanted: Sequence[float]) -> float:
    """Return how many times what is wanted comes, by the first of both that are not 0; 0 where that cannot be said."""
    came = [
        one.values[0] for one in found if len(one.values) == 1 and is_number(one.values[0]) and one.values[0]
    ]
    other = [one for one in wanted if one]
    changes = 1 + sum(before.values != one.values for before, one in pairwise(found))
    by = came[0] / other[0] if came and len(set(other)) > 1 and changes == len(wanted) else 0.0
    return by if math.isfinite(by) and abs(by) != 1 else 0.0


SLIGHTLY = 1e-3
OPPOSITE = "the opposite"


def factor_words(by: float) -> str:
    return f"{by:.3g} times as large"


def _in_order(
    found: Sequence[Reading], package: PackageFacts, run: Run, params: FieldEqualsParams
) -> Verdict:
    """Whether the values come one after the other; where one does not, what comes in its place, or why nothing does."""
    at, what, sent, found = 0, f"{params.field} of {params.topic}", found, as_numbers(found, params.values)
    text = failed(f"{what} is text: {_values(sent)}", hint="publish numbers, and no text")
    verdict = text if found is not sent else passed(f"{what} is {params.words}")
    for number, value in enumerate(params.values):
        here = next((n for n in range(at, len(found)) if params.is_at(found[n], value)), None)
        item = (
            taken_from(found[at], value, run.channels, params.topic) if here is None and found[at:] else None
        )
        if here is None and not item and (alike := _all_alike(found, params)):
            verdict = alike
            break
        if here is None and len(found) == len(params.values):  # none is missing: each has its place
            verdict = _in_another_order(found, params)
            break
        if here is None:
            if late := _begins_late(found, params, is_first=number == 0):
                verdict = late.if_repeated()
                break
            before = f" after {value_text(params.values[number - 1])}" if number else ""
            came = f"what comes{' then' if number else ''} is {_values(found[at:])}"
            came = came if found[at:] else "no more comes"
            message = f"{what} is never {value_text(value)}{before}: {came}"
            ending = None if found[at:] else explain_early_end(package, run)
            if ending is not None and not ending.by_itself:
                verdict = ending.verdict(failed_or_blocked, f"{message}, as the node ended: {ending.cause}")
                break
            make = f"set {params.field} to" if found[at:] else f"publish another message, with {params.field}"
            hint = f"{make} {value_text(value)}{before}; rostopic echo {params.topic} shows what your node publishes"
            if item:
                message, hint = _of_other_item(message, item, params)
            verdict = failed(message, hint=hint)
            later = any(params.is_at(one, v) for one in found[at:] for v in params.values[number + 1 :])
            if later or not found[at:]:  # one alone may have been lost on its way
                verdict = verdict.if_repeated()
            break
        at = here + 1
    else:
        verdict = _said_again(found, params) or verdict
    is_wanted = any(map(_has_nan, params.values))
    if verdict.status is Status.FAIL and not is_wanted and any(_has_nan(one.values) for one in found[at:]):
        verdict = _of_nan(verdict, run)
    cited = (_span(run, found, params),)
    return verdict.about(expected=f"{what} {params.words}", measured=_values(sent), citations=cited)


def _of_nan(verdict: Verdict, run: Run) -> Verdict:
    """Return the loss as one on NaN; with what to do about it, where the grader had sent one."""
    sent = (c for c in run.channels if c.by_grader and c.topic not in SYSTEM_TOPICS)
    topic = next((c.topic for c in sent if any(map(_has_nan, c.values))), "")
    if topic:
        hint = f"leave such a value out: in the callback of {topic}, ask `math.isnan(…)` first"
        why = f"a message on {topic} had NaN, and what is worked out with NaN is NaN"
        verdict = verdict.explained(why, hint)
    return verdict.of_value(nan=True)


def _has_nan(value: object) -> bool:
    """Return whether a number in a message is NaN."""
    inner = value.values() if isinstance(value, dict) else value if isinstance(value, list | tuple) else ()
    return (isinstance(value, float) and math.isnan(value)) or any(map(_has_nan, inner))


def _begins_late(found: Sequence[Reading], params: FieldEqualsParams, *, is_first: bool) -> Verdict | None:
    """Return the loss where the values are right but for the first, or for several that are missing at the beginning;
    `is_first`: the first value never comes."""
    what, values = f"{params.field} of {params.topic}", params.values
    if not is_first and (told := begins_later(found, values, params.is_at)):
        verdict = failed(f"{what} {told}", hint=f"publish {value_text(values[0])} first")
        return verdict.based_on(lost_to=(begins_without(params, values[0]),))
    missing = len(values) - len(found)
    if not is_first or not found or missing <= 0 or not all(map(params.is_at, found, values[missing:])):
        return None
    first = (
        f"the first {missing} of the {len(values)} values are missing"
        if missing > 1
        else "one value is missing"
    )
    hint = "look at what keeps the node from publishing at the beginning"
    return failed(f"{what} begins with {_values(found[:1])}: {first} before it", hint=hint)


def _said_again(found: Sequence[Reading], params: FieldEqualsParams) -> Verdict | None:
    again = [one for before, one in pairwise(found) if one.values == before.values]
    if params.repeats or not again:
        return None
    count = f"{len(again)} of {plural(len(found), 'message')}"
    told = f"{count} on {params.topic} repeat the one before: {params.field} {_values(again[:1])}"
    hint = f"keep the value that was published last, and publish on {params.topic} only when it changes"
    return failed(told, hint=hint)


def _in_another_order(found: Sequence[Reading], params: FieldEqualsParams) -> Verdict:
    """As many messages came as are wanted, but not with these values."""
    pairs = enumerate(zip(found, params.values, strict=True), 1)
    number, value = next((n, value) for n, (one, value) in pairs if not params.is_at(one, value))
    came = join_words([_values([one]) for one in found], "then")
    message = f"{params.field} of {params.topic} is {came}, not {params.words}"
    if len(found) > LISTED_MAX:  # what differs may not be among those that are listed
        came = f"{_values([found[number - 1]])} in message {number} of {len(found)}"
        message = f"{params.field} of {params.topic} is {came}, not {value_text(value)}"
    return failed(message, hint=f"set {params.field} to {value_text(value)} in message {number}")


def _other_value(
    wrong: Sequence[Reading], found: Sequence[Reading], run: Run, params: FieldEqualsParams
) -> Verdict:
    first = wrong[0]
    other = next((v for v in first.values if any(differences(v, params.value, params.tolerance))), None)
    why = next(map(str, differences(other, params.value, params.tolerance)), "")
    seen = f"it is {shown(why)}" if first.values else f"it is not there ({first.fault})"
    where = f"in the {params.when} message that" if params.when in {"first", "last"} else "when"
    hint = one_for_another(first.values, params.value) or _to_be_set(params, where)
    own = sent_by(run, params.topic, params.of)
    beside = "" if other else set_beside(own, first.time_ns, params.field, params.value, params.tolerance)
    seen, hint = _from_elsewhere(first, run, params, beside, (seen, hint))
    if params.when == "any":
        none = f"in none of {plural(len(found), 'message')}: at first {seen}"
        message = f"{params.field} of {params.topic} is {params.words} {none}"
        return failed(message, hint=hint).if_repeated()
    if params.when == "every":
        after = time_between(run, found[0].time_ns, first.time_ns)
        where = f"in {len(wrong)} of {plural(len(found), 'message')}: {seen}, {after} after the first"
        return failed(f"{params.field} of {params.topic} is wrong {where}", hint=hint)
    message = f"{params.field} of {params.topic} is wrong in the {params.when} message: {seen}"
    # Reversed, so that of each topic the first message is the one that stays.
    sent = {e.topic: t for t, e in reversed(run.actors) if e.action == "publish" and e.topic != params.topic}
    if params.when == "last" and sent and found[-1].time_ns < min(sent.values()):
        topics = join_words(sorted(filter(None, sent)))
        message, hint = f"{message}; none came after {topics}", f"publish again in the callback of {topics}"
    elif params.when == "last" and (number := was_right(found, why, params.value, params.tolerance)):
        message += f", and was right in message {number} of {len(found)}"
        hint = f"change {params.field} where it has to change, and keep the rest as in the message before"
    elif params.when == "last" and (made := made_of(found, run.channels, params)):
        message, hint = f"{message}: {made[0]}", made[1]
    elif params.when == "first" and (why_first := _why_first(found, run, params, sent, beside)):
        message, hint = message + why_first[0], why_first[1]
    verdict = failed(message, hint=hint)
    if params.when == "first":
        # What fails after the first message does not make it what it is
        due = ((run.start_ns, first.time_ns),)
        return verdict.based_on(callbacks="before", due=due)
    if since := turned_wrong(found, params.value):  # a callback that fails later did not do it
        verdict = verdict.based_on(wrong="order" if MOVED in why else "place", due=((run.start_ns, since),))
    return verdict.if_repeated()


OTHER_SIGN = "the other sign"


def beyond_words(params: FieldParams, what: str, end: float | None = None) -> str:
    """Return what is wrong with a field in words that two criteria share."""
    return f"{params.field} of {params.topic}: {what}{'' if end is None else f' {end:g}'}"


def begins_without(params: FieldParams, value: object) -> str:
    return beyond_words(params, f"begins without {value_text(value)}")


def _shared(wrong: Reading, params: FieldEqualsParams) -> dict[str, tuple[str, ...]]:
    """Return what another criterion on the field may be lost to as well: a bound that the value is beyond, a sign, or a
    first message."""
    got, wanted = wrong.values[0] if len(wrong.values) == 1 else None, params.value
    found: tuple[str, ...] = (begins_without(params, wanted),) if params.when == "first" else ()
    if isinstance(got, bool) and isinstance(wanted, bool):
        return {"lost_to": found, "beyond": (beyond_words(params, OPPOSITE),)}
    if not is_number(got) or not is_number(wanted) or math.isnan(got):
        return {"lost_to": found}
    found += (beyond_words(params, OTHER_SIGN),) if wanted and abs(got + wanted) <= params.tolerance else ()
    beyond = [beyond_words(params, "below" if got < wanted else "above", wanted)]
    beyond += [beyond_words(params, factor_words(got / wanted))] if got and wanted else []
    return {"lost_to": found, "beyond": (*beyond,)}


def _from_elsewhere(
    first: Reading, run: Run, params: FieldEqualsParams, beside: str, told: tuple[str, str]
) -> tuple[str, str]:
    """Return what is told with the part of a message, or the other field (`beside`), from which a wrong value comes."""
    if item := taken_from(first, params.value, run.channels, params.topic):
        return _of_other_item(told[0], item, params)
    if not beside:
        return told
    seen = f"{told[0]}; {beside} is {value_text(params.value)}"
    return seen, f"{told[1]}: {suspect_field(params.field, beside)}"


def _of_other_item(said: str, item: tuple[str, str, str], params: FieldParams) -> tuple[str, str]:
    """Return what is said, and the hint, where the field follows another part of the messages that the grader sent."""
    topic, right, wrong = item
    seen = f"{said}; it follows {wrong} of {topic}, and {right} is asked for"
    return seen, ask_item(params.field, topic, right, wrong)


def _to_be_set(params: FieldEqualsParams, where: str) -> str:
    if params.of != "student":
        return f"look at what your node publishes: what comes on {params.topic} comes of it"
    return f"{params.field} has to be {params.words} {where} you publish"


def _why_first(
    found: Sequence[Reading], run: Run, params: FieldEqualsParams, after: Collection[str | None], beside: str
) -> tuple[str, str] | None:
    """Return why the first message is another one, and a hint: it was waited for before anything was sent, or more
    messages came on the only topic on which the grader sent than on this one."""
    if _waited_without_message(run, params.topic, found[0].time_ns):
        topics = join_words(sorted(filter(None, after))) or "that"
        hint = f"publish once on {params.topic} before you wait for any message, as soon as the publisher is made"
        return f", which came only after {topics}", hint
    sent = [c for c in run.channels if c.by_grader and c.messages and c.times_ns[0] <= found[0].time_ns]
    sent = [c for c in sent if c.topic not in SYSTEM_TOPICS and not c.topic.startswith("/grader")]
    if beside or len(sent) != 1 or sent[0].topic == params.topic or len(sent[0].messages) <= len(found):
        return None
    if bisect(sent[0].times_ns, found[0].time_ns) == 1:
        return None  # the very first was answered
    topic, count = sent[0].topic, plural(len(sent[0].messages), "message")
    hint = f"publish for each message on {topic}: in the callback, below the `if` and not in it"
    return f"; {count} came on {topic}, and {len(found)} on {params.topic}", hint


def _waited_without_message(run: Run, topic: str, before_ns: int) -> bool:
    """Return whether the scenario had waited for a message on the topic, and none had come."""
    waits = (e for t, e in run.actors if t < before_ns and e.action == "wait" and e.topic == topic)
    return any("did not come" in one.detail for one in waits)


def _values(asked: Sequence[Reading]) -> str:
    each = [*dict.fromkeys(value_text(value) for one in asked for value in one.values)]
    return shown(join_words(each[:VALUES_SHOWN]) + ", …" * (len(each) > VALUES_SHOWN)) or "no value"
