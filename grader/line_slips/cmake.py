"""Slips in the brackets and commands of `CMakeLists.txt`: what a line says, and what it should say."""

from __future__ import annotations

import re
from collections.abc import Iterator

from cmake_parser import CMakeError, parse_raw

from grader.line_slips.text import LineSlip, changed_line, doubled_and_turned
from grader.model.package import CMAKE_COMMANDS
from grader.wording import join_words, the_same_on

_CHARS_MAX = 12_000
_CALL_LINES_MAX = 12
_NESTED_MAX = 3
_COMMANDS = "|".join(sorted(CMAKE_COMMANDS, key=len, reverse=True))
_BEGIN = "the command's `(` is missing"
_VARIABLE = "a variable is written `${{{1}}}`"
# what a line has, what it should have, and the reason ({0}, {1}: the pattern's groups)
_PATTERNS = (
    (r"(\()\s*\(", r"\1", "`{0}` is there twice"),
    (r"(\))\s*\)", r"\1", "`{0}` is there twice"),
    (rf"^(\s*)({_COMMANDS})\s*[{{\[<]", r"\1\2(", "the command's bracket is `(`, and not another one"),
    (rf"^(\s*)({_COMMANDS})(?=[A-Za-z/$])(?!\w*\s*\()", r"\1\2(", _BEGIN),
    (rf"^(\s*)({_COMMANDS})\s*$", r"\1\2(", _BEGIN),
    (r"()\$[(\[](\w+)[)}\]]", r"${\2}", _VARIABLE),
    (r"()\$\{(\w+)[)\]](?=\s|$|\))", r"${\2}", _VARIABLE),
    (r"()\$\{(\w+)(?=\s|$|\))", r"${\2}", _VARIABLE),
    (r"()\$(\w+)\}", r"${\2}", _VARIABLE),
    (r"()(?<![\w$}])[^\w\s(\"$/]?\{(\w+)\}", r"${\2}", _VARIABLE),
    (r"[}\]>]\s*$", ")", "the command's bracket is closed by `)`, and not by another one"),
)  # fmt: skip


def find_slip(text: str, number: int) -> LineSlip | None:
    """Return the one slip near a line of a file that CMake cannot read without which it can be; None where there is no
    such slip."""
    lines = text.split("\n")
    if len(text) > _CHARS_MAX or not 0 < number <= len(lines) or is_good(text):
        return None
    begun = range(max(1, number - _CALL_LINES_MAX), number)
    first = next((n for n in reversed(begun) if re.match(r"\s*\w+\s*[({]?", lines[n - 1])), number)
    last = min(len(lines), number + _CALL_LINES_MAX)
    near = [number, *range(number + 1, last + 1), *range(first, number)]
    slips = (
        *_other_comments(lines),
        *_ends_of_c(lines),
        *_words_alone(lines),
        *(one for n in near for one in _slips_in(lines, n)),
        *doubled_and_turned(lines, near),
    )
    return next((slip for slip in slips if is_good(slip.text)), None)


_OTHER_COMMENT = re.compile(r"^([^#\"]*\)\s*(?=//)|\s*)(//|/\*|<!--|--|%)")
_OF_ARGUMENTS = {"--", "%"}
"""What an argument may begin with too, as in `--option`."""
_END_OF_C = re.compile(r"(?<=\))\s*;(?=\s*(?:#|$))")


def _other_comments(lines: list[str]) -> Iterator[LineSlip]:
    """Yield the text with `#` for what begins comments in other languages, on all of its lines."""
    changed, signs, depth, is_inside = dict[int, str](), dict[str, None](), 0, False
    for number, line in enumerate(lines, 1):
        _, end, behind = line.partition("*/")
        # a command may stand behind the comment
        hit = None if behind.strip() else _OTHER_COMMENT.match(line)
        if hit and depth > 0 and hit[2] in _OF_ARGUMENTS:
            hit = None
        if is_inside and not behind.strip():
            changed[number], code = f"# {line.strip()}", ""
        elif hit:
            changed[number], code = _OTHER_COMMENT.sub(r"\1#", line), hit[1]
            signs[f"`{hit[2]}`"] = None
        else:
            code = line.partition("#")[0]
        depth += code.count("(") - code.count(")")
        is_inside = not end and (is_inside or (hit is not None and hit[2] == "/*"))
    why = f"a comment begins with `#`, and not with {join_words(signs, 'or')}"
    yield from _changed_lines(lines, changed, why, "write `#` where the comment begins")


def _ends_of_c(lines: list[str]) -> Iterator[LineSlip]:
    """Yield the text without the `;` that C has behind a command, on all of its lines."""
    ended = {n: one for n, line in enumerate(lines, 1) if (one := _END_OF_C.sub("", line, count=1)) != line}
    yield from _changed_lines(lines, ended, "no `;` comes behind a command", "delete the `;`")


_WORDS_ALONE = re.compile(
    rf"\s*(?!(?:{_COMMANDS})\b|[A-Z]+_[A-Z_]+\b)[A-Za-z][A-Za-z0-9'-]*(?:[:,]?\s+[A-Za-z'].*|[.:!]?\s*)$"
)


def _words_alone(lines: list[str]) -> Iterator[LineSlip]:
    """Yield the text with a `#` before the words that stand outside of any command: `Declare a catkin package`. One
    word alone goes, as nothing shows that it was a comment."""
    changed, depth = dict[int, str](), 0
    for number, line in enumerate(lines, 1):
        code = line.partition("#")[0]
        is_alone = _WORDS_ALONE.match(code) and not (_joined(code) or _begins_below(lines, number))
        if depth == 0 and is_alone:
            changed[number] = f"# {line.strip()}"
        else:
            depth += code.count("(") - code.count(")")
    if len(changed) == 1 and len(lines[next(iter(changed)) - 1].split()) == 1:
        (number,) = changed
        left = "\n".join([*lines[: number - 1], *lines[number:]])
        yield LineSlip(
            f"`{lines[number - 1].strip()}` is not a command", number, f"delete line {number}", left
        )
    yield from _changed_lines(
        lines, changed, "these words are no command: a comment begins with `#`", "write `#` before them"
    )


def _joined(code: str) -> str:
    """Return the command whose name stands before the line's bracket in several words; "" where none does."""
    words = re.split(r"[\s-]+", code.partition("(")[0].strip())
    name = "_".join(words)
    return name if len(words) > 1 and name.lower() in CMAKE_COMMANDS else ""


def _begins_below(lines: list[str], number: int) -> bool:
    """Return whether the brackets of a command begin below its name."""
    return next((one for one in lines[number:] if one.strip()), "").lstrip().startswith("(")


def _changed_lines(lines: list[str], changed: dict[int, str], why: str, fix: str) -> Iterator[LineSlip]:
    """Yield the slip that these lines have, by their numbers, all of which are changed at once."""
    if changed:
        first, *more = changed
        text = "\n".join(changed.get(number, line) for number, line in enumerate(lines, 1))
        yield LineSlip(why, first, f"{fix}{the_same_on(more)}", text, is_within=True)


def _slips_in(lines: list[str], number: int) -> Iterator[LineSlip]:
    code, sign, comment = lines[number - 1].partition("#")
    if name := _joined(code):
        changed = f"{name}({code.partition('(')[2]}{sign}{comment}"
        yield changed_line(lines, number, changed, f"the command is called `{name}`")
    for pattern, new, why in _PATTERNS:
        found = re.search(pattern, code)
        if found:
            changed = code[: found.start()] + found.expand(new) + code[found.end() :]
            yield changed_line(lines, number, changed + sign + comment, why.format(*found.groups()))


def is_good(text: str) -> bool:
    """Return whether it can be read, calls only commands by names that there are, and closes each of its variables."""
    try:
        commands = list(parse_raw(text, skip_comments=True))
    except (CMakeError, RecursionError):
        return False
    words = [str(token.value) for command in commands for token in command.args if token.kind != "COMMENT"]
    closed = not any(map(is_open, words))
    return closed and not any("_" in word and word in CMAKE_COMMANDS for word in words)


def is_open(word: str) -> bool:
    """Return whether a variable in the word is begun and not closed, or closed and not begun."""
    for _ in range(_NESTED_MAX):  # of `${${PROJECT_NAME}_EXPORTED_TARGETS}`, the inner one first
        word = re.sub(r"\$\w*\{[^\s{}]*\}|\$<.*>", "_", word)
    return bool(re.search(r"[{}]|\$\w", word))
