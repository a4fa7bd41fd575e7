"""The kernel's calls by name, for attacks: lies beside `hostile.py`, and runs under ROS's Python (3.8).

`refused((name, argument, …), …)` makes each call in a process of its own. An attack's arguments are such that the
kernel itself would say yes, or that they are wrong: whoever is told so (EFAULT, EINVAL, …) was let through.
"""

import ctypes
import errno
import functools
import os
import platform
import signal

from hostile import say

NUMBERS = {  # x86_64, aarch64 (asm/unistd_64.h, asm-generic/unistd.h)
    "acct": (163, 89), "add_key": (248, 217), "adjtimex": (159, 171), "bpf": (321, 280), "chroot": (161, 51),
    "clock_adjtime": (305, 266), "clock_settime": (227, 112), "clone": (56, 220), "clone3": (435, 435),
    "delete_module": (176, 106), "fanotify_init": (300, 262), "finit_module": (313, 273), "fsconfig": (431, 431),
    "fsmount": (432, 432), "fsopen": (430, 430), "fspick": (433, 433), "init_module": (175, 105),
    "io_uring_enter": (426, 426), "io_uring_register": (427, 427), "io_uring_setup": (425, 425), "ioperm": (173, None),
    "iopl": (172, None), "kcmp": (312, 272), "kexec_file_load": (320, 294), "kexec_load": (246, 104),
    "keyctl": (250, 219), "lookup_dcookie": (212, 18), "memfd_create": (319, 279), "memfd_secret": (447, 447),
    "migrate_pages": (256, 238), "modify_ldt": (154, None), "mount": (165, 40), "mount_setattr": (442, 442),
    "move_mount": (429, 429), "mq_open": (240, 180), "msgget": (68, 186), "name_to_handle_at": (303, 264),
    "open_by_handle_at": (304, 265), "open_tree": (428, 428), "perf_event_open": (298, 241), "pidfd_getfd": (438, 438),
    "pivot_root": (155, 41), "process_madvise": (440, 440), "process_vm_readv": (310, 270),
    "process_vm_writev": (311, 271), "ptrace": (101, 117), "quotactl": (179, 60), "quotactl_fd": (443, 443),
    "reboot": (169, 142), "request_key": (249, 218), "seccomp": (317, 277), "semget": (64, 190),
    "setdomainname": (171, 162), "sethostname": (170, 161), "setns": (308, 268), "settimeofday": (164, 170),
    "shmget": (29, 194), "swapoff": (168, 225), "swapon": (167, 224), "syslog": (103, 116), "umount2": (166, 39),
    "unshare": (272, 97), "userfaultfd": (323, 282),
    "uselib": (134, None), "vhangup": (153, 58),
}  # fmt: skip
LET_THROUGH = {"x86_64": 0, "aarch64": 1}
REFUSALS = {
    errno.ENOSYS,
    errno.EPERM,
    errno.EACCES,
    errno.EAFNOSUPPORT,
    errno.EPROTONOSUPPORT,
    errno.ESOCKTNOSUPPORT,
}
libc = ctypes.CDLL(None, use_errno=True)


def call(name, *arguments):
    """What the kernel gives back. Raises OSError."""
    number = NUMBERS[name][LET_THROUGH[platform.machine()]]
    if number is None:
        raise OSError(errno.ENOSYS, "not on this processor")
    words = [ctypes.c_long(word) if isinstance(word, int) else word for word in arguments]
    got = libc.syscall(ctypes.c_long(number), *words)
    if got == -1:
        raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))
    return got


def refused(*calls):
    """Each call is (name, arguments…), or (words, function)."""
    for name, *arguments in calls:
        made = functools.partial(call, name, *arguments)
        action = arguments[0] if arguments and callable(arguments[0]) else made
        say(_in_a_child(name, action))


def _in_a_child(name, action):
    """The filter may answer with a signal: this process goes on."""
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(reader)
        os.write(writer, _tried(name, action).encode("ascii", "replace")[:1000])
        os._exit(0)
    os.close(writer)
    with os.fdopen(reader, "rb") as file:
        words = file.read().decode()
    _, status = os.waitpid(child, 0)
    if os.WIFSIGNALED(status):
        told = "refused by signal" if os.WTERMSIG(status) == signal.SIGSYS else "HARM: ended by signal"
        return f"tried: {name}: {told} {os.WTERMSIG(status)}"
    return words


def _tried(name, action):
    try:
        got = action()
    except OSError as error:
        if error.errno in REFUSALS:
            return f"tried: {name}: refused: {error}"
        return f"tried: {name}: HARM: the kernel looked at it: {error}"
    except Exception as error:  # noqa: BLE001 - an attack goes on
        return f"tried: {name}: refused: {type(error).__name__}: {error}"
    return f"tried: {name}: HARM: {got!r}"
