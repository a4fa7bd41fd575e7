"""Mistakes in CMakeLists.txt."""

from __future__ import annotations

import re
from collections.abc import Iterator

from cmake_parser.ast import Command

from grader.authoring.mutation.registry import NoParams, operator
from grader.authoring.mutation.solution import CMAKE, MANIFEST, Site, Solution
from grader.authoring.mutation.text_edits import Edit, whole_lines
from grader.authoring.mutation.xml_document import Document, Element

BIN = "${CATKIN_PACKAGE_BIN_DESTINATION}"


def _site(solution: Solution, command: Command, edit: Edit, **at: str) -> Site:
    return Site(at=at, tree=solution.edited(CMAKE, [edit]), line=command.line)


def _find_catkin(solution: Solution) -> Iterator[Command]:
    return (c for c in solution.cmake_calls("find_package") if c.args and c.args[0].value == "catkin")


def _commented(solution: Solution, command: Command) -> Edit:
    text = solution.text(CMAKE)
    start, end = whole_lines(text, command.span.start, command.span.stop)
    lines = text[start:end].removesuffix("\n").split("\n")
    return Edit(start, end, "".join(f"# {line}\n" for line in lines))


def _removed(solution: Solution, command: Command) -> Edit:
    return Edit(*whole_lines(solution.text(CMAKE), command.span.start, command.span.stop), "")


@operator("project-renamed")
def project_renamed(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Gives project() another name than package.xml.

    Fits every CMakeLists.txt with project().
    """
    for command in solution.cmake_calls("project"):
        for name in command.args[:1]:
            edit = Edit(name.span.start, name.span.stop, f"my_{solution.name}")
            yield _site(solution, command, edit)


@operator("no-find-package")
def no_find_package(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Leaves find_package(catkin …) commented out.

    Fits every CMakeLists.txt with find_package(catkin …).
    """
    for command in _find_catkin(solution):
        yield _site(solution, command, _commented(solution, command))


@operator("no-catkin-package")
def no_catkin_package(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Does not call catkin_package().

    Fits every CMakeLists.txt with catkin_package().
    """
    for command in solution.cmake_calls("catkin_package"):
        yield _site(solution, command, _removed(solution, command))


@operator("unknown-component")
def unknown_component(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Asks catkin for a package that is not installed.

    Fits every CMakeLists.txt with find_package(catkin …).
    """
    for command in _find_catkin(solution):
        has = any(argument.value == "COMPONENTS" for argument in command.args)
        end = command.span.stop - 1
        words = "our_course_msgs" if has else "COMPONENTS our_course_msgs"
        yield _site(solution, command, Edit(end, end, f" {words}"))


@operator("cmake-malformed")
def cmake_malformed(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Leaves a bracket open in CMakeLists.txt.

    Fits every CMakeLists.txt with a command.
    """
    for command in solution.cmake[-1:]:
        yield _site(solution, command, Edit(command.span.stop - 1, command.span.stop, ""))


@operator("source-missing")
def source_missing(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Builds a C++ program whose source is not in the package.

    Fits every CMakeLists.txt with a command.
    """
    for command in solution.cmake[-1:]:
        end = command.span.stop
        yield _site(solution, command, Edit(end, end, "\n\nadd_executable(my_node src/my_node.cpp)"))


@operator("install-dropped")
def install_dropped(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Does not name a script in catkin_install_python().

    Fits every script that catkin_install_python() names.
    """
    for command in solution.cmake_calls("catkin_install_python"):
        scripts = [a for a in command.args if a.value.endswith(".py")]
        for argument in scripts:
            start, end = whole_lines(solution.text(CMAKE), argument.span.start, argument.span.stop)
            edit = Edit(start, end, "") if len(scripts) > 1 else _removed(solution, command)
            yield _site(solution, command, edit, script=argument.value)


@operator("install-commented")
def install_commented(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Leaves catkin_install_python() commented out.

    Fits every call of catkin_install_python().
    """
    for command in solution.cmake_calls("catkin_install_python"):
        yield _site(solution, command, _commented(solution, command))


@operator("install-elsewhere")
def install_elsewhere(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Installs the scripts where rosrun does not look.

    Fits every call of catkin_install_python() into the package's programs.
    """
    for command in solution.cmake_calls("catkin_install_python"):
        for argument in command.args:
            if argument.value == BIN:
                edit = Edit(argument.span.start, argument.span.stop, "${CATKIN_PACKAGE_SHARE_DESTINATION}")
                yield _site(solution, command, edit)


# [authoring.mutation.operators.manifest] Mistakes in package.xml.

DEPENDENCIES = ("depend", "build_depend", "build_export_depend", "exec_depend", "run_depend")


def _elements(solution: Solution, *tags: str) -> Iterator[tuple[Document, Element]]:
    manifest = solution.manifest
    if manifest is not None:
        yield from ((manifest, element) for element in manifest.elements(*tags))


def _site_manifest(solution: Solution, manifest: Document, element: Element, edit: Edit, **at: str) -> Site:
    return Site(at=at, tree=solution.edited_xml(manifest, [edit]), line=manifest.line(element))


@operator("dependency-dropped")
def dependency_dropped(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Does not declare a package that the nodes need.

    Fits every dependency of package.xml but catkin.
    """
    found = list(_elements(solution, *DEPENDENCIES))
    for name in sorted({manifest.content(element) for manifest, element in found} - {"catkin", ""}):
        edits = [manifest.remove(element) for manifest, element in found if manifest.content(element) == name]
        yield Site(at={"dependency": name}, tree=solution.edited_xml(found[0][0], edits))


@operator("manifest-renamed")
def manifest_renamed(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Gives package.xml another name than the rest of the package.

    Fits every package.xml with a name.
    """
    for manifest, element in _elements(solution, "name"):
        edit = manifest.set_content(element, f"{manifest.content(element)}_pkg")
        yield _site_manifest(solution, manifest, element, edit)


@operator("package-renamed")
def package_renamed(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Gives the package another name, in all of its files alike.

    Fits every package.
    """
    if MANIFEST not in solution.files:
        return
    word = re.compile(rf"(?<![\w/.-]){re.escape(solution.name)}(?![\w.-])".encode())
    tree = dict(solution.tree)
    for path in (MANIFEST, CMAKE, *(d.path for d in solution.launch_files)):
        if path in solution.files:
            data = word.sub(f"my_{solution.name}".encode(), solution.entry(path).data)
            tree |= {solution.folder + path: solution.with_data(path, data)[solution.folder + path]}
    yield Site(at={}, tree=tree)


@operator("manifest-malformed")
def manifest_malformed(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Forgets to close a tag in package.xml.

    Fits every package.xml with a description.
    """
    for manifest, element in list(_elements(solution, "description"))[:1]:
        close = manifest.data.rfind(b"</", element.inner, element.end)
        if close >= 0:
            yield _site_manifest(solution, manifest, element, Edit(close, element.end, ""))


@operator("buildtool-dropped")
def buildtool_dropped(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Does not name catkin as the build tool.

    Fits every package.xml with a buildtool_depend.
    """
    for manifest, element in list(_elements(solution, "buildtool_depend"))[:1]:
        yield _site_manifest(solution, manifest, element, manifest.remove(element))


@operator("email-left")
def email_left(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Leaves the maintainer's e-mail address as catkin_create_pkg wrote it.

    Fits every maintainer with an address.
    """
    for manifest, element in list(_elements(solution, "maintainer"))[:1]:
        if "email" in element.attributes:
            edit = manifest.set_attribute(element, "email", "user@todo.todo")
            yield _site_manifest(solution, manifest, element, edit)
