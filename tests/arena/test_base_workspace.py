"""The base workspace: learnt once, kept where nobody else can write, and without a trace in what a build gives."""

from __future__ import annotations

import asyncio
import json
import os
import subprocess
import tarfile
from pathlib import Path

import pytest

from grader.arena import base_workspace, build
from grader.arena.base_workspace import FILES_MAX, base_spec, has_base, keep, provide_base, read_kept
from grader.arena.process_environment import ProcessEnvironment
from grader.arena.sandbox_files import ANSWERS, QUESTIONS
from grader.evidence.reader import load_run
from grader.evidence.run import Run
from grader.evidence.writer import EvidenceWriter
from tests.arena.support import CMAKE, SCRIPT, make_place

BROKEN_CMAKE = CMAKE.replace("catkin REQUIRED", "catkin REQUIRED COMPONENTS no_such_package")


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path / "cache" / "grader"


@pytest.fixture(scope="module")
def warm_cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("warm")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(folder))
        provide_base("auto")
    return folder


def test_what_is_kept_is_read_again(cache: Path) -> None:
    keep("one", b"something")
    assert read_kept("one") == b"something"
    assert read_kept("two") is None
    assert cache.stat().st_mode & 0o777 == 0o700


@pytest.mark.parametrize("damage", [b"", b"short", b"\0" * 100])
def test_what_is_damaged_counts_as_missing(cache: Path, damage: bytes) -> None:
    keep("one", b"something")
    (cache / "one").write_bytes(damage)
    assert read_kept("one") is None
    keep("one", b"anew")
    assert read_kept("one") == b"anew"


def test_what_others_may_have_written_counts_as_missing(cache: Path) -> None:
    keep("one", b"something")
    (cache / "one").chmod(0o666)
    assert read_kept("one") is None
    (cache / "one").chmod(0o600)
    cache.chmod(0o770)
    assert read_kept("one") is None
    cache.chmod(0o700)
    assert read_kept("one") == b"something"
    (cache / "two").symlink_to("one")
    assert read_kept("two") is None


@pytest.mark.skipif(os.geteuid() != 0, reason="gives a file to somebody else")
def test_a_folder_of_somebody_elses_is_left_alone(cache: Path) -> None:
    keep("one", b"something")
    os.chown(cache, 65534, 65534)
    assert read_kept("one") is None
    keep("two", b"more")
    assert sorted(path.name for path in cache.iterdir()) == ["one"]


def test_a_cache_that_cannot_be_made_is_gone_without(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("no folder")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    keep("one", b"something")
    assert read_kept("one") is None


def test_old_ones_do_not_pile_up(cache: Path) -> None:
    for number in range(FILES_MAX + 3):
        keep(str(number), b"something")
    assert len(list(cache.iterdir())) == FILES_MAX
    assert read_kept(str(FILES_MAX + 2)) == b"something"


def _build(place: ProcessEnvironment, tmp_path: Path) -> tuple[bool, Run, dict[str, bytes | None], bytes]:
    """Whether it worked, what was seen, the files of `devel`, and CMake's trace."""
    path = tmp_path / "package.mcap"

    async def work() -> build.BuildOutcome:
        with EvidenceWriter(path, scenario="package", clock="real", warp=1.0, metadata={}) as writer:
            return (await build.build(place, writer, [], ()))[1]

    outcome = asyncio.run(work())
    files: dict[str, bytes | None] = {}
    with tarfile.open(place.archive) as tar:
        for member in tar:
            content = tar.extractfile(member) if member.isreg() else None
            files[f"{member.name} {member.mode:o}"] = content and content.read()
    trace = b"" if outcome.trace is None else outcome.trace.read_bytes()
    return outcome.ok, load_run(path), {k: v for k, v in files.items() if k.startswith("devel/")}, trace


def _said(run: Run) -> list[str]:
    """From where catkin is loaded: all that concerns the package comes after it."""
    lines = [line.line for _, line in run.console if line.process == "catkin_make"]
    return lines[next(n for n, line in enumerate(lines) if line.startswith("-- catkin ")) :]


def _calls(trace: bytes) -> list[dict[str, object]]:
    return [
        {key: value for key, value in json.loads(line).items() if key != "time"}
        for line in trace.splitlines()
    ]


@pytest.mark.full
@pytest.mark.ros
@pytest.mark.parametrize("cmake", [CMAKE, BROKEN_CMAKE])
def test_a_build_on_the_base_is_the_one_without_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, cmake: str, warm_cache: Path
) -> None:
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0})
    made = []
    for kept in (tmp_path, warm_cache):
        monkeypatch.setenv("XDG_CACHE_HOME", str(kept))
        with make_place({"src/node.py": SCRIPT, "CMakeLists.txt": cmake}) as place:
            assert has_base(place) is (kept == warm_cache)
            made.append(_build(place, tmp_path))
    (cold_ok, cold, cold_files, cold_trace), (warm_ok, warm, warm_files, warm_trace) = made
    assert cold_ok is warm_ok is (cmake == CMAKE)
    assert warm_files == cold_files
    assert len(_calls(cold_trace)) > 1
    assert _calls(warm_trace) == _calls(cold_trace)
    assert _said(warm) == _said(cold)


@pytest.mark.ros
def test_a_first_build_makes_it_beside(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0, 1})
    monkeypatch.setattr(base_workspace, "BASE_SCRIPT", "echo learnt >&{collect}")
    with make_place({"src/node.py": SCRIPT}) as place:
        ok, run, _, _ = _build(place, tmp_path)
        assert ok
        assert base_workspace.NAME in {event.name for _, event in run.processes}
        assert place.base.read_bytes() == b"learnt\n"
    with make_place({"src/another.py": SCRIPT}) as another:
        assert has_base(another)


@pytest.mark.ros
def test_what_is_known_is_what_the_real_programs_say(
    warm_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(warm_cache))
    with make_place({}) as place:
        assert has_base(place)
        for question in QUESTIONS:
            known = place.folder / "bin" / ANSWERS / question
            environment = {"PATH": place.ros.env["PATH"], **place.ros.env}
            asked = subprocess.run(
                question.split(), env=environment, capture_output=True, text=True, check=False
            )
            assert (known.read_text() if known.exists() else "") == asked.stdout, question
            shim = subprocess.run(
                [place.folder / "bin" / question.split()[0], *question.split()[1:]],
                env=environment,
                capture_output=True,
                text=True,
                check=False,
            )
            assert (shim.returncode, shim.stdout) == (asked.returncode, asked.stdout), question


@pytest.mark.ros
@pytest.mark.parametrize(
    ("names", "asked"),
    [
        ((), False),
        (("<name>lab</name>",), False),
        (("  <name>lab1</name>\r", "<name>my-robot_2</name>"), False),
        (("<name>catkin</name>",), True),
        (("<name>lab</name>", "<name>\ncatkin\n</name>"), True),
        (("<!-- <name>lab</name> --><name>&#99;atkin</name>",), True),
    ],
)
def test_catkin_in_the_workspace_is_left_to_the_real_program(
    tmp_path: Path, names: tuple[str, ...], asked: bool
) -> None:
    with make_place({}) as place:
        real = tmp_path / "real"
        real.mkdir()
        (real / "catkin_find_pkg").write_text("#!/bin/sh\necho real\n")
        (real / "catkin_find_pkg").chmod(0o755)
        for number, name in enumerate(names):
            (tmp_path / "src" / str(number)).mkdir(parents=True)
            (tmp_path / "src" / str(number) / "package.xml").write_text(f"<package>\n{name}\n</package>\n")
        (tmp_path / "src").mkdir(exist_ok=True)
        done = subprocess.run(
            [place.folder / "bin" / "catkin_find_pkg", "catkin", tmp_path / "src"],
            env={"PATH": f"{place.folder / 'bin'}:{real}:/usr/bin:/bin"},
            capture_output=True,
            text=True,
            check=False,
        )
    assert (done.returncode, done.stdout) == ((0, "real\n") if asked else (2, ""))


@pytest.mark.ros
def test_the_base_is_of_this_machine_as_it_is(
    tmp_path: Path, warm_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(warm_cache))
    with make_place({}) as place:
        assert has_base(place)
        spec = base_spec(place)
        assert str(place.workspace.repaired) not in spec["argv"]
        assert spec["collect"]["file"] == str(place.base)
        monkeypatch.setattr(base_workspace, "SYSTEM", (*base_workspace.SYSTEM, str(tmp_path)))
        assert not has_base(place)


@pytest.mark.full
@pytest.mark.ros
@pytest.mark.parametrize("arguments", [["--help"], [], ["no_such_package", "lab.launch"]])
def test_roslaunch_is_the_real_one(arguments: list[str], tmp_path: Path) -> None:
    with make_place({}) as place:
        real, shim = place.ros.program("roslaunch"), place.folder / "bin" / "roslaunch"
        assert shim.is_file()
        environment = {
            "PATH": f"{place.folder / 'bin'}:{place.ros.env['PATH']}",
            "HOME": str(tmp_path),
            **{name: value for name, value in place.ros.env.items() if name != "PATH"},
        }
        done = [
            subprocess.run([program, *arguments], env=environment, capture_output=True, check=False)
            for program in (str(real), str(shim))
        ]
    assert (done[1].returncode, done[1].stdout, done[1].stderr) == (
        done[0].returncode,
        done[0].stdout,
        done[0].stderr,
    )
