"""Real folders, archives and repositories, made small and from text. No network."""

from __future__ import annotations

import io
import os
import subprocess
import tarfile
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from grader.intake.open import open_submission
from grader.model.submission import Submission

_IDENTITY = {
    "GIT_AUTHOR_NAME": "Ada",
    "GIT_AUTHOR_EMAIL": "ada@example.org",
    "GIT_COMMITTER_NAME": "Ada",
    "GIT_COMMITTER_EMAIL": "ada@example.org",
    "GIT_CONFIG_GLOBAL": os.devnull,
    "GIT_CONFIG_NOSYSTEM": "1",
}
NODE = "#!/usr/bin/env python3\nprint('hello')\n"


def manifest(name: str) -> str:
    return f'<?xml version="1.0"?>\n<package format="2">\n  <name>{name}</name>\n</package>\n'


def write(root: Path, files: Mapping[str, str | bytes], *, executable: tuple[str, ...] = ()) -> Path:
    """`files` below `root`, with the executable bit for those named."""
    root.mkdir(parents=True, exist_ok=True)
    for path, content in files.items():
        place = root / path
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_bytes(content.encode() if isinstance(content, str) else content)
        place.chmod(0o755 if path in executable else 0o644)
    return root


def lab(folder: str = "lab1", name: str = "lab1") -> dict[str, str | bytes]:
    """The files of a small package; the script is `src/node.py`."""
    return {
        f"{folder}/package.xml": manifest(name),
        f"{folder}/CMakeLists.txt": f"project({name})\n",
        f"{folder}/src/node.py": NODE,
    }


def git(folder: Path, *args: str) -> str:
    done = subprocess.run(
        ["git", *args],  # noqa: S607 - the machine's git
        cwd=folder,
        env={**os.environ, **_IDENTITY},
        check=True,
        capture_output=True,
        text=True,
    )
    return done.stdout.strip()


def repository(folder: Path, files: Mapping[str, str | bytes], *, executable: tuple[str, ...] = ()) -> Path:
    """A repository on branch `main` with one commit."""
    write(folder, files, executable=executable)
    git(folder, "init", "--quiet", "--template=", "--initial-branch=main")
    commit(folder)
    return folder


def commit(folder: Path, message: str = "Work") -> str:
    """All that is there, committed; gives the hash."""
    git(folder, "add", "--all")
    git(folder, "commit", "--quiet", "--allow-empty", "--message", message)
    return git(folder, "rev-parse", "HEAD")


def tar_entry(name: str, content: bytes = b"", **fields: Any) -> tuple[tarfile.TarInfo, bytes]:
    info = tarfile.TarInfo(name)
    info.mode = 0o644
    info.size = len(content)
    for key, value in fields.items():
        setattr(info, key, value)
    return info, content


def make_tar(path: Path, entries: list[tuple[tarfile.TarInfo, bytes]], *, packing: str = "") -> Path:
    with tarfile.open(path, f"w:{packing}") as archive:
        for info, content in entries:
            archive.addfile(info, io.BytesIO(content))
    return path


def lab_tar(path: Path, *, packing: str = "", mode: int = 0o755) -> Path:
    files = [
        (name, content.encode() if isinstance(content, str) else content) for name, content in lab().items()
    ]
    entries = [
        tar_entry(name, content, mode=mode if name.endswith(".py") else 0o644) for name, content in files
    ]
    return make_tar(path, entries, packing=packing)


def zip_entry(name: str, *, system: int = 3, mode: int = 0o644) -> zipfile.ZipInfo:
    info = zipfile.ZipInfo(name)
    info.create_system = system
    info.external_attr = mode << 16 | 0x20  # zipfile fills in a mode where this is 0
    return info


def make_zip(path: Path, entries: list[tuple[zipfile.ZipInfo, str | bytes]], *, comment: bytes = b"") -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.comment = comment
        for info, content in entries:
            archive.writestr(info, content, compress_type=zipfile.ZIP_DEFLATED)
    return path


def lab_zip(path: Path, *, system: int = 3, mode: int = 0o755, comment: bytes = b"") -> Path:
    entries = [
        (
            zip_entry(name, system=system, mode=mode if name.endswith(".py") else 0o644 if mode else 0),
            content,
        )
        for name, content in lab().items()
    ]
    return make_zip(path, entries, comment=comment)


def opened(source: object, tmp_path: Path, **fields: Any) -> Submission:
    """`open_submission` for `lab1`, working in a folder of its own."""
    return open_submission(
        str(source), package=fields.pop("package", "lab1"), workdir=tmp_path / "work", **fields
    )
