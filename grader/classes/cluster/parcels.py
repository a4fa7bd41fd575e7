"""A submission's folder of results as one file, and that file as a folder again. Nothing in it is trusted."""

from __future__ import annotations

import hashlib
import tarfile
import zlib
from pathlib import Path
from typing import BinaryIO, cast

from grader.classes.cluster.exchange import Parcel
from grader.errors import HostError

PARCEL_BYTES = 1 << 30
UNPACKED_BYTES = 2 << 30
ENTRIES = 10_000
LEVEL = 1  # evidence is packed already
CHUNK_BYTES = 1 << 20


def pack(folder: Path, file: Path) -> None:
    """Everything in `folder`, without what the grader itself hides in it."""
    with tarfile.open(file, "x:gz", compresslevel=LEVEL) as archive:
        for path in sorted(folder.iterdir()):
            if not path.name.startswith("."):
                archive.add(path, arcname=path.name)


def unpack(stream: BinaryIO, parcel: Parcel, folder: Path) -> None:
    """The parcel's files into `folder`. Raises HostError for another content than was sent, for more than results ever
    are, and for anything that is neither file nor folder or leads out; then `folder` is to be thrown away."""
    read = _Measured(stream, parcel)
    try:
        with tarfile.open(fileobj=cast("BinaryIO", read), mode="r|gz") as archive:
            _extract(archive, parcel, folder)
        while read.read(CHUNK_BYTES):
            pass
    except (tarfile.TarError, zlib.error, EOFError, ValueError, OSError) as error:
        raise _unlike(parcel, str(error) or type(error).__name__) from error
    if (read.size, read.digest.hexdigest()) != (parcel.size, parcel.sha256):
        raise _unlike(parcel, "it is not what the worker sent")


def _extract(archive: tarfile.TarFile, parcel: Parcel, folder: Path) -> None:
    size, count = 0, 0
    while (member := archive.next()) is not None:
        size, count = size + member.size, count + 1
        if count > ENTRIES or size > UNPACKED_BYTES:
            raise _unlike(parcel, "it holds more than results ever are")
        if not (member.isreg() or member.isdir()):
            raise _unlike(parcel, "it holds something that is neither file nor folder")
        archive.extract(member, folder, set_attrs=False, filter="data")
        archive.members = []  # type: ignore[attr-defined] # nobody looks back


class _Measured:
    """A stream that counts what is read from it."""

    def __init__(self, stream: BinaryIO, parcel: Parcel) -> None:
        self._stream, self._parcel = stream, parcel
        self.size, self.digest = 0, hashlib.sha256()

    def read(self, size: int) -> bytes:
        data = self._stream.read(size)
        self.size += len(data)
        self.digest.update(data)
        if self.size > min(self._parcel.size, PARCEL_BYTES):
            raise _unlike(self._parcel, "it is larger than what the worker sent")
        return data


def _unlike(parcel: Parcel, why: str) -> HostError:
    return HostError(
        f"{parcel.name} cannot be unpacked: {why}", hint="look whether somebody else writes into the exchange"
    )
