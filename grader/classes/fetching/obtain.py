"""One entry of a roster: its source brought here, and the commit of it that counts."""

from __future__ import annotations

import shutil
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from grader.classes.fetching.history import Commit, NothingInTime, Rule, choose_commit, not_chosen
from grader.classes.fetching.mirror import (
    GivenUp,
    Listing,
    Mirror,
    MirrorFolder,
    Patience,
    bring_up_to_date,
    cache_folder,
    error_of,
    git_in,
    locked,
    patiently,
    place_name,
    tidy_now_and_then,
)
from grader.errors import SubmissionError
from grader.intake.git import GitFailed, GitMissing, GitTimeout, GitTooMuch
from grader.intake.names import brief, printable
from grader.intake.open import new_folder, unreadable
from grader.intake.repository import WantedRevision, choose_ref, no_such_ref, served
from grader.intake.source import Source, as_repository, parse_source, with_ref
from grader.intake.tree import is_there
from grader.model.batch import Entry
from grader.model.result import HandedIn


@dataclass(frozen=True, kw_only=True)
class Obtained:
    """`source` lies on this machine and can be opened as it is; its `given` and `name` are the roster's.

    Of a repository it is a copy of the one commit that counts, below the `workdir`.
    """

    source: Source
    handed_in: HandedIn


@dataclass(frozen=True, kw_only=True)
class Task:
    """A repository to bring here. What was fetched after `since` (seconds since 1970) need not be fetched again. With
    `uncommitted`, it is a folder in which more may lie than what counts."""

    source: Source
    since: float
    patience: Patience
    entry: Entry
    rule: Rule
    uncommitted: bool = False


def obtain(
    entry: Entry,
    rule: Rule,
    *,
    workdir: Path,
    fetched_since: float = 0.0,
    patience: Patience | None = None,
    commit: str | None = None,
) -> Obtained:
    """Return the source of `entry`, and when it was handed in. New folders are made in `workdir`, the caller's.

    A repository that was fetched after `fetched_since` (seconds since 1970) is not fetched again; with 0 it is in any
    case. What the network fails at is tried again with `patience`. With `commit`, a full hash, that one counts of a
    repository, whatever the roster and the rule say.

    Raises what `open_submission` raises, and NothingInTime where no commit is old enough.
    """
    source = source_of(entry)
    if commit is not None and source.kind == "repository":
        source = replace(source, ref=commit)
    is_clone = source.kind == "folder" and source.path is not None and is_there(source.path / ".git")
    uncommitted = is_clone and rule.is_any
    if source.kind != "repository" and not uncommitted:
        return Obtained(source=source, handed_in=not_chosen(rule, entry))
    task = Task(
        source=as_repository(source) if uncommitted else source,
        since=fetched_since or time.time(),
        patience=patience or Patience(),
        entry=entry,
        rule=rule,
        uncommitted=uncommitted,
    )
    try:
        with _room(workdir) as room:
            return _from_repository(task, room)
    except _Unreadable as unread:
        note = f"its history cannot be read, so all of the folder counts ({unread})"
        return Obtained(source=source, handed_in=not_chosen(rule, entry, note=note))
    except OSError as error:
        raise unreadable(source.given, error) from error


class _Unreadable(Exception):
    """Why the history of a folder is not read."""


def source_of(entry: Entry) -> Source:
    """Return what the entry names, with what its roster says of modes. Raises UsageError, SubmissionError."""
    try:
        source = with_ref(parse_source(entry.source), entry.ref)
    except OSError as error:
        raise unreadable(printable(entry.source), error) from error
    return replace(source, modes="lost") if entry.modes_lost else source


@contextmanager
def _room(workdir: Path) -> Iterator[Path]:
    """Make a new folder in `workdir`, of which only `commit.git` stays, and nothing at all after an error."""
    with new_folder(workdir) as room:
        yield room
    for path in room.iterdir():
        if path.name != "commit.git":
            shutil.rmtree(path, ignore_errors=True)


def _from_repository(task: Task, room: Path) -> Obtained:
    """Return what a repository holds. Raises _Unreadable for a folder with a `.git` that is not to be read."""
    try:
        here = _serve_local(task, room)
        return _through_mirror(replace(task, source=here), room)
    except GitTooMuch as failure:
        if task.rule.is_any:
            raise error_of(failure, task.source) from None
        return _without_history(task, room)
    except (GitFailed, GivenUp) as problem:
        raise error_of(problem, task.source) from None


def _serve_local(task: Task, room: Path) -> Source:
    try:
        return served(task.source, git_in(room), room / "view")
    except SubmissionError as error:
        if task.uncommitted:
            raise _Unreadable(error.message) from None
        raise


def _through_mirror(task: Task, room: Path) -> Obtained:
    """Return the commit that counts, by way of a mirror. One that seems to be damaged is made again."""
    with ExitStack() as stack:
        place = _mirror_folder(task.source, room, stack)
        kept = place.state() is not None
        try:
            return _commit_of(place, task, room)
        except GitFailed as failure:
            # none of these would go better with a new mirror
            if not kept or isinstance(failure, GitMissing | GitTimeout | GitTooMuch):
                raise
        place.clear()
        shutil.rmtree(room / "commit.git", ignore_errors=True)
        return _commit_of(place, task, room)


def _mirror_folder(source: Source, room: Path, stack: ExitStack) -> MirrorFolder:
    """Return the mirror's place: in the cache for what is far away; else, and where there is no cache, in the room."""
    folder = cache_folder() if source.remote else None
    if folder is not None:
        tidy_now_and_then(folder)
        try:
            return stack.enter_context(locked(folder / place_name(source)))
        except OSError:  # the cache only saves time
            pass
    alone = room / "mirror"
    alone.mkdir()
    return MirrorFolder(alone)


def _commit_of(place: MirrorFolder, task: Task, room: Path) -> Obtained:
    mirror, listing = bring_up_to_date(place, task.source, room, since=task.since, patience=task.patience)
    wanted = choose_ref(listing.refs, task.source.ref, given=task.source.given)
    tip = patiently(lambda: mirror.commit(listing, wanted), task.patience)
    if tip is None:
        raise no_such_ref(listing.refs, task.source.ref or "HEAD", given=task.source.given)
    commit, handed_in = _choose_commit(mirror, listing, wanted, tip, task)
    mirror.copy(commit.hash, room / "commit.git")
    return _obtain_commit(task, commit, handed_in, wanted, room)


def _choose_commit(
    mirror: Mirror, listing: Listing, wanted: WantedRevision, tip: str, task: Task
) -> tuple[Commit, HandedIn]:
    branch = branch_of(listing, task.source.ref, wanted)
    with mirror.history(tip) as commits:
        if branch is None:
            commit = next(commits)
            note = f"the roster names {brief(task.source.ref or '')}: {commit}" if task.rule.is_any else ""
            return commit, not_chosen(task.rule, task.entry, commit.at, note)
        try:
            commit, handed_in = choose_commit(
                commits, rule=task.rule, entry=task.entry, branch=branch, given=task.source.given
            )
        except NothingInTime as error:
            if mirror.is_cut_off():
                error.hint += " Its history is cut off (a shallow clone): submit a full one."
            raise
    if task.uncommitted:
        note = f"{handed_in.note}; changes that are not committed do not count"
        handed_in = handed_in.model_copy(update={"note": note})
    return commit, handed_in


def branch_of(listing: Listing, ref: str | None, wanted: WantedRevision) -> str | None:
    """Return the branch whose commits are looked at; None where a tag or a commit is named."""
    refs = listing.refs
    if ref is None or ref == "HEAD":
        name = (listing.head if wanted.refspec == "HEAD" else wanted.refspec) or "HEAD"
    else:
        names = (f"refs/heads/{ref}", f"refs/tags/{ref}", f"refs/remotes/{ref}", ref)
        found = next((name for name in names if name in refs), None)
        if found is None or found.startswith("refs/tags/"):
            return None
        name = found
    return name.removeprefix("refs/heads/").removeprefix("refs/remotes/")


def _without_history(task: Task, room: Path) -> Obtained:
    """Return what is too much with its history, without it."""
    local = task.source.top is not None
    source = replace(task.source, url=(room / "view").as_uri()) if local else task.source
    shutil.rmtree(room / "commit.git", ignore_errors=True)

    def ask() -> tuple[Mirror, Listing, WantedRevision]:
        mirror = Mirror(source=source, path=room / "alone.git", room=room, git=git_in(room))
        listing = mirror.listing()
        wanted = choose_ref(listing.refs, source.ref, given=source.given)
        mirror.fetch_alone(listing, wanted)
        return mirror, listing, wanted

    try:
        mirror, listing, wanted = patiently(ask, task.patience)
        tip = mirror.commit(listing, wanted)
        if tip is None:
            raise no_such_ref(listing.refs, source.ref or "HEAD", given=source.given)
        with mirror.history(tip) as commits:
            commit = next(commits)
        mirror.copy(commit.hash, room / "commit.git")
    except (GitFailed, GivenUp) as problem:
        raise error_of(problem, task.source) from None
    return _obtain_commit(task, commit, not_chosen(task.rule, task.entry, commit.at), wanted, room)


def _obtain_commit(
    task: Task, commit: Commit, handed_in: HandedIn, wanted: WantedRevision, room: Path
) -> Obtained:
    copy = room / "commit.git"
    source = replace(
        task.source,
        path=copy,
        url=copy.as_uri(),
        ref=commit.hash,
        remote=False,
        top=copy,
        hints=(wanted.hint,) if wanted.hint else (),
    )
    return Obtained(source=source, handed_in=handed_in)
