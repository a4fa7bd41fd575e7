"""A hundred submissions of the Leeds lab, four kinds mixed, on all cores: as fast, and the same verdicts."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import chain
from pathlib import Path
from typing import NamedTuple

from benchmarks.figures import Found, Options, Row, spread
from benchmarks.gradings import (
    KINDS,
    LAB_POINTS,
    RUBRIC,
    build_cpu_s,
    folder_for,
    graded,
    in_flight,
    uncounted,
    verdicts_of,
)
from benchmarks.machine import Meter
from grader.classes.batch.job import FolderJob
from grader.model.result import GradingResult
from grader.model.verdict import Status

COUNT, TIMES = 100, 1


class Batch(NamedTuple):
    """CPU seconds of the whole batch; `own` is everything that is neither a student's process nor a build."""

    wall_s: float
    own_cpu_s: float
    student_cpu_s: float
    build_cpu_s: float
    again: int
    inconclusive: int
    others: int
    faults: tuple[str, ...]

    @property
    def ratio(self) -> float:
        return self.own_cpu_s / (self.student_cpu_s + self.build_cpu_s)


def measure(options: Options) -> Found:
    count, times, side_by_side = options.count or COUNT, options.times or TIMES, options.jobs or in_flight()
    with folder_for("hundred", options) as folder:
        alone = _alone(folder / "alone")
        batches = [_batch(folder / str(turn), count, side_by_side, alone) for turn in range(times)]
    wall_alone_s = sum(one.timing.wall_s for one in alone.values()) / len(alone)
    return Found(
        runs=f"{count} submissions, {side_by_side} side by side, {times} times",
        tables=(_table(batches, count, wall_alone_s),),
        faults=(*_unexpected(alone), *(fault for batch in batches for fault in batch.faults)),
        remarks=(f"Kinds, in turn: {', '.join(KINDS)}.",),
    )


def _alone(out: Path) -> dict[str, GradingResult]:
    """Each kind, one at a time."""
    jobs = [FolderJob(name=kind, source=source, rubric=RUBRIC, out=out) for kind, source in KINDS.items()]
    return {one.name: one.result for one in graded(jobs, 1)}


def _batch(out: Path, count: int, side_by_side: int, alone: dict[str, GradingResult]) -> Batch:
    kinds = [list(KINDS)[number % len(KINDS)] for number in range(count)]
    jobs = [
        FolderJob(name=f"{number:03}-{kind}", source=KINDS[kind], rubric=RUBRIC, out=out)
        for number, kind in enumerate(kinds)
    ]
    meter = Meter()
    gradings = list(graded(jobs, side_by_side))
    wall_s, all_s = meter.wall_s(), meter.all_cpu_s()
    results = {one.name: one.result for one in gradings}
    others_s = sum(result.timing.student_cpu_s for result in results.values())
    build_s = sum(build_cpu_s(out / name / "evidence") for name in results)
    differing = {name: [*_differing(name, one, alone[name[4:]])] for name, one in sorted(results.items())}
    return Batch(
        wall_s=wall_s,
        own_cpu_s=all_s - others_s,
        student_cpu_s=others_s - build_s,
        build_cpu_s=build_s,
        again=sum(one.again for one in gradings),
        inconclusive=sum(_is_inconclusive(result) for result in results.values()),
        others=sum(map(bool, differing.values())),
        faults=(*chain.from_iterable(differing.values()), *uncounted(all_s, wall_s, results.values())),
    )


def _differing(name: str, result: GradingResult, alone: GradingResult) -> Iterable[str]:
    """Where a verdict is not that of the same kind alone, unless it says that it cannot say."""
    expected, found = verdicts_of(alone.criteria), verdicts_of(result.criteria)
    messages = {criterion.id: criterion.message for criterion in result.criteria}
    for criterion, (status, points) in expected.items():
        if found[criterion] != (status, points) and found[criterion][0] is not Status.INCONCLUSIVE:
            yield (
                f"{name}, {criterion}: {found[criterion][0]} ({found[criterion][1]:g} points), "
                f"alone {status} ({points:g}): {messages[criterion]}"
            )


def _is_inconclusive(result: GradingResult) -> bool:
    return any(criterion.status is Status.INCONCLUSIVE for criterion in result.criteria)


def _unexpected(alone: dict[str, GradingResult]) -> Iterable[str]:
    """The kinds themselves: the reference is right, each of the others loses something, all can be judged."""
    for kind, result in alone.items():
        if _is_inconclusive(result):
            yield f"{kind} alone is inconclusive: nothing to compare with"
        elif (result.points == LAB_POINTS) != (kind == "reference"):
            yield f"{kind} alone got {result.points:g} points"


def _table(batches: list[Batch], count: int, wall_alone_s: float) -> str:
    return spread(
        [
            Row("wall", "s", [b.wall_s for b in batches], "at most 150", 1),
            Row("one submission alone, wall", "s", [wall_alone_s]),
            Row("wall / one after the other", "", [b.wall_s / (count * wall_alone_s) for b in batches]),
            Row("the grader's own CPU", "s", [b.own_cpu_s for b in batches], "", 1),
            Row("CPU of the students' processes", "s", [b.student_cpu_s for b in batches], "", 1),
            Row("CPU of the builds", "s", [b.build_cpu_s for b in batches], "", 1),
            Row(
                "the grader's own CPU / processes and builds", "", [b.ratio for b in batches], "at most 0.25"
            ),
            Row("submissions with other verdicts than alone", "", [b.others for b in batches], "0", 0),
            Row("runs made again", "", [b.again for b in batches], "", 0),
            Row("submissions left inconclusive", "", [b.inconclusive for b in batches], "", 0),
        ]
    )
