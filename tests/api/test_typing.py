"""A program of a user's that is checked by `mypy --strict` against the installed package."""

from __future__ import annotations

import shutil
import subprocess
import sys
import sysconfig
import venv
from pathlib import Path

import pytest

import grader

PROGRAM = """
from collections.abc import Iterator
from pathlib import Path

from grader import (
    CriterionResult,
    FileCitation,
    GraderError,
    GradingResult,
    LoadedRubric,
    Rubric,
    Status,
    __version__,
    grade,
    judge,
    load_result,
    load_rubric,
)


def lost(result: GradingResult) -> Iterator[tuple[str, float]]:
    for criterion in result.criteria:
        if criterion.status is not Status.PASS:
            yield criterion.id, criterion.max_points - criterion.points


def lines(criterion: CriterionResult) -> list[int | None]:
    return [cited.line for cited in criterion.citations if isinstance(cited, FileCitation)]


def main() -> str:
    lab: LoadedRubric = load_rubric(Path("lab.yaml"))
    rubric: Rubric = lab.rubric
    try:
        result = grade("ada", lab, "out", submission_id="ada", static_only=True, progress=print)
    except GraderError as error:
        return f"{error.message} ({error.hint}) {error.kind} {error.blame} {error.exit_code}"
    again: GradingResult = judge([Path("out/ada/evidence")], "leeds-comp3631-lab1")
    points: float = load_result("out/ada").points
    return f"{rubric.title} {dict(lost(again))} {lines(result.criteria[0])} {points} {__version__}"
"""
MISTAKES = """
from grader import GradingResult, grade, judge, load_rubric, mark

grade("ada", "lab", "out", "ada")
grade("ada", "lab", sandbox="maybe")
judge(5, "lab")
number: int = load_rubric("lab")
points: str = judge("evidence", "lab").points
"""


@pytest.fixture(scope="module")
def place(tmp_path_factory) -> Path:
    """A virtual environment where the grader lies as an installed package does, and mypy's answers are kept."""
    folder = tmp_path_factory.mktemp("typed")
    venv.create(folder / "venv", symlinks=True, with_pip=False)
    version = f"python{sys.version_info.major}.{sys.version_info.minor}"
    packages = folder / "venv" / "lib" / version / "site-packages"
    shutil.copytree(
        Path(grader.__file__).parent, packages / "grader", ignore=shutil.ignore_patterns("__pycache__")
    )
    (packages / "others.pth").write_text(sysconfig.get_paths()["purelib"] + "\n")
    return folder


def checked(place: Path, program: str) -> list[str]:
    (place / "program.py").write_text(program)
    python = place / "venv" / "bin" / "python"
    command = [sys.executable, "-m", "mypy", "--strict", "--python-executable", str(python), "program.py"]
    command += ["--cache-dir", str(place / "cache"), "--config-file=", "--no-error-summary"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=place)
    assert not done.stderr
    return done.stdout.splitlines()


@pytest.mark.full
def test_a_users_program_is_sound(place: Path) -> None:
    assert checked(place, PROGRAM) == []


@pytest.mark.full
def test_a_users_mistakes_are_found(place: Path) -> None:
    found = checked(place, MISTAKES)
    assert {line.split(":")[1] for line in found if ": error: " in line} == {"2", "4", "5", "6", "7", "8"}


@pytest.mark.full
def test_it_is_the_mark_that_makes_it_typed(place: Path) -> None:
    """Without it, mypy takes nothing from an installed package: so it was that package that was looked at."""
    mark = next((place / "venv").rglob("site-packages/grader/py.typed"))
    mark.unlink()
    try:
        assert "py.typed marker" in "\n".join(checked(place, "import grader\n"))
    finally:
        mark.touch()
