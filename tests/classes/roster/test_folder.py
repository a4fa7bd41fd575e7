"""Folders of submissions, and bulk downloads of Moodle and Canvas."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from grader.classes.roster import read_roster
from grader.classes.roster.platforms import Named, platform_name
from grader.errors import UsageError
from tests.classes.roster.helpers import ids, said


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
