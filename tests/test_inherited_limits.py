"""Limits of the shell that starts the grader cost nobody a mark: they are raised, or nothing is run and they are named.

Sources of what is expected: man 2 setrlimit, man 7 pthreads, the kernel's admin-guide/cgroup-v2 (pids).
"""

from __future__ import annotations

import json
import os
import resource
import threading
from pathlib import Path

import pytest

from grader.arena import inherited_limits, sandbox
from grader.arena.inherited_limits import MB, NEEDS, group, limits, make_room, tasks_of
from grader.arena.limits import RunLimits
from grader.errors import ExitCode, HostError
from grader.model.result import GradingResult
from tests import ordinary
from tests.faulty import marked_down

LAB = "leeds-comp3631-lab1"
SOLUTION = ordinary.ROOT / "reference_solutions" / LAB
by_an_ordinary_user = pytest.mark.skipif(bool(ordinary.why_not()), reason=ordinary.why_not())
SHORT = {
    "ulimit -u 20": "ulimit -u (processes) is 20",
    "ulimit -u 700": "ulimit -u (processes) is 700",
    "ulimit -n 12": "ulimit -n (open files) is 12",
    "ulimit -n 40": "ulimit -n (open files) is 40",
    "ulimit -v 60000": "ulimit -v (address space) is 59 MB",
    "ulimit -v 4000000": "ulimit -v (address space) is 3906 MB",
    "ulimit -d 400000": "ulimit -d (data) is 391 MB",
    "ulimit -s 100": "ulimit -s (stack) is 100 kB",
    "ulimit -s 4000": "ulimit -s (stack) is 4000 kB",
    "ulimit -f 10": "ulimit -f (size of a file) is 10 kB",
    "ulimit -t 1": "ulimit -t (CPU seconds) is 1 s",
    "ulimit -t 200": "ulimit -t (CPU seconds) is 200 s",
}


def result_in(out: Path) -> GradingResult | None:
    found = list(out.rglob("result.json"))
    return GradingResult.model_validate_json(found[0].read_bytes()) if found else None


@pytest.mark.full
@by_an_ordinary_user
@pytest.mark.parametrize("short", SHORT)
def test_a_limit_that_is_too_short_is_named_and_nothing_runs(open_path: Path, short: str) -> None:
    out = open_path / "home" / "out"
    done = ordinary.grader(open_path, "grade", SOLUTION, "--rubric", LAB, "--out", out, limits=short)
    assert done.returncode == ExitCode.NOT_GRADED, done.stderr
    assert SHORT[short] in done.stderr
    assert "hint: sudo prlimit --pid $$ --" in done.stderr
    assert "running" not in [line.split()[-1] for line in done.stderr.splitlines() if " build " in line]
    result = result_in(out)
    assert result is None or (result.error is not None and marked_down(result) == [])


@by_an_ordinary_user
def test_so_does_grader_check(open_path: Path) -> None:
    done = ordinary.grader(open_path, "check", SOLUTION, "--rubric", LAB, limits="ulimit -u 20")
    assert (done.returncode, done.stdout) == (ExitCode.NOT_GRADED, ""), done.stderr
    assert "ulimit -u (processes) is 20" in done.stderr


@pytest.mark.full
@by_an_ordinary_user
def test_a_class_is_refused_before_its_first_submission(open_path: Path) -> None:
    out, roster = open_path / "home" / "out", open_path / "roster.csv"
    roster.write_text(f"id,source\nada,{SOLUTION}\n")
    given = ("batch", roster, "--rubric", LAB, "--out", out)
    done = ordinary.grader(open_path, *given, "--jobs", "8", limits="ulimit -u 1000")
    assert done.returncode == ExitCode.NOT_GRADED
    assert f"a run needs {768 + 7 * 128} more" in done.stderr
    assert not out.exists()


@pytest.mark.full
@by_an_ordinary_user
def test_the_files_alone_can_be_looked_at_all_the_same(open_path: Path) -> None:
    done = ordinary.grader(open_path, "check", SOLUTION, "--rubric", LAB, "--static", limits="ulimit -n 100")
    assert done.returncode == ExitCode.PASSED, done.stderr


@pytest.mark.full
@by_an_ordinary_user
def test_the_doctor_shows_the_same(open_path: Path) -> None:
    done = ordinary.grader(open_path, "doctor", "--json", limits="ulimit -u 700; ulimit -n 40")
    rows = {row["name"]: row for row in json.loads(done.stdout)}
    assert rows["ulimit -n"]["state"] == rows["ulimit -u"]["state"] == "missing"
    assert rows["ulimit -n"]["mend"] == "sudo prlimit --pid $$ --nofile=1024:1024"
    assert rows["ulimit -f"]["state"] == "ok"


@pytest.mark.full
@pytest.mark.ros
@pytest.mark.slow
@by_an_ordinary_user
@pytest.mark.parametrize(
    "soft",
    [
        "ulimit -S -u 20 -n 40 -v 900000 -d 900000 -s 1024 -f 10 -t 2",
        "ulimit -s 4000000; ulimit -v 8388608",
    ],
    ids=["too-short", "stacks-of-4-GB"],
)
def test_limits_that_may_be_raised_cost_nothing(open_path: Path, soft: str) -> None:
    """Each thread takes as much address space as the stack may: with 4 GB, no node could start its threads."""
    out = open_path / "home" / "out"
    done = ordinary.grader(open_path, "grade", SOLUTION, "--rubric", LAB, "--out", out, limits=soft)
    result = result_in(out)
    assert result is not None, done.stderr
    assert (done.returncode, result.points) == (ExitCode.PASSED, result.max_points), done.stdout


def test_a_run_needs_what_its_processes_may_have() -> None:
    needs = {need.option: need.run for need in NEEDS}
    most = RunLimits()
    assert needs["nproc"] > most.tasks == inherited_limits.TASKS
    assert (needs["nofile"], needs["as"]) == (most.open_files, most.address_space_bytes)
    assert needs["fsize"] > max(most.file_bytes, most.built_bytes, most.run_bytes)
    assert needs["cpu"] == most.cpu_s + 10
    assert all(need.own < need.run for need in NEEDS)


def test_what_the_user_runs_already_is_counted(tmp_path: Path, monkeypatch) -> None:
    uid = os.getuid()
    for pid, (owner, threads) in {"7": (uid, 30), "12": (uid + 1, 500), "900": (uid, 70)}.items():
        (tmp_path / pid).mkdir()
        (tmp_path / pid / "status").write_text(
            f"Name:\tx\nUid:\t{owner}\t0\t0\t0\nThreads:\t{threads}\nFoo:\t1\n"
        )
    (tmp_path / "self").mkdir()
    monkeypatch.setattr(inherited_limits, "PROC", tmp_path)
    monkeypatch.setattr(inherited_limits, "_is_root", lambda: False)
    assert tasks_of(uid) == 100
    needed = inherited_limits.TASKS + inherited_limits.OTHER_TASKS + 100
    for hard, command in ((needed, False), (needed - 1, True), (-1, False)):
        monkeypatch.setattr(inherited_limits.resource, "getrlimit", lambda _, hard=hard: (hard, hard))
        assert bool(next(limits()).command) is command


def test_a_control_group_without_room_is_named(tmp_path: Path, monkeypatch) -> None:
    inner = tmp_path / "user.slice" / "session"
    inner.mkdir(parents=True)
    (inner / "pids.max").write_text("max\n")
    (inner / "pids.current").write_text("40\n")
    (inner.parent / "pids.max").write_text("200\n")
    (inner.parent / "pids.current").write_text("60\n")
    monkeypatch.setattr("grader.arena.control_groups.own_groups", lambda _: [(2, inner)])
    found = list(group())
    assert [(one.name, one.found) for one in found] == [("pids.max", "200, with 60 in use")]
    assert found[0].command == f"echo {60 + 768} > {inner.parent}/pids.max"
    monkeypatch.setattr(inherited_limits, "limits", lambda _: iter(()))
    with pytest.raises(HostError, match=r"pids\.max .* is 200, with 60 in use"):
        sandbox.choose_sandbox("none")
    make_room(begin=True)
    (inner.parent / "pids.max").write_text("100000\n")
    sandbox.choose_sandbox("none")


@pytest.fixture
def _as_before():
    kept = {need.number: resource.getrlimit(need.number) for need in NEEDS}
    size = threading.stack_size()
    yield
    threading.stack_size(size)
    for number, pair in kept.items():
        resource.setrlimit(number, pair)


@pytest.mark.usefixtures("_as_before")
def test_the_stack_is_as_large_as_everywhere() -> None:
    """What is unlimited changes how the kernel lays out a process, what is large leaves room for few threads."""
    hard = resource.getrlimit(resource.RLIMIT_STACK)[1]
    if 0 <= hard < 64 * MB:
        pytest.skip("the stack is bounded here")
    for soft in (64 * MB, 4 * MB, hard):
        resource.setrlimit(resource.RLIMIT_STACK, (soft, hard))
        make_room()
        assert resource.getrlimit(resource.RLIMIT_STACK) == (8 * MB, hard)
