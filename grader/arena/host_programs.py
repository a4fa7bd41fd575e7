"""The machine's own programs that stand around students' code, and the environment that they get.

Neither where they are looked for nor what they are told depends on anybody's variables: a program found by the PATH of
the person who grades, or started with a student's LD_LIBRARY_PATH, may not be the one it is taken for.
"""

from __future__ import annotations

import shutil
from functools import lru_cache

HOST_PATH = "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin"
HOST_ENV = {"PATH": HOST_PATH, "LANG": "C.UTF-8"}


@lru_cache(maxsize=32)
def host_program(name: str) -> str | None:
    """The absolute path of a program of this machine, such as `bwrap`; None where it is not installed."""
    return shutil.which(name, path=HOST_PATH)
