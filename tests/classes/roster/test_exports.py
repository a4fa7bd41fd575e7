"""What GitHub Classroom and GitLab export, folders of submissions, and the downloads of Moodle and Canvas."""

from __future__ import annotations

import io
import json
import os
import zipfile
from datetime import datetime, timezone
from pathlib import Path

import pytest

from grader.classes.fetching.obtain import source_of
from grader.classes.roster import read_roster
from grader.classes.roster.exports import Named, is_download, platform_name, unpack_download
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


@pytest.mark.parametrize(
    ("name", "named"),
    [
        ("Ada Lovelace_1234567_assignsubmission_file", Named("Moodle", "1234567", "Ada Lovelace", "")),
        ("Ada_L_1234567_assignsubmission_file_my_lab.zip", Named("Moodle", "1234567", "Ada_L", "my_lab.zip")),
        ("Zoë Ångström_7_assignsubmission_file_", Named("Moodle", "7", "Zoë Ångström", "")),
        (
            "Participant_99_assignsubmission_onlinetext",
            Named("Moodle", "99", "Participant", "", is_text=True, is_blind=True),
        ),
        ("Participant 99_assignsubmission_file", Named("Moodle", "99", "Participant", "", is_blind=True)),
        ("lovelaceada_12345_67890_lab1.zip", Named("Canvas", "12345", "lovelaceada", "lab1.zip")),
        (
            "lovelaceada_LATE_12345_67890_lab1-2.zip",
            Named("Canvas", "12345", "lovelaceada", "lab1-2.zip", late=True),
        ),
        (
            "anon_12345_67890_lab_1.tar.gz",
            Named("Canvas", "12345", "anon", "lab_1.tar.gz", is_blind=True),
        ),
        (
            "LATE_anon_x7Yz2_67890_lab1.zip",
            Named("Canvas", "x7Yz2", "anon", "lab1.zip", late=True, is_blind=True),
        ),
        ("van_der_meer_12345_67890_lab1.zip", Named("Canvas", "12345", "van_der_meer", "lab1.zip")),
        (
            "lovelaceada_LATE_12345_text.html",
            Named("Canvas", "12345", "lovelaceada", "", late=True, is_text=True),
        ),
        ("lovelaceada_12345_link.html", Named("Canvas", "12345", "lovelaceada", "", is_text=True)),
        ("lab1", None),
        ("lab1_2026_11.zip", None),
        ("ada_lovelace.zip", None),
    ],
)
def test_names_of_bulk_downloads(name: str, named: Named | None) -> None:
    assert platform_name(name) == named


def made(folder: Path, *names: str) -> Path:
    for name in names:
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.mkdir() if name.endswith("/") else path.touch()
    return folder


def test_folders_archives_and_recordings(tmp_path: Path) -> None:
    made(tmp_path, "zoe/", ".git/", "__MACOSX/", "bob.tar.gz", "notes.pdf", "run.bag", "zoe.zip")
    (tmp_path / os.fsdecode(b"zo\xeb")).mkdir()
    roster = read_roster(tmp_path)
    assert [(entry.id, entry.source) for entry in roster.entries] == [
        ("bob", str(tmp_path / "bob.tar.gz")),
        ("run.bag", str(tmp_path / "run.bag")),
        ("zoe", str(tmp_path / "zoe")),
    ]
    assert said(roster) == [
        "notes.pdf: neither a folder nor an archive",
        "zoe.zip: id: zoe is there already, in zoe",
        "zo\\xeb: its name is not UTF-8: rename it",
    ]


def test_canvas_one_archive_among_the_files_of_a_student(tmp_path: Path) -> None:
    made(
        tmp_path,
        "lovelaceada_LATE_5_6_lab1-2.zip",
        "x_7_8_a.zip",
        "x_7_9_b.zip",
        "y_8_1_plot.png",
        "y_8_2_lab1.zip",
        "y_8_3_text.html",
        "z_9_1_talker.py",
        "z_10_link.html",
        "anon_x7Yz2_1_lab1.zip",
    )
    roster = read_roster(tmp_path)
    assert ids(roster) == ["anon-x7Yz2", "lovelaceada-5", "y-8"]
    anonymous, ada, other = roster.entries
    assert anonymous.extra["Canvas anonymous id"] == "x7Yz2"
    assert ada.extra == {
        "platform": "Canvas",
        "file": "lab1-2.zip",
        "late": "yes",
        "Canvas id": "5",
    }
    assert other.source == str(tmp_path / "y_8_2_lab1.zip")
    assert other.extra["other files"] == "y_8_1_plot.png, y_8_3_text.html"
    assert roster.columns == ("platform", "file", "Canvas anonymous id", "late", "Canvas id", "other files")
    assert [(fault.where, fault.id, fault.text) for fault in roster.faults] == [
        ("x_7_8_a.zip", "x-7", "not the only one of this student, there is x_7_9_b.zip: leave one there"),
        ("z_10_link.html", "z-10", "only text or a link was submitted"),
        ("z_9_1_talker.py", "z-9", "neither a folder nor an archive"),
    ]
    assert [(fault.name, fault.extra["Canvas id"]) for fault in roster.faults] == [
        ("x", "7"),
        ("z", "10"),
        ("z", "9"),
    ]


def test_moodle_folders(tmp_path: Path) -> None:
    made(
        tmp_path,
        "Ada Lovelace_12_assignsubmission_file/lab1.zip",
        "Ada Lovelace_12_assignsubmission_onlinetext/onlinetext.html",
        "Bob_13_assignsubmission_file/lab1/package.xml",
        "Cem_14_assignsubmission_file/lab1.zip",
        "Cem_14_assignsubmission_file/notes.txt",
        "Participant_15_assignsubmission_file/.DS_Store",
        "Participant_15_assignsubmission_file/lab1.tar.gz",
        "Dan_16_assignsubmission_onlinetext/onlinetext.html",
    )
    roster = read_roster(tmp_path)
    assert [(entry.id, entry.name, entry.source) for entry in roster.entries] == [
        ("Ada Lovelace-12", "Ada Lovelace", f"{tmp_path}/Ada Lovelace_12_assignsubmission_file/lab1.zip"),
        ("Bob-13", "Bob", f"{tmp_path}/Bob_13_assignsubmission_file"),
        ("Cem-14", "Cem", f"{tmp_path}/Cem_14_assignsubmission_file"),
        ("Participant-15", "Participant 15", f"{tmp_path}/Participant_15_assignsubmission_file/lab1.tar.gz"),
    ]
    assert [entry.extra["Moodle id"] for entry in roster.entries] == ["12", "13", "14", "15"]
    assert said(roster) == ["Dan_16_assignsubmission_onlinetext: only text or a link was submitted"]
    (dan,) = roster.faults
    assert (dan.id, dan.name, dan.extra["Moodle id"]) == ("Dan-16", "Dan", "16")


def test_two_students_of_one_name_are_two(tmp_path: Path) -> None:
    made(tmp_path, "Ada_1_assignsubmission_file/", "Ada_2_assignsubmission_file/")
    assert ids(read_roster(tmp_path)) == ["Ada-1", "Ada-2"]


def test_what_is_one_submission(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="one package"):
        read_roster(made(tmp_path, "package.xml", "src/"))


def packed(path: Path, *names: str, content: bytes = b"x") -> Path:
    with zipfile.ZipFile(path, "w") as download:
        for name in names:
            download.writestr(name, content)
    return path


def student(name: str = "lab1/package.xml") -> bytes:
    inner = io.BytesIO()
    with zipfile.ZipFile(inner, "w") as archive:
        archive.writestr(name, "<package/>")
    return inner.getvalue()


@pytest.mark.parametrize("within", ["", "COMP3631-Lab 1-77/"])
def test_students_of_moodle(within: str, tmp_path: Path) -> None:
    path = packed(
        tmp_path / "all.ZIP",
        f"{within}Ada Lovelace_12_assignsubmission_file/lab1.zip",
        f"{within}Björn_13_assignsubmission_file/lab1/package.xml",
        f"{within}Dan_16_assignsubmission_onlinetext/onlinetext.html",
        content=student(),
    )
    assert is_download(path)
    folder = unpack_download(path, tmp_path / "out")
    roster = read_roster(folder)
    assert ids(roster) == ["Ada Lovelace-12", "Björn-13"]
    assert said(roster) == ["Dan_16_assignsubmission_onlinetext: only text or a link was submitted"]
    assert Path(roster.entries[0].source).read_bytes() == student()
    assert [source_of(entry).modes for entry in roster.entries] == ["lost", "lost"]


def test_students_of_canvas(tmp_path: Path) -> None:
    path = packed(
        tmp_path / "submissions.zip", "lovelaceada_LATE_5_6_lab1.zip", "x_7_8_a.zip", content=student()
    )
    assert ids(read_roster(unpack_download(path, tmp_path / "out"))) == ["lovelaceada-5", "x-7"]


def test_the_same_download_is_unpacked_once(tmp_path: Path) -> None:
    path = packed(tmp_path / "all.zip", "x_7_8_a.zip", content=student())
    folder = unpack_download(path, tmp_path / "out")
    (folder / "mark").touch()
    assert unpack_download(path, tmp_path / "out") == folder
    assert (folder / "mark").exists()
    packed(path, "x_7_9_a.zip", content=student())
    assert unpack_download(path, tmp_path / "out") != folder


def test_nothing_is_written_elsewhere(tmp_path: Path) -> None:
    path = packed(tmp_path / "all.zip", "../../up_1_2_a.zip", "/etc/x_3_4_b.zip", "c_5_6_d.zip")
    folder = unpack_download(path, tmp_path / "a" / "b" / "out")
    assert all(file.is_relative_to(folder) for file in tmp_path.rglob("*_?_?_?.zip"))
    assert len(list(tmp_path.rglob("*_?_?_?.zip"))) == 3


def test_what_is_no_download(tmp_path: Path) -> None:
    damaged = tmp_path / "damaged.zip"
    damaged.write_bytes(b"no zip")
    with pytest.raises(UsageError, match=r"damaged\.zip: cannot be unpacked: File is not a zip file"):
        unpack_download(damaged, tmp_path / "out")
    with pytest.raises(UsageError, match="this is one package, not a download"):
        unpack_download(packed(tmp_path / "lab1.zip", "lab1/package.xml"), tmp_path / "out")
    assert not (tmp_path / "out").exists()
