"""What has been seen of a run so far, and whether that is enough: pure, fed by the arena's frames."""

from __future__ import annotations

import math
import re
from collections import defaultdict
from collections.abc import Iterable, Mapping
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, field

from grader.model.message_rate import RateBounds
from grader.rubric.scenario import Until

Outcome = tuple[str, str]
ARRIVALS_MAX = 2000
FIRST_MESSAGE_S = Until.model_fields["first_message_s"].default
HEARD_S, HEARD_LOST_S_MAX = 2.0, 6.0
CONNECTED_S = 1.0
"""So long after the last probe and the last line, a value that is not printed will not be."""
FULL, OTHERS_MOST = 0.9, 0.75
"""Shares of the processors' time: a machine is full from the one, and others count up to the other (then all takes four
times as long)."""
HEARD_AT_MOST_S = 8.0
"""So long after the last probe and the last value that was heard, whatever else is printed."""
SPINNING_S, TALKING_S, LOOPING_S = 1.5, 2.5, 4.0
"""So long after the last change, nothing more is registered by programs that only wait for callbacks, by those that
publish already, and by others that loop."""
COMPUTING_S, IN_VAIN_S = 0.5, 1.0
LATE_MOST = 0.25
"""A program at rest gets the processor when it wants it: that others fill the machine makes the wait longer by this
share of it at most."""
STREAM, GAPS = 3, 5.0
"""A topic with so many messages is one that goes on, and has stopped when it is silent for so many of its gaps."""
SLOW_START = 1.2
"""A program that loops and has not published yet is given so many times as long as a right one is watched."""


@dataclass
class TopicSeen:
    """Student's messages on one topic; times are monotonic seconds of arrival at the grader. `lost_before_s` is
    what others had taken from a full machine until the first."""

    count: int = 0
    first_s: float = 0.0
    lost_before_s: float = 0.0
    last_s: float = 0.0


@dataclass
class Rest:
    """A process whose programs have all come to rest, and how (`KINDS` in `grader/arena/ros/process_tree.py`); times
    as in `RunState`."""

    since_s: float
    lost_before_s: float
    programs: int
    kind: str


@dataclass
class RunState:
    """The state that conditions look at. `running` and `ended` are the student's processes, `helpers` the grader's own
    programs that run beside them, `registered` the processes of which a node has registered, `here` the nodes that
    are registered now, `published` their topics, `listened` those that they subscribe to, `talking` when each first
    sent a message, `owners` the processes of all nodes so far. `lost_s` is what others took of the run's time while
    they filled the machine: so much longer a node is waited for. Of that, `lost_before_s` was gone at `started_s`,
    `lost_before_last_s` at `last_start_s`.
    `serves` are the services and actions that the grader offers to programs that wait for them without end, `sought`
    the services that nodes looked for, `refused` topics of the grader's to which a node wanted to subscribe with
    another type. Until `answers_s`, the grader works on what they asked for.
    `sent_s`: when the grader last sent a message, `last_sent_s` one that is to be printed. `waited_s`: how long steps
    had waited by `started_s` for what never came. `least_s` is how long nodes are watched, even where nothing more is
    to come. `naps`: the package's programs sleep for times of their own or have timers, which may look like `spin()`
    from outside. `endless`: the processes whose script has a loop that does nothing and never ends."""

    least_s: float = 0.0
    naps: bool = False
    endless: frozenset[str] = frozenset()
    started_s: float = 0.0
    topics: dict[str, TopicSeen] = field(default_factory=lambda: defaultdict(TopicSeen))
    running: set[str] = field(default_factory=set)
    ended: set[str] = field(default_factory=set)
    helpers: set[str] = field(default_factory=set)
    nodes: set[str] = field(default_factory=set)
    helper_nodes: set[str] = field(default_factory=set)
    here: frozenset[str] = frozenset()
    owners: dict[str, str] = field(default_factory=dict)
    registered: set[str] = field(default_factory=set)
    registered_s: float = 0.0
    last_start_s: float = 0.0
    first_node_s: float = 0.0
    services: set[str] = field(default_factory=set)
    published: set[str] = field(default_factory=set)
    listened: set[str] = field(default_factory=set)
    serves: frozenset[str] = frozenset()
    sought: dict[str, set[str]] = field(default_factory=lambda: defaultdict(set))
    refused: set[str] = field(default_factory=set)
    answers_s: float = 0.0
    talking: dict[str, float] = field(default_factory=dict)
    at_rest: dict[str, Rest] = field(default_factory=dict)
    opened: set[str] = field(default_factory=set)
    activity_s: float = 0.0
    news_s: float = 0.0
    subscribers: dict[str, set[str]] = field(default_factory=dict)
    connected_s: dict[str, float] = field(default_factory=dict)
    unheard: dict[str, re.Pattern[str]] = field(default_factory=dict)
    sent_s: float = 0.0
    last_sent_s: float = 0.0
    last_heard_s: float = 0.0
    graph_changed_s: float = 0.0
    graph_picture: object = None
    graphs: int = 0
    last_line_s: float = 0.0
    measured_s: float = 0.0
    lost_s: float = 0.0
    lost_before_s: float = 0.0
    lost_before_last_s: float = 0.0
    waited_s: float = 0.0
    rates: dict[str, list[RateBounds]] = field(default_factory=lambda: defaultdict(list))
    arrivals_ns: dict[str, list[int]] = field(default_factory=dict)

    def watch_rates(self, rates: Iterable[RateBounds]) -> None:
        """Keep the arrival times of the messages by which these rates are seen."""
        for bounds in rates:
            self.rates[bounds.topic].append(bounds)
            self.arrivals_ns[bounds.topic] = []

    def note_arrivals(self, topic: str, count: int, time_ns: int) -> None:
        """Take note of a student's messages that came together. Of a flood, only the first ones and the latest are
        kept."""
        times_ns = self.arrivals_ns.get(topic)
        if times_ns is not None:
            room = ARRIVALS_MAX - len(times_ns)
            times_ns += [time_ns] * min(count, room)
            times_ns[-1] = time_ns

    def note_messages(self, topic: str, count: int, now_s: float, *, active: bool = True) -> None:
        """Take note of messages, of the student's (`active`) or of a program that runs beside."""
        seen = self.topics[topic]
        if not seen.first_s:
            seen.first_s, seen.lost_before_s = now_s, self.lost_s
        seen.last_s = now_s
        seen.count += count
        if active:
            self.activity_s = now_s

    def note_machine(self, busy: float, own: float, now_s: float) -> None:
        """Take note of how busy the machine was since the last report, `own` of it with the run's own processes."""
        if self.measured_s and busy >= FULL:
            self.lost_s += (now_s - self.measured_s) * min(busy - own, OTHERS_MOST)
        self.measured_s = now_s

    def note_activity(self, now_s: float) -> None:
        """Take note that the student's processes did something, besides sending messages."""
        self.activity_s = self.news_s = now_s

    def note_graph(
        self, nodes: Iterable[str], processes: Mapping[str, str], now_s: float, *, picture: object = None
    ) -> None:
        """Take note of the master's nodes of the student's, and of the processes that nodes belong to.

        `picture` is all that counts as a change, the nodes alone where it is None.
        """
        self.here = nodes = frozenset(nodes)
        picture = nodes if picture is None else picture
        if picture != self.graph_picture:
            self.graph_changed_s, self.graph_picture = now_s, picture
        if set(processes.values()) & self.running - self.registered:
            self.registered_s = now_s
        self.registered |= set(processes.values())
        self.owners.update(processes)
        self.helper_nodes |= {n for n in nodes if processes.get(n) in self.helpers}
        own = {n for n in nodes if n not in self.helper_nodes}
        if own - self.nodes:
            self.first_node_s = self.first_node_s or now_s
            self.note_activity(now_s)
        self.nodes |= own

    def note_rest(self, process: str, rest: str | None, programs: int, now_s: float) -> None:
        """Take note that a process with so many programs has come to rest, of one kind or another, or moves again
        (None). One that computes is at rest where it can have nothing else to do."""
        known = self.at_rest.pop(process, None)
        if rest is not None and (rest != "computes" or process in self.endless):
            same = known is not None and known.programs == programs
            since_s, lost_s = (known.since_s, known.lost_before_s) if known and same else (now_s, self.lost_s)
            self.at_rest[process] = Rest(since_s, lost_s, programs, rest)

    @property
    def subscribed(self) -> AbstractSet[str]:
        """The topics of the grader's to which a node has subscribed."""
        return self.subscribers.keys()

    def note_connections(self, topics: Iterable[str], now_s: float) -> None:
        """Take note of the topics over which nodes are connected now, and since when."""
        self.connected_s = {topic: self.connected_s.get(topic, now_s) for topic in topics}

    def note_start(self, process: str, now_s: float, *, helper: bool) -> None:
        """Take note that a process was started, for the first time or again."""
        (self.helpers if helper else self.running).add(process)
        self.ended.discard(process)
        self.registered.discard(process)
        self.at_rest.pop(process, None)
        self.last_start_s, self.lost_before_last_s = now_s, self.lost_s

    def note_exit(self, process: str, now_s: float) -> None:
        """Take note that a process has ended, and with it its subscribers."""
        self.helpers.discard(process)
        for nodes in self.subscribers.values():
            nodes.difference_update([node for node in nodes if self.owners.get(node) == process])
        self.subscribers = {topic: nodes for topic, nodes in self.subscribers.items() if nodes}
        if process in self.running:
            self.running.remove(process)
            self.ended.add(process)
            self.note_activity(now_s)

    def begin_wait(self, now_s: float, *, heeded: bool = True) -> None:
        """Start the time in which what is waited for has to come: the steps are over. Where no node subscribed to what
        they send, the time that this took was the first message's too."""
        self.waited_s = 0.0 if heeded else now_s - self.started_s
        self.started_s = self.news_s = now_s
        self.lost_before_s = self.lost_s

    def note_probe(self, value: str, now_s: float) -> None:
        """Take note that a probe went out: its value is to be printed, as a word of its own."""
        self.last_sent_s = now_s
        self.unheard[value] = re.compile(rf"(?<![\w.-]){re.escape(value)}(?![\w.])")

    def note_line(self, line: str, now_s: float) -> None:
        self.last_line_s = now_s
        self.note_activity(now_s)
        unheard = {value: word for value, word in self.unheard.items() if not word.search(line)}
        if len(unheard) < len(self.unheard):
            self.last_heard_s = now_s
        self.unheard = unheard


def is_settled(live: RunState, now_s: float) -> bool:
    """Return whether no node, topic or service is to come any more.

    Every process is there with as many nodes as it has programs, all of these have come to rest, and nothing in the
    graph has changed for a while.
    """
    since_s = _at_rest_since(live, now_s)
    return since_s is not None and now_s > since_s + _longer(live, _patience_s(live))


def computes(live: RunState) -> bool:
    """Return whether each of the student's processes works on and on, and changes nothing."""
    return bool(live.running) and all(_computes(live, process) for process in live.running)


def is_silent(live: RunState, topics: tuple[str, ...], until: Until, now_s: float) -> bool:
    """Return whether no message is to come on these topics any more: no node has them, or those that have them do
    nothing but wait for callbacks, loop without publishing on them, or have stopped."""
    if not is_settled(live, now_s):
        return False
    seen = [live.topics[topic] for topic in topics if topic in live.topics]
    count = sum(one.count for one in seen)
    if not count and live.published.isdisjoint(topics):
        return True
    last_s = max([live.sent_s, live.last_line_s, *(one.last_s for one in seen)])
    if until.first_message_s > FIRST_MESSAGE_S or _is_fed(live, now_s):
        return False  # the rubric knows that it takes long, or a node may work on what it hears
    patience_s = _patience_s(live)
    if live.naps or any(live.at_rest[process].kind == "loops" for process in live.running):
        patience_s = max(until.silent_s, 0.0 if count else SLOW_START * live.least_s)
        if count >= STREAM:
            gap_s = (last_s - min(one.first_s for one in seen if one.count)) / (count - 1)
            patience_s = min(patience_s, max(TALKING_S, GAPS * gap_s))
    return now_s > max(_at_rest_since(live, now_s) or 0.0, last_s) + _longer(live, patience_s)


def _is_fed(live: RunState, now_s: float) -> bool:
    """Return whether messages come to the student's nodes, or are to come of a simulator that has not begun yet."""
    if _is_awaited(live):
        return True
    last_s = max((live.topics[topic].last_s for topic in live.listened & live.topics.keys()), default=0.0)
    return last_s > 0 and now_s < last_s + SPINNING_S


def _is_awaited(live: RunState) -> bool:
    """Return whether a program that runs beside the student's has yet to send its first message."""
    return bool(live.helper_nodes) and not live.helper_nodes & live.talking.keys()


def _at_rest_since(live: RunState, now_s: float) -> float | None:
    """Return since when all programs have been nodes at rest and nothing has changed; None where that is not so."""
    rests = [live.at_rest.get(process) for process in live.running]
    if not rests or not live.helpers <= live.registered:
        return None
    owners = [live.owners.get(node) for node in live.here]
    for process, rest in zip(live.running, rests, strict=True):
        if rest is None or (owners.count(process) < rest.programs and not _computes(live, process)):
            return None
    if _is_awaited(live) and any(_computes(live, process) for process in live.running):
        return None
    first_s = max([live.first_node_s, *(live.talking[node] for node in live.nodes & live.talking.keys())])
    if now_s < first_s + live.least_s:
        return None
    found = [rest for rest in rests if rest is not None]
    since_s = max(live.graph_changed_s, live.last_start_s, live.last_sent_s, live.answers_s)
    since_s = max(since_s, *(rest.since_s for rest in found))
    if not live.talking:
        since_s = max(since_s, live.last_line_s)  # who counts down aloud has something to come
    return since_s


def _computes(live: RunState, process: str) -> bool:
    """Return whether a process works on and on, and changes nothing."""
    rest = live.at_rest.get(process)
    return rest is not None and rest.kind in {"computes", "stuck"}


def _waits_in_vain(live: RunState, process: str) -> bool:
    """Return whether a process looks for a service or an action, and for none of those that the grader offers."""
    nodes = {node for node in live.here if live.owners.get(node) == process}
    asked = {service for node in nodes & live.sought.keys() for service in live.sought[node]}
    goals = {t.removesuffix("/goal") for t in live.published if t.endswith("/goal")}
    goals = {action for action in goals if f"{action}/cancel" in live.published}
    known = live.serves | live.services
    return bool(live.serves) and bool(asked | goals) and known.isdisjoint(asked | goals)


def _patience_s(live: RunState) -> float:
    """Return how long after the last change the programs, which are at rest, may yet register something."""
    talking = {live.owners.get(node) for node in live.talking}
    patience = {
        "spins": LOOPING_S if live.naps else SPINNING_S,
        "computes": COMPUTING_S,
        "stuck": COMPUTING_S,
    }
    found = []
    for process in live.running:
        own_s = patience.get(live.at_rest[process].kind, LOOPING_S)
        own_s = IN_VAIN_S if _waits_in_vain(live, process) else own_s
        found.append(min(TALKING_S if process in talking else LOOPING_S, own_s))
    return max(found)


def _longer(live: RunState, patience_s: float) -> float:
    """Return a patience that heeds what others have taken of the machine since all programs came to rest."""
    lost_s = live.lost_s - min(live.at_rest[process].lost_before_s for process in live.running)
    return patience_s + min(lost_s, LATE_MOST * patience_s)


def find_outcome(live: RunState, until: Until, now_s: float) -> Outcome | None:
    """Return (outcome, detail) once the run has seen enough or has to give up, else None.

    `silent`: what was waited for stopped coming, or never came though the nodes were up.
    """
    given, until = until, _patient(live, until)
    starting = _is_starting(live, until, now_s)
    enough = (not starting, *_enough(live, until, now_s))
    if live.ended and not live.running:
        return "complete" if until.ended and all(enough) else "ended", ""
    if waits(until):
        if all(enough):
            return "complete", ""
    elif now_s - live.started_s > until.limit_s:
        return "complete", f"watched for {until.limit_s:g} s"
    silent = "" if starting else _silent(live, until, now_s) or _never(live, until, given, now_s)
    silent = silent or _in_namespaces(live, until, now_s)
    if silent:
        return "silent", silent
    if now_s - live.started_s > until.limit_s:
        return "timeout", f"not complete after {until.limit_s:g} s"
    return None


def _enough(live: RunState, until: Until, now_s: float) -> tuple[bool, ...]:
    return (
        _window(live, until, now_s),
        _messages(live, until),
        _are_connected(live, until, now_s),
        _has_heard(live, until, now_s),
        _nodes(live, until, now_s),
        _quiet(live, until, now_s),
    )


def _patient(live: RunState, until: Until) -> Until:
    """Return `until` with more patience for processes to which others left little of the machine."""
    more_s = round(live.lost_s - live.lost_before_s)
    if not more_s:
        return until
    limit_s = until.limit_s + more_s if waits(until) else until.limit_s
    return until.model_copy(update={"first_message_s": until.first_message_s + more_s, "limit_s": limit_s})


def waits(until: Until) -> bool:
    """Return whether anything ends the run before its limit."""
    lasting = (until.window_s, until.alive_s, until.quiet_s)
    seen = (until.messages, until.connected, until.heard, until.nodes, until.opened, until.ended)
    return any(seconds is not None for seconds in lasting) or any(seen)


def describe_wait(live: RunState, until: Until) -> str:
    """Return in a few words what the run still waits for."""
    missing = [t for t in (*until.topics, *until.messages) if not live.topics[t].count]
    if missing:
        return f"waiting for the first message on {missing[0]}"
    for topic, wanted in until.messages.items():
        if live.topics[topic].count < wanted:
            return f"{live.topics[topic].count} of {wanted} messages on {topic}"
    if not set(until.connected) <= set(live.connected_s):
        return f"waiting for a connection over {', '.join(until.connected)}"
    if len(live.nodes) < until.nodes:
        return f"{len(live.nodes)} of {until.nodes} nodes are up"
    return "observing"


def next_look_s(live: RunState, until: Until, now_s: float) -> float:
    """Return how long nothing can change by time alone."""
    until = _patient(live, until)
    looks = [live.started_s + until.limit_s, live.started_s + until.first_message_s]
    looks += [_starts_until_s(live, until)]
    for seen in live.topics.values():
        looks += [
            seen.first_s + (until.window_s or 0),
            seen.last_s + until.silent_s,
            seen.first_s + until.silent_s,
        ]
    looks += [live.graph_changed_s + max(until.silent_s, until.first_message_s)]
    looks += [max(live.last_line_s, live.last_sent_s) + HEARD_S]
    looks += [max(live.last_sent_s, live.last_heard_s) + HEARD_AT_MOST_S]
    looks += [live.activity_s + (until.quiet_s or 0), live.news_s + until.silent_s]
    looks += [_lived_s(live, until.alive_s or 0)]
    ahead = [look - now_s for look in looks if look > now_s]
    return min([*ahead, 1.0]) + 0.001


def _talking(live: RunState) -> list[TopicSeen]:
    """Return the topics with messages; log messages do not count, as they say nothing of what else may come."""
    return [seen for topic, seen in live.topics.items() if seen.count and topic != "/rosout"]


def _window(live: RunState, until: Until, now_s: float) -> bool:
    if until.window_s is None:
        return True
    topics = until.topics or tuple(live.topics)
    if until.topics:  # others whose rates are judged have their window too, once they are there
        topics = (
            *topics,
            *(t for t in live.rates if t not in topics and t in live.topics and live.topics[t].count),
        )
    seen = [live.topics[t] for t in topics if live.topics[t].count]
    if not seen:
        return _talks_elsewhere(live, until, now_s)
    if until.topics and _rates_are_clear(live, topics):
        return True
    if len(seen) == len(topics):
        return now_s >= max(s.first_s for s in seen) + until.window_s
    return now_s >= max(s.first_s for s in seen) + max(until.window_s, until.silent_s)


def _talks_elsewhere(live: RunState, until: Until, now_s: float) -> bool:
    """Whether the nodes have talked for so long on topics that are not waited for that no more will come of them."""
    first_s = min((seen.first_s for seen in _talking(live)), default=now_s)
    return now_s > first_s + max(until.window_s or 0, until.silent_s)


def _rates_are_clear(live: RunState, topics: tuple[str, ...]) -> bool:
    """Return whether each topic is there to show a rate, and its rate is known well enough."""
    return bool(topics) and all(
        topic in live.rates
        and all(bounds.decided_by(live.arrivals_ns[topic]) for bounds in live.rates[topic])
        for topic in topics
    )


def _messages(live: RunState, until: Until) -> bool:
    return all(live.topics[topic].count >= count for topic, count in until.messages.items())


def _are_connected(live: RunState, until: Until, now_s: float) -> bool:
    """Return whether the nodes have been connected for so long that one which dies as soon as it is up would
    have died."""
    since = [live.connected_s.get(topic, now_s) for topic in until.connected]
    return all(now_s >= one_s + CONNECTED_S for one_s in since)


def _nodes(live: RunState, until: Until, now_s: float) -> bool:
    """Return whether what is waited for is there or gone: nodes, opened programs, processes that ended."""
    alive = until.alive_s is None or now_s >= _lived_s(live, until.alive_s)
    up = len(live.nodes) >= until.nodes and set(until.opened) <= live.opened
    return alive and up and set(until.ended) <= live.ended


def _lived_s(live: RunState, alive_s: float) -> float:
    """Return when the nodes have been up for so long, the last process's for half of it."""
    return max(live.first_node_s + alive_s, live.registered_s + alive_s / 2) if live.nodes else math.inf


def _quiet(live: RunState, until: Until, now_s: float) -> bool:
    return until.quiet_s is None or (live.activity_s > 0 and now_s >= live.activity_s + until.quiet_s)


def _has_heard(live: RunState, until: Until, now_s: float) -> bool:
    if not until.heard or not live.unheard or is_settled(live, now_s):
        return True
    lost_s = min(live.lost_s, HEARD_LOST_S_MAX)
    news_s = max(live.last_sent_s, live.last_heard_s)
    return now_s > min(max(live.last_line_s, news_s) + HEARD_S, news_s + HEARD_AT_MOST_S) + lost_s


def _is_starting(live: RunState, until: Until, now_s: float) -> bool:
    """Return whether a process may yet become a node: on a busy machine, its imports alone can take many seconds."""
    waited_for = {p for p in live.running - live.registered if not _computes(live, p)}
    return bool(waited_for) and now_s <= _starts_until_s(live, until)


def _starts_until_s(live: RunState, until: Until) -> float:
    return live.last_start_s + until.silent_s + live.lost_s - live.lost_before_last_s


def _silent(live: RunState, until: Until, now_s: float) -> str:
    waited = (*until.topics, *until.messages)
    seen = _talking(live)
    if waited and not seen:
        return (
            f"no message within {until.first_message_s:g} s"
            if now_s > live.started_s + until.first_message_s - live.waited_s
            else ""
        )
    for topic, count in until.messages.items():
        last_s = max(live.topics[topic].last_s or min(s.first_s for s in seen), live.started_s)
        if live.topics[topic].count < count and now_s > last_s + until.silent_s:
            return f"no message on {topic} for {until.silent_s:g} s"
    patience_s = max(until.silent_s, until.first_message_s)
    changed_s = live.graph_changed_s and max(live.graph_changed_s, live.started_s)
    if until.connected and changed_s and now_s > changed_s + patience_s:
        return f"the graph has not changed for {patience_s:g} s"
    return _standstill(live, until, now_s)


def _never(live: RunState, until: Until, given: Until, now_s: float) -> str:
    """Return what is waited for and cannot come, and all the rest has been seen; else "". `given` is `until` as the
    rubric has it."""
    if not is_settled(live, now_s):
        return ""
    waited = [t for t in until.topics if not live.topics[t].count]
    waited += [t for t, wanted in until.messages.items() if live.topics[t].count < wanted]
    absent = {topic for topic in waited if is_silent(live, (topic,), given, now_s)}
    absent |= {topic for topic in until.connected if topic not in live.connected_s}
    topics = tuple(topic for topic in until.topics if topic not in absent)
    possible = {
        "window_s": until.window_s if topics else None,
        "topics": topics,
        "messages": {topic: count for topic, count in until.messages.items() if topic not in absent},
        "connected": tuple(topic for topic in until.connected if topic not in absent),
        "nodes": min(until.nodes, len(live.nodes)),
        "ended": tuple(process for process in until.ended if not _goes_on(live, process, now_s)),
    }
    if all(_enough(live, until.model_copy(update=possible), now_s)):
        missing = min(absent, default="")
        return f"the graph has settled, without {missing}" if missing else "the graph has settled"
    return ""


def _goes_on(live: RunState, process: str, now_s: float) -> bool:
    """Return whether a process that is at rest will not end by itself: it only waits for callbacks, or works or waits
    without end."""
    rest = live.at_rest.get(process)
    spins = rest is not None and rest.kind == "spins" and not live.naps
    endless = (spins or _computes(live, process)) and not _is_fed(live, now_s)
    return endless or _waits_in_vain(live, process)


def _in_namespaces(live: RunState, until: Until, now_s: float) -> str:
    """Return that all nodes are up and connected over topics of these names in namespaces, as long as it would take
    outside of them; else ""."""
    rests = [(process, live.at_rest.get(process)) for process in live.running]
    owners = [live.owners.get(node) for node in live.here]
    if not rests or any(rest is None or owners.count(process) < rest.programs for process, rest in rests):
        return ""
    for topic in until.connected:
        since = [at_s for name, at_s in live.connected_s.items() if name != topic and name.endswith(topic)]
        if topic in live.connected_s or not since or now_s < max(since) + CONNECTED_S:
            return ""
    others = until.model_copy(update={"connected": ()})
    if until.connected and all(_enough(live, others, now_s)):
        return f"the nodes are connected over {until.connected[0]} of a namespace"
    return ""


def _standstill(live: RunState, until: Until, now_s: float) -> str:
    """Nothing happens any more, though more nodes, programs or ends were waited for."""
    growing_up = live.nodes and now_s < _lived_s(live, until.alive_s or 0)
    if growing_up or _nodes(live, until, now_s):
        return ""
    patience_s = until.silent_s if live.nodes else max(until.silent_s, until.first_message_s)
    if now_s > max(live.news_s, live.started_s) + patience_s:
        return f"nothing happened for {patience_s:g} s"
    return ""
