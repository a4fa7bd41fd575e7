"""The roots that tests share: what took long is done once, and each test has an overlay of its own on it."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.fresh.room import Rooms, Root, missing

SETUP = Path(__file__).resolve().parents[2] / "scripts" / "setup.sh"


@pytest.fixture(scope="session")
def rooms(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Rooms]:
    why = missing()
    if why:
        pytest.skip(why)
    with Rooms(tmp_path_factory.mktemp("rooms")) as made:
        yield made


@pytest.fixture(scope="session")
def system(rooms: Rooms) -> Root:
    """Bare Debian, and then what `scripts/setup.sh --system-only` made of it."""

    def install(root: Root) -> None:
        root.copy_in(SETUP, "/tmp/scripts/setup.sh")
        root.run(["bash", "/tmp/scripts/setup.sh", "--system-only"], network=True, timeout=900)
        root.run(["apt-get", "clean"])  # as images of Debian do of themselves

    return rooms.prepared_root("system", SETUP.read_bytes(), install)


@pytest.fixture(scope="session")
def locks() -> Path:
    """Where the graders of this machine's tests find each other."""
    return Path(os.environ["XDG_RUNTIME_DIR"])
