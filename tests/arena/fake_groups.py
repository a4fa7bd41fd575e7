"""Folders that answer as control groups of version 2 do, where it matters for who may be where."""

from __future__ import annotations

import errno
from pathlib import Path
from typing import Any

import pytest

WRITE, MKDIR, RMDIR = Path.write_text, Path.mkdir, Path.rmdir
PROCS, CONTROLLERS, SWITCHED_ON = "cgroup.procs", "cgroup.controllers", "cgroup.subtree_control"


class FakeGroups:
    """Below `root`; nothing else is touched."""

    def __init__(self, root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        self.root = root
        self.fill(root, "memory pids")
        monkeypatch.setattr(Path, "write_text", lambda path, text, **_more: self._write(path, text))
        monkeypatch.setattr(Path, "mkdir", lambda path, *args, **more: self._mkdir(path, *args, **more))  # noqa: PLW0108 - bound to a path
        monkeypatch.setattr(Path, "rmdir", lambda path: self._rmdir(path))  # noqa: PLW0108 - as above

    def group(self, name: str, *pids: int) -> Path:
        """A group in which these processes are; controllers may be switched on in it."""
        folder = self.root / name
        MKDIR(folder, parents=True)
        self.fill(folder, "memory pids", *pids)
        return folder

    @staticmethod
    def fill(folder: Path, controllers: str, *pids: int) -> None:
        MKDIR(folder, exist_ok=True)
        WRITE(folder / CONTROLLERS, controllers)
        WRITE(folder / SWITCHED_ON, "")
        WRITE(folder / PROCS, "".join(f"{pid}\n" for pid in pids))
        for controller in controllers.split():
            WRITE(folder / f"{controller}.max", "max")

    @staticmethod
    def pids(folder: Path) -> list[int]:
        return [int(pid) for pid in (folder / PROCS).read_text().split()]

    def _write(self, path: Path, text: str) -> int:
        if not path.is_relative_to(self.root):
            return WRITE(path, text)
        if not path.is_file():  # nobody makes files there
            raise PermissionError(errno.EACCES, "Permission denied", str(path))
        if path.name == PROCS:
            return self._enter(path.parent, int(text))
        if path.name == SWITCHED_ON:
            if self.pids(path.parent):
                raise OSError(errno.EBUSY, "Device or resource busy", str(path))
            text = " ".join(word.strip("+") for word in text.split())
        return WRITE(path, text)

    def _enter(self, folder: Path, pid: int) -> int:
        if (folder / SWITCHED_ON).read_text():
            raise OSError(errno.EBUSY, "Device or resource busy", str(folder))
        for path in self.root.rglob(PROCS):
            left = [other for other in self.pids(path.parent) if other != pid]
            WRITE(path, "".join(f"{other}\n" for other in left))
        return WRITE(folder / PROCS, "".join(f"{other}\n" for other in [*self.pids(folder), pid]))

    def _mkdir(self, path: Path, *args: Any, **more: Any) -> None:
        fresh = not path.exists()
        MKDIR(path, *args, **more)
        if fresh and path.is_relative_to(self.root):
            self.fill(path, (path.parent / SWITCHED_ON).read_text())

    def _rmdir(self, path: Path) -> None:
        if path.is_relative_to(self.root):
            if self.pids(path):
                raise OSError(errno.EBUSY, "Device or resource busy", str(path))
            for file in path.iterdir():
                file.unlink()
        RMDIR(path)
