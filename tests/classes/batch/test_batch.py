"""`grader batch`: a class is graded, whatever becomes of one of it, and goes on where it stopped."""

from __future__ import annotations

import csv
import os
import shutil
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path

import pytest

from grader.classes.batch.run import _gradable
from grader.classes.fetching.mirror import Patience
from grader.classes.roster.entries import OUT
from grader.model.batch import Entry, Roster
from tests.classes.batch.a_class import (
    CORRECT,
    ROOT,
    RUBRIC,
    WRONG_NAME,
    batch,
    handed_in,
    lines_of,
    roster_of,
    run_of,
)
from tests.support.processes import children_of, lives, until

NAMES = [f"s{number:02}" for number in range(60)]


def book(out: Path) -> list[dict[str, str]]:
    with (out / "gradebook.csv").open(encoding="utf-8-sig", newline="") as file:
        return list(csv.DictReader(file))


def stamps(out: Path) -> dict[str, int]:
    """When each result was written."""
    return {path.parent.name: path.stat().st_mtime_ns for path in out.glob("*/result.json")}


@pytest.mark.full
def test_a_folder_of_submissions(tmp_path, capsys) -> None:
    handed_in(tmp_path / "in", ["ada", "bob"])
    handed_in(tmp_path / "in", ["cem"], WRONG_NAME)
    assert batch(tmp_path / "in", tmp_path / "out") == 1
    assert {row["id"]: row["status"] for row in book(tmp_path / "out")} == dict.fromkeys(
        ["ada", "bob", "cem"], "graded"
    )
    results = {line["submission"]["id"]: line["points"] for line in lines_of(tmp_path / "out")}
    assert results["ada"] == results["bob"] == 100
    assert results["cem"] < 100
    about = run_of(tmp_path / "out")
    assert (about["schema"], about["state"]) == ("grader.run/1", "complete")
    assert about["counts"]["submissions"] == about["counts"]["graded"] == 3
    assert about["counts"]["passed"] == 2
    shown = capsys.readouterr()
    assert "3 submissions, 3 graded (2 passed)" in shown.out
    assert "3 of 3 done" in shown.err


def test_what_is_complete_is_not_done_again(tmp_path) -> None:
    handed_in(tmp_path / "in", ["ada", "bob"])
    out = tmp_path / "out"
    batch(tmp_path / "in", out)
    before = stamps(out)
    (tmp_path / "in" / "bob" / "lab1" / "CMakeLists.txt").write_text("project(other)\n")
    handed_in(tmp_path / "in", ["cem"])
    assert batch(tmp_path / "in", out) == 1
    after = stamps(out)
    assert after["ada"] == before["ada"]
    assert after["bob"] != before["bob"]
    assert "cem" in after
    assert run_of(out)["counts"]["kept"] == 1


@pytest.mark.full
def test_another_rubric_grades_all_again(tmp_path) -> None:
    handed_in(tmp_path / "in", ["ada"])
    out = tmp_path / "out"
    batch(tmp_path / "in", out)
    other = tmp_path / "other.yaml"
    other.write_text(
        RUBRIC.read_text().replace("points: 40", "points: 20").replace("points: 30", "points: 40")
    )
    batch(tmp_path / "in", out, rubric=other)
    (line,) = lines_of(out)
    assert {c["id"]: c["points"] for c in line["criteria"]}["manifest"] == 20
    assert run_of(out)["counts"]["kept"] == 0


@pytest.mark.full
def test_only_some_of_them(tmp_path, capsys) -> None:
    rows = ["ada,ada", "bob,bob.zip", "cem,cem"]
    handed_in(tmp_path / "in", ["ada", "cem"])
    (tmp_path / "in" / "bob.zip").write_text("no archive")
    roster = roster_of(tmp_path / "in", rows)
    out = tmp_path / "out"
    assert batch(roster, out) == 3
    before = stamps(out)
    (tmp_path / "in" / "bob.zip").unlink()
    shutil.make_archive(str(tmp_path / "in" / "bob"), "zip", CORRECT)
    assert batch(roster, out, "--only", "failed") == 0
    assert stamps(out)["ada"] == before["ada"]
    assert [line["status"] for line in lines_of(out)] == ["graded"] * 3
    assert batch(roster, out, "--only", "ada") == 0
    assert stamps(out)["ada"] != before["ada"]
    assert stamps(out)["cem"] == before["cem"]
    (tmp_path / "in" / "cem" / "lab1" / "CMakeLists.txt").write_text("project(other)\n")
    assert batch(roster, out, "--only", "inconclusive") == 0
    assert stamps(out)["cem"] == before["cem"]
    assert batch(roster, out, "--only", "changed") == 1
    assert stamps(out)["cem"] != before["cem"]
    capsys.readouterr()
    assert batch(roster, out, "--only", "adda") == 2
    assert "did you mean ada?" in capsys.readouterr().err


@pytest.mark.full
def test_the_rosters_columns_are_carried_into_the_gradebook(tmp_path) -> None:
    handed_in(tmp_path / "in", ["ada"])
    roster = roster_of(tmp_path / "in", ["ada,ada,Ada Lovelace,A,=cmd()"], "id,source,name,group,Seat")
    batch(roster, tmp_path / "out")
    (row,) = book(tmp_path / "out")
    assert (row["name"], row["group"]) == ("Ada Lovelace", "A")
    assert row["Seat"] == "'=cmd()"
    (line,) = lines_of(tmp_path / "out")
    assert line["roster"]["extra"]["Seat"] == "=cmd()"


@pytest.mark.full
def test_rows_that_cannot_be_graded_stand_in_the_gradebook(tmp_path, capsys) -> None:
    handed_in(tmp_path / "in", ["ada"])
    roster = roster_of(tmp_path / "in", ["ada,ada", "eve,../../etc", "ada,ada", "run.json,ada"])
    assert batch(roster, tmp_path / "out") == 3
    shown = capsys.readouterr().err
    assert "roster.csv:3" in shown
    assert "roster.csv:4" in shown
    rows = {row["id"]: row["status"] for row in book(tmp_path / "out")}
    assert rows == {"ada": "graded", "eve": "error", "run.json": "error"}


class Asks(BaseHTTPRequestHandler):
    """A server that wants a password."""

    def do_GET(self) -> None:
        self.send_response(401)
        self.send_header("WWW-Authenticate", 'Basic realm="course"')
        self.send_header("Content-Length", "0")
        self.end_headers()

    def log_message(self, *_: object) -> None:
        """Say nothing."""


@pytest.fixture
def asking() -> Iterator[str]:
    with HTTPServer(("127.0.0.1", 0), Asks) as server:
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
        thread.start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()
        thread.join()


def git(folder: Path, *arguments: str) -> None:
    who = ("-c", "user.name=a", "-c", "user.email=a@example.org")
    subprocess.run([str(shutil.which("git")), *who, *arguments], cwd=folder, check=True, capture_output=True)


@pytest.mark.full
def test_ten_rows_that_are_bad_in_ten_ways(tmp_path, asking, capsys) -> None:
    """Each has a line of its own, and the others are graded."""
    folder = handed_in(tmp_path / "in", ["ada", "bob", "two/a", "two/b"])
    git(tmp_path, "init", "-q", "--bare", "empty.git")
    git(tmp_path, "init", "-q", "repository")
    shutil.copytree(CORRECT, tmp_path / "repository" / "work")
    git(tmp_path / "repository", "add", "-A")
    git(tmp_path / "repository", "commit", "-qm", "all of it")
    (folder / "broken.zip").write_text("no archive")
    (folder / "none").mkdir()
    (folder / "none" / "notes.txt").write_text("nothing yet")
    rows = [
        "ada,ada,,",
        "unreachable,https://nowhere.invalid/lab1.git,,",
        f"empty,file://{tmp_path}/empty.git,,",
        f"ref,file://{tmp_path}/repository,no-such-branch,",
        "broken,broken.zip,,",
        "none,none,,",
        "two,two,,",
        "outside,../../etc,,",
        f"private,{asking}/lab1.git,,",
        "ada,bob,,",
        "soon,bob,,soon",
        "bob,bob,,",
        f"cem,file://{tmp_path}/repository,,",
    ]
    roster = roster_of(folder, rows, "id,source,ref,extension_days")
    assert batch(roster, tmp_path / "out", "--allow-local", str(tmp_path)) == 3
    shown = capsys.readouterr()
    told = {
        "unreachable (roster.csv:3)": "the server's name was not found",
        "empty (roster.csv:4)": "the repository is empty",
        "ref (roster.csv:5)": "there is no branch, tag or commit 'no-such-branch'",
        "broken (roster.csv:6)": "broken.zip is damaged",
        "none (roster.csv:7)": "no package.xml was found",
        "outside": f"roster.csv:9: source: ../../etc {OUT}",
        "private (roster.csv:10)": "it does not exist, or it needs a password",
        "soon": "roster.csv:12: extension_days: soon is not a number of days",
    }
    for name, words in told.items():
        (line,) = [line for line in shown.out.splitlines() if line.startswith(f"{name}: error: ")]
        assert words in line
    assert "roster.csv:11: id: ada is there already, in roster.csv:2" in shown.err
    good = {line["submission"]["id"] for line in lines_of(tmp_path / "out") if line["status"] == "graded"}
    assert good == {"ada", "bob", "cem", "two"}
    assert len(lines_of(tmp_path / "out")) == len(rows) - 1


def test_one_whose_process_dies_stops_no_other(tmp_path, monkeypatch) -> None:
    """As when the kernel is out of memory. The instructor's own check kills the process that judges one of them."""
    checks = tmp_path / "own.py"
    checks.write_text(
        "import os, signal\n"
        "from grader.checks import check, passed\n\n"
        '@check("deadly")\n'
        "def deadly(package):\n"
        '    """It kills."""\n'
        '    if not package.file("launch/lab1.launch"):\n'
        "        os.kill(os.getpid(), signal.SIGKILL)\n"
        '    return passed("alive")\n'
    )
    rubric = tmp_path / "deadly.yaml"
    text = RUBRIC.read_text().replace("package: lab1\n", "package: lab1\nchecks: own.py\n")
    rubric.write_text(text + "\n  - {id: deadly, title: It kills, points: 0, check: deadly}\n")
    handed_in(tmp_path / "in", ["ada", "bob", "cem"])
    (tmp_path / "in" / "bob" / "lab1" / "launch" / "lab1.launch").unlink()
    assert batch(tmp_path / "in", tmp_path / "out", rubric=rubric) == 3
    found = {line["submission"]["id"]: line["status"] for line in lines_of(tmp_path / "out")}
    assert found == {"ada": "graded", "bob": "error", "cem": "graded"}


def started(roster: Path, out: Path, *more: str) -> subprocess.Popen[bytes]:
    command = [
        sys.executable,
        "-m",
        "grader",
        "batch",
        str(roster),
        "--rubric",
        str(RUBRIC),
        "--out",
        str(out),
        *more,
    ]
    with out.with_suffix(".stderr").open("wb") as said:
        return subprocess.Popen(command, cwd=ROOT, stdout=subprocess.DEVNULL, stderr=said)


def wait_for_results(out: Path, count: int, process: subprocess.Popen[bytes]) -> None:
    until(lambda: len(stamps(out)) >= count or process.poll() is not None)
    assert process.poll() is None, "the batch ended too early"


@pytest.mark.full
@pytest.mark.parametrize("signal_number", [signal.SIGKILL, signal.SIGINT])
def test_a_batch_that_is_stopped_goes_on_where_it_stopped(tmp_path, signal_number) -> None:
    roster, out = handed_in(tmp_path / "in", NAMES), tmp_path / "out"
    process = started(roster, out, "--jobs", "2")
    wait_for_results(out, 10, process)
    workers = children_of(process.pid)
    assert workers
    process.send_signal(signal_number)
    assert process.wait() == (130 if signal_number == signal.SIGINT else -signal.SIGKILL)
    for pid in workers:
        until(lambda pid=pid: not lives(pid))
    if signal_number == signal.SIGINT:
        assert run_of(out)["state"] == "interrupted"
        assert len(book(out)) == 60
        said = out.with_suffix(".stderr").read_text()
        assert f"{len(stamps(out))} of 60 done; the same command continues" in said
    before = stamps(out)
    assert 10 <= len(before) < 60
    assert batch(roster, out) == 0
    after = stamps(out)
    assert sorted(after) == NAMES
    assert {name: after[name] for name in before} == before, "what was complete was done again"
    assert run_of(out)["counts"] == {
        "submissions": 60, "graded": 60, "inconclusive": 0, "error": 0, "missing": 0, "kept": len(before), "passed": 60
    }  # fmt: skip
    assert [row["id"] for row in book(out)] == NAMES
    assert {row["points"] for row in book(out)} == {"100"}
    assert not list(out.rglob(".grader-*"))


@pytest.mark.full
def test_two_batches_in_one_folder(tmp_path) -> None:
    roster, out = handed_in(tmp_path / "in", NAMES), tmp_path / "out"
    process = started(roster, out, "--jobs", "1")
    try:
        wait_for_results(out, 1, process)
        assert batch(roster, out) == 3
    finally:
        process.send_signal(signal.SIGINT)
        process.wait()


@pytest.mark.full
def test_the_folder_of_results_inside_the_submissions(tmp_path) -> None:
    handed_in(tmp_path, ["ada"])
    assert batch(tmp_path, tmp_path / "out") == 0
    assert batch(tmp_path, tmp_path / "out") == 0
    assert [line["submission"]["id"] for line in lines_of(tmp_path / "out")] == ["ada"]


def test_passwords_of_the_roster_are_kept_nowhere(tmp_path, capsys, monkeypatch) -> None:
    monkeypatch.setattr(Patience, "wait", lambda *_: None)  # nothing will answer
    secret = "s3cret-t0ken"  # noqa: S105 - made up
    handed_in(tmp_path / "in", ["ada"])
    roster = roster_of(tmp_path / "in", ["ada,ada", f"bob,https://bob:{secret}@127.0.0.1:9/bob.git"])
    assert batch(roster, tmp_path / "out") == 3
    shown = capsys.readouterr()
    assert secret not in shown.out + shown.err
    kept = [
        path
        for path in (tmp_path / "out").rglob("*")
        if path.is_file() and secret.encode() in path.read_bytes()
    ]
    assert kept == []


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_a_folder_that_cannot_be_written(tmp_path) -> None:
    (tmp_path / "out").mkdir(mode=0o500)
    assert batch(handed_in(tmp_path / "in", ["ada"]), tmp_path / "out") == 2


@pytest.mark.parametrize("name", ["Run.json", "markers.json", "feedback"])
def test_no_submission_lies_where_a_file_of_the_class_does(tmp_path, name) -> None:
    found = _gradable(Roster(file="", entries=(Entry(id=name, source="https://x.example/y.git"),)), tmp_path)
    assert found.entries == ()
    assert [str(fault) for fault in found.faults] == [
        f": id: {name} is the name of one of the batch's own files"
    ]
