"""The kernel's keys (man 7 keyrings): what hangs on the session of whoever runs the grader is not for students."""

import ctypes
import os

KEYCTL_JOIN_SESSION_KEYRING = 1
KEYCTL = {
    "x86_64": 250,
    "aarch64": 219,
    "i686": 288,
    "armv7l": 311,
    "riscv64": 219,
    "ppc64le": 271,
    "s390x": 280,
}


def leave_keys_behind():
    """Join a new, empty session keyring; all that the process starts inherits it. Where the kernel has no keys, or
    does not let it, there is nothing that could be read either way."""
    number = KEYCTL.get(os.uname().machine)
    if number is not None:
        ctypes.CDLL(None, use_errno=True).syscall(number, KEYCTL_JOIN_SESSION_KEYRING, None)
