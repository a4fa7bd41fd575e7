"""The packages that a rubric brings along, as every run sees them: built once in a sandbox and kept, read only.

They lie in a workspace of their own below the student's, as an overlay has it: the student's `find_package`, imports
and launch files find them, and so do the grader's programs.
"""

from __future__ import annotations

import hashlib
import io
import os
import tarfile
from collections.abc import Collection
from dataclasses import replace
from pathlib import Path
from typing import Any

from grader.arena.base_workspace import keep, machine_digest, read_kept
from grader.arena.process_environment import ProcessEnvironment
from grader.arena.sandbox import Word, copy_of, scratch
from grader.arena.sandbox_files import COURSE, SOURCES
from grader.arena.session import ArenaSession
from grader.arena.workspace import give_to
from grader.errors import ArenaError
from grader.evidence.writer import EvidenceWriter
from grader.rubric.course_packages import SCRIPT, folder_files

NAME = "course packages"
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
        with tarfile.open(fileobj=io.BytesIO(built)) as archive:
            archive.extractall(place.course, filter="data")


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
            arena.start(_spec(place))
            ended = await arena.wait(lambda: NAME in arena.exit_codes, BUILD_S)
            if not ended:
                await arena.interrupt(NAME, int_s=2.0, term_s=1.0)
            await arena.finish()
    if not ended or arena.exit_codes.get(NAME) != 0:
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
    binds: list[Word] = [
        "--ro-bind",
        copy_of(sources),
        SOURCES,
        "--bind",
        scratch(4 * BUILT_BYTES_MAX, BUILT_FILES),
        COURSE,
    ]
    make = [
        "catkin_make", "-C", COURSE if boxed else str(place.course), "-j2", "--no-color", "--cmake-args",
        f"-DPYTHON_EXECUTABLE={place.ros.python}",
    ]  # fmt: skip
    argv = ["/bin/bash", "-c", BUILD, "bash", *make] if boxed else make
    bare = replace(place, env={}, sees_course=False)
    return bare.spec(
        NAME,
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
