"""When a timeline's publisher sends, and what."""

from __future__ import annotations

from itertools import cycle, islice
from typing import Any, NamedTuple

from grader.evidence import decode
from tests.support.timeline_model import CountUp, TextPattern, TopicLine

EPOCH_S = 1_700_000_000
DEFAULT_TEXT = "hello world"


class Sent(NamedTuple):
    """A message at a second of the timeline."""

    at_s: float
    data: bytes


def messages(topic: TopicLine) -> list[Sent]:
    """All that arrives, in order of sending. Raises ValueError for a value that the type cannot hold."""
    times = _times(topic, _count(topic))
    payloads = _payloads(topic, times)
    sent = [Sent(at_s, data) for at_s, data in zip(times, payloads, strict=True)]
    return [one for number, one in enumerate(sent) if number not in topic.drop]


def _count(topic: TopicLine) -> int:
    if topic.times_s is not None:
        if topic.count not in {None, len(topic.times_s)}:
            raise ValueError(f"{topic.topic}: `count` differs from the number of `times_s`")
        return len(topic.times_s)
    if topic.count is not None:
        return topic.count
    given = topic.raw if topic.raw is not None else topic.values
    return len(given) if isinstance(given, tuple) else 1


def _times(topic: TopicLine, count: int) -> list[float]:
    if topic.times_s is not None:
        return list(topic.times_s)
    pauses = {gap.before: gap.pause_s for gap in topic.gaps}
    late = {stall.at: stall.late_s for stall in topic.stalls}
    times: list[float] = []
    paused_s = 0.0
    for number in range(count):
        paused_s += pauses.get(number, 0.0)
        at_s = topic.start_s + paused_s + (number // topic.burst) * topic.burst / topic.rate_hz
        at_s += late.get(number, 0.0)
        if topic.jitter_ms:
            at_s += topic.jitter_ms[number % len(topic.jitter_ms)] / 1000
        times.append(max(at_s, times[-1] if times else 0.0))
    return times


def _payloads(topic: TopicLine, times: list[float]) -> list[bytes]:
    if topic.raw is not None:
        return [bytes.fromhex(text) for text in _repeated(topic.raw, len(times))]
    values = _values(topic, times)
    for number, value in topic.replace.items():
        if not 0 <= number < len(values):
            raise ValueError(f"{topic.topic}: `replace` names message {number}, and there are {len(values)}")
        values[number] = value
    return [decode.encode(topic.type, v if isinstance(v, dict) else {"data": v}) for v in values]


def _values(topic: TopicLine, times: list[float]) -> list[Any]:
    match topic.values:
        case CountUp() as counter:
            return list(counter.values(len(times)))
        case TextPattern(text=text):
            return [text.format(i=number, time_s=EPOCH_S + at_s) for number, at_s in enumerate(times)]
        case None:
            return [DEFAULT_TEXT if topic.type == "std_msgs/String" else {}] * len(times)
        case listed:
            return _repeated(listed, len(times))


def _repeated(values: tuple[Any, ...], count: int) -> list[Any]:
    if count and not values:
        raise ValueError("there are messages, and no values for them")
    return list(islice(cycle(values), count))
