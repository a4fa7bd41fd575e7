"""How GitHub and GitLab read Markdown, and what they make of its words."""

from __future__ import annotations

import re

from markdown_it import MarkdownIt

MARKDOWN = MarkdownIt("gfm-like", {"linkify": True})
HARMLESS = {"text", "text_special", "code_inline"}
# What GitHub and GitLab look for in rendered text, wherever it is not code.
FOUND_BY_FORGES = re.compile(
    r"@\w|(?<!\w)(GH-|[#!%&~])\d|\$|:[a-z_]+:|www\.|://|[\[{][+-]|[+-][\]}]|\[\[|\[_*TOC|(?<!\w)[0-9]*[a-f][0-9a-f]{6,39}(?!\w)",
    re.IGNORECASE,
)
QUICK_ACTION = re.compile(r"^\s*/\w", re.MULTILINE)


def prose(tokens) -> str:
    """What is not code, with a blank in the place of each code span."""
    return "".join("\0" if token.type == "code_inline" else token.content for token in tokens)
