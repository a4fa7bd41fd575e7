"""How long a batch took."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from statistics import fmean, median

from grader.model.batch import BatchRun
from grader.report.class_page.lines import Line

SLOWEST = 10


@dataclass(frozen=True, kw_only=True)
class Timing:
    """Seconds. `wall_s` is None while the batch goes on. `slowest` are places of submissions, with their time."""

    wall_s: float | None
    mean_s: float
    median_s: float
    slowest: tuple[tuple[int, float], ...]
    done: int


def timing(run: BatchRun, lines: Sequence[Line]) -> Timing | None:
    """None where no submission was timed."""
    timed = [(place, line.wall_s) for place, line in enumerate(lines) if line.wall_s > 0]
    if not timed:
        return None
    seconds = [wall_s for _, wall_s in timed]
    ended = run.ended_at
    return Timing(
        wall_s=(ended - run.started_at).total_seconds() if ended else None,
        mean_s=fmean(seconds),
        median_s=median(seconds),
        slowest=tuple(sorted(timed, key=lambda one: (-one[1], one[0]))[:SLOWEST]),
        done=len(timed),
    )


def span(seconds: float) -> str:
    """`0.4 s`, `48 s`, `12 min 3 s`, `2 h 5 min`, `3 days 4 h`."""
    if seconds < 59.5:
        return f"{seconds:.1f} s" if seconds < 9.95 else f"{seconds:.0f} s"
    whole = round(seconds)
    for size, unit, part, smaller in (
        (86_400, "days", 3600, "h"),
        (3600, "h", 60, "min"),
        (60, "min", 1, "s"),
    ):
        if whole >= size:
            rest = whole % size // part
            name = "day" if unit == "days" and whole // size == 1 else unit
            return f"{whole // size} {name}" + (f" {rest} {smaller}" if rest else "")
    return "0 s"
