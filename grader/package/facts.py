"""Package facts: everything that a package's files say, read once; nothing of the student's is executed."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from itertools import islice
from pathlib import Path, PurePosixPath

from grader.model.message_definitions import PARTS, parse_interface
from grader.model.package import Fault, Interface, PackageFacts, PythonSlip, SourceFile
from grader.model.submission import SourcePackage, Submission
from grader.package.files import Entry, Interpreters, read_files
from grader.package.python import check_syntax
from grader.package.reading import SOURCE_LIMIT_BYTES, read_markup

INTERFACES_MAX = 200
INTERFACE_LIMIT_BYTES = 64_000


def read_package(
    package: SourcePackage,
    *,
    hints: tuple[str, ...] = (),
    cmake_trace: Path | None = None,
    cmake_root: str | None = None,
    python_faults: Mapping[str, Fault] | None = None,
    interpreters: Interpreters | None = None,
) -> PackageFacts:
    """Return the facts of one package.

    `cmake_trace` is a file that CMake wrote by `--trace-expand --trace-format=json-v1`, `cmake_root` the
    package's folder as CMake saw it; without a trace, a parser reads `CMakeLists.txt`. `python_faults` are
    those that ROS's own Python found, by path; without them, this Python looks, in a process of its own.
    `interpreters` tells whether a program of a shebang is on ROS's machine (an absolute path, or a name
    behind `env`).
    """
    entries = read_files(package, interpreters)
    with ThreadPoolExecutor(1) as beside:
        asked = beside.submit(check_syntax, package.folder, _python_paths(entries))
        # the parsers are slow to load, and are loaded while the child reads the scripts
        from grader.package.cmake import read_cmake  # noqa: PLC0415
        from grader.package.launch import read_launch_files  # noqa: PLC0415
        from grader.package.manifest import read_manifest  # noqa: PLC0415

        manifest, manifest_fault = read_manifest(package.folder)
        cmake = read_cmake(package.folder, package.name, trace=cmake_trace, root=cmake_root)
        launch_files = read_launch_files(
            package.folder,
            ((e.file.path, e.path) for e in _readable(entries)),
            (manifest.name if manifest else package.name, package.name),
        )
        report = asked.result()
    faults = report.faults if python_faults is None else python_faults
    files = tuple(entry.file for entry in entries)
    return PackageFacts(
        name=package.name,
        path=package.path,
        manifest=manifest,
        manifest_fault=manifest_fault,
        cmake=cmake,
        files=_with_faults(files, faults),
        launch_files=launch_files,
        hints=hints,
        slips=report.slips,
        interfaces=_interfaces(package.folder, _readable(entries)),
        asked=package.asked,
    )


def read_packages(submission: Submission) -> PackageFacts:
    """Return the facts of a submission's main package, with those of the others."""
    facts = read_package(submission.package, hints=submission.hints)
    return facts.model_copy(update={"also": tuple(map(read_package, submission.also))})


def with_build_facts(
    facts: PackageFacts,
    *,
    cmake_trace: Path | None = None,
    cmake_root: str | None = None,
    python_faults: Mapping[str, Fault] | None = None,
    python_slips: tuple[PythonSlip, ...] | None = None,
) -> PackageFacts:
    """Return `facts` refined by what the build showed: CMake's own trace, and ROS's own Python on the sources.

    What is None stays as it was. `python_faults` replace the faults of all `python_paths`.
    """
    changes: dict[str, object] = {}
    if cmake_trace is not None and facts.cmake is not None:
        from grader.package.cmake import refine_cmake  # noqa: PLC0415 - slow to load

        names = (facts.name, PurePosixPath(facts.path).name)
        changes["cmake"] = refine_cmake(facts.cmake, names, trace=cmake_trace, root=cmake_root)
    if python_faults is not None:
        asked = set(python_paths(facts))
        kept = {f.path: f.python_fault for f in facts.files if f.python_fault and f.path not in asked}
        changes["files"] = _with_faults(facts.files, {**kept, **python_faults})
    if python_slips is not None:
        changes["slips"] = python_slips
    return facts.model_copy(update=changes)


def python_paths(facts: PackageFacts) -> tuple[str, ...]:
    """Return the files that ROS's Python is to look at, in a copy of the package as well as here.

    Python by name or shebang, not too large, no link by absolute path, and a name that is valid Unicode.
    """
    return tuple(f.path for f in facts.files if _to_check(f) and not _only_here(f))


def _interfaces(folder: Path, entries: Iterable[Entry]) -> tuple[Interface, ...]:
    own = (entry for entry in entries if PurePosixPath(entry.file.path).suffix in PARTS)
    return tuple(_interface(folder, entry) for entry in islice(own, INTERFACES_MAX))


def _interface(folder: Path, entry: Entry) -> Interface:
    data = read_markup(folder, entry.path, INTERFACE_LIMIT_BYTES)
    if isinstance(data, Fault):
        return Interface(path=entry.file.path, fields=(), fault=data)
    return parse_interface(data, entry.file.path)


def _only_here(file: SourceFile) -> bool:
    return "\\udc" in file.path or (file.link or "").startswith("/")


def _python_paths(entries: Iterable[Entry]) -> list[str]:
    return [entry.path for entry in entries if _to_check(entry.file)]


def _to_check(file: SourceFile) -> bool:
    return file.python and not file.link_problem and file.size_bytes <= SOURCE_LIMIT_BYTES


def _readable(entries: Iterable[Entry]) -> Iterable[Entry]:
    return (entry for entry in entries if not entry.file.link_problem)


def _with_faults(files: tuple[SourceFile, ...], faults: Mapping[str, Fault]) -> tuple[SourceFile, ...]:
    return tuple(file.model_copy(update={"python_fault": faults.get(file.path)}) for file in files)
