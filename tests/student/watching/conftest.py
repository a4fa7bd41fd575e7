"""A student's package, for every test of watching."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.student.watching.labs import LEEDS, copy_of


@pytest.fixture
def package(tmp_path: Path) -> Path:
    return copy_of(LEEDS, tmp_path)
