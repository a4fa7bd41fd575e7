"""What has been seen of a run so far, and whether anything may yet come: pure, fed by the arena's frames."""

from __future__ import annotations

import math
import re
from collections import defaultdict
from collections.abc import Iterable, Mapping
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, field

from grader.model.message_rate import RateBounds
from grader.rubric.scenario import Until

ROSOUT = "/rosout"
ARRIVALS_MAX = 2000
FIRST_MESSAGE_S = Until.model_fields["first_message_s"].default
FULL, OTHERS_MOST = 0.9, 0.75
"""Shares of the processors' time: a machine is full from the one, and others count up to the other (then all takes four
times as long)."""
SPINNING_S, TALKING_S, LOOPING_S = 1.5, 2.5, 4.0
"""So long after the last change, nothing more is registered by programs that only wait for callbacks, by those that
publish already, and by others that loop."""
ANSWERING_S, RAISED_S = 1.0, 0.5
"""So long after the last message, programs that only wait for callbacks have done what they do for it (`spin()` wakes
twice a second, and one that sleeps for longer is not at rest), and where it ended in an exception."""
COMPUTING_S, IN_VAIN_S = 0.5, 0.25
BAD_CALLBACK = "bad callback: "
"""How rospy begins to log an exception that ended a callback."""
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
    are registered now, `published` and `listened` which of them publish on a topic and subscribe to it, `talking` when
    each first sent a message, `owners` the processes of all nodes so far. `lost_s` is what others took of the run's
    time while they filled the machine: so much longer a node is waited for. Of that, `lost_before_s` was gone at
    `started_s`, `lost_before_last_s` at `last_start_s`.
    `serves` are the services and actions that the grader offers, `sought` the services that nodes looked for,
    `missed` those for which they have asked; a program of the package `gives_up` where its wait for a service ends
    without it. `refused` are topics of the grader's to
    which a node wanted to subscribe with another type. Until `answers_s`, the grader works on what they asked for.
    `sent_s`: when the grader last sent a message, `last_sent_s` one that is to be printed; `raised_s`: when a callback
    of a process last ended with an exception. `waited_s`: how long steps had waited by `started_s` for what never came.
    `least_s` is how long nodes are watched, even where nothing more is to come. `naps`: the package's programs sleep
    for times of their own or have timers, which may look like `spin()` from outside. `endless`: the processes whose
    script has a loop that does nothing and never ends. `mute`: those whose script has a publisher, and nothing in it,
    or in what it may import, publishes."""

    least_s: float = 0.0
    naps: bool = False
    endless: frozenset[str] = frozenset()
    mute: frozenset[str] = frozenset()
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
    published: dict[str, set[str]] = field(default_factory=dict)
    listened: dict[str, set[str]] = field(default_factory=dict)
    raised_s: dict[str, float] = field(default_factory=dict)
    serves: frozenset[str] = frozenset()
    gives_up: bool = False
    missed: set[tuple[str, str]] = field(default_factory=set)
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
            # Where there is no room the last one moves on, so that the span of a flood stays right.
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

    @property
    def all_began_s(self) -> float:
        """When the last of the nodes that are there sent its first message; without any, when the first node came."""
        return max([self.first_node_s, *(self.talking[node] for node in self.nodes & self.talking.keys())])

    def note_lookup(self, node: str, service: str, *, is_there: bool) -> None:
        """Take note that a node asked for a service. One that is not there is sought by a node that asks again: the
        first time may be a call that it can do without."""
        if is_there or (node, service) in self.missed:
            self.sought[node].add(service)
        self.missed.add((node, service))

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

    def note_line(self, line: str, now_s: float, process: str = "") -> None:
        self.last_line_s = now_s
        if BAD_CALLBACK in line:
            self.raised_s[process] = now_s
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
    since_s, asked_s = _at_rest_since(live, now_s), max(live.last_sent_s, live.answers_s)
    if not live.talking and not live.running <= _unused(live):
        asked_s = max(asked_s, live.last_line_s)  # who counts down aloud has something to come
    return (
        since_s is not None
        and now_s > since_s + _longer(live, _patience_s(live))
        and now_s > asked_s + _longer(live, _answers_in_s(live))
    )


def all_compute(live: RunState) -> bool:
    """Return whether each of the student's processes works on and on, and changes nothing."""
    return bool(live.running) and all(computes(live, process) for process in live.running)


def is_silent(live: RunState, topics: tuple[str, ...], until: Until, now_s: float) -> bool:
    """Return whether no message is to come on these topics any more: no node has them, or those that have them do
    nothing but wait for callbacks, loop without publishing on them, or have stopped."""
    if not is_settled(live, now_s):
        return False
    seen = [live.topics[topic] for topic in topics if topic in live.topics]
    count = sum(one.count for one in seen)
    # No node has a publisher of it, and none is to register one any more.
    if not count and live.published.keys().isdisjoint(topics):
        return True
    line_s = 0.0 if live.running <= _unused(live) else live.last_line_s
    last_s = max([live.sent_s, line_s, *(one.last_s for one in seen)])
    if until.first_message_s > FIRST_MESSAGE_S or is_fed(live, now_s):
        return False  # the rubric knows that it takes long, or a node may work on what it hears
    patience_s, answer_s = _patience_s(live), _answers_in_s(live)
    loops = {process for process in live.running if live.at_rest[process].kind == "loops"}
    if live.naps or loops - _unused(live):
        patience_s = max(until.silent_s, 0.0 if count else SLOW_START * live.least_s)
        if count >= STREAM:
            gap_s = (last_s - min(one.first_s for one in seen if one.count)) / (count - 1)
            patience_s = min(patience_s, max(TALKING_S, GAPS * gap_s))
        answer_s = patience_s
    rested_s = _at_rest_since(live, now_s) or 0.0
    return now_s > max(rested_s + _longer(live, patience_s), last_s + _longer(live, answer_s))


def is_fed(live: RunState, now_s: float) -> bool:
    """Return whether messages come to the student's nodes, and end in no exception, or are to come of a simulator that
    has not begun yet."""
    if _is_awaited(live):
        return True
    fresh = {topic for topic, seen in live.topics.items() if seen.last_s and now_s < seen.last_s + SPINNING_S}
    fed = {live.owners.get(node, "") for topic in fresh for node in live.listened.get(topic, ())}
    return any(now_s >= live.raised_s.get(process, -math.inf) + SPINNING_S for process in fed)


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
        if rest is None or (owners.count(process) < rest.programs and not computes(live, process)):
            return None
    if _is_awaited(live) and any(computes(live, process) for process in live.running):
        return None
    if now_s < live.all_began_s + live.least_s:
        return None
    found = [rest for rest in rests if rest is not None]
    since_s = max(live.graph_changed_s, live.last_start_s)
    return max(since_s, *(rest.since_s for rest in found))


def computes(live: RunState, process: str) -> bool:
    """Return whether a process works on and on, and changes nothing."""
    rest = live.at_rest.get(process)
    return rest is not None and rest.kind in {"computes", "stuck"}


def _waits_in_vain(live: RunState, process: str) -> bool:
    """Return whether a process looks for a service or an action without end, and for none of those that are there."""
    nodes = {node for node in live.here if live.owners.get(node) == process}
    asked = {service for node in nodes & live.sought.keys() for service in live.sought[node]}
    goals = {t.removesuffix("/goal") for t in live.published if t.endswith("/goal")}
    goals = {action for action in goals if f"{action}/cancel" in live.published}
    served = {topic.removesuffix("/goal") for topic in live.listened if topic.endswith("/goal")}
    known, rest = live.serves | live.services | served, live.at_rest.get(process)
    if rest is None or live.gives_up or not asked | goals or known & (asked | goals):
        return False
    others = [live.at_rest.get(other) for other in live.running - {process}]
    # One of the student's own programs may yet offer it, where it does more than wait for callbacks.
    return bool(live.serves) or (
        rest.programs == 1
        and not live.naps
        and all(other is not None and other.kind == "spins" for other in others)
    )


def _unused(live: RunState) -> set[str]:
    """Return the processes that have a publisher, and nothing that uses it."""
    nodes = set().union(*(by for topic, by in live.published.items() if topic != ROSOUT))
    return {live.owners.get(node, "") for node in nodes} & live.mute


def _patience_s(live: RunState) -> float:
    """Return how long after the last change the programs, which are at rest, may yet register something."""
    talking = {live.owners.get(node) for node in live.talking} | _unused(live)
    patience = {
        "spins": LOOPING_S if live.naps else SPINNING_S,
        "computes": COMPUTING_S,
        "stuck": COMPUTING_S,
    }
    found = []
    for process in live.running:
        own_s = patience.get(live.at_rest[process].kind, LOOPING_S)
        if own_s == SPINNING_S and _raised(live, [process]):
            own_s = ANSWERING_S
        if _waits_in_vain(live, process):
            own_s = IN_VAIN_S if live.serves and not live.naps else SPINNING_S
        found.append(min(TALKING_S if process in talking else LOOPING_S, own_s))
    return max(found)


def _answers_in_s(live: RunState) -> float:
    """Return how long after a message the programs, which are at rest, may yet do something for it."""
    waits = not live.naps and all(live.at_rest[process].kind == "spins" for process in live.running)
    answering_s = RAISED_S if _raised(live, live.raised_s) else ANSWERING_S
    return min(_patience_s(live), answering_s) if waits else _patience_s(live)


def _raised(live: RunState, processes: Iterable[str]) -> bool:
    """Return whether a callback of one of these processes ended in an exception since the grader last sent a
    message."""
    sent_s = max(live.sent_s, live.last_sent_s)
    return any(live.raised_s.get(process, -math.inf) >= sent_s for process in processes)


def _longer(live: RunState, patience_s: float) -> float:
    """Return a patience that heeds what others have taken of the machine since all programs came to rest."""
    lost_s = live.lost_s - min(live.at_rest[process].lost_before_s for process in live.running)
    return patience_s + min(lost_s, LATE_MOST * patience_s)


def goes_on(live: RunState, process: str, now_s: float) -> bool:
    """Return whether a process that is at rest will not end by itself: it only waits for callbacks, or works or waits
    without end."""
    rest = live.at_rest.get(process)
    spins = rest is not None and rest.kind == "spins" and not live.naps
    endless = (spins or computes(live, process)) and not is_fed(live, now_s)
    return endless or _waits_in_vain(live, process)
