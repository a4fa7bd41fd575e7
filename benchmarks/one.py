"""One submission, the whole Leeds lab, beside `rostest` with `hztest`."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import NamedTuple

from benchmarks.figures import Found, NotMeasured, Options, Row, spread
from benchmarks.gradings import LAB, LAB_POINTS, SOLUTION, build_cpu_s, folder_for
from benchmarks.machine import Cost, timed
from benchmarks.ros import hztest, hztest_workspace
from grader.evidence.reader import load_evidence
from grader.model.result import GradingResult

TIMES = 5
GRADER = (sys.executable, "-m", "grader")


class One(NamedTuple):
    """A grading: wall and CPU seconds, bytes of memory."""

    wall_s: float
    own_cpu_s: float
    student_cpu_s: float
    build_cpu_s: float
    arena_bytes: int

    @property
    def ratio(self) -> float:
        return self.own_cpu_s / (self.student_cpu_s + self.build_cpu_s)


def measure(options: Options) -> Found:
    times = options.times or TIMES
    graded: list[One] = []
    tested: list[Cost] = []
    judged: list[Cost] = []
    with folder_for("one", options) as folder:
        workspace = hztest_workspace(folder, SOLUTION / "lab1", "numeric_talker.py")
        for number in range(times):
            out = folder / str(number)
            graded.append(_grade(out))
            tested.append(_rate_test(workspace))
            judged.append(
                timed([*GRADER, "judge", str(out / LAB / "evidence"), "--rubric", LAB, "--out", os.devnull])
            )
    return Found(runs=f"{times} runs of each in turn", tables=(_table(graded, tested, judged),))


def _grade(out: Path) -> One:
    cost = timed([*GRADER, "grade", str(SOLUTION), "--rubric", LAB, "--out", str(out)])
    result = GradingResult.model_validate_json((out / LAB / "result.json").read_text())
    if result.points != LAB_POINTS:
        raise NotMeasured(f"the reference solution got {result.points:g} points")
    evidence = out / LAB / "evidence"
    build_s = build_cpu_s(evidence)
    return One(
        wall_s=cost.wall_s,
        own_cpu_s=cost.cpu_s - result.timing.student_cpu_s,
        student_cpu_s=result.timing.student_cpu_s - build_s,
        build_cpu_s=build_s,
        arena_bytes=_largest_arena_bytes(evidence),
    )


def _largest_arena_bytes(evidence: Path) -> int:
    events = [event for run in load_evidence([evidence]).values() for _, event in run.processes]
    return max(event.max_rss_bytes or 0 for event in events if event.name == "arena")


def _rate_test(workspace: Path) -> Cost:
    cost = hztest(workspace)
    if cost.code != 0:
        raise NotMeasured("rostest failed the reference solution")
    return cost


def _table(graded: list[One], tested: list[Cost], judged: list[Cost]) -> str:
    walls = [g.wall_s / t.wall_s for g, t in zip(graded, tested, strict=True)]
    return spread(
        [
            Row("whole lab, wall", "s", [g.wall_s for g in graded], "at most 9"),
            Row("whole lab, the grader's own CPU", "s", [g.own_cpu_s for g in graded]),
            Row("whole lab, CPU of the student's processes", "s", [g.student_cpu_s for g in graded]),
            Row("whole lab, CPU of the build", "s", [g.build_cpu_s for g in graded]),
            Row("the grader's own CPU / student's processes and build", "", [g.ratio for g in graded]),
            Row("memory of the largest arena", "MB", [g.arena_bytes / 1e6 for g in graded]),
            Row("judging the evidence again, wall", "s", [j.wall_s for j in judged]),
            Row("judging the evidence again, CPU", "s", [j.cpu_s for j in judged]),
            Row("`rostest` with `hztest`, one rate check, wall", "s", [t.wall_s for t in tested]),
            Row("`rostest` with `hztest`, one rate check, CPU", "s", [t.cpu_s for t in tested]),
            Row("wall of the whole lab / wall of one `rostest`", "", walls),
        ]
    )
