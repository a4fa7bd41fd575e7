"""What being late costs: each boundary of a policy, extensions, and the days on which clocks are changed."""

from __future__ import annotations

from datetime import datetime, timedelta, timezone
from zoneinfo import ZoneInfo

import pytest
from hypothesis import given
from hypothesis import strategies as st

from grader.judging.settle import deadline_of, lateness
from grader.model.result import HandedIn
from grader.rubric.model import Rubric
from tests.support.rubrics import rubric as rubric_of

DEADLINE = datetime(2026, 11, 20, 23, 59, tzinfo=timezone(timedelta(hours=1)))
POLICY = {"lost": 10, "per": "day", "grace_minutes": 15, "cap": 50, "cut_off_days": 7}
SECOND = timedelta(seconds=1)


def rubric(policy: dict[str, object] | None = None, deadline: datetime | None = DEADLINE) -> Rubric:
    return rubric_of({"id": "all", "points": 100, "check": "manual"}, deadline=deadline, late=policy)


def after(
    policy: dict[str, object] | None, by: timedelta, points: float = 87.5, **handed_in
) -> tuple[float, str]:
    found = lateness(points, rubric(policy), HandedIn(at=DEADLINE + by, by="roster", **handed_in))
    assert found is not None
    assert found.points_before == points
    return found.points, found.text


@pytest.mark.parametrize(
    ("by", "points", "text"),
    [
        (timedelta(days=-3), 87.5, "in time"),
        (timedelta(0), 87.5, "in time"),
        (SECOND, 87.5, "in time: 1 second after the deadline, which is within the grace"),
        (timedelta(minutes=15), 87.5, "in time: 15 minutes after the deadline, which is within the grace"),
        (
            timedelta(minutes=15) + SECOND,
            78.8,
            "1 day late (begun days count): 10 % of 87.5 points reached are lost",
        ),
        (timedelta(days=1), 78.8, "1 day late (begun days count): 10 % of 87.5 points reached are lost"),
        (
            timedelta(days=1) + SECOND,
            70.0,
            "2 days late (begun days count): 20 % of 87.5 points reached are lost",
        ),
        (
            timedelta(days=5) + SECOND,
            43.8,
            "6 days late (begun days count): 50 % (no more can be lost) of 87.5 points reached are lost",
        ),
        (
            timedelta(days=7),
            43.8,
            "7 days late (begun days count): 50 % (no more can be lost) of 87.5 points reached are lost",
        ),
        (timedelta(days=7) + SECOND, 0.0, "7 days 1 second late, after the cut-off: nothing counts"),
    ],
)
def test_each_boundary(by: timedelta, points: float, text: str) -> None:
    assert after(POLICY, by) == (points, text)


def test_what_is_in_time_is_no_seconds_late() -> None:
    within_grace = lateness(50, rubric(POLICY), HandedIn(at=DEADLINE + timedelta(minutes=1)))
    later = lateness(50, rubric(POLICY), HandedIn(at=DEADLINE + timedelta(hours=1)))
    assert (within_grace.late_s, later.late_s) == (0, 3600)


def test_percents_of_all_points_of_the_rubric() -> None:
    text = "1 day late (begun days count): 10 % of the rubric's 100 points are lost"
    assert after({"lost": 10, "of": "possible"}, SECOND, 30) == (20.0, text)
    assert after({"lost": 10, "of": "possible"}, timedelta(days=4), 30)[0] == 0.0


def test_hours() -> None:
    policy = {"lost": 1.5, "per": "hour"}
    assert after(policy, timedelta(hours=2), 100)[0] == 97.0
    assert after(policy, timedelta(hours=2) + SECOND, 100) == (
        95.5,
        "3 hours late (begun hours count): 4.5 % of 100 points reached are lost",
    )


def test_half_a_digit_goes_up() -> None:
    assert after({"lost": 50}, SECOND, 0.1)[0] == 0.1
    assert after({"lost": 10}, SECOND, 2.5)[0] == 2.3


@pytest.mark.parametrize("policy", [{"lost": 100}, {"lost": 60}, {"lost": 60, "of": "possible"}])
def test_points_are_never_below_none(policy: dict[str, object]) -> None:
    assert after(policy, timedelta(days=30))[0] == 0.0


def test_an_extension_moves_the_deadline_and_the_cut_off() -> None:
    def handed_in(by: timedelta) -> HandedIn:
        return HandedIn(at=DEADLINE + by, deadline=deadline_of(rubric(POLICY), 3), extension_days=3)

    found = [
        lateness(100, rubric(POLICY), handed_in(by))
        for by in (
            timedelta(0),
            timedelta(days=3),
            timedelta(days=4),
            timedelta(days=10),
            timedelta(days=10, seconds=1),
        )
    ]
    assert [f.points for f in found] == [100, 100, 90, 50, 0]
    assert [f.text for f in found[:2]] == ["in time", "in time thanks to 3 days of extension"]


def test_the_extension_counts_from_the_rubrics_deadline_where_no_other_is_given() -> None:
    given = HandedIn(at=DEADLINE + timedelta(hours=12), extension_days=0.5)
    found = lateness(100, rubric({"lost": 10}), given)
    assert (found.points, found.text) == (100, "in time thanks to 0.5 days of extension")
    assert found.deadline == DEADLINE + timedelta(hours=12)


def test_without_a_policy_nothing_is_lost_but_it_is_said() -> None:
    text = "2 days 3 hours late; the rubric has no late policy, so nothing is lost"
    assert after(None, timedelta(days=2, hours=3, minutes=4)) == (87.5, text)


def test_nobody_says_when() -> None:
    for handed_in in (None, HandedIn(note="a folder")):
        found = lateness(87.5, rubric(POLICY), handed_in)
        assert (found.points, found.by, found.at) == (87.5, "nobody", None)
        assert found.text == "it is not known when it was submitted, so it counts as in time"


def test_without_a_deadline_there_is_nothing_to_say() -> None:
    none = rubric(deadline=None)
    assert lateness(50, none, None) is None
    assert lateness(50, none, HandedIn(at=DEADLINE, by="commit")) is None


def test_a_deadline_of_the_batch_stands_in_for_the_rubrics() -> None:
    at = DEADLINE + timedelta(hours=1)
    assert lateness(50, rubric(deadline=None), HandedIn(at=at, deadline=DEADLINE)).late_s == 3600
    assert lateness(50, rubric(POLICY), HandedIn(at=at, deadline=at)).text == "in time"
    assert lateness(50, rubric(deadline=None), HandedIn(at=at, before=DEADLINE)).late_s == 3600


def test_what_was_handed_in_stands_in_the_result() -> None:
    given = HandedIn(at=DEADLINE, by="commit", before=DEADLINE, note="the last commit before the deadline")
    found = lateness(50, rubric(POLICY), given)
    assert (found.at, found.by, found.before, found.note) == (given.at, given.by, given.before, given.note)
    assert lateness(50, rubric(POLICY), found) == found


@pytest.mark.parametrize(
    ("deadline", "at", "late_s"),
    [
        ("2026-03-28T23:59", "2026-03-29T23:59", 23 * 3600),  # clocks go forward in between
        ("2026-10-24T23:59", "2026-10-25T23:59", 25 * 3600),  # and back
    ],
)
def test_days_are_24_hours_where_clocks_are_changed(deadline: str, at: str, late_s: int) -> None:
    berlin = ZoneInfo("Europe/Berlin")
    of_that_night = rubric({"lost": 10}, datetime.fromisoformat(deadline).replace(tzinfo=berlin))
    handed_in = HandedIn(at=datetime.fromisoformat(at).replace(tzinfo=berlin))
    found = lateness(100, of_that_night, handed_in)
    assert found.late_s == late_s
    assert found.points == (90 if late_s <= 86_400 else 80)


def test_the_hour_that_comes_twice_is_told_apart() -> None:
    berlin = ZoneInfo("Europe/Berlin")
    first, second = (datetime(2026, 10, 25, 2, 30, fold=fold, tzinfo=berlin) for fold in (0, 1))
    found = lateness(100, rubric({"lost": 10}, first), HandedIn(at=second))
    assert found.late_s == 3600


@given(
    points=st.floats(0, 100).map(lambda p: round(p, 1)),
    by=st.integers(-(10**7), 10**7),
    lost=st.floats(0, 100),
    cap=st.floats(0, 100),
    of=st.sampled_from(["reached", "possible"]),
    per=st.sampled_from(["day", "hour"]),
)
def test_later_never_gives_more(
    *, points: float, by: int, lost: float, cap: float, of: str, per: str
) -> None:
    policy = {"lost": lost, "cap": cap, "of": of, "per": per, "cut_off_days": 30}
    sooner, later = (after(policy, timedelta(seconds=s), points)[0] for s in (by, by + 3600))
    assert 0 <= later <= sooner <= points
