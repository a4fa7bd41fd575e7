"""Text that others wrote, made harmless: shown, never obeyed. One function for each place where it is shown.

| place | function |
|---|---|
| terminal, XML, a log | `line` (one line of bounded length), `visible` (`lines=True` keeps line ends) |
| Markdown | `markdown`, `markdown_code`, `markdown_block` |
| HTML | `html` for text and quoted attributes |
| CSV | `csv_text` for whole tables |
| JSON | `json_text` |
| a file's name | `grader.intake.safe_name` |
"""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Iterable, Iterator, Sequence
from html import escape

from grader.untrusted_text import clip, json_text, line, text_limit, visible, without_ci_commands

__all__ = [
    "clip",
    "code_parts",
    "csv_cell",
    "csv_text",
    "html",
    "json_text",
    "line",
    "markdown",
    "markdown_block",
    "markdown_code",
    "text_limit",
    "visible",
    "without_ci_commands",
]


def html(text: str) -> str:
    """Return `text` for an element's content or for an attribute in quotes.

    Not for `<script>` and `<style>`, whose content HTML reads otherwise.
    """
    # old browsers took a backtick, too, for an attribute's quote
    return escape(visible(text), quote=True).replace("`", "&#96;")


# A backslash keeps markup from being read. It does not keep a forge from finding names, numbers of issues, addresses or
# emoji in the rendered text; in code they do not look, so a word with any of these becomes code.
_LINKED = re.compile(
    r"""
      @[\w-]                                # a mention, an e-mail address
    | ://                                   # an address
    | ^\W*/\w|^\W*~/                        # a topic, a path; a command to GitLab or to a robot that reads comments
    | (?:^|\W)(?:www\.|mailto:|xmpp:)
    | [\w-]\.[^\W\d_]{2}                    # `package.xml`, which some take for a host in Paraguay
    | [\#!%&~^]["\w{]                       # an issue, merge request, milestone, epic, label, alert
    | (?:^|\W)GH-\d
    | (?<!\w)(?=\d*[a-f])[0-9a-f]{7,40}(?!\w)  # a commit
    | \$                                    # a formula, a snippet
    | :(?!\d+:)[+-]?\w[\w+-]*:|:100:|:1234: # an emoji
    | [\[{][+-]|[+-][\]}]                   # GitLab: text that was added or removed
    | \[\[|\[_*TOC|\[\w+:                   # GitLab: a page, a table of contents, other references
    """,
    re.VERBOSE | re.IGNORECASE,
)
_BEFORE, _AFTER = "(\"'", ".,:;)\"'"
_MARKUP = re.compile(r"[\\`*\[\]|~$]|(?<![A-Za-z0-9])_|_(?![A-Za-z0-9])")
_SPAN = re.compile(r"(?<!`)`(?! )([^`]*[^` ])`(?!`)")
_ARGUMENTS = r"(?:[^()`]|\((?:[^()`]|\([^()`]*\))*\)){1,200}"
_CALL = rf"(?:[\w.]*\w\({_ARGUMENTS}\))+"
_TOKEN = re.compile(rf"(?:(?<!`)`(?! )[^`]*[^` ]`(?!`)|(?<![\w.]){_CALL}|[^\s])+")
"""A word, whose code may have blanks in it, and so may a call: `rospy.Service('~count', …)`."""
_FIRST = re.compile(r"[#=:{]|[-+](?![^\s+-])")
_NUMBERED = re.compile(r"(\d{1,9})([.)])(?!\S)")
_ENTITIES = str.maketrans({"&": "&amp;", "<": "&lt;", ">": "&gt;"})


def markdown(text: str, *, cell: bool = False) -> str:
    """Return one line of Markdown that reads as `text`, wherever it stands: at a line's start, in a list, in a `cell`.

    No markup, link, mention, emoji, formula or HTML of it takes effect, but for `code` between two single backticks
    and for what shows by itself that it is code.
    """
    words = _TOKEN.findall(_mark_code(" ".join(visible(text).split())))
    shown = " ".join(_with_code(word, cell=cell) for word in words)
    return shown if cell else _escape_line_start(shown)


def markdown_code(text: str, *, cell: bool = False) -> str:
    """Return a code span that shows `text` as it is. A bar is escaped in a table's `cell`, and only there."""
    return _code(visible(text), cell=cell)


def markdown_block(lines: Iterable[str]) -> str:
    """Return a block of code that shows these lines as they are."""
    rows = [visible(row) for row in lines]
    # longer than any within: a fence ends at one as long as that which began it
    fence = "`" * max(3, 1 + _longest_run("".join(rows)))
    return "\n".join((fence, *rows, fence))


def _longest_run(text: str) -> int:
    return max((len(run) for run in re.findall("`+", text)), default=0)


def _code(text: str, *, cell: bool) -> str:
    if not text.strip():
        return ""
    fence = "`" * (1 + _longest_run(text))
    # CommonMark takes one blank off each side, and backticks at an end would belong to the fence
    pad = " " if text[0] in "` " or text[-1] in "` " else ""
    return f"{fence}{pad}{text.replace('|', chr(92) + '|') if cell else text}{pad}{fence}"


def _with_code(word: str, *, cell: bool) -> str:
    """Return the word with its spans of code; what is made code for another reason becomes one span as a whole."""
    plain = _SPAN.split(word)
    if len(plain) == 1:
        return _word(word, cell=cell)
    # every other part stands outside of the spans
    if any(_LINKED.search(part) for part in plain[::2]):
        return _code("".join(plain), cell=cell)
    return "".join(_code(part, cell=cell) if i % 2 else _escape(part) for i, part in enumerate(plain))


def _word(word: str, *, cell: bool) -> str:
    if _LINKED.search(word) is None:
        return _escape(word)
    rest = word.lstrip(_BEFORE)
    call = re.match(_CALL, rest)
    whole = call is not None and not rest[call.end() :].strip(_AFTER)
    middle = call[0] if call and whole else _close_brackets(rest, rest.rstrip(_AFTER))
    before, after = word[: len(word) - len(rest)], rest[len(middle) :]
    return _escape(before) + _code(middle, cell=cell) + _escape(after)


def _close_brackets(rest: str, middle: str) -> str:
    """Return `middle` with the brackets that close what was opened in it: `rate.sleep()`."""
    closing = re.match(r"\)*", rest[len(middle) :])
    missing = middle.count("(") - middle.count(")")
    return middle + ")" * min(max(missing, 0), len(closing.group()) if closing else 0)


def _escape(text: str) -> str:
    return _MARKUP.sub(r"\\\g<0>", text.translate(_ENTITIES))


def _escape_line_start(shown: str) -> str:
    """Return the line so that it begins no heading, list or quotation."""
    if _FIRST.match(shown):
        return f"\\{shown}"
    return _NUMBERED.sub(r"\1\\\2", shown, count=1) if _NUMBERED.match(shown) else shown


_TEXT_ARGUMENTS = r"(?:[^()`]|\((?:[^()`]|\([^()`]*\))*\)){0,200}"
_FILE = r"(?:[\w.~+-]{0,99}[./*][\w./*~+-]{0,99}[\w*]|FILE)"
_COMMAND = rf"""
    (?:(?:(?:sudo\ )?chmod\ \+x|dos2unix)(?:\ {_FILE})+
    | (?:git\ )?mv\ [\w./-]*\w\ [\w./-]*\w
    | git\ (?:add|commit|push|rm|update-index)\b(?:\ -[\w=+-]+)*(?:\ {_FILE})*
    | (?:mkdir(?:\ -p)?|cd)\ [\w./~-]*\w
    | ros(?:run|launch)\ \w+\ {_FILE}
    | ros(?:topic|node|param|service|msg)\ (?:list|info|echo|hz|pub|type|get|set|load|call|show)\b(?:\ {_FILE})*
    | (?:sudo\ )?apt-get\ install(?:\ [\w.+-]*\w)+)
"""
_CODE = re.compile(
    rf"""
      `(?P<marked>[^`]+)`
    | (?P<quoted>(?<![\w`])'(?=[^'`\n]*\ )[^'`\n]{{1,200}}'(?![\w`]))  # what somebody wrote or printed
    | (?P<found>
        <(?P<tag>[A-Za-z]\w*)[^<>`]{{0,200}}>[\w@.\ -]+</(?P=tag)>  # an element
      | </?[A-Za-z](?:"[^"`]{{0,200}}"|[^<>"`])*>(?!')         # a tag
      | (?<![\w./-]){_COMMAND}(?:\ &&\ {_COMMAND})*(?![\w-])  # a command, several in one line
      | (?<![\w-])--[a-z][\w-]*
      | (?<![\w.:/-])\w+="[^"`]{{0,200}}"                      # an attribute
      | (?<![\w.:/-])[a-z]\w*=(?:True|False|None|-?\d[\w.]*|…|(?![\w"'=<(\[{{$./-]))  # an argument, an attribute's name
      | (?<!\w)_\w+:=[\w./-]+                               # a private parameter
      | \$\([\w\ ./<>…-]+\)(?:/[\w./<>…-]*[\w>…])?         # a substitution of roslaunch
      | "[^"`]{{1,100}}"\ %\ [\w.]+(?:\(\))?                 # a text with its value
      | \#!/[\w/.-]+(?:\ [\w.]+)?                         # the first line of a script
      | (?<![\w./])(?:[\w.]+\ [-+*/%]?=\ )?(?:\w+::)*\w[\w.]*\((?!s\)|es\))
        {_TEXT_ARGUMENTS}\)(?:\.\w+(?:\({_TEXT_ARGUMENTS}\))?)*(?:\['?\w+'?\])*
      | (?<![\w./])[A-Za-z_][\w.]*\[[\w.*-]{{1,20}}\]        # an element
      | (?<![\w./~>])~?/?(?<=[~/])[A-Za-z]\w*(?:/\w+)*/?      # a topic, a path
      | \$\{{\w+\}}\)*
      | (?<![\w./-])[\w./-]*\w\.(?:py|launch|xml|ya?ml|txt|msg|srv|action|cpp|h|hpp|sh|bag|test|csv)(?![\w(/])
      | (?<![\w./])[a-z]\w*/[A-Z]\w*(?![\w/])              # a type: std_msgs/Int8
      | (?<![\w./])[\w.]+\ [-+*/%]?=\ (?:
        '[^']*'|\"[^\"]*\"|-?\d[\w.]*|[a-z]\w+(?:\.\w+)*|\([\w\ +*/.-]+\)(?:\ %\ \d+)?)   # an assignment
      | (?<![\w./@-])(?:[A-Za-z]\w*\.)+[A-Za-z_]\w*(?<!e\.g)(?<!i\.e)(?![\w(/])
      | (?<![\w./])\w*[^\W\d]_\w+(?![\w/])
      | (?<![\w./-])(?=[\w/]*_|src/|scripts/|launch/)\w+(?:/\w+)+/?  # a folder
      | \bfrom\ [\w.]+\ import\ \w+
      )
    """,
    re.VERBOSE,
)


def code_parts(text: str) -> Iterator[tuple[str, bool]]:
    """Yield the text in pieces, and of each whether it is code: what stands between backticks, which are left out, and
    what shows by itself that it is: a call, a tag, a name of ROS's, a file."""
    end = 0
    for found in _CODE.finditer(text):
        if found.start() > end:
            yield text[end : found.start()], False
        yield found["quoted"] or found["marked"] or found["found"], not found["quoted"]
        end = found.end()
    if end < len(text):
        yield text[end:], False


def _mark_code(text: str) -> str:
    """Return the text with backticks round what shows by itself that it is code; as it is where one has no partner."""
    # with a backtick of its own left over, the added ones would pair with it
    if "`" in _CODE.sub("", text):
        return text
    marked, end, last = "", 0, -1
    for found in _CODE.finditer(text):
        beside = text[max(0, found.start() - 1) : found.start()] + text[found.end() : found.end() + 1]
        is_found = found["found"] is not None and "`" not in beside
        marked += text[end : found.start()]
        # two pieces of code that touch are one: two backticks between them would be a fence of two
        if is_found and found.start() == last:
            marked = f"{marked[:-1]}{found[0]}`"
        else:
            marked += f"`{found[0]}`" if is_found else found[0]
        end, last = found.end(), found.end() if is_found else -1
    return marked + text[end:]


CELL_CHARS = 2000
Cell = str | float | None

# Spreadsheets skip blanks and quotes before the sign, know it in full width, and split at `;` in half of Europe.
_FORMULA = re.compile(r"(^|;)([\s\"'`]*[=+\-@\uff1d\uff0b\uff0d\uff20\u2212\ufe62\ufe63\ufe66\ufe6b])")


def csv_text(rows: Iterable[Sequence[Cell]]) -> str:
    """Return the rows as CSV (RFC 4180). Numbers stay numbers; text that could be a formula begins with `'`."""
    out = io.StringIO()
    writer = csv.writer(out, quoting=csv.QUOTE_MINIMAL, lineterminator="\r\n")
    writer.writerows([csv_cell(value) for value in row] for row in rows)
    return out.getvalue()


def csv_cell(value: Cell) -> str:
    """Return a cell's text, harmless in a spreadsheet but not yet quoted for CSV."""
    if value is None:
        return ""
    if not isinstance(value, str):
        return str(value) if math.isfinite(value) else ""  # a spreadsheet reads inf and nan as text
    return _FORMULA.sub(r"\1'\2", line(value, CELL_CHARS))
