"""Every file of a package: size, digest, mode, links, and how its text begins and is encoded."""

from __future__ import annotations

import hashlib
import io
import os
import stat
import tokenize
from collections.abc import Callable, Iterator
from pathlib import Path, PurePosixPath
from typing import Any, NamedTuple

from grader.model.package import SourceFile
from grader.model.submission import SourcePackage
from grader.package.reading import LEFT_OUT, SOURCE_LIMIT_BYTES, Unreadable, printable, regular_file
from grader.package.shebang import is_near_python, read_shebang

_CHUNK_BYTES = 1 << 20
_UTF16 = (b"\xff\xfe", b"\xfe\xff")
_SCRIPTS = frozenset({".py", ".sh", ".bash"})

Interpreters = Callable[[str], bool]


class Entry(NamedTuple):
    """A file of the package: the record, and its path on disk below the package (perhaps no Unicode)."""

    file: SourceFile
    path: str


def read_files(package: SourcePackage, interpreters: Interpreters | None = None) -> tuple[Entry, ...]:
    """All regular files and links of the package, by path; no link is followed out of it.

    What catkin and git leave behind (`build/`, `devel/`, `install/`, `.git/`, …), pipes and devices are left
    out.
    """
    paths = sorted(_paths(package.folder))
    return tuple(Entry(_source_file(package, path, interpreters), path) for path in paths)


def _paths(folder: Path) -> Iterator[str]:
    for place, folders, names in os.walk(folder):
        links = [name for name in folders if os.path.islink(os.path.join(place, name))]  # noqa: PTH114, PTH118 - names of any bytes, many of them
        folders[:] = [name for name in folders if name not in LEFT_OUT]
        for name in (*names, *(n for n in links if n not in LEFT_OUT)):
            path = Path(place, name)
            mode = path.lstat().st_mode
            if stat.S_ISREG(mode) or stat.S_ISLNK(mode):
                yield path.relative_to(folder).as_posix()


def _source_file(package: SourcePackage, path: str, interpreters: Interpreters | None) -> SourceFile:
    common: dict[str, Any] = {"path": printable(path), "mode_source": package.mode_source}
    file = package.folder / path
    if file.is_symlink():
        target = str(file.readlink())
        common["link"] = printable(target)
        try:
            file = regular_file(package.folder, path)
        except Unreadable as error:
            digest = hashlib.sha256(os.fsencode(target)).hexdigest()
            return SourceFile(
                **common,
                size_bytes=0,
                sha256=digest,
                executable=None,
                link_problem=f"`{common['path']}` {error}",
            )
        path = file.relative_to(os.path.realpath(package.folder)).as_posix()
    executable = _executable(package, path, file)
    if printable(path) in package.left_out:
        return SourceFile(**common, size_bytes=file.lstat().st_size, sha256="", executable=executable)
    try:
        size, digest, head = _contents(file)
    except OSError:
        return SourceFile(**common, size_bytes=0, sha256="", executable=executable)
    if path in package.right_in_git:
        head = head.replace(b"\r\n", b"\n")
    text = _text_facts(head, path, executable=executable, interpreters=interpreters)
    return SourceFile(**common, size_bytes=size, sha256=digest, executable=executable, **text)


def _executable(package: SourcePackage, path: str, file: Path) -> bool | None:
    """As the source says; a file that it does not know has its mode on disk, if modes come from there."""
    if path in package.executable:
        return package.executable[path]
    if package.mode_source != "disk":
        return None
    return bool(file.stat().st_mode & stat.S_IXUSR)


def _contents(file: Path) -> tuple[int, str, bytes]:
    """Size, sha256 and the first 2 MB."""
    digest, size, head = hashlib.sha256(), 0, b""
    with file.open("rb") as stream:
        while chunk := stream.read(_CHUNK_BYTES):
            digest.update(chunk)
            size += len(chunk)
            head += chunk[: max(0, SOURCE_LIMIT_BYTES - len(head))]
    return size, digest.hexdigest(), head


def _text_facts(
    data: bytes, path: str, *, executable: bool | None, interpreters: Interpreters | None
) -> dict[str, Any]:
    utf16 = data.startswith(_UTF16)
    binary = b"\0" in data and not utf16
    suffix = PurePosixPath(path).suffix.lower()
    python = suffix == ".py" or is_near_python(data)
    shebang, problem = read_shebang(data, interpreters)
    script = suffix in _SCRIPTS or bool(executable) or shebang is not None or python
    return {
        "shebang": shebang,
        "shebang_problem": problem if script and (not binary or suffix in _SCRIPTS) else "",
        "crlf": b"\r\n" in data and not binary,
        "bom": data.startswith(b"\xef\xbb\xbf") or utf16,
        "encoding": _encoding(data, python=python),
        "binary": binary,
        "python": python,
    }


def _encoding(data: bytes, *, python: bool) -> str:
    """The encoding that a reader would use: of Python by PEP 263, `unknown-8bit` for what is not UTF-8."""
    if data.startswith(_UTF16):
        return "utf-16"
    name = "utf-8-sig" if data.startswith(b"\xef\xbb\xbf") else "utf-8"
    try:
        if python:
            name, _ = tokenize.detect_encoding(io.BytesIO(data).readline)
        data.decode(name)
    except (SyntaxError, LookupError, ValueError):
        # the first 2 MB of a larger file may end within a character
        cut = len(data) >= SOURCE_LIMIT_BYTES and data[:-4].decode("utf-8", "replace").count("\ufffd") == 0
        return "utf-8" if cut else "unknown-8bit"
    return name
