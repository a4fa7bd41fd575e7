"""Times the whole Leeds lab beside `rostest` with `hztest`, in one run: `make bench`.

Prints a Markdown table and, with `--write`, puts it into benchmarks/README.md.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from datetime import datetime, timezone
from pathlib import Path

from grader.evidence.reader import load_evidence

ROOT = Path(__file__).resolve().parent.parent
LAB = "leeds-comp3631-lab1"
SOLUTION = ROOT / "reference_solutions" / LAB
GRADER = [sys.executable, "-m", "grader"]
START, END = "<!-- figures begin -->\n", "<!-- figures end -->\n"
HZTEST = """<launch>
  <node pkg="lab1" type="numeric_talker.py" name="talker"/>
  <test test-name="chatter" pkg="rostest" type="hztest" name="chatter">
    <param name="topic" value="/chatter"/>
    <param name="hz" value="10.0"/>
    <param name="hzerror" value="0.5"/>
    <param name="test_duration" value="5.0"/>
  </test>
</launch>
"""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--times", type=int, default=5)
    parser.add_argument("--write", action="store_true")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        workspace = _workspace(folder)
        graded, tested, judged = [], [], []
        for number in range(options.times):
            graded.append(_grade(folder / str(number)))
            tested.append(_rostest(workspace))
            judged.append(_judge(folder / str(number)))
    text = _table(graded, tested, judged)
    print(text)
    if options.write:
        _write(text)
    return 0


def _grade(out: Path) -> dict[str, float]:
    argv = [*GRADER, "grade", str(SOLUTION), "--rubric", LAB, "--out", str(out)]
    wall_s, cpu_s = _timed(argv)
    result = json.loads((out / LAB / "result.json").read_text())
    if result["points"] != 100:
        raise SystemExit(f"the reference solution got {result['points']} points: nothing to measure")
    arenas = [
        event.max_rss_bytes / 1e6
        for run in load_evidence([out / LAB / "evidence"]).values()
        for _, event in run.processes
        if event.name == "arena"
    ]
    timing = result["timing"]
    return {
        "wall_s": wall_s,
        "all_cpu_s": cpu_s,
        "cpu_s": timing["cpu_s"],
        "student_cpu_s": timing["student_cpu_s"],
        "build_cpu_s": _build_cpu_s(out / LAB / "evidence"),
        "arena_mb": max(arenas),
    }


def _build_cpu_s(evidence: Path) -> float:
    events = [event for _, event in load_evidence([evidence])["package"].processes]
    return sum(e.cpu_s for e in events if e.role == "build" and e.event == "exit")


def _judge(out: Path) -> dict[str, float]:
    wall_s, cpu_s = _timed(
        [*GRADER, "judge", str(out / LAB / "evidence"), "--rubric", LAB, "--out", os.devnull]
    )
    return {"wall_s": wall_s, "all_cpu_s": cpu_s}


def _rostest(workspace: Path) -> dict[str, float]:
    script = "source devel/setup.bash && exec rostest lab1 hz.test"
    wall_s, cpu_s = _timed(["/bin/bash", "-c", script], cwd=workspace, env=_ros_env(workspace))
    return {"wall_s": wall_s, "all_cpu_s": cpu_s}


def _workspace(folder: Path) -> Path:
    """The reference solution, built once, with one rate check as a rostest."""
    workspace = folder / "ws"
    package = workspace / "src" / "lab1"
    shutil.copytree(SOLUTION / "lab1", package)
    (package / "test").mkdir()
    (package / "test" / "hz.test").write_text(HZTEST)
    for script in package.glob("src/*.py"):
        script.write_text(script.read_text().replace("env python\n", "env python3\n"))
    subprocess.run(
        ["/usr/bin/catkin_make"], cwd=workspace, env=_ros_env(folder), check=True, stdout=subprocess.DEVNULL
    )
    return workspace


def _ros_env(home: Path) -> dict[str, str]:
    return {"PATH": "/usr/bin:/bin", "HOME": str(home), "ROS_HOSTNAME": "localhost", "LANG": "C.UTF-8"}


def _timed(argv: list[str], **how: object) -> tuple[float, float]:
    """Wall seconds, and CPU seconds of the process with all its children."""
    before, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
    done = subprocess.run(argv, capture_output=True, text=True, check=False, **how)  # type: ignore[call-overload]
    wall_s, after = time.monotonic() - began, resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode != 0:
        raise SystemExit(f"{argv[:4]} ended with {done.returncode}: {done.stderr[-400:]}{done.stdout[-400:]}")
    return wall_s, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def _table(
    graded: list[dict[str, float]], tested: list[dict[str, float]], judged: list[dict[str, float]]
) -> str:
    ratio = [g["wall_s"] / t["wall_s"] for g, t in zip(graded, tested, strict=True)]
    own = [g["cpu_s"] / (g["student_cpu_s"] - g["build_cpu_s"]) for g in graded]
    rows = [
        ("whole lab, wall", "s", [g["wall_s"] for g in graded]),
        ("whole lab, the grader's own CPU", "s", [g["cpu_s"] for g in graded]),
        (
            "whole lab, CPU of the student's processes",
            "s",
            [g["student_cpu_s"] - g["build_cpu_s"] for g in graded],
        ),
        ("whole lab, CPU of the build", "s", [g["build_cpu_s"] for g in graded]),
        ("the grader's own CPU / the student's processes", "", own),
        ("memory of the largest arena", "MB", [g["arena_mb"] for g in graded]),
        ("judging the evidence again, wall", "s", [j["wall_s"] for j in judged]),
        ("`rostest` with `hztest`, one rate check, wall", "s", [t["wall_s"] for t in tested]),
        ("`rostest` with `hztest`, one rate check, CPU", "s", [t["all_cpu_s"] for t in tested]),
        ("wall of the whole lab / wall of one `rostest`", "", ratio),
    ]
    lines = ["| what | unit | median | least | most |", "|---|---|---|---|---|"]
    lines += [
        f"| {what} | {unit} | {statistics.median(v):.2f} | {min(v):.2f} | {max(v):.2f} |"
        for what, unit, v in rows
    ]
    return f"{_machine(len(graded))}\n\n" + "\n".join(lines) + "\n"


def _machine(times: int) -> str:
    lines = Path("/proc/cpuinfo").read_text().splitlines()
    cpu = next((line.split(":")[1].strip() for line in lines if line.startswith("model name")), "?")
    day = datetime.now(timezone.utc).date().isoformat()
    return (
        f"{day}, {os.cpu_count()} cores ({cpu}), Linux {platform.release()}, Python {platform.python_version()}, "
        f"{times} runs of each in turn, load {os.getloadavg()[0]:.1f} at the end."
    )


def _write(text: str) -> None:
    path = Path(__file__).parent / "README.md"
    before, _, rest = path.read_text().partition(START)
    path.write_text(f"{before}{START}\n{text}\n{END}{rest.partition(END)[2]}")


if __name__ == "__main__":
    sys.exit(main())
