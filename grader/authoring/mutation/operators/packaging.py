"""Mistakes in package.xml and CMakeLists.txt."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator

from cmake_parser.ast import Command, Token

from grader.authoring.mutation.package_tree import Tree
from grader.authoring.mutation.registry import Finder, operator
from grader.authoring.mutation.solution import CMAKE, MANIFEST, CodePlace, Solution
from grader.authoring.mutation.source_edits import Document, Edit, Element, whole_lines

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


def _installed(solution: Solution) -> Iterator[tuple[CodePlace, str, Command, list[Token], Token]]:
    """Find the scripts that catkin_install_python() names: each with its call and the call's scripts."""
    for command in solution.cmake_calls("catkin_install_python"):
        scripts = [a for a in command.args if a.value.endswith(".py")]
        for script in scripts:
            place = CodePlace(path=CMAKE, at={"script": script.value}, line=command.line)
            yield place, solution.text(CMAKE), command, scripts, script


find_catkin = _calls("find_package", wanted=lambda c: bool(c.args) and c.args[0].value == "catkin")
install_calls = _calls("catkin_install_python")


def _comment_out(text: str, command: Command) -> list[Edit]:
    start, end = whole_lines(text, command.span.start, command.span.stop)
    lines = text[start:end].removesuffix("\n").split("\n")
    return [Edit(start, end, "".join(f"# {line}\n" for line in lines))]


@operator("project-renamed", each=lambda s: ((p, s.name, c) for p, _, c in _calls("project")(s) if c.args))
def project_renamed(package: str, command: Command) -> list[Edit]:
    """Gives project() another name than package.xml.

    Fits every CMakeLists.txt with project().
    """
    span = command.args[0].span
    return [Edit(span.start, span.stop, f"my_{package}")]


@operator("no-find-package", each=find_catkin)
def no_find_package(text: str, command: Command) -> list[Edit]:
    """Leaves find_package(catkin …) commented out.

    Fits every CMakeLists.txt with find_package(catkin …).
    """
    return _comment_out(text, command)


@operator("no-catkin-package", each=_calls("catkin_package"))
def no_catkin_package(text: str, command: Command) -> list[Edit]:
    """Does not call catkin_package().

    Fits every CMakeLists.txt with catkin_package().
    """
    return [Edit(*whole_lines(text, command.span.start, command.span.stop), "")]


@operator("unknown-component", each=find_catkin)
def unknown_component(_text: str, command: Command) -> list[Edit]:
    """Asks catkin for a package that is not installed.

    Fits every CMakeLists.txt with find_package(catkin …).
    """
    has = any(argument.value == "COMPONENTS" for argument in command.args)
    end = command.span.stop - 1
    return [Edit(end, end, " our_course_msgs" if has else " COMPONENTS our_course_msgs")]


@operator("cmake-malformed", each=_last_command)
def cmake_malformed(command: Command) -> list[Edit]:
    """Leaves a bracket open in CMakeLists.txt.

    Fits every CMakeLists.txt with a command.
    """
    return [Edit(command.span.stop - 1, command.span.stop, "")]


@operator("source-missing", each=_last_command)
def source_missing(command: Command) -> list[Edit]:
    """Builds a C++ program whose source is not in the package.

    Fits every CMakeLists.txt with a command.
    """
    end = command.span.stop
    return [Edit(end, end, "\n\nadd_executable(my_node src/my_node.cpp)")]


@operator("install-dropped", each=_installed)
def install_dropped(text: str, command: Command, scripts: list[Token], script: Token) -> list[Edit]:
    """Does not name a script in catkin_install_python().

    Fits every script that catkin_install_python() names.
    """
    span = script.span if len(scripts) > 1 else command.span
    return [Edit(*whole_lines(text, span.start, span.stop), "")]


@operator("install-commented", each=install_calls)
def install_commented(text: str, command: Command) -> list[Edit]:
    """Leaves catkin_install_python() commented out.

    Fits every call of catkin_install_python().
    """
    return _comment_out(text, command)


@operator("install-elsewhere", each=install_calls)
def install_elsewhere(_text: str, command: Command) -> list[Edit]:
    """Installs the scripts where rosrun does not look.

    Fits every call of catkin_install_python() into the package's programs.
    """
    spans = [argument.span for argument in command.args if argument.value == BIN]
    return [Edit(span.start, span.stop, "${CATKIN_PACKAGE_SHARE_DESTINATION}") for span in spans]


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


@operator("dependency-dropped", each=_dependencies)
def dependency_dropped(manifest: Document, elements: list[Element]) -> list[Edit]:
    """Does not declare a package that the nodes need.

    Fits every dependency of package.xml but catkin.
    """
    return [manifest.remove(element) for element in elements]


@operator("manifest-renamed", each=_elements("name"))
def manifest_renamed(manifest: Document, element: Element) -> list[Edit]:
    """Gives package.xml another name than the rest of the package.

    Fits every package.xml with a name.
    """
    return [manifest.set_content(element, f"{manifest.content(element)}_pkg")]


@operator("package-renamed", each=_package)
def package_renamed(solution: Solution) -> Tree:
    """Gives the package another name, in all of its files alike.

    Fits every package.
    """
    word = re.compile(rf"(?<![\w/.-]){re.escape(solution.name)}(?![\w.-])".encode())
    for path in {MANIFEST, CMAKE, *(d.path for d in solution.launch_files)} & set(solution.files):
        data = word.sub(f"my_{solution.name}".encode(), solution.entry(path).data)
        solution = solution.then(solution.with_data(path, data))
    return solution.tree


@operator("manifest-malformed", each=_elements("description"))
def manifest_malformed(manifest: Document, element: Element) -> list[Edit]:
    """Forgets to close a tag in package.xml.

    Fits every package.xml with a description.
    """
    close = manifest.data.rfind(b"</", element.inner, element.end)
    return [Edit(close, element.end, "")] if close >= 0 else []


@operator("buildtool-dropped", each=_elements("buildtool_depend"))
def buildtool_dropped(manifest: Document, element: Element) -> list[Edit]:
    """Does not name catkin as the build tool.

    Fits every package.xml with a buildtool_depend.
    """
    return [manifest.remove(element)]


@operator("email-left", each=_elements("maintainer"))
def email_left(manifest: Document, element: Element) -> list[Edit]:
    """Leaves the maintainer's e-mail address as catkin_create_pkg wrote it.

    Fits every maintainer with an address.
    """
    known = "email" in element.attributes
    return [manifest.set_attribute(element, "email", "user@todo.todo")] if known else []
