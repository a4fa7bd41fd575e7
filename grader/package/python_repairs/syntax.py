"""Repairs of Python sources that do not parse, step by step: tabs, Python 2, braces, a token that is missing.

A text comes in, and the steps go out after which it parses; what one line could mean is known to
`grader/line_slips/python.py`. It runs in a child process as `examine.py` does: the standard library and fissix only,
and nothing is executed.
"""

from __future__ import annotations

import ast
import re
import textwrap
from collections.abc import Iterable, Iterator, Sequence
from functools import lru_cache
from itertools import takewhile
from typing import Any

from grader.line_slips.python import (
    PLAIN,
    corrections,
    reason_of_line,
    text_of_many_lines,
    without_brace,
    without_comment_sign,
    without_texts,
)
from grader.line_slips.python_habits import DELETE_LINE
from grader.package.lint.script_blocks import blocks_of, first_version, lacks_body, lacks_head, with_head
from grader.package.lint.script_spellings import without_types
from grader.package.python_repairs.lost_heads import lost_head_at
from grader.package.python_repairs.python2 import as_python3

STEPS_MAX = 60
ODD_LINES_MAX = 3
ALL_OVER = ("merged", "tabs", "python2", "braces", "characters")
OF_SIGNS = re.compile("does not match opening|unmatched|unterminated")
OF_WHOLE = re.compile(
    "__future__|future feature|global declaration|outside function|outside loop|not properly in loop"
)
"""What Python says only of a file that it could read to its end."""
OUTERMOST = re.compile(r"(import|from)\s|if\s+__name__\b")
EMPTY_EXCEPT = re.compile(r"expected an indented block after 'except' statement on line (\d+)")
OF_BLOCK = re.compile(r"(elif|else|except|finally|try)\b")
ROSPY_COMMA = re.compile(r"(?<![\w.])rospy\s*[,;:]\s*(?=[A-Za-z]\w*\s*[(:])")
FUTURE = re.compile(r"\s*from\s+__future__\s+import\s+[\w \t,]+(#.*)?")
DEFINES = re.compile(r"(def|class)\s")
ENDS_BLOCK = re.compile(r"(return|raise|break|continue)\b|(sys\.)?exit\(")
TELLS_ERROR = re.compile(r"[%{(,+]\s*(e|ex|exc|err|error|exception)(?=\s*(?:[]}).,:!]|$))")
"""A line that prints the error that an `except … as e:` above it caught."""
BEGINS_PART = re.compile(r"\s*(?:def|class)\b|\s*@|(?!elif\b|else\b|except\b|finally\b)[^\s#)\]}]")
CONTINUES = re.compile(r"(elif|else|except|finally)\b")

Step = dict[str, Any]
"""`cause`, `line`, the `text` that comes out, and for what does not parse the `error`."""
Error = dict[str, Any]


def syntax_error(text: str) -> Error | None:
    """Return what keeps the text from being compiled, and where; None where nothing does."""
    try:
        compile(text, "script", "exec", dont_inherit=True)
    except SyntaxError as error:
        line = error.lineno or 1
        faulty = "".join(text.split("\n")[line - 1 : line])[:300]
        place = {"line": line, "column": error.offset, "text": faulty}
        return {"kind": type(error).__name__, "message": str(error.msg)[:500], **place}
    except (ValueError, OverflowError, RecursionError, MemoryError):
        return {"kind": "ValueError", "message": "", "line": 1, "column": None, "text": ""}
    return None


def make_readable(text: str) -> list[Step]:
    """Return the steps after which it parses; none where no such repair does it."""
    steps: list[Step] = []
    error = syntax_error(text)
    while error is not None and len(steps) < STEPS_MAX:
        step = _one_step(text, error)
        if step is None:
            return []
        steps.append(step)
        text = step["text"]
        error = syntax_error(text)
    return steps if error is None else []


def _one_step(text: str, error: Error) -> Step | None:
    """Return the first step after which the text parses, else the first after which its part does, else the first
    after which it is read further: that one at once, where such mistakes are all over a file."""
    found: dict[int, Step] = {}
    for cause, candidate in _candidates(text, error):
        if candidate == text:
            continue
        left = syntax_error(candidate)
        if left is None or (left["line"] > error["line"] and _only_tabs(candidate, left)):
            return _step(cause, text, candidate, error)
        is_above = OF_SIGNS.search(error["message"]) and left["line"] < _first_changed(text, candidate)
        if _is_right(text.split("\n"), error["line"] - 1, candidate, left):
            rank = 0
        elif left["line"] > error["line"]:
            rank = 1
        elif is_above or _is_next(error, left):
            rank = 2
        else:
            continue
        if cause in ALL_OVER and not found:
            return _step(cause, text, candidate, error)
        found.setdefault(rank, _step(cause, text, candidate, error))
    return found[min(found)] if found else None


def _is_right(lines: Sequence[str], at: int, candidate: str, left: Error | None = None) -> bool:
    """Return whether the candidate for these lines parses, or would without one mistake of its own that is `left`: of
    the signs in a line, or beyond the part with the line, which ends at the next function or unindented line."""
    left = left or syntax_error(candidate)
    if left is None:
        return True
    changed, number = candidate.split("\n"), left["line"] - 1
    end = next((n for n in range(at + 1, len(lines)) if BEGINS_PART.match(lines[n])), len(lines))
    part = changed[: len(changed) - len(lines) + end]
    if end < len(lines) and len(part) <= number:
        return _parses([*part, f"{_indentation(lines[end])}pass"])
    is_plain = left["kind"] == "SyntaxError" and at <= number < len(changed)
    is_same = is_plain and changed[number].strip() in map(str.strip, lines)
    if not is_same or CONTINUES.match(changed[number].strip()):
        return False
    below = next((line for line in changed[number + 1 :] if line.strip()), "")
    instead = "if 1:" if _width(below) > _width(changed[number]) else "pass"
    return _parses([*changed[:number], _indentation(changed[number]) + instead, *changed[number + 1 :]])


def _parses(lines: Sequence[str]) -> bool:
    return syntax_error("\n".join(lines)) is None


def _step(cause: str, text: str, candidate: str, error: Error) -> Step:
    word = re.match(r"name '(\w+)'", error["message"])
    is_elsewhere = cause in ("merged", "braces", "commented", "level", "line", "twice", "turned", "empty")
    line = _first_changed(text, candidate) if is_elsewhere else error["line"]
    added = candidate.split("\n")[line - 1].strip() if cause == "line" else ""
    return {
        "cause": cause,
        "line": line,
        "error": error,
        "text": candidate,
        "word": added or (word[1] if word else ""),
    }


def _first_changed(before: str, after: str) -> int:
    pairs = zip(before.split("\n"), after.split("\n"), strict=False)
    return next((number for number, (old, new) in enumerate(pairs, start=1) if old != new), 1)


def _all_expanded(text: str, width: int) -> str:
    return "\n".join(_expand_tabs(line, width) for line in text.split("\n"))


def _like_the_line_before(text: str, number: int) -> str:
    """The line with that number begins where the one before it does, which an editor showed below each other."""
    lines = text.split("\n")
    before = next((line for line in reversed(lines[: number - 1]) if line.strip()), "")
    if number <= len(lines) and "\t" in lines[number - 1] and not before.rstrip().endswith(":"):
        indentation = before[: len(before) - len(before.lstrip())]
        lines[number - 1] = indentation + lines[number - 1].lstrip()
    return "\n".join(lines)


def _is_next(error: Error, left: Error) -> bool:
    """Tabs are told before all else, wherever they are, then brackets and quotes, and of open brackets the last one."""
    spaces = ("TabError", "IndentationError")
    if error["kind"] in spaces:
        return left["kind"] not in spaces
    if OF_SIGNS.search(error["message"]) and not OF_SIGNS.search(left["message"]):
        return left["kind"] not in spaces
    if OF_WHOLE.search(left["message"]):
        return not OF_WHOLE.search(error["message"])
    return all("never closed" in one["message"] for one in (error, left)) and left["line"] < error["line"]


def _only_tabs(text: str, error: Error) -> bool:
    """Whether the text parses but for tabs, which are a mistake of their own."""
    return error["kind"] == "TabError" and syntax_error(_all_expanded(text, 8)) is None


def _candidates(text: str, error: Error) -> Iterator[tuple[str, str]]:
    yield "merged", first_version(text)
    lines, at = text.split("\n"), error["line"] - 1
    yield from with_head(lines, at) if 0 <= at < len(lines) else ()
    if error["kind"] in {"TabError", "IndentationError"}:
        wide, narrow = _all_expanded(text, 8), _all_expanded(text, 4)
        yield "tabs", narrow if blocks_of(narrow) == blocks_of(wide) else wide
        yield "tabs", _like_the_line_before(text, error["line"])
        yield "tabs", narrow
    if not 0 <= at < len(lines):
        return
    is_future = "future" in error["message"] and FUTURE.fullmatch(lines[at])
    if is_future or reason_of_line(lines[at]).fix == DELETE_LINE:
        yield "token", _without_line(lines, at)
    yield "token", with_line(lines, at, ROSPY_COMMA.sub("rospy.", lines[at]))
    yield from _with_body_uncommented(lines, error["message"])
    if error["message"].startswith("expected an indented block") and _is_in_comments(lines, at):
        return
    if "global declaration" in error["message"]:
        yield from _with_head_of_global(lines, at)
        yield from _with_global_first(text, error["line"])
    yield from _in_their_blocks(lines, at, error["message"])
    yield from (("python2", candidate) for candidate in as_python3(lines, at))
    yield from (("token", "\n".join(candidate)) for candidate in text_of_many_lines(lines, at))
    if any(map(without_brace, lines[: at + 1])):
        yield "braces", _without_braces(lines)
    for line in dict.fromkeys((at, max(at - 1, 0))):
        told = (error["message"], error["column"]) if line == at else ()
        for changed in corrections(lines[line], *told):
            cause = "characters" if changed == lines[line].translate(PLAIN) else "token"
            yield cause, with_line(lines, line, changed)
    is_headless = error["message"] == "unexpected indent" and lacks_head(lines, at)
    if (error["kind"] == "IndentationError" and not is_headless) or OF_BLOCK.match(lines[at].strip()):
        moved = [("level", candidate) for candidate in _with_line_moved(lines, at)]
        moved += [("turned", candidate) for candidate in _with_lines_turned(lines, at)]
        right = [one for one in moved if _is_right(lines, at, one[1])]
        yield from right or [("level", candidate) for candidate in _read_furthest(lines, at)]


def _without_line(lines: list[str], at: int) -> str:
    """Return the text with an empty line in its place: what follows is told by the lines that it has. The second line
    takes the place of the first where it is meant to be the shebang."""
    first = lines[1] if not at and lines[1:] and lines[1].startswith("#!") else ""
    emptied = with_line(lines, at, first)
    return emptied if not first else with_line(emptied.split("\n"), 1, "")


def _in_their_blocks(lines: list[str], at: int, message: str) -> Iterator[tuple[str, str]]:
    """Yield the causes and the texts with a line that its block lacks, or with lines in the block that they belong
    to."""
    if "expected an indented block" in message and at and lines[at].strip() == lines[at - 1].strip():
        yield "twice", "\n".join([*lines[:at], *lines[at + 1 :]])
    if "expected an indented block" in message and at and OUTERMOST.match(lines[at - 1].strip()):
        yield "level", with_line(lines, at - 1, lines[at - 1].lstrip())
    if message.startswith(("expected an indented block", "unindent does not match")):
        yield from (("indent", candidate) for candidate in _with_body_indented(lines, at))
        yield from (("empty", candidate) for candidate in _with_a_body(lines, at))
    if message.startswith("expected 'except' or 'finally'"):
        yield from (("level", candidate) for candidate in _with_lines_in_try(lines, at))
    if message.startswith(("unexpected indent", "unindent does not match")):
        yield from (("commented", candidate) for candidate in _with_head_uncommented(lines, at))
    yield from (("line", candidate) for candidate in _with_line_back(lines, at, message))
    if message.startswith(("unexpected indent", "unindent does not match")):
        yield from (("turned", candidate) for candidate in _with_head_first(lines, at))
        yield from (("level", candidate) for candidate in _with_block_moved(lines, at))


def _without_braces(lines: list[str]) -> str:
    """Return the text with `:` where a block begins with `{`, and without the `}` of these blocks."""
    opened, kept = 0, []
    for line in lines:
        if head := without_brace(line):
            opened += 1 - line.strip().startswith("}")
            kept.append(head)
        elif opened and line.strip() in ("}", "};"):
            opened -= 1
        else:
            kept.append(line)
    return "\n".join(kept)


def _with_body_uncommented(lines: list[str], message: str) -> Iterator[tuple[str, str]]:
    """Yield the cause and the text with the comments below a block's first line as its body, where they are code."""
    found = re.match(r"expected an indented block after .* on line (\d+)", message)
    head = int(found[1]) if found else 0
    body = list(takewhile(lambda line: line.lstrip().startswith("#"), lines[head:]))
    after = next((line for line in lines[head + len(body) :] if without_texts(line).strip()), "")
    # what follows as far in as the block's first line may be its body
    is_other = re.match(r"\s*(@|(def|class|except|finally|else|elif)\b)", after) or OUTERMOST.match(after)
    if not head or not (is_other or _width(after) < _width(lines[head - 1]) or not after):
        return
    code = textwrap.dedent("\n".join(re.sub(r"^(\s*)#", r"\1", line) for line in body))
    try:
        statements = ast.parse(code).body
    except (SyntaxError, ValueError):
        return
    if any(not isinstance(one, ast.Expr) or isinstance(one.value, ast.Call) for one in statements):
        inner = textwrap.indent(code, f"{_indentation(lines[head - 1])}    ").split("\n")
        yield "emptied", "\n".join([*lines[:head], *inner, *lines[head + len(body) :]])


def _is_in_comments(lines: list[str], at: int) -> bool:
    """Return whether comments stand where the block above a line has to be: its lines may be no part of that."""
    above = list(takewhile(lambda line: not without_texts(line).strip(), reversed(lines[:at])))
    comments = [_width(line) for line in above if line.strip()]
    return bool(comments) and max(comments) > _width(lines[at - len(above) - 1])


def _with_body_indented(lines: list[str], at: int) -> Iterator[str]:
    """Yield the text with the line indented, where it alone can be the body of the block that begins above it: a `pass`
    also from further out."""
    head = next((line for line in reversed(lines[:at]) if without_texts(line).strip()), "")
    after = next((line for line in lines[at + 1 :] if without_texts(line).strip()), "")
    own, around = _indentation(lines[at]), _indentation(head)
    ends = len(_indentation(after)) < len(own) or not after or CONTINUES.match(after.strip())
    is_head = without_texts(head).rstrip().endswith(":")
    does_nothing = lines[at].partition("#")[0].strip() == "pass" and around.startswith(own) and is_head
    if lacks_body(head, lines[at]):
        return
    if does_nothing or (lines[at].strip() and own == around and ends):
        yield with_line(lines, at, f"{around}    {lines[at].lstrip()}")


def _with_a_body(lines: list[str], at: int) -> Iterator[str]:
    """Yield the text with a `pass` in the block above the line, which begins further out than that block's head, or
    belongs to the loop around it."""
    above = next((n for n in range(at - 1, -1, -1) if without_texts(lines[n]).strip()), at)
    head = lines[above]
    is_out = _width(lines[at]) < _width(head) or lacks_body(head, lines[at])
    if is_out and not head.lstrip().startswith("while"):
        candidate = "\n".join([*lines[: above + 1], f"{_indentation(head)}    pass", *lines[above + 1 :]])
        if _is_right(lines, at, candidate):
            yield candidate


def _with_head_uncommented(lines: list[str], at: int) -> Iterator[str]:
    """Yield the text with the comment right above the line that is the first line of its block."""
    first, level = _body_in_class(lines, at)
    for number in range(first - 1, -1, -1):
        if head := without_comment_sign(lines[number]):
            before = next((line for line in reversed(lines[:number]) if without_texts(line).strip()), "")
            yield with_line(lines, number, (level or _indentation(before)) + head.lstrip())
        if without_texts(lines[number]).strip():
            return


def _with_line_back(lines: list[str], at: int, message: str) -> Iterator[str]:
    """Yield the text with a line that its block cannot do without: `try:`, `except …:`, `pass` or `def …:`."""
    if empty := EMPTY_EXCEPT.match(message):
        head = int(empty[1])
        yield "\n".join([*lines[:head], f"{_indentation(lines[head - 1])}    pass", *lines[head:]])
    elif message.startswith("expected 'except' or 'finally'"):
        first = max((n for n, line in enumerate(lines[: at + 1]) if line.strip() == "try:"), default=at)
        own = _indentation(lines[first])
        inside = takewhile(
            lambda line: not line.strip() or len(_indentation(line)) > len(own), lines[first + 1 :]
        )
        end = first + 1 + len("\n".join(inside).rstrip().split("\n"))
        told = [(n, found[1]) for n in range(first + 2, end) if (found := TELLS_ERROR.search(lines[n]))]
        text = "\n".join(lines)
        caught = f"{own}except {_error_to_catch(text)}"
        for number, name in told:
            if not re.search(rf"\b{name}\s*=|as {name}\b", text):
                yield "\n".join([*lines[:number], f"{caught} as {name}:", *lines[number:]])
        yield "\n".join([*lines[:end], f"{caught}:", f"{own}    pass", *lines[end:]])
    elif message.startswith(("unexpected indent", "unindent does not match")):
        yield from _with_try(lines, at)
        yield from _with_def(lines, at)
        yield from _with_method(lines, at)


def _error_to_catch(text: str) -> str:
    """Return what an `except` is to catch in this script, which has none for it yet."""
    module = re.search(r"^\s*import rospy(?: as (\w+))?", text, re.MULTILINE)
    of_service = "ServiceProxy" in text and "ServiceException" not in text
    error = "ServiceException" if of_service else "ROSInterruptException"
    return f"{module[1] or 'rospy'}.{error}" if module else "Exception"


def _with_lines_in_try(lines: list[str], at: int) -> Iterator[str]:
    """Yield the text with lines in a `try:` that stand between it and its `except`, and are as far out as these."""
    own = _indentation(lines[at])
    end = next((n for n, line in enumerate(lines[at:], at) if CONTINUES.match(line.strip())), len(lines))
    first = max((n for n, line in enumerate(lines[:at]) if line.rstrip() == f"{own}try:"), default=at)
    is_near = at < end < min(len(lines), at + 1 + ODD_LINES_MAX)
    if is_near and first < at - 1 and _indentation(lines[end]) == own:
        more = len(_indentation(lines[first + 1])) - len(own)
        moved = [_indentation(lines[first + 1])[:more] + line for line in lines[at:end]]
        yield "\n".join([*lines[:at], *moved, *lines[end:]])


def _with_try(lines: list[str], at: int) -> Iterator[str]:
    """Yield the text with `try:` above the lines that an `except` without one stands below."""
    numbers = range(at, len(lines))
    found = next((n for n in numbers if re.match(r"\s*(except|finally)\b", lines[n])), None)
    if found is None or any(re.match(r"\s*(def|class)\b", line) for line in lines[at:found]):
        return
    level, first = _width(lines[found]), found
    while first > 0 and (not lines[first - 1].strip() or _width(lines[first - 1]) > level):
        first -= 1
    first = next((n for n in range(first, found) if lines[n].strip()), found)
    if first < found and not any(line.strip() == "try:" for line in lines[first:found]):
        yield "\n".join([*lines[:first], f"{_indentation(lines[found])}try:", *lines[first:]])


def _with_def(lines: list[str], at: int) -> Iterator[str]:
    """Yield the text with the first line of a function above lines that stand further in for no reason."""
    before = next((line for line in reversed(lines[:at]) if without_texts(line).strip()), "")
    stands_apart = "".join(lines[max(0, at - 2) : at]).strip() == ""
    if (_indentation(before) and not stands_apart) or not _indentation(lines[at]):
        return
    if head := lost_head_at(lines, at, ""):
        yield "\n".join([*lines[:at], head, *lines[at:]])


def _with_head_of_global(lines: list[str], at: int) -> Iterator[tuple[str, str]]:
    """Yield the cause and the text with the first line of a function above its `global`, where it is lost."""
    if at and (head := without_comment_sign(lines[at - 1])):
        yield "commented", with_line(lines, at - 1, _indentation(lines[at - 1]) + head.lstrip())
    yield from (("line", candidate) for candidate in _with_def(lines, at))


def _with_method(lines: list[str], at: int) -> Iterator[str]:
    """Yield the text with the first line of a method above its body, which stands right in its class."""
    first, level = _body_in_class(lines, at)
    if level and (head := lost_head_at(lines, first, level)):
        yield "\n".join([*lines[:first], level + head, *lines[first:]])


def _body_in_class(lines: list[str], at: int) -> tuple[int, str]:
    """Return where lines begin that stand right in a class and further in than its methods, of which the line is one or
    which it is the first of, and what its methods begin with: "" where there are none."""
    first, above = at, next((n for n in range(at - 1, -1, -1) if without_texts(lines[n]).strip()), at)
    level = _width(lines[at if DEFINES.match(lines[at].strip()) else above])
    while first > 0 and (not without_texts(lines[first - 1]).strip() or _width(lines[first - 1]) > level):
        first -= 1
    first = next((n for n in range(first, at) if without_texts(lines[n]).strip()), at)
    around = next((line for line in reversed(lines[:first]) if line.strip() and _width(line) < level), "")
    is_inside = around.startswith("class ") and _width(lines[first]) > level
    return (first, " " * level) if is_inside else (at, "")


def _with_block_moved(lines: list[str], at: int) -> Iterator[str]:
    """Yield the text with the line before at the level of those around it; with the line, and what stands below it as
    far in, at the level of the line before it; or, where it is further out than that, at the one level above that is
    nearest."""
    own = _width(lines[at])
    numbers = [number for number, line in enumerate(lines[:at]) if without_texts(line).strip()]
    above = [_width(lines[number]) for number in numbers] or [0]
    odd = next(
        (i for i, width in enumerate(reversed(above)) if width >= own), 0
    )  # lines further out than their block
    level_before = next((width for width in reversed(above[: len(above) - odd]) if width <= own), None)
    below = range(at + 1, len(lines))
    end = next((i for i in below if lines[i].strip() and _width(lines[i]) < own), len(lines))
    if own > above[-1] and 0 < odd <= ODD_LINES_MAX and level_before == own:
        first, behind = numbers[-odd], lines[numbers[-odd - 1]].strip()
        moved_in = [" " * (own - _width(lines[first])) + line for line in lines[first:at]]
        is_shorter = odd <= 1 + sum(bool(line.strip()) for line in lines[at:end])
        # no line behind a `return` is ever reached
        is_inner = not any(OUTERMOST.match(one) or DEFINES.match(one) for one in map(str.strip, moved_in))
        if is_shorter and is_inner and not ENDS_BLOCK.match(behind):
            yield "\n".join([*lines[:first], *moved_in, *lines[at:]])
    if own > above[-1] and lacks_head(lines, at):
        return  # what is asked there is not known
    if OUTERMOST.match(lines[at].strip()):
        level = 0
    elif own > above[-1]:
        level = above[-1]
    else:
        body = next((_width(line) for line in lines[at + 1 :] if line.strip()), 0)
        if DEFINES.match(lines[at].strip()) and own % 4 and body % 4 == 0:
            return  # the line alone is moved
        distance, level = min((abs(width - own), width) for width in above)
        if {own - distance, own + distance} <= set(above):
            return  # as near to one as to the other
    moved = [
        " " * (_width(line) - own + level) + line.lstrip() if line.strip() else line for line in lines[at:end]
    ]
    yield "\n".join([*lines[:at], *moved, *lines[end:]])


def _with_head_first(lines: list[str], at: int) -> Iterator[str]:
    """Yield the text with a line that stands right above `def …:`, and belongs right below it, there."""
    below = lines[at + 1 : at + 3]
    stands_alone = at == 0 or not lines[at - 1].strip()
    is_head = len(below) > 1 and re.match(r"(def|class)\b.*:", below[0])
    if stands_alone and is_head and _width(below[1]) == _width(lines[at]):
        yield "\n".join([*lines[:at], below[0], lines[at], *lines[at + 2 :]])


def _with_line_moved(lines: list[str], at: int) -> Iterator[str]:
    """Yield the text with the line, or the one above it, as far in as another line of the file, the nearest first."""
    above = next((n for n in range(at - 1, -1, -1) if without_texts(lines[n]).strip()), at)
    widths = {_width(line) for line in lines if line.strip()} | {_width(lines[above]) + 4}
    by_four = {width for width in widths if width % 4 == 0}
    if sum(_width(line) not in by_four for line in lines if line.strip()) <= ODD_LINES_MAX:
        widths = by_four  # another line may be odd, too
    for number in dict.fromkeys((at, above)):
        own = _width(lines[number])
        for width in sorted(widths - {own}, key=lambda width: abs(width - own)):
            yield with_line(lines, number, " " * width + lines[number].lstrip())


def _read_furthest(lines: list[str], at: int) -> Iterator[str]:
    """Yield the text with the line moved that is read furthest, well beyond the line: others are moved, too."""
    read: dict[int, list[str]] = {}
    for candidate in _with_line_moved(lines, at):
        left = syntax_error(candidate)
        if left is not None and left["kind"] == "IndentationError":
            read.setdefault(left["line"], []).append(candidate)
    furthest = max(read, default=0)
    if furthest > at + 2 and len(read[furthest]) == 1:
        yield from read[furthest]


def _with_lines_turned(lines: list[str], at: int) -> Iterator[str]:
    """Yield the text with the line exchanged with the one above it, or with the one below it."""
    for first in (at - 1, at):
        pair = lines[first : first + 2] if first >= 0 else []
        if len(pair) > 1 and all(one.strip() and not re.match(r"(def|class)\b", one) for one in pair):
            yield "\n".join([*lines[:first], lines[first + 1], lines[first], *lines[first + 2 :]])


def _width(line: str) -> int:
    """Return how far in the line begins."""
    return len(_indentation(line).expandtabs(8))


def _indentation(line: str) -> str:
    return line[: len(line) - len(line.lstrip())]


def _with_global_first(text: str, number: int) -> Iterator[tuple[str, str]]:
    """Yield the text with that line's `global` as the first line of its function; without it outside of a function."""
    nodes, lines = list(ast.walk(ast.parse(text))), text.split("\n")
    found = next((n for n in nodes if isinstance(n, ast.Global) and n.lineno == number), None)
    line = lines[number - 1]
    if found is None or line.strip() != ast.unparse(found):
        return
    blocks = (getattr(node, part, None) for node in nodes for part in ("body", "orelse", "finalbody"))
    alone = any(block == [found] for block in blocks)
    lines[number - 1 : number] = [line.replace(line.strip(), "pass")] if alone else []
    around = [n for n in nodes if isinstance(n, ast.FunctionDef) and found in ast.walk(n)]
    if not around:
        yield "outside", "\n".join(lines)
        return
    function = max(around, key=lambda n: n.lineno)
    first = next((s for s in function.body if not is_docstring(s)), function.body[-1])
    at, names = first.lineno - 1, found.names
    indentation = lines[at][: len(lines[at]) - len(lines[at].lstrip())]
    if isinstance(first, ast.Global) and first is not found:
        names = list(dict.fromkeys([*first.names, *names]))
        del lines[at]
    lines.insert(at, f"{indentation}global {', '.join(names)}")
    yield "global", "\n".join(lines)


def _expand_tabs(line: str, width: int) -> str:
    """Return a line of code without tabs before it. To Python, the indentation of any other line means nothing."""
    code = line.lstrip(" \t")
    return line if code.strip()[:1] in {"", "#"} else line[: len(line) - len(code)].expandtabs(width) + code


def with_line(lines: list[str], at: int, line: str) -> str:
    """Return the text with another line at index `at`."""
    return "\n".join([*lines[:at], line, *lines[at + 1 :]])


def is_docstring(statement: ast.stmt) -> bool:
    """Return whether the statement is a constant by itself, as a docstring is."""
    return isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant)


def span_of(lines: list[str], node: ast.expr | ast.stmt) -> tuple[int, int, int] | None:
    """Return line (from 0), start and end of a node on one line, in characters."""
    line = node.lineno - 1
    if node.end_lineno != node.lineno or line >= len(lines) or node.end_col_offset is None:
        return None
    raw = lines[line].encode("utf-8", "surrogatepass")
    start, end = (len(raw[:at].decode("utf-8", "replace")) for at in (node.col_offset, node.end_col_offset))
    return line, start, end


def edited(text: str, edits: Iterable[tuple[int, int, int, str]]) -> str:
    lines = text.split("\n")
    for line, start, end, new in sorted(edits, reverse=True):
        lines[line] = lines[line][:start] + new + lines[line][end:]
    return "\n".join(lines)


def step_to(cause: str, line: int, before: str, after: str, word: str = "") -> Iterator[Step]:
    """Yield the step if it changes anything, and what comes out parses."""
    if after != before and syntax_error(after) is None:
        yield {"cause": cause, "line": line, "word": word, "error": None, "text": after}


def last_name(node: ast.AST | None) -> str:
    """Return `c` of the name `a.b.c`; "" of all else."""
    return node.attr if isinstance(node, ast.Attribute) else node.id if isinstance(node, ast.Name) else ""


@lru_cache(maxsize=2)
def tree_of(text: str) -> ast.Module:
    """Return the tree of a script, which all repairs share and nobody may change; assignments with a type are plain
    ones in it. Raises what `ast.parse` raises."""
    tree = ast.parse(text)
    without_types(tree)
    return tree


@lru_cache(maxsize=64)
def nodes_in(tree: ast.AST) -> tuple[ast.AST, ...]:
    """Return this node of such a tree and all below it, as `ast.walk` has them."""
    return tuple(ast.walk(tree))
