"""Names in a script that nothing reads, or that nothing gives a value: which of them are repaired, and how."""

from __future__ import annotations

from pathlib import Path

import pytest

from grader.package.python import check_syntax
from grader.package.python_repairs.examine import examine
from grader.package.repairs import find_repairs
from tests.package.repairing import TALKER, asking, package
from tests.package.trees import facts_of

pytestmark = pytest.mark.usefixtures("without_processes")

NAMED = """\
import rospy


class Node:
    def __init__(self, {taken}):
        self.name = name
        rospy.init_node(self.name)

    def wait(self):
        try:
            rospy.spin()
        except rospy.ROSInterruptException:
            {alone}


Node('talker').wait()
"""


@pytest.mark.parametrize(
    ("taken", "alone", "changed"),
    [
        ("naMe", "pass", ("= name", "= naMe")),
        ("nam", "pass", ("= name", "= nam")),
        ("name", "retrun", ("retrun", "return")),
        ("name", "pas", ("pas", "pass")),
        ("label", "pass", ("", "")),
    ],
)
def test_what_a_method_takes_and_words_alone(taken: str, alone: str, changed: tuple[str, str]) -> None:
    text = NAMED.format(taken=taken, alone=alone)
    (step,) = list(examine([["a.py", text]], [], {}, ""))
    last = step["steps"][-1]["text"] if step["steps"] else text
    assert last == text.replace(*changed)


COUNTS = """\
import rospy
from std_msgs.msg import Int8


class Counter:
    def __init__(self):
        self.count = 0
        self.pub = rospy.Publisher('numbers', Int8, queue_size=1)
        rospy.Timer(rospy.Duration(0.1), self.tick)

    def tick(self, event):
        self.pub.publish(self.count)
        self.count = self.count + 1
        if self.count > 127:
            self.count = 0


def main():
    rospy.init_node('counter')
    Counter()
    rospy.spin()


main()
"""


@pytest.mark.parametrize(
    ("right", "wrong", "says"),
    [
        ("self.count = self", "self.cout = self", "nothing reads `self.cout`"),
        ("self.count = self.count + 1", "self.cuont += 1", "nothing reads `self.cuont`"),
        ("    self.count = 0\n\n", "    self.Count = 0\n\n", "`self.count` is meant"),
        ("self.count = 0\n        self.pub", "count = 0\n        self.pub", "`self.count` is meant"),
        ("class Counter:\n", "", "class Counter:"),
        ("def main():\n", "# def main():\n", "main"),
        ("self.count = self", "self.last = self", None),
        ("self.count = self", "self.counts = self", None),
        ("self.count = self", "self.count2 = self", None),
        ("rospy.Timer(", "self.COUNT = 0\n        rospy.Timer(", None),
        ("rospy.Timer(", "coun = rospy.Timer(", None),
    ],
)
def test_names_that_get_a_value_for_nothing(right: str, wrong: str, says: str | None) -> None:
    (found,) = list(examine([["a.py", COUNTS.replace(right, wrong, 1)]], [], {}, ""))
    assert says is not None or not found["steps"]
    for step in found["steps"]:
        assert says in step["word"]
        assert step["text"] == COUNTS.replace(
            "self.count = self.count + 1",
            "self.count += 1" if "+=" in wrong else "self.count = self.count + 1",
        )


@pytest.mark.parametrize(
    ("lines", "right"),
    [
        (
            ("c = c + 1", "if c > 127:", "    c = 0"),
            ("c.data = c.data + 1", "if c.data > 127:", "    c.data = 0"),
        ),
        (
            ("c += 1", "if c == 128:", "    c.data = 0"),
            ("c.data += 1", "if c.data == 128:", "    c.data = 0"),
        ),
        (("c.data = c + 1",), ("c.data = c.data + 1",)),
        (("c.data = (c.data + 1) % 128",), None),
        (("c = Int8(c.data + 1)",), None),
        (("c = other()", "c = c + 1"), None),
    ],
)
def test_what_is_counted_is_the_field_of_a_message(
    lines: tuple[str, ...], right: tuple[str, ...] | None
) -> None:
    head = "import rospy\nfrom std_msgs.msg import Int8\nrospy.init_node('n')\nc = Int8()\n"
    tail = "\nrospy.Publisher('numbers', Int8, queue_size=1).publish(c)\n"
    (found,) = list(examine([["a.py", head + "\n".join(lines) + tail]], [], {}, ""))
    expected = [head + "\n".join(right) + tail] if right else []
    assert [step["text"] for step in found["steps"]][-1:] == expected


@pytest.mark.parametrize(
    ("wrong", "right"),
    [
        (
            "import std_msgs\npub = rospy.Publisher('t', std_msgs.String)",
            "import std_msgs.msg\npub = rospy.Publisher('t', std_msgs.msg.String)",
        ),
        ("import std_msgs\npub = rospy.Publisher('t', std_msgs.msg.String)", None),
    ],
)
def test_classes_of_messages_are_in_their_module(wrong: str, right: str | None) -> None:
    text = "import rospy\n{}\nrospy.init_node('a')\npub.publish('')\n"
    (found,) = list(examine([["a.py", text.format(wrong)]], [], {}, ""))
    assert [step["text"] for step in found["steps"]] == ([text.format(right)] if right else [])


def test_a_field_of_another_message_is_none_of_a_scan() -> None:
    text = "import rospy\nfrom sensor_msgs.msg import {0}\n\n\ndef hear(m):\n    print(m.range)\n\n\n"
    text += "rospy.init_node('n')\nrospy.Subscriber('scan', {0}, hear)\nrospy.spin()\n"
    for kind, field in (("LaserScan", "ranges"), ("Range", "range")):
        (found,) = list(examine([["a.py", text.format(kind)]], [], {}, ""))
        assert ([text.format(kind), *(s["text"] for s in found["steps"])][-1]).count(f"print(m.{field})") == 1


def test_a_class_that_is_called_as_one_of_rospy_has_other_members() -> None:
    text = "import rospy\n\n\nclass Publisher:\n    def Publish(self):\n        self.pub = rospy.Publisher('t')\n"
    text += "        self.pub.{}('')\n\n\nrospy.init_node('a')\nPublisher().Publish()\n"
    (found,) = list(examine([["a.py", text.format("Publish")]], [], {}, ""))
    assert [step["text"] for step in found["steps"]] == [text.format("publish")]


def test_no_function_of_python_is_meant_where_it_would_get_no_value() -> None:
    text = "import rospy\nrospy.init_node('a')\nrospy.spin()\nmain()\n"
    (step,) = list(examine([["a.py", text]], [], {}, ""))
    assert step["steps"] == []


@pytest.mark.parametrize(
    ("printed", "right"),
    [
        ("'Received: ' + data", "'Received: ' + str(data.data)"),
        ("rospy.get_name() + ' heard ' + data", "rospy.get_name() + ' heard ' + str(data.data)"),
        ("'Received: ' + data.data", None),
        ("'Received: ' + str(data)", None),
        ("data + 1", None),
        ("('' + data for data in 'ab')", None),
        ("data == 'stop'", "data.data == 'stop'"),
        ("'stop' != data", "'stop' != data.data"),
        ("data.data == 'stop'", None),
        ("data is None", None),
        ("1)\n    word = data\n    print(word in 'ab', word == 'a'",
         "1)\n    word = data.data\n    print(word in 'ab', word == 'a'"),
        ("1)\n    word = data\n    print(word.data == 'a'", None),
    ],
)  # fmt: skip
def test_a_message_is_no_string(printed: str, right: str | None) -> None:
    text = "import rospy\nfrom std_msgs.msg import String\n\n\ndef hear(data):\n    print({})\n\n\n"
    text += "rospy.init_node('listener')\nrospy.Subscriber('chatter', String, hear)\nrospy.spin()\n"
    (found,) = list(examine([["a.py", text.format(printed)]], [], {}, ""))
    assert [step["text"] for step in found["steps"]] == ([text.format(right)] if right else [])


HEARS = "import rospy\nfrom std_msgs.msg import {}\n\n\ndef hear(msg):\n    print({})\n\n\nrospy.init_node('a')\n{}\n"
SUBSCRIBES = "rospy.Subscriber('/a', %s, hear)\nrospy.spin()"
SENDS = "pub = rospy.Publisher('/a', Int8, queue_size=1)\nmsg = Int8()\n{}\npub.publish(msg)"


@pytest.mark.parametrize(
    ("kind", "printed", "rest", "change"),
    [
        ("Int8", "1", SENDS.format("msg.counter = 3"), ("msg.counter", "msg.data")),
        ("Int8", "1", SENDS.format("msg.counter += 3\nprint(msg.counter)"), ("msg.counter", "msg.data")),
        ("String", "msg.text", SUBSCRIBES % "String", ("msg.text", "msg.data")),
        ("Int8", "1", SENDS.format("msg.counter = 3\nmsg.data = 1"), None),
        ("Int8", "1", SENDS.format("msg.counter = 3\nmsg.value = 1"), None),
        ("Int8", "1", SENDS.format("msg = thing\nmsg.counter = 3"), None),
        ("String", "msg.upper()", SUBSCRIBES % "String", None),
        ("String", "msg._type", SUBSCRIBES % "String", None),
        ("Header", "msg.counter", SUBSCRIBES % "Header", None),
    ],
)
def test_data_is_the_only_field_of_most_messages_of_std_msgs(
    kind: str, printed: str, rest: str, change: tuple[str, str] | None
) -> None:
    text = HEARS.format(kind, printed, rest)
    (found,) = list(examine([["a.py", text]], [], {}, ""))
    last = found["steps"][-1]["text"] if found["steps"] else text
    assert last == (text.replace(*change) if change else text)


@pytest.mark.parametrize(
    ("module", "wrong", "right"),
    [
        ("rospy", "spni()", "spin()"),
        ("rospy", "Publsher", "Publisher"),
        ("rospy", "mxg", "mxg"),
        ("lab", "spni()", ""),
    ],
)
def test_all_names_of_rospy_may_be_imported(module: str, wrong: str, right: str) -> None:
    text = f"from {module} import *\n\ninit_node('a')\n{wrong}\n"
    (found,) = list(examine([["a.py", text]], [], {}, ""))
    last = found["steps"][-1]["text"] if found["steps"] else text
    assert last == text.replace(wrong, right or wrong)


TARGETS = {
    "a flag": (
        "up = 1\ndef f(m):\n  global changed\n  chnaged = True\nchanged = False\nif changed: g()",
        "changed",
    ),
    "capitals": (
        "class A:\n  count = 0\n  def f(self, e):\n    self.coUnt += 1\n    g(self.count)",
        "self.count",
    ),
    "below nothing": ("counter = 0\ng(counter)\ncouner = -128", "counter"),
    "worked out": ("counter = 0\ng(counter)\ncouner = counter + 1", "counter"),
    "of a class": ("class A:\n  topic = 'a'\n  def f(self):\n    g(self.topic)\nTopic = 'b'\ng(Topic)", ""),
    "another kind": ("counter = 0\ng(counter)\ncouner = 'a'", ""),
    "a series": ("speed_x = 0\ng(speed_x)\nspeed_y = 1", ""),
    "plural": ("speed = 0\ng(speed)\nspeeds = 1", ""),
    "read by its name": ("counter = 0\ng(counter)\ncouner = 3\ng(vars()['couner'])", ""),
    "read": ("counter = 0\ng(counter)\ncouner = 3\ng(couner)", ""),
}


@pytest.mark.parametrize("name", TARGETS)
def test_a_misspelt_name_that_gets_a_value_is_told_without_a_repair_too(name: str, tmp_path: Path) -> None:
    text, meant = TARGETS[name]
    (tmp_path / "a.py").write_text(f"{text}\n")
    slips = [one for one in check_syntax(tmp_path, ["a.py"]).slips if "is meant" in one.message]
    assert [one.fix.split("`")[1] for one in slips] == ([meant] if meant else [])
    (found,) = list(examine([["a.py", f"import rospy\n{text}\n"]], [], {}, ""))
    told = [one["word"] for one in found["steps"] if "is meant" in one["word"]]
    assert told == [one.message for one in slips] or name == "read by its name"


RIGHT = {
    "two names of settings": ("class A:\n    def __init__(self):\n        self.pub_topic = '/a'\n"
                              "        self.sub_topic = '/b'\n        rospy.Publisher(self.pub_topic, Int8)\n"),
    "a copy that is not used": "def f(cv_image):\n    cp_image = cv_image.copy()\n    return cv_image\n",
    "a class of another module": ('from lab.errors import *\n\n\nclass A:\n    """One."""\n\n\n    def f(self):\n'
                                  "        raise LabError('a')\n"),
    "a list of its own": ("class A:\n    def f(self):\n        self.a = []\n\n        self.a.append(1)\n"
                          "        return self.a\n\n\na = A()\n"),
    "a module of publishers": ("import sys\nsys.path.append('..')\n\n\nclass A:\n    def f(self):\n"
                               "        return rospy.Publisher('a', Int8)\n"),
    "flag of its own": ("class A:\n    def __init__(self):\n        self.is_shutdown = False\n\n    def f(self):\n"
                        "        while not self.is_shutdown:\n            pass\n"),
    "property of its own": ("class A:\n    @property\n    def is_shutdown(self):\n        return 1\n\n"
                            "    def f(self):\n        while not self.is_shutdown:\n            pass\n"),
    "name of two words": "import logging\nlog = logging.getLogger()\nlog.info('a')\nrospy.loginfo('a')\n",
    "attribute of two words": "class A:\n    def f(self, pos):\n        self.posx = pos.x\n",
    "type as a text": "class A:\n    pub: 'rospy.Publisher'\n",
    "names of a class": "class T:\n    OUT = 'out'\n\n\nU = T\ndef f():\n    rospy.Subscriber(U.OUT, Int8, print)\n",
    "fields of a data class": ("class A:\n    speed: float = 1.0\n    limit: int = 1\n\n    def speeds(self):\n"
                               "        return self.speed * self.limit\n"),
    "a window": ("def f(root):\n    rospy.init_node('talker')\n    rospy.Subscriber('a', Int8, print)\n"
                 "    root.mainloop()\n"),
    "own timer": "class Timer:\n    pass\n\n\ndef tick():\n    pass\n\n\nTimer(0.1, tick)\n",
    "star import": "from math import *\n\n\nclass A:\n    def f(self, a):\n        self.degrees = degrees(a)\n",
    "global of another function": ("class A:\n    def f(self, pub):\n        self.pub = pub\n\n    def g(self):\n"
                                   "        pub.publish(1)\n\n\ndef h():\n    global pub\n    pub = A()\n"),
    "read later": "def f():\n    rospy.on_shutdown(lambda: pub.publish(0))\n    pub = make()\n    pub.publish(1)\n",
    "both Pythons": "try:\n    input = raw_input\nexcept NameError:\n    pass\n",
    "both Pythons by version": "import sys\ntext = str if sys.version_info >= (3,) else unicode\n",
    "argument as a key": "def f(name):\n    all = rospy.get_param('all')\n    name = all[name]\n    return name\n",
    "lines of comments": ("def g():\n    pass\n\n\ndef f():\n    a = 1\n    # one\n    # two\n    # three\n    g()\n"
                          "    print(a)\n"),
}  # fmt: skip


@pytest.mark.parametrize("name", RIGHT)
def test_what_few_students_write_and_is_right_is_left_alone(name: str, tmp_path: Path) -> None:
    head = "#!/usr/bin/env python3\nimport rospy\nfrom std_msgs.msg import Int8\n\n\n"
    folder = package(tmp_path, {TALKER: head + RIGHT[name]})
    found = find_repairs(folder, facts_of(folder), asking(topics=()))
    assert [one.message for one in found if one.file == TALKER] == []
