"""The commit that counts, and what is said of it."""

from __future__ import annotations

from datetime import datetime, timedelta, timezone

import pytest

from grader.classes.fetching.history import NothingInTime, Rule, later, local_time, read_commit
from grader.errors import SubmissionError
from tests.classes.fetching.samples import DEADLINE, HOST, commit_at
from tests.intake.samples import commit, git, repository, write

CET = timezone(timedelta(hours=1))
DATES = {
    "first": "2026-10-01T10:00:00+01:00",
    "in time": "2026-10-30T21:14:05+01:00",
    "late": "2026-10-31T12:00:00+01:00",
    "later": "2026-11-02T12:00:00+01:00",
    "last": "2026-11-09T12:00:00+01:00",
}


def time(text: str) -> datetime:
    return datetime.fromisoformat(text)


@pytest.fixture
def commits(server):
    """The hash of each commit of `student`, by its name in DATES."""
    repo = server.new()
    found = {"first": git(repo, "rev-parse", "HEAD")}
    for name, date in DATES.items():
        if name != "first":
            found[name] = commit_at(repo, date, {"lab1/step": name})
    return found


def chosen(server, commits, rule, **fields):
    """The name of the commit that counts, and the record."""
    found = server.obtain(rule=rule, **fields)
    return next(name for name, value in commits.items() if value == found.source.ref), found.handed_in


@pytest.mark.full
@pytest.mark.parametrize(
    ("rule", "fields", "name", "before"),
    [
        (Rule(), {}, "last", None),
        (Rule(deadline=DEADLINE), {}, "in time", "2026-10-30T23:59:00+01:00"),
        (Rule(deadline=DEADLINE), {"extension_days": 0.5}, "in time", "2026-10-31T11:59:00+01:00"),
        (Rule(deadline=DEADLINE), {"extension_days": 1}, "late", "2026-10-31T23:59:00+01:00"),
        (Rule(deadline=DEADLINE, late=True), {}, "last", None),
        (Rule(deadline=DEADLINE, late=True, cut_off_days=3), {}, "later", "2026-11-02T23:59:00+01:00"),
        (
            Rule(deadline=DEADLINE, late=True, cut_off_days=3),
            {"extension_days": 7},
            "last",
            "2026-11-09T23:59:00+01:00",
        ),
        (Rule(deadline=DEADLINE, before=time(DATES["late"])), {}, "late", DATES["late"]),
        (Rule(before=time(DATES["late"]) - timedelta(seconds=1)), {}, "in time", "2026-10-31T11:59:59+01:00"),
        (Rule(deadline=DEADLINE, late=True, before=time(DATES["first"])), {}, "first", DATES["first"]),
        (Rule(before=time("2026-10-31T11:00:00+00:00")), {}, "late", "2026-10-31T11:00:00+00:00"),
    ],
)
def test_by_the_commit_s_date(rule, fields, name, before, *, commits, server):
    found, handed_in = chosen(server, commits, rule, **fields)
    assert found == name
    assert (handed_in.at, handed_in.by) == (time(DATES[name]), "commit")
    assert handed_in.before == (time(before) if before else None)
    extension = timedelta(days=fields.get("extension_days", 0))
    assert handed_in.deadline == (rule.deadline + extension if rule.deadline else None)


def test_the_note_says_what_was_done(commits, server):
    _, handed_in = chosen(server, commits, Rule(deadline=DEADLINE), extension_days=0.5)
    assert handed_in.note == (
        f"commit {commits['in time'][:7]} of 2026-10-30 21:14 +01:00 is the last one on main before the deadline "
        "2026-10-31 11:59 +01:00 (with 0.5 days of extension); 3 later commits do not count; by the commit's date, "
        "which its author's machine writes"
    )
    assert chosen(server, commits, Rule())[1].note == ""
    late = chosen(server, commits, Rule(deadline=DEADLINE, late=True, cut_off_days=3))[1].note
    assert "the last time for late work 2026-11-02 23:59 +01:00; 1 later commit does not count" in late
    near = chosen(server, commits, Rule(before=time("2026-10-30T20:15:00+00:00")))[1].note
    assert "of 2026-10-30 20:14:05 +00:00 is the last one on main before the time asked for" in near


@pytest.mark.full
@pytest.mark.parametrize(
    ("rule", "submitted", "name", "by", "words"),
    [
        (Rule(), "2026-10-30T22:00:00+01:00", "last", "roster", ""),
        (Rule(deadline=DEADLINE), "2026-10-30T22:00:00+01:00", "in time", "roster", "as the roster says"),
        (Rule(deadline=DEADLINE), "2026-10-02T00:00:00+01:00", "first", "roster", "4 later commits do not"),
        (Rule(deadline=DEADLINE), "2026-09-01T00:00:00+01:00", "last", "roster", "clock may be wrong"),
        (
            Rule(deadline=DEADLINE),
            "2026-11-01T00:00:00+01:00",
            "in time",
            "commit",
            "submitted later, 2026-11-01",
        ),
        (Rule(before=time(DATES["later"])), "2026-11-01T00:00:00+01:00", "late", "roster", "2 later commits"),
        (
            Rule(deadline=DEADLINE, late=True),
            "2026-11-01T00:00:00+01:00",
            "late",
            "roster",
            "when it was submitted, 2026-11-01 00:00 +01:00 as the roster says; 2 later",
        ),
    ],
)
def test_by_the_roster_s_time(rule, submitted, name, by, words, *, commits, server):
    found, handed_in = chosen(server, commits, rule, submitted_at=submitted)
    assert (found, handed_in.by) == (name, by)
    assert handed_in.at == (time(submitted) if by == "roster" else time(DATES[name]))
    assert words in handed_in.note
    assert "\n" not in handed_in.note


@pytest.mark.full
def test_a_commit_or_a_tag_was_chosen_by_people(commits, server):
    git(server.folder / "student", "tag", "-a", "handed-in", "-m", "x", commits["late"])
    for ref in (commits["late"], commits["late"][:10], "handed-in", "refs/tags/handed-in"):
        name, handed_in = chosen(server, commits, Rule(deadline=DEADLINE), ref=ref)
        assert (name, handed_in.at, handed_in.by) == ("late", time(DATES["late"]), "commit")
        assert handed_in.before is None
        assert "the roster names" in handed_in.note
    dated = server.obtain(ref="handed-in", submitted_at=DATES["first"]).handed_in
    assert (dated.at, dated.by) == (time(DATES["first"]), "roster")


def test_the_hash_of_a_branch_s_tip_is_a_commit_too(commits, server):
    name, handed_in = chosen(server, commits, Rule(deadline=DEADLINE), ref=commits["last"])
    assert (name, handed_in.before) == ("last", None)


def test_a_branch_of_the_roster_is_looked_through(commits, server):
    repo = server.folder / "student"
    git(repo, "branch", "feature/x", commits["late"])
    for ref in ("feature/x", "refs/heads/feature/x"):
        name, handed_in = chosen(server, commits, Rule(deadline=DEADLINE), ref=ref)
        assert name == "in time"
        assert "on feature/x before" in handed_in.note


def test_nothing_in_time(commits, server):
    with pytest.raises(NothingInTime) as caught:
        server.obtain(rule=Rule(deadline=time("2026-09-30T23:59:00+01:00")), extension_days=0.25)
    error = caught.value
    assert error.message.startswith(
        f"{HOST}/student: no commit on main is from before the deadline 2026-10-01"
    )
    assert "2026-10-01 10:00 +01:00" in error.hint
    assert isinstance(error, SubmissionError)


def test_what_was_merged_late_does_not_count_by_its_own_date(server):
    """Commits of another branch are dated in time, the merge is not: on main, they came with it."""
    repo = server.new()
    git(repo, "checkout", "-q", "-b", "side")
    commit_at(repo, "2026-10-15T10:00:00+01:00", {"lab1/side": "x"})
    git(repo, "checkout", "-q", "main")
    own = commit_at(repo, "2026-10-10T10:00:00+01:00", {"lab1/own": "x"})
    git(repo, "merge", "-q", "--no-ff", "--no-commit", "side")
    commit_at(repo, "2026-11-01T10:00:00+01:00")
    assert server.obtain(rule=Rule(deadline=DEADLINE)).source.ref == own


@pytest.mark.full
def test_a_clone_on_this_machine_counts_as_it_is_committed(server):
    repo = server.new()
    commit_at(repo, DATES["late"], {"lab1/step": "late"})
    write(repo, {"lab1/step": "not committed"})
    plain = server.obtain(str(repo))
    assert (plain.source.kind, plain.handed_in.by) == ("folder", "nobody")
    found = server.obtain(str(repo), Rule(deadline=DEADLINE))
    assert found.handed_in.at == time(DATES["first"])
    assert found.handed_in.note.endswith("changes that are not committed do not count")
    submission = server.opened(str(repo), Rule(deadline=DEADLINE))
    assert submission.commit == git(repo, "rev-parse", "HEAD~1")
    assert submission.source == str(repo)
    for source in (f"{repo}@main", repo.as_uri()):
        assert "not committed" not in server.obtain(source, Rule(deadline=DEADLINE)).handed_in.note
    assert server.obtain(f"{repo}/lab1", Rule(deadline=DEADLINE)).source.kind == "folder"


def test_a_clone_whose_history_cannot_be_read_counts_as_a_folder(server):
    folder = write(server.base / "broken", {".git": "gitdir: /nowhere\n", "package.xml": "x"})
    found = server.obtain(str(folder), Rule(deadline=DEADLINE))
    assert found.source.kind == "folder"
    assert "its history cannot be read" in found.handed_in.note


@pytest.mark.full
def test_a_shallow_clone_says_so(commits, server):
    clone = server.base / "shallow"
    git(server.base, "clone", "-q", "--depth=2", f"file://{server.folder}/student", str(clone))
    assert server.obtain(str(clone), Rule(before=time(DATES["last"]))).source.ref == commits["last"]
    assert server.obtain(str(clone), Rule(before=time(DATES["later"]))).source.ref == commits["later"]
    with pytest.raises(NothingInTime) as caught:
        server.obtain(str(clone), Rule(deadline=DEADLINE))
    assert "a shallow clone" in caught.value.hint


def test_a_clone_without_a_commit_has_nothing_that_counts(server):
    folder = server.base / "new"
    folder.mkdir()
    git(folder, "init", "-q")
    with pytest.raises(SubmissionError, match="has no commit"):
        server.obtain(str(folder), Rule(deadline=DEADLINE))


def test_a_student_s_replaced_history_is_not_believed(server):
    """`git replace` shows another commit in the place of one: a date can be made up so that nobody sees it."""
    repo = repository(server.base / "clone", {})
    late = commit_at(repo, DATES["late"], {"x": "late"})
    made_up = commit_at(repo, DATES["first"], {"x": "made up"})
    git(repo, "reset", "-q", "--hard", late)
    git(repo, "replace", late, made_up)
    with pytest.raises(NothingInTime):
        server.obtain(str(repo), Rule(deadline=time("2026-10-15T00:00:00+01:00")))
    assert commit(repo)


@pytest.mark.parametrize(
    ("record", "year"),
    [
        ("0 +0000", 1970),
        ("4102444800 +0000", 2100),
        ("1761854400 -0930", 2025),
        ("1761854400 +9999", 2025),
        ("1761854400 -9999", 2025),
        ("1761854400", 2025),
        ("99999999999999 +0000", 9999),
        ("18446744073709551615 +1400", 9999),
        ("-5 +0000", 1969),
        ("-99999999999999999 -1200", 1),
        ("", 1970),
        (" ", 1970),
    ],
)
def test_absurd_dates_become_some_time(record, year):
    commit = read_commit(f"{'a' * 40} {record}")
    assert abs(commit.at.year - year) <= 1
    assert commit.hash == "a" * 40
    assert local_time(commit.at)[:4].isdigit()
    assert later(commit.at, 3660)
    assert isinstance(commit.at < DEADLINE, bool)


@pytest.mark.parametrize("date", ["0 +0000", "4102444800 +0000", "1761854400 -9959", "9999999999999 +0000"])
def test_absurd_dates_in_a_repository(date, server):
    repo = server.new()
    raw = git(repo, "cat-file", "commit", "HEAD").replace("1790845200 +0100", date)
    write(server.base, {"raw": f"{raw}\n"})
    head = git(repo, "hash-object", "-t", "commit", "-w", "--literally", str(server.base / "raw"))
    git(repo, "update-ref", "refs/heads/main", head)
    try:
        found = server.obtain(rule=Rule(deadline=DEADLINE))
    except NothingInTime as error:
        assert "The first one is of" in error.hint  # noqa: PT017 - either is right, by the date
    else:
        assert found.source.ref == head
