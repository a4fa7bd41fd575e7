"""Files to hand over, as a zip or as a folder. The same files give the same bytes."""

from __future__ import annotations

import io
import os
import zipfile
from collections.abc import Iterator
from pathlib import Path
from grader.files import atomic_write
import base64
import hashlib
import sys
from importlib.metadata import Distribution, PackageNotFoundError, distribution
from grader.errors import UsageError
from grader.rubric.instructor import read_instructor
from grader.rubric.load import LoadedRubric
from grader.rubric.source import read_source
from typing import Literal
from pydantic import ValidationError
from grader.errors import InternalError
from grader.model.record import Record


LONG_AGO = (1980, 1, 1, 0, 0, 0)
"""The first date that a zip can carry: nothing of when it was made is in it."""


class Parcel:
    """Files by their path, posix and relative."""

    def __init__(self) -> None:
        self._files: dict[str, tuple[bytes, bool]] = {}

    def add(self, path: str, data: bytes, *, executable: bool = False) -> None:
        """Add a file, or put it in the place of one of the same path."""
        self._files[path] = (data, executable)

    def add_file(self, path: str, file: Path) -> None:
        """Add a file of the disk, with its executable bit."""
        self.add(path, file.read_bytes(), executable=os.access(file, os.X_OK))

    def entries(self) -> Iterator[tuple[str, bytes, bool]]:
        """Path, content and executable bit of each file, in order of the paths."""
        for path, (data, executable) in sorted(self._files.items()):
            yield path, data, executable

    def zipped(self) -> bytes:
        """A zip with the files' modes in it."""
        out = io.BytesIO()
        with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
            for path, data, executable in self.entries():
                about = zipfile.ZipInfo(path, LONG_AGO)
                about.create_system = 3  # Unix, whatever this is: only then do modes count
                about.compress_type = zipfile.ZIP_DEFLATED
                about.external_attr = _mode(executable=executable) << 16
                archive.writestr(about, data)
        return out.getvalue()

    def write(self, folder: Path) -> None:
        """Write the files below `folder`, each whole or not at all. Raises OutputError."""
        for path, data, executable in self.entries():
            target = folder / path
            atomic_write(target, data, public=True)
            target.chmod(_mode(executable=executable) & 0o777)


def _mode(*, executable: bool) -> int:
    return 0o100755 if executable else 0o100644


# [integrations.deliver.wheel] A wheel of the grader that runs here, whether it was installed from a wheel or runs from a clone.
#
# The same grader gives the same bytes. What was installed beside the package (the man page) is not in it.

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


# [integrations.deliver.lab] A rubric and the instructor's files that belong to it, to be taken along.

def add_lab(parcel: Parcel, rubric: LoadedRubric, folder: str) -> str:
    """Add the rubric's file and those it names below `folder`; gives the rubric's path in the parcel."""
    path = f"{folder}/{rubric.path.name}"
    parcel.add(path, rubric.path.read_bytes())
    source = read_source(rubric.path, rubric.path.name)
    for name, data in read_instructor(source.data, rubric.path.parent).files.items():
        parcel.add(f"{folder}/{name}", data)
    return path


# [integrations.deliver.settings] What an exported grader is told: `grader.json` beside the rubric's folder, written by the export.

FILE = "grader.json"
Modes = Literal["lost", "granted"]


class Settings(Record):
    """`rubric` is the rubric's path from the folder of the settings; `minutes` is the platform's time limit for all.

    `modes` says what a script counts as whose executable bit the upload has lost.
    """

    rubric: str
    minutes: int
    sandbox: Literal["auto", "require", "none"] = "auto"
    modes: Modes = "lost"

    @property
    def grading_s(self) -> int:
        """How long grading may take, so that there is time left to say that it took too long."""
        return self.minutes * 60 - 30

    def to_json(self) -> bytes:
        """Its file."""
        return f"{self.model_dump_json(indent=2)}\n".encode()


def read_settings(folder: Path) -> Settings:
    """Those in `folder`. Raises InternalError: the export wrote them, no student."""
    try:
        return Settings.model_validate_json((folder / FILE).read_bytes())
    except (OSError, ValidationError) as error:
        raise InternalError(
            f"{folder / FILE} cannot be read: {type(error).__name__}", hint="export the grader again"
        ) from error
