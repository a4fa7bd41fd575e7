"""Repositories: which commit, and that nothing of theirs is run."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import threading
from dataclasses import replace
from pathlib import Path

import pytest

from grader.errors import PackageNotFound, SubmissionError
from grader.intake.limits import IntakeLimits
from grader.intake.open import open_recording_file, open_recordings_only, open_submission
from grader.intake.source import identify, parse_source
from tests.intake.samples import commit, git, lab, opened, repository, write
from tests.support.processes import lives, until


@pytest.fixture(scope="module")
def grown(tmp_path_factory):
    """A repository with commits `first` (tag v1), `second` (branch feature/x), `middle`, `last` (main)."""
    repo = repository(tmp_path_factory.mktemp("grown"), lab(), executable=("lab1/src/node.py",))
    first = git(repo, "rev-parse", "HEAD")
    git(repo, "tag", "-a", "v1", "-m", "v1")
    git(repo, "checkout", "-q", "-b", "feature/x")
    write(repo, {"lab1/step": "feature"})
    second = commit(repo)
    git(repo, "checkout", "-q", "main")
    write(repo, {"lab1/step": "middle"})
    middle = commit(repo)
    write(repo, {"lab1/step": "last"})
    return repo, {"first": first, "second": second, "middle": middle, "last": commit(repo)}


@pytest.fixture
def repo(grown, tmp_path):
    return shutil.copytree(grown[0], tmp_path / "student")


@pytest.fixture
def history(grown):
    return grown[1]


def bare_copy(repo: Path) -> Path:
    bare = repo.parent / "copy of it.git"
    git(repo, "clone", "-q", "--bare", str(repo), str(bare))
    return bare


def refused(source, tmp_path, **fields):
    with pytest.raises(SubmissionError) as caught:
        opened(source, tmp_path / "refused", **fields)
    assert "\n" not in caught.value.message + caught.value.hint
    assert caught.value.hint
    assert list((tmp_path / "refused/work").iterdir()) == []
    return caught.value


@pytest.mark.full
def test_every_way_to_name_a_repository_gives_the_same(repo, tmp_path):
    bare = bare_copy(repo)
    sources = [repo, f"{repo}@main", f"{repo}/.git", bare, f"{bare}@main", f"file://{repo}", bare.as_uri()]
    found = [opened(source, tmp_path) for source in sources]
    assert {s.commit for s in found} == {git(repo, "rev-parse", "HEAD")}
    assert len({s.digest for s in found}) == 1
    assert [s.id for s in found] == ["student"] * 3 + ["copy-of-it"] * 2 + ["student", "copy-of-it"]
    assert {s.package.mode_source for s in found} == {"git"}
    assert {s.package.executable["src/node.py"] for s in found} == {True}
    assert {s.package.executable["package.xml"] for s in found} == {False}
    assert not any(s.hints for s in found)


@pytest.mark.parametrize(
    ("ref", "which"),
    [
        ("main", "last"),
        ("feature/x", "second"),
        ("v1", "first"),
        ("refs/heads/feature/x", "second"),
        ("HEAD", "last"),
        ("first", "first"),
        ("second", "second"),
        ("middle", "middle"),
        ("middle:7", "middle"),
        ("second:10", "second"),
        ("last:7", "last"),
        ("MIDDLE:12", "middle"),
    ],
)
@pytest.mark.parametrize(
    "form", [pytest.param("{repo}@{ref}", marks=pytest.mark.full), "file://{repo}@{ref}"]
)
def test_refs(repo, history, tmp_path, *, form, ref, which):
    name, _, digits = ref.partition(":")
    if name.lower() in history:
        ref = history[name.lower()][: int(digits or 40)]
        ref = ref.upper() if name.isupper() else ref
    submission = opened(form.format(repo=repo, ref=ref), tmp_path)
    assert submission.commit == history[which]
    assert submission.source == form.format(repo=repo, ref=ref)


def test_only_the_commit_is_fetched(repo, history, tmp_path):
    assert git(opened(f"{repo}@main", tmp_path).root, "rev-list", "--count", "HEAD") == "1"


def test_a_branch_wins_over_a_tag_and_a_name_over_a_hash(repo, history, tmp_path):
    git(repo, "tag", "feature/x", history["first"])
    git(repo, "branch", "abcdef1", history["middle"])
    assert opened(f"{repo}@feature/x", tmp_path).commit == history["second"]
    assert opened(f"{repo}@abcdef1", tmp_path).commit == history["middle"]


@pytest.mark.parametrize(
    ("ref", "hint"),
    [
        ("mian", "@main"),
        ("feature", "feature/x"),
        ("deadbeef", "main"),
        ("f" * 40, "main"),
        ("v2", "main, v1"),
    ],
)
def test_a_ref_that_is_not_there(ref, hint, repo, history, tmp_path):
    error = refused(f"{repo}@{ref}", tmp_path)
    assert f"no branch, tag or commit '{ref}'" in error.message
    assert hint in error.hint


def test_a_ref_that_is_no_commit(repo, tmp_path):
    git(repo, "tag", "blob", git(repo, "rev-parse", "HEAD:lab1/package.xml"))
    assert "no branch, tag or commit 'blob'" in refused(f"{repo}@blob", tmp_path).message


def test_a_folder_of_a_repository_at_a_ref(repo, history, tmp_path):
    submission = opened(f"{repo}/lab1@v1", tmp_path)
    assert (submission.commit, submission.package.path, submission.id) == (history["first"], ".", "lab1")
    write(repo, {"new/x": ""})
    assert "no folder new" in refused(f"{repo}/new@v1", tmp_path).message


def test_repositories_without_a_commit_or_a_file(tmp_path):
    folder = tmp_path / "empty"
    folder.mkdir()
    git(folder, "init", "-q", "--bare")
    assert "has no commit" in refused(folder, tmp_path).message
    assert "has no commit" in refused(folder.as_uri(), tmp_path).message
    assert "has no commit" in refused(f"{folder}@main", tmp_path).message
    hollow = repository(tmp_path / "hollow", {})
    assert "is empty" in refused(hollow, tmp_path).message
    assert "is empty" in refused(hollow.as_uri(), tmp_path).message


def test_a_default_branch_that_is_not_there(repo, history, tmp_path):
    bare = bare_copy(repo)
    git(bare, "symbolic-ref", "HEAD", "refs/heads/master")
    submission = opened(bare, tmp_path)
    assert submission.commit == history["last"]
    assert "main was taken" in submission.hints[0]
    git(bare, "branch", "-m", "main", "work")
    assert "default branch does not exist" in refused(bare, tmp_path).message


@pytest.mark.full
def test_a_repository_with_sha256(tmp_path):
    folder = write(tmp_path / "new", lab())
    git(folder, "init", "-q", "--object-format=sha256", "--initial-branch=main")
    head = commit(folder)
    for ref in ("main", head, head[:9]):
        assert opened(f"{folder}@{ref}", tmp_path).commit == head


def test_git_links_without_gitmodules_are_harmless(repo, tmp_path):
    git(repo, "update-index", "--add", "--cacheinfo", f"160000,{'a' * 40},other")
    git(repo, "update-index", "--add", "--cacheinfo", f"160000,{'a' * 40},lab1/src/third")
    git(repo, "commit", "-q", "-m", "links")
    for source in (repo, repo.as_uri()):
        submission = opened(source, tmp_path)
        assert set(submission.package.executable) == {"CMakeLists.txt", "package.xml", "src/node.py", "step"}
    (hint,) = (one for one in submission.hints if "pointer" in one)
    assert hint.startswith(
        "src/third is only a pointer to another repository, and its files are not in this one: delete"
    )


@pytest.mark.parametrize("name", ["lab1", "workspace"])
def test_a_package_that_is_only_a_git_link(name, tmp_path):
    repo = repository(tmp_path / "outer", {})
    repository(repo / name, lab("."))
    commit(repo)
    with pytest.raises(PackageNotFound) as caught:
        opened(repo.as_uri(), tmp_path)
    assert f"{name} is only a pointer to another repository" in caught.value.hint
    assert opened(repo, tmp_path).package.path == name


@pytest.mark.parametrize("source", ["{repo}", "{repo}@main", "file://{repo}"])
def test_nothing_of_the_repository_is_run(source, repo, tmp_path):
    trap = tmp_path / "trap"
    mark = tmp_path / "ran"
    trap.write_text(f"#!/bin/sh\ntouch '{mark}'\n")
    trap.chmod(0o755)
    write(repo, {".gitattributes": "* filter=x\n"})
    head = commit(repo)
    (repo / ".git/hooks").mkdir()
    for hook in ("post-checkout", "pre-auto-gc", "reference-transaction", "post-index-change"):
        (repo / ".git/hooks" / hook).symlink_to(trap)
    for key in ("core.fsmonitor", "core.sshCommand", "core.pager", "filter.x.smudge", "filter.x.process"):
        git(repo, "config", key, str(trap))
    assert opened(source.format(repo=repo), tmp_path).commit == head
    assert not mark.exists()


def test_the_user_s_own_hooks_and_filters_are_not_run(repo, tmp_path, monkeypatch):
    mark = tmp_path / "ran"
    home = write(
        tmp_path / "home",
        {
            ".gitconfig": f'[core]\nhooksPath = {tmp_path}/home/hooks\n[filter "lfs"]\nsmudge = touch {mark}\n'
            f'required = true\n[init]\ntemplateDir = {tmp_path}/home/t\n[url "file://{repo.parent}/"]\n'
            "insteadOf = https://example.invalid/\n",
            "hooks/post-checkout": f"#!/bin/sh\ntouch {mark}\n",
            "t/hooks/post-checkout": f"#!/bin/sh\ntouch {mark}\n",
        },
        executable=("hooks/post-checkout", "t/hooks/post-checkout"),
    )
    monkeypatch.setenv("HOME", str(home))
    monkeypatch.delenv("GIT_CONFIG_GLOBAL", raising=False)
    write(repo, {".gitattributes": "*.py filter=lfs\n"})
    head = commit(repo)
    mark.unlink(missing_ok=True)
    # The address works through the user's own settings, as credentials do.
    submission = opened("https://example.invalid/student@main", tmp_path)
    assert (submission.commit, submission.id) == (head, "student")
    assert not mark.exists()


def test_the_surroundings_of_a_hook_do_not_matter(repo, tmp_path, monkeypatch):
    other = repository(tmp_path / "other", {"x": ""})
    monkeypatch.setenv("GIT_DIR", str(other / ".git"))
    monkeypatch.setenv("GIT_INDEX_FILE", str(other / ".git/index"))
    monkeypatch.setenv("GIT_WORK_TREE", str(other))
    monkeypatch.setenv("GIT_OBJECT_DIRECTORY", str(other / ".git/objects"))
    found = [opened(source, tmp_path) for source in (repo, f"{repo}@main", repo.as_uri())]
    for name in ("GIT_DIR", "GIT_INDEX_FILE", "GIT_WORK_TREE", "GIT_OBJECT_DIRECTORY"):
        monkeypatch.delenv(name)
    assert {s.commit for s in found} == {git(repo, "rev-parse", "HEAD")}
    assert {s.package.mode_source for s in found} == {"git"}


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can give files away")
def test_a_repository_of_another_user(repo, tmp_path):
    subprocess.run(["chown", "-R", "65534:65534", str(repo)], check=True)  # noqa: S607 - coreutils
    for source in (repo, f"{repo}@main", repo.as_uri()):
        assert opened(source, tmp_path).package.mode_source == "git"


def test_line_ends_come_as_they_are_stored(tmp_path):
    repo = repository(tmp_path / "crlf", lab() | {"lab1/a.py": "x\r\n", "lab1/b.py": "x\n"})
    folder = opened(repo.as_uri(), tmp_path).package.folder
    assert (folder / "a.py").read_bytes() == b"x\r\n"
    assert (folder / "b.py").read_bytes() == b"x\n"


def test_too_many_files_are_refused_before_they_are_written(repo, tmp_path):
    assert "more than 2 files" in refused(repo.as_uri(), tmp_path, limits=IntakeLimits(entries=2)).message
    assert "larger than" in refused(repo.as_uri(), tmp_path, limits=IntakeLimits(total_bytes=10)).message


@pytest.mark.parametrize(
    ("says", "message", "hint"),
    [
        (
            "fatal: could not read Username for 'https://h': terminal prompts disabled",
            "password",
            "ls-remote",
        ),
        ("remote: HTTP Basic: Access denied\nfatal: Authentication failed for 'x'", "password", "ls-remote"),
        ("git@h: Permission denied (publickey).\nfatal: Could not read from remote", "ssh key", "https"),
        ("Host key verification failed.", "does not know", "ssh HOST"),
        ("fatal: unable to access 'x': Could not resolve host: h", "name was not found", "address"),
        ("fatal: unable to access 'x': Failed to connect to h port 443: Connection refused", "reached", ""),
        ("fatal: unable to access 'x': SSL certificate problem: self signed", "certificate", ""),
        ("fatal: repository 'https://h/x/' not found", "no such repository", "address"),
        ("fatal: 'x' does not appear to be a git repository", "no such repository", "address"),
        ("fatal: something new at https://a:secret@h.invalid/lab/x", "something new", ""),
        ("", "git says", ""),
    ],
)
def test_what_git_says_becomes_one_line(says, message, hint, tmp_path, monkeypatch):
    stand_in_for_git(tmp_path, monkeypatch, f"cat >&2 <<'END'\n{says}\nEND\nexit 128")
    error = refused("https://a:secret@h.invalid/lab", tmp_path)
    assert message in error.message
    assert hint in error.hint
    assert "secret" not in error.message + error.hint
    assert error.message.startswith("https://h.invalid/lab: ")
    assert (error.blame == "machine") == (
        message in {"name was not found", "reached", "certificate", "does not know"}
    )


def stand_in_for_git(tmp_path, monkeypatch, script):
    """A `git` that makes repositories, and does `script` when asked for another one."""
    real = subprocess.run(["which", "git"], check=True, capture_output=True, text=True)  # noqa: S607 - which
    text = f'#!/bin/sh\ncase "$*" in *ls-remote*) {script};; esac\nexec {real.stdout.strip()} "$@"\n'
    write(tmp_path / "bin", {"git": text}, executable=("git",))
    monkeypatch.setenv("PATH", f"{tmp_path}/bin:{os.environ['PATH']}")


def test_a_page_of_the_website_is_recognised(tmp_path, monkeypatch):
    stand_in_for_git(tmp_path, monkeypatch, "echo 'fatal: repository not found' >&2; exit 128")
    assert "page of the website" in refused("https://h.invalid/a/b/tree/main/lab1", tmp_path).hint


def test_git_asks_nothing(tmp_path, monkeypatch):
    monkeypatch.setenv("GIT_ASKPASS", "/bin/echo")
    monkeypatch.setenv("GIT_SSH_COMMAND", "ssh -i key")
    stand_in_for_git(tmp_path, monkeypatch, f"env > {tmp_path}/env; cat > {tmp_path}/stdin; exit 1")
    refused("git@h.invalid:lab", tmp_path)
    environment = (tmp_path / "env").read_text().splitlines()
    assert "GIT_TERMINAL_PROMPT=0" in environment
    assert "GIT_ASKPASS=" in environment
    assert "GIT_SSH_COMMAND=ssh -i key -o BatchMode=yes -o ControlMaster=no" in environment
    assert (tmp_path / "stdin").read_text() == ""


def test_a_server_that_does_not_answer(tmp_path, monkeypatch):
    stand_in_for_git(tmp_path, monkeypatch, f"sleep 3600 & echo $! > {tmp_path}/pid; wait")
    error = refused("https://h.invalid/lab", tmp_path, git_timeout_s=0.5)
    assert "no answer within 0.5 s" in error.message
    assert error.blame == "machine"
    until(lambda: not lives(int((tmp_path / "pid").read_text())))


def test_ctrl_c_ends_git_and_leaves_nothing(tmp_path, monkeypatch):
    stand_in_for_git(tmp_path, monkeypatch, f"sleep 3600 & echo $! > {tmp_path}/pid; wait")
    pid_file = tmp_path / "pid"

    def interrupt():
        until(lambda: pid_file.exists() and pid_file.read_text())
        os.kill(os.getpid(), 2)

    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background jobs ignore it
    thread = threading.Thread(target=interrupt)
    thread.start()
    with pytest.raises(KeyboardInterrupt):
        opened("https://h.invalid/lab", tmp_path)
    thread.join()
    signal.signal(signal.SIGINT, before)
    until(lambda: not lives(int(pid_file.read_text())))
    assert list((tmp_path / "work").iterdir()) == []


def test_without_git(repo, tmp_path, monkeypatch):
    (tmp_path / "nothing").mkdir()
    monkeypatch.setenv("PATH", str(tmp_path / "nothing"))
    assert "git is not installed" in refused(repo.as_uri(), tmp_path).message
    submission = opened(repo, tmp_path)
    assert (submission.commit, submission.package.mode_source) == (None, "disk")
    assert "git is not installed" in submission.hints[0]


def test_a_password_stands_in_no_command_line_of_git(tmp_path, monkeypatch):
    stand_in_for_git(tmp_path, monkeypatch, f'echo "$*" > {tmp_path}/argv; env > {tmp_path}/env; exit 1')
    refused("https://ada:s%40crt@h.invalid/lab", tmp_path)
    assert "https://h.invalid/lab" in (tmp_path / "argv").read_text()
    assert "s%40crt" not in (tmp_path / "argv").read_text()
    assert "s@crt" not in (tmp_path / "argv").read_text()
    assert "GRADER_LOGIN_PASSWORD=s@crt" in (tmp_path / "env").read_text().splitlines()


def test_a_password_that_the_server_says_again_is_not_shown(tmp_path, monkeypatch):
    stand_in_for_git(tmp_path, monkeypatch, "echo 'fatal: something new for ada:s@crt' >&2; exit 128")
    error = refused("https://ada:s%40crt@h.invalid/lab", tmp_path)
    assert "something new for ada:***" in error.message


def test_a_source_that_was_read_already(repo, history, tmp_path):
    source = replace(parse_source(f"{repo}@v1"), given="https://h/student@v1", hints=("from elsewhere",))
    submission = open_submission(source, package="lab1", workdir=tmp_path / "work")
    assert (submission.commit, submission.source) == (history["first"], "https://h/student@v1")
    assert submission.hints == ("from elsewhere",)
    assert identify(source, "s1") == ("s1", "https://h/student@v1")
    assert open_recording_file(source) is None
    assert open_recordings_only(source, workdir=tmp_path / "work").commit == history["first"]
