"""Someone else's repository as git may see it: its index, refs and objects, and none of its settings.

A repository's own settings, hooks and attributes can make git run programs; its links, `alternates` and `.git` files
can lead to another student's work. So git is given a folder of ours, in which only its data are linked. `open_view` is
for advice, and for what is staged: of the repository's settings, and of its user's, only those are taken over that say
how files are compared.
"""

from __future__ import annotations

import os
import re
import shutil
import stat
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import chain
from pathlib import Path

from grader.errors import SubmissionError, UsageError
from grader.intake.git import Git, GitFailed, GitMissing, GitTimeout, Repository
from grader.intake.limits import IntakeLimits
from grader.intake.names import brief, printable
from grader.intake.tree import is_file, is_there, read_file

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
    """Show a file or folder by a link; by a copy where no link may be made, as on Windows. `_is_plain` has looked for
    links in it."""
    try:
        at.symlink_to(place)
    except OSError:
        (shutil.copytree if place.is_dir() else shutil.copyfile)(place, at)


def _show_objects(place: Path, at: Path) -> None:
    """Do as `_show`, but objects may be many: where no link may be made, git itself is told where they are."""
    try:
        at.symlink_to(place)
    except OSError:
        (at / "info").mkdir(parents=True)
        (at / "info" / "alternates").write_text(f"{place.as_posix()}\n", encoding="utf-8")


def git_folder(top: Path, within: Path, git: Git) -> Path:
    """Return where `.git` leads: it is a folder, or a file that names one, as in a submodule or a further worktree.

    Raises Unfit where it leads out of `within`, to a repository that does not name `top` as its own."""
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
    """Return whether the repository at `target` names `top` as its own: anybody can write a file that names another."""
    with suppress(Unfit):
        if is_there(target / "gitdir"):
            place = os.fsdecode(_content(target / "gitdir", _POINTER_BYTES)).strip()
            return _real(target / place) == _real(top / ".git")
        _content(target / "config", _SETTINGS_BYTES)
        worktree = _setting(target / "config", "core.worktree", git)
        return bool(worktree) and _real(target / worktree) == _real(top)
    return False


def _common(own: Path, within: Path) -> Path:
    """Return the folder of refs and objects: `own`, or two folders up for a further worktree. Raises Unfit."""
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
    """Return a config of our own settings, and of the repository's the two that say in which form its data are."""
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
    """Return one setting of a file, "" if it has none; what the file includes is not read. Raises GitMissing."""
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
    below = (Path(top) / name for top, folders, files in os.walk(path) for name in (*folders, *files))
    for count, place in enumerate(chain([path], below)):
        mode = place.lstat().st_mode
        if count > _MAX_FILES:
            raise Unfit(f"its {path.name} holds more than {_MAX_FILES} files")
        if not (stat.S_ISREG(mode) or stat.S_ISDIR(mode)):
            raise Unfit(f"there is a link or a pipe in its {path.name}")
    return True


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


SECONDS = 30.0
WORDS = ("true", "false", "input", "lf", "crlf", "native", "yes", "no", "on", "off", "0", "1")
SAFE = ("core.autocrlf", "core.eol", "core.ignorecase", "core.precomposeunicode", "core.symlinks")
SCOPES = (b"system", b"global")
EXCLUDE_BYTES = 1 << 20
PATHS_AT_ONCE = 200
COMMAND_CHARS = 50_000


@dataclass(frozen=True, kw_only=True)
class View:
    """`settings` are those of the repository's own file, by key in lower case but for what stands between its dots."""

    git: Git
    repository: Repository
    settings: Mapping[str, str]
    options: tuple[str, ...]

    def run(self, *args: str, cwd: Path | None = None) -> bytes:
        """Return what git prints. Raises GitFailed."""
        return self.git.run(
            *self.options, *args, cwd=cwd or self.repository.git_dir, repository=self.repository
        )

    @property
    def remote_names(self) -> tuple[str, ...]:
        """The names of the servers that it knows."""
        keys = (key for key in self.settings if key.startswith("remote.") and key.endswith(".url"))
        return tuple(sorted(key[len("remote.") : -len(".url")] for key in keys))


def open_view(top: Path, into: Path, git: Git) -> View:
    """Return the repository at `top`, seen through the new folder `into`. Raises Unfit, GitFailed."""
    own = git_folder(top, top, git)
    repository = link_repository(top, into, git, within=top, objects=True)
    pointer = own / "commondir"  # of a further worktree; `link_repository` has checked it
    common = own / pointer.read_text(encoding="utf-8").strip() if is_file(pointer) else own
    settings = _parse(git.run("config", "--no-includes", "--file", str(common / "config"), "-lz", cwd=into))
    users = _user_settings(git)
    _copy_excludes(common / "info" / "exclude", into / "info" / "exclude")
    # these values are single words that name no program, file or address
    safe = {key: value for key in SAFE if (value := settings.get(key, users.get(key, ""))).lower() in WORDS}
    excludes = users.get("core.excludesfile") or _default_excludes()
    if excludes:
        safe["core.excludesFile"] = os.path.expanduser(excludes)  # noqa: PTH111 - raises without a home
    safe["core.fileMode"] = "false"
    options = tuple(part for key, value in safe.items() for part in ("-c", f"{key}={value}"))
    return View(git=git, repository=repository, settings=settings, options=options)


def _parse(listed: bytes) -> dict[str, str]:
    pairs = (os.fsdecode(record).partition("\n") for record in listed.split(b"\0") if record)
    return {key: value for key, _, value in pairs}


def _user_settings(git: Git) -> dict[str, str]:
    """Return the settings of the user and of the machine."""
    try:
        said = git.run("config", "--list", "--show-scope", "-z", cwd=git.home, remote=True)
    except (GitMissing, GitTimeout):
        raise
    except GitFailed:  # a git that is older than scopes
        return {}
    parts = said.split(b"\0")
    wanted = (record for scope, record in zip(parts[::2], parts[1::2], strict=False) if scope in SCOPES)
    return _parse(b"\0".join(wanted))


def _default_excludes() -> str:
    base = os.environ.get("XDG_CONFIG_HOME") or os.path.expanduser("~/.config")  # noqa: PTH111 - as above
    path = Path(base, "git", "ignore")
    return str(path) if is_file(path) else ""


def _copy_excludes(source: Path, target: Path) -> None:
    """Take over what only this clone ignores."""
    data = read_file(source, EXCLUDE_BYTES) if is_file(source) and not source.is_symlink() else None
    if data:
        target.parent.mkdir()
        target.write_bytes(data)


def write_staged(package: Path, base: Path, *, index: str = "") -> Path:
    """Write the package in the folder `package` as it is staged below the new folder `base`; return its folder there.

    `index` is git's own variable for the index that a commit is made of (`git commit -a` has one of its own).
    Raises UsageError where there is no repository, SubmissionError where nothing of it is staged or git cannot tell.
    """
    package = package.resolve()
    top = repository_around(package)
    if top is None:
        raise UsageError(f"{printable(str(package))} is not in a git repository", hint="leave out --staged")
    into = base / "staged"
    try:
        view = _open_index(top, base, index)
        for paths in _batches(_staged_paths(view, package)):
            view.run("checkout-index", f"--prefix={into}/", "--", *paths, cwd=package)
    except (GitFailed, Unfit, OSError) as error:
        said = (str(error).strip().splitlines() or [type(error).__name__])[-1]
        raise SubmissionError(
            f"what is staged cannot be read: {brief(said)}",
            hint="leave out --staged: what is on the disk is checked",
        ) from error
    return into / package.relative_to(top)


def _open_index(top: Path, base: Path, index: str) -> View:
    """Return the repository with the index that git names, if that lies where git puts one."""
    git = Git(base / "home", timeout_s=SECONDS)
    view = open_view(top, base / "view", git)
    own = git_folder(top, top, git).resolve()
    place = Path(os.path.realpath(top / index)) if index else own / "index"
    # any other file, even a student's, could be named as an index
    if place != own / "index" and place.parent == own and place.is_file():
        shown = view.repository.git_dir / "index"
        shown.unlink(missing_ok=True)
        shown.write_bytes(place.read_bytes())
    return view


def _staged_paths(view: View, package: Path) -> list[str]:
    """Return the package's staged files, relative to its folder, without pointers to other repositories."""
    said = view.run("ls-files", "--stage", "-z", cwd=package)
    pairs = (record.partition(b"\t") for record in said.split(b"\0") if record)
    # 160000 is the mode of a pointer to a submodule's commit
    paths = [os.fsdecode(path) for meta, _, path in pairs if not meta.startswith(b"160000")]
    if not paths:
        raise SubmissionError(
            f"git has nothing of the package in {printable(package.name)}",
            hint="git add its files, and commit",
        )
    if len(paths) > IntakeLimits().package_files:
        raise SubmissionError(
            f"{len(paths)} files are staged", hint="take what was built or recorded out of the repository"
        )
    return paths


def _batches(paths: Sequence[str]) -> Iterator[list[str]]:
    """Yield as many paths at once as a command line takes."""
    batch: list[str] = []
    for path in paths:
        if batch and (len(batch) == PATHS_AT_ONCE or sum(map(len, batch)) + len(path) > COMMAND_CHARS):
            yield batch
            batch = []
        batch.append(path)
    yield batch
