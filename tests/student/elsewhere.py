"""Runs the command line as if on another system: `elsewhere.py win32|darwin|noros ARGUMENT…`.

What is simulated: modules that the system lacks cannot be imported, attributes that it lacks are gone, `sys.platform`
says what it says there (`os.name` stays: the standard library that runs is Linux's), no `/proc`, no program but git and
this Python. On `win32` no link can be made, no folder be opened or flushed, nothing open be removed, and no file's mode
says that it may be run.
"""

from __future__ import annotations

# The standard library that is needed is loaded as it is here, before this system becomes another one.
import asyncio  # noqa: F401
import builtins
import errno
import importlib.abc
import locale  # noqa: F401
import multiprocessing.connection  # noqa: F401
import os
import pathlib
import platform
import select
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading  # noqa: F401

MODULES = {
    "win32": ("fcntl", "resource", "pwd", "grp", "termios", "pty", "tty", "readline", "syslog"),
    "darwin": (),
}
OS_LACKS = {
    "win32": (
        *(
            "O_NOFOLLOW",
            "O_NONBLOCK",
            "O_CLOEXEC",
            "O_DIRECTORY",
            "O_PATH",
            "O_TMPFILE",
            "O_SYNC",
            "O_NOCTTY",
        ),
        *(
            "getuid",
            "geteuid",
            "getgid",
            "getegid",
            "getgroups",
            "fork",
            "forkpty",
            "killpg",
            "setsid",
            "chown",
        ),
        *(
            "fchmod",
            "fchown",
            "lchown",
            "chroot",
            "mkfifo",
            "mknod",
            "uname",
            "sysconf",
            "sched_getaffinity",
            "nice",
        ),
        *(
            "getpgid",
            "setpgid",
            "getpriority",
            "initgroups",
            "setuid",
            "setgid",
            "wait4",
            "WIFEXITED",
            "sched_get_priority_max",
        ),
        *(
            "pidfd_open",
            "memfd_create",
            "posix_fadvise",
            "sched_yield",
            "getloadavg",
            "pipe2",
            "confstr",
            "ctermid",
        ),
    ),
    "darwin": (
        *(
            "O_PATH",
            "O_TMPFILE",
            "sched_getaffinity",
            "sched_setaffinity",
            "pidfd_open",
            "memfd_create",
            "pipe2",
        ),
        *(
            "posix_fadvise",
            "getxattr",
            "setxattr",
            "listxattr",
            "getrandom",
            "eventfd",
            "splice",
            "getresuid",
        ),
    ),
}
SIGNAL_LACKS = {
    "win32": (
        *("SIGKILL", "SIGVTALRM", "SIGALRM", "SIGXFSZ", "SIGXCPU", "SIGHUP", "SIGQUIT", "SIGCHLD", "SIGPIPE"),
        *(
            "setitimer",
            "getitimer",
            "alarm",
            "pthread_sigmask",
            "SIG_BLOCK",
            "SIG_SETMASK",
            "SIGSTOP",
            "SIGCONT",
        ),
        *("SIGUSR1", "SIGUSR2", "SIGTSTP", "SIGWINCH", "pthread_kill", "sigwait"),
    ),
    "darwin": ("sigtimedwait", "SIGRTMIN", "SIGRTMAX", "SIGPWR"),
}
SOCKET_LACKS = ("SO_TIMESTAMPNS", "AF_NETLINK", "AF_PACKET", "SO_PEERCRED", "SCM_CREDENTIALS")
GONE = ("/proc", "/sys", "/opt/ros", "/usr/lib/python3/dist-packages", "/usr/share/ros")
PROGRAMS = ("git",)


class _Lacking(importlib.abc.MetaPathFinder):
    def __init__(self, names: tuple[str, ...]) -> None:
        self.names = names

    def find_spec(self, name, path=None, target=None):  # noqa: ARG002 - the interface's
        """Raise for what is not there."""
        if name in self.names:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)


def become(system: str) -> None:
    """Take away what `system` lacks."""
    _without_files()
    if system == "noros":
        os.environ["GRADER_ROS_SETUP"] = "none"
        return
    _grader_only()
    found = {name: shutil.which(name) for name in PROGRAMS}
    sys.platform = system
    platform.system = lambda: {"win32": "Windows", "darwin": "Darwin"}[system]
    for name in MODULES[system]:
        sys.modules.pop(name, None)
    sys.meta_path.insert(0, _Lacking(MODULES[system]))
    for module, lacks in ((os, OS_LACKS), (signal, SIGNAL_LACKS)):
        for name in lacks[system]:
            vars(module).pop(name, None)
    for name in SOCKET_LACKS:
        vars(socket).pop(name, None)
    shutil.which = lambda cmd, *_args, **_options: found.get(cmd)
    if system == "win32":
        _as_windows()


def _grader_only() -> None:
    """The standard library's own use of what goes is kept alive."""
    subprocess._USE_VFORK = False
    os.register_at_fork = lambda **_: None
    tempfile._O_TMPFILE_WORKS = False


def _as_windows() -> None:
    vars(select).pop("poll", None)
    vars(select).pop("epoll", None)
    vars(errno).pop("EDQUOT", None)
    shutil._use_fd_functions = False
    opened, unlink, whole_open = {}, os.unlink, os.open

    def no_link(*_args, **_options):
        raise OSError(1314, "A required privilege is not held by the client")

    def no_folder(path, flags, *rest, **options):
        if not isinstance(path, int) and pathlib.Path(path).is_dir():
            raise PermissionError(13, "Permission denied", str(path))
        if options.get("dir_fd") is not None:
            raise NotImplementedError("dir_fd unavailable on this platform")
        descriptor = whole_open(path, flags, *rest, **options)
        if not pathlib.Path(path).name.startswith("tmp"):  # of tempfile, which has its own way there
            opened[descriptor] = str(path)
        return descriptor

    whole_close = os.close

    def close(descriptor):
        opened.pop(descriptor, None)
        whole_close(descriptor)

    def held(path, *_args, **_options):
        if str(path) in opened.values():
            raise PermissionError(32, "The process cannot access the file", str(path))
        return unlink(path, *_args, **_options)

    os.symlink, os.open, os.close, os.unlink, os.remove = no_link, no_folder, close, held, held
    pathlib.Path.symlink_to = no_link


def _without_files() -> None:
    def gone(path) -> bool:
        return isinstance(path, str | os.PathLike) and any(
            os.fspath(path) == place or str(os.fspath(path)).startswith(f"{place}/") for place in GONE
        )

    for owner, names in ((os, ("stat", "lstat", "scandir", "listdir")), (builtins, ("open",))):
        for name in names:
            setattr(owner, name, _unless(gone, getattr(owner, name)))


def _unless(gone, function):
    def looked_for(path=".", *args, **options):
        if gone(path):
            raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), str(path))
        return function(path, *args, **options)

    return looked_for


if __name__ == "__main__":
    import sysconfig

    sysconfig.get_config_vars()
    become(sys.argv[1])
    if sys.argv[1] == "win32":
        import grader.portable

        grader.portable.MODES_ON_DISK = False
    from grader.__main__ import main

    sys.argv[1:] = sys.argv[2:]
    sys.exit(main())
