"""Python files as a Python reads them, in a child process with limits, and its errors in a student's words."""

from __future__ import annotations

import json
import re
import sys
import time
import unicodedata
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Literal, TypeVar

from pydantic import Field

from grader.limited_child import ChildLimits, run_limited
from grader.line_slips.python import (
    COMMENTED_OUT,
    OUT_OF_BLOCK,
    corrected,
    from_html,
    other_quotes,
    reason_of_doubled,
    reason_of_line,
    without_texts,
)
from grader.line_slips.python_habits import BLOCK, DELETE_LINE, LFS_POINTER, MERGE_MARKER, Reason
from grader.model.file_fault import Fault
from grader.model.python_slip import PythonSlip
from grader.model.record import Record
from grader.model.repair import as_code
from grader.package.reading import printable
from grader.wording import plural

CHECK = "grader.package.lint.syntax:check_all"
MEMORY_BYTES = 1 << 30
CPU_S, WALL_S = 10, 60.0
"""The second only ends what hangs: on a busy machine, a script may wait long for its turn."""
REPORT_BYTES_MAX = 8 << 20
"""More than `syntax.py` has to say of as many files as a package may have."""
CRASHES_MAX = 3
MESSAGE_CHARS_MAX = 500
_TYPOGRAPHIC = (
    ("\u2018\u2019\u201a\u201b\u2032\u00b4", "quote", "'"),
    ("\u201c\u201d\u201e\u201f\u2033\u00ab\u00bb", "quote", '"'),
    ("\u2010\u2011\u2012\u2013\u2014\u2015\u2212", "dash", "-"),
)
TEXT_CHARS_MAX = SOURCE_CHARS_MAX = 300
_VAGUE = (
    "multiple exception", "expression cannot contain assignment", "expected 'except'",
    "Function parameters cannot be parenthesized", "Lambda expression parameters cannot", "invalid syntax",
    "expected ':'", "expected '('", "invalid decimal", "unexpected EOF", "cannot assign", "can't assign",
    "Did you mean to use 'from",
)  # fmt: skip
"""Messages that say less than the line itself."""
_EMPTY_BLOCK = re.compile(r"expected an indented block after .* on line (\d+)")
_EXCEPT = re.compile(r"\s*(except|finally)\b")
_NEXT_BLOCK = re.compile(r"\s*(?:@|(?:def|async def|class|if __name__)\b)")
_SAME_QUOTES = re.compile(r"""\b[rR]?[fF](['"])[^'"{]*\{[^'"}]*[\[(]\1""")
_NEVER_ENDED = re.compile("never closed|EOL while|unterminated (f-)?string")
_UNCLOSED = re.compile(r"'([(\[{])' was never closed")
_ONE_WIDTH = "use four spaces everywhere"
_TAB_SIZE = "let your editor turn the tabs into spaces, at a tab size of {}"
_OUT_OF_BLOCK = "this line is indented less than the lines around it, which belong to one block"
TOO_FAR_IN = "is further in than its block"
"""What the grader says of a line further in than the block that it belongs to."""
_COPIED = "copied from a PDF or a web page"

_MESSAGES: tuple[tuple[str, ...], ...] = (
    (r"inconsistent use of tabs", "tabs and spaces are mixed in the indentation", _ONE_WIDTH),
    (r"unindent does not match",
     "this line's indentation matches none of the lines above it", "start it exactly below a line of the same block"),
    (r"comment goes on", "this line goes on with the comment above it, and lacks its `#`", "begin it with `# `"),
    (r"indented at the top of the file: (.*)",
     "this line is indented, and no code is above it that it could belong to", "{0}"),
    (r"unexpected indent",
     "this line is indented further than the one above for no reason", "start it exactly below that one"),
    (r"text behind the colon of line (\d+)",
     "the text behind the `:` of line {0} is the whole block of that line", "write `#` in front of that text"),
    (r"block without its first line",
     "the line that begins this block (`if …:`) is missing above this line", "write it there, with what it asks"),
    (r"function without its first line",
     "the line that begins this function (`def …:`) is missing above this line",
     "write it there, with the name that the script calls"),
    (r"the same line twice", "this line repeats the one above", DELETE_LINE),
    (r"expected an indented block",
     "the line after a `:` must be indented", "start it four spaces further to the right than the one above"),
    (r"Missing parentheses in call to '(\w+)'", "`{0}` has no brackets, as in Python 2", "write `{0}(...)`"),
    (r"multiple exception types", "this is Python 2", "write `except Error as name:`"),
    (r"leading zeros in decimal", "a number may not begin with 0", "write 777, or 0o777 for an octal one"),
    (r"expected '\('", "the brackets `()` behind the name of the function are missing"),
    (r"expected ':'", "a colon `:` is missing at the end of the line"),
    (r"'(.)' was never closed", "the bracket `{0}` is opened on this line and never closed"),
    (r"unmatched '(.)'",
     "there is one `{0}` too many, or its opening bracket is missing", "delete it, or write what it closes"),
    (r"closing parenthesis '(.)' does not match opening parenthesis '(.)'",
     "a `{1}` is closed by `{0}`", "make the two match"),
    (r"triple-quoted", "a triple-quoted string is opened and never closed", "write the three quotes where it ends"),
    (r"EOL while scanning|unterminated (f-)?string",
     "a quote is opened on this line and never closed", "write the same quote where the string ends"),
    (r"Maybe you meant '=='", "`=` gives a value to a name; to compare, write `==`"),
    (r"cannot assign to|can't assign to", "what is on the left of `=` is not a name", "write a name there"),
    (r"forgot a comma", "a comma is missing between two values", "write `,` between them"),
    (r"'return' outside function", "`return` is outside every function", "indent it like the lines of its function"),
    (r"'(break|continue)'? .*loop", "`{0}` is outside every loop", "indent it like the lines of its loop"),
    (r"'yield' outside", "`yield` is outside every function", "indent it like the lines of its function"),
    (r"f-string: expecting '}'", "a `{` in the f-string is never closed", "write `}` after its value"),
    (r"expected 'except' or 'finally'",
     "a `try:` has no `except` below it", "write `except` there, with the error that it catches, and its block"),
    (r"future feature (\w+) is not", "`__future__` has no `{0}`, and Python 3 needs nothing from it", DELETE_LINE),
    (r"__future__ imports must",
     "`from __future__` may only be the first statement, and Python 3 needs nothing from it", DELETE_LINE),
    (r"non-default argument|parameter without a default",
     "a parameter without a default comes behind one with a default", "move it before that one"),
    (r"no binding for nonlocal '(\w+)'", "no function around this one has a variable {0}",
     "write `global {0}` for one of the whole file"),
    (r"keyword argument repeated", "an argument is given twice", "remove one of the two"),
    (r"positional argument follows keyword",
     "a value without a name comes after one with a name", "move what has `=` to the end of the call"),
    (r"UTF-16", "the file is saved as UTF-16", "save it as UTF-8"),
    (r"Non-UTF-8 code|codec can't decode byte|invalid or missing encoding",
     "the file is not saved as UTF-8 (letters of an old encoding)", "save it as UTF-8"),
    (r"unicodeescape", r"a backslash in a string is read as `\U...`", r"write the string as r\"...\""),
    (r"name '(\w+)' is .* global declaration", "`global {0}` comes after a line that uses {0}"),
    (r"encoding", "line 1 or 2 names an encoding that Python does not know", "write `# -*- coding: utf-8 -*-`"),
    (r"null bytes", "the file holds null bytes, so it is not text, or was saved as UTF-16", "save it as UTF-8"),
    (r"after line continuation", r"nothing may follow a backslash `\` at the end of a line"),
    (r"duplicate argument '(\w+)'", "two parameters are both called `{0}`"),
    (f"{OUT_OF_BLOCK}: (.*)", _OUT_OF_BLOCK, "{0}"),
    (OUT_OF_BLOCK, _OUT_OF_BLOCK),
    (TOO_FAR_IN, "this line is indented too far"),
    (COMMENTED_OUT, "this line begins the block below it, and is commented out", "delete its `#`"),
    (r"unexpected EOF",
     "the file ends in the middle of something (a bracket, or a block without a body)", "complete its last lines"),
    (r"web page in a file", "the whole file is a web page, and not the script that the page shows",
     "download the script itself, by the button Raw or Download of that page, in its place"),
    (r"XML in a file", "the whole file is XML, and its name ends with .py",
     "write the script in its place, or give it the ending of its format (.launch, .urdf)"),
    (r"notebook in a file", "the whole file is a Jupyter notebook",
     "write the code of its cells into a script: `jupyter nbconvert --to script` does that"),
    (r"document in a file", "the whole file is a document of a word processor, or an archive",
     "save it as plain text, with an editor for programs"),
    (r"pointer in a file", *LFS_POINTER),
    (r"PDF in a file", "the whole file is a PDF", "write the script as plain text, with an editor for programs"),
    (r"no indentation in", "no line of the file is indented, as if its spaces were lost when it was copied",
     "start it, and all lines of a block, four spaces further in than the line with `:` above; or copy the file again"),
    (r"line numbers in", "each line begins with its number, which is no part of the program",
     "delete the numbers in front of the lines"),
    (r"C\+\+ in a file", "the whole file is C++, and its name ends with .py", "write this node in Python, not in C++"),
    (r"too many nested|overflow|too complex|recursion|^$", "the file is nested too deep for Python"),
)  # fmt: skip

_BLOCK = re.compile(rf"\s*{BLOCK}")
_LONE = re.compile(r"\s*[{}]\s*;?\s*$")


class SyntaxReport(Record):
    """What `syntax.py` said: `checked` are all files that it came to, `faults` by path."""

    checked: tuple[str, ...] = ()
    faults: dict[str, Fault] = Field(default={})
    slips: tuple[PythonSlip, ...] = ()

    def below(self, folder: str) -> SyntaxReport:
        """Return the faults and slips of a package whose paths it has behind `folder` (`../lab_msgs/`), which is "" for
        the one that it is of."""
        faults = {one.file: one for one in _below(folder, self.faults.values())}
        return SyntaxReport(faults=faults, slips=tuple(_below(folder, self.slips)))


_Found = TypeVar("_Found", Fault, PythonSlip)


def _below(folder: str, found: Iterable[_Found]) -> Iterator[_Found]:
    for one in found:
        if one.file.startswith(folder or one.file.removeprefix("../")):
            yield one.model_copy(update={"file": one.file.removeprefix(folder)})


class _OddLine(Record):
    line: int
    wants: Literal["tabs", "spaces"]


class _RawFault(Record):
    kind: str
    line: int | None
    column: int | None
    message: str
    text: str = ""
    opened: int | None = None
    mixed: bool = False
    tab_size: int | None = None
    odd: _OddLine | None = None


class _RawEntry(Record):
    file: str
    faults: tuple[_RawFault, ...]
    slips: tuple[PythonSlip, ...]


def read_syntax_report(output: bytes | str) -> SyntaxReport:
    """Return the report of `lint/syntax.py` from what it printed; foreign lines are passed over, and what is
    past `REPORT_BYTES_MAX` is not read."""
    checked: list[str] = []
    faults: dict[str, Fault] = {}
    slips: list[PythonSlip] = []
    for entry in filter(None, map(_entry, output[:REPORT_BYTES_MAX].splitlines())):
        file = printable(entry.file)
        checked.append(file)
        if entry.faults:
            first = _fault(file, entry.faults[0])
            faults[file] = first.model_copy(update={"further": tuple(_further(entry.faults))})
        for slip in entry.slips:
            words = {key: printable(getattr(slip, key)) for key in ("message", "fix", "name")}
            slips.append(slip.model_copy(update={"file": file, **words}))
    return SyntaxReport(checked=tuple(checked), faults=faults, slips=tuple(slips))


def _entry(line: bytes | str) -> _RawEntry | None:
    try:
        entry = json.loads(line)
        slips = [{**slip, "file": ""} for slip in entry["slips"]]
        return _RawEntry.model_validate({**entry, "slips": slips})
    except (ValueError, TypeError, KeyError, RecursionError):
        return None


def _further(faults: Sequence[_RawFault]) -> Iterator[str]:
    """Yield how to write the lines behind the first faulty one, as far as that is sure."""
    last, found = 0, list[str]()
    for raw in faults:
        right = corrected(raw.text, raw.message, raw.column)
        reason = reason_of(raw.message, raw.text, column=raw.column)
        alone = raw.kind == "TabError" or _COPIED in reason.why  # whatever the other lines say
        if not (right or alone) or raw.line is None or raw.line <= last:
            break
        last = raw.line
        words = f"write {as_code(right.strip())}" if right else f"{reason.why}: {reason.fix}"
        found.append(f"line {raw.line}: {printable(words)}")
    yield from found[1:FURTHER_SHOWN]
    if len(found) > FURTHER_SHOWN:
        yield f"{plural(len(found) - FURTHER_SHOWN, 'more line')} in the same way"


FURTHER_SHOWN = 5


def _fault(file: str, raw: _RawFault) -> Fault:
    reason = reason_of(raw.message, raw.text, column=raw.column, opened=raw.opened, mixed=raw.mixed)
    if reason.fix == _ONE_WIDTH and raw.tab_size:
        reason = Reason(reason.why, _TAB_SIZE.format(raw.tab_size))
    elif reason.fix == _ONE_WIDTH and raw.odd is not None:
        reason = Reason(
            reason.why, f"begin line {raw.odd.line} with {raw.odd.wants}, as the other lines of the file"
        )
    kind = printable(raw.kind[:MESSAGE_CHARS_MAX])
    column = raw.column if raw.line and raw.column and 0 < raw.column <= len(raw.text) + 1 else None
    if kind in {"TabError", "IndentationError"} and raw.text.strip():
        column = len(raw.text) - len(raw.text.lstrip()) + 1  # Python points at the end of the line
    line = raw.line
    is_open = raw.opened is not None and reason == _never_closed(raw.opened)
    if is_open:
        line, column = raw.opened, column if raw.opened == raw.line else None
    return Fault(
        file=file,
        line=line,
        column=column,
        kind=kind,
        message=printable(raw.message[:MESSAGE_CHARS_MAX]) or kind,
        cause=printable(reason.why),
        fix=printable(reason.fix),
        unclosed=found[1] if (found := _UNCLOSED.search(raw.message)) else "?" if is_open else "",
        source=printable(raw.text[:SOURCE_CHARS_MAX]) if column else "",
    )


def check_syntax(folder: Path, paths: Sequence[str], *, timeout_s: float = WALL_S) -> SyntaxReport:
    """Return the report on files of `folder`, made by this Python in processes of their own with limits.

    A file that crashes Python gets a fault of kind `PythonCrash`, those that the time does not reach
    `NotChecked`.
    """
    deadline = time.monotonic() + timeout_s
    report, left = SyntaxReport(), list(paths)
    for _ in range(CRASHES_MAX + 1):
        remaining_s = deadline - time.monotonic()
        if not left or remaining_s <= 0:
            break
        found, timed_out = _run(folder, left, remaining_s)
        done = set(found.checked)
        left = [path for path in left if printable(path) not in done]
        report = _join_reports(report, found)
        if left:
            crashed = ("PythonCrash", "crashes Python")
            kind, message = ("NotChecked", "takes too long") if timed_out else crashed
            report = _join_reports(report, _without_result([left.pop(0)], kind, message))
        if timed_out:
            break
    return _join_reports(report, _without_result(left, "NotChecked", "was not reached in time"))


def _run(folder: Path, paths: list[str], timeout_s: float) -> tuple[SyntaxReport, bool]:
    size = {
        "memory_bytes": MEMORY_BYTES,
        "file_bytes": 4 * REPORT_BYTES_MAX,
        "answer_bytes": REPORT_BYTES_MAX,
    }
    limits = ChildLimits(cpu_s=CPU_S, wall_s=timeout_s, **size)
    answer = run_limited(CHECK, str(folder.absolute()), paths, limits=limits)
    return read_syntax_report(answer.lines), answer.timed_out


def _without_result(paths: Iterable[str], kind: str, message: str) -> SyntaxReport:
    faults = {}
    for file in map(printable, paths):
        crashed = kind == "PythonCrash"
        cause = f"the syntax of `{file}` could not be checked: reading it {message}" if crashed else ""
        faults[file] = Fault(file=file, line=None, kind=kind, message=message, cause=cause)
    return SyntaxReport(checked=tuple(faults), faults=faults)


def _join_reports(one: SyntaxReport, two: SyntaxReport) -> SyntaxReport:
    faults = {**one.faults, **two.faults}
    return SyntaxReport(checked=one.checked + two.checked, faults=faults, slips=one.slips + two.slips)


def reason_of(
    message: str, text: str = "", *, column: int | None = None, opened: int | None = None, mixed: bool = False
) -> Reason:
    """Return what is wrong in plain words, none where Python's `message` says enough.

    `text` is the faulty line, `column` the place in it (from 1), `opened` the line of a bracket that is never
    closed, `mixed` whether the file indents with tabs and with spaces.
    """
    message, text = message[:TEXT_CHARS_MAX], text[:TEXT_CHARS_MAX]
    vague = any((message.startswith(_VAGUE), MERGE_MARKER.match(text), _LONE.match(text), from_html(text)))
    odd = "invalid decimal" in message and _strange(text)  # Python 3.10 on `1` and an invisible character
    if (
        odd
        or "invalid character" in message
        or "non-printable" in message
        or _ends_typographic(message, text)
    ):
        return _character(message, text)
    if of_block := _reason_of_block(message, text, mixed=mixed):
        return of_block
    if _NEVER_ENDED.search(message) and (twice := reason_of_doubled(text)).why:
        return twice
    reason = reason_of_line(text, message) if vague else Reason()
    if vague and opened is not None and not reason.why:
        reason = _never_closed(opened)
    if reason.why:
        return reason
    if message.startswith("invalid syntax") and _lacks_colon(text, column):
        message = "expected ':'"
    for pattern, *words in _MESSAGES:
        if found := re.search(pattern, message):
            return Reason(*(text.format(*found.groups()) if "{0}" in text else text for text in words))
    return Reason()


def _reason_of_block(message: str, text: str, *, mixed: bool) -> Reason | None:
    """Return what is wrong with the lines of a block, or with the braces of an f-string; None where it is something
    else."""
    if "unindent does not match" in message and mixed:
        why = "tabs and spaces are mixed in the indentation of this file"
        return Reason(why, _ONE_WIDTH)
    if "unindent does not match" in message and (lone := _EXCEPT.match(text)):
        why = f"there is no `try:` for this `{lone[1]}`"
        return Reason(why, "write `try:` above the lines that it is for")
    if other_quotes(text) or (message.startswith("f-string") and _SAME_QUOTES.search(text)):
        why = "the quote inside the braces of this f-string ends it"
        return Reason(why, "write the other kind of quotes inside the braces")
    told = re.match(r"(only comments|nothing) in the block on line (\d+)", message)
    number = told[2] if told else empty[1] if (empty := _EMPTY_BLOCK.match(message)) else ""
    if number and _EXCEPT.match(text) and not message.startswith("only"):
        return Reason(f"there is nothing in the block on line {number}", f"below line {number}, write `pass`")
    if number and (told or (_NEXT_BLOCK.match(text) and "class" not in message)):
        found = "are only comments" if message.startswith("only") else "is nothing"
        return Reason(
            f"there {found} in the block on line {number}", f"below line {number}, write what it should do"
        )
    return None


def _never_closed(line: int) -> Reason:
    return Reason(f"a bracket that is opened on line {line} is never closed")


def _lacks_colon(text: str, column: int | None) -> bool:
    code = without_texts(text).rstrip()
    at_end = column is None or column > len(text.split("#", maxsplit=1)[0].rstrip())
    return at_end and not re.search(r":\W*$", code) and _BLOCK.match(code) is not None


def _character(message: str, text: str) -> Reason:
    """Python before 3.9 does not name the character; it is then looked for in the line."""
    named = re.search(r"U\+([0-9A-Fa-f]{4,6})", message)
    if named and int(named[1], 16) <= sys.maxunicode:
        return _character_words(chr(int(named[1], 16)))
    typographic = "".join(group for group, _, _ in _TYPOGRAPHIC)
    strange = sorted(_strange(text), key=lambda c: c.isprintable() and c not in typographic)
    unknown = Reason("this line holds a character that Python does not know")
    return _character_words(strange[0]) if strange else unknown


def _ends_typographic(message: str, text: str) -> bool:
    """Return whether a text that never ends begins with a plain quote, and ends with a typographic one."""
    opened = next((quote for quote in "'\"" if text.count(quote) == 1), "")
    quotes = "".join(group for group, name, _ in _TYPOGRAPHIC if name == "quote")
    return bool(_NEVER_ENDED.search(message) and opened) and any(
        c in quotes for c in text.partition(opened)[2]
    )


def _strange(text: str) -> list[str]:
    return [c for c in text if ord(c) > 127 and not c.isidentifier() and not unicodedata.combining(c)]


def _character_words(char: str) -> Reason:
    code = f"U+{ord(char):04X}"
    for group, name, plain in _TYPOGRAPHIC:
        if char in group:
            return Reason(f"a typographic {name} {char} ({code}) was {_COPIED}", f"type a plain {plain}")
    if unicodedata.category(char) == "Zs":
        name = "no-break space" if char == "\u00a0" else "special space"
        why = f"an invisible {name} ({code}) was {_COPIED}"
        return Reason(why, "delete the spaces of this line and type them again")
    if not char.isprintable():
        return Reason(f"an invisible character ({code}) was {_COPIED}", "delete this line and type it again")
    plain = unicodedata.normalize("NFKC", char)
    if plain != char and plain.isascii():
        return Reason(f"`{char}` ({code}) is not the plain `{plain}`", f"write a plain `{plain}`")
    return Reason(f"`{char}` ({code}) cannot appear in Python code outside a string or a comment")
