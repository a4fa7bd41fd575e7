"""The plain edits that make `package.xml` or a launch file well-formed, each of one slip."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from difflib import get_close_matches

from grader.model.file_fault import Fault
from grader.package.xml import (
    NO_END,
    TYPOGRAPHIC,
    end_of_children,
    find_slip,
    find_strange,
    first_tag,
    opening_tag,
    parse_xml,
    sub_comments,
)

EDITS_MAX = 4
"""The same slip is often in several tags, since one is copied from the other."""
_ATTRIBUTE = re.compile(r"(?<=\s)([\w:-]+)(\s*=\s*)(\"[^\"]*\"|'[^']*'|[^\s\"'<>/]+)")


def well_formed(text: str, file: str, *, root: str) -> list[str]:
    """Return the texts that lead to a well-formed file with tags that there are, an edit each; nothing where it is so
    already, or no plain edits make it well-formed."""
    steps = [text]
    for _ in range(EDITS_MAX):
        better = _with_edit(steps[-1], file, root)
        if better is None:
            break
        steps.append(better)
    return steps[1:] if parse_xml(steps[-1].encode(), file, root=root)[1] is None else []


def _with_edit(text: str, file: str, root: str) -> str | None:
    """Return the text with one edit, after which it is well-formed, is read further, or has a tag that there is."""
    _, fault = parse_xml(text.encode(), file, root=root)
    slip = find_strange(text, root) if fault is None else find_slip(text, root)
    if fault is None or slip is not None:
        return slip.text if slip is not None else None
    each = dict.fromkeys(_edits(text, fault, root))
    found = [(parse_xml(one.encode(), file, root=root)[1], one) for one in each if one != text]
    whole = next((one for later, one in found if later is None), None)
    return whole or next(
        (one for later, one in found if later is not None and _reached(later) > _reached(fault)), None
    )


def _reached(fault: Fault) -> float:
    """Return how far the parser came: a tag that is never closed is noticed at the end."""
    return math.inf if "end of data" in fault.message else fault.line or 0


def _edits(text: str, fault: Fault, root: str) -> Iterator[str]:
    """Yield texts with one edit by what the parser said, the likeliest first."""
    message, lines = fault.message, text.split("\n")
    at = min(max((fault.line or 1) - 1, 0), len(lines) - 1)
    if fault.kind != "XMLSyntaxError" or lines[at].startswith(("<<<<<<<", "=======", ">>>>>>>")):
        return
    if mismatch := re.search(r"tag mismatch: (\S+) line (\d+) and (\S+)", message):
        yield from _matching(lines, mismatch[1], int(mismatch[2]) - 1, mismatch[3], root)
    elif unclosed := re.search(NO_END, message):
        yield from _closed(lines, unclosed[1], int(unclosed[2]) - 1, root)
    elif re.search(r"hyphen|must not contain '--'", message):
        yield sub_comments(_without_hyphens, text)
    elif "EntityRef" in message:
        yield re.sub(r"&(?!#?\w+;)", "&amp;", text)
    elif "Extra content at the end" in message and (first := first_tag(text, root)) is not None:
        end = [] if f"</{root}>" in text else [f"</{root}>", ""]
        yield "\n".join([*lines[:first], opening_tag(text, root), *lines[first:], *end])
    elif "XML declaration allowed only" in message:
        yield text.lstrip()
    elif "Start tag expected" in message and "<" in text:  # a browser writes a line above what it shows
        yield text[text.index("<") :]
    last = at + 1 == len(lines) or lines[at + 1].lstrip().startswith("<")
    for line in (_quoted(lines[at]), *_ended(lines[at], last=last)):
        yield "\n".join([*lines[:at], line, *lines[at + 1 :]])


def _without_hyphens(comment: re.Match[str]) -> str:
    """Return a comment without `--` in it; as it is where it goes on into another one."""
    inner = re.sub(r"-(?=-)|-$", "- ", comment[1])
    return comment[0] if "<!--" in comment[1] else f"<!--{inner}-->"


def _matching(lines: list[str], opened: str, line: int, closed: str, root: str) -> Iterator[str]:
    """Yield the lines with the right closing tag, or with the tag closed that is open."""
    closing = next((i for i in range(line, len(lines)) if f"</{closed}" in lines[i]), None)
    alike = opened.lower() == closed.lower() or bool(get_close_matches(closed, [opened], cutoff=0.7))
    if closing is not None and alike:
        right = lines[closing].replace(f"</{closed}", f"</{opened}", 1)
        yield "\n".join([*lines[:closing], right, *lines[closing + 1 :]])
    if closing is not None and opened == root:
        left = re.sub(rf"</{re.escape(closed)}\s*>", "", lines[closing], count=1)
        yield "\n".join([*lines[:closing], left, *lines[closing + 1 :]])
    yield from _closed(lines, opened, line, root)


def _closed(lines: list[str], tag: str, line: int, root: str) -> Iterator[str]:
    """Yield the lines with an open tag closed: by `/` before its `>`, all that are left open so, or behind its text."""
    text = "\n".join(lines)
    if tag == root:
        above, _, below = text.rpartition(f"<{root}>")
        if f"<{root}" in above and not below.strip():
            yield f"{above}</{root}>{below}"
        yield f"{text.rstrip()}\n</{root}>\n"
    elif 0 <= line < len(lines) and (at := end_of_children(lines, line + 1)):
        closing = f"{lines[line][: len(lines[line]) - len(lines[line].lstrip())]}</{tag}>"
        yield "\n".join([*lines[: at - 1], closing, *lines[at - 1 :]])
    elif tag == "group" and (end := text.rfind(f"</{root}>")) >= 0:
        yield f"{text[:end]}</{tag}>\n{text[end:]}"
    if tag in {root, "group"}:
        return
    begun = re.compile(rf"<{re.escape(tag)}\b[^<>]*(?<!/)>(?=\s*(?:<|\Z))")
    for found in begun.finditer(text):
        first, last = (text.count("\n", 0, place) for place in found.span())
        if first <= line <= last:
            yield f"{text[: found.end() - 1].rstrip()}/>{text[found.end() :]}"
    if f"</{tag}" not in text:
        yield begun.sub(lambda found: f"{found[0][:-1].rstrip()}/>", text)
    if 0 <= line < len(lines):
        yield "\n".join([*lines[:line], f"{lines[line].rstrip()}</{tag}>", *lines[line + 1 :]])


def _quoted(line: str) -> str:
    """Return the line with plain quotes around each value, and a space before each attribute."""
    plain = re.sub(
        r"<\s+(?=[\w/])|<<(?=\w)", lambda found: "</" if "/" in found[0] else "<", TYPOGRAPHIC.sub('"', line)
    )
    apart = re.sub(r"(=\s*(?:\"[^\"]*\"|'[^']*'))(?=[\w-]+\s*=)", r"\1 ", plain)
    with_sign = re.sub(r"(?<=\s)([\w-]+)(?=\"[^\"]*\"(?:\s|/|>))", r"\1=", apart)
    return _ATTRIBUTE.sub(lambda m: m[0] if m[3][0] in "\"'" else f'{m[1]}{m[2]}"{m[3]}"', with_sign)


def _ended(line: str, *, last: bool) -> Iterator[str]:
    """Yield the line with a quote where a value can begin or end, and, if it is the tag's last, with the tag's end."""
    if line.count('"') % 2:
        places = [*re.finditer(r"\s+[\w-]+\s*=|\s*/?>|\s*$", line), *re.finditer(r"(?<==)(?=[^\s\"'])", line)]
        yield from (f'{line[: place.start()]}"{line[place.start() :]}' for place in places)
    bare = line.rstrip()
    yield re.sub(r"/\s+>$", "/>", bare)
    if not bare.endswith(">") and last:
        yield from (f"{bare.rstrip('/')}/>", f"{bare}>")
