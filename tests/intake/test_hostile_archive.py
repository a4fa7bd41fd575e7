"""Archives that are sent to do harm, each by its name: one plain sentence, or the lab's package without what is odd."""

from __future__ import annotations

import bz2
import gzip
import io
import lzma
import os
import resource
import stat
import struct
import tarfile
import time
import zipfile
from contextlib import suppress

import pytest

from grader.errors import SubmissionError
from grader.intake.limits import IntakeLimits
from tests.intake.samples import make_tar, make_zip, manifest, opened, tar_entry, zip_entry

PACKAGE = ("lab1/package.xml", manifest("lab1"))
SMALL = IntakeLimits(total_bytes=4 << 20, file_bytes=1 << 20, stream_bytes=16 << 20, recording_bytes=2 << 20)


def tar_of(path, *entries, packing=""):
    return make_tar(path, [tar_entry(PACKAGE[0], PACKAGE[1].encode()), *entries], packing=packing)


def zip_of(path, *entries):
    return make_zip(path, [(zip_entry(PACKAGE[0]), PACKAGE[1]), *entries])


def plain_bytes(*entries):
    """A tar without its end."""
    out = io.BytesIO()
    with tarfile.open(fileobj=out, mode="w") as archive:
        for info, content in (tar_entry(PACKAGE[0], PACKAGE[1].encode()), *entries):
            archive.addfile(info, io.BytesIO(content))
        size = archive.offset
    return out.getvalue()[:size]


def header(name, kind, size):
    info = tarfile.TarInfo(name)
    info.type, info.size = kind, size
    return info.tobuf()


def refused(path, tmp_path, **fields):
    """The one sentence; nothing stays, nothing lies outside, and it took little time and memory."""
    before = {p for p in tmp_path.iterdir() if p.name != "work"}
    begin, peak = time.process_time(), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(SubmissionError) as caught:
        opened(path, tmp_path, **fields)
    assert time.process_time() - begin < 10
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - peak < 100_000
    assert caught.value.message.isprintable()
    assert len(caught.value.message) < 300
    assert caught.value.hint
    assert list((tmp_path / "work").iterdir()) == []
    assert {p for p in tmp_path.iterdir() if p.name != "work"} == before
    return caught.value.message


# Names


@pytest.mark.full
@pytest.mark.parametrize(
    "name", ["..\\evil", "a\\..\\..\\evil", "C:\\evil", "\\evil", "\\\\host\\evil", "x\\.."]
)
@pytest.mark.parametrize("system", [0, 3])
def test_a_windows_path_that_leads_outside(name, system, tmp_path):
    path = zip_of(
        tmp_path / "a.zip", (zip_entry(f"lab1/{name}" if name[0] == "x" else name, system=system), "x")
    )
    assert "leads outside" in refused(path, tmp_path)


@pytest.mark.parametrize("name", ["x" * 300, "a/" + "ü" * 200, "nul\0byte"])
def test_a_name_that_no_disk_takes_is_left_out(name, tmp_path):
    entry = tar_entry("lab1/x", b"x", pax_headers={"path": f"lab1/{name}"})
    submission = opened(tar_of(tmp_path / "a.tar", entry), tmp_path)
    assert set(submission.package.executable) == {"package.xml"}
    assert "a name that no disk takes were left out: lab1/" in submission.hints[0]
    assert len(submission.hints[0]) < 300


def test_names_with_newlines_and_escape_codes_are_shown_and_not_sent(tmp_path):
    names = ("lab1/a\nb.py", "lab1/\x1b[31mred.py", "lab1/\x07.py", "lab1/\u202eyp.evil")
    submission = opened(tar_of(tmp_path / "a.tar", *(tar_entry(name) for name in names)), tmp_path)
    assert len(submission.package.executable) == 5
    assert all(hint.isprintable() for hint in submission.hints)
    assert "\\x1b[31mred.py" in "".join(submission.hints)


def test_what_is_said_of_a_name_is_one_line(tmp_path):
    assert "evil\\n" in refused(tar_of(tmp_path / "a.tar", tar_entry("../evil\n")), tmp_path)


@pytest.mark.full
@pytest.mark.parametrize("name", ["CON", "con.py", "aux.launch", "end.", "end ", "a:b", "a\\b", "LPT1"])
def test_names_that_windows_cannot_hold_are_named(name, tmp_path):
    submission = opened(tar_of(tmp_path / "a.tar", tar_entry(f"lab1/{name}")), tmp_path)
    assert [h for h in submission.hints if h.startswith("names that Windows cannot hold")]
    assert name in submission.package.executable


def test_names_that_differ_in_capitals_only_are_both_kept_and_named(tmp_path):
    entries = [
        tar_entry(name, name.encode())
        for name in ("lab1/Talker.py", "lab1/talker.py", "lab1/Src/a", "lab1/src/b")
    ]
    submission = opened(tar_of(tmp_path / "a.tar", *entries), tmp_path)
    assert (submission.package.folder / "Talker.py").read_text() == "lab1/Talker.py"
    assert submission.hints == (
        "names that differ in capitals only, of which Windows and macOS keep one: Src, Talker.py, src, talker.py",
    )


@pytest.mark.filterwarnings("ignore:Duplicate name")
def test_the_same_name_twice_is_the_later_one(tmp_path):
    path = zip_of(tmp_path / "a.zip", (zip_entry("lab1/a"), "old"), (zip_entry("lab1/a"), "new"))
    assert (opened(path, tmp_path).package.folder / "a").read_text() == "new"


@pytest.mark.parametrize("names", [("lab1/a", "lab1/a/b"), ("lab1/a/b", "lab1/a")])
def test_one_name_for_a_file_and_a_folder(names, tmp_path):
    path = zip_of(tmp_path / "a.zip", *((zip_entry(name), "x") for name in names))
    assert "file and a folder at once" in refused(path, tmp_path)


# Entries that are no files


@pytest.mark.parametrize("kind", [stat.S_IFIFO, stat.S_IFSOCK, stat.S_IFBLK, stat.S_IFCHR])
def test_a_device_in_a_zip(kind, tmp_path):
    assert "device or a pipe" in refused(
        zip_of(tmp_path / "a.zip", (zip_entry("lab1/x", mode=kind | 0o666), "")), tmp_path
    )


def test_a_link_whose_target_is_replaced_later(tmp_path):
    """`a` leads to `b`, which is a folder when `a` is written, and a link to elsewhere in the end."""
    (tmp_path / "victim").mkdir()
    path = tar_of(
        tmp_path / "a.tar",
        tar_entry("lab1/a", type=tarfile.SYMTYPE, linkname="b"),
        tar_entry("lab1/b", type=tarfile.SYMTYPE, linkname="."),
        tar_entry("lab1/b", type=tarfile.SYMTYPE, linkname=str(tmp_path / "victim")),
        tar_entry("lab1/c", type=tarfile.SYMTYPE, linkname="a/x"),
    )
    submission = opened(path, tmp_path)
    assert not os.path.lexists(submission.package.folder / "b")
    assert not (submission.package.folder / "a").exists()
    assert list((tmp_path / "victim").iterdir()) == []


def test_a_link_is_never_written_through(tmp_path):
    path = tar_of(
        tmp_path / "a.tar",
        tar_entry("lab1/a", type=tarfile.SYMTYPE, linkname=str(tmp_path / "evil")),
        tar_entry("lab1/a", b"written"),
    )
    opened(path, tmp_path)
    assert not (tmp_path / "evil").exists()


def test_more_links_than_anybody_follows(tmp_path):
    entries = [tar_entry(f"lab1/{n}", type=tarfile.SYMTYPE, linkname=f"{n + 1}") for n in range(30)]
    assert "more than 20 links" in refused(
        tar_of(tmp_path / "a.tar", *entries), tmp_path, limits=IntakeLimits(links=20)
    )


@pytest.mark.full
def test_a_chain_of_links_that_no_system_follows(tmp_path):
    entries = [tar_entry(f"lab1/{n}", type=tarfile.SYMTYPE, linkname=f"{n + 1}") for n in range(1500)]
    begin = time.process_time()
    assert opened(tar_of(tmp_path / "a.tar", *entries), tmp_path).package.executable == {"package.xml": False}
    assert time.process_time() - begin < 10


@pytest.mark.parametrize("mode", [0o7777, 0o4755, 0o666, 0o000])
def test_modes_owners_and_times_of_an_archive_stay_in_it(mode, tmp_path):
    fields = {"mode": mode, "uid": 0, "gid": 0, "uname": "root", "mtime": 253402300799 * 8}
    submission = opened(tar_of(tmp_path / "a.tar", tar_entry("lab1/x", b"x", **fields)), tmp_path)
    found = (submission.package.folder / "x").stat()
    assert stat.S_IMODE(found.st_mode) in {0o755, 0o644}
    assert found.st_uid == os.geteuid()
    assert abs(found.st_mtime - time.time()) < 60


@pytest.mark.parametrize("year", [1980, 2107])
def test_times_of_a_zip_stay_in_it(year, tmp_path):
    entry = zip_entry("lab1/x")
    entry.date_time = (year, 1, 1, 0, 0, 0)
    assert (
        abs(
            (opened(zip_of(tmp_path / "a.zip", (entry, "x")), tmp_path).package.folder / "x").stat().st_mtime
            - time.time()
        )
        < 60
    )


def test_a_repository_in_an_archive_is_left_out(tmp_path):
    """Its hooks, filters and settings with it."""
    mark = tmp_path / "ran"
    entries = {
        ".git/config": f"[core]\nfsmonitor = touch {mark}\nworktree = /\n[include]\npath = /etc/shadow\n",
        ".git/hooks/post-index-change": f"#!/bin/sh\ntouch {mark}\n",
        ".git/objects/info/alternates": "/\n",
        ".git/HEAD": "ref: refs/heads/main\n",
        "lab1/.git": "gitdir: /\n",
    }
    path = zip_of(
        tmp_path / "a.zip", *((zip_entry(name, mode=0o755), text) for name, text in entries.items())
    )
    submission = opened(path, tmp_path)
    assert (submission.commit, submission.package.mode_source) == (None, "archive")
    assert [p.name for p in submission.root.iterdir()] == ["lab1"]
    assert not mark.exists()


# Sizes


@pytest.mark.full
@pytest.mark.parametrize("kind", ["zip", "tar", "gz", "bz2", "xz"])
def test_a_giant_beside_the_package_is_left_out(kind, tmp_path):
    size = 3 << 20
    if kind == "zip":
        path = zip_of(tmp_path / "a.zip", (zip_entry("giant"), bytes(size)), (zip_entry("lab1/b"), ""))
    else:
        entries = (tar_entry("giant", bytes(size)), tar_entry("lab1/b"))
        path = tar_of(tmp_path / "a.tar", *entries, packing="" if kind == "tar" else kind)
    submission = opened(path, tmp_path, limits=SMALL)
    assert set(submission.package.executable) == {"b", "package.xml"}
    assert submission.hints == ("files that are too large were left out: giant",)


@pytest.mark.parametrize("packing", [gzip.compress, bz2.compress, lzma.compress])
def test_ten_gigabytes_of_zeros_in_a_tar(packing, tmp_path):
    """Packed a piece at a time, as all of these formats can be joined."""
    piece = packing(bytes(1 << 20))
    data = packing(plain_bytes() + header("lab1/zeros", tarfile.REGTYPE, 10 << 30)) + piece * 20
    (tmp_path / "a.tar").write_bytes(data)
    assert "larger than 16 MiB when unpacked" in refused(tmp_path / "a.tar", tmp_path, limits=SMALL)


def test_ten_gigabytes_of_zeros_in_a_zip(tmp_path):
    path = zip_of(tmp_path / "a.zip", *((zip_entry(f"lab1/{n}"), bytes(1 << 20)) for n in range(8)))
    assert "larger than 4 MiB when unpacked" in refused(path, tmp_path, limits=SMALL)


def test_zip64_with_sizes_that_lie(tmp_path):
    """1 MiB of zeros that calls itself 10 bytes, and one that calls itself 16 EiB."""
    for lie, place in ((struct.pack("<L", 10), 24), (struct.pack("<L", 0xFFFFFFFE), 24)):
        path = zip_of(tmp_path / "a.zip", (zip_entry("lab1/zeros"), bytes(1 << 20)))
        data = bytearray(path.read_bytes())
        at = data.rfind(b"PK\x01\x02")
        data[at + place : at + place + 4] = lie
        path.write_bytes(data)
        if lie == struct.pack("<L", 10):
            assert "damaged" in refused(path, tmp_path)
        else:
            assert "too large were left out: lab1/zeros" in opened(path, tmp_path).hints[0]


@pytest.mark.filterwarnings("ignore:Duplicate name")
def test_a_zip_whose_entries_share_one_content(tmp_path):
    path = tmp_path / "a.zip"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(*PACKAGE)
        archive.writestr("lab1/a", bytes(1 << 16))
        archive.filelist += [archive.getinfo("lab1/a")] * 50
    assert "is inside another one" in refused(path, tmp_path)


@pytest.mark.parametrize("packing", [zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
def test_packings_that_zipfile_undoes_without_a_limit(packing, tmp_path):
    """Some hundred bytes of bzip2 are a gigabyte of memory."""
    path = tmp_path / "a.zip"
    with zipfile.ZipFile(path, "w", packing) as archive:
        archive.writestr(*PACKAGE)
    assert "not read here" in refused(path, tmp_path)


@pytest.mark.full
def test_a_zip_of_a_million_entries(tmp_path):
    """One local entry and a long list of contents: that alone would take hundreds of megabytes."""
    one = (
        struct.pack("<4s4B4HL2L5H2L", b"PK\1\2", 20, 3, 20, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0)
        + b"a"
    )
    local = struct.pack("<4s5H3L2H", b"PK\3\4", 20, 0, 0, 0, 0, 0, 0, 0, 1, 0) + b"a"
    size = len(one) * 1_000_000
    end = struct.pack("<4s4H2LH", b"PK\5\6", 0, 0, 0xFFFE, 0xFFFE, size, len(local), 0)
    (tmp_path / "a.zip").write_bytes(local + one * 1_000_000 + end)
    assert "more than 100000 files" in refused(tmp_path / "a.zip", tmp_path)


def test_a_tar_of_ten_million_empty_entries(tmp_path):
    entry = tar_entry("lab1/e")[0].tobuf()
    (tmp_path / "a.tar.gz").write_bytes(gzip.compress(plain_bytes()) + gzip.compress(entry * 500) * 20_000)
    assert "more than 1000 files" in refused(
        tmp_path / "a.tar.gz", tmp_path, limits=IntakeLimits(entries=1000)
    )
    assert "larger than 4 MiB" in refused(tmp_path / "a.tar.gz", tmp_path, limits=SMALL)


def test_a_tar_of_folders_in_folders(tmp_path):
    entries = [tar_entry("lab1/" + "/".join([str(n)] * 50) + "/x") for n in range(5)]
    path = tar_of(tmp_path / "a.tar", *entries)
    assert "more than 100 folders" in refused(path, tmp_path, limits=IntakeLimits(folders=100))


def test_hard_links_count_as_what_they_stand_for(tmp_path):
    links = [tar_entry(f"lab1/{n}", type=tarfile.LNKTYPE, linkname="lab1/big") for n in range(9)]
    path = tar_of(tmp_path / "a.tar", tar_entry("lab1/big", bytes(1 << 19)), *links)
    assert "larger than 4 MiB" in refused(path, tmp_path, limits=SMALL)


@pytest.mark.parametrize(
    "kind",
    [
        tarfile.XHDTYPE,
        *(
            pytest.param(kind, marks=pytest.mark.full)
            for kind in (tarfile.XGLTYPE, tarfile.GNUTYPE_LONGNAME, tarfile.GNUTYPE_LONGLINK)
        ),
    ],
)
def test_a_header_of_a_gigabyte(kind, tmp_path):
    data = gzip.compress(header("x", kind, 1 << 30)) + gzip.compress(bytes(1 << 20)) * 1000
    (tmp_path / "a.tar.gz").write_bytes(data)
    assert "takes more time or memory to unpack" in refused(tmp_path / "a.tar.gz", tmp_path)


@pytest.mark.full
@pytest.mark.parametrize(
    "record",
    [
        b"20015 comment=" + b"1" * 20000 + b"\n",
        b"5 aaa" * 10000 + b"=\n",
        b"0 a=b\n",
        b"1",
        b"9 a=b\n",
    ],
)
def test_headers_that_keep_a_parser_busy(record, tmp_path):
    padding = bytes(-len(record) % 512)
    data = header("x", tarfile.XHDTYPE, len(record)) + record + padding + plain_bytes() + bytes(1024)
    (tmp_path / "a.tar").write_bytes(data)
    begin = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    with suppress(SubmissionError):
        opened(tmp_path / "a.tar", tmp_path)
    assert resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - begin < 20


def test_extended_headers_as_tools_write_them_are_read(tmp_path):
    about = {"comment": "x" * 3000, "SCHILY.xattr.user.note": "ä=1\n2", "mtime": "1700000000.123456789"}
    entry = tar_entry("lab1/" + "long/" * 30 + "ü.py", b"x", mode=0o755, pax_headers=about)
    submission = opened(tar_of(tmp_path / "a.tar.gz", entry, packing="gz"), tmp_path)
    assert submission.package.executable["long/" * 30 + "ü.py"] is True


@pytest.mark.parametrize("form", ["gnu", "pax"])
def test_sparse_entries_of_ten_gigabytes(form, tmp_path):
    if form == "gnu":
        data = header("lab1/big", tarfile.GNUTYPE_SPARSE, 0)
    else:
        records = (
            b"22 GNU.sparse.major=1\n" + b"22 GNU.sparse.minor=0\n" + b"34 GNU.sparse.realsize=10737418240\n"
        )
        data = header("x", tarfile.XHDTYPE, len(records)) + records.ljust(512, b"\0")
        data += header("lab1/big", tarfile.REGTYPE, 0)
    (tmp_path / "a.tar").write_bytes(plain_bytes() + data + bytes(1024))
    assert ("sparse file" if form == "gnu" else "damaged") in refused(tmp_path / "a.tar", tmp_path)


@pytest.mark.parametrize("kind", [tarfile.REGTYPE, tarfile.XHDTYPE])
def test_an_entry_of_less_than_no_bytes(kind, tmp_path):
    data = bytearray(header("lab1/x", kind, 0))
    data[124:136] = b"\xff" * 4 + struct.pack(">q", -1024)
    data[148:156] = b" " * 8
    data[148:156] = b"%06o\0 " % sum(data)
    (tmp_path / "a.tar").write_bytes(bytes(data) + plain_bytes() + bytes(1024))
    assert "damaged" in refused(tmp_path / "a.tar", tmp_path)


def test_an_archive_of_a_terabyte_is_not_even_read(tmp_path):
    path = tar_of(tmp_path / "a.tar")
    os.truncate(path, 1 << 40)
    assert "larger than 1024 MiB" in refused(path, tmp_path)


def test_an_archive_in_an_archive_is_no_more_than_a_file(tmp_path):
    inner = zip_of(tmp_path / "inner.zip").read_bytes()
    submission = opened(zip_of(tmp_path / "a.zip", (zip_entry("lab1/inner.zip"), inner)), tmp_path)
    assert (submission.package.folder / "inner.zip").read_bytes() == inner


# Contradictions


def test_a_zip_whose_two_lists_disagree(tmp_path):
    for old, new in ((b"lab1/inn", b"../../ev"), (b"lab1/inn", b"lab1/out")):
        path = zip_of(tmp_path / "a.zip", (zip_entry("lab1/inn"), "x"))
        path.write_bytes(path.read_bytes().replace(old, new, 1))
        assert "damaged" in refused(path, tmp_path)


@pytest.mark.parametrize("flags", [0x1, 0x40, 0x41, 0x2041])
def test_encrypted_entries(flags, tmp_path):
    path = zip_of(tmp_path / "a.zip", (zip_entry("lab1/secret"), "x" * 100))
    data = bytearray(path.read_bytes())
    for magic, offset in ((b"PK\x03\x04", 6), (b"PK\x01\x02", 8)):
        struct.pack_into("<H", data, data.rfind(magic) + offset, flags)
    path.write_bytes(data)
    assert "password" in refused(path, tmp_path)


def test_an_entry_encrypted_by_aes(tmp_path):
    path = zip_of(tmp_path / "a.zip", (zip_entry("lab1/secret"), "x" * 100))
    data = bytearray(path.read_bytes())
    for magic, offset in ((b"PK\x03\x04", 6), (b"PK\x01\x02", 8)):
        struct.pack_into("<HH", data, data.rfind(magic) + offset, 1, 99)
    path.write_bytes(data)
    assert "password" in refused(path, tmp_path)


@pytest.mark.full
def test_pictures_and_models_leave_room_for_code(tmp_path):
    """A workspace full of meshes is no reason to refuse the package in it."""
    path = tmp_path / "workspace.zip"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for number in range(6):
            archive.writestr(f"ws/src/models/mesh{number}.dae", bytes(20 << 20))
        archive.writestr("ws/src/lab1/package.xml", manifest("lab1"))
        archive.writestr("ws/src/lab1/src/talker.py", "print('hello')\n")
    submission = opened(path, tmp_path)
    assert (submission.package.folder / "src" / "talker.py").is_file()
    assert any("too large" in hint and "mesh5.dae" in hint for hint in submission.hints)
