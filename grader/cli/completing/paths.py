"""Files and folders, in each shell alike."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path


def paths(*, prefix: str, endings: Sequence[str] | None, **_asked: object) -> dict[str, str]:
    """Folders, with a `/` behind them, and files with one of the endings: None for all files, `()` for none."""
    folder, _, begun = prefix.rpartition("/")
    shown = f"{folder}/" if "/" in prefix else ""
    found: dict[str, str] = {}
    with suppress(OSError, ValueError, RuntimeError):  # not readable, no such user
        for entry in _entries(Path(shown or ".").expanduser()):
            if not entry.name.startswith(begun) or (entry.name.startswith(".") and not begun.startswith(".")):
                continue
            if entry.is_dir():
                found[f"{shown}{entry.name}/"] = ""
            elif endings is None or entry.name.lower().endswith(tuple(endings)):
                found[f"{shown}{entry.name}"] = ""
    return found


def _entries(folder: Path) -> Iterator[os.DirEntry[str]]:
    with os.scandir(folder) as entries:
        yield from sorted(entries, key=lambda entry: entry.name)
