"""A new check is the three edits of CONTRIBUTING.md, no more and no less."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from scripts.pages import ROOT
from tests.docs.console import File, steps

AT_ITS_END = ", at its end"
EDITS = [
    step for step in steps((ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")) if isinstance(step, File)
]


@pytest.fixture(scope="module")
def edited(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A clone with the edits in it, and the pages made anew."""
    clone = tmp_path_factory.mktemp("contributing") / "clone"
    git = shutil.which("git")
    assert git
    subprocess.run([git, "clone", "-q", ROOT, clone], check=True)
    for edit in EDITS:
        path = clone / edit.name.removesuffix(AT_ITS_END)
        path.parent.mkdir(parents=True, exist_ok=True)
        before = path.read_text(encoding="utf-8") + "\n\n" if edit.name.endswith(AT_ITS_END) else ""
        before = before.rstrip("\n") + "\n" if path.suffix == ".yaml" and before else before
        path.write_text(before + edit.content, encoding="utf-8")
    _run(clone, "-m", "scripts.reference")
    return clone


def _run(clone: Path, *words: str) -> str:
    done = subprocess.run(
        [sys.executable, *words],
        cwd=clone,
        env={"PATH": "/usr/bin:/bin", "PYTHONPATH": str(clone), "PYTHONDONTWRITEBYTECODE": "1"},
        capture_output=True,
        text=True,
        check=False,
        timeout=250,
    )
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    return done.stdout


def test_it_is_three_edits() -> None:
    assert [edit.name.split("/")[0] for edit in EDITS] == ["grader", "rubrics", "tests"]


def test_the_tests_of_checks_accept_the_new_check(edited: Path) -> None:
    said = _run(
        edited,
        "-m",
        "pytest",
        "-q",
        "-p",
        "no:cacheprovider",
        "tests/checks/test_timelines.py",
        "-k",
        "licence or docs_are",
    )
    passed = re.search(r"(\d+) passed", said)
    assert passed
    assert int(passed[1]) >= 7


@pytest.mark.full
def test_the_rubric_is_valid_and_the_check_explains_itself(edited: Path) -> None:
    _run(edited, "-m", "grader", "rubric", "validate", "rubrics/examples/turtle-square.yaml")
    assert "The manifest names a licence." in _run(edited, "-m", "grader", "explain", "licence")
    assert "## licence" in (edited / "docs" / "reference" / "checks.md").read_text(encoding="utf-8")


def test_its_code_is_in_shape(edited: Path) -> None:
    ruff = str(Path(sys.executable).parent / "ruff")
    done = subprocess.run(
        [ruff, "check", "--no-cache", "grader/checks/manifest.py"],
        cwd=edited,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout
    done = subprocess.run(
        [ruff, "format", "--no-cache", "--check", "grader/checks/manifest.py"], cwd=edited, check=False
    )
    assert done.returncode == 0
