"""Recordings handed in: graded, kept, and judged again to the same criteria; no ROS is used."""

from __future__ import annotations

import json
import shutil
import zipfile
from pathlib import Path
from typing import Any

import pytest

from grader.cli.main import run as grader
from tests.evidence.bags import BZ2, CHATTER, COUNT, LZ4, Topic, mcap_bytes, write_bag

ROOT = Path(__file__).resolve().parent.parent
LAB = str(ROOT / "rubrics" / "leeds-comp3631-lab1.yaml")
CORRECT = ROOT / "tests" / "data" / "recordings" / "correct"
IN_MESSAGES = {
    "chatter", "chatter-rate", "numeric-type", "numeric-rate", "counter-start", "counter-step", "counter-wrap"
}  # fmt: skip
RUBRIC = """\
schema: grader.rubric/1
id: bags
title: A recording
version: "1"
package: none
scenarios:
  mine: {title: The student's recording, recording: "*.bag"}
criteria:
  - id: type
    title: Text on /chatter
    points: 40
    check: topic-type
    with: {topic: /chatter, type: std_msgs/String}
    scenario: mine
  - id: rate
    title: 10 Hz
    points: 60
    check: rate
    with: {topic: /chatter, rate_hz: 10}
    scenario: mine
    requires: [type]
"""


@pytest.fixture(autouse=True)
def _no_ros(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GRADER_ROS_SETUP", "none")


@pytest.fixture
def rubric(tmp_path: Path) -> Path:
    path = tmp_path / "bags.yaml"
    path.write_text(RUBRIC)
    return path


def graded(tmp_path: Path, source: Path, rubric: Path | str) -> tuple[int, dict[str, Any], Path]:
    """Exit code, result and folder; what is kept as evidence gives the same criteria again."""
    out = tmp_path / "out"
    shutil.rmtree(out, ignore_errors=True)
    code = grader(["grade", str(source), "--rubric", str(rubric), "--out", str(out)])
    (folder,) = out.iterdir()
    result = json.loads((folder / "result.json").read_text())
    assert (
        grader(["judge", str(folder / "evidence"), "--rubric", str(rubric), "--out", str(tmp_path / "j")])
        == code
    )
    assert json.loads((tmp_path / "j").read_text()) == result["criteria"]
    return code, result, folder


def statuses(result: dict[str, Any]) -> dict[str, str]:
    return {c["id"]: c["status"] for c in result["criteria"]}


def message(result: dict[str, Any], name: str) -> str:
    return next(c["message"] for c in result["criteria"] if c["id"] == name)


@pytest.mark.parametrize("compression", [None, BZ2, LZ4])
def test_a_bag_is_judged_by_what_it_holds(tmp_path, compression):
    bag = write_bag(tmp_path / "Übung 1.bag", CHATTER, COUNT, compression=compression)
    code, result, folder = graded(tmp_path, bag, LAB)
    assert code == 4
    assert {name for name, status in statuses(result).items() if status == "pass"} == IN_MESSAGES
    assert set(statuses(result).values()) == {"pass", "inconclusive"}
    assert (result["submission"]["package"], result["status"]) == ("", "inconclusive")
    assert "holds messages, but nothing about the processes" in message(result, "talker-node")
    assert "without the package's files" in message(result, "manifest")
    assert len(list((folder / "evidence").iterdir())) == 1
    assert ", a recording." in (folder / "report.md").read_text()


def test_an_mcap_of_ros_1_is_judged_alike(tmp_path):
    (tmp_path / "lab.mcap").write_bytes(mcap_bytes(CHATTER, COUNT, metadata=False))
    _, result, folder = graded(tmp_path, tmp_path / "lab.mcap", LAB)
    assert {name for name, status in statuses(result).items() if status == "pass"} == IN_MESSAGES
    assert (folder / "evidence" / "lab.mcap").read_bytes() == (tmp_path / "lab.mcap").read_bytes()


def test_faults_in_a_bag_cost_what_they_cost_in_a_run(tmp_path):
    slow = CHATTER._replace(rate_hz=5)
    early = COUNT._replace(values=[n % 127 if n < 127 else n % 100 for n in range(300)])
    bag = write_bag(tmp_path / "lab.bag", slow, early._replace(type="std_msgs/Int16"))
    _, result, _ = graded(tmp_path, bag, LAB)
    failed = {name for name, status in statuses(result).items() if status == "fail"}
    assert failed == {"chatter-rate", "numeric-type", "counter-wrap"}


def test_what_a_recording_cannot_tell_costs_nothing(tmp_path):
    bag = write_bag(tmp_path / "lab.bag", COUNT._replace(values=[5, 6, 7]))
    _, result, _ = graded(tmp_path, bag, LAB)
    assert set(statuses(result).values()) == {"pass", "inconclusive"}
    assert (
        message(result, "counter-start")
        == "lab.bag may have begun after the first message on /numeric_chatter"
    )
    assert message(result, "chatter").startswith("/chatter is not in lab.bag")


def test_a_misspelt_topic_is_pointed_out(tmp_path, rubric):
    bag = write_bag(tmp_path / "lab.bag", CHATTER._replace(topic="/chater"))
    code, result, _ = graded(tmp_path, bag, rubric)
    assert (code, statuses(result)) == (1, {"type": "fail", "rate": "blocked"})
    assert message(result, "type") == "/chatter is not in lab.bag; /chater is"


def test_the_name_of_the_scenario_package_is_no_package(tmp_path, rubric):
    code, result, _ = graded(tmp_path, write_bag(tmp_path / "package.bag", CHATTER), rubric)
    assert (code, result["points"]) == (0, 100)


def test_judge_takes_bags_by_the_names_of_scenarios(tmp_path, capsys):
    talker = write_bag(tmp_path / "talker.bag", CHATTER, COUNT)
    wraps = write_bag(tmp_path / "wraps.bag", COUNT)
    assert grader(["judge", str(talker), str(wraps), "--rubric", LAB]) == 4
    found = {c["id"]: c for c in json.loads(capsys.readouterr().out)}
    assert {name for name, c in found.items() if c["status"] == "pass"} == IN_MESSAGES
    assert found["counter-wrap"]["citations"][0]["evidence"] == "wraps.bag"


def test_the_graders_own_runs_come_first(tmp_path, capsys):
    bag = write_bag(tmp_path / "other.bag", CHATTER._replace(rate_hz=3))
    assert grader(["judge", str(CORRECT), str(bag), "--rubric", LAB]) == 0
    assert all(c["status"] == "pass" for c in json.loads(capsys.readouterr().out))


def test_check_takes_a_bag(tmp_path, rubric, capsys):
    bag = write_bag(tmp_path / "lab.bag", CHATTER)
    assert grader(["check", str(bag), "--rubric", str(rubric)]) == 0
    assert "100 of 100 points" in capsys.readouterr().out


@pytest.mark.parametrize("command", ["grade", "check", "judge"])
@pytest.mark.parametrize(
    "case",
    [
        (b"", "the file is empty"),
        (b"#ROSBAG V2.0\nhello", "damaged or cut short"),
        (mcap_bytes(COUNT)[:-20], "cut short"),
        (b"SQLite format 3\0", "a bag of ROS 2"),
        (mcap_bytes(COUNT, profile="ros2", encoding="cdr", schema="ros2idl"), "no message definition"),
        (mcap_bytes(Topic("/n", "std_msgs/Int8", [])), "holds no messages"),
    ],
)
def test_a_recording_that_cannot_be_read_is_one_line(tmp_path, rubric, capsys, command, case):
    content, reason = case
    (tmp_path / "lab.bag").write_bytes(content)
    more = ["--out", str(tmp_path / "out")] if command == "grade" else []
    assert grader([command, str(tmp_path / "lab.bag"), "--rubric", str(rubric), *more]) == 3
    errors = [line for line in capsys.readouterr().err.splitlines() if line.startswith("grader: error:")]
    assert len(errors) == 1
    assert reason in errors[0]
    results = list((tmp_path / "out").rglob("result.json"))
    assert len(results) == (command == "grade")
    assert all(json.loads(path.read_text())["status"] == "error" for path in results)
    assert not list((tmp_path / "out").rglob("*.bag"))


def test_a_recording_that_is_too_large_is_refused_unread(tmp_path, rubric, capsys):
    with (tmp_path / "lab.bag").open("wb") as file:
        file.truncate((1 << 30) + 1)
    for command, most in (("check", "96 MiB"), ("judge", "1024 MiB")):
        assert grader([command, str(tmp_path / "lab.bag"), "--rubric", str(rubric)]) == 3
        assert f"larger than {most}" in capsys.readouterr().err


def test_evidence_of_the_grader_is_no_submission(tmp_path, rubric, capsys):
    argv = ["grade", str(CORRECT / "talker.mcap"), "--rubric", str(rubric), "--out", str(tmp_path / "out")]
    assert grader(argv) == 3
    assert "the grader's own evidence" in capsys.readouterr().err


def test_record_has_nothing_to_do_with_a_bag(tmp_path, rubric, capsys):
    bag = write_bag(tmp_path / "lab.bag", CHATTER)
    assert grader(["record", str(bag), "--rubric", str(rubric), "--out", str(tmp_path / "out")]) == 2
    assert "nothing to run" in capsys.readouterr().err


def test_a_recording_is_found_in_what_is_handed_in(tmp_path, rubric):
    folder = tmp_path / "ada"
    (folder / "lab 3" / ".hidden").mkdir(parents=True)
    bag = write_bag(folder / "lab 3" / "Mein.BAG", CHATTER)
    shutil.copy(bag, folder / "lab 3" / ".hidden" / "other.bag")
    shutil.copy(bag, folder / "a copy.bag")
    code, result, kept = graded(tmp_path, folder, rubric)
    assert (code, result["points"], result["submission"]["package"]) == (0, 100, "")
    assert [p.name for p in (kept / "evidence").iterdir()] == ["mine.bag"]


def test_a_recording_is_found_in_an_archive(tmp_path, rubric):
    bag = write_bag(tmp_path / "lab.bag", CHATTER)
    with zipfile.ZipFile(tmp_path / "ada.zip", "w") as archive:
        archive.write(bag, "ada/lab.bag")
    code, result, _ = graded(tmp_path, tmp_path / "ada.zip", rubric)
    assert (code, result["submission"]["id"]) == (0, "ada")


def test_no_recording_is_a_fail_and_an_unreadable_one_is_open(tmp_path, rubric):
    folder = tmp_path / "ada"
    folder.mkdir()
    (folder / "README").write_text("")
    code, result, _ = graded(tmp_path, folder, rubric)
    assert (code, statuses(result)) == (1, {"type": "fail", "rate": "blocked"})
    assert message(result, "type") == "no recording *.bag is in the submission"
    (folder / "lab.bag").write_bytes(b"#ROSBAG V2.0\n")
    code, result, _ = graded(tmp_path, folder, rubric)
    assert (code, set(statuses(result).values())) == (4, {"inconclusive"})
    assert message(result, "type") == "lab.bag: damaged or cut short"
    (folder / "lab.bag").unlink()
    for name, rate_hz in (("a", 10), ("b", 5)):
        write_bag(folder / f"{name}.bag", CHATTER._replace(rate_hz=rate_hz))
    code, result, _ = graded(tmp_path, folder, rubric)
    assert (code, message(result, "type")) == (4, "2 recordings fit *.bag: a.bag, b.bag")


def test_a_package_and_a_recording_together(tmp_path):
    text = RUBRIC.replace("package: none", "package: lab1").replace("points: 40", "points: 30") + (
        "  - {id: manifest, title: The manifest, points: 10, check: manifest, with: {name: lab1}}\n"
    )
    (tmp_path / "both.yaml").write_text(text)
    folder = tmp_path / "ada"
    shutil.copytree(ROOT / "reference_solutions" / "leeds-comp3631-lab1", folder)
    write_bag(folder / "lab.bag", CHATTER)
    code, result, kept = graded(tmp_path, folder, tmp_path / "both.yaml")
    assert (code, set(statuses(result).values())) == (0, {"pass"})
    assert {p.name for p in (kept / "evidence").iterdir()} == {"package.mcap", "mine.bag"}
    assert result["submission"]["package"] == "lab1"


GENERAL = """\
  - {id: words, title: w, points: 20, check: message, scenario: mine,
     with: {topic: /hello, template: "hello world {seconds}"}}
  - {id: bounds, title: b, points: 20, check: field-bounds, scenario: mine,
     with: {topic: /cmd_vel, field: linear.x, min: 0, max: 1}}
  - {id: way, title: p, points: 30, check: path, scenario: mine,
     with: {topic: /cmd_vel, points: [[2, 0]], tolerance_m: 0.2}}
  - {id: log, title: g, points: 10, check: logs, scenario: mine, with: {text: ready}}
  - {id: latched, title: l, points: 20, check: latched, scenario: mine, with: {topic: /goal}}
"""
DRIVE = [{"linear": {"x": 1.0}}] * 20 + [{}] * 5
HELLO = Topic("/hello", "std_msgs/String", [f"hello world {100 + n / 10}" for n in range(60)])
LOG = Topic("/rosout", "rosgraph_msgs/Log", [{"level": 2, "name": "/talker", "msg": "ready"}])
GOAL = Topic("/goal", "std_msgs/String", ["there"], latching=True)


@pytest.fixture
def general(tmp_path: Path) -> Path:
    (tmp_path / "general.yaml").write_text(
        RUBRIC.split("criteria:\n", maxsplit=1)[0] + "criteria:\n" + GENERAL
    )
    return tmp_path / "general.yaml"


@pytest.mark.parametrize("callerid", ["/talker", None])
def test_the_general_checks_judge_a_bag(tmp_path, general, callerid):
    topics = [HELLO, Topic("/cmd_vel", "geometry_msgs/Twist", DRIVE), LOG, GOAL._replace(callerid="/goal")]
    bag = write_bag(tmp_path / "lab.bag", *(t._replace(callerid=callerid) for t in topics[:3]), topics[3])
    code, result, _ = graded(tmp_path, bag, general)
    assert (code, result["points"]) == (0, 100)


def test_the_general_checks_find_faults_in_a_bag(tmp_path, general):
    fast = Topic("/cmd_vel", "geometry_msgs/Twist", [{"linear": {"x": 3.0}}] * 20 + [{}] * 5)
    still = HELLO._replace(values=["hello world 100"] * 60)
    warn = LOG._replace(values=[{"level": 4, "name": "/talker", "msg": "ready"}])
    bag = write_bag(tmp_path / "lab.bag", still, fast, warn, GOAL._replace(latching=False))
    _, result, _ = graded(tmp_path, bag, general)
    assert statuses(result) == {
        "words": "fail", "bounds": "fail", "way": "fail", "log": "fail", "latched": "inconclusive"
    }  # fmt: skip
    assert message(result, "log") == "/talker logs 'ready' at level WARN, not INFO"
