"""Whether two nodes are connected over a topic."""

from __future__ import annotations

from collections.abc import Iterator

from grader.checks.registry import check
from grader.checks.support.idioms import INIT, publisher, subscriber
from grader.checks.support.nodes import GlobalName, is_called
from grader.checks.support.text import near_names
from grader.checks.support.topics import End, cite, no_node, nodes_on, topics_with
from grader.evidence.run import Run, is_grader_node
from grader.model.package import PackageFacts
from grader.model.record import Record
from grader.model.verdict import Verdict, failed, passed
from grader.wording import join_words

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
        That messages go from one node to the other over the topic: not only that both name it.

    Why it matters on a robot
        A publisher on one name and a subscriber on another run side by side in perfect silence, and nothing
        ever says so.

    How it is measured
        Both nodes are asked whom they are connected to. It counts where both say so and the kernel knows of
        a connection between their processes: what one node says of itself is not enough. A node that the
        rubric does not name may have any name; the `_<digits>_<digits>` of an anonymous one does not matter.

    How to fix
        Both ends need the same topic name, with the namespace and after every `<remap>`, and the same
        message type. `rosnode info <node>` and `rqt_graph` show the connections.
    """
    found = next(_pairs(run, params), None)
    ends = [_wanted(params.name(end), end) for end in ENDS]
    if found:
        verdict = passed(f"{found[0]} and {found[1]} are connected over {params.topic}")
    else:
        verdict = _apart(package, run, params)
    over = {c.topic: None for _, e in run.graph for c in e.connections if run.is_student_node(c.publisher)}
    return verdict.about(
        expected=f"{ends[0]} connected to {ends[1]} over {params.topic}",
        measured=verdict.measured or (f"connections over {join_words(over)}" if over else "no connection"),
        citations=(*verdict.citations, cite(run, "/grader/graph")),
    )


def _pairs(run: Run, params: ConnectedParams) -> Iterator[tuple[str, str]]:
    for _, event in run.graph:
        for one in event.connections:
            pair = (one.publisher, one.subscriber)
            fits = _fits(run, pair[0], params.publisher) and _fits(run, pair[1], params.subscriber)
            if one.topic == params.topic and pair[0] != pair[1] and fits:
                yield pair


def _fits(run: Run, node: str, wanted: str) -> bool:
    """Programs of other packages (`/turtlesim`) only by their name, the grader's own nodes never."""
    if is_grader_node(node):
        return False
    return is_called(node, wanted) if wanted else run.is_student_node(node)


def _apart(package: PackageFacts, run: Run, params: ConnectedParams) -> Verdict:
    """Return why no two nodes are connected: one is missing, or not on the topic, or the types differ."""
    lacking = [end for end in ENDS if not _on(run, params.topic, end, params)]
    for end in lacking:
        if verdict := _misnamed(run, end, params):
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
    return failed(message, hint="do both use the same message type?").once()


def _misnamed(run: Run, end: End, params: ConnectedParams) -> Verdict | None:
    """The node is there under another name."""
    wanted, there = params.name(end), [n for n in _nodes(run) if not is_grader_node(n)]
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
    """Return the nodes that fit this end and were ever on the topic."""
    return nodes_on(run, topic, end, lambda node: _fits(run, node, params.name(end)))


def _nodes(run: Run) -> tuple[str, ...]:
    return tuple(dict.fromkeys(node for _, event in run.graph for node in event.nodes))


def _wanted(name: str, end: End) -> str:
    return f"/{name.lstrip('/')}" if name else f"a {end.removesuffix('s')} of the package"
