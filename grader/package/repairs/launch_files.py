"""Repairs of launch files: XML that is not well-formed, and attributes that name nearly what is meant."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Sequence
from pathlib import PurePosixPath

from grader.installable import known_packages, noetic_messages
from grader.model.launch_file import LaunchFile, LaunchLoad, LaunchNode
from grader.model.package import MANIFEST, PackageFacts
from grader.model.repair import RepairKind
from grader.package.launch import parse_launch
from grader.package.manifest import parse_manifest
from grader.package.repairs.editing import Files, keep_first_version, repair_xml
from grader.package.repairs.manifest import OF_ROS
from grader.package.repairs.names import CPP, Wanted, is_near
from grader.package.repairs.yaml_files import namespace_wanted
from grader.wording import the_same_on

TAG_LINES_MAX = 20
_FIND = re.compile(r"\$\(find +([\w-]+) *\)")
_COMMENT = re.compile(r"<!--.*?(?:-->|\Z)", re.DOTALL)
NO_SCRIPTS = (".launch", ".xml", ".txt", ".yaml", ".yml", ".md", ".test", *CPP)


def repair_launch_files(files: Files, package: PackageFacts) -> PackageFacts:
    """Find the edits that make launch files well-formed, and return the package as it is with them."""
    # `|` and not `or`: a file may need both.
    launches = [
        parse_launch((files.text(launch.path) or "").encode(), launch.path)
        if (launch.fault is None or launch.fault.kind == "XMLSyntaxError")
        and keep_first_version(files, launch.path, "launch-syntax")
        | repair_xml(files, launch.path, "launch", "launch-syntax")
        else launch
        for launch in package.launch_files
    ]
    return package.model_copy(update={"launch_files": tuple(launches)})


def repair_launch_names(files: Files, package: PackageFacts, names: Sequence[str], wanted: Wanted) -> None:
    """Find attributes of launch files that name a script without its `.py`, another package, or a node or parameter
    nearly as the lab does. `names` are the files of the package once they are renamed."""
    given = package.manifest.name if package.manifest is not None else wanted.package
    own = _own_name(files, given)
    ours = {own, given, PurePosixPath(package.path).name}
    scripts = {name for path in names if not (name := PurePosixPath(path).name).endswith(NO_SCRIPTS)}
    made = {one.name: one.call.args[1:] for one in package.cmake.executables} if package.cmake else {}
    programs = scripts | set(made)
    nodes = [(launch, node) for launch in package.launch_files for node in launch.nodes]
    for launch, node in nodes:
        _complete_node(files, launch.path, node, own, scripts)
    others = {*known_packages(), *noetic_messages(), *OF_ROS, *package.others, "", own}
    for launch, node, place in _with_places(package, "pkg"):
        pkg, kind = node.pkg or "", node.type or ""
        runs_own = bool({kind, f"{kind}.py"} & (scripts if pkg in ours else programs))
        found = _FIND.fullmatch(pkg)
        # Which package another `$(…)` is, only the call of roslaunch decides.
        is_another = "$(" not in pkg and pkg != own and (pkg in ours or pkg not in others)
        if (found and found[1] in ours) or (is_another and (is_near(pkg, own) or runs_own)):
            file, line, attribute = place or (launch.path, node.line, "pkg")
            _set_attribute(files, file, line, (attribute, pkg, own), kind="package-name")
    for launch in package.launch_files:
        _repair_find(files, launch.path, own, others)
    for launch, node, place in _with_places(package, "type"):
        kind = node.type or ""
        if (
            kind
            and "$(" not in kind
            and kind not in programs
            and (node.pkg in ours or is_near(node.pkg or "", own))
        ):
            plain = PurePosixPath(kind).name
            asked = {name for file, name in wanted.started if file == PurePosixPath(launch.path).name}
            of_source = {f"{PurePosixPath(plain).stem}.py"} & asked if plain.endswith(CPP) else ()
            there = [one for one in (f"{kind}.py", plain, f"{plain}.py", *of_source) if one in scripts]
            there = there or [one for one, sources in made.items() if _is_among(plain, sources)]
            near = there or [s for s in sorted(programs) if is_near(kind, s)]
            for right in near[:1]:
                file, line, attribute = place or (launch.path, node.line, "type")
                _set_attribute(files, file, line, (attribute, kind, right), kind="launch-type")
    _repair_nodes(files, package, wanted)
    for launch in package.launch_files:
        _rename_second_nodes(files, launch)
        _repair_params(files, launch, wanted)
        _repair_namespaces(files, launch, package, wanted)


def _with_places(
    package: PackageFacts, attribute: str
) -> Iterator[tuple[LaunchFile, LaunchNode, Place | None]]:
    """Yield the nodes of each file, and those that it brings up whose attribute is an `<arg>`'s, with its place."""
    for launch in package.launch_files:
        yield from ((launch, node, None) for node in launch.nodes)
        for node in launch.brings:
            given = next((one for one in node.by_args if one.tag == attribute), None)
            if given is not None:
                yield launch, node, (given.file, given.line, given.value)


Place = tuple[str, int, str]
"""A file, a line and the attribute on it that has a value."""


def _complete_node(files: Files, file: str, node: LaunchNode, own: str, scripts: set[str]) -> None:
    """Give a node of the package's own the one attribute that it lacks, where the other two say which it is."""
    there = {"pkg": node.pkg, "type": node.type, "name": node.name}
    lacking = [attribute for attribute, value in there.items() if not value]
    kind, lines = node.type or f"{node.name}.py", (files.text(file) or "").split("\n")
    if len(lacking) != 1 or kind not in scripts or not 0 < node.line <= len(lines):
        return
    value = {"pkg": own, "type": kind, "name": PurePosixPath(kind).stem}[lacking[0]]
    # `name=""` is there, and XML refuses the same attribute twice.
    is_empty = re.search(rf"\s{lacking[0]}\s*=", lines[node.line - 1])
    after = re.sub(r"<node\b", f'<node {lacking[0]}="{value}"', lines[node.line - 1], count=1)
    if not is_empty and after != lines[node.line - 1]:
        lines[node.line - 1] = after
        message = f"line {node.line} of {file}: <node> has no {lacking[0]}"
        files.change("launch-syntax", file, "\n".join(lines), message)


def _repair_find(files: Files, file: str, own: str, others: Collection[str]) -> None:
    """Replace what is nearly the package's name in each `$(find …)` of a launch file, and is none of the `others`."""
    text = _COMMENT.sub(lambda found: re.sub(r"[^\n]", " ", found[0]), files.text(file) or "")
    for place in _FIND.finditer(text):
        if is_near(found := place[1], own) and found not in others:
            after = re.sub(rf"(\$\(find +){re.escape(found)}(?= *\))", rf"\g<1>{own}", files.text(file) or "")
            line = text[: place.start()].count("\n") + 1
            message = f"line {line} of {file}: $(find {found}) should be $(find {own})"
            files.change("package-name", file, after, message)


def _own_name(files: Files, given: str) -> str:
    """Return the package's name once its manifest is repaired."""
    manifest, _ = parse_manifest((files.text(MANIFEST) or "").encode())
    return manifest.name if manifest is not None else given


def _repair_params(files: Files, launch: LaunchFile, wanted: Wanted) -> None:
    there = {param.name for param in launch.params}
    for param in launch.params:
        # a node's own parameter is the same one in another namespace
        names = (param.name, f"/{'/'.join(param.name.split('/')[-2:])}")
        right = next((w for w in wanted.params if w not in there and any(is_near(n, w) for n in names)), "")
        if right and param.file == launch.path and param.name not in wanted.params:
            old, new = param.name.rpartition("/")[2], right.rpartition("/")[2]
            _set_attribute(files, launch.path, param.line, (param.attribute, old, new), kind="parameter-name")


def _repair_namespaces(files: Files, launch: LaunchFile, package: PackageFacts, wanted: Wanted) -> None:
    for load in launch.loads:
        if load.file == launch.path:
            _repair_namespace(files, load, package, wanted)


def _repair_namespace(files: Files, load: LaunchLoad, package: PackageFacts, wanted: Wanted) -> None:
    """Load a parameter file without `ns`, or with the one that the lab's names have, where no program has the other."""
    text = files.text(load.file) or ""
    given = load.namespace.strip("/")
    found = re.findall(r"\bns\s*=\s*[\"']([^\"']*)", text)
    ours = [file.path for file in package.files if load.loads(file.path)]
    if "$(" in given or any(f"/{given}/" in f"/{name}" for name in (*wanted.nodes, *wanted.topics)):
        return
    if not given or [one.strip("/") for one in found] != [given] or len(ours) != 1:
        return
    programs = [file.path for file in package.files if file.path.endswith((".py", *CPP))]
    if any(given in (files.text(path) or "") for path in programs):
        return
    meant = namespace_wanted(files.text(ours[0]) or "", wanted)
    if meant is None or meant == f"/{given}":
        return
    if meant and is_near(given, meant.strip("/")):
        _set_attribute(files, load.file, load.line, ("ns", found[0], meant), kind="parameter-name")
    elif not meant:
        attribute = re.compile(r"\s+\bns\s*=\s*([\"'])[^\"']*\1")
        after = attribute.sub("", text, count=1)
        line = text[: text.index(found[0])].count("\n") + 1
        message = f'line {line} of {load.file}: ns="{found[0]}" puts what {ours[0]} sets below /{given}'
        files.change("parameter-name", load.file, after, message, f'on line {line}, delete ns="{found[0]}"')


def _is_among(source: str, paths: Sequence[str]) -> bool:
    """Return whether a program is made of that source of C++."""
    return source.endswith(CPP) and source in {PurePosixPath(path).name for path in paths}


def _repair_nodes(files: Files, package: PackageFacts, wanted: Wanted) -> None:
    """Give each of the lab's names to one node of a launch file: roslaunch refuses two of the same name."""
    names = [name.strip("/") for name in wanted.nodes]
    for launch in package.launch_files:
        taken = {node.name for node in launch.nodes}
        for node in launch.nodes:
            name = node.name or ""
            right = next((one for one in names if one not in taken and is_near(name, one)), "")
            if right and name not in names:
                _set_attribute(files, launch.path, node.line, ("name", name, right), kind="node-name")
                taken.add(right)
        _repair_full_names(files, launch, wanted)


def _repair_full_names(files: Files, launch: LaunchFile, wanted: Wanted) -> None:
    """Give a node the name, or its only namespace, that the lab asks for in this launch file."""
    there = {node.full_name for node in launch.brings}
    asked = [name for file, name in wanted.launched if file == PurePosixPath(launch.path).name]
    for right in (name for name in asked if name not in there):
        space, _, own = right.rpartition("/")
        for node in (one for one in launch.brings if one.full_name not in asked and one.file == launch.path):
            spaces = [line for line in node.renaming if line.tag not in {"remap", "args"}]
            change: tuple[str, str, str] | None = None
            if node.namespace == f"{space}/" and is_near(node.name or "", own):
                line, change = node.line, ("name", node.name or "", own)
            elif node.name == own and len(spaces) == 1 and is_near(spaces[0].value, space.strip("/")):
                line, change = spaces[0].line, ("ns", spaces[0].value, space.strip("/"))
            if change is not None:
                _set_attribute(files, launch.path, line, change, kind="node-name")
                break


def _rename_second_nodes(files: Files, launch: LaunchFile) -> None:
    """Name a node after its program where another one has its name: roslaunch refuses the file. Where nodes have
    namespaces or groups, one of these may be wrong instead."""
    nodes = [node for node in launch.brings if not node.uncertain and "$(" not in node.full_name]
    if any(node.namespace != "/" for node in nodes) or re.search(r"<group\b", files.text(launch.path) or ""):
        return
    taken: set[str] = set()
    for node in nodes:
        name = PurePosixPath(node.type or "").stem
        if node.full_name in taken and node.file == launch.path and name:
            free = f"{node.namespace}{name}" not in {one.full_name for one in nodes} | taken
            new = name if free else f"{name}_{len(taken) + 1}"
            _set_attribute(
                files, launch.path, node.line, ("name", node.name or "", new), kind="launch-syntax"
            )
            taken.add(f"{node.namespace}{new}")
        taken.add(node.full_name)


def _set_attribute(
    files: Files, file: str, line: int, change: tuple[str, str, str], *, kind: RepairKind
) -> None:
    """Replace the attribute's value where it next stands, from the tag's line on; a package's name in all the file."""
    attribute, old, new = change
    text = files.text(file)
    if text is None or line < 1:
        return
    lines = text.split("\n")
    pattern = re.compile(
        rf"(?P<head>\b{attribute}\s*=\s*(?P<quote>[\"'])\s*){re.escape(old)}(?=\s*(?P=quote))"
    )
    for number in range(line - 1, min(len(lines), line - 1 + TAG_LINES_MAX)):
        changed = pattern.sub(lambda m: m["head"] + new, lines[number], count=1)
        if changed != lines[number]:
            lines[number] = changed
            fix = ""
            if kind == "package-name":
                others = [n for n, one in enumerate(lines, 1) if pattern.search(one)]
                lines = [pattern.sub(lambda m: m["head"] + new, one) for one in lines]
                fix = f'write {attribute}="{new}" instead of {attribute}="{old}"{the_same_on(others)}'
            message = f'line {number + 1} of {file}: {attribute}="{old}" should be {attribute}="{new}"'
            files.change(kind, file, "\n".join(lines), message, fix)
            return
        # Another tag begins, so that the rest of the lines is not of this one.
        if number >= line and "<" in lines[number].replace("<!--", ""):
            return
