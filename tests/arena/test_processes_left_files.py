"""Files that a run leaves become evidence: real runs in the sandbox."""

from __future__ import annotations

from pathlib import Path

import pytest

from grader.arena.limits import RunLimits
from grader.evidence.run import LeftFile, Run
from grader.rubric.scenario import Scenario
from tests.arena.support import SCRIPT, exit_of, make_place, needs_sandbox, run

pytestmark = [pytest.mark.ros, needs_sandbox]
WRITES = """
import os, signal, subprocess, sys
package = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))

def write(path, text="x"):
    os.makedirs(os.path.dirname(path) or ".", exist_ok=True)
    with open(path, "w") as file:
        file.write(text)

"""


def record(tmp_path: Path, code: str, *keeps: str, limits: RunLimits | None = None, **files: str) -> Run:
    """Run the code, and keep what fits."""
    scenario = Scenario.model_validate(
        {
            "title": "test",
            "start": [{"name": "node", "script": "src/node.py"}],
            "until": {"ended": ["node"], "limit_s": 30},
            "keeps": keeps,
        }
    )
    with make_place({"src/node.py": SCRIPT + WRITES + code, **files}, limits=limits) as place:
        return run(place, scenario, tmp_path / "run.mcap")


def kept(run: Run) -> dict[str, bytes | None]:
    return {file.path: file.data for file in run.left_files}


def test_files_of_every_writable_place_are_evidence(tmp_path: Path) -> None:
    code = """
write("run.csv", "t,x\\n0,1\\n")
write(".ros/run.csv", "a")
write(package + "/results/run.csv", "b")
write("/tmp/run.csv", "c")
write(package + "/handed_in.csv", "the same")
write(package + "/changed.csv", "after")
write("notes.txt", "not kept")
write(".cache/run.csv"), write(".ros/log/run.csv")
"""
    files = {"handed_in.csv": "the same", "changed.csv": "before"}
    found = record(tmp_path, code, "*.csv", **files)
    assert kept(found) == {
        "~/.ros/run.csv": b"a",
        "~/catkin_ws/src/lab/changed.csv": b"after",
        "~/catkin_ws/src/lab/results/run.csv": b"b",
        "~/notes.txt": None,
        "~/run.csv": b"t,x\n0,1\n",
        "/tmp/run.csv": b"c",
    }
    assert LeftFile("node", "~/run.csv", 8, b"t,x\n0,1\n") in found.left_files


def test_what_is_left_is_only_data(tmp_path: Path) -> None:
    """Links, pipes, devices, deep folders and names in any bytes: nothing is followed, waited for or refused."""
    code = """
os.symlink("/etc/passwd", "passwd.csv")
os.symlink("/etc", "etc")
os.mkfifo("pipe.csv")
os.symlink("/dev/zero", "zero.csv")
write("secret.csv", "s"); os.chmod("secret.csv", 0)
write(b"caf\\xe9.csv")
write("evil\\n.csv")
os.makedirs("deep/" + "d/" * 30)
write("deep/" + "d/" * 30 + "x.csv")
"""
    found = kept(record(tmp_path, code, "*.csv"))
    assert {"~/evil\n.csv", "~/caf\ufffd.csv"} <= found.keys()
    assert not {
        path for path in found if "passwd" in path or "pipe" in path or "zero" in path or "etc" in path
    }
    assert not [path for path in found if path.startswith("~/deep")]


def test_kept_files_are_limited(tmp_path: Path) -> None:
    code = """
for number in range(200):
    write("n%03d.csv" % number, "x" * 100)
write("a_large.csv", "x" * 5000)
"""
    found = record(tmp_path, code, "*.csv", limits=RunLimits(kept_bytes=1000, kept_files=5))
    assert len([data for data in kept(found).values() if data is not None]) == 5
    assert len(found.left_files) == 55
    assert found.left_files[0] == LeftFile("node", "~/a_large.csv", 5000, None)


def test_a_recording_is_kept_whole_or_as_it_was_left(tmp_path: Path) -> None:
    """The bag is closed by Ctrl-C; one whose rosbag is killed is left as it is, with the tree that is killed."""
    code = """
import rospy
rospy.init_node("node")
def start(name):
    return subprocess.Popen(["rosbag", "record", "-O", name, "/rosout"], start_new_session=True)

bags = [start("whole"), start("killed")]
while not (os.path.exists("whole.bag.active") and os.path.exists("killed.bag.active")):
    rospy.rostime.wallsleep(0.05)
rospy.loginfo("here")
rospy.rostime.wallsleep(0.5)
os.killpg(bags[1].pid, signal.SIGKILL)
os.killpg(bags[0].pid, signal.SIGINT)
bags[0].wait()
"""
    found = record(tmp_path, code, "*.bag")
    left = {file.path: file for file in found.left_files}
    assert left["~/whole.bag"].recording().channels[0].topic == "/rosout"
    assert left["~/killed.bag.active"].data is None


def test_a_process_that_is_started_again_finds_its_files_and_their_last_state_is_kept(tmp_path: Path) -> None:
    code = """
write("gone.csv") if not os.path.exists("run.csv") else os.remove("gone.csv")
with open("run.csv", "a") as file:
    file.write("life\\n")
while True:
    signal.pause()
"""
    scenario = Scenario.model_validate(
        {
            "title": "test",
            "start": [{"name": "node", "script": "src/node.py"}, {"name": "other", "script": "src/node.py"}],
            "steps": [{"wait": {"seconds": 1.5}}, {"restart": "node"}, {"wait": {"seconds": 1.5}}],
            "keeps": ["*.csv"],
        }
    )
    with make_place({"src/node.py": SCRIPT + WRITES + code}) as place:
        found = run(place, scenario, tmp_path / "run.mcap")
    left = {(file.process, file.path): file.data for file in found.left_files}
    assert left == {
        ("node", "~/run.csv"): b"life\nlife\n",
        ("other", "~/run.csv"): b"life\n",
        ("other", "~/gone.csv"): b"x",
    }


def test_files_of_a_tree_that_is_killed_are_kept(tmp_path: Path) -> None:
    code = """
write("run.csv")
signal.signal(signal.SIGINT, signal.SIG_IGN), signal.signal(signal.SIGTERM, signal.SIG_IGN)
while True:
    signal.pause()
"""
    scenario = Scenario.model_validate(
        {
            "title": "test",
            "start": [{"name": "node", "script": "src/node.py"}],
            "steps": [{"wait": {"seconds": 1.5}}, {"kill": "node"}],
            "keeps": ["*.csv"],
        }
    )
    with make_place({"src/node.py": SCRIPT + WRITES + code}) as place:
        found = run(place, scenario, tmp_path / "run.mcap")
    assert exit_of(found).stopped_by == "KILL"  # type: ignore[attr-defined]
    assert kept(found) == {"~/run.csv": b"x"}
