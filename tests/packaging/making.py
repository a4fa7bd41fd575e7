"""Makes the packages and installs them, once for all tests of a session."""

from __future__ import annotations

import fcntl
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
NAME = "ros-lab-grader"
BIN = Path(sys.executable).parent
SECONDS = 240


@dataclass(frozen=True, kw_only=True)
class Built:
    """The archive of the sources, and the wheel that was made of what is in it."""

    sdist: Path
    wheel: Path


@dataclass(frozen=True, kw_only=True)
class Installed:
    """A grader that was installed from a wheel, seen from a folder that has nothing of the repository."""

    program: Path
    environment: dict[str, str]

    def __call__(self, *argv: str | Path, cwd: Path, code: int = 0) -> str:
        """What it prints to stdout. It has to end with `code`."""
        done = self.run(*argv, cwd=cwd)
        assert done.returncode == code, f"{argv}: {done.returncode}\n{done.stdout}\n{done.stderr}"
        return done.stdout

    def run(self, *argv: str | Path, cwd: Path) -> subprocess.CompletedProcess[str]:
        """Run it to its end."""
        command = [str(self.program), *map(str, argv)]
        return subprocess.run(
            command,
            cwd=cwd,
            env=self.environment,
            capture_output=True,
            text=True,
            check=False,
            timeout=SECONDS,
        )


def once(factory: pytest.TempPathFactory, name: str, make: Callable[[Path], None]) -> Path:
    """A folder that the first who asks fills, and that all workers of the session share."""
    base = factory.getbasetemp()
    shared = base.parent if "PYTEST_XDIST_WORKER" in os.environ else base
    folder = shared / f"once-{name}"
    with (shared / f"once-{name}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not (folder / "made").exists():
            folder.mkdir(exist_ok=True)
            make(folder)
            (folder / "made").touch()
    return folder


def build(folder: Path) -> None:
    """Archive and wheel, as whoever publishes them does, in an environment made for it."""
    tool("build", "--installer", "uv", "--outdir", folder, ROOT)


def built(folder: Path) -> Built:
    """What `build` left there."""
    (sdist,), (wheel,) = folder.glob("*.tar.gz"), folder.glob("*.whl")
    return Built(sdist=sdist, wheel=wheel)


def pipx_install(wheel: Path, folder: Path) -> None:
    """With pipx, into a home of its own."""
    tool("pipx", "install", "--python", sys.executable, wheel, env=pipx_environment(folder))


def pipx_installed(folder: Path) -> Installed:
    """What `pipx_install` left there."""
    return Installed(program=folder / "bin" / "grader", environment=plain_environment())


def pipx_environment(folder: Path) -> dict[str, str]:
    """Says to pipx where everything goes."""
    places = {"HOME": "home", "BIN_DIR": "bin", "MAN_DIR": "man", "COMPLETION_DIR": "share"}
    return {**os.environ, **{f"PIPX_{name}": str(folder / place) for name, place in places.items()}}


def plain_environment() -> dict[str, str]:
    """A login's, in which nothing points to the repository or its virtual environment."""
    kept = ("HOME", "LANG", "TMPDIR", "XDG_RUNTIME_DIR", "GRADER_ROS_SETUP")
    environment = {name: os.environ[name] for name in kept if name in os.environ}
    return {**environment, "PATH": "/usr/local/bin:/usr/bin:/bin", "COLUMNS": "200", "LC_ALL": "C.UTF-8"}


def virtual(python: str, folder: Path) -> Path:
    """A clean virtual environment of that Python, as its own interpreter."""
    _run([BIN / "uv", "venv", "--quiet", "--python", python, folder], dict(os.environ))
    return folder / "bin" / "python"


def install(python: Path, *what: str | Path) -> None:
    """Install with all dependencies, from the index, into the environment of that Python."""
    command = [BIN / "uv", "pip", "install", "--quiet", "--python", python, *what]
    _run(command, dict(os.environ))


def tool(module: str, *argv: str | Path, env: dict[str, str] | None = None) -> None:
    """Run a tool of the development environment. It has to succeed."""
    environment = dict(os.environ if env is None else env)
    environment["PATH"] = f"{BIN}{os.pathsep}{environment['PATH']}"
    _run([Path(sys.executable), "-m", module, *argv], environment)


def _run(command: list[str | Path], environment: dict[str, str]) -> None:
    done = subprocess.run(
        [str(word) for word in command],
        env=environment,
        capture_output=True,
        text=True,
        check=False,
        timeout=SECONDS,
    )
    assert done.returncode == 0, done.stdout + done.stderr


def find(version: str) -> str | None:
    """That Python, on PATH or among those of pyenv."""
    places = sorted(Path.home().glob(f".pyenv/versions/{version}.*/bin/python{version}"))
    return str(places[-1]) if places else shutil.which(f"python{version}")
