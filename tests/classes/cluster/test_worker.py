"""What a worker does, without a cluster, and a folder of results on its way: as it was, or not at all."""

from __future__ import annotations

import asyncio
import hashlib
import io
import os
import socket
import tarfile
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from grader.classes.cluster import worker
from grader.classes.cluster.worker import Exchange, GradeRequest, PackedFolder, pack, unpack
from grader.errors import HostError
from tests.classes.cluster.jobs import named_job
from tests.support.processes import children_of, lives, until

WORD = "0123abcd"


@pytest.fixture
def exchange(tmp_path: Path) -> Iterator[Exchange]:
    made = Exchange(str(tmp_path / "exchange"))
    made.make()
    yield made
    asyncio.run(worker.dismiss(WORD))


def _request(exchange: Exchange, tmp_path: Path, *, source: str = "", seen: bool = True) -> GradeRequest:
    job = named_job(tmp_path / "out", "ada")
    if source:
        job = job.model_copy(update={"entry": job.entry.model_copy(update={"source": source})})
    return GradeRequest(job=job, exchange=exchange.url, batch=WORD, seen=seen)


@pytest.mark.full
def test_it_leaves_one_packed_folder_and_nothing_in_the_batchs_folder(
    exchange: Exchange, tmp_path: Path
) -> None:
    report = worker.grade(_request(exchange, tmp_path), lambda: True)
    assert report.outcome.status == "inconclusive"
    assert report.packed is not None
    assert [path.name for path in Path(exchange.url).iterdir()] == [report.packed.name]
    assert not (tmp_path / "out").exists()


def test_a_path_that_only_the_client_sees_is_the_machines_fault(exchange: Exchange, tmp_path: Path) -> None:
    with pytest.raises(HostError, match=r"/only/there/ada\.zip cannot be seen on ") as caught:
        worker.grade(_request(exchange, tmp_path, source="/only/there/ada.zip"), lambda: True)
    assert "a path that all machines share" in caught.value.hint


@pytest.mark.full
def test_a_path_that_nobody_sees_is_the_submissions(exchange: Exchange, tmp_path: Path) -> None:
    report = worker.grade(_request(exchange, tmp_path, source="/nowhere/ada", seen=False), lambda: True)
    assert (report.outcome.status, report.outcome.kind) == ("error", "submission")
    assert report.packed is not None


@pytest.mark.full
def test_what_nobody_wants_any_more_is_not_delivered(exchange: Exchange, tmp_path: Path) -> None:
    report = worker.grade(_request(exchange, tmp_path), lambda: False)
    assert report.packed is None
    assert list(Path(exchange.url).iterdir()) == []


@pytest.mark.full
def test_an_exchange_that_cannot_be_written_is_said_with_the_machines_name(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("no folder")
    with pytest.raises(HostError, match=rf"cannot be written: .* \(on {socket.gethostname()}\)"):
        worker.grade(_request(Exchange(str(tmp_path / "file")), tmp_path), lambda: True)
    asyncio.run(worker.dismiss(WORD))


def test_dismissed_it_interrupts_what_runs_and_ends_its_processes(exchange: Exchange, tmp_path: Path) -> None:
    before = set(children_of(os.getpid()))
    found = []
    thread = threading.Thread(
        target=lambda: found.append(worker.grade(_request(exchange, tmp_path), lambda: True))
    )
    thread.start()
    until(lambda: set(children_of(os.getpid())) - before)
    asyncio.run(worker.dismiss(WORD))
    thread.join()
    assert [report.packed for report in found] == [None]
    assert set(children_of(os.getpid())) <= before


@pytest.mark.full
def test_a_process_serves_many_jobs_and_is_ended_when_it_has_none(
    exchange: Exchange, tmp_path: Path, monkeypatch
) -> None:
    before = set(children_of(os.getpid()))
    monkeypatch.setattr(worker, "IDLE_S", 5.0)
    worker.grade(_request(exchange, tmp_path), lambda: True)
    first = set(children_of(os.getpid())) - before
    worker.grade(_request(exchange, tmp_path), lambda: True)
    assert len(first) == 1
    assert set(children_of(os.getpid())) - before == first
    until(lambda: not any(lives(pid) for pid in first))


def test_it_says_who_it_is(exchange: Exchange) -> None:
    exchange.greet(WORD)
    said = asyncio.run(worker.describe(exchange.url, WORD))
    assert said["kept_out"] == ""
    assert {name: said[name] for name in worker.versions()} == worker.versions()
    assert "is a different place there" in asyncio.run(worker.describe(exchange.url, "another"))["kept_out"]


def _packed(content: bytes) -> PackedFolder:
    return PackedFolder(name="ada.0.tar.gz", size=len(content), sha256=hashlib.sha256(content).hexdigest())


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
    unpack(io.BytesIO(content), _packed(content), back)
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
        unpack(io.BytesIO(content), _packed(content), back)
    else:
        with pytest.raises(HostError, match="cannot be unpacked"):
            unpack(io.BytesIO(content), _packed(content), back)
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
        unpack(io.BytesIO(harm(content)), _packed(content), tmp_path)


def test_more_than_results_ever_are_is_refused(tmp_path: Path, monkeypatch) -> None:
    content = _tar(*(_member(f"{number}", size=100) for number in range(20)))
    monkeypatch.setattr(worker, "ENTRIES", 19)
    with pytest.raises(HostError, match="more than results ever are"):
        unpack(io.BytesIO(content), _packed(content), tmp_path)
    monkeypatch.setattr(worker, "ENTRIES", 20)
    monkeypatch.setattr(worker, "UNPACKED_BYTES", 1999)
    with pytest.raises(HostError, match="more than results ever are"):
        unpack(io.BytesIO(content), _packed(content), tmp_path)
