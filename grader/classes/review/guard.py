"""Who may ask: this machine's browser with the token of the address, and forms of our own pages alone."""

from __future__ import annotations

import secrets
from hmac import compare_digest

from flask import Flask, Response, redirect, request, session
from werkzeug.exceptions import Forbidden
from werkzeug.wrappers import Response as AnyResponse

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
"""Of a student's report, whatever it says of itself: it reaches nothing, asks nobody, and has an origin of its own."""
HEADERS = {
    "Cache-Control": "no-store",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "same-origin",
    "X-Content-Type-Options": "nosniff",
}


def guard(app: Flask, *, port: int, token: str) -> None:
    """Let nobody in but who came with the token. All other requests are answered 403, whatever they ask for."""
    app.config.update(
        SECRET_KEY=secrets.token_bytes(32),
        SESSION_COOKIE_NAME=f"grader-review-{port}",  # cookies do not tell ports apart
        SESSION_COOKIE_HTTPONLY=True,
        SESSION_COOKIE_SAMESITE="Strict",
        MAX_CONTENT_LENGTH=BODY_BYTES,
        MAX_FORM_MEMORY_SIZE=BODY_BYTES,
        MAX_FORM_PARTS=20,
    )
    hosts = {f"127.0.0.1:{port}", f"localhost:{port}"}

    def check() -> AnyResponse | None:
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
    """The token of the address for a cookie, and an address without it. Tabs that are open already stay as they are."""
    if not compare_digest(request.args["token"].encode(), token.encode()):
        raise Forbidden("This address is of another review. Open the one that `grader review` printed last.")
    session.setdefault("csrf", secrets.token_urlsafe(TOKEN_BYTES))
    return redirect("/", 303)


def _check_form() -> None:
    """Whether a request that changes something comes from a page of ours."""
    origin = request.headers.get("Origin")
    if origin is not None and origin != f"http://{request.headers['Host'].lower()}":
        raise Forbidden("This form is not of this page.")
    if not compare_digest(request.form.get("csrf", "").encode(), str(session["csrf"]).encode()):
        raise Forbidden(
            "This form is of another review. Go back, copy what you typed, and load the page anew."
        )


def _with_headers(response: Response) -> Response:
    for name, value in HEADERS.items():
        response.headers[name] = value
    response.headers.setdefault("Content-Security-Policy", PAGE)
    return response
