"""Whether a launch file is well-formed and names the nodes that it has to start, and whether it opens a web page."""

from __future__ import annotations

import re
from collections.abc import Iterator
from difflib import get_close_matches
from itertools import chain, count
from pathlib import PurePosixPath
from typing import NamedTuple

from grader.checks.executable import ExecutableParams, executable
from grader.checks.registry import LaunchName, ProgramName, check
from grader.checks.support.build_errors import repair_of_file
from grader.checks.support.launch import (
    console_lines,
    died,
    nodes_up,
    not_run,
    quoted,
    refusal,
    why_died,
    why_not_up,
)
from grader.checks.support.launch_slips import (
    OF_SOURCE,
    Slip,
    built_fixes,
    find_launch,
    has_program,
    hints_at_their_lines,
    illegal_name,
    include_slips,
    later_fixes,
    node_slip,
    nodes_of_program,
    nodes_of_script,
    out_of_comment,
    read_launch,
    refusals,
    starts_built,
)
from grader.checks.support.scripts import CPP_SUFFIXES, RIGHT_SHEBANG, add_hint, find_script, programs
from grader.checks.support.shell_scripts import find_obstacle, unclosed_quote, value_given
from grader.checks.support.text import near_names, shown
from grader.checks.support.topics import cite
from grader.evidence.run import Run
from grader.installable import known_packages
from grader.model.launch_file import LAUNCH_TAGS, LaunchFile, LaunchNode
from grader.model.package import PackageFacts, SourceFile
from grader.model.record import Record
from grader.model.verdict import (
    Citations,
    FileCitation,
    Status,
    Verdict,
    failed,
    failed_or_blocked,
    joined,
    passed,
)
from grader.wording import join_words, plural, there_is


class LaunchXmlParams(Record):
    """What the launch file has to name."""

    launch: LaunchName
    """The launch file's name, in whatever folder of the package it lies."""
    scripts: tuple[str, ...] = ()
    """The student's scripts that it has to start, or C++ programs by their names."""
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
        count, nor does `<test>`. Another criterion judges whether the scripts are executable. If roslaunch
        can read the file, each node earns its share.

    How to fix
        One `<node pkg="<package>" type="<file>.py" name="<name>" output="screen"/>` for each script, all of
        them between `<launch>` and `</launch>`. `roslaunch --nodes <package> <file>` lists what it finds.
    """
    wanted = [PurePosixPath(s).name for s in params.scripts] + list(params.programs)
    nodes = f"a <node> with pkg, type and name for {join_words(wanted)}"
    expected = f"{params.launch}: <launch> at its root, and {nodes}"
    file = read_launch(package, params.launch, wanted)
    if isinstance(file, Verdict):
        return _with_next(file, package, params).about(expected=expected)
    lacking = _lacking(package, file, params)
    illegal = next(filter(None, map(illegal_name, file.brings)), None)
    if lacking is not None and illegal is not None:
        advice = f"{lacking.message}; besides, line {illegal.line}: {illegal.why}: {illegal.fix}"
        lacking = lacking.model_copy(update={"message": advice})
    verdict = lacking or passed(
        f"{file.path} has a <node> for {join_words(wanted)}", hint=_advice(package, file)
    )
    seen = f"{plural(len(file.brings), 'node')}: {join_words(map(_node_text, file.brings))}"
    citations = verdict.citations or (FileCitation(file=file.path, line=1),)
    measured = seen if file.brings else "no <node>"
    return verdict.about(expected=expected, measured=measured, citations=citations)


def _with_next(verdict: Verdict, package: PackageFacts, params: LaunchXmlParams) -> Verdict:
    """Return the verdict on a file that is not well-formed with what is wrong besides, as far as nodes can be read."""
    file = find_launch(package, params.launch)
    names = [PurePosixPath(script).name for script in params.scripts]
    found = (
        _slip_for(package, node.model_copy(update={"file": node.file or file.path}), name)
        for node in (file.readable if file is not None else ())
        for name in names
        if file is not None
        and file.fault is not None
        # What is on the fault's own line is told with the fault.
        and node.line != file.fault.line
        and _is_meant(node, name)
    )
    slips = list(dict.fromkeys(slip for slip in found if slip is not None))
    if not slips:
        return verdict
    message = f"{verdict.message}; with that repaired, {'; '.join(f'line {s.line}: {s.why}' for s in slips)}"
    hint = "; then ".join((verdict.hint, *dict.fromkeys(f"on line {s.line} {s.fix}" for s in slips)))
    cited = tuple(s.place for s in slips)
    update = {"message": message, "hint": hint, "citations": (*verdict.citations, *cited)}
    return verdict.model_copy(update=update)


def _lacking(package: PackageFacts, file: LaunchFile, params: LaunchXmlParams) -> Verdict | None:
    """Return why roslaunch starts nothing, or nodes are not there; those that are there earn their share."""
    refused = next(refusals(package, file), None)
    found = {PurePosixPath(script).name: missing_node(package, file, script) for script in params.scripts}
    found |= {program: _program(package, file, program) for program in params.programs}
    losses = [one for one in (refused.verdict() if refused else None, *found.values()) if one]
    lost = joined(hints_at_their_lines(losses))
    right = [name for name, one in found.items() if one is None]
    # From a file that it refuses, roslaunch starts nothing.
    return lost and lost.in_part(0.0 if refused else len(right) / len(found), join_words(right))


def missing_node(package: PackageFacts, file: LaunchFile, script: str) -> Verdict | None:
    """Return why the file starts no node of this script, None where it does."""
    name = PurePosixPath(script).name
    if nodes_of_script(package, file, script) and _exists(package, name):
        return None
    if not _exists(package, name) and not any(name in {one.target, one.name} for one in programs(package)):
        message = f"there is no {name} in the package that a <node> could start"
        if unread := package.cmake and package.cmake.fault if not PurePosixPath(name).suffix else None:
            message = f"{message}, as far as {unread.file} can be read"
            return failed_or_blocked(message, hint=f"first fix {unread.file}: {repair_of_file(unread)}")
        hint = "; then ".join((add_hint(package, script), *later_fixes(file, name)))
        return failed_or_blocked(message, hint=hint).lost_by("file-missing", script)
    meant = (_slip_for(package, node, name) for node in file.brings if _is_meant(node, name))
    slip = next(filter(None, meant), None)
    built = starts_built(package, file, name)
    if slip is None and not built:
        slip = _of_its_words(package, file, name)
    if slip is None and built:
        message = (
            f"{file.path} has no <node> for {name}: line {built[0].line} starts {built[0].type}, which is C++"
        )
        return failed(message, hint="; ".join(built_fixes(package, file, name)), citations=(built[0].place,))
    # What the program is shows once roslaunch starts it.
    if slip and f'type="{name}"' not in slip.fix and any(node.line == slip.line for node in built):
        slip = slip._replace(fix="; ".join((slip.fix, *built_fixes(package, file, name))))
    return slip.verdict() if slip else _no_node(package, file, package.name, name)


def _of_its_words(package: PackageFacts, file: LaunchFile, name: str) -> Slip | None:
    """Return the slip of the only node whose program is missing, where no other than the script can be meant, or its
    name is made of words of the script's, or the other way round: `first_node` for `first_node_publisher`."""
    absent = [(node, slip) for node in file.brings if (slip := node_slip(package, node)) and slip.lacks]
    words, fix = set(re.split(r"[\W_]+", PurePosixPath(name).stem.casefold())), f'write type="{name}"'
    found = [
        slip
        for node, slip in absent
        if (own := set(re.split(r"[\W_]+", PurePosixPath(node.type or "").stem.casefold()))) <= words
        or words <= own
        or slip.fix == fix
    ]
    return found[0]._replace(fix=fix) if len(found) == 1 else None


def _program(package: PackageFacts, file: LaunchFile, program: str) -> Verdict | None:
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
    return _no_node(package, file, pkg, name)


def _slip_for(package: PackageFacts, node: LaunchNode, name: str) -> Slip | None:
    slip = node_slip(package, node)
    unknown = f"{node.pkg}" not in {*package.others, *known_packages()} and "$(" not in f"{node.pkg}"
    if slip is None and node.pkg != package.name and (node.type == name or unknown):
        fix = f'write pkg="{package.name}"' + (f' and type="{name}"' if node.type != name else "")
        return Slip(node.file, node.line, f'pkg="{node.pkg}" is not the package of {name}', fix)
    written = PurePosixPath(node.type or "")
    if slip is not None and node.pkg == package.name and written.suffix in CPP_SUFFIXES:
        same = written.stem == PurePosixPath(name).stem
        return slip._replace(why=OF_SOURCE.format(written), fix=f'write type="{name}"') if same else slip
    return slip


def _is_meant(node: LaunchNode, name: str) -> bool:
    written, stem = PurePosixPath(node.type or "").name, PurePosixPath(name).stem
    # A node under the script's name is meant to run it, whatever its `type`.
    return written in {name, stem} or bool(near_names(name, [written])) or node.name == stem


def _no_node(package: PackageFacts, file: LaunchFile, pkg: str, name: str) -> Verdict:
    message = f"{file.path} has no <node> for {name}"
    for place, why, hint in _in_its_place(file, pkg, name):
        cited = place if isinstance(place, FileCitation) else FileCitation(file=file.path, line=place)
        return failed(f"{message}: {why}", hint=hint, citations=(cited,))
    # What an <include> does not bring may be the node.
    if slip := next(include_slips(file), None):
        return slip.verdict()
    return failed(message, hint=_add_node(package, file, pkg, name))


def _add_node(package: PackageFacts, file: LaunchFile, pkg: str, name: str) -> str:
    """Return where to add a node: below its neighbour of the same package where that is in a group, or has a remap of
    its own, which the new one then needs too."""
    moved = [node for node in file.brings if node.pkg == pkg and node.renaming]
    beside, tag = (moved[-1] if moved else None), _node_tag(file, pkg, name)
    if beside is None or len({node.namespace for node in moved}) > 1:
        return f"below <launch>, add {tag}"
    script = find_script(package, name)
    asked = {s.message for s in package.slips if script is not None and s.file == script.path}
    behind = [one for one in beside.renaming if one.tag == "remap" and one.line >= beside.line]
    remaps = "".join(
        f'<remap from="{old}" to="{new}"/>'
        for old, new in beside.remaps[len(beside.remaps) - len(behind) :]
        if old in asked and new.startswith("/")
    )
    spaces = "".join(f' ns="{line.value}"' for line in beside.renaming if line.tag == "node")
    tag = f"{tag.removesuffix('/>')}{spaces}>{remaps}</node>" if remaps else tag
    where = f"line {beside.line}{f' of {beside.file}' * (beside.file != file.path)}"
    of_group = ", inside of its <group>" * any(line.tag == "group" for line in beside.renaming)
    return f"right below the <node> on {where}{of_group}, add {tag}"


def _in_its_place(file: LaunchFile, pkg: str, name: str) -> Iterator[tuple[FileCitation | int, str, str]]:
    """Yield the place of what may be meant to be the node, what is wrong with it, and how to fix that."""
    stem = PurePosixPath(name).stem
    for test in (t for t in file.tests if t.type == name):
        fix = f"write {_node_tag(file, pkg, name)} in place of the <test>"
        yield test.place, "only rostest starts a <test>", fix
    for line in (line for kind, line in file.commented if kind in {name, stem}):
        typed = "" if (name, line) in file.commented else f', and write type="{name}" in it'
        why = f"the one on line {line} is in a comment, which roslaunch skips"
        yield line, why, f"{out_of_comment(line)}{typed}"
    for _, line, said in (one for one in file.switched_off if PurePosixPath(one[0]).stem == stem):
        fix = "; then ".join(later_fixes(file, name))
        yield line, f"{said} on line {line} leaves the one that is there out", fix
    for line in (n.line for n in file.nodes if n.pkg in {name, stem} and n.type == pkg):
        fix = f'write pkg="{pkg}" type="{name}" on line {line}'
        yield line, f"on line {line}, pkg and type are swapped", fix
    for tag, line in file.unknown_tags:
        if tag in LAUNCH_TAGS and tag != "node":
            yield (
                line,
                f"<{tag}> on line {line} starts no node",
                f"write `<node` in place of `<{tag}` on line {line}",
            )
    for tag, line in (u for u in file.unknown_tags if near_names("node", [u[0]]) or u[0].lower() == "node"):
        why, fix = f"roslaunch skips the tag <{tag}> on line {line}", "the tag is <node …>, in lower case"
        if tag == "node":
            why += ", which stands inside of another <node>"
            fix = f"end the <node> above line {line} before it begins: with `/>`, or with </node> above line {line}"
        yield line, why, fix


def _node_tag(file: LaunchFile, pkg: str, name: str) -> str:
    """Return the tag of a node, by a name that no other node of the file has: roslaunch takes none twice."""
    stem, taken = PurePosixPath(name).stem, {node.name for node in file.nodes}
    free = next(one for one in chain([stem], (f"{stem}_{i}" for i in count(2))) if one not in taken)
    return f'<node pkg="{pkg}" type="{name}" name="{free}" output="screen"/>'


def _exists(package: PackageFacts, name: str) -> bool:
    return has_program(package, name) or find_script(package, name) is not None


def _advice(package: PackageFacts, file: LaunchFile) -> str:
    """Another node that roslaunch cannot start costs nothing, nor does a name at which it only warns."""
    slip = next(filter(None, (node_slip(package, node) for node in file.brings)), None)
    if slip is None:
        slip = next(filter(None, map(illegal_name, file.brings)), None)
    return f"{slip.file}, line {slip.line}: {slip.why}; {slip.fix}" if slip else ""


def _node_text(node: LaunchNode) -> str:
    return f"{node.name or 'no name'} ({node.pkg or 'no pkg'}/{node.type or 'no type'})"


SHELL = "#!/bin/bash"
ASSIGNED = re.compile(
    r"(?P<file>[\w.-]+\.\w+): (?:line )?(?P<line>\d+): (?P<name>[A-Za-z_]\w*): (?:command )?not found$"
)
"""What bash and dash say of a name with a blank before its `=`."""


class OpensParams(Record):
    """A page that the launch file opens."""

    launch: LaunchName
    """The launch file's name, in whatever folder of the package it lies."""
    program: str = "firefox"
    """The program that is asked to open the page."""
    urls: tuple[str, ...]
    """Addresses, one of which has to be opened."""
    script: str
    """The script whose node has to run at the same time."""


class Page(NamedTuple):
    """What a program was asked to open, and when."""

    at_ns: int
    program: str
    arguments: tuple[str, ...]


@check("opens", params=OpensParams)
def opens(package: PackageFacts, build: Run, run: Run, params: OpensParams) -> Verdict:
    """The launch file's shell script opens the page, and the node runs beside it.

    What it checks
        That a `<node>` of the launch file is an executable shell script of the package, with any name, that
        opens the page in the program; and that the node runs at the same time.

    Why it matters on a robot
        Launch files start more than nodes: drivers, cameras and tools have their own start scripts, and they
        have to be executable and need a first line, as every node does.

    How it is measured
        The program is replaced by one that records what it is asked to open. The script's mode and first
        line are those of the file as handed in. A `/` at the end of the page's address does not matter. The
        page and the node earn half each.

    How to fix
        Begin the script with `#!/bin/bash`, `chmod +x` it, and write `<node pkg="<package>" type="<script>.sh"
        name="…" output="screen"/>`. `rosrun <package> <script>.sh` tries it alone.
    """
    page, node = f"{params.urls[0]} in {params.program}", PurePosixPath(params.script).name
    expected = f"a shell script in {params.launch} opens {page}, beside {node}"
    file = read_launch(package, params.launch)
    pages = _pages(run)
    measured = f"opened: {join_words(_shown_command(p) for p in pages)}" if pages else "nothing was opened"
    if isinstance(file, Verdict):
        return file.about(expected=expected)
    verdict = (
        not_run(run)
        or _script(package, build, file, params)
        or _page(package, build, file, run, params)
        or missing_node(package, file, params.script)
        or _beside(package, file, run, params)
        or passed(
            f"{join_words(n.type or '' for n in _shells(package, file))} opens "
            f"{_url(pages, params)} in {params.program}"
        )
    )
    opened = (_script(package, build, file, params) or _page(package, build, file, run, params)) is None
    alone = missing_node(package, file, params.script) or _beside(package, file, run, params)
    right = "the page" if opened else "the node beside it"
    verdict = verdict.in_part(0.5 if opened or alone is None else 0.0, right)
    citations = verdict.citations or (FileCitation(file=file.path, line=1), cite(run, "/grader/actor"))
    return verdict.about(expected=expected, measured=measured, citations=citations)


def _pages(run: Run) -> tuple[Page, ...]:
    asked = ((t, e) for t, e in run.actors if e.action == "open")
    return tuple(Page(t, e.actor, tuple(map(str, e.value or ()))) for t, e in asked)


def _shells(package: PackageFacts, file: LaunchFile) -> list[LaunchNode]:
    """Nodes of the package that are scripts, and not Python."""
    found = ((n, find_script(package, n.type or "")) for n in file.brings if n.pkg == package.name)
    return [n for n, source in found if source is not None and _is_shell(source)]


def _is_shell(source: SourceFile) -> bool:
    if source.path.endswith(".sh"):
        return not source.binary
    shell = source.shebang is not None and source.shebang.interpreter.endswith("sh")
    return not source.python and not source.binary and (shell or not source.path.endswith(".py"))


def _script(package: PackageFacts, build: Run, file: LaunchFile, params: OpensParams) -> Verdict | None:
    shells = _shells(package, file)
    if not shells:
        return _no_shell(package, file, params)
    verdicts = []
    for node in shells:
        source = find_script(package, node.type or "")
        path = source.path if source else node.type or ""
        verdict = executable(package, build, ExecutableParams(path=path))
        # The advice of that check is for Python.
        verdicts.append(verdict.model_copy(update={"hint": verdict.hint.replace(RIGHT_SHEBANG, SHELL)}))
    # One right script is enough: others may do something else.
    return None if any(v.status is Status.PASS for v in verdicts) else verdicts[0]


def _no_shell(package: PackageFacts, file: LaunchFile, params: OpensParams) -> Verdict:
    others = (n for n in file.brings if n not in nodes_of_script(package, file, params.script))
    slips = [slip for node in others if (slip := node_slip(package, node))]
    if slips:
        return slips[0].verdict()
    lying = [f.path for f in package.files if f.path.endswith(".sh")]
    seen = f"; {there_is(lying)} in the package" if lying else ""
    name = PurePosixPath(lying[0]).name if lying else "<script>.sh"
    message = f"{file.path} has no <node> that starts a shell script"
    for place, why, hint in _in_its_place(file, package.name, name):
        cited = place if isinstance(place, FileCitation) else FileCitation(file=file.path, line=place)
        return failed(f"{message}: {why}", hint=hint, citations=(cited,))
    return failed(f"{message}{seen}", hint=_add_node(package, file, package.name, name))


def _page(
    package: PackageFacts, build: Run, file: LaunchFile, run: Run, params: OpensParams
) -> Verdict | None:
    pages = _pages(run)
    mine = [p for p in pages if _is_program(p.program, params)]
    if _url(mine, params):
        return None
    cited: Citations = tuple(cite(run, "/grader/actor", p.at_ns) for p in pages[:1])
    hint = f"write {params.program} {params.urls[0]} in the script"
    if not mine and _url(pages, params):
        message = f"the page is opened in {join_words(p.program for p in pages)}, not in {params.program}"
        return failed(message, hint=hint, citations=cited)
    if mine:
        message = f"{params.program} is given {join_words(map(_arguments, mine))}, not {params.urls[0]}"
        if blank := _blanks(run, mine):
            where = f"{PurePosixPath(blank['file']).name}, line {blank['line']}"
            message += f": in {where}, the shell takes {blank['name']} for a command, as a space follows it"
            hint = f"write {blank['name']}=… in {where}, without spaces around the `=`"
        elif slip := _misspelt_address(package, build, file, params):
            hint = f"{slip.file}: {slip.fix}"
        elif slip := _obstacle(package, build, file, params) or _unread_variable(
            package, build, file, params
        ):
            cited = (slip.place, *cited)
            message, hint = f"{message}: {slip.why} ({slip.file}, line {slip.line})", slip.fix
        return failed(message, hint=hint, citations=cited)
    if slip := next(refusals(package, file), None):
        return slip.verdict(quoted(run))
    if absence := refusal(run, package):
        return absence.verdict(absence.why)
    slip = _misspelt_program(package, file, run, params)
    obstacle = None if slip else _obstacle(package, build, file, params)
    slip = slip or obstacle or _unread_variable(package, build, file, params)
    hint = f"{slip.file}: {slip.fix}" if slip else hint
    why = (
        f": {obstacle.why} ({obstacle.file}, line {obstacle.line})"
        if obstacle
        else _words(package, file, run)
    )
    cited = (slip.place,) if slip else ()
    return failed(f"the script opens nothing in {params.program}{why}", hint=hint, citations=cited)


def _obstacle(package: PackageFacts, build: Run, file: LaunchFile, params: OpensParams) -> Slip | None:
    """Return the line of a shell script that keeps it from opening the page."""
    for node in _shells(package, file):
        source = find_script(package, node.type or "")
        lines = build.file_lines(source.path) if source is not None else ()
        given = bool(node.args)
        found = unclosed_quote(lines) or find_obstacle(lines, params.program, params.urls[0], given=given)
        if source is not None and found is not None:
            return Slip(source.path, found.number, found.why, found.fix)
    return None


NOT_FOUND = re.compile(r"/(?P<file>[^/\s]+): line (?P<line>\d+): (?P<name>\S+): command not found")


def _misspelt_program(package: PackageFacts, file: LaunchFile, run: Run, params: OpensParams) -> Slip | None:
    """Return the line of a shell script that calls the program by a slip of its name."""
    paths = {PurePosixPath(path).name: path for path in _shell_scripts(package, file)}
    for found in filter(None, map(NOT_FOUND.search, console_lines(run))):
        if found["file"] in paths and near_names(params.program, [found["name"]]):
            fix = f"on line {found['line']}, write {params.program} instead of {found['name']}"
            return Slip(paths[found["file"]], int(found["line"]), "", fix)
    return None


def _unread_variable(package: PackageFacts, build: Run, file: LaunchFile, params: OpensParams) -> Slip | None:
    """Return the line of a shell script that has the address in a variable, and does not give the program its value."""
    for path in _shell_scripts(package, file):
        lines = build.file_lines(path)
        assigned = [
            m[1]
            for line in lines
            if (m := _ASSIGNMENT.match(line)) and _plain(m[2]) in map(_plain, params.urls)
        ]
        for number, line in enumerate(lines, start=1):
            if assigned and re.match(rf"\s*{re.escape(params.program)}\b", line):
                # A shell takes the value that was set last.
                right = value_given(line.strip(), assigned[-1])
                why = f"it is not given the value of {assigned[-1]}"
                return Slip(path, number, why, f"on line {number}, write `{right}`") if right else None
    return None


def _shell_scripts(package: PackageFacts, file: LaunchFile) -> list[str]:
    scripts = (find_script(package, node.type or "") for node in _shells(package, file))
    return [source.path for source in scripts if source is not None]


def _misspelt_address(
    package: PackageFacts, build: Run, file: LaunchFile, params: OpensParams
) -> Slip | None:
    """Return the line of a shell script that has nearly the address that is asked for."""
    for path in _shell_scripts(package, file):
        for number, line in enumerate(build.file_lines(path), start=1):
            # A comment may quote the handout's address.
            words = re.findall(r"[^\s\"'=#]{4,}", line.partition(" #")[0])
            words = [word for word in words if _plain(word) not in map(_plain, params.urls)]
            if near := get_close_matches(params.urls[0], words, 1, _NEAR_ADDRESS):
                fix = f"on line {number}, write {params.urls[0]} instead of {shown(near[0])}"
                return Slip(path, number, f"the address is {shown(near[0])}", fix)
    return None


_NEAR_ADDRESS = 0.9
_ASSIGNMENT = re.compile(r"\s*(?:export\s+)?([A-Za-z_]\w*)=[\"']?([^\"'\s]+)")


def _blanks(run: Run, pages: list[Page]) -> re.Match[str] | None:
    """Return what the shell said of `URL = …`, where no address came to the program because of that."""
    # A dot or a slash is of an address, so the variable was not empty.
    if any(re.search(r"[./]", argument) for page in pages for argument in page.arguments):
        return None
    return next(filter(None, (ASSIGNED.search(line) for line in console_lines(run))), None)


def _words(package: PackageFacts, file: LaunchFile, run: Run) -> str:
    shell = re.compile(
        r"command not found|No such file|[Ss]yntax error|not found$|bad interpreter|cannot launch node"
    )
    if found := next((line for line in console_lines(run) if shell.search(line)), ""):
        return f": {shown(found)}"
    code = next((code for node in _shells(package, file) if (code := died(run, node)) is not None), None)
    return f": it died with exit code {code}" if code is not None else quoted(run)


def _beside(package: PackageFacts, file: LaunchFile, run: Run, params: OpensParams) -> Verdict | None:
    node = nodes_of_script(package, file, params.script)[0]
    ended = why_died(package, run, node)
    if nodes_up(run, node) and ended is None:
        return None
    absence = ended or why_not_up(package, run, node)
    return absence.verdict(f"the page is opened, but {node.type} does not run beside it: {absence.why}")


def _is_program(name: str, params: OpensParams) -> bool:
    """`firefox-esr` is Firefox, as Debian calls it."""
    return name == params.program or name.startswith(f"{params.program}-")


def _url(pages: list[Page] | tuple[Page, ...], params: OpensParams) -> str:
    wanted = {_plain(url) for url in params.urls}
    return next((a for p in pages for a in p.arguments if _plain(a) in wanted), "")


def _plain(url: str) -> str:
    """Host and scheme in small letters, no slash at the end."""
    scheme, mark, rest = url.strip("'\" ").rpartition("://")
    host, slash, path = rest.partition("/")
    return f"{scheme.lower()}{mark}{host.lower()}{slash}{path}".rstrip("/")


def _shown_command(page: Page) -> str:
    return shown(f"{page.program} {' '.join(page.arguments)}")


def _arguments(page: Page) -> str:
    return shown(" ".join(page.arguments)) or "nothing"
