"""Versions of formats (`report/file_formats.py`): `grader.result/1` is version 1 of `grader.result`."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass

UPDATE = "update the grader: install its new version as you installed this one"
# `int` takes time with the square of the number of digits, and a file may have any.
_DIGITS_MAX = 9


@dataclass(frozen=True)
class Versioned:
    """A format that this grader writes in `version`, and reads in all versions up to it."""

    name: str
    version: int

    def __str__(self) -> str:
        """Return it as files have it: `grader.result/1`."""
        return f"{self.name}/{self.version}"

    @property
    def short(self) -> str:
        """Return it as people say it: `result`."""
        return self.name.removeprefix("grader.")

    def newer(self, said: object) -> str:
        """Return what is wrong, on one line, if `said` is a later version than this grader reads; else ""."""
        found = re.fullmatch(rf"{re.escape(self.name)}/([0-9]{{1,{_DIGITS_MAX}}})", str(said)[:100])
        if found is None or int(found[1]) <= self.version:
            return ""
        return f"written by a newer grader ({found[0]}); this one reads up to {self.version}"

    def newer_in(self, data: bytes) -> str:
        """Return the same for the bytes of a JSON file; "" for anything else."""
        try:
            found = json.loads(data)
        except (ValueError, RecursionError):
            return ""
        return self.newer(found.get("schema")) if isinstance(found, dict) else ""


RESULT = Versioned("grader.result", 1)
RUN = Versioned("grader.run", 1)
EVIDENCE = Versioned("grader.evidence", 1)
RUBRIC = Versioned("grader.rubric", 1)
OVERRIDES = Versioned("grader.overrides", 1)
COMMENTS = Versioned("grader.comments", 1)
MUTANTS = Versioned("grader.mutants", 1)
RUBRIC_TEST = Versioned("grader.rubric-test", 1)
SIMILARITY = Versioned("grader.similarity", 1)
PUBLISHED = Versioned("grader.published", 1)
SENT = Versioned("grader.sent", 1)
COURSE = Versioned("grader.course", 1)
ALL = (
    RESULT,
    EVIDENCE,
    RUBRIC,
    OVERRIDES,
    COMMENTS,
    RUN,
    PUBLISHED,
    SENT,
    COURSE,
    SIMILARITY,
    MUTANTS,
    RUBRIC_TEST,
)
