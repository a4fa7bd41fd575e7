"""What can be installed: ROS packages, Python modules and messages that exist, and the grader's own extras.

Whether a name in a student's file is one of these, and lacking here, is found where it is asked for:
`checks/support/missing_modules.py` for imports, `checks/support/build_errors.py` for builds.
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Collection, Iterable
from functools import cache
from importlib.util import find_spec
from pathlib import Path

from grader.errors import UsageError
from grader.wording import ON_THE_MACHINE, is_one_edit

SLIP_CHARS_MIN = 4
"""Shorter names differ by one letter because they are different names."""
_TABLE = Path(__file__).with_name("installable.txt")
DEFINITIONS = Path(__file__).with_name("noetic_messages.json")
NOT_WHOLE = {"tf2_msgs"}
"""Packages of which not all types are known."""
PIP = "pip:"
ROS_2 = {
    "rclpy",
    "rclcpp",
    "ament_cmake",
    "ament_python",
    "ament_index_python",
    "launch_ros",
    "ros2cli",
    "rosidl_runtime_py",
}
"""No machine for ROS 1 has these."""
OF_ROS = {"genmsg", "rosgraph_msgs", "rosunit"}
"""Packages of ROS that Debian has for Python alone."""
OF_EVERY_ROS = {
    "actionlib", "actionlib_msgs", "diagnostic_msgs", "geometry_msgs", "nav_msgs", "rosgraph", "rosgraph_msgs",
    "roslib", "rosnode", "rospkg", "rospy", "rosservice", "rostopic", "sensor_msgs", "shape_msgs", "std_msgs",
    "std_srvs", "tf2_msgs", "tf2_ros", "trajectory_msgs", "visualization_msgs",
}  # fmt: skip
"""Modules that come with any installation of ROS that a course uses."""
CMAKE_TOO = {"apriltag", "casadi", "dlib", "dynamixel_sdk", "keyboard", "pigpio", "serial", "torch", "zmq"}
"""Modules of Python whose names packages of ROS or of CMake have too."""
MODULE_OF = {
    name: module
    for module, names in {
        "math": "sqrt pi sin cos tan asin acos atan atan2 radians degrees hypot",
        "random": "randint uniform",
        "collections": "deque defaultdict namedtuple",
        "threading": "Thread Lock",
        "cv_bridge": "CvBridge CvBridgeError",
        "tf.transformations": "euler_from_quaternion quaternion_from_euler",
        "actionlib": "SimpleActionClient SimpleActionServer",
    }.items()
    for name in names.split()
}
"""What a script may use without an import, by its name, and the one module that it is taken from."""
_PREFIX = re.compile(r"/opt/ros/([a-z]+)\b")


@cache
def known_packages() -> dict[str, tuple[str, ...]]:
    """Return by the name in ROS or Python the Debian packages, or `pip:` and the name on PyPI; nothing where only ROS's
    own repository has it."""
    rows = _TABLE.read_text(encoding="utf-8").splitlines()
    words = (row.split() for row in rows if row and not row.startswith("#"))
    return {name: tuple(rest) for name, *rest in words}


@cache
def noetic_definitions() -> dict[str, tuple[str, str]]:
    """Return the full definition and the MD5 sum of ROS Noetic's own message types, by name (`sensor_msgs/JointState`).

    `make reference` takes them from rosbags, whose own module of them is slow to import.
    """
    found = json.loads(DEFINITIONS.read_bytes())
    return {name: (text, md5sum) for name, (text, md5sum) in found.items()}


@cache
def noetic_messages() -> dict[str, dict[str, tuple[str, ...]]]:
    """Return the fields of ROS Noetic's own message types by package and name (`sensor_msgs`: {`JointState`: …})."""
    found: dict[str, dict[str, tuple[str, ...]]] = {}
    for full, (text, _) in noetic_definitions().items():
        package, _, name = full.partition("/")
        if package not in NOT_WHOLE:
            own = text.partition("\n===")[0].splitlines()  # before the types that it needs
            fields = (line.split()[1] for line in own if line and "=" not in line)
            found.setdefault(package, {})[name] = tuple(fields)
    return found


LIBRARIES = {
    "PCL": "libpcl-dev",
    "OpenCV": "libopencv-dev",
    "Eigen3": "libeigen3-dev",
    "Eigen": "libeigen3-dev",
    "Boost": "libboost-all-dev",
    "Qt5": "qtbase5-dev",
    "yaml-cpp": "libyaml-cpp-dev",
    "VTK": "libvtk9-dev",
    "OpenGL": "libgl-dev",
    "GLUT": "freeglut3-dev",
    "SDL": "libsdl1.2-dev",
    "SDL2": "libsdl2-dev",
    "CURL": "libcurl4-openssl-dev",
    "Ceres": "libceres-dev",
    "Protobuf": "libprotobuf-dev",
    "GTest": "libgtest-dev",
    "Bullet": "libbullet-dev",
    "octomap": "liboctomap-dev",
    "TBB": "libtbb-dev",
    "PythonLibs": "python3-dev",
    "Curses": "libncurses-dev",
}
"""Libraries beside ROS that `find_package` finds, with Debian's packages."""
TUTORIALS = frozenset({"beginner_tutorials", "learning_joy", "my_package", "package_name", "your_package"})
"""What handouts call a student's package: a name that is copied from them stands for one of the student's own."""
PYTHON_2 = {
    "ConfigParser": "configparser", "Queue": "queue", "SocketServer": "socketserver", "StringIO": "io",
    "Tkinter": "tkinter", "cPickle": "pickle", "commands": "subprocess", "httplib": "http.client",
    "thread": "_thread", "tkMessageBox": "tkinter.messagebox", "urllib2": "urllib.request",
    "urlparse": "urllib.parse",
}  # fmt: skip
"""Modules of Python 2 by their names, and what they are called in Python 3."""
WINDOWS = frozenset({
    "_msi", "_winapi", "msilib", "msvcrt", "nt", "pythoncom", "pywintypes", "win32api", "win32com", "win32con",
    "win32gui", "winreg", "winsound",
})  # fmt: skip
"""Modules of Python that only Windows has; editors that complete names add imports of them."""


def exists_somewhere(name: str, own: Collection[str]) -> bool:
    """Return whether a module or package that is not here is the machine's to have: its name is not a slip of one of
    Python's, of ROS's or of the student's `own`, and stands in no handout for the student's package."""
    if name in WINDOWS:
        return False
    if name in known_packages() or name in sys.stdlib_module_names:
        return True
    return name not in {*ROS_2, *TUTORIALS, *PYTHON_2, *own} and not nearest_module(name, own)


def nearest_module(name: str, own: Collection[str]) -> str:
    """Return the module or package for which the name is a slip: capitals, underscores, one letter; "" for none."""
    plain = name.casefold().replace("_", "")
    first, last = (*own, "rospy", "roscpp", "catkin", *noetic_messages()), sys.stdlib_module_names
    # in the order in which a student most likely means them; Python's own modules come last
    for one in (*first, *known_packages(), *sorted(last)) if name not in own else ():
        other = one.casefold().replace("_", "")
        same = other == plain and one not in known_packages()  # modules of PyPI may differ in capitals alone
        if one != name and (
            same or (len(other) >= SLIP_CHARS_MIN and other != plain and is_one_edit(other, plain))
        ):
            return one
    return ""


def is_python_module(name: str) -> bool:
    """Return whether it is a known module of Python that is none of ROS's."""
    packages = known_packages().get(name, ())  # none: only ROS's own repository has it
    return (
        name not in OF_ROS and bool(packages) and all(one.startswith((PIP, "python3-")) for one in packages)
    )


def is_no_package(name: str) -> bool:
    """Return whether it is a known module of Python, and nothing that `find_package(…)` finds has its name."""
    return is_python_module(name) and name not in CMAKE_TOO


def install_hint(
    name: str, lines: Iterable[str] = (), *, module: bool = False, also: Iterable[str] = ()
) -> str:
    """Return what the grading machine needs, by the distribution of ROS that these lines of output name. `module`: it
    is imported in Python, and may be none of ROS's; `also` are known ones besides."""
    ros = next((found[1] for found in map(_PREFIX.search, lines) if found), "")
    known, what = name in known_packages(), "module" if module else "package"
    own = "" if known else f"; a {what} of the student's own has to be pushed with this package"
    source = ros or ("noetic" if name in OF_ROS and not module else "")
    command = install_command(name, source) if known or not module else f"install the Python module {name}"
    commands = ", ".join([command, *map(install_command, also)])
    return f"{ON_THE_MACHINE}{commands}, then grade again{own}"


PROGRAMS_OF_ROS = {
    "joint_state_publisher": ("joint_state_publisher",),
    "joy": ("joy_node",),
    "map_server": ("map_server", "map_saver"),
    "robot_state_publisher": ("robot_state_publisher", "state_publisher"),
    "teleop_twist_keyboard": ("teleop_twist_keyboard.py",),
    "tf": ("static_transform_publisher", "tf_echo", "tf_monitor", "tf_remap", "view_frames"),
    "tf2_ros": ("static_transform_publisher", "buffer_server"),
    "topic_tools": ("drop", "mux", "relay", "throttle", "transform"),
}
"""What launch files start of ROS's packages. Debian has some of these packages without their programs."""


def install_command(name: str, ros: str = "") -> str:
    """Return how a package is installed; `ros` is the distribution below /opt/ros, "" for Debian's own ROS."""
    packages = known_packages().get(name, ())
    if not ros and name not in known_packages():
        return f"install the ROS package {name}"
    if packages and packages[0].startswith(PIP):
        return f"pip install {packages[0].removeprefix(PIP)}"
    if packages and not ros:
        return f"apt-get install {' '.join(packages)}"
    return f"apt-get install ros-{ros or 'noetic'}-{name.replace('_', '-')}, from ROS's own repository"


def install_extra(extra: str) -> str:
    """Return the command that adds what an extra of the grader needs (`review`) to the environment that it runs in."""
    from importlib.metadata import requires  # noqa: PLC0415 - slow to load, and few need it

    from packaging.requirements import Requirement  # noqa: PLC0415 - as above

    needs = map(Requirement, requires("ros-lab-grader") or ())
    names = " ".join(
        f"'{need.name}{need.specifier}'"
        for need in needs
        if need.marker and need.marker.evaluate({"extra": extra}) and not need.marker.evaluate({"extra": ""})
    )
    pipx = Path(sys.prefix, "pipx_metadata.json").is_file()
    return f"pipx inject ros-lab-grader {names}" if pipx else f"{sys.executable} -m pip install {names}"


def require_extra(extra: str, what_for: str, *modules: str) -> None:
    """Raise UsageError where modules of an extra of the grader are not installed."""
    missing = [name for name in modules if find_spec(name) is None]
    if missing:
        raise UsageError(
            f"{what_for} needs packages that are not installed: {', '.join(missing)}",
            hint=install_extra(extra),
        )
