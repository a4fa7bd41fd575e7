"""What is added to verdicts: advice, the text of cited lines, hints in the language of a node, and unchanged files."""

from __future__ import annotations

from hashlib import sha256
from pathlib import Path
from typing import Any

import pytest

from grader.checks import CHECKS
from grader.checks.support.exit_causes import CAUSES
from grader.checks.support.scripts import OF_INTERFACES
from grader.checks.support.text import LOOP, in_language, init, publisher, set_param
from grader.evidence.run import Run
from grader.integrations.bundle import Bundle, add_lab
from grader.judging import judge
from grader.judging.annotate import add_advice, choose_hint_language, fill_slots, with_own_name
from grader.judging.cited_lines import (
    LINE_CHARS,
    cite_commented_call,
    cite_find,
    cite_name,
    cite_source,
    cite_unused_argument,
    show_lines,
)
from grader.judging.facts import Facts, try_facts
from grader.judging.judge import judge_files
from grader.model.package import PackageFacts
from grader.model.result import CriterionResult
from grader.model.verdict import FileCitation, SoughtKind, Status, failed, partial, passed
from grader.package import read_package
from grader.package.launch import parse_launch_files
from grader.rubric.load import load_rubric, read_beside_rubric
from tests.judging.rubrics import ALL, CHATTER, EXECUTABLE, GOOD_RUN, RATE, SCRIPT, rubric
from tests.judging.rubrics import NODE as LIVES
from tests.package.trees import CMAKE, MANIFEST, NODE, make_package
from tests.rubric.samples import faults, spoiled
from tests.support.timeline import build_runs

CMAKE_CHECK = {"id": "cmake", "check": "cmake", "with": {"name": "lab1"}}
OUT = "roslaunch leaves a <node> out: launch/x.launch, line 2:"
NODES = '<launch>\n<node pkg="lab1" type="talker" name="a"/>\n<node pkg="lab1" type="plain.py" name="b"/></launch>'


def facts(folder, **files: str) -> PackageFacts:
    tree = {"package.xml": MANIFEST, "CMakeLists.txt": CMAKE, **files}
    return read_package(make_package(folder / "lab1", tree, executable={"src/plain.py": False}))


def test_commands_have_the_name_that_the_package_has_as_handed_in(tmp_path: Path) -> None:
    renamed = facts(tmp_path).model_copy(update={"name": "my_lab"})
    shown = criterion().model_copy(
        update={"reproduce": "`rosrun lab1 talker.py` beside `roslaunch lab1 lab1.launch`"}
    )
    asked = rubric(*ALL)
    told = with_own_name(shown, asked, renamed).reproduce
    assert told == "`rosrun my_lab talker.py` beside `roslaunch my_lab lab1.launch`"
    assert with_own_name(shown, asked, facts(tmp_path)) == shown


def criterion(
    hint: str = "", *, status: Status = Status.PASS, scenario: str | None = None
) -> CriterionResult:
    return CriterionResult(
        id="cmake",
        title="",
        check="cmake",
        scenario=scenario,
        status=status,
        points=0,
        max_points=1,
        message="",
        expected="",
        measured="",
        hint=hint,
        reproduce="",
        citations=(),
    )


@pytest.mark.parametrize(
    ("visibility", "hint"),
    [
        (
            "visible",
            (
                'write `"hello world %s" % rospy.get_time()` in place of `input()`, and pause in the loop: '
                "write `rate = rospy.Rate(5)` above it and `rate.sleep()` as its last line"
            ),
        ),
        (
            "hidden",
            (
                "write a value in the code in place of `input()`, and pause in the loop: "
                "write `rate = rospy.Rate(10)` above it and `rate.sleep()` as its last line"
            ),
        ),
    ],
)
def test_a_node_that_asks_for_input_is_told_what_the_lab_wants_of_it(visibility: str, hint: str) -> None:
    message = {"topic": "/chatter", "template": "hello world {seconds}"}
    lab = rubric(
        CHATTER,
        LIVES,
        EXECUTABLE,
        {**RATE, "with": {"topic": "/chatter", "rate_hz": 5}, "visibility": visibility},
        {"id": "words", "check": "message", "with": message, "scenario": "talker", "visibility": visibility},
    )
    lost = failed("talker ended before", hint=CAUSES["EOFError"][1])
    chatter = next(c for c in lab.criteria if c.id == "chatter")
    assert fill_slots(lost, chatter, lab).hint == hint
    other = failed("no message came", hint="publish in the loop")
    assert fill_slots(other, chatter, lab) == other


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
FRAMES = {"check": "transform", "with": {"parent": "base", "child": "laser"}}
STAMPS = {"check": "stamps", "with": {"topic": "/reading"}}
FIELD = {"check": "field-equals", "with": {"topic": "/cmd_vel", "field": "linear.x", "value": 1}}


@pytest.mark.parametrize(
    ("asked", "source", "line"),
    [
        (SENT, "text = 'bye'\npub.publish()", 2),
        (SENT, "text = 'hello world'\npub.publish('hello world')", 2),
        (SENT, "pub.publish(text)\nif x:\n    pub.publish()", None),
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


def test_what_does_not_start_is_told_where_nothing_is_lost(tmp_path) -> None:
    script = "#!/usr/bin/env python3\n"
    files = {
        "src/old.py": "print 'a'\n",
        "src/talker.py": script,
        "src/plain.py": script,
        "launch/x.launch": NODES,
    }
    package = facts(tmp_path, **files)
    (told,) = add_advice([criterion()], package, rubric(CMAKE_CHECK))
    assert told.hint.split("; ") == [
        "src/old.py has a syntax error: `print` has no brackets, as in Python 2: write `print(...)`",
        "line 1: write `print('a')`",
        f'{OUT} there is no talker in the package: type="talker" lacks the .py of src/talker.py',
        'write type="talker.py"',
        "src/plain.py is not executable, so roslaunch does not find it (launch/x.launch, line 3)",
        "chmod +x src/plain.py, then git add --chmod=+x src/plain.py, commit and push",
    ]
    assert add_advice([told], package, rubric(CMAKE_CHECK)) == (told,)
    lost = criterion(status=Status.FAIL)
    assert add_advice([lost], package, rubric(CMAKE_CHECK)) == (lost,)


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


CMAKE_CPP = CMAKE + "\nadd_executable(talker src/talker.cpp)\n"
LAUNCH = (
    '<launch>\n<node pkg="lab1" type="talker" name="sender"/>\n'
    '<node pkg="lab1" type="listener.py" name="hearer"/>\n</launch>\n'
)
MIXED = {
    "package.xml": MANIFEST,
    "CMakeLists.txt": CMAKE_CPP,
    "src/talker.cpp": "int main() {}\n",
    "src/listener.py": "#!/usr/bin/env python3\n",
    "launch/both.launch": LAUNCH,
}
PYTHON = MIXED | {"CMakeLists.txt": CMAKE, "src/talker.py": ""}
del PYTHON["src/talker.cpp"]
STARTS = [{"name": "talker", "script": "src/talker"}, {"name": "listener", "script": "src/listener.py"}]
GRAPH = {
    "nodes": ["/sender", "/hearer"],
    "topic_types": {"/numbers": "std_msgs/Int8"},
    "publishers": {"/numbers": ["/sender"]},
    "subscribers": {"/numbers": ["/hearer"]},
    "services": {},
}


def hint(
    folder: Path,
    files: dict[str, str],
    starts: list[dict[str, str]],
    message: str = "",
    processes: dict[str, str] | None = None,
    **asked: str,
) -> str:
    """What a student reads of `LOOP`, in a criterion with these parameters."""
    package = read_package(make_package(folder / "lab1", files))
    scenario = {"title": "t", "start": starts, "until": {"window_s": 6, "topics": ["/numbers"]}}
    criterion: dict[str, Any] = {"id": "c", "check": "some", "with": asked, "scenario": "run"}
    known = rubric(criterion, scenarios={"run": scenario})
    runs = build_runs({"runs": {"run": {"graph": [{"at_s": 0, **GRAPH, "processes": processes or {}}]}}})
    facts = Facts(rubric=known, runs=runs, package=package)
    return choose_hint_language(failed(message, hint=LOOP), known.criteria[0], facts).hint


ROSPY, ROSCPP = "while not rospy.is_shutdown():", "while (ros::ok())"
OF_SCRIPTS = {"/sender": "talker", "/hearer": "listener"}


@pytest.mark.parametrize(
    ("said", "asked", "wanted"),
    [
        ("", {"process": "talker"}, ROSCPP),
        ("", {"process": "listener"}, ROSPY),
        ("", {"topic": "/numbers"}, ROSCPP),
        ("/hearer never subscribes to /numbers", {"topic": "/numbers"}, ROSPY),
        ("/sender ended", {"publisher": "sender", "subscriber": "hearer"}, ROSCPP),
        ("nothing was published", {"topic": "/other"}, f"{ROSPY} (in C++: {ROSCPP})"),
    ],
)
@pytest.mark.parametrize("launched", [False, True])
def test_each_node_of_a_mixed_package(tmp_path, said, asked, wanted, launched) -> None:
    starts = [{"name": "both", "launch": "both.launch"}] if launched else STARTS
    if launched and asked.get("process"):
        asked, said = {}, f"/{'sender' if asked['process'] == 'talker' else 'hearer'} ended"
    processes = dict.fromkeys(OF_SCRIPTS, "both") if launched else OF_SCRIPTS
    assert hint(tmp_path, MIXED, starts, said, processes, **asked) == wanted


@pytest.mark.parametrize(
    ("files", "starts", "wanted"),
    [
        (PYTHON, STARTS[1:], ROSPY),
        (PYTHON, [{"name": "both", "launch": "both.launch"}], ROSPY),
        (MIXED, STARTS[:1], ROSCPP),
        (MIXED, [{"name": "all", "built": True}], ROSCPP),
        (MIXED, [{"name": "talker", "script": "src/absent.py"}], ROSPY),
    ],
)
def test_what_a_scenario_starts_says_it_alone(tmp_path, files, starts, wanted) -> None:
    assert hint(tmp_path, files, starts, topic="/nothing") == wanted


@pytest.mark.parametrize(
    ("said", "python", "cpp"),
    [
        (init("a"), "rospy.init_node('a')", 'ros::init(argc, argv, "a")'),
        (
            init("a", anonymous=True),
            "rospy.init_node('a', anonymous=True)",
            'ros::init(argc, argv, "a", ros::init_options::AnonymousName)',
        ),
        (
            publisher("/n", "Int8, queue_size=10", type="std_msgs::Int8"),
            "rospy.Publisher('/n', Int8, queue_size=10)",
            'nh.advertise<std_msgs::Int8>("/n", 10)',
        ),
        (set_param("/on", True), "rospy.set_param('/on', True)", 'ros::param::set("/on", true)'),
        ("nothing of code", "nothing of code", "nothing of code"),
    ],
)
def test_what_is_written_in_each(said, python, cpp) -> None:
    assert in_language(said, "python") == python
    assert in_language(said, "cpp") == cpp
    assert in_language(said, None) == (python if python == cpp else f"{python} (in C++: {cpp})")


TALKER_FILE = "src/numeric_talker.py"
HANDED_OUT = "a" * 64
SAID = f"; {TALKER_FILE} is still as the course handed it out"
DIED = {"processes": [{"name": "talker", "exit_s": 0.3, "exit_code": 1}], "outcome": "ended"}


def told(
    digest: str, run: dict[str, Any] = GOOD_RUN, *, executable: bool = True
) -> dict[str, tuple[str, bool]]:
    """Each criterion's status, and whether its message ends with what is said of the script of this content."""
    files = [{**SCRIPT, "sha256": digest, "executable": executable}]
    runs = build_runs({"runs": {"talker": run}, "package": {"files": files}})
    results = judge(rubric(*ALL), runs, CHECKS, {HANDED_OUT})
    return {c.id: (c.status.value, c.message.endswith(SAID)) for c in results}


def test_a_lost_criterion_names_its_unchanged_file() -> None:
    assert told(HANDED_OUT, executable=False)["executable"] == ("fail", True)
    assert told("b" * 64, executable=False)["executable"] == ("fail", False)
    assert told(HANDED_OUT)["executable"] == ("pass", False)


def test_the_program_of_a_run_is_named_and_what_is_blocked_names_nothing() -> None:
    assert told(HANDED_OUT, DIED) == {
        "rate": ("blocked", False),
        "chatter": ("blocked", False),
        "node": ("fail", True),
        "executable": ("pass", False),
    }


def test_a_verdict_from_the_files_alone_names_it_too(tmp_path: Path) -> None:
    tree = {"package.xml": MANIFEST, "CMakeLists.txt": CMAKE, TALKER_FILE: NODE}
    facts = read_package(make_package(tmp_path / "lab1", tree, executable={TALKER_FILE: False}))
    (found,) = judge_files(rubric(EXECUTABLE), facts, CHECKS, {sha256(NODE.encode()).hexdigest()})
    assert found.criterion.message.endswith(SAID)


def with_starter(folder: Path, **files: str) -> Path:
    for name, text in files.items():
        path = folder / "handed_out" / "src" / f"{name}.py"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return spoiled(folder, ("package: lab1\n", "package: lab1\nstarter: handed_out\n"))


def test_the_starter_belongs_to_the_rubric(tmp_path: Path) -> None:
    path = with_starter(tmp_path, talker="# TODO\n", empty="")
    loaded = load_rubric(str(path))
    assert loaded.handed_out == {sha256(b"# TODO\n").hexdigest()}  # what is empty says nothing
    names = {"handed_out/src/talker.py", "handed_out/src/empty.py"}
    assert read_beside_rubric(loaded).keys() == names
    bundle = Bundle()
    add_lab(bundle, loaded, "lab")
    assert {name for name, _, _ in bundle.entries()} == {"lab/lab.yaml", *(f"lab/{name}" for name in names)}
    with_starter(tmp_path, talker="# TO DO\n")
    assert load_rubric(str(path)).digest != loaded.digest


@pytest.mark.parametrize("files", [{}, {"empty": ""}])
def test_a_starter_without_files_is_a_fault(tmp_path: Path, files: dict[str, str]) -> None:
    (fault,) = faults(with_starter(tmp_path, **files))
    assert fault == "lab.yaml:6: starter: there is no folder handed_out with files in it beside the rubric"
