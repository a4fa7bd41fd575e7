"""CMake's grammar: the tree that `cmake_parser` reads, or where that fails, the line and the plain cause."""

from __future__ import annotations

import re

from cmake_parser import CMakeError, Token, parse_raw, parse_tree, tokenize
from cmake_parser import ast as nodes

from grader.model.package import Fault

_NESTING_LIMIT = 50
_WORK_LIMIT = 20_000_000
_BLOCKS = ("if", "foreach", "while", "function", "macro", "block")
_MIDDLE = ("else", "elseif")
_LINK_LETTERS = 4_095
_LINK_TEXT = re.compile(r"\s*(\.{0,2}/)?[\w./-]+/[\w./-]+\s*")

# A `#[` that opens no bracket comment is a plain comment to CMake, but not to the library.
_COMMENTS = re.compile(
    r"""(?P<keep>"(?:\\.|[^\\"])*"|\#?\[(=*)\[.*?\]\2\]|\#(?!\[)[^\n]*|\\.)|\#\[""", re.DOTALL
)
_OPENERS = re.compile(r"\[=*\[")


def parse_tree_of(data: bytes, file: str) -> tuple[list[nodes.AstFileNode], Fault | None]:
    """The top-level commands and blocks of a CMake file, up to the fault where there is one. Never raises."""
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        cause = f"`{file}` is saved as UTF-16: save it as UTF-8"
        return [], Fault(file=file, line=1, kind="ParseError", message="is UTF-16", cause=cause)
    text = _readable(data)
    if text is None:
        return [], _fault(file, None, "too many brackets", f"`{file}` holds too many `[[` to be read")
    commands, fault = _commands(text, file)
    whole, unbalanced = _balanced(commands, file)
    fault = unbalanced or fault
    if fault is not None and whole:
        text = text[: whole[-1].span.stop]
    tree: list[nodes.AstFileNode] = []
    try:
        tree.extend(parse_tree(text, skip_comments=True) if whole else ())
    except CMakeError as error:  # break(1)
        line = tree[-1].line if tree else 1
        fault = fault or _fault(file, line, str(error), "")
    return tree, fault


def commands_of(data: bytes) -> list[nodes.Command] | None:
    """Every command of a CMake file, those in blocks and definitions too; None where it cannot be read through."""
    text = _readable(data)
    commands, fault = ([], None) if text is None else _commands(text, "")
    return None if text is None or fault else commands


def _readable(data: bytes) -> str | None:
    """The text as the library takes it; None where that would take it too long."""
    text = data.decode("utf-8-sig", "replace").replace("\r\n", "\n").replace("\0", " ")
    if len(_OPENERS.findall(text)) * len(text) > _WORK_LIMIT:
        return None
    return _COMMENTS.sub(lambda found: found["keep"] or "# ", text)


def _commands(text: str, file: str) -> tuple[list[nodes.Command], Fault | None]:
    commands: list[nodes.Command] = []
    try:
        commands.extend(parse_raw(text, skip_comments=True))
    except RecursionError:
        return commands, _fault(file, None, "nested too deep", "brackets are nested too deep")
    except CMakeError as error:
        return commands, _explained(text, commands[-1].span.stop if commands else 0, file, str(error))
    return commands, None


def _explained(text: str, end: int, file: str, message: str) -> Fault:
    """The fault of the command that begins behind `end`, the place where the last good one stopped."""
    tokens = [t for t in tokenize(text) if t.kind != "COMMENT" and t.span.start >= end]
    first = tokens[0] if tokens else Token("RAW", "", slice(end, end), text.count("\n") + 1, 1)
    unparsed = next((t for t in tokens if t.kind == "UNPARSEABLE"), None)
    line, cause = first.line, f"`{_word(first)}` is no command: CMake expects name(...)"
    if unparsed is not None and text[unparsed.span].startswith('"'):
        line, cause = unparsed.line, 'a quote `"` is opened here and never closed'
    elif first.kind == "RPAREN":
        cause = "there is a `)` too many"
    elif "unexpected end of file" in message and len(tokens) > 1 and tokens[1].kind == "LPAREN":
        cause = f"the `(` of `{_word(first)}(` is never closed by `)`"
    elif end == 0 and len(text) <= _LINK_LETTERS and _LINK_TEXT.fullmatch(text):
        cause = "the file holds only the path that a link should lead to, no CMake commands"
    return _fault(file, line, message, cause)


def _word(token: Token) -> str:
    return str(token.value or "")[:40]


def _balanced(commands: list[nodes.Command], file: str) -> tuple[list[nodes.Command], Fault | None]:
    """The commands up to the last one outside every open block, and the fault where blocks do not match."""
    open_blocks: list[nodes.Command] = []
    whole = 0
    for count, command in enumerate(commands, 1):
        name = command.identifier.lower()
        block = name.removeprefix("end")
        if name in _BLOCKS:
            open_blocks.append(command)
        elif name in _MIDDLE or (name.startswith("end") and block in _BLOCKS):
            wanted = "if" if name in _MIDDLE else block
            if not open_blocks or open_blocks[-1].identifier.lower() != wanted:
                cause = f"`{name}()` has no `{wanted}()` before it that is still open"
                return commands[:whole], _fault(file, command.line, f"flow control: {name}", cause)
            if name not in _MIDDLE:
                open_blocks.pop()
        if len(open_blocks) > _NESTING_LIMIT:
            return commands[:whole], _fault(
                file, command.line, "nested too deep", "blocks are nested too deep"
            )
        whole = whole if open_blocks else count
    if open_blocks:
        name = open_blocks[0].identifier.lower()
        cause = f"`{name}()` is never closed by `end{name}()`"
        return commands[:whole], _fault(file, open_blocks[0].line, f"flow control: {name}", cause)
    return commands, None


def _fault(file: str, line: int | None, message: str, cause: str) -> Fault:
    return Fault(file=file, line=line, kind="ParseError", message=message, cause=cause)
