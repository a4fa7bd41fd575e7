"""Where results lie on their way: what may be given, and what is deleted."""

from __future__ import annotations

from pathlib import Path

import pytest
from fsspec.implementations.local import LocalFileSystem

from grader.classes.cluster.worker import Exchange, check_url
from grader.errors import HostError, UsageError

WORD = "0123abcd"


@pytest.fixture
def exchange(tmp_path: Path) -> Exchange:
    made = Exchange(str(tmp_path / "exchange"))
    made.make()
    return made


def _file(folder: Path, content: bytes = b"results") -> Path:
    path = folder / "packed"
    path.write_bytes(content)
    return path


def _names(exchange: Exchange) -> list[str]:
    return sorted(path.name for path in Path(exchange.url).iterdir())


@pytest.mark.parametrize(
    ("url", "why"),
    [
        ("sftp://me:secret@host/results", "holds a password"),
        ("memory://results", "memory belongs to one process"),
        ("gopher://host/results", "gopher"),
        ("s3://[bucket/results", "Invalid IPv6 URL"),
    ],
)
def test_what_no_worker_can_reach_is_refused(url: str, why: str) -> None:
    with pytest.raises(UsageError, match=why) as caught:
        check_url(url)
    assert caught.value.hint
    assert "secret" not in caught.value.message + caught.value.hint


def test_a_path_becomes_absolute_and_a_url_stays(monkeypatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)
    assert check_url("results") == str(tmp_path / "results")
    assert check_url("file:///srv/results") == "file:///srv/results"


def test_every_attempt_has_a_name_of_its_own(exchange: Exchange, tmp_path: Path) -> None:
    first, second = (exchange.put(_file(tmp_path), "ada") for _ in range(2))
    assert first.name != second.name
    assert _names(exchange) == sorted([first.name, second.name])
    with exchange.open(first) as stream:
        assert stream.read() == b"results"


def test_one_attempt_is_deleted_and_no_other(exchange: Exchange, tmp_path: Path) -> None:
    first, second = (exchange.put(_file(tmp_path), "ada") for _ in range(2))
    exchange.delete(first)
    assert _names(exchange) == [second.name]


def test_what_an_earlier_batch_left_is_gone(exchange: Exchange, tmp_path: Path) -> None:
    exchange.put(_file(tmp_path), "ada")
    exchange.make()
    assert _names(exchange) == []
    exchange.remove()
    assert not Path(exchange.url).exists()


def test_a_folder_on_this_machine_is_its_owners_and_never_one_that_somebody_else_made(
    exchange: Exchange, tmp_path: Path, monkeypatch
) -> None:
    assert Path(exchange.url).stat().st_mode & 0o777 == 0o700
    monkeypatch.setattr(LocalFileSystem, "rm", lambda *_, **__: None)
    with pytest.raises(HostError, match="another program has just made it"):
        exchange.make()


def test_who_reads_the_word_is_at_the_same_place(exchange: Exchange, tmp_path: Path) -> None:
    assert not exchange.answers(WORD)
    exchange.greet(WORD)
    assert exchange.answers(WORD)
    assert not exchange.answers("another")
    assert not Exchange(str(tmp_path / "elsewhere")).answers(WORD)
    assert _names(exchange) == ["hello"]


def test_a_place_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    file = _file(tmp_path)
    with pytest.raises(HostError, match=f"the exchange {file}/below cannot be written") as caught:
        Exchange(f"{file}/below").make()
    assert "--exchange" in caught.value.hint
