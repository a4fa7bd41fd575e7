"""What Blackboard imports: its own download with a column filled in, or a file of its form."""

from __future__ import annotations

import csv
import io
from pathlib import Path

import pytest

from grader.classes.gradebook import GradebookRow, write_gradebook
from tests.classes.gradebook.made import BOOK, row

DOWNLOAD = (
    '"Last Name"\t"First Name"\t"Username"\t"Student ID"\t"Last Access"\t"Availability"'
    '\t"Lab 1 [Total Pts: 100 Score] |123"\t"Total [Total Pts: up to 100 Score] |9"\r\n'
    '"Lovelace"\t"Ada"\t"al1"\t"S1"\t""\t"Yes"\t""\t""\r\n'
    '"Ångström"\t"Zoë"\t"za2"\t"S2"\t""\t"Yes"\t"3"\t""\r\n'
)


def filled(
    folder: Path, export: bytes, rows: list[GradebookRow], **options: object
) -> tuple[bytes, list[str]]:
    (folder / "gc.xls").write_bytes(export)
    remarks = write_gradebook(
        BOOK, rows, folder / "out.xls", "blackboard", template=folder / "gc.xls", **options
    )
    return (folder / "out.xls").read_bytes(), list(remarks)


@pytest.mark.parametrize(
    ("mark", "encoding", "delimiter"),
    [
        (b"\xff\xfe", "utf-16-le", "\t"),
        (b"\xfe\xff", "utf-16-be", ","),
        (b"\xef\xbb\xbf", "utf-8", "\t"),
        (b"", "utf-8", ","),
    ],
)
def test_the_download_stays_as_it_is(tmp_path: Path, mark: bytes, encoding: str, delimiter: str) -> None:
    text = DOWNLOAD.replace("\t", delimiter)
    rows = [row("AL1", 87.5), row("x", 100, name="Zoe\u0308 Ångstro\u0308m"), row("y", 1, Username="zz")]
    data, remarks = filled(tmp_path, mark + text.encode(encoding), rows)
    there = f'"Yes"{delimiter}""{delimiter}""\r\n"'
    expected = text.replace(there, f'"Yes"{delimiter}"87.5"{delimiter}""\r\n"').replace('"3"', '"100"')
    assert data == mark + expected.encode(encoding)
    assert remarks == ["y: not in gc.xls: no row there has this id, number, login, address or name"]


def test_another_maximum_is_told(tmp_path: Path) -> None:
    data, remarks = filled(tmp_path, DOWNLOAD.replace("Pts: 100", "Pts: 10").encode(), [row("al1", 9)])
    assert b'"Yes"\t"9"' in data
    assert "a maximum of 10 points, the rubric 100: points are written as the rubric gives them" in remarks[0]


def test_a_new_column(tmp_path: Path) -> None:
    data, remarks = filled(tmp_path, DOWNLOAD.replace("Lab 1 ", "Essay ").encode(), [row("al1", 9)])
    lines = data.decode().splitlines()
    assert lines[0].endswith('\t"Lab 1 [Total Pts: 100 Score]"')
    assert lines[1].endswith('\t"9"')
    assert "make the column there" in remarks[0]


def test_without_a_download(tmp_path: Path) -> None:
    rows = [
        row("ada", 87.5, name="Ada King Lovelace", Username="al1", SIS_User_ID="S1"),
        row("bob", 100, name="Boole, George"),
        row("cem", error="no package"),
    ]
    book = BOOK.model_copy(update={"columns": ("Username", "SIS User ID")})
    remarks = write_gradebook(book, rows, tmp_path / "out.csv", "blackboard")
    text = (tmp_path / "out.csv").read_bytes().decode()
    assert text.splitlines()[0] == (
        '"Last Name","First Name","Username","Student ID","Lab 1 [Total Pts: 100 Score]"'
    )
    assert list(csv.reader(io.StringIO(text, newline="")))[1:] == [
        ["Lovelace", "Ada King", "al1", "S1", "87.5"],
        ["Boole", "George", "bob", "", "100"],
        ["", "", "cem", "", ""],
    ]
    assert remarks[0] == "cem: no grade (error: no package)"
    assert "--template" in remarks[-1]
