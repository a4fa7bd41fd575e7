"""A repository's heads and tags in a bare repository of our own, which knows no address and no settings but ours.

`bring_up_to_date` fetches it once for all who need it; what the network fails at is tried again with `Patience`.

Mirrors are in a folder of the grader's user that no one else can enter, each used by one at a time:
`<cache>/grader/repositories/<sum of the address>/` holds `lock`, `mirror.git` and `state.json`. The state is written
when the mirror is complete, and its time of change says when the mirror was used last.
"""

from __future__ import annotations

import hashlib
import json
import os
import random
import re
import shutil
import stat
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeVar

from grader.classes.fetching.history import Commit, read_commit
from grader.errors import SubmissionError
from grader.files import lock, open_lock, user_folder, wait_for_lock
from grader.intake.credentials import split_address
from grader.intake.git import Git, GitFailed, Repository
from grader.intake.repository import WantedRevision, ask, explained, may_pass, parse_refs
from grader.intake.source import Source
from grader.portable import CLOEXEC, DIRECTORY, NOFOLLOW, user_id

BYTES_MAX = 4 << 30
TIDY_EVERY_S = 30.0
UNFINISHED_S = 3600.0
_FOLDER = os.O_RDONLY | DIRECTORY | NOFOLLOW | CLOEXEC


@dataclass(frozen=True, kw_only=True)
class MirrorState:
    """`fetched_at` in seconds since 1970, before the server was asked; `listing` is what it said that it has."""

    fetched_at: float
    listing: str


@dataclass(frozen=True)
class MirrorFolder:
    """The folder of one mirror."""

    folder: Path

    @property
    def mirror(self) -> Path:
        return self.folder / "mirror.git"

    # Read and written by hand: names of refs may hold bytes that are no UTF-8, which pydantic refuses.

    def state(self) -> MirrorState | None:
        """Return what the mirror was filled with; None where it is not complete."""
        try:
            data = json.loads((self.folder / "state.json").read_bytes())
            found = MirrorState(fetched_at=float(data["fetched_at"]), listing=str(data["listing"]))
        except (OSError, ValueError, TypeError, KeyError, RecursionError):
            return None
        return found if self.mirror.is_dir() else None

    def complete(self, state: MirrorState) -> None:
        """Say that the mirror is what the server said."""
        data = {"fetched_at": state.fetched_at, "listing": state.listing, "bytes": _size(self.mirror)}
        beside = self.folder / "state.json.new"
        beside.write_text(json.dumps(data), encoding="utf-8")
        beside.replace(self.folder / "state.json")

    def used(self) -> None:
        with suppress(OSError):
            os.utime(self.folder / "state.json")

    def incomplete(self) -> None:
        (self.folder / "state.json").unlink(missing_ok=True)

    def clear(self) -> None:
        self.incomplete()
        shutil.rmtree(self.mirror, ignore_errors=True)


def cache_folder() -> Path | None:
    """Return the folder for all mirrors; None where it cannot be had for this user alone."""
    own = user_folder("cache")
    if not own.is_absolute():
        return None
    with suppress(OSError):
        own.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        if _is_own(own) and _is_own(own / "repositories"):
            return own / "repositories"
    return None


@contextmanager
def locked(folder: Path) -> Iterator[MirrorFolder]:
    """Hold the place of a mirror, once no one else uses it. Raises OSError where it cannot be had or locked."""
    descriptor = _take_lock(folder, wait=True)
    assert descriptor is not None  # noqa: S101 - waited for
    try:
        yield MirrorFolder(folder)
    finally:
        os.close(descriptor)


def tidy(folder: Path, bytes_max: int = BYTES_MAX) -> None:
    """Remove those that were used least recently, until all together are at most `bytes_max`; none that is in use."""
    known = []
    for entry in os.scandir(folder):
        with suppress(OSError, ValueError, TypeError, KeyError):
            known.append((*_used_and_size(Path(entry.path)), Path(entry.path)))
    left = sum(size for _, size, _ in known)
    for used_at, size, path in sorted(known):
        # a fetch that was killed left it, or one that still runs, which is given time
        unfinished = size == 0 and used_at < time.time() - UNFINISHED_S
        if (left > bytes_max or unfinished) and _remove_unused(path):
            left -= size


class _Tidied:
    at = -TIDY_EVERY_S


def tidy_now_and_then(folder: Path) -> None:
    """Do as `tidy`, if it was not done a moment ago: it takes time to look at all of them."""
    if time.monotonic() - _Tidied.at >= TIDY_EVERY_S:
        _Tidied.at = time.monotonic()
        with suppress(OSError):
            tidy(folder)


def _used_and_size(folder: Path) -> tuple[float, int]:
    """Return when a mirror was used last, and its size in bytes, 0 if it is not complete."""
    state = folder / "state.json"
    try:
        return state.stat().st_mtime, max(1, int(json.loads(state.read_bytes())["bytes"]))
    except (FileNotFoundError, ValueError):
        return folder.stat().st_mtime, 0


def _remove_unused(folder: Path) -> bool:
    """Return whether it is gone. What is in use stays."""
    with suppress(OSError):
        descriptor = _take_lock(folder, wait=False)
        if descriptor is None:
            return False
        try:
            MirrorFolder(folder).clear()
            shutil.rmtree(folder)
        finally:
            os.close(descriptor)
        return True
    return False


def _take_lock(folder: Path, *, wait: bool) -> int | None:
    """Return the descriptor of the lock; None if it is held and not waited for. The lock may be removed together with
    its folder before it is locked: then a new one is made."""
    while True:
        with suppress(FileNotFoundError):
            folder.mkdir(mode=0o700, exist_ok=True)
            if not _is_own(folder):
                raise PermissionError(f"{folder} belongs to another user")
            descriptor = open_lock(folder / "lock")
            try:
                if wait:
                    wait_for_lock(descriptor)
                elif not lock(descriptor):
                    os.close(descriptor)
                    return None
                if os.path.samestat(os.fstat(descriptor), (folder / "lock").stat()):
                    return descriptor
            except BaseException:
                os.close(descriptor)
                raise
            os.close(descriptor)


def _is_own(folder: Path) -> bool:
    """Return whether that folder, made where it is missing, belongs to this user and is closed to everybody else."""
    folder.mkdir(mode=0o700, exist_ok=True)
    descriptor = os.open(folder, _FOLDER)
    try:
        status = os.fstat(descriptor)
        if status.st_uid != user_id():
            return False
        if stat.S_IMODE(status.st_mode) != stat.S_IRWXU:
            os.fchmod(descriptor, stat.S_IRWXU)
        return True
    finally:
        os.close(descriptor)


def _size(folder: Path) -> int:
    """Return the room that it takes on the disk, in bytes."""
    places = (Path(place) / name for place, _, names in os.walk(folder) for name in names)
    return sum(place.lstat().st_blocks * 512 for place in places)


_EVERYTHING = ("+refs/heads/*:refs/heads/*", "+refs/tags/*:refs/tags/*")
# `--update-head-ok`: a fetch writes to the branch of HEAD, too
_FETCH = ("fetch", "--quiet", "--no-tags", "--no-recurse-submodules", "--update-head-ok")
_WHOLE_HASHES = (40, 64)
# A log of its refs would name the address.
# a copy is made of one commit, by its hash (`Mirror.copy`)
_SETTINGS = "[uploadpack]\n\tallowAnySHA1InWant = true\n[core]\n\tlogAllRefUpdates = false\n"
_NO_COMMIT = re.compile(r"expected commit type|is ambiguous")
# first parents are the states that the branch had; those that were merged into it are not
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
        # `ref: refs/heads/main<TAB>HEAD`, which `--symref` adds
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
        """Return what the server has. It is asked from a new repository: the folder one stands in may have settings."""
        asking = self.room / "asking.git"
        if not asking.exists():
            self._begin(asking, sha256=False)
        repository = Repository(git_dir=asking, top=asking)
        return Listing(
            os.fsdecode(ask(self.source, self.git, repository, ("ls-remote", "--quiet", "--symref")))
        )

    def fetch(self, listing: Listing) -> None:
        """Fetch all heads and tags, and remove those that are no longer there."""
        refs = listing.refs
        sha256 = any(len(commit) == _WHOLE_HASHES[1] for commit in refs.values())
        config = self.path / "config"
        # a repository has one kind of hashes for ever, and its owner may have made it again with the other
        was_sha256 = config.is_file() and "sha256" in config.read_text(encoding="utf-8", errors="replace")
        if sha256 != was_sha256 or not (self.path / "HEAD").is_file():
            self._begin(self.path, sha256=sha256)
        for left in self.path.glob("objects/pack/tmp_*"):  # of one that was killed
            left.unlink()
        self._fetch(("--prune",), *_EVERYTHING)
        if listing.head in refs and str(listing.head).startswith("refs/heads/"):
            self._run("symbolic-ref", "HEAD", str(listing.head))

    def fetch_alone(self, listing: Listing, wanted: WantedRevision) -> None:
        """Fetch one commit without its history."""
        sha256 = any(len(commit) == _WHOLE_HASHES[1] for commit in listing.refs.values())
        self._begin(self.path, sha256=sha256)
        self._fetch(("--depth=1",), str(wanted.refspec or wanted.commit))

    def commit(self, listing: Listing, wanted: WantedRevision) -> str | None:
        """Return the full hash of what is wanted, fetched where no branch or tag reaches it; None if there is none."""
        name = listing.refs[wanted.refspec] if wanted.refspec else str(wanted.commit)
        found = self._commit_of(name)
        if found is None and (wanted.refspec or len(name) in _WHOLE_HASHES):
            try:
                self._fetch((), wanted.refspec or name)
            except GitFailed as failure:
                if wanted.refspec or not _is_unknown(failure):
                    raise
            found = self._commit_of(name)
        return found

    @contextmanager
    def history(self, commit: str) -> Iterator[Iterator[Commit]]:
        """Give the commit and its first parents, the newest first."""
        records = self.git.records(*_LOG, commit, "--", cwd=self.path, repository=self.repository)
        with closing(records):
            yield (read_commit(record.decode("ascii", "replace")) for record in records if record)

    def copy(self, commit: str, into: Path) -> None:
        """Write that commit alone into a new repository, which reads and so proves every file of it."""
        self._begin(into, sha256=len(commit) == _WHOLE_HASHES[1])
        self.git.run(
            *(*_FETCH, "--depth=1", "--", self.path.as_uri(), f"{commit}:refs/heads/submission"),
            cwd=into,
            repository=Repository(git_dir=into, top=into),
        )
        (into / "FETCH_HEAD").unlink(missing_ok=True)

    def is_cut_off(self) -> bool:
        """Return whether history ends where its owner's clone does."""
        return (self.path / "shallow").is_file()

    def _begin(self, folder: Path, *, sha256: bool) -> None:
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir()
        form = ("--object-format=sha256",) if sha256 else ()
        self.git.run("init", "--quiet", "--bare", "--template=", *form, ".", cwd=folder)
        with (folder / "config").open("a", encoding="utf-8") as config:
            config.write(_SETTINGS)

    def _fetch(self, options: tuple[str, ...], *refspecs: str) -> None:
        try:
            ask(self.source, self.git, self.repository, (*_FETCH, "--update-shallow", *options), *refspecs)
        finally:
            with suppress(OSError):
                (self.path / "FETCH_HEAD").unlink()  # it names the address

    def _commit_of(self, name: str) -> str | None:
        try:
            return self._run("rev-parse", "--verify", "--quiet", f"{name}^{{commit}}")
        except GitFailed as failure:
            # in silence it says that there is none; what it says aloud is of damage
            if failure.stderr.strip() and not _NO_COMMIT.search(failure.stderr):
                raise
            return None

    def _run(self, *args: str) -> str:
        return (
            self.git.run(*args, cwd=self.path, repository=self.repository).decode("ascii", "replace").strip()
        )


def _is_unknown(failure: GitFailed) -> bool:
    """Return whether the server says that it does not have the commit, or does not give it."""
    signs = (
        "not our ref",
        "no such remote ref",
        "unadvertised object",
        "couldn't find remote ref",
        "upload-pack",
    )
    return any(sign in failure.stderr.lower() for sign in signs)


GIT_TIMEOUT_S = 120.0
"""For everything that git does in one try."""


def bring_up_to_date(
    place: MirrorFolder, source: Source, room: Path, *, since: float, patience: Patience
) -> tuple[Mirror, Listing]:
    """Return the mirror in `place`, as the server has it now, or had it after `since` (seconds since 1970).

    Raises GivenUp, or GitFailed where the mirror may be damaged as well.
    """
    state = place.state()
    mirror = Mirror(source=source, path=place.mirror, room=room, git=git_in(room))
    # a time in the future is that of a wrong clock, and would be believed for ever
    if state is not None and since <= state.fetched_at <= time.time() + 1:
        place.used()
        return mirror, Listing(state.listing)
    if state is None:
        place.clear()

    def ask() -> tuple[Mirror, MirrorState]:
        fresh = replace(mirror, git=git_in(room))
        asked_at = time.time()
        listing = _listing(fresh)
        if listing.refs and (state is None or listing.text != state.listing):
            # if this is killed while it fetches, the next one makes the mirror again
            place.incomplete()
            fresh.fetch(listing)
        return fresh, MirrorState(fetched_at=asked_at, listing=listing.text)

    mirror, state = patiently(ask, patience)
    listing = Listing(state.listing)
    if listing.refs:
        place.complete(state)
    return mirror, listing


def _listing(mirror: Mirror) -> Listing:
    """Ask the server what it has. Raises GivenUp where asking again does not help: no mirror is at fault then."""
    try:
        return mirror.listing()
    except GitFailed as failure:
        if may_pass(failure):
            raise
        raise GivenUp(failure, 1) from None


def git_in(room: Path) -> Git:
    """Return a new git, with all its time before it."""
    return Git(room / "git-home", timeout_s=GIT_TIMEOUT_S)


def place_name(source: Source) -> str:
    """Return the name of the mirror for a remote source."""
    address = split_address(source.url)[0]  # without the password
    return hashlib.sha256(os.fsencode(address)).hexdigest()


Answer = TypeVar("Answer")


@dataclass(frozen=True, kw_only=True)
class Patience:
    """How often something is tried, and how long it waits before: `wait_s`, then `growth` times as long each time.

    Each wait is up to half longer or shorter, so that a class does not come back to its server all at once.
    """

    tries: int = 3
    wait_s: float = 1.0
    growth: float = 4.0
    sleep: Callable[[float], None] = time.sleep
    chance: Callable[[], float] = random.random

    def wait(self, failed: int) -> None:
        """Wait after that many failures."""
        self.sleep(self.wait_s * self.growth ** (failed - 1) * (0.5 + self.chance()))


class GivenUp(Exception):
    """What may pass did not, as often as it was tried."""

    def __init__(self, failure: GitFailed, tries: int) -> None:
        super().__init__(failure.stderr)
        self.failure = failure
        self.tries = tries


def patiently(attempt: Callable[[], Answer], patience: Patience) -> Answer:
    """Return what `attempt` returns. Raises GivenUp, or the GitFailed that no waiting would help."""
    failed = 0
    while True:
        try:
            return attempt()
        except GitFailed as failure:
            failed += 1
            if not may_pass(failure):
                raise
            if failed >= patience.tries:
                raise GivenUp(failure, failed) from None
        patience.wait(failed)


def error_of(problem: GitFailed | GivenUp, source: Source) -> SubmissionError:
    """Return the error to raise, which says how often it was tried."""
    if isinstance(problem, GitFailed):
        return explained(problem, source)
    error = explained(problem.failure, source)
    again = f" (tried {problem.tries} times)" if problem.tries > 1 else ""
    return type(error)(f"{error.message}{again}", hint=error.hint)
