from __future__ import annotations

from functools import cache
from pathlib import Path

import pytest

from grader.checks.registry import collecting
from grader.intake.open import open_submission
from grader.judging.judge import judge_files
from grader.model.file_fault import Fault
from grader.model.package import CMakeCall, CMakeFacts, PackageFacts
from grader.model.python_slip import PythonSlip
from grader.model.result import EarlyVerdict
from grader.model.submission import SourcePackage
from grader.model.verdict import Status, passed
from grader.package.facts import read_package
from tests.fixture_runs import loaded, source_of
from tests.package.trees import CMAKE, MANIFEST, make_package
from tests.package.trees import NODE as SCRIPT
from tests.support.rubrics import CMAKE_CHECK, EXECUTABLE, NODE, rubric

pytestmark = pytest.mark.usefixtures("without_processes")

SAMPLES = [
    ("leeds-comp3631-lab1", "reference"),
    ("leeds-comp3631-lab1", "ok-install-python"),
    ("leeds-comp3631-lab1", "manifest-malformed"),
    ("leeds-comp3631-lab1", "listener-syntax-error"),
    ("sheffield-com2009-week1", "reference"),
    ("sheffield-com2009-week1", "subscriber-missing"),
    ("sheffield-com2009-week1", "layout-scripts-folder"),
    ("mcr2-basic-comms", "launch-wrong-package"),
    ("york-ele00118m-lab7", "maintainer-todo"),
    ("eyantra-ros-basics", "ok-cpp-nodes"),
]
MANIFEST_CHECK = {"id": "manifest", "check": "manifest", "with": {"name": "lab1"}}
DEPENDENCIES = {
    "id": "dependencies",
    "check": "dependencies",
    "with": {"names": ["rospy"]},
    "requires": ["manifest"],
}


def facts_of(folder: Path, **files: str) -> PackageFacts:
    """A sound package, with these files changed."""
    tree = {"package.xml": MANIFEST, "CMakeLists.txt": CMAKE, "src/numeric_talker.py": SCRIPT, **files}
    package: SourcePackage = make_package(folder / "lab1", tree, executable={"src/numeric_talker.py": True})
    return read_package(package)


@cache
def facts_of_fixture(lab: str, name: str, folder: Path) -> PackageFacts:
    submission = open_submission(
        str(source_of(lab, name)), package=loaded(lab).rubric.package, workdir=folder
    )
    return read_package(submission.package, hints=submission.hints)


def early_of(lab: str, facts: PackageFacts) -> dict[str, EarlyVerdict]:
    return {v.criterion.id: v for v in judge_files(loaded(lab).rubric, facts, loaded(lab).checks)}


def after_a_build(facts: PackageFacts) -> PackageFacts:
    """As the build never leaves them: everything that it makes more precise is another."""
    call = CMakeCall(name="add_executable", args=("numeric_talker.py",), file="CMakeLists.txt", line=1)
    fault = Fault(file="x", line=1, kind="SyntaxError", message="no")
    slip = PythonSlip(file="x", line=1, kind="not-called", message="no")
    return facts.model_copy(
        update={
            "cmake": CMakeFacts(file="CMakeLists.txt", source="trace", calls=(call,), fault=fault),
            "slips": (slip,),
            "files": tuple(f.model_copy(update={"python_fault": fault}) for f in facts.files),
        }
    )


@pytest.mark.full
@pytest.mark.parametrize(("lab", "name"), SAMPLES)
def test_what_is_final_stays_whatever_the_build_finds_out(lab, name, tmp_path) -> None:
    facts = facts_of_fixture(lab, name, tmp_path)
    before, after = early_of(lab, facts), early_of(lab, after_a_build(facts))
    final = {key: verdict for key, verdict in before.items() if verdict.final}
    assert final
    assert final == {key: after.get(key) for key in final}


def test_every_file_criterion_of_a_lab_is_decided_in_the_rubrics_order(tmp_path) -> None:
    found = early_of("leeds-comp3631-lab1", facts_of_fixture("leeds-comp3631-lab1", "reference", tmp_path))
    assert [(key, verdict.final) for key, verdict in found.items()] == [
        ("manifest", True),
        ("cmake", False),
        ("talker-executable", False),
        ("listener-executable", False),
        ("dependencies", True),
    ]
    assert {verdict.criterion.status for verdict in found.values()} == {Status.PASS}


def test_the_build_may_still_make_a_wrapper_of_a_script_without_its_bit(tmp_path) -> None:
    found = early_of(
        "leeds-comp3631-lab1", facts_of_fixture("leeds-comp3631-lab1", "ok-install-python", tmp_path)
    )
    assert found["manifest"].criterion.status is Status.PASS
    assert "talker-executable" not in found


def test_what_a_required_criterion_explains_is_blocked_at_once(tmp_path) -> None:
    facts = facts_of(tmp_path, **{"package.xml": "<package>"})
    manifest, dependencies = judge_files(rubric(MANIFEST_CHECK, DEPENDENCIES), facts)
    assert manifest.criterion.status is Status.FAIL
    assert dependencies.criterion.status is Status.BLOCKED
    assert dependencies.final


def test_it_waits_where_what_it_requires_is_not_decided(tmp_path) -> None:
    facts = facts_of(tmp_path, **{"package.xml": "<package>"})
    needy = {**DEPENDENCIES, "requires": ["node"]}
    found = judge_files(rubric(EXECUTABLE, NODE, needy), facts)
    assert [verdict.criterion.id for verdict in found] == ["executable"]


def test_what_does_not_parse_is_told_before_anything_runs(tmp_path) -> None:
    faulty = {
        "src/numeric_talker.py": "#!/usr/bin/env python3\nprint 'hello'\n",
        "launch/lab1.launch": "<launch>",
    }
    found = early_of("leeds-comp3631-lab1", facts_of(tmp_path, **faulty))
    talker, launch = found["talker-executable"].criterion, found["launch"].criterion
    assert (talker.status, launch.status) == (Status.FAIL, Status.FAIL)
    assert "src/numeric_talker.py line 2: SyntaxError" in talker.message
    assert "launch/lab1.launch, line 1 is not well-formed" in launch.message
    assert talker.citations[0].column == 1
    assert talker.reproduce == "python3 -m py_compile src/numeric_talker.py"


@pytest.mark.parametrize(
    ("tags", "says"),
    [
        (
            '<node pkg="lab1" type="numeric_talker.py" name="a" output="Screen"/>',
            'output="Screen" is neither',
        ),
        ('<rosparam file="$(find lab11)/a.yaml"/>', "there is no package lab11: this one is called lab1"),
        ('<rosparam file="$(find lab2)/a.yaml"/>', ""),
        ('<include file="$(fnd lab1)/launch/b.launch"/>', "roslaunch does not know $(fnd …)"),
        ('<param name="a" value="$(args b)"/>', "roslaunch does not know $(args …)"),
        ('<param name="a" value="$(arg b)"/>', "no <arg> declares $(arg b)"),
        ('<node pkg="lab1" type="numeric_talker.py" name="a/b"/>', "has a slash in it"),
        ('<node pkg="lab1" type="numeric_talker.py" name="a" output="log"/>', ""),
        ('<arg name="b"/><param name="a" value="$(arg b) $(optenv C d) $(env E) $(anon f)"/>', ""),
        ('<rosparam file="$(find rospy)/a.yaml"/><param name="p" textfile="$(find other)/b"/>', ""),
        ('<rosparam file="$(find lab11)/a.yaml" if="$(eval 1 == 2)"/>', ""),
    ],
)
def test_what_roslaunch_refuses_is_told_before_anything_runs(tags, says, tmp_path) -> None:
    facts = facts_of(tmp_path, **{"launch/lab1.launch": f"<launch>\n{tags}\n</launch>"})
    found = early_of("leeds-comp3631-lab1", facts)
    launch = [one.criterion for name, one in found.items() if name == "launch"]
    assert [says in one.message and one.citations[0].line for one in launch] == ([2] if says else [])


def test_a_launch_file_whose_nodes_do_not_parse_connects_none(tmp_path) -> None:
    node = '<node pkg="lab1" type="{0}.py" name="{0}"/>'
    faulty = {
        "src/talker.py": "#!/usr/bin/env python3\nwhile True\n    pass\n",
        "src/listener.py": "#!/usr/bin/env python3\n",
        "launch/lab1.launch": f"<launch>{node.format('talker')}{node.format('listener')}</launch>",
    }
    launch = early_of("leeds-comp3631-lab1", facts_of(tmp_path, **faulty))["launch"]
    assert (launch.criterion.status, launch.final) == (Status.FAIL, False)
    assert "starts src/talker.py, line 2: SyntaxError" in launch.criterion.message
    assert launch.criterion.hint == "line 2: write `while True:`"
    assert launch.criterion.reproduce == "python3 -m py_compile src/talker.py"


def test_what_rests_on_something_unsettled_is_unsettled(tmp_path) -> None:
    facts = facts_of(tmp_path, **{"package.xml": "<package>", "CMakeLists.txt": "project(other)"})
    found = judge_files(rubric(CMAKE_CHECK, {**DEPENDENCIES, "requires": ["cmake"]}), facts)
    assert [(v.criterion.id, v.criterion.status, v.final) for v in found] == [
        ("cmake", Status.FAIL, False),
        ("dependencies", Status.BLOCKED, False),
    ]


def test_an_instructors_own_check_is_final_unless_it_looks_at_what_the_build_refines(tmp_path) -> None:
    from grader.checks import CHECKS, check  # noqa: PLC0415 - registered in here only

    with collecting("own.py") as own:

        @check("many-files")
        def many_files(package: PackageFacts):
            """There are files."""
            return passed(f"{len(package.files)} files")

        @check("compiles")
        def compiles(package: PackageFacts):
            """All Python compiles."""
            return passed(f"{sum(f.python_fault is not None for f in package.files)} faults")

    found = judge_files(
        rubric({"id": "many", "check": "many-files"}, {"id": "compiles", "check": "compiles"}),
        facts_of(tmp_path),
        {**CHECKS, **own.checks},
    )
    assert [(v.criterion.id, v.final) for v in found] == [("many", True), ("compiles", False)]


def test_nothing_that_needs_a_run_or_a_person_or_a_mended_check_is_decided(tmp_path) -> None:
    manual = {"id": "style", "check": "manual"}
    unknown = {"id": "unknown", "check": "no-such-check"}
    assert judge_files(rubric(NODE | {"requires": []}, manual, unknown), facts_of(tmp_path)) == ()


BROKEN = {
    "build": ({"package.xml": "<package>"}, "build", "package.xml, line 1 cannot be read"),
    "cmake": ({"CMakeLists.txt": "project(lab1"}, "build", "CMakeLists.txt, line 1 cannot be read"),
    "script": (
        {"src/numeric_talker.py": "import rospy\nif True\n"},
        "node",
        "numeric_talker.py line 2: SyntaxError",
    ),
}


@pytest.mark.parametrize("name", BROKEN)
def test_a_lab_without_criteria_of_files_hears_at_once_which_cannot_be_read(name, tmp_path) -> None:
    files, lost, says = BROKEN[name]
    facts = facts_of(tmp_path, **files)
    later = {**NODE, "id": "later", "requires": ["node"]}
    found = judge_files(rubric({"id": "build", "check": "build"}, {**NODE, "requires": []}, later), facts)
    assert [(one.criterion.id, one.criterion.status) for one in found] == [(lost, Status.FAIL)]
    assert says in found[0].criterion.message
    assert found[0].criterion.hint
    assert found[0].criterion.citations[0].file == next(iter(files))


def test_launch_files_are_told_the_name_that_the_manifest_is_told(tmp_path) -> None:
    launch = '<launch><node pkg="lab_1" type="numeric_talker.py" name="a"/></launch>'
    facts = facts_of(tmp_path, **{"launch/lab.launch": launch})
    parameters = {"launch": "lab.launch", "scripts": ["src/numeric_talker.py"]}
    launched = {"id": "launch", "check": "launch-xml", "with": parameters}
    right, other = (
        judge_files(rubric({**MANIFEST_CHECK, "with": {"name": name}}, launched), facts)[1].criterion.hint
        for name in ("lab1", "basics")
    )
    assert 'pkg="lab1"' in right
    assert 'pkg="basics"' in other


def test_a_script_that_has_to_move_is_told_the_line_that_names_it(tmp_path) -> None:
    where = "DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION}"
    installed = f"\ncatkin_install_python(PROGRAMS src/numeric_talker.py {where})\n"
    facts = facts_of(tmp_path, **{"CMakeLists.txt": CMAKE + installed})
    elsewhere = {**EXECUTABLE, "with": {"path": "scripts/numeric_talker.py"}}
    told = judge_files(rubric(elsewhere), facts)[0].criterion
    line = (CMAKE + installed).split("\n").index(installed.strip()) + 1
    assert told.status is Status.PASS
    assert told.hint.endswith(
        f"write scripts/numeric_talker.py in the catkin_install_python(…) on line {line} of CMakeLists.txt"
    )


@pytest.mark.parametrize(
    ("files", "other"),
    [
        ({"package.xml": "<package>"}, MANIFEST_CHECK),
        ({"CMakeLists.txt": "project(lab1"}, CMAKE_CHECK),
        ({"src/numeric_talker.py": "import rospy\nif True\n"}, EXECUTABLE),
    ],
)
def test_what_another_criterion_says_of_a_file_is_said_once(files, other, tmp_path) -> None:
    criteria = ({"id": "build", "check": "build"}, {**NODE, "requires": []}, other)
    found = judge_files(rubric(*criteria), facts_of(tmp_path, **files))
    assert [one.criterion.id for one in found] == [other["id"]]
