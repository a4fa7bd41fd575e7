"""Every fixture gets exactly the statuses that it declares, and the reference solution gets full marks."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import Future

import pytest

from grader.model.result import GradingResult
from grader.model.verdict import Status
from grader.rubric.load import load_rubric
from grader.rubric.model import Rubric
from tests.fixture_runs import (
    REFERENCE,
    ROOT,
    expected_points,
    fixture_names,
    grade_fixture,
    read_fixture,
    surprises,
    workers,
)

LAB = "leeds-comp3631-lab1"
NAMES = fixture_names(LAB)
MAKE = ROOT / "fixtures" / "make.py"
SCRIPT_MODE = "100755"


@pytest.fixture(scope="module")
def rubric() -> Rubric:
    return load_rubric(LAB).rubric


@pytest.fixture(scope="module")
def graded(request, tmp_path_factory) -> Iterator[dict[str, Future[GradingResult]]]:
    """The selected fixtures, graded side by side while the tests wait for their own one."""
    chosen = [i.callspec.params["graded_name"] for i in request.session.items if _is_graded(i)]
    out = tmp_path_factory.mktemp("graded")
    with workers() as pool:
        yield {name: pool.submit(grade_fixture, LAB, name, out) for name in dict.fromkeys(chosen)}


def _is_graded(item: pytest.Item) -> bool:
    return "graded_name" in getattr(getattr(item, "callspec", None), "params", {})


def test_there_are_enough_faults() -> None:
    faulty = [name for name in NAMES if set(read_fixture(LAB, name).expect.values()) - {Status.PASS}]
    assert len(faulty) >= 20


def test_every_criterion_is_missed_by_a_fixture(rubric) -> None:
    missed = {
        i for name in NAMES for i, status in read_fixture(LAB, name).expect.items() if status is Status.FAIL
    }
    assert missed == {criterion.id for criterion in rubric.criteria}


@pytest.mark.parametrize("name", NAMES)
def test_declaration(name, rubric) -> None:
    fixture = read_fixture(LAB, name)
    ids = {criterion.id for criterion in rubric.criteria}
    assert fixture.lab == LAB
    assert set(fixture.expect) | set(fixture.message) <= ids
    assert Status.PASS not in fixture.expect.values()
    assert 0 <= expected_points(fixture, rubric) <= rubric.max_points
    assert name.startswith("ok-") == (expected_points(fixture, rubric) == rubric.max_points)
    for pattern in fixture.message.values():
        re.compile(pattern)


@pytest.mark.parametrize("name", NAMES)
def test_one_cause_explains_what_is_blocked(name, rubric) -> None:
    expect = read_fixture(LAB, name).expect
    requires = {criterion.id: criterion.requires for criterion in rubric.criteria}
    blocked = [i for i, status in expect.items() if status is Status.BLOCKED]
    assert [i for i in blocked if not set(requires[i]) & set(expect)] == []


def test_files_are_as_declared() -> None:
    done = subprocess.run([sys.executable, MAKE, "--check"], capture_output=True, text=True, check=False)
    assert (done.stdout, done.returncode) == ("as declared\n", 0)


def test_git_keeps_the_executable_bits() -> None:
    """A checkout's file system may lie; what is graded on another machine comes from git's tree."""
    folders = ("fixtures/" + LAB, "reference_solutions/" + LAB)
    git = shutil.which("git") or "git"
    done = subprocess.run([git, "ls-files", "-sz", *folders], cwd=ROOT, capture_output=True, check=False)
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
@pytest.mark.parametrize("graded_name", [REFERENCE, *NAMES])
def test_graded_for_real(graded_name, graded, rubric) -> None:
    result = graded[graded_name].result()
    found = surprises(result, read_fixture(LAB, graded_name), rubric)
    assert not found, "\n  ".join([f"{graded_name} is not graded as declared:", *found])
    assert {c.id for c in result.criteria} == {c.id for c in rubric.criteria}
