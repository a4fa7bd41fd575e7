"""Which run begins first."""

from __future__ import annotations

from grader.arena.recorder import order_runs
from grader.rubric.model import Rubric
from grader.rubric.scenario import Scenario, Start, Until


def scenario(clock: str = "real", **until: object) -> Scenario:
    start = (Start(name="node", script="node.py"),)
    return Scenario(title="run", clock=clock, start=start, until=Until.model_validate(until))  # type: ignore[arg-type]


def order(*rated: str, **scenarios: Scenario) -> tuple[str, ...]:
    """The order of these runs, of which `rated` are to show a rate."""
    about = {"schema": "grader.rubric/1", "id": "r", "title": "r", "version": "1", "package": "p"}
    criteria = [{"id": "c", "title": "c", "points": 1, "check": "manifest"}]
    return order_runs(Rubric.model_validate({**about, "scenarios": scenarios, "criteria": criteria}), rated)


LONG = scenario(window_s=6)
WATCHING = scenario(alive_s=5)
WARPED = scenario("warped", messages={"/x": 258})
SHORT = scenario(quiet_s=1)


def test_what_measures_a_rate_begins_first() -> None:
    runs = {"lives": scenario(alive_s=20), "hears": SHORT, "rate": LONG, "wraps": WARPED, "again": LONG}
    assert order("rate", "again", **runs) == ("rate", "again", "lives", "wraps", "hears")


def test_then_the_longest() -> None:
    assert order(a=SHORT, b=SHORT, lives=WATCHING) == ("lives", "a", "b")


def test_a_warped_run_measures_no_rate() -> None:
    assert order("slow", long=LONG, slow=scenario("warped", window_s=1)) == ("long", "slow")
