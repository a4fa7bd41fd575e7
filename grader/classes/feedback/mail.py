"""A mail to each student: written as `.eml` files, or sent through a server with TLS.

The report's beginning is the mail's text, and `report.html` is attached. The password is in `GRADER_SMTP_PASSWORD`.
"""

from __future__ import annotations

import os
import re
import smtplib
import ssl
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import datetime, timezone
from email.headerregistry import Address
from email.message import EmailMessage
from email.policy import SMTP
from email.utils import format_datetime
from html import unescape
from ipaddress import ip_address
from urllib.parse import urlsplit

from grader.classes.feedback.forms import PAGE, Feedback, Sender, SendSettings, Unsure
from grader.classes.gradebook.matching import kinds
from grader.errors import HostError, NotSent, UsageError
from grader.files import atomic_write
from grader.model.batch import Entry
from grader.untrusted_text import line

USER, PASSWORD, FROM = "GRADER_SMTP_USER", "GRADER_SMTP_PASSWORD", "GRADER_SMTP_FROM"
PORTS = {"smtps": 465, "smtp": 587}
TIMEOUT_S = 60.0
TRIES, WAIT_S = 3, 20.0
REFUSED_LATER = range(400, 500)  # by SMTP's codes, what may go well a little later
SAID_CHARS = 300
# less than RFC 5321 allows: what servers take in practice, and nothing that could end a header
_ADDRESS = re.compile(
    r"[A-Za-z0-9!#$%&'*+/=?^_`{|}~.-]{1,64}@[A-Za-z0-9](?:[A-Za-z0-9.-]{0,252}[A-Za-z0-9])?"
)
_SEVERAL = re.compile(r"[,;\s]+")
_ESCAPE = re.compile(r"\\([\\`*_\[\]|~$#=:{+-])")
_BELOW = "<details>"
ATTACHED = "The whole report is attached: open report.html in a browser."


class Mail(Sender):
    """With `--smtp` mails are sent, else they are files in `--out`, by default `mails/` in the class's folder."""

    def __init__(self, settings: SendSettings) -> None:
        super().__init__(settings)
        self.sender = settings.sender or os.environ.get(FROM, "")
        if settings.smtp and not self.sender:
            raise UsageError("no address to send mails from", hint=f"give it with --from, or in {FROM}")
        if self.sender and not _ADDRESS.fullmatch(self.sender):
            raise UsageError(
                f"{line(self.sender, 80)} is not a mail address", hint="write it like name@example.org"
            )
        if settings.smtp and settings.out:
            raise UsageError(
                "--out is for mails that are written, and --smtp sends them", hint="leave out one"
            )
        self.server = MailServer(settings.smtp, self.sender) if settings.smtp else None
        self.unsure = "ask" if self.server else "again"

    @contextmanager
    def opened(self) -> Iterator[None]:
        """Be connected to the server, if mails are sent."""
        if self.server is None:
            yield
            return
        self.server.connect()
        try:
            yield
        finally:
            self.server.close()

    def place(self, feedback: Feedback) -> str:
        """Return the addresses."""
        return ", ".join(addresses(feedback.entry))

    def show(self, feedback: Feedback) -> str:
        """Return the mail with its headers, and what is attached."""
        message = self.message(feedback)
        headers = (f"{name}: {message[name]}" for name in ("From", "To", "Subject") if message[name])
        return "\n".join([*headers, "", letter(feedback), f"[attached: {PAGE}]"]) + "\n"

    def send(self, feedback: Feedback, *, look: bool = False) -> str:
        """Send or write the mail; return where it went."""
        del look
        data, to = self.message(feedback).as_bytes(policy=SMTP), addresses(feedback.entry)
        if self.server is None:
            path = (self.settings.out or self.settings.folder / "mails") / f"{feedback.name}.eml"
            atomic_write(path, data)
            return str(path)
        self.server.send(to, data)
        return ", ".join(to)

    def message(self, feedback: Feedback) -> EmailMessage:
        """Return the mail. The same feedback has the same Message-ID. Raises NotSent."""
        message = EmailMessage()
        if self.sender:
            message["From"] = self.sender
        try:
            message["To"] = [Address(addr_spec=to) for to in addresses(feedback.entry)]
        except (ValueError, IndexError) as error:
            raise NotSent(f"{line(self.place(feedback), 80)} is not a mail address") from error
        message["Subject"] = feedback.subject
        message["Date"] = format_datetime(datetime.now(timezone.utc))
        domain = self.sender.rpartition("@")[2] or "localhost"
        message["Message-ID"] = f"<{feedback.publication.digest[:32]}.{feedback.name}@{domain}>"
        # else a programme that answers for people on holiday would answer each (RFC 3834)
        message["Auto-Submitted"] = "auto-generated"
        message.set_content(letter(feedback))
        message.add_attachment(
            feedback.page, maintype="text", subtype="html", filename=PAGE, params={"charset": "utf-8"}
        )
        return message


def addresses(entry: Entry) -> list[str]:
    """Return the addresses in the roster's columns, several of a group. Raises NotSent."""
    extra = entry.extra
    known = kinds(extra, "canvas")
    fields = [
        extra[column] for kind in ("email", "login") for column, found in known.items() if found == kind
    ]
    fields += [entry.id]
    for field in fields:
        found = [part for part in _SEVERAL.split(field.strip()) if part]
        if found and all(_ADDRESS.fullmatch(part) for part in found):
            return found
    raise NotSent("no mail address is known", hint="give the roster a column `Email`")


def letter(feedback: Feedback) -> str:
    """Return the report's beginning as plain text: points, changes, what was lost."""
    above = feedback.text.partition(_BELOW)[0]
    plain = unescape(_ESCAPE.sub(r"\1", above)).replace("**", "").strip()
    return f"{plain.removeprefix('# ')}\n\n{ATTACHED}\n"


class MailServer:
    """A mail server at `smtps://HOST[:465]` (TLS from the start) or `smtp://HOST[:587]` (STARTTLS).

    Without TLS nothing is sent but to a server on this machine. What the server puts off is tried again.
    """

    def __init__(self, address: str, sender: str) -> None:
        try:
            parts = urlsplit(address if "://" in address else f"smtp://{address}")
            port = parts.port
        except ValueError:  # as of `smtp://[::1`, or a port above 65535
            parts, port = urlsplit(""), -1
        # a user's name is refused too: what comes with the command can be seen in the list of processes
        if parts.scheme not in PORTS or not parts.hostname or parts.path.strip("/") or parts.username:
            hint = f"write it like smtp://mail.example.org:587 or smtps://mail.example.org; {USER} logs in"
            raise UsageError("--smtp: this is not the address of a mail server", hint=hint)
        self.host, self.port = parts.hostname, port or PORTS[parts.scheme]
        self.tls = parts.scheme == "smtps"
        self.sender = sender
        self._smtp: smtplib.SMTP | None = None

    def connect(self) -> None:
        """Connect and log in. Raises HostError."""
        try:
            context = ssl.create_default_context()
            if self.tls:
                self._smtp = smtplib.SMTP_SSL(self.host, self.port, timeout=TIMEOUT_S, context=context)
            else:
                self._smtp = smtplib.SMTP(self.host, self.port, timeout=TIMEOUT_S)
                self._start_tls(self._smtp, context)
            user, password = os.environ.get(USER, ""), os.environ.get(PASSWORD, "")
            if user:
                self._smtp.login(user, password)
        except (OSError, smtplib.SMTPException) as error:
            self.close()
            hint = f"check --smtp, {USER} and {PASSWORD}"
            raise HostError(f"{self.host}:{self.port}: {_reply_text(error)}", hint=hint) from error

    def _start_tls(self, smtp: smtplib.SMTP, context: ssl.SSLContext) -> None:
        smtp.ehlo_or_helo_if_needed()
        if smtp.has_extn("starttls"):
            smtp.starttls(context=context)
            # what the server said before it was encrypted does not count (RFC 3207)
            smtp.ehlo()
        elif not _is_here(self.host):
            raise smtplib.SMTPNotSupportedError("the server offers no TLS, and marks are not sent without it")

    def close(self) -> None:
        """End the connection."""
        if self._smtp is not None:
            with suppress(OSError, smtplib.SMTPException):
                self._smtp.quit()
        self._smtp = None

    def send(self, to: list[str], data: bytes) -> None:
        """Send one mail. Raises NotSent, Unsure where the connection broke behind the mail's end, and HostError."""
        for left in reversed(range(TRIES)):
            self._reconnect()
            try:
                return self._send(to, data)
            except smtplib.SMTPResponseException as error:
                # else the server would take the next mail for a part of this one
                self._reset()
                if error.smtp_code not in REFUSED_LATER or not left:
                    raise NotSent(f"{self.host} says: {_reply_text(error)}") from error
            except (OSError, smtplib.SMTPException) as error:
                self.close()
                if not left:
                    raise NotSent(f"{self.host}: {_reply_text(error)}") from error
            time.sleep(WAIT_S)
        raise AssertionError

    def _reconnect(self) -> None:
        """Servers end a connection after a while, or after so many mails."""
        if self._smtp is not None:
            with suppress(OSError, smtplib.SMTPException):
                if self._smtp.noop()[0] == 250:
                    return
            self.close()
        self.connect()

    def _send(self, to: list[str], data: bytes) -> None:
        smtp = self._smtp
        assert smtp is not None  # noqa: S101 - connected before
        # step by step, since only after DATA can it be unknown whether the mail was sent
        for code, said in (smtp.mail(self.sender), *map(smtp.rcpt, to)):
            if code not in (250, 251):
                raise smtplib.SMTPResponseException(code, said)
        try:
            code, said = smtp.data(data)
        except smtplib.SMTPDataError:  # the server has answered, so it is known
            raise
        except (OSError, smtplib.SMTPException) as error:
            self.close()
            raise Unsure(
                f"the connection to {self.host} broke while the mail was sent, so it is not known whether it was",
                hint="ask the student; --only ID --again sends it once more",
            ) from error
        if code != 250:
            raise smtplib.SMTPResponseException(code, said)

    def _reset(self) -> None:
        try:
            if self._smtp is not None:
                self._smtp.rset()
        except (OSError, smtplib.SMTPException):
            self.close()


def _reply_text(error: Exception) -> str:
    if isinstance(error, smtplib.SMTPResponseException):
        said = error.smtp_error
        text = said.decode("utf-8", "replace") if isinstance(said, bytes) else said
        return line(f"{error.smtp_code} {text}", SAID_CHARS)
    return line(str(error) or type(error).__name__, SAID_CHARS)


def _is_here(host: str) -> bool:
    try:
        return host == "localhost" or ip_address(host).is_loopback
    except ValueError:
        return False
