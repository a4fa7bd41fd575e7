"""Answers of a service can only be judged to calls that the scenario makes."""

from __future__ import annotations

from pathlib import Path

import pytest

from grader.errors import RubricError
from grader.rubric.load import load_rubric
from tests.rubric.samples import spoiled

CALL = "{service: /reset, type: std_srvs/Empty}"
CRITERION = """    check: service-answers
    with: {service: /reset, expect: [{}, {}]}
"""


def with_calls(folder: Path, calls: str) -> Path:
    """The sound rubric with a criterion for two answers, and these calls in its scenario."""
    return spoiled(
        folder,
        ("    check: rate\n    with: {topic: /chatter, rate_hz: 10}\n", CRITERION),
        ("    until: {", f"    calls: [{calls}]\n    until: {{"),
    )


@pytest.mark.parametrize("calls", [f"{CALL}, {CALL}", f"{CALL}, {CALL}, {CALL}"])
def test_enough_calls(tmp_path: Path, calls: str) -> None:
    assert load_rubric(str(with_calls(tmp_path, calls))).rubric.criteria[0].check == "service-answers"


@pytest.mark.parametrize(
    ("calls", "made"),
    [
        (CALL, "1 of them"),
        ("", "none"),
        ("{service: /other, type: std_srvs/Empty}", "none"),
    ],
)
def test_too_few_calls_are_a_fault(tmp_path: Path, calls: str, made: str) -> None:
    with pytest.raises(RubricError) as caught:
        load_rubric(str(with_calls(tmp_path, calls)))
    [fault] = caught.value.faults
    assert fault.endswith(
        f"lab.yaml:18: criteria[0].with.expect: asks for 2 calls of /reset; real makes {made}"
    )
