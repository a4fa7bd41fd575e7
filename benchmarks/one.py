"""One submission, the whole Leeds lab, beside `rostest` with `hztest`; and when a student sees the first verdicts."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

from benchmarks.figures import Found, NotMeasured, Options, Row, spread
from benchmarks.gradings import LAB, LAB_POINTS, SOLUTION, build_cpu_s, folder_for
from benchmarks.machine import Cost, Meter, timed
from benchmarks.ros import hztest, hztest_workspace
from grader.evidence.reader import load_evidence
from grader.model.result import GradingResult

TIMES = 5
GRADER = (sys.executable, "-m", "grader")
FIRST, LAST = " pass: manifest", " criteria passed"
"""What stands in the line of the first verdict, and in that of the result."""


class Grading(NamedTuple):
    """Wall and CPU seconds, and bytes of memory."""

    wall_s: float
    own_cpu_s: float
    student_cpu_s: float
    build_cpu_s: float
    arena_bytes: int

    @property
    def ratio(self) -> float:
        return self.own_cpu_s / (self.student_cpu_s + self.build_cpu_s)


class Turn(NamedTuple):
    """Everything once: `first_s` is when `grader check` shows its first verdict."""

    grading: Grading
    rostest: Cost
    judging: Cost
    first_s: float


def measure(options: Options) -> Found:
    times = options.times or TIMES
    with folder_for("one", options) as folder:
        workspace = hztest_workspace(folder, SOLUTION / "lab1", "numeric_talker.py")
        _grade(folder / "first")  # what later gradings share is made now
        turns = [_turn(folder / str(number), workspace) for number in range(times)]
    return Found(runs=f"{times} runs of each in turn", tables=(_table(turns),))


def _turn(out: Path, workspace: Path) -> Turn:
    grading, tested = _grade(out), hztest(workspace)
    if tested.code != 0:
        raise NotMeasured("rostest failed the reference solution")
    evidence = str(out / LAB / "evidence")
    judging = timed([*GRADER, "judge", evidence, "--rubric", LAB, "--out", os.devnull])
    return Turn(grading, tested, judging, _first_verdict_s(out / "check"))


def _grade(out: Path) -> Grading:
    cost = timed([*GRADER, "grade", str(SOLUTION), "--rubric", LAB, "--out", str(out)])
    result = GradingResult.model_validate_json((out / LAB / "result.json").read_text())
    if result.points != LAB_POINTS:
        raise NotMeasured(f"the reference solution got {result.points:g} points")
    evidence = out / LAB / "evidence"
    build_s = build_cpu_s(evidence)
    return Grading(
        wall_s=cost.wall_s,
        own_cpu_s=cost.cpu_s - result.timing.student_cpu_s,
        student_cpu_s=result.timing.student_cpu_s - build_s,
        build_cpu_s=build_s,
        arena_bytes=largest_arena_bytes(evidence),
    )


def largest_arena_bytes(evidence: Path) -> int:
    events = [event for run in load_evidence([evidence]).values() for _, event in run.processes]
    return max(event.max_rss_bytes or 0 for event in events if event.name == "arena")


def _first_verdict_s(out: Path) -> float:
    """From the start of `grader check` until it has shown a verdict."""
    argv, meter = [*GRADER, "check", str(SOLUTION / "lab1"), "--rubric", LAB, "--out", str(out)], Meter()
    with subprocess.Popen(argv, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as process:
        lines = iter(process.stdout or ())
        first_s = next((meter.wall_s() for line in lines if FIRST in line), None)
        passed = LAST in "".join(lines)
    if first_s is None or not passed or process.returncode != 0:
        raise NotMeasured(f"grader check ended with {process.returncode}, and not as it should")
    return first_s


def _table(turns: list[Turn]) -> str:
    gradings = [turn.grading for turn in turns]
    judged, tested = [turn.judging for turn in turns], [turn.rostest for turn in turns]
    walls = [turn.grading.wall_s / turn.rostest.wall_s for turn in turns]
    return spread(
        [
            Row("whole lab, wall", "s", [g.wall_s for g in gradings], "at most 9"),
            Row("whole lab, the grader's own CPU", "s", [g.own_cpu_s for g in gradings]),
            Row("whole lab, CPU of the student's processes", "s", [g.student_cpu_s for g in gradings]),
            Row("whole lab, CPU of the build", "s", [g.build_cpu_s for g in gradings]),
            Row(
                "the grader's own CPU / student's processes and build",
                "",
                [g.ratio for g in gradings],
                "at most 0.45",
            ),
            Row("memory of the largest arena", "MB", [g.arena_bytes / 1e6 for g in gradings]),
            Row("first verdict of `grader check`, wall", "s", [t.first_s for t in turns], "at most 1"),
            Row("judging the evidence again, wall", "s", [j.wall_s for j in judged]),
            Row("judging the evidence again, CPU", "s", [j.cpu_s for j in judged]),
            Row("`rostest` with `hztest`, one rate check, wall", "s", [t.wall_s for t in tested]),
            Row("`rostest` with `hztest`, one rate check, CPU", "s", [t.cpu_s for t in tested]),
            Row("wall of the whole lab / wall of one `rostest`", "", walls),
        ]
    )
