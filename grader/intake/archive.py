"""An archive becomes a folder. What kind it is, its content says, not its name."""

from __future__ import annotations

import errno
import hashlib
import lzma
import struct
import tarfile
import zipfile
import zlib
from dataclasses import dataclass
from pathlib import Path

from grader.errors import SubmissionError
from grader.intake.limits import Limits, too_much
from grader.intake.names import brief, is_archive_name
from grader.intake.tars import is_packed, unpack_tar
from grader.intake.unpack import Unpacker
from grader.intake.zips import unpack_zip

_DAMAGED = (
    zipfile.BadZipFile,
    tarfile.TarError,
    zlib.error,
    lzma.LZMAError,
    struct.error,
    EOFError,
    ValueError,
    OverflowError,
    RecursionError,
    FileExistsError,
    NotADirectoryError,
    IsADirectoryError,
)
_FOREIGN = {b"Rar!": "a rar archive", b"7z\xbc\xaf": "a 7z archive", b"\x28\xb5\x2f\xfd": "packed by zstd"}
_KINDS = "Hand in a .zip or a .tar.gz."


@dataclass(frozen=True, kw_only=True)
class Unpacked:
    """`executable` is keyed by path below `root`; None where the archive carries no mode for that file."""

    root: Path
    sha256: str
    executable: dict[str, bool | None]
    hints: tuple[str, ...]


def unpack(path: Path, into: Path, limits: Limits) -> Unpacked:
    """The archive at `path`, unpacked into the new folder `into`.

    Raises SubmissionError for what is no archive, is damaged, has a password, is too large or reaches out.
    """
    name = brief(path.name)
    with path.open("rb") as stream:
        head = stream.read(_BLOCK)
    if path.stat().st_size > limits.packed_bytes:
        raise too_much(name, f"is larger than {limits.packed_bytes >> 20} MiB")
    into.mkdir(parents=True)
    unpacker = Unpacker(into, name=name, limits=limits)
    try:
        if _looks_like_zip(path, head):
            unpack_zip(path, unpacker)
        elif is_packed(head) or _looks_like_tar(head):
            unpack_tar(path, unpacker, name=name, limits=limits)
        else:
            raise _no_archive(path, head)
        hints = unpacker.finish()
    except NotImplementedError as error:
        raise SubmissionError(
            f"{name} is packed in a way that is not read here ({error})", hint=_KINDS
        ) from None
    except _DAMAGED as error:
        raise _damaged(name, error) from None
    except OSError as error:
        if error.errno == errno.ENAMETOOLONG:
            raise SubmissionError(f"{name} holds a path that is too long", hint="Shorten it.") from None
        # gzip and bz2 report what is damaged in this way too, but without a number.
        if error.errno is not None:
            raise
        raise _damaged(name, error) from None
    return Unpacked(root=into, sha256=_sha256(path), executable=unpacker.executable, hints=tuple(hints))


_BLOCK = tarfile.BLOCKSIZE


def _looks_like_zip(path: Path, head: bytes) -> bool:
    if head.startswith((b"PK\x03\x04", b"PK\x05\x06", b"PK\x07\x08")):
        return True
    return not is_packed(head) and not _looks_like_tar(head) and zipfile.is_zipfile(path)


def _looks_like_tar(head: bytes) -> bool:
    try:
        tarfile.TarInfo.frombuf(head, "utf-8", "surrogateescape")
    except tarfile.EOFHeaderError:  # type: ignore[attr-defined]
        return True
    except (tarfile.TarError, ValueError):
        return False
    return True


def _no_archive(path: Path, head: bytes) -> SubmissionError:
    name = brief(path.name)
    if not head:
        return SubmissionError(f"{name} is empty", hint=_KINDS)
    foreign = next((what for magic, what in _FOREIGN.items() if head.startswith(magic)), None)
    if foreign:
        return SubmissionError(f"{name} is {foreign}, which is not read here", hint=_KINDS)
    if is_archive_name(path.name):
        return SubmissionError(
            f"{name} is damaged: it does not hold what its name says", hint="Pack it again."
        )
    return SubmissionError(f"{name} is a file, not an archive", hint=f"Give the package's folder. {_KINDS}")


def _damaged(name: str, error: Exception) -> SubmissionError:
    what = "a name stands for a file and a folder at once" if getattr(error, "errno", None) else str(error)
    return SubmissionError(
        f"{name} is damaged or incomplete ({brief(what) or type(error).__name__})",
        hint="Download or pack it again.",
    )


def _sha256(path: Path) -> str:
    digest = hashlib.sha256()
    with path.open("rb") as stream:
        while block := stream.read(1 << 20):
            digest.update(block)
    return digest.hexdigest()
