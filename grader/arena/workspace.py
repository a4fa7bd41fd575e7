"""Fresh workspaces on disk: one as handed in, to build; one source tree with the repairs, to run.

In a sandbox both are only read: what is built there comes back as an archive. Without one, student code writes into
the first, and the grader never follows what it finds there. Both hold the lab's package and those packages of the
same submission that it depends on, nothing else. What a build left is read here too, and nothing of it unpacked.
"""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import stat
import tarfile
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import suppress
from itertools import islice
from pathlib import Path, PurePosixPath
from types import MappingProxyType

from pydantic import Field

from grader.arena.sandbox import Sandbox
from grader.arena.sandbox_files import BROWSERS, LARGE, SHIMS
from grader.files import open_untrusted
from grader.model.package import PackageFacts, SourceFile
from grader.model.record import Record
from grader.model.submission import SourcePackage, Submission
from grader.package.cmake_parse import commands_of
from grader.package.manifest import read_manifest
from grader.package.reading import printable, read_markup
from grader.package.repairs.files import to_utf8

CATKIN_IGNORE = "CATKIN_IGNORE"
# Left by earlier builds and by git: a fresh workspace is to be without them.
IGNORED = {".git", "build", "devel", "install", "__pycache__"}
SHEBANG = b"#!/usr/bin/env python3\n"
ABSOLUTE_PYTHON = re.compile(r"/(\w+/)*python3?")
BROWSER_PATH = re.compile(
    rb"(?<![\w./-])/(?:usr/|usr/local/|snap/)?bin/(" + "|".join(BROWSERS).encode() + rb")(?![\w./-])"
)
LARGE_BYTES = 4 << 20
MANIFEST = """<package format="2"><name>{}</name><version>0.0.0</version><description>A repair</description>
<maintainer email="student@example.org">student</maintainer><license>TODO</license>
<buildtool_depend>catkin</buildtool_depend></package>
"""
LAUNCH_SUFFIXES = {".launch", ".test", ".xml"}
FILES_MAX, BYTES_MAX = 100, 100_000
IN_LAUNCH_FILES = re.compile(r"\$\(find\s+([\w.-]+)\s*\)|\bpkg\s*=\s*[\"']([\w.-]+)[\"']")
IN_SCRIPTS = re.compile(r"^[ \t]*(?:from|import)[ \t]+(\w+)\.(?:msg|srv)\b", re.MULTILINE)
ELF = b"\x7fELF"
MEMBERS_MAX = 50_000
_TOO_MANY = f"what the build left is more than {MEMBERS_MAX} files"
HEADER_BYTES_MAX, HEADERS_BYTES_MAX = 64 << 10, 4 << 20
"""Of one header that goes before a file's own (a long name, say), and of all of them together."""
HEADERS_IN_A_ROW_MAX = 4
_DAMAGED = (OSError, tarfile.TarError, ValueError, OverflowError)
_PAX = (tarfile.XHDTYPE, tarfile.XGLTYPE, tarfile.SOLARIS_XHDTYPE)
_BEFORE_A_FILE = (*_PAX, tarfile.GNUTYPE_LONGNAME, tarfile.GNUTYPE_LONGLINK)
_ODD = re.compile(rb"[0-9]{21}|GNU\.sparse")
"""Digits that would keep tarfile's own patterns busy, and files that are made larger than they are."""


class Workspace(Record):
    """`built` is the catkin workspace to build (`src/` in it), `repaired` the `src/` that runs; `folder` is the
    package's folder name in both, `name` what ROS calls it, `repairs` what was fixed, by path. `others` are the same
    for the lab's other packages, by the lab's names for them. `kept` is for what the build hands over. Files
    of more than 4 MB are not copied into each run: they lie in `large`, and links lead there; `copied_bytes` is the
    rest."""

    built: Path
    repaired: Path
    large: Path
    kept: Path
    folder: str
    name: str = ""
    repairs: dict[str, tuple[str, ...]]
    others: dict[str, Workspace] = Field(default={})
    copied_bytes: int = 0


def make_workspace(
    place: Path,
    submission: Submission,
    facts: PackageFacts,
    scripts: Iterable[str],
    sandbox: Sandbox,
    *,
    course: Collection[str] = (),
    scripts_of: Mapping[str, Iterable[str]] = MappingProxyType({}),
) -> Workspace:
    """Copy the packages twice below `place`; `scripts` are the paths that get their repairs in the second copy,
    `scripts_of` those of the lab's other packages. A copy of a package of the `course` is left out: the course's own
    counts."""
    workspace = Workspace(
        built=place / "ws",
        repaired=place / "run" / "src",
        large=place / "run" / "large",
        kept=place / "kept",
        folder=_folder_name(submission.package),
        name=(facts.manifest or submission.package).name,
        repairs={},
    )
    workspace.kept.mkdir()
    copier = _Copier(workspace.large, Path(LARGE) if sandbox.bubblewrap else workspace.large)
    for package in needed_packages(submission, course):
        for source_tree in (workspace.built / "src", workspace.repaired):
            copier.copy(package, source_tree / _folder_name(package))
    shims = SHIMS if sandbox.bubblewrap else str(place / "bin")
    workspace = workspace.model_copy(update={"copied_bytes": copier.copied_bytes})
    workspace = _with_repairs(workspace, facts, scripts, shims)
    others = {
        source.asked: _with_repairs(
            workspace.model_copy(
                update={"folder": _folder_name(source), "name": (other.manifest or source).name}
            ),
            other,
            scripts_of.get(source.asked, ()),
            shims,
        )
        for source, other in zip(submission.also, facts.also, strict=True)
    }
    if not sandbox.bubblewrap:
        for path in (workspace.built, place / "home"):
            give_to(path, sandbox.uid)
    return workspace.model_copy(update={"others": others})


def _with_repairs(workspace: Workspace, facts: PackageFacts, scripts: Iterable[str], shims: str) -> Workspace:
    """Repair the copy of a package that runs, and return its workspace with what was repaired."""
    package_copy = workspace.repaired / workspace.folder
    repairs = {path: tuple(_repair(package_copy / path, facts.file(path))) for path in scripts}
    for file in facts.files:
        _give_python(package_copy / file.path, file, shims)
        _give_browsers(package_copy / file.path, file)
    if facts.file(CATKIN_IGNORE) is not None and not (package_copy / CATKIN_IGNORE).is_dir():
        (package_copy / CATKIN_IGNORE).unlink(missing_ok=True)  # the build alone is lost by it
    if facts.manifest is None:
        _replace_manifest(package_copy / "package.xml", workspace.folder)
    return workspace.model_copy(update={"repairs": repairs})


def run_in_place(workspace: Workspace, sandbox: Sandbox) -> None:
    """Replace the built sources by the repaired ones: without a sandbox, processes see one workspace only."""
    sources = workspace.built / "src"
    shutil.rmtree(sources)
    shutil.copytree(workspace.repaired, sources, symlinks=True)
    give_to(sources, sandbox.uid)


def needed_packages(submission: Submission, course: Collection[str] = ()) -> list[SourcePackage]:
    """Return the lab's packages and those of the submission that they need, the lab's first; none of the `course`'s.
    They need what their manifests declare, and of what catkin sees in the same workspace, what their launch files and
    CMakeLists.txt name and of which their scripts import messages."""
    needed = [submission.package, *submission.also]
    others = {
        p.name: p for p in submission.packages if p.name not in {*(one.name for one in needed), *course}
    }
    for package in needed if others else ():
        manifest, _ = read_manifest(package.folder)
        names = {one.name for one in manifest.dependencies} if manifest else set()
        names |= {
            name for name in _named_packages(package) if name in others and _is_beside(others[name], package)
        }
        needed.extend(others.pop(name) for name in sorted(names & others.keys()))
    return needed


def _named_packages(package: SourcePackage) -> set[str]:
    """Return the words of launch files, scripts and `CMakeLists.txt` that may name packages."""
    names: set[str] = set()
    found = (path for path in package.folder.rglob("*") if path.suffix in {".py", *LAUNCH_SUFFIXES})
    for path in sorted(islice(found, FILES_MAX)):
        data = read_markup(package.folder, path.relative_to(package.folder).as_posix(), BYTES_MAX)
        text = data.decode("utf-8", "replace") if isinstance(data, bytes) else ""
        if path.suffix == ".py":
            names.update(IN_SCRIPTS.findall(text))
            continue
        begin, *rest = text.split("<!--")
        text = "".join([begin, *(part.partition("-->")[2] for part in rest)])
        names |= {one for pair in IN_LAUNCH_FILES.findall(text) for one in pair if one}
    data = read_markup(package.folder, "CMakeLists.txt", BYTES_MAX)
    for command in (commands_of(data) or ()) if isinstance(data, bytes) else ():
        if command.identifier.lower() == "find_package":
            names |= {str(token.value) for token in command.args if token.kind != "COMMENT"}
    return names


def _is_beside(other: SourcePackage, package: SourcePackage) -> bool:
    """Return whether catkin sees both in one workspace: below the same `src`, or else the same folder."""
    above = PurePosixPath(package.path).parent
    source = next((one for one in (above, *above.parents) if one.name == "src"), above)
    return source in PurePosixPath(other.path).parents


def _folder_name(package: SourcePackage) -> str:
    """Return the package's name where it can be a folder: spaces and accents of the student's path are left out."""
    name = "".join(c if c.isascii() and (c.isalnum() or c in "_-") else "_" for c in package.name)
    return name or "package"


class _Copier:
    """Copies packages' trees, links as links, with the modes that their source gives."""

    def __init__(self, large: Path, large_inside: Path) -> None:
        self._large = large
        self._large_inside = large_inside
        self.copied_bytes = 0
        large.mkdir(parents=True)

    def copy(self, package: SourcePackage, target: Path) -> None:
        for folder, folders, files in os.walk(package.folder):
            top = Path(folder) == package.folder
            folders[:] = [f for f in folders if f not in IGNORED or (not top and f != ".git")]
            here = target / Path(folder).relative_to(package.folder)
            here.mkdir(parents=True, exist_ok=True)
            for name in [*files, *(f for f in folders if (Path(folder) / f).is_symlink())]:
                self._copy_entry(Path(folder) / name, here / name, package)

    def _copy_entry(self, source: Path, target: Path, package: SourcePackage) -> None:
        if printable(source.relative_to(package.folder).as_posix()) in package.left_out:
            return
        if source.is_symlink():
            target.symlink_to(source.readlink())
        elif not source.is_file():
            return
        elif source.stat().st_size > LARGE_BYTES:
            name = hashlib.sha256(os.fsencode(source)).hexdigest()
            if not (self._large / name).exists():
                shutil.copyfile(source, self._large / name)
            target.symlink_to(self._large_inside / name)
        else:
            shutil.copyfile(source, target)
            self.copied_bytes += target.stat().st_size
            executable = package.executable.get(source.relative_to(package.folder).as_posix())
            if executable is None:
                # A zip without modes says nothing against a script: it counts as executable.
                executable = package.mode_source == "none" and _starts_as_script(source)
            target.chmod(0o755 if executable else 0o644)


def _starts_as_script(path: Path) -> bool:
    with path.open("rb") as file:
        return file.read(2) == b"#!"


def _repair(path: Path, facts: SourceFile | None) -> Iterator[str]:
    """Fix what keeps `rosrun` from running a script, and name each thing that was fixed."""
    if facts is None or path.is_symlink() or not path.is_file():
        return
    if facts.executable is False:
        yield "executable bit"
    path.chmod(0o755)
    shebang, data = facts.shebang, path.read_bytes()
    if facts.in_other_encoding and not facts.binary:
        yield "encoding"
        data = to_utf8(data)
        path.write_bytes(data)
    usable = shebang is not None and shebang.found is not False and not facts.names_other_language
    if shebang is not None and not shebang.crlf and usable:
        return
    # Before `#!`, the kernel takes a byte order mark for part of a file that is no script.
    text = data.removeprefix(b"\xef\xbb\xbf")
    if shebang is not None:
        yield "line ending of the shebang" if shebang.crlf else f"shebang ({shebang.text})"
        text = text.partition(b"\n")[2]
    else:
        yield "shebang (none)"  # all of its lines move down by one: `exit_causes` counts on that
    path.write_bytes(SHEBANG + text.replace(b"\r\n", b"\n"))


def _replace_manifest(path: Path, name: str) -> None:
    """Replace a manifest that rospy cannot read: a node reads the one above its script, and would end."""
    if not path.is_dir():
        path.unlink(missing_ok=True)
        path.write_text(MANIFEST.format(name))


def _give_python(path: Path, facts: SourceFile, shims: str) -> None:
    """Name the arena's own Python in place of `/usr/bin/python`, where this machine has none there."""
    words = facts.shebang.text.split() if facts.shebang else []
    if not words or not ABSOLUTE_PYTHON.fullmatch(words[0]) or Path(words[0]).exists() or path.is_symlink():
        return
    data = path.read_bytes()
    first, newline, rest = data.partition(b"\n")
    if first.startswith(b"#!"):
        words[0] = f"{shims}/{Path(words[0]).name}"
        path.write_bytes(f"#!{' '.join(words)}".encode() + newline + rest)


def _give_browsers(path: Path, facts: SourceFile) -> None:
    """Name a browser by its name alone in place of its path, so that the stand-in is found."""
    if facts.binary or path.is_symlink() or not path.is_file() or not (facts.shebang or path.suffix == ".sh"):
        return
    data = path.read_bytes()
    named = BROWSER_PATH.sub(rb"\1", data)
    if named != data:
        path.write_bytes(named)


def give_to(path: Path, uid: int | None) -> None:
    """Give the tree to a user who builds in it, before anything of the student's runs. None is the grader's own."""
    if uid is None:
        return
    os.chown(path, uid, uid)
    for folder, folders, files in os.walk(path):
        for name in (*folders, *files):
            os.chown(Path(folder) / name, uid, uid, follow_symlinks=False)


class Built(Record):
    """Names of what `rosrun` finds among what was built: all that is executable, and what a compiler made.

    `too_much`: what it had too much of, in words, so that not all of it was looked at; else "".
    """

    programs: frozenset[str] = frozenset()
    compiled: frozenset[str] = frozenset()
    too_much: str = ""


def read_archive(archive: Path, package: str) -> Built:
    """Return what a build in a sandbox handed over as an archive; one that cannot be read holds nothing."""
    folder = f"devel/lib/{package}/"
    programs, compiled = set(), set()
    said: list[str] = []
    for tar, member in _members(archive, said.append):
        name = member.name.removeprefix(folder)
        if name == member.name or "/" in name or not member.isreg() or not member.mode & stat.S_IXUSR:
            continue
        programs.add(name)
        if _content(tar, member, len(ELF)) == ELF:
            compiled.add(name)
    return Built(programs=frozenset(programs), compiled=frozenset(compiled), too_much="".join(said))


def read_folder(devel: Path, package: str) -> Built:
    """Return what is in the folder `devel` itself, where there was no sandbox."""
    folder = devel / "lib" / package
    # The build could have put a link in its place, to a folder of the machine's.
    if any(path.is_symlink() for path in (devel, folder.parent, folder)) or not folder.is_dir():
        return Built()
    paths = list(islice(folder.iterdir(), MEMBERS_MAX + 1))
    heads = {path.name: _head(path) for path in paths[:MEMBERS_MAX]}
    return Built(
        programs=frozenset(name for name, head in heads.items() if head is not None),
        compiled=frozenset(name for name, head in heads.items() if head == ELF),
        too_much=_TOO_MANY if len(paths) > MEMBERS_MAX else "",
    )


def read_member(archive: Path, name: str, limit_bytes: int) -> bytes | None:
    """Return the content of one regular file of the archive, cut at the limit, or None."""
    for tar, member in _members(archive):
        if member.name == name and member.isreg():
            return _content(tar, member, limit_bytes)
    return None


def _content(tar: tarfile.TarFile, member: tarfile.TarInfo, limit_bytes: int) -> bytes | None:
    """Return a member's bytes, cut at the limit; None where the archive ends before they do."""
    try:
        content = tar.extractfile(member)
        return None if content is None else content.read(limit_bytes)
    except _DAMAGED:
        return None


def _members(
    archive: Path, tell: Callable[[str], None] = lambda _: None
) -> Iterator[tuple[tarfile.TarFile, tarfile.TarInfo]]:
    """Yield the entries of an archive, as far as it is whole and of reasonable length; `tell` gets, in words, what is
    not of reasonable length."""
    try:
        with tarfile.open(archive, "r:", tarinfo=_Member) as tar:
            for number, member in enumerate(tar):
                if number >= MEMBERS_MAX:
                    tell(_TOO_MANY)
                    return
                yield tar, member
                tar.members = []  # type: ignore[attr-defined] # no one looks back
    except _TooMuchError as error:
        tell(str(error))
    except _DAMAGED:
        return


class _TooMuchError(Exception):
    """What of an archive is too much, in words. No TarError: those, tarfile takes for the archive's end."""


class _Member(tarfile.TarInfo):
    """A header, looked at before `tarfile` believes it: it reads some into memory as a whole, one inside the other."""

    def _proc_member(self, archive: tarfile.TarFile) -> tarfile.TarInfo:
        before = self.type in _BEFORE_A_FILE
        bytes_before, in_a_row = getattr(archive, "headers", (0, 0))
        bytes_before, in_a_row = (bytes_before + self.size, in_a_row + 1) if before else (bytes_before, 0)
        archive.headers = bytes_before, in_a_row  # type: ignore[attr-defined] # counted where it is read
        if self.size < 0 or self.type == tarfile.GNUTYPE_SPARSE:
            raise _TooMuchError("what the build left holds files of a size that they do not have")
        if before and (
            self.size > HEADER_BYTES_MAX
            or bytes_before > HEADERS_BYTES_MAX
            or in_a_row > HEADERS_IN_A_ROW_MAX
        ):
            raise _TooMuchError("what the build left holds names that are far too long, or too many of them")
        if self.type in _PAX and _ODD.search(_ahead(archive, self.size)):
            raise _TooMuchError("what the build left holds headers that no tar writes")
        return super()._proc_member(archive)  # type: ignore[misc,no-any-return] # a hook that tarfile's source names


def _ahead(archive: tarfile.TarFile, size: int) -> bytes:
    """Return the bytes that come next, without taking them."""
    stream = archive.fileobj
    assert stream is not None  # noqa: S101 - it was opened with one
    data = stream.read(size)
    stream.seek(stream.tell() - len(data))
    return data


def _head(path: Path) -> bytes | None:
    """Return the first bytes of an executable file, None for anything else."""
    with suppress(OSError), open_untrusted(path) as file:
        return file.read(len(ELF)) if os.fstat(file.fileno()).st_mode & stat.S_IXUSR else None
    return None
