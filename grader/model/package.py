"""Package facts: what a package's files say, with file and line. Parsed once, frozen, never executed.

Paths are posix and relative to the package's root; lines count from 1.
"""

from __future__ import annotations

import posixpath
import re
import shlex
from collections.abc import Iterable, Iterator, Mapping
from collections.abc import Set as AbstractSet
from difflib import get_close_matches
from pathlib import PurePosixPath
from typing import Literal

from pydantic import Field

from grader.model.file_fault import Fault
from grader.model.git_ignores import IgnoreLine
from grader.model.launch_file import LaunchFile
from grader.model.python_slip import PythonSlip
from grader.model.record import Record
from grader.model.submission import ModeSource
from grader.model.verdict import Placed
from grader.wording import is_one_edit

MANIFEST, CMAKE = "package.xml", "CMakeLists.txt"
"""The two files at the root of each package."""


class Dependency(Record):
    """One dependency element of `package.xml`; `kind` is the tag: `depend`, `exec_depend`, `run_depend`, …"""

    kind: str
    name: str
    line: int


class Person(Record):
    """A maintainer or author of `package.xml`."""

    name: str
    email: str
    line: int


class Manifest(Record):
    """`package.xml` (REP 127, 140, 149). `build_type` is what `catkin_pkg` gives."""

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


CMAKE_COMMANDS = (
    "add_action_files", "add_compile_options", "add_custom_target", "add_definitions", "add_dependencies",
    "add_executable", "add_library", "add_message_files", "add_rostest", "add_service_files",
    "catkin_add_nosetests", "catkin_package", "catkin_package_xml", "catkin_install_python", "catkin_python_setup",
    "cmake_minimum_required", "find_package", "find_library", "generate_dynamic_reconfigure_options",
    "generate_messages", "include_directories", "install", "link_directories", "list", "message", "project", "set",
    "set_target_properties", "target_compile_features", "target_compile_options", "target_include_directories",
    "target_link_libraries", "target_sources",
)  # fmt: skip
"""Of CMake and catkin, those that a beginner's package calls."""
SIMPLE = "catkin_simple"
"""Finds catkin and what the manifest names, makes messages, and links: its calls `cs_…` stand for many of catkin's."""
OTHER_COMMANDS = frozenset({"cs_add_executable", "cs_add_library", "cuda_include_directories"})
"""Commands that have nearly the name of another one and are meant."""
MAKES_PACKAGE = ("catkin_package", "catkin_metapackage", "cs_export")
"""Any of these calls makes it a package of catkin."""
ALIKE, SHORT = 0.88, 5
"""How alike two names of commands are that differ by one slip; in names of so few letters that says nothing."""


def meant_command(name: str) -> str:
    """Return the command of CMake or catkin that a name, in small letters, is a slip of; empty where it is none."""
    if name in CMAKE_COMMANDS or name in OTHER_COMMANDS or len(name) <= SHORT:
        return ""
    # The same words in another order: `package_catkin`.
    turned = [known for known in CMAKE_COMMANDS if sorted(known.split("_")) == sorted(name.split("_"))]
    turned += [known for known in CMAKE_COMMANDS if is_one_edit(known, name)]
    near = turned or get_close_matches(name, CMAKE_COMMANDS, 1, ALIKE)
    return near[0] if near else ""


def meant_manifest(name: str) -> str:
    """Return what to do with a file that is there in place of package.xml; empty for any other file."""
    if name == "manifest.xml":
        written = "write package.xml, and a CMakeLists.txt without rosbuild's lines, as catkin_create_pkg makes them"
        return f"{name} is rosbuild's, which catkin does not read: {written}"
    # `package (1).xml`, as browsers call a second download, and `Package.xml`.
    plain = re.sub(r"\s|\(\d+\)", "", name.casefold())
    alike = plain == MANIFEST or is_one_edit(plain, MANIFEST) or plain.startswith(f"{MANIFEST}.")
    if name == MANIFEST or plain.endswith(".stamp") or not alike:  # catkin leaves a stamp where it builds
        return ""
    return f"{name} has to be called package.xml: git mv {shlex.quote(name)} package.xml"


class CMakeCall(Placed, Record):
    """One command of the package's CMake files with its arguments after expansion; `name` in lower case."""

    name: str
    args: tuple[str, ...]
    file: str
    line: int


class CMakeFacts(Record):
    """`source` says who read it: CMake itself (`trace`: variables expanded, branches taken) or a `parser`.

    `last_line` is where the last top-level command of the file begins. `stopped_line` is the last line that
    CMake reached if it gave up before that one; later calls are then the parser's.
    """

    file: str
    source: Literal["trace", "parser"]
    calls: tuple[CMakeCall, ...]
    fault: Fault | None = None
    last_line: int | None = None
    stopped_line: int | None = None
    commented: tuple[CMakeCall, ...] = Field(default=(), exclude_if=lambda value: not value)
    """The calls of `add_dependencies` in comments of one line, as the parser reads them."""

    @property
    def executables(self) -> tuple[Executable, ...]:
        """The programs of `add_executable`, or of another library's command (`cs_add_executable`), under the names that
        the targets' properties give them."""
        given: dict[str, dict[str, tuple[str, CMakeCall]]] = {}
        for call in self.calls:
            for target, name, value in _properties(call):
                given.setdefault(target, {})[name] = (value, call)
        made = (call for call in self.calls if call.name.endswith("add_executable") and call.args)
        return tuple(_executable(call, given.get(call.args[0], {})) for call in made)


OF_NAMES = ("RUNTIME_OUTPUT_NAME", "OUTPUT_NAME", "PREFIX", "SUFFIX", "RUNTIME_OUTPUT_DIRECTORY")


def _properties(call: CMakeCall) -> Iterator[tuple[str, str, str]]:
    """Yield target, property and value of those that a program's name or folder depends on.

    An empty argument (`PREFIX ""`) is none of a call's arguments: the next property's name stands in its place.
    """
    word = {"set_target_properties": "PROPERTIES", "set_property": "PROPERTY"}.get(call.name, "")
    if word not in call.args or (word == "PROPERTY" and call.args[0] != "TARGET"):
        return
    at = call.args.index(word)
    targets = call.args[1:at] if word == "PROPERTY" else call.args[:at]
    rest = list(call.args[at + 1 :])
    while rest:
        name = rest.pop(0)
        # Where the value was empty, the next word is already a property's name.
        value = rest.pop(0) if rest and rest[0] not in OF_NAMES else ""
        if name in OF_NAMES:
            yield from ((target, name, value) for target in targets)


def _executable(call: CMakeCall, given: Mapping[str, tuple[str, CMakeCall]]) -> Executable:
    target = call.args[0]
    values = {name: value for name, (value, _) in given.items()}
    name = values.get("RUNTIME_OUTPUT_NAME") or values.get("OUTPUT_NAME") or target
    return Executable(
        target=target,
        name=f"{values.get('PREFIX', '')}{name}{values.get('SUFFIX', '')}",
        folder=values.get("RUNTIME_OUTPUT_DIRECTORY", ""),
        call=call,
        named=next((given[key][1] for key in OF_NAMES if key in given), None),
    )


class Executable(Record):
    """A program that CMake makes: its `target`, the `name` of its file, and the `folder` that it goes to, "" for
    catkin's own, `lib/<package>`. `call` is its `add_executable`, `named` what gives it another name or folder than the
    target's. Where CMake was not asked, `${…}` and `$<…>` stay as they are written."""

    target: str
    name: str
    folder: str
    call: CMakeCall
    named: CMakeCall | None

    def is_called(self, name: str) -> bool:
        """Return whether the program's file has this name, as far as that is known."""
        # Between the parts that are written out, a variable may have any value.
        literals = re.split(r"\$\{[^{}]*\}|\$<[^<>]*>", self.name)
        return re.fullmatch(".*".join(map(re.escape, literals)), name) is not None


class Shebang(Record):
    """The first line of a script after `#!`, without its line ending.

    `interpreter` is the program that is meant: for `/usr/bin/env python3` that is `python3`. `found` says
    whether ROS's machine has that program.
    """

    text: str
    interpreter: str
    crlf: bool
    found: bool | None


ShebangFault = Literal["", "empty-file", "byte-order-mark", "line-end", "other"]


class SourceFile(Record):
    """One file of the package. `executable` is None if the source has no file modes.

    `link` is the target of a symbolic link as written. A link to a file of the same package has that file's
    facts; any other has `link_problem`, size 0 and the digest of its target's text. `python` marks files
    that are Python by name or shebang; `python_fault` says why ROS's Python does not compile one, and `imports` has the
    package's own files that it names in its imports. `headers` has what a file of C++ includes, by itself or by the
    package's own headers, of the form `lab1/Num.h`, as the build makes them of messages.
    `shebang_problem` says why the system cannot start a script by its first line ("" if it can, and for
    files that are not scripts), and `shebang_fault` whether more than that line is wrong. `sha256` is empty
    for a file that cannot be read.
    """

    path: str
    size_bytes: int
    sha256: str
    executable: bool | None
    mode_source: ModeSource
    link: str | None = None
    link_problem: str = ""
    shebang: Shebang | None = None
    shebang_problem: str = ""
    shebang_fault: ShebangFault = ""
    crlf: bool = False
    bom: bool = False
    encoding: str = "utf-8"
    binary: bool = False
    python: bool = False
    python_fault: Fault | None = None
    imports: tuple[str, ...] = Field(default=(), exclude_if=lambda value: not value)
    headers: tuple[str, ...] = Field(default=(), exclude_if=lambda value: not value)

    @property
    def names_other_language(self) -> bool:
        """Whether it is Python, and its first line has a shell or the like run it."""
        return self.python and self.shebang is not None and "python" not in self.shebang.interpreter

    @property
    def is_no_script(self) -> bool:
        """Whether the whole file is something else than a script, such as a web page."""
        fault = self.python_fault
        whole = fault is not None and fault.line is None and fault.kind == "SyntaxError"
        return whole and not self.in_other_encoding

    @property
    def in_other_encoding(self) -> bool:
        """Whether it is not saved as UTF-8, as which the arena saves a script before it runs."""
        return self.encoding in {"utf-16", "unknown-8bit"}


CLASSES_OF = {
    "srv": ("", "Request", "Response"),
    "action": (*("Action", "Goal", "Result", "Feedback"), *("ActionGoal", "ActionResult", "ActionFeedback")),
}
"""What follows a definition's name in the names of its classes."""


class InterfaceField(Record):
    """A line of a `.msg`, `.srv` or `.action` file: a field, or a constant, which has a `value` as written.

    `part` is "" in a message, else `request`, `response`, `goal`, `result` or `feedback`. `type` is as written.
    """

    part: str
    type: str
    name: str
    line: int
    value: str | None = None

    @property
    def path(self) -> str:
        """Its name, behind that of its part: `request.a`, and `range_m` of a message."""
        return f"{self.part}.{self.name}" if self.part else self.name


class Interface(Record):
    """One definition of the package's own. `fault` says why it is none."""

    path: str
    fields: tuple[InterfaceField, ...]
    fault: Fault | None = None

    @property
    def module(self) -> str:
        """The module of the package in which the build puts its classes: `msg` or `srv`."""
        return "srv" if self.path.endswith(".srv") else "msg"

    @property
    def classes(self) -> tuple[str, ...]:
        """The classes that the build makes of it."""
        name, _, suffix = posixpath.basename(self.path).partition(".")
        return tuple(f"{name}{part}" for part in CLASSES_OF.get(suffix, ("",)))

    @property
    def members(self) -> dict[str, list[str]]:
        """The names that each of these classes has: of a message, of a request and a response, of what an action takes
        and gives. A service's own class, and an action's messages, are not among them."""
        found: dict[str, list[str]] = {}
        for one in self.fields:
            found.setdefault(f"{self.classes[0].removesuffix('Action')}{one.part.capitalize()}", []).append(
                one.name
            )
        return found


BUILD_SPACES = frozenset({"build", "devel", "install"})
"""Where catkin puts what it makes: a copy of a package in there is none."""
OF_PACKAGES = frozenset({".py", ".cpp", ".msg", ".srv", ".action", ".launch"})
PACKAGE_FOLDERS = frozenset({"scripts", "src", "nodes", "bin", "msg", "srv", "action", "launch"})
INTERFACE_FOLDERS = {"add_message_files": "msg", "add_service_files": "srv", "add_action_files": "action"}
"""Calls that name definitions, and the folders of these."""


class PackageFacts(Record):
    """What the package's files say; nothing of it was run."""

    name: str
    """The package's name, from its manifest; its folder's name if the manifest cannot be read."""
    path: str
    """Where the package was in the submission."""
    manifest: Manifest | None
    """`package.xml`; if None, `manifest_fault` says why."""
    manifest_fault: Fault | None
    """Why the manifest cannot be read."""
    cmake: CMakeFacts | None
    """`CMakeLists.txt`; None if there is none."""
    files: tuple[SourceFile, ...]
    """All files, in the order of their paths."""
    launch_files: tuple[LaunchFile, ...]
    """All launch files."""
    hints: tuple[str, ...] = ()
    """Remarks from when the submission was opened."""
    slips: tuple[PythonSlip, ...] = ()
    """Slips in Python files that compile."""
    interfaces: tuple[Interface, ...] = ()
    """The package's own `.msg`, `.srv` and `.action` files."""
    launched: tuple[LaunchFile, ...] = Field(default=(), exclude_if=lambda value: not value)
    """Launch files once more, read with the arguments that a scenario of the lab gives them."""
    asked: str = Field(default="", exclude_if=lambda value: not value)
    """The lab's name for it, if the lab asks for several packages and this is not the main one."""
    git_ignores: tuple[IgnoreLine, ...] = Field(default=(), exclude_if=lambda value: not value)
    """What git leaves out, where the package was handed in with git."""
    also: tuple[PackageFacts, ...] = Field(default=(), exclude_if=lambda value: not value)
    """The other packages that the lab asks for and that were handed in; their paths are below their own folders."""
    beside: tuple[str, ...] = Field(default=(), exclude_if=lambda value: not value)
    """The names of all other packages that were handed in."""

    def as_launched(self, commands: Iterable[tuple[str, ...]]) -> PackageFacts:
        """Return the facts with the launch files as these commands of roslaunch read them."""
        read = {
            file.path: file
            for argv in (commands if self.launched else ())
            for file in self.launched
            if PurePosixPath(file.path).name in {PurePosixPath(word).name for word in argv}
            and file.given == tuple(word for word in argv if ":=" in word)
        }
        files = tuple(read.get(file.path, file) for file in self.launch_files)
        return self.model_copy(update={"launch_files": files}) if read else self

    @property
    def others(self) -> set[str]:
        """The names of packages that are not this one: handed in with it, or named by its manifest."""
        needed = self.manifest.dependencies if self.manifest is not None else ()
        return {*self.beside, *(one.name for one in self.also), *(one.name for one in needed)}

    def way_to(self, other: PackageFacts) -> str:
        """Return the path of another package's folder from this one's, `.` for the same: `../lab_msgs`."""
        return posixpath.relpath(other.path, self.path)

    def views(self) -> tuple[PackageFacts, ...]:
        """Return this package and those of `also`, in this order, each with all the others as its own `also`."""
        # Without its own `also`: otherwise each of them would hold all others, and these each other again.
        alone = [one.model_copy(update={"also": ()}) for one in (self, *self.also)]
        rest = (tuple(other for other in alone if other is not one) for one in alone)
        return tuple(one.model_copy(update={"also": also}) for one, also in zip(alone, rest, strict=True))

    def launches_of(self, programs: AbstractSet[str]) -> list[str]:
        """Return the launch files that start all of these programs; if there are several, those of the
        package's own nodes, and of these the ones that give no topic another name."""
        found = [one for one in self.launch_files if programs and one.starts(programs) == programs]
        own = [one for one in found if all(node.pkg == self.name for node in one.nodes)]
        plain = [
            one for one in own if not any(n.remaps or n.namespace != "/" for n in one.brings or one.nodes)
        ]
        return [one.path for one in plain or own or found]

    @property
    def has_no_manifest(self) -> bool:
        """Whether there is no `package.xml`; one that cannot be read is another fault."""
        fault = self.manifest_fault
        return self.manifest is None and (fault is None or fault.kind == "Missing")

    @property
    def own_modules(self) -> set[str]:
        """What a script of the package may import of the student's own. (A file `rospy` without `.py` is none: a
        shell that runs a script without its first line makes such a picture, by ImageMagick's program `import`.)"""
        files = {f.path.rpartition("/")[2].removesuffix(".py") for f in self.files if f.python}
        return {self.name, *(one.name for one in self.also), *files}

    @property
    def folder_beside(self) -> str:
        """Return the folder that has all of the package's own folders, where `package.xml` and `CMakeLists.txt` lie
        beside it and name files as if they lay in it; "" of other packages."""
        code = [PurePosixPath(f.path) for f in self.files if PurePosixPath(f.path).suffix in OF_PACKAGES]
        # A copy of the package in a folder of catkin's own says nothing of where the sources are.
        inside = [path for path in code if len(path.parts) > 1 and path.parts[0] not in BUILD_SPACES]
        tops = {path.parts[0] for path in inside}
        top = next(iter(tops)) if len(tops) == 1 else ""
        if not top or top in PACKAGE_FOLDERS or not PACKAGE_FOLDERS & {path.parts[1] for path in inside}:
            return ""
        calls = self.cmake.calls if self.cmake is not None else ()
        paths = ((INTERFACE_FOLDERS.get(c.name, "."), arg) for c in calls for arg in c.args if arg)
        named = {PurePosixPath(folder, path) for folder, path in paths}
        there = {PurePosixPath(f.path) for f in self.files}
        return top if any(PurePosixPath(top, path) in there and path not in there for path in named) else ""

    def file(self, path: str) -> SourceFile | None:
        """Return the file at this path, or None."""
        return next((f for f in self.files if f.path == path), None)

    def hints_on(self, path: str) -> tuple[str, ...]:
        """Return intake's remarks about one file: such hints begin with its path."""
        return tuple(hint for hint in self.hints if hint.startswith(f"{path} "))

    def general_hints(self) -> tuple[str, ...]:
        """Return intake's remarks about the submission as a whole: where the package was found, and as what."""
        of_files = {hint for file in self.files for hint in self.hints_on(file.path)}
        return tuple(hint for hint in self.hints if hint not in of_files)
