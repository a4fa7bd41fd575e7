"""What a student's process can reach, write and use up."""

from __future__ import annotations

import asyncio
import errno
from pathlib import Path

import pytest

from grader.arena import control_groups, sandbox
from grader.arena.build import build
from grader.arena.control_groups import Cgroup, Cgroups
from grader.arena.limits import SUBMISSION_MESSAGE_BYTES, RunLimits
from grader.arena.sandbox import why_no_sandbox
from grader.evidence.reader import load_run
from grader.evidence.run import Run
from grader.evidence.writer import EvidenceWriter
from tests.arena.support import CMAKE, SCRIPT, exit_of, make_place, printed, run_script

pytestmark = pytest.mark.ros
needs_sandbox = pytest.mark.skipif(bool(why_no_sandbox()), reason=f"no sandbox here: {why_no_sandbox()}")
SMALL = RunLimits(home_bytes=6 << 20, tmp_bytes=4 << 20, shared_bytes=2 << 20)


def limits_met(run: Run) -> list[str]:
    return [event.detail for _, event in run.actors if event.action == "limit"]


@needs_sandbox
def test_only_memory_of_fixed_size_can_be_written(tmp_path: Path) -> None:
    code = """
import os
for line in open("/proc/self/mountinfo"):
    left, right = line.split(" - ")
    point, kind = left.split()[4], right.split()[0]
    try:
        open(os.path.join(point, "grader-was-here"), "w").close()
        print("wrote", point, kind)
    except OSError:
        pass
for folder in ("/dev", "/", "/run", "/run/grader", "/home", "/etc", "/proc", "/sys", "/var", "/root"):
    try:
        os.mkdir(folder + "/grader-was-here")
        print("wrote", folder, "folder")
    except OSError:
        pass
def fill(folder):
    size = 0
    for number in range(64):
        try:
            with open("%s/block%d" % (folder, number), "wb", buffering=0) as file:
                size += file.write(bytes(1 << 20))
        except OSError as error:
            return size, error.errno
    return size, None
for folder in ("/tmp", "/dev/shm", os.environ["HOME"]):
    print("filled", folder, *fill(folder))
"""
    run = run_script(tmp_path, code, limit_s=20, limits=SMALL)
    lines = printed(run)
    wrote = {tuple(line.split()[1:]) for line in lines if line.startswith("wrote")}
    assert wrote == {("/tmp", "tmpfs"), ("/dev/shm", "tmpfs"), ("/home/student", "tmpfs")}, lines
    filled = {line.split()[1]: line.split()[2:] for line in lines if line.startswith("filled")}
    assert set(filled) == {"/tmp", "/dev/shm", "/home/student"}
    for folder, (size, number) in filled.items():
        assert int(number) == errno.ENOSPC, folder
        assert int(size) <= 6 << 20, folder


@needs_sandbox
def test_nothing_nests_and_nobody_gains_rights(tmp_path: Path) -> None:
    code = """
import ctypes, os
libc = ctypes.CDLL(None, use_errno=True)
for name, flag in (("user", 0x10000000), ("net", 0x40000000), ("mount", 0x00020000)):
    print(name, libc.unshare(flag))
print("mount", libc.mount(b"none", b"/tmp", b"tmpfs", 0, None))
status = dict(line.split(":", 1) for line in open("/proc/self/status"))
print("capabilities", int(status["CapEff"], 16), int(status["CapPrm"], 16), "new", status["NoNewPrivs"].strip())
print("limits", open("/proc/self/limits").read().count("unlimited") >= 0)
"""
    lines = printed(run_script(tmp_path, code, limit_s=10))
    assert {"user -1", "net -1", "mount -1", "capabilities 0 0 new 1"} <= set(lines), lines


@needs_sandbox
def test_the_grader_is_out_of_sight_wherever_it_is_installed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sandbox, "OWN_FOLDER", Path("/usr/share/doc"))
    code = "import os\nprint('found', os.listdir('/usr/share/doc'))\nopen('/usr/share/doc/x', 'w')\n"
    lines = printed(run_script(tmp_path, code, limit_s=10))
    assert "found []" in lines


@needs_sandbox
def test_memory_is_that_of_the_whole_tree(tmp_path: Path) -> None:
    """Eight children that stay small each, and files in memory."""
    code = """
import os, time
for number in range(8):
    if os.fork() == 0:
        block = bytearray(os.urandom(1 << 20)) * 40
        time.sleep(60)
for number in range(4):
    with open("/dev/shm/block%d" % number, "wb") as file:
        file.write(bytes(8 << 20))
time.sleep(60)
"""
    run = run_script(tmp_path, code, limit_s=20, limits=RunLimits(memory_bytes=200 << 20))
    assert exit_of(run).stopped_by == "KILL"
    assert limits_met(run) == ["stopped by the grader: more than 200 MB of memory"]


@pytest.mark.parametrize("kind", ["auto", "none"])
def test_without_cgroups_a_watchdog_holds_memory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    monkeypatch.setattr(sandbox, "find_cgroups", Cgroups)
    code = "import time\nblocks = []\nwhile True:\n    blocks.append(bytearray(20 << 20))\n    time.sleep(0.05)\n"
    run = run_script(tmp_path, code, limit_s=20, limits=RunLimits(memory_bytes=200 << 20), sandbox=kind)
    assert exit_of(run).stopped_by == "KILL"
    assert limits_met(run) == ["stopped by the grader: more than 200 MB of memory"]


SOCKETS = """
import os, socket, time
def fill():
    kept = []
    while len(kept) < 600:  # of ten processes, fewer than may be open
        near, far = socket.socketpair()
        near.setblocking(False)
        kept += [near, far]
        try:
            while True: near.send(bytes(65536))
        except BlockingIOError:
            pass
    time.sleep(60)
for _ in range(10):
    if os.fork() == 0:
        try:
            fill()
        except OSError:
            time.sleep(60)
time.sleep(60)
"""
TCP = """
import socket, time
kept = [socket.create_server(("127.0.0.1", 0))]
while True:
    near = socket.create_connection(kept[0].getsockname())
    near.setblocking(False)
    kept += [near, kept[0].accept()[0]]
    try:
        while True: near.send(bytes(65536))
    except BlockingIOError:
        time.sleep(0.01)
"""
DESCRIPTORS = """
import os, time
for _ in range(12):
    if os.fork() == 0:
        try:
            while True: os.dup(0)
        except OSError:
            time.sleep(60)
time.sleep(60)
"""
FILES = """
import os, time
for folder in ("/tmp", "/dev/shm"):
    with open(folder + "/block", "wb", buffering=0) as file:
        for _ in range(60): file.write(bytes(1 << 20))
print("written")
time.sleep(60)
"""


SHARED_AND_LET_GO = """
import ctypes, time
libc = ctypes.CDLL(None, use_errno=True)
libc.mmap.restype = ctypes.c_void_p
piece = 16 << 20
for _ in range(64):
    at = libc.mmap(None, ctypes.c_size_t(piece), 3, 0x21, -1, ctypes.c_long(0))
    ctypes.memset(ctypes.c_void_p(at), 1, ctypes.c_size_t(piece))
    libc.madvise(ctypes.c_void_p(at), ctypes.c_size_t(piece), 4)
time.sleep(60)
"""
SENT_BY_CLOSED = """
import os, socket, time
for _ in range(7):
    if os.fork() == 0:
        break
held = []
for _ in range(400):
    near, far = socket.socketpair()
    near.setblocking(False)
    try:
        while True: near.send(bytes(65536))
    except BlockingIOError:
        pass
    near.close()
    held.append(far)
time.sleep(60)
"""


@needs_sandbox
@pytest.mark.parametrize("groups", [True, False])
@pytest.mark.parametrize(
    "attack",
    [
        (SOCKETS, RunLimits(socket_bytes=64 << 20), "more than 64 MB in sockets"),
        (TCP, RunLimits(socket_bytes=64 << 20), "more than 64 MB in sockets"),
        (DESCRIPTORS, RunLimits(), "more than 8192 files, pipes and sockets open"),
        (FILES, RunLimits(memory_bytes=100 << 20), "more than 100 MB of memory"),
        (SHARED_AND_LET_GO, RunLimits(memory_bytes=200 << 20), "more than 200 MB of memory"),
        (SENT_BY_CLOSED, RunLimits(), "more than 128 MB in sockets"),
    ],
)
def test_memory_that_no_process_counts(
    attack: tuple[str, RunLimits, str], groups: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    code, limits, words = attack
    if not groups:
        monkeypatch.setattr(sandbox, "find_cgroups", Cgroups)
    run = run_script(tmp_path, code, limit_s=20, limits=limits)
    assert exit_of(run).stopped_by == "KILL"
    memory = f"more than {limits.memory_bytes >> 20} MB of memory"  # the kernel may be first, or be there too
    told = {f"stopped by the grader: {found}" for found in (words, *[memory] * groups)}
    said = set(limits_met(run))
    assert said
    assert said <= told


@needs_sandbox
def test_the_number_of_files_is_bounded(tmp_path: Path) -> None:
    code = """
import os
for folder in ("/tmp", "/dev/shm", os.environ["HOME"]):
    number = 0
    try:
        while number < 5000:
            open("%s/%d" % (folder, number), "w").close()
            number += 1
    except OSError as error:
        print("full", folder, number, error.errno)
"""
    limits = RunLimits(home_files=3000, tmp_files=2000, shared_files=100)
    lines = [line.split() for line in printed(run_script(tmp_path, code, limit_s=20, limits=limits))]
    assert [(word[1], int(word[3])) for word in lines] == [
        (folder, errno.ENOSPC) for folder in ("/tmp", "/dev/shm", "/home/student")
    ]
    assert [int(word[2]) < most for word, most in zip(lines, (2000, 100, 3000), strict=True)] == [True] * 3


@needs_sandbox
def test_a_fork_bomb_ends_in_its_own_sandbox(tmp_path: Path) -> None:
    code = """
import os
while True:
    try:
        os.fork()
    except OSError:
        pass
"""
    run = run_script(tmp_path, code, limit_s=3, limits=RunLimits(tasks=100, processes=50))
    assert exit_of(run).stopped_by == "KILL"
    assert limits_met(run) in (["stopped by the grader: more than 50 processes"], [])


def test_cpu_time_is_that_of_the_whole_tree(tmp_path: Path) -> None:
    code = "import os\nfor _ in range(3): os.fork()\nwhile True: pass\n"
    run = run_script(tmp_path, code, limit_s=20, limits=RunLimits(cpu_s=1.0))
    assert limits_met(run) == ["stopped by the grader: more than 1 s of CPU time"]


def test_a_name_that_is_no_text_hides_no_cpu_time(tmp_path: Path) -> None:
    """/proc shows a process by the name that it gave itself, in any bytes."""
    named = "import ctypes, os\nctypes.CDLL(None).prctl(15, b'\\xff) (\\xfe', 0, 0, 0)\n"
    code = named + "for _ in range(3): os.fork()\nwhile True: pass\n"
    run = run_script(tmp_path, code, limit_s=20, limits=RunLimits(cpu_s=1.0))
    assert limits_met(run) == ["stopped by the grader: more than 1 s of CPU time"]


def test_runs_of_one_submission_share_what_may_be_recorded() -> None:
    for runs in (1, 4, 10):
        limits = RunLimits().shared_by(runs)
        assert limits.run_bytes * runs <= SUBMISSION_MESSAGE_BYTES
        assert limits.channel_bytes <= limits.run_bytes
    assert RunLimits().shared_by(1000).run_bytes == 8 << 20


@needs_sandbox
def test_what_a_build_leaves_is_bounded(tmp_path: Path) -> None:
    big = "execute_process(COMMAND dd if=/dev/zero of=${CATKIN_DEVEL_PREFIX}/big bs=1M count=40)\n"
    with make_place(
        {"CMakeLists.txt": CMAKE + big, "src/node.py": SCRIPT}, limits=RunLimits(built_bytes=16 << 20)
    ) as place:
        path = tmp_path / "package.mcap"
        with EvidenceWriter(path, scenario="package", clock="real", warp=1.0, metadata={}) as writer:
            asyncio.run(build(place, writer, [], []))
        assert not place.archive.exists()
        assert {path.name for path in place.workspace.kept.iterdir()} <= {
            "base.tar",
            "syntax.jsonl",
            "environment",
        }
        assert [path.name for path in place.workspace.built.iterdir()] == ["src"]
    assert limits_met(load_run(path)) == ["what the build left is more than 16 MB"]


@needs_sandbox
def test_environment_hooks_lead_no_node_elsewhere(tmp_path: Path) -> None:
    hook = "catkin_add_env_hooks(50.lab SHELLS sh DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR}/hooks)\n"
    files = {
        "CMakeLists.txt": CMAKE + hook,
        "hooks/50.lab.sh": "export ROS_MASTER_URI=http://192.0.2.1:1 ROS_IP=192.0.2.1 ROS_ETC_DIR=/mine ROS_LAB=mine\n",
        "src/node.py": SCRIPT,
    }
    with make_place(files) as place:
        path = tmp_path / "package.mcap"
        with EvidenceWriter(path, scenario="package", clock="real", warp=1.0, metadata={}) as writer:
            built, outcome = asyncio.run(build(place, writer, [], []))
        env = built.spec("node", ["true"])["env"]
    assert outcome.ok
    assert (env["ROS_ETC_DIR"], env["ROS_IP"]) == ("/mine", "127.0.0.1")
    assert not {"ROS_LAB", "ROS_MASTER_URI"} & env.keys()


V1 = "30 20 0:26 / /sys/fs/cgroup/memory rw,relatime shared:9 - cgroup cgroup rw,memory\n"
V2 = "31 20 0:27 /docker/abc /sys/fs/cgroup rw,nosuid - cgroup2 cgroup rw,nsdelegate\n"


@pytest.fixture
def tables(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[Path, Path]:
    mounts, groups = tmp_path / "mountinfo", tmp_path / "cgroup"
    monkeypatch.setattr(control_groups, "MOUNTINFO", mounts)
    monkeypatch.setattr(control_groups, "MEMBERSHIP", groups)
    return mounts, groups


def test_control_groups_are_found_where_this_process_is(tables: tuple[Path, Path]) -> None:
    mounts, groups = tables
    mounts.write_text(V1 + V2)
    groups.write_text("4:memory:/user/7\n0::/docker/abc/init\n")
    found = control_groups.own_groups("memory")
    assert found == [(1, Path("/sys/fs/cgroup/memory/user/7")), (2, Path("/sys/fs/cgroup/init"))]
    groups.write_text("0::/../elsewhere\n")
    assert control_groups.own_groups("memory") == [(2, Path("/sys/fs/cgroup"))]
    mounts.unlink()
    assert control_groups.own_groups("memory") == []


def test_a_control_group_counts_only_if_it_can_be_limited(tmp_path: Path) -> None:
    assert not control_groups._usable(tmp_path / "none", "memory.max")
    assert control_groups.Cgroups().label == "a watchdog"
    assert Cgroups(memory=Cgroup(version=2, folder="/x")).label == "cgroup v2"


@needs_sandbox
def test_rosbag_records_in_less_memory_than_it_asks_for(tmp_path: Path) -> None:
    code = """
import os, subprocess
for name, words in (("a", ["rosbag", "record"]), ("b", ["rosrun", "rosbag", "record", "--min-space", "8M"])):
    subprocess.call([*words, "-O", "/tmp/%s.bag" % name, "--duration=1", "/rosout"])
    print("recorded", os.path.exists("/tmp/%s.bag" % name))
"""
    run = run_script(tmp_path, code, limit_s=30)
    assert [line for line in printed(run) if line.startswith("recorded")] == ["recorded True"] * 2
    assert not [line for line in printed(run) if "space free" in line]
