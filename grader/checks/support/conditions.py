"""What messages or calls have to say to count as a cause or an effect, and when it is true."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from itertools import groupby
from typing import Annotated, Literal

from pydantic import Field, model_validator

from grader.checks.support.exit_causes import explain_end
from grader.checks.support.fields import (
    FieldPath,
    Reading,
    bounds_text,
    differences,
    is_within,
    reading_of,
    readings,
    refuse_disorder,
    value_text,
)
from grader.checks.support.processes import GlobalName, early_end, observed_until_ns
from grader.checks.support.services import exchanges
from grader.evidence.events import NOT_OFFERED
from grader.evidence.run import Channel, Run
from grader.model.package import PackageFacts
from grader.model.record import Record
from grader.model.verdict import Status, Verdict
from grader.wording import significant


class Condition(Record):
    """The messages that count: any on the topic, or those whose `field` is from `min` to `max`, or `value`."""

    topic: GlobalName
    """The topic, with its slash: `/chatter`. As a cause also a service that the scenario calls, `/pause`: then the
    fields are those of its request, and count once it is answered."""
    field: FieldPath | None = None
    """As `rostopic echo` shows it: `linear.x`, `ranges[0]`, or `ranges[*]` for every item. Null: any message counts."""
    min: float | None = None
    """The least value, in the field's own unit; null: no bound."""
    max: float | None = None
    """The greatest value, in the field's own unit; null: no bound."""
    value: float | str | bool | None = None
    """The value itself, in place of `min` and `max`."""
    tolerance: Annotated[float, Field(ge=0)] = 0.0
    """How much a number may differ from `value`, in the field's own unit."""
    items: Literal["all", "any"] = "all"
    """For a list (`ranges[*]`), whether `all` of its items have to match, or `any` of them."""

    @model_validator(mode="after")
    def _is_whole(self) -> Condition:
        asks = (self.min is not None or self.max is not None, self.value is not None)
        if (self.field is None and any(asks)) or (self.field is not None and sum(asks) != 1):
            raise ValueError("give field with min, max or both, or field with value, or none of them")
        refuse_disorder(self.min, self.max)
        if self.tolerance and isinstance(self.value, bool):
            raise ValueError("tolerance is for numbers, and true and false are none")
        if self.tolerance and isinstance(self.value, str):
            raise ValueError("tolerance is for numbers, and text has none: write a number without quotes")
        return self

    @property
    def words(self) -> str:
        """`linear.x of /cmd_vel at most 0.1`."""
        if self.field is None:
            return f"a message on {self.topic}"
        return f"{'any of ' if self.items == 'any' else ''}{self.field} of {self.topic} {self._bounds()}"

    @property
    def absence(self) -> str:
        """`no message on /cmd_vel with linear.x at least 0.1`."""
        which = "any of " if self.items == "any" else ""
        return f"no message on {self.topic}" + (
            f" with {which}{self.field} {self._bounds()}" if self.field else ""
        )

    def _bounds(self) -> str:
        if self.value is not None:
            near = f", within {significant(self.tolerance)}" if self.tolerance else ""
            return f"{value_text(self.value)}{near}"
        return bounds_text(self.min, self.max)

    def read(self, channels: Sequence[Channel]) -> list[Reading]:
        """Return what of the messages is asked for, by time."""
        if self.field is not None:
            return readings(channels, self.field, numbers=self.value is None)
        return sorted(Reading(t, (), "") for c in channels for t in c.times_ns)

    def come_in(self, run: Run) -> list[Reading]:
        """Return the same of all messages on the topic, from any node; or of the grader's calls of a service: one that
        fits counts once it is answered, and ends when another one is made."""
        if not is_called(run, self.topic):
            return self.read([c for c in run.channels if c.topic == self.topic])
        asked = []
        for one in exchanges(run, self.topic):
            found = Reading(one.at_ns, (), "")
            if self.field is not None:
                found = reading_of(one.at_ns, one.request, self.field, numbers=self.value is None)
            if not self.holds(found):
                asked.append(found)
            elif one.answered_ns is not None and one.response is not None:
                asked.append(found._replace(time_ns=one.answered_ns))
        return asked

    def holds(self, reading: Reading) -> bool:
        if self.field is None:
            return True
        each = [self._fits(value) for value in reading.values]
        return any(each) if self.items == "any" else bool(each) and all(each)

    def first_in(self, reading: Reading) -> int | None:
        """Return the index of the item of a list for which it holds, that of `ranges[3]` itself; else None."""
        index = re.fullmatch(r"\w+\[(\d+|\*)\]", self.field or "")
        if index is None:
            return None
        fitting = (number for number, value in enumerate(reading.values) if self._fits(value))
        return next(fitting, None) if index[1] == "*" else int(index[1])

    def _fits(self, value: object) -> bool:
        if self.value is not None:
            return next(differences(value, self.value, self.tolerance), None) is None
        assert isinstance(value, int | float)  # noqa: S101 - what is not a number was left out
        return is_within(value, self.min, self.max)


def is_called(run: Run, name: str) -> bool:
    """Return whether a name is that of a service which the grader calls, or would have called: a topic of the same name
    is no cause then, unless the grader publishes on it."""
    sent = any(c.topic == name and c.by_grader for c in run.channels)
    called = (e for _, e in run.actors if e.topic == name and (e.action == "call" or e.detail == NOT_OFFERED))
    return not sent and any(called)


def said_of_calls(run: Run, cause: Condition | None, verdict: Verdict) -> Verdict:
    """Return the verdict with calls where messages are said, if the cause is a service."""
    if cause is None or cause.field is not None or not is_called(run, cause.topic):
        return verdict
    texts = {key: getattr(verdict, key) for key in ("message", "hint", "expected")}
    said = {key: text.replace(cause.words, words_in(run, cause)) for key, text in texts.items()}
    return verdict.model_copy(update=said)


def words_in(run: Run, cause: Condition) -> str:
    """Return the condition in words, as those of a run that may call a service."""
    is_call = cause.field is None and is_called(run, cause.topic)
    return f"a call of {cause.topic}" if is_call else cause.words


def absent_in(run: Run, cause: Condition) -> str:
    """Return that a cause never came in a run; of a service, that no call was answered."""
    asked = exchanges(run, cause.topic) if is_called(run, cause.topic) else ()
    failed = any(one.response is None and one.detail != NOT_OFFERED for one in asked)
    since = ", since the service did not answer" if failed else ""
    return f"{words_in(run, cause)} never came in this run{since}"


def how_shown(run: Run, cause: Condition) -> str:
    """Return what shows a student whether the cause comes."""
    command = "rosservice call" if is_called(run, cause.topic) else "rostopic echo"
    command = f"{command} {cause.topic}"
    return f"`{command}` shows what comes"


def old_until_s(
    effect: Condition, effects: Sequence[Reading], to_s: Callable[[int], float], at_ns: int, least_s: float
) -> float:
    """Return until when messages say what they said before a cause: a node that publishes its state all the time may do
    so once more before it hears of the cause, and that is no answer to it."""
    before = next((one for one in reversed(effects) if one.time_ns <= at_ns), None)
    if not least_s or before is None or not effect.holds(before):
        return -math.inf
    other = next((one for one in effects if one.time_ns > at_ns and not effect.holds(one)), None)
    is_soon = other is not None and to_s(other.time_ns) - to_s(at_ns) < least_s
    return to_s(other.time_ns) if other is not None and is_soon else -math.inf


def keep_time(least_s: float) -> str:
    """Return the hint on an answer that is due only after a time."""
    passed_s = f"{significant(least_s)} s"
    return (
        f"keep the time of the message, and see in the loop or a timer whether {passed_s} have passed since"
    )


def unless_ended(
    package: PackageFacts, run: Run, verdict: Verdict, causes_ns: Sequence[int], within_s: float
) -> Verdict:
    """Return a lost mark with the exception that ended the node before it could answer any of these causes."""
    ended = early_end(run) if verdict.status is Status.FAIL and not verdict.basis.cause else None
    if ended is None or ended.end_ns is None or not causes_ns:
        return verdict
    end = explain_end(ended, run, package)
    is_before = ended.end_ns <= causes_ns[0] + round((within_s + ENDING_S) * 1e9)
    if not is_before or not end.raised:
        return verdict
    return end.explain(verdict, f"{verdict.message}; then the node ends: {end.cause}")


ENDING_S = 1.0
"""So long Python may take to end after an exception."""


def shown_on(run: Run, cause: Condition) -> str:
    """Return where the evidence has the causes: a service's calls are among what the grader did."""
    return "/grader/actor" if is_called(run, cause.topic) else cause.topic


def true_spans(cause: Condition, causes: Sequence[Reading], run: Run) -> list[tuple[int, int]]:
    """Return the stretches of time for which a condition is true of the last message on its topic."""
    until_ns = observed_until_ns(run) or run.end_ns
    stretches = [(held, next(group).time_ns) for held, group in groupby(causes, key=cause.holds)]
    ends = [*(from_ns for _, from_ns in stretches[1:]), until_ns]
    return [
        (from_ns, min(end_ns, until_ns))
        for (held, from_ns), end_ns in zip(stretches, ends, strict=False)
        if held
    ]
