"""Changes to a YAML file's text, as pieces that are cut out and put in: all else stays as it was written."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import yaml

Pair = tuple[yaml.Node, yaml.Node]


class Splice(NamedTuple):
    """`text` takes the place of what stands from `start` to `end`, counted in characters."""

    start: int
    end: int
    text: str


def spliced(text: str, splices: Iterable[Splice]) -> str:
    """The text with all of these made; they do not overlap."""
    for start, end, piece in sorted(splices, reverse=True):
        text = text[:start] + piece + text[end:]
    return text


def end_of(text: str, node: yaml.Node) -> int:
    """Where what is written of a node ends, without the comments and blank lines that follow."""
    if isinstance(node, yaml.CollectionNode) and not node.flow_style and node.value:
        last = node.value[-1]
        key, value = last if isinstance(last, tuple) else (last, last)
        return max(end_of(text, key), end_of(text, value))
    return len(text[: node.end_mark.index].rstrip())


def set_value(text: str, pair: Pair, written: str) -> Splice:
    """`written` in place of the pair's value."""
    start = pair[1].start_mark.index
    end = max(start, end_of(text, pair[1]))
    return Splice(start, end, written if end > start else f" {written}")


def add_pairs(text: str, node: yaml.MappingNode, written: list[str]) -> Splice:
    """These pairs at the end of a map, in its own style."""
    if not node.value:
        return Splice(node.end_mark.index - 1, node.end_mark.index - 1, ", ".join(written))
    end = end_of(text, node) if not node.flow_style else _end_of_pair(text, node.value[-1])
    if node.flow_style:
        return Splice(end, end, "".join(f", {pair}" for pair in written))
    return block_lines(text, end, node.value[0][0].start_mark.column, written)


def block_lines(text: str, after: int, column: int, written: list[str]) -> Splice:
    """Lines below the one in which `after` lies."""
    line_end = "\r\n" if "\r\n" in text else "\n"
    newline = text.find("\n", after)
    lines = "".join(f"{' ' * column}{line}{line_end}" for line in written)
    if newline < 0:
        apart = line_end if text and not text.endswith("\n") else ""
        return Splice(len(text), len(text), apart + lines)
    return Splice(newline + 1, newline + 1, lines)


def drop_pair(text: str, node: yaml.MappingNode, pair: Pair) -> Splice:
    """Nothing in place of a pair: its lines in a map of lines, the pair and a comma in a map in braces."""
    start, end = pair[0].start_mark.index, _end_of_pair(text, pair)
    if not node.flow_style:
        newline = text.find("\n", end)
        return Splice(text.rfind("\n", 0, start) + 1, len(text) if newline < 0 else newline + 1, "")
    place = next(i for i, other in enumerate(node.value) if other[0] is pair[0])
    if place + 1 < len(node.value):
        return Splice(start, node.value[place + 1][0].start_mark.index, "")
    return Splice(_end_of_pair(text, node.value[place - 1]) if place else start, end, "")


def _end_of_pair(text: str, pair: Pair) -> int:
    return max(end_of(text, pair[0]), end_of(text, pair[1]))
