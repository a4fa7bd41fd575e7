"""Nothing of a submission reaches the programs that stand outside its sandbox; what counts of its environment."""

from __future__ import annotations

import asyncio
import json
import os
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from grader.arena.build import build
from grader.arena.process_environment import ProcessEnvironment
from grader.evidence.reader import load_run
from grader.evidence.run import Run
from grader.evidence.writer import EvidenceWriter
from grader.host_programs import HOST_PATH
from grader.ros_env import (
    DUMP_BYTES,
    NAMES_MAX,
    ROS_VARIABLES,
    VALUE_BYTES,
    excess_of,
    find_ros,
    keep_ros_variables,
    parse_env,
)
from tests.arena.support import CMAKE, SCRIPT, make_place, needs_sandbox, printed, run_script

CANARY = "CANARY"
HOOK = "catkin_add_env_hooks(50.lab SHELLS sh DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR}/hooks)\n"


def test_only_names_of_the_list_are_kept() -> None:
    dump = b"LD_PRELOAD=/evil.so\0LD_LIBRARY_PATHS=x\0LD_LIBRARY_PATH=/lib\0ROS_EVIL=1\0ROS_DISTRO=noetic\0PATH=/x\0"
    found = keep_ros_variables(parse_env(dump))
    assert found == {"LD_LIBRARY_PATH": "/lib", "ROS_DISTRO": "noetic", "PATH": "/x"}
    assert not {"LD_PRELOAD", "BASH_ENV", "PYTHONSTARTUP", "GCONV_PATH", "ROS_MASTER_URI"} & ROS_VARIABLES


@pytest.mark.parametrize(
    ("dump", "words"),
    [
        (b"A=1\0" * NAMES_MAX, ""),
        (b"A=1\0" * (NAMES_MAX + 1), "variables"),
        (b"A=" + b"x" * (VALUE_BYTES - 2) + b"\0", ""),
        (b"LONG=" + b"x" * VALUE_BYTES + b"\0", "LONG"),
        (b"LONG" * 10000, "8 kB"),
        (b"x" * (DUMP_BYTES + 1), "64 kB"),
        (b"", ""),
    ],
)
def test_bounds(dump: bytes, words: str) -> None:
    found = excess_of(dump)
    assert bool(found) == bool(words)
    assert words in found
    assert len(found) < 150


def built_with(hook: str, tmp_path: Path) -> tuple[dict[str, str], Run, bool]:
    """What a node's environment is after that hook, and the build's evidence."""
    files = {"CMakeLists.txt": CMAKE + HOOK, "hooks/50.lab.sh": hook, "src/node.py": SCRIPT}
    with make_place(files) as place:
        path = tmp_path / "package.mcap"
        with EvidenceWriter(path, scenario="package", clock="real", warp=1.0, metadata={}) as writer:
            built, outcome = asyncio.run(build(place, writer, [], []))
        return built.spec("node", ["true"])["env"], load_run(path), outcome.ok


@pytest.mark.ros
@needs_sandbox
@pytest.mark.parametrize(
    ("hook", "words"),
    [
        (
            "[ ! -e /run/grader/built.tar ] || export BIG=$(head -c 180000 /dev/zero | tr '\\0' x)\n",
            "build left is more than 64 kB",
        ),
        ("for n in $(seq 300); do export V$n=1; done\n", "variables, of which 200 are allowed"),
        ("export LONG=$(head -c 9000 /dev/zero | tr '\\0' x)\n", "a variable of more than 8 kB (LONG)"),
    ],
)
def test_an_environment_that_is_too_large_is_the_submissions(hook: str, words: str, tmp_path: Path) -> None:
    env, run, ok = built_with(hook + "export ROS_ETC_DIR=/mine\n", tmp_path)
    found = [
        event.detail for _, event in run.actors if event.action == "limit" and event.actor == "setup.bash"
    ]
    assert ok
    assert len(found) == 1
    assert words in found[0]
    assert "ROS_ETC_DIR" not in env
    assert run.outcome is not None
    assert run.outcome.outcome == "complete"


@pytest.mark.ros
@needs_sandbox
def test_an_environment_within_bounds_is_a_nodes(tmp_path: Path) -> None:
    env, run, ok = built_with(
        "export ROS_ETC_DIR=/mine LD_LIBRARY_PATH=/evil LD_AUDIT=/evil BASH_ENV=/x\n", tmp_path
    )
    assert ok
    assert [event for _, event in run.actors if event.action == "limit"] == []
    assert (env["ROS_ETC_DIR"], env["LD_LIBRARY_PATH"]) == ("/mine", "/evil")
    assert not {"LD_AUDIT", "BASH_ENV"} & env.keys()


def everything_of(place: ProcessEnvironment) -> Iterator[dict[str, Any]]:
    """How processes of each kind are started, with the canary in all that a submission says."""
    argv = ["rosrun", f"{CANARY}-package", f"{CANARY}; --bind / /"]
    yield place.spec("node", argv)
    yield place.spec("node", argv, as_handed_in=True)
    yield place.spec("build", argv, role="build", build=True, collect="built.tar")
    yield place.spec("grader's", argv, role="grader", copy=False)


@contextmanager
def recorded_start(monkeypatch: pytest.MonkeyPatch, folder: Path) -> Iterator[list[dict[str, Any]]]:
    """`launch` with nothing started: what would have been."""
    import grader.arena.ros as here  # noqa: PLC0415 - only its place

    monkeypatch.syspath_prepend(str(Path(here.__path__[0])))
    import launching  # type: ignore[import-not-found]  # noqa: PLC0415 - on ROS's side modules lie side by side

    started: list[dict[str, Any]] = []

    class Started:
        pid = 4711
        stdout = stderr = None

        def __init__(self, argv: list[str], **more: Any) -> None:
            started.append({"argv": argv, **more})

    class Stage:
        def __init__(self) -> None:
            self.folder = str(folder)

        def copy(self, path: str) -> str:
            assert CANARY not in path
            return "7"

        def scratch(self, *_: int) -> str:
            return "8"

        def give_up(self, _: str) -> None:
            return

    writes: list[bytes] = []
    write = os.write

    def noted(number: int, data: bytes) -> int:
        if str(Path(f"/proc/self/fd/{number}").readlink()).startswith("pipe:"):
            writes.append(data)
        return write(number, data)

    monkeypatch.setattr(launching.os, "write", noted)
    monkeypatch.setattr(launching.subprocess, "Popen", Started)
    monkeypatch.setattr(launching, "STAGE_OF_TEST", Stage, raising=False)
    yield started
    for start in started:
        start["pipes"] = list(writes)


@pytest.mark.ros
@pytest.mark.parametrize("sandbox", ["auto", "none"])
def test_nothing_of_a_submission_reaches_a_program_outside(
    sandbox: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with make_place({"src/node.py": SCRIPT}, sandbox=sandbox) as place:
        hostile = ProcessEnvironment(
            **{**vars(place), "package": CANARY, "env": dict.fromkeys(ROS_VARIABLES, CANARY)}
        )
        specs = [json.loads(json.dumps(spec)) for spec in everything_of(hostile)]
    with recorded_start(monkeypatch, tmp_path) as started:
        import launching  # noqa: PLC0415 - as above

        for spec in specs:
            assert CANARY in spec["env"]["LD_LIBRARY_PATH"]
            launched = launching.launch(spec, launching.STAGE_OF_TEST(), None)
            launched.lifeline.close()
            for number in filter(None, (launched.info, launched.collect)):
                os.close(number)
    assert len(started) == len(specs)
    for start in started:
        assert CANARY not in json.dumps(start["argv"])
        assert start["env"] == launching.HOST_ENV
        assert start["cwd"] in {str(tmp_path), "/"}
        assert start["stdin"] == subprocess.DEVNULL
        assert start["argv"][0].startswith("/")
        assert not any(CANARY.encode() in data for data in start["pipes"])


def test_the_arenas_constant_environment_is_the_graders(monkeypatch: pytest.MonkeyPatch) -> None:
    with recorded_start(monkeypatch, Path("/")):
        import launching  # noqa: PLC0415 - as above

        assert set(launching.HOST_ENV["PATH"].split(":")) <= set(HOST_PATH.split(":"))
        assert launching.HOST_ENV.keys() == {"PATH", "LANG"}


PATHS = """
import os, re
for path in ("/proc/self/mountinfo", "/proc/1/cmdline", "/proc/self/cgroup", "/proc/1/environ", "/proc/1/mounts"):
    try:
        print(path, open(path).read().replace("\\0", " ").replace("\\n", " | "))
    except OSError as error:
        print(path, error)
for process in filter(str.isdigit, os.listdir("/proc")):
    for kind in ("cwd", "exe", "root"):
        try:
            print(process, kind, os.readlink("/proc/%s/%s" % (process, kind)))
        except OSError:
            pass
"""


@pytest.mark.ros
@needs_sandbox
def test_no_path_of_the_machine_is_seen(tmp_path: Path) -> None:
    text = "\n".join(printed(run_script(tmp_path, PATHS, limit_s=10)))
    assert "/home/student" in text
    assert "/proc/1/cmdline /usr/bin/bwrap --args" in text
    for word in ("grader-", str(tmp_path), "place", "pytest", os.environ.get("TMPDIR") or "/run/src"):
        assert word not in text, word


def test_a_workspace_shows_what_it_lies_over(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """`GRADER_ROS_SETUP` may name a course's `devel/setup.bash`, sourced over ROS's own."""
    ros, workspace = tmp_path / "ros" / "noetic", tmp_path / "course"
    for folder in (ros / "share", workspace / "devel", workspace / "src"):
        folder.mkdir(parents=True)
    setup = workspace / "devel" / "setup.bash"
    setup.write_text(
        f"export CMAKE_PREFIX_PATH={workspace}/devel:{ros}:/usr:/not/there:here\n"
        f"export ROS_PACKAGE_PATH={workspace}/src:{ros}/share:/usr/share\n"
    )
    monkeypatch.setenv("GRADER_ROS_SETUP", str(setup))
    found = find_ros()
    assert found is not None
    assert found.prefixes == tuple(map(str, (workspace / "devel", ros, workspace / "src")))
