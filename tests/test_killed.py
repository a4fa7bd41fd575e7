"""`kill -9` of the grader at random moments of a run, each in one of several PID namespaces side by side."""

from __future__ import annotations

import json
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.faulty import GRADER, ROOM, ROOT, grading, result_in, why_not
from tests.support.processes import lives, until

pytestmark = [
    pytest.mark.ros,
    pytest.mark.skipif(bool(why_not()), reason=why_not()),
]
KILLS, SIDE_BY_SIDE = 12, 4


@pytest.mark.full
def test_killed_at_random_moments(open_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    seed = random.SystemRandom().randrange(1 << 30)
    begun = time.monotonic()
    with grading(open_path / "measured") as one:
        assert one.end() == 0, one.err
    length_s = time.monotonic() - begun
    assert result_in(open_path / "measured").points == 100
    chance = random.Random(seed)  # noqa: S311 - moments, no secrets
    moments_s = [length_s * (n + chance.random()) / KILLS for n in range(KILLS)]
    lanes = [lane(open_path / str(n), moments_s[n::SIDE_BY_SIDE]) for n in range(SIDE_BY_SIDE)]
    wrong = [what for process in lanes for what in finished(process)]
    with capsys.disabled():
        shown = " ".join(f"{moment_s:.2f}" for moment_s in moments_s)
        print(f"\nseed {seed}: a run takes {length_s:.2f} s, killed after {shown} s")
    assert wrong == [], f"seed {seed}"


def test_git_ends_with_the_grader(open_path: Path) -> None:
    (open_path / "bin").mkdir()
    git = open_path / "bin" / "git"
    git.write_text('#!/bin/sh\ncase "$*" in *ls-remote*) exec sleep 3600;; esac\n')
    git.chmod(0o755)
    env = {"PATH": f"{open_path}/bin:{os.environ['PATH']}", "TMPDIR": str(open_path)}
    alive = ("sh", "-c", '"$@"; echo and then >&2; exec sleep 30', "sh")
    with grading(open_path / "out", source="https://example.invalid/lab.git", prefix=alive, **env) as one:
        asking = one.await_process("sleep 3600")
        os.kill(one.await_process(GRADER), signal.SIGKILL)
        one.await_line("and then")
        until(lambda: not lives(asking))
    assert not (open_path / "out").exists()


def lane(folder: Path, moments_s: list[float]) -> subprocess.Popen[bytes]:
    argv = [*ROOM, sys.executable, "-m", "tests.killing", folder, *moments_s]
    return subprocess.Popen(list(map(str, argv)), cwd=ROOT, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE)


def finished(process: subprocess.Popen[bytes]) -> list[str]:
    try:
        out, _ = process.communicate()
    finally:
        process.kill()
        process.wait()
    assert process.returncode == 0
    wrong: list[str] = json.loads(out)
    return wrong
