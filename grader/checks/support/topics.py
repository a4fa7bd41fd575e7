"""Topics of a run: who is on them, and why no message came."""

from __future__ import annotations

import posixpath
from collections.abc import Callable, Collection, Iterator
from pathlib import PurePosixPath
from typing import Literal

from grader.checks.registry import Check
from grader.checks.support.exit_causes import explain_end, explain_error
from grader.checks.support.frames import unknown_frame
from grader.checks.support.launch_slips import own_script, right_remap, without_slash
from grader.checks.support.processes import (
    NO_SCRIPT_HINT,
    copied_topic,
    early_end,
    is_written_as,
    lives,
    named_at,
    plain_type,
    run_scripts,
    run_slips,
    taken_off,
    where_named,
)
from grader.checks.support.recorder_losses import all_lost
from grader.checks.support.scripts import programs, sources_made
from grader.checks.support.text import (
    INIT,
    LOOP,
    PUBLISHER,
    TYPE_SLOT,
    imports,
    near_names,
    publisher,
    python_or_cpp,
    rename_if_meant,
    shown,
    subscriber,
)
from grader.evidence.events import MISFIT, UNHEARD, UNSENDABLE
from grader.evidence.run import Channel, Run
from grader.model.launch_file import LaunchLine, LaunchNode
from grader.model.message_definitions import fields_to_read
from grader.model.package import PackageFacts
from grader.model.python_slip import PythonSlip, SlipKind
from grader.model.verdict import (
    EvidenceCitation,
    Verdict,
    failed,
    failed_or_blocked,
    grade_again,
    inconclusive,
)
from grader.wording import NOTHING_TO_DO, ask_type, join_words

SYSTEM_TOPICS = frozenset({"/rosout", "/rosout_agg", "/clock"})
End = Literal["publishers", "subscribers"]
Sender = Literal["student", "program", "anyone"]
"""Whose messages a check judges: the student's nodes', those of the programs beside them, or both."""


def cite(run: Run, topic: str, from_ns: int | None = None, to_ns: int | None = None) -> EvidenceCitation:
    """Return a stretch of the run's evidence on one topic, or the whole topic."""
    return EvidenceCitation(evidence=run.evidence, topic=topic, from_ns=from_ns, to_ns=to_ns)


def nodes_on(run: Run, topic: str, end: End, fits: Callable[[str], bool] | None = None) -> tuple[str, ...]:
    """Return the nodes that were ever at this end of a topic: the student's, or those that `fits` accepts."""
    wanted = fits or run.is_student_node
    found = (n for _, event in run.graph for n in getattr(event, end).get(topic, ()) if wanted(n))
    return tuple(dict.fromkeys(found))


def topics_with(run: Run, end: End, fits: Callable[[str], bool] | None = None) -> tuple[str, ...]:
    """Return the topics with such a node at this end; `/rosout` is left out."""
    topics = dict.fromkeys(topic for _, event in run.graph for topic in getattr(event, end))
    # Every node publishes on `/rosout`.
    return tuple(topic for topic in topics if topic != "/rosout" and nodes_on(run, topic, end, fits))


def connected_nodes(
    package: PackageFacts, run: Run, topic: str, fits: Callable[[str, End], bool] | None = None
) -> Iterator[tuple[str, str]]:
    """Yield publisher and subscriber of each connection of two nodes over the topic: of the student's, or of those that
    `fits` accepts at their end. Of one that a script takes off the topic, it is chance whether it was still seen."""
    wanted = fits or (lambda node, _: run.is_student_node(node))
    there = [one for _, event in run.graph for one in event.connections if one.topic == topic]
    off = taken_off(run, topic) if there and any(s.kind == "unregistered" for s in package.slips) else ()
    for first, second in ((one.publisher, one.subscriber) for one in there):
        is_pair = first != second and not {first, second}.intersection(off)
        if is_pair and wanted(first, "publishers") and wanted(second, "subscribers"):
            yield first, second


def published_topics(run: Run) -> dict[str, str]:
    """Return every topic on which a node of the student's publishes or could, with its type; no system topics."""
    found = {c.topic: plain_type(c.type) for c in run.student_channels()}
    for _, event in run.graph:
        for topic, nodes in event.publishers.items():
            if any(run.is_student_node(n) for n in nodes):
                # The recorded type goes first: the master may not know one yet.
                found.setdefault(topic, plain_type(event.topic_types.get(topic, "")))
    return {topic: kind for topic, kind in found.items() if topic not in SYSTEM_TOPICS}


def no_node(package: PackageFacts, run: Run, what: str) -> Verdict | None:
    """Return why `what` is missing (`no message came on /x`) if no node was there; None if one was."""
    if run.foreign:
        return failed_or_blocked(f"{what} in this recording", hint="record it too, with rosbag record -a")
    if not lives(run) and not run.student_nodes():
        return failed_or_blocked(
            f"{what}: there was nothing to run", measured="not started", hint=NO_SCRIPT_HINT
        )
    if ended := early_end(run):
        end = explain_end(ended, run, package)
        if end.by_itself and (error := explain_error(package, run)):  # it may have to end, but not to fail
            return error.verdict(failed_or_blocked, f"{what}: {error.cause}", measured="ended")
        return end.verdict(
            failed_or_blocked, f"{what}: {ended.name} ended before ({end.cause})", measured="ended"
        )
    if not run.student_nodes():
        hint = f"call {INIT}, and run the node"
        return failed_or_blocked(f"{what}: no node was registered", measured="no node", hint=hint)
    return None


def no_message(
    package: PackageFacts,
    run: Run,
    topic: str,
    of_node: Callable[..., Verdict] = failed_or_blocked,
    kind: str = "",
) -> Verdict:
    """Return why no message came on a topic. `of_node` makes the verdict where the node itself is the reason; `kind` is
    the type that the topic should have."""
    # What the recorder lost, the topic's name, the node, its script: the first that holds says most.
    if lost := all_lost(run, topic):
        return lost
    published = published_topics(run)
    near = () if topic in published else near_names(topic, published)
    measured, what = join_words(published) or "no topic", f"no message came on {topic}"
    if run.foreign:
        seen = f"; {join_words(near)} is" if near else ""
        hint = f"publish on {topic} while you record, and record it: rosbag record {topic}, or -a for all"
        return failed_or_blocked(f"{topic} is not in {run.evidence}{seen}", measured=measured, hint=hint)
    if found := _sent_otherwise(package, run, topic) or _judge_misnamed(package, run, topic, of_node):
        return found
    if absent := no_node(package, run, what) or _judge_refused(run, topic) or misfit(run):
        return absent if topic in published else _with_others(absent, published)
    if topic in published:
        return _judge_advertised(package, run, topic, what, of_node)
    return _not_advertised(package, run, topic, of_node, kind)


def _sent_otherwise(package: PackageFacts, run: Run, topic: str) -> Verdict | None:
    """Return the verdict where all transforms are sent as static ones, or a goal is sent to the action of this topic,
    `/dock/cancel`, and not cancelled."""
    action, _, part = topic.rpartition("/")
    is_static = topic == "/tf" and any(c.messages for c in run.student_channels("/tf_static"))
    if (
        is_static
        and "/tf" not in published_topics(run)
        and not (early_end(run) or explain_error(package, run))
    ):
        hint = "send what changes with a tf2_ros.TransformBroadcaster: a static one sends on /tf_static"
        message = "no message came on /tf; what is sent goes to /tf_static"
        return failed_or_blocked(message, measured="no message", hint=hint)
    if part != "cancel" or not any(c.messages for c in run.student_channels(f"{action}/goal")):
        return None
    message = f"the goal that is sent to {action} is never cancelled"
    return failed(message, measured="no message", hint="`client.cancel_goal()` cancels it")


def _judge_misnamed(
    package: PackageFacts, run: Run, topic: str, of_node: Callable[..., Verdict]
) -> Verdict | None:
    """Return the verdict where a node publishes under a name that is nearly the topic's, or that a launch file made."""
    published, what = published_topics(run), f"no message came on {topic}"
    if topic in published or not published:
        return None
    near, measured = near_names(topic, published), join_words(published)
    if node := _namespaced_node(package, run, topic):
        own = [name for name in published if name.startswith(node.namespace)]
        if node.remaps or (own and not near_names(topic, own)):
            message = f"{what}; the node publishes on {join_words(own or near or published)}"
            line, hint = right_remap(node, topic, own or [*published])
            verdict = of_node(message, measured=measured, hint=hint).about(citations=(line.place,))
            # one <arg> may rename the topics of several nodes
            by_arg = isinstance(line, LaunchLine) and line.tag == "to"
            return verdict.based_on(cause=hint, charged_once=True) if by_arg else verdict
        near = near_names(topic, own) or near
    if not near:
        return None
    named = named_at(package, run, "publisher", near[0])
    hint = f"name the topic {topic} {where_named(named, PUBLISHER)}"
    verdict = of_node(f"{what}; the node publishes on {join_words(near)}", measured=measured, hint=hint)
    return verdict.about(citations=named)


def _namespaced_node(package: PackageFacts, run: Run, topic: str) -> LaunchNode | None:
    """Return the launch file's node in whose namespace the topic is, or that is remapped, where the run is a launch
    file's."""
    if not lives(run) or any(run_scripts(run)):
        return None
    nodes = [n for f in package.launch_files for n in f.brings if topic.startswith(n.namespace)]
    heard = {n for name in topics_with(run, "publishers") for n in nodes_on(run, name, "publishers")}
    nodes = [n for n in nodes if n.remaps or (n.namespace != "/" and n.full_name in heard)]
    # Of namespaces in one another, the innermost is the node's.
    return max(nodes, key=lambda n: len(n.namespace), default=None)


def _not_advertised(
    package: PackageFacts, run: Run, topic: str, of_node: Callable[..., Verdict], kind: str
) -> Verdict:
    published, what = published_topics(run), f"no message came on {topic}"
    measured = join_words(published) or "no topic"
    if slip := why_unreached(package, run):
        verdict = of_node(f"{what}: {slip.message}", measured=measured, hint=reach_hint(slip))
        return verdict.about(citations=(slip.place,))
    of_types, _, name = kind.partition("/")
    call = (
        publisher(topic, f"{name}, queue_size=10", type=f"{of_types}::{name}") if name else publisher(topic)
    )
    hint = f"add {call} and publish in the loop"
    if topic in TF_TOPICS:
        hint = f"send it with a `tf2_ros.{'Static' * (topic != TF_TOPICS[0])}TransformBroadcaster()`"
    if slip := call_in_comment(package, run, "Publisher"):
        sent = call_in_comment(package, run, "publish")
        # Both have to come back: a publisher alone sends nothing.
        if sent and sent.file == slip.file and sent.fix == f"remove the `#` from line {sent.line}":
            slip = slip.model_copy(update={"fix": f"{slip.fix} and from line {sent.line}"})
        return _commented_out(what, slip, of_node).about(measured=measured)
    if not published:
        return of_node(f"{what}: no node publishes on it", measured=measured, hint=hint)
    if copied := copied_topic(package, run, "publisher"):
        hint = f"write {topic} on the one of {copied} that is for it"
        message = f"{what}; the node publishes on {join_words(published)}, on {copied}"
        return of_node(message, measured=measured, hint=hint)
    # A topic of the right type is likelier to be the one that is meant.
    meant = [name for name, type_ in published.items() if kind and type_ == plain_type(kind)] or list(
        published
    )
    hint += "" if topic in TF_TOPICS else rename_if_meant(meant)
    verdict = of_node(f"{what}; the node publishes on {join_words(published)}", measured=measured, hint=hint)
    return verdict.about(citations=named_at(package, run, "publisher", meant[0]), said=meant[0])


def _with_others(absent: Verdict, published: Collection[str]) -> Verdict:
    """Return the verdict with the topics that were there in place of the one that is asked for."""
    others = f"; it published on {join_words(published)}" if published else ""
    return absent.model_copy(update={"message": f"{absent.message}{others}"})


def _judge_advertised(
    package: PackageFacts, run: Run, topic: str, what: str, of_node: Callable[..., Verdict]
) -> Verdict:
    message = f"{what}, although it is advertised"
    if end := explain_error(package, run):
        return end.verdict(of_node, f"{message}: an error comes first: {end.cause}", measured="no message")
    others = run_slip(package, run, "queue-size", "rate-as-time") or _not_yet(package, run)
    if slip := why_unreached(package, run) or others:
        verdict = of_node(f"{message}: {slip.message}", measured="no message", hint=reach_hint(slip))
        return verdict.about(citations=(slip.place,))
    if deaf := unheard(run, package):
        verdict = of_node(f"{message}: {deaf.message}", measured="no message", hint=deaf.hint)
        return verdict.caused_by(deaf)
    if slip := call_in_comment(package, run, "publish"):
        return _commented_out(message, slip, of_node)
    # A node that hears something may have good reason to publish on a condition only.
    kinds: tuple[SlipKind, ...] = ("never-published", *(() if _heard_topics(run) else ("published-in-part",)))
    never = run_slips(package, run, "never-begun") or run_slips(package, run, "swallows")
    if (
        told := _unused_publisher(package, run, topic, kinds)
        or reads_keys(package, run)
        or next(iter(never), None)
    ):
        verdict = of_node(f"{message}: {told.message}", measured="no message", hint=told.fix)
        return verdict.about(citations=(told.place,))
    return _by_what_is_heard(run, message, of_node)


def _unused_publisher(
    package: PackageFacts, run: Run, topic: str, kinds: Collection[SlipKind]
) -> PythonSlip | None:
    """Return why a topic's publisher sends nothing; of one that is remapped, if its script has no other publisher."""
    slips = [s for s in package.slips if s.kind in kinds]
    scripts, nodes = run_scripts(run), nodes_on(run, topic, "publishers")
    launched = (n for file in package.launch_files for n in file.brings if n.full_name in nodes)
    scripts |= {script.path for n in launched if None in scripts and (script := own_script(package, n))}
    own = [s for s in slips if s.file in scripts]
    written = [s.file for s in package.slips if s.kind == "publisher"]
    alone = [s for s in own if written.count(s.file) == 1 and len(own) == 1]
    return next(iter([s for s in own if is_written_as(s.name, topic)] or alone), None)


def _by_what_is_heard(run: Run, message: str, of_node: Callable[..., Verdict]) -> Verdict:
    """Return the verdict on a node that may wait for something: a frame that is not sent, or a message."""
    if frame := unknown_frame(run, _output(run)):
        why = f"{message}: the node looks up the frame {shown(frame)}, and tf knows none of that name"
        hint = "write the name of a frame that is sent: `rosrun tf view_frames` draws them"
        return of_node(why, measured="no message", hint=hint).seeking("quoted", frame)
    heard = _heard_topics(run)
    if heard and set(heard) <= set(TF_TOPICS):
        why, hint = next(
            (known for said, known in OF_TF.items() if any(said in line for line in _output(run))), UNTOLD
        )
        return of_node(f"{message}: {why}", measured="no message", hint=hint)
    if heard:
        answering = f"publish in the callback of {join_words(heard)}, or in the loop"
        hint = python_or_cpp(
            answering,
            f"{answering}, and call ros::spinOnce() in it, or ros::spin(): otherwise no callback is ever called",
        )
        return of_node(
            f"{message}: nothing follows what the run publishes on {join_words(heard)}",
            measured="no message",
            hint=hint,
        )
    hint, fed = f"call publish(…) inside the loop `{LOOP}`", topics_with(run, "publishers", lambda _: True)
    if silent := [one for one in topics_with(run, "subscribers") if one not in {*fed, *SYSTEM_TOPICS}]:
        message += f": it hears {join_words(silent)}, and nothing is sent there in this run"
        hint = f"publish in a loop `{LOOP}`: a callback is called only when a message comes"
    return of_node(message, measured="no message", hint=hint)


TF_TOPICS = ("/tf", "/tf_static")
OF_TF = {
    "into the future": (
        "it asks where the frame is now, and the newest transform is a little older",
        "write `rospy.Time(0)` as the time in `lookup_transform(…)`: it stands for the newest transform",
    ),
    "frame_ids cannot start with a '/'": (
        "it looks up a frame whose name begins with a slash, which tf2 does not accept",
        "write the names of the frames without the slash",
    ),
}
"""What a node prints of an error of tf's that it catches, and what that means."""
UNTOLD = (
    "transforms are sent, and nothing follows from them",
    "print what the lookup raises: `except tf2_ros.TransformException as error: rospy.logwarn(error)`",
)


def _output(run: Run) -> Iterator[str]:
    return (c.line for one in lives(run) for _, c in run.lines(one.name))


def _heard_topics(run: Run) -> list[str]:
    """Return the topics on which the grader published, and to which a node of the student's subscribes."""
    sent = dict.fromkeys(
        e.topic or "" for _, e in run.actors if e.actor == "grader" and e.action == "publish"
    )
    others = topics_with(run, "subscribers")
    return [topic for topic in sent if topic in others]


def refused_type(run: Run, topic: str, package: PackageFacts | None = None) -> Verdict | None:
    """Return the verdict where the grader's publisher had to refuse a node, which asked for another type; with the line
    that subscribes, where the package is given and has one."""
    asked = next((e for _, e in run.actors if e.action == "note" and e.topic == topic and e.type), None)
    if asked is None:
        return None
    # The same name was refused, so it is the fields that differ.
    other = f"another definition of {asked.type}" if asked.type == asked.value else asked.type
    message = f"{asked.actor} subscribes to {topic} with {other}, so nothing arrives"
    hint = f"in {subscriber(topic)}, {ask_type(asked.value)}"
    if isinstance(asked.value, str) and "/" in asked.value and asked.type != asked.value:
        of_types, _, name = asked.value.partition("/")
        hint = f"{hint}, with `{imports(of_types, name, 'msg')}` at the top"
        hint = "; ".join(filter(None, (hint, fields_to_read(asked.type or "", asked.value))))
    cited = named_at(package, run, "subscriber", topic) if package else ()
    return failed(message, hint=hint, citations=cited)


def unheard(run: Run, package: PackageFacts | None = None) -> Verdict | None:
    """Return the verdict where no node of the student's heard what the grader sends, or one misspells its topic."""
    topics = dict.fromkeys(
        e.topic or ""
        for _, e in run.actors
        if e.actor == "grader" and (e.action == "publish" or (e.action == "note" and e.detail == UNHEARD))
    ) | dict.fromkeys(offered := unheard_programs(run))
    topics |= dict.fromkeys(_played(run))
    others = tuple(topic for topic in topics_with(run, "subscribers") if topic not in SYSTEM_TOPICS)
    missed = [topic for topic in topics if topic not in others]
    connected = {
        one.topic for _, e in run.graph for one in e.connections if run.is_student_node(one.subscriber)
    }
    # Subscribed and never connected: their types may differ.
    heard = [topic for topic in topics if topic not in missed and topic not in connected]
    if refused := next(filter(None, (refused_type(run, topic, package) for topic in heard)), None):
        return refused
    near = next(((topic, found) for topic in missed if (found := near_names(topic, others))), None)
    # A node need not hear every topic: one that is missed counts if all are, or if a name is nearly the same.
    if not missed or not run.student_nodes() or (near is None and len(missed) < len(topics)):
        return None
    topic, found = near or (missed[0], offered.get(missed[0], others))
    space = topic.rpartition("/")[0]
    found = tuple(sorted(found, key=lambda one: one.rpartition("/")[0] != space))  # its own namespace first
    if refused := refused_type(run, topic, package):
        return refused
    if topic in TF_TOPICS:
        fills = "`listener = tf2_ros.TransformListener(buffer)` fills the buffer"
        return failed(f"the run publishes on {topic}, and no node listens to tf", hint=fills)
    seen = f"; {nodes_on(run, found[0], 'subscribers')[0]} subscribes to {join_words(found)}" if found else ""
    unused = {s.name for s in run_slips(package, run, "unused-import")} if package and not others else set()
    played = [c.topic for c in run.channels if c.messages and c.type.rpartition("/")[2] in unused]
    lacking = [topic] if near or offered else [*dict.fromkeys([*missed, *played])]
    them = "them" if lacking[1:] else "it"
    message = f"the run publishes on {join_words(lacking)}, and no node subscribes to {them}{seen}"
    remapped = _remap_to(package, run, topic, found[0]) if package and found else ""
    types = {e.topic or "": plain_type(e.type or "") for _, e in run.actors if e.actor == "grader"}
    types |= {channel.topic: plain_type(channel.type) for channel in run.channels}
    kinds = {one: types.get(one, "").rpartition("/")[2] or TYPE_SLOT for one in lacking}
    add = f"add {join_words(subscriber(one, f'{kinds[one]}, callback') for one in lacking)}"
    if topic in offered:
        add = f"subscribe to {topic} in place of {join_words(found, 'or')}, on which nothing is published"
    return failed(message, hint=remapped or add).based_on(charged_once=True)


def _played(run: Run) -> list[str]:
    """Return the topics of the recordings that the run plays back."""
    played = [e.detail.partition(" on ")[2] for _, e in run.actors if e.action == "play"]
    nobody = f"{UNHEARD} to "  # of a recording, its topics follow
    played += [e.detail.removeprefix(nobody) for _, e in run.actors if e.detail.startswith(nobody)]
    return [topic for one in played for topic in one.split(", ") if topic.startswith("/")]


def unheard_programs(run: Run) -> dict[str, tuple[str, ...]]:
    """Return the topics of programs beside the student's nodes that none of these hears, by those of the same type
    which they hear in their place, and on which nobody publishes."""
    types = {topic: kind for _, event in run.graph for topic, kind in event.topic_types.items()}
    fed = topics_with(run, "publishers", lambda _: True)
    heard = topics_with(run, "subscribers")
    found: dict[str, tuple[str, ...]] = {}
    for channel in run.channels:
        own = run.is_student_node(channel.callerid)
        if own or channel.by_grader or not channel.messages or channel.topic in {*heard, *SYSTEM_TOPICS}:
            continue
        kind = plain_type(channel.type)
        alike = tuple(t for t in heard if t not in fed and plain_type(types.get(t, "")) == kind)
        if alike:
            found[channel.topic] = alike
    return found


def _remap_to(package: PackageFacts, run: Run, topic: str, heard: str) -> str:
    """Return how a launch file's node, which hears a topic of its namespace, is to hear another one; "" for others."""
    for late in (one for file in package.launch_files for one in file.late_remaps):
        ends = [posixpath.join(late.namespace, name) for name in (late.value, late.to)]
        if ends == [heard, topic]:
            has_none = "it has no effect on the nodes above it"
            return f"move the <remap> from line {late.line} of {late.file} to above line {late.above}: {has_none}"
    nodes = {node.full_name: node for file in package.launch_files for node in file.brings}
    there = [nodes[name] for name in nodes_on(run, heard, "subscribers") if name in nodes]
    for node in there:  # one of whose namespace the name has been taken out
        if node.namespace != "/" and topic == f"{node.namespace.rstrip('/')}{heard}":
            froms = {first.strip("/") for first, second in node.remaps if second == heard}
            lines = [one for one in node.renaming if one.tag == "remap" and one.value.strip("/") in froms]
            to = next(iter(lines[::-1]), None)
            taken = "it takes the name out of its namespace"
            at = (
                to
                and f"on line {to.line} of {to.file}, remove the slash in front of the name in to=…: {taken}"
            )
            return at or without_slash(node, heard.strip("/"))
    if not there or there[0].namespace == "/" or not heard.startswith(there[0].namespace):
        return ""
    node = there[0]
    name = heard.removeprefix(node.namespace)
    spaces, space = [one for one in node.renaming if one.tag != "remap"], topic.removesuffix(name).strip("/")
    if (
        topic == f"/{space}/{name}"
        and len(spaces) == 1
        and spaces[0].value.strip("/") == node.namespace.strip("/")
    ):
        return f'on line {spaces[0].line} of {spaces[0].file}, write ns="{space}", not ns="{spaces[0].value}"'
    right = f'<remap from="{name}" to="{topic}"/>'
    wrong = next((one for one in node.renaming if one.tag == "remap" and one.value == topic), None)
    if wrong is not None:
        return f"on line {wrong.line} of {wrong.file}, write `{right}`: `from` is the name in the script"
    return f"write `{right}` into the <node> on line {node.line} of {node.file}"


def explain_by_unheard_topic(check: Check, package: PackageFacts, run: Run, verdict: Verdict) -> Verdict:
    """Return a lost mark with the topic on which the run publishes and that no node heard, whatever it did instead."""
    is_unexplained = check.of_callbacks and not verdict.basis.cause and not early_end(run)
    if not is_unexplained or (found := unheard(run, package)) is None:
        return verdict
    explained = verdict.explained(found.message, found.hint).caused_by(found)
    return explained.about(citations=(cite(run, "/grader/graph"),))


def why_unreached(package: PackageFacts, run: Run) -> PythonSlip | None:
    """Return why a script that runs does not come to its `publish(…)`, or to what it offers."""
    return run_slip(package, run, "never-reached", "never-called", "spin-in-loop", "stuck")


def _not_yet(package: PackageFacts, run: Run) -> PythonSlip | None:
    """Return the only line of the scripts that waits, where it lets more time pass than the run had."""
    waits = run_slips(package, run, "rate-number")
    pause_s = 1 / float(waits[0].message) if len(waits) == 1 else 0.0
    if pause_s * 1e9 <= run.end_ns - run.start_ns:
        return None
    why = f"line {waits[0].line} of {waits[0].file} lets {pause_s:g} s pass before anything comes"
    fix = f"let less time pass on line {waits[0].line} of {waits[0].file}"
    return waits[0].model_copy(update={"message": why, "fix": fix})


def run_slip(package: PackageFacts, run: Run, *kinds: SlipKind) -> PythonSlip | None:
    """Return the first slip of one of these kinds in a script that runs."""
    return next(iter(run_slips(package, run, *kinds)), None)


def files_that_run(package: PackageFacts, run: Run) -> set[str | None]:
    """Return the scripts that run and those that a launch file started, with what they import of the package, and the
    sources of programs of C++."""
    scripts = run_scripts(run)
    nodes = [node for file in package.launch_files for node in file.brings]
    types = {node.type for node in nodes if node.full_name in run.student_nodes()}
    launched = {file.path for file in package.files if PurePosixPath(file.path).name in types}
    made = (sources_made(package, one.call) for one in programs(package) if one.name in scripts | types)
    return scripts.union(launched, _imported(package, scripts | launched), *made)


def _imported(package: PackageFacts, scripts: Collection[str | None]) -> set[str]:
    """Return the package's own files that these scripts import, and those that these import."""
    imports = {one.path: one.imports for one in package.files}
    found, left = set[str](), [one for one in scripts if one]
    while left:
        new = {*imports.get(left.pop(), ())} - found
        found |= new
        left += new
    return found


def reads_keys(package: PackageFacts, run: Run) -> PythonSlip | None:
    """Return where a program of C++ reads what is typed: without any input it goes on, and may do nothing."""
    files = files_that_run(package, run) - run_scripts(run)
    return next((s for s in package.slips if s.kind == "input" and s.file in files), None)


def call_in_comment(package: PackageFacts, run: Run, call: str) -> PythonSlip | None:
    """Return where a script that runs has such a call in a comment: `Subscriber`."""
    found = run_slips(package, run, "commented-out")
    return next((s for s in found if s.name.rpartition(" ")[2] == call), None)


def _commented_out(what: str, slip: PythonSlip, of_node: Callable[..., Verdict]) -> Verdict:
    message = f"{what}: in {slip.file}, line {slip.line}, {slip.message}"
    return of_node(message, measured="no message", hint=slip.fix).about(citations=(slip.place,))


def reach_hint(slip: PythonSlip) -> str:
    """Return what to do about a line that is not reached."""
    if slip.kind == "never-called" and not slip.fix:
        return f"call it, or move its lines to where they run: line {slip.line}"
    return slip.fix or f"publish inside the loop `{LOOP}`, not after a loop that never ends"


def sent_by(run: Run, topic: str, of: Sender) -> tuple[Channel, ...]:
    """Return what these senders published on a topic."""
    if of == "student":
        return run.student_channels(topic)
    found = (c for c in run.channels if c.topic == topic and not c.by_grader)
    return tuple(c for c in found if of == "anyone" or c.callerid in run.grader_nodes)


def nothing_sent(package: PackageFacts, run: Run, topic: str, of: Sender) -> Verdict:
    """Return why no message of these senders came: what a program beside the student's does not send costs nobody."""
    if of != "program":
        return no_message(package, run, topic)
    message = f"no program that runs beside the student's nodes published on {topic}"
    return inconclusive(message, measured="no message", hint="let the criterion judge other messages: of")


def misfit(run: Run, topic: str = "") -> Verdict | None:
    """Return the verdict where the grader could not send anything (on that topic), because the student's own message
    is defined otherwise, or because the rubric is wrong."""
    notes = (e for _, e in run.actors if e.action == "note" and e.detail.startswith((MISFIT, UNSENDABLE)))
    note = next((e for e in notes if topic in {"", e.topic}), None)
    if note is None:
        return None
    message = f"nothing could be sent on {note.topic}: {note.detail}"
    # A mistake of the rubric is not the student's.
    if note.detail.startswith(UNSENDABLE):
        return inconclusive(message, hint=f"{NOTHING_TO_DO}tell your instructor")
    lost = failed(message, hint="use the handout's names and types in the .msg file, and build again")
    return lost.based_on(judged_by="definition")


def _judge_refused(run: Run, topic: str) -> Verdict | None:
    refused = [e for _, e in run.recorder if e.topic == topic and e.event in {"refused", "invalid"}]
    # Where messages came all the same, the refusal is not the reason.
    if not refused or run.student_channels(topic):
        return None
    message = f"the recorder could not listen to {topic}: {refused[0].detail or refused[0].event}"
    return grade_again(message, measured="no message")
