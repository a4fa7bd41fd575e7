"""Repositories whose commits are of given times."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path


def commit(folder: Path, content: Path, at: str) -> None:
    """The package as it was at that time, committed then."""
    shutil.rmtree(folder / "lab1", ignore_errors=True)
    shutil.copytree(content / "lab1", folder / "lab1")
    who = {
        f"GIT_{role}_{what}": "a@example.org"
        for role in ("AUTHOR", "COMMITTER")
        for what in ("NAME", "EMAIL")
    }
    times = {"GIT_COMMITTER_DATE": at, "GIT_AUTHOR_DATE": at}
    for command in (["add", "-A"], ["commit", "-qm", f"of {at}", "--allow-empty"]):
        subprocess.run(
            [str(shutil.which("git")), *command],
            cwd=folder,
            check=True,
            env={**os.environ, **who, **times, "GIT_CONFIG_GLOBAL": os.devnull},
        )


def repository(folder: Path, *commits: tuple[Path, str]) -> Path:
    folder.mkdir(parents=True)
    subprocess.run([str(shutil.which("git")), "init", "-q", "-b", "main"], cwd=folder, check=True)
    for content, at in commits:
        commit(folder, content, at)
    return folder
