"""Submissions that data alone cannot say. Each function gets the submission's folder, with the package `lab` in it, and
returns what is handed in."""

from __future__ import annotations

from pathlib import Path


def zeros(folder: Path, *, path: str, size_mb: int) -> Path:
    """A file that is long and takes no room on the disk."""
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
