"""Three hundred recorded submissions judged again on all cores, beside judging one."""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from benchmarks.figures import Found, Options, Row, spread
from benchmarks.gradings import KINDS, RUBRIC, Verdicts, cores, folder_for, graded, verdicts_of
from benchmarks.machine import Cost, Meter, timed
from grader.batch.judging import judge_all
from grader.batch.workers import Job
from grader.rubric.load import load_rubric

COUNT, TIMES = 300, 5


class Judged(NamedTuple):
    """Wall and CPU seconds of judging some submissions, workers included, and what came out otherwise than recorded."""

    wall_s: float
    cpu_s: float
    faults: tuple[str, ...]


def measure(options: Options) -> Found:
    count, times, jobs = options.count or COUNT, options.times or TIMES, options.jobs or cores()
    many, single, alone = [], [], []
    with folder_for("judging", options) as folder:
        expected = _recorded(folder / "kinds")
        copies = _copied(folder, list(expected), count)
        for _ in range(times):
            many.append(_judged(copies, expected, jobs))
            single.append(_judged(copies[:1], expected, 1))
            alone.append(_grader_judge(copies[0]))
    per_one = [m.wall_s / count * 1e3 for m in many]
    ratio = [m.wall_s / (count * s.wall_s) for m, s in zip(many, single, strict=True)]
    rows = [
        Row(
            f"{count} submissions, wall", "s", [m.wall_s for m in many], "at most 6" if count == COUNT else ""
        ),
        Row(f"{count} submissions, CPU", "s", [m.cpu_s for m in many]),
        Row("of that for each, wall", "ms", per_one, "", 1),
        Row("one submission, wall", "s", [s.wall_s for s in single]),
        Row("one submission, CPU", "s", [s.cpu_s for s in single]),
        Row("one submission by `grader judge`, wall", "s", [a.wall_s for a in alone]),
        Row(f"wall of {count} / {count} times that of one", "", ratio, "", 3),
    ]
    return Found(
        runs=f"{count} submissions on {jobs} workers, {times} times in turn",
        tables=(spread(rows),),
        faults=tuple(dict.fromkeys(fault for judged in (*many, *single) for fault in judged.faults)),
    )


def _recorded(out: Path) -> dict[Path, Verdicts]:
    """Each kind's folder of results, with what it got when it was recorded."""
    jobs = [Job(name=kind, source=source, rubric=RUBRIC, out=out) for kind, source in KINDS.items()]
    return {out / name: verdicts_of(result.criteria) for name, result in graded(jobs, 1)}


def _copied(folder: Path, kinds: Sequence[Path], count: int) -> list[Path]:
    """So many submissions, the kinds in turn."""
    copies = []
    for number in range(count):
        kind = kinds[number % len(kinds)]
        copies.append(folder / "all" / f"{number:03}-{kind.name}")
        shutil.copytree(kind, copies[-1], dirs_exist_ok=True)
    return copies


def _judged(folders: Sequence[Path], expected: dict[Path, Verdicts], jobs: int) -> Judged:
    rubric, faults, by_kind = load_rubric(str(RUBRIC)), [], {kind.name: v for kind, v in expected.items()}
    meter = Meter()
    results = list(judge_all(folders, rubric, jobs))
    wall_s, cpu_s = meter.wall_s(), meter.own_cpu_s() + meter.children_cpu_s()
    for one in results:
        if one.criteria is None:
            faults.append(f"{one.folder.name} was not judged: {one.error}")
        elif verdicts_of(one.criteria) != by_kind[one.folder.name[4:]]:
            faults.append(f"{one.folder.name} is judged otherwise than when it was recorded")
    if len(results) != len(folders):
        faults.append(f"{len(results)} of {len(folders)} were judged")
    return Judged(wall_s, cpu_s, tuple(faults))


def _grader_judge(folder: Path) -> Cost:
    argv = [
        sys.executable,
        "-m",
        "grader",
        "judge",
        str(folder),
        "--rubric",
        str(RUBRIC),
        "--out",
        os.devnull,
    ]
    return timed(argv, codes=(0, 1))
