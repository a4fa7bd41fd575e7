"""The man page: every command is in it, and the programs that show man pages have nothing to say against it."""

from __future__ import annotations

import re
import shutil
import subprocess

import pytest

from grader.cli.main import build_parser, commands, options, value_of
from scripts.man_page import bold, man_page, text

GROFF, MAN, MANDOC = (shutil.which(name) for name in ("groff", "man", "mandoc"))
HOSTILE = ["", ".so /etc/passwd", "'br", r"\fBa\n[x]", "a\\", "`x` 'y' \"z\" ^ ~ - é €", "..", "\\(aq"]
NO_DATE = 'missing date, using "": TH'


def shown(source: str) -> tuple[str, str]:
    """What a reader sees, and what groff warns of."""
    command = [str(GROFF), "-ww", "-b", "-k", "-man", "-Tutf8", "-P-cbou"]
    done = subprocess.run(command, input=source, capture_output=True, text=True, check=True)
    return done.stdout, done.stderr


@pytest.mark.parametrize(
    "title", ["NAME", "SYNOPSIS", "COMMANDS", "EXIT STATUS", "ENVIRONMENT", "FILES", "EXAMPLES"]
)
def test_the_sections_are_those_of_man_pages(title):
    assert f".SH {title}\n" in man_page()


def test_every_command_and_option_is_described():
    page = man_page()
    for command in commands(build_parser()):
        section = page.partition(f'.SS "{text(command.prog)}"\n')[2].partition("\n.S")[0]
        assert text(command.description or "") in section
        for action in options(command):
            if action.dest != "debug":
                assert all(bold(name) in section for name in action.option_strings[:1])
                assert text(value_of(action).split(",")[0]) in section


def test_examples_are_commands(capsys):
    parser = build_parser()
    for command in re.findall(r"\.nf\n\\fBgrader (.*)\\fR\n", man_page()):
        assert parser.parse_args(command.replace(r"\-", "-").split()).command, capsys.readouterr().err


@pytest.mark.skipif(GROFF is None, reason="no groff here: apt-get install groff-base")
class TestGroff:
    def test_it_warns_of_nothing(self):
        assert shown(man_page())[1] == ""

    def test_it_would_warn(self):
        assert shown(man_page() + ".no-such-request\n\\[no-such-sign]\n")[1] != ""

    def test_a_reader_sees_the_exit_codes(self):
        page = " ".join(shown(man_page())[0].split())
        assert "4 inconclusive: a criterion could not be judged" in page

    @pytest.mark.parametrize("words", HOSTILE)
    def test_words_are_shown_as_they_are(self, words):
        out, warnings = shown(f".TH A 1\n.SH B\nbegin\n.br\n{text(words)}\n.br\nend\n")
        between = out.partition("begin")[2].partition("end")[0]
        assert between.strip() == words.strip()
        assert warnings == ""


@pytest.mark.skipif(MANDOC is None, reason="no mandoc here: apt-get install mandoc")
def test_mandoc_misses_nothing_but_a_date(tmp_path):
    page = tmp_path / "grader.1"
    page.write_text(man_page(), encoding="utf-8")
    command = [str(MANDOC), "-T", "lint", "-W", "warning", str(page)]
    found = subprocess.run(command, capture_output=True, text=True, check=False).stdout
    assert [row for row in found.splitlines() if not row.endswith(NO_DATE)] == []


@pytest.mark.skipif(MAN is None, reason="no man here: apt-get install man-db")
def test_man_shows_it_without_warnings(tmp_path):
    page = tmp_path / "grader.1"
    page.write_text(man_page(), encoding="utf-8")
    done = subprocess.run(
        [str(MAN), "--warnings", "-l", str(page)], capture_output=True, text=True, check=True
    )
    assert "GRADER(1)" in done.stdout
    assert done.stderr == ""


def test_a_command_that_is_built_alone_is_the_same() -> None:
    every = {one.prog: one.format_help() for one in commands(build_parser())}
    firsts = {prog.split()[1] for prog in every}
    alone = {one.prog: one.format_help() for first in firsts for one in commands(build_parser(first))}
    assert alone == every
