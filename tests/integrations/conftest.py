"""A runner with the grader in place, and packages to check."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from tests.integrations.runner import ROOT, Runner, installed

SOLUTION = ROOT / "reference_solutions" / "leeds-comp3631-lab1" / "lab1"


@pytest.fixture
def runner(tmp_path) -> Runner:
    """A runner without ROS; its workspace is empty."""
    for name in ("temp/home", "work/lab student"):  # a path with a blank in it
        (tmp_path / name).mkdir(parents=True)
    installed(tmp_path / "temp" / "ros-lab-grader")
    return Runner(
        temp=tmp_path / "temp",
        workspace=tmp_path / "work" / "lab student",
        more={"GRADER_ROS_SETUP": "none", "PYTHONDONTWRITEBYTECODE": "1"},
    )


def handed_in(workspace: Path, name: str = "ws/src/my lab") -> Path:
    """The correct package of a lab, in a repository."""
    (workspace / ".git").mkdir(exist_ok=True)
    package = workspace / name
    shutil.copytree(SOLUTION, package, dirs_exist_ok=True)
    return package
