"""All checks that a rubric may name."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from grader.checks import CHECKS, Check
from grader.rubric.own_checks.testing import pytest_check


def known_checks(folder: Path, own: Mapping[str, Check]) -> dict[str, Check]:
    """The grader's, `pytest` for tests in the rubric's folder, and the rubric's own."""
    tests = pytest_check(folder)
    return {**CHECKS, tests.name: tests, **own}
