"""Slips in the tags of `package.xml` and launch files: what one line says, and what it should say.

The tags and attributes that these files have are known, so a line is put right by its own words: `basic_comms/name>`
is `basic_comms</name>`. Whether that makes the file a good one is for the caller to try.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from difflib import get_close_matches
from typing import NamedTuple

from grader.wording import is_one_edit

TAGS: dict[str, tuple[str, ...]] = {
    "package": (
        *("package", "name", "version", "description", "author", "maintainer", "license", "url", "export"),
        *("depend", "build_depend", "build_export_depend", "buildtool_depend", "buildtool_export_depend"),
        *("exec_depend", "run_depend", "test_depend", "doc_depend", "group_depend", "member_of_group"),
        *("conflict", "replace"),
    ),
    "launch": (
        *("launch", "arg", "env", "env-loader", "group", "include", "machine", "master", "node", "param"),
        *("remap", "rosparam", "test"),
    ),
}
"""By the root: the tags that there are (REP 127, 140, 149; roslaunch)."""
ATTRIBUTES: dict[str, dict[str, tuple[str, ...]]] = {
    "package": {"package": ("format",), "maintainer": ("email",)},
    "launch": {
        "node": (
            *("pkg", "type", "name", "args", "machine", "respawn", "respawn_delay", "required", "ns"),
            *("clear_params", "output", "cwd", "launch-prefix", "if", "unless"),
        ),
        "param": ("name", "value", "type", "textfile", "binfile", "command", "if", "unless"),
        "rosparam": ("command", "file", "param", "ns", "subst_value", "if", "unless"),
        "remap": ("from", "to", "if", "unless"),
        "arg": ("name", "default", "value", "doc", "if", "unless"),
        "include": ("file", "ns", "clear_params", "pass_all_args", "if", "unless"),
    },
}
"""By the root and the tag: the attributes that there are."""
DECLARATION = '<?xml version="1.0"?>'
_ALIKE = 0.7
_LINE_CHARS_MAX = 1_000
_QUOTED = r"(?:\s+[\w:-]+\s*=\s*(?:\"[^\"]*\"|'[^']*'))"

_DOUBLE = '"'
_VALUE = re.compile(r"(\s[\w:-]+\s*=\s*)(?:(\"[^\"]*\"|'[^']*')|([\w./$():~,+-]+?)([\"']?)(?=\s|[/?]?>|$))")
"""An attribute's beginning, and its value: in quotes, or with at most the one at its end."""


class Slip(NamedTuple):
    """What is wrong with a line, and the line as it should be."""

    why: str
    line: str


def slips_of(line: str, root: str) -> Iterator[Slip]:
    """Yield what can be wrong with the tags of a line, one slip each, the likeliest first."""
    if len(line) > _LINE_CHARS_MAX:
        return
    # The longest first: `env` is also the beginning of `env-loader`.
    names = "|".join(sorted(map(re.escape, TAGS.get(root, (root,))), key=len, reverse=True))
    for pattern, new, why in _PATTERNS:
        found = re.search(pattern.replace("NAMES", names), line)
        if found:
            changed = line[: found.start()] + found.expand(new) + line[found.end() :]
            yield Slip(why.format(*(found.groups() or ("",))), changed)
    yield from _unquoted(line)
    yield from _misspelt(line, root)


_PATTERNS = (
    (r"(=\s*([\"'])(?:(?!\2)[^<>])*)<(?=[\s=\d](?:(?!\2)[^<>])*\2)", r"\1&lt;", "`<` within a value is written `&lt;`"),
    (r"([<>=@])\1", r"\1", "`{0}` is there twice"),
    (r"<(/)/+(?=NAMES)", r"<\1", "`{0}` is there twice"),
    (r"/(/)>", r"\1>", "`{0}` is there twice"),
    (r"(=\s*([\"'])[^\"'<>]+)\2(?=\2)", r"\1", "a quote is there twice"),
    (r"(=\s*)([\"'])(?=\2[^\"'<>\s/?])", r"\1", "a quote is there twice"),
    (r"^(\s*)<?(?:[^\w\s]|_){1,6}(?=(?:(?!-->|<).)*-->\s*$)", r"\1<!--", "a comment begins with `<!--`"),
    (r"^(\s*<!--(?:(?!--).)*[/\"']>)\s*$", r"\1 -->", "a comment ends with `-->`"),
    (r"^(\s*<!--(?:(?!--).)*?)(?<![/\"'])\s*[-_<>=.!]{1,5}\s*$", r"\1 -->", "a comment ends with `-->`"),
    (r"<!--+\s*(</?(?:NAMES)\b[^<>]*(?<!/)>)\s*--+>", r"\1",
     "only a part of an element is in a comment: its other tag is not"),
    (r"-{3,}(?=>)|(?<=<!)-{3,}", "--", "a comment is written between `<!--` and `-->`"),
    (r"\\>", "/>", "the tag ends with `/>`, and not with `\\>`"),
    (r"<\\(NAMES)>", r"</\1>", "a closing tag begins with `</`, and not with `<\\`"),
    (r"(?<=\s)([\w-]+)\s*[:;](?=\s*[\"'])", r"\1=", "`=` belongs between `{0}` and its value"),
    (r"=\s*(?:'([^'\"<>]*)\"|\"([^'\"<>]*)')(?=[\s/>?])", r'="\1\2"',
     "a value ends with the quote with which it begins"),
    (r"(?<=[\"'/])<\s*$", ">", "a tag ends with `>`, and not with `<`"),
    (r"<(NAMES)<\s*$", r"<\1>", "a tag ends with `>`, and not with `<`"),
    (r"</(NAMES)\b(?!\s*>)[^\w\s>-]?", r"</\1>", "the `>` of `</{0}>` is missing"),
    (rf"<(NAMES)({_QUOTED}*)[^\w\s>/]?([^<>=]*</\1>)", r"<\1\2>\3", "the `>` of `<{0}>` is missing"),
    (r"(?<!<)[^\w\s<>/]?/(NAMES)\s*>", r"</\1>", "the `<` of `</{0}>` is missing"),
    (r">/(NAMES)\s*>", r"</\1>", "a closing tag begins with `</`, and not with `>/`"),
    (rf"^(\s*)[^\w\s<]?(NAMES)(?=(?:{_QUOTED}*|\s[^<>]*)\s*/?>)", r"\1<\2", "the `<` of the tag is missing"),
    (r"(<(NAMES)\b[^<>]*>[^<>]+)<\2>", r"\1</\2>", "the `/` of the closing tag is missing"),
    (r"^(\s*)<(NAMES)>\s*$", r"\1</\2>", "the `/` of the closing tag is missing"),
    (r"(<(NAMES)\b[^<>]*(?<!/)>[^<>]*)<\2\s*/>", r"\1</\2>", "a closing tag is written `</{1}>`: its `/` comes first"),
    (r"^(\s*)<(NAMES)\s*/>\s*$", r"\1</\2>", "a closing tag is written `</{1}>`: its `/` comes first"),
    (r"(<(NAMES)\b[^<>]*>[^<>]*)</>", r"\1</\2>", "the name of the closing tag is missing"),
    (r"<>([^<>]*</(NAMES)>)", r"<\2>\1", "the name of the tag is missing"),
)  # fmt: skip
"""What a line has, what it should have, and the reason ({0}, {1}: the pattern's groups)."""


def _unquoted(line: str) -> Iterator[Slip]:
    """Yield the line with quotes around each value that has none, or only the one at its end."""
    changed = _VALUE.sub(
        lambda one: one[0] if one[2] else f"{one[1]}{one[4] or _DOUBLE}{one[3]}{one[4] or _DOUBLE}", line
    )
    if changed != line:
        halves = any(one[4] for one in _VALUE.finditer(line))
        why = (
            "the quote before a value is missing"
            if halves
            else "the value of an attribute has no quotes around it"
        )
        yield Slip(why, changed)


def _misspelt(line: str, root: str) -> Iterator[Slip]:
    """Yield the line with a tag, or an attribute, by its right name."""
    tags = TAGS.get(root, ())
    for word in dict.fromkeys(re.findall(r"<([\w-]+)", line)):
        if word not in tags and (right := _meant(word, tags)):
            changed = re.sub(rf"(</?){re.escape(word)}(?=[\s/>])", rf"\1{right}", line)
            yield Slip(f"there is no tag `<{word}>`: it is called `<{right}>`", changed)
    for tag, attributes in ATTRIBUTES.get(root, {}).items():
        given = re.findall(r"\s([\w-]+)\s*=", line) if re.search(rf"<{tag}\b", line) else []
        others = ATTRIBUTES[root]
        owner = next((o for o in others if tag in o and o != tag and {*given} <= {*others[o]}), "")
        if owner and not {*given} <= {*attributes}:
            changed = re.sub(rf"(</?){tag}(?=[\s/>])", rf"\1{owner}", line)
            yield Slip(f"`<{tag}>` has no such attributes: this is a `<{owner}>`", changed)
        for word in given if not owner else ():
            right = _meant(word, [one for one in attributes if one not in given])
            if word not in attributes and right:
                changed = re.sub(rf"(\s){re.escape(word)}(?=\s*=)", rf"\1{right}", line, count=1)
                yield Slip(f"`<{tag}>` has no attribute `{word}`: it is called `{right}`", changed)


def _meant(word: str, names: tuple[str, ...] | list[str]) -> str:
    """Return the one of the names that is meant by a word; "" where none is."""
    lower = word.lower()
    same = [one for one in names if sorted(one) == sorted(lower)]
    near = [one for one in names if is_one_edit(lower, one)] or get_close_matches(lower, names, 1, _ALIKE)
    return next(iter([*same, *near]), "")
