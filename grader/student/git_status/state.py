"""What git answered about one package, as records. Paths are bytes-faithful text, relative to the package's folder."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

What = Literal["new", "modified", "deleted", "bit", "conflict"]


@dataclass(frozen=True, kw_only=True)
class Change:
    """A tracked file that differs from the last commit. `staged` where nothing of it is left to add. Of a `bit` only
    the executable bit differs."""

    path: str
    what: What
    staged: bool


@dataclass(frozen=True, kw_only=True)
class Files:
    """What is on the disk and what git has of it. `bits` are executable on the disk and not in git's index, `cases` are
    (git's name, the disk's name), `unlooked` those that git was told not to look at, `links` folders of which git has
    a pointer to another repository alone."""

    changes: tuple[Change, ...] = ()
    untracked: tuple[str, ...] = ()
    ignored: tuple[str, ...] = ()
    bits: tuple[str, ...] = ()
    cases: tuple[tuple[str, str], ...] = ()
    unlooked: tuple[str, ...] = ()
    links: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Head:
    """`branch` is None where none is checked out, `commit` where there is none yet. `operation` is what git is in the
    middle of (`rebase`, `merge`, …), or ""."""

    branch: str | None
    commit: str | None
    operation: str = ""


@dataclass(frozen=True, kw_only=True)
class Remote:
    """What is known of the server, from the last fetch or push. `ref` is the branch there that this one is pushed to,
    as `origin/main`, or None where it never was; `ahead` and `behind` count commits against it, None where they cannot
    be told. `default` is what is usually marked, or None where that is not known. `differing` are the package's files
    that differ between the commit here and the one that is marked (`default`, else `ref`)."""

    names: tuple[str, ...] = ()
    name: str | None = None
    ref: str | None = None
    ahead: int | None = None
    behind: int | None = None
    default: str | None = None
    off_default: int | None = None
    differing: tuple[str, ...] = ()
    elsewhere: bool = False


@dataclass(frozen=True, kw_only=True)
class State:
    """`package` is the package's folder, `top` its repository's. `around` is a further repository around that one, and
    `submodule` says that it knows of it. `owned` is false where the repository is another user's."""

    top: Path
    package: Path
    head: Head
    files: Files
    remote: Remote
    around: Path | None = None
    submodule: bool = False
    owned: bool = True
