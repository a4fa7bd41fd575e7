"""GitLab: a comment on the commit that was graded, or an issue, through its REST API (docs.gitlab.com/api).

The token is in `GITLAB_TOKEN`, and for the server of `CI_SERVER_URL` alone, by default gitlab.com.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from typing import Any
from urllib.parse import quote, urlsplit

from grader.classes.feedback.forms import Settings
from grader.classes.feedback.rest import Api, Comments, Post, required_token


class GitLab(Comments):
    """One comment or issue for each student."""

    name, token = "GitLab", "GITLAB_TOKEN"

    def __init__(self, settings: Settings) -> None:
        super().__init__(settings)
        token = required_token(self.token, os.environ.get(self.token, ""))
        server = (
            os.environ.get("CI_SERVER_URL") or f"https://{os.environ.get('CI_SERVER_HOST') or 'gitlab.com'}"
        )
        self._address = server.rstrip("/")
        self.server = urlsplit(server).netloc.lower()
        base = os.environ.get("CI_API_V4_URL") or f"{self._address}/api/v4"
        self.api = Api(base, {"PRIVATE-TOKEN": token}, settings.told)

    def is_public(self, path: str) -> bool:
        """Return whether everybody can read the project, or everybody with an account."""
        return str(self.api.get(_at(path)).get("visibility")) != "private"

    def comment(self, path: str, commit: str, body: str) -> str:
        """Comment on a commit; GitLab tells no address of the comment, so it is the commit's."""
        self.api.post(f"{_at(path)}/repository/commits/{commit}/comments", {"note": body})
        return self._commit(path, commit)

    def comments(self, path: str, commit: str) -> Iterator[Post]:
        """Yield the comments on a commit."""
        for one in self.api.pages(f"{_at(path)}/repository/commits/{commit}/comments"):
            yield _post(one, self._commit(path, commit), "note")

    def open_issue(self, path: str, title: str, body: str) -> str:
        """Open an issue; in a project that others can read, one that only members see."""
        data = {"title": title, "description": body, "confidential": self.settings.public}
        return str(self.api.post(f"{_at(path)}/issues", data)["web_url"])

    def reply(self, path: str, issue: int, body: str) -> str:
        """Comment on an issue."""
        made = self.api.post(f"{_at(path)}/issues/{issue}/notes", {"body": body})
        return self._note(path, issue, made)

    def issues(self, path: str) -> Iterator[Post]:
        """Yield the issues."""
        for one in self.api.pages(f"{_at(path)}/issues?scope=all"):
            yield _post(one, str(one.get("web_url", "")), "description")

    def replies(self, path: str, issue: int) -> Iterator[Post]:
        """Yield the comments on an issue; what GitLab itself notes there is none."""
        for note in self.api.pages(f"{_at(path)}/issues/{issue}/notes"):
            if note.get("system") is not True:
                yield _post(note, self._note(path, issue, note), "body")

    def _commit(self, path: str, commit: str) -> str:
        return f"{self._address}/{path}/-/commit/{commit}"

    def _note(self, path: str, issue: int, note: dict[str, Any]) -> str:
        return f"{self._address}/{path}/-/issues/{issue}#note_{note.get('id', '')}"


def _at(path: str) -> str:
    return f"/projects/{quote(path, safe='')}"


def _post(one: dict[str, Any], address: str, body: str) -> Post:
    return Post(
        address=address,
        text=str(one.get(body) or ""),
        when=str(one.get("created_at") or ""),
        title=str(one.get("title") or ""),
        number=int(one.get("iid") or 0),
        is_open=one.get("state", "opened") == "opened",
        labels=tuple(map(str, one.get("labels") or ())),
    )
