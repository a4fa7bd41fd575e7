"""Names that rospy lacks, and the calls of ROS 2 and roscpp that stand for one of its own."""

from __future__ import annotations

from pathlib import Path

import pytest

from grader.package.python_repairs.rospy_names import with_attributes, with_logger, with_times
from tests.package.repairing import SCRIPT, SPINS, TALKER, Case, check, swapped

pytestmark = pytest.mark.usefixtures("without_processes")

PUBLISHER = "rospy.Publisher('numeric_chatter', Int8, queue_size=10)"
LOOP = "        publisher.publish(1)"
MADE = "    rate = rospy.Rate("
RENAMED = {
    PUBLISHER: (
        PUBLISHER.replace("Publisher", "create_publisher"),
        "rospy.create_publisher(Int8, 'numeric_chatter', 10)",
        "rospy.create_publisher(Int8, 'numeric_chatter', qos_profile=10)",
        PUBLISHER.replace("Publisher", "Pub"),
        PUBLISHER.replace("Publisher", "advertise"),
    ),
    "rospy.init_node('talker')": ("rospy.init('talker')", "rospy.initNode('talker')", "rospy.Node('talker')"),
    "rospy.get_param(": ("rospy.getParam(", "rospy.param("),
    "rospy.Rate(rospy": ("rospy.create_rate(rospy", "rospy.loop_rate(rospy"),
    "while not rospy.is_shutdown()": ("while rospy.ok()",),
}
ADDED = {
    f"    rospy.Subscriber('x', Int8, print)\n{MADE}": (
        f"    rospy.subscribe('x', Int8, print)\n{MADE}",
        f"    rospy.create_subscription(Int8, 'x', print, 10)\n{MADE}",
    ),
    f"    rospy.Timer(rospy.Duration(1), print)\n{MADE}": (f"    rospy.create_timer(1, print)\n{MADE}",),
    f"        rospy.loginfo('x')\n{LOOP}": tuple(
        f"        rospy.{name}('x')\n{LOOP}" for name in ("log", "info", "print", "logInfo")
    ),
    f"        rospy.logerr('x')\n{LOOP}": (f"        rospy.error('x')\n{LOOP}",),
}


@pytest.mark.parametrize(
    ("right", "wrong"), [(right, one) for right, some in RENAMED.items() for one in some]
)
def test_a_call_that_rospy_lacks_is_written_as_its_own(right: str, wrong: str, tmp_path: Path) -> None:
    case = Case(
        swapped(TALKER, (right, wrong)), ["missing-call"], "there is no rospy.", after={TALKER: right}
    )
    check(case, tmp_path)


@pytest.mark.parametrize(("right", "wrong"), [(right, one) for right, some in ADDED.items() for one in some])
def test_so_is_one_beside_the_others(right: str, wrong: str, tmp_path: Path) -> None:
    place = MADE if right.endswith(MADE) else LOOP
    check(Case(swapped(TALKER, (place, wrong)), ["missing-call"], "", after={TALKER: right}), tmp_path)


@pytest.mark.parametrize(
    "wrong",
    [
        f"        rospy.publish(1)\n{LOOP}",  # which publisher's?
        f"        rospy.sub(3)\n{LOOP}",
        f"        node = rospy.create_node('x')\n{LOOP}",
        f"        assert not rospy.ok()\n{LOOP}",
        f"        rospy.shut('x')\n{LOOP}",
    ],
)
def test_what_may_be_meant_otherwise_is_left_alone(wrong: str, tmp_path: Path) -> None:
    check(Case(swapped(TALKER, (LOOP, wrong)), []), tmp_path)


def test_the_module_of_ros_2_is_none_of_a_script_that_calls_rospy(tmp_path: Path) -> None:
    every = swapped(TALKER, ("import rospy", "import rclpy"), ("rospy.", "rclpy."))
    says = "write `rospy` in place of `rclpy`, wherever it stands"
    check(Case(every, ["missing-import"], says, after={TALKER: "import rospy\n"}), tmp_path / "one")
    named = swapped(TALKER, ("import rospy", "import rclpy as rospy"))
    says = "rclpy has no `init_node`: rospy is meant"
    check(Case(named, ["missing-import"], says, after={TALKER: "import rospy\n"}), tmp_path / "two")
    of_ros_2 = swapped(
        TALKER,
        ("import rospy", "import rclpy"),
        ("rospy.", "rclpy."),
        ("rclpy.init_node(", "rclpy.create_node("),
    )
    check(Case(of_ros_2, []), tmp_path / "three")


ALL = f"        rospy.loginfo('x')\n        rospy.logerr(str(1))\n{LOOP}"


@pytest.mark.parametrize("of", ["self", "rospy"])
def test_the_logger_of_ros_2_is_one_slip(of: str, tmp_path: Path) -> None:
    wrong = f"        {of}.get_logger().info('x')\n        {of}.get_logger().error(str(1))\n{LOOP}"
    said = "there is no get_logger() in rospy"
    check(Case(swapped(TALKER, (LOOP, wrong)), ["missing-call"], said, after={TALKER: ALL}), tmp_path)


@pytest.mark.parametrize(
    "swaps",
    [
        [(LOOP, f"        log.get_logger().info('x')\n{LOOP}")],
        [(LOOP, f"        self.get_logger().info('x', once=True)\n{LOOP}")],
        [(LOOP, f"        self.get_logger().log('x', 10)\n{LOOP}")],
        [(LOOP, f"        self.get_logger().info('x')\n{LOOP}"), ("import rospy", "import rospy as ros")],
        [
            (LOOP, f"        self.get_logger().info('x')\n{LOOP}"),
            ("def main", "def get_logger(): pass\n\n\ndef main"),
        ],
        [
            (LOOP, f"        self.get_logger().info('x')\n{LOOP}"),
            ("def main", "class A(B):\n    x = 1\n\n\ndef main"),
        ],
    ],
)
def test_another_logger_is_left_alone(swaps: list[tuple[str, str]], tmp_path: Path) -> None:
    text = swapped(TALKER, *swaps)[TALKER]
    assert "loginfo" not in "".join(one["text"] for one in with_logger(str(text)))


FROM_ROSPY = SPINS.replace("rospy.", "").replace("import rospy", "from rospy import Subscriber, init_node")
LACKING = {
    "dot-in-the-name-of-init-node": Case(
        {TALKER: SPINS.replace("init_node", "init.node") + "    rospy.spin()\n"}, ["missing-call"],
        "there is no rospy.init", after={TALKER: "\n    rospy.init_node('talker')\n"},
    ),
    "spin-of-rospy-as-ros": Case(
        {TALKER: SPINS.replace("rospy.", "ros.").replace("import rospy", "import rospy as ros")},
        ["missing-call"], after={TALKER: "Int8, print)\n    ros.spin()\n"},
    ),
    "spin-that-is-not-imported": Case(
        {TALKER: FROM_ROSPY}, ["missing-call"], "write `spin` behind what line 2 imports, and spin() as the last line",
        after={TALKER: FROM_ROSPY.replace("er, init_node", "er, init_node, spin")
               .replace("print)\n", "print)\n    spin()\n")},
    ),
    "node-that-is-not-imported": Case(
        {TALKER: FROM_ROSPY.replace("    init_node('talker')\n", "").replace("init_node", "spin")
         .replace("print)\n", "print)\n    spin()\n")}, ["missing-call"],
        after={TALKER: "er, spin, init_node\nfrom std_msgs.msg import Int8\n\ndef listen():\n"
                       "    init_node('talker')\n"},
    ),
    "arguments-of-rospy-as-ros": Case(
        {TALKER: SCRIPT.replace("rospy.", "ros.").replace("import rospy", "import rospy as ros")
         .replace("queue_size=10", "queue_size='10'")}, ["missing-call"], "`queue_size` is a string",
        after={TALKER: "Int8, queue_size=10)"},
    ),
    "value-of-rospy-as-ros": Case(
        {TALKER: SCRIPT.replace("rospy.", "ros.").replace("import rospy", "import rospy as ros")
         .replace("ros.Rate(ros.get_param('~rate', 10))", "ros.rate = 10")}, ["missing-call"],
        after={TALKER: "    rate = ros.Rate(10)\n"},
    ),
    "object-of-a-class-of-rospys": Case(
        {TALKER: SCRIPT.replace("    publisher =", "    pub =").replace("rospy.", "").replace("import rospy",
         "from rospy import Publisher, Rate, get_param, init_node, is_shutdown")}, ["missing-call"],
        after={TALKER: "        pub.publish(1)\n"},
    ),
    "arguments-of-what-has-a-type": Case(
        swapped(TALKER, ("    rate = rospy", "    rate: rospy.Rate = rospy"), ("rate.sleep()", "rate.sleep(10)")),
        ["missing-call"], "a Rate already knows how long to sleep", after={TALKER: "        rate.sleep()\n"},
    ),
    "spin-outside-of-a-function-with-tabs": Case(
        {TALKER: SPINS.replace("    ", "\t").replace("print)\n", "print)\nrospy.spin()\n")}, ["missing-call"],
        "start line 8 with 1 tab", after={TALKER: "print)\n\trospy.spin()\n"},
    ),
    "fields-of-messages": Case(
        swapped(TALKER,
                ("import rospy\n", "import rospy\nfrom geometry_msgs.msg import PoseArray, Twist\n"),
                ("def main", "def on_poses(got):\n    print(got.poses[0].positon.x, got.poses.count(1))\n\ndef main"),
                ("    rate = ", "    twist = Twist()\n    twist.linaer.x = 1\n    twist.Angular = 2\n    rate = "),
                ("\nmain()", "    rospy.Subscriber('poses', PoseArray, on_poses)\n\nmain()")),
        ["missing-call"] * 3, "write `twist.linear.x = 1`",
        after={TALKER: "twist.linear.x = 1\n    twist.angular = 2\n"},
    ),
    "statement-misspelt": Case(
        {TALKER: SCRIPT.replace("        rate.sleep()\n", "        rate.sleep()\n        contineu\n        brek\n")},
        ["missing-call", "missing-call"], after={TALKER: "        continue\n        break\n"},
    ),
    "init": Case(
        {TALKER: SCRIPT.replace("    rospy.init_node('talker')\n", "")},
        ["missing-call"], "below line 5 add `rospy.init_node('talker')`", after={TALKER: SCRIPT},
    ),
    "init-of-a-class": Case(
        {TALKER: "#!/usr/bin/env python3\nimport rospy\nfrom std_msgs.msg import Int8\n\nclass Talker:\n"
                 "    def __init__(self):\n        rospy.Subscriber('numeric_chatter', Int8, print)\n\n"
                 "if __name__ == '__main__':\n    Talker()\n    rospy.spin()\n"},
        ["missing-call"], after={TALKER: "'__main__':\n    rospy.init_node('talker')\n    Talker()\n"},
    ),
    "init-of-a-module": Case(
        {"src/pubs.py": "import rospy\nfrom std_msgs.msg import Int8\n\n"
                        "pub = rospy.Publisher('a', Int8, queue_size=1)\n",
         TALKER: "#!/usr/bin/env python3\nimport rospy\nfrom pubs import pub\n\n"
                 "rospy.init_node('talker')\npub.publish(1)\n"},
        [],
    ),
    "init-in-the-class-of-a-module": Case(
        {"src/base.py": "import rospy\n\n\nclass Base:\n    def __init__(self):\n        rospy.init_node('talker')\n",
         TALKER: "#!/usr/bin/env python3\nimport rospy\nfrom std_msgs.msg import Int8\nfrom base import Base\n\n\n"
                 "class Talker(Base):\n    def run(self):\n        rospy.Subscriber('numeric_chatter', Int8, print)\n"
                 "        rospy.spin()\n\n\nif __name__ == '__main__':\n    Talker().run()\n"},
        [],
    ),
    "init-without-topics": Case(
        {TALKER: "#!/usr/bin/env python3\nimport rospy\n\nprint(rospy.get_param_names())\n"}, [],
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", LACKING.values(), ids=LACKING)
def test_what_a_script_of_rospy_lacks_is_added(case: Case, tmp_path: Path) -> None:
    check(case, tmp_path)


@pytest.mark.parametrize(
    ("wrong", "right"),
    [
        ("r.spiu()", "r.spin()"),
        ("pub = r.create_publisher(Int8, '/a', 1)", "pub = r.Publisher('/a', Int8, queue_size=1)"),
        ("while r.ok():\n    pass", "while not r.is_shutdown():\n    pass"),
        ("self.r.spiu()", ""),
        ("r.extra = 3", ""),
        ("r = r.Rate(3)\nr.spiu()", ""),
    ],
)
def test_rospy_may_be_imported_under_another_name(wrong: str, right: str) -> None:
    head = "import rospy as r\n\nr.init_node('a')\n"
    steps = list(with_attributes(f"{head}{wrong}\n"))
    assert [one["text"] for one in steps] == ([f"{head}{right}\n"] if right else [])


@pytest.mark.parametrize(
    ("wrong", "right"),
    [
        ("m.header.stamp = r.get_time()", "m.header.stamp = r.Time.now()"),
        ("m.header.stamp = time.time()", "m.header.stamp = r.Time.now()"),
        ("h.stamp = r.Time.now().to_sec()", "h.stamp = r.Time.now()"),
        ("marker.lifetime = 0.5", "marker.lifetime = r.Duration(0.5)"),
        ("self.stamp = r.get_time()", ""),
        ("stamp = r.get_time()", ""),
        ("m.header.stamp = r.Time.now()", ""),
        ("m.header.stamp = r.Time.from_sec(time.time())", ""),
        ("m.lifetime = r.Duration(2)", ""),
        ("cat.lifetime = True", ""),
    ],
)
def test_a_time_of_a_message_is_no_number(wrong: str, right: str) -> None:
    head = "import rospy as r\n\nr.init_node('a')\n"
    steps = list(with_times(f"{head}{wrong}\n"))
    assert [one["text"] for one in steps] == ([f"{head}{right}\n"] if right else [])
