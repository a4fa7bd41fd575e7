"""What `--cluster` may say, and what a user reads where nothing answers."""

from __future__ import annotations

import socket
import sys
import threading
from pathlib import Path

import pytest

from grader.classes.cluster import ClusterExecutor, connect
from grader.classes.cluster.connect import check_address
from grader.errors import HostError, UsageError
from tests.classes.cluster.jobs import jobs_for


@pytest.mark.parametrize(
    "address",
    [
        "tcp://host:8786",
        "tls://node-1.cluster:8786",
        "tcp://10.0.0.7:1",
        "tcp://[::1]:8786",
        "tcp://host:8786/",
        "local",
    ],
)
def test_addresses(address: str) -> None:
    assert check_address(address, insecure=True) == address


@pytest.mark.parametrize("address", ["local", "tls://host:8786", "wss://host:8786"])
def test_where_certificates_are_asked_for_no_flag_is_needed(address: str) -> None:
    assert check_address(address) == address


@pytest.mark.parametrize("scheme", ["tcp", "ws", "ucx"])
def test_a_cluster_that_asks_for_no_certificate_is_refused_without_the_flag(
    scheme: str, tmp_path: Path
) -> None:
    with pytest.raises(UsageError, match="asks for no certificate") as caught:
        ClusterExecutor(f"{scheme}://host:8786", tmp_path / "out")
    assert "--cluster-insecure" in caught.value.hint
    assert "tls://" in caught.value.hint


@pytest.mark.parametrize(
    "address",
    ["", "host", "host:8786", "tcp://host", "tcp://:8786", "http://host:8786", "tcp://a b:8786", "tcp://host:port",
     "tcp://me:secret@host:8786", "localhost", "tcp://host:8786\n", "\x1b[31m"],
)  # fmt: skip
def test_what_is_no_address_is_refused_before_anything_is_done(address: str, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="not the address of a Dask scheduler") as caught:
        ClusterExecutor(address, tmp_path / "out")
    assert "tls://host:8786" in caught.value.hint
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("missing", ["distributed", "cryptography"])
def test_without_dask_it_says_what_to_install(missing: str, monkeypatch) -> None:
    monkeypatch.setitem(sys.modules, missing, None)
    with pytest.raises(UsageError, match="needs Dask") as caught:
        check_address("local")
    assert "'distributed>=" in caught.value.hint


def _refusal(address: str, out: Path) -> HostError:
    executor = ClusterExecutor(address, out, insecure=True)
    with pytest.raises(HostError) as caught:
        list(executor.run(jobs_for(out, 1), begun=lambda _: None))
    assert "\n" not in caught.value.message
    assert "dask scheduler" in caught.value.hint
    assert not out.exists()
    return caught.value


@pytest.mark.full
def test_where_nothing_answers_one_line_says_so(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr(connect, "CONNECT_S", 0.5)
    with socket.create_server(("127.0.0.1", 0)) as closed:
        address = f"tcp://127.0.0.1:{closed.getsockname()[1]}"
    assert f"no Dask scheduler answers at {address}" in _refusal(address, tmp_path / "out").message
    with socket.create_server(("127.0.0.1", 0)) as silent:
        address = f"tcp://127.0.0.1:{silent.getsockname()[1]}"
        assert f"no Dask scheduler answers at {address}" in _refusal(address, tmp_path / "out").message


@pytest.mark.parametrize(
    "says", [b"SSH-2.0-OpenSSH_9.2p1\r\n", b"HTTP/1.1 400 Bad Request\r\n\r\n", b"\0" * 64]
)
def test_where_something_else_answers_one_line_says_so(says: bytes, tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr(connect, "CONNECT_S", 2.0)
    with socket.create_server(("127.0.0.1", 0)) as server:
        address = f"tcp://127.0.0.1:{server.getsockname()[1]}"

        def serve() -> None:
            while True:
                try:
                    connection, _ = server.accept()
                except OSError:
                    return
                with connection:
                    connection.sendall(says)
                    connection.recv(1)

        thread = threading.Thread(target=serve, daemon=True)
        thread.start()
        assert address in _refusal(address, tmp_path / "out").message
        server.shutdown(socket.SHUT_RDWR)
    thread.join()


def test_a_tls_address_without_certificates_says_where_they_go(tmp_path: Path) -> None:
    executor = ClusterExecutor("tls://127.0.0.1:8786", tmp_path / "out")
    with pytest.raises(HostError) as caught:
        list(executor.run(jobs_for(tmp_path / "out", 1), begun=lambda _: None))
    assert "needs certificates" in caught.value.message
    assert "DASK_DISTRIBUTED__COMM__TLS__CA_FILE" in caught.value.hint


def test_no_jobs_need_no_cluster(tmp_path: Path) -> None:
    executor = ClusterExecutor("tls://127.0.0.1:1", tmp_path / "out")
    assert list(executor.run(iter(()), begun=lambda _: None)) == []
