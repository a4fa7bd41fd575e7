"""Names that can be shown and stored."""

from __future__ import annotations

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from grader.intake.names import archive_stem, printable, safe_name


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("lab1", "lab1"),
        ("lab 1 (copy)", "lab-1-copy"),
        ("Zoë Müller", "Zoe-Muller"),
        ("Größe", "Grosse"),
        ("a/b\\c", "a-b-c"),
        (".hidden", "hidden"),
        ("..", "submission"),
        ("", "submission"),
        ("ros_lab-1.0", "ros_lab-1.0"),
        ("-rf", "rf"),
        ("CON", "submission-CON"),
        ("nul.tar", "submission-nul.tar"),
        ("com1..", "submission-com1"),
        ("console", "console"),
        ("\x1b[2J\n::error::", "2J-error"),
    ],
)
def test_names(text, name):
    assert safe_name(text) == name


def test_what_is_lost_is_kept_apart():
    assert safe_name("学生1") != safe_name("先生1")
    assert safe_name("x" * 300) != safe_name("x" * 301)


@given(st.text() | st.text(alphabet="./-\udce9é "))
def test_a_name_is_always_safe(text):
    assert re.fullmatch(r"[A-Za-z0-9_][A-Za-z0-9._-]{0,99}", safe_name(text))
    assert safe_name(safe_name(text)) == safe_name(text)


@pytest.mark.parametrize("name", ["lab1.zip", "lab1.tar.gz", "lab1.TGZ", "lab1.tar.xz", "lab1.tbz2", "lab1"])
def test_the_stem_of_an_archive(name):
    assert archive_stem(name) == "lab1"


def test_printable():
    assert printable("caf\udce9\n\x1b[31m") == "caf\\xe9\\n\\x1b[31m"
    assert printable("Zoë") == "Zoë"
