"""Whether a field of the messages stays within its bounds."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any, NamedTuple

from pydantic import Field, model_validator

from grader.checks.registry import check
from grader.checks.support.absence import no_message
from grader.checks.support.fields import FieldPath, NoField, values_at
from grader.checks.support.losses import losses
from grader.checks.support.names import GlobalName, plain_type
from grader.evidence.run import Run
from grader.model.package import PackageFacts
from grader.model.record import Record
from grader.model.verdict import EvidenceCitation, Verdict, failed, inconclusive, passed, unjudged
from grader.wording import plural, seconds, significant

ROUNDING = 1e-6


class FieldBoundsParams(Record):
    """`field` as `rostopic echo` shows it: `linear.x`, `ranges[0]`, or `ranges[*]` for every item.

    Give `min`, `max` or both. `share` of the messages has to lie within them.
    """

    topic: GlobalName
    field: FieldPath
    min: float | None = None
    max: float | None = None
    share: Annotated[float, Field(gt=0, le=1)] = 1.0

    @model_validator(mode="after")
    def _some_bound(self) -> FieldBoundsParams:
        if self.min is None and self.max is None:
            raise ValueError("give min, max or both")
        if self.min is not None and self.max is not None and self.min > self.max:
            raise ValueError(f"min, {self.min:g}, is more than max, {self.max:g}")
        return self

    @property
    def words(self) -> str:
        if self.min is None:
            return f"at most {significant(self.max or 0)}"
        return (
            f"at least {significant(self.min)}"
            if self.max is None
            else f"{significant(self.min)} to {significant(self.max)}"
        )

    def holds(self, value: float) -> bool:
        """A bound counts as within, also where a 32-bit field cannot hold it exactly. NaN is outside."""
        above = self.min is None or value >= self.min - ROUNDING * max(1.0, abs(self.min))
        below = self.max is None or value <= self.max + ROUNDING * max(1.0, abs(self.max))
        return above and below and value == value  # noqa: PLR0124 - NaN is not itself


class Reading(NamedTuple):
    """The field in one message. `fault` says why there is nothing to compare."""

    time_ns: int
    values: tuple[float, ...]
    fault: str


@check("field-bounds", params=FieldBoundsParams, messages_only=True, heeds_losses=True)
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
    readings = _readings(run, params)
    missing = next((r for r in readings if not r.values), None)
    usable = [r for r in readings if r.values]
    outside = [r for r in readings if not (r.values and all(map(params.holds, r.values)))]
    if not readings:
        verdict = no_message(package, run, params.topic)
    elif not usable and missing:
        verdict = _no_field(missing, run, params)
    elif len(readings) - len(outside) < params.share * len(readings) - ROUNDING:
        verdict = _outside(outside, readings, params)
        if params.share < 1 and losses(run, params.topic):
            verdict = inconclusive(verdict.message, hint="grade again")
    else:
        verdict = passed(f"{params.field} of {params.topic} is {params.words} in {_share(readings, outside)}")
    spans = outside or readings
    span = {"from_ns": spans[0].time_ns, "to_ns": spans[-1].time_ns} if spans else {}
    share = f" in {params.share:.0%} of the messages" if params.share < 1 else ""
    return verdict.model_copy(
        update={
            "expected": f"{params.field} of {params.topic} {params.words}{share}",
            "measured": verdict.measured or _range(usable),
            "citations": (
                *verdict.citations,
                EvidenceCitation(evidence=run.evidence, topic=params.topic, **span),
            ),
        }
    )


def _readings(run: Run, params: FieldBoundsParams) -> list[Reading]:
    found = [
        _reading(time_ns, value, params.field)
        for channel in run.student_channels(params.topic)
        for time_ns, value in zip(channel.times_ns, channel.values, strict=True)
    ]
    return sorted(found, key=lambda one: one.time_ns)


def _reading(time_ns: int, message: Any, path: str) -> Reading:  # noqa: ANN401 - decoded messages hold anything
    if message is None:
        return Reading(time_ns, (), "the message cannot be read")
    try:
        values = values_at(message, path)
    except NoField as error:
        return Reading(time_ns, (), str(error))
    if not values:
        return Reading(time_ns, (), f"{path.partition('[*]')[0]} is empty")
    if not all(isinstance(value, int | float) for value in values):
        return Reading(time_ns, (), f"{path} is no number")
    return Reading(time_ns, tuple(values), "")


def _no_field(missing: Reading, run: Run, params: FieldBoundsParams) -> Verdict:
    """Not one message has it: another type of message, most often."""
    channel = next(c for c in run.student_channels(params.topic) if c.messages)
    kind = plain_type(channel.type)
    if all(value is None for value in channel.values):
        return inconclusive(f"the messages on {params.topic} ({kind}) cannot be read", hint="grade again")
    message = f"the messages on {params.topic} ({kind}) do not fit: {missing.fault}"
    return unjudged(message, measured=missing.fault, hint=f"rostopic echo {params.topic} shows the fields")


def _outside(outside: Sequence[Reading], readings: Sequence[Reading], params: FieldBoundsParams) -> Verdict:
    first = outside[0]
    after = seconds(first.time_ns - readings[0].time_ns)
    wrong = [value for value in first.values if not params.holds(value)]
    seen = f"is {significant(wrong[0])}" if wrong else f"is not there ({first.fault})"
    count = f"in {len(outside)} of {plural(len(readings), 'message')}"
    message = (
        f"{params.field} of {params.topic} is not {params.words} {count}: it {seen}, {after} after the first"
    )
    return failed(message, hint=f"keep {params.field} {params.words} before you publish it")


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
