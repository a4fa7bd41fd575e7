"""Whether a launch file is well-formed and names the nodes that it has to start."""

from __future__ import annotations

from pathlib import PurePosixPath

from grader.checks.registry import LaunchName, ProgramName, check
from grader.checks.support.launch import (
    Slip,
    has_program,
    illegal_name,
    node_slip,
    nodes_of_program,
    nodes_of_script,
    read_launch,
    refusals,
)
from grader.checks.support.scripts import add_hint, find_script, programs
from grader.checks.support.text import near_names
from grader.model.package import LaunchFile, LaunchNode, PackageFacts
from grader.model.record import Record
from grader.model.verdict import FileCitation, Verdict, failed, passed, unjudged
from grader.wording import join_words, plural


class LaunchXmlParams(Record):
    """What the launch file has to name."""

    launch: LaunchName
    """The launch file's name, in whatever folder of the package it lies."""
    scripts: tuple[str, ...] = ()
    """The student's scripts that it has to start."""
    programs: tuple[ProgramName, ...] = ()
    """Nodes of other packages that it has to start: `turtlesim/turtlesim_node`."""


@check("launch-xml", params=LaunchXmlParams)
def launch_xml(package: PackageFacts, params: LaunchXmlParams) -> Verdict:
    """The launch file is well-formed and names its nodes.

    What it checks
        That the file is well-formed XML with `<launch>` at its root, and has a `<node>` for each script:
        `pkg` is the package, `type` a program that exists in it (the file's name, `.py` included), `name` is
        there, has no slash and is given once.

    Why it matters on a robot
        `roslaunch` starts nothing at all from a file that it cannot read, and skips a node whose program it
        cannot find, with one line among many others.

    How it is measured
        The file is found by its name anywhere in the package and read without being run, with the files of
        the package that it includes, its `<arg>`s and groups. What `if` or `unless` switches off does not
        count, nor does `<test>`. The executable bit is not this check's business.

    How to fix
        One `<node pkg="<package>" type="<file>.py" name="<name>" output="screen"/>` for each script, all of
        them between `<launch>` and `</launch>`. `roslaunch --nodes <package> <file>` lists what it finds.
    """
    wanted = [PurePosixPath(s).name for s in params.scripts] + list(params.programs)
    nodes = f"a <node> with pkg, type and name for {join_words(wanted)}"
    expected = f"{params.launch}: <launch> at its root, and {nodes}"
    file = read_launch(package, params.launch)
    if isinstance(file, Verdict):
        return file.about(expected=expected)
    refused = next(refusals(package, file), None)
    verdict = (
        (refused.verdict() if refused else None)
        or next(filter(None, (missing_node(package, file, script) for script in params.scripts)), None)
        or next(filter(None, (_program(file, program) for program in params.programs)), None)
        or passed(f"{file.path} has a <node> for {join_words(wanted)}", hint=_advice(package, file))
    )
    seen = f"{plural(len(file.brings), 'node')}: {join_words(map(_shown, file.brings))}"
    citations = verdict.citations or (FileCitation(file=file.path, line=1),)
    measured = seen if file.brings else "no <node>"
    return verdict.about(expected=expected, measured=measured, citations=citations)


def missing_node(package: PackageFacts, file: LaunchFile, script: str) -> Verdict | None:
    """Return why the file starts no node of this script, None where it does."""
    name = PurePosixPath(script).name
    if nodes_of_script(package, file, script) and _exists(package, name):
        return None
    if not _exists(package, name) and not any(name in {one.target, one.name} for one in programs(package)):
        message = f"there is no {name} in the package that a <node> could start"
        return unjudged(message, hint=add_hint(script))
    meant = (_slip_for(package, node, name) for node in file.brings if _is_meant(node, name))
    slip = next(filter(None, meant), None)
    return slip.verdict() if slip else _no_node(file, package.name, name)


def _program(file: LaunchFile, program: str) -> Verdict | None:
    if nodes_of_program(file, program):
        return None
    pkg, _, name = program.partition("/")
    for node in file.brings:
        if node.pkg == pkg and near_names(name, [str(node.type)]):
            why = f"{pkg} has no program {node.type}"
            return Slip(node.file, node.line, why, f'write type="{name}"').verdict()
        if node.type == name:
            why = f'{name} is not in the package "{node.pkg}"'
            return Slip(node.file, node.line, why, f'write pkg="{pkg}"').verdict()
    return _no_node(file, pkg, name)


def _slip_for(package: PackageFacts, node: LaunchNode, name: str) -> Slip | None:
    """The slip in a node that is meant to run this script."""
    slip = node_slip(package, node)
    if slip is None and node.type == name and node.pkg != package.name:
        why = f'pkg="{node.pkg}" is another package than that of {name}'
        return Slip(node.file, node.line, why, f'write pkg="{package.name}"')
    return slip


def _is_meant(node: LaunchNode, name: str) -> bool:
    written = PurePosixPath(node.type or "").name
    stem = PurePosixPath(name).stem
    return written in {name, stem} or bool(near_names(name, [written])) or node.name == stem


def _no_node(file: LaunchFile, pkg: str, name: str) -> Verdict:
    """No node is even meant for it."""
    message = f"{file.path} has no <node> for {name}"
    if test := next((t for t in file.tests if t.type == name), None):
        cited = (FileCitation(file=test.file, line=test.line),)
        message = f"{message}: a <test> is started by rostest only"
        return failed(message, hint="write <node …>", citations=cited)
    unknown = (u for u in file.unknown_tags if near_names("node", [u[0]]) or u[0].lower() == "node")
    for tag, line in unknown:
        cited = (FileCitation(file=file.path, line=line),)
        message = f"{message}: roslaunch skips the tag <{tag}> of line {line}"
        return failed(message, hint="the tag is <node …>, in lower case", citations=cited)
    return failed(message, hint=f'add <node pkg="{pkg}" type="{name}" name="…" output="screen"/>')


def _exists(package: PackageFacts, name: str) -> bool:
    return has_program(package, name) or find_script(package, name) is not None


def _advice(package: PackageFacts, file: LaunchFile) -> str:
    """Another node that roslaunch cannot start costs nothing, nor does a name at which it only warns."""
    slip = next(filter(None, (node_slip(package, node) for node in file.brings)), None)
    if slip is None:
        slip = next(filter(None, map(illegal_name, file.brings)), None)
    return f"{slip.file}, line {slip.line}: {slip.why}; {slip.fix}" if slip else ""


def _shown(node: LaunchNode) -> str:
    return f"{node.name or 'no name'} ({node.pkg or 'no pkg'}/{node.type or 'no type'})"
