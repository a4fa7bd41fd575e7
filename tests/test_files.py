"""Files that appear whole or not at all."""

from __future__ import annotations

import os
import signal
import stat
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from grader.errors import OutputError
from grader.files import atomic_write, whole_file


def test_a_pipe_is_written_to_and_stays_a_pipe(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    seen: list[bytes] = []
    reader = threading.Thread(target=lambda: seen.append(pipe.read_bytes()))
    reader.start()
    atomic_write(pipe, b"criteria")
    reader.join()
    assert seen == [b"criteria"]
    assert stat.S_ISFIFO(pipe.stat().st_mode)


def test_a_device_stays_a_device() -> None:
    before = Path(os.devnull).stat()
    atomic_write(Path(os.devnull), b"nothing")
    after = Path(os.devnull).stat()
    assert stat.S_ISCHR(after.st_mode)
    assert (before.st_ino, before.st_rdev) == (after.st_ino, after.st_rdev)


def test_a_link_stays_a_link(tmp_path: Path) -> None:
    (tmp_path / "there").mkdir()
    link = tmp_path / "link"
    link.symlink_to(tmp_path / "there" / "file")
    atomic_write(link, b"one")
    assert link.is_symlink()
    assert (tmp_path / "there" / "file").read_bytes() == b"one"


def test_a_folder_is_refused_in_one_line(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="cannot write"):
        atomic_write(tmp_path, b"x")
    assert list(tmp_path.iterdir()) == []


WRITING = """
import sys
from pathlib import Path
from grader.files import whole_file
with whole_file(Path(sys.argv[1])) as beside:
    beside.write_bytes(b"half")
    print("begun", flush=True)
    sys.stdin.read()
"""


def _writer(target: Path) -> subprocess.Popen[str]:
    """A process in the middle of writing a file."""
    process = subprocess.Popen(
        [sys.executable, "-c", WRITING, str(target)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "begun\n"
    return process


@pytest.mark.parametrize("write", ["atomic_write", "whole_file"])
def test_what_a_killed_writer_left_is_removed_by_the_next_one(tmp_path: Path, write: str) -> None:
    target = tmp_path / "feedback (1).zip"
    mine = tmp_path / ".feedback (1).zip.of-mine"
    mine.write_bytes(b"not a writer's")
    dead, alive = _writer(target), _writer(target)
    dead.send_signal(signal.SIGKILL)
    dead.communicate()
    assert len(list(tmp_path.iterdir())) == 3
    if write == "atomic_write":
        atomic_write(target, b"new")
    else:
        with whole_file(target) as beside:
            beside.write_bytes(b"new")
    assert target.read_bytes() == b"new"
    assert len(list(tmp_path.iterdir())) == 3, "the one that still writes has its file"
    alive.communicate("")
    assert alive.returncode == 0
    assert sorted(tmp_path.iterdir()) == sorted([target, mine])
    assert target.read_bytes() == b"half"
