"""Tests of an instructor's that call a student's functions in the sandbox, recorded and judged from the evidence."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from grader.checks import Evidence
from grader.evidence.run import Run
from grader.model.verdict import FileCitation, Status, Verdict, inconclusive
from grader.rubric.pytest_check import PytestParams, run_tests
from grader.rubric.scenario import Scenario
from tests.arena.support import make_place, run

pytestmark = pytest.mark.ros
FILE = "src/kinematics.py"
STUDENTS = """\
import os
import sys
import time
import beside

calls = 0


def forward(a, b=0):
    print("called", a)
    return (a + b, beside.TWO)


def divide(a, b):
    return a / b


def count():
    global calls
    calls += 1
    return calls


def leave():
    print("@grader 0 {\\"value\\": 7}", flush=True)
    os._exit(0)


def interrupt():
    os.kill(os.getppid(), 2)
    time.sleep(60)


def shut():
    sys.exit("no")


def odd():
    return object()


def long():
    return "x" * 5000


def deep():
    os.write(LAST, b"[" * 3000 + b"\\n")


def stay():
    while True:
        time.sleep(1)


def raised():
    raise KeyError("joint")


LAST = max(int(fd) for fd in os.listdir("/proc/self/fd") if os.path.exists("/proc/self/fd/" + fd))
"""
TESTS = """\
import pytest

FILE = "src/kinematics.py"


def test_value(student):
    assert student(FILE).forward(1.5, b=2) == (3.5, 2)
    assert student("kinematics.py").forward(float("inf"))[0] == float("inf")


def test_wrong(student):
    found = student(FILE).divide(1, 4)
    assert found == 0.5, f"1/4 is 0.25, not {found}"


def test_zero(student):
    student(FILE).divide(1, 0)


def test_zero_is_raised(student):
    with pytest.raises(ZeroDivisionError):
        student(FILE).divide(1, 0)
    with pytest.raises(KeyError):
        student(FILE).raised()


def test_count(student):
    assert [student(FILE).count() for _ in range(3)] == [1, 2, 3]


def test_count_begins_again(student):
    assert student(FILE).count() == 1


@pytest.mark.parametrize("name", ["leave", "shut", "odd", "long", "deep", "none"])
def test_bad(student, name):
    getattr(student(FILE), name)()


def test_no_file(student):
    student("src/other.py").forward(1)
"""


def _record(tmp_path: Path, tests: str, students: str = STUDENTS) -> Run:
    (tmp_path / "test_lab.py").write_text(tests)
    scenario = Scenario.model_validate(
        {"title": "functions", "start": [{"name": "functions", "tests": "test_lab.py"}]}
    )
    with make_place({FILE: students, "src/beside.py": "TWO = 2\n"}) as place:
        return run(place, scenario, tmp_path / "run.mcap", beside=Path(os.path.relpath(tmp_path)))


def _judge(tmp_path: Path, seen: Run) -> Verdict:
    evidence = Evidence({"functions": seen}, scenario="functions", package=inconclusive("not read"))
    return run_tests(tmp_path, evidence, PytestParams(file="test_lab.py"))


def test_functions_are_called_and_judged_from_the_evidence(tmp_path: Path) -> None:
    seen = _record(tmp_path, TESTS)
    assert seen.outcome is not None
    assert seen.outcome.outcome == "complete"
    verdict = _judge(tmp_path, seen)
    assert verdict.status is Status.PARTIAL, verdict.hint
    assert verdict.message == "4 of 13 tests pass; failed: test_wrong (1/4 is 0.25, not 0.25)"
    line = STUDENTS.splitlines().index("    return a / b") + 1
    assert FileCitation(file=FILE, line=line) in verdict.citations
    assert f"divide(1, 0) raises ZeroDivisionError: division by zero ({FILE}:{line})" in verdict.hint
    assert f"what these tests call is `divide`, lines {line - 1} to {line} of {FILE}" in verdict.hint
    assert verdict == _judge(tmp_path, seen)


@pytest.mark.parametrize(
    ("function", "says"),
    [
        ("leave", "leave(): its process ended"),
        ("shut", f"shut() raises SystemExit: no ({FILE}:"),
        ("odd", "odd() gives back a object"),
        ("long", "long(): gives back more than"),
        ("deep", "deep(): its answer cannot be read"),
        ("none", f"{FILE} has no function none, only forward (line 9), divide (line 14), count (line 18)"),
        ("Count", f"{FILE} has no function Count; line 18 calls it count"),
        ("stay", "stay(): it did not end within its time"),
    ],
)
@pytest.mark.full
def test_what_is_no_value_is_the_students(tmp_path: Path, function: str, says: str) -> None:
    seen = _record(tmp_path, f"def test_it(student):\n    student({FILE!r}).{function}()\n")
    verdict = _judge(tmp_path, seen)
    assert (verdict.status, verdict.score) == (Status.FAIL, 0)
    assert says in verdict.hint
    assert verdict.basis.timing is (function == "stay")


def test_what_ends_the_process_of_all_is_the_students(tmp_path: Path) -> None:
    tests = f"def test_it(student):\n    student({FILE!r}).interrupt()\n"
    seen = _record(tmp_path, tests + tests.replace("test_it", "test_next"))
    verdict = _judge(tmp_path, seen)
    assert (verdict.status, verdict.score) == (Status.FAIL, 0)
    assert verdict.hint == "test_it and 1 more: interrupt(): its process ended"


def test_a_call_that_was_not_recorded_is_open(tmp_path: Path) -> None:
    seen = _record(tmp_path, f"def test_it(student):\n    assert student({FILE!r}).count() == 1\n")
    assert _judge(tmp_path, seen).status is Status.PASS
    (tmp_path / "test_lab.py").write_text(f"def test_it(student):\n    student({FILE!r}).forward(3)\n")
    verdict = _judge(tmp_path, seen)
    assert verdict.status is Status.INCONCLUSIVE
    assert "grade again" in verdict.message


AREA = """\
TURN = 360
HALF = 5.0


def area(width, height):
    \"\"\"Return the area of a triangle.\"\"\"
    whole = width * height
    return whole / 2


def steps(distance, step):
    return distance / 2 * step


def mean(values):
    total = 0
    for value in values:
        total += value
    return total / len(values)


def turned(angle):
    return angle % TURN * HALF
"""
AREA_TESTS = """\
import pytest

FILE = "src/kinematics.py"


@pytest.mark.parametrize(("sides", "right"), [((2, 3), 3), ((4, 1), 2), ((5, 8), 20)])
def test_area(student, sides, right):
    assert student(FILE).area(*sides) == right


@pytest.mark.parametrize(("given", "right"), [((12, 3), 2), ((5, 1), 2.5)])
def test_steps(student, given, right):
    assert student(FILE).steps(*given) == right


class TestMean:
    def test_mean(self, student):
        assert student(FILE).mean([1, 2, 6]) == 3

    def test_mean_of_one(self, student):
        assert student(FILE).mean([1]) == 1


def test_turned(student):
    assert student(FILE).turned(370) == 5
    assert student(FILE).turned(90) == 45
"""


def test_a_small_change_with_which_all_tests_of_a_function_pass_is_named(tmp_path: Path) -> None:
    wrong = AREA.replace("width * height", "width + height").replace(
        "    return total", "        return total"
    )
    verdict = _judge(tmp_path, _record(tmp_path, AREA_TESTS, wrong))
    assert (
        f"in {FILE}, write `whole = width * height` on line 7: with that, each test of `area`" in verdict.hint
    )
    assert (
        "write `return distance / (2 * step)` on line 12: with that, each test of `steps` passes"
        in verdict.hint
    )
    assert "write `return total / len(values)` with 4 spaces before it on line 19" in verdict.hint
    assert "write `HALF = 0.5` on line 2: with that, each test of `turned` passes" in verdict.hint
    assert FileCitation(file=FILE, line=7) in verdict.citations
