"""Which saved files are found, in real folders, and which of them matter."""

from __future__ import annotations

import os
import shutil
import subprocess
import threading
import time
from pathlib import Path

import pytest

from grader.arena.interruption import Stop
from grader.student.watching import Saves, changed_files, is_ignored, take_snapshot
from tests.student.watching.labs import LEEDS, append, copy_of, write
from tests.support.processes import until

LONG_S = 600.0


@pytest.fixture
def saves(package: Path) -> Saves:
    found = Saves()
    found.follow((package,))
    return found


def snapshot(package: Path, **options: Path):
    return take_snapshot(str(package), "lab1", **options)


def test_a_saved_file_is_found_in_whatever_way_it_is_saved(saves, package) -> None:
    talker = package / "src/talker.py"
    write(talker, "plainly")
    assert saves.wait(0) == {str(talker)}
    write(talker.with_name("talker.py.tmp"), "by a rename, as many editors do").rename(talker)
    assert saves.wait(0) == {str(talker)}
    talker.chmod(0o600)
    assert saves.wait(0) == {str(talker)}
    talker.unlink()
    assert saves.wait(0) == {str(talker)}
    assert saves.wait(0) == frozenset()


def test_what_editors_builds_and_git_leave_is_not_found(saves, package) -> None:
    for name in (
        "src/.talker.py.swp",
        "src/talker.py~",
        "src/4913",
        "src/#talker.py#",
        "src/a.pyc",
        "run.log",
    ):
        write(package / name, "x")
    for name in ("build", "devel", "install", "logs", ".git", "src/__pycache__", "grader-results"):
        write(package / name / "file.py", "x")
    assert saves.wait(0) == frozenset()


def test_a_new_folder_is_looked_at(saves, package) -> None:
    new = write(package / "nodes/deep/new.py", "x = 1\n")
    assert saves.wait(0) == {str(new)}


def test_several_files_at_once_come_together(saves, package) -> None:
    def save() -> None:
        for number in range(10):
            write(package / f"src/file{number}.py", "x")
            time.sleep(0.02)

    thread = threading.Thread(target=save)
    thread.start()
    found = saves.wait(LONG_S)
    thread.join()
    assert {Path(name).name for name in found} == {f"file{number}.py" for number in range(10)}


@pytest.mark.parametrize("when", ["before", "during"])
def test_a_save_asks_what_runs_to_stop(when, saves, package) -> None:
    stop = Stop()
    if when == "before":
        write(package / "src/talker.py", "x")
    with saves.stopping(stop):
        if when == "during":
            assert not stop.asked
            write(package / "src/talker.py", "x")
        until(lambda: stop.asked)
    assert saves.wait(0) == {str(package / "src/talker.py")}


def test_our_own_results_are_not_found(package) -> None:
    results = package / "results"
    write(results / "lab1/result.json", "{}")
    saves = Saves(results)
    saves.follow((package,))
    write(results / "lab1/result.json", "{} ")
    assert saves.wait(0) == frozenset()
    assert "results/lab1/result.json" not in snapshot(package, without=results).files


def test_links_that_lead_out_are_not_followed(saves, package, tmp_path) -> None:
    outside = write(tmp_path / "outside/deep/file.py", "x")
    (package / "data").symlink_to(tmp_path / "outside")
    saves.wait(0)
    append(outside)
    assert saves.wait(0) == frozenset()
    assert not any(path.startswith("data/") for path in snapshot(package).files)


def test_a_package_below_a_folder_with_such_a_name_is_looked_at_all_the_same(tmp_path) -> None:
    package = copy_of(LEEDS, tmp_path / "build" / ".venv")
    assert snapshot(package).files.keys() >= {"package.xml", "src/talker.py"}
    saves = Saves()
    saves.follow((package,))
    append(package / "src/talker.py")
    assert saves.wait(0) == {str(package / "src/talker.py")}


def test_no_folder_at_all_is_no_error() -> None:
    saves = Saves()
    saves.follow((Path("/nowhere/at/all"),))
    assert saves.wait(0) == frozenset()


@pytest.mark.parametrize(
    "name",
    ["src/.talker.py.swp", "a~", "x/.git/index", "__pycache__/a.pyc", "a.pyo", "build/x", "src/.#talker.py", "4913",
     "talker.py.bak", ".goutputstream-X1Y2", "bag.bag.active", "run.log", "talker.py___jb_tmp___", "grader-results/a"],
)  # fmt: skip
def test_names_that_are_ignored(name) -> None:
    assert is_ignored(name)


@pytest.mark.parametrize(
    "name",
    [
        "src/talker.py",
        "a.swap",
        "builder.py",
        "launch/lab1.launch",
        "src/build.py",
        "49130",
        "CMakeLists.txt",
    ],
)
def test_names_that_are_not(name) -> None:
    assert not is_ignored(name)


def test_a_first_commit_changes_no_file(package) -> None:
    before = snapshot(package)
    for words in (["init", "-q"], ["add", "."]):
        subprocess.run([shutil.which("git") or "git", *words], cwd=package, check=True)
    assert changed_files(before, snapshot(package)) == ()


def test_permissions_are_part_of_a_snapshot_and_times_are_not(package) -> None:
    before = snapshot(package)
    os.utime(package / "src/talker.py")
    assert snapshot(package) == before
    (package / "src/talker.py").chmod(0o600)
    assert snapshot(package) != before


def test_packages_that_are_built_with_it_are_part_of_a_snapshot(package, tmp_path) -> None:
    other = copy_of("mcr2-basic-comms", tmp_path)
    manifest = package / "package.xml"
    manifest.write_text(manifest.read_text().replace("</package>", "<depend>basic_comms</depend></package>"))
    before = snapshot(tmp_path)
    assert set(before.folders) == {package, other}
    append(other / "scripts/talker.py")
    assert changed_files(before, snapshot(tmp_path)) == ("../basic_comms/scripts/talker.py",)
