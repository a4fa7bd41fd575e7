"""Mistakes in CMakeLists.txt."""

from __future__ import annotations

from collections.abc import Iterator

from cmake_parser.ast import Command

from grader.authoring.mutation.registry import NoParams, operator
from grader.authoring.mutation.solution import CMAKE, Site, Solution
from grader.authoring.mutation.spans import Edit, whole_lines

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
