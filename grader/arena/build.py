"""Builds the workspace as handed in, in the sandbox, and learns from it what only ROS's own programs can say."""

from __future__ import annotations

import json
import os
import shlex
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

from grader.arena.base_workspace import NAME as BASE_NAME
from grader.arena.base_workspace import base_spec, catkin_make, has_base, keep_base
from grader.arena.process_environment import ARCHIVE, ProcessEnvironment
from grader.arena.recording_files import RunCost
from grader.arena.session import ArenaSession
from grader.arena.workspace import read_member, run_in_place
from grader.evidence.events import CATKIN_MAKE, ActorEvent, ScenarioEvent
from grader.evidence.writer import EvidenceWriter
from grader.files import READ_MAX, read_untrusted
from grader.model.record import Record
from grader.package.cmake import written_calls
from grader.package.python import REPORT_BYTES_MAX
from grader.ros_env import DUMP_BYTES, excess_of, keep_ros_variables, parse_env

BUILD_S = 120.0
BUILD_EXPECTED_S = 2.0
BASE_S = 1.0
"""What is made beside the build is nearly there when that ends: lost, it would be made in every grading again."""
STEP_S = 20.0
ROSRUN_S = 4.0
INCLUDED_MAX = 20
TRACE = "cmake-trace.json"
SYNTAX = "syntax.jsonl"
ENVIRONMENT = "environment"
SETUP = "setup.bash"
TWICE = """n=$1; shift; "${@:1:n}" >/dev/null 2>&1; exec "${@:n+1}\""""
"""Runs so many of its words as one command, and then the others, whose output alone counts."""
DUMP = """for name in $(compgen -e); do printf '%s=%s\\0' "$name" "${!name}"; done;"""
"""As `env -0` does, which could not even be started where a variable is too large for the kernel."""


class CMakeTrace(Record):
    """A package's part of CMake's trace, as a copy that no student's process can reach; `root` is its folder as CMake
    saw it."""

    trace: Path | None
    root: str


class BuildOutcome(RunCost):
    """`trace` and `syntax` are copies that no student's process can reach; `root` is the package as CMake saw it.
    `others` are the traces of the lab's other packages, by the lab's names for them."""

    ok: bool
    trace: Path | None
    root: str
    syntax: Path | None
    others: dict[str, CMakeTrace]


async def build(
    place: ProcessEnvironment,
    writer: EvidenceWriter,
    python_files: Iterable[str],
    answers: Iterable[str],
    *,
    headers: Sequence[str] = (),
    last_run: bool = False,
    answers_of: Mapping[str, Iterable[str]] = MappingProxyType({}),
) -> tuple[ProcessEnvironment, BuildOutcome]:
    """Run `catkin_make`, then `rosrun` on each script of `answers` as handed in (`answers_of`: of the lab's other
    packages); what they print is evidence. `headers` are targets to be made before the others. `python_files`, where
    there are any, are compiled by ROS's own Python, and not run.

    Returns the place with the built workspace's environment. Raises ArenaError where the arena fails.
    """
    # On one core, a base beside the build would only make this build later.
    wants_base = place.sandbox.bubblewrap and not has_base(place) and len(os.sched_getaffinity(0)) > 1
    (place.folder / "bin" / "python-files.json").write_text(json.dumps(to_compile := list(python_files)))
    async with ArenaSession(place, writer, master=False, last_run=last_run) as arena:
        make, beside = _catkin_make(place, headers), [_syntax_spec(place)] if to_compile else []
        ended = await _run_catkin_make(place, arena, make, beside, with_base=wants_base)
        ok = arena.exit_codes.get(CATKIN_MAKE) == 0
        # behind a program that does not compile, messages and other programs are there all the same
        built = await _with_setup(place, arena) if ended else place.from_source()
        for package, scripts in ((None, answers), *answers_of.items()):
            own = built.of(package)
            for script in scripts if own else ():
                await _answer(own or built, arena, script)
        if wants_base and ended:
            await arena.wait(lambda: BASE_NAME in arena.exit_codes, BASE_S)
        outcome, detail = ("complete", "") if ended else ("timeout", f"build over {BUILD_S:g} s")
        arena.course(ScenarioEvent(event="end", outcome=outcome, detail=detail))
        await arena.finish()
    if wants_base:
        keep_base(place, arena.exit_codes.get(BASE_NAME))
    if not place.sandbox.bubblewrap:
        run_in_place(place.workspace, place.sandbox)
    trace, too_much = _trace(place)
    _note_excess(writer, built.built.too_much, too_much)
    return built, BuildOutcome(
        ok=ok,
        trace=trace,
        root=place.package_folder,
        syntax=_kept_file(place, SYNTAX) if to_compile else None,
        others=dict(_traces_of_others(place)),
        cpu_s=arena.cpu_s,
        student_cpu_s=arena.student_cpu_s,
    )


def _traces_of_others(place: ProcessEnvironment) -> Iterator[tuple[str, CMakeTrace]]:
    for name in place.workspace.others:
        if (own := place.of(name)) is not None:
            yield name, CMakeTrace(trace=_trace(own)[0], root=own.package_folder)


async def _run_catkin_make(
    place: ProcessEnvironment,
    arena: ArenaSession,
    command: list[str],
    beside: list[dict[str, Any]],
    *,
    with_base: bool,
) -> bool:
    """Build the workspace by the command, with other processes beside it; return whether the build ended by itself."""
    arena.course(ScenarioEvent(event="begin"))
    arena.start(place.spec(CATKIN_MAKE, command, role="build", build=True, collect=ARCHIVE))
    for spec in beside:
        arena.start(spec)
    if with_base:  # beside the build, on another core
        arena.start(base_spec(place))
    ended = await arena.wait(lambda: CATKIN_MAKE in arena.exit_codes, BUILD_S)
    if not ended:
        await arena.interrupt(CATKIN_MAKE, int_s=2.0, term_s=1.0)
    await arena.wait(lambda: all(spec["name"] in arena.exit_codes for spec in beside), STEP_S)
    return ended


def _catkin_make(place: ProcessEnvironment, headers: Sequence[str]) -> list[str]:
    """Return the command of the build, with a trace of every `CMakeLists.txt` and of the package's own `.cmake` files.
    The package's part is picked from it later. Of the `headers`, the targets are made first: whether a program that
    does not wait for them finds them would be luck, and is judged by the files."""
    own = (place.workspace, *place.workspace.others.values())
    packages = [one.repaired / one.folder for one in own]
    found = {p.relative_to(folder).as_posix() for folder in packages for p in folder.rglob("*.cmake")}
    included = sorted(found)[:INCLUDED_MAX]
    whole = [
        *catkin_make(place), "--trace-expand", "--trace-format=json-v1",
        *(f"--trace-source={name}" for name in ("CMakeLists.txt", *included)),
        f"--trace-redirect={place.output}/{TRACE}",
        # what is wrong with one program hides nothing of the others
        "--make-args", "-k",
    ]  # fmt: skip
    if not headers:
        return whole
    first = [*whole, *headers]
    return ["/bin/bash", "-c", TWICE, "bash", str(len(first)), *first, *whole]


def _note_excess(writer: EvidenceWriter, *found: str) -> None:
    """Note what the build left too much of, given in words, as far as there is any."""
    for detail in filter(None, found):
        event = ActorEvent(action="limit", actor=CATKIN_MAKE, detail=detail)
        writer.event("/grader/actor", time.time_ns(), event)


def _syntax_spec(place: ProcessEnvironment) -> dict[str, Any]:
    """Return how to start ROS's own Python, which compiles every script of the package and runs none."""
    # Isolated (`-I`): no module of the package's can take the place of one that it imports.
    script = 'python3 -I "$1/grader-syntax.py" "$2" < "$1/python-files.json" >' + _target(place, SYNTAX)
    argv = ["/bin/bash", "-c", script, "bash", place.shims, place.package_folder]
    room = 2 * REPORT_BYTES_MAX
    return place.spec("syntax", argv, role="grader", as_handed_in=True, collect=SYNTAX, collect_bytes=room)


def _target(place: ProcessEnvironment, name: str) -> str:
    """Return where a shell writes what is kept under that name."""
    return "&{collect}" if place.sandbox.bubblewrap else shlex.quote(f"{place.output}/{name}")


async def _with_setup(place: ProcessEnvironment, arena: ArenaSession) -> ProcessEnvironment:
    """Return the environment that `source devel/setup.bash` gives."""
    script = f'source "$1/devel/setup.bash" && {{ {DUMP} }} >' + _target(place, ENVIRONMENT)
    argv = ["/bin/bash", "-c", script, "bash", place.inside_workspace]
    room = DUMP_BYTES + 1
    spec = place.spec(SETUP, argv, role="build", as_handed_in=True, collect=ENVIRONMENT, collect_bytes=room)
    await arena.run_to_end(spec, STEP_S)
    path = _kept_file(place, ENVIRONMENT)
    dump = path.read_bytes() if path and arena.exit_codes.get(SETUP) == 0 else None
    excess = excess_of(dump) if dump else ""
    if excess:
        arena.note(
            ActorEvent(action="limit", actor=SETUP, detail=f"it sets {excess}: nodes run without them")
        )
    # Nodes run all the same, by the sources: what the build lacks is its own criterion's.
    if not dump or excess:
        return place.from_source()
    return replace(place, env=keep_ros_variables(parse_env(dump)))


async def _answer(place: ProcessEnvironment, arena: ArenaSession, script: str) -> None:
    """Record what `rosrun` says to a script that is not as it should be, in the package as handed in."""
    file = Path(script).name
    spec = place.spec(f"rosrun {file}", ["rosrun", place.package, file], as_handed_in=True)
    await arena.run_to_end(spec, ROSRUN_S)


def _trace(place: ProcessEnvironment) -> tuple[Path | None, str]:
    """Return the trace that CMake left, as far as the package's files bear it out, since the build could write into it;
    and what of it was too much to be read, in words, or ""."""
    if place.sandbox.bubblewrap:
        data = read_member(place.archive, f"./{TRACE}", READ_MAX + 1)
    else:
        data = read_untrusted(Path(place.output) / TRACE, READ_MAX + 1)
    if data is None:
        return None, ""
    workspace = place.workspace
    source = workspace.built / "src" / workspace.folder
    written = written_calls(data[:READ_MAX], source, place.package_folder)
    too_large = f"CMake's trace is more than {READ_MAX >> 20} MB" if len(data) > READ_MAX else ""
    return _write_kept(place, f"{workspace.folder}-{TRACE}", written.trace), too_large or written.too_much


def _kept_file(place: ProcessEnvironment, name: str) -> Path | None:
    """Return the file that a step handed over under that name; without a sandbox, a copy of the file that it left."""
    kept = place.workspace.kept / name
    if place.sandbox.bubblewrap:
        return kept if kept.is_file() and kept.stat().st_size else None
    data = read_untrusted(Path(place.output) / name)
    return None if data is None else _write_kept(place, name, data)


def _write_kept(place: ProcessEnvironment, name: str, data: bytes) -> Path:
    path = place.workspace.kept / name
    path.write_bytes(data)
    return path
