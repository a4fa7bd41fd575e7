"""Where results lie between a worker and the client: a folder that both reach, by its path or by any fsspec URL."""

from __future__ import annotations

import hashlib
import re
import secrets
import tarfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO, cast
from urllib.parse import urlsplit

from grader.errors import HostError, UsageError
from grader.files import make_folder
from grader.model.record import Record

TOKEN_BYTES = 8
SUFFIX = ".tar.gz"
PART = ".part"
CHUNK_BYTES = 1 << 20
OWN_MEMORY = ("memory", "local+memory")
HELLO = "hello"


class Parcel(Record):
    """A packed folder in the exchange, under `name`: its size in bytes and the sha256 of its bytes."""

    name: str
    size: int
    sha256: str


class Exchange:
    """The folder at `url`. It can be sent to another machine, which reaches it with credentials of its own.

    What cannot be read or written raises HostError, FileNotFoundError for a parcel that is not there.
    """

    def __init__(self, url: str) -> None:
        self.url = url.rstrip("/")

    def make(self) -> None:
        """Make the folder, and empty it of what an earlier batch left."""
        with _told(self, "written"):
            place, root = self._open()
            if place.exists(root):
                place.rm(root, recursive=True)
            if "://" in self.url:
                place.makedirs(root, exist_ok=True)
            elif not make_folder(Path(root)):
                raise FileExistsError("somebody else has just made it")

    def remove(self) -> None:
        """The folder and everything in it."""
        with _told(self, "written"):
            place, root = self._open()
            if place.exists(root):
                place.rm(root, recursive=True)

    def put(self, local: Path, job_id: str) -> Parcel:
        """Upload a file as a new attempt of that job: whole or not at all."""
        name = f"{job_id}.{secrets.token_hex(TOKEN_BYTES)}{SUFFIX}"
        with local.open("rb") as file:
            digest = _digest(file)
        with _told(self, "written"):
            place, root = self._open()
            place.put_file(str(local), f"{root}/{name}{PART}")
            place.mv(f"{root}/{name}{PART}", f"{root}/{name}")
        return Parcel(name=name, size=local.stat().st_size, sha256=digest)

    def open(self, parcel: Parcel) -> BinaryIO:
        """The parcel's bytes."""
        with _told(self, "read"):
            place, root = self._open()
            return cast("BinaryIO", place.open(f"{root}/{parcel.name}", "rb"))

    def forget(self, job_id: str) -> None:
        """Delete every attempt of that job."""
        attempt = re.compile(
            rf"{re.escape(job_id)}\.[0-9a-f]{{{2 * TOKEN_BYTES}}}{re.escape(SUFFIX)}({re.escape(PART)})?"
        )
        with _told(self, "written"):
            place, root = self._open()
            for path in place.ls(root, detail=False):
                if attempt.fullmatch(path.rsplit("/", 1)[-1]):
                    place.rm_file(path)

    def greet(self, word: str) -> None:
        """Leave a word for the workers: who reads it is at the same place."""
        with _told(self, "written"):
            place, root = self._open()
            place.pipe_file(f"{root}/{HELLO}", word.encode())

    def answers(self, word: str) -> bool:
        """Whether the client's word is there, and something can be written beside it."""
        with _told(self, "written"):
            place, root = self._open()
            if not place.exists(f"{root}/{HELLO}") or place.cat_file(f"{root}/{HELLO}") != word.encode():
                return False
            mine = f"{root}/{HELLO}.{secrets.token_hex(TOKEN_BYTES)}"
            place.pipe_file(mine, b"")
            place.rm_file(mine)
            return True

    def _open(self) -> tuple[Any, str]:
        """The file system and the folder's name in it; one for each thread, since not all of them can be shared."""
        import fsspec  # noqa: PLC0415 - of the extra `cluster`

        if "://" not in self.url:
            return fsspec.filesystem("file"), self.url
        place, root = fsspec.core.url_to_fs(self.url)
        place.invalidate_cache()
        return place, root.rstrip("/")


def checked_url(text: str) -> str:
    """What `--exchange` says, a path made absolute.

    Raises UsageError for what the workers cannot reach, and for a password: it would be sent to all of them.
    """
    if "://" not in text:
        return str(Path(text).absolute())
    import fsspec  # noqa: PLC0415 - of the extra `cluster`

    parts = urlsplit(text)
    if parts.password is not None:
        raise UsageError(
            "--exchange holds a password, which every worker and its logs would see",
            hint="let each machine have credentials of its own (a key, environment variables, a configuration file)",
        )
    if parts.scheme in OWN_MEMORY:
        raise UsageError(
            f"--exchange {text}: memory belongs to one process", hint="give a path or s3://…, sftp://…"
        )
    try:
        fsspec.get_filesystem_class(parts.scheme)
    except ImportError as error:
        raise UsageError(f"--exchange {text}: {error}", hint="install it here and on every worker") from error
    except ValueError as error:
        known = "a path, s3://bucket/folder, gs://…, abfs://… or sftp://host/folder"
        raise UsageError(f"--exchange {text}: {error}", hint=f"give {known}") from error
    return text


def _digest(file: BinaryIO) -> str:
    digest = hashlib.sha256()
    while chunk := file.read(CHUNK_BYTES):
        digest.update(chunk)
    return digest.hexdigest()


@contextmanager
def _told(exchange: Exchange, what: str) -> Iterator[None]:
    """Whatever a file system raises becomes HostError that names the exchange."""
    try:
        yield
    except (FileNotFoundError, HostError):
        raise
    except Exception as error:
        reason = getattr(error, "strerror", None) or str(error) or type(error).__name__
        raise HostError(
            f"the exchange {exchange.url} cannot be {what}: {reason}",
            hint="give --exchange a folder or URL that this machine and every worker can write",
        ) from error


# [classes.cluster.parcels] A submission's folder of results as one file, and that file as a folder again. Nothing in it is trusted.

PARCEL_BYTES = 1 << 30
UNPACKED_BYTES = 2 << 30
ENTRIES = 10_000
LEVEL = 1  # evidence is packed already
CHUNK_BYTES_parcels = 1 << 20


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
        while read.read(CHUNK_BYTES_parcels):
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
