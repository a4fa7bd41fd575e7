"""Makes what is handed in, as the attack's data say."""

from __future__ import annotations

import base64
import os
import shutil
import subprocess
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tests.hostile import makers
from tests.hostile.room import archives

HERE = Path(__file__).resolve().parents[1]
TOOLS = ("hostile.py", "kernel.py")
SHEBANG = "#!/usr/bin/env python3\n"
RUN_BUILDER = "execute_process(COMMAND python3 ${CMAKE_CURRENT_SOURCE_DIR}/tools/builder.py)\n"
GIT = ("git", "-c", "protocol.file.allow=always", "-c", "init.defaultBranch=main")
IDENTITY = {
    "GIT_AUTHOR_NAME": "A student", "GIT_AUTHOR_EMAIL": "student@localhost",
    "GIT_COMMITTER_NAME": "A student", "GIT_COMMITTER_EMAIL": "student@localhost",
    "GIT_CONFIG_NOSYSTEM": "1", "PATH": os.environ["PATH"],
}  # fmt: skip


def make(job: Mapping[str, Any], top: Path, owner: int) -> Path:
    """The folder, archive or repository, below `top`, owned by the user `owner`."""
    folder = top / job["name"]
    package = folder / "lab"
    victim(package)
    _write_package(package, job)
    path = folder
    if job["repository"] is not None:
        give(folder, owner)
        _repository(folder, job["repository"], owner)
    if job["generator"] is not None:
        path = getattr(makers, job["generator"]["make"])(folder, **job["generator"]["arguments"])
    if job["archive"] is not None:
        path = archives.write(job["archive"], folder, top / f"{job['name']}.{job['archive']['format']}")
    give(path, owner)
    for name, mode in job["modes"].items():
        (package / name).chmod(int(mode, 8))
    return path


def victim(package: Path) -> None:
    """The small sound package."""
    shutil.copytree(HERE / "victim", package, ignore=shutil.ignore_patterns("__pycache__"))


def give(path: Path, owner: int) -> None:
    """A download belongs to the one who downloaded it."""
    os.lchown(path, owner, owner)
    for folder, folders, files in os.walk(path):
        for name in (*folders, *files):
            os.lchown(Path(folder) / name, owner, owner)


def _write_package(package: Path, job: Mapping[str, Any]) -> None:
    for name in job["remove"]:
        target = package / name
        shutil.rmtree(target) if target.is_dir() else target.unlink()
    if job["beside"] is not None:
        shutil.copytree(job["beside"], package, symlinks=True, dirs_exist_ok=True)
    for key, folder in (("attacker", "src"), ("builder", "tools")):
        if job[key] is not None:
            write(package / folder / f"{key}.py", SHEBANG + job[key])
            for name in TOOLS:
                shutil.copy(HERE / "tools" / name, package / folder / name)
    if job["builder"] is not None:
        with (package / "CMakeLists.txt").open("a") as file:
            file.write(RUN_BUILDER)
    for name, content in job["files"].items():
        data = content if isinstance(content, str) else base64.b64decode(content["base64"])
        write(package / name, data)
    for name, target in job["links"].items():
        link = package / name
        link.parent.mkdir(parents=True, exist_ok=True)
        link.symlink_to(target)


def write(path: Path, content: str | bytes, mode: int | None = None) -> None:
    """A file; scripts can be run."""
    data = content.encode() if isinstance(content, str) else content
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(data)
    path.chmod(mode if mode is not None else 0o755 if data.startswith(b"#!") else 0o644)


def _repository(folder: Path, steps: list[dict[str, Any]], owner: int) -> None:
    for step in steps:
        if step["git"]:
            subprocess.run(
                [*GIT, *step["git"]], cwd=folder, env=IDENTITY, user=owner, group=owner, check=True, stdout=2
            )
        elif step["write"]:
            target = step["write"]
            write(folder / target["path"], target["text"], int(target["mode"], 8))
        elif step["link"]:
            link = folder / step["link"]["path"]
            link.parent.mkdir(parents=True, exist_ok=True)
            link.symlink_to(step["link"]["target"])
        else:
            gone = folder / step["remove"]
            shutil.rmtree(gone) if gone.is_dir() else gone.unlink()
        give(folder, owner)
