from __future__ import annotations

import unicodedata

import pytest
from hypothesis import given
from hypothesis import strategies as st
from markdown_it import MarkdownIt

from grader.report.text import HIDDEN_CATEGORIES, clip, markdown, markdown_code, number, visible

ANY_TEXT = st.text(st.characters(codec=None, exclude_categories=()))


@given(ANY_TEXT)
def test_nothing_that_steers_a_terminal_gets_through(text):
    assert not [c for c in visible(text) if unicodedata.category(c) in HIDDEN_CATEGORIES]
    assert not [c for c in visible(text, lines=True) if unicodedata.category(c) in HIDDEN_CATEGORIES - {"Cc"}]
    assert set(visible(text, lines=True)) & {chr(i) for i in (*range(32), *range(127, 160))} <= {"\n", "\t"}


@given(ANY_TEXT)
def test_what_is_visible_stays_as_it_is_and_encodes(text):
    once = visible(text)
    assert visible(once) == once
    assert once.encode().decode() == once


@given(st.text(st.characters(categories=["L", "N", "P", "S"])))
def test_printed_characters_are_not_touched(text):
    assert visible(text) == text


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("\x1b[31m", "\\x1b[31m"),
        ("a\nb\r\t", "a\\nb\\r\\t"),
        ("\u202e", "\\u202e"),
        ("\x9b", "\\x9b"),
        ("\U000e0001", "\\U000e0001"),
        ("\ud800", "\\ud800"),
        ("\ufffe", "\\ufffe"),
        ("Grüße, 10 Hz ± 5 % ✓", "Grüße, 10 Hz ± 5 % ✓"),
    ],
)
def test_written_out(text, shown):
    assert visible(text) == shown


def _rendered(text: str) -> str:
    return MarkdownIt("gfm-like", {"linkify": False}).render(text)


@given(st.text(st.characters(codec="ascii", categories=["L", "N", "P", "S", "Zs"]), min_size=1))
def test_markdown_renders_as_the_text_itself(text):
    """Whatever the text, all that comes out is one paragraph of text and code spans."""
    html = _rendered(f"x {markdown(text)} x")
    tags = html.replace("<p>", "").replace("</p>", "").replace("<code>", "").replace("</code>", "")
    assert "<" not in tags
    words = tags.replace("&lt;", "<").replace("&gt;", ">").replace("&quot;", '"').replace("&amp;", "&")
    assert words.split() == f"x {text} x".split()


@pytest.mark.parametrize(
    "text", ["@everyone", "a@b.example", "https://evil.example/x", "www.evil.example", "#1", "a/b!7"]
)
def test_what_a_forge_would_link_is_code(text):
    assert "`" in markdown(f"see {text} now")


def test_neighbours_that_a_forge_would_link_share_one_span():
    assert markdown("@0@0 and #1#2") == "`@0@0` and `#1`#2"


@given(st.text(st.sampled_from("`| ax\\"), min_size=1))
def test_code_spans_hold_in_a_cell(text):
    html = _rendered(f"| a | b |\n|---|---|\n| {markdown_code(text, cell=True)} | end |")
    assert "<td>end</td>" in html
    assert html.count("<td>") == 2


def test_numbers_carry_no_idle_zeros():
    assert [number(x) for x in (10, 100.0, 87.5, 0, 0.1 + 0.2)] == ["10", "100", "87.5", "0", "0.3"]


def test_clip_says_how_much_is_gone():
    assert clip("abc", 3) == "abc"
    assert clip("abcdef", 3) == "abc… (3 more characters)"
