"""How repairs are found, combined, written and refused; single mistakes are in the tables beside this file."""

from __future__ import annotations

import stat
from collections.abc import Iterator
from pathlib import Path

import pytest

from grader.model.message_definitions import parse_definition
from grader.model.python_slip import PythonSlip, SlipKind
from grader.model.repair import BY_HAND, DEFAULT_SHARES, KINDS, Repair, advice_on
from grader.model.submission import chmod_hint
from grader.package.python_repairs import examine
from grader.package.python_repairs.syntax import Step, step_to
from grader.package.repairs import NotRepairable, apply_repair, find_repairs
from grader.package.repairs.editing import changed_lines
from grader.package.repairs.names import is_near, is_one_edit
from grader.package.repairs.of_runs import conversions, text_place
from grader.package.repairs.python import ros_clock
from grader.repaired_copy import REPAIRS_MAX, most_of
from tests.package.repairing import (
    CMAKE,
    CMAKELISTS,
    FILES,
    LAUNCHED,
    MANIFEST,
    SCRIPT,
    TALKER,
    WANTED,
    XML,
    Case,
    asking,
    check,
    package,
    repair_all,
    swapped,
)
from tests.package.trees import facts_of

pytestmark = pytest.mark.usefixtures("without_processes")


def making(kind: str, file: str) -> str:
    """Return a CMakeLists.txt that makes this definition."""
    line = f"message_generation actionlib_msgs rospy)\nadd_{kind}_files(FILES {file})\n"
    return CMAKE.replace("rospy)\n", line + "generate_messages(DEPENDENCIES actionlib_msgs std_msgs)\n")


TWO_FIELDS = tuple(parse_definition("int64 a\n---\nint64 sum", ".srv"))
GO_FIELDS = tuple(parse_definition("int32 n\n---\nbool there\n---\nint32 left\n", ".action"))
# fmt: off
BOTH = (TALKER, "src/listener.py")
TWO_ENDS = (
    (TALKER, "publisher", "/numeric_chatter"),
    (TALKER, "node-name", "talker"),
    ("src/listener.py", "subscriber", "/numeric_chatter"),
)
HEARS = """\
#!/usr/bin/env python3
import rospy
from std_msgs.msg import Int8

rospy.init_node('listener')
rospy.Subscriber('numeric_chatter', Int8, print)
rospy.spin()
"""
OFFERS = """\
#!/usr/bin/env python3
import rospy
from rospy_tutorials.srv import AddTwoInts

rospy.init_node('talker')
rospy.Service('add', AddTwoInts, lambda request: request.a + request.b)
rospy.spin()
"""
ASKS = """\
#!/usr/bin/env python3
import rospy
from rospy_tutorials.srv import AddTwoInts

rospy.init_node('asks')
rospy.wait_for_service('add')
print(rospy.ServiceProxy('add', AddTwoInts)(1, 2).sum)
"""
NAMES_OF_FILES = {
    "own-service-with-other-capitals": Case(
        {"srv/tWo.srv": "int64 a\n---\nint64 sum\n",
         "src/level.py": "from lab.srv import tWo, tWoResponse\nrospy.Service('tWo', tWo, lambda q: tWoResponse(2))\n",
         "src/two.cpp": '#include "lab/tWo.h"\nlab::tWo::Request one;\nlab::tWoResponse two;\nint tWos;\n',
         CMAKELISTS: making("service", "tWo.srv")},
        ["file-name"], "write Two.srv in CMakeLists.txt, and Two instead of tWo in src/level.py and src/two.cpp",
        asking(definitions=(("srv/Two.srv", TWO_FIELDS),), files=("srv/Two.srv",)),
        {CMAKELISTS: "FILES Two.srv",
         "src/level.py": "import Two, TwoResponse\nrospy.Service('tWo', Two, lambda q: TwoResponse(2))",
         "src/two.cpp": '#include "lab/Two.h"\nlab::Two::Request one;\nlab::TwoResponse two;\nint tWos;'},
    ),
    "own-action-called-by-its-class": Case(
        {"src/go.py": "import lab.msg\nkind = lab.msg.GoActionAction\nresult = lab.msg.GoActionResult()\n",
         "action/GoAction.action": "int32 n\n---\nbool there\n---\nint32 left\n",
         CMAKELISTS: making("action", "GoAction.action")},
        ["file-name"], "action/GoAction.action should be called Go.action",
        asking(definitions=(("action/Go.action", GO_FIELDS),), files=("action/Go.action",)),
        {CMAKELISTS: "FILES Go.action", "src/go.py": "kind = lab.msg.GoAction\nresult = lab.msg.GoResult()"},
    ),
    "program-beside-a-script-of-its-name": Case(
        {"src/adder.py": "import rospy\n", "src/adder.cpp": "int main() {}\n",
         CMAKELISTS: CMAKE + "add_executable(adder src/adder.cpp)\n"
                             "target_link_libraries(adder ${catkin_LIBRARIES})\n"},
        [], "", asking(scripts=("adder",)),
    ),
    "script-that-is-asked-for-without-its-ending": Case(
        {"src/adder.py": SCRIPT + "print 1\n"}, ["python-syntax"], "print(1)", asking(scripts=("adder",)),
    ),
    "own-service-with-another-word": Case(
        {"srv/my_sum.srv": "int64 a\n---\nint64 sum\n",
         "src/level.py": "from lab.srv import my_sum\n", CMAKELISTS: making("service", "my_sum.srv")},
        ["file-name"], "srv/my_sum.srv should be called Two.srv",
        asking(definitions=(("srv/Two.srv", TWO_FIELDS),), files=("srv/Two.srv",)),
        {CMAKELISTS: "FILES Two.srv", "src/level.py": "from lab.srv import Two\n"},
    ),
    "own-message-beside-ros-own-of-its-name": Case(
        {"msg/Point.msg": "int64 n\n", "src/level.py": "from lab.msg import Point\n",
         "src/place.py": "from geometry_msgs.msg import Pose, Point\n", CMAKELISTS: making("message", "Point.msg")},
        ["file-name"], "and Place instead of Point in src/level.py",
        asking(definitions=(("msg/Place.msg", tuple(parse_definition("int64 n", ".msg"))),), files=("msg/Place.msg",)),
        {CMAKELISTS: "FILES Place.msg", "src/level.py": "import Place\n", "src/place.py": "import Pose, Point\n"},
    ),
    "another-service-than-the-labs": Case(
        {"srv/other.srv": "int64 b\n---\nint64 sum\n",
         "src/level.py": "from lab.srv import other\n", CMAKELISTS: making("service", "other.srv")},
        [], "", asking(definitions=(("srv/Two.srv", TWO_FIELDS),), files=("srv/Two.srv",)),
    ),
    "two-files-exchanged": Case(
        {TALKER: HEARS, "src/listener.py": SCRIPT}, ["exchanged-files"],
        "src/talker.py holds the code of listener.py, and src/listener.py that of talker.py",
        asking(does=TWO_ENDS, scripts=BOTH), {TALKER: SCRIPT, "src/listener.py": HEARS},
    ),
    "two-files-exchanged-and-one-of-them-nearly-named": Case(
        {TALKER: HEARS, "src/listner.py": SCRIPT}, ["file-name", "exchanged-files"], "",
        asking(does=TWO_ENDS, scripts=BOTH), {TALKER: SCRIPT, "src/listener.py": HEARS},
    ),
    "server-and-client-exchanged": Case(
        {TALKER: ASKS, "src/listener.py": OFFERS}, ["exchanged-files"], "",
        asking(does=((TALKER, "server", "/add"),), scripts=BOTH), {TALKER: OFFERS, "src/listener.py": ASKS},
    ),
    "script-with-a-word-behind-the-labs": Case(
        {TALKER: None, "src/talker_pub.py": SCRIPT.replace("'numeric_chatter'", "'beeps'")},
        ["file-name"], "", asking(does=TWO_ENDS, topics=()),
    ),
    "script-with-the-labs-word-that-hears": Case(
        {"src/listener_pub.py": SCRIPT}, [], "", asking(does=TWO_ENDS, scripts=BOTH),
    ),
    "one-file-twice": Case(
        {TALKER: HEARS, "src/listener.py": HEARS}, [], "", asking(does=TWO_ENDS, scripts=BOTH),
    ),
    "a-listener-in-both-by-the-name-of-its-own": Case(
        {TALKER: HEARS.replace("'listener'", "'talker'"), "src/listener.py": SCRIPT}, [], "",
        asking(does=TWO_ENDS, scripts=BOTH, nodes=()),
    ),
    "a-file-that-does-both": Case(
        {TALKER: HEARS, "src/listener.py": SCRIPT.replace("main()\n", "rospy.Subscriber('numeric_chatter', Int8)\n")},
        [], "", asking(does=TWO_ENDS, scripts=BOTH),
    ),
}
# fmt: on


@pytest.mark.parametrize("name", NAMES_OF_FILES)
def test_what_is_called_otherwise_is_renamed_in_the_code_too(name: str, tmp_path: Path) -> None:
    check(NAMES_OF_FILES[name], tmp_path)


def test_a_script_by_another_word_for_its_role_needs_the_topics_of_the_lab(tmp_path: Path) -> None:
    script = SCRIPT.replace("'numeric_chatter'", "'numbers'")
    folder = package(tmp_path, {TALKER: None, "src/numeric_pub.py": script})
    does = ((TALKER, "publisher", "/numeric_chatter"), (TALKER, "node-name", "counter"))
    assert find_repairs(folder, facts_of(folder), asking(does=does)) == ()


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


@pytest.mark.parametrize("fix", ["remove the `#` from line 3", "move lines 8 to 9 above line 3"])
def test_a_line_is_told_once(fix: str) -> None:
    one = Repair(kind="missing-call", file="a.py", line=3, before="x", after="y", message="", fix=fix)
    assert advice_on([one]) == [f"a.py: {fix}"]


def test_a_line_that_is_repaired_twice_is_told_once() -> None:
    lines = [(2, "a", "b"), (3, "x", "y"), (2, "b", "c")]
    known = {"kind": "missing-call", "file": "a.py", "message": "wrong"}
    repairs = [Repair(**known, line=n, before=old, after=new, fix=new) for n, old, new in lines]
    assert advice_on(repairs) == ["a.py line 2: write `c`", "a.py line 3: write `y`"]
    call = "find_package(catkin REQUIRED COMPONENTS {})"
    added = [
        (1, "project(a)", f"project(a)\n{call.format('rospy')}"),
        (1, call.format("rospy"), call.format("roscpp rospy")),
    ]
    of_build = {**known, "kind": "build-line", "file": "CMakeLists.txt"}
    repairs = [
        Repair(**of_build, line=n, before=old, after=new, fix=new.split("\n")[-1]) for n, old, new in added
    ]
    (told,) = advice_on(repairs)
    assert told.endswith(f"`{call.format('roscpp rospy')}`")


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
        ("from std_srvs import Empty", False, (), True),
        ("from sensor_msgs import point_cloud2", False, (), False),
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


def test_a_line_of_the_build_or_of_another_script_is_repaired_whatever_number_of_lines_are() -> None:
    lines = [Repair(kind="missing-call", file="src/a.py", line=n, message="", fix="") for n in range(1, 7)]
    other = Repair(kind="missing-call", file="src/b.py", line=1, message="", fix="")
    project = Repair(kind="build-line", file="../other/CMakeLists.txt", line=2, message="", fix="")
    assert most_of([*lines, other, project]) == [*lines[:REPAIRS_MAX], other, project]


@pytest.mark.parametrize(
    "tags", [("depend", "depend"), ("depend", "exec_depend"), ("exec_depend", "depend")], ids=" and ".join
)
def test_a_name_that_is_written_apart_does_not_come_twice_where_catkin_refuses_that(
    tags: tuple[str, str], tmp_path: Path
) -> None:
    apart = "\n".join(f"<{tag}>{word}</{tag}>" for tag, word in zip(tags, ("std", "msgs"), strict=True))
    folder = package(tmp_path, {"package.xml": MANIFEST.replace("</package>", f"{apart}\n</package>")})
    found = repair_all(folder, asking(dependencies=("std_msgs",)))
    assert [one.fix for one in found][1] == f"delete <{tags[1]}>msgs</{tags[1]}> on line 10"
    assert (folder / "package.xml").read_text().count("std_msgs") == 1


def test_a_name_that_is_written_apart_is_put_together_in_each_tag(tmp_path: Path) -> None:
    apart = "<build_depend>std</build_depend><build_depend>msgs</build_depend><exec_depend>std</exec_depend>"
    manifest = MANIFEST.replace("</package>", f"{apart}</package>")
    folder = package(tmp_path, {"package.xml": manifest})
    found = repair_all(folder, asking(dependencies=("std_msgs",)))
    assert {one.message for one in found} >= {
        f"there is no package {name}" for name in ("std", "msgs")
    } or found
    text = (folder / "package.xml").read_text()
    assert text.count(">std_msgs<") == 3
    assert ">msgs<" not in text


@pytest.mark.parametrize("given", ["$(arg from)", "$(env FROM)", "$(eval 'la' + 'b')"])
def test_a_package_that_a_launch_file_works_out_is_no_slip(tmp_path: Path, given: str) -> None:
    text = FILES[LAUNCHED].replace('pkg="lab"', f'pkg="{given}"')
    folder = package(
        tmp_path, {LAUNCHED: text.replace("<launch>", '<launch>\n  <arg name="from" default="lab"/>')}
    )
    assert find_repairs(folder, facts_of(folder), WANTED) == ()


@pytest.mark.parametrize(
    ("text", "changed"),
    [
        ("start = time.time()\nwhile time.time() < start + 1:\n", "rospy.get_time() < start"),
        ("from time import sleep\nsleep(1)\n", "from rospy import sleep"),
        ("time.sleep(0.1)  # a while\n", "rospy.sleep(0.1)"),
        ("start = self.time.time()\n", ""),
        ("start = rospy.get_time()\n", ""),
        ("# time.sleep(1)\n", ""),
    ],
)
def test_the_clock_of_ros_takes_the_place_of_the_computers(tmp_path: Path, text: str, changed: str) -> None:
    (tmp_path / "drive.py").write_text(f"import rospy\n{text}")
    found = ros_clock(tmp_path, "drive.py")
    assert (found is None) == (not changed)
    assert found is None or changed in found.after


def test_what_to_write_for_the_clock_of_ros_is_right_on_each_line(tmp_path: Path) -> None:
    text = "import rospy\n# time.time()\nfrom time import sleep  # a while\nstart = time.time()\n"
    (tmp_path / "drive.py").write_text(text)
    found = ros_clock(tmp_path, "drive.py")
    assert found is not None
    assert found.message.startswith("line 3 of drive.py: time.sleep and time.time() keep to")
    assert found.fix.startswith("on line 3, write `from rospy import sleep`; on line 4, measure time")


CPP_CMAKE = CMAKE.replace(" rospy", " roscpp") + "add_executable(a src/a.cpp)\n"
LINKED = "target_link_libraries(a ${catkin_LIBRARIES})\n"
OF_OWN = CMAKE.replace("rospy", "rospy geometry_msgs message_generation").replace(
    "catkin_p", "add_message_files(FILES Own.msg)\ngenerate_messages(DEPENDENCIES geometry_msgs)\ncatkin_p"
)
RIGHT_BUILDS = {
    "linked-in-a-loop": {
        CMAKELISTS: CPP_CMAKE + "foreach(t a)\n  target_link_libraries(${t} ${catkin_LIBRARIES})\nendforeach()\n"
    },
    "linked-all-at-once": {
        CMAKELISTS: CPP_CMAKE.replace("add_exe", "link_libraries(${catkin_LIBRARIES})\nadd_exe")
    },
    "variable-of-its-own": {CMAKELISTS: CPP_CMAKE + "set(catkin_LIBRARY x)\n" + LINKED.replace("RARIES", "RARY")},
    "another-name-of-a-program": {CMAKELISTS: CPP_CMAKE + LINKED + "add_executable(lab::a ALIAS a)\n"},
    "left-out-of-all": {CMAKELISTS: CPP_CMAKE.replace("(a ", "(a EXCLUDE_FROM_ALL ") + LINKED},
    "made-source": {CMAKELISTS: CPP_CMAKE.replace("add_exe", "configure_file(b.in b.cpp)\nadd_exe").replace(
        "a.cpp", "a.cpp b.cpp") + LINKED},
    "installed-by-another-file": {
        CMAKELISTS: CMAKE + "include(cmake/scripts.cmake)\n",
        "cmake/scripts.cmake": f"catkin_install_python(PROGRAMS {TALKER} DESTINATION lib/lab)\n",
    },
    "place-of-rosrun": {
        CMAKELISTS: CMAKE + f"catkin_install_python(PROGRAMS {TALKER} DESTINATION "
        "${CATKIN_GLOBAL_LIB_DESTINATION}/${PROJECT_NAME})\n"
    },
    "programs-in-lower-case": {
        CMAKELISTS: CMAKE + f"catkin_install_python(programs {TALKER} b.py DESTINATION "
        "${CATKIN_PACKAGE_BIN_DESTINATION} OPTIONAL)\n"
    },
    "metapackage": swapped(CMAKELISTS, ("catkin_package", "catkin_metapackage")),
    "catkin-simple": {
        CMAKELISTS: "cmake_minimum_required(VERSION 3.0.2)\nproject(lab)\nfind_package(catkin_simple REQUIRED)\n"
        "catkin_simple()\ncs_add_executable(a src/a.cpp)\ncs_install()\ncs_export()\n",
        "msg/Own.msg": "int8 a\n",
        "src/b.cpp": "#include <lab/Own.h>\n",
    },
    "another-library-s-program": {CMAKELISTS: CMAKE + "cuda_add_executable(a src/a.cpp)\n"},
    "roscpp-by-another-package": {
        CMAKELISTS: CPP_CMAKE.replace(" roscpp", " tf") + LINKED, "src/a.cpp": "#include <ros/ros.h>\nint main() {}\n",
    },
    "folder-first": {
        CMAKELISTS: CMAKE.replace("rospy", "rospy message_generation").replace(
            "catkin_p", "add_message_files(DIRECTORY msg FILES Own.msg)\ngenerate_messages()\ncatkin_p"),
        "msg/Own.msg": "int8 a\n",
    },
    "found-by-another-package": {
        CMAKELISTS: CMAKE.replace("rospy", "rospy message_generation").replace(
            "catkin_p", "add_message_files(FILES Own.msg)\ngenerate_messages(DEPENDENCIES nav_msgs)\ncatkin_p"),
        "msg/Own.msg": "Header header\ngeometry_msgs/Pose pose\n",
    },
    "found-by-what-nobody-knows": {
        CMAKELISTS: CMAKE.replace("rospy", "rospy message_generation").replace(
            "catkin_p", "add_message_files(FILES Own.msg)\ngenerate_messages(DEPENDENCIES arm_msgs)\ncatkin_p"),
        "msg/Own.msg": "geometry_msgs/Pose pose\n",
    },
    "waits-with-its-library": {
        CMAKELISTS: OF_OWN + "add_library(b src/b.cpp)\nadd_dependencies(b ${${PROJECT_NAME}_EXPORTED_TARGETS})\n"
        "add_executable(a src/a.cpp)\ntarget_link_libraries(a b)\n",
        "msg/Own.msg": "float64 b\n",
        **dict.fromkeys(("src/a.cpp", "src/b.cpp"), "#include <lab/Own.h>\nint main() {}\n"),
    },
    "bracket-of-no-tag": {
        **swapped(XML, ('"2">', '"2">>')), **swapped(LAUNCHED, ("<launch>", "<launch>\n  <!-- one --> -->"))
    },
    "another-package-s-node": {
        LAUNCHED: FILES[LAUNCHED].replace(
            "</", '<node pkg="lab2" type="talker.py" name="b"/>\n<!-- $(find labs) --></'),
        **swapped(XML, ("<depend>", "<depend>lab2</depend>\n  <depend>")),
    },
    "version-of-a-dependency": swapped(XML, ("<depend>", '<depend version_gte="1.11.0">')),
    "quoted-manifest": swapped(XML, (">x<", "><![CDATA[<version>one</version> & <depend>]]><")),
}  # fmt: skip


@pytest.mark.parametrize("name", RIGHT_BUILDS)
def test_what_a_right_build_says_in_another_way_is_left_alone(name: str, tmp_path: Path) -> None:
    folder = package(tmp_path, {"src/a.cpp": "int main() {}\n", "b.in": "", **RIGHT_BUILDS[name]})
    needs = asking(installed=(TALKER,) if "catkin_install" in str(RIGHT_BUILDS[name]) else ())
    assert find_repairs(folder, facts_of(folder), needs) == ()


@pytest.mark.parametrize("first", ["", "#!/usr/bin/env python\r\n", "\ufeff#!/usr/bin/env python2\n"])
def test_a_module_that_a_script_imports_needs_no_bit_and_no_first_line(tmp_path: Path, first: str) -> None:
    script = FILES[TALKER].replace("import rospy\n", "import rospy\nimport steps\n")
    folder = package(tmp_path, {TALKER: script, "src/steps.py": f"{first}ONE = 1\n"})
    (folder / "src" / "steps.py").chmod(0o644)
    assert find_repairs(folder, facts_of(folder), WANTED) == ()


WALKER = CPP_CMAKE.replace("(a ", "(walker ")
NODE_OF_CPP = ("</", '<node pkg="lab" type="walkr" name="a"/>\n</')
WHOLE = {
    "link": ({CMAKELISTS: f"{WALKER}target_link_libraries(walkr x)\n"}, "walker instead of"),
    "column": (
        {"config/a.yaml": "details:\nname:\n    first: Ann\n    last: Lee\n  phone: 1\n"},
        "begin the line with 2 spaces",
    ),
    "list of one line": ({"config/a.yaml": "limits: [1.0, 2.0\nspeed: 0.5\n"}, "write `limits: [1.0, 2.0]`"),
    "list": ({"config/a.yaml": "limits:\n  - 1.0\n  -2.0\n"}, "write `- 2.0`"),
    "program": (
        {CMAKELISTS: f"{WALKER}target_link_libraries(walker x)\n", **swapped(LAUNCHED, NODE_OF_CPP)},
        'type="walker"',
    ),
    "turned": (
        {CMAKELISTS: OF_OWN, "msg/Own.msg": "level float64\n", "src/a.cpp": "#include <lab/Own.h>\n"},
        "float64 level",
    ),
    "package": (
        {CMAKELISTS: OF_OWN, "msg/Own.msg": "geometry_msg/Point a\n"},
        "write `geometry_msgs/Point a`",
    ),
    "asked": ({CMAKELISTS: OF_OWN, "msg/Own.msg": "float64 b\nint a\n"}, "write `int64 a`"),
}


@pytest.mark.parametrize("name", WHOLE)
def test_one_repair_puts_it_right(name: str, tmp_path: Path) -> None:
    """What came before it made the file no better: a second fault, or another wrong value."""
    changes, fix = WHOLE[name]
    fields = {"package": "geometry_msgs/Point a", "asked": "float64 b\nint64 a"}.get(name, "")
    definitions = (("msg/Own.msg", tuple(parse_definition(fields, ".msg"))),) if fields else ()
    params = ("/details/name/first", "/details/name/last", "/details/phone") if name == "column" else ()
    wanted = asking(files=("config/a.yaml",), definitions=definitions, params=params)
    folder = package(tmp_path, {"src/a.cpp": "int main() {}\n", **changes})
    assert [fix in (one.fix or one.after) for one in repair_all(folder, wanted)] == [True]
    assert find_repairs(folder, facts_of(folder), wanted) == ()


def test_repairs_that_undo_each_other_end(monkeypatch: pytest.MonkeyPatch) -> None:
    def turn_round(text: str) -> Iterator[Step]:
        """As a repair that works on what another has made of the text."""
        turned = {"a = 1\n": "b = 1\n", "b = 1\n": "a = 1\n"}[text]
        yield from step_to("name", 1, text, turned)
        yield from turn_round(turned)

    monkeypatch.setattr(examine, "with_names", turn_round)
    (found,) = examine.examine([["a.py", "a = 1\n"]], [], {}, "")
    assert [step["text"] for step in found["steps"]] == ["b = 1\n"]


def test_what_a_run_ended_of_is_converted_there_and_where_the_same_is_joined_to_a_text(tmp_path):
    code = (
        "n = get()\nprint('a', n)\nlog('a: ' + n)\nlog('b: ' + n.data)\nlog('c: ' + str(n))\nlog('d: ' + n)\n"
    )
    (tmp_path / "a.py").write_text(code)
    found = conversions(tmp_path, "a.py", 3, "str", "n")
    assert [(one.line, one.after) for one in found] == [
        (3, "log('a: ' + str(n))"),
        (6, "log('d: ' + str(n))"),
    ]
    assert {one.fix for one in found} == {"write `str(n)` instead of `n`"}
    for one in found:
        apply_repair(tmp_path, one)
    assert (tmp_path / "a.py").read_text() == code.replace("' + n)", "' + str(n))")
    assert conversions(tmp_path, "b.py", 3, "str", "n") == []


def test_a_text_gets_its_place_at_the_line_where_a_run_ended(tmp_path):
    (tmp_path / "a.py").write_text(
        "log('Received: %d', m.data)\nlog('%d of %d', m.data, 3)\nlog('100 %done')\n"
    )
    (repair,) = text_place(tmp_path, "a.py", 1)
    assert (repair.after, repair.fix) == ("log('Received: %s', m.data)", "write `%s` instead of `%d`")
    assert [text_place(tmp_path, "a.py", line) for line in (2, 3, 9)] == [[], [], []]
