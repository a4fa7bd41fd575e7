"""What CMake itself makes of `catkin_install_python`: one real build, a script for each way of writing the call."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest

from grader.arena.build import build
from grader.checks.cmake import CMakeInstallParams, cmake_install
from grader.evidence.writer import EvidenceWriter
from grader.model.package import PackageFacts
from grader.model.submission import SourcePackage
from grader.package.facts import read_package, with_build_facts
from tests.arena.support import CMAKE, SCRIPT, make_place

pytestmark = pytest.mark.ros

CALLS = """
catkin_install_python(PROGRAMS scripts/plain.py scripts/beside.py
  DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION}
)
set(NODES scripts/listed.py)
Catkin_Install_Python(PROGRAMS ${NODES} DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})
file(GLOB FOUND scripts/glob*.py)
catkin_install_python(PROGRAMS ${FOUND} DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})
foreach(node looped)
  catkin_install_python(PROGRAMS scripts/${node}.py DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})
endforeach()
macro(nodes)
  catkin_install_python(PROGRAMS ${ARGN} DESTINATION lib/${PROJECT_NAME})
endmacro()
nodes(scripts/macro.py)
add_subdirectory(scripts)
include(cmake/own.cmake)
# catkin_install_python(PROGRAMS scripts/comment.py DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})
if(FALSE)
  catkin_install_python(PROGRAMS scripts/never.py DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})
endif()
install(PROGRAMS scripts/other.py DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})
catkin_install_python(PROGRAMS scripts/share.py DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION})
catkin_install_python(PROGRAMS scripts/nowhere.py DESTINATION ${NO_SUCH_VARIABLE})
"""
BELOW = "catkin_install_python(PROGRAMS below.py DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})\n"
INCLUDED = (
    "catkin_install_python(PROGRAMS scripts/included.py DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})\n"
)
GOOD = ("included", "plain", "beside", "listed", "glob", "looped", "macro", "below")
BAD = {
    "comment": "does not name scripts/comment.py",
    "never": "does not name scripts/never.py",
    "other": "install(PROGRAMS …) names scripts/other.py",
    "share": "is share/lab, not ${CATKIN_PACKAGE_BIN_DESTINATION} (lib/lab)",
    "nowhere": "a variable that has no value",
}


@pytest.fixture(scope="module")
def facts(tmp_path_factory: pytest.TempPathFactory) -> PackageFacts:
    folder = tmp_path_factory.mktemp("installing") / "lab"
    scripts = {f"scripts/{name}.py": SCRIPT for name in (*GOOD, *BAD)}
    files = {
        "CMakeLists.txt": CMAKE + CALLS,
        "scripts/CMakeLists.txt": BELOW,
        "cmake/own.cmake": INCLUDED,
        **scripts,
    }
    with make_place(files, folder=folder) as place:

        async def work() -> tuple[Path | None, str]:
            path = folder.parent / "package.mcap"
            with EvidenceWriter(path, scenario="package", clock="real", warp=1.0, metadata={}) as writer:
                _, outcome = await build(place, writer, [], [])
            return outcome.trace, outcome.root

        trace, root = asyncio.run(work())
        package = SourcePackage(name="lab", folder=folder, path=".", mode_source="disk", executable={})
        return with_build_facts(read_package(package), cmake_trace=trace, cmake_root=root)


@pytest.mark.parametrize("name", GOOD)
def test_installed_in_whatever_way(name: str, facts: PackageFacts) -> None:
    assert facts.cmake is not None
    assert facts.cmake.source == "trace"
    verdict = cmake_install(facts, CMakeInstallParams(scripts=(f"scripts/{name}.py",)))
    assert verdict.score == 1, verdict


@pytest.mark.parametrize("name", BAD)
def test_not_installed_for_its_own_reason(name: str, facts: PackageFacts) -> None:
    verdict = cmake_install(facts, CMakeInstallParams(scripts=(f"scripts/{name}.py",)))
    assert verdict.score == 0
    assert BAD[name] in verdict.message
