"""Repairs by examples, in one table: what is changed in a correct package, what is found, what the files are then."""

from __future__ import annotations

import ast
import re
import stat
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from grader.model.message_definitions import parse_definition
from grader.model.python_slip import PythonSlip, SlipKind
from grader.model.repair import BY_HAND, DEFAULT_SHARES, KINDS, advice_on
from grader.model.submission import chmod_hint
from grader.package.repairs import NotRepairable, Wanted, apply_repair, find_repairs
from grader.package.repairs.editing import changed_lines
from grader.package.repairs.names import is_near, is_one_edit
from tests.package.repairing import (
    CMAKE,
    CMAKELISTS,
    LAUNCH,
    LAUNCHED,
    MANIFEST,
    SCRIPT,
    TALKER,
    WANTED,
    XML,
    package,
    repair_all,
    swapped,
)
from tests.package.trees import facts_of

pytestmark = pytest.mark.usefixtures("without_processes")

INSTALL = """
catkin_install_python(
  PROGRAMS
    scripts/other.py
  DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})
"""
INSTALLS = Wanted(package="lab", installed=(TALKER, "src/listener.py"))
INSTALLED = {"src/listener.py": SCRIPT, "scripts/other.py": SCRIPT}
TWO_NODES = LAUNCH.replace("</launch>", LAUNCH.splitlines()[1].replace("talker", "listener") + "\n</launch>")
SPINS = """\
#!/usr/bin/env python3
import rospy
from std_msgs.msg import Int8

def listen():
    rospy.init_node('talker')
    rospy.Subscriber('numeric_chatter', Int8, print)

if __name__ == '__main__':
    listen()
"""
TWICE = "class A:\n    n = 1\n    def g(self, x): return x\n"
DEEPER = "        if late:\n            wait()\n"
OWN = {"msg/Level.msg": "float64 level\n", "src/level.py": "from lab.msg import Level\n"}
OWN_CMAKE = CMAKE.replace("rospy)\n", "message_generation rospy)\nadd_message_files(FILES Level.msg)\n")
RUN_OWN = {**OWN, TALKER: SCRIPT.replace("import Int8\n", "import Int8\nfrom lab.msg import Level\n")}
SERVICE = {**OWN, "srv/Two.srv": "int64 a\n---\n", "src/level.py": "from lab.srv import Two\n"}
SERVICE_CMAKE = CMAKE.replace(
    "rospy)\n", "message_generation rospy)\nadd_service_files(FILES Two.srv)\ngenerate_messages()\n"
)
ACTION_CMAKE = CMAKE.replace(
    "rospy)\n",
    """message_generation actionlib_msgs rospy)
add_action_files(FILES Go.action)
generate_messages(DEPENDENCIES actionlib_msgs std_msgs)
""",
)
GO_FIELDS = tuple(parse_definition("int32 n\n---\nbool there\n---\nint32 left\n", ".action"))
CPP_NODE = """\
void callback(const Int8& msg) { for (int i = 0; i < 3; ++i) use(msg); }
int main(int argc, char** argv) {
  ros::init(argc, argv, "a");
  auto sub = ros::NodeHandle().subscribe("scan", 10, callback);
  return 0;
}
"""
TEMPLATE = """\
# add_message_files(
#   FILES
#   Message1.msg
# )
# generate_messages(
#   DEPENDENCIES
#   std_msgs
# )"""
LEVELS = "a:\n  b:\n    x: 1\n  y: 2\n  c:\n    z: 3\n"


CONSTRUCTOR = """\
Node::Node() : n_(1)
{
  ros::Subscriber sub = nh_.subscribe("scan", 10, &Node::heard, this);
%s}
"""
OTHER = "rospy.Publisher('numeric_chatter2', Int8, queue_size=10)"


def asking(**more: object) -> Wanted:
    """Return what is wanted of the correct package, and more."""
    return WANTED.model_copy(update=more)


STARTED = asking(launch_files=("activity1.launch",), started=(("activity1.launch", "talker.py"),))
NESTED = asking(files=("config/my.yaml",), params=("/a/b/x", "/a/b/y", "/a/c/z"))


@dataclass(frozen=True)
class Case:
    """`changes` to the correct package, the kinds of repair found, a part of their words, and of the repaired files."""

    changes: dict[str, str | bytes | None]
    kinds: list[str]
    says: str = ""
    wanted: Wanted = WANTED
    after: dict[str, str] = field(default_factory=dict)


CASES = {
    "crlf": Case({TALKER: SCRIPT.replace("\n", "\r\n")}, ["line-ends"], "has Windows line endings"),
    "bom": Case({TALKER: b"\xef\xbb\xbf" + SCRIPT.encode()}, ["byte-order-mark"], "byte order mark"),
    "utf-16": Case({TALKER: SCRIPT.encode("utf-16")}, ["encoding"], "saved as UTF-16"),
    "latin-1": Case({TALKER: SCRIPT.replace("import rospy\n", "import rospy  # caf\u00e9\n").encode("latin-1")},
                ["encoding"], "not saved as UTF-8"),
    "no-shebang-and-a-slip": Case(
        swapped(TALKER, ("#!/usr/bin/env python3\n", ""), ("rospy.Publisher", "rospy.Publishr")),
        ["shebang", "missing-call"], "src/talker.py line 6: write `publisher = ", after={TALKER: SCRIPT},
    ),
    "no-shebang": Case(swapped(TALKER, ("#!/usr/bin/env python3\n", "")), ["shebang"], "cannot be started"),
    "shebang-blank": Case({TALKER: "\n" + SCRIPT}, ["shebang"], "`#!` comes on line 2"),
    "tabs-of-8": Case(swapped(TALKER, ("        publisher.pub", "\tpublisher.pub")), ["python-syntax"],
        "tabs and spaces"),
    "body-not-indented": Case(
        swapped(TALKER, ("\nmain()", "\nif __name__ == '__main__':\nmain()")),
        ["python-syntax"],
        "the line after a `:` must be indented",
    ),
    "pass-further-out": Case(
        swapped(TALKER, ("\nmain()", "\nif 1:\n    try:\n        main()\n    except Exception:\npass")),
        ["python-syntax"],
        "indent line 17 by 8 more spaces",
    ),
    "pass-at-no-level": Case(
        swapped(TALKER, ("\nmain()", "\nif 1:\n    try:\n        main()\n    except Exception:\n  pass  # no")),
        ["python-syntax"],
        "indent line 17 by 6 more spaces",
    ),
    "many-tabs": Case(
        swapped(TALKER, ("    rate = ", "".join(f"\ta{n} = {n}\n" for n in range(5)) + "    rate = ")),
        ["python-syntax"],
        "start lines 8 to 12 with 4 spaces",
    ),
    "further-in": Case(swapped(TALKER, ("    rate = ", "       rate = ")), ["python-syntax"],
        "line 8 of src/talker.py: t"),
    "all-further-in": Case(
        {TALKER: "#!/usr/bin/env python3\n" + "".join(f" {line}\n" for line in SCRIPT.split("\n")[1:-1] if line)},
        ["python-syntax"],
        "line 2 of src/talker.py: this line is indented further than the one above",
    ),
    "between-two-of-one-level": Case(
        swapped(TALKER, ("    rate = rospy", "count = 0\n    rate = rospy")),
        ["python-syntax"],
        "line 8 of src/talker.py: this line is indented less than the lines around it",
        after={TALKER: "    count = 0\n    rate = rospy"},
    ),
    "between-two-of-one-level-with-a-tab-below": Case(
        swapped(
            TALKER, ("    rate = rospy", "count = 0\n    rate = rospy"), ("        rate.sleep()", "\trate.sleep()")
        ),
        ["python-syntax"] * 2,
        "line 8 of src/talker.py: this line is indented less than the lines around it",
        after={TALKER: "    count = 0\n    rate = rospy"},
    ),
    "further-out-after-a-deeper-block": Case(
        swapped(TALKER, ("        rate.sleep()", f"{DEEPER}    a = 1\n    b = 2\n        rate.sleep()")),
        ["python-syntax"],
        "change the indentation: start lines 13 and 14 with 8 spaces",
        after={TALKER: "        a = 1\n        b = 2\n        rate.sleep()"},
    ),
    "head-commented-out": Case(
        swapped(TALKER, ("    while not", "   ## while not")),
        ["python-syntax"],
        "line 9: write `while not rospy.is_shutdown():`, with 4 spaces before it",
        after={TALKER: "    while not rospy"},
    ),
    "bracket-not-opened": Case(
        swapped(TALKER, ("publish(1)", "publish)1)")),
        ["python-syntax"],
        "line 10 of src/talker.py: there is one `)` too many",
        after={TALKER: "publisher.publish(1)"},
    ),
    "further-out": Case(
        swapped(TALKER, ("        rate.sleep()", "       rate.sleep()")),
        ["python-syntax"],
        "line 11 of src/talker.py",
    ),
    "tabs-of-4": Case(swapped(TALKER, ("    rate = ", "\trate = ")), ["python-syntax"],
        "line 8 of src/talker.py: tabs"),
    "print": Case(swapped(TALKER, ("        rate.sleep()", "        print 'a', 1\n        rate.sleep()")),
              ["python-syntax"], "line 11 of src/talker.py: `print` has no brackets, as in Python 2"),
    "colon": Case(swapped(TALKER, ("is_shutdown():", "is_shutdown()")), ["python-syntax"], "line 9"),
    "bracket": Case(swapped(TALKER, ("queue_size=10)", "queue_size=10")), ["python-syntax"], "never closed"),
    "quote": Case(swapped(TALKER, ("'talker')", "'talker)")), ["python-syntax"], "line 6 of src/talker.py: a quote"),
    "typographic": Case(swapped(TALKER, ("'talker'", "\u2018talker\u2019")), ["python-syntax"], "typographic quote"),
    "raw-input": Case(swapped(TALKER, ("    rospy.init", "    raw_input()\n    rospy.init")), ["python-syntax"],
        "raw_"),
    **{
        f"argument-{name}": Case(swapped(TALKER, *swaps), ["missing-call"] * kinds, says, after={TALKER: after})
        for name, (swaps, kinds, says, after) in {
            "type-in-quotes": ([("Int8, q", "'Int8', q")], 1, "the type is given as a string", "Int8, q"),
            "message": ([("Int8, q", "Int8(), q")], 1, "`Int8()` is a message, not a type", "Int8, q"),
            "order": ([("'numeric_chatter', Int8", "Int8, 'numeric_chatter'")], 1, "the topic's name comes first",
                      "('numeric_chatter', Int8"),
            "number": ([("size=10", "size='10'"), ("rospy.get_param('~rate', 10)", "'10'")], 2, "number, not a string",
                       "Rate(10)"),
            "of-sleep": ([("rate.sleep()", "rate.sleep(1)")], 1, "a Rate already knows", "rate.sleep()"),
            "without-quotes": ([("'talker'", "main")], 1, "the name of the node has no quotes", "node('main'"),
            "timer": ([("        rate.s", "        rospy.Timer(1 / 10, tick)\n        rate.s")], 1, "takes a Duration",
                      "rospy.Timer(rospy.Duration(1 / 10), tick)"),
            "of-a-log": ([("        rate.s", "        rospy.loginfo('a:', 1)\n        rate.s")], 1, "fewer `%`",
                         "rospy.loginfo('a: %s', 1)"),
            "text-for-a-number": ([("publish(1)", "publish(str(1))")], 1, "makes a string of it", "publish(1)"),
            "class": ([("\ndef main():", f"{TWICE}a = A\na.g(1)\ndef main():")], 1, "is the class itself", "a = A()"),
            "of-self": ([("\ndef main():", f"{TWICE}    def f(self): g(n)\ndef main():")], 1, "belongs to the class A",
                        "self.g(self.n)"),
            "callback": ([("\nmain()", "\nrospy.on_shutdown('main')\nmain()")], 1, "'main' is a string",
                         "down(main)"),
        }.items()
    },
    "variable-of-the-file": Case(
        swapped(
            TALKER,
            ("\ndef main():", "\nn = 0\n\ndef main():"),
            ("        rate.s", "        n += 1\n        rate.s"),
        ),
        ["missing-call"],
        "write `global n` as the first line of the function",
        after={TALKER: "def main():\n    global n\n"},
    ),
    "variable-of-a-callback": Case(
        swapped(TALKER, ("\ndef main():", "\nfront = None\n\ndef heard(msg):\n    front = msg.data\n\ndef main():"),
                        ("        rate.s", "        print(front)\n        rate.s")),
        ["missing-call"], "the function gives a value to a front of its own",
        after={TALKER: "def heard(msg):\n    global front\n    front = msg.data\n"},
    ),
    "variables-of-their-own": Case(
        {TALKER: SCRIPT, "src/own.py": "n = 0\ndef f(n):\n    n += 1\ndef g():\n    global n\n    n += 1\n"
         "def h():\n    n = 1\n    n += 1\ndef i():\n    for n in (1,): print(n)\ndef j():\n"
         "    def f(): return n\n    n = 1\ndef k():\n    n = 1\n"},
        [],
    ),
    "sleep": Case(swapped(TALKER, ("rate.sleep()", "rate.sleep")), ["missing-call"],
        "rate.sleep is named but not called"),
    "main": Case(swapped(TALKER, ("\nmain()", "\nmain")), ["missing-call"], "line 13"),
    "guard": Case(swapped(TALKER, ("\nmain()", "\nif __name__ == '_main_':\n    main()")),
              ["missing-call"], "is never '_main_'"),
    "no-main": Case(swapped(TALKER, ("\nmain()", "")), ["missing-call"], "nothing calls main()"),
    "callback": Case(swapped(TALKER, ("    rate = ", "    rospy.Subscriber('a', Int8, on_a())\n    rate = "),
                         ("\nmain()", "\ndef on_a(msg):\n    pass\n\n\nmain()")),
                 ["missing-call"], "on_a() is called where the function itself is meant"),
    "shutdown": Case(swapped(TALKER, ("    rate = ", "    rospy.on_shutdown(stop())\n    rate = "),
                             ("\nmain()", "\ndef stop():\n    print('over')\n\n\nmain()")),
                     ["missing-call"], "stop() is called where the function itself is meant"),
    "shutdown-made": Case(swapped(TALKER, ("    rate = ", "    rospy.on_shutdown(stop())\n    rate = "),
                                  ("\nmain()", "\ndef stop():\n    return print\n\n\nmain()")), []),
    "true": Case(swapped(TALKER, ("'talker')", "'talker', anonymous=true)")), ["missing-call"], "true is not defined",
                 after={TALKER: "anonymous=True"}),
    "letter-of-an-import": Case(swapped(TALKER, ("import Int8", "import Int88")),
                                ["missing-call"], "Int88 is not defined",
                                after={TALKER: "from std_msgs.msg import Int8"}),
    "guard-twice": Case(swapped(TALKER, ("\nmain()", "\nif _name_ == '_main_':\n    main()")),
                        ["missing-call"], "_name_ is not defined",
                        after={TALKER: "if __name__ == '__main__':"}),
    "letter": Case(swapped(TALKER, ("rospy.Rate(", "rospu.Rate(")), ["missing-call"], "rospu is not defined",
                   after={TALKER: "rospy.Rate("}),
    "letter-of-a-class": Case(swapped(TALKER, ("numeric_chatter', Int8", "numeric_chatter', Int88")), ["missing-call"],
                              "Int88 is not defined"),
    "letter-of-a-local": Case(swapped(TALKER, ("publisher.publish", "publiser.publish")), ["missing-call"],
                              "publiser is not defined", after={TALKER: "publisher.publish(1)"}),
    "name-of-two": Case(swapped(TALKER, ("    rate = ", "    publishes = 1\n    rate = "),
                                ("publisher.publish", "publishe.publish")), []),
    "name-that-is-caught": Case(swapped(TALKER, ("\nmain()", "\ntry:\n    null\nexcept NameError:\n    main()")), []),
    "name-of-another-kind": Case(swapped(TALKER, ("publish(1)", "publish(speed)")), []),
    "module": Case(swapped(TALKER, ("from std_msgs.msg", "from std_msg.msg")), ["missing-import"],
               "not imported from std_msg"),
    "no-msg": Case(swapped(TALKER, ("from std_msgs.msg", "from std_msgs")), ["missing-import"],
               "not imported from std_msgs"),
    "module-beside-messages": Case(
        swapped(TALKER, ("from std_msgs.msg import Int8",
                         "from sensor_msgs import point_cloud2\nfrom std_msgs.msg import Int8")), [],
    ),
    "class-imported": Case(swapped(TALKER, ("from std_msgs.msg import Int8", "import std_msgs.msg.Int8")),
                       ["missing-import"], "not imported from std_msgs.msg.Int8"),
    "braces": Case(swapped(TALKER, ("def main():", "def main() {"), ("\nmain()", "}\n\nmain()")), ["python-syntax"],
               "line 5 of src/talker.py: Python has no `{` and `}`"),
    "not": Case(swapped(TALKER, ("not rospy", "!rospy")), ["python-syntax"], "`and`, `or` and `not`"),
    "plus-plus": Case(swapped(TALKER, ("        rate.sleep()", "        n++;\n        rate.sleep();")),
        ["python-syntax"],
                  "line 11 of src/talker.py: Python has no `++`"),
    "indented-more": Case(swapped(TALKER, ("        rate.sleep()", "          rate.sleep()")), ["python-syntax"],
                      "indented further than the one above"),
    "terminal": Case(swapped(TALKER, ("import rospy\n", "$ chmod +x talker.py\nimport rospy\n")), ["python-syntax"],
                 "a command for the terminal"),
    "import": Case(swapped(TALKER, ("import Int8", "import String")), ["missing-import"], "talker.py uses Int8"),
    "leading-slash": Case(
        swapped(TALKER, ("'numeric_chatter'", "'/numeric_chatter'")), ["topic-name"],
        "the topic /numeric_chatter should be numeric_chatter, without the slash",
        asking(remapped=("numeric_chatter",)),
    ),
    "private-parameter": Case(
        swapped(TALKER, ("    rate = ", "    rospy.get_param('colour', 'red')\n    rate = ")), ["parameter-name"],
        "the parameter colour should be ~colour", asking(private=("colour",)),
    ),
    "topic-in-cpp": Case(
        {"src/a.cpp": '// advertise<Int8>("/other", 1)\npub = nh.advertise<std_msgs::Int8>("/men", 1);\n'},
        ["topic-name"], "line 2 of src/a.cpp: the topic /men should be /mean", asking(topics=("/mean",)),
        {"src/a.cpp": 'advertise<std_msgs::Int8>("/mean", 1);'},
    ),
    "private-service": Case(
        swapped(TALKER, ("    rate = ", "    rospy.Service('~estimate', Trigger, answer)\n    rate = ")),
        ["service-name"], "the service ~estimate should be /estimate", asking(servers=("/estimate",)),
        {TALKER: "rospy.Service('estimate', Trigger, answer)"},
    ),
    "service-asked-for": Case(
        swapped(TALKER, ("\nmain()", "\nrospy.wait_for_service('/estimat')\nrospy.ServiceProxy('/estimat')\nmain()")),
        ["service-name"], "the service /estimat should be /estimate",
        asking(clients=("/estimate",)), {TALKER: "rospy.ServiceProxy('/estimate')"},
    ),
    "service-in-cpp": Case(
        {"src/a.cpp": 'ros::ServiceServer server = nh.advertiseService("estimat", answer);\n'},
        ["service-name"], "line 1 of src/a.cpp: the service estimat should be /estimate",
        asking(servers=("/estimate",)), {"src/a.cpp": 'advertiseService("estimate", answer);'},
    ),
    "program-named-otherwise": Case(
        {"src/mean.cpp": "int main() {}\n",
         CMAKELISTS: f"{CMAKE}add_executable(mean_node src/mean.cpp)\ntarget_link_libraries(mean_node x)\n"},
        ["build-line"], "the program is called mean_node, and the lab wants mean", asking(scripts=("mean",)),
        {CMAKELISTS: "add_executable(mean src/mean.cpp)\ntarget_link_libraries(mean x)\n"},
    ),
    "no-spin-in-cpp": Case(
        {"src/a.cpp": CPP_NODE}, ["missing-call"], "src/a.cpp: below line 4 add `ros::spin();`",
        after={"src/a.cpp": CPP_NODE.replace("  return", "  ros::spin();\n  return")},
    ),
    "no-spin-and-no-return-in-cpp": Case(
        {"src/a.cpp": CPP_NODE.replace("  return 0;\n", "  // ros::spin();\n")}, ["missing-call"], "src/a.cpp",
        after={"src/a.cpp": "  // ros::spin();\n  ros::spin();\n}\n"},
    ),
    "subscriber-local-in-cpp": Case(
        {"src/a.cpp": CONSTRUCTOR % ""}, ["missing-call"],
        "line 3 of src/a.cpp: sub is a variable of the function Node, and the subscription ends with it",
        after={"src/a.cpp": "  static ros::Subscriber sub = nh_.subscribe"},
    ),
    "subscriber-copied-in-cpp": Case({"src/a.cpp": CONSTRUCTOR % "  sub_ = sub;\n"}, []),
    "subscriber-kept-by-a-loop-in-cpp": Case({"src/a.cpp": CONSTRUCTOR % "  ros::spin();\n"}, []),
    "subscriber-dropped-in-a-constructor": Case(
        {"src/a.cpp": (CONSTRUCTOR % "").replace("ros::Subscriber sub = ", "")}, ["missing-call"],
        "what subscribe(…) returns is dropped, and with it the subscription",
        after={"src/a.cpp": "  static ros::Subscriber sub = nh_.subscribe"},
    ),
    "topic-on-the-second-line-in-cpp": Case(
        {"src/a.cpp": 'void f(Q& q) {\n  q.s = nh.subscribe<std_msgs::Int8>(\n      "/numeric_chater", 10, f);\n}\n'},
        ["topic-name"], "line 3 of src/a.cpp: the topic /numeric_chater should be /numeric_chatter",
        after={"src/a.cpp": '      "/numeric_chatter", 10, f);\n'}),
    "subscriber-dropped-in-cpp": Case(
        {"src/a.cpp": CPP_NODE.replace("auto sub = ros::NodeHandle()", "nh").replace("  return 0", "  ros::spin()")},
        ["missing-call"], "line 4 of src/a.cpp: what subscribe(…) returns is dropped, and with it the subscription",
        after={"src/a.cpp": '  ros::Subscriber sub = nh.subscribe("scan", 10, callback);\n'},
    ),
    "loop-in-cpp": Case({"src/a.cpp": CPP_NODE.replace("  return", "  while (true) ros::spinOnce();\n  return")}, []),
    "import-capitals": Case(swapped(TALKER, ("import Int8", "import int8")), ["missing-call"], "int8"),
    "class-in-other-letters": Case(swapped(TALKER, ("Int8", "int8")), ["missing-call"], "int8"),
    "class-of-another-name": Case(
        swapped(TALKER, ("import Int8", "import Int8\nfrom turtlesim.msg import Int8Pose")), [],
    ),
    "class-misspelt-throughout": Case(swapped(TALKER, ("Int8", "Imt8")), ["missing-call"], "Imt8"),
    "import-ros": Case(swapped(TALKER, ("import rospy\n", "import ros\n")), ["missing-import"], "import rospy"),
    "module-of-messages": Case(swapped(TALKER, ("chatter', Int8", "chatter', geometry_msgs.msg.Twist")),
                               ["missing-import"], "uses geometry_msgs"),
    "no-rospy": Case(swapped(TALKER, ("import rospy\n", "")), ["missing-import"], "uses rospy"),
    "attribute": Case(swapped(TALKER, ("rospy.Publisher", "rospy.publisher")), ["missing-call"],
                  "there is no rospy.publisher"),
    "rospy-with-a-sign": Case(swapped(TALKER, ("rospy.init", "ros[y.init")), ["python-syntax"],
        "line 6 of src/talker.py"),
    "value-given": Case(swapped(TALKER, ("rospy.Rate(rospy.get_param('~rate', 10))", "rospy.rate=10")),
        ["missing-call"],
                    "rospy.Rate is given a value with `=`"),
    "global": Case(swapped(TALKER, ("        rate.sleep()", "        print(count)\n        global count"),
                       ("def main", "count = 0\ndef main")), ["python-syntax"], "`global count` comes after a line"),
    "global-outside": Case(swapped(TALKER, ("\nmain()", "\ncount = 0\nglobal count\nmain()")), ["python-syntax"],
                       "`global count` comes after a line that uses count"),
    "beside-a-global": Case(swapped(TALKER, ("def main():", "count = 0\ndef main():\n    global count"),
                                ("rate.sleep()", "rate.sleep")), ["missing-call"], "rate.sleep is named but not"),
    "include": Case(swapped(CMAKELISTS, ("catkin_package()", "catkin_package(\n  INCLUDE_DIRS include\n)")),
                ["build-line"], "line 4 of CMakeLists.txt: catkin_package(…) names the folder include/"),
    "topic": Case(swapped(TALKER, ("numeric_chatter", "numeric_chater")), ["topic-name"], "should be /numeric_chatter"),
    "node": Case(swapped(TALKER, ("'talker'", "'Talker'")), ["node-name"], "the node Talker should be talker"),
    "param": Case(swapped(TALKER, ("'~rate'", "'~rat'")), ["parameter-name"],
        "the parameter ~rat should be ~rate"),
    "type": Case(swapped(LAUNCHED, ("talker.py", "talker")), ["launch-type"], 'type="talker" should be'),
    "tag-open": Case(swapped(LAUNCHED, ("/>", ">")), ["launch-syntax"], "is still open where"),
    "no-quotes": Case(swapped(LAUNCHED, ('"talker.py"', "talker.py")), ["launch-syntax"], "has no quotes around it"),
    "tag-open-and-type": Case(swapped(LAUNCHED, ("/>", ">"), ("talker.py", "talker")),
                          ["launch-syntax", "launch-type"], 'type="talker" should be'),
    "pkg": Case(swapped(LAUNCHED, ('pkg="lab"', 'pkg="laab"')), ["package-name"], 'pkg="laab" should be'),
    "manifest-name": Case(swapped(XML, (">lab<", ">lab_<")), ["package-name"], "the package is called lab_"),
    "own-name": Case({XML: MANIFEST.replace(">lab<", ">mine<"), CMAKELISTS: CMAKE.replace("lab", "mine")},
                 ["package-name"], "the package is called mine, not lab"),
    "folder-launched": Case({XML: MANIFEST.replace(">lab<", ">our_lab<"),
                         CMAKELISTS: CMAKE.replace("lab", "our_lab")},
                        ["package-name"], "the package is called our_lab, not lab"),
    "no-buildtool": Case(swapped(XML, ("  <buildtool_depend>catkin</buildtool_depend>\n", "")),
                     ["manifest-line"], "does not name catkin"),
    "no-depend": Case(swapped(XML, ("  <depend>rospy</depend>\n", "")), ["manifest-line"], "does not name rospy"),
    "open-tag": Case(swapped(XML, ("x</description>", "x")), ["manifest-line"], "`<description>` on line 4 is still"),
    "no-find": Case(swapped(CMAKELISTS, ("find_package", "# find_package")), ["build-line"], "not call find_package"),
    "no-catkin-package": Case(swapped(CMAKELISTS, ("catkin_package()\n", "")), ["build-line"], "catkin_package()"),
    "command": Case(swapped(CMAKELISTS, ("catkin_package", "catkin_pakage")), ["build-line"], "no command catkin_p"),
    "project": Case(swapped(CMAKELISTS, ("project(lab)", "project(xyz)")), ["build-line"], "project(xyz)"),
    "no-project": Case(swapped(CMAKELISTS, ("project(lab)\n", "")), ["build-line"], "does not call project(…)"),
    "modules-in-find-package": Case(
        {CMAKELISTS: CMAKE.replace("rospy)", "mediapipe rospy numpy serial)")}, ["build-line"],
        "line 3 of CMakeLists.txt: find_package(…) names mediapipe and numpy, and no package of ROS is called so",
        after={CMAKELISTS: " rospy  serial)"},
    ),
    "late-project": Case(
        {CMAKELISTS: CMAKE.replace("project(lab)\n", "") + "project(lab)\n"},
        ["build-line"],
        "project(…) is called after catkin_package(…)",
    ),
    "open-bracket": Case(swapped(CMAKELISTS, ("catkin_package()", "catkin_package(")), ["build-line"], "is never"),
    "cmake-name": Case({CMAKELISTS: None, "CMakelists.txt": CMAKE}, ["file-name"], "should be called CMakeLists.txt"),
    "script-name": Case({TALKER: None, "src/talkr.py": SCRIPT}, ["file-name"], "should be called talker.py"),
    "no-suffix": Case({TALKER: None, "src/talker": SCRIPT}, ["file-name"], "should be called talker.py"),
    "installed-below-programs": Case(
        {CMAKELISTS: CMAKE + INSTALL, **INSTALLED}, ["build-line"],
        "CMakeLists.txt line 7: write src/listener.py src/talker.py after PROGRAMS", INSTALLS,
        {CMAKELISTS: "scripts/other.py"},
    ),
    "installed-in-place-of-what-is-not-there": Case(
        {CMAKELISTS: CMAKE + INSTALL.replace("scripts/other.py", "bin/hello"), **INSTALLED}, ["build-line"],
        "CMakeLists.txt line 8: write src/listener.py src/talker.py in place of bin/hello", INSTALLS,
    ),
    "installed-beside-one-that-lies-elsewhere": Case(
        {CMAKELISTS: CMAKE + INSTALL.replace("scripts/other.py", "scripts/a.py"), **INSTALLED,
         "scripts/old/a.py": INSTALLED["scripts/other.py"]}, ["build-line", "build-line"],
        "CMakeLists.txt line 7: write src/listener.py src/talker.py after PROGRAMS", INSTALLS,
    ),
    "installed-in-another-place": Case(
        {CMAKELISTS: CMAKE + INSTALL.replace("_BIN_", "_SHARE_"), **INSTALLED}, ["build-line"],
        "write catkin_install_python(PROGRAMS src/listener.py src/talker.py DESTINATION ${CATKIN_PACKAGE_BIN_DEST",
        INSTALLS, {CMAKELISTS: INSTALL.replace("_BIN_", "_SHARE_")},
    ),
    "installed-no-dollar": Case(
        {CMAKELISTS: CMAKE + INSTALL.replace("$", "").replace("scripts/other.py", "src/talker.py src/listener.py"),
         **INSTALLED},
        ["build-line"], "CMakeLists.txt line 9: write `DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION}", INSTALLS,
    ),
    "installed-misspelt": Case(
        {CMAKELISTS: CMAKE + INSTALL.replace("scripts/other.py", "src/talker src/listener"), **INSTALLED},
        ["build-line"],
        "CMakeLists.txt line 8: write `src/talker.py src/listener.py`",
        INSTALLS,
    ),
    "line-ends-that-do-no-harm": Case(
        {CMAKELISTS: CMAKE.replace("(lab)", "(xyz)").replace("\n", "\r\n")}, ["build-line"],
        after={CMAKELISTS: CMAKE.replace("\n", "\r\n")},
    ),
    "name-where-it-is-written": Case(
        {**swapped(LAUNCHED, ("talker.py", "talkr.py")), TALKER: None, "src/talkr.py": SCRIPT,
         CMAKELISTS: CMAKE + "catkin_install_python(PROGRAMS src/talkr.py DESTINATION x)\n"},
        ["file-name"],
        "git mv src/talkr.py src/talker.py, and write talker.py in CMakeLists.txt and launch/lab.launch",
        after={CMAKELISTS: "PROGRAMS src/talker.py", LAUNCHED: LAUNCH},
    ),
    "key-of-a-map": Case(swapped(TALKER, ("publish(1)", "publish(rospy.get_param('details')['Name'])")),
                         ["parameter-name"], "the parameter Name should be name",
                         after={TALKER: "['name']"}),
    "key-beside-the-right-one": Case(swapped(TALKER, ("publish(1)", "publish(all['Name'] + all['name'])"),
                                             ("    rate =", "    all = rospy.get_param('details')\n    rate =")), []),
    "key-that-no-file-has": Case(
        {"config/my.yaml": 'details:\n  name: "Ada"\n',
         **swapped(TALKER, ("publish(1)", "publish(all['namme'] + all['name'])"),
                   ("    rate =", "    all = rospy.get_param('details')\n    rate ="))},
        ["parameter-name"], "the parameter namme should be name", after={TALKER: "all['name'] + all['name']"},
    ),
    "key-of-a-file": Case(
        {"config/my.yaml": 'details:\n  name: "Ada"\n  names: 3\n',
         **swapped(TALKER, ("publish(1)", "publish(all['names'] + all['name'])"),
                   ("    rate =", "    all = rospy.get_param('details')\n    rate ="))}, []),
    "yaml-tab": Case({"config/my.yaml": "a:\n  b:\n    x: 1\n\ty: 2\n  c:\n    z: 3\n"}, ["yaml-syntax"],
                     "config/my.yaml line 4: begin the line with 4 spaces", wanted=NESTED,
                     after={"config/my.yaml": "    x: 1\n    y: 2\n"}),
    "yaml-tabs": Case({"config/my.yaml": "a:\n\tb:\n\t\tx: 1\n\t\ty: 2\n\tc:\n\t\tz: 3\n"}, ["yaml-syntax"],
                      "line 2 of config/my.yaml is indented with a tab", wanted=NESTED,
                      after={"config/my.yaml": "  b:\n    x: 1\n"}),
    "yaml-quote": Case({"config/my.yaml": 'a:\n  x: "1  # one\n  y: 2\n'}, ["yaml-syntax"],
                       'line 2 of config/my.yaml opens " and does not close it', wanted=NESTED,
                       after={"config/my.yaml": '  x: "1"  # one\n'}),
    "yaml-column": Case({"config/my.yaml": "a:\n  b:\n    x: 1\n    y: 2\n   c:\n    z: 3\n"}, ["yaml-syntax"],
                        "line 5 of config/my.yaml does not line up", wanted=NESTED,
                        after={"config/my.yaml": "\n  c:\n    z: 3\n"}),
    "yaml-two-lines": Case({"config/my.yaml": "a:\n  b\n    x: 1\n    y:2\n"}, ["yaml-syntax", "yaml-syntax"],
                           "line 2 of config/my.yaml has no `:` after its name", wanted=NESTED,
                           after={"config/my.yaml": "  b:\n    x: 1\n    y: 2\n"}),
    "yaml-loaded-by-a-launch-file": Case(
        {"config/a.yaml": "x 1\n",
         **swapped(LAUNCHED, ("</launch>", '<rosparam command="load" file="$(find lab)/config/a.yaml"/>\n</launch>'))},
        ["yaml-syntax"], "line 1 of config/a.yaml has no `:`", after={"config/a.yaml": "x: 1\n"}),
    "yaml-that-nothing-names": Case({"config/other.yaml": "x 1\ny 2\n"}, []),
    "yaml-of-another-kind": Case({"config/my.yaml": "a: {b: [1, 2\n"}, [], wanted=NESTED),
    "yaml-that-is-right": Case({"config/my.yaml": "a:\n  b:\n    x: 1  # it's\n"}, [], wanted=NESTED),
    "key-with-two-colons": Case(
        {"config/my.yaml": 'details:\n  name:: "Ada"\n'}, ["parameter-name"], "the key name: should be name",
        wanted=asking(files=("config/my.yaml",)), after={"config/my.yaml": '  name: "Ada"\n'}),
    "own-package-misspelt": Case(
        {**OWN, **swapped(TALKER, ("import Int8\n", "import Int8\nfrom alb.msg import Level\n")), CMAKELISTS: OWN_CMAKE,
         XML: MANIFEST.replace("rospy</depend>", "rospy</depend><build_depend>message_generation</build_depend>")},
        ["build-line", "missing-import"], "there is no package alb", after={TALKER: "from lab.msg import Level"}),
    "exported-by-a-slip-of-its-name": Case(
        {CMAKELISTS: CMAKE.replace("catkin_package()", "catkin_package(CATKIN_DEPENDS Rospy)")}, ["build-line"],
        "write rospy instead of Rospy", after={CMAKELISTS: "CATKIN_DEPENDS rospy)", XML: MANIFEST}),
    "component-by-a-slip-of-its-name": Case(
        {**RUN_OWN, CMAKELISTS: OWN_CMAKE.replace("message_generation", "messaeg_generation").replace(
            "catkin_package", "generate_messages()\ncatkin_package")}, ["build-line"],
        "write message_generation instead of messaeg_generation",
        after={CMAKELISTS: "COMPONENTS message_generation rospy)"}),
    "installs-what-is-not-there": Case(
        {CMAKELISTS: CMAKE + "catkin_install_python(PROGRAMS src/talker.py bin/hello DESTINATION x)\n"}, ["build-line"],
        "add bin/hello and push it, or remove it from that call",
        after={CMAKELISTS: CMAKE + "catkin_install_python(PROGRAMS src/talker.py DESTINATION x)\n"}),
    "installs-nothing-that-is-there": Case(
        {CMAKELISTS: CMAKE + "catkin_install_python(PROGRAMS bin/hello DESTINATION x)\n"}, ["build-line"],
        "add bin/hello and push it", after={CMAKELISTS: CMAKE}),
    "program-without-its-source": Case(
        {CMAKELISTS: CMAKE + "add_executable(other src/other.cpp)\ntarget_link_libraries(other x)\n"}, ["build-line"],
        "add src/other.cpp and push it, or delete what is built from it: the calls on lines 5 and 6",
        after={CMAKELISTS: CMAKE}),
    "installs-what-the-lab-asks-for-and-is-not-there": Case(
        {CMAKELISTS: CMAKE + "catkin_install_python(PROGRAMS src/listener.py DESTINATION x)\n"}, [],
        wanted=asking(scripts=(TALKER, "src/listener.py"))),
    "script-with-two-slashes": Case(
        {CMAKELISTS: CMAKE + "catkin_install_python(PROGRAMS src//talker.py DESTINATION "
         "${CATKIN_PACKAGE_BIN_DESTINATION})\n"}, [], wanted=asking(installed=(TALKER,))),
    "find": Case(swapped(LAUNCHED, ("</launch>", '  <rosparam file="$(find labb)/a.yaml"/>\n</launch>')),
                 ["package-name"], "$(find labb) should be $(find lab)", after={LAUNCHED: "$(find lab)/a.yaml"}),
    "find-of-another": Case(swapped(LAUNCHED, ("</launch>", '<rosparam file="$(find rospy)/a.yaml"/>\n</launch>')), []),
    "key-where-it-is-written-and-read": Case(
        {"config/my.yaml": 'details:\n  Name: "Ada"\n',
         **swapped(TALKER, ("    rate = ", "    name = rospy.get_param('details')['Name']\n    rate = "))},
        ["parameter-name", "parameter-name"], wanted=asking(files=("config/my.yaml",)),
        after={"config/my.yaml": 'details:\n  name: "Ada"\n', TALKER: "['name']"},
    ),
    "key-one-level-too-far-left": Case(
        {"config/my.yaml": LEVELS}, ["parameter-name"], wanted=NESTED,
        after={"config/my.yaml": LEVELS.replace("\n  y", "\n    y")},
    ),
    "key-of-which-level": Case(
        {"config/my.yaml": "a:\n  b:\n    x: 1\n  c:\n    z: 3\n  y: 2\n"}, [], wanted=NESTED,
        after={"config/my.yaml": "\n  y"},
    ),
    "key-at-its-level": Case({"config/my.yaml": LEVELS.replace("\n  y", "\n    y")}, [], wanted=NESTED),
    "dots-for-slashes": Case(
        swapped(TALKER, ("    rate = ", "    name = rospy.get_param('details.name')\n    rate = ")), ["parameter-name"],
        "the parameter details.name should be /details/name", after={TALKER: "get_param('details/name')"},
    ),
    "dots-where-the-next-line-reads-a-key": Case(
        swapped(TALKER, ("    rate = ", "    d = rospy.get_param('details.name')\n    print(d['name'])\n    rate = ")),
        ["parameter-name"], "the parameter details.name should be /details", after={TALKER: "get_param('details')"},
    ),
    "names-without-quotes": Case(
        swapped(TALKER, ("'numeric_chatter'", "numeric_chatter"), ("'talker'", "talker")), ["missing-call"],
        "quotes are missing around talker, numeric_chatter", after={TALKER: "Publisher('numeric_chatter', Int8"},
    ),
    "keys-without-quotes": Case(
        swapped(TALKER, ("    rate = ", "    all = rospy.get_param('details')\n    name = all[name]\n    rate = ")),
        ["missing-call"], "quotes are missing around name", after={TALKER: "name = all['name']"},
    ),
    "keys-that-are-variables": Case(
        swapped(TALKER, ("    rate =", "    d = rospy.get_param('details')\n    for k in d: print(d[k])\n    rate =")),
        [],
    ),
    "name-like-that-of-a-variable": Case(
        swapped(TALKER, ("'talker'", "noode"), ("def main():", "def main():\n    node = 'talker'")), ["missing-call"],
        after={TALKER: "init_node(node)"},
    ),
    "name-of-a-variable": Case(
        swapped(TALKER, ("'numeric_chatter', Int8", "topic, Int8"), ("main():", "main(topic='numeric_chatter'):")), [],
    ),
    "call-in-quotes": Case(swapped(TALKER, ("rate.sleep()", "'rate.sleep()'")), ["missing-call"],
                           "rate.sleep() is in quotes", after={TALKER: "        rate.sleep()"}),
    "type-that-is-imported": Case(swapped(TALKER, ("'numeric_chatter', Int8", "'numeric_chatter', Int16")),
                                  ["missing-call"], "Int16 is not defined", after={TALKER: "'numeric_chatter', Int8"}),
    "try-missing": Case(
        {TALKER: SCRIPT.replace("\nmain()", "\nif 1:\n        main()\n    except rospy.ROSException:\n        pass")},
        ["python-syntax"],
        "below line 13 add `try:`, with 4 spaces before it",
    ),
    "except-without-pass": Case(
        {TALKER: SCRIPT.replace("\nmain()", "\ntry:\n    main()\nexcept rospy.ROSException:")},
        ["python-syntax"],
        "add `pass`, with 4 spaces before it",
    ),
    "except-missing": Case(
        {TALKER: SCRIPT.replace("\nmain()", "\ntry:\n    main()\n    pass")},
        ["python-syntax"],
        "the line `except rospy.ROSInterruptException:` is missing",
    ),
    "function-without-first-line": Case(
        swapped(TALKER, ("def main():\n", "")), ["python-syntax"], "the line `def main():` is missing"
    ),
    "callback-without-first-line": Case(
        {TALKER: SPINS.replace("\ndef listen", "\n    print(m.data)\n\ndef listen").replace("print)", "heard)")},
        ["python-syntax", "missing-call"],
        "the line `def heard(m):` is missing",
    ),
    "second-function-without-first-line": Case(
        {TALKER: SPINS.replace("def listen():", "def heard(m):\n    print(m)\n\n").replace("print)", "heard)")},
        ["missing-call", "missing-call"],
        "add `def listen():`",
    ),
    "own-part-without-first-line": Case(
        {TALKER: SPINS.replace("\nif __name__ == '__main__':\n    listen()", "\n\n    listen()")},
        ["missing-call", "missing-call"],
        "add `if __name__ == '__main__':`",
    ),
    "call-without-first-line": Case(
        swapped(CMAKELISTS, ("find_package(catkin REQUIRED COMPONENTS rospy)", "  rospy\n)")),
        ["build-line"],
        "add `find_package(catkin REQUIRED COMPONENTS`",
    ),
    "bracket-in-the-middle": Case(
        swapped(CMAKELISTS, ("catkin_package()", "catkin_package(\n\ninclude_directories(${catkin_INCLUDE_DIRS})")),
        ["build-line"],
        "write `catkin_package()`",
    ),
    "no-destination": Case(
        swapped(CMAKELISTS, ("catkin_package()", "catkin_package()\ncatkin_install_python(PROGRAMS src/talker.py)")),
        ["build-line"],
        "catkin_install_python(…) has no DESTINATION",
        wanted=asking(installed=(TALKER,)),
    ),
    "no-version": Case(
        {XML: re.sub(r"<version>.*</version>\n?", "", MANIFEST)}, ["manifest-line"], "add `<version>0.0.0</version>`"
    ),
    "launch-not-opened": Case(
        {LAUNCHED: LAUNCH.replace("<launch>\n", "")}, ["launch-syntax"], "`<launch>` is missing"
    ),
    "spin": Case({TALKER: SPINS}, ["missing-call"], after={TALKER: "Int8, print)\n    rospy.spin()\n"}),
    "launch-file-by-what-it-starts": Case(
        {LAUNCHED: None, "src/trial.launch": LAUNCH}, ["file-name"], wanted=STARTED,
        after={"src/activity1.launch": LAUNCH},
    ),
    "launch-file-and-its-type": Case(
        {LAUNCHED: None, "src/trial.launch": LAUNCH.replace("talker.py", "talker")}, ["file-name", "launch-type"],
        wanted=STARTED, after={"src/activity1.launch": LAUNCH},
    ),
    "launch-file-of-a-misspelt-script": Case(
        {TALKER: None, "src/talkr.py": SCRIPT, LAUNCHED: None,
         "src/trial.launch": LAUNCH.replace("talker.py", "talkr.py")},
        ["file-name", "file-name"], wanted=STARTED, after={"src/activity1.launch": LAUNCH},
    ),
    "launch-file-of-something-else": Case(
        {LAUNCHED: None, "src/trial.launch": LAUNCH.replace("talker.py", "signals.py")}, [], wanted=STARTED,
    ),
    "which-of-two-launch-files": Case({"launch/first.launch": LAUNCH}, [], wanted=STARTED),
    "package-twice-in-a-renamed-launch-file": Case(
        {LAUNCHED: None, "launch/la_b.launch": TWO_NODES.replace('pkg="lab"', 'pkg="laab"')},
        ["file-name", "package-name"], 'write pkg="lab" instead of pkg="laab"', asking(launch_files=("lab.launch",)),
        {LAUNCHED: TWO_NODES},
    ),
    "two-nodes-of-nearly-one-name": Case(
        {LAUNCHED: TWO_NODES.replace('"talker"', '"talker1"').replace('"listener"', '"talker2"')},
        ["node-name"], 'name="talker1" should be name="talker"', after={LAUNCHED: 'name="talker2"'},
    ),
    "half-a-comment": Case(
        {CMAKELISTS: CMAKE.replace("catkin_package()", "# catkin_package(\n)")}, ["build-line"],
        "remove the `#` on line 4", after={CMAKELISTS: "\ncatkin_package(\n)"},
    ),
    "program-without-libraries": Case(
        {CMAKELISTS: CMAKE + "add_executable(mean src/mean.cpp)\n", "src/mean.cpp": "int main() {}\n"}, ["build-line"],
        "below line 5 add `target_link_libraries(mean ${catkin_LIBRARIES})`",
    ),
    "run-dependency": Case(
        {CMAKELISTS: CMAKE.replace("package()", "package(CATKIN_DEPENDS rospy message_runtime)")}, ["manifest-line"],
        "names message_runtime", after={XML: "  <exec_depend>message_runtime</exec_depend>"},
    ),
    "own-message": Case(
        {**RUN_OWN, CMAKELISTS: CMAKE}, ["build-line"] * 3, "write message_generation after COMPONENTS",
        after={CMAKELISTS: OWN_CMAKE.replace("\ncatkin_p", "\ngenerate_messages()\ncatkin_p")},
    ),
    "own-message-that-nothing-uses": Case({**SERVICE, CMAKELISTS: SERVICE_CMAKE}, [], ""),
    "own-message-in-a-service": Case(
        {**SERVICE, "srv/Two.srv": "Level[] a\n---\n", CMAKELISTS: SERVICE_CMAKE}, ["build-line"],
        "add `add_message_files(FILES Level.msg)`",
    ),
    "own-message-of-the-template": Case(
        {**RUN_OWN, CMAKELISTS: CMAKE.replace("catkin_p", f"{TEMPLATE}\ncatkin_p")}, ["build-line"] * 3,
        "lines 8 to 11; CMakeLists.txt: in place of lines 4 to 7 write add_message_files(FILES Level.msg)",
    ),
    "own-message-of-another-exercise": Case({**OWN, CMAKELISTS: CMAKE}, []),
    "own-message-of-another-exercise-beside-one-that-is-made": Case(
        {**RUN_OWN, "msg/Tilt.msg": "float64 tilt\n", "src/tilt.py": "from lab.msg import Tilt\n",
         CMAKELISTS: OWN_CMAKE.replace("catkin_p", "generate_messages()\ncatkin_p")}, [],
    ),
    "own-message-beside-one-that-is-made": Case(
        {**RUN_OWN, "msg/Tilt.msg": "float64 tilt\n", "msg/Level.msg": "Tilt[] level\n",
         CMAKELISTS: OWN_CMAKE.replace("catkin_p", "generate_messages()\ncatkin_p")},
        ["build-line"], "write Tilt.msg after FILES",
    ),
    "own-message-of-another-exercise-that-the-build-asks-for": Case(
        {**OWN, CMAKELISTS: f"{CMAKE}add_dependencies(talker lab_generate_messages_cpp)\n"}, ["build-line"] * 3,
    ),
    "own-message-after-package": Case(
        {**OWN, CMAKELISTS: OWN_CMAKE + "generate_messages(\n)\n"}, ["build-line"],
        "move generate_messages(…), from line 6, above catkin_package(…)",
    ),
    "own-service-behind-generation": Case(
        {**SERVICE, CMAKELISTS: CMAKE.replace(
            "rospy)\n", "message_generation rospy)\ngenerate_messages()\nadd_service_files(\n  FILES Two.srv)\n")},
        ["build-line"], "move add_service_files(…), from line 5, above generate_messages(…)",
        after={CMAKELISTS: "add_service_files(\n  FILES Two.srv)\n\ngenerate_messages()\ncatkin_package()"},
    ),
    "own-service-called-a-message": Case(
        {**SERVICE, CMAKELISTS: SERVICE_CMAKE.replace("service_files", "message_files")},
        ["build-line"], "write add_service_files instead of add_message_files",
        after={CMAKELISTS: "add_service_files(FILES Two.srv)"},
    ),
    "own-service-with-two-dashes": Case(
        {**SERVICE, "srv/Two.srv": "int64 a\n--\nint64 b\n", CMAKELISTS: SERVICE_CMAKE},
        ["build-line"], "line 2 does not divide its parts: that takes three of `-`",
        after={"srv/Two.srv": "int64 a\n---\nint64 b\n"},
    ),
    "own-message-named-otherwise": Case(
        {**OWN, CMAKELISTS: OWN_CMAKE.replace("Level", "level").replace("catkin_p", "generate_messages()\ncatkin_p")},
        ["build-line"], "write Level.msg instead of level.msg",
    ),
    "own-message-of-another": Case(
        {**OWN, "msg/Level.msg": "Header header\ngeometry_msgs/Point at\n",
         CMAKELISTS: OWN_CMAKE.replace("catkin_p", "generate_messages(DEPENDENCIES std_msgs)\ncatkin_p")},
        ["build-line"] * 2, "write geometry_msgs after DEPENDENCIES",
        after={CMAKELISTS: "DEPENDENCIES geometry_msgs std"},
    ),
    "messages-of-no-definition": Case(
        {CMAKELISTS: CMAKE.replace("catkin_p", "generate_messages(DEPENDENCIES std_msgs)\ncatkin_p")}, ["build-line"],
        "delete line 4, generate_messages(…)", after={CMAKELISTS: "rospy)\ncatkin_package()"},
    ),
    "program-that-does-not-wait-for-its-header": Case(
        {**OWN, "src/mean.cpp": '#include "lab/Level.h"\nint main() {}\n',
         CMAKELISTS: OWN_CMAKE.replace("catkin_p", "generate_messages()\ncatkin_p")
         + "add_executable(mean src/mean.cpp)\ntarget_link_libraries(mean ${catkin_LIBRARIES})\n"},
        ["build-line"],
        "below the add_executable(…) on line 7, write add_dependencies(mean ${${PROJECT_NAME}_EXPORTED_TARGETS})",
        after={CMAKELISTS: ".cpp)\nadd_dependencies(mean ${${PROJECT_NAME}_EXPORTED_TARGETS})\ntarget"},
    ),
    "own-action-without-its-messages": Case(
        {"src/go.py": "from lab.msg import GoAction\n", "action/Go.action": "int32 n\n---\nint32 n\n---\nint32 n\n",
         CMAKELISTS: ACTION_CMAKE.replace("actionlib_msgs std", "std")},
        ["build-line"], "write actionlib_msgs after DEPENDENCIES",
    ),
    "own-action-in-another-order": Case(
        {"src/go.py": "from lab.msg import GoAction\n",
         "action/Go.action": "int32 n  # how far\n---\nint32 left\n---\nbool there\n",
         CMAKELISTS: ACTION_CMAKE},
        ["build-line"], "result and feedback have changed places",
        asking(definitions=(("action/Go.action", GO_FIELDS),)),
        {"action/Go.action": "int32 n  # how far\n---\nbool there\n---\nint32 left\n"},
    ),
    "own-message-of-no-type": Case(
        {**OWN, "msg/Level.msg": "Float64 level\n",
         CMAKELISTS: OWN_CMAKE.replace("catkin_p", "generate_messages()\ncatkin_p")},
        ["build-line"], "write `float64 level`",
    ),
    "manifest-of-rosbuild": Case(
        swapped(TALKER, ("import rospy\n", "import rospy\nimport roslib; roslib.load_manifest('old_lab')\n")),
        ["missing-import"], "delete line 3", after={TALKER: "import rospy\n\nfrom"},
    ),
    "manifest-of-rosbuild-that-is-there": Case(
        swapped(TALKER, ("import rospy\n", "import rospy\nimport roslib; roslib.load_manifest('lab')\n")), [],
    ),
    "cmake-of-a-workspace": Case({CMAKELISTS: "project(Project)\nfind_package(catkin)\ncatkin_workspace()\n"}, []),
    "project-and-package-of-other-names": Case(
        {CMAKELISTS: CMAKE.replace("project(lab)", "project(other)"), XML: MANIFEST.replace(">lab<", ">lessons<"),
         LAUNCHED: LAUNCH.replace('"lab"', '"lessons"')},
        ["build-line"], "write project(lab) here, and <name>lab</name> in package.xml",
    ),
    "own-message-of-no-use": Case({"msg/Level.msg": "float64 level\n"}, []),
    "another-topic": Case(swapped(TALKER, ("'numeric_chatter'", "'numbers'")), []),
    "another-node": Case(swapped(TALKER, ("'talker'", "'my_node'")), []),
    "import-of-everything": Case(swapped(TALKER, ("import Int8", "import *")), []),
    "sleep-with-an-argument": Case(
        swapped(TALKER, ("rate.sleep()", "rate.sleep(0.5")), ["python-syntax", "missing-call"],
        after={TALKER: "rate.sleep()"},
    ),
    "topics-that-are-all-near": Case(
        swapped(TALKER, ("    publisher = ", f"    {OTHER}\n    publisher = "),
                ("'numeric_chatter'", "'numeric_chatter1'")), []),
    "topic-of-another-role": Case(
        swapped(TALKER, ("    publisher = ", "    rospy.Subscriber('numeric_chater', Int8, print)\n    publisher = "),
                ("'numeric_chatter'", "'numeric_chattr'")), ["topic-name"], "numeric_chattr should be /numeric_chatter",
        wanted=asking(does=(("src/talker.py", "publisher", "/numeric_chatter"),))),
    "two-on-one-line": Case(
        swapped(TALKER, ("std_msgs.msg import Int8", "std_msg.msg import int8")), ["missing-import", "missing-call"],
        "messages are not imported from std_msg.msg", after={TALKER: "from std_msgs.msg import Int8"},
    ),
    "underscores-lost": Case(
        swapped(TALKER, ("\nmain()", "\nif name == 'main':\n    main()")), ["missing-call"],
        "write `if __name__ == '__main__':`", after={TALKER: "\nif __name__ == '__main__':\n    main()"},
    ),
    "name-that-is-no-guard": Case(swapped(TALKER, ("\nmain()", "\nif name == 'talker':\n    main()")), []),
    "script-called-by-another-word": Case(
        {TALKER: None, "src/numeric_pub.py": SCRIPT.replace("'talker'", "'counter'")}, ["file-name"],
        "src/numeric_pub.py should be called talker.py",
        wanted=asking(does=((TALKER, "publisher", "/numeric_chatter"), (TALKER, "node-name", "talker"))),
    ),
    "encoding-of-no-name": Case(
        swapped(TALKER, ("import rospy\n", "# -*- coding: uft-8 -*-\nimport rospy\n")), ["python-syntax"],
        "line 2 of src/talker.py: Python knows no encoding uft-8", after={TALKER: "# -*- coding: utf-8 -*-\n"},
    ),
    "message-and-module-imported-at-once": Case(
        swapped(TALKER, ("import rospy\nfrom std_msgs.msg import Int8\n", "import rospy, std_msgs.msg.Int8\n")),
        ["missing-import"], "messages are not imported from std_msgs.msg.Int8", after={TALKER: SCRIPT},
    ),
    "method-of-the-class-itself": Case(
        swapped(TALKER, ("def main():", "class T:\n    def half():\n        return 5\n\ntool = T()\n\ndef main():"),
                ("publish(1)", "publish(T.half())")), [],
    ),
    "method-of-the-name-of-a-function-of-rospys": Case(
        swapped(TALKER, ("def main():", "class T:\n    def sleep():\n        return 5\n\ntool = T()\n\ndef main():"),
                ("publish(1)", "publish(T.sleep())")), [],
    ),
    "method-that-makes-a-number-of-an-object": Case(
        swapped(TALKER, ("def main():", "class T:\n    def __int__(self):\n        return 5\n\nt = T()\n\ndef main():"),
                ("publish(1)", "publish(int(t))")), [],
    ),
    "spin-outside-of-its-function": Case(
        {TALKER: "import rospy\nfrom std_msgs.msg import Int8\n\ndef main():\n    rospy.init_node('talker')\n"
                 "    rospy.Subscriber('numeric_chatter', Int8, print)\nrospy.spin()\n\nmain()\n"},
        ["shebang", "missing-call"], "start line 7 with 4 spaces", after={TALKER: "print)\n    rospy.spin()\n"},
    ),
    "loop-outside-of-its-function": Case(
        swapped(TALKER, ("    while", "while"), ("        pub", "    pub"), ("        rate", "    rate")),
        ["missing-call"], "start line 9 with 4 spaces and lines 10 and 11 with 8 spaces", after={TALKER: SCRIPT},
    ),
    "spin-at-the-end-of-a-script": Case(
        {TALKER: SCRIPT.replace("\nmain()\n", "\nrospy.init_node('a')\nrospy.spin()\n")}, [],
    ),
    "sleeps-by-the-class": Case(
        swapped(TALKER, ("        rate.sleep()", "        rospy.Rate.sleep(0.1)")), ["missing-call"],
        "needs a Rate that was made", after={TALKER: "rospy.sleep(0.1)"},
    ),
    "text-added-to-its-place": Case(
        swapped(TALKER, ("rate.sleep()", "rate.sleep()\n        rospy.loginfo('at %s' + rospy.get_name())")),
        ["missing-call"], "and not `+`", after={TALKER: "rospy.loginfo('at %s' % rospy.get_name())"},
    ),
    "text-added-to-a-text-with-a-place": Case(
        swapped(TALKER, ("rate.sleep()", "rate.sleep()\n        print('at ' + '%s' % rospy.get_name())")), [],
    ),
    "comment-that-ends-otherwise": Case(
        {LAUNCHED: LAUNCH.replace("<launch>\n", "<launch>\n  <!-- the talker --!>\n")}, ["launch-syntax"],
        "a comment ends with `-->`", after={LAUNCHED: "  <!-- the talker -->\n"},
    ),
    "nothing": Case({}, []),
}  # fmt: skip


def test_a_script_by_another_word_for_its_role_needs_the_topics_of_the_lab(tmp_path: Path) -> None:
    script = SCRIPT.replace("'numeric_chatter'", "'numbers'")
    folder = package(tmp_path, {TALKER: None, "src/numeric_pub.py": script})
    does = ((TALKER, "publisher", "/numeric_chatter"), (TALKER, "node-name", "counter"))
    assert find_repairs(folder, facts_of(folder), asking(does=does)) == ()


@pytest.mark.parametrize("name", CASES)
def test_a_mistake_is_found_and_repaired(name: str, tmp_path: Path) -> None:
    case = CASES[name]
    folder = package(tmp_path, case.changes)
    for script in (folder / "src").iterdir():
        script.chmod(0o755)
    found = repair_all(folder, case.wanted)
    assert [repair.kind for repair in found] == case.kinds
    said = [*(one.message for one in found), "; ".join(part for one in found for part in advice_on([one]))]
    assert case.says in "\n".join(said)
    assert all(repair.fix and not repair.message.endswith(".") for repair in found)
    assert find_repairs(folder, facts_of(folder), case.wanted) == ()
    assert all(ast.parse(path.read_bytes()) for path in folder.rglob("*.py"))
    assert (folder / TALKER).stat().st_mode & 0o777 == 0o755
    for path, part in case.after.items():
        assert part.encode() in (folder / path).read_bytes()


def test_files_that_several_calls_name_without_their_folder(tmp_path: Path) -> None:
    calls = "add_executable(one one.cpp)\ntarget_link_libraries(one ${catkin_LIBRARIES})\nadd_library(two two.cpp)\n"
    folder = package(
        tmp_path,
        {
            **swapped(CMAKELISTS, ("catkin_package()\n", f"catkin_package()\n{calls}")),
            "src/one.cpp": "int main() {}\n",
            "src/two.cpp": "int two() { return 2; }\n",
        },
    )
    assert [repair.kind for repair in repair_all(folder)] == ["build-line"] * 2
    text = (folder / CMAKELISTS).read_text()
    assert "add_executable(one src/one.cpp)\n" in text
    assert "add_library(two src/two.cpp)\n" in text


def test_a_letter_in_the_name_of_a_file_that_cmake_names(tmp_path: Path) -> None:
    scripts = "src/talker.py src/hepler.py src/node2.py"
    line = f"catkin_install_python(PROGRAMS {scripts} DESTINATION ${{CATKIN_PACKAGE_BIN_DESTINATION}})"
    files = {
        **swapped(CMAKELISTS, ("catkin_package()\n", f"catkin_package()\n{line}\n")),
        "src/node1.py": SCRIPT,
    }
    repair_all(package(tmp_path, {**files, "src/helper.py": "x = 1\n"}))
    text = (tmp_path / "lab" / CMAKELISTS).read_text()
    assert "PROGRAMS src/talker.py src/helper.py " in text
    assert "node" not in text


def test_a_program_may_be_called_as_its_source(tmp_path: Path) -> None:
    calls = "add_executable(mean.cpp src/mean.cpp)\ntarget_link_libraries(mean.cpp ${catkin_LIBRARIES})\n"
    files = swapped(CMAKELISTS, ("catkin_package()\n", f"catkin_package()\n{calls}"))
    assert repair_all(package(tmp_path, {**files, "src/mean.cpp": "int main() {}\n"})) == ()


def test_lines_that_may_be_meant_otherwise_are_left_alone(tmp_path: Path) -> None:
    folder = package(
        tmp_path, swapped(TALKER, ("        publisher.publish(1)", "    publisher.publish(1)\n     x = 1"))
    )
    assert find_repairs(folder, facts_of(folder), WANTED) == ()


def test_an_executable_bit_is_set_for_those_who_may_read(tmp_path: Path) -> None:
    folder = package(tmp_path)
    (folder / TALKER).chmod(0o640)
    (found,) = repair_all(folder)
    assert (found.kind, found.message) == ("executable-bit", "src/talker.py is not executable")
    assert found.fix == chmod_hint("disk", "src/talker.py")
    assert stat.S_IMODE((folder / TALKER).stat().st_mode) == 0o750


def test_repairs_combine_in_the_order_in_which_a_student_meets_them(tmp_path: Path) -> None:
    script = SCRIPT.replace("    rate = ", "\trate = ").replace("rate.sleep()", "rate.sleep; print 'x'")
    script = script.replace("numeric_chatter", "numeric_chater").replace("import Int8", "import String")
    changes = {TALKER: script.replace("\n", "\r\n"), **swapped(CMAKELISTS, ("catkin_package()\n", ""))}
    folder = package(tmp_path, {**changes, **swapped(LAUNCHED, ("talker.py", "talker"))})
    (folder / TALKER).chmod(0o644)
    found = [repair.kind for repair in repair_all(folder)]
    assert found == [
        *("executable-bit", "line-ends", "python-syntax", "python-syntax", "build-line", "launch-type"),
        *("missing-import", "missing-call", "topic-name"),
    ]
    assert found == sorted(found, key=KINDS.index)
    assert find_repairs(folder, facts_of(folder), WANTED) == ()


def test_a_repair_whose_lines_are_gone_is_refused(tmp_path: Path) -> None:
    folder = package(tmp_path, swapped(TALKER, ("numeric_chatter", "numeric_chater")))
    (found,) = find_repairs(folder, facts_of(folder), WANTED)
    (folder / TALKER).write_text("import rospy\n")
    with pytest.raises(NotRepairable, match="is not as it was"):
        apply_repair(folder, found)
    assert (folder / TALKER).read_text() == "import rospy\n"


def test_every_kind_has_a_share_and_words() -> None:
    assert set(DEFAULT_SHARES) == set(BY_HAND) == set(KINDS)
    assert {DEFAULT_SHARES[kind] for kind in KINDS} == {0.5, 1.0}
    assert DEFAULT_SHARES["topic-name"] == DEFAULT_SHARES["line-ends"] == 1.0
    assert DEFAULT_SHARES["python-syntax"] == DEFAULT_SHARES["missing-call"] == 0.5


@pytest.mark.parametrize(
    ("one", "other", "near"),
    [
        ("numeric_chater", "numeric_chatter", True),
        ("chattre", "chatter", True),
        ("Chatter", "chatter", True),
        ("chatters", "/chatter", True),
        ("chatter", "chatter", False),
        ("char", "chatter", False),
        ("x", "y", False),
        ("talker", "walker", True),
        ("listener", "talker", False),
    ],
)
def test_names_are_near_by_one_letter(one: str, other: str, near: bool) -> None:
    assert is_near(one, other) is near


def test_one_edit_counts_a_swap_and_not_two_letters() -> None:
    assert is_one_edit("abc", "acb")
    assert is_one_edit("abc", "abcd")
    assert is_one_edit("", "a")
    assert not is_one_edit("abc", "abc")
    assert not is_one_edit("abcd", "badc")


def test_what_is_added_at_the_end_is_below_the_last_line() -> None:
    before, after = "a()\nb()\n", "a()\nb()\n\nc()\n"
    assert changed_lines(before, after) == (2, "b()", "b()\n\nc()")
    assert changed_lines("a()\nb()", "a()\nb()\nc()") == (2, "b()", "b()\nc()")
    assert changed_lines("a()\n\nb()\n", "a()\n\nc()\nb()\n") == (2, "", "\nc()")


@pytest.mark.parametrize(
    ("line", "lacking", "more", "deleted"),
    [
        ("from msilib.schema import Error", True, (), True),
        ("import winreg, winsound", True, (), True),
        ("from rclpy.node import Node", True, (), True),
        ("from std_msgs.msg import rate", False, (), True),
        ("from std_msgs.msg import Int8, Int16", False, (), False),
        ("import cv2", True, (), False),
        ("import listener", True, (), False),
        ("from msilib import (", True, (), False),
        ("import rospi", True, ("undefined",), False),
    ],
)
def test_an_import_of_what_is_not_there_is_deleted_where_nothing_uses_it(
    line: str, lacking: bool, more: tuple[SlipKind, ...], deleted: bool, tmp_path: Path
) -> None:
    folder = package(tmp_path, swapped(TALKER, ("import rospy\n", f"import rospy\n{line}\n")))
    kinds: list[SlipKind] = ["unused-import", *(["lacking-import"] if lacking else []), *more]
    module = line.split()[1].partition(".")[0].strip(",")
    slips = tuple(
        PythonSlip(file=TALKER, line=3, kind=kind, message=module, name="x", fix="delete it")
        for kind in kinds
    )
    found = find_repairs(folder, facts_of(folder).model_copy(update={"slips": slips}), WANTED)
    assert [one.fix for one in found if one.kind == "missing-import"] == (["delete it"] if deleted else [])
