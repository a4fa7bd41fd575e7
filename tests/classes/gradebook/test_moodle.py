"""What Moodle imports: grades by a column that names students, its grader report, the offline grading worksheet."""

from __future__ import annotations

import csv
import io
from pathlib import Path

import pytest

from grader.classes.gradebook import Book, GradebookRow, write_gradebook
from grader.errors import UsageError
from tests.classes.gradebook.made import BOOK, late, row

WORKSHEET = (
    b'Identifier,"Full name","Email address",Status,Grade,"Maximum Grade","Grade can be changed",'
    b'"Last modified (submission)","Last modified (grade)","Feedback comments"\n'
    b'"Participant 101","Ada Lovelace",ada@x.edu,"Submitted for grading",,100.00,Yes,'
    b'"Friday, 20 November 2026, 11:00 PM",-,\n'
    b'"Participant 102","George Boole",george@x.edu,"No submission",,100.00,Yes,-,-,"<p>line\nline</p>"\n'
)
REPORT = (
    b'"First name",Surname,"ID number","Email address","Assignment: Lab 1 (Real)","Assignment: Lab 1 (Feedback)",'
    b'"Assignment: Lab 1 (Percentage)","Course total (Real)","Last downloaded from this course"\n'
    b"Ada,Lovelace,S1,ada@x.edu,-,-,-,-,1700000000\n"
    b"George,Boole,S2,george@x.edu,12.00,good,12.00 %,-,1700000000\n"
)


def filled(
    folder: Path, export: bytes, rows: list[GradebookRow], **options: object
) -> tuple[bytes, list[str]]:
    (folder / "export.csv").write_bytes(export)
    remarks = write_gradebook(
        BOOK, rows, folder / "out.csv", "moodle", template=folder / "export.csv", **options
    )
    return (folder / "out.csv").read_bytes(), list(remarks)


def made(
    folder: Path, rows: list[GradebookRow], book: Book = BOOK, **options: bool
) -> tuple[list[list[str]], list[str]]:
    remarks = write_gradebook(book, rows, folder / "out.csv", "moodle", **options)
    text = (folder / "out.csv").read_bytes().decode()
    return list(csv.reader(io.StringIO(text, newline=""))), list(remarks)


def test_the_worksheet_by_the_numbers_of_a_bulk_download(tmp_path: Path) -> None:
    rows = [row("Participant-101", 87.5, Moodle_id="101"), row("x", 5, name="George Boole", open_="rate")]
    data, remarks = filled(tmp_path, WORKSHEET, rows)
    assert data == WORKSHEET.replace(b'grading",,100.00', b'grading",87.5,100.00')
    assert remarks == ["x: no grade (inconclusive: open: rate)"]


def test_the_number_of_a_team_is_no_students_number(tmp_path: Path) -> None:
    data, remarks = filled(tmp_path, WORKSHEET, [row("Team A-101", name="Team A", Moodle_id="101")])
    assert data == WORKSHEET
    assert remarks[0].startswith("Team A-101 (Team A): not in export.csv")


def test_hidden_names_go_by_their_number(tmp_path: Path) -> None:
    data, _ = filled(tmp_path, WORKSHEET, [row("Participant-101", name="Participant 101", Moodle_id="101")])
    assert data == WORKSHEET.replace(b'grading",,100.00', b'grading",87.5,100.00')


def test_the_worksheet_in_another_language(tmp_path: Path) -> None:
    text = "ID;Vollständiger Name;E-Mail-Adresse;Bewertung;Bestwertung\nTeilnehmer/in101;Ada;a@x;;10,00\n"
    data, remarks = filled(tmp_path, text.encode(), [row("Ada-101", 7.5, Moodle_id="101")])
    assert data.decode() == text.replace("a@x;;", "a@x;7.5;")
    assert "a maximum of 10 points, the rubric 100" in remarks[0]


def test_the_worksheet_has_one_grade(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="one grade"):
        filled(tmp_path, WORKSHEET, [], per_criterion=True)


def test_the_grader_report(tmp_path: Path) -> None:
    data, remarks = filled(tmp_path, REPORT, [row("ada@x.edu", 87.5), row("s2", error="no package")])
    assert data == REPORT.replace(b"ada@x.edu,-,-", b"ada@x.edu,87.5,-")
    assert remarks == ["s2: no grade (error: no package)", "s2: 12.00 is there already, and stays"]


def test_columns_of_criteria_are_added_to_the_report(tmp_path: Path) -> None:
    data, remarks = filled(tmp_path, REPORT, [row("S1")], per_criterion=True)
    lines = data.decode().splitlines()
    assert lines[0].endswith('this course",Lab 1 - Right rate,Lab 1 - Right name')
    assert lines[1].endswith(",1700000000,47.5,40")
    assert lines[2].endswith(",1700000000,,")
    assert "map it to a new grade item" in remarks[0]


def test_without_an_export(tmp_path: Path) -> None:
    rows = [
        late(row("ada", 87.5, name="Ada <b>", Email="ada@x.edu", SIS_User_ID="1"), 97.5),
        row("bob", error="no package", Email="bob@x.edu"),
        row("cem", 101),
    ]
    cells, remarks = made(tmp_path, rows)
    assert cells == [
        ["Email address", "Full name", "Lab 1", "Feedback"],
        ["ada@x.edu", "Ada <b>", "87.5", "1 day late: 10 taken"],
        ["bob@x.edu", "", "-", ""],
    ]
    assert remarks == [
        "bob: no grade (error: no package)",
        "cem: left out, without Email address",
        "Moodle refuses the whole file for points above 100, unless its grades are unlimited",
    ]


def test_without_an_export_and_without_columns(tmp_path: Path) -> None:
    book = BOOK.model_copy(update={"columns": ("Seat",)})
    cells, remarks = made(tmp_path, [row("ada")], book, per_criterion=True)
    assert cells == [
        ["Username", "Full name", "Lab 1 - Right rate", "Lab 1 - Right name", "Feedback"],
        ["ada", "", "47.5", "40", ""],
    ]
    assert "ids stand as Username" in remarks[0]
