"""Rosters of a course."""

from __future__ import annotations

from pathlib import Path


def write_roster(path: Path, *rows: str, columns: str = "id,source,submitted_at") -> None:
    path.write_text("\n".join([columns, *rows, ""]))
