"""What GitHub Classroom and GitLab export."""

from __future__ import annotations

import json
from datetime import datetime, timezone
from pathlib import Path

import pytest

from grader.classes.roster import read_roster
from grader.errors import UsageError
from tests.classes.roster.helpers import ids, read, said

GRADES = (
    '"assignment_name","github_username","roster_identifier","student_repository_url","submission_timestamp"'
    ',"points_awarded","group_name"\n'
)


def test_the_grades_of_github_classroom(tmp_path: Path) -> None:
    text = (
        GRADES
        + '"lab1","ada-l","Ada","https://github.com/course/lab1-ada-l","2026-11-20T10:00:00Z","","A"\n'
        + '"lab1","","Bob","","","",""\n'
        + '"lab1","cem","","https://github.com/course/lab1-pair","2026-11-20 10:00:00 UTC","3","B"\n'
        + '"lab1","dan","","https://github.com/course/lab1-pair","","3","B"\n'
    )
    roster = read(tmp_path, text)
    ada, cem, _ = roster.entries
    assert (ada.id, ada.name, ada.source) == ("ada-l", "Ada", "https://github.com/course/lab1-ada-l")
    assert ada.submitted_at == cem.submitted_at == datetime(2026, 11, 20, 10, tzinfo=timezone.utc)
    assert [(entry.id, entry.group) for entry in roster.entries] == [
        ("ada-l", "A"),
        ("cem", "B"),
        ("dan", "B"),
    ]
    assert roster.columns == ("assignment_name", "github_username", "points_awarded")
    assert said(roster) == ["roster.csv:3: Bob has no repository"]
    assert roster.faults[0].id == "Bob"


def test_the_list_of_students_of_github_classroom_names_no_repositories(tmp_path: Path) -> None:
    with pytest.raises(UsageError) as raised:
        read(tmp_path, '"identifier","github_username","github_id","name"\n"ada","ada-l","1","Ada"\n')
    assert "Download grades" in raised.value.hint


def project(path: str, **more: object) -> dict[str, object]:
    return {
        "path": path,
        "name": path.title(),
        "http_url_to_repo": f"https://git.example/c/{path}.git",
        **more,
    }


def test_the_projects_of_a_gitlab_group(tmp_path: Path) -> None:
    path = tmp_path / "projects.json"
    one = project("lab1-ada", namespace={"full_path": "c"})
    path.write_text(json.dumps([one, {"id": 3}, 5, one, {**one, "path": "\ud800", "name": "\ud800"}]))
    roster = read_roster(path)
    assert [(e.id, e.source, e.group) for e in roster.entries] == [
        ("lab1-ada", "https://git.example/c/lab1-ada.git", "c")
    ]
    assert said(roster) == [
        "projects.json: project 2: no http_url_to_repo, or no path",
        "projects.json: project 3: no project",
        "projects.json: project 4: id: lab1-ada is there already, in projects.json: project 1",
        "projects.json: project 5: no http_url_to_repo, or no path",
    ]


@pytest.mark.parametrize("between", ["", "\n", " \r\n"])
def test_pages_of_gitlab_one_after_the_other(tmp_path: Path, between: str) -> None:
    path = tmp_path / "projects.json"
    path.write_text(between.join(json.dumps([project(name)]) for name in "abc") + "\n")
    assert ids(read_roster(path)) == ["a", "b", "c"]
    path = tmp_path / "projects.ndjson"
    path.write_text("\n".join(json.dumps(project(name)) for name in "abc"))
    assert ids(read_roster(path)) == ["a", "b", "c"]


def test_projects_of_one_name_in_several_subgroups(tmp_path: Path) -> None:
    path = tmp_path / "projects.json"
    projects = [
        {
            "path": "ros",
            "ssh_url_to_repo": f"git@git.example:lab/{who}/ros.git",
            "path_with_namespace": f"lab/{who}/ros",
        }
        for who in ("ada", "bob")
    ]
    path.write_text(json.dumps([*projects, project("cem", path_with_namespace="lab/cem")]))
    assert ids(read_roster(path)) == ["ada-ros", "bob-ros", "cem"]


@pytest.mark.parametrize("text", ["", "{}", "[", "nothing", "[]", '{"message": "401 Unauthorized"}', "[] x"])
def test_no_list_of_projects(tmp_path: Path, text: str) -> None:
    path = tmp_path / "projects.json"
    path.write_text(text)
    with pytest.raises(UsageError):
        read_roster(path)
