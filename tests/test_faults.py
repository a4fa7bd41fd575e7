"""Faults of the machine, made for real: whatever they hit, no student loses a mark, and the next grading is whole.

Sources of what is expected: man 7 pid_namespaces, man 2 setrlimit, man 5 tmpfs.
"""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import pytest

from grader.model.result import GradingResult
from grader.model.verdict import Status
from tests.faulty import GRADER, VICTIM, below, command, grading, marked_down, result_in, why_not

pytestmark = [
    pytest.mark.ros,
    pytest.mark.skipif(bool(why_not()), reason=why_not()),
]
ALL = {"manifest", "build", "node", "rate", "hears"}
STATIC = {"GRADER_ROS_SETUP": "none"}
ARENA = r".+ -s -B .*/grader/arena/ros $"
BUBBLEWRAP = r"/usr/bin/bwrap --args"
TALKER = r"\S*python3? \S*src/talker\.py"
CATKIN_MAKE = r"\S*python3? \S*/catkin_make "
WRITER = """
import sys
from grader.cli.main import run
from grader.evidence.writer import EvidenceChannel
def message(*_): raise MemoryError
EvidenceChannel.message = message
sys.exit(run(sys.argv[1:]))
"""
CLOCK = """
import sys, time
real, begun = time.time, time.monotonic()
def turned_back(): return real() - (3600 if time.monotonic() - begun > 3 else 0)
time.time, time.time_ns = turned_back, lambda: int(turned_back() * 1e9)
from grader.cli.main import run
sys.exit(run(sys.argv[1:]))
"""


@pytest.fixture
def out(open_path: Path) -> Path:
    return open_path / "out"


@pytest.fixture
def own_locks(open_path: Path) -> dict[str, str]:
    """What a fault of the machine spoils is recorded again, alone: with these, no other test is waited for."""
    return {"XDG_RUNTIME_DIR": str(open_path)}


def passed(result: GradingResult) -> set[str]:
    return {c.id for c in result.criteria if c.status is Status.PASS}


def contents(folder: Path) -> dict[Path, bytes]:
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_a_disk_that_is_full_keeps_the_older_result(out: Path) -> None:
    with grading(out, **STATIC) as first:
        assert first.end() == 4, first.err
    before = contents(out)
    mount = f"mount -t tmpfs -o size=2m tmpfs {out} && cp -a {out}.kept/ada {out}"
    fill = f"{mount}; head -c 2m /dev/zero > {out}/full || true"
    shutil.copytree(out, f"{out}.kept")
    show = f"; code=$?; cp -a {out}/ada {out}.seen; exit $code"
    with grading(out, setup=fill, prefix=("sh", "-c", f'"$@"{show}', "sh"), **STATIC) as full:
        assert full.end() == 3, full.err
    assert full.said[0].startswith("grader: error: cannot write")
    assert "the disk is full" in full.said[0]
    assert full.said[-1].startswith("  note: the result of an earlier run stays as it is")
    seen = Path(f"{out}.seen")
    assert {path.relative_to(seen): data for path, data in contents(seen).items()} == {
        path.relative_to(out / "ada"): data for path, data in before.items()
    }


@pytest.mark.full
def test_temporary_files_without_room(out: Path, open_path: Path) -> None:
    tmp = open_path / "tmp"
    tmp.mkdir()
    mount = f"mount -t tmpfs -o size=64k,mode=1777 tmpfs {tmp}"
    archive = shutil.make_archive(str(open_path / "lab"), "zip", VICTIM)
    for source in (VICTIM, Path(archive)):
        with grading(out, setup=mount, source=source, TMPDIR=str(tmp)) as full:
            assert full.end() == 3, full.err
        assert "full" in full.said[0], full.said
        result = result_in(out)
        assert (result.status, result.error.kind) == ("error", "host")


def test_files_that_may_not_grow(out: Path) -> None:
    # Python would leave a compiled module half-written, and every later start would end at it
    with grading(out, prefix=("prlimit", "--fsize=5000"), PYTHONDONTWRITEBYTECODE="1", **STATIC) as limited:
        assert limited.end() == 3, limited.err
    assert "ulimit -f" in limited.said[0], limited.said
    assert not list(out.rglob("*.part"))


def test_limits_that_cannot_be_set(out: Path) -> None:
    """Without the capability, root may not raise a limit again either: as for any ordinary user."""
    prefix = ("prlimit", "--fsize=1000000", "setpriv", "--bounding-set=-sys_resource")
    with grading(out, prefix=prefix) as refused:
        assert refused.end() == 3, refused.err
    assert "ulimit -f (size of a file) is 977 kB" in refused.said[0]
    assert "prlimit --pid $$ --fsize=" in refused.said[1]
    assert result_in(out).error.kind == "host"


@pytest.mark.full
def test_too_little_memory_for_the_grader(out: Path) -> None:
    with grading(out, prefix=("prlimit", f"--as={165 << 20}")) as short:
        code = short.end()
    assert code in {0, 3, 4}, short.err
    results = list(out.rglob("result.json"))
    if results:
        result = result_in(out)
        assert marked_down(result) == []
        assert result.status != "error" or result.error.kind == "host", result.error
    else:
        assert code == 3


@pytest.mark.full
def test_a_recording_that_cannot_be_written_on(out: Path) -> None:
    """What goes wrong while a frame is taken must not be lost in the event loop: messages would be missing."""
    with grading(out, program=(sys.executable, "-c", WRITER)) as broken:
        assert broken.end() == 3, broken.err
    result = result_in(out)
    assert (result.status, result.error.kind) == ("error", "host")
    assert "Exception in callback" not in broken.err


def test_a_roscore_that_does_not_start(out: Path, open_path: Path, own_locks: dict[str, str]) -> None:
    (open_path / "broken.py").write_text("raise RuntimeError('rosmaster is broken here')\n")
    setup = f"mount --bind {open_path}/broken.py /usr/lib/python3/dist-packages/rosmaster/__init__.py"
    with grading(out, setup=setup, **own_locks) as broken:
        assert broken.end() == 4, broken.err
    result = result_in(out)
    assert marked_down(result) == []
    assert passed(result) == {"manifest", "build"}
    assert "rosmaster is broken here" in next(c.message for c in result.criteria if c.id == "rate")


@pytest.mark.full
def test_a_sandbox_that_is_not_made(out: Path, open_path: Path, own_locks: dict[str, str]) -> None:
    """As where the kernel has no more namespaces to give: no process of the student's has run."""
    (open_path / "real").touch()
    (open_path / "bwrap").write_text(
        f"""#!/bin/sh
for file in /proc/$$/fd/*; do
  case "$(readlink $file)" in /memfd:words*)
    if tr '\\0' ' ' <$file | grep -q src/talker.py; then
      echo "bwrap: Creating new namespace failed: No space left on device" >&2; exit 1
    fi;;
  esac
done
exec {open_path}/real "$@"
"""
    )
    (open_path / "bwrap").chmod(0o755)
    setup = f"mount --bind /usr/bin/bwrap {open_path}/real; mount --bind {open_path}/bwrap /usr/bin/bwrap"
    with grading(out, setup=setup, **own_locks) as short:
        assert short.end() == 4, short.err
    result = result_in(out)
    assert marked_down(result) == []
    assert passed(result) == {"manifest", "build", "hears"}
    assert "could not be started" in next(c.message for c in result.criteria if c.id == "rate")


@pytest.mark.full
def test_what_is_killed_once_is_done_once_more(out: Path) -> None:
    with grading(out) as hit:
        hit.await_line("build", "running")
        hit.kill(CATKIN_MAKE)
        hit.await_line("talker", "running")
        hit.kill(ARENA, copy=True)
        hit.kill_around(TALKER, BUBBLEWRAP)
        assert hit.end() == 0, hit.err
    assert "once more: catkin_make was killed" in hit.err
    assert passed(result_in(out)) == ALL


def test_the_template_of_the_arenas_is_killed(out: Path) -> None:
    """What runs already runs on; what comes later has a new one."""
    with grading(out) as hit:
        hit.await_line("build", "running")
        hit.kill(ARENA)
        hit.await_line("talker", "running")
        hit.kill(ARENA)
        assert hit.end() == 0, hit.err
    assert passed(result_in(out)) == ALL


def test_a_recorder_that_is_killed_each_time(out: Path, own_locks: dict[str, str]) -> None:
    with grading(out, **own_locks) as hit:
        hit.await_line("build", "done")
        while hit.process.poll() is None:
            for pid in below(hit.process.pid):
                with suppress(ProcessLookupError):  # it may end by itself between the look and the signal
                    if re.match(ARENA, command(pid)):
                        os.kill(pid, signal.SIGKILL)
        code = hit.end()
    assert code == 4, hit.err
    result = result_in(out)
    assert marked_down(result) == []
    assert passed(result) == {"manifest", "build"}
    assert "failed on the grading machine" in next(c.message for c in result.criteria if c.id == "rate")


@pytest.mark.full
def test_a_clock_that_is_set_back(out: Path) -> None:
    with grading(out, program=(sys.executable, "-c", CLOCK)) as turned:
        code = turned.end()
    assert marked_down(result_in(out)) == []
    assert code == 0, turned.err


def test_an_output_folder_that_goes_away(out: Path) -> None:
    with grading(out) as robbed:
        robbed.await_line("build", "done")
        shutil.rmtree(out)
        assert robbed.end() == 3, robbed.err
    assert robbed.said[0].startswith("grader: error: cannot write"), robbed.said
    result = result_in(out)
    assert (result.status, result.error.kind, marked_down(result)) == ("error", "output", [])


@pytest.mark.full
def test_a_grader_that_is_held_up_and_a_second_one(out: Path) -> None:
    with grading(out) as held:
        held.await_line("talker", "running")
        pid = held.await_process(GRADER)
        os.kill(pid, signal.SIGSTOP)
        begun = time.monotonic()
        with grading(out, **STATIC) as second:
            assert second.end() == 3, second.err
        with suppress(subprocess.TimeoutExpired):
            held.process.wait(max(0.0, 5 - (time.monotonic() - begun)))
        os.kill(pid, signal.SIGCONT)
        code = held.end()
    assert second.said[0] == f"grader: error: another grader works on {out}/ada just now"
    assert marked_down(result_in(out)) == []
    assert code in {0, 4}, held.err
