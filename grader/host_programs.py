"""Programs that run outside of every sandbox: how they are found, and which environment they get.

A name comes in, and an absolute path goes out, None where there is none. `find_host_program` is for what stands around
students' code (`bwrap`, `setpriv`): it looks in fixed folders, whatever anybody's variables say, because a program
found by the PATH of the person who grades may not be the one it is taken for. `find_user_program` is for the user's own
(git, Python). `loading_environment` and `with_absolute_paths` give the variables that programs are started with.

You may stand in a student's folder when you grade, and git is started in one. An empty entry in a list of folders
stands for that folder, and `$LD_LIBRARY_PATH:/usr/local/lib` has one wherever the variable was empty before.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Mapping, Sequence
from contextlib import suppress
from functools import lru_cache
from pathlib import Path

LISTS = ("PATH", "LD_LIBRARY_PATH", "DYLD_LIBRARY_PATH", "DYLD_FALLBACK_LIBRARY_PATH", "PYTHONPATH")
# for a user whose own PATH has no entry that can be used
_PATH = "/usr/bin:/bin"
_SUFFIXES = (".exe", "") if sys.platform == "win32" else ("",)
_MODULE = "import sys; sys.path[:] = filter(None, sys.path); from {} import main; sys.exit(main())"
HOST_PATH = "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin"
HOST_ENV = {"PATH": HOST_PATH, "LANG": "C.UTF-8"}
RESOLVE_S = 5
GIT_S = 5
LOCALHOST, LOCALHOST_HINT = "localhost", "echo '127.0.0.1 localhost' >> /etc/hosts"
"""Without a sandbox, which has a file of its own, roslaunch asks the machine for its address, and ends without one."""


LOADING = {
    *("PATH", "LD_LIBRARY_PATH", "DYLD_LIBRARY_PATH", "DYLD_FALLBACK_LIBRARY_PATH", "TMPDIR", "TEMP", "TMP"),
    *("SYSTEMROOT", "SYSTEMDRIVE", "WINDIR", "COMSPEC", "PATHEXT"),
}
"""Of the user's variables, what a program needs: to be found, to load, and on Windows to run at all."""


def loading_environment(environment: Mapping[str, str]) -> dict[str, str]:
    """Return only those variables that a program of this machine needs to be found and loaded."""
    return {
        name: value for name, value in with_absolute_paths(environment).items() if name.upper() in LOADING
    }


def with_absolute_paths(environment: Mapping[str, str]) -> dict[str, str]:
    """Return the same variables without the entries of `PATH` and its like that depend on the current folder."""
    whole = {name: value for name, value in environment.items() if name not in LISTS}
    for name in LISTS:
        entries = [
            entry for entry in environment.get(name, "").split(os.pathsep) if Path(entry).is_absolute()
        ]
        if entries:
            whole[name] = os.pathsep.join(entries)
    return {"PATH": _PATH, **whole}


def find_user_program(name: str, environment: Mapping[str, str] = os.environ) -> str | None:
    """Return the absolute path of a program of the user's PATH; None where there is none.

    `shutil.which` believes empty entries, and on Windows looks in the current folder first.
    """
    for folder in with_absolute_paths(environment)["PATH"].split(os.pathsep):
        for suffix in _SUFFIXES:
            path = Path(folder, name + suffix)
            if path.is_file() and os.access(path, os.X_OK):
                return str(path)
    return None


def module_command(name: str) -> list[str]:
    """Return the command that calls `main` of one of the grader's modules. `python -m` would look in the current
    folder first, for Python's own modules too."""
    return [sys.executable, "-c", _MODULE.format(name)]


def run_host_program(
    command: Sequence[str], limit_s: float, data: bytes = b""
) -> subprocess.CompletedProcess[bytes]:
    """Run a program of this machine that reads `data`. Raises OSError, or TimeoutExpired after `limit_s`."""
    return subprocess.run(
        command, env=HOST_ENV, cwd="/", input=data, capture_output=True, check=False, timeout=limit_s
    )


@lru_cache(maxsize=4)
def resolves(name: str) -> bool:
    """Return whether this machine knows an address of the host; by `getent`, since the resolver has no time limit.
    Where there is none, nothing is known, and that says yes."""
    command = [find_host_program("getent") or "/usr/bin/getent", "hosts", name]
    try:
        return run_host_program(command, RESOLVE_S).returncode == 0
    except subprocess.TimeoutExpired:
        return False
    except OSError:
        return True


@lru_cache(maxsize=32)
def find_host_program(name: str) -> str | None:
    """Return the absolute path of a program of this machine, such as `bwrap`; None where it is not installed."""
    return shutil.which(name, path=HOST_PATH)


def git_user() -> str:
    """Return what git calls the person; empty where it does not."""
    return git_setting("user.name", with_absolute_paths(os.environ), Path("/"))


def git_setting(name: str, environment: Mapping[str, str], cwd: Path) -> str:
    """Return what the user's git has for a setting in that folder; empty where it has nothing."""
    with suppress(OSError, subprocess.SubprocessError, UnicodeDecodeError):
        done = subprocess.run(
            [find_user_program("git") or "/usr/bin/git", "config", "--get", name],
            env=environment,
            cwd=cwd,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=GIT_S,
            check=False,
        )
        return done.stdout.strip()
    return ""
