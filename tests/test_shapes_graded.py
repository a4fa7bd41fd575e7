"""Two and three faults at once, graded for real: what the first report says leads to full marks."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path, PurePosixPath

import pytest

from fixtures.make import labs, rubric_of, solution_of
from grader.authoring.mutation.solution import write_tree
from grader.model.repair import DEFAULT_SHARES, Repair
from grader.model.result import GradingResult, Silence
from grader.model.verdict import Status
from grader.pipeline import GradeOptions, grade
from grader.rubric.model import Rubric
from tests.support.advice import apply_advice, faulty_advice
from tests.support.shapes import LOGIC, ROUNDS_MAX, found_in, repair, shapes_of

pytestmark = [pytest.mark.ros, pytest.mark.slow, pytest.mark.usefixtures("without_processes")]
QUICK = "eyantra-ros-basics/yaml-key-misspelt+bit-removed"
BY_TEXT = (
    "eyantra-ros-basics/bit-removed+launch-type-without-py",
    "leeds-comp3631-lab1/bit-removed+tabs-and-spaces+no-catkin-package",
    "mcr2-basic-comms/manifest-malformed+no-shebang",
    "sheffield-com2009-week1/project-renamed+typographic-quote",
    "york-ele00118m-lab7/buildtool-dropped+shebang-typo",
)
"""Graded too after what the report says has been done word by word, one for each lab."""


@pytest.mark.parametrize(
    "shape",
    [
        pytest.param(name, marks=[] if name == QUICK else pytest.mark.full)
        for lab in labs()
        for name in shapes_of(lab)
    ],
)
def test_the_hints_lead_to_full_marks(shape: str, tmp_path: Path) -> None:
    lab = shape.partition("/")[0]
    write_tree(shapes_of(lab)[shape], tmp_path / "copy")
    first = last = graded(tmp_path, lab, 0)
    assert_consistent(first, rubric_of(lab).rubric)
    assert faulty_advice(first.criteria, tmp_path / "copy") == []
    for number in range(1, ROUNDS_MAX + 1):
        repairs = tuple(one for one in found_in(tmp_path / "copy", lab) if is_told(last, one))
        if not repairs:
            break
        repair(tmp_path / "copy", lab, repairs)
        last = graded(tmp_path, lab, number)
        assert lost(last) <= lost(first), f"the first report did not name {lost(last) - lost(first)}"
    logic = set(shape.partition("/")[2].split("+")) & {
        *LOGIC,
        "python2-print",
    }  # it prints no message any more
    assert logic or lost(last) == set(), [f"{c.id}: {c.message}" for c in last.criteria if c.id in lost(last)]
    assert last.points >= first.points


@pytest.mark.full
@pytest.mark.parametrize("shape", BY_TEXT)
def test_the_text_of_a_graded_report_leads_to_full_marks(shape: str, tmp_path: Path) -> None:
    lab = shape.partition("/")[0]
    write_tree(shapes_of(lab)[shape], tmp_path / "copy")
    package = tmp_path / "copy" / solution_of(lab).folder
    last = graded(tmp_path, lab, 0)
    assert lost(last)
    for number in range(1, ROUNDS_MAX + 1):
        told = {c.hint: c for c in last.criteria if c.status.is_lost and c.status is not Status.BLOCKED}
        for criterion in told.values():
            if criterion.repaired is None or criterion.repaired.charged:
                apply_advice(criterion, package)
        last = graded(tmp_path, lab, number)
        if not lost(last):
            break
    assert {c.id: c.hint for c in last.criteria if c.id in lost(last)} == {}


def graded(folder: Path, lab: str, number: int) -> GradingResult:
    options = GradeOptions(submission_id=str(number))
    return grade(str(folder / "copy"), rubric_of(lab), folder / "out", options, Silence())


def lost(result: GradingResult) -> set[str]:
    """The criteria that are not reached; what is worth no points is advice, and counts as well."""
    assert not [c.id for c in result.criteria if c.status.is_retryable]
    return {c.id for c in result.criteria if c.status.is_lost}


def is_told(result: GradingResult, one: Repair) -> bool:
    """Return whether what is said of a lost criterion names the file, and the command or all that is new in a line."""
    new = set(Counter(_words(one.after)) - Counter(_words(one.before)))
    name = PurePosixPath(one.file).name
    texts = [f"{c.message} {c.hint}" for c in result.criteria if c.status.is_lost]
    return any(
        name in text and (one.fix in text or bool(new and all(word in text for word in new)))
        for text in texts
    )


def _words(text: str) -> Iterator[str]:
    yield from re.findall(r"\w+|[^\w\s]", text)


def assert_consistent(result: GradingResult, rubric: Rubric) -> None:
    """One mistake is charged once, shares are kept, and no two hints contradict each other."""
    used = [(c, c.repaired) for c in result.criteria if c.repaired is not None]
    charged = [one for _, found in used if found.charged for one in found.repairs]
    assert len(charged) == len(set(charged))
    for criterion, found in used:
        if found.charged or not criterion.max_points:
            assert criterion.points < criterion.max_points or not criterion.max_points
        else:
            assert found.share == min(DEFAULT_SHARES[one.kind] for one in found.repairs)
            assert criterion.points in (0, found.share * criterion.max_points)
    fixes = {(one.file, one.line, one.fix) for _, found in used for one in found.repairs}
    assert len({(file, line) for file, line, _ in fixes}) == len(fixes)
    hints = [c.hint for c in result.criteria if c.status.is_lost]
    assert {name for hint in hints for name in re.findall(r'(?<!for )pkg="([\w-]+)"', hint)} <= {
        rubric.package
    }
    first = {name for hint in hints for name in re.findall(r"^fix ([\w-]+) first$", hint)}
    assert first <= lost(result)
