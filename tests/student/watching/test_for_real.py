"""The command line, a real package, real runs: what is run again, and what it says."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.student.watching.labs import LEEDS, write

LONG_S = 900.0
GIT = shutil.which("git") or "git"


class Command:
    """`grader check --watch`, in some folder: its results as they come."""

    def __init__(self, folder: Path, *options: str) -> None:
        argv = [sys.executable, "-m", "grader", "check", "--watch", "--json", *options]
        self.process = subprocess.Popen(
            argv, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, encoding="utf-8"
        )
        self.results: list[dict] = []
        self.said: list[str] = []
        readers = ((self.process.stdout, self._result), (self.process.stderr, self.said.append))
        self.readers = [threading.Thread(target=self._read, args=reader) for reader in readers]
        for reader in self.readers:
            reader.start()

    def result(self, number: int) -> dict:
        """The result of that number, from 1."""
        self.await_that(lambda: len(self.results) >= number)
        return self.results[number - 1]

    def await_that(self, true: Callable[[], bool]) -> None:
        until_s = time.monotonic() + LONG_S
        while not true():
            assert self.process.poll() is None, self.said
            assert time.monotonic() < until_s, self.said
            time.sleep(0.05)

    def ended(self) -> int:
        code = self.process.wait(timeout=LONG_S)
        for reader in self.readers:
            reader.join()
        return code

    def interrupt(self) -> int:
        self.process.send_signal(signal.SIGINT)
        return self.ended()

    def _result(self, row: str) -> None:
        self.results.append(json.loads(row))

    @staticmethod
    def _read(stream, take: Callable[[str], None]) -> None:
        with stream:
            for row in stream:
                take(row)


@contextmanager
def watching(folder: Path, *options: str) -> Iterator[Command]:
    command = Command(folder, *options)
    try:
        yield command
    finally:
        if command.process.poll() is None:
            command.interrupt()
        command.ended()


def points(result: dict, name: str) -> float:
    return next(c["points"] for c in result["criteria"] if c["id"] == name)


def test_files_alone_are_judged_within_a_moment_of_a_save(package) -> None:
    with watching(package / "src", "--static") as command:
        assert points(command.result(1), "talker-executable") == 5
        (package / "src/numeric_talker.py").chmod(0o644)
        assert points(command.result(2), "talker-executable") == 0
        (package / "src/numeric_talker.py").chmod(0o755)
        assert points(command.result(3), "talker-executable") == 5
        assert command.interrupt() == 0


@pytest.mark.full
def test_the_exit_code_is_the_last_results(package) -> None:
    with watching(package, "--static") as command:
        command.result(1)
        (package / "src/numeric_talker.py").chmod(0o644)
        command.result(2)
        assert command.interrupt() == 1


@pytest.mark.full
def test_a_package_that_is_gone_from_its_folder_is_an_error_until_it_is_back(package, tmp_path) -> None:
    aside = tmp_path / "aside"
    workspace = tmp_path / "ws" / "src"
    workspace.mkdir(parents=True)
    package = package.rename(workspace / "lab1")
    with watching(workspace, "--static") as command:
        assert points(command.result(1), "manifest") == 5
        package.rename(aside)
        package.mkdir()
        assert command.result(2)["status"] == "error"
        assert command.result(2)["error"]["kind"] == "package-not-found"
        shutil.copytree(aside, package, dirs_exist_ok=True)
        command.await_that(lambda: command.results[-1]["status"] != "error")
        assert points(command.results[-1], "manifest") == 5


@pytest.mark.full
def test_what_git_says_of_modes_is_noticed(package) -> None:
    def git(*words: str) -> None:
        subprocess.run([GIT, *words], cwd=package, check=True, capture_output=True)

    (package / "src/numeric_talker.py").chmod(0o644)
    git("init", "-q")
    git("add", ".")
    with watching(package, "--static") as command:
        assert points(command.result(1), "talker-executable") == 0
        git("update-index", "--chmod=+x", "src/numeric_talker.py")
        assert points(command.result(2), "talker-executable") == 5


@pytest.mark.full
@pytest.mark.parametrize("leave", ["rename", "delete"])
def test_a_package_folder_that_is_gone_ends_it_in_one_line(leave, package) -> None:
    with watching(package, "--static") as command:
        command.result(1)
        if leave == "rename":
            package.rename(package.with_name("lab2"))
        else:
            shutil.rmtree(package)
        assert command.ended() == 3
        assert [row for row in command.said if "error" in row] == [
            f"grader: error: {package} was deleted or renamed while it was watched\n"
        ]


@pytest.mark.full
def test_an_archive_is_not_watched(package) -> None:
    shutil.make_archive(str(package), "tar", package.parent, "lab1")
    command = Command(package.parent, "--rubric", LEEDS, "lab1.tar")
    assert command.ended() == 2


@pytest.mark.full
@pytest.mark.ros
def test_a_saved_launch_file_is_graded_again_and_again(package, tmp_path) -> None:
    out = tmp_path / "results"
    with watching(package, "--out", str(out)) as command:
        assert points(command.result(1), "launch") == 5
        sound = (package / "launch/lab1.launch").read_text()
        write(
            package / "launch/lab1.launch", sound.replace('name="listener"', 'name="listener" ns="elsewhere"')
        )
        assert points(command.result(2), "launch") < 5
        assert {c["id"] for c in command.result(2)["criteria"] if c["points"] < c["max_points"]} == {"launch"}

        write(package / "launch/lab1.launch", sound)
        assert points(command.result(3), "launch") == 5
        kept = json.loads((out / "lab1" / "result.json").read_text())
        assert points(kept, "launch") == 5
        assert command.interrupt() == 0


@pytest.mark.ros
def test_what_runs_is_stopped_in_order_by_a_save(package) -> None:
    with watching(package) as command:
        command.await_that(lambda: any("talker  running" in row for row in command.said))
        talker = package / "src/numeric_talker.py"
        write(talker, talker.read_text().replace("Int8", "Int16"))
        assert points(command.result(1), "numeric-type") == 0
        assert len(command.results) == 1
        assert sum("build  running" in row for row in command.said) == 2
        os.kill(command.process.pid, signal.SIGTERM)
        assert command.ended() == 1
