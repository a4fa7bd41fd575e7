"""Whether nodes of a launch file are connected over a topic, and why not.

What `ns` and `<remap>` make of its name, which of them to remove to have the right one, and which names scripts write.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Sequence
from itertools import pairwise
from pathlib import PurePosixPath
from typing import NamedTuple

from grader.checks.registry import Check
from grader.checks.support.clocks import excused, why_late
from grader.checks.support.launch import finished, nodes_up
from grader.checks.support.launch_slips import Slip, own_script
from grader.checks.support.processes import TYPES_HINT, disputed_types, run_scripts
from grader.checks.support.text import LOOP, SPIN
from grader.checks.support.topics import End, nodes_on, topics_with
from grader.evidence.events import GraphEvent
from grader.evidence.run import Run
from grader.model.launch_file import LaunchFile, LaunchLine, LaunchNode
from grader.model.package import PackageFacts
from grader.model.python_slip import PythonSlip
from grader.model.verdict import FileCitation, Verdict, failed
from grader.wording import join_words, on_lines

UNRESOLVED = "$("
CONNECTED_WITHIN_S = 3.0
"""Nodes that were on a topic together for longer, and not connected, differ in its type."""
ENDS: tuple[End, ...] = ("publishers", "subscribers")
RENAMES = ("remap", "args")
"""Where a launch file gives a topic another name by itself; any other line does it by a namespace."""


class Renaming(NamedTuple):
    """What renames a topic, a clause after `the launch file`; what gives the topic its name back; and the lines."""

    why: str
    fix: str
    citations: tuple[FileCitation, ...]


class _Use(NamedTuple):
    """A node, and how its script writes the topic's name."""

    node: LaunchNode
    name: str

    def space(self, gone: Collection[LaunchLine | None] = ()) -> str:
        """Return the node's namespace, with both slashes, without the lines that are `gone`."""
        found = [line for line in self.node.renaming if line.tag not in RENAMES]
        if not any(line in gone for line in found):
            return self.node.namespace
        space = "/"
        for line in found:
            if line not in gone:
                value = line.value.strip("/")
                space = f"/{value}/" if line.value.startswith("/") else f"{space}{value}/"
        return space

    def topic(self, gone: Collection[LaunchLine | None] = (), space: str = "") -> str:
        """Return the topic's whole name, as ROS resolves it: first by the namespace, then by the remaps. Lines that
        are `gone` do not count; `space` is another namespace than the node's."""
        space = space or self.space(gone)
        table = {_whole(self.node, old, space): new for old, new, line in self._lines() if line not in gone}
        whole = _whole(self.node, self.name, space)
        return _whole(self.node, table.get(whole, whole), space)

    def remaps(self, gone: Collection[LaunchLine | None] = ()) -> list[tuple[str, LaunchLine | None]]:
        """Return the new names that `<remap>`s give the topic, with their lines where they are known."""
        space = self.space(gone)
        whole = _whole(self.node, self.name, space)
        return [(new, line) for old, new, line in self._lines() if _whole(self.node, old, space) == whole]

    def _lines(self) -> Iterator[tuple[str, str, LaunchLine | None]]:
        lines = [line for line in self.node.renaming if line.tag in RENAMES]
        # Some remaps may come without their line: which line is whose is not known then.
        known = len(lines) == len(self.node.remaps)
        for index, (old, new) in enumerate(self.node.remaps):
            yield old, new, lines[index] if known else None


def find_renaming(
    package: PackageFacts, nodes: Sequence[LaunchNode], topic: str, run: Run | None = None, *, main: str = ""
) -> Renaming | None:
    """Return what in the launch file gives the topic another name in these nodes. None unless it has the right one in
    all of them once that is put right, and the nodes have names of their own still. `run` shows which topics the
    nodes had; lines of other files than `main` are told with these."""
    uses = [use for node in nodes if (use := _use_of(package, node, topic, run))]
    return _renaming_of(uses, topic, main)


def _renaming_of(uses: Sequence[_Use], topic: str, main: str) -> Renaming | None:
    wrong = [use for use in uses if use.topic() != topic]
    if not wrong:
        return None
    # What removes least is tried first.
    for some in (wrong, uses):
        spaces = {line for use in some for line in use.node.renaming if line.tag not in RENAMES}
        for dropped in (spaces, set[LaunchLine](), spaces):
            gone: set[LaunchLine | None] = {*dropped}
            if dropped is not spaces or not _is_right(uses, gone, topic):
                gone |= {line for use in some for _, line in use.remaps(gone)}
            if gone and _is_right(uses, gone, topic):
                return _described(uses, topic, gone, main)
    return _moved(uses, wrong, topic)


def _is_right(uses: Sequence[_Use], gone: Collection[LaunchLine | None], topic: str) -> bool:
    names = {f"{use.space(gone)}{use.node.name}" for use in uses}
    return len(names) == len(uses) and all(use.topic(gone) == topic for use in uses)


def _moved(uses: Sequence[_Use], wrong: Sequence[_Use], topic: str) -> Renaming | None:
    """Return the namespaces that nodes have to be in for the topic, which is in one itself, to have its name."""
    slips = list[Slip]()
    for use in wrong:
        space = topic.removesuffix(use.name)
        if not space.endswith("/") or space == "/" or use.topic(space=space) != topic:
            return None
        slip = wrong_name(use.node, f"{space}{use.node.name}")
        right = (one for one in uses if one.topic() == topic)
        if any(
            line.line == slip.line and line.file == slip.file for one in right for line in one.node.renaming
        ):
            return None  # it would take others out of theirs
        slips.append(slip)
    nodes = join_words(use.node.full_name for use in wrong)
    spaces = join_words(dict.fromkeys(topic.removesuffix(use.name).strip("/") for use in wrong))
    why = f"has {nodes} outside of the namespace {spaces}"
    cited = tuple(dict.fromkeys(slip.place for slip in slips))
    return Renaming(why, "; ".join(dict.fromkeys(slip.fix for slip in slips)), cited)


def _named_in(package: PackageFacts, node: LaunchNode) -> list[PythonSlip]:
    script = own_script(package, node)
    path = script.path if script is not None else None
    return [s for s in package.slips if s.file == path and s.kind in {"publisher", "subscriber"}]


def _use_of(package: PackageFacts, node: LaunchNode, topic: str, run: Run | None) -> _Use | None:
    """Return how the node's script writes the name, if that gives a topic that the node had: the only name in it, or
    one that can be the topic's."""
    written = {slip.message for slip in _named_in(package, node)}
    had = _topics(run, node) if run is not None else None
    resolvable = UNRESOLVED not in f"{node.namespace}{node.remaps}"
    # of a topic that belongs into the node's namespace, the script writes what is behind it
    names = [topic[place + 1 :] for place, letter in enumerate(topic) if letter == "/"]
    usual = (topic.removeprefix(node.namespace).lstrip("/"), topic.lstrip("/"), *names, topic)
    for name in dict.fromkeys(written if len(written) == 1 else usual) if resolvable else ():
        use = _Use(node, name)
        if (not written or name in written) and (had is None or use.topic() in had):
            return use
    return None


def _topics(run: Run, node: LaunchNode) -> set[str]:
    names = set(nodes_up(run, node))
    ends = (ends for _, event in run.graph for ends in (event.publishers, event.subscribers))
    return {topic for topics in ends for topic, there in topics.items() if names & set(there)}


def _described(uses: Sequence[_Use], topic: str, gone: Collection[LaunchLine | None], main: str) -> Renaming:
    """Return what the lines that are to be `gone` make of the topic, and how to remove them."""
    why, fixes, lines = list[str](), list[str](), list[LaunchLine]()
    found = [line for use in uses for line in use.node.renaming if line in gone and line.tag not in RENAMES]
    remaps = [(use.name, *one) for use in uses for one in use.remaps(gone) if one[1] in gone]
    moved = [use.node for use in uses if use.topic() != topic]
    if found:
        spaces = dict.fromkeys(node.namespace.strip("/") for node in moved if node.namespace != "/")
        why.append(f"puts its nodes in the namespace{'s' * (len(spaces) > 1)} {join_words(spaces)}")
        given = [f'ns="{value}"' for value in dict.fromkeys(line.value for line in found)]
        fixes.append(f"{join_words(given)}{_in_lines(found, main)}")
        lines += found
    if remaps:
        names = join_words(dict.fromkeys(name for name, _, _ in remaps))
        why.append(f"remaps {names} to {join_words(dict.fromkeys(new for _, new, _ in remaps))}")
        known = [line for _, _, line in remaps if line is not None]
        if known and all(line.tag == "args" for line in known):
            words = join_words(dict.fromkeys(f"{name}:={new}" for name, new, _ in remaps))
            fixes.append(f"{words} from the args{_in_lines(known, main)}")
        else:
            fixes.append(f"the <remap>{'s' * (len(set(known)) != 1)} of {names}{_in_lines(known, main)}")
        lines += known
    places = sorted({(one.file, one.line) for one in (lines or moved)})
    cited = tuple(FileCitation(file=file, line=line) for file, line in places)
    named = dict.fromkeys(use.name for use in uses if use.topic() != topic)
    then = f"then {join_words(named)} {'is' if len(named) == 1 else 'are'} {topic}"
    return Renaming(" and ".join(why), f"remove {' and '.join(fixes)}: {then}", cited[:8])


def _in_lines(found: Sequence[LaunchLine], main: str) -> str:
    """Return the lines, with their file where it is another one than the launch file itself."""
    numbers, files = sorted({line.line for line in found}), sorted({line.file for line in found})
    of_file = f" of {join_words(files)}" if main and files != [main] else ""
    return f" on {on_lines(numbers)}{of_file}" if numbers else ""


def wrong_name(node: LaunchNode, name: str) -> Slip:
    """Return the line that gives a node another full name than this one, and what to write there."""
    space, _, own = name.rpartition("/")
    lines = [line for line in node.renaming if line.tag not in RENAMES]
    spaces = [line.value.strip("/") for line in lines]
    spare = [n for n in range(len(lines)) if "/".join(spaces[:n] + spaces[n + 1 :]) == space.strip("/")]
    in_place = node.namespace == f"{space}/"
    args = [a for a in node.by_args if a.tag == "name" and (in_place or a.file == node.file)]
    at: LaunchLine | LaunchNode = args[0] if args and node.name != own else node
    attribute = at.value if isinstance(at, LaunchLine) else "name"
    fixes = [] if node.name == own else [f'on line {at.line}, write {attribute}="{own}"']
    adds = f'add ns="{space.strip("/")}" to the <node>'
    if in_place:
        pass
    elif spare:
        at = lines[spare[-1]]
        then = "the names of two namespaces are joined" if len(lines) > 1 else f"then {own} is {name}"
        fixes.insert(0, f'remove ns="{at.value}" on line {at.line}: {then}')
    elif len(lines) == 1:
        at, value = lines[0].by_arg or lines[0], lines[0].value
        attribute = at.value if at is not lines[0] else "ns"
        fixes.insert(
            0, f'on line {at.line}, write {attribute}="{space.strip("/")}", not {attribute}="{value}"'
        )
    else:
        before = "take the <node> out of its groups, and " if lines else ""
        fixes.insert(0, f"on line {node.line}, {before}{adds}")
    why = f"the node of {node.type} is called {node.full_name}, not {name}"
    return Slip(at.file, at.line, why, "; ".join(fixes))


def _whole(node: LaunchNode, name: str, space: str) -> str:
    """Return a name of a node's as ROS resolves it in this namespace, which has both slashes."""
    private = f"{node.name}/{name[1:].lstrip('/')}" if name.startswith("~") else name
    return private if private.startswith("/") else f"{space}{private}"


def _idle_remaps(run: Run, nodes: Sequence[LaunchNode], topic: str) -> Renaming | None:
    """Return the `<remap>`s to the topic, of a name that none of these nodes has; None unless they are alike, and the
    nodes that have them are connected over one other topic."""
    wrong = [
        (line, old, had & _connected(run, topic))
        for node in nodes
        if (had := _topics(run, node) - {"/rosout"})
        and (tags := [line for line in node.renaming if line.tag == "remap"])
        and len(node.remaps) == len(tags)
        for (old, new), line in zip(node.remaps, tags, strict=True)
        if _whole(node, new, node.namespace) == topic and _whole(node, old, node.namespace) not in had
    ]
    spaces = {
        node.namespace
        for node in nodes
        if topic in {_whole(node, new, node.namespace) for _, new in node.remaps}
    }
    olds, others = {old for _, old, _ in wrong}, {one for _, _, had in wrong for one in had}
    if not len(olds) == len(others) == len(spaces) == 1:
        return None
    old, right = olds.pop(), others.pop().removeprefix(spaces.pop())
    lines = [line for line, _, _ in wrong]
    where = on_lines(sorted(line.line for line in lines))
    why = f"remaps {old}, which is no topic of these nodes"
    return Renaming(why, f'on {where}, write from="{right}"', tuple(line.place for line in lines))


def _connected(run: Run, topic: str) -> set[str]:
    """Return the other topics over which nodes of the student's are connected."""
    return {
        c.topic
        for _, event in run.graph
        for c in event.connections
        if c.topic not in {topic, "/rosout"} and run.is_student_node(c.subscriber)
    }


def over_another_topic(run: Run, topic: str, said: str = "") -> Verdict:
    """Return why nodes that are there are not connected: other topics, other types, or an end that is missing."""
    publishers, subscribers = nodes_on(run, topic, "publishers"), nodes_on(run, topic, "subscribers")
    if (others := _connected(run, topic)) and not (publishers and subscribers):
        message = f"the nodes are connected over {join_words(sorted(others))}, not over {topic}"
        return failed(message + said, hint=f"both have to use {topic}; look for a <remap> or a namespace")
    if publishers and subscribers:
        message = (
            f"{join_words(publishers)} and {join_words(subscribers)} are both on {topic}, but not connected"
        )
        if disputed := disputed_types(run, topic):
            return failed(f"{message}{said}: {disputed}", hint=TYPES_HINT)
        return failed(message + said, hint="do both use the same message type?").if_repeated()
    lacking = "publishes on" if not publishers else "subscribes to"
    seen = topics_with(run, "subscribers" if publishers else "publishers")
    there = f"; one {lacking} {join_words(seen)}" if seen else ""
    message = f"{join_words(run.student_nodes())} are not connected: none {lacking} {topic}{there}{said}"
    hint = f"launch a talker and a listener that use {topic}; look for a <remap> or a namespace"
    return failed(message, hint=hint)


def blame_renaming(
    package: PackageFacts,
    run: Run,
    file: LaunchFile,
    nodes: Sequence[LaunchNode],
    *,
    topic: str,
    verdict: Verdict,
) -> Verdict | None:
    """Return the verdict with the lines of the launch file that give the topic another name; None where none do, or
    where both ends have the right one."""
    if all(nodes_on(run, topic, end) for end in ENDS):
        return None
    renaming = find_renaming(package, nodes, topic, run, main=file.path) or _idle_remaps(run, nodes, topic)
    if renaming is None:
        return None
    message = f"{verdict.message}: the launch file {renaming.why}"
    update = {"message": message, "hint": renaming.fix, "citations": renaming.citations}
    return verdict.model_copy(update=update)


def explain_by_late_remap(check: Check, package: PackageFacts, run: Run, verdict: Verdict) -> Verdict:
    """Return a loss with the `<remap>` that would give a topic its name, and stands below the nodes that have it."""
    if verdict.basis.cause or check.name.endswith("-xml") or any(run_scripts(run)):
        return verdict
    had = {topic for end in ENDS for topic in topics_with(run, end)}
    said = f"{verdict.message} {verdict.expected}"
    for late in (one for file in package.launch_files for one in file.late_remaps):
        ends = [topic for topic in had if f"/{topic}".endswith(f"/{late.value}")]
        ends = [topic for topic in ends if topic.startswith(late.namespace)]
        spaces = {topic.removesuffix(late.value.lstrip("/")) for topic in ends}
        meant = {
            late.to if late.to.startswith("/") else f"{space}{late.to}"
            for space in spaces
            if space.endswith("/")
        }
        if any(topic not in had and re.search(rf"{re.escape(topic)}(?![\w/])", said) for topic in meant):
            why = f"the <remap> on line {late.line} of {late.file} has no effect on the nodes above it"
            hint = f"move the <remap> from line {late.line} of {late.file} to above line {late.above}"
            return verdict.explained(why, hint, (late.place,), cause=why)
    return verdict


def blame_same_script(
    package: PackageFacts, run: Run, nodes: Sequence[LaunchNode], topic: str, verdict: Verdict
) -> Verdict | None:
    """Return the verdict with the lines that all start one script, where another one of the package is for the end that
    is missing; None where the nodes run several scripts."""
    scripts = [own_script(package, node) for node in nodes]
    same = scripts[0] if scripts else None
    if len(nodes) < 2 or same is None or any(one is None or one.path != same.path for one in scripts):
        return None
    lacking = "publisher" if nodes_on(run, topic, "subscribers") else "subscriber"
    ends = (s for s in package.slips if s.kind == lacking and s.file != same.path)
    others = sorted({s.file for s in ends if s.message.strip("/") == topic.strip("/")})
    if not others:
        return None
    meant = [(n, o) for n in nodes for o in others if PurePosixPath(o).stem == n.name] or [
        (nodes[-1], others[0])
    ]
    node, name = meant[0][0], PurePosixPath(meant[0][1]).name
    lines = join_words(str(one.line) for one in nodes)
    message = f"{verdict.message}: lines {lines} both start {nodes[0].type}"
    update = {
        "message": message if len(nodes) == 2 else message.replace(" both ", " all "),
        "hint": f'on line {node.line}, write type="{name}"',
        "citations": tuple(one.place for one in nodes),
    }
    return verdict.model_copy(update=update)


def blame_place(
    package: PackageFacts, file: LaunchFile, nodes: Sequence[LaunchNode], topic: str, verdict: Verdict
) -> Verdict | None:
    """Return the verdict with the namespaces that keep nodes apart, or with the scripts' own names for the topic; None
    where the launch file puts none of the nodes into a namespace and remaps nothing."""
    blamed = _blame_scripts(package, file, verdict, nodes, topic)
    moved = [node for node in nodes if node.remaps or node.namespace != "/"]
    if blamed is None and len({node.namespace for node in moved} - {"/"}) > 1:
        return _in_namespaces(file, verdict, moved, topic)
    return blamed if moved or blamed is None else blamed.based_on(unjudged=True)


def _in_namespaces(file: LaunchFile, verdict: Verdict, nodes: Sequence[LaunchNode], topic: str) -> Verdict:
    """Name the namespaces of a launch file that starts the same nodes in several, and the lines that make them."""
    spaces = list(dict.fromkeys(node.namespace.strip("/") for node in nodes if node.namespace != "/"))
    found = [line for n in nodes for line in n.renaming if line.tag not in RENAMES]
    places = {(line.file, line.line) for line in found} or {(n.file or file.path, n.line) for n in nodes}
    types = join_words(dict.fromkeys(str(node.type or node.name) for node in nodes))
    outside = f'write one more <node> for each of {types}, outside of <group ns="{spaces[0]}">'
    update = {
        "message": f"{verdict.message}: the launch file puts its nodes in the namespaces {join_words(spaces)}",
        "hint": f"{outside}: in it, {topic.lstrip('/')} becomes /{spaces[0]}{topic}",
        "citations": tuple(FileCitation(file=path, line=line) for path, line in sorted(places))[:4],
    }
    return verdict.model_copy(update=update)


def together_s(run: Run, topic: str) -> float:
    """Return how long the topic had a publisher and a subscriber of the student's at the same time."""

    def has_both(event: GraphEvent) -> bool:
        ends = (event.publishers.get(topic, ()), event.subscribers.get(topic, ()))
        return all(any(map(run.is_student_node, nodes)) for nodes in ends)

    return sum(after - at for (at, event), (after, _) in pairwise(run.graph) if has_both(event)) / 1e9


def ended_soon(run: Run, nodes: Iterable[LaunchNode], topic: str) -> list[LaunchNode]:
    """Return the nodes that ran to their own end while others still connect to them; whether one did, is chance."""
    ended = [node for node in nodes if finished(run, node)]
    return ended if together_s(run, topic) < CONNECTED_WITHIN_S else []


def ended_by_itself(
    package: PackageFacts, run: Run, file: LaunchFile, ended: Sequence[LaunchNode]
) -> Verdict:
    """Return that nodes ended too soon to be connected, and the loop that let them, where one is seen."""
    alone = "itself" if len(ended) == 1 else "themselves"
    message = f"{join_words(n.full_name for n in ended)} came up and ended by {alone} before others connected"
    scripts = {one.path for n in ended if (one := own_script(package, n)) is not None}
    kinds = ("never-begun", "loop-left")
    left = next((s for s in package.slips if s.kind in kinds and s.file in scripts), None)
    if left is not None:
        verdict = failed(f"{message}: {left.message}", hint=left.fix, citations=(left.place,))
    else:
        cited = tuple(FileCitation(file=n.file or file.path, line=n.line) for n in ended)
        names = {n.full_name for n in ended}
        talks = any(c.messages for c in run.student_channels() if c.callerid in names)
        alive = f"publish in a loop `{LOOP}`" if talks else f"end with {SPIN}"
        verdict = failed(message, hint=f"keep it alive: {alive}", citations=cited)
    if left is not None and (left.kind == "never-begun" or left.name == "once"):
        return verdict.if_repeated()  # it ends as soon on any machine
    # on a quicker machine, the others may connect to it before it ends
    return excused(verdict.if_repeated(), run, run.start_ns, run.end_ns, why_late)


def _blame_scripts(
    package: PackageFacts, file: LaunchFile, verdict: Verdict, nodes: Sequence[LaunchNode], topic: str
) -> Verdict | None:
    """Name the lines of the scripts that have another topic, and what gives the right one another name then. None where
    it is not plain how to have the topic in all nodes."""
    uses = [use for node in nodes if (use := _use_of(package, node, topic, None))]
    spaces = [
        one.namespace for one in file.brings if one.namespace != "/" and topic.startswith(one.namespace)
    ]
    name = topic.removeprefix(max(spaces, key=len, default="/"))
    wrong = [use for use in uses if use.topic() != topic]
    # A name that would be right in another namespace is left as it is, if that helps.
    others = [use for use in wrong if not f"/{topic}".endswith(f"/{use.name}")]
    for changed in (others, wrong) if len(uses) > 1 else ():
        right = [_Use(use.node, name) if use in changed else use for use in uses]
        named = [_named_in(package, use.node) for use in changed]
        renaming = _renaming_of(right, topic, file.path)
        if all(len(found) == 1 for found in named) and (renaming or _is_right(right, (), topic)):
            break
    else:
        return None
    slips = list(dict.fromkeys(one for found in named for one in found))
    if not slips:
        return verdict if renaming is not None else None
    lines = join_words(f"line {one.line} of {one.file}" for one in slips)
    before = join_words(dict.fromkeys(one.message for one in slips))
    hint = f"write {name} on {lines}, not {before}"
    if renaming is not None:
        hint = f"{hint}; then in {file.path} {renaming.fix}"
    cited = (*(one.place for one in slips), *(renaming.citations if renaming is not None else ()))
    return verdict.model_copy(update={"hint": hint, "citations": cited})
