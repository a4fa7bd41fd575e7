"""One number for a package's tree, the same wherever and whenever it is unpacked."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Collection, Iterable, Mapping
from pathlib import Path

from grader.intake.tree import Entry


def tree_digest(
    root: Path,
    entries: Iterable[Entry],
    executable: Mapping[str, bool | None],
    left_out: Collection[str] = frozenset(),
) -> str:
    """sha256 over the entries' paths, executable bits, link targets and contents; of what is left out, the size.

    Raises OSError for a file that cannot be read.
    """
    digest = hashlib.sha256()
    for entry in entries:
        path = os.fsencode(entry.path)
        content = b"%d" % entry.size_bytes if entry.path in left_out else _content(root / entry.path, entry)
        bit = b"x" if executable.get(entry.path) else b"-"
        digest.update(b"%s %s %d %d\n%s" % (entry.kind.encode(), bit, len(path), len(content), path))
        digest.update(content)
    return digest.hexdigest()


def _content(path: Path, entry: Entry) -> bytes:
    """A file stands for its sha256. Nothing but files is opened: a pipe would never end."""
    if entry.kind == "link":
        return os.fsencode(path.readlink())
    if entry.kind == "other":
        return b""
    digest = hashlib.sha256()
    with path.open("rb") as stream:
        while block := stream.read(1 << 20):
            digest.update(block)
    return digest.digest()
