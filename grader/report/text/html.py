"""HTML: text, quoted attributes, addresses."""

from __future__ import annotations

import re
from html import escape

from grader.untrusted_text import visible

_ADDRESS = re.compile(r"https?://[!-~]+", re.IGNORECASE)


def html(text: str, *, lines: bool = False) -> str:
    """`text` for an element's content or for an attribute in quotes; `lines` is for `<pre>`.

    Not for `<script>` and `<style>`, whose content HTML reads otherwise.
    """
    return escape(visible(text, lines=lines), quote=True).replace("`", "&#96;")


def html_address(address: str) -> str:
    """`address` for `href` and `src`; empty for all but http and https, `javascript:` among them."""
    return html(address) if _ADDRESS.fullmatch(address) else ""
