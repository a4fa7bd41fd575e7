"""The steps of `action.yml`, run as GitHub's runner runs them."""

from __future__ import annotations

import shutil

import pytest
import yaml

from tests.integrations.conftest import handed_in
from tests.integrations.reporter import reporter
from tests.integrations.runner import ROOT, SYSTEM_PATH

STATIC = {"lab": "leeds-comp3631-lab1", "static": "true"}
TOO_MUCH, HALF = {"pass_mark": "101%"}, {"pass_mark": "50%", "path": "ws"}
REPORTS = {"report.html", "report.md", "result.json", "junit.xml", "report.sarif", "code-quality.json"}


def test_a_package_without_mistakes_passes(runner):
    handed_in(runner.workspace)
    ran = runner.use(static="true", path="ws/src/my lab")
    assert ran.code == 0, ran.log
    told = {name: ran.outputs[name] for name in ("status", "passed", "points", "max-points")}
    assert told == {"status": "passed", "passed": "true", "points": "20", "max-points": "20"}
    assert [text.split(":")[0] for text in ran.annotations("notice")][:1] == ["Passed"]
    assert ran.annotations("error") == []
    assert ran.summary.startswith("**Passed:** 20 of 20 points that can be judged from the files alone")
    assert {path.name for path in ran.artifact.iterdir()} >= {*REPORTS, "evidence", "console.log"}
    assert "ot settled" not in ran.log + ran.summary
    assert ran.outputs["report"] == f"{ran.artifact}/report.html"
    assert ran.outputs["results"] == str(ran.artifact)
    seen = reporter(ran.outputs["result"])
    assert (seen.points, seen.of, seen.failed) == (20, 20, "")


@pytest.mark.full
def test_an_attempt_too_many_is_not_graded(runner):
    handed_in(runner.workspace)
    runner.more["GITHUB_RUN_NUMBER"] = "2"
    ran = runner.use(static="true", path="ws/src/my lab", attempts="2")
    assert ran.code == 0, ran.log
    assert "attempt 2 of 2: 20 of 20 points" in ran.summary
    runner.more["GITHUB_RUN_NUMBER"] = "3"
    ran = runner.use(static="true", path="ws/src/my lab", attempts="2")
    assert (ran.code, ran.outputs["status"], ran.outputs["passed"]) == (3, "not-graded", "false")
    assert "this is attempt 3, and only 2 attempts can be graded" in ran.summary
    assert "ask your teachers" in ran.log


@pytest.mark.full
def test_a_loss_is_shown_at_its_line_and_the_step_fails(runner):
    package = handed_in(runner.workspace)
    (package / "src" / "numeric_talker.py").chmod(0o644)
    ran = runner.use(**STATIC)
    assert ran.code == 1, ran.log
    assert (ran.outputs["status"], ran.outputs["passed"], ran.outputs["points"]) == (
        "below-pass-mark",
        "false",
        "15",
    )
    errors = [(told.get("file"), told["title"]) for name, told, _ in ran.heard if name == "error"]
    assert errors == [
        (None, "Below the pass mark"),
        ("ws/src/my lab/src/numeric_talker.py", "talker-executable: 0/5 points"),
    ]
    assert "talker-executable" in ran.summary
    assert ran.artifact is not None
    assert "file=&quot;" not in (ran.artifact / "junit.xml").read_text()
    assert 'ws/src/my lab/src/numeric_talker.py"' in (ran.artifact / "code-quality.json").read_text()


@pytest.mark.full
@pytest.mark.parametrize(
    ("mark", "code", "status"),
    [
        ("75%", 0, "passed"),
        ("75.1%", 1, "below-pass-mark"),
        ("101", 2, "wrong-input"),
        ("$(touch pwned)", 2, "wrong-input"),
    ],
)
def test_the_pass_mark(runner, mark, code, status):
    package = handed_in(runner.workspace)
    (package / "src" / "numeric_talker.py").chmod(0o644)
    ran = runner.use(**STATIC, pass_mark=mark)
    assert (ran.code, ran.outputs["status"]) == (code, status), ran.log
    assert not (runner.workspace / "pwned").exists()
    if code == 2:
        assert ran.annotations("error")[0].startswith("Wrong input: pass-mark: ")
        assert ran.outputs["points"] == ""
        assert "pass-mark" in ran.summary


@pytest.mark.full
def test_a_step_that_never_fails_still_says_how_it_ended(runner):
    package = handed_in(runner.workspace)
    (package / "package.xml").unlink()
    ran = runner.use(**STATIC, fail_on="never")
    assert ran.code == 0, ran.log
    assert ran.outputs["passed"] == "false"


@pytest.mark.full
@pytest.mark.parametrize(
    ("fail_on", "code"), [("", 4), ("inconclusive", 4), ("below-pass-mark,not-graded", 0)]
)
def test_a_machine_without_ros_takes_no_marks(runner, fail_on, code):
    handed_in(runner.workspace)
    ran = runner.use(lab="leeds-comp3631-lab1", container="never", fail_on=fail_on)
    assert (ran.code, ran.outputs["status"]) == (code, "inconclusive"), ran.log
    said = ran.annotations("error" if code else "warning")
    assert said[0].startswith(
        "Not decided yet: 20 of 100 points; 80 more are not decided yet, and this costs no marks"
    )
    assert "no ROS 1" in said[0]
    assert reporter(ran.outputs["result"]).points is None


@pytest.mark.full
def test_no_package_is_the_students_fault_whatever_a_machine_may_do(runner):
    (runner.workspace / "README.md").write_text("# my lab\n")
    ran = runner.use(**STATIC, fail_on="below-pass-mark")
    assert (ran.code, ran.outputs["status"], ran.outputs["points"]) == (3, "not-graded", ""), ran.log
    assert len(ran.annotations("error")) == 1
    assert "this costs no marks" not in ran.annotations("error")[0]
    assert ran.artifact is not None
    assert (reporter(ran.outputs["result"]).points, reporter(ran.outputs["result"]).of) == (0, 100)


@pytest.mark.full
@pytest.mark.parametrize(
    "inputs",
    [
        {"lab": "leeds-comp3631-lab2"},
        {"lab": "rubrics/none.yaml"},
        {"lab": "--help"},
        {"path": "no/such folder"},
        {"static": "maybe"},
        {"sandbox": "off"},
        {"fail_on": "tuesdays"},
        {"container": "perhaps", "static": "false"},
    ],
)
def test_wrong_inputs_are_named_in_an_annotation(runner, inputs):
    handed_in(runner.workspace)
    ran = runner.use(**{**STATIC, **inputs})
    assert (ran.code, ran.outputs["status"]) == (2, "wrong-input"), ran.log
    assert len(ran.annotations("error")) == 1
    assert ran.outputs["passed"] == "false"


@pytest.mark.full
def test_packages_of_two_labs_and_no_word_which(runner):
    handed_in(runner.workspace, "a")
    other = next((ROOT / "reference_solutions" / "sheffield-com2009-week1").iterdir())
    shutil.copytree(other, runner.workspace / other.name)
    ran = runner.use(static="true")
    assert ran.code == 2
    assert "GRADER_LAB" in ran.annotations("error")[0]


HOSTILE = (
    "\n::error::owned\n::set-output name=points::100\n::add-mask::a\r::stop-commands::x"
    "\n##[error]owned\n%0A::error::x"
)


def test_nothing_that_a_student_wrote_is_obeyed(runner):
    package = handed_in(runner.workspace, "ws/::error::pwned,file=x")
    talker = package / "src" / "numeric_talker.py"
    talker.write_text(f'"""{HOSTILE}"""\nimport ( # {HOSTILE}')
    manifest = package / "package.xml"
    manifest.write_text(manifest.read_text().replace("rospy", f"rospy{HOSTILE}\u2028::error::u"))
    (package / "src" / "::set-output name=passed::true.py").write_text(HOSTILE)
    (package / "CMakeLists.txt").write_text(f"project(lab1)\nfind_package({HOSTILE})\n")
    ran = runner.use(**STATIC)
    assert ran.code in {1, 3}, ran.log
    assert ran.outputs["passed"] == "false"
    assert ran.outputs["points"] in {"", "0", "5", "10"}
    ours = (
        "Below the pass mark",
        "manifest:",
        "cmake:",
        "talker-executable:",
        "listener-executable:",
        "Not graded",
    )
    assert all(told["title"].startswith(ours) for name, told, _ in ran.heard if name == "error")
    assert {name for name, _, _ in ran.heard} <= {"error", "warning", "notice", "group", "endgroup"}
    assert not [row for row in reporter(ran.outputs["result"]).console.splitlines() if row.startswith("::")]


@pytest.mark.full
def test_more_mistakes_than_github_shows(runner):
    rubric = yaml.safe_load((ROOT / "rubrics" / "leeds-comp3631-lab1.yaml").read_text(encoding="utf-8"))
    first = next(c for c in rubric["criteria"] if c["id"] == "talker-executable")
    rubric["criteria"] = [first | {"id": f"c{i}", "points": 4, "requires": []} for i in range(25)]
    rubric |= {"scenarios": {}}
    (runner.workspace / "course rubric.yaml").write_text(yaml.safe_dump(rubric))
    (handed_in(runner.workspace) / "src" / "numeric_talker.py").chmod(0o644)
    ran = runner.use(lab="course rubric.yaml", static="true", path="ws")
    assert ran.code == 1, ran.log
    assert len(ran.annotations("error")) == 10
    assert "and 16 more of these" in ran.log


@pytest.mark.full
def test_hidden_criteria_stay_hidden(runner):
    text = (ROOT / "rubrics" / "leeds-comp3631-lab1.yaml").read_text(encoding="utf-8")
    begin = text.index("id: talker-executable")
    text = text[:begin] + text[begin:].replace("points:", "visibility: hidden\n    points:", 1)
    (runner.workspace / "course.yaml").write_text(text)
    package = handed_in(runner.workspace)
    (package / "src" / "numeric_talker.py").chmod(0o644)
    ran = runner.use(static="true", lab="course.yaml", path="ws")
    assert (ran.code, ran.outputs["points"], ran.outputs["max-points"]) == (0, "15", "15"), ran.log
    kept = [
        path.read_bytes()
        for path in ran.artifact.rglob("*")
        if path.is_file() and "evidence" not in path.parts
    ]
    told = (ran.log, ran.summary, reporter(ran.outputs["result"]).console)
    assert not [text for text in told if "talker-executable" in text]
    assert not [data for data in kept if b"talker-executable" in data]


@pytest.mark.full
def test_a_second_use_in_a_job_installs_nothing_and_has_a_folder_of_its_own(runner):
    handed_in(runner.workspace)
    first, second = runner.use(**STATIC), runner.use(**STATIC)
    assert first.artifact != second.artifact
    assert "installing" not in first.log + second.log


@pytest.mark.full
def test_no_artifact_where_none_is_wanted(runner):
    handed_in(runner.workspace)
    assert runner.use(**STATIC, artifact="").artifact is None


def test_an_installation_that_fails_is_nobodys_verdict(runner, tmp_path):
    shutil.rmtree(runner.temp / "ros-lab-grader")
    python = tmp_path / "bin" / "python3"
    python.parent.mkdir()
    python.write_text(
        '#!/bin/sh\ncase "$*" in *venv*--clear*) mkdir -p "$4/bin"; ln -s /bin/false "$4/bin/python";; esac\n'
    )
    python.chmod(0o755)
    runner.path = f"{python.parent}:{SYSTEM_PATH}"
    handed_in(runner.workspace)
    ran = runner.use(**STATIC)
    assert (ran.code, ran.outputs["status"], ran.outputs["passed"]) == (3, "not-graded", "false"), ran.log
    assert ran.annotations("error") == ["Not graded: the grader could not be installed: see the log"]


@pytest.mark.full
@pytest.mark.ros
def test_nodes_are_run_and_every_report_is_kept(runner):
    package = handed_in(runner.workspace)
    talker = package / "src" / "numeric_talker.py"
    talker.write_text(talker.read_text().replace("Rate(10)", "Rate(5)"))
    del runner.more["GRADER_ROS_SETUP"]
    ran = runner.use(**TOO_MUCH)
    assert ran.code == 2
    ran = runner.use(**HALF)
    assert ran.code == 0, ran.log
    assert 50 <= float(ran.outputs["points"]) < 100
    assert "numeric-rate: 0/5 points" in "".join(told.get("title", "") for _, told, _ in ran.heard)
    assert (ran.artifact / "evidence" / "talker.mcap").is_file()
    assert "sandbox: " in ran.log


FORGED = """schema: grader.rubric/1
id: leeds-comp3631-lab1
title: Lab 1
version: "1"
package: lab1
scenarios: {}
criteria:
  - {id: there, title: There is a package, points: 100, check: manifest, with: {name: lab1}}
"""


@pytest.mark.full
def test_a_rubric_of_the_students_own_is_no_plain_pass_and_a_pinned_one_is_the_courses(runner):
    package = handed_in(runner.workspace)
    (package / "src" / "numeric_talker.py").unlink()
    (runner.workspace / "lab.yaml").write_text(FORGED)
    ran = runner.use(static="true", lab="lab.yaml")
    assert (ran.code, ran.outputs["status"], ran.outputs["rubric-origin"]) == (0, "passed", "submission"), (
        ran.log
    )
    assert ran.annotations("notice") == []
    assert ran.annotations("warning")[0].startswith("Passed, by a rubric from the student's repository: ")
    assert ran.summary.startswith("**Passed, by a rubric from the student's repository:**")
    assert "(from the student's repository)" in ran.log

    pinned = "c" * 64
    ran = runner.use(static="true", lab=f"lab.yaml#sha256:{pinned}")
    assert (ran.code, ran.outputs["status"]) == (2, "wrong-input"), ran.log
    assert f"not sha256:{pinned}" in ran.annotations("error")[0]
