"""Rosters as instructors have them, and every fault of one by its line."""

from __future__ import annotations

import json
from datetime import datetime, timezone
from pathlib import Path

import pytest

from grader.errors import UsageError
from grader.roster import Entry, read_roster
from grader.roster.platforms import Named, platform_name


def roster_file(folder: Path, text: str, encoding: str = "utf-8") -> Path:
    path = folder / "roster.csv"
    path.write_bytes(text.encode(encoding))
    return path


def test_all_columns(tmp_path: Path) -> None:
    text = (
        "id,source,ref,name,group,submitted_at,extension_days,Seat\n"
        "ada,https://git.example/ada.git,main,Ada Lovelace,A,2026-11-20T23:59:00+01:00,2,12\n"
        "bob,handed-in/bob.zip,,,,,,\n"
    )
    roster = read_roster(roster_file(tmp_path, text))
    assert roster.faults == ()
    assert roster.columns == ("Seat",)
    assert roster.entries == (
        Entry(
            id="ada",
            source="https://git.example/ada.git",
            ref="main",
            name="Ada Lovelace",
            group="A",
            submitted_at=datetime(2026, 11, 20, 22, 59, tzinfo=timezone.utc),
            extension_days=2.0,
            where="roster.csv:2",
            extra={"Seat": "12"},
        ),
        Entry(
            id="bob", source=str(tmp_path / "handed-in" / "bob.zip"), where="roster.csv:3", extra={"Seat": ""}
        ),
    )


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
@pytest.mark.parametrize("delimiter", [",", ";", "\t"])
def test_as_spreadsheets_write_it(tmp_path: Path, encoding: str, delimiter: str) -> None:
    text = (
        delimiter.join(["ID", "Source", "Submitted at"])
        + "\r\n"
        + delimiter.join(["zoë", "zoë", ""])
        + "\r\n\r\n"
    )
    (entry,) = read_roster(roster_file(tmp_path, text, encoding)).entries
    assert (entry.id, entry.source) == ("zoë", str(tmp_path / "zoë"))


def test_every_fault_by_its_line(tmp_path: Path) -> None:
    text = (
        "id,source,submitted_at,extension_days\n"
        ",ada,,\n"
        "bob,,,\n"
        "cem,../../secret,,\n"
        "dan,dan,yesterday,\n"
        "eva,eva,,many\n"
        "fay,fay,,-1\n"
        'gil,"a\nb",,\n'
        "HUI,hui,,\n"
        "hui,hui2,,\n"
        "ida,ida,,,,more\n"
        "jan,jan,2026-01-01,1.5\n"
    )
    roster = read_roster(roster_file(tmp_path, text))
    assert roster.faults == (
        "roster.csv:12: 6 fields, but the first line names 4 columns",
        "roster.csv:2: no id",
        "roster.csv:3: no source",
        "roster.csv:4: source: ../../secret leads out of the roster's folder",
        "roster.csv:5: submitted_at: yesterday is no time such as 2026-11-20T23:59:00+01:00",
        "roster.csv:6: extension_days: many is no number of days",
        "roster.csv:7: extension_days: -1 is no number of days",
        "roster.csv:11: id: hui is there already, in roster.csv:10",
    )
    assert [entry.id for entry in roster.entries] == ["gil", "HUI", "ida", "jan"]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "the file is empty"),
        ("name,source\nada,ada\n", "no column id; there are: name, source"),
        ("id,source,id\na,b,c\n", "the column id is there twice"),
        ("id,source,Submitted At,submitted_at\na,b,,\n", "the column submitted_at is there twice"),
        ("id,source\n", "no submission in it"),
    ],
)
def test_what_is_no_roster(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(UsageError) as raised:
        read_roster(roster_file(tmp_path, text))
    assert said in raised.value.message


def test_text_in_another_encoding_is_named_with_its_line(tmp_path: Path) -> None:
    with pytest.raises(UsageError) as raised:
        read_roster(roster_file(tmp_path, "id,source\nada,ada\nzo\xeb,zoe\n", "latin-1"))
    assert "roster.csv:3: no UTF-8 text" in raised.value.message


def test_a_quote_that_never_ends(tmp_path: Path) -> None:
    roster = read_roster(roster_file(tmp_path, 'id,source\nada,ada\nbob,"bob\n'))
    assert [entry.id for entry in roster.entries] == ["ada"]
    assert roster.faults == ("roster.csv:3: unexpected end of data",)


def test_a_link_out_of_the_folder(tmp_path: Path) -> None:
    (tmp_path / "class").mkdir()
    (tmp_path / "class" / "out").symlink_to("/etc")
    (fault,) = read_roster(roster_file(tmp_path / "class", "id,source\nada,out/passwd\n")).faults
    assert "leads out" in fault


@pytest.mark.parametrize(
    ("name", "named"),
    [
        ("Ada Lovelace_1234567_assignsubmission_file", Named("Moodle", "1234567", "Ada Lovelace", "")),
        ("Ada_L_1234567_assignsubmission_file_my_lab.zip", Named("Moodle", "1234567", "Ada_L", "my_lab.zip")),
        ("Zoë Ångström_7_assignsubmission_file_", Named("Moodle", "7", "Zoë Ångström", "")),
        ("Participant_99_assignsubmission_onlinetext", Named("Moodle", "99", "Participant", "")),
        ("lovelaceada_12345_67890_lab1.zip", Named("Canvas", "12345", "lovelaceada", "lab1.zip")),
        (
            "lovelaceada_LATE_12345_67890_lab1-2.zip",
            Named("Canvas", "12345", "lovelaceada", "lab1-2.zip", True),
        ),
        ("anon_12345_67890_lab_1.tar.gz", Named("Canvas", "12345", "anon", "lab_1.tar.gz")),
        ("lab1", None),
        ("lab1_2026_11.zip", None),
        ("ada_lovelace.zip", None),
    ],
)
def test_names_of_bulk_downloads(name: str, named: Named | None) -> None:
    assert platform_name(name) == named


def test_a_folder(tmp_path: Path) -> None:
    for name in ("zoe", ".git", "__MACOSX", "Ada Lovelace_12_assignsubmission_file"):
        (tmp_path / name).mkdir()
    for name in (
        "bob.tar.gz",
        "lovelaceada_LATE_5_6_lab1.zip",
        "notes.pdf",
        "run.bag",
        "x_7_8_a.zip",
        "x_7_9_b.zip",
    ):
        (tmp_path / name).touch()
    roster = read_roster(tmp_path)
    assert [entry.id for entry in roster.entries] == [
        "Ada Lovelace-12",
        "bob",
        "lovelaceada-5",
        "run.bag",
        "zoe",
    ]
    assert roster.entries[0].name == "Ada Lovelace"
    assert roster.entries[2].extra == {
        "platform": "Canvas",
        "file": "lab1.zip",
        "late": "yes",
        "Canvas id": "5",
    }
    assert roster.faults == (
        "notes.pdf: neither a folder nor an archive",
        "x_7_9_b.zip: belongs to the same student as x_7_8_a.zip",
    )


def test_an_export_of_github_classroom(tmp_path: Path) -> None:
    text = (
        '"assignment_name","github_username","roster_identifier","student_repository_url","submission_timestamp"\n'
        '"lab1","ada-l","Ada","https://github.com/course/lab1-ada-l","2026-11-20T10:00:00Z"\n'
        '"lab1","","Bob","",""\n'
    )
    roster = read_roster(roster_file(tmp_path, text))
    (entry,) = roster.entries
    assert (entry.id, entry.name, entry.source) == ("ada-l", "Ada", "https://github.com/course/lab1-ada-l")
    assert entry.submitted_at == datetime(2026, 11, 20, 10, tzinfo=timezone.utc)
    assert roster.faults == ("roster.csv:3: Bob has no repository",)


def test_the_projects_of_a_gitlab_group(tmp_path: Path) -> None:
    path = tmp_path / "projects.json"
    project = {
        "path": "lab1-ada",
        "name": "Lab 1 Ada",
        "http_url_to_repo": "https://git.example/c/lab1-ada.git",
    }
    path.write_text(json.dumps([{**project, "namespace": {"full_path": "c"}}, {"id": 3}, 5, project]))
    roster = read_roster(path)
    assert [(e.id, e.source, e.group) for e in roster.entries] == [
        ("lab1-ada", "https://git.example/c/lab1-ada.git", "c")
    ]
    assert roster.faults == (
        "projects.json: project 2: no http_url_to_repo, or no path",
        "projects.json: project 3: no project",
        "projects.json: project 4: lab1-ada is there already, as projects.json: project 1",
    )
    for text in ("{}", "[", "nothing"):
        path.write_text(text)
        with pytest.raises(UsageError):
            read_roster(path)
