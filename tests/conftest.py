"""The longest file begins first: the others run beside it (`-n 2 --dist loadfile`). Examples of properties have no
deadline: on a machine that is shared, how long one takes says nothing."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import settings

settings.register_profile("grader", deadline=None)
settings.load_profile("grader")
LONGEST = "test_fixtures.py"


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    items.sort(key=lambda item: item.path.name != LONGEST)


@pytest.fixture
def open_path() -> Iterator[Path]:
    """A folder that other users can pass: pytest keeps `tmp_path` to whoever runs it."""
    with tempfile.TemporaryDirectory(prefix="grader-test-") as name:
        path = Path(name)
        path.chmod(0o755)
        yield path
