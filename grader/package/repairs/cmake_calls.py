"""The calls in `CMakeLists.txt` as repairs see them: found by name, and added where they belong."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from itertools import islice, takewhile

from cmake_parser.ast import Command, Token

from grader.model.package import CMAKE, PackageFacts
from grader.package.cmake_parse import commands_of
from grader.package.repairs.editing import Files
from grader.wording import lines_text

CALL_LINES_MAX = 30
CALLS_MAX = 20
"""Of one kind that are looked at, misspelt or in comments: more are not a student's."""


def cmake_text(files: Files) -> str:
    return files.text(CMAKE) or ""


def all_calls(files: Files) -> tuple[Command, ...]:
    return commands_of(cmake_text(files).encode()) or ()


def calls_of(files: Files, *names: str) -> list[Command]:
    return [c for c in all_calls(files) if c.identifier.lower() in names]


def words_of(command: Command) -> list[Token]:
    return [token for token in command.args if token.kind != "COMMENT"]


def has_call(files: Files, package: PackageFacts, name: str) -> bool:
    # These are also of the files that it includes.
    told = package.cmake.calls if package.cmake is not None else ()
    return bool(calls_of(files, name)) or any(call.name == name for call in told)


def replace_token(text: str, token: Token, new: str) -> str:
    return text[: token.span.start] + new + text[token.span.stop :]


def change_line(files: Files, place: Command | Token, text: str, why: str, fix: str = "") -> None:
    """Remember that `CMakeLists.txt` becomes `text`, because of what is wrong on the line of a call or a word."""
    files.change("build-line", CMAKE, text, f"line {place.line} of {CMAKE}: {why}", fix)


def change_word(
    files: Files, token: Token, new: str, why: str, fix: str = "", *, call: Command | None = None
) -> None:
    """Remember that a word becomes another one; the line is that of its `call` where that is given."""
    change_line(files, call or token, replace_token(cmake_text(files), token, new), why, fix)


def all_words(files: Files) -> Iterator[Token]:
    for command in all_calls(files):
        yield from command.args


def values_behind(call: Command, keyword: str) -> list[str]:
    words = [token.value for token in words_of(call)]
    behind = words[words.index(keyword) + 1 :] if keyword in words else []
    # The next keyword ends the list; CMake writes keywords in capitals.
    return list(takewhile(lambda word: not word.isupper(), behind))


def add_call(files: Files, what: str, line: str, below: Sequence[str], names: Sequence[str] = ()) -> None:
    """Take the call out of its comment, write it in place of a comment that has not the `names`, or write it below the
    first of these commands that is there; without one, at the end of the file, and project(…) at its beginning."""
    text = cmake_text(files)
    lines = text.split("\n")
    name, _, first = line.partition("(")
    # catkin_create_pkg leaves calls of find_package(…) for other packages than catkin in comments too.
    commented = find_commented(
        text, rf"{name}\s*\(" + (r"\s*catkin\b" if first.startswith("catkin ") else "")
    )
    fix = ""
    if commented is not None:
        at, call = commented
        places = lines_text(at, at + len(call) - 1)
        fix, new = f"remove the `#` on {places}", call
        # Those that it leaves in comments name files that nobody has, such as Message1.msg.
        if not set(names) <= set(re.findall(r"[^\s()]+", "\n".join(call))):
            fix, new = f"in place of {places} write {line}", [line]
        changed = "\n".join([*lines[:at], *new, *lines[at + len(call) :]])
    else:
        above = next((found[0] for name in below if (found := calls_of(files, name))), None)
        end = 0 if name == "project" else len(lines)
        at = text.count("\n", 0, above.span.stop) + 1 if above is not None else end
        changed = "\n".join([*lines[:at], line, *lines[at:]])
    files.change("build-line", CMAKE, changed, f"{CMAKE} does not call {what}", fix)


def find_commented(text: str, pattern: str) -> tuple[int, list[str]] | None:
    """Return the first such call that is commented out, up to its closing bracket: its first line, from 0, and its
    lines without `#`."""
    lines = text.split("\n")
    begun = re.compile(rf"\s*#+\s?{pattern}", re.IGNORECASE)
    for first in islice((n for n, line in enumerate(lines) if begun.match(line)), CALLS_MAX):
        call: list[str] = []
        for line_of_call in lines[first : first + CALL_LINES_MAX]:
            call.append(re.sub(r"^(\s*)#+ ?", r"\1", line_of_call, count=1))
            if ")" in line_of_call and commands_of("\n".join(call).encode()):
                return first, call
    return None
