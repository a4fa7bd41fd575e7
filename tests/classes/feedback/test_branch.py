"""A branch in real repositories: bare ones on this machine, and a server that speaks git's protocol over http."""

from __future__ import annotations

import os
import subprocess
from base64 import b64decode
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread

import pytest

from tests.classes.feedback.a_class import award, feedback, publish, sent, use


def git(folder: Path, *args: str) -> str:
    identity = ("-c", "user.name=ada", "-c", "user.email=ada@x.example", "-c", "init.defaultBranch=main")
    done = subprocess.run(
        ["/usr/bin/env", "git", *identity, *args],
        cwd=folder,
        check=True,
        capture_output=True,
        text=True,
    )
    return done.stdout.strip()


def repository(folder: Path) -> Path:
    """Make a bare repository with the student's `main`."""
    folder.mkdir(parents=True)
    git(folder, "init", "--quiet", "--bare", ".")
    work = folder.with_name(f"{folder.name}-work")
    work.mkdir()
    git(work, "init", "--quiet", ".")
    (work / "talker.py").write_text("print('hello')\n")
    git(work, "add", ".")
    git(work, "commit", "--quiet", "-m", "my work")
    git(work, "push", "--quiet", str(folder), "HEAD:refs/heads/main")
    return folder


@pytest.fixture
def ada(published: Path, tmp_path: Path) -> Path:
    place = repository(tmp_path / "server" / "ada.git")
    use(published, {"ada": place.as_uri()})
    return place


def to_ada(out: Path, *options: str) -> int:
    return feedback(out, "git", "--only", "ada", *options)


def test_a_branch_beside_the_students(published: Path, ada: Path) -> None:
    main = git(ada, "rev-parse", "main")
    assert to_ada(published) == 0
    assert git(ada, "branch", "--format=%(refname:short)") == "feedback\nmain"
    assert git(ada, "rev-parse", "main") == main
    assert git(ada, "ls-tree", "--name-only", "feedback") == "report.html\nreport.md"
    (frozen,) = (published / ".published" / "ada").iterdir()
    assert git(ada, "show", "feedback:report.md") == (frozen / "report.md").read_text().strip()
    assert git(ada, "log", "--format=%an: %s", "feedback").startswith("ros-lab-grader: ")
    assert "85 of 100 points" in git(ada, "log", "--format=%s", "feedback")


@pytest.mark.full
def test_changes_are_commits_behind_each_other(published: Path, ada: Path) -> None:
    to_ada(published)
    first = git(ada, "rev-parse", "feedback")
    award(published, "ada", "style", 9)
    publish(published)
    assert to_ada(published) == 0
    assert git(ada, "rev-list", "feedback").splitlines()[1:] == [first]
    assert to_ada(published, "--again") == 0
    assert git(ada, "rev-list", "--count", "feedback") == "2"


def test_a_branch_of_somebody_elses_stays_as_it_is(published: Path, ada: Path, capsys) -> None:
    git(ada, "branch", "feedback", "main")
    before = git(ada, "for-each-ref")
    assert to_ada(published) == 3
    assert "its branch feedback is not the grader's, and stays as it is" in capsys.readouterr().err
    assert git(ada, "for-each-ref") == before
    assert to_ada(published, "--branch", "marks/lab1") == 0
    assert "marks/lab1" in git(ada, "branch")


def test_no_hook_of_a_repository_runs(published: Path, ada: Path, tmp_path: Path) -> None:
    mark = tmp_path / "hook-ran"
    for name in ("pre-receive", "update", "post-receive", "post-update", "reference-transaction"):
        hook = ada / "hooks" / name
        hook.write_text(f"#!/bin/sh\ntouch {mark}\n")
        hook.chmod(0o755)
    git(ada.with_name("ada.git-work"), "push", "--quiet", str(ada), "HEAD:refs/heads/other")
    mark.unlink()
    assert to_ada(published) == 0
    assert not mark.exists()


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("core.alternateRefsCommand", "touch ran"),
        ("include.path", "/dev/null"),
        ("remote.x.uploadpack", "touch ran"),
        ("core.hooksPath", "/tmp"),
    ],
)
def test_a_repository_with_settings_of_its_own_gets_nothing(
    name: str, value: str, published: Path, ada: Path, capsys
) -> None:
    git(ada, "config", name, value)
    assert to_ada(published) == 3
    assert f"settings of its own: {name.lower()}" in capsys.readouterr().err
    assert git(ada, "branch", "--format=%(refname:short)") == "main"


def test_a_bare_clone_is_a_repository_as_any(published: Path, ada: Path) -> None:
    clone = ada.with_name("clone.git")
    git(ada, "clone", "--quiet", "--bare", str(ada), str(clone))
    use(published, {"ada": clone.as_uri()})
    assert to_ada(published) == 0
    assert "report.md" in git(clone, "ls-tree", "--name-only", "feedback")


def test_a_working_copy_gets_nothing(published: Path, ada: Path, capsys) -> None:
    work = ada.with_name("ada.git-work")
    use(published, {"ada": work.as_uri(), "bob": str(work / "talker.py")})
    assert feedback(published, "git", "--only", "ada", "bob") == 3
    said = capsys.readouterr().err
    assert "ada: a working copy on this machine was submitted" in said
    assert "bob: no repository was submitted" in said
    assert git(work, "branch", "--format=%(refname:short)") == "main"


def test_a_name_that_is_no_branch(published: Path, ada: Path) -> None:
    for name in ("-x", "a..b", "../x", "a b", "x.lock", "x/"):
        assert to_ada(published, f"--branch={name}") == 2


class GitServer(ThreadingHTTPServer):
    """`git http-backend` for the repositories below `folder`, for who logs in as `login`."""

    daemon_threads = True

    def __init__(self, folder: Path, login: str) -> None:
        super().__init__(("127.0.0.1", 0), _Handler)
        self.folder, self.login = folder, login


class _Handler(BaseHTTPRequestHandler):
    server: GitServer

    def do_GET(self) -> None:
        sent_login = b64decode(self.headers.get("Authorization", "").removeprefix("Basic ")).decode()
        if sent_login != self.server.login:
            self._end(401, {"WWW-Authenticate": 'Basic realm="git"'}, b"")
            return
        path, _, query = self.path.partition("?")
        length = int(self.headers.get("Content-Length") or 0)
        environment = {
            "PATH": os.environ["PATH"],
            "GIT_PROJECT_ROOT": str(self.server.folder),
            "GIT_HTTP_EXPORT_ALL": "1",
            "REQUEST_METHOD": self.command,
            "PATH_INFO": path,
            "QUERY_STRING": query,
            "CONTENT_TYPE": self.headers.get("Content-Type", ""),
            "HTTP_CONTENT_ENCODING": self.headers.get("Content-Encoding", ""),
            "CONTENT_LENGTH": str(length),
            "REMOTE_USER": "teacher",
        }
        done = subprocess.run(
            ["/usr/bin/env", "git", "http-backend"],
            input=self._body(length),
            env=environment,
            capture_output=True,
            check=False,
        )
        head, _, body = done.stdout.partition(b"\r\n\r\n")
        headers = dict(line.split(": ", 1) for line in head.decode().splitlines())
        self._end(int(headers.pop("Status", "200").split()[0]), headers, body)

    def do_POST(self) -> None:
        self.do_GET()

    def _body(self, length: int) -> bytes:
        return self.rfile.read(length)

    def _end(self, status: int, headers: dict[str, str], body: bytes) -> None:
        self.send_response(status)
        for name, value in {**headers, "Content-Length": str(len(body))}.items():
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, *_: object) -> None:
        """Tests are quiet."""


@pytest.fixture
def server(tmp_path: Path) -> Iterator[GitServer]:
    folder = tmp_path / "http"
    for name in ("ada", "bob"):
        git(repository(folder / f"{name}.git"), "config", "http.receivepack", "true")
    with GitServer(folder, "teacher:s3cret") as made:
        thread = Thread(target=made.serve_forever, kwargs={"poll_interval": 0.01}, daemon=True)
        thread.start()
        yield made
        made.shutdown()
        thread.join()


def test_a_push_over_http_with_a_credential_helper(
    published: Path, server: GitServer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys
) -> None:
    home = tmp_path / "home"
    home.mkdir()
    (home / ".gitconfig").write_text(
        '[credential]\n\thelper = "!f() { echo username=teacher; echo password=s3cret; }; f"\n'
    )
    monkeypatch.setenv("HOME", str(home))
    address = f"http://127.0.0.1:{server.server_address[1]}"
    use(published, {name: f"{address}/{name}.git" for name in ("ada", "bob", "cem")})
    assert feedback(published, "git", "--only", "ada", "bob", "cem") == 3
    said = capsys.readouterr()
    assert "2 sent by git, 1 could not be sent\n" in said.out
    assert "cem: " in said.err
    assert "s3cret" not in said.out + said.err
    for name in ("ada", "bob"):
        assert "report.md" in git(server.folder / f"{name}.git", "ls-tree", "--name-only", "feedback")
    assert {line[2] for line in sent(published) if line[0] != "cem"} == {"sent"}


def test_a_server_that_refuses_costs_one_student(
    published: Path, server: GitServer, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys
) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    (tmp_path / ".gitconfig").write_text(
        '[credential]\n\thelper = "!f() { echo username=teacher; echo password=s3cret; }; f"\n'
    )
    hook = server.folder / "ada.git" / "hooks" / "pre-receive"
    hook.write_text("#!/bin/sh\necho protected branch >&2\nexit 1\n")
    hook.chmod(0o755)
    address = f"http://127.0.0.1:{server.server_address[1]}"
    use(published, {name: f"{address}/{name}.git" for name in ("ada", "bob")})
    assert feedback(published, "git", "--only", "ada", "bob") == 3
    said = capsys.readouterr()
    assert "does not take a push to feedback" in said.err
    assert "1 sent by git, 1 could not be sent\n" in said.out
