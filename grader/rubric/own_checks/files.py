"""Python files beside a rubric."""

from __future__ import annotations

from pathlib import Path, PurePosixPath

MAX_BYTES = 1_000_000


class FileFault(ValueError):
    """The file is not there, or is none that may be used."""


def read_beside(folder: Path, name: str) -> tuple[Path, bytes]:
    """The file of that name in the rubric's folder, or below it. Raises FileFault."""
    plain = PurePosixPath(name)
    if plain.suffix != ".py" or plain.is_absolute() or ".." in plain.parts or "\0" in name:
        raise FileFault("must name a Python file beside the rubric, like my_checks.py")
    path = folder.resolve() / plain
    try:
        with path.open("rb") as file:
            raw = file.read(MAX_BYTES + 1)
    except OSError as error:
        raise FileFault(f"{name} cannot be read beside the rubric: {error.strerror}") from error
    if len(raw) > MAX_BYTES:
        raise FileFault(f"{name} is larger than 1 MB")
    return path, raw
