"""A bounded, repeatable run: the whole corpus, then mutations of it and structured input. `make fuzz` goes on."""

from __future__ import annotations

import random
from collections.abc import Iterator

import pytest
from hypothesis import HealthCheck, Phase, given, settings

from tests.fuzz.grammars import GRAMMARS
from tests.fuzz.mutate import mutated
from tests.fuzz.parent import Runner
from tests.fuzz.readers import READERS
from tests.fuzz.targets import CORPUS, ROS_SIDE, TARGETS

MUTATED, GROWN = 40, 20
MUTATED_BYTES_MAX = 6_000
EACH = [
    pytest.param(name, marks=[pytest.mark.ros] if name in ROS_SIDE else [], id=name)
    for name in sorted(TARGETS)
]


@pytest.fixture(scope="module")
def runner() -> Iterator[Runner]:
    runner = Runner()
    yield runner
    runner.close()


def test_every_target_has_seeds_and_every_seed_a_target() -> None:
    assert {path.name for path in CORPUS.iterdir()} == set(TARGETS)
    assert all(target.seeds for target in TARGETS.values())
    assert READERS.keys() | ROS_SIDE == TARGETS.keys()


@pytest.mark.full
@pytest.mark.parametrize("name", EACH)
def test_the_corpus(name: str, runner: Runner) -> None:
    found = {seed: TARGETS[name].run(runner, data) for seed, data in TARGETS[name].seeds.items()}
    assert {seed: str(outcome) for seed, outcome in found.items() if outcome.finding} == {}


@pytest.mark.full
@pytest.mark.parametrize("name", EACH)
def test_mutations(name: str, runner: Runner) -> None:
    rng = random.Random(name)  # noqa: S311 - a fixed choice
    seeds = [data for data in TARGETS[name].seeds.values() if len(data) < MUTATED_BYTES_MAX]
    for _ in range(MUTATED):
        data = mutated(rng.choice(seeds), seeds, rng)
        outcome = TARGETS[name].run(runner, data)
        assert not outcome.finding, f"{outcome}\n{data!r}"


@pytest.mark.full
@pytest.mark.parametrize("name", EACH)
def test_structured_input(name: str, runner: Runner) -> None:
    @settings(
        max_examples=GROWN,
        derandomize=True,
        database=None,
        deadline=None,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )
    @given(GRAMMARS[name]())
    def grown(data: bytes) -> None:
        outcome = TARGETS[name].run(runner, data)
        assert not outcome.finding, f"{outcome}\n{data!r}"

    grown()
