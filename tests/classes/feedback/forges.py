"""Stand-ins of GitHub's and GitLab's REST APIs, after their published schemas, with limits and failures.

GitHub: docs.github.com/rest/commits/comments, /rest/issues/issues, /rest/issues/comments, /rest/repos/repos.
GitLab: docs.gitlab.com/api/commits, /api/issues, /api/notes, /api/projects.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from threading import Thread
from urllib.parse import parse_qs, unquote, urlsplit

TOKEN = "ghp_s3cret"  # noqa: S105 - of a stand-in
Answer = tuple[int, object]


@dataclass
class Repo:
    """What a forge has of a repository: comments by commit, and issues with their comments."""

    commits: tuple[str, ...]
    private: bool = True
    comments: list[dict[str, str]] = field(default_factory=list)
    issues: list[dict[str, object]] = field(default_factory=list)
    notes: list[tuple[int, str]] = field(default_factory=list)


@dataclass(frozen=True)
class Failure:
    """An answer in place of the real one, `done` if the request is carried out all the same; 0 hangs up."""

    status: int
    headers: dict[str, str] = field(default_factory=dict)
    message: str = ""
    done: bool = False


class Forge(ThreadingHTTPServer):
    """`failures` come first, one for each request that writes."""

    daemon_threads = True

    def __init__(self, answer: Callable[[Forge, str, str, dict[str, object], int], Answer]) -> None:
        super().__init__(("127.0.0.1", 0), _Handler)
        self.answer = answer
        self.repos: dict[str, Repo] = {}
        self.failures: list[Failure] = []
        self.asked: list[tuple[str, str]] = []
        self.moved: dict[str, str] = {}

    @property
    def address(self) -> str:
        return f"http://127.0.0.1:{self.server_address[1]}"

    def handle_error(self, request: object, client_address: object) -> None:
        """A connection that is dropped on purpose is no matter of the tests."""


class _Handler(BaseHTTPRequestHandler):
    server: Forge

    def do_GET(self) -> None:
        self._do({})

    def do_POST(self) -> None:
        length = int(self.headers["Content-Length"])
        assert self.headers["Content-Type"] == "application/json"
        self._do(json.loads(self.rfile.read(length)))

    def _do(self, data: dict[str, object]) -> None:
        parts = urlsplit(self.path)
        self.server.asked.append((self.command, parts.path))
        assert self.headers["User-Agent"].startswith("ros-lab-grader/")
        if TOKEN not in (self.headers["PRIVATE-TOKEN"], (self.headers["Authorization"] or "")[7:]):
            self._end(401, {}, {"message": "Bad credentials"})
            return
        moved = next((new for old, new in self.server.moved.items() if parts.path.startswith(old)), "")
        if moved:
            self._end(307, {"Location": moved}, {"message": "Moved Permanently"})
            return
        failure = self.server.failures.pop(0) if self.command == "POST" and self.server.failures else None
        page = int(parse_qs(parts.query).get("page", ["1"])[0])
        if failure is None or failure.done:
            status, answer = self.server.answer(self.server, self.command, parts.path, data, page)
        if failure is None:
            self._end(status, {}, answer)
        elif failure.status:
            self._end(failure.status, failure.headers, {"message": failure.message})
        else:
            self.connection.close()

    def _end(self, status: int, headers: dict[str, str], data: object) -> None:
        body = json.dumps(data).encode()
        self.send_response(status)
        for name, value in {**headers, "Content-Length": str(len(body))}.items():
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, *_: object) -> None:
        """Tests are quiet."""


def github(  # noqa: PLR0911 - a return for each kind of request
    forge: Forge, method: str, path: str, data: dict[str, object], page: int
) -> Answer:
    """Answer as api.github.com, version 2022-11-28."""
    found = re.fullmatch(r"/repos/([^/]+/[^/]+)(/.*)?", path)
    repo = forge.repos.get(found[1]) if found else None
    if found is None or repo is None:
        return 404, {"message": "Not Found"}
    rest, web = found[2] or "", f"https://github.com/{found[1]}"
    if not rest:
        return 200, {"full_name": found[1], "private": repo.private, "visibility": "private"}
    if commit := re.fullmatch(r"/commits/(\w+)/comments", rest):
        if commit[1] not in repo.commits:
            return 422, {"message": f"No commit found for SHA: {commit[1]}"}
        if method == "GET":
            here = [one for one in repo.comments if one["commit_id"] == commit[1]]
            return 200, here[100 * (page - 1) : 100 * page]
        number = len(repo.comments) + 1
        repo.comments.append(
            {
                "commit_id": commit[1],
                "body": str(data["body"]),
                "html_url": f"{web}/commit/{commit[1]}#commitcomment-{number}",
            }
        )
        return 201, repo.comments[-1]
    if rest == "/issues":
        if method == "GET":
            return 200, repo.issues[100 * (page - 1) : 100 * page]
        number = len(repo.issues) + 1
        repo.issues.append({"number": number, **data, "html_url": f"{web}/issues/{number}"})
        return 201, repo.issues[-1]
    if issue := re.fullmatch(r"/issues/(\d+)/comments", rest):
        address = f"{web}/issues/{issue[1]}#issuecomment-"
        if method == "GET":
            return 200, [{"html_url": address, "body": body} for n, body in repo.notes if n == int(issue[1])]
        repo.notes.append((int(issue[1]), str(data["body"])))
        return 201, {"html_url": f"{address}{len(repo.notes)}", "body": data["body"]}
    return 404, {"message": "Not Found"}


def gitlab(  # noqa: PLR0911 - as above
    forge: Forge, method: str, path: str, data: dict[str, object], page: int
) -> Answer:
    """Answer as gitlab.com/api/v4."""
    found = re.fullmatch(r"/api/v4/projects/([^/]+)(/.*)?", path)
    repo = forge.repos.get(unquote(found[1])) if found else None
    if found is None or repo is None:
        return 404, {"message": "404 Project Not Found"}
    rest, web = found[2] or "", f"{forge.address}/{unquote(found[1])}/-"
    if not rest:
        return 200, {"id": 1, "visibility": "private" if repo.private else "internal"}
    if commit := re.fullmatch(r"/repository/commits/(\w+)/comments", rest):
        if commit[1] not in repo.commits:
            return 404, {"message": "404 Commit Not Found"}
        if method == "GET":
            here = [{"note": one["body"]} for one in repo.comments if one["commit_id"] == commit[1]]
            return 200, here[100 * (page - 1) : 100 * page]
        repo.comments.append({"commit_id": commit[1], "body": str(data["note"])})
        return 201, {"note": data["note"], "path": None, "line": None, "line_type": None}
    if rest == "/issues":
        if method == "GET":
            return 200, repo.issues[100 * (page - 1) : 100 * page]
        number = len(repo.issues) + 1
        repo.issues.append({"iid": number, **data, "web_url": f"{web}/issues/{number}"})
        return 201, repo.issues[-1]
    if issue := re.fullmatch(r"/issues/(\d+)/notes", rest):
        if method == "GET":
            return 200, [{"id": 1, "body": body} for n, body in repo.notes if n == int(issue[1])]
        repo.notes.append((int(issue[1]), str(data["body"])))
        return 201, {"id": len(repo.notes), "body": data["body"]}
    return 404, {"message": "404 Not Found"}


@contextmanager
def forge(answer: Callable[[Forge, str, str, dict[str, object], int], Answer]) -> Iterator[Forge]:
    """Run a stand-in."""
    with Forge(answer) as made:
        thread = Thread(target=made.serve_forever, kwargs={"poll_interval": 0.01}, daemon=True)
        thread.start()
        yield made
        made.shutdown()
        thread.join()
