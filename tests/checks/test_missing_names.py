"""What is said of an import that fails: messages that are not built, modules that are elsewhere or not there."""

from __future__ import annotations

import re

import pytest

from grader.checks.support.exit_causes import explain_traceback
from tests.checks.tracebacks import SCRIPT, explained, package_of, raised

pytestmark = pytest.mark.usefixtures("without_processes")

LIBRARY = "/opt/ros/noetic/lib/python3/dist-packages/rospy/__init__.py"
IMPORTS = ("src/talker.py", 1, "import rospy")
INSIDE = (LIBRARY, 47, "from .client import spin")
NO_LAB = "ModuleNotFoundError: No module named 'lab'"


@pytest.mark.parametrize(
    ("source", "error", "hint"),
    [
        ("from lab.action import CountAction, CountResult",
         "ModuleNotFoundError: No module named 'lab.action'",
         "write `from lab.msg import CountAction, CountResult`"),
        ("from lab.srv import Reading", "ImportError: cannot import name 'Reading' from 'lab.srv' (/d/__init__.py)",
         "write `from lab.msg import Reading`"),
        ("import lab.Reading", "ModuleNotFoundError: No module named 'lab.Reading'",
         "write `from lab.msg import Reading`"),
        ("from lab import Reading", "ImportError: cannot import name 'Reading' from 'lab' (/d/__init__.py)",
         "write `from lab.msg import Reading`"),
        ("from lab.msg import reading", "ImportError: cannot import name 'reading' from 'lab.msg' (/d/__init__.py)",
         "write `from lab.msg import Reading`"),
        ("from lab.msg import Count", "ImportError: cannot import name 'Count' from 'lab.msg' (/d/__init__.py)",
         "write `from lab.msg import CountAction`"),
        ("from std_msgs.msg import String, Reading",
         "ImportError: cannot import name 'Reading' from 'std_msgs.msg' (/d/__init__.py)",
         "write `from std_msgs.msg import String` and `from lab.msg import Reading`"),
        ("from beginner_tutorials.srv import Add, AddResponse",
         "ModuleNotFoundError: No module named 'beginner_tutorials'",
         "write `from lab.srv import Add, AddResponse`"),
        ("import beginner_tutorials.msg as m", "ModuleNotFoundError: No module named 'beginner_tutorials'",
         "write `import lab.msg as m`"),
        ("import std_msg.msg as m", "ModuleNotFoundError: No module named 'std_msg'",
         "write `import std_msgs.msg as m`"),
        # the build has made some of them, and not these
        ("from lab.msg import Reading", "ImportError: cannot import name 'Reading' from 'lab.msg' (/d/__init__.py)",
         "list Reading.msg in add_message_files(…)"),
        ("from lab.srv import Sum", "ImportError: cannot import name 'Sum' from 'lab.srv' (/d/__init__.py)",
         "write the one that you mean instead of Sum"),
        # it has made none
        ("from lab.msg import Reading", "ModuleNotFoundError: No module named 'lab'",
         "first get the build to pass: catkin_make"),
    ],
)  # fmt: skip
def test_a_class_that_the_build_makes_is_imported_from_its_module(tmp_path, source, error, hint):
    files = {
        "CMakeLists.txt": "generate_messages()\n",
        "msg/Reading.msg": "",
        "srv/Add.srv": "---\n",
        "action/Count.action": "---\n---\n",
        "node.py": SCRIPT,
    }
    end = explained(tmp_path, files, ("node.py", 1, source), error=error)
    assert end.hint == hint
    assert end.unbuilt == (not hint.startswith(("write `from", "write `import")))


@pytest.mark.parametrize(
    ("cmake", "error", "hint"),
    [
        ("add_service_files(FILES Sum.srv)", "NameError: name 'Add' is not defined. Did you mean: 'add'?",
         "list Add.srv in add_service_files(…)"),
        ("add_service_files(FILES Sum.srv)", "NameError: name 'AddResponse' is not defined",
         "list Add.srv in add_service_files(…)"),
        # the build makes it: the import is of another module, or comes later
        ("add_service_files(FILES Sum.srv Add.srv)", "NameError: name 'Add' is not defined", "check the spelling"),
        ("add_service_files(DIRECTORY srv)", "NameError: name 'Add' is not defined", "check the spelling"),
        ("add_service_files(FILES Sum.srv)", "NameError: name 'Sub' is not defined", "check the spelling"),
    ],
)  # fmt: skip
def test_a_name_that_a_star_does_not_bring_is_one_that_the_build_has_not_made(tmp_path, cmake, error, hint):
    line = "add = rospy.ServiceProxy('add', Add)"
    files = {
        "CMakeLists.txt": f"{cmake}\ngenerate_messages()\n",
        "srv/Add.srv": "---\n",
        "srv/Sum.srv": "---\n",
        "node.py": f"from lab.srv import *\n{line}\n",
    }
    end = explained(tmp_path, files, ("node.py", 2, line), error=error)
    assert end.hint.startswith(hint)
    assert (
        ("the build has not made it from srv/Add.srv" in end.cause) == end.unbuilt == hint.startswith("list")
    )
    assert "Did you mean" not in end.cause


def test_without_its_file_for_cmake_a_package_has_no_messages(tmp_path):
    line = "from lab.srv import Add"
    files = {"srv/Add.srv": "---\n", "node.py": f"{line}\n"}
    assert explained(tmp_path, files, ("node.py", 1, line), error=NO_LAB).hint == (
        "first add the CMakeLists.txt that `catkin_create_pkg` writes. In it, list Add.srv in add_service_files(…), "
        "and call generate_messages(…)"
    )


@pytest.mark.parametrize(
    ("source", "hint"),
    [
        (
            "from lab.srv import Add, AddResponse",
            "write srv/Add.srv, list it in add_service_files(…), and call",
        ),
        ("from lab.srv import AddResponse", "write srv/Add.srv, list it in add_service_files(…), and call"),
        ("from lab.msg import *", "write the definition in msg/, list it in add_message_files(…), and call"),
        ("import lab", "delete line 1"),
    ],
)
def test_a_package_without_any_definition_is_told_what_to_write(tmp_path, source, hint):
    files = {"CMakeLists.txt": "catkin_package()\n", "node.py": f"{source}\n"}
    assert explained(tmp_path, files, ("node.py", 1, source), error=NO_LAB).hint.startswith(hint)


@pytest.mark.parametrize(
    ("asked", "cmake", "hint"),
    [
        ("lab_msgs", "", "first get the build to pass: catkin_make"),
        ("lab", "catkin_package()\n", "write `from lab_msgs.msg import Reading`"),  # its own is a copy
        (
            "lab",
            "add_message_files(FILES Reading.msg)\n",
            "call generate_messages(…) above catkin_package(…)",
        ),
    ],
)
def test_the_message_is_that_of_the_package_that_makes_it(tmp_path, asked, cmake, hint):
    made = "add_message_files(FILES Reading.msg)\ngenerate_messages()\n"
    line = f"from {asked}.msg import Reading"
    lab, messages = (
        package_of(tmp_path / name, {"msg/Reading.msg": "int8 a\n", "CMakeLists.txt": text, **more}, name)
        for name, text, more in (("lab", cmake, {"node.py": f"{line}\n"}), ("lab_msgs", made, {}))
    )
    package = lab.model_copy(update={"also": (messages,)})
    found = raised(package, ("node.py", 1, line), error=f"ModuleNotFoundError: No module named '{asked}'")
    assert explain_traceback(found, package).hint == hint


@pytest.mark.parametrize(
    ("files", "made", "cause", "hint"),
    [
        (["src/talker.py", "src/texts.py"], True, "does not look beside it",
         "write `import os, sys; sys.path.insert(0, os.path.dirname(__file__))` above the import"),
        (["src/talker.py", "scripts/texts.py"], False, "scripts/texts.py is in another folder",
         "os.path.join(os.path.dirname(__file__), '../scripts')"),
        (["src/talker.py", "src/texts.py"], False, "", "check the spelling of the import"),
        (["src/talker.py", "build/texts.py"], True, "", "a module of the student's own has to be pushed"),
    ],
)  # fmt: skip
def test_a_module_of_the_students_own_is_told_from_one_that_is_not_there(tmp_path, files, made, cause, hint):
    frames = [("/home/student/catkin_ws/devel/lib/lab/talker.py", 15, "exec(…)")] if made else []
    frames.append(("src/talker.py", 4, "import texts"))
    error = "ModuleNotFoundError: No module named 'texts'"
    end = explained(tmp_path, dict.fromkeys(files, SCRIPT), *frames, error=error)
    assert cause in end.cause
    assert hint in end.hint


def test_a_module_that_the_build_made_a_program_of_is_told(tmp_path):
    made = "/home/student/catkin_ws/devel/lib/lab"
    frames = [(f"{made}/talker.py", 15, "exec(…)"), ("src/talker.py", 4, "from texts import say")]
    error = f"ImportError: cannot import name 'say' from 'texts' ({made}/texts.py)"
    end = explained(tmp_path, dict.fromkeys(["src/talker.py", "src/texts.py"], SCRIPT), *frames, error=error)
    assert "catkin_install_python makes a program of src/texts.py" in end.cause
    assert "sys.path.insert(0, os.path.dirname(__file__))" in end.hint


@pytest.mark.parametrize(
    ("line", "owner", "hint"),
    [
        ("self.t = rospy.create_timer(0.1, self.tell)", "module 'rospy'",
         "write `rospy.Timer(rospy.Duration(0.1), self.tell)` in place of that call"),
        ("self.p = self.create_publisher(String, 'chatter', 10)", "'Talker' object",
         "write `rospy.Publisher('chatter', String, queue_size=10)` in place of that call"),
        ("self.get_logger().info('hello')", "'Talker' object", "write `rospy.loginfo('hello')` in place"),
        ("n.create_subscription(", "'Talker' object", "write `rospy.Subscriber(…, …, …)` in place"),
    ],
)  # fmt: skip
def test_a_method_of_ros_2_is_told_with_rospys_call(tmp_path, line, owner, hint):
    name = re.search(r"create_\w+|get_logger", line)[0]
    end = explained(
        tmp_path,
        {"src/a.py": SCRIPT},
        ("src/a.py", 4, line),
        error=f"AttributeError: {owner} has no attribute '{name}'",
    )
    assert "is from ROS 2" in end.cause
    assert hint in end.hint


@pytest.mark.parametrize(
    ("file", "line", "error", "cause"),
    [
        ("scripts/lab.py", "from lab.msg import Reading",
         "ModuleNotFoundError: No module named 'lab.msg'; 'lab' is not a package", "the package lab is meant"),
        ("scripts/std_msgs.py", "from std_msgs.msg import String",
         "ModuleNotFoundError: No module named 'std_msgs.msg'; 'std_msgs' is not a package",
         "the package std_msgs is meant"),
        ("scripts/turtle.py", "import turtle",
         "AttributeError: partially initialized module 'turtle' has no attribute 'Turtle' (most likely due to …)",
         "the module turtle is meant"),
    ],
)  # fmt: skip
def test_a_script_with_the_name_of_what_it_imports_is_told(tmp_path, file, line, error, cause):
    files = {"msg/Reading.msg": "int32 level\n", file: SCRIPT}
    end = explained(tmp_path, files, (file, 1, line), error=error)
    assert f"Python finds {file} where {cause}" in end.cause
    assert end.hint == f"give {file} another name, everywhere it is named"
    assert not end.unbuilt


@pytest.mark.parametrize(
    ("setup", "calls", "hint"),
    [
        (False, "", "write setup.py as http"),
        (True, "", "call catkin_python_setup() above catkin_package(…)"),
        (True, "catkin_python_setup()\n", "check the spelling of the import"),
    ],
)
def test_a_python_package_that_the_build_does_not_make_known_is_told(tmp_path, setup, calls, hint):
    scripts = ("src/lab/__init__.py", "scripts/talker.py", *(["setup.py"] if setup else []))
    files = {"CMakeLists.txt": f"project(lab)\n{calls}catkin_package()\n", **dict.fromkeys(scripts, SCRIPT)}
    frame = ("scripts/talker.py", 4, "from lab.texts import hello")
    assert hint in explained(tmp_path, files, frame, error=NO_LAB).hint


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
    end = explained(tmp_path, dict.fromkeys(("src/talker.py", *files), SCRIPT), *frames, error=error)
    assert end.of_machine == of_machine
    assert (LIBRARY in end.cause) == of_machine


@pytest.mark.parametrize(
    ("file", "of_machine"), [("scripts/pygame", True), ("scripts/pygame.py", False), ("msg/Pygame.msg", True)]
)
def test_a_picture_with_a_modules_name_is_no_module(tmp_path, file, of_machine):
    files = {"a.py": "import pygame\npygame.init()\n", file: "%!PS-Adobe-3.0\n"}
    error = "ModuleNotFoundError: No module named 'pygame'"
    assert explained(tmp_path, files, ("a.py", 1, "import pygame"), error=error).of_machine == of_machine


def test_a_module_that_is_used_and_not_imported_is_meant_by_one_that_is_not_there(tmp_path):
    files = {"a.py": "import ros\nrospy.init_node('a')\n", "b.py": "import ros\nros.start()\n"}
    error = "ModuleNotFoundError: No module named 'ros'"
    here, there = (explained(tmp_path, files, (file, 1, "import ros"), error=error) for file in files)
    assert here.hint == "write rospy instead of ros"
    assert not here.of_machine
    assert there.of_machine


def test_a_module_that_exists_and_is_used_is_the_one_that_is_meant_though_another_is_not_imported(tmp_path):
    """All that the machine lacks is told at once, ROS's packages too, and none of the package's own."""
    source = (
        "import moveit_commander\nimport serial\nfrom mavros_msgs.msg import State\n"
        "import zmq\nprint(moveit_commander, serial, State, zmq, time.time())\n"
    )
    files = {"src/a.py": source, "src/zmq.py": ""}
    end = explained(
        tmp_path,
        files,
        ("src/a.py", 1, "import moveit_commander"),
        error="ModuleNotFoundError: No module named 'moveit_commander'",
    )
    assert end.of_machine
    assert end.cause.endswith("this grading machine lacks moveit_commander, serial and mavros_msgs")


@pytest.mark.parametrize(
    ("line", "hint"),
    [
        ("from lab import Num", "write `from lab.msg import Num`"),
        ("from json import nums", "delete line 1: nothing in the script uses `nums`"),
    ],
)
def test_an_import_of_the_packages_own_message_is_corrected_though_nothing_uses_it_yet(tmp_path, line, hint):
    package, _, name = line.split()[1:]
    files = {"src/a.py": f"{line}\nimport rospy\nrospy.init_node('a')\n", "msg/Num.msg": "int64 a\n"}
    error = f"ImportError: cannot import name '{name}' from '{package}' (/ws/devel/lib/python3/{package}/__init__.py)"
    end = explained(tmp_path, files, ("src/a.py", 1, line), error=error)
    assert end.hint == hint
