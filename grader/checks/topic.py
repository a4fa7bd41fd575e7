"""Whether a topic is there and carries what it should."""

from __future__ import annotations

from grader.checks.registry import check
from grader.checks.support.exit_cause import explain_end
from grader.checks.support.losses import all_lost
from grader.checks.support.process import early_end
from grader.checks.support.text import near_names
from grader.evidence.run import Channel, Run
from grader.model.package import PackageFacts
from grader.model.record import Record
from grader.model.verdict import EvidenceCitation, Verdict, failed, inconclusive, passed, unjudged
from grader.wording import join_words, plural

SYSTEM_TOPICS = frozenset({"/rosout", "/rosout_agg", "/clock"})


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
        publishers = join_words(dict.fromkeys(c.publisher for c in heard))
        verdict = passed(
            f"{publishers} publishes {params.type} on {params.topic} ({plural(count, 'message')})"
        )
    expected = f"{params.type} on {params.topic}"
    measured = join_words(f"{plain_type(c.type)} by {c.publisher}" for c in channels) or published_topics(run)
    return verdict.model_copy(
        update={"expected": expected, "measured": measured, "citations": _cite(run, channels)}
    )


def plain_type(name: str) -> str:
    return name.replace("/msg/", "/")


def student_topics(run: Run) -> dict[str, str]:
    """Topics that the student's nodes publish on, with their types; those of every ROS system left out."""
    return {c.topic: plain_type(c.type) for c in run.student_channels() if c.topic not in SYSTEM_TOPICS}


def published_topics(run: Run) -> str:
    topics = student_topics(run)
    return f"topics: {join_words(f'{t} ({k})' for t, k in topics.items())}" if topics else "no topic"


def _wrong_type(channel: Channel, params: TopicTypeParams) -> Verdict:
    package, _, name = params.type.partition("/")
    hint = f"from {package}.msg import {name}, then rospy.Publisher('{params.topic}', {name}, queue_size=10)"
    message = f"{channel.publisher} publishes {plain_type(channel.type)} on {params.topic}, not {params.type}"
    return failed(message, hint=hint)


def _silent(package: PackageFacts, run: Run, params: TopicTypeParams) -> Verdict:
    """No message came: a slip in the name, the node's early end, the recorder, or its own silence."""
    advertised = bool(run.student_channels(params.topic))
    others = student_topics(run)
    near = near_names(params.topic, others)
    if near and not advertised:
        message = f"there is no {params.topic}; the node publishes on {join_words(near)}"
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
    only = f"it publishes on {join_words(others)}; " if others else ""
    return failed(message, hint=f"{only}add rospy.Publisher('{params.topic}', …) and publish in the loop")


def _not_recorded(run: Run, topic: str) -> Verdict:
    """Another tool's recording does not tell whether the topic was silent or only not recorded."""
    near = near_names(topic, student_topics(run))
    instead = f"; {join_words(near)} is" if near else ""
    hint = f"publish on {topic} while you record, and record it: rosbag record {topic}, or -a for all topics"
    return unjudged(f"{topic} is not in {run.evidence}{instead}", hint=hint)


def _cite(run: Run, channels: tuple[Channel, ...]) -> tuple[EvidenceCitation, ...]:
    times = sorted(t for c in channels for t in c.times_ns[:1] + c.times_ns[-1:])
    if not times:
        graph = EvidenceCitation(evidence=run.evidence, topic="/grader/graph")
        return () if run.foreign else (graph,)
    cite = EvidenceCitation(evidence=run.evidence, topic=channels[0].topic, from_ns=times[0], to_ns=times[-1])
    return (cite,)
