"""Whether messages say what they should, tell the time, and keep within bounds."""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import pairwise
from typing import Annotated

from pydantic import Field

from grader.checks.registry import check
from grader.checks.support.clocks import ASK_AGAIN, WATCHED_S, clocks_at, wrong_growth
from grader.checks.support.exit_causes import explain_early_end
from grader.checks.support.idioms import both
from grader.checks.support.nodes import PublishedTopic
from grader.checks.support.processes import early_end, is_flood, observed_until_ns, slips_of
from grader.checks.support.text import (
    NUMBER,
    OTHER_WORDS_SHARE,
    SECONDS,
    in_one_line,
    in_words,
    message_pattern,
)
from grader.checks.support.topics import cite, losses, no_message
from grader.evidence.run import Channel, Run
from grader.model.package import PackageFacts
from grader.model.record import Record
from grader.model.verdict import FileCitation, Verdict, failed, inconclusive, partial, passed, unjudged
from grader.wording import plural

ENOUGH = 3
_LAST_NUMBER = re.compile(rf".*?({NUMBER})\D*", re.DOTALL)
SECONDS_CHARS_MAX = 60
TIMED = both(" % rospy.get_time()", " with ros::Time::now().toSec() for %s")
UNFILLED = ("%s", "%d", "%f", "{}", "{0}")


class MessageParams(Record):
    """The text of each message."""

    topic: PublishedTopic
    """The topic, with its slash: `/chatter`."""
    template: Annotated[str, Field(min_length=1)]
    """The whole text, `{seconds}` in it being a time that grows: `hello world {seconds}`."""


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
        stays the same will not, and neither will one that counts the messages in a script that reads no
        clock, though at 1 Hz it grows as the time does. A right time in other words than the handout's earns half.

    How to fix
        Build the text each time around the loop: `"hello world %s" % rospy.get_time()`. `rostopic echo
        <topic>` shows what is sent.
    """
    heard = [c for c in run.student_channels(params.topic) if c.messages]
    grows = ", with seconds that count up like the clock" if SECONDS in params.template else ""
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
        message = f"{params.topic} carries {heard[0].type}, not text that could be compared"
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
    value = TIMED if SECONDS in params.template else ""
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
        counted = _counted(package, run, channel, told)
        if counted is not None:
            return counted
    return None


def _counted(package: PackageFacts, run: Run, channel: Channel, told: Sequence[float]) -> Verdict | None:
    """Return the verdict on whole numbers, each the one before plus one, of a script that reads no clock. At one a
    second they grow as the time does."""
    if any(after - before != 1 for before, after in pairwise(told)) or told[0] != int(told[0]):
        return None
    slip = next(iter(slips_of(package, run, channel.callerid, "no-clock")), None)
    if slip is None:
        return None
    message = f"the number in the messages counts them ({told[0]:.0f}, {told[1]:.0f}, …) and is not a time"
    place = FileCitation(file=slip.file, line=slip.line)
    return failed(f"{message}: {slip.file} reads no clock", hint=ASK_AGAIN, citations=(place,))


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
        return unjudged(f"{few}: too few to see the time grow", hint=f"publish in the loop; {ASK_AGAIN}")
    return inconclusive(f"{few} while it was watched: too few to see the time grow", hint="grade again")
