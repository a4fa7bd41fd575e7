"""Whether topics are there, of the right type, latched, no others than those of the lab, and connect the nodes."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Annotated

from pydantic import AfterValidator

from grader.checks.registry import Refers, check
from grader.checks.support.processes import (
    GlobalName,
    GlobalPattern,
    OnTopic,
    TypeName,
    by_copies,
    early_end,
    is_called,
    named_at,
    plain_type,
)
from grader.checks.support.text import INIT, imports, near_names, publisher, python_or_cpp, subscriber
from grader.checks.support.topics import (
    End,
    cite,
    connected_nodes,
    no_message,
    no_node,
    nodes_on,
    published_topics,
    topics_with,
)
from grader.evidence.run import Channel, Run, is_grader_node
from grader.model.message_definitions import other_fields, sound_message
from grader.model.package import PackageFacts
from grader.model.record import Record
from grader.model.verdict import Citation, Verdict, failed, inconclusive, passed
from grader.wording import join_words, plural


class TopicTypeParams(OnTopic):
    """The topic and its type."""

    type: Annotated[TypeName, Refers("message")]
    """As `rostopic info` gives it: `std_msgs/Int8`."""
    definition: Annotated[str | None, AfterValidator(sound_message)] = None
    """The handout's text of a `.msg` that students write themselves: fields, their types and their order
    have to be the same; null: only the type's name counts."""


@check("topic-type", params=TopicTypeParams, messages_only=True, heeds_losses=True)
def topic_type(package: PackageFacts, run: Run, params: TopicTypeParams) -> Verdict:
    """The topic carries the right type of message.

    What it checks
        That the node publishes messages on the topic, under exactly this name, and that they have this
        type.

    Why it matters on a robot
        Publisher and subscriber find each other by the topic's name, and both need its type. If one letter
        or the type is wrong, nothing arrives, without any error on the publisher's side.

    How it is measured
        By the type that the publisher itself gives when the recorder connects to it (and by the definition
        that it sends, if the rubric has the type's text), and by the messages that then come. A topic that
        is advertised but stays silent fails, and the report says so.

    How to fix
        `rospy.Publisher('<topic>', <Type>, queue_size=10)` with the topic and type of the handout, and
        `from std_msgs.msg import <Type>`. `rostopic list` and `rostopic info <topic>` show what is there.
    """
    channels = run.student_channels(params.topic)
    heard = [c for c in channels if c.messages]
    # Where messages came, a publisher without any does not matter.
    wrong = [c for c in heard or channels if plain_type(c.type) != plain_type(params.type)]
    if wrong:
        verdict = _wrong_type(package, run, wrong[0], params)
    elif not heard:
        verdict = no_message(package, run, params.topic, of_node=failed, kind=params.type)
    elif other := next(filter(None, (_other_definition(c, params) for c in heard)), None):
        verdict = other
    else:
        count = plural(sum(len(c.messages) for c in heard), "message")
        publishers = join_words(dict.fromkeys(c.publisher for c in heard))
        verdict = passed(f"{publishers} publishes {params.type} on {params.topic} ({count})")
    measured = join_words(f"{plain_type(c.type)} by {c.publisher}" for c in channels) or _listed_topics(run)
    expected = f"{params.type} on {params.topic}"
    return verdict.about(expected=expected, measured=measured, citations=_cite_channels(run, channels))


def _listed_topics(run: Run) -> str:
    topics = published_topics(run).items()
    return (
        f"topics: {join_words(f'{t} ({kind})' if kind else t for t, kind in topics)}"
        if topics
        else "no topic"
    )


def _wrong_type(package: PackageFacts, run: Run, channel: Channel, params: TopicTypeParams) -> Verdict:
    of_types, _, name = params.type.partition("/")
    call = publisher(params.topic, f"{name}, queue_size=10", type=f"{of_types}::{name}")
    hint = f"{imports(of_types, name, 'msg')}, then {call}"
    if name == "String" and re.fullmatch(r"std_msgs/(U?Int|Float)\d+", plain_type(channel.type)):
        hint = f"{hint}, and publish the number as text: {python_or_cpp('str(…)', 'std::to_string(…)')}"
    message = f"{channel.publisher} publishes {plain_type(channel.type)} on {params.topic}, not {params.type}"
    cited = named_at(package, run, "publisher", params.topic)
    if mixed := by_copies(package, run, params.topic, failed):
        message, hint = f"{message}: {mixed.message}", mixed.hint
    return failed(message, hint=hint, citations=cited)


def _cite_channels(run: Run, channels: tuple[Channel, ...]) -> tuple[Citation, ...]:
    times = sorted(t for c in channels for t in c.times_ns[:1] + c.times_ns[-1:])
    if times:
        return (cite(run, channels[0].topic, times[0], times[-1]),)
    return () if run.foreign else (cite(run, "/grader/graph"),)


def _other_definition(channel: Channel, params: TopicTypeParams) -> Verdict | None:
    wanted = params.definition
    differs = other_fields(params.type, channel.definition, wanted) if wanted is not None else ""
    if not differs:
        return None
    name = params.type.partition("/")[2]
    message = f"{channel.publisher} publishes another {params.type} on {params.topic}: {differs}"
    return failed(message, hint=f"give msg/{name}.msg the handout's fields, in their order, and build again")


class OnlyTopicsParams(Record):
    """The topics of the lab."""

    topics: tuple[GlobalPattern, ...]
    """The topics that may be published: full names, or the beginning of names followed by `*`:
    `/square/*`."""

    def allows(self, topic: str) -> bool:
        return any(
            topic.startswith(name[:-1]) if name.endswith("*") else topic == name for name in self.topics
        )


@check("only-topics", params=OnlyTopicsParams)
def only_topics(package: PackageFacts, run: Run, params: OnlyTopicsParams) -> Verdict:
    """No topic is published beside those of the lab.

    What it checks
        That the package's nodes publish on the topics of the handout and on no others.

    Why it matters on a robot
        Sooner or later, another node uses a topic of the same name, and then two nodes drive the same
        wheels.

    How it is measured
        By every topic that a node of the package advertises or publishes on in the run. What ROS itself
        needs (`/rosout`, `/clock`) and what a node only subscribes to does not count.

    How to fix
        Remove the `rospy.Publisher(…)` of the topic in the message, or give it the name that the handout
        asks for. `rosnode info <node>` lists what a node publishes.
    """
    published = published_topics(run)
    unexpected = [topic for topic in published if not params.allows(topic)]
    if unexpected:
        verdict = _judge_unexpected(unexpected, published, run, params)
    else:
        missing = None if published else no_node(package, run, "no topic was published")
        verdict = missing or passed("no topic besides those of the lab is published")
    expected = f"no topic besides {join_words(params.topics)}" if params.topics else "no topic at all"
    measured = verdict.measured or join_words(published) or "no topic"
    return verdict.about(expected=expected, measured=measured, citations=(cite(run, "/grader/graph"),))


def _judge_unexpected(
    unexpected: list[str], published: dict[str, str], run: Run, params: OnlyTopicsParams
) -> Verdict:
    first = unexpected[0]
    missing = [t for t in params.topics if t not in published and not t.endswith("*")]
    meant = near_names(first, missing)
    named = join_words(f"{t} ({published[t]})" if published[t] else t for t in unexpected)
    message = f"{_publisher(run, first)} publishes on {named}, which the lab does not ask for"
    return failed(message, hint=f"did you mean {meant[0]}?" if meant else f"remove the {publisher(first)}")


def _publisher(run: Run, topic: str) -> str:
    return next(iter(nodes_on(run, topic, "publishers")), "") or run.student_channels(topic)[0].callerid


class LatchedParams(OnTopic):
    """The topic."""


@check("latched", params=LatchedParams, messages_only=True, heeds_losses=True)
def latched(package: PackageFacts, run: Run, params: LatchedParams) -> Verdict:
    """The topic is latched.

    What it checks
        That every publisher of the package on the topic latches: it keeps its last message and sends it to
        each later subscriber.

    Why it matters on a robot
        A map, a goal or a status is published once. A node that is started a second later does not get it
        unless the topic is latched.

    How it is measured
        By what the publisher itself says when the recorder connects to it, once its first message has come.

    How to fix
        `rospy.Publisher('<topic>', <Type>, latch=True, queue_size=1)`, and a message on it.
        `rostopic echo <topic>`, started late, shows whether the last message still comes.
    """
    channels = [c for c in run.student_channels(params.topic) if c.messages]
    plain = [c.callerid for c in channels if not c.latching]
    what = f"it could not be seen whether {params.topic} is latched"
    if not channels:
        verdict = no_message(package, run, params.topic)
    elif plain and run.foreign:
        message = f"the recording does not say whether {params.topic} was latched"
        verdict = inconclusive(message, hint="let the grader run the package itself")
    elif plain and _ended_at_once(run, channels) and (unseen := no_node(package, run, what)):
        verdict = unseen
    elif plain:
        hint = publisher(params.topic, "…, latch=True, queue_size=1", "1, true")
        cited = named_at(package, run, "publisher", params.topic)
        hint = f"let `rospy.Publisher(…)` on line {cited[0].line} have `latch=True`" if cited else hint
        message = f"{join_words(plain)} publishes on {params.topic} without latching"
        verdict = failed(message, hint=hint, citations=cited)
    else:
        verdict = passed(f"{join_words(c.callerid for c in channels)} latches {params.topic}")
    kinds = join_words(f"{'latched' if c.latching else 'not latched'} by {c.callerid}" for c in channels)
    topic = params.topic if channels else "/grader/graph"
    expected = f"a latched publisher on {params.topic}"
    return verdict.about(expected=expected, measured=verdict.measured or kinds, citations=(cite(run, topic),))


def _ended_at_once(run: Run, channels: Sequence[Channel]) -> bool:
    """Return whether a process ended right after the first message, so that its publisher could not be asked."""
    ended = early_end(run)
    first_ns = min(one.times_ns[0] for one in channels)
    return ended is not None and 0 <= (ended.end_ns or 0) - first_ns < ASKED_NS


ASKED_NS = 1_000_000_000
"""A publisher that lives for so long has been asked."""
ENDS: tuple[End, End] = ("publishers", "subscribers")


class ConnectedParams(Record):
    """Two nodes and the topic between them."""

    topic: GlobalName
    """The topic, with its slash: `/chatter`."""
    publisher: str = ""
    """The publishing node's name; empty: any node of the package."""
    subscriber: str = ""
    """The subscribing node's name; empty: any node of the package."""

    def name(self, end: End) -> str:
        return self.publisher if end == "publishers" else self.subscriber


@check("connected", params=ConnectedParams, heeds_losses=True)
def connected(package: PackageFacts, run: Run, params: ConnectedParams) -> Verdict:
    """Two nodes are connected over a topic.

    What it checks
        That messages can go from one node to the other over the topic, not only that both name it.

    Why it matters on a robot
        A publisher on one name and a subscriber on another run side by side in perfect silence, without any
        error message.

    How it is measured
        Both nodes are asked whom they are connected to. A connection counts if both say so and the kernel
        knows of it: what one node says about itself is not enough. A node that the rubric does not name may
        have any name; the `_<digits>_<digits>` of an anonymous node does not matter.

    How to fix
        Both ends need the same topic name, with the namespace and after every `<remap>`, and the same
        message type. `rosnode info <node>` and `rqt_graph` show the connections.
    """
    fits = connected_nodes(package, run, params.topic, lambda node, end: _fits(run, node, params.name(end)))
    found = next(fits, None)
    ends = [_wanted_text(params.name(end), end) for end in ENDS]
    if found:
        verdict = passed(f"{found[0]} and {found[1]} are connected over {params.topic}")
    else:
        verdict = _apart(package, run, params)
    over = {c.topic: None for _, e in run.graph for c in e.connections if run.is_student_node(c.publisher)}
    expected = f"{ends[0]} connected to {ends[1]} over {params.topic}"
    measured = verdict.measured or (f"connections over {join_words(over)}" if over else "no connection")
    return verdict.about(expected=expected, measured=measured, citations=(cite(run, "/grader/graph"),))


def _fits(run: Run, node: str, wanted: str) -> bool:
    """Programs of other packages (`/turtlesim`) only by their name, the grader's own nodes never."""
    if is_grader_node(node):
        return False
    return is_called(node, wanted) if wanted else run.is_student_node(node)


def _apart(package: PackageFacts, run: Run, params: ConnectedParams) -> Verdict:
    lacking = [end for end in ENDS if not _on(run, params.topic, end, params)]
    # A node that is not there under its name is why no such node is on the topic.
    for end in lacking:
        if verdict := _judge_misnamed(run, end, params):
            return verdict
    if lacking:
        absent = no_node(package, run, f"nothing is connected over {params.topic}")
        return absent or _not_on_topic(run, lacking[0], params)
    first, second = (_on(run, params.topic, end, params)[0] for end in ENDS)
    if first == second:
        message = f"{first} is alone on {params.topic}: it hears only itself"
        return failed(message, hint=f"have a second node subscribe to {params.topic}")
    if absent := no_node(package, run, f"{first} and {second} were not seen connected over {params.topic}"):
        return absent
    message = f"{first} and {second} are both on {params.topic}, but not connected"
    # The run may have ended before they had found each other.
    return failed(message, hint="do both use the same message type?").if_repeated()


def _judge_misnamed(run: Run, end: End, params: ConnectedParams) -> Verdict | None:
    wanted, there = (
        params.name(end),
        [n for n in dict.fromkeys(n for _, event in run.graph for n in event.nodes) if not is_grader_node(n)],
    )
    if not wanted or not there or any(is_called(n, wanted) for n in there):
        return None
    near = near_names(f"/{wanted.lstrip('/')}", there)
    seen = join_words(near or run.student_nodes() or there)
    hint = f"the node's name is what {INIT} or the launch file gives it: {wanted.lstrip('/')}"
    return failed(f"there is no node /{wanted.lstrip('/')}; there is {seen}", hint=hint)


def _not_on_topic(run: Run, end: End, params: ConnectedParams) -> Verdict:
    wanted, does = params.name(end), "publishes on" if end == "publishers" else "subscribes to"
    who = f"/{wanted.lstrip('/')}" if wanted else "no node"
    topics = topics_with(run, end, lambda node: _fits(run, node, wanted))
    near = near_names(params.topic, topics) or topics
    message = f"{who} never {does} {params.topic}" if wanted else f"{who} {does} {params.topic}"
    call = publisher if end == "publishers" else subscriber
    hint = f"{call(params.topic)}; look for a <remap> or a namespace"
    return failed(f"{message}; it {does} {join_words(near)}" if near and wanted else message, hint=hint)


def _on(run: Run, topic: str, end: End, params: ConnectedParams) -> tuple[str, ...]:
    return nodes_on(run, topic, end, lambda node: _fits(run, node, params.name(end)))


def _wanted_text(name: str, end: End) -> str:
    return f"/{name.lstrip('/')}" if name else f"a {end.removesuffix('s')} of the package"
