"""A student's clone of a repository on a server, as real git makes them."""

from __future__ import annotations

import os
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

import pytest

from grader.model.result import GitStatus
from grader.student.git_status import advise, read_environment

MANIFEST = """<package format="2"><name>{name}</name><version>0.0.1</version><description>d</description>
<maintainer email="a@b.org">A</maintainer><license>MIT</license><buildtool_depend>catkin</buildtool_depend>
</package>
"""
SCRIPT = "#!/usr/bin/env python3\nprint('hello')\n"


def git(folder: Path, *words: str) -> str:
    """What real git says, with nobody's settings."""
    environment = {
        **{key: value for key, value in os.environ.items() if not key.startswith("GIT_")},
        "HOME": str(folder.parent),
        "GIT_CONFIG_GLOBAL": os.devnull,
        "GIT_CONFIG_NOSYSTEM": "1",
        "GIT_AUTHOR_DATE": "2026-11-02T12:00:00Z",
        "GIT_COMMITTER_DATE": "2026-11-02T12:00:00Z",
    }
    whole = [
        "git",
        "-c",
        "user.name=Ada",
        "-c",
        "user.email=ada@x.org",
        "-c",
        "protocol.file.allow=always",
        *words,
    ]
    done = subprocess.run(whole, cwd=folder, env=environment, capture_output=True, text=True, check=True)
    return done.stdout.strip()


def write_package(folder: Path, name: str = "lab1") -> Path:
    """A small package with an executable script."""
    (folder / "scripts").mkdir(parents=True)
    (folder / "package.xml").write_text(MANIFEST.format(name=name))
    (folder / "CMakeLists.txt").write_text(f"cmake_minimum_required(VERSION 3.0.2)\nproject({name})\n")
    script = folder / "scripts" / "talker.py"
    script.write_text(SCRIPT)
    script.chmod(0o755)
    return folder


@dataclass(frozen=True, kw_only=True)
class Clone:
    """`top` is the student's repository, `package` a folder of it, `server` the bare one that it was cloned from."""

    top: Path
    package: Path
    server: Path

    def git(self, *words: str) -> str:
        return git(self.top, *words)

    def commit(self) -> None:
        self.git("add", "-A")
        self.git("commit", "-q", "-m", "Work")

    def standing(self, base: Path, *, here: Path | None = None, **environment: str) -> GitStatus:
        """What the student is told."""
        return advise(self.package, base / "asked", read_environment(environment, here or self.package))

    def kinds(self, base: Path, **environment: str) -> list[str]:
        return [point.kind for point in self.standing(base, **environment).points]


@pytest.fixture(scope="session")
def pushed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a server's repository and its clone, for copies."""
    folder = tmp_path_factory.mktemp("pushed")
    git(folder, "init", "-q", "--bare", "-b", "main", "server.git")
    git(folder, "clone", "-q", "server.git", "work")
    top = folder / "work"
    git(top, "checkout", "-q", "-B", "main")
    write_package(top / "lab1")
    git(top, "add", "-A")
    git(top, "commit", "-q", "-m", "Work")
    git(top, "push", "-q", "-u", "origin", "main")
    git(top, "remote", "set-head", "origin", "main")
    return folder


@pytest.fixture
def clone(pushed: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Clone:
    """A clone whose package is committed and pushed."""
    monkeypatch.setenv("GIT_CONFIG_GLOBAL", os.devnull)
    for name in ("CI", "GITHUB_ACTIONS", "GITLAB_CI", "PRE_COMMIT", "GIT_INDEX_FILE", "GIT_DIR"):
        monkeypatch.delenv(name, raising=False)
    made = Clone(top=tmp_path / "work", package=tmp_path / "work" / "lab1", server=tmp_path / "server.git")
    for folder in (made.server, made.top):
        shutil.copytree(pushed / folder.name, folder, symlinks=True)
    made.git("remote", "set-url", "origin", str(made.server))
    made.git("update-index", "-q", "--refresh")
    return made
