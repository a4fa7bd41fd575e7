"""Grading through the Python API: from scripts, threads and notebooks."""

from __future__ import annotations

import asyncio
import json
import os
import shutil
import signal
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from grader import (
    GraderError,
    Status,
    SubmissionError,
    UsageError,
    grade,
    judge,
    load_result,
    load_rubric,
)
from grader.errors import Busy
from tests.faulty import RUBRIC, VICTIM

ROOT = Path(__file__).resolve().parents[2]
LAB = "leeds-comp3631-lab1"
SOLUTION = ROOT / "reference_solutions" / LAB


def test_a_submission_is_graded_by_its_files(tmp_path: Path, capfd) -> None:
    handlers = [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)]
    mask = os.umask(0o077)
    try:
        result = grade(SOLUTION, LAB, tmp_path / "out", submission_id="ada", static_only=True)
        assert os.umask(0o077) == 0o077
    finally:
        os.umask(mask)
    assert result == load_result(tmp_path / "out" / "ada")
    assert result.status == "inconclusive"
    assert {c.status for c in result.criteria} == {Status.PASS, Status.INCONCLUSIVE}
    assert judge(tmp_path / "out" / "ada", LAB).criteria == result.criteria
    assert {path.name for path in (tmp_path / "out" / "ada").iterdir()} == {
        "evidence", "result.json", "report.html", "report.md", "junit.xml", "console.log"
    }  # fmt: skip
    assert capfd.readouterr() == ("", "")
    assert [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)] == handlers


def test_text_paths_and_loaded_rubrics_do_as_well(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    lab = load_rubric(LAB)
    result = grade(str(SOLUTION), lab, static_only=True)
    assert result.rubric.digest == lab.digest
    assert (tmp_path / "grader-results" / result.submission.id / "result.json").is_file()


def test_a_package_of_another_name(tmp_path: Path) -> None:
    shutil.copytree(SOLUTION, tmp_path / "work")
    manifest = next((tmp_path / "work").rglob("package.xml"))
    manifest.write_text(manifest.read_text().replace("<name>lab1<", "<name>week1<"))
    with pytest.raises(SubmissionError, match="no package lab2"):
        grade(tmp_path / "work", LAB, tmp_path / "out", package="lab2", static_only=True)
    result = grade(tmp_path / "work", LAB, tmp_path / "out", package="week1", static_only=True)
    assert result.submission.package == "week1"


def test_where_an_event_loop_runs(tmp_path: Path) -> None:
    """As in a cell of a notebook."""

    async def cell() -> Status:
        return grade(SOLUTION, LAB, tmp_path, static_only=True).criteria[0].status

    assert asyncio.run(cell()) is Status.PASS


def test_beside_an_event_loop(tmp_path: Path) -> None:
    async def server() -> tuple[int, float]:
        ticks = 0
        work = asyncio.create_task(asyncio.to_thread(grade, SOLUTION, LAB, tmp_path, static_only=True))
        while not work.done():
            await asyncio.sleep(0.01)
            ticks += 1
        return ticks, (await work).max_points

    ticks, most = asyncio.run(server())
    assert ticks > 1
    assert most == 100


def test_in_threads_side_by_side(tmp_path: Path) -> None:
    def one(number: int) -> str:
        return grade(SOLUTION, LAB, tmp_path, submission_id=f"s{number}", static_only=True).submission.id

    with ThreadPoolExecutor(4) as pool:
        assert list(pool.map(one, range(4))) == ["s0", "s1", "s2", "s3"]
    assert len(list(tmp_path.glob("s*/report.html"))) == 4


def test_two_of_the_same_submission_take_turns_or_say_so(tmp_path: Path) -> None:
    def one(_: int) -> object:
        try:
            return grade(SOLUTION, LAB, tmp_path, submission_id="ada", static_only=True).status
        except Busy as busy:
            return busy.message

    with ThreadPoolExecutor(3) as pool:
        said = list(pool.map(one, range(3)))
    assert "inconclusive" in said
    assert all(text == "inconclusive" or "another grader works" in str(text) for text in said)
    assert load_result(tmp_path / "ada").status == "inconclusive"


def test_progress_is_told(tmp_path: Path) -> None:
    told: list[tuple[str, str, str]] = []
    grade(SOLUTION, LAB, tmp_path, static_only=True, progress=lambda *step: told.append(step))
    assert [step[:2] for step in told[:4]] == [
        ("intake", "running"), ("intake", "done"), ("package", "running"), ("package", "done")
    ]  # fmt: skip
    assert {state for _, state, _ in told} <= {"waiting", "running", "done", "failed", "skipped"}


@pytest.mark.full
@pytest.mark.parametrize("step", ["intake", "package", "talker"])
def test_what_progress_raises_ends_the_grading_and_is_raised(step: str, tmp_path: Path) -> None:
    class EnoughError(Exception):
        pass

    def told(name: str, _state: str, _detail: str) -> None:
        if name == step:
            raise EnoughError(name)

    with pytest.raises(EnoughError):
        grade(SOLUTION, LAB, tmp_path, submission_id="ada", static_only=True, progress=told)
    assert not list(tmp_path.rglob(".grader-*"))


@pytest.mark.parametrize("static_only", [True, False])
def test_a_submission_at_fault_leaves_a_result_that_says_so(static_only: bool, tmp_path: Path) -> None:
    (tmp_path / "bob").mkdir()
    (tmp_path / "bob" / "README.md").write_text("to do\n")
    with pytest.raises(SubmissionError) as caught:
        grade(tmp_path / "bob", LAB, tmp_path / "out", static_only=static_only)
    assert (caught.value.kind, caught.value.blame) == ("package-not-found", "submission")
    assert caught.value.message
    assert caught.value.hint
    written = load_result(tmp_path / "out" / "bob")
    assert written.status == "error"
    assert written.error is not None
    assert written.error.message == caught.value.message


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"source": "/nowhere/at/all"}, "does not exist"),
        ({"rubric": "no-such-lab"}, "there is no rubric"),
        ({"sandbox": "maybe"}, "sandbox is 'maybe'"),
        ({"out": "/dev/null/out"}, "/dev/null"),
    ],
    ids=["source", "rubric", "sandbox", "out"],
)
def test_wrong_arguments_are_errors_of_one_line(change: dict[str, str], words: str, tmp_path: Path) -> None:
    asked = {"source": SOLUTION, "rubric": LAB, "out": tmp_path / "out"} | change
    with pytest.raises(UsageError) as caught:
        grade(**asked, static_only=True)
    assert words in caught.value.message
    assert "\n" not in caught.value.message


@pytest.mark.parametrize("wrong", [None, 3, b"/tmp", ["a"]])
def test_what_is_no_path_is_a_mistake_of_the_program(wrong: object, tmp_path: Path) -> None:
    with pytest.raises(TypeError):
        grade(wrong, LAB, tmp_path)


@pytest.mark.parametrize("name", ["../ada", "/ada", "..", "a/../../ada"])
def test_an_id_leads_nowhere_else(name: str, tmp_path: Path) -> None:
    out = tmp_path / "in" / "out"
    try:
        result = grade(SOLUTION, LAB, out, submission_id=name, static_only=True)
    except GraderError as error:
        assert error.message  # noqa: PT017 - either will do, a file elsewhere will not
    else:
        assert (out / result.submission.id / "result.json").is_file()
    assert [path.name for path in tmp_path.iterdir()] in ([], ["in"])
    assert [path.name for path in out.parent.glob("*")] in ([], ["out"])


def test_options_are_by_name(tmp_path: Path) -> None:
    with pytest.raises(TypeError):
        grade(SOLUTION, LAB, tmp_path, "ada")


def test_hidden_criteria_stay_in_the_record(tmp_path: Path) -> None:
    text = (ROOT / "rubrics" / f"{LAB}.yaml").read_text()
    (tmp_path / "lab.yaml").write_text(
        text.replace("  - id: manifest\n", "  - id: manifest\n    visibility: hidden\n")
    )
    result = grade(
        SOLUTION, tmp_path / "lab.yaml", tmp_path, submission_id="ada", static_only=True, keep_hidden=False
    )
    written = json.loads((tmp_path / "ada" / "result.json").read_bytes())
    assert "manifest" in {c.id for c in result.criteria}
    assert "manifest" not in {c["id"] for c in written["criteria"]}


def test_everything_that_is_raised_has_its_message_and_hint(tmp_path: Path) -> None:
    with pytest.raises(GraderError) as caught:
        grade(tmp_path / "x.zip", LAB, tmp_path)
    assert str(caught.value) == caught.value.message
    assert caught.value.hint


@pytest.mark.ros
def test_a_real_grading_where_an_event_loop_runs(tmp_path: Path) -> None:
    steps: set[str] = set()
    threads: set[str] = set()

    def told(name: str, _state: str, _detail: str) -> None:
        steps.add(name)
        threads.add(threading.current_thread().name)

    async def cell() -> object:
        return grade(VICTIM, RUBRIC, tmp_path, submission_id="ada", progress=told)

    result = asyncio.run(cell())
    assert result == load_result(tmp_path / "ada")
    assert judge(tmp_path / "ada", RUBRIC).criteria == result.criteria
    assert not [c for c in result.criteria if c.status in {Status.FAIL, Status.BLOCKED, Status.ERROR}]
    assert {"intake", "package", "build", "talker", "listener"} <= steps
    assert "MainThread" not in threads


CELL = """
import asyncio, sys, threading
from grader import grade

def told(name, state, detail):
    if (name, state) == ("build", "done"):
        print("built", flush=True)

async def cell():
    return grade(sys.argv[1], sys.argv[2], sys.argv[3], progress=told)

try:
    if sys.argv[4] == "script":
        asyncio.run(cell())
    else:
        asyncio.new_event_loop().run_until_complete(cell())
except KeyboardInterrupt:
    print("interrupted", threading.active_count(), flush=True)
"""


@pytest.mark.ros
@pytest.mark.parametrize("where", ["script", "notebook"])
def test_ctrl_c_ends_it_in_order_where_a_loop_runs(where: str, tmp_path: Path) -> None:
    """asyncio.run takes Ctrl-C for itself, a notebook does not."""
    command = [sys.executable, "-c", CELL, str(VICTIM), str(RUBRIC), str(tmp_path), where]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "built\n"
        process.send_signal(signal.SIGINT)
        out, err = process.communicate()
    assert out == "interrupted 1\n", err
    assert process.returncode == 0
    assert not list(tmp_path.rglob("result.json"))
