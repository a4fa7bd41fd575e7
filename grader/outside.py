"""Programs that run outside of every sandbox: how they are found, and what they are told of where to look.

You may stand in a student's folder when you grade, and git is started in one. An empty entry in a list of folders
stands for that folder, and `$LD_LIBRARY_PATH:/usr/local/lib` has one wherever the variable was empty before.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping
from pathlib import Path

LISTS = ("PATH", "LD_LIBRARY_PATH", "DYLD_LIBRARY_PATH", "DYLD_FALLBACK_LIBRARY_PATH", "PYTHONPATH")
LOADING = {
    *("PATH", "LD_LIBRARY_PATH", "DYLD_LIBRARY_PATH", "DYLD_FALLBACK_LIBRARY_PATH", "TMPDIR", "TEMP", "TMP"),
    *("SYSTEMROOT", "SYSTEMDRIVE", "WINDIR", "COMSPEC", "PATHEXT"),
}
"""Of the user's variables, what a program needs: to be found, to load, and on Windows to run at all."""
_PATH = "/usr/bin:/bin"
_SUFFIXES = (".exe", "") if sys.platform == "win32" else ("",)
_MODULE = "import sys; sys.path[:] = filter(None, sys.path); from {} import main; sys.exit(main())"


def anywhere(environment: Mapping[str, str]) -> dict[str, str]:
    """The same variables, which say the same in every folder: no list has an entry that depends on where one is."""
    whole = {name: value for name, value in environment.items() if name not in LISTS}
    for name in LISTS:
        entries = [
            entry for entry in environment.get(name, "").split(os.pathsep) if Path(entry).is_absolute()
        ]
        if entries:
            whole[name] = os.pathsep.join(entries)
    return {"PATH": _PATH, **whole}


def loading_environment(environment: Mapping[str, str]) -> dict[str, str]:
    """Return only those variables that a program of this machine needs to be found and loaded."""
    return {name: value for name, value in anywhere(environment).items() if name.upper() in LOADING}


def program(name: str, environment: Mapping[str, str] = os.environ) -> str | None:
    """The absolute path of a program of the user's PATH; None where there is none.

    `shutil.which` believes empty entries, and on Windows looks in the current folder first.
    """
    for folder in anywhere(environment)["PATH"].split(os.pathsep):
        for suffix in _SUFFIXES:
            path = Path(folder, name + suffix)
            if path.is_file() and os.access(path, os.X_OK):
                return str(path)
    return None


def own_module(name: str) -> list[str]:
    """The command that calls `main` of one of the grader's modules. `python -m` would look in the current folder first,
    for Python's own modules too."""
    return [sys.executable, "-c", _MODULE.format(name)]
