"""Files that are meant to do harm cost their own submission the comparison, and nobody else anything."""

from __future__ import annotations

import os
import re
from importlib import import_module
from typing import Any

import pytest

from grader.classes.similarity.sources import ProgramText, compare
from grader.workers import WorkerEnded
from tests.classes.similarity.classes import class_of, hand_in, solution

GOOD = solution("timed").encode()
FILES = {
    "one line of 20 MB": (b"x = 1; " * 3_000_000, "larger than 128 KiB"),
    "NULs": (b"print('a')\0\0\0", "not text"),
    "brackets": (b"(" * 40_000 + b"[{" * 10_000, ""),
    "no Python": ("def 🐍(: \ufeff if else \u202e\n".encode() * 500, ""),
    "no UTF-8": (b"\xff\xfe\xfa = 'caf\xe9'\n" * 1000, ""),
    "open strings": (b'"""' + b"'''\"" * 20_000, ""),
    "backslashes": (b"x = '" + b"\\" * 60_000, ""),
    "blanks": (b"from " + b" \t" * 30_000 + b"x", ""),
    "half an import": (b"from a import (" * 8_000, ""),
    "nothing": (b"", ""),
    "line ends": (b"\r\n\r\r\n\n" * 10_000, ""),
}


@pytest.fixture
def comparison() -> Any:
    """The module that loads copydetect and matplotlib, once a test needs it."""
    return import_module("grader.classes.similarity.comparison")


@pytest.mark.full
def test_such_files_are_read_or_named_and_the_rest_is_compared(tmp_path) -> None:
    """All in one submission, beside a copied program."""
    bad = {f"{name}.py": data for name, (data, _) in FILES.items()}
    folders = class_of(tmp_path, {"bad": bad | {"zz.py": GOOD}, "good": {"b.py": GOOD}})
    similarity = compare(folders)
    assert [(pair.a, pair.b, pair.similarity_b) for pair in similarity.pairs] == [("bad", "good", 1.0)]
    expected = {("bad", f"{name}.py", reason) for name, (_, reason) in FILES.items() if reason}
    assert {(one.id, one.file, one.reason) for one in similarity.not_compared} == expected


@pytest.mark.full
def test_evidence_of_fifty_megabytes_on_one_line_is_named(tmp_path) -> None:
    folders = class_of(tmp_path, {"bad": {"a.py": b"x = 1; " * 7_500_000}, "good": {"b.py": GOOD}})
    similarity = compare(folders)
    assert similarity.compared == 1
    assert [one.id for one in similarity.not_compared] == ["bad"]


def test_a_regular_expression_without_end_is_interrupted(comparison, monkeypatch) -> None:
    def stuck(path: str, code: str, language: str) -> None:
        re.match(r"(a+)+$", "a" * 60 + "b")

    monkeypatch.setattr(comparison, "FILE_S", 0.2)
    monkeypatch.setattr(comparison, "read_text", stuck)
    read = comparison.read_files(
        comparison.CodeSource(name="ann"), (ProgramText(path="a.py", code="", language="python"),)
    )
    assert [(one.file, one.reason) for one in read.left_out] == [("a.py", "took longer than 0.2 s to read")]


@pytest.mark.parametrize(
    ("harm", "reason"),
    [
        (lambda *_: bytearray(1 << 60), "takes too much memory to read"),
        (lambda *_: 1 / 0, "could not be read: ZeroDivisionError"),
    ],
)
def test_what_harms_the_reader_is_said(comparison, tmp_path, monkeypatch, harm, reason) -> None:
    """What ends it costs its own submission alone: tests/test_workers.py."""
    monkeypatch.setattr(comparison, "read_submission", harm)
    place = comparison.CodeSource(name="bad", folder=tmp_path)
    assert [one.reason for one in comparison.read_place(place).left_out] == [reason]
    ended = comparison.reading_ended(place, WorkerEnded("ended by signal 9"))
    assert [(one.id, one.reason) for one in ended.left_out] == [
        ("bad", "reading it took too long or too much memory")
    ]


@pytest.mark.full
def test_evidence_that_cannot_be_read_is_named(tmp_path) -> None:
    good = {"b.py": GOOD}
    folders = class_of(tmp_path, dict.fromkeys(("cut", "gone", "linked", "one", "two"), good))
    place = {name: folder / "evidence" / "package.mcap" for name, folder in folders.items()}
    place["cut"].write_bytes(place["cut"].read_bytes()[:200])
    place["gone"].unlink()
    place["linked"].unlink()
    place["linked"].symlink_to(place["one"])
    folders["nowhere"] = tmp_path / "nowhere"
    folders["link"] = tmp_path / "link"
    folders["link"].symlink_to(folders["one"])
    similarity = compare(folders)
    assert [(pair.a, pair.b) for pair in similarity.pairs] == [("one", "two")]
    assert {one.id for one in similarity.not_compared} == {"cut", "gone", "linked", "link", "nowhere"}
    assert all(one.reason and str(tmp_path) not in one.reason for one in similarity.not_compared)


@pytest.mark.full
def test_a_pipe_in_the_evidences_place_keeps_nobody_waiting(tmp_path) -> None:
    (tmp_path / "ann" / "evidence").mkdir(parents=True)
    os.mkfifo(tmp_path / "ann" / "evidence" / "package.mcap")
    (one,) = compare({"ann": tmp_path / "ann"}).not_compared
    assert one.reason == "its evidence cannot be opened: not a regular file"


@pytest.mark.full
def test_too_many_and_too_large_programs_are_named(tmp_path) -> None:
    files = {f"p{n:03}.py": f"x{n} = {n}\n".encode() for n in range(250)}
    large = {f"z{n}.py": b"# much text\n" * 10_000 for n in range(6)}
    similarity = compare(
        {name: hand_in(tmp_path / name, of) for name, of in (("ann", files), ("ben", large))}
    )
    reasons = {(one.id, one.reason) for one in similarity.not_compared}
    assert reasons == {
        ("ann", "more than 200 programs"),
        ("ben", "the submission's programs are larger than 512 KiB together"),
    }


@pytest.mark.full
def test_no_program_is_said(tmp_path) -> None:
    (one,) = compare({"ann": hand_in(tmp_path / "ann", {"package.xml": b"<package/>"})}).not_compared
    assert one.reason == "holds no program in Python or C++"


@pytest.mark.full
def test_a_class_with_too_much_code_is_compared_as_far_as_there_is_room(
    comparison, tmp_path, monkeypatch
) -> None:
    monkeypatch.setattr(comparison, "PRINTS_MAX", 700)
    folders = class_of(tmp_path, {name: {"a.py": GOOD} for name in ("ann", "ben", "cem")})
    similarity = comparison.compare_class(folders, (), {}, threshold=0.8, jobs=1)
    assert [(pair.a, pair.b) for pair in similarity.pairs] == [("ann", "ben")]
    assert [(one.id, one.reason[:24]) for one in similarity.not_compared] == [
        ("cem", "the class has too much c")
    ]
