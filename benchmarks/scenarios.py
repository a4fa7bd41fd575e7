"""How long a scenario runs that a faulty package cannot fulfil, beside the correct package's."""

from __future__ import annotations

import shutil
import statistics
import sys
from pathlib import Path
from typing import NamedTuple

from benchmarks.figures import Found, NotMeasured, Options, mid, table
from benchmarks.gradings import ROOT, folder_for
from benchmarks.machine import timed
from grader.evidence.reader import load_run

TIMES = 3
NS = 1_000_000_000
GRADER = (sys.executable, "-m", "grader")
ASKED = 1.5
LOCKED = "    lock = __import__('threading').Lock()\n    lock.acquire()\n    lock.acquire()\n"
ENDLESS = "    while True:\n        pass\n"


class Fault(NamedTuple):
    """A line of a script of the reference solution that is another one, and the scenario that shows it."""

    what: str
    lab: str
    scenario: str
    script: str
    right: str
    wrong: str


YORK, TF, SCAN, OWN = "york-ele00118m-lab7", "tf-broadcaster", "scan-to-cmd-vel", "service-own-type"
SENDER, RECEIVER = "lab_exercises/scripts/sender.py", "lab_exercises/scripts/receiver.py"
FRAMES, STOP = "robot_frames/scripts/frames.py", "scan_to_cmd_vel/scripts/stop.py"
CLIENT, SERVER = "adder/scripts/add_client.py", "own_service/scripts/server.py"
DRIVER, COUNT = "go_to_goal/scripts/go_to_goal.py", "counting/scripts/count.py"
RECORD = "walk_log/launch/record.launch"
TYPE = "import String\n"
ADD = "    rospy.wait_for_service('/add')\n"
AGAIN = """        try:
            rospy.wait_for_service('/sum', timeout=1)
            break
        except rospy.ROSException:
            rospy.logwarn('not yet')
"""
POLLING = """    import rosservice
    while '/sum' not in rosservice.get_service_list():
        rospy.sleep(0.5)
"""
FAULTS = (
    Fault("an exception in a listener's callback", YORK, "receiver", RECEIVER, "data.data", "data.dat"),
    Fault("a listener of another type", YORK, "receiver", RECEIVER, TYPE, "import Int32 as String\n"),
    Fault("a loop in which nothing publishes", YORK, "sender", SENDER, "        pub.publish(message)\n", ""),
    Fault("an endless loop after `init_node`", YORK, "sender", SENDER, "    rate =", f"{ENDLESS}    rate ="),
    Fault("an exception before a callback publishes", SCAN, "walls", STOP, "scan.ranges", "scan.range"),
    Fault("another topic of the answer", SCAN, "walls", STOP, "'/cmd_vel'", "'/cmd_val'"),
    Fault("a client of another service", "service-client", "adds", CLIENT, "'/add'", "'/sum'"),
    Fault(
        "a service that never answers",
        OWN,
        "server",
        SERVER,
        "    result =",
        f"{ENDLESS}    result =",
    ),
    Fault(
        "a service that sleeps", OWN, "server", SERVER, "    result =", "    rospy.sleep(60)\n    result ="
    ),
    Fault("a server of another name", OWN, "client", SERVER, "Service('/clamp'", "Service('/clamps'"),
    Fault("a listener that prints nothing", YORK, "receiver", RECEIVER, "rospy.loginfo(", "str("),
    Fault(
        "a callback that never ends",
        YORK,
        "receiver",
        RECEIVER,
        "    rospy.loginfo",
        f"{ENDLESS}    rospy.loginfo",
    ),
    Fault("a lock that is taken twice", YORK, "sender", SENDER, "    rate =", f"{LOCKED}    rate ="),
    Fault("a node that dies", YORK, "sender", SENDER, "        rate.sleep()", "        raise KeyError"),
    Fault("a topic of the goal's", "go-to-goal", "goals", DRIVER, "'/goal'", "'/target'"),
    Fault("an action of another name", "action-server", "goals", COUNT, "'/count'", "'/counter'"),
    Fault(
        "a goal that never ends", "action-server", "goals", COUNT, "while total < goal.target", "while True"
    ),
    Fault(
        "a cancel that is ignored",
        "action-server",
        "goals",
        COUNT,
        "if self.server.is_preempt_requested()",
        "if False",
    ),
    Fault(
        "an action without a result",
        "action-server",
        "goals",
        COUNT,
        "        self.server.set_succeeded(",
        "        rospy.spin()\n        self.server.set_succeeded(",
    ),
    Fault("a client that asks again", "service-client", "adds", CLIENT, ADD, f"    while True:\n{AGAIN}"),
    Fault("a client that polls the list", "service-client", "adds", CLIENT, ADD, POLLING),
    Fault(
        "a recording of nothing", "record-and-replay", "record", RECORD, "walk.bag /steps", "walk.bag /walk"
    ),
    Fault(
        "transforms that are never sent",
        TF,
        "frames",
        FRAMES,
        "        self.moving.sendTransform(base)\n",
        "",
    ),
)


def measure(options: Options) -> Found:
    times = options.times or TIMES
    correct_s: dict[tuple[str, str], list[float]] = {(f.lab, f.scenario): [] for f in FAULTS}
    faulty_s: dict[Fault, list[float]] = {fault: [] for fault in FAULTS}
    with folder_for("scenarios", options) as folder:
        for turn in range(times):
            for lab in dict.fromkeys(fault.lab for fault in FAULTS):
                own = [fault for fault in FAULTS if fault.lab == lab]
                scenarios = {fault.scenario for fault in own}
                found = _durations_s(lab, lab, ROOT / "reference_solutions" / lab, folder / f"{turn}-{lab}")
                for name in scenarios:
                    correct_s[lab, name].append(found[name])
                for number, fault in enumerate(own):
                    out = folder / f"{turn}-{lab}-{number}"
                    package = _faulty(fault, out / "package")
                    faulty_s[fault].append(_durations_s(lab, fault.what, package, out)[fault.scenario])
    rows = [_row(fault, faulty_s[fault], correct_s[fault.lab, fault.scenario]) for fault in FAULTS]
    header = ["fault", "scenario", "correct, s", "faulty, s", f"faulty / correct (asked: at most {ASKED:g})"]
    return Found(runs=f"medians of {times}, in turn", tables=(table(header, rows),))


def _row(fault: Fault, faulty_s: list[float], correct_s: list[float]) -> list[str]:
    ratio = statistics.median(faulty_s) / statistics.median(correct_s)
    where = f"`{fault.lab}`, `{fault.scenario}`"
    return [fault.what, where, mid(correct_s), mid(faulty_s), f"{ratio:.2f}"]


def _faulty(fault: Fault, folder: Path) -> Path:
    shutil.copytree(ROOT / "reference_solutions" / fault.lab, folder)
    script = folder / fault.script
    text = script.read_text()
    if fault.right not in text:
        raise NotMeasured(f"{fault.script} has no {fault.right.strip()!r}")
    script.write_text(text.replace(fault.right, fault.wrong))
    return folder


def _durations_s(lab: str, what: str, package: Path, out: Path) -> dict[str, float]:
    """Record the package, and return how long each scenario ran."""
    timed([*GRADER, "record", str(package), "--rubric", lab, "--out", str(out / "recorded")])
    found = {}
    for path in out.glob("recorded/*/evidence/*.mcap"):
        course = load_run(path).course
        if course:
            found[path.stem] = (course[-1][0] - course[0][0]) / NS
    if not found:
        raise NotMeasured(f"{what}: nothing was recorded")
    return found
