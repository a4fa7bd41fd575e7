"""A package's files as repairs see them, in memory, and how one repair is written to the disk.

Files are opened without following any link, from the package's folder on, and replaced whole.
"""

from __future__ import annotations

import os
import re
import secrets
import stat
import sys
from collections.abc import Collection, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from typing import BinaryIO

from grader.files import atomic_write, open_untrusted
from grader.line_slips.python_habits import MERGED
from grader.model.package import CMAKE, MANIFEST
from grader.model.repair import Repair, RepairKind, added_lines, lines_to_write, messages_of
from grader.package.lint.script_blocks import first_version, last_version
from grader.package.reading import LEFT_OUT
from grader.package.repairs.well_formed import well_formed
from grader.package.xml import (
    find_strange,
    parse_xml,
)
from grader.portable import BINARY, CLOEXEC, DIRECTORY, NOFOLLOW, READ
from grader.wording import numbers_text

TEXT_BYTES_MAX = 64_000
"""Larger files are not a student's work, and are left as they are."""
HAS_DIR_FD = os.open in os.supports_dir_fd
BOM = b"\xef\xbb\xbf"
UTF16 = (b"\xff\xfe", b"\xfe\xff")
NAMING = (".launch", ".launch.xml", ".test")
CODE = (".py", ".cpp", ".cc", ".cxx", ".h", ".hpp")
MADE_OF = {
    ".msg": "",
    ".srv": "Request|Response",
    ".action": "(?:Action)?(?:Goal|Result|Feedback)|Action",
}
"""Ends of the classes that are made of a definition, beside its own name."""
OF_ROS = r"\b(?:std|geometry|sensor|nav|actionlib)_msgs(?:\.msg import\b.*\b|\.msg\.|/|::)"
"""What stands before a type of ROS's own in code."""


class NotRepairable(ValueError):
    """The file is no longer as the repair knows it, or is none that the grader would write."""


def read_data(folder: Path, file: str) -> bytes | None:
    """Return a file's bytes; None for what is not a regular file inside the folder, or too large."""
    try:
        with _open(folder, file) as stream:
            data = stream.read(TEXT_BYTES_MAX + 1)
    except (OSError, ValueError):
        return None
    return data if len(data) <= TEXT_BYTES_MAX else None


def _open(folder: Path, file: str) -> BinaryIO:
    if HAS_DIR_FD:
        return open_untrusted(folder, *parts_of(file))
    return open_untrusted(_without_links(folder, file))


def _without_links(folder: Path, file: str) -> Path:
    """Return the path on Windows, which opens nothing relative to a folder. Raises NotRepairable."""
    path = folder.joinpath(*parts_of(file))
    if any(place.is_symlink() for place in (path, *path.parents) if place.is_relative_to(folder)):
        raise NotRepairable(f"{file} is behind a link")
    return path


def _set_mode(stream: BinaryIO, mode: int) -> None:
    if sys.platform != "win32":
        os.fchmod(stream.fileno(), mode)


def parts_of(file: str) -> tuple[str, ...]:
    """Return the names on the way to a file. Raises NotRepairable for a path that could lead out of the folder."""
    parts = tuple(file.split("/"))
    if not file or "\0" in file or {"", ".", ".."} & set(parts):
        raise NotRepairable(f"{file} is not a path inside the package")
    return parts


@dataclass(kw_only=True)
class Files:
    """The texts of a package's files with the repairs so far made in them. Nothing is written. A file that was renamed
    is known by its old path too."""

    folder: Path
    repairs: list[Repair] = field(default_factory=list)
    _texts: dict[str, str | None] = field(default_factory=dict)
    _renamed: dict[str, str] = field(default_factory=dict)

    def text(self, file: str) -> str | None:
        """Return the file's text, line ends as on Linux; None where it is not text that can be repaired."""
        file = self._renamed.get(file, file)
        if file not in self._texts:
            data = read_data(self.folder, file)
            self._texts[file] = None if data is None else as_text(data)
        return self._texts[file]

    def put(self, file: str, text: str | None) -> None:
        """Remember what the file will be."""
        self._texts[self._renamed.get(file, file)] = text

    def path_of(self, file: str) -> str:
        """Return where a file of the package is after the repairs so far."""
        return self._renamed.get(file, file)

    def rename(self, old: str, new: str) -> None:
        """Remember that the file will be at another path."""
        self._texts[new] = self.text(old)
        self._renamed[old] = new

    def add(self, repair: Repair) -> None:
        """Remember a repair that changes no line of a text."""
        self.repairs.append(repair)

    def change(
        self,
        kind: RepairKind,
        file: str,
        after: str,
        message: str,
        fix: str = "",
        *,
        asks_input: bool = False,
    ) -> None:
        """Remember that the file's text becomes `after`. Without a `fix`, the changed lines say it.

        What changes the line again that the last repair changed, and is of its kind, is one repair with that.
        """
        file = self._renamed.get(file, file)
        before = self.text(file)
        if before is None or before == after or not _is_unicode(before + after):
            return
        line, old, new = changed_lines(before, after)
        self._texts[file] = after
        words = {"message": message, "fix": fix or added_lines(old, new)}
        made = Repair(kind=kind, file=file, line=line, before=old, after=new, asks_input=asks_input, **words)
        last = self.repairs[-1] if self.repairs else None
        if last is not None and (last.kind, last.file, last.line, last.after) == (kind, file, line, old):
            made = made.model_copy(
                update={
                    "before": last.before,
                    "message": "; ".join(messages_of([last, made])),
                    "fix": added_lines(last.before, new),
                    "asks_input": asks_input or last.asks_input,
                }
            )
            self.repairs.pop()
        self.repairs.append(made)


BLANKS_ABOVE = "delete the blank lines above the first tag"
KEEP_ONE = "keep one of the two versions; for the first one, delete {emptied}"
KEEP_LAST = (
    "keep one of the two versions; for the second one, which has the names of this lab, delete {emptied}"
)


def keep_first_version(files: Files, file: str, kind: RepairKind) -> bool:
    """Of git's merge markers and the versions between them, keep the first one; return whether there are any."""
    text = files.text(file) or ""
    kept: str = first_version(text)
    if kept != text:
        line, _, _ = changed_lines(text, kept)
        fix = KEEP_ONE.format(emptied=emptied_lines(text, kept))
        # nothing may stand above an XML declaration
        files.change(kind, file, kept.lstrip("\n"), f"line {line} of {file}: {MERGED}", fix)
    return kept != text


def keep_last_version(files: Files, file: str, names: Collection[str]) -> None:
    """Of git's merge markers in a script and the versions between them, keep the last one where more of the `names` are
    in it, in quotes, than in the first one."""
    text = files.text(file) or ""
    first, last = first_version(text), last_version(text)
    quoted = [re.compile(rf"([\"'])/?{re.escape(name.strip('/'))}\1") for name in names]
    counts = [sum(one.search(version) is not None for one in quoted) for version in (first, last)]
    if first != text and counts[1] > counts[0]:
        line, _, _ = changed_lines(text, last)
        fix = KEEP_LAST.format(emptied=emptied_lines(text, last))
        files.change("python-syntax", file, last, f"line {line} of {file}: {MERGED}", fix)


def emptied_lines(before: str, after: str) -> str:
    """Return `lines 3 and 5 to 8`, of lines that have nothing in them any more."""
    pairs = enumerate(zip(before.split("\n"), after.split("\n"), strict=False), start=1)
    numbers = [number for number, (old, new) in pairs if old and not new]
    return f"{'line' if len(numbers) == 1 else 'lines'} {numbers_text(numbers)}"


def repair_xml(files: Files, file: str, root: str, kind: RepairKind) -> bool:
    """Find the edits that make a file well-formed, where such plain ones do; return whether there are any."""
    text = files.text(file)
    for after in well_formed(text, file, root=root) if text is not None else ():
        before = files.text(file) or ""
        _, fault = parse_xml(before.encode(), file, root=root)
        strange = find_strange(before, root) if fault is None else None
        line, old, new = changed_lines(before, after)
        why = fault.explanation if fault is not None else strange.why if strange is not None else ""
        taken = " ".join(one.strip() for one in old.split("\n") if one not in new.split("\n")).strip()
        written = lines_to_write(line, old, new)
        fix = f"write {written}" if written else f"delete `{taken}`" if taken else BLANKS_ABOVE
        if fault is not None and re.match(r"(delete|write|make) line \d", fault.fix):
            fix = fault.fix
        place = f"line {fault.line if fault is not None and fault.line else line} of {file}"
        files.change(kind, file, after, f"{place}: {why}", fix)
    return text is not None and files.text(file) != text


def _is_unicode(text: str) -> bool:
    return not any("\ud800" <= char <= "\udfff" for char in text)


def as_text(data: bytes) -> str | None:
    """Return the bytes as text, without a mark and with Linux's line ends; None for what is no UTF-8."""
    try:
        text = data.removeprefix(BOM).decode("utf-8")
    except UnicodeDecodeError:
        return None
    text = text.replace("\r\n", "\n")
    return None if "\0" in text or "\r" in text else text


def changed_lines(before: str, after: str) -> tuple[int, str, str]:
    """Return the first line that differs (from 1), and the lines that do, before and after.

    Where lines are only added or only left out, one that stays is part of both.
    """
    old, new = before.split("\n"), after.split("\n")
    shorter = min(len(old), len(new))
    start = next((i for i in range(shorter) if old[i] != new[i]), shorter)
    end = next((i for i in range(shorter - start) if old[-1 - i] != new[-1 - i]), shorter - start)
    if end in (len(old) - start, len(new) - start):
        start, end = (start - 1, end) if start else (start, end - 1)
    if 0 < start == len(old) - 1 and old[-1] == new[-1] == "" and not end:
        start, end = start - 1, 1  # behind the last line end is not a line
    first, last = old[start : len(old) - end], new[start : len(new) - end]
    return start + 1, "\n".join(first), "\n".join(last)


# ---- on the disk


def replace_lines(data: bytes, repair: Repair) -> bytes:
    """Return a file's bytes with the repair's lines in them; a mark and the line ends stay. Raises NotRepairable."""
    text = as_text(data)
    if text is None or repair.line is None:
        raise NotRepairable(f"{repair.file} is not text any more")
    lines, old = text.split("\n"), repair.before.split("\n")
    places = [i for i in range(len(lines) - len(old) + 1) if lines[i : i + len(old)] == old]
    if not places:
        raise NotRepairable(f"{repair.file} has changed: line {repair.line} is not as it was")
    at = min(places, key=lambda place: abs(place + 1 - (repair.line or 0)))
    lines[at : at + len(old)] = repair.after.split("\n")
    ends = b"\r\n" if b"\r\n" in data else b"\n"
    mark = BOM if data.startswith(BOM) else b""
    return mark + "\n".join(lines).encode().replace(b"\n", ends)


def rename_word(text: str, old: str, new: str) -> str:
    """Return the text with a file's or package's name replaced, where it stands as a whole word."""
    return re.sub(rf"(?<![\w.-]){re.escape(old)}(?![\w-]|\.\w)", lambda _: new, text)


def rename_type(text: str, old: str, new: str) -> str:
    """Return the code with the file's own name (`Two.srv`) and what is made of it replaced: `Two`, `TwoRequest`;
    as it is where ROS's own type has that name in it."""
    (before, kind), after = (PurePosixPath(old).stem, PurePosixPath(old).suffix), PurePosixPath(new).stem
    if kind not in MADE_OF or re.search(rf"{OF_ROS}{re.escape(before)}\b", text):
        return text
    made = rf"(?<![\w.\"'])((?:\w+\.)*(?:srv|msg)\.)?{re.escape(before)}(?=(?:{MADE_OF[kind]})?(?:Const)?(?:Ptr)?\b)"
    return re.sub(made, lambda found: f"{found[1] or ''}{after}", text)


def naming_files(folder: Path, endings: tuple[str, ...] = NAMING) -> Iterator[str]:
    """Yield the files that name the package and its scripts: the manifest, CMake's file and launch files."""
    for place, folders, names in os.walk(folder):
        folders[:] = sorted(name for name in folders if name not in LEFT_OUT)
        for name in sorted(names):
            if (name in (MANIFEST, CMAKE) and endings == NAMING) or name.lower().endswith(endings):
                yield (Path(place) / name).relative_to(folder).as_posix()


@contextmanager
def _opened_parent(folder: Path, file: str) -> Iterator[tuple[int, str]]:
    """Open the folder that the file lies in, following no link below the package's own folder."""
    *above, name = parts_of(file)
    descriptor = os.open(folder, READ | DIRECTORY)
    try:
        for part in above:
            inner = os.open(part, READ | NOFOLLOW | DIRECTORY, dir_fd=descriptor)
            os.close(descriptor)
            descriptor = inner
        yield descriptor, name
    finally:
        os.close(descriptor)


def write_data(folder: Path, file: str, data: bytes, *, mode: int | None = None) -> None:
    """Replace a file whole, its mode kept unless another is given. Raises OSError or NotRepairable."""
    if not HAS_DIR_FD:
        atomic_write(_without_links(folder, file), data, public=True)
        return
    with _opened_parent(folder, file) as (parent, name):
        was = os.stat(name, dir_fd=parent, follow_symlinks=False)
        if not stat.S_ISREG(was.st_mode):
            raise NotRepairable(f"{file} is not a regular file")
        beside = f".{secrets.token_hex(8)}"
        flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | CLOEXEC | NOFOLLOW | BINARY
        try:
            with os.fdopen(os.open(beside, flags, 0o600, dir_fd=parent), "wb") as stream:
                stream.write(data)
                stream.flush()
                _set_mode(stream, stat.S_IMODE(was.st_mode) if mode is None else mode)
                os.fsync(stream.fileno())
            os.rename(beside, name, src_dir_fd=parent, dst_dir_fd=parent)
        except BaseException:
            with suppress(OSError):
                os.unlink(beside, dir_fd=parent)
            raise


def is_executable(folder: Path, file: str) -> bool:
    """Return whether its owner may execute the file on this disk, whatever git has of it."""
    try:
        with _open(folder, file) as stream:
            return bool(os.fstat(stream.fileno()).st_mode & stat.S_IXUSR)
    except (OSError, ValueError):
        return False


def make_executable(folder: Path, file: str) -> None:
    """Set the executable bits of those who may read it. Raises OSError or NotRepairable.

    A file that has another name elsewhere gets a copy: its bits would change there too.
    """
    with _open(folder, file) as stream:
        was = os.fstat(stream.fileno())
        mode = stat.S_IMODE(was.st_mode)
        mode |= (mode & 0o444) >> 2
        if was.st_nlink == 1:
            _set_mode(stream, mode)
            return
    data = read_data(folder, file)
    if data is None:
        raise NotRepairable(f"{file} is too large to be copied")
    write_data(folder, file, data, mode=mode)


def rename_file(folder: Path, repair: Repair) -> None:
    """Give a file its name, and write this name where the build files and launch files have the old one."""
    old, new = repair.before, repair.after
    if PurePosixPath(old).parent != PurePosixPath(new).parent:
        raise NotRepairable(f"{new} is in another folder")
    if HAS_DIR_FD:
        _rename(folder, old, new)
    else:
        _without_links(folder, old).rename(_without_links(folder, new))  # refused where there is one already
    rename_everywhere(folder, PurePosixPath(old).name, PurePosixPath(new).name)


def _rename(folder: Path, old: str, new: str) -> None:
    with _opened_parent(folder, old) as (parent, name):
        target = parts_of(new)[-1]
        if not stat.S_ISREG(os.stat(name, dir_fd=parent, follow_symlinks=False).st_mode):
            raise NotRepairable(f"{old} is not a regular file")
        with suppress(FileNotFoundError):
            found = os.stat(target, dir_fd=parent, follow_symlinks=False)
            if not os.path.samestat(found, os.stat(name, dir_fd=parent, follow_symlinks=False)):
                raise NotRepairable(f"there is a {new} already")
        os.rename(name, target, src_dir_fd=parent, dst_dir_fd=parent)


def exchange_contents(folder: Path, one: str, other: str) -> None:
    """Give each of two files what the other one holds. Raises OSError or NotRepairable."""
    data = [read_data(folder, file) for file in (one, other)]
    for file, content in zip((other, one), data, strict=True):
        if content is None:
            raise NotRepairable(f"{one} and {other} are not files that can be exchanged")
        write_data(folder, file, content)


def rename_everywhere(folder: Path, old: str, new: str) -> None:
    """Write the new name where the build files and launch files have the old one, and the code a definition's."""
    for endings, rename in ((NAMING, rename_word), (CODE, rename_type)):
        for file in naming_files(folder, endings):
            data = read_data(folder, file)
            text = as_text(data) if data is not None else None
            if data is None or text is None or (changed := rename(text, old, new)) == text:
                continue
            line, before, after = changed_lines(text, changed)
            whole = Repair(
                kind="file-name", file=file, line=line, before=before, after=after, message="", fix=""
            )
            write_data(folder, file, replace_lines(data, whole))
