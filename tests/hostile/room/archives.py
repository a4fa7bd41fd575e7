"""Archives from listed entries, honest or not."""

from __future__ import annotations

import base64
import io
import stat
import tarfile
import zipfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

TYPES = {
    "file": tarfile.REGTYPE,
    "folder": tarfile.DIRTYPE,
    "link": tarfile.SYMTYPE,
    "hardlink": tarfile.LNKTYPE,
    "fifo": tarfile.FIFOTYPE,
    "device": tarfile.CHRTYPE,
}
KINDS = {
    "file": stat.S_IFREG,
    "folder": stat.S_IFDIR,
    "link": stat.S_IFLNK,
    "fifo": stat.S_IFIFO,
    "device": stat.S_IFCHR,
}
ENCRYPTED = 0x1
BLOCK = bytes(1 << 20)


def write(archive: Mapping[str, Any], folder: Path, path: Path) -> Path:
    """The archive at `path`, with the package in `folder` first where `victim` is set."""
    entries = [*(_victim(folder) if archive["victim"] else ()), *archive["entries"]]
    if archive["format"] == "zip":
        _zip(entries, path)
    else:
        _tar(entries, path, "w:gz" if archive["format"] == "tar.gz" else "w")
    return path


def _victim(folder: Path) -> Iterator[dict[str, Any]]:
    for file in sorted(path for path in folder.rglob("*") if path.is_file() and not path.is_symlink()):
        yield {
            "path": file.relative_to(folder).as_posix(),
            "raw_name": None,
            "type": "file",
            "text": None,
            "base64": base64.b64encode(file.read_bytes()).decode(),
            "zeros": 0,
            "target": "",
            "mode": f"{file.stat().st_mode & 0o777:o}",
            "encrypted": False,
        }


def _content(entry: Mapping[str, Any]) -> bytes:
    if entry["base64"] is not None:
        return base64.b64decode(entry["base64"])
    return (entry["text"] or "").encode()


def _name(entry: Mapping[str, Any]) -> bytes:
    return base64.b64decode(entry["raw_name"]) if entry["raw_name"] is not None else entry["path"].encode()


def _tar(entries: list[Any], path: Path, mode: str) -> None:
    with tarfile.open(
        path, mode, format=tarfile.GNU_FORMAT, encoding="utf-8", errors="surrogateescape"
    ) as tar:  # type: ignore[call-overload]
        for entry in entries:
            info = tarfile.TarInfo(_name(entry).decode("utf-8", "surrogateescape"))
            info.type = TYPES[entry["type"]]
            info.mode = int(entry["mode"], 8)
            info.linkname = entry["target"]
            if info.type == tarfile.CHRTYPE:
                info.devmajor, info.devminor = 1, 5
            data = io.BytesIO(bytes(entry["zeros"]) or _content(entry))
            info.size = len(data.getvalue()) if info.type == tarfile.REGTYPE else 0
            tar.addfile(info, data)


class _Named(zipfile.ZipInfo):
    """A name of any bytes, and flags that the content does not bear out."""

    name_bytes = b""
    false_flags = 0

    def _encodeFilenameFlags(self) -> tuple[bytes, int]:  # noqa: N802 - the library's name
        return self.name_bytes, self.flag_bits | self.false_flags


def _zip(entries: list[Any], path: Path) -> None:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
        for entry in entries:
            info = _Named(_name(entry).decode("cp437"))
            info.name_bytes = _name(entry)
            info.false_flags = ENCRYPTED if entry["encrypted"] else 0
            info.compress_type = zipfile.ZIP_DEFLATED
            info.create_system = 3
            info.external_attr = (KINDS[entry["type"]] | int(entry["mode"], 8)) << 16
            content = entry["target"].encode() if entry["type"] == "link" else _content(entry)
            with file.open(info, "w", force_zip64=entry["zeros"] > 1 << 31) as target:
                for _ in range(entry["zeros"] // len(BLOCK)):
                    target.write(BLOCK)
                target.write(bytes(entry["zeros"] % len(BLOCK)) or content)
