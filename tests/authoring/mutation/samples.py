"""Packages to make mutants of: the reference solutions, and one that is written quite differently."""

from __future__ import annotations

from pathlib import Path

from grader.authoring.mutation.solution import Solution, Tree, TreeFile, find_reference, load_solution
from grader.rubric.load import load_rubric

ROOT = Path(__file__).resolve().parent.parent.parent.parent
SHOWN = (
    "eyantra-ros-basics",
    "leeds-comp3631-lab1",
    "mcr2-basic-comms",
    "sheffield-com2009-week1",
    "york-ele00118m-lab7",
)
"""The labs that the golden diffs are of: each is of the first that an operator fits, so a new lab comes last."""
LABS = sorted(
    (path.stem for path in (ROOT / "rubrics").glob("*.yaml")), key=lambda lab: (lab not in SHOWN, lab)
)
EXAMPLES = ("own-message", "tf-broadcaster", "action-server")
"""For operators that fit no lab."""

TIMER = '''\
#!/usr/bin/python3
# -*- coding: utf-8 -*-
"""Zählt, class-based, by a timer."""
from __future__ import annotations
from std_msgs.msg import Int16, String
import rospy

TOPIC = "counter"


class Counter(object):

	def __init__(self, limit=100):
		rospy.init_node(name="counter_node", anonymous=False)
		self.pub = rospy.Publisher(TOPIC, Int16, queue_size=1)
		self.words = rospy.Publisher(name="/words", data_class=String, queue_size=1)
		self.msg = Int16()
		self.timer = rospy.Timer(rospy.Duration(1.0 / 20), self.tick)

	def tick(self, _event):
		"""One turn."""
		if rospy.is_shutdown(): return
		self.pub.publish(self.msg)
		self.words.publish(String(data=f"Übung: it is {rospy.Time.now().to_sec()} now"))
		self.msg.data = (self.msg.data + 1) % 100


if __name__ == "__main__":
	Counter(); rospy.spin()
'''

MODULE_LEVEL = """\
#! /usr/bin/env python3
import rospy, time
from std_msgs.msg import Int8 as Number, Int8
global_count = 5

def heard(number):
    print(f"got {number.data}", flush=True); rospy.loginfo("Got: {}".format(number.data))

rospy.init_node("both", anonymous = True)
sub = rospy.Subscriber("/in", Int8, callback=heard)
pub = rospy.Publisher("out", Int8, queue_size=10)
while True:
    if rospy.is_shutdown():
        break
    msg = Int8(global_count)
    pub.publish(msg)
    if global_count == 99:
        global_count = 5
    else:
        global_count = global_count + 1
    time.sleep(0.5)
"""

LAMBDA = """\
#!/usr/bin/env python
import rospy
import std_msgs.msg
rospy.init_node('ear')
rospy.Subscriber('words', std_msgs.msg.String, lambda m: rospy.loginfo('%s', m.data))
if rospy.has_param('~volume'): rospy.loginfo(rospy.get_param('~volume'))
rospy.set_param('/room/volume', {'level': 3})
rospy.spin()"""

OTHER: dict[str, str] = {
    "package.xml": """\
<?xml version='1.0'?>
<!-- <name>other</name> -->
<package format="3"><name>other</name>
  <description>Übung: <b>other</b> &amp; more</description>
  <maintainer email='me@uni.example'>Ö. Student</maintainer>
  <buildtool_depend>catkin</buildtool_depend>
  <depend>rospy</depend><depend>std_msgs</depend>
</package>
""",
    "CMakeLists.txt": """\
CMAKE_MINIMUM_REQUIRED(VERSION 3.0.2)
PROJECT( other ) # its name
FIND_PACKAGE(catkin REQUIRED)
CATKIN_PACKAGE() ; catkin_install_python(PROGRAMS scripts/timer.py
  DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})
""".replace(" ;", ""),
    "launch/all.launch": """\
<?xml version="1.0" encoding="UTF-8"?>
<!-- > a comment with <node/> in it -->
<launch>
\t<arg name='type' default='timer.py'/>
\t<group ns="a">
\t\t<node
\t\t\tpkg='other'
\t\t\ttype='timer.py' name='zähler' args="--a > --b"
\t\t>
\t\t\t<param name='limit' value='7'/>
\t\t</node>
\t</group>
\t<rosparam command="load" file="$(find other)/config/room.yaml"></rosparam>
\t<node pkg="other" type="ear" name="ear"></node>
</launch>
""",
    "config/room.yaml": "room: {volume: {level: 2, 'unit': \"dB\"}}\nlist: [1, 2]\nplain:\n    key: a # why\n",
    "scripts/timer.py": TIMER,
    "scripts/both.py": MODULE_LEVEL,
    "scripts/ear": LAMBDA,
    "scripts/open.sh": "#!/bin/sh\n  firefox 'https://ros.org/' &\n",
    "scripts/broken.py": "#!/usr/bin/env python\nprint 'Python 2'\n",
    "scripts/empty.py": "",
}


def tree_of(files: dict[str, str], folder: str = "") -> Tree:
    """Files with a shebang are executable."""
    return {
        folder + name: TreeFile(data=text.encode(), executable=text.startswith("#!"))
        for name, text in files.items()
    }


def other_solution() -> Solution:
    """Tabs, classes, timers, f-strings, keywords, single quotes, a Python 2 file and an empty one."""
    return Solution(tree=tree_of(OTHER, "my ws/src/other/"), folder="my ws/src/other/", name="other")


def script_solution(text: str, name: str = "scripts/node.py") -> Solution:
    """A package of one script."""
    return Solution(tree=tree_of({name: text}), folder="", name="lab")


def reference_solution(lab: str) -> Solution:
    loaded = load_rubric(lab if lab in LABS else str(ROOT / "rubrics" / "examples" / f"{lab}.yaml"))
    return load_solution(find_reference(loaded), loaded.rubric.package)
