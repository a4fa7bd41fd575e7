"""The one thing that finding a package needs of its manifest: the name."""

from __future__ import annotations

import os
from pathlib import Path

from lxml import etree

from grader.intake.tree import read_file

MANIFEST = "package.xml"
_LARGEST_BYTES = 1 << 20
_LONGEST_NAME = 255


def manifest_name(folder: Path, *, root: Path) -> str | None:
    """`<name>` in the folder's `package.xml`, as far as it can be read; None where it cannot.

    A manifest that is not well-formed still gives its name where that comes before the fault. One that is a
    link out of `root` is not read.
    """
    path = folder / MANIFEST
    try:
        path.stat()  # before realpath, which follows chains of links that no system follows
        if not Path(os.path.realpath(path)).is_relative_to(os.path.realpath(root)):
            return None
        data = read_file(path, _LARGEST_BYTES + 1)
    except OSError:
        return None
    return None if data is None or len(data) > _LARGEST_BYTES else _name(data)


def _name(data: bytes) -> str | None:
    parser = etree.XMLParser(resolve_entities=False, no_network=True, load_dtd=False, recover=True)
    try:
        root = etree.fromstring(data.lstrip(), parser)
    except (etree.XMLSyntaxError, ValueError):
        return None
    # An empty document gives no root at all in this mode.
    for child in root if root is not None else ():
        if isinstance(child.tag, str) and child.tag.rpartition("}")[2] == "name":
            text = [child.text or "", *(part.tail or "" for part in child)]
            name = " ".join("".join(text).split())
            return name if 0 < len(name) <= _LONGEST_NAME else None
    return None
