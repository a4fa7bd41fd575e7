"""Brings one commit of a repository to disk: as little history as will do, and nothing of it is run."""

from __future__ import annotations

import os
import shutil
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

from grader.errors import SubmissionError
from grader.intake.explain import explained
from grader.intake.git import Git, GitFailed, GitTimeout
from grader.intake.limits import Limits, Meter
from grader.intake.refs import Wanted, choose_ref, no_such_ref, parse_refs
from grader.intake.source import Source

_FULL_HASHES = (40, 64)
_EVERYTHING = (
    "+refs/heads/*:refs/remotes/origin/*",
    "+refs/tags/*:refs/tags/*",
    "+HEAD:refs/remotes/origin/HEAD",
)


@dataclass(frozen=True, kw_only=True)
class Clone:
    """`git_links` are the paths where the repository holds only a pointer to another repository's commit."""

    root: Path
    commit: str
    git_links: tuple[str, ...]
    hints: tuple[str, ...]


def clone(source: Source, git: Git, into: Path, limits: Limits) -> Clone:
    """The commit of `source`, checked out in the new folder `into`.

    Raises SubmissionError where it cannot be had; the reason is named.
    """
    try:
        refs = _remote_refs(source, git, into)
        wanted = choose_ref(refs, source.ref, given=source.given)
        commit = _fetch(source, git, into, refs, wanted)
        git_links = _measured(source, git, into, commit, limits)
        git.run("checkout", "--quiet", "--detach", "--force", commit, cwd=into)
    except GitFailed as failure:
        raise explained(failure, source) from None
    root = into / source.inside
    if not root.is_dir() or not root.resolve().is_relative_to(into.resolve()):
        raise SubmissionError(
            f"{source.given}: there is no folder {source.inside} in that commit",
            hint="Give the repository itself.",
        )
    return Clone(root=root, commit=commit, git_links=git_links, hints=(wanted.hint,) if wanted.hint else ())


def _remote_refs(source: Source, git: Git, into: Path) -> dict[str, str]:
    """Asked from inside the new repository: the folder one happens to stand in has settings of its own."""
    into.mkdir(parents=True)
    git.run("init", "--quiet", "--template=", ".", cwd=into)
    listed = git.run("ls-remote", "--quiet", "--", source.url, cwd=into, remote=source.remote)
    refs = parse_refs(os.fsdecode(listed))
    if any(len(commit) == _FULL_HASHES[1] for commit in refs.values()):
        shutil.rmtree(into / ".git")
        git.run("init", "--quiet", "--template=", "--object-format=sha256", ".", cwd=into)
    return refs


def _fetch(source: Source, git: Git, into: Path, refs: dict[str, str], wanted: Wanted) -> str:
    """The full hash of the commit, fetched alone where the server can do that, with all history if not."""
    whole_hash = wanted.commit if wanted.commit and len(wanted.commit) in _FULL_HASHES else None
    one = wanted.refspec or whole_hash
    if one:
        try:
            _fetch_refs(source, git, into, ("--depth=1",), one)
            return _peeled(git, into, "FETCH_HEAD")
        except GitTimeout:
            raise
        except GitFailed:
            pass
    _fetch_refs(source, git, into, ("--update-shallow",), *_everything(refs, wanted))
    try:
        return _peeled(git, into, wanted.commit or "FETCH_HEAD")
    except GitFailed:
        raise no_such_ref(refs, source.ref or "HEAD", given=source.given) from None


def _everything(refs: dict[str, str], wanted: Wanted) -> tuple[str, ...]:
    if wanted.refspec:
        return (wanted.refspec,)
    return _EVERYTHING if "HEAD" in refs else _EVERYTHING[:-1]


def _fetch_refs(source: Source, git: Git, into: Path, options: tuple[str, ...], *refspecs: str) -> None:
    always = ("--quiet", "--no-tags", "--no-recurse-submodules")
    git.run("fetch", *always, *options, "--", source.url, *refspecs, cwd=into, remote=source.remote)


def _peeled(git: Git, into: Path, name: str) -> str:
    return git.run("rev-parse", "--verify", "--quiet", f"{name}^{{commit}}", cwd=into).decode().strip()


def _measured(source: Source, git: Git, into: Path, commit: str, limits: Limits) -> tuple[str, ...]:
    """Counts the commit's files before they are written: a few objects can stand for any number of them."""
    meter = Meter(limits, name=source.given)
    git_links = []
    with closing(git.records("ls-tree", "-r", "-l", "-z", commit, cwd=into)) as records:
        for record in records:
            meta, _, path = record.partition(b"\t")
            mode, _, _, size = meta.split()
            meter.entry(os.fsdecode(path))
            if mode == b"160000":
                git_links.append(os.fsdecode(path))
            else:
                meter.data(int(size))
    return tuple(git_links)
