"""Files that appear whole or not at all, and temporary folders that a killed grader left."""

from __future__ import annotations

import os
import signal
import stat
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from grader.errors import HostError, OutputError
from grader.files import MARK, atomic_write, sweep, temporary_folder, whole_file


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


def test_a_name_of_letters_of_four_bytes_has_room_for_the_file_beside_it(tmp_path: Path) -> None:
    target = tmp_path / ("\N{ROBOT FACE}" * 63)
    atomic_write(target, b"new")
    assert target.read_bytes() == b"new"


HOLD = """
import sys
from pathlib import Path
from grader.files import temporary_folder
with temporary_folder("run", Path(sys.argv[1])) as folder:
    (folder / "closed" / "deep").mkdir(parents=True)
    (folder / "closed" / "deep" / "file").write_text("x")
    (folder / "closed").chmod(0)
    print(folder, flush=True)
    sys.stdin.read()
"""


def holder(place: Path) -> tuple[subprocess.Popen[str], Path]:
    """A process that has a temporary folder, and the folder."""
    process = subprocess.Popen(
        [sys.executable, "-c", HOLD, str(place)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    return process, Path(process.stdout.readline().strip())


def test_it_is_there_and_then_gone(tmp_path: Path) -> None:
    with temporary_folder("run", tmp_path) as folder:
        assert folder.parent == tmp_path
        assert folder.stat().st_mode & 0o777 == 0o700
        (folder / "a" / "b").mkdir(parents=True)
        (folder / "link").symlink_to("/etc")
    assert list(tmp_path.iterdir()) == []
    assert Path("/etc/passwd").exists()


def test_the_killed_are_swept_and_the_living_are_not(tmp_path: Path) -> None:
    (dead, left), (alive, used) = holder(tmp_path), holder(tmp_path)
    try:
        assert left.exists()
        dead.send_signal(signal.SIGKILL)
        dead.communicate()
        assert left.exists()
        with temporary_folder("source", tmp_path) as folder:
            assert sorted(tmp_path.iterdir()) == sorted([used, folder])
            assert (used / "closed").is_dir()
    finally:
        alive.communicate("")
    assert alive.returncode == 0
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "name", ["grader-results", "grader-run-2026", "grader-run-lab1_old", "other", "grader-runs-abcdefgh"]
)
def test_what_is_not_ours_stays(tmp_path: Path, name: str) -> None:
    (tmp_path / name).mkdir()
    (tmp_path / name / "marks.csv").write_text("all of them")
    (tmp_path / "grader-run-filefile").write_text("a file")
    sweep(tmp_path)
    assert (tmp_path / name / "marks.csv").read_text() == "all of them"
    assert (tmp_path / "grader-run-filefile").exists()


def test_a_removal_that_was_killed_is_finished(tmp_path: Path) -> None:
    folder = tmp_path / "grader-run-abcdefgh"
    folder.mkdir()
    (folder / MARK).write_text("")
    (tmp_path / "grader-source-abcd1234").mkdir()
    sweep(tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_a_mark_that_leads_elsewhere_is_not_followed(tmp_path: Path) -> None:
    folder = tmp_path / "grader-run-abcdefgh"
    folder.mkdir()
    (folder / MARK).symlink_to("/etc/passwd")
    os.mkfifo(tmp_path / "pipe")
    other = tmp_path / "grader-run-12345678"
    other.mkdir()
    (other / MARK).symlink_to(tmp_path / "pipe")
    sweep(tmp_path)
    assert folder.exists()
    assert other.exists()


def test_no_room_is_the_machines_fault(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with (
        pytest.raises(HostError, match=r"no temporary folder can be made in .*: Not a directory"),
        temporary_folder("run", tmp_path / "file"),
    ):
        pass
