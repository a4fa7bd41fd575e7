"""Archives as students' tools write them, and as nobody should."""

from __future__ import annotations

import gzip
import hashlib
import io
import os
import struct
import tarfile
import zipfile

import pytest

from grader.errors import SubmissionError
from grader.intake.limits import IntakeLimits
from tests.intake.samples import (
    NODE,
    lab_tar,
    lab_zip,
    make_tar,
    make_zip,
    manifest,
    opened,
    tar_entry,
    zip_entry,
)

pytestmark = pytest.mark.usefixtures("without_processes")
"""No child for each archive: what it may take is looked at in test_hostile_archive.py."""

MANIFEST = ("lab1/package.xml", manifest("lab1"))


def refused(path, tmp_path, **fields):
    with pytest.raises(SubmissionError) as caught:
        opened(path, tmp_path, **fields)
    assert "\n" not in caught.value.message
    assert caught.value.hint
    assert "work/source" not in caught.value.message
    assert list((tmp_path / "work").iterdir()) == []
    return caught.value.message


def with_manifest(*entries):
    return [(zip_entry(MANIFEST[0]), MANIFEST[1]), *entries]


def tar_with_manifest(*entries):
    return [tar_entry(MANIFEST[0], MANIFEST[1].encode()), *entries]


@pytest.mark.parametrize(
    ("name", "packing"),
    [
        ("lab1.tar", ""),
        ("lab1.tar.gz", "gz"),
        ("lab1.tgz", "gz"),
        ("lab1.tar.xz", "xz"),
        ("lab1.tar.bz2", "bz2"),
        ("lab1.zip", "gz"),
        ("lab1.tar", "xz"),
        ("Lab 1", "bz2"),
    ],
)
@pytest.mark.parametrize("mode", [0o755, 0o644])
def test_tars(name, packing, mode, tmp_path):
    path = lab_tar(tmp_path / name, packing=packing, mode=mode)
    submission = opened(path, tmp_path)
    assert submission.id == name.partition(".")[0].replace(" ", "-")
    assert submission.commit is None
    assert submission.archive_sha256 == hashlib.sha256(path.read_bytes()).hexdigest()
    assert submission.package.mode_source == "archive"
    assert submission.package.executable["src/node.py"] == (mode == 0o755)
    assert os.access(submission.package.folder / "src/node.py", os.X_OK) == (mode == 0o755)
    assert (submission.package.folder / "src/node.py").read_text() == NODE


@pytest.mark.parametrize(
    ("fields", "source", "executable"),
    [
        ({"mode": 0o755}, "archive", True),
        ({"mode": 0o644}, "archive", False),
        ({"mode": 0o755, "system": 0}, "none", None),
        ({"mode": 0}, "none", None),
        # What git archive writes, and so what GitHub's button gives: a mode for executable files alone.
        ({"mode": 0, "comment": b"a" * 40}, "archive", False),
    ],
)
def test_zips(fields, source, executable, tmp_path):
    path = lab_zip(tmp_path / "upload.tar.gz", **fields)
    package = opened(path, tmp_path).package
    assert package.mode_source == source
    assert package.executable["src/node.py"] is executable
    assert (package.folder / "src/node.py").read_text() == NODE


def test_modes_may_be_known_for_some_entries(tmp_path):
    entries = with_manifest((zip_entry("lab1/a.py", mode=0o755), ""), (zip_entry("lab1/b.py", mode=0), ""))
    package = opened(make_zip(tmp_path / "a.zip", entries), tmp_path).package
    assert package.executable == {"a.py": True, "b.py": None, "package.xml": False}


def test_names_of_old_windows_tools(tmp_path):
    entries = [
        (zip_entry("lab1\\", system=0), ""),
        (zip_entry("lab1\\package.xml", system=0), MANIFEST[1]),
        (zip_entry("lab1\\src\\a.py", system=0), ""),
    ]
    package = opened(make_zip(tmp_path / "a.zip", entries), tmp_path).package
    assert set(package.executable) == {"package.xml", "src/a.py"}


@pytest.mark.parametrize("raw", ["Übung/a.py".encode(), "Übung/a.py".encode("cp437")])
def test_names_without_the_utf8_mark(raw, tmp_path):
    stand_in = "x" * len(raw)
    path = make_zip(tmp_path / "a.zip", with_manifest((zip_entry(f"lab1/{stand_in}"), "")))
    path.write_bytes(path.read_bytes().replace(stand_in.encode(), raw))
    assert "Übung/a.py" in opened(path, tmp_path).package.executable


def test_a_name_that_is_not_utf8(tmp_path):
    entries = tar_with_manifest(tar_entry("lab1/caf\udce9.py"), tar_entry("lab1/caf\udce8.py"))
    with tarfile.open(tmp_path / "a.tar", "w", encoding="utf-8", errors="surrogateescape") as archive:
        for info, content in entries:
            archive.addfile(info, io.BytesIO(content))
    submission = opened(tmp_path / "a.tar", tmp_path)
    assert set(submission.package.executable) == {"package.xml"}
    assert "caf\\xe9.py" in "".join(submission.hints)
    alone = make_tar(tmp_path / "b.tar", tar_with_manifest())
    assert opened(alone, tmp_path).digest != submission.digest
    submission.model_dump_json()


def test_what_macos_adds_is_left_out(tmp_path):
    names = ("__MACOSX/lab1/._package.xml", "lab1/.DS_Store", "lab1/._a.py", "lab1/.git/config", "lab1/a.py")
    path = make_zip(tmp_path / "a.zip", with_manifest(*((zip_entry(name), "x") for name in names)))
    submission = opened(path, tmp_path)
    assert set(submission.package.executable) == {"package.xml", "a.py"}
    assert [path.name for path in submission.root.iterdir()] == ["lab1"]


@pytest.mark.full
@pytest.mark.parametrize(
    "name", ["../evil", "/evil", "lab1/../../evil", "C:/evil", "lab1/..", "..\\evil", "C:\\evil"]
)
def test_names_that_lead_outside(name, tmp_path):
    zipped = make_zip(tmp_path / "a.zip", with_manifest((zip_entry(name, system=0), "x")))
    assert "leads outside" in refused(zipped, tmp_path)
    if "\\" not in name:
        tarred = make_tar(tmp_path / "a.tar", tar_with_manifest(tar_entry(name, b"x")))
        assert "leads outside" in refused(tarred, tmp_path)
    assert not (tmp_path / "evil").exists()


@pytest.mark.full
@pytest.mark.parametrize(
    "entries",
    [
        [tar_entry("lab1/x", type=tarfile.CHRTYPE, devmajor=1, devminor=3)],
        [tar_entry("lab1/x", type=tarfile.BLKTYPE)],
        [tar_entry("lab1/x", type=tarfile.FIFOTYPE)],
        [tar_entry("lab1/x", type=tarfile.LNKTYPE, linkname="/etc/passwd")],
        [tar_entry("lab1/x", type=tarfile.LNKTYPE, linkname="../../etc/passwd")],
        [tar_entry("lab1/x", type=tarfile.LNKTYPE, linkname="lab1/none")],
        # Written through a link, whichever comes first.
        [tar_entry("lab1/x", type=tarfile.SYMTYPE, linkname="/tmp"), tar_entry("lab1/x/evil", b"x")],
        [tar_entry("lab1/x/evil", b"x"), tar_entry("lab1/x", type=tarfile.SYMTYPE, linkname="/tmp")],
        [
            tar_entry("lab1/x", type=tarfile.SYMTYPE, linkname="."),
            tar_entry("lab1/x/y", type=tarfile.SYMTYPE, linkname="/tmp"),
        ],
        [tar_entry("lab1/x", b"x"), tar_entry("lab1/x/y", b"x")],
        [tar_entry("lab1/x", type=tarfile.SYMTYPE, linkname="a" * 5000)],
    ],
)
def test_entries_that_mean_harm(entries, tmp_path):
    assert refused(make_tar(tmp_path / "a.tar", tar_with_manifest(*entries)), tmp_path)


def test_a_zip_with_a_device(tmp_path):
    entry = zip_entry("lab1/x")
    entry.external_attr = 0o020666 << 16
    assert "device" in refused(make_zip(tmp_path / "a.zip", with_manifest((entry, ""))), tmp_path)


def test_links_inside_are_kept_and_those_outside_left_out(tmp_path):
    entries = tar_with_manifest(
        tar_entry("lab1/a.py", b"x", mode=0o755),
        tar_entry("lab1/inside", type=tarfile.SYMTYPE, linkname="a.py"),
        tar_entry("lab1/up", type=tarfile.SYMTYPE, linkname="../lab1/a.py"),
        tar_entry("lab1/loop", type=tarfile.SYMTYPE, linkname="loop"),
        tar_entry("lab1/hard", type=tarfile.LNKTYPE, linkname="./lab1/a.py"),
        tar_entry("lab1/hard_link_of_link", type=tarfile.LNKTYPE, linkname="lab1/inside"),
        # As in every catkin workspace.
        tar_entry("CMakeLists.txt", type=tarfile.SYMTYPE, linkname="/opt/ros/noetic/share/x.cmake"),
        tar_entry("lab1/out", type=tarfile.SYMTYPE, linkname="../../etc"),
    )
    submission = opened(make_tar(tmp_path / "a.tar", entries), tmp_path)
    folder = submission.package.folder
    assert submission.package.executable == {"a.py": True, "hard": True, "package.xml": False}
    assert sorted(p.name for p in folder.iterdir() if p.is_symlink()) == [
        "hard_link_of_link",
        "inside",
        "loop",
        "up",
    ]
    assert not os.path.lexists(submission.root / "CMakeLists.txt")
    assert "CMakeLists.txt, lab1/out" in submission.hints[0]


def test_a_chain_of_links_does_not_lead_out(tmp_path):
    """Each looks harmless by its text: `a/b/c` is the root, so `a/b/c/..` is above it."""
    entries = tar_with_manifest(
        tar_entry("e", type=tarfile.SYMTYPE, linkname="a/b/c/.."),
        tar_entry("a/b/c", type=tarfile.SYMTYPE, linkname="../.."),
        tar_entry("f", type=tarfile.SYMTYPE, linkname="e"),
    )
    submission = opened(make_tar(tmp_path / "a.tar", entries), tmp_path)
    assert (submission.root / "a/b/c").is_symlink()
    assert not os.path.lexists(submission.root / "e")
    assert not (submission.root / "f").exists()


def test_a_zip_with_links(tmp_path):
    entries = with_manifest((zip_entry("lab1/ok"), "package.xml"), (zip_entry("lab1/bad"), "/etc/passwd"))
    for info, _ in entries[1:]:
        info.external_attr = 0o120777 << 16
    submission = opened(make_zip(tmp_path / "a.zip", entries), tmp_path)
    assert (submission.package.folder / "ok").is_symlink()
    assert not os.path.lexists(submission.package.folder / "bad")


def test_a_later_entry_replaces_an_earlier_one(tmp_path):
    entries = tar_with_manifest(tar_entry("lab1/a", b"old", mode=0o755), tar_entry("lab1/a", b"new"))
    package = opened(make_tar(tmp_path / "a.tar", entries), tmp_path).package
    assert (package.folder / "a").read_text() == "new"
    assert package.executable["a"] is False


@pytest.mark.parametrize(
    ("limits", "says"),
    [
        (IntakeLimits(entries=2), "more than 2 files"),
        (IntakeLimits(total_bytes=1 << 20), "larger than 1 MiB"),
    ],
)
@pytest.mark.parametrize("kind", ["zip", "tar.gz"])
def test_too_much(kind, limits, says, tmp_path):
    zeros = bytes(3 << 20)
    path = tmp_path / f"a.{kind}"
    if kind == "zip":
        make_zip(path, with_manifest((zip_entry("lab1/a"), ""), (zip_entry("lab1/zeros"), zeros)))
    else:
        entries = tar_with_manifest(tar_entry("lab1/a"), tar_entry("lab1/zeros", zeros))
        make_tar(path, entries, packing="gz")
    assert says in refused(path, tmp_path, limits=limits)


@pytest.mark.parametrize("keep", [0.02, 0.3, 0.6, 0.9, 0.99])
@pytest.mark.parametrize("kind", ["zip", "tar", "tar.gz", "tar.xz", "tar.bz2"])
def test_truncated(kind, keep, tmp_path):
    path = tmp_path / f"lab1.{kind}"
    lab_zip(path) if kind == "zip" else lab_tar(path, packing=kind.partition(".")[2])
    data = path.read_bytes()
    if kind == "tar":
        data = data.rstrip(b"\0")
    path.write_bytes(data[: int(len(data) * keep)])
    assert "damaged" in refused(path, tmp_path)


@pytest.mark.full
@pytest.mark.parametrize("kind", ["zip", "tar.gz", "tar.xz", "tar.bz2"])
def test_a_flipped_bit_is_never_a_crash(kind, tmp_path):
    path = tmp_path / f"lab1.{kind}"
    lab_zip(path) if kind == "zip" else lab_tar(path, packing=kind.partition(".")[2])
    good = path.read_bytes()
    for place in range(0, len(good), max(1, len(good) // 60)):
        path.write_bytes(good[:place] + bytes([good[place] ^ 0x41]) + good[place + 1 :])
        try:
            assert opened(path, tmp_path).package.name
        except SubmissionError as error:
            assert error.hint  # noqa: PT017 - a flipped bit may also do no harm


@pytest.mark.full
@pytest.mark.parametrize(
    ("name", "content", "says"),
    [
        ("lab1.zip", b"", "is empty"),
        ("lab1.zip", b"hello", "damaged"),
        ("lab1.tar.gz", b"\x1f\x8bnot really", "damaged"),
        ("lab1.zip", b"PK\x03\x04junk", "damaged"),
        ("lab1.rar", b"Rar!\x1a\x07\x00 and more", "rar archive"),
        ("lab1.7z", b"7z\xbc\xaf\x27\x1c", "7z archive"),
        ("node.py", NODE.encode(), "not an archive"),
        ("lab1.tar", bytes(10240), "is empty"),
        ("lab1.zip", b"PK\x05\x06" + bytes(18), "is empty"),
    ],
)
def test_files_that_are_no_archive(name, content, says, tmp_path):
    (tmp_path / name).write_bytes(content)
    assert says in refused(tmp_path / name, tmp_path)


def test_a_packed_file_that_is_no_tar(tmp_path):
    path = tmp_path / "node.py.gz"
    path.write_bytes(gzip.compress(NODE.encode() * 100))
    assert "damaged" in refused(path, tmp_path)


def test_a_password(tmp_path):
    path = lab_zip(tmp_path / "a.zip")
    data = bytearray(path.read_bytes())
    for magic, offset in ((b"PK\x03\x04", 6), (b"PK\x01\x02", 8)):
        place = data.find(magic)
        while place >= 0:
            flags = struct.unpack_from("<H", data, place + offset)[0]
            struct.pack_into("<H", data, place + offset, flags | 1)
            place = data.find(magic, place + 4)
    path.write_bytes(data)
    assert "password" in refused(path, tmp_path)


def test_a_packing_that_python_cannot_undo(tmp_path):
    path = tmp_path / "a.zip"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("lab1/package.xml", MANIFEST[1])
    data = bytearray(path.read_bytes())
    struct.pack_into("<H", data, data.find(b"PK\x03\x04") + 8, 9)
    struct.pack_into("<H", data, data.find(b"PK\x01\x02") + 10, 9)
    path.write_bytes(data)
    assert "not read here" in refused(path, tmp_path)


def test_too_many_folders_in_each_other(tmp_path):
    path = make_tar(tmp_path / "a.tar", tar_with_manifest(tar_entry("lab1/" + "d/" * 1500 + "x")))
    assert "folders in each other" in refused(path, tmp_path)
