from __future__ import annotations

import json
import shlex
import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import pytest

from grader import __version__
from grader.arena.sandbox import is_shown
from grader.checks import CHECKS
from grader.cli import host_support
from grader.cli.host_support import DoctorRow
from grader.cli.main import run
from grader.errors import EvidenceError
from grader.judging.summary import criteria_bytes
from grader.report.files import result_bytes
from grader.ros_env import RosInstallation, RosPackages
from grader.rubric.find import rubric_ids
from grader.rubric.load import load_rubric
from tests.report.hostile import result
from tests.rubric.samples import SOUND, spoiled

HELPED = ["grade", "check", "judge", "record", "inspect", "labs", "explain", "doctor", "rubric"]
HEAVY = ("pydantic", "rich", "lxml", "yaml", "mcap", "rosbags", "numpy", "grader.checks", "grader.pipeline")


@pytest.mark.parametrize("argv", [[], *([c] for c in HELPED), ["rubric", "validate"], ["rubric", "schema"]])
def test_every_command_has_help_with_the_exit_codes(argv, capsys):
    assert run([*argv, "--help"]) == 0
    out = capsys.readouterr().out
    assert out.startswith(f"usage: {' '.join(['grader', *argv])}")
    assert "130  interrupted" in out


def test_version(capsys):
    assert run(["--version"]) == 0
    out = capsys.readouterr().out.splitlines()
    assert out[0] == f"grader {__version__}"
    assert out[1].startswith("Python 3.")
    assert out[2].startswith("ROS 1 ")
    assert len(out) == 3


@pytest.mark.parametrize(
    ("argv", "message"),
    [
        (["grade"], "the following arguments are required: SOURCE, --rubric"),
        (
            ["grade", "x", "--rubric", "y", "--sandbox", "maybe"],
            "argument --sandbox: invalid choice: 'maybe'",
        ),
        (["grade", "x", "--rub", "y"], 'unrecognized arguments: --rub (did you mean "--rubric"?)'),
        (["--vresion"], 'unrecognized arguments: --vresion (did you mean "--version"?)'),
        (["grade", "--ouput=x"], 'unrecognized arguments: --ouput=x (did you mean "--out"?)'),
        (
            ["export", "gradescope", "--rubric", "x"],
            "unrecognized arguments: --rubric (write LAB|FILE without an option: grader export gradescope LAB|FILE)",
        ),
        (
            ["export", "bag", "--evidence=x"],
            "unrecognized arguments: --evidence=x (write EVIDENCE without an option: grader export bag EVIDENCE)",
        ),
        (["export", "bag", "--rubric", "x"], "unrecognized arguments: --rubric"),
        (["check", "x", "--lab", "y"], "unrecognized arguments: --lab (a lab is given by --rubric)"),
        (
            ["check", "x", "mcr2-basic-comms"],
            "unrecognized arguments: mcr2-basic-comms (write --rubric mcr2-basic-comms)",
        ),
        (["check", "x", "y"], "unrecognized arguments: y"),
        (["chekc"], 'there is no command "chekc" (did you mean "check"?)'),
        (["rubric", "tset"], 'there is no command "rubric tset" (did you mean "test"?)'),
        (["rubric"], "the following arguments are required: COMMAND"),
        (["labs", "\x1b[2J"], "unrecognized arguments: \\x1b[2J"),
        (["judge", "--rubric", "x"], "the following arguments are required: EVIDENCE"),
    ],
)
def test_a_wrong_command_line_is_one_line_and_a_hint(argv, message, capsys):
    assert run(argv) == 2
    error, hint = capsys.readouterr().err.splitlines()
    assert error.startswith(f"grader: error: {message}")
    assert hint.startswith("  hint: see grader")


def test_the_commands_of_a_group_are_named_where_none_is_meant(capsys):
    assert run(["rubric", "check"]) == 2
    hint = capsys.readouterr().err.splitlines()[-1]
    assert hint == "  hint: see grader rubric --help, which has validate, schema, copy, new and test"


def test_what_follows_two_hyphens_is_no_option(capsys):
    assert run(["judge", "--rubric", "y", "--", "--ouput"]) == 2
    assert capsys.readouterr().err.startswith('grader: error: there is no rubric "y"')


def test_without_a_command_those_of_students_come_first(capsys):
    assert run([]) == 2
    shown = capsys.readouterr()
    assert shown.out == ""
    rows = [row.split()[0] for row in shown.err.splitlines() if row.startswith("  ")]
    assert rows[:3] == ["check", "explain", "doctor"]
    assert set(HELPED) <= set(rows)
    assert max(map(len, shown.err.splitlines())) <= 100


def test_help_imports_nothing_heavy():
    code = "import sys; from grader.cli.main import run; run(['grade', '--help']); print(*sys.modules, file=sys.stderr)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert set(HEAVY) & set(done.stderr.split()) == set()


def test_a_name_that_the_encoding_lacks_is_escaped(tmp_path):
    path = spoiled(tmp_path).rename(tmp_path / "prüfung.yaml")
    environment = {"PYTHONIOENCODING": "ascii", "PATH": "/usr/bin:/bin"}
    command = [sys.executable, "-m", "grader", "rubric", "validate", str(path)]
    done = subprocess.run(command, capture_output=True, env=environment, check=False)
    assert (done.returncode, done.stderr) == (0, b"")
    assert b"pr\\xfcfung.yaml: ok" in done.stdout


def test_judge_prints_the_criteria_as_result_json_holds_them():
    graded = result()
    held = json.loads(result_bytes(graded))["criteria"]
    assert json.loads(criteria_bytes(graded.criteria)) == held
    lines = [line.removeprefix("  ") for line in result_bytes(graded).decode().splitlines()]
    assert (
        "\n".join(lines[lines.index('"criteria": [') + 1 : lines.index("],")])
        in criteria_bytes(graded.criteria).decode()
    )


def test_judge_without_evidence_says_so(tmp_path, capsys):
    assert (
        run(["judge", str(tmp_path), "--rubric", str(spoiled(tmp_path)), "--out", str(tmp_path / "x.json")])
        == 3
    )
    assert capsys.readouterr().err.startswith(
        f"grader: error: {tmp_path}: no evidence (*.mcap, *.bag, *.db3)"
    )
    assert not (tmp_path / "x.json").exists()


def test_a_closed_pipe_is_quiet():
    command = f"{shlex.quote(sys.executable)} -m grader rubric schema | head -c 10 >/dev/null; exit ${{PIPESTATUS[0]}}"
    done = subprocess.run(["/bin/bash", "-c", command], capture_output=True, check=False)
    assert done.stderr == b""
    assert done.returncode in {0, 141}


@pytest.mark.full
def test_closed_streams_do_no_harm():
    done = subprocess.run(
        ["/bin/bash", "-c", f"{shlex.quote(sys.executable)} -m grader labs >&- 2>&-"], check=False
    )
    assert done.returncode == 0


def test_labs(capsys):
    assert run(["labs", "--json"]) == 0
    assert [lab["id"] for lab in json.loads(capsys.readouterr().out)] == list(rubric_ids())
    assert run(["labs"]) == 0
    shown = capsys.readouterr().out
    assert all(name in shown for name in rubric_ids())


def test_labs_says_which_folder_is_not_there(capsys, monkeypatch, tmp_path):
    monkeypatch.setenv("GRADER_RUBRICS", str(tmp_path / "course"))
    assert run(["labs"]) == 0
    found = capsys.readouterr()
    assert f"{tmp_path / 'course'} is not there" in (found.out + found.err).replace("\n", "")


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=pytest.mark.full if n % 8 else ()) for n, name in enumerate(sorted(CHECKS))],
)
def test_every_check_is_explained(name, capsys):
    assert run(["explain", name]) == 0
    out = capsys.readouterr().out
    for heading in ("What it checks", "Why it matters on a robot", "How it is measured", "How to fix"):
        assert heading in out
    assert max(map(len, out.splitlines())) <= 80


def test_a_criterion_is_explained_with_its_check(capsys, tmp_path):
    assert run(["explain", f"{spoiled(tmp_path)}/chatter-rate"]) == 0
    out = capsys.readouterr().out
    assert "sample/chatter-rate: 10 Hz" in out
    assert "60 of 100 points, judged by the check rate" in out
    assert CHECKS["rate"].title in out


def test_a_check_and_a_criterion_of_one_name_are_explained_once(capsys):
    assert run(["explain", "counter-wrap"]) == 0
    out = capsys.readouterr().out
    assert "leeds-comp3631-lab1/counter-wrap" in out
    assert out.count("What it checks") == 1


def test_explain_has_a_suggestion(capsys):
    assert run(["explain", "raet"]) == 2
    assert 'there is no check or criterion "raet" (did you mean "rate"?)' in capsys.readouterr().err


def test_validate_names_every_fault_of_every_file(tmp_path, capsys):
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
    first = spoiled(tmp_path / "a", ("points: 40", "points: x"))
    second = spoiled(tmp_path / "b", ("points: 60", "points: 50"))
    sound = spoiled(tmp_path)
    assert run(["rubric", "validate", str(first), str(second), str(sound)]) == 2
    shown = capsys.readouterr()
    digest = load_rubric(str(sound)).digest
    ok, its_digest, *warnings = shown.out.splitlines()
    assert (ok, its_digest) == (f"{sound}: ok, sample, 2 criteria, 100 points", f"  digest {digest}")
    assert ["judges the same as talker-node" in one for one in warnings] == [True]
    assert shown.err.splitlines() == [
        f'grader: error: {first}:15: criteria[0].points: must be a number, not "x"',
        f"grader: error: {second}:12: criteria: the points add up to 90, not to 100",
    ]


def test_schema_is_json(capsys):
    assert run(["rubric", "schema"]) == 0
    assert json.loads(capsys.readouterr().out)["$schema"].endswith("2020-12/schema")


@pytest.mark.parametrize("content", [b"", b"not mcap", b"\x89MCAP0\r\n", None])
def test_inspect_says_what_is_wrong_with_a_file(content, tmp_path, capsys):
    path = tmp_path / "x.mcap"
    if content is not None:
        path.write_bytes(content)
    assert run(["inspect", str(path)]) == EvidenceError.exit_code
    error = capsys.readouterr().err.splitlines()
    assert error[0].startswith(f"grader: error: {path}: ")
    assert len(error) <= 2


@pytest.mark.parametrize(("state", "code"), [("ok", 0), ("limited", 0), ("missing", 3)])
def test_doctor_tells_by_its_exit_code(state, code, capsys, monkeypatch):
    row = DoctorRow(name="ROS 1", state=state, detail="x\x1b", fix="apt-get install ros")
    monkeypatch.setattr("grader.cli.host_support.diagnose", lambda: (row,))
    assert run(["doctor"]) == code
    out = capsys.readouterr().out
    assert state in out
    assert "apt-get install ros" in out
    assert "\x1b" not in out
    assert run(["doctor", "--json"]) == code
    assert json.loads(capsys.readouterr().out) == [row.for_json()]


def test_diagnosis_without_ros_names_the_command_that_mends_it(monkeypatch):
    monkeypatch.setattr(host_support, "find_ros", lambda: None)
    rows = {row.name: row for row in host_support.diagnose()}
    assert rows["ROS 1"].state == "missing"
    assert "apt-get install" in rows["ROS 1"].fix
    assert {"Python", "git", "sandbox", "memory", "disk", "host name", "encoding"} <= set(rows)


def test_doctor_names_a_machine_that_does_not_know_its_own_name(monkeypatch):
    monkeypatch.setattr(host_support, "resolves", lambda name: name != "localhost")
    rows = {row.name: row for row in host_support.diagnose()}
    assert (rows["host name"].state, rows["host name"].fix) == (
        "limited",
        "echo '127.0.0.1 localhost' >> /etc/hosts",
    )


def ros_of(*prefixes, env=None):
    """A ROS that a setup.bash brings."""
    about = {"kind": "setup", "where": "x", "distro": "noetic", "python": "python3"}
    return RosInstallation(**about, prefixes=prefixes, env=env or {})


def test_doctor_says_what_a_rubric_needs_and_this_machine_lacks(tmp_path, capsys, monkeypatch):
    for folder in ("share/course_sim", "tmp/course_map"):
        (tmp_path / folder).mkdir(parents=True)
        (tmp_path / folder / "package.xml").write_text(f"<name>{Path(folder).name}</name>")
        (tmp_path / folder / "msg").mkdir()
        (tmp_path / folder / "msg" / "Lap.msg").write_text("int32 number\n")
    path = f"{tmp_path}/share:{tmp_path}/tmp"
    ros = RosInstallation(
        kind="setup",
        where="x",
        distro="noetic",
        python="python3",
        prefixes=(str(tmp_path),),
        env={"ROS_PACKAGE_PATH": path},
    )
    here = RosPackages(ros)
    monkeypatch.setattr("grader.rubric.references.ros_packages", lambda: here)
    monkeypatch.setattr(host_support, "ros_packages", lambda: here)
    monkeypatch.setattr(host_support, "diagnose", lambda: ())
    monkeypatch.setattr(host_support, "is_shown", lambda folder, _: folder.parent.name == "share")
    rows = ("course_sim/Lap", "course_map/Lap", "gazebo_msgs/LinkState", "lab1/Own")
    one = "  - {{id: c{}, title: x, points: 25, check: topic-type, scenario: real, with: {{topic: /c{}, type: {}}}}}\n"
    turtle = "script: src/talker.py}\n      - {name: s, program: turtlesim/turtlesim_node}"
    head = (
        SOUND.partition("criteria:\n")[0].replace("script: src/talker.py}", turtle).replace("/chatter", "/c0")
    )
    rubric = tmp_path / "lab.yaml"
    rubric.write_text(f"{head}criteria:\n{''.join(one.format(n, n, row) for n, row in enumerate(rows))}")
    assert run(["doctor", "--rubric", str(rubric), "--json"]) == 3
    found = {row["name"]: row for row in json.loads(capsys.readouterr().out)}
    assert {name: row["state"] for name, row in found.items()} == {
        "course_map": "missing", "course_sim": "ok", "gazebo_msgs": "missing", "turtlesim": "ok"
    }  # fmt: skip
    assert found["course_map"]["detail"] == f"{tmp_path}/tmp/course_map is hidden from the sandbox, for Lap"
    assert found["gazebo_msgs"]["mend"] == "apt-get install ros-noetic-gazebo-msgs, from ROS's own repository"
    assert found["turtlesim"]["detail"] == "the grader's stand-in, for turtlesim_node"


@pytest.mark.parametrize(
    ("kind", "name", "fix"),
    [
        ("debian", "actionlib", "apt-get install libactionlib-dev python3-actionlib"),
        ("setup", "actionlib", "apt-get install ros-noetic-actionlib, from ROS's own repository"),
        ("debian", "course_sim", "install the ROS package course_sim"),
    ],
)
def test_doctor_says_how_a_package_is_installed(kind, name, fix):
    ros = RosInstallation(
        kind=kind, where="x", distro="noetic", python="python3", prefixes=(), env={"ROS_PACKAGE_PATH": ""}
    )
    assert host_support._package(name, ["Lap"], RosPackages(ros)).fix == fix


def test_a_workspace_below_tmp_is_hidden_from_the_sandbox():
    def is_seen(path, *prefixes):
        ros = RosInstallation(
            kind="setup", where="x", distro="x", python="python3", prefixes=prefixes, env={}
        )
        return is_shown(Path(path), ros)

    assert is_seen("/usr/share/std_msgs")
    assert is_seen("/opt/course/share/course_sim", "/opt/course")
    assert not is_seen("/opt/course/share/course_sim", "/opt/ros/noetic")
    assert not is_seen("/tmp/course_ws/src/course_sim", "/tmp/course_ws")


@pytest.mark.full
@pytest.mark.parametrize("delay_s", [0.05, 0.1, 0.15, 0.2, 0.3])
def test_an_interrupt_while_the_program_loads_is_quiet(delay_s, tmp_path):
    """Started is what has its handlers in place: the Python that runs before them is not ours."""
    code = "import sys, grader.cli.main; from grader.__main__ import main; print(1, flush=True); sys.exit(main())"
    command = [sys.executable, "-c", code, "grade", "/nonexistent/x", "--rubric", str(spoiled(tmp_path))]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, cwd=tmp_path) as child:
        assert child.stdout.readline() == b"1\n"
        with suppress(subprocess.TimeoutExpired):
            child.wait(delay_s)
        child.send_signal(signal.SIGINT)
        _, stderr = child.communicate()
    assert child.returncode in {130, 2}
    assert b"Traceback" not in stderr
