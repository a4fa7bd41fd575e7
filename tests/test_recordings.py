"""Real recordings that are kept for ever: they are read and judged as on the day they were made."""

from __future__ import annotations

from pathlib import Path

import pytest

from grader.evidence.reader import load_evidence
from grader.judging import judge
from grader.judging.summary import total_points
from grader.model.verdict import Status
from grader.rubric.load import load_rubric

RECORDINGS = Path(__file__).parent / "data" / "recordings"
LOST = {"correct": set[str](), "dies-at-128": {"counter-wrap"}}


def test_every_recording_has_its_expectation() -> None:
    assert {path.name for path in RECORDINGS.iterdir()} == set(LOST)


@pytest.mark.parametrize("name", sorted(LOST))
def test_a_kept_recording_is_judged_as_ever(name: str) -> None:
    rubric = load_rubric("leeds-comp3631-lab1").rubric
    criteria = judge(rubric, load_evidence([RECORDINGS / name]))
    assert {c.id for c in criteria if c.status is not Status.PASS} == LOST[name]
    lost_points = sum(c.points for c in rubric.criteria if c.id in LOST[name])
    assert total_points(rubric, criteria) == rubric.max_points - lost_points


def test_the_first_value_and_two_wraps_are_in_the_evidence() -> None:
    run = load_evidence([RECORDINGS / "correct"])["wraps"]
    (channel,) = run.student_channels("/numeric_chatter")
    assert channel.data[:257] == tuple(n % 128 for n in range(257))
