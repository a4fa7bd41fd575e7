"""A repository that was fetched through a mirror is the same submission as one that was fetched by itself."""

from __future__ import annotations

import hashlib
import shutil

import pytest

from grader.classes.fetching.history import Rule
from grader.errors import SubmissionError, UsageError
from grader.intake.open import open_submission
from grader.intake.source import identify
from tests.classes.fetching.samples import DEADLINE, HOST, commit_at, entry
from tests.intake.samples import git, lab, lab_zip, repository, write


def told(submission) -> dict:
    """All of it but where it lies."""
    record = submission.model_dump(exclude={"root"})
    for package in (record["package"], *record["packages"]):
        del package["folder"]
    return record


def both(server, source, **fields):
    direct = open_submission(source, package="lab1", workdir=server.base / "direct")
    return told(direct), told(server.opened(source, **fields))


@pytest.fixture
def grown(server):
    repo = server.new()
    git(repo, "tag", "-a", "v1", "-m", "v1")
    git(repo, "checkout", "-q", "-b", "feature/x")
    commit_at(repo, "2026-10-02T10:00:00+01:00", {"lab1/step": "feature"})
    git(repo, "checkout", "-q", "main")
    commit_at(repo, "2026-10-03T10:00:00+01:00", {"lab1/step": "last"})
    return repo


@pytest.mark.full
@pytest.mark.parametrize("ref", ["", "@main", "@feature/x", "@v1", "@refs/heads/feature/x", "@HEAD"])
def test_the_same_submission_through_the_mirror_and_without_it(ref, grown, server):
    direct, mirrored = both(server, f"{HOST}/student{ref}")
    assert mirrored == direct
    assert mirrored["commit"]


@pytest.mark.full
def test_hashes_and_their_beginnings(grown, server):
    first = git(grown, "rev-parse", "v1^{commit}")
    for ref in (first, first[:8], first.upper()[:12]):
        direct, mirrored = both(server, f"{HOST}/student@{ref}")
        assert mirrored == direct
        assert mirrored["commit"] == first


@pytest.mark.full
def test_a_default_branch_that_is_not_there_is_hinted_at_as_without_a_mirror(server):
    repo = server.new()
    git(repo, "symbolic-ref", "HEAD", "refs/heads/gone")
    direct, mirrored = both(server, f"{HOST}/student")
    assert mirrored == direct
    assert "main was taken" in mirrored["hints"][0]


@pytest.mark.full
def test_a_repository_with_sha256(server):
    repo = write(server.folder / "new", lab())
    git(repo, "init", "-q", "--object-format=sha256", "--initial-branch=main")
    head = commit_at(repo, "2026-10-01T10:00:00+01:00")
    assert server.opened(f"{HOST}/new").commit == head
    assert server.opened(f"{HOST}/new", ref=head).commit == head


@pytest.mark.full
def test_a_server_whose_head_is_no_branch(server):
    repo = server.new()
    git(repo, "checkout", "-q", "--detach")
    head = commit_at(repo, "2026-10-05T10:00:00+01:00", {"lab1/step": "detached"})
    direct, mirrored = both(server, f"{HOST}/student")
    assert mirrored == direct
    assert mirrored["commit"] == head


def test_a_commit_that_no_branch_reaches_is_fetched_by_its_hash(server):
    repo = server.new()
    lost = commit_at(repo, "2026-10-02T10:00:00+01:00", {"lab1/step": "lost"})
    git(repo, "reset", "-q", "--hard", "HEAD~1")
    git(repo, "config", "uploadpack.allowAnySHA1InWant", "true")
    assert server.opened(ref=lost).commit == lost
    assert server.opened(ref=lost).source == f"{HOST}/student@{lost}"


@pytest.mark.full
@pytest.mark.parametrize(
    ("source", "message", "hint"),
    [
        (f"{HOST}/student@mian", "no branch, tag or commit 'mian'", "@main"),
        (f"{HOST}/student@{'f' * 40}", "no branch, tag or commit", "main"),
        (f"{HOST}/student@blob", "no branch, tag or commit 'blob'", "blob"),
        (f"{HOST}/empty", "the repository is empty", "push"),
        (f"{HOST}/nowhere", "there is no such repository", "address"),
        ("https://localhost:1/x", "cannot be reached (tried 3 times)", "network"),
        (
            "https://ada:secret@localhost:1/x",
            "https://localhost:1/x: the server cannot be reached",
            "network",
        ),
    ],
)
def test_bad_sources_give_one_clear_line(source, message, hint, server):
    repo = server.new()
    git(repo, "tag", "blob", git(repo, "rev-parse", "HEAD:lab1/package.xml"))
    git(server.folder, "init", "-q", "--bare", "empty")
    with pytest.raises(SubmissionError) as caught:
        server.obtain(source)
    assert message in caught.value.message
    assert hint in caught.value.hint
    assert "\n" not in caught.value.message + caught.value.hint
    assert "secret" not in caught.value.message + caught.value.hint
    assert not any((server.base / "work").iterdir())


def test_errors_are_those_without_a_mirror(server):
    git(server.folder, "init", "-q", "--bare", "empty")
    server.new()
    for source in (f"{HOST}/empty", f"{HOST}/nowhere", f"{HOST}/student@mian"):
        with pytest.raises(SubmissionError) as direct:
            open_submission(source, package="lab1", workdir=server.base / "direct")
        with pytest.raises(SubmissionError) as mirrored:
            server.obtain(source)
        assert (mirrored.value.message, mirrored.value.hint) == (direct.value.message, direct.value.hint)
        assert type(mirrored.value) is type(direct.value)


def test_folders_and_archives_are_used_as_they_are(server):
    folder = write(server.base / "plain", lab())
    archive = lab_zip(server.base / "ada.zip")
    for path in (folder, archive):
        found = server.obtain(str(path), Rule(deadline=DEADLINE), extension_days=1)
        assert found.source.path == path
        assert (found.handed_in.at, found.handed_in.by) == (None, "nobody")
        assert found.handed_in.deadline.isoformat() == "2026-10-31T23:59:00+01:00"
        dated = server.obtain(str(path), submitted_at=DEADLINE)
        assert (dated.handed_in.at, dated.handed_in.by) == (DEADLINE, "roster")


def test_a_local_repository_at_a_ref_keeps_its_folder(server):
    repo = repository(server.base / "class", lab("ada/lab1"))
    head = git(repo, "rev-parse", "HEAD")
    write(repo, {"ada/lab1/src/node.py": "later"})
    submission = server.opened(f"{repo}/ada@main")
    assert (submission.commit, submission.id, submission.package.path) == (head, "ada", "lab1")
    assert submission.source == f"{repo}/ada@main"
    assert server.mirrors() == []


def test_the_column_ref_and_the_ref_of_the_source(server):
    repo = server.new()
    git(repo, "branch", "other")
    same = server.obtain(f"{HOST}/student@main", ref="main").source
    assert (same.given, same.name) == (f"{HOST}/student@main", "student")
    assert server.obtain(ref="other").source.given == f"{HOST}/student@other"
    with pytest.raises(UsageError, match="says @main, the column ref says other"):
        server.obtain(f"{HOST}/student@main", ref="other")
    with pytest.raises(UsageError, match="cannot be the name"):
        server.obtain(ref="--upload-pack=x")
    with pytest.raises(UsageError, match="only a repository has"):
        server.obtain(str(lab_zip(server.base / "a.zip")), ref="main")
    with pytest.raises(SubmissionError, match="not a git repository"):
        server.obtain(str(write(server.base / "plain", lab())), ref="main")


def test_a_folder_with_a_ref_in_its_column_is_taken_as_that_commit(server):
    repo = repository(server.base / "clone", lab())
    git(repo, "tag", "v1")
    commit_at(repo, "2026-10-02T10:00:00+01:00", {"lab1/step": "2"})
    assert server.opened(str(repo), ref="v1").commit == git(repo, "rev-parse", "v1")


def test_a_source_that_is_read_already_is_known_as_the_text_is(server):
    server.new()
    found = server.obtain()
    assert identify(found.source) == identify(entry().source) == ("student", f"{HOST}/student")


def test_only_the_commit_stays_in_the_work_folder(server):
    server.new()
    source = server.obtain().source
    assert [path.name for room in (server.base / "work").iterdir() for path in room.iterdir()] == [
        "commit.git"
    ]
    shutil.rmtree(server.base / "cache")
    assert open_submission(source, package="lab1", workdir=server.base / "w").commit == source.ref


@pytest.mark.full
def test_too_much_history_is_left_behind_where_nobody_asks_for_it(server, monkeypatch):
    repo = server.new()
    noise = b"".join(hashlib.sha256(str(n).encode()).digest() for n in range(10_000))
    commit_at(repo, "2026-10-02T10:00:00+01:00", {"lab1/a.bin": noise})
    (repo / "lab1/a.bin").unlink()
    head = commit_at(repo, "2026-10-03T10:00:00+01:00")
    monkeypatch.setattr("grader.intake.git._FILE_BYTES", 200 << 10)
    found = server.obtain()
    assert (found.source.ref, found.handed_in.by) == (head, "commit")
    assert open_submission(found.source, package="lab1", workdir=server.base / "w").commit == head
    with pytest.raises(SubmissionError, match="larger than a lab's submission"):
        server.obtain(rule=Rule(deadline=DEADLINE))
