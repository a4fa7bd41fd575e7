"""Which lines of the package a verdict shows, and what stands in them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from grader.checks.actions import ASKED_TO_STOP
from grader.checks.support.scripts import OF_INTERFACES, lines_making
from grader.evidence.run import Run
from grader.judging.cited_lines import (
    LINE_CHARS,
    cite_commented_call,
    cite_find,
    cite_name,
    cite_source,
    cite_unused_argument,
    cite_word_of_call,
    lost_fields,
    show_lines,
)
from grader.judging.facts import try_facts
from grader.model.package import PackageFacts
from grader.model.python_slip import PythonSlip, SlipKind
from grader.model.verdict import FileCitation, SoughtKind, failed, partial, passed
from grader.package.facts import read_package
from grader.package.launch import parse_launch_files
from tests.package.trees import CMAKE, MANIFEST, make_package
from tests.support.rubrics import CMAKE_CHECK, RATE, SCRIPT, rubric
from tests.support.timeline import build_runs


@pytest.mark.parametrize(
    ("line", "said", "cited"),
    [
        ('    rospy.loginfo("In a galaxy, %s", m.data)', "In a galaxy, abc", True),
        ('    print(f"got {m.data}!")', "got abc!", True),
        ('    text = "hi =) %s" % m.data; show(text)', "hi =) abc", True),
        ("    print(m.data)", "abc", True),
        ('    print("other words", m.data)', "abc", True),
        ('    # print("got", m.data)', "got abc", False),
        ('    show("else", m.data)', "got abc", False),
    ],
)
def test_other_words_are_shown_where_the_script_makes_them(line: str, said: str, cited: bool) -> None:
    lab = rubric(
        {
            "id": "hears",
            "check": "hears",
            "with": {"topic": "/chatter", "template": "I heard {value}"},
            "scenario": "talker",
        }
    )
    script = f"#!/usr/bin/env python3\nimport rospy\ndef heard(m):\n{line}\nrospy.spin()\n"
    runs = build_runs(
        {"runs": {"package": {"package": {"files": [SCRIPT]}, "attachments": {SCRIPT["path"]: script}}}}
    )
    facts_ = try_facts(lab, runs)
    verdict = partial(0.5, "each message is printed, but not as 'I heard <message>'").about(said=said)
    found = cite_source(verdict, lab.criteria[0], facts_, runs["package"])
    place = FileCitation(file=SCRIPT["path"], line=4)
    assert found.citations == ((place,) if cited else ())
    assert cite_source(passed("right"), lab.criteria[0], facts_, runs["package"]) == passed("right")


SENT = {"check": "message", "with": {"topic": "/chatter", "template": "hello world {seconds}"}}
CALLS = {"check": "calls", "with": {"service": "/add"}}
ANSWERS = {"check": "service-answers", "with": {"service": "/add", "expect": [{"sum": 3}]}}
CALLED = {"check": "node-name", "with": {"names": ["hello"], "process": "talker"}}
PRINTS = {"check": "prints", "with": {"process": "talker", "text": "hello world {number}"}}
NAMED = {"check": "topic-type", "with": {"topic": "/chatter", "type": "std_msgs/String"}}
FRAMES = {"check": "transform", "with": {"parent": "base", "child": "laser"}}
STAMPS = {"check": "stamps", "with": {"topic": "/reading"}}
FIELD = {"check": "field-equals", "with": {"topic": "/cmd_vel", "field": "linear.x", "value": 1}}


@pytest.mark.parametrize(
    ("asked", "source", "line"),
    [
        (SENT, "text = 'bye'\npub.publish()", 2),
        (SENT, "text = 'hello world'\npub.publish('hello world')", 2),
        (SENT, "pub.publish(text)\nif x:\n    pub.publish()", None),
        (SENT, "t = 'hello' + x('world')\nt = 'bye' + x('world')\npub.publish(t)\npub.publish(t)", 1),
        (
            NAMED,
            'p = n.advertise<std_msgs::Int8>("chatter", 1);\nq = n.advertise<std_msgs::Int8>("other", 1);',
            1,
        ),
        (CALLED, 'ros::init(argc, argv, "bye", ros::init_options::AnonymousName);', 1),
        (CALLED, 'ros::init(argc, argv, "bye");\nros::init(argc, argv, "world");', None),
        (
            SENT,
            "a = rospy.Publisher('/chatter', String)\nb = rospy.Publisher('other', String)\nb.publish(1)\na.publish(2)",
            4,
        ),
        (
            SENT,
            'ros::Publisher p = n.advertise<std_msgs::String>("chatter", 1);\nq.publish(m);\np.publish(m);',
            3,
        ),
        (FIELD, "msg.linear.x = 2\nmsg.linear.y = 1\npub.publish(msg)", 1),
        (FIELD, "msg = Twist()\nmsg.linear.y = 1\npub.publish(msg)", 3),
        (FIELD, "if msg.linear.x == 2:\n    pub.publish(msg)", 2),
        (FIELD, "msg.linear.x = 2\nmsg.linear.x += 1\npub.publish(msg)", 3),
        (CALLS, "add = rospy.ServiceProxy('add', Add)\nanswer = add(b=1, a=2)", 2),
        (CALLS, "self.add = rospy.ServiceProxy('/add', Add)\nself.add.call(1, 2)", 2),
        (CALLS, "c = actionlib.SimpleActionClient('add', Add)\nc.wait_for_server()\nc.send_goal(goal)", 3),
        (CALLS, 'ros::ServiceClient c = n.serviceClient<Add>("add");\nif (c.call(srv))', 2),
        (CALLS, "add = rospy.ServiceProxy('other', Add)\nadd(1, 2)", None),
        (ANSWERS, "def add(r):\n    return AddResponse(r.a)\n\nrospy.Service('add', Add, add)", 2),
        (
            ANSWERS,
            "def add(r):\n    if r.a:\n        return 1\n    return 2\nrospy.Service('add', Add, add)",
            None,
        ),
        (
            ANSWERS,
            "def add(r):\n    return 1\ndef sub(r):\n    return 2\nrospy.Service('/add', Add, handler=sub)",
            4,
        ),
        (FRAMES, "b = TransformBroadcaster()\nb.sendTransform(t)", 2),
        (PRINTS, 'ss << "hello world" << count;\nROS_INFO("%s", ss.str());', 1),
        (PRINTS, "text = 'hello'\nprint(text, x)\nprint('bye world')", 1),
        (PRINTS, "print('hello world')\nprint('hello world', x)", None),
        (PRINTS, "print(text)", None),
        (
            NAMED,
            'ros::init(argc, argv, "hello world");\np = n.advertise<std_msgs::String>("hello world", 1);',
            2,
        ),
        (NAMED, 'p = n.advertise<std_msgs::String>("hello", 1);', None),
        (STAMPS, "msg.header.stamp = start\npub.publish(msg)", 1),
        (STAMPS, "msg = Reading(data=1)\npub.publish(msg)", 2),
    ],
)
def test_what_is_wrong_in_a_message_is_shown_where_it_is_set_or_published(
    asked: dict[str, Any], source: str, line: int | None
) -> None:
    lab = rubric({"id": "sent", "scenario": "talker", **asked})
    package = {"package": {"files": [SCRIPT]}, "attachments": {SCRIPT["path"]: f"#!\n{source}\n"}}
    runs = build_runs({"runs": {"package": package}})
    verdict = failed("a message reads 'hello world', not 'hello world <seconds>'").about(said="hello world")
    found = cite_source(verdict, lab.criteria[0], try_facts(lab, runs), runs["package"])
    assert found.citations == ((FileCitation(file=SCRIPT["path"], line=line + 1),) if line else ())


@pytest.mark.parametrize(
    ("others", "line", "added"),
    [
        ("", 2, ""),
        ('ros::init(argc, argv, "hello");\n', 2,
         " on line 2: the node keeps the name of its first call, and line 3 changes nothing"),
        ('ros::init(argc, argv, "bye");\n', None, ""),
    ],
)  # fmt: skip
def test_a_second_name_of_a_program_is_told_to_change_nothing(
    others: str, line: int | None, added: str
) -> None:
    lab = rubric({"id": "sent", "scenario": "talker", **CALLED})
    source = f'#!\nros::init(argc, argv, "bye");\n{others}'
    package = {"package": {"files": [SCRIPT]}, "attachments": {SCRIPT["path"]: source}}
    runs = build_runs({"runs": {"package": package}})
    verdict = failed("the node is named /bye, not /hello", measured="/bye", hint="write it")
    found = cite_source(verdict, lab.criteria[0], try_facts(lab, runs), runs["package"])
    assert found.citations == ((FileCitation(file=SCRIPT["path"], line=line),) if line else ())
    assert found.hint == f"write it{added}"


@pytest.mark.parametrize(("count", "lines"), [(2, [2, 3]), (3, [2, 3, 4]), (4, [])])
def test_a_text_that_several_lines_may_have_given_is_shown_at_each(count: int, lines: list[int]) -> None:
    lab = rubric({"id": "sent", "scenario": "talker", **SENT})
    source = "#!\n" + "pub.publish(rospy.get_param(name, 'hello world'))\n" * count
    package = {"package": {"files": [SCRIPT]}, "attachments": {SCRIPT["path"]: source}}
    runs = build_runs({"runs": {"package": package}})
    verdict = failed("a message reads 'hello world', not 'hello world <seconds>'").about(said="hello world")
    found = cite_source(verdict, lab.criteria[0], try_facts(lab, runs), runs["package"])
    assert [one.line for one in found.citations] == lines


@pytest.mark.parametrize(
    ("source", "line"),
    [
        ("for i in range(3):\n    server.publish_feedback(said)\n    rate.sleep()", 2),
        ("while (ros::ok()) {\n  as_.publishFeedback(feedback_);\n}", 2),
        ("server.publish_feedback(a)\nserver.publish_feedback(b)", None),
        ("server.set_succeeded(result)", None),
    ],
)
def test_the_loop_that_reports_is_shown_where_a_goal_goes_on_when_it_is_cancelled(
    source: str, line: int | None
) -> None:
    goal = {"check": "action-result", "with": {"action": "/count", "status": "PREEMPTED"}}
    lab = rubric({"id": "cancelled", "scenario": "talker", **goal})
    package = {"package": {"files": [SCRIPT]}, "attachments": {SCRIPT["path"]: f"#!\n{source}\n"}}
    runs = build_runs({"runs": {"package": package}})
    lost = failed("the goal ends SUCCEEDED", hint=f"in the loop, where {ASKED_TO_STOP} is true: …")
    found = cite_source(lost, lab.criteria[0], try_facts(lab, runs), runs["package"])
    assert found.citations == ((FileCitation(file=SCRIPT["path"], line=line + 1),) if line else ())
    late = failed("the result comes too late", hint="do not sleep longer than the handout asks")
    assert cite_source(late, lab.criteria[0], try_facts(lab, runs), runs["package"]) == late


MOVES = "def move(speed, way, on=True):\n    v.linear.x = abs(speed)\n    pub.publish(v)\n"


@pytest.mark.parametrize(
    ("source", "measured", "lines"),
    [
        (f"{MOVES}move(3, 2, True)\nmove(1, 3)", "0 to 3", [4]),
        (f"{MOVES}move(speed=3.0, way=2)\nrotate(3, 90)", "3", [4]),
        (f"{MOVES}move(3, 2)\nmove(3, 4)\nmove(3, 1)", "0 to 3", [4, 5, 6]),
        (f"{MOVES}move(2, 3)", "0 to 3", [2]),
        (f"{MOVES}move(3, 2)", "-1 to 3", [2]),
        ("def move(self, speed):\n    v.linear.x = speed\nrobot.move(3)", "3", [3]),
        ("v.linear.x = speed\ndef move(speed): pass\nmove(3)", "3", [1]),
    ],
)
def test_a_call_that_hands_a_wrong_speed_on_is_shown(source: str, measured: str, lines: list[int]) -> None:
    bounds = {"check": "field-bounds", "with": {"topic": "/cmd_vel", "field": "linear.x", "min": 0, "max": 2}}
    package = {"package": {"files": [SCRIPT]}, "attachments": {SCRIPT["path"]: f"{source}\n"}}
    lab, runs = (
        rubric({"id": "speed", "scenario": "talker", **bounds}),
        build_runs({"runs": {"package": package}}),
    )
    verdict = failed("it is 3").about(measured=measured)
    found = cite_source(verdict, lab.criteria[0], try_facts(lab, runs), runs["package"])
    assert found.citations == tuple(FileCitation(file=SCRIPT["path"], line=line) for line in lines)


REACTS = {
    "check": "reacts",
    "with": {
        "cause": {"topic": "/scan"},
        "effect": {"topic": "/cmd_vel", "field": "linear.x", "value": 0},
        "within_s": 1,
    },
}


@pytest.mark.parametrize(
    ("asked", "source", "lines"),
    [
        (FIELD, "speed = 2\nmsg.linear.x = speed", [1, 2]),
        (FIELD, "speed = rospy.get_param('~speed', 2)\nmsg.linear.x = speed  # m/s", [1, 2]),
        (FIELD, "double speed = 2;\nmsg.linear.x = speed;", [1, 2]),
        (FIELD, "speed = 2\nspeed += 1\nmsg.linear.x = speed", [3]),
        (FIELD, "a, speed = 1, 2\nmsg.linear.x = speed", [2]),
        (FIELD, "speed = 2\ndef drive(speed):\n    msg.linear.x = speed", [3]),
        (FIELD, "for speed in (1, 2):\n    msg.linear.x = speed", [2]),
        (FIELD, "ranges = []\nranges.append(1)\nmsg.linear.x = ranges", [3]),
        (FIELD, "speed = 2\nmsg.linear.x = speed * 2", [2]),
        (FIELD, "self.speed = 2\nmsg.linear.x = self.speed", [1, 2]),
        (FIELD, "self.speed = 2\nself.speed += 1\nmsg.linear.x = self.speed", [3]),
        (FIELD, "self.speed = 2\nspeed = 1\nmsg.linear.x = speed", [2, 3]),
        (FIELD, "s = 'Helo'\npub.publish(s)", [1, 2]),
        (FIELD, "S = f'Helo {n}'\nself.pub.publish(String(data=S))  # sent", [1, 2]),
        (FIELD, "self.s = 'Helo'\nself.pub.publish(String(self.s))", [1, 2]),
        (FIELD, "s = 'Helo'\ns += n\npub.publish(s)", [3]),
        (FIELD, "def send(s):\n    pub.publish(s)", [2]),
        (FIELD, 'const std::string s = "Helo";\npub->publish(s);', [1, 2]),
        (FIELD, 'ss << "Helo";\nmsg.linear.x = ss.str();', [1, 2]),
        (FIELD, 'ss << "Helo";\nss << n;\nmsg.linear.x = ss.str();', [3]),
        (FIELD, "goal.speed = 2\nmsg.linear.x = speed", [2]),
        (
            FIELD,
            "double s = m->data;\nstd::sort(s.begin(), s.end());\ncout << s << endl;\nmsg.linear.x = s;",
            [2, 4],
        ),
        (FIELD, "s = list(m.data)\ns.reverse()  # turn it round\nmsg.linear.x = s", [2, 3]),
        (FIELD, "s = list(m.data)\nrandom.shuffle(s)\nmsg.linear.x = s", [2, 3]),
        (FIELD, "s = list(m.data)\nt = merge(sort(s))\nmsg.linear.x = s", [3]),
        (FIELD, "s = list(m.data)\ns.sort()\ns.reverse()\nmsg.linear.x = s", [4]),
        (FIELD, "s = list(m.data)\nmsg.linear.x = s\ns.sort()", [2]),
        (REACTS, "msg.linear.x = 0.2\npub.publish(msg)", [1]),
        (REACTS, "speed = 0.2\nmsg.linear.x = speed\npub.publish(msg)", [1, 2]),
        (REACTS, "if near:\n    msg.linear.x = 0.1\nelse:\n    msg.linear.x = 0.2", []),
    ],
)
def test_a_wrong_field_is_shown_where_its_value_comes_from(
    asked: dict[str, Any], source: str, lines: list[int]
) -> None:
    lab = rubric({"id": "sent", "scenario": "talker", **asked})
    package = {"package": {"files": [SCRIPT]}, "attachments": {SCRIPT["path"]: f"{source}\n"}}
    runs = build_runs({"runs": {"package": package}})
    verdict = failed("it is 2").seeking("field", "linear.x")
    found = cite_source(verdict, lab.criteria[0], try_facts(lab, runs), runs["package"])
    assert found.citations == tuple(FileCitation(file=SCRIPT["path"], line=line) for line in lines)
    unsaid = cite_source(failed("nothing came"), lab.criteria[0], try_facts(lab, runs), runs["package"])
    assert unsaid.citations == (found.citations if asked is FIELD else ())


@pytest.mark.parametrize(
    ("values", "lines"),
    [
        (("2", "0.0", "2.0  # on"), [2, 6]),
        (("3", "0", "1"), [7]),
        (("2.5", "-2", "fast2"), [7]),
        (("fast(2)", "2", "0"), [4]),
    ],
)
def test_of_several_lines_that_set_a_field_those_with_the_wrong_value_are_shown(
    values: tuple[str, ...], lines: list[int]
) -> None:
    source = "\n".join(f"if a == {n}:\n    m.linear.x = {value}" for n, value in enumerate(values))
    package = {"package": {"files": [SCRIPT]}, "attachments": {SCRIPT["path"]: f"{source}\npub.publish(m)\n"}}
    lab, runs = (
        rubric({"id": "sent", "scenario": "talker", **FIELD}),
        build_runs({"runs": {"package": package}}),
    )
    verdict = failed("it is 2").seeking("field", "linear.x").about(measured="2")
    found = cite_source(verdict, lab.criteria[0], try_facts(lab, runs), runs["package"])
    assert found.citations == tuple(FileCitation(file=SCRIPT["path"], line=line) for line in lines)


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ('<node pkg="lab1" type="a.py" name="a"/>\n<include file="$(find elsewhere)/x.launch"/>', 3),
        ("<node pkg='elsewhere' type='b' name='b'/>", 2),
        ('<param name="elsewhere" value="1"/>', None),
    ],
)
def test_a_package_that_roslaunch_does_not_find_is_shown_where_it_is_named(
    text: str, line: int | None
) -> None:
    text = f"<launch>\n{text}\n</launch>"
    launch = parse_launch_files({"launch/a.launch": text.encode()}, ["lab1"])
    package = {"files": [SCRIPT], "launch_files": [one.model_dump() for one in launch]}
    lab = rubric({"id": "x", "check": "launch-runs", "with": {"launch": "a.launch", "scripts": ["a.py"]}})
    runs = build_runs({"runs": {"package": {"package": package, "attachments": {"launch/a.launch": text}}}})
    said = failed("it did not come up", hint="as it was").seeking("package", "elsewhere")
    found = cite_find(said, lab.criteria[0], try_facts(lab, runs).package, runs["package"])
    if line is None:
        assert found == said
    else:
        assert found.citations == (FileCitation(file="launch/a.launch", line=line),)
        assert found.hint.startswith(f"write the package's exact name on line {line}, push elsewhere if")


@pytest.mark.parametrize(
    ("value", "line"), [("5.0", 2), ("$(arg rate)", None), ("$(eval 2 * rate)", None), ("$(arg rates)", 2)]
)
def test_an_argument_that_nothing_in_the_launch_file_uses_is_shown(value: str, line: int | None) -> None:
    text = f'<launch>\n<arg name="rate" default="5.0"/>\n<param name="rate" value="{value}"/>\n</launch>'
    launch = parse_launch_files({"launch/a.launch": text.encode()}, ["lab1"])
    package = {"files": [], "launch_files": [one.model_dump() for one in launch]}
    start = {"title": "t", "start": [{"name": "all", "launch": "a.launch", "args": ["rate:=9"]}]}
    lab = rubric({**RATE, "scenario": "talker", "requires": []}, scenarios={"talker": start})
    runs = build_runs({"runs": {"package": {"package": package, "attachments": {"launch/a.launch": text}}}})
    lost = failed("it is slower", hint="look at it")
    found = cite_unused_argument(lost, lab.criteria[0], try_facts(lab, runs), runs["package"])
    if line is None:
        assert found == lost
    else:
        assert found.message == "it is slower; nothing in launch/a.launch uses its argument rate"
        assert found.hint == "write `$(arg rate)` where its value belongs; look at it"
        assert found.citations == (FileCitation(file="launch/a.launch", line=line),)


@pytest.mark.parametrize(
    ("text", "place", "line"),
    [
        (
            "project(lab1)\n# catkin_install_python(PROGRAMS\n#   scripts/a\n#   DESTINATION x\n# )\n",
            "lines 2 to 5",
            2,
        ),
        ("  ##catkin_install_python(PROGRAMS a DESTINATION b)\n# )\n", "line 1", 1),
        ("# then call catkin_install_python(…)\n", "", None),
    ],
)
def test_a_call_that_is_commented_out_is_named_by_its_lines(text: str, place: str, line: int | None) -> None:
    build, package = commented(text)
    lost = failed(
        "CMakeLists.txt: no catkin_install_python(…) is called, so nothing installs a.py",
        hint="write catkin_install_python(PROGRAMS a.py DESTINATION b) below catkin_package()",
        citations=(FileCitation(file="CMakeLists.txt"),),
    ).seeking("call", "catkin_install_python")
    found = cite_commented_call(lost, package, build)
    assert found.citations == (FileCitation(file="CMakeLists.txt", line=line),)
    if not place:
        assert found.hint == lost.hint
        return
    assert f"is called: it is commented out on {place}, so nothing installs a.py" in found.message
    call = "write catkin_install_python(PROGRAMS a.py DESTINATION b)"
    assert found.hint == f"in place of {place} {call}, without # before it"


def test_a_call_that_is_commented_out_is_looked_for_in_the_file_of_its_own_package() -> None:
    own, other = "../lab2/CMakeLists.txt", "# catkin_install_python(PROGRAMS a DESTINATION b)\n"
    texts = {"CMakeLists.txt": other, own: f"project(lab2)\n{other}"}
    runs = build_runs({"runs": {"package": {"package": {"cmake": {"calls": []}}, "attachments": texts}}})
    package = try_facts(rubric(CMAKE_CHECK), runs).package
    place = FileCitation(file=own, line=1)
    lost = failed("it is lost", citations=(place,)).seeking("call", "catkin_install_python")
    assert cite_commented_call(lost, package, runs["package"]).citations == (FileCitation(file=own, line=2),)


def commented(text: str, *interfaces: str) -> tuple[Run, PackageFacts]:
    """Return the build and the facts of a package with this CMakeLists.txt, whose calls are all comments."""
    package = {
        "cmake": {"calls": [["project", "lab1"]]},
        "interfaces": [{"path": p, "fields": []} for p in interfaces],
    }
    runs = build_runs({"runs": {"package": {"package": package, "attachments": {"CMakeLists.txt": text}}}})
    facts_ = try_facts(rubric(CMAKE_CHECK), runs)
    assert facts_.package is not None
    return runs["package"], facts_.package


@pytest.mark.parametrize(
    ("interface", "told", "lines"),
    [
        (
            "msg/Num.msg",
            "add_message_files(…) is commented out on lines 2 to 5; generate_messages(…) is commented out on line 6",
            [2, 6],
        ),
        ("srv/Add.srv", "generate_messages(…) is commented out on line 6", [6]),
        # the examples of the template are of no use, whatever is in front of them
        ("msg/Reading.msg", "generate_messages(…) is commented out on line 6", [6]),
    ],
)
def test_calls_that_make_messages_and_are_commented_out_are_named(
    interface: str, told: str, lines: list[int]
) -> None:
    text = "project(lab1)\n# add_message_files(\n#   FILES\n#   Num.msg\n# )\n# generate_messages()\n"
    build, package = commented(text, interface)
    hint = "list them in add_message_files(…) or add_service_files(…), and call generate_messages(…)"
    lost = failed("talker ended: the build makes the package's own messages", hint=hint)
    lost = lost.seeking("uncalled", *OF_INTERFACES)
    found = cite_commented_call(lost, package, build)
    assert found.message == f"{lost.message}; {told}"
    assert found.hint.startswith("remove the # from line")
    assert found.hint.endswith(hint)
    assert [one.line for one in found.citations if isinstance(one, FileCitation)] == lines
    assert cite_commented_call(passed("right"), package, build) == passed("right")


def test_the_templates_catkin_package_is_written_in_place_of_its_examples() -> None:
    text = "project(lab1)\n##     catkin_package(CATKIN_DEPENDS ...)\n#catkin_package(\n#  INCLUDE_DIRS include\n#)\n"
    build, package = commented(text)
    lost = failed(
        "catkin_package(…) is missing", hint="add catkin_package() below the find_package(…) on line 1"
    )
    found = cite_commented_call(lost.seeking("uncalled", "catkin_package"), package, build)
    assert found.message.endswith("catkin_package(…) is commented out on lines 3 to 5")
    assert found.hint == "write catkin_package() in place of lines 3 to 5 of CMakeLists.txt"


@pytest.mark.parametrize(
    ("call", "cited"),
    [("catkin_package()", True), ("find_package(catkin REQUIRED)", True), ("find_package(Boost)", False)],
)
def test_a_call_of_catkins_that_is_commented_out_is_named(call: str, cited: bool) -> None:
    build, package = commented(f"project(lab1)\n  #{call}\n")
    lost = failed(f"{call} is missing", hint=f"add {call}").seeking("uncalled", call.partition("(")[0])
    found = cite_commented_call(lost, package, build)
    assert (found.citations == (FileCitation(file="CMakeLists.txt", line=2),)) == cited
    assert ("is commented out on line 2" in found.message) == cited


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("catkin_install_python(PROGRAMS\n  src/b.py scr/a.py\n)\n", 2),
        ("catkin_install_python(PROGRAMS scr/a.py\n  DESTINATION b)\n", 1),
        ("catkin_install_python(PROGRAMS\n  # scr/a.py\n  ./scr/a.py.in\n  scr/a.py\n)\n", 4),
        ("catkin_install_python(PROGRAMS ${S}\n)\n# scr/a.py\n", 1),
        ("foreach(s a b)\n)\nx(scr/a.py)\n", 1),
    ],
)
def test_a_script_that_a_call_names_is_shown_on_its_own_line(text: str, line: int) -> None:
    build, _ = commented(text)
    why = "CMakeLists.txt: line {}: scr/a.py is named, but does not exist; the script is src/a.py"
    of_call, repaired = (FileCitation(file="CMakeLists.txt", line=one) for one in (1, line))
    found = cite_word_of_call(partial(0.5, why.format(1), citations=(of_call, repaired)), build)
    assert (found.message, set(found.citations)) == (why.format(line), {repaired})


MANIFEST_LINES = (
    "<package>\n  <exec_depend>rospy</exec_depend>\n  <!-- <exec_depend>std_msgs</exec_depend> -->\n"
)


@pytest.mark.parametrize(
    ("file", "sought", "line", "hint"),
    [
        ("package.xml", ("dependency", "std_msgs"), 3, "remove `<!--` and `-->` from line 3"),
        ("package.xml", ("dependency", "nav_msgs"), 2, "do"),
        ("CMakeLists.txt", ("component", "rostest"), 4, "do"),
        ("CMakeLists.txt", ("component", "tf2_ros"), 2, "do"),
        ("CMakeLists.txt", ("package", "rostest"), 2, "do"),
    ],
)
def test_a_dependency_is_shown_in_the_line_that_has_its_name(
    file: str, sought: tuple[SoughtKind, str], line: int, hint: str
) -> None:
    texts = {
        "package.xml": MANIFEST_LINES,
        "CMakeLists.txt": "project(lab1)\nfind_package(catkin REQUIRED COMPONENTS # rostest\n  rospy\n  rostest\n)\n",
    }
    build = build_runs({"runs": {"package": {"attachments": texts}}})["package"]
    lost = failed("it is lost", hint="do", citations=(FileCitation(file=file, line=2),)).seeking(*sought)
    found = cite_name(lost, build)
    assert (found.citations, found.hint) == ((FileCitation(file=file, line=line),), hint)
    assert found.message == "it is lost" + (": line 3 has it in a comment" if hint != "do" else "")


TALKER = "#!/usr/bin/env python3\nimport rospy\n\n    print('I heard ' + 5)\n" + "x" * (LINE_CHARS + 1) + "\n"


def shown(kind=failed, **place) -> FileCitation:
    build = build_runs({"runs": {"package": {"attachments": {"talker.py": TALKER}}}})["package"]
    (citation,) = show_lines(
        kind("it died", citations=(FileCitation(file="talker.py", **place),)), build
    ).citations
    assert isinstance(citation, FileCitation)
    return citation


def test_a_line_has_its_text() -> None:
    assert shown(line=2).source == "import rospy"


def test_pythons_carets_are_moved_by_the_indentation() -> None:
    found = shown(line=4, column=7, end_column=21, source="print('I heard ' + 5)")
    assert (found.column, found.end_column) == (11, 25)
    assert found.source[found.column - 1 : found.end_column - 1] == "'I heard ' + 5"


@pytest.mark.parametrize("place", [{"line": 1}, {"line": 3}, {"line": 5}, {"line": 99}, {}])
def test_what_stands_for_the_file_or_is_empty_or_long_has_none(place: dict[str, int]) -> None:
    assert shown(**place).source == ""


def test_a_pass_stays_as_it_is() -> None:
    assert shown(passed, line=2).source == ""


@pytest.mark.parametrize(
    ("owner", "numbers"), [("pub", [1, 4]), ("self.over", [2, 3, 4]), ("", [1, 2, 3, 4])]
)
def test_a_line_that_makes_a_message_for_another_publisher_keeps_its_type(
    owner: str, numbers: list[int]
) -> None:
    lines = [
        "msg = Int8()",
        "full = Int8()",
        "self.over.publish(Int8(1))",
        "both = Int8()",
        "pub = Publisher(a, Int8)",
    ]
    lines += ["pub.publish(msg)", "self.over.publish( full )", "pub.publish(both)", "self.over.publish(both)"]
    slip = PythonSlip(file="a.py", line=5, kind="publisher-type", message="Int8")
    made = PythonSlip(file="a.py", line=5, kind="publisher", message="a", name=owner)
    assert lines_making(lines, slip, [made]) == numbers


@pytest.mark.parametrize(
    ("source", "told"),
    [
        (
            "msg = Person()\nmsg.name = 'A'\nmsg.age = 4\nmsg.name += 'b'",
            "in place of `name` and `age` on lines 2 to 4 of a.py",
        ),
        ("msg = Person()\nmsg.first = 1\nmsg.age = 4", "in place of `age` on line 3 of a.py"),
        ("msg = Person()\nmsg.first = 1\nother.age = 4", ""),
        ("pub.publish(msg)", ""),
    ],
)
def test_the_fields_of_a_type_of_the_package_are_told_where_others_are_set(
    source: str, told: str, tmp_path: Path
) -> None:
    tree = {"package.xml": MANIFEST, "CMakeLists.txt": CMAKE, "msg/Num.msg": "int64 first\nint64 second\n"}
    package = read_package(make_package(tmp_path / "lab1", tree))
    slip = PythonSlip(file="a.py", line=1, kind="publisher-type", message="Person")
    found = lost_fields(source.split("\n"), slip, "Num", package)
    assert found == (f"set the fields of Num, `first` and `second`, {told}" if told else "")
    assert lost_fields(source.split("\n"), slip, "Unknown", package) == ""


@pytest.mark.parametrize(
    ("kind", "was", "wanted", "told"),
    [
        ("publisher-type", "String", "Int32", "put a number into its `data`, no text"),
        ("publisher-type", "String", "Bool", ""),
        ("publisher-type", "Int8", "String", ""),
        ("subscriber-type", "String", "Int32", ""),
    ],
)
def test_a_text_has_no_place_in_a_message_of_numbers(
    kind: SlipKind, was: str, wanted: str, told: str
) -> None:
    slip = PythonSlip(file="a.py", line=1, kind=kind, message=was)
    assert (
        lost_fields([f"pub = Publisher('a', {was})", f"msg = {was}()", "msg.data = x"], slip, wanted) == told
    )
