"""What a roster may name: addresses as they are, and paths of this machine that `Local` allows.

Rosters come from web forms, so a student may have written the path.
"""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import unquote

from grader.errors import GraderError, SubmissionError, UsageError
from grader.intake.names import brief
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


_ADDRESS = re.compile(r"[A-Za-z][A-Za-z0-9+.-]*://|[^/\s@]+@[^/\s:]+:|[\w.-]{2,}:(?!//)\S")
"""An address with a scheme, git's `user@host:path`, or `host:path`, as an SSH configuration names hosts."""
_WINDOWS = re.compile(r"[A-Za-z]:[\\/]|.*\\", re.DOTALL)
_SLASHES = re.compile(r"(https?|ssh|git|file):(?!//)", re.IGNORECASE)
_WEB = re.compile(r"(www\.|[\w-]+(\.[\w-]+)*\.(com|org|edu|net|io|de|fr|it|es|uk)/)\S")
_NO_REF = re.compile(r"[\x00-\x20~^:?*\[\\\x7f]|\.\.|@\{|//|^[/-]|[/.]$")


def source_fault(source: str, base: Path, local: Local = OWN_FOLDER) -> str:
    """Why nothing can be had from `source`, a field of a roster in the folder `base`, or nothing may be by `local`;
    empty where it may be."""
    try:
        there = _is_there(source, base)
    except (OSError, ValueError, RuntimeError):
        return f"{_shown(source)} is no path that can be followed"
    refused = local_fault(whole_source(source, base), base, local)
    if not there and (_ADDRESS.match(source) or _WINDOWS.match(source)):
        fault = _address_fault(source)
        if fault or not refused:
            return fault
    if refused:
        return f"{_shown(source)} {refused}"
    if there or Path(source).is_absolute() or source.startswith("~"):
        return ""
    web = "; a web address begins with https://" if _WEB.match(source) else ""
    return f"{_shown(source)} does not exist{web}"


def _address_fault(source: str) -> str:
    if _SLASHES.match(source):
        return f"{_shown(source)}: an address has two slashes behind its colon, as in https://"
    if not _ADDRESS.match(source):
        return f"{_shown(source)} is a path of Windows: write it with / as it is on this machine"
    try:
        parse_source(source)
    except UsageError:  # as what git takes for the name of a program (`ext::`) or for an option of ssh
        return f"{_shown(source)} is no address of a repository"
    except (
        SubmissionError,
        OSError,
    ):  # a path on this machine that is not there is told when it is looked for
        return ""
    return ""


def whole_source(source: str, base: Path) -> str:
    """Return the same source for a process in another folder: a path becomes absolute."""
    if _ADDRESS.match(source) and not _is_there(source, base):
        return source
    return str(base.absolute() / os.path.expanduser(source))  # noqa: PTH111 - Path.expanduser raises without a home


def ref_fault(ref: str) -> str:
    """Why `ref` names no branch, tag or commit; empty where it may."""
    return f"{brief(ref)} cannot be the name of a branch, tag or commit" if _NO_REF.search(ref) else ""


def _shown(source: str) -> str:
    """Without what may be a password: all that stands before an `@`."""
    return brief(source.rpartition("@")[2] if re.search(r":.*@", source, re.DOTALL) else source)


def _is_there(source: str, base: Path) -> bool:
    """Return whether a path is, with or without the `@ref` behind it."""
    ends = [len(source), *(at.start() for at in re.finditer("@", source))]
    home = [os.path.expanduser(source[:end]) for end in ends[:20] if end]  # noqa: PTH111 - as above
    return any(os.path.lexists(base / path) for path in home)
