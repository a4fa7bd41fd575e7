"""A correct package with one slip of the hand: it is named, and the repaired package is the correct one again."""

from __future__ import annotations

from pathlib import Path

import pytest

from grader.package.repairs import Wanted
from tests.package.repairing import CMAKE, CMAKELISTS, LAUNCH, LAUNCHED, MANIFEST, XML, package, repair_all
from tests.package.trees import plain

pytestmark = pytest.mark.usefixtures("without_processes")

TALKER, LISTENER = "src/talker.py", "src/listener.py"
FILES = {
    TALKER: """\
#!/usr/bin/env python3
import rospy
from std_msgs.msg import String


def talk():
    pub = rospy.Publisher('chatter', String, queue_size=10)
    rospy.init_node('talker')
    rate = rospy.Rate(10)

    while not rospy.is_shutdown():
        text = 'hello world %s' % rospy.get_time()
        pub.publish(text)
        rate.sleep()


if __name__ == '__main__':
    try:
        talk()
    except rospy.ROSInterruptException:
        pass
""",
    LISTENER: """\
#!/usr/bin/env python3
import rospy
from std_msgs.msg import String


def callback(msg):
    rospy.loginfo('I heard %s', msg.data)


if __name__ == '__main__':
    rospy.init_node('listener')
    rospy.Subscriber('chatter', String, callback)
    rospy.spin()
""",
    XML: '<?xml version="1.0"?>\n' + MANIFEST,
    CMAKELISTS: CMAKE.replace("rospy)", "rospy\n)")
    + """\
include_directories(
  ${catkin_INCLUDE_DIRS}
)
catkin_install_python(PROGRAMS src/talker.py src/listener.py
  DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION}
)
""",
    LAUNCHED: '<?xml version="1.0"?>\n'
    + LAUNCH.replace("</launch>", '  <node pkg="lab" type="listener.py" name="listener"/>\n</launch>'),
}
WANTED = Wanted(
    package="lab",
    scripts=(TALKER, LISTENER),
    installed=(TALKER, LISTENER),
    dependencies=("rospy",),
    topics=("/chatter",),
    nodes=("talker", "listener"),
    types=("std_msgs/String",),
    launch_files=("lab.launch",),
)
SLIPS = {
    XML: [
        ("<?xml version", "<xml version", 'write `<?xml version="1.0"?>`'),
        ("<?xml version", "<?xml vesion", 'write `<?xml version="1.0"?>`'),
        ('<?xml version="1.0"?>\n<package format="2">', '<package format="2">\n<?xml version="1.0"?>',
         "make line 2 the first line"),
        ('<package format="2">', '<packae format="2">', "line 2 of package.xml: there is no tag `<packae>`"),
        ('<package format="2">', '<package format="2\'>', 'write `<package format="2">`'),
        ('<package format="2">', '<package ormat="2">', "`<package>` has no attribute `ormat`"),
        ('<package format="2">', "<package>", 'the tags below belong to `format="2"`'),
        ('<package format="2">\n', '<package format="2">\n<package format="2">\n', "delete line 3"),
        ("<name>lab", "name>lab", "write `<name>lab</name>`"),
        ("<name>lab", "(name>lab", "write `<name>lab</name>`"),
        ("<name>lab", "<namelab", "the `>` of `<name>` is missing"),
        ("<name>lab", "<name<lab", "the `>` of `<name>` is missing"),
        ("lab</name>", "lab/name>", "the `<` of `</name>` is missing"),
        ("lab</name>", "lab(/name>", "the `<` of `</name>` is missing"),
        ("lab</name>", "lab<name>", "the `/` of the closing tag is missing"),
        ("lab</name>", "lab<\\name>", "a closing tag begins with `</`"),
        ("lab</name>", "lab</name", "line 3 of package.xml: the `>` of `</name>` is missing"),
        ("lab</name>", "lab</name<", "the `>` of `</name>` is missing"),
        ("<name>lab</name>\n", "<name>lab</name>\n  <name>lab</name>\n", "delete line 3"),
        ('format="2"', 'format="20"', "there is no such format"),
        ("0.0.0", "0.00", "this is not a version"),
        ("email=", "email:", "`=` belongs between `email` and its value"),
        ("email=", "emal=", "`<maintainer>` has no attribute `emal`"),
        (">catkin<", ">ctkin<", "catkin as its build tool: it names ctkin"),
    ],
    LAUNCHED: [
        ("<launch>", "<launc>", "write `<launch>`"),
        ("<launch>\n", "<launch>\n<launch>\n", "delete line 3"),
        ("</launch>\n", "</launch>\n</launch>\n", "delete line 6"),
        ("</launch>", "<\\launch>", "write `</launch>`"),
        ('name="listener"/>\n</launch>', 'name="listener"/>\n</launch', "write `</launch>`"),
        ('<node pkg="lab" type="t', '<Node pkg="lab" type="t', "there is no tag `<Node>`: it is called `<node>`"),
        ('<node pkg="lab" type="t', 'node pkg="lab" type="t', "the `<` of the tag is missing"),
        ('<node pkg="lab" type="t', '<node pgk="lab" type="t', "`<node>` has no attribute `pgk`"),
        ('<node pkg="lab" type="t', '<node type="t', "<node> has no pkg"),
        ('name="talker"/>', 'name="talker"\\>', "the tag ends with `/>`"),
        ('name="talker"/>', 'name="talker"/<', "a tag ends with `>`, and not with `<`"),
        ('name="talker"/>', "name=\"talker'/>", "a value ends with the quote with which it begins"),
        ('name="talker"/>', 'name:"talker"/>', "`=` belongs between `name` and its value"),
    ],
    CMAKELISTS: [
        ("(VERSION", "(VERION", "it is VERSION"),
        ("(VERSION 3.0.2", "(3.0.2", "write VERSION before 3.0.2"),
        ("3.0.2", "30.2", "there is no version 30.2 of CMake"),
        ("project(lab)", "projectlab)", "the command's `(` is missing"),
        ("project(lab)", "project{lab)", "the command's bracket is `(`"),
        ("project(lab)", "project(lab}", "is closed by `)`"),
        ("project(lab)", "project()", "project(…) has no name"),
        ("project(lab)", "rpoject(lab)", "it is called project"),
        ("(catkin REQ", "(catkni REQ", "write catkin instead of catkni"),
        ("(catkin REQ", "(REQ", "write catkin before REQUIRED"),
        ("(catkin REQUIRED", "(REQUIRED catkin", "write catkin before REQUIRED"),
        ("COMPONENTS", "COMPONNETS", "it is COMPONENTS"),
        ("rospy\n)", "rospy\n)\n)", "delete line 5"),
        ("rospy\n)", "rospy\n}", "write `)`"),
        ("include_directories(", "include_directories", "write `include_directories(`"),
        ("  ${catkin_", "  $(catkin_", "write `${catkin_INCLUDE_DIRS}`"),
        ("DIRS}", "DIRS)", "write `${catkin_INCLUDE_DIRS}`"),
        ("DIRS}", "DIRS", "write `${catkin_INCLUDE_DIRS}`"),
        ("  ${catkin_INCLUDE_DIRS}\n)", ")\n  ${catkin_INCLUDE_DIRS}", "are the wrong way round"),
        ("python(PROGRAMS", "pythonPROGRAMS", "write `catkin_install_python(PROGRAMS"),
        ("(PROGRAMS ", "(", "write PROGRAMS before src/talker.py"),
        ("src/listener.py", "srclistener.py", "write src/listener.py instead of srclistener.py"),
        ("DESTINATION $", "DSTINATION $", "it is DESTINATION"),
        ("DESTINATION $", "$", "has no DESTINATION"),
        ("${CATKIN_PACKAGE_BIN_DESTINATION}", "${catkin_package_bin_destination}", "is not where rosrun looks"),
    ],
    TALKER: [
        ("import rospy", "import ropy", "uses rospy, which is not imported"),
        ("std_msgs.msg", "std_msgs.mg", "messages are not imported from std_msgs.mg"),
        ("std_msgs.msg", "std_msgsmsg", "messages are not imported from std_msgsmsg"),
        ("std_msgs.msg", "std_msgs,msg", "a dot belongs between the parts of a module's name"),
        ("import String", "imort String", "Python writes `import`, not `imort`"),
        ("def talk():", "de talk():", "Python writes `def`, not `de`"),
        ("def talk():", "def talk):", "its opening bracket is missing"),
        ("def talk():\n", "def talk():\ndef talk():\n", "delete line 7"),
        ("    pub = rospy.Publisher('chatter', String, queue_size=10)\n",
         "        pub = rospy.Publisher('chatter', String, queue_size=10)\n", "line"),
        ("def talk():\n    pub = rospy.Publisher('chatter', String, queue_size=10)\n",
         "    pub = rospy.Publisher('chatter', String, queue_size=10)\ndef talk():\n",
         "lines 6 and 7 of src/talker.py"),
        ("pub = ", "pub  ", "`=` is missing between the name and its value"),
        ("pub = ", "pub : ", "a name gets its value by `=`"),
        ("rospy.Publisher", "rospy,Publisher", "a dot belongs between `rospy` and `Publisher`"),
        ("rospy.Publisher", "rospyPublisher", "the dot is missing in `rospyPublisher`"),
        ("Publisher('", "Publisher{'", "a `{` is closed by `)`"),
        ("Publisher('", "Publisher(", "a quote is opened on this line"),
        ("'chatter', ", "'chatter'. ", "a comma belongs between `'chatter'` and `String`"),
        ("String, queue", "String. queue", "a comma belongs between two arguments"),
        ("String, queue_size=10", "queue_size=10, String", "a value without a name comes after one with a name"),
        ("String, queue", "queue", "the type of the messages is missing"),
        ("queue_size=10", "quue_size=10", "it is called `queue_size`"),
        ("queue_size=10", "queue_size10", "`=` is missing between `queue_size` and its value"),
        ("queue_size=10", "queue_size:10", "an argument of a call gets its value by `=`"),
        ("'hello world %s' % rospy.get_time()", "'hello world %s' rospy.get_time()", "`%` is missing"),
        ("init_node('talker')", "init_node()", "line 8 of src/talker.py: the node has no name"),
        ("rospy.Rate(10)", "rospy.Rate10)", "its opening bracket is missing"),
        ("rospy.Rate(10)", "rospy.aRte(10)", "there is no rospy.aRte"),
        ("while not", "while ont", "Python writes `not`, not `ont`"),
        ("    while not", "        while not", "line 11 of src/talker.py"),
        ("rospy.is_shutdown", "rospy,is_shutdown", "a dot belongs behind `rospy`"),
        ("world %s", "world s", "the string has no `%` in it"),
        ("' % rospy", "' & rospy", "and not `&`"),
        ("rospy.get_time()", "rospy.get_time)", "its opening bracket is missing"),
        ("rospy.get_time()", "rospy.get_time(", "is opened on this line and never closed"),
        ("pub.publish", "pu.publish", "pu is not defined"),
        ("pub.publish", "pubpublish", "the dot is missing in `pubpublish`"),
        ("pub.publish", "pub,publish", "a dot belongs between `pub` and `publish`"),
        ("pub.publish", "pub.publihs", "`publihs` is called `publish`"),
        ("publish(text)", "publish()", "there is nothing to publish in the brackets"),
        ("publish(text)", "publishtext)", "its opening bracket is missing"),
        ("        text = 'hello world %s' % rospy.get_time()\n        pub.publish(text)\n",
         "        pub.publish(text)\n        text = 'hello world %s' % rospy.get_time()\n",
         "write line 13 above line 12"),
        ("rate.sleep", "rate.Sleep", "`Sleep` is called `sleep`"),
        ("if __name__", "f __name__", "Python writes `if`, not `f`"),
        ("if __name__", "if __nam__", "__nam__ is not defined"),
        ("'__main__'", "'__mai__'", "`__name__` is never '__mai__'"),
        ("'__main__'", "__main__'", "a quote is opened on this line"),
        ("== '__m", "=: '__m", "two values are compared by `==`"),
        ("    try:", "        try:", "line"),
        ("    except", "        except", "start line 20 with 4 spaces"),
        ("    except", "except", "start line 20 with 4 spaces"),
        ("except rospy", "excep rospy", "Python writes `except`, not `excep`"),
        ("except rospy.ROS", "except rospy,ROS", "a dot belongs behind `rospy`"),
        ("pass", "pas", "pas is not defined"),
    ],
    LISTENER: [
        ("callback(msg)", "callbackmsg)", "its opening bracket is missing"),
        ("    rospy.loginfo", "rospy.loginfo", "the line after a `:` must be indented"),
        ("'I heard %s', msg.data", "msg.data, 'I heard %s'", "the string comes first, then its values"),
        ("I heard %s", "I heard s", "the string has no `%` in it"),
        ("msg.data", "mg.data", "mg is not defined"),
        ("msg.data", "msg.Data", "`Data` is called `data`"),
        ("msg.data", "msgdata", "the dot is missing in `msgdata`"),
        ("%s', ", "%s'. ", "a comma belongs between `'I heard %s'` and `msg`"),
        ("String, callback", "callback, String", "the type comes before the callback"),
        ("String, callback", "callback", "the type of the messages is missing"),
        ("rospy.spin()", "rospy.spni()", "there is no rospy.spni"),
        ("rospy.spin()", "rospyspin()", "the dot is missing in `rospyspin`"),
        ("if __name__", "    if __name__", "line 10 of src/listener.py"),
    ],
}  # fmt: skip
"""By the file: what is written in place of what, and what is said of it."""


@pytest.mark.parametrize(("file", "slip"), [(file, slip) for file, slips in SLIPS.items() for slip in slips])
def test_one_slip_is_named_and_undone(file: str, slip: tuple[str, str, str], tmp_path: Path) -> None:
    old, new, says = slip
    assert FILES[file].count(old) >= 1
    folder = package(tmp_path, {**FILES, file: FILES[file].replace(old, new, 1)})
    found = repair_all(folder, WANTED)
    words = "; ".join(f"{one.message}: {one.fix}" for one in found)
    assert found, new
    assert says in words
    assert plain(file, (folder / file).read_bytes()) == plain(file, FILES[file].encode()), words


def test_the_correct_package_has_no_slip(tmp_path: Path) -> None:
    assert repair_all(package(tmp_path, dict(FILES)), WANTED) == ()


@pytest.mark.parametrize("wrong", ["'I heard {}',format(msg.data)", "'I heard {}'.ormat(msg.data)"])
def test_a_slip_of_format_is_named_and_undone(wrong: str, tmp_path: Path) -> None:
    right = FILES[LISTENER].replace("'I heard %s', msg.data", "'I heard {}'.format(msg.data)")
    changed = FILES[LISTENER].replace("'I heard %s', msg.data", wrong)
    folder = package(tmp_path, {**FILES, LISTENER: changed})
    assert [repair.line for repair in repair_all(folder, WANTED)] == [7]
    assert (folder / LISTENER).read_text() == right
