"""`rosbag record`, in front of the same publisher."""

from __future__ import annotations

import os
import signal
import subprocess
import time
from pathlib import Path

from rosbags.rosbag1 import Reader

from benchmarks.arena import PREFIX, PUBLISHER, Load, Taken, publisher_told
from benchmarks.figures import NotMeasured
from benchmarks.ros import master, require_ros, running

RECORDERS = ("/usr/lib/rosbag/record", "lib/rosbag/record")
LOOK_S, IDLE_LOOKS, REST_S, END_S = 0.1, 5, 30.0, 60.0
TICKS = os.sysconf("SC_CLK_TCK")


def record(load: Load, folder: Path) -> Taken:
    """The load through `rosbag record` into `folder/load.bag`, with what it buffers and asks for by default."""
    bag = folder / "load.bag"
    bag.unlink(missing_ok=True)
    with master(folder) as env:
        argv = [_recorder(), "-O", str(bag), *(f"{PREFIX}{number}" for number in range(load.topics))]
        recorder = subprocess.Popen(argv, env=env, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            with running([require_ros().python, str(PUBLISHER), load.argument], env) as publisher:
                line = publisher.stdout.readline() if publisher.stdout else ""
                told = publisher_told([line])
                _await_rest(recorder.pid)
                cpu_s = _ended(recorder)
        finally:
            recorder.kill()
            recorder.wait()
    with Reader(bag) as reader:
        recorded = reader.message_count
    return Taken(
        sent=int(told["sent"]),
        recorded=recorded,
        told_dropped=0,
        late_s=told["end_s"] - told["begin_s"] - load.seconds,
        behind_s=None,
        sent_hz=told["mean_hz"],
        cpu_s=cpu_s,
    )


def is_there() -> bool:
    return _find() is not None


def _recorder() -> str:
    found = _find()
    if found is None:
        raise NotMeasured("rosbag's `record` is not installed")
    return found


def _find() -> str | None:
    """The program itself: `rosbag record` is a script in front of it."""
    places = [Path(prefix) / name for prefix in ("/", *require_ros().prefixes) for name in RECORDERS]
    return next((str(place) for place in places if place.is_file()), None)


def _await_rest(pid: int) -> None:
    """Until it has nothing left to do."""
    until_s, before, idle = time.monotonic() + REST_S, -1, 0
    while idle < IDLE_LOOKS and time.monotonic() < until_s:
        now = _ticks(pid)
        idle = idle + 1 if now - before <= 1 else 0
        before = now
        time.sleep(LOOK_S)


def _ticks(pid: int) -> int:
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return int(fields[11]) + int(fields[12])


def _ended(recorder: subprocess.Popen[bytes]) -> float:
    """Ctrl-C: it writes its index and ends. CPU seconds of all its life."""
    recorder.send_signal(signal.SIGINT)
    until_s = time.monotonic() + END_S
    while time.monotonic() < until_s:
        pid, _, usage = os.wait4(recorder.pid, os.WNOHANG)
        if pid:
            recorder.returncode = 0
            return usage.ru_utime + usage.ru_stime
        time.sleep(LOOK_S)
    raise NotMeasured("rosbag record did not end")
