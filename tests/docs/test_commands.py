"""Every command line of the pages is one that the parser takes."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from pathlib import Path

import pytest

from grader.cli.main import build_parser
from grader.errors import UsageError
from scripts.pages import ROOT, pages
from tests.docs.console import fences

SHELLS = {"", "console", "bash", "sh", "shell", "yaml"}
PLACEHOLDER = re.compile(r"<[^<>\s]+>")
ENDS = re.compile(r"\s(?:[|&>;]|2>|\|\||&&).*$|\s{3,}\S.*$|\s#\s.*$")


def command_lines(page: str) -> Iterator[str]:
    """What follows `grader` on each line of a block that runs it."""
    for info, content in fences(page):
        if info.split(" ")[0] not in SHELLS:
            continue
        for line in content.replace("\\\n", " ").splitlines():
            words = re.sub(r"^\s*(?:- )?(?:run: |\$ )?(?:[A-Z_]+=\S+ )*", "", line)
            if re.match(r"(?:\.venv/bin/|\S*/bin/)?grader [a-z-]", words):
                yield ENDS.sub("", words.partition("grader ")[2])


def parsed(line: str) -> str:
    """What is wrong with the command line; empty where nothing is."""
    words = shlex.split(PLACEHOLDER.sub("X", line))
    try:
        build_parser().parse_args(words)
    except UsageError as error:
        return error.message
    except SystemExit:
        return ""
    return ""


@pytest.mark.full
@pytest.mark.parametrize("path", pages(), ids=lambda path: str(path.relative_to(ROOT)))
def test_command_lines_parse(path: Path) -> None:
    lines = command_lines(path.read_text(encoding="utf-8"))
    assert [f"{line}: {said}" for line in lines if (said := parsed(line))] == []


def test_they_are_found_and_judged() -> None:
    page = (
        "```\ngrader judge results --rubric LAB    in seconds\n```\n"
        "```yaml\n- run: grader check --static || true\n```\n"
        "```console\n$ A=b grader labs --jsn > out\ngrader is a word here\n```\n"
        "```python\ngrader none\n```\n"
    )
    lines = list(command_lines(page))
    assert lines == ["judge results --rubric LAB", "check --static", "labs --jsn", "is a word here"]
    assert [bool(parsed(line)) for line in lines] == [False, False, True, True]
