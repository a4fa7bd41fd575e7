"""Templates of what a message or a line has to say: words, and a place for a value."""

from __future__ import annotations

import re

SECONDS = "{seconds}"
VALUE = "{value}"
NUMBER = r"[-+]?[0-9]+(?:\.[0-9]*)?(?:[eE][-+]?[0-9]+)?"


def words_pattern(words: str) -> str:
    """A regular expression for words without regard to case and to how many blanks stand between them."""
    parts = r"\s+".join(re.escape(part) for part in re.split(r"\s+", words))
    return f"(?i:{parts})" if words else ""


def message_pattern(template: str, value: str) -> re.Pattern[str]:
    """The whole text: the template's words, and `value` (a regular expression) where it says `{seconds}`."""
    first, *others = template.strip().split(SECONDS)
    inner = "".join(f"({value}){words_pattern(words)}" for words in others)
    return re.compile(rf"\s*{words_pattern(first)}{inner}\s*", re.DOTALL)


def line_pattern(template: str, value: str) -> re.Pattern[str]:
    """The template's words around `value`, which has to stand there letter by letter, blanks squeezed."""
    squeezed = re.escape(" ".join(value.split()))
    return re.compile(squeezed.join(words_pattern(words) for words in template.strip().split(VALUE)))


def in_words(template: str) -> str:
    """The template as a student reads it: `hello world <seconds>`."""
    return template.replace(SECONDS, "<seconds>").replace(VALUE, "<message>")
