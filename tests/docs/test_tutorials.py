"""Every command of the tutorials works as printed: from a fresh clone, and from the wheel in a clean environment."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import sysconfig
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.docs.console import Command, Session, steps
from tests.packaging.making import install, tool, virtual

ROOT = Path(__file__).resolve().parents[2]
TUTORIALS = ("student", "instructor", "ci")
SYSTEM = "/usr/bin:/bin"
GIT = "[user]\nname = A Student\nemail = student@example.org\n[init]\ndefaultBranch = main\n"


@dataclass(frozen=True, kw_only=True)
class Installed:
    """A grader that somebody has installed: where its programs are, and where its code must come from."""

    programs: Path
    code: Path


def _done(*words: str | Path, folder: Path, environment: Mapping[str, str] | None = None) -> str:
    done = subprocess.run(
        [str(word) for word in words],
        cwd=folder,
        env=environment and dict(environment),
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, f"{words}\n{done.stdout[-2000:]}\n{done.stderr[-2000:]}"
    return done.stdout


@pytest.fixture(scope="module")
def clone(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What is committed, and nothing else."""
    folder = tmp_path_factory.mktemp("fresh") / "clone"
    _done("git", "clone", "-q", "--no-hardlinks", ROOT, folder, folder=ROOT)
    return folder


@pytest.fixture(scope="module")
def from_clone(clone: Path) -> Installed:
    """The clone with the environment that `make setup` made here: the same packages, the clone's own code."""
    environment = clone / ".venv"
    _done(sys.executable, "-m", "venv", "--without-pip", environment, folder=clone)
    [packages] = environment.glob("lib/python3*/site-packages")
    (packages / "clone.pth").write_text(f"{clone}\n{sysconfig.get_path('purelib')}\n", encoding="utf-8")
    program = environment / "bin" / "grader"
    program.write_text(f'#!/bin/sh\nexec "{environment}/bin/python" -m grader "$@"\n', encoding="utf-8")
    program.chmod(0o755)
    return Installed(programs=environment / "bin", code=clone)


@pytest.fixture(scope="module")
def from_wheel(clone: Path, tmp_path_factory: pytest.TempPathFactory) -> Installed:
    """The wheel, built of the clone and installed with what it needs into an environment of its own."""
    folder = tmp_path_factory.mktemp("wheel")
    source = folder / "source"
    _done("git", "clone", "-q", clone, source, folder=folder)
    with pytest.MonkeyPatch.context() as patch:
        if "SSL_CERT_FILE" not in os.environ:
            patch.setenv("UV_SYSTEM_CERTS", "1")
        tool("build", "--wheel", "--installer", "uv", "--outdir", folder, source)
        [wheel] = folder.glob("*.whl")
        install(virtual(sys.executable, folder / "environment"), f"{wheel}[review]")
    shutil.rmtree(source)
    return Installed(programs=folder / "environment" / "bin", code=folder / "environment")


def desk(home: Path) -> Path:
    """A folder to work in, in a home of its own; git knows who works there, as it does for everybody who commits."""
    (home / "work").mkdir(parents=True)
    (home / ".gitconfig").write_text(GIT, encoding="utf-8")
    return home / "work"


def _environment(programs: Path, home: Path) -> dict[str, str]:
    """Of this process's variables only those that say where ROS, the package index and the temporary folders are."""
    kept = ("GRADER_ROS_SETUP", "LANG", "LC_ALL", "TMPDIR", "XDG_RUNTIME_DIR", "XDG_CACHE_HOME")
    taken = {key: value for key, value in os.environ.items() if key in kept or key.startswith("PIP_")}
    cache = {"XDG_CACHE_HOME": str(Path.home() / ".cache")}
    return {**cache, **taken, "PATH": f"{programs}:{SYSTEM}", "HOME": str(home), "COLUMNS": "80"}


def page(name: str, folder: Path = ROOT) -> str:
    return (folder / "docs" / "tutorials" / f"{name}.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("name", TUTORIALS)
def test_a_tutorial_uses_the_grader_and_shows_what_it_prints(name: str) -> None:
    commands = [step for step in steps(page(name)) if isinstance(step, Command)]
    graded = [command for command in commands if "grader " in command.text]
    assert len(graded) >= 5
    assert sum(bool(command.shown) for command in graded) >= 4


@pytest.mark.full
@pytest.mark.ros
@pytest.mark.slow
@pytest.mark.parametrize("name", TUTORIALS)
def test_every_command_works_as_printed(
    name: str, from_clone: Installed, from_wheel: Installed, clone: Path, tmp_path: Path
) -> None:
    """With both at once: nearly all of the time is spent watching nodes."""
    text = page(name, clone)
    with ThreadPoolExecutor() as pool:
        of_clone = pool.submit(run_page, from_clone, text, desk(tmp_path / "clone"))
        of_wheel = pool.submit(run_page, from_wheel, text, desk(tmp_path / "wheel"))
    assert of_clone.exception() is None, f"from the clone: {of_clone.exception()}"
    assert of_wheel.exception() is None, f"from the wheel: {of_wheel.exception()}"
    assert of_clone.result() == of_wheel.result() > 5


def run_page(installed: Installed, text: str, folder: Path) -> int:
    """Type in a page with that grader; gives the number of commands."""
    environment = _environment(installed.programs, folder.parent)
    code = "import grader; print(grader.__file__)"
    where = _done(installed.programs / "python", "-c", code, folder=folder, environment=environment)
    assert Path(where.strip()).is_relative_to(installed.code)
    return Session(folder, environment).run_page(text)
