"""Who begins first."""

from __future__ import annotations

from grader.arena.recording import in_order
from grader.rubric.model import Criterion, Rubric, Scenario, Start, Until


def scenario(clock: str = "real", **until: object) -> Scenario:
    start = (Start(name="node", script="node.py"),)
    return Scenario(title="run", clock=clock, start=start, until=Until.model_validate(until))  # type: ignore[arg-type]


def rubric(*rated: str, **scenarios: Scenario) -> Rubric:
    """With a criterion of the check `rate` for each run of `rated`, one of another check for all."""
    checks = [(name, "rate") for name in rated] + [(name, "hears") for name in scenarios]
    criteria = [
        Criterion.model_validate({"id": f"c{i}", "title": "c", "points": 1, "check": check, "scenario": name})
        for i, (name, check) in enumerate(checks)
    ]
    about = {"schema": "grader.rubric/1", "id": "r", "title": "r", "version": "1", "package": "p"}
    return Rubric.model_validate({**about, "scenarios": scenarios, "criteria": criteria})


LONG = scenario(window_s=6)
WATCHING = scenario(alive_s=5)
WARPED = scenario("warped", messages={"/x": 258})
SHORT = scenario(quiet_s=1)


def test_what_measures_a_rate_begins_first() -> None:
    runs = rubric(
        "rate", "again", lives=scenario(alive_s=20), hears=SHORT, rate=LONG, wraps=WARPED, again=LONG
    )
    assert in_order(runs) == ("rate", "again", "lives", "wraps", "hears")


def test_then_the_longest() -> None:
    assert in_order(rubric(a=SHORT, b=SHORT, lives=WATCHING)) == ("lives", "a", "b")


def test_a_warped_run_measures_no_rate() -> None:
    assert in_order(rubric("slow", long=LONG, slow=scenario("warped", window_s=1))) == ("long", "slow")
