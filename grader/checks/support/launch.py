"""A launch file and its nodes: what its text says, what roslaunch printed, and why a node is not there."""

from __future__ import annotations

import posixpath
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import PurePosixPath
from typing import NamedTuple

from grader.checks.support.exit_causes import explain_traceback, process_tracebacks, syntax_hint
from grader.checks.support.processes import lives, observed_until_ns
from grader.checks.support.scripts import (
    add_hint,
    can_be_moved,
    cmake_calls,
    find_script,
    is_elsewhere,
    move_hint,
    paths_by_name,
    programs,
    script_of_role,
    shebang_obstacles,
)
from grader.checks.support.text import INIT, near_names, shown
from grader.evidence.run import Run
from grader.model.package import Executable, LaunchFile, LaunchNode, PackageFacts, SourceFile
from grader.model.submission import chmod_hint
from grader.model.verdict import (
    FileCitation,
    MistakeKind,
    Verdict,
    failed,
    inconclusive,
    joined,
    machine_lacks,
    unjudged,
)
from grader.untrusted_text import without_colours
from grader.wording import join_words, there_is

OTHER_ATTRIBUTES = {"package": "pkg", "exec": "type", "executable": "type", "script": "type"}
"""What ROS 2, or plain English, calls them."""
NOT_EXECUTED = (2, 126, 127)
"""Exit codes of `env` and of a shell that find no such program, or cannot read what it is given."""
UNRESOLVED = "$("
ATTRIBUTES = ("pkg", "type", "name")
_ERRORS = (
    "ERROR: cannot launch", "RLException", "Invalid ", "ERROR:", "process has died", "roslaunch:",
    "Resource not found",
)  # fmt: skip
_SUBSTITUTION = re.compile(r"\\\$\\\(([^)]*)\\\)")
# Students print such lines too: between brackets is no other bracket, so that a line is looked through once.
_UNSET = re.compile(r"requires the '(\w+)' arg to be set")
_STARTED = re.compile(r"process\[([^\s\[\]]+)-\d+\]: started with pid")
_DIED = re.compile(r"\[([^\s\[\]]+)-\d+\] process has died \[pid \d+, exit code (-?\d+)")
_FINISHED = re.compile(r"\[([^\s\[\]]+)-\d+\] process has finished cleanly")
_REQUIRED = re.compile(r"REQUIRED process (\[[^\s\[\]]+-\d+\]) has died")
NO_PACKAGE = r"Resource not found: (\S+)"
NO_FILE = r"file does not exist \[([^\[\]\n]+)\]"
BAD_FILE = r"error loading <rosparam> tag"
IGNORE = "CATKIN_IGNORE"
_NO_LAUNCH_FILE = "is neither a launch file in package"
NOT_STARTED = r"Unable to launch \[([^\s\[\]]+)-\d+\]"
# what roslaunch says when it starts nothing, what it means, and what to do ({0}: the pattern's group)
_REFUSALS = (
    (r"multiple nodes named \[([^\[\]\n]+)\]", "two nodes are named {0}", "give each <node> its own name"),
    (r"cannot contain a namespace", "a node's name has a slash in it",
     'write name="…" without a slash; a namespace goes into ns="…"'),
    (r"missing required attribute: '?(\w+)", "a tag has no {0}", "add the attribute"),
    (NO_FILE, "the file {0} that <rosparam> loads does not exist",
     "write $(find <package>)/config/{0}, and push the file"),
    (NO_PACKAGE, "there is no package {0}",
     "$(find …) and pkg need the package's exact name"),
    (r"requires the '(\w+)' arg to be set", 'its <arg name="{0}"> has no default',
     'write <arg name="{0}" default="…"/>'),
    (r"output must be one of", 'output is "screen" or "log", in lower case', 'write output="screen"'),
    (r"multiple files named", "the package has two launch files of that name",
     "delete one of them, even one in a folder of old files: find . -name '*.launch' lists them"),
    (NOT_STARTED, "the system cannot start the script of {0}",
     "its first line has to be #!/usr/bin/env python3, or #!/bin/bash for a shell script"),
    (r"Unknown substitution command \[([^\[\]\n]+)\]", "roslaunch does not know $({0})",
     "write $(find <package>)/…"),
    (BAD_FILE, "<rosparam> cannot load its file",
     "rosparam load <file> shows what is wrong with the file"),
    (r"Invalid roslaunch XML syntax: \[Errno 2\] No such file or directory: '([^'\n]+)'",
     "the file {0} that <include> names does not exist", "push {0}, or start its nodes here, with a <node> for each"),
    (r"invalid bool value for (\w+): (\S+?)\.?(?:\s|$)", '{0}="{1}" is neither true nor false',
     'write {0}="true" or {0}="false"'),
    (r"Invalid roslaunch XML syntax", "it is not well-formed", "close every element"),
)  # fmt: skip


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

    def verdict(self, said: str = "") -> Verdict:
        """Return the verdict with what roslaunch said (`said`) at the end."""
        cited = (FileCitation(file=self.file, line=self.line),)
        message = f"{self.file}, line {self.line}: {self.why}{said}"
        return (unjudged if self.of_manifest else failed)(message, hint=self.fix, citations=cited)


PROGRAMS_OF = {
    "rospy_tutorials": ("listener.py", "talker.py", "listener", "talker"),
    "turtlesim": ("turtlesim_node", "turtle_teleop_key", "draw_square", "mimic"),
}
"""What tutorials start of ROS's own packages."""


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
    hint = file.fault.advice or "close every element, and begin with <launch> and end with </launch>"
    return failed(message, hint=hint, citations=(file.fault.place,))


def _absent(package: PackageFacts, launch: str, wanted: set[str]) -> Verdict:
    """Return that the launch file is not there, and which other one may be meant: one of nearly its name, or one that
    starts the same programs."""
    started = {f.path: f.starts(wanted) for f in package.launch_files if f.nodes}
    full = package.launches_of(wanted)
    programs = wanted if full else {_program_meant(package, one) for one in wanted}
    guessed = [] if full else package.launches_of(programs)[:1]
    others = [f.path for f in package.launch_files]
    names = paths_by_name(package)
    near = [names[n] for n in near_names(launch, names)]
    stem = PurePosixPath(launch).stem
    near += [p for n, p in names.items() if n == f"{stem}.xml" and p not in near]
    seen = f"; {there_is(dict.fromkeys([*near, *others]))}" if near or others else ""
    if starting := full or guessed:
        which = "which" if starting == others else f"and {join_words(starting)}"
        seen += f", {which} {'each start' if len(starting) > 1 else 'starts'} {join_words(sorted(programs))}"
    parts = {} if full else _parts_started(started)
    if parts:
        seen += f", and {join_words(f'{path} starts {name}' for path, name in parts.items())}"
    movable = [p for p in near if can_be_moved(p, launch) and (not wanted or started.get(p, wanted))]
    movable += full[:1] if len(full) == 1 else []
    path = f"launch/{launch}"
    hint = move_hint(package, movable[0], path) if movable else add_hint(package, path)
    if guessed and not movable:
        hint = f"{hint}, or {move_hint(package, guessed[0], path)} if that is meant to be it"
    if parts and set(parts.values()) == wanted and not movable:
        hint = f"{hint}, with the <node>s of {join_words(parts)} in it"
    verdict = failed(f"{launch} is not in the package{seen}", hint=hint)
    kind: MistakeKind = "file-elsewhere" if movable or guessed else "file-missing"
    return verdict.about(citations=(FileCitation(file=movable[0] if movable else path),)).lost_by(kind, path)


def _program_meant(package: PackageFacts, name: str) -> str:
    """Return the name of the script that may be meant to be this one, if it is missing; else the name itself."""
    other = "" if has_program(package, name) else script_of_role(package, name)
    return PurePosixPath(other).name or name


def _parts_started(started: Mapping[str, set[str]]) -> dict[str, str]:
    """Return the launch files that start one of the programs each, no two of them the same one, and that program."""
    alone = [(path, next(iter(names))) for path, names in started.items() if len(names) == 1]
    names = [name for _, name in alone]
    return {path: name for path, name in alone if names.count(name) == 1}


def not_run(run: Run) -> Verdict | None:
    """Nothing was started at all."""
    if lives(run) or run.graph:
        return None
    return inconclusive("roslaunch was not run", hint="grade again")


def has_program(package: PackageFacts, name: str) -> bool:
    """Return whether there is a file of that name, or a program that CMake builds under it."""
    if "/" not in name and find_script(package, name) is not None:
        return True
    return any(one.is_called(name) and not is_elsewhere(one, package) for one in programs(package))


def node_slip(package: PackageFacts, node: LaunchNode, said: str = "") -> Slip | None:
    """Return why a node cannot start by what the file says of it. Names with `$(…)` are roslaunch's to resolve.

    `said` is what roslaunch said: a package that it does not find is a slip, any other is not this package's.
    """
    missing = [a for a in ATTRIBUTES if not (getattr(node, a) or "").strip()]
    if missing:
        known = {
            name: OTHER_ATTRIBUTES[name] for name in node.unknown if OTHER_ATTRIBUTES.get(name) in missing
        }
        slips = {name: meant[0] for name in node.unknown if (meant := near_names(name, missing))} | known
        told = "".join(f"; it has no attribute {name}" for name in slips)
        fix = "; ".join(f"write {right}= instead of {name}=" for name, right in slips.items())
        stem = PurePosixPath(node.type or "<file>.py").stem
        own = {"pkg": package.name, "type": f"{node.name or '<file>'}.py", "name": stem}
        add = " ".join(f'{name}="{own[name]}"' for name in missing)
        why = f"<node> has no {join_words(missing)}{told}"
        return _slip(node, why, fix or f"add {add} to the <node>")._replace(refused=True)
    pkg, name = str(node.pkg), str(node.type)
    if path := next((a for a in ("pkg", "type") if "$(find" in str(getattr(node, a))), None):
        return _slip(
            node,
            f"{path} is a path",
            f'write pkg="{package.name}" and type="<file>.py": names only, without folders',
        )
    if UNRESOLVED in pkg + name:
        return None
    if owner := _owner(package, node):
        there = has_program(owner, name)
        return None if there else _no_program(owner, node, (package, *package.also))._replace(lacks=name)
    if near_names(package.name, [pkg]) or f"[{pkg}/{name}]" in said or _folder(package) == pkg:
        fix = f'write pkg="{package.name}"'
        then = "" if has_program(package, name) else _no_program(package, node, (package,)).fix
        fix += f" and {then.removeprefix('write ')}" if then.startswith("write type=") else ""
        slip = _slip(node, f"there is no {name} in a package {pkg}", fix)
        # Where the launch file has the name of the folder or of project(…), the manifest is at fault.
        return slip._replace(of_manifest=pkg in {_folder(package), *_projects(package)}, lacks=name)
    return None


def node_slips(package: PackageFacts, file: LaunchFile, run: Run) -> Verdict | None:
    """Return what is wrong with the file's own nodes, with what roslaunch said in the run; of one fix for several
    nodes, with all their lines. None where nothing is."""
    said = "\n".join(_lines(run))
    found = [
        slip
        for node in file.nodes
        if (slip := node_slip(package, node.model_copy(update={"file": file.path}), said))
    ]
    verdict = joined([_at_its_lines(slip, found).verdict() for slip in found])
    if verdict is None:
        return None
    message = verdict.message.replace(f"; {file.path}, ", "; ")
    return verdict.model_copy(update={"message": f"{message}{quoted(run)}"})


def _at_its_lines(slip: Slip, slips: Sequence[Slip]) -> Slip:
    """Return the slip with a fix that names its line where there are others, and all lines of the same fix."""
    lines = [str(one.line) for one in slips if one.fix == slip.fix]
    if len(slips) < 2:
        return slip
    return slip._replace(fix=f"on line{'s' if len(lines) > 1 else ''} {join_words(lines)}, {slip.fix}")


def later_fixes(file: LaunchFile, script: str) -> Iterator[str]:
    """Yield what lets the file start a script that is meant in it: an `if` or `unless` that leaves its node out, and
    its whole name as `type`."""
    name = PurePosixPath(script).name
    stem = PurePosixPath(name).stem
    off = [(kind, line, said) for kind, line, said in file.switched_off if PurePosixPath(kind).stem == stem][
        :1
    ]
    for _, line, said in off:
        other = ", or give its <arg> the other default" if "$(arg" in said else ""
        yield f"remove {said} from line {line}{other}"
    named = [(kind, f"in the <node> below line {line}") for kind, line, _ in off]
    named += [(node.type, f"on line {node.line}") for node in file.brings if node.type == stem]
    yield from (f'write type="{name}" {place}, not type="{kind}"' for kind, place in named if kind != name)


def illegal_name(node: LaunchNode) -> Slip | None:
    """Return a name at which roslaunch only warns, and which other tools stumble over."""
    name = node.name or ""
    if not name or UNRESOLVED in name or re.fullmatch(r"[A-Za-z]\w*", name, re.ASCII):
        return None  # that a name is missing is said elsewhere
    why = f'name="{name}" is not a legal name in ROS, and other tools fail on it'
    return _slip(node, why, "begin it with a letter, and use letters, digits and _ only")


def refusals(package: PackageFacts, file: LaunchFile) -> Iterator[Slip]:
    """Yield what makes roslaunch start nothing at all."""
    for fault in file.include_faults:
        yield Slip(fault.file or file.path, fault.line or 1, fault.message, fault.advice)
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
            yield _slip(node, why, "give each <node> its own name: roslaunch refuses the file")
        if not node.uncertain:
            seen.setdefault(node.full_name, node)


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
    return written == name or (UNRESOLVED in (written or "") and "$(find" not in (written or ""))


def _no_program(package: PackageFacts, node: LaunchNode, of_lab: Sequence[PackageFacts]) -> Slip:
    """`package` is the one that the node names, `of_lab` are all that the lab asks for."""
    name = str(node.type)
    why = f"there is no {name} in the package{f' {package.name}' if len(of_lab) > 1 else ''}"
    if other := next((one for one in of_lab if has_program(one, name)), None):
        return _slip(node, f"{why}; it is in {other.name}", f'write pkg="{other.name}"')
    plain = PurePosixPath(name).name
    if plain != name and has_program(package, plain):
        return _slip(node, f"{why}: type is the file's name without its folder", f'write type="{plain}"')
    if found := find_script(package, f"{plain}.py"):
        return _slip(node, f'{why}: type="{name}" lacks the .py of {found.path}', f'write type="{plain}.py"')
    if made := next((one for one in programs(package) if name in {one.target, one.name}), None):
        return _named_otherwise(package, node, made, why)
    return _nothing_like_it(package, node, why)


def _nothing_like_it(package: PackageFacts, node: LaunchNode, why: str) -> Slip:
    """The package has a program of nearly that name, or ROS has one, or the script was never written."""
    plain = PurePosixPath(str(node.type)).name
    suffix = PurePosixPath(plain).suffix
    names = [n for n in _program_names(package) if n != node.type]
    near = near_names(plain, names) or [n for n in names if suffix and suffix != ".py" and n.endswith(suffix)]
    if near:
        return _slip(node, f"{why}; {there_is(near)}", f'write type="{near[0]}"')
    if known := next((pkg for pkg, named in PROGRAMS_OF.items() if node.type in named), None):
        return _slip(node, f"{why}; ROS has one in {known}", f'write pkg="{known}"')
    fix = "type is the script's whole file name, with its ending"
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


class Absence(NamedTuple):
    """Why a node is not there. `of_script`: the reason lies in the script, not in the launch file."""

    why: str
    hint: str
    of_script: bool = False
    citations: tuple[FileCitation, ...] = ()
    of_machine: bool = False
    unbuilt: bool = False
    """Only the build makes it."""
    refused: str = ""
    """How roslaunch says that it starts nothing: a pattern of `_REFUSALS`."""
    about: str = ""
    """What the pattern's group names."""

    def verdict(self, message: str, *, judged: bool = False) -> Verdict:
        """Return the verdict: nothing to judge in the launch file where the machine is at fault, or a script that is
        not `judged` too."""
        kind = machine_lacks if self.of_machine else unjudged if self.of_script and not judged else failed
        verdict = kind(message, hint=self.hint, citations=self.citations)
        verdict = verdict.model_copy(update={"unbuilt": self.unbuilt})
        return verdict.seeking("package", self.about) if self.refused == NO_PACKAGE else verdict


def name_pattern(node: LaunchNode) -> re.Pattern[str]:
    """Return the names that a node can come up under: `$(anon x)` becomes `x_<host>_<pid>_<digits>`.

    However many substitutions there are, a name is looked through once: each takes the least that it can, and what it
    took stands (a group in a lookahead is not tried again).
    """
    before, *others = _SUBSTITUTION.split(re.escape(node.full_name).replace(r"\ ", " "))
    literals, gaps = [before], list[str]()
    for inside, literal in zip(others[::2], others[1::2], strict=True):
        name, gap = _substitute_inside(inside)
        literals[-1] += name
        gaps.append(gap)
        literals.append(literal)
    steps = [
        f"(?=(?P<g{number}>{gap}?{literals[number]}))(?P=g{number})"
        for number, gap in enumerate(gaps[:-1], 1)
    ]
    return re.compile("".join([literals[0], *steps, *gaps[-1:], *literals[1:][-1:]]))


def is_exact(node: LaunchNode) -> bool:
    """Return whether the file alone says the node's name."""
    return "$(" not in node.full_name


def nodes_up(run: Run, node: LaunchNode) -> tuple[str, ...]:
    """Return the names in the graph under which it came up."""
    pattern = name_pattern(node)
    return tuple(name for name in run.student_nodes() if pattern.fullmatch(name))


def refusal(run: Run, package: PackageFacts | None = None) -> Absence | None:
    """Return why roslaunch started nothing, or broke off. `package` has the file's own lines."""
    text = "\n".join(line for line in _lines(run))
    if unset := _unset_args(text, package):
        return unset
    if package is not None and package.file(IGNORE) is not None and _NO_LAUNCH_FILE in text:
        why = f"{IGNORE} hides the package from catkin and roslaunch"
        return Absence(why, f"git rm {IGNORE}", citations=(FileCitation(file=IGNORE),))
    for pattern, why, hint in _REFUSALS:
        if match := re.search(pattern, text):
            words = [shown(PurePosixPath(g).name if "/" in g.strip("/") else g) for g in match.groups()]
            fix = hint.format(*words)
            fix = fix.replace("<package>", package.name) if package is not None else fix
            if package is not None and pattern == NO_FILE and (meant := _file_meant(package, words[0])):
                fix = f"write $(find {package.name})/{meant}"
            said = f"roslaunch starts nothing: {why.format(*words)}"
            return Absence(said, fix, refused=pattern, about="".join(words[:1]))
    return None


def _file_meant(package: PackageFacts, name: str) -> str:
    """Return the path of the only file of that kind, or of the one that is spelt alike; "" for none."""
    kind = PurePosixPath(name).suffix
    names = {n: p for n, p in paths_by_name(package).items() if PurePosixPath(n).suffix == kind}
    near = near_names(name, names) or (tuple(names) if len(names) == 1 else ())
    return names[near[0]] if near else ""


def _unset_args(text: str, package: PackageFacts | None) -> Absence | None:
    """Return all the arguments that the launch file asks for and that no `<arg>` declares: roslaunch names only one."""
    asked = _UNSET.search(text)
    files = package.launch_files if package is not None and asked else ()
    lacking = [
        [arg for arg in file.unset_args if not arg.declared]
        for file in files
        if asked and any(arg.name == asked[1] for arg in file.unset_args)
    ]
    if len(lacking) != 1 or asked is None or asked[1] not in {arg.name for arg in lacking[0]}:
        return None
    args = lacking[0]
    lines = sorted({arg.line for arg in args})
    names = join_words(f"$(arg {arg.name})" for arg in args)
    where = f"line{'s' * (len(lines) > 1)} {join_words(map(str, lines))} of {args[0].file}"
    declares = join_words(f'<arg name="{arg.name}" default="…"/>' for arg in args)
    verb = "uses" if len(lines) == 1 else "use"
    why = f"roslaunch starts nothing: {where} {verb} {names}, which no <arg> declares"
    hint = f"below <launch>, add {declares}, with {'its value' if len(args) == 1 else 'their values'} in place of …"
    cited = tuple(FileCitation(file=arg.file, line=arg.line) for arg in args)
    return Absence(why, hint, citations=tuple(dict.fromkeys(cited)))


def unset_arg_fixes(file: LaunchFile, told: str) -> Iterator[str]:
    """Yield what to write for each argument of the file that has no value, and that is not told yet."""
    for arg in file.unset_args:
        written = f'<arg name="{arg.name}" default="…"/>'
        if written not in told:
            yield (
                f"on line {arg.line} of {arg.file} write {written}"
                if arg.declared
                else f"below <launch> in {arg.file} add {written}"
            )


def died(run: Run, node: LaunchNode) -> int | None:
    """Return the exit code with which roslaunch saw it die before Ctrl-C; None where it did not."""
    until_ns = observed_until_ns(run) or run.end_ns
    lines = _join_required(without_colours(c.line) for t, c in run.console if t <= until_ns)
    codes = [int(m[2]) for line in lines if (m := _DIED.search(line)) and _is(node, m[1])]
    return codes[-1] if codes else None


def finished(run: Run, node: LaunchNode) -> bool:
    """Return whether it ran to its own end without an error."""
    return any((m := _FINISHED.search(line)) and _is(node, m[1]) for line in _join_required(_lines(run)))


def why_not_up(package: PackageFacts, run: Run, node: LaunchNode) -> Absence:
    """Return why a node of the launch file did not come up."""
    return (
        _not_found(package, run, node)
        or why_died(package, run, node)
        or refusal(run, package)
        or _silent(run, node)
        or Absence(
            f"roslaunch did not start it{quoted(run)}", "run roslaunch by hand and read what it prints"
        )
    )


def own_script(package: PackageFacts, node: LaunchNode) -> SourceFile | None:
    """Return the file of the package that the node runs; one of another of the lab's packages by its path from here."""
    owner = _owner(package, node)
    script = find_script(owner, str(node.type)) if owner is not None else None
    if script is None or owner is None or owner is package:
        return script
    path = posixpath.normpath(f"{package.way_to(owner)}/{script.path}")
    fault = script.python_fault and script.python_fault.model_copy(update={"file": path})
    return script.model_copy(update={"path": path, "python_fault": fault})


def _owner(package: PackageFacts, node: LaunchNode) -> PackageFacts | None:
    """Return the lab's package that the node is of; None for one of ROS's."""
    return next((one for one in (package, *package.also) if one.name == node.pkg), None)


def not_executable(*scripts: SourceFile) -> Absence:
    """Return the absence of nodes whose scripts are not executable."""
    paths = tuple(dict.fromkeys(script.path for script in scripts))
    are, them = ("is", "it") if len(paths) == 1 else ("are", "them")
    why = f"{join_words(paths)} {are} not executable, so roslaunch does not find {them}"
    hint = chmod_hint(scripts[0].mode_source, *paths)
    return Absence(why, hint, True, tuple(FileCitation(file=path) for path in paths))


def not_started(*scripts: SourceFile) -> Absence:
    """Return the absence of nodes whose scripts the system cannot start by their first line."""
    obstacles = {script.path: next(shebang_obstacles(script)) for script in scripts}
    why = "; ".join(f"{path} {one.why}" for path, one in obstacles.items())
    fix = "; ".join(dict.fromkeys(one.fix for one in obstacles.values()))
    return Absence(f"it died: {why}", fix, True, tuple(FileCitation(file=path, line=1) for path in obstacles))


def why_died(package: PackageFacts, run: Run, node: LaunchNode) -> Absence | None:
    """Return its traceback where it was printed, or what roslaunch says of its end."""
    code = died(run, node)
    if code is None:
        return None
    script = own_script(package, node)
    found = [
        t
        for one in lives(run)
        for t in process_tracebacks(run, one.name, after_ns=one.start_ns, before_ns=one.interrupt_ns)
        if script is None
        or any(PurePosixPath(f.file).name == PurePosixPath(script.path).name for f in t.frames)
    ]
    if found:
        owner = _owner(package, node) or package
        end = explain_traceback(found[-1], owner)
        cited = tuple(one.below(package.way_to(owner)) for one in end.citations)
        return Absence(f"it died: {end.cause}", end.hint, True, cited, end.of_machine)
    if script is not None and script.python_fault is not None:
        fault = script.python_fault
        why = f"it died: {fault.kind}: {fault.explanation}"
        return Absence(why, syntax_hint(fault), of_script=True, citations=(fault.place,))
    if script is not None and code in NOT_EXECUTED and any(shebang_obstacles(script)):
        return not_started(script)
    hint = 'write output="screen" in the <node>, and read what it prints last'
    return Absence(f"it died with exit code {code}", hint, of_script=True)


def quoted(run: Run) -> str:
    """Return the first line in which roslaunch says what is wrong, as the end of a sentence."""
    said = roslaunch_error(run)
    return f"; roslaunch says: {said}" if said else ""


def roslaunch_error(run: Run) -> str:
    """Return the first line in which roslaunch, or a node that it started, says what is wrong."""
    lines = _lines(run)
    found = (line for mark in _ERRORS for line in lines if mark in line)
    return shown(next(found, ""))


def _not_found(package: PackageFacts, run: Run, node: LaunchNode) -> Absence | None:
    """roslaunch did not find the program, or none that may be executed."""
    mark = f"cannot launch node of type [{node.pkg}/{node.type}]"
    line = next((text for text in _lines(run) if mark in text), None)
    if line is None:
        return None
    if (script := own_script(package, node)) and script.executable is False:
        return not_executable(script)
    owner = _owner(package, node)
    if owner is not None and any(one.is_called(str(node.type)) for one in programs(owner)):
        why = f"CMakeLists.txt makes the program {node.type}, but the build did not make it"
        return Absence(why, "first get the build to pass: catkin_make", of_script=True, unbuilt=True)
    if "Cannot locate" not in line:
        return Absence(
            f"there is no package {node.pkg}", "check the spelling of pkg, and that it is installed"
        )
    why = f"roslaunch finds no program {node.type} in the package {node.pkg}"
    if near := near_names(str(node.type), PROGRAMS_OF.get(str(node.pkg), ())):
        return Absence(f"{why}; it has {near[0]}", f'write type="{near[0]}"')
    return Absence(why, "type is the file's name, with .py for a script, and the file needs chmod +x")


def _silent(run: Run, node: LaunchNode) -> Absence | None:
    """Started, and never registered."""
    hint = f"call {INIT} before anything that waits"
    others = [n for n in run.student_nodes() if re.fullmatch(r"/.+_\d+_\d{9,}", n)]
    if finished(run, node):
        return Absence("its script ended without ever becoming a node", hint, of_script=True)
    started = any((m := _STARTED.search(line)) and _is(node, m[1]) for line in _lines(run))
    if not started:
        return None
    if others:
        why = (
            f"{join_words(others)} came up instead: the script does not take the name that roslaunch gives it"
        )
        return Absence(why, "start the script itself, and leave sys.argv alone", of_script=True)
    return Absence("its script runs, but never registers as a node", hint, of_script=True)


def _is(node: LaunchNode, process: str) -> bool:
    return name_pattern(node).fullmatch(f"/{process}") is not None


def _substitute_inside(inside: str) -> tuple[str, str]:
    """Return what stands for `$(inside)` in a pattern: the name that is known, and what follows it."""
    words = re.sub(r"\\(.)", r"\1", inside).split()
    return (f"{re.escape(words[1])}_", ".+") if len(words) == 2 and words[0] == "anon" else ("", ".*")


def _join_required(lines: Iterable[str]) -> Iterator[str]:
    """Of a node with required="true", roslaunch says on one line that it "died", and in the next one how it ended."""
    name = ""
    for line in lines:
        if match := _REQUIRED.search(line):
            name = match[1]
        elif name and line.startswith("process has "):
            yield f"{name} {line}"
            name = ""
        else:
            yield line


def _lines(run: Run) -> list[str]:
    return [without_colours(c.line) for _, c in run.console]
