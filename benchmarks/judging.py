"""A thousand recorded submissions judged again on all cores by `grader judge`, beside judging one."""

from __future__ import annotations

import json
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from benchmarks.figures import Found, Options, Row, spread
from benchmarks.gradings import KINDS, RUBRIC, Verdicts, cores, folder_for, graded, verdicts_of
from benchmarks.machine import timed
from grader.classes.batch.job import FolderJob

COUNT, TIMES = 1000, 5
GRADER = (sys.executable, "-m", "grader")


class Judged(NamedTuple):
    """Wall and CPU seconds of the whole command, and what came out otherwise than recorded."""

    wall_s: float
    cpu_s: float
    faults: tuple[str, ...]


def measure(options: Options) -> Found:
    count, times, jobs = options.count or COUNT, options.times or TIMES, options.jobs or cores()
    many, single = [], []
    with folder_for("judging", options) as folder:
        recorded = record_kinds(folder / "kinds")
        everything, one = folder / "all", folder / "one"
        expected = _copied(everything, recorded, count)
        alone = _copied(one, recorded, 1)
        for _ in range(times):
            many.append(_judged(everything, expected, jobs, folder / "judged.json"))
            single.append(_judged(one, alone, 1, folder / "judged.json"))
    return Found(
        runs=f"{count} submissions on {jobs} workers, {times} times in turn",
        tables=(_table(many, single, count),),
        faults=tuple(dict.fromkeys(fault for judged in (*many, *single) for fault in judged.faults)),
    )


def _table(many: list[Judged], single: list[Judged], count: int) -> str:
    ratio = [m.wall_s / (count * s.wall_s) for m, s in zip(many, single, strict=True)]
    return spread(
        [
            Row(f"{count} submissions, wall", "s", [m.wall_s for m in many]),
            Row(f"{count} submissions, CPU", "s", [m.cpu_s for m in many]),
            Row(
                "of them in a second of CPU",
                "",
                [count / m.cpu_s for m in many],
                "at least 150" if count >= COUNT else "",
                1,
            ),
            Row("of that for each, wall", "ms", [m.wall_s / count * 1e3 for m in many], "", 1),
            Row("one submission, wall", "s", [s.wall_s for s in single]),
            Row("one submission, CPU", "s", [s.cpu_s for s in single]),
            Row(f"wall of {count} / {count} times that of one", "", ratio, "", 3),
        ]
    )


def record_kinds(out: Path) -> dict[Path, Verdicts]:
    """Each kind's folder of results, with what it got when it was recorded."""
    jobs = [FolderJob(name=kind, source=source, rubric=RUBRIC, out=out) for kind, source in KINDS.items()]
    return {out / one.name: verdicts_of(one.result.criteria) for one in graded(jobs, 1)}


def _copied(folder: Path, recorded: dict[Path, Verdicts], count: int) -> dict[str, Verdicts]:
    """So many submissions in this folder, the kinds in turn, and what each has to get."""
    kinds, expected = list(recorded), {}
    for number in range(count):
        kind = kinds[number % len(kinds)]
        copy = folder / f"{number:04}-{kind.name}"
        shutil.copytree(kind, copy, dirs_exist_ok=True)
        expected[copy.name] = recorded[kind]
    return expected


def _judged(folder: Path, expected: dict[str, Verdicts], jobs: int, out: Path) -> Judged:
    """`grader judge`, in a process of its own, on a folder of submissions."""
    argv = [*GRADER, "judge", str(folder), "--rubric", str(RUBRIC), "--jobs", str(jobs), "--out", str(out)]
    cost = timed(argv, codes=(0, 1))
    return Judged(cost.wall_s, cost.cpu_s, tuple(_wrong(json.loads(out.read_text()), expected)))


def _wrong(found: list[dict[str, Any]], expected: dict[str, Verdicts]) -> Iterator[str]:
    """What is missing, or judged otherwise than when it was recorded."""
    judged = {one["submission"]: one.get("criteria") for one in found}
    for name, verdicts in expected.items():
        criteria = judged.get(name)
        if criteria is None:
            yield f"{name} was not judged"
        elif {one["id"]: (one["status"], one["points"]) for one in criteria} != verdicts:
            yield f"{name} is judged otherwise than when it was recorded"
