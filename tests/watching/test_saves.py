"""What the system tells of, in real folders."""

from __future__ import annotations

import os
import shutil
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from grader.arena.asynchronous import Stop
from grader.student.watching.ignored import ignored
from grader.student.watching.saves import WatchedFolders
from grader.student.watching.snapshot import differing, folders_in, take_picture
from tests.watching.labs import copy_of, write

LEEDS = "leeds-comp3631-lab1"
LONG_S = 30.0


@pytest.fixture
def package(tmp_path: Path) -> Path:
    return copy_of(LEEDS, tmp_path)


@pytest.fixture(params=["told", "polling"])
def saves(request, package: Path, monkeypatch) -> Iterator[WatchedFolders]:
    """Of the package, ready: it has told of a first save."""
    if request.param == "polling":
        monkeypatch.setenv("WATCHFILES_FORCE_POLLING", "1")
    with WatchedFolders() as found:
        follow(found, package)
        yield found


def follow(saves: WatchedFolders, package: Path, without: Path | None = None) -> None:
    saves.follow(tuple(folders_in(package, without)), without)
    until_s = time.monotonic() + LONG_S
    while str(package / "ready") not in saves.wait(0.2):
        write(package / "ready", str(time.monotonic()))
        assert time.monotonic() < until_s


def heard(saves: WatchedFolders, path: Path) -> set[str]:
    """Everything that is told of until `path` is."""
    found: set[str] = set()
    until_s = time.monotonic() + LONG_S
    while str(path) not in found:
        found |= saves.wait(1.0)
        assert time.monotonic() < until_s, found
    return found


def test_a_saved_file_is_told_of_in_whatever_way_it_is_saved(saves, package, request) -> None:
    talker = package / "src/talker.py"
    write(talker, "plainly")
    heard(saves, talker)
    if (
        request.node.callspec.params["saves"] == "polling"
    ):  # by times in whole seconds: the loop's own look sees more
        return
    write(talker.with_name("talker.py.tmp"), "by a rename, as many editors do").rename(talker)
    assert str(talker.with_name("talker.py.tmp")) not in heard(saves, talker)
    talker.unlink()
    heard(saves, talker)


def test_what_editors_builds_and_git_leave_is_not_told_of(saves, package) -> None:
    leftovers = [
        "src/.talker.py.swp",
        "src/talker.py~",
        "src/4913",
        "src/#talker.py#",
        "src/a.pyc",
        "src/run.log",
    ]
    for name in leftovers:
        write(package / name, "x")
    last = write(package / "src/last.py", "x")
    assert heard(saves, last) & {str(package / name) for name in leftovers} == set()


def test_several_files_at_once_come_together(saves, package) -> None:
    heard(saves, write(package / "src/begin.py", "x"))
    saves.wait(0)
    names = {str(write(package / f"src/file{number}.py", "x")) for number in range(20)}
    assert names <= heard(saves, package / "src/file19.py")


def test_a_save_asks_what_runs_to_stop(saves, package) -> None:
    stop = Stop()
    with saves.stopping(stop):
        assert not stop.asked
        write(package / "src/talker.py", "x")
        heard(saves, package / "src/talker.py")
        assert stop.asked


def test_what_was_saved_before_a_run_began_stops_it_at_once(saves, package) -> None:
    write(package / "src/talker.py", "x")
    until_s = time.monotonic() + LONG_S
    asked = False
    while not asked and time.monotonic() < until_s:
        stop = Stop()
        with saves.stopping(stop):
            asked = stop.asked
    assert asked


def test_our_own_results_are_not_told_of(package) -> None:
    results = package / "results"
    write(results / "lab1/result.json", "{}")
    with WatchedFolders() as saves:
        follow(saves, package, results)
        write(results / "lab1/result.json", "{} ")
        write(results / "new", "x")
        last = write(package / "src/last.py", "x")
        assert not any(name.startswith(str(results)) for name in heard(saves, last))


def test_links_that_lead_out_are_not_followed(package, tmp_path) -> None:
    outside = write(tmp_path / "outside/deep/file.py", "x").parent.parent
    (package / "data").symlink_to(outside)
    places = tuple(folders_in(package))
    assert package / "data" not in places
    assert not any(place.is_relative_to(outside) for place in places)
    assert not any(path.startswith("data/") for path in take_picture(str(package), "lab1").files)


def test_folders_of_builds_are_not_looked_at(package) -> None:
    for name in ("build", "devel", "install", "logs", ".git", "src/__pycache__", "grader-results"):
        (package / name).mkdir()
    assert [p.relative_to(package).as_posix() for p in folders_in(package)] == [".", "launch", "src"]


def test_a_package_below_a_folder_with_such_a_name_is_looked_at_all_the_same(tmp_path) -> None:
    package = copy_of(LEEDS, tmp_path / "build" / ".venv")
    assert take_picture(str(package), "lab1").files.keys() >= {"package.xml", "src/talker.py"}
    with WatchedFolders() as saves:
        follow(saves, package)


def test_no_folder_at_all_is_no_error() -> None:
    with WatchedFolders() as saves:
        saves.follow((Path("/nowhere/at/all"),), None)
        assert saves.wait(0) == frozenset()


@pytest.mark.parametrize(
    "name",
    ["src/.talker.py.swp", "a~", "x/.git/index", "__pycache__/a.pyc", "a.pyo", "build/x", "src/.#talker.py", "4913",
     "talker.py.bak", ".goutputstream-X1Y2", "bag.bag.active", "run.log", "talker.py___jb_tmp___", "grader-results/a"],
)  # fmt: skip
def test_names_that_are_of_no_interest(name) -> None:
    assert ignored(name)


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
def test_names_that_are(name) -> None:
    assert not ignored(name)


def test_a_first_commit_changes_no_file(package) -> None:
    before = take_picture(str(package), "lab1")
    for words in (["init", "-q"], ["add", "."]):
        subprocess.run([shutil.which("git") or "git", *words], cwd=package, check=True)
    assert differing(before, take_picture(str(package), "lab1")) == ()


def test_permissions_are_part_of_the_picture_and_times_are_not(package) -> None:
    before = take_picture(str(package), "lab1")
    os.utime(package / "src/talker.py")
    assert take_picture(str(package), "lab1").same_as(before)
    (package / "src/talker.py").chmod(0o600)
    assert not take_picture(str(package), "lab1").same_as(before)
