"""Bonuses, penalties, gates and the best of a group: one total everywhere, and no decision loses anything."""

from __future__ import annotations

import io
import json

import pytest

from grader.judging.judge import result_of
from grader.judging.settle import settle, unsettled
from grader.judging.summary import leave_out, overall_status, reached_pass_mark, total_fields, total_points
from grader.model.result import CriterionResult, GradingResult, Override
from grader.model.verdict import Status, Verdict
from grader.report.junit import render_junit
from grader.report.losses import arrange
from grader.report.markdown import render_markdown
from grader.report.platform_results import render_classroom, render_gradescope
from grader.report.terminal import Terminal, open_console
from grader.report.view import points_of, without_hidden
from grader.rubric.model import Rubric
from tests.report.hostile import result
from tests.support.rubrics import rubric

NAMES = ("a", "b", "c", "d")
BEST = {"some": {"criteria": NAMES, "best": 3}}


def worth(name: str, **keys: object) -> dict[str, object]:
    return {"id": name, "check": "manual", "points": 0, **keys}


def judged(lab: Rubric, **statuses: str) -> tuple[CriterionResult, ...]:
    """The criteria with these statuses, those that are not named passed."""
    found = []
    for one in lab.criteria:
        status = Status(statuses.get(one.id, "pass"))
        score = {Status.PASS: 1.0, Status.PARTIAL: 0.5}.get(status, 0.0)
        found.append(result_of(one, Verdict(status=status, score=score, message="m"), lab.digits))
    return leave_out(lab, found)


def graded(lab: Rubric, **statuses: str) -> GradingResult:
    criteria = judged(lab, **statuses)
    return result(
        criteria=criteria,
        max_points=lab.max_points,
        status=overall_status(criteria),
        **total_fields(lab, criteria),
    )


EXTRAS = rubric(worth("base", points=100), worth("more", bonus=5), worth("tidy", penalty=8))


@pytest.mark.parametrize(
    ("statuses", "points"),
    [
        ({}, 105),
        ({"more": "fail"}, 100),
        ({"more": "partial", "tidy": "partial"}, 98.5),
        ({"tidy": "fail", "more": "fail"}, 92),
        ({"tidy": "blocked"}, 105),
        ({"tidy": "inconclusive"}, 105),
        ({"base": "fail", "tidy": "fail", "more": "fail"}, 0),
    ],
)
def test_bonus_and_penalty(statuses: dict[str, str], points: float) -> None:
    assert total_points(EXTRAS, judged(EXTRAS, **statuses)) == points


def test_a_bonus_is_not_needed_to_pass_and_a_penalty_is_a_loss() -> None:
    assert reached_pass_mark(EXTRAS, judged(EXTRAS, more="fail"))
    assert not reached_pass_mark(EXTRAS, judged(EXTRAS, tidy="fail"))


@pytest.mark.parametrize("name", ["more", "tidy"])
def test_an_open_bonus_or_penalty_is_not_settled(name: str) -> None:
    found = judged(EXTRAS, **{name: "manual"})
    assert overall_status(found) == "inconclusive"
    assert [c.missing for c in found if c.id == name] == [5 if name == "more" else 8]


GATED = rubric(
    worth("build", points=10), worth("rest", points=90), gates=[{"criterion": "build", "at_most": 20}]
)


@pytest.mark.parametrize(
    ("statuses", "points", "gate"),
    [
        ({}, 100, None),
        ({"build": "fail"}, 20, 90),
        ({"build": "blocked"}, 20, 90),
        ({"build": "partial"}, 95, None),
        ({"build": "inconclusive"}, 90, None),
        ({"build": "fail", "rest": "fail"}, 0, None),
    ],
)
def test_a_gate(statuses: dict[str, str], points: float, gate: float | None) -> None:
    found = graded(GATED, **statuses)
    assert (found.points, found.gate and found.gate.points_before) == (points, gate)


@pytest.mark.parametrize(
    ("statuses", "points", "left_out", "status"),
    [
        ({}, 60, "d", "graded"),
        ({"b": "fail"}, 60, "b", "graded"),
        ({"b": "fail", "c": "partial"}, 50, "b", "graded"),
        ({"b": "fail", "c": "inconclusive"}, 40, "b", "inconclusive"),
        ({"c": "inconclusive"}, 60, "c", "graded"),
    ],
)
def test_the_best_three_of_four(statuses: dict[str, str], points: float, left_out: str, status: str) -> None:
    lab = rubric(*(worth(name, points=20) for name in NAMES), groups=BEST)
    found = graded(lab, **statuses)
    assert (found.points, found.max_points, found.status) == (points, 60, status)
    assert [c.id for c in found.criteria if c.left_out] == [left_out]
    assert sum(c.max_points for c in found.criteria) == 60


def test_what_was_left_out_counts_again_when_a_person_decides_otherwise() -> None:
    lab = rubric(*(worth(name, points=20) for name in NAMES), groups=BEST)
    before = graded(lab, b="fail")
    now = settle(before, lab, overrides={"a": Override(points=0), "b": Override(points=20)}, handed_in=None)
    assert now.points == 60
    assert [c.id for c in now.criteria if c.left_out] == ["a"]
    assert unsettled(now, lab) == before


@pytest.mark.parametrize(
    ("criterion", "points", "status", "total"),
    [
        ("tidy", -8, "fail", 97),
        ("tidy", -3, "partial", 102),
        ("tidy", 0, "pass", 105),
        ("more", 0, "fail", 100),
        ("more", 5, "pass", 105),
    ],
)
def test_people_decide_about_bonuses_and_penalties(
    criterion: str, points: float, status: str, total: float
) -> None:
    before = graded(EXTRAS)
    now = settle(before, EXTRAS, overrides={criterion: Override(points=points)}, handed_in=None)
    assert now.points == total
    assert {c.id: c.status.value for c in now.criteria}[criterion] == status
    assert unsettled(now, EXTRAS) == before


def test_every_report_gives_the_same_total_and_says_why() -> None:
    lab = rubric(
        worth("build", points=60, requires=()),
        *(worth(name, points=20) for name in NAMES[:3]),
        worth("more", bonus=5),
        worth("tidy", penalty=8),
        gates=[{"criterion": "build", "at_most": 15}],
        groups={"some": {"criteria": NAMES[:3], "best": 2}},
    )
    found = graded(lab, build="fail", tidy="fail", c="fail")
    assert (found.points, found.max_points) == (15, 100)
    assert [points_of(c) for c in found.criteria] == ["0/60", "20/20", "20/20", "not counted", "+5/+5", "-8"]
    text = io.StringIO()
    Terminal(open_console(text)).report(found, lab)
    why = "37 of 100 points were earned, but without build at most 15 count"
    for report in (text.getvalue(), render_markdown(found, lab)):
        assert why in " ".join(report.split())
        assert "15 of 100 points" in report
    scope = json.loads(render_gradescope(found, lab))
    assert scope["score"] == 15
    assert why in scope["output"]
    assert b'name="points" value="15"' in render_junit(found, lab)
    assert render_classroom(found, lab, passed=False)


def test_what_closes_a_gate_is_no_advice_where_it_is_not_counted() -> None:
    lab = rubric(
        worth("rest", points=80),
        *(worth(name, points=20) for name in NAMES[:2]),
        gates=[{"criterion": "b", "at_most": 50}],
        groups={"some": {"criteria": NAMES[:2], "best": 1}},
    )
    found = graded(lab, b="fail")
    assert (found.points, found.gate and found.gate.points_before) == (50, 100)
    shown = arrange(found, lab)
    assert ([loss.criterion.id for loss in shown.lost], shown.advice) == (["b"], ())
    text = io.StringIO()
    Terminal(open_console(text)).report(found, lab)
    assert "b  not counted" in " ".join(text.getvalue().split("To fix")[1].split("\n")).replace("✗ ", "")


def test_students_see_the_total_of_what_they_see() -> None:
    lab = rubric(
        worth("build", points=10),
        worth("rest", points=50),
        worth("last", points=40, visibility="hidden"),
        gates=[{"criterion": "build", "at_most": 45}],
    )
    found = without_hidden(graded(lab, build="fail"), lab)
    assert (found.points, found.max_points, found.gate and found.gate.points_before) == (45, 60, 50)
