"""Who may ask, and for which files: a browser with the token of the address, forms of our own pages, known names."""

from __future__ import annotations

import os
import re
import secrets
from contextlib import suppress
from hmac import compare_digest
from pathlib import Path
from typing import BinaryIO

from flask import Flask, Response, redirect, request, session
from werkzeug.exceptions import Forbidden
from werkzeug.wrappers import Response as AnyResponse

from grader.files import open_untrusted
from grader.results import EVIDENCE, RESULT

TOKEN_BYTES = 24
BODY_BYTES = 64 << 10
SAFE = {"GET", "HEAD", "OPTIONS"}
PAGE = (
    "default-src 'none'; style-src 'self'; script-src 'self'; img-src 'self' data:; connect-src 'self'; "
    "frame-src 'self'; form-action 'self'; base-uri 'none'; frame-ancestors 'none'"
)
FRAMED = (
    "sandbox allow-scripts; default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:; "
    "form-action 'none'; base-uri 'none'; frame-ancestors 'self'"
)
"""Of a student's report, whatever it says of itself: it reaches nothing, asks no one, and has an origin of its own."""
HEADERS = {
    "Cache-Control": "no-store",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "same-origin",
    "X-Content-Type-Options": "nosniff",
}


def guard(app: Flask, *, port: int, token: str) -> None:
    """Let no one in but who came with the token. All other requests are answered 403, whatever they ask for."""
    app.config.update(
        SECRET_KEY=secrets.token_bytes(32),
        SESSION_COOKIE_NAME=f"grader-review-{port}",  # cookies do not tell ports apart
        SESSION_COOKIE_HTTPONLY=True,
        SESSION_COOKIE_SAMESITE="Strict",  # no other site's page can ask with this cookie
        MAX_CONTENT_LENGTH=BODY_BYTES,
        MAX_FORM_MEMORY_SIZE=BODY_BYTES,
        MAX_FORM_PARTS=20,
    )
    hosts = {f"127.0.0.1:{port}", f"localhost:{port}"}

    def check() -> AnyResponse | None:
        # another site's name may lead to this machine (DNS rebinding); its pages are not let in
        if request.headers.get("Host", "").lower() not in hosts:
            raise Forbidden("This page answers at 127.0.0.1 only.")
        if request.path == "/" and "token" in request.args and request.method == "GET":
            return _enter(token)
        if "csrf" not in session:
            raise Forbidden("Open the address that `grader review` printed in the terminal.")
        if request.method not in SAFE:
            _check_form()
        return None

    app.before_request(check)
    app.after_request(_with_headers)


def _enter(token: str) -> AnyResponse:
    """Give a cookie for the address's token, and the address without it. Tabs that are open stay as they are."""
    # a comparison that takes as long for a wrong token, however much of it is right
    if not compare_digest(request.args["token"].encode(), token.encode()):
        raise Forbidden(
            "This address belongs to another review. Open the one that `grader review` printed last."
        )
    session.setdefault("csrf", secrets.token_urlsafe(TOKEN_BYTES))
    return redirect("/", 303)


def _check_form() -> None:
    """Raise Forbidden unless a request that changes something comes from a page of ours."""
    origin = request.headers.get("Origin")
    # an old browser sends no origin; then what the form carries has to be enough
    if origin is not None and origin != f"http://{request.headers['Host'].lower()}":
        raise Forbidden("This form does not belong to this page.")
    if not compare_digest(request.form.get("csrf", "").encode(), str(session["csrf"]).encode()):
        raise Forbidden(
            "This form belongs to another review. Go back, copy what you typed, and reload the page."
        )


def _with_headers(response: Response) -> Response:
    for name, value in HEADERS.items():
        # style and script of this review are the same to its end, and say so themselves
        if name != "Cache-Control" or not response.cache_control.immutable:
            response.headers[name] = value
    response.headers.setdefault("Content-Security-Policy", PAGE)
    return response


# all but the page as plain text: whatever a student wrote there, no browser takes it for a page or a script
REPORTS = {
    "report.html": "text/html",
    "report.md": "text/plain",
    "console.log": "text/plain",
    "junit.xml": "text/plain",
    RESULT: "text/plain",
}
NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9._-]{0,150}")
LISTED_MAX = 200


def open_report(folder: Path, name: str) -> BinaryIO | None:
    """Return one of `REPORTS`; None where there is none, or it is not a file."""
    return _open(folder, name) if name in REPORTS else None


def open_evidence(folder: Path, name: str) -> BinaryIO | None:
    """Return a file of the evidence; None where there is none, or it is not a file."""
    return _open(folder, EVIDENCE, name) if NAME.fullmatch(name) else None


def reports_of(folder: Path) -> list[str]:
    """Return those of `REPORTS` that are there."""
    return [name for name in REPORTS if _exists(open_report(folder, name))]


def evidence_of(folder: Path) -> list[tuple[str, int]]:
    """Return the names and sizes in bytes of what `open_evidence` opens."""
    try:
        entries = [entry for entry in os.scandir(folder / EVIDENCE) if NAME.fullmatch(entry.name)]
        files = [entry for entry in entries if entry.is_file(follow_symlinks=False)]
        return sorted((entry.name, entry.stat(follow_symlinks=False).st_size) for entry in files)[:LISTED_MAX]
    except OSError:
        return []


def _exists(file: BinaryIO | None) -> bool:
    if file is not None:
        file.close()
    return file is not None


def _open(folder: Path, *below: str) -> BinaryIO | None:
    with suppress(OSError):
        return open_untrusted(folder, *below)
    return None
