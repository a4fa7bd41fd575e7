"""The simulator's pure modules, which live where ROS's Python imports them from."""

from __future__ import annotations

import importlib
import sys
from types import ModuleType

import pytest

from grader.arena.sandbox_files import STANDIN_SOURCES

PURE = ("background", "canvas", "pace", "turtle", "world")


class Simulator:
    """The modules by name: `simulator.turtle.Turtle`."""

    background: ModuleType
    canvas: ModuleType
    pace: ModuleType
    turtle: ModuleType
    world: ModuleType


@pytest.fixture(scope="session")
def simulator() -> Simulator:
    sys.path.insert(0, str(STANDIN_SOURCES / "turtlesim"))
    try:
        for name in PURE:
            setattr(Simulator, name, importlib.import_module(f"simulator.{name}"))
    finally:
        sys.path.remove(str(STANDIN_SOURCES / "turtlesim"))
    return Simulator()
