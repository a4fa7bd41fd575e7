"""Which column of a platform's export is ours, whatever the platform writes behind its title."""

from __future__ import annotations

import re
from collections.abc import Sequence

from grader.classes.gradebook.identity import Kind, Platform, plain
from grader.classes.gradebook.marks import Wanted
from grader.errors import UsageError
from grader.wording import first_few

_GRADE = {"grade", "bewertung", "note", "calificación", "valutazione"}
_MAXIMUM = {"maximumgrade", "bestwertung", "notemaximale", "calificaciónmáxima", "valutazionemassima"}
_REAL = re.compile(r"\((real|points|punkte|points?|réel|brut|real\w*)\)\s*$", re.IGNORECASE)
_OTHER = re.compile(r"\((feedback|percentage|letter|prozentsatz|buchstabe)\)\s*$", re.IGNORECASE)
SHOWN_MAX = 12


def find_column(
    header: Sequence[str], wanted: Wanted, platform: Platform, known: dict[str, Kind], *, named: bool
) -> int | None:
    """Its place; None where there is none. With `named`, the instructor has said what it is called.

    Raises UsageError where several columns could be it, or none is what was named.
    """
    exact = [place for place, name in enumerate(header) if name.strip() in wanted.names]
    meant = {plain(name) for name in wanted.names}
    near = [
        place
        for place, name in enumerate(header)
        if name not in known and not _OTHER.search(name) and meant & _titles(name, platform)
    ]
    near = [place for place in near if _REAL.search(header[place])] or near if len(near) > 1 else near
    found = exact or near
    if len(found) > 1:
        raise UsageError(
            f"several columns could be {wanted.title}: {', '.join(header[place] for place in found)}",
            hint="say which one with --column",
        )
    if not found and named:
        raise UsageError(f"no column {wanted.title} in the template", hint=_others(header, known))
    return found[0] if found else None


def worksheet_columns(header: Sequence[str], known: dict[str, Kind]) -> tuple[int, int | None] | None:
    """The places of the grade and of its maximum in Moodle's offline grading worksheet; None where it is none."""
    plains = [plain(name) for name in header]
    grade = next((place for place, name in enumerate(plains) if name in _GRADE), None)
    if grade is None or "platform" not in known.values():
        return None
    return grade, next((place for place, name in enumerate(plains) if name in _MAXIMUM), None)


def maximum_in(header: str) -> float | None:
    """Blackboard says in a column's name how many points it has."""
    found = re.search(r"\[Total Pts: (?:up to )?([\d.]+)", header)
    return float(found[1]) if found and found[1].count(".") < 2 else None


def new_header(wanted: Wanted, platform: Platform, points: str) -> str:
    """What a column is called that the platform does not have yet."""
    return f"{wanted.title} [Total Pts: {points} Score]" if platform == "blackboard" else wanted.title


def _titles(name: str, platform: Platform) -> set[str]:
    """What the column may be called without what the platform adds."""
    if platform == "canvas":
        return {plain(re.sub(r"\s*\(\d+\)\s*$", "", name))}
    if platform == "blackboard":
        return {plain(re.sub(r"\s*\[Total Pts:.*$|\s*\|\s*\d+\s*$", "", name))}
    bare = re.sub(r"\s*\([^()]*\)\s*$", "", name)
    return {plain(bare), plain(bare.partition(":")[2]) or plain(bare)}


def _others(header: Sequence[str], known: dict[str, Kind]) -> str:
    names = [name for name in header if name.strip() and name not in known]
    return f"there are: {first_few(names, SHOWN_MAX)}"
