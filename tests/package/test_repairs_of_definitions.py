"""Mistakes in a package's own messages, services and actions, in one table: definitions, and what makes them."""

from __future__ import annotations

from pathlib import Path

import pytest

from grader.model.message_definitions import parse_definition
from tests.package.repairing import (
    CMAKE,
    CMAKELISTS,
    MANIFEST,
    OWN,
    OWN_CMAKE,
    RUN_OWN,
    SCRIPT,
    TALKER,
    XML,
    Case,
    asking,
    check,
    package,
    repair_all,
    swapped,
)

pytestmark = pytest.mark.usefixtures("without_processes")

GENERATED = OWN_CMAKE.replace("catkin_p", "generate_messages()\ncatkin_p")
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


def own_from(module: str) -> dict[str, str]:
    """Return a package with a message, which its talker imports from this module."""
    return {
        **OWN,
        **swapped(TALKER, ("import Int8\n", f"import Int8\nfrom {module} import Level\nlevel = Level\n")),
    }


GO_FIELDS = tuple(parse_definition("int32 n\n---\nbool there\n---\nint32 left\n", ".action"))
SUM_FIELDS = tuple(parse_definition("int64 a\nint64 b\n---\nint64 sum", ".srv"))
SERVE_SUM = """\
import rospy
from lab.srv import Two, TwoResponse

rospy.init_node('serve')
rospy.Service('add', Two, lambda one: TwoResponse(one.x + one.y))
rospy.spin()
"""
TWO_FIELDS = tuple(parse_definition("int64 a\n---\nint64 sum", ".srv"))
LEVEL_FIELDS = tuple(
    parse_definition("float64 level\nstring[] names\nint8 b", ".msg")
)  # a number of another size and another name of a type are left as they are
TEMPLATE = """\
# add_message_files(
#   FILES
#   Message1.msg
# )
# generate_messages(
#   DEPENDENCIES
#   std_msgs
# )"""

TWO_CALLS = CMAKE.replace("rospy)", "rospy\n)").replace("catkin_package()", "catkin_package(\n)")

CASES = {
    "two-brackets-in-comments": Case(
        {CMAKELISTS: TWO_CALLS.replace("\n)", "\n# )")}, ["build-line"] * 2, "remove the `#` on line 6",
        after={CMAKELISTS: TWO_CALLS},
    ),
    "two-brackets-missing": Case(
        {CMAKELISTS: TWO_CALLS.replace("\n)", "\n")}, ["build-line"] * 2, "the `(` of `catkin_package(` is",
        after={CMAKELISTS: "COMPONENTS rospy)\n"},
    ),
    "definitions-that-nothing-uses": Case(
        {CMAKELISTS: OWN_CMAKE + "generate_messages(DEPENDENCIES std_msgs)\n"},
        ["build-line"], "add_message_files(…) needs the folder msg/, which is not there",
        after={CMAKELISTS: "message_generation rospy)\n\ncatkin_package"},
    ),
    "no-keyword-before-the-files": Case(
        {**RUN_OWN, CMAKELISTS: GENERATED.replace("FILES L", "L")}, ["build-line"], "write FILES before Level.msg",
        after={CMAKELISTS: GENERATED},
    ),
    "no-keyword-before-the-packages": Case(
        {**RUN_OWN, CMAKELISTS: GENERATED.replace("messages()", "messages(std_msgs)")}, ["build-line"],
        "write DEPENDENCIES before std_msgs", after={CMAKELISTS: "generate_messages(DEPENDENCIES std_msgs)\n"},
    ),
    **{f"first-line-missing-above-{rest[:5]}": Case(
        {**RUN_OWN, CMAKELISTS: GENERATED.replace(f"{head}({inside})", f"\n  {rest})")}, ["build-line"], f"`{head}(",
        after={CMAKELISTS: f"{head}(\n  {rest})"},
    ) for head, inside, rest in (
        ("add_message_files", "FILES Level.msg", "FILES\n Level.msg\n"),
        ("generate_messages", "", "DEPENDENCIES std_msgs\n"),
    )},
    "own-name": Case({XML: MANIFEST.replace(">lab<", ">mine<"), CMAKELISTS: CMAKE.replace("lab", "mine")},
                 ["package-name"], "the package is called mine, not lab"),
    "own-package-misspelt": Case(
        {**OWN, **swapped(TALKER, ("import Int8\n", "import Int8\nfrom alb.msg import Level\n")), CMAKELISTS: OWN_CMAKE,
         XML: MANIFEST.replace("rospy</depend>", "rospy</depend><build_depend>message_generation</build_depend>")},
        ["build-line", "missing-import"], "there is no package alb", after={TALKER: "from lab.msg import Level"}),
    "own-message-of-another-package": Case(
        {**own_from("std_msgs.msg"), CMAKELISTS: GENERATED}, ["missing-import"],
        "line 4 of src/talker.py: std_msgs.msg has no Level", after={TALKER: "from lab.msg import Level\n"}),
    "own-message-of-the-tutorial": Case(
        {**own_from("beginner_tutorials.msg"), CMAKELISTS: GENERATED}, ["missing-import"],
        "beginner_tutorials.msg has no Level", after={TALKER: "from lab.msg import Level\n"}),
    "own-message-among-services": Case(
        {**own_from("lab.srv"), CMAKELISTS: GENERATED}, ["missing-import"], "lab.srv has no Level",
        after={TALKER: "from lab.msg import Level\n"}),
    "own-message-of-a-package-that-may-have-it": Case(
        {**own_from("kobuki_msgs.msg"), CMAKELISTS: GENERATED}, []),
    "own-service-of-a-package-that-has-it": Case(
        {**SERVICE, **swapped(TALKER, ("import Int8\n", "import Int8\nfrom std_srvs.srv import Empty\nused = Empty\n")),
         "srv/Empty.srv": "---\n", CMAKELISTS: SERVICE_CMAKE.replace("Two.srv", "Two.srv Empty.srv")}, []),
    "own-message-that-nothing-makes": Case(
        {**OWN, **swapped(TALKER, ("import Int8\n", "import Int8\nfrom lab.msg import Level\nlevel.level = 1\n")),
         CMAKELISTS: GENERATED}, ["missing-call"], "line 5 of src/talker.py: level is not defined",
        after={TALKER: "level = Level()\nlevel.level = 1\n"}),
    "own-message-in-small-letters": Case(
        {**OWN, **swapped(TALKER, ("import Int8\n", "import Int8\nfrom lab.msg import Level\nhigh = level()\n")),
         CMAKELISTS: GENERATED}, ["missing-call"], "level is not defined", after={TALKER: "high = Level()"}),
    "own-message": Case(
        {**RUN_OWN, CMAKELISTS: CMAKE}, ["build-line"] * 3, "write message_generation after COMPONENTS",
        after={CMAKELISTS: OWN_CMAKE.replace("\ncatkin_p", "\ngenerate_messages()\ncatkin_p")},
    ),
    "own-message-that-is-a-copy-of-another-package-s": Case(
        {**RUN_OWN, CMAKELISTS: CMAKE}, [], wanted=asking(types=("lab_msgs/Level",))),
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
    "own-message-and-services-of-no-file": Case(
        {**RUN_OWN, CMAKELISTS: OWN_CMAKE.replace(
            "catkin_p", "add_service_files(\n  FILES\n)\ngenerate_messages()\ncatkin_p")}, ["build-line"],
        "delete lines 5 to 7, add_service_files(…)",
        after={CMAKELISTS: OWN_CMAKE.replace("catkin_p", "\n\n\ngenerate_messages()\ncatkin_p")},
    ),
    "own-message-after-package": Case(
        {**OWN, CMAKELISTS: OWN_CMAKE + "generate_messages(\n)\n"}, ["build-line"],
        "move generate_messages(…), from line 6, above catkin_package(…)",
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
    "own-message-with-a-header-that-another-package-brings": Case(
        {**OWN, "msg/Level.msg": "Header header\ngeometry_msgs/Point at\n",
         CMAKELISTS: OWN_CMAKE.replace("catkin_p", "generate_messages(DEPENDENCIES geometry_msgs)\ncatkin_p")}, [],
    ),
    "own-messages-of-a-folder": Case(
        {**OWN, "msg/Old.msg": "geometry_msgs/Point at\n",
         CMAKELISTS: OWN_CMAKE.replace("FILES Level.msg", "DIRECTORY msg")
         .replace("catkin_p", "generate_messages(DEPENDENCIES std_msgs)\ncatkin_p")},
        ["build-line"] * 2, "write geometry_msgs after DEPENDENCIES",
    ),
    "messages-of-no-definition": Case(
        {CMAKELISTS: CMAKE.replace("catkin_p", "generate_messages(DEPENDENCIES std_msgs)\ncatkin_p")}, ["build-line"],
        "delete line 4, generate_messages(…)", after={CMAKELISTS: "rospy)\n\ncatkin_package()"},
    ),
    "own-action-without-its-messages": Case(
        {"src/go.py": "from lab.msg import GoAction\n", "action/Go.action": "int32 n\n---\nint32 n\n---\nint32 n\n",
         CMAKELISTS: ACTION_CMAKE.replace("actionlib_msgs std", "std")},
        ["build-line"], "write actionlib_msgs after DEPENDENCIES",
    ),
    "own-action-whose-messages-find-genmsg": Case(
        {"src/go.py": "from lab.msg import GoAction\n", "action/Go.action": "int32 n\n---\nint32 n\n---\nint32 n\n",
         CMAKELISTS: ACTION_CMAKE.replace("message_generation ", "")}, [],
    ),
    "own-action-and-no-calls": Case(
        {"src/talker.py": "#!/usr/bin/env python3\nfrom lab.msg import GoAction\n",
         "action/Go.action": "int32 n\n---\nint32 n\n---\nint32 n\n"},
        ["build-line"] * 3, "write actionlib_msgs message_generation after",
        after={CMAKELISTS: "generate_messages(DEPENDENCIES actionlib_msgs)"},
    ),
    "messages-and-services-without-generation": Case(
        {"src/talker.py": "#!/usr/bin/env python3\nfrom lab.msg import Num\n", "msg/Num.msg": "int8 a\n",
         "srv/Add.srv": "---\n",
         CMAKELISTS: CMAKE.replace("rospy)\n", "message_generation rospy)\nadd_message_files(FILES Num.msg)\n"
                                                "add_service_files(FILES Add.srv)\n")},
        ["build-line"], "does not call generate_messages(…)",
        after={CMAKELISTS: "add_service_files(FILES Add.srv)\ngenerate_messages()\n"},
    ),
    "own-action-in-another-order": Case(
        {"src/go.py": "from lab.msg import GoAction\n",
         "action/Go.action": "int32 n  # how far\n---\nint32 left\n---\nbool there\n",
         CMAKELISTS: ACTION_CMAKE},
        ["build-line"], "result and feedback have changed places",
        asking(definitions=(("action/Go.action", GO_FIELDS),)),
        {"action/Go.action": "int32 n  # how far\n---\nbool there\n---\nint32 left\n"},
    ),
    "own-action-without-its-dividers": Case(
        {"src/go.py": "from lab.msg import GoAction\n", "action/Go.action": "int32 n\nbool there\nint32 left",
         CMAKELISTS: ACTION_CMAKE},
        ["build-line"], "write a line `---` below lines 1 and 2",
        asking(definitions=(("action/Go.action", GO_FIELDS),)),
        {"action/Go.action": "int32 n\n---\nbool there\n---\nint32 left"},
    ),
    "own-service-without-its-divider": Case(
        {**SERVICE, "srv/Two.srv": "int64 a\nint64 sum\n", TALKER: SCRIPT + "from lab.srv import Two\n",
         CMAKELISTS: SERVICE_CMAKE}, ["build-line"], "below line 1 add `---`",
        asking(definitions=(("srv/Two.srv", TWO_FIELDS),)), {"srv/Two.srv": "int64 a\n---\nint64 sum\n"},
    ),
    "own-service-that-is-empty": Case(
        {**SERVICE, "srv/Two.srv": "# A sum.\n", TALKER: SCRIPT + "from lab.srv import Two\n",
         CMAKELISTS: SERVICE_CMAKE}, ["build-line"], "srv/Two.srv: write into it, each on a line of its own: `int64 a`",
        asking(definitions=(("srv/Two.srv", TWO_FIELDS),)), {"srv/Two.srv": "# A sum.\nint64 a\n---\nint64 sum\n"},
    ),
    "own-message-without-a-field-and-a-constant": Case(
        {**OWN, "msg/Level.msg": "string[] names\nint8 b\n", CMAKELISTS: GENERATED}, ["build-line"] * 2,
        "add the line `float64 level`",
        asking(definitions=(("msg/Level.msg", LEVEL_FIELDS),),
               constants=(("msg/Level.msg", tuple(parse_definition("int32 OFF=0", ".msg"))),)),
        {"msg/Level.msg": "float64 level\nstring[] names\nint8 b\nint32 OFF=0\n"},
    ),
    "own-message-with-another-field": Case(
        {**OWN, "msg/Level.msg": "float64 depth\nstring[] names\nint8 b\n", CMAKELISTS: GENERATED}, ["build-line"],
        "line 1 of msg/Level.msg calls it depth, but the handout calls it level",
        asking(definitions=(("msg/Level.msg", LEVEL_FIELDS),)),
        {"msg/Level.msg": "float64 level\nstring[] names\nint8 b\n"},
    ),
    "own-service-with-other-fields": Case(
        {"src/serve.py": SERVE_SUM, "srv/Two.srv": "int64 x\nint64 y\n---\nint64 sum\n", CMAKELISTS: SERVICE_CMAKE},
        ["build-line"] * 2 + ["missing-call"], "src/serve.py uses the fields x and y, which the handout calls a and b",
        asking(definitions=(("srv/Two.srv", SUM_FIELDS),)),
        {"src/serve.py": SERVE_SUM.replace(".x + one.y", ".a + one.b"),
         "srv/Two.srv": "int64 a\nint64 b\n---\nint64 sum\n"},
    ),
    "own-service-with-other-fields-in-both-parts": Case(
        {"src/serve.py": SERVE_SUM, "srv/Two.srv": "int64 x\nint64 y\n---\nint64 sum\n", CMAKELISTS: SERVICE_CMAKE},
        ["build-line"] * 3 + ["missing-call"], "write `int64 total`",
        asking(definitions=(("srv/Two.srv", tuple(
            parse_definition("int64 first\nint64 second\n---\nint64 total", ".srv"))),)),
        {"srv/Two.srv": "int64 first\nint64 second\n---\nint64 total\n"},
    ),
    "own-service-with-other-fields-that-a-pose-has": Case(
        {"src/serve.py": f"from geometry_msgs.msg import Pose2D\n{SERVE_SUM}", CMAKELISTS: SERVICE_CMAKE,
         "srv/Two.srv": "int64 x\nint64 y\n---\nint64 sum\n"},
        [], wanted=asking(definitions=(("srv/Two.srv", SUM_FIELDS),)),
    ),
    "own-service-with-other-fields-the-other-way-round": Case(
        {"src/serve.py": SERVE_SUM.replace("one.x + one.y", "one.bow + one.aft"), CMAKELISTS: SERVICE_CMAKE,
         "srv/Two.srv": "int64 bow\nint64 aft\n---\nint64 sum\n"},
        [], wanted=asking(definitions=(("srv/Two.srv", SUM_FIELDS),)),
    ),
    "own-action-without-its-feedback": Case(
        {"src/go.py": "from lab.msg import GoAction\n", "action/Go.action": "int32 n\n---\nbool there\n",
         CMAKELISTS: ACTION_CMAKE}, ["build-line"], "at the end of the file, write a line `---`, and `int32 left`",
        asking(definitions=(("action/Go.action", GO_FIELDS),)),
        {"action/Go.action": "int32 n\n---\nbool there\n---\nint32 left\n"},
    ),
    "own-action-with-fields-mixed": Case(
        {"src/go.py": "from lab.msg import GoAction\n", "action/Go.action": "int32 n\nint32 left\nbool there\nint8 s\n",
         CMAKELISTS: ACTION_CMAKE}, [], wanted=asking(definitions=(("action/Go.action", GO_FIELDS),)),
    ),
    "own-action-with-a-misspelt-field": Case(
        {"src/go.py": "from lab.msg import GoAction, GoResult\ngoal.thre = 1\nGoResult(thre=goal.thre)\nthre = left\n",
         "action/Go.action": "int32 n\n---\nbool thre  # thre or not\n---\nint32 left\n", CMAKELISTS: ACTION_CMAKE},
        ["build-line", "missing-call"], "write `bool there`, and there in src/go.py",
        asking(definitions=(("action/Go.action", GO_FIELDS),)),
        {"action/Go.action": "int32 n\n---\nbool there  # thre or not\n---\nint32 left\n",
         "src/go.py": "goal.there = 1\nGoResult(there=goal.there)\nthre = left\n"},
    ),
    "own-action-with-another-number": Case(
        {"src/go.py": "from lab.msg import GoAction\n",
         "action/Go.action": "int8 n\n---\nbool there\n---\nint32 left\n",
         CMAKELISTS: ACTION_CMAKE},
        ["build-line"], "line 1 of action/Go.action: goal.n is int8, but the handout asks for int32",
        asking(definitions=(("action/Go.action", GO_FIELDS),)), {"action/Go.action": "int32 n\n---\nbool"},
    ),
    "own-message-with-a-text-for-a-list": Case(
        {**OWN, "msg/Level.msg": "float32 level\nstring  names  # of all\nbyte b\n", CMAKELISTS: GENERATED},
        ["build-line"], "write `string[] names`", asking(definitions=(("msg/Level.msg", LEVEL_FIELDS),)),
        {"msg/Level.msg": "float32 level\nstring[]  names  # of all\nbyte b\n"},
    ),
    "own-message-with-fields-in-another-order": Case(
        {**OWN, "msg/Level.msg": "int8 b\n# of all\nstring[] names # both\nfloat64 level\n", CMAKELISTS: GENERATED},
        ["build-line"], "order them as the handout does: level, names then b",
        asking(definitions=(("msg/Level.msg", LEVEL_FIELDS),)),
        {"msg/Level.msg": "float64 level\n# of all\nstring[] names # both\nint8 b\n"},
    ),
    "own-message-with-a-whole-number": Case(
        {**OWN, "msg/Level.msg": "int32 level\nstring[] names\nint16 b\n", CMAKELISTS: GENERATED},
        ["build-line"], "write `float64 level`", asking(definitions=(("msg/Level.msg", LEVEL_FIELDS),)),
        {"msg/Level.msg": "float64 level\nstring[] names\nint16 b\n"},
    ),
    "own-message-with-other-fields-besides": Case(
        {**OWN, "msg/Level.msg": "string level\nstring[] others\nint8 b\n", CMAKELISTS: GENERATED},
        [], wanted=asking(definitions=(("msg/Level.msg", LEVEL_FIELDS),)),
    ),
    "own-message-with-two-damaged-lines": Case(
        {**OWN, "msg/Level.msg": "float64\n[] names  # of all\nint8 b\n", CMAKELISTS: GENERATED},
        ["build-line"] * 2, "`float64` on line 1 is not a field: it has a type, and no name",
        asking(definitions=(("msg/Level.msg", LEVEL_FIELDS),)),
        {"msg/Level.msg": "float64 level\nstring[] names  # of all\nint8 b\n"},
    ),
    "own-message-with-a-bracket-missing": Case(
        {**RUN_OWN, "msg/Level.msg": "float64[ level\n", CMAKELISTS: GENERATED}, ["build-line"],
        "write `float64[] level`", after={"msg/Level.msg": "float64[] level\n"},
    ),
    "own-message-of-no-type": Case(
        {**OWN, "msg/Level.msg": "Float64 level\n", CMAKELISTS: GENERATED}, ["build-line"], "write `float64 level`",
    ),
    "own-message-of-a-package-of-no-such-name": Case(
        {**OWN, "msg/Level.msg": "std_msg/Header header\nstd_msgs/float32[] levels # all\n",
         CMAKELISTS: GENERATED.replace("messages()", "messages(DEPENDENCIES std_msgs)")},
        ["build-line"] * 2, "there is no field type `std_msg/Header`",
        after={"msg/Level.msg": "std_msgs/Header header\nstd_msgs/Float32[] levels # all\n"},
    ),
    "own-message-with-lines-that-are-no-fields": Case(
        {**OWN, "msg/Level.msg": "uint8 OK 0  # good\nfloat64: level\nfloat64\ttilt\nfloat64 my-speed\n",
         CMAKELISTS: GENERATED},
        ["build-line"] * 4, "`uint8 OK 0  # good` on line 1 is not a field",
        after={"msg/Level.msg": "uint8 OK = 0  # good\nfloat64 level\nfloat64 tilt\nfloat64 my_speed\n"},
    ),
    "own-message-with-constants-without-their-sign": Case(
        {**OWN, "msg/Level.msg": "uint8 LOW 0\nuint8 HIGH: 1\nfloat64 level;\n",
         CMAKELISTS: OWN_CMAKE.replace("catkin_p", "generate_messages()\ncatkin_p")},
        ["build-line"] * 3, "`uint8 LOW 0` on line 1 is not a field",
        after={"msg/Level.msg": "uint8 LOW = 0\nuint8 HIGH = 1\nfloat64 level\n"},
    ),
    "own-message-with-a-line-of-no-meaning": Case(
        {**OWN, "msg/Level.msg": "the level of the water\n",
         CMAKELISTS: OWN_CMAKE.replace("catkin_p", "generate_messages()\ncatkin_p")}, [],
    ),
    "own-message-of-a-misspelt-package": Case(
        {**OWN, "msg/Level.msg": "geometry_msg/Point at\n",
         CMAKELISTS: OWN_CMAKE.replace("catkin_p", "generate_messages(DEPENDENCIES geometry_msgs)\ncatkin_p")},
        ["build-line"], "there is no field type `geometry_msg/Point`",
        after={"msg/Level.msg": "geometry_msgs/Point at\n"},
    ),
    "own-message-of-no-use": Case({"msg/Level.msg": "float64 level\n"}, []),
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
    "own-service-without-its-suffix": Case(
        {**SERVICE, CMAKELISTS: SERVICE_CMAKE.replace("Two.srv", "Two")},
        ["build-line"], "write Two.srv instead of Two",
        after={CMAKELISTS: "add_service_files(FILES Two.srv)"},
    ),
    "own-service-with-two-dashes": Case(
        {**SERVICE, "srv/Two.srv": "int64 a\n--\nint64 b\n", CMAKELISTS: SERVICE_CMAKE},
        ["build-line"], "line 2 does not divide its parts: that takes three of `-`",
        after={"srv/Two.srv": "int64 a\n---\nint64 b\n"},
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_a_mistake_in_a_definition_is_found_and_repaired(name: str, tmp_path: Path) -> None:
    check(CASES[name], tmp_path)


def test_an_own_message_that_is_imported_from_a_part_of_the_packages_name(tmp_path: Path) -> None:
    manifest = MANIFEST.replace(">lab<", ">r0018_a1<")
    changes = {**own_from("r0018.msg"), CMAKELISTS: GENERATED.replace("lab", "r0018_a1"), XML: manifest}
    folder = package(tmp_path, changes)
    said = [
        (one.kind, one.message) for one in repair_all(folder, asking(package="r0018_a1"), name="r0018_a1")
    ]
    assert ("missing-import", "line 4 of src/talker.py: r0018.msg has no Level") in said
    assert "from r0018_a1.msg import Level\n" in (folder / TALKER).read_text()
