"""Pieces of Markdown that the pages share."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

MADE = "This page is made from the code (`make reference`)."


def table(heading: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> Iterator[str]:
    """The lines of a table, and an empty one after it; nothing where there are no rows."""
    made = [f"| {' | '.join(cell(text) for text in row)} |" for row in rows]
    if made:
        yield f"| {' | '.join(heading)} |"
        yield f"|{'---|' * len(heading)}"
        yield from made
        yield ""


def cell(text: str) -> str:
    """Text that stays in its cell."""
    return text.replace("\n", " ").replace("|", "\\|")


def code(text: str) -> str:
    """Code in a line, or nothing for nothing."""
    return f"`{text}`" if text else ""
