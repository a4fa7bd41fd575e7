"""Tokens and passwords reach the server that they are for, and nothing and nobody else."""

from __future__ import annotations

import os
import subprocess

import pytest

from grader.classes.fetching.history import Rule
from grader.errors import SubmissionError, UsageError
from grader.intake.credentials import Access, accesses, split_address, without_password
from grader.intake.source import parse_source
from tests.classes.fetching.forge import certificate_in, forge
from tests.classes.fetching.samples import DEADLINE
from tests.intake.samples import git, write

TOKEN = "tok-3nfs8w-never-shown"  # noqa: S105 - made up
VARIABLES = (
    "GITHUB_TOKEN", "GH_TOKEN", "GITHUB_SERVER_URL", "GITLAB_TOKEN", "CI_JOB_TOKEN", "CI_SERVER_HOST", "CI_SERVER_PORT",
    "CI_SERVER_PROTOCOL", "GRADER_GIT_TOKEN", "GRADER_GIT_USER", "GRADER_GIT_HOST", "GIT_CONFIG_COUNT",
)  # fmt: skip


@pytest.fixture(autouse=True)
def clean(monkeypatch, server):
    for name in VARIABLES:
        monkeypatch.delenv(name, raising=False)


@pytest.fixture(scope="module")
def certificate(tmp_path_factory):
    return certificate_in(tmp_path_factory.mktemp("certificate"))


@pytest.fixture
def public(server):
    """The folder that a server serves, with a repository `student`, and the hash of its commit."""
    repo = server.new()
    bare = server.base / "public" / "student"
    git(repo, "clone", "-q", "--bare", str(repo), str(bare))
    git(bare, "update-server-info")
    return bare.parent, git(repo, "rev-parse", "HEAD")


@pytest.fixture
def argv(server, monkeypatch):
    """Every command line with which git is called."""
    real = subprocess.run(["which", "git"], check=True, capture_output=True, text=True)  # noqa: S607 - which
    log = server.base / "argv"
    text = f'#!/bin/sh\nprintf "%s\\n" "$*" >> "{log}"\nexec {real.stdout.strip()} "$@"\n'
    write(server.base / "bin", {"git": text}, executable=("git",))
    monkeypatch.setenv("PATH", f"{server.base}/bin:{os.environ['PATH']}")
    return log


def with_store(server):
    """git's own helper, which keeps passwords in the file `s`."""
    with (server.base / "home/.gitconfig").open("a") as file:
        file.write(f"[credential]\n\thelper = store --file={server.base}/s\n")


def given_to(access: Access, url: str) -> str:
    """What git itself would send to `url`."""
    scheme, _, host = url.partition("://")
    done = subprocess.run(
        ["git", *access.options, "credential", "fill"],  # noqa: S607 - the machine's git
        input=f"protocol={scheme}\nhost={host.partition('/')[0]}\n\n",
        env={**os.environ, **access.environment, "GIT_TERMINAL_PROMPT": "0", "GIT_ASKPASS": ""},
        capture_output=True,
        text=True,
        check=False,
    )
    fields = dict(line.split("=", 1) for line in done.stdout.splitlines())
    return f"{fields['username']}:{fields['password']}" if done.returncode == 0 else ""


@pytest.mark.parametrize(
    ("environment", "url", "login"),
    [
        ({"GITHUB_TOKEN": TOKEN}, "https://github.com/a/b", f"x-access-token:{TOKEN}"),
        ({"GH_TOKEN": TOKEN}, "https://GitHub.com:443/a/b", f"x-access-token:{TOKEN}"),
        ({"GITHUB_TOKEN": TOKEN}, "http://github.com/a/b", ""),
        ({"GITHUB_TOKEN": TOKEN}, "https://github.com.evil.org/a/b", ""),
        ({"GITHUB_TOKEN": TOKEN}, "https://evil.org/github.com", ""),
        ({"GITHUB_TOKEN": TOKEN}, "https://evil.org?.github.com/x", ""),
        ({"GITHUB_TOKEN": TOKEN}, "https://gist.github.com/a", ""),
        ({"GITHUB_TOKEN": TOKEN}, "https://github.com:8443/a", ""),
        ({"GITHUB_TOKEN": TOKEN}, "https://gitlab.com/a/b", ""),
        ({"GITHUB_TOKEN": TOKEN, "GITHUB_SERVER_URL": "https://git.uni.edu"}, "https://github.com/a", ""),
        (
            {"GITHUB_TOKEN": TOKEN, "GITHUB_SERVER_URL": "https://git.uni.edu"},
            "https://git.uni.edu/a",
            f"x-access-token:{TOKEN}",
        ),
        ({"GITHUB_TOKEN": TOKEN, "GITHUB_SERVER_URL": "http://git.uni.edu"}, "https://git.uni.edu/a", ""),
        ({"GITLAB_TOKEN": TOKEN}, "https://gitlab.com/a/b", f"oauth2:{TOKEN}"),
        ({"CI_JOB_TOKEN": TOKEN}, "https://gitlab.com/a/b", f"gitlab-ci-token:{TOKEN}"),
        ({"CI_JOB_TOKEN": TOKEN, "CI_SERVER_HOST": "lab.uni.edu"}, "https://gitlab.com/a/b", ""),
        (
            {"CI_JOB_TOKEN": TOKEN, "CI_SERVER_HOST": "lab.uni.edu", "CI_SERVER_PORT": "8443"},
            "https://lab.uni.edu:8443/a",
            f"gitlab-ci-token:{TOKEN}",
        ),
        ({"GRADER_GIT_TOKEN": TOKEN}, "https://github.com/a", ""),
        ({"GRADER_GIT_TOKEN": TOKEN, "GRADER_GIT_HOST": "git.uni.edu"}, "https://git.uni.edu/a", f"oauth2:{TOKEN}"),
        ({"GRADER_GIT_TOKEN": TOKEN, "GRADER_GIT_HOST": "git.uni.edu"}, "https://uni.edu/a", ""),
        (
            {"GRADER_GIT_TOKEN": TOKEN, "GRADER_GIT_HOST": "git.uni.edu", "GRADER_GIT_USER": "bot"},
            "https://git.uni.edu/a",
            f"bot:{TOKEN}",
        ),
        (
            {"GRADER_GIT_TOKEN": TOKEN, "GRADER_GIT_HOST": "github.com", "GITHUB_TOKEN": "another"},
            "https://github.com/a",
            f"oauth2:{TOKEN}",
        ),
        ({"GITHUB_TOKEN": f"{TOKEN}\nhost=evil.org"}, "https://github.com/a", ""),
    ],
)  # fmt: skip
def test_each_token_is_for_its_own_server(environment, url, login, monkeypatch):
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    ways = accesses(*split_address(url)) if "?" not in url else accesses(url, None)
    assert given_to(ways[0], url) == login
    assert len(ways) == (2 if login else 1)
    for elsewhere in ("https://evil.org", "http://github.com", "http://git.uni.edu", "https://x.github.com"):
        assert given_to(ways[0], elsewhere) == ""
    assert TOKEN not in repr(ways) + " ".join(part for way in ways for part in way.options)


@pytest.mark.full
def test_a_private_repository_by_a_token(public, server, certificate, argv, monkeypatch):
    folder, head = public
    with_store(server)
    monkeypatch.setenv("GIT_SSL_CAINFO", str(certificate))
    with forge(folder, certificate) as running:
        running.login = f"oauth2:{TOKEN}"
        monkeypatch.setenv("GRADER_GIT_TOKEN", TOKEN)
        monkeypatch.setenv("GRADER_GIT_HOST", f"localhost:{running.port}")
        found = server.obtain(f"https://localhost:{running.port}/student", Rule(deadline=DEADLINE))
        assert found.source.ref == head
        assert running.logins("localhost") == {running.login}
        with pytest.raises(SubmissionError, match="needs a password"):
            server.obtain(f"https://127.0.0.1:{running.port}/student")
        assert running.logins("127.0.0.1") == set()
    assert_nowhere(TOKEN, server, argv, found)
    assert not (server.base / "s").exists()


def test_a_redirect_takes_no_token_to_another_server(public, server, certificate, monkeypatch):
    monkeypatch.setenv("GIT_SSL_CAINFO", str(certificate))
    with forge(public[0], certificate) as evil, forge(public[0], certificate) as good:
        evil.login = good.login = f"oauth2:{TOKEN}"
        good.moved["/student"] = f"https://127.0.0.1:{evil.port}"
        monkeypatch.setenv("GRADER_GIT_TOKEN", TOKEN)
        monkeypatch.setenv("GRADER_GIT_HOST", f"localhost:{good.port}")
        with pytest.raises(SubmissionError, match="needs a password"):
            server.obtain(f"https://localhost:{good.port}/student")
        assert good.logins("localhost") == {good.login}
        assert evil.asked
        assert evil.logins("127.0.0.1") == set()


def test_no_token_goes_over_http(public, server, monkeypatch):
    with forge(public[0]) as running:
        running.login = f"oauth2:{TOKEN}"
        monkeypatch.setenv("GRADER_GIT_TOKEN", TOKEN)
        monkeypatch.setenv("GRADER_GIT_HOST", f"127.0.0.1:{running.port}")
        with pytest.raises(SubmissionError, match="needs a password"):
            server.obtain(f"http://127.0.0.1:{running.port}/student")
        assert running.asked
        assert running.logins("127.0.0.1") == set()


def test_a_login_of_the_address_stands_in_no_command_line_and_no_file(public, server, argv):
    with forge(public[0]) as running:
        running.login = f"ada@uni:{TOKEN}/x"
        source = f"http://ada%40uni:{TOKEN}%2Fx@127.0.0.1:{running.port}/student"
        found = server.obtain(source)
        assert found.source.ref == public[1]
        assert found.source.given == f"http://127.0.0.1:{running.port}/student"
        running.login = "another"
        with pytest.raises(SubmissionError) as caught:
            server.obtain(source)
        asked = [asked for asked in running.asked if asked.login]
        assert {asked.login for asked in asked} == {f"ada@uni:{TOKEN}/x"}
    assert "needs a password" in caught.value.message
    assert TOKEN not in caught.value.message + caught.value.hint
    assert_nowhere(TOKEN, server, argv, found)


def test_a_token_in_the_place_of_the_user(public, server, argv):
    with forge(public[0]) as running:
        running.login = f"{TOKEN}:"
        found = server.obtain(f"http://{TOKEN}@127.0.0.1:{running.port}/student")
        assert found.source.ref == public[1]
    assert_nowhere(TOKEN, server, argv, found)


def test_git_s_own_helpers_are_asked_for_a_user_s_password(public, server):
    with_store(server)
    with forge(public[0]) as running:
        running.login = "ada:right"
        place = f"127.0.0.1:{running.port}"
        (server.base / "s").write_text(f"http://bob:wrong@{place}\nhttp://ada:right@{place}\n")
        assert server.obtain(f"http://ada@{place}/student").source.ref == public[1]


@pytest.mark.full
def test_a_token_that_is_refused_leaves_it_to_git_s_own_helpers(public, server, certificate, monkeypatch):
    with_store(server)
    monkeypatch.setenv("GIT_SSL_CAINFO", str(certificate))
    with forge(public[0], certificate) as running:
        running.login = "ada:right"
        place = f"localhost:{running.port}"
        (server.base / "s").write_text(f"https://ada:right@{place}\n")
        monkeypatch.setenv("GRADER_GIT_TOKEN", TOKEN)
        monkeypatch.setenv("GRADER_GIT_HOST", place)
        assert server.obtain(f"https://{place}/student").source.ref == public[1]
        assert running.logins("localhost") == {f"oauth2:{TOKEN}", "ada:right"}
    assert TOKEN not in (server.base / "s").read_text()


@pytest.mark.parametrize(
    "text",
    ["https://ada:sec/ret@host/lab", "https://ada:secret@ho st/lab", "https://ada:secret%0Ahost=x@host/lab",
     "https://ada:secret@host", "https://ada:secret@/lab", "https://-ada:secret@host", "https://ada:secret@host/lab@a..b"],
)  # fmt: skip
def test_an_address_that_cannot_be_read_is_not_shown_with_its_password(text):
    with pytest.raises(UsageError) as caught:
        parse_source(text)
    assert "sec" not in caught.value.message + caught.value.hint


@pytest.mark.parametrize(
    ("source", "shown"),
    [
        ("https://ada:sec/ret@host/lab", "https://…"),
        ("https://ada:12/34@host/lab", "https://ada:12/34@host/lab"),  # a port and a path, to anybody
        ("https://ada:secret@host:8443/lab", "https://host:8443/lab"),
        ("https://host:8443", "https://host:8443"),
        ("https://[::1]:80/lab@x", "https://[::1]:80/lab@x"),
        ("https://host/a:b/lab", "https://host/a:b/lab"),
        ("git@host:lab", "git@host:lab"),
        ("/home/a:b/lab", "/home/a:b/lab"),
    ],
)
def test_what_is_shown_of_an_address(source, shown):
    assert without_password(source) == shown


def test_a_password_for_ssh_is_taken_away():
    assert split_address("ssh://git:secret@host:22/lab") == ("ssh://git@host:22/lab", None)
    assert split_address("git@host:lab") == ("git@host:lab", None)
    assert "secret" not in repr(parse_source("https://ada:secret@host/lab"))


def assert_nowhere(secret, server, argv, found):
    assert secret not in argv.read_text()
    assert secret not in repr(found)
    written = [
        path for name in ("cache", "work") for path in (server.base / name).rglob("*") if path.is_file()
    ]
    assert any(path.name == "packed-refs" or "refs" in path.parts for path in written)
    for path in written:
        assert secret.encode() not in path.read_bytes(), path
        assert b"127.0.0.1" not in path.read_bytes(), path
        assert b"localhost" not in path.read_bytes(), path
