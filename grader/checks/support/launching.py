"""A launch file and its nodes, as far as the package's files tell."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import PurePosixPath
from typing import NamedTuple

from grader.checks.executable import find_script
from grader.checks.support.text import near_names
from grader.model.package import LaunchFile, LaunchNode, PackageFacts
from grader.model.verdict import FileCitation, Verdict, failed, unjudged
from grader.wording import join_words

UNRESOLVED = "$("
ATTRIBUTES = ("pkg", "type", "name")


class Slip(NamedTuple):
    """What is wrong with a line of a launch file, and what to write. `of_manifest`: the manifest's name is at fault."""

    file: str
    line: int
    why: str
    mend: str
    of_manifest: bool = False

    def verdict(self, said: str = "") -> Verdict:
        """`said` is appended: what roslaunch says to it."""
        cited = (FileCitation(file=self.file, line=self.line),)
        message = f"{self.file}, line {self.line}: {self.why}{said}"
        return (unjudged if self.of_manifest else failed)(message, hint=self.mend, citations=cited)


def find_launch(package: PackageFacts, name: str) -> LaunchFile | None:
    """The launch file of that name in any folder, one in `launch/` first."""
    found = [f for f in package.launch_files if PurePosixPath(f.path).name == name]
    return min(found, key=lambda f: (PurePosixPath(f.path).parts[0] != "launch", f.path), default=None)


def unreadable(package: PackageFacts, file: LaunchFile | None, launch: str) -> Verdict | None:
    """The file is missing, not well-formed, or has another root."""
    if file is None:
        others = [f.path for f in package.launch_files]
        names = {PurePosixPath(f.path).name: f.path for f in package.files}
        near = [names[n] for n in near_names(launch, names)]
        seen = f"; there is {join_words(dict.fromkeys([*near, *others]))}" if near or others else ""
        message = f"{launch} is not in the package{seen}"
        hint = f"put it at launch/{launch}, then git add, commit and push it"
        cited = tuple(FileCitation(file=p) for p in (near or others)[:3])
        return failed(message, hint=hint, citations=cited or (FileCitation(file="package.xml"),))
    if file.fault is None:
        return None
    line = f", line {file.fault.line}" if file.fault.line else ""
    message = f"{file.path}{line} is not well-formed: {file.fault.cause or file.fault.message}"
    hint = "close every element, and begin with <launch> and end with </launch>"
    return failed(message, hint=hint, citations=(FileCitation(file=file.path, line=file.fault.line),))


def has_program(package: PackageFacts, name: str) -> bool:
    """A file of that name, or a program that CMake builds under it."""
    if "/" not in name and find_script(package, name) is not None:
        return True
    calls = package.cmake.calls if package.cmake else ()
    return any(c.name == "add_executable" and c.args[:1] == (name,) for c in calls)


def node_slip(package: PackageFacts, node: LaunchNode, said: str = "") -> Slip | None:
    """Why a node cannot start by what the file says of it. Names with `$(…)` are roslaunch's to resolve.

    `said` is what roslaunch said: a package that it does not find is a slip, any other is not this package's.
    """
    missing = [a for a in ATTRIBUTES if not (getattr(node, a) or "").strip()]
    if missing:
        return _slip(node, f"<node> has no {join_words(missing)}", "a <node> needs pkg, type and name")
    pkg, name = str(node.pkg), str(node.type)
    if path := next((a for a in ("pkg", "type") if "$(find" in str(getattr(node, a))), None):
        return _slip(
            node, f"{path} is a path", f'write pkg="{package.name}" and type="<file>.py": names alone'
        )
    if UNRESOLVED in pkg + name:
        return None
    if pkg == package.name:
        return None if has_program(package, name) else _no_program(package, node)
    if near_names(package.name, [pkg]) or f"[{pkg}/{name}]" in said or _folder(package) == pkg:
        slip = _slip(node, f"there is no {name} in a package {pkg}", f'write pkg="{package.name}"')
        # Where the launch file has the folder's name and the manifest another one, the manifest is at fault.
        return slip._replace(of_manifest=_folder(package) == pkg)
    return None


def illegal_name(node: LaunchNode) -> Slip | None:
    """A name at which roslaunch only warns, and which other tools stumble over."""
    name = node.name or ""
    if UNRESOLVED in name or re.fullmatch(r"[A-Za-z]\w*", name, re.ASCII):
        return None
    why = f'name="{name}" is no legal name in ROS, and other tools stumble over it'
    return _slip(node, why, "begin it with a letter, and use letters, digits and _ only")


def refusals(package: PackageFacts, file: LaunchFile) -> Iterator[Slip]:
    """What makes roslaunch start nothing at all."""
    for fault in file.include_faults:
        yield Slip(
            fault.file or file.path, fault.line or 1, fault.message, "write $(find <package>)/launch/<file>"
        )
    seen: dict[str, LaunchNode] = {}
    for node in file.brings:
        slip = node_slip(package, node)
        if slip is not None and slip.why.startswith("<node> has no"):
            yield slip
        elif "/" in (node.name or ""):
            mend = f'write name="{PurePosixPath(str(node.name)).name}"; a namespace goes into ns="…"'
            yield _slip(node, f'name="{node.name}" has a slash in it, which roslaunch refuses', mend)
        elif node.full_name in seen and not node.uncertain:
            why = f"a second node is named {node.full_name}, like that of line {seen[node.full_name].line}"
            yield _slip(node, why, "give each <node> a name of its own: roslaunch refuses the file")
        if not node.uncertain:
            seen.setdefault(node.full_name, node)


def nodes_of_script(package: PackageFacts, file: LaunchFile, script: str) -> tuple[LaunchNode, ...]:
    """The nodes that run this script of the package, or may run it as far as can be seen."""
    name = PurePosixPath(script).name
    return tuple(n for n in file.brings if _may_be(n.pkg, package.name) and _may_be(n.type, name))


def nodes_of_program(file: LaunchFile, program: str) -> tuple[LaunchNode, ...]:
    """The nodes that run `package/program`; a Python program's `.py` may be there or not."""
    pkg, _, name = program.partition("/")
    names = {name, name.removesuffix(".py"), f"{name}.py"}
    return tuple(n for n in file.brings if _may_be(n.pkg, pkg) and any(_may_be(n.type, one) for one in names))


def _may_be(written: str | None, name: str) -> bool:
    return written == name or (UNRESOLVED in (written or "") and "$(find" not in (written or ""))


def _no_program(package: PackageFacts, node: LaunchNode) -> Slip:
    name = str(node.type)
    why = f"there is no {name} in the package"
    plain = PurePosixPath(name).name
    if plain != name and has_program(package, plain):
        return _slip(node, f"{why}: type is the file's name without its folder", f'write type="{plain}"')
    if found := find_script(package, f"{plain}.py"):
        return _slip(node, f'{why}: type="{name}" lacks the .py of {found.path}', f'write type="{plain}.py"')
    suffix = PurePosixPath(plain).suffix
    names = [n for n in _program_names(package) if n != name]
    near = near_names(plain, names) or [n for n in names if suffix and suffix != ".py" and n.endswith(suffix)]
    if near:
        return _slip(node, f"{why}; there is {join_words(near)}", f'write type="{near[0]}"')
    return _slip(node, why, "type is the script's whole file name, with its ending")


def _program_names(package: PackageFacts) -> list[str]:
    """Files that may be meant as programs."""
    return [PurePosixPath(f.path).name for f in package.files if f.python or f.shebang or f.executable]


def _folder(package: PackageFacts) -> str:
    """The folder's name where it is not the package's."""
    name = PurePosixPath(package.path).name
    return name if name != package.name else ""


def _slip(node: LaunchNode, why: str, mend: str) -> Slip:
    return Slip(node.file, node.line, why, mend)
