"""Whether messages say what they should, tell the time, and keep within bounds."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Annotated, Any, NamedTuple

from pydantic import Field, model_validator

from grader.checks.registry import check
from grader.checks.support.clocks import GET_TIME, WATCHED_S, clocks_at, wrong_growth
from grader.checks.support.exit_causes import explain_early_end
from grader.checks.support.nodes import PublishedTopic, plain_type
from grader.checks.support.processes import early_end, is_flood, observed_until_ns
from grader.checks.support.text import (
    NUMBER,
    OTHER_WORDS_SHARE,
    SECONDS,
    in_one_line,
    in_words,
    message_pattern,
)
from grader.checks.support.topics import FieldPath, NoField, cite, losses, no_message, values_at
from grader.evidence.run import Channel, Run
from grader.model.package import PackageFacts
from grader.model.record import Record
from grader.model.verdict import Verdict, failed, inconclusive, partial, passed, unjudged
from grader.wording import plural, seconds, significant

ENOUGH = 3
"""Of the points, for a time that grows as it should in other words than the handout's."""
_LAST_NUMBER = re.compile(rf".*?({NUMBER})\D*", re.DOTALL)
SECONDS_CHARS_MAX = 60
UNFILLED = ("%s", "%d", "%f", "{}", "{0}")
ROUNDING = 1e-6


class MessageParams(Record):
    """`template` is the whole text, `{seconds}` in it a time that grows: `hello world {seconds}`."""

    topic: PublishedTopic
    template: Annotated[str, Field(min_length=1)]


@check("message", params=MessageParams, messages_only=True, heeds_losses=True)
def message(package: PackageFacts, run: Run, params: MessageParams) -> Verdict:
    """Each message says what the handout asks, and contains the time.

    What it checks
        That every message on the topic has the handout's words, and a time in seconds that grows from
        message to message.

    Why it matters on a robot
        Programs that read the messages go by their form, and measurements without the right time cannot be put
        in order or be told from old ones.

    How it is measured
        Each text is compared with the template; capitals, and how many blanks stand between words, do not
        matter. The number has to grow as the clock did between the arrivals, within 1.5 s and 5 %. Whole
        seconds and seconds since the node's start will do; nanoseconds, milliseconds and a number that
        stays the same will not. A right time in other words than the handout's earns half.

    How to fix
        Make the text anew in each turn of the loop: `"hello world %s" % rospy.get_time()`. `rostopic echo
        <topic>` shows what is sent.
    """
    heard = [c for c in run.student_channels(params.topic) if c.messages]
    grows = ", the seconds growing as the clock does" if SECONDS in params.template else ""
    expected = f"each message on {params.topic} is '{in_words(params.template)}'{grows}"
    if not heard or not all(isinstance(text, str) for c in heard for text in c.data):
        return _no_text(package, run, heard, params).about(expected=expected)
    count = sum(len(c.messages) for c in heard)
    verdict = (
        _misfit(run, heard, params)
        or _wrong_time(package, run, heard, params)
        or passed(f"all {count} messages on {params.topic} are '{in_words(params.template)}'{grows}")
    )
    measured = f"{in_one_line(heard[0].data[0])!r} to {in_one_line(heard[0].data[-1])!r} ({plural(count, 'message')})"
    span = cite(run, params.topic, min(c.times_ns[0] for c in heard), max(c.times_ns[-1] for c in heard))
    citations = verdict.citations or (span,)
    return verdict.about(expected=expected, measured=measured, citations=citations)


def _no_text(package: PackageFacts, run: Run, heard: Sequence[Channel], params: MessageParams) -> Verdict:
    if heard:
        message = f"{params.topic} carries {heard[0].type}, and no text that could be compared"
        return unjudged(message, hint="publish std_msgs/String", measured=heard[0].type)
    return no_message(package, run, params.topic)


def _misfit(run: Run, heard: Sequence[Channel], params: MessageParams) -> Verdict | None:
    """The first message that does not have the template's words, or no number where the time belongs."""
    fits, loose = (message_pattern(params.template, value) for value in (NUMBER, ".*?"))
    wrong = (
        (t, text)
        for c in heard
        for t, text in zip(c.times_ns, c.data, strict=True)
        if not fits.fullmatch(text)
    )
    at_ns, text = next(wrong, (0, ""))
    if not at_ns:
        return None
    found = loose.fullmatch(text)
    part = in_one_line(found[1]) if found and found.groups() else ""
    wanted = in_words(params.template)
    form = params.template.replace(SECONDS, "%s")
    if any(mark in text for mark in UNFILLED):
        message = f"a message reads {in_one_line(text)!r}: its placeholder was never filled in"
    elif more := _behind(part):
        message = f"a message has {more!r} after the time: {in_one_line(text)!r}, not '{wanted}'"
    elif part:
        message = f"a message says {part!r} where the time in seconds belongs: {in_one_line(text)!r}, not '{wanted}'"
    else:
        message = f"a message reads {in_one_line(text)!r}, not '{wanted}'"
    cited = cite(run, params.topic, at_ns, at_ns)
    value = " % rospy.get_time()" if SECONDS in params.template else ""
    hint = f'publish "{form}"{value}'
    if value and _tells_time(run, heard):
        return partial(OTHER_WORDS_SHARE, f"{message}; its time is right", hint=hint, citations=(cited,))
    return failed(message, hint=hint, citations=(cited,))


def _tells_time(run: Run, heard: Sequence[Channel]) -> bool:
    """Whether each publisher's texts end with a time that grows as it should, whatever their words are."""
    for channel in heard:
        found = [_LAST_NUMBER.fullmatch(text[-SECONDS_CHARS_MAX:]) for text in channel.data]
        told = [float(one[1]) for one in found if one]
        clocks = clocks_at(run, channel.times_ns)
        enough = ENOUGH <= len(told) == len(found)
        if not (enough and clocks) or wrong_growth(told, clocks, short=False) is not None:
            return False
    return True


def _behind(part: str) -> str:
    """Return what stands behind the number where more than a number is found."""
    found = re.match(rf"{NUMBER}\s+([^\W\d].*)", part)
    return found[1] if found else ""


def _wrong_time(
    package: PackageFacts, run: Run, heard: Sequence[Channel], params: MessageParams
) -> Verdict | None:
    if SECONDS not in params.template:
        return None
    pattern = message_pattern(params.template, NUMBER)
    longest = [c for c in heard if len(c.messages) >= ENOUGH]
    if not longest:
        return _too_few(package, run, heard, params)
    for channel in longest:
        told = [float(found[1]) for text in channel.data if (found := pattern.fullmatch(text))]
        clocks = clocks_at(run, channel.times_ns)
        if not clocks:
            message = "the time in the messages cannot be judged: the run's /clock was not recorded"
            return inconclusive(message, hint="grade again")
        own_doing = early_end(run) is not None or _watched_ns(run, heard) >= WATCHED_S * 1e9
        short = is_flood(run) or (own_doing and clocks[0][-1] < WATCHED_S)
        wrong = wrong_growth(told, clocks, short=short)
        if wrong is not None:
            too_few = own_doing and wrong.status.value == "inconclusive"
            return _too_few(package, run, heard, params) if too_few else wrong
    return None


def _watched_ns(run: Run, heard: Sequence[Channel]) -> int:
    """Return how long its messages could have come."""
    return (observed_until_ns(run) or run.end_ns) - min(c.times_ns[0] for c in heard)


def _too_few(package: PackageFacts, run: Run, heard: Sequence[Channel], params: MessageParams) -> Verdict:
    """Too little came: the node's own fault where it died, or was watched long enough."""
    few = f"only {plural(sum(len(c.messages) for c in heard), 'message')} came on {params.topic}"
    if losses(run, params.topic):
        return inconclusive(f"{few}: too few to see the time grow", hint="grade again")
    if end := explain_early_end(package, run):
        message = f"{few} before the node ended ({end.cause}): too few to see the time grow"
        return end.verdict(unjudged, message)
    if _watched_ns(run, heard) >= WATCHED_S * 1e9:
        return unjudged(f"{few}: too few to see the time grow", hint=f"publish in the loop; {GET_TIME}")
    return inconclusive(f"{few} while it was watched: too few to see the time grow", hint="grade again")


class FieldBoundsParams(Record):
    """`field` as `rostopic echo` shows it: `linear.x`, `ranges[0]`, or `ranges[*]` for every item.

    Give `min`, `max` or both. `share` of the messages has to lie within them.
    """

    topic: PublishedTopic
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
    spans = [r.time_ns for r in outside or readings]
    cited = cite(run, params.topic, spans[0], spans[-1]) if spans else cite(run, params.topic)
    share = f" in {params.share:.0%} of the messages" if params.share < 1 else ""
    return verdict.about(
        expected=f"{params.field} of {params.topic} {params.words}{share}",
        measured=verdict.measured or _range(usable),
        citations=(*verdict.citations, cited),
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
