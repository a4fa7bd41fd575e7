"""A rubric with criteria for people, and a class."""

from __future__ import annotations

from grader.rubric.model import Rubric
from tests.support.rubrics import rubric as rubric_of

IDS = ("alice", "bob", "001234", "no", "Zoë Müller", "李明")


def rubric() -> Rubric:
    return rubric_of(
        {"id": "style", "title": "Style", "points": 10, "check": "manual"},
        {"id": "chatter-rate", "title": "10 Hz", "points": 90, "check": "rate"},
    )
