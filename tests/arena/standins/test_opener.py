"""The stand-in for browsers: what it tells, and that nothing can stop it."""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from xmlrpc.server import SimpleXMLRPCServer

import pytest

from grader.arena.sandbox_files import ASKING, BROWSERS, ROS_SIDE
from grader.arena.session import ARENA
from tests.arena.support import require_ros

URL = "https://www.e-yantra.org/"
NOTE = """
import json, sys
from guard import Guard
from master import ARGUMENT_CHARS, ARGUMENTS_MAX, OPENED_MAX, RecordingMaster
events = []
class Wire:
    def event(self, topic, record): events.append((topic, record))
class Owners:
    tell = None
master = RecordingMaster(None, Wire(), None, "/grader", guard=Guard(Wire()), owners=Owners())
print(ARGUMENT_CHARS, ARGUMENTS_MAX, OPENED_MAX, file=sys.stderr)
for number in range(OPENED_MAX + 5):
    answer = master.noteOpened("/firefox", "firefox", ["x" * 9999] * 99)
events = [event for event in events if event[1].get("action") == "open"]
print(json.dumps([answer, len(events), len(events[0][1]["value"]), len(events[0][1]["value"][0]), events[0][0]]))
"""


@pytest.fixture
def shims(tmp_path: Path) -> Path:
    """A folder as the sandbox's `bin/` is."""
    folder = tmp_path / "bin"
    folder.mkdir()
    (folder / "grader-open").write_bytes((ROS_SIDE / "open.sh").read_bytes())
    (folder / "grader-open").chmod(0o755)
    (folder / "grader-open.py").write_bytes((ROS_SIDE / "opener.py").read_bytes())
    (folder / "python3").symlink_to(sys.executable)
    (folder / "grader-reachable").write_bytes((ROS_SIDE / "network_and_screen.sh").read_bytes())
    (folder / "grader-reachable").chmod(0o755)
    for name in BROWSERS:
        (folder / name).symlink_to("grader-open")
    for name in ASKING:
        (folder / name).symlink_to("grader-reachable")
    return folder


@pytest.fixture
def master() -> Iterator[tuple[str, list[tuple[str, str, list[str]]]]]:
    """A server's address and what it was told."""
    told: list[tuple[str, str, list[str]]] = []

    def note(*arguments: object) -> tuple[int, str, int]:
        told.append(arguments)  # type: ignore[arg-type]
        return 1, "", 0

    with SimpleXMLRPCServer(("127.0.0.1", 0), logRequests=False) as server:
        server.register_function(note, "noteOpened")
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
        thread.start()
        yield f"http://127.0.0.1:{server.server_address[1]}", told
        server.shutdown()
        thread.join()


def _open(shims: Path, name: str, *arguments: str | bytes, **env: str) -> tuple[int, bytes]:
    path = f"{shims}:/usr/bin:/bin"
    done = subprocess.run(
        [str(shims / name), *arguments],
        env={"PATH": path, **env},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        check=False,
    )
    return done.returncode, done.stdout


@pytest.mark.full
@pytest.mark.parametrize("name", BROWSERS)
def test_it_tells_by_what_name_it_was_called(
    shims: Path, master: tuple[str, list[tuple[str, str, list[str]]]], name: str
) -> None:
    uri, told = master
    assert _open(shims, name, "-new-window", URL, ROS_MASTER_URI=uri) == (0, b"")
    assert told == [("/" + name, name, ["-new-window", URL])]


def test_it_carries_whatever_it_is_given(
    shims: Path, master: tuple[str, list[tuple[str, str, list[str]]]]
) -> None:
    uri, told = master
    given = ("", "<a&b>", "é", b"\xff\x01", "a\tb")
    assert _open(shims, "firefox", *given, ROS_MASTER_URI=uri)[0] == 0
    assert told[0][2] == ["", "<a&b>", "é", "��", "a\tb"]


@pytest.mark.parametrize("uri", ["", "http://127.0.0.1:1", "nonsense", "http://", "http://no such host:1"])
def test_without_a_master_it_does_nothing(shims: Path, uri: str) -> None:
    assert _open(shims, "firefox", URL, ROS_MASTER_URI=uri) == (0, b"")


def test_a_master_that_knows_nothing_of_it_is_let_be(shims: Path) -> None:
    with SimpleXMLRPCServer(("127.0.0.1", 0), logRequests=False) as server:
        thread = threading.Thread(target=server.handle_request)
        thread.start()
        uri = f"http://127.0.0.1:{server.server_address[1]}"
        assert _open(shims, "firefox", URL, ROS_MASTER_URI=uri) == (0, b"")
        thread.join()


@pytest.mark.parametrize(
    "question", ["ping -c 1 -W 2 ros.org", "xset q", "curl -sf https://ros.org", "wget -q --spider x"]
)
def test_what_a_script_asks_first_is_answered(shims: Path, question: str) -> None:
    program, *arguments = question.split()
    code, said = _open(shims, program, *arguments)
    assert code == 0
    assert (b" 0% packet loss" in said) == (program == "ping")


def test_it_is_quick(shims: Path) -> None:
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    for _ in range(5):
        _open(shims, "firefox", URL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    assert after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime < 5


@pytest.mark.ros
def test_the_master_notes_within_limits() -> None:
    done = subprocess.run(
        [require_ros().python, "-c", NOTE],
        env={**require_ros().env, "PYTHONPATH": str(ARENA)},
        capture_output=True,
        text=True,
        check=False,
    )
    characters, arguments, opened = map(int, done.stderr.split())
    assert json.loads(done.stdout) == [[1, "noted", 0], opened, arguments, characters, "/grader/actor"]
