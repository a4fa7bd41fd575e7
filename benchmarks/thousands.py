"""Classes of a thousand and of ten thousand, judged by their files alone: whether time is linear and memory flat."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from benchmarks.figures import Found, NotMeasured, Options, table
from benchmarks.gradings import DATA, LAB, SOLUTION, cores, folder_for
from benchmarks.machine import Meter, grader_workers, peak_sizes
from fixtures.make import faulty_package

COUNT = 10_000
SHARES = (10, 1)
"""Classes of a tenth of the count, and of the count."""
RUBRIC = DATA / "static.yaml"
FAULTY = ("cmake-project-name", "manifest-name", "ok-no-dependencies")
KINDS = (SOLUTION, *(faulty_package(LAB, name) for name in FAULTY))
LEFT = re.compile(r"\[(\d+) of (\d+) done.*about (\d+(?::\d+)?) (s|min|h) to go\]")
UNITS_S = {"s": 1, "min": 60}
GRADER = (sys.executable, "-m", "grader")


class Batch(NamedTuple):
    """Seconds of the wall and of CPU, the largest resident sizes in MB of the process that hands out the work
    and of those that do it, and what the progress said half-way that was left, with what then was."""

    wall_s: float
    cpu_s: float
    handing_mb: float
    grading_mb: float
    said_s: float | None
    took_s: float


def measure(options: Options) -> Found:
    count, jobs = options.count or COUNT, options.jobs or cores()
    rows, faults = [], list[str]()
    with folder_for("thousands", options) as folder:
        points = points_alone(folder / "alone", jobs)
        for number in (count // share for share in SHARES):
            handed_in, out = made(folder / f"in-{number}", number), folder / f"out-{number}"
            first, again = batch(handed_in, out, jobs), batch(handed_in, out, jobs)
            faults += wrong_points(out, number, points)
            rows += [_row(number, "graded", first), _row(number, "found complete", again)]
            shutil.rmtree(handed_in)
            shutil.rmtree(out)
    header = [
        "submissions",
        "",
        "wall, s",
        "each, ms",
        "memory, MB: hands out",
        "grades",
        "half-way: said, s",
        "took, s",
    ]
    return Found(
        runs=f"{jobs} side by side, once each",
        tables=(table(header, rows),),
        faults=tuple(faults),
    )


def _row(count: int, what: str, batch: Batch) -> list[str]:
    said = f"{batch.said_s:.0f}" if batch.said_s is not None else ""
    times = [f"{batch.wall_s:.1f}", f"{1e3 * batch.wall_s / count:.1f}"]
    sizes = [f"{batch.handing_mb:.0f}", f"{batch.grading_mb:.0f}"]
    return [str(count), what, *times, *sizes, said, f"{batch.took_s:.0f}"]


def made(folder: Path, count: int) -> Path:
    """A folder with so many submissions, the kinds in turn."""
    for number in range(count):
        shutil.copytree(KINDS[number % len(KINDS)], folder / f"s{number:05}")
    return folder


def points_alone(folder: Path, jobs: int) -> list[float]:
    """What each kind gets where it is alone."""
    batch(made(folder / "in", len(KINDS)), folder / "out", jobs)
    return list(_points(folder / "out"))


def _points(out: Path) -> Iterator[float]:
    with (out / "results.jsonl").open(encoding="utf-8") as lines:
        for line in lines:
            yield json.loads(line)["points"]


def wrong_points(out: Path, count: int, alone: list[float]) -> Iterator[str]:
    found = list(_points(out))
    if len(found) != count:
        yield f"{len(found)} of {count} results"
    different = sum(points != alone[number % len(alone)] for number, points in enumerate(found))
    if different:
        yield f"{different} of {count} got other points than alone"


def batch(handed_in: Path, out: Path, jobs: int, rubric: Path = RUBRIC) -> Batch:
    return followed(
        ["batch", str(handed_in), "--rubric", str(rubric), "--out", str(out), "--jobs", str(jobs)]
    )


def followed(argv: Sequence[str]) -> Batch:
    """Run `grader` with these arguments for a class to its end."""
    meter, half_s, said_s = Meter(), time.monotonic(), None
    with subprocess.Popen(
        [*GRADER, *argv], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stderr is not None  # noqa: S101 - opened with PIPE
        groups = {"hands out": lambda: [process.pid], "grades": lambda: grader_workers(process.pid)}
        with peak_sizes(groups) as peaks:
            for line in process.stderr:
                told = LEFT.search(line)
                if told and said_s is None and int(told[1]) * 2 >= int(told[2]):
                    half_s, said_s = time.monotonic(), _seconds(told[3], told[4])
            process.wait()
    if process.returncode not in {0, 1, 4}:  # 4: what a person has to decide is open
        raise NotMeasured(f"grader {argv[0]} ended with {process.returncode}")
    return Batch(
        wall_s=meter.wall_s(),
        cpu_s=meter.children_cpu_s(),
        handing_mb=peaks["hands out"],
        grading_mb=peaks["grades"],
        said_s=said_s,
        took_s=time.monotonic() - half_s,
    )


def _seconds(number: str, unit: str) -> float:
    if unit == "h":
        hours, minutes = number.split(":")
        return int(hours) * 3600 + int(minutes) * 60
    return int(number) * UNITS_S[unit]
