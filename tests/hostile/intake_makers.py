"""Archives and repositories that no tool would make: for makers.py, in the same form."""

from __future__ import annotations

import gzip
import io
import os
import shutil
import struct
import subprocess
import tarfile
import zipfile
import zlib
from hashlib import sha1
from pathlib import Path

BLOCK = 512


def long_header(folder: Path, *, kind: str, size_mb: int) -> Path:
    """A header that says it is as long as that, packed to nothing: `x` and `g` (PAX), `L` and `K` (long names)."""
    info = tarfile.TarInfo("x")
    info.type, info.size = kind.encode(), size_mb << 20
    piece = gzip.compress(bytes(1 << 20))
    return _packed(folder, gzip.compress(info.tobuf()) + piece * size_mb + gzip.compress(_tar(folder)))


def busy_header(folder: Path) -> Path:
    """Records of an extended header that overlap, then an empty one, which no Python takes, and digits that a pattern
    tries from every place."""
    record = b"5 aaa" * 6_000 + b"0 a=" + b"1" * 30_000 + b"=\n"
    info = tarfile.TarInfo("x")
    info.type, info.size = tarfile.XHDTYPE, len(record)
    return _packed(folder, gzip.compress(info.tobuf() + record + bytes(-len(record) % BLOCK) + _tar(folder)))


def sparse(folder: Path, *, size_gb: int) -> Path:
    """A file of that size without a block on the disk, packed by GNU tar as such."""
    os.truncate(_touched(folder / "lab" / "data.bin"), size_gb << 30)
    path = folder.with_suffix(".tar")
    subprocess.run(["tar", "-Scf", path, "-C", folder, "lab"], check=True)  # noqa: S607 - the machine's tar
    return path


def hard_links(folder: Path, *, size_mb: int, count: int) -> Path:
    """One file under many names."""
    path = folder.with_suffix(".tar.gz")
    with tarfile.open(path, "w:gz") as archive:
        archive.add(folder / "lab", "lab")
        info = tarfile.TarInfo("lab/first")
        info.size = size_mb << 20
        archive.addfile(info, io.BytesIO(bytes(info.size)))
        for number in range(count):
            link = tarfile.TarInfo(f"lab/copy{number}")
            link.type, link.linkname = tarfile.LNKTYPE, "lab/first"
            archive.addfile(link)
    return path


def empty_entries(folder: Path, *, count: int) -> Path:
    """Very many files with nothing in them."""
    entries = b"".join(tarfile.TarInfo(f"lab/src/{number:03}").tobuf() for number in range(1000))
    plain = _tar(folder).rstrip(b"\0")
    plain += bytes(-len(plain) % BLOCK)
    return _packed(folder, gzip.compress(plain) + gzip.compress(entries) * (count // 1000))


def link_chain(folder: Path, *, count: int) -> Path:
    """Links that lead to each other, one after the other."""
    path = folder.with_suffix(".tar.gz")
    with tarfile.open(path, "w:gz") as archive:
        archive.add(folder / "lab", "lab")
        for number in range(count):
            link = tarfile.TarInfo(f"lab/link{number}")
            link.type, link.linkname = tarfile.SYMTYPE, f"link{number + 1}"
            archive.addfile(link)
    return path


def bzip2_zip(folder: Path, *, size_mb: int) -> Path:
    """A kilobyte that is unpacked at once to all of its size."""
    path = _zip(folder)
    with (
        zipfile.ZipFile(path, "a", zipfile.ZIP_BZIP2) as archive,
        archive.open("lab/zeros", "w", force_zip64=True) as file,
    ):
        for _ in range(size_mb):
            file.write(bytes(1 << 20))
    data = bytearray(path.read_bytes())
    struct.pack_into("<L", data, data.rfind(b"PK\x01\x02") + 24, 1 << 20)
    path.write_bytes(data)
    return path


def long_list_zip(folder: Path, *, count: int) -> Path:
    """A list of contents that names one entry over and over."""
    local = struct.pack("<4s5H3L2H", b"PK\3\4", 20, 0, 0, 0, 0, 0, 0, 0, 1, 0) + b"a"
    about = (b"PK\1\2", 20, 3, 20, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0)
    listed = (struct.pack("<4s4B4HL2L5H2L", *about) + b"a") * count
    end = struct.pack("<4s4H2LH", b"PK\5\6", 0, 0, 0xFFFE, 0xFFFE, len(listed), len(local), 0)
    path = folder.with_suffix(".zip")
    path.write_bytes(local + listed + end)
    return path


def shared_content_zip(folder: Path, *, count: int) -> Path:
    """Entries that lie in each other, each of them ten megabytes."""
    path = _zip(folder)
    with zipfile.ZipFile(path, "a", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("lab/zeros", bytes(10 << 20))
        archive.filelist += [archive.getinfo("lab/zeros")] * count
    return path


def giant_zip(folder: Path, *, size_mb: int) -> Path:
    """The package, and beside it something very large that packs well."""
    path = _zip(folder)
    with (
        zipfile.ZipFile(path, "a", zipfile.ZIP_DEFLATED, compresslevel=1) as archive,
        archive.open("recording.bin", "w", force_zip64=True) as file,
    ):
        for _ in range(size_mb):
            file.write(bytes(1 << 20))
    return path


def terabyte(folder: Path) -> Path:
    """An archive of a terabyte, of which hardly anything is on the disk."""
    path = folder.with_suffix(".tar")
    path.write_bytes(_tar(folder))
    os.truncate(path, 1 << 40)
    return path


def pipe_as_manifest(folder: Path) -> Path:
    """A neighbour whose manifest is a pipe, and one whose manifest is a terabyte."""
    for name in ("first", "second"):
        (folder / name).mkdir()
    os.mkfifo(folder / "first" / "package.xml")
    os.truncate(_touched(folder / "second" / "package.xml"), 1 << 40)
    return folder


def odd_tree(folder: Path, *, name: str) -> Path:
    """A repository whose commit holds an entry of that name, as git itself would never write it."""
    commands = (("init", "-q", "--initial-branch=main"), ("add", "."), ("commit", "-q", "-m", "first"))
    for words in commands:
        _git(folder, *words)
    entries = _git(folder, "cat-file", "tree", "HEAD^{tree}")
    target = bytes.fromhex(_git(folder, "rev-parse", "HEAD^{tree}").decode())
    content = b"40000 %s\0%s" % (name.encode(), target) + entries
    data = b"tree %d\0%s" % (len(content), content)
    digest = sha1(data).hexdigest()  # noqa: S324 - git's own
    place = folder / ".git" / "objects" / digest[:2] / digest[2:]
    place.parent.mkdir(exist_ok=True)
    place.write_bytes(zlib.compress(data))
    commit = _git(folder, "commit-tree", digest, "-m", "odd").decode()
    (folder / ".git" / "refs" / "heads" / "main").write_text(commit, encoding="ascii")
    return folder


def borrowed_objects(folder: Path, *, path: str) -> Path:
    """A repository whose objects are all another one's, by `alternates`."""
    _git(folder, "init", "-q", "--initial-branch=main")
    _git(folder, "add", ".")
    _git(folder, "commit", "-q", "-m", "first")
    info = folder / ".git" / "objects" / "info"
    info.mkdir(exist_ok=True)
    (info / "alternates").write_text(f"{path}\n", encoding="utf-8")
    return folder


def _git(folder: Path, *words: str) -> bytes:
    who = ("-c", "user.name=A student", "-c", "user.email=student@example.org")
    git = shutil.which("git") or "git"
    return subprocess.run([git, *who, *words], cwd=folder, check=True, capture_output=True).stdout.strip()


def _touched(path: Path) -> Path:
    path.touch()
    return path


def _tar(folder: Path) -> bytes:
    out = io.BytesIO()
    with tarfile.open(fileobj=out, mode="w") as archive:
        archive.add(folder / "lab", "lab")
    return out.getvalue()


def _packed(folder: Path, data: bytes) -> Path:
    path = folder.with_suffix(".tar.gz")
    path.write_bytes(data)
    return path


def _zip(folder: Path) -> Path:
    path = folder.with_suffix(".zip")
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for file in sorted((folder / "lab").rglob("*")):
            archive.write(file, file.relative_to(folder))
    return path
