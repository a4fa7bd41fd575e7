"""A bare Debian as a tar archive, made by mmdebstrap from the sources that this machine's apt has.

It is kept for a day in the cache folder of the user who tests, since making it takes half a minute.
"""

from __future__ import annotations

import fcntl
import os
import shutil
import subprocess
import time
from pathlib import Path

SUITE = "bookworm"
KEPT_S = 24 * 3600
KEYS = Path("/usr/share/keyrings/debian-archive-keyring.gpg")
MIRROR = f"deb [signed-by={KEYS}] http://deb.debian.org/debian {SUITE} main"


def missing() -> str:
    """Why no Debian can be made here; empty where one can."""
    return "" if KEYS.exists() or _sources() else "this machine has no keys of Debian's archive"


def archive() -> Path:
    """The tar archive, made where there is none of today. Testers that run side by side make it once."""
    folder = _cache()
    folder.mkdir(parents=True, exist_ok=True)
    target = folder / f"{SUITE}-minbase.tar"
    with (folder / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not _is_fresh(target):
            _make(target)
    return target


def _cache() -> Path:
    home = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    return Path(home) / "ros-lab-grader-tests"


def _is_fresh(target: Path) -> bool:
    return target.exists() and time.time() - target.stat().st_mtime < KEPT_S


def _make(target: Path) -> None:
    part = target.with_suffix(f".{os.getpid()}.tar")
    command = ["mmdebstrap", "--quiet", "--variant=minbase", "--format=tar", SUITE, str(part)]
    try:
        done = subprocess.run(
            [*command, *(map(str, _sources()) or [MIRROR])],
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            check=False,
            timeout=280,
        )
        if done.returncode:
            raise AssertionError(f"mmdebstrap could not make a Debian:\n{done.stderr[-3000:]}")
        part.replace(target)
    finally:
        part.unlink(missing_ok=True)


def _sources() -> list[Path]:
    """Where this machine's apt gets Debian 12 from; nothing where it is another system."""
    apt = Path("/etc/apt")
    files = [apt / "sources.list", *sorted((apt / "sources.list.d").glob("*"))]
    texts = {
        f: f.read_text(errors="replace") for f in files if f.suffix in {".list", ".sources"} and f.is_file()
    }
    return [f for f, text in texts.items() if SUITE in text and "debian" in text and shutil.which("apt-get")]
