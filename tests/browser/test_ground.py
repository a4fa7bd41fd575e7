"""The ground itself: a page that misbehaves is caught."""

from __future__ import annotations

import http.server
import threading
import time

import pytest

from tests.browser import ground
from tests.browser.conftest import PHONE, need_ground

HEAD = '<!doctype html><html lang="en"><head><meta charset="utf-8"><title>A page</title><link rel="icon" href="data:,">'
BODY = "</head><body><main><h1>A page</h1>{}</main></body></html>"


@pytest.fixture
def written(tmp_path):
    def write(body: str, head: str = ""):
        path = tmp_path / "page.html"
        path.write_text(HEAD + head + BODY.format(body), encoding="utf-8")
        return path

    return write


@pytest.mark.full
def test_a_quiet_page_is_clean(visit, axe, validate, written) -> None:
    path = written("<p>Nothing to see.</p>")
    page = visit(path, size=PHONE, dark=True)
    assert page.evaluate("[innerWidth, matchMedia('(prefers-color-scheme: dark)').matches]") == [390, True]
    assert axe(page) == []
    assert validate(path) == []


MISDEEDS = {
    "<script>console.error('oh')</script>": "console: oh",
    "<script>throw new Error('no')</script>": "thrown: no",
    '<img alt="" src="http://127.0.0.1:9/x.png">': "asked: http://127.0.0.1:9/x.png",
    '<link rel="stylesheet" href="style.css">': "style.css",
    "<script>fetch('http://127.0.0.1:9/y').catch(() => 0)</script>": "asked: http://127.0.0.1:9/y",
}


def test_what_a_page_should_not_do_is_seen(visit, complaints, written) -> None:
    page = visit(written("".join(MISDEEDS)))
    until = time.monotonic() + 600
    while missed := {one for one in MISDEEDS.values() if not any(one in said for said in complaints)}:
        assert time.monotonic() < until, missed
        page.wait_for_timeout(50)  # lets the page's events in
    page.context.close()
    complaints.clear()


@pytest.mark.full
def test_a_policy_that_is_broken_is_seen(visit, complaints, written) -> None:
    policy = '<meta http-equiv="Content-Security-Policy" content="default-src \'none\'">'
    visit(written("<script>document.title = 'run'</script>", policy))
    assert "Content Security Policy" in complaints.pop()


@pytest.mark.full
def test_a_server_of_its_own_may_be_asked(visit, tmp_path) -> None:
    (tmp_path / "index.html").write_text(HEAD + BODY.format("<script src='more.js'></script>"))
    (tmp_path / "more.js").write_text("document.title = 'more';")

    class Quiet(http.server.SimpleHTTPRequestHandler):
        def __init__(self, *args) -> None:
            super().__init__(*args, directory=str(tmp_path))

        def log_message(self, *_args) -> None:
            pass

    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), Quiet) as server:
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
        thread.start()
        assert visit(f"http://127.0.0.1:{server.server_port}/").title() == "more"
        server.shutdown()
        thread.join()


@pytest.mark.full
def test_faults_of_a_page_are_named(visit, axe, validate, written) -> None:
    path = written('<img src="data:,"><p style="color:#bbb">pale</p><p>not closed</div>')
    rules = {line.split(":")[0] for line in axe(visit(path))}
    assert {"image-alt", "color-contrast"} <= rules
    assert any("close-order" in line for line in validate(path))


def test_where_chromium_is_missing_ci_fails_and_others_are_told(monkeypatch) -> None:
    monkeypatch.setattr(ground, "chromium", lambda: None)
    monkeypatch.delenv("CI", raising=False)
    with pytest.raises(pytest.skip.Exception, match=r"no chromium.*: apt-get install chromium"):
        need_ground()
    monkeypatch.setenv("CI", "true")
    with pytest.raises(pytest.fail.Exception, match="no chromium"):
        need_ground()
