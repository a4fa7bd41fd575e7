"""Whether a field of the messages keeps within bounds, or has the value that it should."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from grader.checks.registry import check
from grader.checks.support.fields import (
    ROUNDING,
    FieldPath,
    Reading,
    bounds_text,
    is_within,
    no_field,
    readings,
)
from grader.checks.support.nodes import PublishedTopic
from grader.checks.support.text import shown
from grader.checks.support.topics import Sender, cite, losses, nothing_sent, sent_by
from grader.checks.support.values import differences, value_text
from grader.evidence.run import Run
from grader.model.package import PackageFacts
from grader.model.record import Record
from grader.model.verdict import Verdict, failed, inconclusive, passed
from grader.wording import join_words, plural, seconds, significant

VALUES_SHOWN = 4


class FieldBoundsParams(Record):
    """A field and its bounds: `min`, `max` or both."""

    topic: PublishedTopic
    """The topic, with its slash: `/chatter`."""
    field: FieldPath
    """As `rostopic echo` shows it: `linear.x`, `ranges[0]`, or `ranges[*]` for every item."""
    min: float | None = None
    """The least value, in the field's own unit; null: no bound."""
    max: float | None = None
    """The greatest value, in the field's own unit; null: no bound."""
    share: Annotated[float, Field(gt=0, le=1)] = 1.0
    """The share of the messages that has to lie within the bounds, above 0 and at most 1."""
    of: Sender = "student"
    """Whose messages count: the `student`'s nodes', those of a `program` that the scenario starts beside them, or
    `anyone`'s."""

    @model_validator(mode="after")
    def _some_bound(self) -> FieldBoundsParams:
        if self.min is None and self.max is None:
            raise ValueError("give min, max or both")
        if self.min is not None and self.max is not None and self.min > self.max:
            raise ValueError(f"min, {self.min:g}, is more than max, {self.max:g}")
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
        all, ends at the wall.

    How it is measured
        Every message of the run is decoded by the definition that its publisher sent. A bound itself is
        within; NaN never is; of a list, every item counts, and an empty one is outside.

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
    elif len(found) - len(outside) < params.share * len(found) - ROUNDING:
        verdict = _outside(outside, found, params)
        if params.share < 1 and losses(run, params.topic):
            verdict = inconclusive(verdict.message, hint="grade again")
    else:
        verdict = passed(f"{params.field} of {params.topic} is {params.words} in {_share(found, outside)}")
    spans = [r.time_ns for r in outside or found]
    cited = cite(run, params.topic, spans[0], spans[-1]) if spans else cite(run, params.topic)
    share = f" in {params.share:.0%} of the messages" if params.share < 1 else ""
    return verdict.about(
        expected=f"{params.field} of {params.topic} {params.words}{share}",
        measured=verdict.measured or _range(usable),
        citations=(*verdict.citations, cited),
    )


def _outside(outside: Sequence[Reading], readings: Sequence[Reading], params: FieldBoundsParams) -> Verdict:
    first = outside[0]
    after = seconds(first.time_ns - readings[0].time_ns)
    wrong = [value for value in first.values if not params.holds(value)]
    seen = f"is {significant(wrong[0])}" if wrong else f"is not there ({first.fault})"
    count = f"in {len(outside)} of {plural(len(readings), 'message')}"
    message = (
        f"{params.field} of {params.topic} is not {params.words} {count}: it {seen}, {after} after the first"
    )
    return failed(message, hint=f"make sure that {params.field} is {params.words} before you publish it")


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


class FieldEqualsParams(Record):
    """A field and its value."""

    topic: PublishedTopic
    """The topic, with its slash: `/chatter`."""
    field: FieldPath
    """As `rostopic echo` shows it: `linear.x`, `ranges[0]`, or `ranges[*]` for every item."""
    value: Any
    """The right value, as in YAML: a number, text, true or false, a list or a map."""
    tolerance: Annotated[float, Field(ge=0)] = 0.0
    """How much numbers may differ, in the field's own unit."""
    when: Literal["every", "first", "last", "any"] = "every"
    """Which messages have to have the value: `every` one, the `first`, the `last` of the run, or `any` of them."""
    of: Sender = "student"
    """Whose messages count: the `student`'s nodes', those of a `program` that the scenario starts beside them, or
    `anyone`'s."""

    @property
    def words(self) -> str:
        near = f", within {significant(self.tolerance)}" if self.tolerance else ""
        return f"{value_text(self.value)}{near}"

    def fits(self, reading: Reading) -> bool:
        """Return whether the field is there, and each of its values the wanted one."""
        each = (differences(one, self.value, self.tolerance) for one in reading.values)
        return bool(reading.values) and not any(next(found, None) for found in each)


@check("field-equals", params=FieldEqualsParams, messages_only=True, of_callbacks=True)
def field_equals(package: PackageFacts, run: Run, params: FieldEqualsParams) -> Verdict:
    """A field of the messages has the right value.

    What it checks
        That the field has this value, in every message, in the first, in the last or in any of them.

    Why it matters on a robot
        A constant that is wrong, or a last command that is not a stop, is done all the same: the robot has
        nothing but the message.

    How it is measured
        The messages are decoded by the definition that their publisher sent. Numbers
        may differ by the tolerance; text, true and false have to be the same. Of a list with `[*]`, every
        item counts.

    How to fix
        Set the field before you call `publish(…)`. `rostopic echo <topic>/<field>` shows it.
    """
    channels = sent_by(run, params.topic, params.of)
    found = readings(channels, params.field, numbers=False)
    asked = {"first": found[:1], "last": found[-1:]}.get(params.when, found)
    wrong = [r for r in asked if not params.fits(r)]
    which = {"any": "any message", "every": "every message"}.get(params.when, f"the {params.when} message")
    if not found:
        verdict = nothing_sent(package, run, params.topic, params.of)
    elif not any(r.values for r in found):
        verdict = no_field(found[0], channels)
    elif len(wrong) == len(asked) if params.when == "any" else wrong:
        verdict = _other_value(wrong, found, params)
    else:
        count = f"all of {plural(len(found), 'message')}" if params.when == "every" else which
        verdict = passed(f"{params.field} of {params.topic} is {params.words} in {count}")
    spans = [r.time_ns for r in wrong or asked]
    cited = cite(run, params.topic, spans[0], spans[-1]) if spans else cite(run, params.topic)
    return verdict.about(
        expected=f"{params.field} of {params.topic} {params.words} in {which}",
        measured=verdict.measured or _values(asked),
        citations=(*verdict.citations, cited),
    )


def _other_value(wrong: Sequence[Reading], found: Sequence[Reading], params: FieldEqualsParams) -> Verdict:
    first = wrong[0]
    other = next((v for v in first.values if any(differences(v, params.value, params.tolerance))), None)
    why = next(map(str, differences(other, params.value, params.tolerance)), "")
    seen = f"it is {shown(why)}" if first.values else f"it is not there ({first.fault})"
    hint = f"set {params.field} to {params.words} before you publish"
    if params.when == "any":
        message = (
            f"{params.field} of {params.topic} is {params.words} in none of {plural(len(found), 'message')}"
        )
        return failed(f"{message}: at first {seen}", hint=hint).once()
    if params.when == "every":
        after = seconds(first.time_ns - found[0].time_ns)
        where = f"in {len(wrong)} of {plural(len(found), 'message')}: {seen}, {after} after the first"
        return failed(f"{params.field} of {params.topic} is wrong {where}", hint=hint)
    verdict = failed(
        f"{params.field} of {params.topic} is wrong in the {params.when} message: {seen}", hint=hint
    )
    return verdict.once() if params.when == "last" else verdict


def _values(asked: Sequence[Reading]) -> str:
    each = dict.fromkeys(value_text(value) for one in asked for value in one.values)
    return (
        shown(join_words(list(each)[:VALUES_SHOWN]) + (", …" if len(each) > VALUES_SHOWN else ""))
        or "no value"
    )
