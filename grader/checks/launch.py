"""Whether a launch file brings the nodes up together."""

from __future__ import annotations

from collections.abc import Iterator

from grader.checks.registry import check
from grader.checks.support.launching import find_launch, node_slip, unreadable
from grader.checks.support.process import lives
from grader.checks.support.roslaunch import roslaunch_error
from grader.evidence.events import GraphEvent
from grader.evidence.run import Run
from grader.model.package import LaunchFile, PackageFacts
from grader.model.record import Record
from grader.model.verdict import (
    Citation,
    EvidenceCitation,
    FileCitation,
    Verdict,
    failed,
    inconclusive,
    passed,
)
from grader.wording import join_words, plural


class LaunchConnectsParams(Record):
    """`launch` is the file's name, in whatever folder. `nodes` are names that have to come up."""

    launch: str
    topic: str
    nodes: tuple[str, ...] = ()


@check("launch-connects", params=LaunchConnectsParams)
def launch_connects(package: PackageFacts, run: Run, params: LaunchConnectsParams) -> Verdict:
    """The launch file brings up nodes that are connected.

    What it checks
        That the launch file is well-formed, and that `roslaunch` brings up a publisher and a subscriber
        which are connected over the topic.

    Why it matters on a robot
        A robot is started with launch files. One wrong attribute in one of them, and a part of the robot is
        missing without anybody noticing.

    How it is measured
        `roslaunch` runs the file, which is found by its name anywhere in the package, and both nodes are
        asked whom they are connected to; the kernel's table of connections has to bear it out. Any two
        nodes of the package do, under any names.

    How to fix
        One `<node pkg="…" type="….py" name="…"/>` for each script, with the `.py` and the executable bit.
        `roslaunch <package> <file>`, then `rosnode list` and `rostopic info <topic>` show what came up.
    """
    expected = f"{params.launch} brings up a publisher and a subscriber connected over {params.topic}"
    file = find_launch(package, params.launch)
    found = list(connections(run, params.topic))
    nodes = run.student_nodes()
    verdict = (
        unreadable(package, file, params.launch)
        or not_run(run)
        or _names_missing(nodes, file, params)
        or (None if found else _unconnected(package, file, run, params))
        or passed(f"roslaunch connects {found[0][0]} and {found[0][1]} over {params.topic}")
    )
    place: tuple[Citation, ...] = (FileCitation(file=file.path, line=1),) if file else ()
    measured = f"{plural(len(nodes), 'node')}: {join_words(nodes)}" if nodes else "no node came up"
    if file is None or file.fault:
        measured = "no launch file that can be read"
    graph = EvidenceCitation(evidence=run.evidence, topic="/grader/graph")
    return verdict.model_copy(
        update={
            "expected": expected,
            "measured": measured,
            "citations": verdict.citations or (*place, graph),
        }
    )


def connections(run: Run, topic: str) -> Iterator[tuple[str, str]]:
    """Publisher and subscriber, two nodes of the student's that were connected over the topic."""
    for _, event in run.graph:
        for one in event.connections:
            pair = (one.publisher, one.subscriber)
            if one.topic == topic and pair[0] != pair[1] and all(map(run.is_student_node, pair)):
                yield pair


def not_run(run: Run) -> Verdict | None:
    """Nothing was started at all."""
    if lives(run) or run.graph:
        return None
    return inconclusive("roslaunch was not run", hint="grade again")


def _names_missing(
    nodes: tuple[str, ...], file: LaunchFile | None, params: LaunchConnectsParams
) -> Verdict | None:
    missing = [n for n in params.nodes if f"/{n.lstrip('/')}" not in nodes]
    if not missing or not nodes:
        return None
    message = f"{join_words(missing)} did not come up; there is {join_words(nodes)}"
    cited = (FileCitation(file=file.path, line=1),) if file else ()
    return failed(message, hint="the `name` in the launch file is the node's name", citations=cited)


def _unconnected(
    package: PackageFacts, file: LaunchFile | None, run: Run, params: LaunchConnectsParams
) -> Verdict:
    """Why no two nodes are connected: a wrong attribute, an error of roslaunch's, or what the graph shows."""
    said = roslaunch_error(run)
    quoted = f"; roslaunch says: {said}" if said else ""
    slips = (
        (node_slip(package, node.model_copy(update={"file": file.path}), said) for node in file.nodes)
        if file
        else ()
    )
    wrong = next(filter(None, slips), None)
    if wrong is not None:
        return wrong.verdict(quoted)
    nodes = run.student_nodes()
    if len(nodes) < 2:
        up = f"only {nodes[0]} comes up" if nodes else "no node comes up"
        message = f"{up}; the file declares {plural(len(file.nodes) if file else 0, 'node')}{quoted}"
        hint = "give the talker and the listener a <node> each, and try each script alone with rosrun"
        return failed(message, hint=hint)
    return over_another_topic(run, params.topic, quoted)


def over_another_topic(run: Run, topic: str, quoted: str = "") -> Verdict:
    """Why nodes that are there are not connected: other topics, other types, or an end that is missing."""
    others = {
        c.topic
        for _, event in run.graph
        for c in event.connections
        if c.topic not in {topic, "/rosout"} and run.is_student_node(c.subscriber)
    }
    if others:
        message = f"the nodes are connected over {join_words(sorted(others))}, not over {topic}"
        return failed(message + quoted, hint=f"both have to use {topic}; look for a <remap> or a namespace")
    publishers, subscribers = (_nodes_on(run, topic, end) for end in ("publishers", "subscribers"))
    if publishers and subscribers:
        message = (
            f"{join_words(publishers)} and {join_words(subscribers)} are both on {topic}, but not connected"
        )
        return failed(message + quoted, hint="do both use the same message type?")
    lacking = "publishes on" if not publishers else "subscribes to"
    message = f"{join_words(run.student_nodes())} are not connected: none {lacking} {topic}"
    seen = _topics_of(run, "publishers" if not publishers else "subscribers")
    there = f"; one {lacking} {join_words(seen)}" if seen else ""
    hint = f"launch a talker and a listener that use {topic}; look for a <remap> or a namespace"
    return failed(message + there + quoted, hint=hint)


def _topics_of(run: Run, end: str) -> tuple[str, ...]:
    """The topics that the student's nodes have at this end."""
    ends = [event.publishers if end == "publishers" else event.subscribers for _, event in run.graph]
    found = (topic for topics in ends for topic in topics if topic != "/rosout")
    return tuple(topic for topic in dict.fromkeys(found) if _nodes_on(run, topic, end))


def _nodes_on(run: Run, topic: str, end: str) -> tuple[str, ...]:
    def nodes(event: GraphEvent) -> tuple[str, ...]:
        return (event.publishers if end == "publishers" else event.subscribers).get(topic, ())

    found = (n for _, event in run.graph for n in nodes(event) if run.is_student_node(n))
    return tuple(dict.fromkeys(found))
