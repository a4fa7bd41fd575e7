"""What several grammars are made of."""

from __future__ import annotations

import struct
from collections.abc import Sequence

from hypothesis import strategies as st
from hypothesis.strategies import SearchStrategy

ODD = (
    "", " ", "\t", "\0", "\x1b[31m", "é", "\ud800", "\u202e", "\ufeff", "1e999", "-1", "0", "9" * 30, "../..",
    "$(", "${", "%s", "{0}", "]]>", "--", "<!--", "'", '"', "\\", "=", ";", "#", "a" * 300,
)  # fmt: skip
SIZES = (0, 1, 2, 3, 4, 7, 8, 31, 255, 65_535, (1 << 31) - 1, 1 << 31, (1 << 32) - 1)


def words(*known: str) -> SearchStrategy[str]:
    """Mostly what a sound file holds."""
    return st.one_of(
        st.sampled_from(known), st.sampled_from(known), st.sampled_from(ODD), st.text(max_size=8)
    )


def joined(parts: SearchStrategy[str], separator: str = "", *, most: int = 12) -> SearchStrategy[str]:
    return st.lists(parts, max_size=most).map(separator.join)


def encoded(texts: SearchStrategy[str]) -> SearchStrategy[bytes]:
    return st.builds(_encode, texts, st.sampled_from(("utf-8", "utf-8", "utf-8", "utf-8-sig", "utf-16")))


def _encode(text: str, encoding: str) -> bytes:
    return text.encode(encoding, "surrogatepass" if encoding.startswith("utf-8") else "replace")


def soup(tokens: Sequence[str], *, most: int = 40) -> SearchStrategy[bytes]:
    """Tokens of a language in any order."""
    return encoded(joined(words(*tokens), most=most))


def lengths(right: int) -> SearchStrategy[int]:
    """A length that mostly tells the truth."""
    return st.one_of(st.just(right), st.just(right), st.just(right), st.sampled_from(SIZES))


@st.composite
def sized(draw: st.DrawFn, data: bytes, form: str = "<I") -> bytes:
    """The bytes behind their length, or behind a lie."""
    top = (1 << 8 * struct.calcsize(form)) - 1
    return struct.pack(form, min(draw(lengths(len(data))), top)) + data
