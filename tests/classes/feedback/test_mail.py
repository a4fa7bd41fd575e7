"""Mails through a real server on this machine: TLS, logins, refusals, and connections that break."""

from __future__ import annotations

import socket
import ssl
from collections.abc import Callable, Iterator
from email import message_from_bytes
from pathlib import Path

import pytest
from aiosmtpd.controller import Controller
from aiosmtpd.smtp import SMTP, AuthResult, Envelope, LoginPassword, Session

from grader.classes.feedback import mail
from tests.classes.feedback.a_class import feedback, sent
from tests.classes.fetching.forge import certificate_in

USER, PASSWORD = "lab", "s3cret-password"


class Box:
    """Keeps what is sent. `refuse` gives the answers to `RCPT` and `breaks` are addresses at whose mail it hangs up."""

    def __init__(self) -> None:
        self.mails: list[Envelope] = []
        self.tls: list[bool] = []
        self.refuse: dict[str, list[str]] = {}
        self.breaks: set[str] = set()

    async def handle_RCPT(  # noqa: N802 - aiosmtpd's name
        self, server: SMTP, session: Session, envelope: Envelope, address: str, options: list[str]
    ) -> str:
        del server, session, options
        if self.refuse.get(address):
            return self.refuse[address].pop(0)
        envelope.rcpt_tos.append(address)
        return "250 OK"

    async def handle_DATA(self, server: SMTP, session: Session, envelope: Envelope) -> str:  # noqa: N802
        if self.breaks & set(envelope.rcpt_tos):
            server.transport.abort()
            return "250 never heard"
        self.mails.append(envelope)
        self.tls.append(session.ssl is not None)
        return "250 OK"


Started = Callable[..., str]


@pytest.fixture
def box() -> Box:
    return Box()


@pytest.fixture
def started(box: Box, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Started]:
    """Start a server and give its address for `--smtp`."""
    certificate = certificate_in(tmp_path)
    monkeypatch.setenv("SSL_CERT_FILE", str(certificate))
    monkeypatch.setenv("GRADER_SMTP_USER", USER)
    monkeypatch.setenv("GRADER_SMTP_PASSWORD", PASSWORD)
    monkeypatch.setattr(mail, "WAIT_S", 0.01)
    running: list[Controller] = []

    def start(scheme: str = "smtp", *, tls: bool = True) -> str:
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        context.load_cert_chain(certificate)
        words: dict[str, object] = {"auth_required": tls, "authenticator": _authenticate}
        if scheme == "smtps":
            words |= {"ssl_context": context, "auth_require_tls": False}
        elif tls:
            words |= {"tls_context": context, "require_starttls": True}
        else:
            words = {}
        controller = Controller(box, hostname="127.0.0.1", port=_free_port(), **words)  # type: ignore[arg-type]
        controller.start()
        running.append(controller)
        return f"{scheme}://localhost:{controller.port}"

    yield start
    for controller in running:
        controller.stop()


def _free_port() -> int:
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return int(one.getsockname()[1])


def _authenticate(
    server: SMTP, session: Session, envelope: Envelope, mechanism: str, data: LoginPassword
) -> AuthResult:
    known = isinstance(data, LoginPassword) and data == LoginPassword(USER.encode(), PASSWORD.encode())
    return AuthResult(success=known, handled=False)


def send(out: Path, server: str, *options: str) -> int:
    return feedback(out, "email", "--smtp", server, "--from", "lab@x.example", *options)


@pytest.mark.filterwarnings("ignore:Requiring AUTH while not requiring TLS")  # all of the connection is TLS
@pytest.mark.parametrize("scheme", ["smtp", "smtps"])
def test_mails_go_out_by_tls_and_with_a_login(
    scheme: str, published: Path, started: Started, box: Box, capsys
) -> None:
    server = started(scheme)
    assert send(published, server) == 3  # of one no address is known
    assert [one.rcpt_tos for one in box.mails] == [
        ["ada@x.example"],
        ["bob@x.example"],
        ["c@x.example", "d@x.example"],
    ]
    found = message_from_bytes(box.mails[0].original_content or b"")
    assert (found["From"], found["To"]) == ("lab@x.example", "ada@x.example")
    assert scheme == "smtps" or all(box.tls)
    assert PASSWORD not in "".join(capsys.readouterr())
    assert [one for one in sent(published) if one[2] == "sent"] == [
        (name, "email", "sent") for name in ("ada", "bob", "cem")
    ]
    assert send(published, server) == 3
    assert len(box.mails) == 3


def test_a_refused_address_costs_one_student(published: Path, started: Started, box: Box, capsys) -> None:
    box.refuse["ada@x.example"] = ["550 no such user"]
    server = started()
    assert send(published, server, "--only", "ada", "bob") == 3
    assert "ada: localhost says: 550 no such user" in capsys.readouterr().err
    assert [one.rcpt_tos for one in box.mails] == [["bob@x.example"]]
    assert send(published, server, "--only", "ada", "bob") == 0
    assert len(box.mails) == 2


def test_what_the_server_puts_off_is_tried_again(published: Path, started: Started, box: Box) -> None:
    box.refuse["ada@x.example"] = ["450 greylisted", "451 later"]
    assert send(published, started(), "--only", "ada") == 0
    assert len(box.mails) == 1


def test_a_mail_of_which_nobody_knows_is_not_sent_twice(
    published: Path, started: Started, box: Box, capsys
) -> None:
    box.breaks = {"ada@x.example"}
    server = started()
    assert send(published, server, "--only", "ada", "bob") == 3
    assert "not known whether it was" in capsys.readouterr().err
    assert [one.rcpt_tos for one in box.mails] == [["bob@x.example"]]
    box.breaks = set()
    assert send(published, server, "--only", "ada", "bob") == 3
    assert "ada: it is not known whether it was sent: the earlier run was stopped" in capsys.readouterr().err
    assert len(box.mails) == 1
    assert send(published, server, "--only", "ada", "--again") == 0
    assert len(box.mails) == 2


def test_a_wrong_password_ends_the_run(
    published: Path, started: Started, box: Box, monkeypatch: pytest.MonkeyPatch, capsys
) -> None:
    monkeypatch.setenv("GRADER_SMTP_PASSWORD", "wrong-" + PASSWORD)
    assert send(published, started()) == 3
    said = capsys.readouterr()
    assert "535" in said.err
    assert "0 of 4 sent; the same command continues" in said.err
    assert PASSWORD not in said.err
    assert box.mails == []
    assert not (published / "sent.jsonl").exists()


def test_a_certificate_that_is_not_trusted_ends_the_run(
    published: Path, started: Started, box: Box, monkeypatch: pytest.MonkeyPatch, capsys
) -> None:
    server = started()
    monkeypatch.delenv("SSL_CERT_FILE")
    assert send(published, server) == 3
    assert "CERTIFICATE_VERIFY_FAILED" in capsys.readouterr().err
    assert box.mails == []


def test_without_tls_nothing_leaves_this_machine(
    published: Path, started: Started, box: Box, monkeypatch: pytest.MonkeyPatch, capsys
) -> None:
    monkeypatch.delenv("GRADER_SMTP_USER")
    server = started(tls=False)
    monkeypatch.setattr(mail, "_is_here", lambda _: False)
    assert send(published, server) == 3
    assert "the server offers no TLS" in capsys.readouterr().err
    assert box.mails == []
    monkeypatch.undo()
    monkeypatch.delenv("GRADER_SMTP_USER", raising=False)
    assert send(published, server, "--only", "ada") == 0
    assert len(box.mails) == 1


def test_a_server_that_is_not_there_ends_the_run(published: Path, capsys) -> None:
    assert send(published, f"smtp://127.0.0.1:{_free_port()}") == 3
    assert "Connection refused" in capsys.readouterr().err


@pytest.mark.parametrize(
    "address",
    [
        "imap://x",
        "smtp://",
        "smtp://x:y",
        "smtp://user:pass@x",
        "smtp://x/y",
        "smtp://x:99999",
        "smtp://[::1",
    ],
)
def test_what_is_no_server(address: str, published: Path, capsys) -> None:
    assert send(published, address) == 2
    said = capsys.readouterr().err
    assert "this is not the address of a mail server" in said
    assert "pass@" not in said


def test_mails_need_a_sender_and_one_way(published: Path) -> None:
    assert feedback(published, "email", "--smtp", "smtp://x") == 2
    assert feedback(published, "email", "--from", "no address") == 2
    assert send(published, "smtp://x", "--out", str(published / "m")) == 2
