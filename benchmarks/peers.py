"""The whole lab by the grader, and in turn with it the ways in which courses check nodes without one."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from benchmarks.accuracy import AVERAGE
from benchmarks.figures import Found, NotMeasured, Options, mid, table
from benchmarks.gradings import LAB, SOLUTION, folder_for
from benchmarks.machine import Cost, Meter, timed
from benchmarks.ros import (
    hztest,
    hztest_workspace,
    master,
    program,
    require_ros,
    running,
)

TIMES = 5
RECORD_S, SLEEP_S, END_S = 5.0, 10.0, 5.0
TOPIC, RATE_HZ = "/chatter", 10.0
READ_BAG = """
import rosbag, sys
times = [time.to_sec() for _, _, time in rosbag.Bag(sys.argv[1]).read_messages(sys.argv[2])]
print((len(times) - 1) / (times[-1] - times[0]))
"""
TALKER, LISTENER, LAUNCH = "numeric_talker.py", "numeric_listener.py", "lab1.launch"
GRADER = (sys.executable, "-m", "grader", "grade", str(SOLUTION), "--rubric", LAB, "--out")


def measure(options: Options) -> Found:
    times = options.times or TIMES
    with folder_for("peers", options) as folder:
        package = SOLUTION / "lab1"
        workspace = hztest_workspace(folder, package, TALKER)
        peers: dict[str, Callable[[], Cost]] = {
            "`rostest` with `hztest`: one rate, built already": lambda: hztest(workspace),
            "`rosbag record` and a script: one rate, built already": lambda: _bag(workspace),
            "`rostopic hz`, asked until it says a rate: one rate, built already": lambda: _poll(workspace),
            "a loop with sleeps of 10 s: build, talker, listener, launch file": lambda: _loop(folder),
        }
        timed([*GRADER, str(folder / "first")])  # what later gradings share is made now
        ours: list[Cost] = []
        theirs: dict[str, list[Cost]] = {name: [] for name in peers}
        for turn in range(times):
            ours.append(timed([*GRADER, str(folder / f"out-{turn}")]))
            for name, peer in peers.items():
                theirs[name].append(peer())
    rows = [_row("the grader: the whole lab", ours, ours), *(_row(n, c, ours) for n, c in theirs.items())]
    header = ["checked by", "wall, s", "CPU, s", "wall of the grader / this", "CPU of the grader / this"]
    return Found(runs=f"{times} runs of each in turn", tables=(table(header, rows),))


def _row(name: str, costs: list[Cost], ours: list[Cost]) -> list[str]:
    pairs = list(zip(ours, costs, strict=True))
    return [
        name,
        mid([cost.wall_s for cost in costs]),
        mid([cost.cpu_s for cost in costs]),
        mid([own.wall_s / cost.wall_s for own, cost in pairs]),
        mid([own.cpu_s / cost.cpu_s for own, cost in pairs]),
    ]


def _bag(workspace: Path) -> Cost:
    """As in a script for one submission: record for some seconds, then read the file."""
    meter, bag = Meter(), workspace / "run.bag"
    with _node(workspace, "rosrun", "lab1", TALKER) as env:
        timed([program("rosbag"), "record", f"--duration={RECORD_S:g}", "-O", str(bag), TOPIC], env=env)
        rate = timed([require_ros().python, "-c", READ_BAG, str(bag), TOPIC], env=env).text
    return _cost(meter, float(rate))


def _poll(workspace: Path) -> Cost:
    """As a check in a notebook or a web platform does it: look once a second, until there is something to see."""
    meter = Meter()
    with (
        _node(workspace, "rosrun", "lab1", TALKER) as env,
        running([program("rostopic"), "hz", TOPIC], env) as hz,
    ):
        if hz.stdout is None:
            raise NotMeasured("no pipe")
        averages = (AVERAGE.search(line) for line in hz.stdout)
        found = next((float(average[1]) for average in averages if average), None)
    return _cost(meter, found)


def _loop(folder: Path) -> Cost:
    """As a script for a class does it for each submission: start, sleep, look, kill."""
    meter, workspace = Meter(), folder / "loop"
    shutil.rmtree(workspace, ignore_errors=True)
    hztest_workspace(workspace, SOLUTION / "lab1", TALKER)
    with (
        _node(workspace / "ws", "rosrun", "lab1", TALKER) as env,
        running([program("rostopic"), "hz", TOPIC], env) as hz,
    ):
        time.sleep(SLEEP_S)
        hz.terminate()
        averages = AVERAGE.findall(hz.stdout.read() if hz.stdout else "")
    for words in (("rosrun", "lab1", LISTENER), ("roslaunch", "lab1", LAUNCH)):
        with _node(workspace / "ws", *words):
            time.sleep(SLEEP_S)
    return _cost(meter, float(averages[-1]) if averages else None)


def _cost(meter: Meter, rate_hz: float | None) -> Cost:
    if rate_hz is None or abs(rate_hz - RATE_HZ) > 1:
        raise NotMeasured(f"a correct talker of {RATE_HZ:g} Hz was seen at {rate_hz} Hz")
    return Cost(wall_s=meter.wall_s(), cpu_s=meter.children_cpu_s())


@contextmanager
def _node(workspace: Path, *words: str) -> Iterator[dict[str, str]]:
    """A node of the workspace under a master of its own, ended by Ctrl-C; the environment for who looks at it."""
    argv = ["/bin/bash", "-c", 'source devel/setup.bash && exec "$@"', "bash", *words]
    with master(workspace) as env:
        node = subprocess.Popen(
            argv,
            env=env,
            cwd=workspace,
            start_new_session=True,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        try:
            yield env
            os.killpg(node.pid, signal.SIGINT)
            # a Ctrl-C during `rospy.loginfo` can lock a node up for ever
            with suppress(subprocess.TimeoutExpired):
                node.wait(END_S)
        finally:
            with suppress(ProcessLookupError):
                os.killpg(node.pid, signal.SIGKILL)
            node.wait()
