"""The server of a review: loopback only, until Ctrl-C."""

from __future__ import annotations

import errno
import logging
import os
import secrets
import socket
import sys
import threading
import webbrowser
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from html import escape
from pathlib import Path

from waitress.server import create_server

from grader.classes.review.app import create_app
from grader.classes.review.guard import BODY_BYTES, TOKEN_BYTES
from grader.classes.review.session import ReviewSession
from grader.errors import HostError, UsageError
from grader.files import temporary_folder

HOST = "127.0.0.1"
THREADS = 6
# A browser asks for a page's parts at once; that one waits for a moment is nothing to tell an instructor.
logging.getLogger("waitress.queue").setLevel(logging.ERROR)


def serve(
    review: ReviewSession,
    *,
    port: int,
    author: str,
    opened: Callable[[str], None],
    ending: Callable[[int], None] = lambda _: None,
) -> bool:
    """Serve `review` until interrupted; `opened` is given the address with its token, and `ending` how many reports are
    still to be written at the end. Port 0 is any that is free.

    Return whether all that follows a decision is written. Raises UsageError where the port cannot be had.
    """
    with _bound(port) as listening:
        token = secrets.token_urlsafe(TOKEN_BYTES)
        number = listening.getsockname()[1]
        server = create_server(
            create_app(review, port=number, token=token, author=author),
            sockets=[listening],
            threads=THREADS,
            ident=None,  # no server's name in the headers
            max_request_body_size=2 * BODY_BYTES,
            max_request_header_size=2 * BODY_BYTES,
            clear_untrusted_proxy_headers=True,
        )
        review.start()
        try:
            opened(f"http://{HOST}:{number}/?token={token}")
            server.run()
        except KeyboardInterrupt:
            pass
        finally:
            server.close()
            ending(review.left())
            done = review.close()
    return done


@contextmanager
def _bound(port: int) -> Iterator[socket.socket]:
    listening = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    try:
        # the port of a review that has just ended can be had at once
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listening.bind((HOST, port))
        except OSError as error:
            why = "is in use" if error.errno == errno.EADDRINUSE else f"cannot be used: {error.strerror}"
            raise UsageError(f"port {port} {why}", hint="choose another --port, or none") from error
        yield listening
    finally:
        listening.close()


@contextmanager
def browser(address: str, *, wanted: bool) -> Iterator[bool]:
    """Open the address in the person's browser, where there is one, and give whether that was tried.

    The browser is given a file of this user's alone: all users of a machine may read the arguments of a program.
    """
    with ExitStack() as stack:
        # without a screen, Python would start a browser in this terminal
        screens = ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER")
        has_screen = sys.platform == "darwin" or any(os.environ.get(name) for name in screens)
        tried = wanted and has_screen
        if tried:
            try:
                page = stack.enter_context(temporary_folder("run")) / "review.html"
            except HostError:
                tried = False
            else:
                _write_page(page, address)
                # in a thread, since some browsers are waited for until they end
                threading.Thread(target=_open, args=(page,), daemon=True).start()
        yield tried


def _write_page(page: Path, address: str) -> None:
    # nobody may read the token between the two calls
    page.touch(mode=0o600)
    target = escape(address, quote=True)
    page.write_text(
        f'<!doctype html><meta charset="utf-8"><meta http-equiv="refresh" content="0; url={target}">'
    )


def _open(page: Path) -> None:
    with suppress(webbrowser.Error, OSError):
        webbrowser.open(page.as_uri())
