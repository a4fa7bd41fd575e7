"""What the variables of a job may say."""

from __future__ import annotations

import pytest

from grader.cli.display import exit_code
from grader.errors import ExitCode, SubmissionError, UsageError
from grader.integrations.ci_systems import (
    FAILING,
    JobStatus,
    PassMark,
    points_to_pass,
    read_pass_mark,
    read_settings,
    with_pass_mark,
)
from grader.rubric.load import load_rubric
from tests.support.a_class import criterion


@pytest.mark.parametrize(
    ("text", "value", "percent"),
    [("60%", 60, True), ("60 %", 60, True), ("12.5", 12.5, False), ("0", 0, False), ("100%", 100, True)],
)
def test_a_mark_is_points_or_a_percentage(text, value, percent):
    assert read_pass_mark(text) == PassMark(value=value, percent=percent)


@pytest.mark.parametrize(
    "text", ["101%", "-1", "1e3", "60%%", "½", "60,5", "nan", "inf", "0x10", "60 points", "0.6"]
)
def test_what_is_no_mark_is_named(text):
    with pytest.raises(UsageError, match="pass-mark: "):
        read_pass_mark(text)


def test_a_mark_is_of_the_visible_points():
    lab = load_rubric("leeds-comp3631-lab1")
    first, *others = lab.rubric.criteria
    hiding = lab.rubric.model_copy(
        update={"criteria": (first, *(c.model_copy(update={"visibility": "hidden"}) for c in others))}
    )
    loaded = lab.model_copy(update={"rubric": hiding})
    with pytest.raises(UsageError, match="has 5 visible ones"):
        with_pass_mark(loaded, PassMark(value=6, percent=False))
    for points, code in ((3, ExitCode.PASSED), (2.9, ExitCode.BELOW_PASS_MARK)):
        for mark in (PassMark(value=60, percent=True), PassMark(value=3, percent=False)):
            marked = with_pass_mark(loaded, mark).rubric
            seen = (criterion(first.id, "partial", points, 5),)
            assert exit_code(seen, marked) is code
            assert points_to_pass(marked, 5) == "to pass, you need 3"


@pytest.mark.full
@pytest.mark.parametrize("tenths", range(1, 1000, 37))
def test_just_the_mark_is_reached_whatever_floating_point_says(tenths):
    lab = load_rubric("leeds-comp3631-lab1").rubric
    third = lab.model_copy(
        update={
            "pass_mark": None,
            "criteria": (*lab.criteria, lab.criteria[0].model_copy(update={"points": 23.3})),
        }
    )
    loaded = load_rubric("leeds-comp3631-lab1").model_copy(update={"rubric": third})
    marked = with_pass_mark(loaded, PassMark(value=tenths / 10, percent=False)).rubric
    assert exit_code((criterion("a", "partial", tenths / 10, 71.3),), marked) in {0, 1}
    whole = sum(c.points for c in third.criteria)
    assert exit_code((criterion("a", "partial", tenths / 10, whole),), marked) is ExitCode.PASSED


@pytest.mark.parametrize(
    ("text", "outcomes"),
    [
        ("", set(FAILING)),
        ("never", set()),
        ("below-pass-mark", {JobStatus.BELOW}),
        (" Not-Graded ,\n inconclusive ", {JobStatus.NOT_GRADED, JobStatus.INCONCLUSIVE}),
    ],
)
def test_when_a_job_fails(text, outcomes):
    assert read_settings({"GRADER_FAIL_ON": text}).fail_on == outcomes


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("FAIL_ON", "never, inconclusive"),
        ("FAIL_ON", "passed"),
        ("STATIC", "2"),
        ("SANDBOX", "NONE"),
        ("PASS_MARK", "\n::error::x"),
    ],
)
def test_what_cannot_be_meant_is_refused(name, text):
    with pytest.raises(UsageError) as raised:
        read_settings({f"GRADER_{name}": text})
    assert "\n" not in raised.value.message
    assert raised.value.hint


def test_nothing_said_is_the_package_here_with_the_rubrics_mark():
    settings = read_settings({"GRADER_LAB": " ", "GRADER_STATIC": "False"})
    assert (settings.lab, str(settings.path), settings.mark) == (None, ".", None)
    assert (settings.static, settings.sandbox, str(settings.out)) == (False, "auto", "grader-results")


@pytest.mark.parametrize("name", ["a\nb", "\x1b[2J", "x" * 256])
def test_a_package_that_can_have_no_such_name(name):
    assert read_settings({"GRADER_PACKAGE": " lab_1 "}).package == "lab_1"
    with pytest.raises(UsageError, match="package: ") as caught:
        read_settings({"GRADER_PACKAGE": name})
    assert "\x1b" not in caught.value.message


@pytest.mark.parametrize("counter", ["GITHUB_RUN_NUMBER", "CI_PIPELINE_IID"])
def test_so_many_attempts_are_graded(counter):
    last = read_settings({"GRADER_ATTEMPTS": "5", counter: "5"})
    last.check_attempt()
    assert (last.attempt, last.attempts) == (5, 5)
    with pytest.raises(SubmissionError, match="this is attempt 6, and only 5 attempts can be graded"):
        read_settings({"GRADER_ATTEMPTS": "5", counter: "6"}).check_attempt()
    read_settings({counter: "600"}).check_attempt()
    with pytest.raises(UsageError, match="this job has no number"):
        read_settings({"GRADER_ATTEMPTS": "5"}).check_attempt()


@pytest.mark.parametrize("text", ["0", "-1", "many", "1.5", "1\n2"])
def test_a_number_of_attempts_that_is_none(text):
    with pytest.raises(UsageError, match="is not a number of attempts"):
        read_settings({"GRADER_ATTEMPTS": text})
