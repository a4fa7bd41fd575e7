"""Rosters and their times, as people and spreadsheets write them."""

from __future__ import annotations

import time
from datetime import datetime, timedelta, timezone
from pathlib import Path

import pytest

from grader.classes.roster import Entry, read_roster
from grader.classes.roster.entries import parse_days, parse_time, time_fault
from grader.errors import UsageError
from tests.classes.roster.helpers import ids, read, roster_file, said


def test_all_columns(tmp_path: Path) -> None:
    (tmp_path / "handed-in").mkdir()
    (tmp_path / "handed-in" / "bob.zip").touch()
    text = (
        "id,source,ref,package,name,group,submitted_at,extension_days,Seat\n"
        "ada,https://git.example/ada.git,main,lab_1,Ada Lovelace,A,2026-11-20T23:59:00+01:00,2,12\n"
        "bob,handed-in/bob.zip,,,,,,,\n"
    )
    roster = read(tmp_path, text)
    assert roster.faults == ()
    assert roster.columns == ("Seat",)
    assert roster.entries == (
        Entry(
            id="ada",
            source="https://git.example/ada.git",
            ref="main",
            package="lab_1",
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


# A file is decoded before anything looks for its delimiter: the two need no round for every pair of them.
@pytest.mark.parametrize(
    ("encoding", "delimiter", "end"),
    [
        *((name, ",", "\r\n") for name in ("utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "utf-32")),
        *(("utf-8", delimiter, end) for delimiter in (",", ";", "\t") for end in ("\r\n", "\n", "\r")),
        ("utf-16", "\t", "\r\n"),  # what Excel calls Unicode Text
    ],
)
def test_as_spreadsheets_write_it(tmp_path: Path, encoding: str, delimiter: str, end: str) -> None:
    (tmp_path / "zoë").mkdir()
    rows = [["ID", "Source", "Submitted at"], ["zoë", "zoë", ""], [], ["", "", ""]]
    text = "".join(delimiter.join(row) + end for row in rows)
    (entry,) = read_roster(roster_file(tmp_path, text, encoding)).entries
    assert (entry.id, entry.source) == ("zoë", str(tmp_path / "zoë"))


def test_what_excel_says_before_the_header_and_leaves_behind_the_rows(tmp_path: Path) -> None:
    roster = read(tmp_path, 'sep=;\n"id";"source";"a, b, c, d"\nada;ssh://h/a;x;;;\nbob;;;;;\n')
    assert (ids(roster), said(roster)) == (["ada"], ["roster.csv:4: no source"])


def test_signs_that_python_takes_for_line_ends_are_none(tmp_path: Path) -> None:
    roster = read(tmp_path, "id,source,name\nada,ssh://h/a,A\u2028\x0b\x85\x1cL\nbob,,\n")
    assert roster.entries[0].name == "A\u2028\x0b\x85\x1cL"
    assert said(roster) == ["roster.csv:3: no source"]


def test_invisible_signs_around_a_field_are_no_part_of_it(tmp_path: Path) -> None:
    roster = read(tmp_path, "\u200bid,source \u200e\nada\u200b,\u200essh://h/a\nada,ssh://h/b\n")
    assert ids(roster) == ["ada"]
    assert said(roster) == ["roster.csv:3: id: ada is there already, in roster.csv:2"]


def test_one_source_may_be_of_two(tmp_path: Path) -> None:
    roster = read(tmp_path, "id,source\nada,ssh://h/pair\nbob,ssh://h/pair\n")
    assert (ids(roster), roster.faults) == (["ada", "bob"], ())


@pytest.mark.parametrize(
    "source",
    [
        "git@host:ada/lab.git",
        "gitlab-uni:ada/lab",
        "https://host/ada@main",
        "host.example:22/x",
    ],
)
def test_addresses_stay_as_they_are(tmp_path: Path, source: str) -> None:
    assert [entry.source for entry in read(tmp_path, f"id,source\nada,{source}\n").entries] == [source]


def test_a_path_with_a_ref_and_one_that_looks_like_an_address(tmp_path: Path) -> None:
    (tmp_path / "ada").mkdir()
    (tmp_path / "bob:x").mkdir()
    roster = read(tmp_path, "id,source\nada,ada@v1.0\nbob,bob:x\n")
    assert [entry.source for entry in roster.entries] == [f"{tmp_path}/ada@v1.0", f"{tmp_path}/bob:x"]


@pytest.mark.parametrize(
    ("text", "message", "hint"),
    [
        ("", "the file is empty", "id,source"),
        ("\n\n,,\n", "the file is empty", "id,source"),
        ("name,source\nada,ada\n", "roster.csv:1: no column id; there are: name, source", "id,source"),
        (
            "\nid,sorce\nada,ada\n",
            "roster.csv:2: no column source; there are: id, sorce",
            "did you mean source?",
        ),
        ("id,source,id\na,b,c\n", "the column id is there twice", "rename"),
        ("id,source,x,x\na,b,c,d\n", "the column x is there twice", "rename"),
        ("id,source,Submitted At,submitted_at\na,b,,\n", "the column submitted_at is there twice", "rename"),
        ("id,source\n", "no submission in it", "a row"),
        (b"id,source\nada,ada\nzo\xeb,zoe\n", "roster.csv:3: not UTF-8 text", "CSV UTF-8"),
        (b"\xff\xfei\0d\0,\0s", "not UTF-16 text", "CSV UTF-8"),
        (b"PK\x03\x04xlsx", "workbook", "CSV UTF-8"),
        ('id,"source\na,b\n', "a quotation mark that never ends", "id,source"),
    ],
)
def test_what_is_no_roster(tmp_path: Path, text: str | bytes, message: str, hint: str) -> None:
    with pytest.raises(UsageError) as raised:
        read(tmp_path, text)
    assert message in raised.value.message
    assert hint in raised.value.hint


def test_an_archive_is_to_be_unpacked(tmp_path: Path) -> None:
    (tmp_path / "submissions.zip").write_bytes(b"PK\x03\x04")
    with pytest.raises(UsageError) as raised:
        read_roster(tmp_path / "submissions.zip")
    assert "unpack it first" in raised.value.hint
    with pytest.raises(UsageError) as raised:
        read_roster(tmp_path / "missing.csv")
    assert "No such file" in raised.value.message


UTC = timezone.utc


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("2026-11-20T23:59:00+01:00", datetime(2026, 11, 20, 22, 59, tzinfo=UTC)),
        ("2026-11-20T23:59:00Z", datetime(2026, 11, 20, 23, 59, tzinfo=UTC)),
        ("2026-11-20T23:59:00.123Z", datetime(2026, 11, 20, 23, 59, 0, 123000, tzinfo=UTC)),
        ("2026-11-20T23:59:00.123456789z", datetime(2026, 11, 20, 23, 59, 0, 123456, tzinfo=UTC)),
        ("2026-11-20 23:59:07,5 -0330", datetime(2026, 11, 21, 3, 29, 7, 500000, tzinfo=UTC)),
        ("2026-11-20 23:59 +01", datetime(2026, 11, 20, 22, 59, tzinfo=UTC)),
        (" 2026/11/20  9:05 UTC", datetime(2026, 11, 20, 9, 5, tzinfo=UTC)),
    ],
)
def test_times_with_a_zone(text: str, expected: datetime) -> None:
    assert parse_time(text) == expected
    assert time_fault(text) == ""


@pytest.fixture
def in_tokyo(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("TZ", "Asia/Tokyo")
    time.tzset()
    yield
    monkeypatch.undo()
    time.tzset()


@pytest.mark.parametrize(
    "text", ["2026-11-20 23:59", "2026-11-20T23:59", "2026-11-20 23:59:00", "2026/11/20 23:59"]
)
def test_times_without_a_zone_are_of_this_machine(text: str, in_tokyo) -> None:
    assert parse_time(text) == datetime(2026, 11, 20, 14, 59, tzinfo=UTC)
    assert parse_time(text).utcoffset() == timedelta(hours=9)


def test_a_day_begins_at_midnight(in_tokyo) -> None:
    assert parse_time("2026-11-20") == datetime(2026, 11, 19, 15, tzinfo=UTC)


@pytest.mark.parametrize(
    "text", ["20/11/2026 23:59", "11/20/2026", "20.11.2026 23:59", "5-6-26", "1/2/2026 3:04 PM"]
)
def test_what_could_be_two_days(text: str) -> None:
    assert parse_time(text) is None
    assert "the day or the month first: write it as 2026-11-20 23:59" in time_fault(text)


@pytest.mark.parametrize(
    "text",
    [
        "yesterday",
        "2026-11-20 24:00",
        "2026-13-01",
        "2026-11-20T23:59+25:00",
        "46346.99",
        "2026-11-20 11:59 PM",
        "2026-11-20 23:59 CET",
        "2026-11-20T",
        "0001-01-01 00:00 +14:00",
        "0000-01-01",
        "\uff12026-11-20",
    ],
)
def test_what_is_no_time(text: str) -> None:
    assert parse_time(text) is None
    assert "is not a time such as" in time_fault(text)


@pytest.mark.parametrize(
    ("text", "days"), [("2", 2), ("1.5", 1.5), ("1,5", 1.5), ("0", 0), ("+3", 3), ("3660", 3660)]
)
def test_days(text: str, days: float) -> None:
    assert parse_days(text) == days


@pytest.mark.parametrize("text", ["", "-1", "nan", "inf", "1e3", "1_0", "3661", "2 days", "\u0663", "0x1"])
def test_no_days(text: str) -> None:
    assert parse_days(text) is None
