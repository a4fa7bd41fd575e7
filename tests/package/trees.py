"""Small packages on disk, made from text."""

from __future__ import annotations

import ast
from pathlib import Path
from typing import Any

from grader.model.package import PackageFacts
from grader.model.submission import ModeSource, SourcePackage
from grader.package.facts import read_package

MANIFEST = """<?xml version="1.0"?>
<package format="2">
  <name>lab1</name>
  <version>0.0.0</version>
  <description>The lab1 package</description>
  <maintainer email="ada@example.org">Ada</maintainer>
  <license>MIT</license>
  <buildtool_depend>catkin</buildtool_depend>
  <depend>rospy</depend>
</package>
"""
CMAKE = (
    "cmake_minimum_required(VERSION 3.0.2)\nproject(lab1)\nfind_package(catkin REQUIRED)\ncatkin_package()\n"
)
NODE = "#!/usr/bin/env python3\nimport rospy\n"


def make_package(folder: Path, files: dict[str, bytes | str], **fields: Any) -> SourcePackage:
    """Write `files` below `folder`; scripts named in `executable` get their bit, on disk too."""
    folder.mkdir(parents=True, exist_ok=True)
    bits = fields.pop("executable", {})
    for path, text in files.items():
        place = folder / path
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_bytes(text if isinstance(text, bytes) else text.encode())
        place.chmod(0o755 if bits.get(path) else 0o644)
    source: ModeSource = fields.pop("mode_source", "git")
    modes = {path: bits.get(path, False) for path in files}
    return SourcePackage(
        name="lab1", folder=folder, path=fields.pop("path", "lab1"), mode_source=source, executable=modes
    )


def facts_of(folder: Path, name: str = "lab") -> PackageFacts:
    """What the files of a package on this disk say."""
    files = [path for path in folder.rglob("*") if path.is_file() and not path.is_symlink()]
    modes = {p.relative_to(folder).as_posix(): bool(p.stat().st_mode & 0o100) for p in files}
    return read_package(
        SourcePackage(name=name, folder=folder, path=folder.name, mode_source="disk", executable=modes)
    )


def plain(path: str, data: bytes) -> str:
    """The file without what a repair may change: space, quotes and the shebang."""
    if path.endswith(".py"):
        return ast.dump(ast.parse(data))
    lines = data.decode().split("\n")
    return "".join("".join(line for line in lines if not line.startswith("#!")).split())
