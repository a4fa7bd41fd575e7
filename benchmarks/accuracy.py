"""When messages are said to have come, beside when they were sent; and the rate, beside `rostopic hz`."""

from __future__ import annotations

import re
import statistics
import struct
import time
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

from benchmarks import arena
from benchmarks.arena import PREFIX, PUBLISHER, Load, publisher_told
from benchmarks.figures import Found, NotMeasured, Options, mid, table
from benchmarks.gradings import folder_for
from benchmarks.ros import master, program, require_ros, running

TIMES, SECONDS = 3, 20.0
RATES_HZ = (10.0, 100.0)
TIME = struct.Struct("<Q")
AVERAGE = re.compile(r"average rate: ([\d.]+)")
DEVIATION = re.compile(r"std dev: ([\d.]+)s")
READY_S = 1.5


class Seen(NamedTuple):
    """Of one run: delays from sending to the recorded arrival (µs), error of the mean rate against that of sending
    (ppm), and the gaps' standard deviation (ms)."""

    delays_us: list[float]
    error_ppm: float
    deviation_ms: float


def measure(options: Options) -> Found:
    times, seconds = options.times or TIMES, options.seconds or SECONDS
    delays, rates, faults = [], [], []
    with folder_for("accuracy", options) as folder:
        for rate_hz in RATES_HZ:
            load = Load(
                topics=1, type="std_msgs/UInt64", bytes=8, count=int(rate_hz * seconds), rate_hz=rate_hz
            )
            ours: list[Seen] = []
            theirs: list[Seen] = []
            for _ in range(times):
                ours.append(_recorded(load, folder / "load.mcap"))
                theirs.append(_rostopic(load, folder))
                if len(ours[-1].delays_us) != load.count:
                    faults.append(f"{rate_hz:g} Hz: {load.count - len(ours[-1].delays_us)} messages lost")
            delays.append(_delay_cells(rate_hz, ours))
            rates += [
                _rate_cells(rate_hz, "the recorder", ours),
                _rate_cells(rate_hz, "`rostopic hz`", theirs),
            ]
    return Found(
        runs=f"{seconds:g} s each, {times} times in turn",
        tables=(
            table(["publisher", "recorded after it was sent: median", "99 %", "most"], delays),
            table(["publisher", "measured by", "error of the mean rate", "deviation of the gaps"], rates),
        ),
        faults=tuple(faults),
    )


def _recorded(load: Load, path: Path) -> Seen:
    taken, offset_ns = arena.record(load, path)
    seen = arena.arrivals(path, f"{PREFIX}0")
    path.unlink()
    times_ns = [time_ns for time_ns, _ in seen]
    delays_us = [(time_ns - offset_ns - TIME.unpack(data)[0]) / 1e3 for time_ns, data in seen]
    mean_hz = (len(times_ns) - 1) / (times_ns[-1] - times_ns[0]) * 1e9
    gaps_ms = [(after - before) / 1e6 for before, after in pairwise(times_ns)]
    return Seen(delays_us, _ppm(mean_hz, taken.sent_hz), statistics.pstdev(gaps_ms))


def _rostopic(load: Load, folder: Path) -> Seen:
    """What `rostopic hz` says at the end, of all messages."""
    with master(folder) as env:
        argv = [program("rostopic"), "hz", "-w", str(load.count), f"{PREFIX}0"]
        with (
            running(argv, env) as watcher,
            running([require_ros().python, str(PUBLISHER), load.argument], env) as node,
        ):
            if node.stdout is None or watcher.stdout is None:
                raise NotMeasured("no pipe")
            told = publisher_told([node.stdout.readline()])
            time.sleep(READY_S)  # it says what it saw once a second
            watcher.terminate()
            text = watcher.stdout.read()
    averages, deviations = AVERAGE.findall(text), DEVIATION.findall(text)
    if not averages or not deviations:
        raise NotMeasured(f"rostopic hz said nothing: {text[-300:]}")
    return Seen([], _ppm(float(averages[-1]), told["mean_hz"]), float(deviations[-1]) * 1e3)


def _ppm(mean_hz: float, sent_hz: float) -> float:
    return abs(mean_hz / sent_hz - 1) * 1e6


def _delay_cells(rate_hz: float, runs: list[Seen]) -> list[str]:
    delays_us = [delay for run in runs for delay in run.delays_us]
    most_us = statistics.quantiles(delays_us, n=100, method="inclusive")[98]
    figures = (statistics.median(delays_us), most_us, max(delays_us))
    return [f"{rate_hz:g} Hz", *(f"{figure / 1e3:.3f} ms" for figure in figures)]


def _rate_cells(rate_hz: float, by: str, runs: list[Seen]) -> list[str]:
    errors, deviations = [run.error_ppm for run in runs], [run.deviation_ms for run in runs]
    return [f"{rate_hz:g} Hz", by, f"{mid(errors, 0)} ppm", f"{mid(deviations, 3)} ms"]
