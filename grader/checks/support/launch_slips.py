"""What a launch file itself says: which nodes it starts, and the slips in its lines that keep them from starting."""

from __future__ import annotations

import posixpath
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import PurePosixPath, PureWindowsPath
from typing import NamedTuple

from grader.checks.registry import Check
from grader.checks.support.scripts import (
    BUILD_FIRST_HINT,
    CPP_SUFFIXES,
    add_hint,
    can_be_moved,
    cmake_calls,
    find_script,
    is_elsewhere,
    move_hint,
    paths_by_name,
    programs,
    scripts_of_role,
)
from grader.checks.support.text import near_names, shown
from grader.evidence.run import Run
from grader.installable import PROGRAMS_OF_ROS, install_command, known_packages
from grader.model.file_fault import Fault
from grader.model.launch_file import SUBSTITUTION, LaunchFile, LaunchLine, LaunchNode
from grader.model.package import Executable, PackageFacts, SourceFile
from grader.model.verdict import (
    FileCitation,
    MistakeKind,
    Verdict,
    failed,
    failed_or_blocked,
    machine_lacks,
)
from grader.wording import ON_THE_MACHINE, has_role_of, join_words, on_lines, there_is

OTHER_ATTRIBUTES = {"package": "pkg", "exec": "type", "executable": "type", "script": "type"}
"""What ROS 2, or plain English, calls them."""

UNRESOLVED = "$("

ATTRIBUTES = ("pkg", "type", "name")


class Slip(NamedTuple):
    """What is wrong with a line of a launch file, and what to write. `of_manifest`: the manifest's name is at fault;
    `refused`: roslaunch starts nothing at all; `lacks`: the program that is not there."""

    file: str
    line: int
    why: str
    fix: str
    of_manifest: bool = False
    refused: bool = False
    lacks: str = ""

    @property
    def place(self) -> FileCitation:
        """The line."""
        return FileCitation(file=self.file, line=self.line)

    def verdict(self, said: str = "") -> Verdict:
        """Return the verdict with what roslaunch said (`said`) at the end."""
        message = f"{self.file}, line {self.line}: {self.why}{said}"
        return (failed_or_blocked if self.of_manifest else failed)(
            message, hint=self.fix, citations=(self.place,)
        )


PROGRAMS_OF = {
    "rospy_tutorials": ("listener.py", "talker.py", "listener", "talker"),
    "turtlesim": ("turtlesim_node", "turtle_teleop_key", "draw_square", "mimic"),
    "rviz": ("rviz",),
    "rqt_graph": ("rqt_graph",),
}
"""What tutorials start of ROS's own packages."""


def programs_hint(package: str) -> str:
    """Return how to find what a package has to start."""
    return f"write the name of one of its programs: `rosrun {shown(package)}` and Tab, twice, shows them"


def find_launch(package: PackageFacts, name: str) -> LaunchFile | None:
    """Return the launch file of that name in any folder, one in `launch/` first."""
    found = [f for f in package.launch_files if PurePosixPath(f.path).name == name]
    return min(found, key=lambda f: (PurePosixPath(f.path).parts[0] != "launch", f.path), default=None)


def read_launch(package: PackageFacts, name: str, wanted: Iterable[str] = ()) -> LaunchFile | Verdict:
    """Return the launch file of that name, or the verdict if it is missing, not well-formed, or has another root.

    `wanted` are the programs that it has to start: another file that starts them may be what was meant.
    """
    file = find_launch(package, name)
    verdict = _unreadable(package, file, name, {PurePosixPath(one).name for one in wanted})
    if file is None or verdict is not None:
        return (verdict or failed(f"{name} cannot be read")).about(measured="no launch file that can be read")
    return file


def _unreadable(
    package: PackageFacts, file: LaunchFile | None, launch: str, wanted: set[str]
) -> Verdict | None:
    if file is None:
        return _absent(package, launch, wanted)
    if file.fault is None:
        return None
    line = f", line {file.fault.line}" if file.fault.line else ""
    message = f"{file.path}{line} is not well-formed: {file.fault.explanation}"
    hint = (
        file.fault.advice
        or "close every element, begin the file with `<launch>`, and end it with `</launch>`"
    )
    return failed(message, hint=hint, citations=(file.fault.place,))


def _absent(package: PackageFacts, launch: str, wanted: set[str]) -> Verdict:
    """Return that the launch file is not there, and which other one may be meant: one of nearly its name, or one that
    starts the same programs."""
    started = {f.path: f.starts(wanted) for f in package.launch_files if f.nodes}
    full = package.launches_of(wanted)
    programs = wanted if full else {_program_meant(package, one) for one in wanted}
    guessed = [] if full else package.launches_of(programs)[:1]
    others, names = [f.path for f in package.launch_files], paths_by_name(package)
    near = [names[n] for n in near_names(launch, names)]
    near += [p for n, p in names.items() if n == f"{PurePosixPath(launch).stem}.xml" and p not in near]
    seen = f"; {there_is(dict.fromkeys([*near, *others]))}" if near or others else ""
    files = {file.path: file for file in package.launch_files}
    if starting := full or guessed:
        called = sorted(_called_in(package, files[starting[0]], one) for one in programs)
        which = "which" if starting == others else f"and {join_words(starting)}"
        seen += f", {which} {'each start' if len(starting) > 1 else 'starts'} {join_words(called)}"
    parts = {} if full else _parts_started(started)
    if parts:
        alone = [*parts] == others
        begun = {path: _called_in(package, files[path], name) for path, name in parts.items()}
        seen += (
            f", which starts {begun[others[0]]}"
            if alone and len(others) == 1
            else f", and {join_words(f'{path} starts {name}' for path, name in begun.items())}"
        )
    movable = [p for p in near if can_be_moved(p, launch) and (not wanted or started.get(p, wanted))]
    movable += full[:1] if len(full) == 1 else []
    path = f"{_launch_folder(package)}/{launch}"
    hint = move_hint(package, movable[0], path) if movable else add_hint(package, path)
    if guessed and not movable:
        hint = f"{hint}, or {move_hint(package, guessed[0], path)} if that is meant to be it"
    if full and movable:
        fixes = [one for name in sorted(wanted) for one in built_fixes(package, files[movable[0]], name)]
        hint = f"{hint}; then {join_words(fixes)}" if fixes else hint
    broken = [
        f for f in package.launch_files if f.fault and wanted and wanted <= {one.type for one in f.readable}
    ]
    if len(broken) == 1 and broken[0].fault and not movable and not guessed:
        fault = broken[0].fault
        seen += f", and {broken[0].path}, which is not well-formed, is to start {join_words(sorted(wanted))}"
        repair = fault.advice or f"make line {fault.line} well-formed"
        hint = f"{move_hint(package, broken[0].path, path)}; then {repair}"
    if parts and set(parts.values()) == wanted and not movable:
        hint = f"{hint}, with the <node>s of {join_words(parts)} in it"
    remark = next(iter(() if movable or guessed else package.hints_on(launch)), "").partition(": ")
    seen, hint = (f"; {remark[0]}", remark[2]) if remark[0] else (seen, hint)
    kind: MistakeKind = "file-elsewhere" if movable or guessed else "file-missing"
    cited = (FileCitation(file=movable[0] if movable else path),)
    seen += ", which is a launch file of ROS 2: roslaunch reads XML" if package.file(f"{path}.py") else ""
    return failed(f"{launch} is not in the package{seen}", hint=hint, citations=cited).lost_by(kind, path)


def _launch_folder(package: PackageFacts) -> str:
    """Return `launch`, or the folder that the package has in its place with other capitals: a file system that tells
    them apart would have both."""
    folders = {file.path.partition("/")[0] for file in package.files if "/" in file.path}
    others = sorted(one for one in folders if one.casefold() == "launch")
    return "launch" if "launch" in folders or not others else others[0]


def starts_built(package: PackageFacts, file: LaunchFile, script: str) -> list[LaunchNode]:
    """Return the nodes that start a program that CMake builds, called as the script is without its `.py`."""
    stem = PurePosixPath(script).stem
    is_built = stem != script and any(one.is_called(stem) for one in programs(package))
    off = {line for _, line, _ in file.switched_off}
    return [node for node in file.nodes if is_built and node.type == stem and node.line not in off]


def _called_in(package: PackageFacts, file: LaunchFile, script: str) -> str:
    """Return what the file starts for this script: the program that CMake builds where it is that, else the script."""
    return next((str(node.type) for node in starts_built(package, file, script)), script)


def built_fixes(package: PackageFacts, file: LaunchFile, script: str) -> list[str]:
    """Return how the nodes of `starts_built` come to start the script."""
    nodes = starts_built(package, file, script)
    return [f'write type="{script}" on line {node.line}, not type="{node.type}"' for node in nodes]


def _program_meant(package: PackageFacts, name: str) -> str:
    """Return the name of the script that may be meant to be this one, if it is missing; else the name itself."""
    alike = [] if has_program(package, name) else scripts_of_role(package, name)
    other = alike[0] if len(alike) == 1 else ""
    return PurePosixPath(other).name or name


def _parts_started(started: Mapping[str, set[str]]) -> dict[str, str]:
    """Return the launch files that start one of the programs each, no two of them the same one, and that program."""
    alone = [(path, next(iter(names))) for path, names in started.items() if len(names) == 1]
    names = [name for _, name in alone]
    return {path: name for path, name in alone if names.count(name) == 1}


def has_program(package: PackageFacts, name: str) -> bool:
    """Return whether there is a file of that name, but no source of C++, or a program that CMake builds under it."""
    if "/" not in name and not name.endswith(CPP_SUFFIXES) and find_script(package, name) is not None:
        return True
    return any(one.is_called(name) and not is_elsewhere(one, package) for one in programs(package))


OF_SOURCE = 'type="{}" is a C++ source file, which cannot be started'


def program_of_source(package: PackageFacts, name: str) -> str:
    """Return what CMake calls the program that it makes of a source of that name; "" where it makes none."""
    made = (
        one for one in programs(package) if name in {PurePosixPath(path).name for path in one.call.args[1:]}
    )
    return next((one.name for one in made if name.endswith(CPP_SUFFIXES)), "")


def node_slip(package: PackageFacts, node: LaunchNode, said: str = "") -> Slip | None:
    """Return why a node cannot start by what the file says of it, at the `<arg>` that gives its wrong name, if one
    does. Names with `$(…)` are roslaunch's to resolve.

    `said` is what roslaunch said: a package that it does not find is a slip, any other is not this package's.
    """
    slip = _slip_of_node(package, node, said)
    named = re.compile(r'(pkg|type|name)="([^"$]+)"')
    found = named.fullmatch(slip.fix.removeprefix("write ")) if slip is not None else None
    place = next((one for one in node.by_args if found and one.tag == found[1]), None)
    if slip is None or found is None or place is None:
        return slip
    return slip._replace(file=place.file, line=place.line, fix=f'write {place.value}="{found[2]}"')


def _slip_of_node(package: PackageFacts, node: LaunchNode, said: str) -> Slip | None:
    if missing := [a for a in ATTRIBUTES if not (getattr(node, a) or "").strip()]:
        return _lacking(package, node, missing)
    pkg, name = str(node.pkg), str(node.type)
    if path := next((a for a in ("pkg", "type") if "$(find" in str(getattr(node, a))), None):
        of_type = f' and type="{PurePosixPath(name).name}"' if "/" in name else ""
        return _slip(node, f"{path} is a path", f'write pkg="{package.name}"{of_type}: only the name')
    if UNRESOLVED in pkg + name:
        return None
    if owner := owner_of(package, node):
        there = has_program(owner, name)
        return None if there else _no_program(owner, node, (package, *package.also))._replace(lacks=name)
    unfound = f"[{pkg}/{name}]" in said
    near = bool(near_names(package.name, [pkg])) or _folder(package) == pkg
    if unfound or (near and pkg not in package.others and pkg not in known_packages()):
        fix = f'write pkg="{package.name}"'
        then = "" if has_program(package, name) else _no_program(package, node, (package,)).fix
        is_type = then.startswith("write type=")
        fix += f" and {then.removeprefix('write ')}" if is_type else f"; then {then}" if then else ""
        slip = _slip(node, f"there is no {name} in a package {pkg}", fix)
        # Where the launch file has the name of the folder or of project(…), the manifest is at fault.
        return slip._replace(of_manifest=pkg in {_folder(package), *_projects(package)}, lacks=name)
    return None


def _lacking(package: PackageFacts, node: LaunchNode, missing: Sequence[str]) -> Slip | None:
    """Return the slip of a node without one of the attributes that each has."""
    if node.uncertain and None not in (node.pkg, node.type, node.name):
        return None  # `if="$(eval …)"` may leave the node out where an <arg> is empty
    known = {name: OTHER_ATTRIBUTES[name] for name in node.unknown if OTHER_ATTRIBUTES.get(name) in missing}
    slips = {name: meant[0] for name in node.unknown if (meant := near_names(name, missing))} | known
    told = "".join(f"; it has no attribute {name}" for name in slips)
    fix = "; ".join(f"write {right}= instead of {name}=" for name, right in slips.items())
    stem = PurePosixPath(node.type or "<file>.py").stem
    program = f"{node.name or '<file>'}.py"
    if node.pkg and owner_of(package, node) is None:  # another package's: the name that it has is its own
        program = next((one for one in PROGRAMS_OF.get(node.pkg, ()) if one == node.name), "…")
    own = {"pkg": package.name, "type": program, "name": stem}
    add = " ".join(f'{name}="{own[name]}"' for name in missing)
    why = f"<node> has no {join_words(missing)}{told}"
    return _slip(node, why, fix or f"add {add} to the <node>")._replace(refused=True)


def at_its_lines(slip: Slip, slips: Sequence[Slip]) -> Slip:
    """Return the slip with a fix that names its line where there are others, and all lines of the same fix."""
    lines = [one.line for one in slips if one.fix == slip.fix]
    return slip._replace(fix=f"on {on_lines(lines)}, {slip.fix}") if len(slips) > 1 else slip


def hints_at_their_lines(losses: Sequence[Verdict]) -> list[Verdict]:
    """Return the losses; of several, each hint to write something names its line, or all lines of the same hint."""
    lines = [
        (one.hint, place.line)
        for one in losses
        for place in one.citations[:1]
        if isinstance(place, FileCitation)
    ]
    return [
        one.model_copy(update={"hint": f"on {on_lines(sorted(at))}, {one.hint}"})
        if len(losses) > 1
        and one.hint.startswith("write ")
        and "line" not in one.hint
        and (at := [line for hint, line in lines if hint == one.hint and line])
        else one
        for one in losses
    ]


def later_fixes(file: LaunchFile, script: str) -> Iterator[str]:
    """Yield what lets the file start a script: an `if` or `unless` that leaves its node out, and its name as `type`."""
    name = PurePosixPath(script).name
    stem = PurePosixPath(name).stem
    off = [one for one in file.switched_off if PurePosixPath(one[0]).stem == stem][:1]
    for _, line, said in off:
        other = ", or give its <arg> the other default" if "$(arg" in said else ""
        yield f"remove {said} from line {line}{other}"
    named = [(kind, f"in the <node> below line {line}") for kind, line, _ in off]
    named += [(node.type, f"on line {node.line}") for node in file.brings if node.type == stem]
    yield from (f'write type="{name}" {place}, not type="{kind}"' for kind, place in named if kind != name)


def unset_arg_fixes(file: LaunchFile, told: str, given: Iterable[str] = ()) -> Iterator[str]:
    """Yield what to write for each argument of the file that has no value, that is not `given` on the command line
    (`a:=5`), and that is not told yet."""
    names = {word.partition(":=")[0] for word in given}
    for arg in file.unset_args:
        begins = f'<arg name="{arg.name}" '
        written = f'{begins}default="…"/>'
        # a name that is nearly that of an argument is told as that: `$(arg right), not $(arg slip)`
        if begins not in told and f"not $(arg {arg.name})" not in told and arg.name not in names:
            yield (
                f"on line {arg.line} of {arg.file} write {written}"
                if arg.declared
                else f"below <launch> in {arg.file} add {written}"
            )


def out_of_comment(line: int) -> str:
    return f"take the <node> on line {line} out of the comment: remove `<!--` before it and `-->` after it"


def illegal_name(node: LaunchNode) -> Slip | None:
    """Return a name at which roslaunch only warns, and which other tools stumble over."""
    name = node.name or ""
    if not name or "/" in name or UNRESOLVED in name or re.fullmatch(r"[A-Za-z]\w*", name, re.ASCII):
        return None  # that a name is missing, or that roslaunch refuses it, is said elsewhere
    why = f'name="{name}" is not a legal name in ROS, and other tools fail on it'
    return _slip(node, why, "begin it with a letter, and use letters, digits and _ only")


def namespace_meant(*nodes: LaunchNode) -> str:
    """Return what to write where a `<node>`, or a `<group>` around it, has a `namespace`, which roslaunch ignores."""
    found = any("namespace" in node.unknown for node in nodes)
    return 'write ns="…" instead of namespace="…", which roslaunch does not know' if found else ""


def include_slips(file: LaunchFile) -> Iterator[Slip]:
    """Yield why an `<include>` brings nothing."""
    yield from _of_faults(file, (fault for fault in file.include_faults if fault.kind != SUBSTITUTION))


def _of_faults(file: LaunchFile, faults: Iterable[Fault]) -> Iterator[Slip]:
    for fault in faults:
        yield Slip(fault.file or file.path, fault.line or 1, fault.message, fault.advice)


def refusals(package: PackageFacts, file: LaunchFile) -> Iterator[Slip]:
    """Yield what makes roslaunch start nothing at all."""
    yield from include_slips(file)
    seen: dict[str, LaunchNode] = {}
    for node in file.brings:
        slip = node_slip(package, node)
        if slip is not None and slip.refused:
            yield slip
        elif "/" in (node.name or ""):
            fix = f'write name="{PurePosixPath(str(node.name)).name}"; a namespace goes into ns="…"'
            yield _slip(node, f'name="{node.name}" has a slash in it, which roslaunch refuses', fix)
        elif node.full_name in seen and not node.uncertain:
            why = f"a second node is named {node.full_name}, like that on line {seen[node.full_name].line}"
            yield _slip(
                node,
                why,
                namespace_meant(node) or "give each <node> its own name: roslaunch refuses the file",
            )
        # Nodes behind an `if` that only roslaunch works out may exclude each other; `$(anon …)` is another name each
        # time that a file is included.
        if not node.uncertain and UNRESOLVED not in node.full_name:
            seen.setdefault(node.full_name, node)


def refusals_unrun(file: LaunchFile) -> Iterator[Slip]:
    """Yield what else makes roslaunch start nothing, of which it says enough itself once it is run."""
    yield from _of_faults(file, (fault for fault in file.include_faults if fault.kind == SUBSTITUTION))
    for arg in file.unset_args:
        add = f'below <launch>, add <arg name="{arg.name}" default="…"/>'
        fix = f"write $(arg {arg.meant})" if arg.meant else add
        if not arg.declared:
            yield Slip(arg.file, arg.line, f"no <arg> declares $(arg {arg.name})", fix)
    for node in file.brings:
        if node.output not in {None, "", "screen", "log"} and UNRESOLVED not in str(node.output):
            why = f'output="{shown(str(node.output))}" is neither "screen" nor "log"'
            yield _slip(node, why, 'write output="screen"')


def nodes_of_script(package: PackageFacts, file: LaunchFile, script: str) -> tuple[LaunchNode, ...]:
    """Return the nodes that run this script of the package, or may run it as far as can be seen."""
    name = PurePosixPath(script).name
    return tuple(n for n in file.brings if _may_be(n.pkg, package.name) and _may_be(n.type, name))


def nodes_of_program(file: LaunchFile, program: str) -> tuple[LaunchNode, ...]:
    """Return the nodes that run `package/program`; a Python program's `.py` may be there or not."""
    pkg, _, name = program.partition("/")
    names = {name, name.removesuffix(".py"), f"{name}.py"}
    return tuple(n for n in file.brings if _may_be(n.pkg, pkg) and any(_may_be(n.type, one) for one in names))


def _may_be(written: str | None, name: str) -> bool:
    # A path is no name, whatever roslaunch makes of it.
    return written == name or (UNRESOLVED in (written or "") and "$(find" not in (written or ""))


def _no_program(package: PackageFacts, node: LaunchNode, of_lab: Sequence[PackageFacts]) -> Slip:
    """`package` is the one that the node names, `of_lab` are all that the lab asks for."""
    name = str(node.type)
    why = f"there is no {name} in the package{f' {package.name}' if len(of_lab) > 1 else ''}"
    if other := next((one for one in of_lab if has_program(one, name)), None):
        return _slip(node, f"{why}; it is in {other.name}", f'write pkg="{other.name}"')
    plain = PureWindowsPath(name).name  # of both, `/` and `\\`
    if plain != name and has_program(package, plain):
        return _slip(node, f"{why}: type is the file's name without its folder", f'write type="{plain}"')
    if program := program_of_source(package, plain):
        return _slip(node, OF_SOURCE.format(plain), f'write type="{program}"')
    if found := find_script(package, f"{plain}.py"):
        return _slip(node, f'{why}: type="{name}" lacks the .py of {found.path}', f'write type="{plain}.py"')
    if made := next((one for one in programs(package) if name in {one.target, one.name}), None):
        return _named_otherwise(package, node, made, why)
    return _nothing_like_it(package, node, why)


def _nothing_like_it(package: PackageFacts, node: LaunchNode, why: str) -> Slip:
    """The package has a program of nearly that name, or ROS has one, or the script was never written."""
    plain = PurePosixPath(str(node.type)).name
    suffix = PurePosixPath(plain).suffix
    beside = {one.type for file in package.launch_files for one in file.brings if one.file == node.file}
    built = (one.name for one in programs(package) if "$" not in one.name)
    # What another <node> starts is not meant here.
    names = [n for n in dict.fromkeys((*_program_names(package), *built)) if n not in beside]
    near = near_names(plain, names) or [n for n in names if suffix and suffix != ".py" and n.endswith(suffix)]
    if near:
        return _slip(node, f"{why}; {there_is(near)}", f'write type="{near[0]}"')
    if alike := [n for n in names if has_role_of(n, plain)]:
        fix = f'write type="{alike[0]}"' if len(alike) == 1 else "write the one that is meant as type"
        return _slip(node, f"{why}; {there_is(alike)}", fix)
    if known := next((pkg for pkg, named in PROGRAMS_OF.items() if node.type in named), None):
        return _slip(node, f"{why}; ROS has one in {known}", f'write pkg="{known}"')
    fix = "type is the script's whole file name, with its ending"
    source = next(
        (f.path for f in package.files if f.path.endswith(tuple(f"/{plain}{end}" for end in CPP_SUFFIXES))),
        "",
    )
    if source:
        fix = f"write `add_executable({plain} {source})` in CMakeLists.txt, which nothing there does"
    if made := next((one for one in programs(package) if source and source in one.call.args[1:]), None):
        fix = f"in CMakeLists.txt, write `{plain}` for `{shown(made.target)}`, on line {made.call.line} and below it"
    return _slip(node, why, f"write the script {plain}, or the name of one that is there" if suffix else fix)


def _named_otherwise(package: PackageFacts, node: LaunchNode, made: Executable, why: str) -> Slip:
    """CMake gives the target's program another name, or puts it where nothing looks for it."""
    call = made.named or made.call
    where = f"{call.file}, line {call.line},"
    if is_elsewhere(made, package):
        why = f"{why}: {where} puts it into {shown(made.folder)}, where roslaunch does not look"
        return _slip(node, why, f"remove RUNTIME_OUTPUT_DIRECTORY from line {call.line} of {call.file}")
    why = f"{why}: {where} names the program of the target {made.target} {shown(made.name)}"
    return _slip(node, why, f'write type="{made.name}"')


def _program_names(package: PackageFacts) -> list[str]:
    """Files that may be meant as programs."""
    return [PurePosixPath(f.path).name for f in package.files if f.python or f.shebang or f.executable]


def _folder(package: PackageFacts) -> str:
    """The folder's name where it is not the package's."""
    name = PurePosixPath(package.path).name
    return name if name != package.name else ""


def _projects(package: PackageFacts) -> set[str]:
    return {call.args[0] for call in cmake_calls(package, "project") if call.args}


def _slip(node: LaunchNode, why: str, fix: str) -> Slip:
    return Slip(node.file, node.line, why, fix)


def own_script(package: PackageFacts, node: LaunchNode) -> SourceFile | None:
    """Return the file of the package that the node runs; one of another of the lab's packages by its path from here.
    A source of C++ is none: its program is run."""
    owner = owner_of(package, node)
    is_source = str(node.type).endswith(CPP_SUFFIXES)
    script = find_script(owner, str(node.type)) if owner is not None and not is_source else None
    if script is None or owner is None or owner is package:
        return script
    path = posixpath.normpath(f"{package.way_to(owner)}/{script.path}")
    fault = script.python_fault and script.python_fault.model_copy(update={"file": path})
    return script.model_copy(update={"path": path, "python_fault": fault})


def owner_of(package: PackageFacts, node: LaunchNode) -> PackageFacts | None:
    """Return the lab's package that the node is of; None for one of ROS's."""
    return next((one for one in (package, *package.also) if one.name == node.pkg), None)


_NO_PROGRAM = re.compile(r"cannot launch node of type \[([^/\]]+)/([^\]]+)\]: Cannot locate node")
# Where the package itself is not found, roslaunch repeats its name alone.
_NO_PACKAGE = re.compile(r"cannot launch node of type \[([^/\]]+)/([^\]]+)\]: \1$")


def unfound_program(printed: Sequence[str], package: PackageFacts) -> tuple[str, str] | None:
    """Return which program or package roslaunch says that it does not find, and what to do about it."""
    if found := next(filter(None, map(_NO_PROGRAM.search, printed)), None):
        if found[1] == package.name and any(one.is_called(found[2]) for one in programs(package)):
            return f"the build did not make the program {shown(found[2])}", BUILD_FIRST_HINT
        near = near_names(found[2], PROGRAMS_OF.get(found[1], ()))
        cause = f"roslaunch finds no program {shown(found[2])} in the package {shown(found[1])}"
        return cause, f'write type="{near[0]}"' if near else programs_hint(found[1])
    if found := next(filter(None, map(_NO_PACKAGE.search, printed)), None):
        hint = "write the name of the package that has the program as pkg"
        return f"roslaunch finds no package {shown(found[1])}", hint
    return None


ROS = "noetic"
"""Debian's own packages may lack the program."""


def explain_by_lacking_program(_check: Check, package: PackageFacts, run: Run, verdict: Verdict) -> Verdict:
    """Return a lost mark as open where roslaunch did not find a program of ROS's, which this machine then lacks: nobody
    knows what the other nodes do with it."""
    started = {(node.pkg, node.type) for file in package.launch_files for node in file.brings}
    for _, printed in run.console:
        found = _NO_PROGRAM.search(printed.line) or _NO_PACKAGE.search(printed.line)
        known = PROGRAMS_OF_ROS.get(found[1], ()) if found and found.groups() in started else ()
        if found is None or found[2] not in known:
            continue
        why = f"the launch file starts {found[2]} of {found[1]}, which this grading machine lacks"
        return machine_lacks(
            f"{verdict.message}; {why}",
            hint=f"{ON_THE_MACHINE}{install_command(found[1], ROS)}, then grade again",
            expected=verdict.expected,
            measured=verdict.measured,
            citations=verdict.citations,
        )
    return verdict


def right_remap(
    node: LaunchNode, topic: str, published: Sequence[str]
) -> tuple[LaunchLine | LaunchNode, str]:
    """Return the line of a node's only `<remap>`, with what to write there; else the node's, with where to look."""
    lines = [one for one in node.renaming if one.tag == "remap"]
    names = [name for name in published if name.rpartition("/")[0] in {node.namespace.rstrip("/"), ""}]
    off = next((one for one in node.left_out if f"{node.namespace}{one.tag.lstrip('/')}" in published), None)
    if off is not None:
        return off, f"remove {off.value} from line {off.line}, or give its <arg> the other default"
    own = topic.removeprefix(node.namespace)
    if f"/{own}" in names and all(second != f"/{own}" for _, second in node.remaps):
        return node, without_slash(node, own)
    if not node.remaps:
        name = published[0].removeprefix(node.namespace) if len(published) == 1 else "…"
        tag = f'<remap from="{name}" to="{topic.removeprefix(node.namespace)}"/>'
        return node, f"add `{tag}` to the <node> on line {node.line}: `from` is the name in the script"
    if len(lines) != 1 or len(names) != 1:
        return node, "look at its <remap>: `from` is the name in the script, `to` the new one"
    name, to = names[0].rpartition("/")[2], topic.removeprefix(node.namespace)
    old, new = (text.lstrip("/") for text in node.remaps[-1])
    if name == new and old != to and names[0].startswith(node.namespace):
        given = [one for one in node.by_args if one.tag == "to"]
        at = given[0] if given else lines[0]
        return at, f'on line {at.line} of {at.file}, write {at.value if given else "to"}="{to}"'
    if not names[0].startswith(node.namespace):  # its `to` begins with a slash: `from` is right
        name = next((first for first, second in node.remaps if second == names[0]), name)
    why = "`from` is the name in the script, and a slash in front of a name takes it out of its namespace"
    return lines[0], f'write `<remap from="{name}" to="{to}"/>` there: {why}'


def without_slash(node: LaunchNode, name: str) -> str:
    """Return what to write in a script that gives a name of its namespace a slash in front."""
    return f"in {node.type}, write '{name}', not '/{name}': a slash takes the name out of its namespace"
