"""The same rate check on a machine that has more and more else to do, beside `rostest` with `hztest`."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from benchmarks.busy import busy_loops
from benchmarks.figures import Found, Options, mid, table
from benchmarks.gradings import DATA, folder_for, graded
from benchmarks.ros import hztest, hztest_workspace
from grader.classes.batch.job import FolderJob
from grader.model.verdict import Status

COUNT, LOOPS = 5, (0, 4, 8, 16)
PACKAGE = DATA / "pulse" / "rate"
CRITERION = "rate"


class Tried(NamedTuple):
    """One run of the check on a correct publisher of 10 Hz."""

    outcome: str
    wall_s: float
    again: int = 0
    message: str = ""


def measure(options: Options) -> Found:
    count, loops = options.count or COUNT, options.loops or LOOPS
    rows, faults, remarks = [], [], []
    with folder_for("load", options) as folder:
        workspace = hztest_workspace(folder, PACKAGE / "pulse", "pulse.py")
        for number in loops:
            ours: list[Tried] = []
            theirs: list[Tried] = []
            with busy_loops(number):
                for turn in range(count):
                    ours.append(_grade(folder / f"{number}-{turn}"))
                    theirs.append(_rostest(workspace))
            rows += [_row(number, "the grader", ours), _row(number, "`rostest` with `hztest`", theirs)]
            faults += [f"{number} loops: {one.message}" for one in ours if one.outcome == "failed"]
            remarks += [
                f"- {number} loops, inconclusive: {one.message}"
                for one in ours
                if one.outcome == "inconclusive"
            ]
    header = ["busy loops", "checked by", "passed", "inconclusive", "failed", "runs made again", "wall, s"]
    return Found(
        runs=f"{count} runs of each in turn under each load",
        tables=(table(header, rows),),
        faults=tuple(faults),
        remarks=tuple(remarks),
    )


def _grade(out: Path) -> Tried:
    """With the build, and with what was run again."""
    job = FolderJob(name="pulse", source=PACKAGE, rubric=DATA / "pulse.yaml", out=out)
    (grading,) = graded([job], 1)
    found = next(criterion for criterion in grading.result.criteria if criterion.id == CRITERION)
    outcomes = {Status.PASS: "passed", Status.INCONCLUSIVE: "inconclusive"}
    return Tried(
        outcomes.get(found.status, "failed"), grading.result.timing.wall_s, grading.again, found.message
    )


def _rostest(workspace: Path) -> Tried:
    cost = hztest(workspace)
    return Tried("failed" if cost.code else "passed", cost.wall_s)


def _row(loops: int, by: str, tried: list[Tried]) -> list[str]:
    counts = [
        sum(one.outcome == outcome for one in tried) for outcome in ("passed", "inconclusive", "failed")
    ]
    again = str(sum(one.again for one in tried))
    return [str(loops), by, *(str(count) for count in counts), again, mid([one.wall_s for one in tried], 1)]
