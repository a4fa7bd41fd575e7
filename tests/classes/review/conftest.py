"""A class, its review, and a browser that has come in with the token."""

from __future__ import annotations

import re
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from flask import Flask
from flask.testing import FlaskClient

from grader.classes.review.app import create_app
from grader.classes.review.session import Pace, ReviewSession, open_session
from tests.classes.review.a_class import a_class

PORT = 8123
HOST = f"127.0.0.1:{PORT}"
TOKEN = "the-token-of-the-address"  # noqa: S105 - made up
QUICK = Pace(quiet_s=0.01, latest_s=0.05, again_s=0.05)


@pytest.fixture(scope="session")
def made_class(tmp_path_factory) -> Path:
    """Made once; each test has a copy."""
    return a_class(tmp_path_factory.mktemp("class") / "out")


@pytest.fixture
def out(made_class, tmp_path) -> Path:
    """The folder of a class of five."""
    return Path(shutil.copytree(made_class, tmp_path / "out"))


@pytest.fixture
def review(out) -> Iterator[ReviewSession]:
    """Its review, which follows at once."""
    review = open_session(out, QUICK)
    review.start()
    yield review
    review.close()


@pytest.fixture
def app(review) -> Flask:
    return create_app(review, port=PORT, token=TOKEN, author="A. Miller")


@pytest.fixture
def page(app) -> Page:
    return Page(app)


class Client(FlaskClient):
    """Asks the host that the review answers to."""

    def __init__(self, app: Flask) -> None:
        super().__init__(app, app.response_class, use_cookies=True)

    def open(self, *args, **given):
        given.setdefault("base_url", f"http://{HOST}")
        given.setdefault("buffered", True)
        return super().open(*args, **given)


class Page:
    """A browser with the cookie: forms are sent with all that the page has in them, as it was when it was loaded."""

    def __init__(self, app: Flask) -> None:
        self.client = Client(app)
        entered = self.client.get(f"/?token={TOKEN}")
        assert entered.status_code == 303

    def text(self, path: str) -> str:
        """What stands at an address."""
        answer = self.client.get(path)
        assert answer.status_code == 200, answer.text
        return answer.text

    def form(self, key: str, criterion: str, path: str = "") -> dict[str, str]:
        """The hidden fields of a criterion's form."""
        text = self.text(path or f"/s/{key}/")
        action = re.escape(f'action="/s/{key}/c/{criterion}"')
        found = re.search(rf"<form[^>]*{action}.*?</form>", text, re.DOTALL)
        assert found, f"no form for {criterion}"
        return dict(re.findall(r'type="hidden" name="(\w+)" value="([^"]*)"', found.group()))

    def send(self, key: str, criterion: str, form: dict[str, str], *, script: bool = False, **fields: str):
        """Send that form with these fields."""
        headers = {"X-Asked-By": "script"} if script else {}
        return self.client.post(f"/s/{key}/c/{criterion}", data={**form, **fields}, headers=headers)

    def save(self, key: str, criterion: str, **fields: str):
        """Load the page and send its form."""
        return self.send(key, criterion, self.form(key, criterion), **fields)
