"""Workspaces that are built once in a sandbox and kept: the base workspace, and that of a rubric's own packages.

The base workspace has what CMake learns of the machine in a workspace without packages. Every build unpacks it in its
own memory before `catkin_make` runs, as if that had run there once before. The packages that a rubric brings along lie
in a workspace of their own below the student's, as an overlay has it: the student's `find_package`, imports and launch
files find them, and so do the grader's programs.

Both are kept in a folder of the user's that no other user can write (`~/.cache/grader`) and no sandbox shows. Whatever
is wrong with the base workspace, or with a file in it, costs time and nothing else.
"""

from __future__ import annotations

import hashlib
import io
import json
import os
import platform
import shutil
import stat
import tarfile
from collections.abc import Collection, Iterator
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from grader import __version__
from grader.arena.interruption import run_until_signal
from grader.arena.limits import RunLimits
from grader.arena.process_environment import BASE, ProcessEnvironment
from grader.arena.sandbox import Word, choose_sandbox, copy_of, scratch, temporary_base
from grader.arena.sandbox_files import ANSWERS, COURSE, INSIDE_WORKSPACE, QUESTIONS, SOURCES, prepare
from grader.arena.session import ArenaSession
from grader.arena.workspace import Workspace, give_to, read_member
from grader.errors import ArenaError, GraderError
from grader.evidence.writer import EvidenceWriter
from grader.files import atomic_write, open_untrusted, temporary_folder, user_folder
from grader.model import SandboxMode
from grader.ros_env import find_ros
from grader.rubric.course_packages import SCRIPT, folder_files

NAME = "base workspace"
MAKE_S = 60.0
ANSWER_BYTES = 1000
ASK = "".join(
    f"answer=$({question} 2>/dev/null) && echo \"$answer\" >'{ANSWERS}/{question}'; "
    for question in QUESTIONS
)
BASE_SCRIPT = (
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
    # Relative to each prefix: what `find_package` and `find_program` look through.
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
# A base workspace is far smaller: anything larger is not one.
BYTES_MAX = 8 << 20
FILES_MAX = 8
_OTHERS_WRITE = stat.S_IWGRP | stat.S_IWOTH


def provide_base(mode: SandboxMode) -> None:
    """Have a base before many submissions are graded; where it cannot be made, each is built without.

    Raises GraderError where this machine lets nothing be run in this `mode`.
    """
    ros = find_ros()
    sandbox = choose_sandbox(mode) if ros else None
    if ros is None or sandbox is None or not sandbox.bubblewrap:
        return
    # Others may pass through the folder, but not list it: students' processes have another user where root grades.
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
    # The sandbox's user reads it.
    place.base.chmod(0o644)
    _hand_answers(place)
    return True


def base_spec(place: ProcessEnvironment) -> dict[str, Any]:
    """Return the process that makes one: in a sandbox as the build's, with nothing of a submission's in it."""
    argv = ["/bin/bash", "-c", BASE_SCRIPT, "bash", *catkin_make(place)]
    bare = replace(place, env={}, sees_course=False)
    return bare.spec(NAME, argv, role="grader", copy=False, as_handed_in=True, collect=BASE)


def keep_base(place: ProcessEnvironment, exit_code: int | None) -> None:
    """Keep what that process handed over, if it came to its end."""
    if exit_code == 0 and place.base.is_file():
        keep(_file_name(place), place.base.read_bytes())
        _hand_answers(place)


def catkin_make(place: ProcessEnvironment, folder: str = "") -> list[str]:
    """Return the command that builds the workspace in `folder`, by default the submission's."""
    return [
        "catkin_make", "-C", folder or place.inside_workspace, "-j2", "--no-color", "--cmake-args",
        f"-DPYTHON_EXECUTABLE={place.ros.python}",
    ]  # fmt: skip


def _hand_answers(place: ProcessEnvironment) -> None:
    """Give the answers to the programs that stand before the real ones (`ros/cached_answers.sh`)."""
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
    """Return a digest of all that CMake learns here: another machine, other programs or another ROS have another."""
    spec = base_spec(place)
    # Whatever is missing here would let a build use what CMake learnt of another machine.
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
    """Yield the files and folders in which a change of the machine shows."""
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
    folder = user_folder("cache")
    with suppress(OSError):
        status = folder.lstat()
        if status.st_uid != os.geteuid() or stat.S_IMODE(status.st_mode) != stat.S_IRWXU:
            return None
        with open_untrusted(folder, name) as file:
            status = os.fstat(file.fileno())
            own = status.st_uid == os.geteuid() and not status.st_mode & _OTHERS_WRITE
            return _verify_sum(file.read(bytes_max)) if own else None
    return None


def keep(name: str, data: bytes) -> None:
    """Keep it, if that can be done here. Of the files that are kept, the newest stay."""
    folder = user_folder("cache")
    with suppress(OSError, GraderError):
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        # In a folder of another user's, or behind a link, someone could replace what every build begins with.
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


def _verify_sum(data: bytes) -> bytes | None:
    content = data[hashlib.sha256().digest_size :]
    return content if data[: -len(content) or None] == _sum(content) else None


def _sum(data: bytes) -> bytes:
    return hashlib.sha256(data).digest()


COURSE_NAME = "course packages"
ARCHIVE = "course.tar"
BUILD_S = 300.0
BUILT_BYTES_MAX = 64 << 20
BUILT_FILES = 20_000
LINES_MAX = 3
MAKE = f'mkdir -p {COURSE}/src && cp -R {SOURCES}/. {COURSE}/src/ && cd "$HOME" && "$@"'
BUILD = f"{MAKE} && tar -cf - -C {COURSE} devel >&{{collect}}"


def copy_course(beside: Path, packages: Collection[str], folder: Path) -> None:
    """Copy the packages from the rubric's folder into `folder`/src; scripts are executable there.

    Raises ArenaError where they cannot be read any more.
    """
    for name in packages:
        try:
            files = folder_files(beside, name)
        except (OSError, ValueError) as error:
            raise ArenaError(f"the lab's package {name} cannot be read: {error}") from error
        for path, data in files.items():
            target = folder / "src" / path
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(data)
            target.chmod(0o755 if data.startswith(SCRIPT) else 0o644)


async def provide_course(place: ProcessEnvironment) -> None:
    """Have the course's packages built, from the cache if they are there. Raises ArenaError where they do not build."""
    if not place.course.is_dir():
        return
    name = f"course-{_digest(place)}.tar"
    built = read_kept(name, BUILT_BYTES_MAX) if place.sandbox.bubblewrap else None
    if built is None:
        built = await _build(place)
        if built:
            keep(name, built)
    if built:
        unpack(built, place.course)


def unpack(built: bytes, folder: Path) -> None:
    """Unpack what a build left, plain files and links beside them. Debian 12's own Python has no `data_filter`."""
    with tarfile.open(fileobj=io.BytesIO(built)) as archive:
        archive.extraction_filter = getattr(tarfile, "data_filter", None)
        archive.extractall(folder, members=filter(_as_ours, archive))  # noqa: S202 - each is looked at


def _as_ours(member: tarfile.TarInfo) -> bool:
    """Return whether a member stays inside the folder, and make it the grader's own, which no one else can write."""
    member.uid, member.gid, member.uname, member.gname = os.geteuid(), os.getegid(), "", ""
    # Without setuid bits, and closed to the student's user for writing.
    member.mode &= 0o755
    plain = member.isreg() or member.isdir() or (member.issym() and "/" not in member.linkname)
    return (
        plain and not member.name.startswith("/") and ".." not in (*Path(member.name).parts, member.linkname)
    )


def _digest(place: ProcessEnvironment) -> str:
    digest = hashlib.sha256(machine_digest(place).encode())
    sources = place.course / "src"
    for path in sorted(sources.rglob("*")):
        if path.is_file():
            digest.update(
                f"{path.relative_to(sources)}\0{hashlib.sha256(path.read_bytes()).hexdigest()}\n".encode()
            )
    return digest.hexdigest()[:32]


async def _build(place: ProcessEnvironment) -> bytes:
    """Return the archive of `devel/`; without a sandbox it is built in place, and nothing is returned."""
    path, boxed = place.folder / "course.mcap", place.sandbox.bubblewrap
    if not boxed:
        give_to(place.course, place.sandbox.uid)
    with EvidenceWriter(path, scenario="course", clock="real", warp=1.0, metadata={}) as writer:
        async with ArenaSession(place, writer, master=False) as arena:
            ended = await arena.run_to_end(_spec(place), BUILD_S, int_s=2.0)
            await arena.finish()
    if not ended or arena.exit_codes.get(COURSE_NAME) != 0:
        raise ArenaError(
            f"the lab's own packages do not build: {_last_words(path) or 'catkin_make failed'}",
            hint="it is the course's to fix: catkin_make shows the same on the folders of the rubric's `packages`",
        )
    if not boxed and place.sandbox.uid is not None:
        give_to(place.course, os.geteuid())
    archive = place.workspace.kept / ARCHIVE
    return archive.read_bytes() if boxed and archive.is_file() else b""


def _spec(place: ProcessEnvironment) -> dict[str, Any]:
    boxed = place.sandbox.bubblewrap
    sources = place.course / "src"
    memory = scratch(4 * BUILT_BYTES_MAX, BUILT_FILES)
    binds: list[Word] = ["--ro-bind", copy_of(sources), SOURCES, "--bind", memory, COURSE]
    make = catkin_make(place, COURSE if boxed else str(place.course))
    argv = ["/bin/bash", "-c", BUILD, "bash", *make] if boxed else make
    bare = replace(place, env={}, sees_course=False)
    return bare.spec(
        COURSE_NAME,
        argv,
        role="grader",
        copy=False,
        as_handed_in=True,
        collect=ARCHIVE if boxed else None,
        collect_bytes=BUILT_BYTES_MAX,
        binds=binds if boxed else (),
    )


def _last_words(path: Path) -> str:
    """Return what the build printed last about an error."""
    from grader.evidence.reader import load_run  # noqa: PLC0415 - only where something is wrong

    lines = [line.line.strip() for _, line in load_run(path).console]
    errors = [line for line in lines if "rror" in line]
    return "; ".join((errors or lines)[:LINES_MAX])
