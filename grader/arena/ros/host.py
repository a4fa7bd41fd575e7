"""How late this machine wakes a thread that asked for 20 ms: a measure of whether a rate may be judged."""

import os
import threading
import time

from tree import TICKS_HZ

SLEEP_S = 0.02
REPORT_S = 0.5


def peak_bytes():
    """Of this process alone: what `getrusage` says holds its parent's, too (man 5 proc)."""
    with open("/proc/self/status") as file:
        found = [line.split()[1] for line in file if line.startswith("VmHWM:")]
    return int(found[0]) * 1024 if found else 0


def processor_ticks():
    """(busy, all) of all processors since the machine started (man 5 proc_stat)."""
    with open("/proc/stat") as file:
        user, nice, system, idle, iowait, *rest = [int(word) for word in file.readline().split()[1:9]]
    busy = user + nice + system + sum(rest)
    return busy, busy + idle + iowait


class Lateness:
    """`used_s` gives the CPU seconds that the student's processes have used so far, ended ones included."""

    def __init__(self, wire, used_s):
        self._wire = wire
        self._used_s = used_s
        self._own_s = 0.0
        self._stopping = False
        self._ticks = processor_ticks()
        self._thread = threading.Thread(target=self._run, daemon=True)

    def start(self):
        self._thread.start()

    def stop(self):
        self._stopping = True
        self._thread.join()

    def _run(self):
        late_ms = []
        report_at = time.monotonic() + REPORT_S
        after = time.monotonic()
        while not self._stopping:
            before = after
            time.sleep(SLEEP_S)
            after = time.monotonic()
            late_ms.append(max(0.0, (after - before - SLEEP_S) * 1e3))
            if self._stopping or after >= report_at:
                self._report(late_ms)
                late_ms = []
                # to look at many processes takes time, and is not the machine's lateness
                after = time.monotonic()
                report_at = after + REPORT_S

    def _report(self, late_ms):
        late_ms.sort()
        (busy_before, all_before), self._ticks = self._ticks, processor_ticks()
        busy, ticks = self._ticks
        before_s, self._own_s = self._own_s, self._used_s()
        all_ticks = max(1, ticks - all_before)
        share = (busy - busy_before) / all_ticks
        own = (self._own_s - before_s) * TICKS_HZ / all_ticks
        record = {
            "samples": len(late_ms),
            "mean_ms": round(sum(late_ms) / len(late_ms), 3),
            "p95_ms": round(late_ms[int(0.95 * (len(late_ms) - 1))], 3),
            "max_ms": round(late_ms[-1], 3),
            "load_1min": round(os.getloadavg()[0], 2),
            "busy": round(share, 3),
            "own_busy": round(min(max(0.0, own), share), 3),
        }
        self._wire.event("/grader/host", record)
