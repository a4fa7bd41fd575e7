"""Scripts, C++ programs and other files of a package: where they lie, and what `CMakeLists.txt` makes and installs."""

from __future__ import annotations

import posixpath
import re
from collections.abc import Collection, Iterable, Iterator, Sequence
from pathlib import PurePosixPath
from typing import NamedTuple

from grader.model.file_fault import Fault
from grader.model.git_ignores import IgnoreLine, hiding_line
from grader.model.package import CMakeCall, Executable, PackageFacts, SourceFile
from grader.model.python_slip import PythonSlip, SlipKind
from grader.model.verdict import FileCitation
from grader.wording import has_role_of, is_role, on_lines

PYTHON = "catkin_install_python"
CPP_SUFFIXES = (".c", ".cc", ".cpp", ".cxx")
BUILD_FIRST_HINT = "first get the build to pass: catkin_make"
RIGHT_SHEBANG = "#!/usr/bin/env python3"
NODE_FOLDERS = ("scripts", "src", "nodes", "bin")
_KINDS = ("PROGRAMS", "FILES", "TARGETS", "DIRECTORY", "SCRIPT", "SCRIPTS", "CODE")
_OPTIONS = (
    *("DESTINATION", "TYPE", "OPTIONAL", "PERMISSIONS", "CONFIGURATIONS", "COMPONENT", "RENAME"),
    *("EXCLUDE_FROM_ALL", "ARCHIVE", "LIBRARY", "RUNTIME"),
)
_HERE = tuple(
    f"${{{name}}}"
    for name in (
        "CMAKE_CURRENT_SOURCE_DIR",
        "PROJECT_SOURCE_DIR",
        "CMAKE_SOURCE_DIR",
        "CMAKE_CURRENT_LIST_DIR",
    )
)
LINE_CHARS_MAX = 200
"""Of a line of CMake, to see which call begins in it."""
BACKUPS = ("~", ".bak", ".orig", ".save", *(f".save.{number}" for number in range(1, 10)), ".swp")
_BIN = ("${CATKIN_PACKAGE_BIN_DESTINATION}", "lib/${PROJECT_NAME}")


class Installed(NamedTuple):
    """One file that a call names. `kind` is the signature (`PROGRAMS`), "" where the call gives none.

    `destination` is None where the call has no such word, and "" where nothing stands behind it.
    """

    call: CMakeCall
    kind: str
    path: str
    destination: str | None

    @property
    def known(self) -> bool:
        """False where CMake was not asked and the name is a variable that only it knows."""
        return "${" not in self.path


def find_script(package: PackageFacts, path: str) -> SourceFile | None:
    """Return the file at this path, or one of the same name in another folder (those for nodes first)."""

    def rank(file: SourceFile) -> tuple[bool, bool, bool, str]:
        folder = file.path.partition("/")[0]
        return file.path != path, folder not in NODE_FOLDERS, file.executable is False, file.path

    return min(copies_of(package, path), key=rank, default=None)


def copies_of(package: PackageFacts, path: str) -> list[SourceFile]:
    """Return all files of this name in the package, whatever their folder; what a build made is none of them."""
    name = PurePosixPath(path).name
    return [f for f in package.files if f.path.rpartition("/")[2] == name and not is_product(f.path)]


def is_product(path: str) -> bool:
    """Return whether a build made it: nothing of what was handed in counts there."""
    return path.partition("/")[0] in {"build", "devel", "install"}


def path_in_package(package: PackageFacts, file: str) -> str | None:
    """Return the longest of the package's paths with which a path ends; None where there is none, or where it lies in
    another of the lab's packages. What stands behind the package's own name counts first: a folder may have it too."""
    if any(f"/{other.name}/" in file for other in package.also):
        return None
    behind = f"/{file}".partition(f"/{package.name}/")[2]
    if behind and any(f.path == behind for f in package.files):
        return behind
    return max((f.path for f in package.files if f"/{file}".endswith(f"/{f.path}")), key=len, default=None)


def paths_by_name(package: PackageFacts) -> dict[str, str]:
    """Return the paths of all files that are no product of a build and no editor's backup, by their names."""
    paths = (f.path for f in package.files if not is_product(f.path) and not f.path.endswith(BACKUPS))
    return {PurePosixPath(path).name: path for path in paths}


def scripts_of_role(package: PackageFacts, path: str) -> list[str]:
    """Return the scripts whose names have another word for what the name of `path` says that it is; of several, the
    only one that is called by the word alone."""
    alike = [p for n, p in paths_by_name(package).items() if n.endswith(".py") and has_role_of(p, path)]
    plain = [p for p in alike if is_role(PurePosixPath(p).stem)]
    return plain if len(plain) == 1 else alike


def can_be_moved(path: str, wanted: str) -> bool:
    """Return whether one file can be what another was meant to be: of the same kind, or without a suffix."""
    one, other = PurePosixPath(path).suffix, PurePosixPath(wanted).suffix
    return (
        {one, other} <= {".yaml", ".yml"}
        or one == other
        or not one
        or not other
        or (other == ".launch" and (one.startswith(other) or one == ".xml"))
        or PurePosixPath(path).name == f"{PurePosixPath(wanted).name}.txt"
    )


def old_encoding(package: PackageFacts, error: str, files: Collection[str]) -> tuple[str, str] | None:
    """Return why one of these files, a script that names its old encoding, is not read, and what to do: Python would
    read it, but not the program that the build makes of it."""
    names = {PurePosixPath(file).name for file in files}
    own = (f for f in package.files if f.python and PurePosixPath(f.path).name in names)
    file = next((f for f in own if f.encoding not in {"utf-8", "utf-8-sig"}), None)
    if file is None or error != "UnicodeDecodeError":
        return None
    why = f"{file.path} is saved as {file.encoding}, and what catkin_install_python makes of it is read as UTF-8"
    return why, f"save {file.path} as UTF-8 in your editor, and write utf-8 for {file.encoding} at its top"


def add_hint(package: PackageFacts, path: str) -> str:
    """Return the hint that a file has to be written; of what was handed in with git, that it has to be pushed too, and
    whether git leaves it out."""
    if hiding := hiding_line(package.git_ignores, path):
        return f"{_keeps_out(hiding, path)}: git add -f {path}, then commit and push it"
    then = ", then git add, commit and push it" if handed_in_with_git(package) else ""
    return f"write {path}{then}"


def add_folder_hint(package: PackageFacts, folder: str, paths: Iterable[str]) -> str:
    """Return the hint that a folder has to be made, and whether git leaves it out, or each of the files of it that the
    lab asks for."""
    lines = [hiding_line(package.git_ignores, path) for path in (*paths,) or (f"{folder}/file",)]
    if lines and lines[0] is not None and None not in lines:
        put = f"put the files that belong there into it, git add -f {folder}, then commit and push it"
        return f"{_keeps_out(lines[0], f'{folder}/')}: {put}"
    make = "mkdir -p" if "/" in folder else "mkdir"
    return f"{make} {folder} in the package folder, and put the files that belong there into it"


def _keeps_out(hiding: IgnoreLine, path: str) -> str:
    return f"line {hiding.line} of {hiding.file}, `{hiding.pattern}`, keeps {path} out of git"


def move_hint(package: PackageFacts, path: str, wanted: str) -> str:
    """Return the command that moves a file, with the one before it that makes a folder that is not there."""
    folder = PurePosixPath(wanted).parent.as_posix()
    there = folder == "." or any(file.path.startswith(f"{folder}/") for file in package.files)
    return f"{'' if there else f'mkdir -p {folder} && '}git mv {path} {wanted}"


def without_git(hint: str, package: PackageFacts | None) -> str:
    """Return the hint with commands that work where the package is in no git repository."""
    if package is None or "git mv " not in hint or handed_in_with_git(package):
        return hint
    return hint.replace("git mv ", "mv ")


def handed_in_with_git(package: PackageFacts) -> bool:
    """Return whether git says what is in the package."""
    return any(file.mode_source == "git" for file in package.files)


def cmake_calls(package: PackageFacts, *names: str) -> tuple[CMakeCall, ...]:
    """Return the calls of these commands, in order."""
    return tuple(c for c in package.cmake.calls if c.name in names) if package.cmake else ()


def where_written(package: PackageFacts, text: str, call: CMakeCall) -> CMakeCall:
    """Return the `set(…)`, `list(…)` or `foreach(…)` above a call that has a word of its: a variable brings it there;
    else the call."""
    above = [
        c
        for c in cmake_calls(package, "set", "list", "foreach")
        if c.file == call.file and c.line < call.line
    ]
    return next((c for c in above if text in c.args[1:]), call)


def loop_variable(package: PackageFacts, call: CMakeCall) -> str:
    """Return `${node}` where `foreach(node …)` makes several targets by one call; "" where it is in no loop."""
    made = {c.args[0] for c in cmake_calls(package, call.name) if c.args and c.place == call.place}
    above = [c for c in cmake_calls(package, "foreach") if c.file == call.file and c.line <= call.line]
    return f"${{{above[-1].args[0]}}}" if len(made) > 1 and above and above[-1].args else ""


def programs(package: PackageFacts) -> tuple[Executable, ...]:
    """Return the programs that CMake makes, in the order of their calls."""
    return package.cmake.executables if package.cmake else ()


LIBRARIES_DEEP = 3


def sources_made(package: PackageFacts, call: CMakeCall) -> set[str]:
    """Return what an `add_executable(…)` is made of, with the sources of the package's libraries that it is linked
    with."""
    linked = [one.args for one in cmake_calls(package, "target_link_libraries") if one.args]
    libraries = {one.args[0]: one for one in cmake_calls(package, "add_library") if one.args}
    targets, sources = set(call.args[:1]), set(call.args[1:])
    for _ in range(LIBRARIES_DEEP):
        targets |= {name for args in linked if args[0] in targets for name in args[1:] if name in libraries}
    return sources.union(*(libraries[name].args[1:] for name in targets & libraries.keys()))


def own_header(package: PackageFacts, header: str) -> str:
    """Return how to have a header of the package's own found; "" where there is none of that name."""
    path = next((f.path for f in package.files if f"/{f.path}".endswith(f"/{header}")), "")
    folder = path.removesuffix(header).rstrip("/")
    if not folder or folder == "src":
        return ""
    given = next(iter(cmake_calls(package, "include_directories")), None)
    if given is None:
        return f"write include_directories({folder} ${{catkin_INCLUDE_DIRS}}) above add_executable(…) in CMakeLists.txt"
    return f"add {folder} to the include_directories(…) on line {given.line} of {given.file}"


def part_not_linked(package: PackageFacts) -> str:
    """Return how to link what of the package's own C++ is in no program: a library, or a source; "" where it is not
    plain which."""
    made = [call for call in cmake_calls(package, "add_executable") if call.args]
    libraries = [call for call in cmake_calls(package, "add_library") if call.args]
    linked = [call for call in cmake_calls(package, "target_link_libraries") if call.args]
    listed = {posixpath.basename(word) for call in made + libraries for word in call.args}
    paths = [PurePosixPath(file.path) for file in package.files]
    spare = [path for path in paths if path.suffix in CPP_SUFFIXES and path.name not in listed]
    if len(spare) == 1 and len(libraries or made) == 1:
        call = (libraries or made)[0]
        return f"add {spare[0]} to the {call.name}(…) on line {call.line} of {call.file}"
    for program in made:
        own = [call for call in linked if call.args[0] == program.args[0]]
        lacks = [lib.args[0] for lib in libraries if not any(lib.args[0] in call.args for call in linked)]
        if len(lacks) == 1 and len(own) == 1:
            return f"add {lacks[0]} to the target_link_libraries(…) on line {own[0].line} of {own[0].file}"
    return ""


def slips_of_program(argv: Sequence[str], package: PackageFacts, kind: SlipKind) -> list[PythonSlip]:
    """Return the slips of this kind in the sources of the program of this command line."""
    program = posixpath.basename(argv[0]) if argv else ""
    calls = [call for call in cmake_calls(package, "add_executable") if call.args[:1] == (program,)]
    sources = {file for call in calls for file in sources_made(package, call)}
    return [slip for slip in package.slips if slip.kind == kind and slip.file in sources]


def argument_not_given(
    ended: str, argv: Sequence[str], package: PackageFacts
) -> tuple[str, str, tuple[FileCitation, ...]] | None:
    """Return the cause, the hint and the place where the program of this command line reads an argument that it does
    not get. Remappings are ROS's."""
    words = [one for one in argv if ":=" not in one]
    for slip in slips_of_program(words, package, "no-argument"):
        if int(slip.name) >= len(words):
            return f"{ended}: {slip.message}, and gets none", slip.fix, (slip.place,)
    return None


def input_not_given(
    argv: Sequence[str], package: PackageFacts
) -> tuple[str, str, tuple[FileCitation, ...]] | None:
    """Return the cause, the hint and the place where the program of this command line reads what is typed, and has come
    to its end."""
    for slip in slips_of_program(argv, package, "input"):
        loop = "; a node has to stay alive: do that in a loop `while (ros::ok())`"
        return f"its program ran to the end: {slip.message}", f"{slip.fix}{loop}", (slip.place,)
    return None


def is_elsewhere(program: Executable, package: PackageFacts) -> bool:
    """Return whether it surely goes to a folder in which `rosrun` does not look."""
    folder = program.folder
    return bool(folder) and "$" not in folder and not is_found(folder, package)


def installed(package: PackageFacts) -> Iterator[Installed]:
    """Yield every file that `install` or `catkin_install_python` names, in the order of the calls."""
    for call in cmake_calls(package, PYTHON, "install"):
        yield from _named_by(call)


def names_script(one: Installed, path: str) -> bool:
    """Return whether the file named is the one at `path`, which is relative to the package."""
    text = one.path
    for here in _HERE:
        text = text.removeprefix(here + "/")
    if text.startswith("/"):
        return posixpath.normpath(text).endswith("/" + path)
    file = one.call.file
    # Paths in a file that is included count from the place that includes it, mostly the package.
    folder = posixpath.dirname(file) if file.endswith("CMakeLists.txt") else ""
    return posixpath.normpath(posixpath.join(folder, text)) == path


def asks_for_wrapper(package: PackageFacts, path: str) -> bool:
    """Return whether `catkin_install_python` is to make a program of the script where `rosrun` looks: it then needs no
    bit of its own. A path that leads to no file stands for the script of its name."""
    named = [i for i in installed(package) if i.call.name == PYTHON and i.kind == "PROGRAMS"]
    named = [i for i in named if is_found(i.destination or "", package)]
    lost = (i for i in named if posixpath.basename(i.path) == posixpath.basename(path))
    lost = (i for i in lost if not any(names_script(i, file.path) for file in package.files))
    return any(names_script(i, path) for i in named) or any(lost)


def is_bin(destination: str, package: PackageFacts) -> bool:
    """Return whether it is `${CATKIN_PACKAGE_BIN_DESTINATION}`, which CMake gives as `lib/<project>`."""
    place = "/" + posixpath.normpath(destination)
    return destination in _BIN or any(place.endswith(f"/lib/{name}") for name in _names(package))


def is_found(destination: str, package: PackageFacts) -> bool:
    """Return whether `rosrun` looks for programs there: it does so in all of `lib/<package>` and `share/<package>`."""
    place = f"/{posixpath.normpath(destination)}/"
    below = any(f"/{kind}/{name}/" in place for kind in ("lib", "share") for name in _names(package))
    return below or is_bin(destination, package)


def _names(package: PackageFacts) -> set[str]:
    """Return the names of the package by its manifest, its folder and its CMake project."""
    projects = {call.args[0] for call in cmake_calls(package, "project") if call.args}
    return {package.name, *projects} | ({package.manifest.name} if package.manifest else set())


def _named_by(call: CMakeCall) -> Iterator[Installed]:
    kind, words = "", list(call.args)
    if words and words[0].upper() in _KINDS:
        kind = words.pop(0).upper()
    destination: str | None = None
    if "DESTINATION" in words:
        at = words.index("DESTINATION")
        given = [w for w in words[at + 1 : at + 2] if w not in _OPTIONS]
        destination = "".join(given)
        del words[at : at + 1 + len(given)]
    last = next((i for i, word in enumerate(words) if word in _OPTIONS), len(words))
    for path in words[:last]:
        yield Installed(call, kind, path, destination)


class Obstacle(NamedTuple):
    """Why `rosrun` cannot run the file, and the command that fixes it."""

    why: str
    fix: str


def shebang_obstacles(file: SourceFile) -> Iterator[Obstacle]:
    """Yield what keeps the system from starting the file, the package facts' own words first."""
    fix = f"write {RIGHT_SHEBANG} as the very first line, with nothing above it"
    if file.link_problem:
        yield Obstacle(f"cannot be run: {file.link_problem}", "hand in the file itself")
    elif file.shebang is not None and file.shebang.crlf:
        problem = file.shebang_problem or "its #! line has a Windows line ending (CRLF)"
        push = ", then commit and push" if file.mode_source == "git" else ""
        yield Obstacle(f"cannot be run: {problem}", f"dos2unix {file.path}{push}")
    elif file.shebang_fault == "empty-file":
        yield Obstacle("is empty", f"write the node in {file.path}, with {RIGHT_SHEBANG} as its first line")
    elif file.bom:
        wide = file.encoding == "utf-16"
        mark = "it is saved as UTF-16" if wide else "an invisible byte order mark (BOM) comes first"
        why = file.shebang_problem or mark
        fix = f"in the editor, save {file.path} as UTF-8 without BOM"
        first = "" if file.shebang_fault == "byte-order-mark" else f", with {RIGHT_SHEBANG} as its first line"
        yield Obstacle(f"cannot be run: {why}", f"{fix}{first}")
    elif file.shebang_problem:
        yield Obstacle(f"cannot be run: {file.shebang_problem}", fix)
    elif file.shebang is None:
        yield Obstacle("does not begin with a #! line", fix)
    elif file.shebang.found is False:
        yield Obstacle(f"names {file.shebang.interpreter}, which is not on a ROS machine", fix)
    elif file.names_other_language:
        yield Obstacle(f"is Python, and its first line names {file.shebang.interpreter}", fix)


class SourceLine(NamedTuple):
    """A line of a script or of C++, with its file and its number from 1."""

    file: str
    number: int
    text: str


_LITERAL = re.compile(r"""(["'])([^"'\\]+)\1""")
_FILLED_IN = re.compile(r"%[-+ 0-9.]*[a-z]|\{[^{}]*\}")
_WORD = re.compile(r"\w+")


def lines_that_say(lines: Sequence[SourceLine], said: str) -> list[SourceLine]:
    """Return the lines whose strings are most of what was said; of a string, all words have to be in it."""
    spoken = {one for word in _WORD.findall(said) for one in (word, word.rstrip("0123456789"))}  # `text7`

    def alike(line: SourceLine) -> int:
        strings = [_WORD.findall(_FILLED_IN.sub(" ", found[2])) for found in _LITERAL.finditer(line.text)]
        return sum(sum(map(len, words)) for words in strings if spoken.issuperset(words))

    most = max(map(alike, lines), default=0)
    return [line for line in lines if alike(line) == most > 0]


def lines_that_publish(lines: Sequence[SourceLine], topic: str) -> list[SourceLine]:
    """Return the lines that publish on the topic, by the variable that its publisher is given to; all that publish
    where there is no such line."""
    own = _names_given(lines, r"Publisher|advertise", topic)
    publishing = [(line, found[1]) for line in lines if (found := _PUBLISHES.search(line.text))]
    return [line for line, name in publishing if name in own] or [line for line, _ in publishing]


_PUBLISHES = re.compile(r"(\w*)(?:\.|->)publish\s*\(")


def lines_that_call(lines: Sequence[SourceLine], service: str) -> list[SourceLine]:
    """Return the lines that call the service, or send the action a goal, by the client's variable."""
    own = _names_given(lines, r"ServiceProxy|serviceClient|SimpleActionClient", service)
    if not own:
        return []
    # `def` in front of the name defines a function, and calls nothing.
    calls = re.compile(rf"(?<!def )\b(?:{'|'.join(own)})(?:(?:\.|->)(?:call|send_?[gG]oal)\w*)?\s*\(")
    return [line for line in lines if calls.search(line.text)]


def _names_given(lines: Sequence[SourceLine], makers: str, name: str) -> set[str]:
    """Return the variables that are given what one of the makers makes for this topic or service."""
    quoted = re.escape(name.lstrip("/"))
    made = re.compile(rf"""(\w+)\s*=[^=].*\b(?:{makers})\b.*["']/?{quoted}["']""")
    return {found[1] for line in lines if (found := made.search(line.text))}


def lines_that_answer(lines: Sequence[SourceLine], service: str) -> list[SourceLine]:
    """Return the lines with which the service's callback, a function of Python in the same file, returns."""
    quoted = re.escape(service.lstrip("/"))
    offers = re.compile(
        rf"""\bService\(\s*["']/?{quoted}["']\s*,\s*[\w.]+\s*,\s*(?:handler\s*=\s*)?(?:self\.)?(\w+)"""
    )
    names = {(line.file, found[1]) for line in lines if (found := offers.search(line.text))}
    return [
        line
        for file, name in names
        for line in _body_of(name, [one for one in lines if one.file == file])
        if re.match(r"\s*return\b", line.text)
    ]


def _body_of(name: str, lines: Sequence[SourceLine]) -> Iterator[SourceLine]:
    """Yield the lines of a function of Python below its first one."""
    indent: int | None = None
    for line in lines:
        depth = len(line.text) - len(line.text.lstrip())
        if indent is not None and line.text.strip() and depth <= indent:
            return
        if indent is not None:
            yield line
        elif re.match(rf"\s*def {name}\(", line.text):
            indent = depth


def lines_that_transform(lines: Sequence[SourceLine]) -> list[SourceLine]:
    """Return the lines that send a transform."""
    return [line for line in lines if re.search(r"(?:\.|->)sendTransform\s*\(", line.text)]


def lines_that_set(lines: Sequence[SourceLine], field: str) -> list[SourceLine]:
    """Return the lines that give a field of a message its value: `linear.x` of `msg.linear.x = 1`."""
    # Blanks may stand around the dots, and `==` compares.
    path = re.escape(re.sub(r"\[[^]]*\]", "", field)).replace(r"\.", r"\s*\.\s*")
    sets = re.compile(rf"[.>]\s*{path}\s*(?:\[[^]]*\]\s*)?[-+*/]?=(?!=)|[(,]\s*{path}\s*=(?!=)")
    return [line for line in lines if sets.search(line.text)]


def lines_making(lines: Sequence[str], slip: PythonSlip, publishers: Iterable[PythonSlip]) -> list[int]:
    """Return the lines, but for the slip's own, that make a message of its type, and none for another publisher than
    the one on the slip's line."""
    owner = next((one.name for one in publishers if (one.file, one.line) == (slip.file, slip.line)), "")
    texts = [line[:LINE_CHARS_MAX].partition("#")[0] for line in lines]
    sends = [
        found.groups() for text in texts for found in re.finditer(r"([\w.]+)\.publish\( *([\w.]+)", text)
    ]
    making = re.compile(rf"(?:([\w.]+) *= *|([\w.]+)\.publish\( *)?(?<![\w.]){re.escape(slip.message)}\(")
    numbers = []
    for number, text in enumerate(texts, 1):
        if number != slip.line and (found := making.search(text)):
            by = {found[2]} if found[2] else {one for one, sent in sends if sent == found[1]}
            if not by or not owner or owner in by:
                numbers.append(number)
    return numbers


def line_that_makes(lines: Sequence[SourceLine], setting: SourceLine) -> SourceLine | None:
    """Return the only line that gives a variable its value, where `setting` does no more than hand that variable on:
    `speed = 2` of `msg.linear.x = speed`, and of `pub.publish(speed)`. If it is sorted or turned round after that, and
    nothing else is done to it, that line gives it its value."""
    handed = _HANDED.search(setting.text)
    if handed is None:
        return None
    name = rf"(?<![\w.]){re.escape(handed[1])}\b"
    # Whatever else may change it is reason enough to name no line.
    bound = re.compile(
        rf"\b(?:def|for|global|nonlocal|lambda|with|import)\b.*{name}|{name}[^=()]*=(?!=)|{name}\s*(?:\.|\[|\+\+|--)"
        rf"|(?<!<)(?<!< ){name}\s*<<|\b{_IN_PLACE}\(.*{name}"
    )
    found = [one for one in lines if one.file == setting.file and one != setting and bound.search(one.text)]
    makes = re.compile(rf"\s*(?:[\w:<>]+\s+)*{name}\s*(?:=(?!=)|<<)")
    if not found or not makes.match(found[0].text):
        return None
    call = rf"(?:[\w.]+(?:\.|::))?{_IN_PLACE}\(\s*{name}|{name}\.{_IN_PLACE}\("
    changed = rf"\s*(?:{call})[^;=]*\);?\s*(?:(?:#|//).*)?$"
    between = [one for one in found[1:] if one.number < setting.number and re.match(changed, one.text)]
    return found[-1] if len(found) == 1 + len(between) and len(between) <= 1 else None


_IN_PLACE = r"(?:(?:stable_)?sort|reverse|(?:random_)?shuffle)"


_HANDED = re.compile(
    r"(?:[^=!<>]=\s*|(?:\.|->)publish\(\s*(?:[\w.]+\(\s*)?(?:data\s*=\s*)?)((?:self\.)?[A-Za-z_]\w*)(?:\.str\(\))?"
    r"[\s)]*;?\s*(?:(?:#|//).*)?$"
)
"""What a line publishes: a variable, an attribute, or the text that was written to a stream in C++."""


OF_FILES = {"add_message_files": ".msg", "add_service_files": ".srv", "add_action_files": ".action"}
OF_INTERFACES = (*OF_FILES, "generate_messages")
"""The commands of CMake by which messages, services and actions are made."""


def commented_calls(
    package: PackageFacts, lines: Sequence[str], names: Iterable[str]
) -> dict[str, tuple[int, int]]:
    """Return of these commands those that are not called and are commented out. Those of files name one that the
    package has, and not only `Message1.msg` as the template does."""
    own = [PurePosixPath(one.path).name for one in package.interfaces]
    places = {n: place for n in names if not cmake_calls(package, n) and (place := commented_call(lines, n))}
    return {
        name: (first, last)
        for name, (first, last) in places.items()
        if name not in OF_FILES or any(one in line for one in own for line in lines[first : last + 1])
    }


def commented_call(lines: Sequence[str], name: str) -> tuple[int, int] | None:
    """Return the first and the last line (from 0) of a call that is commented out; `name(…)` in a sentence is none."""
    # `find_package(Boost …)` is an example in catkin's template, as is what ends in `...)`.
    arguments = r"\s*catkin\b" if name == "find_package" else r"(?!.*\.\.\.\s*\))"
    pattern = re.compile(rf"\s*#[#\s]*{name}\s*\({arguments}")
    first = next((i for i, text in enumerate(lines) if pattern.match(text[:LINE_CHARS_MAX])), None)
    if first is None:
        return None
    last = first
    while ")" not in lines[last] and last + 1 < len(lines) and lines[last + 1].lstrip().startswith("#"):
        last += 1
    return first, last


SYNTAX = ("SyntaxError", "IndentationError", "TabError")
UNPARSED = (*SYNTAX, "ValueError")
"""What Python says of a file that it cannot parse; other faults are of the reading."""


def syntax_fault(file: SourceFile) -> Fault | None:
    """Return why Python cannot parse the script; None for one that an old Python, which is there, is to run."""
    old = file.shebang is not None and file.shebang.found and file.shebang.interpreter.startswith("python2")
    fault = file.python_fault
    return fault if fault is not None and fault.kind in UNPARSED and not old else None


MAKES_NODES = {
    "init_node": "node-name",
    "Publisher": "publisher",
    "Subscriber": "subscriber",
    "publish": "publishes",
    "spin": "",
}
"""Calls, and the kind of slip that there is where the script has one of them that is not in a comment."""


def in_comments(slips: Sequence[PythonSlip]) -> dict[str, str]:
    """Return the message and the fix of several calls that make a script a node and are only there in comments."""
    kinds = {one.kind for one in slips}
    gone = (s for s in slips if s.kind == "commented-out" and "`#`" in s.fix)
    lines = sorted({s.line for s in gone if MAKES_NODES.get(s.name.rpartition(" ")[2], s.kind) not in kinds})
    where = on_lines(lines)
    told = {"message": f"{where} are commented out", "fix": f"remove the `#` from {where}"}
    return told if len(lines) > 1 else {}


def real_copy(script: SourceFile, package: PackageFacts) -> str:
    """Return the only other file of a script's name, where that one makes a node and the script none; else ""."""
    nodes = {s.file for s in package.slips if s.kind == "node-name"}
    others = [one.path for one in copies_of(package, script.path) if one.path != script.path]
    return others[0] if script.path not in nodes and len(others) == 1 and others[0] in nodes else ""
