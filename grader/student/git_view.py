"""A student's repository as git may see it, for advice and for what is staged: nothing that it brings along is run.

`intake.gitdir` links its data into a folder of ours; of its settings, and of its user's, only those are taken over that
say how files are compared.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from grader.errors import SubmissionError, UsageError
from grader.intake.git import Git, GitFailed, GitMissing, GitTimeout, Repository
from grader.intake.gitdir import Unfit, git_folder, link_repository, repository_around
from grader.intake.limits import IntakeLimits
from grader.intake.names import brief, printable
from grader.intake.tree import is_file, read_file

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
    if place != own / "index" and place.parent == own and place.is_file():
        shown = view.repository.git_dir / "index"
        shown.unlink(missing_ok=True)
        shown.write_bytes(place.read_bytes())
    return view


def _staged_paths(view: View, package: Path) -> list[str]:
    """Return the package's staged files, relative to its folder, without pointers to other repositories."""
    said = view.run("ls-files", "--stage", "-z", cwd=package)
    pairs = (record.partition(b"\t") for record in said.split(b"\0") if record)
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
    """As many paths at once as a command line takes."""
    batch: list[str] = []
    for path in paths:
        if batch and (len(batch) == PATHS_AT_ONCE or sum(map(len, batch)) + len(path) > COMMAND_CHARS):
            yield batch
            batch = []
        batch.append(path)
    yield batch
