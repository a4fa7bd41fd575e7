"""When a goal's result is no longer waited for: pure, by what its server has sent."""

from __future__ import annotations

import time
from types import SimpleNamespace
from typing import Any

import pytest

from grader.arena.goals import GoalSender
from grader.arena.run_state import Rest, RunState
from grader.rubric.scenario import Action, JudgedGoal, Scenario

LIKE = {
    "reports_s": [0.1, 0.2, 0.3, 0.4],
    "ago_s": 1.7,
    "within_s": 1.5,
    "feedback": 4,
    "cancelled": False,
    "naps": False,
    "rests": True,
}
"""A goal that was sent so long ago, and what it was to do: its server has sent all feedback, and no result."""


@pytest.mark.parametrize(
    ("other", "is_lost"),
    [
        ({}, True),
        ({"ago_s": 1.5}, False),  # it may come on a machine that is a little late
        ({"within_s": 3.0}, False),
        ({"naps": True}, False),  # it may sleep before it sets the result
        ({"rests": False}, False),  # it computes
        ({"reports_s": [0.1, 0.2]}, False),  # too few to know when the next would come
        ({"reports_s": [0.4, 0.8, 1.2, 1.6]}, False),  # the result comes with the next turn of the loop
        ({"reports_s": [0.1, 0.2, 0.3, 0.4, 1.6]}, True),  # it goes on behind the goal's end
        ({"reports_s": [0.1, 0.2, 0.3, 0.4, 1.6], "feedback": 0}, False),  # where that is, is not known
        ({"cancelled": True}, False),  # it is silent, and may have seen it
        ({"cancelled": True, "reports_s": [1.4, 1.6]}, False),
        ({"cancelled": True, "reports_s": [1.55, 1.65]}, True),
    ],
)
def test_what_the_server_sent_ends_the_wait_for_a_result_that_is_late(
    *, other: dict[str, Any], is_lost: bool
) -> None:
    case = SimpleNamespace(**LIKE | other)
    cancel = {"cancel_after_s": 1.0} if case.cancelled else {}
    action = Action.model_validate({"name": "/count", "type": "lab/Count", **cancel})
    live, sent_s = RunState(naps=case.naps), time.monotonic() - case.ago_s
    live.owners, live.published, live.running = {"/n": "n"}, {"/count/feedback": {"/n"}}, {"n"}
    live.at_rest = {"n": Rest(sent_s, 0.0, 1, "spins")} if case.rests else {}
    for report_s in case.reports_s:
        live.topics["/count/feedback"].count += 1
        live.topics["/count/feedback"].latest_s.append(sent_s + report_s)
    judged = {("/count", 1): JudgedGoal(2.5, case.feedback, case.within_s)}
    arena: Any = SimpleNamespace(live=live)
    scenario = Scenario.model_validate({"title": "goals", "steps": [{"action": action.model_dump()}]})
    runner: Any = None
    sender = GoalSender(scenario, arena, runner, judged, print)
    sender._sent["/count"], sender._asked["one"] = 1, (sent_s, 0.0)
    assert sender._is_lost(action, "one") is is_lost
