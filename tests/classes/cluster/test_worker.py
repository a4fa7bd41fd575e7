"""What a worker does, without a cluster."""

from __future__ import annotations

import asyncio
import os
import socket
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from grader.classes.cluster import worker
from grader.classes.cluster.worker import Exchange, GradeRequest
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
def test_it_leaves_one_parcel_and_nothing_in_the_batchs_folder(exchange: Exchange, tmp_path: Path) -> None:
    report = worker.grade(_request(exchange, tmp_path), lambda: True)
    assert report.outcome.status == "inconclusive"
    assert report.parcel is not None
    assert [path.name for path in Path(exchange.url).iterdir()] == [report.parcel.name]
    assert not (tmp_path / "out").exists()


def test_a_path_that_only_the_client_sees_is_the_machines_fault(exchange: Exchange, tmp_path: Path) -> None:
    with pytest.raises(HostError, match=r"/only/there/ada\.zip cannot be seen on ") as caught:
        worker.grade(_request(exchange, tmp_path, source="/only/there/ada.zip"), lambda: True)
    assert "a path that all machines share" in caught.value.hint


@pytest.mark.full
def test_a_path_that_nobody_sees_is_the_submissions(exchange: Exchange, tmp_path: Path) -> None:
    report = worker.grade(_request(exchange, tmp_path, source="/nowhere/ada", seen=False), lambda: True)
    assert (report.outcome.status, report.outcome.kind) == ("error", "submission")
    assert report.parcel is not None


@pytest.mark.full
def test_what_nobody_wants_any_more_is_not_delivered(exchange: Exchange, tmp_path: Path) -> None:
    report = worker.grade(_request(exchange, tmp_path), lambda: False)
    assert report.parcel is None
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
    assert [report.parcel for report in found] == [None]
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
