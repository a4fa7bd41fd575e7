"""Whose memory ran out: the tree's, which broke its limit, or the machine's."""

from __future__ import annotations

import os
import secrets
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from grader.arena.control_groups import find_cgroups

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "grader" / "arena" / "ros"))
from process_tree import LOOK_S, Groups, TreeRest, descendants, read_stat

FOUND = find_cgroups().memory
MB = 1 << 20
EAT = "import sys; open(sys.argv[1] + '/cgroup.procs', 'w').write('0'); bytearray(300 << 20)"


@pytest.fixture
def machine() -> Iterator[Path]:
    """A group that stands for a machine with 100 MB."""
    if FOUND is None or FOUND.version != 1:
        pytest.skip("needs control groups of version 1 that can be written")
    folder = Path(FOUND.folder, f"grader-machine-{secrets.token_hex(4)}")
    folder.mkdir()
    (folder / "memory.use_hierarchy").write_text("1")
    (folder / "memory.limit_in_bytes").write_text(str(100 * MB))
    yield folder
    folder.rmdir()


@pytest.mark.parametrize(("limit_mb", "kills"), [(60, 1), (1000, 0)], ids=["the tree's", "the machine's"])
def test_a_kill_counts_where_the_tree_reached_its_own_limit(machine: Path, limit_mb: int, kills: int) -> None:
    limits = {"memory_bytes": limit_mb * MB, "tasks": 100}
    groups = Groups({"memory": {"version": 1, "folder": str(machine)}}, limits)
    (folder,) = (path for path in machine.iterdir() if path.is_dir())
    done = subprocess.run([sys.executable, "-c", EAT, str(folder)], check=False)
    assert done.returncode == -9
    assert groups.memory_kills() == kills
    assert groups.remove()


@pytest.mark.parametrize(
    ("events", "kills"),
    [
        ("max 9\noom 1\noom_kill 1\n", 1),
        ("max 0\noom 0\noom_kill 1\n", 0),
        ("oom 1\noom_kill 0\n", 0),
        ("", 0),
    ],
)
def test_events_of_version_2(tmp_path: Path, events: str, kills: int) -> None:
    groups = Groups({"memory": {"version": 2, "folder": str(tmp_path)}}, {"memory_bytes": MB, "tasks": 1})
    (folder,) = tmp_path.iterdir()
    (folder / "memory.events").write_text(events)
    assert groups.memory_kills() == kills


def test_version_2_has_one_group_for_all(tmp_path: Path) -> None:
    found = {name: {"version": 2, "folder": str(tmp_path)} for name in ("memory", "pids", "cpuacct")}
    groups = Groups(found, {"memory_bytes": 64 * MB, "tasks": 7})
    (folder,) = tmp_path.iterdir()
    assert ((folder / "memory.max").read_text(), (folder / "pids.max").read_text()) == (str(64 * MB), "7")
    groups.take([4711])
    assert (folder / "cgroup.procs").read_text() == "4711"
    assert groups.pids() == [4711]
    (folder / "cpu.stat").write_text("usage_usec 2500000\nuser_usec 1\n")
    assert groups.cpu_s() == 2.5
    assert not groups.remove()
    for path in folder.iterdir():
        path.unlink()
    assert groups.remove()
    assert groups.pids() == []


def test_only_programs_that_start_no_other_count_as_last() -> None:
    """A shell with a program below it is one program, and the shell alone is one, too."""
    command = (
        "import subprocess, time; print(subprocess.Popen(['sleep', '60']).pid, flush=True); time.sleep(60)"
    )
    with subprocess.Popen([sys.executable, "-c", command], stdout=subprocess.PIPE) as upper:
        assert upper.stdout is not None
        lower = int(upper.stdout.readline())
        assert TreeRest().look([upper.pid, lower], 1.0)[1] == 1
        assert TreeRest().look([upper.pid], 1.0)[1] == 1
        assert descendants(upper.pid) == [lower]
        os.kill(lower, signal.SIGKILL)
        upper.kill()


@pytest.mark.parametrize(
    ("program", "kinds"),
    [
        ("while True: pass", {"computes", "stuck"}),
        pytest.param("x = 0\nwhile True: x += 1", {"computes", "stuck"}, marks=pytest.mark.full),
        (
            "x = []\nwhile True: x += [bytes(50000), sum(range(100000))]",
            {None},
        ),  # it may be loading something
        ("import time\nwhile True: time.sleep(0.1)", {"loops"}),
        ("import time\nwhile True: time.sleep(0.9)", {"naps"}),
    ],
)
def test_who_works_in_the_same_memory_computes(program: str, kinds: set[str | None]) -> None:
    with subprocess.Popen([sys.executable, "-c", program]) as process:
        try:
            rest, begun_s = TreeRest(), time.monotonic()
            found: list[str | None] = []
            while time.monotonic() < begun_s + 60:
                time.sleep(LOOK_S)
                found.append(rest.look([process.pid], time.monotonic())[0])
                if found[-1] in kinds - {None} or (None in kinds and read_stat(process.pid)[1] > 1.6):
                    break
            assert found[-1] in kinds, found
        finally:
            process.kill()


WAITS = "threading.Thread(target=lambda: [sum([0]) or time.sleep(0.1) for _ in range(9000)]).start()"
TWICE = "lock = threading.Lock()\nlock.acquire()\nlock.acquire()"
IN_TIME = "threading.Thread(target=lambda: threading.Event().wait(100), daemon=True).start()"
WAITING = {
    "compiled, for its threads": (WAITS, "loops"),
    "for its threads": (WAITS, None),
    "for itself": (TWICE, "loops"),
    "for itself, a thread in vain": (
        f"threading.Thread(target=lambda: [threading.Event().wait(0.5) for _ in range(99)]).start()\n{TWICE}",
        "loops",
    ),
    "in one long sleep": ("time.sleep(100)", None),
    "with a limit": ("threading.Event().wait(100)", None),
    "for itself, a thread with a limit": (f"{IN_TIME}\n{TWICE}", None),
    "for itself, a thread that works": (f"{WAITS}\n{TWICE}", None),
    "for itself, a thread that looks": (
        f"threading.Thread(target=lambda: select.select([], [], [], 0.1), daemon=True).start()\n{TWICE}",
        "loops",
    ),
    "for itself, a thread that looks later": (
        f"threading.Thread(target=lambda: select.select([], [], [], 99), daemon=True).start()\n{TWICE}",
        None,
    ),
}
"""Programs that wait, and how they rest: one that sets itself a limit may do anything after it."""


@pytest.fixture(scope="module")
def found() -> Iterator[dict[str, list[str | None]]]:
    """How each of them rests, look by look, until all have been so five times, for a minute at most."""
    command = [sys.executable, "-c", "import select, sys, threading, time\nexec(sys.argv[1])"]
    with ExitStack() as stack, pytest.MonkeyPatch.context() as patch:
        programs = {}
        for name, (program, _) in WAITING.items():
            programs[name] = stack.enter_context(subprocess.Popen([*command, program]))
            stack.callback(programs[name].kill)
        compiled = programs["compiled, for its threads"].pid
        patch.setattr("process_tree._is_compiled", lambda pid: pid == compiled)
        rests = {name: TreeRest() for name in programs}
        looks: dict[str, list[str | None]] = {name: [] for name in programs}
        for _ in range(round(60 / LOOK_S)):
            time.sleep(LOOK_S)
            for name, rest in rests.items():
                looks[name].append(rest.look([programs[name].pid], time.monotonic())[0])
            if len(looks[name]) >= 20 and all(looks[one][-5:] == [WAITING[one][1]] * 5 for one in looks):
                break
        yield looks


@pytest.mark.parametrize("program", WAITING)
def test_a_program_rests_while_nothing_can_wake_it(program: str, found: dict[str, list[str | None]]) -> None:
    assert found[program][-5:] == [WAITING[program][1]] * 5, found[program]


NOT_WAITED_FOR = """
import os, signal, sys, time
if sys.argv[1] == "ignore":
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)
with open(sys.argv[2] + "/cgroup.procs", "w") as file: file.write("0")
for _ in range(3):
    pid = os.fork()
    if not pid:
        until = time.process_time() + 0.2
        while time.process_time() < until: pass
        os._exit(0)
    try:
        os.waitpid(pid, 0)
    except ChildProcessError:
        pass
"""


@pytest.mark.full
@pytest.mark.parametrize("how", ["ignore", "wait"])
def test_time_of_children_that_nobody_waited_for_is_counted(how: str) -> None:
    found = find_cgroups().cpuacct
    if found is None:
        pytest.skip("needs a control group that counts CPU time")
    groups = Groups({"cpuacct": found.model_dump()}, {"memory_bytes": 1, "tasks": 1})
    ((_, folder),) = groups._made.values()
    subprocess.run([sys.executable, "-c", NOT_WAITED_FOR, how, folder], check=True)
    assert 0.6 <= groups.cpu_s() < 30
    assert groups.remove()
