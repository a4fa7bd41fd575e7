"""What a form says, made an override; what is wrong with it in a line for the one who typed it."""

from __future__ import annotations

import re
import unicodedata
from datetime import date

from grader.model.result import AUTHOR_CHARS, COMMENT_CHARS, Override
from grader.wording import number

POINTS = re.compile(r"\d{1,9}(?:[.,]\d{0,9})?|[.,]\d{1,9}", re.ASCII)


class Wrong(Exception):
    """What was typed cannot be taken; the message says why."""


def override_of(points: str, comment: str, author: str, *, most: float, reason: bool) -> Override:
    """Raises Wrong. A `reason` is asked for where a check has judged."""
    text = points.strip()
    if not text:
        raise Wrong("How many points?")
    if not POINTS.fullmatch(text):
        raise Wrong("Points are a number, such as 7 or 2.5.")
    value = float(text.replace(",", "."))
    if value > most:
        raise Wrong(f"It has at most {number(most)} points.")
    written = clean(comment)
    if len(written) > COMMENT_CHARS:
        raise Wrong(f"At most {COMMENT_CHARS} characters, please: there are {len(written)}.")
    if reason and not written:
        raise Wrong("Say why: the student sees the reason beside the points.")
    return Override(points=value, comment=written, author=author, date=date.today())  # noqa: DTZ011 - the person's day


def author_of(text: str) -> str:
    """Raises Wrong."""
    written = " ".join(clean(text).split())
    if len(written) > AUTHOR_CHARS:
        raise Wrong(f"A name has at most {AUTHOR_CHARS} characters.")
    return written


def clean(text: str) -> str:
    """Line ends as they are in files, and no control characters."""
    lines = text.replace("\r\n", "\n").replace("\r", "\n").strip()
    return "".join(c for c in lines if c in "\n\t" or unicodedata.category(c) not in {"Cc", "Cs"})
