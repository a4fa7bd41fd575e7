"""Mirrors follow their repositories, mend themselves, and take turns."""

from __future__ import annotations

import json
import os
import shutil
import stat
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from grader.arena import base_workspace as arena_cache
from grader.classes.fetching.history import Rule
from grader.classes.fetching.mirror import cache_folder, locked, tidy
from tests.classes.fetching.samples import DEADLINE, HOST, commit_at
from tests.intake.samples import git, write


def fetches(server, monkeypatch) -> Path:
    """A file with a line for each time that git asks a server."""
    real = subprocess.run(["which", "git"], check=True, capture_output=True, text=True)  # noqa: S607 - which
    log = server.base / "asked"
    log.touch()
    text = (
        f'#!/bin/sh\ncase "$*" in *forge.invalid*) echo "$*" | grep -o " ls-remote \\| fetch " | head -1 >> "{log}";; '
        f'esac\nexec {real.stdout.strip()} "$@"\n'
    )
    write(server.base / "bin", {"git": text}, executable=("git",))
    monkeypatch.setenv("PATH", f"{server.base}/bin:{os.environ['PATH']}")
    return log


def refs(repo: Path) -> list[str]:
    return git(
        repo, "for-each-ref", "--format=%(refname) %(objectname)", "refs/heads", "refs/tags"
    ).splitlines()


def test_a_mirror_holds_all_heads_and_tags_and_is_private(server):
    repo = server.new()
    git(repo, "branch", "other")
    git(repo, "tag", "-a", "v1", "-m", "v1")
    server.obtain()
    [mirror] = server.mirrors()
    assert refs(mirror) == refs(repo)
    assert git(mirror, "symbolic-ref", "HEAD") == "refs/heads/main"
    for folder in (server.cache.parent, server.cache, mirror.parent):
        assert stat.S_IMODE(folder.stat().st_mode) == 0o700
    assert not (mirror / "hooks").exists()
    assert not (mirror / "FETCH_HEAD").exists()


def test_what_changes_on_the_server_is_followed(server):
    repo = server.new()
    git(repo, "branch", "gone")
    first = server.obtain().source.ref
    git(repo, "commit", "-q", "--amend", "--allow-empty", "-m", "forced")
    git(repo, "branch", "-D", "gone")
    git(repo, "branch", "gone/below")
    git(repo, "tag", "v2")
    forced = git(repo, "rev-parse", "HEAD")
    assert server.obtain().source.ref == forced != first
    [mirror] = server.mirrors()
    assert refs(mirror) == refs(repo)
    git(repo, "checkout", "-q", "-b", "trunk")
    head = commit_at(repo, "2026-10-02T10:00:00+01:00")
    git(repo, "branch", "-D", "main")
    assert server.obtain().source.ref == head
    assert git(mirror, "symbolic-ref", "HEAD") == "refs/heads/trunk"
    assert server.obtain(ref=first).source.ref == first  # it was there once


def test_what_has_not_changed_is_asked_for_and_not_fetched(server, monkeypatch):
    server.new()
    log = fetches(server, monkeypatch)
    server.obtain()
    assert log.read_text().split() == ["ls-remote", "fetch"]
    server.obtain()
    assert log.read_text().split() == ["ls-remote", "fetch", "ls-remote"]


def test_what_was_fetched_since_is_not_asked_for_again(server, monkeypatch):
    server.new()
    since = time.time()
    found = server.obtain(since=since).source.ref
    log = fetches(server, monkeypatch)
    assert server.obtain(since=since).source.ref == found
    assert log.read_text() == ""
    server.obtain(since=time.time())
    assert log.read_text().split() == ["ls-remote"]


def damage_pack(mirror):
    for path in mirror.glob("objects/??/*"):
        path.chmod(0o600)
        path.write_bytes(path.read_bytes()[:10])


def damage_lock(mirror):
    (mirror / "refs/heads/main.lock").touch()


def damage_head(mirror):
    (mirror / "HEAD").write_bytes(b"")


def damage_config(mirror):
    (mirror / "config").write_bytes(b"[core\n")


def damage_refs(mirror):
    shutil.rmtree(mirror / "refs")


def damage_state(mirror):
    (mirror.parent / "state.json").write_text('{"fetched_at": ')


def damage_all(mirror):
    shutil.rmtree(mirror)
    mirror.mkdir()


@pytest.mark.full
@pytest.mark.parametrize(
    "damage",
    [damage_pack, damage_lock, damage_head, damage_config, damage_refs, damage_state, damage_all],
)
@pytest.mark.parametrize("fresh", [True, False])
def test_a_damaged_mirror_is_made_again(damage, fresh, server):
    repo = server.new()
    since = time.time()
    server.obtain(since=since)
    [mirror] = server.mirrors()
    damage(mirror)
    if not fresh:
        commit_at(repo, "2026-10-02T10:00:00+01:00", {"lab1/step": "2"})
    head = git(repo, "rev-parse", "HEAD")
    assert server.opened(since=since if fresh else 0.0, rule=Rule(deadline=DEADLINE)).commit == head
    assert server.obtain(rule=Rule(deadline=DEADLINE)).source.ref == head


def test_a_repository_that_went_away_leaves_its_mirror_alone(server):
    repo = server.new()
    server.obtain()
    away = repo.rename(server.base / "away")
    with pytest.raises(Exception, match="no such repository"):
        server.obtain()
    away.rename(repo)
    assert len(server.mirrors()) == 1
    assert json.loads((server.mirrors()[0].parent / "state.json").read_text())["listing"]


def test_a_grader_that_was_killed_in_the_middle_leaves_no_half_mirror(server):
    repo = server.new()
    with locked(cache_folder() / "x") as place:
        pass
    server.obtain()
    [mirror] = server.mirrors()
    (mirror.parent / "state.json").unlink()  # as it is while it is fetched
    shutil.rmtree(mirror / "objects")
    assert server.obtain().source.ref == git(repo, "rev-parse", "HEAD")
    assert place.state() is None


@pytest.mark.full
def test_two_processes_fetch_once(server, monkeypatch):
    server.new()
    log = fetches(server, monkeypatch)
    code = (
        "import sys; from pathlib import Path; "
        "from grader.classes.fetching.history import Rule; from grader.classes.fetching.obtain import obtain; "
        "from grader.model.batch import Entry; print('ready', flush=True); sys.stdin.readline(); "
        f"print(obtain(Entry(id='a', source='{HOST}/student'), Rule(), workdir=Path(sys.argv[1]), "
        "fetched_since=float(sys.argv[2])).source.ref)"
    )
    since = str(time.time())
    running = [
        subprocess.Popen(
            [sys.executable, "-c", code, str(server.base / f"work{number}"), since],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        for number in range(3)
    ]
    for process in running:
        assert process.stdout.readline() == "ready\n"
    found = {process.communicate("\n")[0] for process in running}
    assert len(found) == 1
    assert log.read_text().split() == ["ls-remote", "fetch"]


def test_whoever_comes_second_waits(server):
    server.new()
    done = threading.Event()
    server.obtain()
    with locked(server.mirrors()[0].parent):
        thread = threading.Thread(target=lambda: (server.obtain(), done.set()))
        thread.start()
        assert not done.wait(0.5)
    thread.join()
    assert done.is_set()


@pytest.mark.full
def test_those_used_least_recently_go_first_and_none_that_is_in_use(server):
    for name in ("a", "b", "c", "d"):
        server.new(name)
        server.obtain(f"{HOST}/{name}")
    by_name = {}
    for number, name in enumerate(("c", "b", "a", "d")):
        head = git(server.folder / name, "rev-parse", "HEAD")
        server.obtain(f"{HOST}/{name}", since=1.0)
        newest = max(server.cache.iterdir(), key=lambda path: (path / "state.json").stat().st_mtime_ns)
        by_name[name] = newest
        os.utime(newest / "state.json", (1000 + number, 1000 + number))
        assert head
    size = json.loads((by_name["d"] / "state.json").read_text())["bytes"]
    with locked(by_name["c"]):
        tidy(server.cache, int(size * 2.5))
    assert {name for name, place in by_name.items() if place.exists()} == {"c", "d"}
    tidy(server.cache, 0)
    assert list(server.cache.iterdir()) == []
    assert server.obtain(f"{HOST}/a").source.ref


def test_what_nobody_finished_goes_after_a_while(server):
    with locked(cache_folder() / "half") as place:
        place.mirror.mkdir()
    tidy(server.cache)
    assert place.folder.exists()
    os.utime(place.folder, (1000, 1000))
    tidy(server.cache)
    assert not place.folder.exists()


@pytest.mark.full
@pytest.mark.parametrize("kind", ["file", "link", "relative", "nothing"])
def test_without_a_cache_it_is_fetched_all_the_same(kind, server, monkeypatch):
    server.new()
    place = server.base / "cache"
    if kind == "file":
        write(place, {"grader": "a file"})
    elif kind == "link":
        place.mkdir()
        (server.base / "elsewhere").mkdir()
        (place / "grader").symlink_to(server.base / "elsewhere")
    elif kind == "relative":
        monkeypatch.setenv("XDG_CACHE_HOME", "cache")
        write(server.base / "home", {".cache": "a file"})
    else:
        monkeypatch.setenv("XDG_CACHE_HOME", "/proc/nowhere")
    assert server.opened().commit
    assert server.mirrors() == []
    assert [path.name for room in (server.base / "work").iterdir() for path in room.iterdir()] == [
        "commit.git"
    ]


def test_the_cache_of_the_arena_tidies_its_own_files_only(server):
    server.new()
    server.obtain()
    for number in range(arena_cache.FILES_MAX + 3):
        arena_cache.keep(f"base-{number}", b"x")
        os.utime(server.cache.parent / f"base-{number}", (1000 + number, 1000 + number))
    arena_cache.keep("newest", b"x")
    assert len([path for path in server.cache.parent.iterdir() if path.is_file()]) == arena_cache.FILES_MAX
    assert arena_cache.read_kept("newest") == b"x"
    assert len(server.mirrors()) == 1
