"""Python files that Python 3 does not read, or that fail as soon as they run."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from grader.authoring.mutation.python import Function, Script
from grader.authoring.mutation.registry import NoParams, operator
from grader.authoring.mutation.ros import argument, calls, speech
from grader.authoring.mutation.solution import Site, Solution
from grader.authoring.mutation.spans import Edit, applied

OPEN_QUOTE, CLOSE_QUOTE = "\u2018", "\u2019"


def _broken(solution: Solution, script: Script, edits: list[Edit], line: int) -> Iterator[Site]:
    """The site, if what comes out is really no Python 3."""
    try:
        compile(applied(script.text, edits), script.path, "exec", dont_inherit=True)
    except SyntaxError:
        yield Site(at={"script": script.path}, tree=solution.edited(script.path, edits), line=line)


@operator("python2-print")
def python2_print(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Prints as Python 2 does.

    Fits every Python script that prints or logs something.
    """
    for script in solution.scripts:
        for statement in speech(script)[:1]:
            call = statement.value
            words = script.source(call.args[0]) if isinstance(call, ast.Call) and call.args else "'here'"
            yield from _broken(
                solution, script, [script.replace(statement, f"print {words}")], statement.lineno
            )


@operator("tabs-and-spaces")
def tabs_and_spaces(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Mixes tabs and spaces.

    Fits every Python script with a block of two lines.
    """
    for script in solution.scripts:
        found = (site for s in script.of(ast.stmt) for site in _tabbed(solution, script, s))
        yield from [site for site, _ in zip(found, range(1), strict=False)]


def _tabbed(solution: Solution, script: Script, statement: ast.stmt) -> Iterator[Site]:
    indentation = script.indentation(statement)
    first = statement is script.block(statement)[0]
    if not indentation or first or not script.has_lines(statement):
        return
    start = script.starts[statement.lineno - 1]
    if "\t" in indentation:
        edit = Edit(start, start + len(indentation), indentation.expandtabs(8))
    else:
        edit = Edit(start, start + min(len(indentation), 8), "\t")
    yield from _broken(solution, script, [edit], statement.lineno)


@operator("typographic-quote")
def typographic_quote(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Copies a text with its quotes from a PDF.

    Fits every Python script with a text as an argument.
    """
    for script in solution.scripts:
        texts = [
            a
            for call in script.of(ast.Call)
            for a in call.args
            if isinstance(a, ast.Constant) and isinstance(a.value, str) and script.source(a)[0] in "'\""
        ]
        for text in texts[:1]:
            edit = script.replace(text, OPEN_QUOTE + str(text.value) + CLOSE_QUOTE)
            yield from _broken(solution, script, [edit], text.lineno)


@operator("no-break-space")
def no_break_space(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Copies a line from a PDF, with a space that is none for Python.

    Fits every Python script with an assignment that has spaces around its sign.
    """
    for script in solution.scripts:
        for statement in script.of(ast.Assign):
            _, end = script.span(statement.targets[-1])
            if script.text[end : end + 3] == " = ":
                yield from _broken(solution, script, [Edit(end + 2, end + 3, "\u00a0")], statement.lineno)
                break


@operator("syntax-error")
def syntax_error(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Forgets the colon after `def`, `class` or `while`.

    Fits every Python script that has one of them.
    """
    for script in solution.scripts:
        heads = [n for n in script.of(ast.stmt) if isinstance(n, Function | ast.ClassDef | ast.While)]
        for node in heads[:1]:
            start, _ = script.span(node)
            end, _ = script.span(node.body[0])
            colon = script.text.rfind(":", start, end)
            yield from _broken(solution, script, [Edit(colon, colon + 1, "")], node.lineno)


@operator("missing-module")
def missing_module(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Imports messages of a package that is not there.

    Fits every Python script that imports rospy.
    """
    for script in solution.scripts:
        imports = [n for n in script.of(ast.Import) if any(a.name == "rospy" for a in n.names)]
        for statement in imports[:1]:
            edit = script.after(statement, "from beginner_tutorials.msg import Num")
            yield Site(
                at={"script": script.path}, tree=solution.edited(script.path, [edit]), line=statement.lineno
            )


@operator("asks-for-input")
def asks_for_input(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Waits for somebody to press Enter before it makes its node.

    Fits every Python script that makes a node.
    """
    for script in solution.scripts:
        for call in list(calls(script, "init_node"))[:1]:
            statement = script.statement(call)
            if argument(call, 0, "name") is not None and script.has_lines(statement):
                edit = script.before(statement, "input('Press Enter to start')")
                yield Site(
                    at={"script": script.path},
                    tree=solution.edited(script.path, [edit]),
                    line=statement.lineno,
                )
