"""What a build left is a student's: it is looked at in seconds, whatever is in it, and what is too much is named."""

from __future__ import annotations

import io
import tarfile
import time
from collections.abc import Callable, Iterable
from pathlib import Path

import pytest

from grader.arena.workspace import ELF, HEADERS_BYTES_MAX, MEMBERS_MAX, read_archive, read_folder, read_member

SIZE_BYTES = 32 << 20
CPU_S = 10.0


def header(name: str, size: int, kind: bytes) -> bytes:
    member = tarfile.TarInfo(name)
    member.size, member.type, member.mode = size, kind, 0o755
    return member.tobuf(tarfile.USTAR_FORMAT)


def padded(data: bytes) -> bytes:
    return data + bytes(-len(data) % 512)


def pax(data: bytes, kind: bytes = tarfile.XHDTYPE) -> bytes:
    return header("x", len(data), kind) + padded(data)


def written(path: Path, parts: Iterable[bytes]) -> Path:
    with path.open("wb") as file:
        for part in parts:
            file.write(part)
    return path


def often(part: bytes) -> list[bytes]:
    return [part] * (SIZE_BYTES // len(part))


LONG = header("x", 5, tarfile.GNUTYPE_LONGNAME) + padded(b"abcd\0")
FILE = header("devel/lib/lab/a", 0, tarfile.REGTYPE)
NAMES, SIZES, HEADERS = "far too long, or too many", "a size that they do not have", "that no tar writes"


@pytest.mark.full
@pytest.mark.parametrize(
    ("parts", "why"),
    [
        (often(pax(b"11 a=bcdef\n")), NAMES),
        (often(pax(b"11 a=bcdef\n", tarfile.XGLTYPE)), NAMES),
        (often(LONG), NAMES),
        ([header("x", SIZE_BYTES, tarfile.XHDTYPE), *often(b"11 a=bcdef\n")], NAMES),
        ([header("x", SIZE_BYTES, tarfile.XHDTYPE), b"1" * SIZE_BYTES], NAMES),
        ([header("x", SIZE_BYTES, tarfile.GNUTYPE_LONGNAME), b"a" * SIZE_BYTES], NAMES),
        (often(header("x", 60_000, tarfile.GNUTYPE_LONGNAME) + padded(b"a" * 60_000) + FILE), NAMES),
        (often(pax(b"1" * 60_000) + FILE), HEADERS),
        (often(header("x", 512, tarfile.GNUTYPE_SPARSE) + b"\1" * 512), SIZES),
        ([pax(b"22 GNU.sparse.major=1\n22 GNU.sparse.minor=0\n"), *often(FILE)], HEADERS),
        (often(header("f", 0, tarfile.REGTYPE)), f"more than {MEMBERS_MAX} files"),
    ],
)
def test_archives_that_are_made_to_keep_a_reader_busy(parts: list[bytes], why: str, tmp_path: Path) -> None:
    archive = written(tmp_path / "built.tar", parts)
    begin = time.process_time()
    built = read_archive(archive, "lab")
    assert time.process_time() - begin < CPU_S
    assert why in built.too_much
    assert read_member(archive, "./nothing", 100) is None


@pytest.mark.full
def test_what_came_before_is_known(tmp_path: Path) -> None:
    parts = [FILE, *often(header("x", 0, tarfile.REGTYPE))[: MEMBERS_MAX + 1]]
    built = read_archive(written(tmp_path / "built.tar", parts), "lab")
    assert (built.programs, built.too_much) == (
        {"a"},
        f"what the build left is more than {MEMBERS_MAX} files",
    )


@pytest.mark.parametrize("form", [tarfile.GNU_FORMAT, tarfile.PAX_FORMAT])
def test_an_archive_as_tar_writes_it(form: int, tmp_path: Path) -> None:
    long, archive = "n" * 200, tmp_path / "built.tar"
    with tarfile.open(archive, "w", format=form) as tar:
        for name, data in (("a", b"#!x"), (long, ELF + b"rest"), ("é" * 60, b"")):
            member = tarfile.TarInfo(f"devel/lib/lab/{name}")
            member.size, member.mode, member.mtime = len(data), 0o755, 1_700_000_000
            tar.addfile(member, io.BytesIO(data))
    built = read_archive(archive, "lab")
    assert (built.programs, built.compiled, built.too_much) == ({"a", long, "é" * 60}, {long}, "")
    assert read_member(archive, f"devel/lib/lab/{long}", 6) == ELF + b"re"


@pytest.mark.parametrize("cut", [lambda d: d[:-700], lambda d: d[:600], lambda _: b"", lambda d: d[:300]])
def test_one_that_was_cut_off_is_read_so_far_and_nothing_is_said(
    cut: Callable[[bytes], bytes], tmp_path: Path
) -> None:
    data = header("devel/lib/lab/a", 3, tarfile.REGTYPE) + padded(b"abc") + FILE + bytes(1024)
    assert read_archive(written(tmp_path / "built.tar", [cut(data)]), "lab").too_much == ""


def test_a_folder_of_very_many_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("grader.arena.workspace.MEMBERS_MAX", 20)
    folder = tmp_path / "lib" / "lab"
    folder.mkdir(parents=True)
    for number in range(21):
        (folder / str(number)).touch(0o755)
    built = read_folder(tmp_path, "lab")
    assert len(built.programs) == 20
    assert "files" in built.too_much


@pytest.mark.full
def test_as_many_long_names_as_an_honest_build_has(tmp_path: Path) -> None:
    name = f"devel/lib/lab/{'n' * 150}"
    one = header("x", len(name) + 1, tarfile.GNUTYPE_LONGNAME) + padded(name.encode() + b"\0") + FILE
    count = HEADERS_BYTES_MAX // len(name) // 2
    assert read_archive(written(tmp_path / "built.tar", [one] * count), "lab").too_much == ""
