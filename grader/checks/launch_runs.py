"""Whether a launch file brings its nodes up, under their names and connected."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import PurePosixPath
from typing import Annotated, NamedTuple

from pydantic import AfterValidator, Field

from grader.checks.launch_files import missing_node
from grader.checks.launch_params import NodeParam, params_in_place, params_misplaced
from grader.checks.registry import DependencyName, LaunchName, ProgramName, check
from grader.checks.support.launch import (
    NOTHING_STARTS,
    died,
    is_exact,
    node_slips,
    nodes_up,
    not_executable,
    not_run,
    not_started,
    quoted,
    refusal,
    why_died,
    why_not_up,
)
from grader.checks.support.launch_connections import (
    RENAMES,
    blame_place,
    blame_renaming,
    blame_same_script,
    ended_by_itself,
    ended_soon,
    find_renaming,
    over_another_topic,
    wrong_name,
)
from grader.checks.support.launch_slips import (
    Slip,
    include_slips,
    later_fixes,
    nodes_of_program,
    nodes_of_script,
    out_of_comment,
    own_script,
    read_launch,
    refusals,
)
from grader.checks.support.parameters import absolute_name
from grader.checks.support.processes import GlobalName, early_end, run_slips
from grader.checks.support.scripts import asks_for_wrapper, shebang_obstacles
from grader.checks.support.text import near_names
from grader.checks.support.topics import SYSTEM_TOPICS, cite, connected_nodes, nodes_on
from grader.evidence.run import Run
from grader.model.launch_file import LaunchFile, LaunchNode
from grader.model.package import PackageFacts
from grader.model.record import Record
from grader.model.verdict import FileCitation, Status, Verdict, failed, failed_or_blocked, joined, passed
from grader.wording import is_one_edit, join_words, plural, there_is

NodeName = Annotated[str, AfterValidator(absolute_name)]
"""With its slash, also where a rubric leaves it out."""


class LaunchConnectsParams(Record):
    """Nodes that the launch file brings up."""

    launch: LaunchName
    """The launch file's name, in whatever folder of the package it lies."""
    topic: GlobalName
    """The topic over which the nodes are connected, with its slash."""
    nodes: tuple[str, ...] = ()
    """Names of nodes that have to come up."""


@check("launch-connects", params=LaunchConnectsParams, heeds_losses=True)
def launch_connects(package: PackageFacts, run: Run, params: LaunchConnectsParams) -> Verdict:
    """The launch file brings up nodes that are connected.

    What it checks
        That the launch file is well-formed, and that `roslaunch` brings up a publisher and a subscriber
        that are connected over the topic.

    Why it matters on a robot
        A robot is started with launch files. With one wrong attribute in one of them, a part of the robot
        is missing without anybody noticing.

    How it is measured
        `roslaunch` runs the file, which is found by its name anywhere in the package, and both nodes are
        asked whom they are connected to; the kernel's table of connections has to confirm it. Any two nodes
        of the package will do, under any names. Nodes that come up earn half, and the connection the other
        half.

    How to fix
        One `<node pkg="…" type="….py" name="…"/>` for each script, with the `.py`; the scripts have to be executable.
        `roslaunch <package> <file>`, then `rosnode list` and `rostopic info <topic>` show what came up.
    """
    expected = f"{params.launch} brings up a publisher and a subscriber connected over {params.topic}"
    file = read_launch(package, params.launch)
    if isinstance(file, Verdict):
        return file.about(expected=expected)
    pairs, nodes = list(connected_nodes(package, run, params.topic)), run.student_nodes()
    dead = [Wanted(one, own=True) for one in file.brings if died(run, one) is not None]
    gone = {name for one in dead for name in nodes_up(run, one.node)}
    found = [pair for pair in pairs if gone.isdisjoint(pair)]
    verdict = (
        not_run(run)
        or _names_missing(nodes, file, params)
        or (_judge_deaths(package, run, dead, "came up, but then") if pairs and not found else None)
        or (None if found else _why_unconnected(package, file, run, params))
        or passed(f"roslaunch connects {found[0][0]} and {found[0][1]} over {params.topic}")
    )
    up = [name for name in params.nodes or nodes[:2] if f"/{name.lstrip('/')}" in set(nodes) - gone]
    # A connection needs two nodes, also where the lab names none.
    share = len(up) / (len(params.nodes) or 2) / 2 + (0.5 if found else 0.0)
    verdict = verdict.in_part(share if up else 0.0, _came_up(up, connected=bool(found)))
    cited = verdict.citations or (FileCitation(file=file.path, line=1), cite(run, "/grader/graph"))
    return verdict.about(expected=expected, measured=_listed_nodes(run), citations=cited)


def _came_up(names: Sequence[str], *, connected: bool = False) -> str:
    over = ", and there is a connection" if connected else ""
    return f"{join_words(names)} {'comes' if len(names) == 1 else 'come'} up{over}"


def _listed_nodes(run: Run) -> str:
    nodes = run.student_nodes()
    return f"{plural(len(nodes), 'node')}: {join_words(nodes)}" if nodes else "no node came up"


def _names_missing(nodes: tuple[str, ...], file: LaunchFile, params: LaunchConnectsParams) -> Verdict | None:
    missing = [n for n in params.nodes if f"/{n.lstrip('/')}" not in nodes]
    if not missing or not nodes:
        return None
    cited = (FileCitation(file=file.path, line=1),)
    hint = "the `name` in the launch file is the node's name"
    return failed(f"{join_words(missing)} did not come up; {there_is(nodes)}", hint=hint, citations=cited)


def _why_unconnected(
    package: PackageFacts, file: LaunchFile, run: Run, params: LaunchConnectsParams
) -> Verdict:
    """Return why no two nodes are connected: a wrong attribute, an error of roslaunch's, or what the graph shows."""
    if wrong := node_slips(package, file, run):
        return wrong
    nodes = run.student_nodes()
    ends = [nodes_on(run, params.topic, end) for end in ("publishers", "subscribers")]
    absent = [node for node in file.brings if not nodes_up(run, node)]
    # With a node at both ends, one that is absent is not what keeps them apart.
    if absent and not all(ends):
        return _absent(package, run, nodes, absent)
    if len(nodes) < 2:
        if skipped := _skipped(package, file, nodes):
            return skipped
        message = f"{_comes_up(nodes)}; the file declares {plural(len(file.nodes), 'node')}{quoted(run)}"
        return failed(message, hint="give the talker and the listener a <node> each")
    other = over_another_topic(run, params.topic, quoted(run))
    blamed = (
        blame_renaming(package, run, file, file.brings, topic=params.topic, verdict=other)
        or blame_same_script(package, run, file.brings, params.topic, other)
        or blame_place(package, file, file.brings, params.topic, other)
    )
    return blamed.based_on(unjudged=False) if blamed else other


def _skipped(package: PackageFacts, file: LaunchFile, nodes: Sequence[str]) -> Verdict | None:
    """Return the verdict where a node of the package's is in the file, and an `if`, an `unless` or a comment leaves it
    out; None where none is."""
    # A <node> may have the program with its `.py` or without.
    own = {
        name for one in package.files for name in (PurePosixPath(one.path).name, PurePosixPath(one.path).stem)
    }
    for kind, line, said in file.switched_off:
        if kind in own:
            cited = (FileCitation(file=file.path, line=line),)
            message = f"{_comes_up(nodes)}; {said} on line {line} leaves the <node> of {kind} out"
            return failed(message, hint="; then ".join(later_fixes(file, kind)), citations=cited)
    for kind, line in file.commented:
        if kind in own:
            cited = (FileCitation(file=file.path, line=line),)
            message = f"{_comes_up(nodes)}; the <node> of {kind} on line {line} is in a comment, which roslaunch skips"
            return failed(message, hint=out_of_comment(line), citations=cited)
    return None


def _comes_up(nodes: Sequence[str]) -> str:
    return f"only {_came_up(nodes)}" if nodes else "no node comes up"


def _absent(package: PackageFacts, run: Run, nodes: Sequence[str], absent: Sequence[LaunchNode]) -> Verdict:
    """Return why nodes of the launch file did not come up: all that lack the executable bit, or the first."""
    own = (script for node in absent if (script := own_script(package, node)))
    scripts = [script for script in own if not asks_for_wrapper(package, script.path)]
    plain = [script for script in scripts if script.executable is False]
    unstarted = {script.path: script for script in scripts if any(shebang_obstacles(script))}
    several = bool(plain) or len(unstarted) > 1
    if plain:
        why = not_executable(*plain)
    elif several:
        why = not_started(*unstarted.values())
    else:
        why = why_not_up(package, run, absent[0])
    # What roslaunch prints is added only where no better reason is known, and once.
    said = "" if why.citations or why.unbuilt or quoted(run) in why.why else quoted(run)
    if not why.citations:
        why = why._replace(citations=(absent[0].place,))
    name = "" if several else f"{absent[0].full_name}: "
    return why.verdict(f"{_comes_up(nodes)}; {name}{why.why}{said}")


class LaunchRunsParams(Record):
    """What the launch file brings up."""

    launch: LaunchName
    """The launch file's name, in whatever folder of the package it lies."""
    topic: GlobalName | None = None
    """A topic over which the nodes are connected, with its slash; null: none is asked for."""
    scripts: tuple[str, ...] = ()
    """The student's scripts that have to run, or C++ programs by their names."""
    nodes: Annotated[dict[NodeName, DependencyName], Field(default_factory=dict)]
    """Names of nodes that have to come up, each with the package that it comes from."""
    programs: tuple[ProgramName, ...] = ()
    """Programs of other packages that have to run, under any name: `turtlesim/turtlesim_node`."""
    params: Annotated[dict[NodeParam, int | float | str], Field(default_factory=dict)]
    """Parameters and their values; they have to be where the node of the first program reads them."""


class Wanted(NamedTuple):
    """A node that has to come up, and whether it is a script of the student's."""

    node: LaunchNode
    own: bool


@check("launch-runs", params=LaunchRunsParams, heeds_losses=True)
def launch_runs(package: PackageFacts, run: Run, params: LaunchRunsParams) -> Verdict:
    """The launch file brings up its nodes under the names that it gives them.

    What it checks
        That `roslaunch` brings up every node that the lab asks for under the name in the launch file, that
        two of them are connected over the topic if the lab asks for one, and that parameters are where the
        node reads them.

    Why it matters on a robot
        All other tools and files use the names in the launch file. A node that comes up under another name,
        or in another namespace, runs and talks to no one.

    How it is measured
        `roslaunch` runs the file. The master says which names the nodes have; both nodes and the operating
        system say whether they are connected.
        `<arg>`, `ns` and `<group>` are resolved, and `$(anon x)` may be followed by anything. Names given
        to `init_node` do not matter. If the lab names only one node, it may be connected to any other of
        the package's. Parameters are read as they were when the node started. Nodes, connection and
        parameters count equally, and each of several nodes or parameters earns its share.

    How to fix
        `roslaunch <package> <file>` prints in red what it could not start; `rosnode list`, `rostopic info
        <topic>` and `rosparam list` show what came up. `output="screen"` shows what a node prints.
    """
    expected = _expected(params)
    file = read_launch(package, params.launch, (*params.scripts, *params.programs))
    if isinstance(file, Verdict):
        # A file that cannot be read is charged by launch-xml, where scripts are asked for.
        return file.about(expected=expected).based_on(unjudged=bool(params.scripts))
    share, right = _right_parts(package, file, run, params)
    verdict = (
        not_run(run)
        or _find_unnamed(package, file, params, found=bool(right))
        or _judge_nodes(package, file, run, params)
    ).in_part(share, right)
    ended = early_end(run)
    refused = refusal(run, package) if ended is not None else None
    if verdict.status is Status.FAIL and not verdict.basis.cause and refused is not None:
        verdict = verdict.based_on(cause=refused.why)
    citations = verdict.citations or (FileCitation(file=file.path, line=1), cite(run, "/grader/graph"))
    return verdict.about(expected=expected, measured=_listed_nodes(run), citations=citations)


def _expected(params: LaunchRunsParams) -> str:
    what = [
        *(PurePosixPath(s).name for s in params.scripts),
        *(f"{name} ({origin})" for name, origin in params.nodes.items()),
        *params.programs,
    ]
    over = f", connected over {params.topic}" if params.topic else ""
    given = join_words(f"{name} {value}" for name, value in params.params.items())
    over += f", with {given}" if given else ""
    return f"{params.launch} brings up {join_words(what) or 'its nodes'} under the names in the file{over}"


def _judge_nodes(package: PackageFacts, file: LaunchFile, run: Run, params: LaunchRunsParams) -> Verdict:
    """By what came up. The file names all that is wanted."""
    wanted = list(_wanted_nodes(package, file, run, params))
    lacking = next((w for w in wanted if not nodes_up(run, w.node)), None)
    if lacking is not None:
        return _not_up(package, file, run, lacking)
    names = [name for w in wanted for name in nodes_up(run, w.node)]
    if params.topic and not _are_connected(package, run, params.topic, names, alone=len(wanted) < 2):
        return _not_connected(package, file, run, wanted, params.topic)
    if params.topic and (ended := ended_soon(run, [w.node for w in wanted], params.topic)):
        return ended_by_itself(package, run, file, ended)
    if lost := _judge_deaths(package, run, wanted, "came up, but then") or _stopped_clock(package, run, file):
        return lost
    if params.programs and params.params:
        # `_find_unnamed` has seen to it that there is one.
        program = nodes_of_program(file, params.programs[0])[0]
        misplaced = params_misplaced(run, file, nodes_up(run, program), params.params)
        if misplaced is not None:
            return misplaced
    over = f", connected over {params.topic}" if params.topic else ""
    return passed(f"roslaunch brings up {join_words(dict.fromkeys(names))}{over}")


def _right_parts(
    package: PackageFacts, file: LaunchFile, run: Run, params: LaunchRunsParams
) -> tuple[float, str]:
    """Return the share of what is asked that is right, and what that is: nodes that came up and live, their
    connection, and parameters. Nothing is where no node came up."""
    nodes = {PurePosixPath(script).name: _of_script(package, file, run, script) for script in params.scripts}
    for name in params.nodes:
        wrong = _wrong_name(file, name, params.nodes) or _find_swap(file, name, params)
        nodes[name] = [] if wrong else _nodes_named(file, name)[:1]
    nodes |= {program: list(nodes_of_program(file, program)[:1]) for program in params.programs}
    up = [
        name
        for name, found in nodes.items()
        if found and all(nodes_up(run, one) and why_died(package, run, one) is None for one in found)
    ]
    topic, every = params.topic, [one for found in nodes.values() for one in found]
    connected = (
        topic is not None
        and any(connected_nodes(package, run, topic))
        and not ended_soon(run, every, topic)
        and not _stopped_clock(package, run, file)
    )
    if not up:
        misnamed = [one for name, pkg in params.nodes.items() for one in _misnamed(file, name, pkg)]
        # Under other names, nodes still earn what their connection is worth.
        if not (connected and len(misnamed) == len(params.nodes) > 0):
            return 0.0, ""
        pair = join_words(name for one in misnamed for name in nodes_up(run, one))
        return 0.5, f"{pair} are connected"
    shares, right = [len(up) / len(nodes)], _came_up(up, connected=connected)
    shares += [float(connected)] if params.topic else []
    if params.programs and params.params:
        of = [name for one in nodes[params.programs[0]] for name in nodes_up(run, one)]
        set_right = params_in_place(run, of, params.params)
        shares.append(len(set_right) / len(params.params))
        right += f", with the right {join_words(set_right)}" if set_right else ""
    return sum(shares) / len(shares), right


def _wanted_nodes(
    package: PackageFacts, file: LaunchFile, run: Run, params: LaunchRunsParams
) -> Iterator[Wanted]:
    for script in params.scripts:
        yield from (Wanted(node, own=True) for node in _of_script(package, file, run, script))
    own = {package.name, *(one.name for one in package.also)}
    for name in params.nodes:
        yield from (Wanted(node, own=node.pkg in own) for node in _nodes_named(file, name)[:1])
    for program in params.programs:
        node = nodes_of_program(file, program)[0]
        yield Wanted(node, own=node.pkg in own)


def _of_script(package: PackageFacts, file: LaunchFile, run: Run, script: str) -> list[LaunchNode]:
    """All that surely run the script. Where an `if` that only roslaunch works out decides, those that came up do."""
    found = nodes_of_script(package, file, script)
    exact = [n for n in found if n.type == PurePosixPath(script).name] or list(found)
    certain = [n for n in exact if not n.uncertain]
    return certain or [n for n in exact if nodes_up(run, n)] or exact[:1]


def _find_unnamed(
    package: PackageFacts, file: LaunchFile, params: LaunchRunsParams, *, found: bool
) -> Verdict | None:
    """The file does not even name a node that is wanted. For scripts that is launch-xml's to judge, unless there is
    something to judge here: others that are `found` running."""
    missing = joined([lost for one in params.scripts if (lost := missing_node(package, file, one))])
    if missing is not None:
        there = [node for script in params.scripts for node in nodes_of_script(package, file, script)]
        renaming = find_renaming(package, there, params.topic, main=file.path) if params.topic else None
        hint = f"{missing.hint}; then in {file.path} {renaming.fix}" if renaming else missing.hint
        missing = missing.model_copy(update={"hint": hint})
        return missing.based_on(unjudged=missing.basis.unjudged or not found)
    if twins := _twins(file, params):
        return twins
    if wrong := _wrong_names(file, params):
        return wrong
    for program in params.programs:
        if not nodes_of_program(file, program):
            pkg, _, name = program.partition("/")
            of_package = [n for n in file.brings if n.pkg == pkg and n.type]
            meant = [n for n in of_package if str(n.type) in name or name in str(n.type)]
            meant = meant or [n for n in of_package if is_one_edit(str(n.type), name)]
            # A program that is asked for itself is not a slip for another one.
            meant = [n for n in meant if f"{n.pkg}/{n.type}" not in params.programs]
            if len(meant) == 1:
                return _other_type(file, meant[0], name, params)
            hint = f'add <node pkg="{pkg}" type="{name}" name="…"/>'
            seen = f"; it has {join_words(f'{n.pkg}/{n.type}' for n in file.brings)}" if file.brings else ""
            return failed(f"{file.path} has no <node> for {program}{seen}", hint=hint)
    return None


def _other_type(file: LaunchFile, node: LaunchNode, name: str, params: LaunchRunsParams) -> Verdict:
    """Return the loss by a `type` that is not quite that of the program, with wrong values of parameters behind it."""
    lines = (
        f'on line {one.line} write value="{params.params[key]}" for {key}'
        for one in file.params
        if (key := one.name.rpartition("/")[2]) in params.params
        and one.value != str(params.params[key])
        and one.attribute == "name"
    )
    fix = "; then ".join([f'on line {node.line} write type="{name}"', *lines])
    return Slip(node.file, node.line, f'{node.pkg} has no program "{node.type}"', fix).verdict()


def _twins(file: LaunchFile, params: LaunchRunsParams) -> Verdict | None:
    """Return the verdict where a second node of one name would be the one that is asked for in another namespace."""
    seen: dict[str, LaunchNode] = {}
    for node in file.brings:
        first = seen.setdefault(node.full_name, node)
        wanted = [name for name in params.nodes if name.endswith(f"/{node.name}")]
        lacking = [name for name in wanted if name not in {one.full_name for one in file.brings}]
        spaces = [line for line in node.renaming if line.tag not in RENAMES]  # of several, any may be wrong
        if first is node or not is_exact(node) or len(lacking) != 1 or len(spaces) != 1:
            continue
        lines, space = (spaces[0].line, first.line), lacking[0].rpartition("/")[0].strip("/")
        cited = tuple(FileCitation(file=node.file or file.path, line=line) for line in lines)
        message = f"two nodes are called {node.full_name} (lines {first.line} and {node.line} of {file.path})"
        hint = f'on line {lines[0]}, write ns="{space}"'
        if first.line == node.line and node.file != file.path:
            message = f"{file.path} includes {node.file} twice, and both make a node {node.full_name}"
            hint = f"in {file.path}, give one <include> of {node.file} the value for {space} in its <arg>"
        return failed(f"{message}, and {NOTHING_STARTS}", hint=hint, citations=cited)
    return None


def _misnamed(file: LaunchFile, name: str, pkg: str) -> list[LaunchNode]:
    """Return the node that runs the program of that name under another one, where there is one and no more."""
    last = name.rpartition("/")[2]
    found = [
        n for n in file.brings if n.pkg == pkg and PurePosixPath(n.type or "").stem == last and is_exact(n)
    ]
    return found if len(found) == 1 and not _nodes_named(file, name) else []


def _wrong_names(file: LaunchFile, params: LaunchRunsParams) -> Verdict | None:
    """Return all nodes that have another name or package than the lab asks for, or are not there."""
    wrong = (_wrong_name(file, name, params.nodes) or _find_swap(file, name, params) for name in params.nodes)
    return joined([one for one in wrong if one is not None])


def _wrong_name(file: LaunchFile, name: str, wanted: Mapping[str, str]) -> Verdict | None:
    found, pkg = _nodes_named(file, name), wanted[name]
    # What only roslaunch can work out may well be right.
    if any(n.pkg == pkg or "$(" in (n.pkg or "") for n in found):
        return None
    if found:
        why, at = f'{name} is a node of the package "{found[0].pkg}", not of {pkg}', found[0].line
        return Slip(found[0].file, at, why, f'on line {at}, write pkg="{pkg}"').verdict()
    meant = _meant_node(file, name, wanted)
    meant = _meant_node(file, name, wanted)
    if meant is not None:
        return wrong_name(meant, name).verdict()
    if slip := next(include_slips(file), None):
        return slip.verdict()  # what an <include> does not bring may be the node
    if switched := _switched_off(file, name):
        return switched.verdict()
    others = [n.full_name for n in file.brings]
    near = near_names(name, others) or tuple(others)
    seen = f"; it has {join_words(near)}" if near else ""
    space, _, own = name.lstrip("/").rpartition("/")
    inside = f' ns="{space}"' if space else ""
    return failed(
        f"{file.path} has no node {name}{seen}", hint=f'add <node pkg="{pkg}" name="{own}"{inside} …/>'
    )


def _switched_off(file: LaunchFile, name: str) -> Slip | None:
    """Return that an `if` or `unless` leaves out the node that is asked for, or the only one that it leaves out."""
    off = [one for one in file.switched_off if PurePosixPath(one[0]).stem == name.rpartition("/")[2]]
    found = off or file.switched_off
    if len(found) != 1:
        return None
    kind, line, said = found[0]
    why = f"{file.path} has no node {name}: {said} on line {line} leaves the <node> of {kind} out"
    return Slip(file.path, line, why, "; then ".join(later_fixes(file, kind)))


def _meant_node(file: LaunchFile, name: str, wanted: Mapping[str, str]) -> LaunchNode | None:
    """Return the node that only has another name or namespace than the one that is asked for; None where several, or
    none, may be meant. `wanted` are all that are asked for, with their packages."""
    lacking = [one for one in wanted if not _nodes_named(file, one)]
    meant = {one: _free_node(file, one, wanted) for one in lacking}
    rivals = [one for one in lacking if meant[one] == meant[name]]
    node = meant[name]
    return node if node and name == (near_names(node.full_name, rivals) or rivals)[0] else None


def _free_node(file: LaunchFile, name: str, wanted: Mapping[str, str]) -> LaunchNode | None:
    own, others = name.rpartition("/")[2], [n for n in file.brings if n.full_name not in wanted]
    programs = {one.rpartition("/")[2] for one in wanted} - {own}
    stems = {n.full_name: PurePosixPath(n.type or "").stem for n in others if n.pkg == wanted[name]}
    near = near_names(name, [full for full, stem in stems.items() if stem not in programs])
    near = near or tuple(full for full, stem in stems.items() if stem == own)
    of_space = [full for full in near if full.rpartition("/")[0] == name.rpartition("/")[0]]
    meant = of_space[0] if len(of_space) == 1 else near[0] if near else ""
    return next((n for n in others if n.full_name == meant and is_exact(n)), None)


def _find_swap(file: LaunchFile, name: str, params: LaunchRunsParams) -> Verdict | None:
    """The name of one node is on the program of another: `/talker` runs listener.py."""
    for node in _nodes_named(file, name):
        program = PurePosixPath(node.type or "").stem
        if f"/{program}" != name and f"/{program}" in params.nodes:
            swapped = any(n.full_name == f"/{program}" for n in file.brings)
            why = f"{name} runs {node.type}, whose name is /{program}" + ": the names are swapped" * swapped
            fix = f'write name="{program}" beside type="{node.type}"'
            return Slip(node.file, node.line, why, fix).verdict()
    return None


def _nodes_named(file: LaunchFile, name: str) -> list[LaunchNode]:
    exact = [n for n in file.brings if n.full_name == name]
    # A name that only roslaunch can work out may be this one.
    return exact or [n for n in file.brings if not is_exact(n) and "$(anon" not in n.full_name]


def _not_up(package: PackageFacts, file: LaunchFile, run: Run, lacking: Wanted) -> Verdict:
    """A slip of the file's first, then what roslaunch and the script say."""
    if slip := next(refusals(package, file), None):
        # Slips on the student's own nodes are charged by launch-xml.
        return slip.verdict(quoted(run)).based_on(unjudged=lacking.own)
    node = lacking.node
    absence = why_not_up(package, run, node)
    name = node.full_name if is_exact(node) else f"the node of {node.type}"
    verdict = absence.verdict(f"{name} did not come up: {absence.why}", judged=not lacking.own)
    place = FileCitation(file=node.file or file.path, line=node.line)
    if NOTHING_STARTS in absence.why:  # what keeps all nodes from starting stands anywhere in the file
        place = absence.citations[0] if absence.citations else FileCitation(file=file.path)
    return verdict.about(citations=(place,))


def _are_connected(package: PackageFacts, run: Run, topic: str, names: list[str], *, alone: bool) -> bool:
    """Return whether two of the nodes are connected; where the lab names one `alone`, or none, it with any other."""
    pairs = list(connected_nodes(package, run, topic))
    if alone:
        return any(not names or {*pair} & {*names} for pair in pairs)
    return any({*pair} <= {*names} for pair in pairs)


def _judge_deaths(package: PackageFacts, run: Run, wanted: list[Wanted], when: str) -> Verdict | None:
    for one in wanted:
        if absence := why_died(package, run, one.node):
            verdict = failed_or_blocked if one.own else failed
            message = f"{one.node.full_name} {when} {absence.why}"
            return verdict(message, hint=absence.hint, citations=absence.citations)
    return None


TURN_NS = 500_000_000
"""What a node publishes in the first turn of its loop comes within this time."""


def _stopped_clock(package: PackageFacts, run: Run, file: LaunchFile) -> Verdict | None:
    """Return that no time goes by for the file's nodes: they are to take it from a simulator, and there is none. Nodes
    that publish again, or never sleep, do without."""
    set_at = next((p for p in reversed(file.params) if p.name == "/use_sim_time"), None)
    if set_at is None or set_at.value not in {"true", "True", "1"} or run.clock == "warped":
        return None
    came = [c for c in run.student_channels() if c.messages and c.topic not in SYSTEM_TOPICS]
    spans_ns = [c.times_ns[-1] - c.times_ns[0] for c in came]
    waits = max(spans_ns) < TURN_NS if came else run_slips(package, run, "rate-number", "rate-parameter")
    if not waits or run.student_channels("/clock") or nodes_on(run, "/clock", "publishers"):
        return None
    why = "/use_sim_time is true, and nothing publishes /clock: each node waits in its first sleep for ever"
    return failed(
        f"{set_at.file}, line {set_at.line}: {why}",
        hint=f"delete line {set_at.line}",
        citations=(set_at.place,),
    )


def _not_connected(
    package: PackageFacts, file: LaunchFile, run: Run, wanted: list[Wanted], topic: str
) -> Verdict:
    """A node that died, the launch file's remaps and namespaces, or the scripts' own topics."""
    if dead := _judge_deaths(package, run, wanted, "came up, but before it was connected"):
        return dead
    if ended := ended_soon(run, [w.node for w in wanted], topic):
        return ended_by_itself(package, run, file, ended)
    other, nodes = over_another_topic(run, topic), [w.node for w in wanted]
    of_launch_file = blame_renaming(
        package, run, file, nodes if len(nodes) > 1 else file.brings, topic=topic, verdict=other
    ) or blame_place(package, file, nodes, topic, other)
    other = of_launch_file or other.based_on(unjudged=True)
    return other.based_on(unjudged=other.basis.unjudged and all(w.own for w in wanted))
