"""Which system calls a student's process may make, compiled by libseccomp into grader/arena/filters/.

`python -m scripts.system_calls` writes the files; tests/arena/test_system_calls.py holds them against what is written
here.

What is not named is refused with ENOSYS, as by a kernel that does not have it: programs know how to do without, and a
call that a later kernel adds is not open by accident. Other instruction sets of the same processor (32 bits, x32) are
refused as a whole.
"""

from __future__ import annotations

import errno
import os
import socket
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from grader.arena.sandbox import FILTERS, MACHINES

FILES = """
access alarm brk chdir chmod chown close close_range copy_file_range creat dup dup2 dup3 faccessat faccessat2
fadvise64 fallocate fchdir fchmod fchmodat fchmodat2 fchown fchownat fdatasync fgetxattr flistxattr
fremovexattr fsetxattr fstat fstatfs fsync ftruncate futimesat getcwd getdents getdents64 getxattr lchown
lgetxattr link linkat listxattr llistxattr lremovexattr lseek lsetxattr lstat mkdir mkdirat mknod mknodat newfstatat
open openat openat2 pipe pipe2 pread64 preadv preadv2 pwrite64 pwritev pwritev2 read readahead readlink readlinkat
readv removexattr rename renameat renameat2 rmdir sendfile setxattr splice stat statfs statx symlink symlinkat sync
sync_file_range syncfs tee truncate umask unlink unlinkat utime utimensat utimes write writev
"""
MEMORY = """
madvise membarrier mincore mlock mlock2 mlockall mmap mprotect mremap msync munlock munlockall munmap
pkey_alloc pkey_free pkey_mprotect
"""
PROCESSES = """
arch_prctl capget capset execve execveat exit exit_group fork getegid geteuid getgid getgroups getpgid getpgrp getpid
getppid getpriority getresgid getresuid getrlimit getrusage getsid gettid getuid ioprio_get ioprio_set kill pause
pidfd_open pidfd_send_signal prctl prlimit64 restart_syscall rseq rt_sigaction rt_sigpending rt_sigprocmask
rt_sigqueueinfo rt_sigreturn rt_sigsuspend rt_sigtimedwait rt_tgsigqueueinfo sched_get_priority_max
sched_get_priority_min sched_getaffinity sched_getattr sched_getparam sched_getscheduler sched_rr_get_interval
sched_setaffinity sched_setattr sched_setparam sched_setscheduler sched_yield set_robust_list set_tid_address setfsgid
setfsuid setgid setgroups setpgid setpriority setregid setresgid setresuid setreuid setrlimit setsid setuid sigaltstack
sysinfo tgkill times tkill uname vfork wait4 waitid
"""
WAITING = """
clock_getres clock_gettime clock_nanosleep epoll_create epoll_create1 epoll_ctl epoll_ctl_old epoll_pwait epoll_pwait2
epoll_wait epoll_wait_old eventfd eventfd2 futex futex_requeue futex_wait futex_waitv futex_wake get_robust_list getcpu
getitimer getrandom gettimeofday nanosleep poll ppoll pselect6 select setitimer signalfd signalfd4 time timer_create
timer_delete timer_getoverrun timer_gettime timer_settime timerfd_create timerfd_gettime timerfd_settime
"""
SOCKETS = """
accept accept4 bind connect getpeername getsockname getsockopt listen recvfrom recvmmsg recvmsg sendmmsg sendmsg sendto
setsockopt shutdown
"""
ALLOWED = tuple(f"{FILES} {MEMORY} {PROCESSES} {WAITING} {SOCKETS}".split())

NEW_NAMESPACES = 0x7E020080
"""CLONE_NEWNS, NEWCGROUP, NEWUTS, NEWIPC, NEWUSER, NEWPID, NEWNET, NEWTIME (man 2 clone, linux/sched.h)."""
PERSONALITIES = (0x0, 0xFFFFFFFF)
"""Linux as it is, and the question which one it is (man 2 personality)."""
FCNTL = (
    0,
    1,
    2,
    3,
    4,
    5,
    8,
    9,
    10,
    11,
    15,
    16,
    17,
    36,
    1025,
    1030,
    1031,
    1032,
    1033,
    1034,
    1035,
    1036,
    1037,
    1038,
)
"""What is asked of a descriptor itself (linux/fcntl.h): no leases, no notices of what others do to a file."""
FCNTL_LOCKS = (6, 7, 37, 38)
"""Files of the system are shared: two sandboxes could signal to each other by locks on them. So a lock is granted, and
not taken: a program that locks a file of its own goes on."""
TERMINAL_INPUT, CONSOLE = 0x5412, 0x541C
"""TIOCSTI types into a terminal, TIOCLINUX pastes into a console (man 2 ioctl_tty): never allowed."""
IOCTL_ALIKE = (0x5410, 0x5414, 0x5416, 0x5418, 0x541A, 0x541E)
"""Numbers that have all bits that those two have in common, and are neither."""
IOCTL_BITS = 32
"""What the kernel reads of a number that is 64 bits wide."""
NETLINK_ROUTE = 0
KINDS = 0xF
"""The bits of a socket's type that are not flags."""
FAMILIES_MAX = 45


def compile_filter(machine: str) -> bytes:
    """The program for that processor. Needs libseccomp."""
    import pyseccomp  # noqa: PLC0415 - asks the linker where libseccomp is

    made: Any = pyseccomp.SyscallFilter(pyseccomp.ERRNO(errno.ENOSYS))
    processor = {"x86_64": pyseccomp.Arch.X86_64, "aarch64": pyseccomp.Arch.AARCH64}[machine]
    if processor != pyseccomp.system_arch():
        made.add_arch(processor)
        made.remove_arch(pyseccomp.system_arch())
    made.set_attr(pyseccomp.Attr.ACT_BADARCH, pyseccomp.ERRNO(errno.ENOSYS))
    _add_rules(made, pyseccomp, processor)
    with tempfile.TemporaryFile() as file:
        made.export_bpf(file)
        file.seek(0)
        return file.read()


def _add_rules(made: Any, libseccomp: Any, processor: int) -> None:  # noqa: ANN401 - the binding has no types
    allow, argument = libseccomp.ALLOW, libseccomp.Arg
    for name in ALLOWED:
        if libseccomp.resolve_syscall(processor, name) >= 0:  # every processor has its own
            made.add_rule(allow, name)
    made.add_rule(allow, "clone", argument(0, libseccomp.MASKED_EQ, NEW_NAMESPACES, 0))
    for mask, value in _harmless_ioctls():
        made.add_rule(allow, "ioctl", argument(1, libseccomp.MASKED_EQ, mask, value))
    made.add_rule(libseccomp.ERRNO(0), "flock")
    for command in FCNTL:
        made.add_rule(allow, "fcntl", argument(1, libseccomp.EQ, command))
    for command in FCNTL_LOCKS:
        made.add_rule(libseccomp.ERRNO(0), "fcntl", argument(1, libseccomp.EQ, command))
    for wanted in PERSONALITIES:
        made.add_rule(allow, "personality", argument(0, libseccomp.EQ, wanted))
    refused = libseccomp.ERRNO(errno.EPERM)
    for name in (
        "unshare",
        "setns",
        "mount",
        "umount2",
        "pivot_root",
        "chroot",
        "ptrace",
        "bpf",
        "keyctl",
        "add_key",
    ):
        made.add_rule(refused, name)
    _add_socket_rules(made, libseccomp)


def _harmless_ioctls() -> Iterator[tuple[int, int]]:
    """(mask, value): what differs from both in a bit that both have alike, and those few that differ in others only. A
    rule can ask whether bits are equal, not whether they are not."""
    alike = [1 << bit for bit in range(IOCTL_BITS) if not (TERMINAL_INPUT ^ CONSOLE) & 1 << bit]
    yield from ((mask, ~TERMINAL_INPUT & mask) for mask in alike)
    yield from ((2**IOCTL_BITS - 1, number) for number in IOCTL_ALIKE)


def _add_socket_rules(made: Any, libseccomp: Any) -> None:  # noqa: ANN401 - as above
    allow, argument = libseccomp.ALLOW, libseccomp.Arg
    made.add_rule(allow, "socketpair", argument(0, libseccomp.EQ, socket.AF_UNIX))
    for family, kinds, protocols in _sockets():
        for kind in kinds:
            for protocol in protocols:
                made.add_rule(
                    allow, "socket", argument(0, libseccomp.EQ, family),
                    argument(1, libseccomp.MASKED_EQ, KINDS, kind), argument(2, libseccomp.EQ, protocol),
                )  # fmt: skip
    known = {family for family, _, _ in _sockets()}
    for family in set(range(FAMILIES_MAX + 1)) - known:
        made.add_rule(libseccomp.ERRNO(errno.EAFNOSUPPORT), "socket", argument(0, libseccomp.EQ, family))
    made.add_rule(libseccomp.ERRNO(errno.EAFNOSUPPORT), "socket", argument(0, libseccomp.GT, FAMILIES_MAX))


def _sockets() -> tuple[tuple[int, tuple[int, ...], tuple[int, ...]], ...]:
    """Family, kinds, protocols: what ROS, Python and the C library use. NETLINK tells which interfaces there are."""
    stream, datagram, raw, packets = 1, 2, 3, 5
    internet = (0, socket.IPPROTO_TCP, socket.IPPROTO_UDP)
    return (
        (int(socket.AF_UNIX), (stream, datagram, packets), (0,)),
        (int(socket.AF_INET), (stream, datagram), internet),
        (int(socket.AF_INET6), (stream, datagram), internet),
        (int(socket.AF_NETLINK), (raw, datagram), (NETLINK_ROUTE,)),
    )


def write_filters(folder: Path) -> None:
    """A file for each processor."""
    folder.mkdir(exist_ok=True)
    for machine in MACHINES:
        (folder / f"{machine}.bpf").write_bytes(compile_filter(machine))


if __name__ == "__main__":
    os.umask(0o022)
    write_filters(FILTERS)
