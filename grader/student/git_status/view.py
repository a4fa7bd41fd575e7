"""A repository as git may see it (`intake.gitdir`), with those settings of its own and of its user's that only say how
files are compared."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from grader.intake.git import Git, GitFailed, GitMissing, GitTimeout, Repository
from grader.intake.gitdir import git_folder, link_repository
from grader.intake.tree import is_file, read_file

_WORDS = ("true", "false", "input", "lf", "crlf", "native", "yes", "no", "on", "off", "0", "1")
_SAFE = ("core.autocrlf", "core.eol", "core.ignorecase", "core.precomposeunicode", "core.symlinks")
_EXCLUDE_BYTES = 1 << 20


@dataclass(frozen=True, kw_only=True)
class View:
    """`settings` are those of the repository's own file, by key in lower case but for what stands between its dots."""

    git: Git
    repository: Repository
    settings: Mapping[str, str]
    options: tuple[str, ...]

    def run(self, *args: str, cwd: Path | None = None) -> bytes:
        """What git prints. Raises GitFailed."""
        return self.git.run(
            *self.options, *args, cwd=cwd or self.repository.git_dir, repository=self.repository
        )

    @property
    def remote_names(self) -> tuple[str, ...]:
        """The servers that it knows."""
        keys = (key for key in self.settings if key.startswith("remote.") and key.endswith(".url"))
        return tuple(sorted(key[len("remote.") : -len(".url")] for key in keys))


def open_view(top: Path, into: Path, git: Git) -> View:
    """The repository at `top`, seen through the new folder `into`. Raises Unfit, GitFailed."""
    own = git_folder(top, top, git)
    repository = link_repository(top, into, git, within=top, objects=True)
    common = _common(own)
    settings = _listed(git.run("config", "--no-includes", "--file", str(common / "config"), "-lz", cwd=into))
    users = _users_settings(git)
    _copy_excludes(common, into)
    safe = {key: value for key in _SAFE if (value := settings.get(key, users.get(key, ""))).lower() in _WORDS}
    options = [f"{key}={value}" for key, value in safe.items()]
    excludes = users.get("core.excludesfile") or _usual_excludes()
    if excludes:
        options.append(f"core.excludesFile={os.path.expanduser(excludes)}")  # noqa: PTH111 - raises without a home
    return View(
        git=git,
        repository=repository,
        settings=settings,
        options=tuple(part for option in (*options, "core.fileMode=false") for part in ("-c", option)),
    )


def _common(own: Path) -> Path:
    """Where a further worktree has its settings; `link_repository` has looked at it already."""
    pointer = own / "commondir"
    return own / pointer.read_text(encoding="utf-8").strip() if is_file(pointer) else own


def _listed(said: bytes) -> dict[str, str]:
    pairs = (os.fsdecode(record).partition("\n") for record in said.split(b"\0") if record)
    return {key: value for key, _, value in pairs}


def _users_settings(git: Git) -> dict[str, str]:
    """Those of the user and of the machine."""
    try:
        said = git.run("config", "--list", "--show-scope", "-z", cwd=git.home, remote=True)
    except (GitMissing, GitTimeout):
        raise
    except GitFailed:  # a git that is older than scopes
        return {}
    parts = said.split(b"\0")
    wanted = [record for scope, record in zip(parts[::2], parts[1::2], strict=False) if scope in _SCOPES]
    return _listed(b"\0".join(wanted))


_SCOPES = (b"system", b"global")


def _usual_excludes() -> str:
    base = os.environ.get("XDG_CONFIG_HOME") or os.path.expanduser("~/.config")  # noqa: PTH111 - as above
    path = Path(base, "git", "ignore")
    return str(path) if is_file(path) else ""


def _copy_excludes(common: Path, into: Path) -> None:
    """What only this clone ignores."""
    path = common / "info" / "exclude"
    data = read_file(path, _EXCLUDE_BYTES) if is_file(path) and not path.is_symlink() else None
    if data:
        (into / "info").mkdir()
        (into / "info" / "exclude").write_bytes(data)
