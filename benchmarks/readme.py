"""Puts a benchmark's figures into benchmarks/README.md, between its own markers."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from benchmarks.figures import Found, NotMeasured

README = Path(__file__).parent / "README.md"


def section(found: Found, machine_line: str, loads: tuple[float, float]) -> str:
    """The figures as they stand in the README."""
    line = f"{machine_line}, {found.runs}. Load {loads[0]:.1f} before, {loads[1]:.1f} after."
    remarks = "".join(f"{remark}\n" for remark in found.remarks)
    faults = "".join(f"- Not right: {fault}\n" for fault in found.faults)
    return "\n".join(part for part in (f"{line}\n", *found.tables, remarks, faults) if part)


def write(name: str, text: str, pictures: Mapping[str, str]) -> None:
    """Put the figures between the markers of that name, and the pictures beside the README."""
    start, end = f"<!-- {name} begin -->\n", f"<!-- {name} end -->\n"
    before, found, rest = README.read_text().partition(start)
    _, closed, after = rest.partition(end)
    if not found or not closed:
        raise NotMeasured(f"{README.name} has no markers for {name}")
    for file, picture in pictures.items():
        README.with_name(file).write_text(f"{picture}\n")
    README.write_text(f"{before}{start}\n{text}\n{end}{after}")
