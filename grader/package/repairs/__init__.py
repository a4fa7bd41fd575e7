"""Mechanical repairs: what keeps a package from being judged, and the line that puts it right.

A package's folder, its facts and what the rubric names come in, `model.repair.Repair`s go out; `apply_repair` makes
one on a copy, or on the student's own files. Nothing of the student's is executed, and no link is followed.

A new kind needs
1. its name in `RepairKind` and how it is done by hand in `BY_HAND` (`model/repair.py`), and its name in `HALVING` there
   if it costs half of the points;
2. a function that finds it in one of the modules here, and a call of that in `find_repairs`;
3. its name in the sets of `judging/repair_charges.py` that fit, which decide to which criterion it is charged;
4. its name in `FIXED` of `cli/fixing.py` if `grader check --fix` may do it: never what decides what a program does.

One more line of Python for a kind that is there is a correction in `line_slips/python.py`, or a step in
`package/python_repairs/examine.py`.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path, PurePosixPath

from grader.model.package import MANIFEST, PackageFacts, SourceFile
from grader.model.repair import DEFAULT_SHARES, KINDS, Repair, RepairKind
from grader.package.repairs.cmakelists import rename_package, repair_cmake
from grader.package.repairs.cpp import repair_cpp
from grader.package.repairs.editing import (
    BOM,
    UTF16,
    Files,
    NotRepairable,
    exchange_contents,
    keep_last_version,
    make_executable,
    read_data,
    rename_everywhere,
    rename_file,
    replace_lines,
    write_data,
)
from grader.package.repairs.files import (
    exchange_files,
    find_renames,
    is_own,
    rename_files,
    repair_files,
    to_utf8,
)
from grader.package.repairs.launch_files import repair_launch_files, repair_launch_names
from grader.package.repairs.manifest import repair_manifest
from grader.package.repairs.names import (
    CPP,
    Wanted,
    is_near,
    names_in_cpp,
    names_remapped,
    repair_script_keys,
    repair_script_names,
    repair_yaml_names,
    wanted_of,
)
from grader.package.repairs.python import Name, repair_python
from grader.package.repairs.yaml_files import repair_yaml_files

__all__ = [
    "DEFAULT_SHARES",
    "NotRepairable",
    "Repair",
    "RepairKind",
    "Wanted",
    "apply_repair",
    "find_repairs",
    "wanted_of",
]

SCRIPTS_MAX = 40
IMPORTED = re.compile(r"^\s*(?:from|import)\s+([\w.]+)", re.MULTILINE)
TYPES = re.compile(r"\btype\s*=\s*[\"']?([\w.-]{1,100})")
UNREAD = ("PythonCrash", "NotChecked")


def find_repairs(folder: Path, package: PackageFacts, wanted: Wanted) -> tuple[Repair, ...]:
    """Return the repairs in the order in which a student would meet them.

    They may be applied in this order, all of them or some: each names its file and its lines as they are after those
    before it. A package that is right may have some too: a name that the lab does not fix can be near one that it does.
    """
    files = Files(folder=folder.resolve())
    renames = find_renames(package, wanted)
    started = _started(files, package, wanted, renames)
    imported = _imported(files, package, started)
    scripts = [*started, *imported][:SCRIPTS_MAX]
    repair_files(files, scripts, {file.path for file in started})
    # Renamed first: whatever follows looks for a file where it will be.
    rename_files(files, renames)
    sources = (f.path for f in scripts if f.python and f.link is None and not f.is_no_script)
    paths = [renames.get(path, path) for path in sources]
    for path in paths:
        keep_last_version(files, path, _names_of(path, wanted))
    names = repair_python(
        files, paths, package, wanted.types, {renames.get(f.path, f.path) for f in imported}
    )
    name = repair_manifest(files, package, wanted)
    repair_cmake(files, package, name, wanted, [f.path for f in scripts])
    rename_package(files, package, wanted)
    files_now = [renames.get(f.path, f.path) for f in package.files if is_own(f.path)]
    # A file's names can be read once it is well-formed, as what the inner call returns is.
    repair_launch_names(files, repair_launch_files(files, package), files_now, wanted)
    wanted = wanted.model_copy(update={"remapped": (*wanted.remapped, *names_remapped(package))})
    for path in (f.path for f in package.files if f.path.endswith(CPP) and is_own(f.path)):
        repair_cpp(files, path)
        names[path] = names_in_cpp(files.text(path) or "")
    links = _links_of_others(files, names, wanted)
    of_lab = _of_lab(names, wanted)
    taken = {one.value.strip("/") for script in of_lab for one in names[script] if one.role == "node"}
    left = wanted.model_copy(update={"nodes": tuple(n for n in wanted.nodes if n.strip("/") not in taken)})
    for script in names:
        own = [name for name in names[script] if name not in links.get(script, ())]
        others = {n.value for other in names if other != script for n in names[other] if n.role == "node"}
        repair_script_names(files, script, own, wanted if script in of_lab else left, others)
    repair_yaml_files(files, package, wanted)
    repair_yaml_names(files, package, names, wanted)
    for script in names:
        repair_script_keys(files, package, script, names[script], wanted)
    exchange_files(files, names, wanted)
    return tuple(sorted(files.repairs, key=lambda repair: KINDS.index(repair.kind)))


def _names_of(path: str, wanted: Wanted) -> list[str]:
    """Return what the lab's script of this name has to use: of its node, topics and services."""
    return [used for of, _, used in wanted.does if PurePosixPath(of).name == PurePosixPath(path).name]


def _of_lab(names: Iterable[str], wanted: Wanted) -> list[str]:
    """Return which of the scripts have the name of one of the lab's."""
    asked = {PurePosixPath(script).name for script in wanted.scripts}
    return [script for script in names if PurePosixPath(script).name in asked]


def _links_of_others(
    files: Files, names: Mapping[str, Sequence[Name]], wanted: Wanted
) -> dict[str, list[Name]]:
    """Return the topics that scripts beside those of the lab share with another script, at its other end: where each of
    the lab's scripts is there, such a topic is no slip of the lab's."""
    of_lab = _of_lab(names, wanted)
    if len(of_lab) < len({PurePosixPath(script).name for script in wanted.scripts}):
        return {}
    imported = {
        word.rpartition(".")[2] for script in of_lab for word in IMPORTED.findall(files.text(script) or "")
    }
    ends: dict[tuple[str, str], set[str]] = {}
    for script in names:
        for one in names[script]:
            ends.setdefault((one.role, one.value.strip("/")), set()).add(script)
    other = {"publisher": "subscriber", "subscriber": "publisher"}
    return {
        script: [
            one
            for one in names[script]
            if ends.get((other.get(one.role, ""), one.value.strip("/")), set()) - {script}
        ]
        for script in names
        if script not in of_lab and PurePosixPath(script).stem not in imported
    }


def apply_repair(folder: Path, repair: Repair) -> None:
    """Make the repair in the package's folder: files are replaced whole and keep their modes, and no link is followed.

    Raises NotRepairable where the file is no longer as the repair knows it, and OSError where it cannot be written.
    """
    folder = folder.resolve()
    if repair.kind == "executable-bit":
        make_executable(folder, repair.file)
    elif repair.kind == "file-name":
        rename_file(folder, repair)
    elif repair.kind == "exchanged-files":
        exchange_contents(folder, repair.before, repair.after)
    else:
        data = read_data(folder, repair.file)
        if data is None:
            raise NotRepairable(f"{repair.file} is not a file that can be repaired")
        write_data(folder, repair.file, _repair_bytes(data, repair))
        # The build files and launch files name the package as well.
        if repair.kind == "package-name" and repair.file == MANIFEST:
            _rename_package(folder, repair)


def _repair_bytes(data: bytes, repair: Repair) -> bytes:
    if repair.kind == "line-ends":
        return data.replace(b"\r\n", b"\n")
    if repair.kind == "byte-order-mark":
        return data.removeprefix(BOM)
    if repair.kind == "encoding" or data.startswith(UTF16):
        data = to_utf8(data)
    return data if repair.kind == "encoding" else replace_lines(data, repair)


def _rename_package(folder: Path, repair: Repair) -> None:
    old, new = (re.search(r"<name>\s*([\w-]+)", text) for text in (repair.before, repair.after))
    if old and new:
        rename_everywhere(folder, old[1], new[1])


def _readable(package: PackageFacts) -> list[SourceFile]:
    own = [f for f in package.files if is_own(f.path) and not f.link_problem]
    return [f for f in own if f.python_fault is None or f.python_fault.kind not in UNREAD]


def _started(
    files: Files, package: PackageFacts, wanted: Wanted, renames: dict[str, str]
) -> list[SourceFile]:
    """Return the files that are run: those of the lab in its order, then those of its launch files."""
    python = _readable(package)
    named = [PurePosixPath(path).name for path in (*wanted.scripts, *wanted.installed)]
    asked = {PurePosixPath(path).name for path in wanted.launch_files}
    launches = [f for f in package.launch_files if PurePosixPath(renames.get(f.path, f.path)).name in asked]
    named += [node.type for launch in launches for node in (*launch.nodes, *launch.brings) if node.type]
    unread = (files.text(launch.path) or "" for launch in launches if launch.fault is not None)
    named += [name for text in unread for name in TYPES.findall(text)]
    built = {one.name for one in package.cmake.executables} if package.cmake else set[str]()
    named += [f"{name}.py" for name in named if not PurePosixPath(name).suffix and name not in built]
    names = dict.fromkeys(PurePosixPath(file.path).name for file in python)
    there = {*names, *(PurePosixPath(path).name for path in renames.values())}
    named += [right for name in named if name not in there for right in names if is_near(name, right)]
    found: dict[str, SourceFile] = {}
    for name in dict.fromkeys(named):
        for file in (one for one in python if not one.path.endswith(CPP)):
            if name in (PurePosixPath(file.path).name, PurePosixPath(renames.get(file.path, "")).name):
                found[file.path] = file
    return list(found.values())


def _imported(files: Files, package: PackageFacts, started: Sequence[SourceFile]) -> list[SourceFile]:
    """Return what these files import, which no one starts."""
    texts = "\n".join(filter(None, (files.text(file.path) for file in started)))
    modules = {part for module in IMPORTED.findall(texts) for part in module.split(".")}
    paths = {file.path for file in started}
    return [
        file
        for file in _readable(package)
        if file.python and file.path not in paths and PurePosixPath(file.path).stem in modules
    ]
