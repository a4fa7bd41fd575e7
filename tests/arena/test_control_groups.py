"""Control groups: made ready where the grader owns one, and whose memory ran out, the tree's or the machine's."""

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

from grader.arena import control_groups
from grader.arena.control_groups import LEAF, find_cgroups, place_for_runs
from tests.arena.fake_groups import FakeGroups

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


OWN = os.getpid()
OTHERS = 61_000
UNIFIED = Path("/sys/fs/cgroup/unified")
V2 = "31 20 0:27 / {} rw,nosuid - cgroup2 cgroup rw,nsdelegate\n"


@pytest.fixture
def fake(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> FakeGroups:
    """A machine that systemd has booted, whose marks nobody can read."""
    monkeypatch.setattr(control_groups, "SYSTEMD", tmp_path)
    monkeypatch.setattr(os, "geteuid", lambda: 0)
    return FakeGroups(tmp_path / "groups", monkeypatch)


@pytest.fixture
def child() -> Iterator[int]:
    with subprocess.Popen(["/bin/cat"], stdin=subprocess.PIPE) as process:
        yield process.pid
        process.kill()


def found_in(folder: Path, fake: FakeGroups, monkeypatch: pytest.MonkeyPatch) -> control_groups.Cgroups:
    """What is found by a process that is in that group."""
    tables = fake.root.parent
    (tables / "mountinfo").write_text(V2.format(fake.root))
    (tables / "cgroup").write_text(f"0::/{folder.relative_to(fake.root)}\n")
    monkeypatch.setattr(control_groups, "MOUNTINFO", tables / "mountinfo")
    monkeypatch.setattr(control_groups, "MEMBERSHIP", tables / "cgroup")
    return control_groups.find_cgroups.__wrapped__()


@pytest.mark.parametrize("name", ["grader-17-ab.scope", "run-r0a1b.scope", "run-p12-i34.scope"])
def test_groups_of_runs_are_made_beside_the_graders_own(
    fake: FakeGroups, monkeypatch, child: int, name: str
) -> None:
    scope = fake.group(name, OWN, child)
    found = found_in(scope, fake, monkeypatch)
    assert found.memory is not None
    assert found.pids is not None
    assert (found.memory.version, found.memory.folder, found.pids.folder) == (2, str(scope), str(scope))
    assert fake.pids(scope) == []
    assert sorted(fake.pids(scope / LEAF)) == sorted([OWN, child])
    assert [path.name for path in scope.iterdir() if path.is_dir()] == [LEAF]


def test_a_process_that_a_grader_starts_finds_the_same_place(fake: FakeGroups, monkeypatch) -> None:
    scope = fake.group("grader-17-ab.scope", OWN)
    first = found_in(scope, fake, monkeypatch)
    assert first.memory is not None
    assert found_in(scope / LEAF, fake, monkeypatch) == first


def test_the_report_of_doctor_says_that_it_was_delegated(fake: FakeGroups, monkeypatch) -> None:
    scope = fake.group("grader-17-ab.scope", OWN)
    found = found_in(scope, fake, monkeypatch)
    monkeypatch.setattr(control_groups, "find_cgroups", lambda: found)
    assert "in grader-17-ab.scope, which was delegated to the grader" in control_groups.describe()


@pytest.mark.parametrize(
    ("name", "other"),
    [
        ("run-r0a1b.scope", 1),  # a process of somebody else's
        ("run-r0a1b.scope", 0),  # one that cannot be seen from here
        ("run-r0a1b.scope", os.getppid()),  # a shell that did not hand the scope over
        ("session-3.scope", None),  # systemd manages it
        ("gitlab-runner.service", None),
    ],
)
def test_what_is_not_the_graders_alone_stays_as_it_is(
    fake: FakeGroups, monkeypatch, name: str, other: int | None
) -> None:
    group = fake.group(name, OWN, *([] if other is None else [other]))
    assert found_in(group, fake, monkeypatch).memory is None
    assert OWN in fake.pids(group)
    assert not (group / LEAF).exists()


def test_what_systemd_marks_as_handed_over_is_the_graders_with_the_shell_around_it(
    fake: FakeGroups, monkeypatch
) -> None:
    unit = fake.group("lab.service", OWN, os.getppid())
    monkeypatch.setattr(
        os, "getxattr", lambda path, name: b"1" if (path, name) == (unit, "user.delegate") else b"0"
    )
    found = found_in(unit, fake, monkeypatch)
    assert found.memory is not None
    assert sorted(fake.pids(unit / LEAF)) == sorted([OWN, os.getppid()])


@pytest.mark.parametrize(
    ("name", "given"),
    [("system.slice/lab.service", True), ("user@1000.service/app.slice/lab.service", False)],
)
def test_what_root_gave_to_an_ordinary_user_is_theirs(
    fake: FakeGroups, monkeypatch, name: str, *, given: bool
) -> None:
    unit = fake.group(name, OWN)
    assert not control_groups._belongs_to_the_grader(unit)
    monkeypatch.setattr(os, "geteuid", lambda: OTHERS)
    monkeypatch.setattr(Path, "stat", lambda _path, **_more: os.stat_result([0, 0, 0, 0, OTHERS, *[0] * 5]))
    assert control_groups._belongs_to_the_grader(unit) == given


def test_where_controllers_cannot_be_switched_on_all_is_put_back(fake: FakeGroups, monkeypatch) -> None:
    scope = fake.group("grader-17-ab.scope", OWN)
    move = control_groups._move

    def meanwhile(pids: list[int], group: Path) -> None:
        move(pids, group)
        if group.name == LEAF:
            (scope / "cgroup.procs").write_text("1")  # somebody comes in

    monkeypatch.setattr(control_groups, "_move", meanwhile)
    assert found_in(scope, fake, monkeypatch).memory is None
    assert sorted(fake.pids(scope)) == [1, OWN]
    assert not (scope / LEAF).exists()


def test_a_group_whose_controllers_are_on_already_is_taken_as_it_is(fake: FakeGroups) -> None:
    scope = fake.group("grader-17-ab.scope")
    (scope / "cgroup.subtree_control").write_text("+memory +pids")
    assert place_for_runs(scope) == scope
    assert not (scope / LEAF).exists()


@pytest.fixture
def kernels() -> Iterator[Path]:
    """A group of this machine's own kernel."""
    group = UNIFIED / f"grader-test-{secrets.token_hex(6)}"
    try:
        group.mkdir()
    except OSError:
        pytest.skip("needs cgroup v2 that can be written")
    yield group
    for folder in (group / LEAF, group):
        if folder.exists():
            folder.rmdir()


MOVES = """
import os, subprocess, sys
from pathlib import Path
from grader.arena import control_groups
group = Path(sys.argv[1])
(group / "cgroup.procs").write_text(str(os.getpid()))
child = subprocess.Popen(["/bin/cat"], stdin=subprocess.PIPE)
mine = control_groups._processes(group)
assert sorted(mine) == sorted([os.getpid(), child.pid]), mine
assert control_groups._all_ours(group, mine)
assert not control_groups._all_ours(group, [*mine, 1]) and not control_groups._all_ours(group, [0])
control_groups._make_ready(group)
assert control_groups._processes(group) == []
print(Path("/proc/self/cgroup").read_text(), Path("/proc/{}/cgroup".format(child.pid)).read_text())
child.kill(), child.wait()
"""


def test_the_kernel_moves_a_process_and_its_children_into_the_leaf(kernels: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-c", MOVES, str(kernels)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.count(f"0::/{kernels.name}/{LEAF}\n") == 2
