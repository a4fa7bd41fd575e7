"""Whether messages say what they should, and tell the time."""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import pairwise
from typing import Annotated

from pydantic import Field

from grader.checks.registry import check
from grader.checks.support.clocks import ASK_AGAIN, WATCHED_S, clocks_at, wrong_growth
from grader.checks.support.counters import Count, CounterParams, cite_slip, judge_steps, wrong_steps
from grader.checks.support.exit_causes import explain_early_end
from grader.checks.support.processes import OnTopic, early_end, is_flood, observed_until_ns, slips_of
from grader.checks.support.recorder_losses import losses
from grader.checks.support.text import (
    COUNT,
    NUMBER,
    OTHER_WORDS_SHARE,
    SECONDS,
    code_of,
    growing,
    in_one_line,
    in_words,
    message_pattern,
    refuse_others,
)
from grader.checks.support.topics import cite, no_message
from grader.evidence.run import Channel, Run
from grader.model.package import PackageFacts
from grader.model.verdict import (
    Status,
    Verdict,
    failed,
    failed_or_blocked,
    grade_again,
    passed,
)
from grader.wording import plural, significant

ENOUGH = 3
NEVER = 2**64
"""As a maximum: no counter comes so far."""
_HOURS = re.compile(r"\d:[0-5]\d:$")
"""Hours and minutes before the seconds: a time, and not one in seconds."""
_FUNCTION = re.compile(r"<(?:built-in )?(?:function|bound method|method) (?:\w+\.)*(\w+)")
"""What Python prints of a function that is not called, and its name."""
_LAST_NUMBER = re.compile(rf".*?({NUMBER})\D*", re.DOTALL)
SECONDS_CHARS_MAX = 60
UNFILLED = ("%s", "%d", "%f", "{}", "{0}")


class MessageParams(OnTopic):
    """The text of each message."""

    template: Annotated[str, Field(min_length=1), refuse_others(SECONDS, COUNT)]
    """The whole text, where `{seconds}` is a time that grows, and `{count}` goes up by one: `hello world {seconds}`."""


@check("message", params=MessageParams, messages_only=True, heeds_losses=True)
def message(package: PackageFacts, run: Run, params: MessageParams) -> Verdict:
    """Each message says what the handout asks, and contains the time.

    What it checks
        That every message on the topic has the handout's words, and a time in seconds that increases from
        message to message, or a count of the messages.

    Why it matters on a robot
        Programs that read the messages rely on their form, and measurements without the right time cannot
        be put in order or told from old ones.

    How it is measured
        Each text is compared with the template; capitals and the number of spaces between words do not
        matter. The number has to grow as the clock did between the arrivals, within 1.5 s and 5 %. Whole
        seconds and seconds since the node's start will do; nanoseconds, milliseconds and a number that
        stays the same will not. A count of the messages in a script that reads no clock is no time, even
        though at 1 Hz it grows as fast as one. A right time in other words than the handout's earns half.

    How to fix
        Build the text each time around the loop: `"hello world %s" % rospy.get_time()`, or `% count`. `rostopic echo
        <topic>` shows what is sent.
    """
    heard = [c for c in run.student_channels(params.topic) if c.messages]
    grows = growing(params.template)
    expected = f"each message on {params.topic} is '{in_words(params.template)}'{grows}"
    if not heard or not all(isinstance(text, str) for c in heard for text in c.data):
        return _no_text(package, run, heard, params).about(expected=expected)
    count = sum(len(c.messages) for c in heard)
    verdict = (
        # Words first: a time can be read only where it stands in its place.
        _misfit(package, run, heard, params)
        or _wrong_time(package, run, heard, params)
        or _wrong_count(package, run, heard, params)
        or passed(f"all {count} messages on {params.topic} are '{in_words(params.template)}'{grows}")
    )
    measured = f"{in_one_line(heard[0].data[0])!r} to {in_one_line(heard[0].data[-1])!r} ({plural(count, 'message')})"
    span = cite(run, params.topic, min(c.times_ns[0] for c in heard), max(c.times_ns[-1] for c in heard))
    return verdict.about(expected=expected, measured=measured, citations=verdict.citations or (span,))


def _no_text(package: PackageFacts, run: Run, heard: Sequence[Channel], params: MessageParams) -> Verdict:
    if heard:
        message = f"{params.topic} carries {heard[0].type}, not text that could be compared"
        verdict = failed_or_blocked(message, hint="publish std_msgs/String", measured=heard[0].type)
        return verdict.based_on(misfit=True)
    return no_message(package, run, params.topic)


def _misfit(
    package: PackageFacts, run: Run, heard: Sequence[Channel], params: MessageParams
) -> Verdict | None:
    """The first message that does not have the template's words, or no number where the time belongs."""
    # The loose one shows what stands where the time belongs.
    fits, loose = (message_pattern(params.template, value) for value in (NUMBER, ".*?"))
    texts = (timed for c in heard for timed in zip(c.times_ns, c.data, strict=True))
    wrong = [(at_ns, text) for at_ns, text in texts if not fits.fullmatch(text)]
    if not wrong:
        return None
    at_ns, text = wrong[0]
    count = sum(len(c.data) for c in heard)
    found = loose.fullmatch(text)
    part = in_one_line(found[1]) if found and found.groups() else ""
    function = _FUNCTION.match(part)
    said = f"{in_one_line(text)!r}, not '{in_words(params.template)}'"
    what, unit = ("time", " in seconds") if SECONDS in params.template else ("count", "")
    # Placeholders first: they, too, are not a number where the time belongs.
    if any(mark in text for mark in UNFILLED):
        message = f"a message reads {in_one_line(text)!r}: its placeholder was never filled in"
    elif more := _behind(part):
        message = f"a message has {more!r} after the {what}: {said}"
    elif function:
        message = (
            f"a message says {part!r} where the {what} belongs: `{function[1]}` is named, but not called"
        )
    elif part:
        message = f"a message says {part!r} where the {what}{unit} belongs: {said}"
    else:
        message = f"a message reads {said}"
    message += f" ({len(wrong)} of {count} are wrong)" if len(wrong) < count else ""
    cited = cite(run, params.topic, at_ns, at_ns)
    hint = f"publish {code_of(params.template)}"
    if function:
        hint = f"write `{function[1]}()`, with its brackets, where that text is made"
    timed = SECONDS in params.template
    if timed and not function and len(wrong) > 1 and len({said for _, said in wrong}) == 1:
        hint += ", made in the loop for each message"
    verdict = failed(message, hint=hint, citations=(cited,)).about(said=in_one_line(text))
    right = timed and _tells_time(package, run, heard)
    return verdict.in_part(OTHER_WORDS_SHARE, "the time") if right else verdict


def _tells_time(package: PackageFacts, run: Run, heard: Sequence[Channel]) -> bool:
    """Whether each publisher's texts end with a time that grows as it should, whatever their words are. What a script
    without a clock counts grows so at one a second."""
    for channel in heard:
        found = [_LAST_NUMBER.fullmatch(text[-SECONDS_CHARS_MAX:]) for text in channel.data]
        is_face = all(one and _HOURS.search(one.string, 0, one.start(1)) for one in found)
        if is_face or slips_of(package, run, channel.callerid, "no-clock"):
            return False
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
    pattern = message_pattern(params.template, NUMBER)
    longest = [c for c in heard if len(c.messages) >= ENOUGH]
    if not longest:
        return _too_few(package, run, heard, params) if growing(params.template) else None
    for channel in longest if SECONDS in params.template else ():
        told = [float(found["seconds"]) for text in channel.data if (found := pattern.fullmatch(text))]
        clocks = clocks_at(run, channel.times_ns)
        if not clocks:
            return grade_again("the time in the messages cannot be judged: the run's /clock was not recorded")
        own_doing = early_end(run) is not None or _watched_ns(run, heard) >= WATCHED_S * 1e9
        # What the node itself cut short is judged by as much as there is: grading again would show no more.
        short = is_flood(run) or (own_doing and clocks[0][-1] < WATCHED_S)
        if (wrong := wrong_growth(told, clocks, short=short)) is not None:
            too_few = own_doing and wrong.status is Status.INCONCLUSIVE
            wrong = _made_once(wrong, package, run, channel) if len(set(told)) == 1 else wrong
            return _too_few(package, run, heard, params) if too_few else wrong
        if (counted := _judge_counting(package, run, channel, told)) is not None:
            return counted
    return None


def _made_once(verdict: Verdict, package: PackageFacts, run: Run, channel: Channel) -> Verdict:
    """Return the verdict on a time that stays, with the line that publishes what only one above its loop made."""
    slips = slips_of(package, run, channel.callerid, "no-effect")
    slip = next((s for s in slips if "publishes" in s.message), None)
    if slip is None or verdict.status is not Status.FAIL:
        return verdict
    return verdict.explained(f"{slip.file}: {slip.message}", f"in {slip.file}, {slip.fix}", (slip.place,))


def _judge_counting(
    package: PackageFacts, run: Run, channel: Channel, told: Sequence[float]
) -> Verdict | None:
    """Return the verdict on whole numbers, each the one before plus one, of a script that reads no clock. At one a
    second they grow as the time does."""
    # A clock's first reading has a fraction, a count has none.
    if any(after - before != 1 for before, after in pairwise(told)) or told[0] != int(told[0]):
        return None
    slip = next(iter(slips_of(package, run, channel.callerid, "no-clock")), None)
    if slip is None:
        return None
    message = f"the number in the messages counts them ({told[0]:.0f}, {told[1]:.0f}, …) and is not a time"
    return failed(f"{message}: in {slip.file}, {slip.message}", hint=ASK_AGAIN, citations=(slip.place,))


def _watched_ns(run: Run, heard: Sequence[Channel]) -> int:
    return (observed_until_ns(run) or run.end_ns) - min(c.times_ns[0] for c in heard)


def _too_few(package: PackageFacts, run: Run, heard: Sequence[Channel], params: MessageParams) -> Verdict:
    """Too little came: the node's own fault where it died, or was watched long enough."""
    few = f"only {plural(sum(len(c.messages) for c in heard), 'message')} came on {params.topic}"
    timed = SECONDS in params.template
    why = f"too few to see the {'time' if timed else 'count'} grow"
    # What the recorder lost is not the node's fault.
    if losses(run, params.topic):
        return grade_again(f"{few}: {why}")
    if end := explain_early_end(package, run):
        return end.verdict(failed_or_blocked, f"{few} before the node ended ({end.cause}): {why}")
    if _watched_ns(run, heard) >= WATCHED_S * 1e9:
        return failed_or_blocked(f"{few}: {why}", hint="publish in the loop" + f"; {ASK_AGAIN}" * timed)
    return grade_again(f"{few} while it was watched: {why}")


def _wrong_count(
    package: PackageFacts, run: Run, channels: Sequence[Channel], params: MessageParams
) -> Verdict | None:
    """Return the verdict on texts whose `{count}` does not go up by one; None where each one's does, or the template
    has no such place."""
    if COUNT not in params.template:
        return None
    pattern, counter = message_pattern(params.template, NUMBER), CounterParams(topic=params.topic)
    for channel in channels:
        rows = zip(channel.data, channel.messages, strict=True)
        told = [(float(found["count"]), m) for text, m in rows if (found := pattern.fullmatch(text))]
        count = Count(
            callerid=channel.callerid,
            values=tuple(number for number, _ in told),
            times_ns=tuple(m.log_time_ns for _, m in told),
            sequences=tuple(m.sequence for _, m in told),
        )
        # A text is not bounded as a number's type is: nothing makes the count begin again.
        fall = next((s for s in count.steps if s.change < -1), None)
        if fall is not None:
            comes = f"after {significant(fall.before)} comes {significant(fall.after)}"
            return failed(
                f"the counter begins again: {comes}",
                hint="set the counter once, before the loop, and reset it nowhere",
            )
        steps = wrong_steps(count, run, maximum=NEVER, rate_hz=counter.rate_hz)
        if (verdict := judge_steps(count, steps, run, counter)) is not None:
            stays = count.usual_step() == 0
            return cite_slip(verdict, count, run, package, "no-effect", "set-in-loop") if stays else verdict
    return None
