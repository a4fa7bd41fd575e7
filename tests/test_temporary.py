"""Temporary folders of graders that were killed are swept by the next one; nothing else ever is."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from grader.errors import HostError
from grader.files import MARK, sweep, temporary_folder

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
