"""Whether a topic is there and carries what it should."""

from __future__ import annotations

from grader.checks.registry import check
from grader.checks.support.exit_causes import explain_end
from grader.checks.support.nodes import GlobalName, plain_type
from grader.checks.support.processes import early_end
from grader.checks.support.text import listed, near_names, plural
from grader.checks.support.topics import SYSTEM_TOPICS, all_lost, no_message, no_node, published_topics
from grader.evidence.run import Channel, Run
from grader.model.package import PackageFacts
from grader.model.record import Record
from grader.model.verdict import EvidenceCitation, Verdict, failed, inconclusive, passed, unjudged


class TopicTypeParams(Record):
    """`topic` with its slash, `type` as `rostopic info` gives it (`std_msgs/Int8`)."""

    topic: str
    type: str


@check("topic-type", params=TopicTypeParams, messages_only=True, heeds_losses=True)
def topic_type(package: PackageFacts, run: Run, params: TopicTypeParams) -> Verdict:
    """The topic carries the right type of message.

    What it checks
        That the node publishes messages on the topic, under exactly this name, and that they have this
        type.

    Why it matters on a robot
        Publisher and subscriber find each other by the topic's name and agree by its type. One letter or
        one type off, and nothing arrives, without any error on the publisher's side.

    How it is measured
        By the type that the publisher itself gives when the recorder connects to it, and by the messages
        that then come. A topic that is advertised but stays silent fails with a message of its own.

    How to fix
        `rospy.Publisher('<topic>', <Type>, queue_size=10)` with the topic and type of the handout, and
        `from std_msgs.msg import <Type>`. `rostopic list` and `rostopic info <topic>` show what is there.
    """
    channels = run.student_channels(params.topic)
    heard = [c for c in channels if c.messages]
    wrong = [c for c in heard or channels if plain_type(c.type) != plain_type(params.type)]
    if wrong:
        verdict = _wrong_type(wrong[0], params)
    elif not heard:
        silent = _not_recorded(run, params.topic) if run.foreign else _silent(package, run, params)
        verdict = all_lost(run, params.topic) or silent
    else:
        count = sum(len(c.messages) for c in heard)
        publishers = listed(dict.fromkeys(c.publisher for c in heard))
        verdict = passed(
            f"{publishers} publishes {params.type} on {params.topic} ({plural(count, 'message')})"
        )
    expected = f"{params.type} on {params.topic}"
    measured = listed(f"{plain_type(c.type)} by {c.publisher}" for c in channels) or _listed_topics(run)
    return verdict.about(expected=expected, measured=measured, citations=_cite(run, channels))


def _student_topics(run: Run) -> dict[str, str]:
    """Topics that the student's nodes publish on, with their types; those of every ROS system left out."""
    return {c.topic: plain_type(c.type) for c in run.student_channels() if c.topic not in SYSTEM_TOPICS}


def _listed_topics(run: Run) -> str:
    topics = _student_topics(run)
    return f"topics: {listed(f'{t} ({k})' for t, k in topics.items())}" if topics else "no topic"


def _wrong_type(channel: Channel, params: TopicTypeParams) -> Verdict:
    package, _, name = params.type.partition("/")
    hint = f"from {package}.msg import {name}, then rospy.Publisher('{params.topic}', {name}, queue_size=10)"
    message = f"{channel.publisher} publishes {plain_type(channel.type)} on {params.topic}, not {params.type}"
    return failed(message, hint=hint)


def _silent(package: PackageFacts, run: Run, params: TopicTypeParams) -> Verdict:
    """No message came: a slip in the name, the node's early end, the recorder, or its own silence."""
    advertised = bool(run.student_channels(params.topic))
    others = _student_topics(run)
    near = near_names(params.topic, others)
    if near and not advertised:
        message = f"there is no {params.topic}; the node publishes on {listed(near)}"
        return failed(message, hint=f"name the topic {params.topic} in rospy.Publisher(…)")
    ended = early_end(run)
    if ended is not None:
        end = explain_end(ended, run, package)
        return unjudged(f"nothing came on {params.topic}: the node ended before ({end.cause})", hint=end.hint)
    refused = [e for _, e in run.recorder if e.topic == params.topic and e.event in {"refused", "invalid"}]
    if refused and not advertised:
        message = f"the recorder could not listen to {params.topic}: {refused[0].detail or refused[0].event}"
        return inconclusive(message, hint="grade again")
    if advertised:
        message = f"{params.topic} is advertised, but no message ever came"
        return failed(message, hint="call publish(…) inside the loop `while not rospy.is_shutdown():`")
    if not run.student_nodes():
        hint = f"run the node, and look at rostopic info {params.topic}"
        return unjudged(f"nothing came on {params.topic}: no node was there to publish", hint=hint)
    message = f"no node publishes on {params.topic}"
    only = f"it publishes on {listed(others)}; " if others else ""
    return failed(message, hint=f"{only}add rospy.Publisher('{params.topic}', …) and publish in the loop")


def _not_recorded(run: Run, topic: str) -> Verdict:
    """Another tool's recording does not tell whether the topic was silent or only not recorded."""
    near = near_names(topic, _student_topics(run))
    instead = f"; {listed(near)} is" if near else ""
    hint = f"publish on {topic} while you record, and record it: rosbag record {topic}, or -a for all topics"
    return unjudged(f"{topic} is not in {run.evidence}{instead}", hint=hint)


def _cite(run: Run, channels: tuple[Channel, ...]) -> tuple[EvidenceCitation, ...]:
    times = sorted(t for c in channels for t in c.times_ns[:1] + c.times_ns[-1:])
    if not times:
        graph = EvidenceCitation(evidence=run.evidence, topic="/grader/graph")
        return () if run.foreign else (graph,)
    cite = EvidenceCitation(evidence=run.evidence, topic=channels[0].topic, from_ns=times[0], to_ns=times[-1])
    return (cite,)


class OnlyTopicsParams(Record):
    """`topics` that may be published: full names, or the beginning of names with `*` after it (`/square/*`)."""

    topics: tuple[GlobalName, ...]

    def allows(self, topic: str) -> bool:
        return any(
            topic.startswith(name[:-1]) if name.endswith("*") else topic == name for name in self.topics
        )


@check("only-topics", params=OnlyTopicsParams)
def only_topics(package: PackageFacts, run: Run, params: OnlyTopicsParams) -> Verdict:
    """No topic is published beside those of the lab.

    What it checks
        That the package's nodes publish on the topics of the handout and on no other one.

    Why it matters on a robot
        A topic that nobody expects meets one of the same name sooner or later, and then two nodes drive the
        same wheels.

    How it is measured
        By every topic that a node of the package advertises or publishes on in the run. What ROS itself
        needs (`/rosout`, `/clock`) and what a node only subscribes to does not count.

    How to fix
        Remove the `rospy.Publisher(…)` of the topic that is named, or give it the name that the handout
        asks for. `rosnode info <node>` lists what a node publishes.
    """
    published = published_topics(run)
    unexpected = [topic for topic in published if not params.allows(topic)]
    if unexpected:
        verdict = _unexpected(unexpected, published, run, params)
    else:
        missing = None if published else no_node(package, run, "no topic was published")
        verdict = missing or passed("no topic beside those of the lab is published")
    return verdict.about(
        expected=f"no topic beside {listed(params.topics)}" if params.topics else "no topic at all",
        measured=verdict.measured or listed(published) or "no topic",
        citations=(
            *verdict.citations,
            EvidenceCitation(evidence=run.evidence, topic="/grader/graph"),
        ),
    )


def _unexpected(
    unexpected: list[str], published: dict[str, str], run: Run, params: OnlyTopicsParams
) -> Verdict:
    first = unexpected[0]
    missing = [t for t in params.topics if t not in published and not t.endswith("*")]
    meant = near_names(first, missing)
    named = listed(f"{t} ({plain_type(published[t])})" if published[t] else t for t in unexpected)
    message = f"{_publisher(run, first)} publishes on {named}, which the lab does not ask for"
    hint = f"did you mean {meant[0]}?" if meant else f"remove the rospy.Publisher('{first}', …)"
    return failed(message, hint=hint)


def _publisher(run: Run, topic: str) -> str:
    by_graph = (n for _, e in run.graph for n in e.publishers.get(topic, ()) if run.is_student_node(n))
    return next(by_graph, None) or run.student_channels(topic)[0].callerid


class LatchedParams(Record):
    """`topic` with its slash."""

    topic: GlobalName


@check("latched", params=LatchedParams, messages_only=True, heeds_losses=True)
def latched(package: PackageFacts, run: Run, params: LatchedParams) -> Verdict:
    """The topic is latched.

    What it checks
        That every publisher of the package on the topic latches: it keeps its last message and hands it to
        each subscriber that comes later.

    Why it matters on a robot
        A map, a goal or a status is published once. A node that is started a second later hears nothing of
        it, unless the topic is latched.

    How it is measured
        By what the publisher itself says when the recorder connects to it, once its first message came.

    How to fix
        `rospy.Publisher('<topic>', <Type>, latch=True, queue_size=1)`, and a message on it.
        `rostopic echo <topic>`, started late, shows whether the last message still comes.
    """
    channels = [c for c in run.student_channels(params.topic) if c.messages]
    plain = [c.callerid for c in channels if not c.latching]
    if not channels:
        verdict = no_message(package, run, params.topic)
    elif plain and run.foreign:
        message = f"the recording does not say whether {params.topic} was latched"
        verdict = inconclusive(message, hint="let the grader run the package itself")
    elif plain:
        hint = f"rospy.Publisher('{params.topic}', …, latch=True, queue_size=1)"
        verdict = failed(f"{listed(plain)} publishes on {params.topic} without latching", hint=hint)
    else:
        verdict = passed(f"{listed(c.callerid for c in channels)} latches {params.topic}")
    kinds = listed(f"{'latched' if c.latching else 'not latched'} by {c.callerid}" for c in channels)
    topic = params.topic if channels else "/grader/graph"
    return verdict.about(
        expected=f"a latched publisher on {params.topic}",
        measured=verdict.measured or kinds,
        citations=(*verdict.citations, EvidenceCitation(evidence=run.evidence, topic=topic)),
    )
