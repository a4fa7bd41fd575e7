"""A rubric with criteria for people, and a class."""

from __future__ import annotations

from grader.rubric.model import Rubric

IDS = ("alice", "bob", "001234", "no", "Zoë Müller", "李明")


def rubric() -> Rubric:
    return Rubric.model_validate(
        {
            "schema": "grader.rubric/1",
            "id": "lab",
            "title": "A lab",
            "version": "1",
            "package": "lab1",
            "scenarios": {},
            "criteria": (
                {"id": "style", "title": "Style", "points": 10, "check": "manual"},
                {"id": "chatter-rate", "title": "10 Hz", "points": 90, "check": "rate"},
            ),
        }
    )
