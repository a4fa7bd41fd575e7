"""Every fixture gets exactly the statuses that it declares, and the reference solution gets full marks."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import Future

import pytest

from grader.model.result import GradingResult
from grader.model.verdict import Status
from tests.fixture_runs import (
    GIT,
    REFERENCE,
    ROOT,
    expected_points,
    fixture_names,
    grade_fixture,
    in_turn,
    labs,
    read_fixture,
    rubric_of,
    shorter_round,
    surprises,
    workers,
)

LABS = labs()
FAULTY_AT_LEAST = {"leeds-comp3631-lab1": 20}
NAMED = [(lab, name) for lab in LABS for name in fixture_names(lab)]
SHORTER = {(lab, name) for lab in LABS for name in (REFERENCE, *shorter_round(lab))}
GRADED = [(lab, name) for lab in LABS for name in (REFERENCE, *fixture_names(lab))]
MAKE = ROOT / "fixtures" / "make.py"
SCRIPT_MODE = "100755"


each_lab = pytest.mark.parametrize("lab", LABS)
each_fixture = pytest.mark.parametrize(("lab", "name"), NAMED)


@pytest.fixture(scope="module")
def graded(request, tmp_path_factory) -> Iterator[dict[tuple[str, str], Future[GradingResult]]]:
    """The selected fixtures, graded side by side while the tests wait for their own one."""
    every = [getattr(getattr(item, "callspec", None), "params", {}) for item in request.session.items]
    chosen = [(params["lab"], params["graded_name"]) for params in every if "graded_name" in params]
    out = tmp_path_factory.mktemp("graded")
    with workers() as pool:
        yield {pair: pool.submit(grade_fixture, *pair, out) for pair in in_turn(dict.fromkeys(chosen))}


@each_lab
def test_there_are_enough_faults(lab) -> None:
    faulty = [name for name in fixture_names(lab) if not name.startswith("ok-")]
    assert len(faulty) >= FAULTY_AT_LEAST.get(lab, 12)
    assert all(read_fixture(lab, name).expect for name in faulty)


@each_lab
def test_every_criterion_is_missed_in_the_shorter_round(lab) -> None:
    missed = {
        i
        for name in shorter_round(lab)
        for i, status in read_fixture(lab, name).expect.items()
        if status in {Status.FAIL, Status.PARTIAL}
    }
    assert missed == {criterion.id for criterion in rubric_of(lab).criteria}


@each_fixture
def test_declaration(lab, name) -> None:
    fixture, rubric = read_fixture(lab, name), rubric_of(lab)
    ids = {criterion.id for criterion in rubric.criteria}
    assert fixture.lab == lab
    assert set(fixture.expect) | set(fixture.message) <= ids
    assert Status.PASS not in fixture.expect.values()
    assert 0 <= expected_points(fixture, rubric) <= rubric.max_points
    assert name.startswith("ok-") == (expected_points(fixture, rubric) == rubric.max_points)
    for pattern in fixture.message.values():
        re.compile(pattern)


@each_fixture
def test_one_cause_explains_what_is_blocked(lab, name) -> None:
    expect = read_fixture(lab, name).expect
    requires = {criterion.id: criterion.requires for criterion in rubric_of(lab).criteria}
    blocked = [i for i, status in expect.items() if status is Status.BLOCKED]
    assert [i for i in blocked if not set(requires[i]) & set(expect)] == []


def test_files_are_as_declared() -> None:
    done = subprocess.run([sys.executable, MAKE, "--check"], capture_output=True, text=True, check=False)
    assert (done.stdout, done.returncode) == ("as declared\n", 0)


def test_git_keeps_the_executable_bits() -> None:
    """A checkout's file system may lie; what is graded on another machine comes from git's tree."""
    folders = ("fixtures", "reference_solutions")
    done = subprocess.run([GIT, "ls-files", "-sz", *folders], cwd=ROOT, capture_output=True, check=False)
    if done.returncode or not done.stdout:
        pytest.skip("not in a git checkout")
    entries = dict(reversed(line.split("\t")) for line in done.stdout.decode().split("\0") if line)
    regular = {path: stat for path, stat in entries.items() if not stat.startswith("120000")}
    wrong = [
        path
        for path, stat in regular.items()
        if (ROOT / path).is_file()
        and stat.startswith(SCRIPT_MODE) != bool((ROOT / path).stat().st_mode & 0o100)
    ]
    assert wrong == []


@pytest.mark.ros
@pytest.mark.slow
@pytest.mark.parametrize(
    ("lab", "graded_name"),
    [pytest.param(*pair, marks=[] if pair in SHORTER else pytest.mark.full) for pair in GRADED],
)
def test_graded_for_real(lab, graded_name, graded) -> None:
    result, rubric = graded[lab, graded_name].result(), rubric_of(lab)
    found = surprises(result, read_fixture(lab, graded_name), rubric)
    assert not found, "\n  ".join([f"{lab}/{graded_name} is not graded as declared:", *found])
    assert {c.id for c in result.criteria} == {c.id for c in rubric.criteria}
