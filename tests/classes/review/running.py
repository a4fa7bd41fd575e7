"""`grader review` in a process of its own, and tabs that ask it over real connections."""

from __future__ import annotations

import re
import signal
import subprocess
import sys
from http.client import HTTPConnection
from pathlib import Path
from urllib.parse import urlencode

ADDRESS = re.compile(r"http://127\.0\.0\.1:(\d+)/\?token=([\w-]+)")
WAIT_S = 60


class Server:
    """The command in a process of its own."""

    def __init__(self, out: Path, *more: str) -> None:
        command = [
            sys.executable,
            "-u",
            "-m",
            "grader",
            "review",
            str(out),
            "--no-browser",
            "--author",
            "Kim",
            *more,
        ]
        self.process = subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, encoding="utf-8"
        )
        found = ADDRESS.search(self.process.stdout.readline())
        assert found, self.process.stderr.read()
        self.address, self.port, self.token = found[0], int(found[1]), found[2]

    def end(self, number: int = signal.SIGINT) -> tuple[int, str, str]:
        """Its exit code, and what it said."""
        if self.process.poll() is None:
            self.process.send_signal(number)
        said, errors = self.process.communicate(timeout=WAIT_S)
        return self.process.returncode, said, errors


class Tab:
    """A browser's tab over a real connection."""

    def __init__(self, server: Server) -> None:
        self.server = server
        self.cookie = ""
        answer, _ = self.ask("GET", f"/?token={server.token}")
        self.cookie = answer.getheader("Set-Cookie").split(";")[0]

    def ask(self, method: str, path: str, fields: dict[str, str] | None = None):
        connection = HTTPConnection("127.0.0.1", self.server.port, timeout=WAIT_S)
        headers = {"Cookie": self.cookie}
        if fields is not None:
            headers["Content-Type"] = "application/x-www-form-urlencoded"
        connection.request(method, path, urlencode(fields) if fields is not None else None, headers)
        answer = connection.getresponse()
        text = answer.read().decode()
        connection.close()
        return answer, text

    def form(self, key: str, criterion: str) -> dict[str, str]:
        _, text = self.ask("GET", f"/s/{key}/")
        found = re.search(rf'<form[^>]*action="/s/{key}/c/{criterion}".*?</form>', text, re.DOTALL)
        return dict(re.findall(r'type="hidden" name="(\w+)" value="([^"]*)"', found.group()))

    def send(self, key: str, criterion: str, form: dict[str, str], **fields: str) -> int:
        return self.ask("POST", f"/s/{key}/c/{criterion}", {**form, **fields})[0].status


def rows(text: str) -> list[str]:
    return re.findall(r'class="row" href="/s/([^/]+)/', text)
