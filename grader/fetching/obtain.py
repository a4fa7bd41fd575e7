"""One entry of a roster: its source brought here, and the commit of it that counts."""

from __future__ import annotations

import shutil
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from grader.errors import OutputError, SubmissionError
from grader.fetching.cache import Place, State, cache_folder, locked, name_of, tidy_now_and_then
from grader.fetching.history import Commit, Rule, choose, not_chosen
from grader.fetching.mirror import Listing, Mirror
from grader.fetching.patience import GivenUp, Patience, error_of, patiently
from grader.intake import unreadable
from grader.intake.credentials import split_address
from grader.intake.explain import may_pass
from grader.intake.git import Git, GitFailed, GitMissing, GitTimeout, GitTooMuch
from grader.intake.names import brief, printable
from grader.intake.refs import Wanted, choose_ref, no_such_ref
from grader.intake.repository import served
from grader.intake.source import Source, as_repository, parse_source, with_ref
from grader.intake.tree import is_there
from grader.model.handed_in import HandedIn
from grader.model.roster import Entry

GIT_TIMEOUT_S = 120.0
"""For everything that git does in one try."""


@dataclass(frozen=True, kw_only=True)
class Obtained:
    """`source` lies on this machine and can be opened as it is; its `given` and `name` are the roster's.

    Of a repository it is a copy of the one commit that counts, below the `workdir`. `hints` are those that an opened
    submission does not have by itself.
    """

    source: Source
    handed_in: HandedIn
    hints: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Task:
    """What to bring here. What was fetched after `since` (seconds since 1970) need not be fetched again."""

    source: Source
    entry: Entry
    rule: Rule
    since: float
    patience: Patience
    uncommitted: bool = False


def obtain(
    entry: Entry,
    rule: Rule,
    *,
    workdir: Path,
    fetched_since: float = 0.0,
    patience: Patience | None = None,
) -> Obtained:
    """The source of `entry`, and when it was handed in. New folders are made in `workdir`, which is the caller's.

    A repository that was fetched after `fetched_since` (seconds since 1970) is not fetched again; with 0 it is in any
    case. What the network fails at is tried again with `patience`.

    Raises what `open_submission` raises, and NothingInTime where no commit is old enough.
    """
    source = source_of(entry)
    is_clone = source.kind == "folder" and source.path is not None and is_there(source.path / ".git")
    uncommitted = is_clone and rule.is_any
    if source.kind != "repository" and not uncommitted:
        return Obtained(source=source, handed_in=not_chosen(rule, entry))
    task = Task(
        source=as_repository(source) if uncommitted else source,
        entry=entry,
        rule=rule,
        since=fetched_since or time.time(),
        patience=patience or Patience(),
        uncommitted=uncommitted,
    )
    try:
        with _room(workdir) as room:
            try:
                here = served(task.source, git_in(room), room / "view")
            except SubmissionError as error:
                if not uncommitted:
                    raise
                note = f"its history cannot be read, so all of the folder counts ({error.message})"
                return Obtained(source=source, handed_in=not_chosen(rule, entry, note=note))
            return _from_repository(replace(task, source=here), room)
    except GitFailed as failure:
        raise error_of(failure, source) from None
    except OSError as error:
        raise unreadable(source.given, error) from error


def source_of(entry: Entry) -> Source:
    """What the entry names. Raises UsageError, SubmissionError."""
    try:
        return with_ref(parse_source(entry.source), entry.ref)
    except OSError as error:
        raise unreadable(printable(entry.source), error) from error


def bring_up_to_date(place: Place, task: Task, room: Path) -> tuple[Mirror, Listing]:
    """The mirror in `place`, as the server has it now, or had it after `task.since`.

    Raises GivenUp, or GitFailed where the mirror may be damaged as well.
    """
    state = place.state()
    mirror = Mirror(source=task.source, path=place.mirror, room=room, git=git_in(room))
    if state is not None and task.since <= state.fetched_at <= time.time() + 1:
        place.used()
        return mirror, Listing(state.listing)
    if state is None:
        place.clear()

    def ask() -> tuple[Mirror, Listing, float]:
        fresh = replace(mirror, git=git_in(room))
        asked_at = time.time()
        listing = _listing(fresh)
        if listing.refs and (state is None or listing.text != state.listing):
            place.incomplete()
            fresh.fetch(listing)
        return fresh, listing, asked_at

    asked, listing, asked_at = patiently(ask, task.patience)
    if listing.refs:
        place.complete(State(fetched_at=asked_at, listing=listing.text))
    return asked, listing


def _listing(mirror: Mirror) -> Listing:
    """Raises GivenUp where asking again does not help: that is no fault of the mirror's."""
    try:
        return mirror.listing()
    except GitFailed as failure:
        if may_pass(failure):
            raise
        raise GivenUp(failure, 1) from None


def git_in(room: Path) -> Git:
    """git with all its time before it."""
    return Git(room / "git-home", timeout_s=GIT_TIMEOUT_S)


def place_name(source: Source) -> str:
    """The name of the mirror for a remote source."""
    return name_of(split_address(source.url)[0])


@contextmanager
def _room(workdir: Path) -> Iterator[Path]:
    """A new folder in `workdir`, of which only `commit.git` stays, and nothing at all after an error."""
    try:
        workdir.mkdir(parents=True, exist_ok=True)
        room = Path(tempfile.mkdtemp(prefix="fetched-", dir=workdir)).resolve()
    except OSError as error:
        raise OutputError(
            f"the work folder {workdir} cannot be written: {error.strerror}", hint="Choose another folder."
        ) from error
    try:
        yield room
    except BaseException:
        shutil.rmtree(room, ignore_errors=True)
        raise
    for path in room.iterdir():
        if path.name != "commit.git":
            shutil.rmtree(path, ignore_errors=True)


def _from_repository(task: Task, room: Path) -> Obtained:
    try:
        with ExitStack() as stack:
            place = _place(task.source, room, stack)
            kept = place.state() is not None
            try:
                return _commit_of(place, task, room)
            except GitFailed as failure:
                if not kept or isinstance(failure, GitMissing | GitTimeout | GitTooMuch):
                    raise
            place.clear()  # it may be damaged
            shutil.rmtree(room / "commit.git", ignore_errors=True)
            return _commit_of(place, task, room)
    except GitTooMuch as failure:
        if _needs_history(task):
            raise error_of(failure, task.source) from None
        return _alone(task, room)
    except (GitFailed, GivenUp) as problem:
        raise error_of(problem, task.source) from None


def _place(source: Source, room: Path, stack: ExitStack) -> Place:
    """In the cache for what is far away; in the room for what is here, and where there is no cache."""
    folder = cache_folder() if source.remote else None
    if folder is not None:
        tidy_now_and_then(folder)
        try:
            return stack.enter_context(locked(folder / place_name(source)))
        except OSError:
            pass
    alone = room / "mirror"
    alone.mkdir()
    return Place(alone)


def _commit_of(place: Place, task: Task, room: Path) -> Obtained:
    mirror, listing = bring_up_to_date(place, task, room)
    wanted = choose_ref(listing.refs, task.source.ref, given=task.source.given)
    tip = patiently(lambda: mirror.commit(listing, wanted), task.patience)
    if tip is None:
        raise no_such_ref(listing.refs, task.source.ref or "HEAD", given=task.source.given)
    commit, handed_in = _chosen(mirror, listing, wanted, tip, task)
    mirror.copy(commit.hash, room / "commit.git")
    return _obtained(task, commit, handed_in, wanted, room)


def _chosen(
    mirror: Mirror, listing: Listing, wanted: Wanted, tip: str, task: Task
) -> tuple[Commit, HandedIn]:
    branch = branch_of(listing, task.source.ref, wanted)
    with mirror.history(tip) as commits:
        if branch is None:
            commit = next(commits)
            note = f"the roster names {brief(task.source.ref or '')}: {commit}" if task.rule.is_any else ""
            return commit, not_chosen(task.rule, task.entry, commit.at, note)
        commit, handed_in = choose(
            commits, rule=task.rule, entry=task.entry, branch=branch, given=task.source.given
        )
    if task.uncommitted:
        note = f"{handed_in.note}; changes that are not committed do not count"
        handed_in = handed_in.model_copy(update={"note": note})
    return commit, handed_in


def branch_of(listing: Listing, ref: str | None, wanted: Wanted) -> str | None:
    """The branch whose commits are looked at; None where somebody chose a tag or a commit."""
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


def _needs_history(task: Task) -> bool:
    return task.rule.is_any


def _alone(task: Task, room: Path) -> Obtained:
    """What is too much with its history, without it."""
    source = task.source
    shutil.rmtree(room / "commit.git", ignore_errors=True)

    def ask() -> tuple[Mirror, Listing, Wanted]:
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
    return _obtained(task, commit, not_chosen(task.rule, task.entry, commit.at), wanted, room)


def _obtained(task: Task, commit: Commit, handed_in: HandedIn, wanted: Wanted, room: Path) -> Obtained:
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
