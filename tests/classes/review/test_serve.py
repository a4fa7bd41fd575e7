"""`grader review` as a user starts it: a real server, two tabs at once, Ctrl-C."""

from __future__ import annotations

import importlib.util
import json
import signal
import socket
import stat
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Event
from urllib.parse import unquote, urlsplit

import pytest

from grader.classes.review import serve
from grader.cli.main import run
from grader.host_programs import git_user
from tests.classes.review.a_class import overrides_of, points_of
from tests.classes.review.running import WAIT_S, Server, Tab


@pytest.fixture
def server(out):
    server = Server(out)
    yield server
    if server.process.poll() is None:
        server.process.kill()
    server.process.communicate()


@pytest.mark.full
def test_two_tabs_that_save_at_once_lose_nothing(server, out) -> None:
    tabs = [Tab(server), Tab(server)]
    todo = [
        ("ada", "style"),
        ("ada", "answers"),
        ("dana", "style"),
        ("eve", "answers"),
        ("dana", "counter-wrap"),
    ]
    forms = [[tab.form(*place) for place in todo] for tab in tabs]

    def work(which: int) -> list[int]:
        found = zip(todo, forms[which], strict=True)
        return [
            tabs[which].send(*place, form, points=str(which + 1), comment=f"by {which}")
            for place, form in found
        ]

    with ThreadPoolExecutor(2) as pool:
        codes = list(pool.map(work, range(2)))
    written = overrides_of(out)
    for i, (key, criterion) in enumerate(todo):
        assert sorted([codes[0][i], codes[1][i]]) == [303, 409]
        winner = 0 if codes[0][i] == 303 else 1
        assert written[key][criterion]["points"] == winner + 1
        assert written[key][criterion]["comment"] == f"by {winner}"


@pytest.mark.full
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_end_in_order_writes_the_books(server, out, number) -> None:
    tab = Tab(server)
    tab.send("ada", "style", tab.form("ada", "style"), points="9")
    code, said, errors = server.end(number)
    assert (code, errors) == (0, "")
    assert "Everything is saved" in said
    lines = [json.loads(line) for line in (out / "results.jsonl").read_text().splitlines()]
    ada = next(line for line in lines if line["submission"]["id"] == "ada")
    assert next(c["points"] for c in ada["criteria"] if c["id"] == "style") == 9
    assert points_of(out, "ada", "style") == 9


@pytest.mark.full
def test_a_killed_review_has_saved_and_the_next_one_writes_the_books(server, out) -> None:
    tab = Tab(server)
    tab.send("ada", "style", tab.form("ada", "style"), points="9")
    server.end(signal.SIGKILL)
    assert overrides_of(out)["ada"]["style"]["points"] == 9
    assert Server(out).end()[0] == 0
    assert ",9," in (out / "gradebook.csv").read_text()


@pytest.mark.full
def test_it_says_its_token_once_and_nothing_of_its_requests(server) -> None:
    tab = Tab(server)
    tab.ask("GET", "/s/ada/")
    tab.ask("GET", "/nowhere")
    _, said, errors = server.end()
    assert server.token not in said + errors
    assert "nowhere" not in said + errors


@pytest.mark.full
def test_tokens_are_new_each_time_and_long(server, out) -> None:
    other = Server(out)
    other.end()
    assert server.token != other.token
    assert len(server.token) * 6 >= 128


@pytest.mark.full
def test_it_listens_on_loopback_only(server) -> None:
    listening = [
        line.split()[1]
        for table in ("/proc/net/tcp", "/proc/net/tcp6")
        for line in Path(table).read_text().splitlines()[1:]
        if line.split()[3] == "0A" and int(line.split()[1].split(":")[1], 16) == server.port
    ]
    assert [place.split(":")[0] for place in listening] == ["0100007F"]


@pytest.mark.full
def test_a_body_without_end_is_refused(server) -> None:
    with socket.create_connection(("127.0.0.1", server.port), timeout=WAIT_S) as connection:
        head = (
            f"POST /author HTTP/1.1\r\nHost: 127.0.0.1:{server.port}\r\nContent-Length: 99999999999\r\n\r\n"
        )
        connection.sendall(head.encode())
        assert b" 413 " in connection.recv(1000).splitlines()[0]


@pytest.mark.full
def test_a_port_in_use_is_said_in_one_line(server, out, capsys) -> None:
    assert run(["review", str(out), "--no-browser", "--port", str(server.port)]) == 2
    errors = capsys.readouterr().err.splitlines()
    assert errors[0] == f"grader: error: port {server.port} is in use"
    assert len(errors) == 2


def test_a_folder_without_a_batch(tmp_path, capsys) -> None:
    assert run(["review", str(tmp_path), "--no-browser"]) == 2
    assert "no batch was graded here" in capsys.readouterr().err


def test_a_rubric_that_has_changed_since(out, tmp_path, capsys) -> None:
    run_file = json.loads((out / "run.json").read_text())
    rubric = Path(run_file["rubric_source"])
    run_file["rubric_source"] = str(tmp_path / "changed.yaml")
    (tmp_path / "changed.yaml").write_text(rubric.read_text() + "\n# changed\n")
    (out / "run.json").write_text(json.dumps(run_file))
    assert run(["review", str(out), "--no-browser"]) == 2
    assert "grader regrade" in capsys.readouterr().err


@pytest.mark.parametrize("port", ["x", "-1", "70000", "٣"])
def test_ports_that_are_none(out, port, capsys) -> None:
    assert run(["review", str(out), "--port", port]) == 2
    assert "port" in capsys.readouterr().err


def test_without_the_extra_it_says_what_to_install(out, monkeypatch, capsys) -> None:
    found = importlib.util.find_spec
    monkeypatch.setattr("grader.installable.find_spec", lambda name: None if name == "flask" else found(name))
    assert run(["review", str(out)]) == 2
    errors = capsys.readouterr().err
    assert "-m pip install 'flask>=" in errors
    assert "flask" in errors


def test_the_command_imports_nothing_of_the_extra_before_it_is_asked_for(monkeypatch) -> None:
    command = (
        "import sys; import grader.cli.commands, grader.classes.review; sys.exit('flask' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", command], check=False).returncode == 0


def test_the_browser_is_given_a_file_and_not_the_token(monkeypatch) -> None:
    opened, asked = Event(), []

    def remember(address: str) -> bool:
        asked.append(address)
        opened.set()
        return True

    monkeypatch.setenv("DISPLAY", ":0")
    monkeypatch.setattr(serve.webbrowser, "open", remember)
    with serve.browser("http://127.0.0.1:1/?token=secret", wanted=True) as tried:
        assert tried
        assert opened.wait(WAIT_S)
        assert "secret" not in asked[0]
        page = Path(unquote(urlsplit(asked[0]).path))
        assert "token=secret" in page.read_text()
        assert stat.S_IMODE(page.stat().st_mode) == 0o600
        assert stat.S_IMODE(page.parent.stat().st_mode) == 0o700
    assert not page.exists()


def test_without_a_screen_no_browser_is_opened(monkeypatch) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(serve.sys, "platform", "linux")
    with serve.browser("http://127.0.0.1:1/?token=secret", wanted=True) as tried:
        assert not tried


@pytest.mark.parametrize(("there", "name"), [(True, "Kim Lee"), (False, "")])
def test_the_author_is_whom_git_calls(tmp_path, monkeypatch, there, name) -> None:
    monkeypatch.setenv("GIT_CONFIG_GLOBAL", str(tmp_path / "config"))
    monkeypatch.setenv("GIT_CONFIG_SYSTEM", "/dev/null")
    monkeypatch.chdir(tmp_path)
    if there:
        (tmp_path / "config").write_text("[user]\n\tname = Kim Lee\n")
    assert git_user() == name
