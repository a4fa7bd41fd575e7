"""A package that lies beside the rubric: students' packages build on it, import it, and cannot change it."""

from __future__ import annotations

import io
import sys
import tarfile
from pathlib import Path

import pytest

from grader.api import grade
from grader.arena.base_workspace import unpack
from grader.errors import HostError
from grader.evidence.reader import load_run
from grader.model.result import GradingResult
from tests.arena.support import needs_sandbox

MANIFEST = """<package format="2"><name>{}</name><version>0.1.0</version><description>d</description>
<maintainer email="a@example.org">a</maintainer><license>MIT</license><buildtool_depend>catkin</buildtool_depend>
{}</package>
"""
CMAKE = "cmake_minimum_required(VERSION 3.0.2)\nproject({})\nfind_package(catkin REQUIRED COMPONENTS {})\n{}"
COURSE = {
    "package.xml": MANIFEST.format(
        "course_sim", "<depend>message_generation</depend><depend>message_runtime</depend>"
    ),
    "CMakeLists.txt": CMAKE.format(
        "course_sim",
        "message_generation",
        "add_message_files(FILES Level.msg)\ngenerate_messages()\ncatkin_package(CATKIN_DEPENDS message_runtime)\n",
    ),
    "msg/Level.msg": "float64 litres\n",
    "nodes/tank.py": """#!/usr/bin/env python3
import rospy
from course_sim.msg import Level

rospy.init_node("tank")
level = rospy.Publisher("/level", Level, queue_size=1)
rate = rospy.Rate(20)
while not rospy.is_shutdown():
    level.publish(2.5)
    rate.sleep()
""",
    "launch/world.launch": '<launch><node pkg="course_sim" type="tank.py" name="tank"/></launch>\n',
}
STUDENT = {
    "package.xml": MANIFEST.format("lab9", "<depend>course_sim</depend><depend>rospy</depend>"),
    "CMakeLists.txt": CMAKE.format("lab9", "rospy course_sim", "catkin_package()\n"),
    "scripts/alarm.py": """#!/usr/bin/env python3
import course_sim
import rospy
from course_sim.msg import Level

try:
    open(course_sim.__path__[0] + "/mine", "w")
    print("changed")
except OSError as error:
    print("refused")
rospy.init_node("alarm")
again = rospy.Publisher("/again", Level, queue_size=1)
rospy.Subscriber("/level", Level, again.publish)
rospy.spin()
""",
}
RUBRIC = """schema: grader.rubric/1
id: lab9
title: Lab 9
version: "1"
package: lab9
packages: [course_sim]
scenarios:
  sim:
    title: The tank
    start:
      - {name: tank, program: course_sim/PROGRAM}
      - {name: alarm, script: scripts/alarm.py}
    until: {messages: {/again: 3}, limit_s: 20}
criteria:
  - {id: build, title: Builds, points: 40, check: build}
  - id: again
    title: Says it again
    points: 60
    check: topic-type
    with: {topic: /again, type: course_sim/Level}
    scenario: sim
"""


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path / "cache" / "grader"


def graded(folder: Path, *, program: str = "tank.py", sandbox: str = "auto", **course: str) -> GradingResult:
    """Grade the student's package by a rubric that starts this program; `course` are other files of the package."""
    for top, files in {"lab/course_sim": {**COURSE, **course}, "alice/lab9": STUDENT}.items():
        for name, text in files.items():
            path = folder / top / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
            path.chmod(0o755 if top == "alice/lab9" and path.suffix == ".py" else 0o644)
    rubric = folder / "lab" / "lab9.yaml"
    rubric.write_text(RUBRIC.replace("PROGRAM", program))
    return grade(folder / "alice", rubric, folder / "out", sandbox=sandbox)  # type: ignore[arg-type]


@pytest.mark.ros
@needs_sandbox
def test_it_is_built_once_and_can_only_be_read(tmp_path: Path, cache: Path) -> None:
    assert graded(tmp_path).points == 100
    run = load_run(tmp_path / "out" / "alice" / "evidence" / "sim.mcap")
    assert "refused" in [line.line for _, line in run.lines("alarm")]
    (kept,) = cache.glob("course-*.tar")
    before = kept.stat().st_ino
    assert graded(tmp_path, program="world.launch").points == 100
    assert [path.stat().st_ino for path in cache.glob("course-*.tar")] == [before]


@pytest.mark.ros
@pytest.mark.full
def test_it_is_found_without_a_sandbox(tmp_path: Path) -> None:
    assert graded(tmp_path, sandbox="none").points == 100


@pytest.mark.ros
@pytest.mark.full
def test_a_package_that_does_not_build_is_the_courses_fault(tmp_path: Path) -> None:
    result = graded(tmp_path, **{"CMakeLists.txt": "message(FATAL_ERROR oops)\n"})
    assert {c.status.value for c in result.criteria} == {"inconclusive"}
    run = load_run(tmp_path / "out" / "alice" / "evidence" / "package.mcap")
    assert any("the lab's own packages do not build" in event.detail for _, event in run.course)


@pytest.mark.ros
def test_where_something_that_is_needed_is_missing_nothing_is_graded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        f"{__name__}.RUBRIC", RUBRIC.replace("packages:", "needs: {pip: [no-such-module]}\npackages:")
    )
    with pytest.raises(HostError, match="the lab needs no-such-module, which this machine lacks") as caught:
        graded(tmp_path)
    assert caught.value.hint.endswith("-m pip install no-such-module")


OLDER = pytest.mark.skipif(sys.version_info >= (3, 12), reason="every Python since 3.12 has filters")


@pytest.mark.parametrize(
    "newer",
    [
        pytest.param(True, id="a Python with filters"),
        pytest.param(False, id="Debian 12's own Python", marks=OLDER),
    ],
)
def test_what_was_built_is_unpacked_by_every_python(tmp_path: Path, monkeypatch, *, newer: bool) -> None:
    if not newer:
        monkeypatch.delattr(tarfile, "data_filter", raising=False)
    devel = tmp_path / "made" / "devel" / "lib"
    devel.mkdir(parents=True)
    (devel / "libtank.so.1").write_bytes(b"\x7fELF")
    (devel / "libtank.so").symlink_to("libtank.so.1")
    built = io.BytesIO()
    with tarfile.open(fileobj=built, mode="w") as archive:
        archive.add(tmp_path / "made" / "devel", "devel")
        for name, link in (("devel/out", "/etc"), ("devel/up", ".."), ("../beside", ""), ("devel/hard", "")):
            member = tarfile.TarInfo(name)
            member.type, member.linkname = (tarfile.SYMTYPE if link else tarfile.LNKTYPE), link or "devel/lib"
            archive.addfile(member)
    unpack(built.getvalue(), tmp_path / "course")
    found = sorted(str(path.relative_to(tmp_path / "course")) for path in (tmp_path / "course").rglob("*"))
    assert found == ["devel", "devel/lib", "devel/lib/libtank.so", "devel/lib/libtank.so.1"]
    assert (tmp_path / "course" / "devel" / "lib" / "libtank.so").read_bytes() == b"\x7fELF"
    assert not (tmp_path / "beside").exists()
