"""What a student's process prints, how it ends, and what it can reach."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from grader.arena.limits import RunLimits
from grader.arena.sandbox import why_no_sandbox
from grader.rubric.scenario import Scenario, Start, Until
from tests.arena.support import exit_of, make_place, printed, run_script
from tests.arena.support import run as record

pytestmark = pytest.mark.ros
SANDBOXES = ["auto", pytest.param("none", marks=pytest.mark.full)]
NODE = "import rospy, sys, os, time\nrospy.init_node('node')\n"
UP = (
    "from std_msgs.msg import Empty\nup = rospy.Publisher('up', Empty, latch=True, queue_size=1)\n"
    "up.publish()\nrospy.spin()\n"
)
needs_sandbox = pytest.mark.skipif(bool(why_no_sandbox()), reason=f"no sandbox here: {why_no_sandbox()}")


@pytest.mark.parametrize("sandbox", SANDBOXES)
def test_print_without_flush_is_seen_by_line_and_time(tmp_path: Path, sandbox: str) -> None:
    code = NODE + "print('one')\ntime.sleep(0.5)\nsys.stdout.write('two')\nsys.stderr.write('three\\n')\n"
    run = run_script(tmp_path, code, ended=["node"], sandbox=sandbox)
    lines = {line.line: (time_ns, line.stream) for time_ns, line in run.lines("node")}
    assert lines["three"][1] == "stderr"
    assert lines["three"][0] - lines["one"][0] > 0.4e9
    assert "two" in lines


@pytest.mark.parametrize("sandbox", SANDBOXES)
def test_ctrl_c_ends_a_node(tmp_path: Path, sandbox: str) -> None:
    run = run_script(tmp_path, NODE + UP + "print('ended well')\n", messages={"/up": 1}, sandbox=sandbox)
    ended = exit_of(run)
    assert (ended.exit_code, ended.stopped_by) == (0, "INT")
    assert ended.cpu_s > 0.05
    assert ended.max_rss_bytes > 10 << 20
    assert printed(run)[-1] == "ended well"


def test_a_launched_node_has_time_to_tidy_up(tmp_path: Path) -> None:
    """It ends by Ctrl-C, which roslaunch hands on, though it computes for longer behind it than a script may."""
    tidies = "    end = time.process_time() + 1.3\n    while time.process_time() < end: pass\n"
    code = NODE + f"def tidy():\n{tidies}    print('tidied up')\nrospy.on_shutdown(tidy)\n{UP}"
    launch = '<launch><node name="node" pkg="lab" type="node.py" output="screen"/></launch>'
    files = {"launch/up.launch": launch, "scripts/node.py": "#!/usr/bin/env python3\n" + code}
    start = (Start(name="up", launch="up.launch"),)
    scenario = Scenario(title="tidy", start=start, until=Until(messages={"/up": 1}, limit_s=20))
    with make_place(files) as place:
        recorded = record(place, scenario, tmp_path / "run.mcap")
    assert "tidied up" in printed(recorded, "up")
    assert exit_of(recorded, "up").stopped_by == "INT"


@pytest.mark.full
@pytest.mark.parametrize("sandbox", SANDBOXES)
def test_node_that_ignores_ctrl_c_is_killed(tmp_path: Path, sandbox: str) -> None:
    code = (
        "import signal, time\nfor n in (2, 15): signal.signal(n, signal.SIG_IGN)\nwhile True: time.sleep(1)\n"
    )
    assert exit_of(run_script(tmp_path, code, limit_s=0.5, sandbox=sandbox)).stopped_by == "KILL"


@pytest.mark.parametrize("sandbox", SANDBOXES)
def test_input_is_at_its_end(tmp_path: Path, sandbox: str) -> None:
    run = run_script(tmp_path, "input('your name? ')\n", limit_s=10, sandbox=sandbox)
    assert any("EOFError" in line for line in printed(run))
    assert run.outcome.outcome == "ended"


@pytest.mark.parametrize("sandbox", SANDBOXES)
def test_nothing_outlives_the_run(tmp_path: Path, sandbox: str) -> None:
    marker = f"grader-test-{os.getpid()}-{sandbox}"
    code = (
        "import subprocess, time\n"
        f"subprocess.Popen(['/bin/sh', '-c', 'exec -a {marker} sleep 300 || sleep 300; : {marker}'],"
        " start_new_session=True)\n"
        f"subprocess.Popen(['python3', '-c', 'import time; time.sleep(300)', '{marker}'], start_new_session=True)\n"
        "print('started')\ntime.sleep(300)\n"
    )
    run = run_script(tmp_path, code, limit_s=1, sandbox=sandbox)
    assert printed(run) == ["started"] or "started" in printed(run)
    assert marker not in _command_lines()


@needs_sandbox
def test_the_machine_is_out_of_sight(tmp_path: Path) -> None:
    secret = tmp_path / "secret"
    secret.write_text("marks")
    secret.chmod(0o644)
    code = f"""
import os, socket
for path in ({str(secret)!r}, "/etc/shadow", "/root", "/home/student/../other"):
    try:
        os.listdir(path) if os.path.isdir(path) else open(path).read()
        print("READ", path)
    except OSError as error:
        print("hidden", path, type(error).__name__)
print("uid", os.getuid(), "processes", len([p for p in os.listdir("/proc") if p.isdigit()]))
try:
    socket.create_connection(("192.0.2.1", 80), 2)
    print("CONNECTED")
except OSError as error:
    print("no network", error.strerror)
print("environment", sorted(k for k in os.environ if "SECRET" in k))
for path in ("/usr/x", "/etc/x", "/run/grader/ws/src/x"):
    try:
        open(path, "w")
        print("WROTE", path)
    except OSError:
        print("read-only", path)
"""
    os.environ["GRADER_TEST_SECRET"] = "x"  # noqa: S105 - what a student must not see
    try:
        run = run_script(tmp_path, code, limit_s=10)
    finally:
        del os.environ["GRADER_TEST_SECRET"]
    text = "\n".join(printed(run))
    assert "uid 1000" in text
    assert "no network" in text
    assert "environment []" in text
    for word in ("READ", "CONNECTED", "WROTE", "Traceback"):
        assert word not in text, text


@pytest.mark.parametrize("sandbox", SANDBOXES)
def test_nothing_of_the_arena_is_inherited(tmp_path: Path, sandbox: str) -> None:
    code = "import os\nprint(sorted(int(n) for n in os.listdir('/proc/self/fd')))\n"
    assert printed(run_script(tmp_path, code, limit_s=5, sandbox=sandbox)) == ["[0, 1, 2, 3]"]


@needs_sandbox
def test_memory_is_limited(tmp_path: Path) -> None:
    code = "import time\nblocks = []\nwhile True:\n    blocks.append(bytearray(20 << 20))\n    time.sleep(0.02)\n"
    run = run_script(tmp_path, code, limit_s=20, limits=RunLimits(memory_bytes=200 << 20))
    assert exit_of(run).stopped_by == "KILL"
    assert any("MB of memory" in e.detail for _, e in run.actors)


@pytest.mark.parametrize("sandbox", SANDBOXES)
def test_output_is_limited(tmp_path: Path, sandbox: str) -> None:
    code = "while True: print('y' * 100)\n"
    run = run_script(tmp_path, code, limit_s=1, limits=RunLimits(output_lines=500), sandbox=sandbox)
    lines = printed(run)
    assert len(lines) == 501
    assert "left out" in lines[-1]
    met = [(e.actor, e.detail) for _, e in run.actors if e.action == "limit"]
    assert met == [("node", "printed more than 500 lines or 8 MB")]


def test_a_long_line_is_cut(tmp_path: Path) -> None:
    run = run_script(tmp_path, "print('x' * 100000)\nprint('after')\n", limit_s=5)
    lines = [line for _, line in run.lines("node")]
    assert lines[0].truncated
    assert len(lines[0].line) == 4096
    assert lines[-1].line == "after"


def _command_lines() -> str:
    return "\n".join(_read(path) for path in Path("/proc").glob("[0-9]*/cmdline"))


def _read(path: Path) -> str:
    try:
        return path.read_bytes().decode(errors="replace")
    except OSError:  # it has ended since
        return ""
