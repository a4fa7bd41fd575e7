"""GitHub and GitLab: a comment on the commit that was graded, or an issue, which later feedback is added to.

Each body ends with a mark that says what it is, so that a comment can be found of which nobody knows whether it was
made, and what students answer can be told from it. A token goes to one server alone: GitHub's is in `GITHUB_TOKEN` (or
`GH_TOKEN`), for `GITHUB_SERVER_URL`, by default github.com; GitLab's in `GITLAB_TOKEN`, for `CI_SERVER_URL`, by default
gitlab.com. Their REST APIs: docs.github.com/rest, docs.gitlab.com/api.
"""

from __future__ import annotations

import json
import os
import re
import time
from abc import abstractmethod
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from http.client import HTTPException
from itertools import chain
from types import MappingProxyType
from typing import Any
from urllib.error import HTTPError, URLError
from urllib.parse import SplitResult, quote, unquote, urljoin, urlsplit
from urllib.request import HTTPRedirectHandler, Request, build_opener

from grader import __version__
from grader.classes.feedback.forms import Feedback, Sender, SendSettings, Unsure
from grader.errors import GraderError, HostError, NotSent, UsageError
from grader.intake.credentials import helper_password
from grader.intake.source import parse_source
from grader.model.batch import Entry
from grader.untrusted_text import line

TIMEOUT_S = 60.0
TRIES = 4
PAUSE_S = 1.0
"""Between two things that are written: GitHub asks for it."""
# GitHub's limits end within an hour; WAIT_MAX_S is a little more
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

    # not `redirect_request`: before that, Python parses the address, which may be none
    def http_error_302(self, *_args: object, **_words: object) -> None:
        """Follow none."""

    http_error_301 = http_error_303 = http_error_307 = http_error_308 = http_error_302


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
        parts = split_address(base)
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
        """Return what is there. Raises Refused, NoAnswer."""
        # only what reads is asked again: what writes may have been carried out
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
        """Return what was made. Raises Refused; NoAnswer where nobody knows whether it was made."""
        self._sleep(max(0.0, self._next_write - time.monotonic()))
        try:
            return self._ask("POST", path, json.dumps(data).encode())
        # after a failure too: the server counts every request
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
                # a server that failed may have done it before
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
        with suppress(ValueError):  # as of `https://[`
            there = urljoin(url, answer.headers.get("location", ""))
            if urlsplit(there)[:2] == urlsplit(url)[:2]:
                return there
        raise Refused(answer.status, "it is on another server now")


def split_address(address: str) -> SplitResult:
    """Return the parts of a server's address. Raises UsageError."""
    try:
        return urlsplit(address)
    except ValueError as error:
        raise UsageError(f"{line(address, 200)}: this is not the address of a server") from error


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
    # the names of these headers on GitHub, and on GitLab
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
    # anything else fits in no header of HTTP
    if not token.isascii() or not token.isprintable():
        raise UsageError(f"{name} holds no token", hint=f"export {name}=… with the right to write comments")
    return token


MARK = "<!-- ros-lab-grader feedback "
_SCP = re.compile(r"(?:[\w.+-]+@)?(?P<host>[\w.-]+):(?P<path>(?!/).+)")
_ISSUE = re.compile(r"/(?:issues|work_items)/(\d+)")
API_VERSION = "2022-11-28"
"""Of GitHub's REST API."""


def host_and_path(address: str) -> tuple[str, str]:
    """Return the server and the path of a repository's address, `org/name`. Raises NotSent."""
    try:
        source = parse_source(address)
    except GraderError as error:
        raise NotSent(error.message, hint=error.hint) from error
    if not source.remote:
        raise NotSent(
            "no repository on a server was submitted", hint="return it by another form: --form folder"
        )
    found = _SCP.fullmatch(source.url) if "://" not in source.url else None
    parts = urlsplit(source.url)
    host = found["host"] if found else parts.netloc.rpartition("@")[2]
    # of an ssh address the port is the ssh server's, and not that of the pages
    if not found and parts.scheme not in ("http", "https"):
        host = parts.hostname or ""
    path = unquote(found["path"] if found else parts.path).strip("/").removesuffix(".git")
    return host.lower(), path


@dataclass(frozen=True, kw_only=True)
class Post:
    """An issue, by its `number`, or a comment; `when` is an ISO 8601 time."""

    address: str
    text: str
    when: str = ""
    title: str = ""
    number: int = 0
    is_open: bool = True
    labels: tuple[str, ...] = ()


class Comments(Sender):
    """A forge on which comments are made. `server` is the host in addresses of its repositories."""

    unsure = "look"
    name = server = token = ""
    api: Api
    commits, notes = "commits", "comments"
    comment_text = issue_text = "body"
    all_issues = "state=all"
    issue_fields: Mapping[str, object] = MappingProxyType({})
    """What else is said of a new issue."""

    def place(self, feedback: Feedback) -> str:
        """Return the commit, or the repository whose issue it will be. Raises NotSent."""
        path = self.path(feedback.entry)
        if self.settings.issues:
            return f"{self.server}/{path}: {feedback.last_place or 'a new issue'}"
        if not feedback.commit:
            raise NotSent("no commit is known that was graded", hint="--issues opens an issue instead")
        return f"{self.server}/{path}: commit {feedback.commit[:12]}"

    def path(self, entry: Entry) -> str:
        """Return the repository's path on this server. Raises NotSent."""
        host, path = host_and_path(entry.source)
        if host != self.server or "/" not in path:
            raise NotSent(f"its repository is not on {self.server}: {line(entry.source, 200)}")
        return path

    def show(self, feedback: Feedback) -> str:
        """Return the comment, with the mark that says what it is."""
        return f"{feedback.text.rstrip()}\n\n{mark(feedback)}\n"

    def send(self, feedback: Feedback, *, look: bool = False) -> str:
        """Make the comment or the issue; return its address."""
        path = self.path(feedback.entry)
        with self._asking(self.place(feedback)):
            if not self.settings.public and self.is_public(path):
                raise NotSent(
                    "everybody can read this repository, and so everybody could read the feedback",
                    hint="--public returns it all the same",
                )
            return self._once(feedback, path, look=look)

    def _once(self, feedback: Feedback, path: str, *, look: bool) -> str:
        """Make it, and look whether it is there where that is not known."""
        for left in reversed(range(TRIES)):
            if look and (found := self._find_comment(feedback, path)):
                return found
            try:
                return self._make(feedback, path)
            except NoAnswer as error:
                # The forge may have made it all the same: without a look, the student could get it twice.
                look = True
                if not left:
                    raise Unsure(
                        f"{self.server}: {error}", hint="the same command looks, and tries it again"
                    ) from error
        raise AssertionError

    def _make(self, feedback: Feedback, path: str) -> str:
        body = self.show(feedback)
        if not self.settings.issues:
            return self.comment(path, feedback.commit, body)
        issue = _ISSUE.search(feedback.last_place)
        if issue:
            try:
                return self.reply(path, int(issue[1]), body)
            except Refused as error:
                if error.status not in (404, 410):
                    raise
                # The issue is gone: the feedback goes into a new one.
        return self.open_issue(path, feedback.subject, body)

    def _find_comment(self, feedback: Feedback, path: str) -> str:
        issue = _ISSUE.search(feedback.last_place)
        if not self.settings.issues:
            found = self.comments(path, feedback.commit)
        else:
            found = chain(self.issues(path), self.replies(path, int(issue[1])) if issue else ())
        return next((post.address for post in found if mark(feedback) in post.text), "")

    def questions(self, entry: Entry, commit: str, label: str = "") -> Iterator[Post]:
        """Yield what a student asks: each open issue (with that label), each answer to feedback, in an issue or on the
        commit. Raises NotSent."""
        path = self.path(entry)
        with self._asking(f"{self.server}/{path}"):
            for post in self.issues(path):
                if MARK in post.text:
                    yield from (reply for reply in self.replies(path, post.number) if MARK not in reply.text)
                elif post.is_open and (not label or label in post.labels):
                    yield post
            if commit:
                yield from (post for post in self.comments(path, commit) if MARK not in post.text)

    @contextmanager
    def _asking(self, where: str) -> Iterator[None]:
        """Turn a refusal, or no answer, into an error of ours about that place."""
        try:
            yield
        except Refused as error:
            raise self._error(error, where) from error
        except NoAnswer as error:
            raise NotSent(f"{self.server}: {error}", hint="the same command tries it again") from error

    def _error(self, error: Refused, where: str) -> GraderError:
        if error.status == 401:
            return HostError(
                f"{self.server} does not take the token: {error.text}", hint=f"set {self.token} again"
            )
        hints = {
            403: "the token does not have that permission there",
            404: "check the address, and what the token can access",
            410: "issues are switched off there",
        }
        return NotSent(
            f"{where}: {self.name} says {error.status} {error.text}".rstrip(),
            hint=hints.get(error.status, ""),
        )

    @abstractmethod
    def is_public(self, path: str) -> bool:
        """Return whether everybody can read the repository, or everybody with an account."""

    @abstractmethod
    def repository(self, path: str) -> str:
        """Return the place of a repository below the API's address."""

    @abstractmethod
    def address(self, one: dict[str, Any], path: str, below: str) -> str:
        """Return where people read a record of the API, which `below` names in a repository's pages."""

    def comment(self, path: str, commit: str, body: str) -> str:
        """Comment on a commit; return the comment's address."""
        made = self.api.post(self._comments_place(path, commit), {self.comment_text: body})
        return self.address(made, path, f"commit/{commit}")

    def comments(self, path: str, commit: str) -> Iterator[Post]:
        """Yield each comment on a commit."""
        for one in self.api.pages(self._comments_place(path, commit)):
            yield _post(one, self.address(one, path, f"commit/{commit}"), self.comment_text)

    def open_issue(self, path: str, title: str, body: str) -> str:
        """Open an issue; return its address."""
        data = {"title": title, self.issue_text: body, **self.issue_fields}
        return self.address(self.api.post(f"{self.repository(path)}/issues", data), path, "issues")

    def reply(self, path: str, issue: int, body: str) -> str:
        """Comment on an issue; return the comment's address."""
        made = self.api.post(self._replies_place(path, issue), {"body": body})
        return self.address(made, path, f"issues/{issue}#note_{made.get('id', '')}")

    def issues(self, path: str) -> Iterator[Post]:
        """Yield each issue; a pull request is none."""
        for one in self.api.pages(f"{self.repository(path)}/issues?{self.all_issues}"):
            # GitHub lists pull requests among the issues
            if "pull_request" not in one:
                yield _post(one, self.address(one, path, "issues"), self.issue_text)

    def replies(self, path: str, issue: int) -> Iterator[Post]:
        """Yield each comment on an issue; what GitLab itself notes there is none."""
        for one in self.api.pages(self._replies_place(path, issue)):
            if one.get("system") is not True:
                yield _post(one, self.address(one, path, f"issues/{issue}#note_{one.get('id', '')}"))

    def _comments_place(self, path: str, commit: str) -> str:
        return f"{self.repository(path)}/{self.commits}/{commit}/comments"

    def _replies_place(self, path: str, issue: int) -> str:
        return f"{self.repository(path)}/issues/{issue}/{self.notes}"


def _post(one: dict[str, Any], address: str, text: str = "body") -> Post:
    """Return a record of the API; `text` is the key of what it says."""
    labels = (label.get("name") if isinstance(label, dict) else label for label in one.get("labels") or ())
    return Post(
        address=address,
        text=str(one.get(text) or ""),
        when=str(one.get("created_at") or ""),
        title=str(one.get("title") or ""),
        number=int(one.get("number") or one.get("iid") or 0),
        is_open=one.get("state", "open") in {"open", "opened"},
        labels=tuple(map(str, labels)),
    )


def mark(feedback: Feedback) -> str:
    """Return what is in the comment for the grader alone."""
    return f"{MARK}{feedback.publication.digest} -->"


class GitHubComments(Comments):
    """One comment or issue for each student."""

    name, token = "GitHub", "GITHUB_TOKEN"

    def __init__(self, settings: SendSettings) -> None:
        super().__init__(settings)
        server = os.environ.get("GITHUB_SERVER_URL") or "https://github.com"
        self.server = split_address(server).netloc.lower()
        token = token_for(server, self.token, "GH_TOKEN")
        own = "https://api.github.com" if self.server == "github.com" else f"{server.rstrip('/')}/api/v3"
        headers = {
            "Accept": "application/vnd.github+json",
            "Authorization": f"Bearer {token}",
            "X-GitHub-Api-Version": API_VERSION,
        }
        self.api = Api(os.environ.get("GITHUB_API_URL") or own, headers, settings.told)

    def is_public(self, path: str) -> bool:
        """Return whether the repository is not private."""
        # where it does not say, the safe answer is that everybody can read it
        return self.api.get(self.repository(path)).get("private") is not True

    def repository(self, path: str) -> str:
        return f"/repos/{quote(path)}"

    def address(self, one: dict[str, Any], path: str, below: str) -> str:
        """Return what GitHub says."""
        del path, below
        return str(one.get("html_url", ""))


class GitLabComments(Comments):
    """One comment or issue for each student."""

    name, token = "GitLab", "GITLAB_TOKEN"
    commits, notes = "repository/commits", "notes"
    comment_text, issue_text, all_issues = "note", "description", "scope=all"

    def __init__(self, settings: SendSettings) -> None:
        super().__init__(settings)
        server = (
            os.environ.get("CI_SERVER_URL") or f"https://{os.environ.get('CI_SERVER_HOST') or 'gitlab.com'}"
        )
        self.server = split_address(server).netloc.lower()
        token = token_for(server, self.token)
        self._address = server.rstrip("/")
        base = os.environ.get("CI_API_V4_URL") or f"{self._address}/api/v4"
        self.api = Api(base, {"Authorization": f"Bearer {token}"}, settings.told)
        # in a project that others can read, only members see an issue
        self.issue_fields = {"confidential": settings.public}

    def is_public(self, path: str) -> bool:
        return str(self.api.get(self.repository(path)).get("visibility")) != "private"

    def repository(self, path: str) -> str:
        # GitLab takes the whole path as one part of the address, so its slashes are written as %2F
        return f"/projects/{quote(path, safe='')}"

    def address(self, one: dict[str, Any], path: str, below: str) -> str:
        """Return the place in the project's pages: only of issues GitLab says it."""
        return str(one.get("web_url") or f"{self._address}/{path}/-/{below}")
