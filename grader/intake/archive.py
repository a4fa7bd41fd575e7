"""An archive becomes a folder. What kind it is, its content says, not its name.

A child process with limits unpacks it (`limited_child.py`): `unpack` starts it, and `unpack_here` is what runs there.
What is hostile in an archive is stopped here:

- size: `Meter` (`limits.py`) counts what is written, `_Counted` what is read, and the child has limits of its own;
- a zip file whose entries share their data: `_unpack_zip`;
- names that lead out (`..`, an absolute path): `Unpacker.admit`, links that do: `Unpacker.finish`;
- devices and other things that are no files: `_unpack_member`, `_unpack_entry`.
"""

from __future__ import annotations

import bz2
import errno
import gzip
import json
import lzma
import os
import re
import shutil
import stat
import struct
import tarfile
import zipfile
import zlib
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from itertools import pairwise
from pathlib import Path
from typing import IO, Any, cast

from grader.errors import SubmissionError
from grader.intake.limits import IntakeLimits, Meter, too_much
from grader.intake.names import brief, is_archive_name, listing
from grader.intake.tree import NO_CONTENT, file_digest
from grader.limited_child import ChildLimits, run_limited

MEMORY_BYTES, CPU_S, WALL_S = 512 << 20, 60, 180.0
CHUNK_BYTES = 1 << 20
PACKINGS: dict[bytes, Callable[[Any], Any]] = {
    b"\x1f\x8b": gzip.open,
    b"BZh": bz2.open,
    b"\xfd7zXZ\x00": lzma.open,
}
# what the standard library raises for an archive that is damaged or made to do harm
DAMAGED = (
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
FOREIGN = {b"Rar!": "a rar archive", b"7z\xbc\xaf": "a 7z archive", b"\x28\xb5\x2f\xfd": "packed by zstd"}
KINDS = "Hand in a .zip or a .tar.gz."
UNIX = (3, 19)  # `create_system`: Unix and macOS, whose modes are in the upper half of `external_attr`
UTF8_NAME = 0x800  # bit 11 of the flags
ENCRYPTED = 0x41  # bits 0 and 6: encrypted, and strongly encrypted
LOCAL_HEADER_BYTES = 30
ZIP_PACKINGS = {zipfile.ZIP_BZIP2: "bzip2", zipfile.ZIP_LZMA: "LZMA"}
LINK_BYTES = 1 << 12
# `git archive`, and so GitHub and GitLab, puts the commit's hash here.
GIT_COMMENT = re.compile(rb"[0-9a-f]{40}|[0-9a-f]{64}")


@dataclass(frozen=True, kw_only=True)
class UnpackResult:
    """`executable` is keyed by path below `root`; None where the archive carries no mode for that file."""

    root: Path
    sha256: str
    executable: dict[str, bool | None]
    hints: tuple[str, ...]


def unpack(path: Path, into: Path, limits: IntakeLimits) -> UnpackResult:
    """Unpack the archive at `path` into the new folder `into`, in a child process.

    Raises SubmissionError for anything but an archive, or one that is damaged, has a password, is too large or reaches
    out, OSError for what this machine cannot read or write.
    """
    name = brief(path.name)
    if path.stat().st_size > limits.packed_bytes:
        raise too_much(name, f"is larger than {limits.packed_bytes >> 20} MiB")
    into.mkdir(parents=True)
    answer = run_limited(
        "grader.intake.archive:unpack_here",
        # absolute, since the child's working folder is `/`
        *(str(path.absolute()), str(into.absolute()), asdict(limits)),
        limits=ChildLimits(
            memory_bytes=MEMORY_BYTES, cpu_s=CPU_S, wall_s=WALL_S, file_bytes=limits.total_bytes
        ),
    )
    try:
        said: dict[str, Any] | None = json.loads(answer.lines) if answer.done else None
    except ValueError:
        said = None
    if said is None:
        raise too_much(name, "takes more time or memory to unpack")
    if "refused" in said:
        message, hint = said["refused"]
        raise SubmissionError(message, hint=hint)
    if "errno" in said:
        raise OSError(said["errno"], said["strerror"], said["filename"])
    return UnpackResult(
        root=into, sha256=said["sha256"], executable=said["executable"], hints=tuple(said["hints"])
    )


def unpack_here(path: str, into: str, limits: dict[str, int]) -> Iterator[dict[str, Any]]:
    """Unpack the archive and yield one record for `unpack`: what was unpacked, or why it was not."""
    try:
        yield _unpack(Path(path), Path(into), IntakeLimits(**limits))
    except SubmissionError as error:
        yield {"refused": (error.message, error.hint)}
    except OSError as error:
        yield {"errno": error.errno, "strerror": error.strerror, "filename": str(error.filename or "")}


def _unpack(path: Path, into: Path, limits: IntakeLimits) -> dict[str, Any]:
    name = brief(path.name)
    with path.open("rb") as stream:
        head = stream.read(tarfile.BLOCKSIZE)
    unpacker = Unpacker(into, name=name, limits=limits)
    try:
        if _looks_like_zip(path, head):
            _unpack_zip(path, unpacker, name, limits)
        elif _opener(head) or _looks_like_tar(head):
            _unpack_tar(path, unpacker, name, limits)
        else:
            raise _no_archive(path, head)
        hints = unpacker.finish()
    except NotImplementedError as error:
        raise SubmissionError(
            f"{name} is packed in a way that is not read here ({error})", hint=KINDS
        ) from None
    except DAMAGED as error:
        raise _damage_error(name, error) from None
    except OSError as error:
        if error.errno == errno.ENAMETOOLONG:
            raise SubmissionError(f"{name} holds a path that is too long", hint="Shorten it.") from None
        # gzip and bz2 report what is damaged in this way too, but without a number.
        if error.errno is not None:
            raise
        raise _damage_error(name, error) from None
    return {"sha256": file_digest(path).hexdigest(), "executable": unpacker.executable, "hints": hints}


def _opener(head: bytes) -> Callable[[Any], Any] | None:
    return next((opener for magic, opener in PACKINGS.items() if head.startswith(magic)), None)


def _looks_like_zip(path: Path, head: bytes) -> bool:
    if head.startswith((b"PK\x03\x04", b"PK\x05\x06", b"PK\x07\x08")):
        return True
    # A zip may stand behind something else (a program that unpacks itself), and a tar may hold one at its end.
    return _opener(head) is None and not _looks_like_tar(head) and zipfile.is_zipfile(path)


def _looks_like_tar(head: bytes) -> bool:
    try:
        tarfile.TarInfo.frombuf(head, "utf-8", "surrogateescape")
    # a block of zeros, with which an empty tar begins
    except tarfile.EOFHeaderError:  # type: ignore[attr-defined]
        return True
    except (tarfile.TarError, ValueError):
        return False
    return True


def _no_archive(path: Path, head: bytes) -> SubmissionError:
    name = brief(path.name)
    if not head:
        return SubmissionError(f"{name} is empty", hint=KINDS)
    foreign = next((what for magic, what in FOREIGN.items() if head.startswith(magic)), None)
    if foreign:
        return SubmissionError(f"{name} is {foreign}, which is not read here", hint=KINDS)
    if is_archive_name(path.name):
        return SubmissionError(
            f"{name} is damaged: it does not hold what its name says", hint="Pack it again."
        )
    return SubmissionError(f"{name} is a file, not an archive", hint=f"Give the package's folder. {KINDS}")


def _damage_error(name: str, error: Exception) -> SubmissionError:
    what = "a name stands for a file and a folder at once" if getattr(error, "errno", None) else str(error)
    return SubmissionError(
        f"{name} is damaged or incomplete ({brief(what) or type(error).__name__})",
        hint="Download or pack it again.",
    )


def _unpack_tar(path: Path, unpacker: Unpacker, name: str, limits: IntakeLimits) -> None:
    """Raises tarfile.TarError for a tar that is cut off."""
    with path.open("rb") as packed:
        opener = _opener(packed.read(8))
        packed.seek(0)
        stream = _Counted(opener(packed) if opener else packed, name, limits.stream_bytes)
        with tarfile.open(
            fileobj=cast("IO[bytes]", stream),
            # `|`: as a stream, since to seek back would be to unpack all before once more
            mode="r|",
            encoding="utf-8",
            errors="surrogateescape",
            tarinfo=_Member,
        ) as archive:
            while (member := _next(archive)) is not None:
                _unpack_member(archive, member, unpacker)
        while stream.read(CHUNK_BYTES):  # a packed one has its checksum at the end
            pass


class _Counted:
    """A stream that is read once. Raises SubmissionError for more than the limit."""

    def __init__(self, stream: IO[bytes], name: str, limit_bytes: int) -> None:
        self._stream, self._name, self._limit_bytes = stream, name, limit_bytes
        self._bytes = 0

    def read(self, size: int) -> bytes:
        data = self._stream.read(size)
        self._bytes += len(data)
        if self._bytes > self._limit_bytes:
            raise too_much(self._name, f"is larger than {self._limit_bytes >> 20} MiB when unpacked")
        return data


class _Member(tarfile.TarInfo):
    """A header; `tarfile` would take one that is damaged or missing for the end of the archive."""

    @classmethod
    def fromtarfile(cls, archive: tarfile.TarFile) -> _Member:
        try:
            return super().fromtarfile(archive)
        except (tarfile.EOFHeaderError, tarfile.SubsequentHeaderError):  # type: ignore[attr-defined]
            raise
        except tarfile.InvalidHeaderError:  # type: ignore[attr-defined]
            raise tarfile.ReadError("a header is wrong") from None
        except tarfile.HeaderError:
            raise tarfile.ReadError("the end is missing") from None


def _next(archive: tarfile.TarFile) -> tarfile.TarInfo | None:
    """As `archive.next()`, which in Python 3.10 seeks before the beginning of a tar that holds nothing."""
    empty = archive.offset == 0 and archive.firstmember is None  # type: ignore[attr-defined]
    archive.members = []  # type: ignore[attr-defined] # they are not needed again, and there may be many
    return None if empty else archive.next()


def _unpack_member(archive: tarfile.TarFile, member: tarfile.TarInfo, unpacker: Unpacker) -> None:
    if member.issparse():
        unpacker.refuse("it holds a sparse file (pack it without `--sparse`)")
    path = unpacker.admit(member.name, member.size if member.isreg() else 0)
    if path is None:
        return
    if member.isdir():
        unpacker.folder(path)
    elif member.issym():
        unpacker.link(path, member.linkname)
    elif member.islnk():
        unpacker.hard_link(path, member.linkname)
    elif member.isreg() and (content := archive.extractfile(member)) is not None:
        unpacker.file(path, content, executable=bool(member.mode & 0o100))
    else:
        unpacker.refuse(f"the entry '{brief(path)}' is a device or a pipe")


def _unpack_zip(path: Path, unpacker: Unpacker, name: str, limits: IntakeLimits) -> None:
    """Zip files as Windows, macOS, Linux, GitHub and Python write them."""
    with zipfile.ZipFile(path) as archive:
        by_git = GIT_COMMENT.fullmatch(archive.comment) is not None
        if len(archive.infolist()) > limits.entries:
            raise too_much(name, f"holds more than {limits.entries} files")
        # one packed content that many entries share would be unpacked over and over
        for one, two in pairwise(sorted(archive.infolist(), key=lambda info: info.header_offset)):
            if one.header_offset + LOCAL_HEADER_BYTES + one.compress_size > two.header_offset:
                unpacker.refuse(f"the entry '{brief(two.filename)}' is inside another one")
        for info in archive.infolist():
            _unpack_entry(archive, info, unpacker, by_git=by_git)


def _unpack_entry(
    archive: zipfile.ZipFile, info: zipfile.ZipInfo, unpacker: Unpacker, *, by_git: bool
) -> None:
    name = _entry_name(info)
    path = unpacker.admit(name, info.file_size)
    if path is None:
        return
    mode = info.external_attr >> 16 if info.create_system in UNIX else 0
    kind = stat.S_IFMT(mode)
    if kind not in (0, stat.S_IFREG, stat.S_IFDIR, stat.S_IFLNK):
        unpacker.refuse(f"the entry '{brief(path)}' is a device or a pipe")
    if name.endswith("/") or kind == stat.S_IFDIR:
        unpacker.folder(path)
        return
    if info.flag_bits & ENCRYPTED:
        unpacker.refuse("it is protected by a password")
    if info.compress_type in ZIP_PACKINGS:
        raise NotImplementedError(f"by {ZIP_PACKINGS[info.compress_type]}")
    with archive.open(info) as content:
        if kind == stat.S_IFLNK:
            unpacker.link(path, content.read(LINK_BYTES).decode("utf-8", "surrogateescape"))
        else:
            # git archive gives a mode to executable files alone.
            known = bool(mode & stat.S_IXUSR) if mode or by_git else None
            unpacker.file(path, content, executable=known)


def _entry_name(info: zipfile.ZipInfo) -> str:
    """Return the entry's name with `/`: old tools of Windows write `\\`, and many write UTF-8 without saying so."""
    name = info.filename
    if not info.flag_bits & UTF8_NAME:
        try:
            # what `zipfile` takes a name for that is not marked as UTF-8
            name = name.encode("cp437").decode("utf-8")
        except UnicodeError:
            name = info.filename
    return name if info.create_system in UNIX else name.replace("\\", "/")


_LONGEST_TARGET = 4095
_LONGEST_NAME_BYTES = 255
_CHUNK_BYTES = 1 << 16
# As Windows reads a name, whatever the system that packed it.
_OUTSIDE = re.compile(r"^[A-Za-z]:[/\\]|(^|[/\\])\.\.\\|\\\.\.($|[/\\])|^\\")


class Unpacker:
    """`executable` maps each file written to its executable bit, None where the archive does not tell.

    Files come first and links last, so that nothing is ever written through a link.
    """

    def __init__(self, root: Path, *, name: str, limits: IntakeLimits) -> None:
        self.executable: dict[str, bool | None] = {}
        self._root = root
        self._name = name
        self._limits = limits
        self._meter = Meter(limits, name=name)
        self._sizes: dict[str, int] = {}
        self._links: dict[str, str] = {}
        self._large: list[str] = []
        self._unnamed: list[str] = []

    def admit(self, name: str, size_bytes: int = 0) -> str | None:
        """Return the path below the root for an entry's name; None for what is not looked at (`.git`, `__MACOSX`) and
        for what is left out: a file too large, a name that no disk takes.

        Raises SubmissionError for a name that leads outside and for more than the limits allow.
        """
        self._meter.entry(name)
        parts = [part for part in name.split("/") if part not in ("", ".")]
        if name.startswith("/") or ".." in parts or _OUTSIDE.search(name):
            self.refuse(f"the entry '{brief(name)}' leads outside of it")
        # `._name` is where macOS keeps what other systems have no place for
        if not parts or NO_CONTENT.intersection(parts) or parts[-1].startswith("._"):
            return None
        path = "/".join(parts)
        if "\0" in name or any(len(os.fsencode(part)) > _LONGEST_NAME_BYTES for part in parts):
            self._unnamed.append(path)
            return None
        if not self._meter.has_room(path, size_bytes):
            self._large.append(path)
            return None
        self._meter.folders(path)
        self._meter.data(size_bytes)
        return path

    def folder(self, path: str) -> None:
        """Make a folder, and those on the way to it."""
        self._meter.folders(f"{path}/")
        (self._root / path).mkdir(parents=True, exist_ok=True)

    def file(self, path: str, content: IO[bytes], *, executable: bool | None) -> None:
        """Write a file."""
        target = self._free(path)
        # x: never into a file that is there already
        with target.open("xb") as out:
            shutil.copyfileobj(content, out, _CHUNK_BYTES)
            self._sizes[path] = out.tell()
        # no other bits of the archive's: `setuid` and the like stay out
        target.chmod(0o755 if executable else 0o644)
        self.executable[path] = executable

    def hard_link(self, path: str, name: str) -> None:
        """Make a second name for a file that the archive has already brought."""
        first = os.path.normpath(name)
        if first in self._links:
            self.link(path, self._links[first])
            return
        if first in self._large:
            self._large.append(path)
            return
        if first not in self.executable:
            self.refuse(f"the entry '{brief(path)}' is a link to what is not in it")
        if first != path:
            # If the package is copied or all of it is read, the file comes up once more.
            self._meter.data(self._sizes[first])
            self._sizes[path] = self._sizes[first]
            os.link(self._root / first, self._free(path))
            self.executable[path] = self.executable[first]

    def link(self, path: str, target: str) -> None:
        if len(os.fsencode(target)) > _LONGEST_TARGET or "\0" in target or not target:
            self.refuse(f"the link '{brief(path)}' has no usable target")
        self._links[path] = target

    def finish(self) -> list[str]:
        """Make the links, and return the hints on all that was left out.

        A workspace holds links that point outside (`src/CMakeLists.txt` leads to `/opt/ros`): they are no offence.
        """
        # A relative target is followed to see where it leads; an absolute one leads outside as it stands.
        if sum(not target.startswith("/") for target in self._links.values()) > self._limits.links:
            self.refuse(f"it holds more than {self._limits.links} links")
        for path, target in self._links.items():
            self._make_link(path, target)
        return [
            f"{why} left out: {listing(sorted(paths))}"
            for why, paths in (
                ("links that point outside the archive were", self._remove_strays()),
                ("files that are too large were", self._large),
                ("files with a name that no disk takes were", self._unnamed),
            )
            if paths
        ]

    def _remove_strays(self) -> set[str]:
        outside: set[str] = set()
        # A link to a link that is removed leads nowhere from then on, or out by another way: look again.
        while stray := [path for path in self._links if path not in outside and self._leads_out(path)]:
            for path in stray:
                (self._root / path).unlink()
            outside.update(stray)
        return outside

    def _make_link(self, path: str, target: str) -> None:
        place = self._root / path
        if place.is_dir() and not place.is_symlink():
            self.refuse(f"the entry '{brief(path)}' is a link and a folder at once")
        place = self._free(path)
        # A link that was made before stands on the way: what is written behind it would be somewhere else.
        if place.parent.resolve() != self._root.resolve().joinpath(*path.split("/")[:-1]):
            self.refuse(f"the entry '{brief(path)}' is behind a link")
        place.symlink_to(target)

    def refuse(self, why: str) -> None:
        raise SubmissionError(
            f"{self._name} is not unpacked: {why}",
            hint="Pack the package's folder again, as a plain .zip or .tar.gz.",
        )

    def _leads_out(self, path: str) -> bool:
        if self._links[path].startswith("/"):
            return True
        place = self._root / path
        try:
            place.stat()
        except OSError as error:
            if error.errno == errno.ELOOP:  # a chain that no system follows leads nowhere
                return False
        # Path.resolve raises for a loop, before Python 3.13
        return not Path(os.path.realpath(place)).is_relative_to(self._root.resolve())

    def _free(self, path: str) -> Path:
        """Return the place for an entry; a later entry of the same name replaces the one before."""
        target = self._root / path
        target.parent.mkdir(parents=True, exist_ok=True)
        target.unlink(missing_ok=True)
        self.executable.pop(path, None)
        return target
