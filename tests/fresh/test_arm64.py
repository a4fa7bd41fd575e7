"""arm64, by an emulator of its programs: tests without ROS of what may depend on the processor.

Debian's packages for arm64 are only unpacked: running their installation in the emulator takes half an hour. The kernel
stays this machine's, and so does what it tells of processes; programs in a sandbox cannot be emulated like this.
"""

from __future__ import annotations

import hashlib
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.fresh import debian
from tests.fresh.kept import kept, sweep
from tests.fresh.room import missing

pytestmark = [pytest.mark.full, pytest.mark.slow, pytest.mark.timeout(1800)]

REPO = Path(__file__).resolve().parents[2]
EMULATOR = "qemu-aarch64-static"
PACKAGES = ("python3", "git", "bash", "coreutils", "dash", "libc-bin", "libseccomp2", "libstdc++6")
WHEELS = (
    "-r",
    "pyproject.toml",
    "hypothesis",
    "mcap-ros1-support",
    "pyseccomp",
    "pytest-timeout",
    "pytest-xdist",
)
SITE = "usr/local/lib/python3.11/dist-packages"
IN_NAMESPACES = [
    "unshare",
    "--user",
    "--map-root-user",
    "--mount",
    "--net",
    "--pid",
    "--fork",
    "--kill-child",
]
FORMAT = (
    r":arm64:M::\x7fELF\x02\x01\x01\x00\x00\x00\x00\x00\x00\x00\x00\x00\x02\x00\xb7\x00"
    r":\xff\xff\xff\xff\xff\xff\xff\x00\xff\xff\xff\xff\xff\xff\xff\xff\xfe\xff\xff\xff"
)
"""Which programs the kernel starts with the emulator (its Documentation/admin-guide/binfmt-misc.rst): ELF files of 64
bits for that processor."""
IN_ROOT = f"""
set -e
mount -t binfmt_misc none /proc/sys/fs/binfmt_misc
printf %s '{FORMAT}':"$(command -v {EMULATOR})":F >/proc/sys/fs/binfmt_misc/register
ip link set lo up
mount --bind "$1" "$1" && cd "$1" && mkdir -p repo
mount -t proc proc proc && mount --rbind /dev dev && mount -t tmpfs none tmp && mount --bind "$2" repo
shift 2
exec chroot . /usr/bin/env -i PATH=/usr/bin:/usr/sbin:/bin:/sbin HOME=/root LANG=C.UTF-8 GRADER_ROS_SETUP=none \\
  PYTHONPATH=/repo PYTHONDONTWRITEBYTECODE=1 /usr/bin/env -C /repo "$@"
"""
TESTS = (
    "tests/arena",
    "tests/evidence",
    "tests/package/test_launch.py",
    "tests/package/test_manifest.py",
)
NEED_ANOTHER_USER_OR_BUBBLEWRAP = (
    "test_base_workspace.py",
    "test_control_groups_delegated.py",
    "test_sandbox_probe.py",
    "standins",
)
"""Of tests/arena: what is mapped into the namespaces is one user, and an emulated program makes none of its own."""


@pytest.fixture
def root(tmp_path: Path) -> Path:
    if why := missing() or _not_emulated():
        pytest.skip(why)
    uv = [sys.executable, "-m", "uv", "pip", "install", "--quiet", "--only-binary", ":all:"]
    uv += ["--python-platform", "aarch64-manylinux_2_36", "--python-version", "3.11", *WHEELS]
    hook = f'cd {shlex.quote(str(REPO))} && {shlex.join(uv)} --target "$1/{SITE}"'
    options = ["--variant=extract", "--architectures=arm64", "--skip=check/qemu"]
    options += [f"--include={','.join(PACKAGES)}", f"--extract-hook={hook}"]
    key = hashlib.sha256((REPO / "pyproject.toml").read_bytes() + repr(options).encode()).hexdigest()[:16]
    archive = kept(f"arm64-{key}.tar", lambda target: debian.make(target, options=options))
    sweep("arm64-*.tar", but=archive.name)
    unpack = ["tar", "--numeric-owner", "-xf", str(archive), "-C", str(tmp_path)]
    subprocess.run(unpack, check=True)
    (tmp_path / "etc" / "passwd").write_text("root:x:0:0:root:/root:/bin/sh\n")  # the installation writes it
    return tmp_path


def _not_emulated() -> str:
    """Why no programs for arm64 run here; empty where they do. Since Linux 6.7, user namespaces have their own."""
    if not shutil.which(EMULATOR):
        return f"no {EMULATOR} here"
    trial = [*IN_NAMESPACES, "mount", "-t", "binfmt_misc", "none", "/proc/sys/fs/binfmt_misc"]
    tried = subprocess.run(trial, check=False, capture_output=True, text=True)
    return f"no format of its own in a namespace: {tried.stderr.strip()}" if tried.returncode else ""


def run(root: Path, *argv: str) -> subprocess.CompletedProcess[str]:
    command = [*IN_NAMESPACES, "sh", "-c", IN_ROOT, "sh", str(root), str(REPO), *argv]
    return subprocess.run(command, check=False, capture_output=True, text=True)


def test_what_depends_on_the_processor(root: Path) -> None:
    assert run(root, "ldconfig").returncode == 0
    machine = run(root, "python3", "-c", "import os; print(os.uname().machine)")
    assert machine.stdout == "aarch64\n", machine.stderr
    tests = ["-m", "pytest", "-q", "-p", "no:cacheprovider", "-m", "not ros and not full", *TESTS]
    tests += [f"--ignore=tests/arena/{name}" for name in NEED_ANOTHER_USER_OR_BUBBLEWRAP]
    done = run(root, "python3", *tests)
    assert done.returncode == 0, done.stdout[-6000:] + done.stderr[-2000:]
    assert "test_system_calls" not in done.stdout, "skipped: no libseccomp"
