"""What a recorded run shows of one node or launch file, as plain records: pure."""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import pairwise
from statistics import median

from grader.checks.support.console_output import printed_lines, probes_on
from grader.checks.support.processes import lives
from grader.checks.support.topics import SYSTEM_TOPICS
from grader.evidence.inspect import periodic_share, rate_stats
from grader.evidence.run import Channel, Run
from grader.model.record import Record

SYSTEM_SERVICES = ("/get_loggers", "/set_logger_level")
INTEGER_TYPES = frozenset(f"std_msgs/{u}Int{bits}" for u in ("", "U") for bits in (8, 16, 32, 64))
ANONYMOUS = re.compile(r"_\d+_\d{9,}$")
MESSAGES_MIN = 5
INFO = 2
PERIODIC_SHARE = 0.9
NICE_HZ = (
    0.1, 0.2, 0.25, 0.5, 1, 2, 2.5, 3, 4, 5, 8, 10, 12, 15, 16, 20, 24, 25, 30, 40, 50, 60, 75, 80, 100
)  # fmt: skip
NICE_WITHIN = 0.03
_LEADING = re.compile(r"^\W+")
_TIME = re.compile(r"(?P<words>.*?)(?P<seconds>\d+(?:\.\d+)?)")


EARLY_NS = 20_000_000
"""So much earlier an answer may arrive than the arena has noted what it sent."""


class Topic(Record):
    """One published topic, `silent` where no message came on it. `rate_hz` is None where it is not periodic.

    `counts_from` is the first value of a counter, None where it does not count. `template` is the text of messages that
    tell the time, with `{seconds}`.
    """

    name: str
    type: str
    rate_hz: float | None = None
    latched: bool = False
    silent: bool = False
    counts_from: int | None = None
    template: str = ""


class Observed(Record):
    """One run. `nodes` are base names without slash, `anonymous` whether they carry rospy's numbers.

    `listens` maps topics to types, `services` names to types, `connected` are topics over which two of its nodes are
    connected, `logged` are the lines without numbers that it logs at INFO, `read` the names of the parameters whose
    made-up values it prints. `ended` tells that the process ended by itself, `failed` why, where that was an error.
    """

    nodes: tuple[str, ...]
    anonymous: bool
    topics: tuple[Topic, ...]
    listens: dict[str, str]
    services: dict[str, str]
    connected: tuple[str, ...]
    ended: bool
    failed: str = ""
    logged: tuple[str, ...] = ()
    read: tuple[str, ...] = ()


def observe(run: Run) -> Observed:
    """What the run shows of the student's nodes."""
    names = [n.lstrip("/") for n in run.student_nodes()]
    early = [one for one in lives(run) if one.ended_early]
    bad = next((one for one in early if one.end and one.end.exit_code != 0), None)
    return Observed(
        nodes=tuple(dict.fromkeys(ANONYMOUS.sub("", n) for n in names)),
        anonymous=bool(names) and all(ANONYMOUS.search(n) for n in names),
        topics=tuple(_topic(c) for c in run.student_channels() if c.topic not in SYSTEM_TOPICS),
        listens=_listens(run),
        services=_services(run),
        connected=_connected_topics(run),
        ended=bool(early),
        failed=_last_words(run) if bad else "",
        logged=_logged_texts(run),
        read=_read(run),
    )


def wraps_of(run: Run, topic: str) -> tuple[int, int] | None:
    """The (last, first) values around a counter's wrap; None where it never wrapped, or differently each time."""
    values = [v for c in run.student_channels(topic) for v in c.data if isinstance(v, int)]
    found = {(a, b) for a, b in pairwise(values) if b != a + 1}
    return next(iter(found)) if len(found) == 1 and next(iter(found))[1] < next(iter(found))[0] else None


def heard_template(run: Run, topic: str) -> str | None:
    """What the lines say around the messages (`I heard {value}`); None where they are not all printed."""
    lines = printed_lines(run)
    prefixes = set()
    for probe in probes_on(run, topic):
        found = [line.text for line in lines if line.at_ns >= probe.at_ns and str(probe.value) in line.text]
        if not found:
            return None
        prefixes.add(_LEADING.sub("", found[0].partition(str(probe.value))[0]).strip())
    words = prefixes.pop() if len(prefixes) == 1 else ""
    return f"{words} {{value}}".strip() if words and not re.search(r"\d", words) else "{value}"


def answers_to(run: Run, topic: str, within_s: float) -> tuple[str, ...]:
    """Return the topics on which a message of the student's follows each one that the grader sent on `topic`."""
    sent = [t - EARLY_NS for t, e in run.actors if e.action == "publish" and e.topic == topic]
    found = []
    for channel in run.student_channels():
        ends = [*sent[1:], sent[-1] + round(within_s * 1e9)] if sent else []
        answered = [
            any(begin <= t < end for t in channel.times_ns) for begin, end in zip(sent, ends, strict=True)
        ]
        if answered and all(answered) and channel.topic not in SYSTEM_TOPICS:
            found.append(channel.topic)
    return tuple(dict.fromkeys(found))


def _topic(channel: Channel) -> Topic:
    values = channel.data
    return Topic(
        name=channel.topic,
        type=channel.type.replace("/msg/", "/"),
        rate_hz=nice_rate(channel.times_ns),
        latched=channel.latching,
        silent=not channel.times_ns,
        counts_from=_counts_from(values) if channel.type.replace("/msg/", "/") in INTEGER_TYPES else None,
        template=_template(values, channel.times_ns),
    )


def nice_rate(times_ns: Sequence[int]) -> float | None:
    """Return the rate in Hz as an author would write it; None for what is not periodic."""
    stats = rate_stats(times_ns)
    if stats.mean_hz is None or stats.count < MESSAGES_MIN:
        return None
    gaps = [later - earlier for earlier, later in pairwise(sorted(times_ns))]
    if periodic_share(gaps, median(gaps) or 1) < PERIODIC_SHARE:
        return None
    nearest = min(NICE_HZ, key=lambda hz: abs(hz - stats.mean_hz) / hz)  # type: ignore[operator]
    return (
        float(nearest) if abs(nearest - stats.mean_hz) / nearest <= NICE_WITHIN else round(stats.mean_hz, 1)
    )


def _counts_from(values: Sequence[object]) -> int | None:
    numbers = [v for v in values if isinstance(v, int) and not isinstance(v, bool)]
    steps = [b - a for a, b in pairwise(numbers)]
    counting = len(numbers) >= MESSAGES_MIN and steps.count(1) >= 0.9 * len(steps)
    return numbers[0] if counting else None


def _template(values: Sequence[object], times_ns: Sequence[int]) -> str:
    """`hello world {seconds}` for texts that end in a time which grows as the clock does."""
    found = [_TIME.fullmatch(v) if isinstance(v, str) else None for v in values]
    matches = [m for m in found if m is not None]
    if len(matches) < MESSAGES_MIN or len(matches) < len(found) or len({m["words"] for m in matches}) > 1:
        return ""
    grown_s = float(matches[-1]["seconds"]) - float(matches[0]["seconds"])
    passed_s = (times_ns[-1] - times_ns[0]) / 1e9
    return matches[0]["words"] + "{seconds}" if abs(grown_s - passed_s) < 0.05 * passed_s + 1 else ""


def _listens(run: Run) -> dict[str, str]:
    found: dict[str, str] = {}
    for _, event in run.graph:
        for topic, nodes in event.subscribers.items():
            if topic not in SYSTEM_TOPICS and any(map(run.is_student_node, nodes)):
                found[topic] = event.topic_types.get(topic, "").replace("/msg/", "/")
    return found


def _services(run: Run) -> dict[str, str]:
    found: dict[str, str] = {}
    for _, event in run.graph:
        for name, nodes in event.services.items():
            if not name.endswith(SYSTEM_SERVICES) and any(map(run.is_student_node, nodes)):
                found[name] = event.service_types.get(name, found.get(name, ""))
    return found


def _connected_topics(run: Run) -> tuple[str, ...]:
    found = (
        c.topic
        for _, event in run.graph
        for c in event.connections
        if c.topic not in SYSTEM_TOPICS
        and run.is_student_node(c.publisher)
        and run.is_student_node(c.subscriber)
    )
    return tuple(dict.fromkeys(found))


def _logged_texts(run: Run) -> tuple[str, ...]:
    values = (v for c in run.student_channels("/rosout") for v in c.values if isinstance(v, dict))
    made_up = {str(e.value) for _, e in run.actors if e.action == "param"}
    texts = [str(v.get("msg", "")).strip() for v in values if v.get("level") == INFO]
    plain = (t for t in texts if t and not re.search(r"\d", t) and not any(m in t for m in made_up))
    return tuple(dict.fromkeys(plain))


def _read(run: Run) -> tuple[str, ...]:
    text = "\n".join(line.text for line in printed_lines(run))
    set_ = [(str(e.topic), e.value) for _, e in run.actors if e.action == "param"]
    return tuple(name for name, value in set_ if not isinstance(value, bool | list) and str(value) in text)


def _last_words(run: Run) -> str:
    lines = [line.line for _, line in run.console if line.line.strip()]
    return lines[-1] if lines else "it ended with an error"
