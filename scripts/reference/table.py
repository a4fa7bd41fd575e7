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
    return prose(text).replace("\n", " ").replace("|", "\\|")


def prose(text: str) -> str:
    """Text in which nothing but code (`<node>`) may begin with `<`: it would be taken for HTML, and not be shown."""
    return "`".join(
        part.replace("<", "&lt;") if n % 2 == 0 else part for n, part in enumerate(text.split("`"))
    )


def code(text: str) -> str:
    """Code in a line, or nothing for nothing."""
    return f"`{text}`" if text else ""
