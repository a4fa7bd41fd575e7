"""From the automatic result to the one that counts, and back: nothing gets lost on the way."""

from __future__ import annotations

import json
from datetime import date, datetime, timedelta, timezone

import pytest
from hypothesis import given
from hypothesis import strategies as st

from grader.judging.settle import settle, unsettled
from grader.judging.summary import overall_status, passed, total_points
from grader.model.result import CriterionResult, ErrorInfo, GradingResult, HandedIn, Override
from grader.model.verdict import Status
from grader.report.files import result_bytes
from grader.report.view import without_hidden
from grader.rubric.model import Rubric
from tests.report.hostile import result as any_result
from tests.support.a_class import criterion
from tests.support.rubrics import rubric as rubric_of

DEADLINE = datetime(2026, 11, 20, 23, 59, tzinfo=timezone.utc)
TWO_DAYS = HandedIn(at=DEADLINE + timedelta(days=1, hours=1), by="commit", deadline=DEADLINE)
MILLER = Override(points=7, comment="clear names", author="A. Miller", date=date(2026, 11, 2))


def rubric(criteria: tuple[CriterionResult, ...], *, hidden: str = "", **changes: object) -> Rubric:
    asked = (
        {
            "id": c.id,
            "title": c.title,
            "points": c.max_points,
            "check": c.check,
            "visibility": "hidden" if c.id == hidden else "visible",
        }
        for c in criteria
    )
    return rubric_of(*asked, **changes)


def automatic(criteria: tuple[CriterionResult, ...], error: ErrorInfo | None = None) -> GradingResult:
    """As the pipeline makes it."""
    return any_result(
        criteria=criteria,
        points=total_points(rubric(criteria), criteria),
        max_points=sum(c.max_points for c in criteria),
        status="error" if error else overall_status(criteria),
        error=error,
    )


RATE = criterion("rate", Status.FAIL, 0, 10, message="5 Hz, not 10 Hz", measured="5 Hz", hint="sleep less")
STYLE = criterion("style", Status.MANUAL, 0, 10, message="a person awards these points")
BUILD = criterion("build", Status.PASS, 80, 80, message="it builds")
TALK = criterion("talk", Status.MANUAL, 0, 0)
CRITERIA = (BUILD, RATE, STYLE)


def settled(
    criteria=CRITERIA, *, before=(), handed_in=None, error=None, lab=None, **overrides
) -> GradingResult:
    lab = lab or rubric(criteria)
    given = {name.replace("_", "-"): override for name, override in overrides.items()}
    return settle(automatic(criteria, error), lab, overrides=given, handed_in=handed_in, before=before)


def test_a_person_gives_the_points_of_a_manual_criterion():
    found = settled(style=MILLER)
    assert (found.points, found.status) == (87, "graded")
    style = found.criteria[2]
    assert (style.status, style.points) == (Status.PARTIAL, 7)
    assert style.message == "7 of 10 points by A. Miller: clear names"
    (applied,) = found.overrides
    assert (applied.criterion, applied.points, applied.date) == ("style", 7, date(2026, 11, 2))
    assert (applied.automatic.status, applied.automatic.message) == (
        Status.MANUAL,
        "a person awards these points",
    )
    assert applied.was == applied.automatic
    assert not applied.changed


def test_what_stays_open_keeps_the_result_open():
    assert settled(rate=MILLER).status == "inconclusive"
    assert (
        settled((BUILD, RATE, STYLE, criterion("quiz", Status.INCONCLUSIVE, 0, 0)), style=MILLER).status
        == "graded"
    )


@pytest.mark.parametrize(
    ("points", "status"),
    [(10, Status.PASS), (9.94, Status.PARTIAL), (9.96, Status.PASS), (0.04, Status.FAIL), (0, Status.FAIL)],
)
def test_the_status_follows_the_points_as_they_are_rounded(points, status):
    found = settled(rate=Override(points=points)).criteria[1]
    assert found.status is status


@pytest.mark.parametrize(
    ("override", "message"),
    [
        (Override(points=7.5, author="A. Miller"), "7.5 of 10 points by A. Miller"),
        (Override(points=0, comment="copied"), "0 of 10 points, decided by a person: copied"),
        (Override(points=10), "10 of 10 points, decided by a person"),
    ],
)
def test_messages(override, message):
    assert settled(rate=override).criteria[1].message == message


def test_advice_that_a_person_looked_at():
    found = settled((BUILD, TALK), talk=Override(points=0, comment="well spoken")).criteria[1]
    assert (found.status, found.message) == (Status.PASS, "0 of 0 points, decided by a person: well spoken")


def test_an_override_keeps_what_the_check_had_said_and_marks_what_it_says_now():
    first = settled(rate=MILLER)
    now_right = (BUILD, criterion("rate", Status.PASS, 10, 10, message="10 Hz"), STYLE)
    second = settled(now_right, before=first.overrides, rate=MILLER)
    (applied,) = second.overrides
    assert applied.changed
    assert (applied.was.status, applied.automatic.status) == (Status.FAIL, Status.PASS)
    assert second.criteria[1].points == 7
    third = settled(now_right, before=second.overrides, rate=MILLER)
    assert third.overrides == second.overrides
    back = settled(before=second.overrides, rate=MILLER)
    assert not back.overrides[0].changed


def test_other_words_of_the_same_verdict_are_no_change():
    first = settled(rate=MILLER)
    same = (BUILD, RATE.model_copy(update={"message": "5.1 Hz, not 10 Hz"}), STYLE)
    (applied,) = settled(same, before=first.overrides, rate=MILLER).overrides
    assert not applied.changed
    assert (applied.was.message, applied.automatic.message) == ("5 Hz, not 10 Hz", "5.1 Hz, not 10 Hz")


@pytest.mark.parametrize(
    "change", [{"points": 8}, {"comment": "x"}, {"author": "B"}, {"date": date(2026, 11, 3)}]
)
def test_a_new_decision_is_about_what_the_check_says_now(change):
    first = settled(rate=MILLER)
    now_right = (BUILD, criterion("rate", Status.PASS, 10, 10), STYLE)
    (applied,) = settled(now_right, before=first.overrides, rate=MILLER.model_copy(update=change)).overrides
    assert (applied.was.status, applied.changed) == (Status.PASS, False)


def test_an_override_that_was_taken_back_leaves_nothing():
    first = settled(rate=MILLER)
    again = settle(first, rubric(CRITERIA), overrides={}, handed_in=None, before=first.overrides)
    assert again == automatic(CRITERIA)


def test_overrides_of_what_the_result_does_not_have_are_left_out():
    assert settled(other=MILLER) == automatic(CRITERIA)


def test_lateness_comes_last():
    lab = rubric(CRITERIA, deadline=DEADLINE, late={"lost": 10})
    found = settled(lab=lab, handed_in=TWO_DAYS, style=MILLER)
    assert (found.late.points_before, found.late.points, found.points) == (87, 69.6, 69.6)
    assert found.late.text == "2 days late (begun days count): 20 % of 87 points reached are lost"
    assert [c.points for c in found.criteria] == [80, 0, 7]
    assert unsettled(found, lab) == automatic(CRITERIA)


@pytest.mark.parametrize(
    ("mark", "in_time", "late"), [(69.6, True, True), (69.7, True, False), (87.1, False, False)]
)
def test_a_mark_in_points_is_compared_with_what_lateness_leaves(mark, in_time, late):
    lab = rubric(CRITERIA, deadline=DEADLINE, late={"lost": 10}, pass_mark=mark)
    assert passed(lab, settled(lab=lab, style=MILLER)) is in_time
    assert passed(lab, settled(lab=lab, handed_in=TWO_DAYS, style=MILLER)) is late


ERROR = ErrorInfo(kind="submission", message="no package", hint="hand in a package")
UNGRADED = tuple(criterion(name, Status.ERROR, 0, most) for name, most in (("a", 60), ("b", 40), ("tip", 0)))


def test_what_could_not_be_graded_is_graded_once_a_person_has_decided_all_that_counts():
    some = settled(UNGRADED, error=ERROR, a=Override(points=30))
    assert (some.status, some.points, some.error) == ("error", 30, ERROR)
    every = settled(UNGRADED, error=ERROR, a=Override(points=30), b=Override(points=40))
    assert (every.status, every.points, every.error) == ("graded", 70, ERROR)
    assert unsettled(every, rubric(UNGRADED)) == automatic(UNGRADED, ERROR)


def test_hidden_decisions_are_not_shown_and_the_points_fit_what_is():
    lab = rubric(CRITERIA, hidden="rate", deadline=DEADLINE, late={"lost": 10, "of": "possible"})
    found = settled(lab=lab, handed_in=TWO_DAYS, style=MILLER, rate=MILLER)
    assert (found.late.points_before, found.points) == (94, 74)
    shown = without_hidden(found, lab)
    assert [o.criterion for o in shown.overrides] == ["style"]
    assert (shown.late.points_before, shown.points, shown.max_points) == (87, 69, 90)
    assert shown.late.text == "2 days late (begun days count): 20 % of the rubric's 90 points are lost"
    assert shown.status == "graded"


def test_a_hidden_error_that_nobody_decided_does_not_reach_what_is_shown():
    lab = rubric(UNGRADED, hidden="b")
    decided = settled(UNGRADED, error=ERROR, lab=lab, a=Override(points=30))
    assert without_hidden(decided, lab).status == "graded"
    assert without_hidden(settled(UNGRADED, error=ERROR, lab=lab), lab).status == "error"


@st.composite
def results(draw) -> GradingResult:
    names = draw(st.lists(st.sampled_from("abcdef"), min_size=1, unique=True))
    points = st.integers(0, 200).map(lambda n: n / 10)
    criteria = []
    for name in names:
        most = draw(points)
        earned = round(most * draw(st.sampled_from([0, 0.3, 1])), 1)
        criteria.append(criterion(name, draw(st.sampled_from(Status)), earned, most, message=draw(st.text())))
    error = draw(st.sampled_from([None, None, ERROR]))
    return automatic(tuple(criteria), error)


OVERRIDES = st.dictionaries(
    st.sampled_from("abcdefg"),
    st.builds(
        Override,
        points=st.floats(0, 20),
        comment=st.text(max_size=20),
        author=st.text(max_size=20),
        date=st.none() | st.dates() | st.datetimes(timezones=st.just(timezone.utc)),
    ),
)
HANDED_IN = st.none() | st.builds(
    HandedIn,
    at=st.none() | st.integers(-(10**6), 10**7).map(lambda s: DEADLINE + timedelta(seconds=s)),
    extension_days=st.floats(0, 10),
)
POLICIES = st.none() | st.fixed_dictionaries(
    {"lost": st.floats(0, 100), "of": st.sampled_from(["reached", "possible"])}
)


@pytest.mark.full
@given(results(), OVERRIDES, HANDED_IN, POLICIES, st.booleans())
def test_settling_goes_back_and_forth(result, overrides, handed_in, policy, dated):
    dates = {"deadline": DEADLINE, "late": policy} if dated or policy else {}
    lab = rubric(result.criteria, **dates)
    once = settle(result, lab, overrides=overrides, handed_in=handed_in)
    assert unsettled(once, lab) == result
    assert unsettled(result, lab) is result
    how = {"overrides": overrides, "handed_in": handed_in, "before": once.overrides}
    assert settle(unsettled(once, lab), lab, **how) == once
    assert settle(once, lab, **how) == once
    assert {o.criterion for o in once.overrides} == overrides.keys() & {c.id for c in result.criteria}


@pytest.mark.full
@given(results(), OVERRIDES, HANDED_IN)
def test_a_result_that_was_written_and_read_settles_the_same(result, overrides, handed_in):
    lab = rubric(result.criteria, deadline=DEADLINE, late={"lost": 10})
    once = settle(result, lab, overrides=overrides, handed_in=handed_in)
    read = GradingResult.model_validate_json(json.dumps(json.loads(result_bytes(once))))
    again = settle(
        unsettled(read, lab), lab, overrides=overrides, handed_in=read.handed_in, before=read.overrides
    )
    assert result_bytes(again) == result_bytes(once)
