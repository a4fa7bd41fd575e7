"""What has been seen of a run so far: pure, fed by the arena's frames."""

from __future__ import annotations

import re
from collections import defaultdict, deque
from collections.abc import Iterable, Mapping
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, field

from grader.evidence.events import UNNAMED
from grader.model.message_rate import RateBounds

ROSOUT = "/rosout"
ARRIVALS_MAX = 2000
LATEST_MAX = 100
LINES_MAX = 1000
LOG_TIME = re.compile(r"\[\d{1,12}\.\d{1,9}(?:, \d{1,12}\.\d{1,9})?\]")
"""The time in a log line of rospy's: `[WARN] [1712.512]: not yet`."""
FULL, OTHERS_MOST = 0.9, 0.75
"""Shares of the processors' time: a machine is full from the one, and others count up to the other (then all takes four
times as long)."""
BAD_CALLBACK = "bad callback: "
"""How rospy begins to log an exception that ended a callback."""


@dataclass
class TopicSeen:
    """Student's messages on one topic; times are monotonic seconds of arrival at the grader. `lost_before_s` is
    what others had taken from a full machine until the first."""

    count: int = 0
    first_s: float = 0.0
    lost_before_s: float = 0.0
    last_s: float = 0.0
    latest_s: deque[float] = field(default_factory=lambda: deque(maxlen=LATEST_MAX))
    """When the latest messages came."""


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
    """The state that conditions look at. All times are monotonic seconds at the grader."""

    # --- What is known before the run ---

    least_s: float = 0.0
    """How long nodes are watched, even where nothing more is to come."""
    naps: bool = False
    """The package's programs sleep for times of their own or have timers, which may look like `spin()` from outside."""
    endless: frozenset[str] = frozenset()
    """The processes whose script has a loop that does nothing and never ends."""
    sleeping: frozenset[str] = frozenset()
    """Those whose script has one that sleeps and no more."""
    mute: frozenset[str] = frozenset()
    """Those whose script has a publisher, and nothing in it, or in what it may import, publishes."""
    serves: frozenset[str] = frozenset()
    """The services and actions that the grader offers."""
    polled: dict[str, frozenset[str]] = field(default_factory=dict)
    """By process, the services for which its script looks in the list of all again and again."""
    unended: set[str] = field(default_factory=set)
    """The actions of the student's of which a goal got no result."""
    ends_for_newer: bool = False
    """An action's server of the package ends its goal for a newer one."""
    gives_up: bool = False
    """A program of the package ends where its wait for a service does."""
    rates: dict[str, list[RateBounds]] = field(default_factory=lambda: defaultdict(list))
    """By topic, the rates that end a window once they are clear."""

    # --- Processes and nodes ---

    running: set[str] = field(default_factory=set)
    """The student's processes; `ended` those that have ended."""
    ended: set[str] = field(default_factory=set)
    helpers: set[str] = field(default_factory=set)
    """The grader's own programs that run beside them."""
    nodes: set[str] = field(default_factory=set)
    """All nodes of the student's so far, and those of the helpers."""
    helper_nodes: set[str] = field(default_factory=set)
    here: frozenset[str] = frozenset()
    """The nodes that are registered now."""
    owners: dict[str, str] = field(default_factory=dict)
    """The processes of all nodes so far."""
    registered: set[str] = field(default_factory=set)
    """The processes of which a node has registered, and when the last one did."""
    registered_s: float = 0.0
    last_start_s: float = 0.0
    first_node_s: float = 0.0
    at_rest: dict[str, Rest] = field(default_factory=dict)

    # --- Topics and services ---

    topics: dict[str, TopicSeen] = field(default_factory=lambda: defaultdict(TopicSeen))
    opened: set[str] = field(default_factory=set)
    published: dict[str, set[str]] = field(default_factory=dict)
    """By topic, the nodes that publish on it now; `listened` those that subscribe to it."""
    listened: dict[str, set[str]] = field(default_factory=dict)
    talking: dict[str, float] = field(default_factory=dict)
    """When each node first sent a message."""
    arrivals_ns: dict[str, list[int]] = field(default_factory=dict)
    """When messages arrived, on the topics of `rates`."""
    connected_s: dict[str, float] = field(default_factory=dict)
    """The topics over which nodes are connected now, and since when."""
    all_answered_s: float = 0.0
    """When all nodes last said what they are connected to."""
    subscribers: dict[str, set[str]] = field(default_factory=dict)
    """By topic of the grader's, the nodes that have subscribed to it."""
    refused: set[str] = field(default_factory=set)
    """Topics of the grader's to which a node wanted to subscribe with another type."""
    services: set[str] = field(default_factory=set)
    sought: dict[str, set[str]] = field(default_factory=lambda: defaultdict(set))
    """By node, the services that it looked for; `missed` are those that it asked for and that were not there."""
    missed: set[tuple[str, str]] = field(default_factory=set)
    raised_s: dict[str, float] = field(default_factory=dict)
    """When a callback of a process last ended with an exception."""

    # --- What the grader sends, and hears of it ---

    sent_s: float = 0.0
    """When the grader last sent a message, called a service, set a parameter or typed; `last_sent_s`, when it sent a
    message that is to be printed."""
    last_sent_s: float = 0.0
    unheard: dict[str, re.Pattern[str]] = field(default_factory=dict)
    """Values that are to be printed and were not, and how each is found in a line."""
    last_heard_s: float = 0.0
    last_line_s: float = 0.0
    new_line_s: float = 0.0
    """When a process last printed a line that it had not printed before; `lines_seen` are those that it had."""
    lines_seen: set[int] = field(default_factory=set)
    answers_s: float = 0.0
    """Until then, the grader works on what nodes asked its services for."""

    # --- Changes ---

    unrecorded: set[tuple[str, str]] = field(default_factory=set)
    """Topics and their publishers that send more than is recorded: when such a one falls silent is not known."""
    activity_s: float = 0.0
    """When the student's processes last did anything; `news_s`, anything besides sending messages."""
    news_s: float = 0.0
    graph_changed_s: float = 0.0
    slowed_until_s: float = 0.0
    """While the clock is slowed to see whether a node follows it, nothing that pauses is at rest."""
    graph_picture: object = None
    graphs: int = 0

    # --- Waiting, and what the machine took of it ---

    started_s: float = 0.0
    waited_s: float = 0.0
    """How long steps had waited by `started_s` for what never came."""
    measured_s: float = 0.0
    lost_s: float = 0.0
    """What others took of the run's time while they filled the machine: so much longer a node is waited for. Of that,
    `lost_before_s` was gone at `started_s`, `lost_before_last_s` at `last_start_s`."""
    lost_before_s: float = 0.0
    lost_before_last_s: float = 0.0

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
        seen.latest_s.extend([now_s] * min(count, LATEST_MAX))
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
        # Only a process's first node counts: later ones do not make the run wait longer.
        if set(processes.values()) & self.running - self.registered:
            self.registered_s = now_s
            self.sought.pop(UNNAMED, None)  # what asked before may be a node now
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
        (None). One that computes or sleeps is at rest where it can have nothing else to do."""
        known = self.at_rest.pop(process, None)
        if rest is not None and (rest != "computes" or process in self.endless):
            rest = "loops" if rest == "naps" and process not in self.sleeping else rest
            # A rest goes on when its kind changes, and begins again with another program.
            same = known is not None and known.programs == programs
            since_s, lost_s = (known.since_s, known.lost_before_s) if known and same else (now_s, self.lost_s)
            self.at_rest[process] = Rest(since_s, lost_s, programs, rest)

    @property
    def shared(self) -> AbstractSet[str]:
        """The topics on which one node publishes and another one hears."""
        both = (self.published.keys() & self.listened.keys()) - {ROSOUT}
        return {topic for topic in both if len(self.published[topic] | self.listened[topic]) > 1}

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

    def note_connections(self, topics: Iterable[str], now_s: float, *, answered: bool = True) -> None:
        """Take note of the topics over which nodes are connected now, and since when. `answered` says whether all of
        them were heard: a node that is late may be connected all the same."""
        self.all_answered_s = now_s if answered else self.all_answered_s
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
        # The hash, not the line: a process may print megabytes.
        seen = hash((process, LOG_TIME.sub("", line)))
        if seen not in self.lines_seen:
            self.new_line_s = now_s
        if len(self.lines_seen) < LINES_MAX:
            self.lines_seen.add(seen)
        if BAD_CALLBACK in line:
            self.raised_s[process] = now_s
        self.note_activity(now_s)
        unheard = {value: word for value, word in self.unheard.items() if not word.search(line)}
        if len(unheard) < len(self.unheard):
            self.last_heard_s = now_s
        self.unheard = unheard
