"""How a script ended, made up: the files of a package, the frames of a traceback, and what is said of it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from grader.checks.support.console_output import Traceback, tracebacks
from grader.checks.support.exit_causes import Ending, explain_traceback
from grader.model.package import PackageFacts
from tests.package.trees import facts_of, make_package

Frame = tuple[str, int, str]
MANIFEST = "<package><name>{}</name></package>"
SCRIPT = """\
import rospy
class Talker:
    def __init__(self):
        self.pub = rospy.Publisher('chatter', String)
    def run():
        pub.publish('a')
    def stay(self):
        self.rate.sleep()
Talker.stay()
rospy.on_shutdown(leave())
def leave():
    print('over')
number_pub = rospy.Publisher('chatter', String)
text_pub = rospy.Publisher('numbers', Int8)
from std_msgs.msg import Int8
from geometry_msgs.msg import Twist
speed_pub = rospy.Publisher('cmd_vel', Twist)
"""


def package_of(folder: Path, files: Mapping[str, str], name: str = "lab") -> PackageFacts:
    """What the files of a package say, with a manifest that has nothing but its name."""
    make_package(folder, {"package.xml": MANIFEST.format(name), **files})
    return facts_of(folder, name)


def raised(package: PackageFacts, *frames: Frame, error: str) -> Traceback:
    """The traceback of these frames, innermost last; those of the package's files have paths in it."""
    lines = ["Traceback (most recent call last):"]
    for file, line, source in frames:
        path = file if file.startswith(("/", "<")) else f"/home/student/catkin_ws/src/{package.name}/{file}"
        lines += [f'  File "{path}", line {line}, in <module>', f"    {source}"]
    return tracebacks([*lines, error])[0]


def explained(folder: Path, files: Mapping[str, str], *frames: Frame, error: str) -> Ending:
    """What is said of a traceback of these frames in a package of these files."""
    package = package_of(folder, files)
    return explain_traceback(raised(package, *frames, error=error), package)
