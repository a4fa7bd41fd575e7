"""A correct package with one slip of the hand: it is named, and the repaired package is the correct one again."""

from __future__ import annotations

from pathlib import Path

import pytest

from grader.package.python_repairs.examine import examine
from grader.package.repairs import Wanted
from grader.package.repairs.python import turn_sign
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
        ('<package format="2">', "<package format='1'>", 'the tags below belong to `format="2"`'),
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
        ('format="2"', 'format=="2"', "`=` is there twice"),
        ('format="2"', 'format="2""', "a quote is there twice"),
        ('format="2"', 'format=""2"', "a quote is there twice"),
        ("<name>", "<<name>", "`<` is there twice"),
        ("<name>", ">name>", "the `<` of the tag is missing"),
        ("<buildtool_depend>", "<buildtool_depend>>", "`>` is there twice"),
        ("lab</name>", "lab<//name>", "`/` is there twice"),
        ("lab</name>", "lab>/name>", "a closing tag begins with `</`"),
        ("lab</name>", "lab</>", "the name of the closing tag is missing"),
        ("lab</name>", "lab<name/>", "a closing tag is written `</name>`: its `/` comes first"),
        ("<name>lab", "<>lab", "the name of the tag is missing"),
        ("<depend>rospy", "<depend>rosy", "there is no package rosy"),
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
        ('type="talker.py"', 'type="src/talker.py"', 'type="src/talker.py" should be type="talker.py"'),
        ('type="talker.py"', 'type="scripts/talker"', 'type="scripts/talker" should be type="talker.py"'),
        ('name="talker"/>', 'name="talker"\\>', "the tag ends with `/>`"),
        ('name="talker"/>', 'name="talker"/<', "a tag ends with `>`, and not with `<`"),
        ('name="talker"/>', "name=\"talker'/>", "a value ends with the quote with which it begins"),
        ('name="talker"/>', 'name:"talker"/>', "`=` belongs between `name` and its value"),
        ('name="talker"/>', 'name="talker"//>', "`/` is there twice"),
        ('name="talker"/>', 'name=talker"/>', 'write `<node pkg="lab" type="talker.py" name="talker"/>`'),
        ('type="talker.py" name="talker"/>', "type=talker.py name=talker/>", 'type="talker.py" name="talker"/>`'),
        ('name="talker"/>', 'name=="talker"" />', "`=` is there twice"),
        ('<node pkg="lab" type="t', '<node pkh="lab" type="t', "`<node>` has no attribute `pkh`"),
        ("</launch>", "</>", "the name of the closing tag is missing"),
        ("</launch>", "<launch/>", "write `</launch>`"),
    ],
    CMAKELISTS: [
        ("(VERSION", "(VERION", "it is VERSION"),
        ("(VERSION 3.0.2", "(3.0.2", "write VERSION before 3.0.2"),
        ("3.0.2", "30.2", "there is no version 30.2 of CMake"),
        ("project(lab)", "projectlab)", "the command's `(` is missing"),
        ("project(lab)", "project((lab)", "`(` is there twice"),
        ("project(lab)", "project(lab))", "`)` is there twice"),
        ("rospy\n)", "rospy\n))", "`)` is there twice"),
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
        ("${CATKIN_PACKAGE_BIN_DESTINATION}", "${catkin_package_bin_destination}", "there is no variable"),
    ],
    TALKER: [
        ("import rospy", "import ropy", "uses rospy, which is not imported"),
        ("std_msgs.msg", "std_msgs.mg", "messages are not imported from std_msgs.mg"),
        ("std_msgs.msg", "std_msgsmsg", "messages are not imported from std_msgsmsg"),
        ("std_msgs.msg", "std_msgs,msg", "a dot belongs between the parts of a module's name"),
        ("std_msgs.msg", "std_msgs..msg", "`.` is there twice"),
        ("std_msgs.msg import", "std_msgs,msg impprt", "a dot belongs between the parts of a module's name"),
        ("from std", "fsom std", "Python writes `from`, not `fsom`"),
        ("import String", "import Strimg", "Strimg is not defined"),
        ("def talk()", "def talk(()", "`(` is there twice"),
        ("def talk()", "def talk[)", "a `[` is closed by `)`"),
        ("String, queue", "String,, queue", "`,` is there twice"),
        ("'chatter'", "''chatter'", "`'` is there twice"),
        ("'chatter'", "'chatter''", "`'` is there twice"),
        ("queue_size=10", "queue_size==10", "an argument of a call gets its value by `=`"),
        ("pub = ", "pub == ", "a name gets its value by `=`, and not by `==`"),
        ("rospy.Rate(10)", "rospy.Rate[10)", "a `[` is closed by `)`"),
        ("rospy.Rate", "rosby.Rate", "rosby is not defined"),
        ("while not", "while npt", "Python writes `not`, not `npt`"),
        ("is_shutdown():", "is_shutdown()::", "`:` is there twice"),
        ("' % rospy", "' %% rospy", "`%` is there twice"),
        ("world %s", "world %%s", "`%%` is a plain `%`"),
        ("rospy.get_time()", "rospy.get_time(()", "`(` is there twice"),
        ("publish(text)", "publish(teyt)", "teyt is not defined"),
        ("publish(text)", "publish((text)", "`(` is there twice"),
        ("pass", "qass", "qass is not defined"),
        ("try:", "tyr:", "Python writes `try`, not `tyr`"),
        ("def talk", "deg talk", "Python writes `def`, not `deg`"),
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
        ("' % rospy", "', rospy", "the comma makes several values of `text`, which is to be text"),
        ("rospy.get_time()", "rospy.get_time)", "its opening bracket is missing"),
        ("rospy.get_time()", "rospy.get_time(", "is opened on this line and never closed"),
        ("pub.publish", "pu.publish", "pu is not defined"),
        ("pub.publish", "pubpublish", "the dot is missing in `pubpublish`"),
        ("pub.publish", "pub,publish", "a dot belongs between `pub` and `publish`"),
        ("pub.publish", "pub.publihs", "`publihs` is called `publish`"),
        ("'chatter', String, queue", "'chatter, String', queue", "the quotes end behind the name"),
        ("publish(text)", "publish()", "there is nothing to publish in the brackets"),
        ("publish(text)", "publish(hello_str)", "nothing gives `hello_str` a value"),
        ("pub.publish(text)", "publisher.publish(text)", "publisher is not defined"),
        ("'hello world %s' %", "'hello world' %", "the string has no `%` in it"),
        ("publish(text)", "publish() = text", "`publish` gets its values in its brackets"),
        ("publish(text)", "publishtext)", "its opening bracket is missing"),
        ("def talk():", "def talk:", "the brackets `()` behind the name of the function are missing"),
        ("        text = 'hello world %s' % rospy.get_time()\n        pub.publish(text)\n",
         "        pub.publish(text)\n        text = 'hello world %s' % rospy.get_time()\n",
         "write line 13 above line 12"),
        ("rate.sleep", "rate.Sleep", "`Sleep` is called `sleep`"),
        ("pub.publish(", "pub.publisher(", "`publisher` is called `publish`"),
        ("if __name__", "f __name__", "Python writes `if`, not `f`"),
        ("if __name__ == '__main__':", "ifname == 'main':", "`__name__` has two `_` on each side"),
        ("if __name__", "if __nam__", "__nam__ is not defined"),
        ("'__main__'", "'__mai__'", "`__name__` is never '__mai__'"),
        ("__name__ ==", "bin ==", "`bin` is never '__main__'"),
        ("__name__ ==", "'__name__' ==", "`'__name__'` is never '__main__'"),
        ("__name__ ==", "__name__ !=", "`__name__` is '__main__' whenever the script is run"),
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
        ("    rospy.loginfo", "#    rospy.loginfo", "delete the `#` before the code of that block"),
        ("    rospy.loginfo", "    # rospy.loginfo", "there are only comments in the block that begins above it"),
        ("callback(msg)", "callbackmsg)", "its opening bracket is missing"),
        ("    rospy.loginfo", "rospy.loginfo", "the line after a `:` must be indented"),
        ("'I heard %s', msg.data", "msg.data, 'I heard %s'", "the string comes first, then its values"),
        ("I heard %s", "I heard s", "the string has no `%` in it"),
        ("I heard %s", "I heard {}", "the string has fewer `%` than there are values after it"),
        ("msg.data", "mg.data", "mg is not defined"),
        ("%s', msg.data)", '%s", msg.data))', "a quote is opened on this line"),
        ("msg.data)", "msg.data')", "a quote is opened on this line"),
        ("rospy.Subscriber", "rospy.Publisher", "a Publisher takes no callback"),
        ("msg.data", "msg.Data", "`Data` is called `data`"),
        ("callback(msg)", "callback()", "`callback` takes 0 arguments, but ROS passes it the message"),
        ("callback(msg)", "callback(msg, topic)", "`callback` takes 2 arguments, but ROS passes it the message"),
        ("msg.data", "msgdata", "the dot is missing in `msgdata`"),
        ("%s', ", "%s'. ", "a comma belongs between `'I heard %s'` and `msg`"),
        ("String, callback", "callback, String", "the type comes before the callback"),
        ("String, callback", "String", "`Subscriber(…)` gets no callback"),
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


CLASS = """\
#!/usr/bin/env python3
import rospy
import std_msgs.msg


class Talker():
    def __init__(self):
        self.pub = rospy.Publisher('chatter', std_msgs.msg.String, queue_size=10)
        rospy.init_node('talker', anonymous=True)
        self.rate = rospy.Rate(10)
        rospy.Subscriber('chatter', std_msgs.msg.String, self.hear)

    def hear(self, message):
        print('heard %s' % message.data)

    def main_loop(self):
        while not rospy.is_shutdown():
            self.pub.publish('hello world %s' % rospy.get_time())
            self.rate.sleep()


if __name__ == '__main__':
    talker = Talker()
    talker.main_loop()
"""


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("self.pub =", "self,pub =", "a dot belongs between `self` and `pub`"),
        ("self.rate.sleep", "self.arte.sleep", "`arte` is called `rate`"),
        ("self.pub.publish", "self.publisher.publish", "`publisher` is called `pub`"),
        ("self.rate =", "rate =", "a value is given to `rate`, not to `self.rate`"),
        ("self.rate.sleep", "self.r.sleep", "`r` is called `rate`"),
        ("def hear(self, message)", "def hear(self)", "passes it `self` and the message"),
        ("def hear(self, message)", "def hear(message)", "`hear` is a method, so its first parameter"),
        ("self.rate.sleep", "self.rate,sleep", "a dot belongs between `rate` and `sleep`"),
        ("self.hear)", "self,hear)", "a dot belongs between `self` and `hear`"),
        ("self.hear)", "selg.hear)", "selg is not defined"),
        ("self.hear)", "hear)", "`hear` belongs to the class Talker"),
        ("message.data", "mesage.data", "mesage is not defined"),
        ("message.data", "message,data", ""),
        ("hear(self, ", "hear(Self, ", ""),
        (
            "__init__(self)",
            "_init_(self)",
            "Python calls the method `__init__` of a new object, and never `_init_`",
        ),
        ("__init__(self)", "__int__(self)", "and never `__int__`"),
        (
            "main_loop(self)",
            "main_loop()",
            "`main_loop` is a method, so its first parameter has to be `self`",
        ),
        ("talker = Talker", "talker = talker", "talker is not defined"),
        ("main_loop(self)", "main_loop(Self)", "is called `self`, and not `Self`"),
        ("main_loop(self)", "main_loopself)", "its opening bracket is missing"),
        ("talker.main_loop", "talker.main_lop", "`main_lop` is called `main_loop`"),
        ("talker = Talker", "talker == Talker", "a name gets its value by `=`"),
        ("rospy.Publisher", "Rospy.Publisher", "Rospy is not defined"),
        ("anonymous=True", "anonymousTrue", "`=` is missing between `anonymous` and its value"),
        ("anonymous=True", "anonymous==True", "an argument of a call gets its value by `=`"),
        ("print(", "Print(", "Print is not defined"),
        ("self.rate = rospy", "self.rate rospy", "`=` is missing between the name and its value"),
        ("self.hear)", "selfhear)", "the dot is missing in `selfhear`"),
        ("import std_msgs.msg", "import stdd_msgs.msg", "uses std_msgs, which is not imported"),
        ("import std_msgs.msg", "import std_msgs.msh", "messages are not imported from std_msgs.msh"),
        ("std_msgs.msg.String", "stdxmsgs.msg.String", "stdxmsgs is not defined"),
        ("std_msgs.msg.String", "std_msgs.msg.Sting", "there is no std_msgs.msg.Sting"),
        ("std_msgs.msg.String", "std_msgs.mgs.String", "there is no std_msgs.mgs"),
        ("std_msgs.msg.String", "std_msgs.msg,String", "a dot belongs between `msg` and `String`"),
    ],
)
def test_a_slip_in_a_class_is_named_and_undone(old: str, new: str, says: str, tmp_path: Path) -> None:
    folder = package(tmp_path, {**FILES, TALKER: CLASS.replace(old, new, 1)})
    found = repair_all(folder, WANTED)
    words = "; ".join(f"{one.message}: {one.fix}" for one in found)
    assert says in words
    if says:
        assert plain(TALKER, (folder / TALKER).read_bytes()) == plain(TALKER, CLASS.encode()), words


@pytest.mark.parametrize(
    ("right", "wrong", "says"),
    [
        ("[n for n in (1, 2) if n]", "[n For n in (1, 2) if n]", "Python writes `for`, not `For`"),
        ("[n for n in (1, 2) if n]", "[n for n ni (1, 2) if n]", "Python writes `in`, not `ni`"),
        ("[n for n in (1, 2) if n]", "[n for n in (1, 2) f n]", "Python writes `if`, not `f`"),
        ("rospy.get_time() or 1", "rospy.get_time() ro 1", "Python writes `or`, not `ro`"),
        ("max((1, 2), default=3)", "max((1, 2). default=3)", "a comma belongs between two arguments"),
    ],
)
def test_a_slip_within_a_value_is_named_and_undone(right: str, wrong: str, says: str, tmp_path: Path) -> None:
    given = "'hello world %s' % rospy.get_time()"
    folder = package(tmp_path, {**FILES, TALKER: FILES[TALKER].replace(given, wrong)})
    found = repair_all(folder, WANTED)
    assert says in "; ".join(one.message for one in found)
    assert (folder / TALKER).read_text() == FILES[TALKER].replace(given, right)


@pytest.mark.parametrize(
    ("old", "new", "right"),
    [
        ("'I heard %s', msg.data)", "'I heard {}').format(msg.data)", "'I heard {}'.format(msg.data))"),
        ("'I heard %s', msg.data)", "'I heard %s') % msg.data", "'I heard %s' % msg.data)"),
        ("'I heard %s', msg.data)", "'I heard {msg.data}')", "f'I heard {msg.data}')"),
        ("'I heard %s', msg.data)", "'I heard {}' % msg.data)", "'I heard {}'.format(msg.data))"),
        ("'I heard %s', msg.data)", "'I heard {n}' % msg.data)", None),
        ("'I heard %s', msg.data)", "'%s: ' + 'I heard') % msg.data", None),
        ("'I heard %s', msg.data)", "'I heard {name}')", None),
        ("'I heard %s', msg.data)", "('I heard {msg}').replace('{msg}', msg.data))", None),
        ("'I heard %s', msg.data)", "f'I heard {{msg}} {msg.data}')", None),
    ],
)
def test_values_are_put_into_the_string(old: str, new: str, right: str | None, tmp_path: Path) -> None:
    folder = package(tmp_path, {**FILES, LISTENER: FILES[LISTENER].replace(old, new)})
    repair_all(folder, WANTED)
    assert (folder / LISTENER).read_text() == FILES[LISTENER].replace(old, new if right is None else right)


def test_the_function_keeps_its_name_in_what_is_said(tmp_path: Path) -> None:
    text = FILES[LISTENER].replace("callback(msg)", "callback(msg, topic)").replace("callback", "on_msg")
    said = [one.message for one in repair_all(package(tmp_path, {**FILES, LISTENER: text}), WANTED)]
    assert ["`on_msg` takes 2 arguments" in one for one in said] == [True]


def test_an_argument_beside_self_stays_one(tmp_path: Path) -> None:
    text = CLASS.replace("self.hear)", "lambda msg: self.say(self, msg))").replace(
        "def hear(self, message):", "def say(self, hear, message=None):"
    )
    assert repair_all(package(tmp_path, {**FILES, TALKER: text}), WANTED) == ()


def test_brackets_within_a_value_are_not_there_twice(tmp_path: Path) -> None:
    text = FILES[TALKER].replace("'hello world %s' % rospy.get_time()", "str((rospy.get_time() + 1) * 2")
    folder = package(tmp_path, {**FILES, TALKER: text})
    repair_all(folder, WANTED)
    assert "text = str((rospy.get_time() + 1) * 2)\n" in (folder / TALKER).read_text()


COMMENTED = FILES[XML].replace(
    "  <version>", "  <!-- First the version -->\n  <!-- Then all else -->\n  <version>"
)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("version -->", "version ->"),
        ("version -->", "version _->"),
        ("version -->", "version --->"),
        ("version -->", "version --<"),
        ("else -->", "else -"),
        ("<!-- First", "<-- First"),
        ("<!-- First", "<!_- First"),
        ("<!-- Then", "<!!-- Then"),
        ("<!-- Then", "!-- Then"),
    ],
)
def test_a_slip_of_a_comment_is_undone(old: str, new: str, tmp_path: Path) -> None:
    folder = package(tmp_path, {**FILES, XML: COMMENTED.replace(old, new)})
    found = repair_all(folder, WANTED)
    assert [one.file for one in found] == [XML]
    assert plain(XML, (folder / XML).read_bytes()) == plain(XML, COMMENTED.encode())


def test_the_correct_package_has_no_slip(tmp_path: Path) -> None:
    assert repair_all(package(tmp_path, dict(FILES)), WANTED) == ()


def test_the_name_of_a_message_class_may_be_a_parameter(tmp_path: Path) -> None:
    """Nothing is missing between `String` and `data`, though both are names of the script."""
    own = FILES[LISTENER].replace("(msg)", "(String)")
    own = own.replace(
        "    rospy.loginfo('I heard %s', msg.data)", "    data = String.data\n    rospy.loginfo(data)"
    )
    assert repair_all(package(tmp_path, {**FILES, LISTENER: own}), WANTED) == ()


@pytest.mark.parametrize(
    "body",
    [
        "    robot = Driver()\n    speed = 1\n    robot.publish()\n",  # its own method needs no message
        "    pixel_region = PixelRegion()\n    pub.publish(str(pixel_region))\n",  # a class is not the variable
        # of Python, and not of ROS
        "    from threading import Timer\n    Timer(1, late).start()\ndef late():\n    rospy.sleep(1)\n",
    ],
)
def test_what_another_module_may_have_is_left_alone(body: str, tmp_path: Path) -> None:
    both = f"from driver import Driver\ndef drive():\n{body}def talk():\n    drive()\n"
    folder = package(tmp_path, {**FILES, TALKER: FILES[TALKER].replace("def talk():\n", both)})
    assert [one for one in repair_all(folder, WANTED) if one.file == TALKER] == []


@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("loginfo('I heard {}'.format(msg.data))", "loginfo('I heard {}',format(msg.data))"),
        ("loginfo('I heard {}'.format(msg.data))", "loginfo('I heard {}'.ormat(msg.data))"),
        ("loginfo(rospy.get_name() + '%s', msg.data)", "loginforospy.get_name() + '%s', msg.data)"),
        ("loginfo(rospy.get_name() + '%s', msg.data)", "logwinforospy.get_name() + '%s', msg.data)"),
    ],
)
def test_a_slip_of_a_call_is_named_and_undone(right: str, wrong: str, tmp_path: Path) -> None:
    old = "loginfo('I heard %s', msg.data)"
    folder = package(tmp_path, {**FILES, LISTENER: FILES[LISTENER].replace(old, wrong)})
    assert [repair.line for repair in repair_all(folder, WANTED)] == [7]
    assert (folder / LISTENER).read_text() == FILES[LISTENER].replace(old, right)


NODE = "import rospy\nfrom a.msg import A\nrospy.init_node('n')\n"
LEFT_ALONE = {
    "attribute-of-a-base": "class B(Base):\n    def f(self, m):\n        if self.is_shutdown:\n            return\n",
    "parameter-like-a-function": "def stop():\n    pass\ndef run(stop):\n    if stop:\n        print(1)\nrun(stop)\n",
    "own": "class B:\n    def f(self):\n        a = 1\n        self.publish()\n    def publish(self):\n        pass\n",
    "heard-by-nobody": f"{NODE}def name(n):\n    return n\nrospy.Subscriber('a', A)\nrospy.spin()\n",
    "both-pythons": "try:\n    input = raw_input\nexcept:\n    pass\n",
    "asks-for-version": "import sys\nif sys.hexversion > 0x03000000:\n    texts = str\nelse:\n    texts = basestring\n",
    "other-axis": "class A:\n    def __init__(self):\n        self.max_z = 1\n        print(self.max_x)\n",
    "other-side": "left_l = 1\nprint(left_r)\n",
    "method-of-a-text": "from os.path import join\nformat = 3\nprint(join('a', '{}'.format(format)), ','.join('ab'))\n",
    "commented-callback": "def f():\n    a = 1\n    # rospy.Subscriber('a', A, g)\n\n\n    print(a)\nf()\n",
    "made-of-a-class-that-is-not-there": "battery = Battery()\nprint(battery)\n",
    "rate-beside-a-lost-text": f"{NODE}def f(p):\n    rate = rospy.Rate(1)\n    p.publish(text)\nf(P())\n",
    "commented": "while a:\n    if b:\n        # c()\n    d()\n",
    "window": f"{NODE}rospy.Subscriber('a', A, print)\ngtk.main()\n",
    "test": f"{NODE}rospy.Subscriber('a', A, print)\nrostest.rosrun('a', 'b', T)\n",
    "goal": f"{NODE}rospy.Subscriber('a', A, print)\nclient.wait_for_result()\n",
    "module": "import rospy\ndef f(n):\n    rospy.init_node(n)\n    rospy.Subscriber('a', B, print)\n",
}  # fmt: skip


@pytest.mark.parametrize("name", LEFT_ALONE)
def test_what_is_right_is_left_alone(name: str) -> None:
    assert [
        step["text"] for one in examine([["a.py", LEFT_ALONE[name]]], [], {}, "") for step in one["steps"]
    ] == []


def test_what_others_import_is_not_run() -> None:
    text = "import rospy\ndef main():\n    rospy.init_node('a')\n    rospy.spin()\n"
    for start, count in (("", 1), ("import lab.node\n", 0), ("from lab import node\n", 0)):
        (own, _) = examine([["src/lab/node.py", text], ["scripts/run", start]], [], {}, "")
        assert len(own["steps"]) == count


STEERS = """\
import rospy
def scanned(scan):
    twist = Twist()
    if near(scan):
        twist.angular.z = {near}
    else:
        twist.angular.z = {far}
    if twist.angular.z > MOST:
        twist.angular.z = MOST
"""


@pytest.mark.parametrize(
    ("text", "side", "line"),
    [
        (STEERS.format(near="0.5", far="0"), "left", "twist.angular.z = -0.5"),
        (STEERS.format(near="0.5", far="0"), "right", ""),  # no line turns it to that side
        (STEERS.format(near="-0.5", far="0.5"), "right", "twist.angular.z = 0.5"),
        (STEERS.format(near="0.0", far="-K * error"), "left", "twist.angular.z = K * error"),
        (STEERS.format(near="0", far="K * error - D * change"), "right", "twist.angular.z = -(K * error - D * change)"),
        (STEERS.format(near="-math.pi / 4", far="0"), "right", "twist.angular.z = math.pi / 4"),
        (STEERS.format(near="0.5", far="K * error"), "left", ""),  # either of them
        (STEERS.format(near="0.5", far="K * error"), "", "twist.angular.z = -K * error"),
        (STEERS.format(near="0.5", far="0"), "", ""),
        (STEERS.format(near="turn", far="turn"), "left", ""),  # no line of this file sets it
        ("turn = 0\nif near:\n    turn = 0.3\ntwist.angular.z = turn\n", "left", "turn = -0.3"),
        ("p.publish(Twist(angular=Vector3(0, 0, 0.4)))\n", "left", "Vector3(0, 0, -0.4)"),
        ("twist.angular.x = 0.4\n", "left", ""),
        ("twist.angular.z = (\n", "left", ""),
    ],
)  # fmt: skip
def test_the_only_turn_to_a_side_gets_the_other_sign(tmp_path: Path, text: str, side: str, line: str) -> None:
    (tmp_path / "drive.py").write_text(text)
    found = turn_sign(tmp_path, "drive.py", side)
    assert (found is None) == (not line)
    assert found is None or line in found.after
