"""What repeated runs and copies show: losses seen once, the runs that a repair concerns, lines as handed in."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import pytest

from grader.evidence.run import Run
from grader.judging import judge
from grader.judging.judge import judge_all_runs
from grader.judging.repair_charges import charge_repairs, is_next_fault
from grader.judging.repeats_and_repairs import (
    drop_unrepeated_losses,
    is_used_by,
    launched_in,
    never_run,
    repairs_as_handed_in,
    with_lines_as_handed_in,
    with_names_as_handed_in,
)
from grader.model.repair import Repair
from grader.model.verdict import FileCitation, failed, failed_or_blocked
from grader.package.launch import parse_launch_files
from tests.support.rubrics import ALL, GOOD_RUN, NODE, PACKAGE, SCENARIO, SCRIPT, built, on_copy, rubric
from tests.support.timeline import build_runs
from tests.support.timeline_facts import complete_facts


def test_what_was_seen_once_costs_nothing() -> None:
    alone = {name: value for name, value in NODE.items() if name != "requires"}
    silent = {**GOOD_RUN, "topics": [], "graph": []}
    runs = build_runs({"runs": {"talker": silent}, "package": PACKAGE})
    first = judge_all_runs(rubric(alone), runs)
    assert [c.status.value for c in first.criteria] == ["fail"]
    assert first.doubtful == {"talker"}
    again = build_runs({"runs": {"talker": GOOD_RUN}, "package": PACKAGE})
    (node,) = judge(rubric(alone), {**runs, "repeated-1/talker": again["talker"]})
    assert (node.status.value, node.points) == ("pass", 10)
    assert "seen once and not again" in node.message
    (node,) = judge(rubric(alone), {**runs, "repeated-1/talker": runs["talker"]})
    assert (node.status.value, node.points) == ("fail", 0)


def test_a_line_that_two_runs_show_is_cited_once() -> None:
    lab = rubric({name: value for name, value in NODE.items() if name != "requires"})
    (name,) = (c.id for c in lab.criteria)
    slow = failed("slow", citations=(FileCitation(file="src/talker.py", line=3),)).if_repeated()
    found = drop_unrepeated_losses(lab, {name: slow}, {name: slow}, {"talker"})
    assert found[name].citations == slow.citations


def test_what_a_sure_loss_explains_is_not_run_again() -> None:
    asks = {"id": "asks", "check": "calls", "with": {"service": "/add"}, "scenario": "talker"}
    sums = {
        "id": "sum",
        "check": "prints",
        "with": {"process": "talker", "text": "sum"},
        "scenario": "talker",
    }
    lookup = {
        "action": "lookup",
        "actor": "/talker",
        "topic": "/sum",
        "at_s": 1,
        "detail": "it was not there",
    }
    quiet = {**GOOD_RUN, "topics": [], "console": [], "actors": [*GOOD_RUN.get("actors", []), lookup]}
    runs = build_runs({"runs": {"talker": quiet}, "package": PACKAGE})
    assert judge_all_runs(rubric(sums), runs).doubtful == {"talker"}
    found = judge_all_runs(rubric(asks, {**sums, "requires": ["asks"]}), runs)
    assert [c.status.value for c in found.criteria] == ["fail", "blocked"]
    assert found.doubtful == frozenset()


@pytest.mark.parametrize(
    ("file", "runs"),
    [
        ("src/numeric_talker.py", {"talker", "lab", "other"}),
        ("src/helper.py", {"talker", "lab", "other"}),
        ("launch/lab.launch", {"lab"}),
        ("launch/included.launch", {"lab", "other"}),
    ],
)
def test_a_repair_concerns_the_runs_that_use_its_file(file: str, runs: set[str]) -> None:
    launched = {
        name: {**SCENARIO, "start": [{"name": "all", "launch": f"{name}.launch"}]}
        for name in ("lab", "other")
    }
    asked = rubric(*ALL, scenarios={"talker": SCENARIO, **launched})
    name = Repair(kind="node-name", file=file, line=1, before="a", after="b", message="m", fix="b")
    assert {s for s, one in asked.scenarios.items() if is_used_by(one, name, asked, built=True)} == runs
    known = {"lab.launch": {"a.py"}, "other.launch": {"*"}}  # the second includes what is not known
    used = {
        s for s, one in asked.scenarios.items() if is_used_by(one, name, asked, built=True, launched=known)
    }
    assert used == runs - ({"lab"} if "included" in file else set())


@pytest.mark.parametrize(
    ("line", "uses"),
    [
        ("  FILES Add.srv", True),
        ("FILES Fly.action", True),
        ("  scripts/other.py", False),
        ("  rospy", False),
    ],
)
def test_a_definition_that_is_named_concerns_the_runs_though_the_build_worked(line: str, uses: bool) -> None:
    asked = rubric(*ALL)
    one = Repair(
        kind="build-line", file="CMakeLists.txt", line=5, before="", after=line, message="m", fix="f"
    )
    assert is_used_by(asked.scenarios["talker"], one, asked, built=True) is uses


@pytest.mark.parametrize(
    ("starts", "uses"),
    [
        ('<node pkg="lab1" type="other.sh" name="n"/>', True),
        ('<node pkg="lab1" type="talker.py" name="n"/>', False),
        ('<node pkg="lab1" type="$(eval p)" name="n"/>', True),
        ('<param name="p" command="$(find lab1)/launch/other.sh"/>', True),
        ('<include file="$(find other)/all.launch"/>', True),
        ("<node", True),
    ],
)
def test_the_bit_of_a_script_concerns_the_launch_files_that_may_start_it(starts: str, uses: bool) -> None:
    launched = {**SCENARIO, "start": [{"name": "all", "launch": "lab.launch"}]}
    asked = rubric(*ALL, scenarios={"talker": SCENARIO, "lab": launched})
    bit = Repair(kind="executable-bit", file="launch/other.sh", message="m", fix="chmod +x launch/other.sh")
    text = f"<launch>{starts}</launch>".encode()
    files = [f.model_dump() for f in parse_launch_files({"launch/lab.launch": text}, ["lab1"])]
    known = launched_in(complete_facts({**PACKAGE, "name": "lab1", "launch_files": files}))
    assert is_used_by(asked.scenarios["lab"], bit, asked, built=True, launched=known) == uses
    assert is_used_by(asked.scenarios["lab"], bit, asked, built=True)
    assert not is_used_by(asked.scenarios["talker"], bit, asked, built=True, launched=known)


@pytest.mark.parametrize("included", ["other.launch", "all.launch"])
def test_a_launch_file_concerns_those_that_include_it(included: str) -> None:
    launched = {**SCENARIO, "start": [{"name": "all", "launch": "lab.launch"}]}
    asked = rubric(*ALL, scenarios={"talker": SCENARIO, "lab": launched})
    texts = {
        "launch/lab.launch": f'<launch><include file="$(find lab_1)/launch/{included}"/></launch>',
        "launch/all.launch": '<launch><include file="$(dirname)/third.launch"/></launch>',
        "launch/other.launch": "<launch/>",
        "launch/third.launch": "<launch/>",
    }
    files = [
        one.model_dump() for one in parse_launch_files({p: t.encode() for p, t in texts.items()}, ["lab1"])
    ]
    known = launched_in(complete_facts({**PACKAGE, "name": "lab1", "launch_files": files}))
    used = {
        path
        for path in texts
        if is_used_by(
            asked.scenarios["lab"],
            Repair(kind="package-name", file=path, message="m", fix="f"),
            asked,
            built=True,
            launched=known,
        )
    }
    others = (
        {"launch/all.launch", "launch/third.launch"} if included == "all.launch" else {"launch/other.launch"}
    )
    assert used == {"launch/lab.launch", *others}


def test_what_a_launch_file_starts_is_no_module_of_another_script() -> None:
    launched = {**SCENARIO, "start": [{"name": "all", "launch": "lab.launch"}]}
    asked = rubric(*ALL, scenarios={"talker": SCENARIO, "lab": launched})
    repair = Repair(
        kind="python-syntax", file="src/other.py", line=1, before="a", after="b", message="m", fix="b"
    )
    for names, runs in (({}, {"talker", "lab"}), ({"lab.launch": {"other.py"}}, {"lab"})):
        used = {
            name
            for name, one in asked.scenarios.items()
            if is_used_by(one, repair, asked, built=True, launched=names)
        }
        assert used == runs


@pytest.mark.parametrize(
    ("talker", "module", "named", "uses"),
    [
        ("import rospy\n", "helper", "", False),
        ("import other\n", "helper", "", True),
        ("from lab1 import helper\n", "helper", "import other\n", True),
        ("from lab1 import work\n", "lab1/__init__", "from .other import work\n", True),
        ("", "helper", "import other\n", True),
    ],
)
def test_a_module_concerns_the_scripts_that_name_it(talker: str, module: str, named: str, uses: bool) -> None:
    asked = rubric(*ALL, scenarios={"talker": SCENARIO})
    repair = Repair(
        kind="python-syntax", file="src/other.py", line=1, before="a", after="b", message="m", fix="b"
    )
    texts = {str(SCRIPT["path"]): talker, f"src/{module}.py": named or "pass\n", "src/other.py": "a\n"}
    files = [{"path": path, "size_bytes": 9} for path in texts]
    package = complete_facts({**PACKAGE, "name": "lab1", "files": files})
    build = cast("Run", SimpleNamespace(file_lines=lambda path: texts[path].splitlines()))
    known = launched_in(package, build)
    assert is_used_by(asked.scenarios["talker"], repair, asked, built=True, launched=known) is uses


IMPORT = Repair(
    kind="missing-import",
    file="a.py",
    line=2,
    before="import rospy",
    after="import rospy\nfrom std_msgs.msg import Int8",
    message="",
    fix="",
)
GLOBAL = Repair(
    kind="python-syntax",
    file="a.py",
    line=5,
    before="    if x:\n        global x\n        x = 1\n        global y",
    after="    global x, y\n    if x:\n        x = 1",
    message="",
    fix="",
)
RENAME = Repair(kind="file-name", file="a.py", before="a.py", after="b.py", message="", fix="")
EXCHANGE = Repair(kind="exchanged-files", file="a.py", before="a.py", after="c.py", message="", fix="")


def test_a_copy_of_a_script_that_is_not_the_one_that_runs_explains_nothing() -> None:
    files = ("src/numeric_talker.py", "old/numeric_talker.py", "src/other.py")
    package = complete_facts({"files": [{"path": path} for path in files]})
    assert never_run(package, rubric(*ALL)) == {"old/numeric_talker.py"}


@pytest.mark.parametrize(
    ("repairs", "file", "line", "as_handed_in"),
    [
        ((IMPORT,), "a.py", 1, 1),
        ((IMPORT,), "a.py", 2, 2),
        ((IMPORT,), "a.py", 9, 8),
        ((IMPORT,), "other.py", 9, 9),
        ((GLOBAL,), "a.py", 6, 5),
        ((GLOBAL,), "a.py", 7, 7),
        ((GLOBAL,), "a.py", 8, 9),
        ((IMPORT, RENAME), "b.py", 9, 8),
        ((RENAME,), "b.py", 9, 9),
        ((IMPORT, EXCHANGE), "c.py", 9, 8),
        ((IMPORT, EXCHANGE), "a.py", 9, 9),
        ((IMPORT, RENAME, EXCHANGE.model_copy(update={"before": "b.py"})), "c.py", 9, 8),
    ],
)
def test_lines_of_the_copy_are_told_as_they_were_handed_in(repairs, file, line, as_handed_in):
    place = FileCitation(file=file, line=line)
    verdict = failed(f"{file}, line {line} asks", hint=f"on line {line}, write it", citations=(place,))
    told = with_lines_as_handed_in(verdict, repairs)
    assert told.message == f"{file}, line {as_handed_in} asks"
    assert told.hint == f"on line {as_handed_in}, write it"
    assert told.citations == (FileCitation(file=file, line=as_handed_in),)


def test_files_that_are_exchanged_are_told_by_where_the_lines_are_as_handed_in():
    copy = failed("", citations=(FileCitation(file="c.py", line=9), FileCitation(file="a.py", line=3)))
    placed = with_names_as_handed_in(copy, (EXCHANGE,))
    assert [one.file for one in placed.citations] == ["a.py", "c.py"]
    renamed = with_names_as_handed_in(copy, (RENAME, EXCHANGE.model_copy(update={"before": "b.py"})))
    assert [one.file for one in renamed.citations] == ["a.py", "a.py"]


def test_several_lines_and_those_of_other_files_in_one_text():
    cited = (FileCitation(file="a.py", line=9), FileCitation(file="c.py", line=9))
    hint = "write it on lines 8, 9 and 12 of a.py, and on line 9 of c.py; line 3"
    told = with_lines_as_handed_in(failed("", hint=hint, citations=cited), (IMPORT,))
    assert told.hint == "write it on lines 7, 8 and 11 of a.py, and on line 9 of c.py; line 3"


def test_a_repair_names_its_lines_as_they_were_handed_in() -> None:
    later = Repair(kind="missing-call", file="a.py", line=9, before="x", after="y", message="line 9 of a.py: x",
                   fix="write y; delete lines 9, 11 and 12")  # fmt: skip
    (told,) = repairs_as_handed_in([later], (IMPORT, later))
    assert (told.line, told.message, told.fix) == (
        8,
        "line 8 of a.py: x",
        "write y; delete lines 8, 10 and 11",
    )
    assert repairs_as_handed_in([IMPORT], (IMPORT, later)) == (IMPORT,)


def test_a_build_that_two_lines_stop_names_the_one_that_it_is_charged_with() -> None:
    name = Repair(
        kind="build-line",
        file="CMakeLists.txt",
        line=1,
        before="project(other)",
        after="project(lab1)",
        message="project(other) differs from the package's name lab1",
        fix="project(lab1)",
    )
    install = Repair(
        kind="build-line",
        file="CMakeLists.txt",
        line=3,
        before="catkin_install_python(PROGRAMS a.py DESTINATION lib)",
        after="",
        message="line 3 of CMakeLists.txt: catkin_install_python(…) names a.py, which the package does not have",
        fix="add a.py and push it, or remove it from that call",
    )
    asked = rubric(
        {"id": "cmake", "check": "cmake", "with": {"name": "lab1"}}, {"id": "build", "check": "build"}
    )
    calls = [["project", "other"], ["find_package", "catkin"], ["catkin_package"]]
    calls.append(["catkin_install_python", "PROGRAMS", "a.py"])
    whole = {"name": "lab1", "path": "lab1", "manifest": {}, "files": [{"path": "CMakeLists.txt"}]}
    said = [
        "CMake Error at /usr/share/catkin/cmake/catkin_package_xml.cmake:54 (message):",
        "  catkin_package_xml() package name 'lab1' in 'package.xml' does not match",
        "  current PROJECT_NAME 'other'.",
        "Call Stack (most recent call first):",
        "  lab1/CMakeLists.txt:2 (catkin_package)",
    ]
    end = {"name": "catkin_make", "role": "build", "exit_s": 3}
    run = {
        "package": {**whole, "cmake": {"calls": calls}},
        "processes": [{**end, "exit_code": 1}],
        "console": [{"process": "catkin_make", "stream": "stderr", "lines": said}],
    }
    fixed = {
        "package": {**whole, "cmake": {"calls": [["project", "lab1"], *calls[1:3]]}},
        "processes": [{**end, "exit_code": 0}],
    }
    runs = build_runs({"runs": {"package": run}})
    runs |= on_copy(build_runs({"runs": {"package": fixed}}), name, install)
    cmake, build = judge(asked, runs)
    assert cmake.hint == "write project(lab1)"
    assert build.message == install.message
    assert build.hint == f"CMakeLists.txt line 3: {install.fix}"


def test_a_field_and_its_name_in_the_code_are_one_mistake() -> None:
    about = {"line": 2, "before": "float64 rigth", "after": "float64 right", "message": "a misspelt field"}
    field = Repair(
        kind="build-line", file="msg/Wheels.msg", fix="write right, and right in src/talker.py", **about
    )
    code = field.model_copy(update={"kind": "missing-call", "file": "src/talker.py"})
    lost = {
        name: failed("wrong", hint=field.fix, citations=(FileCitation(file=file, line=2),))
        for name, file in (("node", field.file), ("rate", code.file))
    }
    asked = rubric(*(one for one in ALL if one["id"] in lost))
    needs = {"node": (field,), "rate": (field, code)}
    assert charge_repairs(asked, lost, needs.keys(), needs) == {field: {"node"}, code: {"node"}}


@pytest.mark.parametrize(
    ("hint", "is_next"), [("write 0 in place of -1", True), ("read it with rospy.get_param('~width')", False)]
)
def test_what_a_parameter_hides_is_told_of_the_copy_that_reads_it(hint: str, is_next: bool) -> None:
    """Without a line that is cited: where it is published says nothing of the parameter."""
    read = Repair(
        kind="parameter-name",
        file="scripts/mapper.py",
        line=4,
        before="width = rospy.get_param('width')",
        after="width = rospy.get_param('~width')",
        message="the parameter width should be ~width",
        fix="width = rospy.get_param('~width')",
    )
    one = failed(
        "data is [-1, -1], not [0]; no node reads /map/width", hint="read it with rospy.get_param('~width')"
    )
    assert is_next_fault(one, failed("data is -1, not 0", hint=hint), [read]) is is_next


def test_names_of_two_kinds_are_told_where_each_is_seen() -> None:
    """A value that came is no reason to doubt its topic; one criterion is not charged with both."""
    common = {"file": "src/talker.py", "message": "another name", "fix": "the name"}
    topic = Repair(kind="topic-name", line=4, before="'/chatter'", after="'chatter'", **common)
    parameter = Repair(kind="parameter-name", line=6, before="'word'", after="'~word'", **common)
    cited = (FileCitation(file="src/talker.py", line=6),)
    lost = {
        "chatter": failed("data is 'none', not 'one'", hint="").of_value(nan=False),
        "rate": failed_or_blocked("no message came on /lab/text", hint="").about(citations=cited),
    }
    asked = rubric(*({**one, "requires": []} for one in ALL if one["id"] in lost))
    needs = dict.fromkeys(lost, (topic, parameter))
    assert charge_repairs(asked, lost, needs.keys(), needs) == {topic: {"rate"}, parameter: {"chatter"}}


def test_what_the_build_did_not_make_is_no_fault_of_a_node_that_has_another_one() -> None:
    """The node is charged with what it lacks once it is built."""
    lacking = [
        "Traceback (most recent call last):",
        '  File "/ws/src/lab1/src/numeric_talker.py", line 2, in <module>',
        "ModuleNotFoundError: No module named 'lab1'",
    ]
    console = {"process": "talker", "stream": "stderr", "at_s": 0.2, "every_s": 0.001, "lines": lacking}
    died = {"processes": [{"name": "talker", "script": SCRIPT["path"], "exit_s": 0.3, "exit_code": 1}]}
    package = {
        **PACKAGE,
        "name": "lab1",
        "manifest": {},
        "interfaces": [{"path": "msg/Num.msg", "fields": []}],
    }
    line = Repair(
        kind="build-line",
        file="msg/Num.msg",
        line=1,
        before="boolean on",
        after="bool on",
        message="line 1 of msg/Num.msg: there is no field type boolean",
        fix="write `bool on`",
    )
    spin = Repair(
        kind="missing-call",
        file=SCRIPT["path"],
        line=9,
        before="talk()",
        after="talk()\nrospy.spin()",
        message="it ends as soon as it is set up",
        fix="write rospy.spin()",
    )
    first = {**died, "console": [console], "outcome": "ended"}
    runs = build_runs({"runs": {"talker": first}, "package": package}) | built(package, exit_code=1)
    good = build_runs({"runs": {"talker": GOOD_RUN}, "package": package}) | built(package, exit_code=0)
    asked = rubric({"id": "build", "check": "build"}, {**NODE, "requires": []})
    found = {c.id: c for c in judge(asked, runs | on_copy(good, line, spin))}
    assert found["node"].message == spin.message
