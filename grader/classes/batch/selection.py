"""`--only`: which submissions of a batch are done, and whether once more."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

from grader.errors import UsageError
from grader.intake import safe_name
from grader.model.result import GradingResult
from grader.model.roster import Entry
from grader.shown import line
from grader.suggest import closest

FAILED, INCONCLUSIVE, CHANGED = "failed", "inconclusive", "changed"
WORDS = (FAILED, INCONCLUSIVE, CHANGED)
NAME_CHARS = 80


def chosen(
    entries: Sequence[Entry], only: Sequence[str], earlier: Callable[[Entry], GradingResult | None]
) -> Iterator[tuple[Entry, bool]]:
    """The entries to look at, each with whether it is graded even where it is complete.

    Without `only`, all. `failed`: those that could not be graded, or have no result. `inconclusive`: those that say so.
    `changed`: those with a result; it stays unless the submission, the rubric or the grader is another one now. An id:
    that one. Raises UsageError for an id that is none.
    """
    check(entries, only)
    names = {safe_name(name).casefold() for name in only if name not in WORDS}
    for entry in entries:
        if not only:
            yield entry, False
        elif safe_name(entry.id).casefold() in names:
            yield entry, True
        elif any(word in only for word in WORDS):
            result = earlier(entry)
            status = result.status if result else "error"
            if (status == "error" and FAILED in only) or (status == "inconclusive" and INCONCLUSIVE in only):
                yield entry, True
            elif result is not None and CHANGED in only:
                yield entry, False


def check(entries: Sequence[Entry], only: Sequence[str]) -> None:
    """Raise UsageError for an id that no entry has."""
    known = {safe_name(entry.id).casefold(): entry.id for entry in entries}
    for name in only:
        if name in WORDS or safe_name(name).casefold() in known:
            continue
        near = closest(name, known.values())
        hint = f"did you mean {line(near, NAME_CHARS)}?" if near else f"an id, or {', '.join(WORDS)}"
        raise UsageError(
            f"--only {line(name, NAME_CHARS)}: no submission of that id in the roster", hint=hint
        )
