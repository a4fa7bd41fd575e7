"""A wheel of the grader that runs here, whether it was installed from a wheel or runs from a clone.

The same grader gives the same bytes. What was installed beside the package (the man page) is not in it.
"""

from __future__ import annotations

import base64
import hashlib
import sys
from collections.abc import Iterator
from importlib.metadata import Distribution, PackageNotFoundError, distribution
from pathlib import Path

from grader.errors import UsageError
from grader.integrations.deliver.parcel import Parcel

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

NAME = "ros-lab-grader"
PACKAGE = Path(__file__).resolve().parents[2]
DATA = "grader/_data"
SYSTEM_SCRIPT = "setup.sh"
WHEEL = "Wheel-Version: 1.0\nGenerator: grader export\nRoot-Is-Purelib: true\nTag: py3-none-any\n"
KEPT = ("METADATA", "entry_points.txt")


def wheel() -> tuple[str, bytes]:
    """Its file name and its bytes. Raises UsageError where the grader is not installed, only on Python's path."""
    try:
        installed = distribution(NAME)
    except PackageNotFoundError as error:
        raise UsageError(
            "the grader is not installed here, so there is nothing to pack",
            hint="pip install -e . in its folder, or pipx install it",
        ) from error
    parcel = Parcel()
    for path, file in _package_files():
        parcel.add_file(path, file)
    stem = f"{NAME.replace('-', '_')}-{installed.version}"
    info = f"{stem}.dist-info"
    for name, text in _metadata(installed):
        parcel.add(f"{info}/{name}", text.encode())
    parcel.add(f"{info}/WHEEL", WHEEL.encode())
    parcel.add(f"{info}/RECORD", _record(parcel, f"{info}/RECORD"))
    return f"{stem}-py3-none-any.whl", parcel.zipped()


def system_script() -> bytes:
    """The script that installs the packages of the system."""
    checkout = _checkout()
    file = checkout / "scripts" / SYSTEM_SCRIPT if checkout else PACKAGE / "_data" / SYSTEM_SCRIPT
    return file.read_bytes()


def _checkout() -> Path | None:
    """The clone that the grader runs from; None where it is installed."""
    root = PACKAGE.parent
    return root if (root / "pyproject.toml").is_file() and (root / "rubrics").is_dir() else None


def _package_files() -> Iterator[tuple[str, Path]]:
    yield from _files(PACKAGE, PACKAGE.name)
    checkout = _checkout()
    if checkout is None:
        return
    project = tomllib.loads((checkout / "pyproject.toml").read_text(encoding="utf-8"))
    included = project["tool"]["hatch"]["build"]["targets"]["wheel"]["force-include"]
    for source, target in sorted(included.items()):
        yield from _files(checkout / source, target)


def _files(source: Path, target: str) -> Iterator[tuple[str, Path]]:
    if source.is_file():
        yield target, source
    for file in sorted(source.rglob("*")):
        inside = file.relative_to(source)
        if file.is_file() and file.suffix != ".pyc" and "__pycache__" not in inside.parts:
            yield f"{target}/{inside.as_posix()}", file


def _metadata(installed: Distribution) -> Iterator[tuple[str, str]]:
    for name in KEPT:
        text = installed.read_text(name)
        if text is not None:
            yield name, text


def _record(parcel: Parcel, own: str) -> bytes:
    lines = [f"{path},sha256={_digest(data)},{len(data)}" for path, data, _ in parcel.entries()]
    return "".join(f"{line}\n" for line in [*lines, f"{own},,"]).encode()


def _digest(data: bytes) -> str:
    return base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
