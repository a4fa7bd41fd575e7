"""Which word was meant: the suggestion that a message about an unknown name ends with. For every room; imports none."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


def closest(word: str, candidates: Iterable[str], *, cutoff: float = 0.6) -> str:
    """Return the candidate most like `word`, ignoring case, or "" if none reaches the `cutoff` (0 to 1)."""
    known = {candidate.lower(): candidate for candidate in candidates}
    near = difflib.get_close_matches(word.lower(), known, n=1, cutoff=cutoff)
    return known[near[0]] if near else ""


def did_you_mean(word: str, candidates: Iterable[str]) -> str:
    """Return ` (did you mean "rate"?)` for the end of a message, or ""."""
    near = closest(word, candidates)
    return f' (did you mean "{near}"?)' if near else ""
