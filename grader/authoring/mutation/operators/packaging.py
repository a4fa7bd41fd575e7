"""Mistakes in package.xml and CMakeLists.txt, and files that are missing, misplaced or of the wrong mode."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import PurePosixPath

from cmake_parser.ast import Command, Token

from grader.authoring.mutation.registry import Finder, operator
from grader.authoring.mutation.solution import CodePlace, Solution, Tree
from grader.authoring.mutation.source_edits import Document, Element, TextEdit, whole_lines
from grader.model.package import CMAKE, MANIFEST

BIN = "${CATKIN_PACKAGE_BIN_DESTINATION}"
DEPENDENCIES = ("depend", "build_depend", "build_export_depend", "exec_depend", "run_depend")

# ---- CMakeLists.txt


def _calls(*names: str, wanted: Callable[[Command], bool] = lambda _: True) -> Finder:
    """Return a finder of the calls of these commands."""

    def find(solution: Solution) -> Iterator[tuple[CodePlace, str, Command]]:
        for command in solution.cmake_calls(*names):
            if wanted(command):
                yield CodePlace(path=CMAKE, at={}, line=command.line), solution.text(CMAKE), command

    return find


def _last_command(solution: Solution) -> Iterator[tuple[CodePlace, Command]]:
    return ((CodePlace(path=CMAKE, at={}, line=command.line), command) for command in solution.cmake[-1:])


def _find_installed(solution: Solution) -> Iterator[tuple[CodePlace, str, Command, list[Token], Token]]:
    """Find the scripts that catkin_install_python() names: each with its call and the call's scripts."""
    for command in solution.cmake_calls("catkin_install_python"):
        scripts = [a for a in command.args if a.value.endswith(".py")]
        for script in scripts:
            place = CodePlace(path=CMAKE, at={"script": script.value}, line=command.line)
            yield place, solution.text(CMAKE), command, scripts, script


find_catkin = _calls("find_package", wanted=lambda c: bool(c.args) and c.args[0].value == "catkin")
install_calls = _calls("catkin_install_python")


def _comment_out(text: str, command: Command) -> list[TextEdit]:
    start, end = whole_lines(text, command.span.start, command.span.stop)
    lines = text[start:end].removesuffix("\n").split("\n")
    return [TextEdit(start, end, "".join(f"# {line}\n" for line in lines))]


@operator(
    each=lambda s: ((p, s.name, c) for p, _, c in _calls("project")(s) if c.args),
    fits="every CMakeLists.txt with project()",
)
def project_renamed(package: str, command: Command) -> list[TextEdit]:
    """Gives project() another name than package.xml."""
    span = command.args[0].span
    return [TextEdit(span.start, span.stop, f"my_{package}")]


@operator(each=find_catkin, fits="every CMakeLists.txt with find_package(catkin …)")
def no_find_package(text: str, command: Command) -> list[TextEdit]:
    """Leaves find_package(catkin …) commented out."""
    return _comment_out(text, command)


@operator(each=_calls("catkin_package"), fits="every CMakeLists.txt with catkin_package()")
def no_catkin_package(text: str, command: Command) -> list[TextEdit]:
    """Does not call catkin_package()."""
    return [TextEdit(*whole_lines(text, command.span.start, command.span.stop), "")]


@operator(each=find_catkin, fits="every CMakeLists.txt with find_package(catkin …)")
def unknown_component(_text: str, command: Command) -> list[TextEdit]:
    """Asks catkin for dep1, as the help of catkin_create_pkg does."""
    has = any(argument.value == "COMPONENTS" for argument in command.args)
    end = command.span.stop - 1
    return [TextEdit(end, end, " dep1" if has else " COMPONENTS dep1")]


@operator(each=_last_command, fits="every CMakeLists.txt with a command")
def cmake_malformed(command: Command) -> list[TextEdit]:
    """Leaves a bracket open in CMakeLists.txt."""
    return [TextEdit(command.span.stop - 1, command.span.stop, "")]


@operator(each=_last_command, fits="every CMakeLists.txt with a command")
def source_missing(command: Command) -> list[TextEdit]:
    """Builds a C++ program whose source is not in the package."""
    end = command.span.stop
    return [TextEdit(end, end, "\n\nadd_executable(my_node src/my_node.cpp)")]


@operator(each=_find_installed, fits="every script that catkin_install_python() names")
def install_dropped(text: str, command: Command, scripts: list[Token], script: Token) -> list[TextEdit]:
    """Does not name a script in catkin_install_python()."""
    span = script.span if len(scripts) > 1 else command.span
    return [TextEdit(*whole_lines(text, span.start, span.stop), "")]


@operator(each=install_calls, fits="every call of catkin_install_python()")
def install_commented(text: str, command: Command) -> list[TextEdit]:
    """Leaves catkin_install_python() commented out."""
    return _comment_out(text, command)


@operator(each=install_calls, fits="every call of catkin_install_python() into the package's programs")
def install_elsewhere(_text: str, command: Command) -> list[TextEdit]:
    """Installs the scripts where rosrun does not look."""
    spans = [argument.span for argument in command.args if argument.value == BIN]
    return [TextEdit(span.start, span.stop, "${CATKIN_PACKAGE_SHARE_DESTINATION}") for span in spans]


# ---- package.xml


def _elements(*tags: str) -> Finder:
    """Return a finder of the first element of package.xml that has one of these tags."""

    def find(solution: Solution) -> Iterator[tuple[CodePlace, Document, Element]]:
        if (manifest := solution.manifest) is not None:
            for element in manifest.elements(*tags)[:1]:
                line = manifest.line(element)
                yield CodePlace(path=MANIFEST, at={}, line=line, xml=manifest), manifest, element

    return find


def _dependencies(solution: Solution) -> Iterator[tuple[CodePlace, Document, list[Element]]]:
    """Find the packages that are depended on, each with its elements."""
    if (manifest := solution.manifest) is None:
        return
    by_name: dict[str, list[Element]] = {}
    for element in manifest.elements(*DEPENDENCIES):
        by_name.setdefault(manifest.content(element), []).append(element)
    for name in sorted(by_name.keys() - {"catkin", ""}):
        yield CodePlace(path=MANIFEST, at={"dependency": name}, xml=manifest), manifest, by_name[name]


def _package(solution: Solution) -> Iterator[tuple[CodePlace, Solution]]:
    if MANIFEST in solution.files:
        yield CodePlace(path=MANIFEST, at={}), solution


@operator(each=_dependencies, fits="every dependency of package.xml but catkin")
def dependency_dropped(manifest: Document, elements: list[Element]) -> list[TextEdit]:
    """Does not declare a package that the nodes need."""
    return [manifest.remove(element) for element in elements]


@operator(each=_elements("name"), fits="every package.xml with a name")
def manifest_renamed(manifest: Document, element: Element) -> list[TextEdit]:
    """Gives package.xml another name than the rest of the package."""
    return [manifest.set_content(element, f"{manifest.content(element)}_pkg")]


@operator(each=_package, fits="every package")
def package_renamed(solution: Solution) -> Tree:
    """Gives the package another name, in all of its files alike."""
    word = re.compile(rf"(?<![\w/.-]){re.escape(solution.name)}(?![\w.-])".encode())
    for path in {MANIFEST, CMAKE, *(d.path for d in solution.launch_files)} & set(solution.files):
        data = word.sub(f"my_{solution.name}".encode(), solution.entry(path).data)
        solution = solution.then(solution.with_data(path, data))
    return solution.tree


@operator(each=_elements("description"), fits="every package.xml with a description")
def manifest_malformed(manifest: Document, element: Element) -> list[TextEdit]:
    """Forgets to close a tag in package.xml."""
    close = manifest.data.rfind(b"</", element.inner, element.end)
    return [TextEdit(close, element.end, "")] if close >= 0 else []


@operator(each=_elements("buildtool_depend"), fits="every package.xml with a buildtool_depend")
def buildtool_dropped(manifest: Document, element: Element) -> list[TextEdit]:
    """Does not name catkin as the build tool."""
    return [manifest.remove(element)]


@operator(each=_elements("maintainer"), fits="every maintainer with an address")
def email_left(manifest: Document, element: Element) -> list[TextEdit]:
    """Leaves the maintainer's e-mail address as catkin_create_pkg wrote it."""
    known = "email" in element.attributes
    return [manifest.set_attribute(element, "email", "user@todo.todo")] if known else []


OTHER_FOLDER = {"src": "scripts", "scripts": "src"}
TELLING = (".py", ".sh", ".launch", ".yaml", ".yml")
PYTHON = re.compile(r"python(?:\d(?:\.\d+)?)?$")


def _files(solution: Solution) -> Iterator[tuple[CodePlace, Solution, str]]:
    return ((CodePlace(path=path, at={"file": path}), solution, path) for path in solution.files)


def _programs(solution: Solution) -> Iterator[tuple[CodePlace, Solution, str]]:
    return ((CodePlace(path=path, at={"script": path}), solution, path) for path in solution.programs)


def _contents(solution: Solution) -> Iterator[tuple[CodePlace, bytes]]:
    for path in solution.programs:
        yield CodePlace(path=path, at={"script": path}, line=1), solution.entry(path).data


@operator(each=_programs, fits="every executable file with a shebang")
def bit_removed(solution: Solution, path: str) -> Tree:
    """Never makes the script executable."""
    return solution.with_entry(path, replace(solution.entry(path), executable=False))


@operator(each=_files, fits="every script, launch file and YAML file")
def file_missing(solution: Solution, path: str) -> Tree | None:
    """Forgets to hand in the file."""
    return solution.without(path) if path.endswith(TELLING) or path in solution.programs else None


@operator(each=_files, fits="every script, launch file and YAML file")
def file_misnamed(solution: Solution, path: str) -> Tree | None:
    """Gives the file another name than the handout."""
    name = PurePosixPath(path)
    return solution.moved(path, str(name.with_stem(f"my_{name.stem}"))) if path.endswith(TELLING) else None


@operator(each=_programs, fits="every script under src/ or scripts/")
def script_elsewhere(solution: Solution, path: str) -> Tree | None:
    """Puts the script into another folder than the handout says."""
    first, _, rest = path.partition("/")
    return solution.moved(path, f"{OTHER_FOLDER[first]}/{rest}") if rest and first in OTHER_FOLDER else None


@operator(each=_files, fits="every launch file that lies in a folder")
def launch_elsewhere(solution: Solution, path: str) -> Tree | None:
    """Keeps the launch file beside package.xml, not in its folder."""
    inside = path.endswith(".launch") and "/" in path
    return solution.moved(path, PurePosixPath(path).name) if inside else None


@operator(each=_files, fits="a package with a CMakeLists.txt and a package.xml")
def build_file_missing(solution: Solution, path: str) -> Tree | None:
    """Forgets to hand in CMakeLists.txt."""
    return solution.without(path) if path == CMAKE and MANIFEST in solution.files else None


# ---- first lines


def _first_line(data: bytes, change: Callable[[str], str]) -> bytes:
    line, rest = data.split(b"\n", 1) if b"\n" in data else (data, b"")
    return change(line.decode(errors="replace")).encode() + b"\n" + rest


@operator(each=_contents, fits="every script whose lines end as on Linux")
def crlf(data: bytes) -> bytes:
    """Saves the script with Windows line endings, so that its shebang names no program."""
    return data if b"\r\n" in data else data.replace(b"\n", b"\r\n")


@operator(each=_contents, fits="every script")
def byte_order_mark(data: bytes) -> bytes:
    """Saves the script with a byte order mark, so that the system does not see the shebang."""
    return b"\xef\xbb\xbf" + data


@operator(each=_contents, fits="every script")
def utf_16(data: bytes) -> bytes:
    """Saves the script as UTF-16, as some editors of Windows do."""
    return data.decode("utf-8", "replace").encode("utf-16")


@operator(each=_contents, fits="every script")
def no_shebang(data: bytes) -> bytes:
    """Leaves out the shebang."""
    return data.partition(b"\n")[2]


@operator(each=_contents, fits="every script")
def shebang_typo(data: bytes) -> bytes:
    """Names a program in the shebang that does not exist."""
    return _first_line(data, lambda line: line.replace("bin/", "bni/", 1))


@operator(each=_contents, fits="every script")
def shebang_commented(data: bytes) -> bytes:
    """Puts a space into the shebang, which makes it a comment."""
    return _first_line(data, lambda line: line.replace("#!", "# !", 1))


@operator(each=_contents, fits="every Python script whose shebang ends in its interpreter")
def shebang_python2(data: bytes) -> bytes:
    """Asks for Python 2, which the machine does not have."""
    return _first_line(data, lambda line: PYTHON.sub("python2", line.rstrip()))
