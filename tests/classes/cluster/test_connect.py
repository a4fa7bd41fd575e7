"""What `--cluster` may say, what a user reads where nothing answers, and which workers may grade."""

from __future__ import annotations

import socket
import sys
import threading
from pathlib import Path

import pytest

from grader.classes.cluster import connect
from grader.classes.cluster.connect import Answer, GradingWorkers, Needs, check_address, why_not
from grader.classes.cluster.executor import ClusterExecutor
from grader.errors import HostError, UsageError
from tests.classes.cluster.jobs import jobs_for
from tests.support.processes import until


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


VERSIONS = {"grader": "1.0", "code": "1f2e", "python": "3.11", "pydantic": "2.7.0"}
GOOD = {**VERSIONS, "host": "node1", "ros": "noetic", "kept_out": ""}
NEEDS = Needs(versions=VERSIONS, ros=True)
A, B = "tcp://10.0.0.1:1", "tcp://10.0.0.2:1"


@pytest.mark.parametrize(
    ("answer", "why"),
    [
        (GOOD, ""),
        ({**GOOD, "grader": "0.9"}, "it has grader 0.9, here it is 1.0"),
        ({**GOOD, "code": "9a8b"}, "its grader has other files than this one"),
        ({**GOOD, "python": "3.10"}, "it has python 3.10, here it is 3.11"),
        ({**GOOD, "pydantic": "2.6.0"}, "it has pydantic 2.6.0, here it is 2.7.0"),
        ({"host": "node1"}, "it has grader of no version, here it is 1.0"),
        ({**GOOD, "ros": ""}, "no ROS 1 there"),
        ({**GOOD, "kept_out": "/srv/out is a different place there"}, "/srv/out is a different place there"),
        (ModuleNotFoundError("No module named 'grader'"), "no grader like this one is installed there"),
        (Exception("ModuleNotFoundError(\"No module named 'grader'\")"), "no grader like this one"),
        (ValueError("broken"), "it cannot answer: ValueError: broken"),
    ],
)
def test_a_worker_that_differs_is_told_why(answer: Answer, why: str) -> None:
    assert answer is not None
    said = why_not(answer, NEEDS)
    assert said.startswith(why)
    assert bool(said) == bool(why)


def test_without_anything_to_run_no_ros_is_asked_for() -> None:
    assert why_not({**GOOD, "ros": ""}, Needs(versions=VERSIONS, ros=False)) == ""


class _Cluster:
    """A client whose workers have `threads`, and answer what `says` holds for them."""

    def __init__(self, says: dict[str, Answer]) -> None:
        self.says, self.threads, self.lines = says, {}, []
        self.grading_workers = GradingWorkers(self, "/exchange", "0123", NEEDS, self.lines.append)

    def nthreads(self) -> dict[str, int]:
        return dict(self.threads)

    def run(self, _function, *_args, workers: list[str], on_error: str) -> dict[str, Answer]:
        assert on_error == "return"
        return {address: self.says[address] for address in workers if self.says[address] is not None}

    def look(self, threads: dict[str, int], answers: int) -> dict[str, int]:
        """The workers that can grade, once all have answered."""
        self.threads = threads
        self.grading_workers.look()
        until(lambda: self.grading_workers._answers.qsize() == answers)
        self.grading_workers.take_answers()
        return self.grading_workers.fit


@pytest.mark.parametrize(
    ("address", "fits"), [("tls://10.0.0.1:1", True), (A, False), ("ucx://10.0.0.1:1", False)]
)
def test_if_certificates_are_asked_for_a_worker_without_is_left_out(address: str, fits: bool) -> None:
    cluster = _Cluster({address: GOOD})
    cluster.grading_workers._needs = Needs(versions=VERSIONS, ros=True, encrypted=True)
    assert (cluster.look({address: 4}, 1) == {address: 4}) is fits
    assert any("listens without certificates" in line for line in cluster.lines) is not fits


def test_workers_come_and_go() -> None:
    cluster = _Cluster({A: GOOD, B: GOOD})
    assert cluster.look({A: 4}, 1) == {A: 4}
    assert cluster.look({A: 4, B: 2}, 1) == {A: 4, B: 2}
    assert cluster.grading_workers.threads == 6
    assert cluster.look({B: 2}, 0) == {B: 2}
    assert cluster.look({A: 4, B: 2}, 1) == {A: 4, B: 2}


def test_one_that_is_left_out_is_named_once_and_asked_again_when_it_comes_back() -> None:
    cluster = _Cluster({A: {**GOOD, "grader": "0.9"}})
    assert cluster.look({A: 4}, 1) == {}
    assert cluster.look({A: 4}, 0) == {}
    assert cluster.lines == [f"this worker is left out: {A} (node1): it has grader 0.9, here it is 1.0"]
    assert cluster.look({}, 0) == {}
    cluster.says[A] = GOOD
    assert cluster.look({A: 4}, 1) == {A: 4}
    assert cluster.grading_workers.asked == 0


@pytest.mark.parametrize("lost", [None, OSError("in <closed TCP>: Stream is closed")])
def test_one_that_was_lost_while_it_was_asked_is_asked_again(lost: Answer) -> None:
    cluster = _Cluster({A: lost})
    assert cluster.look({A: 4}, 1) == {}
    cluster.says[A] = GOOD
    assert cluster.look({A: 4}, 1) == {A: 4}


def test_an_answer_that_comes_after_its_worker_has_gone_counts_for_nothing() -> None:
    cluster = _Cluster({A: GOOD})
    cluster.threads = {A: 4}
    cluster.grading_workers.look()
    assert cluster.look({}, 1) == {}
