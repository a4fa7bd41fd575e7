"""Names of turtles, the background's parameters, and when steps are due."""

from __future__ import annotations

from typing import Any

import pytest

DEFAULT = (69, 86, 255)


class Params(dict[str, Any]):
    """A parameter server of one node's."""

    def has(self, name: str) -> bool:
        return name in self

    def set(self, name: str, value: object) -> None:
        self[name] = value


def _set(prefix: str, *values: object) -> dict[str, Any]:
    names = ("background_r", "background_g", "background_b")
    return {prefix + name: value for name, value in zip(names, values, strict=False)}


def test_turtles_get_the_next_free_name(field_module: Any) -> None:
    world = field_module.World()
    assert world.reset() == "turtle1"
    assert world.spawn("turtle2", 1.0, 2.0, 0.5) == "turtle2"
    assert world.spawn("", 1.0, 2.0, 0.5) == "turtle3"
    with pytest.raises(KeyError):
        world.spawn("turtle2", 0.0, 0.0, 0.0)
    world.kill("turtle1")
    with pytest.raises(KeyError):
        world.kill("turtle1")
    assert world.spawn("", 0.0, 0.0, 0.0) == "turtle4"
    assert world.reset() == "turtle1"
    assert list(world.turtles) == ["turtle1"]
    assert world.spawn("", 0.0, 0.0, 0.0) == "turtle2"


def test_the_first_turtle_stands_in_the_middle(field_module: Any) -> None:
    world = field_module.World()
    turtle = world.turtles[world.reset()]
    assert (turtle.x, turtle.y, turtle.theta) == (pytest.approx(5.544445, abs=1e-6), turtle.x, 0.0)


@pytest.mark.parametrize(
    ("given", "color"),
    [
        ({}, DEFAULT),
        (_set("~", 34, 139, 34), (34, 139, 34)),
        (_set("", 34, 139, 34), (34, 139, 34)),
        (_set("~", 1, 2, 3) | _set("", 34, 139, 34), (1, 2, 3)),
        (_set("~", 34), (34, 86, 255)),
        (_set("~", 34.4, 139.5, 0.0), (34, 140, 0)),
        (_set("~", "34", True, None), DEFAULT),
        (_set("~", 300, -1, 256), (44, 255, 0)),
        (_set("~", float("nan"), float("inf"), 7), (69, 86, 7)),
        (_set("", "green", 139, 34), (69, 139, 34)),
    ],
)
def test_background(field_module: Any, given: dict[str, Any], color: tuple[int, ...]) -> None:
    params = Params(given)
    background = field_module.Background(params)
    assert background.read() == color
    assert {name: params[name] for name in given} == given
    assert all("~" + name in params for name in _set("", 0, 0, 0))


def test_the_background_follows_what_is_set_later(field_module: Any) -> None:
    params = Params()
    background = field_module.Background(params)
    assert params == _set("~", *DEFAULT)
    params["~background_r"] = 150
    assert background.read() == (150, 86, 255)
    params["background_g"] = 20
    assert background.read() == (150, 20, 255)
    params.clear()
    assert background.read() == DEFAULT


def test_steps_follow_the_clock(field_module: Any) -> None:
    pace = field_module.Pace(0.016)
    times_s = [0.0, 0.016, 0.031, 0.048, 0.3]
    assert [pace.due(t, t) for t in times_s] == [0, 1, 0, 2, 15]


def test_no_step_is_lost_or_made_up_over_a_long_time(field_module: Any) -> None:
    pace = field_module.Pace(0.016)
    assert sum(pace.due(i * 0.0163, i * 0.0163) for i in range(10_001)) == int(163 / 0.016)


def test_a_fast_clock_makes_more_steps(field_module: Any) -> None:
    pace = field_module.Pace(0.016)
    due = [pace.due(i * 0.05, i * 0.0025) for i in range(321)]
    assert sum(due) == 1000
    assert set(due[1:]) == {3, 4}


def test_a_clock_that_stands_still_gives_way_to_the_walls(field_module: Any) -> None:
    pace = field_module.Pace(0.016)
    walls = [i * 0.016 for i in range(200)]
    steps = sum(pace.due(0.0, wall_s) for wall_s in walls)
    assert steps == pytest.approx((walls[-1] - 1.0) / 0.016, abs=2)
    assert pace.due(0.5, 3.2) == 31


def test_a_clock_that_jumps_makes_no_flood(field_module: Any) -> None:
    pace = field_module.Pace(0.016)
    jumps = [1.7e9, 5.0, 5.016, 4.0, 4.016]
    pace.due(0.0, 0.0)
    assert [pace.due(clock_s, wall_s) for wall_s, clock_s in enumerate(jumps)] == [1000, 0, 1, 0, 1]
