"""Which scenarios a change of a package's files concerns. Pure; in doubt, all of them.

A run can use what its start names, and whatever that leads to. A change of any of these, before or after it, makes the
evidence of the run old. What decides the build, and what all imports may lead to, concerns everything.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from pathlib import PurePosixPath

from grader.rubric.model import Rubric, Scenario
from grader.student.watching.naming import CODE, is_library, leads_anywhere, leads_to, named
from grader.student.watching.snapshot import Picture, differing

BUILD_NAMES = frozenset(
    {
        "package.xml", "CMakeLists.txt", "setup.py", "setup.cfg", "CATKIN_IGNORE", "AMENT_IGNORE", "COLCON_IGNORE",
        "nodelet_plugins.xml", "plugin.xml", "plugins.xml",
    }
)  # fmt: skip
BUILD_SUFFIXES = CODE | {".cmake", ".msg", ".srv", ".action", ".in", ".em", ".cfg", ".so", ".pth"}
CMAKE = re.compile(r"(^|/)(CMakeLists\.txt|[^/]+\.cmake)$")
COMMENT = re.compile(r"#[^\n]*")
HANDED_ON = re.compile(r"\b(catkin_install_python|install)\s*\([^()]*\)", re.IGNORECASE)
READS = re.compile(
    r"\b(file|execute_process|configure_file|add_custom_\w+|exec_program|include)\s*\(", re.IGNORECASE
)


def stale(rubric: Rubric, scenario: str, before: Picture, after: Picture) -> bool:
    """Whether what was recorded of a scenario in the one package may be otherwise in the other."""
    changed = differing(before, after)
    if before.folder != after.folder or before.others != after.others:
        return True
    if any(_concerns_all(path, picture) for path in changed for picture in (before, after)):
        return True
    return any(_used(rubric.scenarios[scenario], picture, frozenset(changed)) for picture in (before, after))


def concerned(rubric: Rubric, before: Picture, after: Picture) -> frozenset[str]:
    """The scenarios of which `stale` is true."""
    return frozenset(name for name in rubric.scenarios if stale(rubric, name, before, after))


def _concerns_all(path: str, picture: Picture) -> bool:
    """Whether it decides the build, or what everybody imports."""
    place = PurePosixPath(path)
    if (
        place.name in BUILD_NAMES
        or "env-hooks" in place.parts
        or place.suffix.lower() in BUILD_SUFFIXES
        or is_library(path)
    ):
        return True
    return any(_read_by_cmake(text, place.name) for name, text in picture.texts.items() if CMAKE.search(name))


def _read_by_cmake(text: str, name: str) -> bool:
    """Whether CMake does more with a file than say that it is to be installed."""
    rest = HANDED_ON.sub("", COMMENT.sub("", text))
    return READS.search(rest) is not None or name in rest


def _used(scenario: Scenario, picture: Picture, changed: frozenset[str]) -> bool:
    """Whether a run of the scenario may use one of the changed files."""
    waiting = list(_begun(scenario, picture))
    seen = set(waiting)
    while waiting:
        path = waiting.pop()
        if path in changed or leads_anywhere(picture, path):
            return True
        new = set(leads_to(picture, path)) - seen
        seen |= new
        waiting.extend(new)
    return False


def _begun(scenario: Scenario, picture: Picture) -> Iterator[str]:
    """The files that a scenario names itself, and the compiled programs' where it may start any."""
    for name in _given(scenario):
        yield from named(picture, name)
    if any(start.built or start.launch is not None for start in scenario.start):
        yield from (path for path in picture.files if PurePosixPath(path).suffix.lower() in CODE)


def _given(scenario: Scenario) -> Iterable[str]:
    for start in scenario.start:
        yield from (name for name in (start.script, start.launch, start.load) if name is not None)
        yield from (arg.rpartition("=")[2] for arg in start.args)
    yield from (param.file for param in scenario.params if param.file is not None)
