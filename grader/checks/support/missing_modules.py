"""Modules that a script imports and that are not there: what this machine lacks, and imports that nothing needs."""

from __future__ import annotations

import re

from grader.checks.support.console_output import Traceback
from grader.checks.support.missing_names import IMPORT_ERRORS, NO_MODULE, own_message, unimported_module
from grader.checks.support.scripts import SYNTAX
from grader.installable import OF_EVERY_ROS, exists_somewhere, known_packages
from grader.model.package import PackageFacts
from grader.model.verdict import FileCitation
from grader.wording import join_words


def lacking_too(place: FileCitation | None, package: PackageFacts) -> tuple[str, ...]:
    """Return the modules that exist, and that the script imports and that were not there either."""
    slips = (
        s for s in package.slips if place is not None and (s.file, s.kind) == (place.file, "lacking-import")
    )
    own = {package.name, *package.own_modules, *OF_EVERY_ROS, *(one.name for one in package.also)}
    return tuple(
        dict.fromkeys(s.message for s in slips if s.message in known_packages() and s.message not in own)
    )


def unused_import(place: FileCitation, package: PackageFacts) -> str:
    """Return that the import on that line is not needed, and which other lines import what is not needed and not there
    either; "" where it is needed, or another name of the file is not there."""
    own = [s for s in package.slips if s.file == place.file]
    if any(s.kind in {"undefined", "misspelt"} for s in own):
        return ""
    unused = {s.line for s in own if s.kind == "unused-import"}
    lacking = [(s.line, s.message) for s in own if s.kind == "lacking-import"]
    needed = {module for line, module in lacking if line not in unused}
    if any(line == place.line and module in needed for line, module in lacking):
        return ""
    spare = {line for line, module in lacking if module not in needed} | {place.line}
    fixes = {s.line: s.fix for s in own if s.kind == "unused-import" and s.line in spare}
    # from below, so that the lines above stay where they are
    return join_words([fixes[line] for line in sorted(fixes, reverse=True)]) if place.line in fixes else ""


def lacking_module(found: Traceback, package: PackageFacts) -> str:
    """Return the module that exists and that this machine lacks; "" for a name that is the student's own affair."""
    match = NO_MODULE.search(found.message) if found.kind == "ModuleNotFoundError" else None
    # roslib.load_manifest, which rosbuild needed, asks for the ROS package itself
    name = found.message if found.kind == "ResourceNotFound" else match[1] if match else ""
    own = {*package.own_modules, *(file.path.partition("/")[0] for file in package.files if "/" in file.path)}
    sure = found.kind == "ResourceNotFound" or (bool(found.frames) and found.frames[-1].in_library)
    known = name in known_packages() or not is_module(name, package)
    lacks = exists_somewhere(name, own) and (known or not sure)
    otherwise = own_message(found, package) or unimported_module(found, package)
    return name if name and name not in own and lacks and not otherwise else ""


def is_module(name: str, package: PackageFacts) -> bool:
    """Return whether it is a module of Python, and no package of ROS that messages come from."""
    declared = {one.name for one in package.manifest.dependencies} if package.manifest else set[str]()
    whole = [one.fix for one in package.slips if one.kind == "lacking-import" and one.message == name]
    of_messages = any(one.endswith((".msg", ".srv")) for one in whole)
    return name not in declared and not name.endswith(("_msgs", "_srvs")) and not of_messages


def broken_import(found: Traceback, package: PackageFacts) -> str:
    """Return the file of ROS's or of the machine's that cannot be imported; "" where the student takes part in it.

    Someone else's file raised it while a line of the student's imported it, and nothing of the package has the name of
    a module that takes part.
    """
    last = found.frames[-1] if found.frames else None
    imports = imported_line(found) or not found.own_frames
    kinds = (*IMPORT_ERRORS, *SYNTAX) if not found.own_frames else ()
    if last is None or not last.in_library or not imports or (kinds and found.kind not in kinds):
        return ""
    words = set(
        re.findall(r"\w+", " ".join([found.message, *(f"{f.file} {f.source}" for f in found.frames)]))
    )
    own = {
        name.partition(".")[0]
        for one in (package, *package.also)
        for file in one.files
        for name in file.path.split("/")[-2:]
        if file.python and not name.startswith("__init__")
    }
    shadowed = (
        own
        - {f.file.rpartition("/")[2].partition(".")[0] for f in found.own_frames}
        - {"src", "scripts", "nodes", "bin"}
    )
    return "" if shadowed & words else f"{last.file}, line {last.line}"


def imported_line(found: Traceback) -> str:
    """Return the student's line that imports something, and nothing else, if it was the last of them to be run."""
    source = found.innermost.source
    only = all(re.match(r"\s*((import|from)\s|$)", part) for part in source.split(";"))
    return source if only else ""
