"""Whether messages carry the time at which they were sent."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from typing import Annotated, Any, NamedTuple

from pydantic import Field

from grader.checks.registry import check
from grader.checks.support.clocks import NEVER_LATE_S, clock_slack_s, excused, no_clock, ros_seconds
from grader.checks.support.fields import FieldPath, no_field, readings
from grader.checks.support.processes import PublishedTopic
from grader.checks.support.text import NOW, python_or_cpp, shown
from grader.checks.support.topics import cite, no_message
from grader.evidence.run import Channel, Run
from grader.model.package import PackageFacts
from grader.model.record import Record
from grader.model.verdict import Verdict, failed, failed_or_blocked, passed
from grader.wording import join_words, plural, significant

THREADS_S = 0.005
"""Two threads may send in another order than they asked for the time."""
FEW = 3
"""So many stamps may be whole seconds by chance, or by a period of one second."""


class StampsParams(Record):
    """Where the stamp is, and how near it has to be to the time at which its message came."""

    topic: PublishedTopic
    """The topic, with its slash: `/reading`."""
    field: FieldPath = "header"
    """A `std_msgs/Header` of the message, or a field of the type `time`: `header`, `scan.header`, `sent_at`."""
    within_s: Annotated[float, Field(gt=0)] = 0.2
    """How far a stamp may be from the time at which its message came, in seconds of the run's clock. With a fast clock,
    a step of it and 0.02 s of the wall are added.
    """
    frame_id: str | None = None
    """The header's `frame_id`, if the handout asks for one."""


class Stamp(NamedTuple):
    """A message's stamp, and the time at which it came: by ROS's clock, and by the wall's. `frame` is a header's."""

    time_ns: int
    came_s: float
    told_s: float
    whole: bool
    frame: str | None

    @property
    def age_s(self) -> float:
        return self.came_s - self.told_s


@check("stamps", params=StampsParams, messages_only=True)
def stamps(package: PackageFacts, run: Run, params: StampsParams) -> Verdict:
    """Each message carries the time at which it was sent.

    What it checks
        That the stamp of every message is the node's time when it was sent: increasing, not zero, not
        always the same, not from another clock; and that the `frame_id` is right, if the handout asks for
        one.

    Why it matters on a robot
        tf looks up where the sensor was at the time of the stamp. With a stamp of zero or an old one, a
        measurement is thrown away, or put in the wrong place.

    How it is measured
        Each stamp is compared with the time at which its message came, by the clock that the node has:
        `/clock` where `/use_sim_time` is set. `seq` does not matter. With a fast clock, stamps of zero at
        the beginning do not count: the node had not heard the clock yet.

    How to fix
        `msg.header.stamp = rospy.Time.now()` each time just before `publish(msg)`.
        `rostopic echo <topic>/header` shows the stamps.
    """
    channels = run.student_channels(params.topic)
    each = [_stamps(run, channel, params.field) for channel in channels]
    found = sorted(one for stamped in each for one in stamped)
    verdict = (
        # In this order: a stamp of zero, or always the same, is far off as well.
        _nothing_to_judge(package, run, channels, found, params)
        or _zero(found, params)
        or _constant(found, params)
        or _other_clock(run, found, params)
        # Publisher by publisher, as two may send older and newer stamps by turns.
        or next((fault for stamped in each if (fault := _backwards(stamped, params))), None)
        or _far(run, found, params)
        or _other_frame(found, params)
        or passed(f"the stamps of {plural(len(found), 'message')} on {params.topic} say when they were sent")
    )
    span = (found[0].time_ns, found[-1].time_ns) if found else (None, None)
    frame = f", frame_id '{params.frame_id}'" if params.frame_id is not None else ""
    expected = (
        f"{_name(params)} of {params.topic} within {significant(params.within_s)} s of the message{frame}"
    )
    cited = (cite(run, params.topic, *span),)
    return verdict.about(expected=expected, measured=verdict.measured or _ages(found), citations=cited)


def _name(params: StampsParams) -> str:
    return f"{params.field}.stamp" if params.field.rpartition(".")[2] == "header" else params.field


def _stamps(run: Run, channel: Channel, path: str) -> list[Stamp]:
    """Return what of one publisher's messages has a stamp, without zeros before the node heard the fast clock."""
    to_s = ros_seconds(run)
    if to_s is None:
        return []
    found = [
        Stamp(one.time_ns, to_s(one.time_ns), *_stamp_fields(value))
        for one in readings([channel], path, numbers=False)
        for value in one.values
        if _time_in(value) is not None
    ]
    first = next((n for n, one in enumerate(found) if one.told_s), 0) if run.clock == "warped" else 0
    return found[first:]


def _time_in(value: Any) -> Mapping[str, int] | None:  # noqa: ANN401 - decoded messages hold anything
    """Return the time in a header, or in a field that is one itself."""
    inner = value.get("stamp") if isinstance(value, Mapping) else None
    time = inner if isinstance(inner, Mapping) else value
    return time if isinstance(time, Mapping) and time.keys() == {"secs", "nsecs"} else None


def _stamp_fields(value: Mapping[str, Any]) -> tuple[float, bool, str | None]:
    time = _time_in(value) or {"secs": 0, "nsecs": 0}
    frame = value.get("frame_id")
    return (
        time["secs"] + time["nsecs"] / 1e9,
        time["nsecs"] == 0,
        frame if isinstance(frame, str) else None,
    )


def _now(params: StampsParams) -> str:
    items, _, name = _name(params).rpartition("[*].")
    each = f", in each of its {items}: `….{name} = {NOW}`" if items else f": msg.{name} = {NOW}"
    return f"set it just before each publish{each}"


def _nothing_to_judge(
    package: PackageFacts, run: Run, channels: Sequence[Channel], found: Sequence[Stamp], params: StampsParams
) -> Verdict | None:
    if found:
        return None
    if not any(channel.messages for channel in channels):
        return no_message(package, run, params.topic)
    if unknown := no_clock(run):
        return unknown
    read = readings(channels, params.field, numbers=False)
    if not any(one.values for one in read):
        return no_field(read[0], channels)
    kinds = join_words({channel.type for channel in channels})
    message = f"{params.field} of {params.topic} ({kinds}) is neither a header nor a time"
    verdict = failed_or_blocked(message, hint=f"make {params.field} a std_msgs/Header, or a time")
    return verdict.based_on(misfit=True)


def _zero(found: Sequence[Stamp], params: StampsParams) -> Verdict | None:
    zeros = [one for one in found if one.told_s == 0]
    if not zeros:
        return None
    count = f"in {len(zeros)} of {plural(len(found), 'message')}"
    message = f"{_name(params)} of {params.topic} is 0 {count}: it was never set"
    return failed(message, hint=_now(params), measured=f"0 {count}")


def _constant(found: Sequence[Stamp], params: StampsParams) -> Verdict | None:
    first, last = found[0], found[-1]
    if len(found) == 1 or len({one.told_s for one in found}) > 1:
        return None
    # Messages that came so close together may have one stamp.
    if last.came_s - first.came_s <= params.within_s:
        return None
    message = (
        f"{_name(params)} of {params.topic} is {first.told_s:.3f} in all of {plural(len(found), 'message')}"
    )
    return failed(f"{message}: the time was read only once", hint=_now(params))


def _other_clock(run: Run, found: Sequence[Stamp], params: StampsParams) -> Verdict | None:
    """Time of the wall in a run whose nodes live in simulated time."""
    off = [one for one in found if abs(one.age_s) > _limit_s(run, params)]
    if (
        run.clock != "warped"
        or not off
        or any(abs(one.told_s - one.time_ns / 1e9) > params.within_s for one in off)
    ):
        return None
    message = f"{_name(params)} of {params.topic} is the computer's time, and not that of /clock"
    hint = (
        f"take the time from {NOW}, which follows /clock where /use_sim_time is set; "
        f"{python_or_cpp('time.time() and datetime', 'std::chrono and time(…)')} do not"
    )
    return failed(message, hint=hint)


def _backwards(found: Sequence[Stamp], params: StampsParams) -> Verdict | None:
    falls = [(a, b) for a, b in pairwise(found) if b.told_s < a.told_s - THREADS_S]
    if not falls:
        return None
    before, after = falls[0]
    message = (
        f"{_name(params)} of {params.topic} goes back {plural(len(falls), 'time')}: at first from "
        f"{before.told_s:.3f} to {after.told_s:.3f}"
    )
    verdict = failed(message, hint=_now(params))
    # What happens again and again is no chance of one run.
    return verdict if len(falls) > len(found) // 4 else verdict.if_repeated()


def _limit_s(run: Run, params: StampsParams) -> float:
    return params.within_s + clock_slack_s(run)


def _far(run: Run, found: Sequence[Stamp], params: StampsParams) -> Verdict | None:
    limit_s = _limit_s(run, params)
    off = [one for one in found if abs(one.age_s) > limit_s]
    if not off:
        return None
    worst = max(off, key=lambda one: abs(one.age_s))
    how = "older" if worst.age_s > 0 else "later"
    count = f"in {len(off)} of {plural(len(found), 'message')}"
    message = (
        f"{_name(params)} of {params.topic} is up to {abs(worst.age_s):.2f} s {how} than the message {count}"
    )
    # A few stamps may have whole seconds by chance.
    whole = len(found) > FEW and all(one.whole for one in found)
    verdict = failed(f"{message}: it has only whole seconds" if whole else message, hint=_now(params))
    gross_s = limit_s + NEVER_LATE_S * run.warp
    # No machine is late by so much with every message.
    if whole or (len(off) == len(found) and min(abs(one.age_s) for one in off) > gross_s):
        return verdict

    half_ms = params.within_s / 2 * 1e3 / run.warp
    return excused(
        verdict.if_repeated(), run, found[0].time_ns, found[-1].time_ns, lambda late: late.reason(half_ms)
    )


def _other_frame(found: Sequence[Stamp], params: StampsParams) -> Verdict | None:
    wrong = [one for one in found if params.frame_id is not None and one.frame != params.frame_id]
    if not wrong:
        return None
    asked, seen = f"'{params.frame_id}'", wrong[0].frame
    if seen is None:
        message = f"{params.field} of {params.topic} is a plain time, without a frame_id"
        return failed(message, hint=f"make {params.field} a std_msgs/Header, frame_id {asked}")
    count = f"in {len(wrong)} of {plural(len(found), 'message')}"
    message = f"{params.field}.frame_id of {params.topic} is '{shown(seen)}', not {asked}, {count}"
    slash = "; tf2 does not accept frames that start with a slash" if seen == f"/{params.frame_id}" else ""
    right = (
        f"write {asked} in place of '{shown(seen)}'" if seen else f"set msg.{params.field}.frame_id = {asked}"
    )
    verdict = failed(message, hint=f"{right}{slash}")
    return verdict.seeking("quoted", *filter(None, [seen]))


def _ages(found: Iterable[Stamp]) -> str:
    ages = [one.age_s for one in found]
    return f"{min(ages):.2f} to {max(ages):.2f} s old" if ages else "no stamp"
