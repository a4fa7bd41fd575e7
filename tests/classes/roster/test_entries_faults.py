"""Every fault of a roster by its line, all at once; the other students are read."""

from __future__ import annotations

from pathlib import Path

import pytest

from grader.classes.roster.entries import OUT
from grader.model.batch import RosterFault
from tests.classes.roster.helpers import ids, read, said

FAULTY = (
    "id,source,submitted_at,extension_days\n"
    ",d,,\n"
    "bob,,,\n"
    "cem,../../secret,,\n"
    "dan,d,yesterday,many\n"
    "eva,d,20/11/2026 23:59,\n"
    "fay,d,,-1\n"
    'gil,"a\nb",,\n'
    "HUI,d,,\n"
    "hui,d,,\n"
    "ida,d,,,,more\n"
    "jan,d,2026-01-01,1.5\n"
    "kim,handed-in/kim.zip,,\n"
    "lea,\\\\server\\share\\lea,,\n"
    "max,C:/Users/max,,\n"
    "noa,github.com/noa/lab1,,\n"
    "!!!,d,,\n"
    f"{'o' * 256},d,,\n"
    "pia,p\0a,,\n"
    '"q\nr",d,,\n'
    "hui,,,\n"
)


def test_every_fault_by_its_line(tmp_path: Path) -> None:
    (tmp_path / "d").mkdir()
    roster = read(tmp_path, FAULTY)
    assert said(roster) == [
        "roster.csv:2: no id",
        "roster.csv:3: no source",
        f"roster.csv:4: source: ../../secret {OUT}",
        "roster.csv:5: submitted_at: yesterday is not a time such as 2026-11-20 23:59 or 2026-11-20T23:59:00+01:00",
        "roster.csv:5: extension_days: many is not a number of days",
        (
            "roster.csv:6: submitted_at: 20/11/2026 23:59 could be read with the day or the month first: "
            "write it as 2026-11-20 23:59"
        ),
        "roster.csv:7: extension_days: -1 is not a number of days",
        "roster.csv:8: source: a\\nb does not exist",
        "roster.csv:11: id: hui is there already, in roster.csv:10",
        "roster.csv:12: 6 fields, but the first line names 4 columns",
        "roster.csv:14: source: handed-in/kim.zip does not exist",
        (
            "roster.csv:15: source: \\\\server\\share\\lea is a path of Windows: "
            "write it with / as it is on this machine"
        ),
        "roster.csv:16: source: C:/Users/max is a path of Windows: write it with / as it is on this machine",
        "roster.csv:17: source: github.com/noa/lab1 does not exist; a web address begins with https://",
        "roster.csv:18: id: !!! has no letter and no digit",
        f"roster.csv:19: id: {'o' * 60}...{'o' * 60} is longer than a file's name may be (255 bytes)",
        "roster.csv:20: a zero byte in it",
        "roster.csv:21: id: q\\nr has a line end or a control character in it",
        "roster.csv:23: no source",
        "roster.csv:23: id: hui is there already, in roster.csv:10",
    ]
    assert ids(roster) == ["HUI", "jan"]


def test_a_fault_carries_the_id_that_no_other_row_has(tmp_path: Path) -> None:
    roster = read(tmp_path, "id,source\nada,\nbob,\nBOB,ssh://h/b\n,\n!,\ncem,ssh://h/c,x\n")
    assert [(fault.where, fault.id) for fault in roster.faults] == [
        ("roster.csv:2", "ada"),
        ("roster.csv:3", None),
        ("roster.csv:4", None),
        ("roster.csv:6", None),
        ("roster.csv:6", None),
        ("roster.csv:7", "cem"),
    ]


def test_a_row_whose_fields_are_shifted_tells_its_id_only_from_the_first_column(tmp_path: Path) -> None:
    roster = read(tmp_path, "name,id,source\nLovelace, Ada,ada,ssh://h/a\nBob,bob,ssh://h/b\n")
    text = "4 fields, but the first line names 3 columns"
    assert roster.faults == (RosterFault(where="roster.csv:2", text=text),)
    assert ids(roster) == ["bob"]


def test_a_column_that_is_nearly_one_that_is_known(tmp_path: Path) -> None:
    roster = read(tmp_path, "id,source,extention_days,Submited At,fname,notes\nada,ssh://h/a,2,x,A,n\n")
    assert said(roster) == [
        "roster.csv:1: the column extention_days is not known here: did you mean extension_days?",
        "roster.csv:1: the column Submited At is not known here: did you mean submitted_at?",
    ]
    assert roster.columns == ("extention_days", "Submited At", "fname", "notes")
    assert roster.entries[0].extra == {"extention_days": "2", "Submited At": "x", "fname": "A", "notes": "n"}


def test_a_column_beside_the_one_that_is_known_is_meant_so(tmp_path: Path) -> None:
    assert read(tmp_path, "id,source,name,names,SID\nada,ssh://h/a,,,\n").faults == ()


def test_a_quote_that_never_ends_costs_one_row(tmp_path: Path) -> None:
    roster = read(tmp_path, 'id,source\nada,ssh://h/a\nbob,"bob\ncem,ssh://h/c\ndan,"a"b\neva,ssh://h/e\n')
    assert ids(roster) == ["ada", "cem", "eva"]
    assert said(roster) == [
        "roster.csv:3: a quotation mark that does not end where its field ends",
        "roster.csv:5: a quotation mark that does not end where its field ends",
    ]


def test_a_quote_that_never_ends_in_the_last_row(tmp_path: Path) -> None:
    roster = read(tmp_path, 'id,source\nada,ssh://h/a\nbob,"ssh://h/b\ncem,ssh://h/c\n')
    assert ids(roster) == ["ada", "cem"]
    assert said(roster) == ["roster.csv:3: a quotation mark that never ends"]
    assert roster.faults[0].id == "bob"


def test_a_row_with_a_bad_source_keeps_its_name_group_and_mail(tmp_path: Path) -> None:
    fault = read(tmp_path, "id,name,group,source,Email\nada,Ada L,two,nowhere/at/all,a@x.edu\n").faults[0]
    assert (fault.id, fault.name, fault.group, fault.extra) == ("ada", "Ada L", "two", {"Email": "a@x.edu"})


def test_quotes_without_end_in_every_row_are_told_up_to_a_limit(tmp_path: Path) -> None:
    roster = read(tmp_path, "id,source\n" + '"a","b"c\n' * 100)
    assert len(roster.faults) == 51
    assert (
        said(roster)[-1] == "roster.csv:52: too many rows that cannot be read before it: the rest is left out"
    )


def test_a_link_out_of_the_folder(tmp_path: Path) -> None:
    (tmp_path / "class").mkdir()
    (tmp_path / "class" / "out").symlink_to("/etc")
    (tmp_path / "class" / "round").symlink_to("round")
    text = "id,source\nada,out/passwd\nbob,round/x\ncem," + "c" * 5000 + "\n"
    faults = said(read(tmp_path / "class", text))
    assert faults[0] == f"roster.csv:2: source: out/passwd {OUT}"
    assert [fault.split(":")[1] for fault in faults] == ["2", "3", "4"]


@pytest.mark.parametrize("ref", ["--upload-pack=x", "a b", "a..b", "x~1", "end/", "a:b"])
def test_what_can_be_no_ref(tmp_path: Path, ref: str) -> None:
    roster = read(tmp_path, f"id,source,ref\nada,ssh://h/a,{ref}\nbob,ssh://h/b,v1.0/x\n")
    assert ids(roster) == ["bob"]
    assert said(roster) == [f"roster.csv:2: ref: {ref} cannot be the name of a branch, tag or commit"]


@pytest.mark.parametrize(
    ("source", "ref"),
    [
        ("https://ada:s3cret@host/a", "-x"),
        ("https:/ada:s3cret@host/a", ""),
        ("https:s3cret@host/a", ""),
        ("x/ada:s3cret@host/a", ""),
        ("C:\\ada:s3cret@host/a", ""),
        ("../ada:s3cret@host/a", ""),
    ],
)
def test_no_password_is_told(tmp_path: Path, source: str, ref: str) -> None:
    roster = read(tmp_path, f"id,source,ref\nada,{source},{ref}\n")
    assert len(roster.faults) == 1
    assert "s3cret" not in said(roster)[0]


def test_an_address_with_one_slash(tmp_path: Path) -> None:
    roster = read(tmp_path, "id,source\nada,https:/github.com/c/ada\n")
    (fault,) = said(roster)
    assert fault.endswith(
        "https:/github.com/c/ada: an address has two slashes after its colon, as in https://"
    )


@pytest.mark.parametrize("package", ["a\x1b[2J", '"a\nb"', "x" * 256])
def test_what_can_be_no_package_s_name(package: str, tmp_path: Path) -> None:
    (tmp_path / "d").mkdir()
    (fault,) = said(read(tmp_path, f"id,source,package\nada,d,{package}\n"))
    assert fault.startswith("roster.csv:2: package: ")
    assert fault.endswith("cannot be a package's name")
    assert "\x1b" not in fault
    assert "\n" not in fault
