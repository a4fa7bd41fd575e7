"""Files with the exact place of everything in them, and edits by these places that leave the rest as it is.

Mistakes are edits of the text, not of a syntax tree: many of them are not valid Python, and a tree cannot hold those.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TypeVar
from xml.parsers import expat


@dataclass(frozen=True, order=True)
class TextEdit:
    """`text` takes the place of the characters from `start` up to `end`."""

    start: int
    end: int
    text: str


def apply_edits(text: str, edits: Iterable[TextEdit]) -> str:
    """Return the text with all edits made. Raises ValueError where two of them overlap."""
    parts, position = [], 0
    for edit in sorted(edits):
        if edit.start < position:
            raise ValueError(f"two edits overlap at {edit.start}")
        parts += [text[position : edit.start], edit.text]
        position = edit.end
    return "".join([*parts, text[position:]])


def line_at(text: str, position: int) -> int:
    """Return the line of a position, counted from 1."""
    return text.count("\n", 0, position) + 1


def whole_lines(text: str, start: int, end: int) -> tuple[int, int]:
    """Return the span with its indentation and line end, where it has its lines for itself; else the span as it is."""
    first = text.rfind("\n", 0, start) + 1
    last = text.find("\n", end)
    last = len(text) if last < 0 else last + 1
    alone = not text[first:start].strip() and not text[end:last].strip()
    return (first, last) if alone else (start, end)


# ---- misspellings

OPENING = re.compile(r"""^[a-zA-Z]{0,2}(?:'''|\"\"\"|'|")""")
WORD = re.compile(r"\{[^{}]*\}|%\(\w+\)\w|%[-+ #0-9.]*[a-z]|\\.|([^\W\d_]{3,})")


def misspelt_name(name: str) -> str:
    """Return a name without its last letter but one: `chattr`."""
    return name[:-2] + name[-1:] if len(name) > 2 else f"{name}{name[-1:]}"


def misspelt_literal(source: str) -> str:
    """Return a text's source with its first word misspelt, places for values left alone; unchanged without one."""
    opening = OPENING.match(source)
    start = opening.end() if opening else 0
    for match in WORD.finditer(source, start):
        if match[1]:
            return source[: match.start(1)] + misspelt_name(match[1]) + source[match.end(1) :]
    return source


def texts_in(node: ast.AST) -> Iterator[ast.Constant | ast.JoinedStr]:
    """Yield the texts of an expression, an f-string as one; none that only names something (`get_param('x')`,
    `d['x']`)."""
    if isinstance(node, ast.JoinedStr) or (isinstance(node, ast.Constant) and isinstance(node.value, str)):
        yield node
        return
    if isinstance(node, ast.Subscript):
        return
    named = isinstance(node, ast.Call) and ast.unparse(node.func).rpartition(".")[2].startswith("get_")
    for child in ast.iter_child_nodes(node) if not named else ():
        yield from texts_in(child)


ATTRIBUTE = re.compile(rb"""([\w:.-]+)\s*=\s*("[^"]*"|'[^']*')""")
START_TAG = re.compile(rb"""<[^<>"']*(?:"[^"]*"[^<>"']*|'[^']*'[^<>"']*)*>""")


@dataclass(kw_only=True)
class Element:
    """`start` to `end` is the whole element, `inner` what begins after its start tag; places in bytes."""

    tag: str
    attributes: dict[str, str]
    start: int
    inner: int
    end: int = 0
    parent: Element | None = None
    children: list[Element] = field(default_factory=list)

    def all(self) -> Iterator[Element]:
        yield self
        for child in self.children:
            yield from child.all()


class Document:
    """An XML file. Raises ValueError where it is not well-formed."""

    def __init__(self, path: str, data: bytes) -> None:
        self.path = path
        self.data = data
        self._open: list[Element] = []
        self._parser = expat.ParserCreate()
        self._parser.StartElementHandler = self._on_start_tag
        self._parser.EndElementHandler = self._on_end_tag
        self.root: Element | None = None
        try:
            self._parser.Parse(data, True)
        except expat.ExpatError as error:
            raise ValueError(str(error)) from error

    def _on_start_tag(self, tag: str, attributes: dict[str, str]) -> None:
        start = self._parser.CurrentByteIndex
        match = START_TAG.match(self.data, start)
        inner = match.end() if match else start
        parent = self._open[-1] if self._open else None
        element = Element(tag=tag, attributes=attributes, start=start, inner=inner, parent=parent)
        if parent is None:
            self.root = element
        else:
            parent.children.append(element)
        self._open.append(element)

    def _on_end_tag(self, _tag: str) -> None:
        element = self._open.pop()
        closed_itself = self.data[: element.inner].endswith(b"/>")
        index = self._parser.CurrentByteIndex
        element.end = element.inner if closed_itself else self.data.index(b">", index) + 1

    def elements(self, *tags: str) -> list[Element]:
        return [e for e in (self.root.all() if self.root else ()) if e.tag in tags]

    @property
    def text(self) -> str:
        """One character a byte, so that places are the parser's."""
        return self.data.decode("latin-1")

    def content(self, element: Element) -> str:
        """Return the element's own text, without the space around it."""
        end = self.data.rfind(b"</", element.inner, element.end)
        return self.data[element.inner : max(end, element.inner)].decode(errors="replace").strip()

    def line(self, element: Element) -> int:
        return self.data.count(b"\n", 0, element.start) + 1

    # ---- edits, in places of `text`

    def remove(self, element: Element) -> TextEdit:
        return TextEdit(*whole_lines(self.text, element.start, element.end), "")

    def set_content(self, element: Element, content: str) -> TextEdit:
        end = self.data.rfind(b"</", element.inner, element.end)
        return TextEdit(element.inner, end, content)

    def set_attribute(self, element: Element, name: str, value: str) -> TextEdit:
        start, end = self._attribute(element, name)
        return TextEdit(start, end, f'{name}="{value}"')

    def remove_attribute(self, element: Element, name: str) -> TextEdit:
        start, end = self._attribute(element, name)
        while self.data[start - 1 : start].isspace():
            start -= 1
        return TextEdit(start, end, "")

    def _attribute(self, element: Element, name: str) -> tuple[int, int]:
        found = ATTRIBUTE.finditer(self.data, element.start, element.inner)
        return next(m.span() for m in found if m[1].decode() == name)


NodeT = TypeVar("NodeT", bound=ast.AST)
Function = ast.FunctionDef | ast.AsyncFunctionDef
IMPORTS = (ast.Import, ast.ImportFrom)
PLACED = (ast.stmt, ast.expr, ast.alias, ast.keyword, ast.arg, ast.excepthandler)


class Script:
    """One Python source. `path` is relative to the package. Raises SyntaxError where it does not compile."""

    def __init__(self, path: str, text: str) -> None:
        self.path = path
        self.text = text
        self.module = ast.parse(text)
        self.lines = text.split("\n")
        self.starts = [0]
        for line in self.lines:
            self.starts.append(self.starts[-1] + len(line) + 1)

    @cached_property
    def nodes(self) -> tuple[ast.AST, ...]:
        """Every node in the order of the text."""
        found = [node for node in ast.walk(self.module) if isinstance(node, PLACED)]
        return tuple(sorted(found, key=lambda node: (node.lineno, node.col_offset)))

    def of(self, kind: type[NodeT]) -> Iterator[NodeT]:
        return (node for node in self.nodes if isinstance(node, kind))

    @cached_property
    def parents(self) -> dict[ast.AST, ast.AST]:
        return {child: node for node in ast.walk(self.module) for child in ast.iter_child_nodes(node)}

    def above(self, node: ast.AST) -> Iterator[ast.AST]:
        """Yield the nodes around it, from the nearest outwards."""
        while node in self.parents:
            node = self.parents[node]
            yield node

    def statement(self, node: ast.AST) -> ast.stmt:
        """Return the innermost statement that the node belongs to."""
        return next(n for n in (node, *self.above(node)) if isinstance(n, ast.stmt))

    def block(self, statement: ast.stmt) -> list[ast.stmt]:
        """Return the list of statements that it stands in."""
        parent = self.parents[statement]
        blocks = [value for _, value in ast.iter_fields(parent) if isinstance(value, list)]
        return next(block for block in blocks if statement in block)

    # ---- places

    def span(self, node: ast.AST) -> tuple[int, int]:
        start = self._offset(node.lineno, node.col_offset)  # type: ignore[attr-defined]
        return start, self._offset(node.end_lineno, node.end_col_offset)  # type: ignore[attr-defined]

    def _offset(self, line: int, column: int) -> int:
        """`ast` counts columns in bytes of UTF-8."""
        return self.starts[line - 1] + len(self.lines[line - 1].encode()[:column].decode())

    def source(self, node: ast.AST) -> str:
        start, end = self.span(node)
        return self.text[start:end]

    def indentation(self, statement: ast.stmt) -> str:
        line = self.lines[statement.lineno - 1]
        return line[: len(line) - len(line.lstrip())]

    @cached_property
    def unit(self) -> str:
        """One step of indentation, as this file has it."""
        indents = {self.indentation(s) for s in self.of(ast.stmt) if self.has_lines(s)}
        return min(indents - {""}, key=len, default="    ")

    def has_lines(self, statement: ast.stmt) -> bool:
        """Return whether its lines hold nothing else: no `;`, no `if x: y`. A comment after it counts as its own."""
        start, end = self.span(statement)
        before = self.text[self.starts[statement.lineno - 1] : start]
        after = self.text[end:].partition("\n")[0].strip()
        return not before.strip() and (not after or after.startswith("#"))

    # ---- edits

    def replace(self, node: ast.AST, text: str) -> TextEdit:
        return TextEdit(*self.span(node), text)

    def remove(self, statement: ast.stmt) -> TextEdit:
        """Remove the statement's lines, or replace it by `pass` where its block would be empty without it."""
        alone = len(self.block(statement)) == 1 or not self.has_lines(statement)
        return self.replace(statement, "pass") if alone else TextEdit(*self._line_span([statement]), "")

    def before(self, statement: ast.stmt, *lines: str) -> TextEdit:
        start = self.starts[statement.lineno - 1]
        return TextEdit(start, start, self._indent(statement, lines))

    def after(self, statement: ast.stmt, *lines: str) -> TextEdit:
        end = self._line_span([statement])[1]
        glue = "" if self.text[:end].endswith("\n") else "\n"
        return TextEdit(end, end, glue + self._indent(statement, lines))

    def wrap(self, statements: Sequence[ast.stmt], header: str, footer: Sequence[str] = ()) -> TextEdit:
        """Put the statements one step deeper under the header; the footer's lines come after them."""
        start, end = self._line_span(statements)
        lines = self.text[start:end].removesuffix("\n").split("\n")
        inner = "".join(f"{self.unit}{line}\n" if line.strip() else f"{line}\n" for line in lines)
        first = statements[0]
        return TextEdit(start, end, self._indent(first, [header]) + inner + self._indent(first, footer))

    def can_wrap(self, statements: Sequence[ast.stmt]) -> bool:
        """Return whether deeper indentation keeps their meaning: lines of their own, no string over several lines."""
        strings = [n for s in statements for n in ast.walk(s) if isinstance(n, ast.Constant | ast.JoinedStr)]
        long = any(n.end_lineno != n.lineno for n in strings)
        return bool(statements) and not long and all(self.has_lines(s) for s in statements)

    def preamble(self, *lines: str) -> TextEdit:
        """Insert lines at the top level, after the docstring and the first imports."""
        body = self.module.body
        docstring = isinstance(body[0], ast.Expr) and isinstance(body[0].value, ast.Constant)
        ends = [statement for statement in body[:1] if docstring]
        for statement in body[len(ends) :]:
            if not isinstance(statement, IMPORTS):
                break
            ends.append(statement)
        return self.after(ends[-1], *lines) if ends else self.before(body[0], *lines)

    def _line_span(self, statements: Sequence[ast.stmt]) -> tuple[int, int]:
        last = statements[-1].end_lineno or statements[-1].lineno
        return self.starts[statements[0].lineno - 1], min(self.starts[last], len(self.text))

    def _indent(self, statement: ast.stmt, lines: Sequence[str]) -> str:
        indentation = self.indentation(statement)
        return "".join(f"{indentation}{line}\n" for line in lines)


PREAMBLE = ("import itertools", "every_second = itertools.cycle((True, False))")


def every_second_time(script: Script, statements: Sequence[ast.stmt]) -> list[TextEdit]:
    """Return edits that run statements of one block in every second turn only; none where they cannot be indented."""
    if not script.can_wrap(statements):
        return []
    edits = [script.preamble(*PREAMBLE), script.before(statements[0], "turn = next(every_second)")]
    return edits + [script.wrap([statement], "if turn:") for statement in statements]
