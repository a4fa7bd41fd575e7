"""What is said of exceptions that habits of other languages raise."""

from __future__ import annotations

import pytest

from grader.checks.support.exit_causes import explain_traceback, tracebacks
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
        (6, "pub.publish('a')", "NameError: name 'pub' is not defined", "in line 6, write self.pub instead of pub"),
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
