"""A course of several labs: late days over all of them, attempts, how far each lab is, and one gradebook."""

from __future__ import annotations

import csv
import json
import shutil
from datetime import datetime, timedelta, timezone
from pathlib import Path

import pytest

from grader.classes.course import rounds
from grader.cli.main import run
from grader.errors import RubricError, UsageError
from grader.judging.settle import lateness
from grader.model.batch import Entry, Roster
from grader.model.result import HandedIn
from grader.rubric.course import load_course
from grader.rubric.load import load_rubric
from grader.rubric.model import Late
from tests.classes.batch.a_class import CORRECT, RUBRIC, WRONG_NAME, lines_of
from tests.classes.course.samples import write_roster

pytestmark = pytest.mark.usefixtures("without_processes")

COURSE = """title: Robotics 1
late: {lost: 10}
late_days: {budget: 3, per_lab: 2}
feedback: folder
labs:
  lab1:
    rubric: rubric.yaml
    roster: lab1.csv
    deadline: 2026-10-30T12:00:00Z
  lab2:
    rubric: rubric.yaml
    roster: lab2.csv
    deadline: 2026-11-06T12:00:00Z
    weight: 3
"""
DEADLINE = datetime(2026, 10, 30, 12, tzinfo=timezone.utc)


@pytest.fixture
def course(tmp_path: Path, monkeypatch) -> Path:
    """Two labs: ada is late in both, cem in neither; bob handed in the first one twice."""
    shutil.copytree(CORRECT, tmp_path / "right")
    shutil.copytree(WRONG_NAME, tmp_path / "wrong")
    (tmp_path / "rubric.yaml").write_text(RUBRIC.read_text())
    (tmp_path / "course.yaml").write_text(COURSE)
    write_roster(tmp_path / "lab1.csv", "ada,right,2026-11-01T11:00:00Z", "cem,right,2026-10-30T12:00:00Z")
    write_roster(tmp_path / "lab2.csv", "ada,right,2026-11-08T11:00:00Z", "cem,wrong,2026-11-06T12:00:00Z")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def grade(lab: str, *options: str) -> int:
    return run(["course", "grade", "course.yaml", lab, "--sandbox", "none", *options])


def results(lab: str) -> dict[str, dict]:
    return {line["submission"]["id"]: line for line in lines_of(Path("results", lab))}


def gradebook(*options: str) -> dict[str, dict[str, str]]:
    assert run(["course", "gradebook", "course.yaml", "--form", "csv", *options]) == 0
    with Path("gradebook.csv").open(encoding="utf-8-sig", newline="") as file:
        return {row["id"]: row for row in csv.DictReader(file)}


def status(capsys) -> dict[str, dict]:
    capsys.readouterr()
    assert run(["course", "status", "course.yaml", "--json"]) == 0
    return {lab["name"]: lab for lab in json.loads(capsys.readouterr().out)}


# ---- late days


def test_late_days_are_used_lab_after_lab(course: Path, capsys) -> None:
    assert grade("lab1") == 0
    grade("lab2")
    first, second = results("lab1"), results("lab2")
    assert (first["ada"]["points"], first["ada"]["late"]["late_days_used"]) == (100, 2)
    assert "late_days_used" not in first["cem"]["late"]
    assert (second["ada"]["points"], second["ada"]["late"]["late_days_used"]) == (90, 1), (
        "one of three is left"
    )
    report = (course / "results/lab2/ada/report.md").read_text()
    assert "1 late day used, then 1 day late" in report
    assert "deadline 2026-11-07 12:00" in report


@pytest.mark.full
def test_an_earlier_lab_that_changes_frees_late_days(course: Path, capsys) -> None:
    grade("lab1")
    grade("lab2")
    write_roster(course / "lab1.csv", "ada,right,2026-10-30T11:00:00Z", "cem,right,2026-10-30T12:00:00Z")
    grade("lab1")
    found = status(capsys)
    assert (found["lab1"]["to_settle"], found["lab2"]["to_settle"]) == (0, 1)
    assert found["lab2"]["to_do"] == "grader course grade course.yaml lab2"
    grade("lab2")
    assert results("lab2")["ada"]["points"] == 100
    assert status(capsys)["lab2"]["to_settle"] == 0


@pytest.mark.parametrize(
    ("hours", "left", "used", "points"),
    [
        (0, 2, 0, 100),
        (0.25, 2, 0, 100),  # the grace comes first
        (1, 2, 1, 100),
        (24, 2, 1, 100),
        (25, 2, 2, 100),
        (49, 2, 2, 90),
        (49, 0, 0, 70),
    ],
)
def test_a_begun_day_is_a_day(hours: float, left: int, used: int, points: float) -> None:
    lab = load_rubric(str(RUBRIC)).rubric.model_copy(
        update={"deadline": DEADLINE, "late": Late(lost=10, grace_minutes=30)}
    )
    given = HandedIn(at=DEADLINE + timedelta(hours=hours), deadline=DEADLINE, late_days=left)
    found = lateness(100, lab, given)
    assert found is not None
    assert (found.late_days_used, found.points) == (used, points)


# ---- attempts


def attempts(course: Path, how: str, *rows: str) -> dict[str, dict]:
    text = COURSE.replace("    deadline: 2026-10-30", f"    attempts: {how}\n    deadline: 2026-10-30")
    (course / "course.yaml").write_text(text)
    write_roster(course / "lab1.csv", *rows)
    grade("lab1")
    return results("lab1")


@pytest.mark.parametrize(("how", "chosen"), [("best", 2), pytest.param("last", 3, marks=pytest.mark.full)])
def test_which_attempt_counts(course: Path, how: str, chosen: int) -> None:
    rows = (
        "ada,wrong,2026-10-28T12:00:00Z",
        "ada,right,2026-10-29T12:00:00Z",
        "ada,wrong,2026-10-30T12:00:00Z",
    )
    found = attempts(course, how, *rows, "cem,right,2026-10-30T12:00:00Z")
    assert found["ada"]["attempts"]["chosen"] == chosen
    first, second, third = found["ada"]["attempts"]["points"]
    assert first == third < second == 100
    assert found["ada"]["points"] == (100 if how == "best" else third)
    report = (course / "results/lab1/ada/report.md").read_text()
    assert f"Attempt {chosen} of 3 counts" in report
    assert "Attempt" not in (course / "results/lab1/cem/report.md").read_text()


def test_by_criterion_each_takes_its_best_attempt(course: Path) -> None:
    shutil.copytree(course / "right", course / "other")
    manifest = next((course / "other").rglob("package.xml"))
    lines = manifest.read_text().splitlines(keepends=True)
    manifest.write_text("".join(line for line in lines if ">rospy</" not in line))
    rows = ("ada,wrong,2026-10-28T12:00:00Z", "ada,other,2026-10-29T12:00:00Z")
    found = attempts(course, "by-criterion", *rows)["ada"]
    each = [
        {c["id"]: c["points"] for c in json.loads(path.read_bytes())["criteria"]}
        for path in sorted((course / "results/lab1/.attempts").glob("*/ada/result.json"))
    ]
    assert len(each) == 2
    assert {c["id"]: c["points"] for c in found["criteria"]} == {
        name: max(one[name] for one in each) for name in each[0]
    }
    assert found["points"] == sum(c["points"] for c in found["criteria"])
    assert found["points"] > max(sum(one.values()) for one in each)


@pytest.mark.parametrize(("day", "chosen"), [("2026-11-02", 2), ("2026-11-12", 1)])
def test_what_a_late_attempt_earned_costs_what_it_was_late(course: Path, day: str, chosen: int) -> None:
    rows = ("ada,wrong,2026-10-29T12:00:00Z", f"ada,right,{day}T12:00:00Z")
    found = attempts(course, "by-criterion", *rows)["ada"]
    first, second = found["attempts"]["points"]
    assert (second > first) == (chosen == 2)
    assert found["points"] == max(first, second)
    assert found["attempts"]["chosen"] == chosen
    report = (course / "results/lab1/ada/report.md").read_text()
    assert ("best attempt up to attempt 1 counts" in report) == (chosen == 1)


@pytest.mark.full
def test_a_decision_on_attempts_says_what_the_check_said_after_a_kill(course: Path) -> None:
    """What the check said when a person decided is in the result that is replaced: it is replaced as a whole."""
    rows = ["ada,wrong,2026-10-28T12:00:00Z"]
    attempts(course, "best", *rows)
    name = next(c["id"] for c in results("lab1")["ada"]["criteria"] if c["status"] == "fail")
    (course / "results/lab1/overrides.yaml").write_text(f"ada: {{{name}: {{points: 1}}}}\n")
    before = attempts(course, "best", *rows)["ada"]["overrides"][0]
    evidence = course / "results/lab1/ada/evidence"
    found = attempts(course, "best", *rows, "ada,right,2026-10-29T12:00:00Z")["ada"]["overrides"][0]
    assert (found["was"], found["changed"]) == (before["was"], True)
    assert found["automatic"] != before["automatic"]
    chosen = course / "results/lab1/.attempts/2/ada/evidence"
    assert {p.name: p.read_bytes() for p in evidence.iterdir()} == {
        p.name: p.read_bytes() for p in chosen.iterdir()
    }


@pytest.mark.full
def test_decisions_stay_when_an_attempt_comes(course: Path) -> None:
    criterion = load_rubric(str(RUBRIC)).rubric.criteria[0]
    (course / "results" / "lab1").mkdir(parents=True)
    (course / "results/lab1/overrides.yaml").write_text(
        f"ada: {{{criterion.id}: {{points: 1, author: kim}}}}\n"
    )
    rows = ["ada,wrong,2026-10-28T12:00:00Z"]
    attempts(course, "best", *rows)
    found = attempts(course, "best", *rows, "ada,right,2026-10-29T12:00:00Z")["ada"]
    assert found["attempts"]["chosen"] == 2
    assert found["points"] == 100 - criterion.points + 1
    assert found["overrides"][0]["author"] == "kim"
    assert not found["overrides"][0]["changed"] or found["overrides"][0]["was"]


@pytest.mark.full
def test_without_attempts_a_second_row_is_a_fault(course: Path) -> None:
    write_roster(course / "lab1.csv", "ada,right,", "ada,right,")
    grade("lab1")
    faults = json.loads((course / "results/lab1/run.json").read_bytes())["faults"]
    assert "is there already" in faults[0]["text"]


# ---- the gradebook, and how far the labs are


def test_the_gradebook_weighs_the_labs(course: Path, capsys) -> None:
    grade("lab1")
    book = gradebook()
    assert (book["ada"]["points"], book["ada"]["lab1"], book["ada"]["late days"]) == ("100", "100", "2")
    assert "lab2" not in book["ada"]
    grade("lab2")
    low = results("lab2")["cem"]["points"]
    book = gradebook()
    assert float(book["cem"]["points"]) == pytest.approx((100 + 3 * low) / 4, abs=0.01)
    assert float(book["ada"]["points"]) == pytest.approx((100 + 3 * 90) / 4, abs=0.01)
    assert "lab1: these are drafts" in capsys.readouterr().err


@pytest.mark.full
def test_the_gradebook_has_all_who_are_in_the_course(course: Path) -> None:
    text = COURSE.replace("late: {", "roster: students.csv\nlate: {", 1)
    (course / "course.yaml").write_text(text)
    (course / "students.csv").write_text("id,name,group\ncem,Cem C,two\nfay,Fay F,two\n")
    grade("lab1")
    book = gradebook()
    assert list(book) == ["cem", "fay"]
    assert (book["fay"]["name"], book["fay"]["status"], book["fay"]["lab1"]) == ("Fay F", "inconclusive", "")
    assert (book["fay"]["error"], book["fay"]["points"]) == ("open: lab1", "")


@pytest.mark.full
@pytest.mark.parametrize("form", ["xlsx", "canvas", "moodle", "blackboard", "jsonl"])
def test_every_form_of_it_is_written(course: Path, form: str, capsys) -> None:
    grade("lab1")
    capsys.readouterr()
    assert run(["course", "gradebook", "course.yaml", "--form", form]) == 0
    assert Path(capsys.readouterr().out.strip()).stat().st_size > 0


def test_status_says_what_to_do_next(course: Path, capsys) -> None:
    assert status(capsys)["lab1"]["to_do"] == "grader course grade course.yaml lab1"
    grade("lab1")
    found = status(capsys)["lab1"]
    assert (found["submissions"], found["graded"], found["published"]) == (2, 2, 0)
    assert found["to_do"] == "grader course publish course.yaml lab1"
    assert run(["course", "publish", "course.yaml", "lab1"]) == 0
    found = status(capsys)["lab1"]
    assert (found["published"], found["sent"], found["to_do"]) == (2, 2, "")
    assert (course / "results/lab1/feedback/ada/report.html").is_file()
    assert run(["course", "status", "course.yaml"]) == 0
    table = capsys.readouterr().out
    assert "2 of 2" in table
    assert "lab2: grader course grade course.yaml lab2" in table
    assert "2026-10-30 12:00 UTC" in table
    with (course / "rubric.yaml").open("a") as file:
        file.write("# The same, in other words.\n")
    assert status(capsys)["lab1"]["to_do"] == "grader regrade results/lab1 (its rubric has changed since)"
    (course / "course.yaml").write_text(COURSE.replace("feedback: folder\n", ""))
    assert status(capsys)["lab1"]["sent"] == 2


@pytest.mark.full
def test_published_marks_stay_in_the_gradebook(course: Path) -> None:
    grade("lab1")
    run(["course", "publish", "course.yaml", "lab1"])
    write_roster(course / "lab1.csv", "ada,wrong,2026-10-30T11:00:00Z", "cem,right,2026-10-30T12:00:00Z")
    grade("lab1")
    assert results("lab1")["ada"]["points"] < 100
    assert gradebook()["ada"]["lab1"] == "100"
    assert float(gradebook("--drafts")["ada"]["lab1"]) < 100


# ---- the file


def test_a_lab_of_a_course_is_a_rubric(course: Path) -> None:
    plain, found = load_rubric("rubric.yaml"), load_rubric("course.yaml#lab1")
    assert found.digest == plain.digest
    assert (found.rubric.deadline, found.rubric.late) == (DEADLINE, Late(lost=10))
    with pytest.raises(UsageError, match='no lab "lab3"'):
        load_rubric("course.yaml#lab3")


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("title: Robotics 1\n", "", "title"),
        ("weight: 3", "weight: -3", "labs.lab2.weight: must be at least 0"),
        ("weight: 3", "wieght: 3", "weight"),
        (
            "late: {lost: 10}\n",
            "",
            "course.yaml:5: labs.lab1: late days need a rule for what later work costs",
        ),
        (
            "    weight: 3",
            "    results: results/lab1",
            "labs.lab2.results: results/lab1 is the folder of lab1 already",
        ),
        ("12:00:00Z\n  lab2", "12:00:00\n  lab2", "deadline: must be a time with its zone"),
        ("feedback: folder", "feedback: post", "feedback"),
    ],
)
def test_a_slip_in_it_is_named_with_its_line(course: Path, old: str, new: str, said: str) -> None:
    text = COURSE.replace(old, new)
    assert text != COURSE
    (course / "course.yaml").write_text(text)
    with pytest.raises(RubricError) as caught:
        load_course(Path("course.yaml"))
    assert said in "\n".join(caught.value.faults)


def test_late_days_need_a_deadline(course: Path, capsys) -> None:
    (course / "course.yaml").write_text(COURSE.replace("    deadline: 2026-10-30T12:00:00Z\n", ""))
    assert grade("lab1") == 2
    assert "late days need a deadline" in capsys.readouterr().err


def test_a_lab_without_a_roster(course: Path, capsys) -> None:
    (course / "course.yaml").write_text(COURSE.replace("    roster: lab1.csv\n", ""))
    assert grade("lab1") == 2
    assert "lab1 has no roster" in capsys.readouterr().err


def test_attempts_are_in_the_order_of_their_moments_whatever_their_zones() -> None:
    here = timezone(timedelta(hours=1))
    late = Entry(id="ada", source="late", submitted_at=datetime(2026, 11, 1, 9, 30, tzinfo=timezone.utc))
    early = Entry(id="ada", source="early", submitted_at=datetime(2026, 11, 1, 10, 0, tzinfo=here))
    first, second = rounds(Roster(file="r.csv", entries=(late,), again=(early,)))
    assert [one.entries[0].source for one in (first, second)] == ["early", "late"]
