"""A rubric by its address: one YAML file, whose digest is known before it is fetched.

What is in the cache has its digest for a name and is compared with it each time, so nothing there has to be trusted.
A rubric that brings files along (checks, packages, a starter) cannot be fetched so: take a second checkout.
"""

from __future__ import annotations

import hashlib
import re
import time
from http.client import HTTPException, HTTPMessage
from pathlib import Path
from typing import IO
from urllib.error import HTTPError, URLError
from urllib.parse import urlsplit
from urllib.request import HTTPRedirectHandler, Request, build_opener

from grader.errors import HostError, UsageError
from grader.files import atomic_write, make_folder, read_untrusted, user_folder

BYTES_MAX = 1 << 20
TIMEOUT_S, WHOLE_S = 20.0, 60.0
BLOCK_BYTES = 1 << 16


def fetch_rubric(url: str, digest: str) -> Path:
    """Return the file with that sha256, from the cache or from `url`.

    Raises UsageError where the address has no digest or another file, HostError where it cannot be fetched.
    """
    try:
        parts = urlsplit(url)
    except ValueError:  # as of `https://[x`
        parts = urlsplit("")
    # A password would be in results and logs, where the rubric's name is.
    if parts.scheme != "https" or "@" in parts.netloc:
        raise UsageError(
            f"{_printable(url.rpartition('@')[2])}: a rubric is fetched by https:// without a password only"
        )
    if not digest:
        raise UsageError(
            f"{_printable(url)}: a rubric's address needs the rubric's digest",
            hint="write #sha256: and the digest after it, as `grader rubric validate` prints it",
        )
    # The name is for people, since the folder has the digest. It comes from an address and must not be a path.
    name = re.sub(r"[^\w.-]", "", parts.path.rpartition("/")[2]).removesuffix(".yaml").strip(".")
    file = user_folder("cache") / "rubrics" / digest / f"{name or 'rubric'}.yaml"
    kept = read_untrusted(file, BYTES_MAX)
    if kept is not None and hashlib.sha256(kept).hexdigest() == digest:
        return file
    data = _download(url)
    found = hashlib.sha256(data).hexdigest()
    if found != digest:
        raise UsageError(
            f"{_printable(url)} is not the rubric that was pinned: its digest is sha256:{found}, not sha256:{digest}",
            hint="look at what has changed there before you pin it",
        )
    try:
        make_folder(file.parent)
    except OSError as error:
        raise HostError(f"{file.parent} cannot be written: {error.strerror}") from error
    atomic_write(file, data)
    return file


class _OnlyHttps(HTTPRedirectHandler):
    def redirect_request(  # noqa: PLR0917 - as its base has it
        self, req: Request, fp: IO[bytes], code: int, msg: str, headers: HTTPMessage, newurl: str
    ) -> Request | None:
        """Follow a redirection only to https://."""
        if urlsplit(newurl).scheme != "https":
            raise URLError("it is redirected to an address without https://")
        return super().redirect_request(req, fp, code, msg, headers, newurl)


def _download(url: str) -> bytes:
    end, data = time.monotonic() + WHOLE_S, b""
    try:
        with build_opener(_OnlyHttps).open(Request(url), timeout=TIMEOUT_S) as answer:  # noqa: S310 - https alone
            # `read` would wait for the whole: a server that sends a byte now and then is cut off by the clock.
            while block := answer.read1(BLOCK_BYTES):
                data += block
                if len(data) > BYTES_MAX:
                    raise UsageError(
                        f"{_printable(url)} has more than {BYTES_MAX >> 20} MB: it is not a rubric"
                    )
                if time.monotonic() > end:
                    raise HostError(
                        f"{_printable(url)} did not come within {WHOLE_S:g} s", hint="try it again"
                    )
    except HTTPError as error:
        raise UsageError(
            f"{_printable(url)} cannot be fetched: {error.code} {_printable(error.reason)}"
        ) from error
    except (OSError, HTTPException, ValueError) as error:
        reason = error.reason if isinstance(error, URLError) else error
        raise HostError(
            f"{_printable(url)} cannot be fetched: {_printable(str(reason))}", hint="try it again"
        ) from error
    return data


def _printable(text: str) -> str:
    return "".join(c if c.isprintable() else "?" for c in text)[:300]
