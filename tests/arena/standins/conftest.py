"""The simulator's pure module, which lives where ROS's Python imports it from."""

from __future__ import annotations

import importlib
import sys
from types import ModuleType

import pytest

from grader.arena.sandbox_files import STANDIN_SOURCES


@pytest.fixture(scope="session")
def field_module() -> ModuleType:
    sys.path.insert(0, str(STANDIN_SOURCES / "turtlesim"))
    try:
        return importlib.import_module("field")
    finally:
        sys.path.remove(str(STANDIN_SOURCES / "turtlesim"))
