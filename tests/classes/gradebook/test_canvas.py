"""What Canvas imports: its own export with a column filled in, or a file of its form."""

from __future__ import annotations

import csv
import io
from pathlib import Path

import pytest

from grader.classes.gradebook import Book, GradebookRow, write_gradebook
from grader.errors import UsageError
from tests.classes.gradebook.made import BOOK, late, row

EXPORT = (
    '\ufeffStudent,ID,SIS User ID,SIS Login ID,Section,Lab 1 (123),"Quiz, 2 (124)",Current Score,Final Score\r\n'
    ",,,,,Manual Posting,,,\r\n"
    "    Points Possible,,,,,100.00,10.00,(read only),(read only)\r\n"
    '"Lovelace, Ada",11,S1,ada@x.edu,"L1, L2",,9.00,90,45\r\n'
    '"Boole, George",12,S2,george,L1,55.5,,,\r\n'
    '"O\'Hara, ""Cem""",13,S3,cem,L1,EX,,,\r\n'
    '"Noether, Emmy",14,S4,emmy,L1,70.00,,,\r\n'
    '"Zuse, Konrad",15,S5,konrad,L1,,,,\r\n'
    '"Student, Test",16,,abc,L1,,,,\r\n'
).encode()


def filled(
    folder: Path, rows: list[GradebookRow], *, export: bytes = EXPORT, **options: object
) -> tuple[bytes, list[str]]:
    (folder / "export.csv").write_bytes(export)
    target = folder / "out.csv"
    remarks = write_gradebook(BOOK, rows, target, "canvas", template=folder / "export.csv", **options)
    return target.read_bytes(), list(remarks)


def made(
    folder: Path, rows: list[GradebookRow], book: Book = BOOK, **options: bool
) -> tuple[list[list[str]], list[str]]:
    target = folder / "out.csv"
    remarks = write_gradebook(book, rows, target, "canvas", **options)
    text = target.read_bytes().decode("utf-8")
    return list(csv.reader(io.StringIO(text, newline=""))), list(remarks)


def test_the_export_stays_as_it_is_but_for_our_column(tmp_path: Path) -> None:
    rows = [
        row("ada", 87.5, Email="Ada@X.edu"),
        row("S2", 100),
        row("c", 50, SIS_User_ID="s3"),
        row("e", 60, name="Emmy Noether", open_="rate"),
        row("nobody", name="Nobody"),
    ]
    data, remarks = filled(tmp_path, rows)
    expected = EXPORT.replace(b',"L1, L2",,9.00', b',"L1, L2",87.5,9.00').replace(b"L1,55.5,", b"L1,100,")
    assert data == expected
    assert remarks == [
        "e: no grade (inconclusive: open: rate)",
        "c: EX stays, the 50 points are left out",
        "e: 70.00 is there already, and stays",
        "nobody (Nobody): not in export.csv: no row there has this id, number, login, address or name",
        "Zuse, Konrad, 15, S5, konrad: in export.csv, without a submission here",
    ]


def test_an_open_grade_is_empty_and_never_zero(tmp_path: Path) -> None:
    data, remarks = filled(tmp_path, [row("ada@x.edu", error="no package"), row("konrad", 0)])
    rows = list(csv.reader(io.StringIO(data.decode("utf-8-sig"), newline="")))
    assert [one[5] for one in rows[3:]] == ["", "55.5", "EX", "70.00", "0", ""]
    assert remarks[0] == "ada@x.edu: no grade (error: no package)"


@pytest.mark.parametrize(
    ("export", "why"),
    [
        (EXPORT + b'"Lovelace, Ada",17,S9,ada2,L3,,,,\r\n', "2 rows there could be this student"),
        (EXPORT.replace(b"Lovelace, Ada", b"Lovelace, A."), "no row there has"),
    ],
)
def test_names_that_are_not_sure_match_nobody(tmp_path: Path, export: bytes, why: str) -> None:
    data, remarks = filled(tmp_path, [row("x", name="Ada Lovelace")], export=export)
    assert data == export
    assert remarks[0].startswith("x (Ada Lovelace): not in export.csv: ")
    assert why in remarks[0]


def test_what_contradicts_itself_matches_nobody(tmp_path: Path) -> None:
    data, remarks = filled(tmp_path, [row("x", SIS_User_ID="S1", Email="george")])
    assert data == EXPORT
    assert "2 rows there could be this student" in remarks[0]


def test_two_submissions_for_one_row_are_both_left_out(tmp_path: Path) -> None:
    data, remarks = filled(tmp_path, [row("ada@x.edu"), row("y", SIS_User_ID="S1")])
    assert data == EXPORT
    assert sum("another submission fits the same row" in remark for remark in remarks) == 2


def test_canvas_ids_of_a_bulk_download(tmp_path: Path) -> None:
    data, _ = filled(
        tmp_path, [row("lovelaceada-11", 1, name="lovelaceada", Canvas_id="11"), row("q", 2, Moodle_id="12")]
    )
    assert b'"L1, L2",1,9.00' in data
    assert b"L1,55.5," in data


def test_a_column_by_its_name(tmp_path: Path) -> None:
    data, remarks = filled(tmp_path, [row("george", 7)], column="Quiz, 2")
    assert b"george,L1,55.5,7,," in data
    assert "maximum of 10 points, the rubric 100" in remarks[0]
    with pytest.raises(UsageError, match="no column Quiz 3") as raised:
        filled(tmp_path, [row("george", 7)], column="Quiz 3")
    assert "Lab 1 (123), Quiz, 2 (124)" in raised.value.hint


def test_two_columns_of_one_name(tmp_path: Path) -> None:
    export = EXPORT.replace(b'"Quiz, 2 (124)"', b"LAB 1 (124)")
    with pytest.raises(UsageError, match="several columns") as raised:
        filled(tmp_path, [row("george", 7)], export=export)
    assert "--column" in raised.value.hint
    data, _ = filled(tmp_path, [row("george", 7)], export=export, column="LAB 1 (124)")
    assert b"george,L1,55.5,7,," in data


def test_a_column_that_is_not_there_is_added(tmp_path: Path) -> None:
    export = EXPORT.replace(b"Lab 1 (123)", b"Homework (123)")
    data, remarks = filled(tmp_path, [row("george", 7)], export=export)
    lines = data.decode("utf-8-sig").splitlines()
    assert [line.rpartition(",")[2] for line in lines] == ["Lab 1", "", "100", "", "7", "", "", "", ""]
    assert "Canvas makes a new assignment of it" in remarks[0]
    assert data.startswith(export[:40])


def test_columns_of_criteria(tmp_path: Path) -> None:
    export = EXPORT.replace(b'"Quiz, 2 (124)"', b"Lab 1 - Right rate (124)")
    rows = [late(row("george", 80), 90), row("konrad", 60, open_="rate")]
    data, remarks = filled(tmp_path, rows, export=export, per_criterion=True)
    cells = list(csv.reader(io.StringIO(data.decode("utf-8-sig"), newline="")))
    assert cells[0][5:] == [
        "Lab 1 (123)",
        "Lab 1 - Right rate (124)",
        "Current Score",
        "Final Score",
        "Lab 1 - Right name",
    ]
    assert [one[5:] for one in cells if "george" in one] == [["55.5", "40", "", "", "40"]]
    assert [one[5:] for one in cells if "konrad" in one] == [["", "", "", "", "40"]]
    assert "criteria do not include what being late cost: george" in remarks


def test_line_ends_and_delimiters_stay(tmp_path: Path) -> None:
    text = (
        'Student;ID;SIS Login ID;Section;Lab 1 (1)\n    Points Possible;;;;100\n"A; ""B""\nC";1;a;;\nD;2;d;;'
    )
    data, _ = filled(tmp_path, [row("a", 1.5), row("d", 2)], export=text.encode())
    assert data.decode() == text.replace(";a;;", ";a;;1.5").replace(";d;;", ";d;;2")


@pytest.mark.parametrize(
    "export",
    [b"", b"\xef\xbb\xbf", b"PK\x03\x04", b"Student,ID\xff\n", b"a,b\n1,2\n", b"\r\n\r\n", b"\xff\xfe\x00"],
)
def test_what_is_no_export(tmp_path: Path, export: bytes) -> None:
    with pytest.raises(UsageError):
        filled(tmp_path, [row("a")], export=export)


def test_without_an_export(tmp_path: Path) -> None:
    rows = [
        row(
            "ada", 87.5, name="Lovelace, Ada", SIS_User_ID="007", Email="ada@x", Section="L1", Canvas_id="11"
        ),
        row("bob", 0, name="=cmd()"),
        row("cem", error="no package"),
    ]
    book = BOOK.model_copy(update={"columns": ("SIS User ID", "Email", "Section", "Canvas id")})
    cells, remarks = made(tmp_path, rows, book)
    assert cells == [
        ["Student", "ID", "SIS User ID", "SIS Login ID", "Section", "Lab 1"],
        ["    Points Possible", "", "", "", "", "100"],
        ["Lovelace, Ada", "11", "007", "ada@x", "L1", "87.5"],
        ["'=cmd()", "", "", "bob", "", "0"],
        ["cem", "", "", "cem", "", ""],
    ]
    assert remarks[0] == "cem: no grade (error: no package)"
    assert "new assignment" in remarks[-1]


def test_without_an_export_and_without_columns(tmp_path: Path) -> None:
    cells, remarks = made(tmp_path, [row("ada")], Book(title="L", rubric_id="l", max_points=1))
    assert cells[2] == ["ada", "", "", "ada", "", "87.5"]
    assert "ids stand as SIS Login ID" in remarks[0]


def test_without_an_export_by_criterion(tmp_path: Path) -> None:
    cells, _ = made(tmp_path, [row("ada")], per_criterion=True)
    assert [one[5:] for one in cells] == [
        ["Lab 1 - Right rate", "Lab 1 - Right name"],
        ["60", "40"],
        ["47.5", "40"],
    ]
