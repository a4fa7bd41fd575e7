"""Correct packages in five styles on a busy machine lose nothing; wrong rates on an idle one never pass."""

from __future__ import annotations

import shutil
from collections import Counter
from collections.abc import Iterable, Iterator
from itertools import product
from pathlib import Path
from typing import NamedTuple

from benchmarks.busy import busy_loops
from benchmarks.figures import Found, NotMeasured, Options, share, table
from benchmarks.gradings import DATA, folder_for, graded, in_flight
from benchmarks.machine import Meter
from grader.classes.batch.job import FolderJob
from grader.model.result import CriterionResult, GradingResult
from grader.model.verdict import Status

COUNT, LOOPS = 200, 8
WRONG_HZ = (9.2, 11.0)
STYLES = {
    "rate": ("src/pulse.py", "rospy.Rate(10)", "rospy.Rate({hz})"),
    "timer": ("src/pulse.py", "rospy.Duration(0.1)", "rospy.Duration(1 / {hz})"),
    "sleep": ("src/pulse.py", "time.sleep(0.1)", "time.sleep(1 / {hz})"),
    "class": ("src/pulse.py", "rospy.Rate(10)", "rospy.Rate({hz})"),
    "cpp": ("src/pulse.cpp", "ros::Rate rate(10)", "ros::Rate rate({hz})"),
}
"""Where each package has its rate, and how another one is written there."""
RATE = "rate"
TAKEN = (Status.FAIL, Status.PARTIAL, Status.BLOCKED, Status.ERROR)


class Series(NamedTuple):
    """Gradings of many packages, how many of their runs were made again, and how long all took (s)."""

    results: dict[str, GradingResult]
    again: int
    wall_s: float


def measure(options: Options) -> Found:
    count, side_by_side = options.count or COUNT, options.jobs or in_flight()
    loops = LOOPS if options.loops is None else options.loops[0]
    with folder_for("fair", options) as folder:
        with busy_loops(loops):
            right = _graded(_right_jobs(count, folder), side_by_side)
        wrong = _graded(_wrong_jobs(count, folder), side_by_side)
    lost, slipped = list(_lost(right)), list(_slipped(wrong))
    doubtful = [_doubts(series) for series in (right, wrong)]
    rows = [
        [
            "correct",
            str(loops),
            share(len({name for name, _ in lost}), count),
            share(len(doubtful[0]), count),
            str(right.again),
            f"{right.wall_s:.0f}",
        ],
        [
            "9.2 or 11 Hz",
            "0",
            share(len(slipped), count),
            share(len(doubtful[1]), count),
            str(wrong.again),
            f"{wrong.wall_s:.0f}",
        ],
    ]
    header = [
        "packages",
        "busy loops",
        "judged wrongly (asked: 0)",
        "inconclusive (asked: at most 5 %)",
        "runs made again",
        "wall, s",
    ]
    return Found(
        runs=f"{count} gradings of each, {side_by_side} side by side",
        tables=(table(header, rows), _by_style(right, lost, doubtful[0])),
        faults=(
            *(f"{name} lost marks: {line}" for name, line in lost),
            *(f"{line} passed" for line in slipped),
        ),
        remarks=tuple(f"- Inconclusive: {name}: {line}" for lines in doubtful for name, line in lines),
    )


def _right_jobs(count: int, folder: Path) -> list[FolderJob]:
    styles = [list(STYLES)[number % len(STYLES)] for number in range(count)]
    return [
        _job(f"{number:03}-{style}", DATA / "pulse" / style, style, folder / "right")
        for number, style in enumerate(styles)
    ]


def _wrong_jobs(count: int, folder: Path) -> list[FolderJob]:
    """Each style at each of the wrong rates in turn."""
    pairs = list(product(WRONG_HZ, STYLES))
    sources = {pair: _at_rate(*pair, folder / "packages") for pair in pairs}
    chosen = [pairs[number % len(pairs)] for number in range(count)]
    return [
        _job(f"{number:03}-{hz:g}hz-{style}", sources[hz, style], style, folder / "wrong")
        for number, (hz, style) in enumerate(chosen)
    ]


def _job(name: str, source: Path, style: str, out: Path) -> FolderJob:
    rubric = DATA / ("pulse-cpp.yaml" if style == "cpp" else "pulse.yaml")
    return FolderJob(name=name, source=source, rubric=rubric, out=out)


def _at_rate(hz: float, style: str, folder: Path) -> Path:
    """The package with another rate."""
    copy = folder / f"{style}-{hz:g}"
    shutil.copytree(DATA / "pulse" / style, copy, dirs_exist_ok=True)
    file, old, new = STYLES[style]
    source = copy / "pulse" / file
    text = source.read_text()
    if text.count(old) != 1:
        raise NotMeasured(f"{source} has its rate not just once")
    source.write_text(text.replace(old, new.format(hz=hz)))
    return copy


def _graded(jobs: list[FolderJob], side_by_side: int) -> Series:
    meter = Meter()
    gradings = list(graded(jobs, side_by_side))
    results = {one.name: one.result for one in gradings}
    return Series(results, sum(one.again for one in gradings), meter.wall_s())


def _lost(series: Series) -> Iterator[tuple[str, str]]:
    """Marks that were taken, with what the student is told."""
    for name, result in sorted(series.results.items()):
        for criterion in result.criteria:
            if criterion.status in TAKEN:
                yield name, _told(criterion)


def _slipped(series: Series) -> Iterator[str]:
    for name, result in sorted(series.results.items()):
        rate = next(criterion for criterion in result.criteria if criterion.id == RATE)
        if rate.status is Status.PASS:
            yield f"{name}: {rate.measured}"


def _doubts(series: Series) -> list[tuple[str, str]]:
    """Submissions of which a person has to judge something, and the first thing that is."""
    found = {}
    for name, result in sorted(series.results.items()):
        doubtful = [criterion for criterion in result.criteria if criterion.status is Status.INCONCLUSIVE]
        if doubtful:
            found[name] = _told(doubtful[0])
    return list(found.items())


def _told(criterion: CriterionResult) -> str:
    return f"{criterion.id} {criterion.status}: {criterion.message} (measured: {criterion.measured})"


def _by_style(series: Series, lost: Iterable[tuple[str, str]], doubtful: Iterable[tuple[str, str]]) -> str:
    """The correct packages of each style."""
    all_of = Counter(name[4:] for name in series.results)
    lost_of = Counter(name[4:] for name in {name for name, _ in lost})
    doubtful_of = Counter(name[4:] for name, _ in doubtful)
    rows = [
        [style, str(all_of[style]), str(lost_of[style]), str(doubtful_of[style])] for style in sorted(all_of)
    ]
    return table(["correct packages", "graded", "lost marks", "inconclusive"], rows)
