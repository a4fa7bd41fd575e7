"""What an instructor's check prints of a student's text goes to stderr, visible and on lines that command nothing."""

from __future__ import annotations

import io
import sys

import pytest
from hypothesis import given
from hypothesis import strategies as st

from grader.rubric.own_checks import VisibleText, printing_to_stderr
from tests.report.nasty import STEERING, TEXTS
from tests.report.test_text_visible import TO_A_CI


@given(st.lists(TEXTS, max_size=6))
def test_pieces_that_are_harmless_alone_are_harmless_together(pieces):
    out = io.StringIO()
    shown = VisibleText(out)
    for piece in pieces:
        assert shown.write(piece) == len(piece)
    shown.finish()
    assert STEERING.search(out.getvalue()) is None
    assert TO_A_CI.search(out.getvalue()) is None


def test_a_line_without_an_end_does_not_fill_the_memory():
    out = io.StringIO()
    shown = VisibleText(out)
    for _ in range(300):
        shown.write("x" * 1000)
    assert len(out.getvalue()) > 250_000


def test_both_streams_go_to_stderr_also_where_the_check_fails(capsys):
    def check() -> None:
        with printing_to_stderr():
            print("loading \x1b[2J")
            sys.stderr.write(":")
            sys.stderr.write(":error::x")
            raise ValueError

    with pytest.raises(ValueError, match=r"^$"):
        check()
    shown = capsys.readouterr()
    assert shown.out == ""
    assert shown.err == "loading \\x1b[2J\n\\x3a:error::x\n"
