"""Worker processes: whatever a job does to its process, the other jobs are done."""

from __future__ import annotations

import atexit
import json
import os
import pickle
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from unittest.mock import patch

import pytest

from grader import workers
from grader.errors import HostError
from grader.workers import HEAD_BYTES, Worker, WorkerEnded, WorkerLimits, run_each
from tests.support.processes import children_of, lives, until

ROOT = Path(__file__).resolve().parent.parent
PARENT = """
import sys
from tests.test_workers import sleep
from grader.workers import Worker
Worker().run(sleep, sys.argv[1])
"""
LIMITS = WorkerLimits(memory_bytes=1 << 30, cpu_s=2.0, wall_s=120.0)


@pytest.fixture(autouse=True)
def _importable(monkeypatch) -> None:
    monkeypatch.setenv("PYTHONPATH", str(ROOT))


@pytest.fixture(scope="module")
def template() -> Iterator[workers.Template | None]:
    """One process has imported what this module needs, for all of its tests: each would take half a second for it."""
    made = workers._template(2, "tests.test_workers", {"PYTHONPATH": str(ROOT)})
    yield made
    if made is not None:
        made.close()


@pytest.fixture
def worker(template: workers.Template | None) -> Iterator[Worker]:
    made = Worker(LIMITS, template=template)
    yield made
    made.close()


def pid(_: object) -> int:
    return os.getpid()


def take_memory(_: object) -> int:
    return len(bytearray(8 << 30))


def compute(_: object) -> None:
    re.match(r"(a+)+$", "a" * 60 + "b")


def kill(_: object) -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def fail(_: object) -> None:
    raise HostError("no room", hint="make some")


def sleep(path: str) -> None:
    """As a grading does: it cleans up when it is interrupted."""
    Path(path).write_text("asleep")
    try:
        time.sleep(3600)
    finally:
        Path(path).unlink()


def harm(number: int) -> int:
    print("what a job prints does not reach its parent")
    if number == 3:
        kill(None)
    return number * number


def test_one_process_does_many_jobs() -> None:
    worker = Worker(LIMITS)
    assert worker.run(pid, 1) == worker.run(pid, 2) != os.getpid()
    worker.close()


@pytest.mark.parametrize(
    ("job", "how"), [(kill, "by signal 9"), pytest.param(compute, "by signal", marks=pytest.mark.full)]
)
def test_what_ends_a_process_costs_its_job(job, how: str, worker: Worker) -> None:
    with pytest.raises(WorkerEnded, match=how):
        worker.run(job, None)
    assert worker.run(harm, 2) == 4


@pytest.mark.full
def test_a_job_is_limited_in_time(tmp_path: Path) -> None:
    worker = Worker(WorkerLimits(wall_s=1.0))
    with pytest.raises(WorkerEnded, match="by signal 9"):
        worker.run(sleep, str(tmp_path / "mark"))
    worker.close()


def test_what_a_job_raises_is_raised(worker: Worker) -> None:
    with pytest.raises(MemoryError):
        worker.run(take_memory, None)
    with pytest.raises(HostError, match="no room") as caught:
        worker.run(fail, None)
    assert caught.value.hint == "make some"


class Evil:
    """What a child that was taken over would like its parent to load."""

    def __reduce__(self) -> tuple:
        return os.putenv, ("GRADER_TAKEN_OVER", "yes")


def answer_with(message: bytes) -> int:
    """As a job that was taken over: write an answer of its own to the pipe, which only it and its parent hold."""
    for pipe in range(3, 20):
        with suppress(OSError):
            os.write(pipe, len(message).to_bytes(HEAD_BYTES, "big") + message)
    return 1


CALL = {"raised": "eval", "message": "exit(9)", "hint": ""}


@pytest.mark.parametrize(
    ("answer", "raised"),
    [
        (pickle.dumps((False, Evil())), WorkerEnded),
        (b"not json", WorkerEnded),
        (b'{"result": "os.system"}', WorkerEnded),
        (b'{"result": 1, "raised": "OSError"}', WorkerEnded),
        (json.dumps(CALL).encode(), RuntimeError),
        (json.dumps({**CALL, "raised": "SystemExit"}).encode(), RuntimeError),
        (json.dumps({**CALL, "raised": "Literal"}).encode(), RuntimeError),
    ],
    ids=["pickle", "words", "wrong-type", "both", "function", "exit", "import"],
)
def test_an_answer_cannot_run_code_in_the_parent(answer: bytes, raised: type, worker: Worker) -> None:
    with (
        patch.object(pickle, "loads", side_effect=AssertionError("unpickled")),
        pytest.raises(raised) as caught,
    ):
        worker.run(answer_with, answer)
    assert raised is WorkerEnded or str(caught.value) == f"{json.loads(answer)['raised']}: exit(9)"
    assert raised is not WorkerEnded or worker.run(harm, 2) == 4


def test_an_answer_without_end_is_not_read(worker: Worker, monkeypatch) -> None:
    monkeypatch.setattr(workers, "ANSWER_BYTES_MAX", 10)
    with pytest.raises(WorkerEnded):
        worker.run(say_much, 100)


def say_much(count: int) -> str:
    return "a" * count


def mark_at_exit(path: str) -> None:
    atexit.register(Path(path).touch)


def test_a_worker_that_is_closed_leaves_as_every_python_does(worker: Worker, tmp_path: Path) -> None:
    """What jobs share, such as an arena's template, is ended at exit, and its CPU time counts as the worker's."""
    worker.run(mark_at_exit, str(tmp_path / "mark"))
    worker.close()
    assert (tmp_path / "mark").exists()


@pytest.mark.full
def test_every_job_has_a_result() -> None:
    begun: list[int] = []
    found = run_each(harm, range(6), 2, begun=begun.append, ended=lambda job, error: f"{job} {error.reason}")
    assert sorted(map(str, found)) == ["0", "1", "16", "25", "3 ended by signal 9", "4"]
    assert begun == list(range(6))


@pytest.mark.full
def test_a_caller_that_stops_leaves_nothing_running(tmp_path: Path) -> None:
    before, mark = children_of(os.getpid()), tmp_path / "mark"
    found = run_each(_sleep_or_wait, [("sleep", str(mark)), ("wait", str(mark))], 2, ended=lambda *_: "ended")
    assert next(found) == "asleep"
    found.close()
    assert children_of(os.getpid()) == before
    assert not mark.exists()


def _sleep_or_wait(job: tuple[str, str]) -> str:
    what, path = job
    if what == "sleep":
        sleep(path)
    until(Path(path).exists)
    return "asleep"


@pytest.mark.full
def test_an_idle_process_ends_and_a_new_one_does_the_next_job() -> None:
    worker = Worker(WorkerLimits(idle_s=0.1))
    first = worker.run(pid, None)
    until(lambda: not lives(first))
    assert worker.run(pid, None) != first
    worker.close()


@pytest.mark.full
def test_a_process_whose_parent_was_killed_cleans_up(tmp_path: Path) -> None:
    mark = tmp_path / "mark"
    parent = subprocess.Popen([sys.executable, "-c", PARENT, str(mark)], cwd=ROOT)
    until(mark.exists)
    (child,) = children_of(parent.pid)
    parent.kill()
    parent.wait()
    until(lambda: not lives(child))
    assert not mark.exists()


@pytest.mark.full
def test_workers_are_copies_of_one_process_that_has_seen_no_job(tmp_path: Path) -> None:
    """What the template did is there in each, what a job did in none but its own."""
    found = list(run_each(_seen, [0.5, 0.5], 2, ended=lambda *_: (), warm_up="tests.test_workers:_warm_up"))
    (template,) = {seen[0] for seen in found}
    assert template not in {0, os.getpid()}
    assert len({seen[1] for seen in found}) == 2
    assert [seen[2] for seen in found] == [1, 1]
    until(lambda: not lives(template))


_made_by: list[int] = []
_jobs: list[float] = []


def _warm_up() -> None:
    _made_by.append(os.getpid())


def _seen(pause_s: float) -> tuple[int, ...]:
    _jobs.append(pause_s)
    time.sleep(pause_s)
    return sum(_made_by), os.getpid(), len(_jobs)


@pytest.mark.full
def test_a_template_that_was_killed_costs_no_job(tmp_path: Path) -> None:
    found = run_each(_kill_template, range(3), 2, ended=lambda *_: -1, warm_up="tests.test_workers:_warm_up")
    assert sorted(found) == [0, 1, 2]


def _kill_template(number: int) -> int:
    for pid in _made_by:
        with suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)
    return number
