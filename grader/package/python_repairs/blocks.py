"""Repairs of blocks that do not parse: lines too far in or out, a first line or a body that is missing.

The lines of a script and the index of the one that Python refuses come in, and candidates go out: what the mistake may
be, and the text without it. `syntax.py` chooses among them. It runs in a child process as `examine.py` does: the
standard library only.
"""

from __future__ import annotations

import ast
import re
import textwrap
from collections.abc import Iterator, Sequence
from itertools import takewhile
from typing import Any

from grader.line_slips.python import without_comment_sign, without_texts
from grader.package.lint.script_blocks import lacks_body, lacks_head
from grader.package.python_repairs.lost_heads import lost_head_at

ODD_LINES_MAX = 3
USUAL_DEPTH = 4
OUTERMOST = re.compile(r"(import|from)\s|if\s+__name__\b")
HEAD_TOLD = re.compile(r"expected an indented block after .* on line (\d+)")
OUTER = re.compile(r"(def|class)\s|@|if\s+__name__\b")
"""What is seldom within a block."""
DEFINES = re.compile(r"(def|class)\s")
RUN_ONCE = re.compile(r"\brospy\.(Rate|Publisher|Subscriber|Service|ServiceProxy|init_node)\(")
ENDS_BLOCK = re.compile(r"(return|raise|break|continue)\b|(sys\.)?exit\(")
TELLS_ERROR = re.compile(r"[%{(,+]\s*(e|ex|exc|err|error|exception)(?=\s*(?:[]}).,:!]|$))")
"""A line that prints the error that an `except … as e:` above it caught."""
BEGINS_PART = re.compile(r"\s*(?:def|class)\b|\s*@|(?!elif\b|else\b|except\b|finally\b)[^\s#)\]}]")
CONTINUES = re.compile(r"(elif|else|except|finally)\b")

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


def is_right(lines: Sequence[str], at: int, candidate: str, left: Error | None = None) -> bool:
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


def in_their_blocks(lines: list[str], at: int, message: str) -> Iterator[tuple[str, str]]:
    """Yield the causes and the texts with a line that its block lacks, or with lines in the block that they belong
    to."""
    if "expected an indented block" in message and at and lines[at].strip() == lines[at - 1].strip():
        yield "twice", "\n".join([*lines[:at], *lines[at + 1 :]])
    if "expected an indented block" in message:
        yield from (("level", candidate) for candidate in _with_head_further_out(lines, at))
    if message == "unexpected indent" and DEFINES.match(lines[at].strip()):
        yield from (("level", candidate) for candidate in _with_def_further_out(lines, at))
    if message.startswith(("expected an indented block", "unindent does not match")):
        yield from (("turned", candidate) for candidate in _with_loop_below(lines, at))
        yield from (("indent", candidate) for candidate in _with_body_indented(lines, at))
        yield from (("empty", candidate) for candidate in _with_a_body(lines, at, message))
    if message.startswith("expected 'except' or 'finally'"):
        yield from (("level", candidate) for candidate in _with_lines_in_try(lines, at))
    if message.startswith(("unexpected indent", "unindent does not match")):
        yield from (("commented", candidate) for candidate in _with_head_uncommented(lines, at))
    if message == "unexpected indent" and (module := _with_import(lines, at)):
        yield "token", module
    yield from (("line", candidate) for candidate in _with_line_back(lines, at, message))
    if message.startswith(("unexpected indent", "unindent does not match")):
        yield from (("turned", candidate) for candidate in _with_head_first(lines, at))
        yield from (("level", candidate) for candidate in _with_first_lines_further_out(lines, at))
        yield from (("level", candidate) for candidate in _with_block_moved(lines, at))


def _with_head_further_out(lines: list[str], at: int) -> Iterator[str]:
    """Yield the text with the first line of the block above further out, where it is that line that stands too far in:
    of the outermost level, or of a function right inside another one."""
    head = next((n for n in range(at - 1, -1, -1) if without_texts(lines[n]).strip()), 0)
    own = _width(lines[head])
    around = next((line for line in reversed(lines[:head]) if line.strip() and _width(line) < own), "")
    if OUTERMOST.match(lines[head].strip()):
        yield with_line(lines, head, lines[head].lstrip())
    elif DEFINES.match(lines[head].strip()) and re.match(r"\s*def\s", around) and _width(lines[at]) == own:
        yield with_line(lines, head, _indentation(around) + lines[head].lstrip())


def _with_def_further_out(lines: list[str], at: int) -> Iterator[str]:
    """Yield the text with the first line of a function where the code above it begins, if its body is there already."""
    above = next((line for line in reversed(lines[:at]) if without_texts(line).strip()), "")
    below = next((line for line in lines[at + 1 :] if without_texts(line).strip()), "")
    if _width(above) < _width(lines[at]) == _width(below):
        yield with_line(lines, at, _indentation(above) + lines[at].lstrip())


def with_body_uncommented(lines: list[str], message: str) -> Iterator[tuple[str, str]]:
    """Yield the cause and the text with the comments below a block's first line as its body, where they are code."""
    found = HEAD_TOLD.match(message)
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


def is_in_comments(lines: list[str], at: int) -> bool:
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
    if lacks_body(head, lines[at]) or OUTER.match(lines[at].strip()):
        return
    if does_nothing or (lines[at].strip() and own == around and ends):
        yield with_line(lines, at, f"{around}    {lines[at].lstrip()}")


def _with_loop_below(lines: list[str], at: int) -> Iterator[str]:
    """Yield the text with a line that is only ever run once above the first line of the loop that it interrupts."""
    head, after = lines[at - 1] if at else "", next((line for line in lines[at + 1 :] if line.strip()), "")
    is_as_far = _width(head) == _width(lines[at]) < _width(after)
    if head.lstrip().startswith("while") and is_as_far and RUN_ONCE.search(lines[at]):
        yield "\n".join([*lines[: at - 1], lines[at], head, *lines[at + 1 :]])


def _with_a_body(lines: list[str], at: int, message: str) -> Iterator[str]:
    """Yield the text with a `pass` in the block above the line, which begins further out than that block's head, or
    belongs to no such block; or at the end of the text."""
    code, told = [n for n, line in enumerate(lines) if without_texts(line).strip()], HEAD_TOLD.match(message)
    above = int(told[1]) - 1 if told else next((n for n in reversed(code) if n < at), at)
    head = lines[above]
    is_outer = OUTER.match(lines[at].strip()) and _width(lines[at]) == _width(head)
    is_out = is_outer or _width(lines[at]) < _width(head) or lacks_body(head, lines[at])
    is_last = above == code[-1] and DEFINES.match(head.strip())
    if (is_out or is_last) and not head.lstrip().startswith(("while", "except")):
        candidate = "\n".join([*lines[: above + 1], f"{_indentation(head)}    pass", *lines[above + 1 :]])
        if is_right(lines, at, candidate):
            yield candidate


def _with_head_uncommented(lines: list[str], at: int) -> Iterator[str]:
    """Yield the text with the comment right above the line that is the first line of its block."""
    first, level = _body_in_class(lines, at)
    while first and without_texts(lines[first - 1]).strip() and _width(lines[first - 1]) > _width(lines[at]):
        first, level = first - 1, _indentation(lines[at])
    for number in range(first - 1, -1, -1):
        if head := without_comment_sign(lines[number]):
            before = next((line for line in reversed(lines[:number]) if without_texts(line).strip()), "")
            yield with_line(lines, number, (level or _indentation(before)) + head.lstrip())
        if without_texts(lines[number]).strip():
            return


def _with_import(lines: list[str], at: int) -> str:
    """Return the text with the `import` or `from` that the line has lost at its beginning; "" where it has not."""
    line = lines[at].strip()
    is_used = re.search(rf"(?<![\w.]){re.escape(line)}\.", "\n".join(map(without_texts, lines)))
    word = (
        "from"
        if re.match(r"[\w.]+\s+import\s", line)
        else "import"
        if line.isidentifier() and is_used
        else ""
    )
    return with_line(lines, at, f"{word} {line}") if word else ""


def _with_line_back(lines: list[str], at: int, message: str) -> Iterator[str]:
    """Yield the text with a line that its block cannot do without: `try:`, `except …:`, `pass` or `def …:`."""
    if "'except'" in message and (empty := HEAD_TOLD.match(message)):
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
    elif message.startswith("expected an indented block after 'try'"):
        yield from _with_call_in_try(lines, at)
    elif message.startswith(("unexpected indent", "unindent does not match")):
        yield from _with_loop(lines, at)
        yield from _with_try(lines, at)
        yield from _with_def(lines, at)
        yield from _with_method(lines, at)


def _with_call_in_try(lines: list[str], at: int) -> Iterator[str]:
    """Yield the text with a call of the one function that the script never names again, in its empty `try:`."""
    head = next((n for n in range(at - 1, -1, -1) if lines[n].strip() == "try:"), at)
    code = [without_texts(line) for line in lines]
    defined = [found[1] for line in code if (found := re.match(r"def\s+(\w+)\(\s*\)\s*:", line))]
    named = re.findall(r"\w+", "\n".join(code))
    uncalled = [name for name in defined if named.count(name) == 1]
    if len(uncalled) == 1 and head < at:
        yield "\n".join(
            [*lines[: head + 1], f"{_indentation(lines[head])}    {uncalled[0]}()", *lines[head + 1 :]]
        )


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


def _with_loop(lines: list[str], at: int) -> Iterator[str]:
    """Yield the text with the first line of the loop above lines that sleep, in a script that has no loop."""
    body = list(takewhile(lambda line: not line.strip() or _width(line) >= _width(lines[at]), lines[at:]))
    code = "\n".join(map(without_texts, lines))
    before = next((line for line in reversed(lines[:at]) if without_texts(line).strip()), "")
    sleeps = any(re.search(r"\.sleep\(", line) for line in body)
    if (
        sleeps
        and _width(before) < _width(lines[at])
        and not re.search(r"^\s*(while|for)\b", code, re.MULTILINE)
    ):
        yield "\n".join([*lines[:at], f"{_indentation(before)}while not rospy.is_shutdown():", *lines[at:]])


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


def with_head_of_global(lines: list[str], at: int) -> Iterator[tuple[str, str]]:
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


def _with_first_lines_further_out(lines: list[str], at: int) -> Iterator[str]:
    """Yield the text with the first lines of the block at the level of the line, where they stand further in."""
    own, first = _width(lines[at]), at
    while first and (not without_texts(lines[first - 1]).strip() or _width(lines[first - 1]) > own):
        first -= 1
    head, odd = lines[first - 1] if first else "", [n for n in range(first, at) if lines[n].strip()]
    is_body = without_texts(head).rstrip().endswith(":") and own - _width(head) == USUAL_DEPTH
    if is_body and 0 < len(odd) <= ODD_LINES_MAX and len({_width(lines[n]) for n in odd}) == 1:
        moved = [" " * own + line.lstrip() if line.strip() else line for line in lines[first:at]]
        yield "\n".join([*lines[:first], *moved, *lines[at:]])


def _with_head_first(lines: list[str], at: int) -> Iterator[str]:
    """Yield the text with a line that stands right above `def …:`, and belongs right below it, there."""
    for first in (at, at - 1):
        line, head = [*lines, ""][first : first + 2] if first >= 0 else ("", "")
        own, after = _width(line), next((one for one in lines[first + 2 :] if without_texts(one).strip()), "")
        is_head = re.match(r"\s*(def|class)\b.*:", head) and own > _width(head)
        stands_alone = first <= 0 or not lines[first - 1].strip() or _width(lines[first - 1]) < _width(head)
        is_block = without_texts(line).rstrip().endswith(":")
        fits = _width(after) > own if is_block else _width(after) == own
        if is_head and (_width(after) <= _width(head) or (stands_alone and fits)):
            yield "\n".join([*lines[:first], head, line, *lines[first + 2 :]])


def with_line_moved(lines: list[str], at: int) -> Iterator[str]:
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


def read_furthest(lines: list[str], at: int) -> Iterator[str]:
    """Yield the text with the line moved that is read furthest, well beyond the line: others are moved, too."""
    read: dict[int, list[str]] = {}
    for candidate in with_line_moved(lines, at):
        left = syntax_error(candidate)
        if left is not None and left["kind"] == "IndentationError":
            read.setdefault(left["line"], []).append(candidate)
    furthest = max(read, default=0)
    if furthest > at + 2 and len(read[furthest]) == 1:
        yield from read[furthest]


def with_lines_turned(lines: list[str], at: int) -> Iterator[str]:
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


def with_line(lines: list[str], at: int, line: str) -> str:
    """Return the text with another line at index `at`."""
    return "\n".join([*lines[:at], line, *lines[at + 1 :]])
