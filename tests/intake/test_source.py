"""How SOURCE is read from the command line."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from grader.errors import SubmissionError, UsageError
from grader.intake.source import as_repository, parse_source, with_ref
from tests.intake.samples import lab, repository, write


@pytest.mark.parametrize(
    ("text", "url", "ref", "name"),
    [
        ("https://github.com/ada/lab.git", "https://github.com/ada/lab.git", None, "lab"),
        ("https://github.com/ada/lab", "https://github.com/ada/lab", None, "lab"),
        ("https://github.com/ada/lab/", "https://github.com/ada/lab/", None, "lab"),
        ("https://github.com/ada/lab@main", "https://github.com/ada/lab", "main", "lab"),
        ("https://github.com/ada/lab.git@feature/x", "https://github.com/ada/lab.git", "feature/x", "lab"),
        ("https://github.com/ada/lab@feature/x@y", "https://github.com/ada/lab", "feature/x@y", "lab"),
        ("https://host/@ada/lab@v1.0", "https://host/@ada/lab", "v1.0", "lab"),
        ("https://host/a@b.org/lab.git@v1", "https://host/a@b.org/lab.git", "v1", "lab"),
        ("https://host/a@b.org/lab.git", "https://host/a@b.org/lab.git", None, "lab"),
        ("https://ada@host:8443/lab@v1", "https://ada@host:8443/lab", "v1", "lab"),
        ("https://host/my%20lab.git", "https://host/my%20lab.git", None, "my lab"),
        ("ssh://git@host/ada/lab.git", "ssh://git@host/ada/lab.git", None, "lab"),
        ("ssh://git@host:22/ada/lab@v1", "ssh://git@host:22/ada/lab", "v1", "lab"),
        ("git@github.com:ada/lab.git", "git@github.com:ada/lab.git", None, "lab"),
        ("git@github.com:ada/lab.git@v1", "git@github.com:ada/lab.git", "v1", "lab"),
        ("git@github.com:ada/lab@feature/x", "git@github.com:ada/lab", "feature/x", "lab"),
        ("git@host:lab", "git@host:lab", None, "lab"),
        ("myalias:ada/lab", "myalias:ada/lab", None, "lab"),
        ("HTTPS://github.com/ada/lab", "https://github.com/ada/lab", None, "lab"),
    ],
)
def test_remote_addresses(text, url, ref, name):
    source = parse_source(text)
    assert (source.kind, source.remote) == ("repository", True)
    assert (source.url, source.ref, source.name) == (url, ref, name)


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("https://ada:secret@host/lab@v1", "https://host/lab@v1"),
        ("https://ghp_secret@host/lab", "https://host/lab"),
        ("ssh://git:secret@host/lab", "ssh://git@host/lab"),
        ("git@host:lab", "git@host:lab"),
    ],
)
def test_a_password_is_never_shown(text, shown):
    assert parse_source(text).given == shown


@pytest.mark.parametrize(
    "text",
    [
        "",
        "nowhere",
        "./nowhere/lab1.zip",
        "nul\0byte",
        "ext::sh -c id",
        "ftp://host/lab",
        "https://",
        "https://host",
        "https://host/",
        "https://host/lab@",
        "https://host/lab@a..b",
        "https://host/lab@-x",
        "C:\\Users\\ada\\lab1",
        "x" * 5000,
    ],
)
def test_what_is_no_source_is_a_usage_error(text, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(UsageError) as caught:
        parse_source(text)
    assert caught.value.hint
    assert "\n" not in caught.value.message


def test_a_web_address_without_https_gets_a_hint(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(UsageError) as caught:
        parse_source("github.com/ada/lab")
    assert "https://" in caught.value.hint


@pytest.mark.parametrize("name", ["lab1@v1", "git@host:lab", "ada@home", "https:", "lab ü (1)"])
def test_a_path_that_exists_wins(name, tmp_path, monkeypatch):
    write(tmp_path / name, lab())
    monkeypatch.chdir(tmp_path)
    source = parse_source(name)
    assert (source.kind, source.path) == ("folder", tmp_path / name)


@pytest.mark.parametrize("ref", ["main", "feature/x", "v1@2"])
@pytest.mark.parametrize("folder", ["repo", "a@b/repo", "räpo 1%20"])
def test_a_local_repository_with_a_ref(folder, ref, tmp_path):
    (tmp_path / folder / ".git").mkdir(parents=True)
    source = parse_source(f"{tmp_path / folder}@{ref}")
    assert (source.kind, source.ref, source.remote) == ("repository", ref, False)
    assert source.url == (tmp_path / folder).as_uri()


def test_a_ref_asks_for_a_repository(tmp_path):
    write(tmp_path, {"plain/x": "", "lab1.zip": ""})
    with pytest.raises(SubmissionError, match="not a git repository"):
        parse_source(f"{tmp_path}/plain@v1")
    with pytest.raises(UsageError, match="only a repository has"):
        parse_source(f"{tmp_path}/lab1.zip@v1")
    with pytest.raises(UsageError, match="cannot be the name"):
        parse_source(f"{tmp_path}/plain@HEAD~1")


def test_file_addresses(tmp_path):
    repo = repository(tmp_path / "my repo", lab())
    for text in (f"file://{repo}", f"file://localhost{repo}", repo.as_uri()):
        assert parse_source(text).url == repo.as_uri()
    assert parse_source(f"file://{repo}@main").ref == "main"
    with pytest.raises(SubmissionError, match="no such folder"):
        parse_source(f"file://{tmp_path}/nowhere")
    write(tmp_path / "plain", lab())
    with pytest.raises(SubmissionError, match="not a git repository"):
        parse_source(f"file://{tmp_path}/plain")


def test_what_is_neither_folder_nor_file(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "dangling").symlink_to("nowhere")
    for name in ("pipe", "dangling"):
        with pytest.raises(SubmissionError):
            parse_source(str(tmp_path / name))


def test_a_home_folder_is_understood(tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    write(tmp_path / "lab1", lab())
    assert parse_source("~/lab1").path == Path(tmp_path / "lab1")


@pytest.mark.parametrize(
    ("text", "ref", "given"),
    [
        ("https://host/lab.git", "v1", "https://host/lab.git@v1"),
        ("git@host:lab", "feature/x", "git@host:lab@feature/x"),
        ("https://ada:secret@host/lab", "main", "https://host/lab@main"),
        ("https://host/lab@main", "main", "https://host/lab@main"),
        ("https://host/lab@main", None, "https://host/lab@main"),
    ],
)
def test_a_ref_from_elsewhere(text, ref, given):
    source = with_ref(parse_source(text), ref)
    assert (source.given, source.name) == (given, "lab")
    assert source.ref == (ref or "main")


def test_a_ref_from_elsewhere_makes_a_folder_a_repository(tmp_path):
    repo = repository(tmp_path / "repo", lab())
    source = with_ref(parse_source(f"{repo}/lab1"), "main")
    assert (source.kind, source.inside, source.given) == ("repository", "lab1", f"{repo}/lab1@main")


def test_a_folder_as_what_is_committed_there(tmp_path):
    repo = repository(tmp_path / "repo", lab())
    source = as_repository(parse_source(str(repo)))
    assert (source.kind, source.ref, source.given, source.top) == ("repository", None, str(repo), repo)
    with pytest.raises(SubmissionError, match="not a git repository"):
        as_repository(parse_source(str(write(tmp_path / "plain", lab()))))
