"""A folder of results on its way: as it was, or not at all."""

from __future__ import annotations

import hashlib
import io
import tarfile
from collections.abc import Callable
from pathlib import Path

import pytest

from grader.classes.cluster import worker
from grader.classes.cluster.worker import Parcel, pack, unpack
from grader.errors import HostError


def _parcel(content: bytes) -> Parcel:
    return Parcel(name="ada.0.tar.gz", size=len(content), sha256=hashlib.sha256(content).hexdigest())


def _tar(*members: tarfile.TarInfo) -> bytes:
    made = io.BytesIO()
    with tarfile.open(fileobj=made, mode="w:gz") as archive:
        for member in members:
            archive.addfile(member, io.BytesIO(b"x" * member.size))
    return made.getvalue()


def _member(name: str, **more: object) -> tarfile.TarInfo:
    member = tarfile.TarInfo(name)
    for key, value in more.items():
        setattr(member, key, value)
    return member


def test_a_folder_comes_back_as_it_was(tmp_path: Path) -> None:
    folder, back = tmp_path / "ada", tmp_path / "back"
    (folder / "evidence").mkdir(parents=True)
    (folder / "evidence" / "talker.mcap").write_bytes(bytes(range(256)) * 4000)
    (folder / "result.json").write_text("{}")
    (folder / ".grader-new").mkdir()
    packed = tmp_path / "packed"
    pack(folder, packed)
    content = packed.read_bytes()
    back.mkdir()
    unpack(io.BytesIO(content), _parcel(content), back)
    assert sorted(str(p.relative_to(back)) for p in back.rglob("*")) == [
        "evidence",
        "evidence/talker.mcap",
        "result.json",
    ]
    assert (back / "evidence" / "talker.mcap").read_bytes() == bytes(range(256)) * 4000


@pytest.mark.parametrize(
    "member",
    [
        _member("../outside"),
        _member("/tmp/outside"),
        _member("evidence/../../outside"),
        _member("link", type=tarfile.SYMTYPE, linkname="/etc"),
        _member("hard", type=tarfile.LNKTYPE, linkname="result.json"),
        _member("pipe", type=tarfile.FIFOTYPE),
        _member("disk", type=tarfile.BLKTYPE),
    ],
    ids=lambda member: member.name,
)
def test_nothing_leads_out_of_the_folder(member: tarfile.TarInfo, tmp_path: Path) -> None:
    content = _tar(_member("result.json"), member)
    back = tmp_path / "in" / "back"
    back.mkdir(parents=True)
    if member.name.startswith("/"):
        unpack(io.BytesIO(content), _parcel(content), back)
    else:
        with pytest.raises(HostError, match="cannot be unpacked"):
            unpack(io.BytesIO(content), _parcel(content), back)
    found = [path for path in tmp_path.rglob("*") if not path.is_relative_to(back) and path.is_file()]
    assert found == []
    assert not Path("/tmp/outside").exists()
    assert not any(path.is_symlink() for path in back.rglob("*"))


@pytest.mark.parametrize(
    "harm",
    [
        lambda content: content[:-20],
        lambda content: content[:20],
        lambda content: content + b"more",
        lambda content: content[:0],
        lambda content: b"<html>not found</html>".ljust(len(content), b" ")[: len(content)],
        lambda content: content[:40] + bytes([content[40] ^ 1]) + content[41:],
    ],
    ids=["cut off", "hardly begun", "longer", "empty", "something else", "one bit"],
)
def test_what_was_not_sent_is_refused(harm: Callable[[bytes], bytes], tmp_path: Path) -> None:
    content = _tar(_member("result.json", size=4000))
    with pytest.raises(HostError, match=r"ada\.0\.tar\.gz cannot be unpacked"):
        unpack(io.BytesIO(harm(content)), _parcel(content), tmp_path)


def test_more_than_results_ever_are_is_refused(tmp_path: Path, monkeypatch) -> None:
    content = _tar(*(_member(f"{number}", size=100) for number in range(20)))
    monkeypatch.setattr(worker, "ENTRIES", 19)
    with pytest.raises(HostError, match="more than results ever are"):
        unpack(io.BytesIO(content), _parcel(content), tmp_path)
    monkeypatch.setattr(worker, "ENTRIES", 20)
    monkeypatch.setattr(worker, "UNPACKED_BYTES", 1999)
    with pytest.raises(HostError, match="more than results ever are"):
        unpack(io.BytesIO(content), _parcel(content), tmp_path)
