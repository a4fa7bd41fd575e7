"""A mirror is brought up to date with its server, once for all who need it."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from pathlib import Path

from grader.classes.fetching.cache import Failure, Place, State, name_of
from grader.classes.fetching.mirror import Listing, Mirror
from grader.classes.fetching.retry import GivenUp, Patience, patiently
from grader.intake.credentials import split_address
from grader.intake.git import Git, GitFailed, GitTimeout
from grader.intake.git_errors import may_pass
from grader.intake.source import Source

GIT_TIMEOUT_S = 120.0
"""For everything that git does in one try."""


@dataclass(frozen=True, kw_only=True)
class Errand:
    """What to bring here. What was fetched after `since` (seconds since 1970) need not be fetched again."""

    source: Source
    since: float
    patience: Patience


def bring_up_to_date(place: Place, errand: Errand, room: Path) -> tuple[Mirror, Listing]:
    """The mirror in `place`, as the server has it now, or had it after `errand.since`.

    Raises GivenUp, or GitFailed where the mirror may be damaged as well.
    """
    state = place.state()
    mirror = Mirror(source=errand.source, path=place.mirror, room=room, git=git_in(room))
    if state is not None and errand.since <= state.fetched_at <= time.time() + 1:
        place.used()
        return mirror, Listing(state.listing)
    if (failure := place.failure()) and errand.since <= failure.at <= time.time() + 1:
        kind = GitTimeout if failure.timeout else GitFailed
        raise GivenUp(kind(failure.said), failure.tries)
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

    try:
        asked, listing, asked_at = patiently(ask, errand.patience)
    except GivenUp as problem:
        if may_pass(problem.failure):
            place.failed(_without_address(problem, errand.source))
        raise
    if listing.refs:
        place.complete(State(fetched_at=asked_at, listing=listing.text))
    return asked, listing


def _without_address(problem: GivenUp, source: Source) -> Failure:
    """For the cache, in which no address is written down."""
    said = problem.failure.stderr.replace(split_address(source.url)[0], "…") if source.remote else ""
    timeout = isinstance(problem.failure, GitTimeout)
    return Failure(at=time.time(), said=said, tries=problem.tries, timeout=timeout)


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
