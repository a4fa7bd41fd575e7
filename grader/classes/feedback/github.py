"""GitHub: a comment on the commit that was graded, or an issue, through its REST API (docs.github.com/rest).

The token is in `GITHUB_TOKEN` (or `GH_TOKEN`), and for `GITHUB_SERVER_URL` alone, by default github.com.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from typing import Any
from urllib.parse import quote, urlsplit

from grader.classes.feedback.forms import Settings
from grader.classes.feedback.rest import Api, Comments, Post, required_token

VERSION = "2022-11-28"


class GitHub(Comments):
    """One comment or issue for each student."""

    name, token = "GitHub", "GITHUB_TOKEN"

    def __init__(self, settings: Settings) -> None:
        super().__init__(settings)
        token = required_token(self.token, os.environ.get(self.token) or os.environ.get("GH_TOKEN", ""))
        server = os.environ.get("GITHUB_SERVER_URL") or "https://github.com"
        self.server = urlsplit(server).netloc.lower()
        own = "https://api.github.com" if self.server == "github.com" else f"{server.rstrip('/')}/api/v3"
        headers = {
            "Accept": "application/vnd.github+json",
            "Authorization": f"Bearer {token}",
            "X-GitHub-Api-Version": VERSION,
        }
        self.api = Api(os.environ.get("GITHUB_API_URL") or own, headers, settings.told)

    def is_public(self, path: str) -> bool:
        """Return whether the repository is not private."""
        return self.api.get(_at(path)).get("private") is not True

    def comment(self, path: str, commit: str, body: str) -> str:
        """Comment on a commit; return the comment's address."""
        return str(self.api.post(f"{_at(path)}/commits/{commit}/comments", {"body": body})["html_url"])

    def comments(self, path: str, commit: str) -> Iterator[Post]:
        """Yield the comments on a commit."""
        return _posts(self.api.pages(f"{_at(path)}/commits/{commit}/comments"))

    def open_issue(self, path: str, title: str, body: str) -> str:
        """Open an issue."""
        return str(self.api.post(f"{_at(path)}/issues", {"title": title, "body": body})["html_url"])

    def reply(self, path: str, issue: int, body: str) -> str:
        """Comment on an issue."""
        return str(self.api.post(f"{_at(path)}/issues/{issue}/comments", {"body": body})["html_url"])

    def issues(self, path: str) -> Iterator[Post]:
        """Yield the issues; a pull request is none."""
        found = self.api.pages(f"{_at(path)}/issues?state=all")
        return _posts(one for one in found if "pull_request" not in one)

    def replies(self, path: str, issue: int) -> Iterator[Post]:
        """Yield the comments on an issue."""
        return _posts(self.api.pages(f"{_at(path)}/issues/{issue}/comments"))


def _at(path: str) -> str:
    return f"/repos/{quote(path)}"


def _posts(found: Iterator[dict[str, Any]]) -> Iterator[Post]:
    for one in found:
        yield Post(
            address=str(one.get("html_url", "")),
            text=str(one.get("body") or ""),
            when=str(one.get("created_at") or ""),
            title=str(one.get("title") or ""),
            number=int(one.get("number") or 0),
            is_open=one.get("state", "open") == "open",
            labels=tuple(str(label["name"]) for label in one.get("labels") or () if isinstance(label, dict)),
        )
