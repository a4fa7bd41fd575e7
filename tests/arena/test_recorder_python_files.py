"""Which files ROS's own Python reads, beside the build."""

from __future__ import annotations

import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest

from grader.arena.recorder import _python_files
from grader.package import read_package
from grader.ros_env import RosInstallation
from tests.arena.support import SCRIPT
from tests.package.trees import MANIFEST, make_package

HERE = sys.version_info[:2]


def read_by_ros(folder: Path, source: str, version: tuple[int, ...]) -> list[str]:
    facts = read_package(make_package(folder / "lab1", {"package.xml": MANIFEST, "node.py": source}))
    place = cast("Any", SimpleNamespace(ros=SimpleNamespace(python_version=version)))
    return _python_files(place, facts)


@pytest.mark.parametrize("version", [(), (3, 8)])
def test_all_where_it_may_be_another_python(tmp_path: Path, version: tuple[int, ...]) -> None:
    assert read_by_ros(tmp_path, SCRIPT, version) == ["node.py"]


def test_none_that_the_same_python_has_read_already(tmp_path: Path) -> None:
    assert read_by_ros(tmp_path, SCRIPT, HERE) == []


def test_all_where_one_is_wrong(tmp_path: Path) -> None:
    """What is said of it is said in the words of the Python that students have."""
    assert read_by_ros(tmp_path, SCRIPT + "print 'two'\n", HERE) == ["node.py"]


def test_the_version_is_that_of_the_file_behind_all_links(tmp_path: Path) -> None:
    (tmp_path / "python3.8").touch()
    (tmp_path / "python3").symlink_to("python3.8")
    (tmp_path / "other").touch()
    versions = [
        RosInstallation(
            kind="debian", where="", distro="", python=str(tmp_path / name), prefixes=(), env={}
        ).python_version
        for name in ("python3", "other")
    ]
    assert versions == [(3, 8), ()]
