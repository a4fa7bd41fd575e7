"""What a repaired copy changes: which criterion is charged, what the others earn, and what they say."""

from __future__ import annotations

import re
from typing import Any

import pytest

from grader.judging import judge
from grader.judging.judge import judge_all_runs
from grader.judging.repair_charges import charged_verdict
from grader.judging.repeats_and_repairs import concerns
from grader.model.repair import Repair
from grader.model.result import CriterionResult
from grader.model.verdict import FileCitation, failed, passed
from grader.package.launch import parse_launch_files
from tests.support.rubrics import (
    ALL,
    CMAKE_CHECK,
    EXECUTABLE,
    GOOD_RUN,
    NODE,
    PACKAGE,
    RATE,
    SCENARIO,
    SCRIPT,
    built,
    on_copy,
    rubric,
)
from tests.support.timeline import build_runs

DIED = {"processes": [{"name": "talker", "exit_s": 0.3, "exit_code": 1}], "outcome": "ended"}
TABS = Repair(
    kind="python-syntax",
    file="src/numeric_talker.py",
    line=7,
    before="\tx = 1",
    after="        x = 1",
    message="tabs and spaces are mixed in its indentation",
    fix="indent every line with four spaces",
)
TRACEBACK = [
    '  File "/ws/src/lab1/src/numeric_talker.py", line 7',
    "    x = 1",
    "TabError: inconsistent use of tabs and spaces in indentation",
]
TOPIC = Repair(
    kind="topic-name",
    file="src/numeric_talker.py",
    line=9,
    before="pub = rospy.Publisher('/chater', String, queue_size=10)",
    after="pub = rospy.Publisher('/chatter', String, queue_size=10)",
    message="the topic is /chatter, not /chater",
    fix="'/chatter'",
)


def judged(
    first: dict[str, Any], copy: dict[str, Any], *repairs: Repair, **keys: Any
) -> dict[str, CriterionResult]:
    runs = build_runs({"runs": {"talker": first}, "package": PACKAGE})
    runs |= on_copy(build_runs({"runs": {"talker": copy}, "package": PACKAGE}), *repairs)
    return {c.id: c for c in judge(rubric(*ALL, **keys), runs)}


def test_one_fault_is_charged_once_and_the_rest_earns_its_share() -> None:
    found = judged(DIED, GOOD_RUN, TABS)
    assert {name: (c.status.value, c.points) for name, c in found.items()} == {
        "rate": ("partial", 5),
        "chatter": ("partial", 5),
        "node": ("fail", 0),
        "executable": ("pass", 10),
    }
    assert found["node"].hint == "src/numeric_talker.py line 7: indent every line with four spaces"
    assert found["node"].repaired is not None
    assert found["node"].repaired.charged
    assert found["rate"].message.startswith(
        "judged on a copy with src/numeric_talker.py line 7 repaired: half of the points; "
    )
    assert found["executable"].repaired is None


def test_what_one_run_of_the_copy_lost_and_the_next_one_did_not_costs_nothing() -> None:
    late = {**GOOD_RUN, "topics": [], "graph": []}
    first, on_time, slow = (
        build_runs({"runs": {"talker": run}, "package": PACKAGE}) for run in (DIED, GOOD_RUN, late)
    )
    runs = first | on_copy(slow, TABS)
    assert judge_all_runs(rubric(*ALL), runs).doubtful_on_copy == {"talker"}
    assert not judge_all_runs(rubric(*ALL), first | on_copy(on_time, TABS)).doubtful_on_copy
    for again, points in ((on_time, 5), (slow, 0)):
        found = {c.id: c for c in judge(rubric(*ALL), {**runs, "repaired-2/talker": again["talker"]})}
        assert [found[name].points for name in ("rate", "chatter", "node")] == [points, points, 0]


def test_a_scenario_that_the_copy_did_not_run_is_not_repeated_on_it() -> None:
    """The copy may only be built; what the first run lost by its timing is then repeated as handed in."""
    late = {**GOOD_RUN, "topics": [], "graph": []}
    slow, on_time = (build_runs({"runs": {"talker": run}, "package": PACKAGE}) for run in (late, GOOD_RUN))
    copy = {name: run for name, run in on_copy(on_time, TABS).items() if not name.endswith("/talker")}
    runs = slow | {"repeated-1/talker": on_time["talker"]} | copy
    assert not judge_all_runs(rubric(*ALL), runs).doubtful_on_copy


def test_a_rate_that_the_copy_changes_is_judged_as_it_was_handed_in() -> None:
    slow = {**GOOD_RUN, "topics": [{"topic": "/chatter", "count": 7, "rate_hz": 1}]}
    call = TABS.model_copy(update={"kind": "missing-call", "before": "spin", "after": "spin()"})
    rate = TABS.model_copy(update={"kind": "loop-rate", "line": 9, "before": "Rate(1)", "after": "Rate(10)"})
    found = judged(slow, GOOD_RUN, call, rate)["rate"]
    assert (found.status.value, found.points, found.repaired) == ("fail", 0, None)


@pytest.mark.parametrize(
    ("message", "needed"),
    [
        ("catkin_make failed: CMakeLists.txt:9: catkin_install_python(…) names node.py", False),
        ("catkin_make failed: Could not find a package configuration file provided by robot_msgs", True),
        ("catkin_make failed: package.xml:4: mismatched tag", True),
    ],
)
def test_a_build_needs_a_dependency_only_if_it_fails_for_want_of_it(message: str, *, needed: bool) -> None:
    before = "  <exec_depend>rospy</exec_depend>"
    update = {"kind": "manifest-line", "file": "package.xml", "before": before}
    line = TABS.model_copy(update={**update, "after": f"{before}\n  <depend>robot_msgs</depend>"})
    lab = rubric({"id": "build", "title": "It builds", "points": 5, "check": "build"}, *ALL)
    found = {c.id: failed(message, hint="look") for c in lab.criteria}
    criterion = next(c for c in lab.criteria if c.id == "build")
    assert concerns(line, criterion, lab, found, built=False, launched={}) is needed


@pytest.mark.parametrize("repair", [TABS, TOPIC])
def test_one_fault_is_charged_once_where_no_criterion_requires_another(repair: Repair) -> None:
    first = DIED if repair is TABS else {**GOOD_RUN, "topics": [{"topic": "/chater", "count": 61}]}
    runs = build_runs({"runs": {"talker": first}, "package": PACKAGE})
    runs |= on_copy(build_runs({"runs": {"talker": GOOD_RUN}, "package": PACKAGE}), repair)
    lost = {
        free: [
            one.id
            for one in judge(
                rubric(*({**c, "requires": [] if free else c.get("requires", [])} for c in ALL)), runs
            )
            if one.points == 0
        ]
        for free in (False, True)
    }
    assert len(lost[False]) == len(lost[True]) == 1


def test_a_sleep_without_brackets_is_charged_to_the_rate() -> None:
    line = "        rate.sleep"
    sleep = TABS.model_copy(update={"kind": "missing-call", "line": 12, "before": line, "after": f"{line}()"})
    found = judged(DIED, GOOD_RUN, TABS, sleep)
    assert {name: (c.status.value, c.points) for name, c in found.items()} == {
        "rate": ("fail", 0),
        "chatter": ("partial", 5),
        "node": ("fail", 0),
        "executable": ("pass", 10),
    }
    assert found["node"].repaired is not None
    assert found["node"].repaired.repairs == (TABS,)


@pytest.mark.parametrize(
    ("line", "costs"),
    [
        ("        rospy.loginfo('sent {count}')", False),
        ('        print("sent {count}")', False),
        ("        pub = rospy.Publisher('robot{count}', String, queue_size=10)", True),
    ],
)
def test_a_text_without_its_f_costs_nothing_where_it_is_only_printed(line: str, costs: bool) -> None:
    after = re.sub(r"(?=['\"])", "f", line, count=1)
    text = TABS.model_copy(update={"kind": "missing-call", "line": 12, "before": line, "after": after})
    found = judged(DIED, GOOD_RUN, TABS, text)
    told = {one.id for one in found.values() if one.repaired and text in one.repaired.repairs}
    assert bool(told) is costs


def test_a_name_is_charged_where_the_rubric_asks_for_it() -> None:
    misspelt = {**GOOD_RUN, "topics": [{"topic": "/chater", "count": 61}]}
    found = judged(misspelt, GOOD_RUN, TOPIC)
    assert {name: (c.status.value, c.points) for name, c in found.items()} == {
        "rate": ("pass", 10),
        "chatter": ("fail", 0),
        "node": ("pass", 10),
        "executable": ("pass", 10),
    }
    assert "/chatter" in found["chatter"].hint


def test_a_name_that_a_launch_file_refuses_is_charged_there_alone() -> None:
    text = '<launch>\n<node pkg="lab1" type="numeric_talker.py" name="/talker"/>\n</launch>'
    wrong, right = (
        {
            **PACKAGE,
            "name": "lab1",
            "launch_files": [
                f.model_dump() for f in parse_launch_files({"launch/x.launch": one.encode()}, ["lab1"])
            ],
        }
        for one in (text, text.replace("/talker", "talker"))
    )
    slash = Repair(
        kind="node-name",
        file="launch/x.launch",
        line=2,
        before='name="/talker"',
        after='name="talker"',
        message="m",
        fix="f",
    )
    with_launch = {"launch": "x.launch", "scripts": ["src/numeric_talker.py"]}
    lab = rubric(
        {"id": "launch-xml", "check": "launch-xml", "with": with_launch},
        RATE | {"requires": []},
        scenarios={"talker": {**SCENARIO, "start": [{"name": "roslaunch", "launch": "x.launch"}]}},
    )
    runs = build_runs({"runs": {"talker": {"outcome": "ended"}}, "package": wrong})
    runs |= on_copy(build_runs({"runs": {"talker": GOOD_RUN}, "package": right}), slash)
    found = {c.id: c for c in judge(lab, runs)}
    assert {name: (c.status.value, c.points) for name, c in found.items()} == {
        "launch-xml": ("fail", 0),
        "rate": ("pass", 10),
    }


def test_what_a_blocked_criterion_is_lost_by_next_is_named_with_its_line() -> None:
    name = NODE | {"id": "name", "check": "node-name", "with": {"process": "talker", "names": ["talker"]}}
    fault = {"file": SCRIPT["path"], "line": 7, "kind": "TabError", "message": "inconsistent use of tabs"}
    broken = {"files": [{**SCRIPT, "python": True, "python_fault": fault}]}
    lines = [f'  File "/ws/src/lab1/{SCRIPT["path"]}", line 7', "TabError: inconsistent use of tabs"]
    died = {**DIED, "console": [{"process": "talker", "stream": "stderr", "every_s": 0.001, "lines": lines}]}
    runs = build_runs({"runs": {"talker": died}, "package": broken})
    value = TABS.model_copy(
        update={
            "kind": "missing-call",
            "line": 8,
            "before": "r = rospy.Rate = 1",
            "after": "r = rospy.Rate(1)",
            "message": "a value",
            "fix": "r = rospy.Rate(1)",
        }
    )
    slips = [{"file": SCRIPT["path"], "line": 4, "kind": "node-name", "message": "listener"}]
    listener = {
        **GOOD_RUN,
        "processes": [{**GOOD_RUN["processes"][0], "script": SCRIPT["path"], "nodes": ["/listener"]}],
    }
    copy = build_runs({"runs": {"talker": listener}, "package": {**PACKAGE, "slips": slips}})
    runs |= on_copy(copy, TABS, value)
    found = {c.id: c for c in judge(rubric(EXECUTABLE, name), runs)}["name"]
    assert found.message == "a value; with that repaired, the node is named /listener, not /talker"
    assert found.hint == (
        "src/numeric_talker.py line 8: write `r = rospy.Rate(1)`; "
        "then on line 4 of src/numeric_talker.py, write rospy.init_node('talker')"
    )


def test_what_is_wrong_besides_in_the_same_file_is_said_once() -> None:
    check = {"id": "manifest", "check": "manifest", "with": {"name": "lab1", "dependencies": ["std_msgs"]}}
    renamed = TABS.model_copy(
        update={
            "kind": "package-name",
            "file": "package.xml",
            "line": 3,
            "before": "  <name>lab_1</name>",
            "after": "  <name>lab1</name>",
            "message": "line 3 of package.xml: the package is called lab_1, not lab1",
            "fix": "write lab1 instead of lab_1 in package.xml, in project(…) and in every pkg=",
        }
    )
    runs = build_runs({"runs": {"talker": GOOD_RUN}, "package": {**PACKAGE, "manifest": {"name": "lab_1"}}})
    copy = build_runs({"runs": {"talker": GOOD_RUN}, "package": {**PACKAGE, "manifest": {"name": "lab1"}}})
    runs |= on_copy(copy, renamed)
    found = {c.id: c for c in judge(rubric(check), runs)}["manifest"]
    assert found.repaired is not None
    assert found.message.count("std_msgs") == found.hint.count("<exec_depend>std_msgs</exec_depend>") == 1


def test_the_line_that_is_told_first_is_cited_first() -> None:
    console = [{"process": "talker", "stream": "stderr", "at_s": 0.2, "every_s": 0.001, "lines": TRACEBACK}]
    later = TABS.model_copy(update={"line": 3, "message": "an import is missing", "fix": "import math"})
    found = judged({**DIED, "console": console}, GOOD_RUN, later, TABS)
    assert [c.line for c in found["node"].citations if isinstance(c, FileCitation)] == [7, 3]


def test_two_faults_are_two_losses() -> None:
    found = judged(DIED, GOOD_RUN, TABS, TOPIC)
    assert (found["node"].points, found["chatter"].points, found["rate"].points) == (0, 0, 5)
    assert found["chatter"].message == TOPIC.message


def test_the_rubric_has_its_own_shares_and_may_switch_a_repair_off() -> None:
    assert judged(DIED, GOOD_RUN, TABS, repairs={"python-syntax": 0.3})["rate"].points == 3
    off = judged(DIED, GOOD_RUN, TABS, repairs={"python-syntax": 0})
    assert (off["rate"].status.value, off["rate"].points) == ("blocked", 0)
    assert off["rate"].repaired is None


def test_what_fails_on_the_copy_too_says_why() -> None:
    slow = {**GOOD_RUN, "topics": [{"topic": "/chatter", "count": 31, "rate_hz": 5}]}
    found = judged(DIED, slow, TABS)
    assert (found["rate"].status.value, found["rate"].points) == ("fail", 0)
    assert "repaired" in found["rate"].message
    assert "5" in found["rate"].measured


def died(error: str, line: int) -> dict[str, Any]:
    """A run in which the talker dies of an error on this line."""
    where = f'  File "/ws/src/lab1/src/numeric_talker.py", line {line}, in main'
    console = [{"process": "talker", "stream": "stderr", "at_s": 0.2, "lines": [where, error]}]
    if not error.startswith("SyntaxError"):
        console[0]["lines"] = ["Traceback (most recent call last):", where, error]
    return {**DIED, "console": console}


def test_the_fault_behind_a_repaired_one_is_named() -> None:
    first, then = died("SyntaxError: invalid syntax", 7), died("KeyError: 'first'", 21)
    node = judged(first, then, TABS)["node"]
    assert (node.status.value, node.points) == ("fail", 0)
    assert "SyntaxError" in node.message
    assert "with that repaired" in node.message
    assert "KeyError: 'first'" in node.message
    assert node.hint.startswith("src/numeric_talker.py line 7: indent every line with four spaces; then ")


def test_what_the_machine_keeps_the_copy_from_showing_is_charged_to_no_other_criterion() -> None:
    found = judged(
        died("SyntaxError: invalid syntax", 7), died("ModuleNotFoundError: No module named 'tf'", 3), TABS
    )
    status = {name: one.status.value for name, one in found.items() if name != "executable"}
    assert status == {"node": "fail", "rate": "inconclusive", "chatter": "inconclusive"}
    assert "lacks tf" in found["rate"].message


SIGN = Repair(
    kind="turn-sign",
    file="src/numeric_talker.py",
    line=9,
    before="z = turn",
    after="z = -turn",
    message="wrong",
    fix="z = -turn",
)
SLOW = {**GOOD_RUN, "topics": [{"topic": "/chatter", "count": 30}]}


def test_logic_is_repaired_only_where_the_copy_passes() -> None:
    silent = {**GOOD_RUN, "topics": [{"topic": "/other", "count": 61}]}
    found = judged(silent, SLOW, SIGN)
    assert found["rate"].repaired is None
    assert all(one.repaired is None for one in judged(SLOW, silent, SIGN).values()), "one fault for another"
    whole = judged(silent, GOOD_RUN, SIGN)
    assert sorted(c.points for c in whole.values() if c.repaired is not None) == [0, 5]


def test_the_computers_clock_costs_nothing_where_there_is_no_simulator() -> None:
    clock = SIGN.model_copy(
        update={"kind": "ros-clock", "before": "time.sleep(1)", "after": "rospy.sleep(1)"}
    )
    silent = {**GOOD_RUN, "topics": [{"topic": "/other", "count": 61}]}
    scripts = SCENARIO["start"]
    for start, lost in (
        (scripts, 0),
        ([{"name": "sim", "program": "turtlesim/turtlesim_node"}, *scripts], 1),
    ):
        found = judged(silent, GOOD_RUN, clock, scenarios={"talker": {**SCENARIO, "start": start}})
        assert sum(c.points == 0 for c in found.values()) == lost


def test_a_copy_that_helps_nothing_changes_nothing() -> None:
    runs = build_runs({"runs": {"talker": DIED}, "package": PACKAGE})
    alone = judge(rubric(*ALL), runs)
    assert judged(DIED, DIED, TABS) == {c.id: c for c in alone}


def test_a_missing_call_is_charged_where_no_name_is_wrong() -> None:
    flooded = {**GOOD_RUN, "topics": [{"topic": "/chater", "count": 500, "rate_hz": 500}]}
    call = TABS.model_copy(update={"kind": "missing-call", "message": "rate.sleep is named but not called"})
    found = judged(flooded, GOOD_RUN, call, TOPIC)
    assert found["chatter"].hint == f"src/numeric_talker.py line 9: {TOPIC.fix}"
    assert (found["rate"].status.value, found["rate"].message) == ("fail", call.message)


def test_two_faults_of_one_criterion_are_both_its_hint() -> None:
    quote = TABS.model_copy(update={"line": 12, "fix": "print('x')"})
    found = judged(DIED, GOOD_RUN, TABS, quote)
    assert found["node"].hint == (
        "src/numeric_talker.py line 7: indent every line with four spaces; "
        "src/numeric_talker.py line 12: print('x')"
    )


def test_what_an_except_names_costs_nothing_without_an_exception() -> None:
    name = TABS.model_copy(update={"kind": "missing-call", "before": "except rospy.ROSInteruptException:"})
    assert judged(DIED, GOOD_RUN, TOPIC, name)["rate"].repaired.repairs == (TOPIC,)


def test_a_private_name_is_charged_where_the_rubric_asks_for_it() -> None:
    private = TOPIC.model_copy(update={"before": "pub = rospy.Publisher('~chatter', String)"})
    found = judged(DIED, GOOD_RUN, TABS, private)
    assert (found["node"].points, found["chatter"].points) == (0, 0)


def test_what_the_arena_repairs_before_it_runs_is_charged_to_no_run() -> None:
    mark = Repair(
        kind="byte-order-mark", file="src/numeric_talker.py", message="a mark", fix="save it without"
    )
    misspelt = {**GOOD_RUN, "topics": [{"topic": "/chater", "count": 61}]}
    found = judged(misspelt, GOOD_RUN, mark, TOPIC)
    assert (found["chatter"].points, found["rate"].points) == (0, 10)
    assert found["chatter"].repaired is not None
    assert found["chatter"].repaired.repairs == (TOPIC,)


def test_a_line_of_the_build_costs_the_build_alone_where_scripts_are_run() -> None:
    line = Repair(kind="build-line", file="CMakeLists.txt", line=3, message="open", fix="close it")
    misspelt = {**GOOD_RUN, "topics": [{"topic": "/chater", "count": 61}]}
    found = judged(misspelt, GOOD_RUN, line, TOPIC)
    assert (found["chatter"].points, found["rate"].points) == (0, 10)


def test_a_line_that_is_missing_is_added_below_its_neighbour() -> None:
    spin = TABS.model_copy(
        update={"before": "import rospy", "after": "import rospy\nimport sys", "fix": "import sys"}
    )
    assert judged(DIED, GOOD_RUN, spin)["node"].hint == "src/numeric_talker.py: below line 7 add `import sys`"


@pytest.mark.parametrize(
    ("blanks", "words"), [("\t\t", "2 tabs"), (" " * 8, "8 spaces"), ("\t ", "1 tab and 1 space")]
)
def test_a_line_that_is_added_begins_as_its_neighbour_does(blanks: str, words: str) -> None:
    sleep = TABS.model_copy(
        update={"before": f"{blanks}x", "after": f"{blanks}x\n{blanks}rate.sleep()", "fix": "rate.sleep()"}
    )
    told = f"src/numeric_talker.py: below line 7 add `rate.sleep()`, with {words} before it"
    assert judged(DIED, GOOD_RUN, sleep)["node"].hint == told


def test_a_criterion_that_passes_on_the_copy_needs_no_hint() -> None:
    found = judged(DIED, GOOD_RUN, TABS)
    assert (found["rate"].status.value, found["rate"].hint) == ("partial", "")


def test_a_build_that_the_manifest_blocks_is_judged_on_the_copy() -> None:
    tag = Repair(
        kind="manifest-line",
        file="package.xml",
        line=5,
        before="<description>x",
        after="<description>x</description>",
        message="<description> is never closed",
        fix="<description>x</description>",
    )
    asked = rubric(
        {"id": "manifest", "check": "manifest", "with": {"name": "lab1"}},
        {"id": "build", "check": "build", "requires": ["manifest"]},
    )
    fault = {"line": 9, "kind": "XMLSyntaxError", "message": "tag", "cause": "`<description>` is still open"}
    runs = built({"manifest": None, "manifest_fault": fault}, exit_code=1)
    assert [c.status.value for c in judge(asked, runs)] == ["fail", "blocked"]
    runs |= on_copy(built({"manifest": {}}, exit_code=0), tag)
    manifest, build = judge(asked, runs)
    assert (manifest.points, manifest.hint) == (0, f"package.xml line 5: write `{tag.fix}`")
    assert (build.status.value, build.points, build.hint) == ("partial", 5, "")


def test_a_line_of_the_build_is_charged_to_a_build_that_another_fault_blocks() -> None:
    line = Repair(
        kind="build-line",
        file="CMakeLists.txt",
        line=1,
        before="vcmake_minimum_required(VERSION 3.0.2)",
        after="cmake_minimum_required(VERSION 3.0.2)",
        message="there is no command vcmake_minimum_required",
        fix="cmake_minimum_required(VERSION 3.0.2)",
    )
    script = "src/numeric_talker.py"
    asked = rubric(
        {"id": "manifest", "check": "manifest", "with": {"name": "lab1"}},
        {"id": "talker", "check": "executable", "with": {"path": script}},
        {"id": "build", "check": "build", "requires": ["manifest"]},
    )
    install = ["catkin_install_python", "PROGRAMS", script, "DESTINATION", "lib/other"]
    package = {
        "manifest": {"name": "other"},
        "cmake": {"calls": [install]},
        "files": [{"path": script, "executable": False, "shebang": "#!/usr/bin/env python3"}],
    }
    said = [
        "CMake Error at lab1/CMakeLists.txt:1 (vcmake_minimum_required):",
        '  Unknown CMake command "vcmake_minimum_required".',
    ]
    runs = built(package, exit_code=1, said=said)
    assert [c.status.value for c in judge(asked, runs)] == ["fail", "fail", "blocked"]
    runs |= on_copy(built(package, exit_code=0), line)
    manifest, talker, build = judge(asked, runs)
    assert (manifest.repaired, talker.status.value, build.points) == (None, "partial", 0)
    assert build.hint == f"CMakeLists.txt line 1: write `{line.after}`"


def test_a_line_that_only_installs_scripts_costs_no_build_that_worked() -> None:
    """Another file has another name, and is told to be installed where it lies then."""
    renamed = Repair(
        kind="file-name",
        file="src/numeric_talkr.py",
        before="src/numeric_talkr.py",
        after="src/numeric_talker.py",
        message="src/numeric_talkr.py should be called numeric_talker.py",
        fix="git mv src/numeric_talkr.py src/numeric_talker.py",
    )
    line = Repair(
        kind="build-line",
        file="CMakeLists.txt",
        line=9,
        before="catkin_package()",
        after=f"catkin_package()\ncatkin_install_python(PROGRAMS {renamed.after} DESTINATION lib/lab1)",
        message=f"CMakeLists.txt does not install {renamed.after}",
        fix="write catkin_install_python(…)",
    )
    wanted = "scripts/numeric_talker.py"
    asked = rubric(
        {"id": "install", "check": "cmake-install", "with": {"scripts": [wanted]}},
        {"id": "talker", "check": "executable", "with": {"path": wanted}},
        {"id": "build", "check": "build", "with": {"scripts": [wanted]}, "requires": ["install", "talker"]},
    )
    script = {"path": renamed.before, "executable": True, "shebang": "#!/usr/bin/env python3"}
    calls = [["find_package", "catkin", "REQUIRED"], ["catkin_package"]]
    runs = built({"manifest": {}, "cmake": {"calls": calls}, "files": [script]}, exit_code=0)
    calls.append(["catkin_install_python", "PROGRAMS", renamed.after, "DESTINATION", "lib/lab1"])
    right = {"manifest": {}, "cmake": {"calls": calls}, "files": [{**script, "path": renamed.after}]}
    runs |= on_copy(built(right, exit_code=0), renamed, line)
    install, talker, build = judge(asked, runs)
    assert (install.points, talker.points, build.points) == (0, 0, build.max_points)
    assert f"PROGRAMS {renamed.after} DESTINATION" in install.hint
    assert wanted not in install.hint


def test_a_build_that_the_machine_ends_after_the_repair_leaves_what_it_makes_open() -> None:
    package = {**PACKAGE, "name": "lab1", "manifest": {}, "interfaces": [{"path": "msg/A.msg", "fields": []}]}
    package["files"] = [*package["files"], {"path": "msg/A.msg"}, {"path": "CMakeLists.txt"}]
    end = died("ModuleNotFoundError: No module named 'lab1'", 3)
    folder = (
        "CMake Error at CMakeLists.txt:4 (catkin_package):\n  catkin_package() include dir 'i' does not exist"
    )
    lacks = (
        'CMake Error: Could not find a package configuration file provided by "tf" with any of the following'
    )
    line = Repair(
        kind="build-line", file="CMakeLists.txt", line=4, before="a include", after="a", message="m", fix="f"
    )
    first, copy = (
        built(package, exit_code=1, said=said.split("\n"))
        | {"talker": build_runs({"runs": {"talker": end}, "package": package})["talker"]}
        for said in (folder, lacks)
    )
    asked = ({"id": "build", "check": "build"}, {**NODE, "requires": []}, {**RATE, "requires": ["node"]})
    found = {c.id: c for c in judge(rubric(*asked), {**first, **on_copy(copy, line)})}
    assert found["build"].status.value == "fail"
    assert {found[name].status.value for name in ("node", "rate")} == {"inconclusive"}


def test_what_no_repair_helps_is_told_with_all_of_its_faults() -> None:
    lacking = [
        "Traceback (most recent call last):",
        '  File "/ws/src/lab1/src/numeric_talker.py", line 3, in <module>',
        "ModuleNotFoundError: No module named 'numpy'",
    ]
    console = {"process": "talker", "stream": "stderr", "at_s": 0.2, "every_s": 0.001, "lines": lacking}
    died = {**DIED, "console": [console]}
    slip = {
        "file": TABS.file,
        "line": 9,
        "kind": "misspelt",
        "name": "calback",
        "message": "did you mean callback?",
    }
    slip["fix"] = "write callback instead of calback"
    runs = build_runs({"runs": {"talker": died}, "package": {**PACKAGE, "slips": [slip]}})
    runs |= on_copy(build_runs({"runs": {"talker": died}, "package": PACKAGE}), TOPIC)
    hints = {c.id: c.hint for c in judge(rubric(*ALL), runs)}
    assert hints["node"].startswith("on line 9, write callback instead of calback. For the rest, tell")


def test_a_dependency_is_told_with_one_tag() -> None:
    tag = Repair(
        kind="manifest-line",
        file="package.xml",
        line=5,
        before="<buildtool_depend>catkin</buildtool_depend>",
        after="<buildtool_depend>catkin</buildtool_depend>\n<depend>rospy</depend>",
        message="package.xml does not name rospy",
        fix="<depend>rospy</depend>",
    )
    asked = rubric(
        {"id": "manifest", "check": "manifest", "with": {"name": "lab1", "dependencies": ["rospy"]}},
        {"id": "build", "check": "build", "requires": ["manifest"]},
    )
    depends = [["buildtool_depend", "catkin"]]
    runs = built({"manifest": {"dependencies": depends}}, exit_code=1)
    copy = built({"manifest": {"dependencies": [*depends, ["depend", "rospy"]]}}, exit_code=0)
    manifest, _ = judge(asked, runs | on_copy(copy, tag))
    assert re.fullmatch(r"add <exec_depend>rospy</exec_depend> below line \d+", manifest.hint)


def test_the_same_slip_in_both_files_of_a_package_is_told_for_both() -> None:
    words = {"kind": "manifest-line", "line": 5, "before": "<depend>rspy</depend>", "message": "no rspy"}
    tag = Repair(file="package.xml", after="<depend>rospy</depend>", fix="<depend>rospy</depend>", **words)
    call = {"file": "CMakeLists.txt", "kind": "build-line", "before": "  rspy", "after": "  rospy"}
    component = Repair(**words | call, fix="write rospy instead of rspy")
    asked = rubric(
        {"id": "manifest", "check": "manifest", "with": {"name": "lab1", "dependencies": ["rospy"]}},
        {"id": "build", "check": "build", "requires": ["manifest"]},
    )
    tool = ["buildtool_depend", "catkin"]
    runs = built({"manifest": {"dependencies": [tool, ["depend", "rspy"]]}}, exit_code=1)
    copy = built({"manifest": {"dependencies": [tool, ["depend", "rospy"]]}}, exit_code=0)
    manifest, _ = judge(asked, runs | on_copy(copy, tag, component))
    told = r"write rospy instead of rspy on line \d+; CMakeLists.txt line 5: write rospy instead of rspy"
    assert re.fullmatch(told, manifest.hint)


def test_a_file_that_is_written_as_a_whole_gets_no_hint_on_its_lines() -> None:
    words = {"kind": "build-line", "file": "CMakeLists.txt", "message": "m"}
    line = Repair(line=1, before="a", fix="f", **words)
    project = Repair(line=1, before="a", after="a\nproject(lab1)", fix="project(lab1)", **words)
    runs = built({"manifest": {}, "cmake": {"calls": [["rosbuild_init"]]}}, exit_code=1)
    calls = [["project", "lab1"], ["find_package", "catkin"], ["catkin_package"]]
    copy = built({"cmake": {"calls": calls}}, exit_code=0)
    for repairs in ([line], [project], [line, project]):
        (cmake,) = judge(rubric(CMAKE_CHECK), runs | on_copy(copy, *repairs))
        assert re.fullmatch("write these lines in place of all of it: [^;]+", cmake.hint)


def test_all_that_one_repair_adds_is_told_beside_another_repair() -> None:
    waits = "below the add_executable(…) on line {}, write add_dependencies({} ${{${{PROJECT_NAME}}_EXPORTED_TARGETS}})"
    each = [waits.format(9, "a"), waits.format(10, "b")]
    lines = [
        "add_executable(b b.cpp)",
        *(f"add_dependencies({one} ${{${{PROJECT_NAME}}_EXPORTED_TARGETS}})" for one in "ab"),
    ]
    added = Repair(kind="build-line", file="CMakeLists.txt", line=10, before=lines[0], after="\n".join(lines),
                   message="line 10 of CMakeLists.txt: a and b wait for nothing", fix="; ".join(each))  # fmt: skip
    removed = Repair(kind="build-line", file="CMakeLists.txt", line=4, before="INCLUDE_DIRS include", after="",
                     message="no folder include/", fix="remove INCLUDE_DIRS include")  # fmt: skip
    verdict = failed("no folder include/", hint="; ".join([removed.fix, *each]))
    told = charged_verdict(verdict, passed("catkin_make succeeded"), [added, removed], ())
    assert all(one in told.hint for one in [*each, removed.fix])


def test_what_the_copy_makes_before_another_program_does_not_compile_counts() -> None:
    line = Repair(
        kind="build-line",
        file="CMakeLists.txt",
        line=9,
        before="  INCLUDE_DIRS include",
        after="",
        message="catkin_package(…) names the folder include/",
        fix="remove INCLUDE_DIRS include",
    )
    files = [SCRIPT, {"path": "CMakeLists.txt"}, {"path": "msg/Num.msg"}, {"path": "src/mean.cpp"}]
    package = {**PACKAGE, "files": files, "interfaces": [{"path": "msg/Num.msg", "fields": []}]}
    lacks = died("ModuleNotFoundError: No module named 'lab1'", 3)
    runs = build_runs({"runs": {"talker": lacks}, "package": package})
    runs |= built(
        package,
        exit_code=1,
        said=[
            "CMake Error at lab1/CMakeLists.txt:9 (catkin_package):",
            "  catkin_package() include dir 'include' does not exist",
        ],
    )
    copy = build_runs({"runs": {"talker": GOOD_RUN}, "package": package})
    copy |= built(package, exit_code=1, said=["/w/src/lab1/src/mean.cpp:3:1: error: 'x' was not declared"])
    runs |= on_copy(copy, line)
    asked = rubric({"id": "build", "check": "build"}, {**NODE, "requires": []})
    build, node = judge(asked, runs)
    assert (build.status.value, node.status.value) == ("fail", "partial")
