"""The zip of all submissions that Moodle or Canvas offers for download, unpacked into a folder of submissions.

Students' own archives in it stay packed: each is opened, within its limits, when it is graded.
"""

from __future__ import annotations

import hashlib
import shutil
import zipfile
from pathlib import Path

from grader.classes.roster.folder import platform_name
from grader.errors import HostError, UsageError
from grader.files import make_folder, temporary_folder, unwritable
from grader.untrusted_text import line

FOLDER = ".submissions"


def is_download(path: Path) -> bool:
    """Return whether `path` is a zip file."""
    return path.is_file() and path.suffix.lower() == ".zip"


def unpack_download(path: Path, out: Path) -> Path:
    """Unpack the zip below `out` and return the folder; one that was unpacked there before is returned as it is.

    Raises:
        UsageError: It is no zip file, is damaged or encrypted, or is itself one package.
        HostError: The disk has no room for it.

    """
    try:
        with zipfile.ZipFile(path) as download:
            members = [member for member in download.infolist() if not member.is_dir()]
            if any(member.filename.count("/") <= 1 and _name(member) == "package.xml" for member in members):
                raise UsageError(
                    f"{path}: this is one package, not a download of submissions",
                    hint="grader grade takes one submission",
                )
            folder = out.absolute() / FOLDER / _digest(members)
            if not folder.is_dir():
                _unpack(download, members, folder)
    except (zipfile.BadZipFile, RuntimeError, NotImplementedError, EOFError) as error:
        raise UsageError(
            f"{path}: cannot be unpacked: {line(str(error), 200)}", hint="download it again"
        ) from error
    except OSError as error:
        raise unwritable(out, error) from error
    return folder


def _name(member: zipfile.ZipInfo) -> str:
    return member.filename.rpartition("/")[2]


def _digest(members: list[zipfile.ZipInfo]) -> str:
    listed = [f"{member.filename}\0{member.file_size}\0{member.CRC}" for member in members]
    return hashlib.sha256("\n".join(listed).encode("utf-8", "surrogateescape")).hexdigest()[:12]


def _unpack(download: zipfile.ZipFile, members: list[zipfile.ZipInfo], folder: Path) -> None:
    make_folder(folder.parent)
    size_bytes = sum(member.file_size for member in members)
    if size_bytes > shutil.disk_usage(folder.parent).free:
        raise HostError(f"{folder.parent}: no room for {size_bytes >> 20} MB of submissions")
    with temporary_folder("download", folder.parent) as new:
        place = new / "all"
        place.mkdir()
        for member in members:
            download.extract(member, place)
        _within_one_folder(place).rename(folder)


def _within_one_folder(place: Path) -> Path:
    """Return the folder of the submissions: some put it into another one."""
    inside = list(place.iterdir())
    alone = inside[0] if len(inside) == 1 and inside[0].is_dir() else None
    return alone if alone is not None and platform_name(alone.name) is None else place
