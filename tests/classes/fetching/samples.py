"""Repositories that stand for a server's, with commits of any date. No network."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from unittest.mock import patch

from grader.classes.fetching.history import Rule
from grader.classes.fetching.mirror import Patience
from grader.classes.fetching.obtain import Obtained, obtain
from grader.intake.open import open_submission
from grader.model.batch import Entry
from grader.model.submission import Submission
from tests.intake.samples import git, lab, write

HOST = "https://forge.invalid"
AT_ONCE = Patience(sleep=lambda _: None)
DEADLINE = datetime.fromisoformat("2026-10-30T23:59:00+01:00")


@dataclass(frozen=True)
class Server:
    """`https://forge.invalid/NAME` is the repository `NAME` in `folder`, by git's own settings."""

    folder: Path
    base: Path

    def new(self, name: str = "student", date: str = "2026-10-01T10:00:00+01:00") -> Path:
        """A repository on `main` with the package `lab1`."""
        repo = write(self.folder / name, lab(), executable=("lab1/src/node.py",))
        git(repo, "init", "--quiet", "--template=", "--initial-branch=main")
        commit_at(repo, date)
        return repo

    @property
    def cache(self) -> Path:
        return self.base / "cache" / "grader" / "repositories"

    def mirrors(self) -> list[Path]:
        return sorted(self.cache.glob("*/mirror.git"))

    def obtain(self, source: str = f"{HOST}/student", rule: Rule | None = None, **fields: object) -> Obtained:
        since = fields.pop("since", 0.0)
        return obtain(
            entry(source, **fields),
            rule or Rule(),
            workdir=self.base / "work",
            fetched_since=since,
            patience=AT_ONCE,
        )

    def opened(
        self, source: str = f"{HOST}/student", rule: Rule | None = None, **fields: object
    ) -> Submission:
        found = self.obtain(source, rule, **fields)
        return open_submission(found.source, package="lab1", workdir=self.base / "opened")


def server_in(base: Path, monkeypatch) -> Server:
    """A server, a home whose git finds it, and a cache of its own."""
    folder = base / "server"
    folder.mkdir()
    settings = f'[url "file://{folder}/"]\n\tinsteadOf = {HOST}/\n'
    home = write(base / "home", {".gitconfig": settings})
    monkeypatch.setenv("HOME", str(home))
    monkeypatch.setenv("XDG_CACHE_HOME", str(base / "cache"))
    for name in (
        "GIT_CONFIG_GLOBAL",
        "XDG_CONFIG_HOME",
        "GITHUB_TOKEN",
        "GH_TOKEN",
        "GITLAB_TOKEN",
        "CI_JOB_TOKEN",
    ):
        monkeypatch.delenv(name, raising=False)
    return Server(folder, base)


def entry(source: str = f"{HOST}/student", **fields: object) -> Entry:
    return Entry.model_validate({"id": "s1", "source": source, **fields})


def commit_at(repo: Path, date: str, files: Mapping[str, str | bytes] | None = None) -> str:
    """All that is there, with `files`, committed at that date; the author's date is another one."""
    write(repo, files or {})
    with patch.dict(os.environ, {"GIT_COMMITTER_DATE": date, "GIT_AUTHOR_DATE": "2001-01-01T00:00:00+0000"}):
        git(repo, "add", "--all")
        git(repo, "commit", "--quiet", "--allow-empty", "--message", "Work")
    return git(repo, "rev-parse", "HEAD")
