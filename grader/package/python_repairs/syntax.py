"""Repairs of Python sources that do not parse, step by step: tabs, Python 2, braces, a token that is missing.

A text comes in, and the steps go out after which it parses; what one line could mean is known to
`grader/line_slips/python.py`. It runs in a child process as `examine.py` does: the standard library and fissix only,
and nothing is executed.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable, Iterator
from functools import lru_cache
from typing import Any

from grader.line_slips.python import (
    KNOWN_WORDS,
    PLAIN,
    corrections,
    reason_of_line,
    text_of_many_lines,
    with_known_words,
    without_brace,
    without_texts,
)
from grader.line_slips.python_habits import DELETE_LINE
from grader.package.lint.script_blocks import blocks_of, first_version, lacks_head, with_head
from grader.package.lint.script_spellings import without_types
from grader.package.python_repairs.blocks import (
    Error,
    in_their_blocks,
    is_in_comments,
    is_right,
    read_furthest,
    syntax_error,
    with_body_uncommented,
    with_head_of_global,
    with_line,
    with_line_moved,
    with_lines_turned,
)
from grader.package.python_repairs.python2 import as_python3

STEPS_MAX = 60
ALL_OVER = ("merged", "tabs", "python2", "braces", "characters")
OF_SIGNS = re.compile("does not match opening|unmatched|unterminated")
OF_WHOLE = re.compile(
    "__future__|future feature|global declaration|outside function|outside loop|not properly in loop"
)
"""What Python says only of a file that it could read to its end."""
OF_BLOCK = re.compile(r"(elif|else|except|finally|try)\b")
ROSPY_COMMA = re.compile(r"(?<![\w.])rospy\s*[,;:]\s*(?=[A-Za-z]\w*\s*[(:])")
FUTURE = re.compile(r"\s*from\s+__future__\s+import\s+[\w \t,]+(#.*)?")
Step = dict[str, Any]
"""`cause`, `line`, the `text` that comes out, and for what does not parse the `error`."""


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
        if is_right(text.split("\n"), error["line"] - 1, candidate, left):
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
    pairs = zip([*before.split("\n"), None], after.split("\n"), strict=False)
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
    yield from with_body_uncommented(lines, error["message"])
    if error["message"].startswith("expected an indented block") and is_in_comments(lines, at):
        return
    if "global declaration" in error["message"]:
        yield from with_head_of_global(lines, at)
        yield from _with_global_first(text, error["line"])
    yield from in_their_blocks(lines, at, error["message"])
    yield from (("python2", candidate) for candidate in as_python3(lines, at))
    yield from (("token", "\n".join(candidate)) for candidate in text_of_many_lines(lines, at))
    if any(map(without_brace, lines[: at + 1])):
        yield "braces", _without_braces(lines)
    for line in dict.fromkeys((at, max(at - 1, 0))):
        told = (error["message"], error["column"]) if line == at else ()
        known = _words_beside(lines, line)
        for changed in with_known_words(lines[line], list(corrections(lines[line], *told)), known):
            cause = "characters" if changed == lines[line].translate(PLAIN) else "token"
            yield cause, with_line(lines, line, changed)
    is_headless = error["message"] == "unexpected indent" and lacks_head(lines, at)
    if (error["kind"] == "IndentationError" and not is_headless) or OF_BLOCK.match(lines[at].strip()):
        moved = [("level", candidate) for candidate in with_line_moved(lines, at)]
        moved += [("turned", candidate) for candidate in with_lines_turned(lines, at)]
        right = [one for one in moved if is_right(lines, at, one[1])]
        yield from right or [("level", candidate) for candidate in read_furthest(lines, at)]


def _words_beside(lines: list[str], at: int) -> set[str]:
    """Return the words that are Python's, or rospy's, or stand in the code of other lines."""
    code = "\n".join(without_texts(line) for line in (*lines[:at], *lines[at + 1 :]))
    return {*KNOWN_WORDS, *re.findall(r"[^\W\d]\w*", code)}


def _without_line(lines: list[str], at: int) -> str:
    """Return the text with an empty line in its place: what follows is told by the lines that it has. The second line
    takes the place of the first where it is meant to be the shebang."""
    first = lines[1] if not at and lines[1:] and lines[1].startswith("#!") else ""
    emptied = with_line(lines, at, first)
    return emptied if not first else with_line(emptied.split("\n"), 1, "")


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
