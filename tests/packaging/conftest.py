"""The packages, and a grader that pipx installed: made once a session."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest

from tests.packaging.making import ROOT, Built, Installed, build, built, once, pipx_install, pipx_installed

LAB = "leeds-comp3631-lab1"


@pytest.fixture(scope="session")
def packages(tmp_path_factory: pytest.TempPathFactory) -> Built:
    """The archive of the sources, and the wheel."""
    return built(once(tmp_path_factory, "built", build))


@pytest.fixture(scope="session")
def pipx_home(tmp_path_factory: pytest.TempPathFactory, packages: Built) -> Path:
    """The folder into which pipx installed the wheel."""
    return once(tmp_path_factory, "pipx", lambda folder: pipx_install(packages.wheel, folder))


@pytest.fixture(scope="session")
def installed(pipx_home: Path) -> Installed:
    """The grader in it."""
    return pipx_installed(pipx_home)


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """A copy of a correct package, far from the repository."""
    return Path(shutil.copytree(ROOT / "reference_solutions" / LAB / "lab1", tmp_path / "lab1"))


@pytest.fixture(autouse=True)
def certificates(monkeypatch: pytest.MonkeyPatch) -> None:
    """uv brings its own, pip takes those of the machine: so does uv here."""
    if "SSL_CERT_FILE" not in os.environ:
        monkeypatch.setenv("UV_SYSTEM_CERTS", "1")
