"""The longest file begins first: the others run beside it (`-n 2 --dist loadfile`)."""

from __future__ import annotations

import pytest

LONGEST = "test_fixtures.py"


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    items.sort(key=lambda item: item.path.name != LONGEST)
