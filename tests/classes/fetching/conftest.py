"""A server without a network."""

from __future__ import annotations

import pytest

from tests.classes.fetching.samples import server_in


@pytest.fixture
def server(tmp_path, monkeypatch):
    return server_in(tmp_path, monkeypatch)
