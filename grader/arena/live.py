"""What has been seen of a run so far, and whether that is enough: pure, fed by the arena's frames."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass, field

from grader.rubric.model import Until

Outcome = tuple[str, str]
HEARD_S = 2.0
"""So long after the last probe and the last line, a value that is not printed will not be."""


@dataclass
class TopicSeen:
    """Student's messages on one topic; times are monotonic seconds of arrival at the grader."""

    count: int = 0
    first_s: float = 0.0
    last_s: float = 0.0


@dataclass
class Live:
    """The state that conditions look at."""

    started_s: float = 0.0
    topics: dict[str, TopicSeen] = field(default_factory=lambda: defaultdict(TopicSeen))
    running: set[str] = field(default_factory=set)
    ended: set[str] = field(default_factory=set)
    subscribed: set[str] = field(default_factory=set)
    connected: set[str] = field(default_factory=set)
    unheard: dict[str, re.Pattern[str]] = field(default_factory=dict)
    last_sent_s: float = 0.0
    graph_changed_s: float = 0.0
    graphs: int = 0
    last_line_s: float = 0.0

    def message(self, topic: str, count: int, now_s: float) -> None:
        seen = self.topics[topic]
        seen.first_s = seen.first_s or now_s
        seen.last_s = now_s
        seen.count += count

    def sent(self, value: str, now_s: float) -> None:
        """A probe went out: its value is to be printed, as a word of its own."""
        self.last_sent_s = now_s
        self.unheard[value] = re.compile(rf"(?<![\w.-]){re.escape(value)}(?![\w.])")

    def printed(self, line: str, now_s: float) -> None:
        self.last_line_s = now_s
        self.unheard = {value: word for value, word in self.unheard.items() if not word.search(line)}


def settled(live: Live, until: Until, now_s: float) -> Outcome | None:
    """(outcome, detail) once the run has seen enough or has to give up, else None.

    `silent`: what was waited for stopped coming, or never came though the nodes were up.
    """
    if live.ended and not live.running:
        return "ended", ""
    enough = (
        _window(live, until, now_s),
        _messages(live, until),
        _connected(live, until),
        _heard(live, until, now_s),
    )
    if _waits(until):
        if all(enough):
            return "complete", ""
    elif now_s - live.started_s > until.limit_s:
        return "complete", f"watched for {until.limit_s:g} s"
    silent = _silent(live, until, now_s)
    if silent:
        return "silent", silent
    if now_s - live.started_s > until.limit_s:
        return "timeout", f"not complete after {until.limit_s:g} s"
    return None


def _waits(until: Until) -> bool:
    """Whether anything ends the run before its limit."""
    return until.window_s is not None or bool(until.messages or until.connected or until.heard)


def waiting_for(live: Live, until: Until) -> str:
    """In a few words, what the run still waits for."""
    missing = [t for t in (*until.topics, *until.messages) if not live.topics[t].count]
    if missing:
        return f"waiting for the first message on {missing[0]}"
    for topic, wanted in until.messages.items():
        if live.topics[topic].count < wanted:
            return f"{live.topics[topic].count} of {wanted} messages on {topic}"
    if not _connected(live, until):
        return f"waiting for a connection over {', '.join(until.connected)}"
    return "observing"


def next_look_s(live: Live, until: Until, now_s: float) -> float:
    """How long nothing can change by time alone."""
    looks = [live.started_s + until.limit_s, live.started_s + until.first_message_s]
    for seen in live.topics.values():
        looks += [
            seen.first_s + (until.window_s or 0),
            seen.last_s + until.silent_s,
            seen.first_s + until.silent_s,
        ]
    looks += [live.graph_changed_s + until.silent_s, max(live.last_line_s, live.last_sent_s) + HEARD_S]
    ahead = [look - now_s for look in looks if look > now_s]
    return min([*ahead, 1.0]) + 0.001


def _seen(live: Live, topics: Iterable[str]) -> list[TopicSeen]:
    return [live.topics[t] for t in topics if live.topics[t].count]


def _window(live: Live, until: Until, now_s: float) -> bool:
    if until.window_s is None:
        return True
    topics = until.topics or tuple(live.topics)
    seen = _seen(live, topics)
    if not seen:
        return False
    if len(seen) == len(topics):
        return now_s >= max(s.first_s for s in seen) + until.window_s
    return now_s >= max(s.first_s for s in seen) + max(until.window_s, until.silent_s)


def _messages(live: Live, until: Until) -> bool:
    return all(live.topics[topic].count >= count for topic, count in until.messages.items())


def _connected(live: Live, until: Until) -> bool:
    return set(until.connected) <= live.connected


def _heard(live: Live, until: Until, now_s: float) -> bool:
    if not until.heard or not live.unheard:
        return True
    return now_s > max(live.last_line_s, live.last_sent_s) + HEARD_S


def _silent(live: Live, until: Until, now_s: float) -> str:
    waited = (*until.topics, *until.messages)
    seen = [s for s in live.topics.values() if s.count]
    if waited and not seen:
        return (
            f"no message within {until.first_message_s:g} s"
            if now_s > live.started_s + until.first_message_s
            else ""
        )
    for topic, count in until.messages.items():
        last_s = live.topics[topic].last_s or min(s.first_s for s in seen)
        if live.topics[topic].count < count and now_s > last_s + until.silent_s:
            return f"no message on {topic} for {until.silent_s:g} s"
    if until.connected and live.graph_changed_s and now_s > live.graph_changed_s + until.silent_s:
        return f"the graph has not changed for {until.silent_s:g} s"
    return ""
