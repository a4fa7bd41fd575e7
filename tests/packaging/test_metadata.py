"""The checks that indexes make, before an index makes them. Each is shown to refuse what is wrong."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from zipfile import ZipFile

import pytest

from tests.packaging.making import BIN, ROOT, Built

CHECKS = {
    "twine": [sys.executable, "-m", "twine", "check", "--strict"],
    "contents": [str(BIN / "check-wheel-contents"), "--config", str(ROOT / "pyproject.toml")],
}


def check(*command: str | Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False)


def spoiled(wheel: Path, folder: Path, *, without: str = "\n", more: str = "") -> Path:
    """A wheel of which METADATA lacks the lines that begin with `without`, with an empty file `more`."""
    copy = folder / wheel.name
    with ZipFile(wheel) as source, ZipFile(copy, "w") as target:
        for info in source.infolist():
            text = source.read(info)
            if info.filename.endswith("/METADATA"):
                text = b"".join(
                    row for row in text.splitlines(keepends=True) if not row.startswith(without.encode())
                )
            if info.filename.endswith("/RECORD") and more:
                text += f"{more},,\n".encode()
            target.writestr(info, text)
        if more:
            target.writestr(more, b"")
    return copy


def test_indexes_take_both(packages: Built):
    done = check(*CHECKS["twine"], packages.wheel, packages.sdist)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.count("PASSED") == 2


@pytest.mark.full
def test_twine_refuses_a_wheel_without_a_name(packages: Built, tmp_path):
    assert check(*CHECKS["twine"], spoiled(packages.wheel, tmp_path, without="Name:")).returncode != 0


def test_the_wheel_holds_nothing_that_would_lie_about_in_site_packages(packages: Built):
    done = check(*CHECKS["contents"], packages.wheel)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.full
@pytest.mark.parametrize("name", ["grader/__pycache__/a.cpython-311.pyc", "tests/__init__.py"])
def test_rubbish_in_a_wheel_is_refused(packages: Built, tmp_path, name):
    wheel = spoiled(packages.wheel, tmp_path, more=name)
    assert check(*CHECKS["contents"], wheel).returncode != 0


def test_pyproject_is_as_the_standards_say():
    done = check(BIN / "validate-pyproject", ROOT / "pyproject.toml")
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.full
@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ('requires-python = ">=3.10"', 'requires-python = "3.10 or newer"'),
        ("Topic :: Education :: Testing", "Topic :: Teaching"),
        ('license-files = ["LICENSE"]', 'license-files = "LICENSE"'),
        ("[project.scripts]", "[project.programs]"),
    ],
)
def test_a_pyproject_that_is_wrong_is_refused(tmp_path, right, wrong):
    text = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    assert text.count(right) == 1
    (tmp_path / "pyproject.toml").write_text(text.replace(right, wrong), encoding="utf-8")
    assert check(BIN / "validate-pyproject", tmp_path / "pyproject.toml").returncode != 0


def test_the_wheel_is_for_every_machine(packages: Built):
    assert packages.wheel.name.endswith("-py3-none-any.whl")
