"""A repository's heads and tags in a bare repository of our own, which knows no address and no settings but ours."""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from grader.classes.fetching.history import Commit, read_commit
from grader.intake.git import Git, GitFailed, Repository
from grader.intake.repository import Wanted, ask, parse_refs
from grader.intake.source import Source

_EVERYTHING = ("+refs/heads/*:refs/heads/*", "+refs/tags/*:refs/tags/*")
_FETCH = ("fetch", "--quiet", "--no-tags", "--no-recurse-submodules", "--update-head-ok")
_WHOLE_HASHES = (40, 64)
# A log of its refs would name the address.
_SETTINGS = "[uploadpack]\n\tallowAnySHA1InWant = true\n[core]\n\tlogAllRefUpdates = false\n"
_NO_COMMIT = re.compile(r"expected commit type|is ambiguous")
_LOG = ("log", "--first-parent", "-z", "--date=raw", "--format=%H %cd")


@dataclass(frozen=True)
class Listing:
    """What a server says that it has, as `git ls-remote --symref` prints it."""

    text: str

    @property
    def refs(self) -> dict[str, str]:
        return parse_refs(self.text)

    @property
    def head(self) -> str | None:
        """The branch that HEAD stands for (`refs/heads/main`)."""
        lines = (line.split("\t") for line in self.text.splitlines())
        return next(
            (line[0][5:] for line in lines if line[0].startswith("ref: ") and line[1:] == ["HEAD"]), None
        )


@dataclass(frozen=True, kw_only=True)
class Mirror:
    """Of `source`, in the folder `path`; `room` is a folder for what is needed in between. Every method raises
    GitFailed."""

    source: Source
    path: Path
    room: Path
    git: Git

    @property
    def repository(self) -> Repository:
        return Repository(git_dir=self.path, top=self.path)

    def listing(self) -> Listing:
        """What the server has now. It is asked from a new repository: where one stands may have settings."""
        asking = self.room / "asking.git"
        if not asking.exists():
            self._begin(asking, sha256=False)
        repository = Repository(git_dir=asking, top=asking)
        return Listing(
            os.fsdecode(ask(self.source, self.git, repository, ("ls-remote", "--quiet", "--symref")))
        )

    def fetch(self, listing: Listing) -> None:
        """All heads and tags, and nothing that is no longer there."""
        refs = listing.refs
        sha256 = any(len(commit) == _WHOLE_HASHES[1] for commit in refs.values())
        if sha256 != self._is_sha256() or not (self.path / "HEAD").is_file():
            self._begin(self.path, sha256=sha256)
        for left in self.path.glob("objects/pack/tmp_*"):  # of one that was killed
            left.unlink()
        self._fetch(("--prune",), *_EVERYTHING)
        if listing.head in refs and str(listing.head).startswith("refs/heads/"):
            self._run("symbolic-ref", "HEAD", str(listing.head))

    def fetch_alone(self, listing: Listing, wanted: Wanted) -> None:
        """One commit without its history."""
        sha256 = any(len(commit) == _WHOLE_HASHES[1] for commit in listing.refs.values())
        self._begin(self.path, sha256=sha256)
        self._fetch(("--depth=1",), str(wanted.refspec or wanted.commit))

    def commit(self, listing: Listing, wanted: Wanted) -> str | None:
        """The full hash of what is wanted, fetched where no branch or tag reaches it; None where it is not there."""
        name = listing.refs[wanted.refspec] if wanted.refspec else str(wanted.commit)
        found = self._peeled(name)
        if found is None and (wanted.refspec or len(name) in _WHOLE_HASHES):
            try:
                self._fetch((), wanted.refspec or name)
            except GitFailed as failure:
                if wanted.refspec or not _is_unknown(failure):
                    raise
            found = self._peeled(name)
        return found

    @contextmanager
    def history(self, commit: str) -> Iterator[Iterator[Commit]]:
        """The commit and its first parents, the newest first."""
        records = self.git.records(*_LOG, commit, "--", cwd=self.path, repository=self.repository)
        with closing(records):
            yield (read_commit(record.decode("ascii", "replace")) for record in records if record)

    def copy(self, commit: str, into: Path) -> None:
        """That commit alone in a new repository, which reads and so proves every file of it."""
        self._begin(into, sha256=len(commit) == _WHOLE_HASHES[1])
        self.git.run(
            *(*_FETCH, "--depth=1", "--", self.path.as_uri(), f"{commit}:refs/heads/submission"),
            cwd=into,
            repository=Repository(git_dir=into, top=into),
        )
        (into / "FETCH_HEAD").unlink(missing_ok=True)

    def is_cut_off(self) -> bool:
        """Whether history ends where its owner's clone does."""
        return (self.path / "shallow").is_file()

    def _begin(self, folder: Path, *, sha256: bool) -> None:
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir()
        form = ("--object-format=sha256",) if sha256 else ()
        self.git.run("init", "--quiet", "--bare", "--template=", *form, ".", cwd=folder)
        with (folder / "config").open("a", encoding="utf-8") as config:
            config.write(_SETTINGS)

    def _is_sha256(self) -> bool:
        config = self.path / "config"
        return config.is_file() and "sha256" in config.read_text(encoding="utf-8", errors="replace")

    def _fetch(self, options: tuple[str, ...], *refspecs: str) -> None:
        try:
            ask(self.source, self.git, self.repository, (*_FETCH, "--update-shallow", *options), *refspecs)
        finally:
            with suppress(OSError):
                (self.path / "FETCH_HEAD").unlink()

    def _peeled(self, name: str) -> str | None:
        try:
            return self._run("rev-parse", "--verify", "--quiet", f"{name}^{{commit}}")
        except GitFailed as failure:
            if failure.stderr.strip() and not _NO_COMMIT.search(failure.stderr):
                raise
            return None

    def _run(self, *args: str) -> str:
        return (
            self.git.run(*args, cwd=self.path, repository=self.repository).decode("ascii", "replace").strip()
        )


def _is_unknown(failure: GitFailed) -> bool:
    """Whether the server says that it does not have the commit, or does not give it."""
    signs = (
        "not our ref",
        "no such remote ref",
        "unadvertised object",
        "couldn't find remote ref",
        "upload-pack",
    )
    return any(sign in failure.stderr.lower() for sign in signs)
