"""Whether a package keeps to the topics of its lab."""

from __future__ import annotations

from grader.checks.registry import check
from grader.checks.support.absence import no_node, published_topics
from grader.checks.support.names import GlobalName, plain_type
from grader.checks.support.text import near_names
from grader.evidence.run import Run
from grader.model.package import PackageFacts
from grader.model.record import Record
from grader.model.verdict import EvidenceCitation, Verdict, failed, passed
from grader.wording import join_words


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
    return verdict.model_copy(
        update={
            "expected": f"no topic beside {join_words(params.topics)}"
            if params.topics
            else "no topic at all",
            "measured": verdict.measured or join_words(published) or "no topic",
            "citations": (
                *verdict.citations,
                EvidenceCitation(evidence=run.evidence, topic="/grader/graph"),
            ),
        }
    )


def _unexpected(
    unexpected: list[str], published: dict[str, str], run: Run, params: OnlyTopicsParams
) -> Verdict:
    first = unexpected[0]
    missing = [t for t in params.topics if t not in published and not t.endswith("*")]
    meant = near_names(first, missing)
    named = join_words(f"{t} ({plain_type(published[t])})" if published[t] else t for t in unexpected)
    message = f"{_publisher(run, first)} publishes on {named}, which the lab does not ask for"
    hint = f"did you mean {meant[0]}?" if meant else f"remove the rospy.Publisher('{first}', …)"
    return failed(message, hint=hint)


def _publisher(run: Run, topic: str) -> str:
    by_graph = (n for _, e in run.graph for n in e.publishers.get(topic, ()) if run.is_student_node(n))
    return next(by_graph, None) or run.student_channels(topic)[0].callerid
