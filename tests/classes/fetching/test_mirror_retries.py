"""What may pass is tried again; what will not is not."""

from __future__ import annotations

import pytest

from grader.classes.fetching.mirror import GivenUp, Patience, patiently
from grader.errors import SubmissionError, Unreachable
from grader.intake.git import GitFailed, GitMissing, GitTimeout, GitTooMuch
from grader.intake.repository import explained, may_pass
from grader.intake.source import parse_source
from tests.classes.fetching.forge import forge
from tests.intake.samples import git

PASSES = [
    "fatal: unable to access 'x': Could not resolve host: h",
    "ssh: Could not resolve hostname h: Temporary failure in name resolution",
    "fatal: unable to access 'x': Failed to connect to h port 443: Connection refused",
    "fatal: unable to access 'x': Recv failure: Connection reset by peer",
    "kex_exchange_identification: Connection closed by remote host",
    "fatal: unable to access 'x': The requested URL returned error: 503",
    "fatal: unable to access 'x': The requested URL returned error: 429",
    "error: RPC failed; HTTP 502 curl 22 The requested URL returned error: 502",
    "error: RPC failed; curl 56 GnuTLS recv error (-54): Error in the pull function.",
    "error: RPC failed; curl 56 OpenSSL SSL_read: Connection was reset, errno 10054",
    "error: RPC failed; curl 92 HTTP/2 stream 5 was not closed cleanly: CANCEL (err 8)\nfatal: early EOF",
    "fatal: the remote end hung up unexpectedly",
    "fetch-pack: unexpected disconnect while reading sideband packet\nfatal: early EOF",
    "fatal: unable to access 'x': Empty reply from server",
]
STAYS = [
    "remote: Repository not found.\nfatal: repository 'https://h/x/' not found",
    "fatal: could not read Username for 'https://h': terminal prompts disabled",
    "error: RPC failed; HTTP 403 curl 22 The requested URL returned error: 403",
    "fatal: unable to access 'x': SSL certificate problem: self signed certificate",
    "fatal: unable to access 'x': server certificate verification failed. CAfile: none CRLfile: none",
    "git@h: Permission denied (publickey).\nfatal: Could not read from remote repository.",
    "Host key verification failed.\nfatal: Could not read from remote repository.",
    "fatal: write error: No space left on device\nfatal: early EOF",
    "fatal: something new",
]


@pytest.mark.parametrize("says", PASSES)
def test_the_network_may_pass(says):
    assert may_pass(GitFailed(says))
    error = explained(GitFailed(says), parse_source("https://h/x"))
    assert isinstance(error, Unreachable)
    assert "git says" not in error.message


@pytest.mark.parametrize("says", STAYS)
def test_other_faults_do_not(says):
    assert not may_pass(GitFailed(says))


def test_kinds_of_failures():
    assert may_pass(GitTimeout("no answer within 120 s"))
    assert not may_pass(GitMissing("git is not installed"))
    assert not may_pass(GitTooMuch("early EOF"))


def test_waits_grow_and_are_not_all_the_same():
    waits: list[float] = []
    chances = iter([0.0, 1.0, 0.5])
    patience = Patience(tries=4, wait_s=1, growth=4, sleep=waits.append, chance=lambda: next(chances))

    def fail() -> None:
        raise GitFailed("fatal: early EOF")

    with pytest.raises(GivenUp):
        patiently(fail, patience)
    assert waits == [0.5, 6.0, 16.0]


@pytest.fixture
def public(server):
    repo = server.new()
    bare = server.base / "public" / "student"
    git(repo, "clone", "-q", "--bare", str(repo), str(bare))
    git(bare, "update-server-info")
    return bare.parent


def test_a_server_that_fails_twice_is_asked_a_third_time(public, server):
    with forge(public) as running:
        running.failures = [503, 429]
        assert server.obtain(f"http://127.0.0.1:{running.port}/student").source.ref


def test_a_server_that_goes_on_failing_is_named_with_the_number_of_tries(public, server):
    with forge(public) as running:
        running.failures = [502] * 10
        with pytest.raises(Unreachable, match=r"has failed.*\(tried 3 times\)"):
            server.obtain(f"http://127.0.0.1:{running.port}/student")
        assert len(running.failures) == 7


@pytest.mark.parametrize(("status", "message"), [(404, "no such repository"), (403, "needs a password")])
def test_a_clear_answer_is_asked_for_once(status, message, public, server):
    with forge(public) as running:
        running.failures = [status] * 10
        with pytest.raises(SubmissionError, match=message) as caught:
            server.obtain(f"http://127.0.0.1:{running.port}/student")
        assert len(running.failures) == 9
    assert "tried" not in caught.value.message
