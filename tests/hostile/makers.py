"""Submissions that data alone cannot say. Each function gets the submission's folder, with the package `lab` in it, and
returns what is handed in."""

from __future__ import annotations

import gzip
import hashlib
import os
import socket
import tarfile
from pathlib import Path

from tests.hostile.intake_makers import (  # noqa: F401 - looked up here by name
    borrowed_objects,
    busy_header,
    bzip2_zip,
    empty_entries,
    giant_zip,
    hard_links,
    link_chain,
    long_header,
    long_list_zip,
    odd_tree,
    pipe_as_manifest,
    shared_content_zip,
    sparse,
    terabyte,
)
from tests.hostile.library_makers import libraries  # noqa: F401 - looked up here by name


def zeros(folder: Path, *, paths: list[str], size_mb: int) -> Path:
    """Files that are long and take no room on the disk."""
    for path in paths:
        target = folder / "lab" / path
        target.parent.mkdir(parents=True, exist_ok=True)
        with target.open("wb") as file:
            file.truncate(size_mb << 20)
    return folder


def thousand_nodes(folder: Path) -> Path:
    """A launch file whose nodes end at once and respawn without a pause."""
    node = '  <node name="n{}" pkg="lab" type="ends.sh" respawn="true" respawn_delay="0"/>\n'
    launch = "<launch>\n" + "".join(node.format(number) for number in range(1000)) + "</launch>\n"
    (folder / "lab" / "launch" / "lab.launch").write_text(launch, encoding="utf-8")
    script = folder / "lab" / "src" / "ends.sh"
    script.write_text("#!/bin/sh\nexit 0\n", encoding="utf-8")
    script.chmod(0o755)
    return folder


def garbage(folder: Path) -> Path:
    """A file that is no archive."""
    path = folder.with_suffix(".zip")
    path.write_bytes(b"PK\x03\x04" + bytes(range(256)) * 20)
    return path


def tar_of_zeros(folder: Path, *, size_gb: int) -> Path:
    """Packed pieces of zeros one behind the other: gzip reads them as one."""
    info = tarfile.TarInfo("lab/src/zeros.py")
    info.size = size_gb << 30
    piece = gzip.compress(bytes(64 << 20))
    path = folder.with_suffix(".tar.gz")
    with path.open("wb") as file:
        file.write(gzip.compress(info.tobuf(tarfile.GNU_FORMAT)))
        for _ in range(size_gb << 4):
            file.write(piece)
    return path


def pipes(folder: Path) -> Path:
    """Pipes and a socket where files are read."""
    for name in ("src/pipe.py", "launch/pipe.launch", "README.md", "src/__init__.py"):
        os.mkfifo(folder / "lab" / name)
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(str(folder / "lab" / "src" / "socket.py"))
    return folder


def many_files(folder: Path, *, count: int, depth: int) -> Path:
    """Files in one folder, and folders in each other."""
    deep = folder / "lab" / "deep" / "/".join(["d"] * depth)
    deep.mkdir(parents=True)
    for number in range(count):
        (folder / "lab" / "src" / f"file{number}").touch()
    return folder


def binary(folder: Path) -> Path:
    """The same bytes in every run, and no text at all."""
    data = hashlib.shake_256(b"hostile").digest(20_000)
    for name in ("package.xml", "CMakeLists.txt", "launch/lab.launch", "src/listener.py", "src/other.py"):
        (folder / "lab" / name).write_bytes(data)
    return folder
