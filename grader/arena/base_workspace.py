"""The base workspace: what CMake learns of the machine in a workspace without packages, learnt once and kept.

Every build unpacks it in its own memory before `catkin_make` runs, as if that had run there once before. It is kept in
a folder of the user's that no other user can write (`~/.cache/grader`) and no sandbox shows. Whatever is wrong with it,
or with a file in it, costs time and nothing else.
"""

from __future__ import annotations

import hashlib
import json
import os
import platform
import shutil
import stat
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from grader import __version__
from grader.arena.asynchronous import run_until_signal
from grader.arena.limits import RunLimits
from grader.arena.process_environment import BASE, ProcessEnvironment
from grader.arena.sandbox import temporary_base
from grader.arena.sandbox_files import ANSWERS, INSIDE_WORKSPACE, QUESTIONS, prepare
from grader.arena.sandbox_probe import choose
from grader.arena.session import ArenaSession
from grader.arena.workspace import Workspace, read_member
from grader.errors import ArenaError, GraderError
from grader.evidence.writer import EvidenceWriter
from grader.files import atomic_write, open_untrusted, temporary_folder
from grader.model.sandbox_mode import SandboxMode
from grader.ros_env import find_ros

NAME = "base workspace"
MAKE_S = 60.0
ANSWER_BYTES = 1000
ASK = "".join(
    f"answer=$({question} 2>/dev/null) && echo \"$answer\" >'{ANSWERS}/{question}'; "
    for question in QUESTIONS
)
SCRIPT = (
    f'mkdir -p {INSIDE_WORKSPACE}/src && cd "$HOME" && "$@" >/dev/null 2>&1 && cd {INSIDE_WORKSPACE}'
    f" && mkdir {ANSWERS} && shopt -s nullglob || exit 1; {ASK}"
    f"exec tar -cf - {ANSWERS} build/CMakeCache.txt build/CMakeFiles/{{*.log,*/CMake*.cmake}} >&{{collect}}"
)
"""CMake's cache, and what it knows of system and compilers: all else it makes again. And answers, by question."""
PROGRAMS = (
    "as", "bash", "c++", "catkin_find_pkg", "catkin_make", "cc", "cmake", "empy", "g++", "gcc", "ld", "lsb_release",
    "make", "python3", "tar",
)  # fmt: skip
SYSTEM = (
    "/etc/alternatives", "/etc/ld.so.cache", "/etc/os-release", "/usr/include", "/usr/lib", "/usr/lib/cmake",
    "/usr/local", "/usr/share", "/usr/src", "/var/lib/dpkg/status",
)  # fmt: skip
BELOW = (
    "bin",
    "conda-meta",
    "include",
    "lib",
    "lib/cmake",
    "share",
    "share/catkin/cmake",
    "share/roslaunch/package.xml",
    "src",
)
BYTES_MAX = 8 << 20
FILES_MAX = 8
_OTHERS_WRITE = stat.S_IWGRP | stat.S_IWOTH


def provide_base(mode: SandboxMode) -> None:
    """Have a base before many submissions are graded; where it cannot be made, each is built without.

    Raises GraderError where this machine lets nothing be run in this `mode`.
    """
    ros = find_ros()
    sandbox = choose(mode) if ros else None
    if ros is None or sandbox is None or not sandbox.bubblewrap:
        return
    with temporary_folder("run", temporary_base(sandbox)) as folder:
        folder.chmod(0o711)
        inner = folder / "base"
        inner.mkdir()
        inner.chmod(0o711)
        prepare(inner, ros)
        place = ProcessEnvironment(
            folder=inner, ros=ros, sandbox=sandbox, limits=RunLimits(), workspace=_empty(inner), package=""
        )
        if not has_base(place):
            with suppress(ArenaError):
                run_until_signal(_make(place))


def has_base(place: ProcessEnvironment) -> bool:
    """Give this place the base that fits it, if there is one."""
    kept = read_kept(_file_name(place)) if place.sandbox.bubblewrap else None
    if kept is None:
        return False
    place.base.write_bytes(kept)
    place.base.chmod(0o644)
    _hand_answers(place)
    return True


def base_spec(place: ProcessEnvironment) -> dict[str, Any]:
    """Return the process that makes one: in a sandbox as the build's, with nothing of a submission's in it."""
    argv = ["/bin/bash", "-c", SCRIPT, "bash", *catkin_make(place)]
    bare = replace(place, env={}, sees_course=False)
    return bare.spec(NAME, argv, role="grader", copy=False, as_handed_in=True, collect=BASE)


def keep_base(place: ProcessEnvironment, exit_code: int | None) -> None:
    """Keep what that process handed over, if it came to its end."""
    if exit_code == 0 and place.base.is_file():
        keep(_file_name(place), place.base.read_bytes())
        _hand_answers(place)


def catkin_make(place: ProcessEnvironment) -> list[str]:
    return [
        "catkin_make", "-C", place.inside_workspace, "-j2", "--no-color", "--cmake-args",
        f"-DPYTHON_EXECUTABLE={place.ros.python}",
    ]  # fmt: skip


def _hand_answers(place: ProcessEnvironment) -> None:
    """To the programs that stand before the real ones (`ros/known.sh`)."""
    for question in QUESTIONS:
        answer = read_member(place.base, f"{ANSWERS}/{question}", ANSWER_BYTES)
        if answer is not None:
            path = place.folder / "bin" / ANSWERS / question
            path.write_bytes(answer)
            path.chmod(0o644)


async def _make(place: ProcessEnvironment) -> None:
    with EvidenceWriter(
        place.folder / "base.mcap", scenario="base", clock="real", warp=1.0, metadata={}
    ) as writer:
        async with ArenaSession(place, writer, master=False) as arena:
            arena.start(base_spec(place))
            await arena.wait(lambda: NAME in arena.exit_codes, MAKE_S)
            await arena.finish()
    keep_base(place, arena.exit_codes.get(NAME))


def _empty(folder: Path) -> Workspace:
    kept = folder / "kept"
    kept.mkdir()
    nothing = folder / "nothing"
    return Workspace(built=nothing, repaired=nothing, large=nothing, kept=kept, folder="", repairs={})


def _file_name(place: ProcessEnvironment) -> str:
    return f"workspace-{machine_digest(place)}.tar"


def machine_digest(place: ProcessEnvironment) -> str:
    """Return another one for whatever else CMake could find: another machine, other programs, another ROS."""
    spec = base_spec(place)
    known = {
        "grader": __version__,
        "kernel": [platform.system(), platform.release(), platform.machine()],
        "argv": spec["argv"],
        "env": spec["env"],
        "shims": [name for name in PROGRAMS if (place.folder / "bin" / name).exists()],
        "files": list(_looks(place)),
    }
    return hashlib.sha256(json.dumps(known, sort_keys=True).encode()).hexdigest()[:32]


def _looks(place: ProcessEnvironment) -> Iterator[tuple[str, int, int, int]]:
    """The files and folders in which a change of the machine shows."""
    path = place.ros.env["PATH"]
    programs = [shutil.which(name, path=path) for name in PROGRAMS]
    roots = ("/usr", "/usr/local", *place.ros.prefixes, *_entries(place.ros.env.get("CMAKE_PREFIX_PATH", "")))
    folders = [*SYSTEM, *_entries(path), *(f"{root}/{name}" for root in roots for name in BELOW)]
    for name in dict.fromkeys([place.ros.python, *filter(None, programs), *folders]):
        with suppress(OSError):
            status = Path(name).stat()
            yield name, status.st_ino, status.st_mtime_ns, status.st_size


def _entries(path: str) -> list[str]:
    return [entry for entry in path.split(os.pathsep) if entry]


def read_kept(name: str, bytes_max: int = BYTES_MAX) -> bytes | None:
    """Return what was kept under that name; None where there is none that is whole and only this user's."""
    with suppress(OSError):
        if _is_private(_folder().lstat()):
            return _checked(_read(name, bytes_max))
    return None


def keep(name: str, data: bytes) -> None:
    """Keep it, if that can be done here. Of the files that are kept, the newest stay."""
    folder = _folder()
    with suppress(OSError, GraderError):
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        if folder.is_symlink() or folder.stat().st_uid != os.geteuid():
            return
        folder.chmod(0o700)
        target = folder / name
        if target.is_symlink():
            target.unlink()
        atomic_write(target, _sum(data) + data)
        files = [path for path in folder.iterdir() if stat.S_ISREG(path.lstat().st_mode)]
        files.sort(key=lambda path: path.lstat().st_mtime_ns, reverse=True)
        for old in files[FILES_MAX:]:
            old.unlink()


def _folder() -> Path:
    """As the XDG base directory specification says it: a relative path does not count."""
    named = Path(os.environ.get("XDG_CACHE_HOME", ""))
    return (named if named.is_absolute() else Path(os.path.expanduser("~"), ".cache")) / "grader"  # noqa: PTH111 - never raises


def _is_private(status: os.stat_result) -> bool:
    return status.st_uid == os.geteuid() and stat.S_IMODE(status.st_mode) == stat.S_IRWXU


def _read(name: str, bytes_max: int) -> bytes:
    with open_untrusted(_folder(), name) as file:
        status = os.fstat(file.fileno())
        own = status.st_uid == os.geteuid() and not status.st_mode & _OTHERS_WRITE
        return file.read(bytes_max) if own else b""


def _checked(data: bytes) -> bytes | None:
    content = data[hashlib.sha256().digest_size :]
    return content if data[: -len(content) or None] == _sum(content) else None


def _sum(data: bytes) -> bytes:
    return hashlib.sha256(data).digest()
