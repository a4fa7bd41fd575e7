"""Which runs go side by side."""

from __future__ import annotations

from grader.arena.lanes import lanes
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


def test_a_rate_is_measured_beside_one_other_lane() -> None:
    runs = rubric("rate", "again", rate=LONG, wraps=WARPED, hears=SHORT, again=LONG)
    assert lanes(runs) == (("rate", "again"), ("wraps", "hears"))


def test_watching_holds_nothing_up() -> None:
    runs = rubric("rate", rate=LONG, lives=WATCHING, short=SHORT, two=LONG)
    assert lanes(runs) == (("rate",), ("lives", "two"), ("short",))


def test_two_lanes_where_no_rate_is_measured() -> None:
    runs = rubric(a=scenario(alive_s=2.5), b=SHORT, c=SHORT, d=SHORT, lives=WATCHING)
    found = lanes(runs)
    assert found[0] == ("lives",)
    assert sorted(name for lane in found for name in lane) == sorted(runs.scenarios)
    assert len(found) == 3


def test_a_warped_run_measures_no_rate() -> None:
    assert lanes(rubric("slow", slow=scenario("warped", window_s=9))) == (("slow",),)
