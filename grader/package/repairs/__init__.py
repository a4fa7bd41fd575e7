"""Mechanical repairs: what keeps a package from being judged, and the line that puts it right. Never logic.

A package's folder, its facts and what the rubric names come in, `model.repair.Repair`s go out; `apply_repair` makes
one on a copy, or on the student's own files. Nothing of the student's is executed, and no link is followed.
"""

from __future__ import annotations

from pathlib import Path

from grader.model.package import PackageFacts
from grader.model.repair import DEFAULT_SHARES, Repair, RepairKind
from grader.package.repairs.wanted import Wanted, wanted_of

__all__ = ["DEFAULT_SHARES", "Repair", "RepairKind", "Wanted", "apply_repair", "find_repairs", "wanted_of"]


def find_repairs(folder: Path, package: PackageFacts, wanted: Wanted) -> tuple[Repair, ...]:
    """Return the repairs in the order in which a student would meet them. To be applied in this order, all or some."""
    return ()


def apply_repair(folder: Path, repair: Repair) -> None:
    """Make the repair in the package's folder. Raises ValueError where its file is no longer as it was."""
