"""What a person waits for who marks a thousand submissions by hand: each page and each decision, as a browser asks."""

from __future__ import annotations

import json
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from http.client import HTTPConnection, HTTPResponse
from pathlib import Path
from urllib.parse import urlencode, urlsplit

from benchmarks.figures import Found, NotMeasured, Options, Row, spread
from benchmarks.gradings import cores, folder_for
from benchmarks.pages import browser_page, class_page, review
from benchmarks.thousands import RUBRIC, batch, made

COUNT, TIMES = 1000, 20
AT_MOST = "at most 300"
STYLE = """
  - id: style
    title: The code reads well
    points: 10
    check: manual
"""
ADDRESS = re.compile(r"http://127\.0\.0\.1:\d+/\?token=[\w-]+")
BANK = {"style": {f"c{number}": {"text": f"Remark {number}", "points": number} for number in range(10)}}
ANSWER_S = 120


def measure(options: Options) -> Found:
    count, times = options.count or COUNT, options.times or TIMES
    with folder_for("reviewing", options) as folder:
        rubric = folder / "lab.yaml"
        rubric.write_text(RUBRIC.read_text().replace("points: 40", "points: 30") + STYLE)
        out = folder / "out"
        batch(made(folder / "in", count), out, options.jobs or cores(), rubric)
        (out / "comments.yaml").write_text(json.dumps(BANK))
        rows = list(_in_a_browser(out, times))
        with _review(out) as address:
            tab = _Tab(address)
            rows += _pages(tab, times)
            rows += _decisions(tab, times)
        faults = () if _decided(out) == count else (f"{_decided(out)} of {count} decisions are there",)
    return Found(runs=f"{count} submissions, {times} of each", tables=(spread(rows),), faults=faults)


def _in_a_browser(out: Path, times: int) -> Iterator[Row]:
    """Yield the class page's actions, then those of a review, which takes back what it decides."""
    with browser_page() as page:
        for what, values in class_page(page, out / "index.html", times).items():
            yield _row(f"class page: {what}", values)
        with _review(out) as address:
            for what, values in review(page, address, times).items():
                yield _row(f"review in a browser: {what}", values)


def _pages(tab: _Tab, times: int) -> Iterator[Row]:
    criterion = f"/s/{tab.keys[0]}/?c=style&show=open"
    for what, path in {
        "list of the class": "/",
        "one filter of it": "/?show=inconclusive",
        "last page of it": "/?page=999",
        "search in it": "/?q=7",
        "list by criterion": "/criteria",
        "one criterion across the class": "/?c=style&show=open",
        "a submission": f"/s/{tab.keys[1]}/",
        "one criterion of a submission, with its code": criterion,
        "comments to use again": "/comments?c=style",
    }.items():
        yield _row(what, [_ms(tab.get, path) for _ in range(times)])


def _decisions(tab: _Tab, times: int) -> Iterator[Row]:
    one, rest = tab.keys[2 : 2 + times], tab.keys[2 + times :]
    yield _row("decide, and go to the next one", [_ms(tab.decide, key, "next") for key in one])
    yield _row(f"decide {len(rest)} in one go", [_ms(tab.decide, rest[0], "alike")], "at most 1000")
    yield _row("list right after that", [_ms(tab.get, "/")])
    yield _row("take these back in one go", [_ms(tab.decide, rest[0], "undo")], "at most 1000")
    tab.decide(rest[0], "alike")
    changed = {"csrf": tab.csrf, "id": "c7", "text": "Remark 7, changed", "points": "6"}
    yield _row(
        "change a comment that all of them have",
        [_ms(tab.post, "/comments/style", changed)],
        "at most 1000",
    )


def _row(what: str, values: list[float], asked: str = AT_MOST) -> Row:
    return Row(what, "ms", values, asked, 0)


def _ms(act: Callable[..., object], *given: object) -> float:
    begun = time.perf_counter()
    act(*given)
    return (time.perf_counter() - begun) * 1e3


def _decided(out: Path) -> int:
    return (out / "overrides.yaml").read_text(encoding="utf-8").count("  style: {")


@contextmanager
def _review(out: Path) -> Iterator[str]:
    """Run the command in a process of its own, and yield the address that it prints."""
    argv = [sys.executable, "-u", "-m", "grader", "review", str(out), "--no-browser", "--author", "ann"]
    with subprocess.Popen(argv, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None  # noqa: S101 - opened with PIPE
        found = ADDRESS.search(process.stdout.readline())
        if not found:
            raise NotMeasured("grader review did not begin")
        try:
            yield found[0]
        finally:
            process.send_signal(signal.SIGINT)
            process.communicate()


class _Tab:
    """A browser's tab: the cookie, and the addresses of all submissions."""

    def __init__(self, address: str) -> None:
        parts = urlsplit(address)
        self._port, self._headers = parts.port, dict[str, str]()
        answer, _ = self._ask("GET", f"{parts.path}?{parts.query}", None)
        self._headers["Cookie"] = str(answer.getheader("Set-Cookie")).partition(";")[0]
        self.keys = list(dict.fromkeys(self._all()))
        self.csrf = self._form(self.keys[0])["csrf"]

    def _all(self) -> Iterator[str]:
        """Yield the keys of all submissions, page by page of the list."""
        path: str | None = "/"
        while path:
            text = self.get(path)
            yield from re.findall(r'class="row" href="/s/([^"/]+)/', text)
            found = re.search(r'rel="next" href="([^"]+)"', text)
            path = found[1] if found else None

    def get(self, path: str) -> str:
        answer, text = self._ask("GET", path, None)
        if answer.status != 200:
            raise NotMeasured(f"{path}: {answer.status}")
        return text

    def post(self, path: str, fields: Mapping[str, str]) -> None:
        answer, _ = self._ask("POST", path, urlencode(fields))
        if answer.status not in (200, 303):
            raise NotMeasured(f"{path}: {answer.status}")

    def decide(self, key: str, do: str) -> None:
        fields = {"csrf": self.csrf, "seen": "", "points": "", "comment": "", "bank": "c7", "do": do}
        self.post(f"/s/{key}/c/style", fields)

    def _form(self, key: str) -> dict[str, str]:
        found = re.search(rf'action="/s/{key}/c/style".*?</form>', self.get(f"/s/{key}/?c=style"), re.DOTALL)
        return dict(re.findall(r'type="hidden" name="(\w+)" value="([^"]*)"', found.group() if found else ""))

    def _ask(self, method: str, path: str, body: str | None) -> tuple[HTTPResponse, str]:
        connection = HTTPConnection("127.0.0.1", self._port, timeout=ANSWER_S)
        form = {"Content-Type": "application/x-www-form-urlencoded"} if body is not None else {}
        connection.request(method, path, body, {**self._headers, **form})
        answer = connection.getresponse()
        text = answer.read().decode()
        connection.close()
        return answer, text
