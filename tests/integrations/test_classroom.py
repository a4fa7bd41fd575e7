"""GitHub Classroom's form: what its reporter makes of it."""

from __future__ import annotations

import base64
import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from grader.model.result import ErrorInfo
from grader.report.platform_results import JSON_BYTES_MAX, render_classroom
from grader.report.view import without_hidden
from tests.integrations.reporter import reporter
from tests.report.hostile import result, rubric
from tests.support.a_class import criterion


def _made(*criteria, passed=False, prefix="", **changes):
    points = round(sum(c.points for c in criteria), 3)
    of = sum(c.max_points for c in criteria)
    made = result(**{"criteria": criteria, "points": points, "max_points": of, "status": "graded", **changes})
    return reporter(render_classroom(made, rubric(), passed=passed, prefix=prefix))


def test_points_are_the_sum_of_the_scores():
    seen = _made(criterion("a", "pass", 40, 40), criterion("b", "partial", 30, 60))
    assert (seen.points, seen.of, seen.failed) == (70, 100, "Some tests failed.")
    assert [test["status"] for test in seen.tests] == ["pass", "fail"]


def test_what_has_passed_is_green_although_points_were_lost():
    seen = _made(criterion("a", "pass", 90, 90), criterion("b", "fail", 0, 10), passed=True)
    assert seen.failed == ""


def test_a_loss_is_told_below_its_name_with_its_line_in_the_repository():
    cited = {"citations": [{"file": "src/talker.py", "line": 17}]}
    told = {"message": "5 Hz, not 10 Hz", "hint": "sleep less", "reproduce": "rostopic hz /chatter"}
    seen = _made(criterion("rate", "fail", 0, 10, **told, **cited), prefix="ws/src/lab1")
    assert seen.tests[0]["filename"] == "ws/src/lab1/src/talker.py"
    assert "❌ rate: title of rate - line 17" in seen.console
    assert (
        "0 of 10 points: 5 Hz, not 10 Hz\nhint: sleep less\nsee it yourself: rostopic hz /chatter"
        in seen.console
    )


def test_what_could_not_be_judged_tells_no_points_at_all():
    seen = _made(criterion("a", "pass", 40, 40), criterion("b", "inconclusive", 0, 60), status="inconclusive")
    assert (seen.points, seen.of, seen.failed) == (None, None, "Some tests errored.")
    assert "b: 60 points are not decided yet" in seen.console


def test_what_a_person_judges_has_no_part_in_the_sum():
    seen = _made(criterion("a", "pass", 40, 40), criterion("b", "manual", 0, 60), status="inconclusive")
    assert (seen.points, seen.of, seen.failed) == (40, 40, "Some tests errored.")
    assert "A PERSON MUST LOOK: b: 60 points are not decided yet" in seen.console


def test_a_machine_that_cannot_grade_leaves_earlier_points_as_they_are():
    error = ErrorInfo(kind="ros-missing", message="no ROS 1 here", hint="install it")
    seen = _made(criterion("a", "error", 0, 40), status="error", points=0, error=error)
    assert (seen.points, seen.failed) == (None, "Some tests errored.")
    assert "no ROS 1 here install it" in seen.console


def test_no_package_has_no_points():
    error = ErrorInfo(kind="package-not-found", message="no package lab1", hint="hand it in")
    seen = _made(criterion("a", "error", 0, 40), status="error", points=0, error=error)
    assert (seen.points, seen.of) == (0, 40)


def test_being_late_is_a_line_of_its_own():
    late = {"points_before": 40, "points": 30, "text": "1 day late: 25 % lost"}
    seen = _made(criterion("a", "pass", 40, 40), points=30, late=late)
    assert (seen.points, seen.of) == (30, 40)
    assert "1 day late: 25 % lost" in seen.console


def test_hidden_criteria_are_not_in_it():
    whole = result(
        criteria=(criterion("a", "pass", 40, 40), criterion("b", "fail", 0, 60)), points=40, max_points=100
    )
    lab = rubric()
    hiding = lab.criteria[0].model_copy(update={"id": "b", "visibility": "hidden"})
    lab = lab.model_copy(update={"criteria": (lab.criteria[1].model_copy(update={"id": "a"}), hiding)})
    seen = reporter(render_classroom(without_hidden(whole, lab), lab, passed=True))
    assert (seen.points, seen.of, len(seen.tests)) == (40, 40, 1)


def test_nothing_of_a_student_commands_the_runner():
    hostile = "::error::x\n::set-output name=a::b\r##[error]x\u2028::stop-commands::x\x1b[31m%0A::add-mask::1"
    told = {"title": hostile, "message": hostile, "hint": hostile, "reproduce": hostile}
    seen = _made(*(criterion(f"c{i}", s, 0, 10, **told) for i, s in enumerate(("fail", "manual", "error"))))
    assert not [line for line in seen.console.splitlines() if line.strip().startswith("::") or "##[" in line]
    assert "\x1b" not in seen.console


def test_the_longest_report_fits_into_a_variable_of_the_environment():
    long = {"message": "m" * 5000, "hint": "\u2603" * 5000, "reproduce": "r" * 5000, "title": "t" * 5000}
    encoded = render_classroom(
        result(criteria=tuple(criterion(f"c{i}", "fail", 0, 1, **long) for i in range(120))),
        rubric(),
        passed=False,
    )
    assert len(base64.b64decode(encoded)) <= JSON_BYTES_MAX
    assert reporter(encoded).of == 120


@given(st.lists(st.integers(0, 1000), min_size=1, max_size=12).filter(any))
def test_the_sum_is_the_points_to_the_last_digit(tenths):
    criteria = tuple(criterion(f"c{i}", "partial", n / 10, 100) for i, n in enumerate(tenths))
    seen = _made(*criteria, points=sum(tenths) / 10)
    assert json.dumps(seen.points) == json.dumps(sum(tenths) / 10)


@pytest.mark.parametrize("kind", ["host", "internal", "sandbox-missing"])
def test_no_fault_of_ours_takes_points(kind):
    error = ErrorInfo(kind=kind, message="x", hint="")
    assert _made(criterion("a", "error", 0, 40), status="error", points=0, error=error).points is None
