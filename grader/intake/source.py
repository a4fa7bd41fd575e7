"""Reads SOURCE as it stands on the command line: which folder, archive or repository, which `@ref`, which id.

A new kind of place that submissions come from is told apart here (`parse_source`) and brought to a folder on disk by
`open.open_source`; for a class, `classes/fetching/obtain.py` chooses its commit.
"""

from __future__ import annotations

import os
import re
from dataclasses import dataclass, field, replace
from pathlib import Path, PurePath
from typing import Literal
from urllib.parse import unquote

from grader.errors import GraderError, SubmissionError, UsageError
from grader.intake.credentials import split_address, without_password
from grader.intake.names import archive_stem, brief, printable, safe_name
from grader.intake.tree import is_file, is_there

GivenModes = Literal["kept", "lost", "granted"]
_LONGEST = 4096
_SCHEMES = ("https", "http", "ssh", "git", "file")
_URL = re.compile(r"(?P<scheme>[A-Za-z][A-Za-z0-9+.-]*)://(?P<authority>[^/]*)(?P<path>/.*)?", re.DOTALL)
# As git reads it: a colon before any slash. One letter before it would be a drive of Windows.
_SCP = re.compile(
    r"(?P<host>(?:[\w.+-]+@)?(?:[\w.-]{2,}|\[[0-9a-fA-F:.]+\])):(?P<path>(?!:|//).+)", re.DOTALL
)
_HOST_AND_PATH = re.compile(r"(www\.|[\w-]+\.(com|org|edu|net|io|ac\.uk)/)")
# what `git check-ref-format` refuses; a leading hyphen would be an option
NO_REF = re.compile(r"[\x00-\x20~^:?*\[\\\x7f]|\.\.|@\{|//|^[/-]|[/.]$")
_SOURCES = "Give a folder, a .zip or .tar.gz, or a git URL with an optional @branch, @tag or @commit."


@dataclass(frozen=True, kw_only=True)
class Source:
    """`given` may be shown: it holds no password. `path` is set where the source lies on this machine.

    `url`, `ref` and `inside` (the folder of it that was asked for) are for a repository; `remote` tells
    whether reaching it takes the user's own git settings. `top` is where one on this machine lies. `hints` are
    remarks of the code that brought it here. `modes` says what a platform that takes uploads did to file modes:
    `lost` where they are not known, `granted` where every file then counts as executable.
    """

    kind: Literal["folder", "archive", "repository"]
    given: str
    name: str
    path: Path | None = None
    url: str = field(default="", repr=False)
    ref: str | None = None
    inside: str = "."
    remote: bool = False
    top: Path | None = None
    hints: tuple[str, ...] = ()
    modes: GivenModes = "kept"


def parse_source(text: str) -> Source:
    """Parse SOURCE. A path that exists wins over every other reading of the same text.

    Raises UsageError for what is neither there nor a git URL, SubmissionError for what cannot be a source.
    """
    if len(text) > _LONGEST:
        raise UsageError(
            f"a SOURCE of {len(text)} characters is longer than any path or address", hint=_SOURCES
        )
    local = _existing(text)
    if local is not None:
        return _local(local, None, text)
    if match := _URL.fullmatch(text):
        return _from_url(text, match)
    splits = list(_splits(text))
    # before the form `user@host:path`: what lies on this machine is meant by that
    for left, ref in splits:
        if _is_ref(ref) and (found := _existing(left)):
            return _local(found, ref, text)
    if match := _SCP.fullmatch(text):
        return _from_scp(text, match)
    for left, ref in splits:
        if _existing(left):
            raise _no_ref(ref)
    web = "A web address begins with https://. " if _HOST_AND_PATH.match(text) else ""
    raise UsageError(f"{printable(text) or 'an empty SOURCE'} does not exist", hint=web + _SOURCES)


def local_path(source: str | Source) -> Path | None:
    """Return the folder, file or repository on this machine; None for one elsewhere. Raises as `parse_source` does."""
    found = source if isinstance(source, Source) else parse_source(source)
    return found.top or found.path


def with_ref(source: Source, ref: str | None) -> Source:
    """Return the same at `ref`, which a roster names in a column of its own.

    Raises UsageError where the source says another one, or is a file, SubmissionError for a folder without git.
    """
    if ref is None or ref == source.ref:
        return source
    if not _is_ref(ref):
        raise _no_ref(ref)
    if source.ref is not None:
        raise UsageError(
            f"{source.given} says @{brief(source.ref)}, the column ref says {brief(ref)}",
            hint="Keep one of the two.",
        )
    given = f"{source.given}@{printable(ref)}"
    if source.path is not None and source.kind != "repository":
        return _local(source.path, ref, given)
    return replace(source, ref=ref, given=given)


def as_repository(source: Source) -> Source:
    """Return a folder that is a repository at its top as what is committed there. Raises SubmissionError otherwise."""
    assert source.path is not None  # noqa: S101 - folders have one
    return _local_repository(source.path, None, source.given)


def _existing(text: str) -> Path | None:
    if not text or "\0" in text:
        return None
    for candidate in (text, os.path.expanduser(text)):  # noqa: PTH111 - Path.expanduser raises without a home
        if os.path.lexists(candidate):
            return Path(os.path.abspath(candidate))  # noqa: PTH100 - keeps links in the name
    return None


def _splits(text: str) -> list[tuple[str, str]]:
    """Return every way to cut `text` in two at an `@`, the longest left side first."""
    cuts = [match.start() for match in re.finditer("@", text)]
    return [(text[:cut], text[cut + 1 :]) for cut in reversed(cuts)]


def _is_ref(text: str) -> bool:
    return bool(text) and NO_REF.search(text) is None


def _no_ref(text: str) -> UsageError:
    return UsageError(f"'{brief(text)}' cannot be the name of a branch, tag or commit", hint=_SOURCES)


def _local(path: Path, ref: str | None, text: str, *, clone: bool = False) -> Source:
    given = printable(text)
    if path.is_dir():
        if ref is None and not clone and not _is_git_folder(path):
            return Source(kind="folder", given=given, name=_folder_name(path), path=path)
        return _local_repository(path, ref, given)
    if not path.is_file():
        what = (
            "is a link to a file that does not exist"
            if path.is_symlink()
            else "is neither a folder nor a file"
        )
        raise SubmissionError(f"{given} {what}", hint=_SOURCES)
    if ref is not None:
        raise UsageError(f"{printable(path.name)} is a file: only a repository has @{ref}", hint=_SOURCES)
    return Source(kind="archive", given=given, name=archive_stem(path.name), path=path)


def _local_repository(path: Path, ref: str | None, given: str) -> Source:
    name = _folder_name(path).removesuffix(".git")
    path = path.resolve()
    around = (p for p in (path, *path.parents) if is_there(p / ".git"))
    top = path if _is_git_folder(path) else next(around, None)
    if top is None:
        raise SubmissionError(
            f"{given}: {printable(str(path))} is not a git repository",
            hint="Give a folder that is not a repository by its plain path, without file:// and without @.",
        )
    inside = path.relative_to(top).as_posix()
    return Source(
        kind="repository",
        given=given,
        name=name,
        path=path,
        url=top.as_uri(),
        ref=ref,
        inside=inside,
        top=top,
    )


def _is_git_folder(path: Path) -> bool:
    """Return whether it is a bare repository, or the `.git` of one that is not."""
    return is_file(path / "HEAD") and is_there(path / "objects") and is_there(path / "refs")


def _folder_name(path: Path) -> str:
    real = path.resolve()
    return real.parent.name if real.name == ".git" else real.name


def _from_url(text: str, match: re.Match[str]) -> Source:
    scheme, authority, path = match["scheme"].lower(), match["authority"], match["path"] or ""
    if scheme not in _SCHEMES:
        raise UsageError(f"{scheme}:// is not the address of a git repository", hint=_SOURCES)
    if scheme == "file" and authority in ("", "localhost"):
        return _from_file_url(path, text)
    server = f"{scheme}://{_without_password(scheme, authority)}"
    if scheme == "file" or authority.startswith("-"):
        raise UsageError(f"{brief(f'{server}{path}')} names no repository", hint=_SOURCES)
    split_address(f"{scheme}://{authority}")
    path, ref = _split_remote(path)
    if not path.strip("/") or not authority:
        raise UsageError(f"{printable(f'{server}{path}')} names no repository", hint=_SOURCES)
    shown = f"{server}{path}" + (f"@{ref}" if ref else "")
    url = f"{scheme}://{authority}{path}"
    return Source(kind="repository", given=printable(shown), name=_last(path), url=url, ref=ref, remote=True)


def _from_file_url(path: str, text: str) -> Source:
    # as it stands first: a folder's name may have a `%` in it
    for candidate in dict.fromkeys((path, unquote(path))):
        whole: list[tuple[str, str | None]] = [(candidate, None)]
        for left, ref in whole + [(left, ref) for left, ref in _splits(candidate) if _is_ref(ref)]:
            if found := _existing(left):
                return _local(found, ref, text, clone=True)
    raise SubmissionError(
        f"{printable(text)}: there is no such folder on this machine", hint="Check the path after file://."
    )


def _from_scp(text: str, match: re.Match[str]) -> Source:
    if match["host"].startswith("-"):  # an option to git or ssh
        raise UsageError(f"{brief(text)} names no repository", hint=_SOURCES)
    path, ref = _split_remote(match["path"])
    url = f"{match['host']}:{path}"
    return Source(kind="repository", given=printable(text), name=_last(path), url=url, ref=ref, remote=True)


def _split_remote(path: str) -> tuple[str, str | None]:
    """Return the path of a remote repository and its ref. An `@` that begins a folder's name (`/@user/`) is none."""
    if path.rstrip("/").endswith(".git"):
        return path, None
    # after `.git` an `@` is sure to begin the ref; elsewhere the first is taken that ends a folder's name
    cut = path.find(".git@") + 4 if ".git@" in path else -1
    if cut < 0:
        cut = next((at.start() for at in re.finditer(r"(?<=[^/])@", path)), -1)
    if cut < 0:
        return path, None
    path, ref = path[:cut], path[cut + 1 :]
    if not _is_ref(ref):
        raise _no_ref(ref)
    return path, ref


def _last(path: str) -> str:
    name = re.split(r"[/:]", unquote(path).rstrip("/"))[-1]
    return name.removesuffix(".git")


def _without_password(scheme: str, authority: str) -> str:
    """Return the server as it may be shown: of a web address without the user, in whose place a token may stand."""
    user, at, host = authority.rpartition("@")
    return host if scheme in ("http", "https") else f"{user.partition(':')[0]}{at}{host}"


def identify(source: str | Source, submission_id: str | None = None) -> tuple[str, str] | None:
    """Return the id and what may be shown of the source, as if it had been opened; None for what is not a source."""
    if isinstance(source, Source):
        return safe_name(submission_id if submission_id is not None else source.name), source.given
    try:
        parsed = parse_source(source)
        name, given = parsed.name, parsed.given
    except UsageError:
        return None
    # it is meant as a source, and its result says what is wrong with it
    except (GraderError, OSError, ValueError):
        name, given = archive_stem(PurePath(source).name), printable(without_password(source))
    return safe_name(submission_id if submission_id is not None else name), given
