"""The words of a man page in roff, the language that `man` reads."""

from __future__ import annotations

ESCAPES = {
    "\\": r"\(rs",
    "-": r"\-",
    "'": r"\(aq",
    "`": r"\(ga",
    "^": r"\(ha",
    "~": r"\(ti",
    '"': r"\(dq",
}


def text(words: str) -> str:
    """Plain words as they are: nothing in them is taken for a request or a special sign."""
    escaped = "".join(_escaped(character) for character in words)
    return rf"\&{escaped}" if escaped.startswith(".") else escaped


def bold(words: str) -> str:
    """What is typed as it stands."""
    return rf"\fB{text(words)}\fR"


def italic(words: str) -> str:
    """What is put in the place of a name."""
    return rf"\fI{text(words)}\fR"


def entry(tag: str, *paragraphs: str) -> list[str]:
    """The lines of a tag with what is said of it, indented. All is roff already."""
    lines = [".TP", tag]
    for index, paragraph in enumerate(paragraphs):
        lines += [".IP", paragraph] if index else [paragraph]
    return lines


def example(command: str) -> list[str]:
    """The lines of a command, indented, in which no line is filled. A paragraph is to follow."""
    return [".IP", ".nf", bold(command), ".fi"]


def _escaped(character: str) -> str:
    if character in ESCAPES:
        return ESCAPES[character]
    return character if character.isascii() else rf"\[u{ord(character):04X}]"
