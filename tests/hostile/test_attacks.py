"""Every attack is graded in a room of its own, and what must hold after it holds."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor

import pytest

from grader.arena.sandbox import why_no_sandbox
from grader.rubric.load import load_rubric
from tests.hostile.form import PROMISES, Run, attack_names, load_attack, rubric_path
from tests.hostile.harness import ROOT, Graded, faults, grade_in_room, why_no_groups, why_no_room

SIDE_BY_SIDE = 2  # they wait most of the time
ATTACKS_AT_LEAST = 140
NAMES = attack_names()
RUNS = [(name, run) for name in NAMES for run in load_attack(name).runs]
SECURITY = (ROOT / "SECURITY.md").read_text(encoding="utf-8")


def _marked(name, run):
    attack = load_attack(name)
    marks = [pytest.mark.xfail(reason=attack.finding, strict=True)] if attack.finding else []
    if attack.is_for_all_only(run):
        marks.append(pytest.mark.full)
    return pytest.param(name, run, marks=marks, id=f"{name}-{run.label}")


def test_there_are_enough() -> None:
    assert len(NAMES) >= ATTACKS_AT_LEAST
    for user, groups, least in (
        ("ordinary", "without", 15),
        ("ordinary", "with", 10),
        ("root", "without", 10),
    ):
        assert sum(run == Run(user, groups) for _, run in RUNS) >= least


def test_each_promise_is_attacked_in_make_test() -> None:
    often = {load_attack(name).promise for name, run in RUNS if not load_attack(name).is_for_all_only(run)}
    assert often == PROMISES.keys()


@pytest.mark.parametrize("promise", PROMISES)
def test_a_promise_is_one_of_those_in_the_document(promise) -> None:
    told = [line for line in SECURITY.splitlines() if line.startswith("| ") and PROMISES[promise] in line]
    assert len(told) == 1
    assert any(load_attack(name).promise == promise for name in NAMES)


@pytest.mark.parametrize("name", NAMES)
def test_declaration(name) -> None:
    attack, rubric = load_attack(name), load_rubric(str(rubric_path(name))).rubric
    assert set(attack.expect) <= {criterion.id for criterion in rubric.criteria}
    assert attack.error is None or not attack.expect


@pytest.fixture(scope="module")
def graded(request, tmp_path_factory) -> Iterator[dict[tuple[str, Run], Future[Graded]]]:
    """The selected attacks, some side by side, while the tests wait for their own one."""
    if reason := why_no_room() or why_no_sandbox():
        pytest.skip(reason)
    every = [getattr(getattr(item, "callspec", None), "params", {}) for item in request.session.items]
    chosen = [(params["attack"], params["run"]) for params in every if "run" in params]
    longest_first = sorted(dict.fromkeys(chosen), key=lambda pair: -load_attack(pair[0]).wall_s)
    out = tmp_path_factory.mktemp("hostile")
    with ThreadPoolExecutor(SIDE_BY_SIDE) as pool:
        yield {
            (name, run): pool.submit(grade_in_room, name, run, out / f"{name}-{run.label}")
            for name, run in longest_first
        }
        pool.shutdown(cancel_futures=True)


@pytest.mark.ros
@pytest.mark.slow
@pytest.mark.parametrize(("attack", "run"), [_marked(*pair) for pair in RUNS])
def test_attack(attack, run, graded) -> None:
    if run.groups == "with" and (reason := why_no_groups()):
        pytest.skip(reason)
    done = graded[attack, run].result()
    found = faults(attack, done)
    assert not found, "\n  ".join([f"{attack}, graded by {run.label}:", *found])
    shutil.rmtree(done.folder.parent)
