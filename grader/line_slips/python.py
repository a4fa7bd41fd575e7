"""What is wrong with a line that Python cannot parse, in a student's words, and the line as it should be.

A line and what Python says of it come in; a cause and the corrected line go out. `python_habits.py` has the tables.
Pure, and the standard library only: `python_repairs/examine.py` calls it in a child.
"""

from __future__ import annotations

import ast
import builtins
import html
import keyword
import os
import re
import threading
from collections.abc import Collection, Iterator, Sequence
from difflib import get_close_matches

from grader.line_slips.python_habits import (
    BLOCK,
    BRACE,
    FROM_HTML,
    HABITS,
    HEADLESS,
    LAST_HABITS,
    Habit,
    Reason,
)
from grader.wording import is_one_edit

LINE_CHARS_MAX = 300  # nobody writes longer ones, and some patterns search a line again and again
_PARSING = threading.Lock()
# a process that is forked while a thread parses would inherit a lock that nothing releases
os.register_at_fork(
    before=_PARSING.acquire, after_in_parent=_PARSING.release, after_in_child=_PARSING.release
)
COMMENTED_OUT = "block commented out"
"""What the grader says of a comment that is the first line of the block below it."""
OUT_OF_BLOCK = "ends its block too early"
"""What the grader says of a line further out than the block that goes on below it."""
_BLOCK = re.compile(rf"\s*{BLOCK}")
_TEXT = re.compile(r"""("(?:\\.|[^"\\])*"|'(?:\\.|[^'\\])*')|#.*""")
_CLOSING = {"(": ")", "[": "]", "{": "}"}
_HEADS = {
    **dict.fromkeys(("elif", "else"), "if 1: pass\n"),
    **dict.fromkeys(("except", "finally"), "try: pass\n"),
}
_GAP = re.compile(r"(?<=[\w\")\]])\s+(?=[\w\"(\[{])")
_CLOSED_ENOUGH = re.compile(r"([\w\")\]}]:?|\(:|[\w.]\()$")
_STATEMENTS = (
    "assert", "break", "class", "continue", "def", "del", "elif", "else", "except", "finally", "for", "from", "global",
    "if", "import", "pass", "raise", "return", "try", "while", "with",
)  # fmt: skip
PLAIN = str.maketrans(
    {
        **dict.fromkeys("\u2018\u2019\u201a\u201b\u2032\u00b4", "'"),
        **dict.fromkeys("\u201c\u201d\u201e\u201f\u2033\u00ab\u00bb", '"'),
        **dict.fromkeys("\u00a0\u2002\u2003\u2007\u2009\u202f\u3000", " "),
        **dict.fromkeys("\u200b\u200c\u200d\u2060\ufeff", ""),
    }
)
"""What web pages and PDF files have in place of plain quotes and spaces."""


def parsed(source: str) -> ast.Module:
    """Return a student's source as a tree, for threads that parse at the same time.

    Python counts how deep a tree is in one place for all threads: where two parse at once, the one or the other can
    fail with SystemError (https://github.com/python/cpython/issues/106905).

    :raises SyntaxError: it is not Python; ValueError, RecursionError or MemoryError likewise.
    """
    with _PARSING:
        return ast.parse(source)


def reason_of_line(line: str, message: str = "") -> Reason:
    """Return what is wrong with a line that does not parse, as far as the tables know it. By Python's `message`, that
    can also be a comma that is missing on a later line."""
    code, comment, texts = _taken_apart(line[:LINE_CHARS_MAX])
    if known := (FROM_HTML if from_html(line) else _reason_in(HABITS, code, comment)):
        return known
    if meant := _keyword(code):
        return Reason(f"Python writes `{meant[1]}`, not `{meant[0]}`")
    if (twice := reason_of_doubled(line)).why:
        return twice
    keywords = ((word, right, _together(changed, "", texts)) for word, right, changed in _with_keyword(code))
    why = next(
        (f"Python writes `{right}`, not `{word}`" for word, right, one in keywords if _parses(one)), ""
    )
    turned = "" if why else _turned_signs(line, corrected(line, message))
    if why or turned:
        return Reason(why or f"{turned} are the wrong way round")
    if apart := next(_with_separator(code, texts), ""):
        sign = "%" if apart.count("%") > code.count("%") else ","
        return Reason(f"`{sign}` is missing between two values")
    # a comma is missing on another line, or blocks above it: then nothing is wrong in this line itself
    last = () if "forgot a comma" in message else HEADLESS if _parses(line) else LAST_HABITS
    return _reason_in(last, code) or Reason()


def _reason_in(habits: tuple[Habit, ...], code: str, comment: str = "") -> Reason | None:
    for habit in habits:
        # to Python, `#include <…>` is a comment
        if found := re.search(habit.pattern, code + comment if "include" in habit.pattern else code):
            word = next(iter(found.groups()), "") or ""
            return Reason(habit.why.replace("{0}", word), habit.fix.replace("{0}", word))
    return None


def reason_of_doubled(line: str) -> Reason:
    """Return which sign stands twice in a line that is good Python with it once; nothing where none does."""
    doubled = without_doubled(line[:LINE_CHARS_MAX])
    sign = next((sign for sign, one in doubled if _parses(one)), "")
    return Reason(f"`{sign}` is there twice", "delete one of the two") if sign else Reason()


def without_brace(line: str) -> str:
    """Return the first line of a block with `:` in place of the `{` that C++ has there; "" for any other line."""
    code, comment, texts = _taken_apart(line[:LINE_CHARS_MAX])
    if not re.match(rf"\s*{BRACE}", code):
        return ""
    return _together(re.sub(rf"^(\s*)(?:\}}\s*)?({BLOCK}.*?)\s*\{{$", r"\1\2:", code), comment, texts)


def corrected(line: str, message: str = "", column: int | None = None) -> str:
    """Return the line as it should be, with its indentation and its comment; "" where that is not sure.

    `message` is what Python says of the line, and `column` the place, from 1.
    """
    shorter = _without_unmatched(line, message, column) if _ends_earlier_lines(line) else ""
    own = list(corrections(line, message, column))
    likely = [] if _parses(line) else with_known_words(line, own, KNOWN_WORDS)
    turned = [one for one in likely if _turned_signs(line, one)]
    return next((one for one in (*turned, *own) if one != line and _parses(one)), shorter)


def corrections(line: str, message: str = "", column: int | None = None) -> Iterator[str]:
    """Yield the line with one mistake after the other put right, then with the token that Python asks for."""
    if len(line) > LINE_CHARS_MAX or not line.strip():
        return
    if message.startswith(COMMENTED_OUT):
        yield without_comment_sign(line)
    if "triple-quoted" in message:
        yield re.sub(r"""^(\s*)(["'])\2(?=\w)""", r"\1\2\2\2", line)
        yield re.sub(r"""(?<=[\w.])(["'])\1(\s*)$""", r"\1\1\1\2", line)
    yield from (other_quotes(line) or line, from_html(line) or line, line.translate(PLAIN))
    code, comment, texts = _taken_apart(line.translate(PLAIN))
    code = re.sub("[\u2010-\u2015\u2212]", "-", code)
    yield _together(code, comment, texts)
    for habit in HABITS:
        before = code
        for pattern, new in habit.rewrites if re.search(habit.pattern, code) else ():
            code = re.sub(pattern, new, code)
        if code != before:
            yield _together(code, comment, texts)
    if meant := _keyword(code):
        code = re.sub(r"^(\s*)\w+", rf"\g<1>{meant[1]}", code)
        yield _together(code, comment, texts)
    doubled = [one for _, one in without_doubled(line) if not _parses(line)]
    yield from doubled if "unmatched" not in message else ()
    yield from (_together(one, comment, texts) for _, _, one in _with_keyword(code) if not _parses(line))
    plain = code.rstrip(" ;")
    yield _together(plain, comment, texts)
    if _BLOCK.match(plain) and not plain.endswith(":"):
        yield _together(f"{plain}:", comment, texts)
    yield from (_together(one, comment, texts) for one in _with_separator(plain, texts))
    yield from _with_bracket(line, message, column)
    yield from doubled
    yield from _with_quote(line, message, column)


def with_known_words(line: str, own: Sequence[str], known: Collection[str]) -> list[str]:
    """Return the line's corrections. Where the first of its `own` that is good Python has a word that is not `known`,
    the line with two neighbours exchanged comes before them, or with a sign more or less by which a word becomes a
    known one."""
    good = next((one for one in own if _parses(one)), "")
    least = len(unknown_words(good, known)) if good else len(line)
    if len(line) > EDITED_CHARS_MAX:
        return [*own]
    said, strange, texts = set(_words(line)), unknown_words(line, known), _taken_apart(line)[2]
    near: dict[str, int] = {}
    for one in _turned(line):
        left = len(unknown_words(one, known))
        is_plain = _taken_apart(one)[2] == texts
        # a sign or a letter that slipped behind a quote: `'talker)'`, `d'ata'`
        is_moved = len(_OUTSIDE.findall(without_texts(one))) > len(_OUTSIDE.findall(without_texts(line)))
        is_better = left < len(strange) or is_moved or (is_plain and not good and set(_words(one)) == said)
        if is_better and left <= least and (least or is_moved) and _parses(one):
            near[one] = left
    for one in _one_sign_off(line) if least else ():
        unknown, words = unknown_words(one, known), set(_words(one))
        gained = any(len(word) > 1 for word in words - said - unknown)
        is_better = len(unknown) < len(strange) or (gained and len(unknown) == len(strange))
        if is_better and len(unknown) < least + gained and _parses(one):
            near.setdefault(one, len(unknown))
    return [*sorted(near, key=lambda one: near[one])[:EDITS_MAX], *own]


def unknown_words(line: str, known: Collection[str]) -> set[str]:
    """Return the words of a line's code that are not among those."""
    return {word for word in _words(line) if word not in known}


def _words(line: str) -> list[str]:
    return _WORD.findall(without_texts(line))


def _turned(line: str) -> Iterator[str]:
    """Yield the line with two neighbours exchanged, of which one at least is no letter. No two words become one, and
    only a quote is exchanged with a colon."""
    for at in range(len(line) - len(line.lstrip()), len(line) - 1):
        pair = line[at : at + 2]
        one = line[:at] + pair[::-1] + line[at + 2 :]
        joins = " " in pair and len(_words(one)) < len(_words(line))
        if not pair.isalnum() and not joins and (":" not in pair or not {*"'\""}.isdisjoint(pair)):
            yield one


def _turned_signs(line: str, right: str) -> str:
    """Return the two neighbours that are exchanged in the right line; "" where that differs in another way."""
    at = next((n for n, (one, other) in enumerate(zip(line, right, strict=False)) if one != other), len(line))
    is_turned = line[at : at + 2] == right[at : at + 2][::-1] and line[at + 2 :] == right[at + 2 :]
    return f"`{line[at]}` and `{line[at + 1]}`" if at < len(line) - 1 and is_turned else ""


def _one_sign_off(line: str) -> Iterator[str]:
    """Yield the line with a sign less, and with a sign more."""
    begin = len(line) - len(line.lstrip())
    yield from (line[:at] + line[at + 1 :] for at in range(begin, len(line)) if line[at] in _LEFT_OUT)
    yield from (line[:at] + sign + line[at:] for sign in _SIGNS for at in range(begin + 1, len(line) + 1))


KNOWN_WORDS = {
    *keyword.kwlist, *dir(builtins), *"bfru", "rospy", "data", "msg", "srv", "std_msgs", "String", "init_node",
    "anonymous", "Publisher", "publish", "queue_size", "Subscriber", "spin", "Rate", "sleep", "is_shutdown", "get_time",
    "loginfo", "get_caller_id", "get_name", "get_param", "Service", "ServiceProxy", "Timer", "Duration",
    "ROSInterruptException",
}  # fmt: skip
"""Python's, and what most nodes use."""
_SIGNS = " ()[].,:="
_OUTSIDE = re.compile(r"[(),:]")
_LEFT_OUT = " ()[],:="
_WORD = re.compile(r"[^\W\d]\w*")
EDITED_CHARS_MAX = 120
EDITS_MAX = 5


def from_html(line: str) -> str:
    """Return the line with the signs that a page's source has as `&quot;` or `&lt;`; "" where that is no good line."""
    plain = html.unescape(line[:LINE_CHARS_MAX])
    return plain if plain != line[:LINE_CHARS_MAX] and _parses(plain) else ""


_BRACES = re.compile(r"\{[^{}]*\}")
_F_STRING = re.compile(r"(?<=[fF])(['\"])(?:(?!\1)[^{}\\]|\{\{|\}\}|\{[^{}]*\})*\1")
"""Whatever quotes its braces have."""


def other_quotes(line: str) -> str:
    """Return the line with the other quotes inside the braces of an f-string; "" where that is no good line."""
    changed = _F_STRING.sub(
        lambda found: _BRACES.sub(lambda one: one[0].replace(found[1], "'\""[found[1] == "'"]), found[0]),
        line,
    )
    return changed if changed != line and _parses(changed) else ""


def without_doubled(line: str) -> Iterator[tuple[str, str]]:
    """Yield each sign that stands twice in a line, and the line with it once: `rospy..spin()`, `''hello'`. One bracket
    opens behind another one on purpose where more than an argument's end comes behind what it opens."""
    for found in re.finditer(r"([^\w\s])\1", line):
        shorter = line[: found.start()] + line[found.end() - 1 :]
        if found[1] != "(" or _CLOSED_LAST.match(_inner(shorter, found.start())):
            yield found[1], shorter


def _inner(line: str, at: int) -> str:
    """Return what comes behind the bracket that closes the one at this place; "(" where none does."""
    code, depth = _TEXT.sub(lambda found: "_" * len(found[0]), line), 0
    for place in range(at, len(code)):
        depth += {"(": 1, ")": -1}.get(code[place], 0)
        if depth == 0:
            return code[place + 1 :]
    return "("


_CLOSED_LAST = re.compile(r"\s*(?:$|[),:\]])")


def without_comment_sign(line: str) -> str:
    """Return the first line of a block that is commented out, without its `#`; "" for any other line."""
    found = re.fullmatch(r"(\s*)#[#\s]*((?:if|while|for|def|class|try|with)\b.*:)\s*", line[:LINE_CHARS_MAX])
    return found[1] + found[2] if found and _parses(found[2]) else ""


def _taken_apart(line: str) -> tuple[str, str, list[str]]:
    """Return the line with its texts emptied and without its comment, the comment, and the texts."""
    texts = [found[1] for found in _TEXT.finditer(line) if found[1]]
    comment = next((found[0] for found in _TEXT.finditer(line) if not found[1]), "")
    code = without_texts(line)
    return code.rstrip(), code[len(code.rstrip()) :] + comment if comment else "", texts


def without_texts(line: str) -> str:
    """Return the line with its string literals emptied and its comment cut."""
    return _TEXT.sub(lambda found: '""' if found[1] else "", line)


def _together(code: str, comment: str, texts: list[str]) -> str:
    left = iter(texts)
    return re.sub('""', lambda found: next(left, found[0]), code) + comment


def _keyword(code: str) -> tuple[str, str] | None:
    """Return the first word of a line, and the keyword that is spelt nearly like it."""
    first = re.match(r"\s*(\w+)(?=\s+[\w\"'(\[{]|\s*:?$)", code)
    word = first[1] if first else ""
    if word in keyword.kwlist or not word:
        return None
    alike = [one for one in _STATEMENTS if sorted(one) == sorted(word.lower())]
    if code.strip() == f"{word}:":
        alike += [one for one in ("try", "else", "finally") if is_one_edit(word.lower(), one)]
    near = alike or get_close_matches(word.lower(), _STATEMENTS, 1, 0.8)
    return (word, near[0]) if near else None


def _with_keyword(code: str) -> Iterator[tuple[str, str, str]]:
    """Yield each word within a line that is nearly a keyword, the keyword, and the line with it."""
    for found in re.finditer(r"(?<![\w.])[A-Za-z]{1,6}(?![\w.(\[=])", code):
        word = found[0]
        near = (one for one in _WITHIN if word.lower() == one or is_one_edit(word.lower(), one))
        for meant in near if word not in keyword.kwlist else ():
            yield word, meant, f"{code[: found.start()]}{meant}{code[found.end() :]}"


_WITHIN = ("in", "or", "and", "not", "if", "else", "for", "as", "is")
"""Keywords that stand within a line."""


def _with_separator(code: str, texts: list[str]) -> Iterator[str]:
    """Yield the line with the `%` or the comma that is missing between two values, where there is one place for it."""
    found = []
    for gap in _GAP.finditer(code):
        before, after = code[: gap.start()], code[gap.end() :]
        text = texts[before.count('""') - 1] if before.endswith('""') and texts else ""
        depth = sum(map(before.count, "([{")) - sum(map(before.count, ")]}"))
        places = re.findall(r"%[\d.]*[sdfgir]", text)
        if len(places) == 1 or (places and after.startswith("(")):
            found.append(f"{before} % {after}")
        elif depth > 0 or re.match(r"\s*(from|import)\b", code):
            found.append(f"{before}, {after}")
    good = [one for one in found if _parses(_together(one, "", texts))]
    yield from good if len(good) == 1 else ()


def _with_bracket(line: str, message: str, column: int | None) -> Iterator[str]:
    """Yield the line without the bracket that closes nothing, with the right one, or with the one that is missing."""
    at = (column or 0) - 1
    if shorter := _without_unmatched(line, message, column):
        code, comment, texts = _taken_apart(line)
        asked = _ASKED.sub(r"\1()", code, count=1)
        called = re.sub(r"((?:^|[\s(=%])(?:\w+\.)+[a-z_]+|^\s*\w+)\)$", r"\1()", code)
        called = re.sub(
            r"^(\s*def\s+(?:\w*(?:callback|cb|handler)(?=msg|data|message|req))?\w*?)((?:(?<=callback)|(?<=cb)|(?<=handler))(?:msg|data|message|req)|)\):$",
            r"\1(\2):",
            called,
        )
        called = re.sub(r"(^|[\s(=])([A-Z]\w*)\)(?=\.|$)", r"\1\2()", called)
        if _METHOD.match(code):
            called = re.sub(r"^(\s+def\s+\w+?)(self(?:,\s*\w+)*)\):$", r"\1(\2):", code)
        filled = _GLUED.sub(r"\1(\2)", code)
        opened = _OPENED.sub(lambda found: f"{_log_call(found[1])}(", code, count=1)
        shifted = re.sub(r"(?<=\w)\)\)", "()", code, count=1)
        likely = (shifted if _parses(shifted) else code, asked, filled, opened, called)
        yield from (_together(one, comment, texts) for one in likely if one != code)
        yield shorter
    wrong = re.search(r"'(.)' does not match opening parenthesis '(.)'", message)
    opener = line.rfind(wrong[2], 0, at) if wrong and wrong[2] in "{[" else 0
    if wrong and opener > 0 and _is_call(line[:opener], line[opener:at], wrong[2]):
        yield line[:opener] + {")": "(", "]": "["}[wrong[1]] + line[opener + 1 :]
    if wrong and line[at : at + 1] == wrong[1]:
        yield line[:at] + _CLOSING[wrong[2]] + line[at + 1 :]
    if "expecting '}'" in message:
        quotes = [found.start() for found in re.finditer("[\"']", line)]
        yield from (f"{line[:quote]}}}{line[quote:]}" for quote in reversed(quotes))
    code, comment, texts = _taken_apart(line)
    # what closes the brackets that are open here, innermost first
    closing = ""
    for char in code:
        if char in _CLOSING:
            closing = _CLOSING[char] + closing
        elif closing.startswith(char):
            closing = closing[1:]
    if closing and _CLOSED_ENOUGH.search(code):
        colon = ":" if code.endswith(":") else ""
        yield _together(code.removesuffix(":") + closing + colon, comment, texts)


_OPENED = re.compile(
    r"((?:\w+\.)+?\w+?|\bprint)(?:\s*\)(?=[\w\"])|(?=\"\")|(?<=\w)(?=rospy\.)|\s+(?=[\w\"]+\s*\)$))"
)
"""A call whose `(` is missing: `pub.publish)x)`, `pub.publish"x")`, `pub.publish x)`, `rospy.loginforospy.…)`."""
_GLUED = re.compile(r"(\.(?:publish|Rate|Duration|sleep|loginfo|logwarn|logerr|get_param))(\w+)\)$")
"""A call whose `(` is missing before its value: `pub.publishtext)`, `rospy.Rate10)`."""
_METHOD = re.compile(r"\s+def\s+\w+self(?:,\s*\w+)*\):$")
"""The first line of a method whose `(` is missing."""


def _is_call(before: str, inside: str, opener: str) -> bool:
    """Return whether what stands before a bracket is called: `name{` is nothing, of a function no part is taken, and no
    part has no name or several."""
    if opener == "{":
        return bool(re.search(r"\w$", before))
    several = inside.strip() == opener or "," in _TEXT.sub('""', inside)
    return bool(_FUNCTION.search(before)) or (several and bool(re.search(r"\w$", before)))


_FUNCTION = re.compile(
    r"(?:(?<![\w.])(?:rospy|math|time)\.\w+|\.(?:publish|sleep)|\bdef\s+\w+"
    r"|(?<![\w.])(?:print|range|str|int|float|len|abs|round))$"
)
"""What is only ever called, and the first line of a function."""
_ASKED = re.compile(
    r"(\.(?:get_caller_id|get_name|get_namespace|get_rostime|get_time|is_shutdown|now|to_sec))\)"
)
"""A call without values whose `(` is missing: `rospy.get_time)`."""
_LOG_CALLS = ("logdebug", "loginfo", "logwarn", "logerr", "logfatal")


def _log_call(name: str) -> str:
    """Return the name of a call as rospy has it, where it is a misspelt one that logs."""
    owner, _, last = name.rpartition(".")
    near = get_close_matches(last, _LOG_CALLS, n=1, cutoff=0.8) if owner == "rospy" else []
    return f"{owner}.{near[0]}" if near else name


def _without_unmatched(line: str, message: str, column: int | None) -> str:
    """Return the line without the bracket that closes nothing; "" where it is not there."""
    at, extra = (column or 0) - 1, re.search(r"unmatched '(.)'", message)
    return line[:at] + line[at + 1 :] if extra and line[at : at + 1] == extra[1] else ""


def _ends_earlier_lines(line: str) -> bool:
    """Return whether the line has two closing brackets more than it opens: it goes on with a call of lines above."""
    code, _, _ = _taken_apart(line)
    return sum(map(code.count, ")]}")) - sum(map(code.count, "([{")) > 1


def _with_quote(line: str, message: str, column: int | None) -> Iterator[str]:
    """Yield the line with the quote that ends its text: in place of another quote, behind a name, before the values of
    its placeholders, or at the end."""
    if column is None or not re.search("unterminated|EOL while", message):
        return
    at = column - 1
    # the column may be that of the letter before the quote, as in `f"`
    quote = line[at : at + 1].strip("rbfu") or line[at + 1 : at + 2]
    other = {"'": '"', '"': "'"}.get(quote)
    if other is None:
        return
    begin = line.index(quote, at) + 1
    if re.search(r"[(,=]\s*[A-Za-z_]\w*(\.\w+)+$", line[:at]):  # `msg.data'`
        yield line[:at] + line[at + 1 :]
    if opened := re.search(r"(?:[(,]|=)\s*(?=[^(),=\s\"'][^(),=\"']*$)", line[:at]):
        yield f"{line[: opened.end()]}{quote}{line[opened.end() :]}"
    for found in re.finditer(other, line[begin:]):
        ended = line[: begin + found.start()] + quote + line[begin + found.end() :]
        yield ended
        yield from (one for _, one in without_doubled(ended))
    if name := re.match(r"[\w/~]+(?=\s*[,)\]])", line[begin:]):
        yield line[: begin + name.end()] + quote + line[begin + name.end() :]
    for values in (r"(.*%[-\d.]*[a-z][^%]*?)(?= *%( +\w| *\())", r"(.*%[-\d.]*[a-z])(?= *, *\w)"):
        if text := re.match(values, line[begin:]):
            yield line[: begin + text.end()] + quote + line[begin + text.end() :]
    end = re.search(r"[)\]}:,\s]*$", line)
    cut = end.start() if end else len(line)
    yield line[:cut] + quote + line[cut:]
    yield line + quote


_QUOTE = re.compile(r"(?<!\w)[rRfFbBuU]{0,2}[\"']")
_TEXT_LINES_MAX = 5


def text_of_many_lines(lines: Sequence[str], at: int) -> Iterator[list[str]]:
    """Yield the lines with a text that begins on line `at` and goes on below it, each part in quotes of its own."""
    opened = _QUOTE.search(_TEXT.sub(lambda found: "." * len(found[0]), lines[at][:LINE_CHARS_MAX]))
    if opened is None:
        return
    quote = opened[0][-1]
    for last in range(at + 1, min(at + _TEXT_LINES_MAX, len(lines))):
        parts = [f"{lines[at].rstrip()} {quote}"]
        for line in lines[at + 1 : last + 1]:
            text = line.strip()
            parts.append(f"{line[: len(line) - len(line.lstrip())]}{opened[0]}{text} {quote}")
        parts[-1] = parts[-1].removesuffix(f" {quote}")
        if quote in lines[last]:
            yield [*lines[:at], *parts, *lines[last + 1 :]]
            return


def _parses(line: str) -> bool:
    """Return whether a line is good Python by itself, or the beginning of a block."""
    code, _, texts = _taken_apart(line.strip())
    word = re.match(r"\w*", code)
    before = _HEADS.get(word[0] if word else "", "")
    after = " pass" if code.endswith(":") else ""
    after += "\nfinally: pass" if re.match(r"try\s*:", code) else ""
    try:
        parsed(before + _together(code, "", texts) + after)
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return False
    return True
