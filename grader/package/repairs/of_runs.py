"""Repairs of what only a run shows: a value or a message of another type, a loop's rate, or one field for another.

The line is known by what a criterion cites or says, and what to write there by its hint (`grader/wording.py`).
"""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path, PurePosixPath

from grader.model.repair import RENAMED, Repair
from grader.package.repairs.editing import Files
from grader.wording import (
    ASKED_RATE,
    ASKED_TYPE,
    CONVERTED,
    HIDING,
    IN_PLACE_OF_INPUT,
    IN_PLACE_OF_SPIN,
    NO_SEMICOLON,
    PUBLISHED_TYPE,
    SWAPPED,
    TEXT_PLACE,
    WRITE_HANDLER,
    convert,
    join_words,
)


def repairs_by_hint(folder: Path, hint: str, file: str, line: int) -> list[Repair]:
    """Return the repairs of a lost criterion that cites this line first."""
    for pattern, repairs in BY_HINT:
        if (found := pattern.search(hint)) is not None:
            return repairs(folder, file, line, found)
    return []


def narrow_handler(folder: Path, file: str, line: int, right: str) -> list[Repair]:
    """Return the repair of an `except` that drops every error, after which Python shows what it dropped."""
    files = Files(folder=folder.resolve())
    lines = (files.text(file) or "").split("\n")
    found = re.match(r"([ \t]*)except\b[^:]*:", lines[line - 1]) if line <= len(lines) else None
    if found is not None:
        lines[line - 1] = found[1] + right + lines[line - 1][found.end() :]
        message = f"line {line} of {file}: drops every error"
        files.change("missing-call", file, "\n".join(lines), message)
    return list(files.repairs)


def other_call(folder: Path, file: str, line: int, right: str, *, wrong: str, why: str) -> list[Repair]:
    """Return the repair that writes `right`, such as `rate.sleep()`, in place of a line that is only a call of what
    matches `wrong`."""
    files = Files(folder=folder.resolve())
    lines = (files.text(file) or "").split("\n")
    found = (
        re.fullmatch(rf"([ \t]*)(?:{wrong})([ \t]*(?:#.*)?)", lines[line - 1]) if line <= len(lines) else None
    )
    if found is not None:
        lines[line - 1] = f"{found[1]}{right}{found[2]}"
        files.change("missing-call", file, "\n".join(lines), f"line {line} of {file}: {why}")
    return list(files.repairs)


SPIN, INPUT = r"(?:\w+\.)?spin\(\)", r"(?:raw_)?input\([^()]*\)"


def no_longer_hiding(file: str) -> Repair:
    """Return the repair that renames a file which has the name of a module that its neighbours import."""
    path = PurePosixPath(file)
    new = str(path.with_name(f"{RENAMED}{path.name}"))
    message = f"{file} hides the module {path.stem}"
    return Repair(
        kind="file-name", file=file, before=file, after=new, message=message, fix=f"mv {file} {new}"
    )


def without_ord(folder: Path, file: str, line: int, told: re.Match[str]) -> list[Repair]:
    """Return the repair that leaves out a call of `ord` around what is a number already."""
    files = Files(folder=folder.resolve())
    lines = (files.text(file) or "").split("\n")
    if line <= len(lines) and told[2] in lines[line - 1]:
        lines[line - 1] = lines[line - 1].replace(told[2], told[1])
        message = f"line {line} of {file}: in Python 3, {told[1]} is a number already"
        files.change("missing-call", file, "\n".join(lines), message, told[0])
    return list(files.repairs)


def topic_type(folder: Path, file: str, line: int, told: re.Match[str]) -> list[Repair]:
    """Return the repair of the type that a topic has, of any package's messages, or else of numbers."""
    return message_type(folder, file, line, told[1], told[2]) or number_type(folder, file, line, told[2])


def conversions(folder: Path, file: str, line: int, function: str, value: str) -> list[Repair]:
    """Return the repairs that put `value` into `str(…)` or the like at the line where a run ended of its type, and on
    the other lines of the script that join it to a text, or what is got by the same call."""
    files = Files(folder=folder.resolve())
    text = files.text(file) or ""
    made = re.search(rf"^[ \t]*{re.escape(value)}\s*=\s*(\S+\(.*\))\s*$", text, re.MULTILINE)
    alike = rf"^[ \t]*([\w.]+)\s*=\s*{re.escape(made[1])}\s*$" if made else r"(?!)"
    for each in dict.fromkeys((value, *re.findall(alike, text, re.MULTILINE))):
        name, right = rf"(?<![\w.]){re.escape(each)}(?![\w.(\[])", f"{function}({each})"
        joined = re.compile(rf"[\"']\s*\+\s*{name}")
        for number, code in enumerate(text.split("\n"), start=1):
            is_other = function == "str" and joined.search(code)
            is_it = number == line and each == value
            if (is_it or is_other) and len(re.findall(name, code)) == 1:
                lines = (files.text(file) or "").split("\n")
                lines[number - 1] = re.sub(name, right.replace("\\", r"\\"), lines[number - 1])
                message = f"line {number} of {file}: `{each}` is of another type than is needed here"
                files.change("missing-call", file, "\n".join(lines), message, convert(function, each))
    return list(files.repairs)


NUMBER_PLACE = re.compile(r"%[-+ #0-9.]*[dif](?!\w)")


def text_place(folder: Path, file: str, line: int) -> list[Repair]:
    """Return the repair that makes `%s` of the only `%d` or `%f` of a line at which a run ended, as a text came."""
    files = Files(folder=folder.resolve())
    lines = (files.text(file) or "").split("\n")
    found = NUMBER_PLACE.findall(lines[line - 1]) if line <= len(lines) else []
    if len(found) == 1:
        lines[line - 1] = lines[line - 1].replace(found[0], "%s")
        message = f"line {line} of {file}: `{found[0]}` takes a number, and gets a text"
        files.change("missing-call", file, "\n".join(lines), message, f"write `%s` instead of `{found[0]}`")
    return list(files.repairs)


def loop_rate(folder: Path, file: str, line: int, right: str) -> list[Repair]:
    """Return the repair that writes `right`, such as `rospy.Rate(10)`, in place of the line's only call of that name:
    the rate's own criteria keep their loss, and others show what the loop does."""
    files = Files(folder=folder.resolve())
    lines = (files.text(file) or "").split("\n")
    name = re.escape(right.partition("(")[0].rpartition(".")[2])
    call = re.compile(rf"((?:\w+\.)*{name})\([^()]*\)")
    if line <= len(lines) and len(call.findall(lines[line - 1])) == 1:
        given = right.partition("(")[2]
        lines[line - 1] = call.sub(lambda found: f"{found[1]}({given}", lines[line - 1])
        files.change("loop-rate", file, "\n".join(lines), f"line {line} of {file}: the loop has another rate")
    return list(files.repairs)


def message_type(folder: Path, file: str, line: int, package: str, name: str) -> list[Repair]:
    """Return the repair that subscribes with another type on a line of a script, and imports it."""
    files = Files(folder=folder.resolve())
    lines = (files.text(file) or "").split("\n") if file.endswith(".py") else []
    code = lines[line - 1] if line <= len(lines) else ""
    given = re.search(r"Subscriber\(\s*[^,()]+,\s*(?:data_class\s*=\s*)?([\w.]+)", code)
    module = f"{package}.msg"
    imported = next((i for i, one in enumerate(lines) if one.startswith(f"from {module} import ")), None)
    whole = f"import {module}" in lines
    if given is None or not (whole or imported is not None):
        return []
    lines[line - 1] = code[: given.start(1)] + (f"{module}.{name}" if whole else name) + code[given.end(1) :]
    if imported is not None and not whole:
        names = re.findall(r"[\w*]+", lines[imported].partition(" import ")[2])
        rest = "\n".join(lines[imported + 1 :])
        used = [one for one in names if one != given[1] or re.search(rf"\b{one}\b", rest)]
        new = [] if {"*", name} & {*names} else [name]
        lines[imported] = f"from {module} import {', '.join([*used, *new])}" if new else lines[imported]
    message = f"line {line} of {file}: the topic has the type {package}/{name}"
    fix = f"write `{lines[line - 1].strip()}`"
    files.change("message-type", file, "\n".join(lines), message, fix)
    return list(files.repairs)


NUMBERS = re.compile(r"Float(?:32|64)|U?Int(?:8|16|32|64)")
"""Messages of one number, whose `data` may be that of another one."""


def number_type(folder: Path, file: str, line: int, name: str) -> list[Repair]:
    """Return the repair that publishes numbers with another type of `std_msgs`, wherever a script names the one that
    the publisher on this line has; none where it has that for another topic, too."""
    files = Files(folder=folder.resolve())
    text = files.text(file) or "" if file.endswith(".py") else ""
    lines = text.split("\n")
    given = re.search(r"Publisher\([^()]*?\b([A-Z]\w+)", lines[line - 1]) if line <= len(lines) else None
    if given is None or not NUMBERS.fullmatch(given[1]) or not NUMBERS.fullmatch(name):
        return []
    if (
        given[1][0] != name[0]
        or len(re.findall(rf"(?:Publisher|Subscriber)\([^()]*?\b{given[1]}\b", text)) > 1
    ):
        return []
    message = f"line {line} of {file}: the topic has the type std_msgs/{name}"
    after = re.sub(rf"\b{given[1]}\b", name, text)
    there = [str(n) for n, one in enumerate(lines, 1) if re.search(rf"\b{given[1]}\b", one)]
    fix = f"write {name} instead of {given[1]}, on line {join_words(there)}"
    files.change("message-type", file, after, message, fix)
    return list(files.repairs)


def swapped_arguments(folder: Path, file: str, line: int, function: str) -> list[Repair]:
    """Return the repair that swaps the two arguments of the line's only call of a function: `atan2(dx, dy)`."""
    files = Files(folder=folder.resolve())
    lines = (files.text(file) or "").split("\n")
    call = re.compile(rf"\b{function}\(({ARGUMENT})(,\s*)({ARGUMENT})\)")
    if line <= len(lines) and len(call.findall(lines[line - 1])) == 1:
        lines[line - 1] = call.sub(rf"{function}(\3\2\1)", lines[line - 1])
        message = f"line {line} of {file}: the two values of `{function}` are the wrong way round"
        files.change("missing-call", file, "\n".join(lines), message)
    return list(files.repairs)


ARGUMENT = r"(?:[^(),]|\([^()]*\))+"
"""With brackets in it that have none themselves."""


def with_semicolon(folder: Path, file: str, line: int) -> list[Repair]:
    """Return the repair that ends the statement of the last line of code up to this one of a C++ file."""
    files = Files(folder=folder.resolve())
    lines = (files.text(file) or "").split("\n")[:line]
    codes = [one.partition("//")[0].rstrip() for one in lines]
    at = next((i for i in range(len(codes) - 1, -1, -1) if codes[i].strip()), None)
    if at is None or codes[at].endswith((";", "{", "*/")):
        return []
    after = (files.text(file) or "").split("\n")
    after[at] = f"{codes[at]};{lines[at][len(codes[at]) :]}"
    files.change(
        "build-line", file, "\n".join(after), f"line {at + 1} of {file}: a `;` is missing at its end"
    )
    return list(files.repairs)


def other_item(folder: Path, file: str, right: str, wrong: str) -> Repair | None:
    """Return the repair that reads another part of a message, `axes[1]` for `axes[3]`; where a script reads both, each
    in the other one's place."""
    files = Files(folder=folder.resolve())
    text = files.text(file) or ""
    first = re.search(rf"\.{re.escape(wrong)}(?!\w)", text)
    if first is None:
        return None
    both = re.search(rf"\.{re.escape(right)}(?!\w)", text) is not None
    turned = {wrong: right, right: wrong}
    either = re.compile(rf"(?<=\.)(?:{re.escape(wrong)}|{re.escape(right)})(?!\w)")
    line = text.count("\n", 0, (either.search(text) or first).start()) + 1
    told = f"{wrong} is read where {right} is asked for"
    told = f"{wrong} and {right} are read in each other's place" if both else told
    message = f"line {line} of {file}: {told}"
    fix = f"write `.{right}` in place of `.{wrong}`" + (", and the other way round" if both else "")
    files.change("other-field", file, either.sub(lambda one: turned[one[0]], text), message, fix)
    return next(iter(files.repairs), None)


def other_field(folder: Path, file: str, field: str, other: str) -> Repair | None:
    """Return the repair that sets `field` of a message wherever a script sets `other`; None where it sets both, or the
    other one nowhere."""
    files = Files(folder=folder.resolve())
    text = files.text(file) or ""
    end = r"(?=\s*[-+*/]?=(?!=))"
    given = re.compile(rf"(?<=\.){re.escape(other)}{end}")
    first = given.search(text)
    if first is None or re.search(rf"\.{re.escape(field)}{end}", text):
        return None
    line = text.count("\n", 0, first.start()) + 1
    message = f"line {line} of {file}: {other} is set where {field} is asked for"
    fix = f"write `.{field} = …`, not `.{other} = …`"
    files.change("other-field", file, given.sub(lambda _: field, text), message, fix)
    return next(iter(files.repairs), None)


BY_HINT: tuple[tuple[re.Pattern[str], Callable[[Path, str, int, re.Match[str]], list[Repair]]], ...] = (
    (ASKED_RATE, lambda folder, _, __, told: loop_rate(folder, told[1], int(told[2]), told[3])),
    (ASKED_TYPE, topic_type),
    (PUBLISHED_TYPE, topic_type),
    (SWAPPED, lambda folder, file, _, told: swapped_arguments(folder, file, int(told[1]), told[2])),
    (
        NO_SEMICOLON,
        lambda folder, file, line, told: with_semicolon(folder, file, int(told[1] or line + 1) - 1),
    ),
    (HIDING, lambda _, __, ___, told: [no_longer_hiding(told[1])]),
    (WRITE_HANDLER, lambda folder, file, _, told: narrow_handler(folder, file, int(told[1]), told[2])),
    (
        IN_PLACE_OF_SPIN,
        lambda folder, file, _, told: other_call(
            folder, file, int(told[1]), told[2], wrong=SPIN, why="waits until the node ends"
        ),
    ),
    (
        IN_PLACE_OF_INPUT,
        lambda folder, file, _, told: other_call(
            folder, file, int(told[1]), told[2], wrong=INPUT, why="waits for input"
        ),
    ),
    (re.compile(r"^write `([^`]+)` instead of `(ord\([^`]+\))`"), without_ord),
    (re.compile(re.escape(TEXT_PLACE)), lambda folder, file, line, _: text_place(folder, file, line)),
    (CONVERTED, lambda folder, file, line, told: conversions(folder, file, line, told[1], told[2])),
)
"""What a hint says, and the repairs that do it, given the folder, the cited file and line, and what was found."""
