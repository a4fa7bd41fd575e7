"""A submission's results change together, whenever the grader is killed, and nobody else changes them meanwhile."""

from __future__ import annotations

import errno
import json
import os
import shutil
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import pytest

from grader import results as results_module
from grader.errors import Busy, HostError, OutputError
from grader.results import NEW, READY, Results, finish_killed

FILES = ("result.json", "report.html", "report.md", "junit.xml", "console.log")


def write(folder: Path, version: int, *, files: tuple[str, ...] = FILES) -> None:
    with Results(folder) as results:
        fill(results, version, files)
        results.commit()


def fill(results: Results, version: int, files: tuple[str, ...] = FILES) -> None:
    (results.evidence / "talker.mcap").write_text(str(version))
    for name in files:
        (results.new / name).write_text(json.dumps({"status": "graded", "version": version}))


def version_of(path: Path) -> int:
    return int(json.loads(path.read_text())["version"])


def state(folder: Path) -> dict[str, int]:
    """The version of each part that is there."""
    found = {name: version_of(folder / name) for name in FILES if (folder / name).exists()}
    evidence = folder / "evidence" / "talker.mcap"
    return found | ({"evidence": int(evidence.read_text())} if evidence.exists() else {})


def whole(version: int) -> dict[str, int]:
    return dict.fromkeys((*FILES, "evidence"), version)


def test_new_results_take_the_place_of_all_that_was_there(tmp_path: Path) -> None:
    write(tmp_path / "ada", 1)
    (tmp_path / "ada" / "remark.txt").write_text("the instructor's own")
    write(tmp_path / "ada", 2, files=("result.json", "report.md", "junit.xml"))
    assert {path.name for path in (tmp_path / "ada").iterdir()} == {
        "result.json", "report.md", "junit.xml", "evidence", "remark.txt"
    }  # fmt: skip
    assert state(tmp_path / "ada") == dict.fromkeys(("result.json", "report.md", "junit.xml", "evidence"), 2)


def test_without_a_commit_nothing_changes(tmp_path: Path) -> None:
    write(tmp_path / "ada", 1)
    with suppress(KeyboardInterrupt), Results(tmp_path / "ada") as results:
        fill(results, 2)
        raise KeyboardInterrupt
    assert state(tmp_path / "ada") == whole(1)
    assert {path.name for path in (tmp_path / "ada").iterdir()} == {*FILES, "evidence"}
    with Results(tmp_path / "deep" / "eve"):
        assert (tmp_path / "deep" / "eve").is_dir()
    assert not (tmp_path / "deep").exists()


def test_recorded_evidence_takes_the_older_reports_with_it(tmp_path: Path) -> None:
    write(tmp_path / "ada", 1)
    write(tmp_path / "ada", 2, files=())
    assert state(tmp_path / "ada") == {"evidence": 2}


def killed_at(step: int, folder: Path) -> bool:
    """In a process of its own, write version 2 and be killed at that change of the disk; whether it came to it."""
    pid = os.fork()
    if pid == 0:
        done = 0

        def counted(function):
            def call(*args, **kwargs):
                nonlocal done
                if done == step:
                    os._exit(9)
                done += 1
                return function(*args, **kwargs)

            return call

        for owner, name in ((Path, "rename"), (Path, "unlink"), (shutil, "rmtree"), (results_module, "sync")):
            setattr(owner, name, counted(getattr(owner, name)))
        try:
            write(folder, 2)
        finally:
            os._exit(0)
    return os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]) == 9


@pytest.mark.full
def test_killed_at_any_step_the_result_fits_the_evidence_beside_it(tmp_path: Path) -> None:
    step = 0
    while True:
        folder = tmp_path / str(step) / "ada"
        write(folder, 1)
        killed = killed_at(step, folder)
        seen = state(folder)
        if "result.json" in seen:
            assert seen["result.json"] == seen["evidence"], f"step {step}: {seen}"
            assert seen == whole(seen["result.json"])
        finish_killed(folder.parent)
        assert state(folder) in (whole(1), whole(2)), f"step {step}"
        assert {path.name for path in folder.iterdir()} == {*FILES, "evidence"}
        if not killed:
            break
        step += 1
    assert step > 12
    assert state(folder) == whole(2)


def test_what_was_ready_is_not_lost_by_the_next_grading(tmp_path: Path) -> None:
    folder = tmp_path / "ada"
    write(folder, 1)
    step = next(n for n in range(99) if not (killed_at(n, folder) and not (folder / READY).exists()))
    assert step
    with Results(folder):
        assert state(folder) == whole(2)
    assert state(folder) == whole(2)


def test_leftovers_of_the_killed_are_swept_and_those_of_the_living_are_not(tmp_path: Path) -> None:
    (tmp_path / "dead" / NEW / "evidence").mkdir(parents=True)
    (tmp_path / "dead" / NEW / "evidence" / "talker.mcap.part").write_text("half")
    (tmp_path / "alien").mkdir()
    (tmp_path / "alien" / ".new").write_text("not ours")
    with Results(tmp_path / "alive") as results:
        fill(results, 1)
        finish_killed(tmp_path)
        results.commit()
    assert state(tmp_path / "alive") == whole(1)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["alien", "alive"]
    assert (tmp_path / "alien" / ".new").read_text() == "not ours"


def test_one_that_cannot_be_swept_keeps_no_other_from_it(tmp_path: Path, monkeypatch) -> None:
    for name in "abc":
        (tmp_path / name / NEW).mkdir(parents=True)
    real = os.open

    def closed(path, *args: object, **more: object) -> int:
        if Path(path).name == "b":
            raise PermissionError(errno.EACCES, "Permission denied", str(path))
        return real(path, *args, **more)

    with monkeypatch.context() as patch:
        patch.setattr(results_module.os, "open", closed)
        finish_killed(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["b"]


def test_a_second_grader_of_the_same_submission_is_told_so(tmp_path: Path) -> None:
    code = f"from pathlib import Path; from grader.results import Results; Results(Path({str(tmp_path)!r})).__enter__()"
    with Results(tmp_path) as results:
        fill(results, 1)
        with pytest.raises(Busy, match=r"another grader works on .* just now"), Results(tmp_path):
            pass
        other = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
        assert "Busy" in other.stderr
        results.commit()
    assert state(tmp_path) == whole(1)
    write(tmp_path, 2)
    assert state(tmp_path) == whole(2)


def test_a_file_system_without_locks_is_used_and_never_swept(tmp_path: Path, monkeypatch) -> None:
    def unknown(_descriptor: int) -> bool:
        raise OSError(errno.ENOLCK, os.strerror(errno.ENOLCK))

    monkeypatch.setattr(results_module, "lock", unknown)
    (tmp_path / "other" / NEW).mkdir(parents=True)
    write(tmp_path / "ada", 1)
    finish_killed(tmp_path)
    assert state(tmp_path / "ada") == whole(1)
    assert (tmp_path / "other" / NEW).is_dir()


@pytest.mark.parametrize(
    ("number", "kind"),
    [
        (errno.ENOSPC, HostError),
        (errno.EDQUOT, HostError),
        (errno.EIO, HostError),
        (errno.EACCES, OutputError),
    ],
)
def test_a_disk_that_gives_out_leaves_the_older_results(tmp_path, monkeypatch, number, kind) -> None:
    write(tmp_path / "ada", 1)

    def fails(_path: Path) -> None:
        raise OSError(number, os.strerror(number))

    with Results(tmp_path / "ada") as results:
        fill(results, 2)
        monkeypatch.setattr(results_module, "sync_tree", fails)
        with pytest.raises(kind, match=r"cannot write .*ada"):
            results.commit()
    assert state(tmp_path / "ada") == whole(1)
    assert {path.name for path in (tmp_path / "ada").iterdir()} == {*FILES, "evidence"}


def test_a_folder_that_cannot_be_made_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with (
        pytest.raises(OutputError, match=r"cannot write .*file/ada: Not a directory"),
        Results(tmp_path / "file" / "ada"),
    ):
        pass


@pytest.mark.parametrize(
    ("text", "complete"),
    [('{"status": "graded"}', True), ('{"status": "inconclusive"}', True), ('{"status": "error"}', False)]
    + [(text, False) for text in ("", "[]", "{", "{}", "\udcff")],
)
def test_what_counts_as_complete(tmp_path: Path, text: str, complete: bool) -> None:
    (tmp_path / "result.json").write_bytes(text.encode("utf-8", "surrogateescape"))
    with Results(tmp_path) as results:
        assert results.complete is complete
