"""Each Python that the metadata names: installs the wheel, looks at a package's files, judges a recording."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from pathlib import Path

import pytest

from tests.packaging.conftest import LAB
from tests.packaging.making import ROOT, Built, Installed, find, install, once, plain_environment, virtual

RECORDINGS = ROOT / "tests" / "data" / "recordings"
NAMED = re.findall(r"Python :: (3\.\d+)", (ROOT / "pyproject.toml").read_text(encoding="utf-8"))


@pytest.fixture(scope="module", params=NAMED)
def grader(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory, packages: Built
) -> Installed:
    """The wheel in a clean environment of that Python, with the dependencies that it gets there."""
    python = find(request.param)
    if python is None:
        pytest.skip(f"no Python {request.param} here, neither on PATH nor in ~/.pyenv/versions")

    def make(folder: Path) -> None:
        install(virtual(python, folder / "venv"), packages.wheel)

    folder = once(tmp_path_factory, f"python-{request.param}", make)
    grader = Installed(program=folder / "venv" / "bin" / "grader", environment=plain_environment())
    assert f"\nPython {request.param}." in grader("--version", cwd=folder)
    return grader


def statuses(criteria: list[Mapping[str, object]]) -> dict[object, object]:
    return {one["id"]: one["status"] for one in criteria}


@pytest.mark.full
def test_it_judges_recordings_alike(grader: Installed, tmp_path: Path):
    correct = json.loads(grader("judge", RECORDINGS / "correct", "--rubric", LAB, cwd=tmp_path))
    dies = json.loads(grader("judge", RECORDINGS / "dies-at-128", "--rubric", LAB, cwd=tmp_path, code=1))
    assert set(statuses(correct).values()) == {"pass"}
    assert statuses(dies)["counter-wrap"] == "fail"


@pytest.mark.full
def test_it_checks_a_package_s_files(grader: Installed, package: Path):
    (package / "src" / "numeric_talker.py").chmod(0o644)
    found = statuses(json.loads(grader("check", "--static", "--json", cwd=package, code=1))["criteria"])
    assert found["manifest"] == "pass"
    assert found["talker-executable"] == "fail"
