"""`check: pytest`: one sub-score a test, hints from failures, and no mark lost by what is not the student's."""

from __future__ import annotations

import os
import shutil
import time
from pathlib import Path

import pytest

from grader.errors import RubricError
from grader.model.verdict import Status
from grader.rubric.find import rubrics_folder
from grader.rubric.load import load_rubric
from tests.evidence.bags import CHATTER, write_bag
from tests.rubric.own_checks.samples import TESTS, judged, runs, write_rubric

FIXTURE_OF_NOTHING = """\
import pytest
@pytest.fixture
def first(run):
    yield run.channels[5]
def test_a(first):
    pass
"""
MIXED = '''\
import pytest


def test_hello(run):
    """It says hello."""
    assert run.student_channels("/chatter")[0].data[0].startswith("hello")


@pytest.mark.points(3)
def test_name(package):
    """The package has its name."""
    assert package.name == "lab2", f"it is named {package.name}"


@pytest.mark.parametrize("n", [0, 1])
def test_counts(evidence, n):
    assert evidence["talker"].student_channels("/chatter")[0].data[n].endswith("0")


def test_later():
    pytest.skip("not now")
'''


def result(tmp_path: Path, tests: str, recorded=None, criteria: str = TESTS):
    return judged(write_rubric(tmp_path, criteria, tests=tests), recorded)["own"]


def broken(tmp_path: Path, tests: str, criteria: str = TESTS) -> str:
    """The instructor's hint of what was no test at all."""
    found = result(tmp_path, tests, criteria=criteria)
    assert (found.status, found.points) == (Status.ERROR, 0)
    assert found.message == "the tests in test_lab.py could not be run; this costs no marks"
    return found.hint.removeprefix("for the instructor: ")


@pytest.mark.full
def test_each_test_is_a_share_of_the_points(tmp_path):
    found = result(tmp_path, MIXED)
    assert found.status is Status.PARTIAL
    assert found.points == pytest.approx(100 * 2 / 6, abs=0.05)
    assert found.message == "2 of 4 tests pass; failed: The package has its name (it is named lab1)"
    assert found.measured == (
        "test_hello 1/1, test_name 0/3, test_counts[0] 1/1, test_counts[1] 0/1, test_later skipped"
    )
    assert found.hint.startswith("test_name: it is named lab1; test_counts[1]: assert ")


@pytest.mark.full
def test_all_pass_and_none(tmp_path):
    assert result(tmp_path, "def test_a(run):\n    assert run.scenario == 'talker'\n").status is Status.PASS
    found = result(tmp_path, "def test_a():\n    assert 0, 'gone\\nfor ever'\n")
    assert (found.status, found.hint) == (Status.FAIL, "test_a: gone")


@pytest.mark.full
def test_an_assertion_in_a_fixture_counts_once(tmp_path):
    text = (
        "import pytest\n@pytest.fixture\ndef first(run):\n    assert len(run.channels) > 5\n    yield 1\n"
        "def test_a(first):\n    pass\ndef test_b():\n    pass\n"
    )
    found = result(tmp_path, text)
    assert (found.points, found.measured) == (50, "test_a 0/1, test_b 1/1")


@pytest.mark.full
def test_a_test_of_no_points_is_advice(tmp_path):
    text = "import pytest\n@pytest.mark.points(0)\ndef test_a():\n    assert 0, 'nicer'\ndef test_b():\n    pass\n"
    found = result(tmp_path, text)
    assert (found.status, found.hint) == (Status.PASS, "test_a: nicer")


@pytest.mark.full
def test_twice_the_same(tmp_path):
    text = (
        "def test_a(tmp_path):\n    assert object() == tmp_path\n"
        "def test_b():\n    assert {'a', 'b', 'c', 'd'} == {'x', 'y', 'z'}\n"
        "def test_c():\n    assert 0, object()\n"
    )
    first, second = result(tmp_path, text), result(tmp_path, text)
    assert first == second
    assert "0x…" in first.hint


@pytest.mark.full
def test_some_are_selected(tmp_path):
    criteria = TESTS.replace("file: test_lab.py", "file: test_lab.py, select: hello or name")
    assert result(tmp_path, MIXED, criteria=criteria).measured == "test_hello 1/1, test_name 0/3"


@pytest.mark.full
@pytest.mark.parametrize(
    ("tests", "hint"),
    [
        ("", "test_lab.py holds no test"),
        ("import nowhere\n", "No module named 'nowhere'"),
        ("import os\ndef test_a():\n    os._exit(0)\n", "pytest ended with code 0"),
        ("import os\ndef test_a():\n    os.kill(os.getpid(), 11)\n", "pytest ended with signal 11"),
        ("import pytest\ndef test_a():\n    pass\ndef test_b():\n    pytest.exit('enough')\n", "code 2"),
        ("def test_a(nothing):\n    pass\n", "there is no fixture 'nothing'"),
        ("def test_a(evidence):\n    evidence['tolker']\n", "there is no scenario 'tolker'"),
        ("import pytest\n@pytest.mark.points('x')\ndef test_a():\n    pass\n", "points(…) takes one number"),
        ("import pytest\n@pytest.mark.points(0)\ndef test_a():\n    pass\n", "have 0 points in total"),
        ("raise SystemExit('no')\n", "pytest ended with code 3"),
        ("def test_a():\n    raise OSError('gone\\nfor ever')\n", "test_a: test_lab.py:2: OSError: gone"),
        (
            "def f(x):\n    return x[0]\ndef test_a():\n    f([])\n",
            "test_a: test_lab.py:2: IndexError: list index",
        ),
        (
            FIXTURE_OF_NOTHING,
            "test_a: test_lab.py:4: IndexError",
        ),
    ],
)
def test_broken_tests_are_an_error_and_never_a_pass(tmp_path, tests, hint):
    assert hint in broken(tmp_path, tests)


@pytest.mark.full
def test_a_selection_of_nothing_is_refused_and_of_nonsense_an_error(tmp_path):
    none = TESTS.replace("test_lab.py", "test_lab.py, select: nowhere")
    with pytest.raises(RubricError, match=r"select: fits no test of test_lab\.py: there is test_counts"):
        broken(tmp_path, MIXED, none)
    named = MIXED + "\n@pytest.fixture(params=['somewhere'])\ndef place(request):\n    return request.param\n"
    assert broken(tmp_path, named, none) == "test_lab.py holds no test that fits 'nowhere'"
    nonsense = TESTS.replace("test_lab.py", "test_lab.py, select: '((('")
    assert "pytest ended with code 4" in broken(tmp_path, MIXED, nonsense)


@pytest.mark.full
def test_tests_that_take_too_long_end_with_what_they_started(tmp_path):
    text = (
        "import subprocess, pathlib\n"
        "def test_a():\n"
        "    process = subprocess.Popen(['sleep', '300'])\n"
        f"    pathlib.Path({str(tmp_path / 'pid')!r}).write_text(str(process.pid))\n"
        "    process.wait()\n"
    )
    criteria = TESTS.replace("test_lab.py", "test_lab.py, timeout_s: 10")
    assert broken(tmp_path, text, criteria) == "the tests took longer than 10 s"
    started = Path("/proc", (tmp_path / "pid").read_text(), "cmdline")
    deadline = time.monotonic() + 300
    while runs_on(started) and time.monotonic() < deadline:
        os.sched_yield()
    assert not runs_on(started)


def runs_on(cmdline: Path) -> bool:
    """A process that has ended has no command line, even where nobody has asked for its end yet."""
    try:
        return cmdline.read_bytes() != b""
    except OSError:
        return False


def test_nothing_of_the_surrounding_folders_takes_part(tmp_path, monkeypatch):
    (tmp_path / "pytest.ini").write_text("[pytest]\naddopts = --nonsense\n")
    (tmp_path / "conftest.py").write_text("raise RuntimeError\n")
    (tmp_path / "helper.py").write_text("x = 1\n")
    monkeypatch.setenv("PYTEST_ADDOPTS", "--nonsense")
    monkeypatch.setenv("PYTEST_PLUGINS", "nowhere")
    found = result(tmp_path, "def test_a():\n    assert __name__\n")
    assert found.status is Status.PASS
    assert sorted(p.name for p in tmp_path.iterdir()) == [
        "conftest.py", "helper.py", "lab.yaml", "pytest.ini", "test_lab.py"
    ]  # fmt: skip


@pytest.mark.full
def test_a_run_that_was_not_recorded_leaves_it_open(tmp_path):
    found = result(tmp_path, "def test_a():\n    pass\ndef test_b(evidence):\n    evidence['other']\n")
    assert (found.status, found.message) == (
        Status.INCONCLUSIVE, "test_b could not be run: the scenario 'other' was not run"
    )  # fmt: skip
    host = runs(outcome="host", outcome_detail="no room")
    assert result(tmp_path, "def test_a(run):\n    pass\n", host).status is Status.INCONCLUSIVE


@pytest.mark.full
def test_only_what_was_recorded_is_iterated(tmp_path):
    text = (
        "def test_a(evidence):\n    assert list(evidence) == ['talker', 'package']\n"
        "    assert 'other' not in evidence and len(evidence) == 2\n"
    )
    assert result(tmp_path, text).status is Status.PASS


@pytest.mark.full
def test_all_skipped_is_open_or_blocked(tmp_path):
    text = "import pytest\ndef test_a(run):\n    if not run.student_channels('/x'):\n        pytest.skip('no /x')\n"
    found = result(tmp_path, text)
    assert (found.status, found.message) == (Status.INCONCLUSIVE, "every test was skipped: no /x")
    assert found.basis.unjudged
    criteria = TESTS.replace("points: 100", "points: 50, requires: [type]") + (
        "  - {id: type, title: t, points: 50, check: topic-type, scenario: talker,\n"
        "     with: {topic: /x, type: std_msgs/String}}\n"
    )
    assert result(tmp_path, text, criteria=criteria).status is Status.BLOCKED


@pytest.mark.full
def test_a_criterion_without_a_scenario_has_no_run(tmp_path):
    criteria = TESTS.replace(", scenario: talker", "")
    assert "names no scenario" in broken(tmp_path, "def test_a(run):\n    pass\n", criteria)


@pytest.mark.full
def test_tests_read_a_recording_of_another_tool(tmp_path):
    from grader.evidence.reader import load_evidence  # noqa: PLC0415 - this test only

    bag = load_evidence([write_bag(tmp_path / "lab.bag", CHATTER)])
    text = "def test_a(run):\n    assert len(run.student_channels('/chatter')[0].data) == 300\n"
    assert result(tmp_path, text, bag).status is Status.PASS
    found = result(tmp_path, text + "def test_b(package):\n    pass\n", bag)
    assert (found.status, "package's files" in found.message) == (Status.INCONCLUSIVE, True)


def test_the_digest_is_of_the_tests_too(tmp_path):
    path = write_rubric(tmp_path, TESTS, tests=MIXED)
    first = load_rubric(str(path)).digest
    write_rubric(tmp_path, TESTS, tests=MIXED + "\n")
    assert load_rubric(str(path)).digest != first


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        ("def hand(", "def hand(:", "line 10: invalid syntax"),
        (
            '"src/kinematics.py"',
            '"src/kinematic.py"',
            "line 44: the handout says kinematics.py, not kinematic.py",
        ),
        ("student(FILE).wrap(", "student(FILE).wrapped(", "line 62: the handout says wrap, not wrapped"),
        ("wrap(angle)\n", "wrap(angle, 1)\n", "line 62: wrap has 1 argument in the handout, and 2 here"),
        ("src/kinematics.py", "arm/src/kinematics.py", ""),
        ("student(FILE).wrap(", "student(FILE).wrap2(", ""),
        # what the handout does not have, is worked out, or is called wrongly on purpose
        ("student(FILE).wrap(", "student(FILE).own_name(", ""),
        ("student(FILE).wrap(", "student(f'src/{FILE}').wrap(", ""),
        (
            "found = student(FILE).wrap(angle)\n",
            "with pytest.raises(TypeError): student(FILE).wrap(angle, 1)\n",
            "",
        ),
    ],
    ids=[
        "syntax",
        "file",
        "function",
        "arguments",
        "elsewhere",
        "number",
        "own-name",
        "worked-out",
        "on-purpose",
    ],
)
def test_a_slip_in_an_instructors_test_file_is_refused(tmp_path, old, new, fault):
    examples = rubrics_folder() / "examples"
    tests = (examples / "test_kinematics.py").read_text(encoding="utf-8")
    assert old in tests
    (tmp_path / "test_kinematics.py").write_text(tests.replace(old, new, 1), encoding="utf-8")
    path = Path(shutil.copy(examples / "unit-tests.yaml", tmp_path))
    if not fault:
        assert load_rubric(str(path)).rubric.id == "unit-tests"
        return
    with pytest.raises(RubricError) as caught:
        load_rubric(str(path))
    assert caught.value.faults == [f"{path}:23: criteria[1].with.file: test_kinematics.py, {fault}"]
