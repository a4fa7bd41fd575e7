"""A file's code as `copydetect` compares it: names, texts, comments and layout are gone, each sign knows its line."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache
from typing import TypeAlias

import numpy as np
from copydetect.utils import filter_code, get_copied_slices, hashed_kgrams
from numpy.typing import NDArray
from pygments import token
from pygments.lexer import Lexer
from pygments.lexers import get_lexer_by_name

from grader.classes.similarity.read import Language

GRAM = 25
"""Signs in one fingerprint, `copydetect`'s own default: about two short statements."""

Numbers: TypeAlias = NDArray[np.int64]
Marks: TypeAlias = NDArray[np.bool_]

# In Python; what C++ includes becomes one sign anyway.
_IMPORT = re.compile(
    r"^[ \t]*(?:from\b[^\n]*?\bimport\b[ \t]*(?:\([^)]*\)|[^\n]*)|import\b[^\n]*)", re.MULTILINE
)
_NOT_LINE_ENDS = re.compile(r"[^\n]+")
_LAID_ASIDE = (token.Comment.Single, token.Comment.Multiline, token.Comment.Hashbang, token.String.Doc)


@dataclass(frozen=True, kw_only=True)
class Text:
    """`prints[i]` is the fingerprint of the signs from i to i + GRAM, `lines[i]` the line of sign i, from 1."""

    path: str
    prints: Numbers
    lines: Numbers


def read_text(path: str, code: str, language: Language) -> Text:
    """The fingerprints of a file's code, all of them: labs are short, and no window has to be thinned out."""
    plain = _plain(code, language)
    signs, offsets = filter_code(plain, path, language)
    prints = hashed_kgrams(signs, GRAM).astype(np.int64)
    skipped = len(plain) - len(plain.lstrip("\n"))  # pygments begins behind them
    places = np.arange(len(signs)) + _removed(offsets, len(signs)) + skipped
    ends = np.flatnonzero(np.frombuffer(plain.encode("utf-32-le"), dtype=np.uint32) == ord("\n"))
    return Text(path=path, prints=prints, lines=np.searchsorted(ends, places).astype(np.int64) + 1)


def covered(text: Text, chosen: Marks) -> Marks:
    """The signs that lie in one of the chosen fingerprints."""
    marks = np.zeros(len(text.lines), dtype=np.bool_)
    for begin, end in get_copied_slices(np.flatnonzero(chosen), GRAM).T.astype(int):
        marks[begin:end] = True
    return marks


def _plain(code: str, language: Language) -> str:
    """The same lines without comments, docstrings and imports, which are alike by nature. Classes get names of one
    letter: `filter_code` counts their length wrongly."""
    code = code.removeprefix("\ufeff").replace("\r\n", "\n").replace("\r", "\n")
    if language == "python":
        code = _IMPORT.sub(_line_ends, code)
    parts = []
    for kind, text in _lexer(language).get_tokens(code):
        if any(_is(kind, laid) for laid in _LAID_ASIDE):
            parts.append(_NOT_LINE_ENDS.sub("", text))
        else:
            parts.append("C" if _is(kind, token.Name.Class) else text)
    return "".join(parts)


def _is(kind: tuple[str, ...], wanted: tuple[str, ...]) -> bool:
    return kind[: len(wanted)] == wanted


def _line_ends(found: re.Match[str]) -> str:
    return "\n" * found.group().count("\n")


@cache
def _lexer(language: Language) -> Lexer:
    return get_lexer_by_name(language, stripnl=False)


def _removed(offsets: Numbers, size: int) -> Numbers:
    """How many characters are left out before each sign: `filter_code` notes it where it leaves some out."""
    rows = offsets[1:][offsets[1:, 0] >= 0]
    if not len(rows):
        return np.zeros(size, dtype=np.int64)
    counts = np.maximum.accumulate(rows[:, 1])
    at = np.searchsorted(rows[:, 0], np.arange(size))
    return counts[np.minimum(at, len(rows) - 1)].astype(np.int64)
