"""Parameters of the general checks that make no sense are faults of the rubric, in an author's words."""

from __future__ import annotations

import re

import pytest

from grader.checks import CHECKS
from grader.rubric.fault_words import model_faults

SQUARE = [[0, 0], [2, 0], [2, 2]]
SLASH = 'a name of the graph begins with a slash: "/x"'


@pytest.mark.parametrize(
    ("check", "given", "key", "fault"),
    [
        ("service", {"service": "x", "type": "std_srvs/Empty"}, ("service",), SLASH),
        ("service", {"service": "/x", "type": "Empty"}, ("type",), "must be a type like"),
        ("service-answers", {"service": "/x", "expect": []}, ("expect",), "needs at least 1, has 0"),
        (
            "service-answers",
            {"service": "/x", "expect": [{}], "tolerance": -1},
            ("tolerance",),
            "at least 0, not -1",
        ),
        ("latched", {"topic": "x"}, ("topic",), SLASH),
        ("param-value", {"name": "x", "value": 1}, ("name",), SLASH),
        ("param-value", {"name": "/x"}, ("value",), "is missing"),
        ("connected", {"topic": "x"}, ("topic",), SLASH),
        ("only-topics", {"topics": ["x"]}, ("topics", 0), SLASH),
        ("only-topics", {"topics": "/x"}, ("topics",), 'must be a list, not "/x"'),
        ("field-bounds", {"topic": "/x", "field": "data"}, (), "give min, max or both"),
        (
            "field-bounds",
            {"topic": "/x", "field": "data", "min": 2, "max": 1},
            (),
            "min, 2, is more than max, 1",
        ),
        ("field-bounds", {"topic": "/x", "field": "a..b", "min": 1}, ("field",), "must be a field like"),
        ("field-bounds", {"topic": "/x", "field": "a[-1]", "min": 1}, ("field",), "must be a field like"),
        (
            "field-bounds",
            {"topic": "/x", "field": "a", "min": 1, "share": 1.5},
            ("share",),
            "at most 1, not 1.5",
        ),
        (
            "prints",
            {"process": "x", "text": "at {number}", "numbers": [1, 2]},
            (),
            "2, and {number} 1 time in the text",
        ),
        ("field-equals", {"topic": "/x", "field": "data"}, (), "give one of value and values"),
        (
            "reacts",
            {"cause": {"topic": "/x", "min": 1}, "effect": {"topic": "/y"}, "within_s": 1},
            ("cause",),
            "give field with min",
        ),
        (
            "reacts",
            {"cause": {"topic": "/x"}, "effect": {"topic": "/y", "field": "data"}, "within_s": 1},
            ("effect",),
            "give field with min",
        ),
        ("path", {"topic": "/x", "points": [], "tolerance_m": 1}, ("points",), "needs at least 1, has 0"),
        ("path", {"topic": "/x", "points": SQUARE, "tolerance_m": 0}, ("tolerance_m",), "more than 0, not 0"),
        (
            "path",
            {"topic": "/x", "points": [[0, 0]], "tolerance_m": 0.1},
            (),
            "a path needs at least two points",
        ),
        ("path", {"topic": "/x", "points": SQUARE, "tolerance_m": 1.5}, (), "two points .* are 2 m apart"),
        ("path", {"topic": "/x", "points": [[1, 0], [1, 0]], "tolerance_m": 0.1}, (), "are 0 m apart"),
        (
            "path",
            {"topic": "/x", "points": [[0, "1"]], "tolerance_m": 1},
            ("points", 0, 1),
            "must be a number",
        ),
        (
            "path",
            {"topic": "/x", "points": [[0, 1, 2]], "tolerance_m": 1},
            ("points", 0),
            "has at most 2 items, not 3",
        ),
        (
            "path",
            {"topic": "/x", "points": SQUARE, "tolerance_m": 0.1, "hold_s": 0},
            ("hold_s",),
            "more than 0",
        ),
    ],
)
def test_faults(check: str, given: dict[str, object], key: tuple[str | int, ...], fault: str) -> None:
    found = model_faults(CHECKS[check].params, given)
    assert [path for path, _ in found] == [key]
    assert re.search(fault, found[0][1]), found


@pytest.mark.parametrize(
    ("check", "given"),
    [
        ("path", {"topic": "/x", "points": SQUARE, "tolerance_m": 0.1, "hold_s": None}),
        ("path", {"topic": "/x", "points": [[1, 0]], "tolerance_m": 0.1}),
        ("field-bounds", {"topic": "/x", "field": "poses[*].position.x", "max": -1}),
        ("field-bounds", {"topic": "/x", "field": "matrix[2][0]", "min": 0, "max": 0, "share": 0.5}),
        ("only-topics", {"topics": ["/x", "/x/*", "/*"]}),
        ("param-value", {"name": "/x", "value": {"a": [1, "b", True]}}),
        ("connected", {"topic": "/x", "publisher": "a", "subscriber": "/b"}),
    ],
)
def test_sound_ones(check: str, given: dict[str, object]) -> None:
    assert model_faults(CHECKS[check].params, given) == []
