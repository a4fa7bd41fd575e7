"""Which commit counts, from a branch's commits and what the rubric and the roster say. Nothing here reads a file."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from datetime import datetime, timedelta, timezone
from typing import NamedTuple

from grader.errors import SubmissionError
from grader.intake.names import printable
from grader.model.batch import Entry
from grader.model.result import HandedIn
from grader.wording import join_words, plural

_RECORD = re.compile(r"(?P<hash>[0-9a-f]{40,64}) (?P<seconds>-?\d+)?(?: (?P<zone>[+-]\d{4}))?")
_EPOCH = datetime(1970, 1, 1, tzinfo=timezone.utc)
# days from the ends of what Python can hold, so that no time zone leads beyond them
_EARLIEST = datetime(1, 1, 3, tzinfo=timezone.utc)
_LATEST = datetime(9999, 12, 29, tzinfo=timezone.utc)
_ZONE_MAX = timedelta(hours=24)
_NEAR = timedelta(minutes=2)
BY_COMMIT = "by the commit's date, which its author's machine writes"


class NothingInTime(SubmissionError):
    """A repository in which no commit is old enough."""


class Commit(NamedTuple):
    """`at` is the committer's date, in the zone that stands in the commit."""

    hash: str
    at: datetime

    def __str__(self) -> str:
        return f"commit {self.hash[:7]} of {local_time(self.at)}"


@dataclass(frozen=True, kw_only=True)
class Rule:
    """What the rubric and the command line say. Times have a time zone.

    `deadline` is without an extension; `late` says that later work counts for less, `cut_off_days` until when.
    `before` (`--before`) takes the place of all these.
    """

    deadline: datetime | None = None
    late: bool = False
    cut_off_days: float | None = None
    before: datetime | None = None

    @property
    def is_any(self) -> bool:
        return self.deadline is not None or self.before is not None


class Limit(NamedTuple):
    """No commit after `at` counts. `name` says which time that is, `more` what was added to it."""

    at: datetime
    name: str
    more: str

    def __str__(self) -> str:
        return f"{self.name} {local_time(self.at)}{self.more}"


class ChosenCommit(NamedTuple):
    """The commit and how many commits of the branch are later than it."""

    commit: Commit
    later: int


def read_commit(record: str) -> Commit:
    """Parse `<hash> <seconds since 1970> <zone>` into a commit. Whatever its author wrote there becomes some time."""
    match = _RECORD.match(record)
    if match is None:
        return Commit(record[:40], _EPOCH)
    seconds = int(match["seconds"] or 0)
    try:
        at = _EPOCH + timedelta(seconds=seconds)
    except OverflowError:
        at = _LATEST if seconds > 0 else _EARLIEST
    return Commit(match["hash"], min(max(at, _EARLIEST), _LATEST).astimezone(_zone(match["zone"])))


def _zone(text: str | None) -> timezone:
    text = text or "+0000"
    offset = timedelta(hours=int(text[1:3]), minutes=int(text[3:5]))
    if offset >= _ZONE_MAX:  # Python has no such zone
        return timezone.utc
    return timezone(-offset if text.startswith("-") else offset)


def limit_of(rule: Rule, entry: Entry) -> Limit | None:
    """Return the time after which nothing of this entry counts; None where there is no such time."""
    days = entry.extension_days
    added = [f"{plural(days, 'day')} of extension"] if days else []
    if rule.before is None and entry.late_days:
        days += entry.late_days
        added.append(f"up to {plural(entry.late_days, 'late day')}")
    more = f" (with {join_words(added)})" if added else ""
    if rule.before is not None:
        return Limit(later(rule.before, days), "the time asked for", more)
    if rule.deadline is None:
        return None
    if not rule.late:
        return Limit(later(rule.deadline, days), "the deadline", more)
    if rule.cut_off_days is None:
        return None
    return Limit(later(rule.deadline, days + rule.cut_off_days), "the last time for late work", more)


def later(time: datetime, days: float) -> datetime:
    """Return the time that many days later, or the end of time."""
    time = time.astimezone() if time.tzinfo is None else time
    try:
        return time + timedelta(days=days)
    except OverflowError:
        return _LATEST


def not_chosen(rule: Rule, entry: Entry, at: datetime | None = None, note: str = "") -> HandedIn:
    """Return when it was handed in, for what is graded as it is; `at` is its commit's date."""
    said = entry.submitted_at or at
    return HandedIn(
        at=said,
        by="roster" if entry.submitted_at else "commit" if said else "nobody",
        deadline=later(rule.deadline, entry.extension_days) if rule.deadline else None,
        extension_days=entry.extension_days,
        late_days=entry.late_days,
        note=note,
    )


def choose_commit(
    commits: Iterable[Commit], *, rule: Rule, entry: Entry, branch: str, given: str
) -> tuple[Commit, HandedIn]:
    """Return the commit of a branch that counts, and what to say of it. `commits` are the branch's, the newest
    first, at least one.

    Raises NothingInTime where none is old enough.
    """
    limit = limit_of(rule, entry)
    as_it_is = not_chosen(rule, entry)
    walk = iter(commits)
    tip = next(walk)
    submitted = entry.submitted_at
    if submitted is not None and rule.is_any and (limit is None or submitted <= limit.at):
        found, _ = _last(tip, walk, submitted)
        note = _by_roster(found, tip, submitted, branch, limit)
        by_roster = as_it_is.model_copy(update={"before": limit.at if limit else None, "note": note})
        return (found.commit if found else tip), by_roster
    if limit is None:
        note = f"{tip} is the last one on {printable(branch)}" if rule.is_any else ""
        return tip, as_it_is.model_copy(
            update={"at": as_it_is.at or tip.at, "by": "roster" if submitted else "commit", "note": note}
        )
    found, oldest = _last(tip, walk, limit.at)
    if found is None:
        raise NothingInTime(
            f"{given}: no commit on {printable(branch)} is from before {limit}",
            hint=f"The first one is of {local_time(oldest.at)} ({BY_COMMIT}).",
        )
    handed_in = as_it_is.model_copy(
        update={
            "at": found.commit.at,
            "by": "commit",
            "before": limit.at,
            "note": _by_commit(found, branch, limit, submitted),
        }
    )
    return found.commit, handed_in


def _last(tip: Commit, rest: Iterator[Commit], time: datetime) -> tuple[ChosenCommit | None, Commit]:
    """Return the newest commit that is not dated after `time` (None if there is none), and the oldest one looked at."""
    commit, later_ones = tip, 0
    # In the branch's order, not sorted by date: a wrong clock must not bring an older state of the work before a newer.
    while commit.at > time:
        following = next(rest, None)
        if following is None:
            return None, commit
        commit, later_ones = following, later_ones + 1
    return ChosenCommit(commit, later_ones), commit


def _by_commit(found: ChosenCommit, branch: str, limit: Limit, submitted: datetime | None) -> str:
    at = _beside(found.commit.at, limit.at)
    text = f"commit {found.commit.hash[:7]} of {at} is the last one on {printable(branch)} before {limit}"
    if submitted is not None:
        text += f"; the roster says that it was submitted later, {local_time(submitted)}"
    return f"{text}{_later_ones(found.later)}; {BY_COMMIT}"


def _by_roster(
    found: ChosenCommit | None, tip: Commit, submitted: datetime, branch: str, limit: Limit | None
) -> str:
    before = f", before {limit}" if limit else ""
    if found is None:
        return (
            f"{tip} is the last one on {printable(branch)}; the roster says that it was submitted "
            f"{local_time(submitted)}{before}, and all commits are dated later than that: "
            "its author's clock may be wrong"
        )
    at = _beside(found.commit.at, submitted)
    return (
        f"commit {found.commit.hash[:7]} of {at} is the last one on {printable(branch)} when it was submitted, "
        f"{local_time(submitted)} as the roster says{before}{_later_ones(found.later)}"
    )


def _later_ones(count: int) -> str:
    if not count:
        return ""
    return f"; {count} later {'commit does' if count == 1 else 'commits do'} not count"


def _beside(time: datetime, other: datetime) -> str:
    """Return the time in the other's zone, so that both can be compared, with seconds if they are close together."""
    try:
        time = time.astimezone(other.tzinfo)
    except OverflowError:
        return local_time(time)
    return local_time(time, seconds=abs(time - other) < _NEAR)


def local_time(time: datetime, *, seconds: bool = False) -> str:
    """Return the time as `2026-10-30 21:14 +01:00`."""
    zone = time.strftime("%z")
    zone = f"{zone[:3]}:{zone[3:5]}" if zone else ""
    date = f"{time.year:04}-{time.month:02}-{time.day:02}"
    clock = f"{time.hour:02}:{time.minute:02}" + (f":{time.second:02}" if seconds else "")
    return f"{date} {clock} {zone}".rstrip()
