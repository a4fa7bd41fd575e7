"""Brings one commit of a repository to disk, with as little history as will do; nothing of it is run.

`explained` says why git could not, in a user's words: one line with the cause, and what to do.
"""

from __future__ import annotations

import difflib
import os
import re
import shutil
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal, NamedTuple

from grader.errors import SubmissionError, Unreachable
from grader.intake.credentials import Access, accesses, split_address, without_password
from grader.intake.git import Git, GitFailed, GitMissing, GitTimeout, GitTooMuch, Repository
from grader.intake.gitdir import Unfit, link_repository
from grader.intake.limits import IntakeLimits, Meter
from grader.intake.names import brief, listing, printable
from grader.intake.source import Source

_FULL_HASHES = (40, 64)
_EVERYTHING = (
    "+refs/heads/*:refs/remotes/origin/*",
    "+refs/tags/*:refs/tags/*",
    "+HEAD:refs/remotes/origin/HEAD",
)


_LINK = b"120000"
_GIT_LINK = b"160000"
_LONGEST_NAME_BYTES = 255
_LONGEST_LINK_BYTES = 4095
# Of a commit's own attributes, those that make a file many times larger, or name a program.
_ATTRIBUTES = "* !filter !ident !working-tree-encoding\n"
_HASH = re.compile(r"[0-9a-fA-F]{4,64}")
# Shorter ones may mean another commit than the one that a ref happens to point to.
_TELLING_HASH = 7
_USUAL_BRANCHES = ("main", "master")


@dataclass(frozen=True, kw_only=True)
class Clone:
    """`git_links` are the paths where the repository holds only a pointer to another repository's commit."""

    root: Path
    commit: str
    repository: Repository
    git_links: tuple[str, ...]
    hints: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class _Files:
    """What a commit holds: `left_out` is not written to disk."""

    git_links: tuple[str, ...]
    left_out: tuple[str, ...]


def clone(source: Source, git: Git, into: Path, limits: IntakeLimits) -> Clone:
    """Return the commit of `source`, checked out in the new folder `into`.

    Raises SubmissionError where it cannot be had; the reason is named.
    """
    try:
        fetched = served(source, git, into.parent.parent / "git-served")
        refs = _remote_refs(fetched, git, into)
        wanted = choose_ref(refs, source.ref, given=source.given)
        commit = _fetch(fetched, git, into, refs, wanted)
        files = _measure_files(source, git, into, commit, limits)
        _checkout(source, git, into, commit, files)
    except GitFailed as failure:
        raise explained(failure, source) from None
    root = into / source.inside
    # a folder in a commit may be a link that leads out
    if not root.is_dir() or not root.resolve().is_relative_to(into.resolve()):
        raise SubmissionError(
            f"{source.given}: there is no folder {source.inside} in that commit",
            hint="Give the repository itself.",
        )
    return Clone(
        root=root,
        commit=commit,
        repository=_own(into),
        git_links=files.git_links,
        hints=(*source.hints, *_hints(wanted, files)),
    )


def served(source: Source, git: Git, view: Path) -> Source:
    """Return the source with the address of a view of its data, if it is on this machine. Its settings are left out, as
    they could make git run programs. Raises SubmissionError where it cannot be read."""
    if source.top is None:
        return source
    bare = not (source.top / ".git").exists() or source.top.name == ".git"
    try:
        link_repository(source.top, view, git, within=source.top, bare=bare, objects=True)
    except Unfit as unfit:
        raise SubmissionError(
            f"{source.given}: {unfit}", hint="Hand in a clone that stands alone, or the folder without .git."
        ) from None
    return replace(source, url=view.as_uri())


def _own(into: Path) -> Repository:
    return Repository(git_dir=into / ".git", top=into)


def _hints(wanted: WantedRevision, files: _Files) -> Iterator[str]:
    if wanted.hint:
        yield wanted.hint
    if files.left_out:
        yield f"too large, or with a name too long, so left out: {listing(list(files.left_out))}"


def _remote_refs(source: Source, git: Git, into: Path) -> dict[str, str]:
    """Return the server's refs. They are asked for from inside the new repository, since the folder in which the user
    stands may be one with settings of its own."""
    into.mkdir(parents=True)
    # without a template, which may bring hooks along
    git.run("init", "--quiet", "--template=", ".", cwd=into)
    listed = ask(source, git, _own(into), ("ls-remote", "--quiet"))
    refs = parse_refs(os.fsdecode(listed))
    # A repository has one kind of hash, and it is chosen when it is made.
    if any(len(commit) == _FULL_HASHES[1] for commit in refs.values()):
        shutil.rmtree(into / ".git")
        git.run("init", "--quiet", "--template=", "--object-format=sha256", ".", cwd=into)
    return refs


def _fetch(source: Source, git: Git, into: Path, refs: dict[str, str], wanted: WantedRevision) -> str:
    """Return the commit's full hash. It is fetched alone where the server can do that, with all history if not."""
    whole_hash = wanted.commit if wanted.commit and len(wanted.commit) in _FULL_HASHES else None
    one = wanted.refspec or whole_hash
    if one:
        try:
            _fetch_refs(source, git, into, ("--depth=1",), one)
            return _commit_of(git, into, "FETCH_HEAD")
        except (GitTimeout, GitTooMuch):
            raise
        except GitFailed:
            pass
    # A server that gives no single commit by its hash gives its branches, and the commit is looked for there.
    _fetch_refs(source, git, into, ("--update-shallow",), *_everything(refs, wanted))
    try:
        return _commit_of(git, into, wanted.commit or "FETCH_HEAD")
    except GitFailed:
        raise no_such_ref(refs, source.ref or "HEAD", given=source.given) from None


def _everything(refs: dict[str, str], wanted: WantedRevision) -> tuple[str, ...]:
    if wanted.refspec:
        return (wanted.refspec,)
    return _EVERYTHING if "HEAD" in refs else _EVERYTHING[:-1]


def _fetch_refs(source: Source, git: Git, into: Path, options: tuple[str, ...], *refspecs: str) -> None:
    always = ("--quiet", "--no-tags", "--no-recurse-submodules")
    ask(source, git, _own(into), ("fetch", *always, *options), *refspecs)


def ask(source: Source, git: Git, repository: Repository, command: tuple[str, ...], *refspecs: str) -> bytes:
    """Return what the server of `source` answers to a command that takes an address. Raises GitFailed."""
    url, login = split_address(source.url) if source.remote else (source.url, None)
    return git.run(
        *(*command, "--", url, *refspecs),
        cwd=repository.top,
        repository=repository,
        remote=source.remote,
        accesses=accesses(url, login) if source.remote else (Access(),),
    )


def _commit_of(git: Git, into: Path, name: str) -> str:
    # `^{commit}` makes of a tag the commit that it stands for
    args = ("rev-parse", "--verify", "--quiet", f"{name}^{{commit}}")
    return git.run(*args, cwd=into, repository=_own(into)).decode().strip()


def _measure_files(source: Source, git: Git, into: Path, commit: str, limits: IntakeLimits) -> _Files:
    """Count the commit's files before they are written: a few objects can stand for any number of them."""
    meter = Meter(limits, name=source.given)
    git_links, left_out = [], []
    args = ("ls-tree", "-r", "-l", "-z", commit)
    with closing(git.records(*args, cwd=into, repository=_own(into))) as records:
        for record in records:
            meta, _, raw = record.partition(b"\t")
            mode, _, _, size = meta.split()
            path = os.fsdecode(raw)
            meter.entry(path)
            if mode == _GIT_LINK:
                git_links.append(path)
                continue
            longest = max(len(part) for part in raw.split(b"/"))
            room = int(size) <= _LONGEST_LINK_BYTES if mode == _LINK else meter.has_room(path, int(size))
            if longest > _LONGEST_NAME_BYTES or not room:
                left_out.append(path)
            else:
                meter.folders(path)
                meter.data(int(size))
    return _Files(git_links=tuple(git_links), left_out=tuple(left_out))


def _checkout(source: Source, git: Git, into: Path, commit: str, files: _Files) -> None:
    """Write the files, but for those left out, as git itself can be told to."""
    info = into / ".git" / "info"
    info.mkdir(exist_ok=True)
    (info / "attributes").write_text(_ATTRIBUTES, encoding="utf-8")
    sparse: tuple[str, ...] = ()
    if files.left_out:
        # The list of what to leave out has a path on each line.
        if any("\n" in path for path in files.left_out):
            raise SubmissionError(
                f"{source.given}: {brief(files.left_out[0])} is too large",
                hint="Take it out of the repository.",
            )
        # these lines are patterns, as in .gitignore
        lines = ["/*", *("!/" + re.sub(r"([\\*?\[\] ])", r"\\\1", path) for path in files.left_out)]
        (info / "sparse-checkout").write_bytes(os.fsencode("\n".join(lines) + "\n"))
        sparse = ("-c", "core.sparseCheckout=true")
    git.run(*(*sparse, "checkout", "--quiet", "--detach", "--force", commit), cwd=into, repository=_own(into))


@dataclass(frozen=True, kw_only=True)
class WantedRevision:
    """`refspec` can be fetched alone. Without one, `commit` (a hash, or its beginning) is looked for."""

    refspec: str | None = None
    commit: str | None = None
    hint: str = ""


def parse_refs(text: str) -> dict[str, str]:
    """Parse `git ls-remote`'s lines into ref to hash; `v1^{}` is the commit that the tag `v1` stands for."""
    pairs = (line.split("\t", 1) for line in text.splitlines() if "\t" in line)
    return {ref: commit for commit, ref in pairs}


def choose_ref(refs: dict[str, str], ref: str | None, *, given: str) -> WantedRevision:
    """Return what to fetch for `@ref`, or for none. Raises SubmissionError, naming what is there."""
    if not refs:
        raise SubmissionError(
            f"{given}: the repository is empty, it has no commit", hint="Commit and `git push` first."
        )
    if ref is None:
        return _default(refs, given)
    for name in (f"refs/heads/{ref}", f"refs/tags/{ref}", f"refs/remotes/{ref}", ref):
        if name in refs:
            return WantedRevision(refspec=name)
    if _HASH.fullmatch(ref):
        return _by_hash(refs, ref.lower())
    raise no_such_ref(refs, ref, given=given)


def no_such_ref(refs: dict[str, str], ref: str, *, given: str) -> SubmissionError:
    """Return the error for a ref that is not there, with the nearest that is."""
    names = [re.sub(r"^refs/(heads|tags)/", "", name) for name in refs if name.startswith("refs/heads/")]
    names += [name[len("refs/tags/") :] for name in refs if re.fullmatch(r"refs/tags/.*(?<!\^\{\})", name)]
    near = difflib.get_close_matches(ref, names, n=1)
    hint = (
        f"Did you mean @{printable(near[0])}?" if near else f"There are: {listing(names) or 'no branches'}."
    )
    return SubmissionError(f"{given}: there is no branch, tag or commit '{printable(ref)}'", hint=hint)


def _default(refs: dict[str, str], given: str) -> WantedRevision:
    if "HEAD" in refs:
        return WantedRevision(refspec="HEAD")
    branches = [name for name in refs if name.startswith("refs/heads/")]
    usual = [f"refs/heads/{name}" for name in _USUAL_BRANCHES if f"refs/heads/{name}" in branches]
    chosen = (usual or branches)[:1]
    if not chosen or (len(branches) > 1 and not usual):
        names = listing([name.removeprefix("refs/heads/") for name in branches])
        raise SubmissionError(
            f"{given}: the repository's default branch does not exist",
            hint=f"Add the branch to mark, as in @{names}." if branches else "Push a branch.",
        )
    branch = printable(chosen[0].removeprefix("refs/heads/"))
    return WantedRevision(
        refspec=chosen[0], hint=f"the repository's default branch does not exist: {branch} was taken instead"
    )


def _by_hash(refs: dict[str, str], commit: str) -> WantedRevision:
    if len(commit) >= _TELLING_HASH:
        for name, tip in refs.items():
            if tip.startswith(commit):
                # a server lists `v1^{}`, but sends it by no other name than `v1`
                return WantedRevision(refspec=name.removesuffix("^{}"))
    return WantedRevision(commit=commit)


_PRIVATE = (
    "If it is private, store its credentials with git first: `git ls-remote URL` must work without asking."
)
_NETWORK = "Check the address and the network, and try `git ls-remote URL`."
_PAGE = "This looks like a page of the website: give the repository's own address, then @branch."


class Cause(NamedTuple):
    """What a pattern of git's words means, what to do, and whose fault it is: the network's passes by itself."""

    pattern: str
    cause: str
    hint: str
    fault_of: Literal["submission", "machine", "network"] = "submission"


# In this order: the first that fits what git said is the cause.
_CAUSES = (
    Cause(r"^prlimit: ", "the limits of git cannot be set on this machine",
          "Raise what this shell allows (`ulimit -Ha` shows it).", "machine"),
    Cause(r"invalid path", "it holds a path that git itself does not write (`.git`, `..`)",
          "Take it out of the repository, commit and push."),
    Cause(r"No space left", "it could not be written to this machine's disk",
          "Free some room (`df -h`) and try again.", "machine"),
    Cause(r"(?:error: |HTTP (?:code )?)(?:429|5\d\d)\b", "the server has failed, or has too much to do",
          "Try again later.", "network"),
    Cause(r"Host key verification failed", "this machine does not know the server's ssh key",
          "Connect once by hand (`ssh HOST`) and accept the key.", "machine"),
    Cause(r"Permission denied|publickey", "the server refused the ssh key",
          "Add a key of this machine to the account (`ssh -T git@HOST` shows it), or use the https:// address."),
    Cause(r"Could not resolve host|Couldn't resolve host|Name or service not known|Temporary failure in name",
          "the server's name was not found", _NETWORK, "network"),
    Cause(r"Connection refused|Connection timed out|Failed to connect|Network is unreachable"
          r"|No route to host|Couldn't connect|unable to connect|Operation timed out",
          "the server cannot be reached", _NETWORK, "network"),
    Cause(r"Connection (was )?reset|Connection closed by|SSL_read|SSL_ERROR_SYSCALL|recv error|early EOF"
          r"|Empty reply|transfer closed|unexpected disconnect|HTTP/2 stream|Broken pipe",
          "the connection broke off", _NETWORK, "network"),
    Cause(r"SSL|certificate", "the server's certificate is not trusted by this machine",
          "Ask for the server's certificate to be installed, or use the ssh address.", "machine"),
    Cause(r"could not read (Username|Password)|terminal prompts disabled|Authentication failed"
          r"|Access denied|error: 40[13]|HTTP 40[13]", "it does not exist, or it needs a password", _PRIVATE),
    Cause(r"not found|does not exist|does not appear to be a git repository|not a git repository|error: 404"
          r"|not valid: is this a git|[Nn]o such (file|repository|project)", "there is no such repository",
          f"Check the address. {_PRIVATE}"),
    Cause(r"unable to write|cannot create|could not create", "it could not be written to this machine's disk",
          "Free some room (`df -h`) and try again.", "machine"),
    Cause(r"RPC failed|hung up unexpectedly", "the connection broke off", _NETWORK, "network"),
)  # fmt: skip


def explained(failure: GitFailed, source: Source) -> SubmissionError:
    """Return the error to raise for what git said about `source`."""
    if isinstance(failure, GitMissing):
        return Unreachable(
            f"{source.given}: git is not installed here, so no repository can be read",
            hint="Install it (`sudo apt install git`), or give a folder or an archive.",
        )
    if isinstance(failure, GitTimeout):
        return Unreachable(
            f"{source.given}: {failure.stderr}",
            hint="Check the network, or clone it by hand and give the folder.",
        )
    if isinstance(failure, GitTooMuch):
        return SubmissionError(
            f"{source.given}: the repository is larger than a lab's submission may be",
            hint="Hand in the package's folder alone, without recordings and data.",
        )
    if known := _cause(failure):
        page = re.search(r"/(tree|blob)/|/-/", source.url)
        kind = SubmissionError if known.fault_of == "submission" else Unreachable
        return kind(f"{source.given}: {known.cause}", hint=_PAGE if page else known.hint)
    return SubmissionError(f"{source.given}: git says: {error_line(failure, source)}", hint=_NETWORK)


def may_pass(failure: GitFailed) -> bool:
    """Return whether the same may go well a little later: the network or the server has failed."""
    if isinstance(failure, GitMissing | GitTimeout | GitTooMuch):
        return isinstance(failure, GitTimeout)
    known = _cause(failure)
    return known is not None and known.fault_of == "network"


def _cause(failure: GitFailed) -> Cause | None:
    """Return the first that fits what git said."""
    return next((one for one in _CAUSES if re.search(one.pattern, failure.stderr)), None)


def error_line(failure: GitFailed, source: Source) -> str:
    """Return the line of git's that names the cause, without a password that the address may hold."""
    lines = [line.strip() for line in failure.stderr.splitlines() if line.strip()]
    fatal = [line for line in lines if line.startswith(("fatal:", "error:", "remote:"))]
    line = (fatal or lines or ["nothing"])[-1].removeprefix("fatal: ").removeprefix("error: ")
    for url in {source.url, without_password(source.url)} - {""}:
        line = line.replace(url, source.given)
    return brief(line)
