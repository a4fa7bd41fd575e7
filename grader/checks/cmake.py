"""What `CMakeLists.txt` says."""

from __future__ import annotations

from collections.abc import Iterator

from grader.checks.registry import check
from grader.model.package import CMakeCall, CMakeFacts, Fault, PackageFacts
from grader.model.record import Record
from grader.model.verdict import FileCitation, Verdict, failed, passed


class CMakeParams(Record):
    """`name` is the handout's name for the package, right also where the manifest has another."""

    name: str


@check("cmake", params=CMakeParams)
def cmake(package: PackageFacts, params: CMakeParams) -> Verdict:
    """CMakeLists.txt makes it a catkin package.

    What it checks
        That `CMakeLists.txt` calls `project(…)` with the manifest's name, `find_package(catkin …)` and
        `catkin_package(…)`.

    Why it matters on a robot
        These three lines are what makes a folder with code a package that catkin can build and ROS can
        find. A name that differs from the manifest's stops the build of the whole workspace, other people's
        packages included.

    How it is measured
        By what CMake itself was told while the package was built: variables are expanded and comments
        ignored. Where it was not built, the file is parsed.

    How to fix
        Begin with `cmake_minimum_required(VERSION 3.0.2)`, `project(<name in package.xml>)`,
        `find_package(catkin REQUIRED COMPONENTS rospy std_msgs)` and `catkin_package()`.
    """
    wanted = package.manifest.name if package.manifest else params.name
    names = (wanted, params.name)
    expected = f"project({params.name}), find_package(catkin …), catkin_package(…)"
    facts = package.cmake
    if facts is None:
        hint = f"create one with project({wanted}), find_package(catkin REQUIRED) and catkin_package()"
        return failed("there is no CMakeLists.txt", expected=expected, measured="no file", hint=hint)
    wrong = list(_wrong(facts, names))
    named = [c for c in facts.calls if c.name in {"project", "find_package", "catkin_package"}]
    measured = ", ".join(f"{c.name}({' '.join(c.args[:3])})" for c in named[:6]) or "none of the three calls"
    fault = facts.fault
    if not wrong and fault is None:
        places = tuple(FileCitation(file=c.file, line=c.line) for c in named[:3])
        return passed(
            f"{facts.file} has all three calls", expected=expected, measured=measured, citations=places
        )
    lines = tuple(FileCitation(file=facts.file, line=line) for _, _, line in wrong)
    if fault:
        lines = (*lines, FileCitation(file=fault.file, line=fault.line))
    return failed(
        f"{facts.file}: {'; '.join([*_fault(fault), *(message for message, _, _ in wrong)])}",
        expected=expected,
        measured=measured,
        hint="; ".join(hint for _, hint, _ in wrong) or "mend that line, then run catkin_make",
        citations=tuple(dict.fromkeys(lines)),
    )


def _fault(fault: Fault | None) -> Iterator[str]:
    if fault is not None:
        line = f"line {fault.line}: " if fault.line else ""
        yield f"{line}CMake cannot read it: {fault.cause or fault.message}"


def _wrong(facts: CMakeFacts, names: tuple[str, str]) -> Iterator[tuple[str, str, int | None]]:
    """What is missing or wrong, how to mend it, and the line."""
    wanted = names[0]
    project = _first(facts, "project")
    if project is None:
        yield "project(…) is missing", f"add project({wanted})", None
    elif not project.args or project.args[0] not in names:
        name = project.args[0] if project.args else ""
        message = f"line {project.line}: project({name}) differs from the package's name {wanted}"
        yield message, f"write project({wanted})", project.line
    packages = [c for c in facts.calls if c.name == "find_package"]
    if not any(c.args[:1] == ("catkin",) for c in packages):
        slip = next((c for c in packages if c.args and c.args[0].casefold() == "catkin"), None)
        other = f" (line {slip.line} says {slip.args[0]})" if slip else ""
        yield (
            f"find_package(catkin …) is missing{other}",
            "add find_package(catkin REQUIRED)",
            slip.line if slip else None,
        )
    if _first(facts, "catkin_package") is None:
        yield "catkin_package(…) is missing", "add catkin_package() after find_package(catkin …)", None


def _first(facts: CMakeFacts, name: str) -> CMakeCall | None:
    return next((c for c in facts.calls if c.name == name), None)
