"""Which commit counts in a batch, and what being late costs."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from tests.classes.batch.a_class import CORRECT, RUBRIC, WRONG_NAME, batch, lines_of, roster_of, run_of
from tests.classes.batch.repositories import repository

DEADLINE = "2026-10-30T12:00:00+00:00"
POLICY = "late: {lost: 10, per: day, grace_minutes: 15, cap: 50, cut_off_days: 7}"


def rubric_with(path: Path, *lines: str) -> Path:
    path.write_text(RUBRIC.read_text().replace("scenarios:", "\n".join([*lines, "scenarios:"])))
    return path


def graded(tmp_path: Path, rows: list[str], *lines: str, more: tuple[str, ...] = ()) -> dict[str, dict]:
    columns = "id,source,submitted_at,extension_days"
    roster = roster_of(tmp_path, rows, columns)
    rubric = rubric_with(tmp_path / "rubric.yaml", *lines)
    batch(roster, tmp_path / "out", *more, rubric=rubric)
    return {line["submission"]["id"]: line for line in lines_of(tmp_path / "out")}


def test_the_last_commit_before_the_deadline_counts(tmp_path) -> None:
    work = repository(
        tmp_path / "ada",
        (WRONG_NAME, "2026-10-29T12:00:00+00:00"),
        (CORRECT, "2026-10-30T11:59:59+00:00"),
        (WRONG_NAME, "2026-10-30T12:00:01+00:00"),
    )
    url = work.as_uri()
    rows = [f"ada,{url},,", f"bob,{url},,1", f"cem,{url}@main,2026-10-29T13:00:00+00:00,"]
    found = graded(tmp_path, rows, f"deadline: {DEADLINE}")
    assert found["ada"]["points"] == 100
    assert found["bob"]["points"] < 100, "the extension makes a later commit count"
    assert found["cem"]["points"] < 100, "the roster knows when it was handed in"
    assert found["ada"]["handed_in"]["by"] == "commit"
    assert found["cem"]["handed_in"]["by"] == "roster"
    assert "1 later commit" in found["ada"]["handed_in"]["note"]
    report = (tmp_path / "out" / "ada" / "report.md").read_text()
    assert "2026-10-30" in report


@pytest.mark.full
def test_a_time_on_the_command_line(tmp_path) -> None:
    work = repository(
        tmp_path / "ada", (CORRECT, "2026-10-01T12:00:00+02:00"), (WRONG_NAME, "2026-10-20T12:00:00+02:00")
    )
    rows = [f"ada,{work.as_uri()},,", "bob,ada,,"]
    found = graded(tmp_path, rows, more=("--before", "2026-10-10T00:00:00Z"))
    assert found["ada"]["points"] == found["bob"]["points"] == 100
    assert run_of(tmp_path / "out")["before"].startswith("2026-10-10")
    assert "not committed" in found["bob"]["handed_in"]["note"]


@pytest.mark.full
def test_nothing_before_the_deadline(tmp_path) -> None:
    work = repository(tmp_path / "ada", (CORRECT, "2026-11-01T12:00:00+00:00"))
    found = graded(tmp_path, [f"ada,{work.as_uri()},,"], f"deadline: {DEADLINE}")
    assert found["ada"]["status"] == "error"
    assert "2026-10-30 12:00" in found["ada"]["error"]["message"]
    assert "2026-11-01" in found["ada"]["error"]["hint"]


@pytest.mark.full
def test_a_late_policy_shows_points_before_and_after(tmp_path) -> None:
    late = repository(tmp_path / "ada", (CORRECT, "2026-11-01T11:00:00+00:00")).as_uri()
    grace = repository(tmp_path / "bob", (CORRECT, "2026-10-30T12:10:00+00:00")).as_uri()
    shutil.copytree(CORRECT, tmp_path / "cem")
    rows = [f"ada,{late},,", f"bob,{grace},,", "cem,cem,2026-11-20T12:00:00Z,", f"dan,{late},,2", "eve,cem,,"]
    found = graded(tmp_path, rows, f"deadline: {DEADLINE}", POLICY)
    assert {name: line["points"] for name, line in found.items()} == {
        "ada": 80, "bob": 100, "cem": 0, "dan": 100, "eve": 100
    }  # fmt: skip
    assert found["ada"]["late"]["points_before"] == 100
    assert "2 days late" in found["ada"]["late"]["text"]
    assert "cut-off" in found["cem"]["late"]["text"]
    assert "it is not known when it was submitted" in found["eve"]["late"]["text"]
    assert "80 of 100" in (tmp_path / "out" / "ada" / "report.md").read_text()


@pytest.mark.full
def test_an_extension_that_comes_later_grades_nothing_again(tmp_path) -> None:
    late = repository(tmp_path / "ada", (CORRECT, "2026-11-01T11:00:00+00:00")).as_uri()
    assert graded(tmp_path, [f"ada,{late},,"], f"deadline: {DEADLINE}", POLICY)["ada"]["points"] == 80
    assert graded(tmp_path, [f"ada,{late},,5"], f"deadline: {DEADLINE}", POLICY)["ada"]["points"] == 100
    assert run_of(tmp_path / "out")["counts"]["kept"] == 1


@pytest.mark.full
def test_an_override_that_comes_later_grades_nothing_again(tmp_path) -> None:
    shutil.copytree(CORRECT, tmp_path / "ada")
    assert graded(tmp_path, ["ada,ada,,"])["ada"]["points"] == 100
    text = "ada:\n  cmake: {points: 10, comment: copied, author: A. Miller, date: 2026-11-02}\n"
    (tmp_path / "out" / "overrides.yaml").write_text(text)
    found = graded(tmp_path, ["ada,ada,,"])["ada"]
    assert (found["points"], found["overrides"][0]["author"]) == (80, "A. Miller")
    assert run_of(tmp_path / "out")["counts"]["kept"] == 1
    (tmp_path / "out" / "overrides.yaml").unlink()
    assert graded(tmp_path, ["ada,ada,,"])["ada"]["points"] == 100


@pytest.mark.full
def test_people_give_points_for_what_could_not_be_graded(tmp_path) -> None:
    (tmp_path / "ada").mkdir()
    (tmp_path / "ada" / "notes.txt").write_text("by mail")
    assert graded(tmp_path, ["ada,ada,,", "bob,../bob,,"])["ada"]["status"] == "error"
    text = "ada:\n" + "".join(f"  {name}: {{points: 5}}\n" for name in ("manifest", "cmake", "dependencies"))
    (tmp_path / "out" / "overrides.yaml").write_text(text + "bob:\n  cmake: {points: 3}\n")
    found = graded(tmp_path, ["ada,ada,,", "bob,../bob,,"])
    assert (found["ada"]["status"], found["ada"]["points"]) == ("graded", 15)
    assert found["ada"]["error"]["kind"] == "package-not-found"


@pytest.mark.full
def test_what_came_after_the_cut_off_has_not_passed(tmp_path) -> None:
    shutil.copytree(CORRECT, tmp_path / "ada")
    graded(tmp_path, ["ada,ada,2026-11-20T12:00:00Z,"], f"deadline: {DEADLINE}", POLICY)
    assert run_of(tmp_path / "out")["counts"]["passed"] == 0
