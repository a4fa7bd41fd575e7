"""Mistakes in what builds and launches the nodes, in one table: CMake, the manifest, launch files and messages."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from grader.package.repairs import Wanted
from tests.package.repairing import (
    CMAKE,
    CMAKELISTS,
    LAUNCH,
    LAUNCHED,
    LEVELS,
    MANIFEST,
    NESTED,
    OWN,
    OWN_CMAKE,
    RUN_OWN,
    SCRIPT,
    TALKER,
    XML,
    Case,
    asking,
    check,
    swapped,
)

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
CPP_NODE = """\
void callback(const Int8& msg) { for (int i = 0; i < 3; ++i) use(msg); }
int main(int argc, char** argv) {
  ros::init(argc, argv, "a");
  auto sub = ros::NodeHandle().subscribe("scan", 10, callback);
  return 0;
}
"""
MEAN_CMAKE, LINKED = CMAKE.replace("rospy", "roscpp rospy"), "target_link_libraries(mean x)\n"
MEAN = {"src/mean.cpp": "#include <ros/ros.h>\nint main() {}\n"}
STARTED = asking(launch_files=("activity1.launch",), started=(("activity1.launch", "talker.py"),))
CONSTRUCTOR = """\
Node::Node() : n_(1)
{
  ros::Subscriber sub = nh_.subscribe("scan", 10, &Node::heard, this);
%s}
"""


def both(old: str, new: str) -> tuple[str, str]:
    """The line, and another version of it, with git's merge markers."""
    return old, f"<<<<<<< HEAD\n{old}\n=======\n{new}\n>>>>>>> main"


NODE = '  <node pkg="lab" type="talker.py" name="talker"/>'

CASES = {
    "merged-launch": Case(
        swapped(LAUNCHED, both(NODE, NODE.replace("/>", ' output="screen"/>'))), ["launch-syntax"],
        "line 2 of launch/lab.launch: git's merge markers (`<<<<<<<`) are still in the file",
    ),
    "merged-first-line-of-launch": Case(
        {LAUNCHED: '<<<<<<< HEAD\n<?xml version="1.0"?>\n=======\n>>>>>>> main\n' + LAUNCH},
        ["launch-syntax"], "for the first one, delete lines 1, 3 and 4",
    ),
    "merged-manifest": Case(
        swapped(XML, both("  <license>MIT</license>", "  <license>BSD</license>")), ["manifest-line"],
        "keep one of the two versions; for the first one, delete lines 6 and 8 to 10",
    ),
    "merged-cmake": Case(
        swapped(CMAKELISTS, both("catkin_package()", "catkin_package(CATKIN_DEPENDS rospy)")), ["build-line"],
        "line 4 of CMakeLists.txt: git's merge markers (`<<<<<<<`) are still in the file",
    ),
    "merged-yaml": Case(
        {"config/my.yaml": "<<<<<<< HEAD\nrate: 5\n=======\nrate: 10\n>>>>>>> main\n"}, ["yaml-syntax"],
        "line 1 of config/my.yaml: git's merge markers", asking(files=("config/my.yaml",)),
        {"config/my.yaml": "rate: 5\n"},
    ),
    "topic-in-cpp": Case(
        {"src/a.cpp": '// advertise<Int8>("/other", 1)\npub = nh.advertise<std_msgs::Int8>("/men", 1);\n'},
        ["topic-name"], "line 2 of src/a.cpp: the topic /men should be /mean", asking(topics=("/mean",)),
        {"src/a.cpp": 'advertise<std_msgs::Int8>("/mean", 1);'},
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
    "subscriber-dropped-in-cpp": Case(
        {"src/a.cpp": CPP_NODE.replace("auto sub = ros::NodeHandle()", "nh").replace("  return 0", "  ros::spin()")},
        ["missing-call"], "line 4 of src/a.cpp: what subscribe(…) returns is dropped, and with it the subscription",
        after={"src/a.cpp": '  ros::Subscriber sub = nh.subscribe("scan", 10, callback);\n'},
    ),
    "loop-in-cpp": Case({"src/a.cpp": CPP_NODE.replace("  return", "  while (true) ros::spinOnce();\n  return")}, []),
    "include": Case(swapped(CMAKELISTS, ("catkin_package()", "catkin_package(\n  INCLUDE_DIRS include\n)")),
                ["build-line"], "line 4 of CMakeLists.txt: catkin_package(…) names the folder include/"),
    "type": Case(swapped(LAUNCHED, ("talker.py", "talker")), ["launch-type"], 'type="talker" should be'),
    "node-in-cpp-beside-the-labs": Case(
        {"src/a.cpp": CPP_NODE.replace('"a"', '"talkr"').replace("  return 0", "  ros::spin()")}, []
    ),
    "type-source": Case(
        {"src/talker.cpp": "int main() {}\n",
         CMAKELISTS: f"{CMAKE}add_executable(talker src/talker.cpp)\ntarget_link_libraries(talker x)\n",
         **swapped(LAUNCHED, ("talker.py", "talker.cpp"))}, ["launch-type"],
        'type="talker.cpp" should be type="talker"', wanted=asking(scripts=("talker",)),
    ),
    "type-source-beside-the-labs-script": Case(
        {"src/talker.cpp": "int main() {}\n",
         CMAKELISTS: f"{CMAKE}add_executable(talker src/talker.cpp)\ntarget_link_libraries(talker x)\n",
         **swapped(LAUNCHED, ("talker.py", "talker.cpp"))}, ["launch-type"],
        'type="talker.cpp" should be type="talker.py"', wanted=asking(started=(("lab.launch", "talker.py"),)),
    ),
    "tag-open": Case(swapped(LAUNCHED, ("/>", ">")), ["launch-syntax"], "is still open where"),
    "no-quotes": Case(swapped(LAUNCHED, ('"talker.py"', "talker.py")), ["launch-syntax"], "has no quotes around it"),
    "script-of-a-launch-file-that-cannot-be-read": Case(
        {"launch/lab.launch": '<launch>\n  <node pkg="lab" type="extra.py" name="extra"/>\n',
         "src/extra.py": "#!/usr/bin/env python3\nprint(1\n"},
        ["python-syntax", "launch-syntax"], "line 2 of src/extra.py", after={"src/extra.py": "print(1)"},
        wanted=asking(launch_files=("lab.launch",))),
    "tag-open-and-type": Case(swapped(LAUNCHED, ("/>", ">"), ("talker.py", "talker")),
                          ["launch-syntax", "launch-type"], 'type="talker" should be'),
    "second-node-of-a-name": Case(
        {"src/hear.py": SCRIPT, LAUNCHED: LAUNCH.replace(NODE, f"{NODE}\n{NODE.replace('talker.py', 'hear.py')}")},
        ["launch-syntax"], 'line 3 of launch/lab.launch: name="talker" should be name="hear"',
    ),
    "node-begun-in-a-comment": Case(
        {LAUNCHED: LAUNCH.replace(NODE, '<!-- <node name="talker"> -->\n<!-- a -->\n<param name="a"/>\n</node>\n')},
        ["launch-syntax"], "line 2 of launch/lab.launch: only a part of an element is in a comment",
        after={LAUNCHED: 'name="talker">\n<!-- a -->'},
    ),
    "launched-in-nearly-the-namespace": Case(
        {LAUNCHED: f'<launch>\n<group ns="Left">\n{NODE}</group>\n</launch>\n'},
        ["node-name"], 'line 2 of launch/lab.launch: ns="Left" should be ns="left"', after={LAUNCHED: 'ns="left"'},
        wanted=asking(launched=(("lab.launch", "/left/talker"),)),
    ),
    "launched-by-nearly-the-name": Case(
        {LAUNCHED: f'<launch>\n<group ns="left">\n{NODE}</group>\n</launch>\n'},
        ["node-name"], 'name="talker" should be name="talkers"', after={LAUNCHED: 'ns="left"'},
        wanted=asking(nodes=(), launched=(("lab.launch", "/left/talkers"),)),
    ),
    "private-parameter-of-a-node-in-a-namespace": Case(
        {LAUNCHED: '<launch>\n<group ns="left">\n'
         + NODE.replace("/>", '>\n<param name="colour" value="red"/></node>') + "</group>\n</launch>\n"},
        ["parameter-name"], 'name="colour" should be name="color"', after={LAUNCHED: '<param name="color" value='},
        wanted=asking(params=("/talker/color",)),
    ),
    "launched-by-another-file": Case(
        {LAUNCHED: LAUNCH.replace(NODE, NODE.replace('name="talker"', 'name="talker2"'))}, [],
        wanted=asking(nodes=(), launched=(("other.launch", "/talker"),)),
    ),
    "launched-besides": Case(
        {LAUNCHED: LAUNCH.replace(NODE, NODE + NODE.replace('name="talker"', 'name="talker2"'))}, [],
        wanted=asking(nodes=(), launched=(("lab.launch", "/talker"),)),
    ),
    "nodes-of-a-name-in-two-places": Case({LAUNCHED: LAUNCH.replace(NODE, NODE + NODE.replace("/>", ' ns="b"/>'))}, []),
    "nodes-of-a-name-one-of-which-may-start": Case(
        {LAUNCHED: LAUNCH.replace(NODE, NODE + NODE.replace("/>", ' if="$(eval 1)"/>'))}, []
    ),
    "pkg-that-no-one-knows": Case(swapped(LAUNCHED, ('pkg="lab"', 'pkg="my_robot"')), ["package-name"],
                                  'pkg="my_robot" should be'),
    "pkg-of-another": Case(swapped(LAUNCHED, ('pkg="lab"', 'pkg="turtlesim"')), []),
    "pkg-by-an-argument": Case(
        {LAUNCHED: '<launch>\n  <arg name="from" default="laab"/>\n'
                   '  <node pkg="$(arg from)" type="talker.py" name="talker"/>\n</launch>\n'},
        ["package-name"], 'default="laab" should be default="lab"'),
    "type-by-an-argument": Case(
        {LAUNCHED: '<launch>\n  <arg name="what" default="talker"/>\n'
                   '  <node pkg="lab" type="$(arg what)" name="talker"/>\n</launch>\n'},
        ["launch-type"], 'default="talker" should be default="talker.py"'),
    "pkg-by-an-argument-of-another": Case(
        {LAUNCHED: '<launch>\n  <arg name="from" default="turtlesim"/>\n'
                   '  <node pkg="$(arg from)" type="talker.py" name="talker"/>\n</launch>\n'}, []),
    "pkg": Case(swapped(LAUNCHED, ('pkg="lab"', 'pkg="laab"')), ["package-name"], 'pkg="laab" should be'),
    "pkg-found": Case(swapped(LAUNCHED, ('pkg="lab"', 'pkg="$(find lab)"')), ["package-name"],
        'write pkg="lab" instead of pkg="$(find lab)"'),
    "manifest-name": Case(swapped(XML, (">lab<", ">lab_<")), ["package-name"], "the package is called lab_"),
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
    "project-by-a-variable": Case(
        swapped(CMAKELISTS, ("project(lab)", "set(NAME labb)\nproject(${NAME})")),
        ["package-name"], "project(labb), by line 2, is not", after={CMAKELISTS: "set(NAME lab)\n"},
    ),
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
    "installed-below-programs": Case(
        {CMAKELISTS: CMAKE + INSTALL, **INSTALLED}, ["build-line"],
        "CMakeLists.txt line 7: write src/listener.py src/talker.py after PROGRAMS", INSTALLS,
        {CMAKELISTS: "scripts/other.py"},
    ),
    "installed-in-place-of-what-is-not-there": Case(
        {CMAKELISTS: CMAKE + INSTALL.replace("scripts/other.py", "bin/hello"), **INSTALLED}, ["build-line"],
        "CMakeLists.txt line 8: write src/listener.py src/talker.py in place of bin/hello", INSTALLS,
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
    "key-with-two-colons": Case(
        {"config/my.yaml": 'details:\n  name:: "Ada"\n'}, ["parameter-name"], "the key name: should be name",
        wanted=asking(files=("config/my.yaml",)), after={"config/my.yaml": '  name: "Ada"\n'}),
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
    "source-with-a-slip-in-its-ending": Case(
        {CMAKELISTS: f"{MEAN_CMAKE}add_executable(mean src/mean.cppp)\n{LINKED}", **MEAN}, ["build-line"],
        "write src/mean.cpp instead of src/mean.cppp", after={CMAKELISTS: "add_executable(mean src/mean.cpp)"},
    ),
    "program-and-source-turned": Case(
        {CMAKELISTS: f"{MEAN_CMAKE}add_executable(src/mean.cpp mean)\n{LINKED}", **MEAN}, ["build-line"],
        "write add_executable(mean src/mean.cpp)", after={CMAKELISTS: "add_executable(mean src/mean.cpp)"},
    ),
    "program-that-nothing-makes": Case(
        {CMAKELISTS: f"{MEAN_CMAKE}add_dependencies(mean x)\n{LINKED}", **MEAN}, ["build-line"],
        "above line 5, write add_executable(mean src/mean.cpp)",
        after={CMAKELISTS: "catkin_package()\nadd_executable(mean src/mean.cpp)\nadd_dependencies(mean x)\n"},
    ),
    "program-in-a-comment": Case(
        {CMAKELISTS: f"{MEAN_CMAKE}# add_executable(mean src/mean.cpp)\n{LINKED}", **MEAN}, ["build-line"],
        "remove the `#` on line 5", after={CMAKELISTS: "\nadd_executable(mean src/mean.cpp)\n"},
    ),
    "program-without-roscpp": Case(
        {CMAKELISTS: f"{CMAKE}add_executable(mean src/mean.cpp)\n{LINKED}", **MEAN}, ["build-line"],
        "write roscpp after COMPONENTS", after={CMAKELISTS: "COMPONENTS roscpp rospy)"},
    ),
    "component-with-a-slip": Case(
        swapped(CMAKELISTS, ("rospy", "ropsy")), ["build-line"], "write rospy instead of ropsy",
        after={CMAKELISTS: CMAKE},
    ),
    "bracket-beside-a-variable-in-a-variable": Case(
        {CMAKELISTS: f"{MEAN_CMAKE}add_executable(mean src/mean.cpp)\n{LINKED.replace('s(', 's')}"
         "add_dependencies(mean ${${PROJECT_NAME}_EXPORTED_TARGETS})\n", **MEAN}, ["build-line"],
        "write `target_link_libraries(mean x)`", after={CMAKELISTS: LINKED},
    ),
    "place-in-small-letters": Case(
        {CMAKELISTS: CMAKE + INSTALL.replace("KAGE", "KaGE").replace("scripts/other.py", TALKER)},
        ["build-line"], "there is no variable CATKIN_PACKaGE_BIN_DESTINATION",
        after={CMAKELISTS: "DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})"},
    ),
    "scripts-without-a-place": Case(
        {CMAKELISTS: f"{CMAKE}catkin_install_python(PROGRAMS {TALKER})\n"}, ["build-line"], "has no DESTINATION",
        after={CMAKELISTS: "DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})"},
    ),
    **{f"first-line-of-{head}": Case(
        {CMAKELISTS: CMAKE.replace("catkin_package()", rest)}, ["build-line"], f"`{head}(`",
        after={CMAKELISTS: f"\n{head}(\n"},
    ) for head, rest in {
        "catkin_package": "\n  CATKIN_DEPENDS rospy\n)", "install": "catkin_package()\n\n  TARGETS x DESTINATION y\n)"
    }.items()},
    "run-dependency": Case(
        {CMAKELISTS: CMAKE.replace("package()", "package(CATKIN_DEPENDS rospy message_runtime)")}, ["manifest-line"],
        "names message_runtime", after={XML: "  <exec_depend>message_runtime</exec_depend>"},
    ),
    **{f"own-message-that-is-left-out-{name}": Case(
        {**OWN, f"msg/{name}.msg": "geometry_msgs/Point at\n",
         CMAKELISTS: OWN_CMAKE.replace("catkin_p", "generate_messages(DEPENDENCIES std_msgs)\ncatkin_p")}, [],
    ) for name in ("Old", "Track", "Pose2")},
    "program-that-does-not-wait-for-its-header": Case(
        {**OWN, "src/mean.cpp": '#include "lab/Level.h"\nint main() {}\n',
         CMAKELISTS: OWN_CMAKE.replace("catkin_p", "generate_messages()\ncatkin_p")
         + "add_executable(mean src/mean.cpp)\ntarget_link_libraries(mean ${catkin_LIBRARIES})\n"},
        ["build-line"],
        "below the add_executable(…) on line 7, write add_dependencies(mean ${${PROJECT_NAME}_EXPORTED_TARGETS})",
        after={CMAKELISTS: ".cpp)\nadd_dependencies(mean ${${PROJECT_NAME}_EXPORTED_TARGETS})\ntarget"},
    ),
    "manifest-of-rosbuild": Case(
        swapped(TALKER, ("import rospy\n", "import rospy\nimport roslib; roslib.load_manifest('old_lab')\n")),
        ["missing-import"], "delete line 3", after={TALKER: "import rospy\n\nfrom"},
    ),
    "manifest-of-rosbuild-that-is-there": Case(
        swapped(TALKER, ("import rospy\n", "import rospy\nimport roslib; roslib.load_manifest('lab')\n")), [],
    ),
    "targets-by-other-names-and-above-what-makes-them": Case(
        {CMAKELISTS: CMAKE + "add_dependencies(men x)\nadd_executable(mean src/mean.cpp)\n"
                      "target_link_libraries(mean ${catkin_LIBRARY})\ninstall(TARGET meann RUNTIM DESTINATION b)\n",
         "src/mean.cpp": "int main() {}\n"}, ["build-line"] * 5, "write mean instead of men",
        after={CMAKELISTS: "()\n\nadd_executable(mean src/mean.cpp)\nadd_dependencies(mean x)\n"},
    ),
    "two-programs-that-nothing-is-linked-to": Case(
        {CMAKELISTS: CMAKE + "add_executable(a src/a.cpp)\nadd_executable(b src/b.cpp)\n",
         "src/a.cpp": "int main() {}\n", "src/b.cpp": "int main() {}\n"},
        ["build-line", "build-line"], "nothing is linked to the program a",
        after={CMAKELISTS: "(a ${catkin_LIBRARIES})\nadd_executable(b src/b.cpp)\n"
                           "target_link_libraries(b ${catkin_LIBRARIES})\n"},
    ),
    "cmake-of-rosbuild": Case(
        {CMAKELISTS: CMAKE.replace("project", "include($ENV{ROS_ROOT}/core/rosbuild/rosbuild.cmake)\nrosbuild_init()\n"
                                   "project")},
        ["build-line"], "delete the calls on lines 2 and 3", after={CMAKELISTS: "\n\nproject(lab)"},
    ),
    "cmake-of-a-workspace": Case({CMAKELISTS: "project(Project)\nfind_package(catkin)\ncatkin_workspace()\n"}, []),
    "cmake-of-ros-2": Case({CMAKELISTS: "project(lab)\nfind_package(ament_cmake REQUIRED)\nament_package()\n"}, []),
    "project-and-package-of-other-names": Case(
        {CMAKELISTS: CMAKE.replace("project(lab)", "project(other)"), XML: MANIFEST.replace(">lab<", ">lessons<"),
         LAUNCHED: LAUNCH.replace('"lab"', '"lessons"')},
        ["build-line"], "write project(lab) here, and <name>lab</name> in package.xml",
    ),
    "comment-that-ends-otherwise": Case(
        {LAUNCHED: LAUNCH.replace("<launch>\n", "<launch>\n  <!-- the talker --!>\n")}, ["launch-syntax"],
        "a comment ends with `-->`", after={LAUNCHED: "  <!-- the talker -->\n"},
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
    "installed-beside-one-that-lies-elsewhere": Case(
        {CMAKELISTS: CMAKE + INSTALL.replace("scripts/other.py", "scripts/a.py"), **INSTALLED,
         "scripts/old/a.py": INSTALLED["scripts/other.py"]}, ["build-line", "build-line"],
        "CMakeLists.txt line 7: write src/listener.py src/talker.py after PROGRAMS", INSTALLS,
    ),
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
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_a_mistake_in_a_package_is_found_and_repaired(name: str, tmp_path: Path) -> None:
    check(CASES[name], tmp_path)
