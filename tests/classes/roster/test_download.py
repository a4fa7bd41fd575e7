"""The zip of all submissions, as Moodle and Canvas offer it for download."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path

import pytest

from grader.classes.fetching.obtain import source_of
from grader.classes.roster import read_roster
from grader.classes.roster.platforms import is_download, unpack_download
from grader.errors import UsageError
from tests.classes.roster.helpers import ids, said


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
