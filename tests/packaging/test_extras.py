"""The wheel with all of its extras: the commands that need them work, on a class of two."""

from __future__ import annotations

import json
import shutil
import signal
import subprocess
import sys
import urllib.request
from pathlib import Path

import pytest

from tests.packaging.conftest import LAB
from tests.packaging.making import ROOT, Built, Installed, install, once, plain_environment, virtual

REFERENCE = ROOT / "reference_solutions" / LAB / "lab1"
NAMES = ("ada", "bob")


@pytest.fixture(scope="module")
def complete(tmp_path_factory: pytest.TempPathFactory, packages: Built) -> Installed:
    """A grader with all three extras."""

    def make(folder: Path) -> None:
        install(virtual(sys.executable, folder / "venv"), f"{packages.wheel}[cluster,review,similarity]")

    folder = once(tmp_path_factory, "extras", make)
    return Installed(program=folder / "venv" / "bin" / "grader", environment=plain_environment())


@pytest.fixture(scope="module")
def folder(complete: Installed, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A class whose files were graded on a cluster; both handed in the same."""
    folder = tmp_path_factory.mktemp("class")
    for name in NAMES:
        shutil.copytree(REFERENCE, folder / "submissions" / name / "lab1")
    options = ("--rubric", LAB, "--static", "--out", "results", "--cluster", "local")
    complete("batch", "submissions", *options, cwd=folder, code=4)
    return folder


@pytest.mark.full
def test_a_cluster_grades(folder: Path):
    results = [json.loads(row) for row in (folder / "results" / "results.jsonl").read_text().splitlines()]
    assert {one["submission"]["id"] for one in results} == set(NAMES)


@pytest.mark.full
def test_submissions_are_compared(complete: Installed, folder: Path):
    out = complete("similar", "results", "--json", cwd=folder)
    assert all(name in out for name in NAMES)


@pytest.mark.full
def test_a_class_is_looked_at(complete: Installed, folder: Path):
    command = [str(complete.program), "review", "results", "--no-browser"]
    server = subprocess.Popen(
        command,
        cwd=folder,
        env=complete.environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    try:
        assert server.stdout is not None
        address = next(word for line in server.stdout for word in line.split() if word.startswith("http://"))
        browser = urllib.request.build_opener(urllib.request.HTTPCookieProcessor())
        with browser.open(address, timeout=30) as answer:
            page = answer.read().decode()
    finally:
        server.send_signal(signal.SIGINT)
        server.communicate()
    assert all(name in page for name in NAMES)
