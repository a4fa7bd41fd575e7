"""Every attack is graded in a room of its own, and what must hold after it holds."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor

import pytest

from grader.arena.probe import why_not
from grader.rubric.load import load_rubric
from tests.hostile.form import attack_names, load_attack, rubric_path
from tests.hostile.harness import Graded, faults, grade_in_room, why_no_room

SIDE_BY_SIDE = 2  # they wait most of the time
ATTACKS_AT_LEAST = 50
NAMES = attack_names()
SHOWN_ALWAYS = {"shown-log-lines", "shown-manifest", "shown-messages"}
"""One for each way in; what the others would show, `tests/report` and `tests/cli` hold too."""
RUNS = [(name, user) for name in NAMES for user in load_attack(name).users]


def _marked(name, user):
    finding = load_attack(name).finding
    marks = [pytest.mark.xfail(reason=finding, strict=True)] if finding else []
    if name.startswith("shown-") and name not in SHOWN_ALWAYS:
        marks.append(pytest.mark.full)
    return pytest.param(name, user, marks=marks, id=f"{name}-{user}")


def test_there_are_enough() -> None:
    assert len(NAMES) >= ATTACKS_AT_LEAST
    assert sum("ordinary" in load_attack(name).users for name in NAMES) >= 12


@pytest.mark.parametrize("name", NAMES)
def test_declaration(name) -> None:
    attack, rubric = load_attack(name), load_rubric(str(rubric_path(name))).rubric
    assert set(attack.expect) <= {criterion.id for criterion in rubric.criteria}
    assert attack.error is None or not attack.expect


@pytest.fixture(scope="module")
def graded(request, tmp_path_factory) -> Iterator[dict[tuple[str, str], Future[Graded]]]:
    """The selected attacks, some side by side, while the tests wait for their own one."""
    if reason := why_no_room() or why_not():
        pytest.skip(reason)
    every = [getattr(getattr(item, "callspec", None), "params", {}) for item in request.session.items]
    chosen = [(params["attack"], params["user"]) for params in every if "user" in params]
    longest_first = sorted(dict.fromkeys(chosen), key=lambda pair: -load_attack(pair[0]).wall_s)
    out = tmp_path_factory.mktemp("hostile")
    with ThreadPoolExecutor(SIDE_BY_SIDE) as pool:
        yield {pair: pool.submit(grade_in_room, *pair, out / "-".join(pair)) for pair in longest_first}
        pool.shutdown(cancel_futures=True)


@pytest.mark.ros
@pytest.mark.slow
@pytest.mark.parametrize(("attack", "user"), [_marked(*run) for run in RUNS])
def test_attack(attack, user, graded) -> None:
    done = graded[attack, user].result()
    found = faults(attack, done)
    assert not found, "\n  ".join([f"{attack}, graded by {user}:", *found])
    shutil.rmtree(done.folder.parent)
