"""The reports of one hostile result. `GRADER_REGENERATE=1 pytest tests/report` writes them anew."""

from __future__ import annotations

import io
import os
from pathlib import Path

import pytest
from rich.console import Console

from grader.report.junit import junit
from grader.report.markdown import markdown_report
from grader.report.result_json import result_bytes
from grader.report.terminal import open_console, print_report
from tests.report.hostile import result, rubric

GOLDEN = Path(__file__).parent / "golden"


def terminal(encoding: str) -> bytes:
    raw = io.BytesIO()
    stream = io.TextIOWrapper(raw, encoding=encoding)
    print_report(result(), rubric(), open_console(stream), hidden=2)
    stream.flush()
    return raw.getvalue()


MADE = {
    "report.md": lambda: markdown_report(result(), rubric(), hidden=2).encode(),
    "junit.xml": lambda: junit(result()),
    "result.json": lambda: result_bytes(result()),
    "terminal.txt": lambda: terminal("utf-8"),
    "terminal-ascii.txt": lambda: terminal("ascii"),
}


@pytest.mark.parametrize("name", MADE)
def test_report_is_as_kept(name):
    made, kept = MADE[name](), GOLDEN / name
    if os.environ.get("GRADER_REGENERATE"):
        kept.write_bytes(made)
    assert made.decode() == kept.read_bytes().decode()


def test_terminal_keeps_to_80_columns_and_sends_no_escapes():
    text = terminal("utf-8").decode()
    assert max(len(line) for line in text.splitlines()) <= 80
    assert "\x1b" not in text
    assert "[bold red]not bold[/]" in text


def test_a_real_terminal_gets_colour_but_none_of_the_students():
    out = io.StringIO()
    console = Console(
        file=out,
        force_terminal=True,
        width=100,
        markup=False,
        emoji=False,
        highlight=False,
        color_system="standard",
    )
    print_report(result(), rubric(), console)
    assert "\x1b[31m✗" in out.getvalue()
    assert "\x1b]0;" not in out.getvalue()


def test_every_status_has_its_word_in_the_table():
    text = terminal("ascii").decode("ascii")
    for word in ("+ pass", "x fail", "~ partial", "- blocked", "? inconclusive", "! error", "o manual"):
        assert word in text
