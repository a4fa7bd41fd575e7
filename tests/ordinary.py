"""The grader run by an ordinary user with a home and temporary files of its own, from tests that root runs."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
UID = 61_234
"""Nobody's: no process of this machine counts as its own."""
ROOM = ("unshare", "--mount", "--propagation", "private")
SETUP = """
if [ -n "$1" ]; then  # this Python lies where only root can pass
    mount --bind "$2" "$3/python"; mount -t tmpfs -o mode=755 none "$1"; mkdir -p "$2"; mount --bind "$3/python" "$2"
fi
cd "$3/home"; limits=$4; shift 4
exec setpriv --reuid={uid} --regid={uid} --clear-groups --inh-caps=-all bash -ec "$limits"'; exec "$@"' bash "$@"
"""


def why_not() -> str:
    """Empty where another user can be put in root's place."""
    if os.geteuid() != 0:
        return "becoming another user needs root"
    missing = [name for name in ("unshare", "setpriv") if shutil.which(name) is None]
    if missing:
        return f"{', '.join(missing)} not installed"
    shut = [path for path in (ROOT, Path(sys.prefix)) if _closed(path)]
    return f"{shut[0]} is closed to other users" if shut else ""


def grader(folder: Path, *argv: str | Path, limits: str = ":") -> subprocess.CompletedProcess[str]:
    """Run `grader` after a shell of that user's has run `limits`. `folder` is one that other users can pass."""
    for name in ("python", "home", "tmp"):
        (folder / name).mkdir(exist_ok=True)
        os.chown(folder / name, UID, UID)
    env = {
        "HOME": str(folder / "home"),
        "TMPDIR": str(folder / "tmp"),
        "PATH": "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin",
        "LANG": "C.UTF-8",
        "PYTHONPATH": str(ROOT),
        "PYTHONDONTWRITEBYTECODE": "1",
    }
    base = Path(sys.base_prefix)
    given = [_closed(base), str(base), str(folder), limits, sys.executable, "-m", "grader", *map(str, argv)]
    command = [*ROOM, "sh", "-ec", SETUP.format(uid=UID), "sh", *given]
    return subprocess.run(
        command, env=env, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False
    )


def _closed(path: Path) -> str:
    """The outermost folder on the way that others cannot pass, or nothing."""
    way = [*reversed(path.parents), path]
    return next((str(folder) for folder in way if not folder.stat().st_mode & 0o001), "")
