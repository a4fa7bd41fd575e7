"""The filter of system calls: what is shipped is what `scripts/system_calls.py` says, and it is in force."""

from __future__ import annotations

import errno
import platform
import socket
import struct
from collections.abc import Iterator
from pathlib import Path

import pytest

from grader.arena.sandbox import FILTERS, MACHINES, system_call_filter
from scripts.system_calls import ALLOWED, FCNTL, FCNTL_LOCKS, NEW_NAMESPACES, compile_filter
from tests.arena.support import needs_sandbox, printed, run_script

libseccomp = pytest.importorskip("pyseccomp", exc_type=(ImportError, RuntimeError))
ARCHES = {"x86_64": 0xC000003E, "aarch64": 0xC00000B7}
I386 = 0x40000003
X32 = 0x40000000
ALLOW, ERRNO = 0x7FFF0000, 0x00050000
REFUSED = {
    "io_uring_setup": errno.ENOSYS,
    "keyctl": errno.EPERM,
    "add_key": errno.EPERM,
    "request_key": errno.ENOSYS,
    "userfaultfd": errno.ENOSYS,
    "bpf": errno.EPERM,
    "perf_event_open": errno.ENOSYS,
    "memfd_create": errno.ENOSYS,
    "memfd_secret": errno.ENOSYS,
    "unshare": errno.EPERM,
    "setns": errno.EPERM,
    "clone3": errno.ENOSYS,
    "ptrace": errno.EPERM,
    "process_vm_readv": errno.ENOSYS,
    "pidfd_getfd": errno.ENOSYS,
    "open_by_handle_at": errno.ENOSYS,
    "mount": errno.EPERM,
    "fsopen": errno.ENOSYS,
    "open_tree": errno.ENOSYS,
    "shmget": errno.ENOSYS,
    "msgget": errno.ENOSYS,
    "semget": errno.ENOSYS,
    "inotify_add_watch": errno.ENOSYS,
    "mq_open": errno.ENOSYS,
    "init_module": errno.ENOSYS,
    "kexec_load": errno.ENOSYS,
    "seccomp": errno.ENOSYS,
}


def run_filter(program: bytes, arch: int, number: int, *arguments: int) -> int:
    """What the kernel does with a call: classic BPF over `struct seccomp_data` (linux/filter.h, linux/seccomp.h)."""
    padded = [*arguments, 0, 0, 0, 0, 0, 0][:6]
    data = struct.pack("<IIQ6Q", number & 0xFFFFFFFF, arch, 0, *padded)
    code = list(struct.iter_unpack("<HBBI", program))
    at, accumulator = 0, 0
    while True:
        operation, true, false, value = code[at]
        at += 1
        if operation == 0x20:  # load a word
            (accumulator,) = struct.unpack_from("<I", data, value)
        elif operation == 0x54:  # and
            accumulator &= value
        elif operation == 0x05:  # jump
            at += value
        elif operation in {0x15, 0x25, 0x35, 0x45}:
            holds = {
                0x15: accumulator == value,
                0x25: accumulator > value,
                0x35: accumulator >= value,
                0x45: bool(accumulator & value),
            }[operation]
            at += true if holds else false
        elif operation == 0x06:  # return
            return value
        else:
            raise AssertionError(f"unknown operation {operation:#x}")


def calls() -> Iterator[tuple[str, tuple[int, ...]]]:
    """Calls, with arguments that matter."""
    yield from ((name, ()) for name in (*ALLOWED, *REFUSED))
    for flags in (0, 0x11, NEW_NAMESPACES, 0x10000000, 0x40000011, 0x01200011):
        yield "clone", (flags,)
    for family in (*range(50), 1 << 33):
        for kind in (1, 2, 3, 5, 0x80801, 10):
            for protocol in (0, 1, 6, 15, 17, 132, 262):
                yield "socket", (family, kind, protocol)
    yield from (("fcntl", (3, command)) for command in (*range(50), *range(1020, 1045), 1 << 33))
    yield from (("ioctl", (0, number)) for number in (*range(0x5400, 0x5440), 0x5401 | 1 << 40, 0x80045430))
    yield from (("socketpair", (family, 1)) for family in (1, 2, 30))
    yield from (("personality", (value,)) for value in (0, 8, 0x20000, 0x40000, 0x400000, 0xFFFFFFFF))


def number_of(machine: str, name: str) -> int:
    arch = {"x86_64": libseccomp.Arch.X86_64, "aarch64": libseccomp.Arch.AARCH64}[machine]
    return int(libseccomp.resolve_syscall(arch, name))


@pytest.mark.full
@pytest.mark.parametrize("machine", MACHINES)
def test_what_is_shipped_is_what_is_written(machine: str) -> None:
    shipped, compiled = (FILTERS / f"{machine}.bpf").read_bytes(), compile_filter(machine)
    arch = ARCHES[machine]
    for name, arguments in calls():
        number = number_of(machine, name)
        if number >= 0:
            answers = [run_filter(program, arch, number, *arguments) for program in (shipped, compiled)]
            assert answers[0] == answers[1], (name, arguments)
    for number in range(600):
        assert run_filter(shipped, arch, number) == run_filter(compiled, arch, number), number


@pytest.mark.parametrize("machine", MACHINES)
def test_what_is_refused(machine: str) -> None:
    program, arch = (FILTERS / f"{machine}.bpf").read_bytes(), ARCHES[machine]
    for name, number in REFUSED.items():
        assert run_filter(program, arch, number_of(machine, name)) == ERRNO | number, name
    assert run_filter(program, arch, 5000) == ERRNO | errno.ENOSYS  # a call that no kernel has yet
    for flag in (1 << bit for bit in range(32)):
        answer = run_filter(program, arch, number_of(machine, "clone"), 0x11 | flag)
        assert (answer == ALLOW) is not bool(flag & NEW_NAMESPACES), hex(flag)


@pytest.mark.parametrize("machine", MACHINES)
def test_other_instruction_sets_are_refused(machine: str) -> None:
    program = (FILTERS / f"{machine}.bpf").read_bytes()
    other = ARCHES["aarch64" if machine == "x86_64" else "x86_64"]
    for arch in (I386, other):
        for number in range(500):
            assert run_filter(program, arch, number) == ERRNO | errno.ENOSYS
    if machine == "x86_64":
        assert run_filter(program, ARCHES[machine], X32 | 1) == ERRNO | errno.ENOSYS


@pytest.mark.parametrize("machine", MACHINES)
def test_sockets(machine: str) -> None:
    program, arch, number = (
        (FILTERS / f"{machine}.bpf").read_bytes(), ARCHES[machine], number_of(machine, "socket"),
    )  # fmt: skip
    cloexec = 0x80000
    allowed = [
        (1, 1, 0),
        (1, 2, 0),
        (2, 1, 0),
        (2, 1 | cloexec, 6),
        (2, 2, 17),
        (10, 1, 0),
        (16, 3 | cloexec, 0),
    ]
    refused = [
        (40, 1, 0),
        (17, 3, 3),
        (38, 5, 0),
        (16, 3, 4),
        (16, 3, 12),
        (2, 3, 1),
        (2, 1, 132),
        (31, 3, 0),
        (30, 1, 0),
    ]
    for arguments in allowed:
        assert run_filter(program, arch, number, *arguments) == ALLOW, arguments
    for arguments in refused:
        assert run_filter(program, arch, number, *arguments) & 0xFFFF0000 == ERRNO, arguments
    assert run_filter(program, arch, number, 40, 1, 0) == ERRNO | errno.EAFNOSUPPORT


@pytest.mark.parametrize("machine", MACHINES)
def test_locks_are_granted_and_not_taken(machine: str) -> None:
    program, arch = (FILTERS / f"{machine}.bpf").read_bytes(), ARCHES[machine]
    fcntl = number_of(machine, "fcntl")
    assert run_filter(program, arch, number_of(machine, "flock"), 3, 2) == ERRNO
    answers = {command: run_filter(program, arch, fcntl, 3, command) for command in range(1100)}
    assert {command for command, answer in answers.items() if answer == ERRNO} == set(FCNTL_LOCKS)
    assert {command for command, answer in answers.items() if answer == ALLOW} == set(FCNTL)
    assert (
        run_filter(program, arch, fcntl, 3, 6 | 1 << 32) == ERRNO | errno.ENOSYS
    )  # the kernel reads 32 bits


@pytest.mark.parametrize("machine", MACHINES)
def test_nothing_types_into_a_terminal(machine: str) -> None:
    program, arch = (FILTERS / f"{machine}.bpf").read_bytes(), ARCHES[machine]
    ioctl = number_of(machine, "ioctl")
    for high in (0, 1 << 32, 0xFFFFFFFF << 32):  # the kernel reads 32 bits
        answers = {
            n: run_filter(program, arch, ioctl, 0, n | high) for n in (*range(0x5300, 0x5500), 0x80045430)
        }
        assert {n for n, answer in answers.items() if answer != ALLOW} == {0x5412, 0x541C}


def test_this_machine_has_one(monkeypatch: pytest.MonkeyPatch) -> None:
    system_call_filter.cache_clear()
    found = system_call_filter()
    assert found is None or len(found) % 8 == 0
    assert (found is not None) == (platform.machine() in MACHINES)


PROGRAM = """
import ctypes, errno, os, socket
libc = ctypes.CDLL(None, use_errno=True)
print("filter", [line.split()[1] for line in open("/proc/self/status") if line.startswith("Seccomp:")])
for family, kind, protocol in ((40, 1, 0), (17, 3, 0), (38, 5, 0), (16, 3, 4), (2, 3, 1)):
    try:
        socket.socket(family, kind, protocol)
        print("socket made", family, kind, protocol)
    except OSError as error:
        print("no socket", family, error.errno)
try:
    os.memfd_create("x")
    print("memfd made")
except OSError as error:
    print("no memfd", error.errno)
print("unshare", libc.unshare(0x10000000), ctypes.get_errno())
print("interfaces", socket.if_nameindex())
"""


@pytest.mark.ros
@needs_sandbox
@pytest.mark.skipif(platform.machine() not in MACHINES, reason="no filter for this processor")
def test_a_process_behind_the_wall(tmp_path: Path) -> None:
    lines = printed(run_script(tmp_path, PROGRAM, limit_s=10))
    assert lines[0] == "filter ['2']"
    assert f"no socket 40 {errno.EAFNOSUPPORT}" in lines
    assert not [line for line in lines if "made" in line], lines
    assert f"no memfd {errno.ENOSYS}" in lines
    assert f"unshare -1 {errno.EPERM}" in lines
    assert "interfaces [(1, 'lo')]" in lines
    assert socket.AF_INET == 2  # what the numbers above mean here
