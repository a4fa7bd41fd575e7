"""What is wrong with a line of a YAML file that holds `name: value`, and the line as it should be."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import NamedTuple

from grader.wording import join_words

YAML_LINES_MAX = 2_000
YAML_CHARS_MAX = 500
"""A line of more is not a student's."""
_GOES_ON = ("|", ">", "{", "[", ",")
"""So ends a line whose value is in the lines below it."""
# not `std::string`, `http://…` or `C:\…`, which are no keys
_NO_SPACE = re.compile(r"""(?P<key>\s*(?:- )?["']?[A-Za-z_][\w-]*["']?):(?P<value>[^\s:/\\].*)""")
_NO_COLON = re.compile(
    r"""(?P<key>\s*(?:- )?[A-Za-z_][\w-]*)(?:\s*(?P<sign>[=;,.])\s*|\s+)(?P<value>["'\w].*)"""
)
_KEY_ALONE = re.compile(r"(?P<key>\s*[A-Za-z_][\w-]*)\s*")
_OPEN_LIST = re.compile(r"""(?P<key>\s*(?:- )?[A-Za-z_][\w-]*): +(?P<value>\[[^\[\]{}"']*[^\[\]{}"',\s])""")
_KEY_BELOW = re.compile(r"\s*[A-Za-z_][\w-]*:(?:\s[^\]]*)?")
_DASH_ALONE = re.compile(r"(?P<above>\s*)- .*")
_NO_SPACE_AFTER_DASH = re.compile(r"(?P<above>\s*)-(?P<value>[^\s-].*)")
_OPEN_QUOTE = re.compile(
    r"""(?P<key>\s*(?:- )?[A-Za-z_][\w-]*): +(?P<value>(?P<quote>["'])(?:(?!(?P=quote)).)*)"""
)
_QUOTE_TWICE = re.compile(
    r"""(?P<key>\s*(?:- )?[A-Za-z_][\w-]*): +(?:(?P<quote>["'])(?P=quote)(?P<value>[^"']+)(?P=quote)"""
    r"""|(?P<quote2>["'])(?P<value2>[^"']+)(?P=quote2){2})"""
)
_KEY_AND_MORE = re.compile(r"(?P<key>\s*[A-Za-z_][\w-]*)(?P<more>::|[;,.=])")
_COLON_INSIDE = re.compile(
    r"""(?P<key>\s*(?:- )?[A-Za-z_][\w-]*): +(?P<value>[^\s"'\[{|>&*!#][^"]*:\s[^"]*)"""
)


class YamlSlip(NamedTuple):
    """The number of a line, from 1, why it is wrong (`has no space after its `:``), and what to write."""

    number: int
    why: str
    right: str


def slip_of_yaml(text: str, until: int) -> YamlSlip | None:
    """Return the first slip in the lines up to `until`; None where they look right."""
    lines = text.splitlines()[: min(until, YAML_LINES_MAX)]
    for number, line in enumerate(lines, start=1):
        if len(line) > YAML_CHARS_MAX:
            return None
        code = re.sub(r"\s+#.*", "", line).rstrip()
        if not code.strip() or code.lstrip().startswith("#"):
            continue
        # the lines below it are no `name: value`, and nothing is known of them
        if code.endswith(_GOES_ON):
            return None
        above = next((one for one in reversed(lines[: number - 1]) if one.strip()), "")
        if found := _slip_of_item(code, above):
            return YamlSlip(number, *found)
        below = next((one for one in lines[number:] if one.strip()), "")
        is_above_block = _indent(below) > _indent(code)
        if (open_list := _OPEN_LIST.fullmatch(code)) and (not below or _KEY_BELOW.fullmatch(below)):
            return YamlSlip(
                number, "opens [ and does not close it", f"{open_list['key'].strip()}: {open_list['value']}]"
            )
        if found := _slip_of_key(code, is_above_block=is_above_block) or _slip_of_value(code):
            return YamlSlip(number, *found)
    return None


def levels_of(names: Iterable[str]) -> str:
    """Return how to nest `/details/name/first` and more of three levels; "" for others, and for one block."""
    below: dict[str, list[str]] = {}
    roots = set()
    for name in names:
        root, *parts = name.strip("/").split("/")
        if len(parts) != 2:
            return ""
        roots.add(root)
        below.setdefault(parts[0], []).append(f"`{parts[1]}:`")
    if len(below) < 2 or len(roots) > 1:
        return ""
    blocks = [f"`{block}:` with {join_words(keys)} below it" for block, keys in below.items()]
    told = f"write the keys in levels, each two spaces further in than the one above: `{roots.pop()}:`, below it "
    return told + join_words(blocks)


def _indent(line: str) -> int:
    return len(line) - len(line.lstrip())


def _slip_of_item(code: str, above: str) -> tuple[str, str] | None:
    """Return what an item of a list lacks below another one in its column, and the line as it should be."""
    found, other = _NO_SPACE_AFTER_DASH.fullmatch(code), _DASH_ALONE.fullmatch(above)
    if found is None or other is None or found["above"] != other["above"]:
        return None
    return "has no space after its `-`", f"- {found['value']}"


def _slip_of_key(code: str, *, is_above_block: bool) -> tuple[str, str] | None:
    """Return what a line of a map lacks, and the line as it should be."""
    if found := _NO_SPACE.fullmatch(code):
        return "has no space after its `:`", f"{found['key'].strip()}: {found['value']}"
    if is_above_block and (found := _KEY_ALONE.fullmatch(code)):
        return "has no `:` after its name", f"{found['key'].strip()}:"
    if ":" not in code and (found := _NO_COLON.fullmatch(code)):
        lacks = f"has `{found['sign']}` in place of `:`" if found["sign"] else "has no `:` after its name"
        return lacks, f"{found['key'].strip()}: {found['value']}"
    if is_above_block and (found := _KEY_AND_MORE.fullmatch(code)):
        return f"has `{found['more']}` in place of `:` after its name", f"{found['key'].strip()}:"
    return None


def _slip_of_value(code: str) -> tuple[str, str] | None:
    if found := _QUOTE_TWICE.fullmatch(code):
        quote, value = found["quote"] or found["quote2"], found["value"] or found["value2"]
        return f"has {quote} twice", f"{found['key'].strip()}: {quote}{value}{quote}"
    if found := _OPEN_QUOTE.fullmatch(code):
        lacks = f"opens {found['quote']} and does not close it"
        return lacks, f"{found['key'].strip()}: {found['value']}{found['quote']}"
    if found := _COLON_INSIDE.fullmatch(code):
        return "has a `:` in its value", f'{found["key"].strip()}: "{found["value"]}"'
    return None
