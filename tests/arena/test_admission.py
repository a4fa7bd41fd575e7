"""Starts one per core, fewer on a late machine; runs that nothing may disturb; locks that end with their holders."""

from __future__ import annotations

import asyncio
import os
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import pytest

from grader.arena import admission
from grader.arena import admission as module
from grader.arena.admission import Admission, FileLock, shared_folder
from grader.arena.recorder import Recorder
from grader.arena.recording_files import RunCost
from grader.intake.open import open_submission
from grader.model.result import Silence
from grader.package.facts import read_packages
from grader.rubric.load import load_rubric

REFERENCE = Path(__file__).parents[2] / "reference_solutions" / "leeds-comp3631-lab1"

PATIENCE_S = 600.0


class Diary:
    """Who is in now, and how many were at most."""

    def __init__(self) -> None:
        self.inside: list[str] = []
        self.most = 0
        self.order: list[str] = []

    async def stay(self, name: str, leave: asyncio.Event) -> None:
        self.inside.append(name)
        self.order.append(name)
        self.most = max(self.most, len(self.inside))
        await leave.wait()
        self.inside.remove(name)


async def until(condition: Callable[[], bool]) -> None:
    deadline = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < deadline
        await asyncio.sleep(0.005)


async def once(admission: Admission) -> None:
    async with admission.start():
        pass


async def start(admission: Admission, name: str, diary: Diary, leave: asyncio.Event) -> None:
    async with admission.start():
        await diary.stay(name, leave)


async def run(
    admission: Admission, name: str, diary: Diary, leave: asyncio.Event, *, alone: bool = False
) -> None:
    async with admission.run(alone=alone):
        await diary.stay(name, leave)


def test_as_many_starts_as_there_are_cores_in_the_order_of_asking(tmp_path: Path) -> None:
    async def main() -> Diary:
        admission, diary = Admission(tmp_path, starts=2), Diary()
        leave = [asyncio.Event() for _ in range(6)]
        tasks = [asyncio.create_task(start(admission, str(i), diary, leave[i])) for i in range(6)]
        for number in range(6):
            await until(lambda n=number: len(diary.order) == min(n + 2, 6))
            leave[number].set()
        await asyncio.gather(*tasks)
        return diary

    diary = asyncio.run(main())
    assert diary.most == 2
    assert diary.order == [str(i) for i in range(6)]


def test_a_start_that_is_over_makes_room_before_its_run_ends(tmp_path: Path) -> None:
    async def main() -> list[str]:
        admission = Admission(tmp_path, starts=1)
        async with admission.start() as first:
            first.release()
            first.release()
            order = ["released"]
            await asyncio.wait_for(once(admission), PATIENCE_S)
            order.append("another started")
        return [*order, "the run ended"]

    assert asyncio.run(main()) == ["released", "another started", "the run ended"]


def test_a_late_machine_starts_fewer_but_always_one(tmp_path: Path) -> None:
    async def let_in(late_ms: float, count: int) -> int:
        """How many are in a while after `count` of eight were."""
        admission, diary, leave = Admission(tmp_path, starts=4), Diary(), asyncio.Event()
        admission.note_lateness(late_ms)
        tasks = [asyncio.create_task(start(admission, str(i), diary, leave)) for i in range(8)]
        await until(lambda: len(diary.inside) >= count)
        for _ in range(10):
            admission.note_lateness(late_ms)
            await asyncio.sleep(module.LOOK_S)
        found = len(diary.inside)
        leave.set()
        await asyncio.gather(*tasks)
        return found

    for late_ms, count in ((2.0, 4), (21.0, 2), (1e9, 1), (float("nan"), 4)):
        assert asyncio.run(let_in(late_ms, count)) == count


def test_lateness_is_forgotten_and_survives_a_damaged_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "admission"
    assert admission.latest_ms(path) == 0
    admission.note(path, 7.5)
    assert admission.latest_ms(path) == 7.5
    monkeypatch.setattr(admission, "FRESH_S", 0.0)
    assert admission.latest_ms(path) == 0
    path.write_bytes(os.urandom(5000))
    assert admission.latest_ms(path) == 0


def test_alone_waits_for_the_others_and_the_others_wait_for_it(tmp_path: Path) -> None:
    async def main() -> list[str]:
        mine, theirs, diary = Admission(tmp_path), Admission(tmp_path), Diary()
        leave = {name: asyncio.Event() for name in ("one", "two", "alone", "later")}
        tasks = [asyncio.create_task(run(theirs, name, diary, leave[name])) for name in ("one", "two")]
        await until(lambda: len(diary.inside) == 2)
        tasks.append(asyncio.create_task(run(mine, "alone", diary, leave["alone"], alone=True)))
        await asyncio.sleep(3 * module.LOOK_S)
        tasks.append(asyncio.create_task(run(theirs, "later", diary, leave["later"])))
        leave["one"].set()
        await asyncio.sleep(3 * module.LOOK_S)
        assert diary.inside == ["two"]
        leave["two"].set()
        await until(lambda: diary.inside == ["alone"])
        await asyncio.sleep(3 * module.LOOK_S)
        assert diary.inside == ["alone"]
        leave["alone"].set()
        await until(lambda: diary.inside == ["later"])
        leave["later"].set()
        await asyncio.gather(*tasks)
        return diary.order

    assert asyncio.run(main())[2:] == ["alone", "later"]


def test_without_memory_one_run_goes_on_and_the_others_wait(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "available_bytes", lambda: 0)

    async def main() -> None:
        admission, diary = Admission(tmp_path), Diary()
        leave = {name: asyncio.Event() for name in ("one", "two")}
        tasks = [asyncio.create_task(run(admission, name, diary, leave[name])) for name in leave]
        await until(lambda: len(diary.inside) == 1)
        await asyncio.sleep(5 * module.LOOK_S)
        first = diary.inside[0]
        assert diary.inside == [first]
        leave[first].set()
        await until(lambda: len(diary.order) == 2)
        for event in leave.values():
            event.set()
        await asyncio.gather(*tasks)

    asyncio.run(main())


HOLDER = """
import sys, time
from pathlib import Path
from grader.arena.admission import FileLock
lock = FileLock(Path(sys.argv[1]))
assert lock.take()
print('held', flush=True)
time.sleep(600)
"""


def test_what_a_killed_grader_held_is_free(tmp_path: Path) -> None:
    path = tmp_path / "start-0"
    with subprocess.Popen([sys.executable, "-c", HOLDER, str(path)], stdout=subprocess.PIPE) as holder:
        assert holder.stdout is not None
        assert holder.stdout.readline() == b"held\n"
        with FileLock(path) as lock:
            assert not lock.take()
            holder.kill()
            holder.wait()
            assert lock.take()


def test_a_wait_that_is_broken_off_holds_nothing(tmp_path: Path) -> None:
    async def main() -> None:
        admission, diary, leave = Admission(tmp_path, starts=1), Diary(), asyncio.Event()
        first = asyncio.create_task(start(admission, "first", diary, leave))
        await until(lambda: diary.inside == ["first"])
        second = asyncio.create_task(start(admission, "second", diary, leave))
        await asyncio.sleep(2 * module.LOOK_S)
        second.cancel()
        with pytest.raises(asyncio.CancelledError):
            await second
        leave.set()
        await first
        await asyncio.wait_for(once(admission), PATIENCE_S)

    asyncio.run(main())


def test_nobody_waits_without_a_folder() -> None:
    async def main() -> Diary:
        admission, diary, leave = Admission(None, starts=1), Diary(), asyncio.Event()
        admission.note_lateness(1000)
        tasks = [asyncio.create_task(start(admission, str(i), diary, leave)) for i in range(3)]
        tasks += [asyncio.create_task(run(admission, "alone", diary, leave, alone=True)) for _ in range(2)]
        await until(lambda: len(diary.inside) == 5)
        leave.set()
        await asyncio.gather(*tasks)
        return diary

    assert asyncio.run(main()).most == 5


def test_the_folder_is_ours_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    runtime, temporary = tmp_path / "runtime", tmp_path / "tmp"
    runtime.mkdir()
    temporary.mkdir()
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(runtime))
    monkeypatch.setattr("tempfile.tempdir", str(temporary))
    mine = shared_folder()
    assert mine == runtime / "ros-lab-grader"
    assert mine.stat().st_mode & 0o777 == 0o700
    mine.chmod(0o777)
    other = shared_folder()
    assert other == temporary / f"ros-lab-grader-{os.geteuid()}"
    other.rmdir()
    other.symlink_to(runtime)
    assert shared_folder() is None
    monkeypatch.setenv("XDG_RUNTIME_DIR", "relative")
    assert shared_folder() is None


def test_the_memory_of_a_container_counts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "meminfo").write_text("MemTotal: 9000 kB\nMemAvailable:    4000 kB\n")
    (tmp_path / "memory.max").write_text("3000000\n")
    (tmp_path / "memory.current").write_text("2500000\n")
    (tmp_path / "memory.stat").write_text("anon 1\ninactive_file 500000\n")
    monkeypatch.setattr(admission, "MEMINFO", tmp_path / "meminfo")
    monkeypatch.setattr(admission, "CONTAINER", ())
    assert admission.available_bytes() == 4000 * 1024
    place = (tmp_path, "memory.max", "memory.current", "inactive_file")
    monkeypatch.setattr(admission, "CONTAINER", (place,))
    assert admission.available_bytes() == 1_000_000
    (tmp_path / "memory.max").write_text("max\n")
    assert admission.available_bytes() == 4000 * 1024


@pytest.mark.ros
def test_runs_of_a_later_loop_wait_for_each_other_as_those_of_the_first(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each call of a recorder has an event loop of its own. A lock knows only one loop, but only once two wait."""
    started: list[str] = []

    async def run_scenario(name: str, *_: object, admission: Admission, **__: object) -> RunCost:
        async with admission.start():
            started.append(name)
            await asyncio.sleep(0)
        return RunCost(cpu_s=0.0, student_cpu_s=0.0)

    monkeypatch.setattr("grader.arena.recorder.run_scenario", run_scenario)
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0})
    rubric = load_rubric("leeds-comp3631-lab1").rubric
    submission = open_submission(str(REFERENCE), package=rubric.package, workdir=tmp_path / "opened")
    facts = read_packages(submission, rubric.launch_commands)
    with Recorder(
        submission, facts, rubric, tmp_path / "evidence", mode="auto", progress=Silence()
    ) as recorder:
        recorder.record_all(lambda: None)
        recorder.repeat(rubric.scenarios, tmp_path / "again")
    assert Counter(started) == dict.fromkeys(rubric.scenarios, 2)
