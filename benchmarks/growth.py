"""How cost and memory grow: with the class, graded for real, judged again or by its files alone, and with a cluster."""

from __future__ import annotations

import csv
import json
import os
import shutil
import subprocess
from collections.abc import Callable, Iterable, Iterator
from datetime import datetime, timezone
from itertools import chain
from pathlib import Path
from typing import NamedTuple

from benchmarks.figures import Found, NotMeasured, Options, chart, table
from benchmarks.gradings import KINDS, RUBRIC, Verdicts, cores, folder_for, in_flight
from benchmarks.judging import record_kinds
from benchmarks.machine import Meter, grader_workers, peak_sizes
from benchmarks.one import largest_arena_bytes
from benchmarks.thousands import GRADER, Batch, batch, followed, made, points_alone, wrong_points
from benchmarks.thousands import RUBRIC as STATIC
from grader import __version__
from grader.classes.batch.folder import write_run
from grader.classes.batch.run import describe_rubric
from grader.model.batch import BatchRun, Entry
from grader.model.verdict import Status
from grader.rubric.load import load_rubric
from tests.classes.cluster.clusters import cluster

COUNT = 10_000
REAL, RECORDED, FILES = "graded", "judged again", "files alone"
SHARES = {REAL: (1000, 100), RECORDED: (100, 10, 1), FILES: (100, 10)}
"""Classes of these parts of the count."""
CLUSTER_SHARE, WORKERS = 20, (1, 2, 4, 8)


class Class(NamedTuple):
    """One class; `arena_mb` is the largest arena's memory, where there were any."""

    how: str
    size: int
    batch: Batch
    arena_mb: float | None = None


class Clustered(NamedTuple):
    """A class graded into `out` by so many Dask workers; memory in MB by role."""

    workers: int
    out: Path
    wall_s: float
    peaks: dict[str, float]


def measure(options: Options) -> Found:
    count, jobs = options.count or COUNT, options.jobs or cores()
    faults: list[str] = []
    with folder_for("growth", options) as folder:
        kinds = record_kinds(folder / "kinds")
        alone = points_alone(folder / "alone", jobs)
        classes = [
            *_real(folder / "real", _sizes(count, REAL), kinds, faults),
            *_recorded(folder / "recorded", _sizes(count, RECORDED), list(kinds), jobs, faults),
            *_files(folder / "files", _sizes(count, FILES), jobs, alone, faults),
        ]
        number = max(count // CLUSTER_SHARE, 1)
        handed_in = made(folder / "clustered" / "in", number)
        clustered = [_clustered(folder / "clustered", workers, handed_in) for workers in WORKERS]
        faults += [fault for one in clustered for fault in wrong_points(one.out, number, alone)]
    return Found(
        runs=f"{in_flight()} side by side where nodes run, else {jobs}, once each",
        tables=(_class_table(classes), _cluster_table(clustered, number)),
        faults=tuple(faults),
        remarks=("\n![Time of each submission](growth-time.svg)", "![Memory](growth-memory.svg)"),
        pictures={
            "growth-time.svg": chart(
                "time",
                "Time of each submission",
                ("submissions", "ms each"),
                _lines(classes, lambda one: 1e3 * one.batch.wall_s / one.size),
                log=(True, True),
            ),
            "growth-memory.svg": chart(
                "memory",
                "Memory of the process that hands out the work",
                ("submissions", "MB"),
                _lines(classes, lambda one: one.batch.handing_mb),
                log=(True, False),
            ),
        },
    )


def _sizes(count: int, how: str) -> list[int]:
    return sorted({max(count // share, 1) for share in SHARES[how]})


def _real(
    folder: Path, sizes: Iterable[int], kinds: dict[Path, Verdicts], faults: list[str]
) -> Iterator[Class]:
    """Submissions of the four kinds in turn, built and run."""
    expected = list(kinds.values())
    for number in sizes:
        handed_in, out = folder / f"in-{number}", folder / f"out-{number}"
        for at in range(number):
            shutil.copytree(list(KINDS.values())[at % len(KINDS)], handed_in / f"s{at:05}")
        graded = batch(handed_in, out, in_flight(), RUBRIC)
        faults += _other_verdicts(out, number, expected)
        arenas = (largest_arena_bytes(evidence) for evidence in out.glob("*/evidence"))
        yield Class(REAL, number, graded, max(arenas) / 1e6)


def _other_verdicts(out: Path, count: int, expected: list[Verdicts]) -> Iterator[str]:
    """Yield what is missing or judged otherwise than alone, unless it is inconclusive."""
    for at in range(count):
        file = out / f"s{at:05}" / "result.json"
        found = json.loads(file.read_text())["criteria"] if file.exists() else []
        alone = expected[at % len(expected)]
        if [one["id"] for one in found] != list(alone):
            yield f"{file.parent.name} of {count} was not graded"
        for one in found:
            if one["status"] != Status.INCONCLUSIVE and (one["status"], one["points"]) != alone[one["id"]]:
                yield f"{file.parent.name} of {count}, {one['id']}: {one['status']}, alone {alone[one['id']][0]}"


def _recorded(
    folder: Path, sizes: Iterable[int], kinds: list[Path], jobs: int, faults: list[str]
) -> Iterator[Class]:
    """Recordings of the four kinds in turn, judged again by `grader regrade` with the same rubric."""
    for number in sizes:
        out = folder / str(number)
        _class_of(out, number, kinds)
        judged = followed(["regrade", str(out), "--jobs", str(jobs)])
        with (out / "changes.csv").open(encoding="utf-8-sig", newline="") as file:
            faults += [f"{row['id']} of {number}: {row['criterion']} changed" for row in csv.DictReader(file)]
        with (out / "results.jsonl").open(encoding="utf-8") as file:
            if (found := sum(1 for _ in file)) != number:
                faults.append(f"{found} of {number} are in results.jsonl")
        yield Class(RECORDED, number, judged)
        shutil.rmtree(out)


def _class_of(out: Path, count: int, kinds: list[Path]) -> None:
    """A batch's folder with copies of these results. What a regrade only reads is linked."""
    rubric, entries = load_rubric(str(RUBRIC)), []
    for at in range(count):
        kind, name = kinds[at % len(kinds)], f"s{at:05}"
        shutil.copytree(kind, out / name, copy_function=os.link)
        text = (kind / "result.json").read_text().replace(f'"id": "{kind.name}"', f'"id": "{name}"', 1)
        (out / name / "result.json").unlink()
        (out / name / "result.json").write_text(text)
        entries.append(Entry(id=name, source=str(kind)))
    write_run(
        out,
        BatchRun(
            state="complete",
            grader=__version__,
            **describe_rubric(rubric, str(RUBRIC)),
            roster="roster.csv",
            started_at=datetime.now(timezone.utc),
            entries=tuple(entries),
        ),
    )


def _files(
    folder: Path, sizes: Iterable[int], jobs: int, alone: list[float], faults: list[str]
) -> Iterator[Class]:
    """Submissions whose files alone decide."""
    for number in sizes:
        out = folder / f"out-{number}"
        graded = batch(made(folder / f"in-{number}", number), out, jobs)
        faults += wrong_points(out, number, alone)
        yield Class(FILES, number, graded)


def _clustered(folder: Path, workers: int, handed_in: Path) -> Clustered:
    """The class graded by a Dask cluster of this machine's processes, a submission at a time for each worker."""
    out = folder / f"out-{workers}"
    (own_folder := folder / f"cluster-{workers}").mkdir()
    argv = [*GRADER, "batch", str(handed_in), "--rubric", str(STATIC), "--static", "--out", str(out)]
    with cluster(own_folder) as own:
        started = [own.worker().pid for _ in range(workers)]
        argv += ["--cluster", own.address, "--cluster-insecure"]
        meter = Meter()
        with subprocess.Popen(argv, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as client:
            groups: dict[str, Callable[[], Iterable[int]]] = {
                "client": lambda: [client.pid],
                "scheduler": lambda: [own.scheduler.pid],
                "worker": lambda: started,
                "grades": lambda: chain.from_iterable(map(grader_workers, started)),
            }
            with peak_sizes(groups) as peaks:
                _, said = client.communicate()
        wall_s = meter.wall_s()
    if client.returncode not in {0, 1}:
        raise NotMeasured(f"grader batch --cluster ended with {client.returncode}: {said[-400:]}")
    return Clustered(workers, out, wall_s, peaks)


def _lines(classes: Iterable[Class], value: Callable[[Class], float]) -> dict[str, list[tuple[float, float]]]:
    found: dict[str, list[tuple[float, float]]] = {}
    for one in classes:
        found.setdefault(one.how, []).append((one.size, value(one)))
    return found


def _class_table(classes: Iterable[Class]) -> str:
    header = ["class", "submissions", "wall, s", "each, ms", "CPU of each, ms"]
    header += ["memory, MB: hands out", "a worker", "the largest arena"]
    return table(header, map(_row, classes))


def _row(one: Class) -> list[str]:
    batch = one.batch
    times = [f"{batch.wall_s:.1f}", *(f"{1e3 * s / one.size:.1f}" for s in (batch.wall_s, batch.cpu_s))]
    sizes = [f"{batch.handing_mb:.0f}", f"{batch.grading_mb:.0f}"]
    return [one.how, str(one.size), *times, *sizes, f"{one.arena_mb:.0f}" if one.arena_mb else ""]


def _cluster_table(clustered: Iterable[Clustered], count: int) -> str:
    header = ["Dask workers", "submissions", "wall, s", "each, ms"]
    header += [
        f"memory, MB: {name}" for name in ("client", "scheduler", "a worker", "its process that grades")
    ]
    rows = (
        [
            str(one.workers),
            str(count),
            f"{one.wall_s:.1f}",
            f"{1e3 * one.wall_s / count:.1f}",
            *(f"{size:.0f}" for size in one.peaks.values()),
        ]
        for one in clustered
    )
    return table(header, rows)
