"""This grader beside the one of another commit: what a grading of the Leeds lab costs, in turn, on the same machine."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from benchmarks.figures import Found, NotMeasured, Options, Row, spread
from benchmarks.gradings import LAB, LAB_POINTS, ROOT, SOLUTION
from benchmarks.machine import Cost, timed
from grader.model.result import GradingResult

TIMES = 7
COMMIT = "HEAD~1"
GIT = ("git", "-C", str(ROOT))


def measure(options: Options) -> Found:
    times, commit = options.times or TIMES, options.against or COMMIT
    with tempfile.TemporaryDirectory() as name, _checkout(commit, Path(name) / "other") as other:
        folder = Path(name)
        for grader in (ROOT, other):  # what later gradings share is made now
            _grade(grader, folder / "first")
        pairs = [(_grade(ROOT, folder / "ours"), _grade(other, folder / "theirs")) for _ in range(times)]
    short = subprocess.run([*GIT, "rev-parse", "--short", commit], capture_output=True, text=True, check=True)
    return Found(
        runs=f"{times} runs of each in turn, against {short.stdout.strip()}", tables=(_table(pairs),)
    )


@contextmanager
def _checkout(commit: str, folder: Path) -> Iterator[Path]:
    try:
        subprocess.run([*GIT, "worktree", "add", "--quiet", "--detach", str(folder), commit], check=True)
    except subprocess.CalledProcessError as error:
        raise NotMeasured(f"there is no {commit} here: {error}") from error
    try:
        yield folder
    finally:
        subprocess.run([*GIT, "worktree", "remove", "--force", str(folder)], check=True)


def _grade(grader: Path, out: Path) -> Cost:
    """By the grader in that folder: Python looks first where it is started."""
    argv = [sys.executable, "-m", "grader", "grade", str(SOLUTION), "--rubric", LAB, "--out", str(out)]
    cost = timed(argv, cwd=grader)
    result = GradingResult.model_validate_json((out / LAB / "result.json").read_text())
    if result.points != LAB_POINTS:
        raise NotMeasured(f"the reference solution got {result.points:g} points from {grader}")
    return cost


def _table(pairs: list[tuple[Cost, Cost]]) -> str:
    return spread(
        [
            Row("this one, wall", "s", [ours.wall_s for ours, _ in pairs]),
            Row("the other, wall", "s", [theirs.wall_s for _, theirs in pairs]),
            Row("wall, this one / the other", "", [a.wall_s / b.wall_s for a, b in pairs], digits=3),
            Row("this one, CPU", "s", [ours.cpu_s for ours, _ in pairs]),
            Row("the other, CPU", "s", [theirs.cpu_s for _, theirs in pairs]),
            Row("CPU, this one / the other", "", [a.cpu_s / b.cpu_s for a, b in pairs], digits=3),
        ]
    )
