"""Package facts: what the files of a package say, each with file and line. Parsed once, frozen, never executed.

Paths are posix and relative to the package's root; lines count from 1.
"""

from __future__ import annotations

from typing import Literal

from grader.model.record import Record
from grader.model.submission import ModeSource


class Fault(Record):
    """Why a file cannot be read as what it should be. `kind` is the parser's own word (`XMLSyntaxError`, `TabError`).

    `cause` is the same in a student's words, empty where the message says enough.
    """

    file: str
    line: int | None
    column: int | None = None
    kind: str
    message: str
    cause: str = ""


class Dependency(Record):
    """One dependency element of `package.xml`; `kind` is the tag: `depend`, `exec_depend`, `run_depend`, …"""

    kind: str
    name: str
    line: int


class Person(Record):
    name: str
    email: str
    line: int


class Manifest(Record):
    """`package.xml` (REP 127, 140, 149). `buildtool` is what `catkin_pkg` gives as the build type."""

    file: str
    format: int
    name: str
    name_line: int
    version: str
    maintainers: tuple[Person, ...]
    licenses: tuple[str, ...]
    dependencies: tuple[Dependency, ...]
    build_type: str
    advice: tuple[str, ...] = ()


class CMakeCall(Record):
    """One command of the package's CMake files with its arguments after expansion; `name` in lower case."""

    name: str
    args: tuple[str, ...]
    file: str
    line: int


class CMakeFacts(Record):
    """`source` says who read it: CMake itself (`trace`, variables expanded, branches taken) or a parser (`parser`)."""

    file: str
    source: Literal["trace", "parser"]
    calls: tuple[CMakeCall, ...]
    fault: Fault | None = None


class Shebang(Record):
    """The first line of a script after `#!`, without its line ending. `interpreter` is the program it comes down to:
    for `/usr/bin/env python3` that is `python3`. `found` tells whether ROS's machine has that program."""

    text: str
    interpreter: str
    crlf: bool
    found: bool | None


class SourceFile(Record):
    """One file of the package. `executable` is None where the source carries no modes.

    `link` is the target of a symbolic link. `python_fault` is filled for files that are Python by name or shebang
    and that ROS's Python does not compile.
    """

    path: str
    size_bytes: int
    sha256: str
    executable: bool | None
    mode_source: ModeSource
    link: str | None = None
    shebang: Shebang | None = None
    crlf: bool = False
    bom: bool = False
    encoding: str = "utf-8"
    binary: bool = False
    python_fault: Fault | None = None


class LaunchNode(Record):
    """One `<node>`, its attributes as written; an attribute that is not there is None."""

    pkg: str | None
    type: str | None
    name: str | None
    ns: str | None
    output: str | None
    launch_prefix: str | None
    args: str | None
    remaps: tuple[tuple[str, str], ...]
    line: int


class LaunchFile(Record):
    """`fault` is set where the file is not well-formed or does not begin with `<launch>`."""

    path: str
    root: str | None
    nodes: tuple[LaunchNode, ...]
    includes: tuple[str, ...]
    fault: Fault | None = None


class PackageFacts(Record):
    """All of it. `manifest` is None where `manifest_fault` says why."""

    name: str
    path: str
    manifest: Manifest | None
    manifest_fault: Fault | None
    cmake: CMakeFacts | None
    files: tuple[SourceFile, ...]
    launch_files: tuple[LaunchFile, ...]
    hints: tuple[str, ...] = ()

    def file(self, path: str) -> SourceFile | None:
        """The file at this path, or None."""
        return next((f for f in self.files if f.path == path), None)
