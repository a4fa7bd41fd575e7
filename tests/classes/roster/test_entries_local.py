"""Which paths of this machine a roster may name: it may come from a web form."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import pytest

from grader.classes.roster import Local, entries, read_roster
from grader.classes.roster.entries import OUT, REFUSED
from grader.errors import UsageError
from grader.intake.source import parse_source
from tests.classes.roster.helpers import ids, read, said

REMOTE_ONLY = Local(remote_only=True)


@pytest.fixture
def forms(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The roster's folder, with a home beside it in which there is something to be had."""
    folder = tmp_path / "forms"
    (folder / "ada").mkdir(parents=True)
    home = tmp_path / "home"
    (home / "secret").mkdir(parents=True)
    (home / "secret.zip").touch()
    (folder / "link").symlink_to(home)
    (folder / "packed.zip").symlink_to(home / "secret.zip")
    (folder / "inward").symlink_to("ada")
    monkeypatch.setenv("HOME", str(home))
    return folder


OUTSIDE = [
    "../home/secret",
    "../home/missing",
    "{home}/secret",
    "{home}/missing.zip",
    "{home}/secret@main",
    "~/secret",
    "~",
    "file://{home}/secret",
    "file://localhost{home}/secret",
    "FILE://{home}/secret.zip",
    "file://{home}/missing",
    "file://{home}/%73ecret",
    "file://{forms}/../home/secret",
    "link/secret",
    "link",
    "packed.zip",
    "file://{forms}/link/secret",
    "{forms}/../home/secret",
    "ada/../../home/secret",
    "/",
    "/etc/passwd",
    "/proc/self/environ",
]


def _repository(folder: Path) -> None:
    subprocess.run(["git", "init", "--quiet", str(folder)], check=True)  # noqa: S607 - git as the user has it


def _written(source: str, forms: Path) -> str:
    return source.format(home=forms.parent / "home", forms=forms)


@pytest.mark.parametrize("source", OUTSIDE)
def test_what_lies_outside_is_a_fault_of_its_line_and_nothing_is_opened(
    source: str, forms: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = _written(source, forms)

    def opened(*_: object, **__: object) -> None:
        raise AssertionError(f"{path} was opened")

    text = f"id,source\nada,ada\neve,{path}\n"
    (forms / "roster.csv").write_text(text)
    monkeypatch.setattr(Path, "read_bytes", lambda p: text.encode() if p.name == "roster.csv" else opened())
    monkeypatch.setattr(Path, "open", opened)
    monkeypatch.setattr(subprocess, "Popen", opened)
    roster = read_roster(forms / "roster.csv")
    assert ids(roster) == ["ada"]
    assert said(roster) == [f"roster.csv:3: source: {path} {OUT}"]
    assert roster.faults[0].id == "eve"


@pytest.mark.parametrize("source", OUTSIDE)
def test_a_folder_that_is_allowed_may_be_named(source: str, forms: Path) -> None:
    path = _written(source, forms)
    home = forms.parent / "home"
    away = path == "/" or path.startswith(("/etc", "/proc"))
    roster = read(forms, f"id,source\neve,{path}\n", Local(folders=(Path("/var/empty"), home)))
    assert [OUT in fault for fault in said(roster)] == ([True] if away else [False] * len(roster.faults))


@pytest.mark.parametrize(
    "source", [*OUTSIDE, "ada", "{forms}/ada", "inward", "file://{forms}/ada", "missing"]
)
def test_where_only_what_is_fetched_is_taken_every_path_is_a_fault(source: str, forms: Path) -> None:
    path = _written(source, forms)
    roster = read(
        forms, f"id,source\neve,{path}\nbob,https://git.example/b.git\ncem,git@host:c\n", REMOTE_ONLY
    )
    assert ids(roster) == ["bob", "cem"]
    assert said(roster) == [f"roster.csv:2: source: {path} {REFUSED}"]


@pytest.mark.parametrize("source", ["ada", "./ada/.", "{forms}/ada", "inward", "file://{forms}/ada"])
def test_what_lies_below_the_rosters_folder_needs_no_flag(source: str, forms: Path) -> None:
    _repository(forms / "ada")
    roster = read(forms, f"id,source\nada,{_written(source, forms)}\n")
    assert (ids(roster), roster.faults) == (["ada"], ())


def test_a_roster_may_lie_behind_a_link_and_in_a_folder_with_an_at(forms: Path) -> None:
    folder = forms.parent / "u@uni"
    (folder / "ada").mkdir(parents=True)
    (forms.parent / "u").mkdir()
    (forms.parent / "short").symlink_to(folder)
    for name in ("u@uni", "short"):
        assert ids(read(forms.parent / name, "id,source\nada,ada\n")) == ["ada"]


def test_a_folder_that_belongs_to_a_repository_around_the_rosters_is_outside(forms: Path) -> None:
    _repository(forms.parent)
    roster = read(forms, f"id,source\nada,ada@main\nbob,file://{forms}/ada\ncem,ada\n")
    assert ids(roster) == ["cem"]
    assert [fault.endswith(OUT) for fault in said(roster)] == [True, True]


@pytest.mark.parametrize(
    "source",
    [
        "ext::sh -c id",
        "ext::sh",
        "fd::17",
        "-oProxyCommand=id@host:path",
        "-oX@host:path",
        "ssh://-oProxyCommand=id/x",
        "ssh://git@-oProxyCommand=id/x",
        "gopher://host/x",
        "file://host/x",
        "https://",
    ],
)
def test_what_git_would_run_or_cannot_reach_is_a_fault(source: str, forms: Path) -> None:
    for local in (Local(), Local(folders=(Path("/"),)), REMOTE_ONLY):
        roster = read(forms, f"id,source\neve,{source}\n", local)
        assert roster.entries == ()
        assert len(roster.faults) == 1
    with pytest.raises(Exception, match=r"."):
        parse_source(source)


def test_a_folder_of_submissions_has_no_links_out_of_it(forms: Path) -> None:
    roster = read_roster(forms)
    assert ids(roster) == ["ada", "inward"]
    assert said(roster) == [f"link: {OUT}", f"packed.zip: {OUT}"]
    assert ids(read_roster(forms, Local(folders=(forms.parent,)))) == ["ada", "inward", "link", "packed"]
    with pytest.raises(UsageError, match="remote-only"):
        read_roster(forms, REMOTE_ONLY)


def test_a_single_archive_in_a_students_folder_is_no_link_out_of_it(forms: Path) -> None:
    name = "Eve Smith_1234567_assignsubmission_file"
    (forms / name).mkdir()
    (forms / name / "lab.zip").symlink_to(forms.parent / "home" / "secret.zip")
    roster = read_roster(forms)
    assert ids(roster) == ["ada", "inward"]
    assert f"{name}: {OUT}" in said(roster)


@pytest.mark.parametrize("url", ["file:///etc", "/etc", "../home/secret", "~", "ext::sh -c id"])
def test_an_export_of_gitlab_names_no_paths_outside(url: str, forms: Path) -> None:
    path = forms / "projects.json"
    path.write_text(
        json.dumps(
            [{"path": "eve", "http_url_to_repo": url}, {"path": "b", "http_url_to_repo": "https://h/b"}]
        )
    )
    roster = read_roster(path)
    assert ids(roster) == ["b"]
    assert said(roster)[0].startswith("projects.json: project 1: source: ")


def test_an_export_of_github_classroom_names_no_paths_outside(forms: Path) -> None:
    text = (
        "github_username,roster_identifier,student_repository_url\neve,Eve,file:///etc\nbob,Bob,https://h/b\n"
    )
    roster = read(forms, text)
    assert ids(roster) == ["bob"]
    assert said(roster) == [f"roster.csv:2: source: file:///etc {OUT}"]


def test_what_cannot_be_followed_is_a_fault(forms: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (forms / "round").symlink_to("round")

    def forbidden(_: str) -> None:
        raise PermissionError(13, "Permission denied")

    assert said(read(forms, "id,source\neve,round/x\n")) != []
    monkeypatch.setattr(entries, "parse_source", forbidden)
    assert entries.source_fault("ada", forms) == "ada is not a path that can be followed"
