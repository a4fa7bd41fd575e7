"""What of the machine's load is the run's own, as the arena counts it."""

from __future__ import annotations

import os
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import pytest

from grader.evidence.run import Run
from tests.arena.support import exit_of, run_script

pytestmark = pytest.mark.ros
TALKER = """
rospy.init_node('node')
pub = rospy.Publisher('chatter', Int32, queue_size=10)
rate = rospy.Rate(10)
while not rospy.is_shutdown():
    pub.publish(1)
    rate.sleep()
"""
IMPORTS = "import multiprocessing, os, rospy, subprocess, threading\nfrom std_msgs.msg import Int32\n"
LASTING = """
def burn():
    while True:
        pass
for _ in range(3):
    multiprocessing.Process(target=burn, daemon=True).start()
"""
SHORT = """
def burn():
    while True:
        subprocess.run(['/bin/sh', '-c', 'i=0; while [ $i -lt 20000 ]; do i=$((i+1)); done'])
for _ in range(3):
    threading.Thread(target=burn, daemon=True).start()
"""
DAEMONS = """
def burn():
    while True:
        subprocess.run(['/bin/sh', '-c', '(i=0; while [ $i -lt 20000 ]; do i=$((i+1)); done; echo) &'],
            stdout=subprocess.PIPE)
for _ in range(3):
    threading.Thread(target=burn, daemon=True).start()
"""
OTHERS = "import sys\nwhile True: pass\n"


def counted_s(seen: Run) -> float:
    """CPU seconds, by what the events say of shares."""
    cores = os.cpu_count() or 1
    shares = zip(pairwise(t for t, _ in seen.host), (e.own_busy for _, e in seen.host[1:]), strict=True)
    return sum((after - before) / 1e9 * (own or 0) * cores for (before, after), own in shares)


@pytest.mark.full
@pytest.mark.parametrize(
    ("load", "sandbox"),
    [(LASTING, "auto"), (LASTING, "none"), (SHORT, "auto"), (SHORT, "none"), (DAEMONS, "auto")],
    ids=["lasting", "lasting-none", "short", "short-none", "daemons"],
)
def test_all_that_the_run_uses_is_its_own(tmp_path: Path, load: str, sandbox: str) -> None:
    """Whatever else the machine does: as much as the kernel says when all of them have ended."""
    seen = run_script(tmp_path, IMPORTS + load + TALKER, window_s=4, topics=("/chatter",), sandbox=sandbox)
    used_s = exit_of(seen).cpu_s
    assert used_s > 1
    assert counted_s(seen) == pytest.approx(used_s, rel=0.15, abs=0.3)


def test_what_others_use_is_not_its_own(tmp_path: Path) -> None:
    others = [subprocess.Popen([sys.executable, "-c", OTHERS]) for _ in range(os.cpu_count() or 1)]
    try:
        seen = run_script(tmp_path, IMPORTS + TALKER, window_s=3, topics=("/chatter",))
    finally:
        for other in others:
            other.kill()
            other.wait()
    assert counted_s(seen) == pytest.approx(exit_of(seen).cpu_s, abs=0.3)
    last = [e for _, e in seen.host][-4:-1]
    assert all(e.busy - e.own_busy > 0.5 for e in last), last
