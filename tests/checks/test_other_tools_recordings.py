"""What the general checks say of a recording of another tool: messages, and nothing else."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from grader.checks import CHECKS
from grader.model.verdict import Status, Verdict
from tests.checks.examples import judge_runs
from tests.support.timeline import build_runs

TWIST = {"topic": "/cmd_vel", "type": "geometry_msgs/Twist", "values": [{"linear": {"x": 1.0}}]}


def verdict(check: str, params: dict[str, Any], **topic: Any) -> Verdict:
    runs = build_runs({"runs": {"run": {"topics": [{**TWIST, **topic}], "graph": []}}, "package": {}})
    foreign = replace(runs["run"], metadata={}, recorder=(), host=(), course=())
    assert foreign.foreign
    return judge_runs(check, params, {**runs, "run": foreign})


def test_messages_are_enough_for_what_they_hold() -> None:
    assert {n for n in ("latched", "field-bounds", "path", "service") if CHECKS[n].messages_only} == {
        "latched",
        "field-bounds",
        "path",
    }
    way = {"topic": "/cmd_vel", "points": [[1, 0]], "tolerance_m": 0.1}
    assert verdict("path", way).status is Status.PASS
    bounds = {"topic": "/cmd_vel", "field": "linear.x", "max": 0.5}
    assert verdict("field-bounds", bounds).status is Status.FAIL


def test_a_latched_topic_is_known_by_its_connection_only() -> None:
    assert verdict("latched", {"topic": "/cmd_vel"}, latching=True).status is Status.PASS
    found = verdict("latched", {"topic": "/cmd_vel"})
    assert (found.status, found.message) == (
        Status.INCONCLUSIVE,
        "the recording does not say whether /cmd_vel was latched",
    )


@pytest.mark.parametrize(
    ("check", "params"),
    [
        ("latched", {"topic": "/map"}),
        ("field-bounds", {"topic": "/map", "field": "data", "max": 1}),
        ("path", {"topic": "/map", "points": [[1, 0]], "tolerance_m": 0.1}),
    ],
)
def test_what_was_not_recorded(check: str, params: dict[str, Any]) -> None:
    found = verdict(check, params)
    assert found.basis.unjudged
    assert found.message.startswith("/map is not in ")
    assert found.hint.endswith("record it: rosbag record /map, or -a for all")
