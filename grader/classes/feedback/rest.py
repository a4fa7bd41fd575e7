"""JSON over HTTP as forges speak it: a token for one server, and limits that are respected."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from http.client import HTTPException
from typing import Any
from urllib.error import HTTPError, URLError
from urllib.parse import urljoin, urlsplit
from urllib.request import HTTPRedirectHandler, Request, build_opener

from grader import __version__
from grader.errors import HostError, UsageError
from grader.intake.credentials import helper_password
from grader.untrusted_text import line

TIMEOUT_S = 60.0
TRIES = 4
PAUSE_S = 1.0
"""Between two things that are written: GitHub asks for it."""
WAIT_S, WAIT_MAX_S = 60.0, 3900.0
ANSWER_BYTES_MAX = 16 << 20
SAID_CHARS = 300
PAGES_MAX = 50
_LOCAL = {"localhost", "127.0.0.1", "::1"}


class Refused(Exception):
    """The server answered with an error. `text` is what it said."""

    def __init__(self, status: int, text: str) -> None:
        super().__init__(f"{status} {text}")
        self.status, self.text = status, text


class NoAnswer(Exception):
    """No answer came, or one that says nothing of whether the request was carried out."""


class _NoRedirect(HTTPRedirectHandler):
    """A redirect could carry the token to another server."""

    def redirect_request(self, *_args: object, **_words: object) -> None:
        """Follow none."""


@dataclass(frozen=True)
class _Answer:
    status: int
    headers: Mapping[str, str]
    data: bytes


class Api:
    """The server at `base`, for who knows the token in `headers`. `told` gets a line where something is waited for."""

    def __init__(
        self,
        base: str,
        headers: Mapping[str, str],
        told: Callable[[str], None],
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        parts = urlsplit(base)
        if parts.scheme != "https" and not (parts.scheme == "http" and parts.hostname in _LOCAL):
            raise UsageError(f"{line(base, 200)}: a token is sent by https:// only")
        self.base = base.rstrip("/")
        self._headers = {
            "User-Agent": f"ros-lab-grader/{__version__}",
            "Accept": "application/json",
            **headers,
        }
        self._told, self._sleep = told, sleep
        self._opener = build_opener(_NoRedirect)
        self._next_write = 0.0

    def get(self, path: str) -> Any:  # noqa: ANN401 - JSON
        """Return what is there. Raises Refused, Broken."""
        for failed in range(1, TRIES):
            with suppress(NoAnswer):
                return self._ask("GET", path, None)
            self._sleep(2.0**failed)
        return self._ask("GET", path, None)

    def pages(self, path: str) -> Iterator[dict[str, Any]]:
        """Yield the records of a list, page by page."""
        for page in range(1, PAGES_MAX + 1):
            found = self.get(f"{path}{'&' if '?' in path else '?'}per_page=100&page={page}")
            yield from (record for record in found if isinstance(record, dict))
            if len(found) < 100:
                return

    def post(self, path: str, data: Mapping[str, object]) -> Any:  # noqa: ANN401 - JSON
        """Return what was made. Raises Refused; Broken where nobody knows whether it was made."""
        self._sleep(max(0.0, self._next_write - time.monotonic()))
        try:
            return self._ask("POST", path, json.dumps(data).encode())
        finally:
            self._next_write = time.monotonic() + PAUSE_S

    def _ask(self, method: str, path: str, data: bytes | None) -> Any:  # noqa: ANN401 - JSON
        url, limited, moved = f"{self.base}{path}", 0, 0
        while True:
            answer = self._answer(method, url, data)
            if answer.status < 300:
                return _json(answer.data)
            if answer.status in (301, 302, 307, 308) and moved < 3:
                url, moved = self._new_address(url, answer), moved + 1
                continue
            wait_s = _wait_s(answer, limited)
            if wait_s is None or limited >= TRIES:
                if answer.status >= 500:
                    raise NoAnswer(f"{answer.status} {_error_text(answer)}")
                raise Refused(answer.status, _error_text(answer))
            if wait_s > WAIT_MAX_S:
                raise HostError(
                    f"{self.base}: too many requests, for {wait_s / 60:.0f} minutes",
                    hint="the same command continues then",
                )
            limited += 1
            self._told(f"{urlsplit(self.base).hostname}: too many requests: waiting {wait_s:.0f} s")
            self._sleep(wait_s)

    def _answer(self, method: str, url: str, data: bytes | None) -> _Answer:
        headers = {**self._headers, **({"Content-Type": "application/json"} if data is not None else {})}
        request = Request(url, data=data, method=method, headers=headers)  # noqa: S310 - checked above
        try:
            with self._opener.open(request, timeout=TIMEOUT_S) as response:
                return _Answer(response.status, _lower(response.headers), response.read(ANSWER_BYTES_MAX))
        except HTTPError as error:
            with error:
                return _Answer(error.code, _lower(error.headers), error.read(ANSWER_BYTES_MAX))
        except (URLError, OSError, HTTPException) as error:
            reason = error.reason if isinstance(error, URLError) else error
            raise NoAnswer(line(str(reason) or type(error).__name__, SAID_CHARS)) from error

    def _new_address(self, url: str, answer: _Answer) -> str:
        """Return where a repository that was renamed is, on the same server."""
        there = urljoin(url, answer.headers.get("location", ""))
        if urlsplit(there)[:2] != urlsplit(url)[:2]:
            raise Refused(answer.status, "it is on another server now")
        return there


def _lower(headers: Any) -> dict[str, str]:  # noqa: ANN401 - a message of http.client
    return {name.lower(): value for name, value in headers.items()}


def _json(data: bytes) -> Any:  # noqa: ANN401 - JSON
    try:
        return json.loads(data or b"null")
    except ValueError as error:
        raise NoAnswer("the answer is not JSON") from error


def _error_text(answer: _Answer) -> str:
    try:
        found = json.loads(answer.data)
        said = found.get("message") or found.get("error") if isinstance(found, dict) else ""
    except ValueError:
        said = ""
    return line(said if isinstance(said, str) else json.dumps(said), SAID_CHARS)


def _wait_s(answer: _Answer, times: int) -> float | None:
    """Return how long a server that has too much to do wants to be left alone; None if that is not what it says."""
    headers = answer.headers
    exhausted = "0" in (headers.get("x-ratelimit-remaining"), headers.get("ratelimit-remaining"))
    limited = "rate limit" in _error_text(answer).lower() or "retry-after" in headers or exhausted
    if answer.status != 429 and not (answer.status in (403, 503) and limited):
        return None
    if (after := headers.get("retry-after", "")).isdecimal():
        return float(after)
    reset = headers.get("x-ratelimit-reset") or headers.get("ratelimit-reset") or ""
    if exhausted and reset.isdecimal():
        return max(1.0, float(reset) - time.time() + 1)
    return WAIT_S * 2.0**times


def token_for(server: str, name: str, *more: str) -> str:
    """Return the token for a server's address: of the first of these variables that is set, else what git's own
    credential helpers have. Raises UsageError."""
    given = next(filter(None, (os.environ.get(one, "").strip() for one in (name, *more))), "")
    token = given or helper_password(server).strip()
    if not token:
        raise UsageError(
            f"there is no token for {server}: {name} is not set, and git's credential helpers have none",
            hint=f"export {name}=… with the right to write comments",
        )
    if not token.isascii() or not token.isprintable():
        raise UsageError(f"{name} holds no token", hint=f"export {name}=… with the right to write comments")
    return token
