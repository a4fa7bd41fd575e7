"""What is said of exceptions that habits of other languages raise."""

from __future__ import annotations

import pytest

from grader.checks.support.exceptions import tracebacks
from grader.checks.support.exit_causes import explain_traceback
from tests.package.trees import facts_of

SCRIPT = """\
import rospy
class Talker:
    def __init__(self):
        self.pub = rospy.Publisher('chatter', String)
    def run():
        pub.publish('a')
"""


@pytest.mark.parametrize(
    ("line", "source", "error", "hint"),
    [
        (6, "while true:", "NameError: name 'true' is not defined. Did you mean: 'True'?", "write `True` for `true`"),
        (6, "last = null", "NameError: name 'null' is not defined", "write `None` for `null`"),
        (6, "n = 0 // start", "NameError: name 'start' is not defined", "write `n = 0 # start`"),
        (6, "pub.publish('a')", "NameError: name 'pub' is not defined",
         "in line 6, write self.pub instead of pub; write `from std_msgs.msg import String` at the top"),
        (6, "talker.run()", "TypeError: run() takes 0 positional arguments but 1 was given",
         "write `def run(self, …):`"),
        (1, "import std_msgs.msg.String",
         "ModuleNotFoundError: No module named 'std_msgs.msg.String'; 'std_msgs.msg' is not a package",
         "write `from std_msgs.msg import String`"),
    ],
)  # fmt: skip
def test_the_hint_is_the_line_as_it_should_be(tmp_path, line, source, error, hint):
    (tmp_path / "package.xml").write_text("<package><name>lab</name></package>")
    (tmp_path / "src").mkdir()
    (tmp_path / "src" / "talker.py").write_text(SCRIPT)
    package = facts_of(tmp_path)
    said = [
        "Traceback (most recent call last):",
        f'  File "/home/student/catkin_ws/src/{package.name}/src/talker.py", line {line}, in <module>',
        f"    {source}",
        error,
    ]
    (found,) = tracebacks(said)
    assert explain_traceback(found, package).hint == hint


@pytest.mark.parametrize(("first", "line"), [("", 3), ("#!/usr/bin/env python3\n", 4)])
def test_a_line_is_counted_without_the_first_line_that_the_arena_writes(tmp_path, first, line):
    (tmp_path / "package.xml").write_text("<package><name>lab</name></package>")
    (tmp_path / "talker.py").write_text(f"{first}import rospy\nrospy.init_node('talker')\nrospu.spin()\n")
    package = facts_of(tmp_path)
    end = explain_traceback(
        said(package, ("talker.py", 4, "rospu.spin()"), error="NameError: name 'rospu' is not defined"),
        package,
    )
    assert [place.line for place in end.citations] == [line]
    assert f"talker.py, line {line}" in end.cause
    assert end.hint == f"in line {line}, write rospy instead of rospu"


def said(package, *frames, error):
    lines = ["Traceback (most recent call last):"]
    for file, line, source in frames:
        own = "/home/student/catkin_ws/src/" + package.name + "/"
        lines += [
            f'  File "{file if file.startswith("/") else own + file}", line {line}, in <module>',
            f"    {source}",
        ]
    return tracebacks([*lines, error])[0]


LIBRARY = "/opt/ros/noetic/lib/python3/dist-packages/rospy/__init__.py"
IMPORTS = ("src/talker.py", 1, "import rospy")
INSIDE = (LIBRARY, 47, "from .client import spin")


@pytest.mark.parametrize(
    ("files", "frames", "error", "of_machine"),
    [
        ((), (IMPORTS, INSIDE), "ImportError: cannot import name 'spin' from 'rospy.client'", True),
        ((), (IMPORTS, INSIDE), "ModuleNotFoundError: No module named 'rosgraph_'", True),
        ((), (IMPORTS, (LIBRARY, 9, "x = (")), "SyntaxError: '(' was never closed", True),
        ((), (IMPORTS, INSIDE), "AttributeError: module 'yaml' has no attribute 'load'", True),
        ((), (INSIDE,), "ImportError: cannot import name 'spin' from 'rospy.client'", True),
        # the package's own yaml.py is what is imported
        (("src/yaml.py",), (IMPORTS, INSIDE), "AttributeError: module 'yaml' has no attribute 'load'", False),
        # a call, not an import
        ((), (("src/talker.py", 4, "rospy.spin()"), INSIDE), "TypeError: spin() takes no arguments", False),
        ((), (("src/talker.py", 1, "import rospi"),), "ModuleNotFoundError: No module named 'rospi'", False),
        ((), (INSIDE,), "ROSException: publish() to a closed topic", False),
    ],
)  # fmt: skip
def test_a_broken_module_of_the_machine_is_not_the_students(tmp_path, files, frames, error, of_machine):
    (tmp_path / "package.xml").write_text("<package><name>lab</name></package>")
    (tmp_path / "src").mkdir()
    for file in ("src/talker.py", *files):
        (tmp_path / file).write_text(SCRIPT)
    package = facts_of(tmp_path)
    end = explain_traceback(said(package, *frames, error=error), package)
    assert end.of_machine == of_machine
    assert (LIBRARY in end.cause) == of_machine
