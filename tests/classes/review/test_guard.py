"""Nobody but the one with the address gets in, and no report reaches out."""

from __future__ import annotations

import logging
import os
import re
import shutil
from collections.abc import Iterator

import pytest
from flask import Flask

from grader.classes.review.app import create_app
from grader.classes.review.session import open_session
from tests.classes.review.conftest import HOST, PORT, QUICK, TOKEN, Client, Page

PATHS = [
    "/",
    "/s/ada/",
    "/s/ada/report/report.html",
    "/look.css",
    "/review.js",
    "/nowhere",
    "/favicon.ico",
    "//",
]


@pytest.fixture(scope="module")
def guarded(made_class, tmp_path_factory) -> Iterator[Flask]:
    """A review that nobody gets into: nothing of it is changed."""
    out = shutil.copytree(made_class, tmp_path_factory.mktemp("guarded") / "out")
    review = open_session(out, QUICK)
    review.start()
    yield create_app(review, port=PORT, token=TOKEN, author="A. Miller")
    review.close()


@pytest.fixture
def stranger(guarded) -> Client:
    return Client(guarded)


@pytest.mark.parametrize("method", ["GET", "POST", "PUT", "OPTIONS", "HEAD", "TRACE"])
def test_without_the_cookie_everything_is_403(stranger, method) -> None:
    assert [stranger.open(path, method=method).status_code for path in PATHS] == [403] * len(PATHS)


@pytest.mark.parametrize("token", ["", "x", TOKEN[:-1], TOKEN + "x", TOKEN.upper(), "ü"])
def test_a_wrong_token_is_403_and_gives_no_cookie(stranger, token) -> None:
    answer = stranger.get("/", query_string={"token": token})
    assert answer.status_code == 403
    assert "Set-Cookie" not in answer.headers


def test_the_token_becomes_a_cookie_and_leaves_the_address(stranger) -> None:
    answer = stranger.get("/", query_string={"token": TOKEN})
    assert answer.status_code == 303
    assert answer.headers["Location"] == "/"
    cookie = answer.headers["Set-Cookie"]
    assert "HttpOnly" in cookie
    assert "SameSite=Strict" in cookie
    assert "Domain" not in cookie
    assert str(PORT) in cookie.split("=")[0]
    assert TOKEN not in cookie
    assert TOKEN not in stranger.get("/").text


def test_coming_in_twice_keeps_what_other_tabs_have_open(page) -> None:
    form = page.form("ada", "style")
    assert page.client.get(f"/?token={TOKEN}").status_code == 303
    assert page.send("ada", "style", form, points="3").status_code == 303


def test_a_made_up_cookie_is_nothing(stranger) -> None:
    stranger.set_cookie(f"grader-review-{PORT}", "eyJjc3JmIjoieCJ9.aR8nbw.xxxx", domain="127.0.0.1")
    assert stranger.get("/").status_code == 403


@pytest.mark.parametrize(
    "host",
    [
        "evil.example",
        f"evil.example:{PORT}",
        "127.0.0.1",
        f"127.0.0.1:{PORT + 1}",
        f"127.0.0.1.evil:{PORT}",
        "",
    ],
)
def test_another_host_is_403_even_with_the_cookie(page, host) -> None:
    assert page.client.get("/", headers={"Host": host}).status_code == 403
    assert page.client.get(f"/?token={TOKEN}", headers={"Host": host}).status_code == 403


def test_localhost_will_do(app) -> None:
    client = Client(app)
    base = f"http://localhost:{PORT}"
    assert client.get(f"/?token={TOKEN}", base_url=base).status_code == 303
    assert client.get("/", base_url=base).status_code == 200


@pytest.mark.parametrize(
    "origin", ["http://evil.example", "null", f"http://127.0.0.1:{PORT + 1}", f"https://{HOST}"]
)
def test_a_form_of_another_origin_is_403(page, out, origin) -> None:
    form = page.form("ada", "style")
    answer = page.client.post("/s/ada/c/style", data={**form, "points": "3"}, headers={"Origin": origin})
    assert answer.status_code == 403
    assert not (out / "overrides.yaml").exists()


@pytest.mark.parametrize("csrf", [None, "", "x", "ü"])
def test_a_form_without_its_secret_is_403(page, out, csrf) -> None:
    form = page.form("ada", "style") | {"points": "3", "csrf": csrf}
    answer = page.client.post("/s/ada/c/style", data={k: v for k, v in form.items() if v is not None})
    assert answer.status_code == 403
    assert not (out / "overrides.yaml").exists()


def test_the_secret_of_another_session_is_403(page, app) -> None:
    other = Page(app).form("ada", "style")
    assert page.send("ada", "style", other, points="3").status_code == 403


def test_too_much_is_refused(page, out) -> None:
    form = page.form("ada", "style")
    assert page.send("ada", "style", form, points="3", comment="x" * 200_000).status_code == 413
    many = {f"f{i}": "x" for i in range(50)}
    answer = page.client.post("/s/ada/c/style", data={**form, **many}, content_type="multipart/form-data")
    assert answer.status_code == 413
    assert not (out / "overrides.yaml").exists()


def test_pages_may_load_nothing_but_their_own(page) -> None:
    assert page.client.get("/s/ada/report/report.html").headers["Cache-Control"] == "no-store"
    for path in ("/", "/s/ada/", "/nowhere"):
        headers = page.client.get(path).headers
        policy = headers["Content-Security-Policy"]
        assert "default-src 'none'" in policy
        assert "frame-ancestors 'none'" in policy
        assert "unsafe" not in policy
        assert headers["X-Content-Type-Options"] == "nosniff"
        assert headers["Cache-Control"] == "no-store"


def test_browsers_keep_what_does_not_change_and_no_page(page, app) -> None:
    addresses = re.findall(r'"(/(?:look\.css|review\.js)\?v=\w{16})"', page.text("/"))
    assert len(addresses) == 2
    for address in addresses:
        assert "immutable" in page.client.get(address).headers["Cache-Control"]
    assert addresses == re.findall(r'"(/(?:look\.css|review\.js)\?v=\w{16})"', page.text("/s/ada/"))
    other = create_app(app.extensions["review"], port=PORT, token=TOKEN, author="A. Miller")
    assert addresses[0] not in Page(other).text("/")


def test_a_report_is_shut_in(page) -> None:
    policy = page.client.get("/s/ada/report/report.html").headers["Content-Security-Policy"]
    assert "sandbox allow-scripts;" in policy
    assert "allow-same-origin" not in policy
    assert "default-src 'none'" in policy
    assert "form-action 'none'" in policy
    frame = re.search(r"<iframe[^>]*>", page.text("/s/ada/"))
    assert frame
    assert 'sandbox="allow-scripts"' in frame.group()


@pytest.mark.parametrize(
    "path",
    [
        "/s/ada/report/../../run.json",
        "/s/ada/report/..%2f..%2frun.json",
        "/s/ada/report/%2e%2e/run.json",
        "/s/..%2f/report/run.json",
        "/s/../report/lab.yaml",
        "/s/./report/run.json",
        "/s/%00/report/report.html",
        "/s/ada/report/.grader-new",
        "/s/ada/report/secret.txt",
        "/s/ada/report/",
        "/s/ada/evidence/",
        "/s/ada/evidence/..%2fresult.json",
        "/s/ada/evidence/.hidden",
        "/s/ada/evidence/%2fetc%2fpasswd",
        "/s/nobody/report/report.html",
        "/s/nobody/",
        "/s/",
        "/run.json",
        "/overrides.yaml",
    ],
)
def test_nothing_but_known_files_is_served(page, out, path) -> None:
    (out / "ada" / "secret.txt").write_text("secret")
    (out / "ada" / "evidence" / ".hidden").write_text("secret")
    (out / "nobody").mkdir()
    (out / "nobody" / "report.html").write_text("secret")
    answer = page.client.get(path, follow_redirects=True)
    assert answer.status_code == 404
    assert "secret" not in answer.text


def test_links_are_not_followed(page, out, tmp_path) -> None:
    secret = tmp_path / "secret"
    secret.mkdir()
    for name in ("report.html", "x.mcap"):
        (secret / name).write_text("secret")
    (out / "ada" / "report.html").unlink()
    (out / "ada" / "report.html").symlink_to(secret / "report.html")
    (out / "ada" / "evidence" / "x.mcap").symlink_to(secret / "x.mcap")
    assert page.client.get("/s/ada/report/report.html").status_code == 404
    assert page.client.get("/s/ada/evidence/x.mcap").status_code == 404
    assert "x.mcap" not in page.text("/s/ada/")
    (out / "gus").symlink_to(secret)
    assert page.client.get("/s/gus/report/report.html").status_code == 404
    shutil.rmtree(out / "dana" / "evidence")
    (out / "dana" / "evidence").symlink_to(secret)
    assert page.client.get("/s/dana/evidence/x.mcap").status_code == 404


def test_what_is_no_file_is_not_opened(page, out) -> None:
    os.mkfifo(out / "ada" / "evidence" / "pipe.mcap")
    assert page.client.get("/s/ada/evidence/pipe.mcap").status_code == 404


def test_evidence_is_downloaded_not_shown(page, out) -> None:
    name = next((out / "ada" / "evidence").iterdir()).name
    answer = page.client.get(f"/s/ada/evidence/{name}")
    assert answer.headers["Content-Disposition"] == f"attachment; filename=ada-{name}"
    assert answer.headers["Content-Type"] == "application/octet-stream"
    assert answer.data == (out / "ada" / "evidence" / name).read_bytes()


def test_other_reports_are_plain_text(page) -> None:
    for name in ("report.md", "junit.xml", "result.json", "console.log"):
        assert page.client.get(f"/s/ada/report/{name}").headers["Content-Type"] == "text/plain; charset=utf-8"


def test_no_log_says_the_token(page, caplog, capfd, review, monkeypatch) -> None:
    caplog.set_level(logging.DEBUG)
    page.client.get(f"/?token={TOKEN}x")
    page.client.get(f"/?token={TOKEN}")

    def broken() -> None:
        raise RuntimeError("broken")

    monkeypatch.setattr(review.submissions, "items", broken)
    assert page.client.get(f"/?show=all&token={TOKEN}", follow_redirects=True).status_code == 500
    said = caplog.text + "".join(capfd.readouterr())
    assert "broken" in said
    assert TOKEN not in said


def test_a_page_asks_once_more_after_a_link_of_another_site(stranger) -> None:
    told = stranger.get("/", headers={"Sec-Fetch-Site": "cross-site"})
    assert told.status_code == 403
    assert 'http-equiv="refresh"' in told.text
    assert 'http-equiv="refresh"' not in stranger.get("/", headers={"Sec-Fetch-Site": "same-origin"}).text
    assert (
        'http-equiv="refresh"' not in stranger.get("/s/ada/", headers={"Sec-Fetch-Site": "cross-site"}).text
    )
