"""Why what a check looks for is not there at all."""

from __future__ import annotations

from grader.checks.support.exit_cause import explain_end
from grader.checks.support.losses import all_lost
from grader.checks.support.process import Life, early_end, life, lives
from grader.checks.support.text import near_names
from grader.checks.support.unheard import HAND_IN
from grader.checks.topic import SYSTEM_TOPICS
from grader.evidence.run import Run
from grader.model.package import PackageFacts
from grader.model.verdict import Verdict, inconclusive, unjudged
from grader.wording import join_words


def no_node(package: PackageFacts, run: Run, what: str) -> Verdict | None:
    """`what` is missing (`nothing came on /x`) because no node was there; None where one was."""
    if run.foreign:
        return unjudged(f"{what} in this recording", hint="record it too, with rosbag record -a")
    if not lives(run):
        return unjudged(f"{what}: there was nothing to run", measured="not started", hint=HAND_IN)
    ended = early_end(run)
    if ended is not None:
        end = explain_end(ended, run, package)
        message = f"{what}: {ended.name} ended before ({end.cause})"
        return unjudged(message, measured="ended", hint=end.hint, citations=end.citations)
    if not run.student_nodes():
        hint = "call rospy.init_node(…), and run the node"
        return unjudged(f"{what}: no node was registered", measured="no node", hint=hint)
    return None


def no_message(package: PackageFacts, run: Run, topic: str) -> Verdict:
    """Why nothing that can be judged came on a topic."""
    if lost := all_lost(run, topic):
        return lost
    published = published_topics(run)
    measured = join_words(published) or "no topic"
    near = near_names(topic, published)
    if topic not in published and near:
        message = f"nothing came on {topic}; the node publishes on {join_words(near)}"
        return unjudged(message, measured=measured, hint=f"name the topic {topic}")
    refused = [e for _, e in run.recorder if e.topic == topic and e.event in {"refused", "invalid"}]
    if refused and not run.student_channels(topic):
        message = f"the recorder could not listen to {topic}: {refused[0].detail or refused[0].event}"
        return inconclusive(message, measured=measured, hint="grade again")
    if absent := no_node(package, run, f"nothing came on {topic}"):
        return absent
    if topic in published:
        message = f"{topic} is advertised, but no message ever came"
        return unjudged(message, measured="no message", hint="call publish(…) on it")
    message = f"nothing came on {topic}: no node publishes on it"
    return unjudged(message, measured=measured, hint=f"look at rostopic info {topic}")


def published_topics(run: Run) -> dict[str, str]:
    """Every topic on which a node of the student's publishes or could, with its type; system topics left out."""
    found = {c.topic: c.type for c in run.student_channels()}
    for _, event in run.graph:
        for topic, nodes in event.publishers.items():
            if any(run.is_student_node(n) for n in nodes):
                found.setdefault(topic, event.topic_types.get(topic, ""))
    return {topic: kind for topic, kind in found.items() if topic not in SYSTEM_TOPICS}


def life_of(run: Run, node: str) -> Life | None:
    """The process that a node belongs to; None where it cannot be told, or is not the student's."""
    return life(run, next((e.processes[node] for _, e in reversed(run.graph) if node in e.processes), ""))
