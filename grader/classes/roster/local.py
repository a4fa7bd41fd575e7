"""Which paths of this machine a roster may name. Rosters come from web forms: a student may have written the path."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import unquote

from grader.errors import GraderError
from grader.intake.source import parse_source

OUT = "leads out of the roster's folder; --allow-local DIR allows another one"
REFUSED = "is on this machine, and --remote-only takes only what is fetched"


@dataclass(frozen=True, kw_only=True)
class Local:
    """Those below the roster's own folder and below `folders`; none at all with `remote_only`."""

    folders: tuple[Path, ...] = ()
    remote_only: bool = False


OWN_FOLDER = Local()


def local_fault(source: str, base: Path, local: Local) -> str:
    """Why nothing of this machine may be read for `source`, in which a path is absolute, of a roster in `base`; empty
    where it may, and where it lies elsewhere. Links are followed, and nothing is opened."""
    try:
        places = _places(source)
        if places and local.remote_only:
            return REFUSED
        roots = [folder.resolve() for folder in (base, *local.folders)]
        return "" if all(_is_below(place.resolve(), roots) for place in places) else OUT
    except (OSError, ValueError, RuntimeError):
        return "is no path that can be followed"


def _places(source: str) -> list[Path]:
    """Where it lies, with the top of the repository that it is in; where nothing is there, where it would be."""
    try:
        read = parse_source(source)
    except GraderError:
        return _written(source)
    return [place for place in (read.path, read.top) if place is not None]


def _written(source: str) -> list[Path]:
    scheme, colon, rest = source.partition("://")
    if colon and scheme.lower() == "file":
        path = f"/{rest.partition('/')[2]}"
        return [Path(path), Path(unquote(path))]
    return [Path(source)] if Path(source).is_absolute() else []


def _is_below(place: Path, roots: Sequence[Path]) -> bool:
    return any(place.is_relative_to(root) for root in roots)
