"""Someone else's repository as git may see it: its index, refs and objects, and none of its settings.

A repository's own settings, hooks and attributes can make git run programs; its links, `alternates` and `.git` files
can lead to another student's work. So git is given a folder of ours, in which only its data are linked.
"""

from __future__ import annotations

import os
import re
import shutil
import stat
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from grader.intake.git import Git, GitFailed, GitMissing, Repository
from grader.intake.tree import is_there, read_file

_SETTINGS_BYTES = 1 << 20
_POINTER_BYTES = 4096
_MAX_FILES = 300_000
_DATA = ("packed-refs", "refs", "reftable", "shallow")
_BORROWED = ("info/alternates", "info/http-alternates")
_FORMATS = {"extensions.objectformat": ("sha1", "sha256"), "extensions.refstorage": ("files", "reftable")}
_HASH = re.compile(r"[0-9a-f]{40}([0-9a-f]{24})?")


class Unfit(Exception):
    """Why a repository is not read, as the end of a sentence about it."""


def repository_around(folder: Path) -> Path | None:
    """Return the nearest folder from `folder` upwards that has a `.git` of any kind."""
    return next((place for place in (folder, *folder.parents) if is_there(place / ".git")), None)


def link_repository(
    top: Path, into: Path, git: Git, *, within: Path, bare: bool = False, objects: bool = False
) -> Repository:
    """Return a view of the repository in `top`, or of `top` itself where it is `bare`, in the new folder `into`.

    Nothing outside of `within` is read. `objects` are needed to fetch from it. Raises Unfit, GitMissing.
    """
    own = (top if bare else git_folder(top, within, git)).resolve()
    common = _common(own, within)
    settings = _settings(common, git)
    into.mkdir(parents=True)
    (into / "config").write_text(settings, encoding="utf-8")
    (into / "HEAD").write_bytes(_content(own / "HEAD", _POINTER_BYTES))
    shared = sorted(path.name for path in own.glob("sharedindex.*"))
    for folder, names in ((common, _DATA), (own, ("index", *shared))):
        for name in names:
            if _is_plain(folder / name):
                _show(folder / name, into / name)
    if not (into / "refs").exists():
        (into / "refs").mkdir()
    if objects:
        _refuse_borrowed(common / "objects")
        _show_objects(common / "objects", into / "objects")
    else:
        (into / "objects").mkdir()
    return Repository(git_dir=into, top=top.resolve())


def _show(place: Path, at: Path) -> None:
    """By a link; a copy where none may be made, as on Windows. There is no link in what `_is_plain` has seen."""
    try:
        at.symlink_to(place)
    except OSError:
        (shutil.copytree if place.is_dir() else shutil.copyfile)(place, at)


def _show_objects(place: Path, at: Path) -> None:
    """As `_show`, but objects may be many: git itself is told where they are."""
    try:
        at.symlink_to(place)
    except OSError:
        (at / "info").mkdir(parents=True)
        (at / "info" / "alternates").write_text(f"{place.as_posix()}\n", encoding="utf-8")


def git_folder(top: Path, within: Path, git: Git) -> Path:
    """`.git` is a folder, or a file that names one, as in a submodule or a further worktree."""
    place = top / ".git"
    mode = place.lstat().st_mode
    if stat.S_ISDIR(mode):
        return place
    if stat.S_ISLNK(mode):
        raise Unfit("its .git is a link")
    text = os.fsdecode(_content(place, _POINTER_BYTES))
    target = _real(top / text.removeprefix("gitdir:").strip())
    known = target is not None and (_is_in(target, within) or _points_back(target, top, git))
    if target is None or not known or not text.startswith("gitdir:"):
        raise Unfit("its .git leads to a repository outside of the submission")
    return target


def _points_back(target: Path, top: Path, git: Git) -> bool:
    """Whether the repository at `target` names `top` as its own: anybody can write a file that names a repository."""
    with suppress(Unfit):
        if is_there(target / "gitdir"):
            place = os.fsdecode(_content(target / "gitdir", _POINTER_BYTES)).strip()
            return _real(target / place) == _real(top / ".git")
        _content(target / "config", _SETTINGS_BYTES)
        worktree = _setting(target / "config", "core.worktree", git)
        return bool(worktree) and _real(target / worktree) == _real(top)
    return False


def _common(own: Path, within: Path) -> Path:
    """Where refs and objects lie: two folders up for a further worktree."""
    if not is_there(own / "commondir"):
        return own
    common = _real(own / os.fsdecode(_content(own / "commondir", _POINTER_BYTES)).strip())
    if common is None or not (_is_in(common, within) or common == own.parent.parent):
        raise Unfit("its .git leads to a repository outside of the submission")
    return common


def _real(path: Path) -> Path | None:
    try:
        return Path(os.path.realpath(path))
    except (ValueError, RecursionError):  # a null byte, a chain of links that no system follows
        return None


def _is_in(real: Path, within: Path) -> bool:
    return real.is_relative_to(within.resolve())


def _content(path: Path, limit_bytes: int) -> bytes:
    """Return a file's content; a link is not followed."""
    try:
        data = None if path.is_symlink() else read_file(path, limit_bytes + 1)
    except OSError as error:
        raise Unfit(f"its {path.name} cannot be read") from error
    if data is None or len(data) > limit_bytes:
        raise Unfit(f"its {path.name} is not what git writes")
    return data


def _settings(common: Path, git: Git) -> str:
    """Settings of ours, and of the repository's the two that say in which form its data are."""
    _content(common / "config", _SETTINGS_BYTES)
    lines = ["[core]", "\tbare = true"]
    extensions = []
    for key, known in _FORMATS.items():
        value = _setting(common / "config", key, git).lower()
        if value and value not in known:
            raise Unfit("it is of a form that is not known here")
        extensions += [f"\t{key.partition('.')[2]} = {value}"] if value else []
    lines.append(f"\trepositoryformatversion = {1 if extensions else 0}")
    return "\n".join([*lines, *(["[extensions]"] if extensions else []), *extensions, ""])


def _setting(config: Path, key: str, git: Git) -> str:
    """One setting of a file alone, "" where it has none; what the file includes is not read. Raises GitMissing."""
    try:
        said = git.run("config", "--no-includes", "--file", str(config), "--get", key, cwd=git.home)
    except GitMissing:
        raise
    except GitFailed:
        return ""
    return said.decode("utf-8", "replace").strip()


def _is_plain(path: Path) -> bool:
    """Return whether it is there. Raises Unfit where it, or anything in it, is neither a file nor a folder."""
    if not is_there(path):
        return False
    for count, place in enumerate(_below(path)):
        mode = place.lstat().st_mode
        if count > _MAX_FILES:
            raise Unfit(f"its {path.name} holds more than {_MAX_FILES} files")
        if not (stat.S_ISREG(mode) or stat.S_ISDIR(mode)):
            raise Unfit(f"there is a link or a pipe in its {path.name}")
    return True


def _below(path: Path) -> Iterator[Path]:
    yield path
    for folder, folders, files in os.walk(path):
        yield from (Path(folder) / name for name in (*folders, *files))


def _refuse_borrowed(objects: Path) -> None:
    if not _is_plain(objects):
        raise Unfit("it has no objects")
    if any(is_there(objects / name) for name in _BORROWED):
        raise Unfit("it borrows its objects from another repository (.git/objects/info/alternates)")


class Repositories:
    """The repositories around the packages of one submission; each is looked at once."""

    def __init__(self, git: Git, base: Path, *, root: Path, known: Repository | None = None) -> None:
        self.git = git
        self._base = base
        self._root = root.resolve()
        self._known = known
        self._found: dict[Path, Repository | Unfit | GitFailed] = {}

    def around(self, folder: Path) -> Repository | None:
        """Return the one that tracks `folder`, or None. Raises Unfit, GitFailed."""
        if self._known is not None:
            return self._known
        top = repository_around(folder)
        if top is None:
            return None
        if top not in self._found:
            within = self._root if top.resolve().is_relative_to(self._root) else top
            into = self._base / f"git-view-{len(self._found)}"
            try:
                self._found[top] = link_repository(top, into, self.git, within=within)
            except (Unfit, GitFailed) as error:
                self._found[top] = error
        found = self._found[top]
        if isinstance(found, Repository):
            return found
        raise found

    def head(self, folder: Path) -> str | None:
        """Return the full hash that is checked out around `folder`; None where there is no repository or no commit."""
        try:
            repository = self.around(folder)
            if repository is None:
                return None
            args = ("rev-parse", "--verify", "--quiet", "HEAD")
            commit = self.git.run(*args, cwd=repository.git_dir, repository=repository).decode().strip()
        except (GitFailed, Unfit, UnicodeDecodeError):
            return None
        return commit if _HASH.fullmatch(commit) else None
