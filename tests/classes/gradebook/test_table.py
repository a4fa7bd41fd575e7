"""The gradebook for people and programs: CSV, JSON Lines, a workbook."""

from __future__ import annotations

import csv
import io
import json
import os
import threading
import weakref
from pathlib import Path

import openpyxl
import pytest

from grader.classes.gradebook import Book, GradebookRow, json_line, write_gradebook
from grader.errors import OutputError, UsageError
from grader.model.result import GradingResult
from tests.classes.gradebook.made import BOOK, late, overridden, row

FORMULA = '=HYPERLINK("http://x","y")'
PERSIAN = "\u0639\u0644\u06cc\u200c\u0631\u0636\u0627"
ROWS = [
    row("ada", 87.5, name="Ada Lovelace", Seat="007", SIS_User_ID="-1.50", Email="a@x"),
    late(row("bob", 90, name=FORMULA, Seat="+cmd|' /C calc'!A0"), 100),
    row("cem", 40, name="\u202eevil", open_="rate", Seat="a\nb"),
    row("dan", name=PERSIAN, error="no package\nfound"),
    overridden(row("eva", 100)),
]


def written(folder: Path, rows: list[GradebookRow], book: Book = BOOK) -> list[dict[str, str]]:
    target = folder / "book.csv"
    assert write_gradebook(book, iter(rows), target, "csv") == ()
    text = target.read_bytes().decode()
    assert all(line.endswith("\r\n") for line in text.splitlines(keepends=True))
    return list(csv.DictReader(io.StringIO(text, newline="")))


def test_plain_csv(tmp_path: Path) -> None:
    ada, bob, cem, dan, eva = written(tmp_path, ROWS)
    assert ada == {
        "id": "ada",
        "name": "Ada Lovelace",
        "group": "",
        "status": "graded",
        "points": "87.5",
        "max_points": "100",
        "points_before_late": "87.5",
        "late": "",
        "rate": "47.5",
        "criterion name": "40",
        "advice": "0",
        "comment": "",
        "error": "",
        "Seat": "007",
        "SIS User ID": "-1.50",
        "Email": "a@x",
    }
    assert (bob["points"], bob["points_before_late"], bob["late"]) == ("90", "100", "1 day late: 10 taken")
    assert (bob["name"], bob["Seat"]) == ("'" + FORMULA, "'+cmd|' /C calc'!A0")
    assert (cem["status"], cem["rate"], cem["error"]) == ("inconclusive", "", "open: rate")
    assert (cem["name"], cem["Seat"]) == ("\\u202eevil", "a\\nb")
    assert (dan["status"], dan["name"], dan["error"]) == ("error", PERSIAN, "no package\\nfound")
    assert eva["comment"] == "rate: =ran by hand (kim)"


def test_every_column_has_a_name_of_its_own(tmp_path: Path) -> None:
    book = Book(
        title="x",
        rubric_id="x",
        max_points=1,
        criteria=(("late", "", 1),),
        columns=("Points", "late", "error"),
    )
    (found,) = written(tmp_path, [row("ada", Points="p", late="l", error="e")], book)
    assert list(found)[8:] == [
        "criterion late",
        "comment",
        "error",
        "roster Points",
        "roster late",
        "roster error",
    ]
    assert (found["roster Points"], found["roster late"]) == ("p", "l")


def test_json_lines(tmp_path: Path) -> None:
    write_gradebook(BOOK, iter(ROWS), tmp_path / "book.jsonl", "jsonl")
    lines = (tmp_path / "book.jsonl").read_text(encoding="utf-8").splitlines()
    found = [json.loads(line) for line in lines]
    assert [data.pop("roster") for data in found] == [one.entry.model_dump(mode="json") for one in ROWS]
    assert [GradingResult.model_validate(data) for data in found] == [one.result for one in ROWS]


def test_a_json_line_is_one_line_and_obeyed_by_nobody() -> None:
    text = json_line(row("ada", name="a\u2028b\x1b[31m##[error]\r", Seat="\n" * 3))
    assert text.splitlines(keepends=True) == [text]
    assert "\x1b" not in text
    assert "##[" not in text


def test_workbook(tmp_path: Path) -> None:
    write_gradebook(BOOK, iter(ROWS), tmp_path / "book.xlsx", "xlsx")
    book = openpyxl.load_workbook(tmp_path / "book.xlsx")
    sheet, criteria = book.worksheets
    rows = [[cell.value for cell in cells] for cells in sheet.rows]
    names = rows[0]
    assert names[:9] == [
        "id",
        "name",
        "group",
        "status",
        "points",
        "max_points",
        "points_before_late",
        "late",
        "rate",
    ]
    cells = {one[0]: dict(zip(names, one, strict=True)) for one in rows[1:]}
    assert (cells["ada"]["points"], cells["ada"]["Seat"], cells["ada"]["SIS User ID"]) == (
        87.5,
        "007",
        "-1.50",
    )
    assert cells["cem"]["rate"] is None
    assert cells["dan"]["name"] == PERSIAN
    assert cells["bob"]["name"] == FORMULA
    assert {cell.data_type for one in sheet.rows for cell in one} <= {"s", "n"}
    assert not [cell for one in sheet.rows for cell in one if cell.hyperlink]
    assert (sheet.freeze_panes, sheet.auto_filter.ref) == ("B2", "A1:P6")
    assert [[cell.value for cell in one] for one in criteria.rows] == [
        ["id", "title", "max_points"],
        ["rate", "Right rate", 60],
        ["name", "Right name", 40],
        ["advice", "Advice", 0],
    ]


def test_a_workbook_holds_texts_that_are_longer_than_a_cell(tmp_path: Path) -> None:
    write_gradebook(BOOK, [row("ada", Seat="x" * 40_000, Email="\x01" * 30_000)], tmp_path / "b.xlsx", "xlsx")
    sheet = openpyxl.load_workbook(tmp_path / "b.xlsx").worksheets[0]
    texts = [str(cell.value) for cell in sheet[2]]
    assert max(map(len, texts)) < 32_767
    assert any("30000 more characters" in text for text in texts)


def test_an_empty_class(tmp_path: Path) -> None:
    for form in ("csv", "jsonl", "xlsx", "canvas", "moodle", "blackboard"):
        write_gradebook(BOOK, [], tmp_path / form, form)
        assert (tmp_path / form).is_file()


def test_rows_are_read_one_by_one(tmp_path: Path) -> None:
    """When the next row is asked for, nobody holds the one before any more."""
    alive: list[weakref.ref[GradebookRow]] = []
    most = []

    def rows():
        for number in range(5):
            one = row(f"s{number}")
            alive.append(weakref.ref(one))
            yield one
            del one
            most.append(sum(ref() is not None for ref in alive))

    for form in ("csv", "jsonl", "xlsx", "canvas"):
        alive.clear()
        write_gradebook(BOOK, rows(), tmp_path / form, form)
    assert len(most) == 20
    assert max(most) <= 1


@pytest.mark.parametrize("form", ["csv", "jsonl", "xlsx", "canvas"])
def test_a_book_appears_whole_or_not_at_all(tmp_path: Path, form: str) -> None:
    target = tmp_path / "book"
    target.write_text("earlier")

    def rows():
        yield row("ada")
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_gradebook(BOOK, rows(), target, form)
    assert [path.name for path in tmp_path.iterdir()] == ["book"]
    assert target.read_text() == "earlier"


def test_into_a_pipe(tmp_path: Path) -> None:
    pipe, found = tmp_path / "pipe", []
    os.mkfifo(pipe)
    reader = threading.Thread(target=lambda: found.append(pipe.read_text()))
    reader.start()
    write_gradebook(BOOK, [row("ada")], pipe, "csv")
    reader.join()
    assert found[0].startswith("id,name,")
    assert pipe.is_fifo()


def test_where_nothing_can_be_written(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    for form in ("csv", "xlsx", "moodle"):
        with pytest.raises(OutputError):
            write_gradebook(BOOK, [], tmp_path / "file" / "book", form)


def test_what_is_for_platforms_only(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="needs no template"):
        write_gradebook(BOOK, [], tmp_path / "b", "csv", per_criterion=True)
