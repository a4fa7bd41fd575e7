"""A Python file with the exact position of every node, and edits of it that leave the rest as it is.

Mistakes are edits of the text, not of a syntax tree: many of them are not valid Python, and a tree cannot hold those.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence
from functools import cached_property
from typing import TypeVar

from grader.authoring.mutation.text_edits import Edit

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
        """The nodes around it, from the nearest outwards."""
        while node in self.parents:
            node = self.parents[node]
            yield node

    def statement(self, node: ast.AST) -> ast.stmt:
        """Return the innermost statement that the node belongs to."""
        return next(n for n in (node, *self.above(node)) if isinstance(n, ast.stmt))

    def function(self, node: ast.AST) -> Function | None:
        return next((n for n in self.above(node) if isinstance(n, Function)), None)

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

    def replace(self, node: ast.AST, text: str) -> Edit:
        return Edit(*self.span(node), text)

    def remove(self, statement: ast.stmt) -> Edit:
        """Remove the statement's lines, or replace it by `pass` where its block would be empty without it."""
        alone = len(self.block(statement)) == 1 or not self.has_lines(statement)
        return self.replace(statement, "pass") if alone else Edit(*self._line_span([statement]), "")

    def before(self, statement: ast.stmt, *lines: str) -> Edit:
        start = self.starts[statement.lineno - 1]
        return Edit(start, start, self._indented(statement, lines))

    def after(self, statement: ast.stmt, *lines: str) -> Edit:
        end = self._line_span([statement])[1]
        glue = "" if self.text[:end].endswith("\n") else "\n"
        return Edit(end, end, glue + self._indented(statement, lines))

    def wrap(self, statements: Sequence[ast.stmt], header: str, footer: Sequence[str] = ()) -> Edit:
        """Put the statements one step deeper under the header; the footer's lines come after them."""
        start, end = self._line_span(statements)
        lines = self.text[start:end].removesuffix("\n").split("\n")
        inner = "".join(f"{self.unit}{line}\n" if line.strip() else f"{line}\n" for line in lines)
        first = statements[0]
        return Edit(start, end, self._indented(first, [header]) + inner + self._indented(first, footer))

    def can_wrap(self, statements: Sequence[ast.stmt]) -> bool:
        """Whether deeper indentation keeps their meaning: lines of their own, and no string over several lines."""
        strings = [n for s in statements for n in ast.walk(s) if isinstance(n, ast.Constant | ast.JoinedStr)]
        long = any(n.end_lineno != n.lineno for n in strings)
        return bool(statements) and not long and all(self.has_lines(s) for s in statements)

    def preamble(self, *lines: str) -> Edit:
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

    def _indented(self, statement: ast.stmt, lines: Sequence[str]) -> str:
        indentation = self.indentation(statement)
        return "".join(f"{indentation}{line}\n" for line in lines)


PREAMBLE = ("import itertools", "every_second = itertools.cycle((True, False))")


def every_second_time(script: Script, statements: Sequence[ast.stmt]) -> list[Edit]:
    """Return edits that run statements of one block in every second turn only; none where they cannot be indented."""
    if not script.can_wrap(statements):
        return []
    edits = [script.preamble(*PREAMBLE), script.before(statements[0], "turn = next(every_second)")]
    return edits + [script.wrap([statement], "if turn:") for statement in statements]
