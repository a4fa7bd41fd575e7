"""A bare Debian as a tar archive, made by mmdebstrap from the sources that this machine's apt has."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

SUITE = "bookworm"
ARCHIVE = f"{SUITE}-minbase.tar"
KEYS = Path("/usr/share/keyrings/debian-archive-keyring.gpg")
MIRROR = f"deb [signed-by={KEYS}] http://deb.debian.org/debian {SUITE} main"


def missing() -> str:
    """Why no Debian can be made here; empty where one can."""
    return "" if KEYS.exists() or _sources() else "this machine has no keys of Debian's archive"


def make(target: Path, *, options: Sequence[str] = ("--variant=minbase",)) -> None:
    """Write the archive, as mmdebstrap makes it with these options. Raises AssertionError with what that said."""
    command = ["mmdebstrap", "--quiet", *options, "--format=tar", SUITE, str(target)]
    done = subprocess.run(
        [*command, *(map(str, _sources() or [MIRROR]))],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=False,
        timeout=600,
    )
    if done.returncode:
        raise AssertionError(f"mmdebstrap could not make a Debian:\n{done.stderr[-3000:]}")


def _sources() -> list[Path]:
    """Where this machine's apt gets Debian 12 from; nothing where it is another system."""
    apt = Path("/etc/apt")
    files = [apt / "sources.list", *sorted((apt / "sources.list.d").glob("*"))]
    texts = {
        f: f.read_text(errors="replace") for f in files if f.suffix in {".list", ".sources"} and f.is_file()
    }
    return [f for f, text in texts.items() if SUITE in text and "debian" in text and shutil.which("apt-get")]
