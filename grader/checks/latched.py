"""Whether a topic is latched."""

from __future__ import annotations

from grader.checks.registry import check
from grader.checks.support.absence import no_message
from grader.checks.support.names import GlobalName
from grader.evidence.run import Run
from grader.model.package import PackageFacts
from grader.model.record import Record
from grader.model.verdict import EvidenceCitation, Verdict, failed, inconclusive, passed
from grader.wording import join_words


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
        verdict = failed(f"{join_words(plain)} publishes on {params.topic} without latching", hint=hint)
    else:
        verdict = passed(f"{join_words(c.callerid for c in channels)} latches {params.topic}")
    kinds = join_words(f"{'latched' if c.latching else 'not latched'} by {c.callerid}" for c in channels)
    topic = params.topic if channels else "/grader/graph"
    return verdict.model_copy(
        update={
            "expected": f"a latched publisher on {params.topic}",
            "measured": verdict.measured or kinds,
            "citations": (*verdict.citations, EvidenceCitation(evidence=run.evidence, topic=topic)),
        }
    )
