"""A control group that belongs to the grader is made ready for groups of runs; nobody else's is touched."""

from __future__ import annotations

import os
import secrets
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from grader.arena import control_groups
from grader.arena.control_groups import LEAF, place_for_runs
from tests.arena.fake_groups import FakeGroups

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
