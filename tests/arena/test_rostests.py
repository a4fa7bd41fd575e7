"""An instructor's tests for rostest run beside a student's node: results of gtest and rosunit, limits, and faults."""

from __future__ import annotations

from pathlib import Path

import pytest

from grader.api import grade
from grader.model.result import CriterionResult
from tests.arena.test_course import CMAKE, MANIFEST

pytestmark = pytest.mark.ros
WRITES = """#!/usr/bin/env python3
import sys
open(sys.argv[-1 if sys.argv[-1].startswith("--gtest") else -3].partition("xml:")[2], "wb").write({!r})
"""
GTEST = b"""<?xml version="1.0" encoding="UTF-8"?>
<testsuites tests="3" failures="1" errors="0" name="AllTests"><testsuite name="Sum">
<testcase name="Adds" status="run" result="completed" classname="Sum"/>
<testcase name="Later" status="notrun" result="suppressed" classname="Sum"/>
<testcase name="Says" status="run" classname="Sum"><failure type=""
 message="/ws/src/say.cpp:14&#x0A;Expected: \x07loud&#x0A;  Which is: quiet"><![CDATA[/ws/src/say.cpp:14
<!DOCTYPE what a student sent>]]></failure></testcase></testsuite></testsuites>"""
THROWN = b"""<testsuites><testsuite name="Sum">
<testcase name="Adds"><failure type="" message="unknown file&#x0A;C++ exception with &quot;out of range&quot; thrown in
the test body."/></testcase></testsuite></testsuites>"""
ENTITY = b"""<!DOCTYPE testsuite [<!ENTITY a "aaaa">]><testsuite><testcase name="&a;"/></testsuite>"""
SUBTEST = b'<testsuite failures="1" errors="0"><testcase name="test_sums"/></testsuite>'
SECOND = """#!/usr/bin/env python3
import os, sys, unittest, rostest
class Second(unittest.TestCase):
    def test_again(self):
        again = os.path.exists("again")
        open("again", "w").close()
        self.assertTrue(again, "not yet")
rostest.rosrun("course_tests", "second", Second)
"""
RAISES = SECOND.replace('again = os.path.exists("again")', 'again = {}["rate"]')
COURSE = {
    "package.xml": MANIFEST.format("course_tests", ""),
    "CMakeLists.txt": CMAKE.format("course_tests", "", "catkin_package()\n"),
    "test/gtest.py": WRITES.format(GTEST),
    "test/thrown.py": WRITES.format(THROWN),
    "test/entity.py": WRITES.format(ENTITY),
    "test/subtest.py": WRITES.format(SUBTEST),
    "test/second.py": SECOND,
    "test/raises.py": RAISES,
    "test/hangs.sh": "#!/bin/sh\nexec sleep 60\n",
    "test/crashes.sh": "#!/bin/sh\necho 'an error of its own' >&2\nexit 3\n",
    "test/all.launch": '<launch><arg name="colour"/><param name="/lamp/colour" value="$(arg colour)"/></launch>\n',
    "test/all.test": """<launch>
  <arg name="colour" default="red"/>
  <include file="$(find course_tests)/test/all.launch"><arg name="colour" value="$(arg colour)"/></include>
  <test test-name="param" name="check_param" pkg="rostest" type="paramtest" time-limit="30">
    <rosparam>{param_name_target: /lamp/colour, test_duration: 0.1, wait_time: 9}</rosparam>
  </test>
  <test test-name="published" name="check_published" pkg="rostest" type="publishtest" time-limit="30">
    <rosparam>topics: [{name: /lit, timeout: 20, negative: False}]</rosparam>
  </test>
  <test test-name="second" pkg="course_tests" type="second.py" retry="1" cwd="ROS_HOME"/>
  <test test-name="hangs" pkg="course_tests" type="hangs.sh" time-limit="1"/>
  <test test-name="gtest" pkg="course_tests" type="gtest.py"/>
  <test test-name="thrown" pkg="course_tests" type="thrown.py"/>
  <test test-name="entity" pkg="course_tests" type="entity.py"/>
  <test test-name="subtest" pkg="course_tests" type="subtest.py"/>
  <test test-name="raises" pkg="course_tests" type="raises.py"/>
  <test test-name="crashes" pkg="course_tests" type="crashes.sh"/>
</launch>
""",
}
STUDENT = {
    "package.xml": MANIFEST.format("lamp", "<depend>rospy</depend>"),
    "CMakeLists.txt": CMAKE.format("lamp", "rospy", "catkin_package()\n"),
    "scripts/lamp.py": """#!/usr/bin/env python3
import rospy
from std_msgs.msg import Bool

rospy.init_node("lamp")
lit = rospy.Publisher("/lit", Bool, queue_size=1, latch=True)
lit.publish(True)
print('{"tests": ["all"]}', flush=True)
rospy.spin()
""",
}
NAMES = ("param", "published", "second", "hangs", "gtest", "thrown", "entity", "subtest", "raises", "crashes")
RUBRIC = """schema: grader.rubric/1
id: lamp
title: A lamp
version: "1"
package: lamp
packages: [course_tests]
scenarios:
  tests:
    title: Tests
    start:
      - {name: lamp, script: scripts/lamp.py}
      - {name: all, program: course_tests/all.test, args: ["colour:=green"], after: lamp}
criteria:
""" + "".join(
    f"  - {{id: {name}, title: T, points: 10, check: rostest, with: {{process: all, test: {name}}}, scenario: tests}}\n"
    for name in NAMES
)


@pytest.fixture(scope="module")
def criteria(tmp_path_factory: pytest.TempPathFactory) -> dict[str, CriterionResult]:
    folder = tmp_path_factory.mktemp("rostests")
    for top, files in {"lab/course_tests": COURSE, "alice/lamp": STUDENT}.items():
        for name, text in files.items():
            path = folder / top / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
            path.chmod(0o755 if path.suffix == ".py" else 0o644)
    (folder / "lab" / "lamp.yaml").write_text(RUBRIC)
    result = grade(Path(folder / "alice"), folder / "lab" / "lamp.yaml", folder / "out")
    return {criterion.id: criterion for criterion in result.criteria}


@pytest.mark.parametrize("name", ["param", "published", "second"])
def test_passes(criteria: dict[str, CriterionResult], name: str) -> None:
    """By rostest's own programs, with arguments and included files, and by a testcase that is tried again."""
    found = criteria[name]
    assert (found.status.value, found.measured) == ("pass", "1 of 1 testcase passed"), found


def test_an_assertion_of_gtest_is_named_with_its_line(criteria: dict[str, CriterionResult]) -> None:
    found = criteria["gtest"]
    assert found.status.value == "partial"
    assert found.message == "1 of 2 testcases pass; Says: Expected: ?loud Which is: quiet (say.cpp:14)"
    assert found.points == 5


def test_a_time_limit_and_a_subtest_are_losses(criteria: dict[str, CriterionResult]) -> None:
    assert criteria["hangs"].status.value == "fail"
    assert criteria["hangs"].message == "hangs was not over after 1 s"
    assert criteria["subtest"].message == "1 of 2 testcases pass; subTest or setUpClass"


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("thrown", 'Adds: C++ exception with "out of range" thrown in the test body'),
        ("raises", "test_again: KeyError: 'rate' (raises.py:5)"),
        ("crashes", "crashes: it left no results; it printed last: "),
        ("entity", "entity: it left no results"),
    ],
)
def test_what_is_broken_in_a_test_costs_no_mark(
    criteria: dict[str, CriterionResult], name: str, why: str
) -> None:
    assert criteria[name].status.value == "error"
    assert f"for the instructor: {why}" in criteria[name].hint
