from __future__ import annotations

import pytest

from grader.authoring.mutation.rubric_test import compare, lost_criteria
from grader.model.result import CriterionResult
from tests.report.hostile import criterion


def criteria(**statuses: str) -> list[CriterionResult]:
    return [criterion(name, status, 0, 5, message=f"about {name}") for name, status in statuses.items()]


@pytest.mark.parametrize(
    ("expected", "found", "state", "differences"),
    [
        ({"a": "fail"}, {"a": "fail", "b": "pass"}, "killed", ((), (), ())),
        ({"a": "fail", "b": "blocked"}, {"a": "fail", "b": "blocked"}, "killed", ((), (), ())),
        ({"a": "fail"}, {"a": "pass", "b": "pass"}, "survived", (("a",), (), ())),
        ({"a": "fail"}, {"a": "fail", "b": "fail"}, "differs", ((), ("b",), ())),
        ({"a": "fail"}, {"a": "pass", "b": "fail"}, "differs", (("a",), ("b",), ())),
        ({"a": "fail"}, {"a": "partial"}, "differs", ((), (), ("a is partial, not fail",))),
        ({"a": "fail"}, {"a": "blocked"}, "differs", ((), (), ("a is blocked, not fail",))),
        ({"a": "fail"}, {"b": "pass"}, "survived", (("a (the rubric has no such criterion)",), (), ())),
        ({"a": "fail", "b": "fail"}, {"b": "fail"}, "differs", (("a (the rubric has no such criterion)",), (), ())),
        ({"a": "fail"}, {"a": "fail", "b": "inconclusive"}, "inconclusive", ((), (), ())),
        ({"a": "fail"}, {"a": "fail", "b": "error"}, "inconclusive", ((), (), ())),
        ({"a": "fail"}, {"a": "fail", "b": "manual"}, "killed", ((), (), ())),
        (None, {"a": "pass", "b": "partial"}, "killed", ((), (), ())),
        (None, {"a": "pass", "b": "pass"}, "survived", ((), (), ())),
    ],
)  # fmt: skip
def test_states(expected, found, state, differences):
    """The differences are what is missing, what is too much, and what has another status."""
    compared = compare(expected, criteria(**found))
    assert compared.state == state
    assert (compared.missing, compared.surplus, compared.differing) == differences


def test_advice_that_the_reference_gets_too_is_no_loss():
    found = criteria(a="fail", advice="fail")
    assert compare({"a": "fail"}, found, {"advice"}).state == "killed"
    assert [c.id for c in lost_criteria(found, {"advice"})] == ["a"]


def test_a_person_gives_no_points_away():
    assert lost_criteria(criteria(a="pass", b="manual")) == ()
