"""A server for repositories on this machine, over http or https, that may ask for a login and may fail."""

from __future__ import annotations

import base64
import ssl
import subprocess
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import NamedTuple


class Asked(NamedTuple):
    """A request: the name by which the server was called, the path, and the login that came with it."""

    host: str
    path: str
    login: str | None


class Forge(ThreadingHTTPServer):
    """Files below `folder`, for whoever knows `login` (`user:password`; None is for all).

    The first answers are those of `failures` (HTTP statuses); what `moved` names is somewhere else.
    """

    daemon_threads = True

    def __init__(self, folder: Path) -> None:
        super().__init__(("127.0.0.1", 0), _Handler)
        self.folder = folder
        self.login: str | None = None
        self.failures: list[int] = []
        self.moved: dict[str, str] = {}
        self.asked: list[Asked] = []

    @property
    def port(self) -> int:
        return self.server_address[1]

    def logins(self, host: str) -> set[str]:
        """Those that came to the server by that name."""
        return {asked.login for asked in self.asked if asked.host == f"{host}:{self.port}" and asked.login}

    def handle_error(self, request: object, client_address: object) -> None:
        """A client that goes away is no matter of the tests."""


class _Handler(BaseHTTPRequestHandler):
    server: Forge

    def do_GET(self) -> None:
        sent = self.headers.get("Authorization", "")
        login = base64.b64decode(sent.removeprefix("Basic ")).decode() if sent else None
        path = self.path.partition("?")[0]
        self.server.asked.append(Asked(self.headers["Host"], self.path, login))
        if self.server.failures:
            self._answer(self.server.failures.pop(0))
        elif self.server.login is not None and login != self.server.login:
            self._answer(401, ("WWW-Authenticate", 'Basic realm="forge"'))
        elif moved := next((to for start, to in self.server.moved.items() if path.startswith(start)), None):
            self._answer(302, ("Location", moved + self.path))
        elif (file := self.server.folder / path.lstrip("/")).is_file():
            self._answer(200, data=file.read_bytes())
        else:
            self._answer(404)

    def _answer(self, status: int, *headers: tuple[str, str], data: bytes = b"") -> None:
        self.send_response(status)
        for name, value in (*headers, ("Content-Length", str(len(data)))):
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(data)

    def log_message(self, *_: object) -> None:
        """Tests are quiet."""


@contextmanager
def forge(folder: Path, certificate: Path | None = None) -> Iterator[Forge]:
    """A server that runs; over https where it has a certificate (with its key in the same file)."""
    with Forge(folder) as server:
        if certificate is not None:
            context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
            context.load_cert_chain(certificate)
            server.socket = context.wrap_socket(server.socket, server_side=True)
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01}, daemon=True)
        thread.start()
        yield server
        server.shutdown()
        thread.join()


def certificate_in(folder: Path) -> Path:
    """For `localhost` and `127.0.0.1`, signed by itself."""
    key, certificate = folder / "key.pem", folder / "certificate.pem"
    subprocess.run(
        (
            *(
                "openssl",
                "req",
                "-x509",
                "-newkey",
                "ec",
                "-pkeyopt",
                "ec_paramgen_curve:prime256v1",
                "-nodes",
            ),
            *("-keyout", str(key), "-out", str(certificate), "-days", "2", "-subj", "/CN=localhost"),
            *("-addext", "subjectAltName=DNS:localhost,IP:127.0.0.1"),
        ),
        check=True,
        capture_output=True,
    )
    certificate.write_bytes(certificate.read_bytes() + key.read_bytes())
    return certificate
